"""Events of a forward run: moments at which a quantity passes a value.

Every step of the integrator is looked at (ten states from row to row where it chooses its steps), and every part of steps
that functions of time divide, as pulses do. Where the quantity has passed the value within one, the step is done again,
from the same state and shorter, until its end is the event: a root of one unknown, the length of the step, which Brent's
method (1973) finds to the rounding of the time. Where it came so near that it may have passed the value and come back, the
step is done again until the quantity is farthest, and where it is beyond the value there, both moments are found. ROS2 does
it again where a method goes on from what it remembers, or iterates on positions, which is lost in rounding in so short a
step. So an event is as accurate as the method, and lies on the constraints as it does.

How accurate that is, the same events of runs with other steps tell, as they tell the error of every output. Where a quantity
vibrates at a frequency that steps do not resolve, it is its amplitude over the rate at which the quantity passes the value:
a single moment catches vibration in some phase.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, replace
from difflib import get_close_matches
from numbers import Real
from typing import Any, Literal

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from ffr_dyn.analyses.checkpoint import Checkpoint
from ffr_dyn.compile.engine import Engine, fill_rows, new_engine, record_row
from ffr_dyn.compile.scene_tables import System
from ffr_dyn.compile.workspace import new_record
from ffr_dyn.consistency.assemble import Assembled
from ffr_dyn.consistency.evaluation import joined
from ffr_dyn.consistency.failure import Settings, failure
from ffr_dyn.consistency.step_error import Beside, StepError, step_errors
from ffr_dyn.equations.state_view import StateView
from ffr_dyn.integrators import ROS2, Integrator
from ffr_dyn.kernels.tables import OK, Record
from ffr_dyn.results.power import Worked
from ffr_dyn.results.quantities import Entry, Memory, catalogue
from ffr_dyn.results.recorded_motion import View
from ffr_dyn.results.result import Quantity, Result
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError

WIDTH = 4 * np.finfo(float).eps  # of a step, and relative: what brentq can reach
NARROW = 1e-4  # of a step, to which the moment is found at which a quantity is farthest
REACH = 2.0  # of the last step: how near to a value a quantity that may pass it and come back has come
TAIL_ROWS = 2  # that are kept of those that were looked at, for what the next ones tell of the last step
AT_ONCE = 1e-6  # of a step: moments that are nearer to each other are one
ROUNDING = 1e-14  # of the times of a run: no moment is known better
SHOWN = 3  # times in a note
LEAST_BESIDE, BESIDE = 8, 0.05  # rows beside an event, and their part of all rows
TAIL, FOUND, MEMORY = "events.tail.", "events.found", "events.memory."  # names in a checkpoint
_FINER = "take a smaller step, or a value that is passed faster"


@dataclass(frozen=True)
class Event:
    """A moment at which `quantity` passes `value`.

    value     : in the unit of the quantity, such as [m] of a position
    quantity  : a component of a result, such as "rod.tip.position.y" or "hinge.angle", or a Python function (t, state) ->
                number; `state` is a `ffr_dyn.equations.state_view.StateView`
    direction : "rising", "falling" or "either"
    stop      : the run ends there

    An event is seen when the quantity is on the two sides of the value at the two ends of a step of the integrator, and when
    it passes the value and comes back once within a step. Steps that functions of time divide are looked at part by part.

    Raises InputError for another direction, and a value that is not finite.

    >>> landing = fd.Event("landing", "rod.tip.position.y", 0.0, direction="falling", stop=True)
    """

    name: str
    quantity: str | Callable[[float, StateView], float]
    value: float = 0.0
    _: KW_ONLY
    direction: Literal["rising", "falling", "either"] = "either"
    stop: bool = False

    def __post_init__(self) -> None:
        if self.direction not in ("rising", "falling", "either"):
            raise InputError(f"event {self.name!r}: direction is {self.direction!r}; it is rising, falling or either")
        if not isinstance(self.value, Real) or not np.isfinite(self.value):
            raise InputError(f"event {self.name!r}: the value is {self.value!r}; it must be a finite number")


# (record, memory of the rows before) -> (values (T,), memory): what an event looks at
_Seen = Callable[[Record, Any], tuple[Array, Any]]


@dataclass(frozen=True)
class _Crossing:
    """An event between rows `row` - 1 and `row`, at a length of the step that lies `within` two [s], between which the
    quantity has a mean rate; `memory` is of the rows up to the first of them."""

    number: int
    row: int
    rising: bool
    rate: float
    memory: Any
    within: tuple[float, float]


# whether it rises, its mean rate, and the lengths of a step between which a quantity passes a value
_Part = tuple[bool, float, tuple[float, float]]
# an event as plain data, its declaration, the row that follows it, and a row of its own
_Located = tuple[dict[str, Any], Event, int, Record]


class Watcher:
    """Looks for events in the rows of a run, one for each step. `found` lists them as plain data; `ended_by` is the name of
    the one that has ended the run, `last_step` the beginning, the middle and the end of the step up to it. `complete` gives
    rows the reactions of redundant rows; `divisions` (K,) are the times [s] at which steps are divided, where functions of
    time are fast."""

    def __init__(
        self,
        assembled: Assembled,
        method: Integrator,
        gains: tuple[float, float, float],
        spacing: float,
        events: Sequence[Event],
        complete: Callable[[Record], Record],
        divisions: Array,
    ) -> None:
        self._complete = complete
        self.events, self.found = tuple(events), list[dict[str, Any]]()
        self.ended_by: str | None = None
        system = assembled.system
        names = [event.name for event in self.events]
        if again := [name for k, name in enumerate(names) if name in names[:k]]:
            raise InputError(f"there are two events {again[0]!r}; give each a name of its own")
        self._seen = [_seen(system, event) for event in self.events]
        self._system, self._method, self._gains, self._spacing = system, method, gains, spacing
        self._memory: list[Any] = [None] * len(self.events)
        self._divisions = np.sort(divisions)
        self.last_step: Record | None = None
        self._tail: Record | None = None  # the last rows; the memory is of those before: work counts no row twice

    @property
    def may_end(self) -> bool:
        """Whether an event ends the run."""
        return any(event.stop for event in self.events)

    def begin(self, engine: Engine, time: float) -> None:
        """Take the state of a run's engine as what comes before the first row."""
        first = new_record(self._system, 1)
        record_row(engine, time, first, 0)  # with which the run has begun
        self._tail = self._complete(first)

    def state(self) -> tuple[dict[str, Array], Memory]:
        """What a run goes on with from its last row, for a `Checkpoint`: arrays, and what quantities remember."""
        assert self._tail is not None
        found = json.dumps([self.found, self.ended_by]).encode()
        tail = {TAIL + name: column for name, column in self._tail._asdict().items()}
        memory = {f"{MEMORY}{k}": of for k, of in enumerate(self._memory) if of is not None}
        return tail | {FOUND: np.frombuffer(found, dtype=np.uint8)}, memory

    def go_on(self, saved: Checkpoint) -> None:
        """Take the state of a run that was stopped."""
        self.found, self.ended_by = json.loads(saved.arrays[FOUND].tobytes())
        self._tail = Record(*(saved.arrays[TAIL + name] for name in Record._fields))
        self._memory = [saved.memory.get(f"{MEMORY}{k}") for k in range(len(self.events))]

    def look(self, rows: Record) -> tuple[Record, bool]:
        """The rows that belong to the run, and whether it ends: the last row is that of the event then."""
        assert self._tail is not None
        known = self._tail.time.size
        whole = joined([self._tail, rows])
        located = self._in_order(self._located(whole, crossing) for crossing in self._crossings(whole, known - 1))
        for found, event, row, at_event in located:
            self.found.append(found)
            if event.stop:
                self.ended_by = event.name
                self.found += [of for of, *_ in located if self._at_once(of, found) and of not in self.found]
                self.last_step = self._in_halves(whole, row - 1, at_event)
                return joined([Record(*(column[known:row] for column in whole)), at_event]), True
        if whole.time.size > TAIL_ROWS:
            gone = Record(*(column[:-TAIL_ROWS] for column in whole))
            self._memory = [seen(gone, memory)[1] for seen, memory in zip(self._seen, self._memory, strict=True)]
        self._tail = Record(*(column[-TAIL_ROWS:].copy() for column in whole))
        return rows, False

    def _in_halves(self, rows: Record, k: int, end: Record) -> Record:
        """Row k, the middle of a step from it, and its end."""
        length = max(float(end.time[0] - rows.time[k]), WIDTH * self._spacing)  # which may be rounding of the times
        middle = self._redone(rows, k, length / 2)
        return joined([Record(*(column[k : k + 1] for column in rows)), middle, end])

    def _at_once(self, one: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
        return bool(abs(one["time"] - other["time"]) <= AT_ONCE * self._spacing)

    def _in_order(self, located: Iterable[_Located]) -> list[_Located]:
        """By their times; those of one moment as they are declared, which rounding would order by chance."""
        found = sorted(located, key=lambda one: one[0]["time"])
        moment, moments = -1, []
        for k, one in enumerate(found):
            moment += not k or not self._at_once(one[0], found[k - 1][0])
            moments.append((moment, self.events.index(one[1]), k))
        return [found[k] for *_, k in sorted(moments)]

    def _crossings(self, rows: Record, first: int) -> Iterator[_Crossing]:
        """Of the steps that begin with row `first` or a later one."""
        parted = {k: self._parted(rows, k) for k in np.flatnonzero(self._are_divided(rows)).tolist() if k >= first}
        for number, event in enumerate(self.events):
            seen = self._seen[number]
            values = seen(rows, self._memory[number])[0] - event.value
            wanted = {"rising": (True,), "falling": (False,), "either": (True, False)}[event.direction]
            once, back = passed(values), turned(values)
            for k in range(first, values.size - 1):
                if once[k] or back[k] or k in parted:
                    memory = seen(Record(*(column[: k + 1] for column in rows)), self._memory[number])[1]
                    ends = (values[k], values[k + 1])
                    if k in parted:
                        inner = seen(parted[k], memory)[0] - event.value
                        parts = self._between(parted[k].time - rows.time[k], np.array([ends[0], *inner, ends[1]]))
                    else:
                        parts = self._once(ends) if once[k] else self._there_and_back(rows, number, k, ends, memory)
                    for rising, rate, within in parts:
                        if rising in wanted:
                            yield _Crossing(number, k + 1, rising, rate, memory, within)

    def _are_divided(self, rows: Record) -> Array:
        """(T - 1,) whether steps from each row to the next are."""
        found: Array = np.diff(np.searchsorted(self._divisions, rows.time)) > 0
        return found

    def _parted(self, rows: Record, k: int) -> Record:
        """Rows where the step from row k is divided, of steps from each to the next."""
        begin, end, near = rows.time[k], rows.time[k + 1], WIDTH * self._spacing
        times = self._divisions[(self._divisions > begin + near) & (self._divisions < end - near)]
        found = [Record(*(column[k : k + 1] for column in rows))]
        for length in np.diff(times, prepend=begin).tolist():
            found.append(self._redone(found[-1], 0, length))
        return Record(*(column[1:] for column in joined(found)))

    def _between(self, lengths: Array, values: Array) -> Iterator[_Part]:
        """The parts of a step, divided at these lengths (K,), in which the values (K + 2,) at their ends pass zero."""
        ends = np.array([WIDTH * self._spacing, *lengths, self._spacing])
        for k in np.flatnonzero(passed(values)).tolist():
            rise, time = float(values[k + 1] - values[k]), float(ends[k + 1] - ends[k])
            yield rise > 0, rise / time, (float(ends[k]), float(ends[k + 1]))

    def _once(self, ends: tuple[float, float]) -> Iterator[_Part]:
        """The whole step, at the ends of which the quantity is on the two sides."""
        rise = float(ends[1] - ends[0])
        yield rise > 0, rise / self._spacing, (WIDTH * self._spacing, self._spacing)

    def _there_and_back(
        self, rows: Record, number: int, k: int, ends: tuple[float, float], memory: Any
    ) -> Iterator[_Part]:
        """The parts of a step before and after the moment at which the quantity is farthest beyond the value, if it is."""
        side, whole = float(np.sign(ends[0])), self._spacing

        def height(length: float) -> float:
            return side * self._over(rows, number, k, length, memory)

        found = minimize_scalar(height, bounds=(0.0, whole), method="bounded", options={"xatol": NARROW * whole})
        farthest, depth = float(found.x), float(found.fun)
        if depth < 0:
            sinking, climbing = side * depth - ends[0], ends[1] - side * depth
            yield side < 0, sinking / farthest, (WIDTH * whole, farthest)
            yield side > 0, climbing / (whole - farthest), (farthest, whole)

    def _over(self, rows: Record, number: int, k: int, length: float, memory: Any) -> float:
        """By how much the quantity is over the value at the end of a step of this length from row k. Work is added up by
        Simpson's rule: its own formula is of equal steps."""
        end = self._redone(rows, k, length)
        if isinstance(memory, Worked):
            end, memory = self._in_halves(rows, k, end), replace(memory, powers=())
        return float(self._seen[number](end, memory)[0][-1]) - self.events[number].value

    def _located(self, rows: Record, crossing: _Crossing) -> _Located:
        event, k = self.events[crossing.number], crossing.row - 1
        sign = 1.0 if crossing.rising else -1.0

        def beyond(length: float) -> float:
            return sign * self._over(rows, crossing.number, k, length, crossing.memory)

        (least, most), width = crossing.within, WIDTH * self._spacing
        if beyond(least) >= 0:  # at the beginning, where the state is brought back onto the constraints
            length = least
        else:
            length = most if beyond(most) <= 0 else float(brentq(beyond, least, most, xtol=width, rtol=WIDTH))
        own = self._redone(rows, k, length)
        found = {
            "event": event.name,
            "quantity": event.quantity if isinstance(event.quantity, str) else "a function",
            "time": float(own.time[0]),
            "rising": crossing.rising,
            "rate": crossing.rate,
            "x": own.x[0].tolist(),
            "v": own.v[0].tolist(),
        }
        return found, event, crossing.row, own

    def _redone(self, rows: Record, k: int, length: float) -> Record:
        """A row at the end of one step of this length, or of a run where the method chooses its steps, from row k."""
        method: Any = self._method
        if not method.controlled:
            method = replace(method, step=length) if method.repeatable else ROS2(length)
        time, end = float(rows.time[k]), new_record(self._system, 1)
        engine = new_engine(self._system, rows.x[k], rows.v[k], method, self._gains, start=time, spacing=length)
        engine.work.loads.reference[:] = rows.forces[k]
        status = fill_rows(engine, end, time, 1)
        if status != OK:
            raise failure(self._system, engine.work, status, time, Settings(method, self._gains[2] > 0))
        return self._complete(end)


def passed(values: Array) -> Array:
    """(T - 1,) whether values (T,) pass zero from each row to the next."""
    before, after = values[:-1], values[1:]
    found: Array = ((before < 0) & (after >= 0)) | ((before > 0) & (after <= 0))
    return found


def turned(values: Array) -> Array:
    """(T - 1,) whether values (T,) may pass zero and come back from each row to the next, as they came near it by the step
    before: one that is convex does so only where it would pass as fast as it came. Of the first step nothing is known."""
    found = values[:-1] * values[1:] > 0
    came = np.sign(values[1:-1]) * (values[:-2] - values[1:-1])
    found[1:] &= np.abs(values[1:-1]) < REACH * came
    return found


# ---- what an event looks at -----------------------------------------------------------------------------------------


def _seen(system: System, event: Event) -> _Seen:
    if not isinstance(event.quantity, str):
        return _function(system, event.name, event.quantity)
    known = catalogue(system)
    head, _, label = event.quantity.rpartition(".")
    if event.quantity in known and not known[event.quantity].axes:
        name, at = event.quantity, None
    elif head in known and known[head].axes and label in known[head].axes[0].labels:
        name, at = head, known[head].axes[0].labels.index(label)
    else:
        close = get_close_matches(event.quantity, list(_numbers_of(known)), 3)
        hint = f"did you mean {', '.join(close)}?" if close else f"numbers and components are of: {', '.join(known)}"
        raise InputError(f"event {event.name!r}: {event.quantity!r} is no number of the scene; {hint}")
    compute = known[name].compute

    def values(record: Record, memory: Any) -> tuple[Array, Any]:
        found, left = compute(View(system, record), memory)
        return (found if at is None else found[:, at]), left

    return values


def _numbers_of(known: Mapping[str, Entry]) -> Iterator[str]:
    """Names of all that is one number and has one axis at most."""
    for name, entry in known.items():
        if len(entry.axes) < 2:
            yield from (f"{name}.{label}" for label in entry.axes[0].labels) if entry.axes else (name,)


def _function(system: System, event: str, function: Callable[[float, StateView], float]) -> _Seen:
    def value(t: float, x: Array, v: Array) -> float:
        try:
            found = float(function(t, StateView(system.scene, system.layout, x, v)))
        except Exception as error:
            raise InputError(
                f"event {event!r}: its Python function at t = {t:.6g} s: {error or type(error).__name__}"
            ) from error
        if not np.isfinite(found):
            raise InputError(f"event {event!r}: its Python function at t = {t:.6g} s is {found}; it must be finite")
        return found

    def values(record: Record, memory: Any) -> tuple[Array, Any]:
        return np.array([value(t, x, v) for t, x, v in zip(record.time, record.x, record.v, strict=True)]), None

    return values


# ---- how accurate the moments are -------------------------------------------------------------------------------------


def with_errors(
    run: Result,
    errors: Mapping[str, StepError],
    other: Beside | None,
    order: float,
    twins: Sequence[Beside],
    *,
    between: bool = False,
) -> list[dict[str, Any]]:
    """The events of a run with the "error" [s] of each moment; None where a run with other steps does not pass it.

    errors              : of the outputs of the run
    other, order, twins : further runs, with the same events, as for `step_errors`
    between             : states lie between steps of any length, so that two runs may be equally far off at one moment by
                          chance: how far they are apart in the rows beside it is told at least
    """
    found, beside = run.attributes["events"], [*([] if other is None else [other]), *twins]
    times = [_of_the_same(found, one.result.attributes["events"]) for one in beside]
    sure = [k for k in range(len(found)) if all(other_times[k] is not None for other_times in times)]
    own, *others = (_moments(run, [at[k] for k in sure]) for at in ([event["time"] for event in found], *times))
    told = [Beside(moments, one.ratio) for moments, one in zip(others, beside, strict=True)]
    off = step_errors(own, None, order, told) if other is None else step_errors(own, told[0], order, told[1:])
    known = {k: max(off[str(n)].error, _shaken(found[k], errors)) for n, k in enumerate(sure)}
    if between and other is not None:
        known = {k: max(error, _apart(found[k], run, other.result)) for k, error in known.items()}
    least = ROUNDING * max(1e-300, *np.abs(run.time[[0, -1]]))
    return [event | {"error": max(least, known[k]) if k in known else None} for k, event in enumerate(found)]


def _of_the_same(own: Sequence[Mapping[str, Any]], other: Sequence[Mapping[str, Any]]) -> list[float | None]:
    """When another run has each event of a run: the moments that are nearest to each other, of one event and direction."""

    def nearest(event: Mapping[str, Any], among: Sequence[Mapping[str, Any]]) -> Mapping[str, Any] | None:
        alike = (one for one in among if all(one[key] == event[key] for key in ("event", "rising")))
        return min(alike, key=lambda one: abs(one["time"] - event["time"]), default=None)

    pairs = ((event, nearest(event, other)) for event in own)
    return [one["time"] if one is not None and nearest(one, own) is event else None for event, one in pairs]


def _moments(run: Result, times: Sequence[Any]) -> Result:
    """Times [s] as outputs of two rows, from the start of a run to each."""
    start = float(run.time[0])
    return Result(
        np.array([0.0, 1.0]), {str(k): Quantity(np.array([start, time]), "s") for k, time in enumerate(times)}
    )


def _shaken(event: Mapping[str, Any], errors: Mapping[str, StepError]) -> float:
    """[s] by which vibration that steps do not resolve moves an event."""
    name = event["quantity"]
    told = errors.get(name) or errors.get(name.rpartition(".")[0])
    return told.error / abs(event["rate"]) if told is not None and told.vibrates and event["rate"] else 0.0


def _apart(event: Mapping[str, Any], run: Result, other: Result) -> float:
    """[s] by which the quantity of an event is apart in the rows beside it, over its rate; 0 where it is not kept."""
    try:
        values, theirs = (rows[event["quantity"]] for rows in (run, other))
    except InputError:
        return 0.0
    count = max(LEAST_BESIDE, round(BESIDE * run.time.size))
    near = np.argsort(np.abs(run.time - event["time"]), kind="stable")[:count]
    near = near[near < min(values.size, theirs.size) - 1]  # the last row may be that of an event
    apart = float(np.abs(values[near] - theirs[near]).max(initial=0.0))
    return apart / abs(event["rate"]) if event["rate"] else 0.0


def doubts(events: Sequence[Mapping[str, Any]], end: float, further: Sequence[Result]) -> list[str]:
    """Notes on events that not all runs with other steps pass, and on those that only these pass before the `end` [s]."""
    gone, missed = dict[str, list[float]](), dict[str, list[float]]()
    for event in events:
        if event["error"] is None:
            gone.setdefault(event["event"], []).append(event["time"])
    for run in further:
        theirs = run.attributes["events"]
        for event, own in zip(theirs, _of_the_same(theirs, events), strict=True):
            if own is None and event["time"] < end:
                missed.setdefault(event["event"], []).append(event["time"])
    doubtful = (
        f"{_named(*of, 'at')} is in doubt: a run with other steps does not pass it; {_FINER}" for of in gone.items()
    )
    more = (f"{_named(*of, 'may happen at')}, too, as in a run with other steps; {_FINER}" for of in missed.items())
    return [*doubtful, *more]


def _named(name: str, times: Sequence[float], words: str) -> str:
    at = ", ".join(f"{time:.6g}" for time in sorted(times)[:SHOWN])
    return f"event {name!r} {words} t = {at}{', ...' * (len(times) > SHOWN)} s"
