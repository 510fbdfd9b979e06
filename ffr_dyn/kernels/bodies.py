"""The operations on one body, each by the equations in space (`spatial`) or in the plane (`planar`): the only place, but for
the markers and sides of joints on it, where its form is asked for.

Twin: `ffr_dyn.equations.inertia.mass_matrix`,
`ffr_dyn.equations.inertia.quadratic_velocity`,
`ffr_dyn.equations.inertia.energies`.
"""

from ffr_dyn.kernels import planar, spatial
from ffr_dyn.kernels.options import inlined, kernel
from ffr_dyn.kernels.simd.slices import part
from ffr_dyn.kernels.spatial import coupling
from ffr_dyn.kernels.tables import IN_DAMPING, IN_SHARED, IN_V, IN_X, NORMAL, N
from ffr_dyn.kernels.vectors import cholesky_three, cross, dot, get, put, to_body, weighted_product


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
        n, i, j = bodies.where[b, N], bodies.where[b, IN_X], bodies.where[b, IN_V]
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
        i = bodies.where[b, IN_X] + 3
        p0, p1, p2, p3 = x[i], x[i + 1], x[i + 2], x[i + 3]
        inverse = 1.0 / (p0 * p0 + p1 * p1 + p2 * p2 + p3 * p3) ** 0.5
        x[i], x[i + 1], x[i + 2], x[i + 3] = inverse * p0, inverse * p1, inverse * p2, inverse * p3


@inlined
def inertia(gravity_field, bodies, w, x, v, b):
    """Rotation, first and second moments, right-hand side w.f (body axes) of body b, without markers' loads."""
    n, i, j, normal = bodies.where[b, N], bodies.where[b, IN_X], bodies.where[b, IN_V], bodies.where[b, NORMAL]
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
            s, pd, W, D = planar.flexible_terms(bodies, w, b, q, qd, omega[normal], gravity, W, s, normal)
        else:
            s, pd, W, D, D_axial = spatial.flexible_terms(bodies, w, b, q, qd, omega, gravity, W, s)
        if bodies.where[b, IN_DAMPING] >= 0:
            add_product(bodies.coupled_damping, bodies.where[b, IN_DAMPING], 1.0, qd, part(w.f, j + 6, n))
        put(w.s, b, s)
        fill_tensor(w.J[b], W)
        w.inverse[b, 1] = 0.5 / (W[0] + W[1] + W[2])
    if normal >= 0:
        planar.forces(part(w.f, j, 6), bodies.mass[b], s, pd, D[0] + D[1], omega, gravity, normal)
    else:
        spatial.forces(part(w.f, j, 6), bodies.mass[b], s, w.J[b], pd, D, D_axial, omega, gravity)


@kernel
def add_product(pool, start, factor, y, f):
    """f (n,) += factor A y, A (n, n) symmetric, stored from `start` on."""
    n = y.size
    for j in range(n):
        row, total = part(pool, start + j * n, n), 0.0
        for k in range(n):
            total += row[k] * y[k]
        f[j] += factor * total


@kernel
def fill_tensor(J, W):
    """The inertia tensor from the second moments of mass."""
    J[0, 0], J[1, 1], J[2, 2] = W[1] + W[2], W[0] + W[2], W[0] + W[1]
    J[0, 1] = J[1, 0] = -W[3]
    J[0, 2] = J[2, 0] = -W[4]
    J[1, 2] = J[2, 1] = -W[5]


@inlined
def prepare_body(bodies, w, b):
    """The part of the Schur complement of body b that depends on the elastic diagonal alone: the factor T of the block
    m I - P_dm dinv P_dm^T."""
    n, shared = bodies.where[b, N], bodies.where[b, IN_SHARED]
    P, dinv, T = part(bodies.P_dm, 3 * shared, 3 * n), part(w.dinv, shared, n), w.T[b]
    for r in range(3):
        for c in range(r + 1):
            product = weighted_product(part(P, r * n, n), part(P, c * n, n), dinv, n)
            T[r, c] = (bodies.mass[b] if r == c else 0.0) - product
    if bodies.where[b, NORMAL] >= 0:
        planar.hold_across(T, bodies.mass[b], bodies.where[b, NORMAL])
    if not cholesky_three(T):
        T[0, 0] = -1.0


@inlined
def factorise(bodies, w, b):
    """Cholesky factor of the Schur complement of body b on its elastic block. Returns True when it is positive.

    That of a rigid body is constant: it was there before.
    """
    if bodies.where[b, N] == 0:
        return w.L[b, 0, 0] > 0.0
    if bodies.where[b, NORMAL] >= 0:
        return planar.factorise(bodies, w, b)
    return spatial.factorise(bodies, w, b)


@inlined
def reduce_forces(bodies, w, b):
    """w.rigid = L^-1 (f_rigid - C dinv f_elastic), and dinv f_elastic where the elastic accelerations of body b will be."""
    f, z = part(w.f, bodies.where[b, IN_V], 6 + bodies.where[b, N]), w.rigid[b]
    for k in range(6):
        z[k] = f[k]
    if bodies.where[b, NORMAL] >= 0:
        planar.reduce_forces(bodies, w, b, f, z)
    else:
        spatial.reduce_forces(bodies, w, b, f, z)


@inlined
def accelerate(bodies, w, b):
    """w.acc of body b from its reduced forces: the rigid part, L^-T w.rigid, and what is there of the elastic one less
    dinv C^T of it."""
    z, acc = w.rigid[b], part(w.acc, bodies.where[b, IN_V], 6 + bodies.where[b, N])
    if bodies.where[b, NORMAL] >= 0:
        planar.accelerate(bodies, w, b, z, acc)
    else:
        spatial.accelerate(bodies, w, b, z, acc)


@kernel
def mass_times(bodies, w, b, y, out):
    """out += M y for body b; y and out (6 + n,) in body axes; the true mass matrix (elastic block identity)."""
    n, normal = bodies.where[b, N], bodies.where[b, NORMAL]
    s, linear, angular = get(w.s, b), (y[0], y[1], y[2]), (y[3], y[4], y[5])
    turn, lift = cross(angular, s), cross(s, linear)
    for k in range(3):
        out[k] += bodies.mass[b] * linear[k] + turn[k]
        out[3 + k] += lift[k] + dot(w.J[b, k], angular)
    if n > 0:
        P, H, _ = coupling(bodies, w, b)
        if normal >= 0:
            planar.couple_motions(P, H, y, n, normal, out)
        else:
            spatial.couple_motions(P, H, y, n, out)


@inlined
def energies(gravity, bodies, w, x, v, y, My):
    """(kinetic, strain, gravity) energy of all bodies; y, My scratch of the longest body. Needs `inertia` before."""
    kinetic, strain, potential = 0.0, 0.0, 0.0
    for b in range(bodies.mass.size):
        n, i, j, shared = bodies.where[b, N], bodies.where[b, IN_X], bodies.where[b, IN_V], bodies.where[b, IN_SHARED]
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
