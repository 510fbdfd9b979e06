"""Normal modes under the reference conditions alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ffr_prep.common.arrays import Array
from ffr_prep.model.coupled import CoupledModel
from ffr_prep.reduction.basis import Basis, diagonalised
from ffr_prep.reduction.selected_modes import selected
from ffr_prep.reduction.selection import Selection, check_selection
from ffr_prep.solvers.factor import FreeBody, supported


@dataclass(frozen=True)
class Eigenmodes:
    """Normal modes of the body under its reference conditions; free-free modes for the mean axis.

    modes : a number, `UpTo` a frequency or to an `Accuracy`

    Raises InputError for modes that are neither a whole number nor one of these.

    >>> request = fp.Request(name="rod", reference=fp.FixedTo("hinge"), reduction=fp.Eigenmodes(6))
    """

    modes: Selection

    def __post_init__(self) -> None:
        check_selection("modes", self.modes)

    def basis(self, model: CoupledModel, body: FreeBody, L: Array) -> Basis:
        """Raises InputError for more modes than the model has."""

        def with_modes(omega2: Array, modes: Array) -> Basis:
            return diagonalised(model, modes, np.diag(omega2))

        return selected(model, body, supported(body, L), self.modes, with_modes)
