"""A model of any kind reduced to a flexible body: the method from end to end."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib.metadata import version
from typing import Any

import numpy as np
import scipy.sparse as sp

from ffr_prep.body import (
    WITHOUT_SHEAR,
    Damping,
    FlexibleBody,
    Interface,
    cut_doubt,
    cut_error,
    cut_stress_doubt,
    mesh_doubt,
    modes_doubt,
    shear_doubt,
    steady_stress_doubt,
    units_doubts,
    with_damping,
)
from ffr_prep.body.provenance import described
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError, InputError, require_kind
from ffr_prep.common.progress import Advance, Stages, no_advance, no_stages
from ffr_prep.model.coupled import CoupledModel
from ffr_prep.model.cuts import Cuts
from ffr_prep.model.model import Model
from ffr_prep.model.reactions import in_equilibrium, known_loads
from ffr_prep.model.reference import ReferenceConditions, at_interfaces, conditions_of_part, functionals
from ffr_prep.reduction.basis import Basis, Reduction, check_basis, factorised
from ffr_prep.reduction.held_body import held_body, needs_held_body, unshown_loads
from ffr_prep.reduction.mesh_error import mesh_error
from ffr_prep.reduction.mesh_resolution import sheet_doubt
from ffr_prep.reduction.quality import assess, completed
from ffr_prep.reduction.second_order import check_size, with_second_order
from ffr_prep.reduction.selection import Band
from ffr_prep.reduction.steady_stress import steady_stress
from ffr_prep.reduction.truncation_error import truncation_error
from ffr_prep.solvers.factor import CHOLESKY, FreeBody, Solver, SupportedBody, solve_refined, supported
from ffr_prep.solvers.threads import on_one_thread

_MASSLESS = 1e-9
_FAR = 20.0  # sizes of a model from which on a point of an interface is to blame for what fails
_UNDEFORMED = "it has no shape to deform in, and moves as a rigid body: ask for modes, or for a higher frequency"
_RIGID = 6  # coordinates of a body that does not deform
UNDAMPED = Damping()


@dataclass(frozen=True, kw_only=True)
class Request:
    """A reduction of a model: conditions, shapes, and what else is computed.

    name       : of the body
    reference  : how its frame is attached, such as FixedTo("root") or MeanAxis(); an interface may be said by where it is,
                 such as FixedTo("nearest 0,0,0") [m]
    reduction  : which deformation shapes it keeps, such as CraigBampton(10)
    linear     : leave out the load matrices, and with them the second-order displacement by which a simulation has elastic
                 bodies stiffen, and foreshorten, as they bend; bodies of matrices from outside are linear anyway
    drawn_modes: how many of the lowest modes foreshorten the surface, all when not given. Of m modes m (m + 1) / 2 static
                 problems are solved; of the others pictures, stress and points added later know the first order alone
    stress     : also keep section forces of beams and the stress at the surface per elastic coordinate
    quality    : compare the body with the full model over this band of frequencies, and keep what was found
    parts      : also cut the body into so many parts of equal length along its long axis; or at stations, distances [m] from
                 its end, or `CutPlane`s. Each is reduced like the whole (`FlexibleBody.parts`) and a scene moves them in its
                 place, which large deflections ask for. A part has the reference conditions if it has the interfaces that
                 they name, and else its mean axis
    damping    : damping that the body gets, beside that of the model
    solver     : what factorises the stiffness and finds the modes
    provenance : JSON values kept with the body, beside what is recorded anyway

    Raises InputError for a reference or reduction that is a name or a list and not an object.

    >>> request = fp.Request(name="rod", reference=fp.FixedTo("hinge"), reduction=fp.CraigBampton(8), stress=True)
    """

    name: str
    reference: ReferenceConditions
    reduction: Reduction
    linear: bool = False
    drawn_modes: int | None = None
    stress: bool = False
    quality: Band | None = None
    parts: Cuts | None = None
    damping: Damping = UNDAMPED
    solver: Solver = CHOLESKY
    provenance: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.drawn_modes is not None and self.drawn_modes < 1:
            raise InputError(f"drawn_modes is {self.drawn_modes}; give 1 or more, or linear=True in its place")
        if self.drawn_modes is not None and self.linear:
            raise InputError(
                "drawn_modes says which modes foreshorten what is drawn, and linear that none does: give one"
            )
        for what, given, such in (
            ("reference", self.reference, 'FixedTo("root")'),
            ("reduction", self.reduction, "CraigBampton(10), or Union((CraigBampton(10), InertiaRelief()))"),
        ):
            if isinstance(given, type) or not hasattr(given, "rows" if what == "reference" else "basis"):
                raise InputError(f"{what} is {given!r}; give one such as {such}")
        require_kind(self.name, str, "name", "a text such as 'rod'")
        require_kind(self.damping, Damping, "damping", "one such as Damping(beta=1e-6)")
        require_kind(self.quality, (Band, type(None)), "quality", "a band such as Band(5, 500)")
        require_kind(self.solver, Solver, "solver", "one such as Solver('cholesky')")


@on_one_thread
def reduce(
    model: Model, request: Request, *, progress: Stages = no_stages, advance: Advance = no_advance
) -> FlexibleBody:
    """The reduced flexible body of a model, in the coordinates of its nodes.

    progress : called with the name of each stage as it begins
    advance  : called within long stages with the share that is done and with how far that is in words

    Raises InputError for input that cannot be used and ComputationError for a computation that failed.

    >>> body = fp.reduce(model, fp.Request(name="rod", reference=fp.FixedTo("hinge"), reduction=fp.CraigBampton(8)))
    """
    require_kind(model, Model, "model", "that of from_mesh, from_frame, from_matrices or tied")
    if model.massless and request.quality:
        raise InputError(
            "the quality of a reduction needs a mass for every coordinate, and some have none: leave out the quality report"
        )
    if request.parts is not None and model.cut is None:
        raise InputError("this model cannot be cut into parts: meshes of solids and frames of beams and plates can")
    if model.coupled.K.shape[0] <= _RIGID:
        raise InputError(
            "every node of the model follows one rigid interface, so that nothing deforms: give it fewer nodes, make it a "
            "mean one, or make a rigid body (ffr-prep rigid)"
        )
    reference = at_interfaces(request.reference, model.coupled.names, model.coupled.positions)
    request = replace(request, reference=reference)
    parts = model.cut(request.parts) if model.cut and request.parts is not None else ()
    try:
        whole = _reduced(model, request, progress, advance)
        whole = _with_cut_error(replace(whole, parts=tuple(_parts(parts, request, progress, advance))))
        return _with_doubts(with_damping(whole, request.damping))
    except ComputationError:
        model.diagnose()
        _check_points(model.coupled)
        raise


def _check_points(model: CoupledModel) -> None:
    """InputError where an interface is so far away from the nodes that its motions and theirs drown in rounding."""
    size = float(np.linalg.norm(np.ptp(model.points, axis=0)))
    for name, at in zip(model.names, model.positions, strict=True):
        away = float(np.linalg.norm(model.points - at, axis=1).min())
        if away > _FAR * size:
            raise InputError(
                f"the point of interface {name!r} is {away:.3g} m away from the nodes, which reach over {size:.3g} m: give "
                "its place in metres, near its region"
            )


def _parts(
    parts: Sequence[Callable[[], Model]], request: Request, progress: Stages, advance: Advance
) -> Iterator[FlexibleBody]:
    """The parts of the body, reduced one after the other."""
    for k, make in enumerate(parts, 1):
        of = f"part {k} of {len(parts)}"
        progress(f"{of}: assemble stiffness and mass")
        try:
            part = make()
            own = replace(
                request,
                name=f"{request.name}_{k}",
                reference=conditions_of_part(request.reference, part.coupled.names),
                quality=None,
                parts=None,
            )
            yield _reduced(part, own, lambda stage, of=of: progress(f"{of}: {stage}"), advance)  # type: ignore[misc]
        except (InputError, ComputationError) as error:
            raise type(error)(f"{of}: {error}") from None


def _with_cut_error(body: FlexibleBody) -> FlexibleBody:
    found = cut_error(body)
    warnings = [*body.provenance["warnings"], *filter(None, [cut_doubt(found), cut_stress_doubt(body)])]
    return replace(body, provenance={**body.provenance, **found, "warnings": warnings})


def _check_asked(model: Model, request: Request) -> None:
    """InputError where the modes that are asked for by number have too large a second order: before the search for them,
    which may take hours."""
    asked, size = getattr(request.reduction, "modes", None), model.coupled.K.shape[0]
    if isinstance(asked, int | np.integer) and 0 < asked <= size and not (request.linear or model.unstressed):
        check_size(int(asked), len(model.coupled.names), model.surface(np.zeros((size, 0))), request.drawn_modes)


def _reduced(model: Model, request: Request, progress: Stages, advance: Advance) -> FlexibleBody:
    coupled = model.coupled
    L = functionals(request.reference, coupled)
    _check_asked(model, request)
    progress("factorise the stiffness")
    body = factorised(coupled, request.solver, advance)
    progress("reduce")
    basis = (_shifted_basis if model.massless else _basis)(request.reduction, coupled, body, L)
    check_basis(coupled, L, basis)
    progress("estimate the error of the mesh")
    of_mesh = mesh_error(model, basis)
    progress("estimate the error of the modes")
    held = supported(body, L) if basis.omega2.size else None
    of_shapes = truncation_error(coupled, held, basis) if held and not model.massless else {}
    if request.quality:
        progress("compare with the full model")
    assessed = assess(coupled, body, L, basis, request.quality) if request.quality else None
    progress("integrate the inertia")
    integrals = model.inertia(basis.Z)
    of_stress: dict[str, Any] = {}
    if request.stress:
        progress("recover the stress")
        of_stress = steady_stress(model, body, L, basis) if basis.omega2.size and not model.massless else {}
    surface = (model.stressed if request.stress else model.surface)(basis.Z)
    if request.stress and surface is None:
        raise InputError("no part of this model knows its stress: reduce it without")
    stiffening = None
    if held and not (request.linear or model.unstressed):
        check_size(basis.omega2.size, len(coupled.names), surface, request.drawn_modes)
        progress("compute the load matrices")
        stiffening = stiffening_matrices(model, request, held, basis)
        if surface is not None:
            progress("compute the second order of the surface")
            drawn = replace(basis, Z=basis.Z[:, : request.drawn_modes], omega2=basis.omega2[: request.drawn_modes])
            surface = with_second_order(surface, model, held, request.reference, drawn, advance)
    doubts = _doubts(model, basis, of_mesh | of_shapes, of_stress, stress=request.stress)
    made = FlexibleBody(
        name=request.name,
        omega2=basis.omega2,
        interfaces=interface_shapes(coupled, basis),
        surface=surface,
        stiffening=stiffening,
        provenance=completed(record(model, request, doubts) | of_mesh | of_shapes | of_stress, basis, assessed),
        damping=model.damping(basis.Z),
        **vars(integrals),
    )
    return _with_held_body(_with_doubts(made), model, body, held, progress)


def _with_doubts(made: FlexibleBody) -> FlexibleBody:
    """The body with warnings of what cannot be meant of its numbers, each once."""
    warnings = [*made.provenance["warnings"], *units_doubts(made), *([] if made.n else [_UNDEFORMED])]
    return replace(made, provenance={**made.provenance, "warnings": list(dict.fromkeys(warnings))})


def _doubts(
    model: Model, basis: Basis, of_modes: Mapping[str, Any], of_stress: Mapping[str, Any], *, stress: bool
) -> list[str]:
    """What model, mesh and shapes cannot be trusted with, in words."""
    found = [
        mesh_doubt({**model.record, **of_modes}),
        modes_doubt(of_modes),
        sheet_doubt(model.record, model.coupled, basis.Z),
        steady_stress_doubt(of_stress),
        shear_doubt(model.record) if stress else None,
    ]
    return [*model.doubts(basis.Z), *filter(None, found)]


def _with_held_body(
    made: FlexibleBody, model: Model, body: FreeBody, held: SupportedBody | None, progress: Stages
) -> FlexibleBody:
    """The body with how it would vibrate with its interfaces held, where its own shapes cannot tell."""
    if held is None or model.massless or not needs_held_body(made, model.coupled, held):
        return made
    progress("look at the interfaces held")
    kept = held_body(model.coupled, body, model.inertia)
    stressed = made.surface is not None and (made.surface.stress is not None or made.surface.beams is not None)
    unshown = unshown_loads(made, kept) if stressed else None
    warnings = [*made.provenance["warnings"], *filter(None, [unshown])]
    return replace(made, provenance={**made.provenance, "held_body": kept, "warnings": warnings})


# ---- basis --------------------------------------------------------------------------------------------------------


def _basis(reduction: Reduction, coupled: CoupledModel, body: FreeBody, L: Array) -> Basis:
    try:
        return reduction.basis(coupled, body, L)
    except np.linalg.LinAlgError as error:
        raise ComputationError(
            f"the eigenproblem of K and M failed ({error}): M is nearly singular; give "
            "masses to the nodes that have none, or ask for fewer modes"
        ) from None


def _shifted_basis(reduction: Reduction, coupled: CoupledModel, body: FreeBody, L: Array) -> Basis:
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


# ---- parts of the body --------------------------------------------------------------------------------------------


def interface_shapes(model: CoupledModel, basis: Basis) -> tuple[Interface, ...]:
    """The interfaces with translation and rotation per elastic coordinate."""
    shapes = (model.C @ basis.Z).reshape(len(model.names), 6, basis.omega2.size)
    attached = zip(model.names, model.positions, shapes, model.kinds, strict=True)
    return tuple(Interface(name, at, six[:3], six[3:], kind) for name, at, six, kind in attached)


def stiffening_matrices(model: Model, request: Request, held: SupportedBody, basis: Basis) -> Array:
    """(12 + 6 I, n, n) load matrices, in the order of `FlexibleBody.stiffening`.

    held : the body under its reference conditions

    Raises ComputationError when a static problem fails.
    """
    loads = known_loads(model.coupled)
    static = solve_refined(held, loads, np.zeros((held.C.shape[0], loads.shape[1])))[0]
    K = model.stiffening(static, in_equilibrium(model.coupled, request.reference, static), basis.Z)
    return (K + K.transpose(0, 2, 1)) / 2


def record(model: Model, request: Request, doubts: Sequence[str]) -> dict[str, Any]:
    """Provenance as JSON values: model, settings, versions. No time and no path, so it is reproducible."""
    of_model = dict(model.record) | {
        "reference": described(request.reference),
        "reduction": described(request.reduction),
        "versions": {package: version(package) for package in model.packages},
        "warnings": [*model.record.get("warnings", []), *doubts],
        "solver": {key: value for key, value in described(request.solver).items() if key != "verify"},
    }
    if not (request.stress and of_model.get(WITHOUT_SHEAR)):
        of_model.pop(WITHOUT_SHEAR, None)
    recovered = {"stress": model.recovery} if request.stress else {}
    return of_model | recovered | dict(request.provenance)
