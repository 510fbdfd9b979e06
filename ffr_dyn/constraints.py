"""The words in readable form: value, rate, right-hand side and Jacobian of every basic constraint row.

Points and axes of markers come with value, rate, bias and Jacobian (`ffr_dyn.kinematics`); a row is a difference or a
dot product of two of them, and the product rule gives the rest:

    coincidence  e_c . (r_j - r_i) = 0          dot-1  a_i . a_j = 0
    dot-2        a_i . (r_j - r_i) = s(t)       driven angle  a_i(alpha(t)) . f_j = 0

Jacobians map the velocities [A^T R_dot, omega_bar, q_dot] of all bodies. The compiled form, which the tests hold equal
to this one, is `ffr_dyn.kernels.rows`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ffr_dyn.joints import COINCIDENCE, DOT_1, DOT_2, Word
from ffr_dyn.kinematics import Motion, marker_axis, marker_point
from ffr_dyn.layout import Layout
from ffr_dyn.scene import Scene

Array = np.ndarray


@dataclass(frozen=True)
class Row:
    """Phi, nu = dPhi/dt, gamma with Phi_q v_dot = gamma, and the Jacobian row (V,)."""

    Phi: float
    nu: float
    gamma: float
    jacobian: Array


def evaluate_word(
    scene: Scene, place: Layout, x: Array, v: Array, word: Word, i: int, j: int, drive: tuple[float, float, float]
) -> Row:
    """One row on markers i, j (numbers); drive: value and two derivatives of its time function (zeros without)."""

    def point(number: int) -> Motion:
        return marker_point(scene, place, x, v, number)

    def axis(number: int, a0: Array) -> Motion:
        return marker_axis(scene, place, x, v, number, a0)

    if word.kind == COINCIDENCE:
        return _coincidence(place, point(i), point(j), int(word.axis_i[0]))
    if word.kind == DOT_1:
        return _dot(place, axis(i, word.axis_i), [(axis(j, word.axis_j), 1.0)])
    if word.kind == DOT_2:
        row = _dot(place, axis(i, word.axis_i), [(point(j), 1.0), (point(i), -1.0)])
        return replace(row, Phi=row.Phi - drive[0], nu=row.nu - drive[1], gamma=row.gamma + drive[2])
    alpha, speed, second = drive
    along = np.cos(alpha) * word.axis_i + np.sin(alpha) * word.axis_i2
    across = -np.sin(alpha) * word.axis_i + np.cos(alpha) * word.axis_i2
    turning = _turning(axis(i, across), axis(i, along), speed, second)
    return _dot(place, turning, [(axis(j, word.axis_j), 1.0)])


def _turning(across: Motion, along: Motion, speed: float, second: float) -> Motion:
    """The axis `across` that turns in its marker with d(across)/dt = -speed along."""
    return replace(
        across,
        r_dot=across.r_dot - speed * along.r,
        bias=across.bias - second * along.r - speed**2 * across.r - 2 * speed * along.r_dot,
    )


def _coincidence(place: Layout, at_i: Motion, at_j: Motion, c: int) -> Row:
    jacobian = np.zeros(place.v_size)
    _add(place, jacobian, at_i, -at_i.jacobian[c])
    _add(place, jacobian, at_j, at_j.jacobian[c])
    difference = at_j.r - at_i.r
    return Row(difference[c], (at_j.r_dot - at_i.r_dot)[c], (at_i.bias - at_j.bias)[c], jacobian)


def _dot(place: Layout, a: Motion, sums: list[tuple[Motion, float]]) -> Row:
    """a . d with d a signed sum of moving vectors."""
    d = sum(sign * m.r for m, sign in sums)
    d_dot = sum(sign * m.r_dot for m, sign in sums)
    d_bias = sum(sign * m.bias for m, sign in sums)
    jacobian = np.zeros(place.v_size)
    _add(place, jacobian, a, d @ a.jacobian)
    for m, sign in sums:
        _add(place, jacobian, m, sign * (a.r @ m.jacobian))
    gamma = -(a.bias @ d + 2 * a.r_dot @ d_dot + a.r @ d_bias)
    return Row(float(a.r @ d), float(a.r_dot @ d + a.r @ d_dot), float(gamma), jacobian)


def _add(place: Layout, jacobian: Array, motion: Motion, row: Array) -> None:
    if motion.body < len(place.n):
        at = place.iv[motion.body]
        jacobian[at : at + row.size] += row
