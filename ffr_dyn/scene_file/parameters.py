"""Parameters of a scene file: numbers and texts by dotted name, which may be formulas of each other."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterator, Mapping
from typing import Any

from ffr_dyn.functions.formula import CONSTANTS, number
from ffr_dyn.functions.operations import FUNCTIONS
from ffr_dyn.functions.quantities import WithUnit, with_unit
from ffr_prep.common.errors import InputError
from ffr_prep.common.units import split_quantity, to_si

PLACEHOLDER = re.compile(r"\$\{\s*([^{}]*?)\s*\}")
NAME = re.compile(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)*")  # of a parameter


def flattened(table: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """{"crank": {"length": 0.15}} -> {"crank.length": 0.15}. Raises InputError for names that formulas cannot hold."""
    found: dict[str, Any] = {}
    for key, value in table.items():
        name = f"{prefix}{key}"
        if isinstance(value, dict):
            found |= flattened(value, f"{name}.")
            continue
        if not NAME.fullmatch(name) or name in ("t", *CONSTANTS, *FUNCTIONS):
            raise InputError(
                f"parameters.{name}: cannot be a parameter's name: use letters, digits and '_'; "
                f"t, {', '.join((*CONSTANTS, *FUNCTIONS))} are taken"
            )
        found[name] = value
    return found


class Parameters(Mapping[str, Any]):
    """Values by name, each worked out when it is first asked for, whatever the order in which they stand."""

    def __init__(self, given: Mapping[str, Any]) -> None:
        self._given = dict(given)
        self._found: dict[str, Any] = {}
        self._open: list[str] = []

    def __getitem__(self, name: str) -> Any:
        if name not in self._found:
            given = self._given[name]
            if name in self._open:
                circle = " -> ".join([*self._open[self._open.index(name) :], name])
                raise InputError(f"parameters.{name}: depends on itself: {circle}")
            self._open.append(name)
            try:
                self._found[name] = self._value(name, given)
            finally:
                self._open.pop()
        return self._found[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._given)

    def __len__(self) -> int:
        return len(self._given)

    def __contains__(self, name: object) -> bool:
        return name in self._given

    def _value(self, name: str, given: Any) -> Any:
        if not isinstance(given, str):
            return given
        value = substituted(given, self, f"parameters.{name}")
        if not isinstance(value, str):
            return value
        try:
            quantity = split_quantity(value)
            return with_unit(*quantity) if quantity else as_number(value, self, f"parameters.{name}")
        except InputError as error:
            if "depends on itself" in str(error):
                raise
            return value  # a text, such as the name of a file; where a number is needed, the formula is refused with reason


def substituted(value: Any, parameters: Mapping[str, Any], where: str) -> Any:
    """The value with "${name}" replaced, all through lists and tables; a text that is only "${name}" becomes its value.

    Raises InputError for a name that does not exist, with the nearest one.
    """
    if isinstance(value, dict):
        return {key: substituted(item, parameters, f"{where}.{key}".strip(".")) for key, item in value.items()}
    if isinstance(value, list):
        return [substituted(item, parameters, f"{where}.{k}") for k, item in enumerate(value)]
    if not isinstance(value, str):
        return value

    def of(name: str) -> Any:
        if name not in parameters:
            raise InputError(f"{where}: there is no parameter {name!r}; {nearest(name, parameters)}")
        return parameters[name]

    whole = PLACEHOLDER.fullmatch(value.strip())
    return of(whole[1]) if whole else PLACEHOLDER.sub(lambda found: str(of(found[1])), value)


def as_number(text: str, parameters: Mapping[str, Any], what: str, unit: str | None = None) -> float:
    """A number from a text: with a unit ("120 mm"), or a formula of parameters, in SI units."""
    quantity, named = split_quantity(text), parameters.get(text.strip())
    try:
        if quantity is not None:
            return to_si(*quantity, unit)
        if isinstance(named, WithUnit):
            return fitting(named, unit)
    except InputError as error:
        raise InputError(f"{what}: {text!r}: {error}") from None
    return number(text, parameters, what, unit)


def fitting(value: float, unit: str | None) -> float:
    """The value. Raises InputError for one that was given in a unit of another dimension."""
    if isinstance(value, WithUnit):
        to_si(1.0, value.unit, unit)
    return float(value)


def nearest(name: str, known: Mapping[str, Any]) -> str:
    """A hint at the name that was meant."""
    close = difflib.get_close_matches(name, list(known), 1)
    return f"did you mean {close[0]!r}?" if close else f"there are: {', '.join(known) or 'none'}"
