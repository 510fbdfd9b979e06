"""All applied loads: wrenches on markers, forces on coordinates, bushings, spread loads, values of Python functions.

Twin: `ffr_dyn.equations.forces.applied`.
"""

from numba import types

from ffr_dyn.kernels.forces.bushings import apply_bushing
from ffr_dyn.kernels.forces.coordinate_forces import apply_action
from ffr_dyn.kernels.forces.surface_loads import apply_spread
from ffr_dyn.kernels.markers import apply_wrench
from ffr_dyn.kernels.options import inlined, kernel
from ffr_dyn.kernels.simd.intrinsics import call_of
from ffr_dyn.kernels.tables import IN_V, N
from ffr_dyn.kernels.vectors import get, to_body, to_global

# int function(double t, double *x, double *v, double *out) at a machine address
_call_function = call_of(types.float64, types.int64, types.int64, types.int64)


@kernel
def call_user(address, t, x, v, user):
    """Let the user's Python functions fill `user`. Returns True when they did."""
    if user.size == 0:
        return True
    return _call_function(address, t, x.ctypes.data, v.ctypes.data, user.ctypes.data) == 0


@kernel
def load_component(loads, functions, user, k, c):
    value = loads.value[k, c]
    function = loads.function[k, c]
    if function >= 0:
        value *= functions[function, 0]
    slot = loads.wrench[k, 2]
    if slot >= 0:
        value += user[slot + c]
    return value


@inlined
def given_wrench(loads, functions, user, A, k):
    """(force, moment) of wrench k in body axes; A (3, 3) of the marker's body."""
    force = (
        load_component(loads, functions, user, k, 0),
        load_component(loads, functions, user, k, 1),
        load_component(loads, functions, user, k, 2),
    )
    moment = (
        load_component(loads, functions, user, k, 3),
        load_component(loads, functions, user, k, 4),
        load_component(loads, functions, user, k, 5),
    )
    if loads.wrench[k, 1] == 0:
        return to_body(A, force), to_body(A, moment)
    return force, moment


@kernel
def apply_given(where, markers, loads, w, functions, user, f, load, k):
    """Add wrench k to f and load (M, 6)."""
    marker = loads.wrench[k, 0]
    force, moment = given_wrench(loads, functions, user, w.A[w.body[marker]], k)
    apply_wrench(where, markers, get(w.u, marker), f, load[marker], marker, force, moment)


@kernel
def count_loads(loads):
    """How many loads the scene applies besides gravity."""
    return loads.wrench.shape[0] + loads.action.shape[0] + loads.bushing.shape[0] + loads.spread.shape[0]


@inlined
def apply_loads(m, w, x, f, load, first, last):
    """Add loads number first ... last - 1 (wrenches, actions, bushings, spread loads) to the right-hand sides f (V,), and to
    load (M, 6)."""
    where, markers, loads, mw, s = m.bodies.where, m.markers, m.loads, w.markers, w.loads
    actions = loads.wrench.shape[0]
    bushings = actions + loads.action.shape[0]
    spread = bushings + loads.bushing.shape[0]
    for k in range(first, last):
        if k < actions:
            apply_given(where, markers, loads, mw, w.functions, w.user, f, load, k)
        elif k < bushings:
            apply_action(where, markers, loads, mw, s, w.functions, w.user, f, load, k - actions)
        elif k < spread:
            apply_bushing(where, markers, loads, mw, s, f, load, k - bushings)
        else:
            apply_spread(where, loads, w.bodies.A, w.functions, x, f, k - spread)


@kernel
def power(where, A, f, v):
    """f . v for right-hand sides f in body axes; A (B + 1, 3, 3)."""
    result = 0.0
    for b in range(where.shape[0] - 1):
        n, j = where[b, N], where[b, IN_V]
        force = to_global(A[b], (f[j], f[j + 1], f[j + 2]))
        for c in range(3):
            result += force[c] * v[j + c]
        for c in range(3, 6 + n):
            result += f[j + c] * v[j + c]
    return result


@kernel
def gravity_field(gravity, base, functions, out):
    """out (3,) = gravity less the acceleration of the base; base (3,): its time functions or -1."""
    for c in range(3):
        out[c] = gravity[c]
        if base[c] >= 0:
            out[c] -= functions[base[c], 0]
