"""Markers: points and axes that move with a deforming body. Value, velocity, bias acceleration and Jacobian of each.

With u = u_0 + phi_t q, theta = phi_r q (infinitesimal), all in body axes:

    r = R + A u           r_dot = R_dot + A (omega x u + phi_t q_dot)
    a = A (a0 + theta x a0)   for an axis a0 of the marker

The bias is the part of the acceleration that does not contain accelerations. A Jacobian maps the velocities
[A^T R_dot, omega_bar, q_dot] (6 + n) of the body. (Shabana 2013, ch. 5.) The compiled form is `ffr_dyn.kernels.markers`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ffr_dyn.equations.layout import Layout
from ffr_dyn.functions.rotation import cross, rotation_matrix, skew
from ffr_dyn.scene.scene import Scene, marker_number, markers
from ffr_prep.common.arrays import Array


@dataclass(frozen=True)
class BodyState:
    """Pose and velocity of one body: A (3, 3), R (3,), V (3,) global, omega (3,) body axes, q, q_dot (n,)."""

    A: Array
    R: Array
    V: Array
    omega: Array
    q: Array
    q_dot: Array


@dataclass(frozen=True)
class Motion:
    """A moving vector: value r (3,), rate r_dot (3,), bias (3,), Jacobian (3, 6 + n); global axes; body number or None."""

    r: Array
    r_dot: Array
    bias: Array
    jacobian: Array
    body: int


def body_state(place: Layout, x: Array, v: Array, b: int) -> BodyState:
    """The state of body b."""
    return BodyState(
        rotation_matrix(x[place.p(b)]),
        x[place.R(b)],
        v[place.R_dot(b)],
        v[place.omega(b)],
        x[place.q(b)],
        v[place.q_dot(b)],
    )


def point_motion(state: BodyState, u0: Array, phi_t: Array, b: int) -> Motion:
    """A point at u0 (3,) with translational shapes phi_t (3, n). Equation (3) of docs/notation.md."""
    u, u_dot = u0 + phi_t @ state.q, phi_t @ state.q_dot
    spin = cross(state.omega, u)
    return Motion(
        state.R + state.A @ u,
        state.V + state.A @ (spin + u_dot),
        state.A @ cross(state.omega, spin + 2 * u_dot),
        state.A @ np.hstack([np.eye(3), -skew(u), phi_t]),
        b,
    )


def axis_motion(state: BodyState, a0: Array, phi_r: Array, b: int) -> Motion:
    """An axis a0 (3,) on a marker with rotational shapes phi_r (3, n). Equation (4) of docs/notation.md."""
    a = a0 + cross(phi_r @ state.q, a0)
    twist = cross(phi_r @ state.q_dot, a0)
    rate = cross(state.omega, a) + twist
    return Motion(
        state.A @ a,
        state.A @ rate,
        state.A @ cross(state.omega, rate + twist),
        state.A @ np.hstack([np.zeros((3, 3)), -skew(a), -skew(a0) @ phi_r]),
        b,
    )


def fixed_vector(value: Array, ground: int) -> Motion:
    """A point or axis of the ground."""
    return Motion(value, np.zeros(3), np.zeros(3), np.zeros((3, 6)), ground)


def marker_point(scene: Scene, place: Layout, x: Array, v: Array, number: int) -> Motion:
    """The point of a marker by number."""
    b, _, point = markers(scene)[number]
    if b == len(scene.bodies):
        return fixed_vector(scene.ground[point], b)
    interface = scene.bodies[b].model.interface(point)
    return point_motion(body_state(place, x, v, b), interface.position, interface.phi_t, b)


def marker_axis(scene: Scene, place: Layout, x: Array, v: Array, number: int, a0: Array) -> Motion:
    """An axis a0 (body axes) of a marker by number."""
    b, _, point = markers(scene)[number]
    if b == len(scene.bodies):
        return fixed_vector(a0, b)
    interface = scene.bodies[b].model.interface(point)
    return axis_motion(body_state(place, x, v, b), a0, interface.phi_r, b)


def marker_motion(scene: Scene, place: Layout, x: Array, v: Array, name: str) -> Motion:
    """The point of a marker by name."""
    return marker_point(scene, place, x, v, marker_number(scene, name))
