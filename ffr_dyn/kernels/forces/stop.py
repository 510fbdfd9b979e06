"""End stops of a joint coordinate.

Twin: `ffr_dyn.scene.forces.joint_stop`.
"""

from ffr_dyn.kernels.forces.coordinate import apply_along, coordinate_of
from ffr_dyn.kernels.options import kernel
from ffr_dyn.kernels.simd.force_kernel import force_kernel
from ffr_dyn.kernels.tables import LAW, OK, Tables, Vector


@kernel
def push(data, start, depth, speed):
    """Force of a stop at a depth that grows with `speed`; data: stiffness, damping, entry."""
    if depth <= 0.0:
        return 0.0
    stiffness, damping, entry = data[start], data[start + 1], data[start + 2]
    share = min(depth / entry, 1.0)
    force = stiffness * (depth - entry * share * (1.0 - 0.5 * share)) + damping * speed * share * share * (
        3.0 - 2.0 * share
    )
    return 0.0 if force < 0.0 else force


@force_kernel
def stop(r: Tables, k: int, x: Vector, f: Vector) -> int:
    """data: lower and upper end, then what `push` reads."""
    value, rate, side_i, side_j = coordinate_of(r, k)
    data, start = r.model.loads.data, r.model.loads.row[k, LAW]
    force = push(data, start + 2, data[start] - value, -rate) - push(data, start + 2, value - data[start + 1], rate)
    apply_along(r, k, f, value, rate, side_i, side_j, force)
    return OK
