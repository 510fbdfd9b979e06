"""Time spent in a part of a program: on the clock, and by the processor for the thread that runs it."""

from __future__ import annotations

import time
from dataclasses import dataclass


@dataclass
class Stopwatch:
    """Runs inside `with stopwatch:`, as often as one likes.

    wall, cpu : sums [s];  last : wall time of the last part
    """

    wall: float = 0.0
    cpu: float = 0.0
    last: float = 0.0
    _began: tuple[float, float] = (0.0, 0.0)

    def __enter__(self) -> Stopwatch:
        self._began = time.perf_counter(), time.thread_time()
        return self

    def __exit__(self, *_: object) -> None:
        self.last = time.perf_counter() - self._began[0]
        self.wall += self.last
        self.cpu += time.thread_time() - self._began[1]
