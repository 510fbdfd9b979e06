"""Markers and joint frames along a recorded motion, all rows at once.

Every number is made by the same operations in the same order, however many rows are looked at together: a run that is cut
anywhere and continued gives the same bits. Hence the sums written out here, where a matrix product would do.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ffr_dyn.compile.scene_tables import System
from ffr_dyn.functions.rotation import rotation_matrix
from ffr_dyn.kernels.tables import Record
from ffr_dyn.scene.joints import Joint, frames
from ffr_dyn.scene.scene import marker_number, markers
from ffr_prep.common.arrays import Array
from ffr_prep.common.brief import Brief


def dot(a: Array, b: Array) -> Array:
    """(T, 3), (T, 3) -> (T,)."""
    return a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1] + a[:, 2] * b[:, 2]


def cross(a: Array, b: Array) -> Array:
    """(T, 3), (T, 3) -> (T, 3)."""
    (a0, a1, a2), (b0, b1, b2) = a.T, b.T
    return np.stack([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0], axis=1)


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


@dataclass(frozen=True, repr=False)
class View(Brief):
    """Recorded rows of a compiled scene."""

    system: System
    record: Record

    @property
    def rows(self) -> int:
        """T."""
        return self.record.time.size

    def number(self, marker: str) -> int:
        """The number of a marker."""
        return marker_number(self.system.scene, marker)

    def _owner(self, marker: int) -> tuple[int, Array, Array] | None:
        """(body, phi_t, phi_r) of a marker; None on the ground."""
        b, _, point = markers(self.system.scene)[marker]
        if b == len(self.system.scene.bodies):
            return None
        interface = self.system.scene.bodies[b].model.interface(point)
        return b, interface.phi_t, interface.phi_r

    def parameters(self, b: int) -> Array:
        """(T, 4) Euler parameters of body b."""
        return self.record.x[:, self.system.layout.p(b)]

    def axes(self, b: int) -> Array:
        """(T, 3, 3) of body b; the ground has the number after the last."""
        if b == len(self.system.scene.bodies):
            return np.broadcast_to(np.eye(3), (self.rows, 3, 3))
        return rotation_matrix(self.parameters(b))

    def q(self, b: int) -> Array:
        """(T, n)."""
        return self.record.x[:, self.system.layout.q(b)]

    def q_dot(self, b: int) -> Array:
        """(T, n)."""
        return self.record.v[:, self.system.layout.q_dot(b)]

    def displacement(self, marker: int) -> Array:
        """(T, 3) elastic displacement, body axes."""
        owner = self._owner(marker)
        return np.zeros((self.rows, 3)) if owner is None else shaped(owner[1], self.q(owner[0]))

    def acceleration(self, marker: int) -> Array:
        """(T, 3) R_ddot + A (omega_dot x u + phi_t q_ddot + omega x (omega x u) + 2 omega x phi_t q_dot)."""
        owner = self._owner(marker)
        if owner is None:
            return np.zeros((self.rows, 3))
        b, phi_t, _ = owner
        place, record, A = self.system.layout, self.record, self.axes(b)
        omega = record.v[:, place.omega(b)]
        u = to_axes(A, record.r[:, marker] - record.x[:, place.R(b)])
        u_dot, u_ddot = shaped(phi_t, self.q_dot(b)), shaped(phi_t, record.vd[:, place.q_dot(b)])
        inside = cross(record.vd[:, place.omega(b)], u) + u_ddot + cross(omega, cross(omega, u) + 2 * u_dot)
        return record.vd[:, place.R_dot(b)] + to_global(A, inside)

    def orientation(self, marker: int) -> Array:
        """(T, 4) Euler parameters of the marker's axes: those of its body, turned by the elastic rotation."""
        owner = self._owner(marker)
        if owner is None:
            return np.broadcast_to([1.0, 0.0, 0.0, 0.0], (self.rows, 4))
        half = 0.5 * shaped(owner[2], self.q(owner[0]))
        small = np.concatenate([np.ones((self.rows, 1)), half], axis=1)
        return times(self.parameters(owner[0]), small / np.sqrt(1.0 + dot(half, half))[:, None])

    def spin(self, marker: int) -> Array:
        """(T, 3) angular velocity of the marker, global axes."""
        owner = self._owner(marker)
        if owner is None:
            return np.zeros((self.rows, 3))
        b, _, phi_r = owner
        omega = self.record.v[:, self.system.layout.omega(b)]
        return to_global(self.axes(b), omega + shaped(phi_r, self.q_dot(b)))

    def frame(self, marker: int, frame: Array) -> Array:
        """(T, 3, 3) joint frame (columns f, g, h) of a marker in global axes, turned linearly by the deformation."""
        owner = self._owner(marker)
        if owner is None:
            return np.broadcast_to(frame, (self.rows, 3, 3))
        b, _, phi_r = owner
        theta, A = shaped(phi_r, self.q(b)), self.axes(b)
        columns = [np.broadcast_to(frame[:, k], (self.rows, 3)) for k in range(3)]
        return np.stack([to_global(A, a + cross(theta, a)) for a in columns], axis=2)

    def frame_rate(self, marker: int, frame: Array) -> Array:
        """(T, 3, 3) time derivative of `frame`."""
        owner = self._owner(marker)
        if owner is None:
            return np.zeros((self.rows, 3, 3))
        b, _, phi_r = owner
        omega, theta = self.record.v[:, self.system.layout.omega(b)], shaped(phi_r, self.q(b))
        twist, A = shaped(phi_r, self.q_dot(b)), self.axes(b)
        columns = [np.broadcast_to(frame[:, k], (self.rows, 3)) for k in range(3)]
        rates = [cross(omega, a + cross(theta, a)) + cross(twist, a) for a in columns]
        return np.stack([to_global(A, rate) for rate in rates], axis=2)

    def joint_frames(self, joint: Joint) -> tuple[Array, Array]:
        """Frames (T, 3, 3) of a joint on its markers i and j, global axes."""
        on_i, on_j = frames(joint)
        return self.frame(self.number(joint.i), on_i), self.frame(self.number(joint.j), on_j)

    def joint_frame_rates(self, joint: Joint) -> tuple[Array, Array]:
        """Time derivatives of `joint_frames`."""
        on_i, on_j = frames(joint)
        return self.frame_rate(self.number(joint.i), on_i), self.frame_rate(self.number(joint.j), on_j)
