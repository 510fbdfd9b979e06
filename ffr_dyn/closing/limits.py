"""Rows of a result that stand in a singular position are limits of what is beside them on the path.

There constraints depend on one another: positions are known to the square root of the tolerance, rates, accelerations and
reactions not at all, though the motion goes on along its branch. So the state is carried to times -+h and -+2h, closed, and
evaluated. With F_h the mean of both sides, (4 F_h - F_2h) / 3 is their limit to order h^4; elastic coordinates stay, since
what they add is odd in h. What both sides differ by is half as much for half of h where there is a limit; what jumps or
grows without bound has none: not a number.

A motion that begins at rest there goes with the square of time, along a branch (`going_on`, of accelerations in place of
velocities): its limit is that of a polynomial through later times. What rests there is on no path, and forces in it that
balance one another are not known: reactions that they may change are not a number.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ffr_dyn.closing.constraints import Constraints, constraints_of, rows_at
from ffr_dyn.closing.dependent_rows import dependence_at
from ffr_dyn.closing.going_on import going_on
from ffr_dyn.closing.positions import close_positions, close_velocities, weights
from ffr_dyn.compile.engine import Engine, new_engine, record_row
from ffr_dyn.compile.scene_tables import System
from ffr_dyn.compile.workspace import new_record
from ffr_dyn.equations.constraint_rows import Block
from ffr_dyn.equations.layout import moved, to_body_axes
from ffr_dyn.functions.rotation import rotation_matrix
from ffr_dyn.kernels.tables import AT, HERE, OK, Record
from ffr_dyn.scene.joints import RELATION
from ffr_dyn.scene.scene import markers
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError

DIP = 0.01  # independence (the square of a distance) in a singular position over that of other rows, at most
CLEAR = 1e-4  # independence at the sides, at least
NEAR, FAR = 0.01, 0.1  # rad, or of a body's size: how far the nearer sides are, at least and at most
PASSES = 3  # of the path, which is bent by the accelerations that are found
HALF = 0.7  # of what sides twice as far differ by, at most
APART, ROUNDING = 1e-6, 1e-8  # of what sides differ by, and of limits, relative to the largest of their kind
LIMITS = ("x", "v", "vd", "r", "rd", "reaction")
LATER = np.array([1.0, 1.5, 2.0, 2.5, 3.0])  # times of the first, through which a limit from rest is taken
NEARER, CLEARED = 1e-3, 1e-7  # the same as NEAR and CLEAR, of what begins at rest and goes with the square of time
FALLS = 0.8  # of what the last two differ by, what the first two do at most
AGES = 1e5  # s that a motion takes to come that far, from where it is none
STRESSED = 1e-9  # of a wrench that balances others, what is none


def with_limits(system: System, all_rows: System | None, record: Record) -> Record:
    """The record with limits in the columns LIMITS of rows that stand in a singular position, where the motion begins at
    rest in those of accelerations and reactions, which have none where nothing moves.

    all_rows : the scene with its redundant rows, whose reactions the record has; None where it has none
    """
    kept = _evaluator(system)
    rows = [_Row(*(getattr(record, name)[k] for name in _Row.__annotations__)) for k in range(record.time.size)]
    share = np.array([_independence(kept, row) for row in rows])
    stands = share < AT
    if share.size > 1:
        still = np.array([here and rests(system, row.v, row.vd) for here, row in zip(stands, rows, strict=True)])
        stands &= still | (share < DIP * share.max())
    if not stands.any():
        return record
    found, whole, unknown = Record(*(column.copy() for column in record)), _evaluator(all_rows or system), None
    for k in np.flatnonzero(stands).tolist():
        if rests(system, record.v[k], record.vd[k]):
            unknown = _unknown(kept, whole, rows[k]) if unknown is None else unknown
            found.reaction[k][unknown] = np.nan
            continue
        limits = _limits if record.v[k].any() else _from_rest
        for name, limit in limits(kept, whole, rows[k]).items():
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
    vd: Array
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
    order = _order(kept, whole)
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
    for far in np.geomspace(NEAR, FAR, 4) / _fast(system, row.v):
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
    return _Row(row.time + later, x, close_velocities(constraints, x, faster), row.vd, row.forces)


def _fast(system: System, v: Array) -> float:
    """[1/s] of velocities (V,), the fastest, in rad, or in sizes of the largest body; the same of accelerations [1/s^2]."""
    place, size = system.layout, max(body.model.size for body in system.scene.bodies) or 1.0
    turns = [float(np.linalg.norm(v[place.omega(b)])) for b in range(len(place.n))]
    shifts = [float(np.linalg.norm(v[place.R_dot(b)])) / size for b in range(len(place.n))]
    return max(*turns, *shifts, 1e-300)


# ---- from rest ------------------------------------------------------------------------------------------------------------


def rests(system: System, v: Array, vd: Array) -> bool:
    """Whether velocities and accelerations are none."""
    return min(NEAR / _fast(system, v), float(np.sqrt(NEAR / _fast(system, vd)))) > AGES


def _from_rest(kept: _Evaluator, whole: _Evaluator, row: _Row) -> dict[str, Array]:
    """Accelerations and reactions of a row from which a motion begins; of one that no path leaves, what is known."""
    system = kept.engine.system
    constraints = constraints_of(system.scene, list(system.blocks), row.time)
    in_squares = replace(constraints, drives=constraints.drives[:, [0, 2, 2]] * [1.0, 1.0, 0.0])
    bend = going_on(in_squares, row.x, row.vd)
    h, order = _clear_later(kept, row, bend), _order(kept, whole)
    limits = {"reaction": np.where(_unknown(kept, whole, row), np.nan, whole.record.reaction[0, order])}
    for _ in range(PASSES if h else 0):
        found = list[tuple[Array, Array]]()
        try:
            path = [_beside(system, row, later, bend) for later in LATER * h]
        except InputError:  # it does not go on
            return limits
        for beside in path:
            _evaluated(whole, beside)
            found.append((whole.record.vd[0].copy(), whole.record.reaction[0, order]))
        limits = {
            name: _first(np.array(of)) for name, of in zip(("vd", "reaction"), zip(*found, strict=True), strict=True)
        }
        bend = np.nan_to_num(limits["vd"])
    return limits


def _order(kept: _Evaluator, whole: _Evaluator) -> list[int]:
    """Numbers of the blocks of the motion among all."""
    blocks = [block.name for block in whole.engine.system.blocks]
    return [blocks.index(block.name) for block in kept.engine.system.blocks]


def _unknown(kept: _Evaluator, whole: _Evaluator, row: _Row) -> Array:
    """(K, 6) which reactions of a row are not known where nothing moves; `whole` is evaluated at it."""
    system = kept.engine.system
    _evaluated(whole, row)
    return _stressed(constraints_of(system.scene, list(system.blocks), row.time), row.x, whole.record.r[0])


def _first(values: Array) -> Array:
    """The limit of values (5, ...) at LATER, where they have one."""
    powers = np.vander(LATER, increasing=True)
    limit = np.tensordot(np.linalg.inv(powers)[0], values, axes=1)
    largest = float(np.abs(values).max(initial=0.0))
    tends = np.abs(values[1] - values[0]) <= FALLS * np.abs(values[4] - values[2]) + APART * largest
    return np.where(tends, np.where(np.abs(limit) > ROUNDING * largest, limit, 0.0), np.nan)


def _clear_later(kept: _Evaluator, row: _Row, bend: Array) -> float:
    """How long after rest [s] the constraint rows are independent; zero where they are not, or the path does not go on."""
    system = kept.engine.system
    for far in np.sqrt(2.0 * np.geomspace(NEARER, FAR, 5) / _fast(system, bend)):
        try:
            if min(_independence(kept, _beside(system, row, later, bend)) for later in LATER * far) > CLEARED:
                return float(far)
        except InputError:
            return 0.0
    return 0.0


def _stressed(constraints: Constraints, x: Array, r: Array) -> Array:
    """(K, 6) which reactions of the blocks are part of forces that balance one another, markers being at r (M, 3)."""
    place, scene = constraints.place, constraints.scene
    J = np.asarray(rows_at(constraints, x, np.zeros(place.v_size)).J @ np.eye(place.v_size))
    A = J @ weights(scene, place, x, True, True)
    lengths = np.maximum(np.linalg.norm(A, axis=1), 1e-300)
    owners = np.repeat(np.arange(len(constraints.blocks)), [len(block.words) for block in constraints.blocks])
    found = np.zeros((len(constraints.blocks), 6), dtype=bool)
    for stress in dependence_at(constraints, x, J).combinations.T:
        pulls = [(stress / lengths * (owners == k)) @ J for k in range(len(constraints.blocks))]
        wrenches = [_wrench(constraints, x, r, *each) for each in zip(constraints.blocks, pulls, strict=True)]
        found |= np.abs(wrenches) > STRESSED * np.abs(wrenches).max()
    return found


def _wrench(constraints: Constraints, x: Array, r: Array, block: Block, pull: Array) -> Array:
    """(6,) force and moment (global axes) at marker j of a block, but for the sign, of its forces on all bodies (V,)."""
    if block.words[0].kind == RELATION:
        return np.append(np.abs(pull).max(), np.zeros(5))
    place, bodies = constraints.place, len(constraints.scene.bodies)
    of = [markers(constraints.scene)[number][0] for number in block.markers[1::-1]]
    b = next(body for body in of if body < bodies)
    A = rotation_matrix(x[place.p(b)])
    force, moment = A @ pull[place.R_dot(b)], A @ pull[place.omega(b)]
    return np.concatenate([force, moment - np.cross(r[block.markers[1]] - x[place.R(b)], force)])
