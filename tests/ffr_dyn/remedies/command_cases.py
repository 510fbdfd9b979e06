"""What the commands say, and what scene files are told on reading and writing."""

from __future__ import annotations

from contextlib import chdir
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from subprocess import CompletedProcess
from tempfile import TemporaryDirectory
from unittest.mock import patch

import numpy as np
from remedy import CLOUD, DRIVEN, DRIVER, HINGED, SCENE, command
from said import Case
from test_parts_command import CLAMPED, STRIP

import ffr_dyn as fd
from ffr_dyn.analyses.events import Event
from ffr_dyn.analyses.forward import Forward
from ffr_dyn.analyses.mixed import Mixed
from ffr_dyn.analyses.settings import Settings
from ffr_dyn.cli import cli
from ffr_dyn.functions.formula import formula
from ffr_dyn.functions.operations import SQRT
from ffr_dyn.functions.time_functions import operation, table
from ffr_dyn.integrators import ROS2
from ffr_dyn.scene.forces import Load
from ffr_dyn.scene_file.write import save_scene, to_toml
from ffr_prep.body import load_body, save_body
from ffr_prep.cli import cli as ffr_prep
from ffr_prep.common.errors import InputError

p = partial


def words(wrong: str, right: str, text: str = SCENE, **files: str) -> Case:
    """A command that is refused, and the one that it should have been."""
    return Case(p(command, wrong, text=text, **files), p(command, right, text=text, **files))


def texts(wrong: str, right: str, text: str = SCENE, line: str = "check rod.toml", **files: str) -> Case:
    """Lines at the end of a scene file that are refused, and what they should have been."""
    return Case(p(command, line, text=text + wrong, **files), p(command, line, text=text + right, **files))


STATIC = SCENE.replace("end = 0.1\noutput_step = 0.05\nstep = 0.005", 'kind = "static"')
SPRING = '[forces.s]\nkind = "joint-spring"\njoint = "hinge"\nstiffness = {}\n'
HANGING = STATIC + SPRING.format(1.0)
KEPT = "run rod.toml -o run.nc"
CHART = (
    "chart rod.toml -m position:rod.tip --method ros2=1e-2 --workers 0 --repeats 1 --wanted 1e-3 --against evaluations"
)


@cache
def chart() -> None:
    """A chart, drawn once: several texts are mended to it."""
    command(CHART)


def charted(body: str) -> None:
    """A chart of a swinging body, with another file for it."""
    with TemporaryDirectory() as folder, chdir(folder):
        save_scene(replace(CLOUD, gravity=(0, -9.81, 0)), FORWARD, "swing.toml")
        words = CHART.replace("rod.toml -m position:rod.tip", "swing.toml -m position:cloud.b").replace("1e-2", "1e-3")
        cli([*words.split(), "--body", body], standalone_mode=False)


def parted(command: str) -> None:
    """A strip that bends, in as many parts as it needs; its file says that it was made by the command."""
    with TemporaryDirectory() as folder, chdir(folder):
        Path("strip.toml").write_text(STRIP)
        Path("scene.toml").write_text(CLAMPED)
        ffr_prep(["reduce-structure", "strip.toml", "-o", "strip.ffr"], standalone_mode=False)
        body = load_body("strip.ffr")
        save_body(replace(body, provenance={**body.provenance, "command": command.split()}), "strip.ffr")
        with patch("ffr_dyn.cli.parts.subprocess.run", here):
            cli(["parts", "scene.toml", "--static", "--reduce"], standalone_mode=False)


def here(words: list[str], *, check: bool) -> CompletedProcess[str]:
    """ffr-prep in this process."""
    try:
        ffr_prep(words[3:], standalone_mode=False)
    except InputError:
        return CompletedProcess(words, 2)
    return CompletedProcess(words, 0)


COMMANDS = [
    words("check strip.toml", "check rod.toml", strip=STRIP),
    words("run rod.toml -p mas=2", "run rod.toml -p mass=2", "parameters.mass = 1.0\n" + SCENE),
    words("run rod.toml --tolerance 1e-6", "run rod.toml --step 1e-3"),
    words("run rod.toml --step 1e-3 --accuracy 1e-3", "run rod.toml --step 1e-3"),
    words("run rod.toml --method dopri5 --step 1e-3", "run rod.toml --method dopri5 --tolerance 1e-6"),
    words("run rod.toml --step 1e-3", "run rod.toml", HANGING),
    words("static rod.toml --time nan", "static rod.toml --time 0", HANGING),
    Case(p(command, "kinematic rod.toml", text=STATIC + DRIVER), p(command, "kinematic rod.toml", text=SCENE + DRIVER)),
    words("mixed rod.toml --unknown m", "mixed rod.toml --unknown m=hinge.angle", SCENE + DRIVER),
    words("mixed rod.toml --unknown m=rod.tip:x", "mixed rod.toml --unknown m=rod.tip:0,1,0", SCENE + DRIVER),
    words("realtime rod.toml --method dopri5", "realtime rod.toml --method rk4 --duration 0.1"),
    Case(
        p(command, KEPT, "plot run.nc rod.tip rod.hinge --path xy -o path.png"),
        p(command, KEPT, "plot run.nc rod.tip --path xy -o path.png"),
    ),
    Case(p(command, CHART, text=STATIC), chart),
    Case(p(charted, "clod"), p(charted, "cloud=swing.cloud.ffr")),
    Case(p(command, "parts rod.toml"), p(parted, "reduce-structure strip.toml")),
    Case(p(parted, "reduce-structure far.toml"), p(parted, "reduce-structure strip.toml")),
    Case(p(command, CHART + " --end -1"), chart),
    Case(p(command, CHART.replace("1e-2", "0")), chart),
    Case(p(command, CHART + " --method ros2=1e-2"), chart),
]

