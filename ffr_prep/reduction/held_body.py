"""How a body vibrates with its interfaces held by joints, kept beside a basis that cannot tell: a small body that can.

Normal modes under reference conditions that are not those of the joints make a body too stiff, and nothing in them says so.
The static shapes of all interfaces and a few modes with these held (Craig & Bampton 1968) give the lowest frequencies under
any joints. A simulation compares the two (`ffr_dyn.consistency.held_frequencies`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ffr_prep.body import FlexibleBody
from ffr_prep.body.frame_change import interface_motions, mass_of_motions
from ffr_prep.body.interface_freedom import interface_freedom
from ffr_prep.common.arrays import Array
from ffr_prep.model.coupled import CoupledModel
from ffr_prep.model.invariants import InertiaIntegrals
from ffr_prep.model.reference import MeanAxis, functionals
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.reduction.methods.guyan import Guyan
from ffr_prep.solvers.factor import FreeBody

_MODES = 3  # with the interfaces held
_SHOWN = 0.5  # of the strain energy under a load, below which it is told; the small body itself may lack a quarter
_LOADS = [f"{what} {axis}" for what in ("a force along", "a moment about") for axis in "xyz"]
_MOST = 6  # that are told


def needs_held_body(body: FlexibleBody) -> bool:
    """Whether some motions of the interfaces against each other are beyond the body."""
    possible, wanted = interface_freedom(body) if body.interfaces and body.n else (0, 0)
    return possible < wanted


def unshown_loads(body: FlexibleBody, held: Mapping[str, Any]) -> str | None:
    """The warning about a body that hardly deforms under loads at its interfaces, of what its stress would be; None where it
    does.

    Under each unit force and moment the strain energy of the free body, whose inertia balances the load, is held against
    that of the small body `held`, which has the static shapes.
    """
    M, motions = mass_of_motions(body), interface_motions(body)
    balanced = motions[:, 6:] - np.linalg.solve(M[:6, :6], motions[:, :6].T).T @ M[:6, 6:]
    has = (balanced**2 / body.omega2).sum(axis=1)
    should = (np.array(held["shapes"]) ** 2 / held["omega2"]).sum(axis=-1).ravel()
    loads = [f"{load} at {name!r}" for name in held["interfaces"] for load in _LOADS]
    shares = {load: some / whole for load, some, whole in zip(loads, has, should, strict=True) if some < _SHOWN * whole}
    if not shares:
        return None
    first = sorted(shares, key=lambda load: shares[load])[:_MOST]
    more = f" and {len(shares) - len(first)} more" if len(shares) > len(first) else ""
    told = ", ".join(f"{100 * shares[load]:.0f} % under {load}" for load in first)
    return (
        "its shapes, without the static ones of its interfaces, hardly deform under loads and joints there, and leave out "
        f"their stress: of the strain energy they have {told}{more}; reduce it with craig-bampton or rubin, or add "
        "`--method attachment` (AttachmentModes() in a Union)"
    )


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
