"""Bushings: six coordinates between two markers, three displacements in the axes of i and a rotation vector.

With the axes a_k of i and b_l of j, B_kl = a_k . b_l is the relative rotation. Its axial vector z = sin(phi) axis and its
trace 1 + 2 cos(phi) give the rotation vector psi = z phi / sin(phi). All are made of products of axes, whose gradients are
those of the dot-1 and dot-2 rows; the chain rule gives the generalised forces.

Twin: `ffr_dyn.equations.forces.applied`.
"""

import math

from ffr_dyn.kernels.forces.coordinate import apply_side, three
from ffr_dyn.kernels.forces.curve import curve_slope, curve_value
from ffr_dyn.kernels.forces.implicit import keep_row
from ffr_dyn.kernels.markers import axis_motion, on_shapes
from ffr_dyn.kernels.options import kernel
from ffr_dyn.kernels.rows import ZERO
from ffr_dyn.kernels.simd.force_kernel import force_kernel
from ffr_dyn.kernels.simd.slices import part, vector_at
from ffr_dyn.kernels.tables import BLOCK, END_I, END_J, LAW, MEASURED, OK, PLACE, Tables, Vector
from ffr_dyn.kernels.vectors import add, cross, dot, get, put, scale, subtract, to_body

LEAST_SINE = 1e-16  # of a turn that is taken for half a one


@kernel
def move_axes(frames, w, axes, i, j):
    """axes (2, 4, 3, 3): by side, of the three axes, frames (18,), value in body axes, global value and rate, and quadratic
    velocity part of the second derivative."""
    for side in range(2):
        marker = i if side == 0 else j
        for c in range(3):
            a, g, rate, bias = axis_motion(w, marker, three(frames, 9 * side + 3 * c))
            put(axes[side, 0], c, a)
            put(axes[side, 1], c, g)
            put(axes[side, 2], c, rate)
            put(axes[side, 3], c, bias)


@kernel
def relate(axes, B):
    """B[0] = a_k . b_l and its rate B[1]."""
    for k in range(3):
        for l in range(3):  # noqa: E741
            B[0, k, l] = dot(get(axes[0, 1], k), get(axes[1, 1], l))
            B[1, k, l] = dot(get(axes[0, 2], k), get(axes[1, 1], l)) + dot(get(axes[0, 1], k), get(axes[1, 2], l))


@kernel
def half_axial(B):
    return (0.5 * (B[2, 1] - B[1, 2]), 0.5 * (B[0, 2] - B[2, 0]), 0.5 * (B[1, 0] - B[0, 1]))


@kernel
def unit(c):
    return (1.0 if c == 0 else 0.0, 1.0 if c == 1 else 0.0, 1.0 if c == 2 else 0.0)


@kernel
def axis_times_sine(B):
    """z of a rotation B. Half a turn has no sine, and an axis n by B + 1 = 2 n n^T: it has that times a least sine."""
    z = half_axial(B)
    if B[0, 0] + B[1, 1] + B[2, 2] > 0.0 or dot(z, z) > LEAST_SINE * LEAST_SINE:
        return z
    k = 0
    for c in range(1, 3):
        if B[c, c] > B[k, k]:
            k = c
    n = add((B[0, k], B[1, k], B[2, k]), unit(k))
    return scale(LEAST_SINE / dot(n, n) ** 0.5, n)


@kernel
def stretch(s, c):
    """g = phi / s with phi = atan2(s, c), (dg/ds) / s and dg/dc."""
    square = s * s + c * c
    if s < 0.02 * c:
        y = s / c
        y2 = y * y
        g = (1.0 - y2 * (1.0 / 3.0 - y2 * (1.0 / 5.0 - y2 / 7.0))) / c
        return g, -(2.0 / 3.0 - y2 * (4.0 / 5.0 - y2 * 6.0 / 7.0)) / (c * c * c), -1.0 / square
    phi = math.atan2(s, c)
    return phi / s, (s * c / square - phi) / (s * s * s), -1.0 / square


@kernel
def six_forces(data, start, x):
    """x = [displacement (6), rate (6), force (6)]: the force from the others.

    Data: stiffness (36), damping (36), preload (6), start of the curve of each direction or -1 (6).
    """
    for r in range(6):
        force = data[start + 72 + r]
        for c in range(6):
            force -= data[start + 6 * r + c] * x[c] + data[start + 36 + 6 * r + c] * x[6 + c]
        curve = int(data[start + 78 + r])
        if curve >= 0:
            force -= curve_value(data, curve, x[r])
        x[12 + r] = force


