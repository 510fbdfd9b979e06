"""The space of several reductions together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ffr_prep.common.errors import InputError
from ffr_prep.model.coupled import CoupledModel
from ffr_prep.reduction.basis import Basis, Reduction, basis_of
from ffr_prep.solvers.factor import FreeBody


@dataclass(frozen=True)
class Union:
    """The space of several reductions together; vectors that depend on those of earlier ones are dropped and counted.

    Raises InputError for no reduction at all.

    >>> reduction = fp.Union((fp.CraigBampton(6), fp.InertiaRelief()))
    """

    parts: tuple[Reduction, ...]

    def __post_init__(self) -> None:
        if not self.parts:
            raise InputError("a union needs at least one reduction")

    def basis(self, model: CoupledModel, body: FreeBody, L: np.ndarray) -> Basis:
        """Raises what its parts raise."""
        bases = [part.basis(model, body, L) for part in self.parts]
        whole = basis_of(model, L, *(basis.Z for basis in bases))
        warnings = tuple(dict.fromkeys(warning for basis in bases for warning in basis.warnings))
        dropped = whole.dropped + sum(basis.dropped for basis in bases)
        verification = next((basis.verification for basis in bases if basis.verification), None)
        return Basis(whole.Z, whole.omega2, dropped, warnings, verification)
