"""Global heaps of HDF5 files: damage in which the library would step for ever is an error."""

import h5py
import numpy as np
import pytest

from ffr_prep.common.errors import InputError
from ffr_prep.common.hdf5 import check_heaps


@pytest.fixture
def sound(tmp_path):
    """A file with two heaps: some 3000 bytes of texts."""
    path = tmp_path / "texts.h5"
    with h5py.File(path, "w") as file:
        for k in range(60):
            file.attrs[f"text {k}"] = "word " * (10 + k % 3)
    return path


def heaps_of(content: bytes) -> list[int]:
    found = [content.find(b"GCOL")]
    while found[-1] >= 0:
        found.append(content.find(b"GCOL", found[-1] + 4))
    return found[:-1]


def test_sound_files_pass(sound):
    check_heaps(sound)
    assert heaps_of(sound.read_bytes())


@pytest.mark.parametrize("size", [0, 1, 15, 1 << 40, (1 << 64) - 1])
def test_a_step_that_does_not_lead_on_is_an_error(sound, size):
    content = bytearray(sound.read_bytes())
    for heap in heaps_of(content):
        damaged = bytearray(content)
        damaged[heap + 16 : heap + 18] = bytes(2)  # the first object, said to be free space
        damaged[heap + 24 : heap + 32] = size.to_bytes(8, "little")
        sound.write_bytes(damaged)
        with pytest.raises(InputError, match="damaged at byte"):
            check_heaps(sound)


def test_a_heap_beyond_the_end_is_an_error(sound):
    content = bytearray(sound.read_bytes())
    at = heaps_of(content)[-1]
    sound.write_bytes(content[: at + 100])
    with pytest.raises(InputError, match="damaged at byte"):
        check_heaps(sound)


def test_chance_bytes_are_no_heap(tmp_path):
    path = tmp_path / "chance.h5"
    path.write_bytes(b"GCOL" + np.arange(200, dtype=np.uint8).tobytes())
    check_heaps(path)
    path.write_bytes(b"")
    check_heaps(path)
