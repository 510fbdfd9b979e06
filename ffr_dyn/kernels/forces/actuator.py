"""Given forces on a joint coordinate. Twin: `ffr_dyn.scene.forces.actuator`."""

from ffr_dyn.kernels.forces.coordinate import apply_along, coordinate_of
from ffr_dyn.kernels.forces.given import given
from ffr_dyn.kernels.simd.table_address import tables_at
from ffr_dyn.kernels.tables import OK
from ffr_dyn.kernels.unit import force_kernel


@force_kernel
def actuator(at, k, x, f, load):
    r = tables_at(at)
    value, rate, side_i, side_j = coordinate_of(r, k)
    apply_along(r, k, f, load, value, rate, side_i, side_j, given(r, k, 0, 1))
    return OK
