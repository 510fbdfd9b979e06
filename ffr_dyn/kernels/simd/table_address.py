"""Tables at an address: how compiled code that is given one address finds the arrays it works on.

`pack` writes the addresses and shapes of all arrays of a table into one array of integers. Compiled code is given the address
of that and reads a field where it uses it. What a table holds, and in which order, is said once: by the annotations in
`ffr_dyn.kernels.tables`.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import accumulate
from typing import Any, get_type_hints

import numpy as np
from numba import types
from numba.extending import infer_getattr, lower_getattr_generic, models, register_model

from ffr_dyn.kernels.simd import plain
from ffr_dyn.kernels.simd.intrinsics import PLAIN, AttributeTemplate, cgutils, intrinsic
from ffr_dyn.kernels.simd.slices import array_at
from ffr_dyn.kernels.tables import Record, Tables
from ffr_prep.common.arrays import Array


@cache
def _fields(kind: Any) -> dict[str, Any]:
    return get_type_hints(kind, include_extras=True)


def _is_table(kind: Any) -> bool:
    """Whether a field holds another named tuple, not a number or an array."""
    return isinstance(kind, type) and issubclass(kind, tuple)


def _array(kind: Any) -> tuple[str, int]:
    """(dtype, number of axes) of a field that holds an array."""
    dtype, axes = kind.__metadata__[0]
    return dtype, axes


@dataclass(frozen=True)
class _Plan:
    """The words of a packed table: how many there are, and where addresses, shapes and numbers are among them.

    dtypes, axes : of the arrays, in order
    """

    words: int
    addresses: Array
    shapes: Array
    integers: Array
    numbers: Array
    dtypes: list[Any]
    axes: list[int]


@cache
def _plan(kind: Any, but: str = "") -> _Plan:
    places: dict[str, list[int]] = {"array": [], "shape": [], "int": [], "float": []}
    arrays = _planned(kind, 0, places, but)
    array, shape, integer, number = (np.array(found, dtype=np.int64) for found in places.values())
    dtypes, axes = [np.dtype(dtype) for dtype, _ in arrays], [axes for _, axes in arrays]
    return _Plan(_words(kind), array, shape, integer, number, dtypes, axes)


def _planned(kind: Any, at: int, places: dict[str, list[int]], but: str = "") -> list[tuple[str, int]]:
    """The arrays of a table whose first word is number `at`, those of one field left out."""
    found: list[tuple[str, int]] = []
    for name, of in _fields(kind).items():
        if name == but:
            pass
        elif of is float or of is int:
            places[of.__name__].append(at)
        elif _is_table(of):
            found += _planned(of, at, places)
        else:
            found.append(_array(of))
            places["array"].append(at)
            places["shape"] += range(at + 1, at + _words(of))
        at += _words(of)
    return found


def places_of_addresses(kind: Any, but: str = "") -> Array:
    """Which words of a packed table are addresses, one of its fields left out."""
    return _plan(kind, but).addresses


def _gather(tables: Any, arrays: list[Array], integers: list[int], numbers: list[float]) -> None:
    for value in tables:
        if isinstance(value, np.ndarray):
            arrays.append(value)
        elif isinstance(value, tuple):
            _gather(value, arrays, integers, numbers)
        elif isinstance(value, float):
            numbers.append(value)
        else:
            integers.append(value)


def address_of(array: Array) -> int:
    """Address of the first number. `array.ctypes` takes ten times as long, and serves where that does not exist."""
    try:
        return ctypes.addressof(ctypes.c_char.from_buffer(array))  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return array.ctypes.data


def pack(tables: Any, addresses: Sequence[int] = (), but: str = "") -> Array:
    """Addresses and shapes of the arrays of nested named tuples, and their numbers (int64). The arrays must outlive it.

    addresses : of all arrays, which are contiguous, where they are known
    but       : a field that is an empty tuple, of which the words are left open
    """
    kind: Any = type(tables)
    plan, arrays, integers, numbers = _plan(kind, but), list[Array](), list[int](), list[float]()
    _gather(tables, arrays, integers, numbers)
    if [of.dtype for of in arrays] != plan.dtypes or [of.ndim for of in arrays] != plan.axes:
        raise TypeError(f"{kind.__name__} holds an array of another type, or of other axes, than it declares")
    if not addresses and not all(of.flags.c_contiguous for of in arrays):
        raise TypeError(f"{kind.__name__} holds an array that is not contiguous")
    words = np.zeros(plan.words, dtype=np.int64)
    words[plan.addresses] = addresses or [address_of(of) for of in arrays]
    words[plan.shapes] = [size for of in arrays for size in of.shape]
    words[plan.integers], words[plan.numbers] = integers, np.array(numbers, dtype=float).view(np.int64)
    return words


def _words(kind: Any) -> int:
    """How many words `pack` writes for a field."""
    if kind is float or kind is int:
        return 1
    if _is_table(kind):
        return sum(_words(each) for each in _fields(kind).values())
    return 1 + _array(kind)[1]


@cache
def _places(kind: Any) -> dict[str, int]:
    """Field: its first word."""
    sizes = [_words(each) for each in _fields(kind).values()]
    return dict(zip(_fields(kind), accumulate(sizes, initial=0), strict=False))


def place_of(kind: Any, field: str) -> int:
    """The number of a field's first word in a packed table."""
    return _places(kind)[field]


