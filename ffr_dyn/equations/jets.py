"""Numbers and vectors with their first and second derivatives, and the words of the constraints made of them.

Coordinates are the small motions (12,) of two markers i and j: of each the displacement d of its point and the rotation
vector phi of its axes, global axes. A point moves to r + d, an axis a turns to exp(phi~) a, so that the second derivative of
a row is symmetric: that of its value along a motion d(t), phi(t) of constant rates. Values and gradients are those of
`ffr_dyn.equations.constraints` and of the coordinates in `ffr_dyn.equations.forces`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ffr_dyn.functions.rotation import axis_times_sine, skew
from ffr_dyn.scene.forces.places import AlongLine, BetweenAxes, OnJoint, Place
from ffr_dyn.scene.joints import COINCIDENCE, DISTANCE, DOT_1, DOT_2, DRIVEN_ANGLE, Word
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.arrays import Array

SIZE = 12
FIRST, SECOND = 0, 6  # where the motions of both markers begin


@dataclass(frozen=True)
class Jet:
    """value (...), first (..., 12) and second (..., 12, 12) derivatives; of a number, or of a vector (3,)."""

    value: Array
    first: Array
    second: Array

    def __add__(self, other: Jet) -> Jet:
        return Jet(self.value + other.value, self.first + other.first, self.second + other.second)

    def __mul__(self, factor: float) -> Jet:
        return Jet(factor * self.value, factor * self.first, factor * self.second)

    def __sub__(self, other: Jet) -> Jet:
        return self + other * -1.0

    def less(self, number: float) -> Jet:
        return Jet(self.value - number, self.first, self.second)


def dot(a: Jet, b: Jet) -> Jet:
    """a . b of two vectors."""
    mixed = a.first.T @ b.first
    second = (a.value @ b.second.reshape(3, -1) + b.value @ a.second.reshape(3, -1)).reshape(mixed.shape)
    second += mixed + mixed.T
    return Jet(a.value @ b.value, a.value @ b.first + b.value @ a.first, second)


def composed(value: float, slopes: Sequence[float] | Sequence[Array], curvatures: Array, of: Sequence[Jet]) -> Jet:
    """A function of K numbers, from its value, its first (K,) and second (K, K) derivatives by them."""
    first = np.array([jet.first for jet in of])
    second = first.T @ np.asarray(curvatures) @ first
    for slope, jet in zip(slopes, of, strict=True):
        second = second + slope * jet.second
    return Jet(np.array(value), np.asarray(slopes) @ first, second)


@dataclass(frozen=True)
class Pair:
    """Two markers: points (3,), and axes (3, 3) that turn those of the undeformed bodies into global ones."""

    r_i: Array
    r_j: Array
    on_i: Array
    on_j: Array

    def line(self) -> Jet:
        """From the point of i to that of j."""
        return _point(self.r_j, SECOND) - _point(self.r_i, FIRST)

    def axis_i(self, a0: Array) -> Jet:
        return _axis(self.on_i @ a0, FIRST)

    def axis_j(self, a0: Array) -> Jet:
        return _axis(self.on_j @ a0, SECOND)


def pair_motion(r_i: Array, r_j: Array, u: Array, w: Array) -> Array:
    """(12,) velocities of two markers at r_i, r_j (3,) that screws R_dot = u + w x R, u and w (2, 3), carry."""
    return np.concatenate([u[0] + np.cross(w[0], r_i), w[0], u[1] + np.cross(w[1], r_j), w[1]])


_STILL = np.zeros((3, SIZE, SIZE))


def _point(r: Array, at: int) -> Jet:
    first = np.zeros((3, SIZE))
    first[:, at : at + 3] = np.eye(3)
    return Jet(r, first, _STILL)


def _axis(a: Array, at: int) -> Jet:
    first, second, turn = np.zeros((3, SIZE)), np.zeros((3, SIZE, SIZE)), slice(at + 3, at + 6)
    first[:, turn] = -skew(a)
    half = 0.5 * np.einsum("ci,j->cij", np.eye(3), a)
    second[:, turn, turn] = half + half.transpose(0, 2, 1) - np.einsum("c,ij->cij", a, np.eye(3))
    return Jet(a, first, second)


# ---- words: the value of a row, whose drive is s -------------------------------------------------------------------


def _coincidence(at: Pair, word: Word, s: float) -> Jet:
    line, c = at.line(), int(word.axes[0, 0])
    return Jet(line.value[c], line.first[c], line.second[c]).less(s)


def _dot_1(at: Pair, word: Word, s: float) -> Jet:
    return dot(at.axis_i(word.axes[0]), at.axis_j(word.axes[2]))


def _dot_2(at: Pair, word: Word, s: float) -> Jet:
    return dot(at.axis_i(word.axes[0]), at.line()).less(s)


def _driven_angle(at: Pair, word: Word, s: float) -> Jet:
    f_j, along = at.axis_j(word.axes[2]), np.cos(s) * word.axes[0] + np.sin(s) * word.axes[1]
    sine = dot(at.axis_i(-np.sin(s) * word.axes[0] + np.cos(s) * word.axes[1]), f_j)
    if dot(at.axis_i(along), f_j).value >= 0:
        return sine
    return Jet(float(np.copysign(2.0, sine.value)) - sine.value, -sine.first, -sine.second)


def _distance(at: Pair, word: Word, s: float) -> Jet:
    line = at.line()
    return (dot(line, line) * (0.5 / s)).less(0.5 * s)


# All words of `ffr_dyn.scene.joints` on one pair of markers; a relation is a sum of coordinates of two.
WORDS: dict[str, Callable[[Pair, Word, float], Jet]] = {
    COINCIDENCE: _coincidence,
    DOT_1: _dot_1,
    DOT_2: _dot_2,
    DRIVEN_ANGLE: _driven_angle,
    DISTANCE: _distance,
}


# ---- coordinates of joints and of forces ---------------------------------------------------------------------------


def joint_coordinate(at: Pair, kind: str, axes: Array) -> Jet:
    """An "angle" of axes f_i, g_i, f_j, or a "stroke" of h_i."""
    first = at.axis_i(axes[0])
    if kind == "stroke":
        return dot(first, at.line())
    f_j = at.axis_j(axes[2])
    c, s = dot(first, f_j), dot(at.axis_i(axes[1]), f_j)
    x, y = float(c.value), float(s.value)
    square = x**2 + y**2
    own, mixed = 2 * x * y / square**2, (y**2 - x**2) / square**2
    return composed(math.atan2(y, x), (-y / square, x / square), np.array([[own, mixed], [mixed, -own]]), (c, s))


def coordinates(scene: Scene, at: Pair, place: Place) -> list[Jet]:
    """The coordinates of a place of forces; none where the points of a line coincide."""
    if isinstance(place, AlongLine):
        return _length(at.line())
    if isinstance(place, BetweenAxes):
        line = at.line()
        return [*(dot(at.axis_i(a), line) for a in place.on_i.T), *_rotation_vector(at, place)]
    if isinstance(place, OnJoint):
        return [joint_coordinate(at, place.coordinate, place.axes(scene)).less(-2 * np.pi * place.turns)]
    raise TypeError(f"there are no coordinates of a {type(place).__name__}")


def _length(line: Jet) -> list[Jet]:
    size = float(np.linalg.norm(line.value))
    if size == 0:
        return []
    return [composed(size, (0.5 / size,), np.array([[-0.25 / size**3]]), (dot(line, line),))]


def _rotation_vector(at: Pair, place: BetweenAxes) -> list[Jet]:
    """psi = g z, z the axial vector of the relative rotation B, g = phi / sin(phi) a function of c = cos(phi)."""
    on_i, on_j = [at.axis_i(a) for a in place.on_i.T], [at.axis_j(b) for b in place.on_j.T]
    B = [[dot(a, b) for b in on_j] for a in on_i]
    z = [(B[(k + 2) % 3][(k + 1) % 3] - B[(k + 1) % 3][(k + 2) % 3]) * 0.5 for k in range(3)]
    axial = axis_times_sine(np.array([[jet.value for jet in row] for row in B]))
    z = [replace(jet, value=value) for jet, value in zip(z, axial, strict=True)]
    trace = B[0][0] + B[1][1] + B[2][2]
    s = float(np.linalg.norm([row.value for row in z]))
    g = composed(*_growth(s, 0.5 * (float(trace.value) - 1.0)), (trace * 0.5,))
    return [composed(float(k.value * g.value), (g.value, k.value), np.array([[0, 1], [1, 0]]), (k, g)) for k in z]


def _growth(s: float, c: float) -> tuple[float, tuple[float], Array]:
    """g = arccos(c) / sqrt(1 - c^2) and its derivatives by c, of a rotation with sin s and cos c."""
    left = 1.0 - c
    if left < 0.01:
        terms = np.array([1.0, 1 / 3, 2 / 15, 2 / 35, 8 / 315, 8 / 693, 16 / 3003])  # of left^k: k! / (2 k + 1)!!
        first = np.arange(1, 7) * terms[1:]
        second = np.arange(1, 6) * first[1:]
        g, slope, curvature = (float(a @ left ** np.arange(a.size)) for a in (terms, first, second))
        return g, (-slope,), np.array([[curvature]])
    g = float(np.arctan2(s, c)) / s
    slope = (c * g - 1) / s**2
    return g, (slope,), np.array([[(g + 3 * c * slope) / s**2]])
