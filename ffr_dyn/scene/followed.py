"""Which joint coordinates tell the whole turns of which others: an angle is known up to whole turns, a coupling is not."""

from __future__ import annotations

import numpy as np

from ffr_dyn.scene.couplings import coupled
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.scene import Scene

TURN = 2 * np.pi

Coordinate = tuple[str, str]  # a joint, and "angle" or "stroke"
Relation = tuple[str, Coordinate, Coordinate, float, float]  # of a coupling or joint: second = ratio first + offset
Follows = tuple[
    str | Coordinate, float, float
]  # a driver or a coordinate, the factor by which it is followed, and an offset


def relations(scene: Scene) -> list[Relation]:
    """What couplings and screws say."""
    found = [(c.name, *coupled(c), c.ratio, c.offset) for c in scene.couplings]
    return found + [
        (j.name, (j.name, "angle"), (j.name, "stroke"), j.pitch / TURN, 0.0) for j in scene.joints if j.pitch
    ]


def following(scene: Scene) -> dict[Coordinate, Follows]:
    """The driven coordinates, the strokes that couplings and screws tie to others, and all that follows of these, drivers
    first."""
    said = relations(scene)
    drivers = [driver for driver in scene.drivers if isinstance(driver, Driver)]
    found: dict[Coordinate, Follows] = {(d.joint, d.coordinate): (d.name, 1.0, 0.0) for d in drivers}
    _carry_on(said, found)
    strokes = [at for _, first, second, _, _ in said for at in (first, second) if at[1] == "stroke"]
    found |= {at: (at, 1.0, 0.0) for at in strokes if at not in found}
    _carry_on(said, found)
    return found


def _carry_on(said: list[Relation], found: dict[Coordinate, Follows]) -> None:
    """Add what relations lead to from there."""
    before = 0
    while len(found) > before:
        before = len(found)
        for _, first, second, ratio, offset in said:
            if first in found and second not in found:
                of, factor, begun = found[first]
                found[second] = of, ratio * factor, ratio * begun + offset
            elif second in found and first not in found:
                of, factor, begun = found[second]
                found[first] = of, factor / ratio, (begun - offset) / ratio
