"""From a mesh to a reduced flexible body: the method from end to end."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass, replace
from importlib.metadata import version
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from ffr_prep.basis import Basis, check_basis, factorised
from ffr_prep.body import FlexibleBody, Interface, Surface, content_hash
from ffr_prep.factor import CHOLESKY, Solver, supported
from ffr_prep.interface import CoupledModel, InterfaceRegion, couple
from ffr_prep.invariants import inertia_integrals
from ffr_prep.mesh import Mesh, check_mesh, mesh_hash, surface_triangles
from ffr_prep.progress import Advance, Stages, no_advance, no_stages
from ffr_prep.quality import assess, completed
from ffr_prep.reduction import Reduction
from ffr_prep.reference import ReferenceConditions, functionals
from ffr_prep.selection import Band
from ffr_prep.solids import Materials, assemble
from ffr_prep.stiffening import inertial_loads, stiffening_matrices
from ffr_prep.stress import AVERAGING, stressed_boundary
from ffr_prep.waves import element_edges

Array = np.ndarray


_VERSIONED = ("ffr", "numpy", "scipy", "scikit-fem")


def reduce_mesh(
    mesh: Mesh,
    *,
    name: str,
    material: Materials,
    interfaces: Sequence[InterfaceRegion],
    reference: ReferenceConditions,
    reduction: Reduction,
    stiffening: bool = False,
    stress: bool = False,
    quality: Band | None = None,
    solver: Solver = CHOLESKY,
    progress: Stages = no_stages,
    advance: Advance = no_advance,
    provenance: Mapping[str, Any] | None = None,
) -> FlexibleBody:
    """The reduced flexible body of a meshed solid, in the coordinates of the mesh.

    material   : one, or one for each volume group
    stiffening : also compute the geometric stiffness by load, which a simulation then uses
    stress     : also keep the stress at the nodes of the surface per elastic coordinate
    quality    : compare the body with the full model over this band of frequencies, and keep what was found
    solver     : what factorises the stiffness and finds the modes
    progress   : called with the name of each stage as it begins
    advance    : called within long stages with the share that is done and with how far that is in words
    provenance : JSON values kept with the body, beside what is recorded anyway

    Raises InputError for input that cannot be used and ComputationError for a computation that failed.
    """
    with threadpool_limits(1):  # small dense blocks: waiting threads are slower than one, and one is reproducible
        return _reduced(
            mesh,
            name,
            material,
            interfaces,
            reference,
            reduction,
            stiffening,
            stress,
            quality,
            solver,
            progress,
            advance,
            provenance or {},
        )


def _reduced(
    mesh: Mesh,
    name: str,
    material: Materials,
    interfaces: Sequence[InterfaceRegion],
    reference: ReferenceConditions,
    reduction: Reduction,
    stiffening: bool,
    stress: bool,
    quality: Band | None,
    solver: Solver,
    tell: Stages,
    advance: Advance,
    provenance: Mapping[str, Any],
) -> FlexibleBody:
    tell("check the mesh")
    check_mesh(mesh)
    tell("assemble stiffness and mass")
    matrices = assemble(mesh, material)
    tell("tie the interfaces")
    model = couple(mesh, matrices, interfaces)
    model = replace(model, inertial_loads=model.B.T @ inertial_loads(mesh.points, matrices), edges=element_edges(mesh))
    m = matrices.m
    del matrices  # its stiffness takes as much memory as that of the model
    L = functionals(reference, model)
    tell("factorise the stiffness")
    body = factorised(model, solver, advance)
    tell("reduce")
    basis = reduction.basis(model, body, L)
    check_basis(model, L, basis)
    if quality:
        tell("compare with the full model")
    assessed = assess(model, body, L, basis, quality) if quality else None
    tell("integrate the inertia")
    Phi = nodal_basis(model, basis)
    if stress:
        tell("recover the stress")
    surface = stressed_boundary(mesh, material, Phi) if stress else boundary(mesh, Phi)
    if stiffening:
        tell("compute the geometric stiffness")
    return FlexibleBody(
        name=name,
        omega2=basis.omega2,
        interfaces=interface_shapes(model, basis),
        surface=surface,
        stiffening=stiffening_matrices(mesh, material, model, supported(body, L), Phi) if stiffening else None,
        provenance=completed(
            record(mesh, material, interfaces, reference, reduction, model)
            | {"solver": described(solver)}
            | ({"stress": AVERAGING} if stress else {})
            | dict(provenance),
            basis,
            assessed,
        ),
        **vars(inertia_integrals(mesh.points, m, Phi)),
    )


# ---- parts of the body --------------------------------------------------------------------------------------------


def nodal_basis(model: CoupledModel, basis: Basis) -> Array:
    """Phi (N, 3, n) [1/sqrt(kg)] at the nodes of the mesh."""
    return (model.B @ basis.Z).reshape(*model.points.shape, basis.omega2.size)


def interface_shapes(model: CoupledModel, basis: Basis) -> tuple[Interface, ...]:
    """The interfaces with translation and rotation per elastic coordinate."""
    shapes = (model.C @ basis.Z).reshape(len(model.names), 6, basis.omega2.size)
    attached = zip(model.names, model.positions, shapes, model.kinds, strict=True)
    return tuple(Interface(name, at, six[:3], six[3:], kind) for name, at, six, kind in attached)


def boundary(mesh: Mesh, Phi: Array) -> Surface:
    """The triangulated boundary of the mesh with the basis at its points."""
    points, triangles = surface_triangles(mesh)
    return Surface(mesh.points[points], triangles, Phi[points])


# ---- what is known about the body ---------------------------------------------------------------------------------


def record(
    mesh: Mesh,
    material: Materials,
    interfaces: Sequence[InterfaceRegion],
    reference: ReferenceConditions,
    reduction: Reduction,
    model: CoupledModel,
) -> dict[str, Any]:
    """Provenance as JSON values: mesh, settings, versions, warnings. No time and no path, so it is reproducible."""
    return {
        "mesh": {
            "hash": mesh_hash(mesh),
            "nodes": len(mesh.points),
            "elements": element_counts(mesh),
            "degrees_of_freedom": model.K.shape[0],
        },
        "material": described(material),
        "interfaces": [described(interface) for interface in interfaces],
        "reference": described(reference),
        "reduction": described(reduction),
        "versions": {package: version(package) for package in _VERSIONED},
        "warnings": mesh_warnings(mesh),
    }


def mesh_warnings(mesh: Mesh) -> list[str]:
    """What makes the results of this mesh doubtful, in words."""
    counts = element_counts(mesh)
    if "tet4" not in counts:
        return []
    return [
        f"{counts['tet4']} first-order tetrahedra (tet4): they are far too stiff in bending (locking); "
        "use second-order elements (tet10)"
    ]


def element_counts(mesh: Mesh) -> dict[str, int]:
    """Elements by kind."""
    counts: dict[str, int] = {}
    for block in mesh.blocks:
        counts[block.kind] = counts.get(block.kind, 0) + len(block.nodes)
    return counts


def described(value: Any) -> Any:
    """Settings as JSON values: a dataclass by its type and fields, an array by its hash, a function by its name."""
    if is_dataclass(value):
        return {"type": type(value).__name__} | {f.name: described(getattr(value, f.name)) for f in fields(value)}
    if isinstance(value, Mapping):
        return {str(key): described(entry) for key, entry in value.items()}
    if isinstance(value, (tuple, list)):
        return [described(entry) for entry in value]
    if isinstance(value, np.ndarray):
        return {"shape": list(value.shape), "hash": content_hash(value)}
    if isinstance(value, np.generic):
        return value.item()
    return value.__qualname__ if callable(value) else value
