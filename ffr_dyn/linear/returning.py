"""The state that a period brings back, by few periods of the right steps.

A periodic motion is a fixed point s = P(s) of the map of a period (`ffr_dyn.linear.turn_map`), which leaves open
c(s) = P(s) - s. Anderson's mixing steps from s to s + (1 - M)^-1 c with the derivative M of P along the differences of the
points before; for a linear map that is GMRES on c = 0. It begins with steps COARSER times as long, whose M is zero across the
differences: what deviates is forgotten. What a period of half these steps tells of the right ones, by the order of the
method, corrects that. Across the differences of periods in the right steps M is the product of their derivatives
(`ffr_dyn.linear.step_tangents`). What does not settle by itself is found by Newton's method with the monodromy matrix.
(Walker & Ni, SIAM J. Numer. Anal. 49 (2011) 1715-1735; Stetter, Numer. Math. 29 (1978) 425-443.)
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ffr_dyn.kernels.tables import Record
from ffr_dyn.linear.step_tangents import SAMPLES, periods_of_product, product_of_steps
from ffr_dyn.linear.turn_map import CLOSED, OWN_PERIOD, Turns, after, deviation, mapped, monodromy, placed
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError

PERIODS, KEPT = 60, 12  # of the mixing: at most, and how many are mixed
STALLED = 0.7  # of a step over that of KEPT periods before, from where mixing gives way to Newton's method
COARSER, FEWEST = 40, 100  # times the steps of cheap periods, and how many of these a period has at least
AMPLIFIED = 30.0  # of a step over what is open, of cheap maps: beyond it differences are rounding or far from linear
HALVED = 0.5  # what a Newton step leaves open, at most, by a product of steps that is good enough
RETURNING = 1e-3  # singular values of 1 - M: M is known no better
DEAR = 1.0  # periods, that the product of the derivatives of steps may take
# What counts as brought back, by the step to the fixed point: [rad], or relative to the scene; rates times the period.
ROUGH, RETURNS = 1e-6, 1e-10  # of coarse steps, of the right ones
DEFLECTS = 5e-9  # of elastic coordinates, and of their rates, relative to the largest of the body over the period
# Rounding: a step of the first size, or one of the second that is FLAT of the last.
ROUNDED, LITTLE, FLAT = 1e-13, 1e-11, 0.3
REPEATS = 1e-7  # of the second period, as RETURNS: drivers and loads that come back
NEWTONS = 8


@dataclass(frozen=True)
class Returned:
    """A periodic state (x, v) and the record of its period, evenly, from after the beginning to the end; how many periods
    were computed, coarse ones being parts of one; by how much it does not return, relative; whether by Newton's method."""

    x: Array
    v: Array
    record: Record
    periods: float
    error: float
    newton: bool


@dataclass(frozen=True)
class _Known:
    """What is known of a map: points and what they leave open (2 d,), in units of the scale."""

    image_of: Callable[[Array], Array]
    points: list[Array] = field(default_factory=list)
    closings: list[Array] = field(default_factory=list)

    def add(self, s: Array) -> Array:
        """(2 d,) what a point leaves open, which is known from now on."""
        closing = self.image_of(s) - s
        self.points.append(s)
        self.closings.append(closing)
        return closing

    def step(self, closing: Array, M: Array | None = None) -> Array:
        """(2 d,) (1 - M)^-1 closing, with a matrix M across the differences of points or zero."""
        points, closings = (np.array(each[-KEPT:]) for each in (self.points, self.closings))
        along = np.zeros(closing.size)
        if len(points) > 1:
            steps, changes = np.diff(points, axis=0), np.diff(closings, axis=0)
            sizes = np.maximum(np.linalg.norm(changes, axis=1), 1e-300)[:, None]
            steps, changes = steps / sizes, changes / sizes
            shares = np.linalg.lstsq(changes.T, closing, rcond=1e-8)[0]
            along, closing = shares @ steps, closing - shares @ changes
        found: Array = (closing if M is None else _brought_back(M, closing)) - along
        return found


