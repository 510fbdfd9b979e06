"""Finite motions of all bodies: rotations by rotation vectors, and how large a motion is.

Twin: `ffr_dyn.equations.layout.moved`.
"""

import math

from ffr_dyn.kernels.bodies import rotation_matrix
from ffr_dyn.kernels.options import inlined, kernel
from ffr_dyn.kernels.system import largest
from ffr_dyn.kernels.tables import FAILED, IN_V, IN_X, NOT_CONVERGED, N
from ffr_dyn.kernels.vectors import to_body, to_global


@kernel
def carry(bodies, x0, step, x):
    """x = x0 moved by `step`, shaped like v: translations and elastic coordinates add, rotation vectors in body axes turn.

    p = p0 (cos |theta|/2, sin |theta|/2 theta/|theta|): the exponential map of R^3 x S^3 x R^n.
    """
    for b in range(bodies.mass.size):
        n, i, j = bodies.where[b, N], bodies.where[b, IN_X], bodies.where[b, IN_V]
        for k in range(3):
            x[i + k] = x0[i + k] + step[j + k]
        tx, ty, tz = 0.5 * step[j + 3], 0.5 * step[j + 4], 0.5 * step[j + 5]
        angle = (tx * tx + ty * ty + tz * tz) ** 0.5
        e0, share = math.cos(angle), 1.0 - angle * angle / 6.0
        if angle > 1e-4:
            share = math.sin(angle) / angle
        tx, ty, tz = share * tx, share * ty, share * tz
        p0, p1, p2, p3 = x0[i + 3], x0[i + 4], x0[i + 5], x0[i + 6]
        x[i + 3] = p0 * e0 - p1 * tx - p2 * ty - p3 * tz
        x[i + 4] = p1 * e0 + p0 * tx - p3 * ty + p2 * tz
        x[i + 5] = p2 * e0 + p3 * tx + p0 * ty - p1 * tz
        x[i + 6] = p3 * e0 - p2 * tx + p1 * ty + p0 * tz
        for k in range(n):
            x[i + 7 + k] = x0[i + 7 + k] + step[j + 6 + k]


@kernel
def largest_motion(bodies, J, y):
    """(largest length in y, shaped like v; its body): rotations times the radius of gyration, elastic over sqrt(mass)."""
    worst, where = 0.0, 0
    for b in range(bodies.mass.size):
        n, j, mass = bodies.where[b, N], bodies.where[b, IN_V], bodies.mass[b]
        radius = ((J[b, 0, 0] + J[b, 1, 1] + J[b, 2, 2]) / (2.0 * mass)) ** 0.5
        shape = 1.0 / mass**0.5
        for k in range(6 + n):
            size = abs(y[j + k]) * (1.0 if k < 3 else (radius if k < 6 else shape))
            if not size <= worst:  # NaN is largest
                worst, where = size, b
    return worst, where


@kernel
def farthest(bodies, x):
    """The largest coordinate of an origin of a body [m], and the largest elastic one over sqrt(mass)."""
    result = 0.0
    for b in range(bodies.mass.size):
        n, i, mass = bodies.where[b, N], bodies.where[b, IN_X], bodies.mass[b]
        for k in range(3):
            result = max(result, abs(x[i + k]))
        for k in range(n):
            result = max(result, abs(x[i + 7 + k]) / mass**0.5)
    return result


@kernel
def into_body_axes(bodies, x, y, A):
    """In place: the linear parts of y, shaped like v, from global to body axes at x; A (3, 3) is scratch."""
    for b in range(bodies.mass.size):
        i, j = bodies.where[b, IN_X], bodies.where[b, IN_V]
        rotation_matrix(x[i + 3], x[i + 4], x[i + 5], x[i + 6], A)
        y[j], y[j + 1], y[j + 2] = to_body(A, (y[j], y[j + 1], y[j + 2]))


@kernel
def into_global_axes(bodies, x, y, A):
    """In place: the linear parts of y, shaped like v, from body axes at x to global ones; A (3, 3) is scratch."""
    for b in range(bodies.mass.size):
        i, j = bodies.where[b, IN_X], bodies.where[b, IN_V]
        rotation_matrix(x[i + 3], x[i + 4], x[i + 5], x[i + 6], A)
        y[j], y[j + 1], y[j + 2] = to_global(A, (y[j], y[j + 1], y[j + 2]))


@inlined
def converging(change, before, rate, allowed):
    """Whether the error that is left after a correction, by the rate at which corrections shrink, is allowed."""
    shrinks = change / before if before > 0.0 else rate
    return (shrinks < 1.0 and change * shrinks <= (1.0 - shrinks) * allowed) or change <= 1e-3 * allowed


@inlined
def unconverged(r, worst, motion):
    """The status of a step whose iterations fail. info[FAILED]: the worst body, or the number of bodies plus the row.

    motion : the largest correction [m]
    """
    violation = largest(r.work.rows.Phi)
    r.work.info[FAILED] = worst
    if violation > 0.1 * motion:
        for row in range(r.work.rows.Phi.size):
            if abs(r.work.rows.Phi[row]) == violation:
                r.work.info[FAILED] = r.model.bodies.mass.size + row
    return NOT_CONVERGED
