"""Geometric stiffening: K_sigma(t) q from the current accelerations, rates, applied loads and reactions.

K_sigma is a sum of constant matrices times loads, and the loads contain the accelerations and multipliers that are being
solved for. They enter by fixed-point iteration: each sweep solves the equations with the stiffening of the last one. The
change from sweep to sweep is of the order (elastic deflection / size)^2, so three sweeps reach rounding in practice.
"""

from ffr_dyn.kernels.options import inlined, kernel
from ffr_dyn.kernels.system import solve_motion
from ffr_dyn.kernels.vectors import copy, cross, get, subtract, to_body

SWEEPS = 3
PASSES = 10
INERTIAL = 12


@kernel
def multiply_stiffness(bodies, w, x):
    """w.stiff = K_load q for every load of every stiffened body; w: BodyWork."""
    for b in range(bodies.mass.size):
        n, i, e = bodies.where[b, 0], bodies.where[b, 1], bodies.where[b, 3]
        start, loads = bodies.where[b, 5], bodies.where[b, 6]
        out = first_product(bodies, b)
        for load in range(loads):
            for r in range(n):
                total = 0.0
                row = bodies.stiffening[start + (load * n + r) * n : start + (load * n + r + 1) * n]
                for c in range(n):
                    total += row[c] * x[i + 7 + c]
                w.stiff[out + load * n + r] = total
        for k in range(n):
            w.unstiffened[e + k] = w.f[bodies.where[b, 2] + 6 + k]


@kernel
def first_product(bodies, b):
    """Where the products of body b begin in w.stiff."""
    start = 0
    for k in range(b):
        start += bodies.where[k, 6] * bodies.where[k, 0]
    return start


@kernel
def frame_loads(bodies, w, field, b, known):
    """First twelve entries of w.load: acceleration less gravity, angular acceleration, products of the angular velocity."""
    j = bodies.where[b, 2]
    gravity = to_body(w.A[b], field)
    for c in range(3):
        w.load[c] = (w.acc[j + c] - w.shift[j + c] - gravity[c]) if known else 0.0
        w.load[3 + c] = (w.acc[j + 3 + c] - w.shift[j + 3 + c]) if known else 0.0
    x, y, z = get(w.omega, b)
    w.load[6], w.load[7], w.load[8] = x * x, y * y, z * z
    w.load[9], w.load[10], w.load[11] = x * y, x * z, y * z


@kernel
def marker_loads(markers, rows, mw, rw, b, known, load):
    """Applied loads and, once known, joint reactions at the interfaces of body b."""
    for k in range(markers.body.size):
        slot = markers.load[k]
        if markers.body[k] == b and slot >= 0:
            for c in range(6):
                load[slot + c] = mw.load[k, c]
    if not known:
        return
    for block in range(rows.marker.shape[0]):
        for side in range(rows.marker.shape[1]):
            k = rows.marker[block, side]
            if k >= 0 and markers.body[k] == b and markers.load[k] >= 0:
                add_reaction(rw, rows.start[block], rows.start[block + 1], side, get(mw.u, k), load, markers.load[k])


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
    start = first_product(bodies, b)
    f = w.f[j + 6 : j + 6 + n]
    copy(f, w.unstiffened[e : e + n])
    for load in range(loads):
        product = w.stiff[start + load * n : start + (load + 1) * n]
        for k in range(n):
            f[k] -= w.load[load] * product[k]


@inlined
def solve_stiffened(m, w, x, target):
    """`solve_motion` with the geometric stiffening of the bodies that have it."""
    stiffened = m.bodies.stiffening.size > 0
    passes = PASSES if m.relaxation > 0.0 else 1
    if stiffened:
        multiply_stiffness(m.bodies, w.bodies, x)
    for sweep in range(SWEEPS if stiffened else 1):
        if stiffened:
            for b in range(m.bodies.mass.size):
                if m.bodies.where[b, 6] > 0:
                    frame_loads(m.bodies, w.bodies, w.field, b, sweep > 0)
                    marker_loads(m.markers, m.rows, w.markers, w.rows, b, sweep > 0, w.bodies.load)
                    stiffen(m.bodies, w.bodies, b)
        solve_motion(m.bodies, m.markers, m.rows, m.pattern, w.bodies, w.rows, target, passes)
