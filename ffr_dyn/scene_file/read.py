"""Scenes as text: a TOML file, checked against a schema, becomes a `Scene` and the settings of a run.

    name = "pendulum"
    gravity = [0, -9.81, 0]
    [analysis]
    end = 2.0
    output_step = 0.01
    [ground]
    hinge = [0, 0, 0]
    [bodies.rod]
    file = "pendulum.ffr"            # or mass, inertia, points of a rigid body
    [joints.hinge]
    kind = "revolute"
    i = "ground.hinge"
    j = "rod.hinge"
    axis = [0, 0, 1]

Paths are relative to the file. Angles in rad, everything in SI units unless a unit is written. The whole schema is in
`ffr_dyn.scene_file.schema`; `ffr_dyn.scene_file.write` writes a scene as such a file. A scene file is data: nothing in it
is run.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import fields, replace
from difflib import get_close_matches
from functools import cache
from pathlib import Path
from typing import Any, get_type_hints

import numpy as np
from pydantic import BaseModel, ValidationError

from ffr_dyn.analyses.forward import Forward
from ffr_dyn.analyses.registry import OfMoment, analysis
from ffr_dyn.analyses.settings import Charted, MomentSettings, Settings
from ffr_dyn.functions.formula import CONSTANTS, Expression, Operation, is_constant
from ffr_dyn.functions.operations import FUNCTIONS
from ffr_dyn.functions.time_functions import TimeFunction, constant, signal, signals_in
from ffr_dyn.integrators import Integrator, Tolerances, Within, method_named, stepped
from ffr_dyn.integrators.stabilisation import Baumgarte, Drifting, Projection, Stabilisation
from ffr_dyn.scene.force_kinds import forces_of
from ffr_dyn.scene.scene import GROUND, Body, Scene
from ffr_dyn.scene_file.ambiguous import check_ambiguous, unreadable
from ffr_dyn.scene_file.assignments import assigned
from ffr_dyn.scene_file.parameters import Parameters, as_number, nearest, substituted
from ffr_dyn.scene_file.schema import (
    BodyEntry,
    Kind,
    StabilisationEntry,
    fields_of_motion,
    formula_of,
    home,
    keys_of,
    nested_kinds,
    scene_entry,
    tables,
)
from ffr_dyn.scene_file.source import Source, origin, origin_of_name, read_source
from ffr_dyn.scene_file.state_formula import StateFormula, check_names, quantities_of
from ffr_prep.body import BodyError, FlexibleBody, damped, load_body, rigid_body, truncated, with_point
from ffr_prep.common.errors import InputError
from ffr_prep.common.reading import reading
from ffr_prep.common.strict import complaint, entry_keys

# Files of other kinds, by an entry that a scene never has.
_ANALYSIS = (
    'write a table [analysis] with kind = "steady", "linearise" or another, or with end and output_step of a run'
)
_OTHERS = {
    "members": "a structure, of which `ffr-prep reduce-structure` makes a body",
    "shells": "a structure, of which `ffr-prep reduce-structure` makes a body",
    "scene": "a study of a scene, which `ffr-dyn sweep` runs",
    "rho": "a material, which `ffr-prep reduce --material` takes",
}
WHOLE = ("name", "gravity", "ground", "base_acceleration", "plane")  # fields of a scene that are no tables of entries


def load_scene(
    path: str | Path, parameters: Mapping[str, str] = {}, bodies: Mapping[str, str | Path | FlexibleBody] = {}
) -> tuple[Scene, Settings | MomentSettings]:
    """Read a scene file.

    parameters : values, as text, in place of those in the file, such as {"crank.length": "0.15"}; of other entries by the
                 path of their keys, such as {"bodies.rod.damping": "0.02", "gravity.2": "-1.62"}
    bodies     : body files, or bodies, in place of the files that it names, by the names of the bodies there

    Raises InputError that names the file, the entry, its value and what is expected, with the nearest known name.

    >>> scene, settings = fd.load_scene("scene.toml", {"crank.length": "60 mm"})
    """
    with reading(path, "a scene file"):
        entry, source = _read(Path(path), parameters)
        for name in bodies:
            if name not in entry.bodies:
                raise InputError(f"{path}: bodies: there is no body {name!r}; {nearest(name, entry.bodies)}")
        settings = _settings(entry.analysis, entry.outputs, source)
        return _scene(entry, source, bodies), _with_chart(settings, entry.chart, source)


def body_files(path: str | Path, parameters: Mapping[str, str] = {}) -> dict[str, Path]:
    """The files from ffr-prep of the bodies of a scene file, by the names of the bodies; parameters and errors as of
    `load_scene`."""
    with reading(path, "a scene file"):
        bodies = _read(Path(path), parameters)[0].bodies.items()
    return {name: entry.file for name, entry in bodies if entry.file is not None}


def _read(path: Path, parameters: Mapping[str, str]) -> tuple[Any, Source]:
    """The entries of a scene file, checked."""
    source = read_source(path)
    if other := next((of for key, of in _OTHERS.items() if key in source.tree), None):
        raise InputError(f"{path} is not a scene but {other}")
    try:
        tree, own = assigned(source, parameters)
        values = Parameters(own)
        tree = substituted(tree, values, "")
        known = {name: values[name] for name in values} | _signals(tree.get("inputs", {}), values)
    except InputError as error:
        keys = tuple(str(error).partition(":")[0].split("."))
        raise InputError(f"{origin(source, keys)}: {error}") from None
    try:
        return scene_entry().model_validate(tree, context={"parameters": known}), source
    except ValidationError as error:
        raise InputError(_explained(error, source, tree)) from None


def _signals(table: Mapping[str, Any], parameters: Parameters) -> dict[str, TimeFunction]:
    """The inputs of a file by name, with their initial values."""
    for name in table:
        if name in (*parameters, "t", *CONSTANTS, *FUNCTIONS):
            raise InputError(f"inputs.{name}: formulas know that name already; give the input another")
    start = {name: as_number(v, parameters, f"inputs.{name}") if isinstance(v, str) else v for name, v in table.items()}
    return {
        name: signal(name, value)
        for name, value in start.items()
        if isinstance(value, (int, float)) and not isinstance(value, bool)
    }


def _explained(error: ValidationError, source: Source, tree: Mapping[str, Any]) -> str:
    """All complaints: where, what, and the value. What may be a list or a number is blamed for one."""
    lines: dict[str, None] = {}
    items = [(entry_keys(item, tree), item) for item in _likeliest(error.errors())]
    better = [where for where, item in items if item["type"] not in ("list_type", "float_type")]
    for where, item in items:
        if any(where == of[: len(where)] and item["type"] in ("list_type", "float_type") for of in better):
            continue
        plain = isinstance(item["input"], (str, int, float, bool, list))
        value = f" (it is {item['input']!r})" if plain and item["type"] != "missing" else ""
        text = _with_nearest(item, where, complaint(item).removeprefix("it: "))
        text = unreadable(item["input"], tree) or text if isinstance(item["input"], str) else text
        text += _of_the_angle(where, text, tree)
        at = where
        if misspelt := re.match(r"'(.+?)' is not a known entry here; ", text):
            at = (*where, misspelt[1])
            text = f"{misspelt[0]}{elsewhere}" if (elsewhere := home(misspelt[1], where)) else text
        lines[f"{origin(source, at)}: {'.'.join(where) or 'file'}: {text}{value}"] = None
    return "; ".join(lines)


def _of_the_angle(where: tuple[str, ...], text: str, tree: Mapping[str, Any]) -> str:
    """That a unit does not fit as the coordinate of a joint is not given, which is its angle then; empty where it is."""
    table, name, *_ = *where, "", ""
    entry = tree.get(table, {}).get(name) if table in ("forces", "drivers") else None
    if not isinstance(entry, dict) or "joint" not in entry or "coordinate" in entry or "does not fit" not in text:
        return ""
    return '; without a coordinate it is about the angle: write coordinate = "stroke" for one along the joint'


def _likeliest(items: Sequence[Any]) -> list[Any]:
    """Of the complaints about an entry that may be one list or another, those about the list with the fewest."""
    counts: dict[tuple[Any, ...], dict[str, int]] = {}
    for entry, form in filter(None, map(_form, items)):
        forms = counts.setdefault(entry, {})
        forms[form] = forms.get(form, 0) + 1
    best = {entry: min(forms, key=lambda form: forms[form]) for entry, forms in counts.items()}
    return [item for item in items if (found := _form(item)) is None or found[1] == best[found[0]]]


def _form(item: Any) -> tuple[tuple[Any, ...], str] | None:
    """The entry that a complaint is about and the form of a list that it was read as; None where there is one form."""
    keys = item["loc"]
    at = next((k for k, key in enumerate(keys) if str(key).startswith("list[")), None)
    return None if at is None else (keys[:at], keys[at])


def _with_nearest(item: Any, where: tuple[str, ...], text: str) -> str:
    """A complaint about a word that is not one of those that are known, with the nearest of them."""
    if item["type"] == "kind" and isinstance(item["input"], dict):
        given, known = item["input"].get("kind"), text.partition("there are ")[2].split(", ")
        text = text.replace("no such kind", f"no kind {given!r}")
    elif item["type"] == "missing" and item["loc"] == ("analysis",):
        return f"{text}; {_ANALYSIS}"
    elif item["type"] == "dict_type" and isinstance(item["input"], list):
        return f"must be tables with names; write [{'.'.join(where)}.NAME] for each"
    elif item["type"] == "literal_error":
        given, known = item["input"], re.findall(r"'([^']*)'", text)
    else:
        return text
    close = get_close_matches(str(given), known, 1)
    return f"{text}; did you mean {close[0]!r}?" if close else text


# ---- from entries to a scene --------------------------------------------------------------------------------------


def _scene(entry: Any, source: Source, given: Mapping[str, str | Path | FlexibleBody]) -> Scene:
    declared: dict[str, Any] = {
        table: tuple(_declared(kinds, (table, name), item, source) for name, item in getattr(entry, table).items())
        for table, kinds in tables().items()
    }
    _put_markers(entry, source)
    read = cache(load_body)  # bodies of one file are one, and are prepared once
    bodies = tuple(_body(name, body, given.get(name, body.file), source, read) for name, body in entry.bodies.items())
    try:
        scene = Scene(bodies=bodies, **{key: getattr(entry, key) for key in WHOLE}, **declared)
        for force in forces_of(scene):
            if isinstance(formula := formula_of(force), StateFormula):
                check_names(scene, formula, f"force {force.name!r}")
    except InputError as error:
        raise InputError(f"{origin_of_name(source, str(error))}: {error}") from None
    check_ambiguous(source, set(quantities_of(scene)))
    return scene


def _put_markers(entry: Any, source: Source) -> None:
    """Add the markers to the points of their bodies and of the ground."""
    points = {GROUND: entry.ground, **{name: body.points for name, body in entry.bodies.items()}}
    for name, marker in entry.markers.items():
        where = f"{origin(source, ('markers', name))}: markers.{name}"
        if marker.body not in points:
            close = get_close_matches(marker.body, points, 1)
            hint = f"did you mean {close[0]!r}?" if close else f"there are {', '.join(points)}"
            raise InputError(f"{where}: there is no body {marker.body!r}; {hint}")
        if name in points[marker.body]:
            raise InputError(f"{where}: {marker.body!r} has a point {name!r} already; give the marker another name")
        points[marker.body][name] = marker.point


def _declared(kinds: tuple[Kind, ...], keys: tuple[str, ...], entry: BaseModel, source: Source) -> Any:
    try:
        return _made(_kind(kinds, entry), keys[-1], entry)
    except InputError as error:
        raise InputError(f"{origin(source, keys)}: {error}") from None


def _kind(kinds: tuple[Kind, ...], entry: BaseModel) -> Kind:
    word = getattr(entry, "kind", "") if len(kinds) > 1 else kinds[0].word
    return next(kind for kind in kinds if kind.word == word)


def _made(kind: Kind, name: str, entry: BaseModel) -> Any:
    """The declaration that an entry of the file means."""
    given = {f.name: getattr(entry, f.name) for f in keys_of(kind)}
    for f in keys_of(kind):
        if given[f.name] is None and f.default is not None:
            del given[f.name]
    if moving := fields_of_motion(kind.made):
        given |= _with_function({key: given[key] for key in moving})
    return kind.made(name=name, **given)


def _with_function(given: Mapping[str, Any]) -> dict[str, Any]:
    """Components that depend on the motion go to the force's function, the others stay functions of time."""
    components = [c for value in given.values() for c in (value if isinstance(value, list) else [value])]
    timed, moving = _separated(tuple(components))
    rest = iter(timed)
    timed_fields = {k: [next(rest) for _ in v] if isinstance(v, list) else next(rest) for k, v in given.items()}
    return {**timed_fields, "function": moving}


