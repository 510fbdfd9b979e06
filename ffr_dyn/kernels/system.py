"""One evaluation of the equations of motion of a scene; everything an integrator or an analysis calls.

Order of calls: `prepare` once per elastic diagonal; `evaluate` at a state; then any number of `solve_motion` and
`solve_correction` with that state's factors.
"""

from ffr_dyn.kernels.actions import keep_turns
from ffr_dyn.kernels.blocks import add_pair, eliminate_side, factorise_blocks, solve_blocks
from ffr_dyn.kernels.bodies import back_substitute, factorise, inertia, normalise, row_dot, solve_body
from ffr_dyn.kernels.functions import evaluate_functions
from ffr_dyn.kernels.loads import apply_loads, call_user, gravity_field
from ffr_dyn.kernels.markers import couple_marker, couple_pair, project, shapes, update_marker
from ffr_dyn.kernels.options import inlined, kernel
from ffr_dyn.kernels.rows import evaluate_block
from ffr_dyn.kernels.tables import NOT_FINITE, OK, RELATION, SINGULAR_BODY, SINGULAR_CONSTRAINT, USER_FAILED
from ffr_dyn.kernels.vectors import (
    add_scaled,
    copy,
    cross,
    fill,
    get,
    rigid_lower,
    rigid_upper,
    subtract,
    to_body,
    to_global,
)


@inlined
def prepare(where, markers, rows, pattern, dinv, phiphi):
    """What depends on the elastic diagonal alone: phiphi, the elastic coupling between markers of one body."""
    for p in range(pattern.pair_body.size):
        b = pattern.pair_body[p]
        n, e = where[b, 0], where[b, 3]
        if n > 0:
            left = rows.marker[pattern.pair[p, 0], pattern.pair[p, 1]]
            right = rows.marker[pattern.pair[p, 2], pattern.pair[p, 3]]
            couple_pair(shapes(markers, left, n), shapes(markers, right, n), dinv[e : e + n], n, phiphi[p])


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
    """Rigid parts of all rows after elimination of the elastic coordinates, and the multiplier matrix."""
    where = bodies.where
    fill(rw.scale, 0.0)
    ground = where.shape[0] - 1
    for k in markers.joint:
        b = markers.body[k]
        n, e = where[b, 0], where[b, 3]
        if n > 0:
            couple_marker(shapes(markers, k, n), bw.Cd[6 * e : 6 * (e + n)], n, where[b, 7], rw.P[k])
    for k in range(rows.marker.shape[0]):
        for side in range(rows.marker.shape[1]):
            marker = rows.marker[k, side]
            b = markers.body[marker] if marker >= 0 else ground
            if b != ground:
                first, last = rows.start[k], rows.start[k + 1]
                flexible, normal = where[b, 0] > 0, where[b, 7]
                mass, turning = bodies.mass[b], bw.J[b, 0, 0] + bw.J[b, 1, 1] + bw.J[b, 2, 2]
                eliminate_side(
                    first,
                    last,
                    side,
                    flexible,
                    normal,
                    rw.P[marker],
                    bw.L[b],
                    mass,
                    turning,
                    rw.jac,
                    rw.rr,
                    rw.ww,
                    rw.scale,
                )
    fill(rw.S, 0.0)
    for p in range(pattern.pair_body.size):
        flexible = where[pattern.pair_body[p], 0] > 0
        add_pair(rows.start, pattern.pair[p], flexible, rw.phiphi[p], rw.ww, rw.jac, rw.S)


# Near a singular position the rows become dependent, and a violation eta of the constraints throws the motion from its
# branch when it comes closer than about eta^(1/3). So on the approach (`independence` below NEAR) the violation is held far
# lower, and at the position itself (below AT) it is left alone: along the direction that is about to be free a correction
# would be the violation divided by the distance.
NEAR, AT = 1e-2, 1e-6
TIGHTER = 1e-4


