"""Links of a page that leave docs/: in the repository they lead to its files, on the site to pages that show these."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pygments import highlight
from pygments.formatters import HtmlFormatter
from pygments.lexers import PythonLexer
from sphinx.application import Sphinx
from sphinx.util.logging import getLogger

LOG = getLogger(__name__)
ROOT = Path(__file__).resolve().parents[2]
PAGES = {"CONTRIBUTING.md": "about/contributing.md", "CHANGELOG.md": "about/changelog.md"}
TEXTS = re.compile(r"\]\((?:\.\./)+([A-Z]+\.md)(#[\w-]+)?\)")
EXAMPLES = re.compile(r"\]\((?:\.\./)+examples/gallery/(\w+)(?:/(plot_\w+)\.py)?\)")
PROGRAMS = re.compile(r"\[`([^`]+)`\]\((?:\.\./)+([\w/]+\.py)\)")


def inward(app: Sphinx, docname: str, source: list[str]) -> None:
    """Let links to texts and examples lead to their pages, and links to programs to the line that they name."""
    up = "../" * docname.count("/")

    def text(found: re.Match[str]) -> str:
        target = PAGES.get(found[1])
        return f"]({up}{target}{found[2] or ''})" if target else found[0]

    def program(found: re.Match[str]) -> str:
        name, path = found.groups()
        anchor = anchor_of(name, path)
        shown.add(f"{path}#{anchor}")
        return f'<a href="{up}source/{path.removesuffix(".py")}.html#{anchor}"><code>{name}</code></a>'

    def example(found: re.Match[str]) -> str:
        return f"]({up}gallery/{found[1]}/{found[2] or 'index'}.rst)"

    shown: set[str] = set()
    source[0] = PROGRAMS.sub(program, EXAMPLES.sub(example, TEXTS.sub(text, source[0])))
    if shown:
        app.env.metadata[docname]["programs"] = " ".join(sorted(shown))


def anchor_of(name: str, path: str) -> str:
    """A dotted name within its file: "ffr_dyn.equations.motion.solve" is "solve" there."""
    module = path.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
    return name.removeprefix(f"{module}.")


def sources(app: Sphinx) -> Iterator[tuple[str, dict[str, Any], str]]:
    """A page for each program to which a link leads, with an anchor at every class and function."""
    links = {link for of in app.env.metadata.values() for link in of.get("programs", "").split()}
    for path in sorted({link.partition("#")[0] for link in links}):
        text = (ROOT / path).read_text(encoding="utf-8")
        shown = highlight(
            text, PythonLexer(), HtmlFormatter(linenos="inline", nowrap=False, cssclass="highlight source")
        )
        definitions = _definitions(text)
        for line, name in definitions:
            shown = _anchored(shown, line, name)
        there = {f"{path}#{name}" for _, name in definitions}
        for missing in sorted(link for link in links - there if link.startswith(f"{path}#")):
            LOG.warning("a page links to %s, which is not there", missing)
        yield f"source/{path.removesuffix('.py')}", {"title": path, "body": f"<h1>{path}</h1>{shown}"}, "page.html"


def _definitions(text: str) -> list[tuple[int, str]]:
    """(line, name) of classes, functions and methods."""
    found = []
    kinds = (ast.ClassDef, ast.FunctionDef)
    for node in ast.parse(text).body:
        if isinstance(node, kinds):
            found.append((node.lineno, node.name))
            found += [(inner.lineno, f"{node.name}.{inner.name}") for inner in node.body if isinstance(inner, kinds)]
    return found


def _anchored(shown: str, line: int, name: str) -> str:
    return re.sub(rf'(<span class="linenos">\s*{line}</span>)', rf'<span id="{name}">\1</span>', shown, count=1)


def setup(app: Sphinx) -> dict[str, Any]:
    """Rewrite links as pages are read; add the pages of programs at the end."""
    app.connect("source-read", inward)
    app.connect("html-collect-pages", sources)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
