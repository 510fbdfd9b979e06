"""Sums over the elastic coordinates of a body of tables by coordinate: its quadratic terms.

The tables are stored in blocks, as `ffr_dyn.compile.symmetry_blocks` makes them.

Twin: `ffr_dyn.equations.inertia.moments`.
"""

from ffr_dyn.kernels.options import kernel
from ffr_dyn.kernels.simd.lanes import load, plus, store
from ffr_dyn.kernels.simd.slices import part, peek
from ffr_dyn.kernels.tables import LANES, STRIPS
from ffr_dyn.kernels.vectors import copy, fill


@kernel
def multiply(count, width, stride, table, start, x, first, begin, moving, y, at):
    """y[at + k] = begin[k] + sum over `count` rows i of x[first + i] table[start + i stride + k], k < width, in whole rows of
    lanes. Where `moving` is zero, not one, the sums begin with the same four rows of lanes again and again."""
    strips = (width + LANES - 1) // LANES
    for four in range(strips // STRIPS):  # each result is stored once
        place = STRIPS * LANES * four
        before, source = moving * place, start + place
        s0, s1, s2, s3 = load_four(begin, before)
        for i in range(count):
            number, row = peek(x, first + i), source + i * stride
            r0, r1, r2, r3 = load_four(table, row)
            s0, s1, s2, s3 = plus(s0, number, r0), plus(s1, number, r1), plus(s2, number, r2), plus(s3, number, r3)
        store(y, at + place, s0)
        store(y, at + place + LANES, s1)
        store(y, at + place + 2 * LANES, s2)
        store(y, at + place + 3 * LANES, s3)
    for strip in range(strips - strips % STRIPS, strips):
        place = LANES * strip
        row = load(begin, moving * place)
        for i in range(count):
            row = plus(row, peek(x, first + i), load(table, start + place + i * stride))
        store(y, at + place, row)


@kernel
def load_four(array, at):
    return load(array, at), load(array, at + LANES), load(array, at + 2 * LANES), load(array, at + 3 * LANES)


@kernel
def contract(table, start, plan, at, q, qd, width, last, scratch, base, g, l):  # noqa: E741
    """g (width,) = base + sum_i q_i table_i, l (last,) = sum_i q_dot_i (the last of table_i): the only O(n^2) work of a body.

    Block by block, as the plan that begins at `at` says (see `ffr_dyn.compile.symmetry_blocks`); a table that starts below
    zero vanishes. g, l and the scratch are written beyond what is found, by less than a row of lanes.
    """
    n = q.size
    if start < 0:
        copy(g, base)
        fill(l, 0.0)
        return
    blocks = plan[at]
    order = at + 1 + 3 * blocks
    place = order + n
    x, xd, y, yd, begin, moving = q, qd, g, l, base, 1
    nothing = part(scratch, 0, LANES * STRIPS)
    fill(nothing, 0.0)
    if blocks > 0:
        begin, moving = nothing, 0
        first, found = LANES * STRIPS, LANES * STRIPS + 2 * n
        x, xd = part(scratch, first, n), part(scratch, first + n, n)
        y, yd = part(scratch, found, width + LANES), part(scratch, found + width + LANES, last + LANES)
        for k in range(n):
            number = peek(plan, order + k)
            x[k], xd[k] = peek(q, number), peek(qd, number)
    first, product, late = 0, 0, 0
    for block in range(max(blocks, 1)):
        count, outputs, of_last = n, width, last
        if blocks > 0:
            count, outputs, of_last = plan[at + 1 + 3 * block], plan[at + 2 + 3 * block], plan[at + 3 + 3 * block]
        multiply(count, outputs, outputs, table, start, x, first, begin, moving, y, product)
        multiply(count, of_last, outputs, table, start + outputs - of_last, xd, first, nothing, 0, yd, late)
        start += count * outputs
        first += count
        product += outputs
        late += of_last
    if blocks > 0:
        y[product] = yd[late] = 0.0  # what the plan has for products that vanish
        for k in range(width):
            g[k] = base[k] + peek(y, peek(plan, place + k))
        for k in range(last):
            l[k] = peek(yd, peek(plan, place + width + k))
