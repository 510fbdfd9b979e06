"""Things in a few lines: what `repr` says of bodies, meshes and models, and a notebook shows."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from html import escape
from typing import Any

import numpy as np

from ffr_prep.common.arrays import Array

_WIDTH = 98  # ten lines stay below a thousand characters
_NOISE = 1e-6


def in_brief(title: str, facts: Mapping[str, str]) -> str:
    """The title and a line for each fact that is not empty; long lines are cut."""
    lines = [title, *(f"  {key:12}{text}" for key, text in facts.items() if text)]
    return "\n".join(line if len(line) <= _WIDTH else line[: _WIDTH - 4] + " ..." for line in lines)


def as_table(title: str, facts: Mapping[str, str]) -> str:
    """The same as a table of HTML."""
    rows = "".join(f"<tr><th>{escape(key)}</th><td>{escape(text)}</td></tr>" for key, text in facts.items() if text)
    return f"<table><caption>{escape(title)}</caption>{rows}</table>"


def listed(names: Iterable[str], most: int = 6) -> str:
    """Names with commas between them; of many the first, and how many more there are."""
    every = list(names)
    more = f" and {len(every) - most} more" if len(every) > most else ""
    return ", ".join(every[:most]) + more


def vector_in_words(vector: Array, size: float = 0.0) -> str:
    """(x, y, z) to five digits; parts below a millionth of the largest, or of a size, are zero."""
    shown = np.where(np.abs(vector) < _NOISE * max(np.abs(vector).max(), size), 0.0, vector) + 0.0
    return "(" + ", ".join(f"{x:.5g}" for x in shown) + ")"


def extent_in_words(points: Array) -> str:
    """The lengths of the box around points (N, 3) [m]."""
    return f"{vector_in_words(np.ptp(points, axis=0))} m" if len(points) else ""


def settings_in_words(value: Any) -> str:
    """Nested settings in one line."""
    if isinstance(value, Mapping):
        words = [f"{k} {settings_in_words(v)}" for k, v in value.items() if k != "type" and v not in (None, {}, [])]
        return " ".join([*([value["type"]] if "type" in value else []), ", ".join(words)]).strip()
    if isinstance(value, list):
        return "(" + ", ".join(map(settings_in_words, value)) + ")"
    return f"{value:g}" if isinstance(value, float) else str(value)
