"""Functions of the unit triangle and the unit square of which the fields of plates are made.

N of the corners, P of the middles of the sides, g P with g from 1 to -1 along a side, B of the centre; scikit-fem supplies
them and the quadrature rules. Side m runs from corner m to the next.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
import skfem
from skfem.quadrature import get_quadrature

from ffr_prep.common.arrays import Array

_CORNER = {3: skfem.ElementTriP1, 4: skfem.ElementQuad1}
_SIDE = {3: skfem.ElementTriP2, 4: skfem.ElementQuadS2}
_CENTRE = {3: (skfem.ElementTriMini, 3), 4: (skfem.ElementQuad2, 8)}

CORNERS = {3: np.array([(0, 0), (1, 0), (0, 1)], float), 4: np.array([(0, 0), (1, 0), (1, 1), (0, 1)], float)}


@dataclass(frozen=True)
class Reference:
    """Functions at points (Q, 2) of the unit triangle or square: N, P, g P (Q, k) and B (Q,), and their gradients."""

    N: Array
    P: Array
    gP: Array
    B: Array
    dN: Array
    dP: Array
    dgP: Array
    dB: Array


def reference(k: int, at: Array) -> Reference:
    """Scikit-fem's functions of corners, sides and centre at `at` (Q, 2)."""
    N, dN = _functions(_CORNER[k](), range(k), at)
    P, dP = _functions(_SIDE[k](), range(k, 2 * k), at)
    (B, dB) = _functions(_CENTRE[k][0](), [_CENTRE[k][1]], at)
    g = N - np.roll(N, -1, axis=1)  # from 1 to -1 along a side of a triangle
    dg = dN - np.roll(dN, -1, axis=1)
    if k == 4:  # along a side of a square; the opposite side runs back
        g, dg = g - np.roll(g, 2, axis=1), dg - np.roll(dg, 2, axis=1)
    return Reference(N, P, g * P, B[:, 0], dN, dP, dg * P[..., None] + g[..., None] * dP, dB[:, 0])


def _functions(element: skfem.Element, which: Sequence[int] | range, at: Array) -> tuple[Array, Array]:
    """(Q, m) values and (Q, m, 2) gradients."""
    evaluated = [element.lbasis(at.T, i) for i in which]
    values = np.stack([np.broadcast_to(value, len(at)) for value, _ in evaluated], axis=-1)
    gradients = np.stack([np.broadcast_to(gradient, (2, len(at))) for _, gradient in evaluated], axis=-1)
    return values, gradients.transpose(1, 2, 0)


@cache
def rule(k: int, order: int) -> tuple[Array, Array]:
    """Points (Q, 2) and weights (Q,) of a quadrature rule on the unit triangle or square."""
    at, weights = get_quadrature(_CORNER[k]().refdom, order)
    return at.T, weights
