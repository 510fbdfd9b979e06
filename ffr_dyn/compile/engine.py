"""A compiled scene with its memory, ready to be evaluated and integrated: the door from Python to the compiled units."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, cast

import numpy as np

from ffr_dyn.compile.alignment import aligned
from ffr_dyn.compile.first_use import ensure_compiled
from ffr_dyn.compile.scene_tables import System
from ffr_dyn.compile.workspace import new_stages, new_work
from ffr_dyn.kernels.entry_points import (
    applied_unit,
    controlled_rows_unit,
    record_unit,
    rows_unit,
    truly_unit,
    unit_addresses,
)
from ffr_dyn.kernels.simd.table_address import pack
from ffr_dyn.kernels.tables import Clock, Control, Model, Record, Tables, Work
from ffr_dyn.kernels.unit import kernel_named
from ffr_dyn.scene.force_kinds import kernels_of

if TYPE_CHECKING:
    from ffr_dyn.integrators import Controlled, Integrator

Array = np.ndarray

LEAST_STEP = 1e-9  # of a controlled method, relative to the spacing of its rows

_CALL = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64, ctypes.c_double, ctypes.c_int64, ctypes.c_int64)


@dataclass(frozen=True)
class Machine:
    """The tables of a scene, and where the compiled units find them (`words`, as `pack` wrote them)."""

    system: System
    tables: Tables
    words: Array

    @property
    def address(self) -> int:
        return self.tables.address

    @property
    def work(self) -> Work:
        return self.tables.work

    @property
    def x(self) -> Array:
        return self.tables.x

    @property
    def v(self) -> Array:
        return self.tables.v


def new_machine(
    system: System,
    x: Array,
    v: Array,
    method: Integrator | None = None,
    gains: tuple[float, float, float] = (0.0, 0.0, 0.0),
    *,
    start: float = 0.0,
    spacing: float = 0.0,
) -> Machine:
    """Memory for a scene at the state (x, v), which it owns, and for a method (none: evaluations alone).

    start   : time of step number 0 [s]
    spacing : of the numbered steps of a method that chooses its own [s]

    The first machine of a kind waits until what it needs is compiled.
    """
    kinds = () if method is None else (type(method),)
    ensure_compiled(*kinds, model=system.model, forces=kernels_of(system.scene))
    if method is None:
        stages, h = new_stages(system, 0), 0.0
    else:
        kept, h = 2 if method.repeatable else 0, method.step
        stages = new_stages(system, method.stage_count, method.row_stages, method.numbers, kept)
    clock = Clock(np.array([h, h or spacing]), np.zeros(3, dtype=np.int64), np.array(gains))
    control = _control(system, method, start, spacing)
    calls = () if method is None else method.calls
    keeps_terms, looks_ahead = (False, 0) if method is None else (method.keeps_terms, method.looks_ahead)
    work = new_work(system.model, keeps_terms=keeps_terms, looks_ahead=looks_ahead)
    units = np.array(unit_addresses(system.model, calls), dtype=np.int64)
    forces = np.array([kernel_named(name).address for name in kernels_of(system.scene)], dtype=np.int64)
    own = np.array(x, dtype=float), np.array(v, dtype=float)
    units, forces, work, stages, clock, control, own = aligned((units, forces, work, stages, clock, control, own))
    return _packed(system, Tables(0, units, forces, system.model, work, stages, clock, control, *own))


def _control(system: System, method: Integrator | None, start: float, spacing: float) -> Control:
    if method is None or not method.controlled:
        return Control(np.zeros(0), np.zeros(2, dtype=np.int64), *(np.zeros(0) for _ in range(6)))
    place, controlled = system.layout, cast("Controlled", method)
    wanted = controlled.tolerances
    x, v = np.full(place.x_size, wanted.position), np.full(place.v_size, wanted.velocity)
    for b, body in enumerate(system.scene.bodies):
        # Elastic coordinates are displacements times the square root of a mass; their rates count over one step.
        elastic, n = wanted.elastic * np.sqrt(body.model.mass), body.model.n
        x[place.ix[b] + 7 : place.ix[b] + 7 + n] = elastic
        v[place.iv[b] + 6 : place.iv[b] + 6 + n] = -elastic
    numbers = [0.01 * spacing, start, start, 1.0, wanted.relative, controlled.estimate_order, LEAST_STEP * spacing]
    sizes = (place.x_size, place.v_size) * 2
    return Control(np.array(numbers), np.zeros(2, dtype=np.int64), x, v, *(np.zeros(size) for size in sizes))


def _packed(system: System, tables: Tables) -> Machine:
    words = pack(tables)
    words[0] = words.ctypes.data
    return Machine(system, tables._replace(address=words.ctypes.data), words)


def with_model(machine: Machine, model: Model) -> Machine:
    """The same memory for other constant tables of the same shapes."""
    return _packed(replace(machine.system, model=model), machine.tables._replace(model=model))


def evaluate_at(machine: Machine, t: float, x: Array, v: Array) -> int:
    """Accelerations and multipliers at (t, x, v) with the true mass matrix, in the machine's work tables. A status."""
    x, v = np.ascontiguousarray(x, dtype=float), np.ascontiguousarray(v, dtype=float)
    return _CALL(truly_unit.address)(machine.address, t, x.ctypes.data, v.ctypes.data)


def load_at(machine: Machine, t: float, x: Array, v: Array) -> int:
    """Right-hand sides of the applied loads alone at (t, x, v), in the machine's work tables. A status."""
    x, v = np.ascontiguousarray(x, dtype=float), np.ascontiguousarray(v, dtype=float)
    return _CALL(applied_unit.address)(machine.address, t, x.ctypes.data, v.ctypes.data)


def record_row(machine: Machine, t: float, record: Record, row: int) -> int:
    """Evaluate the machine's state at time t as `evaluate_at` and keep it as a row. A status."""
    words = pack(record)
    return _CALL(record_unit.address)(machine.address, t, words.ctypes.data, row)


def fill_rows(machine: Machine, method: Integrator, record: Record, start: float, substeps: int) -> int:
    """Go on by `substeps` steps of the method per row of the record, from step number clock.steps[0]. A status.

    start : time of step number 0 [s]
    clock.steps[2] tells how many rows were filled.
    """
    machine.tables.clock.steps[1] = substeps
    return row_filler(machine, method, record)(start)


def row_filler(machine: Machine, method: Integrator, record: Record) -> Callable[[float], int]:
    """`fill_rows` for one record, again and again at the least cost: of the time of step number 0, a status."""
    unit = controlled_rows_unit if method.controlled else rows_unit
    call, words, step = _CALL(unit.address), pack(record), method.unit.address
    address, place = machine.address, words.ctypes.data

    def fill(start: float, kept: Array = words) -> int:  # the numbers at `place` live as long as this function
        return call(address, start, place, step)

    return fill
