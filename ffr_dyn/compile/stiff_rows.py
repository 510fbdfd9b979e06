"""Rows of stiff forces beside those of the joints, in the tables of a method that takes forces implicitly.

A force on the coordinate of a joint shares the block of the joint while there are lanes, which then costs next to nothing;
others have blocks of their own, that are ordered for elimination as joints between their markers.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ffr_dyn.compile.alignment import aligned
from ffr_dyn.compile.body_tables import starts
from ffr_dyn.compile.elimination import eliminate
from ffr_dyn.compile.row_tables import alike, first_of_each, moving_bodies, pattern_of
from ffr_dyn.compile.scene_tables import System
from ffr_dyn.compile.structure import Structure
from ffr_dyn.equations.constraint_rows import Block
from ffr_dyn.kernels.simd.table_address import pack
from ffr_dyn.kernels.tables import BLOCK, FORCED, LANE, LANES, Rows
from ffr_dyn.scene.force_kinds import forces_of
from ffr_dyn.scene.joints import Word
from ffr_dyn.scene.scene import markers
from ffr_prep.body import remembered
from ffr_prep.common.arrays import Array

Place = tuple[int, int]  # block and first lane of the rows of a force; -1, -1 where it has none


def with_stiff_rows(system: System) -> System:
    """The system with rows for all its forces that have slopes; itself where there are none.

    Its blocks and rows are others, in another order; all else is shared. Rows of forces are the last of their block.
    """
    blocks, places = _extended(system)
    if all(block < 0 for block, _ in places):
        return system
    table, ground, m = markers(system.scene), len(system.scene.bodies), system.model
    moving = [moving_bodies(block, table, ground) for block in blocks]
    elimination = eliminate([len(block.words) for block in blocks], moving)
    order = elimination.order
    ordered = tuple(blocks[k] for k in order)
    position = {k: at for at, k in enumerate(order)}
    row = m.loads.row.copy()
    row[:, [BLOCK, LANE]] = [(position.get(block, -1), lane) for block, lane in places]
    rows = _reordered(m.rows, ordered, order)
    joint = np.array(sorted({k for b in blocks for k in b.markers if table[k][0] != ground}), dtype=np.int64)
    pattern = pattern_of(
        ordered, [moving[k] for k in order], elimination, m.markers, alike(system.scene, system.layout)
    )
    rows, pattern, joint, row = aligned((rows, pattern, joint, row))
    changed = m._replace(
        rows=rows,
        pattern=pattern,
        markers=m.markers._replace(joint=joint),
        loads=m.loads._replace(row=row),
        stiff_count=int((rows.start[1:] - rows.forced).sum()),
    )
    # Its memory is another one; which rows there are is all that it depends on beside the structure.
    whole = system.structure
    structure = remembered(whole, ("stiff rows", tuple(places)), lambda: Structure(whole.shared))
    return replace(
        system, blocks=ordered, elimination=elimination, model=changed, words=pack(changed), structure=structure
    )


def _extended(system: System) -> tuple[list[Block], list[Place]]:
    """The blocks with the rows of forces, new ones last, and the places of all forces."""
    blocks, places = list(system.blocks), []
    for force in forces_of(system.scene):
        count = len(force.stiff_coordinates)
        if count == 0:
            places.append((-1, -1))
            continue
        ends = force.place.ends(system.scene)
        k = next((k for k, block in enumerate(blocks) if _has_room(block, ends, count)), len(blocks))
        if k == len(blocks):
            blocks.append(Block(force.name, ends, ()))
        places.append((k, len(blocks[k].words)))
        own = Word("force", f"the coordinate of force {force.name!r}", np.zeros((3, 3)))
        blocks[k] = replace(blocks[k], words=blocks[k].words + (own,) * count)
    return blocks, places


def _has_room(block: Block, ends: tuple[int, int], count: int) -> bool:
    """Whether a block is between two markers, in their order, and has lanes left."""
    return block.markers[:2] == ends and set(block.markers) == set(ends) and len(block.words) + count <= LANES


def _reordered(rows: Rows, blocks: tuple[Block, ...], order: tuple[int, ...]) -> Rows:
    """The rows of blocks of which number order[k] was the old number, or is beyond them."""
    old, own = len(rows.forced), [sum(word.kind != "force" for word in block.words) for block in blocks]
    begin = starts([len(block.words) for block in blocks])
    source = np.full(begin[-1], -1)
    for at, k in enumerate(order):
        if k < old:
            source[begin[at] : begin[at] + own[at]] = np.arange(rows.start[k], rows.start[k + 1])
    sides = rows.marker.shape[1]
    marker = np.array([b.markers + (-1,) * (sides - len(b.markers)) for b in blocks], dtype=np.int64)
    return Rows(
        kind=_taken(rows.kind, source, FORCED),
        axes=_taken(rows.axes, source, 0.0),
        relation=_taken(rows.relation, source, 0.0),
        function=_taken(rows.function, source, -1),
        start=begin,
        forced=begin[:-1] + np.array(own, dtype=np.int64),
        reaction=np.array([k if k < old else -1 for k in order], dtype=np.int64),
        marker=marker,
        first=first_of_each(marker),
    )


def _taken(table: Array, source: Array, fill: float) -> Array:
    """Rows of a table by number, and `fill` for -1."""
    blank = np.full((1, *table.shape[1:]), fill, dtype=table.dtype)
    taken: Array = np.concatenate([table, blank])[source]
    return taken
