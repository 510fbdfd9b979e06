"""The words in readable form: value, rate, right-hand side and Jacobian of every basic constraint row.

Points and axes of markers come with value, rate, bias and Jacobian (`ffr_dyn.equations.kinematics`); a row is a difference
or a dot product of two of them, and the product rule gives the rest:

    coincidence  e_c . (r_j - r_i) = 0          dot-1  a_i . a_j = 0
    dot-2        a_i . (r_j - r_i) = s(t)       driven angle  a_i(alpha(t)) . f_j = 0, f_j on its side
    distance     (|r_j - r_i|^2 - s(t)^2) / 2 s(t) = 0
    relation     factor_1 coordinate_1 + factor_2 coordinate_2 = s(t), coordinates of two joints: an angle is
                 atan2(g_i . f_j, f_i . f_j), a stroke h_i . (r_j - r_i)

Jacobians map the velocities [A^T R_dot, omega_bar, q_dot] of all bodies. The compiled form, which the tests hold equal
to this one, is `ffr_dyn.kernels.rows`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ffr_dyn.equations.kinematics import Motion, marker_axis, marker_point
from ffr_dyn.equations.layout import Layout
from ffr_dyn.scene.joints import COINCIDENCE, DISTANCE, DOT_1, DOT_2, DRIVEN_ANGLE, RELATION, Word
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.arrays import Array

Drive = tuple[float, float, float]


Parts = dict[int, Array]  # by the first column of a body


@dataclass(frozen=True)
class Row:
    """Phi, nu = dPhi/dt, gamma with Phi_q v_dot = gamma, and the Jacobian row.

    parts : of the Jacobian row of `size` V what need not vanish, (6 + n,) numbers of each body
    """

    Phi: float
    nu: float
    gamma: float
    parts: Parts
    size: int

    @property
    def jacobian(self) -> Array:
        """(V,) the whole row."""
        whole = np.zeros(self.size)
        for first, part in self.parts.items():
            whole[first : first + part.size] = part
        return whole


def summed_parts(terms: Iterable[tuple[float, Row]]) -> Parts:
    """Of the sum of rows, each times a number."""
    total = Parts()
    for factor, row in terms:
        for first, part in row.parts.items():
            total[first] = total[first] + factor * part if first in total else factor * part
    return total


@dataclass(frozen=True)
class Markers:
    """Points and axes of all markers at a state (x, v)."""

    scene: Scene
    place: Layout
    x: Array
    v: Array

    def point(self, number: int) -> Motion:
        return marker_point(self.scene, self.place, self.x, self.v, number)

    def axis(self, number: int, a0: Array) -> Motion:
        """The axis a0 (body axes, undeformed) of a marker."""
        return marker_axis(self.scene, self.place, self.x, self.v, number, a0)

    def from_to(self, i: int, j: int) -> list[tuple[Motion, float]]:
        """r_j - r_i as a signed sum."""
        return [(self.point(j), 1.0), (self.point(i), -1.0)]


def evaluate_word(
    scene: Scene, place: Layout, x: Array, v: Array, word: Word, at: tuple[int, ...], drive: Drive
) -> Row:
    """One row on the markers `at` (numbers); drive: value and two derivatives of its time function (zeros without)."""
    return WORDS[word.kind](Markers(scene, place, x, v), word, at, drive)


def _coincidence(now: Markers, word: Word, at: tuple[int, ...], drive: Drive) -> Row:
    """One component of r_j - r_i less a function of time. Equation (17) of docs/notation.md."""
    at_i, at_j, c, parts = now.point(at[0]), now.point(at[1]), int(word.axes[0, 0]), Parts()
    add_part(now.place, parts, at_i, -at_i.jacobian[c])
    add_part(now.place, parts, at_j, at_j.jacobian[c])
    off, rate, bias = at_j.r - at_i.r, at_j.r_dot - at_i.r_dot, at_i.bias - at_j.bias
    return _driven(Row(off[c], rate[c], bias[c], parts, now.place.v_size), drive)


def _dot_1(now: Markers, word: Word, at: tuple[int, ...], drive: Drive) -> Row:
    return _dot(now.place, now.axis(at[0], word.axes[0]), [(now.axis(at[1], word.axes[2]), 1.0)])


def _dot_2(now: Markers, word: Word, at: tuple[int, ...], drive: Drive) -> Row:
    return _driven(_dot(now.place, now.axis(at[0], word.axes[0]), now.from_to(at[0], at[1])), drive)


def _driven_angle(now: Markers, word: Word, at: tuple[int, ...], drive: Drive) -> Row:
    """The sine of what f_j is off; beyond a quarter of a turn two less the sine, which goes on to grow."""
    (alpha, speed, second), (axis_i, axis_i2, axis_j) = drive, word.axes
    along = np.cos(alpha) * axis_i + np.sin(alpha) * axis_i2
    across = -np.sin(alpha) * axis_i + np.cos(alpha) * axis_i2
    f, f_j = now.axis(at[0], along), now.axis(at[1], axis_j)
    row = _dot(now.place, _turning(now.axis(at[0], across), f, speed, second), [(f_j, 1.0)])
    if f.r @ f_j.r >= 0:
        return row
    back = _sum(row, -1.0, row, 0.0)
    return replace(back, Phi=back.Phi + float(np.copysign(2.0, row.Phi)))


def _turning(across: Motion, along: Motion, speed: float, second: float) -> Motion:
    """The axis `across` that turns in its marker with d(across)/dt = -speed along.

    Equation (19) of docs/notation.md.
    """
    return replace(
        across,
        r_dot=across.r_dot - speed * along.r,
        bias=across.bias - second * along.r - speed * speed * across.r - 2 * speed * along.r_dot,
    )


def _driven(row: Row, drive: Drive) -> Row:
    """The row less a function of time."""
    return replace(row, Phi=row.Phi - drive[0], nu=row.nu - drive[1], gamma=row.gamma + drive[2])


def _distance(now: Markers, word: Word, at: tuple[int, ...], drive: Drive) -> Row:
    """Half of D / s - s, with D the square of the distance, and its derivatives by the quotient rule.

    Equation (20) of docs/notation.md.
    """
    at_i, at_j, (s, speed, second), parts = now.point(at[0]), now.point(at[1]), drive, Parts()
    d, d_dot, d_bias = at_j.r - at_i.r, at_j.r_dot - at_i.r_dot, at_j.bias - at_i.bias
    add_part(now.place, parts, at_i, -d @ at_i.jacobian / s)
    add_part(now.place, parts, at_j, d @ at_j.jacobian / s)
    D, D_dot, D_bias = d @ d, 2 * d @ d_dot, 2 * (d_dot @ d_dot + d @ d_bias)
    nu = (D_dot / s - D * speed / s**2 - speed) / 2
    bias = (D_bias / s - 2 * D_dot * speed / s**2 - D * second / s**2 + 2 * D * speed * speed / s**3 - second) / 2
    return Row(float(D / s - s) / 2, float(nu), float(-bias), parts, now.place.v_size)


def _relation(now: Markers, word: Word, at: tuple[int, ...], drive: Drive) -> Row:
    """factor_1 coordinate_1 + factor_2 coordinate_2 less a function of time, coordinates of two joints.

    Equation (22) of docs/notation.md.
    """
    total = Row(0.0, 0.0, 0.0, {}, now.place.v_size)
    for k, (factor, kind) in enumerate(word.relation):
        row = coordinate(now, kind, word.axes[3 * k : 3 * k + 3], at[2 * k : 2 * k + 2])
        total = _sum(total, 1.0, row, factor)
    driven = _driven(total, drive)
    return (
        driven
        if word.spacing == 0
        else replace(driven, Phi=driven.Phi - word.spacing * round(driven.Phi / word.spacing))
    )


# The words of `ffr_dyn.scene.joints`.
WORDS: dict[str, Callable[[Markers, Word, tuple[int, ...], Drive], Row]] = {
    COINCIDENCE: _coincidence,
    DOT_1: _dot_1,
    DOT_2: _dot_2,
    DRIVEN_ANGLE: _driven_angle,
    DISTANCE: _distance,
    RELATION: _relation,
}


def coordinate(now: Markers, kind: str, axes: Sequence[Array] | Array, at: Sequence[int]) -> Row:
    """Value, rate and gamma of a joint coordinate, an "angle" or a "stroke", as a row; axes: f_i, g_i, f_j, or h_i.

    Equation (21) of docs/notation.md.
    """
    first = now.axis(at[0], axes[0])
    if kind == "stroke":
        return _dot(now.place, first, now.from_to(at[0], at[1]))
    f_j = now.axis(at[1], axes[2])
    c = _dot(now.place, first, [(f_j, 1.0)])
    s = _dot(now.place, now.axis(at[0], axes[1]), [(f_j, 1.0)])
    square = c.Phi**2 + s.Phi**2
    turn = _sum(s, c.Phi / square, c, -s.Phi / square)
    swelling = 2 * (c.Phi * c.nu + s.Phi * s.nu) / square
    return replace(turn, Phi=float(np.arctan2(s.Phi, c.Phi)), gamma=turn.gamma + turn.nu * swelling)


def _sum(one: Row, a: float, other: Row, b: float) -> Row:
    """a one + b other, for constant a and b."""
    return Row(
        a * one.Phi + b * other.Phi,
        a * one.nu + b * other.nu,
        a * one.gamma + b * other.gamma,
        summed_parts([(a, one), (b, other)]),
        one.size,
    )


def _dot(place: Layout, a: Motion, sums: list[tuple[Motion, float]]) -> Row:
    """a . d with d a signed sum of moving vectors. Equation (18) of docs/notation.md."""
    d = sum(sign * m.r for m, sign in sums)
    d_dot = sum(sign * m.r_dot for m, sign in sums)
    d_bias = sum(sign * m.bias for m, sign in sums)
    parts = Parts()
    add_part(place, parts, a, d @ a.jacobian)
    for m, sign in sums:
        add_part(place, parts, m, sign * (a.r @ m.jacobian))
    gamma = -(a.bias @ d + 2 * a.r_dot @ d_dot + a.r @ d_bias)
    return Row(float(a.r @ d), float(a.r_dot @ d + a.r @ d_dot), float(gamma), parts, place.v_size)


def add_part(place: Layout, parts: Parts, motion: Motion, row: Array) -> None:
    """Add the row (6 + n,) on the velocities of the body of a motion; nothing for the ground."""
    if motion.body < len(place.n):
        at = place.iv[motion.body]
        parts[at] = parts[at] + row if at in parts else row
