"""The contribution of each elastic coordinate to each output: a ranking, and a first guess of what a model needs."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ffr_dyn.compile.body_tables import of_coordinates
from ffr_dyn.consistency.evaluation import record_states
from ffr_dyn.economy.cache import Ledger
from ffr_dyn.economy.model_choice import Choice, bases_between
from ffr_dyn.economy.outputs import Probe, difference, histories, needed
from ffr_dyn.economy.policy import Policy
from ffr_dyn.economy.residual_estimate import Samples, driven, elastic_columns, followed, samples
from ffr_dyn.economy.run import Made, Trial, states
from ffr_dyn.equations.layout import Layout, moved, to_body_axes, to_global_axes
from ffr_dyn.kernels.tables import Record
from ffr_dyn.results.quantities import measure, selected
from ffr_dyn.results.recorded_motion import View
from ffr_dyn.results.result import Result
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.arrays import Array


@dataclass(frozen=True)
class Contributions:
    """Elastic directions of the whole scene and what they do.

    body      : (E,) of which body;  mode : (E,) the coordinate of that body, in the scene's own numbers, that leads it
    shape     : per direction (n,), in all elastic coordinates of its body
    amplitude : (E,) its largest one
    effect    : (E, outputs) largest change of an output when the direction is taken away, its joints kept closed
    """

    body: Array
    mode: Array
    shape: tuple[Array, ...]
    amplitude: Array
    effect: Array


@dataclass(frozen=True)
class Looked:
    """Directions D (V, c) among the velocities of a model, along a motion that it sees: Z (T, V, c) with what follows, and
    amplitudes and rates (T, c) of what is added to the motion."""

    seen: Samples
    D: Array
    Z: Array
    q: Array
    q_dot: Array


def nothing(of: Probe) -> Contributions:
    """No directions."""
    return Contributions(np.zeros(0, int), np.zeros(0, int), (), np.zeros(0), np.zeros((0, len(of.outputs))))


# ---- of a run's own coordinates ---------------------------------------------------------------------------------------


def own(ledger: Ledger, trial: Trial) -> Samples:
    """A run seen by its own model."""
    x, v = states(trial)
    rows, system = _spaced(len(x), ledger.policy), trial.made.assembled.system
    same = tuple(np.eye(n) for n in system.layout.n)
    ledger.looked(trial.choice, len(rows))
    return samples(trial.made.assembled, trial.made.assembled, same, trial.result.time[rows], x[rows], v[rows])


def of_motion(ledger: Ledger, pilot: Trial, limit: Array, seen: Samples) -> Contributions:
    """Contributions of the coordinates that a run has, from its own motion, `seen` as by `own`."""
    columns = elastic_columns(seen.system.layout)
    D = np.eye(seen.system.layout.v_size)[:, columns]
    looked = Looked(seen, D, followed(seen, D, ledger.policy), -seen.x[:, _positions(seen)], -seen.v[:, columns])
    return _contributions(ledger, looked, pilot.made, pilot.choice, limit)


def of_shapes(ledger: Ledger, pilot: Trial, limit: Array, seen: Samples) -> Contributions:
    """Contributions of the principal shapes of a run: of each body those that carry most of its strain energy over time.

    A few of them hold the quasi-static deflection that many modes share (proper orthogonal decomposition in the metric of
    the stiffness; Holmes, Lumley, Berkooz, Turbulence, Coherent Structures, Dynamical Systems and Symmetry (1996), ch. 3).
    """
    place, bodies = seen.system.layout, seen.system.model.bodies
    omega2 = of_coordinates(bodies, bodies.omega2)
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
    shapes = np.hstack(D)
    looked = Looked(seen, shapes, followed(seen, shapes, ledger.policy), -np.hstack(amplitude), -np.hstack(rate))
    return _contributions(ledger, looked, pilot.made, pilot.choice, limit)


# ---- of what a run lacks ----------------------------------------------------------------------------------------------


def of_omitted(ledger: Ledger, trial: Trial, everything: Choice, limit: Array) -> Contributions:
    """Contributions of what the full model has and a run lacks, driven one-way by its motion.

    Of a body in shapes, the part of each mode that its shapes do not hold.
    """
    x, v = states(trial)
    rows, large = _spaced(len(x), ledger.policy), ledger.made(everything)
    bases = bases_between(ledger.scene, trial.choice, everything)
    D, modes = _missing(large.assembled.system.layout, bases, everything, ledger.policy.remainder)
    if not modes:
        return nothing(ledger.of)
    small = trial.made.assembled
    seen = samples(small, large.assembled, bases, trial.result.time[rows], x[rows], v[rows])
    ledger.looked(trial.choice, len(rows))
    ledger.looked(everything, len(rows))
    Z = followed(seen, D, ledger.policy)
    found = _contributions(ledger, Looked(seen, D, Z, *driven(seen, D, Z)), large, everything, limit)
    return replace(found, mode=np.array(modes, int))


def _missing(place: Layout, bases: tuple[Array, ...], choice: Choice, remainder: float) -> tuple[Array, list[int]]:
    """(V, c) what each coordinate of a model has beyond the bases, and (c,) its number in the body."""
    found, modes = [], []
    for b, V in enumerate(bases):
        rest = np.eye(len(V)) - V @ V.T
        for k in np.flatnonzero(np.abs(rest).max(axis=0, initial=0.0) > remainder):
            direction = np.zeros(place.v_size)
            direction[place.q_dot(b)] = rest[:, k]
            found.append(direction)
            modes.append(choice.parts[b].modes[k])
    return np.array(found).reshape(-1, place.v_size).T, modes


# ---- effects on outputs -----------------------------------------------------------------------------------------------


def _spaced(rows: int, policy: Policy) -> Array:
    """Rows of a run at which its residuals are formed."""
    count = min(rows, max(policy.least_samples, rows // policy.rows_per_sample))
    return np.unique(np.linspace(0, rows - 1, count).round().astype(int))


def _positions(seen: Samples) -> Array:
    """Where the elastic coordinates are among the positions."""
    place = seen.system.layout
    return np.array([k for b in range(len(place.n)) for k in range(place.q(b).start, place.q(b).stop)], int)


def _contributions(ledger: Ledger, looked: Looked, large: Made, choice: Choice, limit: Array) -> Contributions:
    effect, evaluations = effects_of(
        large.scene, ledger.of, looked.seen, looked.Z, looked.q, looked.q_dot, limit, ledger.policy
    )
    ledger.looked(choice, evaluations)
    amplitude = np.abs(looked.q).max(axis=0, initial=0.0)
    return Contributions(*_named(choice, ledger.scene, looked.seen, looked.D), amplitude, effect)


def effects_of(
    scene: Scene, of: Probe, seen: Samples, Z: Array, q: Array, q_dot: Array, limit: Array, policy: Policy
) -> tuple[Array, int]:
    """(c, outputs) largest change of an output by the motion Z (T, V, c) with amplitudes and rates (T, c), and the number of
    evaluations. All directions are looked at where they are largest, and at more states those that matter there. A limited
    servo or a stop may be deaf to them in these states; so all are looked at, too, where together they do more."""
    plain = _outputs(seen, seen.record, scene, of)
    order = np.argsort(-np.abs(q), axis=0, kind="stable")[: policy.looks_at_effect]
    effect, columns = np.zeros((Z.shape[2], len(of.outputs))), np.arange(Z.shape[2])

    def changes(rows: Array, shift: Array, rates: Array) -> Array:
        values = _outputs(seen, _changed(seen, rows, shift, rates), scene, of)
        sizes = _change(of, values, tuple(one[rows] for one in plain))
        return np.array([np.abs(one).max(axis=1, initial=0.0) for one in sizes]).T

    def look(rows: Array, of_columns: Array) -> int:
        if rows.size:
            moves = (Z[rows, :, of_columns] * values[rows, of_columns][:, None] for values in (q, q_dot))
            np.maximum.at(effect, of_columns, changes(rows, *moves))
        return rows.size

    if not order.size:
        return effect, 0
    count = look(order[0], columns)
    more = np.flatnonzero((effect > policy.minor_effect * limit).any(axis=1))
    count += look(order[1:, more].T.ravel(), np.repeat(more, len(order) - 1))
    together = changes(np.arange(len(q)), *(np.einsum("tvc,tc->tv", Z, values) for values in (q, q_dot)))
    deaf = together.max(axis=0) > np.maximum(effect.sum(axis=0), policy.minor_effect * limit)
    rows = np.unique(together[:, deaf].argmax(axis=0))
    return effect, count + len(q) + look(np.repeat(rows, columns.size), np.tile(columns, rows.size))


def _changed(seen: Samples, rows: Array, shift: Array, rates: Array) -> Record:
    """The record of the model at the states of `rows`, each moved by a row of `shift` and `rates` (K, V)."""
    place = seen.system.layout
    x = np.array([moved(place, seen.x[k], step) for k, step in zip(rows, shift, strict=True)])
    v = np.array([
        to_global_axes(place, x[i], to_body_axes(place, seen.x[k], seen.v[k]) + rates[i]) for i, k in enumerate(rows)
    ])  # fmt: skip
    return record_states(seen.at, seen.time[rows], x, v)


def _outputs(seen: Samples, record: Record, scene: Scene, of: Probe) -> tuple[Array, ...]:
    """Per output (K, k) at recorded states, which follow one another in no order."""
    quantities, _ = measure(View(seen.system, record), {}, selected(seen.system, needed(of, seen.system)))
    return histories(of, scene, Result(np.arange(float(len(record.time))), quantities))


def _change(of: Probe, values: tuple[Array, ...], plain: tuple[Array, ...]) -> tuple[Array, ...]:
    """Differences of outputs; of angles, which have not been unwound, within half a turn."""
    turns = [name.endswith(".angle") for name in of.quantities]
    return tuple(
        np.remainder(d + np.pi, 2 * np.pi) - np.pi if turning else d
        for d, turning in zip(difference(values, plain), turns, strict=True)
    )


def _named(choice: Choice, original: Scene, seen: Samples, D: Array) -> tuple[Array, Array, tuple[Array, ...]]:
    """Of each direction the body, the leading coordinate by strain energy, and the shape in the body's own coordinates."""
    place, bodies, leading, shapes = seen.system.layout, [], [], []
    for direction in D.T:
        b = next(k for k in range(len(place.n)) if direction[place.q_dot(k)].any())
        model = original.bodies[b].model
        shape = choice.parts[b].basis(model.n) @ direction[place.q_dot(b)]
        bodies.append(b)
        leading.append(int(np.argmax(np.abs(shape) * np.sqrt(model.omega2))))
        shapes.append(shape)
    return np.array(bodies, int), np.array(leading, int), tuple(shapes)
