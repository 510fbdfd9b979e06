"""What each elastic coordinate of a motion does to each output: a ranking, and a first guess of what a model needs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ffr_dyn.analyses.evaluation import Evaluator, evaluator, moved, record_states, to_body_axes, to_global_axes
from ffr_dyn.economy.drive import Samples, driven, elastic_columns, followed, samples
from ffr_dyn.economy.outputs import Probe, histories, needed
from ffr_dyn.economy.trial import Trial, states
from ffr_dyn.measure import measure, selected
from ffr_dyn.result import Result
from ffr_dyn.scene import Scene

Array = np.ndarray

SEEN = 100  # states along the run at which residuals are formed
LOOKED = 4  # states at which the effect of a coordinate on the outputs is looked at: where it is largest


@dataclass(frozen=True)
class Contributions:
    """Elastic coordinates of the whole scene and what they do.

    body, mode : (E,) which coordinate of which body, in the scene's own numbers
    effect     : (E, outputs) largest change of an output when the coordinate is taken away, its joints kept closed
    """

    body: Array
    mode: Array
    effect: Array


def of_motion(pilot: Trial, of: Probe) -> Contributions:
    """Contributions of the coordinates that a run has, from its own motion."""
    assembled, x, v = states(pilot)
    rows = _spaced(len(x))
    everything = tuple(tuple(range(n)) for n in assembled.system.layout.n)
    seen = samples(assembled, assembled, everything, pilot.result.time[rows], x[rows], v[rows])
    columns = elastic_columns(seen.system.layout)
    at = _positions(seen, columns)
    return _effects(pilot, of, seen, columns, seen.x[:, at], seen.v[:, columns], -1.0)


def of_omitted(trial: Trial, large: Trial, of: Probe) -> Contributions:
    """Contributions of the coordinates that `trial` lacks and `large` has, driven one-way by the motion of `trial`."""
    small, x, v = states(trial)
    big, _, _ = states(large)
    rows = _spaced(len(x))
    kept = _kept(trial, large)
    seen = samples(small, big, kept, trial.result.time[rows], x[rows], v[rows])
    place = big.system.layout
    have = {place.q_dot(b).start + k for b, modes in enumerate(kept) for k in modes}
    columns = np.array([k for k in elastic_columns(place) if k not in have], int)
    if columns.size == 0:
        return Contributions(np.zeros(0, int), np.zeros(0, int), np.zeros((0, len(of.outputs))))
    q, q_dot = driven(seen, columns, followed(seen, columns))
    return _effects(large, of, seen, columns, q, q_dot, 1.0)


def _kept(trial: Trial, large: Trial) -> tuple[tuple[int, ...], ...]:
    """Where the modes of the trial are among those of the larger model."""
    pairs = zip(trial.choice.parts, large.choice.parts, strict=True)
    return tuple(tuple(many.modes.index(k) for k in few.modes) for few, many in pairs)


def _spaced(rows: int) -> Array:
    return np.unique(np.linspace(0, rows - 1, min(rows, SEEN)).round().astype(int))


def _positions(seen: Samples, columns: Array) -> Array:
    """Where elastic coordinates, given among the velocities, are among the positions."""
    place = seen.system.layout
    at = {place.q_dot(b).start + k: place.q(b).start + k for b in range(len(place.n)) for k in range(place.n[b])}
    return np.array([at[k] for k in columns], int)


def _effects(
    large: Trial, of: Probe, seen: Samples, columns: Array, q: Array, q_dot: Array, sign: float
) -> Contributions:
    place, Z = seen.system.layout, followed(seen, columns)
    at = evaluator(seen.system)
    effect = np.zeros((columns.size, len(of.outputs)))
    for c in range(columns.size):
        rows = np.sort(np.argsort(-np.abs(q[:, c]), kind="stable")[:LOOKED])
        plain = _values(at, large.scene, of, seen.time[rows], seen.x[rows], seen.v[rows])
        steps = sign * Z[rows, :, c] * q[rows, c][:, None]
        rates = sign * Z[rows, :, c] * q_dot[rows, c][:, None]
        x = np.array([moved(place, seen.x[k], step) for k, step in zip(rows, steps, strict=True)])
        v = np.array([
            to_global_axes(place, x[i], to_body_axes(place, seen.x[k], seen.v[k]) + rates[i])
            for i, k in enumerate(rows)
        ])  # fmt: skip
        changed = _values(at, large.scene, of, seen.time[rows], x, v)
        effect[c] = [np.abs(a - b).max(initial=0.0) for a, b in zip(changed, plain, strict=True)]
    body, mode = _named(large, place, columns)
    return Contributions(body, mode, effect)


def _named(large: Trial, place: object, columns: Array) -> tuple[Array, Array]:
    bodies, modes = [], []
    for b, part in enumerate(large.choice.parts):
        start = place.q_dot(b).start  # type: ignore[attr-defined]
        for k, mode in enumerate(part.modes):
            if start + k in columns:
                bodies.append(b)
                modes.append(mode)
    return np.array(bodies, int), np.array(modes, int)


def _values(at: Evaluator, scene: Scene, of: Probe, time: Array, x: Array, v: Array) -> tuple[Array, ...]:
    """Outputs at states of the model."""
    record = record_states(at, time, x, v)
    quantities, _ = measure(at.system, record, {}, selected(at.system, needed(of, scene)))
    return histories(of, scene, Result(time, quantities))
