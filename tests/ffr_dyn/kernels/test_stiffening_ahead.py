"""Geometric stiffening as a function of time: what it rests on, its order, and when it is not used."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import factorial

import numpy as np
import pytest
from test_beam_stiffening import rod
from test_dyn_references import mass_point
from test_integrators_implicit import stiffened_pendulum

from ffr_dyn.analyses.forward import forward
from ffr_dyn.compile.engine import fill_rows, new_engine
from ffr_dyn.compile.workspace import _AT_END, _BEARABLE, new_record
from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.functions.time_functions import polynomial
from ffr_dyn.integrators import RK4, ROS2, ROS3, rk4, ros2, ros3
from ffr_dyn.kernels.stiffening.ahead import COUNT, IN_USE, PAUSE, SETTLED
from ffr_dyn.kernels.tables import MEANS, WATCH
from ffr_dyn.realtime.stepper import Stepper
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.forces import Load
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.model.material import Material
from ffr_prep.model.reference import FixedTo
from ffr_prep.structures.sections import rectangle

METAL = Material("metal", 7e9, 0.3, 5540.0)


@dataclass(frozen=True)
class SweptROS2(ROS2):
    """ROS2 that never looks ahead."""

    looks_ahead = 0


@dataclass(frozen=True)
class SweptROS3(ROS3):
    """ROS3 that never looks ahead."""

    looks_ahead = 0


@dataclass(frozen=True)
class SweptRK4(RK4):
    """RK4 that never looks ahead."""

    looks_ahead = 0


SWEPT = {ROS2: SweptROS2, ROS3: SweptROS3, RK4: SweptRK4}

# ---- what it rests on -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("order", _AT_END)
def test_means_over_the_last_intervals_give_the_value_at_their_end(order):
    ends = -np.arange(MEANS)
    for power in range(order):
        means = (ends ** (power + 1.0) - (ends - 1.0) ** (power + 1.0)) / (power + 1)
        assert np.dot(_AT_END[order], means) == pytest.approx(0.0**power, abs=1e-14)


def stability_function(method, z: complex) -> complex:
    """Of an undamped vibration of frequency omega after a step h, z = i h omega."""
    if method is RK4:
        return sum(z**k / factorial(k) for k in range(5))
    if method is ROS2:  # with k2 + 2 k1 in place of k2
        A, b = np.array([[ros2.GAMMA, 0.0], [1.0 - 2.0 * ros2.GAMMA, ros2.GAMMA]]), np.array([0.5, 0.5])
    else:
        A = np.reshape(ros3.ALPHA, (4, 4)) + np.reshape(ros3.GAMMAS, (4, 4)) + ros3.GAMMA * np.eye(4)
        b = np.array(ros3.WEIGHTS)
    return 1 + z * b @ np.linalg.solve(np.eye(b.size) - z * A, np.ones(b.size))


def lag(order: int, weights, at, angle: float) -> complex:
    """By what forces that are found late differ from what they should be, in a vibration that turns by an angle a step."""
    back = np.exp(-1j * angle)
    means = (np.exp(1j * angle) - 1) / (1j * angle) * back ** np.arange(1, MEANS + 1)
    late = sum(
        b * sum(np.prod([c + k for k in range(j)]) / factorial(j) * (1 - back) ** j for j in range(order))
        for b, c in zip(weights, at, strict=True)
    )
    return np.dot(_AT_END[order], means) * late / np.dot(weights, np.exp(1j * angle * np.array(at)))


@pytest.mark.parametrize(
    ("method", "weights", "at"),
    [(ROS2, (0.5, 0.5), (0.0, 1.0)), (ROS3, ros3.WEIGHTS, ros3.AT), (RK4, rk4.WEIGHTS, rk4.AT)],
)
def test_the_feedback_that_is_allowed_is_half_of_what_the_damping_of_the_method_bears(method, weights, at):
    """A force kappa q_ddot that comes late by the phase of H changes the amplitude by kappa |Im H| angle/2 a step."""
    order = method.looks_ahead
    assert order == method.order
    angles = np.linspace(0.05, 0.9 * min(method.reach, np.pi), 200)
    damping = [1 - abs(stability_function(method, 1j * angle)) for angle in angles]
    late = [abs(lag(order, weights, at, angle).imag) for angle in angles]
    bearable = np.min(2 * np.array(damping) / (np.array(late) * angles))
    assert 0.8 * _BEARABLE[order] < bearable / 2
    assert _BEARABLE[order] <= bearable / 2


# ---- order and accuracy -----------------------------------------------------------------------------------------------


def engine_of(scene: Scene, method):
    """An engine at the start, and a function that does a number of steps with it."""
    made = assemble(scene)
    engine = new_engine(made.system, made.x.copy(), made.v.copy(), method, (0.0, 0.0, 1e-9))
    record = new_record(made.system, 1)

    def go(steps: int) -> None:
        assert fill_rows(engine, record, 0.0, steps) == 0

    return engine, go


def spinning_blade(speed: float = 60.0) -> Scene:
    """A flexible blade on an axle that turns uniformly, from straight: stiffening is several times its own stiffness."""
    blade = rod(rectangle(0.02, 0.009), 1.2, 12, 4, FixedTo("root"), METAL)
    return Scene(
        (Body("blade", blade, omega_bar=(0, 0, speed)),),
        (Joint("axle", "revolute", "ground.O", "blade.root"),),
        (Driver("motor", "axle", polynomial(0.0, speed)),),
        ground={"O": (0, 0, 0)},
        gravity=(0.0, -9.81, 3.0),
    )


def deflection(scene: Scene, method, end: float) -> np.ndarray:
    return forward(scene, end=end, output_step=end, method=method)["blade.q"][-1]


@pytest.mark.parametrize(("method", "step"), [(ROS2, 2.5e-4), (ROS3, 2.5e-4), (RK4, 5e-5)])
def test_looking_ahead_keeps_the_order(method, step):
    scene, end = spinning_blade(), 0.05
    truth = deflection(scene, SweptRK4(5e-6), end)
    errors = np.array([[np.abs(deflection(scene, kind(h), end) - truth).max() for kind in (method, SWEPT[method])]
                       for h in (step, step / 2)])  # fmt: skip
    assert errors[1, 0] < errors[0, 0] / 2 ** (method.order - 0.3)
    np.testing.assert_allclose(errors[:, 0], errors[:, 1], rtol=0.02)
    engine, go = engine_of(scene, method(step))
    go(SETTLED)
    assert engine.work.bodies.ahead[IN_USE] == 0.0
    go(1)
    assert engine.work.bodies.ahead[IN_USE] == 1.0


@pytest.mark.parametrize(("method", "step"), [(ROS2, 0.02), (ROS3, 0.02), (ROS3, 0.006), (ROS3, 0.06)])
def test_fast_vibrations_do_not_grow_from_forces_that_come_late(method, step):
    """2000 steps of undamped modes, most of them too fast for the steps; stiffening is as large as what holds the lowest."""
    spun = replace(spinning_blade(10.0), gravity=(0.0, 0.0, 0.0))
    scene = replace(spun, bodies=(replace(spun.bodies[0], q=1e-3 * np.ones(spun.bodies[0].model.n)),))
    ahead, swept = (
        np.abs(forward(scene, end=2000 * step, output_step=20 * step, method=kind(step))["blade.q"]).max(axis=1)
        for kind in (method, SWEPT[method])
    )
    assert ahead[50:].max() < 1.3 * swept.max()


@pytest.mark.parametrize(("method", "step"), [(ROS3, 1.25e-4), (RK4, 5e-5)])
def test_two_links_whose_reactions_stiffen(method, step):
    scene = stiffened_pendulum()
    truth, swept, found = (
        forward(scene, end=0.05, output_step=0.05, method=method)
        for method in (SweptRK4(1e-5), SWEPT[method](step), method(step))
    )
    for name in ("one.q", "two.q", "two.tip.position"):
        assert np.abs(found[name] - truth[name])[-1].max() < 1.5 * np.abs(swept[name] - truth[name])[-1].max()


# ---- when it is not used ----------------------------------------------------------------------------------------------


def test_loads_that_change_themselves_too_much_are_swept():
    """Two slender links that turn fast bend, and a change of the loads then returns by more than the method bears."""
    scene = stiffened_pendulum()
    fast = replace(scene, bodies=tuple(replace(body, omega_bar=(0, 0, 20.0)) for body in scene.bodies))
    for links, used in ((scene, True), (fast, False)):
        engine, go = engine_of(links, ROS3(1e-4))
        go(300)
        ahead = engine.work.bodies.ahead
        assert bool(ahead[PAUSE] < WATCH) is used
        assert bool(ahead[COUNT] > 0.0) is used


def test_a_load_that_jumps_is_swept_and_costs_no_accuracy():
    """A pull along the blade that is there at once; later steps look ahead again."""
    step, start = 2e-4, 50
    pull = Load("pull", "blade.tip", force=(lambda t: 600.0 * (t > (start - 0.5) * step), 0.0, 0.0))
    scene = replace(spinning_blade(10.0), loads=(pull,))
    engine, go = engine_of(scene, ROS3(step))
    ahead = engine.work.bodies.ahead
    go(start)
    assert ahead[IN_USE] == 1.0
    go(1)
    assert ahead[IN_USE] == 0.0
    go(8 * WATCH)
    assert ahead[IN_USE] == 1.0
    truth = deflection(scene, SweptROS3(step / 8), 0.02)
    errors = [np.abs(deflection(scene, kind(step), 0.02) - truth).max() for kind in (ROS3, SweptROS3)]
    assert errors[0] < 1.2 * errors[1]


@pytest.mark.parametrize("share", [0.02, 0.2])
def test_loads_that_are_noisy_cost_no_accuracy(share):
    """A pull along the blade that is another in every step."""
    step = 2e-4
    noise = np.random.default_rng(1).uniform(-1, 1, 1000)
    pull = Load("pull", "blade.tip", force=(lambda t: 60.0 * (1 + share * noise[int(t / step + 0.01)]), 0.0, 0.0))
    scene = replace(spinning_blade(10.0), loads=(pull,))
    found, swept, truth = (
        forward(scene, end=0.1, output_step=0.002, method=method)["blade.q"]
        for method in (ROS3(step), SweptROS3(step), SweptROS3(step / 8))
    )
    assert np.abs(found - truth).max() < 1.2 * np.abs(swept - truth).max()


def test_a_new_length_of_steps_begins_anew():
    engine, go = engine_of(spinning_blade(), ROS3(2e-4))
    go(20)
    assert engine.work.bodies.ahead[IN_USE] == 1.0
    engine.tables.clock.time[:] = 1e-4
    go(SETTLED)
    assert engine.work.bodies.ahead[IN_USE] == 0.0
    go(1)
    assert engine.work.bodies.ahead[IN_USE] == 1.0


def test_a_restored_state_goes_on_to_the_same_bits():
    stepper = Stepper(stiffened_pendulum(), ROS3(2e-4), outputs=("two.tip.position", "one.q"))
    stepper.step(30)
    kept = stepper.save()
    runs = []
    for _ in range(2):
        stepper.restore(kept)
        stepper.step(40)
        runs.append({name: values.copy() for name, values in stepper.outputs().items()})
    for name, values in runs[0].items():
        np.testing.assert_array_equal(values, runs[1][name], err_msg=name)


def test_outputs_between_the_steps_change_nothing():
    scene = spinning_blade()
    often, seldom = (forward(scene, end=0.02, output_step=every, method=ROS3(2e-4)) for every in (2e-4, 0.02))
    assert often["blade.q"][-1].tobytes() == seldom["blade.q"][-1].tobytes()


def test_a_body_beside_others_that_are_not_stiffened():
    scene = stiffened_pendulum()
    weight = Body("weight", mass_point("weight", 0.1, c=(0, 0, 0)), position=(2.4, 0, 0), velocity=(0, 7.2, 0))
    joints = (*scene.joints, Joint("hook", "spherical", "two.tip", "weight.c"))
    mixed = replace(scene, bodies=(weight, scene.bodies[0], replace(scene.bodies[1], stiffening=False)), joints=joints)
    ends = [forward(mixed, end=0.02, output_step=0.02, method=kind(1e-4))["one.q"][-1] for kind in (ROS3, SweptROS3)]
    assert 0.0 < np.abs(ends[0] - ends[1]).max() < 1e-6 * np.abs(ends[1]).max()
