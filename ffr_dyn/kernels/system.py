"""One evaluation of the equations of motion of a scene; everything an integrator or an analysis calls.

Order of calls: `prepare` once per elastic diagonal; `evaluate_bodies`, `evaluate_markers`, the loads, the constraint rows,
`evaluate_joints` at a state; then any number of solutions with that state's factors. Compiled as units in
`ffr_dyn.kernels.units`, and called as such where more than one place does.
"""

from ffr_dyn.kernels.blocks import (
    SIDE,
    add_pair,
    add_pair_in_plane,
    eliminate_in_plane,
    eliminate_side,
    factorise_blocks,
    solve_blocks,
    spread_rows,
)
from ffr_dyn.kernels.bodies import (
    accelerate,
    accelerate_rigid,
    factorise,
    inertia,
    normalise,
    prepare_body,
    reduce_forces,
    rotation_matrix,
    six_rows,
)
from ffr_dyn.kernels.lanes import add_scale, combine_6, dot_narrow, dot_rows, narrow_3, narrow_6
from ffr_dyn.kernels.loads import count_loads
from ffr_dyn.kernels.markers import (
    couple_marker,
    couple_pair,
    plane_rows,
    prepare_marker,
    project,
    shapes,
    update_marker,
)
from ffr_dyn.kernels.options import inlined, kernel
from ffr_dyn.kernels.packing import call_unit
from ffr_dyn.kernels.rows import reaction
from ffr_dyn.kernels.tables import ALL, BACK, IN_USE, LANES, LOADS, LOOK, NOT_FINITE, OK, REGAIN, RELATION
from ffr_dyn.kernels.vectors import (
    add,
    add_scaled,
    copy,
    cross,
    fill,
    get,
    in_plane,
    put,
    subtract,
    to_body,
    to_global,
)
from ffr_dyn.kernels.views import part, six_parts


@inlined
def prepare(bodies, markers, rows, pattern, bw, rw):
    """What depends on the elastic diagonal alone."""
    where = bodies.where
    for b in range(bodies.mass.size):
        prepare_body(bodies, bw, b)
    for k in markers.joint:
        b = markers.body[k]
        n, e = where[b, 0], where[b, 3]
        if n > 0:
            prepare_marker(shapes(markers, k, n), part(bw.Cd, 6 * e, 6 * n), n, where[b, 7], rw.P[k])
    for p in range(pattern.pair_body.size):
        b = pattern.pair_body[p]
        n, e = where[b, 0], where[b, 3]
        if n > 0:
            left = rows.marker[pattern.pair[p, 0], pattern.pair[p, 1]]
            right = rows.marker[pattern.pair[p, 2], pattern.pair[p, 3]]
            couple_pair(
                shapes(markers, left, n), shapes(markers, right, n), part(bw.dinv, e, n), n, where[b, 7], rw.phiphi[p]
            )


@inlined
def evaluate_bodies(gravity, bodies, w, x, v):
    """Inertia, forces and factors of all bodies. Returns the number of a body without a positive mass matrix, or -1."""
    for b in range(bodies.mass.size):
        inertia(gravity, bodies, w, x, v, b)
        if not factorise(bodies, w, b):
            return b
    return -1


