"""Markers at rest as what everything acts on: how they move to second order, and sums of forces on them.

The motion of a marker is J y + 1/2 y^T (d^2 of it) y, of small motions y of its body, in which the second derivative along
constant rates is the bias of its acceleration, at velocities y (`ffr_dyn.equations.kinematics`). So a wrench w = (F, M)
contributes J^T w to the forces, and to their derivative J^T (dw by the motions of markers) J and what the bias says:

    F . [w x (w x rho) + 2 w x P q_dot - q_dot K_t q_dot] + M . [w x T theta_dot - T (q_dot K_r q_dot) + T_dot theta_dot]

with forces in body axes: the geometric stiffness of multipliers, loads and weight. (Geradin & Cardona 2001, ch. 10.)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ffr_dyn.equations.forces import At
from ffr_dyn.equations.jets import Pair
from ffr_dyn.equations.kinematics import body_state, deflection
from ffr_dyn.equations.second_order import marker_matrices
from ffr_dyn.functions.rotation import from_vector, rotation_matrix, skew, tangent, tangent_rate_form
from ffr_dyn.scene.scene import markers
from ffr_prep.common.arrays import Array


@dataclass(frozen=True)
class Placed:
    """A marker at a state.

    at        : the velocities of its body;  A (3, 3) of the body;  r (3,), axes (3, 3) global, of the undeformed body's axes
    jacobian  : (6, 6 + n) of its velocity and angular velocity, global
    rho, P    : place (3,) and its gradient (3, n) in body axes;  theta, P_r : of its rotation vector;  K : (6, n, n)
    """

    at: slice
    A: Array
    r: Array
    axes: Array
    jacobian: Array
    rho: Array
    P: Array
    theta: Array
    P_r: Array
    K: Array


def all_placed(now: At) -> list[Placed]:
    """The markers of a scene, by number."""
    return [_placed(now, number) for number in range(len(markers(now.scene)))]


def _placed(now: At, number: int) -> Placed:
    b, _, point = markers(now.scene)[number]
    if b == len(now.scene.bodies):
        one, none, nothing = np.eye(3), np.zeros(3), np.zeros((3, 0))
        r = np.asarray(now.scene.ground[point], float)
        return Placed(slice(0, 0), one, r, one, np.zeros((6, 0)), none, nothing, none, nothing, np.zeros((6, 0, 0)))
    body, state = now.scene.bodies[b], body_state(now.place, now.x, now.v, b)
    interface, K = body.model.interface(point), marker_matrices(body, point)
    u, theta = deflection(state, interface.phi_t, K[:3]), deflection(state, interface.phi_r, K[3:])
    rho, one = interface.position + u.value, np.eye(3)
    twist = tangent(theta.value) @ theta.gradient
    jacobian = np.block([[one, -skew(rho), u.gradient], [0 * one, one, twist]])
    jacobian = np.concatenate([state.A @ jacobian[:3], state.A @ jacobian[3:]])
    axes = state.A @ rotation_matrix(from_vector(theta.value))
    at = slice(now.place.iv[b], now.place.iv[b] + 6 + now.place.n[b])
    return Placed(at, state.A, state.R + state.A @ rho, axes, jacobian, rho, u.gradient, theta.value, theta.gradient, K)


def curvature(rho: Array, P: Array, theta: Array, P_r: Array, K: Array, force: Array, moment: Array) -> Array:
    """(6 + n, 6 + n) second derivative of the motion of a marker times force and moment (3,) on it, body axes."""
    T, n = tangent(theta), P.shape[1]
    S = np.zeros((6 + n, 6 + n))
    S[3:6, 3:6] = 0.5 * (np.outer(force, rho) + np.outer(rho, force)) - (force @ rho) * np.eye(3)
    S[3:6, 6:] = -skew(force) @ P - 0.5 * skew(moment) @ T @ P_r
    S[6:, 3:6] = S[3:6, 6:].T
    S[6:, 6:] = P_r.T @ tangent_rate_form(theta, moment) @ P_r
    if K.any():
        S[6:, 6:] -= np.tensordot(np.concatenate([force, moment @ T]), K, 1)
    return S


def pair(i: Placed, j: Placed) -> Pair:
    return Pair(i.r, j.r, i.axes, j.axes)


@dataclass(frozen=True)
class Sums:
    """Forces (V,) and their derivative (V, V), to which every part of a scene adds its own."""

    placed: list[Placed]
    forces: Array
    tangent: Array

    def add_wrench(self, marker: Placed, wrench: Array) -> None:
        """A force and a moment (6,), global, that stay what they are as the marker moves."""
        self.forces[marker.at] += wrench @ marker.jacobian
        force, moment = wrench[:3] @ marker.A, wrench[3:] @ marker.A
        if marker.at.stop > marker.at.start:
            self.tangent[marker.at, marker.at] += curvature(
                marker.rho, marker.P, marker.theta, marker.P_r, marker.K, force, moment
            )

    def add_on_pair(self, ends: tuple[int, int], first: Array, second: Array) -> None:
        """Forces (12,) on the motions of two markers, with their derivative (12, 12)."""
        both = [(self.placed[number], slice(6 * k, 6 * k + 6)) for k, number in enumerate(ends)]
        for marker, own in both:
            self.add_wrench(marker, first[own])
            for other, columns in both:
                self.tangent[marker.at, other.at] += marker.jacobian.T @ second[own, columns] @ other.jacobian

    def gradient(self, ends: tuple[int, int], first: Array) -> Array:
        """(..., V) by the motions of all bodies, of (..., 12) by those of two markers."""
        found = np.zeros((*first.shape[:-1], self.forces.size))
        for k, number in enumerate(ends):
            marker = self.placed[number]
            found[..., marker.at] += first[..., 6 * k : 6 * k + 6] @ marker.jacobian
        return found


def nothing_on(placed: list[Placed], size: int) -> Sums:
    """No forces yet, of V = size."""
    return Sums(placed, np.zeros(size), np.zeros((size, size)))
