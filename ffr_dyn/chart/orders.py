"""The order of convergence that a method shows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ffr_dyn.chart.diagram import Diagram

LEVEL = 0.5  # order below which errors do not fall: something else than the step makes them
ABOVE = 3.0  # times the floor, itself a careful estimate: errors below are not the method's own


def observed_order(steps: Sequence[float], errors: Sequence[float], floor: float = 0.0) -> float:
    """Slope of log(error) over log(step) between the two finest steps whose errors are well above the floor.

    Zero where errors do not fall, not a number where there are not two such steps: an order has no meaning there.
    """
    known = sorted({h: e for h, e in zip(steps, errors, strict=True) if e > ABOVE * floor and e > 0}.items())
    if len(known) < 2:
        return float("nan")
    (h, e), (h2, e2) = known[:2]
    order = float(np.log(e2 / e) / np.log(h2 / h))
    return order if order >= LEVEL else 0.0


def order_words(order: float) -> str:
    """For a reader."""
    if np.isnan(order):
        return "not to be seen"
    return f"{order:.1f}" if order else "level"


def orders(diagram: Diagram, measure: str) -> dict[tuple[str, str], float]:
    """The observed order [1] of every line (series, model) of a diagram whose methods take steps: the slope of the error over
    the step. Zero where errors do not fall; not a number where fewer than two steps have errors above the reference's.

    >>> fd.orders(diagram, "deflection:rod")
    """
    found = {}
    for series, model in dict.fromkeys((point.series, point.model) for point in diagram.points):
        line = [p for p in diagram.points if (p.series, p.model) == (series, model) and p.kind == "step"]
        errors = [point.errors[measure] for point in line]
        found[series, model] = observed_order([p.number for p in line], errors, diagram.reference.floors[measure])
    return found
