"""Rubin's reduction: free-free modes and residual flexibility.

Sources: R. H. MacNeal, Computers & Structures 1 (1971) 581-601; S. Rubin, AIAA Journal 13 (1975) 995-1006.
"""

from __future__ import annotations

from dataclasses import dataclass

from ffr_prep.common.arrays import Array
from ffr_prep.model.coupled import CoupledModel
from ffr_prep.reduction.basis import Basis, basis_of, check_interfaces
from ffr_prep.reduction.responses import attachment_modes, free_supports
from ffr_prep.reduction.selected_modes import selected
from ffr_prep.reduction.selection import Selection, check_selection
from ffr_prep.solvers.factor import FreeBody, supported


@dataclass(frozen=True)
class Rubin:
    """Normal modes of the free body, and the static response to unit loads at the interfaces that its inertia balances.

    modes : a number, `UpTo` a frequency or to an `Accuracy`

    What the static response adds to the modes is the residual flexibility of all modes above. Its inertia is kept, as
    Rubin does; MacNeal neglects it, which would leave shapes without mass. As the interfaces are free, fewer modes than
    with `CraigBampton` are needed where joints leave them nearly free.

    Raises InputError for modes that are neither a whole number nor one of these.

    >>> request = fp.Request(name="rod", reference=fp.MeanAxis(), reduction=fp.Rubin(8))
    """

    modes: Selection

    def __post_init__(self) -> None:
        check_selection("modes", self.modes)

    def basis(self, model: CoupledModel, body: FreeBody, L: Array) -> Basis:
        """Raises InputError without interfaces and for more modes than the model has."""
        check_interfaces(model, "Rubin's reduction")
        shapes = attachment_modes(model, body, L)

        def with_modes(_: Array, modes: Array) -> Basis:
            return basis_of(model, L, modes, shapes)

        return selected(model, body, supported(body, free_supports(model, L)), self.modes, with_modes)
