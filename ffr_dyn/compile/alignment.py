"""Where the arrays of compiled code lie in memory: in one piece, each at the start of a cache line.

A row of eight numbers is one cache line. Arrays that numpy makes begin within one, so that every row is read as two; large
ones all begin at the same place of a page, which the processor takes for one another.
"""

from __future__ import annotations

from typing import Any, TypeVar, cast

import numpy as np

from ffr_prep.common.arrays import Array

T = TypeVar("T", bound=tuple[Any, ...])

LINE = 8  # numbers of eight bytes in a cache line


def aligned(tables: T) -> tuple[T, dict[int, int]]:
    """Nested named tuples with copies of their arrays in one piece of memory; an array that is there twice stays one. And the
    addresses of the copies, by their identity."""
    arrays: dict[int, Array] = {}
    _gather(tables, arrays)
    sizes = [-(-array.size // LINE) * LINE for array in arrays.values()]
    memory = np.zeros(sum(sizes) + LINE)
    begin = memory.ctypes.data
    at = -begin // 8 % LINE
    copies, addresses = dict[int, Array](), dict[int, int]()
    for (key, array), size in zip(arrays.items(), sizes, strict=True):
        copy = np.ndarray(array.shape, array.dtype, memory, 8 * at)
        copy[...] = array
        copies[key], addresses[id(copy)] = copy, begin + 8 * at
        at += size
    return cast("T", _replaced(tables, copies)), addresses


def _gather(tables: Any, found: dict[int, Array]) -> None:
    for field in tables:
        if isinstance(field, np.ndarray):
            found[id(field)] = field
        elif isinstance(field, tuple):
            _gather(field, found)


def _replaced(tables: Any, copies: dict[int, Array]) -> Any:
    fields = [
        copies[id(field)]
        if isinstance(field, np.ndarray)
        else _replaced(field, copies)
        if isinstance(field, tuple)
        else field
        for field in tables
    ]
    return type(tables)._make(fields) if hasattr(tables, "_fields") else tuple(fields)
