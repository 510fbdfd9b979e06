"""A model of any kind reduced to a flexible body: the method from end to end."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.metadata import version
from typing import Any

import numpy as np

from ffr_prep.body import FlexibleBody, Interface
from ffr_prep.body.provenance import described
from ffr_prep.common.errors import InputError
from ffr_prep.common.progress import Advance, Stages, no_advance, no_stages
from ffr_prep.model.coupled import CoupledModel
from ffr_prep.model.model import Model
from ffr_prep.model.reactions import in_equilibrium, known_loads
from ffr_prep.model.reference import ReferenceConditions, functionals
from ffr_prep.reduction.basis import Basis, Reduction, check_basis, factorised
from ffr_prep.reduction.quality import assess, completed
from ffr_prep.reduction.selection import Band
from ffr_prep.solvers.factor import CHOLESKY, Solver, SupportedBody, solve_refined, supported

Array = np.ndarray


def reduce_model(
    model: Model,
    *,
    name: str,
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
    """The reduced flexible body of a model.

    stiffening : also compute the geometric stiffness by load, which a simulation then uses
    stress     : also keep section forces of beams and the stress at the surface per elastic coordinate
    quality    : compare the body with the full model over this band of frequencies, and keep what was found
    solver     : what factorises the stiffness and finds the modes
    progress   : called with the name of each stage as it begins
    advance    : called within long stages with the share that is done and with how far that is in words
    provenance : JSON values kept with the body, beside what is recorded anyway

    Raises InputError for input that cannot be used and ComputationError for a computation that failed.
    """
    for what, given, such in (
        ("reference", reference, 'FixedTo("root")'),
        ("reduction", reduction, "CraigBampton(10)"),
    ):
        if isinstance(given, (str, type)):
            raise InputError(f"{what} is {given!r}; give one such as {such}")
    coupled = model.coupled
    L = functionals(reference, coupled)
    progress("factorise the stiffness")
    body = factorised(coupled, solver, advance)
    progress("reduce")
    basis = reduction.basis(coupled, body, L)
    check_basis(coupled, L, basis)
    if quality:
        progress("compare with the full model")
    assessed = assess(coupled, body, L, basis, quality) if quality else None
    progress("integrate the inertia")
    integrals = model.inertia(basis.Z)
    if stress:
        progress("recover the stress")
    surface = (model.stressed if stress else model.surface)(basis.Z)
    if stiffening:
        progress("compute the geometric stiffness")
    recorded = record(model, reference, reduction, model.doubts(basis.Z)) | {"solver": described(solver)}
    recovered = {"stress": model.recovery} if stress else {}
    return FlexibleBody(
        name=name,
        omega2=basis.omega2,
        interfaces=interface_shapes(coupled, basis),
        surface=surface,
        stiffening=stiffening_matrices(model, reference, supported(body, L), basis) if stiffening else None,
        provenance=completed(recorded | recovered | dict(provenance or {}), basis, assessed),
        **vars(integrals),
    )


def interface_shapes(model: CoupledModel, basis: Basis) -> tuple[Interface, ...]:
    """The interfaces with translation and rotation per elastic coordinate."""
    shapes = (model.C @ basis.Z).reshape(len(model.names), 6, basis.omega2.size)
    attached = zip(model.names, model.positions, shapes, model.kinds, strict=True)
    return tuple(Interface(name, at, six[:3], six[3:], kind) for name, at, six, kind in attached)


def stiffening_matrices(model: Model, reference: ReferenceConditions, held: SupportedBody, basis: Basis) -> Array:
    """(12 + 6 I, n, n) reduced geometric stiffness per unit load, in the order of `FlexibleBody.stiffening`.

    held : the body under its reference conditions

    Raises ComputationError when a static problem fails.
    """
    loads = known_loads(model.coupled)
    static = solve_refined(held, loads, np.zeros((len(held.C), loads.shape[1])))[0]
    K = model.stiffening(static, in_equilibrium(model.coupled, reference, static), basis.Z)
    return (K + K.transpose(0, 2, 1)) / 2


def record(model: Model, reference: ReferenceConditions, reduction: Reduction, doubts: Sequence[str]) -> dict[str, Any]:
    """Provenance as JSON values: model, settings, versions. No time and no path, so it is reproducible."""
    return dict(model.record) | {
        "reference": described(reference),
        "reduction": described(reduction),
        "versions": {package: version(package) for package in model.packages},
        "warnings": [*model.record.get("warnings", []), *doubts],
    }
