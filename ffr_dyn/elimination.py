"""Elimination order and fill of the multiplier system, once per topology.

Blocks (joints) are the nodes of a graph; two are joined when they share a body. Greedy minimum degree gives no fill for
chains and trees and little for a few loops (George & Liu 1981, ch. 5).
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Elimination:
    """order: block numbers in the order of elimination; columns[k]: positions > k that are coupled to position k."""

    order: tuple[int, ...]
    columns: tuple[tuple[int, ...], ...]


def eliminate(sizes: list[int], bodies: list[tuple[int, ...]]) -> Elimination:
    """Order the blocks; sizes[k] rows, bodies[k] the moving bodies that block k touches."""
    count = len(sizes)
    at_body: dict[int, list[int]] = {}
    for k, touched in enumerate(bodies):
        for b in touched:
            at_body.setdefault(b, []).append(k)
    neighbours: list[set[int]] = [set() for _ in range(count)]
    for group in at_body.values():
        for k in group:
            neighbours[k].update(g for g in group if g != k)
    order: list[int] = []
    columns: list[set[int]] = []
    left = set(range(count))
    while left:
        best = min(left, key=lambda k: (sum(sizes[g] for g in neighbours[k]), k))
        clique = neighbours[best]
        for k in clique:
            neighbours[k] |= clique
            neighbours[k] -= {k, best}
        order.append(best)
        columns.append(set(clique))
        left.remove(best)
    position = {k: at for at, k in enumerate(order)}
    return Elimination(tuple(order), tuple(tuple(sorted(position[g] for g in column)) for column in columns))
