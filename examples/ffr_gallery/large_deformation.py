"""A cantilever under a growing force: where linear elasticity in the moving frame ends, and that a run says so."""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from ffr_dyn.analyses.integration import integrate
from ffr_dyn.analyses.states import scene_at
from ffr_dyn.analyses.static import static
from ffr_dyn.consistency.validity import STRAINED
from ffr_dyn.integrators import ROS2
from ffr_dyn.scene.forces import Load
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_gallery.bodies import beam
from ffr_gallery.exhibit import Claim, Curve, Exhibit, Mark, Panel, Proof, boundary
from ffr_prep.common.arrays import Array


def loaded(force: float) -> Scene:
    """A beam of length and bending stiffness one, of linear theory, clamped, with a force down at its tip."""
    return Scene(
        (Body("beam", beam("beam", 1.0, 1.0, 1.0, 6), stiffening=False),),
        (Joint("clamp", "fixed", "ground.O", "beam.a"),),
        loads=(Load("force", "beam.b", force=(0, -force, 0)),),
        ground={"O": (0, 0, 0)},
        plane="z",
    )


def exact(force: float) -> float:
    """Deflection of the tip by the elastica theta'' = -F cos theta (theta downward), theta(0) = 0, theta'(1) = 0."""

    def slopes(_: float, y: Array) -> tuple[float, float, float]:
        return y[1], -force * np.cos(y[0]), np.sin(y[0])

    def ends(bending: float) -> tuple[float, float]:
        done = solve_ivp(slopes, (0, 1), (0, bending, 0), rtol=1e-10, atol=1e-12)
        return float(done.y[1, -1]), float(done.y[2, -1])

    return ends(float(brentq(lambda b: ends(b)[0], 0.0, 2 * force + 1e-9)))[1]


def large_deformation() -> Exhibit:
    """The warning comes where the tip turns by 0.1 rad, when the deflection is off by half a per cent or so."""

    def warned(force: float) -> bool:
        scene = loaded(force)
        result = integrate(scene_at(scene, static(scene)), end=1e-3, output_step=1e-3, method=ROS2(1e-3))
        return any("turns within itself" in note for note in result.attributes["notes"])

    predicted = 2 * STRAINED  # F L^2 / 2 EI = 0.1
    measured = boundary(lambda force: not warned(force), 0.25 * predicted, 4 * predicted, 10)
    forces = np.geomspace(0.02, 4.0, 20)
    off = np.array([float(-static(loaded(f))["beam.b.displacement"][-1, 1]) / exact(f) - 1 for f in forces])
    at_warning = float(np.interp(predicted, forces, off))
    return Exhibit(
        "Large deformation",
        "linear elasticity in the moving frame knows no shortening: the deflection is too large, with the square of the turn",
        "a run says so beyond 0.1 rad; several bodies for one, each with its own frame, divide the turn",
        (Claim("force at which a run begins to warn", predicted, measured, 1.01, "EI / L^2"),),
        (
            Proof("deflection off under a force of 4 EI / L^2", float(off[-1]), 0.5, True),
            Proof("deflection off where the warning begins", at_warning, 0.01, False),
        ),
        (
            Panel(
                "cantilever with a force at its tip", "force [EI / L^2]", "deflection too large by",
                (
                    Curve("linear, against the elastica", forces, off),
                    Curve("warned", forces[forces > measured], off[forces > measured], points=True),
                ),
                (Mark("warning predicted", predicted), Mark("warning measured", measured, measured=True)),
                log=(True, True),
            ),
        ),
    )  # fmt: skip
