"""Position control of a joint coordinate.

Twin: `ffr_dyn.scene.forces.servo`.
"""

from ffr_dyn.kernels.forces.coordinate import apply_along, coordinate_of, drive_of
from ffr_dyn.kernels.options import kernel
from ffr_dyn.kernels.simd.force_kernel import force_kernel
from ffr_dyn.kernels.tables import LAW, OK, Tables, Vector


@kernel
def control(data, start, c, rate, target, target_rate):
    """(force, share of it that the limit leaves); data: kp, kd, limit."""
    wanted, limit = data[start] * (target - c) + data[start + 1] * (target_rate - rate), data[start + 2]
    if wanted > limit:
        return limit, limit / wanted
    return (-limit, -limit / wanted) if wanted < -limit else (wanted, 1.0)


@force_kernel
def servo(r: Tables, k: int, x: Vector, f: Vector) -> int:
    value, rate, motion = coordinate_of(r, k)
    loads, drive = r.model.loads, drive_of(r, k)
    data, start = loads.data, loads.row[k, LAW]
    force, share = control(data, start, value, rate, drive[0], drive[1])
    kp, kd = share * data[start], share * data[start + 1]
    apply_along(r, k, f, value, rate, motion, force, kp, kd, kp * drive[1] + kd * drive[2])
    return OK
