"""Numbers and functions of time in a scene file: with units, as formulas of parameters, in tables."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import (
    AfterValidator,
    BeforeValidator,
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
from ffr_dyn.functions.quantities import WithUnit
from ffr_dyn.functions.time_functions import HARMONIC, TimeFunction, constant, harmonic, piecewise, polynomial, table
from ffr_dyn.scene.fields import Six, Unit
from ffr_dyn.scene_file.parameters import as_number, fitting
from ffr_prep.common.errors import InputError
from ffr_prep.common.reading import read_text, reading
from ffr_prep.common.strict import Strict
from ffr_prep.common.units import split_quantity


@dataclass(frozen=True)
class In:
    """Marks a number that may be given as text as well: with a unit of the same dimension, or as a formula of parameters."""

    unit: Unit | None = None

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.with_info_before_validator_function(self._read, handler(source))

    def __get_pydantic_json_schema__(self, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        found = unit_of(self.unit, {})
        return {"anyOf": [{"type": "number"}, {"type": "string"}]} | ({"unit": found} if found else {})

    def _read(self, value: Any, info: ValidationInfo) -> Any:
        if isinstance(value, bool):
            raise ValueError("must be a number")
        unit = unit_of(self.unit, info.data or {})
        if not isinstance(value, str):
            return fitting(value, unit) if isinstance(value, float) else value
        return as_number(value, parameters_of(info), "it", unit)


def unit_of(unit: Unit | None, entry: Mapping[str, Any]) -> str | None:
    """The unit, which may depend on the fields of the entry that have been read before."""
    return unit if unit is None or isinstance(unit, str) else unit.of(entry) or None


def parameters_of(info: ValidationInfo) -> Mapping[str, Any]:
    found: Mapping[str, Any] = (info.context or {}).get("parameters", {})
    return found


SHOWN = 60  # letters of a line
THREE = Key(min_length=3, max_length=3)

Number = Annotated[float, In("1")]
Quantity = Annotated[float, In()]  # in a unit that something else decides
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

    amplitude: Quantity
    frequency: Annotated[float, In("Hz")] | None = None
    speed: Annotated[float, In("rad/s")] | None = None
    phase: Annotated[float, In("rad")] = 0.0
    mean: Quantity = 0.0

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

    breaks: list[Seconds]
    coefficients: list[list[Quantity]]


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
    polynomial: list[Quantity] | None = None
    harmonic: HarmonicEntry | None = None
    table: tuple[list[Seconds], list[Quantity]] | None = None
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
    """The expression that a number, a formula or a table of the file means."""
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


def _fits(unit: Unit | None) -> BeforeValidator:
    """Refuses a function of time with a number in a unit of another dimension, wherever in it that stands."""

    def check(value: Any, info: ValidationInfo) -> Any:
        wanted = unit_of(unit, info.data or {})
        if wanted is not None:
            check_units(_of_function(value, wanted), info)
        return value

    return BeforeValidator(check)


def check_units(given: Iterable[tuple[Any, str]], info: ValidationInfo) -> None:
    """InputError for a text, of (text, unit), that is a number in a unit of another dimension."""
    for text, unit in given:
        parameters = parameters_of(info)
        if isinstance(text, float):
            fitting(text, unit)
        elif isinstance(text, str) and (split_quantity(text) or isinstance(parameters.get(text.strip()), WithUnit)):
            as_number(text, parameters, "it", unit)
        elif isinstance(text, str):
            parse(text, parameters, "it", unit)


def _of_function(value: Any, unit: str) -> Iterator[tuple[Any, str]]:
    """All that is written in a function of time, each with its unit."""
    if not isinstance(value, dict):
        yield value, unit
        return
    yield value.get("formula"), unit
    yield from _of_powers(value.get("polynomial"), unit)
    for number in listed(value.get("table"))[1:2]:
        yield from ((one, unit) for one in listed(number))
    harmonic, pieces = (given if isinstance(given := value.get(key), dict) else {} for key in ("harmonic", "piecewise"))
    yield from ((harmonic.get(key), unit) for key in ("amplitude", "mean"))
    for row in listed(pieces.get("coefficients")):
        yield from _of_powers(row, unit)


def _of_powers(coefficients: Any, unit: str) -> Iterator[tuple[Any, str]]:
    for k, number in enumerate(listed(coefficients)):
        yield number, " or ".join(f"{one}/s^{k}" for one in unit.split(" or "))


def listed(value: Any) -> list[Any]:
    """The value where it is a list, and none where it is not, which is refused elsewhere."""
    return list(value) if isinstance(value, (list, tuple)) else []


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
    what = "a file of two columns of numbers, time and value"
    with reading(file, what):
        lines = [line.partition("#")[0].strip() for line in read_text(file, what).splitlines()]
    rows = [_two_numbers(file, number, line) for number, line in enumerate(lines, 1) if line]
    if not rows:
        raise InputError(f"{file} has no numbers; it needs two columns, time and value")
    try:
        return table(*np.array(rows).T)
    except InputError as error:
        raise InputError(f"{file}: {error}") from None


def _two_numbers(file: Path, number: int, line: str) -> tuple[float, float]:
    try:
        time, value = map(float, line.split(","))
    except ValueError:
        raise InputError(
            f"{file}, line {number}: {line[:SHOWN]!r} is no time and value; give two numbers with a comma between, and write "
            "'#' before a line of words"
        ) from None
    return time, value


_Given = Annotated[
    Annotated[float, Tag("[number]")] | Annotated[str, Tag("[text]")] | Annotated[FunctionEntry, Tag("[table]")],
    Discriminator(_form, custom_error_type="function", custom_error_message="give a number, a formula or a table"),
]


def of_time(unit: Unit | None = None) -> Any:
    """The type of a function of time: a number with or without a unit of this dimension, a formula of t, a table."""
    return Annotated[_Given, _fits(unit), AfterValidator(_of_time)]


def of_motion(unit: Unit | None = None) -> Any:
    """As `of_time`, with formulas of the motion too."""
    return Annotated[_Given, _fits(unit), AfterValidator(_expression)]


class CurveEntry(Strict):
    """`values` over the increasing places `at`: a smooth curve through the points, straight beyond them.

    at : increasing places, in the unit of what the force depends on
    values : the force there
    """

    at: list[Quantity]
    values: list[Quantity]


def or_curve(unit: Unit | None = None, at: Unit | None = None, force: Unit | None = None) -> Any:
    """The type of a factor, such as a stiffness: a number, or a curve of a force over places in its place."""

    def check(value: Any, info: ValidationInfo) -> Any:
        for key, of in (("at", at), ("values", force)):
            if isinstance(value, dict) and (wanted := unit_of(of, info.data or {})) is not None:
                check_units(((one, wanted) for one in listed(value.get(key))), info)
        return value

    plain, curve = Annotated[float, In(unit)], Annotated[CurveEntry, AfterValidator(lambda e: Curve(e.at, e.values))]
    which = Discriminator(lambda given: "[curve]" if isinstance(given, (dict, CurveEntry, Curve)) else "[number]")
    return Annotated[
        Annotated[Annotated[plain, Tag("[number]")] | Annotated[curve, Tag("[curve]")], which], BeforeValidator(check)
    ]


def six(said: Six) -> Any:
    """The type of three components in one unit and three in another, or of a (6, 6) matrix of them."""
    halves = [(said.three, said.between), (said.between, said.others)]

    def check(value: Any, info: ValidationInfo) -> Any:
        for k, one in enumerate(listed(value)):
            row = halves[k // 3 % 2]
            check_units(((number, row[c // 3 % 2]) for c, number in enumerate(listed(one))), info)
            check_units([(one, row[k // 3 % 2])], info)
            for key, units in (("at", said.at), ("values", said.forces)):
                if isinstance(one, dict):
                    check_units(((number, units[k // 3 % 2]) for number in listed(one.get(key))), info)
        return value

    entry = or_curve() if said.at[0] else Quantity
    given: Any = list[entry] | list[list[Quantity]] if said.between else list[entry]  # type: ignore[valid-type]
    return Annotated[given, BeforeValidator(check)]


def each(*units: str) -> Any:
    """The type of as many numbers, each in its unit."""

    def check(value: Any, info: ValidationInfo) -> Any:
        check_units(zip(listed(value), units, strict=False), info)
        return value

    return Annotated[list[Quantity], BeforeValidator(check), Key(min_length=len(units), max_length=len(units))]
