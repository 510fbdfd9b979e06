"""Interfaces of frames: groups of nodes with six coordinates each, and the model that they leave.

A *rigid* interface moves its nodes as one piece; one node alone is its own interface. A *mean* interface leaves its
nodes free. Its motion (t, omega) is the rigid motion closest to theirs,

    minimise  sum |u_i - t - omega x r_i|^2 + s^2 (theta_i - omega) . P (theta_i - omega),

with s the radius of gyration of the nodes about their mean. Translations alone count where they tell the rotation. About
a line on which the nodes lie they do not, so the rotations about it count: P = (1 - b/a) d d^T, a and b being the largest
and the second moment of the nodes, d the direction of the largest; P = I for a single node. A force on the interface acts
on all nodes alike, a moment by forces at their arms: moments on the nodes of a sheet about its normal would turn it the
more the finer the mesh.

Source: R. H. MacNeal, The NASTRAN Theoretical Manual (1972), section 5 (rigid elements).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp

from ffr_prep.body.accelerations import INERTIAL, turns
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.model.coupled import CoupledModel, InterfaceRegion, rigid_field
from ffr_prep.model.region_rotations import MeanRegion, RigidRegion, force_moments
from ffr_prep.model.ties import check_names, interface_coordinates, six_rows, tied_rows
from ffr_prep.structures.frame import Frame, group_nodes


def couple_frame(
    frame: Frame, K: sp.csr_array, M: sp.csr_array, interfaces: Sequence[InterfaceRegion], ties: sp.csr_array
) -> CoupledModel:
    """The model in the independent coordinates z: those of the free nodes, then six for each rigid interface.

    K, M (6N, 6N) of all nodes, ties (6N, Z) their coordinates from the independent ones.
    """
    positions = _interface_points(frame, interfaces)
    rigid = np.array([interface.kind == "rigid" for interface in interfaces], bool)
    free = _free_nodes(frame, interfaces)
    centre = frame.points.mean(axis=0)
    translations = (6 * np.arange(len(frame.points))[:, None] + np.arange(3)).ravel()
    of_coordinates = np.vstack([frame.points[free], positions[rigid]])
    return CoupledModel(
        points=frame.points,
        B=sp.csr_array(ties[translations]),
        K=sp.csr_array(ties.T @ K @ ties),
        M=sp.csr_array(ties.T @ M @ ties),
        T=rigid_coordinates(of_coordinates - centre).reshape(-1, 6),
        centre=centre,
        places=np.repeat(np.vstack([frame.points[free], _places(frame, interfaces, positions)[rigid]]), 6, axis=0),
        names=tuple(interface.name for interface in interfaces),
        kinds=tuple("node" if len(_nodes(frame, i)) == 1 else i.kind for i in interfaces),
        positions=positions,
        C=interface_coordinates(
            rigid.tolist(), ties, lambda k: _mean_motion(frame, _nodes(frame, interfaces[k]), positions[k])
        ),
    )


def _mean_motion(frame: Frame, nodes: Array, position: Array) -> sp.csr_array:
    """(6, 6N) the rigid motion at `position` closest to the motions of the nodes."""
    at = frame.points[nodes]
    weight = np.eye(6)
    weight[3:, 3:] = rotation_weight(at)
    R = rigid_coordinates(at - position)
    weighted = weight @ R
    motion = np.linalg.solve(np.einsum("nci,ncj->ij", R, weighted), weighted.reshape(-1, 6).T)
    return six_rows(motion, _dofs(nodes), 6 * len(frame.points))


def _dofs(nodes: Array) -> Array:
    """(6m,) the coordinates of nodes (m,)."""
    return (6 * nodes[:, None] + np.arange(6)).ravel()


def rotation_weight(at: Array) -> Array:
    """s^2 P (3, 3) [m^2] of nodes at (m, 3); of any size for one place, as only the rotations count there."""
    offsets = at - at.mean(axis=0)
    moments, axes = np.linalg.eigh(offsets.T @ offsets / len(at))
    if moments[-1] == 0.0:
        return np.eye(3)
    return moments.sum() * (1 - moments[1] / moments[2]) * np.outer(axes[:, 2], axes[:, 2])


def turning_regions(
    frame: Frame,
    K: sp.csr_array,
    interfaces: Sequence[InterfaceRegion],
    ties: sp.csr_array,
    model: CoupledModel,
    loads: Array,
) -> list[RigidRegion | MeanRegion]:
    """The interfaces of the coupled `model` as their rotations do work; K (6N, 6N) and loads (6N, 12) of all nodes."""
    size = len(ties.indptr) - 1
    on_nodes = [
        sp.csr_array((size, 6)) if i.kind == "rigid" else sp.csr_array(_mean_motion(frame, _nodes(frame, i), at).T)
        for i, at in zip(interfaces, model.positions, strict=True)
    ]
    every_load = sp.hstack([sp.csr_array(loads), *on_nodes], format="csr")
    made: list[RigidRegion | MeanRegion] = []
    for k, interface in enumerate(interfaces):
        rotation, nodes = model.C[6 * k + 3 : 6 * k + 6], _nodes(frame, interface)
        if interface.kind == "rigid":
            arms = frame.points[nodes] - model.positions[k]
            sums = force_moments(nodes, arms, 6, len(frame.points))
            internal, external = sp.csr_array(sums @ K @ ties), (sums @ every_load).toarray()
            made.append(RigidRegion(nodes, arms, rotation, internal, external))
        else:
            made.append(_mean_region(frame, nodes, model.positions[k], rotation, ties, INERTIAL + 6 * k))
    return made


def _mean_region(
    frame: Frame, nodes: Array, position: Array, rotation: sp.csr_array, ties: sp.csr_array, first: int
) -> MeanRegion:
    """Its rotation R is the best fit to the nodes and their rotations R_i: sum of (r_i + u_i) r_i^T + R_i Q = R U, where
    Q = (tr s^2 P) I / 2 - s^2 P has (tr Q) I - Q = s^2 P."""
    at, count = frame.points[nodes], len(frame.points)
    offsets = at - at.mean(axis=0)
    weight = rotation_weight(at)
    Q = np.trace(weight) / 2 * np.eye(3) - weight
    turning = _rotations(nodes, count)
    of_rotations = sp.kron(np.ones((1, len(nodes))), sp.csr_array(np.einsum("cak,kb->abc", turns(), Q).reshape(9, 3)))
    spread = force_moments(nodes, offsets, 6, count) + of_rotations @ turning
    second_moment = offsets.T @ offsets + len(nodes) * Q
    return MeanRegion(
        rotation=rotation,
        spread=sp.csr_array(spread @ ties),
        second_moment=second_moment,
        arm=position - at.mean(axis=0),
        first=first,
        turning=sp.csr_array(turning @ ties),
        of_each=Q,
    )


def _rotations(nodes: Array, count: int) -> sp.csr_array:
    """(3m, 6N) the rotations of the nodes (m,)."""
    columns = (6 * nodes[:, None] + np.arange(3, 6)).ravel()
    return sp.csr_array((np.ones(columns.size), columns, np.arange(columns.size + 1)), shape=(columns.size, 6 * count))


def tie(frame: Frame, interfaces: Sequence[InterfaceRegion]) -> sp.csr_array:
    """(6N, Z) coordinates of all nodes from the independent ones, q_n = tie z, those of rigid interfaces last.

    Raises InputError for repeated names, an unknown group, or interfaces that share nodes.
    """
    _check_interfaces(frame, interfaces)
    rigid = [interface for interface in interfaces if interface.kind == "rigid"]
    positions = _interface_points(frame, rigid)
    nodes = [_nodes(frame, interface) for interface in rigid]
    following = [
        (_dofs(of), rigid_coordinates(frame.points[of] - at).reshape(-1, 6))
        for of, at in zip(nodes, positions, strict=True)
    ]
    return tied_rows(6 * len(frame.points), _dofs(_free_nodes(frame, interfaces)), following)


def rigid_coordinates(offsets: Array) -> Array:
    """(..., 3) -> (..., 6, 6): the six coordinates of a node by three translations and three rotations."""
    turning = np.broadcast_to(np.hstack([np.zeros((3, 3)), np.eye(3)]), (*offsets.shape, 6))
    return np.concatenate([rigid_field(offsets), turning], axis=-2)


def _nodes(frame: Frame, interface: InterfaceRegion) -> Array:
    return group_nodes(frame, interface.region or interface.name)


def _free_nodes(frame: Frame, interfaces: Sequence[InterfaceRegion]) -> Array:
    """The nodes that follow no rigid interface."""
    taken = [_nodes(frame, interface) for interface in interfaces if interface.kind == "rigid"]
    return np.setdiff1d(np.arange(len(frame.points)), np.concatenate([np.zeros(0, np.int64), *taken]))


def loaded_nodes(frame: Frame, interfaces: Sequence[InterfaceRegion]) -> Array:
    """The nodes on which interfaces and beams act."""
    return np.unique(np.concatenate([frame.elements.ravel(), *(_nodes(frame, i) for i in interfaces)]))


def _interface_points(frame: Frame, interfaces: Sequence[InterfaceRegion]) -> Array:
    """(I, 3) the given point, or the mean of the nodes [m]."""
    given = [frame.points[_nodes(frame, i)].mean(axis=0) if i.point is None else i.point for i in interfaces]
    return np.array(given, float).reshape(-1, 3)


def _places(frame: Frame, interfaces: Sequence[InterfaceRegion], positions: Array) -> Array:
    """(I, 3) where each interface is; NaN for those that hold several nodes."""
    single = [len(_nodes(frame, interface)) == 1 for interface in interfaces]
    return np.where(np.array(single, bool).reshape(-1, 1), positions, np.nan)


def _check_interfaces(frame: Frame, interfaces: Sequence[InterfaceRegion]) -> None:
    check_names(interfaces)
    owner: dict[int, str] = {}
    for interface in interfaces:
        for node in _nodes(frame, interface).tolist():
            if node in owner:
                raise InputError(
                    f"interfaces {owner[node]!r} and {interface.name!r} share node {node}: a node cannot follow two of "
                    "them; separate the groups or merge the interfaces"
                )
            owner[node] = interface.name
