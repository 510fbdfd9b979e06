"""Campbell diagrams as pictures."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from ffr_dyn.pictures.histories import PALETTE, drawing
from ffr_dyn.results.result import Result
from ffr_prep.common.arrays import Array

LEAST = 0.1  # % of damping that the picture shows, so that it does not enlarge rounding
APART = 0.032  # of the height: names of vibrations
GREY, RED = "#666666", "#D55E00"
SMALL = 9.0  # points of letters


def draw_campbell(result: Result, path: str | Path) -> Path:
    """Draw a Campbell diagram, as `campbell` returns it, and the damping over the speed: .png, .svg or .pdf.

    Every line has the name of its vibration at its end. Whirls are drawn with their frequencies from the ground, backward
    ones dashed; what does not whirl in its turning axes. Lines from the origin are orders (1x, 2x), circles on them critical
    speeds, with their numbers [rad/s]. Where a vibration begins to grow, and where it ends to, a line goes down to the
    damping.

        fd.draw_campbell(fd.campbell(scene, speeds=range(0, 500, 25)), "campbell.png")

    Raises InputError for another kind of file.

    >>> fd.draw_campbell(result, "campbell.png")
    """
    a, speed = result.attributes, result["speed"]
    whirling = np.array(a["whirling"], bool)
    shown = np.where(whirling, np.abs(result["seen"]), result["frequencies"])
    backward = whirling & (result["seen"][len(speed) // 2] < 0)
    top = 1.08 * float(shown.max(initial=1e-12))
    with drawing(path, (11.0, 8.0)) as figure:
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
        upper.set(ylim=(0, top), xlim=(speed[0], speed[-1]), ylabel="frequency [Hz]")
        for m in range(len(a["names"])):
            how: dict[str, Any] = {"color": PALETTE[m % len(PALETTE)], "linestyle": "--" if backward[m] else "-"}
            upper.plot(speed, shown[:, m], **how)
            lower.plot(speed, 100 * result["damping_ratios"][:, m], **how)
        _name_lines(upper, a["names"], shown[-1])
        _draw_orders(upper, a["orders"], float(speed[-1]), top)
        for one in a["critical"]:
            _mark(upper, one["speed"], one["order"] * one["speed"] / (2 * np.pi), one["mode"].endswith("backward"))
        for one in a["limits"]:
            ends = [one[key] for key in ("speed", "until") if key in one]
            for axes, at in product((upper, lower), ends):
                axes.axvline(at, color=RED, linewidth=1.0)
            lower.annotate(f" unstable from {' to '.join(f'{at:.4g}' for at in ends)}", (one["speed"], 0.9),
                           xycoords=("data", "axes fraction"), color=RED, fontsize=SMALL,
                           bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 1})  # fmt: skip
        low, high = lower.get_ylim()
        lower.set(ylim=(min(low, -LEAST), max(high, LEAST)), ylabel="damping [%]", xlabel="speed [rad/s]")
        upper.secondary_xaxis("top", functions=(_to_rpm, _from_rpm)).set_xlabel("speed [rpm]")
    return Path(path)


def _to_rpm(speed: Array) -> Array:
    return speed * 30 / np.pi


def _from_rpm(speed: Array) -> Array:
    return speed * np.pi / 30


def _mark(axes: Axes, speed: float, frequency: float, backward: bool) -> None:
    """With its number, of backward whirls on the other side of the line than of forward ones, which may be near."""
    axes.plot(speed, frequency, "o", color="#000000", markersize=5)
    at, side = ((-5, 5), "right") if backward else ((5, -11), "left")
    axes.annotate(f"{speed:.4g}", (speed, frequency), at, textcoords="offset points", ha=side, fontsize=SMALL - 1)


def _draw_orders(axes: Axes, orders: Sequence[float], last: float, top: float) -> None:
    """Lines through the origin, each with its number where it leaves the picture."""
    for order in orders:
        end = min(last, 2 * np.pi * top / order) if order > 0 else last
        axes.plot((0, end), (0, order * end / (2 * np.pi)), ":", color=GREY, linewidth=1.2)
        axes.annotate(f"{order:g}x", (0.97 * end, order * 0.97 * end / (2 * np.pi)), (-4, 5), textcoords="offset points",
                      color=GREY, fontsize=SMALL, ha="right")  # fmt: skip


def _name_lines(axes: Axes, names: Sequence[str], ends: Array) -> None:
    """Names beside the ends of lines, from below, none on another."""
    height, last = float(axes.get_ylim()[1]), -np.inf
    for m in np.argsort(ends, kind="stable"):
        last = max(last + APART, float(ends[m]) / height)
        axes.annotate(
            names[m], (1.0, float(ends[m]) / height), (1.03, last), xycoords="axes fraction", color=PALETTE[m % len(PALETTE)],
            fontsize=SMALL, va="center", arrowprops={"arrowstyle": "-", "color": PALETTE[m % len(PALETTE)], "linewidth": 0.6},
        )  # fmt: skip
