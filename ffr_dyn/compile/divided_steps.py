"""Scenes whose steps are divided where their functions of time change faster (`ffr_dyn.functions.fast_changes`)."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from math import ceil

import numpy as np

from ffr_dyn.compile.alignment import in_one_piece
from ffr_dyn.compile.force_tables import Callback
from ffr_dyn.compile.scene_tables import System, of_time
from ffr_dyn.functions.breaks import begins
from ffr_dyn.functions.fast_changes import Changes, Made, divisions, fast_changes, made_of, slow
from ffr_dyn.functions.poles import pole
from ffr_dyn.functions.time_functions import USER
from ffr_dyn.functions.told_rates import misled, wrong_rate
from ffr_dyn.kernels.functions import sample_functions
from ffr_dyn.kernels.tables import SINCE, UNTIL
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError, InputError

PARTS = 4  # of a span over which a function is a cubic, for the step that is asked for
CALLS = 8  # of a Python function in a step, about, before a run,
FEWEST_CALLS, MOST_CALLS = 4_000, 100_000  # and in all, and again as many where it changes fast
ASIDE = 1e-5  # of a step, at which it is called for its rate
MOST_ROWS = 100_000  # times from which the search begins
MOST = 1_000_000  # parts of steps
SHARP = 1e-7  # of a step: what changes within less may be a pole
BESIDE = 1e-9  # of a step, by which its parts are longer
BEFORE = 1e-14  # of a time, up to which before a break what is looked at is what comes behind it
NAMES, TIMES = 3, 3  # in a text


Parts = list[list[tuple[float, float]]]  # [s] from each of some times to the next, over which nothing breaks
Rows = tuple[Array, Parts]  # the times, and what is between them


@dataclass(frozen=True)
class Fast:
    """What functions of time do within steps of a length [s].

    spans : (L, 2) in order and shorter than a step;  purposes : what the functions that change there are for
    jumps : (J, 2) the last time before something jumps that nobody has told, and the first behind it
    switches : (S,) when operations of formulas switch
    """

    spans: Array
    purposes: tuple[str, ...]
    jumps: Array
    switches: Array
    step: float

    @property
    def breaks(self) -> Array:
        """(K,) at which something jumps or switches."""
        return np.concatenate([self.jumps[:, 1], self.switches])

    @property
    def moments(self) -> Array:
        """(K,) at which powers may change between rows."""
        return np.concatenate([self.spans[:, 0], self.breaks])

    @property
    def words(self) -> tuple[str, ...]:
        """What is done about the spans."""
        return tuple(f"{text}; steps are divided there" for text in self.faster)

    @property
    def faster(self) -> tuple[str, ...]:
        """What changes faster than a step, and when."""
        if not len(self.spans):
            return ()
        names = ", ".join(self.purposes[:NAMES]) + ", ..." * (len(self.purposes) > NAMES)
        apart = np.flatnonzero(np.diff(self.spans[:, 0]) > self.step)
        begun = self.spans[np.concatenate([[0], apart + 1]), 0]
        times = ", ".join(f"{t:.6g}" for t in begun[:TIMES]) + ", ..." * (len(begun) > TIMES)
        shortest = float((self.spans[:, 1] - self.spans[:, 0]).min())
        return (
            f"{names}: changes within {shortest:.2g} s, faster than a step of {self.step:.3g} s, from t = {times} s on",
        )


def fast_of(system: System, start: float, end: float, output_step: float, step: float) -> Fast | None:
    """What functions of time do within steps [s] from `start` to `end`; None where they do nothing there.

    A Python function that changes all the time, as noise does, is left as it is called.
    Raises ComputationError where functions that are written change many times in every step and where Python functions tell
    rates that are not theirs, which look as if they changed; InputError where a written one grows without bound.
    """
    if not 0 < end - start < np.inf:
        return None  # what is no span the run tells
    rows = _times(start, end, output_step)
    _refuse_wrong_rates(system, rows)
    functions = system.model.functions
    made = made_of(functions.kind, functions.start, functions.data, system.model.rows.function, functions.switches)
    if slow(made, functions.kind, functions.start, step):
        return None
    found = _with_python(system, made, rows, step) or _written(system, made, rows, step)
    _refuse_poles(system, made, found, (start, end, step))
    return _named(system, found, step)


def parts_of(system: System, times: Array, fast: Fast | None) -> Parts:
    """From each of the times (T,) [s] to the next the spans in which no function of time breaks, and none changes faster than
    a solver that chooses its steps may see."""
    breaks, fastest = system.model.functions.breaks[:, [UNTIL, SINCE]], np.zeros((0, 2))
    if fast is not None:
        begun_at = np.reshape([begins(t)[:2] for t in (*fast.spans.ravel(), *fast.switches)], (-1, 2))
        fastest = np.concatenate([fast.jumps, begun_at])
    cuts = np.unique(np.concatenate([breaks, fastest]), axis=0)
    aside = BEFORE * (np.abs(times).max() + np.ptp(times))
    found = []
    for begin, end in pairwise(times.tolist()):
        within = cuts[(cuts[:, 0] >= begin) & (cuts[:, 1] <= end)] - [aside, 0.0]
        bounds = [begin, *np.maximum(within, begin).ravel().tolist(), end]
        found.append([(one, other) for one, other in zip(bounds[::2], bounds[1::2], strict=True) if other > one])
    return found


def breaks_of(system: System, start: float, end: float, output_step: float) -> Array:
    """(K,) when [s] functions of time switch that do not tell it, for analyses without steps. Raises InputError where one
    grows without bound."""
    fast = within(system, start, end, output_step)
    return np.zeros(0) if fast is None else fast.breaks


def within(system: System, start: float, end: float, output_step: float) -> Fast | None:
    """What functions of time do within output steps [s]; None, too, where they change many times in each, or tell rates that
    are not theirs. Raises InputError where one grows without bound."""
    with suppress(ComputationError):
        return fast_of(system, start, end, output_step, output_step)
    return None


def _refuse_wrong_rates(system: System, rows: Array) -> None:
    for callback in system.user.callbacks:
        if not callback.with_state and (wrong := wrong_rate(partial(of_time, callback), rows)):
            raise ComputationError(misled(callback.what, *wrong))


def too_fast(system: System, start: float, end: float, step: float) -> list[str]:
    """What of the functions that are not Python's has changed faster than steps that nobody divides, and what mends it."""
    functions = system.model.functions
    made = made_of(functions.kind, functions.start, functions.data, system.model.rows.function, functions.switches)
    if not 0 < end - start < np.inf or slow(made, functions.kind, functions.start, step):
        return []
    try:
        found = _written(system, made, _times(start, end, step), step)
        _refuse_poles(system, made, found, (start, end, step))
    except (InputError, ComputationError) as error:
        return [str(error)]
    fast = _named(system, found, step)
    return [f"{text}; take shorter steps" for text in fast.faster] if fast else []


