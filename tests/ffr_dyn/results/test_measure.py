"""Measured quantities: against finite differences, against each other, and the balance of power and work."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from synthetic import cloud

from ffr_dyn.analyses.forward import forward
from ffr_dyn.functions.rotation import rotation_matrix
from ffr_dyn.functions.time_functions import harmonic, polynomial
from ffr_dyn.integrators import RK4, ROS2
from ffr_dyn.results.power import Worked, work
from ffr_dyn.scene.drivers import Driver, PointDriver
from ffr_dyn.scene.forces import Load, SpringDamper
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_dyn.scene.sensors import Measurement
from ffr_prep.body import rigid_body
from ffr_prep.common.errors import InputError

GROUND = {"O": (0, 0, 0), "P": (0, 2, 0)}
SCENE = Scene(
    (
        Body("one", cloud(4, seed=1, stiffness=25.0), omega_bar=(0.0, 0.0, 3.0), damping=0.02),
        Body("two", cloud(3, seed=2, stiffness=25.0), position=(1.0, 0.0, 0.0)),
    ),
    (Joint("hinge", "revolute", "ground.O", "one.a"), Joint("elbow", "spherical", "one.b", "two.a")),
    loads=(
        Load(
            "push",
            "two.c",
            force=(harmonic(amplitude=5.0, frequency=2.0), 0.0, 1.0),
            moment=(0.0, 0.3, 0.0),
            axes="body",
        ),
        Load("pull", "one.c", function=lambda t, state: (np.sin(t), 0.0, -state.velocity("one.c")[2])),
    ),
    springs=(SpringDamper("rope", "ground.P", "two.b", 50.0, 1.0, 1.0),),
    measurements=(
        Measurement("gap", "one.c", "two.c"),
        Measurement("gap_in_two", "one.c", "two.c", axes="two"),
        Measurement("speed", "ground.O", "two.c", "velocity"),
        Measurement("closing", "one.c", "two.c", "acceleration"),
        Measurement("far", "one.c", "two.c", "distance"),
        Measurement("turned", "one.c", "two.c", "orientation"),
    ),
    ground=GROUND,
    gravity=(0.0, -9.81, 0.0),
)


@pytest.fixture(scope="module")
def run():
    return forward(SCENE, end=0.3, output_step=1e-3, method=RK4(2.5e-4), outputs=("*",))


def derivative(values, step):
    """Central differences of order four, of the rows 2 ... T-3."""
    return (values[:-4] - 8 * values[1:-3] + 8 * values[3:-1] - values[4:]) / (12 * step)


@pytest.mark.parametrize(
    ("of", "rate"),
    [
        ("two.c.position", "two.c.velocity"),
        ("two.c.velocity", "two.c.acceleration"),
        ("one.v", "one.a"),
        ("one.omega_bar", "one.alpha_bar"),
        ("one.q_dot", "one.q_ddot"),
        ("hinge.angle", "hinge.angle_rate"),
        ("measured.speed", "two.c.acceleration"),
        ("push.work", "push.power"),
        ("one.damping.work", "one.damping.power"),
    ],
)
def test_rates_are_the_derivatives(run, of, rate):
    found = derivative(run[of], 1e-3)
    scale = np.abs(run[rate]).max()
    np.testing.assert_allclose(found, run[rate][2:-2], atol=2e-5 * scale)


def test_relative_measurements_are_differences(run):
    gap = run["two.c.position"] - run["one.c.position"]
    np.testing.assert_array_equal(run["measured.gap"], gap)
    np.testing.assert_allclose(run["measured.far"], np.linalg.norm(gap, axis=1), rtol=1e-14)
    A = rotation_matrix(run["two.p"])
    np.testing.assert_allclose(run["measured.gap_in_two"], np.einsum("tkl,tk->tl", A, gap), atol=1e-13)
    closing = run["two.c.acceleration"] - run["one.c.acceleration"]
    np.testing.assert_array_equal(run["measured.closing"], closing)
    turned = rotation_matrix(run["measured.turned"])
    expected = np.einsum("tlk,tlm->tkm", *(rotation_matrix(run[f"{b}.c.orientation"]) for b in ("one", "two")))
    np.testing.assert_allclose(turned, expected, atol=1e-13)


def test_orientation_turns_with_the_angular_velocity(run):
    """A_dot = skew(omega) A, up to the square of the elastic rotation."""
    A = rotation_matrix(run["two.c.orientation"])
    spin = derivative(A, 1e-3) @ A[2:-2].transpose(0, 2, 1)
    omega = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)
    np.testing.assert_allclose(omega, run["two.c.angular_velocity"][2:-2], atol=0.02 * np.abs(omega).max())


def test_reactions_in_other_axes_are_the_same_vectors(run):
    force = run["elbow.force"]
    A = rotation_matrix(run["one.p"])
    np.testing.assert_allclose(run["elbow.force_i"], np.einsum("tkl,tk->tl", A, force), atol=1e-10)
    np.testing.assert_allclose(
        np.linalg.norm(run["hinge.force_joint"], axis=1), np.linalg.norm(run["hinge.force"], axis=1)
    )
    np.testing.assert_allclose(run["hinge.moment_joint.z"], 0, atol=1e-9)  # a hinge carries no moment about its axis


def unbalanced(result, scene) -> float:
    """Largest of energy - work since the start [J], over all the work that was done."""
    names = [thing.name for thing in (*scene.loads, *scene.springs, *scene.drivers)]
    names += [f"{body.name}.damping" for body in scene.bodies if body.model.n]
    total = sum(result[f"{name}.work"] for name in names)
    energy = result["energy.total"]
    return np.abs(energy - energy[0] - total).max() / max(np.abs(result[f"{name}.work"]).max() for name in names)


@pytest.mark.parametrize(("method", "order"), [(RK4, 4), (ROS2, 2)])
def test_work_of_all_forces_is_the_change_of_energy(method, order):
    """At the order of the method: each halving of the step."""

    def left(step: float) -> float:
        return unbalanced(forward(SCENE, end=0.2, output_step=0.02, method=method(step), outputs=("*",)), SCENE)

    errors = [left(1e-3), left(5e-4)]
    assert errors[1] < 2e-4 if order == 2 else errors[1] < 1e-8
    assert errors[0] / errors[1] > 0.8 * 2**order


def slider_crank() -> Scene:
    crank = rigid_body("crank", mass=1.2, inertia=(1e-3, 1e-3, 2e-3), points={"hub": (0, 0, 0), "pin": (0.15, 0, 0)})
    slider = rigid_body("slider", mass=0.4, inertia=(1e-4, 1e-4, 1e-4), points={"pin": (0, 0, 0)})
    rod = rigid_body(
        "rod",
        mass=0.6,
        inertia=(1e-4, 5e-3, 5e-3),
        centre_of_mass=(0.15, 0, 0),
        points={"a": (0, 0, 0), "b": (0.3, 0, 0)},
    )
    return Scene(
        (
            Body("crank", crank, rotation=(0, 0, 0.6)),
            Body("rod", rod, position=(0.124, 0.085, 0), rotation=(0, 0, -0.286)),
            Body("slider", slider, position=(0.412, 0, 0)),
        ),
        (
            Joint("bearing", "revolute", "ground.O", "crank.hub"),
            Joint("pin", "revolute", "crank.pin", "rod.a"),
            Joint("wrist", "spherical", "rod.b", "slider.pin"),
            Joint("guide", "translational", "ground.O", "slider.pin", axis=(1, 0, 0)),
        ),
        ground=GROUND,
        gravity=(0.0, -9.81, 0.0),
    )


@pytest.mark.parametrize(
    "drivers",
    [
        (Driver("motor", "bearing", polynomial(0.6, 20.0, 15.0)),),
        (Driver("ram", "guide", harmonic(amplitude=0.02, frequency=3.0, mean=0.41), coordinate="stroke"),),
        (PointDriver("pull", "ground.O", "slider.pin", x=harmonic(amplitude=0.02, frequency=3.0, mean=0.41)),),
    ],
)
def test_a_driver_does_the_work_that_the_energy_tells(drivers):
    scene = replace(slider_crank(), drivers=drivers)

    def left(step: float) -> float:
        return unbalanced(forward(scene, end=0.1, output_step=0.01, method=RK4(step), outputs=("*",)), scene)

    assert left(1e-3) < 1e-6
    assert left(2.5e-4) < 4e-9


def test_power_goes_through_the_joints():
    """What the motor gives arrives at the crank; what leaves it by the pin is missing from its energy."""
    scene = replace(
        slider_crank(), drivers=(Driver("motor", "bearing", polynomial(0.6, 20.0, 15.0)),), gravity=(0, 0, 0)
    )
    result = forward(scene, end=0.1, output_step=1e-3, method=RK4(1e-4), outputs=("*",))
    np.testing.assert_allclose(result["bearing.transmitted"], 0, atol=1e-8)
    rod, slider = result["pin.transmitted"], result["wrist.transmitted"]
    crank = result["motor.power"] - rod
    spinning = 2e-3 * 30.0 * (20.0 + 30.0 * result.time)  # I alpha omega
    np.testing.assert_allclose(crank, spinning, atol=1e-6 * np.abs(rod).max())
    moving = 0.4 * (result["slider.a"] * result["slider.v"]).sum(axis=1)
    np.testing.assert_allclose(slider, moving, atol=1e-6 * np.abs(slider).max())


def test_a_spring_without_damping_only_stores():
    scene = replace(
        SCENE, loads=(), springs=(SpringDamper("rope", "ground.P", "two.b", 50.0, 0.0, 1.0, 3.0),), measurements=()
    )
    result = forward(scene, end=0.2, output_step=0.02, method=RK4(5e-4), outputs=("rope.work", "energy.springs"))
    stored = result["energy.springs"]
    np.testing.assert_allclose(result["rope.work"], stored[0] - stored, atol=1e-9 * np.abs(stored).max())


def test_work_of_a_cubic_power_is_exact_after_two_steps():
    time = 0.1 * np.arange(12)
    total, _ = work(time, 4 * time**3, None)
    np.testing.assert_allclose(np.diff(total[2:]), np.diff(time[2:] ** 4), rtol=1e-12)
    first, left = work(time[:5], 4 * time[:5] ** 3, None)
    assert isinstance(left, Worked)
    rest, _ = work(time[5:], 4 * time[5:] ** 3, left)
    assert np.concatenate([first, rest]).tobytes() == total.tobytes()


@pytest.mark.slow
def test_work_does_not_change_the_motion(run):
    plain = forward(SCENE, end=0.3, output_step=1e-3, method=RK4(2.5e-4))
    assert all(quantity.values.tobytes() == run[name].tobytes() for name, quantity in plain.quantities.items())
    assert "push.work" not in plain.quantities


# ---- which are kept -------------------------------------------------------------------------------------------------


def test_only_what_is_wanted_is_kept():
    kept = forward(SCENE, end=0.01, output_step=0.01, outputs=("two.*.position", "energy.total", "measured.far"))
    assert list(kept.quantities) == [
        "two.a.position",
        "two.b.position",
        "two.c.position",
        "energy.total",
        "measured.far",
    ]


def test_an_output_that_does_not_exist_names_near_ones():
    with pytest.raises(InputError, match=r"outputs: 'two\.c\.positon' .* did you mean two\.c\.position"):
        forward(SCENE, end=0.01, output_step=0.01, outputs=("two.c.positon",))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Measurement("m", "one.a", "two.a", "colour"), ["'colour'", "position"]),
        (lambda: replace(SCENE, measurements=(Measurement("m", "one.a", "two.x"),)), ["no interface 'x'"]),
        (
            lambda: replace(SCENE, measurements=(Measurement("m", "one.a", "two.a", axes="tw"),)),
            ["'tw'", "did you mean 'two'"],
        ),
        (lambda: replace(SCENE, measurements=(Measurement("one", "one.a", "two.a"),)), ["more than once"]),
    ],
)
def test_measurements_that_cannot_be_made_are_named(make, words):
    with pytest.raises(InputError) as caught:
        make()
    for word in words:
        assert word in str(caught.value)
