"""The numbers behind a diagram, as CSV."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path

from ffr_dyn.chart.diagram import CPU, EVALUATIONS, WALL, Diagram
from ffr_prep.common.outputs import replacing


def headings(diagram: Diagram) -> list[str]:
    """Of the columns of the table."""
    times = [f"{clock} {word} [s]" for clock in (WALL, CPU) for word in ("median", "least", "greatest")]
    errors = [f"error of {m.name} [{m.unit}]" for m in diagram.measures]
    relative = [f"relative error of {m.name}" for m in diagram.measures]
    fronts = [f"on the front: {m.name} against {cost}" for m in diagram.measures for cost in (CPU, WALL, EVALUATIONS)]
    return ["method", "model", "number", "kind", "status", "reason", *times, EVALUATIONS, *errors, *relative, *fronts]


def rows(diagram: Diagram) -> Iterator[list[object]]:
    """A row per variant, those that were lost last; numbers with all their digits."""
    names = [measure.name for measure in diagram.measures]
    fronts = [diagram.front(name, cost) for name in names for cost in (CPU, WALL, EVALUATIONS)]
    for point in diagram.points:
        errors = [point.errors[name] for name in names]
        relative = [point.errors[name] / diagram.scale(name) for name in names]
        marks = ["yes" if point in front else "" for front in fronts]
        known = [*point.wall, *point.cpu, point.evaluations or "", *errors, *relative, *marks]
        yield [point.series, point.model, point.number, point.kind, "done", "", *known]
    for lost in diagram.lost:
        empty = [""] * (len(headings(diagram)) - 6)
        yield [lost.series, lost.model, lost.number, lost.kind, "failed", lost.reason, *empty]


def write_table(diagram: Diagram, path: str | Path) -> Path:
    """Write the table as comma-separated values (RFC 4180), atomically.

    Raises InputError for a path that is a folder or a link, ComputationError where the file cannot be written.

    >>> fd.write_table(diagram, "chart.csv")
    """
    path = Path(path)
    with replacing(path) as part, open(part, "w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow(headings(diagram))
        writer.writerows(rows(diagram))
    return path
