"""Markers: points and axes that move with the deformation; their velocities and bias accelerations.

    u = u_0 + phi_t q - 1/2 q K_t q        P_t = phi_t - K_t q        theta = phi_r q - 1/2 q K_r q        P_r = phi_r - K_r q

with K of second-order bodies, zero of linear ones. Axes turn by exp(theta), so that they stay orthonormal.

Twin: `ffr_dyn.equations.kinematics.point_motion`,
`ffr_dyn.equations.kinematics.axis_motion`.
"""

import math

from ffr_dyn.kernels import planar, spatial
from ffr_dyn.kernels.options import inlined, kernel
from ffr_dyn.kernels.products import contract
from ffr_dyn.kernels.simd.slices import part, six_parts
from ffr_dyn.kernels.tables import BEND_PLAN, COUNT, IN_BENDING, IN_V, IN_X, LANES, NORMAL, TURNS, N
from ffr_dyn.kernels.vectors import add, copy, cross, dot, fill, get, in_plane, put, scale, to_body, to_global

SMALL = 0.25  # rad^2: below, the functions of a rotation vector by their series, here to rounding
COSINE = tuple((-1.0) ** k / math.factorial(2 * k + 2) for k in range(8))
SINE = tuple((-1.0) ** k / math.factorial(2 * k + 3) for k in range(8))
COSINE_SLOPE = tuple(2.0 * k * COSINE[k] for k in range(1, 8))
SINE_SLOPE = tuple(2.0 * k * SINE[k] for k in range(1, 8))


@inlined
def shapes(markers, phi, k, n):
    """Six pooled rows of n of marker k at q: of the displacement, of the rotation vector."""
    return part(phi, markers.start[k], 6 * n)


@kernel
def elastic_motion(phi, normal, q, n):
    """(displacement, rotation) of a marker that its body's elastic coordinates make, or their rates."""
    if normal >= 0:
        return planar.marker_motion(phi, normal, q, n)
    return spatial.marker_motion(phi, q, n)


@kernel
def row_of(component, normal):
    """Which of the six rows of a marker the components of second order are."""
    if normal < 0:
        return component
    i, j, _ = in_plane(normal)
    return i if component == 0 else (j if component == 1 else 3 + normal)


@inlined
def bend_marker(markers, w, k, n, normal, q, qd):
    """Shapes of marker k of a second-order body at q; w.six: elastic motion, its rate, - q_dot K q_dot."""
    count, start, plan = markers.second[k, COUNT], markers.second[k, IN_BENDING], markers.second[k, BEND_PLAN]
    size, phi = count * n, part(w.phi, markers.start[k], 6 * n)
    table = start + (size + LANES - 1) // LANES * LANES
    straight, now, change = part(markers.bending, start, size), part(w.bent, 0, size), part(w.bent, size + LANES, size)
    contract(markers.bending, table, markers.blocks, plan, q, qd, size, size, w.sorted, straight, now, change)
    fill(part(w.six, 0, 18), 0.0)
    for component in range(count):
        row, at = row_of(component, normal), component * n
        moved, rate, growth = 0.0, 0.0, 0.0
        for j in range(n):
            moved += (straight[at + j] + now[at + j]) * q[j]
            rate += now[at + j] * qd[j]
            growth += change[at + j] * qd[j]
        w.six[0, row], w.six[1, row], w.six[2, row] = 0.5 * moved, rate, growth
        copy(part(phi, row * n, n), part(now, at, n))


@kernel
def series(c, x):
    """c[0] + c[1] x + ... + c[6] x^6."""
    return c[0] + x * (c[1] + x * (c[2] + x * (c[3] + x * (c[4] + x * (c[5] + x * c[6])))))


@kernel
def turn_factors(square):
    """(1 - cos h) / h^2, (h - sin h) / h^3, and their derivatives by h, over h; by h^2."""
    if square < SMALL:
        return series(COSINE, square), series(SINE, square), series(COSINE_SLOPE, square), series(SINE_SLOPE, square)
    h = square**0.5
    sine, rest = math.sin(h), 2.0 * math.sin(0.5 * h) ** 2
    a, b = rest / square, (h - sine) / (h * square)
    return a, b, (sine / h - 2.0 * a) / square, (a - 3.0 * b) / square


@inlined
def turn_marker(w, k, theta, rate, growth, omega):
    """Rotation of marker k by the rotation vector theta, its angular velocity and the bias of its angular acceleration."""
    a, b, slope_a, slope_b = turn_factors(dot(theta, theta))
    x, y, z = theta
    xx, yy, zz, xy, xz, yz = x * x, y * y, z * z, x * y, x * z, y * z
    c = 1.0 - b * (xx + yy + zz)
    put_rotation(w.R[k], c, a, theta, xx, yy, zz, xy, xz, yz)
    put_rotation(w.T[k], a, b, theta, xx, yy, zz, xy, xz, yz)
    across = cross(theta, rate)
    twice = cross(theta, across)
    turned = add(rate, add(scale(a, across), scale(b, twice)))
    along = dot(theta, rate)
    bias = add(add(scale(slope_a * along, across), scale(slope_b * along, twice)), scale(b, cross(rate, across)))
    put(w.spin, k, add(omega, turned))
    put(w.turning, k, add(cross(omega, turned), add(to_global(w.T[k], growth), bias)))


