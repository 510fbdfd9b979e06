"""Rows of eight numbers as values of compiled code, which one instruction serves: the rows of a joint lie side by side.

A joint has at most six rows; the lanes beyond are zero. Arrays are pooled; `at` counts numbers, not rows of eight. Each
function does what its namesake in `plain` does to a tuple of eight.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import models, register_model

from ffr_dyn.kernels.simd import plain
from ffr_dyn.kernels.simd.intrinsics import PLAIN, intrinsic, make_array
from ffr_dyn.kernels.tables import LANES

VECTOR = ir.VectorType(ir.DoubleType(), LANES)
LIBERTIES = ("contract", "reassoc", "nsz")


class Row(types.Type):
    """Eight numbers in one register."""

    def __init__(self) -> None:
        super().__init__("Row")


@register_model(Row)
class RowModel(models.PrimitiveModel):  # type: ignore[misc]
    """A vector."""

    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, VECTOR)


ROW, REAL, INDEX = Row(), types.float64, types.intp


def _place(context: Any, builder: Any, kind: Any, array: Any, at: Any) -> Any:
    data = make_array(kind)(context, builder, array).data
    return builder.bitcast(builder.gep(data, [at]), VECTOR.as_pointer())


def _all(builder: Any, number: Any) -> Any:
    """A vector with a number in every lane."""
    kind = ir.VectorType(number.type, LANES)
    one = builder.insert_element(ir.Constant(kind, ir.Undefined), number, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(one, one, ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES))


@intrinsic
def load(typing, array, at):  # type: ignore[no-untyped-def]
    """The row at number `at` of an array."""

    def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
        return builder.load(_place(context, builder, array, *args), align=8)

    return ROW(array, INDEX), generate


@intrinsic
def store(typing, array, at, row):  # type: ignore[no-untyped-def]
    """Write a row to number `at` of an array."""

    def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
        builder.store(args[2], _place(context, builder, array, *args[:2]), align=8)
        return context.get_dummy_value()

    return types.void(array, INDEX, ROW), generate


@intrinsic
def zeros(typing):  # type: ignore[no-untyped-def]
    """A row of zeros."""
    return ROW(), lambda context, builder, signature, args: ir.Constant(VECTOR, [0.0] * LANES)


def _of_three(combine: str) -> Any:
    @intrinsic
    def operate(typing, row, number, other):  # type: ignore[no-untyped-def]
        def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
            product = builder.fmul(_all(builder, args[1]), args[2], flags=LIBERTIES)
            return getattr(builder, combine)(args[0], product, flags=LIBERTIES)

        return ROW(ROW, REAL, ROW), generate

    return operate


# row + number other, row - number other
plus, less = _of_three("fadd"), _of_three("fsub")


@intrinsic
def scaled(typing, number, row):  # type: ignore[no-untyped-def]
    """number row."""

    def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
        return builder.fmul(_all(builder, args[0]), args[1], flags=LIBERTIES)

    return ROW(REAL, ROW), generate


@intrinsic
def times(typing, row, other):  # type: ignore[no-untyped-def]
    """The products lane by lane."""
    return ROW(ROW, ROW), lambda context, builder, signature, args: builder.fmul(*args, flags=LIBERTIES)


@intrinsic
def total(typing, row):  # type: ignore[no-untyped-def]
    """The sum of all lanes."""

    def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
        found, size = args[0], LANES
        while size > 1:
            size //= 2
            kind = ir.VectorType(ir.IntType(32), size)
            halves = [
                builder.shuffle_vector(found, found, ir.Constant(kind, list(range(k, k + size)))) for k in (0, size)
            ]
            found = builder.fadd(*halves, flags=LIBERTIES)
        return builder.extract_element(found, ir.Constant(ir.IntType(32), 0))

    return REAL(ROW), generate


def _part(order: str) -> Any:
    @intrinsic
    def select(typing, row, number):  # type: ignore[no-untyped-def]
        def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
            lanes = ir.Constant(ir.VectorType(ir.IntType(64), LANES), list(range(LANES)))
            kept = builder.icmp_signed(order, lanes, _all(builder, args[1]))
            return builder.select(kept, args[0], ir.Constant(VECTOR, [0.0] * LANES))

        return ROW(ROW, INDEX), generate

    return select


# The lanes before lane `number`, those after it; zero elsewhere.
before, after = _part("<"), _part(">")

if PLAIN:
    load, store, zeros = plain.load, plain.store, plain.zeros
    plus, less, scaled, times, total = plain.plus, plain.less, plain.scaled, plain.times, plain.total
    before, after = plain.before, plain.after
