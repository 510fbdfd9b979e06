"""The state that a period brings back, by few periods of the right steps.

A periodic motion is a fixed point s = P(s) of the map of a period (`ffr_dyn.linear.turn_map`), which leaves open
c(s) = P(s) - s. Anderson's mixing steps from s to s + (1 - M)^-1 c with the derivative M of P along the differences of the
points before. Across them M is that of a cheaper map, which is known from its own search, and at the bottom zero: what
deviates is forgotten. The maps are, from the bottom: the period in steps COARSER times as long; what this and a period of
half these steps tell of the right ones, by the order of the method; and the period in the right steps (defect correction).
For a linear map the mixing is GMRES on c = 0. What does not settle by itself is found by Newton's method with the monodromy
matrix. (Walker & Ni, SIAM J. Numer. Anal. 49 (2011) 1715-1735; Stetter, Numer. Math. 29 (1978) 425-443.)
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ffr_dyn.kernels.tables import Record
from ffr_dyn.linear.turn_map import DIFFERENCE, ROWS, Turns, after, deviation, mapped, monodromy, placed
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError

PERIODS, KEPT = 60, 12  # of the mixing: at most, and how many are mixed
STALLED = 0.7  # of a step over that of KEPT periods before, from where mixing gives way to Newton's method
COARSER, FEWEST = 10, 100  # times the steps of cheap periods, and how many of these a period has at least
AMPLIFIED = 30.0  # of a step over what is open, of cheap maps: beyond it differences are rounding or far from linear
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
    """What is known of a map: points and what they leave open (2 d,), in units of the scale.

    cost : of an image, in periods of the right steps;  below : of a map that is near, if there is one
    """

    image_of: Callable[[Array], Array]
    cost: float
    below: _Known | None = None
    points: list[Array] = field(default_factory=list)
    closings: list[Array] = field(default_factory=list)

    def spent(self) -> float:
        return self.cost * len(self.points) + (self.below.spent() if self.below else 0.0)

    def add(self, s: Array) -> Array:
        """(2 d,) what a point leaves open, which is known from now on."""
        closing = self.image_of(s) - s
        self.points.append(s)
        self.closings.append(closing)
        return closing

    def step(self, closing: Array) -> Array:
        """(2 d,) (1 - M)^-1 closing."""
        points, closings = (np.array(each[-KEPT:]) for each in (self.points, self.closings))
        along = np.zeros(closing.size)
        if len(points) > 1:
            steps, changes = np.diff(points, axis=0), np.diff(closings, axis=0)
            sizes = np.maximum(np.linalg.norm(changes, axis=1), 1e-300)[:, None]
            steps, changes = steps / sizes, changes / sizes
            shares = np.linalg.lstsq(changes.T, closing, rcond=1e-8)[0]
            along, closing = shares @ steps, closing - shares @ changes
        rest = self.below.step(closing) if self.below else closing
        found: Array = rest - along
        return found

    def explore(self, step: Array) -> None:
        """Add a point beside the last, in a direction."""
        if step.any():
            self.add(self.points[-1] + DIFFERENCE / _largest(step) * step)


def returned(of: Turns) -> Returned:
    """The periodic state near the chart's. Raises ComputationError where there is none."""
    s, below = _by_cheap_maps(of)
    try:
        return _searched(of, s, below)
    except ComputationError:
        if not s.any():
            raise
    return _searched(of, np.zeros(s.size), None)  # which coarse steps may have led away from


def _searched(of: Turns, s: Array, below: _Known | None) -> Returned:
    """From a state near the one that comes back, with what is known of a cheaper map."""
    errors, scale, records = list[float](), of.scale, list[Record]()

    def image(s: Array) -> Array:
        # The first period is the second of the scene, the last the first: both bring the motion back.
        later = 0.0 if records else of.period
        records.append(after(of, *placed(of, s * scale), rows=min(ROWS, of.steps), later=later))
        return deviation(of, records[-1].x[-1], records[-1].v[-1]) / scale

    known = _Known(image, 1.0, below)
    while True:
        closing = known.add(s)
        if below and len(known.points) == 1:
            below.explore(known.step(closing))
        step = known.step(closing)
        errors.append(max(_largest(step), _largest(closing)))
        if len(errors) > 1 and _is_back(of, step, records[-1], errors):
            break
        if _stalls(errors):
            return _by_newton(of, known)
        s = s + step
    x, v = placed(of, s * scale)
    periods, left = known.spent(), _largest(closing)
    if errors[1] > REPEATS:
        periods += _check_repeats(of, x, v, s + closing, left)
    return Returned(x, v, records[-1], periods, left, newton=False)


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


def _by_cheap_maps(of: Turns) -> tuple[Array, _Known | None]:
    """A state near the one that comes back, and what is known of the estimated map; the chart's state and nothing where steps
    are too few or coarse ones bring nothing back."""
    coarse, s, scale, errors = max(FEWEST, of.steps // COARSER), np.zeros(of.scale.size), of.scale, list[float]()
    if 2 * coarse >= of.steps:
        return s, None
    part = coarse / of.steps
    rough = _Known(lambda s: mapped(_in_steps(of, coarse), s * scale) / scale, part)
    near = _Known(lambda s: _estimated(of, coarse, s, rough), 2 * part, rough)
    try:
        while not errors or errors[-1] > ROUGH:
            if _stalls(errors):
                return np.zeros(s.size), None
            s = s + rough.step(rough.add(s))
            errors.append(_largest(s - rough.points[-1]))
        s = rough.points[-1]
        closing = near.add(s)
        step = near.step(closing)
        trusted = _largest(step) <= AMPLIFIED * _largest(closing)
        return (s + step, near) if trusted else (s, None)
    except ComputationError:
        return np.zeros(s.size), None


def _in_steps(of: Turns, steps: int) -> Turns:
    """The map with another number of steps."""
    method: Any = of.method
    return replace(of, steps=steps, method=replace(method, step=of.period / steps))


def _estimated(of: Turns, coarse: int, s: Array, rough: _Known) -> Array:
    """(2 d,) the image of a deviation by the right steps, in units of the scale: errors go as the step to the power of the
    method's order. `rough` knows the map with coarse steps, from now on at this point too."""
    power = of.method.order
    image = s + (rough.closings[-1] if s is rough.points[-1] else rough.add(s))
    half = mapped(_in_steps(of, 2 * coarse), s * of.scale) / of.scale
    found: Array = image + (half - image) * (1 - (coarse / of.steps) ** power) / (1 - 0.5**power)
    return found


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


def _by_newton(of: Turns, known: _Known) -> Returned:
    """From the point that leaves least open."""
    scale, periods, left = of.scale, known.spent(), np.inf
    s = known.points[int(np.argmin([_largest(one) for one in known.closings]))]
    for _ in range(NEWTONS):
        x, v = placed(of, s * scale)
        record = after(of, x, v, rows=min(ROWS, of.steps))
        image = deviation(of, record.x[-1], record.v[-1]) / scale
        periods, left = periods + 1, _largest(image - s)
        if left <= RETURNS:
            return Returned(x, v, record, periods + _check_repeats(of, x, v, image, left), left, newton=True)
        M = monodromy(of, s * scale)
        periods += 4 * s.size
        s = s + np.linalg.lstsq(np.eye(s.size) - M, image - s, rcond=1e-10)[0]
    raise ComputationError(
        f"no motion of period {of.period:.6g} s was found: after {NEWTONS} of Newton's steps a period still ends {left:.2g} "
        "of the scene's size from where it began; give a period that fits drivers and loads, or begin nearer to the motion"
    )
