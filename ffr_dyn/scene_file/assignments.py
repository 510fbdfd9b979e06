"""Values given from outside to a scene file: to its parameters, and to any other entry by the path of its keys.

    crank.length = 0.06             a parameter
    bodies.rod.damping = 0.02       an entry that the file has
    gravity.2 = -1.62               the second number of a list
    bodies.rod.file = "thin.ffr"    a path is relative to the file in which the entry stands
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from difflib import get_close_matches
from typing import Any

from ffr_dyn.scene_file.parameters import flattened
from ffr_dyn.scene_file.source import PATHS, Source
from ffr_prep.common.errors import InputError

Keys = tuple[str, ...]


def assigned(source: Source, given: Mapping[str, str]) -> tuple[dict[str, Any], dict[str, Any]]:
    """(tree without its parameters, parameters by dotted name) of a scene file, with values given as text.

    Raises InputError for a name that is neither a parameter nor an entry, with the nearest one.
    """
    tree = {key: item for key, item in source.tree.items() if key != "parameters"}
    parameters = flattened(source.tree.get("parameters", {}))
    places = places_of(tree) if given.keys() - parameters.keys() else {}
    for name, text in given.items():
        if name in parameters:
            parameters[name] = text
        elif name in places:
            tree = _with(tree, places[name], _value(source, places[name], text))
        else:
            raise InputError(unknown(name, parameters, places))
    return tree, parameters


def places_of(tree: Mapping[str, Any]) -> dict[str, Keys]:
    """Keys of all entries of a tree that are no tables, by dotted name; items of lists are counted from 1."""
    return {".".join(keys): keys for keys in _leaves(tree, ())}


def unknown(name: str, parameters: Mapping[str, Any], places: Mapping[str, Keys]) -> str:
    """What to say of a name that is neither."""
    close = get_close_matches(name, [*parameters, *(places if "." in name else ())], 1)
    known = f"there are: {', '.join(parameters) or 'none'}, and the entries of the file, such as bodies.rod.mass"
    return f"there is no parameter {name!r}; {f'did you mean {close[0]!r}?' if close else known}"


def _leaves(tree: Any, keys: Keys) -> Iterator[Keys]:
    if isinstance(tree, Mapping):
        items = [(str(key), item) for key, item in tree.items()]
    else:
        yield keys
        items = [(str(k), item) for k, item in enumerate(tree, 1)] if isinstance(tree, list) else []
    for key, item in items:
        yield from _leaves(item, (*keys, key))


def _with(tree: Any, keys: Keys, value: Any) -> Any:
    """A copy of a tree with another entry."""
    if not keys:
        return value
    if isinstance(tree, list):
        k = int(keys[0]) - 1
        return [*tree[:k], _with(tree[k], keys[1:], value), *tree[k + 1 :]]
    return {**tree, keys[0]: _with(tree[keys[0]], keys[1:], value)}


def _value(source: Source, keys: Keys, text: str) -> Any:
    """A value as TOML reads it; what TOML does not read is a text, such as `120 mm`."""
    try:
        value: Any = tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        value = text
    if not isinstance(value, str | int | float | bool | list):
        value = text
    return str(source.origins[keys].parent / value) if keys[-1] in PATHS and isinstance(value, str) else value
