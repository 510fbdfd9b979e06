"""The loads that stiffen a body, and the sum of its stiffness by load.

Twin: `ffr_dyn.equations.stiffening.stiffening_force`,
`ffr_dyn.equations.stiffening.frame_loads`,
`ffr_dyn.equations.stiffening.wrench_at`.
"""

from ffr_dyn.kernels.options import inlined, kernel
from ffr_dyn.kernels.rows import reaction
from ffr_dyn.kernels.simd.slices import part, peek
from ffr_dyn.kernels.simd.symmetric_products import multiply_blocks, weighted_sum
from ffr_dyn.kernels.tables import IN_STIFFENING, IN_V, K_PLAN, K_SIZE, LANES, QUAD, RATES, N
from ffr_dyn.kernels.vectors import cross, fill, get, subtract, to_body


@kernel
def sum_stiffness(bodies, w, load, b):
    """w.K_sigma of body b, in blocks: the sum of load * K_load."""
    plan, at = bodies.blocks, bodies.where[b, K_PLAN]
    groups, size = plan[at], plan[at + 2]
    number, start, out = at + 3 + 2 * groups + 2 * bodies.where[b, N], bodies.where[b, IN_STIFFENING], 0
    weights = part(w.sorted, 3 * size, load.size)
    for group in range(groups):
        count, entries = plan[at + 3 + 2 * group], plan[at + 4 + 2 * group]
        for k in range(count):
            weights[k] = peek(load, peek(plan, number + k))
        weighted_sum(count, weights, bodies.stiffening, start, entries, w.K_sigma, out)
        start, out, number = start + count * entries, out + entries, number + count
    fill(part(w.K_sigma, out, QUAD * LANES), 0.0)  # what the last rows read beyond their end


@kernel
def multiply_stiffness(bodies, w, b, q, found):
    """found (n,) = K_sigma q, with that of body b in place."""
    plan, at, n = bodies.blocks, bodies.where[b, K_PLAN], bodies.where[b, N]
    groups, parts, size = plan[at], plan[at + 1], plan[at + 2]
    place = at + 3 + 2 * groups
    blocks = place + 2 * n
    for group in range(groups):
        blocks += plan[at + 3 + 2 * group]
    x, y, z = part(w.sorted, 0, size), part(w.sorted, size, size), part(w.sorted, 2 * size, size)
    fill(part(w.sorted, 0, 2 * size), 0.0)
    for k in range(n):
        x[peek(plan, place + k)] = q[k]
    multiply_blocks(parts, plan, blocks, w.K_sigma, x, y, z)
    for k in range(n):
        found[k] = peek(y, peek(plan, place + k)) + peek(z, peek(plan, place + k))


@kernel
def take_diagonal(bodies, w, b, diagonal):
    """That of K_sigma (n,), with that of body b in place."""
    plan, at, n = bodies.blocks, bodies.where[b, K_PLAN], bodies.where[b, N]
    place = at + 3 + 2 * plan[at] + n
    for k in range(n):
        diagonal[k] = peek(w.K_sigma, peek(plan, place + k))


@kernel
def frame_loads(bodies, w, field, b):
    """Acceleration less gravity, angular acceleration: the first six of the loads of body b."""
    j, load = bodies.where[b, IN_V], w.load[b]
    gravity = to_body(w.A[b], field)
    for c in range(3):
        load[c] = w.acc[j + c] - w.shift[j + c] - gravity[c]
        load[3 + c] = w.acc[j + 3 + c] - w.shift[j + 3 + c]


@kernel
def rate_loads(omega, load):
    """Products of the angular velocity: the next six."""
    x, y, z = omega
    load[RATES], load[RATES + 1], load[RATES + 2] = x * x, y * y, z * z
    load[RATES + 3], load[RATES + 4], load[RATES + 5] = x * y, x * z, y * z


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


@inlined
def find_loads(r, w):
    """Loads of all stiffened bodies from what was solved; those by the rates are there."""
    m = r.model
    for b in range(m.bodies.mass.size):
        if m.bodies.where[b, K_SIZE] > 0:
            frame_loads(m.bodies, w, r.work.field, b)
    marker_loads(m.markers, m.rows, r.work.markers, r.work.rows, w.load)
