"""Constraint rows -> the tables that the kernels read: rows, and how the multiplier matrix is assembled and factorised."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from functools import lru_cache

import numpy as np

from ffr_dyn.compile.body_tables import starts
from ffr_dyn.compile.elimination import Elimination
from ffr_dyn.compile.force_tables import FunctionTable
from ffr_dyn.equations.constraint_rows import Block
from ffr_dyn.equations.layout import Layout
from ffr_dyn.equations.second_order import is_second_order
from ffr_dyn.kernels.tables import LANES, WAYS, WORDS, Markers, Pattern, Rows
from ffr_dyn.scene.joints import Word
from ffr_dyn.scene.scene import MarkerName, Scene
from ffr_prep.common.arrays import Array


def moving_bodies(block: Block, table: tuple[MarkerName, ...], ground: int) -> tuple[int, ...]:
    """The bodies that a block ties, each once."""
    return tuple(dict.fromkeys(table[k][0] for k in block.markers if table[k][0] != ground))


def alike(scene: Scene, place: Layout) -> list[Hashable]:
    """Per body, what two bodies have in common whose elastic coordinates couple equal markers equally."""
    return [
        (id(body.model), np.asarray(body.damping).tobytes(), place.normals[b], b if is_second_order(body) else -1)
        for b, body in enumerate(scene.bodies)
    ]


def row_numbers(blocks: tuple[Block, ...], functions: FunctionTable) -> tuple[Array, Array, Array]:
    """`Rows.axes`, `.relation` and `.function` of all blocks; their functions of time go to `functions`."""
    said = [(block, word) for block in blocks for word in block.words]
    function = [
        -1
        if w.function is None
        else functions.add(w.function, f"{'driver' if b.driver else 'joint'} {b.name!r}", derivatives=2)
        for b, w in said
    ]
    axes = np.zeros((len(said), 6, 3))
    for row, (_, word) in enumerate(said):
        axes[row, : len(word.axes)] = word.axes
    relation = np.array([_relation(word) for _, word in said], dtype=float).reshape(-1, 5)
    return axes, relation, np.array(function, dtype=np.int64)


def row_tables(blocks: tuple[Block, ...], axes: Array, relation: Array, function: Array) -> Rows:
    """The rows of all blocks, with these numbers."""
    sides = max((len(block.markers) for block in blocks), default=2)
    marker = np.array([b.markers + (-1,) * (sides - len(b.markers)) for b in blocks], dtype=np.int64).reshape(-1, sides)
    begin = starts([len(b.words) for b in blocks])
    return Rows(
        kind=np.array([WORDS.index(word.kind) for block in blocks for word in block.words], dtype=np.int64),
        axes=axes,
        relation=relation,
        function=function,
        start=begin,
        forced=begin[1:].copy(),
        reaction=np.arange(len(blocks), dtype=np.int64),
        marker=marker,
        first=first_of_each(marker),
    )


def _relation(word: Word) -> tuple[float, ...]:
    """`Rows.relation` of a word."""
    terms = word.relation or ((0.0, "angle"),) * 2
    return *(number for factor, kind in terms for number in (factor, WAYS[kind])), word.spacing


def first_of_each(numbers: Array) -> Array:
    """Of numbers in any order, 1 where one is there for the first time."""
    listed = numbers.ravel().tolist()
    place = {number: k for k, number in reversed(list(enumerate(listed)))}
    return np.array([place[number] == k for k, number in enumerate(listed)], dtype=np.int64).reshape(numbers.shape)


def pattern_of(
    blocks: tuple[Block, ...],
    moving: list[tuple[int, ...]],
    elimination: Elimination,
    marked: Markers,
    equal: Sequence[Hashable],
) -> Pattern:
    """equal : of the bodies, as `alike` tells"""
    number: dict[Hashable, int] = {}
    return _pattern(
        tuple((len(block.words), block.markers) for block in blocks),
        tuple(moving),
        elimination.columns,
        tuple(zip(marked.body.tolist(), marked.start.tolist(), strict=True)),
        tuple(number.setdefault(one, len(number)) for one in equal),
    )


@lru_cache(64)
def _pattern(
    blocks: tuple[tuple[int, tuple[int, ...]], ...],
    moving: tuple[tuple[int, ...], ...],
    columns: tuple[tuple[int, ...], ...],
    marked: tuple[tuple[int, int], ...],
    equal: tuple[int, ...],
) -> Pattern:
    """The last ones are known by these numbers, which are all there is to them: scenes of one structure share theirs.

    blocks : rows and markers of each;  moving : the bodies it ties;  columns : of the elimination
    marked : of each marker its body and where its shapes begin;  equal : bodies with the same number couple markers equally
    """
    offsets: dict[tuple[int, int], int] = {}
    total = 0
    for k, column in enumerate(columns):
        for later in (k, *column):
            offsets[later, k] = total
            total += LANES * blocks[k][0]
    sides = [[marked[marker][0] for marker in markers] for _, markers in blocks]
    pairs = [
        (b, later, side, earlier, other, offsets[later, earlier])
        for earlier in range(len(blocks))
        for later in (earlier, *columns[earlier])
        for b in moving[earlier]
        for side in _where(sides[later], b)
        for other in _where(sides[earlier], b)
    ]
    listed = np.array(sorted(pairs, key=lambda pair: pair[1]), dtype=np.int64).reshape(-1, 6)
    shared = _shared(listed, [markers for _, markers in blocks], marked, equal)
    reach = [max(column, default=k) for k, column in enumerate(columns)]
    updates = [[offsets[a, b] for at, a in enumerate(column) for b in column[: at + 1]] for column in columns]
    stored = [(later, offsets[later, k]) for k, column in enumerate(columns) for later in column]
    pattern = Pattern(
        pair_body=listed[:, 0].copy(),
        pair=np.column_stack([listed[:, 1:], shared]),
        sample=np.unique(shared, return_index=True)[1],
        pair_start=starts(np.bincount(listed[:, 1], minlength=len(blocks)).tolist()),
        reach=np.array(np.maximum.accumulate(reach), dtype=np.int64) if reach else np.zeros(0, dtype=np.int64),
        diagonal=np.array([offsets[k, k] for k in range(len(blocks))], dtype=np.int64),
        column_start=starts([len(column) for column in columns]),
        column=np.array(stored, dtype=np.int64).reshape(-1, 2),
        update_start=starts([len(column) for column in updates]),
        update=np.array([offset for column in updates for offset in column], dtype=np.int64),
    )
    for table in pattern:
        table.setflags(write=False)
    return pattern


def _shared(
    pairs: Array, of: list[tuple[int, ...]], marked: tuple[tuple[int, int], ...], equal: tuple[int, ...]
) -> Array:
    """(P,) numbers of pairs, the same for those of equal markers on equal bodies; `of`: the markers of each block."""
    numbers: dict[Hashable, int] = {}
    return np.array(
        [
            numbers.setdefault((equal[b], marked[of[later][i]][1], marked[of[earlier][j]][1]), len(numbers))
            for b, later, i, earlier, j, _ in pairs.tolist()
        ],
        dtype=np.int64,
    )


def _where(sides: list[int], body: int) -> list[int]:
    return [k for k, b in enumerate(sides) if b == body]
