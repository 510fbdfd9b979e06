"""Entries of a tree of tables and lists, as a TOML file holds them, by the path of their keys: `members.bar.section.d`.

Items of lists are counted from 1, as in `gravity.2`.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from typing import Any

from ffr_prep.common.errors import InputError
from ffr_prep.common.registry import choice

Keys = tuple[str, ...]


def places_of(tree: Mapping[str, Any]) -> dict[str, Keys]:
    """Keys of all entries that are no tables, by dotted name."""
    return {".".join(keys): keys for keys in _leaves(tree, ())}


def value_at(tree: Any, keys: Keys) -> Any:
    """The value of an entry that the tree has."""
    for key in keys:
        tree = tree[int(key) - 1] if isinstance(tree, list) else tree[key]
    return tree


def changed(tree: Any, keys: Keys, value: Any) -> Any:
    """A copy of a tree with another value of an entry."""
    if not keys:
        return value
    if isinstance(tree, list):
        k = int(keys[0]) - 1
        return [*tree[:k], changed(tree[k], keys[1:], value), *tree[k + 1 :]]
    return {**tree, keys[0]: changed(tree[keys[0]], keys[1:], value)}


def value_of(text: str) -> Any:
    """A value as TOML reads it; what TOML does not read is a text, such as `120 mm`."""
    try:
        value: Any = tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text
    return value if isinstance(value, str | int | float | bool | list) else text


def assignments(texts: tuple[str, ...]) -> dict[str, str]:
    """{"crank.length": "0.15"} of ("crank.length=0.15",), as a command line has them. Raises InputError for another form."""
    for text in texts:
        if "=" not in text:
            raise InputError(f"-p {text}: write it as NAME=VALUE")
    pairs = [(name.strip(), value.strip()) for name, _, value in (text.partition("=") for text in texts)]
    names = [name for name, _ in pairs]
    if twice := [name for name in names if names.count(name) > 1]:
        raise InputError(f"-p {twice[0]}: it is given {names.count(twice[0])} times; give it once")
    return dict(pairs)


def with_entries(tree: dict[str, Any], given: Mapping[str, str]) -> dict[str, Any]:
    """The tree with values, given as text, in place of those that it has. Raises InputError for an entry that it has not."""
    places = places_of(tree) if given else {}
    for name, text in given.items():
        if name not in places:
            raise InputError(f"there is no entry {name!r}; {choice(name, places)}")
        tree = changed(tree, places[name], value_of(text))
    return tree


def _leaves(tree: Any, keys: Keys) -> Iterator[Keys]:
    if isinstance(tree, Mapping):
        items = [(str(key), item) for key, item in tree.items()]
    else:
        yield keys
        items = [(str(k), item) for k, item in enumerate(tree, 1)] if isinstance(tree, list) else []
    for key, item in items:
        yield from _leaves(item, (*keys, key))
