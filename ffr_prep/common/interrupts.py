"""Signals that end a process in order: Ctrl-C, SIGTERM and SIGHUP raise at the next safe place, files are closed on the way.

Handlers belong to the main thread; elsewhere nothing changes.
"""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

_ENDING = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))


_asked: list[int] = []  # signals that have raised within `ending_in_order`


class Interrupted(KeyboardInterrupt):
    """A signal has asked this process to end; the text is its name."""


@contextmanager
def ending_in_order() -> Iterator[None]:
    """Every signal that asks the process to end raises `Interrupted` within the block; what fails after it fails by it."""

    def end(number: int, frame: FrameType | None) -> None:
        _asked.append(number)
        raise Interrupted(signal.Signals(number).name)

    try:
        with _handled(end):
            yield
    except Exception as error:
        if _asked:
            raise _struck(error) from None
        raise
    finally:
        _asked.clear()


def _struck(error: BaseException | None) -> Interrupted:
    """The interruption on the way to an error; where it is not known, one more."""
    while error is not None and not isinstance(error, Interrupted):
        error = error.__cause__ or error.__context__
    return error or Interrupted(signal.Signals(_asked[0]).name)


@contextmanager
def undisturbed() -> Iterator[None]:
    """Signals that ask the process to end wait until the block has ended: for steps that must be done whole.

    Where it stands on the way of one that ends the process already, that is enough.
    """
    waiting: list[int] = []
    ends = isinstance(sys.exc_info()[1], KeyboardInterrupt)
    try:
        with _handled(lambda number, frame: waiting.append(number)):
            yield
    finally:
        for number in [*([] if ends else waiting), *_lost()][:1]:
            signal.raise_signal(number)


def _lost() -> list[int]:
    """Signals whose `Interrupted` is not on its way: Python drops what is raised in destructors and weak references."""
    if threading.current_thread() is not threading.main_thread():
        return []
    error = sys.exception()
    while error is not None and not isinstance(error, Interrupted):
        error = error.__context__
    return _asked if error is None else []


def ignore_further() -> None:
    """From now on ignore signals that would end a process which is ending already."""
    if threading.current_thread() is threading.main_thread():
        for number in _ENDING:
            signal.signal(number, signal.SIG_IGN)


@contextmanager
def _handled(handler: Callable[[int, FrameType | None], Any]) -> Iterator[None]:
    """Signals that the process does not ignore (as under nohup) go to a handler."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.getsignal(number) for number in _ENDING}
    before = {number: known for number, known in before.items() if known not in (signal.SIG_IGN, None)}
    try:
        for number in before:
            signal.signal(number, handler)
        yield
    finally:
        for number, known in before.items():
            signal.signal(number, known)
