"""Products of a weighted sum of symmetric matrices, in blocks of which those on one side of the diagonal serve both sides.

As `ffr_dyn.decoupling.symmetric_blocks` stores them. Columns are taken by rows of lanes; arrays are pooled.
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
    row_pointer,
    store_row,
    sum_of_lanes,
)
from ffr_dyn.kernels.tables import LANES, MOST_ROWS


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


def _block_product(across: bool) -> Any:
    @intrinsic
    def multiply(typing, K, first, rows, columns, x, y, z, row, column):  # type: ignore[no-untyped-def]
        """y += K^T x for the block of K (rows x columns) that begins at `first`, whose rows and columns are those at `row`
        and `column` of x and y; and with what lies across the diagonal, z += K x.

        Whole rows of lanes of y are read and written: x is zero, and y is not used, between the columns and the next row.
        """

        def generate(context, builder, sig, args):  # type: ignore[no-untyped-def]
            K, first, rows, columns, x, y, z, row, column = args
            K, x, y, z = (pooled_data(context, builder, array) for array in (K, x, y, z))
            widths = builder.sdiv(builder.add(columns, cgutils.intp_t(LANES - 1)), cgutils.intp_t(LANES))
            quads = builder.sdiv(rows, cgutils.intp_t(4))
            done = builder.mul(quads, cgutils.intp_t(4))
            results = [cgutils.alloca_once(builder, ir.VectorType(ir.DoubleType(), LANES)) for _ in range(2)]

            def emit(begin: Any, count: int, shift: Any, other: Any) -> None:
                """`count` rows from row `begin` of the block on, a row of lanes of their columns."""
                own = builder.add(row, begin)
                at = builder.add(builder.add(first, shift), builder.mul(begin, columns))
                entries = []
                for k in range(count):
                    weight = builder.load(builder.gep(x, [builder.add(own, cgutils.intp_t(k))]))
                    entries.append(load_row(builder, K, builder.add(at, builder.mul(columns, cgutils.intp_t(k)))))
                    product = builder.fmul(broadcast(builder, weight), entries[k], flags=LIBERTIES)
                    sum_ = builder.fadd(builder.load(results[k % 2]), product, flags=LIBERTIES)
                    builder.store(sum_, results[k % 2])
                if not across:
                    return
                products = [builder.fmul(entry, other, flags=LIBERTIES) for entry in entries]
                if count == 1:
                    target = builder.gep(z, [own])
                    builder.store(
                        builder.fadd(builder.load(target), sum_of_lanes(builder, products[0]), flags=LIBERTIES), target
                    )
                else:
                    target = row_pointer(builder, z, own, 4)
                    total = builder.fadd(builder.load(target, align=8), _sums(builder, products), flags=LIBERTIES)
                    builder.store(total, target, align=8)

            with cgutils.for_range(builder, widths) as loop:
                shift = builder.mul(loop.index, cgutils.intp_t(LANES))
                place = builder.add(column, shift)
                builder.store(load_row(builder, y, place), results[0])
                builder.store(ir.Constant(ir.VectorType(ir.DoubleType(), LANES), [0.0] * LANES), results[1])
                other = load_row(builder, x, place) if across else None
                with cgutils.for_range(builder, quads) as inner:
                    emit(builder.mul(inner.index, cgutils.intp_t(4)), 4, shift, other)
                with cgutils.for_range(builder, builder.sub(rows, done)) as inner:
                    emit(builder.add(done, inner.index), 1, shift, other)
                found = builder.fadd(builder.load(results[0]), builder.load(results[1]), flags=LIBERTIES)
                store_row(builder, found, y, place)
            return context.get_dummy_value()

        index = types.intp
        return types.void(POOLED, index, index, index, POOLED, POOLED, POOLED, index, index), generate

    return multiply


multiply_one_way, multiply_both_ways = _block_product(False), _block_product(True)


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
