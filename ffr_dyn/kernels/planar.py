"""Bodies of planar scenes: what `bodies` does, for the three rigid coordinates that move.

`normal` is the body axis across the plane, `in_plane(normal)` the rigid coordinates i, j, k that move; the others stay zero.
"""

from ffr_dyn.kernels.options import inlined, kernel
from ffr_dyn.kernels.products import contract
from ffr_dyn.kernels.simd.slices import part, three_parts
from ffr_dyn.kernels.vectors import LEAST_PIVOT, copy, fill, in_plane, of_two


@kernel
def sense(normal):
    """In which the two axes of the plane across body axis `normal` turn into one another about it, as `in_plane` has them."""
    return -1.0 if normal == 1 else 1.0


@inlined
def flexible_terms_in_plane(bodies, w, b, q, qd, omega, gravity, second, s, normal):
    """`flexible_terms` of a planar body that turns at the rate `omega`; without what acts across the plane."""
    n, e, start, c = bodies.where[b, 0], bodies.where[b, 3], bodies.where[b, 4], bodies.where[b, 8]
    g, l = part(w.g, 9 * w.terms[b], 9 * n), part(w.l, 3 * w.terms[b], n)  # noqa: E741
    rP, P = part(bodies.rP_dm, 9 * c, 9 * n), part(bodies.P_dm, 3 * c, 3 * n)
    c0, c1, _ = in_plane(normal)
    turning = 6 + normal
    g0, g1, h = three_parts(g, n)
    r0, r1 = part(rP, c0 * n, n), part(rP, c1 * n, n)
    copy(g0, r0)
    copy(g1, r1)
    copy(h, part(rP, turning * n, n))
    terms, at = part(g, 0, 3 * n), bodies.where[b, 9]
    contract(bodies.PP_dm, start, bodies.blocks, at, q, qd, 3 * n, n, w.sorted, terms, terms, l)
    copy(part(w.H, 3 * e + normal * n, n), h)
    f = part(w.f, bodies.where[b, 2] + 6, n)
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
def forces_in_plane(f, mass, s, pd, growing, omega, gravity, normal):
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
def factorise_in_plane(T, s, inertia, P, H, dinv, L, n, normal):
    """`factorise` for the three rigid coordinates i, j, k of a planar body."""
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


@kernel
def reduce_in_plane(P, H, dinv, d, n, normal, z, elastic):
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
def substitute_in_plane(P, H, dinv, z, n, normal, elastic):
    """`back_substitute` for the rigid coordinates that move."""
    i, j, k = in_plane(normal)
    first, second, third = part(P, i * n, n), part(P, j * n, n), part(H, normal * n, n)
    for c in range(n):
        elastic[c] -= dinv[c] * (first[c] * z[i] + second[c] * z[j] + third[c] * z[k])


@kernel
def mass_times_in_plane(P, H, y, n, normal, out):
    """What couples the three rigid coordinates of a planar body with its elastic ones, and these with themselves."""
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
