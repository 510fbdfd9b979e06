"""Bodies in the plane: what `spatial` does, by the same names, for the three rigid coordinates that move.

`normal` is the body axis across the plane, `in_plane(normal)` the rigid coordinates i, j, k that move; the others stay zero.

Twin: `ffr_dyn.equations.inertia.mass_matrix`,
`ffr_dyn.equations.inertia.quadratic_velocity`.
"""

from ffr_dyn.kernels.options import inlined, kernel
from ffr_dyn.kernels.products import contract
from ffr_dyn.kernels.simd.slices import part, three_parts
from ffr_dyn.kernels.spatial import coupling
from ffr_dyn.kernels.tables import IN_PP_DM, IN_Q, IN_SHARED, IN_V, NORMAL, PP_PLAN, N
from ffr_dyn.kernels.vectors import LEAST_PIVOT, copy, fill, get, in_plane, of_two, weighted_product


@kernel
def sense(normal):
    """In which the two axes of the plane across body axis `normal` turn into one another about it, as `in_plane` has them."""
    return -1.0 if normal == 1 else 1.0


@inlined
def flexible_terms(bodies, w, b, q, qd, omega, gravity, second, s, normal):
    """`flexible_terms` of a planar body that turns at the rate `omega`; without what acts across the plane."""
    n, e, start, c = bodies.where[b, N], bodies.where[b, IN_Q], bodies.where[b, IN_PP_DM], bodies.where[b, IN_SHARED]
    g, l = part(w.g, 9 * w.terms[b], 9 * n), part(w.l, 3 * w.terms[b], n)  # noqa: E741
    rP, P = part(bodies.rP_dm, 9 * c, 9 * n), part(bodies.P_dm, 3 * c, 3 * n)
    c0, c1, _ = in_plane(normal)
    turning = 6 + normal
    g0, g1, h = three_parts(g, n)
    r0, r1, undeformed = part(rP, c0 * n, n), part(rP, c1 * n, n), part(w.sorted, w.sorted.size - 3 * n, 3 * n)
    copy(part(undeformed, 0, n), r0)
    copy(part(undeformed, n, n), r1)
    copy(part(undeformed, 2 * n, n), part(rP, turning * n, n))
    at = bodies.where[b, PP_PLAN]
    contract(bodies.PP_dm, start, bodies.blocks, at, q, qd, 3 * n, n, w.sorted, undeformed, part(g, 0, 3 * n), l)
    copy(part(w.H, 3 * e + normal * n, n), h)
    f = part(w.f, bodies.where[b, IN_V] + 6, n)
    omega2, damping = part(bodies.omega2, c, n), part(bodies.two_zeta_omega, c, n)
    P0, P1, square = part(P, c0 * n, n), part(P, c1 * n, n), omega * omega
    across, along = gravity[c0], gravity[c1]
    s0, s1, p0, p1, grown, growing = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(n):
        x, y, both = q[j], qd[j], g0[j] + g1[j]
        s0 += P0[j] * x
        s1 += P1[j] * x
        p0 += P0[j] * y
        p1 += P1[j] * y
        grown += (r0[j] + r1[j] + both) * x
        growing += both * y
        f[j] = (
            square * both - 2.0 * omega * l[j] + across * P0[j] + along * P1[j]
            - omega2[j] * x - damping[j] * y
        )  # fmt: skip
    s = (s[0] + of_two(0, c0, c1, s0, s1), s[1] + of_two(1, c0, c1, s0, s1), s[2] + of_two(2, c0, c1, s0, s1))
    pd = (of_two(0, c0, c1, p0, p1), of_two(1, c0, c1, p0, p1), of_two(2, c0, c1, p0, p1))
    # Only the sums of both components in the plane enter; they are kept in one component.
    W = (
        second[0] + of_two(0, c0, 3, grown, 0.0), second[1] + of_two(1, c0, 3, grown, 0.0),
        second[2], second[3], second[4], second[5],
    )  # fmt: skip
    D = (of_two(0, c0, 3, growing, 0.0), of_two(1, c0, 3, growing, 0.0), 0.0, 0.0, 0.0, 0.0)
    return s, pd, W, D


