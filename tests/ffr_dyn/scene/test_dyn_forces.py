"""Applied forces: kernels against twins, laws of mechanics, closed forms, what is refused."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from force_jacobian import applied_forces, force_jacobian, small_motion
from places import ROOT
from synthetic import cloud
from test_dyn_kernels import chain, moved, random_state

from ffr_dyn.analyses.integration import integrate
from ffr_dyn.analyses.linearise import linearise
from ffr_dyn.analyses.states import scene_at
from ffr_dyn.compile.engine import evaluate_at, load_at, new_engine
from ffr_dyn.compile.scene_tables import compile_scene
from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.equations.forces import applied, gravity_forces, stretch
from ffr_dyn.equations.inertia import mass_matrix
from ffr_dyn.equations.layout import layout
from ffr_dyn.functions.curves import Curve, curve_value
from ffr_dyn.functions.rotation import rotation_matrix
from ffr_dyn.functions.time_functions import evaluate, harmonic, polynomial, table
from ffr_dyn.integrators import RK4, ROS2
from ffr_dyn.kernels.tables import OK
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.force_kinds import FORCES
from ffr_dyn.scene.forces import (
    Actuator,
    Bushing,
    JointFriction,
    JointSpring,
    JointStop,
    Load,
    ModalForce,
    NodalForces,
    Pressure,
    Servo,
    SpringDamper,
)
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import FlexibleBody, Surface, rigid_body
from ffr_prep.common.errors import ComputationError, InputError

RNG = np.random.default_rng(11)
POWERS = ("default", "*.power")


def symmetric(seed: int, *, positive: bool = False) -> np.ndarray:
    raw = np.random.default_rng(seed).normal(size=(6, 6))
    return raw @ raw.T if positive else raw + raw.T


BENT = Curve([-2.0, -0.5, 0.0, 0.4, 1.5], [-9.0, -1.0, 0.0, 2.0, 3.0])
AXES = {"axes": (0.2, 1.0, -0.3), "axes_j": (0.5, 1.0, 0.1)}

# Each acts between markers or on the coordinates of joint "tie" of `chain`; none needs anything else.
PAIRS = {
    "spring": SpringDamper("s", "one.c", "two.a", 30.0, 2.0, 0.3, 1.5),
    "curved spring": SpringDamper("s", "one.c", "two.a", BENT, Curve([-1, 1], [-2.0, 3.0]), 0.3),
    "bushing": Bushing("s", "one.c", "two.a", symmetric(1), symmetric(2, positive=True), range(6), **AXES),
    "curved bushing": Bushing("s", "one.c", "two.a", [3.0, BENT, 0.0, BENT, 2.0, BENT], (0.5,) * 6, **AXES),
    "torsion spring": JointSpring("s", "tie", 3.0, 0.5, 0.2, 0.7),
    "guided spring": JointSpring("s", "tie", BENT, Curve([-3.0, 3.0], [-1.0, 2.0]), -0.3, coordinate="stroke"),
    "friction": JointFriction("s", "tie", 2.0, 0.1, static=3.0, stribeck=0.5, viscous=0.2),
    "pressed friction": JointFriction("s", "tie", 0.3, 0.4, harmonic(amplitude=1, frequency=1, mean=2)),
    "lifted friction": JointFriction("s", "tie", 0.3, 0.4, lambda t: -2.0, viscous=0.7),
    "stop": JointStop("s", "tie", 20.0, 0.05, lower=0.3, upper=0.4, damping=3.0, coordinate="stroke"),
    "actuator": Actuator("s", "tie", harmonic(amplitude=3.0, frequency=0.4), coordinate="stroke"),
    "python actuator": Actuator("s", "tie", function=lambda t, state: t + state.q("one").sum() + 2.0),
    "servo": Servo("s", "tie", polynomial(0.3, 2.0), kp=3.0, kd=0.5),
    "limited servo": Servo("s", "tie", lambda t: (1.0 + t, 1.0, 0.0), kp=300.0, kd=0.5, limit=2.5),
}
SPREAD = {
    "nodal": NodalForces("s", "one", [0, 3, 7], RNG.normal(size=(3, 3)), harmonic(amplitude=2, frequency=1)),
    "nodal follower": NodalForces("s", "two", [0, 3, 7], RNG.normal(size=(3, 3)), axes="body"),
    "pressure": Pressure("s", "one", 4.0, function=lambda t: 1 + t),
    "following pressure": Pressure("s", "two", RNG.uniform(1, 2, 12), [1], follower=True),
}


def loaded(force, sizes=(4, 3)) -> Scene:
    scene = chain(*sizes, kind="cylindrical", axis=(0.2, 1.0, 0.3), axis_j=(1.0, -0.5, 0.4))
    key = "springs" if isinstance(force, SpringDamper) else "forces"
    return replace(scene, **{key: (force,)})


def alone(scene: Scene, x, v, t: float = 0.37):
    (only,) = applied(scene, layout(scene), t, x, v)
    return only


# ---- kernels against twins ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("force", [*PAIRS.values(), *SPREAD.values()], ids=[*PAIRS, *SPREAD])
@pytest.mark.parametrize("sizes", [(4, 3), (0, 0)], ids=["flexible", "rigid"])
def test_compiled_forces_equal_the_readable_ones(force, sizes):
    scene = loaded(force, sizes)
    system = compile_scene(scene)
    for seed in range(3):
        x, v = random_state(scene, seed)
        engine = new_engine(system, x, v)
        work = engine.work
        assert load_at(engine, 0.37, x, v) == OK
        twin = alone(scene, x, v)
        scale = max(1.0, np.abs(twin.generalised).max())
        np.testing.assert_allclose(work.bodies.f, twin.generalised, rtol=0, atol=1e-12 * scale)
        if isinstance(force, Bushing):
            np.testing.assert_allclose(work.loads.measured[:6], twin.coordinate, atol=1e-12)
        elif twin.coordinate is not None:
            assert work.loads.measured[0] == pytest.approx(twin.coordinate, abs=1e-12)


def test_all_loads_at_once_equal_the_sum_of_the_readable_ones():
    named = [replace(force, name=f"f{k}") for k, force in enumerate([*PAIRS.values(), *SPREAD.values()])]
    scene = replace(
        loaded(ModalForce("modal", "one", [1.0, 2.0, 3.0, 4.0])),
        springs=tuple(f for f in named if isinstance(f, SpringDamper)),
        loads=(
            Load("global", "one.b", (1, harmonic(amplitude=2, frequency=1), 3), (0, 1, 2)),
            Load("body", "two.b", (1, 2, 3), function=lambda t, state: [t, 1, 2, 3, 4, 5], axes="body"),
        ),
    )
    scene = replace(scene, forces=(*scene.forces, *(f for f in named if not isinstance(f, SpringDamper))))
    system, (x, v) = compile_scene(scene), random_state(scene)
    twins = applied(scene, system.layout, 0.37, x, v)
    assert len(twins) == len(named) + 3
    total = sum(twin.generalised for twin in twins) + gravity_forces(scene, system.layout, 0.37, x)
    np.testing.assert_allclose(applied_forces(system, 0.37, x, v), total, rtol=0, atol=1e-11)


def test_powers_in_a_result_are_forces_times_velocities():
    scene = loaded(PAIRS["bushing"])
    scene = replace(scene, loads=(Load("push", "one.b", (1, 2, 3)),), joints=())
    result = integrate(scene, end=0.01, output_step=0.01, method=RK4(1e-3), outputs=POWERS)
    (push, bushing) = applied(scene, layout(scene), 0.01, *_end(scene, result))
    assert result["push.power"][-1] == pytest.approx(push.power, abs=1e-10)
    assert result["s.power"][-1] == pytest.approx(bushing.power, abs=1e-10)
    np.testing.assert_allclose(result["s.displacement"][-1], bushing.coordinate[:3], atol=1e-12)
    np.testing.assert_allclose(result["s.moment"][-1], bushing.force[3:], atol=1e-12)


def _end(scene, result):
    place = layout(scene)
    x, v = np.zeros(place.x_size), np.zeros(place.v_size)
    for b, body in enumerate(scene.bodies):
        n = body.name
        x[place.R(b)], x[place.p(b)], v[place.R_dot(b)] = (result[f"{n}.{k}"][-1] for k in ("R", "p", "v"))
        v[place.omega(b)] = result[f"{n}.omega_bar"][-1]
        if place.n[b]:
            x[place.q(b)], v[place.q_dot(b)] = result[f"{n}.q"][-1], result[f"{n}.q_dot"][-1]
    return x, v


# ---- laws -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("force", PAIRS.values(), ids=list(PAIRS))
@pytest.mark.parametrize("sizes", [(4, 3), (0, 0)], ids=["flexible", "rigid"])
def test_force_and_reaction_leave_both_momenta_of_the_pair_alone(force, sizes):
    scene = loaded(force, sizes)
    place, (x, v) = layout(scene), random_state(scene)
    Q = alone(scene, x, v).generalised
    assert np.abs(Q).max() > 1e-3
    total = np.zeros(6)
    for b in range(2):
        A = rotation_matrix(x[place.p(b)])
        F, M = A @ Q[place.R_dot(b)], A @ Q[place.omega(b)]
        total += np.concatenate([F, M + np.cross(x[place.R(b)], F)])
    np.testing.assert_allclose(total, 0.0, atol=1e-12 * max(1.0, np.abs(Q).max()))


@pytest.mark.parametrize("name", ["spring", "bushing", "curved bushing", "torsion spring", "guided spring", "servo"])
def test_forces_are_the_gradient_of_their_coordinates(name):
    """The power at any velocity is force times rate, with the rate by finite differences of the coordinate."""
    scene = loaded(PAIRS[name])
    (x, v), h = random_state(scene), 1e-5
    here, ahead, behind = (alone(scene, moved(scene, x, v, s), v) for s in (0.0, h, -h))
    rate = (np.asarray(ahead.coordinate) - np.asarray(behind.coordinate)) / (2 * h)
    assert here.power == pytest.approx(np.dot(here.force, rate), rel=1e-7)


@pytest.mark.parametrize("angle", [1e-9, 1e-3, 0.0199, 0.0201, 0.5, 2.0, 3.0])
def test_the_rotation_of_a_bushing_is_the_rotation_vector(angle):
    axis = np.array([0.36, -0.48, 0.8])
    points = {"p": (0.1, 0.2, 0.3)}
    scene = Scene(
        (Body("b", rigid_body("b", mass=1.0, inertia=[1, 1, 1], points=points), rotation=angle * axis),),
        forces=(Bushing("f", "ground.o", "b.p", (0, 0, 0, 1.0, 1.0, 1.0)),),
        ground={"o": (0, 0, 0)},
    )
    x = np.concatenate([np.zeros(3), scene.bodies[0].rotation])
    np.testing.assert_allclose(
        alone(scene, x, np.zeros(6)).coordinate[3:], angle * axis, rtol=0, atol=1e-15 + 1e-13 * angle
    )


@pytest.mark.parametrize("axis", np.vstack([np.eye(3), [0.6, 0.0, 0.8], [0.36, -0.48, 0.8]]))
def test_a_bushing_may_be_turned_by_exactly_half_a_turn(axis):
    """The axial vector vanishes without rounding, and the readable form and the compiled one know the axis all the same."""
    half = Body("b", rigid_body("b", mass=1.0, inertia=[1, 1, 1], points={"p": (0, 0, 0)}), rotation=(0.0, *axis))
    bearing = Bushing("f", "ground.o", "b.p", (2, 2, 2, 0, 0, 0), (1, 1, 1, 0, 0, 0))
    scene = Scene((half,), forces=(bearing,), ground={"o": (0, 0, 0)})
    x, v = np.array([0.1, 0.2, 0.3, *half.rotation]), np.arange(6.0)
    twin, engine = alone(scene, x, v), new_engine(compile_scene(scene), x, v)
    assert load_at(engine, 0.0, x, v) == OK
    np.testing.assert_allclose(
        np.outer(twin.coordinate[3:], twin.coordinate[3:]), np.pi**2 * np.outer(axis, axis), atol=1e-12
    )
    np.testing.assert_allclose(engine.work.loads.measured[3:6], twin.coordinate[3:], atol=1e-12)
    np.testing.assert_allclose(engine.work.bodies.f, twin.generalised, atol=1e-12)
    assert np.abs(twin.generalised[:3]).max() > 0.5
    np.testing.assert_allclose(linearise(scene).frequencies[-3:], np.sqrt(2 - 0.25) / (2 * np.pi))


def test_a_bushing_may_be_turned_by_exactly_a_quarter_turn():
    np.testing.assert_allclose(stretch(1.0, 0.0), (np.pi / 2, -np.pi / 2, -1.0))


@pytest.mark.parametrize("c", [0.6, 0.95, 1.0, 1.05])
def test_both_branches_of_the_stretch_of_a_rotation_meet(c):
    for near, far in zip(stretch(0.02 * c * (1 - 1e-9), c), stretch(0.02 * c * (1 + 1e-9), c), strict=True):
        assert near == pytest.approx(far, rel=1e-8)


def free_pair(*forces, sizes=(3, 2), springs=()) -> Scene:
    one, two = cloud(sizes[0], seed=1, stiffness=8.0), cloud(sizes[1], seed=2, stiffness=9.0)
    return Scene(
        (
            Body("one", one, velocity=(0.1, 0, 0), omega_bar=(0.2, 0.5, -0.3)),
            Body("two", two, position=(0.3, 0.2, 0.1), rotation=(0.4, 0.3, -0.5), omega_bar=(-0.4, 0.1, 0.6)),
        ),
        forces=forces,
        springs=springs,
    )


def test_a_bushing_without_damping_conserves_energy_through_large_rotations():
    scene = free_pair(Bushing("s", "one.b", "two.c", symmetric(4, positive=True), **AXES))

    def drift(h: float) -> float:
        result = integrate(scene, end=1.0, output_step=0.05, method=RK4(h))
        assert np.linalg.norm(result["s.rotation"], axis=1).max() > 0.5
        return float(np.ptp(result["energy.total"] + result["energy.springs"]))

    coarse, fine = drift(0.01), drift(0.005)
    assert fine < coarse / 12
    assert fine < 1e-5


@pytest.mark.parametrize(
    "spring",
    [
        JointSpring("s", "guide", BENT, free=0.1, preload=0.3, coordinate="stroke"),
        Bushing("s", "ground.o", "block.pin", [1.0, 2.0, BENT, 0.0, 0.0, 0.0], preload=(0, 0, 3.0, 0, 0, 0)),
    ],
    ids=["spring", "bushing"],
)
def test_a_tabulated_spring_stores_what_it_takes(spring):
    """Swinging beyond both ends of the table."""
    result = integrate(slider(spring, speed=4.0), end=4.0, output_step=0.05, method=RK4(2e-3))
    assert np.ptp(result["guide.stroke"]) > 3.6
    total = result["energy.kinetic"] + result["energy.springs"]
    assert np.ptp(total) < 1e-6 * total[0]


def test_work_of_the_forces_is_the_change_of_energy():
    """Kinetic, strain and gravity energy grow by the integral of all powers."""
    scene = free_pair(
        Bushing("f", "one.b", "two.c", symmetric(4, positive=True), symmetric(5, positive=True) / 5),
        NodalForces("g", "one", [1, 5], [[1, 0, 2], [0, 1, 0]], harmonic(amplitude=1, frequency=2)),
        Pressure("h", "two", 3.0, follower=True),
        ModalForce("m", "one", [1.0, 0.0, 2.0]),
        springs=(SpringDamper("s", "one.a", "two.a", 20.0, 1.0, 0.2),),
    )
    scene = replace(
        scene,
        joints=(Joint("hinge", "revolute", "ground.o", "one.a"),),
        ground={"o": (0, 0, 0)},
        gravity=(0, -9.81, 0),
        loads=(Load("push", "two.b", (1, 2, 3), (1, 0, 1), axes="body"),),
    )
    turning = (JointFriction("r", "hinge", 0.5, 0.2), Servo("p", "hinge", polynomial(0, 2), 3.0, 1.0))
    scene = replace(scene, forces=(*scene.forces, *turning, Actuator("t", "hinge", 2.0)))
    result = integrate(scene, end=0.6, output_step=0.002, method=RK4(5e-4), outputs=POWERS)
    names = [f.name for f in (*scene.forces, *scene.springs, *scene.loads)]
    power = sum(result[f"{name}.power"] for name in names)
    assert all(np.abs(result[f"{name}.power"]).max() > 1e-3 for name in names)
    simpson = (power[:-2:2] + 4 * power[1:-1:2] + power[2::2]).sum() * 0.002 / 3
    energy = result["energy.total"]
    assert energy[-1] - energy[0] == pytest.approx(simpson, abs=1e-6 * np.ptp(energy))


# ---- closed forms -------------------------------------------------------------------------------------------------


INERTIA = 0.7


def rotor(*forces, speed: float = 0.0, angle: float = 0.0, method: str = "revolute") -> Scene:
    """A rigid wheel on a hinge about z, centre of mass on the axis."""
    wheel = rigid_body("wheel", mass=2.0, inertia=[1.0, 1.0, INERTIA], points={"hub": (0, 0, 0)})
    return Scene(
        (Body("wheel", wheel, rotation=(0, 0, angle), omega_bar=(0, 0, speed)),),
        (Joint("hinge", method, "ground.o", "wheel.hub"),),
        forces=forces,
        ground={"o": (0, 0, 0)},
    )


MASS = 1.5


def slider(*forces, speed: float = 0.0, at: float = 0.0, loads=(), **scene) -> Scene:
    """A rigid block on a guide along z."""
    block = rigid_body("block", mass=MASS, inertia=[1.0, 1.0, 1.0], points={"pin": (0, 0, 0)})
    return Scene(
        (Body("block", block, position=(0, 0, at), velocity=(0, 0, speed)),),
        (Joint("guide", "translational", "ground.o", "block.pin"),),
        forces=forces,
        loads=loads,
        ground={"o": (0, 0, 0)},
        **scene,
    )


def test_a_torsion_spring_swings_as_an_oscillator_through_many_turns():
    """Wound by more than three turns each way: theta = speed / omega sin(omega t)."""
    stiffness = 2.0
    omega = np.sqrt(stiffness / INERTIA)
    speed = 21.0 * omega
    result = integrate(
        rotor(JointSpring("s", "hinge", stiffness), speed=speed), end=6.0, output_step=0.05, method=RK4(2e-3)
    )
    exact = 21.0 * np.sin(omega * result.time)
    assert np.ptp(exact) > 13 * np.pi
    np.testing.assert_allclose(result["s.angle"], exact, atol=2e-5)
    np.testing.assert_allclose(result["s.torque"], -stiffness * exact, atol=5e-5)
    np.testing.assert_allclose(result["hinge.angle"], exact, atol=2e-5)
    total = result["energy.kinetic"] + 0.5 * stiffness * result["s.angle"] ** 2
    assert np.ptp(total) < 1e-5 * total[0]


def test_a_spring_wound_at_the_start_unwinds():
    scene = rotor(JointSpring("s", "hinge", 2.0, free=0.5, turns=3), angle=0.4)
    result = integrate(scene, end=3.0, output_step=0.05, method=RK4(5e-3))
    amplitude = 6 * np.pi + 0.4 - 0.5
    exact = 0.5 + amplitude * np.cos(np.sqrt(2.0 / INERTIA) * result.time)
    np.testing.assert_allclose(result["s.angle"], exact, atol=2e-5)
    assert alone(scene, np.array([0, 0, 0, *scene.bodies[0].rotation]), np.zeros(6)).coordinate == pytest.approx(
        6 * np.pi + 0.4
    )


def test_turns_are_counted_from_accepted_states_and_evaluating_changes_nothing():
    scene = rotor(JointSpring("s", "hinge", 2.0, turns=1))
    system = compile_scene(scene)
    engine = new_engine(system, np.array([0, 0, 0, 1.0, 0, 0, 0]), np.zeros(6))
    work = engine.work
    for angle in (0.0, 3.0, -3.0, 0.5):
        x = np.array([0, 0, 0, np.cos(angle / 2), 0, 0, np.sin(angle / 2)])
        load_at(engine, 0.0, x, np.zeros(6))
        assert work.loads.measured[0] == pytest.approx(2 * np.pi + angle)
    assert work.loads.reference[0] == pytest.approx(2 * np.pi)


def test_a_resumed_run_goes_on_with_its_turns(tmp_path):
    scene, settings = rotor(JointSpring("s", "hinge", 2.0), speed=30.0), {"output_step": 0.05, "method": RK4(5e-3)}
    whole = integrate(scene, end=1.0, **settings)
    integrate(scene, end=0.5, **settings, path=tmp_path / "run.nc")
    result = integrate(scene, end=1.0, **settings, resume=tmp_path / "run.nc")
    assert whole["s.angle"].min() >= 0
    assert whole["s.angle"][10] > 2 * np.pi
    assert result["s.angle"].tobytes() == whole["s.angle"].tobytes()


def test_a_scene_at_a_result_goes_on_with_its_turns():
    """A spring, a stop and a servo, of which the joint has turned by more than one turn."""
    forces = (
        JointSpring("s", "hinge", 2.0),
        JointStop("end", "hinge", 50.0, 0.1, upper=8.0),
        Servo("hold", "hinge", target=polynomial(7.0), kp=0.5, kd=0.0),
        JointFriction("oil", "hinge", coulomb=0.0, creep=1.0, viscous=1e-3),
    )
    scene, settings = rotor(*forces, speed=30.0), {"output_step": 0.05, "method": RK4(5e-3)}
    whole = integrate(scene, end=1.0, **settings)
    later = scene_at(scene, integrate(scene, end=0.5, **settings))
    result = integrate(later, start=0.5, end=1.0, **settings)
    assert [force.turns for force in later.forces[:3]] == [2, 2, 2]
    for name in ("s.angle", "s.torque", "end.torque", "hold.torque"):
        np.testing.assert_allclose(result[name], whole[name][10:], rtol=0, atol=1e-9, err_msg=name)


def test_a_scene_at_a_result_needs_the_angle_of_a_spring():
    scene = rotor(JointSpring("s", "hinge", 2.0), speed=30.0)
    result = integrate(scene, end=0.1, output_step=0.05, method=RK4(5e-3), outputs=("wheel.*",))
    with pytest.raises(InputError, match=r"no quantity 's.angle'"):
        scene_at(scene, result)


def test_reactions_of_redundant_rows_see_the_same_turns():
    """Two hinges on one axis: the second is redundant; reactions are evaluated apart from the motion."""
    wheel = rigid_body("wheel", mass=2.0, inertia=[1.0, 1.0, INERTIA], points={"hub": (0, 0, 0), "end": (0, 0, 1)})
    scene = Scene(
        (Body("wheel", wheel, omega_bar=(0, 0, 9.0)),),
        (Joint("hinge", "revolute", "ground.o", "wheel.hub"), Joint("other", "revolute", "ground.e", "wheel.end")),
        forces=(JointSpring("s", "hinge", 0.2),),
        loads=(Load("side", "wheel.hub", function=lambda t, state: (0.0, 0.0, 0.0)),),
        ground={"o": (0, 0, 0), "e": (0, 0, 1)},
    )
    result = integrate(scene, end=2.0, output_step=0.1, method=RK4(1e-2))
    assert result["s.angle"].max() > 3 * np.pi
    assert np.abs(result["hinge.moment"][:, 2] + result["other.moment"][:, 2]).max() < 1e-9


def test_a_spring_along_a_guide_and_a_tabulated_one_have_the_same_period():
    for stiffness in (50.0, Curve([-1.0, 0.0, 2.0], [-50.0, 0.0, 100.0])):
        scene = slider(JointSpring("s", "guide", stiffness, free=0.1, coordinate="stroke"), at=0.4)
        result = integrate(scene, end=2.0, output_step=0.05, method=RK4(2e-3))
        exact = 0.1 + 0.3 * np.cos(np.sqrt(50.0 / MASS) * result.time)
        np.testing.assert_allclose(result["guide.stroke"], exact, atol=1e-7)


def test_a_bushing_holds_a_block_with_six_frequencies():
    """One direction at a time: mass or inertia on its own stiffness, zero elsewhere."""
    inertia, stiffness = np.array([0.5, 0.6, 0.8]), np.array([40.0, 50.0, 60.0, 7.0, 8.0, 9.0])
    block = rigid_body("block", mass=2.0, inertia=inertia, points={"pin": (0, 0, 0)})
    omega = np.sqrt(stiffness / np.concatenate([np.full(3, 2.0), inertia]))
    for c in range(6):
        pose = np.zeros(6)
        pose[c] = 0.3
        scene = Scene(
            (Body("block", block, position=pose[:3], rotation=pose[3:]),),
            forces=(Bushing("s", "ground.o", "block.pin", stiffness),),
            ground={"o": (0, 0, 0)},
        )
        result = integrate(scene, end=1.0, output_step=0.05, method=RK4(5e-3))
        found = np.hstack([result["s.displacement"], result["s.rotation"]])
        np.testing.assert_allclose(found[:, c], 0.3 * np.cos(omega[c] * result.time), atol=1e-6)
        assert np.abs(np.delete(found, c, axis=1)).max() < 1e-12


def test_a_bushing_in_turned_axes_and_with_preload_finds_its_equilibrium():
    frame = rotation_matrix(np.array([0.5, 0.5, 0.5, 0.5]))  # x -> y -> z -> x
    block = rigid_body("block", mass=2.0, inertia=[1, 1, 1], points={"pin": (0, 0, 0)})
    weight = 2.0 * 9.81
    bushing = Bushing(
        "s", "ground.o", "block.pin", (100.0, 200.0, 400.0, 50, 50, 50), (40.0,) * 6, (10, 0, 0, 0, 0, 0), frame
    )
    scene = Scene((Body("block", block),), forces=(bushing,), ground={"o": (0, 0, 0)}, gravity=(0, 0, -9.81))
    result = integrate(scene, end=20.0, output_step=1.0, method=RK4(1e-2))
    # the third column of the frame is the x axis, the second z, the first y
    np.testing.assert_allclose(result["s.displacement"][-1], [0.1, -weight / 200, 0], atol=1e-9)
    np.testing.assert_allclose(result["block.R"][-1], [0, 0.1, -weight / 200], atol=1e-9)


def test_dry_friction_stops_a_block_after_the_known_distance():
    """m v dv/ds = -F tanh(v / creep): s = m / F (v^2 / 2 + creep^2 pi^2 / 12) for v far above creep, once at rest."""
    friction, creep, speed = 6.0, 0.02, 2.0
    for law in (
        JointFriction("f", "guide", friction, creep, coordinate="stroke"),
        JointFriction("f", "guide", 0.3, creep, normal=20.0, coordinate="stroke"),
    ):
        result = integrate(slider(law, speed=speed), end=1.0, output_step=0.01, method=RK4(5e-4), outputs=POWERS)
        exact = MASS / friction * (speed**2 / 2 + creep**2 * np.pi**2 / 12)
        assert result["guide.stroke"][-1] == pytest.approx(exact, abs=1e-6)
        assert result["f.power"].max() <= 0


def test_a_stuck_block_creeps_no_faster_than_stated():
    law = JointFriction("f", "guide", 6.0, 1e-3, static=8.0, stribeck=0.1, coordinate="stroke")
    result = integrate(
        slider(law, loads=(Load("pull", "block.pin", (0, 0, 4.0)),)), end=0.2, output_step=0.02, method=RK4(1e-4)
    )
    final = result["block.v"][-1, 2]
    assert final == pytest.approx(1e-3 * np.arctanh(4.0 / 8.0), rel=1e-3)
    assert final < 1e-3 * np.arctanh(4.0 / 6.0)


@pytest.mark.parametrize("rate", [-2.0, -0.05, 0.0, 0.1, 3.0])
def test_stribecks_friction_falls_from_static_to_coulomb(rate):
    law = JointFriction("f", "guide", 6.0, 1e-4, static=9.0, stribeck=0.1, viscous=0.5, coordinate="stroke")
    scene = slider(law)
    v = np.array([0, 0, rate, 0, 0, 0])
    size = 6 + 3 * np.exp(-((rate / 0.1) ** 2))
    force = alone(scene, np.array([0, 0, 0, 1.0, 0, 0, 0]), v).force
    assert force == pytest.approx(-np.sign(rate) * size - 0.5 * rate)


def test_friction_ends_where_the_surfaces_part():
    law = JointFriction("f", "guide", 0.3, 1e-3, polynomial(20.0, -40.0), coordinate="stroke")
    result = integrate(slider(law, speed=2.0), end=1.0, output_step=0.05, method=RK4(1e-3))
    t = np.minimum(result.time, 0.5)
    np.testing.assert_allclose(result["block.v"][:, 2], 2.0 - 0.3 / MASS * (20 * t - 20 * t**2), atol=1e-5)


def test_an_elastic_stop_sends_a_block_back_as_fast_and_a_damped_one_slower():
    def rebound(damping: float) -> float:
        stop = JointStop("f", "guide", 5e3, 0.01, lower=-1.0, upper=0.5, damping=damping, coordinate="stroke")
        result = integrate(slider(stop, speed=2.0), end=0.6, output_step=0.005, method=RK4(1e-4))
        assert result["f.force"].max() == 0.0  # pushes back, never pulls
        assert result["f.force"].min() < -10
        return -result["block.v"][-1, 2]

    assert rebound(0.0) == pytest.approx(2.0, abs=1e-6)
    assert 0.1 < rebound(60.0) < 1.5


def test_a_block_rests_on_a_stop_at_the_depth_that_carries_it():
    stop = JointStop("f", "guide", 1e3, 0.002, lower=0.0, damping=80.0, coordinate="stroke")
    result = integrate(slider(stop, at=0.01, gravity=(0, 0, -9.81)), end=3.0, output_step=0.1, method=RK4(1e-3))
    assert result["guide.stroke"][-1] == pytest.approx(-(MASS * 9.81 / 1e3 + 0.001), abs=1e-9)


def test_a_servo_settles_as_its_gains_say():
    """Critically damped: error (1 + w t) exp(-w t)."""
    w, target = 8.0, 7.0  # beyond a turn
    servo = Servo("p", "hinge", target, kp=INERTIA * w**2, kd=2 * INERTIA * w)
    result = integrate(rotor(servo), end=2.0, output_step=0.02, method=RK4(2e-3))
    exact = target * (1 - (1 + w * result.time) * np.exp(-w * result.time))
    np.testing.assert_allclose(result["p.angle"], exact, atol=1e-6)


def test_a_servo_follows_a_moving_target_without_a_memory_of_its_rate():
    """Relative damping acts on the error's rate: a target at constant speed is followed exactly."""
    servo = Servo("p", "hinge", polynomial(0, 9.0), kp=20.0, kd=4.0)
    result = integrate(rotor(servo, speed=9.0), end=2.0, output_step=0.1, method=RK4(2e-3))
    np.testing.assert_allclose(result["p.angle"], 9.0 * result.time, atol=1e-9)
    assert np.abs(result["p.torque"]).max() < 1e-8


