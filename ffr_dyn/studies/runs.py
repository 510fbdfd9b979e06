"""The runs of a study, one after another in the process of a worker, and the bodies that they need.

A run that fails is a row with its message. Bodies are made by the command ffr-prep in the worker, each distinct line once;
the file is named by what it is made from, line and contents of the files in it, so that another study finds it, too.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import re
import shlex
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from importlib import import_module
from pathlib import Path

from ffr_dyn.analyses.forward import Forward
from ffr_dyn.analyses.run import run
from ffr_dyn.analyses.settings import MomentSettings, Settings
from ffr_dyn.scene_file.read import load_scene
from ffr_dyn.studies.measures import ERROR, Measured, Number, units, values, wanted
from ffr_prep.body import BodyError, FlexibleBody, load_body
from ffr_prep.common.errors import ComputationError, InputError

COMMAND = (
    "ffr_prep.cli"  # a command line is all that is known of it here; a process for each would load the mesher anew
)
LOADED = 8  # bodies that a worker keeps
NAMING, QUOTED = (".toml", ".geo"), re.compile(r"""["']([^"'\n]{1,200})["']""")
KEY = 24  # hexadecimal digits of a body's name


@dataclass(frozen=True)
class Point:
    """A run: its number, the parameters of the study, those of them that are the scene's, and files of bodies."""

    number: int
    parameters: Mapping[str, float | str]
    of_scene: Mapping[str, str]
    bodies: Mapping[str, str]


@dataclass(frozen=True)
class Task:
    """Runs that a worker does one after another; `histories`: the folder of their result files, or empty."""

    scene: str
    outputs: tuple[Measured, ...]
    points: tuple[Point, ...]
    histories: str = ""


@dataclass(frozen=True)
class Row:
    """The outcome of a run: its numbers and histories with their units, or why there are none."""

    number: int
    values: Mapping[str, Number]
    message: str = ""
    units: Mapping[str, str] = field(default_factory=dict)


def perform(task: Task) -> list[Row]:
    """The rows of a task."""
    return [_row(task, point) for point in task.points]


def _row(task: Task, point: Point) -> Row:
    missing = [f"body {name!r}: {path[1:]}" for name, path in point.bodies.items() if path.startswith("!")]
    if missing:
        return Row(point.number, {}, missing[0])
    try:
        bodies = {name: _body(path) for name, path in point.bodies.items()}
        scene, settings = load_scene(task.scene, point.of_scene, bodies)
        path = f"{task.histories}/run-{point.number:06d}.nc" if task.histories else None
        result = run(scene, _kept(settings, task.outputs, bool(path)), path=path)
        found = values(task.outputs, result, point.parameters)
        return Row(point.number, found, units=units(task.outputs, result))
    except (InputError, BodyError, ComputationError) as error:
        return Row(point.number, {}, " ".join(str(error).split()))


@lru_cache(maxsize=LOADED)
def _body(path: str) -> FlexibleBody:
    """The body of a file that is named by what is in it; what was prepared of it for other runs is kept with it."""
    return load_body(path)


def _kept(settings: Settings | MomentSettings, outputs: tuple[Measured, ...], whole: bool) -> Settings | MomentSettings:
    """The settings of the scene with what the study wants kept; further runs tell errors only where they are asked for."""
    names = wanted(outputs)
    found = replace(settings, outputs=(*(settings.outputs if whole else ()), *names) or settings.outputs)
    asked = any(one.how == ERROR for one in outputs)
    if isinstance(found.analysis, Forward) and (asked or found.analysis.check is None):
        return replace(found, analysis=replace(found.analysis, check=asked))
    return found


# ---- bodies ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Recipe:
    """A body to be made by a line of ffr-prep, in a folder, to a file."""

    line: str
    folder: str
    file: str


def body_file(line: str, folder: Path, cache: Path) -> Path:
    """Where a body is kept: named by its line and by what is in the files that it names, and that these name."""
    words = shlex.split(line)
    digest = hashlib.sha256(repr(words).encode())
    for word in words[1:]:
        named = folder / word.rpartition("=")[2]
        for file in (named, *_files_in(named)) if named.is_file() else ():
            digest.update(file.read_bytes())
    return cache / f"{digest.hexdigest()[:KEY]}.ffr"


def _files_in(path: Path) -> list[Path]:
    """The files that a structure file or a geometry script names, between quotes."""
    if path.suffix not in NAMING:
        return []
    said = {found[1] for found in QUOTED.finditer(path.read_text(encoding="utf-8", errors="replace"))}
    return [file for file in (path.parent / name for name in sorted(said)) if file.is_file()]


def make(recipe: Recipe) -> str:
    """Make a body, if its file is not there. Returns why it could not be made, or nothing."""
    target = Path(recipe.file)
    if target.exists():
        return ""
    words = [_placed(word, Path(recipe.folder)) for word in shlex.split(recipe.line)]
    said = io.StringIO()
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            import_module(COMMAND).cli.main(args=[*words, "-o", str(target)], standalone_mode=False)
    except (InputError, BodyError, ComputationError) as error:
        return " ".join(str(error).split())
    except Exception as error:  # click's own of a word that it does not know
        return " ".join(getattr(error, "message", str(error)).split())
    return ""


def _placed(word: str, folder: Path) -> str:
    """A word of a line, with the folder where it is the name of a file in it."""
    head, equals, name = word.rpartition("=")
    return f"{head}{equals}{folder / name}" if name and (folder / name).is_file() else word
