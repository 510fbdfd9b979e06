"""Inertia of one body: mass matrix, quadratic velocity and elastic forces, Schur complement on the 6 x 6 rigid part.

Equations: the mass matrix [[m I, -s~, I3], [s~, J, H], [I3^T, H^T, I]] in body axes depends on q alone (Shabana 2013,
ch. 5, written for body-frame velocities); see `ffr_dyn.inertia` for the readable form of every term.
"""

from ffr_dyn.kernels.options import inlined, kernel
from ffr_dyn.kernels.vectors import (
    cholesky,
    copy,
    cross,
    dot,
    fill,
    get,
    in_plane,
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
        length = (x[i] ** 2 + x[i + 1] ** 2 + x[i + 2] ** 2 + x[i + 3] ** 2) ** 0.5
        for k in range(4):
            x[i + k] /= length


@kernel
def contract(PP, q, qd, n, g, l):  # noqa: E741
    """g += sum_i q_i PP[i], l += sum_i q_dot_i (axial rows of PP[i]): the only O(n^2) work of a body.

    Two rows at a time, so that each result is loaded and stored half as often.
    """
    width, axial = 9 * n, 6 * n
    for i in range(0, n - 1, 2):
        q0, q1, d0, d1 = q[i], q[i + 1], qd[i], qd[i + 1]
        row0, row1 = PP[i * width : (i + 1) * width], PP[(i + 1) * width : (i + 2) * width]
        for k in range(width):
            g[k] += q0 * row0[k] + q1 * row1[k]
        row0, row1 = row0[axial:], row1[axial:]
        for k in range(3 * n):
            l[k] += d0 * row0[k] + d1 * row1[k]
    if n % 2:
        q0, d0 = q[n - 1], qd[n - 1]
        row0 = PP[(n - 1) * width : n * width]
        for k in range(width):
            g[k] += q0 * row0[k]
        row0 = row0[axial:]
        for k in range(3 * n):
            l[k] += d0 * row0[k]


@kernel
def row_dot(rows, index, q, n):
    """sum_j rows[index, j] q_j for a pooled array of rows of n."""
    part = rows[index * n : (index + 1) * n]
    total = 0.0
    for j in range(n):
        total += part[j] * q[j]
    return total


@inlined
def flexible_terms(bodies, w, b, q, qd, omega, gravity, second, s):
    """Elastic right-hand side; returns (first moment, I3 q_dot, second moment of mass, sym D, axial D) of the body."""
    n, e, start = bodies.where[b, 0], bodies.where[b, 3], bodies.where[b, 4]
    g, l = w.g[9 * e : 9 * (e + n)], w.l[3 * e : 3 * (e + n)]  # noqa: E741
    rP, P = bodies.rP_dm[9 * e : 9 * (e + n)], bodies.P_dm[3 * e : 3 * (e + n)]
    copy(g, rP)
    fill(l, 0.0)
    contract(bodies.PP_dm[start : start + 9 * n * n], q, qd, n, g, l)
    s = (s[0] + row_dot(P, 0, q, n), s[1] + row_dot(P, 1, q, n), s[2] + row_dot(P, 2, q, n))
    pd = (row_dot(P, 0, qd, n), row_dot(P, 1, qd, n), row_dot(P, 2, qd, n))
    W = (
        second[0] + row_dot(rP, 0, q, n) + row_dot(g, 0, q, n),
        second[1] + row_dot(rP, 1, q, n) + row_dot(g, 1, q, n),
        second[2] + row_dot(rP, 2, q, n) + row_dot(g, 2, q, n),
        second[3] + row_dot(rP, 3, q, n) + row_dot(g, 3, q, n),
        second[4] + row_dot(rP, 4, q, n) + row_dot(g, 4, q, n),
        second[5] + row_dot(rP, 5, q, n) + row_dot(g, 5, q, n),
    )
    D = (
        row_dot(g, 0, qd, n),
        row_dot(g, 1, qd, n),
        row_dot(g, 2, qd, n),
        row_dot(g, 3, qd, n),
        row_dot(g, 4, qd, n),
        row_dot(g, 5, qd, n),
    )
    D_axial = (row_dot(g, 6, qd, n), row_dot(g, 7, qd, n), row_dot(g, 8, qd, n))

    ox, oy, oz = omega
    xx, yy, zz = oy * oy + oz * oz, ox * ox + oz * oz, ox * ox + oy * oy
    xy, xz, yz = -2.0 * ox * oy, -2.0 * ox * oz, -2.0 * oy * oz
    first = bodies.where[b, 2] + 6
    f = w.f[first : first + n]
    omega2, damping = bodies.omega2[e : e + n], bodies.two_zeta_omega[e : e + n]
    g0, g1, g2, g3, g4, g5 = g[:n], g[n:], g[2 * n :], g[3 * n :], g[4 * n :], g[5 * n :]
    l0, l1, l2, P0, P1, P2 = l[:n], l[n:], l[2 * n :], P[:n], P[n:], P[2 * n :]
    for j in range(n):
        f[j] = (
            xx * g0[j] + yy * g1[j] + zz * g2[j] + xy * g3[j] + xz * g4[j] + yz * g5[j]
            - 2.0 * (ox * l0[j] + oy * l1[j] + oz * l2[j])
            + gravity[0] * P0[j] + gravity[1] * P1[j] + gravity[2] * P2[j]
            - omega2[j] * q[j] - damping[j] * qd[j]
        )  # fmt: skip
    return s, pd, W, D, D_axial


@inlined
def contract_in_plane(PP, q, qd, n, g0, g1, h, l, first, second, turning):  # noqa: E741
    """g0, g1, h += the rows `first`, `second`, `turning` of sum_i q_i PP_i; l += row `turning` of sum_i qd_i PP_i."""
    for i in range(n):
        qi, di, start = q[i], qd[i], 9 * n * i
        a, b = PP[start + first * n : start + (first + 1) * n], PP[start + second * n : start + (second + 1) * n]
        c = PP[start + turning * n : start + (turning + 1) * n]
        for j in range(n):
            g0[j] += qi * a[j]
            g1[j] += qi * b[j]
            h[j] += qi * c[j]
            l[j] += di * c[j]


@inlined
def flexible_terms_in_plane(bodies, w, b, q, qd, omega, gravity, second, s, normal):
    """`flexible_terms` of a planar body that turns at the rate `omega`; without what acts across the plane."""
    n, e, start = bodies.where[b, 0], bodies.where[b, 3], bodies.where[b, 4]
    g, l = w.g[9 * e : 9 * (e + n)], w.l[3 * e : 3 * e + n]  # noqa: E741
    rP, P = bodies.rP_dm[9 * e : 9 * (e + n)], bodies.P_dm[3 * e : 3 * (e + n)]
    c0, c1, _ = in_plane(normal)
    turning = 6 + normal
    g0, g1, h = g[c0 * n : (c0 + 1) * n], g[c1 * n : (c1 + 1) * n], g[turning * n : (turning + 1) * n]
    copy(g, rP)
    fill(l, 0.0)
    contract_in_plane(bodies.PP_dm[start : start + 9 * n * n], q, qd, n, g0, g1, h, l, c0, c1, turning)
    s = (s[0] + row_dot(P, 0, q, n), s[1] + row_dot(P, 1, q, n), s[2] + row_dot(P, 2, q, n))
    pd = (row_dot(P, 0, qd, n), row_dot(P, 1, qd, n), row_dot(P, 2, qd, n))
    grown = row_dot(rP, c0, q, n) + row_dot(g0, 0, q, n) + row_dot(rP, c1, q, n) + row_dot(g1, 0, q, n)
    growing = row_dot(g0, 0, qd, n) + row_dot(g1, 0, qd, n)
    # Only the sums of both components in the plane enter; they are kept in one component.
    W = (
        second[0] + (grown if c0 == 0 else 0.0), second[1] + (grown if c0 == 1 else 0.0),
        second[2], second[3], second[4], second[5],
    )  # fmt: skip
    D = (growing if c0 == 0 else 0.0, growing if c0 == 1 else 0.0, 0.0, 0.0, 0.0, 0.0)
    f = w.f[bodies.where[b, 2] + 6 : bodies.where[b, 2] + 6 + n]
    omega2, damping = bodies.omega2[e : e + n], bodies.two_zeta_omega[e : e + n]
    P0, P1, square = P[c0 * n : (c0 + 1) * n], P[c1 * n : (c1 + 1) * n], omega * omega
    for j in range(n):
        f[j] = (
            square * (g0[j] + g1[j]) - 2.0 * omega * l[j] + gravity[c0] * P0[j] + gravity[c1] * P1[j]
            - omega2[j] * q[j] - damping[j] * qd[j]
        )  # fmt: skip
    return s, pd, W, D


@inlined
def inertia(gravity_field, bodies, w, x, v, b):
    """Rotation, first and second moments, right-hand side w.f (body axes) of body b, without markers' loads."""
    n, i, j = bodies.where[b, 0], bodies.where[b, 1], bodies.where[b, 2]
    A = w.A[b]
    rotation_matrix(x[i + 3], x[i + 4], x[i + 5], x[i + 6], A)
    omega = (v[j + 3], v[j + 4], v[j + 5])
    put(w.omega, b, omega)
    gravity = to_body(A, gravity_field)
    mass, moments = bodies.mass[b], bodies.moments[b]
    s = (moments[0], moments[1], moments[2])
    W = (moments[3], moments[4], moments[5], moments[6], moments[7], moments[8])
    pd = (0.0, 0.0, 0.0)
    D = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    D_axial = (0.0, 0.0, 0.0)
    if n > 0:
        q, qd = x[i + 7 : i + 7 + n], v[j + 6 : j + 6 + n]
        normal = bodies.where[b, 7]
        if normal >= 0:
            s, pd, W, D = flexible_terms_in_plane(bodies, w, b, q, qd, omega[normal], gravity, W, s, normal)
        else:
            s, pd, W, D, D_axial = flexible_terms(bodies, w, b, q, qd, omega, gravity, W, s)
    put(w.s, b, s)
    J = w.J[b]
    J[0, 0], J[1, 1], J[2, 2] = W[1] + W[2], W[0] + W[2], W[0] + W[1]
    J[0, 1] = J[1, 0] = -W[3]
    J[0, 2] = J[2, 0] = -W[4]
    J[1, 2] = J[2, 1] = -W[5]

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
        w.f[j + k] = mass * gravity[k] - centrifugal[k] - 2.0 * coriolis[k]
        w.f[j + 3 + k] = moment[k] - gyroscopic[k] - 2.0 * (trace * omega[k] - D_omega[k] + 0.5 * skew[k])


@inlined
def rigid_mass(mass, s, J, M):
    """Fill the 6 x 6 rigid block of the mass matrix."""
    for r in range(3):
        for c in range(3):
            M[r, c] = mass if r == c else 0.0
            M[3 + r, 3 + c] = J[r, c]
        M[3 + r, r] = 0.0
    M[3, 1], M[3, 2] = -s[2], s[1]
    M[4, 0], M[4, 2] = s[2], -s[0]
    M[5, 0], M[5, 1] = -s[1], s[0]


@inlined
def factorise(bodies, w, b):
    """Cholesky factor of the Schur complement of body b on its elastic block. Returns True when it is positive."""
    n, e, normal = bodies.where[b, 0], bodies.where[b, 3], bodies.where[b, 7]
    L = w.L[b]
    rigid_mass(bodies.mass[b], w.s[b], w.J[b], L)
    P, H = bodies.P_dm[3 * e : 3 * (e + n)], w.g[9 * e + 6 * n : 9 * (e + n)]
    dinv, Cd = w.dinv[e : e + n], w.Cd[6 * e : 6 * (e + n)]
    if normal >= 0:
        return factorise_in_plane(P, H, dinv, Cd, L, n, normal)
    for r in range(3):
        scale_row(P, r, dinv, n, Cd, r)
        scale_row(H, r, dinv, n, Cd, 3 + r)
    if n > 0:
        for r in range(3):
            for c in range(r + 1):
                L[r, c] -= row_product(Cd, r, P, c, n)
                L[3 + r, 3 + c] -= row_product(Cd, 3 + r, H, c, n)
            for c in range(3):
                L[3 + r, c] -= row_product(Cd, 3 + r, P, c, n)
    return cholesky(L, 6) < 0


@kernel
def scale_row(rows, r, dinv, n, out, target):
    """out[target] = rows[r] dinv, for pooled arrays of rows of n."""
    row, scaled = rows[r * n : (r + 1) * n], out[target * n : (target + 1) * n]
    for j in range(n):
        scaled[j] = row[j] * dinv[j]


@kernel
def factorise_in_plane(P, H, dinv, Cd, L, n, normal):
    """`factorise` for the three rigid coordinates i, j, k of a planar body."""
    i, j, k = in_plane(normal)
    scale_row(P, i, dinv, n, Cd, i)
    scale_row(P, j, dinv, n, Cd, j)
    scale_row(H, normal, dinv, n, Cd, k)
    ii, ji, jj = row_product(Cd, i, P, i, n), row_product(Cd, j, P, i, n), row_product(Cd, j, P, j, n)
    ki, kj, kk = row_product(Cd, k, P, i, n), row_product(Cd, k, P, j, n), row_product(Cd, k, H, normal, n)
    inertia = L[k, k]
    ii, jj, kk = L[i, i] - ii, L[j, j] - jj, inertia - kk
    L[i, i] = 1.0 / ii**0.5
    L[j, i], L[k, i] = -ji * L[i, i], (L[k, i] - ki) * L[i, i]
    jj -= L[j, i] ** 2
    L[j, j] = 1.0 / jj**0.5
    L[k, j] = (L[k, j] - kj - L[k, i] * L[j, i]) * L[j, j]
    kk -= L[k, i] ** 2 + L[k, j] ** 2
    L[k, k] = 1.0 / kk**0.5
    return ii > 0.0 and jj > 0.0 and kk > 1e-14 * inertia


@kernel
def row_product(a, i, b, j, n):
    """sum_k a[i, k] b[j, k] for pooled arrays of rows of n."""
    left, right = a[i * n : (i + 1) * n], b[j * n : (j + 1) * n]
    total = 0.0
    for k in range(n):
        total += left[k] * right[k]
    return total


@inlined
def solve_body(bodies, w, b):
    """w.acc = M^-1 w.f for body b, without constraints."""
    n, j, e = bodies.where[b, 0], bodies.where[b, 2], bodies.where[b, 3]
    f, acc = w.f[j : j + 6 + n], w.acc[j : j + 6 + n]
    for k in range(6):
        acc[k] = f[k]
        if n > 0:
            acc[k] -= row_dot(w.Cd[6 * e : 6 * (e + n)], k, f[6:], n)
    rigid_lower(w.L[b], acc, bodies.where[b, 7])
    rigid_upper(w.L[b], acc, bodies.where[b, 7])
    if n > 0:
        back_substitute(w.Cd[6 * e : 6 * (e + n)], w.dinv[e : e + n], f[6:], acc, n, acc[6:])


@kernel
def back_substitute(Cd, dinv, f, z, n, acc):
    """acc = dinv f - Cd^T z."""
    c0, c1, c2, c3, c4, c5 = Cd[:n], Cd[n:], Cd[2 * n :], Cd[3 * n :], Cd[4 * n :], Cd[5 * n :]
    for j in range(n):
        acc[j] = dinv[j] * f[j] - (
            c0[j] * z[0] + c1[j] * z[1] + c2[j] * z[2] + c3[j] * z[3] + c4[j] * z[4] + c5[j] * z[5]
        )


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
        P, H = bodies.P_dm[3 * e : 3 * (e + n)], w.g[9 * e + 6 * n : 9 * (e + n)]
        for k in range(3):
            out[k] += row_dot(P, k, y[6:], n)
            out[3 + k] += row_dot(H, k, y[6:], n)
            for j in range(n):
                out[6 + j] += P[k * n + j] * linear[k] + H[k * n + j] * angular[k]
        for j in range(n):
            out[6 + j] += y[6 + j]


@inlined
def energies(gravity, bodies, w, x, v, y, My):
    """(kinetic, strain, gravity) energy of all bodies; y, My scratch of the longest body. Needs `inertia` before."""
    kinetic, strain, potential = 0.0, 0.0, 0.0
    for b in range(bodies.mass.size):
        n, i, j, e = bodies.where[b, 0], bodies.where[b, 1], bodies.where[b, 2], bodies.where[b, 3]
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
            strain += 0.5 * bodies.omega2[e + k] * x[i + 7 + k] ** 2
        field = to_body(w.A[b], gravity)
        potential -= bodies.mass[b] * dot(gravity, (x[i], x[i + 1], x[i + 2])) + dot(field, get(w.s, b))
    return kinetic, strain, potential
