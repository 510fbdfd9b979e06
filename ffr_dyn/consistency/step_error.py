"""The error that the length of the steps makes in every output of a run: compared with runs of other steps, and with a twin.

Two runs that damp a vibration which neither resolves agree on the wrong curve, so that their difference tells nothing. Hence
the twin (`ffr_dyn.integrators.ros2.Twin`), which keeps its amplitude: with R of the run, at steps h and r h, order p,

    s = max |R(h) - R(r h)| / (r^p - 1),    v = 1.5 max |R(h) - T(h)|,    error = max(s, v),

over all rows and components of an output. The factor is for vibration that is resolved in part, where the twin errs, too.
Where a function of time breaks and steps do not end there, since nobody has told it, methods are of first order, and p is 1.
Steps up to twice as long that change an output by more than a tenth of its range, as where they jump over an impact, have no
order yet: p is 1 then.

For ROS3, whose twin is of lower order and has half the step,

    v1 = min(max |R(h) - T(h/2)|, max |R(h) - E|)    too large where vibration is resolved, by its phase;
                                                     E of T(h/2) and T(r h/2) by the order of the twin
    v2 = largest difference of the amplitudes of R(h) and T(h/2)    too small where it is resolved in part
    v = 3 sqrt(v1 v2), but within v1/2.2 and v1

with amplitudes of what rows are off the curve through their neighbours, over windows of 16 rows: vibration that is not
resolved looks like noise there. It tells nothing of what vibration does to slow motion, hence the lower limit. Stiff elastic
forces take ROS3 down to order two, and whether they do is not known of an output. With p = 2.15 the error is about right if
they do; if they do not it is 3.4 times too large at steps four times as long. The factors were measured on the benchmark set
(`python -m benchmarks.accuracy`).

Over many rows the largest difference is an amplitude, whatever the phases. Vibration of a shock at the start that is gone
after a row or two is seen in one phase only, by chance one in which the twin is as small as the run, or an extrapolation that
has no order yet. There the steps to the first row and a little beyond are looked at one by one, beside a twin with half the
step of the other, and what the run is off it is told at least.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any

import numpy as np

from ffr_dyn.compile.scene_tables import System
from ffr_dyn.functions.breaks import hidden_breaks
from ffr_dyn.functions.operations import ACOS, ASIN, POWER, SQRT
from ffr_dyn.functions.time_functions import OPERATION
from ffr_dyn.kernels.functions import ROUNDING as OF_TIME
from ffr_dyn.kernels.functions import evaluate_functions
from ffr_dyn.kernels.tables import SINCE, Functions
from ffr_dyn.results.result import Result
from ffr_prep.body import remembered
from ffr_prep.common.arrays import Array
from ffr_prep.common.units import natural

VIBRATION = 4.5  # v over s beyond which a difference is vibration that the step does not resolve
LITTLE = 1e-3  # of the largest range of its kind: an output that moves by less counts as if it moved by this
ARM = 1e-6  # of the largest range of forces times that of positions, the same for moments. Forces count from LITTLE of
# moments over the size of the scene: no arm is longer, so a force is less only where moments are carried without forces
IN_PART = 1.5  # of what a twin with the same step is off
MIDDLE, FLOOR, WINDOW = 3.0, 2.2, 16  # of amplitudes beside a twin with half the step
TWIN = 2  # order of twins
PLACES = re.compile(r"\.(position|R|p|angle|stroke|orientation)$")
LOADS = re.compile(r"\.(force|moment|torque|tension|effort)$")
OVER_BREAKS = (
    0.5  # of methods of order three where a break lies within steps: their weights, of both signs, err by more
)
PARTLY_STIFF = 2.15  # order of ROS3, of an output of which it is not known whether elastic forces are stiff
FAR, NEXT = 0.1, 2.0  # of the range, by which a step up to so many times as long makes a difference of order one
KEEPS, KINKED = 0.8, 1.5  # of what a difference grows by with the step; an order between those of jumps and of kinks
NOISE = (70 / 36) ** 0.5  # by which rows without relation are farther off the curve than they are large
RATES = {"position": "velocity", "R": "v", "q": "q_dot"}
CONSTANT = 1e-7  # of the size of a kind: a range below it is rounding, as of the rate of an even turn
ROUNDING = 1e-10  # of what a scene's mass, length and speed make of a unit
A_FORMULA = "a formula"
FOUND = 2.0**-17  # of the time between rows, up to where a break that was found may be
SHARP = {SQRT, POWER, ASIN, ACOS}  # operations that are where their operand turns back at the end of its range
AT_ONCE = 2e7  # bytes of numbers that are compared side by side
COARSE = 0.01  # of the range, by which a row may be off the curve through its neighbours
SEED, GROWN = 1e-2, 1e2  # of rounding, from which an output has grown: it begins below the first, and is a motion above
NEVER = (
    1e-25  # of rounding, below which nothing begins of itself: a force that is written begins there, as exp(-1e4 t**2)
)
STILL = 1e-3  # of a seed, below which an output trembles, and does not grow, while nothing moves yet
FIRST_ROWS = 2  # in which what a twin shows may be larger than ever after
BEYOND = 0.25  # of a row, up to where steps are looked at after the first
SLIGHT = 1e-6  # of the size of a scene: points that move by no more are deflected, they do not travel
SEEN = 1e-6  # of the range, below which it is not looked for
ENDED_BY = "ended_by"  # attribute: the event that has ended a run, whose last row is of that moment then
FULL, FEW = 0.3, 2  # of the largest, up to where a growth is even; rows in each third of its decades


@dataclass(frozen=True)
class StepError:
    """Of an output, in its unit and as a part of its range; `vibrates` where most of it is vibration, and `faded` where the
    output is nothing but this error (`ffr_dyn.analyses.trials.faded`)."""

    error: float
    of_range: float
    vibrates: bool
    faded: bool = False


@dataclass(frozen=True)
class Beside:
    """Another run, and its step over that of the run that is looked at."""

    result: Result
    ratio: float


@dataclass(frozen=True)
class _Columns:
    """All components of some outputs side by side: table (T, K), and the first column of each output."""

    names: tuple[str, ...]
    first: Array
    table: Array

    def largest(self, values: Array) -> Array:
        """(O,) the largest of values (K,) of each output."""
        return np.maximum.reduceat(values, self.first)


def on_shared_rows(runs: Sequence[Result]) -> list[Result]:
    """The rows that runs share of which an event may have ended some: the last of each where it has ended all."""
    ended = [ENDED_BY in run.attributes for run in runs]
    if not any(ended):
        return list(runs)
    count = min(run.time.size - last for run, last in zip(runs, ended, strict=True))
    return [_rows(run, [*range(count), *([-1] if all(ended) else [])]) for run in runs]


def _rows(run: Result, rows: Sequence[int]) -> Result:
    chosen = np.array(rows, int)
    quantities = {name: replace(run.quantity(name), values=run[name][chosen]) for name in run.quantities}
    return Result(run.time[chosen], quantities, run.geometry, run.attributes)


def _columns(run: Result, names: Iterable[str]) -> _Columns:
    known = tuple(names)
    parts = [run[name].reshape(run.time.size, -1) for name in known]
    first = np.cumsum([0, *(part.shape[1] for part in parts)])[:-1]
    return _Columns(known, first, filled(np.concatenate([np.zeros((run.time.size, 0)), *parts], axis=1)))


def filled(table: Array) -> Array:
    """(T, ...) what is not known (`ffr_dyn.closing.limits`) as in the row before, or in the first that is."""
    if not np.isnan(table).any():
        return table
    rows, known = np.arange(len(table)).reshape(-1, *np.ones(table.ndim - 1, int)), ~np.isnan(table)
    before = np.maximum.accumulate(np.where(known, rows, -1), axis=0)
    return np.take_along_axis(table, np.where(before < 0, known.argmax(axis=0), before), axis=0)


def untold_breaks(system: System, times: Array, found_before: Sequence[float] = ()) -> dict[str, list[float]]:
    """When [s], between times (T,) of rows, functions of time break of which that is neither told nor was found before: by
    what they are for.

    Steps do not end there. They are Python functions, and formulas that are sharp where a root or an angle ends.
    """
    functions, found = system.model.functions, dict[str, list[float]]()
    values = np.zeros((functions.kind.size, 3))

    def at(t: float) -> Array:
        evaluate_functions(functions, np.zeros(system.user.count), t, values)
        return values

    def formula(t: float, row: int) -> Array:
        return np.array([at(t)[row, 0], 0.0, 0.0])  # derivatives are not numbers where it is sharp

    for callback in system.user.callbacks:
        if not callback.with_state:
            found[callback.what] = hidden_breaks(partial(_three, callback.function), times)
    if sharp := _sharp(functions):
        found[A_FORMULA] = [t for row in sharp for t in hidden_breaks(partial(formula, row=row), times)]
    told = np.concatenate([functions.breaks[:, SINCE], found_before])
    known = {what: [t for t in those if not _ended(functions, told, at, t, times)] for what, those in found.items()}
    return {what: those for what, those in known.items() if those}


def _sharp(functions: Functions) -> list[int]:
    """The rows of formulas that are sharp where their operand turns back: powers but those of natural numbers."""
    operations = [k for k, kind in enumerate(functions.kind.tolist()) if kind == OPERATION]
    codes = {k: functions.data[functions.start[k] : functions.start[k] + 2].tolist() for k in operations}
    smooth = {k for k, (op, exponent) in codes.items() if op == POWER and exponent > 0 and exponent % 1 == 0}
    return [k for k, (op, _) in codes.items() if op in SHARP and k not in smooth]


def _ended(functions: Functions, told: Array, at: Callable[[float], Array], t: float, times: Array) -> bool:
    """Whether a step ends at a break that was found: at one that is told, or where an operation of a formula switches."""
    near = FOUND * np.diff(times).max() + 1e3 * OF_TIME * np.abs(times).max()
    first, second = functions.switches.T
    before, behind = (np.append(at(t + side)[:, 0], 0.0) for side in (-near, near))  # row -1 is none
    switched = (before[first] >= before[second]) != (behind[first] >= behind[second])
    return bool((np.abs(told - t) <= near).any() or switched.any())


def _three(function: Callable[[float], Any], t: float) -> Array:
    """Value, rate and second derivative of a Python function, zero for those that it does not return."""
    found: Array = np.concatenate([np.atleast_1d(np.asarray(function(t), float)), np.zeros(3)])[:3]
    return found


def step_errors(run: Result, other: Beside | None, order: float, twins: Sequence[Beside] = ()) -> dict[str, StepError]:
    """The error of every output of a run.

    other : the same with another step, None where the twins have told enough;  order : that is sure of the method
    twins : the finest first, which has the step of the run, or half of it for a method of higher order, and one with a longer
            step then, if there is one; () where vibration is not damped
    """
    scales, found = ranges(run), dict[str, StepError]()
    for names in _batches(run, scales):
        y, size = _columns(run, names), np.array([scales[name] for name in names])
        between = np.zeros(len(names)) if other is None else _apart(y, y.table, _columns(other.result, names).table)
        smooth, steps = (between, between) if other is None else _by_order(between, other.ratio, order, FAR * size)
        off, vibrations = _beside_twins(y, [(_columns(twin.result, names).table, twin.ratio) for twin in twins])
        errors = np.maximum(steps, vibrations)
        shares = np.divide(errors, size, out=np.zeros(len(names)), where=size > 0)
        numbers = (column.tolist() for column in (errors, shares, off > VIBRATION * smooth))
        found |= {name: StepError(*of) for name, *of in zip(names, *numbers, strict=True)}
    return found


def order_shown(run: Result, other: Beside, farther: Beside | None, order: float) -> float:
    """The order by which the differences from two other steps grow in all outputs, at most that of the method. It is lost
    where forces jump or have kinks within steps: one then, or between; one as well where there is no second."""
    if farther is None:
        return 1.0
    scales, found = ranges(run), np.inf
    for names in _batches(run, scales):
        y, size = _columns(run, names), np.array([scales[name] for name in names])
        near, far = (_apart(y, y.table, _columns(one.result, names).table) for one in (other, farther))
        seen = near > SEEN * size
        found = min(found, (far[seen] / near[seen]).min(initial=np.inf))
    for shown in (order, KINKED):
        if found >= KEEPS * abs((farther.ratio**shown - 1.0) / (other.ratio**shown - 1.0)):
            return shown
    return 1.0


def larger(one: Mapping[str, StepError], other: Mapping[str, StepError]) -> dict[str, StepError]:
    """Of every output the larger one of two errors."""
    return {name: max(one[name], other[name], key=lambda each: each.error) for name in one}


def begins_alone(run: Result, twin: Result) -> bool:
    """Whether what a twin shows of an output is largest in the first rows, too few to tell its amplitude."""
    scales = ranges(run)
    for names in _batches(run, scales):
        y, size = _columns(run, names), np.array([scales[name] for name in names])
        early, late = y.table[: 1 + FIRST_ROWS], y.table[1 + FIRST_ROWS :]
        other = _columns(twin, names).table
        first = _apart(y, early, other)
        if (first > np.maximum(_apart(y, late, other[1 + FIRST_ROWS :]), SEEN * size)).any():
            return True
    return False


def with_start(errors: Mapping[str, StepError], run: Result, steps: Result, twin: Result) -> dict[str, StepError]:
    """The errors of a run, no less than what it is off a finer twin in the steps from its first row on.

    steps, twin : from the same start, with all steps of the run as rows
    """
    scales, found = ranges(run), dict(errors)
    step = steps.time[1] - steps.time[0]
    from_first = steps.time > run.time[1] - 0.5 * step
    for names in _batches(run, errors):
        y, other = _columns(steps, names), _columns(twin, names)
        off = _apart(y, y.table[from_first], other.table[from_first])
        for name, far in zip(names, off.tolist(), strict=True):
            if far > errors[name].error:
                found[name] = StepError(far, far / scales[name], vibrates=True)
    return found


def _by_order(between: Array, ratio: float, order: float, far: Array) -> tuple[Array, Array]:
    """(O,) what runs differ by whose steps have this ratio, as an error of the order, and s."""
    smooth: Array = between * abs(1.0 / (ratio**order - 1.0))
    return smooth, np.where(between > far, between * abs(1.0 / (ratio - 1.0)), smooth) if ratio <= NEXT else smooth


def _batches(run: Result, names: Iterable[str]) -> Iterator[list[str]]:
    """The outputs, so many at a time that their numbers take no more than AT_ONCE bytes."""
    batch, size = list[str](), 0
    for name in names:
        more = run[name].nbytes
        if batch and size + more > AT_ONCE:
            yield batch
            batch, size = [], 0
        batch.append(name)
        size += more
    if batch:
        yield batch


def _beside_twins(y: _Columns, twins: Sequence[tuple[Array, float]]) -> tuple[Array, Array]:
    """(O,) the vibration that is seen beside the twin, and v, of each output."""
    if not twins:
        return np.zeros(len(y.names)), np.zeros(len(y.names))
    (fine, ratio), *longer = twins
    near = _apart(y, y.table, fine)
    if ratio == 1.0:
        return near, IN_PART * near
    for coarse, other in longer:
        near = np.minimum(near, _apart(y, y.table, _extrapolated(coarse, fine, other / ratio)))
    rows = min(len(y.table), len(fine))
    if rows <= 4:
        return near, near
    amplitude = _apart(y, _amplitudes(y.table[:rows]), _amplitudes(fine[:rows]))
    seen = np.minimum(near, MIDDLE * np.sqrt(near * amplitude))
    return seen, np.maximum(seen, near / FLOOR)


def _extrapolated(coarse: Array, fine: Array, ratio: float) -> Array:
    """Twins of two steps, without the error of their order."""
    rows, weight = min(len(coarse), len(fine)), 1.0 / (ratio**TWIN - 1.0)
    found: Array = fine[:rows] + weight * (fine[:rows] - coarse[:rows])
    return found


def _apart(of: _Columns, one: Array, other: Array) -> Array:
    """(O,) `largest_difference` of each output."""
    rows = min(len(one), len(other))
    with np.errstate(all="ignore"):
        found = of.largest(np.abs(one[:rows] - other[:rows]).max(axis=0, initial=0.0))
    return np.where(np.isfinite(found), found, np.inf)


def nearest(y: Array, coarse: Array, fine: Array) -> float:
    """v1 of a history, beside twins of h and of h/2: no smaller than the true error, too large by the phase of the twins."""
    return min(largest_difference(y, fine), largest_difference(y, _extrapolated(coarse, fine, 2.0)))


def _amplitudes(y: Array) -> Array:
    """(T - 4 or fewer, ...) of what rows are off the curve through their neighbours, over WINDOW rows."""
    squares = _off_curve(y) ** 2
    count = min(WINDOW, len(squares))
    sums = np.cumsum(np.concatenate([np.zeros((1, *squares.shape[1:])), squares]), axis=0)
    found: Array = np.sqrt(2.0 * (sums[count:] - sums[:-count]) / count) / NOISE
    return found


def _off_curve(y: Array) -> Array:
    """(T - 4, ...) rows less the curve through the two before and the two after them."""
    off: Array = y[2:-2] - (-y[:-4] + 4.0 * y[1:-3] + 4.0 * y[3:-1] - y[4:]) / 6.0
    return off


def largest_difference(one: Array, other: Array) -> float:
    """Over the rows that both have; infinite where one is not finite."""
    rows = min(len(one), len(other))
    with np.errstate(all="ignore"):
        found = float(np.abs(one[:rows] - other[:rows]).max(initial=0.0))
    return found if np.isfinite(found) else np.inf


def ranges(run: Result) -> dict[str, float]:
    """Of every output but the violations of constraints: the largest range of a component, no less than `least_ranges`."""
    least = least_ranges(run)
    return {name: max(span, least[name]) for name, span in _spans_and_sizes(run)[0].items()}


def least_ranges(run: Result) -> dict[str, float]:
    """What counts as the range of an output where next to nothing moves: a share of the largest of its kind (the last part of
    its name), and rounding."""
    spans, sizes = _spans_and_sizes(run)
    largest: dict[str, float] = {}
    for name, span in spans.items():
        largest[_kind(name)] = max(span, largest.get(_kind(name), 0.0))
    turning = max(largest.get("moment", 0.0), largest.get("torque", 0.0))
    beside = {
        "moment": ARM * largest.get("force", 0.0) * largest.get("position", 0.0),
        "force": LITTLE * turning / (sizes["position"] or np.inf),
    }
    floors = {kind: max(LITTLE * most, CONSTANT * sizes[kind], beside.get(kind, 0.0)) for kind, most in largest.items()}
    for kind, floor in (*_floors_at_rest(run, sizes).items(), *_floors_of_turning(run).items()):
        floors[kind] = max(floors.get(kind, 0.0), floor)
    rounding = _rounding(run, sizes)
    return {name: max(floors[_kind(name)], rounding(run.quantities[name].unit)) for name in spans}


def roundings(run: Result) -> dict[str, float]:
    """Of every output but the violations of constraints, what is rounding in its unit."""
    spans, sizes = _spans_and_sizes(run)
    of_unit = _rounding(run, sizes)
    return {name: of_unit(run.quantities[name].unit) for name in spans}


def _spans_and_sizes(run: Result) -> tuple[dict[str, float], dict[str, float]]:
    """The largest range of a component of every output, and the largest number of every kind; found once."""
    return remembered(run, "spans and sizes", lambda: _found_spans_and_sizes(run))


def _found_spans_and_sizes(run: Result) -> tuple[dict[str, float], dict[str, float]]:
    spans: dict[str, float] = {}
    sizes: dict[str, float] = {}
    for names in _batches(run, (name for name in run.quantities if not name.startswith("constraint."))):
        of = _columns(run, names)
        moved = np.ptp(of.table, axis=0) if len(of.table) else np.zeros(of.table.shape[1])
        spans |= zip(names, of.largest(moved).tolist(), strict=True)
        for name, size in zip(names, of.largest(np.abs(of.table).max(axis=0, initial=0.0)).tolist(), strict=True):
            sizes[_kind(name)] = max(size, sizes.get(_kind(name), 0.0))
    length = run.attributes.get("length", 0.0)  # as a pivot at the origin is at zero
    return spans, sizes | {"position": max(sizes.get("position", 0.0), length)}


def _rounding(run: Result, sizes: dict[str, float]) -> Callable[[str], float]:
    """Of a unit, what is rounding in a scene of this mass, length and speed, such as the acceleration of a pivot at rest."""
    natural_of = _natural(run, sizes, sizes.get("force", 0.0))
    return lambda unit: ROUNDING * natural_of(unit)


def natural_units(run: Result) -> Callable[[str], float]:
    """Of a unit, what the mass, length and speed of a scene make of it; zero where nothing moves. Its forces do not count."""
    return _natural(run, _spans_and_sizes(run)[1], 0.0)


def range_of(values: Array) -> float:
    """Of a history (T, ...) the largest range of a component."""
    known = filled(values.reshape(len(values), -1))
    return float(np.ptp(known, axis=0).max(initial=0.0)) if len(known) else 0.0


def _natural(run: Result, sizes: dict[str, float], force: float) -> Callable[[str], float]:
    lasts, length = float(np.ptp(run.time)), sizes["position"]
    speed = max(sizes.get("velocity", 0.0), sizes.get("omega_bar", 0.0) * length, length / lasts if lasts > 0 else 0.0)
    if not speed > 0:
        return lambda unit: 0.0
    time = length / speed
    mass = max(run.attributes.get("mass", 0.0), force * time**2 / length)
    return cache(lambda unit: natural(unit, mass, length, time))


def _floors_at_rest(run: Result, sizes: dict[str, float]) -> dict[str, float]:
    """Of rates and energies of what does not move at all, where positions and forces have a size."""
    lasts = float(np.ptp(run.time)) if run.time.size else 0.0
    far, rate = sizes.get("position", 0.0), CONSTANT / lasts if lasts > 0 else 0.0
    return {"velocity": far * rate, "omega_bar": rate, "energy": CONSTANT * far * sizes.get("force", 0.0)}


def _floors_of_turning(run: Result) -> dict[str, float]:
    """Of rates of elastic coordinates, a share of what they are in axes that do not turn, where a deformation that keeps its
    shape on a turning body, as of a blade by its centrifugal force, has its size times the angular velocity for a rate."""
    lasts, largest = float(np.ptp(run.time)) if run.time.size else 0.0, 0.0
    for name in run.quantities:
        body, _, last = name.rpartition(".")
        if last == "q_dot" and {f"{body}.q", f"{body}.omega_bar"} <= run.quantities.keys():
            size, speed = (np.abs(filled(run[f"{body}.{of}"])).max(initial=0.0) for of in ("q", "omega_bar"))
            largest = max(largest, float(size * speed * min(1.0, speed * lasts)))  # only as far as it has turned
    return {"q_dot": LITTLE * largest}


def _kind(name: str) -> str:
    first, _, last = name.rpartition(".")
    if first == "energy":
        return first
    return {"R": "position", "v": "velocity", "p": "orientation"}.get(last, last)


def too_coarse(run: Result) -> dict[str, float]:
    """Outputs whose rows are too far apart to show what they do, and by how much of their range.

    Where a result has the rate of an output, too, what it changes by from row to row is held against the mean of the rates
    (half of what they differ by counts), which finds even a vibration that rows catch in the same phase again and again;
    every row of other outputs against the curve through the two before and the two after.
    """
    scales, rows = {name: scale for name, scale in ranges(run).items() if scale > 0}, _evenly_spaced(run.time)
    if rows <= 4:
        return {}
    rates = {name: rate for name in scales if (rate := _rate_of(name)) in run.quantities}
    off: dict[str, float] = {}
    for names in _batches(run, (name for name in scales if name not in rates)):
        y = _columns(run, names)
        off |= zip(names, y.largest(np.abs(_off_curve(y.table[:rows])).max(axis=0)).tolist(), strict=True)
    for names in _batches(run, rates):
        y, w = _columns(run, names), _columns(run, (rates[name] for name in names)).table
        beside = 0.5 * (np.diff(y.table, axis=0) - 0.5 * np.diff(run.time)[:, None] * (w[:-1] + w[1:]))
        off |= zip(names, y.largest(np.abs(beside).max(axis=0)).tolist(), strict=True)
    return {name: share for name, scale in scales.items() if (share := off[name] / scale) > COARSE}


def _evenly_spaced(times: Array) -> int:
    """How many rows there are before that of an event between two of them, which ends a run."""
    steps = np.diff(times)
    return times.size - int(steps.size > 1 and steps[-1] < (1 - 1e-6) * steps[0])


def from_rounding(run: Result) -> dict[str, float]:
    """Outputs that have grown from rounding, as those of an unstable motion do that begins in balance, and how far they have
    moved; energies, of which little things have less than rounding, are left out.

    Their growth is exponential: as many rows in the middle third of its decades as in the last. A motion that sets in goes
    with a power of time and has far fewer there.
    """
    rounding, found = roundings(run), dict[str, float]()
    for names in _batches(
        run, (name for name in rounding if rounding[name] > 0 and run.quantities[name].unit not in ("J", "W"))
    ):
        of = _columns(run, names)
        for k, name in enumerate(names):
            last = of.first[k + 1] if k + 1 < len(names) else of.table.shape[1]
            moved = of.table[:, of.first[k] : last] - of.table[:1, of.first[k] : last]
            grown = np.abs(moved).max(axis=1, initial=0.0)
            if _grows_evenly(np.maximum.accumulate(grown), SEED * rounding[name], GROWN * rounding[name]):
                found[name] = float(grown.max())
    moves = [any(map(PLACES.search, names)) for names in (found, run.quantities)]  # forces alone set in, as of a stop
    return {} if moves == [False, True] else found


def _grows_evenly(size: Array, seed: float, motion: float) -> bool:
    """Whether a size (T,) that never falls grows from below a seed to above a motion, exponentially."""
    nonzero = size[size > 0]
    if nonzero.size == 0 or not NEVER * seed <= nonzero[0] <= seed or nonzero[-1] < motion:
        return False
    log = np.log(np.maximum(nonzero, STILL * seed))  # the quotient of two of them may be too large for a number
    decades = (log - log[0]) / (np.log(FULL) + log[-1] - log[0])
    middle, last = (np.count_nonzero((decades > third) & (decades <= third + 1 / 3)) for third in (1 / 3, 2 / 3))
    return bool(min(middle, last) >= FEW and last <= FEW * (middle + 1))


def _rate_of(name: str) -> str:
    of, _, last = name.rpartition(".")
    return f"{of}.{RATES.get(last, '')}"


def worst(errors: Mapping[str, StepError]) -> str:
    """Of all outputs, of positions and angles, of forces and moments."""
    name = max(errors, key=lambda one: errors[one].of_range)
    said = [f"step: within {of_the_range(errors[name].of_range)} of {name}"]
    for words, kind in (("positions and angles", PLACES), ("forces and moments", LOADS)):
        of_kind = [error.of_range for one, error in errors.items() if kind.search(one)]
        if of_kind and not kind.search(name):
            said.append(f"{words} within {percent(max(of_kind))}")
    return "; ".join(said)


def of_the_range(share: float) -> str:
    return f"{percent(share)} of the range" if share < 1 else f"{float(f'{share:.2g}'):g} times the range"


def percent(share: float) -> str:
    return f"{float(f'{100 * share:.2g}'):g} %"
