"""The front door of a package: its public names, each loaded when it is first used (PEP 562).

What is called through it, and fails for an argument of another type than its annotation, says so by an InputError. The
types are looked at after the failure only: what works is none of the door's business, and costs nothing. Flags are looked
at before: any value is true or false, so that a wrong one, as check="no", never fails.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
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
            from difflib import get_close_matches

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
            wrong = _misfit(function, args, named)
            if wrong is None:
                raise
            raise InputError(f"{name}: {wrong}") from error

    return call


def _misfit(function: Callable[..., Any], args: tuple[Any, ...], named: Mapping[str, Any]) -> str | None:
    """The first argument that is of another type than its annotation, in words; None where all fit, or some are missing."""
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
