"""Branches of solutions of G(u, p) = 0, followed by pseudo-arclength through turning points of the parameter.

From a solution w = (u, p) with the tangent t, J t = 0, |t| = 1, in units in which all components count alike, a step h
leads to w + h t, which Newton's method corrects in the plane across t. Its matrix is that of the last solution, with
Broyden's updates; where it does not converge the step is halved. The turning points of p, where two solutions meet
(folds), are the zeros of dp/ds. (Allgower & Georg, Introduction to Numerical Continuation Methods, 2003, ch. 2, 7.)
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError

FIRST, LEAST = 0.01, 1e-5  # of a step: the first and the shortest
CORRECTIONS, SOON = 8, 3  # Newton's: at most, and so few that the next step is longer
CLOSED, ROUNDING = 1e-8, 1e-12  # of G, relative to the largest u, and at least
BENT = 0.9  # cosine between tangents of neighbours, from where a step was too long
MOST = 1000  # solutions


@dataclass(frozen=True)
class Solution:
    """u (n,) and p of G(u, p) = 0, the derivative (n, n + 1) of G, and the tangent (n + 1,)."""

    u: Array
    p: float
    J: Array
    tangent: Array


@dataclass(frozen=True)
class Problem:
    """G (n,) at (u, p), and its derivative (n, n + 1) there, which is given G.

    range   : of p, from where the branch begins to where it ends
    longest : of a step, in parts of the range and of the largest u
    words   : for a value of p
    """

    G: Callable[[Array, float], Array]
    J: Callable[[Array, float, Array], Array]
    range: tuple[float, float]
    longest: float
    words: Callable[[float], str]


def branch(of: Problem, u: Array) -> Iterator[Solution]:
    """The solutions from u (n,) at the beginning of the range on, until p leaves it. Raises ComputationError where a step
    does not come to a solution."""
    begin, end = of.range
    at = _solution(of, u, begin, np.append(np.zeros(u.size), np.sign(end - begin)), _units(of, u, 0.0))
    yield at
    largest, h = float(np.abs(u).max(initial=0.0)), FIRST
    for _ in range(MOST):
        units = _units(of, u, largest)
        at = _solution(of, at.u, at.p, at.tangent, units, at.J)
        after, h = _next(of, at, units, h)
        if not min(begin, end) <= after.p <= max(begin, end):
            yield _at_the_end(of, at, after, units)
            return
        yield after
        at, largest = after, max(largest, float(np.abs(after.u).max(initial=0.0)))
    raise ComputationError(
        f"after {MOST} periodic motions the branch has come to {of.words(at.p)} only; give a band that ends there"
    )


def _units(of: Problem, u: Array, largest: float) -> Array:
    """(n + 1,) what counts as one."""
    return np.append(np.full(u.size, max(largest, 1e-6)), abs(of.range[1] - of.range[0]))


def _solution(of: Problem, u: Array, p: float, towards: Array, units: Array, J: Array | None = None) -> Solution:
    """With the tangent that goes on `towards`."""
    J = of.J(u, p, of.G(u, p)) if J is None else J
    t = np.linalg.svd(J * units)[2][-1]
    t = t if t @ (towards / units) >= 0 else -t
    return Solution(u, p, J, t * units)


def _next(of: Problem, at: Solution, units: Array, h: float) -> tuple[Solution, float]:
    """The solution a step on, and the step after it."""
    why: ComputationError | None = None
    while h >= LEAST:
        try:
            found, count = _corrected(of, at, units, h)
        except ComputationError as error:
            found, count, why = None, CORRECTIONS, error
        if found is not None:
            after = _solution(of, found[:-1], float(found[-1]), at.tangent, units)
            if (after.tangent / units) @ (at.tangent / units) >= BENT:
                return after, min(2.0 * h if count <= SOON else h, of.longest)
        h /= 2
    raise ComputationError(
        f"the periodic motion cannot be followed beyond {of.words(at.p)}: "
        + (
            str(why)
            if why
            else "it may change at once there, at a stop or by dry friction; give more steps to a period"
        )
        + "; give a smaller amplitude, or a band that ends there"
    ) from why


def _corrected(of: Problem, at: Solution, units: Array, h: float) -> tuple[Array | None, int]:
    """(n + 1,) the solution in the plane across the tangent at a step, and how many corrections it took; None where they do
    not converge. Raises ComputationError where G cannot be computed."""
    t, closed = at.tangent / units, max(ROUNDING, CLOSED * units[0])
    w = np.append(at.u, at.p) / units + h * t
    A = np.vstack([at.J * units, t])
    G = of.G(w[:-1] * units[:-1], float(w[-1] * units[-1]))
    for count in range(1, CORRECTIONS + 1):
        step = np.linalg.lstsq(A, -np.append(G, 0.0), rcond=1e-13)[0]
        w = w + step
        G = of.G(w[:-1] * units[:-1], float(w[-1] * units[-1]))
        if np.abs(G).max(initial=0.0) <= closed:
            return w * units, count
        A[:-1] += np.outer(G, step) / (step @ step)
    return None, CORRECTIONS


def _at_the_end(of: Problem, at: Solution, after: Solution, units: Array) -> Solution:
    """The solution at the end of the range between two, by Newton's method at the fixed parameter."""
    p = of.range[1] if abs(after.p - of.range[1]) < abs(after.p - of.range[0]) else of.range[0]
    share = (p - at.p) / (after.p - at.p)
    u = at.u + share * (after.u - at.u)
    for _ in range(CORRECTIONS):
        G = of.G(u, p)
        if np.abs(G).max(initial=0.0) <= max(ROUNDING, CLOSED * units[0]):
            break
        u = u - np.linalg.lstsq(after.J[:, :-1], G, rcond=1e-13)[0]
    return _solution(of, u, p, after.tangent, units)


def folds(p: Array, arc: Array) -> list[tuple[int, float]]:
    """Where the parameter p (N,) of solutions at arclengths (N,) turns: the number of the solution next to it, and the
    value of the parabola through three of them."""
    found = []
    for k in range(1, p.size - 1):
        if (p[k] - p[k - 1]) * (p[k + 1] - p[k]) < 0:
            c = np.polyfit(arc[k - 1 : k + 2] - arc[k], p[k - 1 : k + 2], 2)
            found.append((k, float(c[2] - c[1] ** 2 / (4 * c[0]))))
    return found
