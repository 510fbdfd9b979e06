"""Joints: sentences made of a few words - coincidence of points, dot-1, dot-2, distance - on the joint frames (f, g, h) of
two markers.

A joint frame stands on each marker: its third axis h is the joint's `axis`, given in the axes of the marker's body. With
`axis` as a (3, 3) matrix the whole frame (columns f, g, h) is chosen. A joint's coordinates are zero where both frames
coincide. (Haug 1989, ch. 9; Rantalainen 2007, eqs. 3.90-3.95.)
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass
from fractions import Fraction
from functools import cached_property
from typing import Annotated, Any

import numpy as np

from ffr_dyn.functions.rotation import triad
from ffr_dyn.functions.time_functions import TimeFunction, as_time_function, constant
from ffr_dyn.scene.checks import check_markers, check_own_name
from ffr_dyn.scene.fields import Direction, In, OfTime
from ffr_prep.common.arrays import Array
from ffr_prep.common.brief import Brief
from ffr_prep.common.errors import InputError, require_kind

# The words: each has its readable form in `ffr_dyn.equations.constraints` and its kernel in `ffr_dyn.kernels.rows`.
COINCIDENCE, DOT_1, DOT_2 = "coincidence", "dot-1", "dot-2"
DRIVEN_ANGLE, DISTANCE, RELATION = "driven-angle", "distance", "relation"

F, G, H = 0, 1, 2
_MOST_TEETH = 1000

Term = tuple[float, str, Array, Array]


@dataclass(frozen=True, repr=False)
class Word(Brief):
    """One basic constraint row.

    axes     : (3, 3) in body axes: axis on i, second axis on i of an angle, axis on j; a coincidence row has its global
               component in axes[0, 0]; a relation has (6, 3), three axes for each of its joint coordinates
    function : of time, for what is prescribed
    relation : of a relation, for both coordinates: its factor and "angle" or "stroke"
    spacing  : of a relation: how far equivalent values are apart, or 0
    """

    kind: str
    text: str
    axes: Array
    function: TimeFunction | None = None
    relation: tuple[tuple[float, str], ...] = ()
    spacing: float = 0.0


def word(
    kind: str,
    text: str,
    axis_i: Array,
    axis_j: Array | None = None,
    axis_i2: Array | None = None,
    function: TimeFunction | None = None,
) -> Word:
    """A word on two markers."""
    axes = np.zeros((3, 3))
    for k, axis in enumerate((axis_i, axis_i2, axis_j)):
        if axis is not None:
            axes[k] = axis
    return Word(kind, text, axes, function)


def relation(one: Term, other: Term, text: str, function: TimeFunction | None = None) -> Word:
    """factor_1 coordinate_1 + factor_2 coordinate_2 = function(t) [zero], on the markers of both joints.

    A term is (factor, "angle" or "stroke", frame_i, frame_j). An angle is known up to whole turns; so is the sum, in
    steps of the `spacing`: the greatest common divisor of what a turn of each adds.

    Raises InputError when the turns of two angles have no common divisor to speak of.
    """
    axes = [axis for _, kind, i, j in (one, other) for axis in coordinate_axes(kind, i, j)]
    return Word(RELATION, text, np.array(axes), function, (one[:2], other[:2]), _spacing(one, other))


def coordinate_axes(kind: str, i: Array, j: Array) -> tuple[Array, Array, Array]:
    """The axes that make a joint coordinate: f_i, g_i, f_j of an angle, h_i of a stroke."""
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


_SAME_PLACE = [word(COINCIDENCE, f"same {'xyz'[c]}", np.array([c, 0.0, 0.0])) for c in range(3)]


def coincide() -> list[Word]:
    """Both points at one place: three rows."""
    return [*_SAME_PLACE]


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
    one, other = (-joint.pitch / (2 * np.pi), "angle", i, j), (1.0, "stroke", i, j)
    turn = relation(one, other, "stroke follows angle", constant(0.0))
    return [*cylindrical(i, j, joint), turn]


Sentence = Callable[[Array, Array, "Joint"], list[Word]]

# By kind: its words, the joint coordinates that a driver may prescribe and a result reports, and what of `axis_j`, `length`
# and `pitch` it needs.
KINDS: dict[str, Sentence] = {}
COORDINATES: dict[str, tuple[str, ...]] = {}
NEEDS: dict[str, tuple[str, ...]] = {}


def register_joint(
    kind: str, sentence: Sentence, coordinates: tuple[str, ...] = (), needs: tuple[str, ...] = ()
) -> None:
    """Make a kind of joint known: `sentence` makes words of the joint frames (columns f, g, h) on i and j, and the joint.

    coordinates : of "angle" (which needs both h axes parallel) and "stroke", those that it has
    needs       : of "axis_j", "length" and "pitch", the fields of `Joint` that must be given
    Raises InputError for a kind that there is.

    >>> fd.register_joint("pin-in-slot", pin_in_slot, coordinates=("angle",))
    """
    require_kind(kind, str, "the kind of a joint", "its name, such as 'pin-in-slot'")
    if kind in KINDS and KINDS[kind].__qualname__ != sentence.__qualname__:
        raise InputError(f"there is a kind of joint {kind!r} already; give the other one another name")
    KINDS[kind], COORDINATES[kind], NEEDS[kind] = sentence, coordinates, needs


register_joint("spherical", spherical)
register_joint("revolute", revolute, ("angle",))
register_joint("cylindrical", cylindrical, ("angle", "stroke"))
register_joint("translational", translational, ("stroke",))
register_joint("universal", universal, needs=("axis_j",))
register_joint("fixed", fixed)
register_joint("planar", planar, ("angle",))
register_joint("point-on-line", point_on_line, ("stroke",))
register_joint("point-on-plane", point_on_plane)
register_joint("orientation", orientation)
register_joint("parallel", parallel, ("angle",))
register_joint("perpendicular", perpendicular)
register_joint("distance", distance, needs=("length",))
register_joint("screw", screw, ("angle", "stroke"), needs=("pitch",))


@dataclass(frozen=True)
class Joint:
    """Two markers, `i` and `j` ("body.interface", or "ground.point"), tied by the words of `kind`.

    i, j    : its two markers; angle and stroke of the joint are those of j seen from i
    kind   : spherical, revolute, cylindrical, translational, universal, fixed, planar, point-on-line, point-on-plane,
             orientation, parallel, perpendicular, distance or screw
    axis   : (3,) joint axis in the axes of i's body (or a (3, 3) joint frame), default z; for a universal joint the arm on i
    axis_j : the same for j; by default equal to `axis`, except for the universal joint, which needs it. A fixed joint without
             both keeps the attitudes of its bodies to each other as the scene draws them; its points are brought together
    length : [m] of a distance joint: a positive number or a function of time
    pitch  : [m] per turn of a screw, positive for a right-hand thread

    Raises InputError for an unknown kind, and for arms, length or pitch that the kind needs and has not, or has
    not and is given.

    >>> hinge = fd.Joint("hinge", "revolute", "ground.wall", "rod.hinge", axis=(0, 0, 1))
    """

    name: str
    kind: str
    i: str
    j: str
    _: KW_ONLY
    axis: Annotated[Any, Direction()] = None
    axis_j: Annotated[Any, Direction()] = None
    length: Annotated[Any, OfTime("m")] = None
    pitch: Annotated[Any, In("m")] = None

    def __post_init__(self) -> None:
        check_own_name("joint", self.name)
        check_markers(self, f"joint {self.name!r}")
        if self.kind not in KINDS:
            raise InputError(f"joint {self.name!r}: there is no kind {self.kind!r}; there are {', '.join(KINDS)}")
        needs = NEEDS[self.kind]
        if "axis_j" in needs and self.axis_j is None:
            raise InputError(f"joint {self.name!r}: a {self.kind} joint needs both arms, axis and axis_j")
        if (self.length is None) == ("length" in needs):
            who = f"joint {self.name!r}: a {_needing('length')} joint"
            raise InputError(f"{who} needs a length [m], and no other kind has one")
        if isinstance(self.length, (int, float)) and not 0 < self.length < np.inf:
            raise InputError(f"joint {self.name!r}: length is {self.length} m; it must be positive")
        if (self.pitch is None) == ("pitch" in needs) or self.pitch == 0:
            raise InputError(
                f"joint {self.name!r}: a {_needing('pitch')} needs a pitch [m per turn], not zero; no other kind has one"
            )
        frames(self)

    @cached_property
    def _frames(self) -> tuple[Array, Array]:
        on_i = _frame(np.eye(3)[2] if self.axis is None else self.axis, f"joint {self.name!r}: axis")
        return on_i, on_i if self.axis_j is None else _frame(self.axis_j, f"joint {self.name!r}: axis_j")


def _frame(axis: Any, what: str) -> Array:
    found = triad(axis, what)
    found.setflags(write=False)
    return found


def _needing(key: str) -> str:
    return " or ".join(kind for kind, needs in NEEDS.items() if key in needs)


def frames(joint: Joint) -> tuple[Array, Array]:
    """Joint frames (3, 3) on markers i and j, columns f, g, h, in body axes."""
    return joint._frames


def words(joint: Joint) -> list[Word]:
    """The basic constraints of a joint, in order."""
    return KINDS[joint.kind](*frames(joint), joint)
