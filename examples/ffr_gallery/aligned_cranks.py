"""Equal parallel cranks on one coupler: in line with their pivots more rows depend on one another than anywhere else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ffr_dyn.analyses.integration import integrate
from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.consistency.evaluation import evaluate, evaluator
from ffr_dyn.integrators import ROS2
from ffr_dyn.results.result import Result
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_gallery.bodies import bar
from ffr_gallery.exhibit import Claim, Curve, Exhibit, Panel, Proof
from ffr_prep.body import rigid_body
from ffr_prep.common.arrays import Array

PITCH, RATE, END = 0.7, 3.0, 2.0  # m, rad/s, s
COUNT = 3


def cranks(angle: float, rate: float = RATE) -> Scene:
    """Three cranks at an angle [rad] from the line of their pivots; gravity acts along that line."""
    c, s, feet = np.cos(angle), np.sin(angle), PITCH * np.arange(COUNT)
    holes = {f"p{k}": np.array([x, 0, 0]) for k, x in enumerate(feet)}
    coupler = rigid_body(
        "rod", mass=2.0, inertia=np.array([0.01, 0.3, 0.3]), centre_of_mass=np.array([PITCH, 0, 0]), points=holes
    )
    bodies = [
        Body(f"s{k}", bar(f"s{k}"), position=(x, 0, 0), rotation=(0, 0, angle), omega_bar=(0, 0, rate))
        for k, x in enumerate(feet)
    ]
    joints = [Joint(f"foot{k}", "revolute", f"ground.f{k}", f"s{k}.a") for k in range(COUNT)]
    joints += [Joint(f"top{k}", "revolute", f"s{k}.b", f"rod.p{k}") for k in range(COUNT)]
    bodies.append(Body("rod", coupler, position=(c, s, 0), velocity=(-rate * s, rate * c, 0)))
    ground = {f"f{k}": (x, 0, 0) for k, x in enumerate(feet)}
    return Scene(tuple(bodies), tuple(joints), ground=ground, gravity=(9.81, 0, 0), plane="z")


def rank(angle: float) -> int:
    """Of all rows in space, by singular values: 24 coordinates less the degrees of freedom."""
    assembled = assemble(cranks(angle))
    system = assembled.all_rows or assembled.system
    J = evaluate(evaluator(system), 0.0, assembled.x, assembled.v).jacobian
    J = J / np.linalg.norm(J, axis=1)[:, None]
    return int((np.linalg.svd(J, compute_uv=False) > 1e-9).sum())


def left_out(scene: Scene) -> Scene:
    """Without the two rows that depend on others while the cranks are in line: along that line, at two of the tops."""
    joints = [
        Joint(joint.name, "point-on-line", joint.j, joint.i, axis=(1, 0, 0))
        if joint.name in ("top1", "top2")
        else joint
        for joint in scene.joints
    ]
    return replace(scene, joints=tuple(joints))


def apart(result: Result) -> Array:
    """(T,) the largest distance of a top from its hole [m]."""
    gaps = [result[f"s{k}.b.position"] - result[f"rod.p{k}.position"] for k in range(COUNT)]
    found: Array = np.max([np.linalg.norm(gap, axis=1) for gap in gaps], axis=0)
    return found


def aligned_cranks() -> Exhibit:
    """Rank in line and elsewhere, and the motion with what the position of the start says, and with what several say."""
    lost, kept = (
        integrate(each, end=END, output_step=0.01, method=ROS2(1e-3), outputs=["*.position"])
        for each in (left_out(cranks(0.0)), cranks(0.0))
    )
    return Exhibit(
        "Dependent constraints at aligned positions",
        "drawn in line, one more row follows from the others than anywhere else: left out, the mechanism comes apart",
        "independence is decided at several positions of the motion; rows that are left out are looked at in every row",
        (
            Claim("rank of the 30 rows in line", 22, rank(0.0), 1.0),
            Claim("rank elsewhere", 23, rank(0.7), 1.0),
            Claim("degrees of freedom that a run finds in line", 1, assemble(cranks(0.0)).degrees_of_freedom, 1.0),
        ),
        (
            Proof("a top from its hole with what the start alone says", float(apart(lost).max()), 0.1, True, "m"),
            Proof("a top from its hole with what several positions say", float(apart(kept).max()), 1e-6, False, "m"),
        ),
        (
            Panel(
                "three equal cranks on one coupler",
                "time [s]",
                "a top from its hole [m]",
                (
                    Curve("the rank of the start", lost.time, apart(lost) + 1e-16),
                    Curve("that of several positions", kept.time, apart(kept) + 1e-16),
                ),
                log=(False, True),
            ),
        ),
    )
