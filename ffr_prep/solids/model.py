"""A meshed solid as a model that can be tied to others (`ffr_prep.pipelines.tied`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from ffr_prep.body.provenance import described
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError, require_kind
from ffr_prep.common.progress import Stages, no_stages
from ffr_prep.mesh.geometry.skin import region_faces, with_regions
from ffr_prep.mesh.mesh import Mesh, centre_of_geometry, check_mesh, mesh_hash, misfit_doubts
from ffr_prep.model.coupled import CoupledModel, InterfaceRegion
from ffr_prep.model.invariants import inertia_integrals
from ffr_prep.model.material import material_doubts
from ffr_prep.model.model import Model
from ffr_prep.model.region_rotations import region_stiffening
from ffr_prep.model.ties import check_names
from ffr_prep.reduction.basis import Basis
from ffr_prep.reduction.mesh_resolution import element_edges
from ffr_prep.solids.assembly import Materials, assemble
from ffr_prep.solids.cutting import cut_mesh
from ffr_prep.solids.interfaces import couple, turning_regions
from ffr_prep.solids.mesh_error import added_energy
from ffr_prep.solids.second_order import second_order
from ffr_prep.solids.stiffening import inertial_loads, stiffening_of
from ffr_prep.solids.stress_modes import AVERAGING, boundary, stressed_boundary
from ffr_prep.solvers.threads import on_one_thread


@on_one_thread
def from_mesh(
    mesh: Mesh, material: Materials, interfaces: Sequence[InterfaceRegion] = (), *, progress: Stages = no_stages
) -> Model:
    """The model of a meshed solid, ready to be reduced or to be tied to others.

    material   : one, or one for each volume group
    interfaces : at groups of the mesh, or at faces found by what they are (`ffr_prep.mesh.geometry.region_words`)
    progress   : called with the name of each stage as it begins

    Raises InputError for input that cannot be used.

    >>> model = fp.from_mesh(fp.read_mesh("rod.geo"), fp.material("steel"), [fp.InterfaceRegion("big_eye")])
    """
    require_kind(mesh, Mesh, "mesh", "that of read_mesh; beams and plates belong to from_frame")
    check_names(interfaces)
    progress("check the mesh")
    check_mesh(mesh)
    plain, mesh, given = mesh, with_interfaces(mesh, interfaces), interfaces
    interfaces = [_at_its_centre(mesh, interface) for interface in given]
    progress("assemble stiffness and mass")
    matrices = assemble(mesh, material)
    progress("tie the interfaces")
    coupled = couple(mesh, matrices, interfaces)
    loads = inertial_loads(mesh.points, matrices)
    regions = turning_regions(mesh, matrices, interfaces, coupled, loads)
    coupled = replace(coupled, inertial_loads=coupled.B.T @ loads, edges=element_edges(mesh))
    m = matrices.m
    del matrices, loads  # the stiffness takes as much memory as that of the model

    def field(z: Array) -> Array:
        return np.asarray((coupled.B @ z).reshape(*mesh.points.shape, z.shape[1]))

    def stiffening(static: Array, amplitudes: Array, basis: Array) -> Array:
        of_stress = stiffening_of(mesh, material, field(static), field(basis))
        return np.asarray(of_stress + region_stiffening(regions, static, amplitudes, basis))

    return Model(
        coupled=coupled,
        inertia=lambda basis: inertia_integrals(mesh.points, m, field(basis)),
        surface=lambda basis: boundary(mesh, field(basis)),
        stressed=lambda basis: stressed_boundary(mesh, material, field(basis)),
        stiffening=stiffening,
        second=lambda basis: second_order(mesh, material, coupled, regions, basis),
        recovery=AVERAGING,
        record={
            "mesh": {
                "hash": mesh_hash(plain),
                "nodes": len(mesh.points),
                "elements": element_counts(mesh),
                "degrees_of_freedom": coupled.K.shape[0],
            },
            "material": described(material),
            "interfaces": [_described(plain, interface) for interface in given],
            "notes": list(mesh.notes),
            "warnings": [*mesh_warnings(mesh), *doubts_of_materials(material)],
        },
        mesh_energy=lambda basis: added_energy(mesh, material, [i.region or i.name for i in interfaces], field(basis)),
        cut=lambda cuts: [partial(from_mesh, *part) for part in cut_mesh(mesh, material, interfaces, cuts)],
    )


def with_interfaces(mesh: Mesh, interfaces: Sequence[InterfaceRegion]) -> Mesh:
    """The mesh with a group for the region of each interface."""
    check_names(interfaces)
    for interface in interfaces:
        try:
            mesh = with_regions(mesh, [interface.region or interface.name])
        except InputError as error:
            raise InputError(f"interface {interface.name!r}: {error}") from None
    return mesh


def _at_its_centre(mesh: Mesh, interface: InterfaceRegion) -> InterfaceRegion:
    """An interface at the centroid that a geometry has for its faces: bores of a plate are in its middle plane then, and ends
    of a shaft on its axis, to the last digits, whatever the mesh."""
    centre = None if interface.point is not None else centre_of_geometry(mesh, interface.region or interface.name)
    return interface if centre is None else replace(interface, point=tuple(centre.tolist()))


def _described(mesh: Mesh, interface: InterfaceRegion) -> dict[str, Any]:
    """The interface as JSON values, with the faces that its query has found."""
    faces = region_faces(mesh, interface.region or interface.name)
    return {**described(interface), **({"faces": list(faces)} if faces else {})}


def nodal_basis(model: CoupledModel, basis: Basis) -> Array:
    """Phi (N, 3, n) [1/sqrt(kg)] at the nodes of the mesh."""
    return np.asarray((model.B @ basis.Z).reshape(*model.points.shape, basis.omega2.size))


def mesh_warnings(mesh: Mesh) -> list[str]:
    """Doubts about the results of this mesh, in words."""
    counts, misfits = element_counts(mesh), misfit_doubts(mesh)
    if "tet4" not in counts:
        return misfits
    return [
        *misfits,
        f"{counts['tet4']} first-order tetrahedra (tet4): they are far too stiff in bending (locking); "
        "use second-order elements (tet10)",
    ]


def doubts_of_materials(material: Materials) -> list[str]:
    """What is doubtful about the materials of a mesh, in words."""
    given = material.values() if isinstance(material, Mapping) else [material]
    return [doubt for one in given for doubt in material_doubts(one)]


def element_counts(mesh: Mesh) -> dict[str, int]:
    """Elements by kind."""
    counts: dict[str, int] = {}
    for block in mesh.blocks:
        counts[block.kind] = counts.get(block.kind, 0) + len(block.nodes)
    return counts
