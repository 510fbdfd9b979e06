"""Sums over the elastic coordinates of a body of tables by coordinate: its quadratic terms.

The tables are stored in blocks, as `ffr_dyn.compile.symmetry_blocks` makes them.

Twin: `ffr_dyn.equations.inertia.moments`.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils

from ffr_dyn.kernels.options import kernel
from ffr_dyn.kernels.simd.intrinsics import (
    LIBERTIES,
    POOLED,
    broadcast,
    case_by_case,
    intrinsic,
    load_row,
    pooled_data,
    store_row,
)
from ffr_dyn.kernels.simd.slices import part, peek
from ffr_dyn.kernels.tables import LANES, MOST_ROWS
from ffr_dyn.kernels.vectors import copy, fill


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
    nothing = part(scratch, 0, LANES * MOST_ROWS)
    fill(nothing, 0.0)
    if blocks > 0:
        begin, moving = nothing, 0
        first, found = LANES * MOST_ROWS, LANES * MOST_ROWS + 2 * n
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


@intrinsic
def multiply(typing, count, width, stride, table, start, x, first, begin, moving, y, at):  # type: ignore[no-untyped-def]
    """y[at + k] = begin[k] + sum over `count` rows i of x[first + i] table[start + i stride + k], k < width, in whole rows of
    lanes. Where `moving` is zero, not one, the sums begin with the same six rows of lanes again and again."""

    def generate(context, builder, sig, args):  # type: ignore[no-untyped-def]
        count, width, stride, table, start, x, first, base, moving, y, at = args
        table, x, base, y = (pooled_data(context, builder, array) for array in (table, x, base, y))
        sums = [cgutils.alloca_once(builder, ir.VectorType(ir.DoubleType(), LANES)) for _ in range(MOST_ROWS)]

        def emit(begin: Any, strips: int) -> None:
            """So many rows of lanes from number `begin` on: each result is stored once."""
            source, before = builder.add(start, begin), builder.mul(moving, begin)
            for k, sum_ in enumerate(sums[:strips]):
                builder.store(load_row(builder, base, before, k), sum_)
            with cgutils.for_range(builder, count) as loop:
                number = broadcast(builder, builder.load(builder.gep(x, [builder.add(first, loop.index)])))
                row = builder.add(source, builder.mul(loop.index, stride))
                for k, sum_ in enumerate(sums[:strips]):
                    product = builder.fmul(number, load_row(builder, table, row, k), flags=LIBERTIES)
                    builder.store(builder.fadd(builder.load(sum_), product, flags=LIBERTIES), sum_)
            for k, sum_ in enumerate(sums[:strips]):
                store_row(builder, builder.load(sum_), y, builder.add(at, begin), k)

        strips = builder.sdiv(builder.add(width, cgutils.intp_t(LANES - 1)), cgutils.intp_t(LANES))
        whole = builder.sdiv(strips, cgutils.intp_t(MOST_ROWS))
        together = cgutils.intp_t(LANES * MOST_ROWS)
        with cgutils.for_range(builder, whole) as loop:
            emit(builder.mul(loop.index, together), MOST_ROWS)
        rest = builder.sub(strips, builder.mul(whole, cgutils.intp_t(MOST_ROWS)))
        return case_by_case(context, builder, rest, lambda rows: emit(builder.mul(whole, together), rows))

    index = types.intp
    return types.void(index, index, index, POOLED, index, POOLED, index, POOLED, index, POOLED, index), generate
