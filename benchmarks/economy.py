"""Models that `economise` finds for the benchmark set, against an exhaustive grid of models and against the full model.

    python -m benchmarks.economy [--no-grid | --statements] [--unseen] [case ...]

First it prints whether what is said of a model is true: of verified ones whether they keep their tolerances within the error
that the verification names, of those without verification whether they keep their tolerances; against everything with at
least four times their steps, known to a tenth of the tolerance by convergence. `--statements` ends there. `--unseen` takes
the scenes of `benchmarks.unseen`, on which nothing was chosen.

For every case and the tolerances 1e-2, 1e-3 and 1e-4 it prints: whether the true errors are within the tolerance; the
processor time of the time loop of the chosen model; how many times as long other ways take:

    grid     the cheapest model and step of a grid that meets the tolerance (1 at best)
    same     everything (all modes, all terms, all bodies flexible) in space, with the method and step of the chosen model
    own      everything as `ffr-dyn run` takes it, in the plane where there is one, with its default method and the longest
             step that meets the tolerance
    best     the same with the cheapest of all methods
    default  the same with the default method and step, whether that meets the tolerance or not
    space    as `own`, in space: everything that `economise` decides on left as it is but the step
    all      as `default`, in space: everything left as it is

the cost of the search beyond one verification, in runs of the chosen model by the cost model (the summary has that of a
search without verification, too), and as the processor time of all of a search without verification over that of a whole run
of the chosen model, assembly and outputs included; the effectivity, estimated over true error, of every output. True errors
are against everything on with a much finer step.

The grid: every set of flexible bodies (every single one and all, where there are more than three), with 1, 2, 3, 6 and all
coordinates of each, statically complete, in the plane where there is one; stiffening on and off; every method with 1, 2, 3,
4, 6, 8, 12, ... steps to an output row. Inertia terms stay on in it.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from ffr_gallery.scene_set import CASES, Case

from benchmarks.unseen import UNSEEN
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.analyses.run import run as whole_run
from ffr_dyn.economy.cache import Ledger
from ffr_dyn.economy.cost import of_run, per_evaluation, per_row
from ffr_dyn.economy.model_choice import Choice, Part, orthonormal
from ffr_dyn.economy.outputs import difference, largest
from ffr_dyn.economy.result import Economy
from ffr_dyn.economy.run import Span, Trial, make, run
from ffr_dyn.economy.search import economise
from ffr_dyn.economy.steps import methods
from ffr_dyn.economy.verification import Known, sharpened
from ffr_dyn.functions.stopwatch import Stopwatch
from ffr_dyn.scene.scene import Scene
from ffr_dyn.variants.mean_axis import with_mean_axis_bodies
from ffr_dyn.variants.variant import STIFFENING, basis_of
from ffr_prep.body import truncated
from ffr_prep.common.errors import ComputationError, InputError

Array = np.ndarray

TOLERANCES = (1e-2, 1e-3, 1e-4)
COUNTS = (1, 2, 3, 6, 99)
DIVISIONS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128)
FINE = (*DIVISIONS, 192, 256, 384, 512, 768, 1024)
REPEATS = (4, 20)  # at least, and at most while they take less than a second
FLOOR = 16  # steps to a row, at least, that tell what no finer step will mend
CLOCKED = 3  # models of the grid whose runs are timed, the cheapest by the cost model
LOW, HIGH = 0.3, 5.0  # effectivity that is asked for
SHARP, LONG = 0.1, 3e8  # of a tolerance, to which the truth is wanted, and what that may cost [us]


@dataclass(frozen=True)
class Row:
    """The outcome for a case and a tolerance; times [s] of processor."""

    case: str
    tolerance: float
    found: Economy
    error: Array
    chosen: float
    grid: float
    same: float
    own: float
    best: float
    default: float
    space: float
    all: float
    alone: float  # cost of a search without verification, over that of a run
    search: float  # all of its time, over all of a run

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


def truth(scene: Scene, found: list[Economy], span: Span) -> Known:
    """Everything on, with at least four times the steps of the finest model as far as an output step is divided, known to a
    tenth of the least tolerance."""
    of, least = found[0].probe, np.min([one.limits for one in found], axis=0)
    ledger = Ledger(scene, span, of, lambda stage: None)
    parts = [one.choice for one in found[0].tried if one.what == "full model"]
    everything = parts[0] if parts else replace(full_model(found[0]), method="ros3")
    finest = max(one.choice.divisions for one in found)
    return sharpened(ledger, everything, SHARP * least, min(4 * finest, ledger.policy.most_divisions), LONG)


@dataclass(frozen=True)
class Statement:
    """The error told of a model, and its true error, both in tolerances.

    verified : None where no verification was asked for, else whether there is one
    """

    case: str
    tolerance: float
    verified: bool | None
    said: float
    true: float
    known: float

    @property
    def is_true(self) -> bool:
        """Within the tolerance; where verified, within the error that is named too, but for that of the truth."""
        return self.true <= 1.0 and (not self.verified or self.true <= self.said + self.known)


def statements(one: Case) -> Iterator[Statement]:
    """Of all tolerances, verified and not."""
    scene, span = with_mean_axis_bodies(one.scene()), Span(0.0, one.end, one.output_step)
    how = {"end": one.end, "output_step": one.output_step}
    asked = [(tolerance, verify) for tolerance in TOLERANCES for verify in (True, False)]
    found = [economise(scene, one.outputs, tolerance=tolerance, verify=verify, **how) for tolerance, verify in asked]
    sharp = truth(scene, found, span)
    for (tolerance, _), economy in zip(asked, found, strict=True):
        check, limits = economy.verification, economy.limits
        true = true_error(scene, economy.choice, span, economy, sharp.trial) / limits
        said = economy.error if check is None else check.error
        is_known = None if check is None else check.is_known
        yield Statement(one.name, tolerance, is_known, (said / limits).max(), true.max(), (sharp.own / limits).max())


def tell_statements(cases: Iterable[Case]) -> None:
    """Print them, and how many are true."""
    found = []
    print(f"{'case':17} {'tol':>6} {'model':11}{'said':>8}{'true':>8}{'known to':>10}  [tolerances]")
    for one in cases:
        for said in statements(one):
            found.append(said)
            words = {True: "verified", False: "estimated", None: "unverified"}[said.verified]
            wrong = "" if said.is_true else "  WRONG"
            print(
                f"{said.case:17} {said.tolerance:6.0e} {words:11}{said.said:8.2g}{said.true:8.2g}{said.known:10.1g}{wrong}",
                flush=True,
            )
    for words, verified in (
        ("verified", True),
        ("estimated where asked to verify", False),
        ("without verification", None),
    ):
        listed = [said.is_true for said in found if said.verified is verified]
        if listed:
            print(f"{words}: {sum(listed)} of {len(listed)} true")
    print()


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
                cost = of_run(choice, span.rows)
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
    key = (id(reference), replace(model, method="ros3", divisions=max(FLOOR, found.choice.divisions)))
    if key not in _FLOOR:
        _FLOOR[key] = true_error(scene, key[1], span, found, reference)
    open_to = [t for t in TOLERANCES if (error > t * scales).any()]
    return not any((_FLOOR[key] <= 1.5 * t * scales).all() for t in open_to) and divisions >= 2


def true_error(scene: Scene, choice: Choice, span: Span, found: Economy, reference: Trial) -> Array:
    """(outputs,) largest error of a model; infinite where its run fails."""
    try:
        return largest(difference(run(make(scene, choice, span), choice, span, found.probe).values, reference.values))
    except (ComputationError, InputError):
        return np.full(len(found.limits), np.inf)


# ---- time -----------------------------------------------------------------------------------------------------------


def processor_time(scene: Scene, choice: Choice, span: Span) -> float:
    """[s] of the time loop of a run, the least of some repetitions."""
    made, method = make(scene, choice, span), choice.integrator(span.output_step)
    times: list[float] = []
    while len(times) < REPEATS[0] or (len(times) < REPEATS[1] and sum(times) < 1.0):
        watch = Stopwatch()
        integrate(
            made.scene,
            end=span.end,
            output_step=span.output_step,
            method=method,
            outputs=("constraint.position",),
            stopwatch=watch,
            assembled=made.assembled,
        )
        times.append(watch.cpu)
    return min(times)


def least_time(job: Callable[[], object], repeats: int) -> float:
    """[s] of processor, the least of some repetitions."""
    times: list[float] = []
    for _ in range(repeats):
        began = time.process_time()
        job()
        times.append(time.process_time() - began)
    return min(times)


def unverified(one: Case, scene: Scene, tolerance: float) -> tuple[float, float]:
    """A search without verification in runs of what it finds: by the cost model, and by processor time."""

    def search() -> Economy:
        return economise(
            scene, one.outputs, end=one.end, output_step=one.output_step, tolerance=tolerance, verify=False
        )

    found = search()
    took = least_time(search, 2) / least_time(lambda: whole_run(found.scene, found.settings), 3)
    return found.search_cost / found.cost, took


# ---- the benchmark --------------------------------------------------------------------------------------------------


def rows_of(one: Case, *, with_grid: bool) -> Iterator[Row]:
    scene, span = with_mean_axis_bodies(one.scene()), Span(0.0, one.end, one.output_step)
    found = [
        economise(scene, one.outputs, end=one.end, output_step=one.output_step, tolerance=tolerance, verify=True)
        for tolerance in TOLERANCES
    ]
    reference = truth(scene, found, span).trial
    grid = cheapest(scene, span, reference, found[-1]) if with_grid else {tolerance: [] for tolerance in TOLERANCES}
    for tolerance, economy in zip(TOLERANCES, found, strict=True):
        choice, everything = economy.choice, replace(reference.choice, accuracy=0.0)
        chosen = processor_time(scene, choice, span)
        times = [chosen if same(other, choice) else processor_time(scene, other, span) for other in grid[tolerance]]
        limit, full = tolerance * economy.scales, full_model(economy)
        own = enough(scene, everything, ("ros2",), span, economy, reference, limit)
        yield Row(
            one.name,
            tolerance,
            economy,
            true_error(scene, choice, span, economy, reference),
            chosen,
            min(times, default=np.nan),
            processor_time(scene, replace(full, method=implicit(choice), divisions=choice.divisions), span),
            processor_time(scene, own, span),
            processor_time(scene, enough(scene, everything, methods(span), span, economy, reference, limit), span),
            processor_time(scene, replace(everything, method="ros2", divisions=10), span),
            processor_time(scene, replace(full, method=own.method, divisions=own.divisions), span),
            processor_time(scene, replace(full, method="ros2", divisions=10), span),
            *unverified(one, scene, tolerance),
        )


def enough(
    scene: Scene,
    everything: Choice,
    names: tuple[str, ...],
    span: Span,
    found: Economy,
    reference: Trial,
    limit: Array,
) -> Choice:
    """The cheapest of some methods on everything with the longest step that keeps the errors below a limit."""
    best = replace(everything, method="ros3", divisions=reference.choice.divisions)
    for name in names:
        for divisions in FINE:
            choice = replace(everything, method=name, divisions=divisions)
            if per_row(choice) >= per_row(best):
                break
            if (true_error(scene, choice, span, found, reference) <= limit).all():
                best = choice
    return best


def same(one: Choice, other: Choice) -> bool:
    """Whether two models take the same time: as many coordinates of each body, the same stiffening, plane and steps."""
    sizes = [([(part.count, part.stiffened) for part in c.parts], c.plane, c.method, c.divisions) for c in (one, other)]
    return sizes[0] == sizes[1]


def implicit(choice: Choice) -> str:
    """The method of a model, or, where that is explicit or chooses its steps, one for everything at the same step."""
    return choice.method if choice.method in ("ros2", "ros3") else "ros3"


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
        f"{row.chosen / row.grid:7.2f}{row.same / row.chosen:7.1f}{row.own / row.chosen:7.1f}{row.best / row.chosen:7.1f}"
        f"{row.default / row.chosen:8.1f}{row.space / row.chosen:7.1f}{row.all / row.chosen:7.1f}"
        f"{_searched(row):8.1f}{row.search:6.1f}{repaired:4d}   {coordinates:20} {effectivity}"
    )


HEAD = (
    f"{'case':17} {'tol':>6} {'met':4}{'worst':>5} {'plane':5}{'method':9}{'ms':>7}{'/grid':>7}"
    f"{'same/':>7}{'own/':>7}{'best/':>7}{'default/':>8}{'space/':>7}{'all/':>7}{'search':>8}{'time':>6}{'rep':>4}"
    f"   {'coordinates':20} effectivity"
)


def summary(rows: list[Row]) -> Iterator[str]:
    """The goals for the whole set, and the outcome."""
    over = [row.chosen / row.grid for row in rows if np.isfinite(row.grid)]
    every = [(row, k, float(e)) for row in rows for k, e in enumerate(row.effectivity)]
    inside = [LOW <= e <= HIGH for _, _, e in every]
    yield f"tolerances met         {sum(row.met for row in rows)} of {len(rows)}"
    if over:
        yield f"within 2x of the grid  {sum(value <= 2 for value in over)} of {len(over)}; largest {max(over):.2f}"
    for text, values in (
        ("everything, same step  ", [row.same / row.chosen for row in rows]),
        ("everything, own step   ", [row.own / row.chosen for row in rows]),
        ("everything, best method", [row.best / row.chosen for row in rows]),
        ("everything, default    ", [row.default / row.chosen for row in rows]),
        ("in space, own step     ", [row.space / row.chosen for row in rows]),
        ("in space, default      ", [row.all / row.chosen for row in rows]),
    ):
        yield f"{text} {np.median(values):.1f} times the chosen model in the median, {min(values):.1f} at least"
    for text, values in (
        ("search, cost model     ", [_searched(row) for row in rows]),
        ("search, unverified     ", [row.alone for row in rows]),
        ("search, processor time ", [row.search for row in rows]),
    ):
        yield f"{text} {np.median(values):.1f} runs of the chosen model in the median, {max(values):.1f} at most"
    yield f"effectivity            {sum(inside)} of {len(every)} ({100 * np.mean(inside):.0f} %) within {LOW} to {HIGH}"
    for (row, k, value), good in zip(every, inside, strict=True):
        if not good:
            yield f"  outside: {row.case}, {row.tolerance:.0e}, {row.found.probe.outputs[k].name}: {value:.2f}"


def _searched(row: Row) -> float:
    """Cost of the search beyond one verification, in runs of the chosen model."""
    return row.found.search_cost / row.found.cost


def main() -> None:
    """Print the statements and the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", nargs="*", metavar="case", help=", ".join(case.name for case in [*CASES, *UNSEEN]))
    parser.add_argument("--unseen", action="store_true", help="the scenes on which nothing was chosen")
    parser.add_argument("--statements", action="store_true", help="only whether what is said of a model is true")
    parser.add_argument("--no-grid", action="store_true", help="without the search of all models for the cheapest")
    given = parser.parse_args()
    listed = UNSEEN if given.unseen else CASES
    if strange := {*given.cases} - {case.name for case in listed}:
        parser.error(f"no case {sorted(strange)[0]!r}; there are {', '.join(case.name for case in listed)}")
    cases, rows = [case for case in listed if not given.cases or case.name in given.cases], []
    tell_statements(cases)
    if given.statements:
        return
    print(HEAD)
    for one in cases:
        for row in rows_of(one, with_grid=not given.no_grid):
            rows.append(row)
            print(line(row), flush=True)
    print("\nu: without stiffening; rep: refinements after verification\n")
    print("\n".join(summary(rows)))


if __name__ == "__main__":
    main()
