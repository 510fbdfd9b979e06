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
from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.sparse as sp

from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError
from ffr_prep.common.progress import Advance, no_advance
from ffr_prep.solvers.threads import Map, finish, pieces, sparse_product, threads

_RESIDUAL = 1e-9
_DEPENDENT = 1e-10
_AMPLIFIED = 1e-3  # of the rounding where a direction of a block is as small as this beside its largest
_PANEL = 64
_MANY = 100  # modes whose convergence is looked at after some passes only, as that takes the cube of the vectors
_OFTEN = 1.03


def lowest_modes(
    flexibility: Callable[[Array], Array],
    M: sp.csr_array,
    start: Array,
    count: int,
    most: int,
    advance: Advance = no_advance,
) -> tuple[Array, Array]:
    """The `count` lowest omega2 (count,) [rad^2/s^2], ascending, and their M-orthonormal modes (Z, count).

    flexibility : (Z, b) loads -> (Z, b) displacements, symmetric and semidefinite
    start       : (Z, b) start vectors
    most        : vectors that the search space may have
    advance     : called after each pass, with the share of the modes that have converged

    Raises ComputationError when the residual |G M u - u / omega2| of a mode, in the norm of the mass, is not below
    1e-9 / omega2 by then. The error of omega2 is of second order in it.
    """
    Q = SearchSpace([])
    T = np.zeros((0, 0))
    due = count if count > _MANY else 0
    block, momenta, _ = _orthonormal(flexibility(M @ start), Q, M, [])
    last: list[Array] = []
    while True:
        last = [*last[-1:], momenta]
        _append(Q, block)
        del block  # its memory is needed
        following = flexibility(momenta)
        block, momenta, columns = _orthonormal(following, Q, M, last)
        T = _bordered(T, columns)
        full = len(T) + block.shape[1] > most or not block.size
        if len(T) < due and not full:
            advance(0.0, f"0 of {count} modes, {len(T)} vectors")
            continue
        due = min(max(len(T) + 1, int(_OFTEN * len(T))), most)
        values, vectors = scipy.linalg.eigh(T)
        values, vectors = values[::-1][:count], vectors[:, ::-1][:, :count]
        coupling = momenta.T @ following
        residuals = np.linalg.norm(coupling @ vectors[-following.shape[1] :], axis=0)
        converged = int(np.sum(residuals <= _RESIDUAL * values))
        advance(converged / count, f"{converged} of {count} modes")
        if converged == count:
            return 1 / values, _combined(Q, vectors)
        if full:
            raise ComputationError(
                f"only {converged} of {count} normal modes converged with {len(T)} vectors: ask for fewer modes"
            )


def _bordered(T: Array, columns: Array) -> Array:
    """The symmetric matrix T (p, p) with b more rows and columns; columns : (p + b, b)."""
    old = len(T)
    corner = columns[old:]
    return np.block([[T, columns[:old]], [columns[:old].T, (corner + corner.T) / 2]])


def _orthonormal(vectors: Array, Q: SearchSpace, M: sp.csr_array, last: list[Array]) -> tuple[Array, Array, Array]:
    """The extension of the search space Q by vectors (Z, b): an M-orthonormal basis, M times it, Q^T M of the vectors.

    But for rounding the vectors are coupled to the last vectors of Q alone, M times which is given in blocks. These parts
    are taken out first; then nothing large is left that a single pass over all of Q would have to take out.
    """
    vectors, momenta = np.array(vectors), np.empty(vectors.shape)
    first = Q.size - sum(known.shape[1] for known in last)
    with threads() as each:
        coordinates = np.vstack([np.zeros((first, vectors.shape[1])), *(known.T @ vectors for known in last)])
        _take_out(vectors, Q, coordinates, each, first)
        rounding = _coordinates(Q, sparse_product(M, vectors, each, momenta), each)
        _take_out(vectors, Q, rounding, each, 0)
        coordinates += rounding
        size = np.sum(coordinates**2, axis=0) + np.einsum("zi,zi->i", vectors, momenta)
        vectors, momenta, amplified = _normalised(vectors, momenta, _DEPENDENT**2 * size.max(initial=0.0), each)
        if amplified:
            _take_out(vectors, Q, _coordinates(Q, sparse_product(M, vectors, each, momenta), each), each, 0)
        vectors, momenta, _ = _normalised(vectors, sparse_product(M, vectors, each, momenta), 0.5, each)
    return vectors, momenta, coordinates


