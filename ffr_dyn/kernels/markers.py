"""Markers: points and small elastic rotations that move with the deformation; their velocities and bias accelerations.

Twin: `ffr_dyn.equations.kinematics.point_motion`,
`ffr_dyn.equations.kinematics.axis_motion`.
"""

from ffr_dyn.kernels import planar, spatial
from ffr_dyn.kernels.options import inlined, kernel
from ffr_dyn.kernels.simd.slices import part, six_parts
from ffr_dyn.kernels.tables import IN_V, IN_X, NORMAL, N
from ffr_dyn.kernels.vectors import add, cross, get, put, scale, to_global


@inlined
def shapes(markers, k, n):
    """Six pooled rows of n: phi_t, phi_r of marker k."""
    start = markers.start[k]
    return part(markers.phi, start, 6 * n)


@kernel
def elastic_motion(phi, normal, q, n):
    """(displacement, rotation) of a marker that its body's elastic coordinates make, or their rates."""
    if normal >= 0:
        return planar.marker_motion(phi, normal, q, n)
    return spatial.marker_motion(phi, q, n)


@inlined
def update_marker(where, markers, w, x, v, k):
    """Position, velocity, bias acceleration and elastic rotation of marker k."""
    b = markers.body[k]
    u = get(markers.u, k)
    if b == where.shape[0] - 1:
        put(w.r, k, u)
        put(w.u, k, u)
        return
    n, i, j = where[b, N], where[b, IN_X], where[b, IN_V]
    ud = (0.0, 0.0, 0.0)
    if n > 0:
        phi, normal = shapes(markers, k, n), where[b, NORMAL]
        moved, turned = elastic_motion(phi, normal, part(x, i + 7, n), n)
        ud, turning = elastic_motion(phi, normal, part(v, j + 6, n), n)
        u = add(u, moved)
        put(w.theta, k, turned)
        put(w.thetad, k, turning)
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
def apply_wrench(where, markers, u, f, load, k, force, moment):
    """Add a force and moment (body axes) on marker k, at u, to the right-hand sides f and to the marker's load (6,)."""
    b = markers.body[k]
    if b == where.shape[0] - 1:
        return
    n, j = where[b, N], where[b, IN_V]
    lever = cross(u, force)
    for c in range(3):
        f[j + c] += force[c]
        f[j + 3 + c] += lever[c] + moment[c]
        load[c] += force[c]
        load[3 + c] += moment[c]
    if n > 0:
        project(shapes(markers, k, n), force, moment, part(f, j + 6, n), n)
