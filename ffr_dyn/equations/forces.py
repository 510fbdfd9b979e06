"""Applied loads in readable form: what each contributes to the generalised forces, and its power.

Where a force acts (`ffr_dyn.scene.forces.places`) gives coordinates c, made here of the words of the constraints
(`ffr_dyn.equations.constraints`); its law gives the force F on them, which acts with F dc/dv, the row of c's rate.
Generalised forces are [A^T F, M, Q] of all bodies, in body axes. The compiled form, which the tests hold equal to this one,
is `ffr_dyn.kernels.forces`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ffr_dyn.equations.constraints import Markers, Parts, Row, add_part, evaluate_word, summed_parts
from ffr_dyn.equations.constraints import coordinate as joint_coordinate
from ffr_dyn.equations.inertia import gravity_force
from ffr_dyn.equations.kinematics import body_state, marker_point, marker_turn
from ffr_dyn.equations.layout import Layout
from ffr_dyn.equations.state_view import StateView
from ffr_dyn.functions.rotation import axis_times_sine, rotation_matrix
from ffr_dyn.functions.time_functions import as_time_function, evaluate
from ffr_dyn.scene.force_kinds import forces_of
from ffr_dyn.scene.forces.force import Force
from ffr_dyn.scene.forces.places import AlongLine, AtMarker, BetweenAxes, OnBody, OnJoint, Place
from ffr_dyn.scene.joints import DOT_1, DOT_2, word
from ffr_dyn.scene.scene import Scene, markers
from ffr_prep.common.arrays import Array

NO_DRIVE = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class At:
    """Scene, layout, time [s] and state at which forces are wanted: a `ffr_dyn.scene.forces.force.Moment` for their laws."""

    scene: Scene
    place: Layout
    t: float
    x: Array
    v: Array

    @property
    def markers(self) -> Markers:
        return Markers(self.scene, self.place, self.x, self.v)

    @property
    def state(self) -> StateView:
        return StateView(self.scene, self.place, self.x, self.v)

    def value(self, function: Any) -> tuple[float, float, float]:
        """A number or function of time now, and two derivatives."""
        return evaluate(as_time_function(function, "force"), self.t)

    @property
    def velocities(self) -> Array:
        """(V,) velocities with R_dot in body axes, which the generalised forces multiply to power."""
        y = self.v.copy()
        for b in range(len(self.place.n)):
            y[self.place.R_dot(b)] = rotation_matrix(self.x[self.place.p(b)]).T @ self.v[self.place.R_dot(b)]
        return y


@dataclass(frozen=True)
class Applied:
    """One load: its generalised forces (V,), its power [W], and for a force on coordinates these and the force on them."""

    name: str
    generalised: Array
    power: float
    coordinate: Any = None
    force: Any = None


def applied(scene: Scene, place: Layout, t: float, x: Array, v: Array) -> list[Applied]:
    """Every applied load of the scene but gravity; angles counted from the turns at the start.

    Equation (23) of docs/notation.md.
    """
    now = At(scene, place, t, x, v)
    return [applied_by(now, force) for force in forces_of(scene)]


def gravity_at(scene: Scene, t: float) -> Array:
    """(3,) [m/s^2] gravity as the accelerated base feels it."""
    field: Array = scene.gravity - np.array([evaluate(f, t)[0] for f in scene.base_acceleration])
    return field


def gravity_forces(scene: Scene, place: Layout, t: float, x: Array) -> Array:
    """(V,) generalised forces of gravity on all bodies."""
    field = gravity_at(scene, t)
    parts = [
        gravity_force(body.model, x[place.q(b)], rotation_matrix(x[place.p(b)]), field)
        for b, body in enumerate(scene.bodies)
    ]
    return np.concatenate(parts)


def applied_by(now: At, load: Force) -> Applied:
    """One load."""
    place = load.place
    coordinate: Any = None
    rate: Any = None
    force: Any = None
    if isinstance(place, AtMarker):
        generalised = _wrench(now, place, load.law(now, None, None))
    elif isinstance(place, OnBody):
        generalised = _on_body(now, place, load)
    else:
        rows = _coordinates(now, place)
        coordinate, rate = np.array([row.Phi for row in rows]), np.array([row.nu for row in rows])
        if len(rows) == 1:
            coordinate, rate = rows[0].Phi, rows[0].nu
        force = load.law(now, coordinate, rate)
        generalised = _along(rows, force)
    return Applied(load.name, generalised, float(generalised @ now.velocities), coordinate, force)


def acting(now: At, place: Place, force: Array) -> Array:
    """(V,) generalised forces of a force on the coordinates of a place, or of a force and moment (6,) at a marker."""
    return _wrench(now, place, force) if isinstance(place, AtMarker) else _along(_coordinates(now, place), force)


def _along(rows: list[Row], force: Any) -> Array:
    generalised: Array = np.ravel(force) @ np.array([row.jacobian for row in rows])
    return generalised


def _wrench(now: At, place: AtMarker, values: Array) -> Array:
    """(V,) of a force and moment (6,) in the axes of the place: virtual power on a point and on an angular velocity."""
    Q, (number, _) = np.zeros(now.place.v_size), place.ends(now.scene)
    b = markers(now.scene)[number][0]
    if b == len(now.scene.bodies):
        return Q
    state = body_state(now.place, now.x, now.v, b)
    force, moment = values.reshape(2, 3) if place.axes == "body" else values.reshape(2, 3) @ state.A
    point = marker_point(now.scene, now.place, now.x, now.v, number)
    part = (state.A @ force) @ point.jacobian + moment @ marker_turn(now.scene, state, number).jacobian
    Q[now.place.iv[b] : now.place.iv[b] + part.size] = part
    return Q


def _on_body(now: At, place: OnBody, load: Force) -> Array:
    Q, (b, _) = np.zeros(now.place.v_size), place.ends(now.scene)
    part = load.law(now, now.x[now.place.q(b)], now.v[now.place.q_dot(b)])
    Q[now.place.iv[b] : now.place.iv[b] + part.size] = part
    return Q


# ---- coordinates --------------------------------------------------------------------------------------------------


def _coordinates(now: At, place: Place) -> list[Row]:
    """Value, rate and gradient of the coordinates of a place."""
    if isinstance(place, AlongLine):
        return [_length(now, place)]
    if isinstance(place, BetweenAxes):
        return [*_displacements(now, place), *_rotations(now, place)]
    if isinstance(place, OnJoint):
        return [_on_joint(now, place)]
    raise TypeError(f"there are no coordinates of a {type(place).__name__}")


def _on_joint(now: At, place: OnJoint) -> Row:
    row = joint_coordinate(now.markers, place.coordinate, place.axes(now.scene), place.ends(now.scene))
    return replace(row, Phi=row.Phi + 2 * np.pi * place.turns)


def _product(now: At, kind: str, a: Array, b: Array, place: Place) -> Row:
    ends = place.ends(now.scene)
    return evaluate_word(now.scene, now.place, now.x, now.v, word(kind, "", a, b), ends, NO_DRIVE)


def _length(now: At, place: AlongLine) -> Row:
    at_i, at_j = map(now.markers.point, place.ends(now.scene))
    d, parts = at_j.r - at_i.r, Parts()
    size = float(np.linalg.norm(d))
    if size == 0:
        return Row(0.0, 0.0, 0.0, parts, now.place.v_size)
    for at, sign in ((at_i, -1), (at_j, 1)):
        add_part(now.place, parts, at, sign * d / size @ at.jacobian)
    return Row(size, float(d / size @ (at_j.r_dot - at_i.r_dot)), 0.0, parts, now.place.v_size)


def _displacements(now: At, place: BetweenAxes) -> list[Row]:
    return [_product(now, DOT_2, a, np.zeros(3), place) for a in place.on_i.T]


def _rotations(now: At, place: BetweenAxes) -> list[Row]:
    """psi = z phi / sin(phi), z the axial vector of the relative rotation B, by the chain rule."""
    B = [[_product(now, DOT_1, a, b, place) for b in place.on_j.T] for a in place.on_i.T]
    z = [_mixed([(0.5, B[(c + 2) % 3][(c + 1) % 3]), (-0.5, B[(c + 1) % 3][(c + 2) % 3])]) for c in range(3)]
    trace = _mixed([(1.0, B[c][c]) for c in range(3)])
    axial = axis_times_sine(np.array([[row.Phi for row in rows] for rows in B]))
    z = [replace(row, Phi=float(value)) for row, value in zip(z, axial, strict=True)]
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
    square = s**2 + c**2
    if s < 0.02 * c:
        y = s / c
        series = (1 - y**2 / 3 + y**4 / 5 - y**6 / 7) / c
        return series, (-2 / 3 + 4 * y**2 / 5 - 6 * y**4 / 7) / c**3, -1 / square
    phi = float(np.arctan2(s, c))
    return phi / s, (s * c / square - phi) / s**3, -1 / square
