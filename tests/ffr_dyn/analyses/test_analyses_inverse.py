"""Inverse dynamics: reactions of every joint against free-body balances, round trips, quasi-static deformation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from planar_beam import planar_beam
from synthetic import cloud
from test_analyses_kinematic import bar, slider_crank

from ffr_dyn.analyses.efforts import JointEffort
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.analyses.inverse import Dynamic, QuasiStatic, inverse
from ffr_dyn.analyses.kinematic import kinematic
from ffr_dyn.analyses.mixed import mixed
from ffr_dyn.analyses.static import static
from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.consistency.evaluation import evaluate, evaluator
from ffr_dyn.functions.rotation import rotation_matrix
from ffr_dyn.functions.time_functions import harmonic, polynomial
from ffr_dyn.integrators import RK4
from ffr_dyn.integrators.stabilisation import Projection
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.forces import Load
from ffr_dyn.scene.joints import COORDINATES, Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import rigid_body
from ffr_prep.common.errors import ComputationError, InputError

FINE = Projection(1e-13)
MOTION = harmonic(amplitude=0.7, frequency=0.8)
G = (0.3, -9.81, 0.5)


def arm(*kinds: str) -> Scene:
    """A chain of one driven body per joint kind, in space; a second revolute's driver is added where it is needed."""
    J = np.array([[0.2, 0.02, 0.01], [0.02, 0.3, -0.03], [0.01, -0.03, 0.25]])
    link = rigid_body(
        "link", mass=1.7, inertia=J, centre_of_mass=(0.4, 0.1, -0.05), points={"a": (0, 0, 0), "b": (0.8, 0.2, 0.1)}
    )
    bodies, joints, drivers = [], [], []
    for k, kind in enumerate(kinds):
        bodies.append(Body(f"body{k}", link, position=k * np.array([0.8, 0.2, 0.1])))
        before = "ground.O" if k == 0 else f"body{k - 1}.b"
        joints.append(Joint(f"joint{k}", kind, before, f"body{k}.a", axis=(0.2, 0.5, 1.0)))
        drivers += [Driver(f"{c}{k}", f"joint{k}", MOTION, coordinate=c) for c in COORDINATES[kind]]
    return Scene(tuple(bodies), tuple(joints), tuple(drivers), ground={"O": (0, 0, 0)}, gravity=G)


def wrench_of_motion(scene: Scene, result, number: int, h: float) -> np.ndarray:
    """(6,) force and moment about body `number`'s marker a that its motion and weight ask for: Newton and Euler with the
    momenta of the recorded velocities differentiated numerically (rows row-2 ... row+2, `h` apart)."""
    body = scene.bodies[number]
    name, model = body.name, body.model
    momenta = []
    for row in range(5):
        A = rotation_matrix(result[f"{name}.p"][row])
        c = A @ model.centre_of_mass
        omega = A @ result[f"{name}.omega_bar"][row]
        momenta.append([
            model.mass * (result[f"{name}.v"][row] + np.cross(omega, c)), A @ model.central_inertia @ A.T @ omega
        ])  # fmt: skip
    weights = np.array([1, -8, 0, 8, -1]) / (12 * h)
    force, moment = np.einsum("t,tck->ck", weights, np.array(momenta))
    force = force - model.mass * np.array(scene.gravity)
    A = rotation_matrix(result[f"{name}.p"][2])
    return np.concatenate([force, moment + np.cross(A @ model.centre_of_mass, force)])


@pytest.mark.parametrize("kind", ["revolute", "translational", "cylindrical", "fixed"])
def test_reactions_are_those_of_the_free_body(kind):
    """The last body of a moving chain: joint and driver reactions together carry its inertia and weight."""
    scene, h = arm("revolute", kind), 1e-3
    result = inverse(scene, start=0.4, end=0.4 + 4 * h, output_step=h, elastic=QuasiStatic())
    blocks = [name for name in ("joint1", "angle1", "stroke1") if f"{name}.force" in result.quantities]
    given = sum(np.concatenate([result[f"{n}.force"][2], result[f"{n}.moment"][2]]) for n in blocks)
    np.testing.assert_allclose(given, wrench_of_motion(scene, result, 1, h), atol=2e-8)


