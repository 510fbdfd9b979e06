"""Inertia relief: static response to the accelerations of the body, which makes steady deformation exact.

Source: R. M. Hintz, AIAA Journal 13 (1975) 1007-1016.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ffr_prep.body.accelerations import gradients
from ffr_prep.common.arrays import Array
from ffr_prep.model.coupled import CoupledModel
from ffr_prep.model.reactions import inertial_loads
from ffr_prep.reduction.basis import Basis, basis_of
from ffr_prep.reduction.responses import static_response
from ffr_prep.solvers.factor import FreeBody

_ROUNDING = 1e-13  # of the largest load of a turn; that of a thread a millionth as thick as long is 1e-12


@dataclass(frozen=True)
class InertiaRelief:
    """Static response to unit accelerations of the body: three of translation, three of rotation, six of spin.

    The interfaces are held, so with the static shapes of the interfaces (`CraigBampton`, `Rubin`, `Guyan`) every steady
    deformation under gravity, acceleration and spin is exact, whichever interfaces carry the load. A body without
    interfaces is free. Loads that nothing but the supports carry give no vector.

    >>> reduction = fp.Union((fp.CraigBampton(6), fp.InertiaRelief()))
    """

    def basis(self, model: CoupledModel, body: FreeBody, L: np.ndarray) -> Basis:
        """The responses as a basis."""
        held = L if len(L) > 6 or not model.names else model.C.toarray()
        return basis_of(model, L, static_response(model, body, held, central_loads(model)))


def central_loads(model: CoupledModel) -> Array:
    """(Z, 12) the loads of unit accelerations about the middle of the model. About an origin far away turning and spinning
    are next to translations, and what tells them apart would be lost in rounding. Loads that are none but for rounding, as a
    straight beam's under spin about itself, are zero: their responses would be shapes without a meaning, and no symmetry of
    the body."""
    loads = inertial_loads(model)
    central = np.hstack([loads[:, :3], loads[:, 3:] - loads[:, :3] @ (gradients() @ model.centre).T])
    rounding = _ROUNDING * np.abs(loads[:, 3:]).max(initial=0.0)
    return np.asarray(central * (np.abs(central).max(axis=0, initial=0.0) > rounding))
