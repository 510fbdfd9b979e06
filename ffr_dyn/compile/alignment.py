"""Where the arrays of compiled code lie in memory: in one piece, each at the start of a cache line.

A row of eight numbers is one cache line. Arrays that numpy makes begin within one, so that every row is read as two; large
ones all begin at the same place of a page, which the processor takes for one another.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
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
class Plan:
    """How a named tuple is made of a list of arrays and other values: which of these its fields are, or plans of their own.

    An array that is there twice stays one.
    """

    make: Callable[[Iterable[Any]], Any]
    fields: list[int | Plan]


@dataclass(frozen=True)
class Piece(Generic[T]):
    """Nested named tuples with all their arrays in one piece, to be copied as often as wanted.

    words : as `pack` writes them;  numbers : the piece, eight bytes each
    form  : of the arrays;  others : values of fields that are none;  plan : of the tables, from arrays and others
    places : of the addresses among the words
    """

    tables: T
    words: Array
    numbers: Array
    form: Form
    others: list[Any]
    plan: Plan
    places: Array


def aligned(tables: T) -> T:
    """Nested named tuples with copies of their arrays in one piece."""
    return _laid_out(tables)[0]


def in_one_piece(tables: T, but: str = "") -> Piece[T]:
    """Tables with their arrays as they are now, of a kind that `pack` knows.

    but : a field that is an empty tuple, of which the words are left open
    """
    made, numbers, form, others, plan = _laid_out(tables)
    address = address_of(numbers)
    words = pack(made, [address + form.begin[k] for k in _order(plan) if k < len(form.begin)], but)
    return Piece(made, words, numbers, form, others, plan, places_of_addresses(type(made), but))


def copied(piece: Piece[T]) -> tuple[T, Array]:
    """The tables in memory of their own, and their words."""
    numbers, words = _room(piece.numbers.size), piece.words.copy()
    numbers[:] = piece.numbers
    words[piece.places] += address_of(numbers) - address_of(piece.numbers)
    return _made(piece.plan, [*_views(numbers, piece.form), *piece.others]), words


def _laid_out(tables: T) -> tuple[T, Array, Form, list[Any], Plan]:
    """`Piece.tables` and what follows its words."""
    values = {id(value): value for value in _leaves(tables)}
    arrays = {key: value for key, value in values.items() if isinstance(value, np.ndarray)}
    others = {key: value for key, value in values.items() if key not in arrays}
    form = _form(tuple((array.dtype, array.shape) for array in arrays.values()))
    numbers = _room(form.whole.itemsize // 8)
    views = _views(numbers, form)
    for view, array in zip(views, arrays.values(), strict=True):
        view[...] = array
    plan = _planned(tables, {key: number for number, key in enumerate([*arrays, *others])})
    rest = list(others.values())
    return _made(plan, [*views, *rest]), numbers, form, rest, plan


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


def _leaves(tables: Any) -> Iterator[Any]:
    """What the fields of nested tuples hold, one after the other."""
    for field in tables:
        if isinstance(field, tuple):
            yield from _leaves(field)
        else:
            yield field


def _planned(tables: Any, number: dict[int, int]) -> Plan:
    """number : of each value, by its identity"""
    fields = [_planned(field, number) if isinstance(field, tuple) else number[id(field)] for field in tables]
    return Plan(type(tables)._make if hasattr(tables, "_fields") else tuple, fields)


def _made(plan: Plan, values: list[Any]) -> Any:
    return plan.make(_made(field, values) if isinstance(field, Plan) else values[field] for field in plan.fields)


def _order(plan: Plan) -> Iterator[int]:
    """Numbers of the values, field by field."""
    for field in plan.fields:
        yield from _order(field) if isinstance(field, Plan) else (field,)
