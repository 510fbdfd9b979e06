"""The chosen model against the full model, whose own error is known; refined until it is within its tolerances.

A reference R(h) has the error max(s, v), with the largest differences d1 of R(h) and R(2h), d2 of R(2h) and R(4h):

    s = d1 r / (1 - r),    r = d1 / d2, but no less than 2^-p,    v : beside twins (`ffr_dyn.consistency.step_error`)

Three steps tell the order that is there; the twin tells what methods that damp vibration agree on though it is wrong. An
explicit reference has none: it resolves all vibrations. The error of a model is its distance from the reference and that
error.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil

import numpy as np

from ffr_dyn.consistency.step_error import VIBRATION, largest_difference, nearest
from ffr_dyn.economy.cache import Ledger
from ffr_dyn.economy.contributions import Contributions
from ffr_dyn.economy.model_choice import Choice
from ffr_dyn.economy.outputs import difference, largest
from ffr_dyn.economy.result import Verification
from ffr_dyn.economy.rigid_start import PILOT, Ground
from ffr_dyn.economy.run import Trial
from ffr_dyn.economy.selection import Insufficient, selected_model
from ffr_dyn.economy.steps import EXPLICIT, order, order_of
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError, InputError


@dataclass(frozen=True)
class Known:
    """A run and its own error (outputs,); `cost` [us] of all runs that were made for it, by the cost model."""

    trial: Trial
    own: Array
    cost: float


def verified(
    ledger: Ledger, everything: Choice, limits: Array, final: Trial, omitted: Contributions, allowed: float
) -> tuple[Trial, Verification]:
    """The model that meets its tolerances against the reference, and their errors.

    omitted : what modes do, driven by the rigid motion, for a model that has to be chosen anew
    allowed : [us] for all references, by the cost model
    """
    first, attempts = final, 0
    reference = sharpened(
        ledger, everything, ledger.policy.reference_share * limits, 2 * final.choice.divisions, allowed
    )
    while True:
        is_known, error = _is_known(reference, final, ledger.policy.reference_share * limits), _error(final, reference)
        ledger.note(final, "verified" if is_known else "beside the full model", error)
        if (error <= limits + (0.0 if is_known else reference.own)).all():
            break
        if attempts + 1 == ledger.policy.verification_attempts:
            final = _cheapest_within(ledger, reference, limits, final)
            is_known, error = (
                _is_known(reference, final, ledger.policy.reference_share * limits),
                _error(final, reference),
            )
            break
        attempts += 1
        final = _better(ledger, limits, final, ledger.run(half(reference.trial.choice)), omitted, (attempts, error))
        if final.choice.divisions > reference.trial.choice.divisions // 2:
            reference = _finer(ledger, reference, final, allowed)
    true = largest(difference(first.values, reference.trial.values))
    return final, Verification(reference.trial.choice, error, true, reference.own, is_known, attempts, reference.cost)


def _is_known(reference: Known, final: Trial, enough: Array) -> bool:
    """Whether the error of the reference is, and its steps are at most half of those of the model."""
    finer = 2 * final.choice.divisions <= reference.trial.choice.divisions
    return finer and bool((reference.own <= enough).all())


def _error(trial: Trial, reference: Known) -> Array:
    return largest(difference(trial.values, reference.trial.values)) + reference.own


def _cheapest_within(ledger: Ledger, reference: Known, limits: Array, final: Trial) -> Trial:
    """The cheapest of all runs that keeps its tolerances, and has steps at least twice those of the reference."""
    most = reference.trial.choice.divisions // 2
    within = [
        trial
        for choice, trial in ledger.runs.items()
        if choice.divisions <= most and (_error(trial, reference) <= limits).all()
    ]
    return min(within, key=ledger.cost, default=final)


# ---- references ---------------------------------------------------------------------------------------------------------


def reference_cost(ledger: Ledger, everything: Choice, final: Trial) -> float:
    """[us] of the first reference with all that tells its error, by the cost model."""
    return _price(ledger, replace(everything, method=PILOT, divisions=_in_fours(2 * final.choice.divisions)))


def sharpened(ledger: Ledger, model: Choice, wanted: Array, divisions: int, allowed: float) -> Known:
    """A run of a model whose own error is `wanted` (outputs,), or, where that takes more than `allowed` [us], the best.

    The cheaper of two methods goes first, each with the steps that its last error asks for.

    divisions : steps to a row, at least
    """
    policy, spent = ledger.policy, 0.0
    best: Known | None = None
    needed = {PILOT: _in_fours(divisions), EXPLICIT: _in_fours(max(divisions, _resolving(ledger, model)))}
    while needed:
        name = min(needed, key=lambda name: _price(ledger, replace(model, method=name, divisions=needed[name])))
        choice = replace(model, method=name, divisions=needed.pop(name))
        if choice.divisions > policy.most_divisions:
            continue
        if best is not None and spent + _price(ledger, choice) > allowed:
            break
        spent += _price(ledger, choice)
        found = _known(ledger, choice)
        missing = float("inf") if found is None else float((found.own / wanted).max(initial=0.0))
        if found is not None and (best is None or missing < (best.own / wanted).max()):
            best = found
        if missing <= 1:
            break
        if name == PILOT or found is not None:
            times = min(4, max(2, ceil(min(missing, 1e6) ** (1 / (3 if name == PILOT else 4)))))
            needed[name] = times * choice.divisions
    if best is None:
        raise ComputationError(
            f"no step down to 1/{policy.most_divisions} of the output step completes a run of the full model, with which the "
            "model is compared; take a shorter output_step"
        )
    return replace(best, cost=spent)


def _finer(ledger: Ledger, reference: Known, final: Trial, allowed: float) -> Known:
    """The reference with steps finer than those of the model; as it is where that takes too long."""
    choice = replace(reference.trial.choice, divisions=_in_fours(2 * final.choice.divisions))
    cost = reference.cost + _price(ledger, choice)
    if choice.divisions <= ledger.policy.most_divisions and cost <= allowed:
        found = _known(ledger, choice)
        if found is not None:
            return replace(found, cost=cost)
    return reference


def _in_fours(divisions: int) -> int:
    return 4 * ceil(divisions / 4)


def _price(ledger: Ledger, choice: Choice) -> float:
    """[us] of a run, those of twice and four times its step, and its twins."""
    fewer = sum(ledger.cost_of(replace(choice, divisions=choice.divisions // k)) for k in (1, 2, 4))
    if choice.method == EXPLICIT or not choice.count:
        return fewer
    return fewer + sum(ledger.cost_of(replace(choice, method="ros2", divisions=k * choice.divisions)) for k in (1, 2))


def _resolving(ledger: Ledger, model: Choice) -> int:
    """Divisions with which an explicit run resolves all vibrations, and takes next to nothing of what they keep.

    RK4 damps a vibration by (h w)^5 / 144 in a radian.
    """
    policy, of = ledger.policy, ledger.vibrations(model)
    if not of.omega.size:
        return 1
    fastest = float(of.omega.max())
    share = max(policy.lost / (fastest * (ledger.span.end - ledger.span.start)), policy.lost_damping * of.ratio.min())
    turn = min(policy.resolved, (144.0 * share) ** 0.2)
    return ceil(fastest * ledger.span.output_step / turn)


def _known(ledger: Ledger, choice: Choice) -> Known | None:
    """A run and its error; None where one of the runs that tell it fails."""
    three = [replace(choice, divisions=choice.divisions // k) for k in (1, 2, 4)]
    ledger.begin(three, _twins(choice))
    try:
        sharp, coarse, coarsest = map(ledger.run, three)
        vibration = _vibration(ledger, sharp)
    except (ComputationError, InputError):
        return None
    last, before = (largest(difference(*(t.values for t in two))) for two in ((sharp, coarse), (coarse, coarsest)))
    fall = np.clip(last / np.maximum(before, 1e-300), 0.5 ** order(sharp), ledger.policy.fall)
    return Known(sharp, np.maximum(last * fall / (1.0 - fall), vibration), 0.0)


def _twins(choice: Choice) -> list[Choice]:
    """Those whose twins tell the vibration that a run damps away."""
    if choice.method == EXPLICIT or choice.controlled or not choice.count:
        return []
    finer = [replace(choice, divisions=2 * choice.divisions)]
    return [choice, *(finer if order_of(choice) > 2 else [])]


def _vibration(ledger: Ledger, trial: Trial) -> Array:
    """(outputs,) v of a run."""
    beside = _twins(trial.choice)
    if not beside:
        return np.zeros(len(trial.values))
    ledger.begin([], beside)
    twins = [ledger.twin(choice).values for choice in beside]
    if len(twins) == 1:
        return np.array([largest_difference(y, t) for y, t in zip(trial.values, twins[0], strict=True)])
    return np.array([nearest(*histories) for histories in zip(trial.values, *twins, strict=True)])


# ---- without a reference ------------------------------------------------------------------------------------------------


def unheard(ledger: Ledger, trial: Trial, step: Array) -> Array:
    """(outputs,) vibration that a run damps away, 0 where it is of the size of the error of its step as that is known."""
    try:
        found = _vibration(ledger, trial)
    except (ComputationError, InputError):
        return np.zeros(len(step))
    return np.where(found > VIBRATION * step, found, 0.0)


# ---- better models ------------------------------------------------------------------------------------------------------


def half(choice: Choice) -> Choice:
    """The same with half the steps."""
    return replace(choice, divisions=choice.divisions // 2)


def _better(
    ledger: Ledger, limits: Array, final: Trial, coarse: Trial, omitted: Contributions, looks: tuple[int, Array]
) -> Trial:
    """A better model: of a finer step where that is what is wrong, or else chosen anew beside the full model with that step,
    and of a finer step too where what is left out does not explain the error.

    looks : how many there were, and the error (outputs,) of the last
    """
    attempts, error = looks
    gap = apart(ledger, final.choice.stepped_as(coarse.choice), coarse)
    if (gap <= ledger.policy.omitted_share * limits).all():
        return ledger.run(_shorter(final.choice))
    stepped = _shorter(final.choice) if (error - gap > ledger.policy.unexplained * limits).any() else final.choice
    if not final.choice.integrator(ledger.span.output_step).implicit:  # its step is for the modes that it had
        stepped = coarse.choice
    if attempts > 1:
        return ledger.run(coarse.choice.stepped_as(stepped))
    ground = Ground(coarse.choice, coarse.choice, coarse, limits, limits)
    beyond = Insufficient(final.choice.count, float((gap / limits).max()))
    anew = selected_model(ledger, ground, omitted, beyond).choice
    return ledger.run(anew.stepped_as(stepped))


def apart(ledger: Ledger, choice: Choice, trial: Trial) -> Array:
    """(outputs,) how far a model is from a run; infinite where its own fails."""
    try:
        return largest(difference(ledger.run(choice).values, trial.values))
    except (ComputationError, InputError):
        return np.full(len(trial.values), np.inf)


def _shorter(choice: Choice) -> Choice:
    """The same model with shorter steps."""
    if choice.controlled:
        return replace(choice, accuracy=choice.accuracy / 10)
    return replace(choice, divisions=2 * choice.divisions)
