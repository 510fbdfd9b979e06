"""A driver that moves too far within a step: projection closes its joint at the ends of steps and hides what lies between."""

from __future__ import annotations

import numpy as np

from ffr_dyn.consistency.following import LOST
from ffr_dyn.functions.formula import formula
from ffr_dyn.integrators import RK4
from ffr_dyn.integrators.stabilisation import Drifting, Projection, Stabilisation
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_gallery.bodies import bar, tried
from ffr_gallery.exhibit import Claim, Curve, Exhibit, Mark, Panel, Proof, boundary
from ffr_prep.common.arrays import Array

STEP, SWING, END = 1e-2, 0.5, 0.5  # s, rad, s


def opening(z: float) -> float:
    """By how much the driven angle is off after a step of RK4 with step times circular frequency z, at the worst phase [rad].

    Of theta'' = -SWING omega^2 sin(omega t) RK4 takes h^2 (f(0) + 2 f(h / 2)) / 6 for the integral of (h - s) f(s).
    """
    return SWING * abs(np.exp(1j * z) - 1 - 1j * z + z**2 / 6 * (1 + 2 * np.exp(0.5j * z)))


def off(z: float, step: float = STEP, stabilisation: Stabilisation = Projection()) -> float:  # noqa: B008 - frozen
    """The largest difference of angle and driver [rad]; infinite where the run stops."""
    omega = z / STEP
    result = tried(_swung(omega), end=END, output_step=STEP, method=RK4(step), stabilisation=stabilisation)
    if result is None:
        return np.inf
    return float(np.abs(result["hinge.angle"] - SWING * np.sin(omega * result.time)).max())


def _swung(omega: float) -> Scene:
    return Scene(
        (Body("bar", bar("bar")),),
        (Joint("hinge", "revolute", "ground.O", "bar.a"),),
        (Driver("motor", "hinge", formula(f"{SWING} * sin({omega} * t)")),),
        ground={"O": (0, 0, 0)},
    )


def fast_driver() -> Exhibit:
    """The frequency from which a run stops, by what a step of RK4 leaves open."""
    z = np.geomspace(0.3, 4.0, 200)
    theory = np.array([opening(each) for each in z])
    predicted = float(np.interp(LOST, theory, z))
    measured = boundary(lambda each: np.isfinite(off(each)), 0.5 * predicted, 1.5 * predicted)
    tried_at: Array = np.geomspace(0.3, 1.0, 8)
    drifted = np.array([off(each, stabilisation=Drifting()) for each in tried_at])
    return Exhibit(
        "A driver faster than the step",
        "within a step the joint leaves its driver: without projection rows show it, with projection only the ends are right",
        "a run stops, names the driver, how far it moves in a step, and the step that follows it",
        (Claim("step times circular frequency from which a run stops", predicted, measured, 1.05),),
        (
            Proof("angle off without projection at h omega = 1", off(1.0, stabilisation=Drifting()), 0.01, True, "rad"),
            Proof("angle off with a twentieth of the step", off(measured, STEP / 20), 1e-6, False, "rad"),
        ),
        (
            Panel(
                "a swinging driver, RK4",
                "h omega",
                "angle off [rad]",
                (
                    Curve("after one step, predicted", z, theory),
                    Curve("without projection", tried_at, drifted, points=True),
                ),
                (Mark("stops, predicted", predicted), Mark("stops, measured", measured, measured=True)),
                log=(True, True),
                bounds=(1e-6, 10.0),
            ),
        ),
    )
