"""What studies say of their files, their samples and their tables."""

from __future__ import annotations

import errno
from collections.abc import Callable
from contextlib import chdir
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest.mock import patch

import numpy as np
from said import Case
from test_parts_command import CLAMPED
from test_sweep import SCENE

import ffr_dyn as fd
from ffr_dyn.chart.runner import Lost
from ffr_dyn.studies.draw import plot_study
from ffr_dyn.studies.measures import attribute
from ffr_dyn.studies.plan import study
from ffr_dyn.studies.runs import Full
from ffr_dyn.studies.sampling import Axis, Spread, points, spaced
from ffr_dyn.studies.sweep import _check
from ffr_dyn.studies.table import FORMAT, Journal, Table, load_table
from ffr_dyn.studies.workers import _refused, crew

p = partial
ANGLE = {"angle": "hinge.angle: last"}
G = {"g": [5.0, 9.81]}


def inside(made: Callable[..., object], *given: object, **more: object) -> object:
    """In a folder with the scenes."""
    with TemporaryDirectory() as folder, chdir(folder):
        Path("bar.toml").write_text(SCENE)
        Path("strip.toml").write_text(CLAMPED)
        return made(*given, **more)


def asked(parameters: object, outputs: object = ANGLE, **more: object) -> Callable[[], object]:
    return p(inside, study, "bar.toml", parameters, outputs, **more)


def made(bodies: dict[str, str]) -> Callable[[], object]:
    return p(inside, study, "strip.toml", {"d": [1, 2]}, {"x": "strip.tip.position.x: last"}, bodies=bodies)


def swept(outputs: dict[str, str] = ANGLE, *, space: bool = True, another: bool = False) -> object:
    """A sweep, on a full disk, or to the place of another one that has begun."""

    def sweep() -> object:
        if another:
            with Journal("t.nc", study("bar.toml", {"g": [1, 2]}, ANGLE)):
                pass
        full = patch.object(Journal, "add", side_effect=OSError(errno.ENOSPC, "No space left on device"))
        with full if not space else patch.object(Path, "cwd", Path.cwd):
            return fd.sweep(study("bar.toml", G, outputs), "t.nc", workers=0)

    return inside(sweep)


def at_rest(output: str) -> object:
    """A sweep of equilibria."""

    def sweep() -> object:
        scene = SCENE.replace("end = 0.2\noutput_step = 0.01\nstep = 1e-3", 'kind = "static"')
        Path("hanging.toml").write_text(scene)
        return fd.sweep(study("hanging.toml", G, {"x": output}), "t.nc", workers=0)

    return inside(sweep)


def read(*, study: bool, of_format: int = FORMAT, by: Callable[[str], object] = load_table) -> object:
    def load() -> object:
        scene, settings = fd.load_scene("bar.toml")
        fd.forward(scene, **settings.span, method=settings.method, check=False, path="run.nc")
        with patch("ffr_dyn.studies.table.FORMAT", of_format):
            fd.sweep(fd.study("bar.toml", G, ANGLE), "table.nc", workers=0)
        return by("table.nc" if study else "run.nc")

    return inside(load)


def drawn(values: object, *outputs: str) -> object:
    table = Table({"g": values}, {"angle": np.array([1.0, 2.0, 4.0])}, ("", "", ""))
    return inside(plot_study, table, "pictures", outputs)


def sampled(spread: Spread, **more: object) -> object:
    return points({"x": spread}, **{"samples": 4, **more})


def loaded(**bodies: str) -> object:
    return inside(fd.load_scene, "bar.toml", bodies=bodies)


def pushed(force: str, joint: str = "hinge") -> object:
    """A scene with a formula of the motion and a parameter of the name of an angle."""

    def load() -> object:
        scene = SCENE.replace("idle = 3.0", "hinge.angle = 3.0").replace("joints.hinge]", f"joints.{joint}]")
        Path("pushed.toml").write_text(f'{scene}[loads.push]\nmarker = "bar.a"\nforce = ["{force}", 0, 0]\n')
        return fd.load_scene("pushed.toml")

    return inside(load)


def opened(count: int) -> object:
    with crew(count) as found:
        return found


TABLE = Table({"g": [1.0]}, {"angle": np.ones(1)}, ("",))
NORMAL = Spread("normal", (0.0, 1.0))
NUMBERS = np.array([1.0, 2.0, 3.0])
LINE = "reduce-structure d.toml --set d=${d}"
SHORT, LONG = Axis((1, 2)), Axis((1, 2, 3))
FULL = {name: spaced(0, 1, 1000) for name in "abcd"}


def served(*files: str) -> None:
    """What a worker of a study says of files of Python that it is to load."""
    if (refused := _refused(files)) is not None:
        raise refused


