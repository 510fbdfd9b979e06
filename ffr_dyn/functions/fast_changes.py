"""Where functions of time change faster than steps look at them, so that steps are divided there.

A run looks at a function at the ends of its steps and at little between. What is shorter, such as a force of a formula that
knocks for a millisecond, it does not see, and no run with other steps would tell. So functions are looked at beforehand.
Between two times one is taken for the cubic through its values and rates there; where it is off that, the time between is
divided, and so on. What may hide is looked for by what a function is made of:

* what an operation is applied to turns back there, as ((t - a) / w)^2 in exp(-((t - a) / w)^2): that time is looked at;
* the angle of a sine, or of a harmonic, goes on by a radian: the time between is divided, whatever is seen;
* a table has a row there: that time is looked at.

Where a function jumps or has a kink (`ffr_dyn.functions.breaks`) it is looked at from one side; there steps end anyway.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ffr_dyn.functions.operations import ADD, COS, DIVIDE, MAX, MIN, MULTIPLY, SIN, SUBTRACT
from ffr_dyn.functions.time_functions import HARMONIC, OPERATION, PIECEWISE, POLYNOMIAL
from ffr_prep.common.arrays import Array

Sample = Callable[[Array], Array]  # times (T,) -> (T, F, 3) value, rate and second derivative of all functions

UNSEEN = 1e-3  # of a function's range, by which it may be off the cubic
RATE = 0.3  # times as much as its value is off is its rate, by the length of the time between
SECOND = 0.05  # of the range of a second derivative, by which it may be off the line through it at both times
ANGLE = 1.0  # [rad]
SMOOTH = 3  # power of t up to which a polynomial is its own cubic
CONSTANT = 1e-9  # of the largest value: a range that is rounding
SHORTEST, ROUNDING = 1e-12, 1.5e-14  # of a step, of a time: what is as short is a jump
TURNS, HALVINGS = 6, 60  # of Newton's method to where an operand turns back; to where an operation switches
MOST = 1_000_000  # times between that are looked into
LINEAR = (ADD, SUBTRACT, MULTIPLY, MIN, MAX)  # operations that make nothing sharp of an operand that turns back


@dataclass(frozen=True)
class Made:
    """What F functions of time are made of.

    roots : (F,) that nothing else is made of;  driving : (F,) roots whose second derivative counts, too
    turning : rows that operations other than linear ones are applied to;  angles : rows that are angles of a sine
    speed : of the fastest harmonic [rad/s];  rows : (K,) times of rows of tables;  switches : as of `breaks.switches`
    """

    roots: Array
    driving: Array
    turning: Array
    angles: Array
    speed: float
    rows: Array
    switches: Array


def made_of(kind: Array, start: Array, data: Array, driving: Array, switches: Array) -> Made:
    """Of functions in the tables of the kernels (`ffr_dyn.kernels.tables.Functions`); driving : rows that drive something."""
    numbers = start[:-1][kind == OPERATION, None] + [0, 2, 3]
    op, first, second = data[numbers].astype(int).reshape(-1, 3).T
    number, of_tables = np.arange(kind.size), start[:-1][kind == PIECEWISE].tolist()
    roots = ~np.isin(number, [first, second])
    rows = [data[k + 2 : k + 3 + int(data[k])] for k in of_tables]
    waves = start[:-1][kind == HARMONIC]
    return Made(
        roots,
        roots & np.isin(number, driving),
        np.unique(np.where(op == DIVIDE, second, first)[~np.isin(op, LINEAR)]),
        np.unique(first[np.isin(op, (SIN, COS))]),
        float(np.abs(data[waves + 2] * (data[waves + 1] != 0)).max(initial=0.0)),
        np.unique(np.concatenate([np.zeros(0), *rows])),
        switches,
    )


def slow(of: Made, kind: Array, start: Array, step: float) -> bool:
    """Whether no step is too long, as may be said without a look: there are harmonics, tables and polynomials alone."""
    simple = all(
        k in (HARMONIC, PIECEWISE) or (k == POLYNOMIAL and n <= SMOOTH + 1)
        for k, n in zip(kind, np.diff(start), strict=True)
    )
    return simple and of.speed * step <= ANGLE and not (np.diff(of.rows) < step).any()


@dataclass(frozen=True)
class _Spans:
    """N spans of time, each with what is seen at its ends (N, F, 3)."""

    early: Array
    late: Array
    first: Array
    last: Array

    def __getitem__(self, chosen: Array) -> _Spans:
        return _Spans(self.early[chosen], self.late[chosen], self.first[chosen], self.last[chosen])


@dataclass(frozen=True)
class _Looked:
    """What has come of looking into N spans.

    off : (N, F) roots that are off the cubic;  jumps : (N,) too short to be divided;  switches : (S,) times within
    divided : (M,) numbers of spans whose parts are the next 2 M spans, all earlier ones first
    """

    spans: _Spans
    off: Array
    jumps: Array
    switches: Array
    divided: Array


@dataclass(frozen=True)
class Changes:
    """What F functions of time do within steps.

    spans : (L, 2) in order and shorter than a step, where functions are off the cubic over longer ones
    which : (F,) of them these are;  jumps : (J, 2) the last time before something jumps, and the first behind it
    switches : (S,) when operations switch
    """

    spans: Array
    which: Array
    jumps: Array
    switches: Array


def fast_changes(
    of: Made, sample: Sample, times: Array, breaks: Array, step: float, most: int = MOST
) -> Changes | None:
    """What functions do within steps [s]; None where there is more of it than can be looked into.

    times : (T,) in order, from which the search begins;  breaks : as of `breaks.declared_breaks`
    most  : spans of time that are looked into
    """
    spans, levels = _between(sample, times, breaks), list[_Looked]()
    known = _extremes(np.concatenate([spans.first, spans.last]))
    least = SHORTEST * step + ROUNDING * float(np.abs(times).max())
    while spans.early.size and most >= spans.early.size:
        most -= spans.early.size
        found = _candidates(of, sample, spans)
        known = _wider(known, _extremes(found.seen))
        with np.errstate(all="ignore"):  # rates of a root are infinite where it ends: nothing is told there
            off = _off(of, spans[found.at], found, known)
        level, spans = _divided(of, sample, spans, (found, off), least)
        levels.append(level)
    return None if spans.early.size else _changes(of, levels, step)


def _between(sample: Sample, times: Array, breaks: Array) -> _Spans:
    """The spans between times and breaks, which are seen from within."""
    inside = breaks[(breaks[:, 0] > times[0]) & (breaks[:, 1] < times[-1])]
    gap = np.abs(times[1:-1, None] - inside[None, :, 1]).min(axis=1, initial=np.inf)
    apart = times[1:-1][gap > 1e-9 * np.diff(times).min()]
    early = np.sort(np.concatenate([times[:1], apart, inside[:, 1]]))
    late = np.sort(np.concatenate([apart, inside[:, 0], times[-1:]]))
    return _Spans(early, late, sample(early), sample(late))


Extremes = tuple[Array, Array]  # (F, 3) the least and the largest numbers that have been seen


def _extremes(seen: Array) -> Extremes:
    return np.where(np.isfinite(seen), seen, np.inf).min(axis=0), np.where(np.isfinite(seen), seen, -np.inf).max(axis=0)


def _wider(one: Extremes, other: Extremes) -> Extremes:
    return np.minimum(one[0], other[0]), np.maximum(one[1], other[1])


@dataclass(frozen=True)
class _Candidates:
    """Times at which spans are looked into: (K,) numbers of the spans, (K,) times, (K, F, 3) what is seen."""

    at: Array
    time: Array
    seen: Array


def _candidates(of: Made, sample: Sample, spans: _Spans) -> _Candidates:
    """The middle of every span, rows of tables, and where what an operation is applied to turns back."""
    n = spans.early.size
    at, time = [np.arange(n)], [0.5 * (spans.early + spans.late)]
    row = np.searchsorted(spans.early, of.rows, side="right") - 1
    within = (row >= 0) & (of.rows < spans.late[row])
    for numbers, times in ((row[within], of.rows[within]), _turns(of, sample, spans)):
        at.append(numbers)
        time.append(times)
    where, when = np.concatenate(at), np.concatenate(time)
    return _Candidates(where, when, sample(when))


def _turns(of: Made, sample: Sample, spans: _Spans) -> tuple[Array, Array]:
    """Where what an operation is applied to turns back: numbers of the spans, times."""
    a, b = spans.first[:, of.turning, 1], spans.last[:, of.turning, 1]
    at, which = np.nonzero(np.sign(a) * np.sign(b) < 0)
    if not at.size:
        return at, np.zeros(0)
    rate, other, row = a[at, which], b[at, which], of.turning[which]
    early, late = spans.early[at], spans.late[at]
    time = early + (late - early) * rate / (rate - other)
    for _ in range(TURNS):
        seen = sample(time)[np.arange(at.size), row]
        with np.errstate(all="ignore"):  # without a second derivative there is nothing better
            better = time - seen[:, 1] / seen[:, 2]
        time = np.where((better > early) & (better < late), better, time)
    return at, time


def _off(of: Made, spans: _Spans, within: _Candidates, known: Extremes) -> Array:
    """(K, F) how far functions are off the cubics of K spans at times within, over what they may be off."""
    time, seen = within.time, within.seen
    size = np.maximum(known[1] - known[0], CONSTANT * np.maximum(np.abs(known[0]), np.abs(known[1])))
    size = np.where(np.isfinite(size) & (size > 0), size, np.inf)
    width = (spans.late - spans.early)[:, None]
    width = np.where(width > 0, width, 1.0)  # of a span between a switch and a time at which it switches
    s = (time - spans.early)[:, None] / width
    (y0, d0, c0), (y1, d1, c1) = (np.moveaxis(ends, 2, 0) for ends in (spans.first, spans.last))
    value = y0 + s * s * (3 - 2 * s) * (y1 - y0) + width * s * (1 - s) * ((1 - s) * d0 - s * d1)
    rate = 6 * s * (1 - s) * (y1 - y0) / width + (1 - s) * (1 - 3 * s) * d0 + s * (3 * s - 2) * d1
    value_off = np.maximum(np.abs(seen[..., 0] - value), RATE * width * np.abs(seen[..., 1] - rate)) / (
        UNSEEN * size[:, 0]
    )
    second_off = np.abs(seen[..., 2] - (1 - s) * c0 - s * c1) / (SECOND * size[:, 2])
    return np.nan_to_num(np.maximum(value_off, np.where(of.driving, second_off, 0.0)), nan=0.0, posinf=0.0)


def _divided(
    of: Made, sample: Sample, spans: _Spans, looked: tuple[_Candidates, Array], least: float
) -> tuple[_Looked, _Spans]:
    """What has come of looking into spans, and the parts of those that are divided."""
    found, distance = looked
    n, width = spans.early.size, spans.late - spans.early
    worst = np.zeros((n, distance.shape[1]))
    np.maximum.at(worst, found.at, distance)
    order = np.lexsort((-distance.max(axis=1, initial=0.0), found.at))
    best = order[np.searchsorted(found.at[order], np.arange(n))]  # candidate of each span
    switches = np.asarray(_switched(of, spans.first, spans.last).any(axis=1))
    wanted = (worst > 1.0).any(axis=1) | _turned(of, spans, width) | switches
    divided = np.flatnonzero(wanted & (width > least))
    at, switching = best[divided], switches[divided]
    parts, switched = _halves(of, sample, spans[divided], (found.time[at], found.seen[at], switching))
    off = (worst > 1.0) & of.roots & ~switches[:, None]
    return _Looked(spans, off, (worst > 1.0).any(axis=1) & (width <= least), switched, divided), parts


def _halves(of: Made, sample: Sample, spans: _Spans, best: tuple[Array, Array, Array]) -> tuple[_Spans, Array]:
    """The parts of spans, all earlier ones first, and when something switches that divides them; best : the times at which
    they are divided elsewhere, what is seen then, and whether something switches."""
    time, seen, switching = best
    end, begin, last, first = time.copy(), time.copy(), seen.copy(), seen.copy()
    if switching.any():
        end[switching], begin[switching] = _beside_switch(of, sample, spans[switching])
        last[switching], first[switching] = sample(end[switching]), sample(begin[switching])
    both = (spans.early, begin), (end, spans.late), (spans.first, first), (last, spans.last)
    return _Spans(*(np.concatenate(each) for each in both)), begin[switching]


def _turned(of: Made, spans: _Spans, width: Array) -> Array:
    """(N,) whether an angle goes on by more than what is to be looked into."""
    angles = np.abs(spans.last[:, of.angles, 0] - spans.first[:, of.angles, 0]).max(axis=1, initial=0.0)
    return (angles > ANGLE) | (of.speed * width > ANGLE)


def _switched(of: Made, first: Array, last: Array) -> Array:
    """(N, J) whether operations switch between what is seen (N, F, 3) first and last."""
    changed: Array = _states(of, first) != _states(of, last)
    return changed


def _states(of: Made, seen: Array) -> Array:
    """(N, J) on which side operations are."""
    a, b = of.switches[:, 0], of.switches[:, 1]
    found: Array = seen[:, a, 0] >= np.where(b >= 0, seen[:, b, 0], 0.0)
    return found


def _beside_switch(of: Made, sample: Sample, spans: _Spans) -> tuple[Array, Array]:
    """The last time before and the first after the first of the operations, by number, that switches in a span."""
    rows, before = np.arange(spans.early.size), _states(of, spans.first)
    number = _switched(of, spans.first, spans.last).argmax(axis=1)
    early, late = spans.early.copy(), spans.late.copy()
    for _ in range(HALVINGS):
        middle = 0.5 * (early + late)
        still = _states(of, sample(middle))[rows, number] == before[rows, number]
        early, late = np.where(still, middle, early), np.where(still, late, middle)
    return early, late


def _changes(of: Made, levels: list[_Looked], step: float) -> Changes:
    """The shortest spans over which functions are no longer off, as far as these are shorter than a step."""
    found, which, needed = list[Array](), np.zeros(of.roots.size, dtype=bool), _needed(levels)
    wanted = np.zeros(levels[0].jumps.size, dtype=bool)
    for level, need in zip(levels, needed, strict=True):
        width = level.spans.late - level.spans.early
        found.append(_ends(level.spans[wanted & ~need & (width < step)]))
        which |= level.off[need & (0.5 * width < step)].any(axis=0)
        wanted = np.tile(need[level.divided], 2)
    jumps = [_ends(level.spans[level.jumps]) for level in levels]
    switches = [level.switches for level in levels]
    spans, jumping, switching = (np.unique(np.concatenate(every), axis=0) for every in (found, jumps, switches))
    return Changes(spans, which, jumping, switching)


def _ends(spans: _Spans) -> Array:
    return np.column_stack([spans.early, spans.late])


def _needed(levels: list[_Looked]) -> list[Array]:
    """Of every level (N,) the spans whose parts are needed. Where a function jumps it is off however short a span is: this is
    not what spans around a jump are needed for."""
    needed, below = list[Array](), np.zeros((2, 0), dtype=bool)
    for level in reversed(levels):
        need, jump = np.zeros(level.jumps.size, dtype=bool), level.jumps.copy()
        inner = np.asarray(below.reshape(2, 2, -1).any(axis=1))
        need[level.divided] = inner[0]
        jump[level.divided] |= inner[1]
        need |= level.off.any(axis=1) & ~jump
        needed.append(need)
        below = np.array([need, jump])
    return needed[::-1]


def divisions(spans: Array, parts: int) -> Array:
    """(P,) times, in order, that divide each of the spans (L, 2) into so many parts; its ends are among them."""
    shares = np.linspace(0.0, 1.0, parts + 1)
    return np.unique(spans[:, :1] + (spans[:, 1:] - spans[:, :1]) * shares)
