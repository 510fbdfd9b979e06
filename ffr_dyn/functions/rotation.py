"""Rotations by Euler parameters p = (cos(a/2), n sin(a/2)), scalar first, unit norm. The only home of A, G_bar and skew.

Shabana 2013, ch. 2; omega_bar = 2 G_bar_h p_dot in body components, with p_dot = 1/2 G_bar^T omega_bar. Rotation vectors:
Geradin, Cardona, Flexible Multibody Dynamics (2001), ch. 4.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError

_TURNED = 1e6  # rad; beyond, the last digits of an angle are coarser than any drawing
_LEAST_SINE = 1e-16  # of a turn that is taken for half a one


def skew(a: Array) -> Array:
    """(3,) -> (3, 3) with skew(a) b = a x b."""
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def cross(a: Array, b: Array) -> Array:
    """(3,) a x b; for single vectors a tenth of the time of numpy's general one."""
    a0, a1, a2 = a.tolist()
    b0, b1, b2 = b.tolist()
    return np.array([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0])


def rotation_matrix(p: Array) -> Array:
    """(..., 4) Euler parameters -> (..., 3, 3) A, body to global. Equation (1) of docs/notation.md."""
    p = np.asarray(p, float)
    if p.ndim == 1:
        return np.array(_rotation_rows(*p.tolist()))
    axes = (*range(2, p.ndim + 1), 0, 1)
    return np.array(_rotation_rows(p[..., 0], p[..., 1], p[..., 2], p[..., 3])).transpose(axes)


def axis_times_sine(B: Array) -> Array:
    """z (3,), the axis times the sine of the angle of a rotation B (3, 3).

    Half a turn has no sine, and an axis n by B + 1 = 2 n n^T: it has that times a least sine.
    """
    z = 0.5 * np.array([B[2, 1] - B[1, 2], B[0, 2] - B[2, 0], B[1, 0] - B[0, 1]])
    if np.trace(B) > 0 or np.linalg.norm(z) > _LEAST_SINE:
        return z
    n = (B + np.eye(3))[:, np.argmax(np.diag(B))]
    return np.asarray(_LEAST_SINE * n / np.linalg.norm(n))


def _rotation_rows(p0: Any, p1: Any, p2: Any, p3: Any) -> list[list[Any]]:
    s0, s1, s2, s3 = p0 * p0, p1 * p1, p2 * p2, p3 * p3
    return [
        [s0 + s1 - s2 - s3, 2 * (p1 * p2 - p0 * p3), 2 * (p1 * p3 + p0 * p2)],
        [2 * (p1 * p2 + p0 * p3), s0 - s1 + s2 - s3, 2 * (p2 * p3 - p0 * p1)],
        [2 * (p1 * p3 - p0 * p2), 2 * (p2 * p3 + p0 * p1), s0 - s1 - s2 + s3],
    ]


def G_bar(p: Array) -> Array:
    """(4,) -> (3, 4) with omega_bar = 2 G_bar p_dot and p_dot = 1/2 G_bar^T omega_bar."""
    p0, p1, p2, p3 = p
    return np.array([[-p1, p0, p3, -p2], [-p2, -p3, p0, p1], [-p3, p2, -p1, p0]])


def from_vector(vector: Array) -> Array:
    """(3,) rotation vector [rad] -> (4,) Euler parameters."""
    x, y, z = np.asarray(vector, float).tolist()
    half = math.sqrt(x * x + y * y + z * z) / 2
    factor = math.sin(half) / half / 2 if half > 0 else 0.5
    return np.array([math.cos(half), factor * x, factor * y, factor * z])


def product(p: Array, r: Array) -> Array:
    """Euler parameters of the rotation p after r, of length one."""
    a, b, c, d = p.tolist()
    e, f, g, h = r.tolist()
    out = np.array([
        a * e - b * f - c * g - d * h, a * f + b * e + c * h - d * g,
        a * g - b * h + c * e + d * f, a * h + b * g - c * f + d * e,
    ])  # fmt: skip
    return out / np.sqrt(out @ out)


_K = np.arange(9)
# (9, 4) powers of h^2 in (1 - cos h) / h^2, (h - sin h) / h^3, and the derivatives of both by h, divided by h.
_SERIES = (-1.0) ** _K[:, None] / np.array([[float(math.factorial(2 * k + m)) for m in (2, 3, 4, 5)] for k in _K])
_SERIES[:, 2:] *= -2.0 * (_K[:, None] + 1)


def _coefficients(square: float) -> Array:
    """(4,) what `_SERIES` is of, at h^2: the series below one, where the differences would lose digits."""
    if square < 1:
        return np.asarray(square**_K @ _SERIES)
    h = math.sqrt(square)
    b, c = (1 - math.cos(h)) / square, (1 - math.sin(h) / h) / square
    return np.array([b, c, (math.sin(h) / h - 2 * b) / square, (b - 3 * c) / square])


