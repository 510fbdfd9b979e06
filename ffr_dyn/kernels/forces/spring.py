"""Springs and dampers on a length or a joint coordinate.

Twin: `ffr_dyn.scene.forces.spring_law`.
"""

from ffr_dyn.kernels.forces.coordinate import apply_along, coordinate_of
from ffr_dyn.kernels.forces.curve import curve_slope, curve_value
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


@kernel
def slopes(data, start, c, rate):
    """By stretch and by rate; of a curve over the rate at least the chord from rest, for those that grow less and less."""
    stiffness, damping = data[start], data[start + 1]
    if data[start + 4] >= 0.0:
        stiffness += curve_slope(data, int(data[start + 4]), c - data[start + 2])
    if data[start + 5] >= 0.0:
        curve = int(data[start + 5])
        chord = (curve_value(data, curve, rate) - curve_value(data, curve, 0.0)) / rate if rate != 0.0 else 0.0
        damping += max(curve_slope(data, curve, rate), chord)
    return stiffness, damping


@force_kernel
def spring(r: Tables, k: int, x: Vector, f: Vector) -> int:
    value, rate, motion = coordinate_of(r, k)
    loads = r.model.loads
    data, start = loads.data, loads.row[k, LAW]
    stiffness, damping = slopes(data, start, value, rate)
    apply_along(r, k, f, value, rate, motion, -pull(data, start, value, rate), stiffness, damping)
    return OK
