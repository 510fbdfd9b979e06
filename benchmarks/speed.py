"""Speed: processor time per flexible body and evaluation of the right-hand side, beside Exudyn 1.13 in the same run.

    python -m benchmarks.speed [--quick]

Body: the rod of meshes/pendulum.geo with 8 and 32 elastic coordinates, its frame fixed to the hinge. Both codes get the
same modes, stiffness, mass, joints, gravity and initial state, and compute in space. Measured is the processor time of the
one thread that works, which a busy machine disturbs less than the time on the clock; the load is printed. Runs of the two
codes take turns; printed are the median and, in brackets, the least and the greatest. Starting a solver and compiling are
left out. `apart` is the distance of the last tip in the two codes after a check of 500 steps, relative to how far it has
moved.

Explicit, RK4 in both, per body and evaluation (ours counts its evaluations; Exudyn makes four per step):
  free      one body that flies and spins
  pendulum  a revolute joint, five multipliers: ours alone
  chain     eight links on revolute joints: ours alone
Exudyn's explicit methods take no joints. Holding coordinates of the frame instead (explicit.eliminateConstraints) is no
pendulum either: it only sets their accelerations to zero after it has solved for those of the free body.

Implicit, equal step, per body and step: our ROS2 (two evaluations) beside Exudyn's generalised alpha of index 3 with
modified Newton iterations to a relative residual of 1e-6, which is faster than its standard of 1e-8 and gives the same
motion; revolute joints in both.

Exudyn is the build without range checks (exudynFast) on one thread, without files, sensors and end-of-step accelerations;
its bodies consist of their mass terms and of three nodes per interface instead of the whole mesh. Frame coordinates and
linear solvers are tried, and the fastest that solves the problem is shown (with Tait-Bryan angles the motion in space is
wrong for this object, in a plane right; Euler parameters are not for its explicit methods).

Linear cost, ours: time per link and evaluation of chains of 8 to 64 links, and the ratio of the longest to the shortest.
"""

from __future__ import annotations

import argparse
import os
import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np

sys.exudynFast = True  # type: ignore[attr-defined]  # read where exudyn is first imported

from benchmarks.exudyn_twin import (  # noqa: E402
    EULER_PARAMETERS,
    ROTATION_VECTOR,
    TAIT_BRYAN,
    Twin,
    exu,
    settings,
    twin,
)
from benchmarks.scenes import chain, free_body, pendulum_rod  # noqa: E402
from ffr_dyn.compile.engine import fill_rows, new_engine  # noqa: E402
from ffr_dyn.compile.workspace import new_record  # noqa: E402
from ffr_dyn.consistency.assemble import assemble  # noqa: E402
from ffr_dyn.integrators import RK4, ROS2, Integrator  # noqa: E402
from ffr_dyn.integrators.stabilisation import Projection, gains  # noqa: E402
from ffr_dyn.kernels.tables import OK  # noqa: E402
from ffr_dyn.scene.scene import Scene, marker_number  # noqa: E402
from ffr_prep.body import FlexibleBody  # noqa: E402
from ffr_prep.model.reference import FixedTo  # noqa: E402

Array = np.ndarray

SECONDS = 0.2  # processor time of one timed run
CHECKED, APART = 500, 1e-3  # steps after which the motions are compared, and how far apart they may be
EXPLICIT_STEP, IMPLICIT_STEP = 5e-6, 1e-4  # s
LINKS, LENGTHS = 8, (8, 16, 32, 64)
FIXED_INTERFACE_MODES = (2, 26)  # with six static shapes: 8 and 32 elastic coordinates
TARGETS = {8: 4.0, 32: 8.0}  # us per body and evaluation
LINEAR_SOLVERS = ("EXUdense", "EigenDense", "EigenSparse")


@dataclass(frozen=True)
class Runner:
    """`run(steps)` gives the processor time [s] and the units of work; `tip(steps)` the last tip (3,) [m] after them."""

    name: str
    run: Callable[[int], tuple[float, int]]
    tip: Callable[[int], Array]


# ---- ours ---------------------------------------------------------------------------------------------------------


def last_tip(scene: Scene) -> str:
    return f"{scene.bodies[-1].name}.tip"


