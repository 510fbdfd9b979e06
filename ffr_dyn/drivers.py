"""Drivers: a joint coordinate prescribed over time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ffr_dyn.errors import InputError
from ffr_dyn.joints import COORDINATES, DOT_2, DRIVEN_ANGLE, Joint, Word, frames
from ffr_dyn.timefunction import TimeFunction


@dataclass(frozen=True)
class Driver:
    """Prescribes `coordinate` ("angle" [rad] or "stroke" [m]) of a joint as a function of time.

    The angle turns f_j from f_i towards g_i, about h_i; the stroke is the distance of j from i along h_i. A Python
    function must give (value, rate, second derivative).
    """

    name: str
    joint: str
    function: TimeFunction
    coordinate: str = "angle"


def driver_word(driver: Driver, joint: Joint) -> Word:
    """The constraint row of a driver. Raises InputError when the joint has no such coordinate."""
    if driver.coordinate not in COORDINATES[joint.kind]:
        has = ", ".join(COORDINATES[joint.kind]) or "none that can be driven"
        raise InputError(
            f"driver {driver.name!r}: the {joint.kind} joint {joint.name!r} has no coordinate "
            f"{driver.coordinate!r}; it has: {has}"
        )
    on_i, on_j = frames(joint)
    nothing = np.zeros(3)
    if driver.coordinate == "stroke":
        return Word(DOT_2, on_i[:, 2], nothing, nothing, "stroke")
    return Word(DRIVEN_ANGLE, on_i[:, 0], on_j[:, 0], on_i[:, 1], "angle")
