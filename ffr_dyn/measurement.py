"""Measurements that a scene names: one marker seen from another, in chosen axes."""

from __future__ import annotations

from dataclasses import dataclass

from ffr_dyn.errors import InputError

WHAT = ("position", "velocity", "acceleration", "distance", "orientation")


@dataclass(frozen=True)
class Measurement:
    """What marker `j` does, seen from marker `i` ("body.interface" or "ground.point").

    what : position [m], velocity [m/s] or acceleration [m/s^2]: the difference of the two global vectors; distance [m];
           orientation: Euler parameters of j's axes in those of i
    axes : in which the difference is given: "global" or the name of a body
    """

    name: str
    i: str
    j: str
    what: str = "position"
    axes: str = "global"

    def __post_init__(self) -> None:
        if self.what not in WHAT:
            raise InputError(f"measurement {self.name!r}: there is no {self.what!r}; there are {', '.join(WHAT)}")