def _separated(given: tuple[Any, ...]) -> tuple[list[float | TimeFunction], StateFormula | None]:
    """Functions of time (zero where a component is none), and those that depend on the motion (zero likewise) if any does."""
    components = [constant(c) if isinstance(c, float) else c for c in given]  # a default is a number
    if any(not isinstance(c, TimeFunction) and any(_inputs_of(c)) for c in components):
        raise InputError("a formula of the motion cannot use an input; add them as two forces")
    timed = [_plain(c) if isinstance(c, TimeFunction) else 0.0 for c in components]
    moving = tuple(constant(0.0) if isinstance(c, TimeFunction) else c for c in components)
    follows = any(not isinstance(c, TimeFunction) for c in components)
    return timed, StateFormula(moving) if follows else None


def _inputs_of(expression: Expression) -> Iterator[TimeFunction]:
    if isinstance(expression, TimeFunction):
        yield from signals_in(expression)
    elif isinstance(expression, Operation):
        for operand in expression.operands:
            yield from _inputs_of(operand)


def _plain(function: TimeFunction) -> float | TimeFunction:
    return function.data[0] if is_constant(function) else function


def _body(
    name: str,
    entry: BodyEntry,
    file: str | Path | FlexibleBody | None,
    source: Source,
    read: Callable[[str | Path], FlexibleBody],
) -> Body:
    try:
        return Body(
            name,
            _model(name, entry, file, read),
            position=entry.position,
            rotation=entry.rotation,
            velocity=entry.velocity,
            omega_bar=entry.omega_bar,
            q=entry.q,
            q_dot=entry.q_dot,
            damping=entry.damping,
            stiffening=entry.stiffening,
            dropped=tuple(entry.drop),
        )
    except (InputError, BodyError) as error:
        raise InputError(f"{origin(source, ('bodies', name))}: bodies.{name}: {error}") from None


