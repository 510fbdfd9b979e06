"""The error that the size of plate elements leaves in a deformation shape, of what happens in their plane.

As in solids (`ffr_prep.solids.mesh_error`): the membrane forces of the elements jump from one to the next, and at free edges
they do not vanish. Those that are averaged at the corners, free of traction where an edge is free, are nearer to the truth,
and the strain energy of the difference is what the mesh adds to the shape. The displacement in the plane is conforming, so
it makes a sheet too stiff, triangles of Allman much more than quadrilaterals: a strip of two of them across, bent in its
plane, has a frequency 13 % too high.

Averages are taken over the elements of one shell around a corner that continue one another over their sides with less than
an eighth of a turn between them, each turned into their mean plane. Sides that other elements share, as at folds and
T-joints, are not free.

The bending of plates is left out. The rotations of DKT and DKQ do not fit the slopes of their deflection, so that a coarse
mesh may make plates too soft or too stiff in bending, and the jumps of their moments do not tell which.

Source: O. C. Zienkiewicz, J. Z. Zhu, Int. J. Numer. Meth. Eng. 24 (1987) 337-357.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from ffr_prep.common.arrays import Array
from ffr_prep.structures.frame import Frame
from ffr_prep.structures.plate_functions import CORNERS, reference, rule
from ffr_prep.structures.plates import (
    STIFFNESS_ORDER,
    Plates,
    element_coordinates,
    jacobian,
    membrane_strain,
    plates,
)

_CONTINUES = 0.7  # least cosine between the normals of elements that continue one another
_SMOOTH = 0.1  # of the mean square of the normals at a corner: where more points aside, two edges meet


@dataclass(frozen=True)
class _Kind:
    """Elements of three or of four nodes: nodes (E, k), and the number of the shell of each (E,)."""

    nodes: Array
    elements: Plates
    shell: Array


@dataclass(frozen=True)
class _Corners:
    """The C corners of all elements; patches are the corners of elements that continue one another at a node.

    patch : (C,) number of the patch of each
    into  : (C, 3, 2) the x' and y' of its element in the mean plane of the patch
    along : (P, 3, 3) projection on the directions in which forces pass at each patch
    """

    patch: Array
    into: Array
    along: Array


def added_energy(frame: Frame, loaded: Array, q: Array) -> Array | None:
    """(r,) twice the strain energy [J] that the mesh adds to the fields q (6N, r); None of a frame without plates.

    loaded : nodes that carry other forces than those of the plates; edges elsewhere are free
    """
    kinds = _kinds(frame)
    if not kinds:
        return None
    by_node = q.reshape(len(frame.points), 6, -1)
    fields = [
        element_coordinates(kind.elements) @ by_node[kind.nodes].reshape(len(kind.nodes), -1, by_node.shape[2])
        for kind in kinds
    ]
    own = [
        _forces(kind.elements, CORNERS[kind.nodes.shape[1]], e).reshape(-1, 3, e.shape[2])
        for kind, e in zip(kinds, fields, strict=True)
    ]
    better = _averaged(_corners(frame.points, loaded, kinds), np.concatenate(own))
    of_kinds = np.split(better, np.cumsum([kind.nodes.size for kind in kinds])[:-1])
    parts = zip(kinds, fields, of_kinds, strict=True)
    return np.sum([_difference(k.elements, e, at.reshape(*k.nodes.shape, 3, -1)) for k, e, at in parts], axis=0)


def _kinds(frame: Frame) -> list[_Kind]:
    split = np.split(frame.shell_of, [len(frame.triangles)])
    return [
        _Kind(nodes, plates(frame.points[nodes], [frame.shells[k] for k in of]), of)
        for nodes, of in zip((frame.triangles, frame.quadrilaterals), split, strict=True)
        if len(nodes)
    ]


def _forces(elements: Plates, at: Array, e: Array) -> Array:
    """(E, Q, 3, r) membrane forces xx, yy, xy [N/m] of element coordinates (E, 6k, r), in element axes."""
    return np.asarray(elements.membrane[:, None] @ (membrane_strain(elements, at) @ e[:, None]))


def _averaged(corners: _Corners, own: Array) -> Array:
    """(C, 3, r) the forces of each patch in the axes of the element of each corner, from its own (C, 3, r)."""
    plane = own[:, [[0, 2], [2, 1]]]
    turned = np.einsum("cax,cxyr,cby->cabr", corners.into, plane, corners.into, optimize=True)
    total = np.zeros((len(corners.along), *turned.shape[1:]))
    np.add.at(total, corners.patch, turned)
    mean = total / np.bincount(corners.patch)[:, None, None, None]
    free = np.einsum("pab,pbcr,pcd->padr", corners.along, mean, corners.along, optimize=True)
    back = np.einsum("cax,cabr,cby->cxyr", corners.into, free[corners.patch], corners.into, optimize=True)
    return np.asarray(back[:, [0, 1, 0], [0, 1, 1]])


def _difference(elements: Plates, e: Array, at_corners: Array) -> Array:
    """(r,) the energy of the difference between the forces (E, k, 3, r) at the corners and those of the elements."""
    k = elements.lift.shape[1]
    at, weights = rule(k, STIFFNESS_ORDER[k])
    functions = reference(k, at)
    difference = np.einsum("qk,ekcr->eqcr", functions.N, at_corners) - _forces(elements, at, e)
    strain = np.linalg.inv(elements.membrane)[:, None] @ difference
    area = jacobian(elements, functions)[1] * weights
    return np.asarray(np.einsum("eq,eqcr,eqcr->r", area, difference, strain, optimize=True))


# ---- which corners belong together --------------------------------------------------------------------------------


def _corners(points: Array, loaded: Array, kinds: Sequence[_Kind]) -> _Corners:
    nodes = np.concatenate([kind.nodes.ravel() for kind in kinds])
    C = np.concatenate([np.repeat(kind.elements.C, kind.nodes.shape[1], axis=0) for kind in kinds])
    shell = np.concatenate([np.repeat(kind.shell, kind.nodes.shape[1]) for kind in kinds])
    following = _following([kind.nodes.shape for kind in kinds])
    patch, free = _patches(nodes, following, C[:, :, 2], shell)
    normal, facing = _mean_normals(patch, C[:, :, 2])
    into = (_turn(facing[:, None] * C[:, :, 2], normal[patch]) @ C)[:, :, :2]
    return _Corners(patch, into, _along(points, nodes, following, free, loaded, patch, normal))


def _following(shapes: Sequence[tuple[int, ...]]) -> Array:
    """(C,) the next corner of each corner's element."""
    first, all_next = 0, []
    for count, k in shapes:
        corners = first + np.arange(count * k).reshape(count, k)
        all_next.append(np.roll(corners, -1, axis=1).ravel())
        first += count * k
    return np.concatenate(all_next)


