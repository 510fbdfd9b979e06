"""Sums over the elastic coordinates of a body of tables by coordinate: its quadratic terms.

The tables are stored in blocks, as `ffr_dyn.decoupling` makes them.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils

from ffr_dyn.kernels.intrinsics import (
    LIBERTIES,
    POOLED,
    broadcast,
    case_by_case,
    intrinsic,
    load_row,
    pooled_data,
    store_row,
)
from ffr_dyn.kernels.options import kernel
from ffr_dyn.kernels.tables import LANES, MOST_ROWS
from ffr_dyn.kernels.vectors import copy, fill
from ffr_dyn.kernels.views import part, peek


@kernel
def contract(table, start, plan, at, q, qd, width, last, scratch, base, g, l):  # noqa: E741
    """g (width,) = base + sum_i q_i table_i, l (last,) = sum_i q_dot_i (the last of table_i): the only O(n^2) work of a body.

    Block by block, as the plan that begins at `at` says (see `ffr_dyn.decoupling`); a table that starts below zero vanishes.
    g, l and the scratch are written beyond their ends, by less than a row of lanes.
    """
    n, skipped = q.size, width - last
    if start < 0 or plan[at] == 0:
        copy(g, base)
        if start < 0:
            fill(l, 0.0)
        else:
            add_products(n, width, width, table, start, q, 0, g, 0)
            set_products(n, last, width, table, start + skipped, qd, 0, l, 0)
        return
    blocks = plan[at]
    order = at + 1 + 3 * blocks
    place = order + n
    x, xd = part(scratch, 0, n), part(scratch, n, n)
    y, yd = part(scratch, 2 * n, width + LANES), part(scratch, 2 * n + width + LANES, last + LANES)
    for k in range(n):
        number = peek(plan, order + k)
        x[k], xd[k] = peek(q, number), peek(qd, number)
    first, product, late = 0, 0, 0
    for block in range(blocks):
        count, outputs, of_last = plan[at + 1 + 3 * block], plan[at + 2 + 3 * block], plan[at + 3 + 3 * block]
        set_products(count, outputs, outputs, table, start, x, first, y, product)
        set_products(count, of_last, outputs, table, start + outputs - of_last, xd, first, yd, late)
        start += count * outputs
        first += count
        product += outputs
        late += of_last
    y[product] = yd[late] = 0.0  # what the plan has for products that vanish
    for k in range(width):
        g[k] = base[k] + peek(y, peek(plan, place + k))
    for k in range(last):
        l[k] = peek(yd, peek(plan, place + width + k))


def _products(onto: bool) -> Any:
    @intrinsic
    def multiply(typing, count, width, stride, table, start, x, first, y, at):  # type: ignore[no-untyped-def]
        """y[at + k] = sum over `count` rows i of x[first + i] table[start + i stride + k], k < width, in whole rows of lanes;
        or += that."""

        def generate(context, builder, sig, args):  # type: ignore[no-untyped-def]
            count, width, stride, table, start, x, first, y, at = args
            table, x, y = (pooled_data(context, builder, array) for array in (table, x, y))
            zero = ir.Constant(ir.VectorType(ir.DoubleType(), LANES), [0.0] * LANES)
            sums = [cgutils.alloca_once(builder, zero.type) for _ in range(MOST_ROWS)]

            def emit(begin: Any, strips: int) -> None:
                """So many rows of lanes from number `begin` on: each result is stored once."""
                target, source = builder.add(at, begin), builder.add(start, begin)
                for k in range(strips):
                    builder.store(load_row(builder, y, target, k) if onto else zero, sums[k])
                with cgutils.for_range(builder, count) as loop:
                    number = broadcast(builder, builder.load(builder.gep(x, [builder.add(first, loop.index)])))
                    row = builder.add(source, builder.mul(loop.index, stride))
                    for k in range(strips):
                        product = builder.fmul(number, load_row(builder, table, row, k), flags=LIBERTIES)
                        builder.store(builder.fadd(builder.load(sums[k]), product, flags=LIBERTIES), sums[k])
                for k in range(strips):
                    store_row(builder, builder.load(sums[k]), y, target, k)

            strips = builder.sdiv(builder.add(width, cgutils.intp_t(LANES - 1)), cgutils.intp_t(LANES))
            whole = builder.sdiv(strips, cgutils.intp_t(MOST_ROWS))
            together = cgutils.intp_t(LANES * MOST_ROWS)
            with cgutils.for_range(builder, whole) as loop:
                emit(builder.mul(loop.index, together), MOST_ROWS)
            rest = builder.sub(strips, builder.mul(whole, cgutils.intp_t(MOST_ROWS)))
            return case_by_case(context, builder, rest, lambda rows: emit(builder.mul(whole, together), rows))

        index = types.intp
        return types.void(index, index, index, POOLED, index, POOLED, index, POOLED, index), generate

    return multiply


set_products, add_products = _products(False), _products(True)
