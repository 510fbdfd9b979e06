"""All runs of a search and the one it chose, on a chart of error over cost with the Pareto front."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from ffr_dyn.economy.found import Economy

Array = np.ndarray


def points(found: Economy) -> tuple[Array, Array]:
    """(K,) costs in runs of the chosen model, and (K,) largest errors in tolerances, of all runs of the search."""
    costs = np.array([one.cost / found.cost for one in found.runs])
    errors = np.array([float((one.error / found.limits).max(initial=0.0)) for one in found.runs])
    known = np.isfinite(errors) & (errors > 0)
    return costs[known], errors[known]


def front(costs: Array, errors: Array) -> Array:
    """Numbers of the points that no other one beats in both, by rising cost."""
    best, found = np.inf, []
    for k in np.lexsort((errors, costs)):
        if errors[k] < best:
            found.append(int(k))
            best = errors[k]
    return np.array(found, int)


def draw(found: Economy, path: str | Path) -> Path:
    """Write the chart as .png or .svg."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    _figure(found).savefig(path, dpi=130, metadata={"Software": None} if path.suffix == ".png" else None)
    return path


def as_png(found: Economy) -> bytes:
    """The chart as the content of a .png file."""
    stream = io.BytesIO()
    _figure(found).savefig(stream, format="png", dpi=110, metadata={"Software": None})
    return stream.getvalue()


def _figure(found: Economy):  # type: ignore[no-untyped-def]
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.2, 4.6), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    costs, errors = points(found)
    axes.loglog(costs, errors, "o", color="#888888", label="runs of the search")
    order = front(costs, errors)
    axes.step(costs[order], errors[order], where="post", color="#0072b2", label="Pareto front")
    chosen = (found.error if found.verification is None else found.verification.error) / found.limits
    axes.plot([1.0], [max(float(chosen.max()), 1e-12)], "*", markersize=16, color="#d55e00", label="chosen", zorder=3)
    axes.axhline(1.0, color="#333333", linestyle="--", linewidth=1)
    axes.annotate("tolerance", (1.0, 1.0), xycoords=("axes fraction", "data"), ha="right", va="bottom")
    axes.set_xlabel("cost of a run, in runs of the chosen model")
    axes.set_ylabel("largest error, in tolerances")
    axes.set_title(f"{found.original.name}: runs of the search", fontweight="bold")
    axes.grid(True, which="major", alpha=0.4)
    axes.legend()
    return figure
