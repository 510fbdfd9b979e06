"""Python functions that remember what they were called with: refused, as a run has no one order of calls."""

from collections import deque
from dataclasses import replace

import numpy as np
import pytest

import ffr_dyn as fd

ARM = fd.rigid_body(
    "arm", mass=2.0, inertia=(0.1, 0.1, 0.2), centre_of_mass=(0.3, 0, 0), points={"o": (0, 0, 0), "e": (0.6, 0, 0)}
)
SCENE = fd.Scene(
    (fd.Body("arm", ARM),), (fd.Joint("hinge", "revolute", "ground.o", "arm.o"),), ground={"o": (0, 0, 0)},
    gravity=(0, -9.81, 0),
)  # fmt: skip


COUNTED = iter(range(10**9))


def angle(state):
    x, y, _ = state.position("arm.e")
    return float(np.arctan2(y, x))


def sampled():
    """A controller of 100 Hz that holds its torque from sample to sample."""
    kept = {"next": 0.0, "torque": 0.0}

    def torque(t, state):
        if t >= kept["next"] - 1e-12:
            kept["torque"] = 30 * (0.5 - angle(state)) - 3 * state.omega_bar("arm")[2]
            kept["next"] += 0.01
        return kept["torque"]

    return torque


def integral():
    kept = {"t": 0.0, "sum": 0.0}

    def torque(t, state):
        kept["sum"] += 60 * (0.5 - angle(state)) * (t - kept["t"])
        kept["t"] = t
        return kept["sum"]

    return torque


def delayed(calls):
    kept = deque([0.0] * calls)

    def torque(t, state):
        kept.append(-state.omega_bar("arm")[2])
        return kept.popleft()

    return torque


def switched():
    kept = {"on": False}

    def torque(t, state):
        height = state.position("arm.e")[1]
        kept["on"] = height < -0.1 if height < -0.3 or height > -0.1 else kept["on"]
        return 5.0 * kept["on"]

    return torque


def noise():
    numbers = np.random.default_rng(1)
    return lambda t, state: numbers.normal()


def run(torque, **how):
    scene = replace(SCENE, forces=(fd.Actuator("own", "hinge", function=torque),))
    return fd.forward(scene, end=1.0, output_step=0.05, **how)


@pytest.mark.parametrize("make", [sampled, integral, lambda: delayed(7), lambda: delayed(300), noise])
@pytest.mark.parametrize("how", [{}, {"method": fd.ROS2(2e-3), "check": False}], ids=["found step", "given step"])
def test_a_function_that_remembers_is_refused(make, how):
    """A sampled controller was told to be exact to 2e-6 rad, and 0.9 rad off."""
    with pytest.raises(fd.InputError, match="force 'own': its Python function keeps something of its own"):
        run(make(), **how)


def test_hysteresis_is_found_in_the_rows():
    with pytest.raises(fd.InputError, match="keeps something of its own"):
        run(switched(), method=fd.ROS2(2e-3), check=False)


def test_a_function_that_has_run_already_is_refused_again():
    torque = sampled()
    for _ in range(3):
        with pytest.raises(fd.InputError, match="keeps something of its own"):
            run(torque, method=fd.ROS2(2e-3), check=False)


@pytest.mark.parametrize(
    "function",
    [
        fd.user(lambda t: np.random.default_rng().normal()),
        fd.user(lambda t: float(next(COUNTED))),
    ],
    ids=["noise", "counter"],
)
def test_a_function_of_time_that_remembers_is_refused(function):
    with pytest.raises(fd.InputError, match="keeps something of its own"):
        fd.forward(replace(SCENE, forces=(fd.Actuator("own", "hinge", force=function),)), end=0.1, output_step=0.05)


def test_what_depends_on_time_and_state_is_not_refused():
    calls = []

    def torque(t, state):
        calls.append(t)  # which changes no torque
        return np.sign(np.sin(40 * t)) - 0.3 * state.omega_bar("arm")[2] + (1 / (2 - t) if t < 1.5 else np.sqrt(-1.0))

    assert run(torque, method=fd.ROS2(2e-3), check=False).time[-1] == 1.0
    assert calls
