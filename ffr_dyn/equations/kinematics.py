"""Markers: points and axes that move with a deforming body. Value, velocity, bias acceleration and Jacobian of each.

Shapes phi and second-order matrices K (zeros of linear bodies, see `ffr_dyn.equations.second_order`) give an interface its
place and its rotation vector, in body axes:

    rho   = u_0 + phi_t q - 1/2 q^T K_t q       r = R + A rho
    theta =       phi_r q - 1/2 q^T K_r q       a = A exp(theta~) a0   for an axis a0 of the marker

The bias is the part of the acceleration that does not contain accelerations. A Jacobian maps the velocities
[A^T R_dot, omega_bar, q_dot] (6 + n) of the body. (Shabana 2013, ch. 5.) The compiled form is `ffr_dyn.kernels.markers`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ffr_dyn.equations.layout import Layout
from ffr_dyn.equations.second_order import marker_matrices
from ffr_dyn.functions.rotation import cross, from_vector, rotation_matrix, skew, tangent, tangent_rate
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


@dataclass(frozen=True)
class Deflection:
    """Three quadratic functions of q: value (3,), gradient (3, n), rate (3,), and bias (3,) of the second derivative."""

    value: Array
    gradient: Array
    rate: Array
    bias: Array


def deflection(state: BodyState, phi: Array, K: Array) -> Deflection:
    """phi q - 1/2 q^T K q of shapes phi (3, n) and symmetric K (3, n, n)."""
    bent = K @ state.q
    P = phi - bent
    return Deflection((phi - 0.5 * bent) @ state.q, P, P @ state.q_dot, -(K @ state.q_dot) @ state.q_dot)


@dataclass(frozen=True)
class Turn:
    """How a marker turns: exp(theta~) (3, 3) from its undeformed axes, angular velocity and its bias (3,), Jacobian
    (3, 6 + n); all in body axes."""

    rotation: Array
    omega: Array
    bias: Array
    jacobian: Array


def point_motion(state: BodyState, u0: Array, phi_t: Array, K_t: Array, b: int) -> Motion:
    """A point at u0 (3,) with translational shapes phi_t (3, n) and K_t (3, n, n). Equation (3) of docs/notation.md."""
    u = deflection(state, phi_t, K_t)
    rho = u0 + u.value
    spin = cross(state.omega, rho)
    return Motion(
        state.R + state.A @ rho,
        state.V + state.A @ (spin + u.rate),
        state.A @ (cross(state.omega, spin + 2 * u.rate) + u.bias),
        state.A @ np.hstack([np.eye(3), -skew(rho), u.gradient]),
        b,
    )


def turning(state: BodyState, phi_r: Array, K_r: Array) -> Turn:
    """The rotation of a marker with rotational shapes phi_r (3, n) and K_r (3, n, n). Equation (26) of docs/notation.md."""
    theta = deflection(state, phi_r, K_r)
    T = tangent(theta.value)
    twist = T @ theta.rate
    return Turn(
        rotation_matrix(from_vector(theta.value)),
        state.omega + twist,
        cross(state.omega, twist) + T @ theta.bias + tangent_rate(theta.value, theta.rate),
        np.hstack([np.zeros((3, 3)), np.eye(3), T @ theta.gradient]),
    )


def axis_motion(state: BodyState, a0: Array, turn: Turn, b: int) -> Motion:
    """An axis a0 (3,), undeformed, on a marker that turns. Equation (4) of docs/notation.md."""
    a = turn.rotation @ a0
    rate = cross(turn.omega, a)
    return Motion(
        state.A @ a,
        state.A @ rate,
        state.A @ (cross(turn.bias, a) + cross(turn.omega, rate)),
        -state.A @ skew(a) @ turn.jacobian,
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
    body = scene.bodies[b]
    interface, K_t = body.model.interface(point), marker_matrices(body, point)[:3]
    return point_motion(body_state(place, x, v, b), interface.position, interface.phi_t, K_t, b)


def marker_axis(scene: Scene, place: Layout, x: Array, v: Array, number: int, a0: Array) -> Motion:
    """An axis a0 (body axes, undeformed) of a marker by number."""
    b = markers(scene)[number][0]
    if b == len(scene.bodies):
        return fixed_vector(a0, b)
    state = body_state(place, x, v, b)
    return axis_motion(state, a0, marker_turn(scene, state, number), b)


def marker_directions(scene: Scene, place: Layout, x: Array, number: int, *axes: Array) -> list[Array]:
    """Values (3,) of `marker_axis`, axes of a marker in global axes."""
    b, _, point = markers(scene)[number]
    if b == len(scene.bodies):
        return [*axes]
    body, q = scene.bodies[b], x[place.q(b)]
    if not q.size:
        A = rotation_matrix(x[place.p(b)])
        return [A @ a0 for a0 in axes]
    theta = body.model.interface(point).phi_r - 0.5 * (marker_matrices(body, point)[3:] @ q)
    turn, A = rotation_matrix(from_vector(theta @ q)), rotation_matrix(x[place.p(b)])
    return [A @ (turn @ a0) for a0 in axes]


def marker_turn(scene: Scene, state: BodyState, number: int) -> Turn:
    """How a marker turns with its body, which is not the ground, by number."""
    b, _, point = markers(scene)[number]
    body = scene.bodies[b]
    return turning(state, body.model.interface(point).phi_r, marker_matrices(body, point)[3:])


def marker_motion(scene: Scene, place: Layout, x: Array, v: Array, name: str) -> Motion:
    """The point of a marker by name."""
    return marker_point(scene, place, x, v, marker_number(scene, name))
