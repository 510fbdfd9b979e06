"""Campbell diagrams as pictures."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ffr_dyn.pictures.histories import PALETTE, drawing
from ffr_dyn.results.result import Result

LEAST = 0.1  # % of damping that the picture shows, so that it does not enlarge rounding


def draw_campbell(result: Result, path: str | Path) -> Path:
    """Draw a Campbell diagram, as `campbell` returns it, and the damping over the speed: .png, .svg or .pdf.

    Whirls are drawn with their frequencies from the ground, backward ones dashed; what does not whirl in its turning axes.
    Lines from the origin are orders, circles on them critical speeds.

        fd.draw_campbell(fd.campbell(scene, speeds=range(0, 500, 25)), "campbell.png")

    Raises InputError for another kind of file.

    >>> fd.draw_campbell(result, "campbell.png")
    """
    a, speed = result.attributes, result["speed"]
    whirling = np.array(a["whirling"], bool)
    shown = np.where(whirling, np.abs(result["seen"]), result["frequencies"])
    with drawing(path, (10.0, 8.0)) as figure:
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
        for m, name in enumerate(a["names"]):
            backward = whirling[m] and result["seen"][len(speed) // 2, m] < 0
            color = PALETTE[m % len(PALETTE)]
            upper.plot(speed, shown[:, m], "--" if backward else "-", color=color, label=name)
            lower.plot(speed, 100 * result["damping_ratios"][:, m], color=color)
        for order in sorted({one["order"] for one in a["critical"]}):
            upper.plot(speed, order * speed / (2 * np.pi), ":", color="#888888", linewidth=1.0)
        for one in a["critical"]:
            upper.plot(one["speed"], one["order"] * one["speed"] / (2 * np.pi), "o", color="#000000", markersize=5)
        for one in a["limits"]:
            lower.axvline(one["speed"], color="#D55E00", linewidth=1.0)
        upper.set_ylim(0, 1.05 * float(shown.max(initial=1e-12)))
        upper.set_ylabel("frequency [Hz]")
        low, high = lower.get_ylim()
        lower.set_ylim(min(low, -LEAST), max(high, LEAST))
        lower.set_ylabel("damping [%]")
        lower.set_xlabel("speed [rad/s]")
        upper.legend(loc="upper left", bbox_to_anchor=(1.0, 1.02))
    return Path(path)
