"""HDF5 files where the library fails: one kind of damage would never let it return, and a full disk would crash it."""

from __future__ import annotations

import mmap
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from ffr_prep.common.errors import InputError

HOW: dict[str, Any] = {"libver": ("v108", "v108"), "locking": False}  # working files have locks of their own

_HEAP = b"GCOL\x01\0\0\0"  # signature, version, reserved
_HEADER = 16  # bytes, of a heap and of an object in it


@contextmanager
def new_file(path: Path) -> Iterator[Any]:
    """An HDF5 file to write, which keeps the order of its variables: made in memory, on the disk when the block has ended.
    Raises OSError where it is not."""
    import h5py

    with h5py.File(path, "w", driver="core", backing_store=False, track_order=True, **HOW) as file:
        yield file
        file.flush()
        content = file.id.get_file_image()
    path.write_bytes(content)


def abandon(file: Any) -> None:
    """Close a file that cannot be written any more: HDF5 would not let go of it, and crash at the end of the process."""
    if file and hasattr(os, "memfd_create"):
        nowhere = os.memfd_create("lost")
        os.dup2(nowhere, file.id.get_vfd_handle())
        os.close(nowhere)
    with suppress(OSError, RuntimeError, ValueError):
        file.close()


def why(error: BaseException) -> str:
    """The reason that the system gives for a failure, without the HDF5 library's account of its own state."""
    number = getattr(error, "errno", None)
    return os.strerror(number) if number else str(error)


def check_heaps(path: str | Path) -> None:
    """Look through the global heaps of an HDF5 file, which hold texts and references and have no checksums.

    The library steps from object to object by their sizes, and stays for ever at one whose size says zero (HDF5 File Format
    Specification 3.0, III.E). Raises InputError where a step would not lead on, or out of the heap.
    """
    if not Path(path).stat().st_size:
        return
    with open(path, "rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
        at = content.find(_HEAP)
        while at >= 0:
            at = content.find(_HEAP, _end_of_heap(content, at, path))


def _end_of_heap(content: mmap.mmap, at: int, path: str | Path) -> int:
    end = at + _number(content, at + 8, 8)
    if not at + _HEADER <= end <= len(content):
        raise _damaged(path, at)
    at += _HEADER
    while at + _HEADER <= end:
        size = _number(content, at + 8, 8)
        step = _HEADER + (size + 7) // 8 * 8 if _number(content, at, 2) else size  # free space counts its header
        if not _HEADER <= step <= end - at:
            raise _damaged(path, at)
        at += step
    return end


def _number(content: mmap.mmap, at: int, size: int) -> int:
    return int.from_bytes(content[at : at + size], "little")


def _damaged(path: str | Path, at: int) -> InputError:
    return InputError(f"{path} is damaged at byte {at}, in a heap of texts; take it from a copy, or make it again")
