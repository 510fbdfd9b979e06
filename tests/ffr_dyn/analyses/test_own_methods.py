"""A method and analyses of one's own, as CONTRIBUTING.md shows them: modules that the project does not know."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from click.testing import CliRunner
from places import ROOT

import ffr_dyn as fd
from ffr_dyn.analyses import registry
from ffr_dyn.cli import cli
from ffr_dyn.integrators import METHODS
from ffr_dyn.scene_file.schema import schema

PAGE = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
METHOD, ANALYSES = (
    re.search(rf"<!-- {name} -->\n```python\n(.*?)```", PAGE, re.S).group(1) for name in ("euler.py", "sag.py")
)

SCENE = """
name = "rod"
gravity = [0, -9.81, 0]
[analysis]
{analysis}
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


@pytest.fixture(autouse=True)
def as_it_was():
    """What a test registers is gone after it."""
    methods, analyses = dict(METHODS), dict(registry._REGISTERED)
    yield
    for now, before in ((METHODS, methods), (registry._REGISTERED, analyses)):
        now.clear()
        now.update(before)


@pytest.fixture
def write(tmp_path):
    """A scene file, with a plugin beside it that is loaded."""

    def made(plugin: str, analysis: str):
        (tmp_path / "own.py").write_text(plugin, encoding="utf-8")
        fd.load_plugin(tmp_path / "own.py")
        file = tmp_path / "rod.toml"
        file.write_text(SCENE.format(analysis=analysis), encoding="utf-8")
        return file

    return made


def command(*words: object) -> str:
    done = CliRunner().invoke(cli, [str(word) for word in words], catch_exceptions=False)
    assert done.exit_code == 0
    return done.output


@pytest.mark.slow
def test_a_method_of_ones_own_runs_from_a_file_a_command_and_python(write, tmp_path):
    file = write(METHOD, 'method = "symplectic-euler"\nend = 0.2\noutput_step = 0.02\nstep = 1e-4')
    scene, settings = fd.load_scene(file)
    found = fd.run(scene, settings)
    command("--plugin", tmp_path / "own.py", "run", file, "-o", tmp_path / "a.nc")
    kept = fd.load_result(tmp_path / "a.nc")
    np.testing.assert_array_equal(kept["rod.tip.position"], found["rod.tip.position"])
    exact = fd.forward(scene, end=0.2, output_step=0.02, method=fd.RK4(1e-3))
    own = type(settings.method)
    far = [
        np.abs(
            fd.forward(scene, end=0.2, output_step=0.02, method=own(step))["hinge.angle"] - exact["hinge.angle"]
        ).max()
        for step in (2e-4, 1e-4)
    ]
    assert far[0] < 1e-2
    assert far[0] / far[1] == pytest.approx(2, rel=0.05)  # of first order
    assert np.abs(found["energy.total"] - found["energy.total"][0]).max() < 1e-2


@pytest.mark.slow
def test_a_method_of_ones_own_is_in_schema_commands_and_written_files(write, tmp_path):
    file = write(METHOD, "end = 0.2\noutput_step = 0.02")
    scene = fd.load_scene(file)[0]
    assert "symplectic-euler" in json.dumps(schema())
    assert "symplectic-euler   order 1, steps of one length, explicit" in command("methods")
    said = command("run", file, "--method", "symplectic-euler", "--step", "1e-3", "-o", tmp_path / "a.nc")
    assert "SymplecticEuler" in said
    own = METHODS["symplectic-euler"](1e-3)
    changed = fd.Settings(start=0.0, end=0.2, output_step=0.02, method=own)
    again = fd.load_scene(fd.save_scene(scene, changed, tmp_path / "again.toml"))[1]
    assert again == changed


def test_analyses_of_ones_own_are_commands_and_kinds_in_files(write, tmp_path):
    file = write(ANALYSES, 'kind = "sag"\npoint = "rod.tip"')
    scene, settings = fd.load_scene(file)
    assert fd.run(scene, settings).attributes["sag"] == pytest.approx(2.0, abs=1e-9)
    assert "sag          2.000000 m" in command("run", file, "-o", tmp_path / "a.nc")
    plugin = ("--plugin", tmp_path / "own.py")
    assert "sag          0.000000 m" in command(*plugin, "sag", file, "--point", "rod.hinge", "-o", tmp_path / "a.nc")
    assert "How far a point of SCENE sinks" in command(*plugin, "--help")
    assert "ffr-dyn sag crane.toml" in command(*plugin, "sag", "--help")
    assert fd.load_scene(fd.save_scene(scene, settings, tmp_path / "again.toml"))[1] == settings
    assert "SagEntry" in json.dumps(schema())


def test_an_analysis_over_time_takes_the_options_of_its_kind(write, tmp_path):
    file = write(ANALYSES, "end = 0.2\noutput_step = 0.02")
    plugin = ("--plugin", tmp_path / "own.py")
    command(*plugin, "sparse", file, "--every", "5", "--end", "0.4", "--method", "rk4", "-o", tmp_path / "a.nc")
    kept = fd.load_result(tmp_path / "a.nc")
    assert kept.time.tolist() == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.4])
    assert kept.attributes["method"].startswith("RK4")


def test_what_is_registered_is_looked_at():
    class Wrong:
        controlled = False

    with pytest.raises(fd.InputError, match="method 'wrong': the class Wrong lacks order, implicit"):
        fd.register_integrator("wrong", Wrong)
    with pytest.raises(fd.InputError, match="there is a method 'rk4' already"):
        fd.register_integrator("rk4", fd.ROS2)
    with pytest.raises(fd.InputError, match="Wrong is no analysis"):
        fd.register_analysis(Wrong)
    with pytest.raises(fd.InputError, match="there is an analysis 'static' already"):
        fd.register_analysis(type("Static", (fd.OfMoment,), {}))
    with pytest.raises(fd.InputError, match="no analysis 'forwards'; did you mean 'forward'"):
        registry.analysis("forwards")


@pytest.mark.parametrize("word", registry.LISTED)
def test_every_analysis_is_where_its_line_says(word):
    made = registry.analysis(word)
    assert registry.word_of(made) == word
    assert issubclass(made, (fd.OverTime, fd.OfMoment))
    assert made.__doc__
    assert getattr(fd, made.__name__) is made


@pytest.mark.parametrize("name", METHODS)
def test_every_method_is_at_the_door(name):
    assert getattr(fd, METHODS[name].__name__) is METHODS[name]
