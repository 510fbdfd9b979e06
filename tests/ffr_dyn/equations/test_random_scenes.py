"""Scenes that chance makes, of all joints and forces: compiled as on paper, and indifferent to what does not matter.

In states at random, off their joints, with loops: rows, accelerations and multipliers are those on paper. In assembled
states: a joint that is there twice (a closed loop of dependent rows), another order and other names, another direction of
the whole in space and other units of length change nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from synthetic import cloud
from test_dyn_kernels import SPECIAL, random_state
from test_motion import assert_twins, stiffened

from ffr_dyn.compile.engine import evaluate_at, new_engine
from ffr_dyn.compile.scene_tables import compile_scene
from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.equations.motion import equations_of_motion
from ffr_dyn.functions.rotation import rotation_matrix
from ffr_dyn.kernels.tables import OK
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.forces import Actuator, Bushing, JointFriction, JointSpring, Load, ModalForce, SpringDamper
from ffr_dyn.scene.joints import COORDINATES, KINDS, Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import FlexibleBody

T = 0.37
# Kinds whose frames coincide in the drawn position, which is then assembled.
DRAWN = tuple(kind for kind in KINDS if kind not in ("universal", "perpendicular", "distance", "screw"))
LOOPS = ("distance", "perpendicular", "point-on-plane", "point-on-line")  # that take few freedoms
FORCES = ("spring", "bushing", "load", "follower", "modal", "torsion", "friction", "actuator")

# Few and always the same here; the slow test makes others each time.
USUAL = {"deadline": None, "database": None, "suppress_health_check": list(HealthCheck)}
FEW, MANY = settings(max_examples=20, derandomize=True, **USUAL), settings(max_examples=300, **USUAL)


@dataclass(frozen=True)
class Draft:
    """What is drawn of a scene; lengths, directions, masses come from the seed.

    joints : of each body, the number of the one it hangs on (-1: the ground) and the kind
    loops  : pairs of bodies and kinds
    """

    seed: int
    modes: tuple[int, ...]
    second_order: bool
    joints: tuple[tuple[int, str], ...]
    loops: tuple[tuple[int, int, str], ...]
    forces: tuple[str, ...]


@st.composite
def drafts(draw, kinds: tuple[str, ...] = DRAWN, loops: int = 0, most: int = 6) -> Draft:
    count = draw(st.integers(2, most))
    bodies = st.integers(0, count - 1)
    return Draft(
        seed=draw(st.integers(0, 10**6)),
        modes=tuple(draw(st.integers(0, 4)) for _ in range(count)),
        second_order=draw(st.booleans()),
        joints=tuple((draw(st.integers(-1, k - 1)), draw(st.sampled_from(kinds))) for k in range(count)),
        loops=tuple(draw(st.lists(st.tuples(bodies, bodies, st.sampled_from(LOOPS)), max_size=loops))),
        forces=tuple(draw(st.lists(st.sampled_from(FORCES), max_size=4))),
    )


def direction(random) -> np.ndarray:
    vector = random.normal(size=3)
    return vector / np.linalg.norm(vector)


def turned(random) -> np.ndarray:
    return rotation_matrix(direction_4(random))


def direction_4(random) -> np.ndarray:
    p = random.normal(size=4)
    return p / np.linalg.norm(p)


def tree(draft: Draft) -> Scene:
    """Bodies that hang on each other, in a drawn position that meets all joints."""
    random = np.random.default_rng(draft.seed)
    ground, gravity = random.normal(size=3), random.normal(size=3) * 5
    bodies: list[Body] = []
    joints: list[Joint] = []
    for k, ((parent, kind), n) in enumerate(zip(draft.joints, draft.modes, strict=True)):
        model, frame, A = cloud(n, seed=draft.seed + k, name=f"b{k}"), turned(random), turned(random)
        if draft.second_order and n:
            model = stiffened(model, draft.seed + k)
            model = replace(model, stiffening=0.1 * model.stiffening)  # the mass matrix stays positive at any q
        end = ("b", "c")[int(random.integers(2))]
        marker, at, of_parent = ("ground.O", ground, np.eye(3)) if parent < 0 else placed(bodies[parent], end)
        axes = {"axis": of_parent.T @ frame, "axis_j": A.T @ frame}
        joints.append(Joint(f"j{k}", kind, marker, f"b{k}.a", **axes, **SPECIAL.get(kind, {})))
        position = at - A @ model.interfaces[0].position
        motion = {"velocity": random.normal(size=3), "omega_bar": random.normal(size=3), "damping": 0.02}
        bodies.append(Body(f"b{k}", model, position=position, rotation=A, q_dot=0.1 * random.normal(size=n), **motion))
    scene = Scene(tuple(bodies), tuple(joints), ground={"O": ground}, gravity=gravity, plane="none")
    return with_forces(scene, draft, random)


def placed(body: Body, end: str) -> tuple[str, np.ndarray, np.ndarray]:
    """Name and place of a marker, and the axes of its body."""
    A = rotation_matrix(body.rotation)
    return f"{body.name}.{end}", body.position + A @ body.model.interfaces["abc".index(end)].position, A


def with_forces(scene: Scene, draft: Draft, random) -> Scene:
    loads, springs, forces = [], [], []
    for number, kind in enumerate(draft.forces):
        name, one, other = f"f{number}", *random.permutation(len(scene.bodies))[:2]
        body, markers = scene.bodies[one], (f"b{one}.c", f"b{other}.c")
        joint = scene.joints[int(random.integers(len(scene.joints)))]
        coordinate = {"coordinate": COORDINATES[joint.kind][0]} if COORDINATES[joint.kind] else None
        if kind == "spring":
            springs.append(SpringDamper(name, *markers, 30.0, 2.0, 0.3, 1.5))
        elif kind == "bushing":
            forces.append(Bushing(name, *markers, (20.0,) * 3 + (3.0,) * 3, (0.5,) * 6))
        elif kind in ("load", "follower"):
            axes = "global" if kind == "load" else "body"
            loads.append(Load(name, markers[0], random.normal(size=3), random.normal(size=3), axes=axes))
        elif kind == "modal" and body.model.n:
            forces.append(ModalForce(name, body.name, random.normal(size=body.model.n)))
        elif kind == "torsion" and coordinate:
            forces.append(JointSpring(name, joint.name, 3.0, 0.5, 0.2, 0.7, **coordinate))
        elif kind == "friction" and coordinate:
            forces.append(JointFriction(name, joint.name, 2.0, 0.1, viscous=0.2, **coordinate))
        elif kind == "actuator" and coordinate:
            forces.append(Actuator(name, joint.name, 1.5, **coordinate))
    return replace(scene, loads=tuple(loads), springs=tuple(springs), forces=tuple(forces))


def looped(draft: Draft) -> Scene:
    """With loops that its drawn position does not meet, and frames of joints in any direction."""
    scene, random = tree(draft), np.random.default_rng(draft.seed + 1)
    joints = [replace(j, axis=direction(random), axis_j=direction(random)) for j in scene.joints]
    for k, (one, other, kind) in enumerate(draft.loops):
        if one != other:
            axes = {"axis": direction(random), "axis_j": direction(random)}
            joints.append(Joint(f"loop{k}", kind, f"b{one}.b", f"b{other}.c", **axes, **SPECIAL.get(kind, {})))
    return replace(scene, joints=tuple(joints))


def accelerations(scene: Scene) -> dict[str, np.ndarray]:
    """[A^T R_ddot, omega_bar_dot, q_ddot] of every body by its name, in the assembled position."""
    assembled = assemble(scene, time=0.0)
    system, engine = assembled.system, new_engine(assembled.system, assembled.x, assembled.v)
    assert evaluate_at(engine, 0.0, assembled.x, assembled.v) == OK
    place, acc = system.layout, engine.work.bodies.acc
    return {
        body.name: np.concatenate([acc[place.rigid(b)], acc[place.q_dot(b)]])
        for b, body in enumerate(system.scene.bodies)
    }


def assert_same(found: dict[str, np.ndarray], given: dict[str, np.ndarray], rtol: float = 1e-6) -> None:
    scale = max(np.abs(acc).max(initial=0.0) for acc in given.values())
    assert found.keys() == given.keys()
    for name, acc in given.items():
        np.testing.assert_allclose(found[name], acc, rtol=0, atol=rtol * scale)


# ---- laws -----------------------------------------------------------------------------------------------------------


def as_on_paper(draft: Draft) -> None:
    scene = looped(draft)
    x, v = random_state(scene, draft.seed)
    system = compile_scene(scene)
    jacobian = equations_of_motion(scene, T, x, v, system.blocks).jacobian
    rows = jacobian / np.linalg.norm(jacobian, axis=1)[:, None]
    assume(np.linalg.svd(rows, compute_uv=False).min() > 1e-2)  # of dependent rows multipliers are not unique
    assume(len(rows) <= jacobian.shape[1])
    assert_twins(system, T, x, v, rtol=1e-7)


def a_joint_that_is_there_twice(draft: Draft) -> None:
    scene = tree(draft)
    joint = scene.joints[draft.seed % len(scene.joints)]
    twice = replace(scene, joints=(*scene.joints, replace(joint, name="again")))
    assert_same(accelerations(twice), accelerations(scene))


def another_order(draft: Draft) -> None:
    scene = tree(draft)
    random = np.random.default_rng(draft.seed + 2)
    bodies, joints = random.permutation(len(scene.bodies)), random.permutation(len(scene.joints))
    shuffled = replace(
        scene,
        bodies=tuple(scene.bodies[k] for k in bodies),
        joints=tuple(replace(scene.joints[k], name=f"other{k}") for k in joints),
        **({"forces": ()} if scene.forces else {}),
    )
    assert_same(accelerations(shuffled), accelerations(replace(scene, forces=())))


def another_direction(draft: Draft) -> None:
    """Motions in body axes are the same; what is given in global axes turns."""
    scene, Q = tree(draft), turned(np.random.default_rng(draft.seed + 3))
    on_ground = {"ground": {name: Q @ at for name, at in scene.ground.items()}, "gravity": Q @ scene.gravity}
    bodies = [
        replace(b, position=Q @ b.position, rotation=Q @ rotation_matrix(b.rotation), velocity=Q @ b.velocity)
        for b in scene.bodies
    ]
    joints = [replace(j, axis=Q @ j.axis) if j.i == "ground.O" else j for j in scene.joints]
    loads = [
        load if load.axes == "body" else Load(load.name, load.marker, Q @ numbers(load.force), Q @ numbers(load.moment))
        for load in scene.loads
    ]
    moved = replace(scene, bodies=tuple(bodies), joints=tuple(joints), loads=tuple(loads), **on_ground)
    assert_same(accelerations(moved), accelerations(scene))


def numbers(functions) -> np.ndarray:
    return np.array([function(0.0)[0] if callable(function) else function for function in functions])


def other_units(draft: Draft) -> None:
    """Lengths in another unit: forces grow with it, moments with its square, inertia with its square."""
    s = 10.0
    draft = replace(
        draft, second_order=False, forces=tuple(f for f in draft.forces if f in ("load", "follower", "spring"))
    )
    scene = tree(draft)
    bodies = [
        replace(b, model=in_units(b.model, s), position=s * b.position, velocity=s * b.velocity, q_dot=s * b.q_dot)
        for b in scene.bodies
    ]
    loads = [
        Load(of.name, of.marker, s * numbers(of.force), s**2 * numbers(of.moment), axes=of.axes) for of in scene.loads
    ]
    springs = [
        replace(spring, free_length=s * spring.free_length, preload=s * spring.preload) for spring in scene.springs
    ]
    ground = {name: s * np.asarray(at) for name, at in scene.ground.items()}
    scaled = replace(
        scene,
        bodies=tuple(bodies),
        loads=tuple(loads),
        springs=tuple(springs),
        ground=ground,
        gravity=s * scene.gravity,
    )
    found = accelerations(scaled)
    unit = {name: np.concatenate([np.full(3, s), np.ones(3), np.full(acc.size - 6, s)]) for name, acc in found.items()}
    assert_same({name: acc / unit[name] for name, acc in found.items()}, accelerations(scene))


def in_units(model: FlexibleBody, s: float) -> FlexibleBody:
    """With lengths s times as many; mass and time stay."""
    interfaces = tuple(replace(i, position=s * i.position, phi_r=i.phi_r / s) for i in model.interfaces)
    moments = {"r_dm": s * model.r_dm, "rr_dm": s**2 * model.rr_dm, "rP_dm": s * model.rP_dm}
    return replace(model, interfaces=interfaces, surface=None, **moments)


LAWS = {law.__name__: (law, {}) for law in (a_joint_that_is_there_twice, another_order, another_direction, other_units)}
LAWS["as_on_paper"] = (as_on_paper, {"kinds": tuple(KINDS), "loops": 3})


@pytest.mark.parametrize("name", LAWS)
def test_of_few_scenes(name):
    law, drawn = LAWS[name]
    FEW(given(drafts(**drawn))(law))()


@pytest.mark.slow
@pytest.mark.parametrize("name", LAWS)
def test_of_many_scenes(name):
    law, drawn = LAWS[name]
    MANY(given(drafts(**drawn, most=20))(law))()


@pytest.mark.slow
def test_a_driven_joint_is_as_on_paper_in_any_tree():
    def law(draft: Draft) -> None:
        scene = tree(replace(draft, joints=((-1, "revolute"), *draft.joints[1:])))
        driven = replace(scene, drivers=(Driver("drive", "j0", lambda t: (0.2 * t, 0.2, 0.0)),))
        assembled = assemble(driven)
        assert_twins(assembled.system, 0.0, assembled.x, assembled.v, rtol=1e-6)

    FEW(given(drafts())(law))()
