"""Reactions of redundant joints: at every row the smallest that give the accelerations, whatever rows the motion keeps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_dyn_singular import bricard
from test_independence import locomotive
from test_planar_loops import FLAT, OBLIQUE, loop

import ffr_dyn as fd
from ffr_dyn.analyses.forward import forward
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.consistency.evaluation import evaluate, evaluated_mass_matrix, evaluator
from ffr_dyn.functions.formula import formula
from ffr_dyn.integrators import RK4, ROS2, ROS3, GeneralisedAlpha, Integrator
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import rigid_body

GRAVITY = (0.0, -9.81, 0.0)


def smallest(scene: Scene, x: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Multipliers of all rows as computed, and by singular values: smallest, weighted by the joints' blocks of J M^-1 J^T."""
    at = evaluator(assemble(scene).all_rows)
    now = evaluate(at, 0.0, x, v)
    moving = np.flatnonzero(np.abs(now.jacobian).sum(axis=0))
    J, M = now.jacobian[: now.lam.size, moving], evaluated_mass_matrix(at)[np.ix_(moving, moving)]
    S = J @ np.linalg.solve(M, J.T)
    rates = J @ np.linalg.solve(M, now.force[moving]) - now.gamma[: now.lam.size]
    blocks = np.repeat(np.arange(len(at.system.blocks)), [len(block.words) for block in at.system.blocks])
    root = np.linalg.cholesky(np.where(blocks[:, None] == blocks, S, 0.0))
    alike = np.linalg.solve(root, np.linalg.solve(root, S).T)
    return now.lam, np.linalg.solve(root.T, np.linalg.pinv(alike, rcond=1e-9) @ np.linalg.solve(root, rates))


@pytest.mark.parametrize("angle", [0.3, 0.5 * np.pi - 1e-4, 0.5 * np.pi, -0.5 * np.pi, 2.0])
@pytest.mark.parametrize("count", [3, 5])
def test_reactions_are_the_smallest_by_singular_values(count, angle):
    scene = locomotive(count, angle, 8.0, "none", gravity=GRAVITY)
    lam, wanted = smallest(scene, *(lambda a: (a.x, a.v))(assemble(scene)))
    np.testing.assert_allclose(lam, wanted, rtol=0, atol=1e-6 * np.abs(wanted).max())


def test_reactions_do_not_depend_on_how_the_scene_lies_in_space():
    """A loop that is redundant in space, with a weight across its plane, too."""
    weight, found = np.array([1.0, -9.0, 3.0]), []
    for way in (FLAT, OBLIQUE):
        scene = replace(loop({}, 0.0, way), gravity=way @ weight, plane="none")
        assert assemble(scene).redundant
        result = fd.kinematic(scene, end=0.4, output_step=0.1)
        of = {name: result[name] @ way for name in result.quantities if name.endswith((".force", ".moment"))}
        found.append({name: values for name, values in of.items() if values.shape[1] == 3})
    for name, values in found[0].items():
        np.testing.assert_allclose(found[1][name], values, rtol=0, atol=1e-6 * max(np.abs(values).max(), 1.0))


def test_what_a_drift_within_the_tolerance_contradicts_is_not_in_the_reactions():
    """Rows that are redundant contradict one another where the state is off them, in what no motion can mend."""
    scene = locomotive(3, 0.8, 8.0, gravity=GRAVITY)
    start = assemble(scene)
    lam, _ = smallest(scene, start.x, start.v)
    off = start.x + 1e-9 * np.random.default_rng(1).normal(size=start.x.size)
    np.testing.assert_allclose(smallest(scene, off, start.v)[0], lam, rtol=0, atol=1e-6 * np.abs(lam).max())


@pytest.mark.parametrize("method", [RK4(1e-3), ROS2(1e-3), ROS3(1e-3)])
@pytest.mark.parametrize("drawn", [0.7, 2.5])
def test_a_locomotive_is_singular_where_its_cranks_are_aligned_and_nowhere_else(method, drawn):
    """In whatever position it is drawn: the rows that are left out of the motion are chosen there. The reactions pass all
    positions smoothly, and are the same in the plane and in space."""
    found = [ran(locomotive(3, drawn, 8.0, plane, gravity=GRAVITY), method) for plane in ("auto", "none")]
    for result in found:
        y = result["s0.b.position"][:, 1]
        aligned = result.time[:-1][(y[1:] * y[:-1] < 0)]
        note = next(text for text in result.attributes["notes"] if "the motion passes" in text)
        told = np.array([float(word) for word in note.split("near t = ")[1].split(" s,")[0].split(", ")])
        np.testing.assert_allclose(told, aligned, atol=3e-3)
        for name in (name for name in result if name.endswith(".force")):
            force = result[name]
            assert np.abs(np.diff(force, 2, axis=0)).max() < 1e-3 * np.ptp(force, axis=0).max()
    for name in (name for name in found[0] if name.endswith(".force")):
        np.testing.assert_allclose(found[0][name], found[1][name], rtol=0, atol=1e-3 * np.abs(found[0][name]).max())


