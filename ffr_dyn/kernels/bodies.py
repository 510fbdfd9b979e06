"""Inertia of one body: mass matrix, quadratic velocity and elastic forces, Schur complement on the 6 x 6 rigid part.

Equations: the mass matrix [[m I, -s~, I3], [s~, J, H], [I3^T, H^T, I]] in body axes depends on q alone (Shabana 2013,
ch. 5, written for body-frame velocities); see `ffr_dyn.equations.inertia` for the readable form of every term.
"""

from ffr_dyn.kernels.options import inlined, kernel
from ffr_dyn.kernels.planar import (
    factorise_in_plane,
    flexible_terms_in_plane,
    forces_in_plane,
    mass_times_in_plane,
    reduce_in_plane,
    substitute_in_plane,
)
from ffr_dyn.kernels.products import contract
from ffr_dyn.kernels.simd.slices import part, six_parts, three_parts
from ffr_dyn.kernels.vectors import (
    cholesky_six,
    cholesky_three,
    copy,
    cross,
    dot,
    get,
    put,
    rigid_lower,
    rigid_upper,
    to_body,
)


@kernel
def rotation_matrix(p0, p1, p2, p3, A):
    A[0, 0] = p0 * p0 + p1 * p1 - p2 * p2 - p3 * p3
    A[0, 1] = 2.0 * (p1 * p2 - p0 * p3)
    A[0, 2] = 2.0 * (p1 * p3 + p0 * p2)
    A[1, 0] = 2.0 * (p1 * p2 + p0 * p3)
    A[1, 1] = p0 * p0 - p1 * p1 + p2 * p2 - p3 * p3
    A[1, 2] = 2.0 * (p2 * p3 - p0 * p1)
    A[2, 0] = 2.0 * (p1 * p3 - p0 * p2)
    A[2, 1] = 2.0 * (p2 * p3 + p0 * p1)
    A[2, 2] = p0 * p0 - p1 * p1 - p2 * p2 + p3 * p3


@kernel
def position_rates(bodies, x, v, xd):
    """x_dot from (x, v): R_dot, p_dot = 1/2 G_bar^T omega_bar, q_dot."""
    for b in range(bodies.mass.size):
        n, i, j = bodies.where[b, 0], bodies.where[b, 1], bodies.where[b, 2]
        for k in range(3):
            xd[i + k] = v[j + k]
        p0, p1, p2, p3 = x[i + 3], x[i + 4], x[i + 5], x[i + 6]
        wx, wy, wz = v[j + 3], v[j + 4], v[j + 5]
        xd[i + 3] = 0.5 * (-p1 * wx - p2 * wy - p3 * wz)
        xd[i + 4] = 0.5 * (p0 * wx - p3 * wy + p2 * wz)
        xd[i + 5] = 0.5 * (p3 * wx + p0 * wy - p1 * wz)
        xd[i + 6] = 0.5 * (-p2 * wx + p1 * wy + p0 * wz)
        for k in range(n):
            xd[i + 7 + k] = v[j + 6 + k]


@kernel
def normalise(bodies, x):
    """Euler parameters back to unit length."""
    for b in range(bodies.mass.size):
        i = bodies.where[b, 1] + 3
        p0, p1, p2, p3 = x[i], x[i + 1], x[i + 2], x[i + 3]
        inverse = 1.0 / (p0 * p0 + p1 * p1 + p2 * p2 + p3 * p3) ** 0.5
        x[i], x[i + 1], x[i + 2], x[i + 3] = inverse * p0, inverse * p1, inverse * p2, inverse * p3


@kernel
def three_rows(rows, q, n):
    """The first three of a pooled array of rows of n, times q: in one loop, which is three times as fast as three."""
    r0, r1, r2 = three_parts(rows, n)
    t0, t1, t2 = 0.0, 0.0, 0.0
    for j in range(n):
        t0 += r0[j] * q[j]
        t1 += r1[j] * q[j]
        t2 += r2[j] * q[j]
    return t0, t1, t2


@kernel
def six_rows(rows, q, n):
    """The first six rows, as `three_rows`."""
    r0, r1, r2, r3, r4, r5 = six_parts(rows, n)
    t0, t1, t2, t3, t4, t5 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(n):
        t0 += r0[j] * q[j]
        t1 += r1[j] * q[j]
        t2 += r2[j] * q[j]
        t3 += r3[j] * q[j]
        t4 += r4[j] * q[j]
        t5 += r5[j] * q[j]
    return t0, t1, t2, t3, t4, t5


