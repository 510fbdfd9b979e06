"""From recorded states to named quantities with units.

Every quantity has a name, a unit and a way to compute it from the recorded rows (`catalogue`); only those that are wanted are
computed and kept. `docs/scene_file.md` lists them.
"""

from __future__ import annotations

import fnmatch
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import astuple, dataclass
from difflib import get_close_matches
from typing import Any, NamedTuple

import numpy as np

from ffr_dyn.compile.scene_tables import System
from ffr_dyn.functions.time_functions import evaluate
from ffr_dyn.kernels.tables import MEASURED
from ffr_dyn.results.power import (
    Worked,
    damping_power,
    driven,
    measured_values,
    power,
    reaction,
    spring_energy,
    transmitted,
    work,
)
from ffr_dyn.results.recorded_motion import View, dot, times, to_axes
from ffr_dyn.results.result import EULER_PARAMETERS, XYZ, Axis, Quantity, mode_axis
from ffr_dyn.scene.couplings import Coupling
from ffr_dyn.scene.followed import following
from ffr_dyn.scene.force_kinds import forces_of
from ffr_dyn.scene.forces.places import COORDINATE, Measured, OnJoint
from ffr_dyn.scene.joints import COORDINATES, Joint
from ffr_dyn.scene.scene import Scene, marker_names, markers, measured_body
from ffr_dyn.scene.sensors import Measurement, SectionMeasurement, StressMeasurement
from ffr_dyn.scene.stress_sensors import measured_modes
from ffr_dyn.scene.surfaces import surface_of
from ffr_prep.body import remembered
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError

# What a result keeps unless told otherwise: enough to draw, to animate and to recover stress, and what joints carry.
DEFAULT_OUTPUTS = (
    *("*.R", "*.p", "*.v", "*.omega_bar", "*.q", "*.q_dot", "*.position", "*.velocity", "*.displacement", "*.rotation"),
    *(
        "*.force",
        "*.moment",
        "*.effort",
        "*.factor",
        "*.torque",
        "*.tension",
        "*.angle",
        "*.stroke",
        "energy.*",
        "constraint.*",
        "measured.*",
    ),
)


@dataclass(frozen=True)
class Unwound:
    """The last joint angle [rad], its rate [rad/s] and time [s], from which the next angle is unwound."""

    angle: float
    rate: float
    time: float


Memory = Mapping[str, Unwound | Worked]


class Entry(NamedTuple):
    """A quantity that can be had: unit, axes, description, and how to compute its values; a scene has a hundred and more.

    compute : (view, what the earlier rows left) -> (values (T, ...), what these rows leave)
    """

    unit: str
    axes: tuple[Axis, ...]
    text: str
    compute: Callable[[View, Unwound | Worked | None], tuple[Array, Unwound | Worked | None]]


def measure(view: View, last: Memory, wanted: Mapping[str, Entry] | None = None) -> tuple[dict[str, Quantity], Memory]:
    """The wanted quantities of recorded rows; by default those of `DEFAULT_OUTPUTS`.

    wanted : entries of the catalogue by name; see `selected`
    last   : what `measure` returned for the rows before these, {} at the start: angles and work go on from it
    """
    found, left = {}, dict(last)
    for name, entry in (selected(view.system) if wanted is None else wanted).items():
        values, memory = entry.compute(view, last.get(name))
        found[name] = Quantity(values, entry.unit, entry.axes, entry.text)
        if memory is not None:
            left[name] = memory
    return found, left


def selected(system: System, outputs: Sequence[str] = ("default",)) -> Mapping[str, Entry]:
    """The entries of the catalogue that names or patterns such as "rod.*.position" ask for, in its order.

    "default" stands for `DEFAULT_OUTPUTS`. Raises InputError for a name or pattern that fits nothing.
    """
    if isinstance(outputs, str):
        raise InputError(f"outputs must be a list of names, not the text {outputs!r}; write [{outputs!r}]")
    if system.scene.measurements:
        return _selected(catalogue(system), outputs)
    return remembered(system.structure, ("selected", *outputs), lambda: _selected(catalogue(system), outputs))


