"""All processor cores for large dense and sparse products, with the same bits whatever their number.

The work is cut into pieces that depend on its size alone; each piece is done by one thread that calls BLAS on its own.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
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

_BLAS = ThreadpoolController()
_PIECES = 16


@contextmanager
def threads() -> Iterator[Map]:
    """A map that runs on all threads there are; each calls BLAS on its own."""
    with _BLAS.limit(limits=1), ThreadPoolExecutor(os.cpu_count()) as pool:
        yield pool.map


def on_one_thread(function: Callable[Given, Made]) -> Callable[Given, Made]:
    """The function with one thread of BLAS: for small dense blocks threads that wait are slower, and one is reproducible."""

    @wraps(function)
    def alone(*args: Given.args, **kwargs: Given.kwargs) -> Made:
        with threadpool_limits(1):
            return function(*args, **kwargs)

    return alone


def pieces(size: int) -> list[slice]:
    """The rows of a long array in pieces."""
    ends = np.linspace(0, size, min(_PIECES, max(size, 1)) + 1).astype(int)
    return [slice(int(a), int(b)) for a, b in pairwise(ends)]


def sparse_product(A: sp.csr_array, X: Array, each: Map) -> Array:
    """A X for a sparse A (n, m) and X (m, b), on all threads."""
    X = np.ascontiguousarray(X)
    out = np.empty((A.shape[0], X.shape[1]))

    def rows(part: slice) -> None:
        _multiply(A.indptr, A.indices, A.data, X, out, part.start, part.stop)

    for _ in each(rows, pieces(len(out))):
        pass
    return out


@numba.njit(cache=True, nogil=True)
def _multiply(indptr, indices, data, X, out, first, last):  # type: ignore[no-untyped-def]
    for i in range(first, last):
        for j in range(X.shape[1]):
            out[i, j] = 0.0
        for k in range(indptr[i], indptr[i + 1]):
            for j in range(X.shape[1]):
                out[i, j] += data[k] * X[indices[k], j]
