"""The schema of scene files: models of its tables, made from the declarations of `ffr_dyn` themselves.

A kind of joint, driver or force is a dataclass; its fields are the keys of its entry in the file. Forces say themselves how
a file gives their fields. Another new kind is an entry in `tables`, and one in `FIELDS` for each of its fields whose type the
dataclass leaves open (Any).
"""

from __future__ import annotations

import typing
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, Field, dataclass, fields
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import (
    BaseModel,
    Discriminator,
    Tag,
    create_model,
    model_validator,
)
from pydantic import Field as Key

from ffr_dyn.analyses.efforts import JointEffort, MarkerEffort
from ffr_dyn.analyses.events import Event
from ffr_dyn.analyses.inversion.bounded import Bounded
from ffr_dyn.analyses.mixed import Causal
from ffr_dyn.analyses.registry import OverTime, analyses, analysis
from ffr_dyn.analyses.settings import settings_of
from ffr_dyn.functions.curves import Curve
from ffr_dyn.integrators import CONTROLLED, METHODS, methods
from ffr_dyn.integrators.stabilisation import Projection
from ffr_dyn.scene import fields as said
from ffr_dyn.scene import forces as _known_forces  # noqa: F401 - which makes them known
from ffr_dyn.scene.couplings import Coupling
from ffr_dyn.scene.drivers import Driver, PointDriver
from ffr_dyn.scene.force_kinds import FORCES, kinds_in
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.sensors import Measurement, SectionMeasurement, StressMeasurement
from ffr_dyn.scene_file.values import (
    THREE,
    In,
    Inertia,
    Metres,
    Number,
    Quantity,
    Seconds,
    Vector,
    each,
    of_motion,
    of_time,
    or_curve,
    six,
)
from ffr_prep.common.strict import Strict

Direction = Vector | list[Vector]


@dataclass(frozen=True)
class Coupled:
    """Unit of the `ratio` or the `offset` of a coupling, by its two joint coordinates."""

    which: str

    def of(self, entry: Mapping[str, Any]) -> str:
        first, second = (_unit_of_coordinate(entry.get(key)) for key in ("first", "second"))
        if "" in (first, second):
            return "1 or m/rad or m or rad/m or 1/m" if self.which == "ratio" else "rad or m"
        if self.which == "offset":
            return second
        return "1" if first == second else "m/rad or m" if second == "m" else "rad/m or 1/m"


@dataclass(frozen=True)
class Named:
    """Unit of the quantity or the input that another field names by its last word; any where that says nothing."""

    field: str

    def of(self, entry: Mapping[str, Any]) -> str:
        words = [word for word in str(entry.get(self.field)).split(".") if word not in "xyz"]
        return BY_WORD.get(words[-1] if words else "", "")


# Units of what results and inputs are called.
BY_WORD = {
    **{"position": "m", "velocity": "m/s", "acceleration": "m/s^2", "base": "m/s^2"},
    **{"displacement": "m", "stroke": "m", "stroke_rate": "m/s", "stroke_acceleration": "m/s^2"},
    **{"angle": "rad", "angle_rate": "rad/s", "angle_acceleration": "rad/s^2", "omega": "rad/s"},
    **{"force": "N", "moment": "N m", "power": "W", "total": "J", "kinetic": "J", "strain": "J"},
}


def _unit_of_coordinate(name: Any) -> str:
    return {"angle": "rad", "stroke": "m"}.get(str(name).rpartition(".")[2], "")


# ---- tables of the file from dataclasses --------------------------------------------------------------------------

# Types of the fields that the dataclasses leave open, by "Class.field"; forces and joints say them themselves
# (`ffr_dyn.scene.fields`).
FIELDS: dict[str, Any] = {
    "Driver.function": of_time(said.COORDINATE),
    "Coupling.ratio": Annotated[float, In(Coupled("ratio"))],
    "Coupling.offset": Annotated[float, In(Coupled("offset"))],
    "MarkerEffort.direction": Vector,
    "Bounded.before": Seconds | None,
    "Bounded.after": Seconds | None,
    "Causal.tolerance": Number,
    "Causal.growth": Number,
    "Periodic.period": Seconds,
    "Periodic.step": Seconds,
    "PointDriver.x": of_time("m"),
    "PointDriver.y": of_time("m"),
    "PointDriver.z": of_time("m"),
    "StressMeasurement.point": Metres,
    "SectionMeasurement.point": Metres,
    "Event.quantity": str,
    "Event.value": Annotated[float, In(Named("quantity"))],
    "Forced.amplitude": Annotated[float, In(Named("input"))],
    "Event.direction": Literal["rising", "falling", "either"],
}