CASES = [
    Case(p(served, "nowhere.py"), served),
    Case(asked({}), asked(G)),
    Case(asked(G, {}), asked(G)),
    Case(asked({"g": []}), asked(G)),
    Case(asked({"g": {"from": 1, "to": 2, "count": 3, "spacing": "even"}}),
         asked({"g": {"from": 1, "to": 2, "count": 3, "spacing": "log"}})),
    Case(asked({"g": {"from": "a", "to": 2, "count": 3}}), asked({"g": {"from": 1, "to": 2, "count": 3}})),
    Case(asked({"length": {"from": "1 m", "to": 2, "count": 3}}),
         asked({"length": {"from": "1 m", "to": "2 m", "count": 3}})),
    Case(asked({"length": {"lognormal": ["1 m", "0.1 m"]}}, samples=2),
         asked({"length": {"lognormal": ["1 m", 0.1]}}, samples=2)),
    *(Case(asked({"g": wrong}), asked(G)) for wrong in (np.nan, [1.0, np.inf], {"from": 1, "to": np.nan, "count": 3})),
    Case(asked({"g h": [1]}), asked(G)),
    Case(asked({"gg": [1]}), asked(G)),
    Case(asked({**G, "idle": [1]}), asked(G)),
    Case(asked({"bodies.bar.mas": [1]}), asked({"bodies.bar.mass": [1]})),
    Case(asked({"gravity": [1], "gravity.2": [1]}), asked({"gravity.2": [1]})),
    Case(made({"stripe": LINE}), made({"strip": LINE})),
    Case(made({"strip": f"modes {LINE}"}), made({"strip": LINE})),
    Case(made({"strip": "reduce d.geo --set d='${d}deg'"}), made({"strip": "reduce d.geo --set d='${d}mm'"})),
    Case(asked(G, {"angle": "hinge.angle"}), asked(G)),
    Case(asked(G, {"time": "hinge.angle: last"}), asked(G)),
    Case(p(swept, {"x": "hinge.force: history"}), p(swept, {"x": "hinge.force.x: history"})),
    Case(p(at_rest, "hinge.angle: error"), p(at_rest, "hinge.angle: last")),
    Case(p(swept, {"x": "degree: attribute"}), p(swept, {"x": "degrees_of_freedom: attribute"})),
    Case(p(attribute, {"jumps": ["x"]}, "jumps.1"), p(attribute, {"jumps": ["x"]}, "jumps")),
    Case(p(attribute, {"jumps": ["x"]}, "jump"), p(attribute, {"jumps": ["x"]}, "jumps")),
    Case(p(spaced, 0, 1, 0), p(spaced, 0, 1, 2)),
    Case(p(spaced, 0, 1, 2, logarithmic=True), p(spaced, 0.1, 1, 2, logarithmic=True)),
    Case(p(points, {"a": SHORT, "b": LONG}, paired=True), p(points, {"a": SHORT, "b": SHORT}, paired=True)),
    Case(p(spaced, 0, np.inf, 2), p(spaced, 0, 1, 2)),
    Case(asked(G, samples=4), asked(G)),
    Case(asked(G, seed=1), asked(G)),
    Case(asked({"g": NORMAL}, samples=4, seed=-1), asked({"g": NORMAL}, samples=4, seed=1)),
    Case(asked(G, {**ANGLE, "twice": "= angle * t"}), asked(G, {**ANGLE, "twice": "= 2 * angle"})),
    Case(asked(G, {**ANGLE, "a": "= b", "b": "= a"}), asked(G, {**ANGLE, "a": "= 2 * angle", "b": "= a"})),
    Case(p(read, study=True, of_format=99), p(read, study=True)),
    Case(p(points, {"x": NORMAL}), p(points, {"x": NORMAL}, samples=4)),
    Case(p(points, FULL), p(points, {"a": NORMAL, "b": NORMAL}, samples=4)),
    Case(p(sampled, Spread("uniform", (1.0, np.nan))), p(sampled, Spread("uniform", (1.0, 2.0)))),
    Case(p(sampled, Spread("normal", (1.0,))), p(sampled, NORMAL)),
    Case(p(sampled, Spread("gauss", (0.0, 1.0))), p(sampled, NORMAL)),
    Case(p(sampled, NORMAL, sampling="random"), p(sampled, NORMAL, sampling="monte-carlo")),
    Case(p(swept, {"x": "hinge.torque: last"}), swept),
    Case(p(swept, space=False), swept),
    Case(p(swept, another=True), swept),
    Case(p(loaded, baar="strip.ffr"), p(loaded)),
    Case(p(opened, -1), p(opened, 1)),
    Case(p(TABLE.__getitem__, "angel"), p(TABLE.__getitem__, "angle")),
    Case(p(read, study=False), p(read, study=True)),
    Case(p(drawn, NUMBERS, "angel"), p(drawn, NUMBERS, "angle")),
    Case(p(drawn, ["a", "a", "a"], "angle"), p(drawn, NUMBERS, "angle")),
    Case(asked({"length": {"beta": ["1 m", 2, "1 m", "1 m"]}}, samples=2),
         asked({"length": {"beta": [1, 2, "1 m", "1 m"]}}, samples=2)),
    Case(p(inside, fd.load_study, "bar.toml"), p(inside, fd.load_scene, "bar.toml")),
    Case(p(pushed, "-2 * hinge.angle"), p(pushed, "-2 * hinge.angle_rate")),
    Case(p(pushed, "-2 * g-a.angle", "g-a"), p(pushed, "-2 * g_a.angle", "g_a")),
    Case(asked({"bodies": {"bar": {"mass": [1]}}, "bodies.bar.mass": [1]}), asked({"bodies.bar.mass": [1]})),
    Case(p(read, study=True, by=fd.load_result), p(read, study=False, by=fd.load_result)),
    Case(p(_check, Full("writing t.nc.runs/run-000001.nc failed")), p(_check, [])),
    Case(p(_check, Lost("the task was lost: the cluster has gone")), p(_check, [])),
]  # fmt: skip
