"""Where the arrays of compiled code lie in memory: in one piece, each at the start of a cache line.

A row of eight numbers is one cache line. Arrays that numpy makes begin within one, so that every row is read as two; large
ones all begin at the same place of a page, which the processor takes for one another.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import accumulate
from typing import Any, Generic, TypeVar

import numpy as np

from ffr_dyn.kernels.simd.table_address import address_of, pack, places_of_addresses
from ffr_prep.common.arrays import Array

T = TypeVar("T", bound=tuple[Any, ...])

LINE = 8  # numbers of eight bytes in a cache line


@dataclass(frozen=True)
class Form:
    """Where arrays begin in a piece [bytes], and the piece as one number of a structured type, whose fields they are."""

    begin: list[int]
    whole: np.dtype[Any]


@dataclass(frozen=True)
class Piece(Generic[T]):
    """Nested named tuples with all their arrays in one piece, to be copied as often as wanted.

    words : as `pack` writes them;  numbers : the piece, eight bytes each
    form  : of the arrays
    order : which array each field holds, one field after the other; an array that is there twice stays one
    places : of the addresses among the words
    """

    tables: T
    words: Array
    numbers: Array
    form: Form
    order: list[int]
    places: Array


def aligned(tables: T) -> T:
    """Nested named tuples with copies of their arrays in one piece."""
    return _laid_out(tables)[0]


def in_one_piece(tables: T, but: str = "") -> Piece[T]:
    """Tables with their arrays as they are now, of a kind that `pack` knows.

    but : a field that is an empty tuple, of which the words are left open
    """
    made, numbers, form, order = _laid_out(tables)
    address = address_of(numbers)
    words = pack(made, [address + form.begin[k] for k in order], but)
    return Piece(made, words, numbers, form, order, places_of_addresses(type(made), but))


def copied(piece: Piece[T]) -> tuple[T, Array]:
    """The tables in memory of their own, and their words."""
    numbers, words = _room(piece.numbers.size), piece.words.copy()
    numbers[:] = piece.numbers
    words[piece.places] += address_of(numbers) - address_of(piece.numbers)
    return _replaced(piece.tables, _views(numbers, piece.form), iter(piece.order)), words


def _laid_out(tables: T) -> tuple[T, Array, Form, list[int]]:
    """`Piece.tables` and what follows its words."""
    arrays, fields = dict[int, Array](), list[int]()
    _gather(tables, arrays, fields)
    form = _form(tuple((array.dtype, array.shape) for array in arrays.values()))
    numbers, place = _room(form.whole.itemsize // 8), {key: number for number, key in enumerate(arrays)}
    views, order = _views(numbers, form), [place[key] for key in fields]
    for view, array in zip(views, arrays.values(), strict=True):
        view[...] = array
    return _replaced(tables, views, iter(order)), numbers, form, order


@lru_cache(256)
def _form(arrays: tuple[tuple[np.dtype[Any], tuple[int, ...]], ...]) -> Form:
    """Of types and shapes of arrays; scenes of one structure have the same."""
    lines = (-(-math.prod(shape) // LINE) * LINE for _, shape in arrays)
    *begin, end = accumulate((8 * size for size in lines), initial=0)
    names = [str(number) for number in range(len(arrays))]
    whole = {"names": names, "formats": arrays, "offsets": begin, "itemsize": end}
    return Form(begin, np.dtype(whole))  # type: ignore[call-overload]


def _room(size: int) -> Array:
    """(size,) numbers from the start of a cache line."""
    memory = np.zeros(size + LINE, dtype=np.int64)
    at = -address_of(memory) // 8 % LINE
    return memory[at : at + size]


def _views(numbers: Array, form: Form) -> tuple[Array, ...]:
    """Fields of a structured number are arrays in its memory, which is a third of the work of making one after the other."""
    return np.ndarray((), form.whole, numbers).item()  # type: ignore[no-any-return]


def _gather(tables: Any, found: dict[int, Array], fields: list[int]) -> None:
    for field in tables:
        if isinstance(field, np.ndarray):
            found[id(field)] = field
            fields.append(id(field))
        elif isinstance(field, tuple):
            _gather(field, found, fields)


def _replaced(tables: Any, arrays: Sequence[Array], order: Iterator[int]) -> Any:
    fields = [
        arrays[next(order)]
        if isinstance(field, np.ndarray)
        else _replaced(field, arrays, order)
        if isinstance(field, tuple)
        else field
        for field in tables
    ]
    return type(tables)._make(fields) if hasattr(tables, "_fields") else tuple(fields)
