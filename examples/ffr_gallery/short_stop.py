"""A stop that is met within a step or two: the rebound is lost, or fed, by all steps of such a length alike."""

from __future__ import annotations

import numpy as np

from ffr_dyn.analyses.forward import forward
from ffr_dyn.integrators import ROS2, ROS3
from ffr_dyn.scene.forces import JointStop
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_gallery.exhibit import Claim, Curve, Exhibit, Mark, Panel, Proof
from ffr_prep.body import rigid_body
from ffr_prep.common.arrays import Array

MASS, STIFFNESS, SPEED = 1.0, 1e6, 1.0  # kg, N/m, m/s
ENTRY = 1e-6  # m, of a depth of a millimetre
LASTS = np.pi * np.sqrt(MASS / STIFFNESS)  # s: half a vibration against the stop
RESOLVED = 4.0  # steps in it
PHASES = 8  # of the first step within the stop


def thrown(gap: float) -> Scene:
    """A mass that slides without friction towards an undamped stop at zero."""
    block = rigid_body("block", mass=MASS, inertia=(1.0, 1.0, 1.0), points={"c": (0, 0, 0)})
    guide = Joint("guide", "translational", "ground.o", "block.c", axis=(1, 0, 0))
    stop = JointStop("stop", "guide", stiffness=STIFFNESS, entry=ENTRY, lower=0.0, coordinate="stroke")
    body = Body("block", block, position=(gap, 0, 0), velocity=(-SPEED, 0, 0))
    return Scene((body,), (guide,), forces=(stop,), ground={"o": (0, 0, 0)})


def off(method: type[ROS2] | type[ROS3], steps: float) -> float:
    """By how much of it the energy that comes back is wrong at worst, with so many steps in the time that the stop is met."""
    step = LASTS / steps
    before, after = 2 * step, max(4 * LASTS, 8 * step)
    found = []
    for phase in np.arange(PHASES) / PHASES:
        scene, count = thrown((before + phase * step) * SPEED), int(np.ceil((before + after) / step))
        end = count * step
        result = forward(scene, end=end, output_step=end, method=method(step), check=False)
        speed = result["block.c.velocity"][-1, 0]
        found.append(abs((speed / SPEED) ** 2 - 1) if speed > 0 else 1.0)
    return max(found)


def lasting() -> float:
    """[s] from the rows of a fine run at which the stop pushes."""
    step = LASTS / 1000
    result = forward(thrown(0.1 * LASTS * SPEED), end=2 * LASTS, output_step=step, method=ROS2(step), check=False)
    return float((np.abs(result["stop.force"]) > 0).sum() * step)


def lost(method: type[ROS2] | type[ROS3], steps: Array) -> Array:
    return np.array([off(method, each) for each in steps])


def short_stop() -> Exhibit:
    """A stop of stiffness k before a mass m is met for pi sqrt(m / k): a step has to be a fraction of it."""
    steps = np.geomspace(0.3, 30.0, 9)
    by_ros2, by_ros3 = lost(ROS2, steps), lost(ROS3, steps)
    told = forward(thrown(LASTS), end=10 * LASTS, output_step=LASTS, method=ROS3(LASTS), check=True)
    silent = 0.0 if str(told.attributes["accuracy"]).startswith("step: not known") else 1.0
    return Exhibit(
        "Stops that are met within few steps",
        "steps of about pi sqrt(m / k) or more give back nothing of the energy, or any share of it",
        "ten steps in that time; a run with fewer than four tells that its error is not known, and the default takes none",
        (Claim("time for which the stop is met", LASTS, lasting(), 1.02, "s"),),
        (
            Proof("energy that ROS3 loses or feeds, one step in the stop", off(ROS3, 1.0), 0.5, True),
            Proof("energy that ROS2 loses or feeds, thirty steps in the stop", off(ROS2, 30.0), 0.02, False),
            Proof("a run with one step in the stop, silent (1) or told (0)", silent, 0.5, False),
        ),
        (
            Panel(
                "energy that does not come back, or too much that does",
                "steps in the time for which the stop is met",
                "share of the energy",
                (
                    Curve("ROS2", steps, by_ros2, points=True),
                    Curve("ROS3", steps, by_ros3, points=True),
                ),
                (Mark("fewer are told", RESOLVED),),
                log=(True, True),
            ),
        ),
    )