@kernel
def measure_bushing(w, s, i, j, x):
    """Displacement and rate into x; returns (z, g, dg/ds / s, dg/dc)."""
    d, dd = subtract(get(w.r, j), get(w.r, i)), subtract(get(w.rd, j), get(w.rd, i))
    for c in range(3):
        x[c] = dot(get(s.axes[0, 1], c), d)
        x[6 + c] = dot(get(s.axes[0, 2], c), d) + dot(get(s.axes[0, 1], c), dd)
    B, rate = s.turn[0], s.turn[1]
    z, z_rate = axis_times_sine(B), half_axial(rate)
    cosine, cosine_rate = 0.5 * (B[0, 0] + B[1, 1] + B[2, 2] - 1.0), 0.5 * (rate[0, 0] + rate[1, 1] + rate[2, 2])
    g, g_s, g_c = stretch(dot(z, z) ** 0.5, cosine)
    g_rate = g_s * dot(z, z_rate) + g_c * cosine_rate
    for c in range(3):
        x[3 + c] = g * z[c]
        x[9 + c] = g * z_rate[c] + g_rate * z[c]
    return z, g, g_s, g_c


@kernel
def curve_motion(w, s, i, j, turn):
    """Quadratic velocity parts of the second derivatives of all six into s.curved.

    On rotations g is a function of the cosine c alone, with (1 - c^2) dg/dc = c g - 1.
    """
    d, dd = subtract(get(w.r, j), get(w.r, i)), subtract(get(w.rd, j), get(w.rd, i))
    db, axes, rate, bias = subtract(get(w.rb, j), get(w.rb, i)), s.axes, s.turn[1], s.turn[2]
    for k in range(3):
        moved = dot(get(axes[0, 3], k), d) + 2.0 * dot(get(axes[0, 2], k), dd)
        s.curved[k] = moved + dot(get(axes[0, 1], k), db)
        for l in range(3):  # noqa: E741
            ends = dot(get(axes[0, 3], k), get(axes[1, 1], l)) + dot(get(axes[0, 1], k), get(axes[1, 3], l))
            bias[k, l] = ends + 2.0 * dot(get(axes[0, 2], k), get(axes[1, 2], l))
    z, g, g_s, g_c = turn
    cosine, square = 0.5 * (s.turn[0, 0, 0] + s.turn[0, 1, 1] + s.turn[0, 2, 2] - 1.0), dot(z, z)
    speed, growth = 0.5 * (rate[0, 0] + rate[1, 1] + rate[2, 2]), 0.5 * (bias[0, 0] + bias[1, 1] + bias[2, 2])
    slope = g_c - cosine * g_s
    second = (g + 3.0 * cosine * slope) / square if square > 1e-3 else 4.0 / 15.0 + 12.0 / 35.0 * (1.0 - cosine)
    z_rate, z_bias, g_bias = half_axial(rate), half_axial(bias), slope * growth + second * speed * speed
    for c in range(3):
        s.curved[3 + c] = g * z_bias[c] + 2.0 * slope * speed * z_rate[c] + g_bias * z[c]


@kernel
def weigh(z, g, g_s, g_c, moment, C):
    """C (3, 3) with moment . d(psi) = sum C_kl dB_kl."""
    power = dot(moment, z)
    y = scale(0.5, add(scale(g, moment), scale(power * g_s, z)))
    for c in range(3):
        C[c, c] = 0.5 * power * g_c
    C[2, 1], C[1, 2] = y[0], -y[0]
    C[0, 2], C[2, 0] = y[1], -y[1]
    C[1, 0], C[0, 1] = y[2], -y[2]


@kernel
def turning_side(w, marker, axes, others, C, transposed):
    """The side of sum C_kl d(a_k . b_l) that moves `axes` (body axes) of a marker, with the global axes `others` held."""
    A, turning = w.A[w.body[marker]], ZERO
    for k in range(3):
        sum_k = ZERO
        for l in range(3):  # noqa: E741
            sum_k = add(sum_k, scale(C[l, k] if transposed else C[k, l], get(others, l)))
        turning = add(turning, cross(get(axes, k), to_body(A, sum_k)))
    return ZERO, turning, on_shapes(w, marker, turning)


