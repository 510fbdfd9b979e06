"""Bodies in space: the equations of one body for its six rigid coordinates; `planar` has those for three, by the same names.

The mass matrix [[m I, -s~, I3], [s~, J, H], [I3^T, H^T, I]] in body axes depends on q alone (Shabana 2013, ch. 5, written for
body-frame velocities); see `ffr_dyn.equations.inertia` for the readable form of every term.

Twin: `ffr_dyn.equations.inertia.mass_matrix`,
`ffr_dyn.equations.inertia.quadratic_velocity`.
"""

from ffr_dyn.kernels.options import inlined, kernel
from ffr_dyn.kernels.products import contract
from ffr_dyn.kernels.simd.slices import part, six_parts, three_parts
from ffr_dyn.kernels.tables import IN_PP_DM, IN_Q, IN_SHARED, IN_V, PP_PLAN, N
from ffr_dyn.kernels.vectors import (
    cholesky_six,
    copy,
    cross,
    dot,
    lower_six,
    six_rows,
    three_rows,
    upper_six,
    weighted_product,
)


@inlined
def coupling(bodies, w, b):
    """P_dm, H, dinv of body b: what couples its rigid and its elastic coordinates, and the inverse elastic diagonal."""
    n, e, shared = bodies.where[b, N], bodies.where[b, IN_Q], bodies.where[b, IN_SHARED]
    return part(bodies.P_dm, 3 * shared, 3 * n), part(w.H, 3 * e, 3 * n), part(w.dinv, shared, n)


@inlined
def flexible_terms(bodies, w, b, q, qd, omega, gravity, second, s):
    """Elastic right-hand side; returns (first moment, I3 q_dot, second moment of mass, sym D, axial D) of the body."""
    n, e, start, c = bodies.where[b, N], bodies.where[b, IN_Q], bodies.where[b, IN_PP_DM], bodies.where[b, IN_SHARED]
    g, l = part(w.g, 9 * w.terms[b], 9 * n), part(w.l, 3 * w.terms[b], 3 * n)  # noqa: E741
    rP, P = part(bodies.rP_dm, 9 * c, 9 * n), part(bodies.P_dm, 3 * c, 3 * n)
    contract(bodies.PP_dm, start, bodies.blocks, bodies.where[b, PP_PLAN], q, qd, 9 * n, 3 * n, w.sorted, rP, g, l)
    copy(part(w.H, 3 * e, 3 * n), part(g, 6 * n, 3 * n))
    ox, oy, oz = omega
    xx, yy, zz = oy * oy + oz * oz, ox * ox + oz * oz, ox * ox + oy * oy
    xy, xz, yz = -2.0 * ox * oy, -2.0 * ox * oz, -2.0 * oy * oz
    first = bodies.where[b, IN_V] + 6
    f = part(w.f, first, n)
    omega2, damping = part(bodies.omega2, c, n), part(bodies.two_zeta_omega, c, n)
    g0, g1, g2, g3, g4, g5 = six_parts(g, n)
    h0, h1, h2 = three_parts(part(g, 6 * n, 3 * n), n)
    l0, l1, l2 = three_parts(l, n)
    r0, r1, r2, r3, r4, r5 = six_parts(rP, n)
    P0, P1, P2 = three_parts(P, n)
    s0, s1, s2, p0, p1, p2 = s[0], s[1], s[2], 0.0, 0.0, 0.0
    w0, w1, w2, w3, w4, w5 = second
    d0, d1, d2, d3, d4, d5, a0, a1, a2 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(n):  # in one loop: each row is loaded once, and a short loop costs as much as what is in it
        x, y = q[j], qd[j]
        s0 += P0[j] * x
        s1 += P1[j] * x
        s2 += P2[j] * x
        p0 += P0[j] * y
        p1 += P1[j] * y
        p2 += P2[j] * y
        w0 += (r0[j] + g0[j]) * x
        w1 += (r1[j] + g1[j]) * x
        w2 += (r2[j] + g2[j]) * x
        w3 += (r3[j] + g3[j]) * x
        w4 += (r4[j] + g4[j]) * x
        w5 += (r5[j] + g5[j]) * x
        d0 += g0[j] * y
        d1 += g1[j] * y
        d2 += g2[j] * y
        d3 += g3[j] * y
        d4 += g4[j] * y
        d5 += g5[j] * y
        a0 += h0[j] * y
        a1 += h1[j] * y
        a2 += h2[j] * y
        f[j] = (
            xx * g0[j] + yy * g1[j] + zz * g2[j] + xy * g3[j] + xz * g4[j] + yz * g5[j]
            - 2.0 * (ox * l0[j] + oy * l1[j] + oz * l2[j])
            + gravity[0] * P0[j] + gravity[1] * P1[j] + gravity[2] * P2[j]
            - omega2[j] * x - damping[j] * y
        )  # fmt: skip
    return (s0, s1, s2), (p0, p1, p2), (w0, w1, w2, w3, w4, w5), (d0, d1, d2, d3, d4, d5), (a0, a1, a2)


