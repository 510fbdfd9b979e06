"""Long mechanisms with many redundant joints: the actuator of a scissor lift carries what virtual work says."""

from __future__ import annotations

import numpy as np
import pytest

from ffr_dyn.analyses.static import static
from ffr_dyn.functions.time_functions import constant
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import rigid_body

G, MASS, ANGLE = 9.81, 2.0, 0.5


def lift(stages: int) -> Scene:
    """Crossed bars of one metre; the lower end of one is held, that of the other driven along the ground. Hinged in space."""
    c, s = np.cos(ANGLE), np.sin(ANGLE)
    bar = rigid_body(
        "bar", mass=MASS, inertia=(1e-3, 0.17, 0.17), points={"a": (-0.5, 0, 0), "m": (0, 0, 0), "b": (0.5, 0, 0)}
    )
    foot = rigid_body("foot", mass=1.0, inertia=(1, 1, 1), points={"p": (0, 0, 0)})
    bodies = [Body("foot", foot, position=(c, 0, 0))]
    joints = [
        Joint("guide", "translational", "ground.o", "foot.p", axis=(1, 0, 0)),
        Joint("foot_pin", "revolute", "foot.p", "d0.b"),
        Joint("base", "revolute", "ground.o", "u0.a"),
    ]
    for k in range(stages):
        middle = (c / 2, s * (k + 0.5), 0)
        bodies += [Body(f"u{k}", bar, position=middle, rotation=(0, 0, ANGLE))]
        bodies += [Body(f"d{k}", bar, position=middle, rotation=(0, 0, -ANGLE))]
        joints.append(Joint(f"cross{k}", "revolute", f"u{k}.m", f"d{k}.m"))
        if k:
            joints.append(Joint(f"left{k}", "revolute", f"d{k - 1}.a", f"u{k}.a"))
            joints.append(Joint(f"right{k}", "revolute", f"u{k - 1}.b", f"d{k}.b"))
    drivers = (Driver("act", "guide", constant(c), coordinate="stroke"),)
    return Scene(tuple(bodies), tuple(joints), drivers=drivers, ground={"o": (0, 0, 0)}, gravity=(0, -G, 0))


@pytest.mark.parametrize("stages", [4, 20, pytest.param(60, marks=pytest.mark.slow)])
def test_the_actuator_carries_what_virtual_work_says(stages):
    """Pairs of bars at (k + 1/2) sin(angle), the foot at cos(angle)."""
    rise = -(np.arange(stages) + 0.5).sum() / np.tan(ANGLE)
    assert static(lift(stages))["act.effort"][0] == pytest.approx(2 * MASS * G * rise, rel=1e-10)
