"""A run and the others that tell its errors: its twin, and runs with other steps."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from ffr_dyn.analyses.events import doubts, with_errors
from ffr_dyn.analyses.integration import LOOKS, evaluation_cost
from ffr_dyn.analyses.trials.faded import without_faded
from ffr_dyn.analyses.trials.runs import Runs, has_failed
from ffr_dyn.consistency.assemble import Assembled
from ffr_dyn.consistency.step_error import (
    BEYOND,
    KINKED,
    OVER_BREAKS,
    PARTLY_STIFF,
    Beside,
    StepError,
    begins_alone,
    larger,
    on_shared_rows,
    order_shown,
    step_errors,
    with_start,
)
from ffr_dyn.consistency.unresolved import lasting
from ffr_dyn.functions.together import Say
from ffr_dyn.integrators import Integrator
from ffr_dyn.integrators.ros2 import Twin
from ffr_dyn.integrators.tolerances import tightened
from ffr_dyn.results.result import Result
from ffr_prep.common.errors import ComputationError, InputError

LEAP = {2: 16}  # times more in the next one at most, by order (others: 8): an earlier trial tells the error of the next
FEW = 16  # steps in the time for which a stop is met, with fewer of which errors do not fall by the order yet
UNTOLD = (
    "the runs that would tell the error of the steps have failed, or have no two rows in common with this one; take a "
    "smaller step"
)
SURE = 2  # order that linearly implicit methods keep where elastic forces are stiff


def leap_of(method: Integrator) -> int:
    return LEAP.get(method.order, 8)


@dataclass(frozen=True)
class Trial:
    """A run and what tells its error; no errors where nobody asked or the runs that would tell them failed."""

    method: Integrator
    count: int  # steps to an output row
    result: Result
    twins: tuple[Beside, ...] = ()
    errors: Mapping[str, StepError] = field(default_factory=dict)
    events: Sequence[Mapping[str, Any]] = ()  # with their errors, and notes on them
    doubts: Sequence[str] = ()


def checked(runs: Runs, method: Integrator, count: int, kept: Mapping[str, Any], result: Result | None = None) -> Trial:
    """A run, unless it is there already, with all that tells its errors."""
    trial, more = beside_twin(runs, method, count, kept, result, further_runs(runs, method, count))
    return with_its_errors(runs, trial, *more)


def beside_twin(
    runs: Runs,
    method: Integrator,
    count: int,
    kept: Mapping[str, Any],
    result: Result | None = None,
    more: Sequence[Callable[[Say], Any]] = (),
) -> tuple[Trial, list[Any]]:
    """A run, unless it is there already, beside its twin, with what that tells of its errors; and what `more` returned.

    Raises what the run itself raises; where the twin fails there are no errors.
    """
    twin = [] if (share := twin_share(method)) is None else [lambda say: _twin(runs, method, share, say)]
    own = [] if result is not None else [lambda say: runs.run(method, **kept, progress=say)]
    outcomes = runs.together([*own, *twin, *more], leader=result is None)
    result = outcomes.pop(0) if result is None else result
    found, others = outcomes[: len(twin)], outcomes[len(twin) :]
    if not found or has_failed(found[0]):
        return Trial(method, count, result), others
    return Trial(method, count, result, tuple(found), _errors(result, None, SURE, found)), others


def _errors(result: Result, other: Beside | None, order: float, twins: Sequence[Beside]) -> dict[str, StepError]:
    """`step_errors` by the rows that all runs share; none where these are too few."""
    beside = [*([] if other is None else [other]), *twins]
    run, *others = on_shared_rows([result, *(one.result for one in beside)])
    if run.time.size < 2:
        return {}
    told = [Beside(rows, one.ratio) for rows, one in zip(others, beside, strict=True)]
    return step_errors(run, None, order, told) if other is None else step_errors(run, told[0], order, told[1:])


def with_its_errors(runs: Runs, trial: Trial, other: Any, *longer: Any) -> Trial:
    """The run with its errors, also by what `further_runs` returned."""
    untold = (UNTOLD,) if trial.result.time.size > 1 else ()
    if has_failed(other):
        return replace(trial, errors={}, doubts=untold)
    share, failed = twin_share(trial.method), any(isinstance(twin, ComputationError) for twin in longer)
    too_long = failed or (share is not None and not trial.twins)  # steps for an order, where twins fail
    order = 1 if too_long else PARTLY_STIFF if share == 0.5 else trial.method.order
    if trial.method.step * FEW > trial.result.attributes.get("meeting", math.inf):
        order = min(order, KINKED)
    if runs.untold:
        order = OVER_BREAKS if trial.method.order == 3 else 1
    twins = (*trial.twins, *(twin for twin in longer if not has_failed(twin)))
    if runs.order_unsure:
        errors, order = _by_shown_order(runs, trial, other, order, twins)
    else:
        errors = _errors(trial.result, other, order, twins)
    start = _start(runs, trial.method, trial.result, trial.twins[0]) if trial.twins else ()
    errors = with_start(errors, trial.result, *start) if start else errors
    errors = without_faded(errors, trial.result, other, runs)
    if not errors:
        return replace(trial, twins=twins, errors={}, doubts=untold)
    return replace(trial, twins=twins, errors=errors, **_moments(trial, errors, other, order, twins))


def _by_shown_order(
    runs: Runs, trial: Trial, other: Beside, order: float, twins: Sequence[Beside]
) -> tuple[dict[str, StepError], float]:
    """Errors, and the order that is shown by a third run, where the method may lose its own."""
    farther = _farther(runs, trial.method, trial.count)
    shown = min(order, order_shown(trial.result, other, farther, order))
    errors = _errors(trial.result, other, shown, twins)
    if farther is None or not runs.feels:
        return errors, shown
    return larger(errors, _errors(trial.result, farther, shown, ())), shown


def _moments(
    trial: Trial, errors: Mapping[str, StepError], other: Beside, order: float, twins: Sequence[Beside]
) -> dict[str, Any]:
    """The events of a run with their errors, if it has looked for any, and doubts about them."""
    if "events" not in trial.result.attributes:
        return {}
    events = with_errors(trial.result, errors, other, order, twins, between=trial.method.controlled)
    further = [one.result for one in (other, *twins)]
    return {"events": events, "doubts": doubts(events, float(trial.result.time[-1]), further)}


def further_runs(
    runs: Runs, method: Any, count: int, earlier: Sequence[Trial] = ()
) -> list[Callable[[Say], Beside | None]]:
    """The further runs that tell the error of a run beside its twin: one with another step, and, beside a twin of half the
    step, one with a longer step; those of the last trial if its step is not too far."""
    far = 2 if runs.sudden else leap_of(method)
    near = next((one for one in reversed(earlier) if one.twins and count <= far * one.count), None)
    if near is not None:
        ratio = count / near.count
        known = [Beside(near.result, ratio), *(Beside(one.result, ratio * one.ratio) for one in near.twins[:1])]
        return [lambda say, one=one: one for one in known[: 1 if twin_share(method) == 1.0 else 2]]  # type: ignore[misc]
    others: list[Callable[[Say], Beside | None]] = [lambda say: _other(runs, method, count, say)]
    return [*others, lambda say: _longer_twin(runs, method, count, say)] if twin_share(method) == 0.5 else others


def _other(runs: Runs, method: Any, count: int, say: Say) -> Beside:
    """The run with another step: about twice the step, or four times of a method of higher order unless forces change within
    steps, where elastic forces are implicit and that is part of a row, else half of it; with a tenth of the tolerances of a
    method that chooses its steps, and work added up twice as often."""
    if method.controlled:
        finer = replace(method, tolerances=tightened(method.tolerances, 10))
        return Beside(runs.run(finer, progress=say, looks=2 * LOOKS), 10.0 ** (-1.0 / method.order))
    if method.implicit and count > 1:
        fewer = -(-count // (4 if method.order > SURE and not runs.sudden else 2))
        try:
            return Beside(runs.run(replace(method, step=runs.output_step / fewer), progress=say), count / fewer)
        except ComputationError:
            pass  # half the step is sure to run
    return Beside(runs.run(replace(method, step=runs.output_step / (2 * count)), progress=say), 0.5)


def _farther(runs: Runs, method: Any, count: int) -> Beside | None:
    """The run with about four times the step, of explicit methods twice, that tells with `_other` what order it keeps; None
    where a row is not so long, such steps fail, or the method chooses its own."""
    fewer = -(-count // (4 if method.implicit else 2))
    if not 1 <= fewer <= count // 2:
        return None
    try:
        return Beside(runs.run(replace(method, step=runs.output_step / fewer)), count / fewer)
    except (ComputationError, InputError):  # of an explicit step that is too long
        return None


def twin_share(method: Integrator) -> float | None:
    """Of the step, which the twin of a run has; None of methods that damp nothing the step allows."""
    if not method.implicit or method.controlled:
        return None
    return 1.0 if method.order <= SURE else 0.5


def _twin(runs: Runs, method: Integrator, share: float, say: Say) -> Beside:
    """With a share of the step, and the damping of the scene over that."""
    step = share * method.step
    return Beside(runs.run(Twin(step, lasting(runs.vibrations, step)), progress=say), share)


def _start(runs: Runs, method: Integrator, result: Result, twin: Beside) -> tuple[Result, ...]:
    """The steps to the first row and a little beyond as rows, and those of a twin with half the twin's step, where what
    vibrates then is gone soon; () elsewhere, and where they fail."""
    if not begins_alone(*on_shared_rows([result, twin.result])):
        return ()
    count = round(runs.output_step / method.step)
    steps = min(count + math.ceil(BEYOND * count), round((runs.how["end"] - runs.start) / method.step))
    share = 0.5 * twin.ratio * method.step
    fine = Twin(share, lasting(runs.vibrations, share))
    span = {"output_step": method.step, "end": runs.start + steps * method.step, "progress": None, "events": ()}
    try:
        return runs.run(method, **span), runs.run(fine, **span)
    except (ComputationError, InputError):  # the latter where steps are rounding beside the time of the start
        return ()


def _longer_twin(runs: Runs, method: Integrator, count: int, say: Say) -> Beside | None:
    """With about twice the step, so many of which are a row; None where a row is one step already."""
    return _twin(runs, method, count / -(-count // 2), say) if count > 1 else None


def cost_of_errors(assembled: Assembled, result: Result) -> float:
    """[us], about, of the runs that tell the error of a run; the same on every machine."""
    return 2.0 * result.attributes["evaluations"] * evaluation_cost(assembled.system.scene)
