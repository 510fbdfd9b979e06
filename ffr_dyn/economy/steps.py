"""The integrator and step that keep the error of time discretisation below a limit at the least cost.

The model's coarse run is there already. Two stages instead of four are tried first: where their difference is small they are
enough. Next a run with twice the step, or half of it, tells the error of the coarse one with its sign,
y(h) - y = (y(2h) - y(h)) / (2^p - 1), and the orders predict the step that each method needs; the cheapest is run with it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ffr_dyn.economy.choice import Choice, rigid
from ffr_dyn.economy.cost import STAGES, per_row
from ffr_dyn.economy.ledger import Ledger
from ffr_dyn.economy.outputs import difference, largest
from ffr_dyn.economy.trial import Span, Trial, cost
from ffr_dyn.errors import InputError, SimulationError
from ffr_dyn.integrators import CONTROLLED, METHODS, Integrator

Array = np.ndarray
Histories = tuple[Array, ...]

TWO_STAGES, EXPLICIT = "ros2", "rk4"
SURELY = 0.5  # of the limit: the difference of two coarse runs of different order that is taken for the error of one
NEARLY = 0.8  # of the limit: an estimate from a run with steps over two rows
FAR = 0.1  # of the limit: steps longer than a row would do
ACCURACIES = (1e-2, 1e-3)
WORTH = 0.8  # of the cost: a method that chooses its steps pays
MOST = 4096  # divisions of an output step
ATTEMPTS = 6
MARGIN = 1.1  # on a predicted number of divisions
ONCE = 0.6  # a shorter run pays when it needs less than this share of the divisions
NEAR = (1.25, 3.0)  # ratios of the steps of two runs whose difference tells their errors


@dataclass(frozen=True)
class Stepped:
    """A run with a step that is fine enough.

    error : per output (T, k), the estimated error of time discretisation, with its sign
    """

    trial: Trial
    error: Histories


def methods(span: Span) -> tuple[str, ...]:
    """Names of the methods that take a step, and a known number of evaluations for it."""
    return tuple(name for name, made in METHODS.items() if name in STAGES and _takes_a_step(made, span.output_step))


def _takes_a_step(made: Callable[[float], Integrator], step: float) -> bool:
    try:
        return made(step).step == step
    except (TypeError, AttributeError, InputError):
        return False


def chosen_step(ledger: Ledger, choice: Choice, limit: Array) -> Stepped:
    """The cheapest method and step for a model with errors below `limit` (outputs,) from discretisation.

    choice : the model with the longest step that completes a run, by a method of the third order

    Raises SimulationError when none is found.
    """
    ledger.tell("integrator and step")
    found = _two_stages(ledger, choice, limit)
    if found is None:
        coarse = ledger.run(choice)
        error = _coarse_error(ledger, coarse, limit)
        found = Stepped(coarse, error) if share(error, limit) <= 1 else _finer(ledger, coarse, error, limit)
    return _longer(ledger, found, limit)


# ---- a coarse step that will do ---------------------------------------------------------------------------------------


def _two_stages(ledger: Ledger, choice: Choice, limit: Array) -> Stepped | None:
    """The run of two stages with the coarse step, where that is enough; tried with rigid bodies first, which cost little."""
    stiff = rigid(replace(choice, method=TWO_STAGES))
    trial = ledger.runs.get(stiff)
    if trial is not None:
        error = _from_two_rows(ledger, trial)
        if error is None or share(error, limit) > 1:
            return None
        if stiff.parts == choice.parts:
            return Stepped(trial, error)
    trial = _attempt(ledger, replace(choice, method=TWO_STAGES))
    if trial is None:
        return None
    error = difference(trial.values, ledger.run(choice).values)
    return Stepped(trial, error) if share(error, SURELY * limit) <= 1 else None


def _coarse_error(ledger: Ledger, coarse: Trial, limit: Array) -> Histories:
    """The error of the coarse run: from steps over two rows where that shows it to be small, or else from half the step."""
    error = _from_two_rows(ledger, coarse)
    if error is not None and share(error, NEARLY * limit) <= 1:
        return error
    return signed(coarse, ledger.run(replace(coarse.choice, divisions=2 * coarse.choice.divisions)))


def _from_two_rows(ledger: Ledger, trial: Trial) -> Histories | None:
    """The error of a run with one step to a row, from one with steps over two rows; None where that does not complete."""
    if trial.choice.divisions != 1:
        return None
    try:
        wide = ledger.over_two_rows(trial.choice)
    except (SimulationError, InputError):
        return None
    if wide is None:
        return None
    gain = 2.0 ** order(trial) - 1
    return tuple(_on_all_rows((w - v[::2]) / gain) for w, v in zip(wide.values, trial.values, strict=True))


def _on_all_rows(values: Array) -> Array:
    """(2 T - 1, k) with means between the rows of (T, k)."""
    found = np.empty((2 * len(values) - 1, values.shape[1]))
    found[::2] = values
    found[1::2] = 0.5 * (values[1:] + values[:-1])
    return found


# ---- a finer step -----------------------------------------------------------------------------------------------------


def _finer(ledger: Ledger, coarse: Trial, error: Histories, limit: Array) -> Stepped:
    """The cheaper of the methods by what they are predicted to need, run with that."""
    needed = _needed(coarse, share(error, limit))
    truth = difference(coarse.values, error)
    offers = [(per_row(replace(coarse.choice, divisions=needed)), coarse.choice.method, needed)]
    for name in (EXPLICIT, TWO_STAGES):
        trial = _attempt(ledger, replace(coarse.choice, method=name)) if name in methods(ledger.span) else None
        if trial is not None and cost(trial, ledger.span) < offers[0][0] * ledger.span.rows:
            divisions = _needed(trial, share(difference(trial.values, truth), limit))
            offers.append((per_row(replace(trial.choice, divisions=divisions)), name, divisions))
    failed: Exception | None = None
    for _, name, divisions in sorted(offers):
        try:
            return _refined(ledger, replace(coarse.choice, method=name), divisions, limit)
        except (SimulationError, InputError) as problem:
            failed = problem
    raise SimulationError(
        f"no integrator reaches the tolerance with steps down to 1/{MOST} of the output step; {failed}"
    )


def _refined(ledger: Ledger, choice: Choice, needed: int, limit: Array) -> Stepped:
    """Runs of one method, each with the step that the one before predicts, until the limit holds and no longer one does."""
    best: Stepped | None = None
    for _ in range(ATTEMPTS):
        trial = ledger.run(replace(choice, divisions=needed))
        error = measured(ledger, trial)
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


def measured(ledger: Ledger, trial: Trial) -> Histories:
    """The error of a run, from one of the same method with a step near: one that is there, or twice the step."""
    same = [
        other
        for other in ledger.runs.values()
        if replace(other.choice, divisions=trial.choice.divisions) == trial.choice and not trial.choice.controlled
    ]
    ratios = [trial.choice.divisions / other.choice.divisions for other in same]
    near = [other for other, ratio in zip(same, ratios, strict=True) if NEAR[0] <= max(ratio, 1 / ratio) <= NEAR[1]]
    if near:
        return signed(trial, max(near, key=lambda other: other.choice.divisions))
    if trial.choice.divisions > 1:
        half = _attempt(ledger, replace(trial.choice, divisions=(trial.choice.divisions + 1) // 2))
        if half is not None:
            return error_of(trial, half)
    error = _from_two_rows(ledger, trial)
    if error is not None:
        return error
    return signed(trial, ledger.run(replace(trial.choice, divisions=2 * trial.choice.divisions)))


# ---- steps that the method chooses ------------------------------------------------------------------------------------


def _longer(ledger: Ledger, fixed: Stepped, limit: Array) -> Stepped:
    """The run of a method that chooses its steps, where steps longer than an output row would do and that is cheaper."""
    if fixed.trial.choice.divisions > 1 or share(fixed.error, FAR * limit) > 1:
        return fixed
    best, truth = fixed, difference(fixed.trial.values, fixed.error)
    for name in CONTROLLED:
        choice = replace(fixed.trial.choice, method=name, divisions=1, accuracy=ACCURACIES[0])
        if ledger.first_part(choice) < cost(best.trial, ledger.span):
            found = _controlled(ledger, choice, truth, limit, best)
            best = best if found is None else found
    return best


def _controlled(ledger: Ledger, choice: Choice, truth: Histories, limit: Array, best: Stepped) -> Stepped | None:
    """The first accuracy of a method that meets the limit, while its runs are cheaper than the best one."""
    for accuracy in ACCURACIES:
        trial = _attempt(ledger, replace(choice, accuracy=accuracy))
        if trial is None:
            continue
        if cost(trial, ledger.span) > WORTH * cost(best.trial, ledger.span):
            return None
        error = difference(trial.values, truth)
        if share(error, limit) <= 1:
            return Stepped(trial, error)
    return None


# ---- orders -----------------------------------------------------------------------------------------------------------


def _attempt(ledger: Ledger, choice: Choice) -> Trial | None:
    try:
        return ledger.run(choice)
    except (SimulationError, InputError):
        return None


def order(trial: Trial) -> int:
    """Order of the method of a run."""
    method: Any = METHODS[trial.choice.method]
    return int(method.order)


def error_of(fine: Trial, coarse: Trial) -> Histories:
    """(T, k) per output: the signed error of the finer of two runs of one method."""
    ratio = fine.choice.divisions / coarse.choice.divisions
    return tuple(d / (ratio ** order(fine) - 1) for d in difference(coarse.values, fine.values))


def signed(trial: Trial, other: Trial) -> Histories:
    """The error of `trial`, from a run of the same method with a shorter or a longer step."""
    if other.choice.divisions < trial.choice.divisions:
        return error_of(trial, other)
    gain = (other.choice.divisions / trial.choice.divisions) ** order(trial)
    return tuple(gain * e for e in error_of(other, trial))


def share(error: Histories, limit: Array) -> float:
    """Largest error in units of its limit."""
    return float((largest(error) / limit).max(initial=0.0))


def _needed(trial: Trial, error: float) -> int:
    """Divisions for an error of one, from a run with that `error`."""
    return int(np.clip(np.ceil(trial.choice.divisions * error ** (1 / order(trial)) * (1 - 1e-9)), 1, MOST))
