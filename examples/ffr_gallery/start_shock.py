"""An undeformed beam that is set in accelerated motion vibrates about the shape it should have: twice the deflection."""

from __future__ import annotations

import numpy as np

from ffr_dyn.analyses.forward import forward
from ffr_dyn.analyses.trials.begin import Beginning
from ffr_dyn.functions.time_functions import polynomial
from ffr_dyn.integrators import ROS3
from ffr_dyn.results.result import Result
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_gallery.bodies import beam
from ffr_gallery.exhibit import Claim, Curve, Exhibit, Panel, Proof

ACCELERATION = 2.0  # rad/s^2
DENSITY, BENDING, LENGTH = 1.0, 100.0, 1.0
END = 0.5  # s


def driven() -> Scene:
    """A beam on an axle that turns faster and faster, from rest."""
    return Scene(
        (Body("beam", beam("beam", LENGTH, DENSITY, BENDING, 6)),),
        (Joint("axle", "revolute", "ground.O", "beam.a"),),
        (Driver("motor", "axle", polynomial(0, 0, 0.5 * ACCELERATION)),),
        ground={"O": (0, 0, 0)},
        plane="z",
    )


def start_shock() -> Exhibit:
    """The deflection of a beam under the inertia of its acceleration, started undeformed and in its quasi-static shape."""

    def started(begin: Beginning) -> Result:
        return forward(driven(), end=END, output_step=1e-3, method=ROS3(1e-4), check=False, begin=begin)

    # w'''' EI = -rho alpha x with the root clamped: w(L) = -11 rho alpha L^5 / (120 EI)
    static = 11 * DENSITY * ACCELERATION * LENGTH**5 / (120 * BENDING)
    shocked, quiet = (
        np.abs(each["beam.b.displacement"][:, 1]) for each in (started("as-given"), started("quasi-static"))
    )
    time = np.linspace(0, END, shocked.size)
    return Exhibit(
        "Start shock",
        "a beam that begins undeformed is let go from its shape under load: deflections and forces ring up to twice theirs",
        "begin = 'quasi-static': deflections and rates that fit the accelerations of the start",
        (
            Claim(
                "largest deflection from an undeformed start, over the static one", 2.0, shocked.max() / static, 1.05
            ),
            Claim("deflection at the end from the quasi-static start", static, float(quiet[-1]), 1.02, "m"),
        ),
        (
            Proof("ringing, over the static deflection, undeformed", float(np.ptp(shocked) / static), 1.0, True),
            Proof("ringing, over the static deflection, quasi-static", float(np.ptp(quiet) / static), 0.02, False),
        ),
        (
            Panel(
                "an axle with constant acceleration",
                "time [s]",
                "deflection of the tip [m]",
                (
                    Curve("from the undeformed beam", time, shocked),
                    Curve("from the quasi-static one", time, quiet),
                    Curve("static", time, np.full(time.size, static)),
                ),
            ),
        ),
    )
