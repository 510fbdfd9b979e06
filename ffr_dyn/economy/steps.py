"""The integrator and step that keep the error of time discretisation below a limit at the least cost.

The model's coarse run is there already. One with twice the step, or half of it, tells its error with its sign,
y(h) - y = (y(2h) - y(h)) / (2^p - 1). Two stages instead of four are tried where that is small: where they differ little
they are enough. Where the coarse step is not, the orders predict the one that each method needs; the cheapest is run with it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ffr_dyn.consistency.step_error import FAR
from ffr_dyn.economy.cache import Ledger
from ffr_dyn.economy.cost import STAGES
from ffr_dyn.economy.model_choice import Choice
from ffr_dyn.economy.outputs import difference, largest, ranges
from ffr_dyn.economy.policy import DEFAULT, Policy
from ffr_dyn.economy.rigid_start import least
from ffr_dyn.economy.run import Span, Trial, rings
from ffr_dyn.integrators import CONTROLLED, METHODS, RK4, Integrator
from ffr_dyn.scene.force_kinds import forces_of
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError, InputError

Histories = tuple[Array, ...]

TWO_STAGES, EXPLICIT = "ros2", "rk4"


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

    Raises ComputationError when none is found.
    """
    ledger.tell("integrator and step")
    found = _rigid_in_two_stages(ledger, choice, limit)
    if found is None:
        coarse = least(ledger.run, choice, choice.divisions, ledger.policy)
        found = _coarse(ledger, coarse, limit) or _finer(ledger, coarse, limit)
    return _longer(ledger, found, limit)


# ---- a coarse step that will do ---------------------------------------------------------------------------------------


def _rigid_in_two_stages(ledger: Ledger, choice: Choice, limit: Array) -> Stepped | None:
    """The coarse run of rigid bodies with two stages, of which steps over two rows are there already, where it is good
    enough."""
    if choice.count:
        return None
    trial = _attempt(ledger, replace(choice, method=TWO_STAGES))
    error = None if trial is None else _from_two_rows(ledger, trial)
    return None if trial is None or error is None or share(error, limit) > 1 else Stepped(trial, error)


def _coarse(ledger: Ledger, coarse: Trial, limit: Array) -> Stepped | None:
    """The coarse run, or one of two stages, where steps over two rows show that this is enough."""
    simple = replace(coarse.choice, method=TWO_STAGES)
    found = _of_both(ledger.runs[simple], coarse, limit, ledger.policy) if simple in ledger.runs else None
    if found is not None or _far_off(ledger, coarse, limit):
        return found
    error = _from_two_rows(ledger, coarse)
    if error is None or share(error, ledger.policy.wide_step_share * limit) > 1:
        return None
    if share(error, ledger.policy.far_below * limit) > 1 or simple in ledger.runs:
        return Stepped(coarse, error)
    trial = _attempt(ledger, simple)
    return (None if trial is None else _of_both(trial, coarse, limit, ledger.policy)) or Stepped(coarse, error)


def _of_both(simple: Trial, coarse: Trial, limit: Array, policy: Policy = DEFAULT) -> Stepped | None:
    """Two stages, where their difference from four is small. Where something rings, steps over two rows do not tell what
    the step does to that: four stages are taken for the error of two then."""
    off = difference(simple.values, coarse.values)
    if share(off, (policy.agreement_ringing if rings(coarse) else policy.agreement) * limit) <= 1:
        return Stepped(simple, off)
    return Stepped(coarse, off) if rings(coarse) and share(off, limit) <= 1 else None


def _far_off(ledger: Ledger, coarse: Trial, limit: Array) -> bool:
    """Whether two stages, of this model or one of fewer modes, are so far from four that these will not do either."""
    return any(
        share(difference(trial.values, coarse.values), limit) > ledger.policy.hopeless
        for choice, trial in ledger.runs.items()
        if choice.method == TWO_STAGES and choice.count
    )


def _from_two_rows(ledger: Ledger, trial: Trial) -> Histories | None:
    """The error of a run with one step to a row, from one with steps over two rows; None where that does not complete."""
    if trial.choice.divisions != 1:
        return None
    try:
        wide = ledger.over_two_rows(trial.choice)
    except (ComputationError, InputError):
        return None
    if wide is None:
        return None
    off = tuple(w - v[::2] for w, v in zip(wide.values, trial.values, strict=True))
    orders = _orders(trial, off)
    return tuple(_on_all_rows(d / (2.0**p - 1)) for d, p in zip(off, orders, strict=True))


def _on_all_rows(values: Array) -> Array:
    """(2 T - 1, k) with means between the rows of (T, k)."""
    found = np.empty((2 * len(values) - 1, values.shape[1]))
    found[::2] = values
    found[1::2] = 0.5 * (values[1:] + values[:-1])
    return found


