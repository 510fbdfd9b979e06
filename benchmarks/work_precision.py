"""Speed against accuracy: error of the pendulum's tip and the rod's deflection over wall time, for RK4 and ROS2.

    python benchmarks/work_precision.py [picture.png]

Scene: the flexible pendulum of the tests (meshes/pendulum.geo, E = 7e10 Pa) with 2 and 8 fixed-interface modes, 0.5 s.
Each point is a step size. Error: largest distance of the tip over all output times from the same model run with RK4 at a
quarter of the smallest step. Time: median of five runs of the compiled loop, assembly and files left out.
"""

from __future__ import annotations

import statistics
import sys
import time
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from ffr_dyn.analyses.assemble import Assembled, assemble
from ffr_dyn.equations import new_record
from ffr_dyn.integrators import RK4, ROS2, Integrator
from ffr_dyn.joints import Joint
from ffr_dyn.machine import fill_rows, new_machine
from ffr_dyn.scene import Body, Scene
from ffr_prep.interface import InterfaceRegion
from ffr_prep.material import Material
from ffr_prep.mesh import Mesh, read_mesh
from ffr_prep.reduce import reduce_mesh
from ffr_prep.reduction import CraigBampton
from ffr_prep.reference import SimplySupported

END, ROWS = 0.5, 50
MESH = Path(__file__).resolve().parent.parent / "meshes" / "pendulum.geo"


def pendulum(mesh: Mesh, modes: int) -> Assembled:
    body = reduce_mesh(
        mesh,
        name="rod",
        material=Material("metal", 7e10, 0.3, 5540.0),
        interfaces=[InterfaceRegion("hinge"), InterfaceRegion("tip")],
        reference=SimplySupported("hinge", "tip"),
        reduction=CraigBampton(modes),
    )
    joint = Joint("hinge", "revolute", "ground.O", "rod.hinge")
    return assemble(Scene((Body("rod", body),), (joint,), ground={"O": (0, 0, 0)}, gravity=(0, -9.81, 0)))


def run(start: Assembled, method: Integrator, repeats: int) -> tuple[np.ndarray, float, float, float]:
    """Tip (T, 2), and the median, least and greatest time [s] of the compiled loop."""
    system, times = start.system, []
    substeps = round(END / ROWS / method.step)
    for _ in range(repeats):
        machine, out = new_machine(system, start.x, start.v, method, (0.0, 0.0, 1e-10)), new_record(system, ROWS)
        began = time.perf_counter()
        status = fill_rows(machine, method, out, 0.0, substeps)
        times.append(time.perf_counter() - began)
        assert status == 0, f"{method} failed: {status}"
    return out.r[:, 1, :2].copy(), statistics.median(times), min(times), max(times)


def steps_of(method: type, start: Assembled) -> list[float]:
    """Output steps divided by integers; for RK4 from its stability limit down."""
    coarsest = 200
    if method is RK4:
        fastest = np.sqrt(max(b.model.omega2.max() for b in start.system.scene.bodies))
        coarsest = int(np.ceil(END / ROWS * fastest / 0.7 / 100)) * 100
    return [END / ROWS / (coarsest * 2**k) for k in range(-3 if method is ROS2 else 0, 5 if method is ROS2 else 3)]


def main() -> None:
    picture = Path(sys.argv[1] if len(sys.argv) > 1 else "out/work_precision.png")
    mesh = read_mesh(MESH)
    figure = Figure(figsize=(7.5, 4.6), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    print(f"{'method':8}{'modes':>6}{'step [s]':>12}{'error [m]':>12}{'time [ms]':>12}{'min':>9}{'max':>9}")
    for modes, fill in ((2, "none"), (8, "full")):
        start = pendulum(mesh, modes)
        n = start.system.layout.n[0]
        run(start, RK4(steps_of(RK4, start)[-1]), 1)
        truth, *_ = run(start, RK4(steps_of(RK4, start)[-1] / 4), 1)
        for method, colour, marker in ((RK4, "#d55e00", "s"), (ROS2, "#0072b2", "o")):
            points = []
            run(start, method(steps_of(method, start)[-1]), 1)
            for step in steps_of(method, start):
                tip, median, least, most = run(start, method(step), 5)
                error = float(np.linalg.norm(tip - truth, axis=1).max())
                points.append((1e3 * median, error))
                times = "".join(f"{1e3 * t:{width}.2f}" for t, width in ((median, 12), (least, 9), (most, 9)))
                print(f"{method.__name__:8}{n:6d}{step:12.3g}{error:12.2e}{times}")
            axes.loglog(
                *zip(*points, strict=True),
                marker=marker,
                color=colour,
                fillstyle=fill,
                label=f"{method.__name__}, {n} modes",
            )
    axes.set_xlabel("wall time of 0.5 s of motion [ms]")
    axes.set_ylabel("largest error of the tip [m]")
    axes.set_title("Flexible pendulum: speed against accuracy", fontweight="bold")
    axes.grid(True, which="major", alpha=0.4)
    axes.legend()
    picture.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(picture, dpi=130, metadata={"Software": None})
    print(f"picture {picture}")


if __name__ == "__main__":
    main()
