"""Scenes: bodies, ground points, joints, drivers and loads, declared by name; names are resolved once, here.

A marker is named "body.interface" or "ground.point".
"""

from __future__ import annotations

import difflib
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field, replace
from functools import cached_property
from typing import Any, TypeVar, get_args

import numpy as np

from ffr_dyn.functions.rotation import euler_parameters, rotation_matrix
from ffr_dyn.functions.time_functions import POLYNOMIAL, TimeFunction, as_time_function, less
from ffr_dyn.scene.checks import check_name, check_own_name, several
from ffr_dyn.scene.couplings import Coupling, coupled, coupling_word
from ffr_dyn.scene.drivers import Driver, PointDriver, driver_word
from ffr_dyn.scene.force_kinds import forces_of, kinds_in, loaded_markers
from ffr_dyn.scene.joints import COORDINATES, Joint
from ffr_dyn.scene.own_frame import OwnFrame
from ffr_dyn.scene.parts import owner, taken_apart, wholes
from ffr_dyn.scene.sensors import AnyMeasurement, Measurement, SectionMeasurement, StressMeasurement
from ffr_dyn.scene.stress_sensors import measured_modes, nearest_surface
from ffr_prep.body import FlexibleBody, check_point
from ffr_prep.common.arrays import Array
from ffr_prep.common.brief import Brief, Rows, in_short, listed, numbers
from ffr_prep.common.errors import InputError

GROUND = "ground"
# Groups of inertia integrals that a body can do without: I3 and the parts, skew and symmetric, of the other two.
INERTIA_TERMS = ("I3", "I4", "I5", "I8", "I9")
_MOST = 1e60  # of places and rates in SI units, so that products of them are numbers still
RESERVED = (GROUND, "energy", "constraint", "measured", "time", "geometry")


