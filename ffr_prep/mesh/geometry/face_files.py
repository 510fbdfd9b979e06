"""The faces of a part from its file: a CAD file, a script of gmsh, or a mesh."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ffr_prep.common.arrays import Array
from ffr_prep.common.reading import reading
from ffr_prep.mesh.file_mesh import FileSkin
from ffr_prep.mesh.formats import format_of
from ffr_prep.mesh.geometry.drawn import face_of
from ffr_prep.mesh.geometry.face import METRES
from ffr_prep.mesh.geometry.faces import SHOWN, Faces
from ffr_prep.mesh.geometry.regions import found, query_for
from ffr_prep.mesh.geometry.skin import mesh_faces
from ffr_prep.mesh.gmsh_files import skin_from_gmsh
from ffr_prep.mesh.mesh import cad_settings, check_request, doubtful_unit, facet_triangles, read_mesh

_RAY = np.array([0.5773, 0.2113, 0.7887]) / np.linalg.norm([0.5773, 0.2113, 0.7887])  # in no plane that a part may have
_ITSELF = 1e-9  # of the size, within which a ray meets the triangle that it starts from


def faces(
    path: str | Path,
    *,
    unit: str | None = None,
    size: float | None = None,
    numbers: Mapping[str, float] | None = None,
    glue: bool = False,
    solids: Sequence[str] = (),
) -> Faces:
    """The faces of a part: what surface each lies on, where, how large; arguments as of `read_mesh`.

        for face in fp.faces("part.step").faces:
            print(face.name, face.kind, face.centre, face.radius)

    Faces of a geometry are those that its file has, and are exact. Those of a mesh are recognised on its skin: planes,
    cylinders and spheres, none of which reaches over the border of a group of the mesh. All lengths are in metres.

    Raises InputError for a file that cannot be used, ComputationError where it cannot be meshed.

    >>> print(fp.faces("plate.step"))
    """
    path, numbers = Path(path), dict(numbers or {})
    check_request(path, unit, size, numbers, None)
    settings = cad_settings(path, glue=glue, solids=solids)
    if not format_of(path).geometry:
        made = mesh_faces(read_mesh(path, unit=unit))
    else:
        with reading(path, "a geometry"):
            made = skin_faces(skin_from_gmsh(path, unit=unit, size=size, numbers=numbers, **settings))
    return replace(made, typed=tuple(query_for(made, feature) for feature in made.features[:SHOWN]))


def found_faces(faces: Faces, region: str) -> tuple[str, ...]:
    """The names of the faces that a region means, such as "cylinder r=6mm at 0,0,0" or "surface_1..4".

        fp.found_faces(fp.faces("part.step"), "plane z=0")     # ("surface_5",)

    What may be written is told by `ffr-prep faces --help`; numbers without a unit are in that of the file. Raises InputError
    for a region that means nothing, or several surfaces without saying "all".

    >>> fp.found_faces(fp.faces("plate.step"), "cylinder r=6mm at 45,25,5")
    """
    return tuple(faces.faces[k].name for k in found(faces, region))


def skin_faces(skin: FileSkin) -> Faces:
    """The faces of a meshed skin, in metres, with triangles that point outside."""
    scale = METRES[skin.unit or "m"]
    points = skin.points * scale
    triangles = _outward(
        points, [facet_triangles(face.corners) for face in skin.drawn], [face.solids for face in skin.drawn]
    )
    made = [face_of(face, scale, points, own) for face, own in zip(skin.drawn, triangles, strict=True)]
    notes = (*skin.notes, *doubtful_unit(float(np.ptp(points, axis=0).max()), skin.unit))
    return Faces(tuple(made), points, tuple(triangles), unit=skin.unit or "m", notes=notes)


def _outward(points: Array, triangles: Sequence[Array], solids: Sequence[Sequence[str]]) -> list[Array]:
    """The triangles of faces, turned where they point into their solid: a ray from there leaves it an odd number of times.

    Faces between two solids stay as they are.
    """
    bounding: dict[str, list[Array]] = {solid: [] for of in solids for solid in of}
    for own, of in zip(triangles, solids, strict=True):
        for solid in of:
            bounding[solid].append(own)
    rays = {solid: _Rays(points, np.concatenate(parts)) for solid, parts in bounding.items()}
    inside = [
        len(of) == 1 and _points_inside(points, own, rays[of[0]]) for own, of in zip(triangles, solids, strict=True)
    ]
    return [own[:, ::-1] if turned else own for own, turned in zip(triangles, inside, strict=True)]


class _Rays:
    """Triangles as rays along _RAY see them: their corners (T, 3, 3), two across and one along, and their boxes across."""

    def __init__(self, points: Array, triangles: Array) -> None:
        axes = np.vstack([np.linalg.svd(_RAY[None])[2][1:], _RAY])
        self.axes, self.corners = axes, (points @ axes.T)[triangles]
        self.low, self.high = self.corners[..., :2].min(axis=1), self.corners[..., :2].max(axis=1)

    def heights(self, start: Array) -> Array:
        """(k,) [m] where the line through a point meets triangles, measured from the point."""
        at = self.axes @ start
        near = ((self.low <= at[:2]) & (at[:2] <= self.high)).all(axis=1)
        a, b, c = np.moveaxis(self.corners[near] - at, 1, 0)
        double = _cross(b - a, c - a)
        with np.errstate(divide="ignore", invalid="ignore"):
            u, v, w = _cross(b, c) / double, _cross(c, a) / double, _cross(a, b) / double
            height = u * a[:, 2] + v * b[:, 2] + w * c[:, 2]
        return np.asarray(height[(u >= 0) & (v >= 0) & (w >= 0)])


def _cross(a: Array, b: Array) -> Array:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def _points_inside(points: Array, own: Array, rays: _Rays) -> bool:
    """Whether the largest triangle of a face has its normal towards the inside of what the triangles enclose."""
    a, b, c = np.moveaxis(points[own], 1, 0)
    normals = np.cross(b - a, c - a)
    k = int(np.argmax((normals**2).sum(axis=1)))
    heights = rays.heights((a[k] + b[k] + c[k]) / 3) * np.sign(_RAY @ normals[k] or 1.0)
    return bool(np.sum(heights > _ITSELF * np.ptp(points, axis=0).max()) % 2)
