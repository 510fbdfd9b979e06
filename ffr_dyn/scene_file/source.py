"""The text of a scene: a TOML file and those that it includes, merged into one tree, with the file of every entry."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ffr_dyn.scene_file.toml_lines import lines_of
from ffr_prep.common.errors import InputError
from ffr_prep.common.reading import read_text, read_toml

PATHS = ("file", "table_file")  # keys whose value is a path relative to the file in which it stands

Origins = dict[tuple[str, ...], Path]


@dataclass(frozen=True)
class Source:
    """A merged tree, and the file from which each of its entries comes, by the path of its keys."""

    tree: dict[str, Any]
    origins: Origins


def read_source(path: Path) -> Source:
    """The tree of a scene file with its includes.

    Raises InputError that names the file, and the line where TOML does, for a file that cannot be read, an entry that two
    files give, and a file that includes itself.
    """
    return _read(path, ())


def origin(source: Source, keys: tuple[str, ...]) -> str:
    """File and line of an entry, or of the nearest table around it."""
    around = keys
    while around and around not in source.origins:
        around = around[:-1]
    path = source.origins[around]
    lines = _lines(path)
    while keys and keys not in lines:
        keys = keys[:-1]
    return f"{path}, line {lines[keys]}" if keys else str(path)


def origin_of_name(source: Source, message: str) -> str:
    """File and line of the entry that a complaint names first, in quotes, or whose value it is; else the file alone."""
    for name in re.findall(r"'([^']+)'", message):
        for table, entries in source.tree.items():
            if table != "parameters" and isinstance(entries, dict) and name in entries:
                return origin(source, (table, name))
        if keys := next(_paths_to(source.tree, name), None):
            return origin(source, keys)
    return origin(source, ())


def _paths_to(tree: dict[str, Any], text: str, keys: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    """The keys of the entries whose value is a text."""
    for key, item in tree.items():
        if isinstance(item, dict):
            yield from _paths_to(item, text, (*keys, key))
        elif item == text:
            yield (*keys, key)


def _lines(path: Path) -> dict[tuple[str, ...], int]:
    """Where the entries of a file stand; nowhere when it can no longer be read as it was."""
    try:
        return lines_of(read_text(path, "a scene file"))
    except InputError:
        return {}


def _read(path: Path, above: tuple[Path, ...]) -> Source:
    here = path.resolve()
    if here in above:
        circle = " -> ".join(p.name for p in (*above[above.index(here) :], here))
        raise InputError(f"{path} includes itself: {circle}")
    tree = _rebased(_parsed(path), path.parent)
    source = Source(tree, _origins(tree, path))
    for name in _includes(tree, path):
        source = _merged(_read(path.parent / name, (*above, here)), source)
    return source


def _parsed(path: Path) -> dict[str, Any]:
    return read_toml(path, "a scene file")


def _includes(tree: dict[str, Any], path: Path) -> list[str]:
    names = tree.pop("include", [])
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise InputError(f"{path}: include must be a list of file names, not {names!r}")
    for name in names:
        if Path(name).is_absolute():
            raise InputError(f"{path}: include {name!r} must be relative to this file")
    return names


def _rebased(value: Any, folder: Path) -> Any:
    """The tree with the paths in it relative to where the program runs."""
    if isinstance(value, dict):
        return {
            key: str(folder / item) if key in PATHS and isinstance(item, str) else _rebased(item, folder)
            for key, item in value.items()
        }
    return [_rebased(item, folder) for item in value] if isinstance(value, list) else value


def _origins(tree: Any, path: Path, keys: tuple[str, ...] = ()) -> Origins:
    found = {keys: path}
    for key, item in tree.items() if isinstance(tree, dict) else ():
        found |= _origins(item, path, (*keys, key))
    return found


def _merged(included: Source, main: Source) -> Source:
    tree = _joined(included, main, included.tree, main.tree, ())
    return Source(tree, included.origins | main.origins)


def _joined(included: Source, main: Source, below: Any, above: Any, keys: tuple[str, ...]) -> Any:
    """Both trees in one. A file may give other values to the parameters of those it includes, and to nothing else."""
    if isinstance(below, dict) and isinstance(above, dict):
        joined = dict(below)
        for key, item in above.items():
            joined[key] = _joined(included, main, below[key], item, (*keys, key)) if key in below else item
        return joined
    if keys[0] == "parameters":
        return above
    raise InputError(
        f"{origin(main, keys)}: {'.'.join(keys)} is given in {origin(included, keys)} too; one name, one thing"
    )
