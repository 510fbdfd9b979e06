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
from ffr_dyn.scene.couplings import coupled
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.joints import RELATION, Word, coordinate_axes, frames
from ffr_dyn.scene.scene import Scene, marker_number
from ffr_prep.common.arrays import Array

TURN = 2 * np.pi

Coordinate = tuple[str, str]  # a joint, and "angle" or "stroke"
Relation = tuple[str, Coordinate, Coordinate, float, float]  # of a block: second = ratio first + offset


def relations_off(constraints: Constraints, x: Array) -> Iterator[tuple[int, float, float]]:
    """Of the rows of couplings and screws that stand whole turns off at x, which meets all rows: the number of their function
    among the drives, by how much they are off, and what whole turns make of them."""
    relations = _relations(constraints.scene)
    if not relations:
        return
    rows = {block.name: (word, f) for block, word, f in _rows(constraints) if word.kind == RELATION}
    off = {at: _off(constraints, x, at, value) for at, value in _prescribed(constraints, relations).items()}
    for block, first, second, ratio, _ in relations:
        if block in rows and first in off:
            word, function = rows[block]
            by = off[second] - ratio * off[first]
            if abs(by) > 0.5 * word.spacing > 0:
                yield function, by, word.spacing


def _rows(constraints: Constraints) -> Iterator[tuple[Block, Word, int]]:
    """All rows, with the numbers of their functions among the drives."""
    functions = iter(constraints.functions.tolist())
    return ((block, word, next(functions)) for block in constraints.blocks for word in block.words)


def _relations(scene: Scene) -> list[Relation]:
    found = [(c.name, *coupled(c), c.ratio, c.offset) for c in scene.couplings]
    return found + [
        (j.name, (j.name, "angle"), (j.name, "stroke"), j.pitch / TURN, 0.0) for j in scene.joints if j.pitch
    ]


def _prescribed(constraints: Constraints, relations: list[Relation]) -> dict[Coordinate, float]:
    """The values of the driven coordinates, and of all that couplings and screws lead to from there."""
    values = {block.name: float(constraints.drives[f, 0]) for block, _, f in _rows(constraints) if block.driver}
    drivers = [driver for driver in constraints.scene.drivers if isinstance(driver, Driver)]
    found, before = {(driver.joint, driver.coordinate): values[driver.name] for driver in drivers}, 0
    while len(found) > before:
        before = len(found)
        for _, first, second, ratio, offset in relations:
            if first in found and second not in found:
                found[second] = ratio * found[first] + offset
            elif second in found and first not in found:
                found[first] = (found[second] - offset) / ratio
    return found


def _off(constraints: Constraints, x: Array, at: Coordinate, value: float) -> float:
    """How far a joint coordinate is from a value at x, an angle within half a turn."""
    scene, place = constraints.scene, constraints.place
    joint = next(joint for joint in scene.joints if joint.name == at[0])
    ends = marker_number(scene, joint.i), marker_number(scene, joint.j)
    now = Markers(scene, place, x, np.zeros(place.v_size))
    off = value - coordinate(now, at[1], coordinate_axes(at[1], *frames(joint)), ends).Phi
    return off - TURN * round(off / TURN) if at[1] == "angle" else off
