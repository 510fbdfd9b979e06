"""Sparse Cholesky factorisation of finite-element matrices: nested dissection and dense fronts.

Independent branches of the elimination tree run on the threads there are; how the work is divided does not depend on
their number, and every front is computed on one thread, so the result is the same to the bit with any number.

Sources: A. George, SIAM J. Numer. Anal. 10 (1973) 345-363 (nested dissection); J. W. H. Liu, SIAM Review 34 (1992)
82-109 (the multifrontal method).
"""

from __future__ import annotations

import heapq
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from ffr_prep.common.arrays import Array
from ffr_prep.common.process_memory import check_memory, in_words
from ffr_prep.common.progress import Advance, no_advance
from ffr_prep.solvers.multifrontal import (
    DONE,
    Fronts,
    Sorted,
    add,
    backward,
    begin,
    boundaries,
    diagonal_tile,
    eliminate_branch,
    forward,
    most_waiting,
    panel_of,
    row_tile,
    shape,
    update_tile,
)
from ffr_prep.solvers.nested_dissection import elimination_tree
from ffr_prep.solvers.threads import Map, threads

_BRANCHES = 24  # a branch has at most this part of the work
_TILE = 384
LESS = (
    "take a coarser mesh, cut the body into parts, or reduce it where there is more memory, on several machines with the "
    "solver slepc"
)


@dataclass(frozen=True)
class Division:
    """How the fronts are divided among threads.

    branches : (t, 2) first and last front of the subtrees that are independent of each other, ascending
    trunk    : the other fronts, in the order of elimination
    below    : for each front those directly below it
    """

    branches: Array
    trunk: list[int]
    below: list[list[int]]


@dataclass(frozen=True)
class Factor:
    """P A P^T = L L^T.

    order   : (n,) the unknown at each place of the elimination
    fronts  : the columns of L
    targets : rows of the boundaries in a solution: a branch has copies of the rows outside it, after the n unknowns
    copied  : (c,) the rows that these copy
    """

    order: Array
    fronts: Fronts
    division: Division
    targets: Array
    copied: Array


def cholesky(A: sp.csr_array, positions: Array, advance: Advance = no_advance) -> Factor:
    """Factorise the symmetric positive definite A (n, n).

    positions : (n, 3) where each unknown is, to cut by; rows of NaN for unknowns that touch many others, such as the
                coordinates of a rigid interface, which are eliminated last
    advance   : called as the elimination proceeds, with the share of its operations

    Raises numpy.linalg.LinAlgError when A is not positive definite, InputError when the machine has too little memory.
    """
    analysis = analysed(A, positions)
    matrix, division = analysis.matrix, analysis.division
    factor = 8 * int(analysis.fronts.offsets[-1])
    check_memory(factor + waiting(analysis), f"factorising the stiffness of {len(matrix.order)} unknowns", LESS)
    advance(0.0, f"the factor takes {in_words(factor)}")
    fronts = analysis.fronts._replace(panels=np.zeros(analysis.fronts.offsets[-1]))
    with threads() as each:
        _eliminate_all(fronts, division, matrix, each, progress_of(analysis, advance))
    return Factor(matrix.order, fronts, division, *_private_rows(fronts, division.branches))


def solve_cholesky(factor: Factor, b: Array) -> Array:
    """A^-1 b for b (n, r)."""
    n = len(factor.order)
    fronts, targets, trunk, branches = factor.fronts, factor.targets, factor.division.trunk, factor.division.branches
    y = np.zeros((n + len(factor.copied), b.shape[1]))
    y[:n] = b[factor.order]
    with threads() as each:
        finish(each(lambda branch: forward(fronts, targets, branch[0], branch[1], y), branches))
        np.add.at(y, factor.copied, y[n:])
        for k in trunk:
            forward(fronts, targets, k, k, y)
        for k in reversed(trunk):
            backward(fronts, targets, k, k, y)
        y[n:] = y[factor.copied]
        finish(each(lambda branch: backward(fronts, targets, branch[0], branch[1], y), branches))
    x = np.empty((n, b.shape[1]))
    x[factor.order] = y[:n]
    return x


# ---- division of the work -----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Analysis:
    """A matrix in the order of its elimination, its fronts, which have no panels yet, and their division."""

    matrix: Sorted
    fronts: Fronts
    division: Division


def analysed(A: sp.csr_array, positions: Array) -> Analysis:
    """What is known of the elimination of A (n, n) before any number is; positions as of `cholesky`."""
    pieces, below = elimination_tree(A, positions)
    order = np.concatenate(pieces)
    place = np.empty(len(order), np.int32)
    place[order] = np.arange(len(order))
    matrix = Sorted(A.indptr, A.indices, A.data, order, place)
    starts, children = np.cumsum([0, *map(len, pieces)]), np.array([len(of) for of in below])
    ends, boundary = boundaries(starts, children, matrix)
    own, rest = np.diff(starts), np.diff(ends)
    offsets = np.concatenate([[0], np.cumsum(own * (own + rest))])
    fronts = Fronts(starts, ends, boundary, offsets, np.zeros(0), children)
    return Analysis(matrix, fronts, _division(fronts, below))