@dataclass(frozen=True, repr=False)
class Body(Brief):
    """A reduced (or rigid) body in the scene, with its pose and motion at the start.

    position : (3,) [m] of the body frame's origin, global
    rotation : rotation vector (3,) [rad], Euler parameters (4,) or matrix (3, 3), body -> global
    velocity : (3,) [m/s] of the origin, global;  omega_bar : (3,) [rad/s] in body axes
    q, q_dot : (n,) elastic coordinates and rates; default zero
    damping  : modal damping ratio, one for all modes or (n,); of a body that moves to second order they are the ratios of the
               modes of its mean-axis form, by frequency, whatever conditions it was reduced under
    stiffening : use the second-order displacement that the model has, if any
    dropped  : names of the `INERTIA_TERMS` that the equations of motion leave out (see
               `ffr_dyn.variants.variant.without_terms`)
    kept     : set where a planar scene leaves modes out: the numbers of those that stay, and how many there were
    part_of  : set by a scene of a body that is cut into parts (`ffr_dyn.scene.parts`): the whole
    frame    : set where the body is computed in its mean-axis form (`ffr_dyn.variants.mean_axis`), which model, pose and
               motion are then those of: the frame to which the scene and results refer

    Pose and motion are a first guess: assembly makes them meet the joints.

    Raises InputError for a model that is none, negative damping, and terms to drop that do not exist.

    >>> rod = fd.Body("rod", fd.load_body("rod.ffr"), position=(0.1, 0, 0), damping=0.01)
    """

    name: str
    model: FlexibleBody
    _: KW_ONLY
    position: Any = (0.0, 0.0, 0.0)
    rotation: Any = (0.0, 0.0, 0.0)
    velocity: Any = (0.0, 0.0, 0.0)
    omega_bar: Any = (0.0, 0.0, 0.0)
    q: Any = None
    q_dot: Any = None
    damping: Any = 0.0
    stiffening: bool = True
    dropped: tuple[str, ...] = ()
    kept: tuple[tuple[int, ...], int] | None = None
    part_of: Body | None = None
    frame: OwnFrame | None = None

    def __post_init__(self) -> None:
        check_own_name("body", self.name)
        if not isinstance(self.model, FlexibleBody):
            raise InputError(f"body {self.name!r}: its model is {self.model!r}; give one of load_body or rigid_body")
        n, who = self.model.n, f"body {self.name!r}"
        for key in ("position", "velocity", "omega_bar"):
            object.__setattr__(self, key, _vector(getattr(self, key), 3, f"{who}: {key}"))
        object.__setattr__(self, "rotation", euler_parameters(self.rotation, f"{who}: rotation"))
        for key in ("q", "q_dot"):
            value = np.zeros(n) if getattr(self, key) is None else getattr(self, key)
            object.__setattr__(self, key, _vector(value, n, f"{who}: {key}"))
        damping = np.full(n, self.damping) if np.ndim(self.damping) == 0 else self.damping
        object.__setattr__(self, "damping", _vector(damping, n, f"{who}: damping"))
        if (self.damping < 0).any():
            raise InputError(f"{who}: a modal damping ratio is negative: {self.damping.min():g}")
        for term in self.dropped:
            if term not in INERTIA_TERMS:
                raise InputError(f"{who}: there is no inertia term {term!r} to drop; {_offer(term, INERTIA_TERMS)}")
        object.__setattr__(self, "dropped", tuple(t for t in INERTIA_TERMS if t in self.dropped))

    @cached_property
    def _axes(self) -> Array:
        """(3, 3) body to global, at the start."""
        return rotation_matrix(self.rotation)

    @cached_property
    def _along(self) -> tuple[int, int, int]:
        """The body axes along the global ones, or -1."""
        size = np.abs(self._axes).tolist()
        x, y, z = (row.index(max(row)) if max(row) > 1 - 1e-12 else -1 for row in size)
        return x, y, z

    def _title(self) -> str:
        n = self.model.n
        return f"Body {self.name!r}: {f'flexible, {n} elastic coordinates' if n else 'rigid'}, {self.model.mass:.4g} kg"

    def _rows(self) -> Rows:
        model, poses = self.model, ("position", "rotation", "velocity", "omega_bar")
        rows = [("points", listed(interface.name for interface in model.interfaces))]
        rows += [(f"{key} [{unit}]", numbers(getattr(self, key))) for key, unit in zip(poses, _UNITS, strict=True)]
        if model.n:
            hertz = np.sqrt(model.omega2) / (2 * np.pi)
            damping = sorted({f"{ratio:.4g}" for ratio in (self.damping.min(), self.damping.max())}, key=float)
            rows += [("elastic", f"{hertz.min():.4g} to {hertz.max():.4g} Hz, damping ratio {' to '.join(damping)}")]
            deformed = float(np.abs(self.q).max()), float(np.abs(self.q_dot).max())
            rows += [("deformed", f"|q| up to {deformed[0]:.4g}, rates {deformed[1]:.4g}")] if any(deformed) else []
        left_out = [*self.dropped, *(["second order"] if not self.stiffening else [])]
        return rows + ([("left out", listed(left_out))] if left_out else [])


Checked = TypeVar("Checked", bound="Body | Scene")


def altered(thing: Checked, **changes: Any) -> Checked:
    """A copy of a body or a scene with other values of some fields, which are neither checked nor converted as by `replace`:
    for forms of a scene that was checked, in which all names stay what they are."""
    out = object.__new__(type(thing))
    vars(out).update(vars(thing), **changes)
    if "rotation" in changes:
        for key in ("_axes", "_along"):
            vars(out).pop(key, None)
    return out


_PARALLEL = 1e-9  # of entries of a rotation, what is no turn
ALONG_Z = (0.0, 0.0, 1.0)  # of joints whose axes are not given
_UNITS = ("m", "e0..e3", "m/s", "rad/s")


MarkerName = tuple[int, str, str]  # number of the body, the name that its points go by, name of the point


