"""Public names explain themselves: what they are, shapes, units, errors, and an example that can be called."""

from __future__ import annotations

import ast
import dataclasses
import functools
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


ERRORS = {"InputError", "ComputationError", "BodyError"}


@functools.cache
def itself(function: Any) -> tuple[set[str], set[Any]]:
    """The errors that a function raises itself, and the functions and classes of the packages that it calls by name."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
    raised = {
        node.exc.func for node in ast.walk(tree) if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call)
    }
    named = {node.func.id for node in ast.walk(tree) if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)}
    things = [inspect.unwrap(function.__globals__[name]) for name in named & function.__globals__.keys()]
    own = [made(thing) for thing in things if (getattr(thing, "__module__", None) or "").startswith("ffr_")]
    return {of.id for of in raised if isinstance(of, ast.Name)} & ERRORS, {one for one in own if one is not None}


def made(thing: Any) -> Any:
    """The function that runs when a thing is called; None where that has no source."""
    found = vars(thing).get("__post_init__") if inspect.isclass(thing) else thing
    found = inspect.unwrap(found) if found is not None else None
    return found if inspect.isfunction(found) and found.__name__ != "__create_fn__" else None


def reached(function: Any) -> set[str]:
    """The errors of a function and of all that it calls, as far as names lead."""
    seen, ahead, errors = set(), {function}, set()
    while ahead:
        raised, called = itself(one := ahead.pop())
        seen.add(one)
        errors |= raised
        ahead |= called - seen
    return errors


@pytest.mark.parametrize("name", NAMES)
def test_errors_are_told(name):
    """Those that it raises itself by their names; where all come from what it calls, at least one."""
    thing = inspect.unwrap(found(name))
    function = made(thing)
    if function is None:
        return
    told = {word for word in ERRORS if word in thing.__doc__}
    assert itself(function)[0] <= told
    assert told or not reached(function)


SHAPE, UNIT = re.compile(r"\((?:[\w +*.]+,)+[\w +*.]*\)"), re.compile(r"\[[^]\"'=(]*[A-Za-z1°][^]\"'=]*\]")
ELSEWHERE = re.compile(r"\b(?:as of|as in|those of) `")  # which says them
OF_ARRAYS, OF_NUMBERS = re.compile(r"\bArray\b"), re.compile(r"\bfloat\b")
A_FUNCTION = re.compile(r"Callable\[\[.*")  # which has numbers of its own


def told(thing: Any) -> str:
    """Docstring without its example, and the help of options."""
    fields = dataclasses.fields(thing) if dataclasses.is_dataclass(thing) else ()
    return " ".join([(thing.__doc__ or "").partition(">>>")[0], *(str(dict(of.metadata)) for of in fields)])


def told_of(thing: Any, name: str) -> str:
    """What is said of an argument: in a list, as an option, and in sentences from its name on."""
    fields = {of.name: of for of in dataclasses.fields(thing)} if dataclasses.is_dataclass(thing) else {}
    option = str(dict(fields[name].metadata)) if name in fields else ""
    sentences = re.findall(rf"\b{re.escape(name)}\b[^.;]*", " ".join((thing.__doc__ or "").partition(">>>")[0].split()))
    return " ".join([meanings(thing.__doc__).get(name, ""), option, *sentences])


def arguments(thing: Any) -> dict[str, str]:
    """The annotations of what it takes, by name."""
    try:
        found = inspect.signature(thing).parameters.values()
    except (TypeError, ValueError):
        return {}
    return {of.name: A_FUNCTION.sub("", str(of.annotation)) for of in found if not of.name.startswith("_")}


@pytest.mark.parametrize("name", NAMES)
def test_shapes_of_arrays_and_units_of_numbers_are_told_of_every_argument(name):
    """[1] of a number without a unit."""
    thing = found(name)
    if ELSEWHERE.search(told(thing)):
        return
    of = {argument: told_of(thing, argument) for argument in arguments(thing)}
    assert [
        word for word, given in arguments(thing).items() if OF_ARRAYS.search(given) and not SHAPE.search(of[word])
    ] == []
    assert [
        word for word, given in arguments(thing).items() if OF_NUMBERS.search(given) and not UNIT.search(of[word])
    ] == []


@pytest.mark.parametrize("name", NAMES)
def test_the_shape_or_unit_of_what_is_returned_is_told(name):
    thing = inspect.unwrap(found(name))
    if not inspect.isfunction(thing):
        return
    given, text = str(inspect.signature(thing).return_annotation), told(thing)
    assert not OF_ARRAYS.search(given) or SHAPE.search(text) or ELSEWHERE.search(text)
    assert not OF_NUMBERS.search(A_FUNCTION.sub("", given)) or UNIT.search(text) or ELSEWHERE.search(text)


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
    assert prose(SAID) == "A force."
    assert [type(block) for block in blocks(SAID)] == [str, dict, str, str]
