"""Links of a page that leave docs/: in the repository they lead to its files, on the site to the page that shows the file."""

from __future__ import annotations

import re
from typing import Any

from sphinx.application import Sphinx

PAGES = {"CONTRIBUTING.md": "about/contributing.md", "CHANGELOG.md": "about/changelog.md"}
OUTWARD = re.compile(r"\]\((?:\.\./)+([A-Z]+\.md)(#[\w-]+)?\)")


def inward(app: Sphinx, docname: str, source: list[str]) -> None:
    """Let links to the files of `PAGES` lead to their pages."""
    up = "../" * docname.count("/")

    def page(found: re.Match[str]) -> str:
        target = PAGES.get(found[1])
        return f"]({up}{target}{found[2] or ''})" if target else found[0]

    source[0] = OUTWARD.sub(page, source[0])


def setup(app: Sphinx) -> dict[str, Any]:
    """Rewrite links as pages are read."""
    app.connect("source-read", inward)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
