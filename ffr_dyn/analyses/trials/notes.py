"""A run with its errors and with notes on what they do not say."""

from __future__ import annotations

import math
from collections.abc import Mapping, Set
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ffr_dyn.analyses.trials.begin import Beginning
from ffr_dyn.analyses.trials.errors import Trial, twin_share
from ffr_dyn.analyses.trials.runs import Runs, has_failed
from ffr_dyn.analyses.trials.set_in import not_led
from ffr_dyn.consistency.step_error import (
    A_FORMULA,
    PLACES,
    SLIGHT,
    StepError,
    from_rounding,
    natural_units,
    of_the_range,
    percent,
    too_coarse,
    worst,
)
from ffr_dyn.consistency.unresolved import damped_less, leading
from ffr_dyn.integrators import Within
from ffr_dyn.integrators.ros2 import Twin
from ffr_dyn.linear.departure import at_rest_in_part, departures, places, pushed
from ffr_dyn.results.file import with_attributes
from ffr_dyn.results.result import Result
from ffr_prep.common.errors import ComputationError, InputError

SHOWN = 3  # times in a note
WATCHED, FEW = 50, 1  # rows at least by which a disturbed run is held against the other, and steps to a row
SHORTEST, LONGEST = 8, 64  # steps to a row, by which what it seems to show is looked at again


def finished(runs: Runs, trial: Trial, path: str | Path | None, ringing: Set[str] = frozenset()) -> Result:
    """The result of a run with its errors, here and in its file; `ringing` outputs are told to be so."""
    result, begun = trial.result, runs.assembled
    grown = not_led(result, begun.system, begun.x, begun.v, from_rounding(result))
    unseen = _unseen(trial)
    notes = [
        *result.attributes["notes"],
        *unseen,
        *(_untold(runs) if trial.errors else ()),
        *(_damped_less(runs) if trial.errors else ()),
        *_unresolved(runs, trial, ringing),
        *result.attributes.get("missed", ()),
        *_coarse(trial),
        *_unstable(result, grown),
        *(_left(runs, trial) if trial.errors and not grown else ()),
        *trial.doubts,
    ]
    trial = replace(trial, errors={name: _by_chance(e, grown.get(name, 0.0)) for name, e in trial.errors.items()})
    told = {name: [e.error, e.of_range] for name, e in trial.errors.items()}
    more: dict[str, Any] = {"notes": notes, "errors": told} | ({"events": trial.events} if trial.events else {})
    if trial.errors:
        more["accuracy"] = _at_least(trial.errors) if unseen else worst(trial.errors)
        more["effort"] = sum(runs.work) / max(1, result.attributes["evaluations"])
    elif result.time.size > 1:
        more["accuracy"] = "step: not known"
    attributes = {**result.attributes, **more}
    if path is not None:
        with_attributes(path, attributes)
    return replace(result, attributes=attributes)


def _at_least(errors: Mapping[str, StepError]) -> str:
    """Of errors that leave out what the steps damp."""
    name = max(errors, key=lambda one: errors[one].of_range)
    return f"step: not known; {name} is off by {of_the_range(errors[name].of_range)} or more"


def _unseen(trial: Trial) -> list[str]:
    """A note where what the steps damp, or what stops give back, is not in the errors."""
    if not trial.errors:
        return []
    if "rebounds" in trial.result.attributes:
        lost = trial.result.attributes["rebounds"]
        return [f"the error told leaves out rebounds from stops, for which the steps are too long: {lost}"]
    if trial.twins or twin_share(trial.method) is None:
        return []
    return [
        "the error told leaves out vibration that the steps damp: the run that shows it has failed; take a smaller step"
    ]


def _untold(runs: Runs) -> list[str]:
    """Notes on breaks at which no steps end."""
    return [
        f"{what} jumps or has a kink at t = {', '.join(f'{t:.6g}' for t in times[:SHOWN])}"
        f"{', ...' * (len(times) > SHOWN)} s, where no step ends, and steps are of first order there; {_way_to_tell(what)}"
        for what, times in runs.untold.items()
    ]


def _damped_less(runs: Runs) -> list[str]:
    """Notes on bodies that are damped by less than their ratios say; vibrations are found where some are damped."""
    damped = any(body.damping.any() for body in runs.assembled.system.scene.bodies)
    return damped_less(runs.vibrations) if damped else []


def _way_to_tell(what: str) -> str:
    if what == A_FORMULA:
        return "write it with abs, min, max or step, at whose kinks they end"
    return "give its times, as in fd.user(function, breaks=[0.5])"