@kernel
def evaluate(m, w, t, x, v):
    """Fill w at (t, x, v): right-hand sides, constraint rows, factors. Returns a status; w.info[0] says where."""
    bodies, markers, rows, bw, mw, rw = m.bodies, m.markers, m.rows, w.bodies, w.markers, w.rows
    w.info[1] += 1
    if not call_user(m.user_address, t, x, v, w.user):
        return USER_FAILED
    evaluate_functions(m.functions, w.user, t, w.functions)
    gravity_field(m.gravity, m.base, w.functions, w.field)
    failed = evaluate_bodies(w.field, bodies, bw, x, v)
    if failed >= 0:
        w.info[0] = failed
        return SINGULAR_BODY
    for k in markers.active:
        b = markers.body[k]
        update_marker(bodies.where, markers, mw, bw.A[b], get(bw.omega, b), x, v, k)
    apply_loads(bodies.where, markers, m.loads, bw.A, mw, w.loads, w.functions, w.user, x, bw.f)
    for k in range(rows.marker.shape[0]):
        evaluate_block(rows, w.functions, mw, rw, k)
    couple_joints(bodies, markers, rows, m.pattern, bw, rw)
    failed = factorise_blocks(rows.start, m.pattern, rw.S, m.relaxation, rw.scale, w.independence)
    if failed >= 0:
        w.info[0] = failed
        return SINGULAR_CONSTRAINT
    if w.independence[0] < w.independence[1]:
        w.independence[1], w.independence[2] = w.independence[0], t
    return OK


@kernel
def largest(values):
    result = 0.0
    for k in range(values.size):
        if not abs(values[k]) <= result:  # NaN is largest
            result = abs(values[k])
    return result


@kernel
def solve_motion(bodies, markers, rows, pattern, bw, rw, target, passes):
    """acc, lam from  M acc + Phi_q^T lam = f,  Phi_q acc = target (C,).

    One pass is exact where the rows are independent. With a relaxed multiplier matrix further passes remove the effect
    of the relaxation from the motion; of the multipliers that dependent rows leave open, the smallest are found (method
    of multipliers; Bayo & Ledesma, Nonlinear Dynamics 9 (1996) 113-130).
    """
    for b in range(bodies.mass.size):
        solve_body(bodies, bw, b)
    fill(rw.lam, 0.0)
    before = 0.0
    for number in range(passes):
        constraint_rates(bodies.where, markers, rows, rw.jac, bw.acc, rw.step)
        for row in range(target.size):
            rw.step[row] -= target[row]
        left = largest(rw.step)
        if number > 0 and not left < 0.5 * before:
            break
        before = left
        solve_blocks(rows.start, pattern, rw.S, rw.step)
        react(bodies, markers, rows, bw, rw)
        add_scaled(rw.lam, rw.lam, 1.0, rw.step)


@kernel
def solve_correction(bodies, markers, rows, pattern, bw, rw, value):
    """acc, step from  M acc + Phi_q^T step = 0,  Phi_q acc = -value: the mass-orthogonal projection."""
    fill(bw.acc, 0.0)
    copy(rw.step, value)
    solve_blocks(rows.start, pattern, rw.S, rw.step)
    react(bodies, markers, rows, bw, rw)


@inlined
def constraint_rates(where, markers, rows, jac, acc, out):
    """out = Phi_q acc."""
    fill(out, 0.0)
    ground = where.shape[0] - 1
    for k in range(rows.marker.shape[0]):
        for side in range(rows.marker.shape[1]):
            marker = rows.marker[k, side]
            b = markers.body[marker] if marker >= 0 else ground
            if b != ground:
                n, j = where[b, 0], where[b, 2]
                phi = shapes(markers, marker, n)
                add_side_rates(phi, jac, acc[j : j + 6 + n], rows.start[k], rows.start[k + 1], side, n, out)


@kernel
def add_side_rates(phi, jac, acc, first, last, side, n, out):
    e0, e1, e2, e3, e4, e5 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if n > 0:
        q = acc[6:]
        e0, e1, e2 = row_dot(phi, 0, q, n), row_dot(phi, 1, q, n), row_dot(phi, 2, q, n)
        e3, e4, e5 = row_dot(phi, 3, q, n), row_dot(phi, 4, q, n), row_dot(phi, 5, q, n)
    for row in range(first, last):
        a = jac[row, side]
        out[row] += (
            a[0] * (acc[0] + e0) + a[1] * (acc[1] + e1) + a[2] * (acc[2] + e2)
            + a[3] * acc[3] + a[4] * acc[4] + a[5] * acc[5]
            + a[6] * e3 + a[7] * e4 + a[8] * e5
        )  # fmt: skip


