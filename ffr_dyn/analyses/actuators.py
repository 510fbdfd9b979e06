"""Forces whose size an analysis finds or feeds: along a joint coordinate, or at a marker along a direction.

A unit of effort is a set of unit loads, so that a forward run takes what another analysis has found (`as_loads`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ffr_dyn.errors import InputError
from ffr_dyn.forces import Load
from ffr_dyn.joints import COORDINATES, Joint, frames
from ffr_dyn.scene import Scene, marker_number
from ffr_dyn.timefunction import TimeFunction, piecewise

Array = np.ndarray


@dataclass(frozen=True)
class JointForce:
    """A moment [N m] along a joint's angle, or a force [N] along its stroke: on j's body, its opposite on i's body.

    Power is effort times the rate of the coordinate. Raises InputError for another coordinate.
    """

    name: str
    joint: str
    coordinate: str = "angle"

    def __post_init__(self) -> None:
        if self.coordinate not in ("angle", "stroke"):
            raise InputError(
                f"joint force {self.name!r}: coordinate must be 'angle' or 'stroke', not {self.coordinate!r}"
            )


@dataclass(frozen=True)
class MarkerForce:
    """A force [N] (or, with `moment`, a moment [N m]) on a marker along a fixed direction.

    direction : (3,), made a unit vector;  axes : "global", or "body" for one that turns with the marker's body
    """

    name: str
    marker: str
    direction: Any
    axes: str = "global"
    moment: bool = False

    def __post_init__(self) -> None:
        value = np.asarray(self.direction, float)
        if value.shape != (3,) or not np.isfinite(value).all() or not np.linalg.norm(value) > 0:
            raise InputError(f"marker force {self.name!r}: direction must be three numbers, not all zero: {value}")
        object.__setattr__(self, "direction", tuple(float(c) for c in value / np.linalg.norm(value)))
        if self.axes not in ("global", "body"):
            raise InputError(f"marker force {self.name!r}: axes must be 'global' or 'body', not {self.axes!r}")


Actuator = JointForce | MarkerForce


def joint_named(scene: Scene, name: str, who: str) -> Joint:
    """The joint of that name; InputError says who asked."""
    for joint in scene.joints:
        if joint.name == name:
            return joint
    raise InputError(
        f"{who}: there is no joint {name!r}; there are {', '.join(j.name for j in scene.joints) or 'none'}"
    )


def unit(actuator: Actuator) -> str:
    """Unit of the effort."""
    angular = actuator.moment if isinstance(actuator, MarkerForce) else actuator.coordinate == "angle"
    return "N m" if angular else "N"


def unit_loads(scene: Scene, actuator: Actuator) -> list[Load]:
    """The loads of a unit of effort, numbered names. Raises InputError for a joint or marker that does not exist."""
    if isinstance(actuator, MarkerForce):
        marker_number(scene, actuator.marker)
        return [_load(f"{actuator.name}-1", actuator.marker, actuator.direction, actuator.moment, actuator.axes)]
    joint = joint_named(scene, actuator.joint, f"joint force {actuator.name!r}")
    if actuator.coordinate not in COORDINATES[joint.kind]:
        raise InputError(f"joint force {actuator.name!r}: the {joint.kind} joint has no {actuator.coordinate!r}")
    on_i, on_j = frames(joint)
    angular = actuator.coordinate == "angle"
    return [
        _load(f"{actuator.name}-1", joint.j, on_j[:, 2], angular, "body"),
        _load(f"{actuator.name}-2", joint.i, -on_i[:, 2], angular, "body"),
    ]


def _load(name: str, marker: str, direction: Any, angular: bool, axes: str) -> Load:
    along = tuple(float(c) for c in direction)
    nothing = (0.0, 0.0, 0.0)
    return Load(name, marker, nothing if angular else along, along if angular else nothing, axes=axes)


def as_loads(scene: Scene, actuator: Actuator, times: Array, efforts: Array) -> tuple[Load, ...]:
    """The actuator with the efforts (T,) at times (T,) [s] as loads of a scene, splined, held outside."""
    loads = []
    for load in unit_loads(scene, actuator):
        parts = [tuple(_times(c, times, efforts) for c in vector) for vector in (load.force, load.moment)]
        loads.append(Load(load.name, load.marker, parts[0], parts[1], axes=load.axes))
    return tuple(loads)


def _times(factor: float, times: Array, efforts: Array) -> TimeFunction | float:
    return recorded(times, factor * np.asarray(efforts)) if factor else 0.0


def recorded(times: Array, values: Array, *, degree: int = 5) -> TimeFunction:
    """A history (T,) at times (T,) [s] as a function of time: a spline of odd `degree`, smooth enough to drive with.

    Raises InputError for too few rows.
    """
    from scipy.interpolate import PPoly, make_interp_spline

    t, y = np.asarray(times, float), np.asarray(values, float)
    if t.shape != y.shape or t.ndim != 1 or t.size <= degree or not (np.diff(t) > 0).all():
        raise InputError(f"a recorded history needs more than {degree} increasing times and as many values")
    pieces = PPoly.from_spline(make_interp_spline(t, y, k=degree))
    inside = (pieces.x[:-1] < pieces.x[1:]) & (pieces.x[:-1] >= t[0]) & (pieces.x[:-1] < t[-1])
    breaks = np.append(pieces.x[:-1][inside], t[-1])
    return piecewise(breaks, pieces.c[::-1, inside].T)
