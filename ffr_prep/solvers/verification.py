"""Normal modes looked at once more: how well each solves its equation, and whether one is missing.

The residual of a mode is that of G M u = u / omega2 with the flexibility G of the supports, in the norm of the mass and
relative to u / omega2: as far as this the squared frequency is from an exact one at most, relatively. By a Sturm count
(`ffr_prep.solvers.inertia`) as many modes lie below a shift between two of the found ones as were found there.

Source: B. N. Parlett, The Symmetric Eigenvalue Problem (1998), sections 4.5 (bound of the residual) and 3.3 (count).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError
from ffr_prep.solvers.threads import sparse_product, threads

_TOGETHER = 48
_APART = 1e-6  # relative gap of squared frequencies that a shift may lie in
_TRIALS = 3
_LARGEST = 1e-8  # residual; searches end at 1e-9, and rounding is beside it


@dataclass(frozen=True)
class Verification:
    """The outcome of the verification of the normal modes of a body.

    residuals : (p,) of each mode, relative
    below     : squared frequency [rad^2/s^2] below which modes were counted
    counted   : how many there are, by the count; as many were found
    """

    residuals: Array
    below: float
    counted: int


def verified(
    flexibility: Callable[[Array], Array], M: sp.csr_array, count: Callable[[float], int], omega2: Array, vectors: Array
) -> Verification:
    """Look at the modes omega2 (p,), ascending, and their M-orthonormal vectors (Z, p).

    flexibility : (Z, r) loads -> (Z, r) displacements under the supports
    count       : how many modes have omega2 below a number; numpy.linalg.LinAlgError where that is one of theirs

    Raises ComputationError where modes are missing and for a residual above 1e-8.
    """
    residuals = _residuals(flexibility, M, omega2, vectors)
    if not residuals.max(initial=0.0) <= _LARGEST:
        worst = int(np.argmax(residuals))
        raise ComputationError(
            f"normal mode {worst + 1} ({_hertz(omega2[worst]):.6g} Hz) misses its equation by {residuals[worst]:.1e} of it: "
            "the stiffness is nearly singular, or materials are of extremely different stiffness"
        )
    found, below = _shift(omega2)
    counted, below = _counted(count, below)
    if counted != found:
        raise ComputationError(
            f"{counted} normal modes lie below {_hertz(below):.6g} Hz and the search has found {found} of them: ask for "
            f"{omega2.size + abs(counted - found)} modes or more"
        )
    return Verification(residuals, below, counted)


def _hertz(omega2: float) -> float:
    return float(np.sqrt(omega2) / (2 * np.pi))


def _residuals(flexibility: Callable[[Array], Array], M: sp.csr_array, omega2: Array, vectors: Array) -> Array:
    residuals = np.zeros(omega2.size)
    for first in range(0, omega2.size, _TOGETHER):
        some = slice(first, first + _TOGETHER)
        with threads() as each:
            momenta = sparse_product(M, vectors[:, some], each)
            off = flexibility(momenta) * omega2[some] - vectors[:, some]
            residuals[some] = np.sqrt(np.einsum("zi,zi->i", off, sparse_product(M, off, each)))
    return residuals


def _shift(omega2: Array) -> tuple[int, float]:
    """How many of the modes lie below a squared frequency in the last gap between them, and this."""
    ends = np.concatenate([[0.0], omega2])
    found = int(np.flatnonzero(np.diff(ends) > _APART * omega2)[-1])
    return found, float(ends[found] + ends[found + 1]) / 2


def _counted(count: Callable[[float], int], below: float) -> tuple[int, float]:
    """How many modes there are, below the number or one as near as rounding where it is just that of a mode."""
    for trial in range(_TRIALS):
        try:
            return count(below), below
        except np.linalg.LinAlgError:
            below *= 1 - 0.1 * _APART * (trial + 1)
    raise ComputationError(
        f"the modes below {_hertz(below):.6g} Hz cannot be counted: K - omega2 M stays singular; "
        "ask for one mode more or less"
    )
