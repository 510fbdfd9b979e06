"""A study as text: a TOML file that names a scene, parameters with the values they take, and outputs.

    scene = "crank.toml"
    samples = 200                                # of the distributions
    sampling = "latin-hypercube"                 # or monte-carlo (default), sobol
    seed = 0

    [parameters]                                 # of the scene, or of the making of its bodies below
    load = [10, 50, 100]                         # one after another; several such make a grid
    speed = {from = 50, to = 150, count = 11}    # spacing = "log" if wanted
    diameter = {uniform = [5e-3, 7e-3]}          # normal, triangular, lognormal, or any distribution of scipy.stats
    "bodies.slider.mass" = [0.3, 0.4]            # any entry of the scene, by the path of its keys

    [bodies.rod]                                 # made anew, once for every distinct text, by the command ffr-prep
    make = "reduce rod.geo --set diameter=${diameter} --material steel --interface a --interface b --modes 8"

    [outputs]                                    # see `ffr_dyn.studies.measures`
    force = "pin.force: largest"
    share = "= force / load"

Paths are relative to the file; `points = "list"` takes the values of all parameters together, not as a grid.
"""

from __future__ import annotations

import hashlib
import json
import math
import re
import shlex
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ffr_dyn.scene_file.assignments import unknown
from ffr_dyn.scene_file.parameters import flattened, nearest, substituted
from ffr_dyn.scene_file.read import body_files
from ffr_dyn.scene_file.source import read_source
from ffr_dyn.studies.measures import Measured, measured
from ffr_dyn.studies.sampling import USUAL, Axis, Sampling, Spread, Value, points, spaced
from ffr_prep.common.brief import Brief
from ffr_prep.common.entries import places_of
from ffr_prep.common.errors import InputError
from ffr_prep.common.reading import read_toml

MAKING = ("reduce", "reduce-structure", "reduce-matrices")
TAKEN = ("run", "row", "time", "message")  # columns that every table may have


class BodyRecipe(BaseModel):
    """How a body is made, once for every distinct line.

    make : a line of ffr-prep, without the name of the command and the output; "${name}" stands for a parameter
    """

    model_config = ConfigDict(extra="forbid")
    make: str


class StudyFile(BaseModel):
    """The whole file.

    scene : file of the scene, relative to this one
    parameters : by name, the values that they take: a list, a range, a distribution
    outputs : by name, what a run is reduced to: "QUANTITY: HOW", or "= formula" of outputs and parameters
    bodies : by name, those that are made anew as parameters change
    points : lists and ranges as a grid, or side by side as a list
    samples : points drawn of the distributions
    sampling : how they are drawn
    seed : of the random numbers
    histories : keeps the result file of every run, in `<output>.runs`
    """

    model_config = ConfigDict(extra="forbid")
    scene: str
    parameters: dict[str, Any]
    outputs: dict[str, str]
    bodies: dict[str, BodyRecipe] = Field(default_factory=dict)
    points: Literal["grid", "list"] = "grid"
    samples: int = 0
    sampling: Sampling = "monte-carlo"
    seed: int = 0
    histories: bool = False


@dataclass(frozen=True, repr=False)
class Study(Brief):
    """A scene, the values that its parameters take run after run, and what is kept of every run.

    scene      : its file;  points: the parameters of every run, by name
    recipes    : by body, a line of ffr-prep in which "${name}" stands for a parameter;  folder: of the files in them
    outputs    : what a run is reduced to
    histories  : whether the result file of every run is kept, too

    >>> study = fd.load_study("study.toml")
    >>> len(study.points)
    """

    scene: Path
    points: tuple[dict[str, Value], ...]
    outputs: tuple[Measured, ...]
    recipes: Mapping[str, str]
    folder: Path
    histories: bool = False

    @property
    def parameters(self) -> tuple[str, ...]:
        """Their names."""
        return tuple(self.points[0])


