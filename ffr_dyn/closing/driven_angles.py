"""Driven angles on their own branch.

Newton's method from far away may end anywhere, or nowhere. So where an angle is drawn far from its driver's value it is led
there step by step, as a continuation in that value, with all joints closed (Allgower & Georg, Numerical Continuation Methods,
1990, ch. 2): the shorter way round, and where that is blocked the other. Couplings that stand whole turns off then
(`ffr_dyn.closing.coupled_turns`) are led on in the same way.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ffr_dyn.closing.constraints import Constraints
from ffr_dyn.closing.coupled_turns import relations_off
from ffr_dyn.closing.going_on import going_on
from ffr_dyn.closing.positions import LARGEST_TURN, close_velocities, largest_turn
from ffr_dyn.equations.kinematics import marker_directions
from ffr_dyn.equations.layout import moved, to_body_axes
from ffr_dyn.scene.followed import TURN
from ffr_dyn.scene.joints import DRIVEN_ANGLE
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError

FAR = 1.0  # rad, beyond which an angle is led to its driver's value
STEP = 0.3  # rad
NEAR = 0.2  # of what whole turns make of a coupling: steps in which its row stays with one of its values

Close = Callable[[Constraints, Array], Array]


@dataclass(frozen=True)
class DrivenAngle:
    """Of a driver's word: its function among the drives of the rows, its value and how far on the joint has to turn [rad];
    the same of a coupling, and the steps in which it is led there."""

    function: int
    value: float
    left: float
    step: float = STEP


def driven_angles(constraints: Constraints, x: Array) -> list[DrivenAngle]:
    """All driven angles at x; what is left is within half a turn, and nothing where the joint has no angle."""
    seen = partial(marker_directions, constraints.scene, constraints.place, x)
    functions, found = iter(constraints.functions.tolist()), []
    for block in constraints.blocks:
        for word in block.words:
            function = next(functions)
            if word.kind == DRIVEN_ANGLE:
                f, g = seen(block.markers[0], word.axes[0], word.axes[1])
                (f_j,), value = seen(block.markers[1], word.axes[2]), float(constraints.drives[function, 0])
                left = value - float(np.arctan2(g @ f_j, f @ f_j))
                found.append(DrivenAngle(function, value, left - TURN * round(left / TURN)))
    return found


def led_to_drivers(constraints: Constraints, x: Array, close: Close) -> Array:
    """`close(constraints, x)`, positions that meet all rows, in steps where driven angles at x are far from their drivers'
    values, or no other way leads there; with couplings in the turns that drivers tell, where they can be.

    Raises what `close` does.
    """
    found = _led_there(constraints, x, close)
    off = [
        DrivenAngle(function, float(constraints.drives[function, 0]), by, NEAR * spacing)
        for function, by, spacing in relations_off(constraints, found)
    ]
    try:
        return _led(constraints, off, [one.left for one in off], found, close) if off else found
    except InputError:
        return found


def _led_there(constraints: Constraints, x: Array, close: Close) -> Array:
    angles, errors = driven_angles(constraints, x), list[InputError]()
    if all(abs(angle.left) <= FAR for angle in angles):
        try:
            return close(constraints, x)
        except InputError as error:
            errors.append(error)
    for way in _ways(angles):
        try:
            return _led(constraints, angles, way, x, close)
        except InputError as error:
            errors.append(error)
    raise errors[0]


def _led(
    constraints: Constraints,
    angles: list[DrivenAngle],
    way: list[float],
    x: Array,
    close: Close,
) -> Array:
    """Positions that meet all rows, from x along the ways [rad] of the driven angles."""
    count = int(np.ceil(max(abs(left) / angle.step for angle, left in zip(angles, way, strict=True))))
    found = close(_driven_to(constraints, angles, way, -1.0, 1.0 / max(count, 1)), x)
    for k in range(1, count + 1):
        begun = _driven_to(constraints, angles, way, (k - 1) / count - 1.0, 1.0 / count)
        found = close(_driven_to(constraints, angles, way, k / count - 1.0, 1.0 / count), _ahead(begun, found))
    return found


def _ahead(constraints: Constraints, x: Array) -> Array:
    """x, and in a singular position moved along the branch that the drivers go, from where Newton's method finds it."""
    place = constraints.place
    try:
        v = close_velocities(constraints, x, np.zeros(place.v_size))
    except InputError:
        return x
    step = to_body_axes(place, x, going_on(constraints, x, v))
    singular = not np.array_equal(step, to_body_axes(place, x, v))
    return moved(place, x, step) if singular and largest_turn(place, step) <= LARGEST_TURN else x


def _ways(angles: list[DrivenAngle]) -> Iterator[list[float]]:
    """How far each is turned: the shorter way, then the one that has farthest to go the other way round."""
    left = [angle.left for angle in angles]
    if not any(left):
        return
    yield left
    far = int(np.argmax(np.abs(left)))
    yield [turn - np.copysign(TURN, turn) if k == far else turn for k, turn in enumerate(left)]


def _driven_to(
    constraints: Constraints, angles: list[DrivenAngle], way: list[float], off: float, rate: float
) -> Constraints:
    """The rows with driven angles that are a share of their ways off their values, and move at a rate of it."""
    drives = constraints.drives.copy()
    for angle, left in zip(angles, way, strict=True):
        drives[angle.function] = angle.value + off * left, rate * left, 0.0
    return replace(constraints, drives=drives)
