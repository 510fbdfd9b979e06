"""How many eigenvalues of a sparse symmetric matrix are negative: Sylvester's law of inertia, on the fronts of the Cholesky
factorisation.

For a shift sigma that is no eigenvalue, K - sigma M has as many negative eigenvalues as there are modes with omega2 below
sigma: none is missing where a search has found as many (a Sturm count). Under supports C u = 0, r of them, the same holds of

    [K - sigma M  C^T]
    [C            0  ]    less r.

Each front is split as L D L^T with symmetric pivots, which stay within the front, and is forgotten once its update is made:
the count takes a part of the memory of a factor.

Sources: B. N. Parlett, The Symmetric Eigenvalue Problem (1998), section 3.3 (Sylvester's law); R. G. Grimes, J. G. Lewis,
H. D. Simon, SIAM J. Matrix Anal. Appl. 15 (1994) 228-272, section 2.3 (the count); J. R. Bunch, L. Kaufman, Math. Comp. 31
(1977) 163-179 (pivots); N. I. M. Gould, SIAM J. Optim. 9 (1998) 1041-1063 (supports).
"""

from __future__ import annotations

import numba
import numpy as np
import scipy.sparse as sp

from ffr_prep.common.arrays import Array
from ffr_prep.common.compile_cache import check_compiled_code
from ffr_prep.common.process_memory import check_memory
from ffr_prep.common.progress import Advance, no_advance
from ffr_prep.solvers.cholesky import (
    LESS,
    Analysis,
    add_tiled,
    analysed,
    begun,
    on_branches,
    packed,
    progress_of,
    tiles,
    waiting,
    workspace,
)
from ffr_prep.solvers.multifrontal import (
    INTEGERS,
    LETTERS,
    LOWER,
    PLAIN,
    REALS,
    RIGHT,
    TRANSPOSED,
    Workspace,
    add,
    begin,
    divide,
    external,
    pack,
    product,
    pushed,
    shape,
    taken,
)
from ffr_prep.solvers.threads import Map, finish, threads

check_compiled_code()

_SINGULAR = -1
_TILE = 384
_WORK = 64  # columns at once in LAPACK

_dsytrf = external("lapack", "dsytrf", LETTERS, INTEGERS, REALS, INTEGERS, INTEGERS, REALS, INTEGERS, INTEGERS)
_dsyconv = external("lapack", "dsyconv", *[LETTERS] * 2, INTEGERS, REALS, INTEGERS, INTEGERS, REALS, INTEGERS)


def modes_below(
    K: sp.csr_array, M: sp.csr_array, C: Array, positions: Array, sigma: float, advance: Advance = no_advance
) -> int:
    """How many modes under the supports C u = 0 (r, Z) have omega2 below sigma [rad^2/s^2], with multiplicity.

    positions : (Z, 3) where each unknown is; rows of NaN for unknowns that touch many others

    Raises numpy.linalg.LinAlgError when sigma is an eigenvalue to working precision: take another.
    """
    scale = np.abs(K.data).max() / np.abs(C).max(axis=1, keepdims=True)
    supports = sp.csr_array(scale * C)
    bordered = sp.csr_array(sp.block_array([[K - sigma * M, supports.T], [supports, None]], format="csr"))
    nowhere = np.full((len(C), 3), np.nan)
    return negative_eigenvalues(bordered, np.vstack([positions, nowhere]), advance) - len(C)


def negative_eigenvalues(A: sp.csr_array, positions: Array, advance: Advance = no_advance) -> int:
    """Number of negative eigenvalues of the regular symmetric A (n, n); the others as of `modes_below`."""
    analysis = analysed(A, positions)
    matrix, fronts, division = analysis.matrix, analysis.fronts, analysis.division
    check_memory(waiting(analysis), f"the count of modes of {len(matrix.order)} unknowns", LESS)
    elimination, updates, total = progress_of(analysis, advance), {}, 0
    with threads() as each:
        found = on_branches(_count_branch, fronts, division, matrix, each)
        for (first, last), (update, count) in zip(division.branches, found, strict=True):
            total += _checked(count)
            updates[int(last)] = update
            elimination.add(int(first), int(last))
        space = workspace(fronts, division.in_trunk, len(matrix.place))
        for k in division.trunk:
            updates[k], count = _count_tiled(analysis, k, updates, space, each)
            total += _checked(count)
            elimination.add(k, k)
    return total


def _checked(count: int) -> int:
    if count == _SINGULAR:
        raise np.linalg.LinAlgError("a pivot is zero")
    return count


def _count_tiled(
    analysis: Analysis, k: int, updates: dict[int, Array], space: Workspace, each: Map
) -> tuple[Array, int]:
    """The update of a large front and its negative pivots, on all threads by tiles that do not depend on their number."""
    own, rest = shape(analysis.fronts, k)
    panel, update = begun(analysis.fronts, k, analysis.matrix, space)
    for child in analysis.division.below[k]:
        add_tiled(analysis.fronts, child, updates.pop(child), panel, update, space.local, each)
    count, pivots, d, e = _split(panel)
    scaled = np.empty((own, rest))
    if count != _SINGULAR:
        finish(each(lambda rows: _divided(panel, pivots, d, e, scaled, *rows), tiles(0, rest)))
        pairs = [(columns, rows) for columns in tiles(0, rest) for rows in tiles(0, rest) if rows >= columns]
        finish(each(lambda pair: _update_tile(panel, scaled, update, *pair[0], *pair[1]), pairs))
    return packed(update, each), count


