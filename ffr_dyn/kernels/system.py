"""One evaluation of the equations of motion of a scene; everything an integrator or an analysis calls.

Order of calls: `prepare` once per elastic diagonal; `factorise_bodies`, `update_markers`, the loads, the constraint rows,
`evaluate_joints` at a state; then any number of solutions (`ffr_dyn.kernels.solution`) with its factors. Evaluations are
called from `ffr_dyn.kernels.entry_points` alone.

Twin: `ffr_dyn.equations.motion.equations_of_motion`.
"""

from ffr_dyn.kernels.bodies import factorise, inertia, prepare_body, rotation_matrix
from ffr_dyn.kernels.forces.implicit import soften_block
from ffr_dyn.kernels.markers import couple_marker, couple_pair, prepare_marker, shapes, update_marker
from ffr_dyn.kernels.multiplier_solver import (
    SIDE,
    add_scale,
    clear_column,
    couple_sides,
    eliminate_side,
    factorise_block,
    relax_block,
)
from ffr_dyn.kernels.options import inlined, kernel
from ffr_dyn.kernels.rows import RELATION, reaction
from ffr_dyn.kernels.simd.slices import part
from ffr_dyn.kernels.spatial import coupling
from ffr_dyn.kernels.tables import (
    ALL,
    ALPHA,
    BETA,
    EARLIER,
    EARLIER_SIDE,
    HERE,
    IN_BENDING,
    IN_SHARED,
    IN_USE,
    IN_V,
    IN_X,
    LANES,
    LATER,
    LATER_SIDE,
    MOMENT,
    NORMAL,
    NOT_FINITE,
    OK,
    OPENED,
    PHI,
    PHIPHI,
    TARGET,
    N,
)
from ffr_dyn.kernels.vectors import cross, fill, get, in_plane, put, subtract, to_body, to_global

# Of the nine coefficients of a side (see `tables.RowWork.jac`), those that the rigid and the elastic coordinates move.
RIGID, ELASTIC = (0, 1, 2, 3, 4, 5), (0, 1, 2, 6, 7, 8)


@inlined
def prepare(bodies, markers, rows, pattern, bw, mw, rw):
    """Compute what depends on the elastic diagonal alone; shapes at markers of second-order bodies do not: `couple_joint`."""
    where = bodies.where
    for b in range(bodies.mass.size):
        prepare_body(bodies, bw, b)
    for k in markers.joint:
        b = markers.body[k]
        n, shared = where[b, N], where[b, IN_SHARED]
        if n > 0:
            P_dm, dinv = part(bodies.P_dm, 3 * shared, 3 * n), part(bw.dinv, shared, n)
            prepare_marker(shapes(markers, mw.phi, k, n), P_dm, dinv, n, where[b, NORMAL], rw.P[k])
    for number in range(pattern.sample.size):
        p = pattern.sample[number]
        b = pattern.pair_body[p]
        n = where[b, N]
        if n > 0:
            couple_elastic(bodies, markers, rows, pattern, bw, mw, rw, p)


@inlined
def couple_elastic(bodies, markers, rows, pattern, bw, mw, rw, p):
    """Add the coupling of pair number p that comes from elastic coordinates."""
    b = pattern.pair_body[p]
    n, dinv = bodies.where[b, N], part(bw.dinv, bodies.where[b, IN_SHARED], bodies.where[b, N])
    left = shapes(markers, mw.phi, rows.marker[pattern.pair[p, LATER], pattern.pair[p, LATER_SIDE]], n)
    right = shapes(markers, mw.phi, rows.marker[pattern.pair[p, EARLIER], pattern.pair[p, EARLIER_SIDE]], n)
    couple_pair(left, right, dinv, n, bodies.where[b, NORMAL], rw.phiphi[pattern.pair[p, PHIPHI]])


@inlined
def factorise_bodies(gravity, bodies, w, x, v):
    """Inertia, forces and factors of all bodies. Returns the number of a body without a positive mass matrix, or -1."""
    for b in range(bodies.mass.size):
        inertia(gravity, bodies, w, x, v, b)
        if not factorise(bodies, w, b):
            return b
    return -1


