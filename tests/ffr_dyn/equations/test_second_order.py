"""Second-order bodies on paper: the equations are those of one kinetic energy and one potential."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from differences import difference
from scipy.integrate import simpson, solve_ivp
from second_order_bodies import bending_cloud, without_rounding
from test_beam_stiffening import STEEL, rod, thin
from test_dyn_forces import PAIRS, alone
from test_dyn_kernels import DRIVE, SPECIAL, constraint_cases, moved, random_state
from test_motion import LOADS

import ffr_prep as fp
from ffr_dyn.equations.constraint_rows import blocks_of, rows_at
from ffr_dyn.equations.forces import At, applied, gravity_at
from ffr_dyn.equations.inertia import (
    elastic_force,
    energies,
    gravity_force,
    kept_integrals,
    mass_matrix,
    quadratic_velocity,
)
from ffr_dyn.equations.kinematics import marker_axis, marker_point
from ffr_dyn.equations.layout import layout
from ffr_dyn.equations.motion import equations_of_motion, position_rates
from ffr_dyn.equations.second_order import marker_matrices, second_moments
from ffr_dyn.functions.rotation import rotation_matrix
from ffr_dyn.scene.couplings import Coupling
from ffr_dyn.scene.drivers import Driver, PointDriver
from ffr_dyn.scene.forces import Bushing, JointSpring, Load, SpringDamper
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import INERTIA_TERMS, Body, Scene, marker_number
from ffr_prep.body import FlexibleBody
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.reference import FixedTo
from ffr_prep.reduction.methods.eigenmodes import Eigenmodes
from ffr_prep.structures.frame import Member, named, polyline
from ffr_prep.structures.sections import rectangle

RNG = np.random.default_rng(23)
T = 0.37
GRAVITY = np.array([0.3, -9.81, 1.0])

# ---- one body: inertia and forces ---------------------------------------------------------------------------------------


def kinetic_energy(body: FlexibleBody, N: np.ndarray, q: np.ndarray, y: np.ndarray) -> complex:
    """Sum over the mass points of what has up to two of u = Phi q, u_dot and u_2 (which counts twice), but u_dot . u_2_dot;
    y = [A^T R_dot, omega, q_dot]."""
    mass, V, omega, q_dot = np.array(body.provenance["masses"]), y[:3], y[3:6], y[6:]
    x, Phi = body.surface.points, body.surface.Phi
    first = V + np.cross(omega, x + Phi @ q) + Phi @ q_dot
    second = np.cross(omega, 0.5 * N @ q @ q) + N @ q @ q_dot
    return mass @ (0.5 * first**2 + (V + np.cross(omega, x)) * second).sum(1)


def momentum(kinetic, q: np.ndarray, y: np.ndarray) -> np.ndarray:
    """dT/dy of a T quadratic in y."""
    return np.array([0.5 * (kinetic(q, y + e) - kinetic(q, y - e)) for e in np.eye(y.size)])


def inertia_force(kinetic, q: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Minus the left sides of the equations of Boltzmann and Hamel where a = A^T R_ddot, omega_dot and q_ddot vanish.

    For quasi-velocities y = [V, omega, q_dot]: d/dt T_V + omega x T_V, d/dt T_omega + omega x T_omega + V x T_V,
    d/dt T_q_dot - T_q, with V_dot = a - omega x V. Derivatives by steps along the imaginary axis, exact to rounding.
    """
    h, V, omega = 1e-30, y[:3], y[3:6]
    rate = np.concatenate([-np.cross(omega, V), np.zeros(y.size - 3)])
    P, P_dot = momentum(kinetic, q, y), momentum(kinetic, q + 1j * h * y[6:], y + 1j * h * rate).imag / h
    T_q = np.array([kinetic(q + 1j * h * e, y).imag / h for e in np.eye(q.size)])
    turned = [np.cross(omega, P[:3]), np.cross(omega, P[3:6]) + np.cross(V, P[:3]), -T_q]
    return -P_dot - np.concatenate(turned)