def _selected(everything: Mapping[str, Entry], outputs: Sequence[str]) -> dict[str, Entry]:
    wanted: set[str] = set()
    for pattern in outputs:
        patterns = DEFAULT_OUTPUTS if pattern == "default" else (pattern,)
        fitting = {pattern} if pattern in everything else _fitting(patterns, everything)
        if not fitting:
            raise InputError(
                f"outputs: {pattern!r} is none of the scene's quantities; {like(pattern, everything, 0.6)}"
            )
        wanted |= fitting
    return {name: entry for name, entry in everything.items() if name in wanted}


def like(name: str, everything: Sequence[str] | Mapping[str, Entry], near: float) -> str:
    """What to write instead of a name that is none of the scene's, in words: names like it, or of the same body, joint or
    force, or what there is at all."""
    if close := get_close_matches(name, everything, 3, near):
        return f"did you mean {', '.join(close)}?"
    head = name.partition(".")[0]
    if siblings := [one for one in everything if one.startswith(f"{head}.")]:
        return f"of {head!r} there are: {', '.join(siblings)}"
    heads = ", ".join(f"{one}.*" for one in dict.fromkeys(one.partition(".")[0] for one in everything))
    return f"there are: {heads}; `ffr-dyn info` lists those of a result"


def _fitting(patterns: Sequence[str], names: Iterable[str]) -> set[str]:
    """The names that fit one of the patterns."""
    return set(filter(re.compile("|".join(map(fnmatch.translate, patterns))).match, names))


def needs_every_step(wanted: Iterable[str]) -> bool:
    """Whether a wanted quantity adds up over the integrator's steps (work) rather than over output rows."""
    return any(name.endswith(".work") for name in wanted)


def catalogue(system: System) -> Mapping[str, Entry]:
    """Every quantity that can be had of a scene, by name.

    Scenes of one structure share their entries, which know bodies, joints and forces by number.
    """
    known = remembered(system.structure, "catalogue", lambda: _catalogue(system))
    return {**known, **dict(_measurements(system))} if system.scene.measurements else known


def _catalogue(system: System) -> dict[str, Entry]:
    """Without the measurements."""
    parts = (_bodies, _markers, _reactions, _joint_coordinates, _forces, _powers, _totals)
    return {name: entry for part in parts for name, entry in part(system)}


Named = Iterator[tuple[str, Entry]]


def _entry(unit: str, axes: tuple[Axis, ...], text: str, values: Callable[[View], Array]) -> Entry:
    """A quantity that needs nothing of earlier rows."""
    return Entry(unit, axes, text, lambda view, _: (values(view), None))


def _bodies(system: System) -> Named:
    place = system.layout
    for b, body in enumerate(system.scene.bodies):
        for of, poses in ((View.pose, _POSES), (View.pose_growth, _GROWTHS)):
            for name, unit, axis, text in poses:
                values = lambda view, b=b, of=of, name=name: getattr(of(view, b), name)  # type: ignore[misc]  # noqa: E731
                yield f"{body.name}.{name}", _entry(unit, (axis,), text, values)
        if place.n[b] or (body.kept and body.kept[1]):
            yield from _elastic(system, b)


_POSES = (
    ("R", "m", XYZ, "origin of the body frame, global axes"),
    ("p", "1", EULER_PARAMETERS, "Euler parameters, body to global"),
    ("v", "m/s", XYZ, "velocity of the origin, global axes"),
    ("omega_bar", "rad/s", XYZ, "angular velocity, body axes"),
)
_GROWTHS = (
    ("a", "m/s^2", XYZ, "acceleration of the origin, global axes"),
    ("alpha_bar", "rad/s^2", XYZ, "angular acceleration, body axes"),
)


