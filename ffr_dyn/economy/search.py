"""The search for the cheapest model of a scene that keeps named outputs within their tolerances.

It goes up from rigid bodies, or down from everything where the estimates say that nearly everything is needed:

1. all bodies rigid, a coarse step: gives the plane, the ranges of the outputs, and the forces on every mode;
2. every mode driven one-way by that motion (`drive`): what each of them does to each output;
3. the modes that must stay, so that the others together stay below their share of the tolerance; checked by driving the
   modes left out by the motion of that model, and in a coarse run beside the full model;
4. geometric stiffening and inertia terms left out, one group after the other, each measured in a coarse run;
5. integrator and step;
6. if wanted, a run with everything on and a finer step, against which all errors are verified.

All decisions rest on evaluations of the equations and on a cost model, not on clocks: the same scene gives the same model.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ffr_dyn.analyses.assemble import assemble
from ffr_dyn.economy.checks import Frequency, StiffeningLoad, frequencies, stiffening_loads
from ffr_dyn.economy.choice import Choice, applied, full, in_plane, orthonormal
from ffr_dyn.economy.contributions import (
    LEFT,
    LOOKED,
    SEEN,
    Contributions,
    nothing,
    of_motion,
    of_omitted,
    of_shapes,
)
from ffr_dyn.economy.cost import of_run, per_evaluation
from ffr_dyn.economy.outputs import Output, Probe, as_output, difference, largest, limits, probe, ranges, total
from ffr_dyn.economy.steps import chosen_step, error_of, least, share
from ffr_dyn.economy.trial import Span, Trial, cost, run
from ffr_dyn.errors import InputError, SimulationError
from ffr_dyn.scene import Scene
from ffr_dyn.settings import Forward, Settings
from ffr_dyn.stabilisation import Projection, Stabilisation
from ffr_dyn.variant import STIFFENING

Array = np.ndarray
Histories = tuple[Array, ...]

PILOT = "ros3"
OF_ALL = 0.85  # of the tolerance, for everything together
NEARLY_ALL = 0.8  # of the modes: then the search goes down from the full model
SHORT = 2e6  # [us] of a verification that is made without being asked for
ATTEMPTS = 4
ROUNDS = 2
ROOM = 1.2  # times what a model may take by itself: another look at what could be left out
WORTH = 0.9  # of the cost: a smaller model that pays
FINER = 2  # times the steps: worth another look
LEAST = 0.2  # of the tolerance, that the step may take whatever else there is
UNMOVED = 1e-9  # of its range: an output that differs by less between rigid and flexible bodies is moved by no model
TERMS = (("I5", "I8", "I9"), ("I5", "I9"), ("I5",))


@dataclass(frozen=True)
class Shares:
    """Shares of the tolerance that may be taken by modes left out, by leaving out all, and with terms left out as well."""

    modes: float = 0.25
    rigid: float = 0.5
    all: float = 0.5


@dataclass(frozen=True)
class Tried:
    """A model that was run.

    cost  : [us] of a whole run by the cost model
    error : (outputs,) how far it is from the full model with the same step, or estimated error of the step; NaN unknown
    """

    choice: Choice
    what: str
    cost: float
    error: Array


@dataclass(frozen=True)
class Verification:
    """The errors of the chosen model against everything on and a finer step.

    choice   : the reference;  error : (outputs,) of the chosen model;  own : (outputs,) of the reference, estimated
    first    : (outputs,) error of the model that the estimates had chosen
    attempts : how often that had to be refined
    """

    choice: Choice
    error: Array
    first: Array
    own: Array
    attempts: int


@dataclass(frozen=True)
class Economy:
    """What was found.

    choice, scene, settings : the model;  scene is ready to run with `ffr_dyn.run.run(scene, settings)`
    limits       : (outputs,) tolerances in the units of the outputs;  scales : (outputs,) their ranges
    model_error, time_error, error : (outputs,) estimates: of what is left out, of the step, of both together
    effects      : what each mode left out does to each output, driven one-way by the final model's motion
    kept         : what each mode that stays does
    before, cost : [us] of a run of everything with the same step, and of the chosen model
    search_cost  : [us] of all runs and estimates of the search without the verification
    tried        : what was tried and how far it was from everything with the same step
    runs         : all runs made, with their errors against the reference, or else the chosen run less its estimated error
    unmoved      : names of outputs that no model changes
    frequencies  : of the linearised model beside those of everything;  stiffening : what stiffens bodies, and how much
    """

    original: Scene
    choice: Choice
    scene: Scene
    settings: Settings
    probe: Probe
    limits: Array
    scales: Array
    model_error: Array
    time_error: Array
    error: Array
    effects: Contributions
    kept: Contributions
    before: float
    cost: float
    search_cost: float
    tried: tuple[Tried, ...]
    runs: tuple[Tried, ...]
    unmoved: tuple[str, ...]
    frequencies: tuple[Frequency, ...]
    stiffening: tuple[StiffeningLoad, ...]
    notes: tuple[str, ...]
    verification: Verification | None


@dataclass
class _Search:
    """What a search knows: runs made so far, what they cost."""

    scene: Scene
    span: Span
    of: Probe
    tell: Callable[[str], None]
    runs: dict[Choice, Trial] = field(default_factory=dict)
    spent: float = 0.0
    tried: list[Tried] = field(default_factory=list)

    def run(self, choice: Choice) -> Trial:
        """A run of the model, made once."""
        if choice not in self.runs:
            self.runs[choice] = run(self.scene, choice, self.span, self.of, states=True)
            self.spent += cost(self.runs[choice], self.span)
        return self.runs[choice]

    def looked(self, choice: Choice, evaluations: int) -> None:
        """Account for evaluations of a model in an estimate."""
        self.spent += evaluations * per_evaluation(choice)

    def note(self, trial: Trial, what: str, error: Array) -> None:
        self.tried.append(Tried(trial.choice, what, cost(trial, self.span), error))


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
    tell: Callable[[str], None] = lambda stage: None,
) -> Economy:
    """The cheapest model found whose outputs stay within their tolerances over a forward run, with its estimated errors.

    scene     : with everything flexible, all modes and all terms that could matter
    outputs   : names such as "rod.tip.position.y" or "rod.stress", with their own tolerances where they are `Output`s or
                written "rod.stress=1e6" (absolute) or "rod.stress=0.1%"
    tolerance : of outputs without their own: share of the range of the output over the run
    verify    : compare with a run of everything on and a finer step; by default where that takes some seconds only
    tell      : called with the name of each stage

    Raises InputError for outputs that do not exist or stay zero and for tolerances that cannot be met or told;
    SimulationError when no run of the scene comes to an end.
    """
    span = Span(start, end, output_step, stabilisation)
    tell("assemble")
    of = probe(assemble(scene, time=start), [as_output(one, tolerance) for one in outputs])
    search = _Search(scene, span, of, tell)
    ground = _started(search)
    found = _chosen(search, ground)
    for _ in range(ROUNDS):
        finer = _beside(search, ground, found)
        if finer is None:
            break
        ground, found = finer
    return _finished(search, ground, found, verify)


@dataclass(frozen=True)
class _Found:
    """A model with its step, and histories (T, k) of its estimated errors: of what is left out, and of the step."""

    final: Trial
    model: Histories
    time: Histories


def _chosen(search: _Search, ground: _Ground) -> _Found:
    """The cheapest model beside the coarse run of everything, and its step; what the step does not take of the tolerance
    goes to a smaller model, where there is one."""
    found = _stepped(search, ground, _model(search, ground, Shares()))
    room = float((OF_ALL - largest(found.time) / ground.limits).min())
    if room <= ROOM * Shares().all:
        return found
    smaller = _model(search, ground, Shares(0.6 * room, room, room))
    if per_evaluation(smaller) > WORTH * per_evaluation(found.final.choice):
        return found
    again = _stepped(search, ground, smaller)
    return again if cost(again.final, search.span) < cost(found.final, search.span) else found


def _model(search: _Search, ground: _Ground, shares: Shares) -> Choice:
    return _without_terms(search, ground, _modes(search, ground, shares), shares)


def _stepped(search: _Search, ground: _Ground, choice: Choice) -> _Found:
    search.tell("integrator and step")
    model = difference(search.run(choice).values, ground.pilot.values)
    left = np.maximum(OF_ALL * ground.limits - largest(model), LEAST * ground.limits)
    coarsest = replace(choice, method=PILOT, divisions=ground.coarsest)
    stepped = chosen_step(search.run, coarsest, left, search.span)
    return _Found(stepped.trial, model, stepped.error)


def _beside(search: _Search, ground: _Ground, found: _Found) -> tuple[_Ground, _Found] | None:
    """The model looked at again beside everything with a step that costs about as much as its final run, where that is
    much finer than before: a coarse step damps the vibration of fast modes, and with it what they do."""
    final = found.final.choice
    divisions = int(
        cost(found.final, search.span) / of_run(search.scene, replace(ground.everything, divisions=1), search.span.rows)
    )
    if divisions < FINER * ground.pilot.choice.divisions:
        return None
    search.tell("everything, finer step")
    everything = replace(ground.everything, divisions=divisions)
    pilot, rigid = search.run(everything), search.run(_rigid(everything))
    finer = replace(ground, everything=everything, pilot=pilot, rigid=rigid)
    same = replace(final, method=PILOT, divisions=divisions, accuracy=0.0)
    error = _gap(search, finer, same, "the same with a finer step")
    if (error + largest(found.time) <= ground.limits).all():
        return finer, replace(found, model=difference(search.run(same).values, pilot.values))
    return finer, _chosen(search, finer)


# ---- the start ------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Ground:
    """Where a search starts.

    everything : all modes, in the plane where there is one;  spatial : the same in space
    rigid      : run with rigid bodies;  pilot : run of everything with the same coarse step
    coarsest   : divisions of the output step with which runs come to an end
    """

    everything: Choice
    spatial: Choice
    rigid: Trial
    pilot: Trial
    limits: Array
    scales: Array
    unmoved: tuple[str, ...]
    coarsest: int


def _started(search: _Search) -> _Ground:
    search.tell("rigid bodies, coarse step")
    spatial = full(search.scene, PILOT, 1)
    rigid = least(search.run, _rigid(spatial), 1)
    everything = replace(spatial, divisions=rigid.choice.divisions)
    flat = in_plane(search.scene, everything, rigid.result)
    if flat is not None:
        everything = flat
        rigid = search.run(_rigid(flat))
    search.tell("everything, coarse step")
    pilot = least(search.run, everything, everything.divisions)
    if pilot.choice.divisions != everything.divisions:
        everything = pilot.choice
        rigid = search.run(_rigid(everything))
    scales = ranges(pilot.values)
    gap = largest(difference(rigid.values, pilot.values))
    bound = limits(search.of, scales)
    search.note(rigid, "all bodies rigid", gap)
    search.note(pilot, "everything", np.zeros(len(bound)))
    still = gap <= UNMOVED * np.maximum(scales, 1e-300)
    unmoved = tuple(o.name for o, quiet in zip(search.of.outputs, still, strict=True) if quiet)
    return _Ground(everything, spatial, rigid, pilot, bound, scales, unmoved, pilot.choice.divisions)


def _rigid(choice: Choice) -> Choice:
    return replace(choice, parts=tuple(replace(part, modes=(), dropped=()) for part in choice.parts))


# ---- modes ----------------------------------------------------------------------------------------------------------


def _modes(search: _Search, ground: _Ground, shares: Shares) -> Choice:
    """The fewest modes, or shapes made of them, whose absence leaves the outputs within their share."""
    if share(difference(ground.rigid.values, ground.pilot.values), shares.rigid * ground.limits) <= 1:
        return ground.rigid.choice
    offers = [_Offer(search.scene, ground, ranking, shares.modes) for ranking in _rankings(search, ground)]
    for offer in sorted(offers, key=lambda offer: offer.cost):
        found = _enough(search, ground, offer)
        if found is not None:
            return found
    return ground.everything


class _Offer:
    """Directions in the order of what they do: taken from the top until the rest is within its share."""

    def __init__(self, scene: Scene, ground: _Ground, ranking: Contributions, share: float) -> None:
        self.scene, self.ground, self.ranking, self.share = scene, ground, ranking, share
        self.order = np.argsort(-(ranking.effect / ground.limits).max(axis=1), kind="stable")
        rest = np.cumsum((ranking.effect / (share * ground.limits))[self.order[::-1]], axis=0)
        self.left = rest[::-1].max(axis=1)  # what is left out when those before are taken
        self.cost = per_evaluation(self.model(self.count(1.0)))

    def count(self, share: float) -> int:
        """How many directions leave less than a share of what modes may take."""
        return int(np.sum(self.left > share))

    def model(self, count: int) -> Choice:
        """The model with the first directions."""
        return _with(self.scene, self.ground.everything, self.ranking, self.order[:count])


def _enough(search: _Search, ground: _Ground, offer: _Offer) -> Choice | None:
    """The model with as many directions as a coarse run shows to be enough; None where the number of attempts does not do."""
    limit = offer.share * ground.limits
    count = offer.count(1.0)
    for _ in range(ATTEMPTS):
        model = offer.model(count)
        error = float((_gap(search, ground, model, f"{sum(p.count for p in model.parts)} shapes") / limit).max())
        if error <= 1:
            return model
        if count == offer.order.size:
            return None
        count = min(offer.order.size, max(count + 1, offer.count(1 / error)))
    return None


def _rankings(search: _Search, ground: _Ground) -> list[Contributions]:
    """What modes do, driven by the rigid motion or, where nearly all are needed, in the full one; and principal shapes."""
    search.tell("modes driven by the rigid motion")
    found = of_omitted(ground.rigid, ground.pilot, search.of, search.scene)
    search.looked(ground.everything, _evaluations(found))
    needed = (found.effect > Shares().modes * ground.limits / max(1, len(found.body))).any(axis=1)
    if needed.mean() >= NEARLY_ALL or not np.isfinite(found.effect).all():
        search.tell("modes of the full motion")
        found = of_motion(ground.pilot, search.of, search.scene)
        search.looked(ground.everything, _evaluations(found))
    shapes = of_shapes(ground.pilot, search.of, search.scene)
    search.looked(ground.everything, _evaluations(shapes))
    return [found, shapes]


def _evaluations(found: Contributions) -> int:
    return SEEN + 2 * LOOKED * len(found.body)


def _with(scene: Scene, everything: Choice, ranking: Contributions, chosen: Array) -> Choice:
    """The model with the chosen directions of a ranking."""
    parts = []
    for b, part in enumerate(everything.parts):
        shapes = [ranking.shape[k] for k in chosen if ranking.body[k] == b]
        modes = tuple(sorted(int(ranking.mode[k]) for k in chosen if ranking.body[k] == b))
        if not shapes:
            parts.append(replace(part, modes=(), dropped=()))
        elif all(np.count_nonzero(np.abs(shape) > LEFT) == 1 for shape in shapes):
            parts.append(replace(part, modes=modes))
        elif len(shapes) >= len(part.modes):
            parts.append(part)
        else:
            at = list(part.modes)
            V = orthonormal(np.array(shapes).T[at], scene.bodies[b].model.omega2[at])
            parts.append(replace(part, shapes=tuple(tuple(float(v) for v in column) for column in V.T)))
    return replace(everything, parts=tuple(parts))


def _gap(search: _Search, ground: _Ground, choice: Choice, what: str) -> Array:
    """(outputs,) how far a model is from everything with the same coarse step; infinite where its run fails."""
    try:
        trial = search.run(choice)
    except SimulationError:
        return np.full(len(ground.limits), np.inf)
    error = largest(difference(trial.values, ground.pilot.values))
    search.note(trial, what, error)
    return error


# ---- terms ----------------------------------------------------------------------------------------------------------


def _without_terms(search: _Search, ground: _Ground, choice: Choice, shares: Shares) -> Choice:
    """The model without stiffening and inertia terms that the outputs do not need; what costs most is tried first."""
    flexible = [b for b, part in enumerate(choice.parts) if part.modes]
    if not flexible:
        return choice
    search.tell("terms left out")
    limit = shares.all * ground.limits
    least = _dropping(choice, (STIFFENING, *TERMS[0]), flexible)
    if (_gap(search, ground, least, "without stiffening and " + ", ".join(TERMS[0])) <= limit).all():
        return least
    choice = _without_stiffening(search, ground, choice, limit)
    for terms in TERMS:
        fewer = _dropping(choice, terms, flexible)
        if (_gap(search, ground, fewer, "without " + ", ".join(terms)) <= limit).all():
            return fewer
    return choice


def _without_stiffening(search: _Search, ground: _Ground, choice: Choice, limit: Array) -> Choice:
    """Stiffening left out of all bodies, or of as many as can be."""
    bodies = [b for b, part in enumerate(choice.parts) if part.modes and part.stiffened and _has(search.scene, b)]
    if not bodies:
        return choice
    without = _dropping(choice, (STIFFENING,), bodies)
    if (_gap(search, ground, without, "without stiffening") <= limit).all():
        return without
    if len(bodies) == 1:
        return choice
    for b in bodies:
        fewer = _dropping(choice, (STIFFENING,), [b])
        name = search.scene.bodies[b].name
        if (_gap(search, ground, fewer, f"without stiffening of {name}") <= limit).all():
            choice = fewer
    return choice


def _has(scene: Scene, body: int) -> bool:
    return scene.bodies[body].model.stiffening is not None


def _dropping(choice: Choice, terms: tuple[str, ...], bodies: list[int]) -> Choice:
    parts = list(choice.parts)
    for b in bodies:
        parts[b] = replace(parts[b], dropped=tuple(dict.fromkeys((*parts[b].dropped, *terms))))
    return replace(choice, parts=tuple(parts))


# ---- step and end ---------------------------------------------------------------------------------------------------


def _finished(search: _Search, ground: _Ground, found: _Found, verify: bool | None) -> Economy:
    error, final = largest(total(found.model, found.time)), found.final
    spent = search.spent
    search.note(final, "chosen", error)
    verification = None
    if verify or (verify is None and _reference_cost(search, ground, final) <= SHORT):
        final, verification = _verified(search, ground, final)
    kept, omitted = _explained(search, ground, final)
    vibrations, stiffening = frequencies(final, ground.pilot), stiffening_loads(final)
    method = PILOT if final.choice.controlled else final.choice.method
    same = replace(ground.spatial, method=method, divisions=final.choice.divisions)
    return Economy(
        original=search.scene,
        choice=final.choice,
        scene=applied(search.scene, final.choice),
        settings=_settings(search.span, final.choice, search.of),
        probe=search.of,
        limits=ground.limits,
        scales=ground.scales,
        model_error=largest(found.model),
        time_error=largest(found.time),
        error=error,
        effects=omitted,
        kept=kept,
        before=of_run(search.scene, same, search.span.rows),
        cost=cost(final, search.span),
        search_cost=spent,
        tried=tuple(search.tried),
        runs=_all_runs(search, found, verification),
        unmoved=ground.unmoved,
        frequencies=vibrations,
        stiffening=stiffening,
        notes=tuple(final.result.attributes["notes"]),
        verification=verification,
    )


def _all_runs(search: _Search, found: _Found, verification: Verification | None) -> tuple[Tried, ...]:
    """Every run with its error, against the best that is known of the outputs."""
    if verification is not None:
        truth: Histories = search.runs[verification.choice].values
    else:
        truth = difference(found.final.values, total(found.model, found.time))
    return tuple(
        Tried(choice, "run", cost(trial, search.span), largest(difference(trial.values, truth)))
        for choice, trial in search.runs.items()
        if verification is None or choice != verification.choice
    )


def _settings(span: Span, choice: Choice, of: Probe) -> Settings:
    outputs = tuple(dict.fromkeys(("default", *of.quantities)))
    method = choice.integrator(span.output_step)
    return Settings(span.start, span.end, span.output_step, method, span.stabilisation, outputs, Forward())


def _explained(search: _Search, ground: _Ground, final: Trial) -> tuple[Contributions, Contributions]:
    """What the modes that stay do, and what those left out would."""
    search.tell("what is nearest to mattering")
    kept = nothing(search.of)
    if any(part.modes for part in final.choice.parts):
        kept = of_motion(final, search.of, search.scene)
    return kept, of_omitted(final, ground.pilot, search.of, search.scene)


# ---- verification ---------------------------------------------------------------------------------------------------


def _reference(ground: _Ground, final: Trial) -> Choice:
    return replace(
        ground.everything, method=PILOT, divisions=2 * max(final.choice.divisions, ground.pilot.choice.divisions)
    )


def _reference_cost(search: _Search, ground: _Ground, final: Trial) -> float:
    return of_run(search.scene, _reference(ground, final), search.span.rows)


def _verified(search: _Search, ground: _Ground, final: Trial) -> tuple[Trial, Verification]:
    """The chosen model against everything with a finer step; refined until it is within its tolerances."""
    search.tell("verification: everything, finer step")
    choice = _reference(ground, final)
    reference = search.run(choice)
    coarse = search.run(replace(choice, divisions=choice.divisions // 2))
    own = largest(error_of(reference, coarse))
    _check_accuracy(search.of, ground, own)
    errors: list[Array] = []
    while True:
        errors.append(largest(difference(final.values, reference.values)))
        search.note(final, "verified", errors[-1])
        if (errors[-1] <= ground.limits).all() or len(errors) == ATTEMPTS:
            return final, Verification(choice, errors[-1], errors[0], own, len(errors) - 1)
        final = _finer(search, ground, final, reference, len(errors))


def _check_accuracy(of: Probe, ground: _Ground, own: Array) -> None:
    for output, limit, known in zip(of.outputs, ground.limits, own, strict=True):
        if known > limit:
            raise InputError(
                f"output {output.name!r}: the tolerance {limit:.2g} is below what the reference itself is known to, "
                f"{known:.2g}; ask for a larger one, or give the scene damping: undamped high modes ring at every step"
            )


def _finer(search: _Search, ground: _Ground, final: Trial, reference: Trial, attempt: int) -> Trial:
    """A better model: of a finer step where that is what is wrong, or else chosen anew beside the reference."""
    finer = search.run(_shorter(final.choice))
    gained = largest(difference(finer.values, final.values)) / ground.limits
    error = largest(difference(finer.values, reference.values)) / ground.limits
    if (error <= 1).all() or gained.max() > error.max():
        return finer
    steps: dict[str, Any] = {key: getattr(final.choice, key) for key in ("method", "divisions", "accuracy")}
    if not final.choice.integrator(search.span.output_step).implicit:  # its step is for the modes that it had
        steps = {"method": PILOT, "divisions": max(1, reference.choice.divisions // 2), "accuracy": 0.0}
    choice = replace(ground.everything, **steps)
    if attempt > 1:
        return search.run(choice)
    rigid = search.run(_rigid(reference.choice))
    sharp = replace(ground, everything=reference.choice, pilot=reference, rigid=rigid)
    anew = _model(search, sharp, Shares())
    if anew.parts == final.choice.parts:
        return search.run(choice)
    return search.run(replace(anew, **steps))


def _shorter(choice: Choice) -> Choice:
    """The same model with shorter steps."""
    if choice.controlled:
        return replace(choice, accuracy=choice.accuracy / 10)
    return replace(choice, divisions=2 * choice.divisions)