@inlined
def flexible_terms(bodies, w, b, q, qd, omega, gravity, second, s):
    """Elastic right-hand side; returns (first moment, I3 q_dot, second moment of mass, sym D, axial D) of the body."""
    n, e, start, c = bodies.where[b, 0], bodies.where[b, 3], bodies.where[b, 4], bodies.where[b, 8]
    g, l = part(w.g, 9 * w.terms[b], 9 * n), part(w.l, 3 * w.terms[b], 3 * n)  # noqa: E741
    rP, P = part(bodies.rP_dm, 9 * c, 9 * n), part(bodies.P_dm, 3 * c, 3 * n)
    contract(bodies.PP_dm, start, bodies.blocks, bodies.where[b, 9], q, qd, 9 * n, 3 * n, w.sorted, rP, g, l)
    copy(part(w.H, 3 * e, 3 * n), part(g, 6 * n, 3 * n))
    ox, oy, oz = omega
    xx, yy, zz = oy * oy + oz * oz, ox * ox + oz * oz, ox * ox + oy * oy
    xy, xz, yz = -2.0 * ox * oy, -2.0 * ox * oz, -2.0 * oy * oz
    first = bodies.where[b, 2] + 6
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


@inlined
def inertia(gravity_field, bodies, w, x, v, b):
    """Rotation, first and second moments, right-hand side w.f (body axes) of body b, without markers' loads."""
    n, i, j, normal = bodies.where[b, 0], bodies.where[b, 1], bodies.where[b, 2], bodies.where[b, 7]
    A = w.A[b]
    rotation_matrix(x[i + 3], x[i + 4], x[i + 5], x[i + 6], A)
    omega = (v[j + 3], v[j + 4], v[j + 5])
    put(w.omega, b, omega)
    gravity = to_body(A, gravity_field)
    s, pd, D, D_axial = get(w.s, b), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    if n > 0:
        q, qd, moments = part(x, i + 7, n), part(v, j + 6, n), bodies.moments[b]
        s = (moments[0], moments[1], moments[2])
        W = (moments[3], moments[4], moments[5], moments[6], moments[7], moments[8])
        if normal >= 0:
            s, pd, W, D = flexible_terms_in_plane(bodies, w, b, q, qd, omega[normal], gravity, W, s, normal)
        else:
            s, pd, W, D, D_axial = flexible_terms(bodies, w, b, q, qd, omega, gravity, W, s)
        put(w.s, b, s)
        fill_tensor(w.J[b], W)
        w.inverse[b, 1] = 0.5 / (W[0] + W[1] + W[2])
    if normal >= 0:
        forces_in_plane(part(w.f, j, 6), bodies.mass[b], s, pd, D[0] + D[1], omega, gravity, normal)
    else:
        forces_in_space(part(w.f, j, 6), bodies.mass[b], s, w.J[b], pd, D, D_axial, omega, gravity)


@kernel
def fill_tensor(J, W):
    """The inertia tensor from the second moments of mass."""
    J[0, 0], J[1, 1], J[2, 2] = W[1] + W[2], W[0] + W[2], W[0] + W[1]
    J[0, 1] = J[1, 0] = -W[3]
    J[0, 2] = J[2, 0] = -W[4]
    J[1, 2] = J[2, 1] = -W[5]


@kernel
def forces_in_space(f, mass, s, J, pd, D, D_axial, omega, gravity):
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
def prepare_body(bodies, w, b):
    """What of the Schur complement of body b depends on the elastic diagonal alone: the factor T of the translational block
    m I - P_dm dinv P_dm^T."""
    n, shared = bodies.where[b, 0], bodies.where[b, 8]
    P, dinv, T = part(bodies.P_dm, 3 * shared, 3 * n), part(w.dinv, shared, n), w.T[b]
    for r in range(3):
        for c in range(r + 1):
            product = weighted_product(part(P, r * n, n), part(P, c * n, n), dinv, n)
            T[r, c] = (bodies.mass[b] if r == c else 0.0) - product
    i, j, k = bodies.where[b, 7], 0, 0
    if i >= 0:  # across the plane nothing moves
        j, k = (i + 1) % 3, (i + 2) % 3
        T[max(i, j), min(i, j)], T[max(i, k), min(i, k)], T[i, i] = 0.0, 0.0, bodies.mass[b]
    if not cholesky_three(T):
        T[0, 0] = -1.0


@inlined
def factorise(bodies, w, b):
    """Cholesky factor of the Schur complement of body b on its elastic block. Returns True when it is positive.

    That of a rigid body is constant: it was there before.
    """
    if bodies.where[b, 0] == 0:
        return w.L[b, 0, 0] > 0.0
    n, normal = bodies.where[b, 0], bodies.where[b, 7]
    L, T = w.L[b], w.T[b]
    P, H, dinv = coupling(bodies, w, b)
    if normal >= 0:
        return factorise_in_plane(T, get(w.s, b), w.J[b, normal, normal], P, H, dinv, L, n, normal)
    rotational_rows(w.s[b], w.J[b], L)
    reduce_rotation(P, H, dinv, L, n)
    return cholesky_six(T, L)


