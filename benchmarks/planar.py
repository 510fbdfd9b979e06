"""Planar scenes computed in the plane and in space: CPU time per evaluation of the equations of motion, and the ratio.

    python -m benchmarks.planar

Every scene is found planar by itself (`plane="auto"`) or computed in space on request (`plane="none"`), in turns. The time
of a long run less that of a short one is divided by the evaluations in between, so that start-up does not count; the least
of some repetitions is taken. Goal: a ratio of 1.8.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

import ffr_prep as fp
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.functions.time_functions import polynomial
from ffr_dyn.integrators import RK4, ROS2, Integrator
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import FlexibleBody, rigid_body
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.material import Material
from ffr_prep.model.reference import SimplySupported
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.structures.frame import Member, named, polyline
from ffr_prep.structures.sections import rectangle

REPEATS = 20
LINKS = 8


def flexible_link(length: float, modes: int) -> FlexibleBody:
    """An aluminium bar of 13 x 20 mm with `modes` normal modes and six more from its interfaces."""
    member = Member(rectangle(0.013, 0.02), Material("aluminium", 7e10, 0.3, 2700.0), orientation=(0, 1, 0))
    frame = named(polyline([(0, 0, 0), (length, 0, 0)], member, elements=12), a=(0, 0, 0), b=(length, 0, 0))
    return fp.reduce(
        fp.from_frame(frame, [InterfaceRegion("a"), InterfaceRegion("b")]),
        fp.Request(name="link", reference=SimplySupported("a", "b"), reduction=CraigBampton(modes)),
    )


def rigid_link(length: float, mass: float) -> FlexibleBody:
    across = mass * length**2 / 12
    inertia = np.diag([0.1 * across, across, across])
    points = {"a": np.zeros(3), "b": np.array([length, 0.0, 0.0])}
    return rigid_body("link", mass=mass, inertia=inertia, centre_of_mass=np.array([length / 2, 0, 0]), points=points)


def chain(link: FlexibleBody) -> Scene:
    """Links of 1 m that hang one on the other in revolute joints, released from the horizontal."""
    ends = ["ground.O", *(f"l{k}.b" for k in range(LINKS - 1))]
    return Scene(
        tuple(Body(f"l{k}", link, position=(k, 0, 0)) for k in range(LINKS)),
        tuple(Joint(f"j{k}", "revolute", ends[k], f"l{k}.a") for k in range(LINKS)),
        ground={"O": (0, 0, 0)},
        gravity=(0, -9.81, 0),
    )


def slider_crank(rod: FlexibleBody) -> Scene:
    block = rigid_body("block", mass=0.4, inertia=np.eye(3) * 1e-4, points={"pin": np.zeros(3)})
    return Scene(
        (
            Body("crank", rigid_link(0.1, 0.5)),
            Body("rod", rod, position=(0.1, 0, 0)),
            Body("block", block, position=(0.4, 0, 0)),
        ),
        (
            Joint("main", "revolute", "ground.O", "crank.a"),
            Joint("big", "revolute", "crank.b", "rod.a"),
            Joint("small", "revolute", "rod.b", "block.pin"),
            Joint("guide", "translational", "ground.O", "block.pin", axis=(1.0, 0, 0)),
        ),
        (Driver("motor", "main", polynomial(0.3, 40.0)),),
        ground={"O": (0, 0, 0)},
    )


def per_evaluation(scenes: Sequence[Scene], method: Integrator, span: float) -> list[float]:
    """CPU time per evaluation [s] of each scene."""

    def run(scene: Scene, end: float) -> tuple[float, int]:
        began = time.process_time()
        evaluations = integrate(scene, end=end, output_step=end / 2, method=method).attributes["evaluations"]
        return time.process_time() - began, evaluations

    runs = [(scene, end) for scene in scenes for end in (span / 10, span)]
    evaluations = [run(scene, end)[1] for scene, end in runs]
    least = np.min([[run(scene, end)[0] for scene, end in runs] for _ in range(REPEATS)], axis=0)
    return list(np.diff(least.reshape(-1, 2))[:, 0] / np.diff(np.reshape(evaluations, (-1, 2)))[:, 0])


def main() -> None:
    print(f"{'':34}{'in space':>12}{'in the plane':>14}{'ratio':>8}   [us per evaluation]")
    scenes: list[tuple[str, Callable[[], Scene], Integrator]] = [
        (f"chain of {LINKS} rigid links", lambda: chain(rigid_link(1.0, 1.0)), RK4(1e-5)),
        (f"chain of {LINKS} links, 8 modes", lambda: chain(flexible_link(1.0, 2)), ROS2(1e-5)),
        (f"chain of {LINKS} links, 32 modes", lambda: chain(flexible_link(1.0, 26)), ROS2(1e-5)),
        ("slider-crank, rod of 8 modes", lambda: slider_crank(flexible_link(0.3, 2)), ROS2(5e-6)),
        ("slider-crank, rod of 32 modes", lambda: slider_crank(flexible_link(0.3, 26)), ROS2(5e-6)),
    ]
    for name, make, method in scenes:
        pair = [replace(make(), plane=plane) for plane in ("none", "auto")]
        space, plane = (1e6 * value for value in per_evaluation(pair, method, 0.2))
        print(f"{name:34}{space:12.2f}{plane:14.2f}{space / plane:8.2f}", flush=True)


if __name__ == "__main__":
    main()
