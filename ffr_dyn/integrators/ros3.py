"""A linearly implicit W-method of order three: elastic and stiff forces implicit, everything else explicit.

Four stages, stiffly accurate, with the stability of ROS34PW2 (Rang & Angermann, BIT 45 (2005) 761-787): L-stable in what is
implicit, of order three whatever the Jacobian leaves out. ROS34PW2 wants one Jacobian for all stages of a step; here the mass
matrix in it belongs to the stage. So the coefficients are those nearest to ROS34PW2 that satisfy, beside its conditions,

    sum_i b_i c_i sum_j gamma_ij = 0   (j up to i),

which takes the change of the Jacobian out of the error of third order. With the Jacobian A as in `ffr_dyn.integrators.ros2`,
stage i is

    (I - gamma h A) u_i = f(t + c_i h, y + h sum_j alpha_ij k_j) + r_i,    k_i = u_i - r_i,
    r_i = 1/gamma sum_j gamma_ij k_j,

and y+ = y + h sum_i b_i k_i. A stage costs an explicit evaluation.

The weights of order two that it is compared with, to choose steps, are those whose stability function is -1/4 at infinity.
The last stage is some 0.2 h^2 times the acceleration beside the end of the step, where a stop may begin that no stage has
seen. So it is done again at the end, and the difference is an error, too, where there are applied forces.

Twin: the statement above, held by
`tests/ffr_dyn/kernels/test_dyn_laws.py::test_motion_converges_at_the_order_of_the_method`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from ffr_dyn.integrators.step import check_step
from ffr_dyn.integrators.tolerances import Tolerances
from ffr_dyn.kernels.integrator_api import (
    IN_SHARED,
    IN_V,
    IN_X,
    OK,
    WITHIN,
    CompiledFunction,
    H,
    N,
    Tables,
    acceleration_target,
    add_four,
    add_scaled,
    add_stiff_part,
    begin_stages,
    combine_three,
    copy,
    correct,
    evaluate,
    fill,
    finite,
    inlined,
    interpolate,
    later_stage,
    method_step,
    normalise,
    position_rates,
    solve_stage,
    stabilise,
    velocity_rates,
    weigh_four,
)

GAMMA = 0.43586652150845900
# Rows of both lower triangles, four to a row.
ALPHA = (
    *(0.0, 0.0, 0.0, 0.0),
    *(0.8599004143760887, 0.0, 0.0, 0.0),
    *(0.8293784117398193, -0.11144515098558946, 0.0, 0.0),
    *(-0.005533637718755573, 0.0043645886709089785, 1.0011690490478466, 0.0),
)
GAMMAS = (
    *(0.0, 0.0, 0.0, 0.0),
    *(-0.8599004143760892, 0.0, 0.0, 0.0),
    *(-0.8873114027376415, 0.05189554494812108, 0.0, 0.0),
    *(0.23966827525132695, -1.2214324880772196, 0.5458976913174336, 0.0),
)
WEIGHTS = (0.23413463753257138, -1.2170678994063107, 1.5470667403652802, 0.435866521508459)
# Less the weights of order two.
ERRORS = (-0.07173852763110697, -0.5890830943268753, 0.5469231340669933, 0.11389848789098905)
AT = (0.0, 0.8599004143760887, 0.7179332607542298, 1.0)


@inlined
def _compare_end(r, t, h):
    """Where the last stage, done at the end of the step, has other rates, that is their error in `stages.v[0]`. Elastic
    forces stay those of the stage: they are linear. Returns a status."""
    stages, omega2, gh = r.stages, r.model.bodies.omega2, GAMMA * h
    x4, v4, r_x, r_v, rates = stages.x[4], stages.v[4], stages.x[5], stages.v[5], stages.v[1]
    add_scaled(stages.v[3], stages.v[3], 1.0, r_v)
    add_scaled(v4, v4, -gh, stages.v[3])
    status = evaluate(r, t + h, r.x, r.v)
    if status != OK:
        return status
    acceleration_target(r.work.rows, r.clock.gains, stages.target)
    correct(r, r_v, stages.target)
    shares = (h * ALPHA[12], h * ALPHA[13], h * ALPHA[14])
    add_stiff_part(r, 3, v4, r_x, gh, shares, (GAMMAS[12] / GAMMA, GAMMAS[13] / GAMMA, GAMMAS[14] / GAMMA))
    where = r.model.bodies.where
    for b in range(r.model.bodies.mass.size):
        i, j, shared = where[b, IN_X] + 7, where[b, IN_V] + 6, where[b, IN_SHARED]
        for k in range(where[b, N]):
            r.work.bodies.f[j + k] += omega2[shared + k] * (r.x[i + k] - x4[i + k])
    solve_stage(r, 3)
    velocity_rates(r, rates)
    for k in range(rates.size):
        off = gh * (rates[k] - stages.v[3][k])
        if abs(off) > abs(stages.v[0][k]):
            stages.v[0][k] = off
    return OK


@method_step
def ros3_step(r: Tables, t: float, again: int) -> int:
    """One step of the engine's state from time t, or with `again` WITHIN its state then. Returns a status."""
    if again == WITHIN:
        interpolate(r, t)
        return OK
    h = r.clock.time[H]
    bodies, stages = r.model.bodies, r.stages
    gh = GAMMA * h
    begin_stages(r, gh, h)
    xs, vs, r_x, r_v = stages.x[4], stages.v[4], stages.x[5], stages.v[5]
    for k in range(4):
        # the coefficients of later stages, which may hold anything, are zero
        a0, a1, a2 = h * ALPHA[4 * k], h * ALPHA[4 * k + 1], h * ALPHA[4 * k + 2]
        g0, g1, g2 = GAMMAS[4 * k] / GAMMA, GAMMAS[4 * k + 1] / GAMMA, GAMMAS[4 * k + 2] / GAMMA
        if k == 0:
            status = stabilise(r, t, r.x, r.v)
            copy(xs, r.x)
            copy(vs, r.v)
            fill(r_x, 0.0)
            fill(r_v, 0.0)
        else:
            m, n = min(1, k - 1), min(2, k - 1)
            combine_three(stages.x[0], stages.x[m], stages.x[n], xs, r.x, a0, a1, a2, r_x, g0, g1, g2)
            combine_three(stages.v[0], stages.v[m], stages.v[n], vs, r.v, a0, a1, a2, r_v, g0, g1, g2)
            normalise(bodies, xs)  # r_v goes to body axes and comes back, which wants a true rotation
            later_stage(r, gh * (1.0 + g0 + g1 + g2))
            status = evaluate(r, t + AT[k] * h, xs, vs)
        if status != OK:
            return status
        acceleration_target(r.work.rows, r.clock.gains, stages.target)
        if k > 0:
            correct(r, r_v, stages.target)
        add_stiff_part(r, k, vs, r_x, gh, (a0, a1, a2), (g0, g1, g2))
        solve_stage(r, k)
        velocity_rates(r, stages.v[k])
        add_scaled(vs, vs, gh, stages.v[k])
        position_rates(bodies, xs, vs, stages.x[k])
        add_scaled(stages.v[k], stages.v[k], -1.0, r_v)
    w0, w1, w2, w3 = h * WEIGHTS[0], h * WEIGHTS[1], h * WEIGHTS[2], h * WEIGHTS[3]
    add_four(r.x, w0, stages.x[0], w1, stages.x[1], w2, stages.x[2], w3, stages.x[3])
    add_four(r.v, w0, stages.v[0], w1, stages.v[1], w2, stages.v[2], w3, stages.v[3])
    normalise(bodies, r.x)
    if r.control.numbers.size > 0:
        e0, e1, e2, e3 = h * ERRORS[0], h * ERRORS[1], h * ERRORS[2], h * ERRORS[3]
        weigh_four(stages.x[0], e0, stages.x[0], e1, stages.x[1], e2, stages.x[2], e3, stages.x[3])
        weigh_four(stages.v[0], e0, stages.v[0], e1, stages.v[1], e2, stages.v[2], e3, stages.v[3])
        if r.model.loads.row.shape[0] > 0:
            status = _compare_end(r, t, h)
            if status != OK:
                return status
    return finite(r.x, r.v)