def _division(fronts: Fronts, below: list[list[int]]) -> Division:
    """The tree is cut at its heaviest front until all branches are light."""
    first, work = np.arange(len(below)), _work(fronts)
    light = work.sum() / _BRANCHES
    for k, of in enumerate(below):
        first[k] = min([k, *first[of]])
        work[k] += work[of].sum()
    branches, trunk = [(-work[k], k) for k in set(range(len(below))).difference(*below)], []
    heapq.heapify(branches)
    while -branches[0][0] > light and below[branches[0][1]]:
        _, heaviest = heapq.heappop(branches)
        trunk.append(heaviest)
        for k in below[heaviest]:
            heapq.heappush(branches, (-work[k], k))
    return Division(np.array(sorted((first[k], k) for _, k in branches)), sorted(trunk), below)


def _work(fronts: Fronts) -> Array:
    """(F,) operations of each front, up to a factor."""
    own, rest = np.diff(fronts.starts), np.diff(fronts.ends)
    return own * (own + rest) ** 2.0


def _private_rows(fronts: Fronts, branches: Array) -> tuple[Array, Array]:
    """The targets of all boundaries, and the rows that the branches have copies of."""
    targets = fronts.boundary.astype(np.int64)
    copied, count = [np.zeros(0, np.int64)], int(fronts.starts[-1])
    for first, last in branches:
        outside = fronts.boundary[fronts.ends[last] : fronts.ends[last + 1]].astype(np.int64)
        of_branch = targets[fronts.ends[first] : fronts.ends[last + 1]]
        leaving = of_branch >= fronts.starts[last + 1]
        of_branch[leaving] = count + np.searchsorted(outside, of_branch[leaving])
        copied.append(outside)
        count += len(outside)
    return targets, np.concatenate(copied)


# ---- elimination --------------------------------------------------------------------------------------------------


def waiting(analysis: Analysis) -> int:
    """Bytes of the updates that wait for their fronts, at most: of two branches at work, and of all at their ends."""
    fronts, division = analysis.fronts, analysis.division
    squares = np.diff(fronts.ends) ** 2
    pending, places = np.empty(len(squares) + 1, np.int64), np.zeros(len(squares) + 2, np.int64)
    inside = sorted(most_waiting(fronts, first, last, pending, places) for first, last in division.branches)[-2:]
    height = most = int(sum(squares[last] for _, last in division.branches))
    for k in division.trunk:
        most = max(most, height + int(squares[k]))
        height += int(squares[k] - squares[division.below[k]].sum())
    return 8 * (most + int(sum(inside)))


@dataclass
class Elimination:
    """How much of the work (F,) of the fronts is done."""

    work: Array
    advance: Advance
    fronts: int = 0
    done: float = 0.0

    def add(self, first: int, last: int) -> None:
        """The fronts first...last are eliminated."""
        self.fronts += last - first + 1
        self.done += self.work[first : last + 1].sum()
        self.advance(self.done / self.work.sum(), f"{self.fronts} of {self.work.size} fronts")


def progress_of(analysis: Analysis, advance: Advance) -> Elimination:
    """Tells the listener how far an elimination is."""
    return Elimination(_work(analysis.fronts), advance)


def _eliminate_all(fronts: Fronts, division: Division, matrix: Sorted, each: Map, elimination: Elimination) -> None:
    results = each(lambda branch: eliminate_branch(fronts, branch[0], branch[1], matrix), division.branches)
    updates: dict[int, Array] = {}
    for (first, last), (update, bad) in zip(division.branches, results, strict=True):
        _check_pivot(bad)
        rest = shape(fronts, last)[1]
        updates[int(last)] = update.reshape(rest, rest)
        elimination.add(int(first), int(last))
    local = np.empty(len(matrix.order), np.int32)
    for k in division.trunk:
        rest = shape(fronts, k)[1]
        update = np.zeros((rest, rest))
        panel = panel_of(fronts, k)
        begin(fronts, k, panel, matrix, update, local)
        for child in division.below[k]:
            add_tiled(fronts, child, updates.pop(child), panel, update, local, each)
        _eliminate_tiled(fronts, k, update, each)
        updates[k] = update
        elimination.add(k, k)


def add_tiled(
    fronts: Fronts, child: int, of_child: Array, panel: Array, update: Array, local: Array, each: Map
) -> None:
    """As `add`, all columns, on all threads."""
    finish(
        each(
            lambda columns: add(fronts, child, of_child, panel, update, local, columns[0], columns[1]),
            tiles(0, len(of_child)),
        )
    )


def _eliminate_tiled(fronts: Fronts, k: int, update: Array, each: Map) -> None:
    """As `eliminate`, by tiles that do not depend on the number of threads."""
    own, rest = shape(fronts, k)
    size, panel = own + rest, fronts.panels[fronts.offsets[k] : fronts.offsets[k + 1]]
    for first, last in tiles(0, own):
        bad = diagonal_tile(panel, size, first, last)
        _check_pivot(fronts.starts[k] + first + bad - 1 if bad else DONE)
        finish(each(lambda rows, of=(first, last): row_tile(panel, size, *of, *rows), tiles(last, size)))
    pairs = [(columns, rows) for columns in tiles(0, rest) for rows in tiles(0, rest) if rows >= columns]
    finish(each(lambda pair: update_tile(panel, own, update, *pair[0], *pair[1]), pairs))


def tiles(start: int, stop: int) -> list[tuple[int, int]]:
    """start...stop in pieces that do not depend on the number of threads."""
    return [(first, min(first + _TILE, stop)) for first in range(start, stop, _TILE)]


def finish(results: Iterable[None]) -> None:
    """Wait for all, and raise what one of them raised."""
    for _ in results:
        pass


def _check_pivot(bad: int) -> None:
    if bad != DONE:
        raise np.linalg.LinAlgError(f"pivot {bad + 1} is not positive")
