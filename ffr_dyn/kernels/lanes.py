"""Rows of eight numbers at a time: the rows of a joint lie side by side, so that one instruction serves all of them.

A joint has at most six rows; the lanes beyond are zero. Arrays are pooled; `at` counts numbers, not rows of eight.
"""

from __future__ import annotations

from typing import Any

from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from ffr_dyn.kernels.tables import LANES

_intrinsic: Any = intrinsic  # whose callers give one argument less than its definition has
_REAL = types.float64
_POOLED = types.Array(types.float64, 1, "C")
_LIBERTIES = ("contract", "reassoc", "nsz")


def _data(context: Any, builder: Any, array: Any) -> Any:
    return context.make_array(_POOLED)(context, builder, array).data


def _row_pointer(builder: Any, data: Any, at: Any) -> Any:
    from llvmlite import ir

    return builder.bitcast(builder.gep(data, [at]), ir.VectorType(ir.DoubleType(), LANES).as_pointer())


def _broadcast(builder: Any, number: Any) -> Any:
    from llvmlite import ir

    vector = ir.VectorType(ir.DoubleType(), LANES)
    one = builder.insert_element(ir.Constant(vector, ir.Undefined), number, ir.Constant(ir.IntType(32), 0))
    zeros = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
    return builder.shuffle_vector(one, ir.Constant(vector, ir.Undefined), zeros)


def _combination(count: int) -> Any:
    @_intrinsic
    def combine(typing, target, at, factor, numbers, first, stride, source, begin):  # type: ignore[no-untyped-def]
        """target row += factor sum_k numbers[first + k stride] source row k, for `count` rows that follow one another."""
        index = types.intp
        signature = types.void(_POOLED, index, _REAL, _POOLED, index, index, _POOLED, index)

        def generate(context, builder, sig, args):  # type: ignore[no-untyped-def]
            out, at, factor, numbers, first, stride, source, begin = args
            numbers, source = _data(context, builder, numbers), _data(context, builder, source)
            place = _row_pointer(builder, _data(context, builder, out), at)
            total = builder.load(place, align=8)
            for k in range(count):
                row = _row_pointer(builder, source, builder.add(begin, cgutils.intp_t(LANES * k)))
                where = builder.add(first, builder.mul(stride, cgutils.intp_t(k)))
                number = builder.fmul(factor, builder.load(builder.gep(numbers, [where])), flags=_LIBERTIES)
                product = builder.fmul(_broadcast(builder, number), builder.load(row, align=8), flags=_LIBERTIES)
                total = builder.fadd(total, product, flags=_LIBERTIES)
            builder.store(total, place, align=8)
            return context.get_dummy_value()

        return signature, generate

    return combine


combine_1, combine_2, combine_3 = _combination(1), _combination(2), _combination(3)
combine_4, combine_5, combine_6, combine_12 = _combination(4), _combination(5), _combination(6), _combination(12)


@_intrinsic
def scale_row(typing, target, at, factor):  # type: ignore[no-untyped-def]
    """target row *= factor."""

    def generate(context, builder, sig, args):  # type: ignore[no-untyped-def]
        place = _row_pointer(builder, _data(context, builder, args[0]), args[1])
        row = builder.load(place, align=8)
        builder.store(builder.fmul(row, _broadcast(builder, args[2]), flags=_LIBERTIES), place, align=8)
        return context.get_dummy_value()

    return types.void(_POOLED, types.intp, _REAL), generate


@_intrinsic
def copy_row(typing, source, begin, target, at):  # type: ignore[no-untyped-def]
    """target row = source row."""

    def generate(context, builder, sig, args):  # type: ignore[no-untyped-def]
        row = builder.load(_row_pointer(builder, _data(context, builder, args[0]), args[1]), align=8)
        builder.store(row, _row_pointer(builder, _data(context, builder, args[2]), args[3]), align=8)
        return context.get_dummy_value()

    return types.void(_POOLED, types.intp, _POOLED, types.intp), generate


@_intrinsic
def clear_row(typing, target, at):  # type: ignore[no-untyped-def]
    """target row = 0."""

    def generate(context, builder, sig, args):  # type: ignore[no-untyped-def]
        place = _row_pointer(builder, _data(context, builder, args[0]), args[1])
        builder.store(_broadcast(builder, context.get_constant(_REAL, 0.0)), place, align=8)
        return context.get_dummy_value()

    return types.void(_POOLED, types.intp), generate


@_intrinsic
def dot_rows(typing, left, at, right, begin):  # type: ignore[no-untyped-def]
    """The sum over the lanes of left row * right row."""

    def generate(context, builder, sig, args):  # type: ignore[no-untyped-def]
        from llvmlite import ir

        left = builder.load(_row_pointer(builder, _data(context, builder, args[0]), args[1]), align=8)
        right = builder.load(_row_pointer(builder, _data(context, builder, args[2]), args[3]), align=8)
        product = builder.fmul(left, right, flags=_LIBERTIES)
        vector = ir.VectorType(ir.DoubleType(), LANES)
        name = f"llvm.vector.reduce.fadd.v{LANES}f64"
        reduce = cgutils.get_or_insert_function(
            builder.module, ir.FunctionType(ir.DoubleType(), [ir.DoubleType(), vector]), name
        )
        return builder.call(reduce, [ir.Constant(ir.DoubleType(), 0.0), product], fastmath=_LIBERTIES)

    return _REAL(_POOLED, types.intp, _POOLED, types.intp), generate
