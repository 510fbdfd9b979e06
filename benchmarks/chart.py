"""Speed against accuracy of the benchmark set, with Exudyn 1.13 beside it: the picture of the README.

    python -m benchmarks.chart [--quick] [--only NAME] [--picture docs/pictures/work_precision]

The picture shows the deflections; the one with the positions, interactive pages and tables go to the folder out.

Scenes: the slider-crank at 150 rad/s (0.084 s) with 8 and 32 elastic coordinates of its rod, the flexible pendulum stiff and
soft (0.5 s, 8), a chain of 8 links (0.2 s, 8 each). Errors: of the last point's position and of the *elastic deflection* in
the middle of a rod from its chord, largest over all output times, relative to the extent of the motion and to the largest
deflection, from a reference that `ffr_dyn.chart` computes and verifies. Both codes get the same modes, stiffness, mass,
joints, gravity and initial state, in space, without geometric stiffening, which Exudyn does not have.

Costs: CPU time of one thread; ours of the compiled loop, Exudyn's of its solver less that of a run of two steps. Medians of
several runs, bars from the least to the greatest. Exudyn is its build without range checks, its bodies consist of mass terms
and interface nodes instead of the mesh; of its frame coordinates, linear solvers and Newton iterations (full, modified) the
fastest that finds the motion at a middle step size is taken for each scene: generalised alpha of index 3, iterated to 1e-6.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

sys.exudynFast = True  # type: ignore[attr-defined]  # read where exudyn is first imported

from benchmarks.exudyn_twin import EULER_PARAMETERS, TAIT_BRYAN, exu, items, quiet, settings, twin  # noqa: E402
from benchmarks.scenes import (  # noqa: E402
    chain,
    connecting_rod,
    meshed_body,
    pendulum,
    pendulum_rod,
    slider_crank,
    with_middle,
)
from ffr_dyn.chart.diagram import CPU, Diagram, Lost, Point, spread, work_precision  # noqa: E402
from ffr_dyn.chart.draw import draw_chart  # noqa: E402
from ffr_dyn.chart.measures import Measure, Quantity  # noqa: E402
from ffr_dyn.chart.orders import order_words, orders  # noqa: E402
from ffr_dyn.chart.page import write_page  # noqa: E402
from ffr_dyn.chart.reference import distance  # noqa: E402
from ffr_dyn.chart.runner import Span, pool  # noqa: E402
from ffr_dyn.chart.table import write_table  # noqa: E402
from ffr_dyn.chart.variants import FULL  # noqa: E402
from ffr_dyn.consistency.assemble import Assembled, assemble, in_space  # noqa: E402
from ffr_dyn.results.result import Result  # noqa: E402
from ffr_dyn.scene.scene import Scene  # noqa: E402
from ffr_prep.body import FlexibleBody  # noqa: E402
from ffr_prep.model.material import Material  # noqa: E402

Array = np.ndarray

EXUDYN = "Exudyn"
LINEAR_SOLVERS = ("EXUdense", "EigenSparse")
SHORTEST = 0.3  # s of CPU time that repeats of one run of Exudyn add up to
ACCURACY = 1e-3  # relative, at which costs are compared


@dataclass(frozen=True)
class Sag:
    """Offset (T, 3), global axes, of a marker from its place on the chord between two others."""

    name: str
    marker: str
    ends: tuple[str, str]
    share: float
    unit: str = "m"
    words: str = "elastic deflection"

    @property
    def outputs(self) -> tuple[str, ...]:
        return tuple(f"{marker}.position" for marker in (self.marker, *self.ends))

    def of(self, at: dict[str, Array]) -> Array:
        """From positions by marker."""
        start, end = (at[marker] for marker in self.ends)
        return at[self.marker] - (1 - self.share) * start - self.share * end

    def values(self, result: Result) -> Array:
        return self.of({marker: result[f"{marker}.position"] for marker in (self.marker, *self.ends)})

    def scale(self, result: Result) -> float:
        return float(np.linalg.norm(self.values(result), axis=1).max())


@dataclass(frozen=True)
class Case:
    """A scene, over which time, what is measured, and how often Exudyn's step is halved from the output step."""

    name: str
    scene: Scene
    span: Span
    tip: str
    rod: str
    halvings: int

    @property
    def steps(self) -> tuple[float, ...]:
        """Of Exudyn [s]."""
        return tuple(self.span.output_step / 2**k for k in range(self.halvings + 1))


def soft_rod() -> FlexibleBody:
    metal = Material("soft metal", 7e9, 0.3, 5540.0)
    return meshed_body("pendulum.geo", "rod", metal, ("hinge", "tip"), "rigid", 2).body


