"""A stiff bushing in place of a hinge: the fastest vibration of the scene is its own."""

from __future__ import annotations

import numpy as np

from ffr_dyn.analyses.linearise import linearise
from ffr_dyn.integrators import RK4, ROS2
from ffr_dyn.scene.forces import Bushing
from ffr_dyn.scene.scene import Body, Scene
from ffr_gallery.bodies import GRAVITY, bar, tried
from ffr_gallery.exhibit import Claim, Curve, Exhibit, Mark, Panel, Proof, boundary

RK4_LIMIT = 2 * np.sqrt(2)  # on the imaginary axis; Hairer & Wanner 1996, IV.2
STIFFNESS = 1e7  # N/m
STEPS, STOPPED = 400, 100.0


def hung(stiffness: float) -> Scene:
    """A rigid bar on a bushing that is soft about one axis."""
    along = (stiffness,) * 3
    bushing = Bushing("bushing", "ground.O", "bar.a", (*along, 1e-3 * stiffness, 1e-3 * stiffness, 0.0))
    return Scene((Body("bar", bar("bar")),), forces=(bushing,), ground={"O": (0, 0, 0)}, gravity=GRAVITY)


def stiff_bushing() -> Exhibit:
    """RK4 beyond 2.83 over the frequency of the bushing grows; ROS2 takes it implicitly."""
    scene = hung(STIFFNESS)
    predicted = RK4_LIMIT / float(np.abs(linearise(scene).eigenvalues.imag).max())

    def energy(step: float, method: type[RK4] | type[ROS2] = RK4) -> float:
        result = tried(scene, end=STEPS * step, output_step=STEPS * step, method=method(step))
        return STOPPED if result is None else min(float(result["energy.kinetic"][-1]), STOPPED)

    measured = boundary(lambda h: energy(h) < 0.5 * STOPPED, 0.3 * predicted, 3 * predicted)
    steps = predicted * np.array([0.3, 0.5, 0.7, 0.9, 0.97, 1.05, 1.2])
    return Exhibit(
        "Stiff bushings",
        "an explicit method bears 2.83 / omega of the bushing against the least mass that it moves, however slow the machine",
        "ROS2, ROS3 take bushings as rows with compliance: from soft to rigid without a limit",
        (Claim("largest stable step of RK4", predicted, measured, 1.05, "s"),),
        (
            Proof("RK4, energy 10 % beyond the limit", energy(1.1 * predicted), 0.5 * STOPPED, True, "J"),
            Proof("ROS2, energy with a hundred times that step", energy(100 * predicted, ROS2), 20.0, False, "J"),
        ),
        (
            Panel(
                f"a bar on a bushing of {STIFFNESS:.0e} N/m",
                "step [s]",
                f"kinetic energy after {STEPS} steps [J]",
                (Curve("RK4", steps, np.array([energy(h) for h in steps]), points=True),),
                (Mark("predicted", predicted), Mark("measured", measured, measured=True)),
                log=(False, True),
            ),
        ),
    )
