"""Scenes as text: a TOML file, checked against a schema, becomes a `Scene` and the settings of a run.

    name = "pendulum"
    gravity = [0, -9.81, 0]
    [simulation]
    end = 2.0
    output_step = 0.01
    [ground]
    hinge = [0, 0, 0]
    [bodies.rod]
    file = "pendulum.ffr"            # or mass, inertia, points of a rigid body
    [joints.hinge]
    kind = "revolute"
    i = "ground.hinge"
    j = "rod.hinge"
    axis = [0, 0, 1]

Paths are relative to the file. Angles in rad, everything in SI units. The whole schema is in the models below.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from ffr_dyn.drivers import Driver
from ffr_dyn.errors import InputError
from ffr_dyn.forces import Load, SpringDamper
from ffr_dyn.integrators import METHODS, Integrator
from ffr_dyn.joints import Joint
from ffr_dyn.scene import Body, Scene
from ffr_dyn.stabilisation import Baumgarte, Drifting, Projection, Stabilisation
from ffr_dyn.timefunction import TimeFunction, harmonic, polynomial, table
from ffr_prep.body import FlexibleBody, load_body, rigid_body, truncated

Vector = Annotated[list[float], Field(min_length=3, max_length=3)]


class _Strict(BaseModel):
    """Unknown keys are mistakes; numbers must be finite."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)


class HarmonicEntry(_Strict):
    """mean + amplitude sin(2 pi frequency t + phase)."""

    amplitude: float
    frequency: float
    phase: float = 0.0
    mean: float = 0.0


class FunctionEntry(_Strict):
    """A function of time: one of `polynomial`, `harmonic`, `table` (times and values) or `table_file` (two CSV columns)."""

    polynomial: list[float] | None = None
    harmonic: HarmonicEntry | None = None
    table: tuple[list[float], list[float]] | None = None
    table_file: Path | None = None

    @model_validator(mode="after")
    def _one(self) -> FunctionEntry:
        given = [key for key in ("polynomial", "harmonic", "table", "table_file") if getattr(self, key) is not None]
        if len(given) != 1:
            raise ValueError("give exactly one of polynomial, harmonic, table, table_file")
        return self


class BodyEntry(_Strict):
    """A flexible body from a file, or a rigid one from mass, inertia (about the centre of mass) and named points."""

    file: Path | None = None
    modes: int | None = Field(default=None, ge=0)
    mass: float | None = None
    inertia: Vector | list[Vector] | None = None
    centre_of_mass: Vector = [0.0, 0.0, 0.0]
    points: dict[str, Vector] = {}
    position: Vector = [0.0, 0.0, 0.0]
    rotation: list[float] = [0.0, 0.0, 0.0]
    velocity: Vector = [0.0, 0.0, 0.0]
    omega_bar: Vector = [0.0, 0.0, 0.0]
    damping: float | list[float] = 0.0
    stiffening: bool = True

    @model_validator(mode="after")
    def _kind(self) -> BodyEntry:
        if (self.file is None) == (self.mass is None):
            raise ValueError("give either file (a body from ffr-prep) or mass and inertia (a rigid body)")
        if self.mass is not None and self.inertia is None:
            raise ValueError("a rigid body needs inertia, about its centre of mass: three principal values or 3 x 3")
        return self


class JointEntry(_Strict):
    kind: str
    i: str
    j: str
    axis: Vector | list[Vector] = [0.0, 0.0, 1.0]
    axis_j: Vector | list[Vector] | None = None


class DriverEntry(FunctionEntry):
    joint: str
    coordinate: Literal["angle", "stroke"] = "angle"


class LoadEntry(_Strict):
    """Components are numbers or functions of time."""

    marker: str
    force: list[float | FunctionEntry] = [0.0, 0.0, 0.0]
    moment: list[float | FunctionEntry] = [0.0, 0.0, 0.0]
    axes: Literal["global", "body"] = "global"


class SpringEntry(_Strict):
    i: str
    j: str
    stiffness: float
    damping: float = 0.0
    free_length: float = 0.0
    preload: float = 0.0


class StabilisationEntry(_Strict):
    kind: Literal["projection", "baumgarte", "none"] = "projection"
    tolerance: float = Field(default=1e-9, gt=0)
    alpha: float = 0.0
    beta: float = 0.0


class SimulationEntry(_Strict):
    """Settings of a forward run; step defaults to a tenth of output_step."""

    end: float
    output_step: float
    start: float = 0.0
    method: Literal["ros2", "rk4"] = "ros2"
    step: float | None = None
    stabilisation: StabilisationEntry = StabilisationEntry()