def ours(scene: Scene, method: Integrator, *, per_evaluation: bool) -> Runner:
    """The compiled loop with the default stabilisation; units: bodies times evaluations or steps."""
    start = assemble(scene)
    engine = new_engine(start.system, start.x, start.v, method, gains(Projection()))
    out, work = new_record(start.system, 1), engine.work

    def run(steps: int) -> tuple[float, int]:
        engine.x[:], engine.v[:] = start.x, start.v
        work.info[1] = 0
        began = time.process_time()
        status = fill_rows(engine, out, 0.0, steps)
        took = time.process_time() - began
        if status != OK:
            raise RuntimeError(f"{method} on {len(scene.bodies)} bodies stopped with status {status}")
        return took, len(scene.bodies) * (int(work.info[1]) if per_evaluation else steps)

    def tip(steps: int) -> Array:
        run(steps)
        return out.r[0, marker_number(scene, last_tip(scene))].copy()

    run(1)  # compiles
    return Runner("ffr", run, tip)


# ---- Exudyn -------------------------------------------------------------------------------------------------------


def theirs(name: str, made: Twin, scene: Scene, s: Any, step: float, solver: Any, units: int) -> Runner:
    """A solver of Exudyn; the cost of starting it is taken out by a run of a few steps. units: of one body and step."""
    made.mbs.Assemble()

    def solve(steps: int) -> float:
        s.timeIntegration.endTime, s.timeIntegration.numberOfSteps = steps * step, steps
        began = time.process_time()
        made.mbs.SolveDynamic(s, solverType=solver)
        return time.process_time() - began

    def run(steps: int) -> tuple[float, int]:
        starting = solve(2)
        return solve(steps + 2) - starting, units * len(scene.bodies) * steps

    def tip(steps: int) -> Array:
        solve(steps)
        return np.array(made.mbs.GetMarkerOutput(made.markers[last_tip(scene)], exu.OutputVariableType.Position))

    return Runner(name, run, tip)


def fast_settings(linear_solver: str, lie_group: bool) -> Any:
    s = settings(1.0, 1)
    s.timeIntegration.newton.relativeTolerance = 1e-6
    s.timeIntegration.newton.absoluteTolerance = 1e-8
    s.solution.sensors.active = False
    s.linearSolver.solverType = getattr(exu.LinearSolverType, linear_solver)
    s.timeIntegration.explicit.computeEndOfStepAccelerations = False
    s.timeIntegration.explicit.useLieGroupIntegration = lie_group
    return s


def explicit_runners(scene: Scene) -> list[Runner]:
    """RK44 with the rotation vector and Lie group integration."""
    start, found = assemble(scene), []
    for linear in LINEAR_SOLVERS:
        made = twin(scene, start.x, start.v, node_type=ROTATION_VECTOR)
        s, solver = fast_settings(linear, True), exu.DynamicSolverType.RK44
        found.append(theirs(f"RK44, Lie, {linear}", made, scene, s, EXPLICIT_STEP, solver, 4))
    return found


def implicit_runners(scene: Scene) -> list[Runner]:
    """Generalised alpha with every kind of frame coordinates and linear solver."""
    start, found = assemble(scene), []
    for (frame, word), linear in product({EULER_PARAMETERS: "Euler p.", TAIT_BRYAN: "angles"}.items(), LINEAR_SOLVERS):
        made = twin(scene, start.x, start.v, node_type=frame)
        s, solver = fast_settings(linear, False), exu.DynamicSolverType.GeneralizedAlpha
        found.append(theirs(f"alpha, {word}, {linear}", made, scene, s, IMPLICIT_STEP, solver, 1))
    return found


# ---- timing -------------------------------------------------------------------------------------------------------


def steps_for(runner: Runner, seconds: float) -> int:
    """How many steps take about `seconds`."""
    steps = 4
    while (took := runner.run(steps)[0]) < 0.1 * seconds:
        steps *= 3
    return max(4, round(steps * seconds / took))


def in_turns(runners: list[Runner], repeats: int) -> list[list[float]]:
    """Microseconds per unit of each runner, `repeats` times in turns."""
    steps = [steps_for(runner, SECONDS) for runner in runners]
    times: list[list[float]] = [[] for _ in runners]
    for _, (runner, count, found) in product(range(repeats), list(zip(runners, steps, times, strict=True))):
        took, units = runner.run(count)
        found.append(1e6 * took / units)
    return times