DECIDE = ("coordinate", "normal", "first", "second")  # fields on which units of others depend; they are read first

# Fields that a file cannot hold: Python functions, and the name, which is the key of the entry.
NOT_IN_FILES = ("name", "function")


@dataclass(frozen=True)
class Kind:
    """A dataclass whose instances are entries of a table; `word` is their `kind`, "" where a table has one kind only."""

    word: str
    made: type


def tables() -> dict[str, tuple[Kind, ...]]:
    """Tables of the file, which are fields of `Scene`. The first kind is meant where an entry does not say."""
    return {
        "joints": (Kind("", Joint),),
        "drivers": (Kind("joint", Driver), Kind("point", PointDriver)),
        "couplings": (Kind("", Coupling),),
        **{table: tuple(Kind(kind.word, kind) for kind in kinds_in(table)) for table in ("loads", "springs", "forces")},
        "measurements": (
            Kind("marker", Measurement),
            Kind("stress", StressMeasurement),
            Kind("section", SectionMeasurement),
        ),
    }


EFFORTS = (Kind("joint", JointEffort), Kind("marker", MarkerEffort))  # tables of an analysis
EVENTS = (Kind("", Event),)
SOLUTIONS = (Kind("causal", Causal), Kind("bounded", Bounded))


def keys_of(kind: Kind) -> list[Field[Any]]:
    """The fields of a kind that a file holds."""
    hints = _hints(kind.made)
    return [f for f in fields(kind.made) if _annotated(kind, f, hints) or f.name not in NOT_IN_FILES]


def fields_of_motion(made: type) -> list[str]:
    """The fields of a force whose formulas of the motion go to its field `function`."""
    return [name for name, hint in _hints(made).items() if said.OfMotion in map(type, _leaves(hint))]


def formula_of(force: Any) -> Any:
    """The Python function of the motion that a force has, or None."""
    return force.function if fields_of_motion(type(force)) else None


def _leaves(hint: Any) -> list[Any]:
    return [meta.of if isinstance(meta, said.Three) else meta for meta in getattr(hint, "__metadata__", ())]


@cache
def _hints(made: type) -> dict[str, Any]:
    return typing.get_type_hints(made, include_extras=True)


def _annotated(kind: Kind, f: Field[Any], hints: Mapping[str, Any]) -> bool:
    """Whether it is said how a file gives the field."""
    return f"{kind.made.__name__}.{f.name}" in FIELDS or bool(_leaves(hints[f.name]))


def _type(kind: Kind, f: Field[Any], hints: Mapping[str, Any]) -> Any:
    """The type of a key: from `FIELDS`, or as the dataclass says."""
    found = FIELDS.get(f"{kind.made.__name__}.{f.name}") or _given(hints[f.name])
    return found | None if _default(f) is None else found


def _default(f: Field[Any]) -> Any:
    """The default of a key; None where the dataclass has no limit (JSON has no infinity)."""
    if isinstance(f.default, tuple):
        return list(f.default)
    return None if f.default in (np.inf, -np.inf) else f.default


def _given(hint: Any) -> Any:
    """The type of a key for a field of this type, or the closer one that the field declares (`ffr_dyn.scene.fields`)."""
    match hint:
        case said.In(unit):
            return Annotated[float, In(unit)]
        case said.Curved(unit, at, force):
            return or_curve(unit, at, force)
        case said.Six():
            return six(hint)
        case said.OfTime(unit):
            return of_time(unit)
        case said.OfMotion(unit):
            return of_motion(unit)
        case said.Three(of):
            return Annotated[list[_given(of)], THREE]  # type: ignore[misc]
        case said.OneOrMore(of):
            return _given(of) | list[_given(of)]  # type: ignore[misc]
        case said.Direction():
            return Direction
    if hint is float:
        return Quantity
    if said_more := getattr(hint, "__metadata__", ()):
        return _given(said_more[0])
    parts = typing.get_args(hint)
    if not parts:
        return hint
    if Curve in parts:
        return or_curve()
    inner = tuple(map(_given, parts))
    return list[inner] if typing.get_origin(hint) is list else typing.Union[inner]  # type: ignore[valid-type] # noqa: UP007


