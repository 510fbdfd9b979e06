"""Elimination order and fill of the multiplier system, once per topology.

Blocks (joints) are the nodes of a graph; two are joined when they share a body. Greedy minimum degree gives no fill for
chains and trees and little for a few loops (George & Liu 1981, ch. 5).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from heapq import heapify, heappop, heappush

from ffr_prep.common.brief import Brief


@dataclass(frozen=True, repr=False)
class Elimination(Brief):
    """order: block numbers in the order of elimination; columns[k]: positions > k that are coupled to position k."""

    order: tuple[int, ...]
    columns: tuple[tuple[int, ...], ...]


def eliminate(sizes: Sequence[int], bodies: Sequence[tuple[int, ...]]) -> Elimination:
    """Order the blocks; sizes[k] rows, bodies[k] the moving bodies that block k touches.

    The last graphs are known by these numbers, which are all there is to it: scenes of one structure are ordered once.
    """
    return _eliminated(tuple(sizes), tuple(bodies))


@lru_cache(64)
def _eliminated(sizes: tuple[int, ...], bodies: tuple[tuple[int, ...], ...]) -> Elimination:
    count = len(sizes)
    at_body: dict[int, list[int]] = {}
    for k, touched in enumerate(bodies):
        for b in touched:
            at_body.setdefault(b, []).append(k)
    neighbours: list[set[int]] = [set() for _ in range(count)]
    for group in at_body.values():
        for k in group:
            neighbours[k].update(g for g in group if g != k)

    def degree(k: int) -> int:
        return sum(sizes[g] for g in neighbours[k])

    order: list[int] = []
    columns: list[set[int]] = []
    waiting = [(degree(k), k) for k in range(count)]
    heapify(waiting)
    left = set(range(count))
    while waiting:
        found, best = heappop(waiting)
        if best not in left or found != degree(best):
            continue  # its degree has changed: it waits with the new one, too
        clique = neighbours[best]
        for k in clique:
            neighbours[k] |= clique
            neighbours[k] -= {k, best}
        for k in clique:
            heappush(waiting, (degree(k), k))
        order.append(best)
        columns.append(set(clique))
        left.remove(best)
    position = {k: at for at, k in enumerate(order)}
    return Elimination(tuple(order), tuple(tuple(sorted(position[g] for g in column)) for column in columns))