def _elastic(system: System, b: int) -> Named:
    place, body = system.layout, system.scene.bodies[b]
    numbers, count = body.kept or (tuple(range(place.n[b])), place.n[b])
    framed, count = body.frame is not None, body.frame.model.n if body.frame else count
    modes, unit, text = mode_axis(body.name, count), "m sqrt(kg)", "elastic coordinates (mass-normalised)"

    def column(unit: str, text: str, of: str, at: slice) -> Entry:
        def values(view: View) -> Array:
            recorded = getattr(view.record, of)[:, at]
            return view.own_elastic(b, recorded) if framed else _spread(recorded, numbers, count)

        return _entry(unit, (modes,), text, values)

    yield f"{body.name}.q", column(unit, text, "x", place.q(b))
    yield f"{body.name}.q_dot", column(f"{unit}/s", f"rates of the {text}", "v", place.q_dot(b))
    yield f"{body.name}.q_ddot", column(f"{unit}/s^2", f"accelerations of the {text}", "vd", place.q_dot(b))


def _spread(values: Array, numbers: Sequence[int], count: int) -> Array:
    """(T, k) values of some coordinates among all `count` of them, zero for those that a planar scene leaves out."""
    out = np.zeros((len(values), count))
    out[:, list(numbers)] = values
    return out


def _markers(system: System) -> Named:
    ground = len(system.scene.bodies)
    for k, (name, (b, _, _)) in enumerate(zip(marker_names(system.scene), markers(system.scene), strict=True)):
        if b == ground:
            continue
        part = system.scene.bodies[b].part_of and system.scene.bodies[b].name
        for what, entry in _marker(k, f"seen from the part {part!r}" if part else "body axes").items():
            if what != "displacement" or system.layout.n[b]:
                yield f"{name}.{what}", entry


def _marker(k: int, frame: str) -> dict[str, Entry]:
    """frame : in words, where displacements are seen from"""

    def vector(unit: str, text: str, values: Callable[[View], Array]) -> Entry:
        return _entry(unit, (XYZ,), text, values)

    parameters = "Euler parameters of the marker's axes to global: its body's rotation and the elastic one"
    return {
        "position": vector("m", "position of the marker, global axes", lambda view: view.record.r[:, k]),
        "velocity": vector("m/s", "velocity of the marker, global axes", lambda view: view.record.rd[:, k]),
        "displacement": vector("m", f"elastic displacement of the marker, {frame}", lambda v: v.displacement(k)),
        "acceleration": vector("m/s^2", "acceleration of the marker, global axes", lambda v: v.acceleration(k)),
        "orientation": _entry("1", (EULER_PARAMETERS,), parameters, lambda view: view.orientation(k)),
        "angular_velocity": vector("rad/s", "angular velocity of the marker, global axes", lambda view: view.spin(k)),
    }


def _reactions(system: System) -> Named:
    joints = {joint.name: k for k, joint in enumerate(system.scene.joints)}
    couplings = {coupling.name: coupling for coupling in system.scene.couplings}
    for number, block in enumerate(system.blocks):
        if block.name in couplings:
            yield f"{block.name}.effort", _coupling_effort(couplings[block.name], number)
            continue
        for k, (what, unit) in enumerate((("force", "N"), ("moment", "N m"))):
            text = f"{what} that the first body exerts on the second at its marker"
            for suffix, axes in (
                ("", "global axes"),
                ("_i", "axes of the first body"),
                ("_joint", "joint axes f, g, h"),
            ):
                if suffix != "_joint" or block.name in joints:
                    entry = _reaction(block.name, block.markers[0], joints.get(block.name), k, suffix)
                    yield f"{block.name}.{what}{suffix}", _entry(unit, (XYZ,), f"{text}, {axes}", entry)