def entry_model(kind: Kind) -> type[BaseModel]:
    """The model of an entry of this kind."""
    hints = _hints(kind.made)
    keys: dict[str, Any] = {"kind": (Literal[kind.word], kind.word)} if kind.word else {}
    for f in sorted(keys_of(kind), key=lambda f: f.name not in DECIDE):
        keys[f.name] = (_type(kind, f, hints), ... if f.default is MISSING else _default(f))
    return create_model(f"{kind.made.__name__}Entry", __base__=Strict, __doc__=kind.made.__doc__, **keys)


def _table_model(kinds: tuple[Kind, ...]) -> Any:
    """dict of entries, of one kind or of several that say which."""
    models = [entry_model(kind) for kind in kinds]
    if len(models) == 1:
        return dict[str, models[0]]  # type: ignore[valid-type]
    return dict[str, _one_of(models, [kind.word for kind in kinds])]  # type: ignore[misc]


def _one_of(models: Sequence[type[BaseModel]], words: Sequence[str]) -> Any:
    """An entry whose `kind` says which model it is of; without it, the first."""
    tagged = tuple(Annotated[model, Tag(f"[{word}]")] for model, word in zip(models, words, strict=True))
    which = Discriminator(
        lambda given: f"[{given.get('kind', words[0]) if isinstance(given, dict) else getattr(given, 'kind', None)}]",
        custom_error_type="kind",
        custom_error_message=f"there is no such kind; there are {', '.join(words)}",
    )
    return Annotated[typing.Union[tagged], which]  # noqa: UP007


# ---- bodies, analysis, the scene ----------------------------------------------------------------------------------


class BodyEntry(Strict):
    """A flexible body from a file, or a rigid one from its mass and named points.

    file : body file of `ffr-prep`, relative to the scene file
    modes : keep the first so many modes; default: all
    mass : [kg] of a rigid body
    inertia : of a rigid body about its centre of mass, body axes [kg m^2]: three principal values, or 3 x 3
    centre_of_mass : of a rigid body, in its frame [m]
    r_dm : first moment of mass about the origin [kg m], in place of centre_of_mass
    rr_dm : second moment about the origin, the integral of r r^T [kg m^2], in place of inertia
    points : named points in the body frame [m]; of a body from a file, the nearest nodes of its surface
    position : origin of the body frame, global [m]; a first guess that assembly corrects
    rotation : rotation vector [rad], or four Euler parameters, scalar first; a first guess
    velocity : of the origin, global [m/s]
    omega_bar : angular velocity, body axes [rad/s]
    q : elastic coordinates at the start [m sqrt(kg)]; default: zero
    q_dot : their rates [m sqrt(kg)/s]; default: zero
    damping : modal damping ratio [1], one for all modes or a list; of a second-order body, of the modes of its mean-axis form
    rayleigh : alpha [1/s] and beta [s] of the damping matrix alpha M + beta K
    loss_factor : of the material [1]: each mode is damped by half of it
    damping_bands : pairs of frequency [Hz], ascending, and damping ratio [1] of the modes up to there
    stiffening : true: moves to second order, if the body has load matrices; false: linear
    drop : inertia terms that the equations of motion leave out
    """

    file: Path | None = None
    modes: Annotated[int, Key(ge=0)] | None = None
    mass: Annotated[float, In("kg")] | None = None
    inertia: Inertia | list[Inertia] | None = None
    centre_of_mass: Metres = [0.0, 0.0, 0.0]
    r_dm: Annotated[list[Annotated[float, In("kg m")]], THREE] | None = None
    rr_dm: list[Inertia] | None = None
    points: dict[str, Metres] = {}
    position: Metres = [0.0, 0.0, 0.0]
    rotation: list[Annotated[float, In("rad")]] | list[Vector] = [0.0, 0.0, 0.0]
    velocity: Annotated[list[Annotated[float, In("m/s")]], THREE] = [0.0, 0.0, 0.0]
    omega_bar: Annotated[list[Annotated[float, In("rad/s")]], THREE] = [0.0, 0.0, 0.0]
    q: list[Number] | None = None
    q_dot: list[Number] | None = None
    damping: Number | list[Number] = 0.0
    rayleigh: each("1/s", "s") | None = None  # type: ignore[valid-type]
    loss_factor: Annotated[float, Key(ge=0)] = 0.0
    damping_bands: list[each("Hz", "1")] = []  # type: ignore[valid-type]
    stiffening: bool = True
    drop: list[Literal["I3", "I4", "I5", "I8", "I9"]] = []

    @model_validator(mode="after")
    def _kind(self) -> BodyEntry:
        if (self.file is None) == (self.mass is None):
            raise ValueError("give either file (a body from ffr-prep) or mass and inertia (a rigid body)")
        if self.mass is not None and (self.inertia is None) == (self.r_dm is None or self.rr_dm is None):
            raise ValueError(
                "a rigid body needs inertia, about its centre of mass: three principal values or 3 x 3 (or r_dm and rr_dm)"
            )
        return self


