"""All applied loads of a scene, values of Python functions, powers, gravity.

Twin: `ffr_dyn.equations.forces.applied`.
"""

from numba import types

from ffr_dyn.kernels.options import kernel
from ffr_dyn.kernels.simd.force_kernel import call_force
from ffr_dyn.kernels.simd.intrinsics import call_of
from ffr_dyn.kernels.tables import IN_V, KERNEL, N
from ffr_dyn.kernels.vectors import to_global

# int function(double t, double *x, double *v, double *out) at a machine address
_call_function = call_of(types.float64, types.int64, types.int64, types.int64)


@kernel
def call_user(address, t, x, v, user):
    """Let the user's Python functions fill `user`. Returns True when they did."""
    if user.size == 0:
        return True
    return _call_function(address, t, x.ctypes.data, v.ctypes.data, user.ctypes.data) == 0


@kernel
def count_loads(loads):
    """How many loads the scene applies besides gravity."""
    return loads.row.shape[0]


@kernel
def apply_loads(r, x, f, first, last):
    """Add loads number first ... last - 1 at the positions x, a `Vector`, to the right-hand sides f (V,)."""
    for k in range(first, last):
        call_force(r.forces[r.model.loads.row[k, KERNEL]], r, k, x, f)


@kernel
def keep_measured(loads):
    """Count the turns of the angles from this, an accepted state; loads: `LoadWork`."""
    for k in range(loads.measured.size):
        if loads.measured[k] - loads.measured[k] == 0.0:  # not from a state that is no longer finite
            loads.reference[k] = loads.measured[k]


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
