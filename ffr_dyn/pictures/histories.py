"""Pictures of results, by matplotlib: time histories in stacked panels, and paths of markers, as PNG, SVG or PDF.

The figures are made without pyplot: no global state, no window, the same bytes for the same result.
"""

from __future__ import annotations

import io
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from ffr_dyn.results.result import Quantity, Result
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.common.outputs import check_output, replacing
from ffr_prep.common.units import bracketed, readable

# Okabe & Ito 2008, "Color universal design", without the yellow, which is too pale for a line on white.
PALETTE = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
_LINE_STYLES = ("-", "--", ":", "-.")

_STYLE: Any = {
    "font.size": 11.0,
    "axes.titlesize": 13.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#444444",
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#DDDDDD",
    "grid.linewidth": 0.8,
    "lines.linewidth": 1.6,
    "legend.frameon": False,
    "legend.fontsize": 10.0,
    "svg.hashsalt": "ffr",
}
_METADATA: Mapping[str, dict[str, Any]] = {
    ".png": {"Software": None},
    ".svg": {"Date": None},
    ".pdf": {"CreationDate": None},
}


class Drawing(Figure):
    """A figure of matplotlib that a notebook shows without pyplot."""

    def _repr_png_(self) -> bytes:
        content = io.BytesIO()
        with mpl.rc_context(_STYLE):
            self.savefig(content, format="png", dpi=80)
        return content.getvalue()


def plot(
    result: Result,
    names: str | Iterable[str],
    path: str | Path | None = None,
    *,
    title: str | None = None,
    against: str = "time",
) -> Drawing:
    """Draw the histories of quantities or components, stacked in one panel for each unit, over a common axis.

    names   : quantities ("rod.R": all components) or components ("rod.R.x")
    path    : .png, .svg or .pdf, where the figure is to be written
    against : "time", or the component to draw over, such as "crank_bearing.angle"
    Raises InputError for unknown names, no names, no rows, or another kind of file.

    >>> fd.plot(result, ["rod.tip.position", "hinge.force"], "pendulum.png")
    """
    components = list(result.components([names] if isinstance(names, str) else names))
    if not components or result.time.size == 0:
        raise InputError(f"nothing to plot: {len(components)} quantities at {result.time.size} times")
    panels: dict[str, list[str]] = {}
    for name in components:
        panels.setdefault(result.quantity(name).unit, []).append(name)
    with mpl.rc_context(_STYLE):
        figure = Drawing(figsize=(10.0, 1.3 + 2.5 * len(panels)), layout="constrained")
        column = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
        for axes, group in zip(column, panels.values(), strict=True):
            _draw_panel(axes, result, group, against)
        label, abscissa = _abscissa(result, against)
        column[-1].set_xlabel(label)
        if against == "time" and abscissa[0] < abscissa[-1]:
            column[-1].set_xlim(abscissa[0], abscissa[-1])
        figure.align_ylabels(column)
        figure.suptitle(title or "", fontweight="bold")
        return _written(figure, path)


def plot_path(
    result: Result, marker: str, path: str | Path | None = None, *, plane: str = "xy", title: str | None = None
) -> Drawing:
    """Draw the path of a marker ("rod.small_eye") in a plane of the global frame ("xy", "zx", ...), coloured by time.

    path : .png, .svg or .pdf, where the figure is to be written

    Raises InputError for an unknown marker, a plane that is not two different letters of xyz, no rows, or another kind
    of file.

    >>> fd.plot_path(result, "rod.tip", "path.png", plane="xy")
    """
    if len(plane) != 2 or len(set(plane)) != 2 or not set(plane) <= set("xyz"):
        raise InputError(f"plane {plane!r} is not two different letters of x, y, z")
    position = result.quantity(f"{marker}.position")
    if result.time.size == 0:
        raise InputError(f"nothing to plot: {marker!r} at 0 times")
    points = position.values[:, ["xyz".index(letter) for letter in plane]]
    factor, unit = readable(position.unit, float(np.ptp(points, axis=0).max()) or float(np.abs(points).max()))
    with mpl.rc_context(_STYLE):
        figure = Drawing(figsize=(8.0, 6.5), layout="constrained")
        axes = figure.subplots()
        _draw_path(figure, axes, points * factor, result.time)
        axes.set_xlabel(bracketed(plane[0], unit))
        axes.set_ylabel(bracketed(plane[1], unit))
        axes.set_title(title or f"path of {marker}", fontweight="bold")
        return _written(figure, path)


