"""Drivers: motion prescribed over time, of a joint coordinate or of a point."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from typing import Any

import numpy as np

from ffr_dyn.functions.time_functions import as_time_function
from ffr_dyn.scene.checks import check_markers, check_name, check_own_name
from ffr_dyn.scene.joints import COINCIDENCE, COORDINATES, DOT_2, DRIVEN_ANGLE, Joint, Word, frames, word
from ffr_prep.common.errors import InputError


@dataclass(frozen=True)
class Driver:
    """Prescribes `coordinate` ("angle" [rad] or "stroke" [m]) of a joint as a function of time.

    joint : name of the joint
    coordinate : "angle" or "stroke"
    function : a number, a time function, or a Python function that gives (value, rate, second derivative)

    The angle turns f_j from f_i towards g_i, about h_i; the stroke is the distance of j from i along h_i.

    Raises InputError for a function that is none of these.

    >>> motor = fd.Driver("motor", "hinge", fd.polynomial(0, 150))  # 150 rad/s
    """

    name: str
    joint: str
    function: Any
    _: KW_ONLY
    coordinate: str = "angle"

    def __post_init__(self) -> None:
        check_own_name("driver", self.name)
        check_name(f"driver {self.name!r}", "joint", self.joint)
        made = as_time_function(self.function, f"driver {self.name!r}: its function")
        object.__setattr__(self, "function", made)


@dataclass(frozen=True)
class PointDriver:
    """Prescribes where marker `j` is, seen from marker `i`: components of r_j - r_i in global axes [m] over time.

    i, j : markers; j is the one that is moved
    x, y, z : numbers, time functions or Python functions that give (value, rate, second derivative); None leaves a
              component free

    Raises InputError when all are free.

    >>> path = fd.PointDriver("path", "ground.wall", "slider.pin", x=fd.harmonic(amplitude=0.01, frequency=5.0))
    """

    name: str
    i: str
    j: str
    _: KW_ONLY
    x: Any = None
    y: Any = None
    z: Any = None

    def __post_init__(self) -> None:
        check_own_name("driver", self.name)
        check_markers(self, f"driver {self.name!r}")
        if self.x is None and self.y is None and self.z is None:
            raise InputError(f"driver {self.name!r} prescribes nothing: give x, y or z as a function of time")


def driver_word(driver: Driver, joint: Joint) -> Word:
    """The constraint row of a driver. Raises InputError when the joint has no such coordinate."""
    if driver.coordinate not in COORDINATES[joint.kind]:
        has = ", ".join(COORDINATES[joint.kind]) or "none that can be driven"
        raise InputError(
            f"driver {driver.name!r}: the {joint.kind} joint {joint.name!r} has no coordinate "
            f"{driver.coordinate!r}; it has: {has}"
        )
    on_i, on_j = frames(joint)
    if driver.coordinate == "stroke":
        return word(DOT_2, "stroke", on_i[:, 2], function=driver.function)
    return word(DRIVEN_ANGLE, "angle", on_i[:, 0], on_j[:, 0], on_i[:, 1], function=driver.function)


def path_words(driver: PointDriver) -> list[Word]:
    """The constraint rows of a driven point: one for each prescribed component."""
    given = zip("xyz", (driver.x, driver.y, driver.z), strict=True)
    return [
        word(
            COINCIDENCE,
            f"{axis} of the point",
            np.array([float("xyz".index(axis)), 0.0, 0.0]),
            function=as_time_function(value, f"driver {driver.name!r}: {axis}"),
        )
        for axis, value in given
        if value is not None
    ]
