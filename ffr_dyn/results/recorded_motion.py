"""Markers and joint frames along a recorded motion, all rows at once.

Every number is made by the same operations in the same order, however many rows are looked at together: a run that is cut
anywhere and continued gives the same bits. Hence the sums written out here, where a matrix product would do.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, TypeVar

import numpy as np

from ffr_dyn.compile.scene_tables import System
from ffr_dyn.equations.second_order import marker_matrices
from ffr_dyn.functions.rotation import rotation_matrix, turn_factors
from ffr_dyn.kernels.tables import Record
from ffr_dyn.scene.joints import Joint, frames
from ffr_dyn.scene.scene import marker_number, markers
from ffr_prep.body import FrameMarker, Interface
from ffr_prep.common.arrays import Array
from ffr_prep.common.brief import Brief

T = TypeVar("T")


def dot(a: Array, b: Array) -> Array:
    """(T, 3), (T, 3) -> (T,)."""
    return a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1] + a[:, 2] * b[:, 2]


def cross(a: Array, b: Array) -> Array:
    """(T, 3), (T, 3) -> (T, 3), or (T, 3, k) of k vectors."""
    out = np.empty(b.shape)
    a0, a1, a2 = a[:, 0], a[:, 1], a[:, 2]
    b0, b1, b2 = b[:, 0], b[:, 1], b[:, 2]
    out[:, 0] = a1 * b2 - a2 * b1
    out[:, 1] = a2 * b0 - a0 * b2
    out[:, 2] = a0 * b1 - a1 * b0
    return out


def to_global(A: Array, s: Array) -> Array:
    """A s: (T, 3, 3), (T, 3) -> (T, 3)."""
    return A[:, :, 0] * s[:, 0, None] + A[:, :, 1] * s[:, 1, None] + A[:, :, 2] * s[:, 2, None]


def to_axes(A: Array, s: Array) -> Array:
    """A^T s: (T, 3, 3), (T, 3) -> (T, 3)."""
    return A[:, 0] * s[:, 0, None] + A[:, 1] * s[:, 1, None] + A[:, 2] * s[:, 2, None]


def shaped(phi: Array, q: Array) -> Array:
    """phi q: (k, n), (T, n) -> (T, k)."""
    total = np.zeros((len(q), len(phi)))
    for j in range(phi.shape[1]):
        total += q[:, j, None] * phi[:, j]
    return total


def times(p: Array, r: Array) -> Array:
    """Product of Euler parameters (T, 4): first the rotation r, then p."""
    (p0, p1, p2, p3), (r0, r1, r2, r3) = p.T, r.T
    rows = [
        p0 * r0 - p1 * r1 - p2 * r2 - p3 * r3,
        p0 * r1 + p1 * r0 + p2 * r3 - p3 * r2,
        p0 * r2 - p1 * r3 + p2 * r0 + p3 * r1,
        p0 * r3 + p1 * r2 - p2 * r1 + p3 * r0,
    ]
    return np.stack(rows, axis=1)


def summed(rows: Array, q: Array) -> Array:
    """(T, k, n), (T, n) -> (T, k)."""
    total: Array = (rows * q[:, None]).sum(axis=2)
    return total


def from_vectors(theta: Array) -> Array:
    """(T, 3) rotation vectors -> (T, 4) Euler parameters."""
    angle = np.sqrt(dot(theta, theta))
    half = np.sinc(angle / (2 * np.pi)) / 2
    return np.concatenate([np.cos(angle / 2)[:, None], half[:, None] * theta], axis=1)


def twist(theta: Elastic) -> Array:
    """(T, 3) angular velocity of axes that turn by rotation vectors, in the axes that stay."""
    h, h_dot = theta.value, theta.rate
    b, c = (factor[:, None] for factor in turn_factors(dot(h, h))[:2])
    across = cross(h, h_dot)
    return h_dot + b * across + c * cross(h, across)


def twist_rate(theta: Elastic) -> Array:
    """(T, 3) derivative of `twist`."""
    h, h_dot = theta.value, theta.rate
    b, c, b_h, c_h = (factor[:, None] for factor in turn_factors(dot(h, h)))
    across, beside = cross(h, h_dot), cross(h, theta.growth)
    change = theta.growth + b * beside + c * cross(h, beside) + c * cross(h_dot, across)
    return change + dot(h, h_dot)[:, None] * (b_h * across + c_h * cross(h, across))


@dataclass(frozen=True)
class Elastic:
    """phi q - q K q / 2 along the recorded rows, with two time derivatives, each (T, k), made when it is asked for.

    phi : (k, n);  K : (k, n, n);  q, q_dot, q_ddot : (T, n)
    """

    phi: Array
    K: Array
    q: Array
    q_dot: Array
    q_ddot: Array

    @cached_property
    def value(self) -> Array:
        straight = shaped(self.phi, self.q)
        return straight if self._bent is None else straight - 0.5 * summed(self._bent, self.q)

    @cached_property
    def rate(self) -> Array:
        straight = shaped(self.phi, self.q_dot)
        return straight if self._bent is None else straight - summed(self._bent, self.q_dot)

    @cached_property
    def growth(self) -> Array:
        straight = shaped(self.phi, self.q_ddot)
        if self._bent is None:
            return straight
        return straight - summed(self._bent, self.q_ddot) - summed(self._curved(self.q_dot), self.q_dot)

    @cached_property
    def _bent(self) -> Array | None:
        """(T, k, n) K q; None of shapes without second order."""
        return self._curved(self.q) if self.K.any() else None

    def _curved(self, q: Array) -> Array:
        """(T, k, n) K q."""
        return shaped(self.K.reshape(-1, self.K.shape[2]), q).reshape(-1, *self.K.shape[:2])


def _turned_by(theta: Elastic) -> Array:
    """(T, 3, 3) of rotation vectors."""
    return rotation_matrix(from_vectors(theta.value))


@dataclass(frozen=True)
class Pose:
    """A point and axes that move: position R [m] and velocity, global axes, angular velocity, own axes, each (T, 3); Euler
    parameters p (T, 4)."""

    R: Array
    p: Array
    v: Array
    omega_bar: Array


@dataclass(frozen=True)
class PoseGrowth:
    """Of a `Pose`: acceleration of the point, global axes, and angular acceleration, own axes; each (T, 3)."""

    a: Array
    alpha_bar: Array


@dataclass(frozen=True, repr=False)
class View(Brief):
    """Recorded rows of a compiled scene that do not change any more: what is made for one quantity is kept for others.

    Bodies of second order are recorded in their mean-axis form; what is asked for by a public name is in the frames that
    bodies have of their own (`ffr_dyn.variants.mean_axis`).
    """

    system: System
    record: Record
    _known: dict[Hashable, Any] = field(default_factory=dict)

    @property
    def rows(self) -> int:
        """T."""
        return self.record.time.size

    def number(self, marker: str) -> int:
        """The number of a marker."""
        return marker_number(self.system.scene, marker)

    # ---- bodies ----------------------------------------------------------------------------------------------------

    def pose(self, b: int) -> Pose:
        """Of the own frame of body b."""
        return self._once(("pose", b), lambda: self._pose(b))

    def _once(self, what: Hashable, make: Callable[[], T]) -> T:
        """The value of `make()`, which several quantities need, computed for the first of them."""
        if what not in self._known:
            self._known[what] = make()
        found: T = self._known[what]
        return found

    def pose_growth(self, b: int) -> PoseGrowth:
        """Of the own frame of body b."""
        return self._once(("pose growth", b), lambda: self._pose_growth(b))

    def _pose(self, b: int) -> Pose:
        place, record, frame = self.system.layout, self.record, self.system.scene.bodies[b].frame
        R, p = record.x[:, place.R(b)], record.x[:, place.p(b)]
        V, omega = record.v[:, place.R_dot(b)], record.v[:, place.omega(b)]
        if not frame:
            return Pose(R, p, V, omega)
        A, (moved, turned) = self._computed_axes(b), self._pivot(b, frame.marker)
        at, rate = self._carried(b, frame.marker.pivot, moved)
        own, own_omega = times(p, from_vectors(turned.value)), to_axes(_turned_by(turned), omega + twist(turned))
        own_A, arm = rotation_matrix(own), np.broadcast_to(frame.marker.pivot, R.shape)
        spin = cross(own_omega, arm)
        return Pose(
            R + (to_global(A, at) - to_global(own_A, arm)),
            own,
            V + (to_global(A, rate) - to_global(own_A, spin)),
            own_omega,
        )

    def _pose_growth(self, b: int) -> PoseGrowth:
        place, record, frame = self.system.layout, self.record, self.system.scene.bodies[b].frame
        a, alpha = record.vd[:, place.R_dot(b)], record.vd[:, place.omega(b)]
        if not frame:
            return PoseGrowth(a, alpha)
        moved, turned = self._pivot(b, frame.marker)
        carried = to_global(self._computed_axes(b), self._carried_growth(b, frame.marker.pivot, moved))
        turning = twist_rate(turned) - cross(twist(turned), record.v[:, place.omega(b)])
        own_alpha, own_omega = to_axes(_turned_by(turned), alpha + turning), self.pose(b).omega_bar
        arm = np.broadcast_to(frame.marker.pivot, a.shape)
        bent = cross(own_alpha, arm) + cross(own_omega, cross(own_omega, arm))
        return PoseGrowth(a + (carried - to_global(self.axes(b), bent)), own_alpha)

    def axes(self, b: int) -> Array:
        """(T, 3, 3) of body b; the ground has the number after the last."""
        if b == len(self.system.scene.bodies):
            return np.broadcast_to(np.eye(3), (self.rows, 3, 3))
        return self._once(("axes", b), lambda: rotation_matrix(self.pose(b).p))

    def own_elastic(self, b: int, values: Array) -> Array:
        """(T, n) coordinates of body b, their rates or accelerations (T, m), as those that it has of its own."""
        frame = self.system.scene.bodies[b].frame
        return shaped(frame.C, values) if frame else values

    def q(self, b: int) -> Array:
        """(T, n) of the model that is computed."""
        return self.record.x[:, self.system.layout.q(b)]

    def q_dot(self, b: int) -> Array:
        """(T, n) of the model that is computed."""
        return self.record.v[:, self.system.layout.q_dot(b)]

    def _computed_axes(self, b: int) -> Array:
        p = self.record.x[:, self.system.layout.p(b)]
        return self._once(("computed axes", b), lambda: rotation_matrix(p))

    def _elastic(self, b: int, phi: Array, K: Array) -> Elastic:
        """Of shapes phi (k, n), K (k, n, n) of body b."""
        return Elastic(phi, K, self.q(b), self.q_dot(b), self.record.vd[:, self.system.layout.q_dot(b)])

    def _pivot(self, b: int, at: FrameMarker) -> tuple[Elastic, Elastic]:
        """Displacement and rotation vector of the marker that carries the own frame of body b."""
        return self._once(
            ("pivot", b),
            lambda: (self._elastic(b, at.phi_t, at.K[:3]), self._elastic(b, at.phi_r, at.K[3:])),
        )

    def _carried(self, b: int, at: Array, u: Elastic) -> tuple[Array, Array]:
        """The point at + u of body b as seen from its origin: place and rate, in its axes."""
        arm = at + u.value
        return arm, cross(self.record.v[:, self.system.layout.omega(b)], arm) + u.rate

    def _carried_growth(self, b: int, at: Array, u: Elastic) -> Array:
        """The acceleration of that point."""
        omega, alpha = (values[:, self.system.layout.omega(b)] for values in (self.record.v, self.record.vd))
        arm = at + u.value
        return cross(alpha, arm) + u.growth + cross(omega, cross(omega, arm) + 2 * u.rate)

    # ---- markers ---------------------------------------------------------------------------------------------------

    def _owner(self, marker: int) -> tuple[int, Interface] | None:
        """Body and interface of a marker; None on the ground."""
        b, _, point = markers(self.system.scene)[marker]
        if b == len(self.system.scene.bodies):
            return None
        return b, self.system.scene.bodies[b].model.interface(point)

    def _matrices(self, b: int, interface: Interface) -> Array:
        return marker_matrices(self.system.scene.bodies[b], interface.name)

    def _turned(self, b: int, interface: Interface) -> Elastic:
        """Rotation vector of a marker."""
        return self._once(
            ("turned", b, interface.name),
            lambda: self._elastic(b, interface.phi_r, self._matrices(b, interface)[3:]),
        )

    def displacement(self, marker: int) -> Array:
        """(T, 3) elastic displacement: the place of the marker less the undeformed one, body axes."""
        owner = self._owner(marker)
        if owner is None:
            return np.zeros((self.rows, 3))
        b, interface = owner
        moved = self._elastic(b, interface.phi_t, self._matrices(b, interface)[:3]).value
        if not (frame := self.system.scene.bodies[b].frame):
            return moved
        pivot, turned = self._pivot(b, frame.marker)
        arm = interface.position - frame.marker.pivot
        return to_axes(_turned_by(turned), moved - pivot.value + arm) - arm

    def acceleration(self, marker: int) -> Array:
        """(T, 3) R_ddot + A (omega_dot x u + u_ddot + omega x (omega x u) + 2 omega x u_dot)."""
        owner = self._owner(marker)
        if owner is None:
            return np.zeros((self.rows, 3))
        b, interface = owner
        u = self._elastic(b, interface.phi_t, self._matrices(b, interface)[:3])
        carried = self._carried_growth(b, interface.position, u)
        return self.record.vd[:, self.system.layout.R_dot(b)] + to_global(self._computed_axes(b), carried)

    def orientation(self, marker: int) -> Array:
        """(T, 4) Euler parameters of the marker's axes: those of its body, turned by the elastic rotation."""
        return np.broadcast_to(self._attitudes(marker), (self.rows, 4))

    def _attitudes(self, marker: int) -> Array:
        """As `orientation`; (1, 4) on the ground."""
        return self._once(("orientation", marker), lambda: self._orientation(marker))

    def _orientation(self, marker: int) -> Array:
        owner = self._owner(marker)
        if owner is None:
            return np.array([[1.0, 0.0, 0.0, 0.0]])
        p = self.record.x[:, self.system.layout.p(owner[0])]
        return times(p, from_vectors(self._turned(*owner).value)) if self.system.layout.n[owner[0]] else p

    def spin(self, marker: int) -> Array:
        """(T, 3) angular velocity of the marker, global axes."""
        return self._once(("spin", marker), lambda: self._spin(marker))

    def _spin(self, marker: int) -> Array:
        owner = self._owner(marker)
        if owner is None:
            return np.zeros((self.rows, 3))
        omega = self.record.v[:, self.system.layout.omega(owner[0])]
        if self.system.layout.n[owner[0]]:
            omega = omega + twist(self._turned(*owner))
        return to_global(self._computed_axes(owner[0]), omega)

    def frame(self, marker: int, frame: Array) -> Array:
        """(T, 3, 3) joint frame (columns f, g, h) of a marker in global axes."""
        return self._once(("frame", marker, frame.tobytes()), lambda: self._frame(marker, frame))

    def _frame(self, marker: int, frame: Array) -> Array:
        A = self._once(("marker axes", marker), lambda: self._marker_axes(marker))
        turned = A[:, :, 0, None] * frame[0] + A[:, :, 1, None] * frame[1] + A[:, :, 2, None] * frame[2]
        return turned if len(turned) == self.rows else np.broadcast_to(turned, (self.rows, 3, 3))

    def _marker_axes(self, marker: int) -> Array:
        """(T, 3, 3); (1, 3, 3) on the ground."""
        return rotation_matrix(self._attitudes(marker)) if self._owner(marker) else np.eye(3)[None]

    def frame_rate(self, marker: int, frame: Array) -> Array:
        """(T, 3, 3) time derivative of `frame`."""
        return self._once(("frame rate", marker, frame.tobytes()), lambda: self._frame_rate(marker, frame))

    def _frame_rate(self, marker: int, frame: Array) -> Array:
        return cross(self.spin(marker)[:, :, None], self.frame(marker, frame))

    def joint_frames(self, joint: Joint) -> tuple[Array, Array]:
        """Frames (T, 3, 3) of a joint on its markers i and j, global axes."""
        on_i, on_j = frames(joint)
        return self.frame(self.number(joint.i), on_i), self.frame(self.number(joint.j), on_j)

    def joint_frame_rates(self, joint: Joint) -> tuple[Array, Array]:
        """Time derivatives of `joint_frames`."""
        on_i, on_j = frames(joint)
        return self.frame_rate(self.number(joint.i), on_i), self.frame_rate(self.number(joint.j), on_j)