def _coupling_effort(coupling: Coupling, number: int) -> Entry:
    """The effort of a coupling on its second coordinate; that on the first is -ratio times as large."""
    unit = "N m" if coupling.second.endswith(".angle") else "N"
    text = f"effort of the coupling along {coupling.second}; along {coupling.first} it is -ratio times that"
    return _entry(unit, (), text, lambda view: view.record.reaction[:, number, 0])


def _reaction(name: str, marker: int, joint: int | None, k: int, suffix: str) -> Callable[[View], Array]:
    def values(view: View) -> Array:
        vector = reaction(view, name)[k]
        if suffix == "_i":
            return to_axes(view.axes(markers(view.system.scene)[marker][0]), vector)
        if suffix == "_joint" and joint is not None:
            return to_axes(view.joint_frames(view.system.scene.joints[joint])[0], vector)
        return vector

    return values


def _forces(system: System) -> Named:
    """The recorded quantities of forces: where each stands and what it exerts."""
    for k, force in enumerate(forces_of(system.scene)):
        for one in force.place.measured:
            yield f"{force.name}.{one.name}", _of_force(k, one)


def _of_force(k: int, one: Measured) -> Entry:
    at, axes = (one.column, ()) if one.size == 1 else (slice(one.column, one.column + one.size), (XYZ,))

    def values(view: View) -> Array:
        found = measured_values(view, k, at)
        return found if one.sign == 1 else one.sign * found

    return _entry(one.unit, axes, one.text, values)


def _sources(scene: Scene) -> list[Any]:
    """All that does work in a scene: forces, drivers, couplings."""
    return [*forces_of(scene), *scene.drivers, *(joint for joint in scene.joints if joint.kind == "distance")]


def _powers(system: System) -> Named:
    scene = system.scene
    for k, thing in enumerate(_sources(scene)):
        values = lambda view, k=k: power(view, _sources(view.system.scene)[k])  # type: ignore[misc]  # noqa: E731
        yield from _worked(thing.name, "put into the scene", values)
    for b, body in enumerate(scene.bodies):
        if system.layout.n[b]:
            yield from _worked(f"{body.name}.damping", "of modal damping", lambda view, b=b: damping_power(view, b))  # type: ignore[misc]
    for k, joint in enumerate(scene.joints):
        text = "power that the first body gives to the second through the joint"
        of = lambda view, k=k: transmitted(view, view.system.scene.joints[k])  # type: ignore[misc]  # noqa: E731
        yield f"{joint.name}.transmitted", _entry("W", (), text, of)


def _worked(name: str, text: str, values: Callable[[View], Array]) -> Named:
    def done(view: View, last: Unwound | Worked | None) -> tuple[Array, Worked]:
        before = last if isinstance(last, Worked) else None
        return work(view.record.time, values(view), before)

    yield f"{name}.power", _entry("W", (), f"power {text}", values)
    yield f"{name}.work", Entry("J", (), f"work {text} since the start", done)


def _totals(system: System) -> Named:
    for k, name in enumerate(("kinetic", "strain", "gravity")):
        yield f"energy.{name}", _entry("J", (), f"{name} energy", lambda view, k=k: view.record.energy[:, k])  # type: ignore[misc]
    total = "kinetic, strain and gravity energy"
    yield "energy.total", _entry("J", (), total, lambda view: _sum(view.record.energy))
    if any(force.stores_energy for force in forces_of(system.scene)):
        text = "energy stored in springs, bushings and stops, preload included"
        yield "energy.springs", _entry("J", (), text, spring_energy)
    texts = (("position", "m", "largest violation of a constraint row"), ("velocity", "m/s", "largest rate of a row"))
    for k, (name, unit, text) in enumerate(texts):
        yield f"constraint.{name}", _entry(unit, (), text, lambda view, k=k: view.record.violation[:, k])  # type: ignore[misc]


def _sum(energy: Array) -> Array:
    total: Array = energy[:, 0] + energy[:, 1] + energy[:, 2]
    return total


