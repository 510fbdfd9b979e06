"""A linearly implicit W-method of order two: elastic stiffness and damping implicit, everything else explicit.

Rosenbrock-type method with the elastic part  A = d(q_ddot)/d(q, q_dot) of  M v_dot = ... - Omega^2 q - 2 zeta Omega q_dot
and the kinematics x_dot = T(x) v as its Jacobian; its order does not depend on what A leaves out (Verwer, Spee, Blom,
Hundsdorfer 1999, ROS2):

    (I - gamma h A) k1 = f(t, y)
    (I - gamma h A) k2 = f(t + h, y + h k1) - 2 k1,     y+ = y + 3/2 h k1 + 1/2 h k2,     gamma = 1 - 1/sqrt(2)

L-stable in the elastic part. Since Omega^2 and 2 zeta Omega are diagonal, a stage is an explicit evaluation with
1 + gamma^2 h^2 Omega^2 + 2 gamma h zeta Omega in place of the unit elastic mass:

    (M + diag_ff(gamma^2 h^2 Omega^2 + 2 gamma h zeta Omega)) k_v + Phi_q^T mu = Q + M r_v - gamma h Omega^2 (q_dot + r_q)
    Phi_q k_v = gamma_rhs + Phi_q r_v,      k_x = T(x) (v + gamma h k_v) + r_x     (r = 0, then -2 k1)

All positions move with v + gamma h k_v, not the elastic ones alone: otherwise a joint that stiff modes move would be left by
its two sides at different rates, and drift.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from ffr_dyn.kernels.bodies import mass_times, normalise, position_rates
from ffr_dyn.kernels.options import entry, inlined
from ffr_dyn.kernels.record import record
from ffr_dyn.kernels.stiffening import solve_stiffened
from ffr_dyn.kernels.system import (
    acceleration_target,
    constraint_rates,
    evaluate,
    evaluate_on_constraints,
    finite,
    prepare,
    to_body_axes,
    to_velocity_rates,
)
from ffr_dyn.kernels.tables import OK
from ffr_dyn.kernels.vectors import add_scaled, copy, fill

GAMMA = 1.0 - 0.5**0.5


@inlined
def set_elastic_diagonal(bodies, dinv, gh):
    for k in range(dinv.size):
        dinv[k] = 1.0 / (1.0 + gh * gh * bodies.omega2[k] + gh * bodies.two_zeta_omega[k])


@inlined
def add_elastic_part(bodies, f, v, r_x, gh):
    """f -= gamma h Omega^2 (q_dot + r_q)."""
    for b in range(bodies.mass.size):
        n, i, j, e = bodies.where[b, 0], bodies.where[b, 1], bodies.where[b, 2], bodies.where[b, 3]
        for k in range(n):
            f[j + 6 + k] -= gh * bodies.omega2[e + k] * (v[j + 6 + k] + r_x[i + 7 + k])


@inlined
def add_correction(m, w, r_v, target):
    """f += M r_v, target += Phi_q r_v."""
    bodies, bw, rw = m.bodies, w.bodies, w.rows
    copy(bw.acc, r_v)
    to_body_axes(bodies.where, bw.A, bw.acc)
    copy(bw.shift, bw.acc)
    constraint_rates(bodies.where, m.markers, m.rows, rw.jac, bw.acc, rw.lam)
    add_scaled(target, target, 1.0, rw.lam)
    for b in range(bodies.mass.size):
        j, size = bodies.where[b, 2], 6 + bodies.where[b, 0]
        mass_times(bodies, bw, b, bw.acc[j : j + size], bw.f[j : j + size])


@inlined
def step(m, w, stages, t, h, x, v, alpha, beta, tolerance):
    """One step in place. Returns a status."""
    gh = GAMMA * h
    xs, vs, r_x, r_v = stages.x[2], stages.v[2], stages.x[3], stages.v[3]
    for k in range(2):
        if k == 0:
            status = evaluate_on_constraints(m, w, t, x, v, tolerance)
            copy(xs, x)
            copy(vs, v)
            fill(r_x, 0.0)
        else:
            add_scaled(xs, x, h, stages.x[0])
            add_scaled(vs, v, h, stages.v[0])
            fill(r_v, 0.0)
            add_scaled(r_x, r_x, -2.0, stages.x[0])
            add_scaled(r_v, r_v, -2.0, stages.v[0])
            normalise(m.bodies, xs)  # r_v goes to body axes and comes back, which wants a true rotation
            status = evaluate(m, w, t + h, xs, vs)
        if status != OK:
            return status
        acceleration_target(w.rows, alpha, beta, stages.target)
        add_elastic_part(m.bodies, w.bodies.f, vs, r_x, gh)
        fill(w.bodies.shift, 0.0)
        if k == 1:
            add_correction(m, w, r_v, stages.target)
        solve_stiffened(m, w, xs, stages.target)
        to_velocity_rates(m.bodies.where, w.bodies.A, w.bodies.acc, stages.v[k])
        add_scaled(vs, vs, gh, stages.v[k])
        position_rates(m.bodies, xs, vs, stages.x[k])
        add_scaled(stages.x[k], stages.x[k], 1.0, r_x)
    for k in range(2):
        weight = 1.5 * h if k == 0 else 0.5 * h
        add_scaled(x, x, weight, stages.x[k])
        add_scaled(v, v, weight, stages.v[k])
    normalise(m.bodies, x)
    return finite(x, v)


@entry
def ros2_run(m, w, stages, t0, h, first, substeps, x, v, alpha, beta, tolerance, out):
    """Fill the rows of `out`, `substeps` steps apart, from step number `first`. Returns (rows filled, status)."""
    number = first
    for row in range(out.time.size):
        set_elastic_diagonal(m.bodies, w.bodies.dinv, GAMMA * h)
        prepare(m.bodies.where, m.markers, m.rows, m.pattern, w.bodies.dinv, w.rows.phiphi)
        for _ in range(substeps):
            w.info[3] = number
            status = step(m, w, stages, t0 + number * h, h, x, v, alpha, beta, tolerance)
            if status != OK:
                return row, status
            number += 1
        w.info[3] = number
        status = record(m, w, t0 + number * h, x, v, out, row)
        if status != OK:
            return row, status
    return out.time.size, OK


@dataclass(frozen=True)
class ROS2:
    """Linearly implicit, order two; no elastic frequency limits the step, and a step costs two evaluations.

    Modes with h Omega > 1 are damped numerically; those the step resolves are right to second order.

    step : time step [s]
    """

    step: float
    order: ClassVar[int] = 2
    implicit: ClassVar[bool] = True
    stage_count: ClassVar[int] = 4
    run: ClassVar[Any] = staticmethod(ros2_run)
