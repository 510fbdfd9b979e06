"""Work-precision diagrams as pictures, by matplotlib: a panel for each measure, PNG or SVG."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.legend_handler import HandlerLine2D
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import LogFormatterSciNotation, LogLocator

from ffr_dyn.chart.diagram import CPU, EVALUATIONS, WALL, Diagram, Point
from ffr_dyn.pictures.histories import PALETTE, plain
from ffr_prep.common.errors import InputError
from ffr_prep.common.outputs import replacing

COST_WORDS = {
    CPU: "CPU time of the run [s]",
    WALL: "wall time of the run [s]",
    EVALUATIONS: "evaluations of the equations",
}
MARKERS = "os^Dv<>PXh*p"
COLOURS = (*PALETTE, "#7B3294", "#8C510A", "#808080", "#A6D96A", "#B2182B")  # as many methods are told apart
FRONT, FLOOR = "#222222", "#888888"
FEW = (1.0, 0.3)  # decades of an axis, over which powers of ten are too few labels; and over which all ticks get one
BETWEEN = ((0.8, (2.0, 5.0)), (0.4, (2.0, 3.0, 5.0, 7.0)))  # digits that have room, from so many decades
EXACT = 1e-16, 1e-12  # errors on the axis where none is above zero
ABOVE = 0.03  # of the height of a panel, free for the rings around the highest points
ROOM = 15  # entries of a legend for which a place of the grid is high enough
ENDS: Any = {"marker": "|", "markersize": 7}  # of the bars from the least to the greatest time
LIMIT: Any = {"color": FRONT, "linestyle": "--", "linewidth": 1.0}
_STYLE = {
    "font.size": 11.0,
    "axes.titlesize": 12.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#444444",
    "axes.axisbelow": True,
    "grid.color": "#E2E2E2",
    "legend.frameon": False,
    "svg.hashsalt": "ffr",
}
_METADATA = {".png": {"Software": None}, ".svg": {"Date": None}}


def look(diagrams: Sequence[Diagram]) -> dict[tuple[str, str], tuple[str, str]]:
    """Colour by series and marker by model, for every line (series, model)."""
    points = [point for diagram in diagrams for point in diagram.points]
    series = list(dict.fromkeys(point.series for point in points))
    models = list(dict.fromkeys(point.model for point in points))
    colours = {name: COLOURS[k % len(COLOURS)] for k, name in enumerate(series)}
    markers = {name: MARKERS[k % len(MARKERS)] for k, name in enumerate(models)}
    lines = dict.fromkeys((point.series, point.model) for point in points)
    return {line: (colours[line[0]], markers[line[1]]) for line in lines}


def draw_chart(
    diagrams: Diagram | Sequence[Diagram], path: str | Path, *, against: str = CPU, title: str = "", columns: int = 2
) -> Path:
    """Draw errors over a cost ("cpu", "wall" or "evaluations"): a panel for every measure of every diagram, in columns.

    Raises InputError for another kind of file, another cost, or a diagram without points.

    >>> fd.draw_chart(diagram, "chart.png", against="evaluations")
    """
    shown = [diagrams] if isinstance(diagrams, Diagram) else list(diagrams)
    path = Path(path)
    _check(shown, path, against)
    panels = [(diagram, measure.name) for diagram in shown for measure in diagram.measures]
    columns = min(len(panels), columns)
    rows = -(-len(panels) // columns)
    lines = look(shown)
    handles = _handles(shown, lines, bars=against != EVALUATIONS)
    inside = len(panels) < rows * columns and len(handles) <= ROOM
    with mpl.rc_context(_STYLE):  # type: ignore[arg-type]
        figure = Figure(figsize=(4.8 * columns + (0.4 if inside else 3.4), 0.6 + 3.9 * rows), layout="constrained")
        grid = figure.subplots(rows, columns, squeeze=False).ravel()
        for axes in grid[len(panels) :]:
            axes.set_axis_off()
        for axes, (diagram, measure) in zip(grid, panels, strict=False):
            _panel(axes, diagram, measure, against, lines)
            words = diagram.measure(measure).words
            axes.set_title(words if len(shown) == 1 else plain(f"{diagram.title}: {words}"), fontsize=11.5)
        _legend(figure, grid[-1] if inside else None, handles, sum(len(diagram.lost) for diagram in shown))
        figure.suptitle(title or plain(f"{shown[0].title}: work and precision"), fontweight="bold", x=0.01, ha="left")
        return _written(figure, path)


def _check(shown: list[Diagram], path: Path, against: str) -> None:
    if path.suffix.lower() not in _METADATA:
        raise InputError(f"{path}: diagrams are drawn as {' or '.join(_METADATA)}")
    if against not in COST_WORDS:
        raise InputError(f"cost {against!r} is not known; there are: {', '.join(COST_WORDS)}")
    for diagram in shown:
        if not diagram.points:
            reasons = "; ".join(f"{lost.label}: {lost.reason}" for lost in diagram.lost[:3])
            raise InputError(f"{diagram.title}: there is nothing to draw, no variant ran ({reasons})")


def _panel(
    axes: Axes, diagram: Diagram, measure: str, against: str, lines: dict[tuple[str, str], tuple[str, str]]
) -> None:
    scale, floor = diagram.scale(measure), diagram.reference.floors[measure]
    for (series, model), (colour, marker) in lines.items():
        line = [p for p in diagram.points if (p.series, p.model) == (series, model) and p.errors[measure] > 0]
        line = sorted((p for p in line if p.cost(against) > 0), key=lambda p: p.number, reverse=True)
        x, y = [p.cost(against) for p in line], [p.errors[measure] / scale for p in line]
        look_of_bars: Any = {"markersize": 5.5, "capsize": 2, "elinewidth": 1.0}
        axes.plot(x, y, color=colour, linewidth=1.3, alpha=0.8)
        axes.errorbar(x, y, xerr=_bars(line, against), fmt=marker, color=colour, **look_of_bars)
    _front(axes, diagram, measure, against)
    if measure in diagram.limits:
        axes.axhline(diagram.limits[measure] / scale, **LIMIT)
    axes.set_xscale("log")
    axes.set_yscale("log")
    _scale_of_errors(axes, floor / scale)
    if floor > 0:
        below: Any = {"facecolor": "#EEEEEE", "edgecolor": FLOOR, "hatch": "///", "linewidth": 0, "zorder": 0}
        axes.axhspan(axes.get_ylim()[0], floor / scale, **below)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(numticks=12))
        axis.set_minor_formatter(LogFormatterSciNotation(minor_thresholds=FEW))
    ticks_between_powers(axes)
    axes.tick_params(which="minor", labelsize="small")
    axes.grid(True, which="major")
    axes.set_xlabel(COST_WORDS[against])
    axes.set_ylabel(error_words(diagram, measure))


def ticks_between_powers(axes: Axes) -> None:
    """Along the cost ticks between powers of ten with labels that have room, where fewer than two powers have any."""
    low, high = np.log10(axes.get_xlim())
    powers = np.floor(high) - np.ceil(low) + 1
    if powers < 2 and (places := next((at for decades, at in BETWEEN if high - low > decades), None)):
        axes.xaxis.set_minor_locator(LogLocator(subs=places))
        axes.xaxis.set_minor_formatter(LogFormatterSciNotation(minor_thresholds=(np.inf, np.inf)))


def _scale_of_errors(axes: Axes, floor: float) -> None:
    low, high = axes.get_ylim()
    if not 0 < low < high:  # a logarithm has no place for zero
        axes.text(0.5, 0.5, "no error above zero", transform=axes.transAxes, ha="center")
        low, high = EXACT
    low = min(low, floor / 3) if floor > 0 else low
    axes.set_ylim(low, high * (high / low) ** ABOVE)


def error_words(diagram: Diagram, measure: str) -> str:
    """The label of an axis for the errors of a measure."""
    if diagram.reference.scales[measure]:
        return "largest error, relative"
    return f"largest value [{diagram.measure(measure).unit}]"


def _bars(line: list[Point], against: str) -> np.ndarray | None:
    """(2, K) from the median down to the least time and up to the greatest."""
    if against == EVALUATIONS:
        return None
    times = [point.cpu if against == CPU else point.wall for point in line]
    return np.array([[m - least, most - m] for m, least, most in times]).reshape(-1, 2).T


def _front(axes: Axes, diagram: Diagram, measure: str, against: str) -> None:
    """A ring around every point of the Pareto front, and a star at the chosen ones."""
    scale = diagram.scale(measure)
    front = [p for p in diagram.front(measure, against) if p.errors[measure] > 0]
    x, y = [p.cost(against) for p in front], [p.errors[measure] / scale for p in front]
    axes.plot(x, y, "o", markersize=11, fillstyle="none", color=FRONT, markeredgewidth=1.1, zorder=5)
    chosen = [p for p in diagram.points if p.label in diagram.chosen and p.errors[measure] > 0]
    axes.plot(
        [p.cost(against) for p in chosen], [p.errors[measure] / scale for p in chosen],
        "*", markersize=17, color="#F0C000", markeredgecolor=FRONT, zorder=6,
    )  # fmt: skip


def _handles(shown: list[Diagram], lines: dict[tuple[str, str], tuple[str, str]], *, bars: bool) -> list[Artist]:
    """Of the legend: colours mean methods, markers models."""
    handles: list[Artist] = []
    for series, colour in {series: colour for (series, _), (colour, _) in lines.items()}.items():
        handles.append(Line2D([], [], color=colour, linewidth=2.5, label=series))
    models = {model: marker for (_, model), (_, marker) in lines.items()}
    for model, marker in models.items() if len(models) > 1 else ():
        handles.append(Line2D([], [], color="#555555", marker=marker, markersize=6, linestyle="none", label=model))
    if bars:
        handles.append(Line2D([], [], color="#555555", label="least to greatest time", linewidth=1.0, **ENDS))
    ring: Any = {"marker": "o", "fillstyle": "none", "markersize": 10, "linestyle": "none"}
    handles.append(Line2D([], [], color=FRONT, label="Pareto front", **ring))
    if any(diagram.chosen for diagram in shown):
        handles.append(Line2D([], [], color="#F0C000", marker="*", markersize=14, linestyle="none", label="chosen"))
    if any(diagram.limits for diagram in shown):
        handles.append(Line2D([], [], label="tolerance", **LIMIT))
    if any(floor > 0 for diagram in shown for floor in diagram.reference.floors.values()):
        handles.append(Patch(facecolor="#EEEEEE", edgecolor=FLOOR, hatch="///", label="error of the reference"))
    return handles


def _legend(figure: Figure, free: Axes | None, handles: list[Artist], lost: int) -> None:
    """In a free place of the grid, or else beside it."""
    look: Any = {
        "handles": handles, "fontsize": 10, "alignment": "left",
        "title": f"{lost} variant{'s' * (lost > 1)} failed:\nsee the table" if lost else None,
        "handler_map": {handle: HandlerLine2D(numpoints=2) for handle in handles if _is_bar(handle)},
    }  # fmt: skip
    if free is None:
        figure.legend(loc="outside right center", **look)
    else:
        free.legend(loc="center", **look)


def _is_bar(handle: Artist) -> bool:
    return isinstance(handle, Line2D) and handle.get_marker() == ENDS["marker"]


def _written(figure: Figure, path: Path) -> Path:
    kind = path.suffix.lower()
    with replacing(path) as part:
        figure.savefig(part, format=kind[1:], dpi=130, metadata=_METADATA[kind])
    return path
