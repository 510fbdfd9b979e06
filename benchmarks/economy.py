"""What `economise` finds for the benchmark set, against an exhaustive grid of models and against the full model.

    python -m benchmarks.economy [--no-grid] [case ...]

For every case and the tolerances 1e-2, 1e-3 and 1e-4 it prints: whether the true errors are within the tolerance; the
processor time of a run of the chosen model, against the cheapest model and step of a grid that meets the tolerance, and
against the full model (all modes, all terms, everything flexible, in space) with the same step and with the default step; the
cost of the search in runs of the chosen model; and the effectivity, estimated over true error, of every output. True errors
are against everything on with a much finer step.

The grid: every set of flexible bodies (every single one and all, where there are more than three), with 1, 2, 3, 6 and all
coordinates of each, statically complete, in the plane where there is one; stiffening on and off; every method with 1, 2, 3,
4, 6, 8, 12, ... steps to an output row. Inertia terms stay on in it: leaving them out does not make an evaluation cheaper.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from benchmarks.scene_set import CASES, Case, case
from ffr_dyn.analyses.forward import forward
from ffr_dyn.economy.choice import Choice, Part, applied, orthonormal
from ffr_dyn.economy.cost import of_run, per_evaluation
from ffr_dyn.economy.outputs import difference, largest
from ffr_dyn.economy.search import Economy, economise
from ffr_dyn.economy.steps import methods
from ffr_dyn.economy.trial import Span, Trial, run
from ffr_dyn.errors import InputError, SimulationError
from ffr_dyn.integrators import METHODS
from ffr_dyn.scene import Scene
from ffr_dyn.variant import STIFFENING, basis_of
from ffr_prep.body import truncated

Array = np.ndarray

TOLERANCES = (1e-2, 1e-3, 1e-4)
COUNTS = (1, 2, 3, 6, 99)
DIVISIONS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128)
REPEATS = (4, 20)  # at least, and at most while they take less than a second
CLOCKED = 3  # models of the grid whose runs are timed, the cheapest by the cost model
LOW, HIGH = 0.3, 5.0  # effectivity that is asked for


@dataclass(frozen=True)
class Row:
    """What came out for a case and a tolerance; times [s] of processor."""

    case: str
    tolerance: float
    found: Economy
    error: Array
    chosen: float
    grid: float
    full: float
    default: float

    @property
    def met(self) -> bool:
        return bool((self.error <= self.found.limits).all())

    @property
    def effectivity(self) -> Array:
        """(outputs,) of the model that the estimates had chosen."""
        verified = self.found.verification
        true = self.error if verified is None else verified.first
        return self.found.error / np.maximum(true, 1e-300)


# ---- truth ----------------------------------------------------------------------------------------------------------


def truth(scene: Scene, found: list[Economy], span: Span) -> Trial:
    """Everything on, with the finest step of all verifications, or four times the steps of the finest model."""
    finest = max(found, key=lambda one: one.choice.divisions * (3 if one.choice.method == "ros3" else 1))
    if finest.verification is not None:
        choice = finest.verification.choice
    else:
        everything = next(one.choice for one in finest.tried if one.what == "everything")
        choice = replace(everything, divisions=2 * finest.choice.divisions)
    return run(scene, choice, span, finest.probe)


# ---- the grid -------------------------------------------------------------------------------------------------------


def models(scene: Scene, everything: Choice) -> Iterator[Choice]:
    """The models of the grid, of one method and step."""
    flexible = [b for b, part in enumerate(everything.parts) if part.modes]
    sets = [s for k in range(len(flexible) + 1) for s in combinations(flexible, k)]
    if len(flexible) > 3:
        sets = [(), *((b,) for b in flexible), tuple(flexible)]
    for chosen in sets:
        for count in COUNTS if chosen else (0,):
            for dropped in ((), (STIFFENING,)) if chosen else ((),):
                parts = [
                    _part(scene, b, part, count if b in chosen else 0, dropped)
                    for b, part in enumerate(everything.parts)
                ]
                yield replace(everything, parts=tuple(parts))


def _part(scene: Scene, b: int, part: Part, count: int, dropped: tuple[str, ...]) -> Part:
    if count == 0 or not part.modes:
        return replace(part, modes=(), dropped=())
    if count >= len(part.modes):
        return replace(part, dropped=dropped)
    model = truncated(scene.bodies[b].model, np.array(part.modes))
    V = orthonormal(basis_of(model, count), model.omega2)
    return replace(part, dropped=dropped, shapes=tuple(tuple(float(v) for v in column) for column in V.T))


def cheapest(scene: Scene, span: Span, reference: Trial, found: Economy) -> dict[float, list[Choice]]:
    """By tolerance, the models of the grid that meet it at the least cost by the cost model, the cheapest first."""
    best: dict[float, list[tuple[float, int, Choice]]] = {tolerance: [] for tolerance in TOLERANCES}
    scales = found.limits / np.array([output.tolerance for output in found.probe.outputs])
    listed = sorted(dict.fromkeys(models(scene, reference.choice)), key=per_evaluation)
    number = 0
    for model in listed:
        for method in methods(span):
            for divisions in DIVISIONS:
                choice = replace(model, method=method, divisions=divisions)
                cost = of_run(scene, choice, span.rows)
                if all(len(best[t]) >= CLOCKED and cost >= best[t][-1][0] for t in TOLERANCES):
                    break
                error = true_error(scene, choice, span, found, reference)
                for tolerance in TOLERANCES:
                    if (error <= tolerance * scales).all():
                        number += 1
                        best[tolerance] = sorted([*best[tolerance], (cost, number, choice)])[:CLOCKED]
                if (error <= min(TOLERANCES) * scales).all():
                    break
                if _hopeless(scene, model, span, found, reference, scales, divisions, error):
                    break
    return {tolerance: [one[2] for one in listed] for tolerance, listed in best.items()}


_FLOOR: dict[tuple[int, Choice], Array] = {}


def _hopeless(
    scene: Scene,
    model: Choice,
    span: Span,
    found: Economy,
    reference: Trial,
    scales: Array,
    divisions: int,
    error: Array,
) -> bool:
    """Whether no step makes a model good enough for a tolerance that it does not meet yet: its error with a fine step."""
    key = (id(reference), replace(model, method="ros3", divisions=16))
    if key not in _FLOOR:
        _FLOOR[key] = true_error(scene, key[1], span, found, reference)
    open_to = [t for t in TOLERANCES if (error > t * scales).any()]
    return not any((_FLOOR[key] <= 1.5 * t * scales).all() for t in open_to) and divisions >= 2


def true_error(scene: Scene, choice: Choice, span: Span, found: Economy, reference: Trial) -> Array:
    """(outputs,) largest error of a model; infinite where its run fails."""
    try:
        return largest(difference(run(scene, choice, span, found.probe).values, reference.values))
    except (SimulationError, InputError):
        return np.full(len(found.limits), np.inf)


# ---- time -----------------------------------------------------------------------------------------------------------


def processor_time(scene: Scene, choice: Choice, span: Span) -> float:
    """[s] of the time loop of a run: a whole run less one of two output rows, the least of some repetitions."""
    made, method = applied(scene, choice), choice.integrator(span.output_step)

    def clocked(end: float) -> float:
        def once() -> None:
            forward(made, end=end, output_step=span.output_step, method=method, outputs=("constraint.position",))

        return least_time(once)

    return max(clocked(span.end) - clocked(2 * span.output_step), 1e-6)


def least_time(job: Callable[[], None]) -> float:
    times: list[float] = []
    while len(times) < REPEATS[0] or (len(times) < REPEATS[1] and sum(times) < 1.0):
        began = time.process_time()
        job()
        times.append(time.process_time() - began)
    return min(times)


# ---- the benchmark --------------------------------------------------------------------------------------------------


def rows_of(one: Case, *, with_grid: bool) -> Iterator[Row]:
    scene, span = one.scene(), Span(0.0, one.end, one.output_step)
    found = [
        economise(scene, one.outputs, end=one.end, output_step=one.output_step, tolerance=tolerance, verify=True)
        for tolerance in TOLERANCES
    ]
    reference = truth(scene, found, span)
    grid = cheapest(scene, span, reference, found[-1]) if with_grid else {tolerance: [] for tolerance in TOLERANCES}
    spatial = full_model(found[0])
    default = processor_time(scene, replace(spatial, method="ros2", divisions=10), span)
    for tolerance, economy in zip(TOLERANCES, found, strict=True):
        choice = economy.choice
        chosen = processor_time(scene, choice, span)
        times = [chosen if same(other, choice) else processor_time(scene, other, span) for other in grid[tolerance]]
        yield Row(
            one.name,
            tolerance,
            economy,
            true_error(scene, choice, span, economy, reference),
            chosen,
            min(times, default=np.nan),
            processor_time(scene, replace(spatial, method=implicit(choice), divisions=choice.divisions), span),
            default,
        )


def same(one: Choice, other: Choice) -> bool:
    """Whether two models take the same time: as many coordinates of each body, the same stiffening, plane and steps."""
    sizes = [([(part.count, part.stiffened) for part in c.parts], c.plane, c.method, c.divisions) for c in (one, other)]
    return sizes[0] == sizes[1]


def implicit(choice: Choice) -> str:
    """The method of a model, or, where that is explicit, one that everything can be run with at its step."""
    return choice.method if METHODS[choice.method].implicit else "ros3"


def full_model(found: Economy) -> Choice:
    """All modes, all terms, in space."""
    parts = tuple(Part(tuple(range(body.model.n))) for body in found.original.bodies)
    return replace(found.choice, parts=parts, plane="none")


def line(row: Row) -> str:
    found = row.found
    coordinates = " ".join(
        f"{part.count}{'' if part.stiffened or not part.count else 'u'}" for part in found.choice.parts
    )
    effectivity = " ".join(f"{value:.2f}" for value in row.effectivity)
    verified = found.verification
    repaired = verified.attempts if verified else 0
    return (
        f"{row.case:17} {row.tolerance:6.0e} {'yes' if row.met else 'NO ':4}{(row.error / found.limits).max():5.2f} "
        f"{found.choice.plane:5}{found.choice.method}/{found.choice.divisions:<4d}{1e3 * row.chosen:8.2f}"
        f"{row.chosen / row.grid:7.2f}{row.full / row.chosen:7.1f}{row.default / row.chosen:8.1f}"
        f"{found.search_cost / found.cost:8.1f}{repaired:4d}   {coordinates:20} {effectivity}"
    )


HEAD = (
    f"{'case':17} {'tol':>6} {'met':4}{'worst':>5} {'plane':5}{'method':9}{'ms':>7}{'/grid':>7}{'full/':>7}{'default/':>8}"
    f"{'search':>8}{'rep':>4}   {'coordinates':20} effectivity"
)


def summary(rows: list[Row]) -> Iterator[str]:
    """What is asked of the whole set, and what came out."""
    gains, against = ([value(row) for row in rows] for value in (_gain, _against_default))
    over = [_over_grid(row) for row in rows if np.isfinite(row.grid)]
    every = [(row, k, float(e)) for row in rows for k, e in enumerate(row.effectivity)]
    inside = [LOW <= e <= HIGH for _, _, e in every]
    yield f"tolerances met         {sum(row.met for row in rows)} of {len(rows)}"
    if over:
        yield f"within 2x of the grid  {sum(value <= 2 for value in over)} of {len(over)}; largest {max(over):.2f}"
    yield f"full, same step        {np.median(gains):.1f} times the chosen model in the median, {min(gains):.1f} at least"
    yield f"full, default step     {np.median(against):.1f} times in the median, {min(against):.1f} at least"
    search = [row.found.search_cost / row.found.cost for row in rows]
    yield f"search                 {np.median(search):.1f} runs of the chosen model in the median, {max(search):.1f} at most"
    yield f"effectivity            {sum(inside)} of {len(every)} ({100 * np.mean(inside):.0f} %) within {LOW} to {HIGH}"
    for (row, k, value), good in zip(every, inside, strict=True):
        if not good:
            yield f"  outside: {row.case}, {row.tolerance:.0e}, {row.found.probe.outputs[k].name}: {value:.2f}"


def _over_grid(row: Row) -> float:
    return row.chosen / row.grid


def _gain(row: Row) -> float:
    return row.full / row.chosen


def _against_default(row: Row) -> float:
    return row.default / row.chosen


def main() -> None:
    print(HEAD)
    rows = []
    names = [name for name in sys.argv[1:] if name != "--no-grid"]
    for one in [case(name) for name in names] or CASES:
        for row in rows_of(one, with_grid="--no-grid" not in sys.argv):
            rows.append(row)
            print(line(row), flush=True)
    print("\nu: without stiffening; rep: refinements after verification\n")
    print("\n".join(summary(rows)))


if __name__ == "__main__":
    main()
