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


def aligned(tables: T) -> T:
    """Nested named tuples with copies of their arrays in one piece of memory; an array that is there twice stays one."""
    arrays = {id(array): array for array in _arrays(tables)}
    sizes = [-(-array.size // LINE) * LINE for array in arrays.values()]
    memory = np.zeros(sum(sizes) + LINE)
    at = -memory.ctypes.data // 8 % LINE
    copies = {}
    for (key, array), size in zip(arrays.items(), sizes, strict=True):
        copies[key] = memory[at : at + array.size].view(array.dtype).reshape(array.shape)
        copies[key][...] = array
        at += size
    return cast("T", _replaced(tables, copies))


def _arrays(tables: Any) -> list[Array]:
    if isinstance(tables, tuple):
        return [array for field in tables for array in _arrays(field)]
    return [tables] if isinstance(tables, np.ndarray) else []


def _replaced(tables: Any, copies: dict[int, Array]) -> Any:
    if isinstance(tables, tuple):
        fields = [_replaced(field, copies) for field in tables]
        return type(tables)(*fields) if hasattr(tables, "_fields") else tuple(fields)
    return copies[id(tables)] if isinstance(tables, np.ndarray) else tables
