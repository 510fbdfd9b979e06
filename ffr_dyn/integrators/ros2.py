"""A linearly implicit W-method of order two: elastic and stiff forces implicit, everything else explicit.

Rosenbrock-type method with the elastic part  A = d(q_ddot)/d(q, q_dot) of  M v_dot = ... - Omega^2 q - 2 zeta Omega q_dot
and the kinematics x_dot = T(x) v as its Jacobian; its order does not depend on what A leaves out (Verwer, Spee, Blom,
Hundsdorfer 1999, ROS2):

    (I - gamma h A) k1 = f(t, y)
    (I - gamma h A) k2 = f(t + h, y + h k1) - 2 k1,     y+ = y + 3/2 h k1 + 1/2 h k2,     gamma = 1 - 1/sqrt(2)

L-stable in the elastic part; another gamma keeps the order and damps vibrations less (`Twin`). Since Omega^2 and
2 zeta Omega are diagonal, a stage is an explicit evaluation with
1 + gamma^2 h^2 Omega^2 + 2 gamma h zeta Omega in place of the unit elastic mass:

    (M + diag_ff(gamma^2 h^2 Omega^2 + 2 gamma h zeta Omega)) k_v + Phi_q^T mu = Q + M r_v - gamma h Omega^2 (q_dot + r_q)
    Phi_q k_v = gamma_rhs + Phi_q r_v,      k_x = T(x) (v + gamma h k_v) + r_x     (r = 0, then -2 k1)

Stiff forces are rows beside those of the joints (`ffr_dyn.kernels.forces.implicit`).

All positions move with v + gamma h k_v, not the elastic ones alone: otherwise a joint that stiff modes move would be left by
its two sides at different rates, and drift.

Twin: the statement above, held by
`tests/ffr_dyn/kernels/test_dyn_laws.py::test_motion_converges_at_the_order_of_the_method`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from ffr_dyn.integrators.step import check_step
from ffr_dyn.kernels.integrator_api import (
    OK,
    CompiledFunction,
    H,
    Tables,
    acceleration_target,
    add_both,
    add_scaled,
    add_stiff_part,
    begin_stages,
    copy,
    correct,
    evaluate,
    fill,
    finite,
    later_stage,
    method_step,
    multiple,
    normalise,
    position_rates,
    solve_stage,
    stabilise,
    velocity_rates,
)

GAMMA = 1.0 - 0.5**0.5


@method_step
def ros2_step(r: Tables, t: float, again: int) -> int:
    """One step of the engine's state from time t. Returns a status."""
    h = r.clock.time[H]
    bodies, stages = r.model.bodies, r.stages
    gh = stages.numbers[0] * h
    begin_stages(r, gh, h)
    xs, vs, r_x, r_v = stages.x[2], stages.v[2], stages.x[3], stages.v[3]
    for k in range(2):
        if k == 0:
            status = stabilise(r, t, r.x, r.v)
            copy(xs, r.x)
            copy(vs, r.v)
            fill(r_x, 0.0)
        else:
            add_scaled(xs, r.x, h, stages.x[0])
            add_scaled(vs, r.v, h, stages.v[0])
            multiple(r_x, -2.0, stages.x[0])
            multiple(r_v, -2.0, stages.v[0])
            normalise(bodies, xs)  # r_v goes to body axes and comes back, which wants a true rotation
            later_stage(r, -gh)
            status = evaluate(r, t + h, xs, vs)
        if status != OK:
            return status
        acceleration_target(r.work.rows, r.clock.gains, stages.target)
        if k == 1:
            correct(r, r_v, stages.target)
        add_stiff_part(r, k, vs, r_x, gh, (h, 0.0, 0.0), (-2.0, 0.0, 0.0))
        solve_stage(r, k)
        velocity_rates(r, stages.v[k])
        add_scaled(vs, vs, gh, stages.v[k])
        position_rates(bodies, xs, vs, stages.x[k])
    add_scaled(stages.x[1], stages.x[1], 1.0, r_x)
    add_both(r.x, 1.5 * h, stages.x[0], 0.5 * h, stages.x[1])
    add_both(r.v, 1.5 * h, stages.v[0], 0.5 * h, stages.v[1])
    normalise(bodies, r.x)
    return finite(r.x, r.v)


@dataclass(frozen=True)
class ROS2:
    """Linearly implicit, order two; neither elastic frequencies nor stiff forces limit the step, which costs two evaluations.

    Modes with h Omega > 1 are damped numerically; those the step resolves are right to second order.

    step : time step [s]

    Raises InputError for a step that is not positive.

    >>> result = fd.forward(scene, end=1.0, output_step=0.01, method=fd.ROS2(1e-3))
    """

    step: float
    order: ClassVar[int] = 2
    implicit: ClassVar[bool] = True
    takes_forces: ClassVar[bool] = True
    reach: ClassVar[float] = math.inf
    controlled: ClassVar[bool] = False
    repeatable: ClassVar[bool] = True
    stage_count: ClassVar[int] = 4
    row_stages: ClassVar[int] = 0
    keeps_terms: ClassVar[bool] = False
    numbers: ClassVar[tuple[float, ...]] = (GAMMA,)
    do_step: ClassVar[CompiledFunction] = ros2_step

    def __post_init__(self) -> None:
        check_step(self, self.step)


@dataclass(frozen=True)
class Twin:
    """ROS2 that damps what a step does not resolve as the scene itself does: what ROS2 and ROS3 damp away is seen beside it.

    Its stability function is -rho at infinity, with gamma = (1 - sqrt((1 - rho) / 2)) / (1 + rho); without damping (rho = 1)
    it is the trapezoidal rule in the elastic part, and vibrations keep their amplitude, whatever their phase.

    step : time step [s];  rho : from 0, ROS2 itself, to 1
    """

    step: float
    rho: float = 1.0
    order: ClassVar[int] = 2
    implicit: ClassVar[bool] = True
    takes_forces: ClassVar[bool] = True
    reach: ClassVar[float] = math.inf
    controlled: ClassVar[bool] = False
    repeatable: ClassVar[bool] = True
    stage_count: ClassVar[int] = 4
    row_stages: ClassVar[int] = 0
    keeps_terms: ClassVar[bool] = False
    do_step: ClassVar[CompiledFunction] = ros2_step

    @property
    def numbers(self) -> tuple[float, ...]:
        """Gamma."""
        return ((1.0 - ((1.0 - self.rho) / 2) ** 0.5) / (1.0 + self.rho),)
