"""Omitted modes and terms driven one-way by a computed motion.

Along a run of a smaller model, lifted into a larger one with the omitted coordinates at zero, the larger model's equations
leave the residual

    r = f - M a - Phi_q^T lambda        with accelerations a and multipliers lambda of the run,

zero where nothing is missing. It drives each omitted coordinate j as a passive oscillator. The frame and the joints follow
its vibration: with Z_j the motion of all rigid coordinates that keeps the constraints and has the least kinetic energy for a
unit of q_j,

    m_j q_j'' + 2 zeta_j Omega_j q_j' + Omega_j^2 q_j = Z_j^T r,        m_j = Z_j^T M Z_j.

So the estimate does not depend on the reference conditions: a mode of a fixed frame, which takes the frame along, gets the
frequency of the body that is free. Integrated by the exact
solution for a force that is linear between samples (Nigam and Jennings, Bull. Seism. Soc. Am. 59 (1969), 909).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from ffr_dyn.compile.body_tables import of_coordinates
from ffr_dyn.compile.scene_tables import System
from ffr_dyn.consistency.assemble import Assembled
from ffr_dyn.consistency.evaluation import (
    Evaluator,
    copied,
    evaluate,
    evaluated_mass_matrix,
    evaluator,
    joined,
    locked,
    unit_rows,
)
from ffr_dyn.consistency.second_order_loads import loads_that_act, second_order_forces
from ffr_dyn.economy.policy import DEFAULT, Policy
from ffr_dyn.equations.inertia import damping_matrix
from ffr_dyn.equations.layout import Layout
from ffr_dyn.kernels.tables import Record
from ffr_prep.common.arrays import Array


@dataclass(frozen=True)
class Samples:
    """A motion seen by a model, T rows.

    at         : the model with the memory of one evaluation;  record : what it records there
    time (T,), x (T, X), v (T, V) : the motion, lifted into the model;  acceleration : (T, V) of the motion
    M          : (T, V, V) mass;  jacobian : (T, C, V);  residual : (T, V) r of the motion
    stiffening : (T, V, L) elastic force of every load by its second-order matrix;  loads : (L,) body and number of each
    """

    at: Evaluator
    time: Array
    x: Array
    v: Array
    M: Array
    jacobian: Array
    residual: Array
    acceleration: Array
    record: Record
    stiffening: Array
    loads: tuple[tuple[int, int], ...]

    @property
    def system(self) -> System:
        """The model."""
        return self.at.system


def elastic_columns(place: Layout) -> Array:
    """(E,) numbers of all elastic coordinates among the velocities."""
    return np.array([k for b in range(len(place.n)) for k in range(place.q_dot(b).start, place.q_dot(b).stop)], int)


def lift(small: Layout, large: Layout, bases: tuple[Array, ...], x: Array, v: Array) -> tuple[Array, Array]:
    """States (T, .) of a model with the coordinates p of each body, q = V p, in a model with all q; `bases` are the V."""
    X, W = np.zeros((len(x), large.x_size)), np.zeros((len(v), large.v_size))
    for b, V in enumerate(bases):
        X[:, large.R(b)], X[:, large.p(b)] = x[:, small.R(b)], x[:, small.p(b)]
        W[:, large.R_dot(b)], W[:, large.omega(b)] = v[:, small.R_dot(b)], v[:, small.omega(b)]
        X[:, large.q(b)], W[:, large.q_dot(b)] = x[:, small.q(b)] @ V.T, v[:, small.q_dot(b)] @ V.T
    return X, W


def _map(small: Layout, large: Layout, bases: tuple[Array, ...]) -> Array:
    """(V large, V small) velocities of the large model from those of the small one, body axes."""
    L = np.zeros((large.v_size, small.v_size))
    for b, V in enumerate(bases):
        L[large.rigid(b), small.rigid(b)] = np.eye(6)
        L[large.q_dot(b), small.q_dot(b)] = V
    return L


def _rows(small: System, large: System) -> list[tuple[int, int]]:
    """Pairs of rows (small, large) that say the same."""
    listed = [[(block.name, k) for block in s.blocks for k in _texts(block)] for s in (small, large)]
    where = {key: row for row, key in enumerate(listed[1])}
    return [(row, where[key]) for row, key in enumerate(listed[0]) if key in where]


def _texts(block: object) -> list[str]:
    return [word.text for word in block.words]  # type: ignore[attr-defined]


def samples(small: Assembled, large: Assembled, bases: tuple[Array, ...], time: Array, x: Array, v: Array) -> Samples:
    """The motion x (T, .), v (T, .) of the small model, seen by the large one; `bases` as in `lift`."""
    X, W = lift(small.system.layout, large.system.layout, bases, x, v)
    to_large, rows = _map(small.system.layout, large.system.layout, bases), _rows(small.system, large.system)
    seen = evaluator(large.system)
    at = seen if small is large else evaluator(small.system)
    loads = loads_that_act(large.system.scene)
    M, J, r, acc, records, stiffening = [], [], [], [], [], []
    for k, t in enumerate(time):
        own = evaluate(at, float(t), x[k], v[k])
        now = own if at is seen else evaluate(seen, float(t), X[k], W[k])
        mass, lam = evaluated_mass_matrix(seen), np.zeros(len(now.Phi))
        lam[[pair[1] for pair in rows]] = own.lam[[pair[0] for pair in rows]]
        acc.append(to_large @ own.acceleration)
        M.append(mass)
        J.append(now.jacobian)
        r.append(now.force - mass @ acc[-1] - now.jacobian.T @ lam)
        records.append(copied(seen.record))
        stiffening.append(second_order_forces(seen, float(t), X[k], W[k], loads))
    return Samples(
        seen,
        time,
        X,
        W,
        np.array(M),
        np.array(J),
        np.array(r),
        np.array(acc),
        joined(records),
        np.array(stiffening),
        loads,
    )


# ---- passive oscillators ----------------------------------------------------------------------------------------------


def followed(seen: Samples, D: Array, policy: Policy = DEFAULT) -> Array:
    """(T, V, c) Z: elastic directions D (V, c), among the velocities, with the motion of rigid coordinates that follows."""
    place = seen.system.layout
    rigid = np.array([k for b in range(len(place.n)) for k in range(place.rigid(b).start, place.rigid(b).stop)], int)
    held = unit_rows(np.flatnonzero(np.isin(rigid, locked(place))), rigid.size)
    M = seen.M[:, rigid[:, None], rigid]
    J = seen.jacobian[:, :, rigid]
    J = np.concatenate([J, np.broadcast_to(held, (len(M), *held.shape))], axis=1)
    J_D = np.concatenate([seen.jacobian @ D, np.zeros((len(M), len(held), D.shape[1]))], axis=1)
    softness = np.einsum("tcr,tcr,tr->tc", J, J, 1 / np.einsum("tii->ti", M))  # J M^-1 J^T, its diagonal
    weight = np.where(softness > 1e-200, policy.constraint_weight / np.maximum(softness, 1e-200), 0.0)
    left = M + np.einsum("tcr,tc,tcs->trs", J, weight, J, optimize=True)
    right = -(seen.M[:, rigid] @ D + np.einsum("tcr,tc,tce->tre", J, weight, J_D, optimize=True))
    Z = np.broadcast_to(D, (len(M), *D.shape)).copy()
    Z[:, rigid] = np.linalg.solve(left, right)
    return Z


def driven(
    seen: Samples, D: Array, Z: Array, q: Array | None = None, q_dot: Array | None = None
) -> tuple[Array, Array]:
    """(T, c) amplitudes and rates of the directions D (V, c), driven by the residual as passive oscillators.

    q, q_dot : (c,) at the start; rest by default
    """
    return oscillators(seen.time, *_oscillators(seen, D, Z, seen.residual[:, :, None]), q, q_dot)


def responses(seen: Samples, D: Array, Z: Array, forces: Array) -> Array:
    """(T, c, K) amplitudes of the directions D (V, c), driven by each of some forces (T, V, K) from rest."""
    force, omega2, damping = _oscillators(seen, D, Z, forces)
    count = forces.shape[2]
    q, _ = oscillators(seen.time, force, np.repeat(omega2, count), np.repeat(damping, count))
    return q.reshape(len(q), D.shape[1], count)


def _oscillators(seen: Samples, D: Array, Z: Array, forces: Array) -> tuple[Array, Array, Array]:
    """Force per mass (T, c K), square of the frequency (c,), and damping (c,) of directions under forces (T, V, K)."""
    bodies, elastic = seen.system.model.bodies, elastic_columns(seen.system.layout)
    own = D[elastic] ** 2
    mass = np.maximum(np.einsum("tvc,tvw,twc->tc", Z, seen.M, Z, optimize=True).mean(axis=0), 1e-9)
    force = np.einsum("tvc,tvk->tck", Z, forces, optimize=True) / mass[:, None]
    omega2 = of_coordinates(bodies, bodies.omega2)
    damping = np.concatenate([np.diag(damping_matrix(b.model, b.damping)) for b in seen.system.scene.bodies])
    return force.reshape(len(Z), -1), omega2 @ own / mass, damping @ own / mass


def oscillators(
    time: Array,
    force: Array,
    omega2: Array,
    damping: Array,
    start: Array | None = None,
    start_rate: Array | None = None,
) -> tuple[Array, Array]:
    """(T, c) q and q_dot with q'' + damping q' + omega2 q = force (T, c); exact for a force linear in between."""
    h = np.diff(time)
    steps, which = np.unique(np.round(h, 15), return_inverse=True)
    kinds, kind = np.unique(np.array([omega2, damping]), axis=1, return_inverse=True)
    updates = [[values[kind] for values in _update(float(step), *kinds)] for step in steps]
    q, rate = np.zeros_like(force), np.zeros_like(force)
    q[0] = 0.0 if start is None else start
    rate[0] = 0.0 if start_rate is None else start_rate
    for k in range(h.size):
        a11, a12, a21, a22, b1, b2, c1, c2 = updates[which[k]]
        q[k + 1] = a11 * q[k] + a12 * rate[k] + b1 * force[k] + c1 * force[k + 1]
        rate[k + 1] = a21 * q[k] + a22 * rate[k] + b2 * force[k] + c2 * force[k + 1]
    return q, rate


def _update(h: float, omega2: Array, damping: Array) -> tuple[Array, ...]:
    """Coefficients of the exact step for each oscillator, from the exponential of the 4 x 4 system with a linear force."""
    A = np.zeros((omega2.size, 4, 4))  # of the states q, q' h, force, its change over the step; time in units of h
    A[:, 0, 1], A[:, 2, 3], A[:, 1, 2] = 1.0, 1.0, h * h
    A[:, 1, 0], A[:, 1, 1] = -omega2 * h * h, -damping * h
    E = expm(A)
    return (
        E[:, 0, 0],
        E[:, 0, 1] * h,
        E[:, 1, 0] / h,
        E[:, 1, 1],
        E[:, 0, 2] - E[:, 0, 3],
        (E[:, 1, 2] - E[:, 1, 3]) / h,
        E[:, 0, 3],
        E[:, 1, 3] / h,
    )
