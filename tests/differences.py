"""Derivatives by differences."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

_STEPS, _WEIGHTS = (1, 2, 3, 4), (4 / 5, -1 / 5, 4 / 105, -1 / 280)


def difference(function: Callable[[float], Any], h: float = 2e-3) -> Any:
    """The derivative at zero, of order eight."""
    return sum(w * (function(k * h) - function(-k * h)) for k, w in zip(_STEPS, _WEIGHTS, strict=True)) / h
