"""Sums over the elastic coordinates of a body of tables by coordinate: its quadratic terms.

The tables are stored in blocks, as `ffr_dyn.compile.symmetry_blocks` makes them.

Twin: `ffr_dyn.equations.inertia.moments`.
"""

from ffr_dyn.kernels.options import kernel
from ffr_dyn.kernels.simd.lanes import load, plus, store, zeros
from ffr_dyn.kernels.simd.slices import part, peek
from ffr_dyn.kernels.tables import BLOCKS, EARLY, HEAD, HOW, LANES, LATE_RUNS, MIXED, RUNS, STRIPS, SUMS, WHOLE
from ffr_dyn.kernels.vectors import copy, fill


@kernel
def multiply(count, width, table, start, x, first, y, at):
    """y[at + k] = sum over `count` rows i of x[first + i] table[start + i width + k], k < width, in whole rows of lanes."""
    strips = (width + LANES - 1) // LANES
    for four in range(strips // STRIPS):  # each result is stored once
        place = STRIPS * LANES * four
        s0, s1, s2, s3 = zeros(), zeros(), zeros(), zeros()
        for i in range(count):
            number, row = peek(x, first + i), start + i * width + place
            s0, s1 = plus(s0, number, load(table, row)), plus(s1, number, load(table, row + LANES))
            s2, s3 = plus(s2, number, load(table, row + 2 * LANES)), plus(s3, number, load(table, row + 3 * LANES))
        store(y, at + place, s0)
        store(y, at + place + LANES, s1)
        store(y, at + place + 2 * LANES, s2)
        store(y, at + place + 3 * LANES, s3)
    for strip in range(strips - strips % STRIPS, strips):
        place = LANES * strip
        s0 = zeros()
        for i in range(count):
            s0 = plus(s0, peek(x, first + i), load(table, start + i * width + place))
        store(y, at + place, s0)


@kernel
def multiply_both(count, width, table, start, x, xd, first, y, yd, at, late):
    """`multiply` by x into y from `at` on and by xd into yd from `late` on: the table is read once."""
    strips = (width + LANES - 1) // LANES
    for two in range(strips // 2):
        place = 2 * LANES * two
        s0, s1, d0, d1 = zeros(), zeros(), zeros(), zeros()
        for i in range(count):
            number, rate, row = peek(x, first + i), peek(xd, first + i), start + i * width + place
            r0, r1 = load(table, row), load(table, row + LANES)
            s0, s1, d0, d1 = plus(s0, number, r0), plus(s1, number, r1), plus(d0, rate, r0), plus(d1, rate, r1)
        store(y, at + place, s0)
        store(y, at + place + LANES, s1)
        store(yd, late + place, d0)
        store(yd, late + place + LANES, d1)
    if strips % 2 > 0:
        place = LANES * (strips - 1)
        s0, d0 = zeros(), zeros()
        for i in range(count):
            row = load(table, start + i * width + place)
            s0, d0 = plus(s0, peek(x, first + i), row), plus(d0, peek(xd, first + i), row)
        store(y, at + place, s0)
        store(yd, late + place, d0)


@kernel
def multiply_blocks(table, start, plan, at, blocks, x, xd, early, y, yd):
    """Block after block, in the order of their sums: what one writes beyond its own, the next writes again."""
    for block in range(at, at + 4 * blocks, 4):
        first, count, out, width = plan[block], plan[block + 1], plan[block + 2], plan[block + 3]
        stride = (width + LANES - 1) // LANES * LANES
        if out >= early:
            multiply_both(count, stride, table, start, x, xd, first, y, yd, out, out - early)
        else:
            multiply(count, stride, table, start, x, first, y, out)
        start += count * stride


@kernel
def contract(table, start, plan, at, q, qd, width, last, scratch, base, g, l):  # noqa: E741
    """g (width,) = base + sum_i q_i table_i, l (last,) = sum_i q_dot_i (the last of table_i): the only O(n^2) work of a body.

    Block by block, as the plan that begins at `at` says (see `ffr_dyn.compile.symmetry_blocks`); a table that starts below
    zero vanishes. g, l and the scratch are written beyond what is found, by less than a row of lanes.
    """
    if start < 0:
        copy(g, base)
        fill(l, 0.0)
        return
    n, early, sums, how = q.size, plan[at + EARLY], plan[at + SUMS], plan[at + HOW]
    x, xd, y, yd = q, qd, g, l
    runs = at + HEAD + 4 * plan[at + BLOCKS]
    if how != WHOLE:
        y, yd = part(scratch, 0, sums + LANES), part(scratch, sums + LANES, sums - early + LANES)
        store(y, sums, zeros())  # where products vanish
        store(yd, sums - early, zeros())
    if how == MIXED:
        behind = 2 * (sums + LANES) - early
        x, xd = part(scratch, behind, n), part(scratch, behind + n, n)
        for k in range(n):
            x[k], xd[k] = peek(q, peek(plan, runs + k)), peek(qd, peek(plan, runs + k))
    multiply_blocks(table, start, plan, at + HEAD, plan[at + BLOCKS], x, xd, early, y, yd)
    if how == MIXED:
        place = runs + n
        for k in range(width):
            g[k] = base[k] + peek(y, peek(plan, place + k))
        for k in range(last):
            l[k] = peek(yd, peek(plan, place + width - last + k) - early)
        return
    end = runs + 2 * plan[at + RUNS]
    for run in range(runs, end, 2):
        store(g, peek(plan, run + 1), load(y, peek(plan, run)))
    for run in range(end - 2 * plan[at + LATE_RUNS], end, 2):
        store(l, peek(plan, run + 1) - (width - last), load(yd, peek(plan, run) - early))
    for k in range(width):
        g[k] += base[k]