def _patches(nodes: Array, following: Array, normal: Array, shell: Array) -> tuple[Array, Array]:
    """(C,) the patch of each corner, and whether the side from it to the next is of its element alone."""
    swapped = nodes > nodes[following]
    low = np.where(swapped, following, np.arange(len(nodes)))
    high = np.where(swapped, np.arange(len(nodes)), following)
    ends = np.stack([nodes[low], nodes[high]], axis=1)
    _, side, uses = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    side = side.ravel()
    order = np.argsort(side, kind="stable")
    rows, columns = [np.zeros(0, int)], [np.zeros(0, int)]
    for apart in range(1, uses.max()):
        one, other = order[:-apart], order[apart:]
        same = (side[one] == side[other]) & (shell[one] == shell[other])
        same &= np.abs(np.einsum("ca,ca->c", normal[one], normal[other])) > _CONTINUES
        rows += [end[one[same]] for end in (low, high)]
        columns += [end[other[same]] for end in (low, high)]
    pairs = np.concatenate(rows), np.concatenate(columns)
    graph = sp.coo_array((np.ones(len(pairs[0])), pairs), shape=(len(nodes), len(nodes)))
    return connected_components(graph, directed=False)[1], uses[side] == 1


def _mean_normals(patch: Array, normal: Array) -> tuple[Array, Array]:
    """(P, 3) the mean normal of each patch, and (C,) 1 or -1, whether that of each corner's element looks the same way."""
    _, first = np.unique(patch, return_index=True)
    facing = np.where(np.einsum("ca,ca->c", normal, normal[first[patch]]) < 0, -1.0, 1.0)
    mean = np.zeros((len(first), 3))
    np.add.at(mean, patch, facing[:, None] * normal)
    return mean / np.linalg.norm(mean, axis=1)[:, None], facing


def _turn(start: Array, end: Array) -> Array:
    """(C, 3, 3) the smallest rotation of each unit vector onto another."""
    axis = np.cross(start, end)
    skew = -np.cross(np.eye(3), axis[:, None])
    return np.eye(3) + skew + skew @ skew / (1 + np.einsum("ca,ca->c", start, end))[:, None, None]


def _along(
    points: Array, nodes: Array, following: Array, free: Array, loaded: Array, patch: Array, normal: Array
) -> Array:
    """(P, 3, 3) projections: on the edge where one is free, on nothing at a corner of two, else on everything."""
    outward = np.zeros((len(normal), 3, 3))
    sides = points[nodes[following]] - points[nodes]
    for end in (np.arange(len(nodes))[free], following[free]):
        across = np.cross(sides[free], normal[patch[end]])
        size = np.linalg.norm(across, axis=1)[:, None, None]
        np.add.at(outward, patch[end], across[:, :, None] * across[:, None] / size)
    outward[patch[np.isin(nodes, loaded)]] = 0.0
    at_edge = outward.any(axis=(1, 2))
    sizes, axes = np.linalg.eigh(outward[at_edge])
    along = np.tile(np.eye(3), (len(normal), 1, 1))
    along[at_edge] = np.einsum("pia,pa,pja->pij", axes, sizes <= _SMOOTH * sizes[:, -1:], axes)
    return along
