"""Dense fronts of a multifrontal factorisation: compiled, without the interpreter's lock, on one thread each.

A front belongs to one piece of unknowns. Its panel holds their columns of the matrix, own unknowns first, then the later
unknowns that they touch (the boundary); elimination turns it into the columns of the Cholesky factor, and leaves an
update of the boundary by the boundary, of which only the lower triangle counts. Arrays are [column, row]: a column is
contiguous, as BLAS and LAPACK want it.

What waits is kept without zeros: panels in strips of columns, each from its first column's diagonal on, updates as their
lower triangle, column after column. Of a leaf, a front with no other below it, the own block alone is kept: with A_21 the
rows of the matrix at the boundary, its rows of the factor are L_21 = A_21 L_11^-T, and A_21 is sparse.

Sources: J. W. H. Liu, SIAM Review 34 (1992) 82-109 (the multifrontal method); A. George, J. W. H. Liu, Computer Solution of
Large Sparse Positive Definite Systems (1981), section 6.2 (factors of which a part is kept as the matrix).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import llvmlite.binding
import numba
import numpy as np
from numba import types
from numba.extending import get_cython_function_address

from ffr_prep.common.arrays import Array
from ffr_prep.common.compile_cache import check_compiled_code

check_compiled_code()

DONE = -1

REALS = types.CPointer(types.float64)
INTEGERS = types.CPointer(types.int32)
LETTERS = types.CPointer(types.uint8)

STRIP = 32


class Fronts(NamedTuple):
    """All fronts of a matrix, one after the other in the order of elimination.

    starts   : (F + 1,) first unknown of each, in that order
    ends     : (F + 1,) where the boundary of each is in `boundary`, ascending
    offsets  : (F + 1,) where the strips of the panel of each are in `panels`
    children : (F,) how many fronts are directly below each; in that order they are the last ones without a parent
    """

    starts: Array
    ends: Array
    boundary: Array
    offsets: Array
    panels: Array
    children: Array


class Sorted(NamedTuple):
    """A symmetric matrix by rows, with the unknown at each place of the elimination and the place of each unknown."""

    indptr: Array
    indices: Array
    data: Array
    order: Array
    place: Array


class Workspace(NamedTuple):
    """Memory for a front at work, its panel and its update, for the updates that wait, and (n,) for places."""

    panel: Array
    update: Array
    waiting: Array
    local: Array


# ---- BLAS and LAPACK ----------------------------------------------------------------------------------------------


def external(library: str, name: str, *arguments: types.Type) -> Any:
    """SciPy's copy of a BLAS or LAPACK function under a name that compiled and cached code finds again."""
    llvmlite.binding.add_symbol(f"ffr_{name}", get_cython_function_address(f"scipy.linalg.cython_{library}", name))
    return types.ExternalFunction(f"ffr_{name}", types.void(*arguments))


_dgemm = external(
    "blas", "dgemm", *[LETTERS] * 2, *[INTEGERS] * 3, *[REALS] * 2, INTEGERS, REALS, INTEGERS, *[REALS] * 2, INTEGERS
)  # fmt: skip
_dsyrk = external("blas", "dsyrk", *[LETTERS] * 2, *[INTEGERS] * 2, *[REALS] * 2, INTEGERS, *[REALS] * 2, INTEGERS)
_dtrsm = external("blas", "dtrsm", *[LETTERS] * 4, *[INTEGERS] * 2, *[REALS] * 2, INTEGERS, REALS, INTEGERS)
_dpotrf = external("lapack", "dpotrf", LETTERS, INTEGERS, REALS, INTEGERS, INTEGERS)

LOWER, PLAIN, TRANSPOSED, LEFT, RIGHT = (ord(letter) for letter in "LNTLR")


@numba.njit(cache=True, nogil=True)
def product(of_A, of_B, A, B, C, rows, columns, inner, ld, factor):  # type: ignore[no-untyped-def]
    """C (rows, columns) = factor A B, added to C if the factor is negative.

    of_A, of_B : PLAIN or TRANSPOSED, how A (rows, inner) and B (inner, columns) are stored; ld : leading dimensions
    """
    letters = np.array([of_A, of_B], np.uint8)
    sizes = np.array([rows, columns, inner, ld[0], ld[1], ld[2]], np.int32)
    factors = np.array([factor, 1.0 if factor < 0 else 0.0])
    _dgemm(
        letters.ctypes, letters[1:].ctypes, sizes.ctypes, sizes[1:].ctypes, sizes[2:].ctypes, factors.ctypes,
        A.ctypes, sizes[3:].ctypes, B.ctypes, sizes[4:].ctypes, factors[1:].ctypes, C.ctypes, sizes[5:].ctypes,
    )  # fmt: skip