@inlined
def react(bodies, markers, rows, bw, rw):
    """acc -= M^-1 Phi_q^T step, by the eliminated rows: six numbers per body, then back-substitution."""
    where = bodies.where
    ground = where.shape[0] - 1
    fill(bw.elastic, 0.0)
    for b in range(bw.rigid.shape[0]):
        fill(bw.rigid[b], 0.0)
    for k in range(rows.marker.shape[0]):
        for side in range(rows.marker.shape[1]):
            marker = rows.marker[k, side]
            b = markers.body[marker] if marker >= 0 else ground
            if b != ground:
                n, e = where[b, 0], where[b, 3]
                elastic = bw.elastic[e : e + n]
                phi, first, last = shapes(markers, marker, n), rows.start[k], rows.start[k + 1]
                gather(phi, rw.jac, rw.rr, rw.step, first, last, side, n, bw.rigid[b], elastic)
    for b in range(ground):
        n, j, e = where[b, 0], where[b, 2], where[b, 3]
        z = bw.rigid[b]
        rigid_lower(bw.L[b], z, where[b, 7])
        rigid_upper(bw.L[b], z, where[b, 7])
        acc = bw.acc[j : j + 6 + n]
        for c in range(6):
            acc[c] += z[c]
        if n > 0:
            step = bw.elastic[e : e + n]
            back_substitute(bw.Cd[6 * e : 6 * (e + n)], bw.dinv[e : e + n], step, z, n, step)
            for c in range(n):
                acc[6 + c] += step[c]


@kernel
def gather(phi, all_jac, all_rr, step, first, last, side, n, rigid, elastic):
    """Add -Phi_q^T step of some rows' side to the rigid (eliminated) and elastic parts of a body."""
    force, moment = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for row in range(first, last):
        jac, rr, lam = all_jac[row, side], all_rr[row, side], step[row]
        for c in range(6):
            rigid[c] -= rr[c] * lam
        force = (force[0] - jac[0] * lam, force[1] - jac[1] * lam, force[2] - jac[2] * lam)
        moment = (moment[0] - jac[6] * lam, moment[1] - jac[7] * lam, moment[2] - jac[8] * lam)
    if n > 0:
        project(phi, force, moment, elastic, n)


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
def acceleration_target(w, alpha, beta, target):
    """target = gamma - 2 alpha Phi_dot - beta^2 Phi (Baumgarte 1972; alpha = beta = 0: plain index 1)."""
    for row in range(target.size):
        target[row] = w.gamma[row] - 2.0 * alpha * w.nu[row] - beta * beta * w.Phi[row]


@inlined
def move_back(bodies, markers, rows, pattern, bw, rw, vd, x, v):
    """One projection of (x, v) onto the constraints, smallest in the norm of the mass matrix."""
    solve_correction(bodies, markers, rows, pattern, bw, rw, rw.nu)
    to_velocity_rates(bodies.where, bw.A, bw.acc, vd)
    add_scaled(v, v, 1.0, vd)
    solve_correction(bodies, markers, rows, pattern, bw, rw, rw.Phi)
    apply_motion(bodies.where, bw.A, x, bw.acc)
    normalise(bodies, x)


@inlined
def evaluate_on_constraints(m, w, t, x, v, tolerance):
    """`evaluate` at (t, x, v), after bringing them back onto the constraints when they have left by more than `tolerance`
    (in Phi [m, -]; a hundred times that in its rate). tolerance = 0: leave them alone. Returns a status.

    The corrections are smallest in the norm of the mass matrix with the elastic diagonal of the integrator, so they keep
    its order and do not excite stiff modes.
    """
    for attempt in range(5):
        status = evaluate(m, w, t, x, v)
        if status != OK:
            return status
        position, velocity = largest(w.rows.Phi), largest(w.rows.nu)
        if attempt == 0:
            w.drift[0], w.drift[1] = max(w.drift[0], position), max(w.drift[1], velocity)
        allowed = tolerance * (TIGHTER if w.independence[0] < NEAR else 1.0)
        if tolerance == 0.0 or attempt == 4 or (position <= allowed and velocity <= 100.0 * allowed):
            break
        if w.independence[0] < AT:
            break
        w.info[2] += 1
        move_back(m.bodies, m.markers, m.rows, m.pattern, w.bodies, w.rows, w.vd, x, v)
    keep_turns(m.loads, w.loads)
    return OK


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
        for row in range(rows.start[k], rows.start[k + 1]):
            for side in range(1, rows.marker.shape[1], 2):  # a screw has the same markers twice
                if rows.marker[k, side] == marker:
                    jac, lam = rw.jac[row, side], rw.lam[row]
                    force = subtract(force, (jac[0] * lam, jac[1] * lam, jac[2] * lam))
                    moment = subtract(moment, (jac[3] * lam, jac[4] * lam, jac[5] * lam))
        moment = subtract(moment, cross(get(mw.u, marker), force))
        force, moment = to_global(mw.A[marker], force), to_global(mw.A[marker], moment)
        for c in range(3):
            out[k, c] = force[c]
            out[k, 3 + c] = moment[c]
