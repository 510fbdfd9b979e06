"""Fields on a surface that move, as few shapes with histories: what a page needs of elastic coordinates.

A field sum_j X_j h_j(t) of shapes X (P, c, m) and histories h (T, m) is replaced by its best approximation with k shapes, by
a singular value decomposition of all that it does (proper orthogonal decomposition; Sirovich 1987): a motion of fourteen
modes is often one of four. Shapes are rounded to 16-bit whole numbers, each with its own scale.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ffr_prep.body import QuadraticField
from ffr_prep.common.arrays import Array

MOST_SHAPES, MOST_TENSORS = 60, 40  # as in web/numbers.js: what a vertex shader has room for
_LEFT_OUT = 1e-4  # of the size of a field, over its surface and all times, that shapes left out may have
_LARGEST = 32767


@dataclass(frozen=True, eq=False)
class Morph:
    """Shapes (P, c, k) as whole numbers of scales (k,), in the field's unit, and their histories (T, k)."""

    shapes: Array
    scales: Array
    weights: Array


def morph(shapes: Array, weights: Array, most: int) -> Morph:
    """The field of shapes (P, c, m) with histories (T, m), by at most `most` shapes."""
    flat = shapes.reshape(shapes.shape[0] * shapes.shape[1], shapes.shape[2])
    size, directions = np.linalg.eigh(flat.T @ flat)
    size = np.sqrt(np.maximum(size, 0.0))
    kept = size > 1e-9 * size.max(initial=0.0)
    root = size[kept, None] * directions[:, kept].T  # of flat^T flat: |flat h| = |root h|
    left, strengths, _ = np.linalg.svd(root @ weights.T, full_matrices=False)
    rest = np.sqrt(np.cumsum(strengths[::-1] ** 2)[::-1])
    k = min(most, int((rest > _LEFT_OUT * rest.max(initial=0.0)).sum()))
    back = directions[:, kept] / size[kept] @ left[:, :k]
    return _rounded((flat @ back).reshape(*shapes.shape[:-1], k), weights @ (root.T @ left[:, :k]))


def _rounded(shapes: Array, weights: Array) -> Morph:
    """With weights of at most one."""
    largest, sizes = np.abs(weights).max(axis=0, initial=0.0), np.abs(shapes).max(axis=(0, 1), initial=0.0)
    whole = np.round(shapes * (_LARGEST / np.where(sizes > 0, sizes, 1.0))).astype(np.int16)
    return Morph(whole, largest * sizes / _LARGEST, weights / np.where(largest > 0, largest, 1.0))


def beside(one: Morph, other: Morph) -> Morph:
    """The sum of two fields: the shapes of the first, then those of the second."""
    return Morph(
        np.concatenate([one.shapes, other.shapes], axis=2),
        np.concatenate([one.scales, other.scales]),
        np.concatenate([one.weights, other.weights], axis=1),
    )


def quadratic(field: QuadraticField | None, like: Array, q: Array) -> tuple[Array, Array]:
    """Shapes (P, c, r) and histories (T, r) of a field at elastic coordinates q (T, n); none where there is no field.

    like : (P, c, n), what is linear beside it
    """
    if field is None:
        return np.zeros((*like.shape[:-1], 0)), np.zeros((len(q), 0))
    return field.shapes, np.einsum("ti,rij,tj->tr", q, field.weights, q, optimize=True) / 2


def sharp_edges(points: Array, triangles: Array, angle: float = 30.0) -> Array:
    """(E, 2) the edges of a triangulated surface that are free, or where it bends by more than an angle [degrees]."""
    corners = points[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), np.finfo(float).tiny)
    ends = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges, at, count = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(at.ravel(), kind="stable") // 3
    first = np.cumsum(count) - count
    pairs = normals[order[first]], normals[order[np.minimum(first + 1, len(order) - 1)]]
    smooth = (count == 2) & (np.einsum("ei,ei->e", *pairs) >= np.cos(np.radians(angle)))
    return np.asarray(edges[~smooth], np.int64).reshape(-1, 2)


def is_closed(points: Array, triangles: Array) -> bool:
    """Whether a triangulated surface bounds a body, and all triangles are seen from outside in one sense of rotation."""
    ends = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    there, count = np.unique(ends, axis=0, return_counts=True)
    back, _ = np.unique(ends[:, ::-1], axis=0, return_counts=True)
    if not len(ends) or (count > 1).any() or not np.array_equal(there, back):
        return False
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return bool(np.einsum("ti,ti->", np.cross(a, b), c) > 0)