LOADED = '[loads.{name}]\nmarker = "rod.tip"\nforce = [0, {force}, 0]\n'
INPUT = "[inputs]\nu = 1.0\n"
SLOW, SLOWER = '"-rod.tip.velocity.y"', '"u - rod.tip.velocity.y"'
GUIDED = SCENE.replace("step = 0.005", 'method = "generalised-alpha"\nsettings = {{spectral_radius = {}}}')


def included(main: str) -> Case:
    """A file that includes rod.toml as its first line says, and one that does so as it should."""
    right = 'include = ["rod.toml"]\n'
    return Case(p(command, "check main.toml", main=main), p(command, "check main.toml", main=right))


FILES = [
    texts("[parameters]\nsin = 1.0\n", "[parameters]\nsine = 1.0\n"),
    texts('[parameters]\na = "2 * b"\nb = "a / 2"\n', '[parameters]\na = "2 * b"\nb = 0.5\n'),
    texts('[parameters]\na = 1.0\n[drivers.d]\njoint = "hinge"\nfunction = "${b}"\n',
          '[parameters]\na = 1.0\n[drivers.d]\njoint = "hinge"\nfunction = "${a}"\n'),
    texts(INPUT + LOADED.format(name="one", force=SLOWER),
          INPUT + LOADED.format(name="one", force=SLOW) + LOADED.format(name="two", force='"u"')),
    texts("[inputs]\nt = 1.0\n", "[inputs]\nu = 1.0\n"),
    texts(LOADED.format(name="l", force='"rod.tip.velocty.y"'), LOADED.format(name="l", force=SLOW)),
    texts('[markers.tip]\nbody = "rod"\npoint = [1, 0, 0]\n', '[markers.mid]\nbody = "rod"\npoint = [1, 0, 0]\n'),
    Case(p(command, "check rod.toml", text=GUIDED.format(2.0)), p(command, "check rod.toml", text=GUIDED.format(0.8))),
    Case(p(command, "run rod.toml", text=HANGING + "[chart]\nmodes = [2]\n"), p(command, "run rod.toml", text=HANGING)),
    included('include = ["rod.toml"]\n[ground]\nhinge = [0, 0, 1]\n'),
    included('include = ["main.toml"]\n'),
    included('include = "rod.toml"\n'),
    included('include = ["/rod.toml"]\n'),
    texts(SPRING.format('"5 * t"'), SPRING.format('"5 * pi"')),
    texts(DRIVER.replace('"0.3 + 2 * t"', '{table_file = "three.toml"}'),
          DRIVER.replace('"0.3 + 2 * t"', '{table_file = "two.toml"}'),
          three="0, 0, 1\n1, 1, 2\n", two="0, 0\n1, 1\n"),
    texts(DRIVER.replace('"0.3 + 2 * t"', '{table_file = "none.toml"}'),
          DRIVER.replace('"0.3 + 2 * t"', '{table_file = "two.toml"}'),
          none="# time, angle\n", two="# time, angle\n0, 0\n\n1, 1  # end\n"),
]  # fmt: skip

# ---- written ------------------------------------------------------------------------------------------------------------

ROOT_OF_TABLE = operation(SQRT, table([0.0, 1.0], [1.0, 2.0]))
FORWARD = Settings(start=0.0, end=0.1, output_step=0.01, method=ROS2(1e-3))


def pushed(**how: object) -> str:
    return to_toml(replace(HINGED, loads=(Load("l", "bar.b", **how),)), FORWARD)


def watched(quantity: object) -> str:
    return to_toml(HINGED, replace(FORWARD, analysis=Forward(events=(Event("e", quantity),))))


def known(*names: object) -> str:
    motor = (fd.JointEffort("m", "hinge"),)
    return to_toml(DRIVEN, replace(FORWARD, analysis=Mixed(unknown=motor, known=names)))


def saved(*, whole: bool) -> object:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "scene.toml"
        return save_scene(CLOUD, FORWARD, path) if whole else path.write_text(to_toml(CLOUD, FORWARD))


WRITTEN = [
    Case(p(saved, whole=False), p(saved, whole=True)),
    Case(lambda: pushed(force=(0, np.sin, 0)), lambda: pushed(force=(0, formula("sin(t)"), 0))),
    Case(lambda: pushed(function=lambda t, state: (0, 0, 1.0)), lambda: pushed(force=(0, 0, 1.0))),
    Case(lambda: watched(lambda t, state: t - 0.05), lambda: watched("hinge.angle")),
    Case(lambda: pushed(force=(0, ROOT_OF_TABLE, 0)), lambda: pushed(force=(0, formula("sqrt(1 + t)"), 0))),
    Case(lambda: formula("2 * bar.b.position.x"), lambda: formula("2 * t")),
]
CASES = COMMANDS + FILES + WRITTEN
