"""A spring and damper between two markers."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Annotated

from ffr_dyn.functions.curves import Curve
from ffr_dyn.scene.fields import Curved, In
from ffr_dyn.scene.force_kinds import register_force
from ffr_dyn.scene.forces.checks import check_damping, check_number, check_number_or_curve
from ffr_dyn.scene.forces.places import AlongLine
from ffr_dyn.scene.forces.spring_law import Spring
from ffr_prep.common.errors import InputError

if TYPE_CHECKING:
    from ffr_dyn.scene.scene import Scene


@register_force
@dataclass(frozen=True)
class SpringDamper(Spring):
    """Force along the line i - j, positive in tension: stiffness (l - free_length) + damping dl/dt + preload.

    stiffness : [N/m], or a `Curve` of the force [N] over l - free_length [m]
    damping   : [N s/m], not negative, or a `Curve` of the force [N] over dl/dt [m/s]
    free_length : length without force [m], not negative; not given, it is zero, which a note tells of a spring with a
        stiffness
    preload : tension at that length [N]
    i, j : its two markers

    While both points are at one place the force has no direction, and is zero.

    Raises InputError for a spring between a marker and itself.

    >>> spring = fd.SpringDamper("return", "ground.wall", "rod.tip", stiffness=2000.0, damping=5.0, free_length=0.2)
    """

    table = "springs"
    word = ""
    acts = "along the line of two markers: k (l − free_length) + d l̇ + preload"
    positive = "tension"

    name: str
    i: str
    j: str
    stiffness: Annotated[float | Curve, Curved("N/m", "m", "N")]
    damping: Annotated[float | Curve, Curved("N s/m", "m/s", "N")] = 0.0
    free_length: Annotated[float | None, In("m")] = None
    preload: Annotated[float, In("N")] = 0.0

    def __post_init__(self) -> None:
        who = f"spring {self.name!r}"
        check_number_or_curve(self.stiffness, f"{who}: stiffness")
        check_damping(self.damping, f"{who}: damping")
        check_number(self.slack, f"{who}: free_length", least=0.0)
        check_number(self.preload, f"{who}: preload")
        if self.i == self.j:
            raise InputError(f"{who} has length zero: both its ends are at {self.i!r}")

    @cached_property
    def place(self) -> AlongLine:
        return AlongLine(self.i, self.j)

    @property
    def slack(self) -> float:
        return 0.0 if self.free_length is None else self.free_length

    def doubts(self, scene: Scene) -> tuple[str, ...]:
        if self.free_length is not None or self.stiffness == 0:
            return ()
        return (
            f"spring {self.name!r} has no free_length, so it pulls with its stiffness times all of its length: give the "
            "length that it has without force, or free_length = 0 where that is meant",
        )
