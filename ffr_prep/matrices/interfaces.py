"""Interfaces on outside matrices: groups of nodes with any of the six coordinates, tied to six-coordinate nodes.

One node with six coordinates is an interface as it is. Several nodes follow rigidly (RBE2), or move the interface in the
mean (RBE3): the rigid motion closest to theirs in the least-squares sense, all nodes counting alike, and rotations, where
nodes have them, about the line on which the nodes lie (as in `ffr_prep.structures.interfaces`).

Source: R. H. MacNeal, The NASTRAN Theoretical Manual (1972), section 5 (rigid elements).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
import scipy.sparse as sp

from ffr_prep.body.accelerations import unit_accelerations
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.matrices.model import MatrixModel, group_nodes, node_in_words
from ffr_prep.model.coupled import CoupledModel, InterfaceRegion, check_independent
from ffr_prep.model.ties import check_names, interface_coordinates, six_rows, tied_rows
from ffr_prep.structures.interfaces import rigid_coordinates, rotation_weight

_DETERMINED = 1e-9


def couple_matrices(model: MatrixModel, interfaces: Sequence[InterfaceRegion], ties: sp.csr_array) -> CoupledModel:
    """The model in the independent coordinates z of the ties (D, Z).

    Raises InputError for interfaces whose coordinates depend on one another.
    """
    positions = _positions(model, interfaces)
    centre = model.points.mean(axis=0)
    free = _free_rows(model, interfaces)
    rigid = [interface.kind == "rigid" for interface in interfaces]
    C = interface_coordinates(rigid, ties, lambda k: _mean_motion(model, interfaces[k], positions[k]))
    check_independent(interfaces, C)
    of_coordinates = positions[np.array(rigid, bool)]
    offsets = rigid_coordinates(model.points - centre)
    return CoupledModel(
        points=model.points,
        B=sp.csr_array(ties[model.dofs.translations().ravel()]),
        K=sp.csr_array(ties.T @ model.K @ ties),
        M=sp.csr_array(ties.T @ model.M @ ties),
        T=np.vstack([model.dofs.of_nodes(offsets)[free], rigid_coordinates(of_coordinates - centre).reshape(-1, 6)]),
        centre=centre,
        places=np.vstack([model.points[model.nodes[free]], _places(model, interfaces, positions)]),
        names=tuple(interface.name for interface in interfaces),
        kinds=tuple("node" if len(_nodes(model, i)) == 1 else i.kind for i in interfaces),
        positions=positions,
        C=C,
        inertial_loads=-(ties.T @ (model.M @ _accelerations(model))),
    )


def _accelerations(model: MatrixModel) -> Array:
    """(D, 12) of the nodes: three translations, three rotations, six products of the angular velocity; as rigid nodes."""
    fields = np.zeros((len(model.points), 6, 12))
    fields[..., :6] = rigid_coordinates(model.points)
    fields[:, :3, 6:] = unit_accelerations(model.points)[6:].transpose(1, 2, 0)
    return model.dofs.of_nodes(fields)


def tie_matrices(model: MatrixModel, interfaces: Sequence[InterfaceRegion]) -> sp.csr_array:
    """(D, Z) the rows from the independent coordinates: those of the free nodes, then six for each rigid interface.

    Raises InputError for repeated names, an unknown group, rigid interfaces that share nodes, and groups that do not
    determine six coordinates.
    """
    _check_interfaces(model, interfaces)
    positions = _positions(model, interfaces)
    at_rigid = [(i, at) for i, at in zip(interfaces, positions, strict=True) if i.kind == "rigid"]
    following = [_following(model, interface, at) for interface, at in at_rigid]
    ties = tied_rows(len(model.nodes), _free_rows(model, interfaces), following)
    ties.eliminate_zeros()
    return ties


def _following(model: MatrixModel, interface: InterfaceRegion, at: Array) -> tuple[Array, Array]:
    """The rows (r,) of the group's nodes, and what they do (r, 6) when the interface moves as a rigid body."""
    rows = np.flatnonzero(np.isin(model.nodes, _nodes(model, interface)))
    motion = rigid_coordinates(model.points[model.nodes[rows]] - at)
    return rows, motion[np.arange(rows.size), model.components[rows]]


