"""The error of runs in which a Python function of the state jumps or has a kink: steps do not end there, and the order is
lost. A mass on a rail, whose motion is known in closed form."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from ffr_dyn.analyses.forward import forward
from ffr_dyn.consistency.step_error import Beside, order_shown, ranges
from ffr_dyn.integrators import RK4, ROS2, ROS3
from ffr_dyn.results.result import Quantity, Result
from ffr_dyn.scene.forces import Load
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import rigid_body

ROW = 0.02
SPAN = {"end": 0.6, "output_step": ROW}


def driven_by(force: Callable[[float, float], float]) -> Scene:
    """A mass of 1 kg that starts with 1 m/s, under a force of its place and speed."""
    mass = rigid_body("m", mass=1.0, inertia=(1, 1, 1), points={"c": (0, 0, 0)})
    rail = Joint("rail", "translational", "ground.O", "m.c", axis=(1, 0, 0))
    load = Load("push", "m.c", function=lambda t, state: (force(float(state.x[0]), float(state.v[0])), 0, 0))
    return Scene((Body("m", mass, velocity=(1, 0, 0)),), (rail,), loads=(load,), ground={"O": (0, 0, 0)}, plane="z")


def relay(t):
    half = np.floor(t / 0.25)
    late = t - 0.25 * half
    return (-1.0) ** half * (late - 4.0 * late**2)


def passed(t):
    there = (-1.0 + 1.3**0.5) / 5.0
    return np.where(t < there, t + 2.5 * t**2, 0.03 + 1.3**0.5 * (t - there))


def bounced(t):
    omega = 400.0**0.5
    away = 0.05 + np.pi / omega
    struck = 0.05 + np.sin(omega * np.clip(t - 0.05, 0, np.pi / omega)) / omega
    return np.where(t < 0.05, t, np.where(t > away, 0.05 - (t - away), struck))


def rubbed(t):
    """Half turns about -2/k and 2/k, of a spring of k = 100 N/m beside friction of 2 N."""
    amplitude = (0.1**2 + 0.02**2) ** 0.5
    first = (np.pi / 2 - np.arctan(0.2)) / 10.0
    half = np.maximum(0, np.ceil((t - first) / (np.pi / 10)))
    return -0.02 * (-1.0) ** half + (amplitude - 0.04 * half) * np.cos(10 * (t - first))


FORCES = {
    "relay": (lambda x, v: -8.0 * np.sign(x), relay),
    "step on the way": (lambda x, v: 5.0 * (x < 0.03), passed),
    "contact": (lambda x, v: -400.0 * max(0.0, x - 0.05), bounced),
    "friction": (lambda x, v: -100.0 * x - 2.0 * np.sign(v), rubbed),
}


@pytest.mark.parametrize("method", [ROS2(ROW / 4), ROS2(ROW / 16), ROS3(ROW / 8), RK4(ROW / 8), None], ids=str)
@pytest.mark.parametrize("name", FORCES)
def test_the_error_is_told_where_a_python_force_breaks(name, method):
    force, motion = FORCES[name]
    found = forward(driven_by(force), **SPAN, method=method, check=True)
    true = np.abs(found["m.R"][:, 0] - motion(found.time)).max()
    assert true > 1e-6 * ranges(found)["m.R"]
    assert found.attributes["errors"]["m.R"][0] / true >= 1 / 3


@pytest.mark.parametrize("method", [ROS3(ROW / 8), RK4(ROW / 2)], ids=str)
def test_a_smooth_python_force_keeps_its_order(method):
    found = forward(driven_by(lambda x, v: -100.0 * x), **SPAN, method=method, check=True)
    true = np.abs(found["m.R"][:, 0] - 0.1 * np.sin(10 * found.time)).max()
    assert 0.3 <= found.attributes["errors"]["m.R"][0] / true <= 5


@pytest.mark.parametrize(("grows", "shown"), [(2.0, 2.0), (1.0, 1.0), (1.5, 1.5), (3.0, 2.0)])
def test_the_order_is_that_by_which_differences_grow(grows, shown):
    time = np.linspace(0.0, 1.0, 51)

    def run(step):
        return Result(time, {"a.q": Quantity(np.sin(3 * time) + step**grows * time, "m")}, {}, {})

    others = [Beside(run(ratio * 0.01), ratio) for ratio in (2.0, 4.0)]
    assert order_shown(run(0.01), *others, 2.0) == shown
    assert order_shown(run(0.01), others[0], None, 2.0) == 1.0
