"""The two ways in which a call can fail. The command line turns them into exit codes 2 and 1."""

from __future__ import annotations

from typing import Any


class InputError(ValueError):
    """Input that cannot be used. The message names the thing, its value and the remedy.

    >>> try: rod = fd.load_body("rod.ffr")
    ... except fd.InputError as error: print(error)
    """


class ComputationError(RuntimeError):
    """The input was acceptable but the computation failed. The message says where, how far off and what to try.

    >>> try: result = fd.static(scene)
    ... except fd.ComputationError as error: print(error)
    """


def require_kind(given: object, kind: Any, what: str, such: str) -> None:
    """Raises InputError unless it is of a type, or one of a union."""
    if not isinstance(given, kind):
        raise InputError(f"{what} is of the type {type(given).__name__}; give {such}")
