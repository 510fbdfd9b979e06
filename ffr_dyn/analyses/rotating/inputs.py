"""Inputs of a frequency response in words: what acts, in which scene, and how often it is integrated to a displacement.

A motion that is prescribed, of a driver or of the base, is given by its displacement (order 0), its rate (1) or its second
derivative (2); all three act at once, so that a linear system answers it by B and D that are polynomials in i w, of degree
two, divided by (i w)^order.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from ffr_dyn.analyses.efforts import Effort, JointEffort, MarkerEffort, with_function
from ffr_dyn.analyses.linearise import BASE
from ffr_dyn.analyses.states import scene_at
from ffr_dyn.functions.operations import ADD
from ffr_dyn.functions.time_functions import TimeFunction, as_time_function, is_zero, operation
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.joints import COORDINATES, Joint
from ffr_dyn.scene.scene import Scene, marker_names
from ffr_prep.common.errors import InputError

COMPONENTS = "xyz"
EFFORTS = {"angle": "moment", "stroke": "force"}
ORDERS = {"": 0, "_rate": 1, "_acceleration": 2}  # of a driver's motion
OF_BASE = {"displacement": 0, "velocity": 1}  # of the base's motion, beside its acceleration
ABSOLUTE = {"position": 0, "velocity": 1, "acceleration": 2}  # quantities of markers to which the base adds its own


@dataclass(frozen=True)
class Acting:
    """An input that is understood.

    effort : what acts, an effort or, by name, a load or the acceleration of the base
    driver : whose motion it is; None where it is none's
    order  : of a motion, and of the base's displacement or velocity
    scene  : in which the effort is free to act: without the driver
    in_place_of : the name of the driver in whose place the effort acts; "" where it is in none's
    """

    scene: Scene
    effort: str | Effort
    driver: Driver | None = None
    order: int | None = None
    in_place_of: str = ""

    @property
    def moved(self) -> tuple[str, ...]:
        """The coordinate that the driver prescribes."""
        return (f"{self.driver.joint}.{self.driver.coordinate}",) if self.driver else ()

    @property
    def own(self) -> str:
        """The output that is the effort itself."""
        return f"{self.in_place_of}.effort" if self.in_place_of else ""


def acting(scene: Scene, given: str | Effort, time: float) -> Acting:
    """The input. Raises InputError for words that name none."""
    if not isinstance(given, str) or given in BASE or given in [load.name for load in scene.loads]:
        return Acting(scene, given)
    head, _, what = given.partition(".")
    base, _, kind = given.rpartition(".")
    if base in BASE and kind in OF_BASE:
        return Acting(scene, base, order=OF_BASE[kind])
    drivers = {d.name: d for d in scene.drivers if isinstance(d, Driver)}
    if head in drivers and (found := _of_driver(scene, drivers[head], what, time)):
        return found
    joints = {joint.name: joint for joint in scene.joints}
    if head in joints and what in EFFORTS.values():
        return Acting(scene, _of_joint(joints[head], what))
    marker, _, rest = given.rpartition(".force.") if ".force." in given else given.rpartition(".moment.")
    if marker in marker_names(scene) and rest in COMPONENTS and len(rest) == 1:
        direction = tuple(float(c == rest) for c in COMPONENTS)
        return Acting(scene, MarkerEffort("input", marker, direction, moment=".moment." in given))
    raise InputError(
        f"input {given!r} is not understood: write joint.moment, joint.force, driver.moment, driver.angle, driver.stroke, "
        "driver.angle_rate, body.point.force.x, body.point.moment.x, base.x, base.x.displacement, base.x.velocity, or the "
        f"name of a load; joints are {', '.join(sorted(joints)) or 'none'}, drivers {', '.join(drivers) or 'none'}"
    )


def _of_joint(joint: Joint, what: str) -> JointEffort:
    """A moment or force along a coordinate of a joint. Raises InputError for one that the joint has not."""
    there = {EFFORTS[coordinate]: coordinate for coordinate in COORDINATES[joint.kind]}
    if what not in there:
        instead = " or ".join(f"{joint.name}.{effort}" for effort in there)
        missing = next(coordinate for coordinate, effort in EFFORTS.items() if effort == what)
        raise InputError(
            f"input '{joint.name}.{what}': a {joint.kind} joint has no {missing} along which a {what} acts; write "
            f"{instead or 'a force at a marker, such as body.point.force.x'}"
        )
    return JointEffort("input", joint.name, there[what])


def _of_driver(scene: Scene, driver: Driver, what: str, time: float) -> Acting | None:
    """A moment or force in the place of a driver, or a change of what it prescribes; None for other words."""
    orders = {driver.coordinate + rate: order for rate, order in ORDERS.items()}
    if what not in orders and what != EFFORTS[driver.coordinate]:
        return None
    effort = JointEffort("input", driver.joint, driver.coordinate)
    left = _released(scene, driver, time)
    moving = what in orders
    return Acting(left, effort, driver if moving else None, orders[what] if moving else None, driver.name)


def _released(scene: Scene, driver: Driver, time: float) -> Scene:
    """The scene without a driver, which goes on with the effort that it has."""
    from ffr_dyn.analyses.assemble import assembly
    from ffr_dyn.scene.forces import Actuator

    held = assembly(scene, time=time)
    effort = float(held[f"{driver.name}.effort"][0])
    left = replace(scene_at(scene, held), drivers=tuple(d for d in scene.drivers if d is not driver))
    if not effort:
        return left
    added = Actuator(f"{driver.name}_held", driver.joint, force=effort, coordinate=driver.coordinate)
    return replace(left, forces=(*left.forces, added))


def components(scene: Scene, outputs: Sequence[str], time: float, who: str) -> dict[str, str]:
    """Every component of the outputs, and its unit as far as it is known here. InputError where there are none."""
    from ffr_dyn.analyses.assemble import assembly

    if not outputs or isinstance(outputs, str):
        raise InputError(f"{who} needs outputs: names of quantities in a list, such as rod.tip.acceleration")
    known = assembly(scene, time=time, outputs=("*",))
    found: dict[str, str] = {}
    for name in outputs:
        of = known.quantities.get(name) or known.quantities.get(name.rpartition(".")[0])
        try:
            found |= dict.fromkeys(known.components([name]), of.unit if of else "")
        except InputError:
            found[name] = ""  # another quantity, which who asks for it knows, or names what is near
    return found


def _unit(of: Acting) -> str:
    """The unit of the input, which of a load is a share."""
    if of.driver is not None or of.order is not None:
        angle = of.driver is not None and of.driver.coordinate == "angle"
        return ("rad" if angle else "m") + ("", "/s", "/s^2")[of.order or 0]
    if isinstance(of.effort, str):
        return "m/s^2" if of.effort in BASE else "1"
    return _effort_unit(of.effort)


def _effort_unit(of: Effort) -> str:
    turning = of.coordinate == "angle" if isinstance(of, JointEffort) else of.moment
    return "N m" if turning else "N"


def allowed(of: Acting, names: Iterable[str]) -> Iterable[str]:
    """The outputs. InputError for what the driver exerts in whose place the input acts, but its effort."""
    for name in names:
        if of.in_place_of and name.startswith((f"{of.in_place_of}.", f"{of.in_place_of}_held.")) and name != of.own:
            raise InputError(
                f"output {name!r}: the input acts in the place of driver {of.in_place_of!r}, of which only the effort is "
                f"told; write {of.own!r}"
            )
    return names


def absolute_order(effort: str | Effort, name: str) -> int | None:
    """Which derivative of the base's motion an output of a marker along it has as well; None of any other."""
    if not isinstance(effort, str) or effort not in BASE:
        return None
    head, _, axis = name.rpartition(".")
    return ABSOLUTE.get(head.rpartition(".")[2]) if axis == effort[-1] else None


