"""Pictures of the quality of a reduction: receptances of the full and the reduced model, and all errors at a glance."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ffr_prep.body import FlexibleBody
from ffr_prep.common.errors import InputError
from ffr_prep.common.outputs import made_folder
from ffr_prep.reduction.quality import ACCELERATIONS, Quality, quality_of
from ffr_prep.report.mode_pictures import save_figure

_DPI = 150
_FULL, _REDUCED, _ERROR, _INK = "#9aa0a8", "#2455A4", "#C0392B", "#222222"
_FLOOR = 1e-8
_KNOWN = 1e-5  # of the receptances, which are kept with six digits


def quality_pictures(body: FlexibleBody, folder: str | Path) -> list[Path]:
    """Draw "receptances.png" (where there are interfaces) and "errors.png" into a folder; returns the files.

    Raises InputError for a body whose quality was not assessed.

    >>> fp.quality_pictures(body, "quality")
    """
    quality = quality_of(body.provenance)
    if quality is None:
        raise InputError(f"body {body.name!r} was not compared with its full model; make it again with --quality")
    folder = made_folder("the folder of pictures", folder)
    figures = {"errors.png": _errors(body, quality)}
    if quality.points:
        figures = {"receptances.png": _receptances(body, quality)} | figures
    for name, figure in figures.items():
        save_figure(figure, folder / name)
    return [folder / name for name in figures]


# ---- receptances --------------------------------------------------------------------------------------------------


def _receptances(body: FlexibleBody, quality: Quality) -> Figure:
    """One panel for each driving point with its error below; rows are interfaces."""
    rows = len(quality.points) // 2
    figure = Figure(figsize=(12.0, 0.8 + 3.6 * rows), dpi=_DPI)
    top = 1 - 0.65 / figure.get_figheight()
    grid = figure.add_gridspec(
        2 * rows, 2, height_ratios=[2.4, 1] * rows, left=0.075, right=0.985, bottom=0.55 / figure.get_figheight(),
        top=top, hspace=0.16, wspace=0.16,
    )  # fmt: skip
    for k, point in enumerate(quality.points):
        above = figure.add_subplot(grid[2 * (k // 2), k % 2])
        _draw_receptance(above, quality, k, point)
        _draw_error(
            figure.add_subplot(grid[2 * (k // 2) + 1, k % 2], sharex=above), quality, k, last=k // 2 == rows - 1
        )
    figure.axes[0].legend(frameon=False, fontsize=9, loc="lower left")
    _title(figure, f"{body.name}: elastic receptance at the interfaces of the free body, loss factor 2 %")
    return figure


def _draw_receptance(axes: Any, quality: Quality, k: int, point: str) -> None:
    axes.loglog(quality.frequencies, quality.full[:, k], color=_FULL, lw=4, label="full model", solid_capstyle="round")
    axes.loglog(quality.frequencies, quality.reduced[:, k], color=_REDUCED, lw=1.4, label="reduced body")
    axes.set_ylabel("rad/(N m)" if point.endswith("rotation") else "m/N", fontsize=9)
    axes.set_title(point, fontsize=10, loc="left", pad=3, color=_INK)
    axes.tick_params(labelbottom=False, labelsize=8)
    _plain(axes)


def _draw_error(axes: Any, quality: Quality, k: int, last: bool) -> None:
    error = np.abs(quality.reduced[:, k] / quality.full[:, k] - 1)
    axes.loglog(quality.frequencies, np.maximum(error, _KNOWN), color=_ERROR, lw=1.2)
    axes.set_ylim(_KNOWN / 2, max(1.0, 2 * error.max()))
    axes.set_xlim(*quality.band)
    axes.set_ylabel("error", fontsize=9)
    axes.tick_params(labelsize=8, labelbottom=last)
    if last:
        axes.set_xlabel("frequency [Hz]", fontsize=9)
    _plain(axes)


# ---- errors -------------------------------------------------------------------------------------------------------


def _errors(body: FlexibleBody, quality: Quality) -> Figure:
    """Frequencies on the left, steady deformation on the right."""
    figure = Figure(figsize=(12.0, 4.8), dpi=_DPI)
    grid = figure.add_gridspec(1, 2, width_ratios=[1, 1], left=0.075, right=0.985, bottom=0.125, top=0.86, wspace=0.62)
    _draw_frequencies(figure.add_subplot(grid[0, 0]), quality)
    _draw_steady(figure.add_subplot(grid[0, 1]), quality)
    _title(figure, f"{body.name}: errors of the reduced body against the full model")
    return figure


def _draw_frequencies(axes: Any, quality: Quality) -> None:
    count = quality.frequency_errors.size
    shown = np.maximum(np.abs(quality.frequency_errors), _FLOOR)
    axes.axvspan(*quality.band, color="#eef1f6", lw=0)
    axes.loglog(quality.mode_frequencies[:count], shown, "o", color=_REDUCED, ms=5)
    if count == 0:
        axes.text(0.5, 0.5, "no frequency below twice the band", transform=axes.transAxes, ha="center", fontsize=10)
    axes.set_ylim(bottom=_FLOOR / 2)
    axes.set_xlabel("frequency of the full model [Hz], band shaded", fontsize=9)
    axes.set_ylabel("relative error of the frequency", fontsize=9)
    axes.set_title("frequencies under the reference conditions", fontsize=10, loc="left", color=_INK)
    axes.tick_params(labelsize=8)
    _plain(axes)


def _draw_steady(axes: Any, quality: Quality) -> None:
    rows = np.arange(len(ACCELERATIONS))[::-1]
    for errors, colour, name, shift in (
        (quality.displacement_errors, _REDUCED, "displacement", 0.19),
        (quality.stress_errors, _ERROR, "stress", -0.19),
    ):
        axes.barh(rows + shift, np.maximum(np.nan_to_num(errors, nan=_FLOOR), _FLOOR), 0.36, color=colour, label=name)
    axes.set_xscale("log")
    axes.set_xlim(_FLOOR, 1.5)
    axes.set_yticks(rows, ACCELERATIONS, fontsize=8)
    axes.set_xlabel("relative error", fontsize=9)
    axes.set_title("steady deformation", fontsize=10, loc="left", color=_INK)
    axes.legend(frameon=False, fontsize=9, ncols=2, loc="lower right", bbox_to_anchor=(1.02, 1.0))
    axes.tick_params(labelsize=8)
    _plain(axes)


def _plain(axes: Any) -> None:
    axes.grid(True, color="#e3e5e9", lw=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)


def _title(figure: Figure, text: str) -> None:
    figure.text(0.015, 1 - 0.28 / figure.get_figheight(), text, fontsize=12, color=_INK, va="center")
