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


def test_a_factor_that_the_machine_cannot_hold_is_refused(monkeypatch, tmp_path):
    machine(monkeypatch, tmp_path, meminfo="MemAvailable: 1 kB\n")
    with pytest.raises(
        InputError, match=r"factorising the stiffness of 30 unknowns takes .* GiB of memory and the machine"
    ):
        cholesky(sp.csr_array(np.eye(30) + 0.01), np.arange(90.0).reshape(30, 3))
