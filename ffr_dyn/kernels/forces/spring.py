"""Springs and dampers on a length or a joint coordinate.

Twin: `ffr_dyn.scene.forces.spring_law`.
"""

from ffr_dyn.kernels.forces.coordinate import apply_along, coordinate_of
from ffr_dyn.kernels.forces.curve import curve_value
from ffr_dyn.kernels.options import kernel
from ffr_dyn.kernels.simd.force_kernel import force_kernel
from ffr_dyn.kernels.tables import LAW, OK, Tables, Vector


@kernel
def pull(data, start, c, rate):
    """data: stiffness, damping, free coordinate, preload, start of the curves of force and damping or -1."""
    stretch = c - data[start + 2]
    total = data[start] * stretch + data[start + 1] * rate + data[start + 3]
    if data[start + 4] >= 0.0:
        total += curve_value(data, int(data[start + 4]), stretch)
    if data[start + 5] >= 0.0:
        total += curve_value(data, int(data[start + 5]), rate)
    return total


@force_kernel
def spring(r: Tables, k: int, x: Vector, f: Vector) -> int:
    value, rate, side_i, side_j = coordinate_of(r, k)
    loads = r.model.loads
    apply_along(r, k, f, value, rate, side_i, side_j, -pull(loads.data, loads.row[k, LAW], value, rate))
    return OK
