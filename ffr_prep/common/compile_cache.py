"""Compiled functions that numba keeps on disk, with a checksum: what a crash or a full disk has damaged is compiled anew.

numba takes a damaged file for what it says, and fails with whatever comes of it, down to the compiler's abort.
"""

from __future__ import annotations

import hashlib
import pickle
from pathlib import Path
from typing import Any

_SIZE = 16  # bytes of a checksum, which stands behind the end of a pickle, where readers of pickles do not look


def _sum(data: bytes) -> bytes:
    return hashlib.blake2b(data, digest_size=_SIZE).digest()


def is_sound(path: Path) -> bool:
    """Whether a file of the cache, an index (.nbi) or compiled code (.nbc), is as it was written."""
    try:
        with open(path, "rb") as stream:
            if path.suffix == ".nbi":
                pickle.load(stream)  # the version of numba, before what is summed
            data = stream.read()
    except Exception:  # a damaged pickle can fail in any way
        return False
    return data[-_SIZE:] == _sum(data[:-_SIZE])


def check_compiled_code() -> None:
    """Have numba check what it reads, from here on in this process; damaged files count as missing."""
    try:
        from numba.core import caching as inner
    except ImportError:  # a numba with other inner parts
        return

    caching: Any = inner  # which has no types

    class CheckedFiles(caching.IndexDataCacheFile):  # type: ignore[misc]
        def _dump(self, content: Any) -> bytes:
            data = super()._dump(content)
            return data + _sum(data)

        def _load_index(self) -> dict[Any, str]:
            return super()._load_index() if is_sound(Path(self._index_path)) else {}

        def _load_data(self, name: str) -> Any:
            if not is_sound(Path(self._data_path(name))):
                raise FileNotFoundError(name)
            return super()._load_data(name)

    if caching.IndexDataCacheFile.__name__ != CheckedFiles.__name__:
        caching.IndexDataCacheFile = CheckedFiles