def _times(start: float, end: float, apart: float) -> Array:
    return np.linspace(start, end, 1 + int(np.clip(round((end - start) / apart), 1, MOST_ROWS)))


def _named(system: System, found: Changes, step: float) -> Fast | None:
    names = dict.fromkeys(name for name, fast in zip(system.purposes, found.which, strict=True) if fast)
    changes = len(found.spans) + len(found.jumps) + len(found.switches)
    return Fast(found.spans, tuple(names), found.jumps, found.switches, step) if changes else None


def _written(system: System, made: Made, rows: Array, step: float) -> Changes:
    """Of functions that are not Python's."""
    sample = partial(_sampled, system, partial(_no_python, system))
    found = fast_changes(made, sample, rows, system.model.functions.breaks, step)
    if found is None:
        raise ComputationError(
            f"{', '.join(dict.fromkeys(system.purposes))}: a function of time changes so often that steps of {step:.3g} s "
            "cannot be divided as it asks for; take a shorter step, or leave out of it what is too fast to matter"
        )
    return found


def _refuse_poles(system: System, made: Made, found: Changes, span: tuple[float, float, float]) -> None:
    """Raises InputError where a function that is not Python's has a pole; span : start, end and step [s]."""
    start, end, step = span
    narrow = found.spans[found.spans[:, 1] - found.spans[:, 0] < SHARP * step]
    breaks = system.model.functions.breaks[:, [UNTIL, SINCE]]
    times = np.concatenate([[start, end], *(0.5 * ends.sum(axis=1) for ends in (narrow, found.jumps, breaks))])
    sample = partial(_sampled, system, partial(_no_python, system))
    at = pole(sample, made.roots, times[(times >= start) & (times <= end)], step)
    if at:
        raise InputError(
            f"{system.purposes[at[1]]}: the function of time grows without bound at t = {at[0]:.6g} s, which no step "
            "resolves; limit it there, as 1 / sqrt(t**2 + 0.01**2) does 1 / abs(t), or end the run before"
        )


