"""What the rows of sparse matrices span: whether they are independent, and smallest solutions.

Constraint rows touch two bodies each. Where they are clearly independent, a sparse factor of their Gram matrix says so and
solves with them, at a cost in proportion to their number for chains and trees. It squares what rows have of their own, so
rows that depend on others, or nearly, are for dense decompositions, which take the cube of their number.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_array, csr_array, diags_array
from scipy.sparse.linalg import SuperLU, splu

from ffr_prep.common.arrays import Array

CLEARLY = 1e-12  # of a row's square, that those before it do not contain: rounding leaves 1e-15 or so
TRUNCATED = 1e-10  # singular values, relative to the largest, that count as zero


def independent(A: csr_array) -> bool:
    """Whether the rows of A (C, V) are clearly independent."""
    return _factor(_unit_rows(A)[0]) is not None


def smallest_solution(A: csr_array, target: Array) -> Array:
    """(V,) the smallest z with A z = target (C,), by least squares where there is none."""
    rows, length = _unit_rows(A)
    factor = _factor(rows)
    if factor is None:
        return np.linalg.lstsq(A.toarray(), target, rcond=TRUNCATED)[0]
    y = factor.solve(target / length)
    for _ in range(2):  # what squaring the rows has cost
        y += factor.solve(target / length - rows @ (rows.T @ y))
    return rows.T @ y


def _unit_rows(A: csr_array) -> tuple[csr_array, Array]:
    """The rows scaled to length one, and their lengths, one where a row vanishes."""
    length = np.sqrt(np.asarray((A * A).sum(axis=1)).ravel())
    length = np.where(length > 0, length, 1.0)
    return csr_array(diags_array(1 / length) @ A), length


def _factor(rows: csr_array) -> SuperLU | None:
    """The factor of the Gram matrix of unit rows; None where one of them is hardly more than a combination of others."""
    if not 0 < rows.shape[0] <= rows.shape[1]:
        return None
    try:
        factor = splu(
            csc_array(rows @ rows.T), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
        )
    except RuntimeError:  # exactly singular
        return None
    if (factor.perm_r != factor.perm_c).any():  # a pivot was zero, and SuperLU took one beside the diagonal
        return None
    return factor if np.abs(factor.U.diagonal()).min() > CLEARLY else None
