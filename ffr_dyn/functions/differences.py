"""Derivatives by central differences of steps that suit the function.

A step h leaves an error of f''' h^2 / 6, and rounding one of eps |f| / h. Two steps, h and h / 2, are extrapolated
(Richardson 1911), and their difference tells the error of each entry. Where that is too large the function bends within a
step, as friction does over its creep or a force across a gap of a micrometre: there the step becomes smaller, until the entry
is accurate, or rounding outweighs what is gained. The step with the least error relative to the derivative is taken.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

from ffr_prep.common.arrays import Array

ACCURATE = (
    1e-5  # of the largest derivative of the same number: what halving a step may change; extrapolated, its square
)
ROUNDING = 8 * np.finfo(float).eps  # of values, over the step
NOISE = 1e3  # times that: an error that may be rounding's
SMALLER, LEVELS = 0.1, 8  # by which a step becomes smaller, and how often
NOT_DEFINED = (ArithmeticError, ValueError, TypeError)  # of Python functions beyond a gap: logarithms, complex powers
# Of a derivative that smaller steps make no smaller: an error that none has reduced is that of a jump, of which the first
# step tells the most.
JUMP = 0.3
WORSE = 1.01  # times the error relative to the derivative, which stays as it is far beyond where a function is level


def differences(function: Callable[[Array], Array], steps: Array, columns: Iterable[int]) -> tuple[Array, Array]:
    """(K, M) derivatives of K numbers at zero by M others, of these the columns, and (K, M) their errors; the first steps are
    (M,). They are nan where the function is defined within no step."""
    columns = list(columns)
    here = np.ravel(function(np.zeros(steps.size)))
    found, errors, largest = np.zeros((here.size, steps.size)), np.zeros((here.size, steps.size)), np.abs(here)
    for k in columns:
        found[:, k], errors[:, k], most = _central(function, k, steps, here.size)
        largest = np.fmax(largest, most)
    first = found.copy(), errors.copy()
    for k in columns:
        _refine(function, k, steps, ROUNDING * largest / steps[k], (found, errors))
    jumps = np.isfinite(first[0]) & ~(errors <= JUMP * np.abs(found)) & ~(np.abs(found) < np.abs(first[0]))
    return np.where(jumps, first[0], found), np.where(jumps, first[1], errors)


def _refine(
    function: Callable[[Array], Array], k: int, steps: Array, rounding: Array, so_far: tuple[Array, Array]
) -> None:
    """Smaller steps of the k-th number, for the entries of its column that are not accurate, until rounding, an error of
    (K,) at the first step, makes them worse."""
    found, errors = so_far[0][:, k], so_far[1][:, k]
    for level in range(1, LEVELS + 1):
        wanted = np.fmax(ACCURATE * np.fmax.reduce(np.abs(so_far[0]), axis=1), rounding * SMALLER ** (1 - level))
        rough = ~(errors <= wanted)
        if not rough.any():
            return
        again, error, _ = _central(function, k, SMALLER**level * steps, found.size)
        error += rounding * SMALLER**-level
        worse = error * np.abs(found) > WORSE * errors * np.abs(again)
        taken = rough & ~worse & np.isfinite(again)
        if not taken.any() and (error[rough] <= NOISE * rounding[rough] * SMALLER**-level).all():
            return
        found[taken], errors[taken] = again[taken], error[taken]


def _central(function: Callable[[Array], Array], k: int, steps: Array, count: int) -> tuple[Array, Array, Array]:
    """(K,) derivatives by the k-th number, what halving the step changes, and the size of the values; nan where the function
    is not defined."""
    whole, half = np.zeros(steps.size), np.zeros(steps.size)
    whole[k], half[k] = steps[k], 0.5 * steps[k]
    try:
        with np.errstate(all="ignore"):
            values = [np.ravel(function(y)) for y in (whole, -whole, half, -half)]
    except NOT_DEFINED:
        nothing = np.full(count, np.nan)
        return nothing, nothing, nothing
    coarse, fine = (values[0] - values[1]) / (2 * steps[k]), (values[2] - values[3]) / steps[k]
    return (4 * fine - coarse) / 3, np.abs(fine - coarse), np.abs(values).max(axis=0)
