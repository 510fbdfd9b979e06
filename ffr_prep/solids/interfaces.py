"""Interfaces of solids: regions of the mesh tied to six-coordinate nodes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numba
import numpy as np
import scipy.sparse as sp

from ffr_prep.body.accelerations import INERTIAL
from ffr_prep.common.arrays import Array
from ffr_prep.common.compile_cache import check_compiled_code
from ffr_prep.common.errors import InputError
from ffr_prep.mesh.mesh import Mesh, face_group, region_nodes
from ffr_prep.mesh.shapes import face_mass
from ffr_prep.model.coupled import CoupledModel, InterfaceRegion, check_independent, in_words, rigid_field, skew_columns
from ffr_prep.model.region_rotations import MeanRegion, RigidRegion, force_moments
from ffr_prep.model.ties import check_names, interface_coordinates, six_rows, tied_rows
from ffr_prep.solids.assembly import SolidMatrices, vector_mass
from ffr_prep.solvers.threads import finish, pieces, threads

check_compiled_code()

_COLLINEAR = 1e-10


def couple(mesh: Mesh, matrices: SolidMatrices, interfaces: Sequence[InterfaceRegion]) -> CoupledModel:
    """Tie the interfaces to the mesh.

    Raises InputError for repeated names, an unknown region, a region of fewer than three or of collinear nodes,
    rigid regions that share nodes, and interfaces whose coordinates depend on one another.
    """
    check_names(interfaces)
    regions = [_region(mesh, interface) for interface in interfaces]
    _check_overlaps(regions)
    B = _transformation(mesh.points, regions)
    C = interface_coordinates(list(map(_follows, regions)), B, lambda k: _on_nodes(len(mesh.points), regions[k]))
    check_independent(interfaces, C)
    free = np.flatnonzero(np.repeat(_free_nodes(mesh.points, regions), 3))
    centre = mesh.points.mean(axis=0)
    return CoupledModel(
        points=mesh.points,
        B=B,
        K=_tied(matrices.K, B, free),
        M=_tied(vector_mass(matrices.m), B, free),
        T=_rigid_motions(mesh.points, centre, regions),
        centre=centre,
        places=_places(mesh.points, regions),
        names=tuple(interface.name for interface in interfaces),
        kinds=tuple(interface.kind for interface in interfaces),
        positions=np.array([region.point for region in regions]).reshape(-1, 3),
        C=C,
    )


def _tied(A: sp.csr_array, B: sp.csr_array, free: Array) -> sp.csr_array:
    """B^T A B for a symmetric A; the free rows of B are the first columns as they are."""
    following = sp.csr_array(B[:, free.size :])
    along = sp.csr_array(A @ following)
    across = along[free]
    last = sp.csr_array(sp.hstack([across.T, following.T @ along], format="csr"))
    for product in across, last:
        product.eliminate_zeros()
        product.sort_indices()  # products of matrices leave neither, and bits depend on the order of sums
    new = np.full(A.shape[0], -1, A.indices.dtype)
    new[free] = np.arange(free.size)
    counts, rows = np.empty(free.size, np.int64), pieces(free.size)

    def count(some: slice) -> None:
        _count(A.indptr, A.indices, A.data, free[some], new, counts[some])

    def fill(some: slice) -> None:
        beside = across.indptr, across.indices, across.data
        _beside(A.indptr, A.indices, A.data, free, new, *beside, ends, data, indices, some.start, some.stop)

    with threads() as each:
        finish(each(count, rows))
        inner = np.concatenate([[0], np.cumsum(counts + np.diff(across.indptr))])
        ends = np.concatenate([inner, inner[-1] + last.indptr[1:]]).astype(A.indptr.dtype)
        data, indices = np.empty(ends[-1]), np.empty(ends[-1], A.indices.dtype)
        finish(each(fill, rows))
    data[inner[-1] :], indices[inner[-1] :] = last.data, last.indices
    return sp.csr_array((data, indices, ends), shape=(ends.size - 1, ends.size - 1))


@numba.njit(cache=True, nogil=True)
def _count(indptr, indices, data, rows, new, counts):  # type: ignore[no-untyped-def]
    """How many entries of some rows of a matrix are in free columns and no zeros."""
    for k in range(rows.size):
        counts[k] = 0
        for e in range(indptr[rows[k]], indptr[rows[k] + 1]):
            counts[k] += new[indices[e]] >= 0 and data[e] != 0


@numba.njit(cache=True, nogil=True)
def _beside(indptr, indices, data, free, new, across, columns, values, ends, numbers, places, first, last):  # type: ignore[no-untyped-def]
    """Numbers and columns of the free rows first...last of a matrix: those of free columns under their new numbers, without
    zeros, and then those of another matrix (across, columns, values) whose columns follow."""
    for k in range(first, last):
        at = ends[k]
        for e in range(indptr[free[k]], indptr[free[k] + 1]):
            if new[indices[e]] >= 0 and data[e] != 0:
                numbers[at], places[at] = data[e], new[indices[e]]
                at += 1
        for e in range(across[k], across[k + 1]):
            numbers[at], places[at] = values[e], free.size + columns[e]
            at += 1


def turning_regions(
    mesh: Mesh, matrices: SolidMatrices, interfaces: Sequence[InterfaceRegion], model: CoupledModel, loads: Array
) -> list[RigidRegion | MeanRegion]:
    """The interfaces of the coupled `model` as their rotations do work; loads (3N, 12) the inertial ones at the nodes."""
    count = len(mesh.points)
    regions = [_region(mesh, interface) for interface in interfaces]
    on_nodes = [sp.csr_array((3 * count, 6)) if _follows(r) else sp.csr_array(_on_nodes(count, r).T) for r in regions]
    every_load = sp.hstack([sp.csr_array(loads), *on_nodes], format="csr")
    return [_turning(region, k, matrices.K, model, every_load) for k, region in enumerate(regions)]


def _turning(
    region: _Region, k: int, K: sp.csr_array, model: CoupledModel, loads: sp.csr_array
) -> RigidRegion | MeanRegion:
    rotation, count = model.C[6 * k + 3 : 6 * k + 6], len(model.points)
    if _follows(region):
        arms = model.points[region.nodes] - region.point
        sums = force_moments(region.nodes, arms, 3, count)
        return RigidRegion(region.nodes, arms, rotation, sp.csr_array(sums @ K @ model.B), (sums @ loads).toarray())
    weighted = region.weights @ region.offsets
    sums = force_moments(region.nodes, weighted, 3, count)
    second_moment = region.offsets.T @ weighted
    return MeanRegion(
        rotation=rotation,
        spread=sp.csr_array(sums @ model.B),
        second_moment=second_moment,
        arm=region.point - region.centroid,
        first=INERTIAL + 6 * k,
        turning=sp.csr_array((0, model.B.shape[1])),
        of_each=np.zeros((3, 3)),
    )


@dataclass(frozen=True)
class _Region:
    """The nodes (r,) of an interface with their weights (r, r) of sum `total`, the centroid and the second moment.

    second_moment : (3, 3) sum of weights (|d|^2 I - d d^T), d from the centroid
    """

    interface: InterfaceRegion
    nodes: Array
    weights: sp.csr_array
    total: float
    offsets: Array
    centroid: Array
    point: Array
    second_moment: Array


def _region(mesh: Mesh, interface: InterfaceRegion) -> _Region:
    name = interface.region or interface.name
    nodes = region_nodes(mesh, name)
    if len(nodes) < 3:
        raise InputError(
            f"interface {interface.name!r}: region {name!r} has {len(nodes)} nodes; a six-coordinate node needs at "
            "least three that are not on one line"
        )
    weights = _weights(mesh, name, nodes)
    row_sums = np.asarray(weights.sum(axis=1)).ravel()
    total = float(row_sums.sum())
    centroid = row_sums @ mesh.points[nodes] / total
    offsets = mesh.points[nodes] - centroid
    moment = offsets.T @ (weights @ offsets)
    second_moment = np.trace(moment) * np.eye(3) - moment
    _check_not_collinear(interface, second_moment, centroid)
    point = centroid if interface.point is None else np.asarray(interface.point, float)
    return _Region(interface, nodes, weights, total, offsets, centroid, point, second_moment)


def _weights(mesh: Mesh, name: str, nodes: Array) -> sp.csr_array:
    """(r, r) consistent surface mass of a face group [m^2]; equal weights for a node group."""
    count = len(nodes)
    if name not in mesh.face_groups:
        return sp.csr_array(sp.eye_array(count, format="csr"))
    weights = sp.csr_array((count, count))
    for faces in face_group(mesh, name):
        local = np.searchsorted(nodes, faces)
        rows = np.repeat(local, faces.shape[1], axis=1).ravel()
        columns = np.tile(local, (1, faces.shape[1])).ravel()
        of_faces = sp.coo_array((face_mass(mesh.points, faces).ravel(), (rows, columns)), shape=(count, count))
        weights = weights + of_faces.tocsr()
    return sp.csr_array(weights)


def _mean_motion(region: _Region) -> Array:
    """(6, r, 3) translation of the point and rotation, of the nodal displacements of the region.

    The rigid motion that minimises the weighted square of the difference to the displacement.
    """
    row_sums = np.asarray(region.weights.sum(axis=1)).ravel()
    translation = row_sums[None, :, None] / region.total * np.eye(3)[:, None, :]
    rotation = np.tensordot(np.linalg.inv(region.second_moment), skew_columns(region.weights @ region.offsets), (1, 1))
    arm = skew_columns(region.point - region.centroid)
    return np.concatenate([translation - np.tensordot(arm, rotation, 1), rotation])


def _follows(region: _Region) -> bool:
    return region.interface.kind == "rigid"


def _rigid(regions: Sequence[_Region]) -> list[_Region]:
    return [region for region in regions if _follows(region)]


def _free_nodes(points: Array, regions: Sequence[_Region]) -> Array:
    """(N,) which nodes follow no rigid interface."""
    free = np.ones(len(points), bool)
    for region in _rigid(regions):
        free[region.nodes] = False
    return free


def _transformation(points: Array, regions: Sequence[_Region]) -> sp.csr_array:
    """B (3N, Z): the free nodes' displacements first, then six coordinates for each rigid interface."""
    free = np.flatnonzero(np.repeat(_free_nodes(points, regions), 3))
    following = [(_dofs(r), rigid_field(points[r.nodes] - r.point).reshape(-1, 6)) for r in _rigid(regions)]
    return tied_rows(3 * len(points), free, following)


