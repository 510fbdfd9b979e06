"""The compiled units: what is compiled once, on its own, and called by address.

A unit is given the address of the packed tables, a time and two more addresses, and returns a status. Units and integrators
call one another through the addresses in `Tables.units`, so each is compiled alone: nothing is compiled twice, an
integrator costs no more than its own few lines, and compilation can be shared among processes.
"""

from __future__ import annotations

from collections.abc import Collection

from ffr_dyn.kernels.bodies import mass_times
from ffr_dyn.kernels.forces.applied import apply_loads, call_user, count_loads, gravity_field, keep_measured, power
from ffr_dyn.kernels.functions import evaluate_functions
from ffr_dyn.kernels.integrator_api import set_diagonal
from ffr_dyn.kernels.output_row import keep
from ffr_dyn.kernels.rows import evaluate_block
from ffr_dyn.kernels.simd.slices import part, vector_at
from ffr_dyn.kernels.simd.table_address import call_unit, record_at, tables_at
from ffr_dyn.kernels.singular_positions import note_independence, numbered_step
from ffr_dyn.kernels.solution import constraint_rates, reduce_miss, refine_motion, solve_back, solve_motion
from ffr_dyn.kernels.step_control import controlled_step, interpolate
from ffr_dyn.kernels.stiffening.ahead import start_ahead
from ffr_dyn.kernels.stiffening.by_load import solve_stiffened
from ffr_dyn.kernels.system import (
    clear_and_load,
    evaluate_bodies,
    evaluate_joints,
    evaluate_markers,
    largest,
    move_back,
    prepare,
    row_of_largest,
    to_body_axes,
    to_velocity_rates,
    turn_bodies,
)
from ffr_dyn.kernels.tables import (
    ALL,
    ASIDE,
    AT,
    BACK,
    BODIES,
    CONSTRAINTS,
    EVALUATE,
    IN_USE,
    JOINTS,
    LOADS,
    LOOK,
    MARKERS,
    MOVE_BACK,
    NEAR,
    NOT_CONVERGED,
    NOW,
    OF_JOINTS,
    OK,
    PLAIN,
    POWERS,
    RECORD,
    REGAIN,
    SETTLE,
    SINGULAR_BODY,
    SINGULAR_CONSTRAINT,
    SOLVE,
    TIGHTER,
    TRULY,
    USER_FAILED,
    Model,
)
from ffr_dyn.kernels.unit import Unit
from ffr_dyn.kernels.vectors import add_scaled, copy, fill

PASSES = 10  # of `relaxed_unit` at most
UNMET = 1e3  # tolerances, beyond which a violation that the projection does not take back is no drift


@Unit
def bodies_unit(at, t, x, v):
    """Functions of time, then inertia, forces and factors of all bodies at (t, x, v)."""
    r = tables_at(at)
    m, w, x, v = r.model, r.work, vector_at(x, r.x.size), vector_at(v, r.v.size)
    w.info[1] += 1
    if not call_user(m.user_address, t, x, v, w.user):
        return USER_FAILED
    evaluate_functions(m.functions, w.user, t, w.functions)
    gravity_field(m.gravity, m.base, w.functions, w.field)
    failed = evaluate_bodies(w.field, m.bodies, w.bodies, x, v)
    if failed >= 0:
        w.info[0] = failed
        return SINGULAR_BODY
    return OK


@Unit
def markers_unit(at, which, x, v):
    """Markers in use, of joints, or all, at (x, v)."""
    r = tables_at(at)
    evaluate_markers(r.model, r.work, which, vector_at(x, r.x.size), vector_at(v, r.v.size))
    return OK


@Unit
def constraints_unit(at, t, x, v):
    """Constraint rows from the markers of the joints."""
    r = tables_at(at)
    for k in range(r.model.rows.marker.shape[0]):
        evaluate_block(r.model.rows, r.work.functions, r.work.markers, r.work.rows, k)
    return OK


@Unit
def loads_unit(at, only, x, unused):
    """Applied loads at x: all of them, or number `only` of them alone into the scratch of the powers."""
    r = tables_at(at)
    f, load, first, last = r.work.bodies.f, r.work.markers.load, 0, count_loads(r.model.loads)
    if only >= 0.0:
        f, load, first, last = r.work.loads.f, r.work.loads.load, int(only), int(only) + 1
    apply_loads(r, x, f, load, first, last)
    return OK