class Packed(types.Type):
    """Compiled code's view of a packed table: its address, from which a field is read where it is used.

    Handed from kernel to kernel it is one word; a tuple of all arrays would be some hundred, which LLVM takes long to see
    through and the machine long to copy.
    """

    def __init__(self, table: Any) -> None:
        self.table = table
        super().__init__(f"Packed({table.__name__})")


@register_model(Packed)
class PackedModel(models.OpaqueModel):  # type: ignore[misc]
    """An address."""


def _numba_type(kind: Any) -> Any:
    if kind is float:
        return types.float64
    if kind is int:
        return types.int64
    if _is_table(kind):
        return Packed(kind)
    dtype, axes = _array(kind)
    return types.Array(getattr(types, dtype), axes, "C")


def _place(table: Any, name: str) -> tuple[Any, int] | None:
    """numba's type of a field and its first word; None where the table has no such field."""
    kind = _fields(table).get(name)
    return None if kind is None else (_numba_type(kind), _places(table)[name])


@cache
def _view(table: type) -> Any:
    """The compiled function that takes an address for that of such a table."""
    result = Packed(table)

    @intrinsic
    def table_at(typing, address):  # type: ignore[no-untyped-def]
        def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
            return builder.inttoptr(args[0], context.get_value_type(result))

        return result(types.int64), generate

    return table_at


@intrinsic
def _address_of(typing, table):  # type: ignore[no-untyped-def]
    """The table that `_view` was given."""

    def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
        return builder.ptrtoint(args[0], context.get_value_type(types.int64))

    return types.int64(table), generate


def _names(table: Any) -> set[str]:
    """Of all fields, those of inner tables, too."""
    fields = _fields(table)
    return set(fields).union(*(_names(kind) for kind in fields.values() if _is_table(kind)))


if PLAIN:
    for _name in sorted(_names(Tables) | _names(Record)):
        plain.define_field(Packed, _name, _address_of, _view, _place)
else:

    @infer_getattr
    class PackedFields(AttributeTemplate):  # type: ignore[misc]
        """Types of the fields."""

        key = Packed

        def generic_resolve(self, value, attr):  # type: ignore[no-untyped-def, override]
            """None where the table has no such field."""
            found = _place(value.table, attr)
            return None if found is None else found[0]

    @lower_getattr_generic(Packed)
    def _read_field(context, builder, typ, value, attr):  # type: ignore[no-untyped-def]
        field, at = _numba_type(_fields(typ.table)[attr]), _places(typ.table)[attr]
        base = builder.bitcast(value, cgutils.intp_t.as_pointer())

        def word(number: int) -> Any:
            loaded = builder.load(builder.gep(base, [cgutils.intp_t(at + number)]))
            loaded.set_metadata("invariant.load", builder.module.add_metadata([]))
            return loaded

        if isinstance(field, Packed):
            return builder.bitcast(builder.gep(base, [cgutils.intp_t(at)]), context.get_value_type(field))
        if isinstance(field, types.Array):
            data = builder.inttoptr(word(0), context.get_data_type(field.dtype).as_pointer())
            return array_at(context, builder, field, data, [word(1 + axis) for axis in range(field.ndim)])
        return builder.bitcast(word(0), context.get_value_type(field)) if field is types.float64 else word(0)
