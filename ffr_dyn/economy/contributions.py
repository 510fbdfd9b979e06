"""What each elastic coordinate of a motion does to each output: a ranking, and a first guess of what a model needs."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ffr_dyn.analyses.assemble import assemble
from ffr_dyn.analyses.evaluation import Evaluator, evaluator, moved, record_states, to_body_axes, to_global_axes
from ffr_dyn.economy.choice import Choice
from ffr_dyn.economy.drive import Samples, driven, elastic_columns, followed, samples
from ffr_dyn.economy.outputs import Probe, histories, needed
from ffr_dyn.economy.trial import Trial, states
from ffr_dyn.measure import measure, selected
from ffr_dyn.result import Result
from ffr_dyn.scene import Scene

Array = np.ndarray

SEEN = 100  # states along the run at which residuals are formed
LEFT = 1e-6  # of a mode: a smaller rest is rounding
LOOKED = 4  # states at which the effect of a coordinate on the outputs is looked at: where it is largest


@dataclass(frozen=True)
class Contributions:
    """Elastic directions of the whole scene and what they do.

    body   : (E,) of which body;  mode : (E,) the coordinate of that body, in the scene's own numbers, that leads it
    shape  : per direction (n,), in all elastic coordinates of its body
    effect : (E, outputs) largest change of an output when the direction is taken away, its joints kept closed
    """

    body: Array
    mode: Array
    shape: tuple[Array, ...]
    effect: Array


def nothing(of: Probe) -> Contributions:
    """No directions."""
    return Contributions(np.zeros(0, int), np.zeros(0, int), (), np.zeros((0, len(of.outputs))))


def of_motion(pilot: Trial, of: Probe, original: Scene) -> Contributions:
    """Contributions of the coordinates that a run has, from its own motion."""
    seen = _own(pilot)
    columns = elastic_columns(seen.system.layout)
    D = np.eye(seen.system.layout.v_size)[:, columns]
    return _effects(pilot, original, of, seen, D, seen.x[:, _positions(seen)], seen.v[:, columns], -1.0)


def of_shapes(pilot: Trial, of: Probe, original: Scene) -> Contributions:
    """Contributions of the principal shapes of a run: of each body those that carry most of its strain energy over time.

    A few of them hold the quasi-static deflection that many modes share (proper orthogonal decomposition in the metric of
    the stiffness; Holmes, Lumley, Berkooz, Turbulence, Coherent Structures, Dynamical Systems and Symmetry (1996), ch. 3).
    """
    seen = _own(pilot)
    place, omega2 = seen.system.layout, seen.system.model.bodies.omega2
    columns, at = elastic_columns(place), _positions(seen)
    q, q_dot, whole = seen.x[:, at], seen.v[:, columns], pilot.result
    D, amplitude, rate = [], [], []
    for b, body in enumerate(seen.system.scene.bodies):
        here = np.isin(columns, np.arange(place.q_dot(b).start, place.q_dot(b).stop))
        if not here.any():
            continue
        kept = list(body.kept[0]) if body.kept else slice(None)
        stiffness = np.sqrt(omega2[here])
        left, values, _ = np.linalg.svd((whole[f"{body.name}.q"][:, kept] * stiffness).T, full_matrices=False)
        left = left[:, values > 1e-12 * max(float(values.max(initial=0.0)), 1e-300)]
        directions = np.zeros((place.v_size, left.shape[1]))
        directions[place.q_dot(b)] = left / stiffness[:, None]
        D.append(directions)
        amplitude.append((q[:, here] * stiffness) @ left)
        rate.append((q_dot[:, here] * stiffness) @ left)
    return _effects(pilot, original, of, seen, np.hstack(D), np.hstack(amplitude), np.hstack(rate), -1.0)


def of_omitted(trial: Trial, large: Trial, of: Probe, original: Scene) -> Contributions:
    """Contributions of the modes that `trial` lacks and `large` has, driven one-way by the motion of `trial`.

    Of a body in shapes, the part of each mode that its shapes do not hold.
    """
    small, x, v = states(trial)
    big = assemble(large.scene, time=float(large.result.time[0]))
    rows = _spaced(len(x))
    bases = tuple(
        many.basis(body.model.n).T @ few.basis(body.model.n)
        for body, few, many in zip(original.bodies, trial.choice.parts, large.choice.parts, strict=True)
    )
    seen = samples(small, big, bases, trial.result.time[rows], x[rows], v[rows])
    D, modes = _missing(seen, bases, large.choice)
    if not modes:
        return nothing(of)
    q, q_dot = driven(seen, D, followed(seen, D))
    return replace(_effects(large, original, of, seen, D, q, q_dot, 1.0), mode=np.array(modes, int))


def _missing(seen: Samples, bases: tuple[Array, ...], choice: Choice) -> tuple[Array, list[int]]:
    """(V, c) what each coordinate of a model has beyond the bases, and (c,) its number in the body."""
    place, found, modes = seen.system.layout, [], []
    for b, V in enumerate(bases):
        rest = np.eye(len(V)) - V @ V.T
        for k in np.flatnonzero(np.abs(rest).max(axis=0, initial=0.0) > LEFT):
            direction = np.zeros(place.v_size)
            direction[place.q_dot(b)] = rest[:, k]
            found.append(direction)
            modes.append(choice.parts[b].modes[k])
    return np.array(found).reshape(-1, place.v_size).T, modes


def _own(trial: Trial) -> Samples:
    """A run seen by its own model."""
    assembled, x, v = states(trial)
    rows = _spaced(len(x))
    same = tuple(np.eye(n) for n in assembled.system.layout.n)
    return samples(assembled, assembled, same, trial.result.time[rows], x[rows], v[rows])


def _spaced(rows: int) -> Array:
    return np.unique(np.linspace(0, rows - 1, min(rows, SEEN)).round().astype(int))


def _positions(seen: Samples) -> Array:
    """Where the elastic coordinates are among the positions."""
    place = seen.system.layout
    return np.array([k for b in range(len(place.n)) for k in range(place.q(b).start, place.q(b).stop)], int)


def _effects(
    large: Trial, original: Scene, of: Probe, seen: Samples, D: Array, q: Array, q_dot: Array, sign: float
) -> Contributions:
    effect = effects_of(large, of, seen, followed(seen, D), sign * q, sign * q_dot)
    return Contributions(*_named(large, original, seen, D), effect)


def effects_of(large: Trial, of: Probe, seen: Samples, Z: Array, q: Array, q_dot: Array) -> Array:
    """(c, outputs) largest change of an output by the motion Z (T, V, c) with amplitudes and rates (T, c)."""
    place, at = seen.system.layout, evaluator(seen.system)
    effect = np.zeros((Z.shape[2], len(of.outputs)))
    for c in range(Z.shape[2]):
        rows = np.sort(np.argsort(-np.abs(q[:, c]), kind="stable")[:LOOKED])
        plain = _values(at, large.scene, of, seen.time[rows], seen.x[rows], seen.v[rows])
        steps, rates = (Z[rows, :, c] * values[rows, c][:, None] for values in (q, q_dot))
        x = np.array([moved(place, seen.x[k], step) for k, step in zip(rows, steps, strict=True)])
        v = np.array([
            to_global_axes(place, x[i], to_body_axes(place, seen.x[k], seen.v[k]) + rates[i])
            for i, k in enumerate(rows)
        ])  # fmt: skip
        changed = _values(at, large.scene, of, seen.time[rows], x, v)
        effect[c] = [np.abs(a - b).max(initial=0.0) for a, b in zip(changed, plain, strict=True)]
    return effect


def _named(large: Trial, original: Scene, seen: Samples, D: Array) -> tuple[Array, Array, tuple[Array, ...]]:
    """Of each direction the body, the leading coordinate by strain energy, and the shape in the body's own coordinates."""
    place, bodies, leading, shapes = seen.system.layout, [], [], []
    for direction in D.T:
        b = next(k for k in range(len(place.n)) if direction[place.q_dot(k)].any())
        model = original.bodies[b].model
        shape = large.choice.parts[b].basis(model.n) @ direction[place.q_dot(b)]
        bodies.append(b)
        leading.append(int(np.argmax(np.abs(shape) * np.sqrt(model.omega2))))
        shapes.append(shape)
    return np.array(bodies, int), np.array(leading, int), tuple(shapes)


def _values(at: Evaluator, scene: Scene, of: Probe, time: Array, x: Array, v: Array) -> tuple[Array, ...]:
    """Outputs at states of the model."""
    record = record_states(at, time, x, v)
    quantities, _ = measure(at.system, record, {}, selected(at.system, needed(of, scene)))
    return histories(of, scene, Result(time, quantities))
