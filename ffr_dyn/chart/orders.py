"""The order of convergence that a method shows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ffr_dyn.chart.diagram import Diagram

LEVEL = 0.5  # order below which errors do not fall: something else than the step makes them
ABOVE = 3.0  # times the floor, itself a careful estimate: errors below are not the method's own


def observed_order(steps: Sequence[float], errors: Sequence[float], floor: float = 0.0) -> float:
    """Slope of log(error) over log(step) between the two finest steps whose errors are well above the floor.

    Not a number where there are not two, or where errors do not fall: an order has no meaning there.
    """
    known = sorted((h, e) for h, e in zip(steps, errors, strict=True) if e > ABOVE * floor and e > 0)
    if len(known) < 2:
        return float("nan")
    (h, e), (h2, e2) = known[:2]
    order = float(np.log(e2 / e) / np.log(h2 / h))
    return order if order >= LEVEL else float("nan")


def order_words(order: float) -> str:
    """For a reader."""
    return f"{order:.1f}" if order == order else "level"


def orders(diagram: Diagram, measure: str) -> dict[tuple[str, str], float]:
    """The observed order [1] of every line (series, model) of a diagram whose methods take steps: the slope of the error over
    the step.

    >>> fd.orders(diagram, "deflection:rod")
    """
    found = {}
    for series, model in dict.fromkeys((point.series, point.model) for point in diagram.points):
        line = [p for p in diagram.points if (p.series, p.model) == (series, model) and p.kind == "step"]
        errors = [point.errors[measure] for point in line]
        found[series, model] = observed_order([p.number for p in line], errors, diagram.reference.floors[measure])
    return found