@pytest.mark.parametrize(
    "kind", ["spherical", "universal", "planar", "point-on-line", "point-on-plane", "distance", "orientation"]
)
def test_reactions_of_a_loose_joint_balance_the_free_body(kind):
    """A body that a joint does not fix moves freely: in a forward run its reaction still carries inertia and weight."""
    scene, h = arm("revolute"), 1e-3
    link = scene.bodies[0].model
    more = {"universal": {"axis": (1, 0, 0), "axis_j": (0, 1, 0)}, "distance": {"length": 0.5}}.get(kind, {})
    at = (0.8, 0.2, 0.1) if kind != "distance" else (0.8, 0.7, 0.1)
    scene = replace(
        scene,
        bodies=(*scene.bodies, Body("last", link, position=at, omega_bar=(0.5, 0.2, -0.3))),
        joints=(*scene.joints, Joint("loose", kind, "body0.b", "last.a", **more)),
    )
    result = integrate(scene, end=4 * h, output_step=h, method=RK4(h / 4))
    given = np.concatenate([result["loose.force"][2], result["loose.moment"][2]])
    np.testing.assert_allclose(given, wrench_of_motion(scene, result, 1, h), atol=2e-7)


def test_inverse_and_kinematics_agree_for_rigid_bodies():
    scene = slider_crank(0.2, 0.7, Driver("motor", "main", polynomial(0.3, 4.0, 1.5)))
    one = inverse(scene, end=0.5, output_step=0.1, elastic=Dynamic(RK4(5e-4)))
    other = kinematic(scene, end=0.5, output_step=0.1)
    for name in ("rod.R", "rod.v", "motor.effort", "motor.power", "guide.force", "pin.force"):
        np.testing.assert_allclose(one[name], other[name], atol=1e-7)


def test_the_efforts_found_drive_the_freed_mechanism():
    """Forward under a known moment, inverse along the motion recorded: the moment comes back."""
    from ffr_dyn.analyses.efforts import recorded

    free = slider_crank(0.2, 0.7)
    moment = harmonic(amplitude=2.0, frequency=1.0)
    pushed = replace(free, loads=(Load("torque", "crank.a", moment=(0, 0, moment)),))
    run = integrate(pushed, end=0.5, output_step=0.005, method=RK4(5e-4))
    scene = replace(free, drivers=(Driver("motor", "main", recorded(run.time, run["main.angle"], degree=7)),))
    back = inverse(scene, end=0.5, output_step=0.005, elastic=QuasiStatic())
    inside = slice(4, -4)
    np.testing.assert_allclose(back["motor.effort"][inside], 2 * np.sin(2 * np.pi * run.time)[inside], atol=1e-6)
    np.testing.assert_allclose(back["wrist.force"][inside], run["wrist.force"][inside], atol=1e-5)


def flexible_arm() -> Scene:
    return Scene(
        (Body("hub", bar("hub", 0.5)), Body("b", cloud(4, stiffness=40.0), position=(0.5, 0, 0), damping=0.7)),
        (
            Joint("A", "revolute", "ground.O", "hub.a"),
            Joint("B", "revolute", "hub.b", "b.a"),
        ),
        (Driver("one", "A", polynomial(0.0, 2.0)), Driver("two", "B", polynomial(0.0, -0.5))),
        ground={"O": (0, 0, 0)},
    )


def test_slow_dynamic_deformation_settles_to_the_quasi_static_one():
    """In steady rotation, no gravity: after the damped vibration has died out both agree."""
    scene = replace(
        flexible_arm(), drivers=(Driver("one", "A", polynomial(0.0, 2.0)), Driver("two", "B", polynomial(0.3)))
    )
    dynamic = inverse(scene, end=4.0, output_step=0.5, elastic=Dynamic(RK4(2e-3), FINE))
    still = inverse(scene, end=4.0, output_step=0.5, elastic=QuasiStatic())
    for name in ("b.q", "b.c.position", "one.effort", "B.moment"):
        np.testing.assert_allclose(dynamic[name][-1], still[name][-1], atol=1e-7)
    assert np.abs(still["b.q"]).max() > 1e-3


