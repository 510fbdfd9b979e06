"""Products of a body in blocks: its symmetry decides which elastic coordinates they couple, and only those are computed.

The shapes of a body with two planes of symmetry fall into four families, those of a body with one into two. Each component
of the second moments of the shapes (I5, I9), and each second-order term, couples a family with one other; the rest vanishes
but for the rounding of the mode shapes. Sorted by family such a table is a few dense blocks, of a quarter or half of its
entries. A body without symmetry is one block.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from ffr_dyn.kernels.tables import AT_ONCE, LANES
from ffr_dyn.variants.families import families
from ffr_prep.common.arrays import Array

# What is dear, in products of a number and a row of lanes (measured with 8 to 64 coordinates): a second number, a block, a
# product that is found elsewhere and brought to its place, a coordinate that is.
SECOND, BLOCK, LOOSE, SORTED = 0.6, 12.0, 0.8, 2.0
FEW = 8  # coordinates, which are not worth the search


def in_blocks(table: Array, last: int, noise: Array) -> tuple[Array, Array]:
    """(pool, plan) of a table (n, C, n) over i, components, j: sum_i q_i table[i], as the kernel `contract` reads it.

    table : table[i, c, j] = +-table[j, c, i]
    last  : so many of the last components are multiplied by q_dot, too
    noise : (C,) entries that are not larger are rounding

    A block is of a family of coordinates: the products that are sums over it, in strips of lanes. Strips within a run of such
    products are found where they belong; what is left of the runs shares other strips, loose, and is brought there.

    plan, of integers: number of blocks; 1 where coordinates are to be sorted, or 0; numbers of loose products, and of those
    of them that are multiplied by q_dot, too; the first product that is; how much all products and strips take, a zero at
    their end; of each block its first coordinate and how many, and how many strips are multiplied by q alone and by both;
    the coordinates by family where they are to be sorted; the places of the strips; of loose products, those by both last,
    where they belong and where they are found.
    """
    n, C, _ = table.shape
    coupled, early = np.abs(table) > noise[:, None], (C - last) * n
    whole = Partition(np.zeros(n, dtype=np.int64), np.zeros(C * n, dtype=np.int64), early)
    if n <= FEW:
        return whole.pool(table), whole.plan
    family = families(coupled)
    owner = np.where(coupled.any(axis=0), family[coupled.argmax(axis=0)], -1).ravel()
    best = _merged(Partition(family, owner, early))
    if best.cost >= whole.cost:
        return whole.pool(table), whole.plan
    return best.pool(np.where(coupled, table, 0.0)), best.plan


@dataclass(frozen=True)
class Partition:
    """Coordinates in families that share no product.

    family : (n,) of each coordinate;  owner : (C n,) the family that makes a product, or -1;  early : see `in_blocks`
    """

    family: Array
    owner: Array
    early: int

    @cached_property
    def members(self) -> list[Array]:
        """The coordinates of each family."""
        return [np.flatnonzero(self.family == one) for one in np.unique(self.family)]

    @cached_property
    def strips(self) -> list[tuple[list[Array], list[Array]]]:
        """Of each family the products of its strips, those that are multiplied by q alone and those that are by both."""
        found = []
        for one in np.unique(self.family):
            products = np.flatnonzero(self.owner == one)
            late = products >= self.early
            found.append((_strips(products[~late]), _strips(products[late])))
        return found

    @property
    def sorted(self) -> bool:
        return bool(np.any(np.diff(np.concatenate(self.members)) < 0))

    @cached_property
    def cost(self) -> float:
        rows = loose = 0.0
        for members, (once, both) in zip(self.members, self.strips, strict=True):
            rows += len(members) * (len(once) + (1 + SECOND) * len(both))
            loose += sum(len(s) for s in once if not _whole(s)) + 2 * sum(len(s) for s in both if not _whole(s))
        return rows + BLOCK * len(self.members) + LOOSE * loose + SORTED * self.sorted * self.family.size

    def pool(self, table: Array) -> Array:
        """The entries of the table (n, C, n) block by block, with zeros where a strip is not full."""
        rows, parts = np.pad(table.reshape(len(table), -1), ((0, 0), (0, 1))), []
        for members, (once, both) in zip(self.members, self.strips, strict=True):
            columns = [np.pad(s, (0, LANES - len(s)), constant_values=-1) for s in (*once, *both)]
            if columns:
                parts.append(rows[np.ix_(members, np.concatenate(columns))].ravel())
        return np.concatenate([np.zeros(0), *parts])

    @cached_property
    def plan(self) -> Array:
        blocks, places, end, first = [], [], self.owner.size, 0
        loose: list[tuple[int, int]] = []
        for members, (once, both) in zip(self.members, self.strips, strict=True):
            blocks += [first, len(members), len(once), len(both)]
            first += len(members)
            for strip in (*once, *both):
                places.append(int(strip[0]) if _whole(strip) else end)
                if not _whole(strip):
                    loose += [(int(k), end + at) for at, k in enumerate(strip)]
                    end += LANES
        loose += [(int(k), end) for k in np.flatnonzero(self.owner < 0)]
        alone, late = (
            sorted(pair for pair in loose if (pair[0] >= self.early) == is_late) for is_late in (False, True)
        )
        for some in (alone, late):
            some += [(end, end)] * (-len(some) % AT_ONCE)
        order = np.concatenate(self.members) if self.sorted else np.zeros(0)
        head = [len(self.members), self.sorted, len(alone) + len(late), len(late), self.early, end + LANES]
        return np.concatenate([head, blocks, order, places, np.ravel(alone + late)]).astype(np.int64)


def _strips(products: Array) -> list[Array]:
    """Products (K,), ascending, in strips: whole ones of runs, then what is left of the runs."""
    runs = np.split(products, np.flatnonzero(np.diff(products) > 1) + 1)
    whole = [run[k : k + LANES] for run in runs for k in range(0, len(run) - LANES + 1, LANES)]
    left = np.concatenate([run[len(run) - len(run) % LANES :] for run in runs])
    return whole + [left[k : k + LANES] for k in range(0, len(left), LANES)]


def _whole(strip: Array) -> bool:
    return len(strip) == LANES and bool(strip[-1] - strip[0] == LANES - 1)


def _merged(best: Partition) -> Partition:
    """Families that lie side by side are merged while that costs less."""
    while len(best.members) > 1:
        tried = [
            Partition(np.where(best.family == b, a, best.family), np.where(best.owner == b, a, best.owner), best.early)
            for a, b in pairwise(np.unique(best.family))
        ]
        least = min(tried, key=lambda one: one.cost)
        if least.cost > best.cost:
            break
        best = least
    return best
