"""Geometric stiffening: K_sigma(t) q from the current accelerations, rates, applied loads and reactions.

K_sigma is a sum of constant matrices times loads, and the loads contain the accelerations and multipliers that are being
solved for. They enter by fixed-point iteration: each sweep solves the equations with the stiffening of the last one. The
change from sweep to sweep is of the order (elastic deflection / size)^2.

Within a step the first guess is extrapolated from the same stages of the steps before, right to third order in the step. One
sweep that begins with it is right to that order, times the small factor above: none of the methods loses its order. More
follow where the guess turns out poor, as after an impact.
"""

from ffr_dyn.kernels.options import inlined, kernel
from ffr_dyn.kernels.packing import call_unit
from ffr_dyn.kernels.rows import reaction
from ffr_dyn.kernels.symmetric import multiply_blocks, weighted_sum
from ffr_dyn.kernels.tables import ASIDE, LANES, MOTION, QUAD, RELATIVE, STAGES
from ffr_dyn.kernels.vectors import add_scaled, copy, cross, fill, get, subtract, to_body
from ffr_dyn.kernels.views import part, peek

SWEEPS = 4  # at most
# By what the forces may change in a sweep, relative to those of the body with most, for it to be the last: one that begins
# with a guess after steps of equal length, and any other.
ENOUGH, STRICT = 3e-2, 1e-8
SETTLED = 4  # steps of equal length before a guess is one of third order


@kernel
def keep_unstiffened(bodies, w):
    """Elastic right-hand sides without stiffening, and the loads by the rates of all stiffened bodies; w: BodyWork."""
    for b in range(bodies.mass.size):
        n, e = bodies.where[b, 0], bodies.where[b, 3]
        if bodies.where[b, 6] > 0:
            copy(part(w.unstiffened, e, n), part(w.f, bodies.where[b, 2] + 6, n))
            rate_loads(get(w.omega, b), w.load[b])


@kernel
def multiply_stiffness(bodies, w, x, b):
    """w.stiff of body b: the sum of load * K_load over its loads, times q. Returns the squares of its length and of its
    change."""
    plan, at, n = bodies.blocks, bodies.where[b, 10], bodies.where[b, 0]
    groups, parts, size = plan[at], plan[at + 1], plan[at + 2]
    place, load, own = at + 3 + 2 * groups, w.load[b], part(x, bodies.where[b, 1] + 7, n)
    q, y, z = part(w.sorted, 0, size), part(w.sorted, size, size), part(w.sorted, 2 * size, size)
    weights = part(w.sorted, 3 * size, load.size)
    fill(part(w.sorted, 0, 2 * size), 0.0)
    for k in range(n):
        q[peek(plan, place + k)] = own[k]
    number, start, out = place + n, bodies.where[b, 5], 0
    for group in range(groups):
        count, entries = plan[at + 3 + 2 * group], plan[at + 4 + 2 * group]
        for k in range(count):
            weights[k] = peek(load, peek(plan, number + k))
        weighted_sum(count, weights, bodies.stiffening, start, entries, w.K_sigma, out)
        start, out, number = start + count * entries, out + entries, number + count
    fill(part(w.K_sigma, out, QUAD * LANES), 0.0)  # what the last rows read beyond their end
    multiply_blocks(parts, plan, number, w.K_sigma, q, y, z)
    stiff, force, change = part(w.stiff, bodies.where[b, 3], n), 0.0, 0.0
    found = part(w.sorted, 0, n)
    for k in range(n):
        found[k] = peek(y, peek(plan, place + k)) + peek(z, peek(plan, place + k))
    for k in range(n):
        force += found[k] * found[k]
        change += (found[k] - stiff[k]) * (found[k] - stiff[k])
        stiff[k] = found[k]
    return force, change


