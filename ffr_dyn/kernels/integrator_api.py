"""All that an integrator needs of the engine.

A method is a file in `ffr_dyn.integrators`: a frozen dataclass with its settings (see `ffr_dyn.integrators.Integrator`) and
one compiled function, which does one step of the engine's state r.x, r.v from time t and returns a status:

    @method_step
    def euler_step(r: Tables, t: float, again: int) -> int:
        h, stages = r.clock.time[H], r.stages
        set_diagonal(r, 0.0)                                             # explicit: the true mass matrix
        status = stabilise(r, t, r.x, r.v)                               # right-hand sides, rows, factors at (t, x, v)
        if status != OK:
            return status
        acceleration_target(r.work.rows, r.clock.gains, stages.target)   # Phi_q v_dot = target
        solve(r, stages.target)                                          # M acc + Phi_q^T lam = f
        position_rates(r.model.bodies, r.x, r.v, stages.x[0])            # x_dot = T(x) v
        velocity_rates(r, stages.v[0])                                   # v_dot = acc, in global axes
        add_scaled(r.x, r.x, h, stages.x[0])
        add_scaled(r.v, r.v, h, stages.v[0])
        normalise(r.model.bodies, r.x)
        return finite(r.x, r.v)

The state is x = [R, p, q], v = [R_dot, omega_bar, q_dot] body by body; accelerations and right-hand sides are in body axes
(see `ffr_dyn.kernels.tables`). `r.stages` is the method's own memory: as many rows of x, v and constraint rows as its class
asks for, and its numbers. What an evaluation left stands in `r.work` until the next: `work.rows` Phi, nu, gamma and lam,
`work.bodies` the right-hand sides f and the accelerations acc. No function allocates; a step is compiled alone and calls the
engine by address (`ffr_dyn.kernels.entry_points`).

evaluate(r, t, x, v)            right-hand sides, rows and factors there; `stabilise` projects (x, v) first where it must
solve(r, target)                acc and lam, with the factors of the last evaluation
project(r, value)               acc: the smallest motion with Phi_q acc = -value
correct(r, r_v, target)         f += M r_v, target += Phi_q r_v
evaluate_rows_at(r, t, x, v)    constraint rows elsewhere, with the factors left as they are
set_diagonal(r, gamma_h)        the elastic diagonal of a linearly implicit method, and its part in stiff forces
begin_stages(r, gamma_h, h)     the same for a step of a linearly implicit method, whose later stages call `later_stage`
                                before they evaluate, and all `add_stiff_part` and `solve_stage` in place of `solve`

Twin: none, names of calls.
"""

from ffr_dyn.kernels.bodies import mass_times, normalise, position_rates
from ffr_dyn.kernels.entry_points import (
    correct,
    evaluate,
    evaluate_rows_at,
    follow_forces,
    project,
    pull_forces,
    set_diagonal,
    settle_damping,
    solve,
    stabilise,
)
from ffr_dyn.kernels.finite_motion import (
    carry,
    converging,
    farthest,
    into_body_axes,
    into_global_axes,
    largest_motion,
    unconverged,
)
from ffr_dyn.kernels.forces.applied import keep_measured
from ffr_dyn.kernels.options import inlined, kernel
from ffr_dyn.kernels.simd.entry_point import CompiledFunction
from ffr_dyn.kernels.simd.slices import part
from ffr_dyn.kernels.solution import add_reactions, constraint_rates
from ffr_dyn.kernels.step_control import interpolate
from ffr_dyn.kernels.system import (
    acceleration_target,
    finite,
    largest,
    note_drift,
    row_of_largest,
    to_body_axes,
    to_velocity_rates,
)
from ffr_dyn.kernels.tables import (
    AHEAD,
    BEFORE,
    BY_PLACE,
    BY_RATE,
    BY_TIME,
    FAILED,
    FRESH,
    HERE,
    IN_SHARED,
    IN_V,
    IN_X,
    NEAR,
    NORMAL,
    NOT_CONVERGED,
    NOT_FINITE,
    NOW,
    OK,
    PHI,
    PHI_DOT,
    RESTART,
    TIGHTER,
    TOLERANCE,
    USER_FAILED,
    WITHIN,
    H,
    N,
    Tables,
)
from ffr_dyn.kernels.vectors import (
    add,
    add_both,
    add_four,
    add_scaled,
    combine_three,
    copy,
    cross,
    dot,
    fill,
    get,
    multiple,
    scale,
    six_rows,
    subtract,
    three_rows,
    weigh_four,
)

