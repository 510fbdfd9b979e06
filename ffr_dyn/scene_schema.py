"""What a scene file may hold: models of its tables, made from the declarations of `ffr_dyn` themselves.

A kind of joint, driver or force is a dataclass; its fields are the keys of its entry in the file. A new kind is an entry in
`TABLES`, and an entry in `FIELDS` for each of its fields whose type the dataclass leaves open (Any).
"""

from __future__ import annotations

import difflib
import typing
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, Field, dataclass, fields
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Discriminator,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    Tag,
    ValidationInfo,
    create_model,
    model_validator,
)
from pydantic import Field as Key
from pydantic_core import CoreSchema, core_schema

from ffr_dyn.analyses.bounded import Bounded
from ffr_dyn.analyses.efforts import JointEffort, MarkerEffort
from ffr_dyn.analyses.mixed import Causal
from ffr_dyn.couplings import Coupling
from ffr_dyn.curve import Curve
from ffr_dyn.drivers import Driver, PointDriver
from ffr_dyn.errors import InputError
from ffr_dyn.forces import Bushing, Load, SpringDamper
from ffr_dyn.formula import Expression, is_constant, parse
from ffr_dyn.integrators import CONTROLLED, METHODS
from ffr_dyn.joint_forces import Actuator, JointFriction, JointSpring, JointStop, Servo
from ffr_dyn.joints import Joint
from ffr_dyn.measurement import Measurement, SectionMeasurement, StressMeasurement
from ffr_dyn.parameters import as_number
from ffr_dyn.surface_loads import ModalForce, NodalForces, Pressure
from ffr_dyn.timefunction import HARMONIC, TimeFunction, constant, harmonic, piecewise, polynomial, table
from ffr_dyn.units import split_quantity

# ---- numbers and functions of time --------------------------------------------------------------------------------


