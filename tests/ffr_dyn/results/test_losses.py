"""Runs that are stopped from outside, and disks that are full: what was computed stays, and goes on to the same bits."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from places import ROOT

from ffr_dyn.analyses import forward
from ffr_dyn.cli import main
from ffr_dyn.compile.first_use import ensure_compiled
from ffr_dyn.integrators import ROS2
from ffr_dyn.results.file import load_result

SCENE = """
gravity = [0, -9.81, 0]
[analysis]
end = 20000.0
output_step = 0.01
step = 1e-3
[ground]
O = [0, 0, 0]
[bodies.bar]
mass = 1.0
inertia = [0.1, 0.1, 0.1]
points = {a = [0, 0, 0], b = [1, 0, 0]}
[joints.hinge]
kind = "revolute"
i = "ground.O"
j = "bar.a"
"""


@pytest.fixture
def scene(tmp_path):
    ensure_compiled(ROS2)
    path = tmp_path / "scene.toml"
    path.write_text(SCENE)
    return path


def start(scene, output, *options, limit: int | None = None) -> subprocess.Popen[str]:
    def limited():
        if limit is not None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    command = [sys.executable, "-m", "ffr_dyn.cli", "run", str(scene), "-o", str(output), *options]
    return subprocess.Popen(command, cwd=ROOT, stderr=subprocess.PIPE, text=True, preexec_fn=limited)


def assert_goes_on(scene, path, monkeypatch):
    """The rest of a stopped run, against a run that was never stopped: both in this process, which starts at once."""
    stopped = load_result(path)
    end = f"{stopped.time[-1] + 0.1:.6g}"
    whole = path.with_name("whole.nc")
    for output, options in ((path, ["--resume"]), (whole, [])):
        monkeypatch.setattr(sys, "argv", ["ffr-dyn", "run", str(scene), "-o", str(output), "--end", end, *options])
        main()
    there, here = load_result(path), load_result(whole)
    np.testing.assert_array_equal(there.time, here.time)
    for name in here.quantities:
        np.testing.assert_array_equal(there[name], here[name])


@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP", "SIGINT"])
def test_a_stopped_run_keeps_what_it_has_and_goes_on(scene, tmp_path, monkeypatch, name):
    output = tmp_path / "x.nc"
    run = start(scene, output)
    while not (tmp_path / "x.nc.part").exists() or not (tmp_path / "x.nc.part").stat().st_size:
        time.sleep(0.02)
    time.sleep(0.4)
    if name == "SIGTERM":
        run.send_signal(signal.SIGSTOP)  # until the other one has looked: all that it computes is computed again below
        second = start(scene, output)
        assert "being written by another run" in second.communicate()[1]
        assert second.returncode == 2
        run.send_signal(signal.SIGCONT)
    run.send_signal(getattr(signal, name))
    said = run.communicate()[1]
    assert run.returncode == 1
    assert said.strip() == f"ffr-dyn: interrupted by {name}; {output} holds what was computed until then"
    stopped = load_result(output)
    assert stopped.time.size > 10
    assert stopped.attributes["status"] == f"stopped: {name}"
    assert sorted(os.listdir(tmp_path)) == ["scene.toml", "x.nc"]
    if name == "SIGTERM":
        assert_goes_on(scene, output, monkeypatch)


@pytest.mark.slow
@pytest.mark.parametrize(("limit", "kept"), [(100_000, False), (1_000_000, True)])
def test_a_full_disk_ends_a_run_in_order(scene, tmp_path, monkeypatch, limit, kept):
    output = tmp_path / "x.nc"
    run = start(scene, output, limit=limit)
    said = run.communicate()[1]
    assert "File too large" in said
    assert len(said.strip().splitlines()) == 1
    assert run.returncode == (1 if kept else 2)
    assert output.exists() == kept
    assert not list(tmp_path.glob("*.part"))
    if kept:
        assert load_result(output).time.size > 10
        assert_goes_on(scene, output, monkeypatch)


def test_who_stops_what_tells_the_errors_of_a_run_is_told_of_the_run(scene, tmp_path, monkeypatch, capsys):
    """It is whole, in its file, and what goes on beside it is the search for its errors."""

    def stopped(*_: object) -> None:
        raise KeyboardInterrupt("SIGTERM")

    output = tmp_path / "x.nc"
    monkeypatch.setattr(forward, "checked", stopped)
    monkeypatch.setattr(sys, "argv", ["ffr-dyn", "run", str(scene), "-o", str(output), "--end", "0.1"])
    with pytest.raises(SystemExit, match="1"):
        main()
    kept = f"{output} holds the run, without its errors, which were being found"
    assert capsys.readouterr().err.strip().endswith(f"interrupted by SIGTERM; {kept}")
    assert load_result(output).attributes["status"] == "complete"
