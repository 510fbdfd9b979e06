"""Couplings: relations between the coordinates of two joints, such as gears, racks and belts."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass

import numpy as np

from ffr_dyn.functions.time_functions import constant
from ffr_dyn.scene.checks import check_name, check_own_name
from ffr_dyn.scene.joints import COORDINATES, Joint, Word, frames, relation
from ffr_prep.common.errors import InputError


@dataclass(frozen=True)
class Coupling:
    """second = ratio * first + offset, of two joint coordinates "joint.angle" [rad] or "joint.stroke" [m].

    Outer gears of z1 and z2 teeth have the ratio -z1/z2 when both angles are measured from one carrier, a rack on a pinion
    the pitch radius [m]. Angles may turn any number of times.

    Raises InputError for a ratio that is zero or not finite.

    first, second : joint coordinates, "joint.angle" or "joint.stroke"
    ratio : of the second to the first, not zero: [1], [m], or [1/m]
    offset : of the second where the first is zero [rad] or [m]

    >>> gear = fd.Coupling("gear", "pinion.angle", "wheel.angle", ratio=-20 / 40)
    """

    name: str
    first: str
    second: str
    ratio: float
    _: KW_ONLY
    offset: float = 0.0

    def __post_init__(self) -> None:
        check_own_name("coupling", self.name)
        for key in ("first", "second"):
            check_name(f"coupling {self.name!r}", key, getattr(self, key))
        if self.first == self.second:
            raise InputError(f"coupling {self.name!r} couples {self.first!r} to itself: name another joint coordinate")
        if not (np.isfinite([self.ratio, self.offset]).all() and self.ratio != 0):
            raise InputError(
                f"coupling {self.name!r}: ratio {self.ratio} and offset {self.offset} must be finite, the ratio not zero"
            )


def coupled(coupling: Coupling) -> tuple[tuple[str, str], tuple[str, str]]:
    """(joint, coordinate) of the first and of the second; InputError for a name without a coordinate."""
    parts = [name.rpartition(".") for name in (coupling.first, coupling.second)]
    for joint, _, coordinate in parts:
        if not joint or coordinate not in ("angle", "stroke"):
            raise InputError(
                f"coupling {coupling.name!r}: write joint coordinates as 'joint.angle' or 'joint.stroke', not "
                f"{coupling.first!r} and {coupling.second!r}"
            )
    return (parts[0][0], parts[0][2]), (parts[1][0], parts[1][2])


def coupling_word(coupling: Coupling, first: Joint, second: Joint) -> Word:
    """The constraint row; InputError when a joint has no such coordinate or the ratio cannot be held over turns."""
    kinds = [coordinate for _, coordinate in coupled(coupling)]
    for joint, kind in zip((first, second), kinds, strict=True):
        if kind not in COORDINATES[joint.kind]:
            raise InputError(
                f"coupling {coupling.name!r}: the {joint.kind} joint {joint.name!r} has no coordinate {kind!r}"
            )
    one, other = (-coupling.ratio, kinds[0], *frames(first)), (1.0, kinds[1], *frames(second))
    try:
        return relation(one, other, f"{coupling.second} follows {coupling.first}", constant(coupling.offset))
    except InputError as error:
        raise InputError(f"coupling {coupling.name!r}: {error}") from None
