"""The entry points of the engine: its list of contents, from what one evaluation takes to the steps of a run.

Each is compiled alone and called by address, `name(r, ...)` with the tables r, so that nothing is compiled twice and an
integrator costs no more than its own few lines (see `ffr_dyn.kernels.simd.entry_point`). All return a status, OK unless it
says otherwise; where something failed `work.info[FAILED]` says where. Those that take long to compile come first.

Twin: `ffr_dyn.equations.motion.equations_of_motion`.
"""

import numpy as np

from ffr_dyn.kernels.bodies import add_product, mass_times, normalise, reduce_forces
from ffr_dyn.kernels.forces.applied import apply_loads, call_user, count_loads, gravity_field, keep_measured, power
from ffr_dyn.kernels.forces.implicit import add_to_joints, keep_growth, set_targets, subtract_yield
from ffr_dyn.kernels.forces.kinks import measure_kinks, step_to_kinks
from ffr_dyn.kernels.functions import evaluate_functions, search_break
from ffr_dyn.kernels.options import inlined
from ffr_dyn.kernels.output_row import keep
from ffr_dyn.kernels.rows import evaluate_block
from ffr_dyn.kernels.simd.entry_point import entry_point
from ffr_dyn.kernels.simd.slices import part, vector_at
from ffr_dyn.kernels.singular_positions import keep_closest, note_independence, numbered_step
from ffr_dyn.kernels.solution import (
    constraint_rates,
    gather_rows,
    react,
    reduce_miss,
    reduced_rates,
    solve_back,
)
from ffr_dyn.kernels.step_control import (
    look_anywhere,
    look_at_row,
    step_in_pieces,
    step_to_break,
)
from ffr_dyn.kernels.system import (
    apply_motion,
    evaluate_joints,
    factorise_bodies,
    largest,
    note_drift,
    prepare,
    row_of_largest,
    to_body_axes,
    to_velocity_rates,
    turn_bodies,
    update_markers,
)
from ffr_dyn.kernels.tables import (
    ALL,
    AT,
    BY_PLACE,
    BY_RATE,
    BY_TIME,
    EVALUATIONS,
    EVERY_LOAD,
    FAILED,
    FILLED,
    FRESH,
    FROM,
    HERE,
    IN_DAMPING,
    IN_USE,
    IN_V,
    NEAR,
    NEXT,
    NOT_CONVERGED,
    NOW,
    OF_JOINTS,
    OK,
    PASSED,
    PER_ROW,
    PHI,
    PHI_DOT,
    PROJECTIONS,
    SINGULAR_BODY,
    SINGULAR_CONSTRAINT,
    SPACING,
    TIGHTER,
    TOLERANCE,
    UP_TO,
    USER_FAILED,
    WITHIN,
    Model,
    N,
    Record,
    Tables,
    Vector,
)
from ffr_dyn.kernels.vectors import add_scaled, copy, fill, product

PASSES = 1000  # at most, where rows depend on one another, beyond which their reactions are not known
UNMOVED = 1e-15  # of accelerations, what the last pass changes
ENOUGH = 1e-22  # of the square of what is left, where the last pass ends
CONTRADICTED = 1e-9  # of what is left with what rows contradict one another by, below which it is rounding of that
GROSS = 1.0  # m, -: of a violation that no projection puts right
SETTLING, SETTLED = 60, 1e-11  # iterations with a damping matrix, and the relative change at which they end
UNMET = 1e3  # tolerances, beyond which a violation that the projection does not take back is no drift


def has_loads(model: Model) -> bool:
    return bool(count_loads.py_func(model.loads) > 0)


def has_kinks(model: Model) -> bool:
    return model.loads.kinked.size > 0


def has_dependent_rows(model: Model) -> bool:
    return model.relaxation > 0.0


def has_coupled_damping(model: Model) -> bool:
    return model.bodies.coupled_damping.size > 0


def has_stiff_forces(model: Model) -> bool:
    return model.stiff_count > 0


def by_method(model: Model) -> bool:
    """It is the method that tells whether the function is needed, not the scene."""
    return False


# ---- one evaluation: right-hand sides, constraint rows, factors ----------------------------------------------------------


@inlined
def evaluate_time(r, t, x, v):
    """Functions of time, and those in Python, at t. Returns whether they have values."""
    seen = min(max(t, r.clock.time[FROM]), r.clock.time[UP_TO])
    if not call_user(r.model.user_address, seen, x, v, r.work.user):
        return False
    evaluate_functions(r.model.functions, r.work.user, seen, r.work.functions)
    return True


