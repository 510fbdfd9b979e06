"""What is kept at an output time."""

from ffr_dyn.kernels.bodies import energies
from ffr_dyn.kernels.loads import spring_force
from ffr_dyn.kernels.markers import update_marker
from ffr_dyn.kernels.options import inlined
from ffr_dyn.kernels.stiffening import solve_stiffened
from ffr_dyn.kernels.system import evaluate, largest, prepare, reactions, to_velocity_rates
from ffr_dyn.kernels.tables import OK
from ffr_dyn.kernels.vectors import copy, fill, get, put


@inlined
def evaluate_truly(m, w, t, x, v):
    """Accelerations and multipliers at (t, x, v) with the true mass matrix, whatever the integrator uses."""
    fill(w.bodies.dinv, 1.0)
    prepare(m.bodies.where, m.markers, m.rows, m.pattern, w.bodies.dinv, w.rows.phiphi)
    status = evaluate(m, w, t, x, v)
    if status == OK:
        fill(w.bodies.shift, 0.0)
        solve_stiffened(m, w, x, w.rows.gamma)
        to_velocity_rates(m.bodies.where, w.bodies.A, w.bodies.acc, w.vd)
    return status


@inlined
def keep(m, w, t, x, v, out, k):
    """Write row k of `out` from an evaluated state."""
    out.time[k] = t
    copy(out.x[k], x)
    copy(out.v[k], v)
    copy(out.vd[k], w.vd)
    for marker in range(m.markers.body.size):
        b = m.markers.body[marker]
        update_marker(m.bodies.where, m.markers, w.markers, w.bodies.A[b], get(w.bodies.omega, b), x, v, marker)
        put(out.r[k], marker, get(w.markers.r, marker))
        put(out.rd[k], marker, get(w.markers.rd, marker))
    reactions(m.rows, w.markers, w.rows, out.reaction[k])
    for spring in range(m.loads.spring.shape[0]):
        out.spring[k, spring] = spring_force(m.loads, w.markers, spring)[0]
    kinetic, strain, gravity = energies(m.gravity, m.bodies, w.bodies, x, v, w.y[0], w.y[1])
    out.energy[k, 0], out.energy[k, 1], out.energy[k, 2] = kinetic, strain, gravity
    out.violation[k, 0], out.violation[k, 1] = largest(w.rows.Phi), largest(w.rows.nu)


@inlined
def record(m, w, t, x, v, out, k):
    """Evaluate the scene at (t, x, v) and keep it as row k of `out`. Returns a status."""
    status = evaluate_truly(m, w, t, x, v)
    if status == OK:
        keep(m, w, t, x, v, out, k)
    return status
