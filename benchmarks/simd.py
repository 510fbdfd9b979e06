"""The gain of the vectors written by hand: whole runs with them, and with the plain numba that stands in for them.

    python -m benchmarks.simd [--rounds 5] [--quick] [--beside DIRECTORY]

The runs are those of `benchmarks.race` (our side), `benchmarks.limits`, `benchmarks.planar`, `benchmarks.realtime` and
`benchmarks.race_stiffening`; what is printed is processor time per evaluation of the equations of motion [us], of real time
the median of a step. Every form runs in processes of its own, in turns, with its own compiled code; the least of all rounds
counts.

FFR_DYN_PLAIN=1 in the environment, which this script sets, takes the plain forms (see `ffr_dyn.kernels.simd`).

  --beside  the root of another copy of this repository, to be timed instead of the plain forms
"""

from __future__ import annotations

import argparse
import json
import os
import pickle
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.courses import courses
from benchmarks.limits import rod
from benchmarks.planar import chain as planar_chain
from benchmarks.planar import flexible_link
from benchmarks.planar import slider_crank as planar_slider_crank
from benchmarks.race_stiffening import stiffened
from benchmarks.realtime import KEPT, OUTPUTS, STEP, pushed
from benchmarks.scenes import chain, pendulum, slider_crank
from ffr_dyn.compile.engine import fill_rows, new_engine
from ffr_dyn.compile.workspace import new_record
from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.integrators import methods
from ffr_dyn.kernels.tables import EVALUATIONS, NEXT, OK
from ffr_dyn.realtime.deadline import measure_steps
from ffr_dyn.scene.scene import Scene
from ffr_prep.model.material import Material

ROOT = Path(__file__).resolve().parent.parent
SECONDS = 0.05  # processor time of one timed run
REPEATS = 5  # of each run in a process
TOLERANCE = 1e-9  # m, of the projection


@dataclass(frozen=True)
class Case:
    """A scene, the method's name and its step [s]; rows of so many steps each, again and again from the start."""

    name: str
    scene: Scene
    method: str
    step: float
    steps: int


def race_cases() -> list[Case]:
    settings = {
        ("slider-crank", 8): ("rk4", 1.43e-4),
        ("slider-crank", 32): ("ros3", 1.43e-4),
        ("chain of 32", 8): ("ros2", 1.54e-3),
        ("chain of 32", 32): ("ros2", 1.43e-3),
        ("pendulum", 8): ("ros3", 1.11e-3),
        ("pendulum", 32): ("ros3", 1.11e-3),
    }
    return [
        Case(f"race, {each.name}, {each.rod.n}", each.bare, *setting, round(each.end / setting[1]))
        for each in courses("", 0.0)
        for setting in [settings[each.name, each.rod.n]]
    ]


