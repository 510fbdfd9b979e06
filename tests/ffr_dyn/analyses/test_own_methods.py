"""A method and an analysis of one's own, from a module that the project does not know: one file and one call each."""

from __future__ import annotations

import json
import sys

import numpy as np
import pytest
from click.testing import CliRunner

import ffr_dyn as fd
from ffr_dyn.analyses import registry
from ffr_dyn.cli import cli
from ffr_dyn.integrators import METHODS
from ffr_dyn.scene_file.schema import schema

METHOD = '''
"""Symplectic Euler: velocities first, then positions by them."""
from dataclasses import dataclass
from typing import ClassVar

import ffr_dyn as fd
from ffr_dyn.kernels import integrator_api as api
from ffr_dyn.kernels.integrator_api import H, OK, method_step


@method_step
def symplectic_euler_step(r: api.Tables, t: float, again: int) -> int:
    h, rates = r.clock.time[H], r.stages
    api.set_diagonal(r, 0.0)
    status = api.stabilise(r, t, r.x, r.v)
    if status != OK:
        return status
    api.acceleration_target(r.work.rows, r.clock.gains, rates.target)
    api.solve_stage(r, r.x, rates.target, 0, 0.0, 1.0)
    api.velocity_rates(r, rates.v[0])
    api.add_scaled(r.v, r.v, h, rates.v[0])
    api.position_rates(r.model.bodies, r.x, r.v, rates.x[0])
    api.add_scaled(r.x, r.x, h, rates.x[0])
    api.normalise(r.model.bodies, r.x)
    return api.finite(r.x, r.v)


@dataclass(frozen=True)
class SymplecticEuler:
    """Symplectic Euler."""

    step: float
    order: ClassVar[int] = 1
    implicit: ClassVar[bool] = False
    reach: ClassVar[float] = 2.0
    controlled: ClassVar[bool] = False
    repeatable: ClassVar[bool] = True
    stage_count: ClassVar[int] = 1
    row_stages: ClassVar[int] = 0
    keeps_terms: ClassVar[bool] = False
    looks_ahead: ClassVar[int] = 0
    numbers: ClassVar[tuple[float, ...]] = ()
    do_step: ClassVar[api.CompiledFunction] = symplectic_euler_step


fd.register_integrator("symplectic-euler", SymplecticEuler)
'''

ANALYSES = '''
"""How far a point sinks under its own weight; and a run from which every second row is kept."""
from dataclasses import dataclass, field, replace
from typing import ClassVar

import ffr_dyn as fd


@fd.register_analysis
@dataclass(frozen=True)
class Sag(fd.OfMoment):
    """How far a point of SCENE sinks, from its assembled position to the equilibrium."""

    example: ClassVar[str] = "ffr-dyn sag crane.toml --point rod.tip"
    point: str = field(default="rod.tip", metadata=fd.option("--point", "Marker that sinks."))

    def perform(self, scene, settings, *, path=None):
        before = fd.assembly(scene, **settings.span)
        after = fd.static(scene, path=path, **settings.span)
        sag = float(before[f"{self.point}.position.y"][0] - after[f"{self.point}.position.y"][0])
        return replace(after, attributes={**after.attributes, "sag": sag})

    def report(self, result):
        return [f"sag          {result.attributes['sag']:.6f} m"]


@fd.register_analysis
@dataclass(frozen=True)
class Sparse(fd.OverTime):
    """Forward dynamics of SCENE with a row every `every` output steps."""

    integrates: ClassVar[bool] = True
    every: int = field(default=2, metadata=fd.option("--every", "Output steps from row to row."))

    def perform(self, scene, settings, **how):
        span = settings.span | {"output_step": self.every * settings.output_step}
        return fd.forward(scene, method=settings.method, **span, **how)
'''

SCENE = """
name = "rod"
gravity = [0, -9.81, 0]
plugins = ["{plugin}"]
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
    """What a test registers is gone after it, and so are the modules that did."""
    methods, analyses, modules = dict(METHODS), dict(registry._REGISTERED), set(sys.modules)
    yield
    for now, before in ((METHODS, methods), (registry._REGISTERED, analyses)):
        now.clear()
        now.update(before)
    for name in set(sys.modules) - modules:
        if name.startswith("ffr_plugin:"):
            del sys.modules[name]


@pytest.fixture
def write(tmp_path):
    """A scene file with a plugin beside it."""

    def made(plugin: str, analysis: str):
        (tmp_path / "own.py").write_text(plugin, encoding="utf-8")
        file = tmp_path / "rod.toml"
        file.write_text(SCENE.format(plugin="own.py", analysis=analysis), encoding="utf-8")
        return file

    return made


def command(*words: object) -> str:
    done = CliRunner().invoke(cli, [str(word) for word in words], catch_exceptions=False)
    assert done.exit_code == 0
    return done.output


def test_a_method_of_ones_own_runs_from_a_file_a_command_and_python(write, tmp_path):
    file = write(METHOD, 'method = "symplectic-euler"\nend = 0.2\noutput_step = 0.02\nstep = 1e-4')
    scene, settings = fd.load_scene(file)
    found = fd.run(scene, settings)
    command("run", file, "-o", tmp_path / "a.nc")
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


def test_a_method_of_ones_own_is_in_schema_commands_and_written_files(write, tmp_path):
    file = write(METHOD, "end = 0.2\noutput_step = 0.02")
    scene, _ = fd.load_scene(file)
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