@dataclass(frozen=True, repr=False)
class Scene(Brief):
    """Everything an analysis needs. Raises InputError for names that do not exist, repeat or contradict each other.

    ground  : name -> (3,) [m], points fixed in the global frame
    loads, springs, forces : of the kinds in `ffr_dyn.scene.forces`: `Load`, `SpringDamper`, and all others
    gravity : three components [m/s^2], global, each a number, a time function or a Python function of time. What varies is
              kept as the base acceleration that acts in the same way, so that `gravity` is (3,), the constant components
    base_acceleration : three components [m/s^2], global, each a number, a time function or a Python function of time: the
              translational acceleration of the ground, whose frame all results refer to. It acts as gravity less this
              acceleration; the energy of gravity is that of the constant components
    plane   : "auto" finds out whether the scene is planar and then computes in the plane alone (see
              `ffr_dyn.variants.plane`); "x", "y" or "z", its normal, declares it, so that modes mostly in the plane are
              kept and the rest is left out even where it is small only; "none" computes in space

    >>> scene = fd.Scene([rod], [hinge], ground={"wall": (0, 0, 0)}, gravity=(0, -9.81, 0))
    """

    bodies: tuple[Body, ...]
    joints: tuple[Joint, ...] = ()
    drivers: tuple[Driver | PointDriver, ...] = ()
    _: KW_ONLY
    couplings: tuple[Coupling, ...] = ()
    loads: tuple[Any, ...] = ()
    springs: tuple[Any, ...] = ()
    forces: tuple[Any, ...] = ()
    measurements: tuple[AnyMeasurement, ...] = ()
    ground: Mapping[str, Any] = field(default_factory=dict)
    gravity: Any = (0.0, 0.0, 0.0)
    base_acceleration: Any = (0.0, 0.0, 0.0)
    name: str = "scene"
    plane: str = "auto"

    @cached_property
    def _markers(self) -> tuple[MarkerName, ...]:
        listed = [(b, owner(body), i.name) for b, body in enumerate(self.bodies) for i in body.model.interfaces]
        return (*listed, *((len(self.bodies), GROUND, point) for point in self.ground))

    @cached_property
    def _numbers(self) -> dict[str, int]:
        """Of markers, by name."""
        return {f"{body}.{point}": k for k, (_, body, point) in enumerate(self._markers)}

    @cached_property
    def _length(self) -> float:
        points = [i.position for body in self.bodies for i in body.model.interfaces]
        extent = max((float(np.linalg.norm(p)) for p in points), default=0.0)
        inertia = [np.sqrt(np.trace(body.model.rr_dm) / body.model.mass) for body in self.bodies]
        return max(extent, *map(float, inertia)) or 1.0

    @cached_property
    def _used(self) -> dict[str, tuple[str, ...]]:
        """`used_interfaces` by the name of the body."""
        pairs: tuple[Any, ...] = (*self.joints, *(driver for driver in self.drivers if isinstance(driver, PointDriver)))
        at = {*loaded_markers(self), *(end for pair in pairs for end in (pair.i, pair.j))}
        return {
            body.name: tuple(i.name for i in body.model.interfaces if f"{owner(body)}.{i.name}" in at)
            for body in self.bodies
        }

    def __post_init__(self) -> None:
        for key, kinds in _DECLARATIONS.items():
            object.__setattr__(self, key, several(f"{key} of a scene", getattr(self, key), kinds or kinds_in(key)))
        for key, found in taken_apart(self).items():
            object.__setattr__(self, key, found)
        if not isinstance(self.ground, Mapping):
            raise InputError(f"ground is {self.ground!r}; give points by name, such as {{'wall': (0, 0, 0)}}")
        points = {key: _vector(at, 3, f"ground point {key!r}") for key, at in self.ground.items()}
        for key, at in points.items():
            check_point("ground point", key, at)
        object.__setattr__(self, "ground", points)
        steady, base = _split_gravity(self.gravity, _acceleration("base_acceleration", self.base_acceleration))
        object.__setattr__(self, "gravity", _vector(steady, 3, "gravity"))
        object.__setattr__(self, "base_acceleration", base)
        if self.plane not in ("auto", "x", "y", "z", "none"):
            raise InputError(f"plane is {self.plane!r}; it must be 'auto', 'none', or the normal 'x', 'y' or 'z'")
        if not self.bodies:
            raise InputError("a scene needs at least one body")
        _check_names(self)
        _check_joints(self)
        object.__setattr__(self, "joints", tuple(_as_drawn(self, joint) for joint in self.joints))
        for driver in self.drivers:
            if isinstance(driver, Driver):
                driver_word(driver, joint_of(self, driver))
            else:
                _check_point_driver(self, driver)
        for coupling in self.couplings:
            coupling_word(coupling, *joints_of(self, coupling))
        for force in forces_of(self):
            force.check(self)
        for measurement in self.measurements:
            _check_measurement(self, measurement)

    def _title(self) -> str:
        elastic = sum(body.model.n for body in self.bodies)
        bodies = "one body" if len(self.bodies) == 1 else f"{len(self.bodies)} bodies"
        return f"Scene {self.name!r}: {bodies} with {elastic} elastic coordinates"

    def _rows(self) -> Rows:
        bodies = [f"{body.name} ({body.model.n} modes)" if body.model.n else body.name for body in self.bodies]
        joints = [f"{joint.name} ({joint.kind})" for joint in self.joints]
        others = {key: [thing.name for thing in getattr(self, key)] for key in ("drivers", "couplings")}
        forces = [thing.name for thing in (*self.loads, *self.springs, *self.forces)]
        named = {"bodies": bodies, "joints": joints, **others, "forces": forces}
        named |= {"measurements": [m.name for m in self.measurements], "ground": list(self.ground)}
        rows = [(key, listed(names)) for key, names in named.items() if names]
        return [*rows, ("gravity [m/s^2]", f"{numbers(self.gravity)}, plane {self.plane!r}")]


