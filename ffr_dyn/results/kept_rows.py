"""The rows that a run keeps while it goes on: their quantities, or the rows themselves.

Quantities of a short run are computed when they are first asked for, which few of them are: a study of ten thousand runs
reads two or three of sixty. What a file is written of, what adds up over steps that are not kept, and long runs, whose rows
need more memory than what is wanted of them, are computed as they come. The numbers are the same, to the bit.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from ffr_dyn.compile.scene_tables import System
from ffr_dyn.compile.workspace import row_shapes
from ffr_dyn.kernels.tables import Record
from ffr_dyn.results.power import Worked
from ffr_dyn.results.quantities import Entry, Memory, measure
from ffr_dyn.results.recorded_motion import View
from ffr_dyn.results.result import Histories, Quantity
from ffr_prep.common.arrays import Array

SMALL = 5e7  # bytes of rows that are kept


class Kept(Protocol):
    """Of a run so far: the times [s] of its output rows."""

    times: list[Array]

    def add(self, view: View, shown: Array) -> dict[str, Quantity]:
        """Go on by the rows that follow, of which those `shown` are output rows; their quantities where they are computed."""

    def quantities(self) -> Mapping[str, Quantity]:
        """Of all output rows."""


@dataclass
class Measured:
    """Quantities of the rows, part after part; `memory` is what the next ones go on from."""

    system: System
    wanted: Mapping[str, Entry]
    memory: Memory = field(default_factory=dict)
    times: list[Array] = field(default_factory=list)
    parts: list[dict[str, Quantity]] = field(default_factory=list)

    def add(self, view: View, shown: Array, last: View | None = None) -> dict[str, Quantity]:
        """See `Kept`. last : where the last row comes less than a step after the one before, that one, the middle between
        them and the last one: work is added up by Simpson's rule there, as its own formula is of equal steps."""
        every, memory = measure(view, self.memory, self.wanted)
        every = every if last is None else self._ended(every, view, last)
        self.memory = memory
        part = {name: _rows_of(quantity, shown) for name, quantity in every.items()}
        self.times.append(view.record.time[shown])
        self.parts.append(part)
        return part

    def _ended(self, every: dict[str, Quantity], view: View, last: View) -> dict[str, Quantity]:
        """The quantities of rows, with the works of the last one."""
        before = self.memory
        if len(view.record.time) > 1:
            earlier = View(self.system, Record(*(column[:-1] for column in view.record)))
            before = measure(earlier, before, self.wanted)[1]
        works = {name: replace(of, powers=()) for name, of in before.items() if isinstance(of, Worked)}
        ends = measure(last, works, {name: self.wanted[name] for name in works})[0]
        joined = {name: np.append(every[name].values[:-1], ends[name].values[-1:]) for name in works}
        return every | {name: replace(every[name], values=values) for name, values in joined.items()}

    def quantities(self) -> Mapping[str, Quantity]:
        return {
            name: Quantity(np.concatenate([part[name].values for part in self.parts]), q.unit, q.axes, q.description)
            for name, q in self.parts[0].items()
        }


@dataclass
class Recorded:
    """The rows, all of which are output rows."""

    system: System
    wanted: Mapping[str, Entry]
    times: list[Array] = field(default_factory=list)
    records: list[Record] = field(default_factory=list)

    def add(self, view: View, shown: Array) -> dict[str, Quantity]:
        self.times.append(view.record.time)
        self.records.append(view.record)
        return {}

    def quantities(self) -> Mapping[str, Quantity]:
        whole = Record(*(np.concatenate(columns) for columns in zip(*self.records, strict=True)))
        view, wanted = View(self.system, whole), self.wanted

        def made(name: str) -> Quantity:
            return measure(view, {}, {name: wanted[name]})[0][name]

        return Histories(wanted, made)


def _rows_of(quantity: Quantity, shown: Array) -> Quantity:
    if shown.size == len(quantity.values):
        return quantity
    return Quantity(quantity.values[shown], quantity.unit, quantity.axes, quantity.description)


def row_size(system: System) -> int:
    """Bytes of a row."""
    return 8 * sum(map(math.prod, row_shapes(system).values()))
