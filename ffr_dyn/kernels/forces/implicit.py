"""Stiff forces: rows beside those of the joints, by which a linearly implicit method takes F = -k c - d c_dot implicitly.

Along a coordinate c with the rate u = J v, a W-method is applied to c and u as well, c_dot = u, u_dot = J v_dot + b, with b
the quadratic velocity part, from what c and u are at the start of the step. With r as its corrections, F(c, u) on the right
side at the stage's own position and gh = gamma h, the left side of a stage has J^T s with

    s = gh k (u + r_c + gh u') + gh d u' + k (c - c(x)) + d (u - J v),     u' = J k_v + b + r_u - J r_v.

So s is one more multiplier, of a row with compliance, w = gh d + gh^2 k:

    M k_v + J^T s + Phi_q^T mu = Q + M r_v + ...,      J k_v - s / w = target,
    target = J r_v - b - r_u - (gh k (u + r_c) + k (c - c(x)) + d (u - J v)) / w.

It is eliminated as that of a joint, with 1/w on its diagonal of S. Without coordinates of their own stiff forces would turn
with the bodies from stage to stage, and an unresolved spring would cost the method its order. The slopes k and d come from
the kernel of the force and need only dominate those of the law, since a W-method keeps its order whatever they are:
negative ones count as zero, and where both are zero the row does nothing. A length that has passed zero since the step
began turns back there: the coordinate that goes on is its negative, whose row is the same with the other sign. Newton's
methods have the same rows with targets of zero: their w is of their own numbers.

Twin: `ffr_dyn.scene.forces.force.Force.slopes`.
"""

import math

from ffr_dyn.kernels.options import inlined, kernel
from ffr_dyn.kernels.rows import fill_side
from ffr_dyn.kernels.tables import BLOCK, BY_PLACE, BY_RATE, LANE, LANES, LENGTH, WAY

HELD = -math.inf  # in place of a stiffness: the slopes stay what they were
LEAST = 1e-30  # of w, which binds nothing
CORRECTED, CURVED, TURNED = range(3)  # what is kept between the target of a row and its solution


@kernel
def keep_row(r, k, number, value, rate, motion, stiffness, damping):
    """Row `number` of force k, where it is implicit: its coordinate, and slopes -dF/dc, -dF/dc_dot.

    motion : quadratic velocity part of the coordinate's second derivative, and its sides (see `rows`)
    """
    block = r.model.loads.row[k, BLOCK]
    if block < 0:
        return
    rows, by_rate, by_place = r.work.rows, r.work.implicit[BY_RATE], r.work.implicit[BY_PLACE]
    lane, side = r.model.loads.row[k, LANE] + number, block * r.model.rows.marker.shape[1]
    at, row = LANES * block + lane, r.model.rows.start[block] + lane
    if stiffness != HELD:
        stiffness = max(stiffness, 0.0)
        rows.compliance[at] = 1.0 / max(by_rate * max(damping, 0.0) + by_place * stiffness, LEAST)
        rows.pull[at] = by_rate * stiffness * rows.compliance[at]
    rows.along[0, row], rows.along[1, row], rows.along[2, row] = value, rate, motion[0]
    rows.along[3, row] = 1.0 if r.model.loads.row[k, WAY] == LENGTH else 0.0
    fill_side(rows.jac[side], lane, 1.0, motion[1])
    fill_side(rows.jac[side + 1], lane, 1.0, motion[2])


@kernel
def soften_block(rows, pattern, rw, k):
    """The compliances of the rows of stiff forces of block k, onto the diagonal of S."""
    for row in range(rows.forced[k], rows.start[k + 1]):
        lane = row - rows.start[k]
        found = rw.compliance[LANES * k + lane]
        added = found if found > 0.0 else 1.0  # of forces that know nothing of their rows
        rw.S[pattern.diagonal[k] + (LANES + 1) * lane] += added
        rw.scale[LANES * k + lane] += added


@kernel
def subtract_yield(rows, rw, lam, out):
    """out (C,) less what stiff forces yield to their multipliers lam (C,)."""
    for k in range(rows.forced.size):
        for row in range(rows.forced[k], rows.start[k + 1]):
            out[row] -= rw.compliance[LANES * k + row - rows.start[k]] * lam[row]


@kernel
def add_to_joints(rows, out, rates):
    """out (C,) += rates (C,) at the rows that are none of stiff forces."""
    for k in range(rows.forced.size):
        for row in range(rows.start[k], rows.forced[k]):
            out[row] += rates[row]


@inlined
def set_targets(rows, rw, stage, shares, factors, gh, target):
    """target (C,) of the rows of stiff forces at a stage; at the first, the step begins with their coordinates as they are.

    shares, factors : three each, of what earlier stages made of a coordinate and its rate: in their values, in corrections
    rw.left         : J r_v, but at the first stage
    """
    along, begun, grown = rw.along, rw.begun, rw.grown
    for k in range(rows.forced.size):
        for row in range(rows.forced[k], rows.start[k + 1]):
            if stage == 0:
                begun[0, row], begun[1, row] = along[0, row], along[1, row]
            c, u, r_c, r_u = begun[0, row], begun[1, row], 0.0, 0.0
            for j in range(stage):
                c, u = c + shares[j] * grown[j, 0, row], u + shares[j] * grown[j, 1, row]
                r_c, r_u = r_c + factors[j] * grown[j, 0, row], r_u + factors[j] * grown[j, 1, row]
            way = -1.0 if c < 0.0 and along[3, row] > 0.0 else 1.0
            curved = way * (along[2, row] - (rw.left[row] if stage > 0 else 0.0))
            pull = rw.pull[LANES * k + row - rows.start[k]]
            off = pull * (c - way * along[0, row]) + (1.0 - gh * pull) * (u - way * along[1, row])
            target[row] = way * (-curved - r_u - pull * (u + r_c) - off / gh)
            rw.held[CORRECTED, row], rw.held[CURVED, row], rw.held[TURNED, row] = u + gh * r_u, curved, way


@inlined
def keep_growth(rows, rw, stage, gh, target):
    """Keep the coordinates of stiff forces and their rates after a stage, from its solution."""
    for k in range(rows.forced.size):
        for row in range(rows.forced[k], rows.start[k + 1]):
            yielded = rw.compliance[LANES * k + row - rows.start[k]] * rw.lam[row]
            grown = rw.held[TURNED, row] * (target[row] + yielded) + rw.held[CURVED, row]
            rw.grown[stage, 0, row], rw.grown[stage, 1, row] = rw.held[CORRECTED, row] + gh * grown, grown
