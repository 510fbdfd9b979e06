"""Numbered equations and the functions that hold them; compiled modules and their readable twins; the map of the code."""

from __future__ import annotations

import ast
import importlib
import inspect
import re
from functools import reduce
from pathlib import Path
from typing import Any

import pytest
from places import ROOT

NUMBERED = re.compile(r"^\*\*\((\d+)\)\*\* .*\[`([\w.]+)`\]\(\.\./([\w/]+\.py)\); test: ", re.M)
HELD = re.compile(r"; test: \[`(\w+)`\]\(\.\./(tests/[\w/]+\.py)\)$", re.M)
CITED = re.compile(r"Equation \((\d+)\) of docs/notation\.md")
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


def test_every_equation_names_a_test_that_holds_it():
    held = HELD.findall((ROOT / "docs" / "notation.md").read_text(encoding="utf-8"))
    assert len(held) == len(EQUATIONS)
    for name, path in held:
        assert re.search(rf"^def {name}\(", (ROOT / path).read_text(encoding="utf-8"), re.M)


def test_no_docstring_cites_an_equation_that_is_not_its_own():
    cited = [number for path in MODULES for number in CITED.findall(path.read_text(encoding="utf-8"))]
    assert sorted(cited, key=int) == [number for number, _, _ in EQUATIONS]


# ---- compiled modules and their twins -----------------------------------------------------------------------------------

# Modules without equations: data, declarations, how things are compiled.
PLAIN = {
    "ffr_dyn.kernels.tables",
    "ffr_dyn.kernels.options",
    "ffr_dyn.kernels.integrator_api",
    "ffr_dyn.integrators",
    "ffr_dyn.integrators.step",
    "ffr_dyn.integrators.tolerances",
    "ffr_dyn.integrators.stabilisation",
    "ffr_dyn.integrators.within",
}
COMPILED = {
    ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path
    for path in MODULES
    if {"kernels", "integrators"} & set(path.parts) and "simd" not in path.parts
}


def twins_of(path: Path) -> str:
    """The last part of a module's docstring, "Twin: ..."."""
    return (ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or "").rpartition("Twin: ")[2]


@pytest.mark.parametrize("module", sorted(set(COMPILED) - PLAIN))
def test_a_compiled_module_names_its_readable_twin(module):
    """A function of the readable form, or, of a method, the statement in its docstring and the test that holds it to that."""
    said = re.findall(r"`([^`]+)`", twins_of(COMPILED[module]))
    assert said, f"{module} names no twin"
    for name in said:
        if "::" in name:
            path, _, test = name.partition("::")
            assert re.search(rf"^def {test}\(", (ROOT / path).read_text(encoding="utf-8"), re.M)
        else:
            assert inspect.isfunction(resolved(name)) or inspect.ismodule(resolved(name))
            assert not name.startswith("ffr_dyn.kernels")


def test_only_modules_without_equations_have_no_twin():
    assert {module for module, path in COMPILED.items() if twins_of(path).startswith("none")} == PLAIN


# ---- the map of the code ------------------------------------------------------------------------------------------------

MAP = (ROOT / "docs" / "reading_the_code.md").read_text(encoding="utf-8")


def test_every_name_on_the_map_exists():
    names = re.findall(r"`(ff\w+(?:\.\w+)+)`", MAP)
    paths = re.findall(r"`((?:ffr_\w+|tests)/[\w/]+\.py)`", MAP)
    assert len(names) > 20
    assert len(paths) > 20
    for name in names:
        assert resolved(name) is not None
    assert [path for path in paths if not (ROOT / path).exists()] == []
    assert set(re.findall(r"equations? \((\d+)\)", MAP)) <= {number for number, _, _ in EQUATIONS}


def test_every_room_is_on_the_map():
    rooms = {f"{path.parts[-2]}.{path.name}" for path in ROOT.glob("ffr_*/*") if (path / "__init__.py").exists()}
    assert {room for room in rooms if f"`{room}`" not in MAP} == set()


def test_the_words_of_constraints_stand_where_the_map_says():
    for name in ("dot_1", "dot_2"):
        assert re.search(rf"^def {name}\(", (ROOT / "ffr_dyn/kernels/rows.py").read_text(encoding="utf-8"), re.M)
