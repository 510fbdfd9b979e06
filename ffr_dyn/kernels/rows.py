"""Constraint rows on two markers i, j: coincidence of points, dot-1, dot-2, driven angle, distance; and relations between
two joint coordinates, on the markers of both joints.

Each returns Phi, nu = dPhi/dt, gamma (Phi_q v_dot = gamma) and, per side, the coefficients of the point's velocity, of
omega_bar and of the rate of the elastic rotation vector (all in body axes).

Twin: `ffr_dyn.equations.constraints.evaluate_word`.
"""

import math

from ffr_dyn.kernels.markers import axis_motion, on_shapes
from ffr_dyn.kernels.options import inlined, kernel
from ffr_dyn.kernels.tables import STROKE, WORDS
from ffr_dyn.kernels.vectors import add, cross, dot, get, scale, subtract, to_body

ZERO = (0.0, 0.0, 0.0)
COINCIDENCE, DOT_1, DOT_2, DRIVEN_ANGLE, DISTANCE, RELATION = range(len(WORDS))


@inlined
def coincidence(w, i, j, c, drive):
    """(r_j - r_i)_c = s(t)."""
    ei, ej = get(w.A[w.body[i]], c), get(w.A[w.body[j]], c)
    side_i = (scale(-1.0, ei), cross(ei, get(w.u, i)), ZERO)
    side_j = (ej, cross(get(w.u, j), ej), ZERO)
    Phi, nu = w.r[j, c] - w.r[i, c] - drive[0], w.rd[j, c] - w.rd[i, c] - drive[1]
    return Phi, nu, w.rb[i, c] - w.rb[j, c] + drive[2], side_i, side_j


@kernel
def axis_side(w, k, a, other):
    """Coefficients of marker k that enters by its axis a (body axes) alone, multiplied by the global vector `other`."""
    turn = cross(a, to_body(w.A[w.body[k]], other))
    return (ZERO, turn, on_shapes(w, k, turn))


@kernel
def dot_1(w, i, j, ai0, aj0):
    """a_i . a_j = 0."""
    ai, gi, di, bi = axis_motion(w, i, ai0)
    aj, gj, dj, bj = axis_motion(w, j, aj0)
    gamma = -dot(bi, gj) - 2.0 * dot(di, dj) - dot(gi, bj)
    nu = dot(di, gj) + dot(gi, dj)
    return dot(gi, gj), nu, gamma, axis_side(w, i, ai, gj), axis_side(w, j, aj, gi)


@kernel
def dot_2(w, i, j, a0, drive):
    """a_i . (r_j - r_i) = s(t)."""
    a, g, rate, bias = axis_motion(w, i, a0)
    d, dd = subtract(get(w.r, j), get(w.r, i)), subtract(get(w.rd, j), get(w.rd, i))
    db = subtract(get(w.rb, j), get(w.rb, i))
    nu = dot(rate, d) + dot(g, dd) - drive[1]
    gamma = drive[2] - dot(bias, d) - 2.0 * dot(rate, dd) - dot(g, db)
    turn = cross(a, to_body(w.A[w.body[i]], d))
    side_i = (scale(-1.0, a), add(turn, cross(a, get(w.u, i))), on_shapes(w, i, turn))
    c = to_body(w.A[w.body[j]], g)
    return dot(g, d) - drive[0], nu, gamma, side_i, (c, cross(get(w.u, j), c), ZERO)


@kernel
def driven_angle(w, i, j, f, g, fj0, drive):
    """(-sin(alpha) f_i + cos(alpha) g_i) . f_j = 0: f_j stands at the angle alpha(t) in the plane of f_i, g_i.

    The sine of what it is off; beyond a quarter of a turn two less the sine, which goes on to grow.
    """
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
    nu, Phi, side = dot(rate, gj) + dot(gi, dj), dot(gi, gj), 1.0
    if dot(gl, gj) < 0.0:
        nu, Phi, gamma, side = -nu, math.copysign(2.0, Phi) - Phi, -gamma, -1.0
    return Phi, nu, gamma, axis_side(w, i, ai, scale(side, gj)), axis_side(w, j, aj, scale(side, gi))


@kernel
def distance(w, i, j, drive):
    """(|r_j - r_i|^2 - s(t)^2) / (2 s(t)) = 0, which near zero is the distance less s."""
    d, dd = subtract(get(w.r, j), get(w.r, i)), subtract(get(w.rd, j), get(w.rd, i))
    db = subtract(get(w.rb, j), get(w.rb, i))
    s, speed, second = drive
    # with Phi = (d.d / s - s) / 2; Phi_ddot = Phi_q v_dot - gamma
    square, rate = dot(d, d), dot(d, dd)
    nu = rate / s - 0.5 * speed * (square / (s * s) + 1.0)
    quadratic = dot(dd, dd) + dot(d, db) - 2.0 * rate * speed / s + square * speed * speed / (s * s)
    gamma = -quadratic / s + 0.5 * second * (square / (s * s) + 1.0)
    bi, bj = to_body(w.A[w.body[i]], scale(-1.0 / s, d)), to_body(w.A[w.body[j]], scale(1.0 / s, d))
    side_i, side_j = (bi, cross(get(w.u, i), bi), ZERO), (bj, cross(get(w.u, j), bj), ZERO)
    return 0.5 * (square / s - s), nu, gamma, side_i, side_j


