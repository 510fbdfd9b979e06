"""A scene as the text of a scene file, which reads back as the same scene to the bit (a constant function as its number)."""

from __future__ import annotations

import json
import os
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, asdict, fields
from pathlib import Path
from typing import Any, cast, get_type_hints

import numpy as np

from ffr_dyn.analyses.registry import OfMoment, OverTime, word_of
from ffr_dyn.analyses.settings import Charted, MomentSettings, Settings, settings_of
from ffr_dyn.functions.curves import Curve
from ffr_dyn.functions.formula import Measured, Operation, text_of
from ffr_dyn.functions.time_functions import (
    HARMONIC,
    OPERATION,
    POLYNOMIAL,
    TimeFunction,
    constant,
    signals_in,
)
from ffr_dyn.integrators import CONTROLLED, Controlled, Integrator, Within, methods
from ffr_dyn.integrators.stabilisation import Baumgarte, Projection, Stabilisation
from ffr_dyn.scene.parts import as_declared, cut_joints
from ffr_dyn.scene.scene import Body, Scene
from ffr_dyn.scene_file.assignments import assigned
from ffr_dyn.scene_file.parameters import NAME, flattened
from ffr_dyn.scene_file.read import load_scene
from ffr_dyn.scene_file.schema import Kind, fields_of_motion, formula_of, keys_of, nested_kinds, tables
from ffr_dyn.scene_file.source import PATHS, read_source
from ffr_dyn.scene_file.state_formula import StateFormula
from ffr_prep.body import FlexibleBody, save_body
from ffr_prep.common.errors import InputError
from ffr_prep.common.outputs import replacing

_BARE = set("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-")


def save_scene(scene: Scene, settings: Settings | MomentSettings, path: str | Path) -> Path:
    """Write a scene file, and beside it a body file <file>.<body>.ffr for every flexible body; bodies of one model share it.

    Raises InputError for a Python function in the scene, which a file cannot hold, ComputationError where the file
    cannot be written.

    >>> fd.save_scene(scene, settings, "scene.toml")
    """
    path = Path(path)
    bodies = as_declared(scene.bodies)
    models = {id(body.model): (body.model, f"{path.stem}.{body.name}.ffr") for body in reversed(bodies)}
    files = {body.name: models[id(body.model)][1] for body in bodies if not _is_plain(body.model)}
    text = to_toml(scene, settings, files)
    for model, file in models.values():
        if file in files.values():
            save_body(model, path.parent / file)
    _replace(path, text)
    return path


def save_changed(
    scene: Scene,
    settings: Settings | MomentSettings,
    path: str | Path,
    original: str | Path,
    given: Mapping[str, str] = {},
) -> Path:
    """Write a scene file as `save_scene` does, with the parameters of the file that the scene has been made from.

    What the change has left as it was stands as in that file, in formulas of the parameters, so that these may be changed
    still. Parameters that something depended on which is changed would now act in part alone, or not at all: they are left
    out, with their values where they stood.

    given : values, as text, of parameters in place of those in the original file
    """
    source, (first, how) = read_source(Path(original)), load_scene(original, given)
    declared, parameters = assigned(source, given)
    path = save_scene(scene, settings, path)
    if not parameters:
        return path
    text = path.read_text(encoding="utf-8")
    plain = tomllib.loads(text)
    before = tomllib.loads(to_toml(first, how, {body.name: "" for body in first.bodies if not _is_plain(body.model)}))
    text_of_all = _moved(declared, path.parent)
    lost = _fixed(parameters, text_of_all, _as_given(plain, before, _without_marked(text_of_all)))
    kept = {name: value for name, value in parameters.items() if name not in lost}
    tree = _as_given(plain, before, _free_of(_without_marked(text_of_all), plain, lost))
    _replace(path, "\n".join(_lines({**({"parameters": kept} if kept else {}), **tree}, ())) + "\n")
    files = {name: entry["file"] for name, entry in plain["bodies"].items() if "file" in entry}
    if tomllib.loads(to_toml(*load_scene(path), files)) != plain:
        _replace(path, text)  # what is written must be the scene, with its formulas or without
    return path


def lost_parameters(original: str | Path, written: str | Path) -> list[str]:
    """Names of the parameters of a scene file that another one, made of it, does not have."""
    before, after = (flattened(read_source(Path(path)).tree.get("parameters", {})) for path in (original, written))
    return [name for name in before if name not in after]


