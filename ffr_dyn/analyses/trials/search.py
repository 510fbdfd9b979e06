"""The step for an accuracy."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ffr_dyn.analyses.integration import check_continues
from ffr_dyn.analyses.trials.errors import Trial, beside_twin, further_runs, leap_of, with_its_errors
from ffr_dyn.analyses.trials.faded import without_faded
from ffr_dyn.analyses.trials.notes import finished
from ffr_dyn.analyses.trials.runs import Runs
from ffr_dyn.consistency.step_error import (
    PLACES,
    SLIGHT,
    Beside,
    natural_units,
    range_of,
)
from ffr_dyn.integrators import Within, stepped
from ffr_dyn.results.file import load_result
from ffr_dyn.results.result import Result
from ffr_prep.common.errors import ComputationError, InputError

FIRST, FINEST = 4, 1024  # steps to an output row: of the first trial, and at most
MARGIN = 2.0  # by which a trial aims below the accuracy
SLOW = 0.7  # a ringing output's error falls slower than the step to this power,
IN_COMPANY = 1.4  # or to this one, if it is of vibration, where others ring

# What a step is to keep within the accuracy always, and what where it does not ring.
DEFLECTIONS = re.compile(r"\.displacement$")
DRIVING = re.compile(r"\.(displacement|rotation|force|moment|effort|torque|tension)$|^measured\.")


def searched(runs: Runs, within: Within, kept: dict[str, Any]) -> Result:
    """The run with the longest step found that keeps the accuracy; where forces ring, of those that keep the positions.

    A run that goes on makes the same trials as one from the start. The file to resume is one of them, begun at least: it
    goes on where the search comes to its step, and stays as it is until then.
    """
    trials, ringing, path, count = list[Trial](), set[str](), kept["path"] or kept["resume"], FIRST
    begun = _steps_done(runs, within, kept["resume"])
    while True:
        method = stepped(within, runs.output_step / count)
        try:
            trial, _ = beside_twin(runs, method, count, _kept(kept, path, count, begun))
            trial = _beside_last(runs, trial, trials)
        except (ComputationError, InputError):
            if count >= FINEST:
                raise
            count *= FIRST
            continue
        if not trial.errors or count >= FINEST or _excess(trial, ringing, trials) <= within.accuracy:
            trial = with_its_errors(
                runs, trial, *runs.together(further_runs(runs, method, count, trials), leader=False)
            )
        excess = _excess(trial, ringing, trials) / within.accuracy
        trials.append(trial)
        if excess <= 1.0 or count >= FINEST:
            return finished(runs, trial, path, ringing)
        count = _next(count, excess, leap_of(method))


def _steps_done(runs: Runs, within: Within, resume: str | Path | None) -> int:
    """Steps to a row of the trial that a file to resume holds; 0 without one.

    Raises InputError where the file is not a trial of this search.
    """
    if resume is None or not Path(resume).exists():
        return 0
    step = load_result(resume).attributes.get("step") or runs.output_step
    count = max(1, round(runs.output_step / step))
    check_continues(resume, runs.assembled, stepped(within, runs.output_step / count), **runs.how)
    return count


def _kept(kept: dict[str, Any], path: str | Path | None, count: int, begun: int) -> dict[str, Any]:
    """Where a trial is kept: in memory alone as long as the file holds a later one."""
    if count < begun:
        return {"path": None, "resume": None}
    return {"path": path, "resume": kept["resume"] if count == begun else None}


def _beside_last(runs: Runs, trial: Trial, earlier: Sequence[Trial]) -> Trial:
    """The trial, which a twin alone has told, beside the one with longer steps before it."""
    if not trial.errors or not earlier:
        return trial
    last = Beside(earlier[-1].result, trial.count / earlier[-1].count)
    return replace(trial, errors=without_faded(trial.errors, trial.result, last, runs))


def _next(count: int, excess: float, leap: int) -> int:
    """Steps to a row, an even number, at least twice as many."""
    wanted = count * float(np.clip((MARGIN * excess) ** 0.5, 2.0, leap))
    return min(FINEST, 2 * int(np.ceil(wanted / 2)))


def _excess(trial: Trial, ringing: set[str], earlier: Sequence[Trial]) -> float:
    """The largest error over range of what a trial is to keep; infinite where no error could be told, or rebounds from stops
    are lost. Outputs that ring, for which shorter steps have ceased to help, are added to those that do."""
    if not trial.errors or "rebounds" in trial.result.attributes:
        return np.inf
    for before in (one for one in earlier[-1:] if one.errors):
        driving = [name for name in trial.errors if DRIVING.search(name)]
        left = {name: trial.errors[name].error / max(before.errors[name].error, 1e-300) for name in driving}
        ringing |= {name for name in driving if left[name] > (trial.count / before.count) ** -SLOW}
        if ringing:
            vibrating = (name for name in driving if trial.errors[name].vibrates)
            ringing |= {name for name in vibrating if left[name] > (trial.count / before.count) ** -IN_COMPANY}
    wanted = (name for name in trial.errors if PLACES.search(name) or DRIVING.search(name))
    left_out = ringing | (_slight(trial) if any(DEFLECTIONS.search(name) for name in ringing) else set())
    return max((trial.errors[name].of_range for name in wanted if name not in left_out), default=0.0)


def _slight(trial: Trial) -> set[str]:
    """The positions that move by no more than deflections do, and ring as these."""
    result, size = trial.result, natural_units(trial.result)("m")
    points = (name for name in trial.errors if PLACES.search(name) and result.quantities[name].unit == "m")
    return {name for name in points if range_of(result[name]) <= SLIGHT * size}
