"""Scenes at another state: where a result has left them, and with their drivers held still."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ffr_dyn.functions.time_functions import as_time_function, constant, evaluate
from ffr_dyn.results.result import Result
from ffr_dyn.scene.drivers import Driver, PointDriver
from ffr_dyn.scene.forces.places import OnJoint
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene, require_scene
from ffr_prep.common.errors import InputError


def scene_at(scene: Scene, result: Result, row: int = -1) -> Scene:
    """The scene with its bodies where a row of a result has them, moving as they do there.

    Springs, stops and servos on angles keep the whole turns that they have counted by then.

    Raises InputError for a row that the result has not, and where it lacks the bodies' R, p, v and omega_bar, or the angle
    of such a force.

    >>> later = fd.scene_at(scene, result)  # as it is at the end
    """
    rows = len(result.time)
    if not -rows <= row < rows:
        raise InputError(f"the result has no row {row}; give one of 0 to {rows - 1}, or -1 for the last")
    return replace(
        scene,
        bodies=tuple(_body_at(body, result, row) for body in scene.bodies),
        forces=tuple(_force_at(force, result, row) for force in scene.forces),
    )


def _body_at(body: Body, result: Result, row: int) -> Body:
    now = {key: result[f"{body.name}.{name}"][row] for key, name in _HISTORIES.items()}
    elastic = {key: result[f"{body.name}.{key}"][row] for key in ("q", "q_dot") if body.model.n}
    return replace(body, **now, **elastic)


def _force_at(force: Any, result: Result, row: int) -> Any:
    """With its whole turns: the poses of the bodies tell an angle within half a turn."""
    if not (hasattr(force, "turns") and isinstance(force.place, OnJoint) and force.place.coordinate == "angle"):
        return force
    return replace(force, turns=round(float(result[f"{force.name}.angle"][row]) / (2 * np.pi)))


_HISTORIES = {"position": "R", "rotation": "p", "velocity": "v", "omega_bar": "omega_bar"}


def held(scene: Scene, time: float) -> Scene:
    """The scene with every driver and every length that is a function of time held at its value at `time` [s], at rest.

    Raises InputError for an argument that is no scene.

    >>> result = fd.forward(fd.held(scene, 0.1), end=1.0, output_step=0.01)
    """
    require_scene(scene)
    at_rest = replace(
        scene,
        joints=tuple(_held_joint(joint, time) for joint in scene.joints),
        drivers=tuple(_held_driver(driver, time) for driver in scene.drivers),
    )
    return replace(at_rest, bodies=tuple(_at_rest(body) for body in scene.bodies))


def _at_rest(body: Body) -> Body:
    return replace(body, velocity=(0.0, 0.0, 0.0), omega_bar=(0.0, 0.0, 0.0), q_dot=None)


def _held_joint(joint: Joint, time: float) -> Joint:
    return joint if joint.length is None else replace(joint, length=_value(joint.length, time))


def _held_driver(driver: Driver | PointDriver, time: float) -> Driver | PointDriver:
    if isinstance(driver, Driver):
        return replace(driver, function=constant(_value(driver.function, time)))
    still: dict[str, Any] = {c: _value(f, time) for c in "xyz" if (f := getattr(driver, c)) is not None}
    return replace(driver, **still)


def _value(function: Any, time: float) -> float:
    return evaluate(as_time_function(function, "function of time"), time)[0]
