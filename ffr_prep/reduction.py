"""Reduction: a few deformation shapes that carry the motion of the whole model.

Every reduction ends in the same form: a mass-orthonormal basis Z of the independent coordinates with a diagonal
stiffness, Z^T M Z = I, Z^T K Z = diag(omega2), which satisfies the reference conditions L Z = 0.

Source: R. R. Craig, M. C. C. Bampton, AIAA Journal 6 (1968) 1313-1319.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy.linalg

from ffr_prep.errors import ComputationError, InputError
from ffr_prep.factor import FreeBody, SupportedBody, free_body, solve_refined, solve_supported, supported
from ffr_prep.interface import CoupledModel
from ffr_prep.lanczos import lowest_modes

Array = np.ndarray

_DENSE = 600
_BLOCK = 8
_TIE = 1e-6
_RIGID = 1e-9


@dataclass(frozen=True)
class Basis:
    """Z (z, n) [1/sqrt(kg)], mass-orthonormal with diagonal stiffness; omega2 (n,) [rad^2/s^2], ascending."""

    Z: Array
    omega2: Array


class Reduction(Protocol):
    """What every reduction offers."""

    def basis(self, model: CoupledModel, body: FreeBody, L: Array) -> Basis:
        """The basis under the reference conditions L (r, Z), with the factorised stiffness of the model."""


@dataclass(frozen=True)
class CraigBampton:
    """Normal modes with all interfaces fixed, and the static shapes of every interface coordinate.

    The reference conditions are imposed on the sum, so with six of them n = modes + 6 interfaces - 6.
    """

    modes: int

    def basis(self, model: CoupledModel, body: FreeBody, L: Array) -> Basis:
        """Raises InputError without interfaces and for more modes than the model has."""
        if not model.names:
            raise InputError("Craig-Bampton needs at least one interface; without any, reduce by Eigenmodes")
        fixed = supported(body, model.C.toarray())
        omega2, modes = normal_modes(model, fixed, self.modes)
        shapes, stiffness = constraint_modes(model, fixed)
        vectors = np.hstack([modes, shapes])
        K = scipy.linalg.block_diag(np.diag(omega2), stiffness)
        return diagonalised(model, *restricted(vectors, K, L))


@dataclass(frozen=True)
class Eigenmodes:
    """Normal modes of the body under its reference conditions; free-free modes for the mean axis."""

    modes: int

    def basis(self, model: CoupledModel, body: FreeBody, L: Array) -> Basis:
        """Raises InputError for more modes than the model has."""
        held = supported(body, L)
        omega2, modes = normal_modes(model, held, self.modes)
        return diagonalised(model, modes, np.diag(omega2))


def factorised(model: CoupledModel) -> FreeBody:
    """The one factorisation that serves modes, static shapes, stiffening loads and error reports of a model."""
    return free_body(model.K, model.T, model.places)


# ---- building blocks ----------------------------------------------------------------------------------------------


def normal_modes(model: CoupledModel, held: SupportedBody, count: int) -> tuple[Array, Array]:
    """The lowest `count` modes under the supports: omega2 (count,) and mass-orthonormal vectors (Z, count).

    Raises InputError when the model has fewer, ComputationError when the iteration does not converge.
    """
    size = model.K.shape[0]
    most = size - len(held.C)
    if not 0 <= count <= most:
        raise InputError(
            f"asked for {count} normal modes of a model with {most} free degrees of freedom: ask for 0 to {most}, or "
            "refine the mesh or raise its order"
        )
    if count == 0:
        return np.zeros(0), np.zeros((size, 0))
    if size <= _DENSE or 3 * count > size:
        return _dense_modes(model, held.C, count)
    return _lanczos_modes(model, held, count)


def _dense_modes(model: CoupledModel, C: Array, count: int) -> tuple[Array, Array]:
    null = scipy.linalg.null_space(C)
    omega2, vectors = scipy.linalg.eigh(
        null.T @ (model.K @ null), null.T @ (model.M @ null), subset_by_index=(0, count - 1)
    )
    return omega2, null @ vectors


def _lanczos_modes(model: CoupledModel, held: SupportedBody, count: int) -> tuple[Array, Array]:
    def flexibility(loads: Array) -> Array:
        return solve_supported(held, loads, np.zeros((len(held.C), loads.shape[1])))[0]

    start = np.random.default_rng(0).standard_normal((model.K.shape[0], _BLOCK))
    return lowest_modes(flexibility, model.M, start, count, most=20 * count + 300)


def constraint_modes(model: CoupledModel, fixed: SupportedBody) -> tuple[Array, Array]:
    """Static shapes (Z, r) of unit values of each support coordinate, and their stiffness (r, r).

    The stiffness is the reaction to the shapes; it is more accurate than a product with K, whose rounding errors
    scale with the stiffest motion of the mesh.
    """
    count = len(fixed.C)
    shapes, mu = solve_refined(fixed, np.zeros((model.K.shape[0], count)), np.eye(count))
    return shapes, -(mu + mu.T) / 2


def restricted(vectors: Array, K: Array, L: Array) -> tuple[Array, Array]:
    """The combinations of the vectors (Z, p), with stiffness K (p, p), that satisfy L u = 0: vectors and stiffness."""
    scale = 1 / np.linalg.norm(vectors, axis=0)
    V = scale[:, None] * scipy.linalg.null_space(L @ (vectors * scale), rcond=1e-10)
    return vectors @ V, V.T @ K @ V


def diagonalised(model: CoupledModel, vectors: Array, K: Array) -> Basis:
    """The mass-orthonormal basis of the same space in which the stiffness K (p, p) is diagonal."""
    M = vectors.T @ (model.M @ vectors)
    scale = 1 / np.sqrt(np.diag(M))
    omega2, combination = scipy.linalg.eigh(K * np.outer(scale, scale), M * np.outer(scale, scale))
    Z = vectors @ (scale[:, None] * combination)
    return Basis(Z * _signs(Z), omega2)


def _signs(Z: Array) -> Array:
    """(n,) the factor +1 or -1 that makes the largest component of each mode positive (the first among equals)."""
    if not Z.size:
        return np.ones(Z.shape[1])
    size = np.abs(Z)
    first = np.argmax(size >= (1 - _TIE) * size.max(axis=0), axis=0)
    return np.sign(Z[first, np.arange(Z.shape[1])])


# ---- guards -------------------------------------------------------------------------------------------------------


def check_basis(model: CoupledModel, L: Array, basis: Basis) -> None:
    """Raises ComputationError when the basis is not what every later step relies on.

    That is: mass-orthonormal, diagonal in the stiffness, within the reference conditions, without a rigid motion.
    """
    Z, omega2 = basis.Z, basis.omega2
    _check_small("Z^T M Z - I", Z.T @ (model.M @ Z) - np.eye(len(omega2)), 1e-9)
    noise = 1e-12 * np.einsum("zi,zi->i", np.abs(Z), abs(model.K) @ np.abs(Z)).max(initial=0.0)
    allowed = noise + 1e-7 * omega2.max(initial=0.0)
    _check_small("Z^T K Z - diag(omega2)", Z.T @ (model.K @ Z) - np.diag(omega2), allowed)
    _check_small("L Z", L @ Z, 1e-8 * np.abs(Z).max(initial=0.0))
    if omega2.size and not omega2[0] > 0:
        raise ComputationError(f"the lowest squared frequency is {omega2[0]:.3g} rad^2/s^2: a rigid motion is left")
    if _rigid_content(model, Z).max(initial=0.0) > 1 - _RIGID:
        raise ComputationError("a mode of the basis is a rigid motion: the reference conditions do not hold the body")


def _check_small(name: str, value: Array, allowed: float) -> None:
    worst = np.abs(value).max(initial=0.0)
    if not worst <= allowed:
        raise ComputationError(f"the basis is inaccurate: {name} reaches {worst:.1e}, allowed {allowed:.1e}")


def _rigid_content(model: CoupledModel, Z: Array) -> Array:
    """(n,) the part of each mode's unit mass norm that a rigid motion can take away."""
    momenta = model.M @ model.T
    coupling = momenta.T @ Z
    return np.einsum("in,in->n", coupling, np.linalg.solve(model.T.T @ momenta, coupling))
