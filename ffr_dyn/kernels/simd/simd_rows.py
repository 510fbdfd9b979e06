"""Rows of eight numbers at a time: the rows of a joint lie side by side, so that one instruction serves all of them.

A joint has at most six rows; the lanes beyond are zero. Arrays are pooled; `at` counts numbers, not rows of eight.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils

from ffr_dyn.kernels.simd.intrinsics import (
    LIBERTIES,
    POOLED,
    REAL,
    broadcast,
    case_by_case,
    intrinsic,
    lane_of,
    load_row,
    pooled_data,
    row_pointer,
    store_row,
    sum_of_lanes,
)
from ffr_dyn.kernels.tables import LANES, NARROW


def _combination(count: int, lanes: int = LANES) -> Any:
    """Of `count` source rows that follow one another."""

    @intrinsic
    def combine(typing, target, at, factor, numbers, first, stride, source, begin):  # type: ignore[no-untyped-def]
        """target row += factor sum_k numbers[first + k stride] source row k."""
        index = types.intp
        signature = types.void(POOLED, index, REAL, POOLED, index, index, POOLED, index)

        def generate(context, builder, sig, args):  # type: ignore[no-untyped-def]
            out, at, factor, numbers, first, stride, source, begin = args
            numbers, source = pooled_data(context, builder, numbers), pooled_data(context, builder, source)
            place = row_pointer(builder, pooled_data(context, builder, out), at, lanes)
            total = builder.load(place, align=8)
            for k in range(count):
                row = row_pointer(builder, source, builder.add(begin, cgutils.intp_t(LANES * k)), lanes)
                where = builder.add(first, builder.mul(stride, cgutils.intp_t(k)))
                number = builder.fmul(factor, builder.load(builder.gep(numbers, [where])), flags=LIBERTIES)
                many = broadcast(builder, number, lanes)
                product = builder.fmul(many, builder.load(row, align=8), flags=LIBERTIES)
                total = builder.fadd(total, product, flags=LIBERTIES)
            builder.store(total, place, align=8)
            return context.get_dummy_value()

        return signature, generate

    return combine


# In the plane a joint has at most three rows: half a row of lanes is enough.
combine_6, narrow_3, narrow_6 = _combination(6), _combination(3, NARROW), _combination(6, NARROW)


def _of_two_rows(emit: Any, lanes: int = LANES, result: Any = types.void) -> Any:
    """The compiled function (array, at, other array, at in it): what `emit` makes of the pointers to the two rows."""

    @intrinsic
    def operate(typing, first, at, second, begin):  # type: ignore[no-untyped-def]
        def generate(context, builder, sig, args):  # type: ignore[no-untyped-def]
            one = row_pointer(builder, pooled_data(context, builder, args[0]), args[1], lanes)
            other = row_pointer(builder, pooled_data(context, builder, args[2]), args[3], lanes)
            found = emit(builder, one, other)
            return context.get_dummy_value() if result is types.void else found

        return result(POOLED, types.intp, POOLED, types.intp), generate

    return operate


def _product(builder: Any, left: Any, right: Any) -> Any:
    return builder.fmul(builder.load(left, align=8), builder.load(right, align=8), flags=LIBERTIES)


def _multiply(builder: Any, target: Any, source: Any) -> None:
    """target row *= source row."""
    builder.store(_product(builder, target, source), target, align=8)


def _dot(builder: Any, left: Any, right: Any) -> Any:
    """The sum over the lanes of left row * right row."""
    return sum_of_lanes(builder, _product(builder, left, right))


multiply_row = _of_two_rows(_multiply)
dot_rows, dot_narrow = _of_two_rows(_dot, result=REAL), _of_two_rows(_dot, NARROW, REAL)


@intrinsic
def add_scale(typing, jac, by_mass, by_inertia, scale, at):  # type: ignore[no-untyped-def]
    """What the rows' own part of the multiplier matrix is at least, by the inverse mass or inertia of the body of a side.

    jac : (9 * 8,) coefficients of the side;  scale : the row of lanes at `at` takes it
    """

    def generate(context, builder, sig, args):  # type: ignore[no-untyped-def]
        jac, by_mass, by_inertia, scale, at = args
        jac, scale = pooled_data(context, builder, jac), pooled_data(context, builder, scale)

        def square(first: int) -> Any:
            total = broadcast(builder, context.get_constant(REAL, 0.0))
            for k in range(first, first + 3):
                row = load_row(builder, jac, cgutils.intp_t(0), k)
                total = builder.fadd(total, builder.fmul(row, row, flags=LIBERTIES), flags=LIBERTIES)
            return total

        point, turn = square(0), square(3)
        moves = builder.fcmp_ordered(">", point, broadcast(builder, context.get_constant(REAL, 0.0)))
        point = builder.fmul(point, broadcast(builder, by_mass), flags=LIBERTIES)
        turn = builder.fmul(turn, broadcast(builder, by_inertia), flags=LIBERTIES)
        least = builder.select(moves, point, turn)
        store_row(builder, builder.fadd(load_row(builder, scale, at), least, flags=LIBERTIES), scale, at)
        return context.get_dummy_value()

    return types.void(POOLED, REAL, REAL, POOLED, types.intp), generate


# ---- blocks of a joint with itself and with another: as many rows as the joint has, held in registers -------------------


def _less(builder: Any, row: Any, number: Any, other: Any) -> Any:
    """row - number other."""
    product = builder.fmul(broadcast(builder, number), other, flags=LIBERTIES)
    return builder.fsub(row, product, flags=LIBERTIES)


def _merged(builder: Any, row: Any, other: Any, taken: range) -> Any:
    """The row, with the lanes `taken` from the other."""
    lanes = [LANES + k if k in taken else k for k in range(LANES)]
    return builder.shuffle_vector(row, other, ir.Constant(ir.VectorType(ir.IntType(32), LANES), lanes))


def _beyond(builder: Any, row: Any, number: int) -> Any:
    """The lanes after `number`, zero elsewhere."""
    return _merged(builder, row, ir.Constant(row.type, [0.0] * LANES), range(number + 1))


def _before(builder: Any, row: Any, number: int) -> Any:
    """The lanes before `number`, zero elsewhere."""
    return _merged(builder, row, ir.Constant(row.type, [0.0] * LANES), range(number, LANES))


@intrinsic
def factorise_rows(typing, size, S, at, least, first, pivots, own, raw):  # type: ignore[no-untyped-def]
    """S = U^T D U in place for a block of `size` rows; 1 / D goes to `pivots`.

    In row c of the block, lanes beyond c hold row c of U, lanes before c its column c: a solution needs both.

    least : what an entry of D is at least, from number `first`;  raw : row of lanes for what D was before
    """

    def generate(context, builder, sig, args):  # type: ignore[no-untyped-def]
        size, S, at, least, first, pivots, own, raw = args
        S, least, pivots, raw = (pooled_data(context, builder, array) for array in (S, least, pivots, raw))
        one = context.get_constant(REAL, 1.0)

        def emit(n: int) -> None:
            rows = [load_row(builder, S, at, k) for k in range(n)]
            inverses = ir.Constant(rows[0].type, [0.0] * LANES)
            for c in range(n):
                found = lane_of(builder, rows[c], c)
                builder.store(found, builder.gep(raw, [cgutils.intp_t(c)]))
                floor = builder.load(builder.gep(least, [builder.add(first, cgutils.intp_t(c))]))
                pivot = builder.select(builder.fcmp_ordered(">", found, floor), found, floor)
                inverse = builder.fdiv(one, pivot)
                builder.store(inverse, builder.gep(pivots, [builder.add(own, cgutils.intp_t(c))]))
                scaled = builder.fmul(rows[c], broadcast(builder, inverse), flags=LIBERTIES)
                unit = _beyond(builder, scaled, c)
                column = builder.fmul(rows[c], inverses, flags=LIBERTIES)  # S was symmetric; zero from lane c on
                store_row(builder, _merged(builder, unit, column, range(c)), S, at, c)
                inverses = builder.insert_element(inverses, inverse, ir.Constant(ir.IntType(32), c))
                for i in range(c + 1, n):
                    rows[i] = _less(builder, rows[i], lane_of(builder, rows[c], i), unit)

        return case_by_case(context, builder, size, emit)

    index = types.intp
    return types.void(index, POOLED, index, POOLED, index, POOLED, index, POOLED), generate


@intrinsic
def eliminate_rows(typing, size, S, diagonal, at, pivots, own, Y):  # type: ignore[no-untyped-def]
    """Y = U^-T times the block at `at`, which becomes D^-1 Y, for the factor of `size` rows at `diagonal`."""

    def generate(context, builder, sig, args):  # type: ignore[no-untyped-def]
        size, S, diagonal, at, pivots, own, Y = args
        S, pivots, Y = (pooled_data(context, builder, array) for array in (S, pivots, Y))

        def emit(n: int) -> None:
            rows = [load_row(builder, S, at, k) for k in range(n)]
            for c in range(n):
                for j in range(c):
                    place = builder.add(diagonal, cgutils.intp_t(LANES * j + c))
                    rows[c] = _less(builder, rows[c], builder.load(builder.gep(S, [place])), rows[j])
                inverse = builder.load(builder.gep(pivots, [builder.add(own, cgutils.intp_t(c))]))
                store_row(builder, rows[c], Y, cgutils.intp_t(0), c)
                store_row(builder, builder.fmul(rows[c], broadcast(builder, inverse), flags=LIBERTIES), S, at, c)

        return case_by_case(context, builder, size, emit)

    index = types.intp
    return types.void(index, POOLED, index, index, POOLED, index, POOLED), generate


@intrinsic
def subtract_product(typing, size, S, target, numbers, Y):  # type: ignore[no-untyped-def]
    """The row of S at `target` less sum_c S[numbers + 8 c] Y_c, over `size` rows of Y."""

    def generate(context, builder, sig, args):  # type: ignore[no-untyped-def]
        size, S, target, numbers, Y = args
        S, Y = pooled_data(context, builder, S), pooled_data(context, builder, Y)

        def emit(n: int) -> None:
            row = load_row(builder, S, target)
            for c in range(n):
                number = builder.load(builder.gep(S, [builder.add(numbers, cgutils.intp_t(LANES * c))]))
                row = _less(builder, row, number, load_row(builder, Y, cgutils.intp_t(0), c))
            store_row(builder, row, S, target)

        return case_by_case(context, builder, size, emit)

    index = types.intp
    return types.void(index, POOLED, index, index, POOLED), generate


def _substitution(descending: bool, text: str) -> Any:
    @intrinsic
    def substitute(typing, size, S, diagonal, b, own):  # type: ignore[no-untyped-def]
        def generate(context, builder, sig, args):  # type: ignore[no-untyped-def]
            size, S, diagonal, b, own = args
            S, b = pooled_data(context, builder, S), pooled_data(context, builder, b)

            def emit(n: int) -> None:
                row = load_row(builder, b, own)
                for c in range(n - 1, 0, -1) if descending else range(n - 1):
                    kept = _before if descending else _beyond
                    column = kept(builder, load_row(builder, S, diagonal, c), c)
                    row = _less(builder, row, lane_of(builder, row, c), column)
                store_row(builder, row, b, own)

            return case_by_case(context, builder, size, emit)

        index = types.intp
        return types.void(index, POOLED, index, POOLED, index), generate

    substitute.__doc__ = text
    return substitute


solve_lower = _substitution(False, "The row of b at `own` becomes U^-T times it.")
solve_upper = _substitution(True, "The row of b at `own` becomes U^-1 times it.")


@intrinsic
def spread_lower(typing, size, S, at, b, own, later):  # type: ignore[no-untyped-def]
    """The row of b at `later` less sum_c b[own + c] times row c of the block at `at`, over `size` rows."""

    def generate(context, builder, sig, args):  # type: ignore[no-untyped-def]
        size, S, at, b, own, later = args
        S, b = pooled_data(context, builder, S), pooled_data(context, builder, b)

        def emit(n: int) -> None:
            row, mine = load_row(builder, b, later), load_row(builder, b, own)
            for c in range(n):
                row = _less(builder, row, lane_of(builder, mine, c), load_row(builder, S, at, c))
            store_row(builder, row, b, later)

        return case_by_case(context, builder, size, emit)

    index = types.intp
    return types.void(index, POOLED, index, POOLED, index, index), generate


@intrinsic
def gather_upper(typing, size, S, at, b, later, own):  # type: ignore[no-untyped-def]
    """b[own + c] less the product of row c of the block at `at` with the row of b at `later`, for `size` rows c."""

    def generate(context, builder, sig, args):  # type: ignore[no-untyped-def]
        size, S, at, b, later, own = args
        S, b = pooled_data(context, builder, S), pooled_data(context, builder, b)

        def emit(n: int) -> None:
            row, other = load_row(builder, b, own), load_row(builder, b, later)
            for c in range(n):
                total = sum_of_lanes(builder, builder.fmul(load_row(builder, S, at, c), other, flags=LIBERTIES))
                value = builder.fsub(lane_of(builder, row, c), total, flags=LIBERTIES)
                row = builder.insert_element(row, value, ir.Constant(ir.IntType(32), c))
            store_row(builder, row, b, own)

        return case_by_case(context, builder, size, emit)

    index = types.intp
    return types.void(index, POOLED, index, POOLED, index, index), generate
