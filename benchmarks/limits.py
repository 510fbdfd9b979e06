"""The cost of an evaluation, how that grows, what the linearly implicit methods take, and how long a first run takes.

    python -m benchmarks.limits [--quick]

Processor time of the one thread that works; the least of some repeats taken in turns, and the load is printed. Body: the rod
of meshes/pendulum.geo on revolute joints, its frame fixed to the hinge; linear, but where the second order is named.

  links    RK4, per link and evaluation, chains of 1 to 1000 links. Goals: 1.2 us with 8 coordinates, 2.2 us with 32; constant
           within 20 %
  modes    RK4 on one pendulum, 8 to 200 coordinates: the exponent of the growth. Goal: 2
  stages   a stage of ROS2 and ROS3 in RK4's. Goal: 1.3
  stiff    the largest step times highest frequency at which ROS2 and ROS3 swing a pendulum, and their error against a rigid
           one at two steps: the order of the slow motion. Goal: 1e5
  assembly position, rank of the constraints, elimination order and tables of chains: processor time per link
  start    `import ffr_dyn`, and a first run (nothing compiled yet) less a second one. Goals: 0.4 s, 16 s
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from benchmarks.scenes import chain, pendulum_rod
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.compile.engine import fill_rows, new_engine
from ffr_dyn.compile.scene_tables import compile_scene
from ffr_dyn.compile.workspace import new_record
from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.equations.layout import initial_state
from ffr_dyn.integrators import RK4, ROS2, ROS3, Integrator
from ffr_dyn.kernels.tables import OK
from ffr_dyn.scene.scene import Scene
from ffr_prep.body import FlexibleBody
from ffr_prep.model.reference import FixedTo

STATIC = 6  # shapes of the rod beside its fixed-interface modes
SECONDS = 0.1  # processor time of one timed run
GOALS = {8: 1.2, 32: 2.2}

SCRIPT = """
import time
began = time.perf_counter()
import ffr_dyn
imported = time.perf_counter() - began
import ffr_dyn as fd
top = fd.rigid_body("top", mass=1.0, inertia=(1, 2, 3))
began = time.perf_counter()
fd.forward(fd.Scene([fd.Body("top", top)]), end=1.0, output_step=0.1, method=fd.ROS2(0.01))
print(imported, time.perf_counter() - began)
"""


def rod(coordinates: int, linear: bool = True) -> FlexibleBody:
    return pendulum_rod("rigid", coordinates - STATIC, FixedTo("hinge"), linear).body


def timer(scene: Scene, method: Integrator) -> Callable[[], float]:
    """Microseconds per evaluation of the scene, whenever it is called."""
    system = compile_scene(scene)
    x, v = initial_state(scene, system.layout)
    engine, out = new_engine(system, x, v, method, (0.0, 0.0, 1e-9)), new_record(system, 1)

    def run(steps: int) -> float:
        engine.x[:], engine.v[:], engine.tables.clock.steps[0], engine.work.info[1] = x, v, 0, 0
        began = time.process_time()
        status = fill_rows(engine, out, 0.0, steps)
        if status != OK:
            raise RuntimeError(f"{method} stopped with status {status}")
        return time.process_time() - began

    run(2)
    steps = max(2, int(2 * SECONDS / max(run(2), 1e-7)))

    def per_evaluation() -> float:
        return 1e6 * run(steps) / int(engine.work.info[1])

    return per_evaluation


def least(timers: Sequence[Callable[[], float]], repeats: int) -> list[float]:
    return list(np.min([[each() for each in timers] for _ in range(repeats)], axis=0))


def links_table(repeats: int, longest: int) -> None:
    counts = [count for count in (1, 8, 64, 1000) if count <= longest]
    print("\nlinks, RK4: per link and evaluation [us]")
    print(f"{'n':>6}{'':14}" + "".join(f"{c:>9}" for c in counts) + f"{'spread':>9}")
    for n, linear in product((8, 32), (True, False)):
        found = least([timer(chain(rod(n, linear), count, "revolute"), RK4(5e-6)) for count in counts], repeats)
        each = [value / count for value, count in zip(found, counts, strict=True)]
        spread = max(each) / min(each) - 1
        goal = f"   goal {GOALS[n]:g} us: {'met' if max(each) <= GOALS[n] else 'not met'}" if linear else ""
        order = "linear" if linear else "second order"
        print(f"{n:6d}  {order:12}" + "".join(f"{v:9.2f}" for v in each) + f"{spread:9.0%}{goal}", flush=True)


def modes_table(repeats: int) -> None:
    numbers = (8, 16, 32, 64, 128, 200)
    found = least([timer(chain(rod(n), 1, "revolute"), RK4(1e-7)) for n in numbers], repeats)
    print("\nmodes, RK4 on one pendulum: per evaluation [us]")
    print("     n" + "".join(f"{n:9d}" for n in numbers) + "\n      " + "".join(f"{value:9.2f}" for value in found))
    slopes = np.diff(np.log(found)) / np.diff(np.log(numbers))
    print("   exponent     " + "".join(f"{slope:9.2f}" for slope in slopes) + "   goal: 2", flush=True)


def stages_table(repeats: int) -> None:
    print("\nstages: processor time of a stage in RK4's\n     n     links     ros2     ros3   goal: 1.3")
    for n in (8, 32):
        for count in (1, 8):
            scene = chain(rod(n), count, "revolute")
            explicit, second, third = least(
                [timer(scene, method) for method in (RK4(5e-6), ROS2(1e-4), ROS3(1e-4))], repeats
            )
            print(f"{n:6d}{count:10d}{second / explicit:9.2f}{third / explicit:9.2f}", flush=True)


def stiffened(body: FlexibleBody, factor: float) -> FlexibleBody:
    """The same body of a material `factor` times as stiff."""
    return replace(body, omega2=body.omega2 * factor)


def stiff_table() -> None:
    print(
        "\nstiff: a pendulum swings for 1 s at h Omega_max = 1e5; error of its tip against one 1e8 times as stiff [m]"
    )
    body = rod(32)
    fastest = float(np.sqrt(body.omega2.max()))
    for kind in (ROS2, ROS3):
        errors = []
        for h in (0.02, 0.01):
            factor = (1e5 / (0.01 * fastest)) ** 2
            tips = [
                integrate(chain(stiffened(body, f), 1, "revolute"), end=1.0, output_step=0.1, method=kind(step))
                for f, step in ((factor, h), (factor, 2e-4))
            ]
            errors.append(np.abs(tips[0]["link0.tip.position"] - tips[1]["link0.tip.position"]).max())
        order = np.log2(errors[0] / errors[1])
        print(f"  {kind.__name__}: {errors[0]:.1e} at h = 0.02 s, {errors[1]:.1e} at 0.01 s, order {order:.2f}")


def start_table() -> None:
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "NUMBA_CACHE_DIR": folder}
        command = [sys.executable, "-c", SCRIPT]
        runs = [
            subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout.split()
            for _ in range(3)
        ]
    first, second, third = (float(run[1]) for run in runs)
    print(f"\nstart: import ffr_dyn {min(float(run[0]) for run in runs):.2f} s (goal 0.4)")
    print(
        f"  runs: first {first:.1f} s, second {second:.2f} s, third {third:.2f} s; compiling {first - second:.1f} s (goal 16)"
    )


def assembly_table(longest: int) -> None:
    print("\nassembly: processor time per link [ms]\n links   8 coordinates each")
    body = rod(8)
    for count in (count for count in (10, 100, 1000) if count <= longest):
        scene = chain(body, count, "revolute")
        began = time.process_time()
        assemble(scene)
        print(f"{count:6d}{1e3 * (time.process_time() - began) / count:9.2f}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="three repeats, chains of up to 64 links")
    quick = parser.parse_args().quick
    repeats, longest = (3, 64) if quick else (9, 1000)
    print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors")
    links_table(repeats, longest)
    modes_table(repeats)
    stages_table(repeats)
    stiff_table()
    assembly_table(longest)
    start_table()
    print(f"\nat the end: load {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    main()
