"""The row that is kept at an output time.

Twin: `ffr_dyn.equations.inertia.energies`.
"""

from ffr_dyn.kernels.bodies import energies
from ffr_dyn.kernels.options import inlined
from ffr_dyn.kernels.simd.slices import part
from ffr_dyn.kernels.system import largest, reactions
from ffr_dyn.kernels.vectors import copy, get, put


@inlined
def keep(m, w, t, x, v, out, k):
    """Write row k of `out` from an evaluated state with all its markers; the powers of loads are left to `load_powers`."""
    F = m.functions.kind.size
    out.time[k] = t
    copy(out.x[k], x)
    copy(out.v[k], v)
    copy(out.vd[k], w.vd)
    for marker in range(m.markers.body.size):
        put(out.r[k], marker, get(w.markers.r, marker))
        put(out.rd[k], marker, get(w.markers.rd, marker))
    reactions(m.rows, w.markers, w.rows, out.reaction[k])
    copy(out.forces[k], w.loads.measured)
    copy(part(out.functions, 3 * F * k, 3 * F), part(w.functions, 0, 3 * F))
    kinetic, strain, gravity = energies(m.gravity, m.bodies, w.bodies, x, v, w.y[0], w.y[1])
    out.energy[k, 0], out.energy[k, 1], out.energy[k, 2] = kinetic, strain, gravity
    out.violation[k, 0], out.violation[k, 1] = largest(w.rows.Phi), largest(w.rows.nu)