def turn_factors(squares: Array) -> Array:
    """(T,) h^2 -> (4, T) what `_coefficients` gives of each."""
    small, series = squares < 1, np.zeros((4, *squares.shape))
    near, far = np.where(small, squares, 0.0), np.where(small, 1.0, squares)
    for row in _SERIES[::-1]:
        series = series * near + row[:, None]
    h = np.sqrt(far)
    b, c = (1 - np.cos(h)) / far, (1 - np.sin(h) / h) / far
    beyond = np.array([b, c, (np.sin(h) / h - 2 * b) / far, (b - 3 * c) / far])
    return np.where(small, series, beyond)


def tangent(theta: Array) -> Array:
    """(3,) rotation vector -> (3, 3) T: exp(theta~) turns at T theta_dot, in the axes that stay.

    Equation (25) of docs/notation.md.
    """
    b, c, _, _ = _coefficients(float(theta @ theta))
    turned = skew(theta)
    return np.eye(3) + b * turned + c * turned @ turned


def tangent_rate(theta: Array, theta_dot: Array) -> Array:
    """(3,) T_dot theta_dot, T of `tangent`."""
    _, c, b_h, c_h = _coefficients(float(theta @ theta))
    across = cross(theta, theta_dot)
    return (theta @ theta_dot) * (b_h * across + c_h * cross(theta, across)) + c * cross(theta_dot, across)


def tangent_rate_form(theta: Array, moment: Array) -> Array:
    """(3, 3) symmetric C with theta_dot . C theta_dot = moment . T_dot theta_dot, of `tangent_rate`."""
    square, along = float(theta @ theta), float(moment @ theta)
    _, c, b_h, c_h = _coefficients(square)
    form = np.outer(theta, b_h * cross(moment, theta) + c_h * (along * theta - square * moment) - c * moment)
    return 0.5 * (form + form.T) + c * along * np.eye(3)


def from_matrix(A: Array) -> Array:
    """(3, 3) proper orthogonal -> (4,) Euler parameters (largest of the four first: Shepperd 1978)."""
    A = np.asarray(A, float)
    squares = np.array([1 + np.trace(A), *(1 + 2 * np.diag(A) - np.trace(A))]) / 4
    k = int(np.argmax(squares))
    axial = np.array([A[2, 1] - A[1, 2], A[0, 2] - A[2, 0], A[1, 0] - A[0, 1]])
    largest = np.sqrt(squares[k])
    if k == 0:
        return np.array([largest, *(axial / (4 * largest))])
    p = np.empty(4)
    p[0] = axial[k - 1] / (4 * largest)
    p[1:] = (A[k - 1] + A[:, k - 1]) / (4 * largest)
    p[k] = largest
    return p if p[0] >= 0 else -p


def euler_parameters(rotation: Any, what: str = "rotation") -> Array:
    """Euler parameters from a rotation vector (3,) [rad], Euler parameters (4,) or a matrix (3, 3).

    Raises InputError for anything that is not a rotation; `what` names it in the message.
    """
    value = np.asarray(rotation, float)
    if not np.isfinite(value).all():
        raise InputError(f"{what} holds values that are not finite: {value}")
    if value.shape == (3,):
        if not np.abs(value).max() < _TURNED:
            raise InputError(
                f"{what}: a rotation vector of {value.tolist()} rad has no angle left; give it within a turn"
            )
        return from_vector(value)
    if value.shape == (4,):
        if abs(np.linalg.norm(value) - 1) > 1e-6:
            raise InputError(f"{what}: Euler parameters must have length 1, not {np.linalg.norm(value):.6g}")
        length = np.linalg.norm(value)
        return value if abs(length - 1) < 4e-16 else value / length  # normalised once, the bits stay
    if value.shape == (3, 3):
        if np.abs(value @ value.T - np.eye(3)).max() > 1e-6 or np.linalg.det(value) < 0:
            raise InputError(f"{what}: the matrix is not a proper rotation (orthogonal, determinant +1)")
        return from_matrix(value)
    raise InputError(f"{what} must be a rotation vector (3,), Euler parameters (4,) or a matrix (3, 3)")


def triad(axis: Array, what: str = "axis") -> Array:
    """(3, 3) frame whose third column is the axis (3,); a (3, 3) frame is passed through after a check.

    The first column is the coordinate axis least aligned with `axis`, made orthogonal to it.
    """
    try:
        value = np.asarray(axis, float)
    except (TypeError, ValueError):
        value = np.zeros(0)
    if value.shape == (3, 3):
        return rotation_matrix(euler_parameters(value, what))
    if value.shape != (3,) or not np.isfinite(value).all() or not np.abs(value).max() > np.finfo(float).tiny:
        raise InputError(
            f"{what} must be a vector of three numbers that is not zero, or a (3, 3) frame; it is {axis!r}"
        )
    value = value / np.abs(value).max()  # whose square is a number, whatever its length
    h = value / np.linalg.norm(value)
    k = int(np.argmin(np.abs(h)))
    f = -h[k] * h
    f[k] += 1.0
    f /= np.linalg.norm(f)
    return np.array([f, cross(h, f), h]).T.copy()