@numba.njit(cache=True, nogil=True)
def minus_square(A, C, size, inner, ld_A, ld_C):  # type: ignore[no-untyped-def]
    """C - A A^T, lower triangle; A (size, inner)."""
    letters = np.array([LOWER, PLAIN], np.uint8)
    sizes = np.array([size, inner, ld_A, ld_C], np.int32)
    factors = np.array([-1.0, 1.0])
    _dsyrk(
        letters.ctypes, letters[1:].ctypes, sizes.ctypes, sizes[1:].ctypes, factors.ctypes,
        A.ctypes, sizes[2:].ctypes, factors[1:].ctypes, C.ctypes, sizes[3:].ctypes,
    )  # fmt: skip


@numba.njit(cache=True, nogil=True)
def divide(side, transposed, L, B, rows, columns, ld_L, ld_B):  # type: ignore[no-untyped-def]
    """B (rows, columns) becomes L^-1 B or L^-T B with side LEFT, B L^-1 or B L^-T with side RIGHT."""
    letters = np.array([side, LOWER, TRANSPOSED if transposed else PLAIN, PLAIN], np.uint8)
    sizes = np.array([rows, columns, ld_L, ld_B], np.int32)
    one = np.ones(1)
    _dtrsm(
        letters.ctypes, letters[1:].ctypes, letters[2:].ctypes, letters[3:].ctypes, sizes.ctypes, sizes[1:].ctypes,
        one.ctypes, L.ctypes, sizes[2:].ctypes, B.ctypes, sizes[3:].ctypes,
    )  # fmt: skip


@numba.njit(cache=True, nogil=True)
def triangular(A, size, ld):  # type: ignore[no-untyped-def]
    """A becomes its Cholesky factor; the number (from 1) of the pivot that is not positive, or 0."""
    letters = np.array([LOWER], np.uint8)
    sizes = np.array([size, ld, 0], np.int32)
    _dpotrf(letters.ctypes, sizes.ctypes, A.ctypes, sizes[1:].ctypes, sizes[2:].ctypes)
    return sizes[2]


# ---- symbolic -----------------------------------------------------------------------------------------------------


@numba.njit(cache=True)
def boundaries(starts, children, A):  # type: ignore[no-untyped-def]
    """Ends (F + 1,) and the boundaries of all fronts: later unknowns touched by the matrix or by the fronts below."""
    count = children.size
    ends = np.zeros(count + 1, np.int64)
    found = np.empty(A.place.size, np.int32)
    boundary = np.empty(max(1024, 8 * A.place.size), np.int32)
    seen = np.full(A.place.size, -1, np.int32)
    pending = np.empty(count, np.int64)
    height = 0
    for k in range(count):
        size = 0
        for p in range(starts[k], starts[k + 1]):
            row = A.order[p]
            for unknown in A.indices[A.indptr[row] : A.indptr[row + 1]]:
                size = _noted(A.place[unknown], k, starts[k + 1], seen, found, size)
        for child in pending[height - children[k] : height]:
            for place in boundary[ends[child] : ends[child + 1]]:
                size = _noted(place, k, starts[k + 1], seen, found, size)
        height -= children[k]
        pending[height] = k
        height += 1
        ends[k + 1] = ends[k] + size
        if ends[k + 1] > boundary.size:
            boundary = np.concatenate((boundary, np.empty(boundary.size + size, np.int32)))
        boundary[ends[k] : ends[k + 1]] = np.sort(found[:size])
    return ends, boundary[: ends[count]].copy()


@numba.njit(cache=True)
def _noted(place, front, stop, seen, found, size):  # type: ignore[no-untyped-def]
    """Note a later place once per front; the number noted so far."""
    if place >= stop and seen[place] != front:
        seen[place] = front
        found[size] = place
        return size + 1
    return size


