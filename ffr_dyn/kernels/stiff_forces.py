"""Stiff forces: rows beside those of the joints, by which a linearly implicit method takes F = -k c - d c_dot implicitly.

Along a coordinate c with the rate J v, a stage of a W-method with r_x, r_v as corrections has on its left side

    J^T (gamma h k J (v + gamma h k_v + r_x) + d gamma h J k_v) = J^T s,     s = w J k_v + gamma h k J (v + r_x),
    w = gamma h d + (gamma h)^2 k,

while F itself stays on the right. With s as one more multiplier this is a constraint row with compliance:

    M k_v + J^T s + Phi_q^T mu = Q + M r_v + ...,      J k_v - s / w = -gamma h k J (v + r_x) / w.

So the row is eliminated as that of a joint, with 1/w on its diagonal of S. Its slopes k and d come from the kernel of the force
and need only dominate those of the law, since a W-method keeps its order whatever they are: negative ones count as zero, and
where both are zero the row does nothing. Newton's methods have the same rows, without pull: their w is of their own numbers.

Twin: `ffr_dyn.scene.forces.force.Force.slopes`.
"""

from ffr_dyn.kernels.options import inlined, kernel
from ffr_dyn.kernels.rows import fill_side
from ffr_dyn.kernels.tables import (
    BLOCK,
    BY_PLACE,
    BY_RATE,
    IN_V,
    IN_X,
    LANE,
    LANES,
    N,
)
from ffr_dyn.kernels.vectors import to_body

HELD = -1.0  # in place of a stiffness: the slopes stay what they were
LEAST = 1e-200  # of w: below, its reciprocal is none


@kernel
def keep_row(r, k, number, side_i, side_j, stiffness, damping):
    """Row `number` of force k, where it is implicit: sides (see `rows`) of its coordinate, and slopes -dF/dc, -dF/dc_dot."""
    block = r.model.loads.row[k, BLOCK]
    if block < 0:
        return
    rows, by_rate, by_place = r.work.rows, r.work.implicit[BY_RATE], r.work.implicit[BY_PLACE]
    lane, side = r.model.loads.row[k, LANE] + number, block * r.model.rows.marker.shape[1]
    at = LANES * block + lane
    if stiffness != HELD:
        stiffness, damping = max(stiffness, 0.0), max(damping, 0.0)
        w = by_rate * damping + by_place * stiffness
        rows.compliance[at] = 1.0 / w if w > LEAST else 0.0
        rows.pull[at] = by_rate * stiffness * rows.compliance[at]
    used = 1.0 if rows.compliance[at] > 0.0 else 0.0
    fill_side(rows.jac[side], lane, used, side_i)
    fill_side(rows.jac[side + 1], lane, used, side_j)


@kernel
def soften_block(rows, pattern, rw, k):
    """The compliances of the rows of stiff forces of block k, onto the diagonal of S; ones for rows that do nothing."""
    for row in range(rows.forced[k], rows.start[k + 1]):
        lane = row - rows.start[k]
        found = rw.compliance[LANES * k + lane]
        added = found if found > 0.0 else 1.0
        rw.S[pattern.diagonal[k] + (LANES + 1) * lane] += added
        rw.scale[LANES * k + lane] += added


@kernel
def subtract_yield(rows, rw, lam, out):
    """out (C,) less what stiff forces yield to their multipliers lam (C,)."""
    for k in range(rows.forced.size):
        for row in range(rows.forced[k], rows.start[k + 1]):
            out[row] -= rw.compliance[LANES * k + row - rows.start[k]] * lam[row]


@kernel
def leave_forces(rows, out):
    """Zeros in out (C,) at the rows of stiff forces."""
    for k in range(rows.forced.size):
        for row in range(rows.forced[k], rows.start[k + 1]):
            out[row] = 0.0


@inlined
def take_pull(rows, rw, rate, target):
    """target (C,) of the rows of stiff forces from the rates J (v + r_x) of their coordinates."""
    for k in range(rows.forced.size):
        for row in range(rows.forced[k], rows.start[k + 1]):
            target[row] = -rw.pull[LANES * k + row - rows.start[k]] * rate[row]


@inlined
def corrected_velocities(where, A, x, v, r_x, out):
    """out = v + r_x in body axes, r_x a correction of position rates at x."""
    for b in range(where.shape[0] - 1):
        n, i, j = where[b, N], where[b, IN_X], where[b, IN_V]
        linear = to_body(A[b], (v[j] + r_x[i], v[j + 1] + r_x[i + 1], v[j + 2] + r_x[i + 2]))
        out[j], out[j + 1], out[j + 2] = linear
        p0, p1, p2, p3 = x[i + 3], x[i + 4], x[i + 5], x[i + 6]
        r0, r1, r2, r3 = r_x[i + 3], r_x[i + 4], r_x[i + 5], r_x[i + 6]
        out[j + 3] = v[j + 3] + 2.0 * (-p1 * r0 + p0 * r1 + p3 * r2 - p2 * r3)
        out[j + 4] = v[j + 4] + 2.0 * (-p2 * r0 - p3 * r1 + p0 * r2 + p1 * r3)
        out[j + 5] = v[j + 5] + 2.0 * (-p3 * r0 + p2 * r1 - p1 * r2 + p0 * r3)
        for k in range(n):
            out[j + 6 + k] = v[j + 6 + k] + r_x[i + 7 + k]
