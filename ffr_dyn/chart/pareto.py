"""The Pareto front: choices that no other choice beats."""

from __future__ import annotations

from collections.abc import Sequence


def pareto_front(costs: Sequence[float], errors: Sequence[float]) -> tuple[int, ...]:
    """Numbers of the choices that are not beaten, cheapest first: no other costs as little or less and errs less.

    Of equal choices the first stays. A cost or an error that is not a number is beaten by everything.
    """
    order = sorted(range(len(costs)), key=lambda k: (costs[k], errors[k], k))
    front: list[int] = []
    least = float("inf")
    for k in order:
        if costs[k] == costs[k] and errors[k] < least:
            front.append(k)
            least = errors[k]
    return tuple(front)
