"""Products of a body in blocks: its symmetry decides which elastic coordinates they couple, and only those are computed.

The shapes of a body with two planes of symmetry fall into four families, those of a body with one into two. Each component
of the second moments of the shapes (I5, I9), and each load by its geometric stiffness, couples a family with one other; the
rest vanishes but for the rounding of the mode shapes. Sorted by family such a table is a few dense blocks, of a quarter or
half of its entries. A body without symmetry is one block.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from ffr_dyn.kernels.tables import LANES, QUAD
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


def symmetric_blocks(matrices: Array, numbers: Array, noise: Array) -> tuple[Array, Array]:
    """(pool, plan) of matrices (L, n, n) whose weighted sums are multiplied, as `kernels.stiffening` reads them.

    Of symmetric ones, as all are but those of some files of other programs, only the blocks on one side of the diagonal are
    kept: each serves its coordinates and those across.

    numbers : (L,) where their weights are found
    noise   : (L,) entries that are not larger are rounding

    pool : per group of matrices that share blocks, what each has in those blocks, one row per matrix, of whole lanes
    plan : number of groups, of parts (of families, at most a row of lanes each), of places (each part begins such a row),
           of each group the number of matrices and of entries; the places of the coordinates; where the diagonal is among the
           entries of all groups (past their end where it vanishes); the numbers by group; of each part its first place, its
           fours of rows, how many blocks serve them alone, and how many also what lies across; of each block, by part, its
           first entry, its columns, their first place
    """
    n = matrices.shape[1]
    coupled = np.abs(matrices) > noise[:, None, None]
    symmetric = bool((np.abs(matrices - np.swapaxes(matrices, 1, 2)) <= noise[:, None, None]).all())
    family = (
        _blocks(np.moveaxis(coupled | np.swapaxes(coupled, 1, 2), 0, 1))[0] if n > SORTING else np.zeros(n, dtype=int)
    )
    parts = [np.flatnonzero(family == f) for f in np.unique(family)]
    parts = [part for each in parts for part in np.split(each, range(LANES, each.size, LANES))]
    first = np.cumsum([0, *(in_lanes(part.size) for part in parts)])
    places = np.empty(n, dtype=np.int64)
    for part, at in zip(parts, first, strict=False):
        places[part] = at + np.arange(part.size)
    pairs = [(a, b) for a in range(len(parts)) for b in range(a if symmetric else 0, len(parts))]
    if symmetric:
        pairs = [min(((a, b), (b, a)), key=lambda p: (_quads(parts[p[0]].size), -parts[p[1]].size)) for a, b in pairs]
    pairs.sort(key=lambda p: -parts[p[1]].size)  # rows that fill the lanes begin at whole ones
    every = np.arange(len(matrices))
    touched = np.array([coupled[np.ix_(every, parts[a], parts[b])].any(axis=(1, 2)) for a, b in pairs], dtype=float)
    _, group = connected_components(csr_array(touched @ touched.T), directed=False)
    pool: list[Array] = []
    sizes: list[int] = []
    alone: list[list[tuple[int, int, int]]] = [[] for _ in parts]
    across: list[list[tuple[int, int, int]]] = [[] for _ in parts]
    listed: list[Array] = []
    kept, diagonal = 0, np.full(n, -1)
    for g in np.unique(group[touched.any(axis=1)]):
        own = [pairs[k] for k in np.flatnonzero(group == g)]
        which = np.flatnonzero(touched[group == g].any(axis=0))
        rows = [matrices[np.ix_(which, parts[a], parts[b])].reshape(which.size, -1) for a, b in own]
        begin = np.cumsum([0, *(row.shape[1] for row in rows)])
        rows.append(np.zeros((which.size, in_lanes(begin[-1]) - begin[-1])))
        pool.append(np.concatenate(rows, axis=1))
        sizes += pool[-1].shape
        for k, (a, b) in zip(begin, own, strict=False):
            if a == b:
                diagonal[parts[a]] = kept + k + np.arange(parts[a].size) * (parts[a].size + 1)
            (across if symmetric and a != b else alone)[a].append((kept + k, parts[b].size, first[b]))
        kept += pool[-1].shape[1]
        listed.append(numbers[which])
    diagonal[diagonal < 0] = kept
    heads = [(first[a], _quads(part.size), len(alone[a]), len(across[a])) for a, part in enumerate(parts)]
    plan = [np.array([len(pool), len(parts), first[-1], *sizes]), places, diagonal, *listed, np.ravel(heads)]
    plan += [np.ravel(blocks) for both in zip(alone, across, strict=True) for blocks in both]
    return np.concatenate([part.ravel() for part in pool]), np.concatenate(plan).astype(np.int64)


def _quads(rows: int) -> int:
    return -(-rows // QUAD)


def in_lanes(count: int) -> int:
    """How many numbers whole rows of lanes have that hold so many."""
    return -(-count // LANES) * LANES


def _blocks(coupled: Array) -> tuple[Array, Array]:
    """Block numbers of coordinates (n,) and of products (C, n), or -1, where coupled (n, C, n) tells which have a part in
    which."""
    n = len(coupled)
    has = coupled.reshape(n, -1)
    _, block = connected_components(csr_array(np.asarray(has, dtype=float) @ has.T), directed=False)
    return block, np.where(has.any(axis=0), block[has.argmax(axis=0)], -1).reshape(coupled.shape[1:])
