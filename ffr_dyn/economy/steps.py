"""The integrator and step that keep the error of time discretisation below a limit at the least cost.

One sharp run, of the most accurate method at half the coarse step, tells the error of every method at the coarse step; the
orders predict the step that each needs. The cheapest is run with that step and with one about twice as long, which gives the
error with its sign:  y(h) - y = (y(2h) - y(h)) / (2^p - 1).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ffr_dyn.economy.choice import Choice
from ffr_dyn.economy.cost import STAGES, per_row, stages
from ffr_dyn.economy.outputs import difference, largest
from ffr_dyn.economy.trial import Span, Trial, cost
from ffr_dyn.errors import InputError, SimulationError
from ffr_dyn.integrators import CONTROLLED, METHODS, Integrator

Array = np.ndarray
Run = Callable[[Choice], Trial]

SHORT = 1  # steps to a row: with more, steps longer than a row would not do
ACCURACIES = (1e-2, 1e-3, 1e-4, 1e-5)
WORTH = 0.8  # of the cost: a method that chooses its steps pays
MOST = 4096  # divisions of an output step
ATTEMPTS = 6
MARGIN = 1.1  # on a predicted number of divisions
ONCE = 0.75  # a shorter run pays when it needs less than this share of the divisions


@dataclass(frozen=True)
class Stepped:
    """A run with a step that is fine enough.

    error : per output (T, k), the estimated error of time discretisation, with its sign
    """

    trial: Trial
    error: tuple[Array, ...]


def methods(span: Span) -> tuple[str, ...]:
    """Names of the methods that take a step, and a known number of evaluations for it."""
    return tuple(name for name, made in METHODS.items() if name in STAGES and _takes_a_step(made, span.output_step))


def _takes_a_step(made: Callable[[float], Integrator], step: float) -> bool:
    try:
        return made(step).step == step
    except (TypeError, AttributeError, InputError):
        return False


def least(run: Run, choice: Choice, divisions: int) -> Trial:
    """The run with the fewest divisions, from `divisions` up by doubling, with which it comes to an end."""
    failed: Exception | None = None
    while divisions <= MOST:
        try:
            return run(replace(choice, divisions=divisions))
        except (SimulationError, InputError) as error:
            failed, divisions = error, 2 * divisions
    raise SimulationError(f"no step down to 1/{MOST} of the output step completes a run: {failed}")


def chosen_step(run: Run, choice: Choice, limit: Array, span: Span) -> Stepped:
    """The cheapest method and step for a model with errors below `limit` (outputs,) from discretisation.

    choice : the model with the longest step that completes a run

    Raises SimulationError when none is found.
    """
    sharp = run(replace(choice, method=_sharpest(span), divisions=2 * choice.divisions))
    offers: list[tuple[float, str, int]] = []
    for name in sorted(methods(span), key=lambda name: (stages(name), name)):
        offers += _offer(run, replace(choice, method=name), sharp, limit, min(offers, default=(np.inf,))[0])
    failed: Exception | None = None
    for _, name, needed in sorted(offers)[:2]:
        try:
            return _longer(run, _refined(run, replace(choice, method=name), needed, sharp, limit), limit, span)
        except SimulationError as error:
            failed = error
    raise SimulationError(
        f"no integrator reaches the tolerance with steps down to 1/{MOST} of the output step; {failed}"
    )


def _sharpest(span: Span) -> str:
    """The implicit method of the highest order."""
    return max((int(_class(name).order), name) for name in methods(span) if _class(name).implicit)[1]


def _class(name: str) -> Any:
    return METHODS[name]


def _offer(run: Run, choice: Choice, sharp: Trial, limit: Array, least_cost: float) -> list[tuple[float, str, int]]:
    """(cost, method, divisions) that a method is predicted to need; nothing where it cannot be the cheapest or fails."""
    if per_row(choice) >= least_cost:
        return []
    try:
        coarse = run(choice)
    except (SimulationError, InputError):
        return []
    error = difference(coarse.values, sharp.values)
    if choice.method == sharp.choice.method:
        error = _signed(coarse, sharp)
    needed = _needed(coarse, share(error, limit))
    return [(per_row(replace(choice, divisions=needed)), choice.method, needed)]


def order(trial: Trial) -> int:
    """Order of the method of a run."""
    return int(_class(trial.choice.method).order)


def error_of(fine: Trial, coarse: Trial) -> tuple[Array, ...]:
    """(T, k) per output: the signed error of the finer of two runs of one method."""
    ratio = fine.choice.divisions / coarse.choice.divisions
    return tuple(d / (ratio ** order(fine) - 1) for d in difference(coarse.values, fine.values))


def share(error: tuple[Array, ...], limit: Array) -> float:
    """Largest error in units of its limit."""
    return float((largest(error) / limit).max(initial=0.0))


def _needed(trial: Trial, error: float) -> int:
    """Divisions for an error of one, from a run with that `error`."""
    return int(np.clip(np.ceil(trial.choice.divisions * error ** (1 / order(trial)) * (1 - 1e-9)), 1, MOST))


def _signed(trial: Trial, other: Trial) -> tuple[Array, ...]:
    """The error of `trial`, from a run of the same method with a shorter or a longer step."""
    if other.choice.divisions < trial.choice.divisions:
        return error_of(trial, other)
    gain = (other.choice.divisions / trial.choice.divisions) ** order(trial)
    return tuple(gain * e for e in error_of(other, trial))


def _refined(run: Run, choice: Choice, needed: int, sharp: Trial, limit: Array) -> Stepped:
    """Runs of one method, each with the step that the one before predicts, until the limit holds and no longer one does."""
    best: Stepped | None = None
    for _ in range(ATTEMPTS):
        trial = run(replace(choice, divisions=needed))
        error = _measured(run, trial, sharp)
        now = share(error, limit)
        if now <= 1 and (best is None or needed < best.trial.choice.divisions):
            best = Stepped(trial, error)
        better = int(np.ceil(needed * now ** (1 / order(trial)) * (MARGIN if now > 1 else 1.0)))
        if best is not None and (now > 1 or better >= ONCE * needed or needed == 1):
            return best
        needed = int(np.clip(better if better != needed else needed + 1, 1, MOST))
    if best is None:
        raise SimulationError(f"{choice.method}: errors stay above their limits with {needed} steps from row to row")
    return best


def _longer(run: Run, fixed: Stepped, limit: Array, span: Span) -> Stepped:
    """The run of a method that chooses its steps, where steps longer than an output row would do and that is cheaper."""
    if fixed.trial.choice.divisions > SHORT:
        return fixed
    best = fixed
    truth = difference(fixed.trial.values, fixed.error)
    for name in CONTROLLED:
        found = _controlled(run, replace(fixed.trial.choice, method=name, divisions=1), truth, limit, best, span)
        best = best if found is None else found
    return best


def _controlled(
    run: Run, choice: Choice, truth: tuple[Array, ...], limit: Array, best: Stepped, span: Span
) -> Stepped | None:
    """The first accuracy of a method that meets the limit, while its runs are cheaper than the best one."""
    for accuracy in ACCURACIES:
        try:
            trial = run(replace(choice, accuracy=accuracy))
        except (SimulationError, InputError):
            continue
        if cost(trial, span) > WORTH * cost(best.trial, span):
            return None
        error = difference(trial.values, truth)
        if share(error, limit) <= 1:
            return Stepped(trial, error)
    return None


def _measured(run: Run, trial: Trial, sharp: Trial) -> tuple[Array, ...]:
    """The error of a run: against the sharp run where that is much finer, or else against one with twice its step."""
    divisions = trial.choice.divisions
    if divisions < sharp.choice.divisions and trial.choice.method != sharp.choice.method:
        return difference(trial.values, sharp.values)
    if divisions < sharp.choice.divisions:
        return _signed(trial, sharp)
    try:
        return error_of(trial, run(replace(trial.choice, divisions=(divisions + 1) // 2)))
    except (SimulationError, InputError):
        return _signed(trial, run(replace(trial.choice, divisions=2 * divisions)))
