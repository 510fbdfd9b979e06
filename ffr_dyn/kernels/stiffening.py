"""Geometric stiffening: K_sigma(t) q from the current accelerations, rates, applied loads and reactions.

K_sigma is a sum of constant matrices times loads, and the loads contain the accelerations and multipliers that are being
solved for. They enter by fixed-point iteration: each sweep solves the equations with the stiffening of the last one. The
change from sweep to sweep is of the order (elastic deflection / size)^2, so three sweeps reach rounding in practice, and
two from the loads of the stage before.
"""

from ffr_dyn.kernels.options import inlined, kernel
from ffr_dyn.kernels.packing import call_unit
from ffr_dyn.kernels.products import contract
from ffr_dyn.kernels.rows import reaction
from ffr_dyn.kernels.solution import solve_loads
from ffr_dyn.kernels.tables import MOTION, SIX
from ffr_dyn.kernels.vectors import copy, cross, fill, get, subtract, to_body
from ffr_dyn.kernels.views import part, peek, six_parts

SWEEPS = 3


@kernel
def multiply_stiffness(bodies, w, x):
    """w.stiff = K_load q for every load of every stiffened body, and the loads by its rates; w: BodyWork."""
    for b in range(bodies.mass.size):
        n, i, e, loads = bodies.where[b, 0], bodies.where[b, 1], bodies.where[b, 3], bodies.where[b, 6]
        if loads > 0:
            width, start, out = loads * n, bodies.where[b, 5], bodies.where[b, 9]
            table, q, stiff = part(bodies.stiffening, start, n * width), part(x, i + 7, n), part(w.stiff, out, width)
            fill(stiff, 0.0)
            contract(table, bodies.blocks, bodies.where[b, 12], q, q, n, width, 0, w.sorted, stiff, part(stiff, 0, 0))
            copy(part(w.unstiffened, e, n), part(w.f, bodies.where[b, 2] + 6, n))
            rate_loads(get(w.omega, b), w.load[b])


@kernel
def frame_loads(bodies, w, field, b, known, load):
    """Acceleration less gravity, angular acceleration: the first six of the loads of body b."""
    j = bodies.where[b, 2]
    gravity = to_body(w.A[b], field)
    for c in range(3):
        load[c] = (w.acc[j + c] - w.shift[j + c] - gravity[c]) if known else 0.0
        load[3 + c] = (w.acc[j + 3 + c] - w.shift[j + 3 + c]) if known else 0.0


@kernel
def rate_loads(omega, load):
    """Products of the angular velocity: the next six."""
    x, y, z = omega
    load[6], load[7], load[8] = x * x, y * y, z * z
    load[9], load[10], load[11] = x * y, x * z, y * z


@inlined
def marker_loads(markers, rows, mw, rw, known, load):
    """Applied loads and, once known, joint reactions at the interfaces of all bodies."""
    for k in range(markers.body.size):
        slot = markers.load[k]
        if slot >= 0:
            for c in range(6):
                load[markers.body[k], slot + c] = mw.load[k, c]
    if not known:
        return
    for block in range(rows.marker.shape[0]):
        for side in range(rows.marker.shape[1]):
            k = rows.marker[block, side]
            if k >= 0 and markers.load[k] >= 0:
                add_reaction(rw, rows, block, side, get(mw.u, k), load[markers.body[k]], markers.load[k])


@kernel
def add_reaction(rw, rows, block, side, u, load, slot):
    force, moment = reaction(rw, rows, block, side)
    moment = subtract(moment, cross(u, force))
    for c in range(3):
        load[slot + c] -= force[c]
        load[slot + 3 + c] -= moment[c]


@kernel
def stiffen(bodies, w, b):
    """f = unstiffened - sum over the loads of load * K_load q, elastic rows of body b. Six loads at a time."""
    n, j, e, loads = bodies.where[b, 0], bodies.where[b, 2], bodies.where[b, 3], bodies.where[b, 6]
    first, start, load = bodies.where[b, 8], bodies.where[b, 9], w.load[b]
    f = part(w.f, j + 6, n)
    copy(f, part(w.unstiffened, e, n))
    for number in range(0, loads, SIX):
        at, left = first + number, loads - number
        s0, s1, s2 = (
            acting(bodies, load, at, left, 0),
            acting(bodies, load, at, left, 1),
            acting(bodies, load, at, left, 2),
        )
        s3, s4, s5 = (
            acting(bodies, load, at, left, 3),
            acting(bodies, load, at, left, 4),
            acting(bodies, load, at, left, 5),
        )
        p0, p1, p2, p3, p4, p5 = six_parts(part(w.stiff, start + number * n, SIX * n), n)
        for k in range(n):
            f[k] -= s0 * p0[k] + s1 * p1[k] + s2 * p2[k] + s3 * p3[k] + s4 * p4[k] + s5 * p5[k]


@kernel
def acting(bodies, load, at, left, number):
    """One of the next loads, zero beyond the last."""
    return peek(load, peek(bodies.loads, at + number)) if number < left else 0.0


@inlined
def solve_stiffened(r, x, target, near):
    """`solve_motion` with the geometric stiffening of the bodies that have it.

    near : the loads of the last solution are those of a state nearby, which saves a sweep
    """
    m, w = r.model, r.work
    multiply_stiffness(m.bodies, w.bodies, x)
    for sweep in range(1 if near else 0, SWEEPS):
        if not near or sweep > 1:
            for b in range(m.bodies.mass.size):
                if m.bodies.where[b, 6] > 0:
                    frame_loads(m.bodies, w.bodies, w.field, b, sweep > 0, w.bodies.load[b])
            marker_loads(m.markers, m.rows, w.markers, w.rows, sweep > 0, w.bodies.load)
        for b in range(m.bodies.mass.size):
            if m.bodies.where[b, 6] > 0:
                stiffen(m.bodies, w.bodies, b)
        if sweep < SWEEPS - 1 and m.relaxation == 0.0:
            solve_loads(r, target)
        else:
            call_unit(r.units[MOTION], r.address, 0.0, x.ctypes.data, target.ctypes.data)
