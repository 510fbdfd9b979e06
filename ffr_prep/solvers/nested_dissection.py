"""Nested dissection: an order of elimination that keeps a sparse factor small.

The unknowns are cut in two across their longest extent, again and again; what separates two parts is eliminated after
both. The separator is the smallest set of points in the middle of the extent (`ffr_prep.solvers.separators`), so it
finds the narrow places of a body and needs not be plane.

Source: A. George, SIAM J. Numer. Anal. 10 (1973) 345-363.
"""

from __future__ import annotations

import numba
import numpy as np
import scipy.sparse as sp

from ffr_prep.common.arrays import Array
from ffr_prep.common.compile_cache import check_compiled_code
from ffr_prep.solvers.separators import narrowest, separated
from ffr_prep.solvers.threads import threads

check_compiled_code()

Tree = tuple[list[Array], list[list[int]]]

NOTHING = np.zeros(0, int)
_LEAF = 48  # of larger leaves the factor is larger, of smaller ones too: more fronts are no leaves
_LEAST = 0.2  # of a part on either side of a cut
_LARGE = 20_000  # points of a part from which on a cut is looked for near the narrowest place alone
_NEAR = 0.15  # of the part on either side of that place: as good a cut in half the time


def elimination_tree(A: sp.csr_array, positions: Array, held: Array = NOTHING) -> Tree:
    """Pieces of unknowns in the order of their elimination, and for each the earlier pieces directly below it.

    All pieces below a piece precede it without a gap. positions : (n, 3) where each unknown is; rows of NaN for
    unknowns that touch many others, which are eliminated last. held : numbers of those that belong to no piece.
    """
    free = np.ones(len(positions), bool)
    free[held] = False
    placed = np.flatnonzero(np.isfinite(positions[:, 0]) & free)
    points, index = _distinct(positions[placed])
    point_of = np.full(len(positions), -1)
    point_of[placed] = index
    by_point = np.argsort(point_of, kind="stable")[len(positions) - placed.size :]
    ends = np.searchsorted(point_of[by_point], np.arange(len(points) + 1))
    pieces, children = _dissection(points, _graph(A, point_of, by_point, ends))
    unknowns = [_joined(by_point, ends, piece) for piece in pieces]
    free[placed] = False
    last = np.flatnonzero(free)
    if last.size:
        children.append(_tops(children))
        unknowns.append(last)
    return unknowns, children


def _distinct(positions: Array) -> tuple[Array, Array]:
    """The points (N, 3) of positions (n, 3), each once in the order of their coordinates, and the number of each position."""
    order = np.lexsort(positions.T[::-1])  # a third of the time of sorting rows
    ascending = positions[order]
    new = np.append(np.ones(min(len(order), 1), bool), (np.diff(ascending, axis=0) != 0).any(axis=1))
    index = np.empty(len(order), int)
    index[order] = np.cumsum(new) - 1
    return ascending[new], index


def _graph(A: sp.csr_array, point_of: Array, by_point: Array, ends: Array) -> sp.csr_array:
    """(N, N) which points have unknowns that touch each other."""
    counts = _neighbours(A.indptr, A.indices, point_of, by_point, ends, np.zeros(0, np.int32), np.zeros(0, np.int64))
    indptr = np.concatenate([[0], np.cumsum(counts)])
    indices = np.empty(indptr[-1], np.int32)
    _neighbours(A.indptr, A.indices, point_of, by_point, ends, indices, indptr)
    size = len(ends) - 1
    return sp.csr_array((np.ones(indices.size, np.int8), indices, indptr), shape=(size, size))


@numba.njit(cache=True)
def _neighbours(indptr, rows, point_of, by_point, ends, indices, starts):  # type: ignore[no-untyped-def]
    """(N,) number of neighbours of every point; they are written to the indices, unless these are empty."""
    size = ends.size - 1
    counts = np.zeros(size, np.int64)
    seen = np.full(size, -1)
    for p in range(size):
        for a in by_point[ends[p] : ends[p + 1]]:
            for b in rows[indptr[a] : indptr[a + 1]]:
                q = point_of[b]
                if q >= 0 and seen[q] != p:
                    seen[q] = p
                    if indices.size:
                        indices[starts[p] + counts[p]] = q
                    counts[p] += 1
    return counts


def _joined(by_point: Array, ends: Array, piece: Array) -> Array:
    """The unknowns of the points of a piece."""
    counts = ends[piece + 1] - ends[piece]
    first = np.repeat(ends[piece] - np.cumsum(counts) + counts, counts)
    return by_point[first + np.arange(counts.sum())]


def _dissection(points: Array, graph: sp.csr_array) -> Tree:
    """Pieces of the points (N, 3) in the order of elimination, with the pieces below each."""
    cuts = _cuts(points, graph)
    pieces: list[Array] = []
    children: list[list[int]] = []

    def add(number: int) -> list[int]:
        """The pieces of a part and of those that it is cut into; which of them are below no other."""
        piece, halves = cuts[number]
        below = [k for half in halves for k in add(half)]
        if not piece.size:
            return below
        pieces.append(piece)
        children.append(below)
        return [len(pieces) - 1]

    add(0)
    return pieces, children


def _cuts(points: Array, graph: sp.csr_array) -> list[tuple[Array, list[int]]]:
    """For each part what separates its halves, and their numbers; a leaf has itself alone. The first is the whole."""
    place = np.full(len(points), -1)  # parts that are cut at the same time do not touch: all of them may use it
    found: list[tuple[Array, list[int]]] = []

    def divided(part: Array) -> tuple[Array, ...]:
        return (part,) if len(part) <= _LEAF else _cut(points, graph, part, place)

    with threads() as each:
        parts, known = [np.arange(len(points))], 1
        while parts:
            following: list[Array] = []
            for *halves, piece in each(divided, parts):
                found.append((piece, list(range(known, known + len(halves)))))
                following += halves
                known += len(halves)
            parts = following
    return found


def _cut(points: Array, graph: sp.csr_array, part: Array, place: Array) -> tuple[Array, Array, Array]:
    """Two parts of a part that do not touch each other, and the points between; `place` (N,) is all -1 and stays."""
    offsets = points[part] - points[part].mean(axis=0)
    _, axes = np.linalg.eigh(offsets.T @ offsets)
    along = part[np.argsort(offsets @ axes[:, -1], kind="stable")]
    low = max(int(_LEAST * part.size), 1)
    high = part.size - low
    if part.size > _LARGE:
        narrow, near = narrowest(graph.indptr, graph.indices, along, low, high, place), int(_NEAR * part.size)
        low, high = max(low, narrow - near), min(high, narrow + near)
    return separated(graph.indptr, graph.indices, along, low, high, place)


def _tops(children: list[list[int]]) -> list[int]:
    """The pieces that are below no other."""
    below = {child for of in children for child in of}
    return [k for k in range(len(children)) if k not in below]
