"""Reductions by component modes: a few deformation shapes that carry the motion of the whole model.

Every reduction ends in the same form, a mass-orthonormal basis with diagonal stiffness under the reference conditions
(see `ffr_prep.reduction.basis`). Those of this module are made of normal modes and static shapes;
`ffr_prep.reduction.static_shapes` and `ffr_prep.reduction.krylov` hold others, and `Union` joins any of them.

Sources: R. J. Guyan, AIAA Journal 3 (1965) 380; R. R. Craig, M. C. C. Bampton, ibid. 6 (1968) 1313-1319; R. H. MacNeal,
Computers & Structures 1 (1971) 581-601; S. Rubin, AIAA Journal 13 (1975) 995-1006; M. P. Castanier, Y.-C. Tan,
C. Pierre, ibid. 39 (2001) 1182-1187 (characteristic constraint modes).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
import scipy.linalg

from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.model.coupled import CoupledModel
from ffr_prep.reduction.basis import Basis, basis_of, diagonalised, restricted
from ffr_prep.reduction.krylov import mean_motion
from ffr_prep.reduction.mesh_resolution import resolution_warnings
from ffr_prep.reduction.modes import constraint_modes, modes_up_to, normal_modes
from ffr_prep.reduction.receptance import free_modes, receptance_error, reference_modes
from ffr_prep.reduction.selection import Accuracy, Selection, UpTo, check_selection
from ffr_prep.reduction.static_shapes import attachment_modes
from ffr_prep.solvers.factor import FreeBody, SupportedBody, supported

Array = np.ndarray

_RICHER = (2.0, 4.0, 8.0, 16.0)  # times the band: where modes are looked for


class Reduction(Protocol):
    """What every reduction offers."""

    def basis(self, model: CoupledModel, body: FreeBody, L: Array) -> Basis:
        """The basis under the reference conditions L (r, Z), with the factorised stiffness of the model."""


@dataclass(frozen=True)
class CraigBampton:
    """Normal modes with all interfaces fixed, and the static shapes of every interface coordinate.

    modes : a number, `UpTo` a frequency or to an `Accuracy`

    The reference conditions are imposed on the sum, so with six of them n = modes + 6 interfaces - 6.
    """

    modes: Selection

    def __post_init__(self) -> None:
        check_selection("modes", self.modes)

    def basis(self, model: CoupledModel, body: FreeBody, L: Array) -> Basis:
        """Raises InputError without interfaces and for more modes than the model has."""
        _check_interfaces(model, "Craig-Bampton")
        fixed = supported(body, model.C.toarray())
        shapes, stiffness = constraint_modes(model, fixed)

        def with_modes(omega2: Array, modes: Array) -> Basis:
            K = scipy.linalg.block_diag(np.diag(omega2), stiffness)
            return diagonalised(model, *restricted(np.hstack([modes, shapes]), K, L))

        return selected(model, body, fixed, self.modes, with_modes)


@dataclass(frozen=True)
class Guyan:
    """The static shapes of every interface coordinate alone: stiffness exact at the interfaces, inertia approximate.

    The same as `CraigBampton` without modes; good far below the first frequency with the interfaces fixed.
    """

    def basis(self, model: CoupledModel, body: FreeBody, L: Array) -> Basis:
        """Raises InputError without interfaces."""
        return CraigBampton(0).basis(model, body, L)


@dataclass(frozen=True)
class Eigenmodes:
    """Normal modes of the body under its reference conditions; free-free modes for the mean axis.

    modes : a number, `UpTo` a frequency or to an `Accuracy`
    """

    modes: Selection

    def __post_init__(self) -> None:
        check_selection("modes", self.modes)

    def basis(self, model: CoupledModel, body: FreeBody, L: Array) -> Basis:
        """Raises InputError for more modes than the model has."""

        def with_modes(omega2: Array, modes: Array) -> Basis:
            return diagonalised(model, modes, np.diag(omega2))

        return selected(model, body, supported(body, L), self.modes, with_modes)


@dataclass(frozen=True)
class Rubin:
    """Normal modes of the free body, and the static response to unit loads at the interfaces that its inertia balances.

    modes : a number, `UpTo` a frequency or to an `Accuracy`

    What the static response adds to the modes is the residual flexibility of all modes above. Its inertia is kept, as
    Rubin does; MacNeal neglects it, which would leave shapes without mass. As the interfaces are free, fewer modes than
    with `CraigBampton` are needed where joints leave them nearly free.
    """

    modes: Selection

    def __post_init__(self) -> None:
        check_selection("modes", self.modes)

    def basis(self, model: CoupledModel, body: FreeBody, L: Array) -> Basis:
        """Raises InputError without interfaces and for more modes than the model has."""
        _check_interfaces(model, "Rubin's reduction")
        shapes = attachment_modes(model, body, L)

        def with_modes(_: Array, modes: Array) -> Basis:
            return basis_of(model, L, modes, shapes)

        held = supported(body, L if len(L) > 6 else mean_motion(model))
        return selected(model, body, held, self.modes, with_modes)


@dataclass(frozen=True)
class CharacteristicModes:
    """Craig-Bampton with fewer static shapes: only the lowest vibration modes of the body as condensed to its interfaces.

    modes           : with the interfaces fixed: a number, `UpTo` a frequency or to an `Accuracy`
    interface_modes : elastic modes of the condensed stiffness and mass: a number, or `UpTo` a frequency

    For many interfaces. Forces at the interfaces then bend the body less than they should, the more the fewer are kept.
    """

    modes: Selection
    interface_modes: int | UpTo

    def __post_init__(self) -> None:
        check_selection("modes", self.modes)
        check_selection("interface_modes", self.interface_modes, (UpTo,))

    def basis(self, model: CoupledModel, body: FreeBody, L: Array) -> Basis:
        """Raises InputError without interfaces and for more modes than there are."""
        _check_interfaces(model, "a reduction of the interfaces")
        fixed = supported(body, model.C.toarray())
        shapes, stiffness = constraint_modes(model, fixed)
        kept = _condensed_modes(stiffness, shapes.T @ (model.M @ shapes), self.interface_modes)
        shapes, stiffness = shapes @ kept, kept.T @ stiffness @ kept

        def with_modes(omega2: Array, modes: Array) -> Basis:
            K = scipy.linalg.block_diag(np.diag(omega2), stiffness)
            return diagonalised(model, *restricted(np.hstack([modes, shapes]), K, L))

        return selected(model, body, fixed, self.modes, with_modes)


@dataclass(frozen=True)
class Union:
    """The space of several reductions together; vectors that depend on those of earlier ones are dropped and counted."""

    parts: tuple[Reduction, ...]

    def __post_init__(self) -> None:
        if not self.parts:
            raise InputError("a union needs at least one reduction")

    def basis(self, model: CoupledModel, body: FreeBody, L: Array) -> Basis:
        """Raises what its parts raise."""
        bases = [part.basis(model, body, L) for part in self.parts]
        whole = basis_of(model, L, *(basis.Z for basis in bases))
        warnings = tuple(dict.fromkeys(warning for basis in bases for warning in basis.warnings))
        return Basis(whole.Z, whole.omega2, whole.dropped + sum(basis.dropped for basis in bases), warnings)


# ---- selection ----------------------------------------------------------------------------------------------------


def selected(
    model: CoupledModel,
    body: FreeBody,
    held: SupportedBody,
    selection: Selection,
    with_modes: Callable[[Array, Array], Basis],
) -> Basis:
    """The basis that `with_modes` makes of omega2 (p,) and the p normal modes (Z, p) under the supports.

    Raises InputError for more modes than the model has, ComputationError when no number of modes is accurate enough.
    """
    if isinstance(selection, UpTo):
        omega2, modes = modes_up_to(model, held, selection.frequency)
        warnings = resolution_warnings(model, omega2, modes, selection.frequency)
        return replace(with_modes(omega2, modes), warnings=warnings)
    if isinstance(selection, Accuracy):
        return _accurate(model, body, held, selection, with_modes)
    return with_modes(*normal_modes(model, held, selection))


def _accurate(
    model: CoupledModel,
    body: FreeBody,
    held: SupportedBody,
    wanted: Accuracy,
    with_modes: Callable[[Array, Array], Basis],
) -> Basis:
    reference, _ = reference_modes(model, body, wanted.band)
    frequencies = wanted.band.frequencies()

    def error(basis: Basis) -> float:
        return float(receptance_error(free_modes(model, basis), reference, frequencies).max())

    few = -1
    for richer in _RICHER:
        omega2, modes = modes_up_to(model, held, richer * wanted.band.high)
        best = with_modes(omega2, modes)
        if best.omega2.size and error(best) <= wanted.tolerance:
            break
        few = omega2.size
    else:
        raise ComputationError(
            f"with all {omega2.size} modes up to {_RICHER[-1] * wanted.band.high:.4g} Hz the receptances at the interfaces "
            f"are still more than {wanted.tolerance:g} off: use craig-bampton or rubin, which also carry static shapes, or "
            "allow a larger error"
        )
    enough = omega2.size
    while enough - few > 1:
        count = (few + enough) // 2
        basis = with_modes(omega2[:count], modes[:, :count])
        if basis.omega2.size and error(basis) <= wanted.tolerance:
            enough, best = count, basis
        else:
            few = count
    return replace(best, warnings=resolution_warnings(model, omega2, modes, wanted.band.high))


def _condensed_modes(K: Array, M: Array, selection: int | UpTo) -> Array:
    """(6I, 6 + count) the six rigid motions and the lowest elastic modes of the condensed body."""
    scale = 1 / np.sqrt(np.diag(M))
    omega2, V = scipy.linalg.eigh(K * np.outer(scale, scale), M * np.outer(scale, scale))
    elastic = len(omega2) - 6
    if isinstance(selection, UpTo):
        count = int(np.searchsorted(omega2[6:], (2 * np.pi * selection.frequency) ** 2, side="right"))
    else:
        count = selection
    if not 0 <= count <= elastic:
        raise InputError(f"asked for {count} interface modes; the interfaces have {elastic}: ask for 0 to {elastic}")
    return scale[:, None] * V[:, : 6 + count]


def _check_interfaces(model: CoupledModel, name: str) -> None:
    if not model.names:
        raise InputError(f"{name} needs at least one interface; without any, reduce by Eigenmodes")