class MarkerEntry(Strict):
    """One more point of a body, or of the ground: joints, loads and measurements know it as "body.name".

    body : name of the body, or "ground"
    point : where it is, in the axes of the body [m]
    """

    body: str
    point: Metres


class StabilisationEntry(Strict):
    """How the constraints are kept; see `ffr_dyn.integrators.stabilisation`.

    kind : "projection" back to the constraints, "baumgarte" feedback, or "none"
    tolerance : of projection: how far constraints may be left [m, -]
    alpha, beta : gains of "baumgarte", for rates and for positions [1/s]
    """

    kind: Literal["projection", "baumgarte", "none"] = "projection"
    tolerance: Annotated[float, In("m or rad or 1"), Key(gt=0)] = Projection().tolerance
    alpha: Annotated[float, In("1/s"), Key(gt=0)] | None = None
    beta: Annotated[float, In("1/s"), Key(gt=0)] | None = None

    @model_validator(mode="after")
    def _with_its_gains(self) -> StabilisationEntry:
        if (self.kind == "baumgarte") != (self.alpha is not None and self.beta is not None):
            raise ValueError('"baumgarte" needs alpha and beta [1/s], such as 0.1 / step; the other kinds take none')
        return self


class TolerancesEntry(Strict):
    """Tolerances of the error of a step: absolute values, plus `relative` of each coordinate's size; see `Tolerances`.

    relative : of each coordinate's size [1]
    position : absolute, of points [m] and rotations [rad]
    velocity : absolute, of points [m/s] and angular velocities [rad/s]
    elastic : absolute, of elastic displacements [m]
    """

    relative: Annotated[Number, Key(gt=0)] = 1e-6
    position: Annotated[float, In("m"), Key(gt=0)] = 1e-7
    velocity: Annotated[float, In("m/s"), Key(gt=0)] = 1e-6
    elastic: Annotated[float, In("m"), Key(gt=0)] = 1e-8


class _Span(Strict):
    """A time with rows of the result.

    start, end : of the run [s]
    output_step : a row of the result every so many seconds [s]
    """

    end: Seconds
    output_step: Annotated[float, In("s"), Key(gt=0)]
    start: Seconds = 0.0


class _Moment(Strict):
    """One time.

    time : of the analysis [s]: functions of time are taken there
    """

    time: Seconds = 0.0