def ran(scene: Scene, method: Integrator):
    return integrate(scene, end=1.2, output_step=1e-3, method=method)


def test_rows_where_the_kept_rows_alone_are_singular_have_the_accelerations_of_the_mechanism():
    """A driven crank whose rows of results stand at 90 degrees exactly."""
    scene = locomotive(3, 0.0, 2 * np.pi, "none", gravity=GRAVITY)
    scene = replace(scene, drivers=(Driver("d", "foot0", formula("2*pi*t")),))
    result = integrate(scene, end=0.5, output_step=0.25, method=RK4(1e-3), outputs=("*",))
    np.testing.assert_allclose(result["rod.p0.position"][1, :2], (0.0, 1.0), rtol=0, atol=1e-8)
    carried = sum(result[f"top{k}.force"][1] for k in range(3))
    assert np.abs(np.abs(carried[1]) - 2.0 * (4 * np.pi**2 - 9.81)) < 1e-4


def test_bricards_reactions_are_the_smallest():
    scene = bricard()
    start = assemble(scene)
    lam, wanted = smallest(scene, start.x, start.v)
    np.testing.assert_allclose(lam, wanted, rtol=0, atol=1e-6 * np.abs(wanted).max())


def door(hinges: int) -> Scene:
    """At rest on one hinge or two, whose axis gravity is along: all that holds it is constant."""
    points = {"a": np.array([0, 0, -0.5]), "b": np.array([0, 0, 0.5])}
    model = rigid_body("door", mass=10.0, inertia=(1.0, 1.0, 1.0), centre_of_mass=(0.5, 0, 0), points=points)
    joints = tuple(Joint(f"h{k}", "revolute", f"ground.{k}", f"door.{k}") for k in "ab"[:hinges])
    return Scene((Body("door", model),), joints, ground={"a": (0, 0, -0.5), "b": (0, 0, 0.5)}, gravity=(0, 0, -9.81))


@pytest.mark.parametrize("hinges", [1, 2])
@pytest.mark.parametrize(
    "method", [ROS2(1e-3), RK4(1e-3), GeneralisedAlpha(1e-3), GeneralisedAlpha(1e-3, form="stabilised")]
)
def test_a_door_at_rest_is_at_rest(hinges, method):
    """Iterations end at what rounding leaves, and rounding of reactions is no motion that rows are too coarse for."""
    result = forward(door(hinges), end=0.2, output_step=0.01, method=method)
    held = sum(result[f"h{k}.force"] for k in "ab"[:hinges])
    np.testing.assert_allclose(held, np.tile([0, 0, 98.1], (21, 1)), atol=1e-7)
    np.testing.assert_allclose(result["ha.force"][:, 2], 98.1 / hinges, atol=1e-6)
    assert not any("too coarse" in note for note in result.attributes["notes"])


# ---- the same in every analysis -----------------------------------------------------------------------------------------

SUN, PLANET, RING = 20, 17, 54  # teeth
PLANETS = range(3)