def load_study(path: str | Path) -> Study:
    """Read a study file and look at it: parameters that exist and change something, outputs that are written as such.

    Raises InputError that names the entry, its value and what is expected.

    >>> study = fd.load_study("study.toml")
    """
    path = Path(path)
    tree = read_toml(path, "a study file")
    try:
        entry = StudyFile.model_validate(tree)
    except ValidationError as error:
        first = min(error.errors(), key=lambda one: one["type"] != "extra_forbidden")
        where = ".".join(map(str, first["loc"]))
        hint = f"; {_hint(where)}" if first["type"] == "extra_forbidden" else f" (it is {first['input']!r})"
        raise InputError(
            f"{path}: {where}: {first['msg'].lower()}{hint if first['type'] != 'missing' else ''}"
        ) from None
    try:
        return study(
            path.parent / entry.scene, entry.parameters, entry.outputs, bodies={k: b.make for k, b in entry.bodies.items()},
            points_are=entry.points, samples=entry.samples, sampling=entry.sampling, seed=entry.seed, folder=path.parent,
            histories=entry.histories,
        )  # fmt: skip
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def study(
    scene: str | Path,
    parameters: Mapping[str, Any],
    outputs: Mapping[str, str],
    *,
    bodies: Mapping[str, str] = {},
    points_are: Literal["grid", "list"] = "grid",
    samples: int = 0,
    sampling: Sampling = "monte-carlo",
    seed: int = 0,
    folder: str | Path = ".",
    histories: bool = False,
) -> Study:
    """A study of a scene file, in the words of a study file (this module's first lines); raises InputError as `load_study`.

    fd.study("crank.toml", {"load": [10, 50, 100]}, {"force": "pin.force: largest"})

    >>> study = fd.study("scene.toml", {"speed": [100, 150, 200]}, {"tip": "rod.tip.position.y: last"})
    """
    if not parameters:
        raise InputError("parameters: there are none; name at least one with its values, such as load = [10, 50]")
    if not outputs:
        raise InputError('outputs: there are none; name at least one, such as force = "pin.force: largest"')
    made = Study(
        Path(scene),
        points(
            {name: _values(name, given) for name, given in _leaves(parameters)}, samples=samples, sampling=sampling,
            seed=seed, paired=points_are == "list",
        ),
        tuple(measured(name, text) for name, text in outputs.items()),
        dict(bodies),
        Path(folder),
        histories,
    )  # fmt: skip
    _check(made)
    return made


def _hint(where: str) -> str:
    table, _, name = where.rpartition(".")
    return nearest(name, dict.fromkeys(BodyRecipe.model_fields if table else StudyFile.model_fields))


