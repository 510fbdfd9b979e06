"""The cost of a study beyond its runs and its bodies, and whether kills change it.

    python -m benchmarks.sweep [RUNS [BODIES]]     # by default 1000 runs with 20 bodies; the goal speaks of 10000 with 200

A slider-crank with eight coordinates over six parameters, four of them of its rod, on two workers. Pure time is that of all
reductions and runs (scene read, bodies loaded, run) one after another in this process, by a sample, over two. Then the same
study with a worker killed every 20 s, and with the command itself killed once: the tables must be equal to the bit.
Where others use the machine, processor time tells more than the clock does: both are printed.
"""

from __future__ import annotations

import argparse
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from ffr_dyn.scene_file.parameters import substituted
from ffr_dyn.scene_file.source import read_source
from ffr_dyn.studies.plan import Study, study
from ffr_dyn.studies.runs import Point, Recipe, Task, make, perform
from ffr_dyn.studies.sweep import sweep
from ffr_dyn.studies.table import journal_of

ROOT = Path(__file__).resolve().parent.parent
GOAL, WORKERS, EVERY = 1.10, 2, 20.0
SAMPLE = 40  # runs
SCENE = """
gravity = [0, -9.81, 0]
[parameters]
load = 50.0
speed = 100.0
[analysis]
end = 0.06
output_step = 1e-3
step = 1e-4
[ground]
O = [0, 0, 0]
[bodies.crank]
mass = 0.5
inertia = [1e-4, 1e-3, 1e-3]
centre_of_mass = [0.075, 0, 0]
points = {a = [0, 0, 0], b = [0.15, 0, 0]}
[bodies.rod]
file = "rod.ffr"
position = [0.15, 0, 0]
[bodies.slider]
mass = 0.3
inertia = [1e-4, 1e-4, 1e-4]
position = [0.45, 0, 0]
points = {a = [0, 0, 0]}
[joints]
main = {kind = "revolute", i = "ground.O", j = "crank.a"}
pin = {kind = "revolute", i = "crank.b", j = "rod.crankpin"}
wrist = {kind = "revolute", i = "rod.slider", j = "slider.a"}
guide = {kind = "translational", i = "ground.O", j = "slider.a", axis = [1, 0, 0]}
[drivers.motor]
joint = "main"
function = "speed * t"
[loads.push]
marker = "slider.a"
force = ["-load", 0, 0]
"""
LINE = (
    "reduce rod.geo --set diameter=${diameter} --material E=${E},nu=${nu},rho=${rho} --interface crankpin --interface slider "
    "--reference simply-supported:crankpin,slider --modes 2"
)
OF_RODS = {
    "diameter": {"uniform": [6e-3, 8e-3]}, "E": {"uniform": [1.9e11, 2.1e11]}, "nu": {"uniform": [0.28, 0.32]},
    "rho": {"uniform": [7700.0, 7900.0]},
}  # fmt: skip


def of(diameter: float, rho: float) -> str:
    """The line of a rod of steel."""
    return str(substituted(LINE, {"diameter": diameter, "E": 2e11, "nu": 0.3, "rho": rho}, "rod"))


def made(folder: Path, runs: int, bodies: int) -> Study:
    """`bodies` rods, each with as many loads and speeds as make so many runs of it."""
    (folder / "crank.toml").write_text(SCENE)
    (folder / "rod.geo").write_bytes((ROOT / "meshes" / "slidercrank_rod.geo").read_bytes())
    make(Recipe(of(6e-3, 7800.0), str(folder), str(folder / "rod.ffr")))
    loads = max(1, round((runs / bodies) ** 0.5))
    speeds = max(1, round(runs / bodies / loads))
    parameters = {
        "load": {"from": 10.0, "to": 100.0, "count": loads}, "speed": {"from": 50.0, "to": 150.0, "count": speeds},
        **OF_RODS,
    }  # fmt: skip
    outputs = {"force": "pin.force: largest", "stroke": "rod.slider.position.x: range", "share": "= force / load"}
    return study(
        folder / "crank.toml",
        parameters,
        outputs,
        bodies={"rod": LINE},
        samples=bodies,
        sampling="latin-hypercube",
        folder=folder,
    )