@kernel
def forces(f, mass, s, pd, growing, omega, gravity, normal):
    """f (6,) of a planar body: what acts in the plane and about its normal; the rest is zero.

    pd, growing : rates of the first moment and, half, of the second about the normal
    """
    i, j, k = in_plane(normal)
    turn, rate = sense(normal), omega[normal]
    fill(f, 0.0)
    f[i] = mass * gravity[i] + rate * rate * s[i] + 2.0 * turn * rate * pd[j]
    f[j] = mass * gravity[j] + rate * rate * s[j] - 2.0 * turn * rate * pd[i]
    f[k] = turn * (s[i] * gravity[j] - s[j] * gravity[i]) - 2.0 * growing * rate


@kernel
def hold_across(T, mass, i):
    """The translational block of a body of which nothing moves along the normal i."""
    j, k = (i + 1) % 3, (i + 2) % 3
    T[max(i, j), min(i, j)], T[max(i, k), min(i, k)], T[i, i] = 0.0, 0.0, mass


@inlined
def factorise(bodies, w, b):
    """Cholesky factor w.L of the Schur complement of body b on its elastic block. Returns True when it is positive."""
    normal = bodies.where[b, NORMAL]
    P, H, dinv = coupling(bodies, w, b)
    return factor(w.T[b], get(w.s, b), w.J[b, normal, normal], P, H, dinv, w.L[b], bodies.where[b, N], normal)


@kernel
def factor(T, s, inertia, P, H, dinv, L, n, normal):
    """The factor for the three rigid coordinates i, j, k that move. Returns True when it is positive."""
    i, j, k = in_plane(normal)
    ki, kj, kk = -sense(normal) * s[j], sense(normal) * s[i], inertia
    first, second, turn = part(P, i * n, n), part(P, j * n, n), part(H, normal * n, n)
    for c in range(n):
        x = dinv[c] * turn[c]
        ki -= x * first[c]
        kj -= x * second[c]
        kk -= x * turn[c]
    L[i, i], L[j, i], L[j, j] = T[i, i], T[j, i], T[j, j]
    ki *= L[i, i]
    kj = (kj - ki * L[j, i]) * L[j, j]
    kk -= ki * ki + kj * kj
    L[k, i], L[k, j], L[k, k] = ki, kj, 1.0 / kk**0.5
    return T[0, 0] > 0.0 and kk > LEAST_PIVOT * inertia


@inlined
def reduce_forces(bodies, w, b, f, z):
    """z = L^-1 (z - C dinv f_elastic), and dinv f_elastic where the elastic accelerations of body b will be."""
    n, normal = bodies.where[b, N], bodies.where[b, NORMAL]
    if n > 0:
        P, H, dinv = coupling(bodies, w, b)
        reduce_elastic(P, H, dinv, part(f, 6, n), n, normal, z, part(w.acc, bodies.where[b, IN_V] + 6, n))
    lower(w.L[b], z, normal)


@kernel
def reduce_elastic(P, H, dinv, d, n, normal, z, elastic):
    """elastic = dinv d, z -= C elastic for the rigid coordinates that move."""
    i, j, k = in_plane(normal)
    first, second, third = part(P, i * n, n), part(P, j * n, n), part(H, normal * n, n)
    t0, t1, t2 = 0.0, 0.0, 0.0
    for c in range(n):
        y = dinv[c] * d[c]
        elastic[c] = y
        t0 += first[c] * y
        t1 += second[c] * y
        t2 += third[c] * y
    z[i] -= t0
    z[j] -= t1
    z[k] -= t2


@inlined
def accelerate(bodies, w, b, z, acc):
    """z = L^-T z, which is the rigid part of acc; its elastic part, less dinv C^T z."""
    n, normal = bodies.where[b, N], bodies.where[b, NORMAL]
    upper(w.L[b], z, normal)
    for k in range(6):
        acc[k] = z[k]
    if n > 0:
        P, H, dinv = coupling(bodies, w, b)
        substitute(P, H, dinv, z, n, normal, part(acc, 6, n))


@inlined
def substitute(P, H, dinv, z, n, normal, elastic):
    """elastic -= dinv C^T z for the rigid coordinates that move."""
    i, j, k = in_plane(normal)
    first, second, third = part(P, i * n, n), part(P, j * n, n), part(H, normal * n, n)
    for c in range(n):
        elastic[c] -= dinv[c] * (first[c] * z[i] + second[c] * z[j] + third[c] * z[k])