def test_a_limited_servo_pushes_with_its_limit():
    result = integrate(
        slider(Servo("p", "guide", 100.0, 50.0, limit=3.0, coordinate="stroke")),
        end=1.0,
        output_step=0.1,
        method=RK4(1e-2),
    )
    np.testing.assert_allclose(result["guide.stroke"], 0.5 * 3.0 / MASS * result.time**2, atol=1e-12)


FUNCTIONS = {
    "constant": (3.0, lambda t: 1.5 * t**2),
    "python": (lambda t: 6.0 * t, lambda t: t**3),
    "table": (table([0, 1, 2], [0, 6.0, 12.0]), lambda t: t**3),
}


@pytest.mark.parametrize(("force", "motion"), FUNCTIONS.values(), ids=list(FUNCTIONS))
def test_an_actuator_accelerates_a_rotor(force, motion):
    result = integrate(rotor(Actuator("t", "hinge", force)), end=1.0, output_step=0.1, method=RK4(1e-2))
    np.testing.assert_allclose(result["hinge.angle"], motion(result.time) / INERTIA, atol=1e-9)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (
            {"force": lambda t, state: 1.0},
            r"force 'f' at t = 0 s: .*; it is called with t alone: a function of \(t, state\)",
        ),
        (
            {"function": lambda t: 1.0},
            r"force 'f' at t = 0 s: .*; it is called with \(t, state\): a function of t alone",
        ),
    ],
)
def test_a_function_of_other_arguments_is_told_with_what_it_is_called(given, words):
    with pytest.raises(ComputationError, match=words):
        integrate(rotor(Actuator("f", "hinge", **given)), end=0.1, output_step=0.1, method=RK4(1e-2))