def _model(
    name: str,
    entry: BodyEntry,
    file: str | Path | FlexibleBody | None,
    read: Callable[[str | Path], FlexibleBody],
) -> FlexibleBody:
    points = {key: np.array(at) for key, at in entry.points.items()}
    if file is not None:
        model = file if isinstance(file, FlexibleBody) else read(file)
        model = model if entry.modes is None else truncated(model, entry.modes)
        alpha, beta = entry.rayleigh or (0.0, 0.0)
        bands = [(frequency, ratio) for frequency, ratio in entry.damping_bands]
        model = damped(model, alpha=alpha, beta=beta, loss_factor=entry.loss_factor, bands=bands)
        model = model if entry.stiffening or model.stiffening is None else replace(model, stiffening=None)
        for point, at in points.items():
            model = with_point(model, point, at)
        return model
    rigid: dict[str, Any] = {"mass": entry.mass, "points": points}
    if entry.inertia is not None:
        return rigid_body(name, inertia=np.array(entry.inertia), centre_of_mass=np.array(entry.centre_of_mass), **rigid)
    model = rigid_body(name, inertia=np.eye(3), **rigid)
    return replace(model, r_dm=np.array(entry.r_dm), rr_dm=np.array(entry.rr_dm))


# ---- the analysis -------------------------------------------------------------------------------------------------


