"""How far faces are from what a query asks for."""

from __future__ import annotations

import fnmatch
from collections.abc import Sequence

import numpy as np

from ffr_prep.common.arrays import Array
from ffr_prep.mesh.geometry.face import HALF_TURN, Face
from ffr_prep.mesh.geometry.faces import Faces
from ffr_prep.mesh.geometry.region_words import Query

_SAME, _TYPED = 1e-4, 1e-5  # within which a radius and a place that were typed are met, relatively
_TURNED = 1e-3  # the same of directions [rad]


def fitting(faces: Faces, query: Query) -> Array:
    """(k,) the numbers of the faces that a query fits, without regard to what is near."""
    return np.flatnonzero(misfits(faces, query) <= 1)


def misfits(faces: Faces, query: Query) -> Array:
    """(F,) how far each face is from what is asked: at most 1 where it fits, infinite for another kind."""
    table, near = faces.table, faces.tolerance * faces.size
    wrong = table.inner | (table.colour != query.colour if query.colour else False)
    if query.kind != "face":
        wrong = wrong | (table.kind != kind_of(query))
    if query.kind == "bore":
        wrong = wrong | (table.hollow == 0) | (faces.arcs < HALF_TURN)
    if query.solid:
        wrong = wrong | ~np.array([of_solid(face, query.solid) for face in faces.faces], bool)
    parts = [np.where(wrong, np.inf, 0.0)]
    if query.radius is not None:
        off = np.abs(table.radius - query.radius) / max(_SAME * query.radius, near)
        parts.append(np.where(table.kind == "cone", np.inf, off))
    parts += [_turned(faces, query.normal, True), _turned(faces, query.axis, False)]
    if query.through is not None:
        parts.append(across(faces, *query.through) / max(near, _TYPED * abs(query.through[1])))
    if query.at is not None:
        parts.append(off_surface(faces, query.at) / near)
    return np.asarray(np.max(np.nan_to_num(parts, nan=np.inf), axis=0))


def of_solid(face: Face, name: str) -> bool:
    """Whether the face belongs to a solid of this name, which may be a pattern, or that of all instances of a part."""
    known = [word for solid in face.solids for word in (solid, solid.rpartition("#")[0])]
    return any(fnmatch.fnmatchcase(word, name) for word in known)


def kind_of(query: Query) -> str:
    """The kind of surface that it asks for."""
    return "cylinder" if query.kind == "bore" else query.kind


def _turned(faces: Faces, wanted: Sequence[float] | None, signed: bool) -> Array:
    """How far normals (signed, of planes) or axes (of others) are from a direction."""
    if wanted is None:
        return np.zeros(len(faces))
    table, unit = faces.table, np.array(wanted) / np.linalg.norm(wanted)
    wrong = (table.kind == "plane") != signed
    if signed:
        wrong = wrong | (table.axis @ unit < 0)
    return np.where(wrong, np.inf, np.linalg.norm(np.cross(unit, table.axis), axis=1) / _TURNED)


def across(faces: Faces, axis: int, place: float) -> Array:
    """(F,) [m] how far planes across an axis of coordinates are from a place on it; infinite for other faces."""
    table = faces.table
    tilt = np.linalg.norm(np.delete(table.axis, axis, axis=1), axis=1)
    return np.where((table.kind == "plane") & (tilt <= _TURNED), np.abs(table.point[:, axis] - place), np.inf)


def off_surface(faces: Faces, point: Sequence[float]) -> Array:
    """(F,) [m] distance of a point from planes, from axes, from centres; NaN for other faces."""
    table = faces.table
    arm = np.array(point) - table.point
    from_axis = np.linalg.norm(np.cross(arm, table.axis), axis=1)
    off = np.where(table.kind == "plane", np.abs((arm * table.axis).sum(axis=1)), np.linalg.norm(arm, axis=1))
    return np.where(np.isin(table.kind, ("cylinder", "cone")), from_axis, off)


def nearest(faces: Faces, chosen: Array, point: Array) -> Array:
    """(k,) [m] distances of a point from chosen faces, at least where they are near the smallest of them."""
    table = faces.table
    boxes = np.linalg.norm(np.maximum(0, np.maximum(table.low[chosen] - point, point - table.high[chosen])), axis=1)
    found, best = boxes + faces.size, np.inf
    for k in np.argsort(boxes, kind="stable"):
        if boxes[k] > best + faces.tolerance * faces.size:
            break
        found[k] = _from_triangles(faces.points[faces.triangles[chosen[k]]], point)
        best = min(best, found[k])
    return found


def _from_triangles(corners: Array, point: Array) -> float:
    """Distance of a point from triangles (T, 3, 3) [m]."""
    a, b, c = np.moveaxis(corners, 1, 0)
    normal = np.cross(b - a, c - a)
    length = np.maximum(np.linalg.norm(normal, axis=1), np.finfo(float).tiny)
    height = ((point - a) * normal).sum(axis=1) / length
    foot = point - height[:, None] * normal / length[:, None]
    inside = np.ones(len(a), bool)
    edges = np.full(len(a), np.inf)
    for p, q in ((a, b), (b, c), (c, a)):
        along = q - p
        inside &= (np.cross(along, foot - p) * normal).sum(axis=1) >= 0
        share = ((point - p) * along).sum(axis=1) / np.maximum((along**2).sum(axis=1), np.finfo(float).tiny)
        edges = np.minimum(edges, np.linalg.norm(point - p - np.clip(share, 0, 1)[:, None] * along, axis=1))
    return float(np.where(inside, np.abs(height), edges).min())