_DECLARATIONS: dict[str, tuple[Any, ...]] = {
    "bodies": (Body,),
    "joints": (Joint,),
    "drivers": (Driver, PointDriver),
    "couplings": (Coupling,),
    "loads": (),  # the kinds of force that are known then
    "springs": (),
    "forces": (),
    "measurements": get_args(AnyMeasurement),
}


def require_scene(given: Any) -> None:
    """InputError for what is no scene, such as the name of a file."""
    if not isinstance(given, Scene):
        raise InputError(f"the scene is {in_short(given)}, not a Scene; load_scene(path)[0] is that of a scene file")


def length_of(scene: Scene) -> float:
    """[m] of a scene: to the farthest interface of a body, or the largest radius of gyration; one of mere points."""
    return scene._length


def markers(scene: Scene) -> tuple[MarkerName, ...]:
    """All markers as (body number, body name, point name): every interface of every body, then the ground's points."""
    return scene._markers


def marker_names(scene: Scene) -> tuple[str, ...]:
    """Names "body.interface" in the order of `markers`."""
    return tuple(scene._numbers)


def used_interfaces(scene: Scene, body: Body) -> tuple[str, ...]:
    """The interfaces of a body at which joints, driven points, loads, springs or bushings act."""
    return scene._used[body.name]


def marker_number(scene: Scene, name: str) -> int:
    """Index of a marker; InputError says which body or interface does not exist and what there is."""
    names = scene._numbers
    check_name("marker", "name", name)
    if name in names:
        return names[name]
    body, _, point = name.partition(".")
    bodies = [GROUND, *dict.fromkeys(map(owner, scene.bodies))]
    if body not in bodies:
        raise InputError(f"marker {name!r}: there is no body {body!r}; {_offer(body, bodies)}")
    if not point:
        raise InputError(f"marker {name!r}: write BODY.POINT, as there may be several points of a body")
    there = [n.partition(".")[2] for n in names if n.partition(".")[0] == body]
    raise InputError(f"marker {name!r}: body {body!r} has no interface {point!r}; {_offer(point, there)}")


