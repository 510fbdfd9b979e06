"""What the cases of remedies share: the scenes that they begin with, and how a command is run."""

from __future__ import annotations

import shlex
from contextlib import chdir
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from ffr_gallery.bodies import bar, pendulum
from synthetic import cloud

from ffr_dyn.analyses.integration import integrate
from ffr_dyn.cli import cli
from ffr_dyn.integrators import ROS2
from ffr_dyn.results.result import Result
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import FlexibleBody
from ffr_prep.common.interrupts import ending_in_order
from ffr_prep.common.outputs import command_inputs

GROUND = {"O": (0, 0, 0), "P": (0.9, 0, 0), "Q": (1, 2, 0)}
HINGED = Scene((Body("bar", bar("bar")),), (Joint("hinge", "revolute", "ground.O", "bar.a"),), ground=GROUND)
TURNING = replace(HINGED, bodies=(replace(HINGED.bodies[0], omega_bar=(0, 0, 1.0)),))
DRIVEN = replace(HINGED, drivers=(Driver("d", "hinge", 0.0),))
DOUBLE = replace(pendulum(bar("upper"), bar("lower")), gravity=(0, -9.81, 0))
CLOUD = Scene((Body("cloud", cloud(2)),), (Joint("hinge", "revolute", "ground.O", "cloud.a"),), ground=GROUND)


def run(
    scene: Scene, method: object = ROS2(1e-3), end: float = 0.1, output_step: float = 0.01, **more: object
) -> Result:
    return integrate(scene, end=end, output_step=output_step, method=method, **more)


SCENE = """
[analysis]
end = 0.1
output_step = 0.05
step = 0.005
[ground]
hinge = [0, 0, 0]
[bodies.rod]
mass = 1.0
inertia = [0.01, 0.333333333333, 0.333333333333]
centre_of_mass = [1, 0, 0]
points.hinge = [0, 0, 0]
points.tip = [2, 0, 0]
[joints.hinge]
kind = "revolute"
i = "ground.hinge"
j = "rod.hinge"
"""
DRIVER = """
[drivers.motor]
joint = "hinge"
function = "0.3 + 2 * t"
"""


def command(*lines: str, text: str = SCENE, **files: str) -> None:
    """Run commands of ffr-dyn in a folder of their own, in which the scene is rod.toml, and files by their stems."""
    with TemporaryDirectory() as folder, chdir(folder), ending_in_order(), command_inputs():
        for name, content in {"rod": text, **files}.items():
            Path(f"{name}.toml").write_text(content)
        for line in lines:
            cli(shlex.split(line), standalone_mode=False)


def stressed(model: FlexibleBody, size: float = 1e9) -> FlexibleBody:
    """The body with stress modes [Pa], of steel."""
    surface = model.surface
    stress = size * np.random.default_rng(1).normal(size=(len(surface.points), 6, model.n))
    moduli = np.tile([2.1e11, 0.3], (len(surface.points), 1))
    return replace(model, surface=replace(surface, stress=stress, moduli=moduli))
