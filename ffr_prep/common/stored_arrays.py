"""Files of arrays (.npz) read with care: what they announce is held against what they have before memory is taken."""

from __future__ import annotations

import math
import zipfile
from typing import IO, Any

import numpy as np

from ffr_prep.common.arrays import Array


def read_arrays(stream: IO[bytes]) -> dict[str, Array]:
    """The arrays of a .npz file by name: numbers, truth values and text. ValueError for others and for sizes that lie.

    The size that a header announces is held against that of the member, and this against the file, before memory is taken.
    """
    with zipfile.ZipFile(stream) as archive:
        members = [member for member in archive.infolist() if member.filename.endswith(".npy")]
        packed = sum(member.compress_size for member in members)
        stream.seek(0, 2)
        if packed > stream.tell() or len({member.filename for member in members}) < len(members):
            raise ValueError("its table of contents is damaged")
        return {member.filename.removesuffix(".npy"): _array(archive, member) for member in members}


def _array(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> Array:
    name = member.filename
    stream: Any
    with archive.open(member) as stream:
        version = np.lib.format.read_magic(stream)
        read = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}[version]
        shape, order, dtype = read(stream)
        if dtype.kind not in "fiubSU":
            raise ValueError(f"{name} holds {dtype}, no numbers")
        size = math.prod(shape) * dtype.itemsize
        if any(k < 0 for k in shape) or size > member.file_size or size > _most(member):
            raise ValueError(f"{name} announces {size} bytes and has fewer")
        content, filled = bytearray(size), 0
        while filled < size and (more := stream.readinto(memoryview(content)[filled:])):
            filled += more
        if filled < size or stream.read(1):  # at the end the checksum is looked at
            raise ValueError(f"{name} does not have the {size} bytes that it announces")
    array = np.frombuffer(content, dtype).reshape(shape, order="F" if order else "C")
    return array.astype(np.float64) if array.dtype == np.float16 else array


def _most(member: zipfile.ZipInfo) -> int:
    """The largest size that the packed bytes can unpack to: deflate packs no better than 1032 to 1."""
    return 1032 * member.compress_size + 1024
