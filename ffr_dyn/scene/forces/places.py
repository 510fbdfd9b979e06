"""Where forces act: at a marker, along a line, on a joint coordinate, between axes, on a body.

The law of a force is a function of the place's coordinates and their rates; forces along them do the virtual work
F delta(c), so that F dc/dt is the power on rigid and flexible bodies alike:

    AtMarker     no coordinates; the law gives force and moment (6,) in the axes of the place
    AlongLine    c the distance of two points; F positive where it drives them apart
    OnJoint      c the angle or stroke of a joint, as its drivers measure it; F positive where it increases it. The
                 reaction acts on the body of i. An angle counts whole turns, from `turns` at the start (0: the start is
                 taken between minus half and half a turn). The count is carried from step to step, as the whole turn nearest
                 to the last accepted state; a step must therefore turn a joint by less than half a turn. Evaluating a state
                 never changes the count
    BetweenAxes  c (6,) the displacement of j from i in axes on i, and the rotation vector from these to the axes on j
    OnBody       c (n,) the elastic coordinates; the law gives generalised forces [F, M, Q] (6 + n,) in body axes
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from ffr_dyn.functions.rotation import rotation_matrix
from ffr_dyn.scene.joints import Joint, coordinate_axes, frames
from ffr_dyn.scene.scene import (
    Body,
    Scene,
    body_normal,
    body_number,
    joint_with,
    marker_number,
    markers,
    undeformed,
)
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError

LEVEL = 5e-10  # m, that points of a plane may be apart along its normal
COORDINATE, RATE, FORCE = range(3)  # columns recorded of a force on one coordinate
SIX = slice(12, 18)  # those of the force on six coordinates


@dataclass(frozen=True)
class Measured:
    """A number, or three, that a result keeps of a force: `sign` times the recorded ones from `column` on."""

    name: str
    unit: str
    text: str
    column: int
    size: int = 1
    sign: float = 1.0


FORCE_AND_MOMENT = (
    Measured("force", "N", "force, in the axes of the load", 0, 3),
    Measured("moment", "N m", "moment, in the axes of the load", 3, 3),
)
FACTOR = (Measured("factor", "1", "function of time by which the load is multiplied", 0),)
_ON_LINE = (
    Measured("tension", "N", "spring-damper force, tension positive", FORCE, sign=-1.0),
    Measured("length", "m", "distance of the ends", COORDINATE),
)
_SIX = (
    Measured("displacement", "m", "displacement of j from i, axes of the bushing on i", 0, 3),
    Measured("rotation", "rad", "rotation vector from the axes of i to those of j", 3, 3),
    Measured("force", "N", "force of the bushing on j, axes of the bushing on i", 12, 3),
    Measured("moment", "N m", "moment of the bushing on j, conjugate to the rotation vector", 15, 3),
)
_ON_JOINT = {
    "angle": (
        Measured("torque", "N m", "torque that increases the joint angle", FORCE),
        Measured("angle", "rad", "joint angle with whole turns, as the force counts them", COORDINATE),
    ),
    "stroke": (
        Measured("force", "N", "force that increases the joint stroke", FORCE),
        Measured("stroke", "m", "joint stroke along its axis", COORDINATE),
    ),
}


def effort(joint: Joint, coordinate: str, quantity: str, factor: float = 1.0) -> dict[str, Any]:
    """What is drawn of a force or torque that increases a joint coordinate: it acts on the body of j (`Place.drawn`)."""
    along = factor * frames(joint)[0][:, 2]
    unit = "N m" if coordinate == "angle" else "N"
    return {"of": quantity, "unit": unit, "at": joint.j, "body": joint.i.partition(".")[0], "along": along.tolist()}


class Place(ABC):
    """Where a force acts: what its law is a function of, and what it works on.

    way      : which of several such coordinates or axes, a word of `ffr_dyn.kernels.tables.WAYS`
    rank     : forces of lower rank are applied first, equal ones as declared
    initial  : what is recorded of a force there, as it is before the start
    measured : how a result names it
    """

    rank: ClassVar[int] = 0

    @property
    @abstractmethod
    def way(self) -> str: ...

    @property
    def initial(self) -> tuple[float, ...]:
        return ()

    @property
    def measured(self) -> tuple[Measured, ...]:
        return ()

    @abstractmethod
    def markers(self, scene: Scene) -> tuple[str, ...]:
        """Names of the markers on which it acts."""

    def ends(self, scene: Scene) -> tuple[int, int]:
        """Numbers of its markers, -1 for what is none; or the number of its body."""
        i, j = [*(marker_number(scene, name) for name in self.markers(scene)), -1][:2]
        return i, j

    def check(self, scene: Scene) -> None:
        """InputError when the scene has no such place."""
        self.ends(scene)

    def numbers(self, scene: Scene) -> list[float]:
        """The numbers of the place in compiled code, such as axes."""
        return []

    def drawn(self, scene: Scene) -> dict[str, Any]:
        """What a picture needs beside the markers, in JSON values.

        axes    : "global" or "body", in which a result keeps `force` and `moment`
        efforts : what acts on a marker `at`: the quantity `of` in `unit`, times the vector `along`, or in the axes `along`
                  (three vectors), given in axes of `body`
        """
        return {}

    def stays_in_plane(self, scene: Scene, normal: int) -> bool:
        """Whether what acts there, whatever its size, moves bodies only in the plane across the global axis `normal`."""
        return False


@dataclass(frozen=True)
class AtMarker(Place):
    """A marker; axes "global", or "body" for those of its body.

    measured : what a result keeps of the force and the moment there, six numbers in these axes

    >>> place = fd.AtMarker("rod.tip", axes="body")
    """

    initial = (0.0,) * 6

    marker: str
    axes: str = "global"
    measured: tuple[Measured, ...] = ()

    @property
    def way(self) -> str:
        return self.axes

    def markers(self, scene: Scene) -> tuple[str, ...]:
        return (self.marker,)

    def drawn(self, scene: Scene) -> dict[str, Any]:
        return {"axes": self.axes}

    def axis_along(self, scene: Scene, normal: int) -> int:
        """Which of its axes is along the global axis `normal`."""
        b = self.ends(scene)[0]
        return body_normal(scene.bodies[b], normal) if b < len(scene.bodies) and self.axes == "body" else normal


@dataclass(frozen=True)
class AlongLine(Place):
    """The line between two markers; without direction, and without force, while both points are at one place.

    >>> place = fd.AlongLine("ground.wall", "rod.tip")  # the property `place` of a force of one's own
    """

    way = "length"
    initial = (0.0, 0.0, 0.0)
    measured = _ON_LINE

    i: str
    j: str

    def markers(self, scene: Scene) -> tuple[str, ...]:
        return self.i, self.j

    def stays_in_plane(self, scene: Scene, normal: int) -> bool:
        i, j = (undeformed(scene, number)[normal] for number in self.ends(scene))
        return bool(abs(i - j) <= LEVEL)


@dataclass(frozen=True)
class OnJoint(Place):
    """The `angle` [rad] or `stroke` [m] of a joint, for the force `who`; turns : whole turns of the angle at the start.

    Raises InputError for another coordinate, and for turns that are no whole number, or are given for a stroke.

    >>> place = fd.OnJoint("spring", "hinge", "angle")
    """

    who: str
    joint: str
    coordinate: str = "angle"
    turns: int = 0

    def __post_init__(self) -> None:
        if self.coordinate not in _ON_JOINT:
            raise InputError(f"{self.who}: coordinate must be 'angle' or 'stroke', not {self.coordinate!r}")
        if self.turns != int(self.turns) or (self.turns and self.coordinate == "stroke"):
            raise InputError(f"{self.who}: turns is {self.turns}; it must be a whole number, and zero for a stroke")

    @property
    def way(self) -> str:
        return self.coordinate

    @property
    def initial(self) -> tuple[float, ...]:
        return 2 * np.pi * self.turns, 0.0, 0.0

    @property
    def measured(self) -> tuple[Measured, ...]:
        return _ON_JOINT[self.coordinate]

    def of(self, scene: Scene) -> Joint:
        """The joint. Raises InputError when it is none, or has no such coordinate."""
        return joint_with(scene, self.joint, self.coordinate, self.who)

    def markers(self, scene: Scene) -> tuple[str, ...]:
        joint = self.of(scene)
        return joint.i, joint.j

    def drawn(self, scene: Scene) -> dict[str, Any]:
        return {"efforts": [effort(self.of(scene), self.coordinate, self.measured[0].name)]}

    def axes(self, scene: Scene) -> Array:
        """(3, 3) f_i, g_i, f_j of an angle, or h_i of a stroke, in body axes."""
        return np.array(coordinate_axes(self.coordinate, *frames(self.of(scene))))

    def numbers(self, scene: Scene) -> list[float]:
        return list(self.axes(scene).ravel())

    def stays_in_plane(self, scene: Scene, normal: int) -> bool:
        """An angle about the normal, a stroke across it."""
        joint = self.of(scene)
        b = markers(scene)[marker_number(scene, joint.i)][0]
        axis = frames(joint)[0][:, 2]
        if b < len(scene.bodies):
            axis = rotation_matrix(scene.bodies[b].rotation) @ axis
        along = abs(axis[normal])
        return bool(along > 1 - 1e-12 if self.coordinate == "angle" else along < 1e-9)


@dataclass(frozen=True)
class BetweenAxes(Place):
    """Markers of two bodies, with axes in columns on both, on_i (3, 3) and on_j (3, 3), for the force `who`.

    >>> place = fd.BetweenAxes("mount", "ground.wall", "rod.hinge", np.eye(3), np.eye(3))
    """

    way = "six"
    rank = 1
    initial = (0.0,) * 18
    measured = _SIX

    who: str
    i: str
    j: str
    on_i: Array = field(repr=False)
    on_j: Array = field(repr=False)

    def check(self, scene: Scene) -> None:
        i, j = (markers(scene)[number] for number in self.ends(scene))
        if i[0] == j[0]:
            raise InputError(f"{self.who} ties {i[1]!r} to itself; it needs markers of two bodies")

    def markers(self, scene: Scene) -> tuple[str, ...]:
        return self.i, self.j

    def drawn(self, scene: Scene) -> dict[str, Any]:
        there = {"at": self.j, "body": self.i.partition(".")[0], "along": self.on_i.T.tolist()}
        return {"efforts": [{"of": one.name, "unit": one.unit, **there} for one in self.measured[2:]]}

    def numbers(self, scene: Scene) -> list[float]:
        return [*self.on_i.T.ravel(), *self.on_j.T.ravel()]


@dataclass(frozen=True)
class OnBody(Place):
    """A body through its basis, for the force `who`; axes "global" or "body": where directions of forces stay.

    measured : what a result keeps of the number that its kernel records

    >>> place = fd.OnBody("wind", "blade")
    """

    rank = 2
    initial = (0.0,)

    who: str
    body: str
    axes: str = "body"
    measured: tuple[Measured, ...] = ()

    @property
    def way(self) -> str:
        return self.axes

    def of(self, scene: Scene) -> Body:
        """The body."""
        return scene.bodies[self.ends(scene)[0]]

    def markers(self, scene: Scene) -> tuple[str, ...]:
        return ()

    def ends(self, scene: Scene) -> tuple[int, int]:
        return body_number(scene, self.body, self.who), -1
