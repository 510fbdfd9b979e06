"""As many normal modes as a selection asks for: by number, up to a frequency, or by the accuracy that they give."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from ffr_prep.body import cut_pair, paired
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError
from ffr_prep.model.coupled import CoupledModel
from ffr_prep.reduction.basis import Basis
from ffr_prep.reduction.mesh_resolution import resolution_warnings
from ffr_prep.reduction.modes import modes_up_to, normal_modes
from ffr_prep.reduction.receptance import free_modes, receptance_error, reference_modes
from ffr_prep.reduction.selection import Accuracy, Selection, UpTo
from ffr_prep.solvers.factor import FreeBody, SupportedBody

_RICHER = (2.0, 4.0, 8.0, 16.0)  # times the band: where modes are looked for


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
        return _verified(model, held, replace(with_modes(omega2, modes), warnings=warnings), omega2, modes)
    if isinstance(selection, Accuracy):
        return _accurate(model, body, held, selection, with_modes)
    most = model.K.shape[0] - held.C.shape[0]
    omega2, modes = normal_modes(model, held, selection + (0 < selection < most))
    basis = replace(
        with_modes(omega2[:selection], modes[:, :selection]), warnings=cut_pair(omega2, selection, "normal modes")
    )
    return _verified(model, held, basis, omega2[:selection], modes[:, :selection])


def _verified(model: CoupledModel, held: SupportedBody, basis: Basis, omega2: Array, modes: Array) -> Basis:
    """The basis with what was found of its normal modes, where there are any and somebody asked."""
    return replace(basis, verification=held.body.verify(held, model.M, omega2, modes)) if omega2.size else basis


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
            f"are still more than {wanted.tolerance:g} off: allow a larger error, or use rubin, whose static shapes carry "
            "the flexibility of all higher modes"
        )
    enough = omega2.size
    while enough - few > 1:
        count = (few + enough) // 2
        basis = with_modes(omega2[:count], modes[:, :count])
        if basis.omega2.size and error(basis) <= wanted.tolerance:
            enough, best = count, basis
        else:
            few = count
    if enough < omega2.size and enough and paired(omega2)[enough - 1]:
        enough += 1
        best = with_modes(omega2[:enough], modes[:, :enough])
    best = replace(best, warnings=resolution_warnings(model, omega2, modes, wanted.band.high))
    return _verified(model, held, best, omega2[:enough], modes[:, :enough])
