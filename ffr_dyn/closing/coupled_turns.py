"""Couplings in the turns that drivers tell.

An angle is known up to whole turns, so the row of a coupling holds up to what they make of it: a rack may stand a turn of
its pinion off, a wheel a tooth. Where drivers prescribe a coordinate, couplings and screws carry its value on from joint to
joint.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ffr_dyn.closing.constraints import Constraints
from ffr_dyn.equations.constraint_rows import Block
from ffr_dyn.equations.constraints import Markers, coordinate
from ffr_dyn.scene.followed import TURN, Coordinate, following, relations
from ffr_dyn.scene.joints import RELATION, Word, coordinate_axes, frames
from ffr_dyn.scene.scene import marker_number
from ffr_prep.common.arrays import Array


def relations_off(constraints: Constraints, x: Array) -> Iterator[tuple[int, float, float]]:
    """Of the rows of couplings and screws that stand whole turns off at x, which meets all rows: the number of their function
    among the drives, by how much they are off, and what whole turns make of them."""
    said = relations(constraints.scene)
    if not said:
        return
    rows = {block.name: (word, f) for block, word, f in _rows(constraints) if word.kind == RELATION}
    off = {at: _off(constraints, x, at, value) for at, value in prescribed(constraints).items()}
    for block, first, second, ratio, _ in said:
        if block in rows and first in off:
            word, function = rows[block]
            by = off[second] - ratio * off[first]
            if abs(by) > 0.5 * word.spacing > 0:
                yield function, by, word.spacing


def _rows(constraints: Constraints) -> Iterator[tuple[Block, Word, int]]:
    """All rows, with the numbers of their functions among the drives."""
    functions = iter(constraints.functions.tolist())
    return ((block, word, next(functions)) for block in constraints.blocks for word in block.words)


def prescribed(constraints: Constraints) -> dict[Coordinate, float]:
    """The values of the driven coordinates, and of all that couplings and screws lead to from there."""
    values = {block.name: float(constraints.drives[f, 0]) for block, _, f in _rows(constraints) if block.driver}
    led = ((at, *how) for at, how in following(constraints.scene).items())
    return {at: factor * values[of] + begun for at, of, factor, begun in led if isinstance(of, str)}


def _off(constraints: Constraints, x: Array, at: Coordinate, value: float) -> float:
    """How far a joint coordinate is from a value at x, an angle within half a turn."""
    scene, place = constraints.scene, constraints.place
    joint = next(joint for joint in scene.joints if joint.name == at[0])
    ends = marker_number(scene, joint.i), marker_number(scene, joint.j)
    now = Markers(scene, place, x, np.zeros(place.v_size))
    off = value - coordinate(now, at[1], coordinate_axes(at[1], *frames(joint)), ends).Phi
    return off - TURN * round(off / TURN) if at[1] == "angle" else off
