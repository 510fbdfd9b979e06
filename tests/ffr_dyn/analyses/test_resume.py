"""A run that was stopped, killed or cut goes on as if it had never stopped: to the bit."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from places import ROOT, TESTS
from synthetic import cloud

from ffr_dyn.analyses.checkpoint import Checkpoint, decode, encode
from ffr_dyn.analyses.events import Event
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.compile.first_use import ensure_compiled
from ffr_dyn.functions.time_functions import harmonic
from ffr_dyn.integrators import RK4, ROS2
from ffr_dyn.integrators.stabilisation import Baumgarte
from ffr_dyn.results.file import load_checkpoint, load_result, save_result
from ffr_dyn.results.power import Worked
from ffr_dyn.results.quantities import Unwound, measure, selected
from ffr_dyn.results.recorded_motion import View
from ffr_dyn.scene.forces import Load, SpringDamper
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.common.errors import ComputationError, InputError

GROUND = {"O": (0, 0, 0), "P": (0, 2, 0)}
SCENE = Scene(
    (
        Body("one", cloud(5, seed=1), omega_bar=(0.0, 0.0, 9.0), damping=0.01),
        Body("two", cloud(3, seed=2), position=(1.0, 0.0, 0.0), omega_bar=(0.0, 0.0, -20.0)),
    ),
    (Joint("hinge", "revolute", "ground.O", "one.a"), Joint("elbow", "spherical", "one.b", "two.a")),
    loads=(Load("push", "two.c", force=(harmonic(amplitude=5.0, frequency=2.0), 0.0, 0.0)),),
    springs=(SpringDamper("rope", "ground.P", "two.b", 50.0, 1.0, 1.0),),
    ground=GROUND,
    gravity=(0.0, -9.81, 0.0),
)
SETTINGS = {"end": 1.0, "output_step": 0.01, "method": ROS2(1e-3), "outputs": ("default", "*.work", "*.power")}


def assert_same_bits(a, b):
    assert a.time.tobytes() == b.time.tobytes()
    assert list(a.quantities) == list(b.quantities)
    for name, quantity in a.quantities.items():
        assert quantity.values.tobytes() == b[name].tobytes(), name
    assert {**b.attributes, **a.attributes} == b.attributes  # a file also says what wrote it


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The run that nothing stopped."""
    path = tmp_path_factory.mktemp("whole") / "run.nc"
    integrate(SCENE, **SETTINGS, path=path)
    return load_result(path)


class StoppedError(Exception):
    pass


def stop_after(t: float):
    def progress(reached: float) -> None:
        if reached >= t:
            raise StoppedError

    return progress


@pytest.mark.parametrize("at", [0.0, 0.3, 0.995])
def test_a_stopped_run_goes_on_to_the_same_bits(tmp_path, whole, at):
    path = tmp_path / "run.nc"
    with pytest.raises(StoppedError):
        integrate(SCENE, **SETTINGS, path=path, progress=stop_after(at))
    assert load_result(path).time[-1] >= at
    result = integrate(SCENE, **SETTINGS, resume=path)
    assert_same_bits(result, whole)
    assert_same_bits(load_result(path), whole)


EVENTS = (
    Event("once", "one.b.position.x", 0.0),
    Event("turn", "hinge.angle", -6.5, direction="falling"),
    Event("worked", "push.work", -1.0),
    Event("function", lambda t, state: state.position("two.c")[1], 0.0),
    Event("last", "hinge.angle", -9.0, stop=True),
)


@pytest.mark.parametrize("at", [0.0, 0.3, 0.6])
def test_a_run_with_events_goes_on_to_the_same_bits(tmp_path, at):
    """With those of its first part, the row that ends it, and the memory of angles and work; it was refused."""
    path, settings = tmp_path / "run.nc", SETTINGS | {"events": EVENTS}
    whole = integrate(SCENE, **settings, path=tmp_path / "whole.nc")
    assert {event["event"] for event in whole.attributes["events"]} == {event.name for event in EVENTS}
    assert whole.time[-1] < SETTINGS["end"]
    with pytest.raises(StoppedError):
        integrate(SCENE, **settings, path=path, progress=stop_after(at))
    assert_same_bits(integrate(SCENE, **settings, resume=path), whole)
    later = integrate(SCENE, **settings | {"end": 2.0}, resume=path)  # which an event has ended
    assert later.time.tobytes() == whole.time.tobytes()
    assert later.attributes["events"] == whole.attributes["events"]


def test_a_run_with_other_events_is_another(tmp_path):
    path, settings = tmp_path / "run.nc", SETTINGS | {"end": 0.02}
    integrate(SCENE, **settings, events=EVENTS[:1], path=path)
    for other in ((), EVENTS[:2], (replace(EVENTS[0], value=0.1),)):
        with pytest.raises(InputError, match="another scene or of other settings"):
            integrate(SCENE, **settings, events=other, resume=path)


