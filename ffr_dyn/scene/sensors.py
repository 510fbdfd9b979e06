"""Measurements that a scene names: one marker seen from another, in chosen axes; stress at a place; forces in a beam."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import KW_ONLY, dataclass

from ffr_dyn.scene.checks import check_marker, check_name, check_own_name
from ffr_prep.common.errors import InputError

Vector = tuple[float, float, float]

WHAT = ("position", "velocity", "acceleration", "distance", "orientation")


@dataclass(frozen=True)
class Measurement:
    """The motion of marker `j`, seen from marker `i` ("body.interface" or "ground.point").

    i, j : markers: j is seen from i
    what : position [m], velocity [m/s] or acceleration [m/s^2]: the difference of the two global vectors; distance [m];
           orientation: Euler parameters of j's axes in those of i
    axes : in which the difference is given: "global" or the name of a body

    Raises InputError for another word.

    >>> travel = fd.Measurement("travel", "ground.wall", "rod.tip", axes="crank")
    """

    name: str
    i: str
    j: str
    what: str = "position"
    _: KW_ONLY
    axes: str = "global"

    def __post_init__(self) -> None:
        check_own_name("measurement", self.name)
        for key in ("i", "j"):
            check_marker(f"measurement {self.name!r}", key, getattr(self, key))
        if self.what not in WHAT:
            raise InputError(f"measurement {self.name!r}: there is no {self.what!r}; there are {', '.join(WHAT)}")


@dataclass(frozen=True)
class StressMeasurement:
    """Stress or strain at the surface point of a body that is nearest to `point` [m], in the body frame.

    body : name of a flexible body
    point : in the body frame [m]; the nearest point of the surface is taken
    what : "stress" [Pa] or "strain", the six components in body axes; or one number made of them: "von-mises", "tresca",
           "max-principal", "xx", "strain-xx", ... (`ffr_dyn.scene.stress_sensors.MEASURES`)

    The body needs stress modes (`ffr-prep reduce --stress`).

    Raises InputError for a point without three coordinates, and for another `what`.

    >>> notch = fd.StressMeasurement("notch", "rod", (0.15, 0, 0.012))
    """

    name: str
    body: str
    point: Vector
    _: KW_ONLY
    what: str = "von-mises"

    def __post_init__(self) -> None:
        _check_body(self)
        object.__setattr__(self, "point", _place(self.name, self.point))


@dataclass(frozen=True)
class SectionMeasurement:
    """Section forces of the beam element nearest to `point` [m], in the body frame: what its part towards the last end exerts
    on the other.

    body : name of a flexible body with beams
    point : in the body frame [m]; the nearest beam element is taken
    what  : "force": N, Qy, Qz [N], or "moment": Mx, My, Mz [N m], in element axes
    place : in the element: "first" end, "middle" or "last" end

    The body needs section forces (`ffr-prep reduce-structure` with stress = true).

    Raises InputError for other words.

    >>> root = fd.SectionMeasurement("root", "arm", (0, 0, 0), what="moment", place="first")
    """

    name: str
    body: str
    point: Vector
    _: KW_ONLY
    what: str = "moment"
    place: str = "middle"

    def __post_init__(self) -> None:
        _check_body(self)
        object.__setattr__(self, "point", _place(self.name, self.point))
        for key, known in (("what", ("force", "moment")), ("place", ("first", "middle", "last"))):
            if getattr(self, key) not in known:
                raise InputError(
                    f"measurement {self.name!r}: {key} is {getattr(self, key)!r}; it must be one of {', '.join(known)}"
                )


def _check_body(measurement: StressMeasurement | SectionMeasurement) -> None:
    check_own_name("measurement", measurement.name)
    check_name(f"measurement {measurement.name!r}", "body", measurement.body)


def _place(name: str, point: Iterable[float]) -> Vector:
    try:
        values = [float(value) for value in point]
    except (TypeError, ValueError):
        raise InputError(f"measurement {name!r}: a point is three coordinates [m], not {point!r}") from None
    if len(values) != 3:
        raise InputError(f"measurement {name!r}: a point has three coordinates [m], not {len(values)}")
    return values[0], values[1], values[2]


AnyMeasurement = Measurement | StressMeasurement | SectionMeasurement
