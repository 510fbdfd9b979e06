"""Faces of a body: what surface each lies on, where, how large, and which faces are one surface.

A *feature* is what a user sees as one thing: the faces of one plane, cylinder, ... that hang together, such as a bore that
its file has as four faces.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ffr_prep.common.arrays import Array
from ffr_prep.common.brief import Brief, Rows, numbers
from ffr_prep.mesh.geometry.face import HALF_TURN, METRES, Face
from ffr_prep.mesh.geometry.face_table import FaceTable, arcs_of, face_table, features_of

SHOWN = 60  # features that a table has


@dataclass(frozen=True, repr=False)
class Faces(Brief):
    """The faces of a body with their triangles, in metres.

    faces     : all of them
    points    : (P, 3) [m]
    triangles : for each face (T, 3) indices into points, counter-clockwise seen from outside
    unit      : in which the file has its lengths, in which they are shown and typed: "m", "cm", "mm" or "in"
    tolerance : within which places and radii are the same, of the size of the body [1]
    notes     : what is to be known, in words
    typed     : what to type for each of the first features, as the table shows it
    size      : the diagonal of the box around all [m]
    features  : the numbers of the faces of each feature
    table     : the faces as arrays
    arcs      : (F,) how far the feature of a cylinder goes around its axis [rad]; NaN of other faces

    >>> faces = fp.faces("plate.step")
    """

    faces: tuple[Face, ...]
    points: Array
    triangles: tuple[Array, ...]
    unit: str = "m"
    tolerance: float = 1e-5
    notes: tuple[str, ...] = ()
    typed: tuple[str, ...] = ()
    size: float = field(init=False)
    features: tuple[tuple[int, ...], ...] = field(init=False)
    table: FaceTable = field(init=False)
    arcs: Array = field(init=False)

    def __post_init__(self) -> None:
        size = float(np.linalg.norm(np.ptp(self.points, axis=0))) if len(self.points) else 0.0
        object.__setattr__(self, "size", size)
        table = face_table(self.faces, self.points, self.triangles, self.tolerance * self.size)
        object.__setattr__(self, "table", table)
        features = features_of(table, self.points, self.triangles)
        object.__setattr__(self, "features", features)
        object.__setattr__(self, "arcs", arcs_of(table, features, self.points, self.triangles))

    def __len__(self) -> int:
        return len(self.faces)

    def _title(self) -> str:
        return f"{len(self.faces)} faces, {len(self.features)} features"

    def _rows(self) -> Rows:
        words = [feature_in_words(self, of) for of in self.features[:SHOWN]]
        told = [f"{typed}  ({text})" for typed, text in zip(self.typed, words, strict=False)] or words
        rows = [(self.faces[of[0]].name, text) for of, text in zip(self.features, told, strict=False)]
        left = len(self.features) - SHOWN
        return [*rows, ("...", f"{left} more")] if left > 0 else rows


# ---- measures -----------------------------------------------------------------------------------------------------


def with_side(face: Face, points: Array, triangles: Array) -> Face:
    """The face with whether it is hollow, which its triangles tell that point outside."""
    if face.kind not in ("cylinder", "cone", "sphere", "torus") or face.point is None:
        return face
    middle = points[triangles].mean(axis=1)
    arm = middle - face.point
    if face.axis is not None:
        arm -= (arm @ face.axis)[:, None] * face.axis
    if face.kind == "torus" and face.radius is not None:
        arm = middle - face.point - face.radius * arm / np.linalg.norm(arm, axis=1)[:, None]
    return replace(face, hollow=bool((arm * normals_of(points, triangles)).sum() < 0))


def oriented_axis(axis: Array) -> Array:
    """The axis without a sign: its largest component, the last of equal ones, is positive."""
    unit = axis / np.linalg.norm(axis)
    sizes = np.round(np.abs(unit), 6)
    return np.asarray(unit * np.sign(unit[2 - int(np.argmax(sizes[::-1]))]) + 0.0)


def measures(points: Array, triangles: Array) -> tuple[Array, float, Array]:
    """Centroid (3,) [m], area [m^2] and mean unit normal (3,) of triangles."""
    normals = normals_of(points, triangles)
    areas = np.linalg.norm(normals, axis=1)
    area = float(areas.sum())
    total = normals.sum(axis=0)
    centre = areas @ points[triangles].mean(axis=1) / area if area else points[triangles[:, 0]].mean(axis=0)
    return centre, area, total / max(float(np.linalg.norm(total)), np.finfo(float).tiny)


def normals_of(points: Array, triangles: Array) -> Array:
    """(T, 3) normals of the length of the area."""
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    return np.asarray(np.cross(b - a, c - a) / 2)


# ---- in words -------------------------------------------------------------------------------------------------------


def feature_centre(of: Faces, feature: Sequence[int]) -> tuple[Array, float]:
    """Centroid (3,) [m] and area [m^2] of several faces."""
    areas = np.array([of.faces[k].area for k in feature])
    return areas @ np.array([of.faces[k].centre for k in feature]) / areas.sum(), float(areas.sum())


def feature_in_words(of: Faces, feature: Sequence[int]) -> str:
    """Kind, size and place of a feature in the unit of the file, and the names of its faces if there are several."""
    centre, area = feature_centre(of, feature)
    scale, first = METRES[of.unit], of.faces[feature[0]]
    names = f"; {'+'.join(of.faces[k].name for k in feature)}" if len(feature) > 1 else ""
    at = numbers(tidy(centre / scale, of.size / scale))
    solids = f", of {', '.join(solids_of(of, feature))}" if several_solids(of) and not first.inner else ""
    return f"{surface_in_words(of, feature[0])}{solids}, centre {at} {of.unit}, area {area / scale**2:.5g} {of.unit}²{names}"


def several_solids(of: Faces) -> bool:
    """Whether the faces are those of several solids, so that each has to tell its own."""
    return len({solid for face in of.faces for solid in face.solids}) > 1


def solids_of(of: Faces, feature: Sequence[int]) -> tuple[str, ...]:
    """The names of the solids that a feature belongs to."""
    return tuple(dict.fromkeys(solid for k in feature for solid in of.faces[k].solids))


def surface_in_words(of: Faces, number: int) -> str:
    """Such as "bore r 6, axis (0, 0, 1)" of the face of a number, lengths in the unit of the file."""
    scale, face = METRES[of.unit], of.faces[number]
    if face.inner:
        return f"{face.kind} between {' and '.join(face.solids)}"
    word, arc = face.kind, float(of.arcs[number])
    if face.kind == "cylinder" and face.hollow:
        word = "bore" if arc >= HALF_TURN else "concave cylinder"
    if face.kind == "cone" and face.radius is not None:
        return f"{word} {np.degrees(face.radius):.5g}°, axis {direction(face)}"
    if face.radius is not None:
        word += f" r {face.radius / scale:.6g}" + (f" and {face.minor / scale:.6g}" if face.minor is not None else "")
    if arc < 2 * np.pi:
        word += f" over {np.degrees(arc):.0f}°"
    if face.axis is None:
        return word
    return f"{word}, {'normal' if face.kind == 'plane' else 'axis'} {direction(face)}"


def direction(face: Face) -> str:
    """The axis or normal, such as (0, 0, 1)."""
    return numbers(tidy(face.axis, 1.0)) if face.axis is not None else ""


def tidy(values: Any, size: float) -> Array:
    """Values rounded to some 1e-5 of a size."""
    digits = 5 - int(np.floor(np.log10(size))) if size > 0 else 12
    return np.round(np.asarray(values, float), digits) + 0.0
