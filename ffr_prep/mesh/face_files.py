"""The faces of a part from its file: a CAD file, a script of gmsh, or a mesh."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from ffr_prep.common.arrays import Array
from ffr_prep.common.reading import reading
from ffr_prep.mesh.drawn import face_of
from ffr_prep.mesh.faces import METRES, Faces
from ffr_prep.mesh.file_mesh import FileSkin
from ffr_prep.mesh.formats import format_of
from ffr_prep.mesh.gmsh_files import skin_from_gmsh
from ffr_prep.mesh.mesh import cad_settings, check_request, doubtful_unit, facet_triangles, read_mesh
from ffr_prep.mesh.regions import found
from ffr_prep.mesh.skin import mesh_faces

_RAY = np.array([0.5773, 0.2113, 0.7887])  # along no plane that a part is likely to have


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
    """
    path, numbers = Path(path), dict(numbers or {})
    check_request(path, unit, size, numbers, 1)
    settings = cad_settings(path, glue=glue, solids=solids)
    if not format_of(path).geometry:
        return mesh_faces(read_mesh(path, unit=unit))
    with reading(path, "a geometry"):
        skin = skin_from_gmsh(path, unit=unit, size=size, numbers=numbers, **settings)
    return skin_faces(skin)


def found_faces(faces: Faces, region: str) -> tuple[str, ...]:
    """The names of the faces that a region means, such as "cylinder r=6mm at 0,0,0" or "surface_1..4".

        fp.found_faces(fp.faces("part.step"), "plane z=0")     # ("surface_5",)

    What may be written is told by `ffr-prep faces --help`; numbers without a unit are in that of the file. Raises InputError
    for a region that means nothing, or several surfaces without saying "all".
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
    notes = doubtful_unit(float(np.ptp(points, axis=0).max()), skin.unit)
    return Faces(tuple(made), points, tuple(triangles), unit=skin.unit or "m", notes=tuple(notes))


def _outward(points: Array, triangles: Sequence[Array], solids: Sequence[Sequence[str]]) -> list[Array]:
    """The triangles of faces, turned where they point into their solid: a ray from there leaves it an odd number of times.

    Faces between two solids stay as they are.
    """
    bounding: dict[str, list[Array]] = {solid: [] for of in solids for solid in of}
    for own, of in zip(triangles, solids, strict=True):
        for solid in of:
            bounding[solid].append(own)
    whole = {solid: np.concatenate(parts) for solid, parts in bounding.items()}
    inside = [
        len(of) == 1 and _points_inside(points, own, whole[of[0]]) for own, of in zip(triangles, solids, strict=True)
    ]
    return [own[:, ::-1] if turned else own for own, turned in zip(triangles, inside, strict=True)]


def _points_inside(points: Array, own: Array, bounding: Array) -> bool:
    """Whether the largest triangle of a face has its normal towards the inside of what the bounding triangles enclose."""
    a, b, c = np.moveaxis(points[own], 1, 0)
    normals = np.cross(b - a, c - a)
    k = int(np.argmax((normals**2).sum(axis=1)))
    start = (a[k] + b[k] + c[k]) / 3
    ray = _RAY * np.sign(_RAY @ normals[k] or 1.0)
    a, b, c = np.moveaxis(points[bounding[(bounding != own[k]).any(axis=1)]], 1, 0)
    across = np.cross(ray, c - a)
    volume = ((b - a) * across).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        u = ((start - a) * across).sum(axis=1) / volume
        v = (ray * np.cross(start - a, b - a)).sum(axis=1) / volume
        t = ((c - a) * np.cross(start - a, b - a)).sum(axis=1) / volume
    return bool(np.sum((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)) % 2)
