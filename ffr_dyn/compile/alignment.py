"""Where the arrays of compiled code lie in memory: in one piece, each at the start of a cache line.

A row of eight numbers is one cache line. Arrays that numpy makes begin within one, so that every row is read as two; large
ones all begin at the same place of a page, which the processor takes for one another.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Generic, TypeVar, cast

import numpy as np

from ffr_prep.common.arrays import Array

T = TypeVar("T", bound=tuple[Any, ...])

LINE = 8  # numbers of eight bytes in a cache line


@dataclass(frozen=True)
class Piece(Generic[T]):
    """Nested named tuples with all their arrays in one piece, to be copied as often as wanted.

    numbers : the piece, eight bytes each;  forms : shape, type and beginning [bytes] of every array
    order   : which array each field holds, one field after the other; an array that is there twice stays one
    """

    tables: T
    numbers: Array
    forms: list[tuple[tuple[int, ...], Any, int]]
    order: list[int]


def in_one_piece(tables: T) -> Piece[T]:
    """With the arrays of the tables as they are now."""
    arrays: dict[int, Array] = {}
    fields = list[int]()
    _gather(tables, arrays, fields)
    sizes = [-(-array.size // LINE) * LINE for array in arrays.values()]
    begin = np.concatenate([[0], np.cumsum(sizes, dtype=np.int64)]).tolist()
    numbers = np.zeros(begin[-1], dtype=np.int64)
    forms = [(array.shape, array.dtype, 8 * at) for array, at in zip(arrays.values(), begin, strict=False)]
    for array, (shape, dtype, at) in zip(arrays.values(), forms, strict=True):
        np.ndarray(shape, dtype, numbers, at)[...] = array
    place = {key: number for number, key in enumerate(arrays)}
    return Piece(tables, numbers, forms, [place[key] for key in fields])


def copied(piece: Piece[T]) -> tuple[T, dict[int, int]]:
    """The tables in memory of their own, and the addresses of their arrays, by identity."""
    size = piece.numbers.size
    memory = np.empty(size + LINE, dtype=np.int64)
    first = memory.ctypes.data
    at = -first // 8 % LINE
    memory[at : at + size] = piece.numbers
    copies = [np.ndarray(shape, dtype, memory, 8 * at + begin) for shape, dtype, begin in piece.forms]
    begun = first + 8 * at
    addresses = {id(copy): begun + begin for copy, (_, _, begin) in zip(copies, piece.forms, strict=True)}
    return cast("T", _replaced(piece.tables, copies, iter(piece.order))), addresses


def aligned(tables: T) -> tuple[T, dict[int, int]]:
    """Nested named tuples with copies of their arrays in one piece of memory, and the addresses of these, by identity."""
    return copied(in_one_piece(tables))


def _gather(tables: Any, found: dict[int, Array], fields: list[int]) -> None:
    for field in tables:
        if isinstance(field, np.ndarray):
            found[id(field)] = field
            fields.append(id(field))
        elif isinstance(field, tuple):
            _gather(field, found, fields)


def _replaced(tables: Any, copies: list[Array], order: Iterator[int]) -> Any:
    fields = [
        copies[next(order)]
        if isinstance(field, np.ndarray)
        else _replaced(field, copies, order)
        if isinstance(field, tuple)
        else field
        for field in tables
    ]
    return type(tables)._make(fields) if hasattr(tables, "_fields") else tuple(fields)
