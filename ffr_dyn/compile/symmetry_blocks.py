"""Products of a body in blocks: its symmetry decides which elastic coordinates they couple, and only those are computed.

The shapes of a body with two planes of symmetry fall into four families, those of a body with one into two. Each component
of the second moments of the shapes (I5, I9), and each second-order term, couples a family with one other; the rest vanishes
but for the rounding of the mode shapes. Sorted by family such a table is a few dense blocks, of a quarter or half of its
entries. A body without symmetry is one block.
"""

from __future__ import annotations

import numpy as np

from ffr_dyn.kernels.tables import LANES, MIXED, SORTED, WHOLE
from ffr_dyn.variants.families import families
from ffr_prep.common.arrays import Array

Part = tuple[Array, Array]  # coordinates of a family, and products that are sums over them

# What is dear, in multiplications (measured with 8 to 64 coordinates): a block; a row of lanes that is brought to its place;
# a product that is, alone.
BLOCK, BROUGHT, ALONE = 96, 16, 6
FEW = 8  # coordinates, which are not worth the search


def in_blocks(table: Array, last: int, noise: Array | float) -> tuple[Array, Array]:
    """(pool, plan) of a table (n, C, n) over i, components, j: sum_i q_i table[i], as the kernel `contract` reads it.

    table : table[i, c, j] = +-table[j, c, i]
    last  : so many of the last components are multiplied by q_dot, too
    noise : number or (n, C, n); entries that are not larger couple nothing, they are left out between families that nothing
            else couples

    The plan, of integers, begins with the numbers that `ffr_dyn.kernels.tables.BLOCKS` and what follows it name. Of each
    block its first coordinate and how many, its first sum and how many, in whole rows of lanes in the pool. Where coordinates
    are SORTED, of each run of at most a row of lanes, by ascending products: where it is among the sums, where it belongs
    among the products; what is written beyond it, the next writes again. Where they are MIXED, their numbers by family, and
    where each product is among the sums.
    """
    n, C, _ = table.shape
    rows, early = table.reshape(n, C * n), (C - last) * n
    every, products = np.arange(n), np.arange(C * n)
    whole = [(every, products[:early]), (every, products[early:])]
    if n > FEW:
        coupled = np.abs(table) > noise
        parts, order = _by_family(coupled, early)
        plan, cost = _sorted_plan(parts, order, early, C * n)
        if cost < _cost(whole):
            return _pool(rows, parts), plan
    blocks = [(0, n, int(k[0]), k.size) for _, k in whole if k.size]
    return _pool(rows, whole), np.array([len(blocks), WHOLE, early, 0, 0, 0, *np.ravel(blocks)], dtype=np.int64)


def _by_family(coupled: Array, early: int) -> tuple[list[Part], Array]:
    """Of each family what it makes of the products before `early`, then of the others; the coordinates by family."""
    family = families(coupled)
    owner = np.where(coupled.any(axis=0), family[coupled.argmax(axis=0)], -1).ravel()
    members = [np.flatnonzero(family == one) for one in np.unique(family)]
    found = [np.flatnonzero(owner == one) for one in np.unique(family)]
    return [
        *((i, k[k < early]) for i, k in zip(members, found, strict=True)),
        *((i, k[k >= early]) for i, k in zip(members, found, strict=True)),
    ], np.concatenate(members)


def _sorted_plan(parts: list[Part], order: Array, early: int, size: int) -> tuple[Array, float]:
    """Plan and cost of `size` products that are found family by family."""
    first, count, late = np.argsort(order), 0, 0
    blocks, place = [], np.full(size, -1)
    for i, k in parts:
        if k.size:
            blocks.append((int(first[i[0]]), i.size, count, _lanes(k.size)))
            place[k] = count + np.arange(k.size)
            count += _lanes(k.size)
            late = count if k[0] < early else late
    place[place < 0] = count
    head, cost = [len(blocks), SORTED, late, count], _cost(parts)
    if np.any(np.diff(order) < 0):
        plan = np.concatenate([[len(blocks), MIXED, late, count, 0, 0], np.ravel(blocks), order, place])
        return plan.astype(np.int64), cost + ALONE * (2 * size - early)
    runs = _runs(place, early)
    of_both = sum(k >= early for _, k in runs)
    plan = np.concatenate([[*head, len(runs), of_both], np.ravel(blocks), np.ravel(runs)])
    return plan.astype(np.int64), cost + BROUGHT * (len(runs) + of_both)


def _runs(place: Array, early: int) -> list[tuple[int, int]]:
    """Where runs of at most a row of lanes are among the sums, and where among the products, from the places of products."""
    ends = np.flatnonzero((np.diff(place) != 1) & ((np.diff(place) != 0) | (place[1:] < place.max()))) + 1
    parts = np.split(np.arange(place.size), np.union1d(ends, [early]).astype(int))
    return [(int(place[k]), int(k)) for part in parts for k in part[::LANES]]


def _pool(rows: Array, parts: list[Part]) -> Array:
    """The entries of the rows part by part, with zeros up to whole rows of lanes."""
    padded = np.pad(rows, ((0, 0), (0, 1)))
    blocks = [padded[np.ix_(i, np.pad(k, (0, _lanes(k.size) - k.size), constant_values=-1))].ravel() for i, k in parts]
    return np.concatenate([np.zeros(0), *blocks])


def _lanes(count: int) -> int:
    return -(-count // LANES) * LANES


def _cost(parts: list[Part]) -> int:
    return sum(BLOCK + i.size * _lanes(k.size) for i, k in parts if k.size)
