"""Velocities with which a mechanism goes on from a singular position.

Where rows depend on one another more velocities meet them than there are motions. Rows J v = -nu that depend on one another
must also agree about accelerations, J a = gamma(v), and what that asks of v is quadratic: the second-order tangent cone of
the positions. It leaves the directions of the branches that meet there. (Mueller, J. Mech. Robotics 10 (2018) 011008.)
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from ffr_dyn.closing.constraints import Constraints, rows_at
from ffr_dyn.closing.positions import rigid_jacobian, weights
from ffr_dyn.closing.row_space import DEPENDENT, smallest_solution
from ffr_dyn.equations.layout import to_body_axes, to_global_axes
from ffr_prep.common.arrays import Array

AGREE = 1e-9  # of the accelerations that rows ask for, what they may contradict each other by


@dataclass(frozen=True)
class _Cone:
    """Velocities v + N s (body axes) that meet the rows at x, and which rows depend on one another.

    N : (V, d) free motions;  combinations : (C, m) of the rows, whose accelerations vanish
    free : (d,) v as a free motion, which is to stay as fast as it is: rest would meet the rows, too; None of driven motions
    """

    constraints: Constraints
    x: Array
    v: Array
    N: Array
    combinations: Array
    free: Array | None

    def at(self, s: Array) -> Array:
        return self.v + self.N @ s

    def contradiction(self, s: Array) -> Array:
        """(m,) what the rows contradict each other by in the accelerations that they ask for; (m + 1,) with the speed."""
        v = to_global_axes(self.constraints.place, self.x, self.at(s))
        found: Array = self.combinations.T @ rows_at(self.constraints, self.x, v).gamma
        if self.free is None:
            return found
        return np.append(found, (self.free + s) @ (self.free + s) - self.free @ self.free)


def going_on(constraints: Constraints, x: Array, v: Array) -> Array:
    """v (global axes), which meets the rows at x, or near to it a velocity of rigid bodies with which the motion can go on.

    v itself where the rows agree about accelerations, and where no branch is found.
    """
    place, rows = constraints.place, rows_at(constraints, x, v)
    W = weights(constraints.scene, place, x, True, isinstance(rows.J, np.ndarray))
    left = rows.gamma - rows.J @ (W @ smallest_solution(rows.J @ W, rows.gamma))
    allowed = AGREE * float(np.abs(rows.gamma).max(initial=0.0))
    if not np.abs(left).max(initial=0.0) > allowed:
        return v
    cone = _cone(constraints, x, to_body_axes(place, x, v))
    for start in _starts(cone) if cone.combinations.size else ():
        found = least_squares(cone.contradiction, start, jac="3-point", xtol=1e-15, ftol=1e-15, gtol=1e-15)
        if np.abs(found.fun).max() <= allowed:
            return to_global_axes(place, x, cone.at(found.x))
    return v


def _cone(constraints: Constraints, x: Array, v: Array) -> _Cone:
    W, A = rigid_jacobian(constraints, x)
    length = np.linalg.norm(A, axis=1)
    length = np.where(length > 0, length, 1.0)
    left, values, right = np.linalg.svd(A / length[:, None])
    rank = int((values > DEPENDENT).sum())
    N, combinations = W @ right[rank:].T, left[:, rank:] / length[:, None]
    driven = np.abs(rows_at(constraints, x, 0.0 * v).nu).any()
    return _Cone(constraints, x, v, N, combinations, None if driven else np.linalg.lstsq(N, v, rcond=None)[0])


def _starts(cone: _Cone) -> Iterator[Array]:
    """From where a branch is looked for: v itself, then v with as fast a free motion."""
    d = cone.N.shape[1]
    yield np.zeros(d)
    for way in np.concatenate([np.eye(d), -np.eye(d)]):
        yield way * float(np.abs(cone.v).max() / np.abs(cone.N @ way).max())