@cache
def _hints(made: Any) -> dict[str, Any]:
    return get_type_hints(made)


def _settings(entry: Any, outputs: list[str], source: Source) -> Settings | MomentSettings:
    made: Any = analysis(entry.kind)
    hints, given = _hints(made), {}
    for f in fields(made):
        value = getattr(entry, f.name)
        if kinds := nested_kinds(hints[f.name]):
            value = _nested(kinds, f.name, value, source)
        names = getattr(entry, f.metadata["names"]) if f.metadata.get("names") else ()
        given[f.name] = (*value, *names) if isinstance(value, (list, tuple)) else value
    try:
        found = made(**given)
    except InputError as error:
        raise InputError(f"{origin(source, ('analysis',))}: analysis: {error}") from None
    if issubclass(made, OfMoment):
        return MomentSettings(time=entry.time, outputs=tuple(outputs), analysis=found)
    stabilisation = _stabilisation(getattr(entry, "stabilisation", StabilisationEntry()))
    return Settings(
        start=entry.start, end=entry.end, output_step=entry.output_step, method=_method(entry, source),
        stabilisation=stabilisation, outputs=tuple(outputs), analysis=found,
    )  # fmt: skip


def _nested(kinds: tuple[Kind, ...], key: str, given: Any, source: Source) -> Any:
    """The declarations that a field of the analysis holds: several from a table, or one that has no name, or None."""
    if isinstance(given, Mapping):
        return tuple(_declared(kinds, ("analysis", key, name), entry, source) for name, entry in given.items())
    return given and _kind(kinds, given).made(**given.model_dump(exclude={"kind"}))


