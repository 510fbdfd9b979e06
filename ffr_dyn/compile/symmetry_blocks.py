"""Products of a body in blocks: its symmetry decides which elastic coordinates they couple, and only those are computed.

The shapes of a body with two planes of symmetry fall into four families, those of a body with one into two. Each component
of the second moments of the shapes (I5, I9), and each second-order term, couples a family with one other; the
rest vanishes but for the rounding of the mode shapes. Sorted by family such a table is a few dense blocks, of a quarter or
half of its entries. A body without symmetry is one block.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from ffr_prep.common.arrays import Array

# What sorting costs: as much as this many multiplications per product (measured with 8 to 64 coordinates).
SORTING = 8


def in_blocks(table: Array, last: int, noise: Array) -> tuple[Array, Array]:
    """(pool, plan) of a table (n, C, n) over i, components, j: sum_i q_i table[i], as the kernel `contract` reads it.

    table : table[i, c, j] = +-table[j, c, i]
    last  : so many of the last components are multiplied by q_dot, too
    noise : (C,) entries that are not larger are rounding

    plan, of integers: [0] for one block, which is the table as it is. Else the number of blocks; of each the number of
    coordinates, of products, and of those of the last components; the coordinates by block; where the products of all
    components, and those of the last, are found among those by block (past the end where they vanish).
    """
    n, C, _ = table.shape
    whole = np.ravel(table), np.zeros(1, dtype=np.int64)
    if n <= SORTING:
        return whole
    block_in, block_out = _blocks(np.abs(table) > noise[:, None])
    kept = block_in[:, None, None] == block_out[None]
    kept &= np.swapaxes(kept, 0, 2)
    if SORTING * C * n + np.count_nonzero(kept) > table.size:
        return whole
    table = np.where(kept, table, 0.0).reshape(n, C * n)
    owner = block_out.ravel()
    pool, plan, order, places, last_places = [], [], [], np.full(C * n, -1), np.full(last * n, -1)
    first_of_last, count, last_count = (C - last) * n, 0, 0
    for block in np.unique(owner[owner >= 0]):
        i, k = np.flatnonzero(block_in == block), np.flatnonzero(owner == block)
        late = k[k >= first_of_last]
        pool.append(table[np.ix_(i, k)].ravel())
        plan += [i.size, k.size, late.size]
        order.append(i)
        places[k] = count + np.arange(k.size)
        last_places[late - first_of_last] = last_count + np.arange(late.size)
        count, last_count = count + k.size, last_count + late.size
    places[places < 0], last_places[last_places < 0] = count, last_count
    listed = np.concatenate(order)
    rest = np.setdiff1d(np.arange(n), listed)  # coordinates that nothing is multiplied by
    return np.concatenate(pool), np.concatenate([[len(pool)], plan, listed, rest, places, last_places]).astype(np.int64)


def _blocks(coupled: Array) -> tuple[Array, Array]:
    """Block numbers of coordinates (n,) and of products (C, n), or -1, where coupled (n, C, n) tells which have a part in
    which."""
    n = len(coupled)
    has = coupled.reshape(n, -1)
    _, block = connected_components(csr_array(np.asarray(has, dtype=float) @ has.T), directed=False)
    return block, np.where(has.any(axis=0), block[has.argmax(axis=0)], -1).reshape(coupled.shape[1:])
