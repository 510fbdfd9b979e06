"""Laws that any right answer obeys: conservation at the method's order, limits, invariance, balance of forces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from boxes import STEEL, box_mesh
from synthetic import cloud

import ffr_prep as fp
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.equations.inertia import mass_matrix
from ffr_dyn.functions.rotation import rotation_matrix
from ffr_dyn.functions.time_functions import harmonic, polynomial
from ffr_dyn.integrators import RK4, ROS2, ROS3
from ffr_dyn.integrators.stabilisation import Baumgarte, Drifting, Projection
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.forces import Load, SpringDamper
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import rigid_body
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.reference import FixedTo, MeanAxis, SimplySupported
from ffr_prep.reduction.methods.craig_bampton import CraigBampton

GRAVITY = (0.0, -9.81, 0.0)


def spinning() -> Scene:
    return Scene((Body("b", cloud(5, stiffness=10.0), velocity=(1, 0, 0), omega_bar=(1, 2, 3)),))


def pendulum() -> Scene:
    """Two flexible links, hinge and ball joint."""
    return Scene(
        (Body("one", cloud(5, stiffness=20.0)), Body("two", cloud(4, seed=4, stiffness=25.0), position=(1, 0.5, 0))),
        (
            Joint("A", "revolute", "ground.O", "one.a", axis=(0.3, 0.1, 1.0), axis_j=(0.3, 0.1, 1.0)),
            Joint("B", "spherical", "one.b", "two.c"),
        ),
        ground={"O": (0, 0, 0)},
        gravity=GRAVITY,
    )


def momenta(scene: Scene, result) -> np.ndarray:
    """(T, 6) linear and angular momentum about the global origin of a one-body scene."""
    body, out = scene.bodies[0], []
    n = body.name
    for R, p, q, v, w, qd in zip(
        *(result[f"{n}.{k}"] for k in ("R", "p", "q", "v", "omega_bar", "q_dot")), strict=True
    ):
        A = rotation_matrix(p)
        momentum = mass_matrix(body.model, q) @ np.concatenate([A.T @ v, w, qd])
        P, L = A @ momentum[:3], A @ momentum[3:6]
        out.append(np.concatenate([P, L + np.cross(R, P)]))
    return np.array(out)


@pytest.mark.parametrize(("method", "step", "order"), [(RK4, 4e-3, 4), (ROS2, 2e-3, 2), (ROS3, 4e-3, 3)])
@pytest.mark.parametrize("scene", [spinning(), pendulum()], ids=["free", "pendulum"])
def test_energy_is_conserved_at_the_order_of_the_method(scene, method, step, order):
    def drift(h: float) -> float:
        result = integrate(scene, end=0.8, output_step=0.08, method=method(h), stabilisation=Projection(1e-10))
        return float(np.ptp(result["energy.total"]) / result["energy.kinetic"].max())

    coarse, fine = drift(step), drift(step / 2)
    assert fine < coarse / 2 ** (order - 0.3)
    assert fine < 2e-4


@pytest.mark.parametrize(("method", "step", "order"), [(RK4, 4e-3, 4), (ROS2, 2e-3, 2), (ROS3, 4e-3, 3)])
def test_linear_and_angular_momentum_of_a_free_body_are_conserved(method, step, order):
    scene = spinning()

    def drift(h: float) -> np.ndarray:
        return np.ptp(momenta(scene, integrate(scene, end=0.8, output_step=0.08, method=method(h))), axis=0)

    coarse, fine = drift(step), drift(step / 2)
    assert (fine < coarse / 2 ** (order - 0.3)).all()
    assert (fine < 1e-2).all()


@pytest.mark.parametrize("method", [RK4, ROS2, ROS3])
def test_motion_converges_at_the_order_of_the_method(method):
    scene, order = pendulum(), method.order

    def at(h: float) -> np.ndarray:
        return integrate(scene, end=0.4, output_step=0.4, method=method(h))["two.a.position"][-1]

    truth = integrate(scene, end=0.4, output_step=0.4, method=RK4(2.5e-4))["two.a.position"][-1]
    errors = [np.abs(at(h) - truth).max() for h in (4e-3, 2e-3)]
    assert errors[1] < errors[0] / 2 ** (order - 0.4)


@pytest.mark.parametrize("method", [ROS2, ROS3])
def test_no_elastic_frequency_destabilises_the_implicit_methods(method):
    """h Omega_max = 4e4; RK4 refuses such a step."""
    scene = pendulum()
    stiff = tuple(
        replace(b, model=replace(b.model, omega2=b.model.omega2 * (1e6 / np.sqrt(b.model.omega2.min())) ** 2))
        for b in scene.bodies
    )
    scene = replace(scene, bodies=stiff)
    result = integrate(scene, end=1.0, output_step=0.1, method=method(0.01))
    assert np.ptp(result["energy.total"]) < 0.05 * np.ptp(result["energy.gravity"])
    rigid = tuple(replace(b, model=as_rigid(b.model), q=None, q_dot=None, damping=0.0) for b in scene.bodies)
    other = integrate(replace(scene, bodies=rigid), end=1.0, output_step=0.1, method=method(0.01))
    np.testing.assert_allclose(result["two.a.position"], other["two.a.position"], atol=2e-4)


@pytest.mark.slow
def test_stiff_modes_that_move_a_joint_do_not_make_ros2_drift(beam_in_three_frames):
    """Four links clamped to their frames at the near end: the far joints move with stiff elastic modes.

    h Omega_max is about 30 here, so a joint whose sides followed these modes at different rates would be left at once.
    """
    link = beam_in_three_frames[0]
    length = link.interface("right").position - link.interface("left").position
    bodies = [Body(f"link{k}", link, position=k * length - link.interface("left").position) for k in range(4)]
    joints = [
        Joint(f"joint{k}", "revolute", "ground.O" if k == 0 else f"link{k - 1}.right", f"link{k}.left")
        for k in range(4)
    ]
    scene = Scene(tuple(bodies), tuple(joints), ground={"O": (0, 0, 0)}, gravity=GRAVITY)

    def run(h: float):
        return integrate(scene, end=0.1, output_step=0.1, method=ROS2(h), stabilisation=Projection(1e-7))

    coarse, truth = run(1e-3), run(6.25e-5)
    assert coarse.attributes["projections"] <= 5
    assert np.abs(coarse["link3.right.position"][-1] - truth["link3.right.position"][-1]).max() < 1e-5


def as_rigid(body):
    points = {i.name: i.position for i in body.interfaces}
    return rigid_body(
        body.name, mass=body.mass, inertia=body.central_inertia, centre_of_mass=body.centre_of_mass, points=points
    )


def test_a_very_stiff_body_moves_as_the_rigid_one():
    model = cloud(3, stiffness=3e4)
    flexible = Scene((Body("b", model, omega_bar=(1, 2, 3)),), gravity=GRAVITY)
    rigid = Scene((Body("b", as_rigid(model), omega_bar=(1, 2, 3)),), gravity=GRAVITY)
    a, b = (integrate(s, end=1.0, output_step=0.1, method=ROS2(1e-3)) for s in (flexible, rigid))
    np.testing.assert_allclose(a["b.a.position"], b["b.a.position"], atol=1e-6)


# ---- frame invariance -----------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def beam_in_three_frames():
    mesh = box_mesh("hex20", (1.0, 0.05, 0.1), (5, 1, 1))
    return [
        fp.reduce(
            fp.from_mesh(mesh, STEEL, [InterfaceRegion("left"), InterfaceRegion("right")]),
            fp.Request(name="beam", reference=reference, reduction=CraigBampton(3)),
        )
        for reference in (FixedTo("left"), SimplySupported("left", "right"), MeanAxis())
    ]


def test_reference_conditions_change_the_motion_only_to_second_order_in_the_strain(beam_in_three_frames):
    """A free beam pushed at both ends: the same total motion space, so four times the load, 16 times the difference."""

    def differences(load: float) -> tuple[np.ndarray, float]:
        ends = []
        for body in beam_in_three_frames:
            push = Load("push", "beam.right", (0, harmonic(amplitude=load, frequency=8.0), load / 2))
            pull = Load("pull", "beam.left", moment=(0, load / 4, load / 8))
            scene = Scene((Body("beam", body, stiffening=False),), loads=(push, pull))
            result = integrate(scene, end=0.02, output_step=0.002, method=RK4(2e-6))
            ends.append(np.hstack([result["beam.left.position"], result["beam.right.position"]]))
        apart = np.array([np.abs(ends[0] - other).max() for other in ends[1:]])
        return apart, float(np.abs(result["beam.right.displacement"]).max())

    (small, bend), (large, _) = differences(1e3), differences(4e3)
    assert bend > 3e-5  # metres
    assert (small < 2e-3 * bend).all()
    np.testing.assert_allclose(large / small, 16.0, rtol=0.02)


# ---- forces, joints, drivers ----------------------------------------------------------------------------------------


def link(name: str = "link", length: float = 1.0, mass: float = 2.0):
    return rigid_body(
        name,
        mass=mass,
        inertia=(1e-3, mass * length**2 / 12, mass * length**2 / 12),
        centre_of_mass=(length / 2, 0, 0),
        points={"a": np.zeros(3), "b": np.array([length, 0, 0])},
    )


def test_hanging_weight_is_carried_by_the_hinge():
    scene = Scene(
        (Body("link", link(), rotation=(0, 0, -np.pi / 2)),),
        (Joint("hinge", "revolute", "ground.O", "link.a"),),
        ground={"O": (0, 0, 0)},
        gravity=GRAVITY,
    )
    result = integrate(scene, end=0.1, output_step=0.05, method=RK4(1e-3))
    np.testing.assert_allclose(result["hinge.force"], [[0, 2.0 * 9.81, 0]] * 3, atol=1e-9)
    np.testing.assert_allclose(result["hinge.moment"], 0, atol=1e-9)


def test_driven_link_turns_as_told_and_its_motor_does_the_work():
    drive = harmonic(amplitude=0.5, frequency=1.0)
    scene = Scene(
        (Body("link", link()),),
        (Joint("hinge", "revolute", "ground.O", "link.a"),),
        (Driver("motor", "hinge", drive),),
        ground={"O": (0, 0, 0)},
        gravity=GRAVITY,
    )
    result = integrate(scene, end=1.0, output_step=0.01, method=RK4(1e-3))
    t = result.time
    angle = 0.5 * np.sin(2 * np.pi * t)
    second = -((2 * np.pi) ** 2) * angle
    torque = 2.0 / 3 * second + 2.0 * 9.81 * 0.5 * np.cos(angle)  # J = m l^2 / 3
    np.testing.assert_allclose(result["hinge.angle"], angle, atol=1e-8)
    np.testing.assert_allclose(result["motor.moment.z"], torque, atol=1e-6)


def test_crank_angle_is_unwound_over_many_turns():
    scene = Scene(
        (Body("link", link()),),
        (Joint("hinge", "revolute", "ground.O", "link.a"),),
        (Driver("motor", "hinge", polynomial(0.3, 40.0)),),
        ground={"O": (0, 0, 0)},
    )
    result = integrate(scene, end=2.0, output_step=0.1, method=RK4(1e-3))  # four radians a row
    np.testing.assert_allclose(result["hinge.angle"], 0.3 + 40.0 * result.time, atol=1e-6)


def test_driven_stroke_of_a_slider():
    block = rigid_body("block", mass=3.0, inertia=(1, 1, 1), points={"c": np.zeros(3)})
    scene = Scene(
        (Body("block", block),),
        (Joint("guide", "translational", "ground.O", "block.c", axis=(1, 0, 0)),),
        (Driver("push", "guide", polynomial(0, 1, 2), coordinate="stroke"),),
        ground={"O": (0, 0, 0)},
    )
    result = integrate(scene, end=0.5, output_step=0.1, method=RK4(1e-2))
    t = result.time
    np.testing.assert_allclose(result["guide.stroke"], t + 2 * t**2, atol=1e-9)
    np.testing.assert_allclose(result["push.force.x"], 12.0, atol=1e-9)


def test_spring_damper_decays_as_the_closed_form():
    ball = rigid_body("ball", mass=2.0, inertia=(1, 1, 1), points={"c": np.zeros(3)})
    k, c = 200.0, 4.0
    scene = Scene(
        (Body("ball", ball, position=(1.3, 0, 0)),),
        springs=(SpringDamper("spring", "ground.O", "ball.c", k, c, free_length=1.0, preload=10.0),),
        ground={"O": (0, 0, 0)},
    )
    result = integrate(scene, end=1.0, output_step=0.05, method=RK4(1e-3))
    t, rest = result.time, 1.0 - 10.0 / k
    delta, omega = c / 4.0, np.sqrt(k / 2.0 - (c / 4.0) ** 2)
    x = rest + (1.3 - rest) * np.exp(-delta * t) * (np.cos(omega * t) + delta / omega * np.sin(omega * t))
    np.testing.assert_allclose(result["ball.c.position.x"], x, atol=1e-8)
    np.testing.assert_allclose(result["spring.tension"][0], k * 0.3 + 10.0, atol=1e-12)


def test_forces_in_body_axes_follow_and_python_forces_equal_tables():
    ball = rigid_body("ball", mass=2.0, inertia=(1, 1, 1), points={"c": np.zeros(3)})
    spin = Body("ball", ball, omega_bar=(0, 0, 2.0))

    def run(load: Load):
        return integrate(Scene((spin,), loads=(load,)), end=1.0, output_step=0.1, method=RK4(5e-3))

    follower = run(Load("f", "ball.c", (3.0, 0, 0), axes="body"))
    angle = 2.0 * follower.time
    np.testing.assert_allclose(follower["ball.v"][:, 0], 1.5 / 2.0 * np.sin(angle), atol=1e-8)
    wave = run(Load("f", "ball.c", (harmonic(amplitude=3.0, frequency=1.0), 0, 0), moment=(0, 0, 1.0)))
    called = run(Load("f", "ball.c", function=lambda t, state: (3.0 * np.sin(2 * np.pi * t), 0, 0, 0, 0, 1.0)))
    np.testing.assert_allclose(wave["ball.R"], called["ball.R"], atol=1e-13)
    np.testing.assert_allclose(wave["ball.omega_bar"], called["ball.omega_bar"], atol=1e-13)


def test_python_force_sees_the_state():
    """A spring written in Python equals the built-in one."""
    body = cloud(3, stiffness=30.0)
    ground = {"O": (0.0, 1.0, 0.0)}

    def pull(t, state):
        d = state.position("b.a") - np.array(ground["O"])
        rate = state.velocity("b.a")
        length = np.linalg.norm(d)
        return -(50.0 * (length - 0.5) + 2.0 * rate @ d / length) * d / length

    own = Scene((Body("b", body),), loads=(Load("pull", "b.a", function=pull),), gravity=GRAVITY)
    built_in = Scene(
        (Body("b", body),),
        springs=(SpringDamper("s", "ground.O", "b.a", 50.0, 2.0, 0.5),),
        ground=ground,
        gravity=GRAVITY,
    )
    a, b = (integrate(s, end=0.3, output_step=0.1, method=RK4(2e-3)) for s in (own, built_in))
    np.testing.assert_allclose(a["b.a.position"], b["b.a.position"], atol=1e-12)


# ---- drift ----------------------------------------------------------------------------------------------------------


def test_drift_is_held_by_projection_and_by_baumgarte_and_reported_without():
    scene = pendulum()

    def worst(stabilisation) -> float:
        result = integrate(scene, end=2.0, output_step=0.5, method=RK4(4e-3), stabilisation=stabilisation)
        assert result.attributes["largest_drift"][0] > 0
        return float(result["constraint.position"][-1])

    free = worst(Drifting())
    assert worst(Projection(1e-10)) < 0.1 * free
    assert worst(Baumgarte(20.0, 20.0)) < 0.2 * free


def test_the_same_input_gives_the_same_bits():
    a, b = (integrate(pendulum(), end=0.2, output_step=0.02, method=ROS2(1e-3)) for _ in range(2))
    assert all((a[name] == b[name]).all() for name in a.quantities)
