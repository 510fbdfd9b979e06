"""Solutions with a multifrontal factor: L^-1 and L^-T, front by front, compiled and on one thread each.

Where right-hand sides are few, a factor is read more than it is computed with, and BLAS would copy it to other places
first. Then some columns at a time pass over all right-hand sides while they are in the first cache.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numba
import numpy as np

from ffr_prep.common.arrays import Array
from ffr_prep.common.compile_cache import check_compiled_code
from ffr_prep.solvers.multifrontal import LEFT, PLAIN, STRIP, TRANSPOSED, divide, product, shape, tall

check_compiled_code()

SIDES = 4  # right-hand sides at a time; a solution has a multiple of them
_FEW = 16  # right-hand sides; BLAS is faster for more
_COLUMNS = 4  # of the factor at a time
_ROWS = 512  # of these columns at a time: 16 kB
_LOOPS: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy", "fastmath": {"contract", "reassoc"}}


class LeafRows(NamedTuple):
    """The rows A_21 of the matrix at the boundary of every leaf, by own unknowns.

    ends    : (n + 1,) where the entries of each unknown are, none but those of leaves
    targets : (e,) rows of a solution; values (e,) : the numbers of the matrix for them
    """

    ends: Array
    targets: Array
    values: Array


@numba.njit(cache=True)
def leaf_rows(fronts, targets, A):  # type: ignore[no-untyped-def]
    """The rows of leaves; targets : the rows of the boundaries in a solution."""
    at, ends = np.empty(A.place.size, np.int32), np.zeros(A.order.size + 1, np.int64)
    for k in np.flatnonzero(fronts.children == 0):
        for p in range(fronts.starts[k], fronts.starts[k + 1]):
            row = A.order[p]
            for e in range(A.indptr[row], A.indptr[row + 1]):
                ends[p + 1] += A.place[A.indices[e]] >= fronts.starts[k + 1]
    ends = np.cumsum(ends)
    rows, values = np.empty(ends[-1], np.int32), np.empty(ends[-1])
    for k in np.flatnonzero(fronts.children == 0):
        here = slice(fronts.ends[k], fronts.ends[k + 1])
        at[fronts.boundary[here]] = targets[here]
        for p in range(fronts.starts[k], fronts.starts[k + 1]):
            row, i = A.order[p], ends[p]
            for e in range(A.indptr[row], A.indptr[row + 1]):
                place = A.place[A.indices[e]]
                if place >= fronts.starts[k + 1]:
                    rows[i], values[i] = at[place], A.data[e]
                    i += 1
    return ends, rows, values


@numba.njit(cache=True, nogil=True)
def forward(fronts, targets, leaves, first, last, y):  # type: ignore[no-untyped-def]
    """L^-1 for the fronts first...last; y (rows, r), `targets` the rows of the boundaries."""
    space = np.empty(y.shape[1] * tallest(fronts, first, last))
    for k in range(first, last + 1):
        panel, own, x = _begun(fronts, k, y, space)
        rows = targets[fronts.ends[k] : fronts.ends[k + 1]]
        x[:, own:] = 0.0
        _down(panel, own, x)
        y[fronts.starts[k] : fronts.starts[k + 1]] = x[:, :own].T
        if fronts.children[k] == 0:
            _up(panel, own, x)
            _take_from_boundary(leaves, fronts.starts[k], x.T.copy(), y)
            continue
        for i in range(rows.size):
            for c in range(y.shape[1]):
                y[rows[i], c] += x[c, own + i]


@numba.njit(cache=True, nogil=True)
def _begun(fronts, k, y, space):  # type: ignore[no-untyped-def]
    """The strips of a front, how many unknowns are its own, and a solution x (r, rows kept) with these in it."""
    own, size = shape(fronts, k)[0], tall(fronts, k)
    x = space[: y.shape[1] * size].reshape((y.shape[1], size))
    x[:, :own] = y[fronts.starts[k] : fronts.starts[k + 1]].T
    return fronts.panels[fronts.offsets[k] : fronts.offsets[k + 1]], own, x


@numba.njit(cache=True, nogil=True)
def _take_from_boundary(leaves, start, own, y):  # type: ignore[no-untyped-def]
    """A_21 times the own part (own, r) of a leaf, taken from the rows y of its boundary."""
    for i in range(len(own)):
        for c in range(0, y.shape[1], SIDES):
            p, q, r, s = own[i, c], own[i, c + 1], own[i, c + 2], own[i, c + 3]
            for e in range(leaves.ends[start + i], leaves.ends[start + i + 1]):
                row, value = y[leaves.targets[e]], leaves.values[e]
                row[c] -= value * p
                row[c + 1] -= value * q
                row[c + 2] -= value * r
                row[c + 3] -= value * s


@numba.njit(cache=True, nogil=True)
def _boundary_on_own(leaves, start, stop, y):  # type: ignore[no-untyped-def]
    """(own, r) A_21^T y of a leaf, y at the rows of its boundary."""
    own = np.empty((stop - start, y.shape[1]))
    for i in range(stop - start):
        for c in range(0, y.shape[1], SIDES):
            p = q = r = s = 0.0
            for e in range(leaves.ends[start + i], leaves.ends[start + i + 1]):
                row, value = y[leaves.targets[e]], leaves.values[e]
                p += value * row[c]
                q += value * row[c + 1]
                r += value * row[c + 2]
                s += value * row[c + 3]
            own[i, c], own[i, c + 1], own[i, c + 2], own[i, c + 3] = p, q, r, s
    return own


@numba.njit(cache=True, nogil=True)
def _down(panel, own, x):  # type: ignore[no-untyped-def]
    """L^-1 of the own part of x (r, own + rest), and what that takes from the rest; panel : strips of a front."""
    r, size = x.shape
    flat, at = x.reshape(x.size), 0
    for a in range(0, own, STRIP):
        b = min(a + STRIP, own)
        strip = panel[at : at + (b - a) * (size - a)]
        if r <= _FEW:
            _columns_down(strip.reshape((b - a, size - a)), x, a)
        else:
            divide(LEFT, False, strip, flat[a:], b - a, r, size - a, size)
            if b < size:
                sizes = (size - a, size, size)
                product(PLAIN, PLAIN, strip[b - a :], flat[a:], flat[b:], size - b, r, b - a, sizes, -1.0)
        at += strip.size


@numba.njit(**_LOOPS)
def _columns_down(strip, x, a):  # type: ignore[no-untyped-def]
    """The same of a strip (columns, size), which begins at the row a of x (r, own + rest)."""
    count, size = strip.shape
    first = 0
    while first < count:
        last = first + (_COLUMNS if count - first >= _COLUMNS else 1)
        for c in range(len(x)):
            y = x[c, a:]
            for i in range(first, last):
                for k in range(first, i):
                    y[i] -= strip[k, i] * y[k]
                y[i] /= strip[i, i]
        for top in range(last, size, _ROWS):
            _take(strip[first:last], x, a, first, top, min(top + _ROWS, size))
        first = last


@numba.njit(**_LOOPS)
def _take(columns, x, a, first, top, bottom):  # type: ignore[no-untyped-def]
    """Columns of a strip, which begins at the row a, times the rows first... of x, from the rows top...bottom of x."""
    if len(columns) == 1:
        only = columns[0, top:bottom]
        for c in range(x.shape[0]):
            y, p = x[c, a + top : a + bottom], x[c, a + first]
            for i in range(y.size):
                y[i] -= only[i] * p
        return
    one, two, three, four = (
        columns[0, top:bottom],
        columns[1, top:bottom],
        columns[2, top:bottom],
        columns[3, top:bottom],
    )
    for c in range(x.shape[0]):
        y = x[c, a + top : a + bottom]
        p, q, r, s = x[c, a + first], x[c, a + first + 1], x[c, a + first + 2], x[c, a + first + 3]
        for i in range(y.size):
            y[i] -= one[i] * p + two[i] * q + three[i] * r + four[i] * s


@numba.njit(cache=True, nogil=True)
def backward(fronts, targets, leaves, first, last, y):  # type: ignore[no-untyped-def]
    """L^-T for the fronts first...last, the last first."""
    space = np.empty(y.shape[1] * tallest(fronts, first, last))
    for k in range(last, first - 1, -1):
        panel, own, x = _begun(fronts, k, y, space)
        rows = targets[fronts.ends[k] : fronts.ends[k + 1]]
        if fronts.children[k] == 0:
            x[:] = _boundary_on_own(leaves, fronts.starts[k], fronts.starts[k + 1], y).T
            _down(panel, own, x)
            x[:] = y[fronts.starts[k] : fronts.starts[k + 1]].T - x
        else:
            for i in range(rows.size):
                for c in range(y.shape[1]):
                    x[c, own + i] = y[rows[i], c]
        _up(panel, own, x)
        y[fronts.starts[k] : fronts.starts[k + 1]] = x[:, :own].T


@numba.njit(cache=True, nogil=True)
def _up(panel, own, x):  # type: ignore[no-untyped-def]
    """L^-T of the own part of x (r, own + rest), whose rest is known; panel : strips of a front."""
    r, size = x.shape
    flat, at = x.reshape(x.size), panel.size
    for a in range(own - 1 - (own - 1) % STRIP, -1, -STRIP):
        b = min(a + STRIP, own)
        at -= (b - a) * (size - a)
        strip = panel[at : at + (b - a) * (size - a)]
        if r <= _FEW:
            _columns_up(strip.reshape((b - a, size - a)), x, a)
            continue
        if b < size:
            sizes = (size - a, size, size)
            product(TRANSPOSED, PLAIN, strip[b - a :], flat[b:], flat[a:], b - a, r, size - b, sizes, -1.0)
        divide(LEFT, True, strip, flat[a:], b - a, r, size - a, size)


@numba.njit(**_LOOPS)
def _columns_up(strip, x, a):  # type: ignore[no-untyped-def]
    """The same of a strip (columns, size), which begins at the row a of x (r, own + rest)."""
    last, size = strip.shape
    sums = np.empty((len(x), _COLUMNS))
    while last > 0:
        first = last - (1 if last % _COLUMNS else _COLUMNS)
        sums[:] = 0.0
        for top in range(last, size, _ROWS):
            _sum(strip[first:last], x, a, top, min(top + _ROWS, size), sums)
        for c in range(len(x)):
            y = x[c, a:]
            for i in range(last - 1, first - 1, -1):
                y[i] -= sums[c, i - first]
                for k in range(i + 1, last):
                    y[i] -= strip[i, k] * y[k]
                y[i] /= strip[i, i]
        last = first


@numba.njit(**_LOOPS)
def _sum(columns, x, a, top, bottom, sums):  # type: ignore[no-untyped-def]
    """Add the products of columns of a strip, which begins at the row a, with x, rows top...bottom, to sums (r, 4)."""
    if len(columns) == 1:
        only = columns[0, top:bottom]
        for c in range(x.shape[0]):
            y, p = x[c, a + top : a + bottom], 0.0
            for i in range(y.size):
                p += only[i] * y[i]
            sums[c, 0] += p
        return
    one, two, three, four = (
        columns[0, top:bottom],
        columns[1, top:bottom],
        columns[2, top:bottom],
        columns[3, top:bottom],
    )
    for c in range(x.shape[0]):
        y = x[c, a + top : a + bottom]
        p = q = r = s = 0.0
        for i in range(y.size):
            p += one[i] * y[i]
            q += two[i] * y[i]
            r += three[i] * y[i]
            s += four[i] * y[i]
        sums[c, 0] += p
        sums[c, 1] += q
        sums[c, 2] += r
        sums[c, 3] += s


@numba.njit(cache=True, nogil=True)
def tallest(fronts, first, last):  # type: ignore[no-untyped-def]
    """Most rows that are kept of one of the fronts first...last."""
    most = 0
    for k in range(first, last + 1):
        most = max(most, tall(fronts, k))
    return most