def joint_of(scene: Scene, driver: Driver) -> Joint:
    """The joint a driver acts on."""
    return _joint(scene, driver.joint, f"driver {driver.name!r}")


def joints_of(scene: Scene, coupling: Coupling) -> tuple[Joint, Joint]:
    """Both joints of a coupling."""
    (first, _), (second, _) = coupled(coupling)
    who = f"coupling {coupling.name!r}"
    return _joint(scene, first, who), _joint(scene, second, who)


def joint_with(scene: Scene, name: str, coordinate: str, who: str) -> Joint:
    """The joint of a name. Raises InputError when there is none, or it has no such coordinate."""
    joint = _joint(scene, name, who)
    if coordinate not in COORDINATES[joint.kind]:
        has = ", ".join(COORDINATES[joint.kind]) or "none"
        raise InputError(f"{who}: the {joint.kind} joint {name!r} has no coordinate {coordinate!r}; it has: {has}")
    return joint


def body_number(scene: Scene, name: str, who: str) -> int:
    """The number of a body. Raises InputError when there is none of that name."""
    names = [body.name for body in scene.bodies]
    if name in names:
        return names.index(name)
    if parts := wholes(scene.bodies).get(name):
        raise InputError(f"{who}: body {name!r} is in parts; name one: {', '.join(part.name for part in parts)}")
    raise InputError(f"{who}: there is no body {name!r}; {_offer(name, names)}")


def body_normal(body: Body, normal: int) -> int:
    """The body axis along the global axis `normal`, or -1."""
    return body._along[normal]


def undeformed(scene: Scene, number: int) -> Array:
    """(3,) [m] global place of a marker as the scene declares it."""
    b, _, point = markers(scene)[number]
    if b == len(scene.bodies):
        return np.asarray(scene.ground[point])
    body = scene.bodies[b]
    place: Array = body.position + body._axes @ body.model.interface(point).position
    return place


def _joint(scene: Scene, name: str, who: str) -> Joint:
    for joint in scene.joints:
        if joint.name == name:
            return joint
    raise InputError(f"{who}: there is no joint {name!r}; {_offer(name, [j.name for j in scene.joints])}")


def _check_point_driver(scene: Scene, driver: PointDriver) -> None:
    i, j = (markers(scene)[marker_number(scene, name)] for name in (driver.i, driver.j))
    if i[0] == j[0]:
        raise InputError(f"driver {driver.name!r} drives {i[1]!r} against itself; it needs markers of two bodies")


def measured_body(scene: Scene, measurement: StressMeasurement | SectionMeasurement) -> int:
    """The body whose stress or section forces are measured; of a whole in parts the one nearest to the place."""
    parts = wholes(scene.bodies).get(measurement.body, [])
    nearest = nearest_surface(measurement, [part.model.surface for part in parts])
    name = parts[nearest].name if parts else measurement.body
    return body_number(scene, name, f"measurement {measurement.name!r}")


def _check_measurement(scene: Scene, measurement: AnyMeasurement) -> None:
    if not isinstance(measurement, Measurement):
        _check_stress(measurement, scene.bodies[measured_body(scene, measurement)])
        return
    marker_number(scene, measurement.i), marker_number(scene, measurement.j)
    known = ["global", *(body.name for body in scene.bodies)]
    if measurement.axes not in known:
        raise InputError(
            f"measurement {measurement.name!r}: there are no axes {measurement.axes!r}; {_offer(measurement.axes, known)}"
        )


def _check_stress(measurement: StressMeasurement | SectionMeasurement, body: Body) -> None:
    """The body has what is to be measured, near the place."""
    try:
        measured_modes(measurement, body.model.surface)
    except InputError as error:
        raise InputError(f"measurement {measurement.name!r}: {error}") from None