# ---- numeric ------------------------------------------------------------------------------------------------------


@numba.njit(cache=True, nogil=True)
def shape(fronts, k):  # type: ignore[no-untyped-def]
    """Number of own and of boundary unknowns."""
    return fronts.starts[k + 1] - fronts.starts[k], fronts.ends[k + 1] - fronts.ends[k]


def kept(own: Array, rows: Array) -> Array:
    """How many numbers the strips of panels (own, rows) have."""
    whole, last = own // STRIP, own % STRIP
    return STRIP * (whole * rows - STRIP * (whole * (whole - 1) // 2)) + last * (rows - STRIP * whole)


@numba.njit(cache=True, nogil=True)
def tall(fronts, k):  # type: ignore[no-untyped-def]
    """How many rows of the panel of a front are kept: the own ones of a leaf, all of the others."""
    own, rest = shape(fronts, k)
    return own + rest if fronts.children[k] else own


@numba.njit(cache=True, nogil=True)
def keep(fronts, k, panel, first, last):  # type: ignore[no-untyped-def]
    """Columns first...last of the panel (own, own + rest) of a front that is eliminated, as strips into the factor; the first
    begins a strip."""
    size, strips = tall(fronts, k), first // STRIP
    at = fronts.offsets[k] + STRIP * (strips * size - STRIP * (strips * (strips - 1) // 2))
    for c in range(first, min(last, panel.shape[0])):
        top = c - c % STRIP
        fronts.panels[at : at + size - top] = panel[c, top:size]
        at += size - top


@numba.njit(cache=True, nogil=True)
def triangle(rest):  # type: ignore[no-untyped-def]
    """How many numbers the lower triangle of an update has."""
    return rest * (rest + 1) // 2


@numba.njit(cache=True, nogil=True)
def pack(update, lower, first, last):  # type: ignore[no-untyped-def]
    """Columns first...last of the lower triangle of an update (rest, rest), into an array that has all of it."""
    rest = update.shape[0]
    at = first * rest - triangle(first - 1)
    for j in range(first, min(last, rest)):
        lower[at : at + rest - j] = update[j, j:]
        at += rest - j


@numba.njit(cache=True, nogil=True)
def begin(fronts, k, panel, A, update, local):  # type: ignore[no-untyped-def]
    """The matrix into the panel of a front (own, own + rest), zeros into its update (rest, rest); local (n,) is where its
    unknowns are."""
    own, rest = shape(fronts, k)
    start, stop = fronts.starts[k], fronts.starts[k + 1]
    local[start:stop] = np.arange(own)
    local[fronts.boundary[fronts.ends[k] : fronts.ends[k + 1]]] = np.arange(own, own + rest)
    panel[:] = 0.0
    for p in range(start, stop):
        row = A.order[p]
        for e in range(A.indptr[row], A.indptr[row + 1]):
            place = A.place[A.indices[e]]
            if place >= p:
                panel[p - start, local[place]] = A.data[e]
    for j in range(rest):
        update[j, j:] = 0.0


@numba.njit(cache=True, nogil=True)
def add(fronts, child, of_child, panel, update, local, first, last):  # type: ignore[no-untyped-def]
    """Add columns first...last of the update of a front below, a triangle, to a front that has begun."""
    places = local[fronts.boundary[fronts.ends[child] : fronts.ends[child + 1]]]
    own, size = panel.shape[0], places.size
    for j in range(first, min(last, size)):
        column = of_child[j * size - triangle(j) : (j + 1) * size - triangle(j)]
        if places[j] < own:
            for i in range(j, size):
                panel[places[j], places[i]] += column[i]
        else:
            for i in range(j, size):
                update[places[j] - own, places[i] - own] += column[i]


@numba.njit(cache=True, nogil=True)
def eliminate(fronts, k, panel, update):  # type: ignore[no-untyped-def]
    """The panel becomes columns of the factor, the update is completed; the first bad pivot or DONE."""
    own, rest = shape(fronts, k)
    size = own + rest
    flat = panel.reshape(panel.size)
    bad = triangular(flat, own, size)
    if bad:
        return fronts.starts[k] + bad - 1
    if rest:
        divide(RIGHT, True, flat, flat[own:], rest, own, size, size)
        minus_square(flat[own:], update, rest, own, size, rest)
    keep(fronts, k, panel, 0, own)
    return DONE


@numba.njit(cache=True, nogil=True)
def eliminate_branch(fronts, first, last, A, space):  # type: ignore[no-untyped-def]
    """Eliminate the fronts first...last, a front and all below it: the update of the last, and a bad pivot or DONE."""
    waiting, local = space.waiting, space.local
    pending = np.empty(last - first + 1, np.int64)
    places = np.zeros(last - first + 2, np.int64)
    height = 0
    for k in range(first, last + 1):
        panel, update = taken(fronts, k, space)
        begin(fronts, k, panel, A, update, local)
        for h in range(height - fronts.children[k], height):
            of_child = waiting[places[h] : places[h + 1]]
            add(fronts, pending[h], of_child, panel, update, local, 0, len(of_child))
        bad = eliminate(fronts, k, panel, update)
        if bad != DONE:
            break
        height = pushed(fronts, k, pending, places, height)
        pack(update, waiting[places[height - 1] : places[height]], 0, len(update))
    return waiting[: places[height]].copy(), bad


@numba.njit(cache=True, nogil=True)
def taken(fronts, k, space):  # type: ignore[no-untyped-def]
    """The panel (own, own + rest) and the update (rest, rest) of a front, of the workspace."""
    own, rest = shape(fronts, k)
    panel = space.panel[: own * (own + rest)].reshape((own, own + rest))
    return panel, space.update[: rest**2].reshape((rest, rest))


@numba.njit(cache=True, nogil=True)
def pushed(fronts, k, pending, places, height):  # type: ignore[no-untyped-def]
    """The update of a front takes the place of those below it: how many wait then."""
    height -= fronts.children[k]
    pending[height] = k
    places[height + 1] = places[height] + triangle(shape(fronts, k)[1])
    return height + 1


@numba.njit(cache=True, nogil=True)
def most_waiting(fronts, first, last, pending, places):  # type: ignore[no-untyped-def]
    """How large the updates of the fronts first...last become together; the arrays are for work."""
    height, most = 0, 0
    for k in range(first, last + 1):
        height = pushed(fronts, k, pending, places, height)
        most = max(most, places[height])
    return most


@numba.njit(cache=True, nogil=True)
def largest(fronts, first, last):  # type: ignore[no-untyped-def]
    """How many numbers the largest panel and the largest update of the fronts first...last have."""
    panel, update = 0, 0
    for k in range(first, last + 1):
        own, rest = shape(fronts, k)
        panel, update = max(panel, own * (own + rest)), max(update, rest**2)
    return panel, update


# ---- tiles of large fronts ----------------------------------------------------------------------------------------


@numba.njit(cache=True, nogil=True)
def diagonal_tile(panel, size, first, last):  # type: ignore[no-untyped-def]
    """Factorise the diagonal tile of the columns first...last of a panel, the columns before being done: as LAPACK."""
    corner = panel[first * size + first :]
    product(
        PLAIN,
        TRANSPOSED,
        panel[first:],
        panel[first:],
        corner,
        last - first,
        last - first,
        first,
        (size, size, size),
        -1.0,
    )
    return triangular(corner, last - first, size)


@numba.njit(cache=True, nogil=True)
def row_tile(panel, size, first, last, top, bottom):  # type: ignore[no-untyped-def]
    """Rows top...bottom of the same columns, the diagonal tile being done."""
    tile, tall = panel[first * size + top :], bottom - top
    product(PLAIN, TRANSPOSED, panel[top:], panel[first:], tile, tall, last - first, first, (size, size, size), -1.0)
    divide(RIGHT, True, panel[first * size + first :], tile, tall, last - first, size, size)


@numba.njit(cache=True, nogil=True)
def update_tile(panel, own, update, first, last, top, bottom):  # type: ignore[no-untyped-def]
    """Columns first...last and rows top...bottom of an update, the panel being done."""
    rest = update.shape[0]
    size = own + rest
    target = update.reshape(update.size)[first * rest + top :]
    left, right = panel[own + top :], panel[own + first :]
    product(PLAIN, TRANSPOSED, left, right, target, bottom - top, last - first, own, (size, size, rest), -1.0)
