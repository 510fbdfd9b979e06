"""The common form of every reduction: a mass-orthonormal basis with diagonal stiffness, and how vectors reach it.

A reduction proposes vectors. They are brought into the frame of the reference conditions L u = 0, orthonormalised with
the mass, those that depend on the others being dropped and counted, and combined so that

    Z^T M Z = I,    Z^T K Z = diag(omega2),    L Z = 0.

Six reference conditions only decide how rigid motion is shared between frame and elastic field, so each vector keeps
its deformation: u <- u - T (L T)^-1 L u. More of them restrict the deformation, and only combinations that satisfy them
stay.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy.linalg
import scipy.sparse as sp

from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.common.progress import Advance, no_advance
from ffr_prep.model.coupled import CoupledModel
from ffr_prep.model.reference import body_length, free_rigid_motions, motion_in_words
from ffr_prep.solvers.factor import CHOLESKY, FreeBody, Solver, free_body
from ffr_prep.solvers.threads import product, product_of_sizes
from ffr_prep.solvers.verification import Verification

_TIE = 1e-6
_EQUAL = 1e-8  # relative difference of squared frequencies that are meant to be equal: rounding, not the mesh
_RIGID = 1e-9
NO_INERTIA = 1e-14  # relative to the largest, of a body of size one
_CONTAINED = 1e-8  # relative mass norm of what a vector adds to those before it
_DEPENDENT = 1e-7  # the same among the additions, whose products square it
_LEFT = 1e-6  # relative mass norm of the motion of the frame that is left in a vector


@dataclass(frozen=True)
class Basis:
    """Z (z, n) [1/sqrt(kg)], mass-orthonormal with diagonal stiffness; omega2 (n,) [rad^2/s^2], ascending.

    dropped  : number of proposed vectors that depended on the others
    warnings : what makes the basis doubtful, in words
    verification : of the normal modes among the vectors, where it was asked for

    >>> basis.omega2  # of what a reduction's `basis` returned
    """

    Z: Array
    omega2: Array
    dropped: int = 0
    warnings: tuple[str, ...] = ()
    verification: Verification | None = None


class Reduction(Protocol):
    """The one method of every reduction, which is a frozen dataclass of its settings.

    >>> isinstance(fp.CraigBampton(8), fp.Reduction)
    """

    def basis(self, model: CoupledModel, body: FreeBody, L: Array) -> Basis:
        """The basis under the reference conditions L (r, Z), with the factorised stiffness of the model."""


def factorised(model: CoupledModel, solver: Solver = CHOLESKY, advance: Advance = no_advance) -> FreeBody:
    """The one factorisation that serves modes, static shapes, stiffening loads and error reports of a model."""
    return free_body(model.K, model.T, model.places, solver, advance)


# ---- from vectors to a basis --------------------------------------------------------------------------------------


def basis_of(model: CoupledModel, L: Array, *vectors: Array) -> Basis:
    """The basis of the space of all vectors (Z, p) under the reference conditions L (r, Z); earlier ones have precedence.

    >>> basis = fp.basis_of(model.coupled, L, vectors)
    """
    Q, dropped = orthonormalised(model.M, *(in_frame(model, L, V) for V in vectors))
    if len(L) <= 6 and Q.size:
        again = in_frame(model, L, Q)
        sound = _norms(model.M, Q - again) < _LEFT  # others are rounding, of vectors that nearly depended on others
        Q, dropped = again[:, sound], dropped + int(np.sum(~sound))
    basis = diagonalised(model, Q, Q.T @ (model.K @ Q))
    return Basis(basis.Z, basis.omega2, dropped)


def in_frame(model: CoupledModel, L: Array, vectors: Array) -> Array:
    """The deformation of the vectors (Z, p) as seen from the frame of the reference conditions L (r, Z): B_2 times vectors.

    With T the rigid motions, B_2 = I - T (L T)^-1 L. With more than six conditions, the combinations with rigid motions that
    satisfy them: p + 6 - r vectors.
    """
    if len(L) > 6:
        moving = np.hstack([vectors, model.T])
        return moving @ _admissible(model, moving, L)
    for _ in range(2):  # the second pass removes the rounding of the first where rigid motion was most of a vector
        vectors = vectors - model.T @ np.linalg.solve(L @ model.T, L @ vectors)
    return vectors


def orthonormalised(M: sp.csr_array, *vectors: Array) -> tuple[Array, int]:
    """M-orthonormal basis of the space of all vectors (Z, p), and the number of those that depended on others."""
    Q = np.zeros((M.shape[0], 0))
    for V in vectors:
        Q = np.hstack([Q, _additions(M, Q, V)])
    return Q, sum(V.shape[1] for V in vectors) - Q.shape[1]


def _additions(M: sp.csr_array, Q: Array, V: Array) -> Array:
    """M-orthonormal basis of what the vectors V add to those of Q."""
    V = V[:, _norms(M, V) > 0]
    V = V / _norms(M, V)
    for _ in range(2):
        V = V - Q @ (Q.T @ (M @ V))
        size = _norms(M, V)
        V = V[:, size > _CONTAINED] / size[size > _CONTAINED]
    squares, axes = scipy.linalg.eigh(V.T @ (M @ V))
    added = squares > _DEPENDENT**2
    V = V @ (axes[:, added] / np.sqrt(squares[added]))
    V = V - Q @ (Q.T @ (M @ V))
    squares, axes = scipy.linalg.eigh(V.T @ (M @ V))
    return V @ (axes / np.sqrt(squares))


def _norms(M: sp.csr_array, V: Array) -> Array:
    return np.sqrt(np.einsum("zi,zi->i", V, M @ V))


def restricted(model: CoupledModel, vectors: Array, K: Array, L: Array) -> tuple[Array, Array]:
    """The combinations of the vectors (Z, p), with stiffness K (p, p), that satisfy L u = 0: vectors and stiffness."""
    V = _admissible(model, vectors, L)
    return vectors @ V, V.T @ K @ V


def _admissible(model: CoupledModel, vectors: Array, L: Array) -> Array:
    """(p, k) the combinations of the vectors (Z, p) that satisfy L u = 0, told apart alike in any unit of length."""
    scale = 1 / _norms(model.M, vectors)
    conditions = L @ (vectors * scale)
    sizes = np.linalg.norm(conditions, axis=1, keepdims=True)
    return scale[:, None] * scipy.linalg.null_space(conditions / np.where(sizes > 0, sizes, 1.0), rcond=1e-10)


def diagonalised(model: CoupledModel, vectors: Array, K: Array) -> Basis:
    """The mass-orthonormal basis of the same space in which the stiffness K (p, p) is diagonal."""
    M = vectors.T @ product(model.M, vectors)
    scale = 1 / np.sqrt(np.diag(M))
    omega2, combination = scipy.linalg.eigh(K * np.outer(scale, scale), M * np.outer(scale, scale))
    Z = _aligned(model, vectors @ (scale[:, None] * combination), omega2)
    return Basis(Z * _signs(Z), omega2)


def _aligned(model: CoupledModel, Z: Array, omega2: Array) -> Array:
    """The modes, those of equal frequency turned among themselves to move along the axes: x first, then y, then z.

    A round or square bar bends as easily in every plane; which two planes an eigenvalue solver picks is left to rounding.
    In those of the axes, motions in a plane of symmetry and across it stay apart.
    """
    Z = Z.copy()
    for equal in np.split(np.arange(omega2.size), np.flatnonzero(np.diff(omega2) > _EQUAL * omega2[1:]) + 1):
        if equal.size > 1:
            u = (model.B @ Z[:, equal]).reshape(-1, 3, equal.size)
            along, axes = np.linalg.eigh(np.einsum("pci,c,pcj->ij", u, [1.0, 2.0, 3.0], u))
            if np.ptp(along) > _TIE * along[-1]:  # else no direction is better than another
                Z[:, equal] = Z[:, equal] @ axes
    return Z


def _signs(Z: Array) -> Array:
    """(n,) the factor +1 or -1 that makes the largest component of each mode positive (the first among equals)."""
    if not Z.size:
        return np.ones(Z.shape[1])
    size = np.abs(Z)
    first = np.argmax(size >= (1 - _TIE) * size.max(axis=0), axis=0)
    return np.sign(Z[first, np.arange(Z.shape[1])])


# ---- guards -------------------------------------------------------------------------------------------------------


def check_interfaces(model: CoupledModel, name: str) -> None:
    """Raises InputError for a model without interfaces, where the named reduction needs some."""
    if not model.names:
        raise InputError(f"{name} needs at least one interface; without any, reduce by Eigenmodes")


def check_basis(model: CoupledModel, L: Array, basis: Basis) -> None:
    """Raises ComputationError when the basis is not what every later step relies on.

    That is: mass-orthonormal, diagonal in the stiffness, within the reference conditions, without a rigid motion. Raises
    InputError when the mass has no inertia against a rigid motion.
    """
    Z, omega2 = basis.Z, basis.omega2
    _check_small("Z^T M Z - I", Z.T @ product(model.M, Z) - np.eye(len(omega2)), 1e-9)
    noise = 1e-12 * np.einsum("zi,zi->i", np.abs(Z), product_of_sizes(model.K, Z)).max(initial=0.0)
    allowed = noise + 1e-7 * omega2.max(initial=0.0)
    _check_small("Z^T K Z - diag(omega2)", Z.T @ product(model.K, Z) - np.diag(omega2), allowed)
    _check_small("L Z", L @ Z, 1e-8 * np.abs(Z).max(initial=0.0))
    if omega2.size and not omega2[0] > 0:
        raise ComputationError(
            f"the lowest squared frequency is {omega2[0]:.3g} rad^2/s^2: a rigid motion is left; choose reference "
            "conditions that hold the body"
        )
    if _rigid_content(model, Z).max(initial=0.0) > 1 - _RIGID:
        raise ComputationError("a mode of the basis is a rigid motion: choose reference conditions that hold the body")


def _check_small(name: str, value: Array, allowed: float) -> None:
    worst = np.abs(value).max(initial=0.0)
    if not worst <= allowed:
        raise ComputationError(
            f"the basis is inaccurate: {name} reaches {worst:.1e}, allowed {allowed:.1e}; ask for fewer modes, or for "
            "another solver"
        )


def _rigid_content(model: CoupledModel, Z: Array) -> Array:
    """(n,) the part of each mode's unit mass norm that a rigid motion can take away."""
    momenta = model.M @ model.T
    _check_inertia(model, model.T.T @ momenta)
    coupling = momenta.T @ Z
    return np.einsum("in,in->n", coupling, np.linalg.solve(model.T.T @ momenta, coupling))


def _check_inertia(model: CoupledModel, of_rigid_motions: Array) -> None:
    """A body without inertia against a rigid motion cannot be moved by it; masses on one line are such a body."""
    length = body_length(model)
    sizes = np.array([1.0, 1.0, 1.0, length, length, length])
    least, *_, most = np.linalg.eigvalsh(of_rigid_motions / np.outer(sizes, sizes))
    if least > NO_INERTIA * most:
        return
    free = free_rigid_motions(of_rigid_motions, length)
    raise InputError(
        f"the mass has no inertia against {motion_in_words(free[:, 0], model.centre, length)}: give it rotary inertia, "
        "or masses off this line"
    )
