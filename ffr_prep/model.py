"""A finite-element model of any kind, as far as a reduction needs it, and its reduction to a flexible body."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from typing import Any

import numpy as np

from ffr_prep.basis import Basis, check_basis, factorised
from ffr_prep.body import BeamForces, FlexibleBody, Interface, Surface
from ffr_prep.errors import InputError
from ffr_prep.factor import CHOLESKY, Solver, SupportedBody, solve_refined, supported
from ffr_prep.interface import CoupledModel
from ffr_prep.invariants import InertiaIntegrals
from ffr_prep.progress import Advance, Stages, no_advance, no_stages
from ffr_prep.provenance import described
from ffr_prep.quality import assess, completed
from ffr_prep.reactions import in_equilibrium, known_loads
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
    stiffening : (r, n, n) geometric stiffness of a basis (Z, n) under r loads, of their static displacements (Z, r) and
                 their amplitudes (12 + 6 I, r) of the known loads (`ffr_prep.reactions`), reactions included
    recovery   : how the stress is recovered, in words
    record     : what the model is; JSON values
    packages   : whose versions are recorded
    doubts     : what the integrals of a basis (Z, n) cannot be trusted with, in words
    """

    coupled: CoupledModel
    inertia: Callable[[Array], InertiaIntegrals]
    surface: Callable[[Array], Surface]
    stressed: Callable[[Array], Surface]
    stiffening: Callable[[Array, Array, Array], Array]
    recovery: str
    record: Mapping[str, Any]
    packages: tuple[str, ...] = ("ffr", "numpy", "scipy", "scikit-fem")
    doubts: Callable[[Array], list[str]] = lambda _: []


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
