"""Driven angles on their own branch.

Newton's method from far away may end anywhere, or nowhere. So where an angle is drawn far from its driver's value it is led
there step by step, as a continuation in that value, with all joints closed (Allgower & Georg, Numerical Continuation Methods,
1990, ch. 2): the shorter way round, and where that is blocked the other.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ffr_dyn.closing.constraints import Constraints
from ffr_dyn.equations.kinematics import marker_direction
from ffr_dyn.scene.joints import DRIVEN_ANGLE
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError

FAR = 1.0  # rad, beyond which an angle is led to its driver's value
STEP = 0.3  # rad
TURN = 2 * np.pi


@dataclass(frozen=True)
class DrivenAngle:
    """Of a driver's word: its function among the drives of the rows, its value and how far on the joint has to turn [rad]."""

    function: int
    value: float
    left: float


def driven_angles(constraints: Constraints, x: Array) -> list[DrivenAngle]:
    """All driven angles at x; what is left is within half a turn, and nothing where the joint has no angle."""
    seen = partial(marker_direction, constraints.scene, constraints.place, x)
    functions, found = iter(constraints.functions.tolist()), []
    for block in constraints.blocks:
        for word in block.words:
            function = next(functions)
            if word.kind == DRIVEN_ANGLE:
                f, g = (seen(block.markers[0], word.axes[k]) for k in (0, 1))
                f_j, value = seen(block.markers[1], word.axes[2]), float(constraints.drives[function, 0])
                left = value - float(np.arctan2(g @ f_j, f @ f_j))
                found.append(DrivenAngle(function, value, left - TURN * round(left / TURN)))
    return found


def led_to_drivers(constraints: Constraints, x: Array, close: Callable[[Constraints, Array], Array]) -> Array:
    """`close(constraints, x)`, positions that meet all rows, in steps where driven angles at x are far from their drivers'
    values.

    Raises what `close` does.
    """
    angles = driven_angles(constraints, x)
    if all(abs(angle.left) <= FAR for angle in angles):
        return close(constraints, x)
    errors = []
    for way in _ways(angles):
        found, count = x, int(np.ceil(max(abs(left) for left in way) / STEP))
        try:
            for k in range(count + 1):
                found = close(_driven_to(constraints, angles, [(k / count - 1.0) * left for left in way]), found)
        except InputError as error:
            errors.append(error)
        else:
            return found
    raise errors[0]


def _ways(angles: list[DrivenAngle]) -> Iterator[list[float]]:
    """How far each is turned: the shorter way, then the one that has farthest to go the other way round."""
    left = [angle.left for angle in angles]
    yield left
    far = int(np.argmax(np.abs(left)))
    yield [turn - np.copysign(TURN, turn) if k == far else turn for k, turn in enumerate(left)]


def _driven_to(constraints: Constraints, angles: list[DrivenAngle], off: list[float]) -> Constraints:
    """The rows with driven angles that are off their values."""
    drives = constraints.drives.copy()
    for angle, less in zip(angles, off, strict=True):
        drives[angle.function] = angle.value + less, 0.0, 0.0
    return replace(constraints, drives=drives)
