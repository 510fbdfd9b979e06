"""Public names explain themselves: what they are, shapes, units, errors, and an example that can be called."""

from __future__ import annotations

import ast
import dataclasses
import inspect
import re
import textwrap
from typing import Any

import pytest

import ffr_dyn as fd
import ffr_prep as fp
from ffr_prep.common.docstrings import blocks, meanings, prose

DOORS = {"fd": fd, "fp": fp}
NAMES = [f"{alias}.{name}" for alias, door in DOORS.items() for name in door.__all__ if name != "__version__"]


def found(name: str) -> Any:
    alias, _, word = name.partition(".")
    return getattr(DOORS[alias], word)


def examples(thing: Any) -> list[ast.Module]:
    """The programs of a docstring."""
    lines = [line.strip() for line in (thing.__doc__ or "").splitlines()]
    text = "\n".join(line[4:] for line in lines if line.startswith((">>> ", "... ")))
    return [ast.parse(re.sub(r"^(try: .*)$", r"\1", text, flags=re.M))] if text else []


def calls(tree: ast.Module) -> list[tuple[Any, ast.Call]]:
    """What is called by a name of a front door, and how."""
    return [
        (found(f"{node.func.value.id}.{node.func.attr}"), node)
        for node in ast.walk(tree)
        if isinstance(node, ast.Call)
        and isinstance(node.func, ast.Attribute)
        and isinstance(node.func.value, ast.Name)
        and node.func.value.id in DOORS
    ]


@pytest.mark.parametrize("name", NAMES)
def test_an_example_calls_what_there_is(name):
    trees = examples(found(name))
    assert trees, f"{name} has no example: a line '>>> ...' at the end of its docstring"
    for thing, call in calls(trees[0]):
        starred = any(isinstance(argument, ast.Starred) for argument in call.args)
        if not starred:
            inspect.signature(thing).bind(*call.args, **{of.arg: of.value for of in call.keywords if of.arg})


@pytest.mark.parametrize("name", NAMES)
def test_errors_that_it_raises_itself_are_named(name):
    thing = inspect.unwrap(found(name))
    source = thing if inspect.isfunction(thing) else vars(thing).get("__post_init__")
    if source is None or inspect.unwrap(source).__name__ == "__create_fn__":
        return
    tree = ast.parse(textwrap.dedent(inspect.getsource(inspect.unwrap(source))))
    raised = {
        node.exc.func.id
        for node in ast.walk(tree)
        if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call) and isinstance(node.exc.func, ast.Name)
    }
    assert {
        word for word in raised & {"InputError", "ComputationError", "BodyError"} if word not in thing.__doc__
    } == set()


SHAPE, UNIT = re.compile(r"\((?:[\w +*.]+,)+[\w +*.]*\)"), re.compile(r"\[[^\]]+\]")
ELSEWHERE = re.compile(r"\b(?:as of|as in|those of) `")  # which says them
OF_ARRAYS, OF_NUMBERS = re.compile(r"\b(?:Array|Vector)\b|tuple\[float"), re.compile(r"\bfloat\b")


def told(thing: Any) -> str:
    """Docstring, and the help of options."""
    made = dataclasses.fields(thing) if dataclasses.is_dataclass(thing) else ()
    return " ".join([thing.__doc__ or "", *(str(dict(field.metadata)) for field in made)])


def annotations(thing: Any) -> str:
    """Of what it takes and, of a function, returns."""
    try:
        found = inspect.signature(thing)
    except (TypeError, ValueError):
        return ""
    taken = [str(of.annotation) for of in found.parameters.values() if not of.name.startswith("_")]
    return " ; ".join([*taken, *([] if inspect.isclass(thing) else [str(found.return_annotation)])])


@pytest.mark.parametrize("name", NAMES)
def test_shapes_of_arrays_and_units_of_numbers_are_told(name):
    thing = found(name)
    text, given = told(thing), annotations(thing)
    assert not OF_ARRAYS.search(given) or SHAPE.search(text), "a shape such as (N, 3) is missing"
    assert not OF_NUMBERS.search(given) or UNIT.search(text) or ELSEWHERE.search(text), "a unit such as [m] is missing"


# ---- lists in docstrings --------------------------------------------------------------------------------------------

SAID = """A force.

    i, j : markers, of which
           j is pushed
    stiffness : [N/m];  damping : [N s/m]
    axes : "global"

    Raises InputError: never.

    >>> made = force("a")
    """


def test_lists_give_each_name_its_meaning():
    assert meanings(SAID) == {
        "i": "markers, of which j is pushed",
        "j": "markers, of which j is pushed",
        "stiffness": "[N/m]",
        "damping": "[N s/m]",
        "axes": '"global"',
    }
    assert meanings(None) == {}


def test_prose_is_what_is_left():
    assert prose(SAID) == "A force.\n\nRaises InputError: never."
    assert [type(block) for block in blocks(SAID)] == [str, dict, str, str]
