"""Where the arrays of compiled code lie in memory: in one piece, each at the start of a cache line.

A row of eight numbers is one cache line. Arrays that numpy makes begin within one, so that every row is read as two; large
ones all begin at the same place of a page, which the processor takes for one another.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import accumulate
from typing import Any, Generic, TypeVar

import numpy as np

from ffr_dyn.kernels.simd.table_address import address_of, pack, places_of_addresses
from ffr_prep.common.arrays import Array

T = TypeVar("T", bound=tuple[Any, ...])
Form = tuple[tuple[int, ...], Any, int]

LINE = 8  # numbers of eight bytes in a cache line


@dataclass(frozen=True)
class Piece(Generic[T]):
    """Nested named tuples with all their arrays in one piece, to be copied as often as wanted.

    words : as `pack` writes them;  numbers : the piece, eight bytes each
    forms : shape, type and beginning [bytes] of every array
    order : which array each field holds, one field after the other; an array that is there twice stays one
    places : of the addresses among the words
    """

    tables: T
    words: Array
    numbers: Array
    forms: list[Form]
    order: list[int]
    places: Array


def aligned(tables: T) -> T:
    """Nested named tuples with copies of their arrays in one piece."""
    return _laid_out(tables)[0]


def in_one_piece(tables: T, but: str = "") -> Piece[T]:
    """Tables with their arrays as they are now, of a kind that `pack` knows.

    but : a field that is an empty tuple, of which the words are left open
    """
    made, numbers, forms, order = _laid_out(tables)
    address = address_of(numbers)
    words = pack(made, [address + forms[k][2] for k in order], but)
    return Piece(made, words, numbers, forms, order, places_of_addresses(type(made), but))


def copied(piece: Piece[T]) -> tuple[T, Array]:
    """The tables in memory of their own, and their words."""
    numbers, words = _room(piece.numbers.size), piece.words.copy()
    numbers[:] = piece.numbers
    words[piece.places] += address_of(numbers) - address_of(piece.numbers)
    return _replaced(piece.tables, _views(numbers, piece.forms), iter(piece.order)), words


def _laid_out(tables: T) -> tuple[T, Array, list[Form], list[int]]:
    """`Piece.tables` and what follows its words."""
    arrays, fields = dict[int, Array](), list[int]()
    _gather(tables, arrays, fields)
    begin = list(accumulate((-(-array.size // LINE) * LINE for array in arrays.values()), initial=0))
    forms = [(array.shape, array.dtype, 8 * at) for array, at in zip(arrays.values(), begin, strict=False)]
    numbers, place = _room(begin[-1]), {key: number for number, key in enumerate(arrays)}
    views, order = _views(numbers, forms), [place[key] for key in fields]
    for view, array in zip(views, arrays.values(), strict=True):
        view[...] = array
    return _replaced(tables, views, iter(order)), numbers, forms, order


def _room(size: int) -> Array:
    """(size,) numbers from the start of a cache line."""
    memory = np.zeros(size + LINE, dtype=np.int64)
    at = -address_of(memory) // 8 % LINE
    return memory[at : at + size]


def _views(numbers: Array, forms: list[Form]) -> list[Array]:
    return [np.ndarray(shape, dtype, numbers, begin) for shape, dtype, begin in forms]


def _gather(tables: Any, found: dict[int, Array], fields: list[int]) -> None:
    for field in tables:
        if isinstance(field, np.ndarray):
            found[id(field)] = field
            fields.append(id(field))
        elif isinstance(field, tuple):
            _gather(field, found, fields)


def _replaced(tables: Any, arrays: list[Array], order: Iterator[int]) -> Any:
    fields = [
        arrays[next(order)]
        if isinstance(field, np.ndarray)
        else _replaced(field, arrays, order)
        if isinstance(field, tuple)
        else field
        for field in tables
    ]
    return type(tables)._make(fields) if hasattr(tables, "_fields") else tuple(fields)
