"""A work-precision diagram: every variant's cost and errors, from the scene to the table."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from ffr_dyn.analyses.events import Event
from ffr_dyn.analyses.forward import end_by_events
from ffr_dyn.chart.meaning import check_meaning
from ffr_dyn.chart.measures import Measure, default_measures, measure_of
from ffr_dyn.chart.pareto import pareto_front
from ffr_dyn.chart.reference import WANTED, Reference, distance, reference
from ffr_dyn.chart.runner import REPEATS, Failure, Job, Outcome, Pool, Span, perform
from ffr_dyn.chart.variants import FULL, Model, Variant, grid
from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.integrators import methods as known_methods
from ffr_dyn.integrators.stabilisation import Projection, Stabilisation
from ffr_dyn.results.quantities import Entry, catalogue
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.brief import Brief
from ffr_prep.common.errors import InputError

CPU, WALL, EVALUATIONS = "cpu", "wall", "evaluations"
COSTS = (CPU, WALL, EVALUATIONS)


@dataclass(frozen=True)
class Point:
    """A variant that ran.

    series, label : of the line it belongs to, and its own
    number        : its step [s] or tolerance
    errors        : by measure, in its unit
    wall, cpu     : (median, least, greatest) time [s];  evaluations : of the equations of motion, 0 if not known
    """

    series: str
    model: str
    label: str
    kind: str
    number: float
    errors: Mapping[str, float]
    wall: tuple[float, float, float]
    cpu: tuple[float, float, float]
    evaluations: int = 0

    def cost(self, of: str) -> float:
        """One of `COSTS`; not a number where it is not known."""
        if of == EVALUATIONS:
            return float(self.evaluations) if self.evaluations else float("nan")
        return self.cpu[0] if of == CPU else self.wall[0]


@dataclass(frozen=True)
class Lost:
    """A variant that did not run, and why."""

    series: str
    model: str
    label: str
    kind: str
    number: float
    reason: str


@dataclass(frozen=True, repr=False)
class Diagram(Brief):
    """The points of a scene, those lost, and the reference that errors are measured from.

    limits : errors that are tolerated, by measure, in its unit, such as [m]

    >>> fd.orders(diagram, "deflection:rod")  # of a diagram that `fd.work_precision` returned
    """

    title: str
    measures: tuple[Measure, ...]
    points: tuple[Point, ...]
    lost: tuple[Lost, ...]
    reference: Reference
    notes: tuple[str, ...] = ()
    chosen: tuple[str, ...] = field(default=())  # labels of points to be pointed out
    limits: Mapping[str, float] = field(default_factory=dict)

    def measure(self, name: str) -> Measure:
        """The measure of that name."""
        for measure in self.measures:
            if measure.name == name:
                return measure
        raise InputError(f"the diagram has no measure {name!r}; it has: {', '.join(m.name for m in self.measures)}")

    def scale(self, measure: str) -> float:
        """The scale to which errors are relative; 1 where only absolute ones make sense."""
        return self.reference.scales[measure] or 1.0

    def front(self, measure: str, cost: str) -> tuple[Point, ...]:
        """The Pareto front, cheapest first. Errors below the floor count as the floor."""
        floor = self.reference.floors[measure]
        errors = [max(point.errors[measure], floor) for point in self.points]
        return tuple(self.points[k] for k in pareto_front([point.cost(cost) for point in self.points], errors))

    def with_points(self, points: Sequence[Point], lost: Sequence[Lost] = ()) -> Diagram:
        """The diagram with points of another program, say."""
        return replace(self, points=(*self.points, *points), lost=(*self.lost, *lost))


def quantities_of(scene: Scene, start: float = 0.0) -> Mapping[str, Entry]:
    """Every quantity that a run of the scene has, by name."""
    return catalogue(assemble(scene, time=start).system)


def measures_of(scene: Scene, texts: Sequence[str], start: float = 0.0) -> tuple[Measure, ...]:
    """The measures that texts name; without any, those of `default_measures`.

    Raises InputError for a text that names no measure of the scene.

    >>> measures = fd.measures_of(scene, ["deflection:rod"])
    """
    quantities = quantities_of(scene, start)
    if not texts:
        return default_measures(scene, quantities)
    return tuple(measure_of(text, scene, quantities) for text in dict.fromkeys(texts))


def work_precision(
    scene: Scene,
    span: Span,
    pool: Pool,
    *,
    measures: tuple[Measure, ...] = (),
    methods: Mapping[str, Sequence[float] | None] | None = None,
    models: Sequence[Model] = (FULL,),
    stabilisation: Stabilisation = Projection(),  # noqa: B008 - frozen
    events: Sequence[Event] = (),
    repeats: int = REPEATS,
    limit: float = 60.0,
    wanted: float = WANTED,
    tell: Callable[[str], None] = lambda line: None,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> Diagram:
    """Run all methods on all models of a scene and compare them with a reference of the full scene.

    methods  : steps [s] or tolerances by method, None for a ladder that is chosen; default all methods
    models   : what is simplified; the reference has the full one
    events   : of the scene's runs; where one ends them, they are compared up to the last row before
    limit    : wall time [s] that a run may take
    wanted   : relative error [1] that the reference should have, see `reference`
    tell     : told how the reference is found;  progress : told how many variants are done, of how many

    Raises InputError for what cannot be compared, ComputationError where not a single run of the reference is possible.

    >>> with fd.pool() as workers: diagram = fd.work_precision(scene, fd.Span(0.5, 1e-3), workers)
    """
    measures = measures or measures_of(scene, (), span.start)
    check_meaning(scene, measures, models)
    span = _ended(scene, span, stabilisation, events, tell)
    variants = grid(scene, models, dict.fromkeys(known_methods()) if methods is None else methods, span.output_step)
    found = reference(scene, span, measures, stabilisation, pool, limit=limit, wanted=wanted, tell=tell)
    jobs = [Job(scene, variant, span, measures, stabilisation, repeats, limit) for variant in variants]
    outcomes = run_variants(jobs, pool, progress)
    points = [point_of(v, o, found) for v, o in zip(variants, outcomes, strict=True) if isinstance(o, Outcome)]
    lost = [
        Lost(v.method, v.model.label, v.label, v.kind, v.number, o.reason)
        for v, o in zip(variants, outcomes, strict=True)
        if isinstance(o, Failure)
    ]
    return Diagram(scene.name, measures, tuple(points), tuple(lost), found)


def _ended(
    scene: Scene, span: Span, stabilisation: Stabilisation, events: Sequence[Event], tell: Callable[[str], None]
) -> Span:
    end = end_by_events(scene, events, **span.integrated, begin=span.begin, stabilisation=stabilisation)
    if end < span.end:
        tell(f"an event ends the run: compared are the rows up to {end:.6g} s")
    return replace(span, end=end)


def run_variants(
    jobs: Sequence[Job], pool: Pool, progress: Callable[[int, int], None] = lambda done, total: None
) -> list[Outcome | Failure]:
    """The outcome of every job, in their order."""
    found: list[Outcome | Failure] = [Failure("did not run")] * len(jobs)
    progress(0, len(jobs))
    for done, (k, outcome) in enumerate(pool.results(perform, jobs), start=1):
        found[k] = outcome
        progress(done, len(jobs))
    return found


def point_of(variant: Variant, outcome: Outcome, found: Reference) -> Point:
    """Cost and errors of a variant."""
    errors = {name: distance(values, found.values[name]) for name, values in outcome.values.items()}
    return Point(
        variant.method,
        variant.model.label,
        variant.label,
        variant.kind,
        variant.number,
        errors,
        spread(outcome.wall),
        spread(outcome.cpu),
        outcome.evaluations,
    )


def spread(times: Sequence[float]) -> tuple[float, float, float]:
    """Median, least and greatest."""
    return statistics.median(times), min(times), max(times)
