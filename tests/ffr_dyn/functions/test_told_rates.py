"""Derivatives that Python functions of time tell."""

import numpy as np
import pytest

import ffr_dyn as fd
from ffr_dyn.functions.told_rates import wrong_rate

TIMES = np.linspace(0.0, 2.0, 41)
RIGHT = {
    "sine": lambda t: (np.sin(3 * t), 3 * np.cos(3 * t), -9 * np.sin(3 * t)),
    "rest": lambda t: (0.3, 0.0, 0.0),
    "many turns": lambda t: (1e4 + 150 * t, 150.0, 0.0),
    "kink at a row": lambda t: (max(0.0, t - 1.0), float(t >= 1.0), 0.0),
    "jump at a row": lambda t: (float(t >= 1.0), 0.0, 0.0),
    "smooth start, then rest": lambda t: (t**3, 3 * t**2, 6 * t) if t < 0.5 else (0.125, 0.0, 0.0),
    "begins softly": lambda t: (t**5, 5 * t**4, 20 * t**3),
    "as differences tell": lambda t: (np.sin(t), np.sin(t + 5e-4) / 1e-3 - np.sin(t - 5e-4) / 1e-3, -np.sin(t)),
}
WRONG = {
    "rate of another unit": (lambda t: (np.sin(3 * t), np.degrees(3 * np.cos(3 * t)), -9 * np.sin(3 * t)), 1),
    "no rate": (lambda t: (np.sin(3 * t), 0.0, 0.0), 1),
    "no second derivative": (lambda t: (np.sin(3 * t), 3 * np.cos(3 * t), 0.0), 2),
    "of the other sign": (lambda t: (np.sin(3 * t), 3 * np.cos(3 * t), 9 * np.sin(3 * t)), 2),
    "in a tenth of the time": (lambda t: (t**3, 3 * t**2, 12 * t) if t < 0.2 else (8e-3, 0.0, 0.0), 2),
}


@pytest.mark.parametrize("name", RIGHT)
@pytest.mark.parametrize("times", [TIMES, TIMES[20:21], TIMES[:1], TIMES[:2]], ids=["rows", "one", "first", "two"])
def test_right_derivatives_are_not_doubted(name, times):
    assert wrong_rate(lambda t: np.array(RIGHT[name](t)), times) is None


@pytest.mark.parametrize("name", WRONG)
def test_wrong_derivatives_are_found(name):
    function, order = WRONG[name]
    found = wrong_rate(lambda t: np.array(function(t)), TIMES)
    assert found is not None
    assert found.order == order
    assert abs(found.told - found.found) > 0.05 * abs(found.found)
    untold = [np.inf, np.inf, np.nan]
    found = wrong_rate(lambda t: np.minimum(function(t), untold), TIMES)
    assert (found is None) == (order == 2)


def wheel(**more: object) -> fd.Scene:
    body = fd.rigid_body("wheel", mass=2.0, inertia=(0.1, 0.1, 0.2), points={"o": (0, 0, 0)})
    return fd.Scene(
        (fd.Body("wheel", body),),
        (fd.Joint("axle", "revolute", "ground.o", "wheel.o"),),
        ground={"o": (0, 0, 0)},
        **more,
    )


@pytest.mark.parametrize("analysis", [fd.kinematic, fd.forward, fd.inverse])
@pytest.mark.parametrize(
    ("function", "said"),
    [
        (lambda t: 5 * t**2, "second derivative.*are needed"),
        (lambda t: (5 * t**2, 10 * t), "second derivative.*are needed"),
    ],
    ids=["value", "value and rate"],
)
def test_a_driver_needs_its_derivatives(analysis, function, said):
    """Without them velocities and torques were those of a motion at rest."""
    with pytest.raises(fd.ComputationError, match=said):
        analysis(wheel(drivers=(fd.Driver("d", "axle", function),)), end=0.5, output_step=0.1)


@pytest.mark.parametrize("rate", [lambda t: 0.1 * t, lambda t: 10 * np.degrees(t)])
def test_a_driver_needs_its_own_rate(rate):
    scene = wheel(drivers=(fd.Driver("d", "axle", lambda t: (5 * t**2, rate(t), 10.0)),))
    with pytest.raises(fd.ComputationError, match="tells a rate of"):
        fd.kinematic(scene, end=0.5, output_step=0.1)


def test_a_search_for_a_step_begins_with_the_rates():
    """Of few calls; before, a rate that is not the function's looked as if it changed all the time."""
    calls = []

    def swing(t: float) -> tuple[float, float, float]:
        calls.append(t)
        return np.sin(3 * t), 6 * np.cos(3 * t), -18 * np.sin(3 * t)

    with pytest.raises(fd.ComputationError, match="tells a rate of"):
        fd.forward(wheel(drivers=(fd.Driver("d", "axle", swing),)), end=2.0, output_step=0.01)
    assert len(calls) < 500


def test_a_servo_that_damps_needs_the_rate_of_its_target():
    """0.2 c'' = 5 (3 cos 3t - c') + 10 (sin 3t - c); the rate was taken as zero."""

    def run(target: object, kd: float = 5.0) -> np.ndarray:
        servo = fd.Servo("s", "axle", target=target, kp=10.0, kd=kd)
        how = {"end": 1.0, "output_step": 0.25, "method": fd.ROS3(2e-3), "check": False}
        return fd.forward(wheel(forces=(servo,)), **how)["axle.angle"]

    with pytest.raises(fd.ComputationError, match=r"\(value, rate\), which are needed"):
        run(lambda t: np.sin(3 * t))
    with pytest.raises(fd.ComputationError, match="force 's': its Python function tells a second derivative of"):
        run(lambda t: (np.sin(3 * t), 3 * np.cos(3 * t), 9 * np.sin(3 * t)))
    told = run(lambda t: (np.sin(3 * t), 3 * np.cos(3 * t)))
    np.testing.assert_allclose(told, run(fd.formula("sin(3 * t)")), atol=1e-6)
    assert run(lambda t: np.sin(3 * t), kd=0.0).size == told.size
