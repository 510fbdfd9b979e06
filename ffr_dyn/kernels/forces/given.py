"""Components that are given: factors, functions of time, values of Python functions.

Twin: `ffr_dyn.scene.forces.load`.
"""

from ffr_dyn.kernels.options import kernel
from ffr_dyn.kernels.tables import LAW, USER


@kernel
def given(r, k, c, count):
    """Component c of the `count` of force k; data: factors, then their functions of time or -1."""
    loads = r.model.loads
    start, slot = loads.row[k, LAW], loads.row[k, USER]
    value, function = loads.data[start + c], int(loads.data[start + count + c])
    if function >= 0:
        value *= r.work.functions[function, 0]
    if slot >= 0:
        value += r.work.user[slot + c]
    return value