def test_a_python_actuator_sees_the_state():
    """A spring made by hand swings as one that is built in."""
    by_hand = Actuator(
        "t", "guide", function=lambda t, state: -50 * state.position("block.pin")[2], coordinate="stroke"
    )
    result = integrate(slider(by_hand, at=0.3), end=1.0, output_step=0.05, method=RK4(2e-3))
    np.testing.assert_allclose(result["guide.stroke"], 0.3 * np.cos(np.sqrt(50 / MASS) * result.time), atol=1e-7)


def test_a_driven_angle_is_counted_by_the_implicit_method_too():
    spring = JointSpring("s", "hinge", 2.0)
    result = integrate(rotor(spring, speed=21 * np.sqrt(2 / INERTIA)), end=3.0, output_step=0.05, method=ROS2(1e-3))
    np.testing.assert_allclose(result["s.angle"], 21 * np.sin(np.sqrt(2 / INERTIA) * result.time), atol=2e-3)
    assert result["s.angle"].max() > 6 * np.pi


# ---- loads on surfaces and modes --------------------------------------------------------------------------------------


def box_surface(n: int, seed: int = 0) -> Surface:
    """A closed box of 1 x 2 x 3 m, outward triangles, with random shapes."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 2) for z in (0, 3)], float)
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [part for a, b, c, d in faces for part in ((a, b, c), (a, c, d))]
    Phi = np.random.default_rng(seed).normal(size=(8, 3, n)) * 0.1
    return Surface(corners, triangles, Phi)


def boxed(n: int = 3) -> FlexibleBody:
    return replace(cloud(n), surface=box_surface(n))


def test_the_box_is_closed_and_points_outward():
    s = box_surface(0)
    u = s.points[s.triangles]
    volume = np.einsum("tk,tk->t", u[:, 0], np.cross(u[:, 1], u[:, 2])).sum() / 6
    assert volume == pytest.approx(6.0)


@pytest.mark.parametrize("follower", [False, True])
def test_uniform_pressure_on_a_closed_surface_has_no_resultant(follower):
    load = Pressure("p", "b", 5.0, follower=follower).integrals(boxed())
    np.testing.assert_allclose(load.constant[:6], 0.0, atol=1e-12)
    if follower:  # and to first order none as it deforms
        np.testing.assert_allclose(load.slope[:6], 0.0, atol=1e-12)
    assert np.abs(load.constant[6:]).max() > 0.1


def test_pressure_on_one_side_is_area_times_pressure_at_the_middle():
    top = Pressure("p", "b", 5.0, triangles=lambda centre: centre[:, 2] > 2.9)
    load = top.integrals(boxed())
    np.testing.assert_allclose(load.constant[:3], [0, 0, -10.0], atol=1e-12)
    np.testing.assert_allclose(load.constant[3:6], np.cross([0.5, 1.0, 3.0], [0, 0, -10.0]), atol=1e-12)


def test_linear_pressure_is_integrated_exactly():
    """Hydrostatic p = 3 - z on the whole box: buoyancy, the weight of its volume, through its middle."""
    body = boxed()
    load = Pressure("p", "b", 3.0 - body.surface.points[:, 2]).integrals(body)
    np.testing.assert_allclose(load.constant[:3], [0, 0, 6.0], atol=1e-12)
    # and its modal forces by Gauss's quadrature of degree two, exact for linear pressure on linear shapes
    corners = body.surface.triangles
    u, Phi = body.surface.points[corners], body.surface.Phi[corners]
    area = np.cross(u[:, 1] - u[:, 0], u[:, 2] - u[:, 0]) / 2
    Q = np.zeros(6 + body.n)
    for weights in np.array([[4, 1, 1], [1, 4, 1], [1, 1, 4]]) / 6:
        at, shape = np.einsum("a,tak->tk", weights, u), np.einsum("a,takj->tkj", weights, Phi)
        f = -(3.0 - at[:, 2])[:, None] * area / 3
        Q += np.concatenate([f.sum(0), np.cross(at, f).sum(0), np.einsum("tkj,tk->j", shape, f)])
    np.testing.assert_allclose(load.constant, Q, atol=1e-12)


def test_a_following_pressure_is_the_tangent_of_that_on_the_deformed_surface():
    body, h = boxed(), 1e-5
    pressure = Pressure("p", "b", np.linspace(1, 2, 8), follower=True)
    load = pressure.integrals(body)
    for j in range(body.n):
        q = h * np.eye(body.n)[j]
        bent = [
            pressure.integrals(
                replace(
                    body, surface=replace(body.surface, points=body.surface.points + sign * (body.surface.Phi @ q))
                ),
            )
            for sign in (1, -1)
        ]
        np.testing.assert_allclose(load.slope[:, j], (bent[0].constant - bent[1].constant) / (2 * h), atol=1e-8)


@pytest.mark.parametrize("axes", ["global", "body"])
def test_a_nodal_force_at_an_interface_is_a_load_there(axes):
    """The synthetic bodies have interface "a" at surface point 0."""
    value = np.array([1.0, -2.0, 0.5])
    nodal, load = NodalForces("s", "one", [0], [value], axes=axes), Load("s", "one.a", value, axes=axes)
    scene = chain()
    x, v = random_state(scene)
    one = alone(replace(scene, forces=(nodal,)), x, v)
    other = alone(replace(scene, loads=(load,)), x, v)
    np.testing.assert_allclose(one.generalised, other.generalised, atol=1e-13)
    assert one.power == pytest.approx(other.power)


def test_a_modal_force_accelerates_as_the_mass_matrix_says():
    body = cloud(2, stiffness=20.0)
    system = compile_scene(Scene((Body("b", body),), forces=(ModalForce("m", "b", [3.0, 0.0]),)))
    x = np.array([0, 0, 0, 1.0, 0, 0, 0, 0, 0])
    engine = new_engine(system, x, np.zeros(8))
    assert evaluate_at(engine, 0.0, x, np.zeros(8)) == OK
    work = engine.work
    np.testing.assert_allclose(mass_matrix(body, np.zeros(2)) @ work.bodies.acc, [0] * 6 + [3.0, 0.0], atol=1e-12)


# ---- gravity and base ---------------------------------------------------------------------------------------------


def test_an_accelerated_base_acts_as_gravity_against_it():
    """A pendulum in a frame accelerated by a swings as in the gravity g - a, to the last bit but rounding."""
    scene = replace(chain(2, 2, kind="spherical"), gravity=(0, -9.81, 0))
    shaken = integrate(
        replace(scene, base_acceleration=(3.0, 0, lambda t: 1.0)), end=0.3, output_step=0.1, method=RK4(1e-3)
    )
    tilted = integrate(replace(scene, gravity=(-3.0, -9.81, -1.0)), end=0.3, output_step=0.1, method=RK4(1e-3))
    np.testing.assert_allclose(shaken["two.R"], tilted["two.R"], rtol=0, atol=1e-12)
    np.testing.assert_allclose(shaken["one.q"], tilted["one.q"], rtol=0, atol=1e-12)


def test_a_shaken_oscillator_answers_as_the_closed_form_says():
    """Relative motion z'' + w0^2 z = -a sin(w t) from rest."""
    a, frequency, stiffness = 2.0, 1.3, 50.0
    w, w0 = 2 * np.pi * frequency, np.sqrt(stiffness / MASS)
    scene = slider(
        JointSpring("s", "guide", stiffness, coordinate="stroke"),
        base_acceleration=(0, 0, harmonic(amplitude=a, frequency=frequency)),
    )
    result = integrate(scene, end=2.0, output_step=0.05, method=RK4(1e-3))
    t = result.time
    exact = -a / (w0**2 - w**2) * (np.sin(w * t) - w / w0 * np.sin(w0 * t))
    np.testing.assert_allclose(result["guide.stroke"], exact, atol=1e-9)


def test_the_turntable_of_the_documentation_swings_more_slowly_than_at_rest():
    """Seen from the turntable, the centrifugal force takes w^2 from k / m."""
    page = (ROOT / "docs" / "forces.md").read_text(encoding="utf-8")
    (text,) = re.findall(r"```python\n(.*?)```", page, re.S)
    space: dict = {}
    exec(compile(text, "docs/forces.md", "exec"), space)
    result = space["result"]
    exact = 0.4 * np.cos(np.sqrt(50.0 / 1.5 - 3.0**2) * result.time)
    np.testing.assert_allclose(result["spoke.stroke"], exact, atol=1e-4)
    assert result["turntable.angle"][-1] == pytest.approx(6.0)


# ---- the Jacobian -------------------------------------------------------------------------------------------------


def test_the_jacobian_of_a_bushing_at_rest_is_its_stiffness_and_damping():
    K, D = symmetric(1), symmetric(2, positive=True)
    block = rigid_body("block", mass=2.0, inertia=[1, 1, 1], points={"pin": (0, 0, 0)})
    scene = Scene(
        (Body("block", block),), forces=(Bushing("s", "ground.o", "block.pin", K, D),), ground={"o": (0, 0, 0)}
    )
    found = force_jacobian(compile_scene(scene), 0.0, np.array([0, 0, 0, 1.0, 0, 0, 0]), np.zeros(6))
    np.testing.assert_allclose(found.position, -K, atol=1e-9)
    np.testing.assert_allclose(found.velocity, -D, atol=1e-10)
    assert found.error.max() < 1e-6


def test_the_jacobian_of_a_spring_has_its_geometric_stiffness():
    """k e e^T + (tension / length) (I - e e^T) between two points that only translate."""
    d, k, c, free = np.array([1.0, 2.0, 2.0]), 5.0, 0.7, 2.0
    e = d / 3
    bodies = [
        Body(name, rigid_body(name, mass=1.0, inertia=[1, 1, 1], points={"p": (0, 0, 0)}), position=at)
        for name, at in (("a", (0, 0, 0)), ("b", d))
    ]
    scene = Scene(bodies, springs=(SpringDamper("s", "a.p", "b.p", k, c, free),))
    found = force_jacobian(compile_scene(scene), 0.0, np.array([0, 0, 0, 1.0, 0, 0, 0, *d, 1.0, 0, 0, 0]), np.zeros(12))
    along = np.outer(e, e)
    stiffness = k * along + k * (3 - free) / 3 * (np.eye(3) - along)
    np.testing.assert_allclose(found.position[:3, :3], -stiffness, atol=1e-9)
    np.testing.assert_allclose(found.position[:3, 6:9], stiffness, atol=1e-9)
    np.testing.assert_allclose(found.velocity[6:9, :3], c * along, atol=1e-10)


def test_the_jacobian_of_a_following_pressure_is_its_slope():
    body = boxed()
    scene = Scene((Body("b", body),), forces=(Pressure("p", "b", 2.0, follower=True),))
    system = compile_scene(scene)
    x = np.concatenate([[0, 0, 0, 1.0, 0, 0, 0], np.full(3, 0.1)])
    found = force_jacobian(system, 0.0, x, np.zeros(9))
    np.testing.assert_allclose(found.position[:, 6:], scene.forces[0].integrals(body).slope, atol=1e-9)


@pytest.mark.parametrize("name", ["spring", "curved bushing", "friction", "servo"])
def test_the_jacobian_predicts_forces_nearby(name):
    scene = loaded(PAIRS[name])
    system, (x, v) = compile_scene(scene), random_state(scene)
    found = force_jacobian(system, 0.37, x, v)
    rng, h = np.random.default_rng(3), 1e-6
    dx, dv = rng.normal(size=v.size), rng.normal(size=v.size)
    ahead = applied_forces(system, 0.37, small_motion(system, x, h * dx), v)
    behind = applied_forces(system, 0.37, small_motion(system, x, -h * dx), v)
    scale = np.abs(found.position).max()
    np.testing.assert_allclose(found.position @ dx, (ahead - behind) / (2 * h), atol=1e-5 * scale)
    rotated = dv.copy()
    for b in range(2):
        rotated[system.layout.R_dot(b)] = rotation_matrix(x[system.layout.p(b)]) @ dv[system.layout.R_dot(b)]
    rate = (applied_forces(system, 0.37, x, v + h * rotated) - applied_forces(system, 0.37, x, v - h * rotated)) / (
        2 * h
    )
    np.testing.assert_allclose(found.velocity @ dv, rate, atol=1e-5 * max(1.0, np.abs(found.velocity).max()))


def test_a_kink_shows_in_the_error_of_the_jacobian():
    stop = JointStop("f", "guide", 1e4, 1e-6, lower=0.0, coordinate="stroke")
    scene = slider(stop)
    found = force_jacobian(compile_scene(scene), 0.0, np.array([0, 0, 1e-5, 1.0, 0, 0, 0]), np.zeros(6))
    assert found.error[0] > 100


# ---- curves ---------------------------------------------------------------------------------------------------------


def test_a_curve_passes_its_points_keeps_between_them_and_goes_on_straight():
    for at, value in zip(BENT.at, BENT.values, strict=True):
        assert curve_value(BENT, at) == pytest.approx(value, abs=1e-12)
    inside = [curve_value(BENT, x) for x in np.linspace(-2, 1.5, 200)]
    assert (np.diff(inside) >= 0).all()
    left = [curve_value(BENT, x) for x in (-2.0, -2.5, -3.0)]
    assert left[0] - left[1] == pytest.approx(left[1] - left[2])
    assert curve_value(Curve([0, 1], [2, 4]), 7.0) == pytest.approx(16.0)


# ---- what is refused ------------------------------------------------------------------------------------------------


REFUSED = {
    "one point": (lambda: Curve([1.0], [1.0]), "two or more"),
    "unordered": (lambda: Curve([0.0, 2.0, 1.0], [0, 1, 2]), "after 2 comes 1"),
    "curve of NaN": (lambda: Curve([0.0, np.nan], [0, 1]), "not finite"),
    "curves of two lengths": (lambda: Curve([0.0, 1.0], [0, 1, 2]), "as many values"),
    "zero length": (lambda: SpringDamper("f", "a.x", "a.x", 1.0), "'f' has length zero"),
    "negative length": (lambda: SpringDamper("f", "a.x", "b.x", 1.0, free_length=-1.0), "'f': free_length is -1"),
    "negative damping": (lambda: SpringDamper("f", "a.x", "b.x", 1.0, -2.0), "'f': damping is -2"),
    "no number": (lambda: SpringDamper("f", "a.x", "b.x", "stiff"), "'f': stiffness must be a finite number"),
    "infinite": (lambda: JointSpring("f", "j", np.inf), "'f': stiffness must be a finite number"),
    "feeding curve": (lambda: JointSpring("f", "j", 1.0, Curve([-1, 1], [1, -1])), "'f': damping: at the velocity"),
    "coordinate": (lambda: JointSpring("f", "j", 1.0, coordinate="bend"), "'f': coordinate must be"),
    "half a turn": (lambda: JointSpring("f", "j", 1.0, turns=0.5), "'f': turns is 0.5"),
    "turns of a stroke": (lambda: JointSpring("f", "j", 1.0, coordinate="stroke", turns=1), "'f': turns is 1"),
    "no creep": (lambda: JointFriction("f", "j", 1.0, 0.0), "'f': creep is 0"),
    "negative friction": (lambda: JointFriction("f", "j", -1.0, 0.1), "'f': coulomb is -1"),
    "negative normal force": (lambda: JointFriction("f", "j", 1.0, 0.1, -3.0), "'f': normal is -3"),
    "static without Stribeck": (lambda: JointFriction("f", "j", 1.0, 0.1, static=2.0), "belong together"),
    "static below Coulomb": (lambda: JointFriction("f", "j", 3.0, 0.1, static=2.0, stribeck=1.0), "'f': static is 2"),
    "endless stop": (lambda: JointStop("f", "j", 1.0, 0.1), "'f' stops nothing"),
    "crossed stops": (lambda: JointStop("f", "j", 1.0, 0.1, 2.0, 1.0), "lower must be below upper"),
    "sharp stop": (lambda: JointStop("f", "j", 1.0, 0.0, 2.0), "'f': entry is 0"),
    "negative gain": (lambda: Servo("f", "j", 1.0, -1.0), "'f': kp is -1"),
    "no limit": (lambda: Servo("f", "j", 1.0, 1.0, limit=np.nan), "'f': limit is nan"),
    "no target": (lambda: Servo("f", "j", None, 1.0), "'f': target must be"),
    "target of NaN": (lambda: Servo("f", "j", np.nan, 1.0), "'f': target must be a finite number"),
    "factor of NaN": (lambda: Pressure("f", "b", 1.0, function=np.nan), "'f': function must be a finite number"),
    "actuator of NaN": (lambda: Actuator("f", "j", np.nan), "'f': force must be a finite number"),
    "five directions": (lambda: Bushing("f", "a.x", "b.x", (1,) * 5), "'f': stiffness must have the shape"),
    "skew bushing": (lambda: Bushing("f", "a.x", "b.x", np.arange(36.0).reshape(6, 6)), "'f': stiffness must be symm"),
    "feeding bushing": (
        lambda: Bushing("f", "a.x", "b.x", (1,) * 6, (1,) * 5 + (-1,)),
        "'f': damping has the negative",
    ),
    "bushing of NaN": (lambda: Bushing("f", "a.x", "b.x", (1,) * 5 + (np.nan,)), "'f': stiffness holds values"),
    "bushing to itself": (lambda: Bushing("f", "a.x", "a.x", (1,) * 6), "'f' ties 'a.x' to itself"),
    "bushing without axis": (lambda: Bushing("f", "a.x", "b.x", (1,) * 6, axes=(0, 0, 0)), "'f': axes must be"),
    "flat nodal forces": (lambda: NodalForces("f", "b", [1, 2], [1, 2, 3]), "'f': forces must have the shape"),
    "fractional points": (lambda: NodalForces("f", "b", [1.5], [[1, 2, 3]]), "'f': points must be whole"),
    "axes": (lambda: NodalForces("f", "b", [1], [[1, 2, 3]], axes="local"), "'f': axes must be"),
    "pressure of NaN": (lambda: Pressure("f", "b", np.nan), "'f': pressure holds values"),
    "modal forces of NaN": (lambda: ModalForce("f", "b", [np.nan]), "'f': values holds"),
}


@pytest.mark.parametrize(("make", "message"), REFUSED.values(), ids=list(REFUSED))
def test_bad_forces_are_refused_by_name(make, message):
    with pytest.raises(InputError, match=message):
        make()


MISPLACED = {
    "joint": (JointSpring("f", "tye", 1.0), "'f': there is no joint 'tye'; did you mean 'tie'"),
    "coordinate": (Actuator("f", "root"), "'f': the spherical joint 'root' has no coordinate 'angle'"),
    "body": (Pressure("f", "on", 1.0), "'f': there is no body 'on'"),
    "marker": (Bushing("f", "one.z", "two.a", (1,) * 6), "no interface 'z'"),
    "one body": (Bushing("f", "one.a", "one.b", (1,) * 6), "'f' ties 'one' to itself"),
    "point": (NodalForces("f", "one", [99], [[1, 2, 3]]), "'f': there is no point 99"),
    "triangle": (Pressure("f", "one", 1.0, [7]), "'f' acts on triangle 7"),
    "nothing": (Pressure("f", "one", 1.0, lambda at: at[:, 0] > 99), "'f' acts on no triangle"),
    "points": (Pressure("f", "one", [1.0, 2.0]), "'f': 2 values for the 12 points"),
    "modes": (ModalForce("f", "one", [1.0]), "'f': 1 values for the 4 modes"),
}


@pytest.mark.parametrize(("force", "message"), MISPLACED.values(), ids=list(MISPLACED))
def test_forces_on_what_is_not_there_are_refused_by_name(force, message):
    with pytest.raises(InputError, match=message):
        replace(chain(), forces=(force,))


def test_a_force_on_a_body_without_a_surface_is_refused():
    with pytest.raises(InputError, match="'f': body 'wheel' has no surface"):
        rotor(Pressure("f", "wheel", 1.0))


def test_a_spring_to_a_missing_marker_and_a_repeated_name_are_refused():
    with pytest.raises(InputError, match="no interface 'z'"):
        replace(chain(), springs=(SpringDamper("f", "one.z", "two.a", 1.0),))
    with pytest.raises(InputError, match="'tie' is used more than once"):
        replace(chain(), forces=(JointSpring("tie", "tie", 1.0),))


def weight_on_a_spring(**changes):
    """A block of 2 kg on a spring of 50 N/m along z."""
    block = rigid_body("block", mass=2.0, inertia=(1, 1, 1), points={"pin": (0, 0, 0)})
    scene = Scene(
        (Body("block", block),),
        (Joint("guide", "translational", "ground.O", "block.pin", axis=(0, 0, 1)),),
        forces=(JointSpring("spring", "guide", 50.0, coordinate="stroke"),),
        ground={"O": (0, 0, 0)},
    )
    return replace(scene, **changes)


def test_gravity_may_vary_with_time():
    """z'' + 25 z = -9.81 + 3 sin(2 pi t), from rest."""
    wave = harmonic(amplitude=3.0, frequency=1.0, mean=-9.81)
    result = integrate(weight_on_a_spring(gravity=(0, 0, wave)), end=2.0, output_step=0.05, method=RK4(1e-3))
    t, w0, w = result.time, 5.0, 2 * np.pi
    exact = -9.81 / w0**2 * (1 - np.cos(w0 * t)) + 3.0 / (w0**2 - w**2) * (np.sin(w * t) - w / w0 * np.sin(w0 * t))
    np.testing.assert_allclose(result["guide.stroke"], exact, atol=1e-9)


def test_varying_gravity_and_a_moving_base_add_up():
    """Gravity and base move together: a lift in free fall, whichever way it is said."""
    falls = harmonic(amplitude=3.0, frequency=1.0)
    scene = weight_on_a_spring(gravity=(0, 0, falls), base_acceleration=(0, 0, falls))
    still = integrate(scene, end=0.5, output_step=0.1, method=RK4(1e-3))
    np.testing.assert_allclose(still["guide.stroke"], 0.0, atol=1e-12)
    steps = weight_on_a_spring(gravity=(0, 0, lambda t: -9.81 if t < 0.25 else 0.0))
    assert replace(steps, name="again").base_acceleration == steps.base_acceleration
    assert not steps.gravity.any()
    for given in (polynomial(1.0, 2.0), falls, table([0.0, 0.3, 1.0], [1.0, 2.0, -4.0])):
        (_, _, opposite), at = weight_on_a_spring(gravity=(0, 0, given)).base_acceleration, 0.4
        assert opposite.kind == given.kind
        np.testing.assert_allclose(evaluate(opposite, at), -np.array(evaluate(given, at)), rtol=1e-14)
    constants = weight_on_a_spring(gravity=(0, polynomial(1.0), -9.81), base_acceleration=(2.0, 0, 0))
    np.testing.assert_array_equal(constants.gravity, [0, 1.0, -9.81])
    assert constants.base_acceleration == weight_on_a_spring(base_acceleration=(2.0, 0, 0)).base_acceleration


@pytest.mark.parametrize("varying", ["gravity", "base_acceleration"])
def test_energy_of_gravity_is_that_of_its_constant_components(varying):
    """What varies is counted nowhere: of a weight that is held fast nothing changes, else its work is missing."""
    wave = harmonic(amplitude=3.0, frequency=1.0, phase=0.5)
    given = {"gravity": (0, 2.0, wave)} if varying == "gravity" else {"gravity": (0, 2.0, 0), varying: (0, 0, wave)}
    scene = weight_on_a_spring(**given)
    held = replace(scene, drivers=(Driver("stays", "guide", 0.7, coordinate="stroke"),))
    still = integrate(held, end=1.0, output_step=0.1, method=RK4(1e-2))
    np.testing.assert_allclose(still["energy.gravity"], 0.0, atol=1e-12)
    free = integrate(scene, end=1.0, output_step=0.1, method=RK4(1e-3), outputs=("*",))
    np.testing.assert_allclose(free["energy.total"], free["guide.stroke_rate"] ** 2, rtol=1e-9)


def test_base_acceleration_needs_three_components():
    with pytest.raises(InputError, match="base_acceleration needs three"):
        replace(chain(), base_acceleration=(1.0, 2.0))


@pytest.mark.parametrize(
    ("force", "message"),
    [
        (Actuator("push", "tie", lambda t: np.nan), "'push'.*finite"),
        (Actuator("push", "tie", function=lambda t, state: [1.0, 2.0]), "'push'.*right count"),
        (Servo("push", "tie", lambda t: 1 / (t - 0.005), 1.0), "'push'"),
    ],
)
def test_a_failing_python_function_stops_the_run_and_is_named(force, message):
    scene = chain(0, 0, kind="revolute")
    with pytest.raises(ComputationError, match=message):
        integrate(replace(scene, forces=(force,)), end=0.02, output_step=0.005, method=RK4(5e-3))
    system = compile_scene(replace(scene, forces=(force,)))
    if "finite" in message:
        with pytest.raises(ComputationError, match=message):
            applied_forces(system, 0.0, *random_state(scene))


# ---- planar scenes --------------------------------------------------------------------------------------------------


HINGE = Joint("hinge", "revolute", "carriage.pin", "link.pin")


def arm(hinge: Joint = HINGE, **changes) -> Scene:
    """A driven pendulum on a carriage that slides along x; everything moves in the plane z = 0."""
    carriage = rigid_body("carriage", mass=2.0, inertia=[1, 1, 1], points={"pin": (0, 0, 0)})
    link = rigid_body("link", mass=1.0, inertia=[0.1, 0.1, 0.1], points={"pin": (0, 0.5, 0), "end": (0, -0.5, 0)})
    parts = {
        "forces": (
            JointSpring("coil", "hinge", 3.0, 0.1, 0.2),
            JointFriction("rub", "guide", 0.5, 0.1, coordinate="stroke"),
            Actuator("motor", "hinge", harmonic(amplitude=2.0, frequency=1.0)),
        ),
        "base_acceleration": (harmonic(amplitude=3.0, frequency=0.8), 0, 0),
    }
    return Scene(
        (Body("carriage", carriage), Body("link", link, position=(0, -0.5, 0))),
        (
            Joint("guide", "translational", "ground.o", "carriage.pin", axis=(1, 0, 0)),
            hinge,
        ),
        ground={"o": (0, 0, 0)},
        gravity=(0, -9.81, 0),
        **parts | changes,
    )


def test_forces_on_joints_in_the_plane_keep_a_scene_planar():
    scene = arm()
    assert assemble(scene).system.scene.plane == "z"
    planar, spatial = (
        integrate(replace(scene, plane=plane), end=1.0, output_step=0.1, method=RK4(1e-3)) for plane in ("auto", "none")
    )
    for name in ("guide.stroke", "hinge.angle", "coil.torque", "rub.force", "motor.torque"):
        np.testing.assert_allclose(planar[name], spatial[name], rtol=0, atol=1e-11)


@pytest.mark.parametrize(
    "changes",
    [
        {"base_acceleration": (0, 0, lambda t: 1.0)},
        {"forces": (Bushing("b", "ground.o", "link.end", (1,) * 6),)},
        {
            "hinge": replace(HINGE, kind="cylindrical"),
            "forces": (Actuator("push", "hinge", 1.0, coordinate="stroke"),),
        },
    ],
    ids=["base", "bushing", "stroke along the normal"],
)
def test_what_may_act_across_the_plane_is_computed_in_space(changes):
    assert assemble(arm(**changes)).system.scene.plane not in ("x", "y", "z")


def test_a_scene_declared_planar_refuses_a_base_that_leaves_the_plane():
    with pytest.raises(InputError, match="base_acceleration has a component"):
        assemble(arm(base_acceleration=(0, 0, 1.0), plane="z"))


def test_the_table_of_forces_is_that_of_the_declarations():
    """docs/forces.md: a row for each kind, as the kind says, with the names of what a result keeps of it."""
    text = (ROOT / "docs" / "forces.md").read_text(encoding="utf-8")
    rows = [line for line in text.splitlines() if line.startswith("| `")]
    for kind, row in zip(FORCES, rows, strict=False):
        table = "" if kind.table == "forces" else f" (`{kind.table}`)"
        assert row.startswith(f"| `{kind.__name__}`{table} | {kind.acts} | {kind.positive} | ")
    for force in (*PAIRS.values(), *SPREAD.values()):
        row = rows[FORCES.index(type(force))]
        named = [f"`.{one.name}` [{one.unit}]" for one in force.place.measured]
        assert "| the same |" in row or all(name in row for name in named)
