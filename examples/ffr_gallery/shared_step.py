"""Two models compared with one step agree about its error: a verification that shares its step verifies nothing of it."""

from __future__ import annotations

import numpy as np

from ffr_dyn.analyses.forward import forward
from ffr_dyn.integrators import RK4, ROS2, Integrator
from ffr_dyn.results.result import Result
from ffr_gallery.bodies import beam, pendulum
from ffr_gallery.exhibit import Claim, Curve, Exhibit, Panel, Proof
from ffr_prep.common.arrays import Array

OUTPUT = "beam.b.displacement"
END, ROWS = 0.5, 5e-3  # s
STEPS = (2.5e-3, 1.25e-3, 6.25e-4, 3.125e-4, 1.5625e-4)  # s
BENDING = 5.0  # N m^2


def shared_step() -> Exhibit:
    """A falling beam with five and with seven modes."""

    def run(modes: int, method: Integrator) -> Array:
        return _run(modes, method)[OUTPUT][:, 1]

    truth = run(5, RK4(1e-5))
    fine = np.array([run(5, ROS2(h)) for h in STEPS])
    errors = np.abs(fine - truth).max(axis=1)
    differences = np.array([np.abs(run(7, ROS2(h)) - y).max() for h, y in zip(STEPS, fine, strict=True)])
    told = np.array([_told(h) for h in STEPS])
    return Exhibit(
        "A verification that shares its step",
        "two models with one step differ by little, however wrong the step is: what both have cancels",
        "a run beside an undamped twin and one of twice the step tells the error of the step itself",
        (Claim("error of the step over that of half of it", 4.0, float(errors[-2] / errors[-1]), 1.3),),
        (
            Proof("true error over the difference of the models", float(errors[0] / differences[0]), 5.0, True),
            Proof("true error over the one that the run tells", float((errors / told).max()), 3.0, False),
            Proof("what the run tells over the true error", float((told / errors).max()), 5.0, False),
        ),
        (
            Panel(
                "a falling beam, ROS2",
                "step [s]",
                "deflection of the tip off by [m]",
                (
                    Curve("true error, five modes", np.array(STEPS), errors),
                    Curve("seven modes less five, the same step", np.array(STEPS), differences),
                    Curve("told by the run", np.array(STEPS), told, points=True),
                ),
                log=(True, True),
            ),
        ),
    )


def _run(modes: int, method: Integrator, check: bool = False) -> Result:
    scene = pendulum(beam("beam", 1.0, 1.0, BENDING, modes))
    return forward(scene, end=END, output_step=ROWS, method=method, outputs=[OUTPUT], check=check)


def _told(step: float) -> float:
    """[m]"""
    return float(_run(5, ROS2(step), check=True).attributes["errors"][OUTPUT][0])