class SceneEntry(_Strict):
    name: str = "scene"
    gravity: Vector = [0.0, 0.0, 0.0]
    simulation: SimulationEntry
    ground: dict[str, Vector] = {}
    bodies: dict[str, BodyEntry]
    joints: dict[str, JointEntry] = {}
    drivers: dict[str, DriverEntry] = {}
    loads: dict[str, LoadEntry] = {}
    springs: dict[str, SpringEntry] = {}


@dataclass(frozen=True)
class Settings:
    """How a scene file wants to be run."""

    start: float
    end: float
    output_step: float
    method: Integrator
    stabilisation: Stabilisation


def load_scene(path: str | Path) -> tuple[Scene, Settings]:
    """Read a scene file. Raises InputError that names the entry, its value and what is expected."""
    path = Path(path)
    try:
        raw = tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(f"scene file {path} does not exist") from None
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise InputError(f"{path} is not a readable TOML file: {error}") from None
    try:
        entry = SceneEntry.model_validate(raw)
    except ValidationError as error:
        raise InputError(f"{path}: {_explained(error)}") from None
    return _scene(entry, path.parent), _settings(entry.simulation)


def _explained(error: ValidationError) -> str:
    """All complaints, one a line: where, what, and the value."""
    lines = []
    for item in error.errors():
        where = ".".join(str(part) for part in item["loc"])
        value = (
            ""
            if item["type"] in ("missing", "extra_forbidden") or isinstance(item["input"], dict)
            else f" (it is {item['input']!r})"
        )
        text = (
            "is not a known entry here"
            if item["type"] == "extra_forbidden"
            else item["msg"].removeprefix("Value error, ")
        )
        lines.append(f"{where or 'file'}: {text}{value}")
    return "; ".join(lines)


def _scene(entry: SceneEntry, folder: Path) -> Scene:
    return Scene(
        name=entry.name,
        gravity=entry.gravity,
        ground=entry.ground,
        bodies=tuple(_body(name, body, folder) for name, body in entry.bodies.items()),
        joints=tuple(Joint(name, j.kind, j.i, j.j, j.axis, j.axis_j) for name, j in entry.joints.items()),
        drivers=tuple(
            Driver(name, d.joint, _function(d, folder, f"driver {name!r}"), d.coordinate)
            for name, d in entry.drivers.items()
        ),
        loads=tuple(_load(name, load, folder) for name, load in entry.loads.items()),
        springs=tuple(SpringDamper(name, **spring.model_dump()) for name, spring in entry.springs.items()),
    )


def _body(name: str, entry: BodyEntry, folder: Path) -> Body:
    return Body(
        name,
        _model(name, entry, folder),
        position=entry.position,
        rotation=entry.rotation,
        velocity=entry.velocity,
        omega_bar=entry.omega_bar,
        damping=entry.damping,
        stiffening=entry.stiffening,
    )


def _model(name: str, entry: BodyEntry, folder: Path) -> FlexibleBody:
    if entry.file is not None:
        model = load_body(folder / entry.file)
        return model if entry.modes is None else truncated(model, entry.modes)
    return rigid_body(
        name,
        mass=entry.mass or 0.0,
        inertia=np.array(entry.inertia),
        centre_of_mass=np.array(entry.centre_of_mass),
        points={key: np.array(at) for key, at in entry.points.items()},
    )


def _load(name: str, entry: LoadEntry, folder: Path) -> Load:
    def components(values: list[float | FunctionEntry]) -> tuple[float | TimeFunction, ...]:
        return tuple(v if isinstance(v, float) else _function(v, folder, f"load {name!r}") for v in values)

    return Load(name, entry.marker, components(entry.force), components(entry.moment), axes=entry.axes)


def _function(entry: FunctionEntry, folder: Path, what: str) -> TimeFunction:
    if entry.polynomial is not None:
        return polynomial(*entry.polynomial)
    if entry.harmonic is not None:
        return harmonic(**entry.harmonic.model_dump())
    if entry.table is not None:
        return table(np.array(entry.table[0]), np.array(entry.table[1]))
    file = folder / (entry.table_file or "")
    try:
        columns = np.loadtxt(file, delimiter=",", ndmin=2, comments="#")
    except (OSError, ValueError) as error:
        raise InputError(f"{what}: {file} is not a file of two columns of numbers, time and value ({error})") from None
    if columns.shape[1] != 2:
        raise InputError(f"{what}: {file} has {columns.shape[1]} columns; it needs two, time and value")
    return table(columns[:, 0], columns[:, 1])


def _settings(entry: SimulationEntry) -> Settings:
    step = entry.output_step / 10 if entry.step is None else entry.step
    keep = entry.stabilisation
    choice: dict[str, Any] = {
        "projection": Projection(keep.tolerance),
        "baumgarte": Baumgarte(keep.alpha, keep.beta),
        "none": Drifting(),
    }
    return Settings(entry.start, entry.end, entry.output_step, METHODS[entry.method](step), choice[keep.kind])
