"""Meshes: volume elements with named regions, read from a file, checked, seen from outside.

Everything is in metres: the unit of a file is converted once, on reading.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from ffr_prep.body import content_hash
from ffr_prep.common.arrays import Array, distinct
from ffr_prep.common.brief import Brief, Rows, listed
from ffr_prep.common.errors import InputError
from ffr_prep.common.in_words import extent_in_words
from ffr_prep.common.progress import Stages, no_stages
from ffr_prep.common.reading import check_ordinary, reading
from ffr_prep.common.registry import choice, loaded
from ffr_prep.mesh.boundary import (
    groups_of_whole_faces,
    joined_by_faces,
    joined_by_nodes,
    misfits,
    outer_faces,
    parts_and_overlaps,
)
from ffr_prep.mesh.cells import FACE_TRIANGLES, KINDS, face_corners
from ffr_prep.mesh.file_mesh import DrawnFace, FileMesh
from ffr_prep.mesh.formats import MOST_ELEMENTS, format_of
from ffr_prep.mesh.geometry.drawn import face_of
from ffr_prep.mesh.geometry.face import METRES, Face
from ffr_prep.mesh.open_joints import nodes_on_edges

_CHUNK = 4096
_DEGENERATE = 1e-10
_COINCIDENT = 1e-9
_DOUBTFUL_LENGTH = 20.0
_LONG, _SHORT = 100.0, 3e-4  # bodies beyond are told of, whatever their unit [m]
_SHOWN_PARTS = 5
_USUAL_ORDER = 2
_SOLIDS_ALONE = (
    "bodies are made of solids here: fill a closed surface with solids where the mesh is made; a frame of beams and plates "
    "is described by a structure file, for `ffr-prep reduce-structure`"
)
_FAR = 1e30  # products of coordinates must be finite


@dataclass(frozen=True, repr=False)
class Block(Brief):
    """Volume elements of one kind: "tet4", "tet10", "hex8", "hex20" or "hex27".

    nodes : (E, k) indices into Mesh.points, in the node order of meshio (VTK).

    >>> block = fp.Block("tet4", np.array([[0, 1, 2, 3]]))
    """

    kind: str
    nodes: Array


@dataclass(frozen=True, repr=False)
class Mesh(Brief):
    """A volume mesh with named regions; frozen, SI units.

    points        : (N, 3) [m]
    blocks        : volume elements; element numbers count through the blocks in order
    volume_groups : name -> (m,) element numbers
    face_groups   : name -> tuple of (F, k) face connectivities, k = 3, 6 (triangles), 4, 8, 9 (quadrilaterals)
    node_groups   : name -> (m,) node indices
    notes         : what was left out or changed on reading, in words
    drawn         : of a geometry, each face with its facets (F, k) as in face_groups
    unit          : in which the file has its lengths, for texts such as "cylinder r=6 at 0,0,0"

    >>> mesh = fp.read_mesh("rod.geo")
    >>> mesh.points.shape
    """

    points: Array
    blocks: tuple[Block, ...]
    volume_groups: Mapping[str, Array]
    face_groups: Mapping[str, tuple[Array, ...]]
    node_groups: Mapping[str, Array]
    notes: tuple[str, ...] = ()
    drawn: tuple[tuple[Face, tuple[Array, ...]], ...] = ()
    unit: str = "m"

    def _rows(self) -> Rows:
        return [
            ("elements", ", ".join(f"{len(block.nodes)} {block.kind}" for block in self.blocks)),
            ("nodes", str(len(self.points))),
            ("extent", extent_in_words(self.points)),
            ("surfaces", listed(self.face_groups)),
            ("node sets", listed(self.node_groups)),
            ("volumes", listed(self.volume_groups)),
            ("notes", listed(self.notes)),
        ]


# ---- reading ------------------------------------------------------------------------------------------------------


def read_mesh(
    path: str | Path,
    *,
    unit: str | None = None,
    size: float | None = None,
    numbers: Mapping[str, float] | None = None,
    order: int | None = None,
    glue: bool = False,
    solids: Sequence[str] = (),
    most_elements: float = MOST_ELEMENTS,
    progress: Stages = no_stages,
) -> Mesh:
    """A mesh from a file, in metres; geometry (.geo, .step, .iges, .brep) is meshed by gmsh first.

    unit     : of the numbers in the file, "m", "cm", "mm" or "in"; without it the unit that a STEP file declares, or a
               universal file (.unv), millimetres for IGES, which is converted to them, and metres for every other file.
               Another unit than a STEP or IGES file declares is refused
    size     : largest element edge when geometry is meshed, in the unit of the file [m, cm, mm or in]
    numbers  : parameters of a .geo script to change, by name, lengths in the unit of the script [m, mm ...]
    order    : 1 or 2, of the elements when geometry is meshed, 2 when not given; second-order elements follow curved
               surfaces
    glue     : solids of a CAD file that touch share the faces between them, and are one body then
    solids   : of a CAD file, the names of those to keep, or patterns such as "volume_1" or "arm*"; all when not given
    most_elements : [1] a geometry whose size, or whose fine curves, ask for more is refused before it is meshed
    progress : called with the name of the stage as it begins

    A .geo file is a program and may run others: open only what you trust. Faces and volumes of CAD files without
    groups are named surface_1, volume_1, ... and by the names in the file.

    Raises InputError for a file or an argument that cannot be used, ComputationError when meshing fails.

    >>> mesh = fp.read_mesh("rod.step", unit="mm", size=5.0)
    """
    path, numbers = Path(path), dict(numbers or {})
    check_request(path, unit, size, numbers, order)
    progress("read the mesh")
    entry = format_of(path)
    of_cad = cad_settings(path, glue=glue, solids=solids, most_elements=most_elements)
    made_with = {"unit": unit, "size": size, "numbers": numbers, "order": element_order(path, order)}
    of_geometry = made_with | of_cad if entry.geometry else {}
    with reading(path, "a mesh or a geometry"):
        read: FileMesh = loaded(entry.read)(path, **of_geometry)
        if not read.blocks:
            raise InputError(f"{path} has no volume elements; {_SOLIDS_ALONE}")
        _check_places(path, read)
        known = unit or read.unit
        mesh = _in_metres(read, known or "m")
    length = float(np.ptp(mesh.points, axis=0).max())
    doubts = [*_contradicted(unit, read.unit), *doubtful_unit(length, known), *_doubtful_size(length, mesh.unit, size)]
    return replace(mesh, notes=(*mesh.notes, *doubts))


def _contradicted(given: str | None, declared: str | None) -> list[str]:
    """A note on a unit that is given where the file declares another, of formats whose files are not always right."""
    if not given or not declared or given == declared:
        return []
    return [f"the file declares that its numbers are {declared}, and they are read as {given}, which was given"]


def cad_settings(
    path: Path, *, glue: bool, solids: Sequence[str], most_elements: float = MOST_ELEMENTS
) -> dict[str, Any]:
    """The settings that differ from what is usual. Raises InputError for those that a file has no use for."""
    if (glue or solids) and not format_of(path).geometry:
        raise InputError(f"{path} is meshed already, so its solids cannot be glued or chosen: do that where it is made")
    if not 1 <= most_elements < np.inf:
        raise InputError(f"most_elements is {most_elements}; give a number of elements such as 1e6")
    given = {"glue": glue, "solids": tuple(solids), "most_elements": most_elements}
    usual = {"glue": False, "solids": (), "most_elements": MOST_ELEMENTS}
    return {key: value for key, value in given.items() if value != usual[key]}


def element_order(path: Path, order: int | None) -> int | None:
    """That of the elements that a geometry is meshed with, 2 when not given; None of a mesh, which has its own."""
    return (order or _USUAL_ORDER) if format_of(path).geometry else None


def check_request(
    path: Path, unit: str | None, size: float | None, numbers: Mapping[str, float], order: int | None
) -> None:
    """Raises InputError for a unit, size, parameter, order or file that cannot be used."""
    if unit is not None and unit not in METRES:
        raise InputError(f"unit {unit!r} is not known; the units are {', '.join(METRES)}")
    if size is not None and not 0 < size < np.inf:
        raise InputError(f"element size {size} cannot be used; it must be positive")
    if order not in (1, 2, None):
        raise InputError(f"element order {order} cannot be used; it must be 1 or 2")
    check_ordinary(path, "a mesh or a geometry")
    if size is not None and not format_of(path).geometry:
        raise InputError(f"{path} is meshed already, so an element size has no effect; leave it out")
    if order is not None and not format_of(path).geometry:
        raise InputError(
            f"{path} is meshed already, so an order of the elements has no effect; leave it out, or mesh with "
            f"elements of order {order} where the file is made"
        )
    if numbers and not format_of(path).parameters:
        raise InputError(f"{path} has no parameters to set ({', '.join(numbers)}); only .geo scripts have")


def _check_places(path: Path, read: FileMesh) -> None:
    """InputError for nodes that there are not, and for places that are no numbers."""
    used = [nodes for _, nodes in read.blocks] + [part for parts in read.faces.values() for part in parts]
    for nodes in (*used, *read.nodes.values()):
        if nodes.size and not 0 <= nodes.min() <= nodes.max() < len(read.points):
            raise InputError(f"{path} refers to nodes that it does not define; is it complete?")
    if not np.abs(read.points).max(initial=0.0) < _FAR:
        raise InputError(
            f"{path} has nodes without a place: coordinates are finite numbers, below {_FAR:g}; is it complete?"
        )


def _in_metres(read: FileMesh, unit: str) -> Mesh:
    """The mesh without the nodes that no element uses, its faces completed from the volume elements."""
    used = distinct(np.concatenate([nodes.ravel() for _, nodes in read.blocks]))
    new = np.full(len(read.points), -1)
    new[used] = np.arange(used.size)
    blocks = [(kind, new[nodes]) for kind, nodes in read.blocks]
    points = read.points[used] * METRES[unit]
    groups = [*read.faces.values(), *(face.corners for face in read.drawn)]
    whole = groups_of_whole_faces(blocks, [[new[corners] for corners in parts] for parts in groups])
    faces = dict(zip(read.faces, whole, strict=False))
    drawn = zip(read.drawn, whole[len(faces) :], strict=True)
    nodes = {name: np.unique(new[members][new[members] >= 0]) for name, members in read.nodes.items()}
    lost = [name for name, parts in faces.items() if not parts and any(len(part) for part in read.faces[name])]
    lost += [name for name, members in nodes.items() if not members.size and read.nodes[name].size]
    return Mesh(
        points=points,
        blocks=tuple(Block(kind, nodes) for kind, nodes in blocks),
        volume_groups=dict(read.volumes),
        face_groups={name: parts for name, parts in faces.items() if parts},
        node_groups={name: members for name, members in nodes.items() if members.size},
        notes=(*read.notes, *_left_out(len(read.points) - used.size, lost)),
        drawn=tuple(_drawn(face, facets, points, METRES[unit]) for face, facets in drawn if facets),
        unit=unit,
    )


def _drawn(face: DrawnFace, facets: tuple[Array, ...], points: Array, scale: float) -> tuple[Face, tuple[Array, ...]]:
    return face_of(face, scale, points, facet_triangles(facets)), facets


def facet_triangles(facets: Sequence[Array]) -> Array:
    """(T, 3) triangles between the corners of facets (F, k)."""
    parts = [FACE_TRIANGLES[face_corners(of.shape[1])] for of in facets]
    return np.concatenate([of[:, corners].reshape(-1, 3) for of, corners in zip(facets, parts, strict=True)])


def _left_out(unused: int, lost: Sequence[str]) -> list[str]:
    notes = [f"{unused} nodes that belong to no volume element are left out"] if unused else []
    return notes + [f"group {name!r} is left out: nothing of it belongs to a volume element" for name in lost]


def doubtful_unit(length: float, known: str | None) -> list[str]:
    """A note on a length [m] that is most likely off by a factor of a thousand; `known` is the unit of its numbers."""
    if known is None and length >= _DOUBTFUL_LENGTH:
        return [f"the mesh is {length:.4g} m long, read in metres as no unit was given; are its numbers millimetres?"]
    if _SHORT < length < _LONG:
        return []
    meant = "smaller" if length >= _LONG else "larger"
    return [
        f"the body is {length:.3g} m long, its numbers read as {known or 'm'}: is that meant, or is the unit {meant}?"
    ]


def _doubtful_size(length: float, unit: str, size: float | None) -> list[str]:
    """A note on a size of elements that a geometry is too small for."""
    if size is None or size * METRES[unit] <= length:
        return []
    return [
        f"elements of size {size:g} are asked for in a body that is {length / METRES[unit]:.4g} {unit} long, so size says "
        f"nothing: it is in the unit of the file, {unit}"
    ]


# ---- groups -------------------------------------------------------------------------------------------------------


def face_group(mesh: Mesh, name: str) -> tuple[Array, ...]:
    """The faces of a group, arrays (F, k); InputError lists the face groups there are."""
    if name not in mesh.face_groups:
        raise InputError(f"the mesh has no face group {name!r}; {choice(name, mesh.face_groups)}")
    return mesh.face_groups[name]


def centre_of_geometry(mesh: Mesh, name: str) -> Array | None:
    """(3,) [m] the centroid of a face group that is made of whole faces of a geometry, as this has it; None of others."""
    group = mesh.face_groups.get(name, ())
    nodes = np.unique(np.concatenate([faces.ravel() for faces in group])) if group else np.zeros(0, int)
    inside = [
        (face, sum(map(len, facets))) for face, facets in mesh.drawn if all(np.isin(of, nodes).all() for of in facets)
    ]
    if (
        not inside
        or sum(count for _, count in inside) != sum(map(len, group))
        or not all(face.exact for face, _ in inside)
    ):
        return None
    areas = np.array([face.area for face, _ in inside])
    return np.asarray(areas @ np.array([face.centre for face, _ in inside]) / areas.sum())


def region_nodes(mesh: Mesh, name: str) -> Array:
    """(m,) nodes, ascending, of a face group or else a node group; InputError lists the groups there are."""
    if name in mesh.face_groups:
        return np.unique(np.concatenate([faces.ravel() for faces in mesh.face_groups[name]]))
    if name in mesh.node_groups:
        return np.unique(mesh.node_groups[name])
    known = dict.fromkeys([*mesh.face_groups, *mesh.node_groups])
    raise InputError(
        f"the mesh has no group of faces or nodes {name!r}; {choice(name, known)}. Faces are also found by what they are, "
        "such as 'cylinder r=6mm at 0,0,0' or 'plane z=0'"
    )


# ---- outside ------------------------------------------------------------------------------------------------------


def boundary_faces(mesh: Mesh) -> tuple[Array, ...]:
    """The outer faces, one array (F, k) per face size, nodes counter-clockwise seen from outside."""
    return outer_faces(_pairs(mesh))


def surface_triangles(mesh: Mesh) -> tuple[Array, Array]:
    """The boundary as triangles: (P,) its points as indices into the mesh, (T, 3) triangles as indices into those.

    Faces of second order are several triangles between their nodes.
    """
    parts = [faces[:, FACE_TRIANGLES[faces.shape[1]]].reshape(-1, 3) for faces in boundary_faces(mesh)]
    points, triangles = np.unique(np.concatenate(parts), return_inverse=True)
    return points, triangles.reshape(-1, 3)


def _pairs(mesh: Mesh) -> list[tuple[str, Array]]:
    return [(block.kind, block.nodes) for block in mesh.blocks]


# ---- identity -----------------------------------------------------------------------------------------------------


def mesh_hash(mesh: Mesh) -> str:
    """A short hash of points, elements and groups."""
    parts = [mesh.points]
    for kind, nodes in _pairs(mesh):
        parts += [_bytes(kind), np.asarray(nodes, np.int64)]
    named: dict[str, tuple[Array, ...]] = {f"volume {name}": (of,) for name, of in mesh.volume_groups.items()}
    named |= {f"face {name}": of for name, of in mesh.face_groups.items()}
    named |= {f"node {name}": (of,) for name, of in mesh.node_groups.items()}
    for name in sorted(named):
        parts += [_bytes(name), *(np.asarray(of, np.int64) for of in named[name])]
    return content_hash(*parts)


def _bytes(text: str) -> Array:
    return np.frombuffer(text.encode(), np.uint8)


# ---- checks -------------------------------------------------------------------------------------------------------


def check_mesh(mesh: Mesh) -> None:
    """Raises InputError for a mesh that no computation should start from.

    Guarded: no elements, indices and coordinates that are not valid, nodes that no element uses, groups that are empty,
    coincident nodes, elements that are repeated, overlap at a face, are degenerate or inverted, and parts that are not
    connected or hang together by nodes or edges only.

    >>> fp.check_mesh(fp.read_mesh("rod.msh"))
    """
    _check_numbers(mesh)
    _check_groups(mesh)
    _check_repeated(mesh)
    _check_collapsed(mesh)
    _check_jacobians(mesh)
    _check_glued(mesh)
    _check_coincident(mesh)
    _check_connected(mesh)


def _check_numbers(mesh: Mesh) -> None:
    if not sum(len(block.nodes) for block in mesh.blocks):
        raise InputError(f"the mesh has no volume elements; {_SOLIDS_ALONE}")
    for kind, nodes in _pairs(mesh):
        if kind not in KINDS or nodes.shape[1:] != (KINDS[kind].size,):
            raise InputError(f"a block of kind {kind!r} has nodes of shape {nodes.shape}; kinds are {', '.join(KINDS)}")
    wrong = np.flatnonzero(~np.isfinite(mesh.points).all(axis=1))
    if wrong.size:
        raise InputError(f"node {wrong[0]} has the coordinates {mesh.points[wrong[0]]}; they must be finite numbers")
    used = distinct(np.concatenate([block.nodes.ravel() for block in mesh.blocks]))
    if used[0] < 0 or used[-1] >= len(mesh.points):
        raise InputError(f"elements refer to nodes {used[0]} to {used[-1]}, but there are {len(mesh.points)} nodes")
    unused = np.delete(np.arange(len(mesh.points)), used)
    if unused.size:
        raise InputError(f"{unused.size} nodes belong to no element, the first being node {unused[0]}; remove them")


def _check_groups(mesh: Mesh) -> None:
    sizes = {f"volume group {name!r}": len(of) for name, of in mesh.volume_groups.items()}
    sizes |= {f"face group {name!r}": sum(map(len, of)) for name, of in mesh.face_groups.items()}
    sizes |= {f"node group {name!r}": len(of) for name, of in mesh.node_groups.items()}
    for name, size in sizes.items():
        if size == 0:
            raise InputError(f"{name} of the mesh is empty; fill it or remove it")


def _check_repeated(mesh: Mesh) -> None:
    first = 0
    for kind, nodes in _pairs(mesh):
        _, index, counts = np.unique(np.sort(nodes, axis=1), axis=0, return_index=True, return_counts=True)
        if (counts > 1).any():
            element = first + int(index[counts > 1].min())
            raise InputError(
                f"{np.sum(counts > 1)} elements are there more than once, the first being element {element} "
                f"({kind}) at {_at(_centres(mesh)[element])}: remove the copies"
            )
        first += len(nodes)


def _check_collapsed(mesh: Mesh) -> None:
    """InputError for elements that name a node twice, as wedges and pyramids do that are written as hexahedra."""
    first, found = 0, list[int]()
    for _, nodes in _pairs(mesh):
        ordered = np.sort(nodes, axis=1)
        found += (first + np.flatnonzero((ordered[:, 1:] == ordered[:, :-1]).any(axis=1))).tolist()
        first += len(nodes)
    if found:
        raise InputError(
            f"{len(found)} elements name a node twice, the first being element {found[0]} at "
            f"{_at(_centres(mesh)[found[0]])}: wedges and pyramids written as collapsed hexahedra cannot be used; write "
            "them as elements of their own (C3D6, CPENTA, CPYRAM), or mesh with tetrahedra or with hexahedra alone"
        )


def _check_jacobians(mesh: Mesh) -> None:
    worst = np.concatenate([_worst_jacobians(mesh.points[nodes], kind) for kind, nodes in _pairs(mesh)])
    bad = np.flatnonzero(~(worst > _DEGENERATE))
    if not bad.size:
        return
    kinds = np.repeat([block.kind for block in mesh.blocks], [len(block.nodes) for block in mesh.blocks])
    state = "flat or collapsed" if abs(worst[bad[0]]) <= _DEGENERATE else "turned inside out, at least in part"
    curved = any(KINDS[block.kind].means for block in mesh.blocks)
    straight = ", make its elements straight (first order)" if curved else ""
    remedy = (
        "no element is right, so the mesh is mirrored or has another node order"
        if bad.size == worst.size
        else f"mesh finer there, smooth the mesh{straight}, or put the nodes of such elements in order"
    )
    others = f", as are {bad.size - 1} of the {worst.size - 1} others" if worst.size > 1 else ""
    raise InputError(
        f"element {bad[0]} ({kinds[bad[0]]}) at {_at(_centres(mesh)[bad[0]])} is {state} (Jacobian "
        f"{worst[bad[0]]:.2g} of its size cubed){others}: {remedy}"
    )


def _worst_jacobians(corners: Array, kind: str) -> Array:
    """(E,) least Jacobian determinant of elements with nodes at (E, k, 3), over the cube of their size [1]."""
    from ffr_prep.mesh.shapes import jacobian_determinants  # here, because scikit-fem is slow to load

    worst = np.empty(len(corners))
    for start in range(0, len(corners), _CHUNK):
        of = corners[start : start + _CHUNK]
        size = np.linalg.norm(np.ptp(of, axis=1), axis=1)
        determinants = jacobian_determinants(kind, of).min(axis=1)
        worst[start : start + _CHUNK] = determinants / np.maximum(size, np.finfo(float).tiny ** 0.25) ** 3
    return worst


def _check_glued(mesh: Mesh) -> None:
    """Solids of a geometry, which the program that meshes it does not join by itself."""
    part = joined_by_faces(_pairs(mesh)) if mesh.drawn and len(mesh.volume_groups) > 1 else np.zeros(1, int)
    if not part.max():
        return
    alone = {int(part[of[0]]): name for name, of in mesh.volume_groups.items() if np.unique(part[of]).size == 1}
    names = [alone.get(p, f"part {p + 1}") for p in range(int(part.max()) + 1)]
    raise InputError(
        f"the geometry has {len(names)} solids that do not hang together: {listed(map(repr, names))}. Where they touch, "
        "--glue (glue=True) lets them share the faces between them; what is apart then has a gap. Or take one as a body: "
        f"--solid {names[0]!r} (solids=[{names[0]!r}])"
    )


def _check_coincident(mesh: Mesh) -> None:
    diagonal = float(np.linalg.norm(np.ptp(mesh.points, axis=0)))
    pairs = cKDTree(mesh.points).query_pairs(_COINCIDENT * diagonal, output_type="ndarray")
    if len(pairs):
        a, b = pairs[np.lexsort(pairs.T[::-1])][0]
        raise InputError(
            f"{len(pairs)} pairs of nodes coincide, the first being nodes {a} and {b} at {_at(mesh.points[a])}; the "
            "mesh comes apart there: merge them in the program that made it (in gmsh: Coherence Mesh)"
        )


def _check_connected(mesh: Mesh) -> None:
    """Elements must hang together by whole faces; a common node or edge is a hinge."""
    by_nodes = joined_by_nodes(_pairs(mesh))
    if by_nodes.max() > 0:
        raise InputError(
            f"the mesh has {by_nodes.max() + 1} unconnected parts: {_parts_in_words(mesh, by_nodes)}. A body is one "
            "piece: join the parts (shared nodes), or make each a body of its own"
        )
    by_faces, doubled = parts_and_overlaps(_pairs(mesh))
    _check_single(mesh, doubled)
    if by_faces.max() > 0:
        raise InputError(
            f"the mesh has {by_faces.max() + 1} parts that touch at nodes or edges only, a hinge and not a joint of "
            f"solids: {_parts_in_words(mesh, by_faces)}. Let them share whole element faces"
        )


def _check_single(mesh: Mesh, doubled: Array) -> None:
    """InputError where elements, by number, are on one side of a face with others."""
    if doubled.size:
        raise InputError(
            f"{doubled.size} elements overlap, the first being element {doubled[0]} at {_at(_centres(mesh)[doubled[0]])}: "
            "they lie on the same side of a face, so there is more mass than volume; remove one of what is meshed twice"
        )


def misfit_doubts(mesh: Mesh) -> list[str]:
    """Notes on places where elements do not fit, so that the mesh opens there under load."""
    loose = nodes_on_edges(mesh.points, boundary_faces(mesh))
    open_there = [
        f"at {len(loose)} nodes the mesh is open and too soft, the first at {_at(mesh.points[first])}: they lie on "
        "edges of elements that do not have them; mesh the parts that meet there alike, so that they share their nodes"
        for first in loose[:1]
    ]
    return [*_kinds_in_words(mesh), *open_there]


def _kinds_in_words(mesh: Mesh) -> list[str]:
    """Notes on places where elements of several kinds meet and do not fit."""
    if len(mesh.blocks) < 2:
        return []
    edges, squares = misfits(_pairs(mesh))
    said = (
        (edges, "edges have a node in the middle for some of their elements and none for others"),
        (squares, "faces are quadrilaterals of some elements and triangles of others"),
    )
    return [
        f"{len(found)} {what}, the first at {_at(mesh.points[found[0]].mean(axis=0))}: the mesh opens there and is too soft; "
        "let elements of one order and shape meet"
        for found, what in said
        if len(found)
    ]


def _parts_in_words(mesh: Mesh, part: Array) -> str:
    """Size of each part and a point in it, the largest first."""
    centres, sizes = _centres(mesh), np.bincount(part)
    order = np.argsort(-sizes, kind="stable")
    words = [f"{sizes[p]} elements with {_at(centres[np.argmax(part == p)])}" for p in order[:_SHOWN_PARTS]]
    return ", ".join(words) + (", ..." if sizes.size > _SHOWN_PARTS else "")


def _centres(mesh: Mesh) -> Array:
    """(E, 3) mean of the nodes of every element [m]."""
    return np.concatenate([mesh.points[block.nodes].mean(axis=1) for block in mesh.blocks])


def _at(point: Array) -> str:
    return "(" + ", ".join(f"{x:.4g}" for x in point) + ") m"
