"""Half-explicit Runge-Kutta on the index-2 equations: constraints on velocities hold at every stage, to rounding.

Hairer, Lubich & Roche 1989; Brasey & Hairer, SIAM J. Numer. Anal. 30 (1993) 538-552; coefficients of order four and the
proof for multibody systems in Hairer & Wanner 1996, VII.6 (HEM4, five stages; its last three weights are Radau's):

    X_{i+1} = x + h sum_j a_{i+1,j} T(X_j) V_j,      V_{i+1} = v + h sum_j a_{i+1,j} v_dot_j     (j up to i),
    M(X_i) v_dot_i = Q(X_i, V_i) - Phi_q^T(X_i) lambda_i  with lambda_i such that  Phi_q(X_{i+1}) V_{i+1} + Phi_t = 0.

No second derivative of a constraint enters. The matrix Phi_q(X_{i+1}) M^-1 Phi_q^T(X_i) is not symmetric; it is solved by
iteration with the factors at X_i, which gains a factor of the angle turned in a stage each time and costs a back
substitution. Positions drift off their constraints with the error of the method alone, and are projected.

Twin: the statement above, held by
`tests/ffr_dyn/integrators/test_integrators_implicit.py::test_motion_rates_and_reactions_converge_at_the_order`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from ffr_dyn.integrators.step import check_step
from ffr_dyn.kernels.integrator_api import (
    FAILED,
    HERE,
    NEAR,
    NOT_CONVERGED,
    NOT_FINITE,
    OK,
    RESTART,
    TIGHTER,
    TOLERANCE,
    CompiledFunction,
    H,
    Tables,
    add_scaled,
    constraint_rates,
    copy,
    evaluate,
    evaluate_rows_at,
    finite,
    inlined,
    into_body_axes,
    keep_measured,
    keep_rows,
    largest,
    largest_motion,
    method_step,
    normalise,
    note_drift,
    position_rates,
    row_of_largest,
    set_diagonal,
    solve,
    stabilise,
    velocity_rates,
)

ROOT = 6.0**0.5
STAGES = 5
# Row k: the coefficients that make stage k + 1, the last row those of the step.
A = (
    *(0.3, 0.0, 0.0, 0.0, 0.0),
    *((1.0 + ROOT) / 30.0, (11.0 - 4.0 * ROOT) / 30.0, 0.0, 0.0, 0.0),
    *((-79.0 - 31.0 * ROOT) / 150.0, (-1.0 - 4.0 * ROOT) / 30.0, (24.0 + 11.0 * ROOT) / 25.0, 0.0, 0.0),
    *((14.0 + 5.0 * ROOT) / 6.0, (-8.0 + 7.0 * ROOT) / 6.0, (-9.0 - 7.0 * ROOT) / 4.0, (9.0 - ROOT) / 4.0, 0.0),
    *(0.0, 0.0, (16.0 - ROOT) / 36.0, (16.0 + ROOT) / 36.0, 1.0 / 9.0),
)
C = (0.0, 0.3, (4.0 - ROOT) / 10.0, (4.0 + ROOT) / 10.0, 1.0, 1.0)
SWEEPS = 30
EXACT = 1e-15  # relative error of a velocity with which it is as good as rounding lets it be
PATIENCE = 2  # sweeps that need not halve what is left: near-massless bodies gain in pairs of sweeps
LOST = 1e-6  # relative error of a velocity with which the iteration has failed

# Rows of stages.x and stages.v after those of the stages: this stage's state, the next one's, scratch.
STAGE, AHEAD, SCRATCH = STAGES, STAGES + 1, STAGES + 2
# Rows of stages.rows: rates ahead and what they are short of.
NU, SHORT = 0, 1


@inlined
def rates_ahead(r, u, out):
    """out (C,) = Phi_q(X_{i+1}) u, for u shaped like v."""
    x, y = r.stages.x[AHEAD], r.stages.v[SCRATCH]
    copy(y, u)
    into_body_axes(r.model.bodies, x, y, r.work.loads.turn[0])
    constraint_rates(r.model.bodies.where, r.model.markers, r.model.rows, r.work.rows.kept, r.work.markers.kept, y, out)


@inlined
def keep_rows_ahead(r):
    """Keep what `evaluate_rows_at` found."""
    copy(r.stages.rows[NU], r.work.rows.nu)
    keep_rows(r)


@inlined
def violation_allowed(r):
    return r.clock.gains[TOLERANCE] * (TIGHTER if r.work.independence[HERE] < NEAR else 1.0)


@inlined
def accelerate(r, k, ha):
    """v_dot of stage k, evaluated at STAGE, such that v[AHEAD] + ha v_dot obeys the constraints there. Returns a status."""
    s, bw, rows = r.stages, r.work.bodies, r.work.rows
    here, base, rate, short = s.v[STAGE], s.v[AHEAD], s.v[k], s.rows[SHORT]
    for j in range(here.size):
        rate[j] = base[j] - here[j]
    rates_ahead(r, rate, short)
    add_scaled(s.rows[NU], s.rows[NU], 1.0, short)  # the rates of the constraints at (X_{i+1}, v[AHEAD])
    copy(s.target, rows.gamma)
    before, stuck = math.inf, 0
    exact = EXACT / abs(ha) * largest_motion(r.model.bodies, bw.J, here)[0]
    for _ in range(SWEEPS):
        solve(r, s.target)
        velocity_rates(r, rate)
        rates_ahead(r, rate, short)
        for c in range(short.size):
            short[c] = -s.rows[NU, c] / ha - short[c]
        left = largest(short)
        stuck = 0 if left < 0.5 * before else stuck + 1
        if left <= exact or stuck == PATIENCE:
            break
        before = min(left, before)
        add_scaled(s.target, s.target, 1.0, short)
    if left == 0.0:
        return OK
    scale = largest_motion(r.model.bodies, bw.J, here)[0] + abs(ha) * largest_motion(r.model.bodies, bw.J, rate)[0]
    if abs(ha) * left <= LOST * scale:
        return OK
    if not left < math.inf:
        return NOT_FINITE
    for c in range(short.size):
        if abs(short[c]) == left:
            r.work.info[FAILED] = r.model.bodies.mass.size + c
    return NOT_CONVERGED


@method_step
def half_explicit_step(r: Tables, t: float, again: int) -> int:
    """One step of the engine's state from time t. Returns a status."""
    h, s, bodies, number = r.clock.time[H], r.stages, r.model.bodies, r.stages.numbers
    set_diagonal(r, 0.0)
    if number[0] == 0.0 or again == RESTART:
        status = stabilise(r, t, r.x, r.v)
        if status != OK:
            return status
    copy(s.x[STAGE], r.x)
    copy(s.v[STAGE], r.v)
    for k in range(STAGES):
        position_rates(bodies, s.x[STAGE], s.v[STAGE], s.x[k])
        copy(s.x[AHEAD], r.x)
        copy(s.v[AHEAD], r.v)
        for j in range(k + 1):
            add_scaled(s.x[AHEAD], s.x[AHEAD], h * A[STAGES * k + j], s.x[j])
        for j in range(k):
            add_scaled(s.v[AHEAD], s.v[AHEAD], h * A[STAGES * k + j], s.v[j])
        normalise(bodies, s.x[AHEAD])
        status = evaluate_rows_at(r, t + C[k + 1] * h, s.x[AHEAD], s.v[STAGE])
        if status == OK:
            keep_rows_ahead(r)
            position, opened = largest(r.work.rows.Phi), row_of_largest(r.work.rows.Phi)
            status = evaluate(r, t + C[k] * h, s.x[STAGE], s.v[STAGE])
        if status == OK:
            if k == 0:
                keep_measured(r.work.loads)
            status = accelerate(r, k, h * A[(STAGES + 1) * k])
        if status != OK:
            return status
        add_scaled(s.v[AHEAD], s.v[AHEAD], h * A[(STAGES + 1) * k], s.v[k])
        copy(s.x[STAGE], s.x[AHEAD])
        copy(s.v[STAGE], s.v[AHEAD])
    note_drift(r.work.drift, position, opened, t + h)
    number[0] = 1.0 if position <= violation_allowed(r) or r.clock.gains[TOLERANCE] == 0.0 else 0.0
    copy(r.x, s.x[STAGE])
    copy(r.v, s.v[STAGE])
    return finite(r.x, r.v)


@dataclass(frozen=True)
class HalfExplicit:
    """Half-explicit Runge-Kutta of order four: the constraints on velocities hold exactly, those on positions by projection.

    Explicit: the step is limited as that of `RK4`. Five evaluations a step.

    step : time step [s]

    Raises InputError for a step that is not positive.

    >>> result = fd.forward(scene, end=1.0, output_step=0.01, method=fd.HalfExplicit(1e-4))
    """

    step: float
    order: ClassVar[int] = 4
    implicit: ClassVar[bool] = False
    takes_forces: ClassVar[bool] = False
    reach: ClassVar[float] = 3.2757  # where |R(i y)| exceeds 1
    repeatable: ClassVar[bool] = True
    stage_count: ClassVar[int] = STAGES + 3
    row_stages: ClassVar[int] = 2
    keeps_terms: ClassVar[bool] = False
    controlled: ClassVar[bool] = False
    numbers: ClassVar[tuple[float, ...]] = (0.0,)
    do_step: ClassVar[CompiledFunction] = half_explicit_step

    def __post_init__(self) -> None:
        check_step(self, self.step)