__all__ = [
    "BEFORE",
    "FAILED",
    "HERE",
    "IN_SHARED",
    "IN_V",
    "IN_X",
    "NEAR",
    "NORMAL",
    "NOT_CONVERGED",
    "NOT_FINITE",
    "NOW",
    "OK",
    "PHI",
    "PHI_DOT",
    "RESTART",
    "TIGHTER",
    "TOLERANCE",
    "USER_FAILED",
    "WITHIN",
    "CompiledFunction",
    "H",
    "N",
    "Tables",
    "acceleration_target",
    "add",
    "add_both",
    "add_four",
    "add_reactions",
    "add_scaled",
    "add_stiff_part",
    "begin_stages",
    "carry",
    "combine_three",
    "constraint_rates",
    "converging",
    "copy",
    "correct",
    "cross",
    "dot",
    "evaluate",
    "evaluate_rows_at",
    "farthest",
    "fill",
    "finite",
    "get",
    "inlined",
    "interpolate",
    "into_body_axes",
    "into_global_axes",
    "keep_measured",
    "keep_rows",
    "kernel",
    "largest",
    "largest_motion",
    "later_stage",
    "mass_times",
    "method_step",
    "multiple",
    "normalise",
    "note_drift",
    "part",
    "position_rates",
    "project",
    "row_of_largest",
    "scale",
    "set_diagonal",
    "settle_damping",
    "six_rows",
    "solve",
    "solve_stage",
    "stabilise",
    "subtract",
    "three_rows",
    "to_body_axes",
    "to_velocity_rates",
    "unconverged",
    "velocity_rates",
    "weigh_forces",
    "weigh_four",
]  # fmt: skip

method_step = CompiledFunction  # the decorator of a method's step


@inlined
def keep_rows(r):
    """The Jacobian of an evaluation, to have it beside another: work.rows.kept with the shapes work.markers.kept."""
    rows, markers = r.work.rows, r.work.markers
    copy(part(rows.kept, 0, rows.kept.size), part(rows.jac, 0, rows.jac.size))
    copy(markers.kept, markers.phi)


@inlined
def velocity_rates(r, out):
    """out = v_dot of what was solved last."""
    to_velocity_rates(r.model.bodies.where, r.work.bodies.A, r.work.bodies.acc, out)


@inlined
def begin_stages(r, gh, h):
    """Set the left side of the stages of a linearly implicit step of length h: gamma h of the elastic forces
    and of stiff ones, whose slopes the first stage finds."""
    set_diagonal(r, gh)
    r.work.implicit[AHEAD], r.work.implicit[BY_TIME] = h, gh


@inlined
def later_stage(r, by_time):
    """One-sided forces keep the slopes of the stage before; by_time: gamma h (1 + r_t), r_t the correction of time's rate."""
    r.work.implicit[FRESH], r.work.implicit[BY_TIME] = 0.0, by_time


@inlined
def weigh_forces(r, by_rate, by_place):
    """Of a method of Newton's, after `set_diagonal`: what its accelerations do to rates and places at the end of a step."""
    r.work.implicit[BY_RATE], r.work.implicit[BY_PLACE] = by_rate, by_place


@inlined
def add_stiff_part(r, stage, v, r_x, gh, shares, factors):
    """Add to the right side of a stage, beside the forces: f -= gamma h Omega^2 (q_dot + r_q), and the targets of stiff
    forces, in whose coordinates are `shares` of what earlier stages made of them, and `factors` in their corrections."""
    bodies, f = r.model.bodies, r.work.bodies.f
    for b in range(bodies.mass.size):
        n, i, j, shared = bodies.where[b, N], bodies.where[b, IN_X], bodies.where[b, IN_V], bodies.where[b, IN_SHARED]
        for k in range(n):
            f[j + 6 + k] -= gh * bodies.omega2[shared + k] * (v[j + 6 + k] + r_x[i + 7 + k])
    if r.model.stiff_count > 0:
        s0, s1, s2 = shares
        g0, g1, g2 = factors
        pull_forces(r, stage, s0, s1, s2, g0, g1, g2, r.stages.target)


@inlined
def solve_stage(r, stage):
    """`solve` of a linearly implicit method. Stiff forces remember three stages."""
    solve(r, r.stages.target)
    if r.model.bodies.coupled_damping.size > 0:
        settle_damping(r, r.stages.target)
    if r.model.stiff_count > 0 and stage < 3:
        follow_forces(r, stage, r.stages.target)
