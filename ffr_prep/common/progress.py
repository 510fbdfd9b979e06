"""How far a long computation is: what callers may listen to, and what stands there when nobody does."""

from __future__ import annotations

from collections.abc import Callable

# Called with the name of each stage as it begins.
Stages = Callable[[str], None]
# Called within a stage with the share that is done, 0 to 1, and with that in words, such as "3 of 20 modes".
Advance = Callable[[float, str], None]


def no_stages(stage: str) -> None:
    """Nobody listens to stages."""


def no_advance(share: float, words: str) -> None:
    """Nobody listens to how far a stage is."""


def no_count(done: int, of: int) -> None:
    """Nobody listens to how much is done."""
