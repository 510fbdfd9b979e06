"""Parts of arrays in compiled code: an address and a size, without the checks that a slice makes at every use.

A slice `a[i : i + n]` is clipped to the array, with negative indices counted from its end. Here the tables are laid out so
that every part lies inside, and a part is compiled, and made, in a fraction of the time.
"""

from __future__ import annotations

from typing import Any

from numba import types

from ffr_dyn.kernels.options import inlined
from ffr_dyn.kernels.simd import plain
from ffr_dyn.kernels.simd.intrinsics import PLAIN, intrinsic, make_array, populate_array

_VECTOR = types.Array(types.float64, 1, "C")


def array_at(context: Any, builder: Any, kind: Any, data: Any, shape: list[Any]) -> Any:
    """The contiguous array of numbers of eight bytes at a pointer: a value of numba's array type `kind`."""
    item = context.get_constant(types.intp, 8)
    strides = [item]
    for size in shape[:0:-1]:
        strides.insert(0, builder.mul(strides[0], size, flags=["nsw"]))
    array = make_array(kind)(context, builder)
    populate_array(array, data=data, shape=shape, strides=strides, itemsize=item, meminfo=None)
    return array._getvalue()


@intrinsic
def vector_at(typing, address, size):  # type: ignore[no-untyped-def]
    """The array of `size` numbers at an address, as an entry point is given it."""

    def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
        return array_at(context, builder, _VECTOR, args[0], [args[1]])

    return _VECTOR(types.CPointer(types.float64), types.int64), generate


@intrinsic
def part(typing, array, start, size):  # type: ignore[no-untyped-def]
    """`size` numbers from number `start` of a contiguous array on, whatever its axes: a.ravel()[start : start + size]."""

    def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
        first = builder.gep(make_array(array)(context, builder, args[0]).data, [args[1]], inbounds=True)
        return array_at(context, builder, _VECTOR, first, [args[2]])

    return _VECTOR(array, types.int64, types.int64), generate


@intrinsic
def peek(typing, array, number):  # type: ignore[no-untyped-def]
    """array[number] of a contiguous vector, for a number that is none of those counted from the end."""

    def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
        return builder.load(builder.gep(make_array(array)(context, builder, args[0]).data, [args[1]], inbounds=True))

    return array.dtype(array, types.int64), generate


if PLAIN:
    vector_at, part, peek = plain.vector_at, plain.part, plain.peek


@inlined
def three_parts(array, n):
    """The first three rows of `n` numbers each of a contiguous array."""
    return part(array, 0, n), part(array, n, n), part(array, 2 * n, n)


@inlined
def six_parts(array, n):
    """The first six."""
    return (*three_parts(array, n), part(array, 3 * n, n), part(array, 4 * n, n), part(array, 5 * n, n))
