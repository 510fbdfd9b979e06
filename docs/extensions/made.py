"""Pages that are made from the code before the others are read: docs/made."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import commands
import doors
import entries
from sphinx.application import Sphinx

import ffr_dyn
import ffr_dyn.cli
import ffr_prep
import ffr_prep.cli


def pages() -> Iterator[tuple[str, str]]:
    """Name and text of each."""
    for kind in entries.kinds():
        yield "entries" if kind.word == "scene" else f"{kind.word}_file", entries.page(kind)
    yield "ffr_prep_command", commands.page("ffr-prep", ffr_prep.cli.cli)
    yield "ffr_dyn_command", commands.page("ffr-dyn", ffr_dyn.cli.cli)
    yield "ffr_prep", doors.page(ffr_prep, "fp")
    yield "ffr_dyn", doors.page(ffr_dyn, "fd")


def write(app: Sphinx) -> None:
    """Write those that have changed."""
    folder = Path(app.srcdir) / "made"
    folder.mkdir(exist_ok=True)
    for name, text in pages():
        path = folder / f"{name}.md"
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")


def setup(app: Sphinx) -> dict[str, Any]:
    """Make the pages when the builder starts."""
    app.connect("builder-inited", write)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
