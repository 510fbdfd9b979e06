"""A cantilever on a turning axle: without geometric stiffening its bending in the plane of rotation loses all stiffness."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ffr_dyn.functions.time_functions import TimeFunction, polynomial, user
from ffr_dyn.integrators import ROS2
from ffr_dyn.results.result import Result
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_gallery.bodies import beam, tried
from ffr_gallery.exhibit import Claim, Curve, Exhibit, Panel, Proof, boundary

LENGTH, BENDING, DENSITY = 10.0, 1.4e4, 1.2  # Simo & Vu-Quoc 1987
SPEED, RISE = 6.0, 15.0  # rad/s, s
LARGEST = -0.573761  # m, the deflection at 6.8 s; geometrically exact, right to 3e-7
FIRST = 1.8751040687119611**2 * np.sqrt(BENDING / DENSITY) / LENGTH**2  # rad/s, Euler-Bernoulli
SMALL = 0.01  # m sqrt(kg), a deflection at the start


def scene(turning: TimeFunction, *, stiffened: bool, q: float = 0.0) -> Scene:
    """The beam, clamped to an axle that turns so."""
    model = beam("beam", LENGTH, DENSITY, BENDING, 3)
    start = np.zeros(model.n)
    start[0] = q
    body = Body("beam", model if stiffened else replace(model, stiffening=None), q=start)
    return Scene((body,), (Joint("axle", "revolute", "ground.O", "beam.a"),), (Driver("motor", "axle", turning),),
                 ground={"O": (0, 0, 0)}, plane="z")  # fmt: skip


def spin_up() -> Exhibit:
    """The manoeuvre of Simo & Vu-Quoc, and the speed from which a beam without stiffening leaves its axis."""

    def manoeuvre(stiffened: bool) -> Result | None:
        return tried(scene(user(_angle), stiffened=stiffened), end=8.0, output_step=0.1, method=ROS2(2e-3))

    def stable(speed: float) -> bool:
        steady = scene(polynomial(0, speed), stiffened=False, q=SMALL)
        result = tried(steady, end=60.0, output_step=1.0, method=ROS2(5e-3))
        return result is not None and float(np.abs(result["beam.q"][:, 0]).max()) < 10 * SMALL

    measured = boundary(stable, 0.5 * FIRST, 2 * FIRST, 10)
    curves, at = [], {}
    for stiffened, label in ((True, "with stiffening"), (False, "without")):
        result = manoeuvre(stiffened)
        assert result is not None
        deflection = result["beam.b.displacement"][:, 1]
        curves.append(Curve(label, result.time, np.clip(deflection, -3, 3)))
        at[stiffened] = float(np.interp(6.8, result.time, deflection))
    return Exhibit(
        "Spin-up with and without geometric stiffening",
        "linear elasticity alone: bending softens by Omega^2, and above the first frequency the beam leaves its axis",
        "geometric stiffening by the axial force of the rotation",
        (
            Claim("speed from which the beam diverges without it (its first frequency)", FIRST, measured, 1.02, "rad/s"),
            Claim("deflection of the tip at 6.8 s, with it", LARGEST, at[True], 1.005, "m"),
        ),
        (
            Proof("deflection at 6.8 s without it", abs(at[False]), 1.0, True, "m"),
            Proof("distance from the exact deflection with it", abs(at[True] - LARGEST), 1e-3, False, "m"),
        ),
        (
            Panel(
                "spin-up to 6 rad/s in 15 s", "time [s]", "deflection of the tip [m]",
                (*curves, Curve("exact, at 6.8 s: -0.574 m", np.array([6.8]), np.array([LARGEST]), points=True)),
                bounds=(-2.5, 0.5),
            ),
        ),
    )  # fmt: skip


def _angle(t: float) -> tuple[float, float, float]:
    """Angle, rate and second derivative of the manoeuvre, up to RISE."""
    w, share = 2 * np.pi / RISE, SPEED / RISE
    return share * (t**2 / 2 + (np.cos(w * t) - 1) / w**2), share * (t - np.sin(w * t) / w), share * (1 - np.cos(w * t))
