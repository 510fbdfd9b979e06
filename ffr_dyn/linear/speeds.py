"""Scenes at a speed: lists of speeds as text, and what turns at them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ffr_dyn.functions.time_functions import as_time_function, evaluate, polynomial
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.joints import COORDINATES
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.errors import InputError
from ffr_prep.common.reading import check_count
from ffr_prep.common.units import split_quantity, to_si

_MOST = 10_000  # speeds: each is a steady motion of its own
EVEN = 21  # speeds of a range that does not say how many


def speed_list(texts: Sequence[Any]) -> tuple[float, ...]:
    """[rad/s] of numbers and texts: "314", "3000 rpm", "0..500" (21 of them), "0..6000 rpm:13" (13 of them).

    Raises InputError for any other text, with the forms that there are.
    """
    if not isinstance(texts, Iterable) or isinstance(texts, str):
        raise InputError(f"speeds are {texts!r}; give them in a list, such as [100, 200] or ['0..500']")
    found = [speed for text in texts for speed in _speeds(text)]
    if not np.isfinite(found).all():
        raise InputError(f"speeds {list(texts)}: a speed must be finite")
    return tuple(found)


def _speeds(text: Any) -> list[float]:
    if not isinstance(text, str):
        return [float(text)]
    ends, colon, count = text.partition(":")
    first, dots, last = ends.partition("..")
    try:
        if not dots:
            if colon:
                raise ValueError
            return [_speed(first)]
        unit = split_quantity(last.strip())
        low = _speed(first) if split_quantity(first.strip()) or unit is None else to_si(float(first), unit[1], "rad/s")
        many = int(count) if colon else EVEN
        check_count(many, "speeds", _MOST)
        return np.linspace(low, _speed(last), many).tolist()
    except (ValueError, InputError) as error:
        why = f" ({error})" if isinstance(error, InputError) else ""
        raise InputError(
            f"speed {text!r} is not understood{why}: write 314 [rad/s], '3000 rpm', '0..500' or '0..6000 rpm:13', the last "
            "for thirteen speeds from none to 6000 rpm"
        ) from None


def _speed(text: str) -> float:
    quantity = split_quantity(text.strip())
    return float(text) if quantity is None else to_si(*quantity, "rad/s")


def at_speed(scene: Scene, speed: float, turn: str = "", time: float = 0.0) -> Scene:
    """The scene with a driver turning evenly at a speed [rad/s], from where it is at `time` [s].

    turn : name of the driver, with whose rate the velocities of all bodies are scaled, or the joint coordinate that
    is turned, such as "hinge.angle"; without it the only driver of
           the scene, or, where there is none, the velocities of the scene as they are but for their size: its largest spin
           has the speed

    Raises InputError where nothing is there to turn.
    """
    names = [driver.name for driver in scene.drivers if isinstance(driver, Driver)]
    if not turn and len(names) > 1:
        raise InputError(
            f"the scene has the drivers {', '.join(names)}; say which of them has the speed (turn, --turn)"
        )
    chosen = turn or (names[0] if names else "")
    if chosen in names:
        turned = (_turned(d, speed, time) if d.name == chosen else d for d in scene.drivers)
        before = next(_rate(d, time) for d in scene.drivers if d.name == chosen)
        return replace(_times(scene, speed / before) if before else scene, drivers=tuple(turned))
    return _with_driver(scene, chosen, speed, time) if chosen else _scaled(scene, speed)


def _rate(driver: Any, time: float) -> float:
    return evaluate(as_time_function(driver.function, "function of time"), time)[1]


def _turned(driver: Any, speed: float, time: float) -> Any:
    at = evaluate(as_time_function(driver.function, "function of time"), time)[0]
    return replace(driver, function=polynomial(at - speed * time, speed))


def _with_driver(scene: Scene, turn: str, speed: float, time: float) -> Scene:
    joint, _, coordinate = turn.partition(".")
    named = {one.name: one for one in scene.joints}
    coordinate = coordinate or "angle"
    if joint not in named or coordinate not in COORDINATES[named[joint].kind]:
        there = [f"{one.name}.{c}" for one in scene.joints for c in COORDINATES[one.kind]]
        drivers = [driver.name for driver in scene.drivers]
        raise InputError(
            f"turn {turn!r} is no driver and no coordinate of a joint; there are {', '.join([*drivers, *there]) or 'none'}"
        )
    driver = Driver(f"{joint}_at_speed", joint, polynomial(-speed * time, speed), coordinate=coordinate)
    return replace(scene, drivers=(*scene.drivers, driver))


def _scaled(scene: Scene, speed: float) -> Scene:
    largest = max(float(np.linalg.norm(body.omega_bar)) for body in scene.bodies)
    if not largest:
        raise InputError(
            "nothing turns in the scene: give a driver, or bodies with omega_bar, or say which joint turns (turn, --turn)"
        )
    return _times(scene, speed / largest)


def _times(scene: Scene, share: float) -> Scene:
    """The scene with all velocities of its bodies times a share: of what no joint ties to what is driven."""
    bodies = (replace(b, velocity=share * b.velocity, omega_bar=share * b.omega_bar) for b in scene.bodies)
    return replace(scene, bodies=tuple(bodies))
