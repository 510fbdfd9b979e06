"""Markers: points and small elastic rotations that move with the deformation; their velocities and bias accelerations."""

from ffr_dyn.kernels.bodies import six_rows, weighted_product
from ffr_dyn.kernels.options import inlined, kernel
from ffr_dyn.kernels.simd.slices import part, six_parts
from ffr_dyn.kernels.vectors import add, cross, get, in_plane, of_two, put, scale, to_global


@inlined
def shapes(markers, k, n):
    """Six pooled rows of n: phi_t, phi_r of marker k."""
    start = markers.start[k]
    return part(markers.phi, start, 6 * n)


@inlined
def update_marker(where, markers, w, x, v, k):
    """Position, velocity, bias acceleration and elastic rotation of marker k."""
    b = markers.body[k]
    u = get(markers.u, k)
    if b == where.shape[0] - 1:
        put(w.r, k, u)
        put(w.u, k, u)
        return
    n, i, j = where[b, 0], where[b, 1], where[b, 2]
    ud = (0.0, 0.0, 0.0)
    if n > 0:
        phi = shapes(markers, k, n)
        q, qd = part(x, i + 7, n), part(v, j + 6, n)
        normal = where[b, 7]
        if normal < 0:
            u0, u1, u2, t0, t1, t2 = six_rows(phi, q, n)
            u = (u[0] + u0, u[1] + u1, u[2] + u2)
            put(w.theta, k, (t0, t1, t2))
            u0, u1, u2, t0, t1, t2 = six_rows(phi, qd, n)
            ud = (u0, u1, u2)
            put(w.thetad, k, (t0, t1, t2))
        else:
            c0, c1, _ = in_plane(normal)
            u0, u1, w.theta[k, normal] = plane_rows(phi, normal, q, n)
            u = (u[0] + of_two(0, c0, c1, u0, u1), u[1] + of_two(1, c0, c1, u0, u1), u[2] + of_two(2, c0, c1, u0, u1))
            u0, u1, w.thetad[k, normal] = plane_rows(phi, normal, qd, n)
            ud = (of_two(0, c0, c1, u0, u1), of_two(1, c0, c1, u0, u1), of_two(2, c0, c1, u0, u1))
    A, omega = w.A[b], get(w.omega, b)
    spin = cross(omega, u)
    put(w.u, k, u)
    put(w.r, k, add((x[i], x[i + 1], x[i + 2]), to_global(A, u)))
    put(w.rd, k, add((v[j], v[j + 1], v[j + 2]), to_global(A, add(spin, ud))))
    put(w.rb, k, to_global(A, cross(omega, add(spin, scale(2.0, ud)))))


@kernel
def axis_motion(w, k, a0):
    """Axis a0 (body axes, undeformed) of marker k: (body axes deformed, global value, rate, bias of the acceleration).

    The axis turns with the body and with the infinitesimal elastic rotation theta = phi_r q: a_bar = a0 + theta x a0.
    On the ground and on rigid bodies what does not move is zero.
    """
    A, omega = w.A[w.body[k]], get(w.omega, w.body[k])
    a = add(a0, cross(get(w.theta, k), a0))
    twist = cross(get(w.thetad, k), a0)
    rate = add(cross(omega, a), twist)
    return a, to_global(A, a), to_global(A, rate), to_global(A, cross(omega, add(rate, twist)))


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
def prepare_marker(phi, P_dm, dinv, n, normal, P):
    """Rows of the translations of P = [P_dm; H] dinv phi^T, which depend on the elastic diagonal alone.

    P (36,) : 6 x 6; of a planar body 3 x 3, for what keeps to the plane
    """
    if normal >= 0:
        i, j, k = in_plane(normal)
        for r, a in enumerate((i, j)):
            for c, b in enumerate((i, j, k)):
                P[3 * r + c] = weighted_product(part(P_dm, a * n, n), part(phi, b * n, n), dinv, n)
        return
    for r in range(3):
        for c in range(6):
            P[6 * r + c] = weighted_product(part(P_dm, r * n, n), part(phi, c * n, n), dinv, n)


@kernel
def couple_marker(phi, H, dinv, n, normal, P):
    """Rows of the rotations of P: what a unit wrench on a marker does to them through the elastic coordinates."""
    if normal >= 0:
        i, j, k = in_plane(normal)
        p0, p1, p2, turn = part(phi, i * n, n), part(phi, j * n, n), part(phi, k * n, n), part(H, normal * n, n)
        t0, t1, t2 = 0.0, 0.0, 0.0
        for c in range(n):
            y = dinv[c] * turn[c]
            t0 += p0[c] * y
            t1 += p1[c] * y
            t2 += p2[c] * y
        P[6], P[7], P[8] = t0, t1, t2
        return
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
def couple_pair(left, right, dinv, n, normal, out):
    """out (36,) = phi_left dinv phi_right^T of two markers on one body: 6 x 6, or 3 x 3 in the plane."""
    if normal >= 0:
        i, j, k = in_plane(normal)
        for r, a in enumerate((i, j, k)):
            for c, b in enumerate((i, j, k)):
                out[3 * r + c] = weighted_product(part(left, a * n, n), part(right, b * n, n), dinv, n)
        return
    for r in range(6):
        for c in range(6):
            out[6 * r + c] = weighted_product(part(left, r * n, n), part(right, c * n, n), dinv, n)


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
def apply_wrench(where, markers, u, f, load, k, force, moment):
    """Add a force and moment (body axes) on marker k, at u, to the right-hand sides f and to the marker's load (6,)."""
    b = markers.body[k]
    if b == where.shape[0] - 1:
        return
    n, j = where[b, 0], where[b, 2]
    lever = cross(u, force)
    for c in range(3):
        f[j + c] += force[c]
        f[j + 3 + c] += lever[c] + moment[c]
        load[c] += force[c]
        load[3 + c] += moment[c]
    if n > 0:
        project(shapes(markers, k, n), force, moment, part(f, j + 6, n), n)