def planetary(*drivers: fd.Driver, **more) -> fd.Scene:
    """A sun, three planets on a carrier, and a ring that stands still; the carrier bears a torque of 10 N m. Two of the six
    meshes are redundant."""
    places = [0.037 * np.array([np.cos(2 * np.pi * k / 3), np.sin(2 * np.pi * k / 3), 0.0]) for k in PLANETS]

    def wheel(name: str, at=(0, 0, 0), **points) -> fd.Body:
        body = fd.rigid_body(name, mass=1.0, inertia=(1e-3, 1e-3, 2e-3), points={"o": (0, 0, 0), **points})
        return fd.Body(name, body, position=at)

    carrier = wheel("carrier", **{f"p{k}": places[k] for k in PLANETS})
    joints = [
        fd.Joint("out", "revolute", "ground.o", "carrier.o"),
        fd.Joint("in", "revolute", "carrier.o", "sun.o"),
        *(fd.Joint(f"pin{k}", "revolute", f"carrier.p{k}", f"planet{k}.o") for k in PLANETS),
    ]
    meshes = [fd.Coupling(f"inner{k}", "in.angle", f"pin{k}.angle", -SUN / PLANET) for k in PLANETS]
    meshes += [fd.Coupling(f"outer{k}", f"pin{k}.angle", "out.angle", -PLANET / RING) for k in PLANETS]
    bodies = [carrier, wheel("sun"), *(wheel(f"planet{k}", tuple(places[k])) for k in PLANETS)]
    load = fd.Load("load", "carrier.o", moment=(0, 0, -10.0))
    return fd.Scene(bodies, joints, drivers, couplings=meshes, loads=(load,), ground={"o": (0, 0, 0)}, **more)


def held(joint: str) -> fd.Scene:
    return planetary(fd.Driver("hold", joint, 0.3))


SPAN = {"end": 0.02, "output_step": 0.01}
HELD = {
    "static": lambda: fd.static(held("in")),
    "kinematic": lambda: fd.kinematic(held("in"), **SPAN),
    "quasi-static": lambda: fd.inverse(held("in"), elastic=fd.QuasiStatic(), **SPAN),
    "dynamic": lambda: fd.inverse(held("in"), **SPAN),
    "mixed": lambda: fd.mixed(held("out"), unknown=(fd.JointEffort("torque", "in"),), **SPAN),
}


@pytest.mark.parametrize("analysis", HELD)
def test_planets_share_their_load_in_every_analysis(analysis):
    """A third of the torque at each mesh with the ring, by symmetry, and of it the ratio of the teeth at those with the sun;
    quasi-static and mixed analyses told what one choice of rows left to them, such as 10, 0 and 0."""
    result = HELD[analysis]()
    for k in PLANETS:
        np.testing.assert_allclose(result[f"outer{k}.effort"][-1], 10 / 3, rtol=1e-6)
        np.testing.assert_allclose(result[f"inner{k}.effort"][-1], -10 / 3 * PLANET / RING, rtol=1e-6)


SPRUNG = planetary(forces=(fd.JointSpring("spring", "in", stiffness=50.0, damping=0.3),))
TORQUE, MESHES = fd.JointEffort("torque", "out"), tuple(f"outer{k}.effort" for k in PLANETS)


def test_planets_share_their_load_in_a_linearised_scene():
    """What a torque on the carrier changes in the meshes, at 0 Hz."""
    found = fd.linearise(SPRUNG, inputs=(TORQUE,), outputs=MESHES)
    np.testing.assert_allclose(found.D - found.C @ np.linalg.solve(found.A, found.B), -1 / 3, rtol=1e-5)


@pytest.mark.slow
def test_planets_share_their_load_over_the_frequency():
    slow = fd.response(SPRUNG, input=TORQUE, outputs=MESHES, frequencies=[1e-3])
    np.testing.assert_allclose(slow["gain"][0], 1 / 3, rtol=1e-5)
    large = fd.forced(SPRUNG, input=TORQUE, amplitude=1.0, outputs=MESHES, band_of=(0.5, 0.6))
    np.testing.assert_allclose(large["mean"], 10 / 3, rtol=1e-5)
    np.testing.assert_allclose(large["amplitude"][0], 1 / 3, rtol=1e-2)  # far below the only resonance


def test_events_on_redundant_reactions_have_their_moment():
    """A torque that grows by 10 N m/s: each mesh with the ring passes 1 N m at 0.3 s, and a run that ends there has that
    in its last row. They were told a step too early or too late."""
    load = fd.Load("load", "carrier.o", moment=(0, 0, fd.polynomial(0, -10.0)))
    scene = replace(planetary(fd.Driver("turn", "in", fd.polynomial(0, 2.0))), loads=(load,))
    events = [fd.Event(f"e{k}", f"outer{k}.effort", 1.0, stop=k == 2) for k in PLANETS]
    result = fd.forward(scene, end=1.0, output_step=0.1, method=fd.ROS2(2e-2), check=False, events=events)
    np.testing.assert_allclose([event["time"] for event in result.attributes["events"]], [0.3] * 3, rtol=1e-5)
    np.testing.assert_allclose([result[f"outer{k}.effort"][-1] for k in PLANETS], 1.0, rtol=1e-5)
