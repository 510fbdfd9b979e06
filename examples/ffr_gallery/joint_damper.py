"""A servo at a joint of flexible links: its damping, over the small masses that turn there, limits explicit steps."""

from __future__ import annotations

import numpy as np

from ffr_dyn.analyses.linearise import linearise
from ffr_dyn.integrators import RK4, ROS2
from ffr_dyn.scene.forces import JointSpring
from ffr_dyn.scene.scene import Scene
from ffr_gallery.bodies import beam, pendulum, tried
from ffr_gallery.exhibit import Claim, Curve, Exhibit, Mark, Panel, Proof, boundary

RK4_LIMIT = 2.785  # on the negative axis; Hairer & Wanner 1996, IV.2
STIFFNESS, DAMPING = 200.0, 6.0  # N m/rad, N m s/rad
STEPS, GROWN = 400, 10.0


def servoed(damping: float) -> Scene:
    """Two beams in a row, which fall; a servo holds the hinge between them."""
    models = [beam(name, 1.0, 1.0, 100.0, 6) for name in ("upper", "lower")]
    return pendulum(*models, forces=(JointSpring("servo", "hinge1", stiffness=STIFFNESS, damping=damping),))


def fastest(scene: Scene) -> float:
    """Decay rate of what decays fastest [1/s]."""
    return float(-linearise(scene).eigenvalues.real.min())


def joint_damper() -> Exhibit:
    """RK4 stops beyond 2.785 over the fastest decay, which grows with the damper; ROS2 takes its force implicitly."""
    scene = servoed(DAMPING)
    predicted = RK4_LIMIT / fastest(scene)

    def bears(step: float, method: type[RK4] | type[ROS2] = RK4, damped: Scene = scene) -> bool:
        result = tried(damped, end=STEPS * step, output_step=STEPS * step, method=method(step))
        return result is not None and float(result["energy.strain"][-1]) < GROWN

    measured = boundary(bears, 0.3 * predicted, 3 * predicted)
    dampers = np.geomspace(4.0, 100.0, 6)
    found = [servoed(each) for each in dampers]
    limits = np.array([RK4_LIMIT / fastest(each) for each in found])

    def limit(damped: Scene, predicted: float) -> float:
        return boundary(lambda step: bears(step, RK4, damped), 0.3 * predicted, 3 * predicted, 8)

    borne = np.array([limit(each, step) for each, step in zip(found, limits, strict=True)])
    return Exhibit(
        "Dampers and servos at flexible joints",
        "an explicit force of a damper is unstable beyond 2.785 / (d sum of phi_r^2): a useful servo wants microseconds",
        "ROS2, ROS3 take forces on joints as rows with compliance, implicitly: no damper limits their step",
        (Claim("largest stable step of RK4", predicted, measured, 1.05, "s"),),
        (
            Proof("RK4, 10 % beyond the limit, runs (1) or not (0)", 1.0 - bears(1.1 * predicted), 0.5, True),
            Proof(
                "ROS2, a hundred times that step, stops (1) or not (0)", 1.0 - bears(100 * predicted, ROS2), 0.5, False
            ),
        ),
        (
            Panel(
                "largest step of RK4, two beams, six modes each",
                "damping of the servo [N m s/rad]",
                "step [s]",
                (
                    Curve("2.785 / fastest decay", dampers, limits),
                    Curve("measured", dampers, borne, points=True),
                    Curve("ROS2 ran here", dampers[-3:], 100 * limits[-3:], points=True),
                ),
                (Mark("a useful servo", DAMPING),),
                log=(True, True),
            ),
        ),
    )