def fastest(runners: list[Runner], mine: Runner) -> tuple[Runner, float] | None:
    """The fastest of those that find our motion, and how far they are apart, relative to the motion; None without any."""
    before, tip = mine.tip(1), mine.tip(CHECKED)
    moved = np.linalg.norm(tip - before)
    checked = [(runner, float(np.linalg.norm(runner.tip(CHECKED) - tip) / moved)) for runner in runners]
    right = [(runner, apart) for runner, apart in checked if apart < APART]
    return min(right, key=lambda entry: statistics.median(in_turns([entry[0]], 3)[0]), default=None)


def spread(values: list[float]) -> str:
    return f"{statistics.median(values):9.2f} [{min(values):8.2f} {max(values):8.2f}]"


def race(title: str, n: int, mine: Runner, candidates: list[Runner], repeats: int) -> float:
    """Print one line; our median."""
    other = fastest(candidates, mine)
    times = in_turns([mine] + ([other[0]] if other else []), repeats)
    line = f"{title:20}{n:4d}  {spread(times[0])}"
    if other:
        ratio = statistics.median(times[1]) / statistics.median(times[0])
        line += f"  {spread(times[1])} {ratio:7.1f} {other[1]:9.0e}  {other[0].name}"
    print(line, flush=True)
    return statistics.median(times[0])


# ---- tables -------------------------------------------------------------------------------------------------------

HEAD = f"{'':20}{'n':>4}  {'ffr [us]':>9} [{'least':>8} {'greatest':>8}]  {'Exudyn':>9} [{'least':>8} {'greatest':>8}]"
HEAD += f" {'ratio':>7} {'apart':>9}  Exudyn's way"


def example_scenes(body: FlexibleBody) -> dict[str, Scene]:
    links = chain(body, LINKS, "revolute")
    scenes = {"free": free_body(body), "pendulum": chain(body, 1, "revolute"), f"chain of {LINKS}": links}
    return {title: replace(scene, plane="none") for title, scene in scenes.items()}


def explicit_table(bodies: list[FlexibleBody], repeats: int) -> None:
    print(f"\nexplicit, RK4: per body and evaluation\n{HEAD}")
    method = RK4(EXPLICIT_STEP)
    for body in bodies:
        for title, scene in example_scenes(body).items():
            candidates = explicit_runners(scene) if not scene.joints else []
            found = race(title, body.n, ours(scene, method, per_evaluation=True), candidates, repeats)
            met = "met" if found <= TARGETS[body.n] else "not met"
            print(f"{'':20}      goal {TARGETS[body.n]:g} us: {met}")


def implicit_table(bodies: list[FlexibleBody], repeats: int) -> None:
    print(f"\nimplicit, step {IMPLICIT_STEP:g} s: per body and step\n{HEAD}")
    for body in bodies:
        for title, scene in example_scenes(body).items():
            mine = ours(scene, ROS2(IMPLICIT_STEP), per_evaluation=False)
            race(title, body.n, mine, implicit_runners(scene), repeats)


def linear_cost_table(bodies: list[FlexibleBody], repeats: int) -> None:
    print(f"\nlinear cost, RK4: per link and evaluation [us]; goal: ratio {LENGTHS[-1]} to {LENGTHS[0]} at most 1.3")
    print(f"{'joints':20}{'n':>4}" + "".join(f"{count:>9}" for count in LENGTHS) + f"{'ratio':>9}")
    for kind, body in product(("spherical", "revolute"), bodies):
        runners = [ours(chain(body, count, kind), RK4(EXPLICIT_STEP), per_evaluation=True) for count in LENGTHS]
        medians = [statistics.median(found) for found in in_turns(runners, repeats)]
        cells = "".join(f"{median:9.2f}" for median in medians)
        print(f"{kind:20}{body.n:4d}{cells}{medians[-1] / medians[0]:9.2f}", flush=True)


def load() -> str:
    return f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="three repeats instead of nine")
    repeats = 3 if parser.parse_args().quick else 9
    bodies = [pendulum_rod("rigid", modes, FixedTo("hinge")).body for modes in FIXED_INTERFACE_MODES]
    print(f"Exudyn {exu.config.Version()}, numpy {np.__version__}; {load()}")
    explicit_table(bodies, repeats)
    implicit_table(bodies, repeats)
    linear_cost_table(bodies, repeats)
    print(f"\nat the end: {load()}")


if __name__ == "__main__":
    main()
