"""The faces of a mesh: those of its geometry, or else what can be recognised of its skin.

Without geometry the skin is cut along its sharp edges and along the borders of its groups. A piece is a plane, a cylinder
or a sphere where its nodes lie on one; otherwise flat parts are taken out of it, as where a fillet runs into a plane, and
what is left is looked at again. What then is none of these is "other".
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from itertools import pairwise

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.mesh.boundary import groups_of_whole_faces
from ffr_prep.mesh.cells import face_corners
from ffr_prep.mesh.geometry.face import Face
from ffr_prep.mesh.geometry.faces import Faces, measures
from ffr_prep.mesh.geometry.fits import recognised
from ffr_prep.mesh.geometry.region_words import Names, parsed
from ffr_prep.mesh.geometry.regions import found, names_of
from ffr_prep.mesh.mesh import Mesh, boundary_faces, facet_triangles, region_nodes

_SHARP = np.cos(np.radians(35.0))  # of normals across an edge: twelve elements to the turn are not sharp
_FLAT = 1e-6  # of 1 - cos, between facets of a plane
_ALIKE = np.cos(np.radians(10.0))  # of normals with their mean
_LARGE = 0.2  # of the area of a piece that a plane in it has
_ON = 2e-4  # how far nodes may lie off their surface, of its size
_DEEPEST = 20

Facets = tuple[Array, ...]


def mesh_faces(mesh: Mesh) -> Faces:
    """The faces of a mesh: those of the geometry that it was made of, or those recognised on its skin.

    faces = mesh_faces(read_mesh("part.inp", unit="mm"))
    """
    return _with_facets(mesh)[0]


def with_regions(mesh: Mesh, regions: Sequence[str]) -> Mesh:
    """The mesh with a group for each region that is none yet but a query, a range, a pattern or a sum of such.

    Raises InputError for a region that means nothing; the message tells what is near and what to type.
    """
    missing = [r for r in dict.fromkeys(regions) if r not in mesh.face_groups and r not in mesh.node_groups]
    if not missing:
        return mesh
    faces, facets = _with_facets(mesh)
    known = {name for face in faces.faces for name in names_of(face)}
    made: dict[str, Facets] = {}
    sets: dict[str, Array] = {}
    for region in missing:
        if region not in known and parsed(region, mesh.unit) == (Names(region, (region,)),):
            region_nodes(mesh, region)  # which refuses it, and lists the groups there are
        nodes = _node_sets(mesh, region)
        if nodes is not None:
            sets[region] = nodes
        else:
            made[region] = _joined(mesh, _facets_of(mesh, faces, facets, region))
    return replace(mesh, face_groups={**mesh.face_groups, **made}, node_groups={**mesh.node_groups, **sets})


def region_faces(mesh: Mesh, region: str) -> tuple[str, ...]:
    """The names of the faces that a query means; empty for the name of a group."""
    if region in mesh.face_groups or region in mesh.node_groups:
        return ()
    faces, _ = _with_facets(mesh)
    try:
        return tuple(faces.faces[k].name for k in found(faces, region))
    except InputError:  # groups of the mesh beside faces
        return ()


def _node_sets(mesh: Mesh, region: str) -> Array | None:
    """(m,) nodes of a sum, a range or a pattern of node sets; None where something else is meant."""
    names = [_groups_like(mesh.node_groups, term) for term in parsed(region, mesh.unit) if isinstance(term, Names)]
    if len(names) < len(parsed(region, mesh.unit)) or not all(names):
        return None
    return np.unique(np.concatenate([mesh.node_groups[name] for of in names for name in of]))


def _groups_like(groups: Mapping[str, object], term: Names) -> list[str]:
    if term.pattern:
        return [name for name in groups if fnmatchcase(name, term.text)]
    return list(term.names) if set(term.names) <= set(groups) else []


def _facets_of(mesh: Mesh, faces: Faces, facets: Sequence[Facets], region: str) -> list[Array]:
    """The facets of a region: of groups of the mesh by name, of faces by name and query."""
    terms = parsed(region, mesh.unit)
    if all(isinstance(term, Names) and _groups_like(mesh.face_groups, term) for term in terms):
        named = [name for term in terms if isinstance(term, Names) for name in _groups_like(mesh.face_groups, term)]
        return [part for name in named for part in mesh.face_groups[name]]
    return [part for k in found(faces, region) for part in facets[k]]


def _joined(mesh: Mesh, parts: Sequence[Array]) -> Facets:
    """Facets of several groups as one group, each facet once."""
    blocks = [(block.kind, block.nodes) for block in mesh.blocks]
    return groups_of_whole_faces(blocks, [[part[:, : face_corners(part.shape[1])] for part in parts]])[0]


def _with_facets(mesh: Mesh) -> tuple[Faces, list[Facets]]:
    """The faces, and the facets of each."""
    if mesh.drawn:
        known, facets = [face for face, _ in mesh.drawn], [of for _, of in mesh.drawn]
        triangles = tuple(map(facet_triangles, facets))
        return Faces(tuple(known), mesh.points, triangles, mesh.unit, notes=mesh.notes), facets
    pieces = sorted(_recognised(mesh), key=lambda piece: _in_order(piece[0].name))
    triangles = tuple(facet_triangles(of) for _, of in pieces)
    known = [face for face, _ in pieces]
    return Faces(tuple(known), mesh.points, triangles, mesh.unit, _ON, mesh.notes), [of for _, of in pieces]


# ---- recognised on the skin -----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Skin:
    """Facets of the skin: (F, 4) corners, of triangles the last twice; areas times normals (F, 3); groups that each is in."""

    points: Array
    corners: Array
    normals: Array
    member: Array
    bonds: Array


def _in_order(name: str) -> list[str]:
    """Names with numbers by these, not by their first digits."""
    return [part.zfill(12) if part.isdigit() else part for part in re.split(r"(\d+)", name)]


def _recognised(mesh: Mesh) -> Iterator[tuple[Face, Facets]]:
    """The pieces of the skin, each with its facets."""
    whole = boundary_faces(mesh)
    skin = _skin(mesh, whole)
    names = list(mesh.face_groups)
    sizes = [sum(map(len, mesh.face_groups[name])) for name in names]
    starts = np.cumsum([0, *map(len, whole)])
    for k, of in enumerate(_pieces(skin), 1):
        groups = tuple(name for g, name in enumerate(names) if skin.member[of[0], g])
        alone = [name for name in groups if sizes[names.index(name)] == of.size]
        facets = tuple(f[of[(of >= a) & (of < b)] - a] for f, (a, b) in zip(whole, pairwise(starts), strict=True))
        name = alone[0] if alone else f"patch_{k}"
        face = replace(_fitted(skin, of), name=name, groups=tuple(group for group in groups if group != name))
        yield face, tuple(part for part in facets if len(part))


def _skin(mesh: Mesh, whole: Sequence[Array]) -> _Skin:
    corners = np.concatenate([f[:, [0, 1, 2, 3 if face_corners(f.shape[1]) == 4 else 2]] for f in whole])
    a, b, c, d = np.moveaxis(mesh.points[corners], 1, 0)
    normals = np.cross(b - a, c - a) / 2 + np.cross(c - a, d - a) / 2  # of triangles the second part is zero
    keys = {tuple(sorted(set(row))): k for k, row in enumerate(corners.tolist())}
    member = np.zeros((len(corners), len(mesh.face_groups)), bool)
    for g, parts in enumerate(mesh.face_groups.values()):
        for row in (row for part in parts for row in part[:, : face_corners(part.shape[1])].tolist()):
            if (at := keys.get(tuple(sorted(set(row))))) is not None:
                member[at, g] = True
    return _Skin(mesh.points, corners, normals, member, _bonds(corners))


def _bonds(corners: Array) -> Array:
    """(E, 2) facets on both sides of an edge."""
    ends = np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2)
    owner = np.repeat(np.arange(len(corners)), 4)
    real = ends[:, 0] != ends[:, 1]
    edges, owner = np.sort(ends[real], axis=1), owner[real]
    order = np.lexsort(edges.T)
    same = (edges[order][1:] == edges[order][:-1]).all(axis=1)
    return np.stack([owner[order][:-1][same], owner[order][1:][same]], axis=1)


def _pieces(skin: _Skin) -> Iterator[Array]:
    """The facets (m,) of each piece, ascending."""
    unit = skin.normals / np.maximum(np.linalg.norm(skin.normals, axis=1), np.finfo(float).tiny)[:, None]
    cosines = (unit[skin.bonds[:, 0]] * unit[skin.bonds[:, 1]]).sum(axis=1)
    same = (skin.member[skin.bonds[:, 0]] == skin.member[skin.bonds[:, 1]]).all(axis=1)
    smooth = skin.bonds[same & (cosines > _SHARP)]
    flat = skin.bonds[same & (cosines > 1 - _FLAT)]
    for piece in _components(np.arange(len(skin.corners)), smooth):
        yield from _split(skin, piece, smooth, flat, 0)


def _split(skin: _Skin, piece: Array, smooth: Array, flat: Array, depth: int) -> Iterator[Array]:
    """A piece, or the plane in it and the pieces that are left without it."""
    if depth == _DEEPEST or _fitted(skin, piece).kind != "other":
        yield piece
        return
    planes = _components(piece, flat)
    areas = [np.linalg.norm(skin.normals[of], axis=1).sum() for of in planes]
    largest = planes[int(np.argmax(areas))]
    alone = largest.size == 1 and skin.corners[largest[0], 2] == skin.corners[largest[0], 3]  # a triangle, always flat
    if max(areas) < _LARGE * sum(areas) or largest.size == piece.size or alone or _nearly_flat(skin, piece):
        yield piece
        return
    yield largest
    for rest in _components(np.setdiff1d(piece, largest), smooth):
        yield from _split(skin, rest, smooth, flat, depth + 1)


def _nearly_flat(skin: _Skin, piece: Array) -> bool:
    """Whether the normals of a piece are all alike, as of a curved strip that is one element wide: no plane is in it."""
    unit = skin.normals[piece] / np.maximum(np.linalg.norm(skin.normals[piece], axis=1), np.finfo(float).tiny)[:, None]
    mean = skin.normals[piece].sum(axis=0)
    return bool((unit @ mean).min() > _ALIKE * np.linalg.norm(mean))


def _components(chosen: Array, bonds: Array) -> list[Array]:
    """The chosen facets that hang together, in order of their first."""
    place = np.full(int(max(chosen.max(initial=-1), bonds.max(initial=-1))) + 1, -1)
    place[chosen] = np.arange(chosen.size)
    inner = place[bonds]
    inner = inner[(inner >= 0).all(axis=1)]
    graph = sp.coo_array((np.ones(len(inner)), (inner[:, 0], inner[:, 1])), (chosen.size, chosen.size))
    _, part = connected_components(graph, directed=False)
    order = np.argsort(part, kind="stable")
    return sorted(np.split(chosen[order], np.flatnonzero(np.diff(part[order])) + 1), key=lambda of: int(of[0]))


def _fitted(skin: _Skin, piece: Array) -> Face:
    """The face that facets are."""
    corners = skin.corners[piece]
    triangles = np.concatenate([corners[:, :3], corners[corners[:, 2] != corners[:, 3]][:, [0, 2, 3]]])
    centre, area, _ = measures(skin.points, triangles)
    return recognised(Face("", "other", centre, area), skin.points, triangles, _ON)
