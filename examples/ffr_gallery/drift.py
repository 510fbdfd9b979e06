"""Constraints that are met in their second derivative alone are left in the course of a run."""

from __future__ import annotations

import numpy as np

from ffr_dyn.analyses.integration import integrate
from ffr_dyn.integrators import RK4
from ffr_dyn.integrators.stabilisation import Drifting, Projection, Stabilisation
from ffr_gallery.bodies import bar, pendulum
from ffr_gallery.exhibit import Claim, Curve, Exhibit, Panel, Proof

STEP = 2e-3  # s
ROWS = 100


def drift(steps: int = 1_000_000) -> Exhibit:
    """A rigid double pendulum, by index-1 equations."""
    scene = pendulum(bar("upper"), bar("lower"))

    def violation(count: int, step: float, keep: Stabilisation) -> tuple[np.ndarray, np.ndarray]:
        every = count * step / ROWS
        result = integrate(scene, end=count * step, output_step=every, method=RK4(step), stabilisation=keep,
                         outputs=("constraint.*",))  # fmt: skip
        return result.time[1:], result["constraint.position"][1:]

    time, free = violation(steps, STEP, Drifting())
    _, held = violation(steps, STEP, Projection())
    short = steps // 10
    coarse, fine = (float(violation(short * k, STEP / k, Drifting())[1].max()) for k in (1, 2))
    return Exhibit(
        f"Drift off the constraints over {steps:.0e} steps".replace("e+0", "e"),
        "index-1 equations hold the second derivatives of the constraints only: errors of the method's order add up",
        "projection onto the constraints whenever they are left by more than a tolerance",
        (Claim("drift with a step, over that with half of it (order 4: 2^4)", 16.0, coarse / fine, 2.5),),
        (
            Proof("largest violation without stabilisation", float(free.max()), 1e-7, True, "m"),
            Proof("largest violation with projection", float(held.max()), 1e-8, False, "m"),
        ),
        (
            Panel(
                f"double pendulum, RK4, h = {STEP:g} s", "time [s]", "largest violation [m]",
                (Curve("no stabilisation", time, free), Curve("projection", time, np.maximum(held, 1e-17))),
                log=(True, True),
            ),
        ),
    )  # fmt: skip