@Unit
def powers_unit(at, t, record, row):
    """Powers of the applied loads, as a row of the record; needed where a scene has any."""
    r, out = tables_at(at), record_at(record)
    f = r.work.loads.f
    for k in range(count_loads(r.model.loads)):
        fill(f, 0.0)
        call_unit(r.units[LOADS], at, float(k), r.x.ctypes.data, 0)
        out.power[row, k] = power(r.model.bodies.where, r.work.bodies.A, f, r.v)
    return OK


@Unit
def applied_unit(at, t, x, v):
    """Right-hand sides (V,), body axes, of the applied loads alone at (t, x, v)."""
    r = tables_at(at)
    m, w = r.model, r.work
    xs, vs = vector_at(x, r.x.size), vector_at(v, r.v.size)
    if not call_user(m.user_address, t, xs, vs, w.user):
        return USER_FAILED
    evaluate_functions(m.functions, w.user, t, w.functions)
    turn_bodies(m.bodies.where, w.bodies, xs, vs)
    call_unit(r.units[MARKERS], at, IN_USE, x, v)
    fill(w.bodies.f, 0.0)
    clear_and_load(r, x)
    return OK


@Unit
def joints_unit(at, t, x, v):
    r = tables_at(at)
    failed = evaluate_joints(r.model, r.work)
    if failed >= 0:
        r.work.info[0] = failed
        return SINGULAR_CONSTRAINT
    note_independence(r.work.independence, t)
    return OK


@Unit
def prepare_unit(at, t, x, v):
    """What depends on the elastic diagonal alone."""
    r = tables_at(at)
    prepare(r.model.bodies, r.model.markers, r.model.rows, r.model.pattern, r.work.bodies, r.work.rows)
    return OK


@Unit
def evaluate_unit(at, t, x, v):
    """Fill the work tables at (t, x, v): right-hand sides, constraint rows, factors. Returns a status; info[0] says where."""
    r = tables_at(at)
    status = call_unit(r.units[BODIES], at, t, x, v)
    if status != OK:
        return status
    call_unit(r.units[MARKERS], at, IN_USE, x, v)
    clear_and_load(r, x)
    call_unit(r.units[CONSTRAINTS], at, t, x, v)
    return call_unit(r.units[JOINTS], at, t, x, v)


@Unit
def back_unit(at, t, x, v):
    """Multipliers and motion of reduced forces."""
    r = tables_at(at)
    m, w = r.model, r.work
    solve_back(m.bodies, m.markers, m.rows, m.pattern, w.bodies, w.rows)
    return OK


@Unit
def regain_unit(at, t, value, unused):
    """acc, step from  M acc + Phi_q^T step = 0,  Phi_q acc = -value (C,): for positions and rates a mass-orthogonal
    projection."""
    r = tables_at(at)
    reduce_miss(r.model.rows, r.work.bodies, r.work.rows.step, vector_at(value, r.stages.target.size))
    return call_unit(r.units[BACK], at, t, 0, 0)


@Unit
def plain_unit(at, t, x, target):
    """acc and lam from the right-hand sides and the target (C,) of the accelerations."""
    r = tables_at(at)
    solve_motion(r, vector_at(target, r.stages.target.size))
    return OK


@Unit
def relaxed_unit(at, t, x, target):
    """`plain_unit` where rows depend on one another."""
    r = tables_at(at)
    call_unit(r.units[PLAIN], at, t, x, target)
    refine_motion(r, vector_at(target, r.stages.target.size), PASSES)
    return OK


@Unit
def stiffened_unit(at, stage, x, target):
    """acc and lam of a scene with geometric stiffening.

    stage : number of a step's stage, from 0; AGAIN: near the last solution; ASIDE: so, and nothing is kept of it
    """
    r = tables_at(at)
    solve_stiffened(r, vector_at(x, r.x.size), vector_at(target, r.stages.target.size), int(stage))
    return OK


@Unit
def start_unit(at, t, x, unused):
    """Geometric stiffening at the start of a step, from what is known before it. Returns whether it may be used."""
    r = tables_at(at)
    return 1 if start_ahead(r, r.work.bodies, vector_at(x, r.x.size)) else 0


@Unit
def look_unit(at, t, x, v):
    """Rows (Phi, nu, gamma, jac) at (x, v) at the time of the last evaluation, whose factors stay; markers do not."""
    r = tables_at(at)
    turn_bodies(r.model.bodies.where, r.work.bodies, vector_at(x, r.x.size), vector_at(v, r.v.size))
    call_unit(r.units[MARKERS], at, OF_JOINTS, x, v)
    return call_unit(r.units[CONSTRAINTS], at, t, x, v)