@kernel
def combined(a, side_a, b, side_b):
    """a side_a + b side_b of the coefficients of a side."""
    return (
        add(scale(a, side_a[0]), scale(b, side_b[0])),
        add(scale(a, side_a[1]), scale(b, side_b[1])),
        add(scale(a, side_a[2]), scale(b, side_b[2])),
    )


@kernel
def coordinate(kind, first, second, third, w, i, j):
    """Value, rate, right-hand side and sides of a joint coordinate; axes f_i, g_i, f_j of an angle, or h_i of a stroke."""
    if kind == STROKE:
        return dot_2(w, i, j, first, ZERO)
    c, c_rate, c_gamma, ci, cj = dot_1(w, i, j, first, third)
    s, s_rate, s_gamma, si, sj = dot_1(w, i, j, second, third)
    square = c * c + s * s
    rate = (c * s_rate - s * c_rate) / square
    gamma = (c * s_gamma - s * c_gamma + 2.0 * rate * (c * c_rate + s * s_rate)) / square
    side_i, side_j = combined(c / square, si, -s / square, ci), combined(c / square, sj, -s / square, cj)
    return math.atan2(s, c), rate, gamma, side_i, side_j


@kernel
def fill_relation(axes, relation, drive, markers, at, w, row, first_side, lane):
    """a_1 coordinate_1 + a_2 coordinate_2 = s(t), up to the spacing of values that whole turns make equivalent."""
    Phi, nu, gamma = -drive[0], -drive[1], drive[2]
    for k in range(2):
        factor, first = relation[2 * k], 3 * k
        value, rate, of_coordinate, side_i, side_j = coordinate(
            int(relation[2 * k + 1]), get(axes, first), get(axes, first + 1), get(axes, first + 2),
            markers, at[2 * k], at[2 * k + 1],
        )  # fmt: skip
        Phi += factor * value
        nu += factor * rate
        gamma += factor * of_coordinate
        fill_side(w.jac[first_side + 2 * k], lane, factor, side_i)
        fill_side(w.jac[first_side + 2 * k + 1], lane, factor, side_j)
    if relation[4] > 0.0:
        Phi -= relation[4] * round(Phi / relation[4])
    w.Phi[row], w.nu[row], w.gamma[row] = Phi, nu, gamma


@kernel
def fill_side(jac, lane, factor, side):
    """Written out: tuples are slow to index by a loop."""
    point, turn, elastic = side
    jac[0, lane], jac[1, lane], jac[2, lane] = factor * point[0], factor * point[1], factor * point[2]
    jac[3, lane], jac[4, lane], jac[5, lane] = factor * turn[0], factor * turn[1], factor * turn[2]
    jac[6, lane], jac[7, lane], jac[8, lane] = factor * elastic[0], factor * elastic[1], factor * elastic[2]


@kernel
def row_of(kind, axes, drive, w, i, j):
    """The row of one word."""
    if kind == DOT_1:
        return dot_1(w, i, j, get(axes, 0), get(axes, 2))
    if kind == DOT_2:
        return dot_2(w, i, j, get(axes, 0), drive)
    if kind == DISTANCE:
        return distance(w, i, j, drive)
    return driven_angle(w, i, j, get(axes, 0), get(axes, 1), get(axes, 2), drive)


@inlined
def evaluate_block(rows, functions, markers, w, k):
    """Fill the rows of block k of w (a RowWork); markers: MarkerWork; functions (F, 3)."""
    i, j, first_side = rows.marker[k, 0], rows.marker[k, 1], k * rows.marker.shape[1]
    for row in range(rows.start[k], rows.forced[k]):
        drive, lane = ZERO, row - rows.start[k]
        if rows.function[row] >= 0:
            drive = get(functions, rows.function[row])
        if rows.kind[row] == RELATION:
            fill_relation(rows.axes[row], rows.relation[row], drive, markers, rows.marker[k], w, row, first_side, lane)
            continue
        if rows.kind[row] == COINCIDENCE:
            Phi, nu, gamma, side_i, side_j = coincidence(markers, i, j, int(rows.axes[row, 0, 0]), drive)
            w.Phi[row], w.nu[row], w.gamma[row] = Phi, nu, gamma
            fill_side(w.jac[first_side], lane, 1.0, side_i)
            fill_side(w.jac[first_side + 1], lane, 1.0, side_j)
            continue
        Phi, nu, gamma, side_i, side_j = row_of(rows.kind[row], rows.axes[row], drive, markers, i, j)
        w.Phi[row], w.nu[row], w.gamma[row] = Phi, nu, gamma
        fill_side(w.jac[first_side], lane, 1.0, side_i)
        fill_side(w.jac[first_side + 1], lane, 1.0, side_j)


@kernel
def reaction(rw, rows, k, side):
    """(force, moment about the body's origin) in body axes that block k takes from the body of a side."""
    jac, first = rw.jac[k * rows.marker.shape[1] + side], rows.start[k]
    force, moment = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for lane in range(rows.forced[k] - first):
        lam = rw.lam[first + lane]
        force = add(force, (jac[0, lane] * lam, jac[1, lane] * lam, jac[2, lane] * lam))
        moment = add(moment, (jac[3, lane] * lam, jac[4, lane] * lam, jac[5, lane] * lam))
    return force, moment
