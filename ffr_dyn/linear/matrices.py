"""The machine near a steady motion, in minimal coordinates: y along the free motions, seen from axes that move with
the bodies.

    y_ddot + C y_dot + K y = forces,    C = Z^T (G + D) Z,  K = Z^T K Z,  Z^T M Z = 1

with the matrices of `ffr_dyn.linear.steady_state`, all of them exact but for forces that see velocities.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ffr_dyn.equations.layout import to_body_axes
from ffr_dyn.functions.rotation import skew
from ffr_dyn.linear.steady_state import Steady
from ffr_prep.common.arrays import Array


@dataclass(frozen=True)
class Reduced:
    """K, C (d, d) of a steady motion in its free motions."""

    K: Array
    C: Array


def reduced(found: Steady) -> Reduced:
    """The matrices of the free motions."""
    Z, about = found.Z, found.about
    return Reduced(Z.T @ about.K @ Z, Z.T @ (about.G + about.D) @ Z)


def state_matrix(found: Steady, of: Reduced) -> Array:
    """(2 d, 2 d) A of (y, z), z the changes of the velocities in body axes along the free motions: y_dot, and what
    the turning of the axes makes of y."""
    d, turning = len(of.K), np.zeros_like(found.about.M)
    place = found.machine.place
    inside = to_body_axes(place, found.x, found.v)
    for b in range(len(place.n)):
        at, turn = place.R_dot(b), place.omega(b)
        turning[at, at] = turning[turn, turn] = skew(inside[turn])
        turning[at, turn] = skew(inside[at])
    one, none = np.eye(d), np.zeros((d, d))
    S = found.Z.T @ found.about.M @ turning @ found.Z
    there, back = np.block([[one, none], [S, one]]), np.block([[one, none], [-S, one]])
    return there @ np.block([[none, one], [-of.K, -of.C]]) @ back
