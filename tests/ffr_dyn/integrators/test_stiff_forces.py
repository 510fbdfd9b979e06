"""Stiff forces are implicit: slopes and rows against twins, orders, stability, friction and stops, what it costs nobody."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from planar_beam import planar_beam
from synthetic import cloud
from test_dyn_forces import PAIRS, free_pair, loaded, symmetric
from test_dyn_kernels import moved, random_state

import ffr_dyn as fd
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.compile.engine import new_engine
from ffr_dyn.compile.scene_tables import compile_scene
from ffr_dyn.equations.forces import At, applied
from ffr_dyn.equations.layout import layout
from ffr_dyn.functions.curves import Curve
from ffr_dyn.functions.time_functions import harmonic, signal
from ffr_dyn.integrators import HHT, RK4, ROS2, ROS3, AdaptiveROS3, GeneralisedAlpha, tolerances
from ffr_dyn.kernels.entry_points import evaluate, pull_forces, set_diagonal, solve
from ffr_dyn.kernels.forces.implicit import LEAST
from ffr_dyn.kernels.tables import BLOCK, BY_TIME, LANE, LANES, OK
from ffr_dyn.realtime.stepper import Stepper
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.forces import (
    Actuator,
    Bushing,
    JointFriction,
    JointSpring,
    JointStop,
    Servo,
    SpringDamper,
)
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import rigid_body
from ffr_prep.common.errors import InputError

GH = 0.03
GRAVITY = (0.0, -9.81, 0.0)
STIFF = {name: force for name, force in PAIRS.items() if force.stiff_coordinates}
EXACT = ("spring", "torsion spring", "servo")  # the others give more than their slopes


def evaluated(scene: Scene, x, v):
    """An engine of a W-method that has evaluated a state."""
    engine = new_engine(compile_scene(scene), x, v, ROS2(0.1))
    assert set_diagonal(engine.tables, GH) == OK
    assert evaluate(engine.tables, 0.37, engine.x, engine.v) == OK
    return engine


def rows_of(engine, load: int = 0):
    """(numbers of the rows of a force, their compliance, their pull)."""
    block, lane = engine.tables.model.loads.row[load, [BLOCK, LANE]]
    rows, own = engine.tables.model.rows, engine.work.rows
    count = rows.start[block + 1] - rows.start[block] - lane
    lanes = LANES * block + lane + np.arange(count)
    return rows.start[block] + lane + np.arange(count), own.compliance[lanes], own.pull[lanes]


# ---- slopes and rows ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", STIFF)
@pytest.mark.parametrize("sizes", [(4, 3), (0, 0)], ids=["flexible", "rigid"])
def test_compiled_slopes_are_those_of_the_twin(name, sizes):
    scene, force = loaded(STIFF[name], sizes), STIFF[name]
    for seed in range(3):
        x, v = random_state(scene, seed)
        now = At(scene, layout(scene), 0.37, x, v)
        (twin,) = applied(scene, now.place, 0.37, x, v)
        engine = evaluated(scene, x, v)
        measured = engine.work.loads.measured
        rate = measured[6:12] if isinstance(force, Bushing) else measured[1]
        stiffness, damping = force.slopes(now, twin.coordinate, rate)
        w = GH**2 * np.maximum(stiffness, 0.0) + GH * np.maximum(damping, 0.0)
        _, compliance, pull = rows_of(engine)
        np.testing.assert_allclose(compliance, 1 / np.maximum(w, LEAST), rtol=1e-9)
        np.testing.assert_allclose(pull, GH * np.maximum(stiffness, 0.0) * compliance, rtol=1e-9, atol=1e-12)


def rates_of(scene: Scene, x, v):
    """Rates of the coordinates of the only force, by differences of its places."""
    h = 1e-6
    ahead, behind = (applied(scene, layout(scene), 0.37, moved(scene, x, v, s), v)[0].coordinate for s in (h, -h))
    found = (np.asarray(ahead) - np.asarray(behind)) / (2 * h)
    return np.atleast_1d(found)[list(scene_force(scene).stiff_coordinates)]


def scene_force(scene: Scene):
    return (*scene.forces, *scene.springs)[0]


@pytest.mark.parametrize("name", STIFF)
@pytest.mark.parametrize("sizes", [(4, 3), (0, 0)], ids=["flexible", "rigid"])
def test_rows_are_the_gradients_of_the_coordinates_with_compliance(name, sizes):
    scene = loaded(STIFF[name], sizes)
    place, (x, v) = layout(scene), random_state(scene)
    engine = evaluated(scene, x, v)
    rows, compliance, _ = rows_of(engine)
    target = engine.tables.stages.target
    target[:] = np.random.default_rng(8).normal(size=target.size)
    assert solve(engine.tables, target) == OK
    acc = engine.work.bodies.acc.copy()
    for b in range(2):
        acc[place.R_dot(b)] = engine.work.bodies.A[b] @ acc[place.R_dot(b)]
    left = rates_of(scene, x, acc) - compliance * engine.work.rows.lam[rows]
    np.testing.assert_allclose(left, target[rows], atol=1e-6 * max(1.0, np.abs(acc).max()))


@pytest.mark.parametrize("name", STIFF)
@pytest.mark.parametrize("sizes", [(4, 3), (0, 0)], ids=["flexible", "rigid"])
def test_first_targets_hold_what_velocities_do_to_rates(name, sizes):
    """By differences of the rates along the motion with velocities as they are."""
    scene, h = loaded(STIFF[name], sizes), 1e-5
    x, v = random_state(scene)
    engine = evaluated(scene, x, v)
    rows, _, pull = rows_of(engine)
    rates = [rates_of(scene, moved(scene, x, v, s), v) for s in (h, 0.0, -h)]
    bias, target = (rates[0] - rates[2]) / (2 * h), engine.tables.stages.target
    target[:] = 7.0
    assert pull_forces(engine.tables, 0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, target) == OK
    np.testing.assert_allclose(target[rows], -bias - pull * rates[1], atol=1e-4 * max(1.0, np.abs(bias).max()))
    assert (np.delete(target, rows) == 7.0).all()


def test_a_servo_knows_how_fast_its_law_changes():
    """By differences in time; it is added to what the stages have on their right side, and to no result."""
    servo = PAIRS["servo"]
    scene, h = loaded(servo), 1e-6
    x, v = random_state(scene)
    place = layout(scene)
    ahead, now, behind = (applied(scene, place, 0.37 + s, x, v)[0].force for s in (h, 0.0, -h))
    engine = evaluated(scene, x, v)
    without = engine.work.bodies.f.copy()
    engine.work.implicit[BY_TIME] = 0.1
    assert evaluate(engine.tables, 0.37, engine.x, engine.v) == OK
    change = engine.work.bodies.f - without
    engine.work.implicit[BY_TIME] = 0.0
    bare = evaluated(replace(scene, forces=(replace(servo, kp=0.0, kd=0.0),)), x, v).work.bodies.f
    np.testing.assert_allclose(change, 0.1 * (ahead - behind) / (2 * h) * (without - bare) / now, rtol=1e-6, atol=1e-9)
    assert engine.work.loads.measured[2] == pytest.approx(now)


def test_forces_on_a_joint_share_its_block_and_explicit_methods_have_no_rows():
    scene = replace(loaded(PAIRS["torsion spring"]), springs=(replace(PAIRS["spring"], name="line"),))
    system = compile_scene(scene)
    x, v = random_state(scene)
    engine = new_engine(system, x, v, ROS2(0.1))
    assert len(engine.system.blocks) == len(system.blocks) + 1
    sizes = {block.name: len(block.words) for block in engine.system.blocks}
    assert sizes == {**{block.name: len(block.words) for block in system.blocks}, "tie": 5, "line": 1}
    assert new_engine(system, x, v, RK4(0.1)).system is system
    bare = compile_scene(replace(scene, forces=(), springs=()))
    assert new_engine(bare, x, v, ROS2(0.1)).system is bare


def test_a_force_without_slopes_does_nothing_but_its_force():
    """A stop that is not touched, a spring of a falling curve: equal right sides move the scene as without their rows."""
    falling = SpringDamper("f", "one.c", "two.a", Curve([-9.0, 9.0], [9.0, -9.0]))
    far = JointStop("stop", "tie", 1e6, 0.01, upper=50.0, coordinate="stroke")
    scene = replace(loaded(PAIRS["torsion spring"]), springs=(falling,), forces=(far,))
    x, v = random_state(scene)
    engine = evaluated(scene, x, v)
    assert rows_of(engine, 0)[1] > 1e20
    assert rows_of(engine, 1)[1] > 1e20
    bare = compile_scene(replace(scene, forces=(), springs=()))
    plain = new_engine(bare, x, v, ROS2(0.1))
    for found in (engine, plain):
        target = found.tables.stages.target
        target[:] = 0.0
        assert set_diagonal(found.tables, GH) == OK
        assert evaluate(found.tables, 0.37, found.x, found.v) == OK
        found.work.bodies.f[:] = 1.0
        assert solve(found.tables, target) == OK
    np.testing.assert_allclose(engine.work.bodies.acc, plain.work.bodies.acc, rtol=0, atol=1e-11)


# ---- orders ---------------------------------------------------------------------------------------------------------

HELD = {
    "spring": {"springs": (SpringDamper("s", "ground.o", "block.pin", 2000.0, free_length=1.0),)},
    "damper": {"springs": (SpringDamper("s", "ground.o", "block.pin", 0.0, 40.0),)},
    "bushing": {"forces": (Bushing("s", "ground.o", "block.pin", symmetric(3, positive=True) * 9, (2.0,) * 6),)},
}
SERVO = Servo("s", "hinge", harmonic(amplitude=0.5, frequency=1.0), kp=300.0, kd=30.0)
SPRUNG = JointSpring("s", "hinge", stiffness=200.0, damping=3.0)


def swinging(what: str, flexible: bool) -> Scene:
    """A body on a force, or on a hinge with one."""
    model = (
        cloud(4, seed=1, stiffness=20.0)
        if flexible
        else rigid_body("b", mass=3.0, inertia=[0.2, 0.3, 0.4], points={"a": (0, 0, 0), "b": (0.1, 0.2, 0.1)})
    )
    ground = {"o": (0, 0, 0), "p": model.interface("a").position}
    bodies = (Body("block", model, omega_bar=(0.0, 0.0, 0.7)),)
    if what in ("servo", "torsion spring"):
        hinge = Joint("hinge", "revolute", "ground.p", "block.a")
        forces = (SERVO if what == "servo" else SPRUNG,)
        return Scene(bodies, (hinge,), forces=forces, ground=ground, gravity=GRAVITY)
    named = {key: tuple(replace(force, j="block.b") for force in forces) for key, forces in HELD[what].items()}
    return Scene(bodies, ground=ground, gravity=GRAVITY, **named)


@pytest.mark.parametrize("flexible", [False, True], ids=["rigid", "flexible"])
@pytest.mark.parametrize("what", [*HELD, "servo", "torsion spring"])
@pytest.mark.parametrize(("kind", "order"), [(ROS2, 2), (ROS3, 3), (GeneralisedAlpha, 2)])
def test_methods_keep_their_order(what, flexible, kind, order):
    scene = swinging(what, flexible)

    def end(step: float):
        result = integrate(scene, end=0.4, output_step=0.4, method=kind(step))
        wanted = ("block.R", "block.p", "block.q") if flexible else ("block.R", "block.p")
        return np.concatenate([result[name][-1] for name in wanted])

    coarse, middle, fine = (end(0.4 / parts) for parts in (320, 640, 1280))
    assert np.log2(np.abs(coarse - middle).max() / np.abs(middle - fine).max()) > order - 0.35


# ---- stability ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", [ROS2, ROS3])
@pytest.mark.parametrize("h_omega", [1.0, 10.0, 100.0, 1e4])
@pytest.mark.parametrize("flexible", [False, True], ids=["rigid", "flexible"])
def test_energy_does_not_grow_on_a_bushing_of_any_stiffness(kind, h_omega, flexible):
    h, model = 0.01, cloud(4, seed=1, stiffness=20.0) if flexible else cloud(0, seed=1)
    stiffness = (h_omega / h) ** 2 * model.mass
    pin = model.interface("a").position
    scene = Scene(
        (Body("block", model, position=(1e-3, 0, 0), omega_bar=(0.1, 0, 0.5)),),
        forces=(Bushing("s", "ground.o", "block.a", (stiffness,) * 6),),
        ground={"o": pin},
    )
    result = integrate(scene, end=1.0, output_step=0.01, method=kind(h))
    total = result["energy.total"] + result["energy.springs"]
    assert total.max() <= total[0] * (1 + 1e-9)
    if h_omega >= 100.0:  # L-stable: what the step does not resolve is gone, but for the error of a step
        assert np.linalg.norm(result["s.displacement"][-1]) < 1e-7


def hanging(h_omega: float) -> Scene:
    """A spinning flexible body on a point, held there by a joint (0) or by springs of (h_omega / 0.01 s)^2 times its mass."""
    model = cloud(4, seed=1, stiffness=20.0)
    pin, spin, k = model.interface("a").position, np.array([0.1, 0.0, 0.5]), (h_omega / 0.01) ** 2 * model.mass
    body = Body("block", model, omega_bar=spin, velocity=-np.cross(spin, pin))
    joints = () if h_omega else (Joint("s", "spherical", "ground.o", "block.a"),)
    forces = (Bushing("s", "ground.o", "block.a", (k, k, k, 0.0, 0.0, 0.0)),) if h_omega else ()
    return Scene((body,), joints, forces=forces, ground={"o": pin}, gravity=GRAVITY)


@pytest.mark.parametrize("h_omega", [100.0, 1e4])
@pytest.mark.parametrize(("kind", "order"), [(ROS2, 2), (ROS3, 3), (GeneralisedAlpha, 1.4), (HHT, 1.2)])
def test_stiff_springs_are_as_good_as_joints(kind, order, h_omega):
    """On a motion that turns them: unresolved springs cost no order, and hardly any accuracy."""
    joint, exact = hanging(0.0), integrate(hanging(0.0), end=1.0, output_step=0.1, method=ROS3(1e-3))["block.R"]

    def error(scene: Scene, step: float) -> float:
        return np.abs(integrate(scene, end=1.0, output_step=0.1, method=kind(step))["block.R"] - exact).max()

    errors = np.array([error(hanging(h_omega), step) for step in (0.01, 0.005)])
    assert (errors < 1.5 * np.array([error(joint, step) for step in (0.01, 0.005)]) + 1e-6).all()
    assert np.log2(errors[0] / errors[1]) > order - 0.6


def test_unresolved_springs_store_nothing_and_do_no_work():
    result = integrate(hanging(100.0), end=1.0, output_step=0.01, method=ROS3(0.005))
    total = result["energy.total"] + result["energy.springs"]
    assert total.max() - total[0] < 1e-5 * np.ptp(result["energy.kinetic"])


def test_a_stepper_takes_them_as_a_run_does():
    target = signal("target")
    forces = (Servo("at_elbow", "elbow", target, 100.0, 5.0), JointSpring("at_shoulder", "shoulder", damping=50.0))
    scene = arm(*forces)
    run = integrate(
        scene, end=0.1, output_step=0.01, method=ROS2(1e-3), outputs=("lower.tip.position", "at_elbow.torque")
    )
    stepper = Stepper(scene, ROS2(1e-3), outputs=("lower.tip.position", "at_elbow.torque"))
    stepper.step(100)
    for name, value in stepper.outputs().items():
        np.testing.assert_array_equal(value, run[name][-1])
    stepper.set_inputs(target=0.3)
    stepper.step(3000)
    speed = stepper.outputs()["lower.tip.position"].copy()
    stepper.step(1)
    assert np.abs(stepper.outputs()["lower.tip.position"] - speed).max() < 1e-4


def test_adaptive_steps_do_not_see_stiff_springs():
    found = {
        h_omega: integrate(hanging(h_omega), end=1.0, output_step=0.1, method=AdaptiveROS3(tolerances(1e-5)))
        for h_omega in (0.0, 100.0, 1e4)
    }
    for h_omega in (100.0, 1e4):
        assert found[h_omega].attributes["steps"] < 1.3 * found[0.0].attributes["steps"]
        np.testing.assert_allclose(found[h_omega]["block.R"], found[0.0]["block.R"], atol=1e-4)


def arm(*forces) -> Scene:
    """Two light links of aluminium, 0.1 m long, 10 mm by 6 mm, with modes from 1 kHz."""
    links = [planar_beam(name, 0.1, 0.0162, 70e9 * 0.006 * 0.01**3 / 12, 3) for name in ("upper", "lower")]
    return Scene(
        (Body("upper", links[0]), Body("lower", links[1], position=(0.1, 0, 0))),
        (
            Joint("shoulder", "revolute", "ground.o", "upper.root"),
            Joint("elbow", "revolute", "upper.tip", "lower.root"),
        ),
        forces=forces,
        ground={"o": (0, 0, 0)},
        gravity=GRAVITY,
    )


def tips(scene: Scene, kind, step: float):
    return integrate(scene, end=0.3, output_step=0.01, method=kind(step))["lower.tip.position"]


@pytest.mark.parametrize("kind", [ROS2, ROS3, GeneralisedAlpha, HHT])
@pytest.mark.parametrize("damping", [0.05, 0.5, 5.0, 50.0])
def test_dampers_on_the_joints_of_a_light_arm_run_at_the_step_of_its_motion(kind, damping):
    """Explicit, 0.05 N m s/rad fails at 0.2 ms."""
    scene = arm(*(JointSpring(f"at_{joint}", joint, damping=damping) for joint in ("shoulder", "elbow")))
    assert np.abs(tips(scene, kind, 1e-3) - tips(scene, kind, 5e-4)).max() < 1e-3 * 0.2


@pytest.mark.parametrize("kind", [ROS2, ROS3, GeneralisedAlpha, HHT])
@pytest.mark.parametrize("kd", [0.1, 1.0, 6.0])
def test_servos_on_the_joints_of_a_light_arm_run_at_the_step_of_its_motion(kind, kd):
    """And their torques are those of the motion, whatever kd times an error of a rate may be."""
    sway = harmonic(amplitude=-0.3, frequency=1.5, phase=np.pi / 2, mean=0.3)
    scene = arm(*(Servo(f"at_{joint}", joint, sway, 20 * kd, kd) for joint in ("shoulder", "elbow")))
    coarse, fine = (integrate(scene, end=0.3, output_step=0.01, method=kind(step)) for step in (1e-3, 5e-4))
    assert np.abs(coarse["lower.tip.position"] - fine["lower.tip.position"]).max() < 1e-4 * 0.2
    torque, first = fine["at_shoulder.torque"], 3 if kind in (ROS2, ROS3) else 6
    assert np.abs(coarse["at_shoulder.torque"] - torque)[first:].max() < 0.1 * np.abs(torque).max()


def test_steps_that_a_method_chooses_are_those_of_the_motion():
    scene = arm(*(JointSpring(f"at_{joint}", joint, damping=5.0) for joint in ("shoulder", "elbow")))
    found = integrate(scene, end=0.3, output_step=0.01, method=AdaptiveROS3(tolerances(1e-4)))
    assert found.attributes["steps"] < 300
    assert np.abs(found["lower.tip.position"] - tips(scene, ROS3, 2.5e-4)).max() < 1e-4


# ---- friction, stops, functions of the user's -------------------------------------------------------------------------


def wheel(*forces, speed: float = 0.0, flexible: bool = False) -> Scene:
    """A wheel of 1 kg m^2 about its axle."""
    model = rigid_body("wheel", mass=1.0, inertia=[1.0, 1.0, 1.0], points={"hub": (0, 0, 0)})
    body = Body("wheel", model, omega_bar=(0, 0, speed))
    return Scene((body,), (Joint("axle", "revolute", "ground.o", "wheel.hub"),), forces=forces, ground={"o": (0, 0, 0)})


@pytest.mark.parametrize("start", [0.3, 0.307, 0.3191])
@pytest.mark.parametrize(
    ("kind", "excess"),
    [(kind, excess) for kind in (ROS2, ROS3, GeneralisedAlpha, HHT) for excess in (1.0, 10.0)]
    + [(ROS2, 1e3), (ROS3, 1e3)],
)
def test_dry_friction_stops_a_wheel_whatever_the_step(kind, excess, start):
    """Steps up to a thousand times creep inertia / friction, beyond which explicit ones keep it turning for ever."""
    h = 0.01
    friction = JointFriction("rub", "axle", coulomb=1.0, creep=h / excess)
    result = integrate(wheel(friction, speed=start), end=1.0, output_step=0.1, method=kind(h))
    assert abs(result["wheel.omega_bar"][-1, 2]) < 1e-9
    assert result["axle.angle"][-1] == pytest.approx(start**2 / 2, abs=0.3 * h * start)


@pytest.mark.parametrize("kind", [ROS2, ROS3])
@pytest.mark.parametrize("excess", [10.0, 1000.0])
def test_what_friction_holds_creeps(kind, excess):
    creep = 0.01 / excess
    forces = JointFriction("rub", "axle", coulomb=1.0, creep=creep), Actuator("pull", "axle", 0.5)
    result = integrate(wheel(*forces), end=1.0, output_step=0.1, method=kind(0.01))
    assert result["wheel.omega_bar"][-1, 2] == pytest.approx(creep * np.arctanh(0.5), rel=1e-6)


@pytest.mark.parametrize("kind", [ROS2, ROS3])
@pytest.mark.parametrize("h_omega", [3.0, 10.0, 30.0, 1000.0])
def test_no_stop_throws_back_faster_than_it_was_hit(kind, h_omega):
    """Stiffer than the step resolves it is plastic; the rebound of one that is just resolved is off by some share."""
    h = 0.01
    stop = JointStop("end", "axle", (h_omega / h) ** 2, 1e-4, upper=0.0)
    for place in np.linspace(0.105, 0.115, 11):
        scene = replace(wheel(stop, speed=1.0), joints=(replace(wheel().joints[0], axis=(0, 0, 1)),))
        bodies = (replace(scene.bodies[0], rotation=(0, 0, -place)),)
        result = integrate(replace(scene, bodies=bodies), end=0.4, output_step=0.05, method=kind(h))
        assert np.abs(result["wheel.omega_bar"][:, 2]).max() < 1.2


def test_a_function_whose_slopes_are_told_is_implicit():
    pull = Actuator("pull", "axle", function=lambda t, state: 3.0 - 1e5 * state.v[5])
    with pytest.raises(Exception, match=r"energy|finite"):
        integrate(wheel(pull), end=1.0, output_step=0.1, method=ROS2(0.01))
    result = integrate(wheel(replace(pull, damping=1e5)), end=1.0, output_step=0.1, method=ROS2(0.01))
    np.testing.assert_allclose(result["wheel.omega_bar"][1:, 2], 3e-5, rtol=1e-6)
    with pytest.raises(InputError, match="damping is -1"):
        replace(pull, damping=-1.0)


# ---- beside constraints -----------------------------------------------------------------------------------------------


def four_bar(damping: float, side: float = 1.0) -> Scene:
    """A parallelogram of cranks of 0.3 m and a coupler, driven around, with dampers at all its hinges."""
    ends = {"a": (0, 0, 0), "b": (0.3, 0, 0)}
    bar = rigid_body("bar", mass=1.0, inertia=[0.01, 0.01, 0.02], points=ends)
    coupler = rigid_body("coupler", mass=1.0, inertia=[0.01, 0.02, 0.03], points={"a": (0, 0, 0), "b": (side, 0, 0)})
    up = (0, 0, np.pi / 2)
    bodies = (
        Body("one", bar, rotation=up),
        Body("two", coupler, position=(0, 0.3, 0)),
        Body("three", bar, position=(1.0, 0, 0), rotation=up),
    )
    joints = (
        Joint("A", "revolute", "ground.o", "one.a"),
        Joint("B", "revolute", "one.b", "two.a"),
        Joint("C", "spherical", "two.b", "three.b"),
        Joint("D", "revolute", "ground.p", "three.a"),
    )
    forces = tuple(JointSpring(f"d{name}", name, damping=damping) for name in "ABD")
    ground = {"o": (0, 0, 0), "p": (1.0, 0, 0)}
    around = harmonic(amplitude=0.4, frequency=1.0, mean=np.pi / 2)
    return Scene(bodies, joints, (Driver("turn", "A", around),), forces=forces, ground=ground)


@pytest.mark.parametrize("damping", [0.0, 1.0, 1e8])
def test_stiff_forces_in_a_loop_make_no_row_dependent(damping):
    """The closure of the loop is as independent as it is: no singular position is suspected, nothing is projected again."""
    result = integrate(four_bar(damping), end=1.0, output_step=0.01, method=ROS2(1e-3))
    assert not [note for note in result.attributes["notes"] if "singular" in note]
    assert result.attributes["largest_drift"][0] < 1e-7
    explicit = integrate(four_bar(0.0), end=1.0, output_step=0.01, method=ROS2(1e-3))
    np.testing.assert_allclose(result["two.R"], explicit["two.R"], atol=1e-7)  # its motion is driven
    assert abs(result.attributes["projections"] - explicit.attributes["projections"]) < 20


def test_reactions_are_those_beside_forces_taken_explicitly():
    scene = replace(four_bar(0.3), springs=(SpringDamper("s", "ground.o", "three.b", 300.0, 2.0, 0.9),))
    one, other = (integrate(scene, end=0.2, output_step=0.02, method=kind) for kind in (ROS3(5e-4), RK4(5e-4)))
    for name in ("A.force", "C.force", "D.moment", "dB.torque", "s.tension"):
        np.testing.assert_allclose(one[name], other[name], atol=2e-4 * np.abs(other[name]).max())


def test_redundant_rows_and_stiff_forces_go_together():
    """A parallelogram of three cranks, all joints revolute: closed to rounding, as with forces taken explicitly."""
    scene = four_bar(2.0)
    bar = scene.bodies[0].model
    third = Body("four", bar, position=(0.5, 0, 0), rotation=(0, 0, np.pi / 2))
    coupler = rigid_body(
        "coupler", mass=1.0, inertia=[0.01, 0.02, 0.03], points={"a": (0, 0, 0), "b": (1, 0, 0), "c": (0.5, 0, 0)}
    )
    bodies = (scene.bodies[0], replace(scene.bodies[1], model=coupler), scene.bodies[2], third)
    joints = tuple(replace(joint, kind="revolute") for joint in scene.joints)
    joints += (Joint("E", "revolute", "two.c", "four.b"), Joint("F", "revolute", "ground.q", "four.a"))
    forces = tuple(JointSpring(f"d{joint.name}", joint.name, damping=2.0) for joint in joints)
    scene = replace(
        scene, bodies=bodies, joints=joints, drivers=(), forces=forces, gravity=(9.81, 0, 0),
        ground={**scene.ground, "q": (0.5, 0, 0)},
    )  # fmt: skip
    one, other = (integrate(scene, end=0.5, output_step=0.05, method=kind) for kind in (ROS2(5e-4), RK4(5e-4)))
    assert one.attributes["largest_drift"][0] < 1e-6
    np.testing.assert_allclose(one["two.R"], other["two.R"], atol=1e-6)


def test_planar_scenes_take_them_as_spatial_ones_do():
    forces = [JointSpring(f"at_{joint}", joint, stiffness=1.0, damping=0.5) for joint in ("shoulder", "elbow")]
    scene = replace(arm(*forces), springs=(SpringDamper("s", "ground.o", "lower.tip", 50.0, 5.0, 0.2),))
    flat, solid = (
        integrate(replace(scene, plane=plane), end=0.2, output_step=0.02, method=ROS2(1e-3)) for plane in ("z", "none")
    )
    np.testing.assert_allclose(flat["lower.tip.position"], solid["lower.tip.position"], atol=1e-10)


def test_a_bushing_between_two_flexible_bodies_keeps_them_together():
    scene = free_pair(Bushing("s", "one.b", "two.c", (1e7,) * 3 + (1e5,) * 3, axes_j=None))
    first, second = scene.bodies
    apart = first.model.interface("b").position - second.model.interface("c").position
    scene = replace(scene, bodies=(first, replace(second, position=0.9 * apart, rotation=(0, 0, 0))))
    result = integrate(scene, end=0.5, output_step=0.05, method=ROS2(1e-3))
    total = result["energy.total"] + result["energy.springs"]
    assert (np.diff(total) <= 1e-9 * total[0]).all()


@pytest.mark.parametrize("method", [fd.ROS2(2e-3), fd.ROS3(2e-3), fd.AdaptiveROS3()])
def test_a_spring_whose_length_passes_zero_is_one_along_the_line(method):
    """Its direction turns round there; without free length that changes nothing."""
    mass = fd.rigid_body("mass", mass=2.0, inertia=(1, 1, 1), points={"o": (0, 0, 0)})
    rail = fd.Scene(
        (fd.Body("mass", mass, position=(0.3, 0, 0)),),
        (fd.Joint("rail", "translational", "ground.O", "mass.o", axis=(1, 0, 0)),),
        ground={"O": (0, 0, 0)},
    )
    line = replace(rail, springs=(fd.SpringDamper("spring", "ground.O", "mass.o", stiffness=50.0, damping=0.4),))
    along = fd.JointSpring("spring", "rail", stiffness=50.0, damping=0.4, coordinate="stroke")
    one, other = (
        fd.forward(scene, end=5.0, output_step=0.01, method=method, check=False)["mass.R"]
        for scene in (line, replace(rail, forces=(along,)))
    )
    assert (np.diff(np.sign(one[:, 0])) != 0).sum() == 8
    np.testing.assert_allclose(one, other, rtol=0, atol=1e-10)
