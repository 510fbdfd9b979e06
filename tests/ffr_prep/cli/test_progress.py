"""The progress bar shows simulated time on a terminal and nothing elsewhere."""

import io
import itertools

import pytest

from ffr_dyn.cli.progress_bar import progress


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.fixture
def seconds(monkeypatch):
    """A clock that advances one second at each look, so that nothing depends on the speed of the machine."""
    ticks = itertools.count()
    monkeypatch.setattr("tqdm.std.time", lambda: float(next(ticks)))


@pytest.mark.usefixtures("seconds")
def test_a_terminal_shows_time_percentage_and_remaining_time():
    terminal = Terminal()
    with progress("spin-up", 2.0, start=1.0, stream=terminal) as update:
        update(1.5)
        shown = terminal.getvalue()
        update(2.5)
    assert "spin-up:  75 %" in shown
    assert "t = 1.5 of 2 s" in shown
    assert shown.rstrip().endswith("left")
    assert "100 %" in terminal.getvalue()


def test_a_pipe_stays_quiet():
    pipe = io.StringIO()
    with progress("spin-up", 2.0, stream=pipe) as update:
        update(1.0)
    assert pipe.getvalue() == ""


def test_without_a_stream_standard_error_is_used(capsys):
    with progress("spin-up", 2.0) as update:
        update(1.0)
    assert capsys.readouterr() == ("", "")
