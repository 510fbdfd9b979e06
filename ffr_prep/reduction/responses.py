"""Responses of the whole model to loads at its interfaces and to inertia, which reductions are made of.

The body is free, so each load is balanced by the inertia of the rigid motion that it causes (inertia relief); where the
reference conditions restrict the deformation, they hold it instead.

Sources: R. M. Hintz, AIAA Journal 13 (1975) 1007-1016 (attachment modes, inertia relief); R. R. Craig, A. J. Kurdila,
Fundamentals of Structural Dynamics, 2nd ed. (2006), chapter 17.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ffr_prep.common.arrays import Array
from ffr_prep.model.coupled import CoupledModel
from ffr_prep.solvers.factor import FreeBody, solve_refined, supported

_NOTHING = 1e-9


def static_solver(model: CoupledModel, body: FreeBody, supports: Array) -> Callable[[Array], Array]:
    """Loads (Z, r) -> static displacements (Z, r) under the supports (s, Z)."""
    held = supported(body, supports)

    def solve(loads: Array) -> Array:
        return solve_refined(held, loads, np.zeros((len(supports), loads.shape[1])))[0]

    return solve


def mean_motion(model: CoupledModel) -> Array:
    """(6, Z) mean motion over the mass, rows of unit length: supports under which inertia balances every load."""
    rows = (model.M @ model.T).T
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


def free_supports(model: CoupledModel, L: Array) -> Array:
    """(s, Z) supports while interface loads deform the body: conditions L that restrict it, or else its mean motion."""
    return L if len(L) > 6 else mean_motion(model)


def attachment_modes(model: CoupledModel, body: FreeBody, L: Array) -> Array:
    """(Z, 6I) static response to unit interface loads."""
    return static_response(model, body, free_supports(model, L), model.C.toarray().T)


def static_response(model: CoupledModel, body: FreeBody, supports: Array, loads: Array) -> Array:
    """(Z, r) static response; without the columns whose loads the supports carry without any deformation."""
    response = static_solver(model, body, supports)(loads)
    energy = np.einsum("zi,zi->i", response, loads)
    scale = np.einsum("zi,zi->i", np.abs(response), np.abs(loads))
    return response[:, np.abs(energy) > _NOTHING * scale]


def krylov_blocks(model: CoupledModel, solve: Callable[[Array], Array], count: int) -> list[Array]:
    """Response (Z, 6I) to the interface loads, response to the inertia of that response, and so on; of unit length."""
    blocks: list[Array] = []
    loads = model.C.toarray().T
    for _ in range(count):
        response = solve(loads)
        response = response / np.sqrt(np.einsum("zi,zi->i", response, model.M @ response))
        blocks.append(response)
        loads = model.M @ response
    return blocks