def returned(of: Turns) -> Returned:
    """The periodic state near the chart's. Raises ComputationError where there is none."""
    s, periods = _by_coarse_steps(of)
    try:
        return _searched(of, s, periods)
    except ComputationError:
        if not s.any():
            raise
    return _searched(of, np.zeros(s.size), periods)  # which coarse steps may have led away from


def at_other_steps(of: Turns, found: Returned) -> tuple[Turns, Returned]:
    """The map with half as many steps, or twice where these are few, and what they bring back near to what its own do.
    Raises ComputationError where they bring nothing back."""
    other = _in_steps(of, of.steps // 2 // of.rows * of.rows or 2 * of.steps)
    return other, _searched(other, deviation(of, found.x, found.v) / of.scale, 0.0)


def _searched(of: Turns, s: Array, periods: float) -> Returned:
    """From a state near the one that comes back, which has taken some periods."""
    errors, scale, records, M = list[float](), of.scale, list[Record](), None

    def image(s: Array) -> Array:
        # The first period is the second of the scene, the last the first: both bring the motion back.
        later = 0.0 if records else of.period
        records.append(after(of, *placed(of, s * scale), rows=of.rows, later=later))
        return deviation(of, records[-1].x[-1], records[-1].v[-1]) / scale

    known = _Known(image)
    while True:
        closing = known.add(s)
        if len(known.points) == 1:
            M, cost = _product(of, records[0])
            periods += cost
        step = known.step(closing, M)
        errors.append(max(_largest(step), _largest(closing)))
        if len(errors) > 1 and _is_back(of, step, records[-1], errors):
            break
        if _stalls(errors):
            return _by_newton(of, known, periods + len(errors))
        s = s + step
    x, v = placed(of, s * scale)
    periods, left = periods + len(errors), _largest(closing)
    if errors[1] > REPEATS:
        periods += _check_repeats(of, x, v, s + closing, left)
    return Returned(x, v, records[-1], periods, left, newton=False)


def _product(of: Turns, record: Record) -> tuple[Array | None, float]:
    """The derivative of the map along the motion of a period, from those of few steps, and the periods that it takes; None
    where it costs more than it saves, and as `product_of_steps` does."""
    if of.rows % SAMPLES or periods_of_product(of) > DEAR:
        return None, 0.0
    return product_of_steps(of, record), periods_of_product(of)


def _rounding(of: Turns) -> float:
    """What rounding of places leaves open where there are many of the fastest vibration in a period, whose rates it makes."""
    fastest = max((float(body.model.omega2.max(initial=0.0)) for body in of.system.scene.bodies), default=0.0) ** 0.5
    return max(RETURNS, CLOSED * fastest * of.period)


def _brought_back(M: Array, closing: Array) -> Array:
    """(2 d,) (1 - M)^-1 closing; along what returns by itself, as the phase of a free spin, M counts as zero."""
    left, sizes, right = np.linalg.svd(np.eye(closing.size) - M)
    found: Array = right.T @ ((left.T @ closing) / np.where(sizes > RETURNING, sizes, 1.0))
    return found


def _largest(values: Array) -> float:
    return float(np.abs(values).max(initial=0.0))


def _is_back(of: Turns, step: Array, record: Record, errors: list[float]) -> bool:
    """Whether the fixed point is a step away that does not count, or is rounding; nor may what is left open count."""
    if errors[-1] > RETURNS:
        return False
    near, place, (y, z) = of.near, of.system.layout, (step * of.scale).reshape(2, -1)
    bent = all(
        _largest((near.Z @ part)[place.q_dot(b)]) <= DEFLECTS * _largest(rows[:, at(b)])
        for part, rows, at in ((y, record.x, place.q), (z, record.v, place.q_dot))
        for b in range(len(place.n))
    )
    return bent or errors[-1] <= ROUNDED or (errors[-2] <= LITTLE and errors[-1] > FLAT * errors[-2])


def _stalls(errors: list[float]) -> bool:
    return len(errors) >= PERIODS or (len(errors) > KEPT and errors[-1] > STALLED * errors[-1 - KEPT])


def _by_coarse_steps(of: Turns) -> tuple[Array, float]:
    """A state near the one that comes back, and the periods that it takes; the chart's state where steps are too few or
    coarse ones bring nothing back."""
    coarse, scale, errors = max(FEWEST, of.steps // COARSER), of.scale, list[float]()
    s, part = np.zeros(scale.size), coarse / of.steps
    if 2 * coarse >= of.steps:
        return s, 0.0
    rough = _Known(lambda s: mapped(_in_steps(of, coarse), s * scale) / scale)
    try:
        while not errors or errors[-1] > ROUGH:
            if _stalls(errors):
                return np.zeros(s.size), len(errors) * part
            step = rough.step(rough.add(s))
            errors.append(_largest(step))
            s = s + step
        return _corrected(of, coarse, rough), (len(errors) + 2) * part
    except ComputationError:
        return np.zeros(s.size), len(errors) * part


def _in_steps(of: Turns, steps: int) -> Turns:
    """The map with another number of steps."""
    method: Any = of.method
    return replace(of, steps=steps, method=replace(method, step=of.period / steps))


def _corrected(of: Turns, coarse: int, rough: _Known) -> Array:
    """(2 d,) a state that the right steps bring back, nearly, from what is known of coarse ones: errors go as the step to the
    power of the method's order."""
    power, last, closing = of.method.order, rough.points[-1], rough.closings[-1]
    half = mapped(_in_steps(of, 2 * coarse), last * of.scale) / of.scale - last
    closing = closing + (half - closing) * (1 - (coarse / of.steps) ** power) / (1 - 0.5**power)
    step = rough.step(closing)
    return last + step if _largest(step) <= AMPLIFIED * _largest(closing) else last


def _check_repeats(of: Turns, x: Array, v: Array, image: Array, error: float) -> int:
    """That the second period does with a state what the first does, which maps it to a deviation; periods that it took."""
    again = after(of, x, v, later=of.period)
    apart = _largest(deviation(of, again.x[-1], again.v[-1]) / of.scale - image)
    if apart > max(REPEATS, 1e3 * error):
        raise ComputationError(
            f"what acts on the scene does not repeat itself after {of.period:.6g} s: the period after the first ends "
            f"{apart:.2g} of the scene's size off; give a period in which drivers and loads all come back"
        )
    return 1


def _by_newton(of: Turns, known: _Known, periods: float) -> Returned:
    """From the point that leaves least open."""
    scale, left, quick = of.scale, np.inf, True
    s = known.points[int(np.argmin([_largest(one) for one in known.closings]))]
    for _ in range(NEWTONS):
        x, v = placed(of, s * scale)
        record = after(of, x, v, rows=of.rows)
        image = deviation(of, record.x[-1], record.v[-1]) / scale
        before, left, periods = left, _largest(image - s), periods + 1
        falls = left <= HALVED * before
        if left <= RETURNS or (left <= _rounding(of) and not falls):
            return Returned(x, v, record, periods + _check_repeats(of, x, v, image, left), left, newton=True)
        quick = quick and falls
        M, cost = _product(of, record) if quick else (None, 0.0)
        if M is None:
            M, cost = monodromy(of, s * scale), cost + 4 * s.size
        periods += cost
        s = s + np.linalg.lstsq(np.eye(s.size) - M, image - s, rcond=1e-10)[0]
    raise ComputationError(
        f"no motion of period {of.period:.6g} s was found: after {NEWTONS} of Newton's steps a period still ends {left:.2g} "
        "of the scene's size from where it began; give a period that fits drivers and loads, or begin nearer to the motion; "
        f"{OWN_PERIOD}"
    )
