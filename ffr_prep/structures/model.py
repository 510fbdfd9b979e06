"""A frame of beams and plates as a model that can be reduced.

The families of elements (`ffr_prep.structures.element_families`) deliver stiffness and mass points. Assembly is
u = C S W C_bar B_1 q_n with the Boolean B_1 (`connectivity`). Interfaces and reference conditions leave q_n = B_2 q_f: `tie`
has the independent coordinates of interfaces, and `ffr_prep.reduction.basis.in_frame` takes out of these what the
conditions L prevent. All inertia integrals are sums over the mass points, as exact as the shape functions; the body that
results is of the same kind as that of a meshed solid.

Sources: A. A. Shabana, Dynamics of Multibody Systems (2013), sections 6.1-6.7.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import scipy.sparse as sp

from ffr_prep.body import WITHOUT_SHEAR, Surface
from ffr_prep.body.accelerations import INERTIAL, unit_accelerations
from ffr_prep.body.provenance import described
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import require_kind
from ffr_prep.common.process_memory import check_memory
from ffr_prep.common.progress import Stages, no_stages
from ffr_prep.model.coupled import CoupledModel, InterfaceRegion
from ffr_prep.model.invariants import InertiaIntegrals, inertia_integrals
from ffr_prep.model.material import material_doubts
from ffr_prep.model.model import Model, merged, summed
from ffr_prep.model.region_rotations import region_stiffening
from ffr_prep.model.second_order import SecondOrder
from ffr_prep.model.ties import check_names
from ffr_prep.solvers.threads import on_one_thread
from ffr_prep.structures.cutting import cut_frame
from ffr_prep.structures.element_families import Family, connectivity, element_values, families
from ffr_prep.structures.frame import Frame, check_frame, frame_hash, joint_doubts, overlap_doubts, thickness_doubts
from ffr_prep.structures.interfaces import couple_frame, loaded_nodes, tie, turning_regions
from ffr_prep.structures.plate_mesh_error import added_energy
from ffr_prep.structures.second_order import frame_second_order

_CHUNK = 512
_ASSEMBLY = (18e3, 50e3, 65e3)  # bytes for a beam, a triangle, a quadrilateral: somewhat less than was measured


@dataclass(frozen=True)
class StructuralMatrices:
    """The assembled model in the nodal coordinates q_n (6N,): three translations and three rotations of every node.

    K, M  : (6N, 6N) stiffness and consistent mass
    loads : (6N, 12) loads of unit accelerations: translation, rotation, products of the angular velocity
    """

    K: sp.csr_array
    M: sp.csr_array
    loads: Array


@on_one_thread
def from_frame(frame: Frame, interfaces: Sequence[InterfaceRegion] = (), *, progress: Stages = no_stages) -> Model:
    """The model of a frame of beams and plates, ready to be reduced or to be tied to others.

    interfaces : at groups of nodes. Rigid ones: one node gives its six coordinates, several follow the interface. Mean
                 ones leave their nodes free and move with them in the mean
    progress   : called with the name of each stage as it begins

    Raises InputError for input that cannot be used.

    >>> model = fp.from_frame(frame, [fp.InterfaceRegion("root"), fp.InterfaceRegion("tip")])
    """
    require_kind(frame, Frame, "frame", "one of polyline, panel or read_frame; a mesh belongs to from_mesh")
    check_names(interfaces)
    _check_size(frame)
    progress("check the frame")
    check_frame(frame)
    progress("assemble stiffness and mass")
    parts = families(frame)
    matrices = assemble_frame(frame, parts)
    progress("tie the interfaces")
    ties = tie(frame, interfaces)
    coupled = replace(
        couple_frame(frame, matrices.K, matrices.M, interfaces, ties),
        inertial_loads=ties.T @ matrices.loads,
        edges=np.concatenate([_edges(part.nodes) for part in parts]),
        dimension=max(min(part.nodes.shape[1], 3) for part in parts) - 1,
    )
    regions = turning_regions(frame, matrices.K, interfaces, ties, coupled, matrices.loads)

    def nodal(part: Family, z: Array) -> Array:
        return element_values(part, ties @ z)

    def stiffening(static: Array, amplitudes: Array, basis: Array) -> Array:
        inside = amplitudes[:INERTIAL]
        of_elements = [part.stiffening(nodal(part, static), inside, nodal(part, basis)) for part in parts]
        return np.sum(of_elements, axis=0) + region_stiffening(regions, static, amplitudes, basis)

    def second(basis: Array) -> SecondOrder:
        count = INERTIAL + 6 * len(interfaces)
        known = stiffening(np.zeros((len(basis), count)), np.eye(count), basis)
        return frame_second_order(parts, ties, regions, known, basis)

    def surface(basis: Array) -> Surface | None:
        return merged([part.surface(nodal(part, basis)) for part in parts])

    def stressed(basis: Array) -> Surface | None:
        return merged([part.stressed(nodal(part, basis)) for part in parts])

    return Model(
        coupled=coupled,
        inertia=lambda basis: summed([inertia(part, nodal(part, basis)) for part in parts]),
        surface=surface,
        stressed=stressed,
        stiffening=stiffening,
        second=second,
        recovery="; ".join(dict.fromkeys(part.recovery for part in parts)),
        record=_record(frame, interfaces, coupled, parts),
        mesh_energy=partial(_mesh_energy, parts, ties, coupled, frame, interfaces),
        cut=lambda cuts: [partial(from_frame, *part) for part in cut_frame(frame, interfaces, cuts)],
    )


def _mesh_energy(
    parts: Sequence[Family],
    ties: sp.csr_array,
    coupled: CoupledModel,
    frame: Frame,
    interfaces: Sequence[InterfaceRegion],
    basis: Array,
) -> Array:
    """(n,) twice the strain energy that the size of the elements adds to a basis (Z, n) of vibrations of unit mass."""
    omega2, q = np.einsum("zi,zi->i", basis, coupled.K @ basis), ties @ basis
    of_families = [part.mesh_energy(element_values(part, q), omega2) for part in parts if part.mesh_energy]
    of_plates = added_energy(frame, loaded_nodes(frame, interfaces), q)
    total: Array = np.sum([*of_families, *([] if of_plates is None else [of_plates])], axis=0)
    return total


def _check_size(frame: Frame) -> None:
    """InputError where the machine has not the memory that the matrices of all elements take."""
    counts = [len(nodes) for nodes in (frame.elements, frame.triangles, frame.quadrilaterals)]
    size = sum(each * count for each, count in zip(_ASSEMBLY, counts, strict=True))
    check_memory(size, f"the assembly of {sum(counts)} elements", "ask for fewer elements, such as by longer ones")


# ---- assembly -----------------------------------------------------------------------------------------------------


def assemble_frame(frame: Frame, parts: Sequence[Family]) -> StructuralMatrices:
    """Stiffness, mass and inertial loads in the coordinates of all nodes."""
    size = 6 * len(frame.points)
    K, M, loads = sp.csr_array((size, size)), sp.csr_array((size, size)), np.zeros((size, 12))
    for part in parts:
        B_1 = connectivity(part.nodes, len(frame.points))
        K = K + B_1.T @ _blocks(part.stiffness) @ B_1
        M = M + B_1.T @ _blocks(element_mass(part)) @ B_1
        loads -= B_1.T @ _element_loads(part).reshape(-1, 12)
    return StructuralMatrices(sp.csr_array((K + K.T) / 2), sp.csr_array((M + M.T) / 2), loads)


def _edges(nodes: Array) -> Array:
    """(E k, 2) the edges of elements (E, k); those of beams twice."""
    return np.stack([nodes, np.roll(nodes, -1, axis=1)], axis=-1).reshape(-1, 2)


def element_mass(part: Family) -> Array:
    """(E, 6k, 6k) consistent mass."""
    count, points, _, n = part.field.shape
    weighted = part.field * np.sqrt(part.mass)[..., None, None]
    flat = weighted.reshape(count, 3 * points, n)
    return flat.transpose(0, 2, 1) @ flat


def _element_loads(part: Family) -> Array:
    """(E, 6k, 12) integrals of shape functions times unit accelerations over the mass."""
    count, points, _, n = part.field.shape
    accelerations = unit_accelerations(part.positions.reshape(-1, 3)).reshape(12, count, points, 3)
    forces = (part.mass[..., None] * accelerations).reshape(12, count, 3 * points).transpose(1, 2, 0)
    return part.field.reshape(count, 3 * points, n).transpose(0, 2, 1) @ forces


def _blocks(matrices: Array) -> sp.csr_array:
    """The block-diagonal matrix of (E, n, n)."""
    count, n, _ = matrices.shape
    blocks = sp.bsr_array((matrices, np.arange(count), np.arange(count + 1)), shape=(count * n, count * n))
    return sp.csr_array(blocks)


def inertia(part: Family, nodal: Array) -> InertiaIntegrals:
    """The inertia integrals of a family for the element coordinates (E, 6k, n) per elastic coordinate."""
    return summed([_inertia(part, nodal, slice(k, k + _CHUNK)) for k in range(0, len(nodal), _CHUNK)])


def _inertia(part: Family, nodal: Array, own: slice) -> InertiaIntegrals:
    Phi = part.field[own] @ nodal[own, None]
    mass = sp.diags_array(part.mass[own].ravel())
    positions = part.positions[own].reshape(-1, 3)
    return inertia_integrals(positions, mass, Phi.reshape(len(positions), 3, nodal.shape[2]))


# ---- what is known about the body ---------------------------------------------------------------------------------


def _record(
    frame: Frame, interfaces: Sequence[InterfaceRegion], coupled: CoupledModel, parts: Sequence[Family]
) -> dict[str, Any]:
    materials = [*(member.material for member in frame.members), *(shell.material for shell in frame.shells)]
    return {
        "frame": {
            "hash": frame_hash(frame),
            "nodes": len(frame.points),
            "elements": {part.name: len(part.nodes) for part in parts},
            "degrees_of_freedom": coupled.K.shape[0],
        },
        "members": [_strict(described(member)) for member in frame.members],
        "shells": [described(shell) for shell in frame.shells],
        "interfaces": [described(interface) for interface in interfaces],
        WITHOUT_SHEAR: list(dict.fromkeys(m.section.name for m in frame.members if not m.section.shear)),
        "warnings": [
            *overlap_doubts(frame),
            *joint_doubts(frame),
            *thickness_doubts(frame),
            *dict.fromkeys(said for one in materials for said in material_doubts(one)),
        ],
    }


def _strict(value: Any) -> Any:
    """Without infinite numbers, which JSON does not have: a section rigid in shear has the factor "inf"."""
    if isinstance(value, dict):
        return {key: _strict(entry) for key, entry in value.items()}
    return "inf" if value == np.inf else value
