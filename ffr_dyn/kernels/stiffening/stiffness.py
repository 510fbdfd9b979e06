"""The loads that stiffen a body, and the sum of its stiffness by load.

Twin: `ffr_dyn.equations.stiffening.stiffening_force`,
`ffr_dyn.equations.stiffening.frame_loads`,
`ffr_dyn.equations.stiffening.wrench_at`.
"""

from ffr_dyn.kernels.options import inlined, kernel
from ffr_dyn.kernels.products import multiply
from ffr_dyn.kernels.rows import reaction
from ffr_dyn.kernels.simd.lanes import load, plus, scaled, store, times, total, zeros
from ffr_dyn.kernels.simd.slices import part
from ffr_dyn.kernels.tables import IN_STIFFENING, IN_V, K_PLAN, K_SIZE, LANES, QUAD, RATES, STRIPS, N
from ffr_dyn.kernels.vectors import cross, fill, get, subtract, to_body


@kernel
def sum_stiffness(bodies, w, load, b):
    """w.K_sigma of body b, in blocks: the sum of load * K_load."""
    plan, at = bodies.blocks, bodies.where[b, K_PLAN]
    groups, size = plan[at], plan[at + 2]
    number, start, out = at + 3 + 2 * groups + 2 * bodies.where[b, N], bodies.where[b, IN_STIFFENING], 0
    nothing, weights = part(w.sorted, 0, LANES * STRIPS), part(w.sorted, 3 * size + LANES * STRIPS, load.size)
    fill(nothing, 0.0)
    for group in range(groups):
        count, entries = plan[at + 3 + 2 * group], plan[at + 4 + 2 * group]
        for k in range(count):
            weights[k] = load[plan[number + k]]
        multiply(count, entries, entries, bodies.stiffening, start, weights, 0, nothing, 0, w.K_sigma, out)
        start, out, number = start + count * entries, out + entries, number + count
    fill(part(w.K_sigma, out, QUAD * LANES), 0.0)  # what the last rows read beyond their end


@kernel
def multiply_blocks(parts, plan, at, K, x, y, z):
    """y + z = K x, for blocks of K and the plan of `ffr_dyn.compile.symmetry_blocks.symmetric_blocks`, whose parts begin at
    `at`.

    Four rows at a time meet all blocks that they have, at most eight columns wide: some serve them alone, the others what
    lies across the diagonal, too.

    z : set;  y : was zero;  x : zero between a part and the next row of lanes. What y and z have there is not used.
    """
    blocks = at + 4 * parts
    for header in range(at, at + 4 * parts, 4):
        row, quads, alone, across = plan[header], plan[header + 1], plan[header + 2], plan[header + 3]
        for r in range(0, QUAD * quads, QUAD):
            s0, s1, s2, s3 = zeros(), zeros(), zeros(), zeros()
            for k in range(alone + across):
                first, stride, column = plan[blocks + 3 * k], plan[blocks + 3 * k + 1], plan[blocks + 3 * k + 2]
                place, other = first + r * stride, load(x, column)
                k0, k1, k2, k3 = load_lines(K, place, stride)
                s0, s1 = plus(s0, 1.0, times(k0, other)), plus(s1, 1.0, times(k1, other))
                s2, s3 = plus(s2, 1.0, times(k2, other)), plus(s3, 1.0, times(k3, other))
                if k >= alone:
                    both = plus(scaled(x[row + r], k0), x[row + r + 1], k1)
                    both = plus(plus(both, x[row + r + 2], k2), x[row + r + 3], k3)
                    store(y, column, plus(load(y, column), 1.0, both))
            z[row + r], z[row + r + 1], z[row + r + 2], z[row + r + 3] = total(s0), total(s1), total(s2), total(s3)
        blocks += 3 * (alone + across)


@kernel
def load_lines(K, at, stride):
    return load(K, at), load(K, at + stride), load(K, at + 2 * stride), load(K, at + 3 * stride)


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
        x[plan[place + k]] = q[k]
    multiply_blocks(parts, plan, blocks, w.K_sigma, x, y, z)
    for k in range(n):
        found[k] = y[plan[place + k]] + z[plan[place + k]]


@kernel
def take_diagonal(bodies, w, b, diagonal):
    """That of K_sigma (n,), with that of body b in place."""
    plan, at, n = bodies.blocks, bodies.where[b, K_PLAN], bodies.where[b, N]
    place = at + 3 + 2 * plan[at] + n
    for k in range(n):
        diagonal[k] = w.K_sigma[plan[place + k]]


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
