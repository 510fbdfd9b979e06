"""Products of a weighted sum of symmetric matrices, in blocks of which those on one side of the diagonal serve both sides.

As `ffr_dyn.compile.symmetry_blocks.symmetric_blocks` stores them; arrays are pooled.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils

from ffr_dyn.kernels.simd.intrinsics import (
    LIBERTIES,
    POOLED,
    broadcast,
    case_by_case,
    data_of,
    intrinsic,
    load_row,
    pooled_data,
    row_pointer,
    store_row,
)
from ffr_dyn.kernels.tables import LANES, MOST_ROWS, QUAD

IN_ORDER = ("contract", "nsz")
PART, BLOCK = 4, 3  # how many numbers of a plan each of them has


def _lanes_of(builder: Any, row: Any, other: Any, lanes: list[int]) -> Any:
    """A row of the given lanes of a row and of another, whose lanes are counted on."""
    return builder.shuffle_vector(row, other, ir.Constant(ir.VectorType(ir.IntType(32), len(lanes)), lanes))


def _sums(builder: Any, rows: list[Any]) -> Any:
    """The sums over the lanes of four rows, as a row of four."""

    def halved(row: Any, other: Any, size: int, step: int) -> Any:
        """Neighbours of both rows added up: of this row, of the other, and so on by `step` of each."""
        lower = [
            p
            for first in range(0, size, 2 * step)
            for p in (*range(first, first + step), *range(size + first, size + first + step))
        ]
        upper = [p + step for p in lower]
        return builder.fadd(
            _lanes_of(builder, row, other, lower), _lanes_of(builder, row, other, upper), flags=LIBERTIES
        )

    first, second = halved(rows[0], rows[1], LANES, 1), halved(rows[2], rows[3], LANES, 1)
    both = halved(first, second, LANES, 2)
    return builder.fadd(
        _lanes_of(builder, both, both, [0, 1, 2, 3]), _lanes_of(builder, both, both, [4, 5, 6, 7]), flags=LIBERTIES
    )


@intrinsic
def multiply_blocks(typing, parts, plan, at, K, x, y, z):  # type: ignore[no-untyped-def]
    """y + z = K x, for blocks of K and the plan of `ffr_dyn.compile.symmetry_blocks` whose parts begin at `at`.

    Four rows at a time meet all blocks that they have, at most eight columns wide: some serve them alone, others both sides.
    z : set;  y : was zero;  x : zero between a part and the next row of lanes. What y and z have there is not used.
    """

    def generate(context, builder, sig, args):  # type: ignore[no-untyped-def]
        parts, plan, at, K, x, y, z = args
        K, x, y, z = (pooled_data(context, builder, array) for array in (K, x, y, z))
        plan = data_of(context, builder, sig.args[1], plan)
        zero = ir.Constant(ir.VectorType(ir.DoubleType(), LANES), [0.0] * LANES)
        sums = [cgutils.alloca_once(builder, zero.type) for _ in range(QUAD)]
        blocks = cgutils.alloca_once_value(builder, builder.add(at, builder.mul(parts, cgutils.intp_t(PART))))

        def integer(begin: Any, number: int) -> Any:
            return builder.load(builder.gep(plan, [builder.add(begin, cgutils.intp_t(number))]))

        def emit(block: Any, begin: Any, own: list[Any] | None) -> None:
            """A block's share of four rows from its row `begin` on; own: their x."""
            first, stride, column = (integer(block, k) for k in range(BLOCK))
            place = builder.add(first, builder.mul(begin, stride))
            starts = [builder.add(place, builder.mul(stride, cgutils.intp_t(k))) for k in range(QUAD)]
            rows = [load_row(builder, K, start) for start in starts]
            other = load_row(builder, x, column)
            for sum_, row in zip(sums, rows, strict=True):
                product = builder.fmul(row, other, flags=LIBERTIES)
                builder.store(builder.fadd(builder.load(sum_), product, flags=LIBERTIES), sum_)
            if own is not None:
                products = [builder.fmul(number, row, flags=IN_ORDER) for number, row in zip(own, rows, strict=True)]
                pairs = [builder.fadd(products[k], products[k + 1], flags=IN_ORDER) for k in range(0, QUAD, 2)]
                # y last: the next four rows wait for it
                total = builder.fadd(load_row(builder, y, column), builder.fadd(*pairs, flags=IN_ORDER), flags=IN_ORDER)
                store_row(builder, total, y, column)

        with cgutils.for_range(builder, parts) as part:
            header = builder.add(at, builder.mul(part.index, cgutils.intp_t(PART)))
            row, quads, alone, across = (integer(header, k) for k in range(PART))
            start = builder.load(blocks)
            middle = builder.add(start, builder.mul(alone, cgutils.intp_t(BLOCK)))
            with cgutils.for_range(builder, quads) as quad:
                begin = builder.mul(quad.index, cgutils.intp_t(QUAD))
                place = builder.add(row, begin)
                own = [
                    broadcast(builder, builder.load(builder.gep(x, [builder.add(place, cgutils.intp_t(k))])))
                    for k in range(QUAD)
                ]
                for sum_ in sums:
                    builder.store(zero, sum_)
                with cgutils.for_range(builder, alone) as loop:
                    emit(builder.add(start, builder.mul(loop.index, cgutils.intp_t(BLOCK))), begin, None)
                with cgutils.for_range(builder, across) as loop:
                    emit(builder.add(middle, builder.mul(loop.index, cgutils.intp_t(BLOCK))), begin, own)
                total = _sums(builder, [builder.load(sum_) for sum_ in sums])
                builder.store(total, row_pointer(builder, z, place, QUAD), align=8)
            builder.store(builder.add(middle, builder.mul(across, cgutils.intp_t(BLOCK))), blocks)
        return context.get_dummy_value()

    index = types.intp
    return types.void(index, plan, index, POOLED, POOLED, POOLED, POOLED), generate


