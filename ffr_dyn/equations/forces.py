"""Applied loads in readable form: what each contributes to the generalised forces, and its power.

A force on a coordinate c acts with F dc/dv, the row of c's rate; dc/dv comes from the words of the constraints
(`ffr_dyn.equations.constraints`). Generalised forces are [A^T F, M, Q] of all bodies, in body axes. The compiled form,
which the tests hold equal to this one, is `ffr_dyn.kernels.forces.loads`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ffr_dyn.equations.constraints import Parts, Row, add_part, evaluate_word, summed_parts
from ffr_dyn.equations.inertia import gravity_force
from ffr_dyn.equations.kinematics import marker_point
from ffr_dyn.equations.layout import Layout
from ffr_dyn.equations.state_view import StateView
from ffr_dyn.functions.curves import Curve, curve_value
from ffr_dyn.functions.rotation import rotation_matrix
from ffr_dyn.functions.time_functions import as_time_function, evaluate
from ffr_dyn.scene.applied_loads import Action, actions_of, coordinate_axes, coordinate_ends
from ffr_dyn.scene.forces import (
    Bushing,
    Load,
    SpringDamper,
    bushing_curves,
    bushing_frames,
    damping_matrix,
    stiffness_matrix,
)
from ffr_dyn.scene.joint_forces import Actuator, JointForce, JointFriction, JointSpring, JointStop, Servo, turns_of
from ffr_dyn.scene.joints import DOT_1, DOT_2, word
from ffr_dyn.scene.scene import Scene, body_number, marker_number, markers
from ffr_dyn.scene.surface_loads import Affine, SurfaceLoad, distributed
from ffr_prep.body import axial

Array = np.ndarray

NO_DRIVE = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Moment:
    """Scene, layout, time [s] and state at which forces are wanted."""

    scene: Scene
    place: Layout
    t: float
    x: Array
    v: Array

    @property
    def velocities(self) -> Array:
        """(V,) velocities with R_dot in body axes, which the generalised forces multiply to power."""
        y = self.v.copy()
        for b in range(len(self.place.n)):
            y[self.place.R_dot(b)] = rotation_matrix(self.x[self.place.p(b)]).T @ self.v[self.place.R_dot(b)]
        return y


@dataclass(frozen=True)
class Applied:
    """One load: its generalised forces (V,), its power [W], and for a force on a coordinate that coordinate and force."""

    name: str
    generalised: Array
    power: float
    coordinate: Any = None
    force: Any = None


def applied(scene: Scene, place: Layout, t: float, x: Array, v: Array) -> list[Applied]:
    """Every applied load of the scene but gravity; angles counted from the turns at the start.

    Equation (23) of docs/notation.md.
    """
    now = Moment(scene, place, t, x, v)
    return [*(_load(now, load) for load in scene.loads), *_on_coordinates(now), *_others(now)]


def gravity_at(scene: Scene, t: float) -> Array:
    """(3,) [m/s^2] gravity as the accelerated base feels it."""
    return scene.gravity - np.array([evaluate(f, t)[0] for f in scene.base_acceleration])


def gravity_forces(scene: Scene, place: Layout, t: float, x: Array) -> Array:
    """(V,) generalised forces of gravity on all bodies."""
    field = gravity_at(scene, t)
    parts = [
        gravity_force(body.model, x[place.q(b)], rotation_matrix(x[place.p(b)]), field)
        for b, body in enumerate(scene.bodies)
    ]
    return np.concatenate(parts)


def _made(now: Moment, name: str, generalised: Array, coordinate: Any = None, force: Any = None) -> Applied:
    return Applied(name, generalised, float(generalised @ now.velocities), coordinate, force)


# ---- wrenches -----------------------------------------------------------------------------------------------------


def _load(now: Moment, load: Load) -> Applied:
    number = marker_number(now.scene, load.marker)
    values = np.array([_value(component, now.t) for component in (*load.force, *load.moment)])
    if load.function is not None:
        given = np.ravel(load.function(now.t, StateView(now.scene, now.place, now.x, now.v)))
        values[: given.size] += given
    b, _, point = markers(now.scene)[number]
    Q = np.zeros(now.place.v_size)
    if b == len(now.scene.bodies):
        return _made(now, load.name, Q)
    A, interface = rotation_matrix(now.x[now.place.p(b)]), now.scene.bodies[b].model.interface(point)
    force, moment = values.reshape(2, 3) if load.axes == "body" else values.reshape(2, 3) @ A
    u = interface.position + interface.phi_t @ now.x[now.place.q(b)]
    Q[now.place.rigid(b)] = np.concatenate([force, np.cross(u, force) + moment])
    Q[now.place.q_dot(b)] = interface.phi_t.T @ force + interface.phi_r.T @ moment
    return _made(now, load.name, Q)


def _value(component: Any, t: float) -> float:
    return evaluate(as_time_function(component, "load"), t)[0]


# ---- forces on coordinates ----------------------------------------------------------------------------------------


def _on_coordinates(now: Moment) -> Iterator[Applied]:
    for action in actions_of(now.scene):
        c = _coordinate(now, action)
        force = _law(now, action, c.Phi, c.nu)
        yield _made(now, action.name, force * c.jacobian, c.Phi, force)


def _coordinate(now: Moment, action: Action) -> Row:
    """Value, rate and gradient of the coordinate."""
    (i, j), axes = coordinate_ends(now.scene, action), coordinate_axes(now.scene, action)
    if isinstance(action, SpringDamper):
        return _length(now, i, j)
    if action.coordinate == "stroke":
        return _product(now, DOT_2, axes[0], np.zeros(3), i, j)
    c, s = (_product(now, DOT_1, axis, axes[2], i, j) for axis in axes[:2])
    square = c.Phi**2 + s.Phi**2
    angle = np.arctan2(s.Phi, c.Phi) + 2 * np.pi * turns_of(action)
    rate = (c.Phi * s.nu - s.Phi * c.nu) / square
    parts = summed_parts([(c.Phi / square, s), (-s.Phi / square, c)])
    return Row(float(angle), float(rate), 0.0, parts, now.place.v_size)


def _product(now: Moment, kind: int, a: Array, b: Array, i: int, j: int) -> Row:
    return evaluate_word(now.scene, now.place, now.x, now.v, word(kind, "", a, b), (i, j), NO_DRIVE)


def _length(now: Moment, i: int, j: int) -> Row:
    at_i, at_j = (marker_point(now.scene, now.place, now.x, now.v, k) for k in (i, j))
    d, parts = at_j.r - at_i.r, Parts()
    size = float(np.linalg.norm(d))
    if size == 0:
        return Row(0.0, 0.0, 0.0, parts, now.place.v_size)
    for at, sign in ((at_i, -1), (at_j, 1)):
        add_part(now.place, parts, at, sign * d / size @ at.jacobian)
    return Row(size, float(d / size @ (at_j.r_dot - at_i.r_dot)), 0.0, parts, now.place.v_size)


def _law(now: Moment, action: Action, c: float, rate: float) -> float:
    """The force of the law, positive where it increases the coordinate."""
    match action:
        case SpringDamper():
            stretch = c - action.free_length
            return -_of(action.stiffness, stretch) - _of(action.damping, rate) - action.preload
        case JointSpring():
            return -_of(action.stiffness, c - action.free) - _of(action.damping, rate) - action.preload
        case JointFriction():
            return _friction(action, _value(action.normal, now.t), rate)
        case JointStop():
            below = 0.0 if action.lower is None else _push(action, action.lower - c, -rate)
            return below if action.upper is None else below - _push(action, c - action.upper, rate)
        case Servo():
            target, speed, _ = evaluate(as_time_function(action.target, "target"), now.t)
            force = action.kp * (target - c) + action.kd * (speed - rate)
            return float(np.clip(force, -action.limit, action.limit))
        case Actuator():
            state = StateView(now.scene, now.place, now.x, now.v)
            added = 0.0 if action.function is None else float(action.function(now.t, state))
            return _value(action.force, now.t) + added


def _of(factor: float | Curve, x: float) -> float:
    return curve_value(factor, x) if isinstance(factor, Curve) else factor * x


def _friction(law: JointFriction, normal: float, rate: float) -> float:
    if normal < 0:  # lifted off
        return -law.viscous * rate
    size = law.coulomb
    if law.static is not None and law.stribeck is not None:
        size += (law.static - law.coulomb) * np.exp(-((rate / law.stribeck) ** 2))
    return -normal * size * np.tanh(rate / law.creep) - law.viscous * rate


def _push(law: JointStop, depth: float, speed: float) -> float:
    if depth <= 0:
        return 0.0
    elastic = depth**2 / (2 * law.entry) if depth < law.entry else depth - law.entry / 2
    share = min(depth / law.entry, 1.0)
    return max(law.stiffness * elastic + law.damping * speed * share**2 * (3 - 2 * share), 0.0)


# ---- bushings -----------------------------------------------------------------------------------------------------


def _others(now: Moment) -> Iterator[Applied]:
    """Bushings, then surface loads."""
    for force in now.scene.forces:
        if isinstance(force, Bushing):
            yield _bushing(now, force)
    for force in now.scene.forces:
        if not isinstance(force, (Bushing, JointForce)):
            yield _surface_load(now, force)


def _bushing(now: Moment, bushing: Bushing) -> Applied:
    rows = [*_displacements(now, bushing), *_rotations(now, bushing)]
    x, rate = np.array([row.Phi for row in rows]), np.array([row.nu for row in rows])
    curves = [
        0.0 if curve is None else curve_value(curve, c) for curve, c in zip(bushing_curves(bushing), x, strict=True)
    ]
    force = np.array(bushing.preload) - stiffness_matrix(bushing) @ x - damping_matrix(bushing) @ rate - curves
    return _made(now, bushing.name, force @ np.array([row.jacobian for row in rows]), x, force)


def _displacements(now: Moment, bushing: Bushing) -> list[Row]:
    i, j = marker_number(now.scene, bushing.i), marker_number(now.scene, bushing.j)
    return [_product(now, DOT_2, a, np.zeros(3), i, j) for a in bushing_frames(bushing)[0].T]


def _rotations(now: Moment, bushing: Bushing) -> list[Row]:
    """psi = z phi / sin(phi), z the axial vector of the relative rotation B, by the chain rule."""
    i, j = marker_number(now.scene, bushing.i), marker_number(now.scene, bushing.j)
    on_i, on_j = bushing_frames(bushing)
    B = [[_product(now, DOT_1, a, b, i, j) for b in on_j.T] for a in on_i.T]
    z = [_mixed([(0.5, B[(c + 2) % 3][(c + 1) % 3]), (-0.5, B[(c + 1) % 3][(c + 2) % 3])]) for c in range(3)]
    trace = _mixed([(1.0, B[c][c]) for c in range(3)])
    s, cosine = float(np.linalg.norm([row.Phi for row in z])), (trace.Phi - 1) / 2
    g, g_s, g_c = stretch(s, cosine)
    growth = _mixed([*((g_s * row.Phi, row) for row in z), (g_c / 2, trace)])  # its rate and gradient are those of g
    return [_scaled(row, g, growth) for row in z]


def _scaled(row: Row, g: float, growth: Row) -> Row:
    """g times a row, where g itself has the rate and gradient of `growth`."""
    return Row(
        g * row.Phi,
        g * row.nu + row.Phi * growth.nu,
        0.0,
        summed_parts([(g, row), (row.Phi, growth)]),
        row.size,
    )


def _mixed(terms: list[tuple[float, Row]]) -> Row:
    Phi, nu = (float(sum(part)) for part in zip(*((f * row.Phi, f * row.nu) for f, row in terms), strict=True))
    return Row(Phi, nu, 0.0, summed_parts(terms), terms[0][1].size)


def stretch(s: float, c: float) -> tuple[float, float, float]:
    """g = phi / s with phi = atan2(s, c), (dg/ds) / s, dg/dc; by series where s is small."""
    square, y = s**2 + c**2, s / c
    if c > 0 and y < 0.02:
        series = (1 - y**2 / 3 + y**4 / 5 - y**6 / 7) / c
        return series, (-2 / 3 + 4 * y**2 / 5 - 6 * y**4 / 7) / c**3, -1 / square
    phi = float(np.arctan2(s, c))
    return phi / s, (s * c / square - phi) / s**3, -1 / square


# ---- surface loads ------------------------------------------------------------------------------------------------


def _surface_load(now: Moment, load: SurfaceLoad) -> Applied:
    b = body_number(now.scene, load)
    made, q, A = (
        distributed(load, now.scene.bodies[b].model),
        now.x[now.place.q(b)],
        rotation_matrix(now.x[now.place.p(b)]),
    )
    Q, first = np.zeros(now.place.v_size), now.place.iv[b]
    if isinstance(made, Affine):
        part = made.constant + made.slope @ q
    else:
        u_f = (made.u_f + made.phi_f @ q) @ A
        part = np.concatenate([made.force @ A, axial(u_f), np.einsum("klj,lk->j", made.phi_f, A)])
    Q[first : first + part.size] = _value(load.function, now.t) * part
    return _made(now, load.name, Q)