# ---- a finer step -----------------------------------------------------------------------------------------------------


def _finer(ledger: Ledger, coarse: Trial, limit: Array) -> Stepped:
    """The cheaper of the methods by what they are predicted to need, run with that, where the coarse run does not do."""
    error = None if _far_off(ledger, coarse, limit) else _from_two_rows(ledger, coarse)
    if error is None:
        error = signed(coarse, _shorter(ledger, coarse.choice))
        if share(error, limit) <= 1:
            return Stepped(coarse, error)
    now = share(error, limit)
    needed = {coarse.choice.method: _needed(coarse, max(now, 1.0), ledger.policy)}
    most = ledger.cost_of(replace(coarse.choice, divisions=needed[coarse.choice.method]))
    explicit = replace(coarse.choice, method=EXPLICIT)
    if EXPLICIT in methods(ledger.span) and ledger.cost_of(explicit) <= most:
        trial = _attempt(ledger, explicit)
        if trial is not None:
            truth = difference(coarse.values, error)
            needed[EXPLICIT] = _needed(trial, share(difference(trial.values, truth), limit), ledger.policy)
    return _cheapest(ledger, coarse, needed, limit, now)


def _cheapest(ledger: Ledger, coarse: Trial, needed: dict[str, int], limit: Array, now: float) -> Stepped:
    """A run within the limit, of the method that costs least by the divisions that each is predicted to need; `now` is the
    error of the coarse run in limits.

    Every run corrects the prediction for its method. Far predictions are approached in rungs, each of which tells the error
    of the next.
    """
    choice, policy = coarse.choice, ledger.policy
    before = {choice.method: (choice.divisions, now)}
    best: Stepped | None = None
    for _ in range(policy.step_attempts):
        name = min(
            needed, key=lambda name: (ledger.cost_of(replace(choice, method=name, divisions=needed[name])), name)
        )
        divisions = _rung(ledger, replace(choice, method=name), needed[name])
        trial = _attempt(ledger, replace(choice, method=name, divisions=divisions))
        if trial is None:
            needed[name] = min(policy.most_divisions, 2 * divisions)
            continue
        error = measured(ledger, trial)
        now = share(error, limit)
        if now <= 1 and (best is None or ledger.cost(trial) < ledger.cost(best.trial)):
            best = Stepped(trial, error)
        power = 1 / _seen_order(trial, now, before.get(name))
        before[name] = divisions, now
        better = int(np.ceil(divisions * (now * (policy.error_margin if now > 1 else 1.0)) ** power))
        if best is not None and (now > 1 or better >= policy.fewer_divisions * divisions or divisions == 1):
            return best
        needed[name] = int(np.clip(better if better != divisions else divisions + 1, 1, policy.most_divisions))
    if best is None:
        raise ComputationError(
            f"no integrator reaches the tolerance with steps down to 1/{policy.most_divisions} of the output step: errors "
            f"stay above their limits with {max(needed.values())} steps from row to row; allow a larger "
            "tolerance, or take a shorter output_step"
        )
    return best


def _rung(ledger: Ledger, choice: Choice, needed: int) -> int:
    """The divisions of the next run towards those needed."""
    there = [one.divisions for one in ledger.runs if replace(one, divisions=choice.divisions) == choice]
    finest = max((d for d in there if d < needed), default=needed)
    return needed if needed <= ledger.policy.farthest_step * finest else int(np.ceil(ledger.policy.rung * finest))


def _seen_order(trial: Trial, error: float, before: tuple[int, float] | None) -> float:
    """The order with which the error falls from the last run to this one, at most that of the method."""
    if before is None or before[0] >= trial.choice.divisions or not 0 < error < before[1]:
        return float(order(trial))
    seen = np.log(before[1] / error) / np.log(trial.choice.divisions / before[0])
    return float(np.clip(seen, 2.0, order(trial)))


