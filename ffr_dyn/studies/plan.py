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

import math
import re
import shlex
from collections.abc import Iterable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ffr_dyn.functions.formula import TIME, names_in, parse
from ffr_dyn.scene_file.assignments import unknown
from ffr_dyn.scene_file.parameters import PLACEHOLDER, flattened, nearest, substituted
from ffr_dyn.scene_file.read import body_files
from ffr_dyn.scene_file.source import read_source
from ffr_dyn.studies.measures import HISTORY, Measured, measured, mentions
from ffr_dyn.studies.sampling import (
    SHAPING,
    USUAL,
    Axis,
    Sampling,
    Spread,
    Value,
    points,
    pure_numbers,
    spaced,
    with_unit,
)
from ffr_prep.common.brief import Brief, cut
from ffr_prep.common.entries import places_of
from ffr_prep.common.errors import InputError
from ffr_prep.common.reading import read_toml
from ffr_prep.common.strict import complaint, entry_keys
from ffr_prep.common.units import dimension_of, in_words, split_quantity, to_si

MAKING = ("reduce", "reduce-structure", "reduce-matrices")
TAKEN = ("run", "row", "time", "message", "notes")  # columns that every table may have


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
    if "scene" not in tree and {"bodies", "ground"} <= tree.keys():
        raise InputError(
            f"{path} is no study but a scene, which `ffr-dyn run` analyses; a study names it: scene = {path.name!r}"
        )
    try:
        entry = StudyFile.model_validate(tree)
    except ValidationError as error:
        first = min(error.errors(), key=lambda one: one["type"] != "extra_forbidden")
        where = ".".join(entry_keys(first, tree))
        hint = f"; {_hint(where)}" if first["type"] == "extra_forbidden" else f" (it is {first['input']!r})"
        raise InputError(f"{path}: {where}: {complaint(first)}{hint if first['type'] != 'missing' else ''}") from None
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
    leaves = list(_leaves(parameters, _known(Path(scene), bodies.values())))
    found = {name: _values(name, given) for name, given in leaves}
    if len(found) < len(leaves):
        twice = next(name for k, (name, _) in enumerate(leaves) if name in dict(leaves[:k]))
        raise InputError(f"parameters.{twice}: it is given twice, with quotes and without; give its values once")
    _check_settings(found, points_are, samples, sampling, seed)
    made = Study(
        Path(scene),
        points(found, samples=samples, sampling=sampling, seed=seed, paired=points_are == "list"),
        tuple(measured(name, text) for name, text in outputs.items()),
        dict(bodies),
        Path(folder),
        histories,
    )
    _check(made)
    return made


def _check_settings(
    found: Mapping[str, Axis | Spread], points_are: str, samples: int, sampling: str, seed: int
) -> None:
    """InputError for settings that no study can have, or that change nothing."""
    for name, given, known in (("points", points_are, ("grid", "list")), ("sampling", sampling, get_args(Sampling))):
        if given not in known:
            raise InputError(f"{name} is {given!r}; {nearest(str(given), dict.fromkeys(known))}")
    for name, number in (("samples", samples), ("seed", seed)):
        if type(number) is not int or number < 0:
            raise InputError(f"{name} is {number!r}; give a whole number, 0 or more")
    if any(isinstance(values, Spread) for values in found.values()):
        return
    for name, value, default in (("samples", samples, 0), ("sampling", sampling, "monte-carlo"), ("seed", seed, 0)):
        if value != default:
            raise InputError(
                f"{name} = {value} changes nothing: no parameter has a distribution such as {{uniform = [1, 3]}}; leave it "
                "out"
            )


def _hint(where: str) -> str:
    table, _, name = where.rpartition(".")
    return nearest(name, dict.fromkeys(BodyRecipe.model_fields if table else StudyFile.model_fields))


def _known(scene: Path, lines: Iterable[str]) -> frozenset[str]:
    """The names that a study may give values to: of the scene, and those that stand in lines that make bodies."""
    tree = read_source(scene).tree
    named = (name for line in lines for name in PLACEHOLDER.findall(line))
    return frozenset([*flattened(tree.get("parameters", {})), *places_of(tree), *named])


