"""Markers: points and small elastic rotations that move with the deformation; their velocities and bias accelerations."""

from ffr_dyn.kernels.bodies import row_product, six_rows
from ffr_dyn.kernels.options import inlined, kernel
from ffr_dyn.kernels.vectors import add, cross, get, put, scale, to_global


@inlined
def shapes(markers, k, n):
    """Six pooled rows of n: phi_t, phi_r of marker k."""
    start = markers.start[k]
    return markers.phi[start : start + 6 * n]


@inlined
def update_marker(where, markers, w, A, omega, x, v, k):
    """Position, velocity, bias acceleration and elastic rotation of marker k; A, omega those of its body."""
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
        q, qd = x[i + 7 : i + 7 + n], v[j + 6 : j + 6 + n]
        u0, u1, u2, t0, t1, t2 = six_rows(phi, q, n)
        u = (u[0] + u0, u[1] + u1, u[2] + u2)
        put(w.theta, k, (t0, t1, t2))
        u0, u1, u2, t0, t1, t2 = six_rows(phi, qd, n)
        ud = (u0, u1, u2)
        put(w.thetad, k, (t0, t1, t2))
    spin = cross(omega, u)
    put(w.omega, k, omega)
    put(w.u, k, u)
    put(w.r, k, add((x[i], x[i + 1], x[i + 2]), to_global(A, u)))
    put(w.rd, k, add((v[j], v[j + 1], v[j + 2]), to_global(A, add(spin, ud))))
    put(w.rb, k, to_global(A, cross(omega, add(spin, scale(2.0, ud)))))
    for r in range(3):
        for c in range(3):
            w.A[k, r, c] = A[r, c]


@kernel
def axis_motion(w, k, a0):
    """Axis a0 (body axes, undeformed) of marker k: (body axes deformed, global value, rate, bias of the acceleration).

    The axis turns with the body and with the infinitesimal elastic rotation theta = phi_r q: a_bar = a0 + theta x a0.
    On the ground and on rigid bodies what does not move is zero.
    """
    A, omega = w.A[k], get(w.omega, k)
    a = add(a0, cross(get(w.theta, k), a0))
    twist = cross(get(w.thetad, k), a0)
    rate = add(cross(omega, a), twist)
    return a, to_global(A, a), to_global(A, rate), to_global(A, cross(omega, add(rate, twist)))


@kernel
def prepare_marker(phi, Cd, n, P):
    """First three rows of P (6, 6) = [P_dm; H] dinv phi^T, which depend on the elastic diagonal alone."""
    for r in range(3):
        for c in range(6):
            P[r, c] = row_product(Cd, r, phi, c, n)


@kernel
def couple_marker(phi, Cd, n, normal, P):
    """Last three rows of P: what a unit wrench on a marker does to the rotation through the elastic coordinates."""
    for r in range(3, 6):
        if normal < 0 or r == 3 + normal:
            P[r, 0], P[r, 1], P[r, 2], P[r, 3], P[r, 4], P[r, 5] = six_rows(phi, Cd[r * n :], n)


@kernel
def couple_pair(left, right, dinv, n, out):
    """out (6, 6) = phi_left dinv phi_right^T of two markers on one body."""
    for r in range(6):
        for c in range(6):
            total = 0.0
            for j in range(n):
                total += left[r * n + j] * dinv[j] * right[c * n + j]
            out[r, c] = total


@kernel
def project(phi, force, moment, out, n):
    """out += phi_t^T force + phi_r^T moment."""
    p0, p1, p2, p3, p4, p5 = phi[:n], phi[n:], phi[2 * n :], phi[3 * n :], phi[4 * n :], phi[5 * n :]
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
        project(shapes(markers, k, n), force, moment, f[j + 6 : j + 6 + n], n)