@entry_point()
def evaluate_bodies(r: Tables, t: float, x: Vector, v: Vector) -> int:
    """Functions of time, then inertia, forces and factors of all bodies at (t, x, v)."""
    m, w, x, v = r.model, r.work, vector_at(x, r.x.size), vector_at(v, r.v.size)
    w.info[EVALUATIONS] += 1
    if not evaluate_time(r, t, x, v):
        return USER_FAILED
    gravity_field(m.gravity, m.base, w.functions, w.field)
    failed = factorise_bodies(w.field, m.bodies, w.bodies, x, v)
    if failed >= 0:
        w.info[FAILED] = failed
        return SINGULAR_BODY
    return OK


@entry_point()
def factorise_joints(r: Tables, t: float) -> int:
    """Factors of the multiplier matrix, from the constraint rows and the factors of the bodies."""
    failed = evaluate_joints(r.model, r.work)
    if failed >= 0:
        r.work.info[FAILED] = failed
        return SINGULAR_CONSTRAINT
    note_independence(r.work.independence, t)
    return OK


@entry_point()
def evaluate_markers(r: Tables, which: int, x: Vector, v: Vector) -> int:
    """Markers IN_USE, OF_JOINTS, or ALL, at (x, v), from the rotations of the bodies."""
    update_markers(r.model, r.work, which, vector_at(x, r.x.size), vector_at(v, r.v.size))
    return OK


@entry_point(has_loads)
def add_loads(r: Tables, x: Vector, number: int) -> int:
    """Applied loads at x onto the right-hand sides: EVERY_LOAD, or one by its number alone into the scratch of the powers."""
    f, first, last = r.work.bodies.f, 0, count_loads(r.model.loads)
    if number != EVERY_LOAD:
        f, first, last = r.work.loads.f, number, number + 1
    apply_loads(r, x, f, first, last)
    return OK


@inlined
def load_all(r, x):
    """All applied loads at x."""
    if count_loads(r.model.loads) > 0:
        add_loads(r, x, EVERY_LOAD)


@entry_point()
def constraint_rows(r: Tables) -> int:
    """Phi, nu, gamma and the Jacobian of all constraint rows, from the markers of the joints."""
    for k in range(r.model.rows.marker.shape[0]):
        evaluate_block(r.model.rows, r.work.functions, r.work.markers, r.work.rows, k)
    return OK


@entry_point()
def evaluate(r: Tables, t: float, x: Vector, v: Vector) -> int:
    """Right-hand sides, constraint rows and factors at (t, x, v): all that solutions there need."""
    status = evaluate_bodies(r, t, x, v)
    if status != OK:
        return status
    evaluate_markers(r, IN_USE, x, v)
    load_all(r, x)
    constraint_rows(r)
    passed = r.work.independence[PASSED]
    status = factorise_joints(r, t)
    keep_closest(r.work.independence, r.work.passed, passed, t, vector_at(x, r.x.size))
    return status


@entry_point()
def evaluate_rows(r: Tables, x: Vector, v: Vector) -> int:
    """Constraint rows at (x, v) at the time of the last evaluation, whose factors stay; its markers do not."""
    turn_bodies(r.model.bodies.where, r.work.bodies, vector_at(x, r.x.size), vector_at(v, r.v.size))
    evaluate_markers(r, OF_JOINTS, x, v)
    return constraint_rows(r)


@entry_point()
def evaluate_rows_at(r: Tables, t: float, x: Vector, v: Vector) -> int:
    """`evaluate_rows` at another time."""
    if not evaluate_time(r, t, vector_at(x, r.x.size), vector_at(v, r.v.size)):
        return USER_FAILED
    return evaluate_rows(r, x, v)


@entry_point()
def evaluate_loads(r: Tables, t: float, x: Vector, v: Vector) -> int:
    """Right-hand sides (V,), body axes, of the applied loads alone at (t, x, v)."""
    m, w = r.model, r.work
    xs, vs = vector_at(x, r.x.size), vector_at(v, r.v.size)
    if not evaluate_time(r, t, xs, vs):
        return USER_FAILED
    turn_bodies(m.bodies.where, w.bodies, xs, vs)
    evaluate_markers(r, IN_USE, x, v)
    fill(w.bodies.f, 0.0)
    load_all(r, x)
    return OK


# ---- solutions with the factors of the last evaluation -------------------------------------------------------------------