# ---- compiled -----------------------------------------------------------------------------------------------------


@numba.njit(cache=True, nogil=True)
def _count_branch(fronts, first, last, A, space):  # type: ignore[no-untyped-def]
    """As `eliminate_branch`, by L D L^T and without keeping the panels: the update of the last front, negative pivots."""
    waiting, local = space.waiting, space.local
    pending = np.empty(last - first + 1, np.int64)
    places = np.zeros(last - first + 2, np.int64)
    height, total = 0, 0
    for k in range(first, last + 1):
        panel, update = taken(fronts, k, space)
        begin(fronts, k, panel, A, update, local)
        for h in range(height - fronts.children[k], height):
            of_child = waiting[places[h] : places[h + 1]]
            add(fronts, pending[h], of_child, panel, update, local, 0, len(of_child))
        count = _eliminate(panel, update)
        if count == _SINGULAR:
            total = _SINGULAR
            break
        total += count
        height = pushed(fronts, k, pending, places, height)
        pack(update, waiting[places[height - 1] : places[height]], 0, len(update))
    return waiting[: places[height]].copy(), total


@numba.njit(cache=True, nogil=True)
def _eliminate(panel, update):  # type: ignore[no-untyped-def]
    """Complete the update (rest, rest) of a front; the number of its negative pivots or _SINGULAR."""
    rest = update.shape[0]
    count, pivots, d, e = _split(panel)
    if count == _SINGULAR or rest == 0:
        return count
    scaled = np.empty((panel.shape[0], rest))
    _divided(panel, pivots, d, e, scaled, 0, rest)
    for first in range(0, rest, _TILE):
        _update_tile(panel, scaled, update, first, min(first + _TILE, rest), first, rest)
    return count


@numba.njit(cache=True, nogil=True)
def _split(panel):  # type: ignore[no-untyped-def]
    """The own block becomes the unit L of P L D L^T P^T: negative eigenvalues of D, pivots as LAPACK has them, diagonal
    and subdiagonal of D."""
    own, size = panel.shape
    letters = np.array([LOWER, ord("C")], np.uint8)
    sizes = np.array([own, size, own * _WORK, 0], np.int32)
    pivots, work, e = np.zeros(own, np.int32), np.empty(own * _WORK), np.zeros(own)
    _dsytrf(
        letters.ctypes, sizes.ctypes, panel.ctypes, sizes[1:].ctypes, pivots.ctypes, work.ctypes, sizes[2:].ctypes,
        sizes[3:].ctypes,
    )  # fmt: skip
    singular = sizes[3] != 0
    _dsyconv(
        letters.ctypes, letters[1:].ctypes, sizes.ctypes, panel.ctypes, sizes[1:].ctypes, pivots.ctypes, e.ctypes,
        sizes[3:].ctypes,
    )  # fmt: skip
    d = np.empty(own)
    count = 0
    for c in range(own):
        d[c] = panel[c, c]
        panel[c, c] = 1.0
        if e[c] != 0.0:
            count += 1  # of a pivot of two by two one eigenvalue is negative
        elif d[c] < 0.0 and not (c > 0 and e[c - 1] != 0.0):
            count += 1
    return _SINGULAR if singular else count, pivots, d, e


@numba.njit(cache=True, nogil=True)
def _divided(panel, pivots, d, e, scaled, first, last):  # type: ignore[no-untyped-def]
    """Rows first...last of the boundary: L^-1 P^T of them in the panel, D^-1 of this in `scaled` (own, rest)."""
    own, size = panel.shape
    c = 0
    while c < own:
        wide = pivots[c] < 0
        one = c + 1 if wide else c
        other = -pivots[c] - 1 if wide else pivots[c] - 1
        if other != one:
            for i in range(own + first, own + last):
                panel[one, i], panel[other, i] = panel[other, i], panel[one, i]
        c += 2 if wide else 1
    flat = panel.reshape(panel.size)
    divide(RIGHT, True, flat, flat[own + first :], last - first, own, size, size)
    c = 0
    while c < own:
        if e[c] == 0.0:
            for i in range(first, last):
                scaled[c, i] = panel[c, own + i] / d[c]
            c += 1
        else:
            a, b = d[c] / e[c], d[c + 1] / e[c]
            whole = (a * b - 1.0) * e[c]
            for i in range(first, last):
                above, below = panel[c, own + i], panel[c + 1, own + i]
                scaled[c, i] = (b * above - below) / whole
                scaled[c + 1, i] = (a * below - above) / whole
            c += 2


@numba.njit(cache=True, nogil=True)
def _update_tile(panel, scaled, update, first, last, top, bottom):  # type: ignore[no-untyped-def]
    """Columns first...last and rows top...bottom of an update."""
    own, size = panel.shape
    rest = size - own
    target = update.reshape(update.size)[first * rest + top :]
    left = panel.reshape(panel.size)[own + top :]
    right = scaled.reshape(scaled.size)[first:]
    product(PLAIN, TRANSPOSED, left, right, target, bottom - top, last - first, own, (size, rest, rest), -1.0)
