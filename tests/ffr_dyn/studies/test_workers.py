"""Workers of a study: what dies is replaced, what is broken off ends, and what was loaded here is known there."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from places import ROOT

from ffr_dyn.chart.runner import Failure, pool
from ffr_dyn.studies.workers import crew
from ffr_prep.common.errors import InputError
from ffr_prep.common.registry import load_plugin


def alive(process: int) -> bool:
    """Whether a process of that number goes on."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def dask_workers(count: int):
    pytest.importorskip("dask.distributed")
    return pool(count)


def test_tasks_are_done_by_other_processes():
    with crew(2) as workers:
        assert sorted(workers.results(abs, [-1, -2, 3])) == [(0, 1), (1, 2), (2, 3)]
        here = {number for _, number in workers.results(divmod, [5, 7])}
        assert all(isinstance(one, Failure) and "TypeError" in one.reason for one in here)
        assert os.getpid() not in {found for _, found in workers.results(eval, ["__import__('os').getpid()"] * 3)}


@pytest.mark.slow
def test_a_worker_that_died_is_replaced():
    with crew(1) as workers:
        number = next(workers.results(eval, ["__import__('os').getpid()"]))[1]
        os.kill(number, signal.SIGKILL)
        assert list(workers.results(abs, [-4])) == [(0, 4)]
        ((_, failed),) = workers.results(os._exit, [1])
        assert failed == Failure("its worker died 3 times: out of memory, or killed from outside")
        assert list(workers.results(abs, [-5])) == [(0, 5)]


@pytest.mark.slow
def test_what_nobody_waits_for_ends():
    def stop(number, frame):
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGALRM, stop)
    try:
        with crew(2) as workers:
            numbers = [found for _, found in workers.results(eval, ["__import__('os').getpid()"] * 4)]
            signal.setitimer(signal.ITIMER_REAL, 0.5)
            with pytest.raises(KeyboardInterrupt):
                list(workers.results(time.sleep, [1000.0] * 3))
            assert not any(alive(number) for number in numbers)
    finally:
        signal.signal(signal.SIGALRM, before)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="looks at /proc")
def test_workers_end_with_the_study_that_is_killed(tmp_path):
    code = (
        "import time\nfrom ffr_dyn.studies.workers import crew\n"
        "with crew(1) as workers:\n"
        "    print(next(workers.results(eval, ['__import__(\"os\").getpid()']))[1], flush=True)\n"
        "    list(workers.results(time.sleep, [1000.0]))\n"
    )
    command = subprocess.Popen([sys.executable, "-c", code], cwd=ROOT, stdout=subprocess.PIPE, text=True)
    worker = int(command.stdout.readline())
    command.kill()
    command.communicate()
    for _ in range(200):
        if not alive(worker):
            break
        time.sleep(0.05)
    assert not alive(worker)


@pytest.mark.parametrize("workers_of", [crew, pytest.param(dask_workers, marks=pytest.mark.slow)])
def test_workers_load_the_plugins(tmp_path, workers_of):
    plugin = tmp_path / "own.py"
    plugin.write_text("import builtins\nbuiltins.own_number = 42\n")
    load_plugin(plugin)
    try:
        with workers_of(1) as workers:
            assert list(workers.results(eval, ["own_number"])) == [(0, 42)]
    finally:
        import builtins

        del builtins.own_number


def test_a_plugin_that_is_gone_is_named(tmp_path):
    plugin = tmp_path / "own.py"
    plugin.write_text("")
    load_plugin(plugin)
    plugin.unlink()
    with crew(1) as workers, pytest.raises(InputError, match=r"a worker .* cannot load .*own\.py: give a file"):
        list(workers.results(abs, [-1]))
