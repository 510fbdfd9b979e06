"""What an example shows: figures of pyplot, and the pictures of ffr, which are made without pyplot."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
from sphinx.util.logging import getLogger
from sphinx_gallery.scrapers import figure_rst, matplotlib_scraper

from ffr_dyn.pictures.histories import Drawing

LOG = getLogger(__name__)
COLOUR_BAR = "<colorbar>"


def pictures(block: Any, block_vars: dict[str, Any], gallery_conf: dict[str, Any]) -> str:
    """reST of what a block of an example has left: figures of pyplot; PNG files, or else drawings in its variables."""
    for name in unlabelled():
        LOG.warning("%s: %s of a picture has no label", block_vars["src_file"], name)
    plotted: str = matplotlib_scraper(block, block_vars, gallery_conf)
    paths = _files(block_vars) or _drawings(block_vars)
    return plotted + (figure_rst(paths, gallery_conf["src_dir"]) if paths else "")


def unlabelled() -> list[str]:
    """Axes of the figures of pyplot that say neither what is along them nor share it with a panel that does."""
    panels = [
        axes for number in plt.get_fignums() for axes in plt.figure(number).axes if axes.get_label() != COLOUR_BAR
    ]
    return [
        f"the {direction} axis"
        for axes in panels
        for direction in "xy"
        if not any(of.get_label_text() for of in _along(axes, direction))
    ]


def _along(axes: Any, direction: str) -> list[Any]:
    """The axis of a panel, and those of panels that share it."""
    sharing = getattr(axes, f"get_shared_{direction}_axes")().get_siblings(axes)
    return [getattr(of, f"{direction}axis") for of in sharing]


def _files(block_vars: dict[str, Any]) -> list[str]:
    """PNG files beside the example, moved to where pictures of the page are."""
    paths = []
    for written in sorted(Path(block_vars["src_file"]).parent.glob("*.png"), key=lambda path: path.stat().st_mtime_ns):
        path = next(block_vars["image_path_iterator"])
        shutil.move(written, path)
        paths.append(path)
    return paths


def _drawings(block_vars: dict[str, Any]) -> list[str]:
    paths = []
    drawn = {id(value): value for value in block_vars["example_globals"].values() if isinstance(value, Drawing)}
    for value in drawn.values():
        if not getattr(value, "shown_on_a_page", False):
            value.shown_on_a_page = True  # type: ignore[attr-defined]
            path = next(block_vars["image_path_iterator"])
            value.savefig(path, dpi=120)
            paths.append(path)
    return paths
