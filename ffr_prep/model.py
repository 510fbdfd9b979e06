"""A finite-element model of any kind, as far as a reduction needs it, and its reduction to a flexible body."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from typing import Any

import numpy as np

from ffr_prep.basis import check_basis, factorised
from ffr_prep.body import BeamForces, FlexibleBody, Surface
from ffr_prep.errors import ComputationError
from ffr_prep.factor import CHOLESKY, Solver, SupportedBody, solve_refined, supported
from ffr_prep.interface import CoupledModel
from ffr_prep.invariants import InertiaIntegrals
from ffr_prep.progress import Advance, Stages, no_advance, no_stages
from ffr_prep.quality import assess, completed
from ffr_prep.reduce import described, interface_shapes
from ffr_prep.reduction import Reduction
from ffr_prep.reference import ReferenceConditions, functionals
from ffr_prep.selection import Band

Array = np.ndarray


@dataclass(frozen=True)
class Model:
    """What a reduction needs of a model, whatever its elements are; z are the independent coordinates of `coupled`.

    coupled    : stiffness, mass, interfaces and inertial loads
    inertia    : inertia integrals of a basis (Z, n)
    surface    : what is drawn, with the basis (Z, n) at its points
    stressed   : the same with stress modes, and section forces where there are beams
    stiffening : (r, n, n) geometric stiffness of a basis (Z, n) under loads with the static displacements (Z, r), the
                 first twelve of them the inertial loads
    recovery   : how the stress is recovered, in words
    record     : what the model is; JSON values
    packages   : whose versions are recorded
    """

    coupled: CoupledModel
    inertia: Callable[[Array], InertiaIntegrals]
    surface: Callable[[Array], Surface]
    stressed: Callable[[Array], Surface]
    stiffening: Callable[[Array, Array], Array]
    recovery: str
    record: Mapping[str, Any]
    packages: tuple[str, ...] = ("ffr", "numpy", "scipy", "scikit-fem")


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
    stiffness = None
    if stiffening:
        progress("compute the geometric stiffness")
        stiffness = model.stiffening(static_displacements(coupled, supported(body, L)), basis.Z)
    progress("integrate the inertia")
    return FlexibleBody(
        name=name,
        omega2=basis.omega2,
        interfaces=interface_shapes(coupled, basis),
        surface=(model.stressed if stress else model.surface)(basis.Z),
        stiffening=stiffness,
        provenance=completed(
            record(model, reference, reduction)
            | {"solver": described(solver)}
            | ({"stress": model.recovery} if stress else {})
            | dict(provenance or {}),
            basis,
            assessed,
        ),
        **vars(model.inertia(basis.Z)),
    )


def static_displacements(coupled: CoupledModel, held: SupportedBody) -> Array:
    """(Z, 12 + 6 I) of the inertial loads and of unit forces and moments at each interface.

    Raises ComputationError when a static problem fails.
    """
    loads = np.hstack([known_loads(coupled), coupled.C.toarray().T])
    return solve_refined(held, loads, np.zeros((len(held.C), loads.shape[1])))[0]


def known_loads(coupled: CoupledModel) -> Array:
    """(Z, 12) the inertial loads; ComputationError for a model without them."""
    if coupled.inertial_loads is None:
        raise ComputationError("the model does not know its inertial loads: it cannot be stiffened or tied")
    return coupled.inertial_loads


def record(model: Model, reference: ReferenceConditions, reduction: Reduction) -> dict[str, Any]:
    """Provenance as JSON values: model, settings, versions. No time and no path, so it is reproducible."""
    return (
        {"warnings": []}
        | dict(model.record)
        | {
            "reference": described(reference),
            "reduction": described(reduction),
            "versions": {package: version(package) for package in model.packages},
        }
    )


def summed(parts: Sequence[InertiaIntegrals]) -> InertiaIntegrals:
    """The integrals over several parts of a body."""
    return InertiaIntegrals(**{key: sum(vars(part)[key] for part in parts) for key in vars(parts[0])})


def merged(surfaces: Sequence[Surface]) -> Surface:
    """One surface of several; with stress where all have it."""
    first = np.cumsum([0, *(len(surface.points) for surface in surfaces)])
    beams = [surface.beams for surface in surfaces if surface.beams is not None]
    stress = [surface.stress for surface in surfaces if surface.stress is not None]
    moduli = [surface.moduli for surface in surfaces if surface.moduli is not None]
    whole = len(stress) == len(surfaces)
    return Surface(
        points=np.concatenate([surface.points for surface in surfaces]),
        triangles=np.concatenate([s.triangles + start for s, start in zip(surfaces, first, strict=False)]),
        Phi=np.concatenate([surface.Phi for surface in surfaces]),
        stress=np.concatenate(stress) if whole else None,
        moduli=np.concatenate(moduli) if whole else None,
        beams=_merged_beams(beams) if beams else None,
    )


def _merged_beams(beams: Sequence[BeamForces]) -> BeamForces:
    return BeamForces(**{key: np.concatenate([vars(one)[key] for one in beams]) for key in vars(beams[0])})
