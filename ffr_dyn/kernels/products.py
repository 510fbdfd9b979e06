"""Sums over the elastic coordinates of a body of tables by coordinate: its quadratic terms.

The tables are stored in blocks, as `ffr_dyn.compile.symmetry_blocks` makes them.

Twin: `ffr_dyn.equations.inertia.moments`.
"""

from ffr_dyn.kernels.options import kernel
from ffr_dyn.kernels.simd.lanes import load, plus, store, zeros
from ffr_dyn.kernels.simd.slices import part, peek
from ffr_dyn.kernels.tables import AT_ONCE, BLOCK_SIZE, BLOCKS, EARLY, HEAD, LANES, LATE, LOOSE, SORTED, SPACE, STRIPS
from ffr_dyn.kernels.vectors import copy, fill


@kernel
def multiply(count, strips, width, table, start, x, first, y, plan, at):
    """The strips of y at plan[at], plan[at + 1] ... = sum over `count` rows i of x[first + i] times row i of the table.

    Rows begin at `start` and are `width` apart.
    """
    for four in range(strips // STRIPS):  # each result is stored once
        place, to = start + STRIPS * LANES * four, at + STRIPS * four
        s0, s1, s2, s3 = zeros(), zeros(), zeros(), zeros()
        for i in range(count):
            number, row = peek(x, first + i), place + i * width
            s0, s1 = plus(s0, number, load(table, row)), plus(s1, number, load(table, row + LANES))
            s2, s3 = plus(s2, number, load(table, row + 2 * LANES)), plus(s3, number, load(table, row + 3 * LANES))
        store(y, peek(plan, to), s0)
        store(y, peek(plan, to + 1), s1)
        store(y, peek(plan, to + 2), s2)
        store(y, peek(plan, to + 3), s3)
    for strip in range(strips - strips % STRIPS, strips):
        s0 = zeros()
        for i in range(count):
            s0 = plus(s0, peek(x, first + i), load(table, start + LANES * strip + i * width))
        store(y, peek(plan, at + strip), s0)


@kernel
def multiply_both(count, strips, width, table, start, x, xd, first, y, yd, early, plan, at):
    """`multiply` by x, and by xd into yd, `early` before the places in y: the table is read once."""
    for two in range(strips // 2):
        place, to = start + 2 * LANES * two, at + 2 * two
        s0, s1, d0, d1 = zeros(), zeros(), zeros(), zeros()
        for i in range(count):
            number, rate, row = peek(x, first + i), peek(xd, first + i), place + i * width
            r0, r1 = load(table, row), load(table, row + LANES)
            s0, s1, d0, d1 = plus(s0, number, r0), plus(s1, number, r1), plus(d0, rate, r0), plus(d1, rate, r1)
        store(y, peek(plan, to), s0)
        store(y, peek(plan, to + 1), s1)
        store(yd, peek(plan, to) - early, d0)
        store(yd, peek(plan, to + 1) - early, d1)
    if strips % 2 > 0:
        place, to = start + LANES * (strips - 1), at + strips - 1
        s0, d0 = zeros(), zeros()
        for i in range(count):
            row = load(table, place + i * width)
            s0, d0 = plus(s0, peek(x, first + i), row), plus(d0, peek(xd, first + i), row)
        store(y, peek(plan, to), s0)
        store(yd, peek(plan, to) - early, d0)


@kernel
def multiply_blocks(table, start, plan, at, places, x, xd, y, yd):
    """Block after block into the strips whose places in y begin at `places` in the plan. Returns the end of the places."""
    early = plan[at + EARLY]
    for block in range(at + HEAD, at + HEAD + BLOCK_SIZE * plan[at + BLOCKS], BLOCK_SIZE):
        first, count, once, both = plan[block], plan[block + 1], plan[block + 2], plan[block + 3]
        width = LANES * (once + both)
        multiply(count, once, width, table, start, x, first, y, plan, places)
        places += once
        multiply_both(count, both, width, table, start + LANES * once, x, xd, first, y, yd, early, plan, places)
        places += both
        start += count * width
    return places


@kernel
def bring(y, early, plan, pairs, end):
    """Loose products to where they belong, `early` before the places in the plan, from pairs of both."""
    for k in range(pairs, end, 2 * AT_ONCE):
        for c in range(k, k + 2 * AT_ONCE, 2):
            y[peek(plan, c) - early] = peek(y, peek(plan, c + 1) - early)


@kernel
def products(table, start, plan, at, q, qd, scratch):
    """sum_i q_i table_i and, from plan[at + SPACE] on, sum_i q_dot_i (the last of table_i) at the start of the scratch: the
    only O(n^2) work of a body.

    Block by block, as the plan that begins at `at` says (see `ffr_dyn.compile.symmetry_blocks`).
    """
    n, early, space = q.size, plan[at + EARLY], plan[at + SPACE]
    y, yd = part(scratch, 0, space), part(scratch, space, space - early)
    y[space - LANES], yd[space - LANES - early] = 0.0, 0.0  # where products vanish
    order = at + HEAD + BLOCK_SIZE * plan[at + BLOCKS]
    if plan[at + SORTED] > 0:
        x, xd = part(scratch, 2 * space, n), part(scratch, 2 * space + n, n)
        for k in range(n):
            x[k], xd[k] = peek(q, peek(plan, order + k)), peek(qd, peek(plan, order + k))
        pairs = multiply_blocks(table, start, plan, at, order + n, x, xd, y, yd)
    else:
        pairs = multiply_blocks(table, start, plan, at, order, q, qd, y, yd)
    end = pairs + 2 * plan[at + LOOSE]
    bring(y, 0, plan, pairs, end)
    bring(yd, early, plan, end - 2 * plan[at + LATE], end)


@kernel
def contract(table, start, plan, at, q, qd, scratch, base, g, l):  # noqa: E741
    """g = base + sum_i q_i table_i, l = sum_i q_dot_i (the last of table_i); a table that starts below zero vanishes."""
    if start < 0:
        copy(g, base)
        fill(l, 0.0)
        return
    products(table, start, plan, at, q, qd, scratch)
    space = plan[at + SPACE]
    for k in range(g.size):
        g[k] = base[k] + scratch[k]
    copy(l, part(scratch, space, l.size))
