"""The front door of a package: its public names, each loaded when it is first used (PEP 562).

What is called through it, and fails for an argument of another type than its annotation, or for one that is missing or that
there is not, says so by an InputError. They are looked at after the failure only: what works is none of the door's business,
and costs nothing. Flags are looked at before: any value is true or false, so that a wrong one, as check="no", never fails.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import fields, is_dataclass
from difflib import get_close_matches
from functools import wraps
from importlib import import_module
from inspect import Parameter, isclass, isfunction, signature
from numbers import Integral, Real
from os import PathLike
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

from ffr_prep.common.errors import ComputationError, InputError

_SHOWN = 60  # letters of a value in a message
_FLAGS = (bool, "bool", "bool | None")  # annotations
_TRUTHS = ("bool", "bool_", "NoneType")  # types, NumPy's as well, which is not loaded here


def front_door(
    package: str, by_module: Mapping[str, str]
) -> tuple[list[str], Callable[[str], Any], Callable[[], list[str]]]:
    """`__all__`, `__getattr__` and `__dir__` of a package: the names in `by_module` (module -> names) and `__version__`."""
    module_of = {name: module for module, names in by_module.items() for name in names.split()}
    public = ["__version__", *module_of]

    def loaded(name: str) -> Any:
        if name == "__version__":
            from importlib.metadata import version

            value: Any = version("ffr")
        elif name in module_of:
            value = _guarded(getattr(import_module(module_of[name]), name), package)
        else:
            close = get_close_matches(name, public, 1)
            hint = f"did you mean {close[0]!r}?" if close else f"dir({package}) lists what there is"
            raise AttributeError(f"module {package!r} has no attribute {name!r}; {hint}", name=name)
        setattr(sys.modules[package], name, value)
        return value

    return public, loaded, lambda: sorted(public)


# ---- arguments of another type ------------------------------------------------------------------------------------


def _guarded(thing: Any, package: str) -> Any:
    """A function that explains wrong types; a class stays itself, so that it is one class for everyone."""
    if isfunction(thing):
        call = _explaining(thing, thing.__name__)
        call.__module__ = package  # where pickle finds it
        return call
    own = vars(thing).get("__init__") if isclass(thing) else None
    if isfunction(own) and not hasattr(own, "__wrapped__"):
        thing.__init__ = _explaining(own, thing.__name__)
    return thing


def _explaining(function: Callable[..., Any], name: str) -> Callable[..., Any]:
    flags = [(k, one.name) for k, one in enumerate(signature(function).parameters.values()) if one.annotation in _FLAGS]

    @wraps(function)
    def call(*args: Any, **named: Any) -> Any:
        for k, flag in flags:
            value = args[k] if k < len(args) else named.get(flag)
            if type(value).__name__ not in _TRUTHS:
                raise InputError(
                    f"{name}: {flag} is {_shown(value)}, of the type {type(value).__name__}; give True or False"
                )
        try:
            return function(*args, **named)
        except (InputError, ComputationError):
            raise
        except Exception as error:
            wrong = _unbound(function, args, named) or _misfit(function, args, named)
            if wrong is None:
                raise
            raise InputError(f"{name}: {wrong}") from error

    return call


def _unbound(function: Callable[..., Any], args: tuple[Any, ...], named: Mapping[str, Any]) -> str | None:
    """What is missing, or is no argument of a function, in words; None where all can be given so."""
    with suppress(TypeError):
        signature(function).bind(*args, **named)
        return None
    every = signature(function).parameters.values()
    kinds, several = {one.kind for one in every}, (Parameter.VAR_POSITIONAL, Parameter.VAR_KEYWORD)
    places = [one.name for one in every if one.kind in (one.POSITIONAL_ONLY, one.POSITIONAL_OR_KEYWORD)]
    names = [one.name for one in every if one.kind not in several and one.name != "self"]
    unknown = [key for key in named if key not in names]
    if unknown and Parameter.VAR_KEYWORD not in kinds:
        return f"there is no argument {unknown[0]!r}; {_meant(function, unknown[0], names)}"
    if len(args) > len(places) and Parameter.VAR_POSITIONAL not in kinds:
        known, free = [name for name in places if name != "self"], [n for n in names if n not in {*places, *named}]
        value, only = _shown(args[len(places)]), f", as only {_listed(known)} may be" if known else ""
        return f"{value} is given without its name{only}" + (
            f"; write {free[0]}={value} if that is meant" if free else ""
        )
    if twice := next((name for name in places[: len(args)] if name in named), None):
        return f"{twice} is given twice, by its place and by its name"
    given = {*places[: len(args)], *named}
    missing = [one.name for one in every if one.name in names and one.default is one.empty and one.name not in given]
    return (
        f"{_listed(missing)} {'is' if len(missing) == 1 else 'are'} missing; give {missing[0]}=..." if missing else None
    )


def _meant(function: Callable[..., Any], key: str, names: list[str]) -> str:
    """A hint at the argument that was meant, or at the settings among the arguments that have it."""
    if close := get_close_matches(key, names, 1):
        return f"did you mean {close[0]!r}?"
    with suppress(NameError):
        for name, hint in get_type_hints(function).items():
            for one in get_args(hint) or (hint,):
                if name in names and is_dataclass(one) and isclass(one) and key in {f.name for f in fields(one)}:
                    return f"{one.__name__} has it: {name}={one.__name__}({key}=...)"
    return f"there is {_listed(names)}" if len(names) < 2 else f"there are {_listed(names)}"


def _listed(names: list[str]) -> str:
    *others, last = names or ["none"]
    return f"{', '.join(others)} and {last}" if others else last


def _misfit(function: Callable[..., Any], args: tuple[Any, ...], named: Mapping[str, Any]) -> str | None:
    """The first argument that is of another type than its annotation, in words; None where all fit."""
    try:
        given, hints = signature(function).bind(*args, **named), get_type_hints(function)
    except (TypeError, NameError):
        return None
    for key, hint in hints.items():
        for name, value in _named(given.signature.parameters.get(key), given.arguments):
            if not _fits(value, hint):
                return f"{name} is {_shown(value)}, of the type {type(value).__name__}; give {_in_words(hint)}"
    return None


def _shown(value: Any) -> str:
    shown = repr(value)
    return shown if len(shown) <= _SHOWN else f"{shown[:_SHOWN]}..."


def _named(parameter: Parameter | None, given: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """The values given for a parameter with the names that they have in the call."""
    if parameter is None or parameter.name not in given:
        return
    value = given[parameter.name]
    if parameter.kind is Parameter.VAR_POSITIONAL:
        yield from ((f"{parameter.name}[{k}]", one) for k, one in enumerate(value))
    elif parameter.kind is Parameter.VAR_KEYWORD:
        yield from value.items()
    else:
        yield parameter.name, value


def _fits(value: Any, hint: Any) -> bool:
    """Whether a value may be meant for an annotation; what is not known here fits."""
    origin, of = get_origin(hint), get_args(hint)
    if _of_numbers(hint):
        return _is_array(value)
    if origin in (Union, UnionType):
        return any(_fits(value, one) for one in of)
    if origin is Literal:
        return isinstance(value, str | int) and value in of
    if origin is tuple and of[-1] is not ...:
        items = _items(value)
        return items is not None and len(items) == len(of) and all(map(_fits, items, of))
    if isclass(origin) and issubclass(origin, Mapping):
        return isinstance(value, Mapping) and all(_fits(k, of[0]) and _fits(v, of[1]) for k, v in value.items())
    if isclass(origin) and issubclass(origin, Iterable):
        return isinstance(value, Iterable) and not isinstance(value, str | bytes | Mapping) and _all_fit(value, of[0])
    if origin is type or (isinstance(hint, TypeVar) and hint.__bound__ is not None):
        return isclass(value)
    return _is_one(value, _WIDER.get(hint, origin or hint))


_WIDER: dict[Any, Any] = {float: Real, int: Integral, Path: str | PathLike}  # what is taken where this is asked for


def _is_one(value: Any, kind: Any) -> bool:
    try:
        return isinstance(value, kind) or (kind in (Real, Integral) and getattr(value, "shape", None) == ())
    except TypeError:  # what cannot be asked, of which protocols tell what they want
        wanted = vars(kind).keys() if getattr(kind, "_is_protocol", False) else ()
        return all(hasattr(value, name) for name in wanted if not name.startswith("_"))


def _items(value: Any) -> list[Any] | None:
    return list(value) if isinstance(value, Collection) and not isinstance(value, str | bytes | Mapping) else None


def _all_fit(value: Iterable[Any], hint: Any) -> bool:
    """Of what can be iterated again."""
    return all(_fits(one, hint) for one in _items(value) or ())


def _of_numbers(hint: Any) -> bool:
    """Whether an annotation is that of an array, or of what NumPy makes one of."""
    from numpy import ndarray
    from numpy.typing import ArrayLike

    return bool(hint is ndarray or hint == ArrayLike)


def _is_array(value: Any) -> bool:
    from numpy import asarray

    if isinstance(value, str | bytes | Mapping | NoneType | Real):
        return False
    if hasattr(value, "shape"):
        return True
    try:
        return asarray(value).dtype.kind in "biufc"
    except (TypeError, ValueError):
        return False


def _in_words(hint: Any) -> str:
    """What an annotation asks for."""
    origin, of = get_origin(hint), get_args(hint)
    if _of_numbers(hint):
        return "an array of numbers"
    if origin in (Union, UnionType):
        return " or ".join(dict.fromkeys(_in_words(one) for one in of))
    if origin is Literal:
        return " or ".join(map(repr, of))
    if origin is tuple and of[-1] is not ...:
        return f"({', '.join(map(_in_words, of))})"
    if isclass(origin) and issubclass(origin, Mapping):
        return f"a dict from {_in_words(of[0])} to {_in_words(of[1])}"
    if isclass(origin) and issubclass(origin, Iterable):
        return f"a tuple, each of it {_in_words(of[0])}"
    if isinstance(hint, TypeVar):
        return "a class"
    if hint in _WORDS:
        return _WORDS[hint]
    if (origin or hint) is Callable:
        return "a function"
    name = getattr(origin or hint, "__name__", str(hint))
    return f"{'an' if name[0] in 'AEIOUaeiou' else 'a'} {name}"


_WORDS = {
    float: "a number",
    int: "a whole number",
    str: "a text",
    bool: "True or False",
    Path: "a path",
    NoneType: "None",
    Any: "something else",
}
