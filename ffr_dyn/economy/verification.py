"""The chosen model against everything on and a finer step; refined until it is within its tolerances."""

from __future__ import annotations

from dataclasses import replace

from ffr_dyn.economy.cache import Ledger
from ffr_dyn.economy.contributions import Contributions
from ffr_dyn.economy.model_choice import Choice
from ffr_dyn.economy.outputs import Probe, difference, largest
from ffr_dyn.economy.result import Verification
from ffr_dyn.economy.rigid_start import PILOT, Ground
from ffr_dyn.economy.run import Trial
from ffr_dyn.economy.selection import Insufficient, selected_model
from ffr_dyn.economy.steps import error_of, order
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError


def reference(everything: Choice, final: Trial) -> Choice:
    """Everything with half the step of the final run, and of the coarse one."""
    return replace(everything, method=PILOT, divisions=2 * max(final.choice.divisions, everything.divisions))


def reference_cost(ledger: Ledger, everything: Choice, final: Trial) -> float:
    """[us] of the reference, by the cost model."""
    return ledger.cost_of(reference(everything, final))


def verified(
    ledger: Ledger, everything: Choice, limits: Array, final: Trial, omitted: Contributions
) -> tuple[Trial, Verification]:
    """The model that meets its tolerances against the reference, and their errors.

    omitted : what modes do, driven by the rigid motion, for a model that has to be chosen anew

    Raises InputError where the reference is not known well enough.
    """
    ledger.tell("verification: everything, finer step")
    choice = reference(everything, final)
    sharp, coarse = ledger.run(choice), _coarser(ledger, choice)
    own = _own(sharp, coarse)
    if (own > limits).any():
        coarse = ledger.run(half(choice))
        own = _own(sharp, coarse)
    _check_accuracy(ledger.of, limits, own)
    errors: list[Array] = []
    while True:
        errors.append(largest(difference(final.values, sharp.values)))
        ledger.note(final, "verified", errors[-1])
        if (errors[-1] <= limits).all() or len(errors) == ledger.policy.verification_attempts:
            spent = ledger.cost(sharp) + ledger.cost(coarse)
            return final, Verification(choice, errors[-1], errors[0], own, len(errors) - 1, spent)
        final = _better(ledger, limits, final, ledger.run(half(choice)), omitted, errors)


def half(choice: Choice) -> Choice:
    """The same with half the steps."""
    return replace(choice, divisions=choice.divisions // 2)


def _coarser(ledger: Ledger, choice: Choice) -> Trial:
    """A run that tells the error of the reference: one that is there with steps not much longer, or one of half the steps."""
    longest = ledger.policy.longest_reference_step
    there = [
        trial
        for other, trial in ledger.runs.items()
        if replace(other, divisions=choice.divisions) == choice and 2 <= choice.divisions / other.divisions <= longest
    ]
    return max(there, key=lambda trial: trial.choice.divisions) if there else ledger.run(half(choice))


def _own(sharp: Trial, coarse: Trial) -> Array:
    """(outputs,) error of the reference; from steps that are far longer, as if of an order less, which makes it larger."""
    error, ratio = largest(error_of(sharp, coarse)), sharp.choice.divisions / coarse.choice.divisions
    return error if ratio <= 2 else error * (ratio ** order(sharp) - 1) / (ratio ** (order(sharp) - 1) - 1)


def _check_accuracy(of: Probe, limits: Array, own: Array) -> None:
    for output, limit, known in zip(of.outputs, limits, own, strict=True):
        if known > limit:
            raise InputError(
                f"output {output.name!r}: the tolerance {limit:.2g} is below what the reference itself is known to, "
                f"{known:.2g}; ask for a larger one, or give the scene damping: undamped high modes ring at every step"
            )


def _better(
    ledger: Ledger, limits: Array, final: Trial, coarse: Trial, omitted: Contributions, errors: list[Array]
) -> Trial:
    """A better model: of a finer step where that is what is wrong, or else chosen anew beside everything with that step, and
    of a finer step too where what is left out does not explain the error."""
    same = final.choice.stepped_as(coarse.choice)
    gap = largest(difference(ledger.run(same).values, coarse.values))
    if (gap <= ledger.policy.omitted_share * limits).all():
        return ledger.run(_shorter(final.choice))
    stepped = _shorter(final.choice) if (errors[-1] - gap > ledger.policy.unexplained * limits).any() else final.choice
    if not final.choice.integrator(ledger.span.output_step).implicit:  # its step is for the modes that it had
        stepped = coarse.choice
    if len(errors) > 1:
        return ledger.run(coarse.choice.stepped_as(stepped))
    ground = Ground(coarse.choice, coarse.choice, coarse, limits, limits)
    beyond = Insufficient(final.choice.count, float((gap / limits).max()))
    anew = selected_model(ledger, ground, omitted, beyond).choice
    return ledger.run(anew.stepped_as(stepped))


def _shorter(choice: Choice) -> Choice:
    """The same model with shorter steps."""
    if choice.controlled:
        return replace(choice, accuracy=choice.accuracy / 10)
    return replace(choice, divisions=2 * choice.divisions)