class _Integrated(_Span):
    """A run by a method with steps.

    method : integrator, by its name: `ffr-dyn methods` lists them
    step : [s] of a method with steps of one length; default: found, so that the accuracy is kept
    accuracy : relative error that the found step keeps [1]; default: 1e-3
    tolerances : of a method that chooses its steps
    settings : of the method, beside its step: {spectral_radius = 0.6}
    stabilisation : how constraints are kept
    """

    method: str = "ros2"
    step: Annotated[float, In("s"), Key(gt=0)] | None = None
    accuracy: Annotated[Number, Key(ge=1e-8, le=1)] | None = None
    tolerances: TolerancesEntry | None = None
    settings: dict[str, bool | int | float | str] = {}

    @model_validator(mode="after")
    def _one_of_both(self) -> _Integrated:
        controlled = self.method in CONTROLLED
        if controlled and self.step is not None:
            raise ValueError(f"{self.method} chooses its steps: give 'tolerances' in place of 'step'")
        if not controlled and self.tolerances is not None:
            raise ValueError(f"{self.method} takes steps of one length: give 'step' in place of 'tolerances'")
        if self.accuracy is not None and (controlled or self.step is not None):
            given = "tolerances" if controlled else "step"
            raise ValueError(f"accuracy: the step is found that keeps it; leave out {given}, or the accuracy")
        known = [] if controlled else settings_of(METHODS[self.method])
        for name in self.settings:
            if name not in known:
                there = f"it has {', '.join(known)}" if known else "it has none"
                raise ValueError(f"settings: {self.method} has no setting {name!r}; {there}")
        for f in [] if controlled else fields(METHODS[self.method]):
            is_text = isinstance(f.default, str)
            if f.name in self.settings and isinstance(self.settings[f.name], str) != is_text:
                wanted = "a text" if is_text else "a number, without a unit"
                raise ValueError(f"settings: {f.name} of {self.method} is {wanted}, not {self.settings[f.name]!r}")
        return self


def nested_kinds(hint: Any) -> tuple[Kind, ...]:
    """The kinds of the declarations that the field of an analysis holds, several or one; () where it holds none."""
    held = {part for outer in (hint, *typing.get_args(hint)) for part in (outer, *typing.get_args(outer))}
    return next((kinds for kinds in (EFFORTS, EVENTS, SOLUTIONS) if {kind.made for kind in kinds} <= held), ())


def holds_several(hint: Any) -> bool:
    """Whether a field holds a tuple of declarations, which are a table of the file."""
    return typing.get_origin(hint) is tuple


def _analysis_model(word: str, made: Any) -> type[BaseModel]:
    """The model of the table [analysis] of one kind: times, what it needs to integrate, and its own fields."""
    over_time, hints = issubclass(made, OverTime), typing.get_type_hints(made)
    base: Any = (_Integrated if made.integrates else _Span) if over_time else _Moment
    keys: dict[str, Any] = {"kind": (Literal[word], "forward" if word == "forward" else ...)}
    if over_time and made.integrates:
        keys["method"] = (Literal[tuple(methods())], "ros2")
    if over_time and made.stabilised:
        keys["stabilisation"] = (StabilisationEntry, StabilisationEntry())
    for f in fields(made):
        keys[f.name] = _own_key(f, hints[f.name], FIELDS.get(f"{made.__name__}.{f.name}"))
        if names := f.metadata.get("names"):
            keys[names] = (Annotated[list[str], Key(description=f"names of {names} of the scene, beside these")], [])
    return create_model(f"{made.__name__}Entry", __base__=base, __doc__=made.__doc__, **keys)


def _own_key(f: Field[Any], hint: Any, known: Any) -> tuple[Any, Any]:
    """Type, where it is known, and default of the key for a field of an analysis, with what its option says of it."""
    given, default = _bare_key(f, hint)
    given = known or given
    said = f.metadata.get("help")
    return (Annotated[given, Key(description=said.replace("; repeat", ""))] if said else given), default


def _bare_key(f: Field[Any], hint: Any) -> tuple[Any, Any]:
    default = ... if f.default is MISSING or f.metadata.get("required") else f.default
    if kinds := nested_kinds(hint):
        if holds_several(hint):
            table = _table_model(kinds)
            return (Annotated[table, Key(min_length=1)], ...) if default is ... else (table, {})
        return _one_of([entry_model(kind) for kind in kinds], [kind.word for kind in kinds]) | None, default
    names = tuple[str, ...]
    if hint == names or hint == names | None:
        return (list[str], []) if default == () else (Annotated[list[str], Key(min_length=1)] | None, default)
    if typing.get_origin(hint) is Literal:
        return hint, default
    return _given(hint), list(default) if isinstance(default, tuple) else default


