"""Generalised-alpha on the Lie group, index 3 or stabilised index 2, and with it the method of Hilber, Hughes and Taylor.

Chung & Hulbert 1993; on the Lie group Bruls & Cardona, J. Comput. Nonlinear Dyn. 5 (2010) 031002; order, starting values
and the stabilised form Arnold, Bruls & Cardona, Numer. Math. 129 (2015) 149-179. With a+ and v_dot+ at the end of the step,

    (1 - alpha_m) a+ + alpha_m a = (1 - alpha_f) v_dot+ + alpha_f v_dot
    x+ = x o exp(h v + h^2 (1/2 - beta) a + h^2 beta a+),     v+ = v + h (1 - gamma) a + h gamma a+
    M v_dot+ = Q(x+, v+) - Phi_q^T lambda+,                   Phi(x+) = 0,

x o exp in R^3 x S^3 x R^n. Each Newton correction D of v_dot+ solves, with s = (1 - alpha_f)/(1 - alpha_m),

    (M + diag_ff(s beta h^2 Omega^2 + s gamma h 2 zeta Omega)) D + Phi_q^T lambda+ = Q - M v_dot+,
    Phi_q D = -Phi/(s beta h^2),

which is the block elimination of an explicit evaluation: gyroscopic terms, curvature of the constraints and applied forces
are left out of the iteration matrix, and cost iterations where the step is not small for them. Both unknowns are
accelerations times h^2 after the scaling of Bottasso, Bauchau & Cardona (J. Comput. Nonlinear Dyn. 2 (2007) 309-318): since
lambda is eliminated first and corrections are judged as motions, no power of h remains in what must converge to rounding.

The stabilised form (Gear, Gupta & Leimkuhler 1985) determines lambda+ from the constraints on velocities, Phi_q v+ + Phi_t
= 0, and moves x+ onto Phi = 0 by the smallest motion M^-1 Phi_q^T eta: then both hold.

Twin: the statement above, held by
`tests/ffr_dyn/integrators/test_integrators_implicit.py::test_motion_rates_and_reactions_converge_at_the_order`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from ffr_dyn.integrators.step import check_step
from ffr_dyn.kernels.integrator_api import (
    IN_V,
    NOT_FINITE,
    OK,
    PHI,
    PHI_DOT,
    RESTART,
    USER_FAILED,
    CompiledFunction,
    H,
    Tables,
    add_scaled,
    carry,
    converging,
    copy,
    correct,
    evaluate,
    farthest,
    fill,
    finite,
    inlined,
    keep_measured,
    largest,
    largest_motion,
    method_step,
    normalise,
    position_rates,
    project,
    set_diagonal,
    settle_damping,
    solve,
    stabilise,
    unconverged,
    velocity_rates,
    weigh_forces,
)
from ffr_prep.common.errors import InputError

# Rows of stages.v: accelerations now, before, and in the making; the method's own a now and in the making; v in the making;
# the step's motion; corrections.
NOW, BEFORE, NEXT, A_NOW, A_NEXT, V, MOTION, SHIFT, CORRECTION = range(9)
# stages.numbers
ALPHA_M, ALPHA_F, BETA, GAMMA, TOLERANCE, LIMIT, STABILISED, SCALED, STARTED, RATE = range(10)
# Rows of stages.rows: multipliers before the last correction, and corrections of the position.
LAM, ETA = range(2)
# Of positions, over the step, and of the accelerations by all forces together, times it: what rounding leaves of a velocity,
# of a scene at rest too.
ROUNDING = 4e-15


@inlined
def start(r, t, lag, square, single):
    """Accelerations at the start, and a = v_dot(t + lag): what makes the method of second order from its first step.

    The change from one to the other is that of an explicit step, which what is stiff makes far too large: so it is what the
    matrix of the iteration leaves of it.
    """
    s, bodies = r.stages, r.model.bodies
    set_diagonal(r, 0.0)
    status = stabilise(r, t, r.x, r.v)
    for attempt in range(2):
        if status == OK:
            copy(s.target, r.work.rows.gamma)
            solve(r, s.target)
            velocity_rates(r, s.v[NOW if attempt == 0 else A_NOW])
        if status == OK and attempt == 0:
            position_rates(bodies, r.x, r.v, s.x[1])
            add_scaled(s.x[0], r.x, lag, s.x[1])
            add_scaled(s.v[V], r.v, lag, s.v[NOW])
            normalise(bodies, s.x[0])
            status = evaluate(r, t + lag, s.x[0], s.v[V])
    set_factors(r, square, single)
    if status == OK:
        status = evaluate(r, t + lag, s.x[0], s.v[V])
    if status == OK:
        add_scaled(s.v[CORRECTION], s.v[A_NOW], -1.0, s.v[NOW])
        fill(r.work.bodies.f, 0.0)
        fill(s.target, 0.0)
        correct(r, s.v[CORRECTION], s.target)
        solve_damped(r)
        velocity_rates(r, s.v[CORRECTION])
        add_scaled(s.v[A_NOW], s.v[NOW], 1.0, s.v[CORRECTION])
    copy(s.v[BEFORE], s.v[NOW])
    s.numbers[STARTED] = 1.0
    return status


@inlined
def set_factors(r, square, single):
    """Set the implicit part of the matrix of the iteration."""
    set_diagonal(r, square**0.5)  # in which the elastic damping is right to a few per cent
    weigh_forces(r, single, square)


@inlined
def solve_damped(r):
    """`solve` with all of a damping matrix that couples coordinates: its diagonal alone would not do where it is heavy."""
    solve(r, r.stages.target)
    if r.model.bodies.coupled_damping.size > 0:
        settle_damping(r, r.stages.target)


@inlined
def advance(r, h):
    """a, v and x at the end of the step that go with the accelerations s.v[NEXT]."""
    s, number = r.stages, r.stages.numbers
    alpha_m, alpha_f, beta, gamma = number[ALPHA_M], number[ALPHA_F], number[BETA], number[GAMMA]
    now, following, a, a_next, v, motion = s.v[NOW], s.v[NEXT], s.v[A_NOW], s.v[A_NEXT], s.v[V], s.v[MOTION]
    for k in range(r.v.size):
        a_next[k] = ((1.0 - alpha_f) * following[k] + alpha_f * now[k] - alpha_m * a[k]) / (1.0 - alpha_m)
        v[k] = r.v[k] + h * ((1.0 - gamma) * a[k] + gamma * a_next[k])
        motion[k] = h * (r.v[k] + h * ((0.5 - beta) * a[k] + beta * a_next[k])) + s.v[SHIFT, k]
    carry(r.model.bodies, r.x, motion, s.x[0])


@inlined
def newton(r, h, square, single):
    """One correction of s.v[NEXT] (and, stabilised, of s.v[SHIFT]) at an evaluated state; square = s beta h^2, single =
    s gamma h."""
    s, rows = r.stages, r.work.rows
    fill(s.v[CORRECTION], 0.0)
    add_scaled(s.v[CORRECTION], s.v[CORRECTION], -1.0, s.v[NEXT])
    correct(r, s.v[CORRECTION], s.target)
    stabilised = s.numbers[STABILISED] > 0.0
    for k in range(s.target.size):
        s.target[k] = -rows.nu[k] / single if stabilised else -rows.Phi[k] / square
    solve_damped(r)
    velocity_rates(r, s.v[CORRECTION])
    add_scaled(s.v[NEXT], s.v[NEXT], 1.0, s.v[CORRECTION])
    if stabilised:
        copy(s.rows[ETA], rows.lam)
        for k in range(s.target.size):
            s.target[k] = rows.Phi[k] + square * s.target[k]
        project(r, s.target)
        velocity_rates(r, s.v[MOTION])
        add_scaled(s.v[SHIFT], s.v[SHIFT], 1.0, s.v[MOTION])
        add_scaled(s.v[CORRECTION], s.v[CORRECTION], 1.0 / square, s.v[MOTION])
        copy(rows.lam, s.rows[ETA])


@inlined
def farthest_marker(positions):
    """The largest coordinate of a marker [m]."""
    result = 0.0
    for k in range(positions.shape[0]):
        for c in range(3):
            result = max(result, abs(positions[k, c]))
    return result


@inlined
def largest_push(bodies, work):
    """[m/s^2] the largest acceleration that all forces but those of joints give a body, a moment at its radius of inertia."""
    result = 0.0
    for b in range(bodies.mass.size):
        j, by_mass, by_inertia = bodies.where[b, IN_V], work.inverse[b, 0], work.inverse[b, 1]
        for c in range(3):
            result = max(result, abs(work.f[j + c]) * by_mass, abs(work.f[j + 3 + c]) * (by_mass * by_inertia) ** 0.5)
    return result


@inlined
def size_of(r, h, single):
    """(size of the last correction, what is allowed, worst body): velocities [m/s], or unscaled accelerations and
    multipliers."""
    s, bodies, J = r.stages, r.model.bodies, r.work.bodies.J
    change, worst = largest_motion(bodies, J, s.v[CORRECTION])
    acceleration = largest_motion(bodies, J, s.v[NEXT])[0]
    if s.numbers[SCALED] > 0.0:
        scale = largest_motion(bodies, J, s.v[V])[0] + h * acceleration
        far = max(farthest(bodies, s.x[0]), farthest_marker(r.work.markers.r))
        rounding = ROUNDING * (far / h + single * largest_push(bodies, r.work.bodies))
        return single * change, s.numbers[TOLERANCE] * scale + rounding, worst
    add_scaled(s.rows[LAM], s.rows[LAM], -1.0, r.work.rows.lam)
    scale = max(acceleration, largest(r.work.rows.lam))
    return max(change, largest(s.rows[LAM])), s.numbers[TOLERANCE] * scale, worst


@inlined
def iterate(r, t, h, square, single):
    """Newton corrections until they are small enough. Returns a status."""
    s, number = r.stages, r.stages.numbers
    before, change, worst, converged = 0.0, 0.0, 0, False
    rate = number[RATE] ** 0.8  # what the last step knew is worth less in this one
    for attempt in range(int(number[LIMIT])):
        status = evaluate(r, t + h, s.x[0], s.v[V])
        if status != OK:
            return status if attempt == 0 or status == USER_FAILED else unconverged(r, worst, 0.0)
        copy(s.rows[LAM], r.work.rows.lam)
        newton(r, h, square, single)
        advance(r, h)
        change, allowed, worst = size_of(r, h, single)
        if finite(s.x[0], s.v[V]) != OK:
            return NOT_FINITE if attempt == 0 else unconverged(r, worst, 0.0)
        converged = converging(change, before, rate, allowed)
        if before > 0.0:
            rate = change / before
        before = change
        if converged:
            break
    number[RATE] = min(rate, 1.0)
    return OK if converged else unconverged(r, worst, h * change)


@method_step
def generalised_alpha_step(r: Tables, t: float, again: int) -> int:
    """One step of the engine's state from time t. Returns a status."""
    h, s, bodies, number = r.clock.time[H], r.stages, r.model.bodies, r.stages.numbers
    share = (1.0 - number[ALPHA_F]) / (1.0 - number[ALPHA_M])
    square, single = share * number[BETA] * h * h, share * number[GAMMA] * h
    if number[STARTED] == 0.0 or again == RESTART:
        status = start(r, t, (number[ALPHA_M] - number[ALPHA_F]) * h, square, single)
        if status != OK:
            return status
    set_factors(r, square, single)
    add_scaled(s.v[NEXT], s.v[NOW], -1.0, s.v[BEFORE])
    add_scaled(s.v[NEXT], s.v[NEXT], 1.0, s.v[NOW])
    fill(s.v[SHIFT], 0.0)
    advance(r, h)
    status = iterate(r, t, h, square, single)
    if status != OK:
        return status
    keep_measured(r.work.loads)
    r.work.drift[PHI] = max(r.work.drift[PHI], largest(r.work.rows.Phi))
    r.work.drift[PHI_DOT] = max(r.work.drift[PHI_DOT], largest(r.work.rows.nu))
    copy(s.v[BEFORE], s.v[NOW])
    copy(s.v[NOW], s.v[NEXT])
    copy(s.v[A_NOW], s.v[A_NEXT])
    copy(r.x, s.x[0])
    copy(r.v, s.v[V])
    normalise(bodies, r.x)
    return OK


