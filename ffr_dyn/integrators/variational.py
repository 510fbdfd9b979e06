"""A variational integrator on the Lie group with constraints at the nodes (RATTLE on R^3 x SO(3) x R^n).

The motion makes the discrete action  sum h L(x_m, v_m)  stationary, L = T - V at the middle of each step,

    x_m = x o exp(h/2 v_m),     x+ = x o exp(h v_m),     v_m = (R_dot, omega_bar, q_dot),     Phi(x+) = 0

(Marsden & West, Acta Numerica 10 (2001) 357-514, 1.5 and 3.5; Leyendecker, Marsden & Ortiz, ZAMM 88 (2008) 677-708; with
rotations Bou-Rabee & Marsden, Found. Comput. Math. 9 (2009) 197-219). With the momenta p = dL/dv and the forces F = dL/dx of
the middle, F of rotations taken with R_dot held, and theta = h omega_bar, the momenta of both ends are

    mu  = J^-1 p - h C F,        mu+ = J^-T p + h C^T F,
    J^-1 = c I + theta~/2 + (1 - c)/|theta|^2 theta theta^T,     c = |theta|/2 cot(|theta|/2),
    C = 1/2 (I + tan(|theta|/4)/|theta| theta~)      (rotations; J = I, C = 1/2 elsewhere),

and a step is  mu(v_m) = mu - h/2 Phi_q^T lambda  at x, with lambda such that Phi(x+) = 0; then v+ = M^-1 (mu+ - h/2 Phi_q^T
lambda') at x+, with lambda' such that Phi_q v+ + Phi_t = 0. Symmetric and symplectic, of order two: linear and angular
momentum that the scene conserves are conserved to rounding, the energy of a conservative scene has an error of h^2 that does
not grow. Applied forces that have no potential enter with F (the discrete principle of d'Alembert).

The equations are solved by Newton corrections with the elastic diagonal 1 + h^2/4 Omega^2 + h/2 2 zeta Omega, as
`ffr_dyn.integrators.generalised_alpha`.

Twin: the statement above, held by
`tests/ffr_dyn/integrators/test_integrators_implicit.py::test_the_variational_method_conserves_momenta_to_rounding`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from ffr_dyn.integrators.generalised_alpha import check_iterations
from ffr_dyn.integrators.step import check_step
from ffr_dyn.kernels.integrator_api import (
    IN_SHARED,
    IN_V,
    NORMAL,
    NOT_FINITE,
    OK,
    PHI,
    RESTART,
    USER_FAILED,
    CompiledFunction,
    H,
    N,
    Tables,
    add,
    add_reactions,
    add_scaled,
    carry,
    constraint_rates,
    converging,
    copy,
    cross,
    dot,
    evaluate,
    evaluate_rows_at,
    farthest,
    fill,
    finite,
    get,
    inlined,
    into_global_axes,
    keep_measured,
    keep_rows,
    kernel,
    largest,
    largest_motion,
    mass_times,
    method_step,
    normalise,
    part,
    scale,
    set_diagonal,
    six_rows,
    solve,
    stabilise,
    subtract,
    three_rows,
    to_body_axes,
    to_velocity_rates,
    unconverged,
    velocity_rates,
)

# Rows of stages.v. MU: momenta at the start of the step; MIDDLE: v_m; SHORT: what the momenta of the start are short of;
# END: momenta at the end; REACTION: Phi_q^T lambda at the start; CHANGE: scratch.
MU, MIDDLE, SHORT, END, REACTION, CHANGE = range(6)
HALF, WHOLE = range(2)  # rows of stages.x: x_m, x+
LAM = 0  # row of stages.rows: multipliers of the start
TOLERANCE, LIMIT, STARTED = range(3)
STUCK = 1e-6  # relative: where corrections no longer shrink below this, rounding is what is left of them
ROUNDING = 4e-16  # of positions, over the step: what rounding leaves of a velocity


@kernel
def in_body_plane(a, normal):
    """A vector of a planar body without what leaves the plane."""
    if normal < 0:
        return a
    return (0.0 if normal == 0 else a[0], 0.0 if normal == 1 else a[1], 0.0 if normal == 2 else a[2])


@kernel
def about_normal(a, normal):
    """A moment of a planar body without what does not turn it in the plane."""
    if normal < 0:
        return a
    return (a[0] if normal == 0 else 0.0, a[1] if normal == 1 else 0.0, a[2] if normal == 2 else 0.0)


@kernel
def lagrangian_forces(bodies, w, b, y, p, Q):
    """Q (6 + n,) = dL/dx and the applied forces of body b in body axes, from what `evaluate` left and p = M y.

    Of the right-hand sides of M acc = f these are what is left without the change of the mass matrix and of the frame:
    dL/dR = the applied force, dL/dtheta = the applied moment + p_1 x a, dL/dq_j = f_j + omega . l_j + I3_j . (a x omega).
    """
    n, j, normal, terms = bodies.where[b, N], bodies.where[b, IN_V], bodies.where[b, NORMAL], w.terms[b]
    f = part(w.f, j, 6 + n)
    a, omega, s = (y[0], y[1], y[2]), (y[3], y[4], y[5]), get(w.s, b)
    force = add((f[0], f[1], f[2]), cross(omega, cross(omega, s)))
    J = w.J[b]
    J_omega = (dot((J[0, 0], J[0, 1], J[0, 2]), omega), dot((J[1, 0], J[1, 1], J[1, 2]), omega),
               dot((J[2, 0], J[2, 1], J[2, 2]), omega))  # fmt: skip
    moment = add((f[3], f[4], f[5]), cross(omega, J_omega))
    if n > 0:
        P = part(bodies.P_dm, 3 * bodies.where[b, IN_SHARED], 3 * n)
        g, l = part(w.g, 9 * terms, 9 * n), part(w.l, 3 * terms, 3 * n)  # noqa: E741
        q_dot = part(y, 6, n)
        force = add(force, scale(2.0, cross(omega, three_rows(P, q_dot, n))))
        if normal >= 0:
            d0, d1, _ = three_rows(g, q_dot, n)
            moment = add(moment, scale(2.0 * (d0 + d1), omega))
        else:
            d0, d1, d2, d3, d4, d5 = six_rows(g, q_dot, n)
            D_omega = (
                d0 * omega[0] + d3 * omega[1] + d4 * omega[2],
                d3 * omega[0] + d1 * omega[1] + d5 * omega[2],
                d4 * omega[0] + d5 * omega[1] + d2 * omega[2],
            )
            moment = add(moment, scale(2.0, subtract(scale(d0 + d1 + d2, omega), D_omega)))
            moment = add(moment, cross(omega, three_rows(part(g, 6 * n, n), q_dot, n)))
        across = cross(a, omega)
        for k in range(n):
            Q[6 + k] = f[6 + k] + P[k] * across[0] + P[n + k] * across[1] + P[2 * n + k] * across[2]
            if normal >= 0:
                Q[6 + k] += omega[normal] * l[k]
            else:
                Q[6 + k] += omega[0] * l[k] + omega[1] * l[n + k] + omega[2] * l[2 * n + k]
    force = in_body_plane(force, normal)
    moment = about_normal(add(moment, cross((p[0], p[1], p[2]), a)), normal)
    for k in range(3):
        Q[k], Q[3 + k] = force[k], moment[k]


@kernel
def momentum(bodies, w, b, y, p):
    """p (6 + n,) = M y of body b in body axes."""
    normal = bodies.where[b, NORMAL]
    fill(p, 0.0)
    mass_times(bodies, w, b, y, p)
    force, moment = in_body_plane((p[0], p[1], p[2]), normal), about_normal((p[3], p[4], p[5]), normal)
    for k in range(3):
        p[k], p[3 + k] = force[k], moment[k]


@kernel
def transport(theta, p, F, h, side):
    """Momentum of rotation at the start (side 1) or the end (side -1) of a step."""
    square = dot(theta, theta)
    angle = square**0.5
    c, along, slope = 1.0 - square / 12.0, 1.0 / 12.0, 0.25
    if angle > 1e-3:
        c = 0.5 * angle / math.tan(0.5 * angle)
        along, slope = (1.0 - c) / square, math.tan(0.25 * angle) / angle
    turned = add(scale(c, p), add(scale(0.5 * side, cross(theta, p)), scale(along * dot(theta, p), theta)))
    return subtract(turned, scale(0.5 * h, add(scale(side, F), scale(slope, cross(theta, F)))))


@inlined
def end_momenta(r, h):
    """SHORT = mu - mu(v_m), END = mu+, shaped like v, from what `evaluate` left at x_m."""
    s, bodies, bw = r.stages, r.model.bodies, r.work.bodies
    y, p, Q = bw.acc, bw.more, s.v[CHANGE]
    copy(y, s.v[MIDDLE])
    to_body_axes(bodies.where, bw.A, y)
    for b in range(bodies.mass.size):
        n, j = bodies.where[b, N], bodies.where[b, IN_V]
        momentum(bodies, bw, b, part(y, j, 6 + n), part(p, j, 6 + n))
        lagrangian_forces(bodies, bw, b, part(y, j, 6 + n), part(p, j, 6 + n), part(Q, j, 6 + n))
        theta = (h * y[j + 3], h * y[j + 4], h * y[j + 5])
        pi, tau = (p[j + 3], p[j + 4], p[j + 5]), (Q[j + 3], Q[j + 4], Q[j + 5])
        before, after = transport(theta, pi, tau, h, 1.0), transport(theta, pi, tau, h, -1.0)
        for k in range(6 + n):
            s.v[SHORT, j + k] = p[j + k] - 0.5 * h * Q[j + k]
            s.v[END, j + k] = p[j + k] + 0.5 * h * Q[j + k]
        for k in range(3):
            s.v[SHORT, j + 3 + k], s.v[END, j + 3 + k] = before[k], after[k]
    to_velocity_rates(bodies.where, bw.A, s.v[SHORT], s.v[SHORT])
    to_velocity_rates(bodies.where, bw.A, s.v[END], s.v[END])
    for k in range(r.v.size):
        s.v[SHORT, k] = s.v[MU, k] - s.v[SHORT, k]


@inlined
def react_at_start(r):
    """REACTION = Phi_q^T lambda at the start of the step, shaped like v."""
    s, m, w = r.stages, r.model, r.work
    fill(s.v[REACTION], 0.0)
    add_reactions(m.bodies.where, m.markers, m.rows, w.rows.kept, w.markers.kept, s.rows[LAM], s.v[REACTION])
    into_global_axes(r.model.bodies, r.x, s.v[REACTION], r.work.loads.turn[0])


@inlined
def keep_node(r):
    """Keep what the next step needs of its start, from an evaluation there with the true mass matrix: momenta and rows."""
    s, bodies, bw = r.stages, r.model.bodies, r.work.bodies
    copy(bw.acc, r.v)
    to_body_axes(bodies.where, bw.A, bw.acc)
    for b in range(bodies.mass.size):
        n, j = bodies.where[b, N], bodies.where[b, IN_V]
        momentum(bodies, bw, b, part(bw.acc, j, 6 + n), part(s.v[MU], j, 6 + n))
    to_velocity_rates(bodies.where, bw.A, s.v[MU], s.v[MU])
    keep_rows(r)


@inlined
def close(r):
    """v+ from the momenta END and the constraints on velocities, by the factors of an evaluation at (x+, v_m)."""
    s, bodies, bw, rows = r.stages, r.model.bodies, r.work.bodies, r.work.rows
    copy(bw.acc, s.v[MIDDLE])
    to_body_axes(bodies.where, bw.A, bw.acc)
    constraint_rates(bodies.where, r.model.markers, r.model.rows, rows.jac, r.work.markers.phi, bw.acc, s.target)
    add_scaled(s.target, s.target, -1.0, rows.nu)
    copy(bw.f, s.v[END])
    to_body_axes(bodies.where, bw.A, bw.f)
    solve(r, s.target)
    velocity_rates(r, r.v)


@inlined
def begin(r, t):
    """Momenta and rows of the first node. Returns a status."""
    set_diagonal(r, 0.0)
    status = stabilise(r, t, r.x, r.v)
    if status == OK:
        keep_node(r)
        copy(r.stages.v[MIDDLE], r.v)
        r.stages.numbers[STARTED] = 1.0
    return status


@inlined
def move_by(r, h, x):
    """x = the start of the step moved by h v_m."""
    s = r.stages
    for k in range(r.v.size):
        s.v[CHANGE, k] = h * s.v[MIDDLE, k]
    carry(r.model.bodies, r.x, s.v[CHANGE], x)


@inlined
def newton(r, h):
    """One correction of v_m from an evaluation in the middle of the step. s.target: what Phi_q (2/h) correction must be."""
    s, bodies, bw = r.stages, r.model.bodies, r.work.bodies
    end_momenta(r, h)
    react_at_start(r)
    for k in range(r.v.size):
        bw.f[k] = 2.0 / h * s.v[SHORT, k] - s.v[REACTION, k]
    to_body_axes(bodies.where, bw.A, bw.f)
    add_reactions(bodies.where, r.model.markers, r.model.rows, r.work.rows.jac, r.work.markers.phi, s.rows[LAM], bw.f)
    solve(r, s.target)
    copy(s.rows[LAM], r.work.rows.lam)
    fill(bw.more, 0.0)
    for b in range(bodies.mass.size):  # the momenta at the end of what is corrected
        n, j, shared = bodies.where[b, N], bodies.where[b, IN_V], bodies.where[b, IN_SHARED]
        mass_times(bodies, bw, b, part(bw.acc, j, 6 + n), part(bw.more, j, 6 + n))
        for k in range(n):
            bw.more[j + 6 + k] -= (1.0 / bw.dinv[shared + k] - 1.0) * bw.acc[j + 6 + k]
    to_velocity_rates(bodies.where, bw.A, bw.more, bw.more)
    add_scaled(s.v[END], s.v[END], 0.5 * h, bw.more)
    velocity_rates(r, s.v[CHANGE])
    add_scaled(s.v[MIDDLE], s.v[MIDDLE], 0.5 * h, s.v[CHANGE])


@inlined
def iterate(r, t, h):
    """Newton corrections until they are small enough. Returns a status."""
    s, bodies, bw = r.stages, r.model.bodies, r.work.bodies
    before, worst, change = 0.0, 0, 0.0
    for attempt in range(int(s.numbers[LIMIT])):
        move_by(r, h, s.x[WHOLE])
        move_by(r, 0.5 * h, s.x[HALF])
        status = evaluate_rows_at(r, t + h, s.x[WHOLE], s.v[MIDDLE])
        if status != OK:
            return status
        for k in range(s.target.size):
            s.target[k] = -2.0 / (h * h) * r.work.rows.Phi[k]
        status = evaluate(r, t + 0.5 * h, s.x[HALF], s.v[MIDDLE])
        if status != OK:
            return status if attempt == 0 or status == USER_FAILED else unconverged(r, worst, h * before)
        newton(r, h)
        change, worst = largest_motion(bodies, bw.J, s.v[CHANGE])
        change *= 0.5 * h
        if finite(s.v[MIDDLE], s.v[END]) != OK:
            return NOT_FINITE if attempt == 0 else unconverged(r, worst, h * before)
        scale = largest_motion(bodies, bw.J, s.v[MIDDLE])[0]
        allowed = s.numbers[TOLERANCE] * scale + ROUNDING * farthest(bodies, s.x[WHOLE]) / h
        if converging(change, before, 1.0, allowed) or (change > 0.9 * before > 0.0 and change <= STUCK * scale):
            return OK
        before = change
    return unconverged(r, worst, h * change)


@method_step
def variational_step(r: Tables, t: float, again: int) -> int:
    """One step of the engine's state from time t. Returns a status."""
    h, s = r.clock.time[H], r.stages
    if s.numbers[STARTED] == 0.0 or again == RESTART:
        status = begin(r, t)
        if status != OK:
            return status
    set_diagonal(r, 0.5 * h)
    for k in range(r.v.size):
        s.v[MIDDLE, k] = 2.0 * r.v[k] - s.v[MIDDLE, k]
    status = iterate(r, t, h)
    if status != OK:
        return status
    move_by(r, h, s.x[WHOLE])
    copy(r.x, s.x[WHOLE])
    normalise(r.model.bodies, r.x)
    set_diagonal(r, 0.0)
    status = evaluate(r, t + h, r.x, s.v[MIDDLE])
    if status != OK:
        return status
    r.work.drift[PHI] = max(r.work.drift[PHI], largest(r.work.rows.Phi))
    keep_measured(r.work.loads)
    close(r)
    keep_node(r)
    return finite(r.x, r.v)