@inlined
def couple_joint(bodies, markers, rows, pattern, bw, mw, rw, k):
    """Rows of joint k after elimination of the elastic coordinates, and what couples it with itself and the joints before."""
    where, sides = bodies.where, rows.marker.shape[1]
    ground = where.shape[0] - 1
    fill(part(rw.scale, LANES * k, LANES), 0.0)
    fill(part(rw.relief, LANES * k, LANES), 0.0)
    for side in range(sides):
        marker = rows.marker[k, side]
        b = markers.body[marker] if marker >= 0 else ground
        if b != ground:
            number, n = k * sides + side, where[b, N]
            at, jac = number * SIDE, part(rw.jac, 9 * LANES * number, 9 * LANES)
            flexible, normal, L, P = n > 0, where[b, NORMAL], part(bw.L, 36 * b, 36), rw.P[marker]
            if flexible and rows.first[k, side] == 1:
                _, H, dinv = coupling(bodies, bw, b)
                couple_marker(shapes(markers, mw.phi, marker, n), H, dinv, n, normal, P)
            if normal >= 0:
                c0, c1, c2 = in_plane(normal)
                eliminate_side(jac, (c0, c1, c2), (c0, c1, 6 + normal), flexible, P, L, rw.X, at)
            else:
                eliminate_side(jac, RIGID, ELASTIC, flexible, P, L, rw.X, at)
            add_scale(jac, bw.inverse[b, 0], bw.inverse[b, 1], rw.scale, LANES * k)
    clear_column(pattern, rw.S, k)
    for p in range(pattern.pair_start[k], pattern.pair_start[k + 1]):
        b, earlier = pattern.pair_body[p], pattern.pair[p, EARLIER]
        first = (k * sides + pattern.pair[p, LATER_SIDE]) * SIDE
        second = (earlier * sides + pattern.pair[p, EARLIER_SIDE]) * SIDE
        flexible, size = where[b, N] > 0, rows.start[earlier + 1] - rows.start[earlier]
        at, phiphi = pattern.pair[p, TARGET], rw.phiphi[pattern.pair[p, PHIPHI]]
        if flexible and markers.second[rows.marker[k, pattern.pair[p, LATER_SIDE]], IN_BENDING] >= 0:
            couple_elastic(bodies, markers, rows, pattern, bw, mw, rw, p)
        if where[b, NORMAL] >= 0:
            couple_sides(rw.X, first, second, size, 3, flexible, phiphi, rw.Y, rw.S, at)
        else:
            couple_sides(rw.X, first, second, size, 6, flexible, phiphi, rw.Y, rw.S, at)


@inlined
def update_markers(m, w, which, x, v):
    """Markers in use, of joints, or all (see `tables`), from what `factorise_bodies` left."""
    some = m.markers.active if which == IN_USE else m.markers.joint
    for number in range(m.markers.body.size if which == ALL else some.size):
        k = number if which == ALL else some[number]
        update_marker(m.bodies.where, m.markers, w.markers, x, v, k)


@kernel
def turn_bodies(where, w, x, v):
    """Rotation and angular velocity of all bodies."""
    for b in range(where.shape[0] - 1):
        i, j = where[b, IN_X], where[b, IN_V]
        rotation_matrix(x[i + 3], x[i + 4], x[i + 5], x[i + 6], w.A[b])
        put(w.omega, b, (v[j + 3], v[j + 4], v[j + 5]))


@inlined
def evaluate_joints(m, w):
    """Factors of the multiplier matrix from the constraint rows. Returns the row without a pivot, or -1.

    A joint is eliminated as soon as all that its column reaches is there, while what it needs is still near at hand.
    """
    w.independence[HERE] = 1.0
    done = 0
    for k in range(m.rows.marker.shape[0]):
        couple_joint(m.bodies, m.markers, m.rows, m.pattern, w.bodies, w.markers, w.rows, k)
        soften_block(m.rows, m.pattern, w.rows, k)
        if m.relaxation > 0.0:
            relax_block(m.rows.start, m.pattern, w.rows.S, m.relaxation, k)
        while done <= k and m.pattern.reach[done] <= k:
            failed = factorise_block(m.rows.start, m.rows.forced, m.pattern, w.rows.S, w.rows, w.independence, done)
            if failed >= 0:
                return failed
            done += 1
    return -1


