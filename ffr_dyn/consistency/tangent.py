"""Small deviations from a state in minimal coordinates: charts of the constraints, their rates, and checked differences.

A deviation (y, z) (d,) each: with Z spanning the free motions (Phi_q Z = 0, Z^T M Z = 1) the positions are moved by Z y in
body axes, the velocities [A^T R_dot, omega_bar, q_dot] changed by Z z, and both brought back to the constraints in the
norm of the mass matrix. As the deviation is seen from axes that move with the bodies, a state of steady rotation has
constant coefficients. At rest the derivatives are exact (`ffr_dyn.equations.statics`); of a moving scene they are central
differences with steps h and h/2, extrapolated; their difference is the error.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ffr_dyn.compile.scene_tables import System
from ffr_dyn.consistency.evaluation import Evaluator, evaluate, free_motions, smallest_step, total_mass_matrix
from ffr_dyn.equations.inertia import kept_integrals
from ffr_dyn.equations.layout import moved, to_body_axes, to_global_axes
from ffr_dyn.equations.spinning import by_deflections
from ffr_dyn.equations.statics import balance, damping
from ffr_dyn.functions.differences import differences
from ffr_dyn.functions.rotation import rotation_matrix, skew
from ffr_dyn.scene.scene import length_of
from ffr_prep.common.arrays import Array

# Largest relative movement [rad, or part of the scene's size] of a difference: stiff bodies stretch with its square.
STEP = 1e-5
AT_REST = 1e-12  # of velocities [1/s], relative to the size of the scene
CORRECTIONS = 2  # onto the constraints, at a deviation of that size


@dataclass(frozen=True)
class Chart:
    """The neighbourhood of a state at a time [s].

    V : (V,) velocities in body axes;  Z : (V, d) free motions;  W : (V, d) = M Z, with W^T Z = 1
    steps : (d,) deviations of the size STEP
    all_rows : the same scene with its redundant rows, for reactions; None where it has none
    """

    at: Evaluator
    time: float
    x: Array
    V: Array
    M: Array
    Z: Array
    W: Array
    steps: Array
    all_rows: Evaluator | None = None


def chart(at: Evaluator, time: float, x: Array, v: Array) -> Chart:
    """The chart around a state (x, v) that meets the constraints. From there angles count their turns."""
    scene, place = at.system.scene, at.system.layout
    now = evaluate(at, time, x, v)
    at.work.loads.reference[:] = at.work.loads.measured
    M = total_mass_matrix(scene, place, x)
    Z = free_motions(now.jacobian, M)
    movement = np.abs(Z / sizes(at)[:, None]).max(axis=0, initial=0.0)
    return Chart(at, time, x, to_body_axes(place, x, v), M, Z, M @ Z, STEP / np.maximum(movement, 1e-300))


def state(near: Chart, y: Array, z: Array) -> tuple[Array, Array]:
    """(x, v) of a deviation, on the constraints."""
    at, place = near.at, near.at.system.layout
    x, V = moved(place, near.x, near.Z @ y), near.V + near.Z @ z
    for _ in range(CORRECTIONS):
        now = evaluate(at, near.time, x, to_global_axes(place, x, V))
        if now.Phi.size == 0:
            break
        x = moved(place, x, smallest_step(now.jacobian, near.M, -now.Phi))
        V = V + smallest_step(now.jacobian, near.M, -now.nu)
    return x, to_global_axes(place, x, V)


def rates(near: Chart, x: Array, v: Array) -> Array:
    """(2 d,) rates of (y, z) at a state nearby, less those of the motion of the axes."""
    place = near.at.system.layout
    now = evaluate(near.at, near.time, x, v)
    acceleration, V = now.acceleration.copy(), to_body_axes(place, x, v)
    position = V - near.V
    for b in range(len(place.n)):
        A0, A = rotation_matrix(near.x[place.p(b)]), rotation_matrix(x[place.p(b)])
        omega0, V0 = near.V[place.omega(b)], near.V[place.R_dot(b)]
        shift = A0.T @ (x[place.R(b)] - near.x[place.R(b)])
        relative = A0.T @ A
        turn = 0.5 * np.array([
            relative[2, 1] - relative[1, 2], relative[0, 2] - relative[2, 0], relative[1, 0] - relative[0, 1]
        ])  # fmt: skip
        position[place.R_dot(b)] = relative @ V[place.R_dot(b)] - V0 - np.cross(omega0, shift)
        position[place.omega(b)] = V[place.omega(b)] - omega0 - np.cross(omega0, turn)
        acceleration[place.R_dot(b)] -= np.cross(V[place.omega(b)], V[place.R_dot(b)])
    return np.concatenate([near.W.T @ position, near.W.T @ acceleration])


def derivative(function: Callable[[Array], Array], steps: Array) -> tuple[Array, float]:
    """d function / d deviation at zero (K, len(steps)), and its error: the last change by halving the steps, relative."""
    best, error = differences(function, steps, range(steps.size))
    scale = np.abs(best).max(initial=0.0)
    return best, float(error.max(initial=0.0) / (3 * scale)) if scale > 0 else 0.0


def at_rest(near: Chart) -> bool:
    """Whether nothing moves."""
    return bool(np.abs(near.V / sizes(near.at)).max(initial=0.0) < AT_REST)


def state_matrix(near: Chart) -> tuple[Array, float]:
    """A (2 d, 2 d) with d/dt (y, z) = A (y, z), and its error, relative: by differences, or of a scene at rest exactly."""
    d = near.steps.size
    if at_rest(near):
        K, D = matrices_at_rest(near)
        return np.block([[np.zeros((d, d)), np.eye(d)], [-near.Z.T @ K @ near.Z, -near.Z.T @ D @ near.Z]]), 0.0

    def at(deviation: Array) -> Array:
        return rates(near, *state(near, deviation[:d], deviation[d:]))

    return derivative(at, np.concatenate([near.steps, near.steps / _period(near)]))


def matrices_at_rest(near: Chart) -> tuple[Array, Array]:
    """(V, V) stiffness and damping: less the derivatives of forces - jacobian^T lam - M acceleration, in body axes."""
    system, time, x = near.at.system, near.time, near.x
    scene, place = system.scene, system.layout
    now = evaluate(near.at, time, x, np.zeros(place.v_size))
    K = balance(scene, place, system.blocks, time, x, now.lam, {}).stiffness
    left = near.M @ now.acceleration  # what is not balanced: it turns with the axes of the bodies, unlike in `balance`
    for b in range(len(place.n)):
        turn = place.omega(b)
        K[place.R_dot(b), turn] -= skew(left[place.R_dot(b)])
        K[turn, turn] -= 0.5 * skew(left[turn])
        at = slice(place.iv[b], place.iv[b] + 6 + place.n[b])
        K[at, place.q_dot(b)] += by_deflections(kept_integrals(scene.bodies[b]), x[place.q(b)], now.acceleration[at])
    return K, damping(scene, place, time, x)


def _period(near: Chart) -> float:
    """A time [s] to compare rates with: of the largest acceleration or spin at the state."""
    now = evaluate(near.at, near.time, near.x, to_global_axes(near.at.system.layout, near.x, near.V))
    size = sizes(near.at)
    rate = max(np.abs(near.V / size).max(initial=0.0), np.sqrt(np.abs(now.acceleration / size).max(initial=0.0)))
    return 1.0 / max(rate, 1.0)


def sizes(at: Evaluator) -> Array:
    """(V,) what counts as a movement of one, of a compiled scene with memory."""
    return sizes_of(at.system)


def sizes_of(system: System) -> Array:
    """(V,) what counts as a movement of one: a radian, the size of the scene; of an elastic coordinate, that over sqrt(m)."""
    place, length = system.layout, length_of(system.scene)
    sizes = np.ones(place.v_size)
    for b, body in enumerate(system.scene.bodies):
        sizes[place.R_dot(b)] = length
        sizes[place.q_dot(b)] = length * np.sqrt(body.model.mass)
    return sizes
