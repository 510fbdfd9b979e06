"""Where functions of time grow without bound, as 1 / (t - a) does at a: no step resolves that, and no error told holds.

Beside a pole of the order p a function changes by 10^p times as much from each tenth of the distance to the next. This
tells it from jumps, kinks and ends of roots, beside which it changes less and less, and from logarithms, beside which it
changes as much.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ffr_prep.common.arrays import Array

ORDER = 0.2  # of a pole, from where it is one
NEAREST, ROUNDED = 1e-8, 1e-11  # distance from it, of a step and of its time
DECADES = 5  # distances, each ten times the one before
AT_ONCE = 1000  # times that are looked at together


def pole(sample: Callable[[Array], Array], roots: Array, times: Array, step: float) -> tuple[float, int] | None:
    """The first of the times (T,) [s] at which a function has a pole, and its number; None where none has.

    sample : times (T,) -> (T, F, 3) of all functions, as of `fast_changes`;  roots : (F,) whether one is looked at
    """
    times = np.unique(times)
    for part in np.array_split(times, -(-times.size // AT_ONCE) or 1):
        with np.errstate(all="ignore"):  # what has no value there has no pole that is told here
            found = _grows(sample, part, step) & roots
        if found.any():
            first = int(found.any(axis=1).argmax())
            return float(part[first]), int(found[first].argmax())
    return None


def _grows(sample: Callable[[Array], Array], times: Array, step: float) -> Array:
    """(T, F) whether functions grow as beside a pole, on one side at least."""
    nearest = np.maximum(NEAREST * step, ROUNDED * np.abs(times))
    grown = []
    for side in (-1, 1):
        values = np.array([sample(times + side * nearest * 10.0**k)[..., 0] for k in range(DECADES)])
        changes = np.abs(np.diff(values, axis=0))
        grown.append((changes[:-1] > 10**ORDER * changes[1:]).all(axis=0) & (changes[-1] > 0))
    found: Array = grown[0] | grown[1]
    return found
