"""Geometric stiffening: K_sigma(t) q from the current accelerations, rates, applied loads and reactions.

K_sigma is a sum of constant matrices times loads, and the loads contain the accelerations and multipliers that are being
solved for. They enter by fixed-point iteration: each sweep solves the equations with the stiffening of the last one. The
change from sweep to sweep is of the order (elastic deflection / size)^2, so three sweeps reach rounding in practice, and
two from the loads of the stage before.
"""

from ffr_dyn.kernels.options import inlined, kernel
from ffr_dyn.kernels.packing import call_unit
from ffr_dyn.kernels.tables import MOTION
from ffr_dyn.kernels.vectors import add_scaled, copy, cross, fill, get, subtract, to_body
from ffr_dyn.kernels.views import part

SWEEPS = 3


@kernel
def multiply_stiffness(bodies, w, x):
    """w.stiff = K_load q for every load of every stiffened body; w: BodyWork."""
    for b in range(bodies.mass.size):
        n, i, e, loads = bodies.where[b, 0], bodies.where[b, 1], bodies.where[b, 3], bodies.where[b, 6]
        if loads > 0:
            width, start, out = loads * n, bodies.where[b, 5], bodies.where[b, 9]
            multiply(part(bodies.stiffening, start, n * width), part(x, i + 7, n), n, part(w.stiff, out, width))
            copy(part(w.unstiffened, e, n), part(w.f, bodies.where[b, 2] + 6, n))


@kernel
def multiply(K, q, n, out):
    """out = sum_c q_c K[c], four rows at a time, so that each result is loaded and stored a quarter as often."""
    width = out.size
    fill(out, 0.0)
    for c in range(0, n - 3, 4):
        q0, q1, q2, q3 = q[c], q[c + 1], q[c + 2], q[c + 3]
        first, second = part(K, c * width, width), part(K, (c + 1) * width, width)
        third, fourth = part(K, (c + 2) * width, width), part(K, (c + 3) * width, width)
        for k in range(width):
            out[k] += q0 * first[k] + q1 * second[k] + q2 * third[k] + q3 * fourth[k]
    for c in range(n - n % 4, n):
        add_scaled(out, out, q[c], part(K, c * width, width))


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
                first, last, own = rows.start[block], rows.start[block + 1], load[markers.body[k]]
                add_reaction(rw, first, last, side, get(mw.u, k), own, markers.load[k])


@kernel
def add_reaction(rw, first, last, side, u, load, slot):
    force, moment = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for row in range(first, last):
        jac, lam = rw.jac[row, side], rw.lam[row]
        force = subtract(force, (jac[0] * lam, jac[1] * lam, jac[2] * lam))
        moment = subtract(moment, (jac[3] * lam, jac[4] * lam, jac[5] * lam))
    moment = subtract(moment, cross(u, force))
    for c in range(3):
        load[slot + c] += force[c]
        load[slot + 3 + c] += moment[c]


@kernel
def stiffen(bodies, w, b):
    """f = unstiffened - sum over the loads of load * K_load q, elastic rows of body b."""
    n, j, e, loads = bodies.where[b, 0], bodies.where[b, 2], bodies.where[b, 3], bodies.where[b, 6]
    first, start, load = bodies.where[b, 8], bodies.where[b, 9], w.load[b]
    f, stiff = part(w.f, j + 6, n), part(w.stiff, start, loads * n)
    copy(f, part(w.unstiffened, e, n))
    for number in range(0, loads - 3, 4):
        s0, s1 = load[bodies.loads[first + number]], load[bodies.loads[first + number + 1]]
        s2, s3 = load[bodies.loads[first + number + 2]], load[bodies.loads[first + number + 3]]
        p0, p1 = part(stiff, number * n, n), part(stiff, (number + 1) * n, n)
        p2, p3 = part(stiff, (number + 2) * n, n), part(stiff, (number + 3) * n, n)
        for k in range(n):
            f[k] -= s0 * p0[k] + s1 * p1[k] + s2 * p2[k] + s3 * p3[k]
    for number in range(loads - loads % 4, loads):
        add_scaled(f, f, -load[bodies.loads[first + number]], part(stiff, number * n, n))


@inlined
def solve_stiffened(r, x, target, near):
    """`solve_motion` with the geometric stiffening of the bodies that have it.

    near : the loads of the last solution are those of a state nearby, which saves a sweep
    """
    m, w = r.model, r.work
    multiply_stiffness(m.bodies, w.bodies, x)
    for sweep in range(1 if near else 0, SWEEPS):
        renewed = not near or sweep > 1
        for b in range(m.bodies.mass.size):
            if m.bodies.where[b, 6] > 0:
                rate_loads(get(w.bodies.omega, b), w.bodies.load[b])
                if renewed:
                    frame_loads(m.bodies, w.bodies, w.field, b, sweep > 0, w.bodies.load[b])
        if renewed:
            marker_loads(m.markers, m.rows, w.markers, w.rows, sweep > 0, w.bodies.load)
        for b in range(m.bodies.mass.size):
            if m.bodies.where[b, 6] > 0:
                stiffen(m.bodies, w.bodies, b)
        call_unit(r.units[MOTION], r.address, 0.0, x.ctypes.data, target.ctypes.data)