def test_dynamic_deformation_that_begins_quasi_static_does_not_ring():
    scene = replace(
        flexible_arm(), drivers=(Driver("one", "A", polynomial(0.0, 2.0)), Driver("two", "B", polynomial(0.3)))
    )
    span = {"end": 0.02, "output_step": 0.01}
    still = inverse(scene, **span, elastic=QuasiStatic())["b.q"][0]
    begun = inverse(scene, **span, elastic=Dynamic(RK4(2e-3), FINE, begin="quasi-static"))["b.q"]
    np.testing.assert_allclose(begun, np.tile(still, (3, 1)), atol=1e-3 * np.abs(still).max())
    assert np.abs(inverse(scene, **span, elastic=Dynamic(RK4(2e-3), FINE))["b.q"][0]).max() == 0


def test_work_of_the_drivers_is_the_change_of_energy():
    scene = replace(flexible_arm(), gravity=(0, -9.81, 0))
    scene = replace(scene, bodies=tuple(replace(b, damping=0.0) for b in scene.bodies))
    result = inverse(scene, end=0.5, output_step=5e-4, elastic=Dynamic(RK4(2.5e-4)))
    power = result["one.power"] + result["two.power"]
    work = np.concatenate([[0], np.cumsum(2.5e-4 * (power[1:] + power[:-1]))])
    np.testing.assert_allclose(work, result["energy.total"] - result["energy.total"][0], atol=5e-4)
    assert np.abs(work).max() > 1


@pytest.mark.parametrize("outputs", [("swing.effort",), ("*.effort",), ("swing.*",)])
@pytest.mark.parametrize("analysis", ["kinematic", "static", "dynamic", "quasi-static", "mixed"])
def test_efforts_that_every_result_has_may_be_asked_for(analysis, outputs):
    """They were none of the quantities of a scene, and refused."""
    one, span = arm("revolute"), {"end": 0.02, "output_step": 0.01}
    scene = replace(one, drivers=(Driver("swing", "joint0", MOTION),))
    force = JointEffort("torque", "joint0")
    result = {
        "kinematic": lambda: kinematic(scene, outputs=outputs, **span),
        "static": lambda: static(scene, outputs=outputs),
        "dynamic": lambda: inverse(scene, outputs=outputs, **span),
        "quasi-static": lambda: inverse(scene, elastic=QuasiStatic(), outputs=outputs, **span),
        "mixed": lambda: mixed(scene, unknown=(force,), outputs=(*outputs, "torque.effort", "torque.power"), **span),
    }[analysis]()
    assert "swing.effort" in result
    assert "joint0.force" not in result
    with pytest.raises(InputError, match=r"outputs: 'sway\.effort' is none of the scene's quantities"):
        static(scene, outputs=("sway.effort",))


def test_bad_input():
    with pytest.raises(InputError, match=r"inverse dynamics needs.*joint0\.angle"):
        inverse(replace(arm("revolute"), drivers=()), end=1.0, output_step=0.1)


def test_two_bearings_of_one_axle_are_met_by_quasi_static_deformation():
    """The body bulges as it turns, and its bearings hold it: nearly as it begins a slow run."""
    body = Body("b", cloud(9, stiffness=400.0), damping=0.7)
    points = {key: body.model.interface(key).position for key in "ab"}
    line = points["b"] - points["a"]
    hinges = [Joint(name, "revolute", f"ground.{p}", f"b.{p}", axis=line, axis_j=line) for name, p in ("Aa", "Cb")]
    scene = Scene((body,), tuple(hinges), (Driver("d", "A", polynomial(0.3, 1.0)),), ground=points, gravity=G)
    still = inverse(scene, end=0.1, output_step=0.05, elastic=QuasiStatic())
    begun = inverse(scene, end=1e-4, output_step=1e-4, elastic=Dynamic(RK4(1e-5), begin="quasi-static"))
    for name in ("b.q", "A.force", "C.force", "A.moment", "d.effort"):
        np.testing.assert_allclose(begun[name][0], still[name][0], atol=0.02 * np.abs(still[name]).max())
    assert np.abs(still["C.force"]).min() > 1