def _offer(name: str, known: Iterable[str]) -> str:
    known = list(known)
    close = difflib.get_close_matches(name, known, 1)
    hint = f"did you mean {close[0]!r}? " if close else ""
    return f"{hint}there are: {', '.join(map(repr, known)) or 'none'}"


def _check_names(scene: Scene) -> None:
    """One name, one thing: results are named by them."""
    things: tuple[Any, ...] = (
        *scene.bodies,
        *scene.joints,
        *scene.drivers,
        *scene.couplings,
        *scene.loads,
        *scene.springs,
        *scene.forces,
        *scene.measurements,
    )
    names = [thing.name for thing in things]
    for thing in things:
        check_own_name(type(thing).__name__, thing.name)
    repeated = sorted(name for name, count in Counter(names).items() if count > 1)
    if repeated:
        raise InputError(f"the name {repeated[0]!r} is used more than once in the scene; every name must be its own")
    for name in names:
        if name in RESERVED or not name.replace("_", "a").replace("-", "a").isalnum():
            raise InputError(
                f"{name!r} cannot be a name: use letters, digits, '_' and '-'; {', '.join(map(repr, RESERVED))} are taken"
            )


def _as_drawn(scene: Scene, joint: Joint) -> Joint:
    """The joint; a fixed one without axes with those that keep its bodies turned to each other as they are drawn, in all
    scenes that are made of this one, wherever its bodies are there."""
    if joint.kind != "fixed" or joint.axis is not None or joint.axis_j is not None:
        return joint
    on = (markers(scene)[marker_number(scene, end)][0] for end in (joint.i, joint.j))
    A_i, A_j = (rotation_matrix(scene.bodies[b].rotation) if b < len(scene.bodies) else np.eye(3) for b in on)
    turn = A_j.T @ A_i
    parallel = np.abs(turn - np.eye(3)).max() < _PARALLEL
    return replace(joint, axis=ALONG_Z) if parallel else replace(joint, axis=np.eye(3).tolist(), axis_j=turn.tolist())


def _check_joints(scene: Scene) -> None:
    table = markers(scene)
    for joint in scene.joints:
        i, j = (marker_number(scene, name) for name in (joint.i, joint.j))
        if table[i][0] == table[j][0]:
            raise InputError(f"joint {joint.name!r} ties {table[i][1]!r} to itself; a joint needs two different bodies")


Components = tuple[TimeFunction, TimeFunction, TimeFunction]


def _acceleration(what: str, value: Any) -> Components:
    x, y, z = (as_time_function(component, what) for component in _three(what, value))
    return x, y, z


def _three(what: str, value: Any) -> Any:
    if not isinstance(value, (Sequence, np.ndarray)) or isinstance(value, str) or len(value) != 3:
        hint = "3 numbers or functions of time such as (0, -9.81, 0)"
        raise InputError(f"{what} needs three components, {hint}, not {value!r}")
    return value


def _split_gravity(gravity: Any, base: Components) -> tuple[Any, Components]:
    """The constant components of gravity, and the base acceleration less those that vary."""
    if all(isinstance(component, (int, float, np.floating, np.integer)) for component in _three("gravity", gravity)):
        return gravity, base
    given = _acceleration("gravity", gravity)
    steady = [f.data[0] if _is_constant(f) else 0.0 for f in given]
    x, y, z = (b if _is_constant(g) else less(b, g) for g, b in zip(given, base, strict=True))
    return steady, (x, y, z)


def _is_constant(function: TimeFunction) -> bool:
    return function.kind == POLYNOMIAL and not any(function.data[1:])


def _vector(value: Any, size: int, what: str) -> Array:
    try:
        vector = np.array(value, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{what} must be {size} numbers, not {value!r}") from None
    if vector.shape != (size,):
        raise InputError(f"{what} must be {size} numbers, not {value!r}")
    if not (np.abs(vector) < _MOST).all():
        raise InputError(
            f"{what} holds values that are not finite, or beyond {_MOST:g}: {value!r}; give them in SI units"
        )
    vector.setflags(write=False)
    return vector