def deformed(n: int, size: float = 0.1) -> tuple[np.ndarray, np.ndarray]:
    """q and y = [V, omega, q_dot] at random."""
    return size * RNG.normal(size=n), RNG.normal(size=6 + n)


def test_the_inertia_is_that_of_the_kinetic_energy_of_all_points():
    body, N = bending_cloud(5, stiffness=3.0)
    integrals, (q, y) = kept_integrals(Body("b", body)), deformed(5)

    def kinetic(q, y):
        return kinetic_energy(body, N, q, y)

    M = np.array([momentum(kinetic, q, e) for e in np.eye(11)])
    np.testing.assert_allclose(mass_matrix(integrals, q), M, rtol=0, atol=1e-13)
    assert np.abs(M - mass_matrix(body, q)).max() > 0.03
    force = inertia_force(kinetic, q, y)
    found = quadratic_velocity(integrals, q, y[3:6], y[6:])
    np.testing.assert_allclose(found, force, rtol=0, atol=1e-12 * np.abs(force).max())


def test_moments_of_a_beam_are_those_of_the_second_order_displacements_of_its_points():
    """int u_0k u_2l dm by Simpson's rule over interfaces along the beam; its thickness adds about (thickness / length)^2."""
    n, count = 3, 41
    x = np.linspace(0, LENGTH, count)
    frame = polyline([(0, 0, 0), (LENGTH, 0, 0)], Member(SECTION, STEEL, (0, 1, 0)), elements=count - 1)
    points = {f"p{k}": (at, 0.0, 0.0) for k, at in enumerate(x)}
    model = fp.from_frame(named(frame, **points), [InterfaceRegion(name) for name in points])
    request = fp.Request(name="beam", reference=fp.MeanAxis(), reduction=Eigenmodes(n))
    beam = Body("beam", without_rounding(fp.reduce(model, request)))
    K, q = np.array([marker_matrices(beam, name) for name in points]), RNG.normal(size=n)
    u_2 = -0.5 * np.einsum("pkij,i,j->pk", K[:, :3], q, q)
    x = np.array([interface.position for interface in beam.model.interfaces])
    found = 0.5 * np.einsum("klij,i,j->kl", second_moments(beam), q, q)
    mass = beam.model.mass / LENGTH
    expected = mass * simpson(x[:, :, None] * u_2[:, None], x=x[:, 0], axis=0)
    size = np.abs(expected).max()
    np.testing.assert_allclose(found, expected, rtol=0, atol=2e-4 * size)
    np.testing.assert_allclose(mass * simpson(u_2, x=x[:, 0], axis=0), 0.0, atol=1e-6 * size / LENGTH)


@pytest.mark.parametrize("dropped", [(), *((term,) for term in INERTIA_TERMS), ("I5", "I9")])
def test_whatever_is_left_out_the_forces_belong_to_the_mass_matrix(dropped):
    body = Body("b", bending_cloud(4)[0], dropped=dropped)
    integrals, (q, y) = kept_integrals(body), deformed(4)

    def kinetic(q, y):
        return 0.5 * y @ mass_matrix(integrals, q) @ y

    force = inertia_force(kinetic, q, y)
    found = quadratic_velocity(integrals, q, y[3:6], y[6:])
    np.testing.assert_allclose(found, force, rtol=0, atol=1e-12 * np.abs(force).max())


def test_elastic_forces_and_gravity_are_the_gradients_of_their_energies():
    body = Body("b", bending_cloud(5)[0])
    scene = Scene((body,), gravity=GRAVITY)
    integrals, place, (x, v) = kept_integrals(body), layout(scene), random_state(scene)
    A, q = rotation_matrix(x[place.p(0)]), x[place.q(0)]
    found = elastic_force(integrals, body.damping, q, 0 * q) + gravity_force(integrals, q, A, GRAVITY)

    def potential(s: float) -> float:
        at = moved(scene, x, v, s)
        p = rotation_matrix(at[place.p(0)])
        return sum(energies(integrals, at[place.R(0)], p, at[place.q(0)], np.zeros(11), GRAVITY)[1:])

    y = np.concatenate([A.T @ v[:3], v[3:]])
    assert found @ y == pytest.approx(-difference(potential), rel=1e-10)


