"""Files that are written: whole or not at all, one writer at a time, and never over what must stay.

A file is made beside its place, as ``<name>.part``, and renamed when it is complete. The working file is locked while it is
written (flock, which ends with its process), so a second run to the same place is refused before it touches anything.
Refused are also places that hold an input of the same command (the same file under any name), a symbolic link (neither it
nor its target is replaced), a folder, or a device. Windows has no such lock.
"""

from __future__ import annotations

import errno
import os
import stat
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path

from ffr_prep.common.errors import ComputationError, InputError

PART = ".part"
NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_LOCKS = sys.platform != "win32"
_OPENED = os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)

Identity = tuple[int, int]  # of a file, whatever its name: device and number
_INPUTS: ContextVar[dict[Identity, Path] | None] = ContextVar("inputs of the command", default=None)


class InUseError(InputError):
    """A place that another run writes to."""


@dataclass
class _Hold:
    """A locked working file: of a command that will write it (reserved), or of a writer."""

    lock: int
    writing: bool


_HELD: dict[Path, _Hold] = {}


# ---- inputs ---------------------------------------------------------------------------------------------------------


@contextmanager
def command_inputs() -> Iterator[None]:
    """The files that are noted within are inputs of one command, which no output of it may replace."""
    token = _INPUTS.set({})
    try:
        yield
    finally:
        _INPUTS.reset(token)


def note_input(path: str | Path) -> None:
    """A file is read by the command; outside of a command nothing is noted."""
    noted = _INPUTS.get()
    if noted is not None:
        with suppress(OSError, ValueError):
            noted[_identity(os.stat(path))] = Path(path)


def _identity(status: os.stat_result) -> Identity:
    return status.st_dev, status.st_ino


# ---- where an output may go -----------------------------------------------------------------------------------------


def check_output(path: Path) -> None:
    """InputError for a place where nothing may be written; OSError for one that cannot be looked at."""
    try:
        found = os.lstat(path)
    except FileNotFoundError:
        return
    if stat.S_ISLNK(found.st_mode):
        raise InputError(f"{path} is a symbolic link, to {os.readlink(path)}: name the file itself, or remove the link")
    if stat.S_ISDIR(found.st_mode):
        raise InputError(f"{path} is a folder; name the file to write in it")
    if not stat.S_ISREG(found.st_mode):
        raise InputError(f"{path} is no ordinary file but a device, a pipe or a socket; choose another place")
    noted = _INPUTS.get() or {}
    if _identity(found) in noted:
        raise InputError(
            f"{path} is an input of this command ({noted[_identity(found)]}), which would be lost: choose another output"
        )


def check_folder(what: str, path: Path) -> None:
    """InputError where a folder for several files is asked for and a file stands there, or above it."""
    there = next((at for at in (path, *path.parents) if at.exists()), path)
    if there.exists() and not there.is_dir():
        raise InputError(f"{what} {path}: {there} is a file; name a folder")


def made_folder(what: str, path: str | Path) -> Path:
    """The folder, made if it is not there. InputError as `check_folder`."""
    path = Path(path)
    check_folder(what, path)
    path.mkdir(parents=True, exist_ok=True)
    return path


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """Yields the working file to write; at the end of the block it replaces `path`, which until then stays as it was.

    Raises InputError for a place where nothing may be written and for one that another run writes to, OSError where the
    folder cannot be written to, ComputationError where writing fails, such as on a full disk.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    with writing(path) as part:
        try:
            yield part
            _to_disk(part)
            check_output(path)
            os.replace(part, path)
        except OSError as error:
            part.unlink(missing_ok=True)
            raise ComputationError(not_written(path, error)) from error
        except BaseException:
            part.unlink(missing_ok=True)
            raise


def not_written(path: Path, error: OSError) -> str:
    """The message of a failed writing."""
    why = error.strerror or str(error)
    return f"writing {path} failed ({why}); what was there before is as it was: check the free space of the disk"


def _to_disk(path: Path) -> None:
    with open(path, "rb") as stream:
        os.fsync(stream.fileno())


# ---- one writer at a time -------------------------------------------------------------------------------------------


@contextmanager
def reserved(path: Path) -> Iterator[None]:
    """Nobody else writes to this place until the block ends, in which it may be written: for commands with long work.

    Errors as in `replacing`.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    with _held(path, writing=False) as hold:
        try:
            yield
        finally:
            if hold is not None and _is_at(hold.lock, part_of(path)):
                part_of(path).unlink()


@contextmanager
def writing(path: Path) -> Iterator[Path]:
    """Yields the working file, empty and locked; it is left as the block leaves it. Errors as in `replacing`."""
    with _held(path, writing=True) as hold:
        if hold is not None:
            os.ftruncate(hold.lock, 0)
        yield part_of(path)


def part_of(path: Path) -> Path:
    """The working file."""
    return path.with_name(path.name + PART)


@contextmanager
def _held(path: Path, *, writing: bool) -> Iterator[_Hold | None]:
    check_output(path)
    if not _LOCKS:
        yield None
        return
    key = part_of(path.resolve())
    before = _HELD.get(key)
    if before is not None and (before.writing or not writing):
        raise InUseError(_in_use(path))
    lock = before.lock if before is not None and _is_at(before.lock, key) else _locked(path, key)
    hold = _HELD[key] = _Hold(lock, writing)
    try:
        yield hold
    finally:
        if before is not None:
            _HELD[key] = before
        else:
            del _HELD[key]
        if before is None or lock != before.lock:
            os.close(lock)


def _locked(path: Path, part: Path) -> int:
    """The working file, open and locked; again where its last writer has just renamed it."""
    import fcntl

    while True:
        check_output(part)
        lock = os.open(part, _OPENED, 0o666)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(lock)
            raise InUseError(_in_use(path)) from None
        except OSError:  # a file system without locks
            return lock
        if _is_at(lock, part):
            return lock
        os.close(lock)


def _is_at(opened: int, path: Path) -> bool:
    try:
        return _identity(os.fstat(opened)) == _identity(os.lstat(path))
    except FileNotFoundError:
        return False


def no_room(error: BaseException) -> bool:
    """Whether an error came of a disk that is full, or of a limit to what may be written."""
    cause: BaseException | None = error
    while cause is not None and not (isinstance(cause, OSError) and cause.errno in NO_ROOM):
        cause = cause.__cause__ or cause.__context__
    return cause is not None


def _in_use(path: Path) -> str:
    return f"{path} is being written by another run; choose another place or end the other run"
