"""Whether the rates that a Python function of time tells beside its values are theirs.

Next to each time, at either side, they are compared with how the values change over a ten-thousandth of what the times are
apart, and second derivatives with how the told rates change. One side is enough, as a function may have a kink just there.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ffr_prep.common.arrays import Array

LOOKED = 17  # times that are looked at, of those given
BESIDE, ALONE = 1e-4, 1e-6  # of the spacing of times, how far beside them; and [s] beside a single one
WRONG, MOVES = 0.05, 0.05  # of the largest rate: how far a told one is off, and from where on it counts
FARTHER = 10.0  # times as far beside them, where the same must be found


class WrongRate(NamedTuple):
    """At a time [s], what is told, what the numbers before it change by, and which derivative: 1 or 2."""

    time: float
    told: float
    found: float
    order: int


def wrong_rate(function: Callable[[float], Array], times: Array) -> WrongRate | None:
    """The worst of the derivatives that are told, where most of a motion at these times has others.

    function : t [s] -> (3,) value, rate and second derivative, NaN for what it does not tell. None, too, where it has no
               values beside the times
    """
    chosen: Array = times[np.unique(np.linspace(0, times.size - 1, LOOKED).round().astype(int))]
    apart = BESIDE * float(np.diff(times).min()) if times.size > 1 else ALONE
    apart = max(apart, 1e4 * float(np.spacing(np.abs(times[-1]))))
    try:
        at = np.array([function(t) for t in chosen])
        orders = [number for number in (1, 2) if np.isfinite(at[:, : number + 1]).all()]
        sides = (-1, 1, -FARTHER, FARTHER) if orders else ()
        beside = [np.array([function(t + side * apart) for t in chosen]) for side in sides]
    except Exception:  # whatever a function of the user raises where it has no values
        return None
    for number in orders:
        told: Array = at[:, number]
        before = [other[:, number - 1] - at[:, number - 1] for other in beside]
        near = _nearer(told, before[0] / -apart, before[1] / apart)
        far = _nearer(told, before[2] / (-FARTHER * apart), before[3] / (FARTHER * apart))
        off: Array = np.abs(near - told)
        size: Array = np.maximum(np.abs(told), np.abs(near))
        largest = float(size.max())
        is_wrong = (off > WRONG * largest) & (np.abs(far - near) < 0.5 * off)
        if 2 * np.count_nonzero(is_wrong) > int(np.count_nonzero(size > MOVES * largest)):
            worst = int((off * is_wrong).argmax())
            return WrongRate(float(chosen[worst]), float(told[worst]), float(near[worst]), number)
    return None


def misled(what: str, time: float, told: float, found: float, order: float) -> str:
    """A `WrongRate` in words; what : has the function."""
    name, of = ("rate", "value") if order == 1 else ("second derivative", "rate")
    return (
        f"{what}: its Python function tells a {name} of {told:.4g} at t = {time:.6g} s, where its {of} changes by "
        f"{found:.4g} in a second: correct it, or take a formula or fd.table, which know theirs"
    )


def _nearer(told: Array, before: Array, behind: Array) -> Array:
    return np.where(np.abs(before - told) < np.abs(behind - told), before, behind)
