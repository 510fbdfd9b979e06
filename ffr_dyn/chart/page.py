"""A work-precision diagram as one self-contained interactive page: plotly.js and all numbers are inside, it works offline."""

from __future__ import annotations

import html
from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import Any

import plotly.io

from ffr_dyn.chart.diagram import COSTS, CPU, EVALUATIONS, Diagram, Point
from ffr_dyn.chart.draw import COST_WORDS, FLOOR, FRONT, error_words, look
from ffr_prep.common.outputs import replacing

SYMBOLS = {
    "o": "circle", "s": "square", "^": "triangle-up", "D": "diamond", "v": "triangle-down", "<": "triangle-left",
    ">": "triangle-right", "P": "cross", "X": "x", "h": "hexagon", "*": "star", "p": "pentagon",
}  # fmt: skip

Item = dict[str, Any]


def write_page(diagram: Diagram, path: str | Path) -> Path:
    """Write the page, atomically: lines with every variant's numbers under the mouse, and menus for measure and cost.

    Raises InputError for a path that is a folder or a link, ComputationError where the file cannot be written.

    >>> fd.write_page(diagram, "chart.html")
    """
    path = Path(path)
    with replacing(path) as part:
        part.write_text(page(diagram), encoding="utf-8")
    return path


def page(diagram: Diagram) -> str:
    """The HTML text."""
    views = [(measure.name, cost) for measure, cost in product(diagram.measures, COSTS)]
    traces: list[Item] = []
    owner: list[int] = []
    for k, (measure, cost) in enumerate(views):
        for trace in _traces(diagram, measure, cost):
            traces.append({**trace, "visible": k == 0})
            owner.append(k)
    figure = {"data": traces, "layout": _layout(diagram, views, owner)}
    content = plotly.io.to_html(
        figure,
        config={"displaylogo": False, "responsive": True},
        include_plotlyjs=True,
        include_mathjax=False,
        full_html=False,
        default_height="85vh",
        validate=False,
        div_id="diagram",
    )
    title = html.escape(f"{diagram.title}: work and precision")
    style = "html, body { margin: 0; background: white; font-family: sans-serif } details { margin: 0 2em 1em }"
    head = f'<meta charset="utf-8"><title>{title}</title><style>{style}</style>'
    return (
        f'<!DOCTYPE html>\n<html lang="en">\n<head>{head}</head>\n<body>{content}{_remarks(diagram)}</body>\n</html>\n'
    )


def _traces(diagram: Diagram, measure: str, cost: str) -> Iterator[Item]:
    scale, floor = diagram.scale(measure), diagram.reference.floors[measure]
    models = {point.model for point in diagram.points}
    for (series, model), (colour, marker) in look([diagram]).items():
        line = [p for p in diagram.points if (p.series, p.model) == (series, model) and p.errors[measure] > 0]
        line = sorted((p for p in line if p.cost(cost) > 0), key=lambda p: p.number, reverse=True)
        yield {
            "type": "scatter",
            "mode": "lines+markers",
            "name": series if len(models) == 1 else f"{series}, {model}",
            "x": [p.cost(cost) for p in line],
            "y": [p.errors[measure] / scale for p in line],
            "error_x": _bars(line, cost),
            "text": [_words(diagram, p, measure) for p in line],
            "hovertemplate": "%{text}<extra></extra>",
            "line": {"color": colour, "width": 1.5},
            "marker": {"symbol": SYMBOLS[marker], "size": 9, "color": colour},
        }
    front = [p for p in diagram.front(measure, cost) if p.errors[measure] > 0]
    ring = {"symbol": "circle-open", "size": 17, "color": FRONT, "line": {"width": 1.5}}
    yield _still("Pareto front", [(p.cost(cost), p.errors[measure] / scale) for p in front], ring)
    chosen = [p for p in diagram.points if p.label in diagram.chosen and p.errors[measure] > 0]
    if chosen:
        star = {"symbol": "star", "size": 19, "color": "#F0C000", "line": {"width": 1, "color": FRONT}}
        yield _still("chosen", [(p.cost(cost), p.errors[measure] / scale) for p in chosen], star)
    costs = [p.cost(cost) for p in diagram.points if p.cost(cost) > 0]
    if measure in diagram.limits and costs:
        across = [(cost, diagram.limits[measure] / scale) for cost in (min(costs) / 1.5, max(costs) * 1.5)]
        yield _still("tolerance", across, {}) | {"mode": "lines", "line": {"dash": "dash", "color": FRONT}}
    if floor > 0 and costs:
        ends = [(min(costs) / 1.5, floor / scale), (max(costs) * 1.5, floor / scale)]
        dashed = {"mode": "lines", "line": {"dash": "dash", "color": FLOOR}}
        yield _still("error of the reference", ends, {}) | dashed


