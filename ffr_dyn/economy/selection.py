"""The modes and terms that a model needs: predicted by what they do to the outputs, then run once beside the full model."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ffr_dyn.economy.cache import Ledger
from ffr_dyn.economy.contributions import Contributions, of_motion, of_shapes, own
from ffr_dyn.economy.cost import per_evaluation
from ffr_dyn.economy.inertia_terms import TermEffect, term_effects, without_minor
from ffr_dyn.economy.model_choice import Choice, orthonormal, rigid
from ffr_dyn.economy.outputs import difference, largest
from ffr_dyn.economy.policy import Policy
from ffr_dyn.economy.rigid_start import SCOUT, Ground
from ffr_dyn.economy.run import rings
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError, InputError


@dataclass(frozen=True)
class Ranking:
    """Directions in the order of what they do: taken from the top until the rest is within its share."""

    scene: Scene
    everything: Choice
    found: Contributions
    limits: Array
    remainder: float

    @property
    def order(self) -> Array:
        """Numbers of the directions."""
        return np.argsort(-(self.found.effect / self.limits).max(axis=1), kind="stable")

    def count(self, part: float) -> int:
        """How many directions leave less than a share of the tolerance."""
        rest = np.cumsum((self.found.effect / self.limits)[self.order[::-1]], axis=0)
        return int(np.sum(rest.max(axis=1) > part))

    def left(self, count: int) -> Array:
        """(outputs,) what all directions but the first do."""
        rest: Array = self.found.effect[self.order[count:]].sum(axis=0)
        return rest

    def leaders(self, count: int) -> tuple[int, ...]:
        """The direction with most strain energy of every body that has none among the first."""
        there = set(self.found.body[self.order[:count]])
        omega2 = [self.scene.bodies[b].model.omega2 for b in self.found.body]
        energy = [
            a * a * float(s * s @ w) for a, s, w in zip(self.found.amplitude, self.found.shape, omega2, strict=True)
        ]
        listed = [np.flatnonzero(self.found.body == b) for b in np.unique(self.found.body) if b not in there]
        return tuple(int(of_body[np.argmax(np.array(energy)[of_body])]) for of_body in listed)

    def model(self, count: int, also: tuple[int, ...] = ()) -> Choice:
        """Everything with the first directions only, and some others."""
        chosen = [*self.order[:count], *also]
        parts = list(self.everything.parts)
        for b, part in enumerate(parts):
            shapes = [self.found.shape[k] for k in chosen if self.found.body[k] == b]
            if not shapes:
                parts[b] = replace(part, modes=(), dropped=())
            elif all(np.count_nonzero(np.abs(shape) > self.remainder) == 1 for shape in shapes):
                parts[b] = replace(
                    part, modes=tuple(sorted(int(self.found.mode[k]) for k in chosen if self.found.body[k] == b))
                )
            elif len(shapes) < len(part.modes):
                at = list(part.modes)
                V = orthonormal(np.array(shapes).T[at], self.scene.bodies[b].model.omega2[at])
                parts[b] = replace(part, shapes=tuple(tuple(float(v) for v in column) for column in V.T))
        return replace(self.everything, parts=tuple(parts))


@dataclass(frozen=True)
class Selection:
    """A model, and what terms do along the motion of the full model, known where modes were looked at.

    left : (outputs,) what modes left out do, by the estimate
    """

    choice: Choice
    left: Array
    terms: tuple[TermEffect, ...] = ()


@dataclass(frozen=True)
class Insufficient:
    """A model that does not do: its number of elastic coordinates, and its largest error in tolerances."""

    count: int
    error: float


def selected_model(
    ledger: Ledger, ground: Ground, omitted: Contributions, beyond: Insufficient | None = None
) -> Selection:
    """The fewest modes, or shapes made of them, and the fewest terms whose absence leaves the outputs within their share.

    omitted : what modes do, driven by the rigid motion
    beyond  : a model that is known not to do
    """
    policy, all_modes = ledger.policy, omitted.effect.sum(axis=0)
    if beyond is None and (all_modes <= policy.rigid_tried * ground.limits).all():
        stiff = rigid(ground.everything)
        if _directly(ledger, ground, stiff) <= 1:
            return Selection(replace(stiff, method=SCOUT), all_modes)
        if (gap(ledger, ground, stiff, "all bodies rigid") <= policy.rigid_share * ground.limits).all():
            return Selection(stiff, all_modes)
    rankings, effects = _rankings(ledger, ground, omitted)
    predicted = [ranking.model(ranking.count(policy.modes_share)) for ranking in rankings]
    best = rankings[min(range(len(rankings)), key=lambda k: (per_evaluation(predicted[k], policy.cost), k))]
    choice = None
    if beyond is None and (_is_coarse(ledger, ground) or (all_modes <= policy.nearly_rigid * ground.limits).all()):
        choice = _in_two_stages(ledger, ground, best, effects)
    choice = _enough(ledger, ground, best, effects, beyond) if choice is None else choice
    return Selection(choice, best.left(choice.count), effects)


def _rankings(ledger: Ledger, ground: Ground, omitted: Contributions) -> tuple[list[Ranking], tuple[TermEffect, ...]]:
    """Rankings of modes, driven by the rigid motion or, where nearly all are needed, in the full one; shapes; terms."""
    ledger.tell("modes and terms along the motion of the full model")
    seen = own(ledger, ground.pilot)
    needed = (omitted.effect > ledger.policy.modes_share * ground.limits / max(1, len(omitted.body))).any(axis=1)
    found = omitted
    if needed.mean() >= ledger.policy.needed_modes or not np.isfinite(omitted.effect).all():
        found = of_motion(ledger, ground.pilot, ground.limits, seen)
    shapes = of_shapes(ledger, ground.pilot, ground.limits, seen)
    rankings = [
        Ranking(ledger.scene, ground.everything, one, ground.limits, ledger.policy.remainder) for one in (found, shapes)
    ]
    return rankings, term_effects(seen, found, ledger.policy)


def _enough(
    ledger: Ledger,
    ground: Ground,
    ranking: Ranking,
    effects: tuple[TermEffect, ...],
    beyond: Insufficient | None,
) -> Choice:
    """The model that a run beside the full model shows to be enough; the full model where the attempts do not suffice."""
    policy = ledger.policy
    scale, count, terms = 1.0, 0, policy.terms_share
    before: float = np.inf
    also: tuple[int, ...] = ()
    if beyond is not None:
        scale = min(1.0, policy.caution * policy.omitted_share / beyond.error)
        count = _more(ranking, beyond.count, policy)
    for _ in range(policy.model_attempts):
        count = max(count, ranking.count(scale * policy.modes_share))
        model = ranking.model(count, also)
        if terms:
            model = without_minor(model, effects, scale * terms * ground.limits)
        error = float((gap(ledger, ground, model, _said(model)) / (policy.omitted_share * ground.limits)).max())
        if error <= 1:
            return model
        if model == ground.everything:
            break
        if (
            error > policy.stalled * before
        ):  # what is missing comes by way of a body that does nothing to the outputs itself
            also = ranking.leaders(count)
        before = error
        if np.isfinite(error):
            scale *= policy.caution / error
            count = _more(ranking, count, policy)
        else:  # a run that fails may miss a term
            count = count if terms else _more(ranking, count, policy)
            terms = 0.0
    return ground.everything


# ---- two stages -------------------------------------------------------------------------------------------------------


def _in_two_stages(ledger: Ledger, ground: Ground, ranking: Ranking, effects: tuple[TermEffect, ...]) -> Choice | None:
    """A model in two stages: with few modes first, since they may do; with more where that is not far off."""
    policy = ledger.policy
    for count in dict.fromkeys(ranking.count(part) for part in (policy.bold_modes_share, policy.modes_share)):
        model = without_minor(ranking.model(count), effects, policy.terms_share * ground.limits)
        error = _directly(ledger, ground, model)
        if error <= 1:
            return replace(model, method=SCOUT)
        if error > policy.two_stages_reach:
            break
    return None


def _directly(ledger: Ledger, ground: Ground, model: Choice) -> float:
    """How far the model in two stages is from the full model in four, over what is believed: its step is told then with
    what is left out."""
    error = gap(ledger, ground, replace(model, method=SCOUT), f"{_said(model)}, two stages")
    policy, careful = ledger.policy, rings(ground.pilot) and not _is_coarse(ledger, ground)
    part = policy.two_stages_ringing if careful else policy.two_stages
    return float((error / (part * ground.limits)).max())


def _is_coarse(ledger: Ledger, ground: Ground) -> bool:
    return bool((ground.limits >= ledger.policy.coarse_tolerance * ground.scales).all())


def _more(ranking: Ranking, count: int, policy: Policy) -> int:
    """A number of directions after one that is not enough."""
    return min(max(count + 1, int(policy.more_modes * count)), ranking.order.size)


def _said(model: Choice) -> str:
    return f"{model.count} elastic coordinates" if model.count else "all bodies rigid"


def gap(ledger: Ledger, ground: Ground, choice: Choice, what: str) -> Array:
    """(outputs,) how far a model is from the full model with the same coarse step; infinite where its run fails."""
    try:
        trial = ledger.run(choice)
    except (ComputationError, InputError):
        return np.full(len(ground.limits), np.inf)
    error = largest(difference(trial.values, ground.pilot.values))
    ledger.note(trial, what, error)
    return error