@dataclass(frozen=True)
class In:
    """Marks a number that may be given as text as well: with a unit of the same dimension, or as a formula of parameters."""

    unit: str | None = None

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.with_info_before_validator_function(self._read, handler(source))

    def __get_pydantic_json_schema__(self, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        unit = {} if self.unit is None else {"unit": self.unit}
        return {"anyOf": [{"type": "number"}, {"type": "string"}]} | unit

    def _read(self, value: Any, info: ValidationInfo) -> Any:
        if isinstance(value, bool):
            raise ValueError("must be a number")
        return as_number(value, _parameters(info), "it", self.unit) if isinstance(value, str) else value


def _parameters(info: ValidationInfo) -> Mapping[str, Any]:
    return (info.context or {}).get("parameters", {})


THREE = Key(min_length=3, max_length=3)

Number = Annotated[float, In()]
Seconds = Annotated[float, In("s")]
Vector = Annotated[list[Number], THREE]
Metres = Annotated[list[Annotated[float, In("m")]], THREE]
Inertia = Annotated[list[Annotated[float, In("kg m^2")]], THREE]


class _Strict(BaseModel):
    """Unknown keys are mistakes; numbers must be finite."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _known(cls, given: Any) -> Any:
        known = list(cls.model_fields)
        for key in given if isinstance(given, dict) else ():
            if key not in known:
                close = difflib.get_close_matches(str(key), known, 1)
                hint = f"did you mean {close[0]!r}?" if close else f"known are {', '.join(known)}"
                raise ValueError(f"{key!r} is not a known entry here; {hint}")
        return given


class HarmonicEntry(_Strict):
    """mean + amplitude sin(2 pi frequency t + phase); `speed` [rad/s] may stand for 2 pi frequency [Hz]."""

    amplitude: Number
    frequency: Annotated[float, In("Hz")] | None = None
    speed: Annotated[float, In("rad/s")] | None = None
    phase: Annotated[float, In("rad")] = 0.0
    mean: Number = 0.0

    @model_validator(mode="after")
    def _one(self) -> HarmonicEntry:
        if (self.frequency is None) == (self.speed is None):
            raise ValueError("give either frequency [Hz] or speed [rad/s]")
        return self


class PiecewiseEntry(_Strict):
    """Polynomials between `breaks`: for each piece its coefficients, ascending powers of (t - start of the piece)."""

    breaks: list[Number]
    coefficients: list[list[Number]]


class FunctionEntry(_Strict):
    """A function of time by one of these; `table` is times and values, `table_file` two CSV columns of them."""

    formula: str | None = None
    polynomial: list[Number] | None = None
    harmonic: HarmonicEntry | None = None
    table: tuple[list[Seconds], list[Number]] | None = None
    table_file: Path | None = None
    piecewise: PiecewiseEntry | None = None

    @model_validator(mode="after")
    def _one(self) -> FunctionEntry:
        if len(self.model_fields_set) != 1:
            raise ValueError(f"give exactly one of {', '.join(type(self).model_fields)}")
        return self


def _form(value: Any) -> str | None:
    if isinstance(value, bool):
        return None
    kinds = ((str, "[text]"), ((dict, FunctionEntry), "[table]"), ((int, float), "[number]"))
    return next((name for kind, name in kinds if isinstance(value, kind)), None)  # type: ignore[arg-type]


def _expression(value: float | str | FunctionEntry, info: ValidationInfo) -> Expression:
    """What a number, a formula or a table of the file means."""
    parameters = _parameters(info)
    if isinstance(value, FunctionEntry) and value.formula is not None:
        value = value.formula
    if isinstance(value, str):
        if split_quantity(value) is not None:
            return constant(as_number(value, parameters, "it"))
        return parse(value, parameters, "it")
    return _tabled(value) if isinstance(value, FunctionEntry) else constant(value)


def _of_time(value: float | str | FunctionEntry, info: ValidationInfo) -> float | TimeFunction:
    """A number or a function of time."""
    found = _expression(value, info)
    if not isinstance(found, TimeFunction):
        raise ValueError(f"{value!r} depends on the motion; only t and parameters can be used here")
    return found.data[0] if is_constant(found) else found


def _of_time_in(unit: str) -> Callable[[float | str | FunctionEntry, ValidationInfo], float | TimeFunction]:
    """As `_of_time`, for a number with or without a unit of this dimension."""

    def read(value: float | str | FunctionEntry, info: ValidationInfo) -> float | TimeFunction:
        if isinstance(value, str) and split_quantity(value) is not None:
            return as_number(value, _parameters(info), "it", unit)
        return _of_time(value, info)

    return read


def _tabled(entry: FunctionEntry) -> TimeFunction:
    if entry.polynomial is not None:
        return polynomial(*entry.polynomial)
    if entry.harmonic is not None:
        h = entry.harmonic
        if h.speed is not None:
            return TimeFunction(HARMONIC, (h.mean, h.amplitude, h.speed, h.phase))
        return harmonic(amplitude=h.amplitude, frequency=h.frequency or 0.0, phase=h.phase, mean=h.mean)
    if entry.piecewise is not None:
        return _piecewise(entry.piecewise)
    if entry.table is not None:
        return table(np.array(entry.table[0]), np.array(entry.table[1]))
    return _read_table(entry.table_file or Path())


def _piecewise(entry: PiecewiseEntry) -> TimeFunction:
    pieces, width = len(entry.coefficients), len(entry.coefficients[0]) if entry.coefficients else 0
    if pieces == 0 or width == 0 or any(len(row) != width for row in entry.coefficients):
        raise ValueError("coefficients needs as many numbers, one at least, for each piece")
    if len(entry.breaks) != pieces + 1 or not (np.diff(entry.breaks) > 0).all():
        raise ValueError(f"{pieces} pieces need {pieces + 1} breaks that increase")
    return piecewise(np.array(entry.breaks), np.array(entry.coefficients))


def _read_table(file: Path) -> TimeFunction:
    try:
        columns = np.loadtxt(file, delimiter=",", ndmin=2, comments="#")
    except (OSError, ValueError) as error:
        raise InputError(f"{file} is not a file of two columns of numbers, time and value ({error})") from None
    if columns.shape[1] != 2:
        raise InputError(f"{file} has {columns.shape[1]} columns; it needs two, time and value")
    return table(columns[:, 0], columns[:, 1])


_Given = Annotated[
    Annotated[float, Tag("[number]")] | Annotated[str, Tag("[text]")] | Annotated[FunctionEntry, Tag("[table]")],
    Discriminator(_form, custom_error_type="function", custom_error_message="give a number, a formula or a table"),
]
OfTime = Annotated[_Given, AfterValidator(_of_time)]
Acceleration = Annotated[_Given, AfterValidator(_of_time_in("m/s^2"))]
OfMotion = Annotated[_Given, AfterValidator(_expression)]


class CurveEntry(_Strict):
    """`values` over the increasing places `at`: a smooth curve through the points, straight beyond them."""

    at: list[Number]
    values: list[Number]


def or_curve(unit: str | None = None) -> Any:
    """The type of a factor, such as a stiffness: a number, or a curve in its place."""
    plain, curve = Annotated[float, In(unit)], Annotated[CurveEntry, AfterValidator(lambda e: Curve(e.at, e.values))]
    which = Discriminator(lambda given: "[curve]" if isinstance(given, (dict, CurveEntry, Curve)) else "[number]")
    return Annotated[Annotated[plain, Tag("[number]")] | Annotated[curve, Tag("[curve]")], which]


Direction = Vector | list[Vector]

# ---- tables of the file from dataclasses --------------------------------------------------------------------------

# Types of the fields that the dataclasses leave open, and units of those that are numbers; by "Class.field" or "field".
FIELDS: dict[str, Any] = {
    "axis": Direction,
    "axis_j": Direction,
    "Joint.length": OfTime,
    "Joint.pitch": Annotated[float, In("m")],
    "Driver.function": OfTime,
    "PointDriver.x": OfTime,
    "PointDriver.y": OfTime,
    "PointDriver.z": OfTime,
    "StressMeasurement.point": Metres,
    "SectionMeasurement.point": Metres,
    "Load.force": Annotated[list[OfMotion], THREE],
    "Load.moment": Annotated[list[OfMotion], THREE],
    "SpringDamper.stiffness": or_curve("N/m"),
    "SpringDamper.damping": or_curve("N s/m"),
    "SpringDamper.free_length": Annotated[float, In("m")],
    "SpringDamper.preload": Annotated[float, In("N")],
    "Bushing.stiffness": list[or_curve()] | list[list[Number]],  # type: ignore[misc]
    "Bushing.damping": list[Number] | list[list[Number]],
    "Bushing.preload": list[Number],
    "Bushing.axes": Direction,
    "Bushing.axes_j": Direction,
    "JointFriction.normal": OfTime,
    "Actuator.force": OfMotion,
    "Servo.target": OfTime,
    "NodalForces.points": list[int],
    "NodalForces.forces": list[Vector],
    "NodalForces.function": OfTime,
    "Pressure.pressure": Number | list[Number],
    "Pressure.triangles": list[int],
    "Pressure.function": OfTime,
    "ModalForce.values": list[Number],
    "ModalForce.function": OfTime,
    "MarkerEffort.direction": Vector,
}

# Fields that a file cannot hold: Python functions, and the name, which is the key of the entry.
NOT_IN_FILES = ("name", "function")


@dataclass(frozen=True)
class Kind:
    """A dataclass whose instances are entries of a table; `word` is their `kind`, "" where a table has one kind only."""

    word: str
    made: type


# Tables of the file are fields of `Scene`. The first kind is meant where an entry does not say.
TABLES: dict[str, tuple[Kind, ...]] = {
    "joints": (Kind("", Joint),),
    "drivers": (Kind("joint", Driver), Kind("point", PointDriver)),
    "couplings": (Kind("", Coupling),),
    "loads": (Kind("", Load),),
    "springs": (Kind("", SpringDamper),),
    "forces": (
        Kind("bushing", Bushing),
        Kind("joint-spring", JointSpring),
        Kind("joint-friction", JointFriction),
        Kind("joint-stop", JointStop),
        Kind("actuator", Actuator),
        Kind("servo", Servo),
        Kind("nodal-forces", NodalForces),
        Kind("pressure", Pressure),
        Kind("modal-force", ModalForce),
    ),
    "measurements": (
        Kind("marker", Measurement),
        Kind("stress", StressMeasurement),
        Kind("section", SectionMeasurement),
    ),
}


EFFORTS = (Kind("joint", JointEffort), Kind("marker", MarkerEffort))  # tables of an analysis
SOLUTIONS = (Kind("causal", Causal), Kind("bounded", Bounded))


def keys_of(kind: Kind) -> list[Field]:
    """The fields of a kind that a file holds."""
    return [f for f in fields(kind.made) if _named(kind, f) in FIELDS or f.name not in NOT_IN_FILES]


def _named(kind: Kind, f: Field) -> str:
    return f"{kind.made.__name__}.{f.name}"


def _type(kind: Kind, f: Field, hints: Mapping[str, Any]) -> Any:
    """The type of a key: from `FIELDS`, or from the dataclass, where numbers become `Number`."""
    found = FIELDS.get(_named(kind, f), FIELDS.get(f.name))
    if found is None:
        found = _numbered(hints[f.name])
    return found | None if _default(f) is None else found


def _default(f: Field) -> Any:
    """What stands for a key that is not given; None where the dataclass has no limit (JSON has no infinity)."""
    if isinstance(f.default, tuple):
        return list(f.default)
    return None if f.default in (np.inf, -np.inf) else f.default


def _numbered(hint: Any) -> Any:
    if hint is float:
        return Number
    if typing.get_origin(hint) is None:
        return hint
    if Curve in typing.get_args(hint):
        return or_curve()
    inner = tuple(_numbered(part) for part in typing.get_args(hint))
    return typing.Union[inner]  # noqa: UP007 - of types that are known now only


def entry_model(kind: Kind) -> type[BaseModel]:
    """The model of an entry of this kind."""
    hints = typing.get_type_hints(kind.made)
    keys: dict[str, Any] = {"kind": (Literal[kind.word], kind.word)} if kind.word else {}
    for f in keys_of(kind):
        keys[f.name] = (_type(kind, f, hints), ... if f.default is MISSING else _default(f))
    return create_model(f"{kind.made.__name__}Entry", __base__=_Strict, __doc__=kind.made.__doc__, **keys)


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


class BodyEntry(_Strict):
    """A flexible body from a file, or a rigid one from its mass and named points.

    inertia is about the centre of mass; instead of inertia and centre_of_mass, the integrals r_dm and rr_dm (first and second
    moments about the origin) may be given. Points of a body from a file are put on its surface, at the nearest node. `drop`
    names inertia terms that the equations of motion leave out (see `ffr_dyn.variant`).
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


class StabilisationEntry(_Strict):
    """How the constraints are kept; see `ffr_dyn.stabilisation`."""

    kind: Literal["projection", "baumgarte", "none"] = "projection"
    tolerance: Annotated[Number, Key(gt=0)] = 1e-9
    alpha: Annotated[float, In("1/s")] = 0.0
    beta: Annotated[float, In("1/s")] = 0.0


class TolerancesEntry(_Strict):
    """What the error of a step may be: absolute values, plus `relative` of each coordinate's size; see `Tolerances`."""

    relative: Annotated[Number, Key(gt=0)] = 1e-6
    position: Annotated[float, In("m"), Key(gt=0)] = 1e-7
    velocity: Annotated[float, In("m/s"), Key(gt=0)] = 1e-6
    elastic: Annotated[float, In("m"), Key(gt=0)] = 1e-8


class _Span(_Strict):
    end: Seconds
    output_step: Seconds
    start: Seconds = 0.0


class _Integrated(_Span):
    method: Literal[(*METHODS, *CONTROLLED)] = "ros2"  # type: ignore[valid-type]
    step: Seconds | None = None
    tolerances: TolerancesEntry | None = None

    @model_validator(mode="after")
    def _one_of_both(self) -> _Integrated:
        controlled = self.method in CONTROLLED
        if controlled and self.step is not None:
            raise ValueError(f"{self.method} chooses its steps: give 'tolerances' in place of 'step'")
        if not controlled and self.tolerances is not None:
            raise ValueError(f"{self.method} takes steps of one length: give 'step' in place of 'tolerances'")
        return self


class ForwardEntry(_Integrated):
    """Forward dynamics from start to end; step defaults to a tenth of output_step."""

    kind: Literal["forward"] = "forward"
    stabilisation: StabilisationEntry = StabilisationEntry()


class KinematicEntry(_Span):
    """Positions, velocities, accelerations and reactions along the motion that the drivers prescribe."""

    kind: Literal["kinematic"]


class InverseEntry(_Integrated):
    """The forces of the drivers; method, step and stabilisation are of dynamic elastic coordinates."""

    kind: Literal["inverse"]
    elastic: Literal["dynamic", "quasi-static"] = "dynamic"
    stabilisation: StabilisationEntry = StabilisationEntry()


class _MixedBase(_Integrated):
    kind: Literal["mixed"]
    known: Annotated[list[str], Key(min_length=1)] | None = None


MixedEntry = create_model(
    "MixedEntry",
    __base__=_MixedBase,
    __doc__="Known motions (drivers, by default all) and the unknown forces, by name, that realise them.",
    unknown=(Annotated[_table_model(EFFORTS), Key(min_length=1)], ...),  # type: ignore[arg-type]
    solution=(_one_of([entry_model(kind) for kind in SOLUTIONS], [kind.word for kind in SOLUTIONS]) | None, None),
)


class StaticEntry(_Strict):
    """The equilibrium at a time."""

    kind: Literal["static"]
    time: Seconds = 0.0


class _LineariseBase(_Strict):
    kind: Literal["linearise"]
    time: Seconds = 0.0
    at_equilibrium: bool = False
    loads: list[str] = []
    quantities: list[str] = []


LineariseEntry = create_model(
    "LineariseEntry",
    __base__=_LineariseBase,
    __doc__="Small motions about the start or the equilibrium; inputs (forces by name) and loads feed, quantities come out.",
    inputs=(_table_model(EFFORTS), {}),
)

ANALYSES: dict[str, Any] = {
    "forward": ForwardEntry,
    "kinematic": KinematicEntry,
    "static": StaticEntry,
    "inverse": InverseEntry,
    "mixed": MixedEntry,
    "linearise": LineariseEntry,
}


class _SceneBase(_Strict):
    name: str = "scene"
    include: list[str] = []
    parameters: dict[str, Any] = {}
    inputs: dict[str, Number] = {}
    outputs: list[str] = ["default"]
    gravity: Annotated[list[Acceleration], THREE] = [0.0, 0.0, 0.0]
    base_acceleration: Annotated[list[Acceleration], THREE] = [0.0, 0.0, 0.0]
    analysis: _one_of(list(ANALYSES.values()), list(ANALYSES))  # type: ignore[valid-type]
    ground: dict[str, Metres] = {}
    bodies: dict[str, BodyEntry]


SceneEntry: Any = create_model(
    "SceneEntry",
    __base__=_SceneBase,
    __doc__="A scene file of ffr-dyn, after its includes are merged and its parameters put in.",
    **{name: (_table_model(kinds), {}) for name, kinds in TABLES.items()},  # type: ignore[call-overload]
)


def schema() -> dict[str, Any]:
    """The JSON schema of scene files (draft 2020-12)."""
    return SceneEntry.model_json_schema()
