"""The multiplier system  (sum_b Phi_q M^-1 Phi_q^T) lambda = rhs, sparse in blocks of one joint each.

The elimination order and the fill are fixed per topology by `ffr_dyn.elimination`: for chains and trees the cost is
linear in the number of bodies (Baraff 1996), for a few loops there is little fill.
"""

from ffr_dyn.kernels.options import inlined, kernel
from ffr_dyn.kernels.vectors import in_plane, rigid_lower, solve_lower, solve_upper

# The least share of a row that other rows do not contain (the square of a sine). In a singular position it is zero; with
# this floor the motion there misses one acceleration for the moment, and goes on.
FLOOR = 1e-13


@inlined
def eliminate_side(first, last, side, flexible, normal, P, L, mass, turning, all_jac, all_rr, all_ww, scale):
    """Rows first ... last of one side: rr = rigid part after elimination of the elastic coordinates, ww = L^-1 rr.

    scale : gathers what the row's own part of the multiplier matrix is at least, by the mass or the trace of the inertia
            `turning` of the body
    """
    for row in range(first, last):
        jac, rr, ww = all_jac[row, side], all_rr[row, side], all_ww[row, side]
        for c in range(6):
            rr[c] = jac[c]
        if flexible and normal < 0:
            for c in range(6):
                rr[c] -= six(P, c, jac)
        elif flexible:
            for c in in_plane(normal):
                rr[c] -= six(P, c, jac)
        for c in range(6):
            ww[c] = rr[c]
        rigid_lower(L, ww, normal)
        point = jac[0] * jac[0] + jac[1] * jac[1] + jac[2] * jac[2]
        if point > 0.0:
            scale[row] += point / mass
        else:
            scale[row] += (jac[3] * jac[3] + jac[4] * jac[4] + jac[5] * jac[5]) / turning


@kernel
def six(matrix, r, jac):
    """Row r of a 6 x 6 matrix times the point and elastic-rotation coefficients of a row."""
    return (
        matrix[r, 0] * jac[0] + matrix[r, 1] * jac[1] + matrix[r, 2] * jac[2]
        + matrix[r, 3] * jac[6] + matrix[r, 4] * jac[7] + matrix[r, 5] * jac[8]
    )  # fmt: skip


@inlined
def add_pair(starts, pair, flexible, phiphi, ww, jac, S):
    """Add the coupling of two block sides on one body to its block of S."""
    later, side_a, earlier, side_b, offset = pair[0], pair[1], pair[2], pair[3], pair[4]
    start_a, start_b = starts[later], starts[earlier]
    rows_a, rows_b = starts[later + 1] - start_a, starts[earlier + 1] - start_b
    for c in range(rows_b):
        wc, jc = ww[start_b + c, side_b], jac[start_b + c, side_b]
        w0, w1, w2, w3, w4, w5 = wc[0], wc[1], wc[2], wc[3], wc[4], wc[5]
        first = c if later == earlier else 0
        t0, t1, t2, t3, t4, t5 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        if flexible:
            t0, t1, t2 = six(phiphi, 0, jc), six(phiphi, 1, jc), six(phiphi, 2, jc)
            t3, t4, t5 = six(phiphi, 3, jc), six(phiphi, 4, jc), six(phiphi, 5, jc)
        for a in range(first, rows_a):
            wa, ja = ww[start_a + a, side_a], jac[start_a + a, side_a]
            value = wa[0] * w0 + wa[1] * w1 + wa[2] * w2 + wa[3] * w3 + wa[4] * w4 + wa[5] * w5
            if flexible:
                value += ja[0] * t0 + ja[1] * t1 + ja[2] * t2 + ja[6] * t3 + ja[7] * t4 + ja[8] * t5
            S[offset + a * rows_b + c] += value


@inlined
def block(S, offset, rows, columns):
    return S[offset : offset + rows * columns].reshape(rows, columns)


