"""Accelerations and multipliers from what an evaluation left: reduced forces, the multiplier system, the way back.

M acc + Phi_q^T lam = f,  Phi_q acc = target, by elimination of the elastic coordinates of every body, then of its rigid ones.

Twin: `ffr_dyn.equations.motion.solve`.
"""

from ffr_dyn.kernels.bodies import accelerate
from ffr_dyn.kernels.markers import project, shapes
from ffr_dyn.kernels.multiplier_solver import SIDE, solve_blocks
from ffr_dyn.kernels.options import inlined, kernel
from ffr_dyn.kernels.planar import plane_rows
from ffr_dyn.kernels.simd.lanes import load, plus, store, times, total
from ffr_dyn.kernels.simd.slices import part, six_parts
from ffr_dyn.kernels.tables import IN_SHARED, IN_V, LANES, NORMAL, N
from ffr_dyn.kernels.vectors import add, fill, in_plane, six_rows


@inlined
def reduce_miss(rows, bw, step, value):
    """Reduced forces and `step` of a motion that only the rows ask for: Phi_q acc = -value."""
    fill(bw.acc, 0.0)
    fill(part(bw.rigid, 0, bw.rigid.size), 0.0)
    for k in range(rows.start.size - 1):
        for row in range(rows.start[k], rows.start[k + 1]):
            step[LANES * k + row - rows.start[k]] = value[row]


@inlined
def solve_back(bodies, markers, rows, pattern, bw, phi, rw):
    """step and acc from what the rows miss (step) and the reduced forces."""
    solve_blocks(rows.start, pattern, rw.S, rw.pivots, rw.step)
    react(bodies, markers, rows, bw, phi, rw)


@kernel
def gather_rows(starts, lanes, out):
    """out (C,) = the rows of all joints from their lanes."""
    for k in range(starts.size - 1):
        for row in range(starts[k], starts[k + 1]):
            out[row] = lanes[LANES * k + row - starts[k]]


@inlined
def reduced_rates(bodies, markers, rows, bw, phi, rw, target):
    """step = Phi_q M^-1 f - target, from the reduced forces of the bodies and the eliminated rows."""
    where, ground, sides = bodies.where, bodies.mass.size, rows.marker.shape[1]
    for k in range(rows.marker.shape[0]):
        for row in range(rows.start[k], rows.start[k + 1]):
            rw.step[LANES * k + row - rows.start[k]] = -target[row]
        for side in range(sides):
            marker = rows.marker[k, side]
            b = markers.body[marker] if marker >= 0 else ground
            if b != ground:
                n, normal, at = where[b, N], where[b, NORMAL], (k * sides + side) * SIDE
                z, moved, elastic = bw.rigid[b], rw.wrench, part(bw.acc, where[b, IN_V] + 6, n)
                if normal >= 0:
                    c0, c1, c2 = in_plane(normal)
                    moved[0], moved[1], moved[2] = z[c0], z[c1], z[c2]
                    add_rows(rw.step, LANES * k, moved, rw.X, at, 3)
                    if n > 0:
                        moved[0], moved[1], moved[2] = plane_rows(shapes(markers, phi, marker, n), normal, elastic, n)
                        add_rows(rw.step, LANES * k, moved, rw.X, at + 3 * LANES, 3)
                    continue
                add_rows(rw.step, LANES * k, z, rw.X, at, 6)
                if n > 0:
                    own = shapes(markers, phi, marker, n)
                    moved[0], moved[1], moved[2], moved[3], moved[4], moved[5] = six_rows(own, elastic, n)
                    add_rows(rw.step, LANES * k, moved, rw.X, at + 6 * LANES, 6)


@kernel
def add_rows(target, own, numbers, X, at, count):
    """The row of lanes at `own` grows by sum_k numbers[k] times row k of X, over `count` rows from `at` on."""
    row = load(target, own)
    for k in range(count):
        row = plus(row, numbers[k], load(X, at + LANES * k))
    store(target, own, row)


@kernel
def dot_rows(X, at, step, own):
    """The product of a row of lanes of X with the one of `step`."""
    return total(times(load(X, at), load(step, own)))


@inlined
def constraint_rates(where, markers, rows, jac, phi, acc, out):
    """out = Phi_q acc, by the coefficients and shapes of one moment."""
    fill(out, 0.0)
    ground, sides = where.shape[0] - 1, rows.marker.shape[1]
    for k in range(rows.marker.shape[0]):
        for side in range(sides):
            marker = rows.marker[k, side]
            b = markers.body[marker] if marker >= 0 else ground
            if b != ground:
                n, j, own = where[b, N], where[b, IN_V], jac[k * sides + side]
                shape = shapes(markers, phi, marker, n)
                first, last, moved = rows.start[k], rows.start[k + 1], part(acc, j, 6 + n)
                if where[b, NORMAL] >= 0:
                    add_side_rates_in_plane(shape, own, moved, first, last, n, where[b, NORMAL], out)
                else:
                    add_side_rates(shape, own, moved, first, last, n, out)


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
def add_reactions(where, markers, rows, jac, phi, lam, out):
    """out (V,) += Phi_q^T lam in body axes, by the coefficients and shapes of one moment."""
    ground, sides = where.shape[0] - 1, rows.marker.shape[1]
    for k in range(rows.marker.shape[0]):
        for side in range(sides):
            marker = rows.marker[k, side]
            b = markers.body[marker] if marker >= 0 else ground
            if b != ground:
                n, j, own = where[b, N], where[b, IN_V], jac[k * sides + side]
                shape = shapes(markers, phi, marker, n)
                add_side_reactions(shape, own, lam, rows.start[k], rows.start[k + 1], n, part(out, j, 6 + n))


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
def react(bodies, markers, rows, bw, phi, rw):
    """acc from the reduced forces, less Phi_q^T step by the eliminated rows."""
    where, ground, sides = bodies.where, bodies.mass.size, rows.marker.shape[1]
    for k in range(rows.marker.shape[0]):
        for side in range(sides):
            marker = rows.marker[k, side]
            b = markers.body[marker] if marker >= 0 else ground
            if b != ground:
                n, at, z = where[b, N], (k * sides + side) * SIDE, bw.rigid[b]
                normal, wrench = where[b, NORMAL], rw.wrench
                react_rigid(rw.X, at, rw.step, LANES * k, normal, z)
                if n > 0:
                    shape, elastic = shapes(markers, phi, marker, n), part(bw.acc, where[b, IN_V] + 6, n)
                    dinv = part(bw.dinv, where[b, IN_SHARED], n)
                    if normal >= 0:
                        for c in range(3):
                            wrench[c] = dot_rows(rw.X, at + LANES * (3 + c), rw.step, LANES * k)
                        release_in_plane(shape, normal, dinv, wrench, n, elastic)
                    else:
                        for c in range(6):
                            wrench[c] = dot_rows(rw.X, at + LANES * (6 + c), rw.step, LANES * k)
                        release(shape, dinv, wrench, n, elastic)
    for b in range(ground):
        accelerate(bodies, bw, b)


@kernel
def react_rigid(X, at, step, own, normal, z):
    """Reduced forces z (6,) of a body less those of a side's reactions."""
    if normal >= 0:
        i, j, k = in_plane(normal)
        z[i] -= dot_rows(X, at, step, own)
        z[j] -= dot_rows(X, at + LANES, step, own)
        z[k] -= dot_rows(X, at + 2 * LANES, step, own)
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