def _normalised(vectors: Array, momenta: Array, smallest: float, each: Map) -> tuple[Array, Array, bool]:
    """M-orthonormal basis of the vectors without directions of a smaller squared norm, M times it, and whether some are so
    small that their rounding is large.

    momenta : M times the vectors; what these were freed of since does no harm, as they have no more of it. Both are
              overwritten: fresh memory takes longer than filling it.
    """
    squares, axes = scipy.linalg.eigh(_summed(lambda part: vectors[part].T @ momenta[part], vectors, each))
    kept = squares > smallest
    combination = axes[:, kept] / np.sqrt(squares[kept])
    amplified = bool((squares[kept] < _AMPLIFIED**2 * squares.max(initial=0.0)).any())
    return _turned(vectors, combination, each), _turned(momenta, combination, each), amplified


def _turned(vectors: Array, combination: Array, each: Map) -> Array:
    """(Z, k) vectors (Z, b) times a combination (b, k), in their memory if k = b."""

    def turn(part: slice) -> None:
        vectors[part, : combination.shape[1]] = vectors[part] @ combination

    finish(each(turn, pieces(len(vectors))))
    return np.ascontiguousarray(vectors[:, : combination.shape[1]])


def _summed(product: Callable[[slice], Array], rows: Array, each: Map) -> Array:
    """The sum of products that are made of pieces of long arrays with so many rows."""
    return np.asarray(np.sum(list(each(product, pieces(len(rows)))), axis=0))


# ---- the search space: rows of panels, which make large products of matrices --------------------------------------


@dataclass
class SearchSpace:
    """M-orthonormal vectors, the first `size` rows of panels (_PANEL, Z)."""

    panels: list[Array]
    size: int = 0

    def used(self, first: int = 0) -> list[tuple[slice, Array]]:
        """The vectors from a number on: their numbers and rows, panel by panel."""
        filled = []
        for k, panel in enumerate(self.panels):
            begin, end = max(first, k * _PANEL), min(self.size, (k + 1) * _PANEL)
            if begin < end:
                filled.append((slice(begin, end), panel[begin - k * _PANEL : end - k * _PANEL]))
        return filled


def _append(Q: SearchSpace, block: Array) -> None:
    for vector in block.T:
        if Q.size == _PANEL * len(Q.panels):
            Q.panels.append(np.empty((_PANEL, len(vector))))
        Q.panels[-1][Q.size % _PANEL] = vector
        Q.size += 1


def _coordinates(Q: SearchSpace, momenta: Array, each: Map) -> Array:
    """(p, b) Q^T momenta."""

    def of_rows(part: slice) -> Array:
        return np.vstack([np.zeros((0, momenta.shape[1])), *(rows[:, part] @ momenta[part] for _, rows in Q.used())])

    return _summed(of_rows, momenta, each)


def _take_out(vectors: Array, Q: SearchSpace, coordinates: Array, each: Map, first: int) -> None:
    """Subtract Q coordinates (p, b), those from the vector `first` on, from the vectors (Z, b)."""

    def from_rows(part: slice) -> None:
        for numbers, rows in Q.used(first):
            vectors[part] -= rows[:, part].T @ coordinates[numbers]

    finish(each(from_rows, pieces(len(vectors))))


def _combined(Q: SearchSpace, coordinates: Array) -> Array:
    """(Z, b) Q coordinates (p, b), in the memory of Q, whose vectors are gone then."""
    count = coordinates.shape[1]

    def of_rows(part: slice) -> None:
        whole = np.zeros((part.stop - part.start, count))
        for numbers, rows in Q.used():
            whole += rows[:, part].T @ coordinates[numbers]
        for first, panel in zip(range(0, count, _PANEL), Q.panels, strict=False):
            some = whole[:, first : first + _PANEL].T
            panel[: len(some), part] = some

    with threads() as each:
        finish(each(of_rows, pieces(Q.panels[0].shape[1])))
    del Q.panels[-(-count // _PANEL) :]
    Q.size = count
    vectors = np.empty((Q.panels[0].shape[1], count))
    for numbers, rows in Q.used():
        vectors[:, numbers] = rows.T
    return vectors