@inlined
def couple_joints(bodies, markers, rows, pattern, bw, rw):
    """Rows after elimination of the elastic coordinates, and the multiplier matrix."""
    where, sides = bodies.where, rows.marker.shape[1]
    fill(rw.scale, 0.0)
    ground = where.shape[0] - 1
    for k in markers.joint:
        b = markers.body[k]
        n, e = where[b, 0], where[b, 3]
        if n > 0:
            couple_marker(shapes(markers, k, n), part(bw.Cd, 6 * e, 6 * n), n, where[b, 7], rw.P[k])
    for k in range(rows.marker.shape[0]):
        for side in range(sides):
            marker = rows.marker[k, side]
            b = markers.body[marker] if marker >= 0 else ground
            if b != ground:
                number = k * sides + side
                at, jac = number * SIDE, part(rw.jac, 9 * LANES * number, 9 * LANES)
                flexible, normal, L = where[b, 0] > 0, where[b, 7], part(bw.L, 36 * b, 36)
                spread_rows(jac, flexible, normal, rw.X, at)
                if normal >= 0:
                    eliminate_in_plane(flexible, normal, rw.P[marker], L, rw.X, at)
                else:
                    eliminate_side(flexible, rw.P[marker], L, rw.X, at)
                add_scale(jac, bw.inverse[b, 0], bw.inverse[b, 1], rw.scale, LANES * k)
    fill(rw.S, 0.0)
    for p in range(pattern.pair_body.size):
        b, later, earlier = pattern.pair_body[p], pattern.pair[p, 0], pattern.pair[p, 2]
        first = (later * sides + pattern.pair[p, 1]) * SIDE
        second = (earlier * sides + pattern.pair[p, 3]) * SIDE
        flexible, size, at = where[b, 0] > 0, rows.start[earlier + 1] - rows.start[earlier], pattern.pair[p, 4]
        if where[b, 7] >= 0:
            add_pair_in_plane(rw.X, first, second, size, flexible, rw.phiphi[p], rw.Y, rw.S, at)
        else:
            add_pair(rw.X, first, second, size, flexible, rw.phiphi[p], rw.Y, rw.S, at)


@inlined
def evaluate_markers(m, w, which, x, v):
    """Markers in use, of joints, or all (see `tables`), from what `evaluate_bodies` left."""
    some = m.markers.active if which == IN_USE else m.markers.joint
    for number in range(m.markers.body.size if which == ALL else some.size):
        k = number if which == ALL else some[number]
        update_marker(m.bodies.where, m.markers, w.markers, x, v, k)


@kernel
def turn_bodies(where, w, x, v):
    """Rotation and angular velocity of all bodies."""
    for b in range(where.shape[0] - 1):
        i, j = where[b, 1], where[b, 2]
        rotation_matrix(x[i + 3], x[i + 4], x[i + 5], x[i + 6], w.A[b])
        put(w.omega, b, (v[j + 3], v[j + 4], v[j + 5]))


@inlined
def clear_and_load(r, x):
    """All applied loads at the address x of positions, also by marker."""
    if count_loads(r.model.loads) > 0:
        load = r.work.markers.load
        fill(part(load, 0, load.size), 0.0)
        call_unit(r.units[LOADS], r.address, -1.0, x, 0)


@inlined
def evaluate_joints(m, w):
    """Factors of the multiplier matrix from the constraint rows. Returns the row without a pivot, or -1."""
    couple_joints(m.bodies, m.markers, m.rows, m.pattern, w.bodies, w.rows)
    return factorise_blocks(m.rows.start, m.pattern, w.rows.S, m.relaxation, w.rows, w.independence)


@kernel
def largest(values):
    result = 0.0
    for k in range(values.size):
        if not abs(values[k]) <= result:  # NaN is largest
            result = abs(values[k])
    return result


@kernel
def row_of_largest(values):
    row = 0
    for k in range(values.size):
        if abs(values[k]) > abs(values[row]):
            row = k
    return row


@inlined
def solve_motion(r, target):
    """acc, lam from  M acc + Phi_q^T lam = f,  Phi_q acc = target (C,)."""
    m, w = r.model, r.work
    for b in range(m.bodies.mass.size):
        reduce_forces(m.bodies, w.bodies, b)
    reduced_rates(m.bodies, m.markers, m.rows, w.bodies, w.rows, target)
    call_unit(r.units[BACK], r.address, 0.0, 0, 0)
    gather_rows(m.rows.start, w.rows.step, w.rows.lam)


@inlined
def refine_motion(r, target, passes):
    """What relaxation of the multiplier matrix does to the motion, taken out again.

    Of the multipliers that dependent rows leave open, the smallest are found (method of multipliers; Bayo & Ledesma,
    Nonlinear Dynamics 9 (1996) 113-130).
    """
    m, bw, rw = r.model, r.work.bodies, r.work.rows
    before = 0.0
    for number in range(1, passes):
        constraint_rates(m.bodies.where, m.markers, m.rows, rw.jac, bw.acc, rw.left)
        add_scaled(rw.left, rw.left, -1.0, target)
        left = largest(rw.left)
        if number > 1 and not left < 0.5 * before:
            break
        before = left
        copy(bw.more, bw.acc)
        call_unit(r.units[REGAIN], r.address, 0.0, rw.left.ctypes.data, 0)
        add_scaled(bw.acc, bw.more, 1.0, bw.acc)
        gather_rows(m.rows.start, rw.step, rw.left)
        add_scaled(rw.lam, rw.lam, 1.0, rw.left)


