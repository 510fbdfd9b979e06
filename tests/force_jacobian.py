"""How the applied forces change with position and velocity, by differences of the compiled ones: to compare with."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ffr_dyn.compile.engine import Engine, load_at, new_engine
from ffr_dyn.compile.scene_tables import System
from ffr_dyn.equations.forces import gravity_forces
from ffr_dyn.functions.rotation import G_bar, rotation_matrix
from ffr_dyn.kernels.tables import OK
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError

STEP = 1e-4  # of a motion in m, rad or m sqrt(kg); divided by the largest shape for elastic coordinates
RATE_STEP = 1e-3


@dataclass(frozen=True)
class ForceJacobian:
    """Derivatives of the generalised forces (V,) of all applied loads and gravity, in body axes.

    forces   : (V,) the forces themselves
    position : (V, V) by small motions [A^T dR, turn about body axes, dq] of all bodies, at fixed velocities v
    velocity : (V, V) by velocities [A^T R_dot, omega_bar, q_dot]
    error    : (2,) largest difference that halving the steps made to an entry of either, before extrapolation
    """

    forces: Array
    position: Array
    velocity: Array
    error: Array


def applied_forces(system: System, t: float, x: Array, v: Array, engine: Engine | None = None) -> Array:
    """(V,) generalised forces of all applied loads and gravity at (t, x, v), in body axes.

    engine : carries the turns of angles that forces count; by default those of the start
    Raises ComputationError when a Python function of the scene fails.
    """
    engine = new_engine(system, x, v) if engine is None else engine
    if load_at(engine, t, x, v) != OK:
        raise ComputationError(f"the forces stopped in a Python function of the scene: {system.user.failure}")
    forces: Array = engine.work.bodies.f + gravity_forces(system.scene, system.layout, t, x)
    return forces


def force_jacobian(system: System, t: float, x: Array, v: Array) -> ForceJacobian:
    """Derivatives by central differences with two steps, h and h / 2, extrapolated (Richardson 1911): error of order h^4.

    A large `error` tells of a kink of the forces nearby: the edge of a stop, the end of a curve or a limit.
    """
    engine = new_engine(system, x, v)

    def moved(direction: Array, h: float) -> Array:
        return applied_forces(system, t, small_motion(system, x, h * direction), v, engine)

    def faster(direction: Array, h: float) -> Array:
        return applied_forces(system, t, x, v + h * to_global(system, x, direction), engine)

    steps = _steps(system)
    position, off = _derivative(moved, STEP * steps)
    velocity, rate_off = _derivative(faster, RATE_STEP * steps)
    return ForceJacobian(applied_forces(system, t, x, v, engine), position, velocity, np.array([off, rate_off]))


def _derivative(function: Callable[[Array, float], Array], steps: Array) -> tuple[Array, float]:
    """(V, V) derivative, column by column, and what halving the step changed at most."""
    columns, off = [], 0.0
    for direction, h in zip(np.eye(steps.size), steps, strict=True):
        coarse, fine = ((function(direction, s) - function(direction, -s)) / (2 * s) for s in (h, h / 2))
        columns.append((4 * fine - coarse) / 3)
        off = max(off, float(np.abs(fine - coarse).max()))
    return np.array(columns).T, off


def _steps(system: System) -> Array:
    """(V,) relative sizes of steps: elastic coordinates move their interfaces by about as much as rigid ones."""
    steps = np.ones(system.layout.v_size)
    for b, body in enumerate(system.scene.bodies):
        shapes = [np.abs(part).max(axis=0) for i in body.model.interfaces for part in (i.phi_t, i.phi_r)]
        if shapes and body.model.n:
            steps[system.layout.q_dot(b)] = 1 / np.maximum(np.max(shapes, axis=0), 1.0)
    return steps


def to_global(system: System, x: Array, y: Array) -> Array:
    """(V,) from body axes to those of v: R_dot parts global."""
    out, place = y.copy(), system.layout
    for b in range(len(place.n)):
        out[place.R_dot(b)] = rotation_matrix(x[place.p(b)]) @ y[place.R_dot(b)]
    return out


def small_motion(system: System, x: Array, step: Array) -> Array:
    """x moved by `step` (V,) in body axes, its rotation exact."""
    out, place = x.copy(), system.layout
    shift = to_global(system, x, step)
    for b in range(len(place.n)):
        p, half = x[place.p(b)], step[place.omega(b)] / 2
        angle = np.linalg.norm(half)
        out[place.R(b)] += shift[place.R_dot(b)]
        out[place.p(b)] = np.cos(angle) * p + np.sinc(angle / np.pi) * (G_bar(p).T @ half)
        out[place.q(b)] += step[place.q_dot(b)]
    return out
