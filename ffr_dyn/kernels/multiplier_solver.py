"""The multiplier system  (sum_b Phi_q M^-1 Phi_q^T) lambda = rhs, sparse in blocks of one joint each.

The elimination order and the fill are fixed per topology by `ffr_dyn.compile.elimination`: for chains and trees the cost is
linear in the number of bodies (Baraff 1996), for a few loops there is little fill.

A block of S couples the rows of an earlier joint with those of a later one: a row of eight numbers (see `lanes`) for each row
of the earlier, with the rows of the later side by side in it. The factor is S = U^T D U, with ones on the diagonal of U.

Twin: `ffr_dyn.equations.motion.solve`.
"""

from ffr_dyn.kernels.options import inlined, kernel
from ffr_dyn.kernels.simd.simd_rows import (
    eliminate_rows,
    factorise_rows,
    gather_upper,
    multiply_row,
    solve_lower,
    solve_upper,
    spread_lower,
    subtract_product,
)
from ffr_dyn.kernels.simd.slices import part
from ffr_dyn.kernels.tables import HERE, LANES
from ffr_dyn.kernels.vectors import fill

# The least share of a row that other rows do not contain (the square of a sine). In a singular position it is zero; with
# this floor the motion there misses one acceleration for the moment, and goes on.
FLOOR = 1e-13
SIDE = 12 * LANES  # numbers of X per side of a joint


@kernel
def clear_column(pattern, S, k):
    """Zeros in the column of block k."""
    first = pattern.diagonal[k]
    end = pattern.diagonal[k + 1] if k + 1 < pattern.diagonal.size else S.size
    fill(part(S, first, end - first), 0.0)


@kernel
def relax_block(starts, pattern, S, relaxation, k):
    """Add to the diagonal of block k what lets dependent rows be eliminated."""
    for row in range(starts[k + 1] - starts[k]):
        S[pattern.diagonal[k] + (LANES + 1) * row] *= 1.0 + relaxation


@inlined
def factorise_block(starts, pattern, S, rw, independence, k):
    """Factorise block k in place (right-looking). Returns the row without a pivot, or -1.

    rw.scale (8 K,)   : what the entry of a row on the diagonal is at least
    independence (1,) : the least share of a row that the rows before it do not contain, so far
    """
    size, own = starts[k + 1] - starts[k], LANES * k
    for row in range(size):
        rw.least[own + row] = FLOOR * rw.scale[own + row]
    factorise_rows(size, S, pattern.diagonal[k], rw.least, own, rw.pivots, own, rw.Y)
    for c in range(size):
        share, scale = rw.Y[c] / rw.scale[own + c], rw.scale[own + c]
        if not scale > 0.0 or share != share:
            return starts[k] + c
        independence[HERE] = min(independence[HERE], share)
    eliminate_block(starts, pattern, S, k, size, rw.pivots, rw.Y)
    return -1


@inlined
def eliminate_block(starts, pattern, S, k, size, pivots, Y):
    update, first, diagonal = pattern.update_start[k], pattern.column_start[k], pattern.diagonal[k]
    for entry in range(first, pattern.column_start[k + 1]):
        eliminate_rows(size, S, diagonal, pattern.column[entry, 1], pivots, LANES * k, Y)
        for other in range(first, entry + 1):
            earlier, Z = pattern.column[other, 0], pattern.column[other, 1]
            target = pattern.update[update]
            for row in range(starts[earlier + 1] - starts[earlier]):
                subtract_product(size, S, target + LANES * row, Z + row, Y)
            update += 1


@kernel
def solve_blocks(starts, pattern, S, pivots, b):
    """In place b <- S^-1 b; b (8 K,): the rows of each joint in a row of lanes."""
    for k in range(starts.size - 1):
        size, own = starts[k + 1] - starts[k], LANES * k
        solve_lower(size, S, pattern.diagonal[k], b, own)
        for entry in range(pattern.column_start[k], pattern.column_start[k + 1]):
            spread_lower(size, S, pattern.column[entry, 1], b, own, LANES * pattern.column[entry, 0])
    for k in range(starts.size - 2, -1, -1):
        size, own = starts[k + 1] - starts[k], LANES * k
        multiply_row(b, own, pivots, own)
        for entry in range(pattern.column_start[k], pattern.column_start[k + 1]):
            gather_upper(size, S, pattern.column[entry, 1], b, LANES * pattern.column[entry, 0], own)
        solve_upper(size, S, pattern.diagonal[k], b, own)
