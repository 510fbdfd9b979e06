"""Parts of arrays in compiled code: an address and a size, without the checks that a slice makes at every use.

A slice `a[i : i + n]` is clipped to the array, with negative indices counted from its end. Here the tables are laid out so
that every part lies inside, and a part is compiled, and made, in a fraction of the time.
"""

from __future__ import annotations

from typing import Any

from numba import types
from numba.core import cgutils
from numba.np.arrayobj import make_array, populate_array

from ffr_dyn.kernels.simd.intrinsics import data_of, intrinsic

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
        first = builder.gep(data_of(context, builder, array, args[0]), [args[1]], inbounds=True)
        return array_at(context, builder, _VECTOR, first, [args[2]])

    return _VECTOR(array, types.int64, types.int64), generate


@intrinsic
def peek(typing, array, number):  # type: ignore[no-untyped-def]
    """array[number] of a contiguous vector, for a number that is none of those counted from the end."""

    def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
        return builder.load(builder.gep(data_of(context, builder, array, args[0]), [args[1]], inbounds=True))

    return array.dtype(array, types.int64), generate


def _parts(count: int) -> Any:
    """The compiled function that gives the first `count` rows of `size` numbers each of a contiguous array."""
    result = types.UniTuple(_VECTOR, count)

    @intrinsic
    def first_parts(typing, array, size):  # type: ignore[no-untyped-def]
        def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
            data, rows = data_of(context, builder, array, args[0]), []
            for number in range(count):
                first = builder.gep(data, [builder.mul(args[1], cgutils.intp_t(number))], inbounds=True)
                rows.append(array_at(context, builder, _VECTOR, first, [args[1]]))
            return context.make_tuple(builder, result, rows)

        return result(array, types.int64), generate

    return first_parts


three_parts, six_parts = _parts(3), _parts(6)