# ---- measurements of the scene ------------------------------------------------------------------------------------


def _measurements(system: System) -> Named:
    units = {"position": "m", "velocity": "m/s", "acceleration": "m/s^2", "distance": "m", "orientation": "1"}
    axes = {"distance": (), "orientation": (EULER_PARAMETERS,)}
    for m in system.scene.measurements:
        if not isinstance(m, Measurement):
            yield f"measured.{m.name}", _recovered(system, m)
            continue
        text = f"{m.what} of {m.j} from {m.i}" + ("" if m.what in axes else f", {m.axes} axes")
        entry = _entry(units[m.what], axes.get(m.what, (XYZ,)), text, lambda view, m=m: _measured(view, m))  # type: ignore[misc]
        yield f"measured.{m.name}", entry


def _recovered(system: System, m: StressMeasurement | SectionMeasurement) -> Entry:
    """Stress or section forces: modes times elastic coordinates, and what is made of them."""
    b = measured_body(system.scene, m)
    found = measured_modes(m, surface_of(system.scene.bodies[b]))
    axes = () if found.axis is None else (Axis(*found.axis),)
    return _entry(found.unit, axes, found.text, lambda view: found.of(found.values(view.own_elastic(b, view.q(b)))))


def _measured(view: View, m: Measurement) -> Array:
    i, j = view.number(m.i), view.number(m.j)
    if m.what == "orientation":
        return times(view.orientation(i) * [1.0, -1.0, -1.0, -1.0], view.orientation(j))
    if m.what == "velocity":
        difference = view.record.rd[:, j] - view.record.rd[:, i]
    elif m.what == "acceleration":
        difference = view.acceleration(j) - view.acceleration(i)
    else:
        difference = view.record.r[:, j] - view.record.r[:, i]
    if m.what == "distance":
        return np.asarray(np.sqrt(dot(difference, difference)))
    if m.axes == "global":
        return np.asarray(difference)
    return to_axes(view.axes([body.name for body in view.system.scene.bodies].index(m.axes)), difference)


# ---- joint coordinates --------------------------------------------------------------------------------------------


ASIDE = 0.5  # rad, so that rounding decides nothing where a coupling stands half a turn off


def _joint_coordinates(system: System) -> Named:
    known = following(system.scene)
    for number, joint in enumerate(system.scene.joints):
        if "angle" in COORDINATES[joint.kind]:
            led = (joint.name, "angle") in known
            yield f"{joint.name}.angle", _unwound(number, led, _counted(system.scene, joint))
            rate = lambda view, j=number: angles(view, view.system.scene.joints[j])[1]  # type: ignore[misc]  # noqa: E731
            yield f"{joint.name}.angle_rate", _entry("rad/s", (), "rate of the joint angle", rate)
        if "stroke" in COORDINATES[joint.kind]:
            for k, (name, unit) in enumerate((("stroke", "m"), ("stroke_rate", "m/s"))):
                text = ("joint stroke along its axis", "rate of the joint stroke")[k]
                of = lambda view, j=number, k=k: strokes(view, view.system.scene.joints[j])[k]  # type: ignore[misc]  # noqa: E731
                yield f"{joint.name}.{name}", _entry(unit, (), text, of)


def _counted(scene: Scene, joint: Joint) -> int | None:
    """The number of a force on the angle of a joint, which counts its turns from step to step."""
    places = (getattr(force, "place", None) for force in forces_of(scene))
    on = (
        k for k, p in enumerate(places) if isinstance(p, OnJoint) and (p.joint, p.coordinate) == (joint.name, "angle")
    )
    return next(on, None)


