"""Bricard's mechanism (IFToMM A04): five rods, six hinges, thirty rows of rank twenty-nine."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ffr_dyn.analyses.integration import integrate
from ffr_dyn.compile.scene_tables import compile_scene
from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.consistency.evaluation import evaluate, evaluated_mass_matrix, evaluator
from ffr_dyn.equations.constraint_rows import blocks_of
from ffr_dyn.integrators import RK4
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_gallery.bodies import GRAVITY
from ffr_gallery.exhibit import Claim, Curve, Exhibit, Panel, Proof
from ffr_prep.body import rigid_body

# Position of P3 after one and two seconds, by an integration in minimal coordinates; right to eight digits.
REFERENCE = {1.0: (0.51050146, -1.64916760, 0.14012311), 2.0: (-0.96934034, -1.22124689, 0.75427801)}


def bricard() -> Scene:
    """Rods of 1 m, 1 kg, 0.1 x 0.1 m along a path in space."""
    points = np.array([(0, 0, 0), (1, 0, 0), (1, -1, 0), (1, -1, 1), (0, -1, 1), (0, 0, 1)], float)
    axes = np.eye(3)[[1, 2, 0, 1, 2, 0]]
    bodies, frames = [], [np.eye(3)]
    for k in range(5):
        along = points[k + 1] - points[k]
        across = np.roll(along, 1)
        frames.append(np.column_stack([along, across, np.cross(along, across)]))
        model = rigid_body(
            f"r{k}", mass=1.0, inertia=np.array([1 / 600, 101 / 1200, 101 / 1200]), centre_of_mass=np.array([0.5, 0, 0]),
            points={"a": np.zeros(3), "b": np.array([1.0, 0, 0])},
        )  # fmt: skip
        bodies.append(Body(f"r{k}", model, position=points[k], rotation=frames[-1]))
    frames.append(np.eye(3))
    ends = ["ground.p0", *(f"r{k}.b" for k in range(5))], [*(f"r{k}.a" for k in range(5)), "ground.p5"]
    joints = [
        Joint(f"h{k}", "revolute", i, j, axis=frames[k].T @ axes[k], axis_j=frames[k + 1].T @ axes[k])
        for k, (i, j) in enumerate(zip(*ends, strict=True))
    ]
    return Scene(tuple(bodies), tuple(joints), ground={"p0": points[0], "p5": points[5]}, gravity=GRAVITY)


def redundant_bricard() -> Exhibit:
    """Singular values of the rows, and the motion with redundant rows recognised."""
    scene = bricard()
    assembled = assemble(scene)
    at = evaluator(compile_scene(replace(scene, plane="none"), blocks_of(scene), relaxation=1e-8))
    jacobian = evaluate(at, 0.0, assembled.x, assembled.v).jacobian
    lower = np.linalg.cholesky(evaluated_mass_matrix(at))
    weighted = np.linalg.solve(lower, jacobian.T).T
    values = np.linalg.svd(weighted / np.linalg.norm(weighted, axis=1)[:, None], compute_uv=False)
    result = integrate(scene, end=2.0, output_step=0.5, method=RK4(5e-4))
    rows = {time: int(np.argmin(np.abs(result.time - time))) for time in REFERENCE}
    off = max(float(np.abs(result["r2.b.position"][row] - REFERENCE[time]).max()) for time, row in rows.items())
    rank = int((values > 1e-9).sum())
    return Exhibit(
        "Redundant constraints: Bricard's mechanism",
        "one row follows from the others in every position, so Phi_q M^-1 Phi_q^T is singular and no factorisation exists",
        "redundant rows are found at assembly, left out of the motion, and get the smallest reactions",
        (
            Claim("rank of the 30 rows", 29, rank, 1.0),
            Claim("degrees of freedom", 1, assembled.degrees_of_freedom, 1.0),
        ),
        (
            Proof("largest over least singular value of all rows", float(values[0] / max(values[-1], 1e-30)), 1e12, True),
            Proof("distance of a hinge from the reference after 2 s", off, 1e-6, False, "m"),
        ),
        (
            Panel(
                "singular values of the rows (weighted by mass)", "number", "singular value",
                (Curve("all 30 rows", np.arange(1, values.size + 1), np.maximum(values, 1e-18), points=True),),
                log=(False, True),
            ),
        ),
    )  # fmt: skip