def _leaves(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Parameters by dotted name: a table is one of values where its keys say so."""
    for key, value in table.items():
        if isinstance(value, Mapping) and not _says_values(value):
            yield from _leaves(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def _says_values(table: Mapping[str, Any]) -> bool:
    """Whether a table is a range or a distribution, and no table of parameters."""
    if "from" in table or (len(table) == 1 and table.keys() <= USUAL.keys()):
        return True
    return len(table) == 1 and all(isinstance(given, list) and _are_numbers(given) for given in table.values())


def _are_numbers(given: Sequence[Any]) -> bool:
    return all(isinstance(one, (int, float)) and not isinstance(one, bool) and abs(one) < math.inf for one in given)


def _values(name: str, given: Any) -> Axis | Spread:
    """The values of a parameter. Raises InputError for an entry without any."""
    if isinstance(given, (Axis, Spread)):
        return given
    if isinstance(given, str) or _are_numbers([given]):
        return Axis((given,))
    if isinstance(given, (list, tuple)) and given and all(isinstance(one, str) or _are_numbers([one]) for one in given):
        return Axis(tuple(given))
    if isinstance(given, Mapping) and {"from", "to", "count"} <= given.keys() <= {"from", "to", "count", "spacing"}:
        return _range(name, given)
    if isinstance(given, Mapping) and len(given) == 1 and "from" not in given:
        ((kind, numbers),) = given.items()
        if isinstance(numbers, list) and _are_numbers(numbers):
            return Spread(kind, tuple(map(float, numbers)))
    raise InputError(
        f"parameters.{name} = {given!r}: give [1, 2, 3], {{from = 1, to = 3, count = 5}}, or a distribution such as "
        "{normal = [mean, deviation]}"
    )


def _range(name: str, given: Mapping[str, Any]) -> Axis:
    spacing = given.get("spacing", "linear")
    if spacing not in ("linear", "log"):
        raise InputError(f"parameters.{name}: spacing is {spacing!r}; give linear or log")
    start, end, count = given["from"], given["to"], given["count"]
    if not (_are_numbers((start, end)) and type(count) is int):
        raise InputError(
            f"parameters.{name}: from and to are numbers in SI units, count a whole one, not {dict(given)}"
        )
    try:
        return spaced(float(start), float(end), count, logarithmic=spacing == "log")
    except (InputError, OverflowError) as error:
        raise InputError(f"parameters.{name}: {error}") from None


# ---- what fits the scene --------------------------------------------------------------------------------------------


def _check(made: Study) -> None:
    tree = read_source(made.scene).tree
    own, places, texts = flattened(tree.get("parameters", {})), places_of(tree), list(_texts(tree))
    for name in made.parameters:
        if re.fullmatch(r"[A-Za-z_]\w*(\.\w+)*", name) is None:
            raise InputError(f"parameters.{name}: use letters, digits, '_' and dots in its name")
        in_bodies = any(_mentions(line, name) for line in made.recipes.values())
        if not in_bodies and name not in own and name not in places:
            raise InputError(f"in {made.scene} and in lines that make bodies {unknown(name, own, places)}")
        if not in_bodies and name in own and not any(_mentions(text, name) for text in texts):
            raise InputError(f"the parameter {name!r} changes nothing: nothing in {made.scene} uses it; leave it out")
    _check_overlap(made.parameters)
    _check_names(made)
    _check_bodies(made)


def _check_names(made: Study) -> None:
    """InputError for names of columns that are there twice, or that every table has."""
    names = [*made.parameters, *(one.name for one in made.outputs)]
    for name in names:
        if name in TAKEN or "/" in name or names.count(name) > 1:
            raise InputError(
                f"{name!r} cannot be a column of the table: a parameter or an output has that name already, or it has '/' or "
                f"is one of {', '.join(TAKEN)}; give it another"
            )


def _check_overlap(names: Sequence[str]) -> None:
    """InputError where one parameter is a part of another, as gravity and gravity.2."""
    for name in names:
        if part := next((other for other in names if other.startswith(f"{name}.")), None):
            raise InputError(f"parameters: {part!r} is a part of {name!r}: give values to one of them")


def _check_bodies(made: Study) -> None:
    if made.recipes:
        known = body_files(made.scene, of_scene(made, made.points[0]))
        for name in made.recipes:
            if name not in known:
                raise InputError(f"bodies.{name}: the scene has no body {name!r} from a file; {nearest(name, known)}")
    for name, line in made.recipes.items():
        try:
            words = shlex.split(line)
        except ValueError as error:
            raise InputError(f"bodies.{name}: {line!r}: {error}") from None
        if not words or words[0] not in MAKING:
            raise InputError(
                f"bodies.{name}: {line!r}: begin with a command of ffr-prep that makes a body: {', '.join(MAKING)}"
            )
        substituted(line, made.points[0], f"bodies.{name}.make")


def _mentions(text: str, name: str) -> bool:
    return re.search(rf"(?<![\w.]){re.escape(name)}(?![\w.])", text) is not None


def _texts(tree: Any, where: tuple[str, ...] = ()) -> Iterator[str]:
    """All texts of a scene; names of entries are none."""
    if isinstance(tree, str):
        yield tree
    elif isinstance(tree, dict):
        for key, item in tree.items():
            yield from _texts(item, (*where, key))
    elif isinstance(tree, list):
        for item in tree:
            yield from _texts(item, where)


def of_scene(made: Study, point: Mapping[str, Value]) -> dict[str, str]:
    """The parameters of a point that are the scene's, as text."""
    own = names_of_scene(made)
    return {
        name: repr(value) if isinstance(value, float) else str(value) for name, value in point.items() if name in own
    }


def names_of_scene(made: Study) -> frozenset[str]:
    """The parameters that are the scene's, or entries of it."""
    tree = read_source(made.scene).tree
    return frozenset(made.parameters) & {*flattened(tree.get("parameters", {})), *places_of(tree)}


def recipe(made: Study, body: str, point: Mapping[str, Value]) -> str:
    """The line that makes a body of a point."""
    found = substituted(made.recipes[body], point, f"bodies.{body}.make")
    return str(found)


def mark(made: Study) -> str:
    """The mark that tells a study from another: its points, outputs and recipes, and the text of its scene."""
    whole = [
        [sorted(point.items()) for point in made.points],
        [[one.name, one.quantity, one.how] for one in made.outputs],
        sorted(made.recipes.items()),
        read_source(made.scene).tree,
    ]
    return hashlib.sha256(json.dumps(whole, sort_keys=True, default=str).encode()).hexdigest()