def test_a_scene_without_stiffening_has_linear_bodies():
    body, _ = bending_cloud(3)
    assert second_moments(Body("b", body)).any()
    assert not second_moments(Body("b", body, stiffening=False)).any()
    assert not second_moments(Body("b", replace(body, stiffening=None))).any()


# ---- markers, constraint rows, forces -----------------------------------------------------------------------------------


def bent_chain(kind: str = "revolute", **more) -> Scene:
    """Two second-order bodies, ball joint and joint "tie"."""
    first, second = bending_cloud(4, seed=1)[0], bending_cloud(3, seed=2)[0]
    frames = {"axis": (0.2, 1.0, 0.3), "axis_j": (1.0, -0.5, 0.4)} | SPECIAL.get(kind, {})
    joints = Joint("root", "spherical", "ground.O", "one.a"), Joint("tie", kind, "one.b", "two.c", **frames)
    bodies = Body("one", first), Body("two", second)
    return Scene(bodies, joints, ground={"O": (0.1, 0.2, 0.3)}, **more)


def bent_state(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """At random, deformed until markers turn by half a radian and more."""
    x, v = random_state(scene)
    place = layout(scene)
    for b, body in enumerate(scene.bodies):
        turn = max(np.linalg.norm(i.phi_r @ x[place.q(b)]) for i in body.model.interfaces)
        x[place.q(b)] *= 0.6 / turn
    return x, v


ROWS = [(kind, coordinate) for kind, sizes, coordinate in constraint_cases() if sizes != (0, 0)]


@pytest.mark.parametrize(("kind", "driven"), [*ROWS, ("cylindrical", "coupled"), ("cylindrical", "rack")])
def test_rows_their_jacobians_and_right_hand_sides_are_derivatives(kind, driven):
    scene = bent_chain(kind)
    if driven == "path":
        scene = replace(scene, drivers=(PointDriver("drive", "one.a", "two.a", x=DRIVE, y=None, z=0.3),))
    elif driven in ("coupled", "rack"):
        joints = tuple(replace(joint, kind="cylindrical") for joint in scene.joints)
        first = "root.angle" if driven == "coupled" else "root.stroke"
        scene = replace(scene, joints=joints, couplings=(Coupling("gear", first, "tie.angle", -1.5, offset=0.2),))
    elif driven:
        scene = replace(scene, drivers=(Driver("drive", "tie", DRIVE, coordinate=driven),))
    place, blocks, (x, v) = layout(scene), blocks_of(scene), bent_state(scene)

    def rows(s: float, velocity: np.ndarray, name: str, time: float = 1.0) -> np.ndarray:
        at = moved(scene, x, velocity, s)
        return np.array([getattr(row, name) for row in rows_at(scene, place, blocks, at, velocity, T + time * s)])

    def global_velocity(k: int) -> np.ndarray:
        unit = np.eye(place.v_size)[k]
        for b in range(len(scene.bodies)):
            unit[place.R_dot(b)] = rotation_matrix(x[place.p(b)]) @ unit[place.R_dot(b)]
        return unit

    np.testing.assert_allclose(rows(0, v, "nu"), difference(lambda s: rows(s, v, "Phi")), rtol=0, atol=1e-9)
    np.testing.assert_allclose(rows(0, v, "gamma"), -difference(lambda s: rows(s, v, "nu")), rtol=0, atol=2e-8)
    slopes = [difference(lambda s, k=k: rows(s, global_velocity(k), "Phi", 0.0)) for k in range(place.v_size)]
    np.testing.assert_allclose(rows(0, v, "jacobian"), np.transpose(slopes), rtol=0, atol=1e-10)


def test_axes_of_markers_stay_orthonormal_at_any_rotation():
    scene = bent_chain()
    x, v = bent_state(scene)
    for number in range(6):
        B = np.array([marker_axis(scene, layout(scene), x, v, number, a).r for a in np.eye(3)])
        np.testing.assert_allclose(B @ B.T, np.eye(3), rtol=0, atol=5e-15)


def with_force(force) -> Scene:
    scene = bent_chain("cylindrical")
    return replace(scene, **{"springs" if isinstance(force, SpringDamper) else "forces": (force,)})


STORING = {
    "spring": SpringDamper("s", "one.c", "two.a", 30.0, 0.0, 0.3, 1.5),
    "curved spring": replace(PAIRS["curved spring"], damping=0.0),
    "bushing": replace(PAIRS["bushing"], damping=np.zeros((6, 6))),
    "curved bushing": replace(PAIRS["curved bushing"], damping=(0.0,) * 6),
    "torsion spring": replace(PAIRS["torsion spring"], damping=0.0),
}


@pytest.mark.parametrize("force", STORING.values(), ids=STORING)
def test_springs_and_bushings_act_by_their_potential(force: SpringDamper | Bushing | JointSpring):
    scene = with_force(force)
    x, v = bent_state(scene)

    def stored(s: float) -> float:
        found = np.atleast_1d(alone(scene, moved(scene, x, v, s), v).coordinate)
        return float(force.energy(found[None] if isinstance(force, Bushing) else found)[0])

    assert alone(scene, x, v).power == pytest.approx(-difference(stored, 1e-3), rel=1e-8)


@pytest.mark.parametrize("load", LOADS, ids=["global", "body"])
def test_a_wrench_at_a_marker_works_on_its_point_and_its_rotation(load):
    scene = replace(bent_chain(), loads=(load,))
    place, number, (x, v) = layout(scene), marker_number(scene, load.marker), bent_state(scene)
    B = np.array([marker_axis(scene, place, x, v, number, a).r for a in np.eye(3)]).T

    def pose(s: float) -> np.ndarray:
        at = moved(scene, x, v, s)
        axes = [marker_axis(scene, place, at, v, number, a).r for a in np.eye(3)]
        return np.column_stack([marker_point(scene, place, at, v, number).r, *axes])

    rate = difference(pose)
    spin = rate[:, 1:] @ B.T
    wrench = load.law(At(scene, place, T, x, v), None, None).reshape(2, 3)
    if load.axes == "body":
        b = 0 if load.marker.startswith("one") else 1
        wrench = wrench @ rotation_matrix(x[place.p(b)]).T
    power = wrench[0] @ rate[:, 0] + wrench[1] @ [spin[2, 1], spin[0, 2], spin[1, 0]]
    assert applied(scene, place, T, x, v)[0].power == pytest.approx(power, rel=1e-9)


# ---- motions and statics ------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_bent_spinning_body_keeps_its_energy_and_momenta():
    model, _ = bending_cloud(4, size=0.3, stiffness=10.0)
    start = np.array([0.08, -0.06, 0.05, 0.02])
    scene = Scene((Body("b", model, velocity=(1, 0.5, 0), omega_bar=(1, 2, 3), q=start),), gravity=np.zeros(3))
    place, integrals = layout(scene), kept_integrals(scene.bodies[0])
    size = place.x_size

    def rate(t: float, z: np.ndarray) -> np.ndarray:
        x, v = z[:size], z[size:]
        v_dot = equations_of_motion(scene, t, x, v).acceleration
        v_dot[:3] = rotation_matrix(x[place.p(0)]) @ v_dot[:3]
        return np.concatenate([position_rates(place, x, v), v_dot])

    def kept(z: np.ndarray) -> np.ndarray:
        """Energy, momentum, and angular momentum about the global origin."""
        x, v = z[:size], z[size:]
        A, q = rotation_matrix(x[place.p(0)]), x[place.q(0)]
        y = np.concatenate([A.T @ v[:3], v[3:]])
        P, L = (mass_matrix(integrals, q) @ y)[:6].reshape(2, 3) @ A.T
        energy = sum(energies(integrals, x[:3], A, q, y, gravity_at(scene, 0.0)))
        return np.array([energy, *P, *(L + np.cross(x[:3], P))])

    x, v = np.zeros(size), np.zeros(place.v_size)
    body = scene.bodies[0]
    x[place.p(0)], x[place.q(0)], v[:3], v[3:6] = body.rotation, body.q, body.velocity, body.omega_bar
    run = solve_ivp(rate, (0, 1), np.concatenate([x, v]), method="DOP853", rtol=1e-12, atol=1e-13)
    first, last = kept(run.y[:, 0]), kept(run.y[:, -1])
    np.testing.assert_allclose(last, first, rtol=0, atol=1e-10 * np.abs(first).max())


LENGTH, SECTION = 1.2, thin(rectangle(1e-2, 2e-2))


def equilibrium(scene: Scene) -> np.ndarray:
    """x at rest of a scene of one body, by Newton's method with differences."""
    (body,), place, blocks = scene.bodies, layout(scene), blocks_of(scene)
    still = np.zeros(place.v_size)

    def residual(x: np.ndarray, lam: np.ndarray, z: np.ndarray) -> np.ndarray:
        """What forces and rows come to a step z = [along the velocities, of lam] away."""
        x, lam = moved(scene, x, z[: still.size], 1.0), lam + z[still.size :]
        rows = rows_at(scene, place, blocks, x, still, 0.0)
        Q = sum(load.generalised for load in applied(scene, place, 0.0, x, still))
        Q = Q + elastic_force(body.model, body.damping, x[place.q(0)], still[place.q_dot(0)])
        return np.concatenate([Q - lam @ np.array([row.jacobian for row in rows]), [row.Phi for row in rows]])

    x, lam = np.concatenate([body.position, body.rotation, body.q]), np.zeros(sum(len(b.words) for b in blocks))
    for _ in range(12):
        units = np.eye(still.size + lam.size)
        tangent = np.transpose([difference(lambda s, e=e, at=(x, lam): residual(*at, s * e)) for e in units])
        z = np.linalg.solve(tangent, -residual(x, lam, 0 * units[0]))
        x, lam = moved(scene, x, z[: still.size], 1.0), lam + z[still.size :]
        if np.abs(z[: still.size]).max() < 1e-12:
            return x
    raise AssertionError("no equilibrium")


@pytest.mark.parametrize("angle", [0.25, 0.5, 1.0])
def test_a_cantilever_under_an_end_moment_is_an_arc(angle):
    """Its tip turns by M L / (E I), exactly; the chord is that of the arc to second order."""
    beam = rod(SECTION, LENGTH, 12, 2, FixedTo("root"))
    model = without_rounding(fp.with_reference(beam, fp.MeanAxis()))
    scene = Scene(
        (Body("b", model),),
        (Joint("clamp", "fixed", "ground.O", "b.root"),),
        loads=(Load("bend", "b.tip", moment=(0, 0, angle * STEEL.E * SECTION.Iz / LENGTH)),),
        ground={"O": (0, 0, 0)},
    )
    x, place = equilibrium(scene), layout(scene)
    still, tip = np.zeros(place.v_size), marker_number(scene, "b.tip")
    along = marker_axis(scene, place, x, still, tip, np.array([1.0, 0, 0])).r
    assert np.arctan2(along[1], along[0]) == pytest.approx(angle, rel=3e-12)
    arc = np.array([np.sin(angle), 1 - np.cos(angle), 0.0]) * LENGTH / angle
    at = marker_point(scene, place, x, still, tip).r
    assert np.linalg.norm(at - arc) < LENGTH * angle**4 / 1900
