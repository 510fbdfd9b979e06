"""Attachment modes: static response to interface loads. Source: R. M. Hintz, AIAA Journal 13 (1975) 1007-1016."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ffr_prep.model.coupled import CoupledModel
from ffr_prep.reduction.basis import Basis, basis_of, check_interfaces
from ffr_prep.reduction.responses import attachment_modes
from ffr_prep.solvers.factor import FreeBody


@dataclass(frozen=True)
class AttachmentModes:
    """Static response of the free body to a unit force along, and a unit moment about, each axis at each interface.

    >>> reduction = fp.Union((fp.Eigenmodes(6), fp.AttachmentModes()))
    """

    def basis(self, model: CoupledModel, body: FreeBody, L: np.ndarray) -> Basis:
        """Raises InputError without interfaces."""
        check_interfaces(model, "a basis of attachment modes")
        return basis_of(model, L, attachment_modes(model, body, L))
