"""How long a geometry may be meshed."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from ffr_prep.common.errors import InputError

USUAL = 3600.0  # s

_LIMIT: ContextVar[float] = ContextVar("time limit of the mesher [s]", default=USUAL)


@contextmanager
def mesher_time_limit(seconds: float) -> Iterator[None]:
    """Geometry that is read within the block is meshed in so many seconds, or ComputationError tells that it takes longer."""
    if not 0.0 < seconds <= 1e7:
        raise InputError(f"a time limit of {seconds:g} s cannot be used; give seconds, such as 600")
    token = _LIMIT.set(seconds)
    try:
        yield
    finally:
        _LIMIT.reset(token)


def limit() -> float:
    """The limit that holds now [s]."""
    return _LIMIT.get()