def measured(ledger: Ledger, trial: Trial) -> Histories:
    """The error of a run, from one of the same method with a step near: one that is there, or twice the step."""
    same = [
        other
        for other in ledger.runs.values()
        if replace(other.choice, divisions=trial.choice.divisions) == trial.choice and not trial.choice.controlled
    ]
    ratios = [trial.choice.divisions / other.choice.divisions for other in same]
    least, most = ledger.policy.nearest_step, ledger.policy.farthest_step
    near = [other for other, ratio in zip(same, ratios, strict=True) if least <= max(ratio, 1 / ratio) <= most]
    if near:
        return signed(trial, max(near, key=lambda other: other.choice.divisions))
    if trial.choice.divisions > 1:
        half = _attempt(ledger, replace(trial.choice, divisions=(trial.choice.divisions + 1) // 2))
        if half is not None:
            return error_of(trial, half)
    error = _from_two_rows(ledger, trial)
    if error is not None:
        return error
    return signed(trial, _shorter(ledger, trial.choice))


# ---- steps that the method chooses ------------------------------------------------------------------------------------


def _longer(ledger: Ledger, fixed: Stepped, limit: Array) -> Stepped:
    """The run of a method that chooses its steps, where steps longer than an output row would do and that is cheaper."""
    if fixed.trial.choice.divisions > 1 or share(fixed.error, ledger.policy.far_below * limit) > 1:
        return fixed
    best, truth = fixed, difference(fixed.trial.values, fixed.error)
    for name in CONTROLLED:
        if not (CONTROLLED[name].implicit or _is_soft(ledger, fixed.trial)):
            continue
        choice = replace(fixed.trial.choice, method=name, divisions=1, accuracy=ledger.policy.accuracies[0])
        if ledger.first_part(choice) < ledger.cost(best.trial):
            found = _controlled(ledger, choice, truth, limit, best)
            best = best if found is None else found
    return best


def _is_soft(ledger: Ledger, trial: Trial) -> bool:
    """Whether an explicit method is stable with a step of a row."""
    omega2 = max(body.model.omega2.max(initial=0.0) for body in trial.scene.bodies)
    return bool(np.sqrt(omega2) * ledger.span.output_step <= RK4.reach)


def _controlled(ledger: Ledger, choice: Choice, truth: Histories, limit: Array, best: Stepped) -> Stepped | None:
    """The first accuracy of a method that meets the limit, while its runs are cheaper than the best one."""
    for accuracy in ledger.policy.accuracies:
        trial = _attempt(ledger, replace(choice, accuracy=accuracy))
        if trial is None:
            continue
        if ledger.cost(trial) > ledger.policy.controlled_gain * ledger.cost(best.trial):
            return None
        error = difference(trial.values, truth)
        if share(error, limit) <= 1:
            return Stepped(trial, error)
    return None


# ---- orders -----------------------------------------------------------------------------------------------------------


def _attempt(ledger: Ledger, choice: Choice) -> Trial | None:
    try:
        return ledger.run(choice)
    except (ComputationError, InputError):
        return None


def _shorter(ledger: Ledger, choice: Choice) -> Trial:
    """A run with half the step, or the longest below that which completes one, as between impacts on stops."""
    return least(ledger.run, choice, 2 * choice.divisions, ledger.policy)


def order(trial: Trial) -> int:
    """Order of the method of a run."""
    return order_of(trial.choice)


def order_of(choice: Choice) -> int:
    """Order of the method of a model."""
    method: Any = METHODS[choice.method]
    return int(method.order)


def error_of(fine: Trial, coarse: Trial) -> Histories:
    """(T, k) per output: the signed error of the finer of two runs of one method."""
    ratio, off = fine.choice.divisions / coarse.choice.divisions, difference(coarse.values, fine.values)
    return tuple(d / (ratio**p - 1) for d, p in zip(off, _orders(fine, off), strict=True))


def _orders(trial: Trial, off: Histories) -> list[int]:
    """The order of the method, for each output; 1 where two steps are so far apart that none has set in, as after an impact
    that they jump over (`ffr_dyn.consistency.step_error`), and where the motion may change a force within a step: how much
    of the step is before an impact is chance."""
    apart, sizes = largest(off), ranges(trial.values)
    if any(force.sudden for force in forces_of(trial.scene)):
        return [1] * len(sizes)
    return [1 if far > FAR * size > 0 else order(trial) for far, size in zip(apart, sizes, strict=True)]


def signed(trial: Trial, other: Trial) -> Histories:
    """The error of `trial`, from a run of the same method with a shorter or a longer step."""
    if other.choice.divisions < trial.choice.divisions:
        return error_of(trial, other)
    ratio = other.choice.divisions / trial.choice.divisions
    orders = _orders(other, difference(trial.values, other.values))
    return tuple(ratio**p * e for p, e in zip(orders, error_of(other, trial), strict=True))


def share(error: Histories, limit: Array) -> float:
    """Largest error in units of its limit."""
    return float((largest(error) / limit).max(initial=0.0))


def _needed(trial: Trial, error: float, policy: Policy) -> int:
    """Divisions for an error of one, with a margin, from a run with that `error`."""
    error = policy.error_margin * error
    return int(
        np.clip(np.ceil(trial.choice.divisions * error ** (1 / order(trial)) * (1 - 1e-9)), 1, policy.most_divisions)
    )