@kernel
def largest(values):
    result = 0.0
    for k in range(values.size):
        if not abs(values[k]) <= result:  # NaN is largest
            result = abs(values[k])
    return result


@kernel
def note_drift(drift, position, row, t):
    """Keep by how much the constraints are open at time t, most of all in a row, where that is more than before."""
    if position > drift[PHI]:
        drift[PHI], drift[OPENED], drift[MOMENT] = position, row, t


@kernel
def row_of_largest(values):
    row = 0
    for k in range(values.size):
        if abs(values[k]) > abs(values[row]):
            row = k
    return row


@inlined
def apply_motion(where, A, x, step):
    """x <- x moved by the small motion `step` (body axes, as acc)."""
    for b in range(where.shape[0] - 1):
        n, i, j = where[b, N], where[b, IN_X], where[b, IN_V]
        shift = to_global(A[b], (step[j], step[j + 1], step[j + 2]))
        for c in range(3):
            x[i + c] += shift[c]
        hx, hy, hz = 0.5 * step[j + 3], 0.5 * step[j + 4], 0.5 * step[j + 5]
        p0, p1, p2, p3 = x[i + 3], x[i + 4], x[i + 5], x[i + 6]
        x[i + 3] += -p1 * hx - p2 * hy - p3 * hz
        x[i + 4] += p0 * hx - p3 * hy + p2 * hz
        x[i + 5] += p3 * hx + p0 * hy - p1 * hz
        x[i + 6] += -p2 * hx + p1 * hy + p0 * hz
        for c in range(n):
            x[i + 7 + c] += step[j + 6 + c]


@kernel
def to_velocity_rates(where, A, acc, vd):
    """vd = d/dt of v = [R_dot (global), omega_bar, q_dot] from acc (body axes)."""
    for b in range(where.shape[0] - 1):
        j = where[b, IN_V]
        linear = to_global(A[b], (acc[j], acc[j + 1], acc[j + 2]))
        for c in range(3):
            vd[j + c] = linear[c]
        for c in range(3, 6 + where[b, N]):
            vd[j + c] = acc[j + c]


@inlined
def to_body_axes(where, A, r):
    """In place: a vector shaped like v from global to body axes in its R_dot parts."""
    for b in range(where.shape[0] - 1):
        j = where[b, IN_V]
        linear = to_body(A[b], (r[j], r[j + 1], r[j + 2]))
        for c in range(3):
            r[j + c] = linear[c]


@inlined
def acceleration_target(w, gains, target):
    """target = gamma - 2 alpha Phi_dot - beta^2 Phi (Baumgarte 1972; alpha = beta = 0: plain index 1)."""
    alpha, beta = gains[ALPHA], gains[BETA]
    for row in range(target.size):
        target[row] = w.gamma[row] - 2.0 * alpha * w.nu[row] - beta * beta * w.Phi[row]


@inlined
def finite(x, v):
    """OK when the state holds no NaN and no infinity."""
    total = 0.0
    for k in range(x.size):
        total += x[k] * 0.0
    for k in range(v.size):
        total += v[k] * 0.0
    return OK if total == 0.0 else NOT_FINITE


@inlined
def reactions(rows, mw, rw, out):
    """out (K, 6): force and moment (global axes) that marker i's body exerts on marker j's body at marker j.

    A relation between joint coordinates has one number: the force or torque along a coordinate of factor one.
    """
    for k in range(rows.marker.shape[0]):
        at = rows.reaction[k]
        if at < 0:
            continue
        if rows.start[k] < rows.start[k + 1] and rows.kind[rows.start[k]] == RELATION:
            fill(out[at], 0.0)
            out[at, 0] = -rw.lam[rows.start[k]]
            continue
        marker = rows.marker[k, 1]
        force, moment = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        for side in range(1, rows.marker.shape[1], 2):  # a screw has the same markers twice
            if rows.marker[k, side] == marker:
                pull, turn = reaction(rw, rows, k, side)
                force, moment = subtract(force, pull), subtract(moment, turn)
        moment = subtract(moment, cross(get(mw.u, marker), force))
        force, moment = to_global(mw.A[mw.body[marker]], force), to_global(mw.A[mw.body[marker]], moment)
        for c in range(3):
            out[at, c] = force[c]
            out[at, 3 + c] = moment[c]
