"""What the machine has left, and what is said where that is too little."""

import numpy as np
import pytest
import scipy.sparse as sp

from ffr_prep.common import process_memory
from ffr_prep.common.errors import InputError
from ffr_prep.solvers.cholesky import cholesky


def machine(monkeypatch, tmp_path, **files):
    """A machine, and a container in it, whose files say this."""
    for name, text in files.items():
        (tmp_path / name.replace("_", ".")).write_text(text)
    monkeypatch.setattr(process_memory, "_MACHINE", tmp_path / "meminfo")
    monkeypatch.setattr(process_memory, "_CONTAINER", tmp_path)


def test_what_is_left_is_the_least_of_machine_and_container(monkeypatch, tmp_path):
    machine(monkeypatch, tmp_path)
    assert process_memory.left() is None
    machine(monkeypatch, tmp_path, meminfo="MemTotal: 900 kB\nMemAvailable:   500 kB\n")
    assert process_memory.left() == 500 * 1024
    machine(monkeypatch, tmp_path, memory_max="max", memory_current="70000", memory_stat="inactive_file 1000\n")
    assert process_memory.left() == 500 * 1024
    machine(monkeypatch, tmp_path, memory_max="100000")
    assert process_memory.left() == 31000


def test_what_was_freed_in_small_pieces_goes_back_or_stays():
    """Thousands of pieces below the size that the C library asks the system for, and one above them that stays."""
    if not process_memory._STATUS.exists():
        pytest.skip("the system does not tell the memory of a process")
    pieces = [np.ones(1000) for _ in range(20_000)]
    last = np.ones(1000)
    process_memory.begin_peak()
    with_them = process_memory.peak()
    pieces.clear()
    process_memory.give_back()
    process_memory.begin_peak()
    assert last.size
    assert process_memory.peak() <= with_them


def test_without_a_c_library_that_can_nothing_is_given_back(monkeypatch):
    monkeypatch.setattr("ctypes.CDLL", lambda name: object())
    process_memory.give_back()


def test_a_factor_that_the_machine_cannot_hold_is_refused(monkeypatch, tmp_path):
    machine(monkeypatch, tmp_path, meminfo="MemAvailable: 1 kB\n")
    with pytest.raises(
        InputError, match=r"factorising the stiffness of 30 unknowns takes .* GiB of memory and the machine"
    ):
        cholesky(sp.csr_array(np.eye(30) + 0.01), np.arange(90.0).reshape(30, 3))
