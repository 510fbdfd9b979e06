"""Systems of units in which other programs write matrices."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class UnitSystem:
    """The units of the numbers in a file: length [m], mass [kg], time [s]; forces follow from them."""

    length: float
    mass: float
    time: float


UNIT_SYSTEMS: Mapping[str, UnitSystem] = {
    "m-kg-s": UnitSystem(1.0, 1.0, 1.0),
    "mm-t-s": UnitSystem(1e-3, 1e3, 1.0),
    "mm-kg-s": UnitSystem(1e-3, 1.0, 1.0),
    "mm-kg-ms": UnitSystem(1e-3, 1.0, 1e-3),
    "cm-g-s": UnitSystem(1e-2, 1e-3, 1.0),
    "in-lbf-s": UnitSystem(0.0254, 4.4482216152605 / 0.0254, 1.0),
    "ft-lbf-s": UnitSystem(0.3048, 4.4482216152605 / 0.3048, 1.0),
}
