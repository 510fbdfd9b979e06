"""Tables at an address: how a compiled unit, which is given one number, finds the arrays it works on.

A unit that took the tables themselves would have to be compiled together with everything that calls it. So `pack` writes
the addresses and shapes of all arrays into one array of integers, and `unpack_tables`, `unpack_record` read them back inside
compiled code. What a table holds, and in which order, is said once: by the annotations in `tables`.
"""

from __future__ import annotations

from functools import cache
from typing import Any, get_type_hints

import numpy as np
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numba.np.arrayobj import make_array, populate_array

from ffr_dyn.kernels.tables import Record, Tables

Array = np.ndarray

_intrinsic: Any = intrinsic  # whose callers give one argument less than its definition has


@cache
def _fields(kind: Any) -> dict[str, Any]:
    return get_type_hints(kind, include_extras=True)


def pack(tables: Any) -> Array:
    """Addresses and shapes of the arrays of nested named tuples, and their numbers (int64). The arrays must outlive it."""
    found: list[int] = []
    for name, kind in _fields(type(tables)).items():  # type: ignore[arg-type]
        value = getattr(tables, name)
        if kind is float:
            found.append(int(np.float64(value).view(np.int64)))
        elif kind is int:
            found.append(value)
        elif hasattr(kind, "_fields"):
            found.extend(pack(value))
        else:
            dtype, axes = kind.__metadata__[0]
            if value.dtype != dtype or value.ndim != axes or not value.flags.c_contiguous:
                raise TypeError(f"table {name} is a {value.dtype} array of {value.ndim} axes, not {dtype} of {axes}")
            found += [value.ctypes.data, *value.shape]
    return np.array(found, dtype=np.int64)


def _numba_type(kind: Any) -> Any:
    if kind is float:
        return types.float64
    if kind is int:
        return types.int64
    if hasattr(kind, "_fields"):
        return types.BaseTuple.from_types(tuple(_numba_type(each) for each in _fields(kind).values()), kind)
    dtype, axes = kind.__metadata__[0]
    return types.Array(getattr(types, dtype), axes, "C")


def _read(context: Any, builder: Any, kind: Any, base: Any, at: int) -> tuple[Any, int]:
    """(value of a numba type at word `at`, the next word)."""

    def word(number: int) -> Any:
        loaded = builder.load(builder.gep(base, [cgutils.intp_t(number)]))
        loaded.set_metadata("invariant.load", builder.module.add_metadata([]))
        return loaded

    if isinstance(kind, types.BaseTuple):
        values = []
        for each in kind.types:  # type: ignore[attr-defined]
            value, at = _read(context, builder, each, base, at)
            values.append(value)
        return context.make_tuple(builder, kind, values), at
    if isinstance(kind, types.Array):
        shape = [word(at + 1 + axis) for axis in range(kind.ndim)]
        item = context.get_constant(types.intp, 8)
        strides = [item]
        for size in shape[:0:-1]:
            strides.insert(0, builder.mul(strides[0], size, flags=["nsw"]))
        array = make_array(kind)(context, builder)
        data = builder.inttoptr(word(at), context.get_data_type(kind.dtype).as_pointer())
        populate_array(array, data=data, shape=shape, strides=strides, itemsize=item, meminfo=None)
        return array._getvalue(), at + 1 + kind.ndim
    loaded = word(at)
    return (builder.bitcast(loaded, context.get_value_type(kind)) if kind is types.float64 else loaded), at + 1


def _unpacker(kind: type) -> Any:
    result = _numba_type(kind)

    @_intrinsic
    def unpack(typing, address):  # type: ignore[no-untyped-def]
        def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
            base = builder.inttoptr(args[0], cgutils.intp_t.as_pointer())
            return _read(context, builder, result, base, 0)[0]

        return result(types.int64), generate

    return unpack


unpack_tables, unpack_record = _unpacker(Tables), _unpacker(Record)


@_intrinsic
def vector_at(typing, address, size):  # type: ignore[no-untyped-def]
    """The array of `size` numbers at an address."""
    kind = types.Array(types.float64, 1, "C")

    def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
        array, item = make_array(kind)(context, builder), context.get_constant(types.intp, 8)
        data = builder.inttoptr(args[0], context.get_data_type(types.float64).as_pointer())
        populate_array(array, data=data, shape=[args[1]], strides=[item], itemsize=item, meminfo=None)
        return array._getvalue()

    return kind(types.int64, types.int64), generate


@_intrinsic
def call_unit(typing, unit, address, t, first, second):  # type: ignore[no-untyped-def]
    """Call the unit at address `unit` (see `ffr_dyn.kernels.units`)."""
    signature = types.int64(types.int64, types.int64, types.float64, types.int64, types.int64)

    def generate(context, builder, sig, args):  # type: ignore[no-untyped-def]
        from llvmlite import ir

        integer, real = ir.IntType(64), ir.DoubleType()
        function = ir.FunctionType(integer, [integer, real, integer, integer])
        return builder.call(builder.inttoptr(args[0], function.as_pointer()), list(args[1:]))

    return signature, generate
