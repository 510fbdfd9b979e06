"""End stops of a joint coordinate.

Twin: `ffr_dyn.scene.forces.joint_stop`.
"""

from ffr_dyn.kernels.forces.coordinate import apply_along, coordinate_of
from ffr_dyn.kernels.forces.implicit import HELD
from ffr_dyn.kernels.options import kernel
from ffr_dyn.kernels.simd.force_kernel import force_kernel
from ffr_dyn.kernels.tables import AHEAD, FRESH, LAW, OK, Tables, Vector


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


@kernel
def steepness(data, start, depth, speed, ahead):
    """(by depth, by speed): slopes of a stop's force, no less than those where it will be in the time `ahead`.

    Damping grows with the depth, and the force with it.
    """
    stiffness, damping, entry = data[start], data[start + 1], data[start + 2]
    share = min(max(depth, depth + ahead * speed) / entry, 1.0)
    if share <= 0.0:
        return 0.0, 0.0
    growth = 6.0 * damping * max(speed, 0.0) * share * (1.0 - share) / entry
    return stiffness * share + growth, damping * share * share * (3.0 - 2.0 * share)


@force_kernel
def stop(r: Tables, k: int, x: Vector, f: Vector) -> int:
    """data: lower and upper end, then what `push` reads."""
    value, rate, motion = coordinate_of(r, k)
    data, start = r.model.loads.data, r.model.loads.row[k, LAW]
    below, above = data[start] - value, value - data[start + 1]
    force = push(data, start + 2, below, -rate) - push(data, start + 2, above, rate)
    stiffness, damping = HELD, HELD
    if r.work.implicit[FRESH] > 0.0:  # later stages may be beside the stop, where they would know nothing of it
        ahead = r.work.implicit[AHEAD]
        lower, upper = steepness(data, start + 2, below, -rate, ahead), steepness(data, start + 2, above, rate, ahead)
        stiffness, damping = lower[0] + upper[0], lower[1] + upper[1]
    apply_along(r, k, f, value, rate, motion, force, stiffness, damping)
    return OK