@Unit
def move_back_unit(at, t, x, v):
    """One projection of (x, v) onto the constraints."""
    r = tables_at(at)
    move_back(r, t, vector_at(x, r.x.size), vector_at(v, r.v.size))
    return OK


@Unit
def correct_unit(at, t, r_v, target):
    """f += M r_v, target += Phi_q r_v, for the corrections of a stage; r_v (V,) stays in bodies.shift in body axes."""
    r = tables_at(at)
    bodies, bw, rw = r.model.bodies, r.work.bodies, r.work.rows
    correction, target = vector_at(r_v, r.v.size), vector_at(target, r.stages.target.size)
    copy(bw.acc, correction)
    to_body_axes(bodies.where, bw.A, bw.acc)
    copy(bw.shift, bw.acc)
    constraint_rates(bodies.where, r.model.markers, r.model.rows, rw.jac, bw.acc, rw.lam)
    add_scaled(target, target, 1.0, rw.lam)
    for b in range(bodies.mass.size):
        j, size = bodies.where[b, 2], 6 + bodies.where[b, 0]
        mass_times(bodies, bw, b, part(bw.acc, j, size), part(bw.f, j, size))
    return OK


@Unit
def look_ahead_unit(at, t, x, v):
    """`look_unit` at another time."""
    r = tables_at(at)
    m, w = r.model, r.work
    if not call_user(m.user_address, t, vector_at(x, r.x.size), vector_at(v, r.v.size), w.user):
        return USER_FAILED
    evaluate_functions(m.functions, w.user, t, w.functions)
    return call_unit(r.units[LOOK], at, t, x, v)


@Unit
def project_unit(at, t, value, out):
    """out (V,): the motion, smallest in the norm of the mass matrix, with Phi_q out = -value (C,)."""
    r = tables_at(at)
    w = r.work
    call_unit(r.units[REGAIN], at, t, value, 0)
    to_velocity_rates(r.model.bodies.where, w.bodies.A, w.bodies.acc, vector_at(out, r.v.size))
    return OK


@Unit
def settle_unit(at, t, x, v):
    """Evaluate at (t, x, v), after bringing them back onto the constraints when they have left by more than the tolerance
    (in Phi [m, -]; a hundred times that in its rate). A tolerance of zero leaves them alone.

    The corrections are smallest in the norm of the mass matrix with the elastic diagonal of the integrator, so they keep
    its order and do not excite stiff modes. Where they bring nothing nearer, as beyond a dead point, the status tells so.
    """
    r = tables_at(at)
    w, tolerance, before = r.work, r.clock.gains[2], 0.0
    for attempt in range(5):
        status = call_unit(r.units[EVALUATE], at, t, x, v)
        if status != OK:
            return status
        position, velocity = largest(w.rows.Phi), largest(w.rows.nu)
        if attempt == 0:
            before = position
            w.drift[0], w.drift[1] = max(w.drift[0], position), max(w.drift[1], velocity)
        allowed = tolerance * (TIGHTER if w.independence[0] < NEAR else 1.0)
        if attempt == 4 and position > UNMET * tolerance and position > 0.01 * before:
            w.info[0] = r.model.bodies.mass.size + row_of_largest(w.rows.Phi)
            return NOT_CONVERGED
        if tolerance == 0.0 or attempt == 4 or (position <= allowed and velocity <= 100.0 * allowed):
            break
        if w.independence[0] < AT:
            break
        w.info[2] += 1
        call_unit(r.units[MOVE_BACK], at, t, x, v)
    keep_measured(w.loads)
    return OK


@Unit
def truly_unit(at, t, x, v):
    """Accelerations and multipliers at (t, x, v) with the true mass matrix, whatever the integrator uses."""
    r = tables_at(at)
    w = r.work
    set_diagonal(r, 0.0)
    status = call_unit(r.units[EVALUATE], at, t, x, v)
    if status == OK:
        fill(w.bodies.shift, 0.0)
        call_unit(r.units[SOLVE], at, ASIDE, x, w.rows.gamma.ctypes.data)
        to_velocity_rates(r.model.bodies.where, w.bodies.A, w.bodies.acc, w.vd)
    return status