class _ChartEntry(Strict):
    """The variants that `ffr-dyn chart` compares: steps [s] or tolerances by method, empty lists where they are to be chosen.

    measures : what the error is of, such as "deflection:rod"; default: those that fit the scene
    methods : steps [s] or tolerances for each method; an empty list where they are to be chosen; default: all methods
    modes : numbers of modes to compare, or "all"
    drop : sets of terms to leave out, one after the other
    """

    measures: list[str] = []
    methods: dict[str, list[Annotated[float, In("s or 1"), Key(gt=0)]]] = {}
    modes: Annotated[list[Annotated[int, Key(ge=0)] | Literal["all"]], Key(min_length=1)] = ["all"]
    drop: list[list[Literal["I3", "I4", "I5", "I8", "I9", "stiffening"]]] = []


class _SceneBase(Strict):
    """A scene.

    name : title of the scene, in results and pictures
    include : other scene files that are merged into this one, relative to it
    parameters : numbers and texts with units for formulas, and for "${name}" in any text
    inputs : values that another program sets while it steps the scene, by name, with what they start from
    outputs : quantities or patterns that the result keeps; "default" stands for the usual ones
    gravity : acceleration of free fall, global axes [m/s^2]: numbers or functions of time
    base_acceleration : of the ground, global axes [m/s^2]: numbers or functions of time
    plane : "auto" finds whether the motion is planar, and computes it in its plane; "x", "y" or "z": it is, with this
        normal; "none" does not look
    ground : named points of the ground, global [m]
    bodies : bodies by name
    markers : further points of bodies by name
    analysis : what is computed
    chart : what `ffr-dyn chart` compares
    joints, drivers, couplings : joints, prescribed motions and gears, by name
    loads, springs, forces : forces by name: of loads, of springs along a line, and all others, which say their kind
    measurements : quantities that the scene names
    """

    name: str = "scene"
    include: list[str] = []
    parameters: dict[str, Any] = {}
    inputs: dict[str, Quantity] = {}
    outputs: list[str] = ["default"]
    gravity: Annotated[list[of_time("m/s^2")], THREE] = [0.0, 0.0, 0.0]  # type: ignore[valid-type]
    base_acceleration: Annotated[list[of_time("m/s^2")], THREE] = [0.0, 0.0, 0.0]  # type: ignore[valid-type]
    plane: Literal["auto", "none", "x", "y", "z"] = "auto"
    ground: dict[str, Metres] = {}
    bodies: dict[str, BodyEntry]
    markers: dict[str, MarkerEntry] = {}


def scene_entry() -> Any:
    """The model of a scene file, with all analyses, methods and kinds of force that are known now."""
    return _scene_entry(tuple(analyses()), tuple(methods()), tuple(FORCES))


@cache
def _scene_entry(words: tuple[str, ...], method_names: tuple[str, ...], forces: tuple[type, ...]) -> Any:
    steps = dict[Literal[method_names], list[Annotated[float, In("s or 1"), Key(gt=0)]]]  # type: ignore[valid-type]
    chart: Any = create_model("ChartEntry", __base__=_ChartEntry, __doc__=_ChartEntry.__doc__, methods=(steps, {}))
    one = _one_of([_analysis_model(word, analysis(word)) for word in words], words)
    return create_model(
        "SceneEntry",
        __base__=_SceneBase,
        __doc__="A scene file of ffr-dyn, after its includes are merged and its parameters put in.",
        analysis=(one, ...),
        chart=(chart, chart()),
        **{name: (_table_model(kinds), {}) for name, kinds in tables().items()},  # type: ignore[call-overload]
    )


def home(key: str, where: Sequence[str]) -> str:
    """Where an entry that stands elsewhere belongs; empty for a key that no scene has at its top or in [analysis]."""
    if where and (of := scene_entry().model_fields.get(key)) is not None:
        is_table = "dict" in str(of.annotation) or key in ("analysis", "chart")
        top = f"as a table of its own, [{key}]" if is_table else "at the top of the file, before the first [table]"
        return f"an entry of that name belongs {top}"
    known = (_analysis_model(word, analysis(word)) for word in analyses())
    return "it belongs in the table [analysis]" if not where and any(key in one.model_fields for one in known) else ""


def schema() -> dict[str, Any]:
    """The JSON schema of scene files (draft 2020-12)."""
    found: dict[str, Any] = scene_entry().model_json_schema()
    return found