@entry_point()
def set_diagonal(r: Tables, gamma_h: float) -> int:
    """The elastic diagonal 1 + (gamma h)^2 Omega^2 + gamma h 2 zeta Omega of a linearly implicit method, and the same for
    stiff forces; 0: explicit."""
    implicit = r.work.implicit
    implicit[BY_RATE], implicit[BY_PLACE], implicit[FRESH], implicit[BY_TIME] = gamma_h, gamma_h * gamma_h, 1.0, 0.0
    if r.work.diagonal[0] == gamma_h:
        return OK
    r.work.diagonal[0] = gamma_h
    bodies, dinv = r.model.bodies, r.work.bodies.dinv
    for k in range(dinv.size):
        dinv[k] = 1.0 / (1.0 + gamma_h * gamma_h * bodies.omega2[k] + gamma_h * bodies.two_zeta_omega[k])
    prepare(bodies, r.model.markers, r.model.rows, r.model.pattern, r.work.bodies, r.work.markers, r.work.rows)
    return OK


@entry_point()
def back_substitute(r: Tables) -> int:
    """Multipliers and motion of reduced forces."""
    m, w = r.model, r.work
    solve_back(m.bodies, m.markers, m.rows, m.pattern, w.bodies, w.markers.phi, w.rows)
    return OK


@inlined
def solve_once(r, target):
    """`solve` as far as elimination without pivoting goes."""
    m, bw, rw = r.model, r.work.bodies, r.work.rows
    for b in range(m.bodies.mass.size):
        reduce_forces(m.bodies, bw, b)
    reduced_rates(m.bodies, m.markers, m.rows, bw, r.work.markers.phi, rw, target)
    back_substitute(r)
    gather_rows(m.rows.start, rw.step, rw.lam)


@entry_point()
def solve(r: Tables, target: Vector) -> int:
    """acc, lam from  M acc + Phi_q^T lam = f,  Phi_q acc = target (C,)."""
    solve_once(r, vector_at(target, r.stages.target.size))
    return OK


@entry_point()
def project(r: Tables, value: Vector) -> int:
    """acc: the motion, smallest in the norm of the mass matrix, with Phi_q acc = -value (C,); and its multipliers."""
    reduce_miss(r.model.rows, r.work.bodies, r.work.rows.step, vector_at(value, r.stages.target.size))
    return back_substitute(r)


@inlined
def miss(r, acc, lam, out):
    """out (C,) = Phi_q acc less what stiff forces yield to lam (C,)."""
    rw = r.work.rows
    constraint_rates(r.model.bodies.where, r.model.markers, r.model.rows, rw.jac, r.work.markers.phi, acc, out)
    subtract_yield(r.model.rows, rw, lam, out)


@inlined
def refine(r, target):
    """Take out again what relaxation of the multiplier matrix S does to a solution: conjugate residuals of S lam = b, which
    the relaxed matrix preconditions (Saad 2003, 6.8). Each pass takes out one direction in which S is less than the
    relaxation, of which a long row of links has some. What rows contradict one another by has no part in them. Multipliers
    that are not found are not a number.
    """
    bw, rw, starts = r.work.bodies, r.work.rows, r.model.rows.start
    z, z_rate, way, way_rate, q = rw.search[0], rw.search[1], rw.search[2], rw.search[3], rw.search[4]
    z_acc, way_acc = bw.search[0], bw.search[1]
    miss(r, bw.acc, rw.lam, rw.left)
    add_scaled(rw.left, rw.left, -1.0, target)
    copy(bw.more, bw.acc)
    project(r, rw.left)
    gather_rows(starts, rw.step, z)
    copy(z_acc, bw.acc)
    miss(r, z_acc, z, z_rate)  # -S z
    copy(way, z)
    copy(way_acc, z_acc)
    copy(way_rate, z_rate)
    above = -product(z, z_rate)
    enough = ENOUGH * above
    for _ in range(PASSES):
        project(r, way_rate)
        gather_rows(starts, rw.step, q)
        below = product(way_rate, q)
        if not (above > max(enough, CONTRADICTED * product(rw.left, z)) and below > 0.0):
            break
        share = above / below
        add_scaled(rw.lam, rw.lam, share, way)
        add_scaled(bw.more, bw.more, share, way_acc)
        if share * largest(way_acc) <= UNMOVED * largest(bw.more):
            break
        add_scaled(rw.left, rw.left, share, way_rate)
        add_scaled(z, z, share, q)
        add_scaled(z_acc, z_acc, share, bw.acc)
        miss(r, z_acc, z, z_rate)
        before, above = above, -product(z, z_rate)
        add_scaled(way, z, above / before, way)
        add_scaled(way_acc, z_acc, above / before, way_acc)
        add_scaled(way_rate, z_rate, above / before, way_rate)
    else:
        fill(rw.lam, np.nan)
    copy(bw.acc, bw.more)