@inlined
def reduce_miss(rows, bw, step, value):
    """Reduced forces and `step` of a motion that only the rows ask for: Phi_q acc = -value."""
    fill(bw.elastic, 0.0)
    fill(part(bw.rigid, 0, bw.rigid.size), 0.0)
    for k in range(rows.start.size - 1):
        for row in range(rows.start[k], rows.start[k + 1]):
            step[LANES * k + row - rows.start[k]] = value[row]


@inlined
def solve_back(bodies, markers, rows, pattern, bw, rw):
    """step and acc from what the rows miss (step) and the reduced forces."""
    solve_blocks(rows.start, pattern, rw.S, rw.pivots, rw.step)
    react(bodies, markers, rows, bw, rw)


@kernel
def gather_rows(starts, lanes, out):
    """out (C,) = the rows of all joints from their lanes."""
    for k in range(starts.size - 1):
        for row in range(starts[k], starts[k + 1]):
            out[row] = lanes[LANES * k + row - starts[k]]


@inlined
def reduced_rates(bodies, markers, rows, bw, rw, target):
    """step = Phi_q M^-1 f - target, from the reduced forces of the bodies and the eliminated rows."""
    where, ground, sides = bodies.where, bodies.mass.size, rows.marker.shape[1]
    for k in range(rows.marker.shape[0]):
        for row in range(rows.start[k], rows.start[k + 1]):
            rw.step[LANES * k + row - rows.start[k]] = -target[row]
        for side in range(sides):
            marker = rows.marker[k, side]
            b = markers.body[marker] if marker >= 0 else ground
            if b != ground:
                n, e, normal, at = where[b, 0], where[b, 3], where[b, 7], (k * sides + side) * SIDE
                z, moved, elastic = bw.rigid[b], rw.wrench, part(bw.elastic, e, n)
                if normal >= 0:
                    c0, c1, c2 = in_plane(normal)
                    moved[0], moved[1], moved[2] = z[c0], z[c1], z[c2]
                    if n > 0:
                        moved[3], moved[4], moved[5] = plane_rows(shapes(markers, marker, n), normal, elastic, n)
                        narrow_6(rw.step, LANES * k, 1.0, moved, 0, 1, rw.X, at)
                    else:
                        narrow_3(rw.step, LANES * k, 1.0, moved, 0, 1, rw.X, at)
                    continue
                combine_6(rw.step, LANES * k, 1.0, z, 0, 1, rw.X, at)
                if n > 0:
                    phi = shapes(markers, marker, n)
                    moved[0], moved[1], moved[2], moved[3], moved[4], moved[5] = six_rows(phi, elastic, n)
                    combine_6(rw.step, LANES * k, 1.0, moved, 0, 1, rw.X, at + 6 * LANES)


@inlined
def constraint_rates(where, markers, rows, jac, acc, out):
    """out = Phi_q acc."""
    fill(out, 0.0)
    ground, sides = where.shape[0] - 1, rows.marker.shape[1]
    for k in range(rows.marker.shape[0]):
        for side in range(sides):
            marker = rows.marker[k, side]
            b = markers.body[marker] if marker >= 0 else ground
            if b != ground:
                n, j, own = where[b, 0], where[b, 2], jac[k * sides + side]
                phi = shapes(markers, marker, n)
                first, last, moved = rows.start[k], rows.start[k + 1], part(acc, j, 6 + n)
                if where[b, 7] >= 0:
                    add_side_rates_in_plane(phi, own, moved, first, last, n, where[b, 7], out)
                else:
                    add_side_rates(phi, own, moved, first, last, n, out)


@kernel
def add_side_rates(phi, a, acc, first, last, n, out):
    e0, e1, e2, e3, e4, e5 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if n > 0:
        e0, e1, e2, e3, e4, e5 = six_rows(phi, part(acc, 6, n), n)
    for k in range(last - first):
        out[first + k] += (
            a[0, k] * (acc[0] + e0) + a[1, k] * (acc[1] + e1) + a[2, k] * (acc[2] + e2)
            + a[3, k] * acc[3] + a[4, k] * acc[4] + a[5, k] * acc[5]
            + a[6, k] * e3 + a[7, k] * e4 + a[8, k] * e5
        )  # fmt: skip


