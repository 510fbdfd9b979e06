"""All processor cores for large dense and sparse products, with the same bits whatever their number.

The work is cut into pieces that depend on its size alone; each piece is done by one thread that calls BLAS on its own.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from functools import wraps
from itertools import pairwise
from typing import Any, ParamSpec, TypeVar

import numba
import numpy as np
import scipy.sparse as sp
from threadpoolctl import ThreadpoolController, threadpool_limits

from ffr_prep.common.arrays import Array
from ffr_prep.common.compile_cache import check_compiled_code

check_compiled_code()

Map = Callable[[Callable[..., Any], Iterable[Any]], Iterable[Any]]
Given = ParamSpec("Given")
Made = TypeVar("Made")
Given1 = TypeVar("Given1")

_BLAS = ThreadpoolController()
_PIECES = 16
_AHEAD = 2  # items for each thread
_FEW = 8  # columns of a sparse product; of more the rows of X are longer than what the cache takes at a time


@contextmanager
def threads() -> Iterator[Map]:
    """A map that runs on all threads there are; each calls BLAS on its own."""
    with _BLAS.limit(limits=1), ThreadPoolExecutor(os.cpu_count()) as pool:
        yield pool.map


def ahead(function: Callable[[Given1], Made], items: Iterable[Given1]) -> Iterator[Made]:
    """The results of the function for each item, in order, computed on all threads; few at a time wait to be taken."""
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        waiting: deque[Future[Made]] = deque()
        for item in items:
            waiting.append(pool.submit(function, item))
            if len(waiting) > _AHEAD * (os.cpu_count() or 1):
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()


def on_one_thread(function: Callable[Given, Made]) -> Callable[Given, Made]:
    """The function with one thread of BLAS: for small dense blocks threads that wait are slower, and one is reproducible."""

    @wraps(function)
    def alone(*args: Given.args, **kwargs: Given.kwargs) -> Made:
        with threadpool_limits(1):
            return function(*args, **kwargs)

    return alone


def finish(results: Iterable[None]) -> None:
    """Wait for all, and raise what one of them raised."""
    for _ in results:
        pass


def pieces(size: int) -> list[slice]:
    """The rows of a long array in pieces."""
    ends = np.linspace(0, size, min(_PIECES, max(size, 1)) + 1).astype(int)
    return [slice(int(a), int(b)) for a, b in pairwise(ends)]


def sparse_product(A: sp.csr_array, X: Array, each: Map, out: Array | None = None) -> Array:
    """A X for a sparse A (n, m) and X (m, b), on all threads; into `out` (n, b) where that is given."""
    X = np.ascontiguousarray(X)
    out = np.empty((A.shape[0], X.shape[1])) if out is None else out

    def rows(part: slice) -> None:
        _multiply(A.indptr, A.indices, A.data, X, out, part.start, part.stop)

    finish(each(rows, pieces(len(out))))
    return out


def product(A: sp.sparray, X: Array) -> Array:
    """A X for a sparse A (n, m) of any form and X (m, b), on all threads."""
    with threads() as each:
        return sparse_product(sp.csr_array(A), X, each)


def product_of_sizes(A: sp.sparray, X: Array) -> Array:
    """|A| |X| for a sparse A (n, m) of any form and X (m, b), on all threads and without a copy of an A in rows."""
    A = sp.csr_array(A)
    sizes, out = np.ascontiguousarray(np.abs(X)), np.empty((A.shape[0], X.shape[1]))

    def rows(part: slice) -> None:
        here = slice(A.indptr[part.start], A.indptr[part.stop])
        ends = A.indptr[part.start : part.stop + 1] - A.indptr[part.start]
        _multiply(ends, A.indices[here], np.abs(A.data[here]), sizes, out[part], 0, len(ends) - 1)

    with threads() as each:
        finish(each(rows, pieces(len(out))))
    return out


@numba.njit(cache=True, nogil=True)
def _multiply(indptr, indices, data, X, out, first, last):  # type: ignore[no-untyped-def]
    """Rows first...last of a product; of a few columns four at a time, the sums of which stay in registers."""
    if X.shape[1] > _FEW:
        for i in range(first, last):
            row = out[i]
            row[:] = 0.0
            for k in range(indptr[i], indptr[i + 1]):
                value, other = data[k], X[indices[k]]
                for j in range(row.size):
                    row[j] += value * other[j]
        return
    whole = X.shape[1] - X.shape[1] % 4
    for i in range(first, last):
        row = out[i]
        for j in range(0, whole, 4):
            p = q = r = s = 0.0
            for k in range(indptr[i], indptr[i + 1]):
                value, other = data[k], X[indices[k]]
                p += value * other[j]
                q += value * other[j + 1]
                r += value * other[j + 2]
                s += value * other[j + 3]
            row[j], row[j + 1], row[j + 2], row[j + 3] = p, q, r, s
        for j in range(whole, row.size):
            p = 0.0
            for k in range(indptr[i], indptr[i + 1]):
                p += data[k] * X[indices[k], j]
            row[j] = p
