"""How a scene file gives a field of a declaration: said beside the field, `Annotated[..., In("N/m")]`.

What is said is a type (`list[int]`) or one of these; `ffr_dyn.scene_file.schema` makes the file's keys
of it. A number may always carry a unit, of any dimension where none is said here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol, TypeAlias


class Depending(Protocol):
    """A unit that other fields decide."""

    def of(self, entry: Mapping[str, Any]) -> str:
        """The unit, or several with "or" between them, from the fields of an entry that have been read so far."""
        ...


Unit: TypeAlias = str | Depending  # "1" for a plain number


@dataclass(frozen=True)
class Along:
    """One unit along a stroke, another about an angle: of the joint coordinate that the field `coordinate` names."""

    stroke: str
    angle: str

    def of(self, entry: Mapping[str, Any]) -> str:
        units = {"stroke": self.stroke, "angle": self.angle}
        return units.get(str(entry.get("coordinate")), f"{self.stroke} or {self.angle}")


COORDINATE = Along("m", "rad")
FORCE = Along("N", "N m")
STIFFNESS = Along("N/m", "N m/rad or N m")
DAMPING = Along("N s/m", "N m s/rad or N m s")
RATE = Along("m/s", "rad/s")


@dataclass(frozen=True)
class Friction:
    """A force where the field `normal` is left at 1, and else what the normal force is multiplied by."""

    def of(self, entry: Mapping[str, Any]) -> str:
        if "normal" not in entry:
            return Along("N or 1", "N m or m").of(entry)
        return (Along("N", "N m") if entry["normal"] == 1.0 else Along("1", "m")).of(entry)


COULOMB = Friction()


@dataclass(frozen=True)
class In:
    """A number in this unit."""

    unit: Unit


@dataclass(frozen=True)
class Curved:
    """A number in this unit, or a curve of a force over places in its place."""

    unit: Unit
    at: Unit
    force: Unit


@dataclass(frozen=True)
class Six:
    """Three components in one unit and three in another, or a (6, 6) matrix of them; a curve in place of a component where
    `at` says over what: its places, and the forces there, in the first unit of each pair for three components."""

    three: str
    others: str
    between: str = ""
    at: tuple[str, str] = ("", "")
    forces: tuple[str, str] = ("", "")


@dataclass(frozen=True)
class OfTime:
    """A number, a formula of t or a table."""

    unit: Unit | None = None


@dataclass(frozen=True)
class OfMotion:
    """As `OfTime`, or a formula of the motion: that part goes to the field `function` of the declaration."""

    unit: Unit | None = None


@dataclass(frozen=True)
class Three:
    """Three components, each as `of` says."""

    of: Any = float


@dataclass(frozen=True)
class OneOrMore:
    """A number, or a list of numbers, as `of` says."""

    of: In


@dataclass(frozen=True)
class Direction:
    """Three numbers, or a frame of three such columns."""


@dataclass(frozen=True)
class PerMode:
    """(n,) numbers, one for each elastic coordinate of the field `body`: they change with its basis."""
