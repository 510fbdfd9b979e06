"""The runs of a study, one after another in the process of a worker, and the bodies that they need.

A run that fails is a row with its message. Bodies are made by the command ffr-prep in the worker, each distinct line once;
the file is named by what it is made from, line and contents of the files in it, so that another study finds it, too.
"""

from __future__ import annotations

import contextlib
import io
import shlex
import time
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
from ffr_prep.body import MAKE_AGAIN, BodyError, FlexibleBody, load_body
from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.common.outputs import InUseError, no_room

COMMAND = (
    "ffr_prep.cli"  # a command line is all that is known of it here; a process for each would load the mesher anew
)
LOADED = 8  # bodies that a worker keeps
BETWEEN = "\n"  # the notes of a run
WAIT = 1.0  # s, for a body that another study makes


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
    """The outcome of a run: its numbers and histories with their units, and what the run notes; why there are none, or not
    of all outputs."""

    number: int
    values: Mapping[str, Number]
    message: str = ""
    units: Mapping[str, str] = field(default_factory=dict)
    notes: str = ""


@dataclass(frozen=True)
class Full:
    """No room for what a worker had to write, and the rows that it had before."""

    reason: str
    rows: tuple[Row, ...] = ()


def perform(task: Task) -> list[Row] | Full:
    """The rows of a task."""
    rows = list[Row]()
    for point in task.points:
        row = _row(task, point)
        if isinstance(row, Full):
            return replace(row, rows=tuple(rows))
        rows.append(row)
    return rows


def _row(task: Task, point: Point) -> Row | Full:
    missing = [f"body {name!r}: {path[1:]}" for name, path in point.bodies.items() if path.startswith("!")]
    if missing:
        return Row(point.number, {}, missing[0])
    try:
        bodies = {name: _body(path) for name, path in point.bodies.items()}
        scene, settings = load_scene(task.scene, point.of_scene, bodies)
        path = f"{task.histories}/run-{point.number:06d}.nc" if task.histories else None
        result = run(scene, _kept(settings, task.outputs, bool(path)), path=path)
        found, why = values(task.outputs, result, point.parameters)
        notes = BETWEEN.join(map(str, result.attributes.get("notes", ())))
        return Row(point.number, found, _in_a_line("; ".join(why)), units(task.outputs, result, found), notes)
    except (InputError, BodyError, ComputationError) as error:
        message = _in_a_line(str(error))
        return Full(message) if no_room(error) else Row(point.number, {}, message)


def _in_a_line(text: str) -> str:
    return " ".join(text.split())


@lru_cache(maxsize=LOADED)
def _body(path: str) -> FlexibleBody:
    """The body of a file that is named by what is in it; what was prepared of it for other runs is kept with it.

    Raises BodyError with the remedy of a file that the study makes itself.
    """
    try:
        return load_body(path)
    except BodyError as error:
        raise BodyError(str(error).replace(MAKE_AGAIN, "delete it, and the study makes it anew")) from None


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


def make(recipe: Recipe) -> str | Full:
    """Make a body, if its file is not there, or wait for another study that does. Returns why it could not be made, or
    nothing."""
    target = Path(recipe.file)
    words = [_placed(word, Path(recipe.folder)) for word in shlex.split(recipe.line)]
    while not target.exists():
        said = io.StringIO()
        try:
            with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
                import_module(COMMAND).cli.main(args=[*words, "-o", str(target)], standalone_mode=False)
        except InUseError:
            time.sleep(WAIT)
        except Exception as error:  # also click's own of a word that it does not know
            why = _in_a_line(getattr(error, "message", str(error)))
            return Full(why) if no_room(error) else why
    return ""


def _placed(word: str, folder: Path) -> str:
    """A word of a line, with the folder where it is the name of a file in it."""
    head, equals, name = word.rpartition("=")
    return f"{head}{equals}{folder / name}" if name and (folder / name).is_file() else word