@kernel
def lower(factor, b, normal):
    """In place b <- L^-1 b for the rigid coordinates (6,): three of them, and zeros."""
    i, j, k = in_plane(normal)
    first = b[i] * factor[i, i]
    second = (b[j] - factor[j, i] * first) * factor[j, j]
    third = (b[k] - factor[k, i] * first - factor[k, j] * second) * factor[k, k]
    b[normal], b[3 + (normal + 1) % 3], b[3 + (normal + 2) % 3] = 0.0, 0.0, 0.0
    b[i], b[j], b[k] = first, second, third


@kernel
def upper(factor, b, normal):
    """In place b <- L^-T b, as `lower`."""
    i, j, k = in_plane(normal)
    b[k] = b[k] * factor[k, k]
    b[j] = (b[j] - factor[k, j] * b[k]) * factor[j, j]
    b[i] = (b[i] - factor[j, i] * b[j] - factor[k, i] * b[k]) * factor[i, i]


@kernel
def couple_motions(P, H, y, n, normal, out):
    """The coupling of the three rigid coordinates of a planar body with its elastic ones, and of these with themselves."""
    i, j, k = in_plane(normal)
    first, second, turn = part(P, i * n, n), part(P, j * n, n), part(H, normal * n, n)
    q, f = part(y, 6, n), part(out, 6, n)
    yi, yj, yk, ti, tj, tk = y[i], y[j], y[k], 0.0, 0.0, 0.0
    for c in range(n):
        ti += first[c] * q[c]
        tj += second[c] * q[c]
        tk += turn[c] * q[c]
        f[c] += first[c] * yi + second[c] * yj + turn[c] * yk + q[c]
    out[i] += ti
    out[j] += tj
    out[k] += tk


# ---- markers -------------------------------------------------------------------------------------------------------------


@kernel
def plane_rows(phi, normal, q, n):
    """The two displacements and the rotation of a marker that keep to the plane, of its six pooled rows, times q."""
    i, j, _ = in_plane(normal)
    r0, r1, r2 = part(phi, i * n, n), part(phi, j * n, n), part(phi, (3 + normal) * n, n)
    t0, t1, t2 = 0.0, 0.0, 0.0
    for c in range(n):
        t0 += r0[c] * q[c]
        t1 += r1[c] * q[c]
        t2 += r2[c] * q[c]
    return t0, t1, t2


@kernel
def marker_motion(phi, normal, q, n):
    """(displacement, rotation) of a marker by its six pooled rows."""
    i, j, _ = in_plane(normal)
    u0, u1, t = plane_rows(phi, normal, q, n)
    u = (of_two(0, i, j, u0, u1), of_two(1, i, j, u0, u1), of_two(2, i, j, u0, u1))
    return u, (of_two(0, normal, 3, t, 0.0), of_two(1, normal, 3, t, 0.0), of_two(2, normal, 3, t, 0.0))


@kernel
def prepare_marker(phi, P_dm, dinv, n, normal, P):
    """Rows of the translations of P = [P_dm; H] dinv phi^T, 3 x 3, which depend on the elastic diagonal alone."""
    i, j, k = in_plane(normal)
    for r, a in enumerate((i, j)):
        for c, b in enumerate((i, j, k)):
            P[3 * r + c] = weighted_product(part(P_dm, a * n, n), part(phi, b * n, n), dinv, n)


@kernel
def couple_marker(phi, H, dinv, n, normal, P):
    """Rows of the rotations of P: what a unit wrench on a marker does to them through the elastic coordinates."""
    i, j, k = in_plane(normal)
    p0, p1, p2, turn = part(phi, i * n, n), part(phi, j * n, n), part(phi, k * n, n), part(H, normal * n, n)
    t0, t1, t2 = 0.0, 0.0, 0.0
    for c in range(n):
        y = dinv[c] * turn[c]
        t0 += p0[c] * y
        t1 += p1[c] * y
        t2 += p2[c] * y
    P[6], P[7], P[8] = t0, t1, t2


@kernel
def couple_pair(left, right, dinv, n, normal, out):
    """out, 3 x 3, = phi_left dinv phi_right^T of two markers on one body."""
    i, j, k = in_plane(normal)
    for r, a in enumerate((i, j, k)):
        for c, b in enumerate((i, j, k)):
            out[3 * r + c] = weighted_product(part(left, a * n, n), part(right, b * n, n), dinv, n)
