"""The run that errors are measured from: converged, and verified by another method.

A method of order three is refined, halving its step, until two runs agree; then another method is refined likewise, or
until it agrees with the first. The error estimate of the reference, its floor, is the greater of the distance between the
last two runs of the chosen method and the distance between the methods: no error below it means anything, and where methods
do not agree the floor is high. A method with a single run is known to the scale of what it shows.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ffr_dyn.chart.measures import Measure, Violation
from ffr_dyn.chart.runner import Failure, Job, Outcome, Pool, Span, perform
from ffr_dyn.chart.variants import FULL, Model, Variant, explicit_parts
from ffr_dyn.integrators.stabilisation import Stabilisation
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.arrays import Array
from ffr_prep.common.brief import Brief
from ffr_prep.common.errors import ComputationError

ROUNDED = 1e-7  # below which a distance that does not fall any more is due to rounding
WANTED = 1e-6
POOR = 1e-2  # relative floor above which a reference is called poor
FIRST_PARTS = 16  # steps per output step with which an implicit method starts


@dataclass(frozen=True, repr=False)
class Reference(Brief):
    """The converged histories (T, k), their scales and floors by measure, and how they were found, a line each."""

    values: Mapping[str, Array]
    scales: Mapping[str, float]
    floors: Mapping[str, float]
    variant: Variant
    check: Variant
    story: tuple[str, ...]


@dataclass(frozen=True)
class _Refined:
    """The finest run of a method and its distance, by measure, from the one before, the scale where there is none."""

    variant: Variant
    outcome: Outcome
    distance: Mapping[str, float]


def distance(one: Array, other: Array) -> float:
    """Largest distance of two histories (T, k) over all times."""
    return float(np.linalg.norm(one - other, axis=1).max(initial=0.0))


def distances(one: Outcome | Reference, other: Outcome | Reference) -> dict[str, float]:
    """`distance` by measure."""
    return {name: distance(values, other.values[name]) for name, values in one.values.items()}


def reference(
    scene: Scene,
    span: Span,
    measures: tuple[Measure, ...],
    stabilisation: Stabilisation,
    pool: Pool,
    *,
    model: Model = FULL,
    methods: tuple[str, str] = ("ros3", "rk4"),
    limit: float = 60.0,
    wanted: float = WANTED,
    tell: Callable[[str], None] = lambda line: None,
) -> Reference:
    """Compute and verify the reference.

    methods : the one that is refined first, and the one that verifies it
    limit   : wall time [s] that a single run may take
    wanted  : distance of two runs, relative to the scale of each measure, at which refinement may stop

    Raises ComputationError when not a single run is possible.
    """
    story: list[str] = []

    def say(line: str) -> None:
        story.append(line)
        tell(line)

    found: list[_Refined] = []
    for method in methods:
        jobs = _Jobs(scene, span, measures, stabilisation, model, method, limit)
        refined = _refine(jobs, pool, wanted, say, found[0].outcome if found else None)
        if refined is not None:
            found.append(refined)
    if not found:
        change = ". Allow longer runs (--limit), or shorten the scene" if any("took longer" in s for s in story) else ""
        raise ComputationError(f"no reference: {'; '.join(story)}{change}")
    if len(found) < len(methods):
        say(f"not verified by another method: {found[0].variant.method} alone came to an end")
    ranked = sorted(found, key=_badness)
    best, check = ranked[0], ranked[-1]
    values, floors = _agreed(best, check, measures, say)
    return Reference(values, best.outcome.scales, floors, best.variant, check.variant, tuple(story))


def _agreed(
    best: _Refined, check: _Refined, measures: tuple[Measure, ...], say: Callable[[str], None]
) -> tuple[dict[str, Array], dict[str, float]]:
    """Histories and the errors that they may have, by measure."""
    between = distances(best.outcome, check.outcome)
    floors = {name: max(between[name], best.distance[name]) for name in between}
    values = dict(best.outcome.values)
    for name in [measure.name for measure in measures if isinstance(measure, Violation)]:
        values[name], floors[name] = np.zeros_like(values[name]), 0.0  # the one thing whose true value is known
    for name, floor in floors.items():
        scale = best.outcome.scales[name]
        say(f"{name}: reference right to about {floor:.1e}" + (f", {floor / scale:.1e} of its scale" if scale else ""))
        if scale and floor > POOR * scale:
            say(
                f"{name}: a poor reference: {best.variant.label} and {check.variant.label} are {between[name]:.2g} apart; "
                "allow longer runs (--limit), or shorten the scene: a chaotic or unstable motion has no long reference"
            )
    return values, floors


def _badness(refined: _Refined) -> float:
    """Largest distance of its last two runs relative to the scale."""
    scales = refined.outcome.scales
    return max((far / scales[name] for name, far in refined.distance.items() if scales[name]), default=0.0)


@dataclass(frozen=True)
class _Jobs:
    """The runs of one method on the model of the reference."""

    scene: Scene
    span: Span
    measures: tuple[Measure, ...]
    stabilisation: Stabilisation
    model: Model
    method: str
    limit: float

    def job(self, parts: int) -> Job:
        """The run with that many steps per output step."""
        variant = Variant(self.method, self.span.output_step / parts, self.model)
        return Job(self.scene, variant, self.span, self.measures, self.stabilisation, repeats=1, limit=self.limit)

    def first(self) -> int:
        """Steps per output step of the coarsest run."""
        if Variant(self.method, self.span.output_step).integrator().implicit:
            return FIRST_PARTS
        return max(FIRST_PARTS // 2, explicit_parts(self.model.of(self.scene), self.span.output_step))


def _refine(
    jobs: _Jobs, pool: Pool, wanted: float, say: Callable[[str], None], other: Outcome | None
) -> _Refined | None:
    """Halve the step until two runs agree, or one with the `other` method, rounding takes over, or the next run would take
    too long. None where there is no run.
    """
    parts = jobs.first()
    last: Outcome | None = None
    best: _Refined | None = None
    while True:
        job = jobs.job(parts)
        (_, outcome), *_ = pool.results(perform, [job])
        if isinstance(outcome, Failure):
            say(f"{job.variant.label}: {outcome.reason}")
            if last is not None or parts > 8 * jobs.first():
                return best
        else:
            if last is None:
                best = _Refined(job.variant, outcome, outcome.scales)
            else:
                found = _Refined(job.variant, outcome, distances(outcome, last))
                worst = _badness(found)
                say(f"{job.variant.label}: {worst:.1e} from twice the step, {outcome.wall[0]:.2g} s")
                if best is not None and _badness(best) <= worst < ROUNDED:
                    return best
                best = found
                near = other is not None and _badness(replace(found, distance=distances(outcome, other))) < wanted
                if worst < wanted or near:
                    return best
            if 2.2 * outcome.wall[0] > jobs.limit:
                return best
            last = outcome
        parts *= 2
