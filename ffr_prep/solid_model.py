"""A meshed solid as a model that can be tied to others (`ffr_prep.tied`)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ffr_prep.interface import InterfaceRegion, couple
from ffr_prep.invariants import inertia_integrals
from ffr_prep.mesh import Mesh, check_mesh, mesh_hash
from ffr_prep.model import Model
from ffr_prep.progress import Stages, no_stages
from ffr_prep.reduce import boundary, described, element_counts, mesh_warnings
from ffr_prep.solids import Materials, assemble
from ffr_prep.stiffening import inertial_loads, stiffening_of
from ffr_prep.stress import AVERAGING, stressed_boundary
from ffr_prep.waves import element_edges

Array = np.ndarray


def solid_model(
    mesh: Mesh,
    material: Materials,
    interfaces: Sequence[InterfaceRegion],
    progress: Stages = no_stages,
) -> Model:
    """The solid with its interfaces, of one material or of one for each volume group.

    Raises InputError for input that cannot be used.
    """
    progress("check the mesh")
    check_mesh(mesh)
    progress("assemble stiffness and mass")
    matrices = assemble(mesh, material)
    progress("tie the interfaces")
    coupled = couple(mesh, matrices, interfaces)

    def field(z: Array) -> Array:
        return (coupled.B @ z).reshape(*mesh.points.shape, z.shape[1])

    return Model(
        coupled=replace(
            coupled, inertial_loads=coupled.B.T @ inertial_loads(mesh.points, matrices), edges=element_edges(mesh)
        ),
        inertia=lambda basis: inertia_integrals(mesh.points, matrices.m, field(basis)),
        surface=lambda basis: boundary(mesh, field(basis)),
        stressed=lambda basis: stressed_boundary(mesh, material, field(basis)),
        stiffening=lambda static, basis: stiffening_of(mesh, material, field(static), field(basis)),
        recovery=AVERAGING,
        record={
            "mesh": {
                "hash": mesh_hash(mesh),
                "nodes": len(mesh.points),
                "elements": element_counts(mesh),
                "degrees_of_freedom": coupled.K.shape[0],
            },
            "material": described(material),
            "interfaces": [described(interface) for interface in interfaces],
            "warnings": mesh_warnings(mesh),
        },
    )
