"""Compiled loops of several threads: they let go of Python's lock, and share nothing that they change."""

from __future__ import annotations

import _ctypes
import threading

import numpy as np
from synthetic import cloud

import ffr_dyn as fd
from ffr_dyn.compile.engine import fill_rows, new_engine
from ffr_dyn.compile.workspace import new_record
from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.kernels.entry_points import run, run_controlled
from ffr_dyn.kernels.tables import OK

PYTHONS_OWN = 4  # FUNCFLAG_PYTHONAPI of ctypes: a call that keeps Python's lock


def test_calls_of_entry_points_let_go_of_pythons_lock():
    assert _ctypes.FUNCFLAG_PYTHONAPI == PYTHONS_OWN
    assert not any(type(one.general.c_function)._flags_ & PYTHONS_OWN for one in (run, run_controlled))


def test_engines_of_one_system_change_nothing_that_is_shared():
    """Engines of the same tables in threads, each as if the others were not; the tables stay as they are."""
    body = fd.Body("rod", cloud(4, seed=1), omega_bar=(0.0, 0.0, 6.0), damping=0.02)
    hinge = fd.Joint("hinge", "revolute", "ground.O", "rod.a", axis=(0, 0, 1))
    made = assemble(fd.Scene((body,), (hinge,), ground={"O": (0, 0, 0)}, gravity=(0.0, -9.81, 0.0)))

    def engine(method):
        return new_engine(made.system, made.x, made.v, method, (0.0, 0.0, 1e-9))

    def filled(one, into):
        assert fill_rows(one, into, 0.0, 40) == OK
        return into

    methods = [fd.ROS2(1e-3), fd.ROS3(5e-4), fd.RK4(1e-4), fd.ROS2(1e-3)]
    alone = [filled(engine(method), new_record(made.system, 20)) for method in methods]
    engines, records = [engine(method) for method in methods], [new_record(made.system, 20) for _ in methods]
    before = [np.copy(part) for part in made.system.model.bodies if isinstance(part, np.ndarray)]
    crew = [threading.Thread(target=filled, args=pair) for pair in zip(engines, records, strict=True)]
    for thread in crew:
        thread.start()
    for thread in crew:
        thread.join()
    for one, other in zip(records, alone, strict=True):
        assert all(a.tobytes() == b.tobytes() for a, b in zip(one, other, strict=True))
    after = [part for part in made.system.model.bodies if isinstance(part, np.ndarray)]
    assert all(np.array_equal(a, b) for a, b in zip(before, after, strict=True))
