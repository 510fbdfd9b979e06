"""The multiplier system  (sum_b Phi_q M^-1 Phi_q^T) lambda = rhs, sparse in blocks of one joint each.

The elimination order and the fill are fixed per topology by `ffr_dyn.compile.elimination`: for chains and trees the cost is
linear in the number of bodies (Baraff 1996), for a few loops there is little fill.

A block of S couples the rows of an earlier joint with those of a later one: a row of eight numbers (see `simd.lanes`) for
each row of the earlier, with the rows of the later side by side in it. The factor is S = U^T D U, with ones on the diagonal
of U.

Twin: `ffr_dyn.equations.motion.solve`.
"""

from ffr_dyn.kernels.options import inlined, kernel
from ffr_dyn.kernels.simd.lanes import after, before, less, load, plus, scaled, store, times, total, zeros
from ffr_dyn.kernels.simd.slices import part, peek
from ffr_dyn.kernels.tables import HERE, LANES
from ffr_dyn.kernels.vectors import fill

# The least share of a row that other rows do not contain (the square of a sine). In a singular position it is zero; with
# this floor the motion there misses one acceleration for the moment, and goes on.
FLOOR = 1e-13
SIDE = 12 * LANES  # numbers of X per side of a joint


# ---- the rows of a joint on one body -----------------------------------------------------------------------------------


@kernel
def add_scale(jac, by_mass, by_inertia, scale, at):
    """Add to the row of lanes at `at` what the rows' own part of S is at least, by the inverse mass or inertia of the body
    of a side.

    jac : (9 * 8,) coefficients of the side
    """
    for k in range(at, at + LANES):
        row = k - at
        point = jac[row] ** 2 + jac[LANES + row] ** 2 + jac[2 * LANES + row] ** 2
        turn = jac[3 * LANES + row] ** 2 + jac[4 * LANES + row] ** 2 + jac[5 * LANES + row] ** 2
        scale[k] += point * by_mass if point > 0.0 else turn * by_inertia


@kernel
def eliminate_side(jac, rigid, elastic, flexible, P, L, X, at):
    """X = L^-1 (rigid - P elastic): what is left of a side without the elastic coordinates; then elastic.

    jac            : (9 * 8,) coefficients of the side
    rigid, elastic : which of them belong to the rigid coordinates that move, and to the elastic ones
    P, L           : P has a row for each of those rigid coordinates, L (36,) of all six
    """
    size = len(rigid)
    for c in range(size):
        row = load(jac, LANES * rigid[c])
        if flexible:
            store(X, at + LANES * (size + c), load(jac, LANES * elastic[c]))
            for k in range(size):
                row = less(row, peek(P, size * c + k), load(jac, LANES * elastic[k]))
        for k in range(c):
            row = less(row, peek(L, 6 * rigid[c] + rigid[k]), load(X, at + LANES * k))
        store(X, at + LANES * c, scaled(peek(L, 7 * rigid[c]), row))


@kernel
def couple_sides(X, later, earlier, rows, size, flexible, phiphi, scratch, S, at):
    """Add the coupling of two sides on one body to its block of S, at `at`.

    later, earlier : where the sides begin in X;  rows : of the earlier;  size : rigid coordinates that move
    phiphi         : phi dinv phi^T of the two markers, size^2 numbers
    """
    if flexible:
        for c in range(size):
            row = zeros()
            for k in range(size):
                row = plus(row, peek(phiphi, size * k + c), load(X, later + LANES * (size + k)))
            store(scratch, LANES * c, row)
    for r in range(rows):
        row = load(S, at + LANES * r)
        for k in range(size):
            row = plus(row, peek(X, earlier + LANES * k + r), load(X, later + LANES * k))
        if flexible:
            for k in range(size):
                row = plus(row, peek(X, earlier + LANES * (size + k) + r), load(scratch, LANES * k))
        store(S, at + LANES * r, row)


# ---- blocks ------------------------------------------------------------------------------------------------------------


@kernel
def clear_column(pattern, S, k):
    """Zeros in the column of block k."""
    first = pattern.diagonal[k]
    end = pattern.diagonal[k + 1] if k + 1 < pattern.diagonal.size else S.size
    fill(part(S, first, end - first), 0.0)


@kernel
def relax_block(starts, pattern, S, relaxation, k):
    """Add to block k on the diagonal what lets dependent rows be eliminated. To all of it, to be the same in all axes."""
    size = starts[k + 1] - starts[k]
    for row in range(size):
        for column in range(size):
            S[pattern.diagonal[k] + LANES * row + column] *= 1.0 + relaxation


