"""One evaluation of the compiled equations at a state, for the analyses that look at single states.

A row of a record evaluates the scene; what it leaves in the scratch memory is read here as plain matrices. Small motions,
Jacobians and null spaces are in the velocities [A^T R_dot, omega_bar, q_dot].
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import qr, solve_triangular

from ffr_dyn.compile.engine import Engine, new_engine, record_row
from ffr_dyn.compile.scene_tables import System
from ffr_dyn.compile.workspace import new_record
from ffr_dyn.consistency.failure import failure
from ffr_dyn.equations.inertia import kept_integrals, mass_matrix
from ffr_dyn.equations.layout import (
    Layout,
    initial_state,
    meets,
    moved,
    to_body_axes,
    to_global_axes,
    velocity_sizes,
)
from ffr_dyn.functions.rotation import skew
from ffr_dyn.kernels.entry_points import project
from ffr_dyn.kernels.simd.table_address import pack
from ffr_dyn.kernels.tables import IN_Q, IN_SHARED, OK, SINGULAR_CONSTRAINT, Record, Work
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.arrays import Array
from ffr_prep.common.brief import Brief
from ffr_prep.common.errors import ComputationError

RANK_TOLERANCE = 1e-9  # of a singular value of the mass-weighted Jacobian, relative to the largest


@dataclass(frozen=True, repr=False)
class Evaluator(Brief):
    """A compiled scene with the memory of one evaluation."""

    engine: Engine
    record: Record

    @cached_property
    def packed(self) -> Array:
        """The record as compiled code finds it."""
        return pack(self.record)

    @property
    def system(self) -> System:
        return self.engine.system

    @property
    def work(self) -> Work:
        return self.engine.work


@dataclass(frozen=True, repr=False)
class Evaluation(Brief):
    """The equations at one state: rows in the order of the system's blocks, then one for each coordinate across the plane
    of a planar scene (`locked`).

    Phi, nu, gamma : (C,) constraint rows, their rates and right-hand sides;  jacobian : (C, V)
    force          : (V,) all forces but those of the constraints, body axes
    acceleration   : (V,) [A^T R_ddot, omega_bar_dot, q_ddot];  lam : (C,) multipliers
    singular       : the rows depend on one another; acceleration and lam mean nothing then
    """

    Phi: Array
    nu: Array
    gamma: Array
    jacobian: Array
    force: Array
    acceleration: Array
    lam: Array
    singular: bool


def evaluator(system: System) -> Evaluator:
    """Memory for evaluations of a compiled scene."""
    return Evaluator(new_engine(system, *initial_state(system.scene, system.layout)), new_record(system, 1))


def evaluate(at: Evaluator, time: float, x: Array, v: Array) -> Evaluation:
    """The equations at (time, x, v). Raises ComputationError as a forward run would, except for dependent rows."""
    system, work = at.system, at.work
    status = _look(at, time, x, v)
    rows, bodies, across = work.rows, work.bodies, locked(system.layout)
    still = np.zeros(across.size)
    return Evaluation(
        np.concatenate([rows.Phi, still]),
        np.concatenate([rows.nu, still]),
        np.concatenate([rows.gamma, still]),
        np.concatenate([_jacobian(system, work), unit_rows(across, system.layout.v_size)]),
        bodies.f.copy(),
        bodies.acc.copy(),
        rows.lam.copy(),
        status == SINGULAR_CONSTRAINT,
    )


def accelerations(at: Evaluator, time: float, x: Array, v: Array) -> Array:
    """(V,) d/dt of v, global axes. Raises ComputationError as a forward run would."""
    if _look(at, time, x, v) == SINGULAR_CONSTRAINT:
        raise failure(at.system, at.work, SINGULAR_CONSTRAINT, time)
    return at.record.vd[0].copy()


def _look(at: Evaluator, time: float, x: Array, v: Array) -> int:
    """Evaluate; a status, which is OK or that of dependent rows."""
    at.engine.x[:], at.engine.v[:] = x, v
    status = record_row(at.engine, time, at.record, 0, at.packed)
    if status not in (OK, SINGULAR_CONSTRAINT):
        raise failure(at.system, at.work, status, time)
    return int(status)


def locked(place: Layout) -> Array:
    """Numbers of the velocities that a planar scene does not have."""
    across = [{*range(6)}.difference(place.active(b)) for b in range(len(place.n))]
    return np.array([place.iv[b] + c for b, those in enumerate(across) for c in sorted(those)], int)


def unit_rows(numbers: Array, size: int) -> Array:
    """(K, size) rows with a one at the numbers (K,)."""
    rows = np.zeros((numbers.size, size))
    rows[np.arange(numbers.size), numbers] = 1.0
    return rows


def record_states(at: Evaluator, times: Array, xs: Array, vs: Array) -> Record:
    """A row for every state. Raises ComputationError as a forward run would."""
    rows = []
    for time, x, v in zip(times, xs, vs, strict=True):
        if evaluate(at, float(time), x, v).singular:
            raise failure(at.system, at.work, SINGULAR_CONSTRAINT, float(time))
        rows.append(copied(at.record))
    return joined(rows)


def copied(record: Record) -> Record:
    """A record with its own memory."""
    return Record(*(column.copy() for column in record))


def joined(rows: list[Record]) -> Record:
    """Records one after the other."""
    return Record(*(np.concatenate(columns) for columns in zip(*rows, strict=True)))


def _jacobian(system: System, work: Work) -> Array:
    """(C, V) from the coefficients that the kernels keep for each row and side."""
    place, rows, markers = system.layout, system.model.rows, system.model.markers
    jacobian = np.zeros((rows.kind.size, place.v_size))
    for block, ends in enumerate(rows.marker):
        lines = slice(rows.start[block], rows.start[block + 1])
        for side, marker in enumerate(ends):
            b = markers.body[marker] if marker >= 0 else len(place.n)
            if b == len(place.n):
                continue
            part = work.rows.jac[block * len(ends) + side, :, : rows.start[block + 1] - rows.start[block]].T
            jacobian[lines, place.rigid(b)] += part[:, :6]
            if place.n[b]:
                phi = shapes(system, work, marker)
                jacobian[lines, place.q_dot(b)] += part[:, :3] @ phi[:3] + part[:, 6:] @ phi[3:]
    return jacobian


def shapes(system: System, work: Work, marker: int) -> Array:
    """(6, n) shapes of a marker at the last evaluation: of its displacement, of its rotation vector."""
    markers = system.model.markers
    n = system.model.bodies.where[markers.body[marker], 0]
    return work.markers.phi[markers.start[marker] : markers.start[marker] + 6 * n].reshape(6, n)


# ---- mass and free motions ------------------------------------------------------------------------------------------


def total_mass_matrix(scene: Scene, place: Layout, x: Array) -> Array:
    """(V, V) mass matrix of all bodies, body axes."""
    M = np.zeros((place.v_size, place.v_size))
    for b, body in enumerate(scene.bodies):
        at = slice(place.iv[b], place.iv[b] + 6 + place.n[b])
        M[at, at] = mass_matrix(kept_integrals(body), x[place.q(b)])
    return M


def evaluated_mass_matrix(at: Evaluator) -> Array:
    """(V, V) mass matrix at the state evaluated last, from what the kernels keep of it; in a plane motions across it, of
    which they keep but a part, have an inertia of their own."""
    place, bodies, work = at.system.layout, at.system.model.bodies, at.work.bodies
    M = np.zeros((place.v_size, place.v_size))
    for b, n in enumerate(place.n):
        rigid, elastic, e = place.rigid(b), place.q_dot(b), int(bodies.where[b, IN_Q])
        block, s = M[rigid, rigid], skew(work.s[b])
        block[[0, 1, 2], [0, 1, 2]] = bodies.mass[b]
        block[3:, :3], block[:3, 3:], block[3:, 3:] = s, -s, work.J[b]
        if n:
            c = bodies.where[b, IN_SHARED]
            P, H = bodies.P_dm[3 * c : 3 * (c + n)], work.H[3 * e : 3 * (e + n)]
            coupling = np.concatenate([P, H]).reshape(6, n)
            M[rigid, elastic], M[elastic, rigid] = coupling, coupling.T
            M[elastic, elastic] = np.eye(n)
    across = locked(place)
    own = M[across, across]
    M[across], M[:, across] = 0.0, 0.0
    M[across, across] = own
    return M


def _weights(M: Array) -> Array:
    """(V, V) lower triangle whose square is M; motions without inertia, as about the axis of a thin rod, get a little.

    Raises ComputationError for a matrix that is far from positive.
    """
    try:
        return np.linalg.cholesky(M)
    except np.linalg.LinAlgError:
        little = NO_INERTIA * np.maximum(np.diag(M), np.diag(M).max())
    try:
        return np.linalg.cholesky(M + np.diag(little))
    except np.linalg.LinAlgError:
        raise ComputationError(
            "the mass matrix of the scene is not positive: a body is deformed further than its modes can represent; make its "
            "load smaller, or cut it into parts"
        ) from None


def _lowered(lower: Array, right: Array) -> Array:
    """The inverse of a triangle on a right-hand side, by substitution: rows of kg, kg m^2 and of elastic coordinates, which
    differ by any factor in a small machine, are not weighed against each other."""
    found: Array = solve_triangular(lower, right, lower=True, check_finite=False)
    return found


def _raised(lower: Array, right: Array) -> Array:
    """The same of the transposed triangle."""
    found: Array = solve_triangular(lower, right, lower=True, trans="T", check_finite=False)
    return found


def of_mass(M: Array, forces: Array) -> Array:
    """(V, ...) forces (V, ...) in the norm of the inverse mass matrix. Raises as `free_motions`."""
    return _lowered(_weights(M), forces)


def free_motions(jacobian: Array, M: Array) -> Array:
    """(V, d) with jacobian Z = 0 and Z^T M Z = 1: all motions that the rows leave free."""
    lower = _weights(M)
    if jacobian.shape[0] == 0:
        return _raised(lower, np.eye(len(lower)))
    weighted = _lowered(lower, jacobian.T).T
    length = np.linalg.norm(weighted, axis=1)
    return _raised(lower, _complement((weighted / np.where(length > 0, length, 1.0)[:, None]).T))


def _complement(columns: Array) -> Array:
    """(V, d) orthonormal vectors at right angles to all columns (V, C): a fifth of the time of a singular value
    decomposition of these, whose small factor alone is looked at for its rank."""
    Q, R = qr(columns, check_finite=False)
    size = min(columns.shape)
    values = np.linalg.svd(R[:size], compute_uv=False)
    rank = int((values > RANK_TOLERANCE * values.max(initial=0.0)).sum())
    if rank == size:
        return Q[:, size:]
    left = np.linalg.svd(R[:size])[0]
    return np.hstack([Q[:, :size] @ left[:, rank:], Q[:, size:]])


def smallest_motion(at: Evaluator, now: Evaluation, rates: Array) -> Array:
    """(V,) the motion, smallest in the norm of the mass matrix, by which the rows change at these rates (C,), at the state
    that was evaluated last, `now`."""
    if now.singular:
        return smallest_step(now.jacobian, evaluated_mass_matrix(at), rates)
    project(at.engine.tables, -rates[: at.work.rows.Phi.size])
    return at.work.bodies.acc.copy()


def smallest_step(jacobian: Array, M: Array, target: Array, tolerance: float = RANK_TOLERANCE) -> Array:
    """The step (V,) with jacobian step = target that is smallest in the norm of the mass matrix.

    tolerance : how small a combination of rows of length one is left out, over the largest
    """
    lower = _weights(M)
    weighted = _lowered(lower, jacobian.T).T
    length = np.linalg.norm(weighted, axis=1)
    length = np.where(length > 0, length, 1.0)
    unit = np.linalg.lstsq(weighted / length[:, None], target / length, rcond=tolerance)[0]
    return _raised(lower, unit)


def row_sizes(jacobian: Array, sizes: Array) -> Array:
    """(C,) by how much rows [m, -] change at most where all moves by its size (V,); one of rows that nothing moves."""
    found = np.abs(jacobian) @ sizes
    return np.where(found > 0, found, 1.0)


def rows_close(at: Evaluator, x: Array, now: Evaluation, tolerance: float) -> bool:
    """Whether the rows of a position (X,) vanish to a tolerance, relative to their sizes, or to rounding."""
    scene, place = at.system.scene, at.system.layout
    allowed = tolerance * row_sizes(now.jacobian, velocity_sizes(scene, place))
    return bool((np.abs(now.Phi) <= allowed).all()) or meets(scene, x, now.Phi, 0.0)


NO_INERTIA = 1e-9  # of the largest inertia, in place of none
CLOSED = 1e-12  # of rows after a projection, relative to their sizes


CORRECTIONS = 10


class OpenError(ComputationError):
    """A state that is not brought back onto its constraints."""


def closed(at: Evaluator, time: float, x: Array, v: Array) -> tuple[Array, Array]:
    """(x, v) moved onto the constraints by the smallest motion in the norm of the mass matrix, Euler parameters of length
    one. Raises OpenError where that does not succeed."""
    place = at.system.layout
    x = moved(place, x, np.zeros(place.v_size))
    for _ in range(CORRECTIONS):
        now = evaluate(at, time, x, v)
        if rows_close(at, x, now, CLOSED):
            break
        x = moved(place, x, smallest_step(now.jacobian, evaluated_mass_matrix(at), -now.Phi))
    else:
        raise OpenError(f"at t = {time:.6g} s the state is too far off the constraints; use smaller tolerances")
    inside = to_body_axes(place, x, v) + smallest_step(now.jacobian, evaluated_mass_matrix(at), -now.nu)
    return x, to_global_axes(place, x, inside)
