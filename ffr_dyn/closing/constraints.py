"""The constraint rows of a scene at any state, by the compiled equations, with the memory of one evaluation.

What assembly asks for over and over: Phi, nu, gamma and the Jacobian in the velocities [A^T R_dot, omega_bar, q_dot], at one
time. What drivers prescribe then is evaluated once, in readable form, which says in words where it has no value.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_array

from ffr_dyn.closing.row_space import FEW, Matrix
from ffr_dyn.compile.engine import Engine, new_engine
from ffr_dyn.compile.scene_tables import System, compile_scene
from ffr_dyn.equations.constraint_rows import Block, drive_at
from ffr_dyn.equations.layout import Layout
from ffr_dyn.kernels.entry_points import evaluate_markers, evaluate_rows
from ffr_dyn.kernels.tables import ALL, Model, RowWork
from ffr_dyn.scene.scene import Scene
from ffr_prep.body import remembered
from ffr_prep.common.arrays import Array
from ffr_prep.common.brief import Brief


@dataclass(frozen=True, repr=False)
class Entries(Brief):
    """Where the coefficients that the kernels keep for each row and side belong in the Jacobian.

    row, side, lane : (P,) of every row on a moving body, its side of a block, and its lane there
    flexible        : of every side on a flexible body: which of the P, the marker, its first number in `phi`, and n
    at              : (E,) numbers of all entries in the matrix (C, V), row after row, in the order in which they are found
    """

    row: Array
    side: Array
    lane: Array
    flexible: tuple[tuple[slice, int, int], ...]
    at: Array


@dataclass(frozen=True, repr=False)
class Constraints(Brief):
    """The rows of some blocks at a time [s].

    blocks : whose words are the rows;  numbers : (C,) theirs among all rows of the tables
    drives : (F, 3) value, rate and second derivative of all functions of time in the tables
    """

    scene: Scene
    place: Layout
    blocks: tuple[Block, ...]
    numbers: Array
    drives: Array
    engine: Engine
    entries: Entries

    @property
    def functions(self) -> Array:
        """(C,) of each row the number of its function among `drives`, or -1."""
        found: Array = self.engine.system.model.rows.function[self.numbers]
        return found


@dataclass(frozen=True, repr=False)
class RowsAt(Brief):
    """Rows at a state: Phi, nu = dPhi/dt and gamma (C,), Jacobian J (C, V), dense where rows are few."""

    Phi: Array
    nu: Array
    gamma: Array
    J: Matrix


def constraints_of(scene: Scene, blocks: list[Block], time: float) -> Constraints:
    """All rows of the blocks. Raises InputError where a function of time has no value then, or a length is not positive."""
    system = compile_scene(scene, blocks)
    place, rows = system.layout, system.model.rows
    engine = new_engine(system, np.zeros(place.x_size), np.zeros(place.v_size))
    evaluate_markers(engine.tables, ALL, engine.x, engine.v)  # those of the ground, once
    drives = np.zeros((system.model.functions.kind.size, 3))
    said = [(block, word) for block in system.blocks for word in block.words]
    for function, (block, word) in zip(rows.function.tolist(), said, strict=True):
        if function >= 0:
            drives[function] = drive_at(block, word, time)
    return Constraints(scene, place, tuple(blocks), _numbers(system), drives, engine, entries_of(system))


def _numbers(system: System) -> Array:
    """(C,) of the rows in the order of the blocks that were compiled, those in the tables, where these have another."""
    return remembered(system.structure, ("rows", system.elimination.order), lambda: _rows_as_given(system))


def _rows_as_given(system: System) -> Array:
    order, start = system.elimination.order, system.model.rows.start
    first = dict(zip(order, start[:-1].tolist(), strict=True))
    sizes = dict(zip(order, np.diff(start).tolist(), strict=True))
    return np.array([first[k] + row for k in range(len(order)) for row in range(sizes[k])], dtype=np.int64)


def without(blocks: Iterable[Block], left_out: Array) -> list[Block]:
    """The blocks without the words that are left out (C,)."""
    numbers = iter(left_out.tolist())
    return [replace(block, words=tuple(word for word in block.words if not next(numbers))) for block in blocks]


def of_blocks(constraints: Constraints, chosen: list[int]) -> Constraints:
    """The rows of some blocks by number."""
    owners = np.repeat(np.arange(len(constraints.blocks)), [len(block.words) for block in constraints.blocks])
    blocks = tuple(constraints.blocks[k] for k in chosen)
    return replace(constraints, blocks=blocks, numbers=constraints.numbers[np.isin(owners, chosen)])


def rows_at(constraints: Constraints, x: Array, v: Array) -> RowsAt:
    """The rows at (x, v), v in global axes."""
    rows, numbers = _evaluated(constraints, x, v), constraints.numbers
    return RowsAt(rows.Phi[numbers], rows.nu[numbers], rows.gamma[numbers], _jacobian(constraints))


def open_at(constraints: Constraints, x: Array, v: Array) -> tuple[Array, Array]:
    """Phi and nu (C,) of the rows at (x, v)."""
    rows = _evaluated(constraints, x, v)
    return rows.Phi[constraints.numbers], rows.nu[constraints.numbers]


def _evaluated(constraints: Constraints, x: Array, v: Array) -> RowWork:
    work = constraints.engine.work
    work.functions[:] = constraints.drives
    evaluate_rows(constraints.engine.tables, np.ascontiguousarray(x), np.ascontiguousarray(v))
    return work.rows


def _jacobian(constraints: Constraints) -> Matrix:
    """(C, V) from the coefficients that the kernels keep for each row and side."""
    work, found, numbers = constraints.engine.work, constraints.entries, constraints.numbers
    size = int(work.rows.Phi.size), constraints.place.v_size
    kept = work.rows.jac[found.side, :, found.lane]
    values = [kept[:, :6].ravel()]
    for of, first, n in found.flexible:
        phi = work.markers.phi[first : first + 6 * n].reshape(6, n)
        values.append((kept[of, :3] @ phi[:3] + kept[of, 6:] @ phi[3:]).ravel())
    entries = np.concatenate(values)
    if size[0] <= FEW:
        return np.bincount(found.at, entries, size[0] * size[1]).reshape(size)[numbers]
    return csr_array((entries, np.divmod(found.at, size[1])), shape=size)[numbers]


def entries_of(system: System) -> Entries:
    """Entries of the rows of a scene, which those of its structure share."""
    return remembered(system.structure, "entries", lambda: _entries(system.model, system.layout))


def _entries(m: Model, place: Layout) -> Entries:
    sides = m.rows.marker.shape[1]
    markers, start, body, phi = (
        table.ravel().tolist() for table in (m.rows.marker, m.rows.start, m.markers.body, m.markers.start)
    )
    row, side, lane, first = list[int](), list[int](), list[int](), list[int]()
    flexible = list[tuple[slice, int, int]]()
    for number, marker in enumerate(markers):
        begin, end = start[number // sides : number // sides + 2]
        b = body[marker] if marker >= 0 else len(place.n)
        if b == len(place.n):
            continue
        if place.n[b]:
            flexible.append((slice(len(row), len(row) + end - begin), phi[marker], b))
        row += range(begin, end)
        lane += range(end - begin)
        side += [number] * (end - begin)
        first += [place.iv[b]] * (end - begin)
    origin = np.array(row, dtype=np.int64) * place.v_size + np.array(first, dtype=np.int64)
    at = [(origin[:, None] + np.arange(6)).ravel()]
    at += [(origin[of, None] + 6 + np.arange(place.n[b])).ravel() for of, _, b in flexible]
    shapes = tuple((of, begin, place.n[b]) for of, begin, b in flexible)
    numbers = np.array([row, side, lane], dtype=np.int64)
    return Entries(numbers[0], numbers[1], numbers[2], shapes, np.concatenate(at))
