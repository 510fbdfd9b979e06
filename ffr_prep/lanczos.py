"""Block Lanczos iteration for the lowest modes of a supported structure.

The flexibility G of the supports (loads to displacements) and the mass M have the modes as eigenvectors,
G M u = u / omega^2. The space of some start vectors, G M times these, (G M)^2 times these ... holds the lowest modes
first. Blocks let one pass over the factorisation serve several vectors, and find modes of equal frequency, as a square
beam has them.

Source: R. G. Grimes, J. G. Lewis, H. D. Simon, SIAM J. Matrix Anal. Appl. 15 (1994) 228-272; here with full
orthogonalisation and without shifts.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.linalg
import scipy.sparse as sp

from ffr_prep.errors import ComputationError

Array = np.ndarray

_RESIDUAL = 1e-9
_DEPENDENT = 1e-10


def lowest_modes(
    flexibility: Callable[[Array], Array], M: sp.csr_array, start: Array, count: int, most: int
) -> tuple[Array, Array]:
    """The `count` lowest omega2 (count,) [rad^2/s^2], ascending, and their M-orthonormal modes (Z, count).

    flexibility : (Z, b) loads -> (Z, b) displacements, symmetric and semidefinite
    start       : (Z, b) start vectors
    most        : vectors that the search space may have

    Raises ComputationError when the residual |G M u - u / omega2| of a mode, in the norm of the mass, is not below
    1e-9 / omega2 by then. The error of omega2 is of second order in it.
    """
    Q: list[Array] = []
    MQ: list[Array] = []
    T = np.zeros((0, 0))
    block = _orthonormal(flexibility(M @ start), Q, MQ, M)
    while True:
        Q.append(block)
        MQ.append(M @ block)
        following = flexibility(MQ[-1])
        T = _bordered(T, np.vstack([mq.T @ following for mq in MQ]))
        block = _orthonormal(following, Q, MQ, M)
        values, vectors = scipy.linalg.eigh(T)
        values, vectors = values[::-1][:count], vectors[:, ::-1][:, :count]
        coupling = (M @ block).T @ following
        residuals = np.linalg.norm(coupling @ vectors[-following.shape[1] :], axis=0)
        if len(values) == count and (residuals <= _RESIDUAL * values).all():
            return 1 / values, np.hstack(Q) @ vectors
        if len(T) + block.shape[1] > most or not block.size:
            converged = int(np.sum(residuals <= _RESIDUAL * values))
            raise ComputationError(
                f"only {converged} of {count} normal modes converged with {len(T)} vectors: ask for fewer modes"
            )


def _bordered(T: Array, columns: Array) -> Array:
    """The symmetric matrix T (p, p) with b more rows and columns; columns : (p + b, b)."""
    old = len(T)
    corner = columns[old:]
    return np.block([[T, columns[:old]], [columns[:old].T, (corner + corner.T) / 2]])


def _orthonormal(vectors: Array, Q: list[Array], MQ: list[Array], M: sp.csr_array) -> Array:
    """M-orthonormal basis of what the vectors add to the blocks Q; a second pass removes the rounding of the first."""
    smallest = _DEPENDENT**2 * np.einsum("zi,zi->i", vectors, M @ vectors).max(initial=0.0)
    for _ in range(2):
        for q, mq in zip(Q, MQ, strict=True):
            vectors = vectors - q @ (mq.T @ vectors)
        squares, axes = scipy.linalg.eigh(vectors.T @ (M @ vectors))
        added = squares > smallest
        vectors = vectors @ (axes[:, added] / np.sqrt(squares[added]))
        smallest = 0.5
    return vectors
