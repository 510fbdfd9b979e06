"""Guyan's reduction, or static condensation. Source: R. J. Guyan, AIAA Journal 3 (1965) 380."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ffr_prep.model.coupled import CoupledModel
from ffr_prep.reduction.basis import Basis
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.solvers.factor import FreeBody


@dataclass(frozen=True)
class Guyan:
    """The static shapes of every interface coordinate alone: stiffness exact at the interfaces, inertia approximate.

    The same as `CraigBampton` without modes; good far below the first frequency with the interfaces fixed.

    >>> request = fp.Request(name="rod", reference=fp.FixedTo("hinge"), reduction=fp.Guyan())
    """

    def basis(self, model: CoupledModel, body: FreeBody, L: np.ndarray) -> Basis:
        """Raises InputError without interfaces."""
        return CraigBampton(0).basis(model, body, L)
