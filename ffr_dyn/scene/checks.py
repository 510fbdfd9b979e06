"""Guards of declarations: names are texts, points are "body.interface", several things come in a list."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from ffr_prep.common.errors import InputError


def check_name(who: str, key: str, value: Any) -> None:
    """InputError unless a field that names something is a text; it tells the name of an object that was given instead."""
    if isinstance(value, str) and value:
        return
    name = getattr(value, "name", None)
    hint = f"give its name, {name!r}" if isinstance(name, str) else "give the name of something in the scene"
    raise InputError(f"{who}: {key} is {value if value == '' else type(value).__name__!r}, not a name; {hint}")


def check_own_name(kind: str, value: Any) -> None:
    """InputError unless the name of a declaration is a text, which comes first."""
    if not isinstance(value, str):
        raise InputError(
            f"the name of a {kind} is a text and comes first, as in {kind.title()}('a', ...); it is {value!r}"
        )


def check_markers(thing: Any, who: str) -> None:
    """InputError unless the fields i and j name two different points."""
    for key in ("i", "j"):
        check_marker(who, key, getattr(thing, key))
    if thing.i == thing.j:
        raise InputError(f"{who} ties {thing.i!r} to itself: i and j are the same; it needs points of two bodies")


def check_marker(who: str, key: str, value: Any) -> None:
    """InputError unless a field is of the form "body.interface" or "ground.point"."""
    check_name(who, key, value)
    body, _, point = value.partition(".")
    if not body or not point:
        raise InputError(f"{who}: {key}, marker {value!r}: write BODY.POINT, such as 'rod.tip' or 'ground.wall'")


def several(key: str, given: Any, kinds: tuple[Any, ...]) -> tuple[Any, ...]:
    """The given things as a tuple; InputError unless they are of these kinds."""
    if isinstance(given, (str, *kinds)):
        raise InputError(
            f"{key} is {type(given).__name__} {getattr(given, 'name', given)!r} alone; give a tuple, such as (it,)"
        )
    if not isinstance(given, Iterable):
        raise InputError(f"{key} is of the type {type(given).__name__}; give a tuple")
    found = tuple(given)
    for k, one in enumerate(found):
        if not isinstance(one, kinds):
            names = ", ".join(kind.__name__ for kind in kinds)
            raise InputError(f"{key}: entry {k + 1} is of the type {type(one).__name__}; it takes: {names}")
    return found