@kernel
def forces(f, mass, s, J, pd, D, D_axial, omega, gravity):
    """f (6,) of a body: gravity and what is quadratic in the velocities.

    pd, D, D_axial : rates of the first moment and, half, of the second
    """
    centrifugal = cross(omega, cross(omega, s))
    coriolis = cross(omega, pd)
    J_omega = (dot(J[0], omega), dot(J[1], omega), dot(J[2], omega))
    gyroscopic = cross(omega, J_omega)
    moment = cross(s, gravity)
    trace = D[0] + D[1] + D[2]
    skew = cross(omega, D_axial)  # D^T omega = D_sym omega - 1/2 omega x axial(D)
    D_omega = (
        D[0] * omega[0] + D[3] * omega[1] + D[4] * omega[2],
        D[3] * omega[0] + D[1] * omega[1] + D[5] * omega[2],
        D[4] * omega[0] + D[5] * omega[1] + D[2] * omega[2],
    )
    for k in range(3):
        f[k] = mass * gravity[k] - centrifugal[k] - 2.0 * coriolis[k]
        f[3 + k] = moment[k] - gyroscopic[k] - 2.0 * (trace * omega[k] - D_omega[k] + 0.5 * skew[k])


@kernel
def rotational_rows(s, J, M):
    """Fill the last three rows of the rigid block of the mass matrix."""
    for r in range(3):
        for c in range(3):
            M[3 + r, 3 + c] = J[r, c]
        M[3 + r, r] = 0.0
    M[3, 1], M[3, 2] = -s[2], s[1]
    M[4, 0], M[4, 2] = s[2], -s[0]
    M[5, 0], M[5, 1] = -s[1], s[0]


@inlined
def factorise(bodies, w, b):
    """Cholesky factor w.L of the Schur complement of body b on its elastic block. Returns True when it is positive."""
    L = w.L[b]
    P, H, dinv = coupling(bodies, w, b)
    rotational_rows(w.s[b], w.J[b], L)
    reduce_rotation(P, H, dinv, L, bodies.where[b, N])
    return cholesky_six(w.T[b], L)


@kernel
def reduce_rotation(P, H, dinv, L, n):
    """Rotational rows of [M] - C dinv C^T, with C = [P_dm; H], in one loop over the elastic coordinates."""
    (p0, p1, p2), (h0, h1, h2) = three_parts(P, n), three_parts(H, n)
    xp, xq, xr, yp, yq, yr, zp, zq, zr = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    xx, xy, xz, yy, yz, zz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(n):
        x, y, z = dinv[j] * h0[j], dinv[j] * h1[j], dinv[j] * h2[j]
        xp += x * p0[j]
        xq += x * p1[j]
        xr += x * p2[j]
        yp += y * p0[j]
        yq += y * p1[j]
        yr += y * p2[j]
        zp += z * p0[j]
        zq += z * p1[j]
        zr += z * p2[j]
        xx += x * h0[j]
        xy += x * h1[j]
        xz += x * h2[j]
        yy += y * h1[j]
        yz += y * h2[j]
        zz += z * h2[j]
    L[3, 0] -= xp
    L[3, 1] -= xq
    L[3, 2] -= xr
    L[4, 0] -= yp
    L[4, 1] -= yq
    L[4, 2] -= yr
    L[5, 0] -= zp
    L[5, 1] -= zq
    L[5, 2] -= zr
    L[3, 3] -= xx
    L[4, 3] -= xy
    L[5, 3] -= xz
    L[4, 4] -= yy
    L[5, 4] -= yz
    L[5, 5] -= zz


@inlined
def reduce_forces(bodies, w, b, f, z):
    """z = L^-1 (z - C dinv f_elastic), and dinv f_elastic where the elastic accelerations of body b will be."""
    n = bodies.where[b, N]
    if n > 0:
        P, H, dinv = coupling(bodies, w, b)
        reduce_elastic(P, H, dinv, part(f, 6, n), n, z, part(w.acc, bodies.where[b, IN_V] + 6, n))
    lower_six(w.L[b], z)