@kernel
def add_side_rates_in_plane(phi, a, acc, first, last, n, normal, out):
    i, j, turn = in_plane(normal)
    e0, e1, e2 = 0.0, 0.0, 0.0
    if n > 0:
        e0, e1, e2 = plane_rows(phi, normal, part(acc, 6, n), n)
    for k in range(last - first):
        out[first + k] += (
            a[i, k] * (acc[i] + e0) + a[j, k] * (acc[j] + e1) + a[turn, k] * acc[turn] + a[6 + normal, k] * e2
        )


@inlined
def add_reactions(where, markers, rows, jac, lam, out):
    """out (V,) += Phi_q^T lam in body axes."""
    ground, sides = where.shape[0] - 1, rows.marker.shape[1]
    for k in range(rows.marker.shape[0]):
        for side in range(sides):
            marker = rows.marker[k, side]
            b = markers.body[marker] if marker >= 0 else ground
            if b != ground:
                n, j, own = where[b, 0], where[b, 2], jac[k * sides + side]
                phi = shapes(markers, marker, n)
                add_side_reactions(phi, own, lam, rows.start[k], rows.start[k + 1], n, part(out, j, 6 + n))


@kernel
def add_side_reactions(phi, a, lam, first, last, n, out):
    force, twist = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for k in range(last - first):
        value = lam[first + k]
        force = add(force, (a[0, k] * value, a[1, k] * value, a[2, k] * value))
        twist = add(twist, (a[6, k] * value, a[7, k] * value, a[8, k] * value))
        for c in range(3):
            out[3 + c] += a[3 + c, k] * value
    for c in range(3):
        out[c] += force[c]
    if n > 0:
        project(phi, force, twist, part(out, 6, n), n)


@inlined
def react(bodies, markers, rows, bw, rw):
    """acc from the reduced forces, less Phi_q^T step by the eliminated rows."""
    where, ground, sides = bodies.where, bodies.mass.size, rows.marker.shape[1]
    for k in range(rows.marker.shape[0]):
        for side in range(sides):
            marker = rows.marker[k, side]
            b = markers.body[marker] if marker >= 0 else ground
            if b != ground:
                n, e, at, z = where[b, 0], where[b, 3], (k * sides + side) * SIDE, bw.rigid[b]
                normal, wrench = where[b, 7], rw.wrench
                react_rigid(rw.X, at, rw.step, LANES * k, normal, z)
                if n > 0:
                    phi, elastic = shapes(markers, marker, n), part(bw.elastic, e, n)
                    if normal >= 0:
                        for c in range(3):
                            wrench[c] = dot_narrow(rw.X, at + LANES * (3 + c), rw.step, LANES * k)
                        release_in_plane(phi, normal, part(bw.dinv, e, n), wrench, n, elastic)
                    else:
                        for c in range(6):
                            wrench[c] = dot_rows(rw.X, at + LANES * (6 + c), rw.step, LANES * k)
                        release(phi, part(bw.dinv, e, n), wrench, n, elastic)
    for b in range(ground):
        accelerate(bodies, bw, b)


@inlined
def solve_loads(r, target):
    """`solve_motion` without the elastic part of acc: what the loads of geometric stiffening are made of."""
    m, bw, rw = r.model, r.work.bodies, r.work.rows
    ground, sides = m.bodies.mass.size, m.rows.marker.shape[1]
    for b in range(ground):
        reduce_forces(m.bodies, bw, b)
    reduced_rates(m.bodies, m.markers, m.rows, bw, rw, target)
    solve_blocks(m.rows.start, m.pattern, rw.S, rw.pivots, rw.step)
    gather_rows(m.rows.start, rw.step, rw.lam)
    for k in range(m.rows.marker.shape[0]):
        for side in range(sides):
            marker = m.rows.marker[k, side]
            b = m.markers.body[marker] if marker >= 0 else ground
            if b != ground:
                at, normal = (k * sides + side) * SIDE, m.bodies.where[b, 7]
                react_rigid(rw.X, at, rw.step, LANES * k, normal, bw.rigid[b])
    for b in range(ground):
        accelerate_rigid(m.bodies, bw, b)


