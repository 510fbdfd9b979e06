"""The memory of this process."""

from __future__ import annotations

import contextlib
import sys
from pathlib import Path

_STATUS = Path("/proc/self/status")
_CLEAR = Path("/proc/self/clear_refs")
_PEAK = "5"  # proc(5): writing it sets the high-water mark to the present size


def begin_peak() -> None:
    """Forget the peak so far, where the system can (Linux); elsewhere peaks are those since the start of the process."""
    with contextlib.suppress(OSError):
        _CLEAR.write_text(_PEAK)


def peak() -> int | None:
    """The most that the process had in memory since `begin_peak` [bytes]; None where it is not known (Windows)."""
    try:
        status = dict(line.split(":", 1) for line in _STATUS.read_text().splitlines())
        return 1024 * int(status["VmHWM"].split()[0])
    except (OSError, KeyError):
        return _since_the_start()


def _since_the_start() -> int | None:
    if sys.platform == "win32":
        return None
    import resource

    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit


def in_words(size: int | None) -> str:
    """A size in bytes, such as 1.25 GiB."""
    return "not known" if size is None else f"{size / 2**30:.2f} GiB"
