"""Static equilibrium: where a scene stays at rest under gravity, loads and springs, its drivers held still.

In minimal coordinates y of unit mass the residual is the acceleration from rest, r(y) = y_ddot, and K = -dr/dy the tangent
stiffness: constraint forces, elastic forces and geometric stiffening are all in it. A step solves (K + s) dy = r with the
smallest shift s >= 0 that makes K + s positive and the step no longer than a radius: far away it goes downhill, so that a
stable equilibrium is found, and near it is Newton's. A step that overshoots (r . dy turns strongly negative) is taken again
with half the radius. (Nocedal & Wright 2006, ch. 4; Matthies & Strang 1979 for the work of a step as its measure.)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ffr_dyn.analyses.forward import with_all_reactions
from ffr_dyn.analyses.outcome import result_of
from ffr_dyn.analyses.registry import OfMoment
from ffr_dyn.analyses.settings import MomentSettings
from ffr_dyn.analyses.states import held
from ffr_dyn.consistency.assemble import Assembled, assemble, in_space
from ffr_dyn.consistency.evaluation import Evaluator, evaluate, evaluator, record_states
from ffr_dyn.consistency.mobility import named_motion
from ffr_dyn.consistency.tangent import Chart, chart, movement, rates, sizes, state, stiffness
from ffr_dyn.consistency.validity import strained_in
from ffr_dyn.kernels.tables import EVALUATIONS
from ffr_dyn.results.quantities import selected
from ffr_dyn.results.result import Result
from ffr_dyn.scene.parts import described
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError, InputError

ITERATIONS = 100
LARGEST_STEP = 0.3  # rad, or part of the scene's size
TOLERANCE = 1e-12  # of the last step, the same
NEUTRAL = 1e-7  # of a stiffness, relative to that of the applied forces
ROUNDING = 1e-13  # of a stiffness, relative to the largest


@dataclass(frozen=True)
class Static(OfMoment):
    """The drivers are held still, and so is what depends on the time."""

    def perform(self, scene: Scene, settings: MomentSettings, **how: Any) -> Result:
        return static(scene, **settings.span, **how)


@dataclass(frozen=True)
class _Balance:
    """A position, what is left of the forces there (d,), tangent stiffness (d, d), and iterations so far."""

    near: Chart
    residual: Array
    K: Array
    iterations: int


def static(
    scene: Scene, *, time: float = 0.0, outputs: Sequence[str] = ("default",), path: str | Path | None = None
) -> Result:
    """The equilibrium of a scene at `time` [s] that is downhill from its start: one row, with all reactions.

    outputs : names or patterns of the quantities to keep beside the efforts, as in `forward`

    The attributes tell whether it is stable (the tangent stiffness of the free motions is positive definite) and its lowest
    stiffness per mass [1/s^2].

    Raises InputError for a motion that nothing holds, with its name; ComputationError when no equilibrium is found.
    """
    assembled = assemble(in_space(held(scene, time)), time=time)
    selected(assembled.system, outputs)
    at = evaluator(assembled.system)
    found = _balanced(at, time, assembled.x)
    lowest = float("inf")
    if found.residual.size:
        values, vectors = np.linalg.eigh(0.5 * (found.K + found.K.T))
        _require_held(found, values, vectors)
        lowest = float(values[0])
    return _result(scene, assembled, at, found, lowest, outputs, path)


def _balanced(at: Evaluator, time: float, x: Array) -> _Balance:
    """The equilibrium. One pass: tangent at a position, then the longest step that does not overshoot."""
    radius, still = LARGEST_STEP, np.zeros(at.system.layout.v_size)
    for iteration in range(ITERATIONS):
        near = chart(at, time, x, still)
        d = near.steps.size
        residual = rates(near, near.x, still)[d:]
        K, _ = stiffness(near)
        if not np.isfinite(K).all():
            raise ComputationError("the forces are not finite near the equilibrium; check loads and springs")
        step = _step(near, K, residual, radius)
        if movement(near, step) < TOLERANCE:
            return _Balance(near, residual, K, iteration + 1)
        for _ in range(20):
            there, _ = state(near, step, np.zeros(d))
            if rates(near, there, still)[d:] @ step > -0.5 * (residual @ step):
                break
            radius = 0.5 * movement(near, step)
            step = _step(near, K, residual, radius)
        x, radius = there, min(2 * radius, LARGEST_STEP)
    _, vectors = np.linalg.eigh(0.5 * (K + K.T))
    raise _not_held(near, vectors[:, 0], f"no equilibrium was found in {ITERATIONS} steps")


def _step(near: Chart, K: Array, residual: Array, radius: float) -> Array:
    """(K + s) dy = r with the smallest shift that makes K + s positive and the movement at most the radius."""
    if residual.size == 0:
        return residual
    values = np.linalg.eigvalsh(0.5 * (K + K.T))
    one = np.eye(len(K))
    floor = ROUNDING * np.abs(values).max() + 1e-12
    shift = 0.0 if values[0] > floor else floor - 1.5 * values[0]
    step = np.linalg.solve(K + shift * one, residual)
    if movement(near, step) <= radius:
        return step
    low, high = shift, max(2 * shift, np.abs(values).min(), floor)
    while movement(near, np.linalg.solve(K + high * one, residual)) > radius:
        low, high = high, 4 * high
    for _ in range(12):
        middle = np.sqrt(max(low, 1e-6 * high) * high)
        longer = movement(near, np.linalg.solve(K + middle * one, residual)) > radius
        low, high = (middle, high) if longer else (low, middle)
    return np.linalg.solve(K + high * one, residual)


def _require_held(found: _Balance, values: Array, vectors: Array) -> None:
    near = found.near
    now = evaluate(near.at, near.time, near.x, np.zeros(near.at.system.layout.v_size))
    applied = np.linalg.solve(near.M, now.force) / sizes(near.at)
    limit = NEUTRAL * np.abs(applied).max() + ROUNDING * np.abs(values).max()
    loose = int(np.argmin(np.abs(values)))
    if abs(values[loose]) <= limit:
        raise _not_held(near, vectors[:, loose], "the equilibrium is not determined")


def _not_held(near: Chart, direction: Array, what: str) -> InputError:
    motion = named_motion(near.at.system.scene, near.at.system.layout, near.x, near.Z @ direction)
    return InputError(
        f"{what}: nothing holds the motion {motion}; add a joint, a driver or a spring that does, or start nearer to an "
        "equilibrium"
    )


def _result(
    scene: Scene,
    assembled: Assembled,
    at: Evaluator,
    found: _Balance,
    lowest: float,
    outputs: Sequence[str],
    path: str | Path | None,
) -> Result:
    still = np.zeros(assembled.system.layout.v_size)
    record = record_states(at, np.array([found.near.time]), found.near.x[None], still[None])
    stable = lowest > 0
    notes = [*assembled.notes, *strained_in(assembled.system, record)]
    if not stable:
        notes.append(f"the equilibrium is unstable: its lowest stiffness per mass is {lowest:.4g} 1/s^2")
    attributes = {
        **described(scene),
        "analysis": "static equilibrium",
        "method": f"Newton's method, {found.iterations} steps",
        "evaluations": int(at.work.info[EVALUATIONS]),
        "degrees_of_freedom": assembled.degrees_of_freedom,
        "stable": int(stable),
        "lowest_stiffness": lowest if np.isfinite(lowest) else None,
        "notes": notes,
        "status": "complete",
    }
    attributes = {key: value for key, value in attributes.items() if value is not None}
    record = with_all_reactions(assembled, record)
    return result_of(assembled.system, record, attributes, path, outputs)
