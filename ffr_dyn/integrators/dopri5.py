"""The explicit Runge-Kutta pair of orders 5 and 4 of Dormand & Prince (1980), on the index-1 equations.

Seven stages, the last of which is the first of the next step. Within a step positions and velocities each follow a polynomial
of order four through all stages. Coefficients: Hairer, Norsett & Wanner 1993, table II.5.2 and section II.6.

Twin: the statement above, held by
`tests/ffr_dyn/integrators/test_integrators_adaptive.py::test_the_error_follows_the_tolerance`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from ffr_dyn.integrators.tolerances import Tolerances
from ffr_dyn.kernels.integrator_api import (
    BEFORE,
    NOW,
    OK,
    RESTART,
    WITHIN,
    CompiledFunction,
    H,
    Tables,
    acceleration_target,
    add_scaled,
    copy,
    evaluate,
    fill,
    finite,
    inlined,
    kernel,
    method_step,
    normalise,
    position_rates,
    set_diagonal,
    solve,
    stabilise,
    velocity_rates,
)

# Rows of the lower triangle, six to a row; the last are the weights of order five.
STAGES = (
    *(0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    *(1 / 5, 0.0, 0.0, 0.0, 0.0, 0.0),
    *(3 / 40, 9 / 40, 0.0, 0.0, 0.0, 0.0),
    *(44 / 45, -56 / 15, 32 / 9, 0.0, 0.0, 0.0),
    *(19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0.0, 0.0),
    *(9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0.0),
    *(35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84),
)
# Less the weights of order four.
ERRORS = (71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40)
# Of the part of order four of the polynomial within a step.
BENT = (
    *(-12715105075 / 11282082432, 0.0, 87487479700 / 32700410799, -10690763975 / 1880347072),
    *(701980252875 / 199316789632, -1453857185 / 822651844, 69997945 / 29380423),
)
AT = (0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0)
FIRST = 3  # row of the first stage; before it the error and scratch


@inlined
def slopes(r, x, v, k):
    """Keep the slopes of what was evaluated last, at (x, v), as stage k."""
    acceleration_target(r.work.rows, r.clock.gains, r.stages.target)
    solve(r, r.stages.target)
    position_rates(r.model.bodies, x, v, r.stages.x[FIRST + k])
    velocity_rates(r, r.stages.v[FIRST + k])


@kernel
def state_within(first, stages, h, share, last):
    """In place of the state `last`, with which a step of length h ends that began at `first`: that at a share of it."""
    rest = 1.0 - share
    for k in range(last.size):
        whole, bent = last[k] - first[k], 0.0
        for j in range(7):
            bent += h * BENT[j] * stages[FIRST + j, k]
        begins = h * stages[FIRST, k] - whole
        ends = whole - h * stages[FIRST + 6, k] - begins
        last[k] = first[k] + share * (whole + rest * (begins + share * (ends + rest * bent)))


@inlined
def go_back(r, t):
    """The engine's state at a time t within the last step."""
    c = r.control
    now, h = c.numbers[NOW], c.numbers[NOW] - c.numbers[BEFORE]
    if t < now and h > 0.0:
        share = (t - c.numbers[BEFORE]) / h
        state_within(c.x, r.stages.x, h, share, r.x)
        state_within(c.v, r.stages.v, h, share, r.v)
        normalise(r.model.bodies, r.x)


@method_step
def dopri5_step(r: Tables, t: float, again: int) -> int:
    """One step of the engine's state from time t; `again` tells that the last one was refused, or asks for the state at t
    within it. Returns a status."""
    if again == WITHIN:
        go_back(r, t)
        return OK
    h, stages = r.clock.time[H], r.stages
    set_diagonal(r, 0.0)
    if stages.numbers[0] == 0.0 or again == RESTART:
        status = stabilise(r, t, r.x, r.v)
        if status != OK:
            return status
        slopes(r, r.x, r.v, 0)
        stages.numbers[0] = 1.0
    elif again == 0:
        copy(stages.x[FIRST], stages.x[FIRST + 6])
        copy(stages.v[FIRST], stages.v[FIRST + 6])
    xs, vs = stages.x[1], stages.v[1]
    for k in range(1, 6):
        copy(xs, r.x)
        copy(vs, r.v)
        for j in range(k):
            add_scaled(xs, xs, h * STAGES[6 * k + j], stages.x[FIRST + j])
            add_scaled(vs, vs, h * STAGES[6 * k + j], stages.v[FIRST + j])
        status = evaluate(r, t + AT[k] * h, xs, vs)
        if status != OK:
            return status
        slopes(r, xs, vs, k)
    for j in range(6):
        add_scaled(r.x, r.x, h * STAGES[36 + j], stages.x[FIRST + j])
        add_scaled(r.v, r.v, h * STAGES[36 + j], stages.v[FIRST + j])
    normalise(r.model.bodies, r.x)
    status = stabilise(r, t + h, r.x, r.v)
    if status != OK:
        return status
    slopes(r, r.x, r.v, 6)
    fill(stages.x[0], 0.0)
    fill(stages.v[0], 0.0)
    for j in range(7):
        add_scaled(stages.x[0], stages.x[0], h * ERRORS[j], stages.x[FIRST + j])
        add_scaled(stages.v[0], stages.v[0], h * ERRORS[j], stages.v[FIRST + j])
    return finite(r.x, r.v)


@dataclass(frozen=True)
class DormandPrince:
    """Explicit, of order five, with steps chosen by the error of each; a step costs six evaluations.

    For scenes without stiff modes: no step is stable above some 3.3 / omega_max of the assembled system.

    tolerances : what an error may be

    >>> result = fd.forward(scene, end=1.0, output_step=0.01, method=fd.DormandPrince(fd.tolerances(1e-8)))
    """

    tolerances: Tolerances = Tolerances()  # noqa: RUF009 - frozen
    order: ClassVar[int] = 5
    estimate_order: ClassVar[int] = 5
    implicit: ClassVar[bool] = False
    takes_forces: ClassVar[bool] = False
    reach: ClassVar[float] = 0.9971  # where |R(i y)| exceeds 1, by little up to 3.3: steps are chosen by their error
    controlled: ClassVar[bool] = True
    step: ClassVar[float] = 0.0
    repeatable: ClassVar[bool] = False
    stage_count: ClassVar[int] = 10
    row_stages: ClassVar[int] = 0
    keeps_terms: ClassVar[bool] = False
    numbers: ClassVar[tuple[float, ...]] = (0.0,)
    do_step: ClassVar[CompiledFunction] = dopri5_step
