"""Numbers and functions of time in a scene file: with units, as formulas of parameters, in tables."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import (
    AfterValidator,
    Discriminator,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    Tag,
    ValidationInfo,
    model_validator,
)
from pydantic import Field as Key
from pydantic_core import CoreSchema, core_schema

from ffr_dyn.functions.curves import Curve
from ffr_dyn.functions.formula import Expression, is_constant, parse
from ffr_dyn.functions.time_functions import HARMONIC, TimeFunction, constant, harmonic, piecewise, polynomial, table
from ffr_dyn.scene_file.parameters import as_number
from ffr_prep.common.errors import InputError
from ffr_prep.common.reading import reading
from ffr_prep.common.strict import Strict
from ffr_prep.common.units import split_quantity


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
        return as_number(value, parameters_of(info), "it", self.unit) if isinstance(value, str) else value


def parameters_of(info: ValidationInfo) -> Mapping[str, Any]:
    found: Mapping[str, Any] = (info.context or {}).get("parameters", {})
    return found


TWO = Key(min_length=2, max_length=2)
THREE = Key(min_length=3, max_length=3)

Number = Annotated[float, In()]
Seconds = Annotated[float, In("s")]
Vector = Annotated[list[Number], THREE]
Metres = Annotated[list[Annotated[float, In("m")]], THREE]
Inertia = Annotated[list[Annotated[float, In("kg m^2")]], THREE]


class HarmonicEntry(Strict):
    """mean + amplitude sin(2 pi frequency t + phase); `speed` [rad/s] may stand for 2 pi frequency [Hz].

    amplitude : in the unit of the function
    frequency : [Hz]
    speed : [rad/s], in place of the frequency
    phase : at t = 0 [rad]
    mean : added to it
    """

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


class PiecewiseEntry(Strict):
    """Polynomials between `breaks`: for each piece its coefficients, ascending powers of (t - start of the piece).

    breaks : increasing times [s], one more than there are pieces
    coefficients : for each piece, as many numbers
    """

    breaks: list[Number]
    coefficients: list[list[Number]]


class FunctionEntry(Strict):
    """A function of time by one of these; `table` is times and values, `table_file` two CSV columns of them.

    formula : of t and the parameters: "0.1 * sin(2 * pi * t)"
    polynomial : coefficients of ascending powers of t
    harmonic : a sine
    table : times [s] and values, joined by a cubic spline
    table_file : CSV file with the columns time [s] and value
    piecewise : polynomials one after the other
    """

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
    return next((name for kind, name in kinds if isinstance(value, kind)), None)


def _expression(value: float | str | FunctionEntry, info: ValidationInfo) -> Expression:
    """What a number, a formula or a table of the file means."""
    parameters = parameters_of(info)
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


def _in_unit(unit: str | None) -> Callable[[float | str | FunctionEntry, ValidationInfo], Any]:
    """A text that is a number with a unit becomes a number in SI units, if the unit is of this dimension."""

    def read(value: float | str | FunctionEntry, info: ValidationInfo) -> Any:
        if isinstance(value, str) and split_quantity(value) is not None:
            return as_number(value, parameters_of(info), "it", unit)
        return value

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
    with reading(file, "a file of two columns of numbers, time and value", ValueError):
        columns = np.loadtxt(file, delimiter=",", ndmin=2, comments="#")
    if columns.shape[1] != 2:
        raise InputError(f"{file} has {columns.shape[1]} columns; it needs two, time and value")
    return table(columns[:, 0], columns[:, 1])


_Given = Annotated[
    Annotated[float, Tag("[number]")] | Annotated[str, Tag("[text]")] | Annotated[FunctionEntry, Tag("[table]")],
    Discriminator(_form, custom_error_type="function", custom_error_message="give a number, a formula or a table"),
]


def of_time(unit: str | None = None) -> Any:
    """The type of a function of time: a number with or without a unit of this dimension, a formula of t, a table."""
    return Annotated[_Given, AfterValidator(_in_unit(unit)), AfterValidator(_of_time)]


def of_motion(unit: str | None = None) -> Any:
    """As `of_time`, with formulas of the motion too."""
    return Annotated[_Given, AfterValidator(_in_unit(unit)), AfterValidator(_expression)]


OfTime = of_time()


class CurveEntry(Strict):
    """`values` over the increasing places `at`: a smooth curve through the points, straight beyond them.

    at : increasing places, in the unit of what the force depends on
    values : the force there
    """

    at: list[Number]
    values: list[Number]


def or_curve(unit: str | None = None) -> Any:
    """The type of a factor, such as a stiffness: a number, or a curve in its place."""
    plain, curve = Annotated[float, In(unit)], Annotated[CurveEntry, AfterValidator(lambda e: Curve(e.at, e.values))]
    which = Discriminator(lambda given: "[curve]" if isinstance(given, (dict, CurveEntry, Curve)) else "[number]")
    return Annotated[Annotated[plain, Tag("[number]")] | Annotated[curve, Tag("[curve]")], which]
