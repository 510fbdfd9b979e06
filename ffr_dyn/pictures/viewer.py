"""A page that is handed on: written to a file, or shown in a notebook."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from ffr_prep.common.outputs import replacing


@dataclass(frozen=True)
class Viewer:
    """A page that shows a film or a scene, made when it is first needed.

    `save` writes it, a notebook shows it, `text` is its HTML.

    >>> fd.animate(result).save("film.html")
    """

    make: Callable[[], str] = field(repr=False)
    title: str = ""

    @cached_property
    def text(self) -> str:
        """The page."""
        return self.make()

    def save(self, path: str | Path) -> Path:
        """Write the page, atomically."""
        path = Path(path)
        with replacing(path) as part:
            part.write_text(self.text, encoding="utf-8")
        return path

    def _repr_html_(self) -> str:
        quoted = self.text.replace("&", "&amp;").replace('"', "&quot;")
        return f'<iframe srcdoc="{quoted}" style="width: 100%; height: 640px; border: 1px solid #ccc"></iframe>'