@kernel
def combine(a, b, c, x):
    """x_0 a + x_1 b + x_2 c."""
    return add(scale(x[0], a), add(scale(x[1], b), scale(x[2], c)))


@kernel
def combine_axes(axes, x):
    return combine(get(axes, 0), get(axes, 1), get(axes, 2), x)


@kernel
def displacement_sides(w, axes, i, j, force):
    """Sides of a force (3,) on the displacement."""
    on_i, on_j = combine_axes(axes[0, 0], force), to_body(w.A[w.body[j]], combine_axes(axes[0, 1], force))
    turn = cross(on_i, to_body(w.A[w.body[i]], subtract(get(w.r, j), get(w.r, i))))
    side_i = (scale(-1.0, on_i), add(turn, cross(on_i, get(w.u, i))), on_shapes(w, i, turn))
    return side_i, (on_j, cross(get(w.u, j), on_j), ZERO)


@kernel
def rotation_sides(w, s, i, j, turn, moment):
    """Sides of a moment (3,) on the rotation vector; turn: what `measure_bushing` returned."""
    z, g, g_s, g_c = turn
    weigh(z, g, g_s, g_c, moment, s.turn[2])
    side_i = turning_side(w, i, s.axes[0, 0], s.axes[1, 1], s.turn[2], False)
    return side_i, turning_side(w, j, s.axes[1, 0], s.axes[0, 1], s.turn[2], True)


@kernel
def keep_rows(r, k, turn, x):
    """The rows of the directions that have stiffness or damping, where the bushing is implicit.

    Data: after those of the force slopes that exceed stiffness (6) and damping (6), whatever couples the directions.
    """
    w, s, loads = r.work.markers, r.work.loads, r.model.loads
    if loads.row[k, BLOCK] < 0:
        return
    data, start, i, j, number = loads.data, loads.row[k, LAW], loads.row[k, END_I], loads.row[k, END_J], 0
    curve_motion(w, s, i, j, turn)
    curved = s.curved
    for c in range(6):
        stiffness, damping, curve = data[start + 84 + c], data[start + 90 + c], int(data[start + 78 + c])
        if stiffness <= 0.0 and damping <= 0.0 and curve < 0:
            continue
        if curve >= 0:
            stiffness += curve_slope(data, curve, x[c])
        if c < 3:
            side_i, side_j = displacement_sides(w, s.axes, i, j, unit(c))
        else:
            side_i, side_j = rotation_sides(w, s, i, j, turn, unit(c - 3))
        keep_row(r, k, number, x[c], x[6 + c], (curved[c], side_i, side_j), stiffness, damping)
        number += 1


@kernel
def measure_six(r, k):
    """Displacement and rate of bushing k into what is measured of it; returns what `measure_bushing` does."""
    w, s, loads = r.work.markers, r.work.loads, r.model.loads
    i, j = loads.row[k, END_I], loads.row[k, END_J]
    move_axes(part(loads.data, loads.row[k, PLACE], 18), w, s.axes, i, j)
    relate(s.axes, s.turn)
    return measure_bushing(w, s, i, j, part(s.measured, loads.row[k, MEASURED], 18))


@force_kernel
def bushing(r: Tables, k: int, x: Vector, f: Vector) -> int:
    """Adds the bushing to f, and keeps displacement, rate and force."""
    m, w, s, loads = r.model, r.work.markers, r.work.loads, r.model.loads
    where, markers, i, j = m.bodies.where, m.markers, loads.row[k, END_I], loads.row[k, END_J]
    turn, six = measure_six(r, k), part(s.measured, loads.row[k, MEASURED], 18)
    six_forces(loads.data, loads.row[k, LAW], six)
    own = vector_at(f, r.v.size)
    side_i, side_j = displacement_sides(w, s.axes, i, j, (six[12], six[13], six[14]))
    apply_side(where, markers, w, own, i, 1.0, side_i)
    apply_side(where, markers, w, own, j, 1.0, side_j)
    side_i, side_j = rotation_sides(w, s, i, j, turn, (six[15], six[16], six[17]))
    apply_side(where, markers, w, own, i, 1.0, side_i)
    apply_side(where, markers, w, own, j, 1.0, side_j)
    keep_rows(r, k, turn, six)
    return OK
