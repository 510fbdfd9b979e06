"""Which triangles of a body's surface a region of its mesh has: where pressures act."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.spatial import cKDTree

from ffr_prep.body import FlexibleBody
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.mesh.cells import FACE_TRIANGLES
from ffr_prep.mesh.geometry.skin import with_regions
from ffr_prep.mesh.mesh import Mesh, boundary_faces, face_group

_SAME = 1e-9  # of the size of the mesh


def region_triangles(mesh: Mesh, body: FlexibleBody, region: str) -> Array:
    """(m,) numbers of the triangles in `body.surface` that a region of its mesh has, ascending.

    region : a face group, or faces found by what they are, such as "plane z=10" or "cylinder r=6mm at 0,0,0"

    Raises InputError for a region that finds no face of the outside, and for the mesh of another body.

    top = region_triangles(mesh, plate, "plane z=10mm")
    wind = fd.Pressure("wind", "plate", 1e3, triangles=top)

    >>> wind = fd.Pressure("wind", "blade", pressure=2e3, triangles=fp.region_triangles(mesh, body, "suction_side"))
    """
    facets = face_group(with_regions(mesh, [region]), region)
    corners = np.concatenate([np.zeros((0, 3), np.int64), *_outer_triangles(mesh, facets)])
    if not len(corners):
        raise InputError(f"region {region!r} is nowhere on the outside of the body; choose faces that are")
    if body.surface is None:
        raise InputError(f"body {body.name!r} has no surface")
    tree = cKDTree(body.surface.points[body.surface.triangles].mean(axis=1))
    apart, numbers = tree.query(mesh.points[corners].mean(axis=1))
    if apart.max() > _SAME * np.ptp(mesh.points, axis=0).max():
        raise InputError(f"body {body.name!r} is not made of this mesh: its surface has other triangles")
    return np.unique(numbers)


def _outer_triangles(mesh: Mesh, facets: tuple[Array, ...]) -> Iterator[Array]:
    """(T, 3) nodes of the triangles of those faces of the outside that are among the facets, as the surface has them."""
    for faces in boundary_faces(mesh):
        wanted = {tuple(row) for of in facets if of.shape[1] == faces.shape[1] for row in np.sort(of, axis=1).tolist()}
        chosen = np.array([tuple(row) in wanted for row in np.sort(faces, axis=1).tolist()], bool)
        yield faces[chosen][:, FACE_TRIANGLES[faces.shape[1]]].reshape(-1, 3)
