"""The measures of a run: numbers of its outputs, or whole histories.

"rod.tip.position.x: range"    last, first, least, greatest, largest (of absolute values), range of a quantity; mean and rms
                               over the time; of one with several components the largest of them; largest and rms are of
                               its length
"hinge.force: error"           what the step costs it, of the run's own estimate [in its unit]
"hinge.angle: history"         all rows of it, of one component
"critical.1.speed: attribute"  what else the analysis has found: entries by name, items of lists from 1, a list by its length
"evaluations"                  of the equations of motion, as the run has counted them
"= force / load"               a formula of other outputs, by their names, and of the parameters
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ffr_dyn.results.result import Quantity, Result
from ffr_dyn.scene_file.parameters import Parameters, as_number, nearest
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError

COMPONENT = re.compile(r"\.([xyz]|\d+)$")  # at the end of a quantity's name
COUNTS = ("evaluations",)


def _size(y: Array) -> Array:
    """(T,) lengths of rows."""
    found: Array = np.linalg.norm(y.reshape(len(y), -1), axis=1)
    return found


def _shares(time: Array) -> Array:
    """(T,) of the rows in a mean over the time [s], by trapezoids; equal ones of rows of one moment, as those of speeds."""
    steps = np.diff(time)
    if not steps.any():
        return np.full(len(time), 1 / len(time))
    shares: Array = (np.append(steps, 0.0) + np.append(0.0, steps)) / (2 * steps.sum())
    return shares


MEASURES: dict[str, Callable[[Array], float]] = {
    "last": lambda y: float(y[-1].max()),
    "first": lambda y: float(y[0].max()),
    "least": lambda y: float(y.min()),
    "greatest": lambda y: float(y.max()),
    "largest": lambda y: float(_size(y).max()),
    "range": lambda y: float(np.ptp(y, axis=0).max()),
}
MEANS: dict[str, Callable[[Array, Array], float]] = {  # of rows and their shares
    "mean": lambda y, shares: float(np.tensordot(shares, y, 1).max()),
    "rms": lambda y, shares: float(np.sqrt(shares @ _size(y) ** 2)),
}
ERROR, HISTORY, ATTRIBUTE = "error", "history", "attribute"
TIME = "time"  # beside histories
Number = float | list[float]  # or a history


@dataclass(frozen=True)
class Measured:
    """An output of a study.

    quantity : of a result, with a component perhaps; a count; or a formula where `how` is "="
    how      : a name of `MEASURES`, "error", "history", "attribute" or "="
    """

    name: str
    quantity: str
    how: str


def measured(name: str, text: str) -> Measured:
    """An output as a study file writes it. Raises InputError for one that nothing is said of, with what there is."""
    if text.lstrip().startswith("="):
        return Measured(name, text.lstrip()[1:].strip(), "=")
    if text.strip() in COUNTS:
        return Measured(name, text.strip(), ATTRIBUTE)
    quantity, colon, how = (part.strip() for part in text.rpartition(":"))
    known = [*MEASURES, *MEANS, ERROR, HISTORY, ATTRIBUTE]
    if not colon or how not in known:
        hint = nearest(how, dict.fromkeys(known)) if colon else f"write it as QUANTITY: {' | '.join(known)}"
        raise InputError(f"outputs.{name} = {text!r}: {hint}; a formula of other outputs begins with '='")
    return Measured(name, quantity, how)


def wanted(outputs: tuple[Measured, ...]) -> tuple[str, ...]:
    """Names of the quantities that a run must keep for them."""
    names = [COMPONENT.sub("", one.quantity) for one in outputs if one.how not in ("=", ATTRIBUTE)]
    return tuple(dict.fromkeys(names))


def values(
    outputs: tuple[Measured, ...], result: Result, parameters: Mapping[str, float | str]
) -> tuple[dict[str, Number], list[str]]:
    """The numbers of a run, by name; of histories all rows, and their times [s]; and why there are none of the other outputs:
    quantities that the result has not, formulas without a value."""
    found, why = dict[str, Number](), list[str]()
    for one in outputs:
        if one.how != "=":
            try:
                found[one.name] = _value(one, result)
            except InputError as error:
                why.append(str(error))
    left = {one.name: one.quantity for one in outputs if one.how == "="}
    lost = {one.name for one in outputs} - found.keys() - left.keys()
    while left:  # those first that others are made of; no two are made of each other
        name = next(name for name, text in left.items() if not any(mentions(text, other) for other in left))
        text = left.pop(name)
        if not any(mentions(text, other) for other in lost):
            try:
                found[name] = _worked_out(text, found, parameters, f"outputs.{name}")
            except InputError as error:
                why.append(str(error))
        lost |= {name} - found.keys()
    times = {TIME: result.time.tolist()} if any(isinstance(value, list) for value in found.values()) else {}
    return {one.name: found[one.name] for one in outputs if one.name in found} | times, why


def _worked_out(text: str, found: Mapping[str, Number], parameters: Mapping[str, float | str], what: str) -> float:
    """The value of a formula; NaN where it has an output that is none, such as of an item beyond the end of a list."""
    numbers = {name: value for name, value in found.items() if not isinstance(value, list)}
    if any(mentions(text, name) and not math.isfinite(value) for name, value in numbers.items()):
        return math.nan
    return as_number(text, Parameters({**parameters, **numbers}), what)


def mentions(text: str, name: str) -> bool:
    """Whether a formula, or a text with "${name}", has a name."""
    return re.search(rf"(?<![\w.]){re.escape(name)}(?![\w.])", text) is not None


def units(outputs: tuple[Measured, ...], result: Result, found: Iterable[str]) -> dict[str, str]:
    """Those of outputs that were found and are of a quantity, by name: the unit of the quantity."""
    of = {one.name: one.quantity for one in outputs if one.how not in ("=", ATTRIBUTE)}
    return {name: result.quantity(of[name]).unit for name in found if name in of}


def _value(one: Measured, result: Result) -> Number:
    if one.how == ATTRIBUTE:
        return attribute(result.attributes, one.quantity)
    if one.how == ERROR:
        errors = result.attributes.get("errors")
        if errors is None:
            raise InputError(
                f"outputs.{one.name}: this analysis tells no errors of its quantities; ask for {one.quantity}: last, or "
                "largest"
            )
        name = COMPONENT.sub("", one.quantity)
        return float(errors[name][0]) if name in errors else float("nan")
    if one.how == HISTORY:
        return _rows(one, result.quantity(one.quantity))
    rows = np.asarray(result[one.quantity])
    return MEANS[one.how](rows, _shares(result.time)) if one.how in MEANS else MEASURES[one.how](rows)


def _rows(one: Measured, found: Quantity) -> list[float]:
    if found.axes:
        such = ".".join([one.quantity, *(axis.labels[0] for axis in found.axes)])
        raise InputError(
            f"outputs.{one.name}: {one.quantity} has several components: name one, such as {such}: history"
        )
    rows: list[float] = found.values.tolist()
    return rows


def attribute(attributes: Mapping[str, Any], name: str) -> float:
    """A number among the attributes of a result; NaN of an item that a list has not, the length of a list.

    Raises InputError for a name that is none, or of a text.
    """
    found: Any = attributes
    left = name
    while left:
        key, found, left = _entered(found, left)
        if found is None:
            return float("nan")
        if not key:
            raise InputError(f"the result has no attribute {name!r}; {nearest(left, _names(found))}")
    if isinstance(found, (list, dict)):
        return float(len(found))
    if not isinstance(found, (int, float)):
        raise InputError(f"the attribute {name!r} is no number but {found!r}")
    return float(found)


def _entered(found: Any, path: str) -> tuple[str, Any, str]:
    """(key, entry, rest of the path) of the longest key that a path begins with; ("", ...) where there is none, and no entry
    for an item beyond the end of a list."""
    head, _, rest = path.partition(".")
    if isinstance(found, list) and head.isdigit():
        return head, (found[int(head) - 1] if 0 < int(head) <= len(found) else None), rest
    keys = [key for key in found if path == key or path.startswith(f"{key}.")] if isinstance(found, dict) else []
    if not keys:
        return "", found, path
    key = max(keys, key=len)
    return key, found[key], path[len(key) + 1 :]


def _names(found: Any) -> dict[str, Any]:
    """The names that could have been meant in an entry."""
    if isinstance(found, list):
        return dict.fromkeys(str(k + 1) for k in range(len(found)))
    return found if isinstance(found, dict) else {}
