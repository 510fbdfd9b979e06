"""The search for the cheapest model of a scene that keeps named outputs within their tolerances.

It costs little more than a few runs of the model it finds:

1. all bodies rigid, steps over two rows, in the plane where the joints keep the scene to one;
2. every mode driven one-way by that motion (`drive`): what each of them does to each output. Where they do next to nothing,
   rigid bodies are the model, and nothing else is run;
3. else the full model with the coarse step, and along its motion what each inertia term and the stiffening by each load do;
4. the modes and terms that must stay (`selection`), in a run beside that of the full model, which measures what is left out;
   in two stages where tolerances are coarse: if that is near the full model in four, it is the model, step and all;
5. integrator and step (`steps`); where the step turns out much finer, both models once more with a finer one;
6. if wanted, a run with the full model and a finer step, against which all errors are verified (`verification`).

All decisions rest on evaluations of the equations and on a cost model, not on clocks: the same scene gives the same model.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ffr_dyn.analyses.events import Event
from ffr_dyn.analyses.forward import Forward, end_by_events
from ffr_dyn.analyses.integration import fast_within
from ffr_dyn.analyses.settings import Settings
from ffr_dyn.analyses.trials.begin import Beginning
from ffr_dyn.consistency.assemble import assemble, body_doubts
from ffr_dyn.economy.cache import Ledger, Tried
from ffr_dyn.economy.checks import frequencies, stiffening_loads, stress_doubts
from ffr_dyn.economy.contributions import Contributions, nothing, of_motion, of_omitted, own
from ffr_dyn.economy.inertia_terms import TermEffect
from ffr_dyn.economy.model_choice import Choice, applied
from ffr_dyn.economy.outputs import Output, Probe, as_output, check_meaning, difference, largest, probe, ranges, total
from ffr_dyn.economy.outputs import limits as limits_of
from ffr_dyn.economy.policy import DEFAULT, Policy
from ffr_dyn.economy.result import Economy, Verification
from ffr_dyn.economy.rigid_start import PILOT, Ground, Rigid, started, unmoved
from ffr_dyn.economy.run import Span, Trial, rings
from ffr_dyn.economy.selection import Insufficient, Selection, gap, selected_model
from ffr_dyn.economy.steps import Stepped, chosen_step
from ffr_dyn.economy.verification import apart, reference_cost, sharpened, unheard, verified
from ffr_dyn.integrators.stabilisation import Projection, Stabilisation
from ffr_dyn.scene.force_kinds import forces_of
from ffr_dyn.scene.scene import Scene
from ffr_dyn.variants.mean_axis import in_new_frames
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError

Histories = tuple[Array, ...]


@dataclass(frozen=True)
class Chosen:
    """A model with its step, and histories (T, k) of its estimated errors: of what is left out, and of the step.

    everything, spatial, limits, scales : as of `Ground`;  omitted : what modes do, driven by the rigid motion
    together : whether one run beside the full model told both, as `time`; `model` is an estimate then
    """

    final: Trial
    model: Array
    time: Histories
    error: Array
    terms: tuple[TermEffect, ...]
    everything: Choice
    spatial: Choice
    limits: Array
    scales: Array
    omitted: Contributions
    together: bool = False


def economise(
    scene: Scene,
    outputs: Sequence[Output | str],
    *,
    end: float,
    output_step: float,
    tolerance: float = 1e-3,
    start: float = 0.0,
    verify: bool | None = None,
    stabilisation: Stabilisation = Projection(),  # noqa: B008 - frozen
    events: Sequence[Event] = (),
    begin: Beginning = "as-given",
    policy: Policy = DEFAULT,
    tell: Callable[[str], None] = lambda stage: None,
) -> Economy:
    """The cheapest model found whose outputs stay within their tolerances over a forward run, with its estimated errors.

    scene     : the full model: all bodies flexible, all modes and all terms that could matter; second-order bodies are taken
                in their mean-axis form, in which modes are told apart best: its frame and modes are those of the model found
    outputs   : names such as "rod.tip.position.y" or "rod.stress", with their own tolerances where they are `Output`s or
                written "rod.stress=1e6" (absolute) or "rod.stress=0.1%"
    tolerance : of outputs without their own: share of the range of the output over the run
    verify    : compare with a run of the full model and a finer step; by default where that takes some seconds only
    events    : moments that the run with the model looks for; where one ends it, the model is one for the rows before
    begin     : the state in which runs begin, as of `forward`; each model has its own
    policy    : the numbers that all decisions rest on
    tell      : called with the name of each stage

    Raises InputError for outputs that do not exist or stay zero and for tolerances that cannot be met or told;
    ComputationError when no run of the scene comes to an end.

    >>> found = fd.economise(scene, ["rod.tip.position"], end=0.5, output_step=1e-3, tolerance=1e-3)
    """
    span, (scene, moved) = Span(start, end, output_step, stabilisation, begin), in_new_frames(scene)
    tell("assemble")
    assembled = assemble(scene, time=start)
    common: dict[str, Any] = {
        "start": start,
        "output_step": output_step,
        "stabilisation": stabilisation,
        "begin": begin,
    }
    span = replace(span, end=end_by_events(scene, events, end=end, assembled=assembled, **common))
    of = probe(assembled, [as_output(one, tolerance) for one in outputs], policy)
    check_meaning(of, scene, moved)
    ledger = Ledger(scene, span, of, tell, policy)
    stiff = started(ledger, assembled.system.scene)
    limits = stiff.limits
    omitted = None if limits is None else stiff.contributions(limits)
    found = None if omitted is None else _surely_rigid(ledger, stiff, omitted)
    found = _beside_everything(ledger, stiff, omitted, verify) if found is None else found
    economy = _finished(ledger, found, verify)
    settings = replace(economy.settings, end=end, analysis=Forward(tuple(events), begin=begin))
    notes = (*economy.notes, *_new_frames(economy, moved))
    return replace(economy, settings=settings, notes=notes, new_frames=tuple(moved))


def _new_frames(found: Economy, moved: Sequence[str]) -> list[str]:
    flexible = ", ".join(repr(body.name) for body in found.scene.bodies if body.name in moved and body.model.n)
    if not flexible:
        return []
    return [
        f"in this model the frame of {flexible} is that of its mean motion, from which its position, rotation, elastic "
        "coordinates and displacements are seen, and what is measured in its axes"
    ]


# ---- rigid bodies -----------------------------------------------------------------------------------------------------


def _surely_rigid(ledger: Ledger, stiff: Rigid, omitted: Contributions) -> Chosen | None:
    """Rigid bodies, where the estimate of what they leave out is far below the tolerances; None where it is not, or where it
    cannot tell."""
    limits, model = stiff.limits, omitted.effect.sum(axis=0)
    if _acts_between_rows(stiff.trial, ledger.span) or _may_be_deaf(stiff.trial):
        return None
    if limits is None or (model > ledger.policy.surely_rigid * limits).any():
        return None
    stepped = _with_step(ledger, replace(stiff.trial.choice, method=PILOT), model, limits)
    scales = ranges(stepped.trial.values)
    return Chosen(
        stepped.trial,
        model,
        stepped.error,
        model + largest(stepped.error),
        (),
        stiff.everything,
        stiff.spatial,
        limits_of(ledger.of, scales, ledger.policy),
        scales,
        omitted,
    )


def _acts_between_rows(trial: Trial, span: Span) -> bool:
    """Whether a force comes and goes within a row: that sets off vibrations of which the loads at rows, that the estimate
    goes by, know nothing."""
    steps = trial.choice.integrator(span.output_step)
    fast = fast_within(trial.made.assembled.system, steps, span.start, span.end, span.output_step)
    return fast is not None and len(fast.spans) > 0


def _may_be_deaf(trial: Trial) -> bool:
    """Whether a force has states in which the motion does not change it, as a servo at its limit or a stop that is not met:
    what an estimate finds there says nothing of other states. Of functions of the state nobody knows."""
    functions = trial.made.assembled.system.user.callbacks
    return any(one.with_state for one in functions) or any(force.deaf for force in forces_of(trial.scene))


def _with_step(ledger: Ledger, choice: Choice, model: Array, limits: Array) -> Stepped:
    """The model with the step for what its own error leaves of the tolerances."""
    policy = ledger.policy
    limit = np.maximum(policy.whole_share * limits - model, policy.least_step_share * limits)
    return chosen_step(ledger, choice, limit)


# ---- beside the full model ------------------------------------------------------------------------------------------------


def _beside_everything(ledger: Ledger, stiff: Rigid, omitted: Contributions | None, verify: bool | None) -> Chosen:
    """The cheapest model beside a coarse run of the full model, and its step; looked at again with a finer one where the step
    turns out much finer, since a coarse step damps the vibration of fast modes, and with it what they do."""
    ground = stiff.ground()
    omitted = stiff.contributions(ground.limits) if omitted is None else omitted
    selection = selected_model(ledger, ground, omitted)
    found = _stepped(ledger, ground, selection, omitted)
    finer = _finer_ground(ledger, ground, found.final, verify)
    if finer is None:
        return found
    same = found.final.choice.stepped_as(finer.everything)
    error = gap(ledger, finer, same, "the same with a finer step")
    if (error + largest(found.time) <= ledger.policy.whole_share * ground.limits).all():
        model = difference(ledger.run(same).values, finer.pilot.values)
        return replace(found, model=largest(model), error=largest(total(model, found.time)))
    beyond = Insufficient(same.count, float((error / ground.limits).max()))
    return _stepped(ledger, finer, selected_model(ledger, finer, omitted, beyond), omitted, found)


def _stepped(
    ledger: Ledger, ground: Ground, selection: Selection, omitted: Contributions, like: Chosen | None = None
) -> Chosen:
    """The model with the step it needs, or with that of a model much like it, whose error is taken over.

    A model of another method than the full model has its step, and its run beside that tells all of its error.
    """
    choice = selection.choice
    beside = ledger.run(choice)
    off = difference(beside.values, ground.pilot.values)
    together = choice.method != ground.everything.method
    if together:
        stepped = Stepped(beside, off)
    elif like is None:
        stepped = _with_any_step(ledger, ground, choice)
        off = difference(ledger.run(stepped.trial.choice.stepped_as(choice)).values, ground.pilot.values)
    else:
        stepped = Stepped(ledger.run(choice.stepped_as(like.final.choice)), like.time)
    return Chosen(
        stepped.trial,
        selection.left if together else largest(off),
        stepped.error,
        largest(off if together else total(off, stepped.error)),
        selection.terms,
        ground.everything,
        ground.spatial,
        ground.limits,
        ground.scales,
        omitted,
        together,
    )


def _with_any_step(ledger: Ledger, ground: Ground, choice: Choice) -> Stepped:
    """The model with its step; with all terms, or the full model, where it does not come through with shorter steps."""
    parts = zip(choice.parts, ground.everything.parts, strict=True)
    whole = tuple(replace(own, dropped=full.dropped, loads=full.loads) if own.count else own for own, full in parts)

    def stepped(model: Choice) -> Stepped:
        left = largest(difference(ledger.run(model).values, ground.pilot.values))
        return _with_step(ledger, model, left, ground.limits)

    *models, last = dict.fromkeys((choice, replace(choice, parts=whole), ground.everything))
    for model in models:
        with suppress(ComputationError):
            return stepped(model)
    return stepped(last)


def _finer_ground(ledger: Ledger, ground: Ground, final: Trial, verify: bool | None) -> Ground | None:
    """Everything with a finer step than before: that of the final run where a verification follows, which needs such a run
    anyway; or else one that costs a part of the final run, where that is much finer than before."""
    policy, divisions = ledger.policy, final.choice.divisions
    least, most = policy.finer_damped, policy.finer_damped_cost
    if rings(final):
        least, most = policy.finer_ringing, policy.finer_ringing_cost
    if _is_verified(ledger, ground.everything, final, verify):
        least = min(least, policy.finer_verified)
    else:
        finer = [replace(ground.everything, divisions=d) for d in range(1, divisions + 1)]
        allowed = most * ledger.cost(final)
        divisions = max((one.divisions for one in finer if ledger.cost_of(one) <= allowed), default=1)
    if divisions < least * ground.coarsest:
        return None
    ledger.tell("full model, finer step")
    everything = replace(ground.everything, divisions=divisions)
    ledger.begin([everything, final.choice.stepped_as(everything)])
    return replace(ground, everything=everything, pilot=ledger.run(everything))


def _is_verified(ledger: Ledger, everything: Choice, final: Trial, verify: bool | None) -> bool:
    return bool(verify) or (
        verify is None and reference_cost(ledger, everything, final) <= ledger.policy.unasked_verification
    )


def _heard(ledger: Ledger, found: Chosen) -> Chosen:
    """With vibration that the steps damp away counted as error; where that is too much, with steps in which the full model
    keeps it, and as the full model where the model does not. Where no verification follows, this is not seen otherwise."""
    final, limits, step = found.final, found.limits, largest(found.time)
    if final.choice.controlled:
        return found
    lost = unheard(ledger, final, step)
    if (found.error + lost <= limits).all():
        return replace(found, error=found.error + lost, time=_with(found.time, lost))
    ledger.tell("steps that resolve vibration")
    policy, fewest = ledger.policy, 2 * final.choice.divisions
    whole = sharpened(ledger, found.everything, policy.omitted_share * limits, fewest, policy.asked_verification)
    steps = final.choice.stepped_as(whole.trial.choice)
    left = apart(ledger, steps, whole.trial)
    is_enough = bool((left + whole.own <= limits).all())
    same, left = (ledger.run(steps), left) if is_enough else (whole.trial, np.zeros(len(limits)))
    time = _with(tuple(np.zeros_like(y) for y in same.values), whole.own)
    return replace(found, final=same, model=left, time=time, error=left + whole.own, together=False)


def _with(histories: Histories, least: Array) -> Histories:
    """Histories whose largest sizes are no less than `least` (outputs,)."""
    return tuple(np.where(np.abs(y) < small, small, y) for y, small in zip(histories, least, strict=True))


# ---- the end ----------------------------------------------------------------------------------------------------------


def _finished(ledger: Ledger, found: Chosen, verify: bool | None) -> Economy:
    is_verified, verification = _is_verified(ledger, found.everything, found.final, verify), None
    found = found if is_verified else _heard(ledger, found)
    final = found.final
    ledger.note(final, "chosen", found.error)
    ledger.asked.clear()
    if is_verified:
        allowed = ledger.policy.asked_verification if verify else ledger.policy.unasked_verification
        final, verification = verified(ledger, found.everything, found.limits, final, found.omitted, allowed)
    verifying = sum(ledger.asked.values())  # of the runs that it took, which the search may have made
    kept, omitted, untold = _explained(ledger, found, final)
    names = [output.name for output in ledger.of.outputs]
    return Economy(
        original=ledger.scene,
        choice=final.choice,
        scene=applied(ledger.scene, final.choice),
        settings=_settings(ledger.span, final.choice, ledger.of),
        probe=ledger.of,
        limits=found.limits,
        scales=found.scales,
        model_error=found.model,
        time_error=largest(found.time),
        together=found.together,
        error=found.error,
        effects=omitted,
        kept=kept,
        terms=found.terms,
        before=ledger.cost_of(_everything_in_space(found, final)),
        cost=ledger.cost(final),
        search_cost=ledger.spent - verifying,
        tried=tuple(ledger.tried),
        runs=_all_runs(ledger, found, verification),
        unmoved=() if _may_be_deaf(final) else unmoved(found.omitted, found.scales, names, ledger.policy),
        frequencies=frequencies(final, ledger.made(found.everything), found.everything, ledger.scene, ledger.policy),
        stiffening=stiffening_loads(final, ledger.policy),
        notes=(*_notes(ledger, final), *stress_doubts(final, ledger.scene, ledger.of, found.limits), *untold),
        verification=verification,
        policy=ledger.policy,
    )


def _notes(ledger: Ledger, final: Trial) -> list[str]:
    """Those of the final run; on bodies those of the full model, since what the chosen one leaves out has an error here."""
    own, full = (body_doubts(assemble(scene).system.scene) for scene in (final.scene, ledger.scene))  # as of runs
    return [*(note for note in final.result.attributes["notes"] if note not in own), *full]


def _everything_in_space(found: Chosen, final: Trial) -> Choice:
    """With the step of the final run."""
    method = PILOT if final.choice.controlled else final.choice.method
    return replace(found.spatial, method=method, divisions=final.choice.divisions)


def _all_runs(ledger: Ledger, found: Chosen, verification: Verification | None) -> tuple[Tried, ...]:
    """Every run with its error, against the best that is known of the outputs."""
    truth = found.final.values if verification is None else ledger.runs[verification.choice].values
    floor = largest(found.time) if verification is None else np.zeros(len(found.limits))
    own = 0.0 if verification is None else verification.own
    return tuple(
        Tried(choice, "run", ledger.cost(trial), np.maximum(largest(difference(trial.values, truth)), floor) + own)
        for choice, trial in ledger.runs.items()
        if verification is None or choice != verification.choice
    )


def _settings(span: Span, choice: Choice, of: Probe) -> Settings:
    outputs = tuple(dict.fromkeys(("default", *of.quantities)))
    method = choice.integrator(span.output_step)
    return Settings(
        start=span.start,
        end=span.end,
        output_step=span.output_step,
        method=method,
        stabilisation=span.stabilisation,
        outputs=outputs,
        analysis=Forward(begin=span.begin),
    )


def _explained(ledger: Ledger, found: Chosen, final: Trial) -> tuple[Contributions, Contributions, list[str]]:
    """The contributions of the modes that stay, and those that the modes left out would make; a note where these cannot be
    found: the model that is chosen stands without them."""
    ledger.tell("what is nearest to mattering")
    if not any(part.modes for part in final.choice.parts):
        return nothing(ledger.of), found.omitted, []
    try:
        kept = of_motion(ledger, final, found.limits, own(ledger, final))
        return kept, of_omitted(ledger, final, found.everything, found.limits), []
    except ComputationError as error:
        return nothing(ledger.of), found.omitted, [f"what each mode of the chosen model does is not told: {error}"]
