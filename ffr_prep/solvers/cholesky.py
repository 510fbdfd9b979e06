"""Sparse Cholesky factorisation of finite-element matrices: nested dissection and dense fronts.

Independent branches of the elimination tree run on the threads there are; how the work is divided does not depend on
their number, and every front is computed on one thread, so the result is the same to the bit with any number.

Sources: A. George, SIAM J. Numer. Anal. 10 (1973) 345-363 (nested dissection); J. W. H. Liu, SIAM Review 34 (1992)
82-109 (the multifrontal method).
"""

from __future__ import annotations

import heapq
import os
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from queue import SimpleQueue
from typing import TypeVar

import numpy as np
import scipy.sparse as sp

from ffr_prep.common.arrays import Array
from ffr_prep.common.process_memory import check_memory, in_words
from ffr_prep.common.progress import Advance, no_advance
from ffr_prep.solvers.multifrontal import (
    DONE,
    Fronts,
    Sorted,
    Workspace,
    add,
    begin,
    boundaries,
    diagonal_tile,
    eliminate_branch,
    keep,
    kept,
    largest,
    most_waiting,
    pack,
    row_tile,
    shape,
    taken,
    triangle,
    update_tile,
)
from ffr_prep.solvers.nested_dissection import NOTHING, elimination_tree
from ffr_prep.solvers.substitution import SIDES, LeafRows, backward, forward, leaf_rows
from ffr_prep.solvers.threads import Map, finish, pieces, threads

_BRANCHES = 24  # a branch has at most this part of the work
Made = TypeVar("Made")

_TILE = 384  # columns or rows: whole strips
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

    @property
    def in_trunk(self) -> Array:
        """(p, 2) the fronts of the trunk as runs of their own."""
        return np.repeat(self.trunk, 2).reshape(-1, 2).astype(int)


@dataclass(frozen=True)
class Factor:
    """P A P^T = L L^T.

    order   : the unknown at each place of the elimination
    fronts  : the columns of L
    leaves  : rows of A, which leaves have in the place of their rows of L
    stages  : the fronts in turn, each stage of runs that are independent of each other: all branches, then fronts of the
              trunk whose fronts below are done
    targets : rows of the boundaries in a solution: a run has copies of the rows outside it
    rows    : how many rows a solution has, with the copies after the n unknowns
    """

    order: Array
    fronts: Fronts
    leaves: LeafRows
    division: Division
    stages: list[list[Run]]
    targets: Array
    rows: int


@dataclass(frozen=True)
class Run:
    """Fronts first...last, one after the other; copied (c,) : the rows that its copies copy, from the row `at` on."""

    first: int
    last: int
    copied: Array
    at: int


def cholesky(A: sp.csr_array, positions: Array, advance: Advance = no_advance, held: Array = NOTHING) -> Factor:
    """Factorise the symmetric positive definite A (n, n), or what is left of it without the rows and columns `held`.

    positions : (n, 3) where each unknown is, to cut by; rows of NaN for unknowns that touch many others, such as the
                coordinates of a rigid interface, which are eliminated last
    advance   : called as the elimination proceeds, with the share of its operations
    held      : numbers of unknowns that are zero in every solution

    Raises numpy.linalg.LinAlgError when A is not positive definite, InputError when the machine has too little memory.
    """
    analysis = analysed(A, positions, held)
    matrix, division, factor = analysis.matrix, analysis.division, 8 * int(analysis.fronts.offsets[-1])
    check_memory(factor + waiting(analysis), f"factorising the stiffness of {len(matrix.order)} unknowns", LESS)
    advance(0.0, f"the factor takes {in_words(factor)}")
    fronts = analysis.fronts._replace(panels=np.empty(analysis.fronts.offsets[-1]))
    with threads() as each:
        _eliminate_all(fronts, division, matrix, each, progress_of(analysis, advance))
    stages, targets, rows = _stages(fronts, division)
    leaves = LeafRows(*leaf_rows(fronts, targets, matrix))
    return Factor(matrix.order, fronts, leaves, division, stages, targets, rows)


