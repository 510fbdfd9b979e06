"""Constraint rows on two markers i, j: coincidence of points, dot-1, dot-2, driven angle.

Each returns Phi, nu = dPhi/dt, gamma (Phi_q v_dot = gamma) and, per side, the coefficients of the point's velocity, of
omega_bar and of the elastic rotation rate (all in body axes). Readable twin: `ffr_dyn.constraints`.
"""

import math

from ffr_dyn.kernels.markers import axis_motion
from ffr_dyn.kernels.options import kernel
from ffr_dyn.kernels.tables import COINCIDENCE, DOT_1, DOT_2
from ffr_dyn.kernels.vectors import add, cross, dot, get, scale, subtract, to_body

ZERO = (0.0, 0.0, 0.0)


@kernel
def coincidence(w, i, j, c):
    """(r_j - r_i)_c = 0."""
    ei, ej = get(w.A[i], c), get(w.A[j], c)
    side_i = (scale(-1.0, ei), cross(ei, get(w.u, i)), ZERO)
    side_j = (ej, cross(get(w.u, j), ej), ZERO)
    return w.r[j, c] - w.r[i, c], w.rd[j, c] - w.rd[i, c], w.rb[i, c] - w.rb[j, c], side_i, side_j


@kernel
def axis_side(A, a, a0, other):
    """Coefficients of a side that enters by its axis a (undeformed a0) alone, multiplied by the global vector `other`."""
    b = to_body(A, other)
    return (ZERO, cross(a, b), cross(a0, b))


@kernel
def dot_1(w, i, j, ai0, aj0):
    """a_i . a_j = 0."""
    ai, gi, di, bi = axis_motion(w, i, ai0)
    aj, gj, dj, bj = axis_motion(w, j, aj0)
    gamma = -dot(bi, gj) - 2.0 * dot(di, dj) - dot(gi, bj)
    nu = dot(di, gj) + dot(gi, dj)
    return dot(gi, gj), nu, gamma, axis_side(w.A[i], ai, ai0, gj), axis_side(w.A[j], aj, aj0, gi)


@kernel
def dot_2(w, i, j, a0, drive):
    """a_i . (r_j - r_i) = s(t)."""
    a, g, rate, bias = axis_motion(w, i, a0)
    d, dd = subtract(get(w.r, j), get(w.r, i)), subtract(get(w.rd, j), get(w.rd, i))
    db = subtract(get(w.rb, j), get(w.rb, i))
    nu = dot(rate, d) + dot(g, dd) - drive[1]
    gamma = drive[2] - dot(bias, d) - 2.0 * dot(rate, dd) - dot(g, db)
    b = to_body(w.A[i], d)
    side_i = (scale(-1.0, a), add(cross(a, b), cross(a, get(w.u, i))), cross(a0, b))
    c = to_body(w.A[j], g)
    return dot(g, d) - drive[0], nu, gamma, side_i, (c, cross(get(w.u, j), c), ZERO)


@kernel
def driven_angle(w, i, j, f, g, fj0, drive):
    """(-sin(alpha) f_i + cos(alpha) g_i) . f_j = 0: f_j stands at the angle alpha(t) in the plane of f_i, g_i."""
    alpha, speed, second = drive
    sine, cosine = math.sin(alpha), math.cos(alpha)
    along = add(scale(cosine, f), scale(sine, g))
    across = add(scale(-sine, f), scale(cosine, g))  # d(across)/dt = -speed along
    ai, gi, di, bi = axis_motion(w, i, across)
    _, gl, dl, _ = axis_motion(w, i, along)
    aj, gj, dj, bj = axis_motion(w, j, fj0)
    rate = subtract(di, scale(speed, gl))
    prescribed = add(scale(-second, gl), scale(-speed * speed, gi))
    bias = add(bi, add(prescribed, scale(-2.0 * speed, dl)))
    gamma = -dot(bias, gj) - 2.0 * dot(rate, dj) - dot(gi, bj)
    nu = dot(rate, gj) + dot(gi, dj)
    return dot(gi, gj), nu, gamma, axis_side(w.A[i], ai, across, gj), axis_side(w.A[j], aj, fj0, gi)


@kernel
def row_of(kind, axes, drive, w, i, j):
    """The row of one word."""
    if kind == COINCIDENCE:
        return coincidence(w, i, j, int(axes[0, 0]))
    if kind == DOT_1:
        return dot_1(w, i, j, get(axes, 0), get(axes, 2))
    if kind == DOT_2:
        return dot_2(w, i, j, get(axes, 0), drive)
    return driven_angle(w, i, j, get(axes, 0), get(axes, 1), get(axes, 2), drive)


@kernel
def evaluate_block(rows, functions, markers, w, k):
    """Fill the rows of block k of w (a RowWork); markers: MarkerWork; functions (F, 3)."""
    i, j = rows.marker[k, 0], rows.marker[k, 1]
    for row in range(rows.start[k], rows.start[k + 1]):
        drive = ZERO
        if rows.function[row] >= 0:
            drive = get(functions, rows.function[row])
        Phi, nu, gamma, side_i, side_j = row_of(rows.kind[row], rows.axes[row], drive, markers, i, j)
        w.Phi[row], w.nu[row], w.gamma[row] = Phi, nu, gamma
        for part in range(3):
            for c in range(3):
                w.jac[row, 0, 3 * part + c] = side_i[part][c]
                w.jac[row, 1, 3 * part + c] = side_j[part][c]
