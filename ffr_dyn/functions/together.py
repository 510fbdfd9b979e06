"""Calls beside one another, in threads of this process.

Compiled loops let go of Python's lock while they run, so that several runs take several processors; what Python does around
them goes on one after another. Each call works on memory of its own, and gives the same bits in any thread.
"""

from __future__ import annotations

import os
import queue
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import copy_context
from typing import Any

from ffr_prep.common.interrupts import undisturbed

Say = Callable[[float], None]  # how far a call is; to be called from time to time, since it also ends a call given up
Heard = Callable[[int, float], None]

_HERE = threading.local()  # .alone: whether this thread is one of several already


class GivenUp(BaseException):
    """Ends a call that nobody waits for any more."""


def _deaf(number: int, reached: float) -> None:
    pass


def _nothing() -> None:
    pass


def processors() -> int:
    """How many this process may use."""
    return len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1


def at_hand() -> int:
    """How many a call may use: one within a call that is one of several itself."""
    return 1 if getattr(_HERE, "alone", False) else processors()


@contextmanager
def alone() -> Iterator[None]:
    """Within it, calls are made one after another: others take the other processors."""
    before = getattr(_HERE, "alone", False)
    _HERE.alone = True
    try:
        yield
    finally:
        _HERE.alone = before


def together(
    calls: Sequence[Callable[[Say], Any]],
    threads: int | None = None,
    heard: Heard = _deaf,
    give_up: Callable[[], None] = _nothing,
) -> Iterator[tuple[int, Any]]:
    """(number of a call, what it returned or the exception that it raised), in the order in which they end.

    calls   : each is given a function to tell how far it is
    threads : at most; by default as many as are `at_hand`
    heard   : (number of a call, how far it is), called in the thread that waits here
    give_up : called where nobody waits any more, as after Ctrl-C, for calls that wait for something else

    Who waits no longer, for an exception or because it breaks off, ends the calls that have begun, by `GivenUp` with its
    text; what these note, as of files that are kept, is noted of the exception.
    """
    wanted = at_hand() if threads is None else threads
    if min(wanted, len(calls)) <= 1:
        for number, call in enumerate(calls):
            yield number, _outcome(call, lambda reached, k=number: heard(k, reached))  # type: ignore[misc]
        return
    shared = _Shared(calls)
    contexts = [copy_context() for _ in range(min(wanted, len(calls)))]  # in which a command keeps what its inputs are
    crew = [threading.Thread(target=context.run, args=(shared.work,), daemon=True) for context in contexts]
    try:
        for thread in crew:
            thread.start()
        left = len(calls)
        while left:
            number, ended, value = shared.news.get()
            if ended:
                left -= 1
                yield number, value
            else:
                heard(number, value)
        for thread in crew:
            thread.join()
    except BaseException as error:
        with undisturbed():  # a thread that ends with the process would keep the locks that it has
            shared.why = "given up" if isinstance(error, GeneratorExit) else str(error) or type(error).__name__
            give_up()
            for thread in crew:
                if thread.ident is not None:
                    thread.join()
            for note in shared.notes:
                error.add_note(note)
        raise


class _Shared:
    """The state that the threads of a batch share: calls that are left, what they tell, and whether it is given up."""

    def __init__(self, calls: Sequence[Callable[[Say], Any]]) -> None:
        self.calls = calls
        self.left: queue.SimpleQueue[int] = queue.SimpleQueue()
        self.news: queue.SimpleQueue[tuple[int, bool, Any]] = queue.SimpleQueue()
        self.why = ""  # it is given up
        self.notes: list[str] = []
        for number in range(len(calls)):
            self.left.put(number)

    def work(self) -> None:
        """Do what is left, call by call."""
        with alone():
            while not self.why:
                try:
                    number = self.left.get_nowait()
                except queue.Empty:
                    return
                try:
                    found = _outcome(self.calls[number], self._say(number))
                except GivenUp as end:
                    self.notes += getattr(end, "__notes__", [])
                    return
                except BaseException as error:  # nobody else would hear of it
                    found = error
                self.news.put((number, True, found))

    def _say(self, number: int) -> Say:
        def say(reached: float) -> None:
            if self.why:
                raise GivenUp(self.why)
            self.news.put((number, False, reached))

        return say


def _outcome(call: Callable[[Say], Any], say: Say) -> Any:
    try:
        return call(say)
    except Exception as error:
        return error