@kernel
def frame_loads(bodies, w, field, b):
    """Acceleration less gravity, angular acceleration: the first six of the loads of body b."""
    j, load = bodies.where[b, 2], w.load[b]
    gravity = to_body(w.A[b], field)
    for c in range(3):
        load[c] = w.acc[j + c] - w.shift[j + c] - gravity[c]
        load[3 + c] = w.acc[j + 3 + c] - w.shift[j + 3 + c]


@kernel
def rate_loads(omega, load):
    """Products of the angular velocity: the next six."""
    x, y, z = omega
    load[6], load[7], load[8] = x * x, y * y, z * z
    load[9], load[10], load[11] = x * y, x * z, y * z


@inlined
def marker_loads(markers, rows, mw, rw, load):
    """Applied loads and joint reactions at the interfaces of all bodies."""
    for k in range(markers.body.size):
        slot = markers.load[k]
        if slot >= 0:
            for c in range(6):
                load[markers.body[k], slot + c] = mw.load[k, c]
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
def stiffen(bodies, w):
    """f = unstiffened - K_sigma q, elastic rows of all stiffened bodies."""
    for b in range(bodies.mass.size):
        n, e = bodies.where[b, 0], bodies.where[b, 3]
        if bodies.where[b, 6] > 0:
            add_scaled(part(w.f, bodies.where[b, 2] + 6, n), part(w.unstiffened, e, n), -1.0, part(w.stiff, e, n))


@inlined
def guess_stiffening(w, stage):
    """w.stiff from the last solution and what stage number `stage` added to the one before in three steps."""
    stiff, last = w.stiff, w.last
    one, two, three = w.change[stage], w.change[STAGES + stage], w.change[2 * STAGES + stage]
    for k in range(stiff.size):
        stiff[k] = last[k] + 3.0 * (one[k] - two[k]) + three[k]


@inlined
def keep_change(w, stage):
    """What the solution at stage number `stage` added to the one before."""
    one, two, three = w.change[stage], w.change[STAGES + stage], w.change[2 * STAGES + stage]
    for k in range(w.stiff.size):
        three[k], two[k], one[k] = two[k], one[k], w.stiff[k] - w.last[k]


@inlined
def is_settled(r, w, stage):
    """Whether the last steps were of the length of this one."""
    h, steady = r.clock.time[0], w.steady
    if steady[0] != h:
        steady[0], steady[1] = h, -1.0
    if steady[1] < 0.0 or stage <= steady[2]:
        steady[1] += 1.0
    steady[2] = stage
    return steady[1] >= SETTLED


@inlined
def solve_stiffened(r, x, target, stage):
    """`solve_motion` with the geometric stiffening of the bodies that have it.

    stage : number of a step's stage, from 0; AGAIN: near the last solution; ASIDE: so, and nothing is kept of it
    """
    m, w = r.model, r.work.bodies
    keep_unstiffened(m.bodies, w)
    enough = STRICT
    if stage < 0:
        copy(w.stiff, w.last)
    else:
        guess_stiffening(w, stage)
        if is_settled(r, w, stage):
            enough = ENOUGH
        elif r.control.numbers.size > 0:
            enough = r.control.numbers[RELATIVE]
    for _ in range(SWEEPS):
        stiffen(m.bodies, w)
        call_unit(r.units[MOTION], r.address, 0.0, x.ctypes.data, target.ctypes.data)
        for b in range(m.bodies.mass.size):
            if m.bodies.where[b, 6] > 0:
                frame_loads(m.bodies, w, r.work.field, b)
        marker_loads(m.markers, m.rows, r.work.markers, r.work.rows, w.load)
        greatest, change = 0.0, 0.0
        for b in range(m.bodies.mass.size):
            if m.bodies.where[b, 6] > 0:
                force, moved = multiply_stiffness(m.bodies, w, x, b)
                greatest, change = max(greatest, force), max(change, moved)
        if change <= enough * enough * greatest:
            break
    if stage >= 0:
        keep_change(w, stage)
    if stage != ASIDE:
        copy(w.last, w.stiff)
