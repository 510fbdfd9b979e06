"""The generalised forces of the applied loads alone."""

from ffr_dyn.kernels.bodies import rotation_matrix
from ffr_dyn.kernels.functions import evaluate_functions
from ffr_dyn.kernels.loads import apply_loads, call_user
from ffr_dyn.kernels.markers import update_marker
from ffr_dyn.kernels.options import entry
from ffr_dyn.kernels.vectors import fill, get, put


@entry
def applied_loads(m, w, t, x, v):
    """Fill w.bodies.f (V,), body axes, with all applied loads but gravity. Returns False when a Python function failed."""
    if not call_user(m.user_address, t, x, v, w.user):
        return False
    bodies, bw = m.bodies, w.bodies
    evaluate_functions(m.functions, w.user, t, w.functions)
    for b in range(bodies.mass.size):
        i, j = bodies.where[b, 1], bodies.where[b, 2]
        rotation_matrix(x[i + 3], x[i + 4], x[i + 5], x[i + 6], bw.A[b])
        put(bw.omega, b, (v[j + 3], v[j + 4], v[j + 5]))
    for k in m.markers.active:
        b = m.markers.body[k]
        update_marker(bodies.where, m.markers, w.markers, bw.A[b], get(bw.omega, b), x, v, k)
    fill(bw.f, 0.0)
    for k in range(w.markers.load.shape[0]):
        fill(w.markers.load[k], 0.0)
    apply_loads(bodies.where, m.markers, m.loads, bw.A, w.markers, w.loads, w.functions, w.user, x, bw.f)
    return True
