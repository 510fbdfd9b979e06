"""How a scene file gives a field of a declaration: said beside the field, `Annotated[..., In("N/m")]`.

What is said is a type (`list[int]`, `list[float | Curve]`) or one of these; `ffr_dyn.scene_file.schema` makes the file's keys
of it. A number may always carry a unit, of any dimension where none is said here.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class In:
    """A number in this unit; a curve in its place where the type of the field allows one."""

    unit: str


@dataclass(frozen=True)
class OfTime:
    """A number, a formula of t or a table."""

    unit: str | None = None


@dataclass(frozen=True)
class OfMotion:
    """As `OfTime`, or a formula of the motion: that part goes to the field `function` of the declaration."""

    unit: str | None = None


@dataclass(frozen=True)
class Three:
    """Three components, each as `of` says."""

    of: Any = float


@dataclass(frozen=True)
class Direction:
    """Three numbers, or a frame of three such columns."""


@dataclass(frozen=True)
class PerMode:
    """(n,) numbers, one for each elastic coordinate of the field `body`: they change with its basis."""