@kernel
def put_rotation(R, c, a, theta, xx, yy, zz, xy, xz, yz):
    """R = 1 + c theta~ + a theta~^2."""
    x, y, z = theta
    R[0, 0], R[1, 1], R[2, 2] = 1.0 - a * (yy + zz), 1.0 - a * (xx + zz), 1.0 - a * (xx + yy)
    R[0, 1], R[0, 2], R[1, 2] = a * xy - c * z, a * xz + c * y, a * yz - c * x
    R[1, 0], R[2, 0], R[2, 1] = a * xy + c * z, a * xz - c * y, a * yz + c * x


@kernel
def put_six(six, row, moved, turned):
    six[row, 0], six[row, 1], six[row, 2] = moved
    six[row, 3], six[row, 4], six[row, 5] = turned


@inlined
def deform_marker(where, markers, w, x, v, k):
    """w.six of marker k and, of a second-order body, its shapes."""
    b, six = markers.body[k], w.six
    n, normal = where[b, N], where[b, NORMAL]
    q, qd = part(x, where[b, IN_X] + 7, n), part(v, where[b, IN_V] + 6, n)
    if markers.second[k, IN_BENDING] >= 0:
        bend_marker(markers, w, k, n, normal, q, qd)
    else:
        phi = shapes(markers, w.phi, k, n)
        moved, turned = elastic_motion(phi, normal, q, n)
        rate, turning = elastic_motion(phi, normal, qd, n)
        put_six(six, 0, moved, turned)
        put_six(six, 1, rate, turning)
        put_six(six, 2, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


@inlined
def update_marker(where, markers, w, x, v, k):
    """Position, velocity, bias acceleration and rotation of marker k."""
    b = markers.body[k]
    u = get(markers.u, k)
    if b == where.shape[0] - 1:
        put(w.r, k, u)
        put(w.u, k, u)
        return
    n, i, j, six = where[b, N], where[b, IN_X], where[b, IN_V], w.six
    A, omega, ud, udd = w.A[b], get(w.omega, b), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    if n > 0:
        deform_marker(where, markers, w, x, v, k)
        u = add(u, (six[0, 0], six[0, 1], six[0, 2]))
        ud, udd = (six[1, 0], six[1, 1], six[1, 2]), (six[2, 0], six[2, 1], six[2, 2])
    if n > 0 and markers.second[k, TURNS] > 0:
        theta, rate = (six[0, 3], six[0, 4], six[0, 5]), (six[1, 3], six[1, 4], six[1, 5])
        turn_marker(w, k, theta, rate, (six[2, 3], six[2, 4], six[2, 5]), omega)
    else:
        put(w.spin, k, omega)
    spin = cross(omega, u)
    put(w.u, k, u)
    put(w.r, k, add((x[i], x[i + 1], x[i + 2]), to_global(A, u)))
    put(w.rd, k, add((v[j], v[j + 1], v[j + 2]), to_global(A, add(spin, ud))))
    put(w.rb, k, to_global(A, add(cross(omega, add(spin, scale(2.0, ud))), udd)))


@kernel
def axis_motion(w, k, a0):
    """Axis a0 (body axes, undeformed) of marker k: (body axes deformed, global value, rate, bias of the acceleration).

    It turns with the marker: a = R a0, a' = omega_m x a. On the ground and on rigid bodies what does not move is zero.
    """
    A, spin = w.A[w.body[k]], get(w.spin, k)
    a = to_global(w.R[k], a0)
    rate = cross(spin, a)
    return a, to_global(A, a), to_global(A, rate), to_global(A, add(cross(get(w.turning, k), a), cross(spin, rate)))


@kernel
def on_shapes(w, k, moment):
    """The generalised force of a moment (body axes) on marker k along its rotation vector."""
    return to_body(w.T[k], moment)


@kernel
def prepare_marker(phi, P_dm, dinv, n, normal, P):
    """Rows of the translations of P = [P_dm; H] dinv phi^T, 6 x 6 or in the plane 3 x 3."""
    if normal >= 0:
        planar.prepare_marker(phi, P_dm, dinv, n, normal, P)
    else:
        spatial.prepare_marker(phi, P_dm, dinv, n, P)


@kernel
def couple_marker(phi, H, dinv, n, normal, P):
    """Rows of the rotations of P."""
    if normal >= 0:
        planar.couple_marker(phi, H, dinv, n, normal, P)
    else:
        spatial.couple_marker(phi, H, dinv, n, P)


@kernel
def couple_pair(left, right, dinv, n, normal, out):
    """out = phi_left dinv phi_right^T of two markers on one body, 6 x 6 or in the plane 3 x 3."""
    if normal >= 0:
        planar.couple_pair(left, right, dinv, n, normal, out)
    else:
        spatial.couple_pair(left, right, dinv, n, out)


@kernel
def project(phi, force, moment, out, n):
    """out += phi_t^T force + phi_r^T moment."""
    p0, p1, p2, p3, p4, p5 = six_parts(phi, n)
    for j in range(n):
        out[j] += (
            p0[j] * force[0] + p1[j] * force[1] + p2[j] * force[2]
            + p3[j] * moment[0] + p4[j] * moment[1] + p5[j] * moment[2]
        )  # fmt: skip


@kernel
def apply_wrench(where, markers, w, f, k, force, moment):
    """Add a force and moment (body axes) on marker k to the right-hand sides f."""
    b = markers.body[k]
    if b == where.shape[0] - 1:
        return
    n, j = where[b, N], where[b, IN_V]
    lever = cross(get(w.u, k), force)
    for c in range(3):
        f[j + c] += force[c]
        f[j + 3 + c] += lever[c] + moment[c]
    if n > 0:
        project(shapes(markers, w.phi, k, n), force, on_shapes(w, k, moment), part(f, j + 6, n), n)
