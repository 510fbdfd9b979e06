"""Plain forms of what stands behind the wall, as they run where numba's inner parts are not as expected.

A row of eight is a tuple; an array at an address is what `numba.carray` makes of a pointer.
"""

from __future__ import annotations

from typing import Any

from numba import carray, types  # type: ignore[attr-defined]
from numba.extending import overload_attribute

from ffr_dyn.kernels.options import kernel
from ffr_dyn.kernels.simd.intrinsics import intrinsic

# ---- rows of eight -----------------------------------------------------------------------------------------------------


@kernel
def load(array, at):
    a = array
    return a[at], a[at + 1], a[at + 2], a[at + 3], a[at + 4], a[at + 5], a[at + 6], a[at + 7]


@kernel
def store(array, at, row):
    for k in range(8):
        array[at + k] = row[k]


@kernel
def zeros():
    return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0


@kernel
def plus(row, number, other):
    (a, b, c, d, e, f, g, h), x, o = row, number, other
    return (
        a + x * o[0],
        b + x * o[1],
        c + x * o[2],
        d + x * o[3],
        e + x * o[4],
        f + x * o[5],
        g + x * o[6],
        h + x * o[7],
    )


@kernel
def less(row, number, other):
    return plus(row, -number, other)


@kernel
def scaled(number, row):
    return plus(zeros(), number, row)


@kernel
def times(row, other):
    (a, b, c, d, e, f, g, h), o = row, other
    return a * o[0], b * o[1], c * o[2], d * o[3], e * o[4], f * o[5], g * o[6], h * o[7]


@kernel
def total(row):
    a, b, c, d, e, f, g, h = row
    return a + b + c + d + e + f + g + h


@kernel
def kept(number, wanted):
    return number if wanted else 0.0


@kernel
def before(row, k):
    a, b, c, d, e, f, g, h = row
    first = kept(a, k > 0), kept(b, k > 1), kept(c, k > 2), kept(d, k > 3)
    return (*first, kept(e, k > 4), kept(f, k > 5), kept(g, k > 6), kept(h, k > 7))


@kernel
def after(row, k):
    _, b, c, d, e, f, g, h = row
    first = 0.0, kept(b, k < 1), kept(c, k < 2), kept(d, k < 3)
    return (*first, kept(e, k < 4), kept(f, k < 5), kept(g, k < 6), kept(h, k < 7))


# ---- arrays at addresses -----------------------------------------------------------------------------------------------


def _pointer_to(kind: Any) -> Any:
    result = types.CPointer(kind)

    @intrinsic
    def pointer(typing, address):  # type: ignore[no-untyped-def]
        def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
            return builder.inttoptr(args[0], context.get_value_type(result))

        return result(types.int64), generate

    return pointer


reals_at, integers_at = _pointer_to(types.float64), _pointer_to(types.int64)


@kernel
def vector_at(address, size):
    return carray(address, (size,))


@kernel
def part(array, start, size):
    return carray(reals_at(array.ctypes.data + 8 * start), (size,))


@kernel
def peek(array, number):
    return array[number]


@kernel
def word(address, number):
    return carray(integers_at(address + 8 * number), (1,))[0]


def define_field(packed: Any, name: str, address_of: Any, inner: Any, place: Any) -> None:
    """Let compiled code read a field of packed tables.

    packed     : numba's type of them;  address_of : the compiled function that gives their address
    inner      : that which gives packed tables of a kind at an address
    place      : of a table and a field, (the field's kind, its first word), or None where there is none
    """

    @overload_attribute(packed, name)
    def read(table):  # type: ignore[no-untyped-def]
        found = place(table.table, name)
        if found is None:
            return None
        kind, at = found
        return _reader(kind, at, address_of, inner)


def _reader(kind: Any, at: int, address_of: Any, inner: Any) -> Any:
    if kind is types.float64:
        return lambda table: carray(reals_at(address_of(table) + 8 * at), (1,))[0]
    if kind is types.int64:
        return lambda table: word(address_of(table), at)
    if not isinstance(kind, types.Array):
        view = inner(kind.table)
        return lambda table: view(address_of(table) + 8 * at)
    pointer = integers_at if kind.dtype is types.int64 else reals_at
    shaped = (
        lambda a: (word(a, at + 1),),
        lambda a: (word(a, at + 1), word(a, at + 2)),
        lambda a: (word(a, at + 1), word(a, at + 2), word(a, at + 3)),
        lambda a: (word(a, at + 1), word(a, at + 2), word(a, at + 3), word(a, at + 4)),
    )[kind.ndim - 1]
    shape = kernel(shaped)
    return lambda table: carray(pointer(word(address_of(table), at)), shape(address_of(table)))
