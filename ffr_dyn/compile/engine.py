"""A compiled scene with its memory, ready to be evaluated and integrated: the door from Python to the entry points."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, cast

import numpy as np

from ffr_dyn.compile.scene_tables import System
from ffr_dyn.compile.stiff_rows import with_stiff_rows
from ffr_dyn.compile.workspace import memory_of, new_tables
from ffr_dyn.functions.time_functions import OPERATION, PIECEWISE, USER
from ffr_dyn.kernels.entry_points import evaluate_exact, evaluate_loads, record_state, run, run_controlled
from ffr_dyn.kernels.simd.table_address import address_of, pack, place_of
from ffr_dyn.kernels.tables import NOT_FINITE, OK, PER_ROW, SPACING, Control, Model, Record, Tables, Work
from ffr_prep.common.arrays import Array
from ffr_prep.common.brief import Brief

if TYPE_CHECKING:
    from ffr_dyn.integrators import Controlled, Integrator

LEAST_STEP = 1e-9  # of a controlled method, relative to the spacing of its rows
# The same, where functions of time may rest and begin again: a longer step may see nothing of a pulse.
LONGEST_STEP, SHAPED = 10.0, {PIECEWISE, USER, OPERATION}


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
) -> Engine:
    """Memory for a scene at the state (x, v), which it owns, and for a method (none: evaluations alone).

    start   : time of step number 0 [s]
    spacing : of the numbered steps of a method that chooses its own [s]

    The first engine of a kind waits until what it needs is compiled.
    """
    if method is not None and method.takes_forces:
        system = with_stiff_rows(system)
    tables, words = new_tables(system, memory_of(system, method))
    tables.clock.time[SPACING] = spacing
    if method is not None:
        tables.stages.numbers[:] = method.numbers
        tables.clock.time[: SPACING + 1] = method.step, method.step or spacing
        if method.controlled:
            _set_control(tables.control, system, cast("Controlled", method), start, spacing)
    tables.clock.gains[:] = gains
    tables.x[:], tables.v[:] = x, v
    return _engine(system, tables, words)


def _set_control(control: Control, system: System, method: Controlled, start: float, spacing: float) -> None:
    place, wanted = system.layout, method.tolerances
    control.weight_x[:], control.weight_v[:] = wanted.position, wanted.velocity
    for b, body in enumerate(system.scene.bodies):
        # Elastic coordinates are displacements times the square root of a mass; their rates count over one step.
        elastic = wanted.elastic * np.sqrt(body.model.mass)
        control.weight_x[place.q(b)], control.weight_v[place.q_dot(b)] = elastic, -elastic
    least, kinds = LEAST_STEP * spacing, set(system.model.functions.kind.tolist())
    longest = LONGEST_STEP * spacing if kinds & SHAPED else np.inf
    control.numbers[:] = 0.01 * spacing, start, start, 1.0, wanted.relative, method.estimate_order, least, longest


def _engine(system: System, tables: Tables, words: Array) -> Engine:
    """Engine with the words of the system's model in those of the tables."""
    at = place_of(Tables, "model")
    words[at : at + system.words.size] = system.words
    words[0] = address_of(words)
    return Engine(system, tables._replace(address=int(words[0])), words)


def with_model(engine: Engine, model: Model) -> Engine:
    """The same memory for other constant tables of the same shapes."""
    system = replace(engine.system, model=model, words=pack(model))
    return _engine(system, engine.tables._replace(model=model), engine.words.copy())


def evaluate_at(engine: Engine, t: float, x: Array, v: Array) -> int:
    """Accelerations and multipliers at (t, x, v) with the true mass matrix, in the engine's work tables. A status."""
    return evaluate_exact(engine.tables, t, np.ascontiguousarray(x, dtype=float), np.ascontiguousarray(v, dtype=float))


def load_at(engine: Engine, t: float, x: Array, v: Array) -> int:
    """Right-hand sides of the applied loads alone at (t, x, v), in the engine's work tables. A status."""
    return evaluate_loads(engine.tables, t, np.ascontiguousarray(x, dtype=float), np.ascontiguousarray(v, dtype=float))


def record_row(engine: Engine, t: float, record: Record, row: int, packed: Array | None = None) -> int:
    """Evaluate the engine's state at time t as `evaluate_at` and keep it as a row. A status.

    packed : `pack(record)`, for who records again and again
    """
    status = record_state(engine.tables, t, record if packed is None else packed, row)
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
    address, place = engine.address, address_of(words)

    def fill(start: float, kept: Array = words) -> int:  # the numbers at `place` live as long as this function
        return call(address, start, place)

    return fill