@inlined
def factorise_blocks(starts, pattern, S, relaxation, scale, independence):
    """Factorise in place (right-looking block Cholesky). Returns the row without a pivot, or -1.

    scale (C,)        : what the entry of a row on the diagonal is at least
    independence (1,) : the least share of a row that the rows before it do not contain
    """
    independence[0] = 1.0
    for k in range(starts.size - 1):
        size = starts[k + 1] - starts[k]
        diagonal = block(S, pattern.diagonal[k], size, size)
        for row in range(size):
            diagonal[row, row] *= 1.0 + relaxation
    for k in range(starts.size - 1):
        size = starts[k + 1] - starts[k]
        diagonal = block(S, pattern.diagonal[k], size, size)
        failed = pivots(diagonal, size, scale[starts[k] : starts[k + 1]], independence)
        if failed >= 0:
            return starts[k] + failed
        eliminate_block(starts, pattern, S, k, size, diagonal)
    return -1


@kernel
def pivots(matrix, size, scale, independence):
    """In-place lower Cholesky factor with reciprocal diagonal, pivots at least FLOOR of `scale`."""
    for j in range(size):
        pivot = matrix[j, j]
        for k in range(j):
            pivot -= matrix[j, k] * matrix[j, k]
        share = pivot / scale[j]
        if not scale[j] > 0.0 or share != share:
            return j
        independence[0] = min(independence[0], share)
        inverse = 1.0 / (max(share, FLOOR) * scale[j]) ** 0.5
        matrix[j, j] = inverse
        for i in range(j + 1, size):
            value = matrix[i, j]
            for k in range(j):
                value -= matrix[i, k] * matrix[j, k]
            matrix[i, j] = value * inverse
    return -1


@inlined
def eliminate_block(starts, pattern, S, k, size, diagonal):
    update, first = pattern.update_start[k], pattern.column_start[k]
    for entry in range(first, pattern.column_start[k + 1]):
        later = pattern.column[entry, 0]
        rows = starts[later + 1] - starts[later]
        X = block(S, pattern.column[entry, 1], rows, size)
        for a in range(rows):
            solve_lower(diagonal, X[a], size)
        for other in range(first, entry + 1):
            earlier = pattern.column[other, 0]
            columns = starts[earlier + 1] - starts[earlier]
            Y = block(S, pattern.column[other, 1], columns, size)
            subtract_product(block(S, pattern.update[update], rows, columns), X, Y, size)
            update += 1


@kernel
def subtract_product(target, X, Y, size):
    """target -= X Y^T."""
    for a in range(X.shape[0]):
        for c in range(Y.shape[0]):
            total = 0.0
            for k in range(size):
                total += X[a, k] * Y[c, k]
            target[a, c] -= total


@kernel
def solve_blocks(starts, pattern, S, lam):
    """In place lam <- S^-1 lam."""
    for k in range(starts.size - 1):
        start, size = starts[k], starts[k + 1] - starts[k]
        solve_lower(block(S, pattern.diagonal[k], size, size), lam[start : start + size], size)
        for entry in range(pattern.column_start[k], pattern.column_start[k + 1]):
            later = pattern.column[entry, 0]
            target, rows = starts[later], starts[later + 1] - starts[later]
            X = block(S, pattern.column[entry, 1], rows, size)
            for a in range(rows):
                for c in range(size):
                    lam[target + a] -= X[a, c] * lam[start + c]
    for k in range(starts.size - 2, -1, -1):
        start, size = starts[k], starts[k + 1] - starts[k]
        for entry in range(pattern.column_start[k], pattern.column_start[k + 1]):
            later = pattern.column[entry, 0]
            source, rows = starts[later], starts[later + 1] - starts[later]
            X = block(S, pattern.column[entry, 1], rows, size)
            for c in range(size):
                for a in range(rows):
                    lam[start + c] -= X[a, c] * lam[source + a]
        solve_upper(block(S, pattern.diagonal[k], size, size), lam[start : start + size], size)