@Unit
def record_unit(at, t, record, row):
    """Evaluate the machine's state at time t and keep it as a row of the record. Returns a status."""
    r = tables_at(at)
    status = call_unit(r.units[TRULY], at, t, r.x.ctypes.data, r.v.ctypes.data)
    if status == OK:
        keep_measured(r.work.loads)
        call_unit(r.units[MARKERS], at, ALL, r.x.ctypes.data, r.v.ctypes.data)
        if count_loads(r.model.loads) > 0:
            call_unit(r.units[POWERS], at, t, record, row)
        keep(r.model, r.work, t, r.x, r.v, record_at(record), row)
    return status


@Unit
def rows_unit(at, start, record, step):
    """Fill the rows of a record; `step` is the address of a method's unit. Returns a status."""
    r, out = tables_at(at), record_at(record)
    h, steps = r.clock.time[1], r.clock.steps
    steps[2] = 0
    for row in range(out.time.size):
        for _ in range(steps[1]):
            status = numbered_step(r, step, start + steps[0] * h)
            if status != OK:
                return status
            steps[0] += 1
        status = call_unit(r.units[RECORD], at, start + steps[0] * h, record, row)
        if status != OK:
            return status
        steps[2] += 1
    return OK


@Unit
def controlled_rows_unit(at, start, record, step):
    """`rows_unit` for a method that chooses its steps: each is tried until its error is within the tolerances."""
    r, out = tables_at(at), record_at(record)
    c, steps = r.control, r.clock.steps
    steps[2] = 0
    if r.work.diagonal[0] < 0.0:
        set_diagonal(r, 0.0)  # a row may come before the first step
    for row in range(out.time.size):
        t = start + (steps[0] + steps[1]) * r.clock.time[1]
        while c.numbers[NOW] < t:
            status = controlled_step(r, step)
            if status != OK:
                return status
        copy(c.held_x, r.x)
        copy(c.held_v, r.v)
        interpolate(r, t)
        position, velocity = r.work.drift[0], r.work.drift[1]  # of the steps, not of the rows between them
        status = call_unit(r.units[SETTLE], at, t, r.x.ctypes.data, r.v.ctypes.data)
        r.work.drift[0], r.work.drift[1] = position, velocity
        if status == OK:
            status = call_unit(r.units[RECORD], at, t, record, row)
        copy(r.x, c.held_x)
        copy(r.v, c.held_v)
        if status != OK:
            return status
        steps[0] += steps[1]
        steps[2] += 1
    return OK


# By name, those that take long to compile first.
UNITS = {
    "bodies": bodies_unit,
    "joints": joints_unit,
    "record": record_unit,
    "prepare": prepare_unit,
    "plain": plain_unit,
    "back": back_unit,
    "regain": regain_unit,
    "constraints": constraints_unit,
    "correct": correct_unit,
    "markers": markers_unit,
    "settle": settle_unit,
    "move_back": move_back_unit,
    "truly": truly_unit,
    "evaluate": evaluate_unit,
    "rows": rows_unit,
    "look": look_unit,
    "applied": applied_unit,
}
# Of scenes that need them, of methods that choose their steps, and of methods that ask for more.
LOAD_UNITS = {"loads": loads_unit, "powers": powers_unit}
RELAXED_UNITS = {"relaxed": relaxed_unit}
STIFFENED_UNITS = {"stiffened": stiffened_unit, "start": start_unit}
CONTROL_UNITS = {"controlled_rows": controlled_rows_unit}
EXTRA_UNITS = {"project": project_unit, "look_ahead": look_ahead_unit}


def units_of(model: Model) -> dict[str, Unit]:
    """The units that a scene needs whatever the method."""
    return {
        **UNITS,
        **(LOAD_UNITS if count_loads.py_func(model.loads) else {}),
        **(RELAXED_UNITS if model.relaxation > 0.0 else {}),
        **(STIFFENED_UNITS if model.bodies.stiffening.size else {}),
    }


def unit_addresses(model: Model, calls: Collection[str]) -> list[int]:
    """In the order of the units' numbers in `tables`; zero for those of loads and of other methods that are not called."""
    needed = units_of(model)
    motion = "relaxed" if "relaxed" in needed else "plain"
    solve = "stiffened" if "stiffened" in needed else motion
    evaluating = "evaluate", "bodies", "markers", "constraints", "joints"
    solving = "back", "regain", "plain", motion, solve, "prepare", "look", "settle", "move_back", "correct"
    numbered = *evaluating, *solving, "truly", "record"
    extra = [EXTRA_UNITS[name].address if name in calls else 0 for name in ("look_ahead", "project")]
    others = [needed[name].address if name in needed else 0 for name in (*LOAD_UNITS, "start")]
    return [*(needed[name].address for name in numbered), *extra, *others]
