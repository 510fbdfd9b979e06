"""Exudyn's side of the race: its settings and its runs."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np

from benchmarks.courses import Course
from benchmarks.exudyn_twin import EULER_PARAMETERS, TAIT_BRYAN, Twin, exu, items, settings, twin

Array = np.ndarray

ALPHA, TRAPEZOIDAL = "gen. alpha", "trapezoidal"
FRAMES = {EULER_PARAMETERS: "Euler parameters", TAIT_BRYAN: "Tait-Bryan"}
LINEAR_SOLVERS = ("EXUdense", "EigenDense", "EigenSparse")
TRIED = 60  # steps that the comparison of frames and linear solvers takes
UNKNOWNS = 200  # from here on only the sparse solver is tried


@dataclass(frozen=True)
class Way:
    """Method (and spectral radius of generalised alpha), frame coordinates, linear solver, Newton's relative tolerance."""

    method: str
    frame: str
    solver: str
    tolerance: float
    radius: float = 0.9

    @property
    def words(self) -> str:
        method = f"{self.method} {self.radius:g}" if self.method == ALPHA else self.method
        return f"{method}, {FRAMES[self.frame]}, {self.solver}, Newton {self.tolerance:g}"


FIRST = Way(ALPHA, TAIT_BRYAN, "EXUdense", 1e-4)
USUAL = Way(ALPHA, EULER_PARAMETERS, "EXUdense", 1e-8)


METHODS = ((ALPHA, 0.9), (TRAPEZOIDAL, 0.9), (ALPHA, 0.6))


def variants(way: Way) -> list[Way]:
    """Every method with either frame, then other tolerances."""
    methods = [
        replace(way, method=method, radius=radius, frame=frame) for frame, (method, radius) in product(FRAMES, METHODS)
    ]
    return [*methods, *(replace(way, tolerance=tolerance) for tolerance in (1e-3, 1e-4, 1e-6))]


def solver_settings(way: Way, end: float, steps: int) -> Any:
    s = settings(end, steps)
    s.timeIntegration.newton.relativeTolerance = way.tolerance
    s.timeIntegration.newton.absoluteTolerance = 1e-2 * way.tolerance
    s.timeIntegration.newton.useModifiedNewton = True
    s.timeIntegration.generalizedAlpha.spectralRadius = way.radius
    s.timeIntegration.adaptiveStep = False
    s.linearSolver.solverType = getattr(exu.LinearSolverType, way.solver)
    s.linearSolver.reuseAnalyzedPattern = way.solver == "EigenSparse"
    s.solution.sensors.active = False
    return s


def solve(made: Twin, way: Way, s: Any) -> float | None:
    """Processor time [s], None where Newton's iterations do not converge."""
    solver = (
        exu.DynamicSolverType.TrapezoidalIndex2 if way.method == TRAPEZOIDAL else exu.DynamicSolverType.GeneralizedAlpha
    )
    began = time.process_time()
    try:
        done = made.mbs.SolveDynamic(s, solverType=solver)
    except Exception:  # Exudyn's own, of no further type
        return None
    return time.process_time() - began if done else None


def run(
    course: Course, way: Way, steps: int, *, looked_at: bool, end: float | None = None
) -> tuple[float, dict[str, Array]] | None:
    """Processor time of the steps [s], and, looked at, the positions of the course's markers at the output times.

    None where Exudyn fails.
    """
    start = course.start_looked_at if looked_at else course.start
    made = twin(course.looked_at if looked_at else course.bare, start.x, start.v, node_type=way.frame)
    end = course.end if end is None else end
    numbers = {name: made.mbs.AddSensor(position_of(made, name)) for name in course.markers} if looked_at else {}
    made.mbs.Assemble()
    starting = solve(made, way, solver_settings(way, 2 * end / steps, 2))
    s = solver_settings(way, end, steps)
    s.solution.sensors.active, s.solution.sensors.writePeriod = looked_at, course.output_step
    took = solve(made, way, s)
    if took is None or starting is None:
        return None
    at = {name: made.mbs.GetSensorStoredData(number)[1:, 1:] for name, number in numbers.items()}
    if any(len(values) != course.rows or not np.isfinite(values).all() for values in at.values()):
        return None
    return max(took - starting, 1e-9), at


def position_of(made: Twin, name: str) -> Any:
    return items.SensorMarker(
        markerNumber=made.markers[name], outputVariableType=exu.OutputVariableType.Position,
        storeInternal=True, writeToFile=False,
    )  # fmt: skip


def fastest(course: Course, way: Way) -> Way:
    """The frame and linear solver with the least time for some steps of moderate size."""
    large = len(course.links) * (course.rod.n + 6) > UNKNOWNS
    tried = []
    for frame, solver in product(FRAMES, LINEAR_SOLVERS[2:] if large else LINEAR_SOLVERS):
        other = replace(way, frame=frame, solver=solver)
        found = run(course, other, TRIED, looked_at=False, end=TRIED * course.output_step / 64)
        if found is not None:
            tried.append((found[0], other))
    return min(tried, key=lambda entry: entry[0])[1]
