"""A mesh as its file has it: the form that all readers deliver."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.mesh.cells import KINDS


@dataclass(frozen=True)
class DrawnFace:
    """A face of a geometry as its file has it, numbers in the unit of the file.

    name    : such as surface_5
    kind    : of its surface: plane, cylinder, cone, sphere, torus, or another word
    numbers : of the surface. Plane: a, b, c, d of a x + b y + c z + d = 0. Cylinder: point, axis, radius. Cone: point, axis,
              radius there, half the angle. Sphere: centre, radius. Torus: centre, axis, both radii
    exact   : area and centroid, where the CAD library knows them; else empty
    label, colour : that it has in the file, or ""; the colour as #rrggbb
    groups, solids : that it belongs to
    corners : (T, 3) and (Q, 4) corners of its triangles and quadrilaterals
    """

    name: str
    kind: str
    numbers: Sequence[float]
    exact: Sequence[float]
    label: str
    colour: str
    groups: Sequence[str]
    solids: Sequence[str]
    corners: tuple[Array, ...]


@dataclass(frozen=True)
class FileSolid:
    """A solid of a CAD file: its volume, its centre (3,) and its inertia (3, 3) about that at density one."""

    name: str
    label: str
    volume: float
    centre: Array
    inertia: Array


@dataclass(frozen=True)
class FileSkin:
    """The faces of a geometry's solids, meshed: points (N, 3), faces, the solids that the CAD library knows, the unit.

    overlaps : names of two solids that share a volume, and that volume, where it is asked for
    notes    : what was left out, in words
    """

    points: Array
    drawn: tuple[DrawnFace, ...]
    solids: tuple[FileSolid, ...]
    unit: str | None
    overlaps: tuple[tuple[str, str, float], ...] = ()
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class FileMesh:
    """A mesh as it is in a file, numbers in the unit of the file.

    points  : (N, 3)
    blocks  : volume elements by kind, (kind, nodes (E, k)), in the node order of `ffr_prep.mesh.cells`
    volumes : name -> (m,) element numbers, counted through the blocks
    faces   : name -> corners (F, 3) or (F, 4) of faces; the volume elements know the rest of their faces
    nodes   : name -> node indices
    notes   : what was left out or changed, in words
    unit    : of the numbers, where the file declares one
    drawn   : the faces of the geometry that the mesh was made of, where there was one

    >>> mesh = fp.FileMesh(points, (("tetra", cells),), {}, {}, {})  # what a reader of a mesh format returns
    """

    points: Array
    blocks: tuple[tuple[str, Array], ...]
    volumes: Mapping[str, Array]
    faces: Mapping[str, tuple[Array, ...]]
    nodes: Mapping[str, Array]
    notes: tuple[str, ...] = ()
    unit: str | None = None
    drawn: tuple[DrawnFace, ...] = ()


def supported_kind(kind: str, name: str) -> str:
    """The kind, if it is one of ours; InputError for others, called `name` in the file."""
    if kind not in KINDS:
        raise InputError(
            f"the mesh has volume elements of kind {name!r}; only {', '.join(KINDS)} can be used: mesh again with "
            "tetrahedra, hexahedra, wedges or pyramids of first or second order"
        )
    return kind