def cases() -> Iterator[Case]:
    """The benchmark set; six static shapes come to the number of fixed-interface modes."""
    for modes in (2, 26):
        rod = with_middle(connecting_rod("rigid", modes).body)
        yield Case(
            f"slider-crank, {rod.n} modes", in_space(slider_crank(rod)), Span(0.084, 1e-3), "slider.pin", "rod", 6
        )
    for name, rod in (("stiff", pendulum_rod("rigid", 2).body), ("soft", soft_rod())):
        rod = with_middle(rod)
        yield Case(f"{name} pendulum, {rod.n} modes", in_space(pendulum(rod)), Span(0.5, 0.01), "rod.tip", "rod", 7)
    link = with_middle(pendulum_rod("rigid", 2).body)
    scene = in_space(chain(link, 8, "revolute"))
    yield Case(f"chain of 8 links, {link.n} modes each", scene, Span(0.2, 0.005), "link7.tip", "link0", 5)


def measures_of(case: Case) -> tuple[Measure, Sag]:
    body = next(body for body in case.scene.bodies if body.name == case.rod)
    names = [interface.name for interface in body.model.interfaces]
    start, end, middle = (interface.position for interface in body.model.interfaces)
    chord = end - start
    share = float((middle - start) @ chord / (chord @ chord))
    sag = Sag("deflection", f"{case.rod}.middle", (f"{case.rod}.{names[0]}", f"{case.rod}.{names[1]}"), share)
    return Quantity("position", f"{case.tip}.position", "m", f"position of {case.tip}", moves=True), sag


# ---- Exudyn -------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Way:
    """Frame coordinates, linear solver, and whether Newton's iterations are modified."""

    frame: str
    solver: str
    modified: bool


def solver_settings(way: Way, end: float, steps: int) -> Any:
    s = settings(end, steps)
    s.timeIntegration.newton.relativeTolerance = 1e-6
    s.timeIntegration.newton.absoluteTolerance = 1e-8
    s.timeIntegration.newton.useModifiedNewton = way.modified
    s.linearSolver.solverType = getattr(exu.LinearSolverType, way.solver)
    return s


def solve(case: Case, start: Assembled, way: Way, step: float, sensors: bool) -> tuple[float, dict[str, Array]]:
    """CPU time [s] of a run, and the positions of markers at the output times where sensors are wanted.

    Raises RuntimeError when Exudyn does not reach the end.
    """
    made = twin(case.scene, start.x, start.v, node_type=way.frame)
    measured = measures_of(case)
    names = [case.tip, measured[1].marker, *measured[1].ends]
    numbers = {}
    if sensors:
        for name in names:
            sensor = items.SensorMarker(
                markerNumber=made.markers[name], outputVariableType=exu.OutputVariableType.Position,
                storeInternal=True, writeToFile=False,
            )  # fmt: skip
            numbers[name] = made.mbs.AddSensor(sensor)
    made.mbs.Assemble()
    s = solver_settings(way, case.span.end, round(case.span.end / step))
    s.solution.sensors.active = sensors
    s.solution.sensors.writePeriod = case.span.output_step
    began = time.process_time()
    done = made.mbs.SolveDynamic(s, solverType=exu.DynamicSolverType.GeneralizedAlpha)
    took = time.process_time() - began
    if not done:
        raise RuntimeError("Newton's iterations did not converge")
    short = solver_settings(way, 2 * step, 2)
    short.solution.sensors.active = False
    began = time.process_time()
    made.mbs.SolveDynamic(short, solverType=exu.DynamicSolverType.GeneralizedAlpha)
    starting = time.process_time() - began
    return max(took - starting, 1e-9), {name: made.mbs.GetSensorStoredData(k)[:, 1:] for name, k in numbers.items()}


