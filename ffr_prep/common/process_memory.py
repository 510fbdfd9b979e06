"""The memory of this process, and what the machine has left."""

from __future__ import annotations

import contextlib
import ctypes
import sys
from pathlib import Path

from ffr_prep.common.errors import InputError

_MACHINE = Path("/proc/meminfo")
_CONTAINER = Path("/sys/fs/cgroup")
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
    """Memory that this process can still take without swapping [bytes]; None where that is not known (not Linux)."""
    sizes = []
    with contextlib.suppress(OSError, KeyError, ValueError):
        lines = dict(line.split(":", 1) for line in _MACHINE.read_text().splitlines())
        sizes.append(1024 * int(lines["MemAvailable"].split()[0]))
    with contextlib.suppress(OSError, KeyError, ValueError):  # of a container; "max" is no limit
        most, used = (int((_CONTAINER / f"memory.{name}").read_text()) for name in ("max", "current"))
        of_use = dict(line.split() for line in (_CONTAINER / "memory.stat").read_text().splitlines())
        sizes.append(most - used + int(of_use["inactive_file"]))
    return min(sizes, default=None)


def give_back() -> None:
    """Return freed small blocks of memory to the system, where the C library can (glibc): large arrays never use them."""
    with contextlib.suppress(OSError, AttributeError, TypeError):
        ctypes.CDLL(None).malloc_trim(0)


def check_memory(size: float, what: str, remedy: str) -> None:
    """InputError where the machine has not the size [bytes] left that a computation is going to take."""
    give_back()
    there = left()
    if there is not None and size > there:
        raise InputError(
            f"{what} takes {in_words(int(size))} of memory and the machine has {in_words(there)} left: {remedy}"
        )


def in_words(size: int | None) -> str:
    """A size in bytes, such as 1.25 GiB."""
    return "not known" if size is None else f"{size / 2**30:.2f} GiB"
