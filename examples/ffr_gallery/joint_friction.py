"""Friction in a hinge, smoothed near rest: with too long an explicit step it drives what it should stop."""

from __future__ import annotations

import numpy as np

from ffr_dyn.integrators import RK4, ROS2, Integrator
from ffr_dyn.scene.forces import JointFriction
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_gallery.bodies import bar, tried
from ffr_gallery.exhibit import Claim, Curve, Exhibit, Mark, Panel, Proof, boundary
from ffr_prep.common.arrays import Array

INERTIA, TORQUE, CREEP = 0.02, 0.5, 0.01  # kg m^2, N m, rad/s
SPEED, AT_REST = 5.0, 1e-4  # rad/s
RK4_LIMIT = 2.785  # on the negative axis; Hairer & Wanner 1996, IV.2
END = 0.5  # s; the wheel stands after 0.2


def turned(method: Integrator) -> tuple[Array, Array]:
    """(times, rates) of a wheel that friction brings to rest; infinite where the run stops."""
    model = bar("wheel", 0.0, 1.0, (1e-2, 1e-2, INERTIA))
    scene = Scene(
        (Body("wheel", model, omega_bar=(0, 0, SPEED)),),
        (Joint("hinge", "revolute", "ground.O", "wheel.a"),),
        forces=(JointFriction("friction", "hinge", coulomb=TORQUE, creep=CREEP),),
        ground={"O": (0, 0, 0)},
    )
    rows = max(1, round(END / method.step / 500)) * method.step
    result = tried(scene, end=rows * round(END / rows), output_step=rows, method=method, outputs=["wheel.omega_bar"])
    return (
        (np.array([0.0, END]), np.full(2, np.inf)) if result is None else (result.time, result["wheel.omega_bar"][:, 2])
    )


def joint_friction() -> Exhibit:
    """The slope of smoothed friction at rest is a damper, and its explicit limit that of one."""
    predicted = RK4_LIMIT * INERTIA * CREEP / TORQUE

    def left(method: Integrator) -> float:
        return float(np.abs(turned(method)[1][-1]))

    measured = boundary(lambda h: left(RK4(h)) < AT_REST, 0.3 * predicted, 3 * predicted)
    curves = {f"RK4, {share:g} of the limit": turned(RK4(share * predicted)) for share in (0.9, 2.0, 8.0)} | {
        "ROS2, 8 of the limit": turned(ROS2(8 * predicted))
    }
    return Exhibit(
        "Friction with too long a step",
        "smoothed friction at rest is a damper d = torque / creep: explicit steps beyond 2.785 I / d keep the wheel turning",
        "ROS2, ROS3 take friction implicitly: the wheel stands; a run with an explicit method says which step it bears",
        (Claim("largest step with which RK4 brings the wheel to rest", predicted, measured, 1.05, "s"),),
        (
            Proof("rate that is left with RK4, twice the limit", left(RK4(2 * predicted)), CREEP / 10, True, "rad/s"),
            Proof(
                "rate that is left with ROS2, eight times the limit", left(ROS2(8 * predicted)), AT_REST, False, "rad/s"
            ),
        ),
        (
            Panel(
                "a wheel that friction stops",
                "time [s]",
                "rate [rad/s]",
                tuple(Curve(label, times, np.abs(rates) + 1e-12) for label, (times, rates) in curves.items()),
                (Mark("should stand from here", SPEED * INERTIA / TORQUE),),
                log=(False, True),
                bounds=(1e-8, 10.0),
            ),
        ),
    )