def busy() -> float:
    """Seconds of processors that this process has used, and those that it has waited for."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used)


def pure(whole: Study, folder: Path, bodies: int) -> tuple[float, float]:
    """Seconds, by the clock and of processors, of all reductions and runs, one after another, by a sample of both."""
    began, used = time.perf_counter(), busy()
    make(Recipe(of(6.5e-3, 7801.0), str(folder), str(folder / "sample.ffr")))
    reduction, reduction_used = time.perf_counter() - began, busy() - used
    own = read_source(whole.scene).tree["parameters"]
    points = tuple(
        Point(k, p, {name: repr(p[name]) for name in own}, {"rod": str(folder / "sample.ffr")})
        for k, p in enumerate(whole.points[:: max(1, len(whole.points) // SAMPLE)])
    )
    task = Task(str(whole.scene), whole.outputs, points)
    perform(task)
    began, used = time.perf_counter(), busy()
    perform(task)
    run, run_used = (time.perf_counter() - began) / len(points), (busy() - used) / len(points)
    print(f"a reduction {reduction:.2f} s ({reduction_used:.2f} s of a processor), a run {1e3 * run:.1f} ms "
          f"({1e3 * run_used:.1f} ms)", flush=True)  # fmt: skip
    return bodies * reduction + len(whole.points) * run, bodies * reduction_used + len(whole.points) * run_used


def workers(of: int) -> list[int]:
    """Processes that run tasks for another one."""
    found = subprocess.run(["pgrep", "-P", str(of), "-f", "ffr_dyn.studies.workers"], capture_output=True, text=True)
    return [int(word) for word in found.stdout.split()]


def with_kills(folder: Path, runs: int, bodies: int) -> bytes:
    """The table of the study, a worker of which is killed every 20 s, and once all of it."""
    command = [sys.executable, "-m", "benchmarks.sweep", "--only", str(folder), str(runs), str(bodies)]
    table, killed, dead = folder / "killed.nc", False, 0
    process = subprocess.Popen(command, cwd=ROOT, start_new_session=True)
    last = time.monotonic()
    while process.poll() is None or not table.exists():
        if process.poll() is not None:
            process = subprocess.Popen(command, cwd=ROOT, start_new_session=True)
        time.sleep(0.2)
        if time.monotonic() - last > EVERY and (found := workers(process.pid)):
            os.kill(found[-1], signal.SIGKILL)
            dead, last = dead + 1, time.monotonic()
        lines = journal_of(table).read_bytes().count(b"\n") if journal_of(table).exists() else 0
        if not killed and lines > runs // 2:
            os.killpg(process.pid, signal.SIGKILL)
            killed = True
    print(f"workers killed: {dead}; the study killed: {killed}")
    return table.read_bytes()


def main() -> int:
    """Print the table of figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="?", type=int, default=1000)
    parser.add_argument("bodies", nargs="?", type=int, default=20)
    parser.add_argument("--only", type=Path, help=argparse.SUPPRESS)  # the study alone, in a process that is killed
    given = parser.parse_args()
    runs, bodies = given.runs, given.bodies
    if given.only:
        sweep(made(given.only, runs, bodies), given.only / "killed.nc", workers=WORKERS, cache=given.only / "second")
        return 0
    with tempfile.TemporaryDirectory(prefix="ffr-sweep-") as name:
        folder = Path(name)
        whole = made(folder, runs, bodies)
        alone, alone_used = pure(whole, folder, bodies)
        alone, began, used = alone / WORKERS, time.perf_counter(), busy()
        table = sweep(whole, folder / "whole.nc", workers=WORKERS, cache=folder / "first")
        taken, used = time.perf_counter() - began, busy() - used
        print(f"{len(table)} runs, {bodies} bodies on {WORKERS} workers: {taken:.1f} s, pure {alone:.1f} s, "
              f"ratio {taken / alone:.2f} (goal {GOAL}); processors {used:.1f} s, pure {alone_used:.1f} s, "
              f"ratio {used / alone_used:.2f}; failed {table.failed.size}", flush=True)  # fmt: skip
        equal = with_kills(folder, runs, bodies) == (folder / "whole.nc").read_bytes()
        print(f"with kills {'equal to the bit' if equal else 'DIFFERENT'}")
    return 0 if equal and taken <= GOAL * alone else 1


if __name__ == "__main__":
    sys.exit(main())
