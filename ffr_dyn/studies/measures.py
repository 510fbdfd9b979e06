"""What a run is reduced to: numbers of its outputs.

"rod.tip.position.x: range"    last, first, least, greatest, largest (of absolute values), mean, rms, range of a quantity;
                               of one with several components the largest of them, its length for largest and rms
"hinge.force: error"           what the step costs it, of the run's own estimate [in its unit]
"evaluations"                  of the equations of motion, as the run has counted them
"= force / load"               a formula of other outputs, by their names, and of the parameters
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from ffr_dyn.results.result import Result
from ffr_dyn.scene_file.parameters import Parameters, as_number, nearest
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError

COMPONENT = re.compile(r"\.([xyz]|\d+)$")  # at the end of a quantity's name
COUNTS = ("evaluations",)


def _size(y: Array) -> Array:
    """(T,) lengths of rows."""
    found: Array = np.linalg.norm(y.reshape(len(y), -1), axis=1)
    return found


MEASURES: dict[str, Callable[[Array], float]] = {
    "last": lambda y: float(y[-1].max()),
    "first": lambda y: float(y[0].max()),
    "least": lambda y: float(y.min()),
    "greatest": lambda y: float(y.max()),
    "largest": lambda y: float(_size(y).max()),
    "mean": lambda y: float(y.mean(axis=0).max()),
    "rms": lambda y: float(np.sqrt((_size(y) ** 2).mean())),
    "range": lambda y: float(np.ptp(y, axis=0).max()),
}
ERROR = "error"


@dataclass(frozen=True)
class Measured:
    """An output of a study.

    quantity : of a result, with a component perhaps; a count; or a formula where `how` is "="
    how      : a name of `MEASURES`, "error", "count" or "="
    """

    name: str
    quantity: str
    how: str


def measured(name: str, text: str) -> Measured:
    """An output as a study file writes it. Raises InputError for one that nothing is said of, with what there is."""
    if text.lstrip().startswith("="):
        return Measured(name, text.lstrip()[1:].strip(), "=")
    if text.strip() in COUNTS:
        return Measured(name, text.strip(), "count")
    quantity, colon, how = (part.strip() for part in text.rpartition(":"))
    known = [*MEASURES, ERROR]
    if not colon or how not in known:
        hint = nearest(how, dict.fromkeys(known)) if colon else f"write it as QUANTITY: {' | '.join(known)}"
        raise InputError(f"outputs.{name} = {text!r}: {hint}; a formula of other outputs begins with '='")
    return Measured(name, quantity, how)


def wanted(outputs: tuple[Measured, ...]) -> tuple[str, ...]:
    """Names of the quantities that a run must keep for them."""
    names = [COMPONENT.sub("", one.quantity) for one in outputs if one.how not in ("=", "count")]
    return tuple(dict.fromkeys(names))


def values(outputs: tuple[Measured, ...], result: Result, parameters: Mapping[str, float | str]) -> dict[str, float]:
    """The numbers of a run, by name. Raises InputError for quantities that the result has not."""
    found: dict[str, float] = {one.name: _value(one, result) for one in outputs if one.how != "="}
    formulas = {one.name: one.quantity for one in outputs if one.how == "="}
    known = Parameters({**parameters, **found, **formulas})
    for name, text in formulas.items():
        found[name] = as_number(text, known, f"outputs.{name}")
    return {one.name: found[one.name] for one in outputs}


def _value(one: Measured, result: Result) -> float:
    if one.how == "count":
        return float(result.attributes.get(one.quantity, np.nan))
    if one.how == ERROR:
        errors = result.attributes.get("errors", {})
        name = COMPONENT.sub("", one.quantity)
        return float(errors[name][0]) if name in errors else float("nan")
    return MEASURES[one.how](np.asarray(result[one.quantity]))