@kernel
def react_rigid(X, at, step, own, normal, z):
    """Reduced forces z (6,) of a body less those of a side's reactions."""
    if normal >= 0:
        i, j, k = in_plane(normal)
        z[i] -= dot_narrow(X, at, step, own)
        z[j] -= dot_narrow(X, at + LANES, step, own)
        z[k] -= dot_narrow(X, at + 2 * LANES, step, own)
    else:
        for c in range(6):
            z[c] -= dot_rows(X, at + LANES * c, step, own)


@kernel
def release_in_plane(phi, normal, dinv, wrench, n, elastic):
    """`release` for a planar body: two forces and a moment."""
    i, j, k = in_plane(normal)
    p0, p1, p2 = part(phi, i * n, n), part(phi, j * n, n), part(phi, k * n, n)
    f0, f1, moment = wrench[0], wrench[1], wrench[2]
    for c in range(n):
        elastic[c] -= dinv[c] * (p0[c] * f0 + p1[c] * f1 + p2[c] * moment)


@kernel
def release(phi, dinv, wrench, n, elastic):
    """elastic -= dinv phi^T wrench."""
    p0, p1, p2, p3, p4, p5 = six_parts(phi, n)
    f0, f1, f2, m0, m1, m2 = wrench[0], wrench[1], wrench[2], wrench[3], wrench[4], wrench[5]
    for j in range(n):
        elastic[j] -= dinv[j] * (
            p0[j] * f0 + p1[j] * f1 + p2[j] * f2 + p3[j] * m0 + p4[j] * m1 + p5[j] * m2
        )  # fmt: skip


@inlined
def apply_motion(where, A, x, step):
    """x <- x moved by the small motion `step` (body axes, as acc)."""
    for b in range(where.shape[0] - 1):
        n, i, j = where[b, 0], where[b, 1], where[b, 2]
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
        j = where[b, 2]
        linear = to_global(A[b], (acc[j], acc[j + 1], acc[j + 2]))
        for c in range(3):
            vd[j + c] = linear[c]
        for c in range(3, 6 + where[b, 0]):
            vd[j + c] = acc[j + c]


@inlined
def to_body_axes(where, A, r):
    """In place: a vector shaped like v from global to body axes in its R_dot parts."""
    for b in range(where.shape[0] - 1):
        j = where[b, 2]
        linear = to_body(A[b], (r[j], r[j + 1], r[j + 2]))
        for c in range(3):
            r[j + c] = linear[c]


@inlined
def acceleration_target(w, gains, target):
    """target = gamma - 2 alpha Phi_dot - beta^2 Phi (Baumgarte 1972; alpha = beta = 0: plain index 1)."""
    alpha, beta = gains[0], gains[1]
    for row in range(target.size):
        target[row] = w.gamma[row] - 2.0 * alpha * w.nu[row] - beta * beta * w.Phi[row]


@inlined
def move_back(r, t, x, v):
    """One projection of (x, v) onto the constraints, smallest in the norm of the mass matrix: of the positions first,
    then of the velocities onto the rows that hold there."""
    bodies, w = r.model.bodies, r.work
    call_unit(r.units[REGAIN], r.address, 0.0, w.rows.Phi.ctypes.data, 0)
    apply_motion(bodies.where, w.bodies.A, x, w.bodies.acc)
    normalise(bodies, x)
    call_unit(r.units[LOOK], r.address, t, x.ctypes.data, v.ctypes.data)
    call_unit(r.units[REGAIN], r.address, 0.0, w.rows.nu.ctypes.data, 0)
    to_velocity_rates(bodies.where, w.bodies.A, w.bodies.acc, w.vd)
    add_scaled(v, v, 1.0, w.vd)


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
        if rows.start[k] < rows.start[k + 1] and rows.kind[rows.start[k]] == RELATION:
            fill(out[k], 0.0)
            out[k, 0] = -rw.lam[rows.start[k]]
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
            out[k, c] = force[c]
            out[k, 3 + c] = moment[c]