def _unresolved(runs: Runs, trial: Trial, ringing: Set[str]) -> list[str]:
    """A note on the vibration that the step does not resolve: its share, its frequency, and the price of resolving it."""
    large = {name: e for name, e in trial.errors.items() if e.of_range > Within().accuracy}
    told = {name: e for name, e in large.items() if e.vibrates or name in ringing}
    if not told or not runs.vibrations.omega.size:
        return []
    of, method = runs.vibrations, trial.method
    name = max(told, key=lambda one: told[one].of_range)
    found = leading(of, trial.result, trial.twins[0].result)
    words = f" of {found / 2 / np.pi:.4g} Hz" if found else ""
    step = (1.2 if of.ratio[-1] > 0 else 0.25) / of.omega[-1]
    times = (4 / step) / ((4 if method.order > 2 else 2) / method.step)
    others = f"{_others(len(told) - 1)}{_slightly(trial, told)}"
    return [
        f"vibration{words} that a step of {method.step:.3g} s does not resolve carries "
        f"{of_the_range(told[name].of_range)} of {name}{others}; rk4 with a step of {step:.2g} s resolves "
        f"it, for about {max(times, 1):.2g} times the time of this run{_without_shock(runs.begin)}"
    ]


def _slightly(trial: Trial, told: Mapping[str, StepError]) -> str:
    """How far points are off, where that is little beside the scene."""
    lengths = [name for name in told if trial.result.quantities[name].unit == "m"]
    off = max((told[name].error for name in lengths), default=np.inf)
    return (
        f", by which no point is off more than {off:.2g} m" if off <= SLIGHT * natural_units(trial.result)("m") else ""
    )


def _without_shock(begin: Beginning) -> str:
    return '; if it is the start that excites it, begin = "quasi-static" leaves it out' if begin == "as-given" else ""


def _coarse(trial: Trial) -> list[str]:
    result, faded = trial.result, {name for name, error in trial.errors.items() if error.faded}
    found = {name: share for name, share in too_coarse(result).items() if name not in faded}
    if not found:
        return []
    name = max(found, key=lambda one: found[one])
    return [
        f"rows every {float(result.attributes['output_step']):g} s are too coarse for what {name} does"
        f"{_others(len(found) - 1)}: between them it is up to {percent(found[name])} of its range off the curve through "
        "them, or more; take a smaller output_step to see it"
    ]


def _unstable(result: Result, grown: Mapping[str, float]) -> list[str]:
    """A note on what has grown from rounding."""
    if not grown:
        return []
    name = next((one for one in grown if PLACES.search(one)), next(iter(grown)))
    also = "" if len(grown) == 1 else f", {len(grown) - 1} other output{'s' if len(grown) > 2 else ''} with it"
    far = f"{grown[name]:.2g} {result.quantities[name].unit}".removesuffix(" 1")
    return [
        f"{name} grows from rounding to {far}{also}: the motion is unstable, and how far it has gone by then is chance; give "
        "it the imperfection that is meant, such as a small load or deflection"
    ]


def _left(runs: Runs, trial: Trial) -> list[str]:
    """A note where a disturbed motion leaves that of the run, by more steps of its own if it seems to by few."""
    if not at_rest_in_part(trial.result, runs.assembled.system):
        return []
    fine = max(1, math.ceil(WATCHED * runs.output_step / (runs.how["end"] - runs.start) - 1e-9))
    again = int(np.clip(math.ceil(trial.count / fine), SHORTEST, LONGEST))
    for steps in (FEW, again, LONGEST):
        found = _departures(runs, trial.result, fine, steps)
        if found is not None and (not found or steps > FEW):
            break
    if not found:
        return []
    name = max(found, key=lambda one: (one in trial.result.quantities, found[one]))
    return [
        f"the motion is unstable: a disturbance at the start grows to {found[name]:.1g} times its size by {name}, and the "
        "run shows the motion without one; give it the imperfection that is meant, such as a small load or deflection"
    ]


def _departures(runs: Runs, result: Result, fine: int, steps: int) -> dict[str, float] | None:
    """What leaves the motion by a disturbance, seen by so many steps to rows that are so many times finer; None where such
    runs fail."""
    row, lasts = runs.output_step / fine, runs.how["end"] - runs.start
    try:
        still = runs.free_to_leave
        states = still, pushed(still, runs.start, lasts)
    except ComputationError:
        return None
    more = {"output_step": row, "outputs": places(still.system), "stopwatch": None, "events": ()}
    calls = [
        lambda say, one=one: replace(runs, assembled=one).run(Twin(row / steps), **more, progress=say) for one in states
    ]
    run, disturbed = runs.together(calls, leader=False)
    if any(
        isinstance(one, InputError) or has_failed(one) for one in (run, disturbed)
    ):  # of steps that are rounding, too
        return None
    size = max(body.model.size for body in runs.scene.bodies) or 1.0
    return departures(run, disturbed, size, float(result.time[-1]))


def _by_chance(told: StepError, size: float) -> StepError:
    """The error of an output that has grown from rounding to a size, zero for others."""
    return replace(told, error=max(told.error, size), of_range=max(told.of_range, 1.0)) if size > 0 else told


def _others(count: int) -> str:
    return "" if count < 1 else f" and of {count} other output{'s' if count > 1 else ''}"