@inlined
def factorise_block(starts, forced, pattern, S, rw, independence, k):
    """Factorise block k in place (right-looking). Returns the row without a pivot, or -1.

    rw.scale (8 K,)   : what the entry of a row on the diagonal is at least
    rw.relief (8 K,)  : what rows of stiff forces took of it, which bind nothing
    independence (1,) : the least share of a row that the constraint rows before it do not contain, so far
    """
    size, own, joints = starts[k + 1] - starts[k], LANES * k, forced[k] - starts[k]
    for row in range(size):
        rw.least[own + row] = FLOOR * rw.scale[own + row]
    factorise_rows(size, S, pattern.diagonal[k], rw.least, own, rw.pivots, own, rw.Y)
    for c in range(joints):
        scale = rw.scale[own + c]
        share = (rw.Y[c] + rw.relief[own + c]) / scale
        if not scale > 0.0 or share != share:
            return starts[k] + c
        independence[HERE] = min(independence[HERE], share)
    eliminate_block(starts, pattern, S, k, size, joints, rw.pivots, rw.relief, rw.Y)
    return -1


@inlined
def eliminate_block(starts, pattern, S, k, size, joints, pivots, relief, Y):
    update, first, diagonal = pattern.update_start[k], pattern.column_start[k], pattern.diagonal[k]
    for entry in range(first, pattern.column_start[k + 1]):
        eliminate_rows(size, S, diagonal, pattern.column[entry, 1], pivots, LANES * k, Y)
        relieve(size, joints, S, pattern.column[entry, 1], Y, relief, LANES * pattern.column[entry, 0])
        for other in range(first, entry + 1):
            earlier, Z = pattern.column[other, 0], pattern.column[other, 1]
            target = pattern.update[update]
            for row in range(starts[earlier + 1] - starts[earlier]):
                subtract_product(size, S, target + LANES * row, Z + row, Y)
            update += 1


@kernel
def factorise_rows(size, S, at, least, first, pivots, own, raw):
    """S = U^T D U in place for a block of `size` rows; 1 / D goes to `pivots`.

    In row c of the block, lanes beyond c hold row c of U, lanes before c its column c: a solution needs both.

    least : what an entry of D is at least, from number `first`;  raw : row of lanes for what D was before
    """
    for c in range(size):
        place = at + LANES * c
        row, found = load(S, place), peek(S, place + c)
        raw[c] = found
        floor = peek(least, first + c)
        inverse = 1.0 / (found if found > floor else floor)
        unit = after(scaled(inverse, row), c)
        for i in range(c + 1, size):
            store(S, at + LANES * i, less(load(S, at + LANES * i), peek(S, place + i), unit))
        column = before(times(row, load(pivots, own)), c)  # S was symmetric
        pivots[own + c] = inverse
        store(S, place, plus(unit, 1.0, column))


@kernel
def eliminate_rows(size, S, diagonal, at, pivots, own, Y):
    """Y = U^-T times the block at `at`, which becomes D^-1 Y, for the factor of `size` rows at `diagonal`."""
    for c in range(size):
        row = load(S, at + LANES * c)
        for j in range(c):
            row = less(row, peek(S, diagonal + LANES * j + c), load(Y, LANES * j))
        store(Y, LANES * c, row)
        store(S, at + LANES * c, scaled(peek(pivots, own + c), row))


@kernel
def relieve(size, first, S, at, Y, relief, later):
    """The row of `relief` at `later` grows by what rows from `first` on take from the diagonal of a later block."""
    for c in range(first, size):
        row = times(load(S, at + LANES * c), load(Y, LANES * c))
        store(relief, later, plus(load(relief, later), 1.0, row))


@kernel
def subtract_product(size, S, target, numbers, Y):
    """The row of S at `target` less sum_c S[numbers + 8 c] Y_c, over `size` rows of Y."""
    row = load(S, target)
    for c in range(size):
        row = less(row, peek(S, numbers + LANES * c), load(Y, LANES * c))
    store(S, target, row)


@kernel
def solve_lower(size, S, diagonal, b, own):
    """The row of b at `own` becomes U^-T times it."""
    for c in range(size - 1):
        store(b, own, less(load(b, own), peek(b, own + c), after(load(S, diagonal + LANES * c), c)))


@kernel
def solve_upper(size, S, diagonal, b, own):
    """The row of b at `own` becomes U^-1 times it."""
    for c in range(size - 1, 0, -1):
        store(b, own, less(load(b, own), peek(b, own + c), before(load(S, diagonal + LANES * c), c)))


@kernel
def spread_lower(size, S, at, b, own, later):
    """The row of b at `later` less sum_c b[own + c] times row c of the block at `at`, over `size` rows."""
    row = load(b, later)
    for c in range(size):
        row = less(row, peek(b, own + c), load(S, at + LANES * c))
    store(b, later, row)


@kernel
def gather_upper(size, S, at, b, later, own):
    """b[own + c] less the product of row c of the block at `at` with the row of b at `later`, for `size` rows c."""
    other = load(b, later)
    for c in range(size):
        b[own + c] -= total(times(load(S, at + LANES * c), other))


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
        store(b, own, times(load(b, own), load(pivots, own)))
        for entry in range(pattern.column_start[k], pattern.column_start[k + 1]):
            gather_upper(size, S, pattern.column[entry, 1], b, LANES * pattern.column[entry, 0], own)
        solve_upper(size, S, pattern.diagonal[k], b, own)
