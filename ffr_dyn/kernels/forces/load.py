"""Forces and moments on markers.

Twin: `ffr_dyn.scene.forces.load`.
"""

from ffr_dyn.kernels.forces.given import given
from ffr_dyn.kernels.markers import apply_wrench
from ffr_dyn.kernels.simd.force_kernel import force_kernel
from ffr_dyn.kernels.simd.slices import part, vector_at
from ffr_dyn.kernels.tables import END_I, GLOBAL, MEASURED, OK, WAY, Tables, Vector
from ffr_dyn.kernels.vectors import to_body


@force_kernel
def load(r: Tables, k: int, x: Vector, f: Vector) -> int:
    m, w = r.model, r.work.markers
    marker = m.loads.row[k, END_I]
    A = w.A[w.body[marker]]
    force = given(r, k, 0, 6), given(r, k, 1, 6), given(r, k, 2, 6)
    moment = given(r, k, 3, 6), given(r, k, 4, 6), given(r, k, 5, 6)
    kept = part(r.work.loads.measured, m.loads.row[k, MEASURED], 6)
    for c in range(3):
        kept[c], kept[3 + c] = force[c], moment[c]
    if m.loads.row[k, WAY] == GLOBAL:
        force, moment = to_body(A, force), to_body(A, moment)
    apply_wrench(m.bodies.where, m.markers, w, vector_at(f, r.v.size), marker, force, moment)
    return OK
