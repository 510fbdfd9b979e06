"""The texts of errors that a package says, as patterns found in its sources."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from places import ROOT

ERRORS = ("InputError", "ComputationError", "OpenError", "BodyError")
LEAST = 12  # letters of its own that a text has; one with fewer is made by a function


@dataclass(frozen=True)
class Case:
    """What raises a text, and what the text says to do instead."""

    raised: Callable[[], object]
    mended: Callable[[], object]


def numbered(kinds: Mapping[str, Sequence[Case]]) -> tuple[tuple[Case, ...], list[str]]:
    """All cases, and a name of each by its kind and its number there: new ones change no names of other kinds."""
    names = [f"{kind} {k}" for kind, cases in kinds.items() for k in range(len(cases))]
    return tuple(case for cases in kinds.values() for case in cases), names


def texts_of(package: str, parts: Mapping[str, tuple[str, ...]]) -> dict[str, tuple[re.Pattern[str], ...]]:
    """What each module of a package says; parts : functions of a module all of whose texts are parts of messages."""
    found = {}
    for path in sorted((ROOT / package).rglob("*.py")):
        module = path.relative_to(ROOT / package).as_posix()
        said = [_pattern(node) for node in _said(ast.parse(path.read_text(encoding="utf-8")), parts.get(module, ()))]
        if kept := tuple(re.compile(one, re.DOTALL) for one in said if len(re.sub(r"\W", "", one)) >= LEAST):
            found[module] = kept
    return found


def _said(tree: ast.Module, parts: tuple[str, ...]) -> Iterator[ast.expr]:
    """The texts of all errors, and all texts that the functions `parts` make."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in ERRORS and node.args:
            yield node.args[0]
        if isinstance(node, ast.FunctionDef) and node.name in parts:
            yield from (one.value for one in ast.walk(node) if isinstance(one, ast.Return) and one.value is not None)


def _pattern(node: ast.expr) -> str:
    """What is not written in the source may be anything."""
    if isinstance(node, ast.Constant):
        return re.escape(str(node.value))
    if isinstance(node, ast.JoinedStr):
        return "".join(map(_pattern, node.values))
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        return _pattern(node.left) + _pattern(node.right)
    return ".*"
