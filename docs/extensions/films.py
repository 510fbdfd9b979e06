"""What an example shows: figures of pyplot, and the pictures of ffr, which are made without pyplot."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

from sphinx_gallery.scrapers import figure_rst, matplotlib_scraper

from ffr_dyn.pictures.histories import Drawing


def pictures(block: Any, block_vars: dict[str, Any], gallery_conf: dict[str, Any]) -> str:
    """reST of what a block of an example has left: figures of pyplot; PNG files, or else drawings in its variables."""
    plotted: str = matplotlib_scraper(block, block_vars, gallery_conf)
    paths = _files(block_vars) or _drawings(block_vars)
    return plotted + (figure_rst(paths, gallery_conf["src_dir"]) if paths else "")


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
