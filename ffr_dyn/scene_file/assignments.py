"""Values given from outside to a scene file: to its parameters, and to any other entry by the path of its keys.

crank.length = 0.06             a parameter
bodies.rod.damping = 0.02       an entry that the file has
gravity.2 = -1.62               the second number of a list
bodies.rod.file = "thin.ffr"    a path is relative to the file in which the entry stands
"""

from __future__ import annotations

from collections.abc import Mapping
from difflib import get_close_matches
from typing import Any

from ffr_dyn.scene_file.parameters import flattened
from ffr_dyn.scene_file.source import PATHS, Source
from ffr_prep.common.entries import Keys, changed, places_of, value_of
from ffr_prep.common.errors import InputError


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
            tree = changed(tree, places[name], _value(source, places[name], text))
        else:
            raise InputError(unknown(name, parameters, places))
    return tree, parameters


def unknown(name: str, parameters: Mapping[str, Any], places: Mapping[str, Keys]) -> str:
    """The message about a name that is neither."""
    close = get_close_matches(name, [*parameters, *(places if "." in name else ())], 1)
    such = next((place for place, keys in places.items() if len(keys) > 1), "gravity.2")
    known = f"there are: {', '.join(parameters) or 'none'}, and the entries of the file, such as {such}"
    return f"there is no parameter {name!r}; {f'did you mean {close[0]!r}?' if close else known}"


def _value(source: Source, keys: Keys, text: str) -> Any:
    value = value_of(text)
    return str(source.origins[keys].parent / value) if keys[-1] in PATHS and isinstance(value, str) else value
