"""Pages load nothing from elsewhere: the build fails if one asks for a script, a style or a picture at an address."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx
from sphinx.errors import SphinxError

LOADED = re.compile(
    r"""<(?:script|img|iframe|source|video)\b[^>]*\bsrc=["'](?:https?:)?//|<link\b[^>]*rel=["']stylesheet["'][^>]*href=["']https?:"""
)


def check(app: Sphinx, exception: Exception | None) -> None:
    """Raise SphinxError that names the pages which load something."""
    if exception is not None or app.builder.format != "html":
        return
    pages = [path for path in Path(app.outdir).rglob("*.html") if LOADED.search(path.read_text(encoding="utf-8"))]
    if pages:
        raise SphinxError(f"these pages load something from the network: {', '.join(path.name for path in pages)}")


def setup(app: Sphinx) -> dict[str, Any]:
    """Look at the pages when they are written."""
    app.connect("build-finished", check)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