def best_way(case: Case, start: Assembled, found: Diagram) -> Way:
    """The fastest at the middle step size that finds the motion."""
    step = case.steps[len(case.steps) // 2]
    tried = []
    for way in product((EULER_PARAMETERS, TAIT_BRYAN), LINEAR_SOLVERS, (False, True)):
        with contextlib.suppress(RuntimeError):
            took, at = solve(case, start, Way(*way), step, sensors=True)
            far = distance(at[case.tip], found.reference.values["position"]) / found.scale("position")
            tried.append((far > 0.1, took, way))
    return Way(*min(tried)[2])


def exudyn(case: Case, found: Diagram, repeats: int) -> tuple[list[Point], list[Lost]]:
    """Exudyn's points on a diagram."""
    start = assemble(case.scene)
    points, lost = [], []
    with quiet():
        way = best_way(case, start, found)
        for step in case.steps:
            label = f"{EXUDYN}, step {step:.4g} s, {way.frame.partition('.')[2]}, {way.solver}"
            label += ", modified Newton" if way.modified else ""
            try:
                _, at = solve(case, start, way, step, sensors=True)
                times = [solve(case, start, way, step, sensors=False)[0]]
                while len(times) < repeats or (sum(times) < SHORTEST and len(times) < 3 * repeats):
                    times.append(solve(case, start, way, step, sensors=False)[0])
            except RuntimeError as error:
                lost.append(Lost(EXUDYN, FULL.label, label, "step", step, str(error)))
                continue
            errors = {
                "position": distance(at[case.tip], found.reference.values["position"]),
                "deflection": distance(measures_of(case)[1].of(at), found.reference.values["deflection"]),
            }
            clocked = spread(times)
            points.append(Point(EXUDYN, FULL.label, label, "step", step, errors, clocked, clocked))
    return points, lost


# ---- tables -------------------------------------------------------------------------------------------------------


def cost_at(found: Diagram, measure: str, series: str) -> float:
    """CPU time at which a code's Pareto front reaches `ACCURACY`, by logarithmic interpolation; nan where it does not."""
    points = [p for p in found.points if (p.series == EXUDYN) == (series == EXUDYN)]
    points = [p for p in points if series in (EXUDYN, "ffr") or p.series == series]
    front = [(p.cost(CPU), p.errors[measure] / found.scale(measure)) for p in points]
    reached = sorted(cost for cost, error in front if error <= ACCURACY)
    if not reached:
        return float("nan")
    after = min((c, e) for c, e in front if e <= ACCURACY)
    before = [(c, e) for c, e in front if c < after[0] and e > ACCURACY]
    if not before:
        return after[0]
    c, e = max(before)
    share = np.log(e / ACCURACY) / np.log(e / after[1])
    return float(c * (after[0] / c) ** share)


def report(case: Case, found: Diagram) -> None:
    print(f"\n{case.name}: reference {found.reference.variant.label}, verified by {found.reference.check.label}")
    for measure in found.measures:
        floor = found.reference.floors[measure.name] / found.scale(measure.name)
        print(f"  {measure.words}: floor {floor:.1e}; relative errors, CPU time [ms] (least, greatest)")
        for point in found.points:
            times = "".join(f"{1e3 * t:10.2f}" for t in point.cpu)
            print(f"    {point.label[:66]:68}{point.errors[measure.name] / found.scale(measure.name):10.1e}{times}")
        shown = {name: order for (name, _), order in orders(found, measure.name).items()}
        print(
            "    order at the finest steps: "
            + ", ".join(f"{name} {order_words(order)}" for name, order in shown.items())
        )
        ours, theirs = cost_at(found, measure.name, "ffr"), cost_at(found, measure.name, EXUDYN)
        print(f"    at {ACCURACY:g}: ours {1e3 * ours:.2f} ms, Exudyn {1e3 * theirs:.2f} ms, ratio {theirs / ours:.1f}")
    for lost in found.lost:
        print(f"    failed: {lost.label}: {lost.reason}")
    sys.stdout.flush()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="every run timed once")
    parser.add_argument("--only", default="", help="scenes whose name contains this")
    parser.add_argument("--picture", type=Path, default=Path("out/work_precision"), help="name without suffix")
    given = parser.parse_args()
    repeats = 1 if given.quick else 5
    print(f"Exudyn {exu.config.Version()}; load {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors")
    shown = []
    with pool(0) as here:
        for case in (case for case in cases() if given.only in case.name):
            found = work_precision(case.scene, case.span, here, measures=measures_of(case), repeats=repeats, limit=12.0)
            found = replace(found, title=case.name)
            shown.append(found.with_points(*exudyn(case, found, repeats)))
            report(case, shown[-1])
            write_table(shown[-1], Path("out") / f"work_precision_{len(shown)}.csv")
            write_page(shown[-1], Path("out") / f"work_precision_{len(shown)}.html")
    print(draw_chart(shown, "out/work_precision_all.png", title="Work and precision"))
    deflections = [replace(diagram, measures=diagram.measures[1:]) for diagram in shown]
    for suffix in (".png", ".svg"):
        picture = given.picture.with_name(given.picture.name + suffix)
        print(draw_chart(deflections, picture, title="Work and precision", columns=3))
    print(f"load at the end {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    main()