def _draw_panel(axes: Axes, result: Result, names: list[str], against: str) -> None:
    quantities = [result.quantity(name) for name in names]
    factor, unit = readable(quantities[0].unit, _largest(quantities))
    _, abscissa = _abscissa(result, against)
    marker = "o" if result.time.size == 1 else ""
    for k, (name, quantity) in enumerate(zip(names, quantities, strict=True)):
        style = _LINE_STYLES[k // len(PALETTE) % len(_LINE_STYLES)]
        color = PALETTE[k % len(PALETTE)]
        axes.plot(abscissa, quantity.values * factor, style, color=color, marker=marker, label=name)
    axes.set_ylabel(bracketed(_common_word(result, names), unit))
    axes.margins(x=0.02, y=0.08)
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.03), ncols=1 + (len(names) - 1) // 9)


def _draw_path(figure: Figure, axes: Axes, points: Array, time: Array) -> None:
    factor, unit = readable("s", float(time[-1]))
    line = LineCollection(
        list(np.stack([points[:-1], points[1:]], axis=1)), cmap="viridis", capstyle="round", linewidth=2.0
    )
    line.set_array(0.5 * (time[:-1] + time[1:]) * factor)
    axes.add_collection(line)
    axes.plot(*points[0], "o", color="#D55E00", markersize=9, label="start", zorder=3)
    axes.plot(*points[-1], "s", color="#000000", markersize=7, label="end", zorder=3)
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.06)
    axes.legend(loc="upper left", bbox_to_anchor=(0.0, -0.09), ncols=2)
    if time.size > 1:
        figure.colorbar(line, ax=axes, label=bracketed("time", unit), shrink=0.85)


def _abscissa(result: Result, against: str) -> tuple[str, Array]:
    quantity = Quantity(result.time, "s") if against == "time" else result.quantity(against)
    if quantity.axes:
        raise InputError(f"plots against one component, not {against!r} with {list(result.components([against]))}")
    factor, unit = readable(quantity.unit, _largest([quantity]))
    return bracketed(against, unit), quantity.values * factor


def _largest(quantities: Iterable[Quantity]) -> float:
    values = np.concatenate([np.abs(quantity.values) for quantity in quantities])
    return float(values[np.isfinite(values)].max(initial=0.0))


def _common_word(result: Result, names: list[str]) -> str:
    """The word that all names have in common: the same quantity ("position") or the same owner ("energy"), or nothing."""
    parts = [_owner(result, name).split(".") for name in names]
    for position in (-1, 0):
        words = {part[position] for part in parts}
        if len(words) == 1:
            return words.pop().replace("_", " ")
    return ""


def _owner(result: Result, component: str) -> str:
    return component if component in result.quantities else _owner(result, component.rpartition(".")[0])


def plain(text: str) -> str:
    """A name as it is written: "$" begins no formula of matplotlib."""
    return text.replace("$", r"\$")


@contextmanager
def drawing(path: str | Path, size: tuple[float, float]) -> Iterator[Figure]:
    """A figure of this size [inches] in the style of all pictures, written to `path` (.png, .svg or .pdf) at the end."""
    with mpl.rc_context(_STYLE):
        figure = Figure(figsize=size, layout="constrained")
        yield figure
        _write(figure, path)


def _written(figure: Drawing, path: str | Path | None) -> Drawing:
    if path is not None:
        _write(figure, path)
    return figure


def check_picture(path: str | Path) -> None:
    """Before the work, not after it: InputError for a place or a format in which no picture can be written."""
    kind = Path(path).suffix.lower()
    if kind not in _METADATA:
        raise InputError(f"{path}: pictures are written as {', '.join(_METADATA)}, not {kind or 'without a suffix'}")
    check_output(Path(path))


def _write(figure: Figure, path: str | Path) -> None:
    path = Path(path)
    check_picture(path)
    kind = path.suffix.lower()
    with replacing(path) as part:
        figure.savefig(part, format=kind[1:], dpi=130, metadata=_METADATA[kind])