@intrinsic
def weighted_sum(typing, count, weights, table, start, size, out, at):  # type: ignore[no-untyped-def]
    """out[at + k] = sum over `count` rows i of weights[i] table[start + i size + k], for `size` numbers in whole lanes.

    Six rows at a time, so that what was found is seldom read again.
    """

    def generate(context, builder, sig, args):  # type: ignore[no-untyped-def]
        count, weights, table, start, size, out, at = args
        weights, table, out = (pooled_data(context, builder, array) for array in (weights, table, out))
        widths = builder.sdiv(size, cgutils.intp_t(LANES))

        def emit(begin: Any, rows: int, onto: bool) -> None:
            many = [
                broadcast(builder, builder.load(builder.gep(weights, [builder.add(begin, cgutils.intp_t(k))])))
                for k in range(rows)
            ]
            first = builder.add(start, builder.mul(begin, size))
            with cgutils.for_range(builder, widths) as loop:
                shift = builder.mul(loop.index, cgutils.intp_t(LANES))
                place = builder.add(at, shift)
                total = load_row(builder, out, place) if onto else None
                for k in range(rows):
                    row = load_row(
                        builder, table, builder.add(builder.add(first, shift), builder.mul(size, cgutils.intp_t(k)))
                    )
                    product = builder.fmul(many[k], row, flags=LIBERTIES)
                    total = product if total is None else builder.fadd(total, product, flags=LIBERTIES)
                store_row(builder, total, out, place)

        sixes = builder.sdiv(builder.sub(count, cgutils.intp_t(1)), cgutils.intp_t(MOST_ROWS))
        rest = builder.sub(count, builder.mul(sixes, cgutils.intp_t(MOST_ROWS)))
        case_by_case(context, builder, rest, lambda rows: emit(cgutils.intp_t(0), rows, False))
        with cgutils.for_range(builder, sixes) as loop:
            emit(builder.add(rest, builder.mul(loop.index, cgutils.intp_t(MOST_ROWS))), MOST_ROWS, True)
        return context.get_dummy_value()

    index = types.intp
    return types.void(index, POOLED, POOLED, index, index, POOLED, index), generate
