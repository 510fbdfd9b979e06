"""Calls beside one another: all end, each with its own outcome, and none goes on that nobody waits for."""

from __future__ import annotations

import os
import signal
import threading
import time
from contextvars import ContextVar

import pytest

from ffr_dyn.functions.together import alone, together


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_every_call_has_its_outcome(threads):
    def call(k):
        if k % 3 == 0:
            raise ValueError(k)
        return k * k

    calls = [lambda say, k=k: call(k) for k in range(20)]
    found = dict(together(calls, threads))
    assert len(found) == 20
    for k, outcome in found.items():
        assert str(outcome) == str(k) if k % 3 == 0 else outcome == k * k


def test_calls_go_on_at_the_same_time():
    """Each waits for the other, which one after another would never do."""
    both = threading.Barrier(2, timeout=20)
    assert sorted(k for k, arrived in together([lambda say: both.wait() >= 0] * 2, 2) if arrived is True) == [0, 1]


def test_news_come_to_the_thread_that_waits():
    here, heard = threading.get_ident(), list[tuple[int, float, bool]]()
    calls = [lambda say, k=k: say(k / 10) for k in range(4)]
    list(together(calls, 2, lambda k, t: heard.append((k, t, threading.get_ident() == here))))
    assert sorted(heard) == [(k, k / 10, True) for k in range(4)]


def test_who_waits_no_longer_ends_the_calls():
    ended, told = list[int](), list[str]()

    def endless(say, k):
        try:
            while True:
                say(0.0)
        except BaseException as end:
            ended.append(k)
            end.add_note(f"{k} ended: {end}")
            raise

    def impatient(number, reached):
        raise KeyboardInterrupt("asked to")

    calls = [lambda say, k=k: endless(say, k) for k in range(5)]
    with pytest.raises(KeyboardInterrupt) as caught:
        list(together(calls, 2, impatient, lambda: told.append("over")))
    assert sorted(ended) == [0, 1]
    assert sorted(caught.value.__notes__) == ["0 ended: asked to", "1 ended: asked to"]
    assert told == ["over"]


def test_who_is_interrupted_again_leaves_no_thread_behind():
    """A second signal comes while the call that was given up still does what it cannot leave."""
    ended = list[int]()

    def slow(say, k):
        for _ in range(10):
            time.sleep(0.02)
        ended.append(k)
        say(0.0)

    def twice(number, reached):
        raise KeyboardInterrupt

    def again(number, frame):
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGINT, again)
    timer = threading.Timer(0.05, os.kill, (os.getpid(), signal.SIGINT))
    try:
        timer.start()
        with pytest.raises(KeyboardInterrupt):
            list(together([lambda say: say(0.0), lambda say: slow(say, 1)], 2, twice))
        assert ended == [1]
    finally:
        timer.join()
        signal.signal(signal.SIGINT, before)


def test_calls_within_a_call_are_made_one_after_another():
    def threads_of(say):
        return {one for _, one in together([lambda say: threading.get_ident()] * 3)} == {threading.get_ident()}

    assert [found for _, found in together([threads_of] * 4, 2)] == [True] * 4
    with alone():
        assert threads_of(None)


def test_what_a_command_keeps_is_known_in_its_threads():
    kept = ContextVar("kept", default=0)
    kept.set(7)
    assert [found for _, found in together([lambda say: kept.get()] * 3, 2)] == [7] * 3


def test_what_ends_a_thread_is_heard_of():
    def leaves(say):
        raise SystemExit(3)

    found = dict(together([leaves] * 2, 2))
    assert [type(found[k]) for k in (0, 1)] == [SystemExit] * 2
