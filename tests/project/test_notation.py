"""Numbered equations and the functions that hold them; compiled modules and their readable twins; the map of the code."""

from __future__ import annotations

import ast
import importlib
import inspect
import re
from functools import reduce
from typing import Any

import pytest
from places import ROOT

NUMBERED = re.compile(r"^\*\*\((\d+)\)\*\* .*\[`([\w.]+)`\]\(\.\./([\w/]+\.py)\)$", re.M)
CITED = re.compile(r"Equation \((\d+)\) of docs/notation\.md")
TWIN = re.compile(r"Twin: `(ff\w+(?:\.\w+)+)`")
EQUATIONS = NUMBERED.findall((ROOT / "docs" / "notation.md").read_text(encoding="utf-8"))
MODULES = sorted(path for package in ("ffr_prep", "ffr_dyn") for path in (ROOT / package).rglob("*.py"))


def resolved(name: str) -> Any:
    """What a dotted name stands for: a module, or something in one."""
    parts = name.split(".")
    for end in range(len(parts), 0, -1):
        try:
            module = importlib.import_module(".".join(parts[:end]))
        except ModuleNotFoundError:
            continue
        return reduce(getattr, parts[end:], module)
    raise ModuleNotFoundError(name)


# ---- equations ----------------------------------------------------------------------------------------------------------


def test_equations_are_numbered_one_after_another_each_with_a_function_of_its_own():
    assert [int(number) for number, _, _ in EQUATIONS] == list(range(1, len(EQUATIONS) + 1))
    assert len({name for _, name, _ in EQUATIONS}) == len(EQUATIONS) > 20


@pytest.mark.parametrize(("number", "name", "path"), EQUATIONS)
def test_the_function_of_an_equation_cites_it(number, name, path):
    found = resolved(name)
    function = found.fget if isinstance(found, property) else found
    assert inspect.isfunction(function)
    assert CITED.findall(inspect.getdoc(function) or "") == [number]
    assert inspect.getsourcefile(function) == str(ROOT / path)


def test_no_docstring_cites_an_equation_that_is_not_its_own():
    cited = [number for path in MODULES for number in CITED.findall(path.read_text(encoding="utf-8"))]
    assert sorted(cited, key=int) == [number for number, _, _ in EQUATIONS]
