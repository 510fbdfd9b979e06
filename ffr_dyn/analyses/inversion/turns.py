"""Whole turns of the angles on which forces act, where states are not evaluated one after another along a path.

A force counts the turns of its angle from the state that was evaluated before. An inversion evaluates states of all times in
any order. There an angle has its turns from a coordinate y, which is continuous, or from the driver that prescribes it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ffr_dyn.consistency.evaluation import Evaluator
from ffr_dyn.functions.time_functions import as_time_function, evaluate
from ffr_dyn.kernels.tables import MEASURED, Record
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.force_kinds import forces_of
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.arrays import Array

EDGE = 0.95 * np.pi  # from where it counts, beyond which an angle that is counted within half a turn may have passed it


@dataclass(frozen=True)
class Angle:
    """The angle of a force: where it is measured, what it is known by (a number in y, a driver, or neither), and what it is
    more than that [rad]."""

    force: str
    slot: int
    number: int | None
    driver: Driver | None
    more: float


def angles_of(at: Evaluator, names: tuple[str, ...], time: float, y: Array) -> tuple[Angle, ...]:
    """The angles on which forces act, of an evaluated state; names : of the joint coordinates in y."""
    scene, loads, found = at.system.scene, at.system.model.loads, list[Angle]()
    for k, force in enumerate(forces_of(scene)):
        if force.place.way != "angle":
            continue
        slot, name = int(loads.row[k, MEASURED]), f"{force.place.joint}.angle"
        number = names.index(name) if name in names else None
        driver = None if number is not None else _driver(scene, force.place.joint)
        plain = Angle(force.name, slot, number, driver, 0.0)
        found.append(Angle(force.name, slot, number, driver, _more(plain, at, time, y)))
    return tuple(found)


def _more(angle: Angle, at: Evaluator, time: float, y: Array) -> float:
    if angle.number is None and angle.driver is None:
        return float(at.system.model.loads.initial[angle.slot])
    return float(at.work.loads.measured[angle.slot]) - _known(angle, time, y)


def _driver(scene: Scene, joint: str) -> Driver | None:
    driven = (d for d in scene.drivers if isinstance(d, Driver) and (d.joint, d.coordinate) == (joint, "angle"))
    return next(driven, None)


def _known(angle: Angle, time: float, y: Array) -> float:
    if angle.number is not None:
        return float(y[angle.number])
    return 0.0 if angle.driver is None else evaluate(as_time_function(angle.driver.function, "driver"), time)[0]


def count_turns(angles: tuple[Angle, ...], at: Evaluator, time: float, y: Array) -> None:
    """Let the forces of an evaluator count from the turns that the angles have at a time with coordinates y."""
    for angle in angles:
        at.work.loads.reference[angle.slot] = angle.more + _known(angle, time, y)


def not_counted(angles: tuple[Angle, ...], record: Record) -> list[str]:
    """Notes on angles whose turns nothing tells, where they come near half a turn."""
    return [
        f"force {angle.force!r} counts its angle within half a turn of {angle.more:.4g} rad: neither a driver nor the "
        "coordinates of the inversion tell its turns; let it act on the angle of a joint that they describe"
        for angle in angles
        if angle.number is None
        and angle.driver is None
        and np.abs(record.forces[:, angle.slot] - angle.more).max(initial=0.0) > EDGE
    ]
