"""Where the entries of a TOML file stand: the reader of the standard library tells lines of syntax errors only.

A statement begins on a line of its own: a header of a table, or a key with a value that may go on over several lines. Each is
given to the reader alone, line by line until it can be read, and what it holds stands where it began.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from typing import Any

Keys = tuple[str, ...]


def lines_of(text: str) -> dict[Keys, int]:
    """The line, from 1, on which each entry of a valid TOML text begins, by the path of its keys.

    Elements of arrays have their number, from 0, as key.
    """
    found: dict[Keys, int] = {}
    table: Keys = ()
    counts: dict[Keys, int] = {}
    for line, statement in _statements(text):
        tree = tomllib.loads(statement)
        if not statement.startswith("["):
            _note(found, table, tree, line)
            continue
        table = _header(tree)
        if statement.startswith("[["):
            counts[table] = counts.get(table, -1) + 1
            table = (*table, str(counts[table]))
        found.setdefault(table, line)
    return found


def _statements(text: str) -> Iterator[tuple[int, str]]:
    """Line and text of each statement."""
    begun, waiting = 0, ""
    for number, line in enumerate(text.splitlines(), start=1):
        if not waiting and (not line.strip() or line.lstrip().startswith("#")):
            continue
        begun, waiting = (begun, f"{waiting}\n{line}") if waiting else (number, line.strip())
        if not line.rstrip().endswith(",") and _reads(waiting):  # of long lists the end alone
            yield begun, waiting
            waiting = ""


def _reads(statement: str) -> bool:
    try:
        tomllib.loads(statement)
    except tomllib.TOMLDecodeError:
        return False
    return True


def _header(tree: Any) -> Keys:
    """The keys of a header alone: a dict of one entry in a dict of one entry ..."""
    keys: Keys = ()
    while tree:
        if isinstance(tree, list):
            (tree,) = tree
            continue
        ((key, tree),) = tree.items()
        keys = (*keys, key)
    return keys


def _note(found: dict[Keys, int], keys: Keys, value: Any, line: int) -> None:
    found.setdefault(keys, line)
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, item in inner:
        _note(found, (*keys, str(key)), item, line)