def _leaves(table: Mapping[str, Any], known: Set[str], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Parameters by dotted name: `crank.length = [1, 2]` is a table of them, {normal = [1, 2]} is a value."""
    for key, value in table.items():
        name = f"{prefix}{key}"
        if isinstance(value, Mapping) and (_holds(value, f"{name}.", known) or not (name in known or _says(value))):
            yield from _leaves(value, known, f"{name}.")
        else:
            yield name, value


def _holds(table: Mapping[str, Any], prefix: str, known: Set[str]) -> bool:
    """Whether one of its keys begins or is the name of a parameter."""
    names = tuple(f"{prefix}{key}" for key in table)
    return any(one in names or one.startswith(tuple(f"{name}." for name in names)) for one in known)


def _says(table: Mapping[str, Any]) -> bool:
    """Whether a table at an unknown name was meant for values, and is no table of parameters."""
    return "from" in table or (len(table) == 1 and (next(iter(table)) in USUAL or _are_lists(table.values())))


def _are_lists(given: Iterable[Any]) -> bool:
    return all(isinstance(one, list) and _are_numbers(one) for one in given)


def _are_numbers(given: Sequence[Any]) -> bool:
    return all(isinstance(one, (int, float)) and not isinstance(one, bool) and abs(one) < math.inf for one in given)


def _is_value(one: Any) -> bool:
    """A text, or a number that is finite."""
    return isinstance(one, str) or (_are_numbers((one,)) and math.isfinite(one))


def _values(name: str, given: Any) -> Axis | Spread:
    """The values of a parameter. Raises InputError for an entry without any."""
    if isinstance(given, (Axis, Spread)):
        return given
    if isinstance(given, (np.ndarray, np.generic)):
        given = given.tolist()
    listed = given if isinstance(given, (list, tuple)) else [given]
    listed = [one.item() if isinstance(one, np.generic) else one for one in listed]
    if listed and all(map(_is_value, listed)):
        return Axis(tuple(listed))
    if isinstance(given, Mapping) and {"from", "to", "count"} <= given.keys() <= {"from", "to", "count", "spacing"}:
        return _range(name, given)
    if isinstance(given, Mapping) and len(given) == 1 and "from" not in given:
        ((kind, numbers),) = given.items()
        if isinstance(numbers, list) and all(map(_is_value, numbers)):
            return _spread(name, kind, numbers)
    raise InputError(
        f"parameters.{name} = {cut(repr(given))}: give finite numbers or texts such as [1, 2, 3], {{from = 1, to = 3, "
        "count = 5}, or a distribution such as {normal = [mean, deviation]}"
    )


def _range(name: str, given: Mapping[str, Any]) -> Axis:
    spacing = given.get("spacing", "linear")
    if spacing not in ("linear", "log"):
        raise InputError(f"parameters.{name}: spacing is {spacing!r}; give linear or log")
    count, ends = given["count"], [given["from"], given["to"]]
    if not (all(map(_is_value, ends)) and type(count) is int):
        raise InputError(
            f"parameters.{name}: from and to are numbers, both with a unit or both in SI units, count a whole one, not "
            f"{dict(given)}"
        )
    (start, end), unit = _in_si(name, ends)
    try:
        axis = spaced(start, end, count, logarithmic=spacing == "log")
    except (InputError, OverflowError) as error:
        raise InputError(f"parameters.{name}: {error}") from None
    return Axis(tuple(with_unit(axis.values, unit)))


def _spread(name: str, kind: str, numbers: Sequence[Any]) -> Spread:
    """A distribution; with units where all its numbers have one, but those that give its shape."""
    pure = range(len(numbers))[pure_numbers(kind)]
    if not _are_numbers([numbers[k] for k in pure]):
        raise InputError(
            f"parameters.{name}: {kind} {numbers}: {SHAPING.get(kind, 'what gives its shape')} is a number without a unit"
        )
    found, unit = _in_si(name, [number for k, number in enumerate(numbers) if k not in pure])
    left = iter(found)
    return Spread(kind, tuple(float(number) if k in pure else next(left) for k, number in enumerate(numbers)), unit)


def _in_si(name: str, given: Sequence[Any]) -> tuple[list[float], str]:
    """Numbers in SI units, and their unit if they have one. Raises InputError where only some have, or one of another
    dimension."""
    quantities = [split_quantity(one) if isinstance(one, str) else (float(one), "") for one in given]
    try:
        known = [(value, unit, dimension_of(unit)) for value, unit in filter(None, quantities)]
        if len(known) < len(quantities) or len({(dimension, not unit) for _, unit, dimension in known}) > 1:
            raise InputError("give numbers, all with units of one dimension or all in SI units")
        unit = in_words(known[0][2]) if known and known[0][1] else ""
        return [to_si(value, own) for value, own, _ in known], unit
    except InputError as error:
        raise InputError(f"parameters.{name}: {cut(repr(list(given)))}: {error}") from None


def units_of(made: Study) -> dict[str, str]:
    """The SI unit of those parameters whose value the scene writes with a unit."""
    own = flattened(read_source(made.scene).tree.get("parameters", {}))
    found = {name: split_quantity(str(own[name])) for name in made.parameters if name in own}
    return {name: in_words(dimension_of(given[1])) for name, given in found.items() if given}


# ---- what fits the scene --------------------------------------------------------------------------------------------


def _check(made: Study) -> None:
    tree = read_source(made.scene).tree
    own, places = flattened(tree.get("parameters", {})), places_of(tree)
    used = reached(_texts({key: item for key, item in tree.items() if key != "parameters"}), own)
    for name in made.parameters:
        if re.fullmatch(r"[A-Za-z_]\w*(\.\w+)*", name) is None:
            raise InputError(f"parameters.{name}: use letters, digits, '_' and dots in its name")
        in_bodies = any(mentions(line, name) for line in made.recipes.values())
        if not in_bodies and name not in own and name not in places:
            raise InputError(f"in {made.scene} and in lines that make bodies {unknown(name, own, places)}")
        if not in_bodies and name in own and name not in used:
            raise InputError(f"the parameter {name!r} changes nothing: nothing in {made.scene} uses it; leave it out")
    _check_overlap(made.parameters)
    _check_names(made)
    _check_formulas(made)
    _check_bodies(made)


def _check_names(made: Study) -> None:
    """InputError for names of columns that are there twice, or that every table has."""
    names = [*made.parameters, *(one.name for one in made.outputs)]
    for name in names:
        if name in TAKEN or not name.strip(" .") or {"/", "\0"} & set(name) or names.count(name) > 1:
            raise InputError(
                f"{name!r} cannot be a column of the table: a parameter or an output has that name already, or it is empty, "
                f"has '/', or is one of {', '.join(TAKEN)}; give it another"
            )


def _check_formulas(made: Study) -> None:
    """InputError for a formula that no run can work out: of names that there are not, of time, of itself."""
    formulas = {one.name: one.quantity for one in made.outputs if one.how == "="}
    numbers = [one.name for one in made.outputs if one.how != HISTORY]
    known = dict.fromkeys([*made.parameters, *numbers], TIME)  # a function that is no constant: nothing is worked out
    for name, text in formulas.items():
        found = parse(text, known, f"outputs.{name}") if split_quantity(text) is None else TIME
        if strange := next(names_in(found), "t" if "t" not in known and mentions(text, "t") else None):
            raise InputError(
                f"outputs.{name} = '= {text}': {strange!r} is no output and no parameter; {nearest(strange, known)}"
            )
    while formulas:
        ready = [name for name, text in formulas.items() if not any(mentions(text, other) for other in formulas)]
        if not ready:
            raise InputError(f"outputs: the formulas of {', '.join(formulas)} depend on themselves")
        formulas = {name: text for name, text in formulas.items() if name not in ready}


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
        _check_lengths(name, shlex.split(recipe(made, name, made.points[0])))


def _check_lengths(body: str, words: Sequence[str]) -> None:
    """InputError where a parameter of a geometry script has a unit that is none of a length."""
    for text in (text for option, text in pairwise(words) if option == "--set"):
        quantity = split_quantity(text.partition("=")[2])
        if quantity is not None and dimension_of(quantity[1]) != dimension_of("m"):
            raise InputError(
                f"bodies.{body}: --set {text}: only lengths may have a unit there, which the script has in its own; give "
                "other numbers as the script takes them"
            )


def reached(texts: Iterable[str], own: Mapping[str, Any]) -> frozenset[str]:
    """The parameters of a scene that texts depend on, be it by way of others."""
    texts, found = list(texts), frozenset[str]()
    while more := {name for name in own if name not in found and any(mentions(text, name) for text in texts)}:
        found |= more
        texts = [str(own[name]) for name in more]
    return found


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
    return as_texts({name: value for name, value in point.items() if name in own})


def as_texts(values: Mapping[str, Value]) -> dict[str, str]:
    """Values as a command line gives them."""
    return {name: repr(value) if isinstance(value, float) else str(value) for name, value in values.items()}


def names_of_scene(made: Study) -> frozenset[str]:
    """The parameters that are the scene's, or entries of it."""
    tree = read_source(made.scene).tree
    return frozenset(made.parameters) & {*flattened(tree.get("parameters", {})), *places_of(tree)}


def recipe(made: Study, body: str, point: Mapping[str, Value]) -> str:
    """The line that makes a body of a point; a value of several words, such as 10 mm, stays in the word that it is put in."""
    words = substituted(shlex.split(made.recipes[body]), point, f"bodies.{body}.make")
    return shlex.join(str(word) for word in words)