def told(of: Acting, given: str | Effort, units: Mapping[str, str], outputs: Sequence[str]) -> dict[str, Any]:
    """Attributes of a result: the input in words, its unit, and those of outputs; the effort of a driver whose place is taken
    is known here."""
    own = "" if isinstance(of.effort, str) else _effort_unit(of.effort)
    found = [own if name == of.own else units[name] for name in outputs]
    return {"input": _in_words(of, given), "input_unit": _unit(of), "output_units": found}


def _in_words(of: Acting, given: str | Effort) -> str:
    """Those that were given where they say it best."""
    effort = of.effort
    if of.driver or isinstance(effort, str):
        return str(given)
    if isinstance(effort, JointEffort):
        return f"{effort.joint}.{EFFORTS[effort.coordinate]}"
    along = ",".join(f"{c:g}" for c in effort.direction)
    return f"{effort.marker}.{'moment' if effort.moment else 'force'}:{along}"


# ---- as a function of time ------------------------------------------------------------------------------------------


def excited(scene: Scene, given: Acting, wave: TimeFunction) -> Scene:
    """The scene with the input as a function of time: an effort, the motion of a driver beside its own, the acceleration of
    the base, or the share by which a load is changed."""
    if (driver := given.driver) is not None:
        added = operation(ADD, as_time_function(driver.function, "function of time"), wave)
        drivers = tuple(replace(driver, function=added) if d is driver else d for d in scene.drivers)
        return replace(scene, drivers=drivers)
    if not isinstance(given.effort, str):
        return with_function(given.scene, given.effort, wave)
    if given.effort in BASE:
        base = [as_time_function(f, "base_acceleration") for f in scene.base_acceleration]
        k = BASE[given.effort]
        base[k] = wave if is_zero(base[k]) else operation(ADD, base[k], wave)
        return replace(scene, base_acceleration=tuple(base))
    share = operation(ADD, as_time_function(1.0, "share"), wave)
    changed = tuple(load.varied(share) if load.name == given.effort else load for load in scene.loads)
    return replace(scene, loads=changed)