@dataclass(frozen=True)
class ROS3:
    """Linearly implicit, order three; neither elastic frequencies nor stiff forces limit the step, which costs four
    evaluations.

    Modes with h Omega > 1 are damped numerically; those the step resolves are right to third order.

    step : time step [s]

    Raises InputError for a step that is not positive.

    >>> result = fd.forward(scene, end=1.0, output_step=0.01, method=fd.ROS3(1e-3))
    """

    step: float
    order: ClassVar[int] = 3
    implicit: ClassVar[bool] = True
    takes_forces: ClassVar[bool] = True
    reach: ClassVar[float] = math.inf
    controlled: ClassVar[bool] = False
    repeatable: ClassVar[bool] = True
    stage_count: ClassVar[int] = 6
    row_stages: ClassVar[int] = 0
    keeps_terms: ClassVar[bool] = False
    numbers: ClassVar[tuple[float, ...]] = ()
    do_step: ClassVar[CompiledFunction] = ros3_step

    def __post_init__(self) -> None:
        check_step(self, self.step)


@dataclass(frozen=True)
class AdaptiveROS3:
    """ROS3 with steps chosen by the error of each.

    tolerances : what an error may be

    >>> result = fd.forward(scene, end=1.0, output_step=0.01, method=fd.AdaptiveROS3(fd.tolerances(1e-6)))
    """

    tolerances: Tolerances = Tolerances()  # noqa: RUF009 - frozen
    order: ClassVar[int] = 3
    estimate_order: ClassVar[int] = 3
    implicit: ClassVar[bool] = True
    takes_forces: ClassVar[bool] = True
    reach: ClassVar[float] = math.inf
    controlled: ClassVar[bool] = True
    step: ClassVar[float] = 0.0
    repeatable: ClassVar[bool] = False
    stage_count: ClassVar[int] = 6
    row_stages: ClassVar[int] = 0
    keeps_terms: ClassVar[bool] = False
    numbers: ClassVar[tuple[float, ...]] = ()
    do_step: ClassVar[CompiledFunction] = ros3_step
