"""The memory of this process, and what the machine has left."""

from __future__ import annotations

import contextlib
import sys
from pathlib import Path

_MACHINE = Path("/proc/meminfo")
_LIMITS = (  # of a container: most and used [bytes]
    (Path("/sys/fs/cgroup/memory.max"), Path("/sys/fs/cgroup/memory.current")),
    (Path("/sys/fs/cgroup/memory/memory.limit_in_bytes"), Path("/sys/fs/cgroup/memory/memory.usage_in_bytes")),
)
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


def left() -> int | None:
    """What this process can still take without swapping [bytes]; None where that is not known (not Linux)."""
    sizes = []
    with contextlib.suppress(OSError, KeyError, ValueError):
        lines = dict(line.split(":", 1) for line in _MACHINE.read_text().splitlines())
        sizes.append(1024 * int(lines["MemAvailable"].split()[0]))
        for most, used in _LIMITS:
            with contextlib.suppress(OSError, ValueError):  # "max": no limit
                sizes.append(int(most.read_text()) - int(used.read_text()))
    return min(sizes, default=None)


def in_words(size: int | None) -> str:
    """A size in bytes, such as 1.25 GiB."""
    return "not known" if size is None else f"{size / 2**30:.2f} GiB"