@inlined
def coupling(bodies, w, b):
    """P_dm, H, dinv of body b: what couples its rigid and its elastic coordinates, and the inverse elastic diagonal."""
    n, e, shared = bodies.where[b, 0], bodies.where[b, 3], bodies.where[b, 8]
    return part(bodies.P_dm, 3 * shared, 3 * n), part(w.H, 3 * e, 3 * n), part(w.dinv, shared, n)


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


@kernel
def weighted_product(left, right, weight, n):
    """sum_k left[k] weight[k] right[k]."""
    total = 0.0
    for k in range(n):
        total += left[k] * weight[k] * right[k]
    return total


@inlined
def reduce_forces(bodies, w, b):
    """w.rigid = L^-1 (f_rigid - C dinv f_elastic), and dinv f_elastic where the elastic accelerations of body b will be."""
    n, j, normal = bodies.where[b, 0], bodies.where[b, 2], bodies.where[b, 7]
    f, z = part(w.f, j, 6 + n), w.rigid[b]
    for k in range(6):
        z[k] = f[k]
    if n > 0:
        P, H, dinv = coupling(bodies, w, b)
        d, elastic = part(f, 6, n), part(w.acc, j + 6, n)
        if normal >= 0:
            reduce_in_plane(P, H, dinv, d, n, normal, z, elastic)
        else:
            reduce_in_space(P, H, dinv, d, n, z, elastic)
    rigid_lower(w.L[b], z, normal)


@kernel
def reduce_in_space(P, H, dinv, d, n, z, elastic):
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
def accelerate(bodies, w, b):
    """w.acc of body b from its reduced forces: the rigid part, L^-T w.rigid, and what is there of the elastic one less
    dinv C^T of it."""
    n, j, normal = bodies.where[b, 0], bodies.where[b, 2], bodies.where[b, 7]
    z, acc = w.rigid[b], part(w.acc, j, 6 + n)
    rigid_upper(w.L[b], z, normal)
    for k in range(6):
        acc[k] = z[k]
    if n > 0:
        P, H, dinv = coupling(bodies, w, b)
        if normal >= 0:
            substitute_in_plane(P, H, dinv, z, n, normal, part(acc, 6, n))
        else:
            back_substitute(P, H, dinv, z, n, part(acc, 6, n))


@kernel
def back_substitute(P, H, dinv, z, n, elastic):
    """elastic -= dinv C^T z."""
    (p0, p1, p2), (h0, h1, h2) = three_parts(P, n), three_parts(H, n)
    z0, z1, z2, z3, z4, z5 = z[0], z[1], z[2], z[3], z[4], z[5]
    for k in range(n):
        elastic[k] -= dinv[k] * (p0[k] * z0 + p1[k] * z1 + p2[k] * z2 + h0[k] * z3 + h1[k] * z4 + h2[k] * z5)


@kernel
def mass_times(bodies, w, b, y, out):
    """out += M y for body b; y and out (6 + n,) in body axes; the true mass matrix (elastic block identity)."""
    n, e = bodies.where[b, 0], bodies.where[b, 3]
    s, linear, angular = get(w.s, b), (y[0], y[1], y[2]), (y[3], y[4], y[5])
    turn, lift = cross(angular, s), cross(s, linear)
    for k in range(3):
        out[k] += bodies.mass[b] * linear[k] + turn[k]
        out[3 + k] += lift[k] + dot(w.J[b, k], angular)
    if n > 0:
        P, H = part(bodies.P_dm, 3 * bodies.where[b, 8], 3 * n), part(w.H, 3 * e, 3 * n)
        if bodies.where[b, 7] >= 0:
            mass_times_in_plane(P, H, y, n, bodies.where[b, 7], out)
            return
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


@inlined
def energies(gravity, bodies, w, x, v, y, My):
    """(kinetic, strain, gravity) energy of all bodies; y, My scratch of the longest body. Needs `inertia` before."""
    kinetic, strain, potential = 0.0, 0.0, 0.0
    for b in range(bodies.mass.size):
        n, i, j, shared = bodies.where[b, 0], bodies.where[b, 1], bodies.where[b, 2], bodies.where[b, 8]
        linear = to_body(w.A[b], (v[j], v[j + 1], v[j + 2]))
        for k in range(3):
            y[k] = linear[k]
        for k in range(3 + n):
            y[3 + k] = v[j + 3 + k]
        for k in range(6 + n):
            My[k] = 0.0
        mass_times(bodies, w, b, y, My)
        for k in range(6 + n):
            kinetic += 0.5 * y[k] * My[k]
        for k in range(n):
            strain += 0.5 * bodies.omega2[shared + k] * x[i + 7 + k] ** 2
        field = to_body(w.A[b], gravity)
        potential -= bodies.mass[b] * dot(gravity, (x[i], x[i + 1], x[i + 2])) + dot(field, get(w.s, b))
    return kinetic, strain, potential
