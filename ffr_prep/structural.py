"""From a frame of structural elements to a reduced flexible body.

An element family delivers, for its elements, the stiffness of their nodal coordinates and *mass points*: points inside
the elements that integrate every product of two displacement fields exactly, with the undeformed position, the mass and
the shape functions C S W C_bar there. Assembly is u = C S W C_bar B_1 q_n with the Boolean B_1. All inertia integrals
are then sums over the mass points, as exact as the shape functions; the body that results is of the same kind as that
of a meshed solid. Beams are such a family; plates and shells can join with the same three arrays.

Sources: A. A. Shabana, Dynamics of Multibody Systems (2013), sections 6.1-6.7.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from typing import Any

import numpy as np
import scipy.sparse as sp
from threadpoolctl import threadpool_limits

from ffr_prep.beam_stiffening import beam_stiffening, unit_accelerations
from ffr_prep.beam_stress import SECTION_STRESS, stressed_sweep
from ffr_prep.beams import Beams, beams, field, mass_points, stiffness, undeformed
from ffr_prep.body import FlexibleBody
from ffr_prep.errors import InputError
from ffr_prep.factor import SupportedBody, supported
from ffr_prep.frame import Frame, check_frame, ends, frame_hash, group_nodes, orientations
from ffr_prep.interface import CoupledModel, InterfaceRegion, rigid_field
from ffr_prep.invariants import inertia_integrals
from ffr_prep.reduce import described, interface_shapes
from ffr_prep.reduction import Basis, Reduction, check_basis, factorised
from ffr_prep.reference import ReferenceConditions, functionals
from ffr_prep.sweep import swept_surface

Array = np.ndarray

_VERSIONED = ("ffr", "numpy", "scipy")


@dataclass(frozen=True)
class StructuralMatrices:
    """The assembled model in the nodal coordinates q_n (6N,): three translations and three rotations of every node.

    B_1       : (12E, 6N) Boolean connectivity, the coordinates of each element among those of all nodes
    K         : (6N, 6N) stiffness
    positions : (P, 3) mass points of the undeformed body [m]
    mass      : (P,) their masses [kg]
    N         : (3P, 6N) displacement of the mass points, u = N q_n
    """

    B_1: sp.csr_array
    K: sp.csr_array
    positions: Array
    mass: Array
    N: sp.csr_array


def reduce_frame(
    frame: Frame,
    *,
    name: str,
    interfaces: Sequence[InterfaceRegion],
    reference: ReferenceConditions,
    reduction: Reduction,
    stiffening: bool = False,
    stress: bool = False,
    progress: Callable[[str], None] | None = None,
    provenance: Mapping[str, Any] | None = None,
) -> FlexibleBody:
    """The reduced flexible body of a frame of beams, in the coordinates of its nodes.

    interfaces : rigid ones at groups of nodes: one node gives its six coordinates, several follow the interface rigidly
    stiffening : also compute the geometric stiffness by load, which a simulation then uses
    stress     : also keep section forces and the stress at the outlines of the sections per elastic coordinate
    progress   : called with the name of each stage as it begins
    provenance : JSON values kept with the body, beside what is recorded anyway

    Raises InputError for input that cannot be used and ComputationError for a computation that failed.
    """
    with threadpool_limits(1):  # as for solids: small dense blocks, and reproducible
        return _reduced(
            frame, name, interfaces, reference, reduction, stiffening, stress, progress or _silent, provenance or {}
        )


def _reduced(
    frame: Frame,
    name: str,
    interfaces: Sequence[InterfaceRegion],
    reference: ReferenceConditions,
    reduction: Reduction,
    stiffening: bool,
    stress: bool,
    tell: Callable[[str], None],
    provenance: Mapping[str, Any],
) -> FlexibleBody:
    tell("check the frame")
    check_frame(frame)
    tell("assemble stiffness and mass")
    elements = beam_elements(frame)
    matrices = assemble_frame(frame, elements)
    tell("tie the interfaces")
    ties = tie(frame, interfaces)
    model = couple_frame(frame, matrices, interfaces, ties)
    L = functionals(reference, model)
    tell("factorise the stiffness")
    body = factorised(model)
    tell("reduce")
    basis = reduction.basis(model, body, L)
    check_basis(model, L, basis)
    tell("integrate the inertia")
    q_n = ties @ basis.Z
    Phi = (matrices.N @ q_n).reshape(-1, 3, basis.omega2.size)
    nodal = (matrices.B_1 @ q_n).reshape(-1, 12, basis.omega2.size)
    return FlexibleBody(
        name=name,
        omega2=basis.omega2,
        interfaces=interface_shapes(model, basis),
        surface=(stressed_sweep if stress else swept_surface)(frame, elements, nodal),
        stiffening=_stiffening(elements, matrices, ties, model, supported(body, L), basis) if stiffening else None,
        provenance=record(frame, interfaces, reference, reduction, model)
        | ({"stress": SECTION_STRESS} if stress else {})
        | dict(provenance),
        **vars(inertia_integrals(matrices.positions, sp.diags_array(matrices.mass), Phi)),
    )


# ---- assembly -----------------------------------------------------------------------------------------------------


def beam_elements(frame: Frame) -> Beams:
    """The beam elements of the frame; InputError for one without length or a needed orientation."""
    members = [frame.members[k] for k in frame.member_of]
    return beams(ends(frame), [m.section for m in members], [m.material for m in members], orientations(frame))


def assemble_frame(frame: Frame, elements: Beams) -> StructuralMatrices:
    """Stiffness, mass points and their displacements in the coordinates of all nodes."""
    B_1 = connectivity(frame)
    xi, across, mass = mass_points(elements)
    K = sp.block_diag([sp.coo_array(k) for k in stiffness(elements)], format="csr")
    C_S_W_C_bar = field(elements, xi, across).reshape(len(elements.length), -1, 12)
    return StructuralMatrices(
        B_1=B_1,
        K=sp.csr_array(B_1.T @ K @ B_1),
        positions=undeformed(elements, xi, across).reshape(-1, 3),
        mass=mass.ravel(),
        N=sp.csr_array(sp.block_diag([sp.coo_array(w) for w in C_S_W_C_bar], format="csr") @ B_1),
    )


def connectivity(frame: Frame) -> sp.csr_array:
    """B_1 (12E, 6N)."""
    columns = (6 * frame.elements[:, :, None] + np.arange(6)).ravel()
    rows = np.arange(columns.size)
    return sp.csr_array((np.ones(columns.size), (rows, columns)), shape=(columns.size, 6 * len(frame.points)))


def inertial_loads(matrices: StructuralMatrices) -> Array:
    """(6N, 12) nodal loads of unit accelerations: translation, rotation, products of the angular velocity."""
    forces = matrices.mass[:, None] * unit_accelerations(matrices.positions)
    return -(matrices.N.T @ forces.reshape(len(forces), -1).T)


def _stiffening(
    elements: Beams,
    matrices: StructuralMatrices,
    ties: sp.csr_array,
    model: CoupledModel,
    held: SupportedBody,
    basis: Basis,
) -> Array:
    inertial = ties.T @ inertial_loads(matrices)
    return beam_stiffening(elements, matrices.B_1, ties, model, held, inertial, basis.Z)


# ---- interfaces ---------------------------------------------------------------------------------------------------


def couple_frame(
    frame: Frame, matrices: StructuralMatrices, interfaces: Sequence[InterfaceRegion], ties: sp.csr_array
) -> CoupledModel:
    """The model in the independent coordinates z: those of the free nodes, then six for each interface."""
    positions = _interface_points(frame, interfaces)
    free = _free_nodes(frame, interfaces)
    centre = frame.points.mean(axis=0)
    displacements = matrices.N @ ties
    Z = ties.shape[1]
    translations = (6 * np.arange(len(frame.points))[:, None] + np.arange(3)).ravel()
    return CoupledModel(
        points=frame.points,
        B=sp.csr_array(ties[translations]),
        K=sp.csr_array(ties.T @ matrices.K @ ties),
        M=sp.csr_array(displacements.T @ sp.diags_array(np.repeat(matrices.mass, 3)) @ displacements),
        T=_rigid_coordinates(np.vstack([frame.points[free], positions]) - centre).reshape(-1, 6),
        centre=centre,
        places=np.repeat(np.vstack([frame.points[free], _places(frame, interfaces, positions)]), 6, axis=0),
        names=tuple(interface.name for interface in interfaces),
        kinds=tuple("node" if len(_nodes(frame, i)) == 1 else "rigid" for i in interfaces),
        positions=positions,
        C=sp.csr_array(sp.eye_array(6 * len(interfaces), Z, k=Z - 6 * len(interfaces), format="csr")),
    )


def tie(frame: Frame, interfaces: Sequence[InterfaceRegion]) -> sp.csr_array:
    """(6N, Z) coordinates of all nodes from the independent ones, q_n = tie z.

    Raises InputError for repeated names, a kind other than "rigid", an unknown group, or interfaces that share nodes.
    """
    _check_interfaces(frame, interfaces)
    positions = _interface_points(frame, interfaces)
    free = (6 * _free_nodes(frame, interfaces)[:, None] + np.arange(6)).ravel()
    rows, columns, values = [free], [np.arange(free.size)], [np.ones(free.size)]
    for k, interface in enumerate(interfaces):
        nodes = _nodes(frame, interface)
        following = _rigid_coordinates(frame.points[nodes] - positions[k])
        own_rows = 6 * nodes[:, None, None] + np.arange(6)[:, None]
        own_columns = free.size + 6 * k + np.arange(6)
        rows.append(np.broadcast_to(own_rows, following.shape).ravel())
        columns.append(np.broadcast_to(own_columns, following.shape).ravel())
        values.append(following.ravel())
    shape = (6 * len(frame.points), free.size + 6 * len(interfaces))
    triplets = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    return sp.csr_array(sp.coo_array(triplets, shape=shape))


def _rigid_coordinates(offsets: Array) -> Array:
    """(..., 3) -> (..., 6, 6): the six coordinates of a node by three translations and three rotations."""
    turning = np.broadcast_to(np.hstack([np.zeros((3, 3)), np.eye(3)]), (*offsets.shape, 6))
    return np.concatenate([rigid_field(offsets), turning], axis=-2)


def _nodes(frame: Frame, interface: InterfaceRegion) -> Array:
    return group_nodes(frame, interface.region or interface.name)


def _free_nodes(frame: Frame, interfaces: Sequence[InterfaceRegion]) -> Array:
    """The nodes that follow no interface."""
    taken = [_nodes(frame, interface) for interface in interfaces]
    return np.setdiff1d(np.arange(len(frame.points)), np.concatenate([np.zeros(0, np.int64), *taken]))


def _interface_points(frame: Frame, interfaces: Sequence[InterfaceRegion]) -> Array:
    """(I, 3) the given point, or the mean of the nodes [m]."""
    given = [frame.points[_nodes(frame, i)].mean(axis=0) if i.point is None else i.point for i in interfaces]
    return np.array(given, float).reshape(-1, 3)


def _places(frame: Frame, interfaces: Sequence[InterfaceRegion], positions: Array) -> Array:
    """(I, 3) where each interface is; NaN for those that hold several nodes."""
    single = [len(_nodes(frame, interface)) == 1 for interface in interfaces]
    return np.where(np.array(single, bool).reshape(-1, 1), positions, np.nan)


def _check_interfaces(frame: Frame, interfaces: Sequence[InterfaceRegion]) -> None:
    names = [interface.name for interface in interfaces]
    repeated = sorted({name for name in names if names.count(name) > 1})
    if repeated:
        raise InputError(f"interface name {repeated[0]!r} is given more than once: every interface needs its own name")
    owner: dict[int, str] = {}
    for interface in interfaces:
        if interface.kind != "rigid":
            raise InputError(
                f"interface {interface.name!r}: kind is {interface.kind!r}; the nodes of a frame are tied rigidly, so "
                "leave the kind out"
            )
        for node in _nodes(frame, interface).tolist():
            if node in owner:
                raise InputError(
                    f"interfaces {owner[node]!r} and {interface.name!r} share node {node}: a node cannot follow two of "
                    "them; separate the groups or merge the interfaces"
                )
            owner[node] = interface.name


# ---- what is known about the body ---------------------------------------------------------------------------------


def record(
    frame: Frame,
    interfaces: Sequence[InterfaceRegion],
    reference: ReferenceConditions,
    reduction: Reduction,
    model: CoupledModel,
) -> dict[str, Any]:
    """Provenance as JSON values: frame, settings, versions. No time and no path, so it is reproducible."""
    return {
        "frame": {
            "hash": frame_hash(frame),
            "nodes": len(frame.points),
            "elements": {"beam": len(frame.elements)},
            "degrees_of_freedom": model.K.shape[0],
        },
        "members": [_strict(described(member)) for member in frame.members],
        "interfaces": [described(interface) for interface in interfaces],
        "reference": described(reference),
        "reduction": described(reduction),
        "versions": {package: version(package) for package in _VERSIONED},
        "warnings": [],
    }


def _strict(value: Any) -> Any:
    """Without infinite numbers, which JSON does not have: a section rigid in shear has the factor "inf"."""
    if isinstance(value, dict):
        return {key: _strict(entry) for key, entry in value.items()}
    return "inf" if value == np.inf else value


def _silent(stage: str) -> None:
    pass