def _still(name: str, at: list[tuple[float, float]], marker: Item) -> Item:
    """Points that are only looked at."""
    x, y = [float(x) for x, _ in at], [float(y) for _, y in at]
    return {"type": "scatter", "mode": "markers", "name": name, "x": x, "y": y, "marker": marker, "hoverinfo": "skip"}


def _bars(line: list[Point], cost: str) -> Item:
    if cost == EVALUATIONS:
        return {"visible": False}
    times = [point.cpu if cost == CPU else point.wall for point in line]
    up, down = [most - m for m, _, most in times], [m - least for m, least, _ in times]
    return {"type": "data", "symmetric": False, "array": up, "arrayminus": down, "thickness": 1, "width": 3}


def _words(diagram: Diagram, point: Point, measure: str) -> str:
    unit = diagram.measure(measure).unit
    error = point.errors[measure]
    lines = [
        f"<b>{html.escape(point.label)}</b>",
        f"error {error:.3g} {unit}, relative {error / diagram.scale(measure):.3g}",
        f"CPU {point.cpu[0]:.3g} s ({point.cpu[1]:.3g} to {point.cpu[2]:.3g})",
        f"wall {point.wall[0]:.3g} s ({point.wall[1]:.3g} to {point.wall[2]:.3g})",
    ]
    return "<br>".join(lines + ([f"{point.evaluations} evaluations"] if point.evaluations else []))


def _layout(diagram: Diagram, views: list[tuple[str, str]], owner: list[int]) -> Item:
    def axis(title: str) -> Item:
        return {"type": "log", "title": {"text": title}, "exponentformat": "power", "gridcolor": "#E2E2E2", "dtick": 1}

    def error(measure: str) -> str:
        return f"{diagram.measure(measure).words}: {error_words(diagram, measure)}"

    buttons = [
        {
            "label": f"{measure} over {cost}",
            "method": "update",
            "args": [
                {"visible": [own == k for own in owner]},
                {"xaxis.title.text": COST_WORDS[cost], "yaxis.title.text": error(measure)},
            ],
        }
        for k, (measure, cost) in enumerate(views)
    ]
    menu = {"buttons": buttons, "x": 1.0, "xanchor": "right", "y": 1.02, "yanchor": "bottom", "showactive": True}
    return {
        "title": {"text": html.escape(f"{diagram.title}: work and precision"), "x": 0.02},
        "xaxis": axis(COST_WORDS[views[0][1]]),
        "yaxis": axis(error(views[0][0])),
        "updatemenus": [menu],
        "plot_bgcolor": "white",
        "hovermode": "closest",
    }


def _remarks(diagram: Diagram) -> str:
    """How the reference was found, and what failed."""
    story = "".join(f"<li>{html.escape(line)}</li>" for line in (*diagram.reference.story, *diagram.notes))
    text = f"<details><summary>How the reference was found</summary><ul>{story}</ul></details>"
    if diagram.lost:
        lost = "".join(f"<li>{html.escape(one.label)}: {html.escape(one.reason)}</li>" for one in diagram.lost)
        text += f"<details open><summary>{len(diagram.lost)} variants failed</summary><ul>{lost}</ul></details>"
    return text
