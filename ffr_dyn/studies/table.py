"""The table of a study: a row for every run, appended as runs end, and a netCDF file of it all.

Rows go to a journal beside the table, a line of JSON each, on the disk as they come: whatever ends a study, what was computed
is there, and a line that was cut off is computed again. The file itself is made from all rows in the order of the
runs, so that it does not depend on who computed what when. xarray opens it: dimension "run", parameters as coordinates; of
histories also "row", with the times of every run.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterable, Mapping, Set
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

import h5py
import numpy as np

from ffr_dyn.results.file import STUDY
from ffr_dyn.studies.identity import mark
from ffr_dyn.studies.measures import HISTORY, TIME, Number
from ffr_dyn.studies.plan import Study, units_of
from ffr_dyn.studies.runs import BETWEEN, Row
from ffr_prep.common.arrays import Array
from ffr_prep.common.brief import Brief, Rows
from ffr_prep.common.errors import InputError
from ffr_prep.common.hdf5 import check_heaps, new_file
from ffr_prep.common.outputs import replacing
from ffr_prep.common.process_memory import check_memory
from ffr_prep.common.reading import reading
from ffr_prep.common.units import dimension_of, split_quantity, to_si
from ffr_prep.common.units import in_words as dimension_in_words

RUN, ROW = "run", "row"
MESSAGE, NOTES = "message", "notes"
FORMAT = 1


@dataclass(frozen=True, repr=False)
class Table(Brief):
    """The rows of a study.

    parameters : by name, a value of every run: numbers (N,), in SI where they were written with a unit, or texts
    outputs    : by name (N,), NaN where a run has none, as one that failed; of histories (N, T), NaN beyond the last row of a
                 run, with "time" [s] (N, T)
    messages   : why a run has failed, or has not all outputs; empty for the others
    notes      : what the run of a row notes of itself, such as rows too coarse for what moves between them
    units      : of outputs that are of a quantity of the runs; of parameters whose value the scene or the study writes with
                 a unit, in SI

    >>> table = fd.load_table("study.nc")
    >>> table.outputs["tip"]
    """

    parameters: Mapping[str, Any]
    outputs: Mapping[str, Array]
    messages: tuple[str, ...]
    units: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.messages)

    def __getitem__(self, name: str) -> Any:
        found = self.outputs.get(name, self.parameters.get(name))
        if found is None:
            raise InputError(f"the table has no {name!r}; there are {', '.join([*self.parameters, *self.outputs])}")
        return found

    @property
    def failed(self) -> Array:
        """Numbers of the runs with a message."""
        return np.flatnonzero([bool(message) for message in self.messages])

    def _title(self) -> str:
        failed = f", {self.failed.size} of which failed" if self.failed.size else ""
        return f"Table of {len(self)} runs{failed}"

    def _rows(self) -> Rows:
        varied = [(name, f"{len(set(values))} values") for name, values in self.parameters.items()]
        found = {name: y[np.isfinite(y)] for name, y in self.outputs.items() if name != TIME}
        return varied + [(name, f"{y.min():.6g} to {y.max():.6g}") for name, y in found.items() if y.size]


def table(study: Study, rows: Mapping[int, Row]) -> Table:
    """Of the rows that there are."""
    count = len(study.points)
    longest = max((len(row.values.get(TIME, ())) for row in rows.values()), default=0)  # type: ignore[arg-type]
    whole = [one.name for one in study.outputs if one.how == HISTORY]
    if whole:
        remedy = (
            "take fewer histories or runs, a longer output step, or histories = true, which keeps a file for each run"
        )
        check_memory(3 * 8.0 * count * longest * (len(whole) + 1), f"histories of {count} runs", remedy)
    outputs = {one.name: np.full((count, longest) if one.name in whole else count, np.nan) for one in study.outputs}
    outputs |= {TIME: np.full((count, longest), np.nan)} if whole else {}
    messages, notes, units = [""] * count, [""] * count, units_of(study) | ({TIME: "s"} if whole else {})
    for number, row in rows.items():
        messages[number], notes[number] = row.message, row.notes
        units.update(row.units)
        for name, value in row.values.items():
            outputs[name][number, ...] = _padded(value, longest) if isinstance(value, list) else value
    columns = {name: [point[name] for point in study.points] for name in study.parameters}
    made = {name: _column(values, units.get(name)) for name, values in columns.items()}
    units |= {name: unit for name, (_, unit) in made.items() if unit}
    return Table({name: values for name, (values, _) in made.items()}, outputs, tuple(messages), units, tuple(notes))


def _padded(values: list[float], count: int) -> list[float]:
    return values + [np.nan] * (count - len(values))


def _column(values: list[Any], unit: str | None) -> tuple[Any, str | None]:
    """The values of a parameter as numbers, those with a unit in SI, and that unit; as they are if a text is none."""
    given = {one: split_quantity(one) for one in values if isinstance(one, str)}
    if not all(given.values()):
        return values, None
    try:
        for quantity in filter(None, given.values()):
            unit = unit or dimension_in_words(dimension_of(quantity[1]))
        size = {text: to_si(*quantity, unit) for text, quantity in given.items() if quantity}
    except InputError:  # a unit that is none, or of something else: the message of its run
        return values, None
    return np.array([size.get(one, one) for one in values], dtype=float), unit


def noted(made: Table) -> list[tuple[int, str]]:
    """(how many runs note it, the note) of all notes, those that differ in their numbers alone by the first of them."""
    found: dict[str, list[str]] = {}
    for note in (one for text in made.notes if text for one in text.split(BETWEEN)):
        found.setdefault(_DIGITS.sub("#", note), []).append(note)
    return sorted(((len(same), same[0]) for same in found.values()), key=lambda one: -one[0])


_DIGITS = re.compile(r"\d[\d.e+-]*")
_DAMAGE = (ValueError, TypeError, KeyError, AttributeError, OverflowError, RecursionError)  # of a line of the journal


# ---- the journal ----------------------------------------------------------------------------------------------------


def journal_of(path: str | Path) -> Path:
    """Beside the table."""
    return Path(f"{path}.journal")


class Journal:
    """Rows as they come; opened for a study, whose rows it may have already.

    Raises InputError for the journal of another study.
    """

    def __init__(self, path: str | Path, study: Study) -> None:
        self.rows: dict[int, Row] = {}
        self.runs, self._outputs = len(study.points), {one.name for one in study.outputs}
        self.path, begun = journal_of(path), {"study": mark(study), "runs": self.runs}
        sound = self._read(begun) if self.path.exists() else 0
        self._file = open(self.path, "r+b" if self.path.exists() else "w+b")  # noqa: SIM115 - held while runs end
        self._file.truncate(sound)
        self._file.seek(sound)
        if not sound:
            self._write(begun)

    def _read(self, begun: Mapping[str, Any]) -> int:
        """The length of what is whole."""
        sound, lines = 0, self.path.read_bytes().split(b"\n")[:-1]
        for k, line in enumerate(lines):
            try:
                entry = json.loads(line)
                row = _row(entry, begun["runs"], self._outputs) if k else None
            except _DAMAGE:  # done again from here
                break
            if k == 0 and entry != begun:
                raise InputError(
                    f"{self.path} is of another study, or of this one before it was changed: name another output, or remove "
                    "it to begin anew"
                )
            if row is not None:
                self.rows[row.number] = row
            sound += len(line) + 1
        return sound

    def add(self, rows: Iterable[Row]) -> None:
        """Rows that are done, on the disk when this returns. Raises OSError where they cannot be kept."""
        for row in rows:
            self.rows[row.number] = row
            entry = {"run": row.number, "values": dict(row.values), "message": row.message, "units": dict(row.units)}
            self._write(entry | {"notes": row.notes}, flush=False)
        self._flush()

    def _write(self, entry: Mapping[str, Any], flush: bool = True) -> None:
        self._file.write(json.dumps(entry).encode() + b"\n")
        if flush:
            self._flush()

    def _flush(self) -> None:
        self._file.flush()
        os.fsync(self._file.fileno())

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        with suppress(OSError):  # of rows that a full disk has not taken, which was said
            self._file.close()


def _row(entry: Mapping[str, Any], runs: int, outputs: Set[str]) -> Row:
    """A line of the journal. Raises ValueError or KeyError for what no run of the study can have left."""
    number, values = int(entry["run"]), {str(name): _number(value) for name, value in entry["values"].items()}
    if not (0 <= number < runs and values.keys() <= outputs | {TIME}):
        raise ValueError(number)
    units = {name: str(unit) for name, unit in entry.get("units", {}).items()}
    return Row(number, values, str(entry["message"]), units, str(entry.get("notes", "")))


def _number(value: Any) -> Number:
    return [float(one) for one in value] if isinstance(value, list) else float(value)


# ---- the file -------------------------------------------------------------------------------------------------------


def save_table(made: Table, path: str | Path) -> None:
    """Write a table (netCDF-4), whole or not at all."""
    texts = {MESSAGE: list(made.messages), NOTES: list(made.notes or [""] * len(made))}
    with replacing(path) as part, new_file(part) as file:
        file.attrs[STUDY] = FORMAT
        _variable(file, RUN, np.arange(len(made), dtype=np.int64)).make_scale(RUN)
        if TIME in made.outputs:
            _variable(file, ROW, np.arange(made.outputs[TIME].shape[1], dtype=np.int64)).make_scale(ROW)
        for name, values in {**made.parameters, **made.outputs, **texts}.items():
            data = _variable(file, name, values)
            for dimension, scale in zip(data.dims, (RUN, ROW), strict=False):
                dimension.attach_scale(file[scale])
            if name not in made.parameters:
                data.attrs["coordinates"] = " ".join(made.parameters)
            else:
                data.attrs["parameter"] = 1
            if name in made.units:
                data.attrs["units"] = made.units[name]


def _variable(file: h5py.File, name: str, values: Any) -> h5py.Dataset:
    if isinstance(values, list):
        return file.create_dataset(name, data=[str(one) for one in values], dtype=h5py.string_dtype())
    return file.create_dataset(name, data=values)


def load_table(path: str | Path) -> Table:
    """Read a table. Raises InputError for a file that is none.

    >>> table = fd.load_table("study.nc")
    """
    with reading(path, "the table of a study", OSError, KeyError, AttributeError, TypeError, ValueError, RuntimeError):
        check_heaps(path)
        return _read(Path(path))


def _read(path: Path) -> Table:
    with h5py.File(path, "r") as file:
        if STUDY not in file.attrs:
            raise InputError(f"{path} is not the table of a study; ffr-dyn sweep writes one")
        if file.attrs[STUDY] != FORMAT:
            raise InputError(
                f"{path} is a table of format {file.attrs[STUDY]}, and this version reads format {FORMAT}: use the version "
                "that wrote it, or sweep again"
            )
        found = {name: _values(data) for name, data in file.items() if name not in (RUN, ROW, MESSAGE, NOTES)}
        parameters = {name: values for name, values in found.items() if "parameter" in file[name].attrs}
        outputs = {name: values for name, values in found.items() if name not in parameters}
        units = {name: str(file[name].attrs["units"]) for name in found if "units" in file[name].attrs}
        notes = tuple(_values(file[NOTES])) if NOTES in file else ()
        return Table(parameters, outputs, tuple(_values(file[MESSAGE])), units, notes)


def _values(data: h5py.Dataset) -> Any:
    return list(data.asstr()[:]) if h5py.check_string_dtype(data.dtype) else data[:]