def solve_cholesky(factor: Factor, b: Array) -> Array:
    """A^-1 b for b (n, r)."""
    n, order, sides = len(factor.order), factor.order, b.shape[1]
    y, x = np.empty((factor.rows, -(-sides // SIDES) * SIDES)), np.zeros(b.shape)

    def begin(part: slice) -> None:
        y[part, :sides] = b[order[part]]
        y[part, sides:] = 0.0

    def end(part: slice) -> None:
        x[order[part]] = y[part, :sides]

    with threads() as each:
        finish(each(begin, pieces(n)))
        y[n:] = 0.0
        _swept(factor, y, each)
        finish(each(end, pieces(n)))
    return x


def _swept(factor: Factor, y: Array, each: Map) -> None:
    """(L L^T)^-1 of the rows y of a solution, in place."""
    fronts, targets, leaves = factor.fronts, factor.targets, factor.leaves

    def back(run: Run) -> None:
        y[run.at : run.at + len(run.copied)] = y[run.copied]
        backward(fronts, targets, leaves, run.first, run.last, y)

    for stage in factor.stages:
        finish(each(lambda run: forward(fronts, targets, leaves, run.first, run.last, y), stage))
        for run in stage:
            y[run.copied] += y[run.at : run.at + len(run.copied)]
    for stage in reversed(factor.stages):
        finish(each(back, stage))


# ---- division of the work -----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Analysis:
    """A matrix in the order of its elimination, its fronts, which have no panels yet, and their division."""

    matrix: Sorted
    fronts: Fronts
    division: Division


def analysed(A: sp.csr_array, positions: Array, held: Array = NOTHING) -> Analysis:
    """The symbolic factorisation of A (n, n): its structure, without numbers; the other arguments as of `cholesky`."""
    pieces, below = elimination_tree(A, positions, held)
    order = np.concatenate(pieces)
    place = np.full(len(positions), -1, np.int32)
    place[order] = np.arange(len(order))
    matrix = Sorted(A.indptr, A.indices, A.data, order, place)
    starts, children = np.cumsum([0, *map(len, pieces)]), np.array([len(of) for of in below])
    ends, boundary = boundaries(starts, children, matrix)
    own, rest = np.diff(starts), np.diff(ends)
    offsets = np.concatenate([[0], np.cumsum(kept(own, own + rest * (children > 0)))])
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


def _stages(fronts: Fronts, division: Division) -> tuple[list[list[Run]], Array, int]:
    """The stages of a solution, the targets of all boundaries, and how many rows there are with the copies."""
    stage_of = dict.fromkeys((int(last) for _, last in division.branches), 0)
    for k in division.trunk:
        stage_of[k] = 1 + max(stage_of[child] for child in division.below[k])
    first = {int(last): int(first) for first, last in division.branches}
    stages: list[list[Run]] = [[] for _ in range(1 + max(stage_of.values()))]
    targets, rows = fronts.boundary.copy(), int(fronts.starts[-1])
    for last, stage in sorted(stage_of.items()):
        run = Run(first.get(last, last), last, fronts.boundary[fronts.ends[last] : fronts.ends[last + 1]], rows)
        of_run = targets[fronts.ends[run.first] : fronts.ends[last + 1]]
        leaving = of_run >= fronts.starts[last + 1]
        of_run[leaving] = rows + np.searchsorted(run.copied, of_run[leaving])
        rows += len(run.copied)
        stages[stage].append(run)
    return stages, targets, rows


# ---- elimination --------------------------------------------------------------------------------------------------


def waiting(analysis: Analysis) -> int:
    """Bytes of fronts at work and of updates that wait for theirs, at most."""
    fronts, division = analysis.fronts, analysis.division
    triangles = triangle(np.diff(fronts.ends))
    height = most = int(sum(triangles[last] for _, last in division.branches))
    for k in division.trunk:
        most = max(most, height + int(triangles[k]))
        height += int(triangles[k] - triangles[division.below[k]].sum())
    in_branches, in_trunk = _at_work(division) * sum(_most(fronts, division.branches)), _most(fronts, division.in_trunk)
    return 8 * (most + max(in_branches, sum(in_trunk)))


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
    updates = _eliminate_branches(fronts, division, matrix, each, elimination)
    space = workspace(fronts, division.in_trunk, len(matrix.place))
    for k in division.trunk:
        panel, update = begun(fronts, k, matrix, space)
        for child in division.below[k]:
            add_tiled(fronts, child, updates.pop(child), panel, update, space.local, each)
        _eliminate_tiled(fronts, k, panel, update, each)
        updates[k] = packed(update, each)
        elimination.add(k, k)


def _eliminate_branches(
    fronts: Fronts, division: Division, matrix: Sorted, each: Map, elimination: Elimination
) -> dict[int, Array]:
    """The updates of the last fronts of all branches."""
    results = on_branches(eliminate_branch, fronts, division, matrix, each)
    updates: dict[int, Array] = {}
    for (first, last), (update, bad) in zip(division.branches, results, strict=True):
        _check_pivot(bad)
        updates[int(last)] = update
        elimination.add(int(first), int(last))
    return updates


# ---- workspaces, used again and again as fresh memory takes longer than filling it ---------------------------------


def workspace(fronts: Fronts, runs: Array, unknowns: int) -> Workspace:
    """The workspace that the elimination of any of the runs (t, 2), first and last front, needs."""
    panel, update, waiting_updates = map(np.empty, _most(fronts, runs))
    return Workspace(panel, update, waiting_updates, np.empty(unknowns, np.int32))


def on_branches(
    work: Callable[..., Made], fronts: Fronts, division: Division, matrix: Sorted, each: Map
) -> Iterable[Made]:
    """The results of the work on each branch, in a workspace of which there is one for each thread."""
    spaces: SimpleQueue[Workspace] = SimpleQueue()
    for _ in range(_at_work(division)):
        spaces.put(workspace(fronts, division.branches, len(matrix.place)))

    def in_turn(branch: Array) -> Made:
        space = spaces.get()
        try:
            return work(fronts, branch[0], branch[1], matrix, space)
        finally:
            spaces.put(space)

    return each(in_turn, division.branches)


def _at_work(division: Division) -> int:
    """How many branches are at work at a time."""
    return min(os.cpu_count() or 1, len(division.branches))


def _most(fronts: Fronts, runs: Array) -> list[int]:
    """Numbers of the largest panel, of the largest update, and of the updates that wait at a time, of all runs (t, 2)."""
    pending, places = np.empty(len(fronts.children) + 1, np.int64), np.zeros(len(fronts.children) + 2, np.int64)
    sizes = [
        (*largest(fronts, first, last), most_waiting(fronts, first, last, pending, places)) for first, last in runs
    ]
    return [max(of_all, default=0) for of_all in zip(*sizes, strict=True)] or [0, 0, 0]


def begun(fronts: Fronts, k: int, matrix: Sorted, space: Workspace) -> tuple[Array, Array]:
    """The panel and the update of a front, with the matrix in them, in the workspace."""
    panel, update = taken(fronts, k, space)
    begin(fronts, k, panel, matrix, update, space.local)
    return panel, update


def packed(update: Array, each: Map) -> Array:
    """The lower triangle of an update."""
    lower = np.empty(triangle(len(update)))
    finish(each(lambda columns: pack(update, lower, *columns), tiles(0, len(update))))
    return lower


def add_tiled(
    fronts: Fronts, child: int, of_child: Array, panel: Array, update: Array, local: Array, each: Map
) -> None:
    """As `add`, all columns, on all threads."""
    finish(
        each(
            lambda columns: add(fronts, child, of_child, panel, update, local, columns[0], columns[1]),
            tiles(0, shape(fronts, child)[1]),
        )
    )


def _eliminate_tiled(fronts: Fronts, k: int, front: Array, update: Array, each: Map) -> None:
    """As `eliminate`, by tiles that do not depend on the number of threads."""
    own, rest = shape(fronts, k)
    size, panel = own + rest, front.reshape(front.size)
    for first, last in tiles(0, own):
        bad = diagonal_tile(panel, size, first, last)
        _check_pivot(fronts.starts[k] + first + bad - 1 if bad else DONE)
        finish(each(lambda rows, of=(first, last): row_tile(panel, size, *of, *rows), tiles(last, size)))
    pairs = [(columns, rows) for columns in tiles(0, rest) for rows in tiles(0, rest) if rows >= columns]
    finish(each(lambda pair: update_tile(panel, own, update, *pair[0], *pair[1]), pairs))
    finish(each(lambda columns: keep(fronts, k, front, *columns), tiles(0, own)))


def tiles(start: int, stop: int) -> list[tuple[int, int]]:
    """start...stop in pieces that do not depend on the number of threads."""
    return [(first, min(first + _TILE, stop)) for first in range(start, stop, _TILE)]


def _check_pivot(bad: int) -> None:
    if bad != DONE:
        raise np.linalg.LinAlgError(f"pivot {bad + 1} is not positive")