@pytest.mark.slow
def test_a_run_to_a_later_end_is_the_long_run(tmp_path, whole):
    path = tmp_path / "run.nc"
    integrate(SCENE, **SETTINGS | {"end": 0.37}, path=path)
    assert_same_bits(integrate(SCENE, **SETTINGS, resume=path), whole)
    with pytest.raises(InputError, match=r"0\.5 s beyond this end"):
        integrate(SCENE, **SETTINGS | {"end": 0.5}, resume=path)
    assert_same_bits(integrate(SCENE, **SETTINGS, resume=path), whole)  # nothing is left to do
    assert_same_bits(load_result(path), whole)
    assert load_checkpoint(path) is not None


def test_a_resumed_run_can_go_to_another_file(tmp_path, whole):
    integrate(SCENE, **SETTINGS | {"end": 0.2}, path=tmp_path / "a.nc")
    before = (tmp_path / "a.nc").read_bytes()
    integrate(SCENE, **SETTINGS, resume=tmp_path / "a.nc", path=tmp_path / "b.nc")
    assert (tmp_path / "a.nc").read_bytes() == before
    assert_same_bits(load_result(tmp_path / "b.nc"), whole)


def test_a_file_that_is_not_there_yet_is_a_run_from_the_start(tmp_path, whole):
    assert_same_bits(integrate(SCENE, **SETTINGS, resume=tmp_path / "none.nc"), whole)
    assert_same_bits(load_result(tmp_path / "none.nc"), whole)


def test_counters_of_drift_and_projections_go_on(tmp_path, whole):
    assert whole.attributes["projections"] > 0
    assert whole.attributes["largest_drift"][0] > 0


@pytest.mark.parametrize(
    "change",
    [
        {"method": ROS2(5e-4)},
        {"method": RK4(1e-3)},
        {"start": 0.01, "end": 1.01},
        {"output_step": 0.02},
        {"stabilisation": Baumgarte(10.0, 10.0)},
        {"outputs": ("default",)},
        {"scene": replace(SCENE, gravity=(0.0, -9.82, 0.0))},
        {"scene": replace(SCENE, bodies=(replace(SCENE.bodies[0], omega_bar=(0.0, 0.0, 9.5)), SCENE.bodies[1]))},
        {"scene": replace(SCENE, bodies=(replace(SCENE.bodies[0], damping=0.02), SCENE.bodies[1]))},
        {"scene": replace(SCENE, springs=(replace(SCENE.springs[0], preload=1e-12),))},
    ],
)
def test_another_scene_or_other_settings_are_refused(tmp_path, change):
    path = tmp_path / "run.nc"
    integrate(SCENE, **SETTINGS | {"end": 0.02}, path=path)
    before = path.read_bytes()
    with pytest.raises(InputError, match="another scene or of other settings"):
        integrate(**{"scene": SCENE} | SETTINGS | change, resume=path)
    assert path.read_bytes() == before


def test_files_that_cannot_be_continued_are_named(tmp_path, whole):
    with pytest.raises(InputError, match=r"plain\.nc has no checkpoint"):
        integrate(SCENE, **SETTINGS, resume=save_result(whole, tmp_path / "plain.nc"))
    (tmp_path / "text.nc").write_text("hello")
    with pytest.raises(InputError, match="damaged"):
        integrate(SCENE, **SETTINGS, resume=tmp_path / "text.nc")


def test_a_checkpoint_of_another_version_is_refused(tmp_path, monkeypatch):
    """One that lacks something that this version keeps, and one that has it in another shape."""
    path = tmp_path / "run.nc"
    integrate(SCENE, **SETTINGS | {"end": 0.02}, path=path)
    name = "machine.work.bodies.f"
    for change in ({}, {name: np.zeros(1)}):

        def older(content, change=change):
            saved = decode(content)
            kept = {key: array for key, array in saved.arrays.items() if key != name}
            return replace(saved, arrays=kept | change)

        monkeypatch.setattr("ffr_dyn.analyses.integration.decode", older)
        with pytest.raises(InputError, match="another version"):
            integrate(SCENE, **SETTINGS, resume=path)


