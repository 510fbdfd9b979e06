"""The faces of a body as arrays, so that questions to thousands of them take no time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ffr_prep.common.arrays import Array
from ffr_prep.mesh.geometry.face import Face

_ANGLE = 1e-3  # within which directions are the same [rad]
_GAP = 1.1  # [rad] between neighbours around an axis: coarse meshes have six points to the turn
_NOWHERE = np.full(3, np.nan)


@dataclass(frozen=True)
class FaceTable:
    """F faces: kind, colour (F,); axis, point (F, 3), radius, minor, hollow (F,), NaN where there is none; inner (F,);
    surface (F,): a number for each plane, cylinder, ...; low, high (F, 3): the box around each [m]."""

    kind: Array
    colour: Array
    axis: Array
    point: Array
    radius: Array
    minor: Array
    hollow: Array
    inner: Array
    surface: Array
    low: Array
    high: Array


def face_table(faces: Sequence[Face], points: Array, triangles: Sequence[Array], near: float) -> FaceTable:
    """The table; surfaces are the same to within a length [m]."""
    columns: dict[str, Any] = {
        "kind": np.array([face.kind for face in faces]),
        "colour": np.array([face.colour for face in faces]),
        "axis": np.array([_NOWHERE if face.axis is None else face.axis for face in faces]).reshape(-1, 3),
        "point": np.array([_NOWHERE if face.point is None else face.point for face in faces]).reshape(-1, 3),
        "inner": np.array([face.inner for face in faces], bool),
    }
    for name in ("radius", "minor", "hollow"):
        values = [getattr(face, name) for face in faces]
        columns[name] = np.array([np.nan if value is None else float(value) for value in values])
    surface = _surfaces(**{k: columns[k] for k in ("kind", "axis", "point", "radius", "minor", "inner")}, near=near)
    low = np.array([points[own].min(axis=(0, 1)) for own in triangles]).reshape(-1, 3)
    high = np.array([points[own].max(axis=(0, 1)) for own in triangles]).reshape(-1, 3)
    return FaceTable(**columns, surface=surface, low=low, high=high)


def _surfaces(kind: Array, axis: Array, point: Array, radius: Array, minor: Array, inner: Array, near: float) -> Array:
    """(F,) a number for each surface: faces whose numbers are the same lie on one, "other" ones each on its own."""
    pairs = [np.zeros((0, 2), np.int64)]
    at = point - (np.nanmean(point, axis=0) if np.isfinite(point).any() else 0.0)
    foot = at - (at * axis).sum(axis=1)[:, None] * axis
    turned = (axis[:, :, None] * axis[:, None, :]).reshape(-1, 9) * near / _ANGLE
    numbers = {
        "plane": [turned, at - foot],
        "cylinder": [turned, foot, radius[:, None]],
        "sphere": [at, radius[:, None]],
        "cone": [turned, at, radius[:, None] * near / _ANGLE],
        "torus": [turned, at, radius[:, None], minor[:, None]],
    }
    for word, columns in numbers.items():
        for side in (False, True):
            of = np.flatnonzero((kind == word) & (inner == side) & np.isfinite(np.hstack(columns)).all(axis=1))
            if of.size:
                pairs.append(of[cKDTree(np.hstack(columns)[of]).query_pairs(near, output_type="ndarray")])
    return _joined(np.concatenate(pairs), len(kind))


def features_of(table: FaceTable, points: Array, triangles: Sequence[Array]) -> tuple[tuple[int, ...], ...]:
    """The faces of each feature: those of one surface that share a point, directly or through others."""
    if not triangles:
        return ()
    nodes = _merged(points)
    touched = [np.unique(nodes[own]) for own in triangles]
    owner = np.repeat(np.arange(len(touched)), [len(own) for own in touched])
    shape = (len(touched), int(nodes.max()) + 1)
    use = sp.coo_array((np.ones(owner.size), (owner, np.concatenate(touched))), shape).tocsr()
    pairs = sp.coo_array(use @ use.T)
    same = table.surface[pairs.row] == table.surface[pairs.col]
    part = _joined(np.stack([pairs.row[same], pairs.col[same]], axis=1), len(touched))
    order = np.argsort(part, kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(part[order])) + 1)
    return tuple(tuple(of.tolist()) for of in sorted(groups, key=lambda of: int(of[0])))


def arcs_of(table: FaceTable, features: Sequence[Sequence[int]], points: Array, triangles: Sequence[Array]) -> Array:
    """(F,) how far the feature of each cylinder goes around its axis [rad]; NaN of other faces."""
    found = np.full(len(table.kind), np.nan)
    for feature in features:
        first = feature[0]
        if table.kind[first] == "cylinder" and np.isfinite(table.axis[first]).all():
            own = points[np.unique(np.concatenate([triangles[k].ravel() for k in feature]))]
            found[list(feature)] = _arc(own - table.point[first], table.axis[first])
    return found


def _arc(arms: Array, axis: Array) -> float:
    """The angle about an axis that points around it span; the whole turn where they are nowhere far apart."""
    across = np.linalg.svd(axis[None])[2][1:]
    angles = np.sort(np.arctan2(*(arms @ across.T).T))
    gap = float(np.diff(angles, append=angles[0] + 2 * np.pi).max())
    return 2 * np.pi if gap < _GAP else 2 * np.pi - gap


def _joined(pairs: Array, count: int) -> Array:
    """(count,) a number for each set of what pairs join."""
    graph = sp.coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), (count, count))
    return np.asarray(connected_components(graph, directed=False)[1])


def _merged(points: Array) -> Array:
    """(P,) a number for each point, the same where points coincide: solids that touch without sharing have two."""
    scale = float(np.ptp(points, axis=0).max()) or 1.0
    return np.asarray(np.unique(np.round(points / (1e-7 * scale)), axis=0, return_inverse=True)[1]).ravel()