def _fixed(parameters: Mapping[str, Any], given: dict[str, Any], written: dict[str, Any]) -> set[str]:
    """The parameters of entries that are no longer written as they were given, and those that stand with them."""
    left, entries = dict(_entries(written)), list(_entries(given))
    together = [_names(part) & parameters.keys() for _, part in entries]
    together += [{name, *(_names(value) & parameters.keys())} for name, value in parameters.items()]
    lost = _names([part for keys, part in entries if keys not in left or left[keys] != part]) & parameters.keys()
    while more := set().union(*(names for names in together if names & lost)) - lost:
        lost |= more
    return lost


def _entries(tree: Any, keys: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    """What tables hold, by their keys."""
    if keys in (("chart",), ("outputs",), ("name",), ("include",)):  # no part of the motion
        return
    if isinstance(tree, dict):
        for key, item in tree.items():
            yield from _entries(item, (*keys, key))
    else:
        yield keys, tree


def _names(value: Any) -> set[str]:
    """Words in the texts of an entry that may be parameters."""
    if isinstance(value, str):
        return {match[0] for match in NAME.finditer(value)}
    items = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    return set().union(*map(_names, items), ())


def _free_of(text: Any, plain: Any, lost: set[str]) -> Any:
    """A tree as it was given, with numbers for what depends on some parameters."""
    if not _names(text) & lost:
        return text
    if isinstance(text, dict) and isinstance(plain, dict):
        return {key: _free_of(item, plain[key], lost) for key, item in text.items() if key in plain}
    return plain


def _replace(path: Path, text: str) -> None:
    with replacing(path) as part:
        part.write_text(text, encoding="utf-8")


def _as_given(new: Any, before: Any, text: Any) -> Any:
    """A tree with the entries that have not changed as they were given."""
    if new == before:
        return text
    if not all(isinstance(tree, dict) for tree in (new, before, text)):
        return new
    return {key: _as_given(item, before.get(key), text[key]) if key in text else item for key, item in new.items()}


def _without_marked(tree: dict[str, Any]) -> dict[str, Any]:
    """Without the bodies that have more markers: these stand among their points in what is written."""
    marked = {entry.get("body") for entry in tree.get("markers", {}).values()}
    ground = {} if "ground" in marked or "ground" not in tree else {"ground": tree["ground"]}
    bodies = {name: entry for name, entry in tree.get("bodies", {}).items() if name not in marked}
    return {key: item for key, item in tree.items() if key != "ground"} | {"bodies": bodies, **ground}


def _moved(value: Any, folder: Path) -> Any:
    """The tree with the paths in it relative to a folder."""
    if isinstance(value, dict):
        return {
            key: os.path.relpath(item, folder) if key in PATHS and isinstance(item, str) else _moved(item, folder)
            for key, item in value.items()
        }
    return [_moved(item, folder) for item in value] if isinstance(value, list) else value


def to_toml(scene: Scene, settings: Settings | MomentSettings, files: Mapping[str, str] = {}) -> str:
    """The text of the scene file.

    files : by name of a flexible body, the file in which it is kept

    Raises InputError for what a file cannot hold: Python functions, flexible bodies without a file, a deformed body in parts.

    >>> print(fd.to_toml(scene, settings))
    """
    top = {"name": scene.name, "gravity": scene.gravity, "base_acceleration": scene.base_acceleration}
    top["plane"] = scene.plane
    tree = {**top, "outputs": list(settings.outputs), "analysis": _analysis(settings), "ground": dict(scene.ground)}
    tree["chart"] = _chart(settings.chart) if isinstance(settings, Settings) else {}
    tree["inputs"] = _inputs(scene)
    tree["bodies"] = {body.name: _body(body, files) for body in as_declared(scene.bodies)}
    made = {joint.name for joint in cut_joints(scene.bodies)}
    for table, kinds in tables().items():
        things = [thing for thing in getattr(scene, table) if thing.name not in made]
        tree[table] = {thing.name: _entry(_kind(kinds, thing), thing) for thing in things}
    return "\n".join(_lines(_data(tree, "scene"), ())) + "\n"


def _inputs(scene: Scene) -> dict[str, float]:
    """Initial values of the scene's inputs by name."""
    fields_of = [value for table in tables() for thing in getattr(scene, table) for value in _given(thing).values()]
    return {found.name: found.data[4] for found in _signals((*fields_of, scene.base_acceleration))}


def _signals(value: Any) -> Iterator[TimeFunction]:
    if isinstance(value, TimeFunction):
        yield from signals_in(value)
    elif isinstance(value, (list, tuple)):
        for item in value:
            yield from _signals(item)


def _kind(kinds: tuple[Kind, ...], thing: Any) -> Kind:
    return next(kind for kind in kinds if type(thing) is kind.made)


# ---- entries ------------------------------------------------------------------------------------------------------


def _analysis(settings: Settings | MomentSettings) -> dict[str, Any]:
    analysis = settings.analysis
    entry: dict[str, Any] = {"kind": word_of(type(analysis)), **settings.span}
    del entry["outputs"]
    if isinstance(settings, Settings) and settings.analysis.integrates:
        entry |= _method(settings.method)
    if isinstance(settings, Settings) and settings.analysis.stabilised:
        entry["stabilisation"] = _stabilisation(settings.stabilisation)
    return entry | _particular(analysis)


def _chart(chart: Charted) -> dict[str, Any]:
    entry = {
        "measures": list(chart.measures),
        "methods": {name: list(numbers) for name, numbers in chart.methods},
        "modes": ["all" if number is None else number for number in chart.modes],
        "drop": [list(terms) for terms in chart.drops],
    }
    return {} if chart == Charted() else entry


def _method(method: Integrator | Within) -> dict[str, Any]:
    if isinstance(method, Within):
        settings = {"settings": dict(method.settings)} if method.settings else {}
        return {"method": method.method, "accuracy": method.accuracy, **settings}
    name = next(word for word, made in methods().items() if type(method) is made)
    if name in CONTROLLED:
        return {"method": name, "tolerances": asdict(cast("Controlled", method).tolerances)}
    given = {key: getattr(method, key) for key in settings_of(type(method))}
    return {"method": name, "step": method.step, **({"settings": given} if given else {})}


def _particular(analysis: OverTime | OfMoment) -> dict[str, Any]:
    """The settings of one analysis only."""
    hints, entry = get_type_hints(type(analysis)), {}
    for f in fields(analysis):
        value = getattr(analysis, f.name)
        if isinstance(f.default, str) and value == f.default:
            continue
        if names_key := f.metadata.get("names"):
            names = tuple(item for item in value if isinstance(item, str))
            others = tuple(item for item in value if not isinstance(item, str))
            if value != (*others, *names):
                raise InputError(
                    f"analysis: a scene file lists the names of {names_key} {names} after the other {f.name}; put them last"
                )
            value, entry[names_key] = others, names
        if kinds := nested_kinds(hints[f.name]):
            value = _nested(kinds, value)
        entry[f.name] = value
    return entry


def _nested(kinds: tuple[Kind, ...], value: Any) -> Any:
    """The declarations that a field of an analysis holds: several as a table, one with its kind, or None."""
    if isinstance(value, tuple):
        return {one.name: _entry(_kind(kinds, one), one) for one in value}
    return None if value is None else {"kind": _kind(kinds, value).word, **_given(value)}


def _stabilisation(keep: Stabilisation) -> dict[str, Any]:
    if isinstance(keep, Projection):
        return {"kind": "projection", "tolerance": keep.tolerance}
    return (
        {"kind": "baumgarte", "alpha": keep.alpha, "beta": keep.beta}
        if isinstance(keep, Baumgarte)
        else {"kind": "none"}
    )


def _body(body: Body, files: Mapping[str, str]) -> dict[str, Any]:
    entry = _model(body, files)
    for key in ("position", "velocity", "omega_bar"):
        entry[key] = getattr(body, key)
    entry["rotation"] = body.rotation
    if body.model.n:
        entry |= {"q": body.q, "q_dot": body.q_dot, "damping": body.damping, "stiffening": body.stiffening}
    if body.dropped:
        entry["drop"] = list(body.dropped)
    return entry


def _model(body: Body, files: Mapping[str, str]) -> dict[str, Any]:
    if body.name in files:
        return {"file": files[body.name]}
    model = body.model
    if not _is_plain(model):
        raise InputError(
            f"body {body.name!r} is flexible or has a surface: a scene file names its body file; save it and give its name"
        )
    points = {interface.name: interface.position for interface in model.interfaces}
    return {"mass": model.mass, "r_dm": model.r_dm, "rr_dm": model.rr_dm, "points": points}


def _is_plain(model: FlexibleBody) -> bool:
    """Whether a body is all in its mass, moments and points."""
    return model.n == 0 and model.surface is None


def _entry(kind: Kind, thing: Any) -> dict[str, Any]:
    """The keys of an entry that differ from their defaults."""
    entry: dict[str, Any] = {"kind": kind.word} if kind.word else {}
    given = _with_formulas(thing) if isinstance(formula_of(thing), StateFormula) else _given(thing)
    for f in fields(thing):
        if callable(given[f.name]) and f.name not in [key.name for key in keys_of(kind)]:
            raise InputError(
                f"{thing.name!r}: {f.name} is a Python function, which a scene file cannot hold; use a formula or a table"
            )
    for f in keys_of(kind):
        value = _data(given[f.name], f"{thing.name!r}: {f.name}")
        if f.default is MISSING or value != _data(f.default, f.name):
            entry[f.name] = value
    return entry


def _given(thing: Any) -> dict[str, Any]:
    return {f.name: getattr(thing, f.name) for f in fields(thing)}


def _with_formulas(force: Any) -> dict[str, Any]:
    """The fields of a force, with the formulas of the motion back in its components."""
    given, formulas = _given(force), iter(force.function.expressions)

    def whole(component: Any) -> Any:
        formula = next(formulas)
        return component if formula == constant(0.0) else formula

    for key in fields_of_motion(type(force)):
        value = given[key]
        given[key] = [whole(c) for c in value] if isinstance(value, (list, tuple)) else whole(value)
    return given | {"function": None}


# ---- values -------------------------------------------------------------------------------------------------------


def _data(value: Any, what: str) -> Any:
    """Numbers, texts, lists and tables only."""
    if isinstance(value, (Measured, Operation)):
        return text_of(value)
    if isinstance(value, TimeFunction):
        return _function(value, what)
    if isinstance(value, Curve):
        return {"at": value.at.tolist(), "values": value.values.tolist()}
    if isinstance(value, Mapping):
        return {key: _data(item, what) for key, item in value.items() if item is not None}
    if isinstance(value, (np.ndarray, np.generic)):
        return _data(value.tolist(), what)
    if isinstance(value, (list, tuple)):
        return [_data(item, what) for item in value]
    if isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    if callable(value):
        raise InputError(
            f"{what} is a Python function, which a scene file cannot hold: give numbers or a name in its place"
        )
    return value


def _function(function: TimeFunction, what: str) -> Any:
    data = list(function.data)
    if function.callback is not None:
        raise InputError(f"{what} is a Python function, which a scene file cannot hold; use a formula or a table")
    if function.kind == OPERATION or function.name:
        return text_of(function)
    if function.kind == POLYNOMIAL:
        return data[0] if len(data) == 1 else {"polynomial": data}
    if function.kind == HARMONIC:
        return {"harmonic": dict(zip(("mean", "amplitude", "speed", "phase"), data, strict=True))}
    pieces, count = int(data[0]), int(data[1])
    rows = np.reshape(data[pieces + 3 :], (pieces, count)).tolist()
    return {"piecewise": {"breaks": data[2 : pieces + 3], "coefficients": rows}}


# ---- TOML ---------------------------------------------------------------------------------------------------------


def _lines(table: Mapping[str, Any], keys: tuple[str, ...]) -> Iterator[str]:
    """A table of at most two levels with its header; deeper ones are written in line."""
    inner = {key: item for key, item in table.items() if isinstance(item, dict) and len(keys) < _depth(keys)}
    plain = {key: item for key, item in table.items() if key not in inner}
    if keys and (plain or not inner):
        yield f"\n[{'.'.join(map(_key, keys))}]"
    for key, item in plain.items():
        yield f"{_key(key)} = {_inline(item)}"
    for key, item in inner.items():
        if item:
            yield from _lines(item, (*keys, key))


def _depth(keys: tuple[str, ...]) -> int:
    """How deep tables with headers go: entries of a table do, their own tables do not."""
    return 2 if keys and keys[0] in ("bodies", *tables()) else 1 if not keys else 0


def _inline(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_key(key)} = {_inline(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_inline, value)) + "]"
    if isinstance(value, bool):
        return str(value).lower()
    return _text(value) if isinstance(value, str) else repr(value)


def _key(key: str) -> str:
    return key if key and set(key) <= _BARE else _text(key)


def _text(text: str) -> str:
    """A basic string: the escapes of JSON are those of TOML, which also wants the delete character escaped."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
