"""Bodies from outside matrices: stiffness and mass of another finite-element program, with its nodes.

A `MatrixModel` is nodes, K, M and the map that says which row is which of the six coordinates of which node; nodes of
solids have three coordinates, those of shells and beams five or six. From there the way is the one of meshes:
interfaces, reference conditions, reduction, inertia integrals (see `ffr_prep.nodal_inertia` for what M alone can say).
Geometric stiffening needs stresses, which matrices do not give, so bodies made here have none.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib.metadata import version
from typing import Any

import numpy as np
import scipy.sparse as sp
from threadpoolctl import threadpool_limits

from ffr_prep.basis import Basis, check_basis, factorised
from ffr_prep.body import FlexibleBody, Surface
from ffr_prep.errors import ComputationError, InputError
from ffr_prep.factor import CHOLESKY, FreeBody, Solver
from ffr_prep.interface import CoupledModel, InterfaceRegion
from ffr_prep.invariants import InertiaIntegrals
from ffr_prep.matrix_checks import (
    check_connected,
    check_matrices,
    check_mechanisms,
    mass_is_singular,
    precision_warnings,
)
from ffr_prep.matrix_coupling import couple_matrices, tie_matrices
from ffr_prep.matrix_model import MatrixModel, model_hash, without_empty_rows
from ffr_prep.model import interface_shapes
from ffr_prep.nodal_inertia import nodal_integrals, scalar_integrals, scalar_mass
from ffr_prep.progress import Advance, Stages, no_advance, no_stages
from ffr_prep.provenance import described
from ffr_prep.quality import Quality, assess, completed
from ffr_prep.reduction import Reduction
from ffr_prep.reference import ReferenceConditions, functionals
from ffr_prep.selection import Band

Array = np.ndarray

_VERSIONED = ("ffr", "numpy", "scipy")
_DOUBTFUL = 0.1
_MASSLESS = 1e-9


def reduce_matrices(
    model: MatrixModel,
    *,
    name: str,
    interfaces: Sequence[InterfaceRegion],
    reference: ReferenceConditions,
    reduction: Reduction,
    quality: Band | None = None,
    solver: Solver = CHOLESKY,
    progress: Stages = no_stages,
    advance: Advance = no_advance,
    provenance: Mapping[str, Any] | None = None,
) -> FlexibleBody:
    """The reduced flexible body of outside matrices, in the coordinates of their nodes.

    interfaces : at groups of nodes; one node gives its six coordinates, several follow rigidly or in the mean
    quality    : compare the body with the full model over this band of frequencies, and keep what was found
    solver     : what factorises the stiffness and finds the modes
    progress   : called with the name of each stage as it begins
    advance    : called within long stages with the share that is done and with how far that is in words
    provenance : JSON values kept with the body, beside what is recorded anyway

    Consistent and lumped masses are both fine, also with coordinates that have none. The body has no geometric
    stiffening.

    Raises InputError for matrices that are not those of a free body, and for settings that cannot be used;
    ComputationError for a computation that failed.
    """
    with threadpool_limits(1):  # as for solids: small dense blocks, and reproducible
        return _reduced(
            model, name, interfaces, reference, reduction, quality, solver, progress, advance, provenance or {}
        )


def _reduced(
    given: MatrixModel,
    name: str,
    interfaces: Sequence[InterfaceRegion],
    reference: ReferenceConditions,
    reduction: Reduction,
    quality: Band | None,
    solver: Solver,
    tell: Stages,
    advance: Advance,
    provenance: Mapping[str, Any],
) -> FlexibleBody:
    tell("check the matrices")
    model = without_empty_rows(given)
    check_matrices(model)
    tell("tie the interfaces")
    ties = tie_matrices(model, interfaces)
    coupled = couple_matrices(model, interfaces, ties)
    check_connected(model, coupled, ties)
    L = functionals(reference, coupled)
    tell("factorise the stiffness")
    body = _factorised(model, coupled, ties, solver, advance)
    tell("reduce")
    basis = (
        _basis(reduction, coupled, body, L) if not mass_is_singular(model) else _shifted(reduction, coupled, body, L)
    )
    check_basis(coupled, L, basis)
    if quality:
        tell("compare with the full model")
    assessed = _assessed(model, coupled, body, L, basis, quality) if quality else None
    tell("integrate the inertia")
    Phi = ties @ basis.Z
    integrals, mass, doubts = integrals_of(model, Phi)
    warnings = [*precision_warnings(model), *doubts]
    return FlexibleBody(
        name=name,
        omega2=basis.omega2,
        interfaces=interface_shapes(coupled, basis),
        surface=surface_of_nodes(model, Phi),
        provenance=completed(
            record(model, mass, interfaces, reference, reduction, coupled, warnings)
            | {"solver": described(solver)}
            | dict(provenance),
            basis,
            assessed,
        ),
        **vars(integrals),
    )


def _factorised(
    model: MatrixModel, coupled: CoupledModel, ties: sp.csr_array, solver: Solver, advance: Advance
) -> FreeBody:
    """The factorised stiffness; where it fails, the mechanism that is to blame is named."""
    try:
        return factorised(coupled, solver, advance)
    except ComputationError:
        check_mechanisms(model, coupled, ties)
        raise


def _assessed(model: MatrixModel, coupled: CoupledModel, body: FreeBody, L: Array, basis: Basis, band: Band) -> Quality:
    if mass_is_singular(model):
        raise InputError(
            "the quality of a reduction needs a mass for every coordinate, and some have none: leave out the quality report"
        )
    return assess(coupled, body, L, basis, band)


def surface_of_nodes(model: MatrixModel, Phi: Array) -> Surface | None:
    """The triangles with the translations of their nodes; None without triangles."""
    if model.triangles is None:
        return None
    used, triangles = np.unique(model.triangles, return_inverse=True)
    return Surface(model.points[used], triangles.reshape(-1, 3), model.dofs.on_nodes(Phi)[used, :3])


# ---- basis --------------------------------------------------------------------------------------------------------


def _basis(reduction: Reduction, coupled: CoupledModel, body: FreeBody, L: Array) -> Basis:
    try:
        return reduction.basis(coupled, body, L)
    except np.linalg.LinAlgError as error:
        raise ComputationError(f"the eigenproblem of K and M failed ({error}): is M nearly singular?") from None


def _shifted(reduction: Reduction, coupled: CoupledModel, body: FreeBody, L: Array) -> Basis:
    """The basis where M is singular, found with the definite M + epsilon K in its place, which changes no shape.

    K v = lam M v and K v = mu (M + epsilon K) v have the same vectors, with lam = mu / (1 - epsilon mu); rigid motions and
    static shapes do not depend on M; and of massless motions lam is infinite, but mu = 1 / epsilon.
    """
    epsilon = _epsilon(coupled)
    found = _basis(reduction, replace(coupled, M=sp.csr_array(coupled.M + epsilon * coupled.K)), body, L)
    share = 1 - epsilon * found.omega2
    massless = int(np.sum(share < _MASSLESS))
    if massless:
        raise InputError(
            f"{massless} of the {len(share)} shapes move no mass: M is zero for rotations or nodes that they consist of; ask "
            "for fewer modes, or give the interface nodes a mass"
        )
    return replace(found, Z=found.Z / np.sqrt(share), omega2=found.omega2 / share)


def _epsilon(coupled: CoupledModel) -> float:
    """A time squared [s^2] in the upper middle of the spectrum: the median ratio of the diagonals."""
    mass, stiffness = coupled.M.diagonal(), coupled.K.diagonal()
    massive = mass > 1e-12 * mass.max()
    return float(np.median(mass[massive] / stiffness[massive]))


# ---- inertia ------------------------------------------------------------------------------------------------------


def integrals_of(model: MatrixModel, Phi: Array) -> tuple[InertiaIntegrals, str, list[str]]:
    """The integrals, how they were found, and warnings."""
    m = scalar_mass(model.M, model.dofs)
    if m is not None:
        return scalar_integrals(model.points, model.dofs, m, Phi), "one scalar mass for x, y and z", []
    integrals, defect = nodal_integrals(model.points, model.dofs, model.M, Phi)
    return integrals, "general, by rigid motions of the nodes", _doubts(defect)


def _doubts(defect: Array) -> list[str]:
    doubtful = np.flatnonzero(defect > _DOUBTFUL)
    if not doubtful.size:
        return []
    listed = ", ".join(f"{k + 1} ({defect[k]:.2g})" for k in doubtful[:10])
    return [
        f"the mass matrix does not say how these coordinates change the inertia: {listed}{', ...' * (doubtful.size > 10)} "
        "(terms projected away beside 1); such as torsion of thin bars and waves as short as the elements. Mass, inertia "
        "and momenta are exact"
    ]


# ---- what is known about the body ---------------------------------------------------------------------------------


def record(
    model: MatrixModel,
    mass: str,
    interfaces: Sequence[InterfaceRegion],
    reference: ReferenceConditions,
    reduction: Reduction,
    coupled: CoupledModel,
    warnings: Sequence[str],
) -> dict[str, Any]:
    """Provenance as JSON values: matrices, settings, versions, warnings. No time and no path, so it is reproducible."""
    return {
        "matrices": {
            **model.source,
            "hash": model_hash(model),
            "nodes": len(model.points),
            "degrees_of_freedom": coupled.K.shape[0],
            "mass": mass,
        },
        "interfaces": [described(interface) for interface in interfaces],
        "reference": described(reference),
        "reduction": described(reduction),
        "versions": {package: version(package) for package in _VERSIONED},
        "notes": [*model.notes, "geometric stiffening is not available for matrices from outside"],
        "warnings": list(warnings),
    }