@pytest.mark.parametrize("plane", ["auto", "none"])
def test_a_propped_cantilever_that_is_turned_ever_faster(plane):
    """Load mu alpha x, clamped at x = 0: the prop carries 11/40 of mu alpha L^2 (Roark, Formulas for Stress and Strain)."""
    length, mass, alpha = 0.8, 1.5, 30.0
    beam = planar_beam("beam", length, mass, bending=400.0, modes=4)
    hub = rigid_body("hub", mass=1.0, inertia=np.full(3, 0.01), points={"root": (0, 0, 0), "tip": (length, 0, 0)})
    joints = (
        Joint("turn", "revolute", "ground.O", "hub.root"),
        Joint("clamp", "fixed", "hub.root", "beam.root", axis=(0, 0, 1), axis_j=(0, 0, 1)),
        Joint("prop", "point-on-plane", "hub.tip", "beam.tip", axis=(0, 1, 0)),
    )
    scene = Scene(
        (Body("hub", hub), Body("beam", beam)), joints, (Driver("motor", "turn", polynomial(0.0, 0.0, alpha / 2)),),
        ground={"O": (0, 0, 0)}, plane=plane,
    )  # fmt: skip
    found = inverse(scene, end=0.02, output_step=0.02, elastic=QuasiStatic())
    np.testing.assert_allclose(found["motor.effort"][0], (mass * length**2 / 3 + 0.01) * alpha, rtol=1e-5)
    np.testing.assert_allclose(found["prop.force"][0], (0, 11 / 40 * mass * alpha * length, 0), atol=4e-3)  # four modes


def test_large_quasi_static_deformation_is_found():
    """Whole steps of Newton's method run away from it: there the elastic accelerations are to vanish."""
    hub, arm = flexible_arm().bodies
    turning = (Driver("one", "A", polynomial(0.0, 5.0)), Driver("two", "B", polynomial(0.3)))
    soft = replace(arm, model=cloud(4, stiffness=1.0))
    scene = replace(flexible_arm(), bodies=(hub, soft), drivers=turning, gravity=(0, -9.81, 0))
    found = inverse(scene, end=0.02, output_step=0.02, elastic=QuasiStatic(), outputs=("*",))
    assert np.abs(found["b.q"][0]).max() > 0.5
    at = evaluator(assemble(scene).system)
    x = np.concatenate(
        [found[f"{name}.{what}"][0] for name in ("hub", "b") for what in ("R", "p", "q")[: 2 + (name == "b")]]
    )
    v = np.concatenate([found[name][0] for name in ("hub.v", "hub.omega_bar", "b.v", "b.omega_bar", "b.q_dot")])
    accelerations = evaluate(at, 0.0, x, v).acceleration
    assert np.abs(accelerations[-4:]).max() < 1e-8 * np.abs(accelerations).max()


@pytest.mark.slow
def test_a_force_that_no_deformation_balances_is_refused():
    """It pushes the first mode up below a deformation and down above it: at the deformation itself it jumps."""
    up = np.sign(flexible_arm().bodies[1].model.interface("b").phi_t[0, 0])

    def jumping(t, state):
        return up * (1e4 if state.q("b")[:1].sum() < 0.01 else -1e4), 0, 0

    scene = replace(flexible_arm(), loads=(Load("jump", "b.b", axes="body", function=jumping),))
    with pytest.raises(ComputationError, match="no quasi-static deformation was found"):
        inverse(scene, end=0.05, output_step=0.05, elastic=QuasiStatic())