@solve.where(has_dependent_rows)
def solve_of_dependent_rows(r: Tables, target: Vector) -> int:
    """Where rows depend on one another: of the multipliers that give acc, those with the smallest sum of lam_k^T S_kk lam_k
    over the joints k.

    What rows contradict one another by, as after a drift within the tolerance, has grown by the inverse of the relaxation in
    the combinations that do nothing. So the system is solved once more for the accelerations of the reactions, which have
    none of it.
    """
    m, bw, rw = r.model, r.work.bodies, r.work.rows
    wanted = vector_at(target, r.stages.target.size)
    solve_once(r, wanted)
    refine(r, wanted)
    copy(bw.solved, bw.acc)
    reduce_miss(m.rows, bw, rw.step, rw.lam)
    react(m.bodies, m.markers, m.rows, bw, r.work.markers.phi, rw)
    constraint_rates(m.bodies.where, m.markers, m.rows, rw.jac, r.work.markers.phi, bw.acc, rw.reacted)
    add_scaled(rw.left, rw.reacted, -2.0, rw.reacted)
    project(r, rw.left)
    gather_rows(m.rows.start, rw.step, rw.lam)
    refine(r, rw.reacted)
    copy(bw.acc, bw.solved)
    return OK


@entry_point(has_coupled_damping)
def settle_damping(r: Tables, target: Vector) -> int:
    """`solve` again until the left side has gamma h D of the damping matrix in place of the diagonal that dominates it.

    The diagonal less the matrix is positive and less than what is on the left side, so that the iteration converges, the
    faster the better the step resolves the damping; f has the last correction afterwards.
    """
    bodies, bw, gh = r.model.bodies, r.work.bodies, r.work.diagonal[0]
    fill(bw.settled, 0.0)
    for _ in range(SETTLING):
        change, size = 0.0, 0.0
        for b in range(bodies.mass.size):
            n, j, start = bodies.where[b, N], bodies.where[b, IN_V] + 6, bodies.where[b, IN_DAMPING]
            if start < 0:
                continue
            for k in range(j, j + n):
                step = bw.acc[k] - bw.settled[k]
                change, size = max(change, abs(step)), max(size, abs(bw.acc[k]))
                bw.settled[k] = step
            add_product(bodies.coupled_damping, start, gh, part(bw.settled, j, n), part(bw.f, j, n))
            copy(part(bw.settled, j, n), part(bw.acc, j, n))
        if change <= SETTLED * size:
            break
        solve(r, target)
    return OK


@entry_point()
def correct(r: Tables, r_v: Vector, target: Vector) -> int:
    """f += M r_v, target += Phi_q r_v of the constraint rows, for the corrections of a stage; r_v (V,).

    The rates of all rows stay in `RowWork.left`.
    """
    bodies, bw, rw = r.model.bodies, r.work.bodies, r.work.rows
    correction, wanted = vector_at(r_v, r.v.size), vector_at(target, r.stages.target.size)
    copy(bw.acc, correction)
    to_body_axes(bodies.where, bw.A, bw.acc)
    constraint_rates(bodies.where, r.model.markers, r.model.rows, rw.jac, r.work.markers.phi, bw.acc, rw.left)
    add_to_joints(r.model.rows, wanted, rw.left)
    for b in range(bodies.mass.size):
        j, size = bodies.where[b, IN_V], 6 + bodies.where[b, N]
        mass_times(bodies, bw, b, part(bw.acc, j, size), part(bw.f, j, size))
    return OK


@entry_point(has_stiff_forces)
def pull_forces(
    r: Tables, stage: int, s0: float, s1: float, s2: float, g0: float, g1: float, g2: float, target: Vector
) -> int:
    """Targets of the rows of stiff forces at a stage (see `forces.implicit.set_targets`)."""
    wanted, gh = vector_at(target, r.stages.target.size), r.work.implicit[BY_RATE]
    set_targets(r.model.rows, r.work.rows, stage, (s0, s1, s2), (g0, g1, g2), gh, wanted)
    return OK


