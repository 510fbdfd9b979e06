"""Vectors, extents and settings as a reader sees them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ffr_prep.common.arrays import Array

_NOISE = 1e-6


def vector_in_words(vector: Array, size: float = 0.0) -> str:
    """(x, y, z) to five digits; parts below a millionth of the largest, or of a size, are zero."""
    shown = np.where(np.abs(vector) < _NOISE * max(np.abs(vector).max(), size), 0.0, vector) + 0.0
    return "(" + ", ".join(f"{x:.5g}" for x in shown) + ")"


def extent_in_words(points: Array) -> str:
    """The lengths of the box around points (N, 3) [m]."""
    return f"{vector_in_words(np.ptp(points, axis=0))} m" if len(points) else ""


def percent_in_words(share: float) -> str:
    """A share of one to two digits, and to all before the point: 120 %, 0.036 %."""
    percent = 100 * abs(share)
    if percent < 1e-4:
        return "less than 0.0001 %"
    return f"{percent:.0f} %" if percent >= 10 else f"{percent:.2g} %"


def settings_in_words(value: Any) -> str:
    """Nested settings in one line; what has a name by it, and the rest in brackets."""
    if isinstance(value, Mapping) and "type" in value and "name" in value:
        rest = settings_in_words({k: v for k, v in value.items() if k not in ("type", "name")})
        return f"{value['name']} ({rest})" if rest else str(value["name"])
    if isinstance(value, Mapping):
        words = [f"{k} {settings_in_words(v)}" for k, v in value.items() if k != "type" and v not in (None, {}, [])]
        return " ".join([*([value["type"]] if "type" in value else []), ", ".join(words)]).strip()
    if isinstance(value, list):
        return "(" + ", ".join(map(settings_in_words, value)) + ")"
    return f"{value:g}" if isinstance(value, float) else str(value)
