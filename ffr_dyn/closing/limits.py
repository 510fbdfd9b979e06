"""Rows of a result that stand in a singular position are limits of what is beside them on the path.

There constraints depend on one another: positions are known to the square root of the tolerance, rates, accelerations and
reactions not at all, though the motion goes on along its branch. So the state is carried to times -+h and -+2h, closed, and
evaluated. With F_h the mean of both sides, (4 F_h - F_2h) / 3 is their limit to order h^4; elastic coordinates stay, since
what they add is odd in h. What both sides differ by is half as much for half of h where there is a limit; what jumps or
grows without bound has none: not a number.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ffr_dyn.closing.constraints import constraints_of
from ffr_dyn.closing.positions import close_positions, close_velocities
from ffr_dyn.compile.engine import Engine, new_engine, record_row
from ffr_dyn.compile.scene_tables import System
from ffr_dyn.compile.workspace import new_record
from ffr_dyn.equations.layout import moved, to_body_axes
from ffr_dyn.kernels.tables import AT, HERE, OK, Record
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError

DIP = 0.01  # independence (the square of a distance) in a singular position over that of other rows, at most
CLEAR = 1e-4  # independence at the sides, at least
NEAR, FAR = 0.01, 0.1  # rad, or of a body's size: how far the nearer sides are, at least and at most
PASSES = 3  # of the path, which is bent by the accelerations that are found
HALF = 0.7  # of what sides twice as far differ by, at most
APART, ROUNDING = 1e-6, 1e-8  # of what sides differ by, and of limits, relative to the largest of their kind
LIMITS = ("x", "v", "vd", "r", "rd", "reaction")


def with_limits(system: System, all_rows: System | None, record: Record) -> Record:
    """The record with limits in the columns LIMITS of rows that stand in a singular position; a position in which nothing
    moves is on no path and stays as it is.

    all_rows : the scene with its redundant rows, whose reactions the record has; None where it has none
    """
    kept = _evaluator(system)
    rows = [_Row(record.time[k], record.x[k], record.v[k], record.forces[k]) for k in range(record.time.size)]
    share = np.array([_independence(kept, row) for row in rows])
    stands = (share < AT) & record.v.any(axis=1)
    if share.size > 1:
        stands &= share < DIP * share.max()
    if not stands.any():
        return record
    found, whole = Record(*(column.copy() for column in record)), _evaluator(all_rows or system)
    for k in np.flatnonzero(stands).tolist():
        for name, limit in _limits(kept, whole, rows[k]).items():
            getattr(found, name)[k] = limit
        for b in range(len(system.layout.n)):
            found.x[k, system.layout.p(b)] /= np.linalg.norm(found.x[k, system.layout.p(b)])
    return found


@dataclass(frozen=True)
class _Row:
    """A time [s] and the state there; what forces start from."""

    time: float
    x: Array
    v: Array
    forces: Array


@dataclass(frozen=True)
class _Evaluator:
    """Memory for the evaluation of a row."""

    engine: Engine
    record: Record


def _evaluator(system: System) -> _Evaluator:
    place = system.layout
    return _Evaluator(new_engine(system, np.zeros(place.x_size), np.zeros(place.v_size)), new_record(system, 1))


def _evaluated(at: _Evaluator, row: _Row) -> bool:
    """Evaluate the row; whether it can be."""
    at.engine.x[:], at.engine.v[:] = row.x, row.v
    at.engine.work.loads.reference[:] = row.forces
    return record_row(at.engine, row.time, at.record, 0) == OK


def _independence(at: _Evaluator, row: _Row) -> float:
    """The least share of a constraint row that others do not contain."""
    return float(at.engine.work.independence[HERE]) if _evaluated(at, row) else 0.0


def _limits(kept: _Evaluator, whole: _Evaluator, row: _Row) -> dict[str, Array]:
    """The columns LIMITS of a row; none where constraints depend on one another beside it as well."""
    h, bend, limits = _clear(kept, row), np.zeros_like(row.v), dict[str, Array]()
    blocks = [block.name for block in whole.engine.system.blocks]
    order = [blocks.index(block.name) for block in kept.engine.system.blocks]
    for _ in range(PASSES if h else 0):
        sides = {}
        for number in (-2, -1, 1, 2):
            _evaluated(whole, _beside(kept.engine.system, row, number * h, bend))
            one = whole.record._replace(reaction=whole.record.reaction[:, order])
            sides[number] = {name: getattr(one, name)[0].copy() for name in LIMITS}
        limits = {name: _limit({number: side[name] for number, side in sides.items()}) for name in LIMITS}
        bend = np.nan_to_num(limits["vd"])
    return limits


def _limit(sides: dict[int, Array]) -> Array:
    """Of values at -2h, -h, h, 2h."""
    near, far = 0.5 * (sides[-1] + sides[1]), 0.5 * (sides[-2] + sides[2])
    largest, limit = max(np.abs(side).max(initial=0.0) for side in sides.values()), (4.0 * near - far) / 3.0
    tends = np.abs(sides[1] - sides[-1]) <= HALF * np.abs(sides[2] - sides[-2]) + APART * largest
    return np.where(tends, np.where(np.abs(limit) > ROUNDING * largest, limit, 0.0), np.nan)


def _clear(kept: _Evaluator, row: _Row) -> float:
    """How long before and after the row [s] the constraint rows are independent; zero where they are not."""
    system, still = kept.engine.system, np.zeros_like(row.v)
    place, size = system.layout, max(body.model.size for body in system.scene.bodies) or 1.0
    turns = [float(np.linalg.norm(row.v[place.omega(b)])) for b in range(len(place.n))]
    shifts = [float(np.linalg.norm(row.v[place.R_dot(b)])) / size for b in range(len(place.n))]
    for far in np.geomspace(NEAR, FAR, 4) / max(*turns, *shifts, 1e-300):
        try:
            shares = [_independence(kept, _beside(system, row, later, still)) for later in (-far, far)]
        except InputError:  # the path does not go on, or a driver has no value
            return 0.0
        if min(shares) > CLEAR:
            return float(far)
    return 0.0


def _beside(system: System, row: _Row, later: float, bend: Array) -> _Row:
    """The row so much later [s] on its path, at accelerations `bend` (V,); elastic coordinates stay."""
    place, constraints = system.layout, constraints_of(system.scene, list(system.blocks), row.time + later)
    rigid = np.ones(place.v_size)
    for b in range(len(place.n)):
        rigid[place.q_dot(b)] = 0.0
    step, faster = later * row.v + 0.5 * later**2 * bend, row.v + later * rigid * bend
    x = close_positions(constraints, moved(place, row.x, rigid * to_body_axes(place, row.x, step)), faster)
    return _Row(row.time + later, x, close_velocities(constraints, x, faster), row.forces)
