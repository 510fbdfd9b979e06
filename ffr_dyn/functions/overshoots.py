"""Where the spline through a table goes beyond the values of its rows.

A cubic spline with two continuous derivatives bends on beyond a corner. Where two rows are far closer to one another than to
the others, and differ, it swings out by many times what they hold.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ffr_dyn.functions.time_functions import PIECEWISE
from ffr_prep.common.arrays import Array

BEYOND = 0.1  # of the range of the rows, from where it is told
CUBIC = 4  # coefficients of a piece
SMOOTH = 1e-6  # of the largest second derivative, by which a spline's may jump at a row


@dataclass(frozen=True)
class Overshoot:
    """What a spline comes to farthest beyond its rows, when [s], and the least and the most that they hold."""

    value: float
    time: float
    least: float
    most: float

    @property
    def words(self) -> str:
        """What is told of it."""
        return (
            f"the cubic spline through its table goes to {self.value:.4g} at t = {self.time:.4g} s, where its rows hold "
            f"{self.least:.4g} to {self.most:.4g}; give more rows beside its corners, or a piecewise function"
        )


def overshoots(kind: Array, start: Array, data: Array) -> dict[int, Overshoot]:
    """Of functions in the tables of the kernels (`ffr_dyn.kernels.tables.Functions`), by their numbers."""
    found = {int(number): _overshoot(data[start[number] :]) for number in np.flatnonzero(kind == PIECEWISE)}
    return {number: one for number, one in found.items() if one is not None}


def _overshoot(data: Array) -> Overshoot | None:
    """Of a piecewise polynomial; None for one that is no spline of two or more pieces, or stays near its rows."""
    pieces, order = data[:2].astype(int)
    t = data[2 : 3 + pieces]
    c = data[3 + pieces : 3 + pieces * (1 + order)].reshape(pieces, order)
    if order != CUBIC or pieces < 2 or not _smooth(t, c):
        return None
    values = np.append(c[:, 0], _value(c[-1:], t[-1:] - t[-2:-1]))
    values[np.abs(values) <= 1e-9 * np.abs(values).max()] = 0.0  # the last one is rounded
    least, most = float(values.min()), float(values.max())
    reached, times = _turning(t, c)
    beyond = np.maximum(reached - most, least - reached)
    if not beyond.max(initial=0.0) > BEYOND * (most - least):
        return None
    farthest = int(np.argmax(beyond))
    return Overshoot(float(reached[farthest]), float(times[farthest]), least, most)


def _value(c: Array, u: Array) -> Array:
    """(P,) of cubics (P, 4) at times u (P,) [s] after their beginnings."""
    found: Array = c[:, 0] + u * (c[:, 1] + u * (c[:, 2] + u * c[:, 3]))
    return found


def _smooth(t: Array, c: Array) -> bool:
    """Whether second derivatives go on at the inner breaks."""
    ends = 2 * c[:-1, 2] + 6 * c[:-1, 3] * np.diff(t)[:-1]
    return bool(np.abs(ends - 2 * c[1:, 2]).max() <= SMOOTH * np.abs(c[:, 2]).max(initial=0.0))


def _turning(t: Array, c: Array) -> tuple[Array, Array]:
    """Values and times [s] at which cubics (P, 4) turn back between their breaks (P + 1,)."""
    with np.errstate(all="ignore"):
        root = np.sqrt(c[:, 2] ** 2 - 3 * c[:, 3] * c[:, 1])
        q = -(c[:, 2] + np.where(c[:, 2] < 0, -root, root))
        at = np.concatenate([q / (3 * c[:, 3]), c[:, 1] / q])
    c, begins, long = np.tile(c, (2, 1)), np.tile(t[:-1], 2), np.tile(np.diff(t), 2)
    within = (at > 0) & (at < long)
    return _value(c[within], at[within]), begins[within] + at[within]
