"""The stress that a basis leaves out under the loads of a body's own inertia, against that of the full model.

The twelve unit accelerations load the body as in `ffr_prep.reduction.quality`, held by its reference conditions. Where these
are its mean motion, which gravity does not deform, the first interface holds it instead.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ffr_prep.body import STEADY_STRESS, largest_von_mises
from ffr_prep.common.arrays import Array
from ffr_prep.model.coupled import CoupledModel
from ffr_prep.model.model import Model
from ffr_prep.model.reactions import inertial_loads
from ffr_prep.reduction.basis import Basis, in_frame
from ffr_prep.reduction.responses import static_solver
from ffr_prep.solvers.factor import FreeBody

_KINDS = (3, 6)  # translation, angular acceleration, spin
_ROUNDING = 1e-5  # of the largest stress of a kind: loads that cause less are measured by it
_NOTHING = 1e-9


def steady_stress(model: Model, body: FreeBody, L: Array, basis: Basis) -> dict[str, Any]:
    """The largest von Mises stress at the surface under each unit acceleration [Pa per m/s^2 or 1/s^2], and of what the basis
    leaves out, as JSON values; empty where the model tells no stress at its surface."""
    coupled = model.coupled
    exact, left_out = steady_responses(coupled, body, L, basis)
    if coupled.names and not np.abs(exact[:, :3]).max() > _NOTHING * np.abs(exact).max():
        exact, left_out = steady_responses(coupled, body, coupled.C[:6].toarray(), basis)
    largest = _largest_stress(model, exact)
    if largest is None:
        return {}
    sizes = np.concatenate([np.maximum(part, _ROUNDING * part.max()) for part in np.split(largest, _KINDS)])
    found = {"left_out": _largest_stress(model, left_out), "largest": sizes}
    return {STEADY_STRESS: {key: [float(f"{x:.6g}") for x in np.asarray(of)] for key, of in found.items()}}


def steady_responses(model: CoupledModel, body: FreeBody, supports: Array, basis: Basis) -> tuple[Array, Array]:
    """(Z, 12) static displacements under the unit accelerations with the body held by the supports (s, Z), and what the
    basis leaves out of them."""
    loads = inertial_loads(model)
    exact = static_solver(model, body, supports)(loads)
    Z = basis.Z if len(supports) > 6 else in_frame(model, supports, basis.Z)
    return exact, exact - Z @ ((Z.T @ loads) / basis.omega2[:, None])


def _largest_stress(model: Model, fields: Array) -> Array | None:
    """(r,) the largest von Mises stress at the surface of displacements (Z, r) [Pa]."""
    surface = model.stressed(fields)
    if surface is None or surface.stress is None or not len(surface.stress):
        return None
    return largest_von_mises(surface.stress)
