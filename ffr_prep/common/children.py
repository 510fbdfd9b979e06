"""A command in a process that ends with the one that started it, however that ends.

Run as  python children.py PARENT COMMAND ...: on Linux the kernel is told to end this process with its parent, and then the
command takes its place. Elsewhere the command runs on. This file is run by its path and needs nothing but Python.

Source: prctl(2), PR_SET_PDEATHSIG.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Sequence

_PR_SET_PDEATHSIG = 1


def ending_with_us(command: Sequence[str]) -> list[str]:
    """The command line that runs a command and ends it with this process."""
    if sys.platform != "linux":
        return list(command)
    return [sys.executable, "-I", "-S", __file__, str(os.getpid()), *command]


def finished(command: Sequence[str], seconds: float) -> subprocess.CompletedProcess[str]:
    """A command, what it has written, and its code. Raises subprocess.TimeoutExpired after so many seconds.

    Where it is given up, by time or by an interrupt, what it has started ends with it.
    """
    child = subprocess.Popen(
        ending_with_us(command),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        errors="replace",
        start_new_session=True,
    )
    try:
        said, errors = child.communicate(timeout=seconds)
    except BaseException:
        _end_all(child)
        raise
    return subprocess.CompletedProcess(command, child.returncode, said, errors)


def _end_all(child: subprocess.Popen[str]) -> None:
    """End a process with all that it has started, which may hold its pipes."""
    if sys.platform == "win32":
        child.kill()
    else:
        os.killpg(child.pid, signal.SIGKILL)
    child.communicate()


def main() -> None:
    """Become the command."""
    import ctypes

    parent, command = int(sys.argv[1]), sys.argv[2:]
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
    if os.getppid() != parent:  # it has ended in the meantime
        sys.exit(1)
    os.execvp(command[0], command)


if __name__ == "__main__":
    main()