@kernel
def reduce_elastic(P, H, dinv, d, n, z, elastic):
    """elastic = dinv d, z -= C elastic."""
    (p0, p1, p2), (h0, h1, h2) = three_parts(P, n), three_parts(H, n)
    t0, t1, t2, t3, t4, t5 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(n):
        y = dinv[k] * d[k]
        elastic[k] = y
        t0 += p0[k] * y
        t1 += p1[k] * y
        t2 += p2[k] * y
        t3 += h0[k] * y
        t4 += h1[k] * y
        t5 += h2[k] * y
    z[0] -= t0
    z[1] -= t1
    z[2] -= t2
    z[3] -= t3
    z[4] -= t4
    z[5] -= t5


@inlined
def accelerate(bodies, w, b, z, acc):
    """z = L^-T z, which is the rigid part of acc; its elastic part, less dinv C^T z."""
    n = bodies.where[b, N]
    upper_six(w.L[b], z)
    for k in range(6):
        acc[k] = z[k]
    if n > 0:
        P, H, dinv = coupling(bodies, w, b)
        substitute(P, H, dinv, z, n, part(acc, 6, n))


@kernel
def substitute(P, H, dinv, z, n, elastic):
    """elastic -= dinv C^T z."""
    (p0, p1, p2), (h0, h1, h2) = three_parts(P, n), three_parts(H, n)
    z0, z1, z2, z3, z4, z5 = z[0], z[1], z[2], z[3], z[4], z[5]
    for k in range(n):
        elastic[k] -= dinv[k] * (p0[k] * z0 + p1[k] * z1 + p2[k] * z2 + h0[k] * z3 + h1[k] * z4 + h2[k] * z5)


@inlined
def couple_motions(P, H, y, n, out):
    """out += what couples the rigid coordinates of a body with its elastic ones, and these with themselves, times y."""
    linear, angular = (y[0], y[1], y[2]), (y[3], y[4], y[5])
    momentum, spin = three_rows(P, part(y, 6, n), n), three_rows(H, part(y, 6, n), n)
    for k in range(3):
        out[k] += momentum[k]
        out[3 + k] += spin[k]
    add_motion(P, H, linear, angular, part(y, 6, n), n, part(out, 6, n))


@kernel
def add_motion(P, H, linear, angular, q, n, out):
    """out += P^T linear + H^T angular + q."""
    (p0, p1, p2), (h0, h1, h2) = three_parts(P, n), three_parts(H, n)
    for j in range(n):
        out[j] += (
            p0[j] * linear[0] + p1[j] * linear[1] + p2[j] * linear[2]
            + h0[j] * angular[0] + h1[j] * angular[1] + h2[j] * angular[2] + q[j]
        )  # fmt: skip


# ---- markers -------------------------------------------------------------------------------------------------------------


@kernel
def marker_motion(phi, q, n):
    """(displacement, rotation) of a marker by its six pooled rows."""
    u0, u1, u2, t0, t1, t2 = six_rows(phi, q, n)
    return (u0, u1, u2), (t0, t1, t2)


@kernel
def prepare_marker(phi, P_dm, dinv, n, P):
    """Rows of the translations of P = [P_dm; H] dinv phi^T, 6 x 6, which depend on the elastic diagonal alone."""
    for r in range(3):
        for c in range(6):
            P[6 * r + c] = weighted_product(part(P_dm, r * n, n), part(phi, c * n, n), dinv, n)


@kernel
def couple_marker(phi, H, dinv, n, P):
    """Rows of the rotations of P: what a unit wrench on a marker does to them through the elastic coordinates."""
    for r in range(3):
        row, at = part(H, r * n, n), 18 + 6 * r
        p0, p1, p2, p3, p4, p5 = six_parts(phi, n)
        t0, t1, t2, t3, t4, t5 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for c in range(n):
            y = dinv[c] * row[c]
            t0 += p0[c] * y
            t1 += p1[c] * y
            t2 += p2[c] * y
            t3 += p3[c] * y
            t4 += p4[c] * y
            t5 += p5[c] * y
        P[at], P[at + 1], P[at + 2], P[at + 3], P[at + 4], P[at + 5] = t0, t1, t2, t3, t4, t5


@kernel
def couple_pair(left, right, dinv, n, out):
    """out, 6 x 6, = phi_left dinv phi_right^T of two markers on one body."""
    p0, p1, p2, p3, p4, p5 = six_parts(right, n)
    for r in range(6):
        own = part(left, r * n, n)
        t0, t1, t2, t3, t4, t5 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for j in range(n):
            y = dinv[j] * own[j]
            t0 += y * p0[j]
            t1 += y * p1[j]
            t2 += y * p2[j]
            t3 += y * p3[j]
            t4 += y * p4[j]
            t5 += y * p5[j]
        at = 6 * r
        out[at], out[at + 1], out[at + 2], out[at + 3], out[at + 4], out[at + 5] = t0, t1, t2, t3, t4, t5