def limits_cases(counts: tuple[int, ...]) -> list[Case]:
    return [
        Case(f"limits, {count} links, {n}", chain(rod(n), count, "revolute"), "rk4", 5e-6, 2 + 2000 // count)
        for n in (8, 32)
        for count in counts
    ]


def planar_cases() -> list[Case]:
    return [
        case
        for modes, n in ((2, 8), (26, 32))
        for case in (
            Case(f"planar, chain of 8, {n}", planar_chain(flexible_link(1.0, modes)), "ros2", 1e-5, 500),
            Case(f"planar, slider-crank, {n}", planar_slider_crank(flexible_link(0.3, modes)), "ros2", 5e-6, 2000),
        )
    ]


def stiffened_cases() -> list[Case]:
    steel, metal = Material("steel", 2e11, 0.3, 7870.0), Material("metal", 7e10, 0.3, 5540.0)
    found = []
    for modes in (2, 26):
        bar = stiffened("slidercrank_rod.geo", steel, ("crankpin", "slider"), modes)
        strip = stiffened("pendulum.geo", metal, ("hinge", "tip"), modes)
        found += [
            Case(f"stiffened, slider-crank, {bar.n}", slider_crank(bar), "ros3", 1.25e-4, 600),
            Case(f"stiffened, pendulum, {strip.n}", pendulum(strip), "ros3", 1.1e-3, 400),
            Case(f"stiffened, chain of 32, {strip.n}", chain(strip, 32, "revolute"), "ros3", 2.5e-3, 40),
        ]
    return [replace(case, scene=replace(case.scene, plane="none")) for case in found]


def timer(case: Case) -> Callable[[], float]:
    """Microseconds per evaluation of a whole run, whenever it is called."""
    start, method = assemble(case.scene), methods()[case.method](case.step)
    engine = new_engine(start.system, start.x, start.v, method, (0.0, 0.0, TOLERANCE))
    out = new_record(start.system, 1)

    def run() -> float:
        engine.x[:], engine.v[:], engine.tables.clock.steps[NEXT], engine.work.info[EVALUATIONS] = (
            start.x,
            start.v,
            0,
            0,
        )
        began = time.thread_time()
        status = fill_rows(engine, out, 0.0, case.steps)
        if status != OK:
            raise RuntimeError(f"{case.name} stopped with status {status}")
        return time.thread_time() - began

    run()
    again = 1 + int(SECONDS / run())
    return lambda: 1e6 * min(run() for _ in range(again)) / int(engine.work.info[EVALUATIONS])


def measure(cases: list[Case], realtime: Scene) -> dict[str, float]:
    """Processor time [us] by case, in this process."""
    timers = {case.name: timer(case) for case in cases}
    found = {name: min(each() for _ in range(REPEATS)) for name, each in timers.items()}
    steps = measure_steps(realtime, methods()["ros2"](STEP), duration=5.0, outputs=OUTPUTS, stabilisation=KEPT)
    return {**found, "realtime, step": 1e6 * float(np.median(steps.seconds))}


def in_process(scenes: Path, root: Path, environment: dict[str, str]) -> dict[str, float]:
    """`measure` in a process of its own, with the copy of the repository at `root`."""
    command = [sys.executable, str(Path(__file__).resolve()), "--measure", str(scenes)]
    whole = {**os.environ, **environment, "PYTHONPATH": str(root)}
    found = subprocess.run(command, env=whole, cwd=root, stdout=subprocess.PIPE, text=True, check=True)
    return dict(json.loads(found.stdout.splitlines()[-1]))


def compare(forms: dict[str, tuple[Path, dict[str, str]]], rounds: int, scenes: Path) -> dict[str, dict[str, float]]:
    """The least of some rounds, form by form."""
    least: dict[str, dict[str, float]] = {}
    for _ in range(rounds):
        for name, (root, environment) in forms.items():
            found = in_process(scenes, root, environment)
            before = least.setdefault(name, found)
            least[name] = {case: min(value, before[case]) for case, value in found.items()}
    return least


def report(least: dict[str, dict[str, float]]) -> None:
    first, *others = least
    print(f"{'':32}{first:>12}" + "".join(f"{name:>12}{'more':>7}" for name in others))
    for case, value in least[first].items():
        rest = "".join(f"{least[name][case]:12.3f}{least[name][case] / value - 1:7.0%}" for name in others)
        print(f"{case:32}{value:12.3f}{rest}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--quick", action="store_true", help="chains of up to 64 links")
    parser.add_argument("--beside", type=Path)
    parser.add_argument("--measure", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.measure:
        print(json.dumps(measure(*pickle.loads(options.measure.read_bytes()))))
        return
    counts = (1, 8, 64) if options.quick else (1, 8, 64, 1000)
    cases = [*race_cases(), *limits_cases(counts), *planar_cases(), *stiffened_cases()]
    with tempfile.TemporaryDirectory() as folder:
        scenes = Path(folder) / "scenes"
        scenes.write_bytes(pickle.dumps((cases, pushed())))
        other = options.beside or ROOT
        forms = {
            "by hand": (ROOT, {"NUMBA_CACHE_DIR": f"{folder}/own"}),
            "beside" if options.beside else "plain": (
                other,
                {"NUMBA_CACHE_DIR": f"{folder}/other", "FFR_DYN_PLAIN": "" if options.beside else "1"},
            ),
        }
        report(compare(forms, options.rounds, scenes))


if __name__ == "__main__":
    main()