@entry_point(has_stiff_forces)
def follow_forces(r: Tables, stage: int, target: Vector) -> int:
    """Keep the coordinates of stiff forces after a stage, from its solution."""
    wanted = vector_at(target, r.stages.target.size)
    keep_growth(r.model.rows, r.work.rows, stage, r.work.implicit[BY_RATE], wanted)
    return OK


@entry_point()
def project_state(r: Tables, x: Vector, v: Vector) -> int:
    """One projection of (x, v) onto the constraints, smallest in the norm of the mass matrix: of the positions first,
    then of the velocities onto the rows that hold there."""
    bodies, w, xs, vs = r.model.bodies, r.work, vector_at(x, r.x.size), vector_at(v, r.v.size)
    project(r, w.rows.Phi)
    apply_motion(bodies.where, w.bodies.A, xs, w.bodies.acc)
    normalise(bodies, xs)
    evaluate_rows(r, x, v)
    project(r, w.rows.nu)
    to_velocity_rates(bodies.where, w.bodies.A, w.bodies.acc, w.vd)
    add_scaled(vs, vs, 1.0, w.vd)
    return OK


@entry_point()
def stabilise(r: Tables, t: float, x: Vector, v: Vector) -> int:
    """Evaluate at (t, x, v), after bringing them back onto the constraints when they have left by more than the tolerance
    (in Phi [m, -]; a hundred times that in its rate). A tolerance of zero leaves them alone.

    The corrections are smallest in the norm of the mass matrix with the elastic diagonal of the integrator, so they keep
    its order and do not excite stiff modes. Where they bring nothing nearer, as beyond a dead point, the status tells so.
    """
    w, tolerance, before = r.work, r.clock.gains[TOLERANCE], 0.0
    for attempt in range(5):
        status = evaluate(r, t, x, v)
        if status != OK:
            return status
        position, velocity = largest(w.rows.Phi), largest(w.rows.nu)
        if attempt == 0:
            before = position
            note_drift(w.drift, position, row_of_largest(w.rows.Phi), t)
            w.drift[PHI_DOT] = max(w.drift[PHI_DOT], velocity)
        allowed = tolerance * (TIGHTER if w.independence[HERE] < NEAR else 1.0)
        if attempt == 4 and position > UNMET * tolerance and position > 0.01 * before:
            w.info[FAILED] = r.model.bodies.mass.size + row_of_largest(w.rows.Phi)
            return NOT_CONVERGED
        if tolerance == 0.0 or attempt == 4 or (position <= allowed and velocity <= 100.0 * allowed):
            break
        if w.independence[HERE] < AT:
            break
        w.info[PROJECTIONS] += 1
        project_state(r, x, v)
    keep_measured(w.loads)
    return OK


# ---- rows of results, and the steps between them -------------------------------------------------------------------------


@entry_point()
def evaluate_exact(r: Tables, t: float, x: Vector, v: Vector) -> int:
    """Accelerations and multipliers at (t, x, v) with the true mass matrix, whatever the integrator uses."""
    w = r.work
    set_diagonal(r, 0.0)
    status = evaluate(r, t, x, v)
    if status == OK:
        solve(r, w.rows.gamma)
        to_velocity_rates(r.model.bodies.where, w.bodies.A, w.bodies.acc, w.vd)
    return status


@entry_point(has_loads)
def load_powers(r: Tables, out: Record, row: int) -> int:
    """Powers of the applied loads, as a row of the record."""
    f = r.work.loads.f
    for k in range(count_loads(r.model.loads)):
        fill(f, 0.0)
        add_loads(r, r.x, k)
        out.power[row, k] = power(r.model.bodies.where, r.work.bodies.A, f, r.v)
    return OK


@entry_point()
def find_break(r: Tables, start: float, end: float) -> int:
    """The first break of functions of time within (start, end], in `clock.found`."""
    search_break(r.model.functions, r.work, start, end, r.clock.found)
    return OK


@entry_point()
def record_state(r: Tables, t: float, out: Record, row: int) -> int:
    """Evaluate the engine's state at time t and keep it as a row of the record."""
    look_at_row(r, find_break, t)
    status = evaluate_exact(r, t, r.x, r.v)
    if status == OK:
        keep_measured(r.work.loads)
        evaluate_markers(r, ALL, r.x, r.v)
        if count_loads(r.model.loads) > 0:
            load_powers(r, out, row)
        keep(r.model, r.work, t, r.x, r.v, out, row)
    look_anywhere(r.clock.time)
    return status


