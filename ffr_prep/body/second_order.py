"""Fields that are quadratic in the elastic coordinates: kept small, evaluated, in other coordinates.

The second-order displacement u_2 of a surface has n (n + 1) / 2 fields, one for each pair of elastic coordinates: at 5000
points and 16 modes 16 MB. They depend on one another, being sums of products of slopes, so that a few shapes tell them all:
a singular value decomposition of the fields, for modes of equal strain energy, is cut where what is left is nowhere more
than `TOLERANCE` of the largest value.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ffr_prep.body.reduced import QuadraticField, Surface
from ffr_prep.common.arrays import Array

TOLERANCE = 1e-4


def compressed(pairs: Array, omega2: Array, least: float = 0.0) -> QuadraticField:
    """The fields u_ij (..., c, n (n + 1) / 2), of  sum_ij q_i q_j u_ij / 2,  as few shapes; pairs i <= j row by row.

    omega2 : (n,) squared frequencies, which say what amplitudes of the modes have equal energy
    least  : largest value, at q . omega2 q = 1, that counts as large
    """
    i, j = np.triu_indices(omega2.size)
    scale = np.where(i == j, 1.0, np.sqrt(2.0)) / np.sqrt(omega2[i] * omega2[j])
    scaled = pairs.reshape(-1, scale.size) * scale
    turn = np.linalg.eigh(scaled.T @ scaled)[1][:, ::-1]
    shapes = (scaled @ turn).reshape(*pairs.shape[:-1], scale.size)
    kept = _rank(shapes.reshape(-1, *shapes.shape[-2:]), least)
    weights = np.zeros((kept, omega2.size, omega2.size))
    weights[:, i, j] = weights[:, j, i] = (turn[:, :kept] / scale[:, None]).T
    return QuadraticField(_rounded(shapes[..., :kept]), weights)


def _rounded(shapes: Array) -> Array:
    """The shapes (..., c, r) in a tenth of the tolerance, as multiples of a power of two: what files can compress."""
    largest = TOLERANCE * _largest(shapes)
    step = 2.0 ** np.floor(np.log2(0.1 * largest / np.sqrt(max(shapes.shape[-1], 1)))) if largest > 0 else 1.0
    return np.asarray(np.round(shapes / step) * step)


def _rank(shapes: Array, least: float) -> int:
    """How many of the shapes (P, c, r) are kept, the others being small at every place together."""
    squares = np.einsum("pcr,pcr->pr", shapes, shapes)
    left = np.cumsum(squares[:, ::-1], axis=1)[:, ::-1].max(axis=0, initial=0.0)  # without the shapes before
    return int(np.sum(left > TOLERANCE**2 * left.max(initial=least**2)))


def compressed_beside(
    linear: Array, pairs: Array, omega2: Array, reach: float, groups: Sequence[slice]
) -> QuadraticField:
    """As `compressed`, of components beside the linear ones (..., c, n), group by group of one unit.

    What is small beside the linear part even where the energy is reach times a unit is left out: rounding, where u_2 takes
    all of it, as from the section forces of a cantilever.
    """
    at_unit = linear / np.sqrt(omega2)
    parts = [compressed(pairs[..., own, :], omega2, _largest(at_unit[..., own, :]) / reach) for own in groups]
    ranks = np.cumsum([0, *(part.shapes.shape[-1] for part in parts)])
    shapes = np.zeros((*pairs.shape[:-1], ranks[-1]))
    for own, part, first, last in zip(groups, parts, ranks, ranks[1:], strict=False):
        shapes[..., own, first:last] = part.shapes
    return QuadraticField(shapes, np.concatenate([part.weights for part in parts]))


def reach_of(points: Array, Phi: Array, omega2: Array) -> float:
    """sqrt(q . omega2 q) at which the points (P, 3) move by Phi q as far as they lie apart."""
    return float(np.ptp(points, axis=0).max()) / (_largest(Phi / np.sqrt(omega2)) or 1.0)


def _largest(fields: Array) -> float:
    """The largest value (..., c, n) that the fields take together."""
    return float(np.sqrt(np.einsum("...ci,...ci->...", fields, fields).max(initial=0.0)))


def values(field: QuadraticField, q: Array) -> Array:
    """(..., S) -> the field at elastic coordinates q (..., n): its places and components after the axes of q."""
    amplitudes = np.einsum("...i,rij,...j->...r", q, field.weights, q, optimize=True) / 2
    return np.tensordot(amplitudes, field.shapes, (-1, -1))


def pair_values(field: QuadraticField, places: Array) -> Array:
    """(k, c, n, n) the fields u_ij of  sum_ij q_i q_j u_ij / 2  at some places (k,) along the first axis."""
    return np.tensordot(field.shapes[places], field.weights, 1)


def recoordinated(field: QuadraticField, V: Array) -> QuadraticField:
    """The field for other elastic coordinates p (m,), with q = V p."""
    return QuadraticField(field.shapes, V.T @ field.weights @ V)


def displacements(surface: Surface, q: Array) -> Array:
    """(..., P, 3) displacements Phi q + u_2 [m] of the surface points at elastic coordinates q (..., n) [m sqrt(kg)]."""
    first = np.tensordot(q, surface.Phi, (-1, -1))
    return first if surface.second is None else first + values(surface.second, q)


def at_places(field: QuadraticField, places: Any) -> QuadraticField:
    """The field at some of its places, which index its first axes."""
    return replace(field, shapes=field.shapes[places])


def linear_surface(surface: Surface) -> Surface:
    """The surface without its second order, as bodies have it that are computed linearly."""
    beams = surface.beams and replace(surface.beams, second=None)
    return replace(surface, second=None, second_stress=None, beams=beams)


def some_points(surface: Surface, places: Array, triangles: Array) -> Surface:
    """Some points (k,) of the surface with other triangles (T, 3) between them; without section forces."""
    stress, moduli = (None if of is None else of[places] for of in (surface.stress, surface.moduli))
    second, second_stress = (of and at_places(of, places) for of in (surface.second, surface.second_stress))
    return Surface(surface.points[places], triangles, surface.Phi[places], stress, moduli, None, second, second_stress)
