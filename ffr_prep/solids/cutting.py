"""A meshed solid cut into parts between its elements (`ffr_prep.model.cuts`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from ffr_prep.common.arrays import Array
from ffr_prep.mesh.boundary import neighbours, whole_faces
from ffr_prep.mesh.cells import face_corners
from ffr_prep.mesh.mesh import Block, Mesh, region_nodes
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.cuts import Cuts, Division, divided, groups_at_cuts, interfaces_of_parts
from ffr_prep.solids.assembly import Materials

Part = tuple[Mesh, Materials, tuple[InterfaceRegion, ...]]


def cut_mesh(mesh: Mesh, material: Materials, interfaces: Sequence[InterfaceRegion], cuts: Cuts) -> list[Part]:
    """Mesh, materials and interfaces of each part.

    Raises InputError for cuts that cannot be made, and for an interface that reaches into two parts.
    """
    bonds = neighbours([(block.kind, block.nodes) for block in mesh.blocks])
    division = divided(cuts, mesh.points, [block.nodes for block in mesh.blocks], bonds, interfaces)
    regions = interfaces_of_parts(division, interfaces, lambda i: region_nodes(mesh, i.region or i.name))
    meshes = [_part(mesh, division, k) for k in range(len(division.nodes))]
    return [(part, _materials(material, part), of_part) for part, of_part in zip(meshes, regions, strict=True)]


def _part(mesh: Mesh, division: Division, k: int) -> Mesh:
    """The mesh of part k; groups without anything in it are left out."""
    nodes = division.nodes[k]
    new = np.full(len(mesh.points), -1)
    new[nodes] = np.arange(nodes.size)
    number = np.full(division.part.size, -1)
    number[division.part == k] = np.arange(np.sum(division.part == k))
    first = np.cumsum([0, *(len(block.nodes) for block in mesh.blocks)])
    owned = [division.part[a:b] == k for a, b in pairwise(first)]
    blocks = tuple(Block(b.kind, new[b.nodes[own]]) for b, own in zip(mesh.blocks, owned, strict=True) if own.any())
    groups = {**mesh.node_groups, **groups_at_cuts(division, k)}
    return replace(
        mesh,
        points=mesh.points[nodes],
        blocks=blocks,
        volume_groups=_filled({name: number[of] for name, of in mesh.volume_groups.items()}),
        face_groups=_faces(blocks, {name: [new[f] for f in of] for name, of in mesh.face_groups.items()}),
        node_groups=_filled({name: new[of] for name, of in groups.items()}),
        drawn=(),
    )


def _filled(groups: Mapping[str, Array]) -> dict[str, Array]:
    """Each group without the entries that are missing (-1), and only the groups with any left."""
    return {name: of[of >= 0] for name, of in groups.items() if (of >= 0).any()}


def _faces(blocks: Sequence[Block], groups: Mapping[str, list[Array]]) -> dict[str, tuple[Array, ...]]:
    """The faces of the groups that elements of the part have."""
    pairs = [(block.kind, block.nodes) for block in blocks]
    there = {name: [f[(f >= 0).all(axis=1), : face_corners(f.shape[1])] for f in of] for name, of in groups.items()}
    whole = {name: whole_faces(pairs, of) for name, of in there.items() if sum(map(len, of))}
    return {name: faces for name, faces in whole.items() if faces}


def _materials(material: Materials, mesh: Mesh) -> Materials:
    """The materials of the volumes that the part has."""
    if not isinstance(material, Mapping):
        return material
    return {volume: of for volume, of in material.items() if volume in mesh.volume_groups}