def _unwound(number: int, led: bool, force: int | None) -> Entry:
    """The angle of a joint, which begins within half a turn; with the whole turns of what it follows, or those that a force
    has counted since the start, if it has one."""

    def compute(view: View, last: Unwound | Worked | None) -> tuple[Array, Unwound]:
        scene = view.system.scene
        moments, (angle, rate) = view.record.time, angles(view, scene.joints[number])
        if led:
            near = _followed(view, scene.joints[number]) - ASIDE
        elif force is not None:
            near = _as_counted(view, force)
        else:
            return unwind(moments, angle, rate, last if isinstance(last, Unwound) else None)
        angle = angle + 2 * np.pi * np.round((near - angle) / (2 * np.pi))
        return angle, Unwound(float(angle[-1]), float(rate[-1]), float(moments[-1]))

    return Entry("rad", (), "joint angle, unwound", compute)


def _as_counted(view: View, force: int) -> Array:
    """(T,) the angle on which a force acts, less the turns with which it began."""
    place: Any = forces_of(view.system.scene)[force].place
    start = int(view.system.model.loads.row[force, MEASURED])
    counted: Array = view.record.forces[:, start + COORDINATE] - 2 * np.pi * place.turns
    return counted


def _followed(view: View, joint: Joint) -> Array:
    """(T,) the angle of a joint by what it follows: a driver, or a stroke."""
    scene = view.system.scene
    of, factor, begun = following(scene)[joint.name, "angle"]
    if isinstance(of, str):
        leads = _asked(view, next(driver for driver in scene.drivers if driver.name == of))
    else:
        leads = strokes(view, next(joint for joint in scene.joints if joint.name == of[0]))[0]
    return np.asarray(factor * leads + begun)


def _asked(view: View, driver: Any) -> Array:
    """(T,) what a driver prescribes, which is recorded where it has rows."""
    if any(block.name == driver.name for block in view.system.blocks):
        return driven(view, driver)[:, 0]
    return np.array([evaluate(driver.function, float(t))[0] for t in view.record.time])


def unwind(time: Array, angle: Array, rate: Array, last: Unwound | None) -> tuple[Array, Unwound]:
    """Angles (T,) without jumps of a turn: each is the one nearest to what the rates (T,) predict."""
    before = last or Unwound(float(angle[0]), float(rate[0]), float(time[0]))
    earlier = [
        np.append(first, values[:-1]) for first, values in zip(astuple(before), (angle, rate, time), strict=True)
    ]
    predicted = earlier[0] + 0.5 * (earlier[1] + rate) * (time - earlier[2])
    out = angle + 2 * np.pi * np.cumsum(np.round((predicted - angle) / (2 * np.pi)))
    return out, Unwound(float(out[-1]), float(rate[-1]), float(time[-1]))


def angles(view: View, joint: Joint) -> tuple[Array, Array]:
    """Joint angle [rad] within half a turn and its rate [rad/s], each (T,)."""
    (frame_i, frame_j), (rate_i, rate_j) = view.joint_frames(joint), view.joint_frame_rates(joint)
    f_j, f_j_dot = frame_j[:, :, 0], rate_j[:, :, 0]
    cosine, sine = (dot(frame_i[:, :, k], f_j) for k in (0, 1))
    cosine_dot, sine_dot = (dot(rate_i[:, :, k], f_j) + dot(frame_i[:, :, k], f_j_dot) for k in (0, 1))
    rate = (cosine * sine_dot - sine * cosine_dot) / (cosine**2 + sine**2)
    return np.arctan2(sine, cosine), rate


def strokes(view: View, joint: Joint) -> tuple[Array, Array]:
    """Joint stroke [m] and its rate [m/s], each (T,)."""
    i, j = view.number(joint.i), view.number(joint.j)
    h, h_dot = view.joint_frames(joint)[0][:, :, 2], view.joint_frame_rates(joint)[0][:, :, 2]
    apart, rate = (values[:, j] - values[:, i] for values in (view.record.r, view.record.rd))
    return dot(h, apart), dot(h, rate) + dot(h_dot, apart)
