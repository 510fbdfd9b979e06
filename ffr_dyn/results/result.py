"""Labelled histories: what every analysis returns, and how to name, tabulate and select them.

A `Result` is time, quantities with units and named axes, the surfaces of the bodies, and attributes. Names are dotted,
``body.quantity`` or ``body.marker.quantity``; one more part selects a component: ``rod.small_eye.position.x``.
`ffr_dyn.results.file` keeps results in netCDF-4 files. This module needs numpy and the standard library only.
"""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from difflib import get_close_matches
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from ffr_prep.body import Surface
from ffr_prep.common.arrays import Array
from ffr_prep.common.brief import Brief, Rows, cut, listed
from ffr_prep.common.errors import InputError, require_kind
from ffr_prep.common.outputs import replacing
from ffr_prep.common.units import unit_of_label

# netCDF names: a letter, digit or underscore first, no "/", no control character, no blank at the end.
_NAME = re.compile(r"\w(?:[^/\x00-\x1f\x7f]*[^/\x00-\x1f\x7f\s])?")


def _check_name(kind: str, name: str) -> None:
    if not _NAME.fullmatch(name) or name in ("time", "geometry"):
        raise InputError(
            f"{kind} name {name!r} cannot be used: start with a letter, digit or underscore, do not end with a blank, "
            "avoid '/', control characters and the words 'time' and 'geometry'"
        )


@dataclass(frozen=True, repr=False)
class Axis(Brief):
    """A labelled axis of a quantity, such as x, y, z. Labels are unique, not empty, and contain no dot.

    Raises InputError for labels that are not so.

    >>> axis = fd.Axis("component", ("x", "y", "z"))
    """

    name: str
    labels: tuple[str, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "labels", tuple(self.labels))
        _check_name("axis", self.name)
        if not self.labels or len(set(self.labels)) < len(self.labels):
            raise InputError(f"axis {self.name!r}: labels must be unique and at least one, not {self.labels}")
        if any(not label or "." in label or "\0" in label for label in self.labels):
            raise InputError(f"axis {self.name!r}: labels must not be empty or contain a dot: {self.labels}")


XYZ = Axis("xyz", ("x", "y", "z"))
EULER_PARAMETERS = Axis("euler_parameter", ("e0", "e1", "e2", "e3"))


def mode_axis(body: str, n: int) -> Axis:
    """The axis of the n elastic coordinates of a body, labelled 1 to n."""
    return Axis(f"{body}.mode", tuple(str(k + 1) for k in range(n)))


@dataclass(frozen=True, eq=False, repr=False)
class Quantity(Brief):
    """A history, with a unit and one axis for each dimension after time.

    values : (T, ...);  unit : in SI symbols, such as "m", "N m", "m/s", "m sqrt(kg)"; "1" for a number; where labels of the
             first axis have their own, these with commas, "m/N, rad/N"

    Raises InputError for values whose shape is not that of the axes.

    >>> result.quantity("rod.tip.position").unit
    """

    values: Array
    unit: str
    axes: tuple[Axis, ...] = ()
    description: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", read_only(self.values))
        object.__setattr__(self, "axes", tuple(self.axes))
        expected = tuple(len(axis.labels) for axis in self.axes)
        if self.values.ndim < 1 or self.values.shape[1:] != expected:
            raise InputError(f"a quantity has values of shape {self.values.shape}; its axes ask for (T, *{expected})")


class Histories(Mapping[str, Quantity]):
    """Quantities by name, each made by `make` when it is first asked for and then kept; alike in rows and axes."""

    def __init__(self, names: Iterable[str], make: Callable[[str], Quantity]) -> None:
        self._made: dict[str, Quantity | None] = dict.fromkeys(names)
        self._make = make

    def __getitem__(self, name: str) -> Quantity:
        found = self._made[name]
        if found is None:
            self._made[name] = found = self._make(name)
        return found

    def __iter__(self) -> Iterator[str]:
        return iter(self._made)

    def __len__(self) -> int:
        return len(self._made)

    def __contains__(self, name: object) -> bool:
        return name in self._made

    def __reduce__(self) -> Any:
        """Copies, and what other processes are sent, have all of them."""
        return dict, (dict(self),)


