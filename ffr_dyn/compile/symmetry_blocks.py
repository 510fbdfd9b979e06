"""Products of a body in blocks: its symmetry decides which elastic coordinates they couple, and only those are computed.

The shapes of a body with two planes of symmetry fall into four families, those of a body with one into two. Each component
of the second moments of the shapes (I5, I9), and each second-order term, couples a family with one other; the rest vanishes
but for the rounding of the mode shapes. Sorted by family such a table is a few dense blocks, of a quarter or half of its
entries. A body without symmetry is one block.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ffr_dyn.kernels.tables import LANES
from ffr_dyn.variants.families import families
from ffr_prep.common.arrays import Array

Block = tuple[int, int, int, int]  # first coordinate, how many, first product, how many

# What sorting costs: as much as this many multiplications per product (measured with 8 to 64 coordinates).
SORTING = 8
BLOCK = 96  # what a block costs, likewise


def in_blocks(table: Array, last: int, noise: Array) -> tuple[Array, Array]:
    """(pool, plan) of a table (n, C, n) over i, components, j: sum_i q_i table[i], as the kernel `contract` reads it.

    table : table[i, c, j] = +-table[j, c, i]
    last  : so many of the last components are multiplied by q_dot, too
    noise : (C,) entries that are not larger are rounding

    plan, of integers: number of blocks; 1 where they are in the order of coordinates and products, or 0; the first product
    that is multiplied by q_dot, too; of each block its first coordinate and how many, its first product and how many, by
    ascending products. Where they are sorted by family: the numbers of the coordinates; where the products of all components
    are found, and those of the last (past the end where they vanish).
    """
    n, C, _ = table.shape
    coupled = np.abs(table) > noise[:, None]
    whole = [(0, n, 0, (C - last) * n), (0, n, (C - last) * n, last * n)]
    if n <= SORTING:
        return _in_order(table, whole, last)
    family = families(coupled)
    found = _fewest(coupled, _apart(family))
    sorted_pool, sorted_plan = _by_family(np.where(coupled, table, 0.0), coupled, family, last)
    costs = [_cost(whole), _cost(found), SORTING * C * n + sorted_pool.size + BLOCK * int(sorted_plan[0])]
    if costs[2] < min(costs[:2]):
        return sorted_pool, sorted_plan
    return (
        _in_order(table, whole, last) if costs[0] <= costs[1] else _in_order(np.where(coupled, table, 0.0), found, last)
    )


def _by_family(table: Array, coupled: Array, family: Array, last: int) -> tuple[Array, Array]:
    """Pool and plan of a table sorted by family: two blocks of each, of which one is multiplied by q_dot, too."""
    n, C, _ = table.shape
    rows, early = table.reshape(n, C * n), (C - last) * n
    owner = np.where(coupled.any(axis=0), family[coupled.argmax(axis=0)], -1).ravel()
    order, pool, blocks, places = [], [], [], np.full(C * n, C * n)
    count, begin = 0, 0
    for late in (False, True):
        first = 0
        for one in np.unique(family):
            i, k = np.flatnonzero(family == one), np.flatnonzero(owner == one)
            k = k[(k >= early) == late]
            if k.size:
                pool.append(rows[np.ix_(i, k)].ravel())
                blocks.append((first, i.size, count, k.size))
                places[k] = count + np.arange(k.size)
                count += k.size
            first += i.size
            order += [] if late else [i]
        begin = begin if late else count
    late_places = np.where(places[early:] < C * n, places[early:] - begin, last * n)
    head = np.array([len(blocks), 0, begin, *(number for block in blocks for number in block)])
    return np.concatenate([np.zeros(0), *pool]), np.concatenate([head, *order, places, late_places]).astype(np.int64)


def _in_order(table: Array, blocks: list[Block], last: int) -> tuple[Array, Array]:
    n, C, _ = table.shape
    rows, kept = table.reshape(n, C * n), [block for block in blocks if block[3]]
    pool = np.concatenate([rows[i : i + count, k : k + width].ravel() for i, count, k, width in kept])
    return pool, np.concatenate([[len(kept), 1, (C - last) * n], *kept]).astype(np.int64)


def _apart(family: Array) -> Array:
    """Where coordinates may be parted in their order without parting a family, ends included."""
    n = family.size
    last = {int(f): k for k, f in enumerate(family)}
    reach = np.maximum.accumulate([last[int(f)] for f in family])
    return np.array([0, *(k + 1 for k in range(n) if reach[k] == k)])


def _blocks(coupled: Array, first: Array) -> list[Block]:
    """Of every run of coordinates, which begin at `first`, and every component: its products and what makes them."""
    found: list[Block] = []
    for c in range(coupled.shape[1]):
        for begin, end in pairwise(first.tolist()):
            of = np.flatnonzero(coupled[:, c, begin:end].any(axis=1))
            one, count = (int(of[0]), int(of[-1] - of[0] + 1)) if of.size else (0, 0)
            found.append((one, count, c * len(coupled) + begin, end - begin))
    return found


def _fewest(coupled: Array, first: Array) -> list[Block]:
    """The blocks of runs that begin at `first`, or of fewer runs while that costs less."""
    best, runs = _blocks(coupled, first), first
    while len(runs) > 2:
        fewer = [np.delete(runs, k) for k in range(1, len(runs) - 1)]
        tried = [_blocks(coupled, one) for one in fewer]
        k = int(np.argmin([_cost(blocks) for blocks in tried]))
        if _cost(tried[k]) > _cost(best):
            break
        best, runs = tried[k], fewer[k]
    return best


def _cost(blocks: list[Block]) -> int:
    return sum(BLOCK + count * -(-width // LANES) * LANES for _, count, _, width in blocks)
