"""The equations of motion of a scene, as on paper.

Positions x = [R, p, q] and velocities v = [R_dot, omega_bar, q_dot] of body after body; accelerations v_dot and forces in
body axes, [a = A^T R_ddot, omega_bar_dot, q_ddot] and [A^T F, M, Q]:

    x_dot = T(x) v                                                      kinematics
    Phi(x, t) = 0,  nu = Phi_q v + Phi_t,  Phi_q v_dot = gamma          joints, couplings, drivers

    | M  J^T | | v_dot |   |   Q   |
    | J   0  | |  lam  | = | gamma |        J = Phi_q

Bodies with a second-order part are in their mean-axis form (`ffr_dyn.equations.second_order`). The compiled form, which the
tests hold equal to this one, is `ffr_dyn.kernels.entry_points` with what it calls.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ffr_dyn.equations.constraint_rows import Block, Instant, blocks_of, rows_at
from ffr_dyn.equations.constraints import Row
from ffr_dyn.equations.forces import applied, gravity_at
from ffr_dyn.equations.inertia import (
    elastic_force,
    gravity_force,
    kept_integrals,
    mass_matrix,
    quadratic_velocity,
)
from ffr_dyn.equations.layout import Layout, layout
from ffr_dyn.functions.rotation import G_bar, rotation_matrix
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.arrays import Array


@dataclass(frozen=True)
class EquationsOfMotion:
    """The equations at one moment and their solution.

    M : (V, V);  Q : (V,) all forces but those of the constraints
    rows : Phi, nu, gamma and Jacobian of each constraint row;  jacobian : (C, V) of all
    acceleration : (V,) [a, omega_bar_dot, q_ddot];  lam : (C,)
    """

    M: Array
    Q: Array
    rows: tuple[Row, ...]
    jacobian: Array
    acceleration: Array
    lam: Array


def position_rates(place: Layout, x: Array, v: Array) -> Array:
    """x_dot = T(x) v, with p_dot = G_bar(p)^T omega_bar / 2 of Euler parameters. Equation (2) of docs/notation.md."""
    out = np.empty(place.x_size)
    for b in range(len(place.n)):
        out[place.R(b)], out[place.q(b)] = v[place.R_dot(b)], v[place.q_dot(b)]
        out[place.p(b)] = 0.5 * G_bar(x[place.p(b)]).T @ v[place.omega(b)]
    return out


def equations_of_motion(
    scene: Scene, t: float, x: Array, v: Array, blocks: tuple[Block, ...] | None = None
) -> EquationsOfMotion:
    """The equations of a scene at the time t [s] and the state x (X,), v (V,); of the rows of `blocks`, by default all.

    Equation (27) of docs/notation.md.
    """
    now = Instant(scene, layout(scene), tuple(blocks_of(scene)) if blocks is None else blocks, t, x, v)
    M, Q = _inertia_and_forces(now)
    rows = tuple(rows_at(scene, now.place, list(now.blocks), x, v, t))
    J, gamma = np.array([row.jacobian for row in rows]).reshape(-1, Q.size), np.array([row.gamma for row in rows])
    owners = np.repeat(np.arange(len(now.blocks)), [len(block.words) for block in now.blocks])
    v_dot, lam = solve(now.place, M, J, Q, gamma, owners)
    return EquationsOfMotion(M, Q, rows, J, v_dot, lam)


def solve(place: Layout, M: Array, J: Array, Q: Array, gamma: Array, owners: Array) -> tuple[Array, Array]:
    """v_dot (V,) and lam (C,) of M v_dot + J^T lam = Q, J v_dot = gamma.

    owners : (C,) numbers of the joints that the rows belong to

    Equation (28) of docs/notation.md.

    In the plane, coordinates across it stay zero. Where rows depend on one another the smallest multipliers are taken, those
    of a joint times the root of what its rows yield to them, J M^-1 J^T.
    """
    moving = [place.iv[b] + c for b, n in enumerate(place.n) for c in (*place.active(b), *range(6, 6 + n))]
    M, J = M[np.ix_(moving, moving)], J[:, moving]
    root = np.linalg.cholesky(np.where(owners[:, None] == owners, J @ np.linalg.solve(M, J.T), 0.0))
    J = np.linalg.solve(root, J)
    system = np.block([[M, J.T], [J, np.zeros((owners.size, owners.size))]])
    right = np.concatenate([Q[moving], np.linalg.solve(root, gamma)])
    solution = np.linalg.lstsq(system, right, rcond=None)[0]
    v_dot = np.zeros(Q.size)
    v_dot[moving] = solution[: len(moving)]
    return v_dot, np.linalg.solve(root.T, solution[len(moving) :])


def _inertia_and_forces(now: Instant) -> tuple[Array, Array]:
    """M and Q of all bodies: block after block, and the applied loads."""
    place, x, v = now.place, now.x, now.v
    M, Q = np.zeros((place.v_size, place.v_size)), np.zeros(place.v_size)
    field = gravity_at(now.scene, now.t)
    for b, body in enumerate(now.scene.bodies):
        integrals, at = kept_integrals(body), slice(place.iv[b], place.iv[b] + 6 + place.n[b])
        q, q_dot, omega, A = x[place.q(b)], v[place.q_dot(b)], v[place.omega(b)], rotation_matrix(x[place.p(b)])
        M[at, at] = mass_matrix(integrals, q)
        Q[at] = (
            quadratic_velocity(integrals, q, omega, q_dot)
            + elastic_force(integrals, body.damping, q, q_dot)
            + gravity_force(integrals, q, A, field)
        )
    return M, Q + sum((load.generalised for load in applied(now.scene, place, now.t, x, v)), np.zeros(place.v_size))
