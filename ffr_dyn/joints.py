"""Joints: sentences made of three words - coincidence of points, dot-1, dot-2 - on the joint frames (f, g, h) of two markers.

A joint frame stands on each marker: its third axis h is the joint's `axis`, given in the axes of the marker's body. With
`axis` as a (3, 3) matrix the whole frame (columns f, g, h) is chosen. A joint's coordinates are zero where both frames
coincide. (Haug 1989, ch. 9; Rantalainen 2007, eqs. 3.90-3.95.)
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ffr_dyn.errors import InputError
from ffr_dyn.rotation import triad

Array = np.ndarray

COINCIDENCE, DOT_1, DOT_2, DRIVEN_ANGLE = 0, 1, 2, 3  # as in ffr_dyn.kernels.tables

F, G, H = 0, 1, 2


@dataclass(frozen=True)
class Word:
    """One basic constraint row. Axes are (3,) in body axes; a coincidence row has its global component in axis_i[0]."""

    kind: int
    axis_i: Array
    axis_j: Array
    axis_i2: Array
    text: str


def _word(kind: int, text: str, axis_i: Array, axis_j: Array | None = None, axis_i2: Array | None = None) -> Word:
    nothing = np.zeros(3)
    return Word(kind, axis_i, nothing if axis_j is None else axis_j, nothing if axis_i2 is None else axis_i2, text)


def coincide() -> list[Word]:
    """Both points at one place: three rows."""
    return [_word(COINCIDENCE, f"same {'xyz'[c]}", np.array([c, 0.0, 0.0])) for c in range(3)]


def dot_1(frame_i: Array, a: int, frame_j: Array, b: int) -> Word:
    """Axis a of frame i stays at right angles to axis b of frame j."""
    return _word(DOT_1, f"{'fgh'[a]}_i at right angles to {'fgh'[b]}_j", frame_i[:, a], frame_j[:, b])


def dot_2(frame_i: Array, a: int) -> Word:
    """The line between the points stays at right angles to axis a of frame i."""
    return _word(DOT_2, f"no offset along {'fgh'[a]}_i", frame_i[:, a])


def parallel(i: Array, j: Array) -> list[Word]:
    """Both h axes parallel: two rows."""
    return [dot_1(i, F, j, H), dot_1(i, G, j, H)]


def spherical(i: Array, j: Array) -> list[Word]:
    return coincide()


def revolute(i: Array, j: Array) -> list[Word]:
    return [*coincide(), *parallel(i, j)]


def cylindrical(i: Array, j: Array) -> list[Word]:
    return [*parallel(i, j), dot_2(i, F), dot_2(i, G)]


def translational(i: Array, j: Array) -> list[Word]:
    return [*cylindrical(i, j), dot_1(i, F, j, G)]


def universal(i: Array, j: Array) -> list[Word]:
    """The cross: h_i (an arm on body i) stays at right angles to h_j (the arm on body j)."""
    return [*coincide(), dot_1(i, H, j, H)]


def fixed(i: Array, j: Array) -> list[Word]:
    return [*coincide(), *parallel(i, j), dot_1(i, F, j, G)]


KINDS = {
    "spherical": spherical,
    "revolute": revolute,
    "cylindrical": cylindrical,
    "translational": translational,
    "universal": universal,
    "fixed": fixed,
}

# The joint coordinates that a driver may prescribe and a result reports.
COORDINATES = {
    "spherical": (),
    "revolute": ("angle",),
    "cylindrical": ("angle", "stroke"),
    "translational": ("stroke",),
    "universal": (),
    "fixed": (),
}


@dataclass(frozen=True)
class Joint:
    """Two markers, `i` and `j` ("body.interface", or "ground.point"), tied by the words of `kind`.

    kind   : spherical, revolute, cylindrical, translational, universal or fixed
    axis   : (3,) joint axis in the axes of i's body (or a (3, 3) joint frame); for a universal joint the arm on i
    axis_j : the same for j; by default equal to `axis`, except for the universal joint, which needs it
    """

    name: str
    kind: str
    i: str
    j: str
    axis: Any = (0.0, 0.0, 1.0)
    axis_j: Any = None

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise InputError(f"joint {self.name!r}: there is no kind {self.kind!r}; there are {', '.join(KINDS)}")
        if self.kind == "universal" and self.axis_j is None:
            raise InputError(f"joint {self.name!r}: a universal joint needs both arms, axis and axis_j")
        frames(self)


def frames(joint: Joint) -> tuple[Array, Array]:
    """Joint frames (3, 3) on markers i and j, columns f, g, h, in body axes."""
    on_i = triad(joint.axis, f"joint {joint.name!r}: axis")
    if joint.axis_j is None:
        return on_i, on_i
    return on_i, triad(joint.axis_j, f"joint {joint.name!r}: axis_j")


def words(joint: Joint) -> list[Word]:
    """The basic constraints of a joint, in order."""
    return KINDS[joint.kind](*frames(joint))
