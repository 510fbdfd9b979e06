"""Vibrations that a step does not resolve: how long they last, which they are.

By the eigenvalues of the scene at the start, coupled by its joints.
"""

from __future__ import annotations

import numpy as np

from ffr_dyn.consistency.assemble import Assembled
from ffr_dyn.consistency.evaluation import evaluator
from ffr_dyn.consistency.tangent import Chart, chart, state_matrix
from ffr_dyn.results.result import Result
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError

UNRESOLVED = 2.0  # h omega
MANY = 200  # free motions, beyond which the eigenvalues are not asked for


def lasting(assembled: Assembled, time: float, step: float) -> float:
    """exp(-zeta h omega) of the slowest vibration that steps of h [s] do not resolve: what is left of it after a step by the
    scene's own damping. 1 where there is none, or no damping, or the scene is large."""
    if not any(body.damping.any() for body in assembled.system.scene.bodies if body.model.n):
        return 1.0
    found = _eigenvalues(assembled, time)
    beyond = found[np.abs(found) * step > UNRESOLVED]
    if not beyond.size:
        return 1.0
    ratio = float(np.clip(-beyond.real / np.abs(beyond), 0.0, 1.0).min())
    return float(np.exp(-ratio * step * np.abs(beyond).min()))


def fastest(assembled: Assembled, time: float) -> tuple[float, bool]:
    """[rad/s] of the fastest vibration, 0 where there is none or the scene is large; whether it is damped."""
    found = _eigenvalues(assembled, time)
    if not found.size:
        return 0.0, False
    one = found[int(np.argmax(np.abs(found)))]
    return float(np.abs(one)), bool(-one.real > 1e-3 * np.abs(one))


def vibration(assembled: Assembled, time: float, run: Result, twin: Result) -> float:
    """[rad/s] of the vibration in which two runs differ most, by its velocity; 0 where that cannot be told.

    run, twin : with the elastic coordinates of all bodies
    """
    near = _near(assembled, time)
    if near is None:
        return 0.0
    A, _ = state_matrix(near)
    values, vectors = np.linalg.eig(A)
    up = values.imag > UNRESOLVED
    if not up.any():
        return 0.0
    shapes, differences = _elastic(assembled, near.Z @ vectors[: near.steps.size, up], run, twin)
    real = np.concatenate([shapes.real, shapes.imag], axis=1)
    amounts = np.linalg.lstsq(real, differences.T, rcond=None)[0]
    count = int(up.sum())
    size = np.hypot(amounts[:count], amounts[count:]).max(axis=1) * np.abs(shapes).max(axis=0)
    omega = np.abs(values[up])
    return float(omega[int(np.argmax(omega * size))])


def _elastic(assembled: Assembled, motions: Array, run: Result, twin: Result) -> tuple[Array, Array]:
    """(n, modes) motions in the elastic coordinates of results, and (T, n) what two results differ by in them."""
    place, bodies = assembled.system.layout, assembled.system.scene.bodies
    shapes, differences = [], []
    for b, body in enumerate(bodies):
        if place.n[b]:
            own = motions[place.q_dot(b)]
            off = run[f"{body.name}.q"] - twin[f"{body.name}.q"]
            if body.frame:
                own = body.frame.C @ own
            elif body.kept:
                off = off[:, list(body.kept[0])]
            shapes.append(own)
            differences.append(off)
    return np.concatenate(shapes), np.concatenate(differences, axis=1)


def _eigenvalues(assembled: Assembled, time: float) -> Array:
    """(k,) complex, one of each pair."""
    near = _near(assembled, time)
    if near is None:
        return np.zeros(0, complex)
    A, _ = state_matrix(near)
    values: Array = np.linalg.eigvals(A)
    return values[values.imag > 0]


def _near(assembled: Assembled, time: float) -> Chart | None:
    """None where the scene has too many free motions, or the state has no eigenvalues."""
    system = assembled.system
    if system.layout.v_size > 4 * MANY:
        return None
    try:
        near = chart(evaluator(system), time, assembled.x, assembled.v)
    except (ComputationError, np.linalg.LinAlgError):
        return None
    return near if near.steps.size and near.steps.size <= MANY else None