def _mean_motion(model: MatrixModel, interface: InterfaceRegion, at: Array) -> sp.csr_array:
    """(6, D) the rigid motion about the point that is closest to the motions of the nodes."""
    rows, following = _following(model, interface, at)
    root = _root_weight(model, rows)
    return six_rows(np.linalg.pinv(root @ following) @ root, rows, len(model.nodes))


def _root_weight(model: MatrixModel, rows: Array) -> sp.csr_array:
    """(s, r) whose square weighs the motions of the rows: translations alike, rotations as `rotation_weight`."""
    nodes, of_node = np.unique(model.nodes[rows], return_inverse=True)
    values, axes = np.linalg.eigh(rotation_weight(model.points[nodes]))
    turning = np.flatnonzero(model.components[rows] >= 3)
    moving = np.flatnonzero(model.components[rows] < 3)
    at = (turning, 3 * of_node[turning] + model.components[rows[turning]] - 3)
    rotations = sp.csr_array((np.ones(turning.size), at), shape=(rows.size, 3 * len(nodes)))
    root = (axes * np.sqrt(np.maximum(values, 0.0))).T
    of_rotations = sp.kron(sp.eye_array(len(nodes)), sp.csr_array(root)) @ rotations.T
    return sp.csr_array(sp.vstack([sp.eye_array(rows.size, format="csr")[moving], of_rotations]))


def _nodes(model: MatrixModel, interface: InterfaceRegion) -> Array:
    return group_nodes(model, interface.region or interface.name)


def _free_rows(model: MatrixModel, interfaces: Sequence[InterfaceRegion]) -> Array:
    """The rows of the nodes that follow no interface."""
    taken = [_nodes(model, interface) for interface in interfaces if interface.kind == "rigid"]
    return np.flatnonzero(~np.isin(model.nodes, np.concatenate([np.zeros(0, np.int64), *taken])))


def _positions(model: MatrixModel, interfaces: Sequence[InterfaceRegion]) -> Array:
    """(I, 3) the given point, or the mean of the nodes [m]."""
    given = [model.points[_nodes(model, i)].mean(axis=0) if i.point is None else i.point for i in interfaces]
    return np.array(given, float).reshape(-1, 3)


def _places(model: MatrixModel, interfaces: Sequence[InterfaceRegion], positions: Array) -> Array:
    """(6R, 3) where the coordinates of the rigid interfaces are; NaN for those that hold several nodes."""
    rigid = [k for k, interface in enumerate(interfaces) if interface.kind == "rigid"]
    single = [len(_nodes(model, interfaces[k])) == 1 for k in rigid]
    return np.repeat(np.where(np.array(single, bool).reshape(-1, 1), positions[rigid], np.nan), 6, axis=0)


# ---- guards -------------------------------------------------------------------------------------------------------


def _check_interfaces(model: MatrixModel, interfaces: Sequence[InterfaceRegion]) -> None:
    check_names(interfaces)
    for interface in interfaces:
        _check_determined(model, interface)
    for one, other in combinations([i for i in interfaces if i.kind == "rigid"], 2):
        shared = np.intersect1d(_nodes(model, one), _nodes(model, other))
        if shared.size:
            raise InputError(
                f"rigid interfaces {one.name!r} and {other.name!r} share {shared.size} nodes, the first being "
                f"{node_in_words(model, shared[0])}: a node cannot follow two of them; make one 'mean' or separate the groups"
            )


def _check_determined(model: MatrixModel, interface: InterfaceRegion) -> None:
    """Six coordinates need a node with six, or nodes that are not on one line."""
    nodes = _nodes(model, interface)
    rows, motion = _following(model, interface, model.points[nodes].mean(axis=0))
    size = np.linalg.norm(np.ptp(model.points[nodes], axis=0)) or 1.0
    scaled = (_root_weight(model, rows) @ motion) / np.array([1.0, 1.0, 1.0, size, size, size])
    if np.linalg.matrix_rank(scaled, tol=_DETERMINED * np.linalg.norm(scaled)) < 6:
        raise InputError(
            f"interface {interface.name!r}: the {len(nodes)} nodes of group {interface.region or interface.name!r} do not "
            f"determine its six coordinates (the first is {node_in_words(model, nodes[0])}): take a node with three "
            "rotations, or three or more nodes that are not on one line"
        )
