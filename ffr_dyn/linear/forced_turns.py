"""Periodic motions under a harmonic input, as solutions of G(s, ln f) = 0 that a continuation follows.

G is what a period of the compiled loop leaves open of a deviation s in the chart of a state at rest, in which both count by
the size of the scene (`ffr_dyn.linear.turn_map`); a period has the same number of steps at every frequency f. Its derivative
by s is the monodromy matrix less one, of differences, and tells what is stable as well.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ffr_dyn.compile.engine import with_model
from ffr_dyn.consistency.evaluation import Evaluator
from ffr_dyn.functions.time_functions import HARMONIC
from ffr_dyn.kernels.tables import Record
from ffr_dyn.linear.continuation import Problem
from ffr_dyn.linear.turn_map import Turns, after, deviation, mapped, placed
from ffr_prep.common.arrays import Array

SHIFT = 1e-6  # of deviations and of ln f in differences
MARK = 1.61803398874989e-3  # Hz: the frequency by which the input is known among the time functions


@dataclass(frozen=True)
class Wave:
    """An input of the size amplitude (2 pi f)^power.

    scale : (2 d,) of deviations that count as one, the same at all frequencies
    """

    of: Turns
    amplitude: float
    power: int
    scale: Array

    def at(self, frequency: float, share: float = 1.0) -> Turns:
        """The map over a period of the frequency [Hz], under a share of the input."""
        of, omega = self.of, 2 * np.pi * frequency
        size = share * self.amplitude * omega**self.power
        at, whole = _under(of.near.at, size, omega), of.near.all_rows
        whole = None if whole is None else _under(whole, size, omega)
        method: Any = of.method
        near, period = replace(of.near, at=at, all_rows=whole), 1 / frequency
        return replace(of, near=near, method=replace(method, step=period / of.steps), period=period)

    def deviation(self, u: Array) -> Array:
        return u * self.scale


def wave(of: Turns, amplitude: float, power: int, frequency: float) -> Wave:
    """The input of a map whose scene has it at the frequency MARK; deviations count as at a frequency [Hz]."""
    return Wave(of, amplitude, power, replace(of, period=1 / frequency).scale)


def _under(at: Evaluator, size: float, omega: float) -> Evaluator:
    """The scene with a wave of this size and frequency [rad/s] in place of that of the frequency MARK."""
    model = at.system.model
    functions, data = model.functions, model.functions.data.copy()
    starts = functions.start[:-1][functions.kind == HARMONIC]
    marked = starts[data[starts + 2] == 2 * np.pi * MARK]
    data[marked + 1], data[marked + 2] = size, omega
    return replace(at, engine=with_model(at.engine, model._replace(functions=functions._replace(data=data))))


def over_frequency(of: Wave, first: float, last: float) -> Problem:
    """From a frequency [Hz] to another, over its logarithm."""
    return _problem(of, lambda p: of.at(float(np.exp(p))), (float(np.log(first)), float(np.log(last))), 0.05, _hertz)


def over_amplitude(of: Wave, frequency: float) -> Problem:
    """From no input to the whole, at a frequency [Hz]."""
    return _problem(of, lambda p: of.at(frequency, p), (0.0, 1.0), 0.5, _percent)


def _hertz(p: float) -> str:
    return f"{np.exp(p):.6g} Hz"


def _percent(p: float) -> str:
    return f"{100 * p:.3g} % of the amplitude"


def _problem(
    of: Wave, at: Callable[[float], Turns], ends: tuple[float, float], longest: float, words: Callable[[float], str]
) -> Problem:
    def left(u: Array, p: float) -> Array:
        return mapped(at(p), of.deviation(u)) / of.scale - u

    def derivative(u: Array, p: float, G: Array) -> Array:
        steps = SHIFT * np.eye(u.size + 1)
        columns = [(left(u + step[:-1], p + step[-1]) - G) / SHIFT for step in steps]
        return np.array(columns).T

    return Problem(left, derivative, ends, longest, words)


def period(of: Wave, u: Array, frequency: float, rows: int) -> tuple[Turns, Record]:
    """The motion of a solution in `rows` states, evenly, from after its beginning to its end."""
    turning = of.at(frequency)
    return turning, after(turning, *placed(turning, of.deviation(u)), rows=rows)


def begun(of: Wave, x: Array, v: Array) -> Array:
    """(2 d,) the deviation of a state, in units of the scale."""
    return deviation(of.of, x, v) / of.scale
