"""The row space of matrices: which rows depend on one another, and smallest solutions.

A few rows are dense matrices, decomposed by singular values. Many are sparse ones: constraint rows touch two bodies each, and
a sparse factor of their Gram matrix costs in proportion to their number for chains and trees. It squares what rows have of
their own, so the matrix is shifted by a little, and what the shift does is taken out again by iteration: solutions by
refinement, combinations of rows that vanish by inverse iteration on several vectors at once, whose lengths are then found
from the rows themselves (Parlett, The Symmetric Eigenvalue Problem, 1998, ch. 4 and 14).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from scipy.linalg import qr, svd
from scipy.sparse import csc_array, csr_array, diags_array, eye_array
from scipy.sparse.linalg import SuperLU, splu

from ffr_prep.common.arrays import Array
from ffr_prep.common.brief import Brief

Matrix: TypeAlias = Array | csr_array

FEW = 60  # rows, up to which matrices are dense
DEPENDENT = 1e-8  # of a row of length one, what others do not contain, below which it depends on them
SHIFT = 1e-13  # of the Gram matrix of rows of length one; its rounding is below
VANISHES = 1e-14  # of a combination of unit rows, what is rounding
SETTLED = 0.9  # of a value, to which an iteration changes it no more
ITERATIONS = 40
REFINEMENTS = 10
FIRST = 4  # vectors of the iteration at first


@dataclass(frozen=True, repr=False)
class Dependence(Brief):
    """How rows depend on one another.

    combinations : (C, d) orthonormal, the combinations of unit rows that vanish
    least        : the length of the shortest combination that does not; infinite where all vanish, or there are no rows
    """

    combinations: Array
    least: float

    @property
    def count(self) -> int:
        """How many rows too many there are."""
        return int(self.combinations.shape[1])


def dependence(A: Matrix) -> Dependence:
    """How the rows of A (C, V) depend on one another."""
    count = A.shape[0]
    if not count:
        return Dependence(np.zeros((0, 0)), np.inf)
    if isinstance(A, np.ndarray):
        return _dense_dependence(A)
    rows, _ = _unit_rows(A)
    factor, size = _factor(rows), min(FIRST, count)
    while True:
        vectors, lengths = _shortest(rows, factor, size)
        vanish = lengths < DEPENDENT * np.abs(vectors).max(axis=0)
        if size == count or not vanish.all():
            return Dependence(vectors[:, vanish], float(lengths[~vanish].min(initial=np.inf)))
        size = min(4 * size, count)


def _dense_dependence(A: Array) -> Dependence:
    """Vectors on the left whose singular values vanish, those that rows beyond the columns add among them."""
    unit = _dense_unit_rows(A)[0]
    if len(A) <= A.shape[1] and (least := float(np.linalg.svd(unit, compute_uv=False)[-1])) >= DEPENDENT:
        return Dependence(np.zeros((len(A), 0)), least)
    vectors, lengths, _ = np.linalg.svd(unit)
    lengths = np.append(lengths, np.zeros(len(A) - lengths.size))
    vanish = lengths < DEPENDENT * np.abs(vectors).max(axis=0)
    return Dependence(vectors[:, vanish], float(lengths[~vanish].min(initial=np.inf)))


def _dense_unit_rows(A: Array) -> tuple[Array, Array]:
    length = np.sqrt(np.einsum("ij,ij->i", A, A))
    length = np.where(length > 0, length, 1.0)
    return A / length[:, None], length


def row_lengths(A: Matrix) -> Array:
    """(C,) the lengths of the rows, one where a row vanishes."""
    return (_dense_unit_rows(A) if isinstance(A, np.ndarray) else _unit_rows(A))[1]


def independent(A: Matrix) -> bool:
    """Whether the rows of A (C, V) are independent."""
    return dependence(A).count == 0


def smallest_solution(A: Matrix, target: Array) -> Array:
    """(V,) the smallest z with A z = target (C,), by least squares where there is none."""
    if not A.shape[0]:
        return np.zeros(A.shape[1])
    if isinstance(A, np.ndarray):
        unit, length = _dense_unit_rows(A)
        found: Array = np.linalg.lstsq(unit, target / length, rcond=DEPENDENT)[0]
        return found
    rows, length = _unit_rows(A)
    factor, wanted = _factor(rows), target / length
    y, left, before = np.zeros_like(wanted), wanted, np.inf
    for _ in range(REFINEMENTS):
        y = y + factor.solve(left)
        left = wanted - rows @ (rows.T @ y)
        size = float(np.abs(left).max(initial=0.0))
        if not size < 0.5 * before:
            break
        before = size
    return rows.T @ y


def _shortest(rows: csr_array, factor: SuperLU, size: int) -> tuple[Array, Array]:
    """(C, size) orthonormal combinations of rows that are shortest, and their lengths, by subspace iteration."""
    Z, before = np.random.default_rng(0).normal(size=(rows.shape[0], size)), np.full(size, np.inf)
    for _ in range(ITERATIONS):
        Z = qr(factor.solve(Z), mode="economic")[0]
        _, lengths, turn = svd(rows.T @ Z, full_matrices=False)
        lengths, turn = np.append(lengths, np.zeros(size - lengths.size)), _square(turn, size)
        if ((lengths > SETTLED * before) | (lengths < VANISHES)).all():
            break
        before = lengths
    return Z @ turn.T, lengths


def _square(turn: Array, size: int) -> Array:
    """Orthonormal rows, made complete."""
    if turn.shape[0] == size:
        return turn
    return np.concatenate([turn, qr(turn.T)[0][:, turn.shape[0] :].T])


def _unit_rows(A: csr_array) -> tuple[csr_array, Array]:
    """The rows scaled to length one, and their lengths, one where a row vanishes."""
    length = np.sqrt(np.asarray((A * A).sum(axis=1)).ravel())
    length = np.where(length > 0, length, 1.0)
    return csr_array(diags_array(1 / length) @ A), length


def _factor(rows: csr_array) -> SuperLU:
    """The factor of the shifted Gram matrix of unit rows, which is positive definite: pivots stay on the diagonal."""
    gram, shift = rows @ rows.T, SHIFT
    while True:
        shifted = csc_array(gram + shift * eye_array(rows.shape[0]))
        factor = splu(shifted, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        if (factor.perm_r == factor.perm_c).all() and factor.U.diagonal().min() > 0.1 * shift:
            return factor
        shift *= 10.0  # rounding of very long rows