def _dofs(region: _Region) -> Array:
    return (3 * region.nodes[:, None] + np.arange(3)).ravel()


def _on_nodes(count: int, region: _Region) -> sp.csr_array:
    """(6, 3N) the mean motion as rows on the nodal displacements."""
    return six_rows(_mean_motion(region).reshape(6, -1), _dofs(region), 3 * count)


def _rigid_motions(points: Array, centre: Array, regions: Sequence[_Region]) -> Array:
    """T (Z, 6): the rigid motions in the independent coordinates."""
    of_nodes = rigid_field(points[_free_nodes(points, regions)] - centre).reshape(-1, 6)
    turning = np.hstack([np.zeros((3, 3)), np.eye(3)])
    of_interfaces = [np.vstack([rigid_field(region.point - centre), turning]) for region in _rigid(regions)]
    return np.vstack([of_nodes, *of_interfaces])


def _places(points: Array, regions: Sequence[_Region]) -> Array:
    of_nodes = np.repeat(points[_free_nodes(points, regions)], 3, axis=0)
    return np.vstack([of_nodes, np.full((6 * len(_rigid(regions)), 3), np.nan)])


def _check_not_collinear(interface: InterfaceRegion, second_moment: Array, centroid: Array) -> None:
    moments, axes = np.linalg.eigh(second_moment)
    if moments[0] <= _COLLINEAR * moments[-1]:
        size = float(np.sqrt(moments[-1]) + np.abs(centroid).max())
        raise InputError(
            f"interface {interface.name!r}: the nodes of region {interface.region or interface.name!r} lie on one "
            f"line through {in_words(centroid, size)} m along {in_words(axes[:, 0], 1.0)}; the rotation about it is "
            "undetermined: choose a region with width"
        )


def _check_overlaps(regions: Sequence[_Region]) -> None:
    rigid = _rigid(regions)
    for k, one in enumerate(rigid):
        for other in rigid[k + 1 :]:
            shared = np.intersect1d(one.nodes, other.nodes)
            if shared.size:
                raise InputError(
                    f"rigid interfaces {one.interface.name!r} and {other.interface.name!r} share {shared.size} nodes "
                    f"(node {shared[0]} is the first): a node cannot follow two of them; make one 'mean' or separate "
                    "the regions (of one surface in several pieces, `near x,y,z` behind a query takes the nearest)"
                )