@dataclass(frozen=True, eq=False, repr=False)
class Result(Brief):
    """Histories of one analysis.

    time       : (T,) [s], finite, not decreasing
    quantities : by dotted name; each has T rows
    geometry   : by body name; the surface that is drawn, in the body frame
    attributes : plain JSON values: title, status ("running", "complete", "stopped: reason"), settings, and what connects
                 which markers (`ffr_dyn.scene.described`)

    Raises InputError when lengths, names or axes contradict each other.

    >>> result = fd.load_result("result.nc")
    >>> result["rod.tip.position"]  # (rows, 3) [m]
    """

    time: Array
    quantities: Mapping[str, Quantity]
    geometry: Mapping[str, Surface] = field(default_factory=dict)
    attributes: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "time", read_only(self.time))
        for key in ("geometry", "attributes"):
            object.__setattr__(self, key, dict(getattr(self, key)))
        check_times(self.time)
        if not isinstance(self.quantities, Histories):
            object.__setattr__(self, "quantities", dict(self.quantities))
            _check_quantities(self)
        _check_attributes(self.attributes)

    def _title(self) -> str:
        about = [self.attributes[key] for key in ("analysis", "status") if key in self.attributes]
        return f"Result {self.attributes.get('title', '')!r}: {', '.join([*map(str, about), f'{self.time.size} rows'])}"

    def _rows(self) -> Rows:
        known, notes = self.attributes, self.attributes.get("notes") or []
        rows = [("time", f"{self.time[0]:.6g} to {self.time[-1]:.6g} s")] if self.time.size else []
        rows += [
            (key.replace("_", " "), cut(str(known[key]))) for key in ("method", "degrees_of_freedom") if key in known
        ]
        rows += [("quantities", listed(self.quantities)), ("drawn", listed(self.geometry))]
        return rows + [("note", note) for note in notes[:2]] + [("more notes", str(len(notes) - 2))] * (len(notes) > 2)

    def __getitem__(self, name: str) -> Array:
        """The values of a quantity (T, ...), or of one component (T,). InputError suggests close names."""
        return self.quantity(name).values

    def __contains__(self, name: object) -> bool:
        """Whether there is a quantity, or a component of one, of that name."""
        return isinstance(name, str) and self._find(name) is not None

    def __iter__(self) -> Iterator[str]:
        """The names of the quantities."""
        return iter(self.quantities)

    def quantity(self, name: str) -> Quantity:
        """The quantity of that name, or one component of it as a quantity. InputError suggests close names."""
        require_kind(name, str, "the name of a quantity", "one such as 'rod.tip.position'")
        found = self._find(name)
        if found is None:
            of_it = [one for one in self.quantities if one.startswith(f"{name}.")]  # of a body, a marker, a joint
            close = of_it[:8] or get_close_matches(
                name, dict.fromkeys([*self.quantities, *self.components()]), n=4, cutoff=0.5
            )
            hint = f"did you mean {', '.join(close)}?" if close else f"there are: {', '.join(self.quantities)}"
            raise InputError(f"the result has no quantity {name!r}; {hint}")
        return found

    def components(self, names: Iterable[str] | None = None) -> Iterator[str]:
        """Names of all scalar histories within the named quantities (all quantities by default), in order."""
        for name in self.quantities if names is None else names:
            for labels in product(*(axis.labels for axis in self.quantity(name).axes)):
                yield ".".join((name, *labels))

    def to_xarray(self, names: Iterable[str] | None = None) -> Any:
        """An `xarray.Dataset`: a variable for each quantity over `time` and its labelled axes, with `units` and `long_name`.

        names : quantities or components; all when not given. Raises InputError where xarray is not installed.

        Example: ``result.to_xarray()["rod.tip.position"].sel(xyz="x")``
        """
        with _installed("xarray"):
            import xarray
        found: dict[str, Any] = {}
        labels: dict[str, Any] = {"time": self.time}
        for name in self.quantities if names is None else names:
            of = self.quantity(name)
            labels |= {axis.name: list(axis.labels) for axis in of.axes}
            about = {"units": of.unit, "long_name": of.description}
            found[name] = (("time", *(axis.name for axis in of.axes)), of.values, about)
        whole = xarray.Dataset(
            found, labels, {key: of for key, of in self.attributes.items() if isinstance(of, str | float | int)}
        )
        whole["time"].attrs["units"] = "s"
        return whole

    def to_pandas(self, names: Iterable[str] | None = None) -> Any:
        """A `pandas.DataFrame`: a column for each component ("rod.tip.position.x") over the time [s].

        `attrs["units"]` has their units by name.
        names : quantities or components; all when not given. Raises InputError where pandas is not installed.
        """
        with _installed("pandas"):
            import pandas
        columns = list(self.components(names))
        of = {name: self.quantity(name) for name in columns}
        time = pandas.Index(self.time, name="time")
        frame = pandas.DataFrame({name: quantity.values for name, quantity in of.items()}, index=time)
        frame.attrs["units"] = {name: quantity.unit for name, quantity in of.items()}
        return frame

    def to_statespace(self) -> Any:
        """A `scipy.signal.StateSpace` of a linearised scene; python-control takes its matrices,
        `control.ss(s.A, s.B, s.C, s.D)`.

        Raises InputError for the result of another analysis, or one without inputs or outputs.
        """
        if not {"A", "B", "C", "D"} <= self.quantities.keys():
            raise InputError("only a linearised scene with inputs and outputs is a state space; see `linearise`")
        from scipy.signal import StateSpace

        return StateSpace(*(self[name][0] for name in "ABCD"))

    def _find(self, name: str) -> Quantity | None:
        if name in self.quantities:
            return self.quantities[name]
        head, _, label = name.rpartition(".")
        owner = self._find(head) if head else None
        if owner is None or not owner.axes or label not in owner.axes[0].labels:
            return None
        index = owner.axes[0].labels.index(label)
        return Quantity(owner.values[:, index], unit_of_label(owner.unit, index), owner.axes[1:], owner.description)


