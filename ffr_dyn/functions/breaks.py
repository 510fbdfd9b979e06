"""Where functions of time break: where their value, their rate or their second derivative jumps. Steps end there.

Of functions that are given in pieces the times are known, and so they are of a Python function that tells its own. An
operation of a formula, such as min(a, b), breaks where the difference of its operands, or its only one, changes sign: the
kernels look for that in every step (`ffr_dyn.kernels.functions.search_break`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from ffr_dyn.functions.operations import ABS, DIVIDE, MAX, MIN, SIGN, STEP
from ffr_dyn.functions.time_functions import OPERATION, PIECEWISE, POLYNOMIAL, USER, TimeFunction
from ffr_prep.common.arrays import Array

JUMP = 1e-6  # of the largest number of a function, or of the same derivative, beyond which it jumps
OF_DIFFERENCE, OF_FIRST, OF_SECOND = (MIN, MAX), (ABS, SIGN, STEP), (DIVIDE,)


def declared_breaks(functions: Sequence[TimeFunction]) -> Array:
    """(K, 3) in order: the last time before a break, the first behind it, and that at which a row there looks [s].

    A row shows what begins there; at the end of a table what ends there.
    """
    found = set[tuple[float, float, float]]()
    for function in functions:
        if function.kind == USER:
            found |= {begins(time) for time in function.data[1:]}
        if function.kind == PIECEWISE and not function.name:
            times, last = _breaks_of_pieces(function), function.data[2 + int(function.data[0])]
            found |= {_ends(time) if time == last else begins(time) for time in times}
    return np.array(sorted(found)).reshape(-1, 3)


def switches(functions: Sequence[TimeFunction]) -> Array:
    """(J, 2) rows a, b of functions: one breaks where a - b changes sign, or where a does, where b is -1."""
    found = list[tuple[int, int]]()
    for function in functions:
        if function.kind == OPERATION:
            op, _, first, second = (int(number) for number in function.data)
            pairs = {OF_DIFFERENCE: (first, second), OF_FIRST: (first, -1), OF_SECOND: (second, -1)}
            found += [pair for ops, pair in pairs.items() if op in ops and not _fixed(functions, pair)]
    return np.array(found, dtype=np.int64).reshape(-1, 2)


def _fixed(functions: Sequence[TimeFunction], pair: tuple[int, int]) -> bool:
    """Whether what may change its sign never does, as where something is divided by a number."""
    return all(functions[k].kind == POLYNOMIAL and len(functions[k].data) == 1 for k in pair if k >= 0)


def begins(time: float) -> tuple[float, float, float]:
    """A row of `declared_breaks` at which a row shows what begins there."""
    return float(np.nextafter(time, -np.inf)), time, time


def _ends(time: float) -> tuple[float, float, float]:
    return time, float(np.nextafter(time, np.inf)), time


def _breaks_of_pieces(function: TimeFunction) -> list[float]:
    """Of a piecewise polynomial, which stands still before its first break and after its last."""
    pieces, count = int(function.data[0]), int(function.data[1])
    breaks = np.array(function.data[2 : 3 + pieces])
    coefficients = np.array(function.data[3 + pieces :]).reshape(pieces, count)
    begun = _derivatives(coefficients, np.zeros(pieces))
    ended = _derivatives(coefficients, np.diff(breaks))
    before = np.vstack([begun[:1] * [1.0, 0.0, 0.0], ended])
    after = np.vstack([begun, ended[-1:] * [1.0, 0.0, 0.0]])
    size = np.maximum(np.abs(before), np.abs(after)).max(axis=0)
    found: list[float] = breaks[(np.abs(after - before) > JUMP * size).any(axis=1)].tolist()
    return found


def _derivatives(coefficients: Array, t: Array) -> Array:
    """(pieces, 3) value, rate and second derivative of ascending polynomials (pieces, k), each at its own time (pieces,)."""
    found = []
    for _ in range(3):
        powers = t[:, None] ** np.arange(coefficients.shape[1])
        found.append((coefficients * powers).sum(axis=1))
        coefficients = coefficients[:, 1:] * np.arange(1, coefficients.shape[1])
    return np.stack(found, axis=1)


# ---- those that nobody has told ------------------------------------------------------------------------------------------

MOST = 8  # intervals of each kind that are looked into
HALVINGS, BENT = 40, 20  # of an interval: of one in which something jumps, and of one with a kink
LEFT = 0.2  # of a change, or of a change of slope, that is left in the smallest part
STEADY = 0.75  # of it that is left by the last halving: half of it of what is smooth, however fast between the rows
ROUNDING = 1e-12  # of the largest number of a function


def hidden_breaks(function: Callable[[float], Array], times: Array) -> list[float]:
    """Times [s] at which a function -> (value, rate, second derivative) breaks, between times (T,) of rows, found by
    calling it.

    What is smooth changes by half as much in half of an interval; what jumps does not. The same holds for changes of slope.
    """
    values = np.array([function(t) for t in times.tolist()])
    size, found = np.ptp(values, axis=0), list[float]()
    for c in range(3):
        changes = np.diff(values[:, c])
        for k in _standing_out(changes, values[:, c]):
            least = max(LEFT * abs(changes[k]), JUMP * size[c])
            found += _jumps(partial(_component, function, c), float(times[k]), float(times[k + 1]), least)
    bends = np.diff(values[:, 0], 2)
    for k in _standing_out(bends, values[:, 0]):
        least = max(LEFT * abs(bends[k]), JUMP * size[0])
        for time in _kinks(partial(_component, function, 0), float(times[k]), float(times[k + 2]), least):
            if not any(abs(time - t) <= times[k + 2] - times[k] for t in found):
                found.append(time)
    return sorted(found)


def _component(function: Callable[[float], Array], number: int, t: float) -> float:
    return float(function(t)[number])


def _standing_out(changes: Array, values: Array) -> list[int]:
    """The numbers of the changes of values that differ most from their neighbours but one, by more than rounding."""
    around = np.pad(changes, 2, mode="edge")
    excess = np.abs(changes - 0.5 * (around[:-4] + around[4:]))
    largest = np.argsort(-excess, kind="stable")[:MOST]
    return [int(k) for k in largest if excess[k] > ROUNDING * np.abs(values).max()]


def _jumps(function: Callable[[float], float], early: float, late: float, least: float) -> list[float]:
    """When [s] a function changes most between two times, if it does so by that much in the smallest part of them."""
    low, high = function(early), function(late)
    for _ in range(HALVINGS):
        before = abs(high - low)
        middle = 0.5 * (early + late)
        mid = function(middle)
        if abs(mid - low) > abs(high - mid):
            late, high = middle, mid
        else:
            early, low = middle, mid
        if not abs(high - low) > least:
            return []
    return [late] if abs(high - low) > STEADY * before else []


def _kinks(function: Callable[[float], float], early: float, late: float, least: float) -> list[float]:
    """When [s] a function bends most between two times, if it bends there by that much, taken for all of the time."""
    whole = width = late - early
    bent = before = np.inf
    for _ in range(BENT):
        width *= 0.5
        starts = early + np.array([0.0, 0.5, 1.0]) * width
        bends = [abs(function(t) - 2 * function(t + 0.5 * width) + function(t + width)) for t in starts.tolist()]
        early = float(starts[int(np.argmax(bends))])
        before, bent = bent, max(bends) * whole / width
        if not bent > least:
            return []
    return [early + 0.5 * width] if bent > STEADY * before else []
