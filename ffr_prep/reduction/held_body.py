"""How a body vibrates with its interfaces held by joints, kept beside a basis that cannot tell: a small body that can.

Normal modes under reference conditions that are not those of the joints make a body too stiff, and nothing in them says so.
The static shapes of all interfaces and a few modes with these held (Craig & Bampton 1968) give the lowest frequencies under
any joints. A simulation compares the two (`ffr_dyn.consistency.held_frequencies`). So does it with the deformation under the
loads of a run at the interfaces, which the compliance of the whole model gives (`ffr_dyn.consistency.unshown_loads`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from scipy.linalg import null_space

from ffr_prep.body import FlexibleBody
from ffr_prep.body.frame_change import interface_motions, mass_of_motions
from ffr_prep.body.interface_freedom import interface_freedom
from ffr_prep.common.arrays import Array
from ffr_prep.model.coupled import CoupledModel
from ffr_prep.model.invariants import InertiaIntegrals
from ffr_prep.model.reference import MeanAxis, functionals
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.reduction.methods.guyan import Guyan
from ffr_prep.reduction.responses import mean_motion, static_solver
from ffr_prep.solvers.factor import FreeBody, SupportedBody, solve_refined

_MODES = 3  # with the interfaces held
_SHOWN = 0.5  # of the strain energy under a load, below which it is told
_SLIGHT = 1e-2  # of the strain energy under balanced loads, which a basis with the static shapes has all of
_LOADS = [f"{what} {axis}" for what in ("a force along", "a moment about") for axis in "xyz"]
_MOST = 6  # that are told


def needs_held_body(made: FlexibleBody, model: CoupledModel, held: SupportedBody) -> bool:
    """Whether some motions of the interfaces against each other are beyond the reduced body `made`, or it has not the static
    shapes of loads there."""
    possible, wanted = interface_freedom(made) if made.interfaces and made.n else (0, 0)
    return possible < wanted or (wanted > 6 and _left_out(made, model, held) > _SLIGHT)


def _left_out(made: FlexibleBody, model: CoupledModel, held: SupportedBody) -> float:
    """About the mean share of strain energy that the reduced body leaves out under loads at its interfaces that balance one
    another: under one combination of them, of each direction in which they deform it as much by its own energy."""
    rigid, elastic = np.split(interface_motions(made), [6], axis=1)
    balanced = null_space(rigid.T / np.linalg.norm(rigid, axis=1))  # moments as forces on an arm
    loads = balanced / np.linalg.norm(rigid, axis=1)[:, None]
    flexible = loads.T @ elastic / np.sqrt(made.omega2)
    left, sizes, _ = np.linalg.svd(flexible, full_matrices=False)
    signs = np.where(np.arange(sizes.size) % 2, 1.0, -1.0)
    load = loads @ (left / sizes @ signs)
    response = solve_refined(held, (model.C.T @ load)[:, None], np.zeros((held.C.shape[0], 1)))[0][:, 0]
    return float(load @ (model.C @ response)) / sizes.size - 1.0


def unshown_loads(body: FlexibleBody, held: Mapping[str, Any]) -> str | None:
    """The warning about a body that hardly deforms under loads at its interfaces, of what its stress would be; None where it
    does.

    Under each unit force and moment the strain energy of the free body, whose inertia balances the load, is held against
    that of the whole model, by the compliance in `held`.
    """
    M, motions = mass_of_motions(body), interface_motions(body)
    balanced = motions[:, 6:] - np.linalg.solve(M[:6, :6], motions[:, :6].T).T @ M[:6, 6:]
    has = (balanced**2 / body.omega2).sum(axis=1)
    should = np.diag(held["compliance"])
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
    """The small body in its mean-axis frame, and the compliance of the whole model, as JSON values.

    interfaces : names;  omega2 : (p,);  shapes : (I, 6, p) phi_t and phi_r;  inertia : (3, p, p) S_bar_xx, yy, zz
    compliance : (6 I, 6 I) of forces and moments at the interfaces, which the inertia of the free body balances
    """
    inside = model.K.shape[0] - model.C.shape[0]
    basis = (CraigBampton(_MODES) if inside > _MODES else Guyan()).basis(model, body, functionals(MeanAxis(), model))
    pairs, loads = inertia(basis.Z).PP_dm, model.C.toarray().T
    compliance = model.C @ static_solver(model, body, mean_motion(model))(loads)
    return {
        "interfaces": list(model.names),
        "omega2": basis.omega2.tolist(),
        "shapes": (model.C @ basis.Z).reshape(len(model.names), 6, -1).tolist(),
        "inertia": np.einsum("kkij->kij", pairs).tolist(),
        "compliance": (0.5 * (compliance + compliance.T)).tolist(),
    }