@contextmanager
def _installed(name: str) -> Iterator[None]:
    """Around an import: InputError that names the package which is missing."""
    try:
        yield
    except ImportError:
        raise InputError(f"this needs the package {name}, which is not installed: pip install {name}") from None


def table(result: Result, names: Iterable[str] | None = None) -> tuple[tuple[str, ...], Array]:
    """Column headings with units and a table (T, 1 + K): time, then every component of the named quantities."""
    columns = list(result.components(names))
    quantities = [result.quantity(column) for column in columns]
    headings = tuple(f"{name} [{quantity.unit}]" for name, quantity in zip(columns, quantities, strict=True))
    return ("time [s]", *headings), np.column_stack([result.time, *(quantity.values for quantity in quantities)])


def write_csv(result: Result, path: str | Path, names: Iterable[str] | None = None) -> Path:
    """Write `table` as comma-separated values (RFC 4180, shortest digits that read back exactly), atomically.

    Raises InputError for unknown names and a path that is a folder or a link, ComputationError where the file cannot be
    written.

    >>> fd.write_csv(result, "tip.csv", ["rod.tip.position"])
    """
    headings, rows = table(result, names)
    path = Path(path)
    with replacing(path) as part, open(part, "w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow(headings)
        writer.writerows(rows.tolist())
    return path


def read_only(values: Array) -> Array:
    """The values as a float64 array that cannot be written to; copied unless they are that already."""
    array = np.asarray(values, dtype=np.float64)
    if array.flags.writeable or array.base is not None:
        array = array.copy()
        array.setflags(write=False)
    return array


def check_times(time: Array) -> None:
    """Raises InputError unless time is (T,), finite and not decreasing."""
    if time.ndim != 1:
        raise InputError(f"time has shape {time.shape}, not (T,)")
    if not np.isfinite(time).all():
        raise InputError("time holds values that are not finite")
    if (np.diff(time) < 0).any():
        k = int(np.argmax(np.diff(time) < 0))
        raise InputError(f"time decreases from {time[k]:g} s to {time[k + 1]:g} s at row {k + 1}")


# ---- guards -------------------------------------------------------------------------------------------------------


def _check_quantities(result: Result) -> None:
    axes: dict[str, Axis] = {}
    for name, quantity in result.quantities.items():
        _check_name("quantity", name)
        if len(quantity.values) != result.time.size:
            raise InputError(f"quantity {name!r} has {len(quantity.values)} rows, time has {result.time.size}")
        for axis in quantity.axes:
            if axes.setdefault(axis.name, axis) != axis:
                raise InputError(f"quantity {name!r}: axis {axis.name!r} has other labels than in another quantity")
    for name in axes.keys() & result.quantities.keys():
        raise InputError(f"{name!r} names both a quantity and an axis; rename one")
    for name in result.geometry:
        _check_name("body", name)


def _check_attributes(attributes: Mapping[str, Any]) -> None:
    for name in attributes:
        _check_name("attribute", name)
    with suppress(TypeError, ValueError):  # all at once, and one by one where that tells which
        json.dumps(list(attributes.values()))
        return
    for name, value in attributes.items():
        try:
            json.dumps(value)
        except (TypeError, ValueError):
            raise InputError(f"attribute {name!r} is not a plain JSON value: {value!r}") from None
