"""Efforts: forces whose size an analysis finds or feeds, along a joint coordinate or at a marker along a direction.

In a scene an effort is an `Actuator` or a `Load` like any other, so that a forward run takes what another analysis has found
(`with_effort`); while an analysis looks for it, its size is a number in the compiled tables (`sized`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ffr_dyn.compile.engine import with_model
from ffr_dyn.consistency.evaluation import Evaluator
from ffr_dyn.equations.forces import At, applied_by
from ffr_dyn.equations.layout import velocity_sizes
from ffr_dyn.functions.operations import MULTIPLY
from ffr_dyn.functions.time_functions import TimeFunction, constant, numbers_in, operation, piecewise
from ffr_dyn.kernels.tables import LAW
from ffr_dyn.scene.checks import check_marker, check_name, check_own_name
from ffr_dyn.scene.force_kinds import forces_of
from ffr_dyn.scene.forces import Actuator, Load
from ffr_dyn.scene.scene import Scene, length_of
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError

if TYPE_CHECKING:
    from scipy.interpolate import PPoly


@dataclass(frozen=True)
class JointEffort:
    """A moment [N m] along a joint's angle, or a force [N] along its stroke: on j's body, its opposite on i's body.

    Power is effort times the rate of the coordinate. Raises InputError for another coordinate.

    joint : name of the joint
    coordinate : "angle" or "stroke"

    >>> torque = fd.JointEffort("torque", "hinge")
    """

    name: str
    joint: str
    coordinate: str = "angle"

    def __post_init__(self) -> None:
        check_own_name("effort", self.name)
        check_name(f"effort {self.name!r}", "joint", self.joint)
        if self.coordinate not in ("angle", "stroke"):
            raise InputError(f"effort {self.name!r}: coordinate must be 'angle' or 'stroke', not {self.coordinate!r}")


@dataclass(frozen=True)
class MarkerEffort:
    """A force [N] (or, with `moment`, a moment [N m]) on a marker along a fixed direction.

    marker : "body.interface"
    moment : true for a moment [N m] in place of a force
    direction : (3,), made a unit vector;  axes : "global", or "body" for one that turns with the marker's body

    Raises InputError for a direction of no length, and other axes.

    >>> push = fd.MarkerEffort("push", "rod.tip", direction=(1, 0, 0))
    """

    name: str
    marker: str
    direction: Any
    axes: str = "global"
    moment: bool = False

    def __post_init__(self) -> None:
        check_own_name("effort", self.name)
        check_marker(f"effort {self.name!r}", "marker", self.marker)
        value = np.asarray(self.direction, float)
        if value.shape != (3,) or not np.isfinite(value).all() or not np.linalg.norm(value) > 0:
            raise InputError(f"effort {self.name!r}: direction must be three numbers, not all zero: {value}")
        object.__setattr__(self, "direction", tuple(float(c) for c in value / np.linalg.norm(value)))
        if self.axes not in ("global", "body"):
            raise InputError(f"effort {self.name!r}: axes must be 'global' or 'body', not {self.axes!r}")


Effort = JointEffort | MarkerEffort


def unit(effort: Effort) -> str:
    """Unit of the effort."""
    angular = effort.moment if isinstance(effort, MarkerEffort) else effort.coordinate == "angle"
    return "N m" if angular else "N"


def work_of(now: At, inertia: Array) -> float:
    """[N m] of the largest generalised force in a motion by the size of a body: of forces, weights, springs within bodies and
    `inertia` (V,), which may be in balance."""
    scene, place, total = now.scene, now.place, np.abs(inertia)
    for force in forces_of(scene):
        total = total + np.abs(applied_by(now, force).generalised)
    for b, body in enumerate(scene.bodies):
        total[place.R_dot(b)] += body.model.mass * np.linalg.norm(scene.gravity)
        total[place.q_dot(b)] += body.model.omega2 * np.abs(now.x[place.q(b)])
    return float((total * velocity_sizes(scene, place)).max())


def with_work(scene: Scene, efforts: tuple[Effort, ...], work: float) -> Array:
    """(U,) [N, N m] efforts of about one work [N m] in a motion by the size of the scene, or by a radian: added to forces of
    such a work they are not lost in its rounding, as one newton is beside the weight of a ship."""
    return np.array([work if unit(effort) == "N m" else work / length_of(scene) for effort in efforts])


def with_effort(scene: Scene, effort: Effort, times: Array, values: Array) -> Scene:
    """The scene with an effort of the values (T,) at times (T,) [s], splined, held outside; to be run forward.

    Raises InputError for too few rows, times that do not increase, and values that are not one for each time.

    >>> forward = fd.with_effort(scene, torque, result.time, result["torque.effort"])
    """
    return with_function(scene, effort, recorded(times, values))


def with_function(scene: Scene, effort: Effort, size: TimeFunction) -> Scene:
    """The scene with an effort that is a function of time."""
    if isinstance(effort, JointEffort):
        return _with_actuator(scene, effort, size)

    def component(c: float) -> TimeFunction:
        return size if c == 1.0 else operation(MULTIPLY, constant(c), size)

    return replace(scene, loads=(*scene.loads, _load(effort, component)))


def with_units(scene: Scene, efforts: tuple[Effort, ...]) -> Scene:
    """The scene with efforts of one, whose sizes `sized` sets. InputError for a joint or marker that does not exist."""
    for effort in efforts:
        if isinstance(effort, JointEffort):
            scene = _with_actuator(scene, effort, constant(1.0))
        else:
            scene = replace(scene, loads=(*scene.loads, _load(effort, float)))
    return scene


def without(scene: Scene, efforts: tuple[Effort, ...]) -> Scene:
    """The scene without the efforts that `with_units` has added."""
    names = {effort.name for effort in efforts}
    loads, forces = (tuple(one for one in of if one.name not in names) for of in (scene.loads, scene.forces))
    return replace(scene, loads=loads, forces=forces)


def _with_actuator(scene: Scene, effort: JointEffort, force: TimeFunction) -> Scene:
    added = Actuator(effort.name, effort.joint, force=force, coordinate=effort.coordinate)
    return replace(scene, forces=(*scene.forces, added))


def _load(effort: MarkerEffort, component: Any) -> Load:
    along = tuple(component(c) if c else 0.0 for c in effort.direction)
    nothing = (0.0, 0.0, 0.0)
    force, moment = (nothing, along) if effort.moment else (along, nothing)
    return Load(effort.name, effort.marker, force, moment, axes=effort.axes)


def sized(at: Evaluator, efforts: tuple[Effort, ...], sizes: Array) -> Evaluator:
    """The same memory for the scene with its unit efforts at other sizes (U,)."""
    model = at.system.model
    numbers = model.loads.data.copy()
    slots, shares = effort_slots(at, efforts)
    numbers[slots] = shares @ sizes
    tables = model._replace(loads=model.loads._replace(data=numbers))
    return replace(at, engine=with_model(at.engine, tables))


def effort_slots(at: Evaluator, efforts: tuple[Effort, ...]) -> tuple[Array, Array]:
    """Where the numbers (S,) of unit efforts stand in the data of the loads, and their shares (S, U) in each effort."""
    starts = dict(
        zip((force.name for force in forces_of(at.system.scene)), at.system.model.loads.row[:, LAW], strict=True)
    )
    slots, shares = [np.zeros(0, int)], [np.zeros((0, len(efforts)))]
    for effort, one in zip(efforts, np.eye(len(efforts)), strict=True):
        along = np.ones(1) if isinstance(effort, JointEffort) else np.array(effort.direction)
        first = starts[effort.name] + (3 * effort.moment if isinstance(effort, MarkerEffort) else 0)
        slots.append(first + np.arange(along.size))
        shares.append(np.outer(along, one))
    return np.concatenate(slots), np.concatenate(shares)


def recorded(times: Array, values: Array, *, rates: Array | None = None, degree: int = 5) -> TimeFunction:
    """The values (T,) at times (T,) [s] as a function of time: a spline of odd `degree`, smooth enough to drive with.

    rates : (T,) rates of the values, where they were recorded too. The spline then goes through them, and through the values
            in the mean. Its second derivative, which says what force a known motion needs, magnifies the rounding of a record
            by 1/h instead of 1/h^2, h apart, and is as good at the ends as inside

    Raises InputError for too few rows.

    >>> torque = fd.recorded(result.time, result["motor.effort"])
    """
    from scipy.interpolate import PPoly, make_interp_spline

    t, y = numbers_in("times of a record", times), numbers_in("values of a record", values)
    if t.shape != y.shape or t.ndim != 1 or t.size <= degree or not (np.diff(t) > 0).all():
        raise InputError(f"a recorded history needs more than {degree} increasing times and as many values")
    if rates is None:
        pieces = PPoly.from_spline(make_interp_spline(t, y, k=degree))
    else:
        pieces = _integral(t, y, np.asarray(rates, float), degree)
    inside = (pieces.x[:-1] < pieces.x[1:]) & (pieces.x[:-1] >= t[0]) & (pieces.x[:-1] < t[-1])
    breaks = np.append(pieces.x[:-1][inside], t[-1])
    return piecewise(breaks, pieces.c[::-1, inside].T)


def _integral(t: Array, y: Array, rates: Array, degree: int) -> PPoly:
    """The integral of the spline through the rates that has the mean of the values y."""
    from scipy.interpolate import PPoly, make_interp_spline

    if rates.shape != t.shape:
        raise InputError(f"a recorded history of {t.size} values has {rates.size} rates; it needs one for each")
    found = PPoly.from_spline(make_interp_spline(t, rates, k=degree)).antiderivative()
    found.c[-1] += np.mean(y - found(t))
    return found