@entry_point(by_method)
def step(r: Tables, t: float, again: int) -> int:
    """One step of the engine's state from time t, by the method of the engine: its own function stands in this place.

    again : 1 where the last step, from the same time, was refused; RESTART; WITHIN, of a method that chooses its steps: the
            state at time t, within the last step
    """
    return OK


@entry_point()
def close(r: Tables, t: float) -> int:
    """Bring the state onto the constraints with the diagonal of the last step, if there was one."""
    return stabilise(r, t, r.x, r.v) if r.work.diagonal[0] >= 0.0 else OK


@entry_point()
def settle(r: Tables, t: float) -> int:
    """Bring the state onto constraints whose rates have jumped: the velocities change by an impulse, which springs, dampers
    and elastic forces have no part in."""
    set_diagonal(r, 0.0)
    return stabilise(r, t, r.x, r.v)


@entry_point()
def whole_step(r: Tables, t: float, again: int) -> int:
    """One step in as many pieces as functions of time break it into."""
    return step_in_pieces(r, step, find_break, close, settle, t, again)


@entry_point(has_kinks)
def measure(r: Tables, column: int) -> int:
    """Coordinates of forces that have kinks, and their rates, of the engine's state."""
    turn_bodies(r.model.bodies.where, r.work.bodies, r.x, r.v)
    update_markers(r.model, r.work, IN_USE, r.x, r.v)
    measure_kinks(r, column)
    return OK


@entry_point(has_kinks)
def step_between_breaks(r: Tables, t: float, again: int) -> int:
    """One step in as many pieces as functions of time break it into."""
    return step_in_pieces(r, step, find_break, close, settle, t, again)


@whole_step.where(has_kinks)
def whole_step_to_kinks(r: Tables, t: float, again: int) -> int:
    """One step in as many pieces as functions of time, and kinks of forces that the motion comes to, break it into."""
    return step_to_kinks(r, step_between_breaks, measure, close, t, again)


@entry_point()
def close_row(r: Tables, t: float) -> int:
    """Bring the state at a row of results onto the constraints, as the next step would do."""
    status, tolerance = OK, r.clock.gains[TOLERANCE]
    if r.work.diagonal[0] < 0.0:
        set_diagonal(r, 0.0)  # a row may come before the first step
    if tolerance > 0.0:
        look_at_row(r, find_break, t)
        status = evaluate_rows_at(r, t, r.x, r.v)
        if status == OK and tolerance < largest(r.work.rows.Phi) < GROSS:
            status = stabilise(r, t, r.x, r.v)
        look_anywhere(r.clock.time)
    return status


@entry_point()
def run(r: Tables, start: float, out: Record) -> int:
    """Fill the rows of a record by steps of equal length; step number 0 began at the time `start`."""
    h, steps = r.clock.time[SPACING], r.clock.steps
    steps[FILLED] = 0
    for row in range(out.time.size):
        for _ in range(steps[PER_ROW]):
            status = numbered_step(r, whole_step, start + steps[NEXT] * h)
            if status != OK:
                return status
            steps[NEXT] += 1
        status = close_row(r, start + steps[NEXT] * h)
        if status == OK:
            status = record_state(r, start + steps[NEXT] * h, out, row)
        if status != OK:
            return status
        steps[FILLED] += 1
    return OK


@entry_point(by_method)
def run_controlled(r: Tables, start: float, out: Record) -> int:
    """`run` for a method that chooses its steps: each is tried until its error is within the tolerances."""
    c, steps = r.control, r.clock.steps
    steps[FILLED] = 0
    if r.work.diagonal[0] < 0.0:
        set_diagonal(r, 0.0)  # a row may come before the first step
    for row in range(out.time.size):
        t = start + (steps[NEXT] + steps[PER_ROW]) * r.clock.time[SPACING]
        while c.numbers[NOW] < t:
            status = step_to_break(r, step, find_break, close, settle)
            if status != OK:
                return status
        copy(c.held_x, r.x)
        copy(c.held_v, r.v)
        step(r, t, WITHIN)
        position, velocity = r.work.drift[PHI], r.work.drift[PHI_DOT]  # of the steps, not of the rows between them
        look_at_row(r, find_break, t)
        status = stabilise(r, t, r.x, r.v)
        r.work.drift[PHI], r.work.drift[PHI_DOT] = position, velocity
        if status == OK:
            status = record_state(r, t, out, row)
        copy(r.x, c.held_x)
        copy(r.v, c.held_v)
        if status != OK:
            return status
        steps[NEXT] += steps[PER_ROW]
        steps[FILLED] += 1
    return OK
