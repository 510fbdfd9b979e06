"""Dry friction on a joint coordinate.

Twin: `ffr_dyn.scene.forces.joint_friction`.
"""

import math

from ffr_dyn.kernels.forces.coordinate import apply_along, coordinate_of, drive_of
from ffr_dyn.kernels.options import kernel
from ffr_dyn.kernels.simd.force_kernel import force_kernel
from ffr_dyn.kernels.tables import LAW, OK, Tables, Vector


@kernel
def drag(data, start, rate, normal):
    """Friction over the rate: what an implicit method goes by, since the slope is nothing where friction has its full size.

    data: Coulomb friction, what friction at rest has more, Stribeck's velocity, creep velocity, viscous damping.
    """
    fall, share = rate / data[start + 2], rate / data[start + 3]
    size = data[start] + data[start + 1] * math.exp(-fall * fall)
    if normal < 0.0:  # lifted off
        size = 0.0
    steep = math.tanh(share) / share if abs(share) > 1e-6 else 1.0
    return normal * size * steep / data[start + 3] + data[start + 4]


@force_kernel
def friction(r: Tables, k: int, x: Vector, f: Vector) -> int:
    value, rate, motion = coordinate_of(r, k)
    loads = r.model.loads
    damping = drag(loads.data, loads.row[k, LAW], rate, drive_of(r, k)[0])
    apply_along(r, k, f, value, rate, motion, -damping * rate, 0.0, damping)
    return OK
