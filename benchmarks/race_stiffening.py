"""The cost per step of the second-order displacement of bodies, and its gain: part of `benchmarks.race`, and by itself:

    python -m benchmarks.race_stiffening

Cost: processor time of the compiled loop of the same bodies, second-order and linear, ROS3 with the same steps, runs
in turns. Goal: at most 1.3 times.

Gain: the largest offset of the middle of the slider-crank's rod from the chord, to the left of the way from pin to slider,
over 0.084 s. A geometrically exact beam gives 4.6592e-3 m (high order, Radau IIA, right to 5e-7 m); linear theory, however
finely integrated, is a fifth off, because the slider's inertia compresses the rod to 8 % of its buckling load.
"""

from __future__ import annotations

import statistics
from collections.abc import Callable
from dataclasses import replace

import numpy as np

import ffr_prep as fp
from benchmarks.courses import FIXED_INTERFACE_MODES, chained
from benchmarks.scenes import MESHES, pendulum, slider_crank, with_middle
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.functions.stopwatch import Stopwatch
from ffr_dyn.integrators import ROS3
from ffr_dyn.scene.scene import Scene
from ffr_prep.body import FlexibleBody
from ffr_prep.mesh.mesh import read_mesh
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.material import Material
from ffr_prep.model.reference import SimplySupported
from ffr_prep.reduction.methods.craig_bampton import CraigBampton

EXACT = 4.6592e-3  # m
GOAL = 1.3


def stiffened(mesh: str, material: Material, ends: tuple[str, str], modes: int) -> FlexibleBody:
    """A rod as in `benchmarks.scenes`, with its second-order displacement."""
    return fp.reduce(
        fp.from_mesh(read_mesh(MESHES / mesh), material, [InterfaceRegion(end) for end in ends]),
        fp.Request(name="rod", reference=SimplySupported(*ends), reduction=CraigBampton(modes)),
    )


def linear(scene: Scene) -> Scene:
    """The same scene with linear bodies."""
    return replace(scene, bodies=tuple(replace(body, stiffening=False) for body in scene.bodies))


def loop_time(scene: Scene, output_step: float, rows: int, fineness: int) -> float:
    """Processor time of a step [us]."""
    watch = Stopwatch()
    method, end = ROS3(output_step / fineness), rows * output_step
    span = {"end": end, "output_step": output_step, "outputs": ["*.position"]}
    integrate(scene, **span, method=method, stopwatch=watch)
    return 1e6 * watch.cpu / (rows * fineness)


def peak(scene: Scene) -> float:
    """Largest offset [m] of the middle of the slider-crank's rod, to the left."""
    names = ("rod.crankpin", "rod.slider", "rod.middle")
    outputs = [f"{name}.position" for name in names]
    found = integrate(scene, end=0.084, output_step=1e-4, method=ROS3(2.5e-5), outputs=outputs)
    pin, slider, middle = (found[output] for output in outputs)
    chord, offset = slider - pin, middle - (pin + slider) / 2
    left = chord[:, 0] * offset[:, 1] - chord[:, 1] * offset[:, 0]
    return float((left / np.linalg.norm(chord, axis=1)).max())


def report(repeats: int) -> None:
    """Print cost and gain."""
    steel, metal = Material("steel", 2e11, 0.3, 7870.0), Material("metal", 7e10, 0.3, 5540.0)
    print(f"\nsecond-order bodies: processor time of a step of ROS3 [us]; goal: at most {GOAL:g} times\n"
          f"{'':22}{'linear':>9}{'second':>9}{'ratio':>8}")  # fmt: skip
    for modes in FIXED_INTERFACE_MODES.values():
        rod = stiffened("slidercrank_rod.geo", steel, ("crankpin", "slider"), modes)
        strip = stiffened("pendulum.geo", metal, ("hinge", "tip"), modes)
        print_cost(f"slider-crank, {rod.n}", slider_crank(rod), (1e-3, 84, 8), repeats)
        print_cost(f"pendulum, {rod.n}", pendulum(strip), (0.01, 50, 9), repeats)
        print_cost(f"chain of 32, {rod.n}", chained(strip), (0.01, 50, 4), repeats)
        scene = slider_crank(with_middle(rod))
        print_gain("linear", peak(linear(scene)))
        print_gain("second order", peak(scene))


def print_cost(name: str, scene: Scene, span: tuple[float, int, int], repeats: int) -> None:
    scene = replace(scene, plane="none")
    pair: tuple[Callable[[], float], ...] = (
        lambda: loop_time(linear(scene), *span),
        lambda: loop_time(scene, *span),
    )
    taken = [[run() for run in pair] for _ in range(repeats)]
    off, on = (statistics.median(column) for column in zip(*taken, strict=True))
    met = "met" if on / off <= GOAL else "not met"
    print(f"{name:22}{off:9.2f}{on:9.2f}{on / off:8.2f}  {met}", flush=True)


def print_gain(words: str, value: float) -> None:
    off = 100 * (value / EXACT - 1)
    print(f"  {words:13}largest deflection of the rod {1e3 * value:.4f} mm, {off:+.1f} % off the exact one")


if __name__ == "__main__":
    report(repeats=25)