@dataclass(frozen=True)
class GeneralisedAlpha:
    """Generalised-alpha: order two, implicit in everything, the constraints on positions exact.

    step            : time step [s]
    spectral_radius : [1] what is left after a step of a mode that the step does not resolve, 0 ... 1; near 1, index 3 is
                      weakly unstable: reactions oscillate and grow in long runs
    form            : "index 3", or "stabilised" (Gear, Gupta & Leimkuhler): the constraints on velocities exact too
    tolerance       : of the last correction of the velocities, relative [1]
    iterations      : Newton corrections that a step may take
    scaled          : judge corrections as motions. Otherwise as accelerations and multipliers, which is how index 3 is lost
                      at small steps: their rounding errors grow as 1/h^2

    Raises InputError for a spectral radius outside [0, 1], and another form.

    >>> result = fd.forward(scene, end=1.0, output_step=0.01, method=fd.GeneralisedAlpha(1e-3, spectral_radius=0.6))
    """

    step: float
    spectral_radius: float = 0.8
    form: str = "index 3"
    tolerance: float = 1e-8
    iterations: int = 20
    scaled: bool = True
    order: ClassVar[int] = 2
    implicit: ClassVar[bool] = True
    takes_forces: ClassVar[bool] = True
    reach: ClassVar[float] = math.inf
    repeatable: ClassVar[bool] = False
    stage_count: ClassVar[int] = 9
    row_stages: ClassVar[int] = 2
    keeps_terms: ClassVar[bool] = False
    controlled: ClassVar[bool] = False
    do_step: ClassVar[CompiledFunction] = generalised_alpha_step

    def __post_init__(self) -> None:
        check_step(self, self.step)
        if not 0.0 <= self.spectral_radius <= 1.0:
            raise InputError(f"spectral_radius must be from 0 to 1; it is {self.spectral_radius}")
        if self.form not in ("index 3", "stabilised"):
            raise InputError(f"form must be 'index 3' or 'stabilised'; it is {self.form!r}")
        check_iterations(self.tolerance, self.iterations)

    @property
    def numbers(self) -> tuple[float, ...]:
        rho = self.spectral_radius
        alpha_m, alpha_f = (2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0)
        return newmark(alpha_m, alpha_f, self.tolerance, self.iterations, self.form == "stabilised", self.scaled)


