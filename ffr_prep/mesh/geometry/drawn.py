"""Faces of a geometry, from the numbers that its file has for their surfaces."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ffr_prep.common.arrays import Array
from ffr_prep.mesh.file_mesh import DrawnFace
from ffr_prep.mesh.geometry.face import KINDS, Face
from ffr_prep.mesh.geometry.faces import measures, oriented_axis, with_side
from ffr_prep.mesh.geometry.fits import recognised

_EXACT = (
    1e-6  # of the size of a face, within which points of a free-form surface lie on a plane, a cylinder or a sphere
)


def face_of(drawn: DrawnFace, scale: float, points: Array, triangles: Array) -> Face:
    """The face of a geometry; points (P, 3) [m] and triangles (T, 3) of it, which point outside; scale to metres."""
    centre, area, normal = measures(points, triangles)
    if len(drawn.exact):
        area, centre = drawn.exact[0] * scale**2, np.array(drawn.exact[1:]) * scale
    face = Face(
        drawn.name, drawn.kind if drawn.kind in KINDS else "other", centre, area,
        label=drawn.label, colour=drawn.colour, groups=tuple(drawn.groups), solids=tuple(drawn.solids),
        exact=len(drawn.exact) > 0,
    )  # fmt: skip
    given = np.asarray(drawn.numbers, float)
    read = _READERS.get(drawn.kind)
    if read is None or given.size < read[1] or not np.isfinite(given).all():
        return recognised(replace(face, kind="other"), points, triangles, _EXACT)
    return with_side(replace(face, **read[0](given, scale, centre, normal)), points, triangles)


def _plane(given: Array, _: float, centre: Array, normal: Array) -> dict[str, Any]:
    """A plane, whose centroid lies on it; the sign of its last number is not that of all kernels."""
    axis = given[:3] / np.linalg.norm(given[:3])
    return {"point": centre, "axis": axis * (1.0 if axis @ normal >= 0 else -1.0) + 0.0}


def _round(given: Array, scale: float, centre: Array, _: Array) -> dict[str, Any]:
    """A cylinder; its point is moved along the axis to the middle of the face."""
    axis = oriented_axis(given[3:6])
    start = given[:3] * scale
    return {"point": start + ((centre - start) @ axis) * axis, "axis": axis, "radius": given[6] * scale}


def _cone(given: Array, scale: float, _: Array, __: Array) -> dict[str, Any]:
    tip = given[:3] * scale - given[3:6] * (given[6] * scale / np.tan(given[7]))
    return {"point": tip, "axis": oriented_axis(given[3:6]), "radius": abs(given[7])}


def _sphere(given: Array, scale: float, _: Array, __: Array) -> dict[str, Any]:
    return {"point": given[:3] * scale, "radius": given[3] * scale}


def _torus(given: Array, scale: float, _: Array, __: Array) -> dict[str, Any]:
    return {
        "point": given[:3] * scale,
        "axis": oriented_axis(given[3:6]),
        "radius": given[6] * scale,
        "minor": given[7] * scale,
    }


_READERS = {
    "plane": (_plane, 4),
    "cylinder": (_round, 7),
    "cone": (_cone, 8),
    "sphere": (_sphere, 4),
    "torus": (_torus, 8),
}