def _with_python(system: System, made: Made, rows: Array, step: float) -> Changes | None:
    """With the Python functions looked into as often as a run would call them; None where there are none, or that cannot be
    done: the run tells what they raise, and when."""
    if not (system.model.functions.kind == USER).any():
        return None
    calls = np.clip((rows[-1] - rows[0]) / step * CALLS, FEWEST_CALLS, MOST_CALLS)
    looked = np.union1d(made.rows, np.linspace(rows[0], rows[-1], int(calls) + 1))
    python = _Python(system, (float(rows[0]), float(rows[-1])), ASIDE * step)
    try:
        sample = partial(_sampled, system, python.numbers)
        return fast_changes(replace(made, rows=looked), sample, rows, system.model.functions.breaks, step, int(calls))
    except _NotToBeCalledError:
        return None


class _NotToBeCalledError(Exception):
    """A Python function of the user has raised something."""


class _Python:
    """What the Python functions of time of a scene return, each called once for a time; rates that they do not return are
    differences, by calls `aside` [s], or less where a break is told between."""

    def __init__(self, system: System, span: tuple[float, float], aside: float) -> None:
        breaks = system.model.functions.breaks
        self.count, self.aside = system.user.count, aside
        self.callbacks = [callback for callback in system.user.callbacks if not callback.with_state]
        self.known: dict[tuple[int, float], Array] = {}
        self.least = np.concatenate([span[:1], breaks[:, SINCE]])
        self.most = np.concatenate([breaks[:, UNTIL], span[1:]])

    def numbers(self, times: Array) -> Array:
        """(T, U) for `ffr_dyn.kernels.functions.evaluate_functions`."""
        found = np.zeros((times.size, self.count))
        for callback in self.callbacks:
            found[:, callback.slot : callback.slot + callback.size] = [self._of(callback, t) for t in times.tolist()]
        return found

    def _of(self, callback: Callback, t: float) -> Array:
        key = callback.slot, t
        if key not in self.known:
            self.known[key] = values = _called(callback, t)
            if np.isnan(values[1]):
                values[1] = self._rate(callback, t, float(values[0]))
        return self.known[key]

    def _rate(self, callback: Callback, t: float, value: float) -> float:
        """The smaller of those before and behind, which is none of a jump that is near."""
        before = self.least[max(int(np.searchsorted(self.least, t, side="right")) - 1, 0)]
        behind = self.most[min(int(np.searchsorted(self.most, t)), self.most.size - 1)]
        beside = (max(t - self.aside, float(before)), min(t + self.aside, float(behind)))
        rates = [(float(_called(callback, s)[0]) - value) / (s - t) for s in beside if s != t]
        least, most = min(rates, default=0.0), max(rates, default=0.0)
        return max(least, 0.0) + min(most, 0.0)


def _called(callback: Callback, t: float) -> Array:
    try:
        return of_time(callback, t)
    except Exception as error:
        raise _NotToBeCalledError from error


def _no_python(system: System, times: Array) -> Array:
    return np.zeros((times.size, system.user.count))


def _sampled(system: System, python: Callable[[Array], Array], times: Array) -> Array:
    """(T, F, 3) of all functions of time."""
    seen = np.zeros((times.size, system.model.functions.kind.size, 3))
    sample_functions(system.model.functions, python(times), times, seen)
    return seen


def divided(system: System, fast: Fast, step: float) -> System:
    """The system, of which steps [s] end where functions that are fast ask for it: in proportion to the step."""
    if not len(fast.spans) + len(fast.jumps):
        return system
    times = division_times(fast, step)
    if times.size > MOST:
        raise ComputationError(
            f"{', '.join(fast.purposes)}: changes so often that {times.size:.2g} parts of steps, {_parts(fast, step)} to a "
            "change, are more than a run has room for; take a shorter step, or leave out what is too fast to matter"
        )
    functions = system.model.functions
    breaks = _with_times(np.concatenate([functions.breaks, fast.jumps[:, [0, 1, 1]]]), times, BESIDE * step)
    piece = in_one_piece(system.model._replace(functions=functions._replace(breaks=breaks)))
    return replace(system, model=piece.tables, words=piece.words)


def division_times(fast: Fast, step: float) -> Array:
    """(K,) times [s] at which steps of this length [s] are divided where functions are fast."""
    return divisions(fast.spans, _parts(fast, step))


def _parts(fast: Fast, step: float) -> int:
    """Parts of a change."""
    return ceil(PARTS * fast.step / step)


def _with_times(breaks: Array, times: Array, apart: float) -> Array:
    """Breaks in order, and with them the times that are so far apart from them."""
    since = np.sort(breaks[:, SINCE])
    near = np.searchsorted(since, times - apart) < np.searchsorted(since, times + apart)
    every = np.concatenate([breaks, np.reshape([begins(t) for t in times[~near].tolist()], (-1, 3))])
    found: Array = every[np.argsort(every[:, SINCE], kind="stable")]
    return found