def test_measuring_in_parts_gives_the_same_bits():
    """Angles, elastic displacements, work: however many rows are looked at together."""
    from ffr_dyn.compile.engine import fill_rows, new_engine
    from ffr_dyn.compile.workspace import new_record
    from ffr_dyn.consistency.assemble import assemble
    from ffr_dyn.kernels.tables import Record

    state, method = assemble(SCENE), ROS2(1e-3)
    system, record = state.system, new_record(state.system, 40)
    fill_rows(new_engine(system, state.x, state.v, method, (0.0, 0.0, 1e-9)), record, 0.0, 1)
    wanted = selected(system, ("*",))
    once, _ = measure(View(system, record), {}, wanted)
    for sizes in ([1] * 40, [3, 1, 13, 7, 16], [39, 1]):
        memory, parts, at = {}, [], 0
        for size in sizes:
            part = Record(*(column[at : at + size] for column in record))
            quantities, memory = measure(View(system, part), memory, wanted)
            parts.append(quantities)
            at += size
        for name, quantity in once.items():
            joined = np.concatenate([part[name].values for part in parts])
            assert joined.tobytes() == quantity.values.tobytes(), (name, sizes)


def test_a_checkpoint_survives_its_bytes():
    given = Checkpoint(
        "abc",
        12,
        {"x": np.array([1.0, np.nan, -0.0]), "work.info": np.arange(4)},
        {"hinge.angle": Unwound(1e-300, np.inf, 3.0), "push.work": Worked(1.0, 2.0, (0.1, 0.2))},
    )
    back = decode(encode(given))
    assert (back.fingerprint, back.steps, back.memory) == (given.fingerprint, given.steps, given.memory)
    assert all(back.arrays[name].tobytes() == array.tobytes() for name, array in given.arrays.items())
    with pytest.raises(InputError, match="checkpoint is damaged"):
        decode(encode(given)[:-30])


# ---- kill -9 --------------------------------------------------------------------------------------------------------

RUN = """
import sys, time
import test_resume as t
from ffr_dyn.results import file as result_file
from ffr_dyn.analyses import integration as f
start = result_file.ResultWriter.__init__
result_file.ResultWriter.__init__ = lambda *a, **k: start(*a, **(k | {"interval": 0.0, "share": 1e9}))
f.SECONDS_PER_CALL = 1e-9  # one row a call, so that a run of a hundred rows takes two seconds
f.integrate(t.SCENE, **t.SETTINGS, resume=sys.argv[1], progress=lambda reached: time.sleep(0.02))
"""


@pytest.mark.parametrize("delays", [(0.1,), pytest.param((0.05, 0.2, 0.13, 0.3), marks=pytest.mark.slow)])
def test_a_killed_run_goes_on_to_the_same_bits(tmp_path, whole, delays):
    """Killed wherever it stands, again and again, until it is through. Every run but the whole one is a process."""
    path, lengths = tmp_path / "run.nc", []
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), str(TESTS), str(Path(__file__).parent)])}
    ensure_compiled(type(SETTINGS["method"]))
    for delay in delays:
        run = subprocess.Popen([sys.executable, "-c", RUN, path], env=environment)
        rows = lengths[-1] if lengths else 0
        while run.poll() is None and (not path.exists() or load_result(path).time.size <= rows):
            time.sleep(0.01)
        time.sleep(delay)
        run.send_signal(signal.SIGKILL)
        assert run.wait() == -signal.SIGKILL
        lengths.append(load_result(path).time.size)
    assert lengths == sorted(set(lengths))
    subprocess.run([sys.executable, "-c", RUN, path], env=environment, check=True)
    assert lengths[-1] < whole.time.size
    assert_same_bits(load_result(path), whole)


def test_a_run_that_failed_tells_the_same_when_it_is_resumed(tmp_path):
    scene = replace(SCENE, loads=(Load("bad", "two.c", function=lambda t, state: (np.nan if t > 0.5 else 0.0, 0, 0)),))
    settings = SETTINGS | {"outputs": ("default",)}
    for _ in range(2):
        with pytest.raises(ComputationError, match=r"'bad' at t = 0\.50"):
            integrate(scene, **settings, resume=tmp_path / "run.nc")
        assert load_result(tmp_path / "run.nc").time[-1] == pytest.approx(0.5)


@pytest.mark.slow
def test_the_first_run_that_compiles_has_the_bits_of_all_later_ones(tmp_path):
    """A copy of the packages without compiled kernels: a run that has them compiled, then two that find them."""
    for package in ("ffr_dyn", "ffr_prep"):
        shutil.copytree(ROOT / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__"))
    script = (
        "import sys; from test_resume import SCENE, SETTINGS; from ffr_dyn.analyses.integration import integrate;"
        "sys.stdout.buffer.write(integrate(SCENE, **SETTINGS)['one.R'].tobytes())"
    )
    paths = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join([str(tmp_path), str(TESTS), str(TESTS / "ffr_dyn" / "analyses")]),
    }
    run = [sys.executable, "-c", script]
    first, second = (subprocess.run(run, cwd=tmp_path, env=paths, capture_output=True, check=True) for _ in range(2))
    assert b"compiling" in first.stderr
    assert b"compiling" not in second.stderr
    assert len(first.stdout) == 101 * 24
    assert first.stdout == second.stdout
