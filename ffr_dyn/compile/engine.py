"""A compiled scene with its memory, ready to be evaluated and integrated: the door from Python to the entry points."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, cast

import numpy as np

from ffr_dyn.compile.alignment import aligned
from ffr_dyn.compile.first_use import ensure_compiled
from ffr_dyn.compile.scene_tables import System
from ffr_dyn.compile.stiff_rows import with_stiff_rows
from ffr_dyn.compile.workspace import new_stages, new_work
from ffr_dyn.kernels.entry_points import evaluate_exact, evaluate_loads, record_state, run, run_controlled, step
from ffr_dyn.kernels.simd.entry_point import ENTRY_POINTS
from ffr_dyn.kernels.simd.force_kernel import kernel_of
from ffr_dyn.kernels.simd.table_address import pack
from ffr_dyn.kernels.tables import NOT_FINITE, OK, PER_ROW, Clock, Control, Model, Record, Tables, Work
from ffr_dyn.scene.force_kinds import kernels_of
from ffr_prep.common.arrays import Array
from ffr_prep.common.brief import Brief

if TYPE_CHECKING:
    from ffr_dyn.integrators import Controlled, Integrator

LEAST_STEP = 1e-9  # of a controlled method, relative to the spacing of its rows


@dataclass(frozen=True, repr=False)
class Engine(Brief):
    """The tables of a scene, and where the entry points find them (`words`, as `pack` wrote them)."""

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


def new_engine(
    system: System,
    x: Array,
    v: Array,
    method: Integrator | None = None,
    gains: tuple[float, float, float] = (0.0, 0.0, 0.0),
    *,
    start: float = 0.0,
    spacing: float = 0.0,
    keeps_passed: bool = False,
) -> Engine:
    """Memory for a scene at the state (x, v), which it owns, and for a method (none: evaluations alone).

    start   : time of step number 0 [s]
    spacing : of the numbered steps of a method that chooses its own [s]
    keeps_passed : whether positions beside singular ones are kept (`Work.passed`)

    The first engine of a kind waits until what it needs is compiled.
    """
    if method is not None and method.takes_forces:
        system = with_stiff_rows(system)
    kinds = () if method is None else (type(method),)
    chosen = [entry.chosen(system.model) if entry.needed(system.model) else None for entry in ENTRY_POINTS.values()]
    kernels = kernels_of(system.scene)
    ensure_compiled(*kinds, chosen=chosen, forces=kernels)
    if method is None:
        stages, h = new_stages(system, 0), 0.0
    else:
        kept, h = 2 if method.repeatable else 0, method.step
        stages = new_stages(system, method.stage_count, method.row_stages, method.numbers, kept)
    clock = Clock(np.array([h, h or spacing]), np.zeros(3, dtype=np.int64), np.array(gains))
    control = _control(system, method, start, spacing)
    keeps_terms = method is not None and method.keeps_terms
    work, of_work = new_work(system.model, keeps_terms=keeps_terms, keeps_passed=keeps_passed)
    places = np.array([0 if each is None else each.address for each in chosen], dtype=np.int64)
    if method is not None:
        places[step.number] = method.do_step.address
    forces = np.array([kernel_of(kernel).address for kernel in kernels], dtype=np.int64)
    own = np.array(x, dtype=float), np.array(v, dtype=float)
    memory, addresses = aligned((places, forces, stages, clock, control, *own))
    places, forces, stages, clock, control, x, v = memory
    tables = Tables(0, places, forces, system.model, work, stages, clock, control, x, v)
    return _packed(system, tables, {**system.addresses, **of_work, **addresses})


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


def _packed(system: System, tables: Tables, addresses: Mapping[int, int]) -> Engine:
    words = pack(tables, addresses)
    words[0] = words.ctypes.data
    return Engine(system, tables._replace(address=words.ctypes.data), words)


def with_model(engine: Engine, model: Model) -> Engine:
    """The same memory for other constant tables of the same shapes."""
    return _packed(replace(engine.system, model=model, addresses={}), engine.tables._replace(model=model), {})


def evaluate_at(engine: Engine, t: float, x: Array, v: Array) -> int:
    """Accelerations and multipliers at (t, x, v) with the true mass matrix, in the engine's work tables. A status."""
    return evaluate_exact(engine.tables, t, np.ascontiguousarray(x, dtype=float), np.ascontiguousarray(v, dtype=float))


def load_at(engine: Engine, t: float, x: Array, v: Array) -> int:
    """Right-hand sides of the applied loads alone at (t, x, v), in the engine's work tables. A status."""
    return evaluate_loads(engine.tables, t, np.ascontiguousarray(x, dtype=float), np.ascontiguousarray(v, dtype=float))


def record_row(engine: Engine, t: float, record: Record, row: int) -> int:
    """Evaluate the engine's state at time t as `evaluate_at` and keep it as a row. A status."""
    status = record_state(engine.tables, t, record, row)
    return NOT_FINITE if status == OK and not np.isfinite(record.vd[row]).all() else status


def fill_rows(engine: Engine, record: Record, start: float, substeps: int) -> int:
    """Go on by `substeps` steps of the engine's method per row of the record, from step number clock.steps[NEXT]. A status.

    start : time of step number 0 [s]
    clock.steps[FILLED] tells how many rows were filled.
    """
    engine.tables.clock.steps[PER_ROW] = substeps
    return row_filler(engine, record)(start)


def row_filler(engine: Engine, record: Record) -> Callable[[float], int]:
    """`fill_rows` for one record, again and again at the least cost: of the time of step number 0, a status."""
    entry = run_controlled if engine.tables.control.numbers.size else run
    call, words = entry.general.c_function, pack(record)
    address, place = engine.address, words.ctypes.data

    def fill(start: float, kept: Array = words) -> int:  # the numbers at `place` live as long as this function
        return call(address, start, place)

    return fill
