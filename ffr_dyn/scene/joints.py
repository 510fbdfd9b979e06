"""Joints: sentences made of a few words - coincidence of points, dot-1, dot-2, distance - on the joint frames (f, g, h) of
two markers.

A joint frame stands on each marker: its third axis h is the joint's `axis`, given in the axes of the marker's body. With
`axis` as a (3, 3) matrix the whole frame (columns f, g, h) is chosen. A joint's coordinates are zero where both frames
coincide. (Haug 1989, ch. 9; Rantalainen 2007, eqs. 3.90-3.95.)
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Annotated, Any

import numpy as np

from ffr_dyn.functions.rotation import triad
from ffr_dyn.functions.time_functions import TimeFunction, as_time_function
from ffr_dyn.scene.fields import Direction, In, OfTime
from ffr_prep.common.errors import InputError

Array = np.ndarray

# as in ffr_dyn.kernels.tables
COINCIDENCE, DOT_1, DOT_2, DRIVEN_ANGLE, DISTANCE, RELATION = 0, 1, 2, 3, 4, 5

F, G, H = 0, 1, 2
_MOST_TEETH = 1000

Term = tuple[float, str, Array, Array]


@dataclass(frozen=True)
class Word:
    """One basic constraint row.

    axes     : (3, 3) in body axes: axis on i, second axis on i of an angle, axis on j; a coincidence row has its global
               component in axes[0, 0]; a relation has (6, 3), three axes for each of its joint coordinates
    function : of time, for what is prescribed
    relation : of a relation: factor and kind (0 angle, 1 stroke) of both coordinates, spacing of equivalent values
    """

    kind: int
    text: str
    axes: Array
    function: TimeFunction | None = None
    relation: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0, 0.0)


def word(
    kind: int,
    text: str,
    axis_i: Array,
    axis_j: Array | None = None,
    axis_i2: Array | None = None,
    function: TimeFunction | None = None,
) -> Word:
    """A word on two markers."""
    nothing = np.zeros(3)
    axes = [axis_i, nothing if axis_i2 is None else axis_i2, nothing if axis_j is None else axis_j]
    return Word(kind, text, np.array(axes, float), function)


def relation(one: Term, other: Term, text: str, function: TimeFunction | None = None) -> Word:
    """factor_1 coordinate_1 + factor_2 coordinate_2 = function(t) [zero], on the markers of both joints.

    A term is (factor, "angle" or "stroke", frame_i, frame_j). An angle is known up to whole turns; so is the sum, in
    steps of the `spacing`: the greatest common divisor of what a turn of each adds.

    Raises InputError when the turns of two angles have no common divisor to speak of.
    """
    kinds = {"angle": 0.0, "stroke": 1.0}
    axes = [axis for _, kind, i, j in (one, other) for axis in _coordinate_axes(kind, i, j)]
    numbers = (one[0], kinds[one[1]], other[0], kinds[other[1]])
    return Word(RELATION, text, np.array(axes), function, (*numbers, _spacing(one, other)))


def _coordinate_axes(kind: str, i: Array, j: Array) -> tuple[Array, Array, Array]:
    """What the kernels need of a joint coordinate: f_i, g_i, f_j of an angle, h_i of a stroke."""
    return (i[:, F], i[:, G], j[:, F]) if kind == "angle" else (i[:, H], np.zeros(3), np.zeros(3))


def _spacing(one: Term, other: Term) -> float:
    turns = [2 * np.pi * abs(factor) for factor, kind, _, _ in (one, other) if kind == "angle"]
    if len(turns) < 2:
        return turns[0] if turns else 0.0
    ratio = Fraction(turns[1] / turns[0]).limit_denominator(_MOST_TEETH)
    if not abs(turns[1] - float(ratio) * turns[0]) < 1e-9 * turns[0]:
        raise InputError(
            f"the ratio {turns[1] / turns[0]:.12g} of two angles is not a ratio of whole numbers up to {_MOST_TEETH}: "
            "give it as the ratio of the numbers of teeth"
        )
    return turns[0] / ratio.denominator


def coincide() -> list[Word]:
    """Both points at one place: three rows."""
    return [word(COINCIDENCE, f"same {'xyz'[c]}", np.array([c, 0.0, 0.0])) for c in range(3)]


def dot_1(frame_i: Array, a: int, frame_j: Array, b: int) -> Word:
    """Axis a of frame i stays at right angles to axis b of frame j."""
    return word(DOT_1, f"{'fgh'[a]}_i at right angles to {'fgh'[b]}_j", frame_i[:, a], frame_j[:, b])


def dot_2(frame_i: Array, a: int) -> Word:
    """The line between the points stays at right angles to axis a of frame i."""
    return word(DOT_2, f"no offset along {'fgh'[a]}_i", frame_i[:, a])


def parallel(i: Array, j: Array, joint: Joint) -> list[Word]:
    """Both h axes parallel: two rows."""
    return [dot_1(i, F, j, H), dot_1(i, G, j, H)]


def perpendicular(i: Array, j: Array, joint: Joint) -> list[Word]:
    return [dot_1(i, H, j, H)]


def spherical(i: Array, j: Array, joint: Joint) -> list[Word]:
    return coincide()


def revolute(i: Array, j: Array, joint: Joint) -> list[Word]:
    return [*coincide(), *parallel(i, j, joint)]


def cylindrical(i: Array, j: Array, joint: Joint) -> list[Word]:
    return [*parallel(i, j, joint), *point_on_line(i, j, joint)]


def translational(i: Array, j: Array, joint: Joint) -> list[Word]:
    return [*cylindrical(i, j, joint), dot_1(i, F, j, G)]


def universal(i: Array, j: Array, joint: Joint) -> list[Word]:
    """The cross: h_i (an arm on body i) stays at right angles to h_j (the arm on body j)."""
    return [*coincide(), *perpendicular(i, j, joint)]


def fixed(i: Array, j: Array, joint: Joint) -> list[Word]:
    return [*coincide(), *parallel(i, j, joint), dot_1(i, F, j, G)]


def planar(i: Array, j: Array, joint: Joint) -> list[Word]:
    """The point of j slides in the plane through i across h_i, and turns about h_i only."""
    return [*parallel(i, j, joint), *point_on_plane(i, j, joint)]


def point_on_line(i: Array, j: Array, joint: Joint) -> list[Word]:
    """The point of j stays on the line through i along h_i."""
    return [dot_2(i, F), dot_2(i, G)]


def point_on_plane(i: Array, j: Array, joint: Joint) -> list[Word]:
    """The point of j stays in the plane through i across h_i."""
    return [dot_2(i, H)]


def orientation(i: Array, j: Array, joint: Joint) -> list[Word]:
    """The body of j does not turn against that of i."""
    return [*parallel(i, j, joint), dot_1(i, F, j, G)]


def distance(i: Array, j: Array, joint: Joint) -> list[Word]:
    """The points keep the distance `length`, as by a massless rod with two ball joints."""
    function = as_time_function(joint.length, f"joint {joint.name!r}: length")
    return [word(DISTANCE, "distance of the points", np.zeros(3), function=function)]


def screw(i: Array, j: Array, joint: Joint) -> list[Word]:
    """A cylindrical joint whose stroke grows by `pitch` with every turn; zero where both frames coincide."""
    turn = relation((-joint.pitch / (2 * np.pi), "angle", i, j), (1.0, "stroke", i, j), "stroke follows angle")
    return [*cylindrical(i, j, joint), turn]


KINDS = {
    "spherical": spherical,
    "revolute": revolute,
    "cylindrical": cylindrical,
    "translational": translational,
    "universal": universal,
    "fixed": fixed,
    "planar": planar,
    "point-on-line": point_on_line,
    "point-on-plane": point_on_plane,
    "orientation": orientation,
    "parallel": parallel,
    "perpendicular": perpendicular,
    "distance": distance,
    "screw": screw,
}

# The joint coordinates that a driver may prescribe and a result reports.
COORDINATES = {
    "spherical": (),
    "revolute": ("angle",),
    "cylindrical": ("angle", "stroke"),
    "translational": ("stroke",),
    "universal": (),
    "fixed": (),
    "planar": ("angle",),
    "point-on-line": ("stroke",),
    "point-on-plane": (),
    "orientation": (),
    "parallel": ("angle",),
    "perpendicular": (),
    "distance": (),
    "screw": ("angle", "stroke"),
}


@dataclass(frozen=True)
class Joint:
    """Two markers, `i` and `j` ("body.interface", or "ground.point"), tied by the words of `kind`.

    kind   : spherical, revolute, cylindrical, translational, universal, fixed, planar, point-on-line, point-on-plane,
             orientation, parallel, perpendicular, distance or screw
    axis   : (3,) joint axis in the axes of i's body (or a (3, 3) joint frame); for a universal joint the arm on i
    axis_j : the same for j; by default equal to `axis`, except for the universal joint, which needs it
    length : [m] of a distance joint: a positive number or a function of time
    pitch  : [m] per turn of a screw, positive for a right-hand thread
    """

    name: str
    kind: str
    i: str
    j: str
    axis: Annotated[Any, Direction()] = (0.0, 0.0, 1.0)
    axis_j: Annotated[Any, Direction()] = None
    length: Annotated[Any, OfTime("m")] = None
    pitch: Annotated[Any, In("m")] = None

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise InputError(f"joint {self.name!r}: there is no kind {self.kind!r}; there are {', '.join(KINDS)}")
        if self.kind == "universal" and self.axis_j is None:
            raise InputError(f"joint {self.name!r}: a universal joint needs both arms, axis and axis_j")
        if (self.length is None) != (self.kind != "distance"):
            raise InputError(f"joint {self.name!r}: a distance joint needs a length [m], and no other kind has one")
        if isinstance(self.length, (int, float)) and not 0 < self.length < np.inf:
            raise InputError(f"joint {self.name!r}: length is {self.length} m; it must be positive")
        if (self.pitch is None) != (self.kind != "screw") or self.pitch == 0:
            raise InputError(
                f"joint {self.name!r}: a screw needs a pitch [m per turn], not zero; no other kind has one"
            )
        frames(self)


def frames(joint: Joint) -> tuple[Array, Array]:
    """Joint frames (3, 3) on markers i and j, columns f, g, h, in body axes."""
    on_i = triad(joint.axis, f"joint {joint.name!r}: axis")
    if joint.axis_j is None:
        return on_i, on_i
    return on_i, triad(joint.axis_j, f"joint {joint.name!r}: axis_j")


def words(joint: Joint) -> list[Word]:
    """The basic constraints of a joint, in order."""
    return KINDS[joint.kind](*frames(joint), joint)
