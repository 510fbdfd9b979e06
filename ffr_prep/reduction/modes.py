"""Normal modes and static shapes under supports: what most reductions are made of."""

from __future__ import annotations

import numpy as np
import scipy.linalg

from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.model.coupled import CoupledModel
from ffr_prep.solvers.factor import SupportedBody, solve_refined

_DENSE = 600
_WHOLE, _SHOWN_BY_MESH = 1500, 0.3  # free coordinates of which all modes may be wanted; share that a mesh can show
_FIRST = 12
_HIGHEST = 1e150  # Hz, of which the square is a number still


def normal_modes(model: CoupledModel, held: SupportedBody, count: int) -> tuple[Array, Array]:
    """The lowest `count` modes under the supports: omega2 (count,) and mass-orthonormal vectors (Z, count).

    Raises InputError when the model has fewer, ComputationError when the iteration does not converge.
    """
    size = model.K.shape[0]
    most = size - held.C.shape[0]
    if not 0 <= count <= most:
        raise InputError(
            f"asked for {count} normal modes of a model with {most} free degrees of freedom: ask for 0 to {most}, or "
            "refine the mesh or raise its order"
        )
    if count == 0:
        return np.zeros(0), np.zeros((size, 0))
    if size <= _DENSE or 3 * count > size:
        return _dense_modes(model, held.C.toarray(), count)
    return held.body.lowest(held, model.M, count)


def modes_up_to(model: CoupledModel, held: SupportedBody, frequency: float) -> tuple[Array, Array]:
    """All modes up to a frequency [Hz] under the supports, as `normal_modes` gives them.

    Raises InputError for a frequency with more modes than the mesh can show, ComputationError when the iteration does not
    converge.
    """
    limit = (2 * np.pi * min(frequency, _HIGHEST)) ** 2
    most = model.K.shape[0] - held.C.shape[0]
    count = min(_FIRST, most)
    omega2, vectors = normal_modes(model, held, count)
    while count < most and omega2[-1] <= limit:
        _check_frequency(frequency, omega2, limit, most)
        count = min(max(2 * count, _expected(omega2, limit)), most)
        omega2, vectors = normal_modes(model, held, count)
    kept = int(np.searchsorted(omega2, limit, side="right"))
    return omega2[:kept], vectors[:, :kept]


def _check_frequency(frequency: float, omega2: Array, limit: float, most: int) -> None:
    """The number of modes grows with the frequency at least in proportion."""
    least = omega2.size * np.sqrt(limit / omega2[-1])
    if most > _WHOLE and least > _SHOWN_BY_MESH * most:
        raise InputError(
            f"modes up to {frequency:g} Hz: these are {least:.0f} or more, of {most} that the mesh has and of which it shows "
            f"far fewer; the first {omega2.size} end at {np.sqrt(omega2[-1]) / 2 / np.pi:.4g} Hz: ask for a lower frequency"
        )


def _expected(omega2: Array, limit: float) -> int:
    """A guess of the number of modes below a limit: as dense on the frequency axis as those that are known."""
    return min(int(1.2 * omega2.size * np.sqrt(limit / omega2[-1])), 4 * omega2.size)


def _dense_modes(model: CoupledModel, C: Array, count: int) -> tuple[Array, Array]:
    """In coordinates of unit stiffness: translations and rotations of bodies far smaller than a metre have stiffness and mass
    of other orders, and combinations of both would lose the smaller ones in rounding."""
    stiffness = model.K.diagonal()
    scale = 1 / np.sqrt(np.where(stiffness > 0, stiffness, stiffness.max()))
    conditions = C * scale
    null = scipy.linalg.null_space(conditions / np.linalg.norm(conditions, axis=1, keepdims=True))
    K, M = (null.T @ (scale[:, None] * A.toarray() * scale) @ null for A in (model.K, model.M))
    omega2, vectors = scipy.linalg.eigh(K, M, subset_by_index=(0, count - 1))
    return omega2, scale[:, None] * (null @ vectors)


def constraint_modes(model: CoupledModel, fixed: SupportedBody) -> tuple[Array, Array]:
    """Static shapes (Z, r) of unit values of each support coordinate, and their stiffness (r, r).

    The stiffness is the reaction to the shapes; it is more accurate than a product with K, whose rounding errors
    scale with the stiffest motion of the mesh.
    """
    count = fixed.C.shape[0]
    shapes, mu = solve_refined(fixed, np.zeros((model.K.shape[0], count)), np.eye(count))
    return shapes, -(mu + mu.T) / 2
