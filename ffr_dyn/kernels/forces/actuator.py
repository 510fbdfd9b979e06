"""Given forces on a joint coordinate.

Twin: `ffr_dyn.scene.forces.actuator`.
"""

from ffr_dyn.kernels.forces.coordinate import apply_along, coordinate_of
from ffr_dyn.kernels.forces.given import given
from ffr_dyn.kernels.simd.force_kernel import force_kernel
from ffr_dyn.kernels.tables import LAW, OK, Tables, Vector


@force_kernel
def actuator(r: Tables, k: int, x: Vector, f: Vector) -> int:
    value, rate, motion = coordinate_of(r, k)
    data, slopes = r.model.loads.data, r.model.loads.row[k, LAW] + 2
    apply_along(r, k, f, value, rate, motion, given(r, k, 0, 1), data[slopes], data[slopes + 1])
    return OK
