"""How large things show themselves: in at most ten lines of text, or as a small table in a notebook."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import fields
from html import escape
from typing import Any

import numpy as np

WIDTH = 96  # characters of a line
ROWS = 9  # below the title

Rows = list[tuple[str, str]]


class Brief:
    """A base of dataclasses (made with repr=False) and other classes that would print all that they hold.

    A class says what is worth knowing in `_title` and `_rows`; by default its name, and its fields in short.
    """

    def _title(self) -> str:
        return type(self).__name__

    def _rows(self) -> Rows:
        return [(field.name, in_short(getattr(self, field.name))) for field in fields(self)]  # type: ignore[arg-type]

    def __repr__(self) -> str:
        return as_text(self._title(), self._rows())

    def _repr_html_(self) -> str:
        cells = "".join(f"<tr><th>{escape(name)}</th><td>{escape(text)}</td></tr>" for name, text in self._rows())
        return f"<table><caption>{escape(self._title())}</caption>{cells}</table>"


def brief_tuple(named: Any) -> str:
    """The representation of a named tuple of arrays."""
    return as_text(type(named).__name__, [(name, in_short(getattr(named, name))) for name in named._fields])


def as_text(title: str, rows: Rows) -> str:
    """Name(a=1, b=2) where that fits in a line; else the title and a row each, of which the last tells what is left out."""
    line = f"{title}({', '.join(f'{name}={text}' for name, text in rows)})"
    if title.isidentifier() and len(line) <= WIDTH:
        return line
    shown = rows if len(rows) <= ROWS else [*rows[: ROWS - 1], ("...", ", ".join(name for name, _ in rows[ROWS - 1 :]))]
    margin = max((len(name) for name, _ in shown), default=0)
    return "\n".join([cut(title), *(cut(f"  {name:{margin}}  {text}") for name, text in shown)])


def cut(text: str, width: int = WIDTH) -> str:
    """The first line of a text, at most so wide."""
    first, *more = text.splitlines() or [""]
    return first if len(first) <= width and not more else first[: width - 4].rstrip() + " ..."


def listed(items: Iterable[str], width: int = WIDTH - 16) -> str:
    """Names with commas between, as many as fit, and how many more there are."""
    names, line = list(items), ""
    for k, name in enumerate(names):
        longer = f"{line}, {name}" if line else name
        if k and len(longer) > width - 16:
            return f"{line}, ... ({len(names)} in all)"
        line = longer
    return line or "none"


def numbers(values: Any) -> str:
    """(0, -9.81, 0) of a few numbers."""
    return f"({', '.join(f'{value:.6g}' for value in values)})"


def in_short(value: Any) -> str:
    """A value in at most a line: an array by its shape, several things by their names or number, a thing by its type."""
    if isinstance(value, np.ndarray):
        few = value.ndim == 1 and value.size <= 4 and value.dtype.kind in "fiu"
        return numbers(value) if few else f"{value.dtype} {value.shape}"
    if isinstance(value, (str, int, float, complex, type(None), np.generic)):
        return cut(repr(value), WIDTH // 2)
    if isinstance(value, Mapping):
        return f"{len(value)}: {listed(map(str, value))}" if value else "none"
    if isinstance(value, (tuple, list)) and not hasattr(value, "_fields"):
        return f"({listed(map(in_short, value), WIDTH // 2)})" if value else "()"
    if callable(value):
        return getattr(value, "__name__", type(value).__name__)
    name = getattr(value, "name", "")
    return f"{type(value).__name__} {name!r}" if isinstance(name, str) and name else type(value).__name__
