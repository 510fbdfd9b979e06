"""How far a long run has come: simulated time, percentage and remaining time, on a terminal or in a notebook; silent in a
pipe."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TextIO

from tqdm import tqdm

_FORMAT = "{desc}: {percentage:3.0f} % |{bar}| t = {n:.4g} of {total:.4g} s, {remaining} left"


@contextmanager
def progress(
    label: str, end: float, *, start: float = 0.0, stream: TextIO | None = None
) -> Iterator[Callable[[float], None]]:
    """Yields ``update(t)``, to be called with the simulated time t, as often as one likes.

    start, end : first and last time [s];  label : in front of the bar

    Written to stream (standard error by default), a few times a second, and only when that is a terminal or the cell of a
    notebook.

    >>> with fd.progress("swing", 2.0) as told: fd.forward(scene, end=2.0, output_step=0.01, progress=told)
    """
    with tqdm(desc=label, total=end, initial=start, file=stream, disable=_unseen(), bar_format=_FORMAT) as bar:
        yield lambda t: _advance(bar, t)


def _unseen() -> bool | None:
    """No in a notebook, whose cells are no terminals and show the bar; else tqdm finds out (None)."""
    shell = sys.modules.get("IPython")
    return False if shell is not None and hasattr(shell.get_ipython(), "kernel") else None


def _advance(bar: tqdm, t: float) -> None:
    bar.update(min(t, bar.total) - bar.n)


@contextmanager
def counted(label: str, *, stream: TextIO | None = None) -> Iterator[Callable[[int, int], None]]:
    """Yields ``update(done, total)`` for work that is counted; the bar appears with the first call, on a terminal only."""
    with tqdm(desc=label, total=0, file=stream, disable=_unseen(), leave=False) as bar:

        def update(done: int, total: int) -> None:
            bar.total = total
            bar.update(done - bar.n)
            bar.refresh()

        yield update