def _with_chart(settings: Settings | MomentSettings, entry: Any, source: Source) -> Settings | MomentSettings:
    """The settings with what a chart compares. InputError for a chart of another analysis than forward dynamics."""
    if not entry.model_fields_set:
        return settings
    if isinstance(settings, MomentSettings) or not isinstance(settings.analysis, Forward):
        where = origin(source, ("chart",))
        raise InputError(f"{where}: chart: it compares runs of forward dynamics; the file asks for another analysis")
    methods = tuple((name, tuple(numbers)) for name, numbers in entry.methods.items())
    modes = tuple(None if number == "all" else number for number in entry.modes)
    drops = tuple(tuple(terms) for terms in entry.drop)
    return replace(settings, chart=Charted(measures=tuple(entry.measures), methods=methods, modes=modes, drops=drops))


def _method(entry: Any, source: Source) -> Integrator | Within:
    name, step = getattr(entry, "method", "ros2"), getattr(entry, "step", None)
    kind, own = method_named(name), getattr(entry, "settings", {})
    try:
        if kind.controlled:
            found: Integrator | Within = kind(Tolerances(**(entry.tolerances.model_dump() if entry.tolerances else {})))
        elif step is not None:
            found = kind(step, **own)
        else:
            given = {} if getattr(entry, "accuracy", None) is None else {"accuracy": entry.accuracy}
            found = Within(method=name, settings=tuple(own.items()), **given)
            stepped(found, entry.output_step)
    except InputError as error:
        raise InputError(f"{origin(source, ('analysis', 'settings'))}: analysis.settings: {error}") from None
    return found


def _stabilisation(entry: StabilisationEntry) -> Stabilisation:
    if entry.alpha is not None and entry.beta is not None:
        return Baumgarte(entry.alpha, entry.beta)
    return Projection(entry.tolerance) if entry.kind == "projection" else Drifting()