@dataclass(frozen=True)
class Variational:
    """Variational (symplectic, momentum-conserving) of order two, for long runs: the error of the energy does not grow.

    The constraints hold on positions and velocities.

    step       : time step [s]
    tolerance  : of the last correction of the velocities, relative [1]
    iterations : Newton corrections that a step may take

    Raises InputError for a step or a tolerance that is not positive, and for fewer than two corrections.

    >>> result = fd.forward(scene, end=1.0, output_step=0.01, method=fd.Variational(1e-3))
    """

    step: float
    tolerance: float = 1e-14
    iterations: int = 30
    order: ClassVar[int] = 2
    implicit: ClassVar[bool] = True
    takes_forces: ClassVar[bool] = False
    reach: ClassVar[float] = math.inf
    repeatable: ClassVar[bool] = False
    stage_count: ClassVar[int] = 6
    row_stages: ClassVar[int] = 1
    keeps_terms: ClassVar[bool] = True
    controlled: ClassVar[bool] = False
    do_step: ClassVar[CompiledFunction] = variational_step

    def __post_init__(self) -> None:
        check_step(self, self.step)
        check_iterations(self.tolerance, self.iterations)

    @property
    def numbers(self) -> tuple[float, ...]:
        return (self.tolerance, float(self.iterations), 0.0)
