"""What becomes of small deviations over a period, from the derivatives of few of its steps.

The derivative of a period is the product of those of its steps. Along a periodic motion these vary smoothly and return, so a
few of them, evenly, tell all by trigonometric interpolation. Each is a difference: states pushed along every free motion are
brought onto the constraints and go one step. Deviations are told in the chart of the period's beginning all along.
(Trefethen, Spectral Methods in MATLAB 2000, ch. 3.)
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ffr_dyn.compile.engine import Engine, row_filler
from ffr_dyn.compile.workspace import new_record
from ffr_dyn.consistency.evaluation import evaluate, evaluated_mass_matrix, free_motions
from ffr_dyn.consistency.failure import failure
from ffr_dyn.functions.rotation import rotation_matrix
from ffr_dyn.kernels.tables import NEXT, OK, PER_ROW, Record
from ffr_dyn.linear.turn_map import Turns, engine_of
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError

SAMPLES = 25  # of the steps of a period, an odd number: twice the harmonics of the period that matter, and one
PUSH = 1e-6  # rad, or relative to the scene; rates the same in a period
ABRUPT = 1e-3  # of the highest harmonic of derivatives of steps, relative to their mean


def product_of_steps(of: Turns, record: Record) -> Array | None:
    """(2 d, 2 d) derivative of the map along the motion of a period, whose record has a multiple of SAMPLES rows, in units
    of the scale; None where the derivatives of steps do not vary smoothly, as with stops, or are not to be had."""
    stride = len(record.x) // SAMPLES
    begins = stride * np.arange(1, SAMPLES + 1) / len(record.x)  # of the steps, in periods
    x, v = record.x[stride - 1 :: stride], record.v[stride - 1 :: stride]
    try:
        first, second = (_deviations(of, *states) for states in _steps(of, begins, x, v))
        steps = np.linalg.solve(first, second).transpose(0, 2, 1)
    except (ComputationError, np.linalg.LinAlgError):
        return None
    harmonics = np.abs(np.fft.fft(steps - np.eye(of.scale.size), axis=0)).max(axis=(1, 2), initial=0.0)
    if harmonics[SAMPLES // 2] > ABRUPT * harmonics[0]:
        return None
    found = np.eye(of.scale.size)
    # A few at a time: for many BLAS wakes its threads.
    for at in np.array_split(np.arange(of.steps) / of.steps, of.rows):
        for step in np.tensordot(_trigonometric(at, begins), steps, axes=1):
            found = step @ found
    return found


def periods_of_product(of: Turns) -> float:
    """What it costs."""
    return SAMPLES * 2 * of.scale.size / of.steps


def _steps(of: Turns, begins: Array, x: Array, v: Array) -> Iterator[tuple[Array, Array]]:
    """Positions (S, 4 d, X) and velocities (S, 4 d, V) where the steps from states (S, X), (S, V), pushed, begin and end."""
    xs, vs = _pushed(of, begins, x, v)
    ended = np.empty_like(xs), np.empty_like(vs)
    engine, rows, start = engine_of(of, x[0], v[0]), new_record(of.system, 1), of.near.time
    fill, clock, d = row_filler(engine, rows), engine.tables.clock.steps, of.near.steps.size
    numbers = np.rint(begins * of.steps).astype(int)
    for s, k in np.ndindex(xs.shape[:2]):
        clock[NEXT] = numbers[s]
        engine.x[:], engine.v[:] = xs[s, k], vs[s, k]
        if k // d % 2 == 0:  # positions were moved, and are to meet the constraints before the step
            clock[PER_ROW] = 0
            _checked(of, engine, fill(start))
            xs[s, k], vs[s, k] = engine.x, engine.v
        clock[PER_ROW] = 1
        _checked(of, engine, fill(start))
        ended[0][s, k], ended[1][s, k] = engine.x, engine.v
    yield xs, vs
    yield ended


def _checked(of: Turns, engine: Engine, status: int) -> None:
    if status != OK:
        raise failure(of.system, engine.work, status, of.near.time)


def _pushed(of: Turns, begins: Array, x: Array, v: Array) -> tuple[Array, Array]:
    """What the free motions at states (S, X), (S, V) make of them: of positions, of velocities; and then backwards.

    `ffr_dyn.equations.layout.moved` of many states at once."""
    place, at, d = of.system.layout, of.near.at, of.near.steps.size
    motions = np.empty((len(x), d, place.v_size))
    for s, begin in enumerate(begins):
        jacobian = evaluate(at, of.near.time + begin * of.period, x[s], v[s]).jacobian
        motions[s] = free_motions(jacobian, evaluated_mass_matrix(at)).T
    motions *= PUSH / np.abs(motions / of.sizes).max(axis=2, keepdims=True)
    still = np.zeros_like(motions)
    y = np.concatenate([motions, still, -motions, still], axis=1)
    z = np.concatenate([still, motions, still, -motions], axis=1) / of.period
    xs, vs = (np.repeat(states[:, None], 4 * d, axis=1) for states in (x, v))
    for b in range(len(place.n)):
        p, half = xs[..., place.p(b)], y[..., place.omega(b)] / 2
        A = rotation_matrix(p)
        xs[..., place.R(b)] += _turned(A, y[..., place.R_dot(b)])
        xs[..., place.p(b)] = _turned(_turns_after(p), np.insert(half, 0, 1.0, axis=-1))
        xs[..., place.p(b)] /= np.linalg.norm(xs[..., place.p(b)], axis=-1, keepdims=True)
        xs[..., place.q(b)] += y[..., place.q_dot(b)]
        # Velocities of bodies are pushed in their own axes, which turn with them.
        own = _turned(np.swapaxes(A, -1, -2), vs[..., place.R_dot(b)]) + z[..., place.R_dot(b)]
        vs[..., place.R_dot(b)] = _turned(rotation_matrix(xs[..., place.p(b)]), own)
        vs[..., place.omega(b)] += z[..., place.omega(b)]
        vs[..., place.q_dot(b)] += z[..., place.q_dot(b)]
    return xs, vs


def _deviations(of: Turns, xs: Array, vs: Array) -> Array:
    """(S, 2 d, 2 d) between states pushed forth and back (S, 4 d, ...), in units of the scale."""
    place, (x, x_back), (v, v_back) = of.system.layout, np.split(xs, 2, axis=1), np.split(vs, 2, axis=1)
    y, z = v - v_back, v - v_back
    for b in range(len(place.n)):
        p, p_back = x[..., place.p(b)], x_back[..., place.p(b)]
        relative = _turned(np.swapaxes(_turns_after(p_back), -1, -2), p)
        y[..., place.omega(b)] = 2 * relative[..., 1:] * np.sign(relative[..., :1])
        back, own = (np.swapaxes(rotation_matrix(each), -1, -2) for each in (p_back, p))
        y[..., place.R_dot(b)] = _turned(back, x[..., place.R(b)] - x_back[..., place.R(b)])
        y[..., place.q_dot(b)] = x[..., place.q(b)] - x_back[..., place.q(b)]
        z[..., place.R_dot(b)] = _turned(own, v[..., place.R_dot(b)]) - _turned(back, v_back[..., place.R_dot(b)])
    found: Array = np.concatenate([y @ of.near.W, z @ of.near.W], axis=2) / of.scale
    return found


def _turned(A: Array, vectors: Array) -> Array:
    """(..., M) matrices (..., M, N) with vectors (..., N)."""
    found: Array = (A @ vectors[..., None])[..., 0]
    return found


def _turns_after(p: Array) -> Array:
    """(..., 4) Euler parameters -> (..., 4, 4) orthogonal L: L(p) r is the turn p after r."""
    a, b, c, d = np.moveaxis(p, -1, 0)
    rows = np.array([[a, -b, -c, -d], [b, a, -d, c], [c, d, a, -b], [d, -c, b, a]])
    return np.moveaxis(rows, (0, 1), (-2, -1))


def _trigonometric(at: Array, phases: Array) -> Array:
    """(A, S) weights of values at even phases (S,), an odd number, in the interpolation at phases (A,) [periods]."""
    apart = np.pi * (at[:, None] - phases)
    sine = np.sin(apart)
    there = np.abs(sine) < 1e-12
    weights: Array = np.where(there, 1.0, np.sin(phases.size * apart) / (phases.size * np.where(there, 1.0, sine)))
    return weights