@dataclass(frozen=True)
class HHT:
    """Hilber, Hughes & Taylor 1977: order two, implicit in everything, the constraints on positions exact.

    step  : time step [s]
    alpha : numerical damping of what the step does not resolve, 0 (none: the trapezoidal rule) ... 1/3
    form, tolerance, iterations : as of `GeneralisedAlpha`

    Raises InputError for alpha outside [0, 1/3], and another form.

    >>> result = fd.forward(scene, end=1.0, output_step=0.01, method=fd.HHT(1e-3, alpha=0.05))
    """

    step: float
    alpha: float = 0.1
    form: str = "index 3"
    tolerance: float = 1e-8
    iterations: int = 20
    order: ClassVar[int] = 2
    implicit: ClassVar[bool] = True
    takes_forces: ClassVar[bool] = True
    reach: ClassVar[float] = math.inf
    repeatable: ClassVar[bool] = False
    stage_count: ClassVar[int] = 9
    row_stages: ClassVar[int] = 2
    keeps_terms: ClassVar[bool] = False
    controlled: ClassVar[bool] = False
    do_step: ClassVar[CompiledFunction] = generalised_alpha_step

    def __post_init__(self) -> None:
        check_step(self, self.step)
        if not 0.0 <= self.alpha <= 1.0 / 3.0:
            raise InputError(f"alpha must be from 0 to 1/3; it is {self.alpha}")
        if self.form not in ("index 3", "stabilised"):
            raise InputError(f"form must be 'index 3' or 'stabilised'; it is {self.form!r}")
        check_iterations(self.tolerance, self.iterations)

    @property
    def numbers(self) -> tuple[float, ...]:
        return newmark(0.0, self.alpha, self.tolerance, self.iterations, self.form == "stabilised", True)


def check_iterations(tolerance: float, iterations: int) -> None:
    """Raises InputError."""
    if not 0.0 < tolerance < 1.0:
        raise InputError(f"tolerance must be above 0 and below 1; it is {tolerance}")
    if iterations < 2:
        raise InputError(
            f"iterations must be at least 2, since the first tells nothing of the second; it is {iterations}"
        )


def newmark(
    alpha_m: float, alpha_f: float, tolerance: float, iterations: int, stabilised: bool, scaled: bool
) -> tuple[float, ...]:
    """The numbers in stages.numbers; gamma for order two, beta for the most damping (Chung & Hulbert 1993)."""
    gamma = 0.5 + alpha_f - alpha_m
    beta = 0.25 * (gamma + 0.5) ** 2
    settings = (alpha_m, alpha_f, beta, gamma, tolerance, iterations, stabilised, scaled)
    return (*(float(number) for number in settings), 0.0, 1.0)
