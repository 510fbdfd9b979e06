"""Bodies that deform without vibration under the inertia of a prescribed motion, q_dot = q_ddot = 0, at every output time.

Joints that are redundant for rigid bodies, as the five bearings of a crankshaft, ask for deformation. With J_r and J_e the
columns of rigid and elastic velocities in the Jacobian of the rows, and the combinations P^T J_r = 0 that no rigid motion
changes, the rows tell the range D of (P^T J_e)^T and leave its null space N to the deformation:

    q = N s + D d,        rows -> (R, p, d),        N^T q_ddot = 0.

Without such rows N is the identity. What the rows ask for along D they get, rates and accelerations too, and no more of
them than they ask for: they are what rigid bodies do not meet, of the size of the deformation.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ffr_dyn.analyses.integration import with_all_reactions
from ffr_dyn.analyses.kinematic import Followed, along_the_path
from ffr_dyn.analyses.outcome import needed, result_of
from ffr_dyn.consistency.assemble import Assembled, assemble
from ffr_dyn.consistency.doubts import SUDDEN, checked
from ffr_dyn.consistency.evaluation import Evaluator, copied, evaluate, evaluator, joined
from ffr_dyn.equations.layout import moved, to_global_axes, velocity_sizes
from ffr_dyn.kernels.tables import AT, EVALUATIONS, HERE
from ffr_dyn.results.quantities import selected
from ffr_dyn.results.result import Result
from ffr_dyn.scene.described import described
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError

ITERATIONS = 30
TOLERANCE = 1e-12  # of a change of s, relative to its size or to one that strains the body by STRAINED
STRAINED, BENT = 1e-6, 1e-2  # q over size and root of mass of a body: the least by which changes and differences go
ROUNDING = 1e-9  # relative as well, of a change that another one follows, or that gets no shorter
SHARES = tuple(2.0**-k for k in range(8))
SLOW = 0.5  # of the change before, from where a new tangent is worth its time
DIFFERENCE = 1e-6


@dataclass(frozen=True)
class _Ways:
    """Directions of the velocities in which rows tell the motion, (V, C), and in which they leave it to bodies to deform,
    (V, E); those of deformation by shares of the sizes of bodies."""

    told: Array
    left: Array


@dataclass(frozen=True)
class _Posed:
    """A scene near to the rigid position x at one time, at rest but for its prescribed motion."""

    at: Evaluator
    time: float
    x: Array
    ways: _Ways


def inverse_quasi_static(
    scene: Scene,
    span: tuple[float, float, float],
    outputs: Sequence[str],
    path: str | Path | None,
    progress: Callable[[float], None] | None,
) -> Result:
    """At every output time: the undeformed motion, then the deformation at which the elastic accelerations vanish.

    span : [s] start, end, output step

    Raises ComputationError for a singular position and where no deformation balances the forces.
    """
    assembled = assemble(scene, time=span[0])
    selected(assembled.system, needed(scene, outputs))
    rigid = along_the_path(scene, span)
    at = evaluator(assembled.system)
    s, tangent, ways, rows = np.zeros(0), None, None, []
    for row, time in enumerate(rigid.record.time):
        x = _undeformed_state(assembled, rigid, row)
        at.work.loads.reference[:] = rigid.record.forces[row]  # with the turns of the path
        ways = _ways(at, float(time), x, ways)
        posed = _Posed(at, float(time), x, ways)
        s, tangent = _deformed(posed, s if s.size else np.zeros(ways.left.shape[1]), tangent)
        _pose(posed, s)
        rows.append(copied(at.record))
        if progress is not None:
            progress(float(time))
    record = with_all_reactions(assembled, joined(rows))
    attributes = {
        **described(scene),
        "analysis": "inverse dynamics, quasi-static deformation",
        "method": "Newton-Raphson",
        "evaluations": int(at.work.info[EVALUATIONS]),
        "degrees_of_freedom": assembled.degrees_of_freedom,
        "computed": assembled.computed,
        "notes": [*assembled.notes, *checked("inverse", assembled, record, {SUDDEN: rigid.sudden})],
        "status": "complete",
    }
    return result_of(assembled.system, record, attributes, path, outputs, rigid.angles)


def _undeformed_state(assembled: Assembled, rigid: Followed, row: int) -> Array:
    place, x = assembled.system.layout, np.zeros(assembled.system.layout.x_size)
    of, there = rigid.assembled.system.layout, rigid.record.x[row]
    for b in range(len(place.n)):
        x[place.R(b)], x[place.p(b)] = there[of.R(b)], there[of.p(b)]
    return x


def _ways(at: Evaluator, time: float, x: Array, before: _Ways | None) -> _Ways:
    """The directions at a rigid position, those of deformation as near as can be to the ones before.

    Raises ComputationError in a singular position.
    """
    place, size = at.system.layout, at.system.layout.v_size
    now = evaluate(at, time, x, np.zeros(size))
    if now.singular or at.work.independence[HERE] < AT:
        raise ComputationError(
            f"at t = {time:.6g} s the position is singular: joints and drivers determine neither the motion nor the "
            "deformation there; choose output times that miss it, or use elastic=Dynamic()"
        )
    rigid = np.concatenate([np.arange(place.iv[b], place.iv[b] + 6) for b in range(len(place.n))])
    sizes, elastic = velocity_sizes(at.system.scene, place), np.setdiff1d(np.arange(size), rigid)
    unmet = np.linalg.svd(now.jacobian[:, rigid])[0][:, rigid.size :]
    asked = np.linalg.svd((unmet.T @ now.jacobian)[:, elastic] * sizes[elastic])[2]
    deforming = np.zeros((size, elastic.size))
    deforming[elastic] = sizes[elastic, None] * asked.T
    told, left = np.split(deforming, [unmet.shape[1]], axis=1)
    if before is not None:  # the tangent of one time serves the next
        own = left / sizes[:, None]
        U, _, V = np.linalg.svd(own.T @ (before.left / sizes[:, None]))
        left = left @ (U @ V)
    return _Ways(np.hstack([np.eye(size)[:, rigid], told]), left)


def _pose(posed: _Posed, s: Array) -> Array:
    """(E,) elastic accelerations along what is left, with the deformation s there and what the rows ask for beside it."""
    at, time, ways, place = posed.at, posed.time, posed.ways, posed.at.system.layout
    still = np.zeros(place.v_size)
    x = moved(place, posed.x, ways.left @ s)
    for _ in range(ITERATIONS):
        now = evaluate(at, time, x, still)
        step = ways.told @ np.linalg.solve(now.jacobian @ ways.told, -now.Phi)
        x = moved(place, x, step)
        if np.abs(step).max() < 1e-13:
            break
    v = ways.told @ np.linalg.solve(now.jacobian @ ways.told, -now.nu)
    acceleration = evaluate(at, time, x, to_global_axes(place, x, v)).acceleration
    found: Array = ways.left.T @ (acceleration / velocity_sizes(at.system.scene, place) ** 2)
    return found


def _deformed(posed: _Posed, s: Array, tangent: Array | None) -> tuple[Array, Array]:
    """Deformation with vanishing elastic accelerations, and the tangent that found it, to be tried again at the next time."""
    if s.size == 0:
        return s, np.zeros((0, 0))
    before, residual = np.inf, _pose(posed, s)
    for _ in range(ITERATIONS):
        fresh = tangent is None
        tangent = _tangent(posed, s) if tangent is None else tangent
        step = np.linalg.solve(tangent, residual)
        size = float(np.abs(step).max())
        scale = max(float(np.abs(s).max()), STRAINED)
        if size < TOLERANCE * scale or before < ROUNDING * scale:
            return s - step, tangent
        found = _stepped(posed, s, step, tangent)
        if found is None and size < ROUNDING * scale:
            return s, tangent
        if found is None and fresh:
            break
        s, residual = found or (s, residual)
        tangent = None if found is None or size > SLOW * before else tangent
        before = size
    raise ComputationError(
        f"at t = {posed.time:.6g} s no quasi-static deformation was found: the load is near to buckling a body, or the "
        "elastic forces are not finite; use elastic=Dynamic()"
    )


def _stepped(posed: _Posed, s: Array, step: Array, tangent: Array) -> tuple[Array, Array] | None:
    """Deformation and its accelerations after the longest share of a step whose next one, by the same tangent, is shorter;
    None where there is none. (Natural monotonicity: P. Deuflhard, Newton Methods for Nonlinear Problems, 2004, 3.3.)"""
    size = np.abs(step).max()
    for share in SHARES:
        with suppress(ComputationError):
            residual = _pose(posed, s - share * step)
            if np.abs(np.linalg.solve(tangent, residual)).max() <= (1 - share / 4) * size:
                return s - share * step, residual
    return None


def _tangent(posed: _Posed, s: Array) -> Array:
    """(E, E) central differences of the elastic accelerations."""
    h = DIFFERENCE * max(float(np.abs(s).max()), BENT)
    return np.array([(_pose(posed, s + one) - _pose(posed, s - one)) / (2 * h) for one in h * np.eye(s.size)]).T
