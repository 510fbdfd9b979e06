"""How a body vibrates with its interfaces held by joints, kept beside a basis that cannot tell: a small body that can.

Normal modes under reference conditions that are not those of the joints make a body too stiff, and nothing in them says so.
The static shapes of all interfaces and a few modes with these held (Craig & Bampton 1968) give the lowest frequencies under
any joints. A simulation compares the two (`ffr_dyn.consistency.held_frequencies`).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ffr_prep.body import FlexibleBody
from ffr_prep.body.interface_freedom import interface_freedom
from ffr_prep.common.arrays import Array
from ffr_prep.model.coupled import CoupledModel
from ffr_prep.model.invariants import InertiaIntegrals
from ffr_prep.model.reference import MeanAxis, functionals
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.reduction.methods.guyan import Guyan
from ffr_prep.solvers.factor import FreeBody

_MODES = 3  # with the interfaces held


def needs_held_body(body: FlexibleBody) -> bool:
    """Whether some motions of the interfaces against each other are beyond the body."""
    possible, wanted = interface_freedom(body) if body.interfaces and body.n else (0, 0)
    return possible < wanted


def held_body(model: CoupledModel, body: FreeBody, inertia: Callable[[Array], InertiaIntegrals]) -> dict[str, Any]:
    """The small body in its mean-axis frame, as JSON values.

    interfaces : names;  omega2 : (p,);  shapes : (I, 6, p) phi_t and phi_r;  inertia : (3, p, p) S_bar_xx, yy, zz
    """
    inside = model.K.shape[0] - model.C.shape[0]
    basis = (CraigBampton(_MODES) if inside > _MODES else Guyan()).basis(model, body, functionals(MeanAxis(), model))
    pairs = inertia(basis.Z).PP_dm
    return {
        "interfaces": list(model.names),
        "omega2": basis.omega2.tolist(),
        "shapes": (model.C @ basis.Z).reshape(len(model.names), 6, -1).tolist(),
        "inertia": np.einsum("kkij->kij", pairs).tolist(),
    }
