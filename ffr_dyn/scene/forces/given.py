"""Components of forces that are given: numbers, or functions of time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ffr_dyn.scene.forces.force import LoadTable
from ffr_prep.common.errors import InputError


def given_numbers(components: Sequence[Any], who: str, table: LoadTable) -> list[float]:
    """A factor for each component, then their functions of time or -1 (see `ffr_dyn.scene.forces.force.Force.given`)."""
    factors, functions = [], []
    for component in components:
        plain = is_number(component)
        if plain and not np.isfinite(component):
            raise InputError(f"{who}: a component is {component}; all must be finite")
        factors.append(float(component) if plain else 1.0)
        functions.append(-1.0 if plain else float(table.function(component)))
    return [*factors, *functions]


def is_number(component: object) -> bool:
    """Whether a component is no function."""
    return isinstance(component, (int, float, np.floating, np.integer))
