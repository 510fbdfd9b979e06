"""Outputs replace nothing that must stay, appear whole or not at all, and have one writer at a time."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from places import ROOT
from synthetic import cloud

from ffr_dyn import cli as dyn
from ffr_prep import cli as prep
from ffr_prep.body import load_body, save_body
from ffr_prep.common.children import ending_with_us
from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.common.interrupts import Interrupted, ending_in_order, undisturbed
from ffr_prep.common.outputs import command_inputs, made_folder, note_input, part_of, replacing, reserved

SCENE = """
[analysis]
end = 0.1
output_step = 0.01
[ground]
O = [0, 0, 0]
[bodies.bar]
file = "bar.ffr"
[joints.hinge]
kind = "revolute"
i = "ground.O"
j = "bar.b"
"""


def written(path: Path, text: str = "new") -> None:
    with replacing(path) as part:
        part.write_text(text)


@pytest.fixture
def body_file(tmp_path) -> Path:
    return save_body(cloud(2, stiffness=50.0), tmp_path / "bar.ffr")


def said(capsys, command, *arguments: object) -> tuple[int, str]:
    try:
        command(arguments)
        code = 0
    except SystemExit as end:
        code = int(end.code or 0)
    text = capsys.readouterr().err
    assert "Traceback" not in text
    return code, text


# ---- places --------------------------------------------------------------------------------------------------------


def test_an_output_appears_when_it_is_complete(tmp_path):
    path = tmp_path / "new" / "a.txt"
    written(path)
    assert path.read_text() == "new"
    with pytest.raises(TypeError), replacing(path) as part:
        part.write_text(None)
    assert path.read_text() == "new"
    assert os.listdir(path.parent) == ["a.txt"]


@pytest.mark.parametrize("kind", ["link", "dangling", "folder", "fifo", "device"])
def test_what_is_no_ordinary_file_is_neither_replaced_nor_followed(tmp_path, kind):
    path, target = tmp_path / "a", tmp_path / "target"
    if kind in ("link", "dangling"):
        path.symlink_to(target)
        if kind == "link":
            target.write_text("precious")
    elif kind == "folder":
        path.mkdir()
    elif kind == "fifo":
        os.mkfifo(path)
    else:
        path = Path("/dev/null")
    before = os.lstat(path)
    with pytest.raises(InputError, match=r"symbolic link|folder|no ordinary file"):
        written(path)
    after = os.lstat(path)
    assert (after.st_mode, after.st_ino) == (before.st_mode, before.st_ino)
    assert not target.exists() or target.read_text() == "precious"
    assert not part_of(path).exists()


@pytest.mark.parametrize("name", ["in.txt", "hard.txt", "in.txt.part", "folder/../in.txt"])
def test_an_input_is_not_replaced_under_any_name(tmp_path, name):
    (tmp_path / "folder").mkdir()
    source = tmp_path / ("in.txt.part" if name == "in.txt.part" else "in.txt")
    source.write_text("precious")
    if name == "hard.txt":
        os.link(source, tmp_path / name)
    target = tmp_path / name.removesuffix(".part")
    with command_inputs():
        note_input(source)
        with pytest.raises(InputError, match="input of this command"):
            written(target)
    assert source.read_text() == "precious"
    if name != "in.txt.part":
        written(target)  # of another command
        assert target.read_text() == "new"


def test_commands_refuse_to_replace_what_they_read(body_file, tmp_path, capsys, monkeypatch):
    before, scene = body_file.read_bytes(), tmp_path / "scene.toml"
    scene.write_text(SCENE)
    own = ["convert", str(body_file), "--reference", "mean-axis", "-o", str(body_file)]
    for command, arguments in (
        (prep.main, own),
        (prep.main, ["import", str(body_file), "-o", str(body_file)]),
        (prep.main, ["reduce", str(body_file), "--material", "steel", "-o", str(body_file)]),
        (lambda words: run_dyn(monkeypatch, words), ["run", str(scene), "-o", str(body_file)]),
        (lambda words: run_dyn(monkeypatch, words), ["run", str(scene), "-o", str(scene)]),
    ):
        code, text = said(capsys, lambda words, command=command: command(list(words)), *arguments)
        assert code == 2
        assert "input of this command" in text
    assert body_file.read_bytes() == before
    assert scene.read_text() == SCENE
    assert sorted(os.listdir(tmp_path)) == ["bar.ffr", "scene.toml"]


def run_dyn(monkeypatch, words):
    monkeypatch.setattr(sys, "argv", ["ffr-dyn", *words])
    dyn.main()


# ---- one writer, full disks ----------------------------------------------------------------------------------------


def test_there_is_one_writer_at_a_time(tmp_path):
    path = tmp_path / "a.txt"
    other = (
        "from pathlib import Path; from ffr_prep.common.outputs import replacing\n"
        f"with replacing({str(path)!r}) as part: part.write_text('second')"
    )
    with replacing(path) as part:
        part.write_text("first")
        done = subprocess.run([sys.executable, "-c", other], cwd=ROOT, capture_output=True, text=True, check=False)
        assert "is being written by another run" in done.stderr
        with pytest.raises(InputError, match="another run"):
            written(path)
        assert part.read_text() == "first"
    assert path.read_text() == "first"
    written(path, "third")
    assert path.read_text() == "third"


def test_a_command_keeps_its_place_until_it_ends(tmp_path):
    path = tmp_path / "a.txt"
    with reserved(path):
        written(path, "1")
        written(path, "2")
        with pytest.raises(InputError, match="another run"), reserved(path):
            pass
    assert path.read_text() == "2"
    assert os.listdir(tmp_path) == ["a.txt"]


def test_a_full_disk_leaves_what_was_there(tmp_path, body_file):
    before, limits = body_file.read_bytes(), resource.getrlimit(resource.RLIMIT_FSIZE)
    larger = cloud(2, stiffness=60.0)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (1000, limits[1]))
        with pytest.raises(ComputationError, match=r"bar.ffr failed \(File too large\)"):
            save_body(larger, body_file)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert body_file.read_bytes() == before
    assert os.listdir(tmp_path) == ["bar.ffr"]
    np.testing.assert_array_equal(load_body(save_body(larger, body_file)).omega2, larger.omega2)


# ---- signals and processes -----------------------------------------------------------------------------------------


@pytest.fixture
def heard():
    """Signals that a shell has told its background jobs to ignore, as it does with SIGINT, are heard like others."""
    names = [one for one in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP) if signal.getsignal(one) is signal.SIG_IGN]
    for one in names:
        signal.signal(one, signal.SIG_DFL)
    yield
    for one in names:
        signal.signal(one, signal.SIG_IGN)


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
@pytest.mark.usefixtures("heard")
def test_signals_raise_and_wait_for_what_must_be_done_whole(name):
    done = []
    handler = signal.getsignal(getattr(signal, name))

    def work():
        with undisturbed():
            signal.raise_signal(getattr(signal, name))
            done.append("whole")
        done.append("never")

    with ending_in_order(), pytest.raises(Interrupted, match=name):
        work()
    assert done == ["whole"]
    assert signal.getsignal(getattr(signal, name)) is handler


class Ending:
    """Whose destructor is where a signal happens to arrive."""

    def __del__(self):
        signal.raise_signal(signal.SIGTERM)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_a_signal_in_a_destructor_is_not_lost():
    """Python drops the exception that is raised there; the next step that is done whole raises it again, once."""
    done = []

    def work():
        Ending()
        done.append("goes on")
        try:
            with undisturbed():
                done.append("whole")
        finally:
            with undisturbed():  # on the way out nothing is raised anew
                done.append("closed")
            done.append("out")

    with pytest.raises(Interrupted, match="SIGTERM"), ending_in_order():
        work()
    assert done == ["goes on", "whole", "closed", "out"]
    with ending_in_order(), undisturbed():
        done.append("forgotten with its block")


@pytest.mark.parametrize("known", [True, False])
def test_what_fails_by_a_signal_is_an_interruption(known):
    """As a library does that is loaded just then."""
    with pytest.raises(Interrupted, match="SIGTERM"), ending_in_order():  # noqa: PT012 - what happens within is the test
        try:
            signal.raise_signal(signal.SIGTERM)
        except KeyboardInterrupt as struck:
            raise ImportError("initialization failed") from (struck if known else None)


def test_what_the_process_ignores_stays_ignored():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)  # as under nohup
    try:
        with ending_in_order(), undisturbed():
            signal.raise_signal(signal.SIGHUP)
    finally:
        signal.signal(signal.SIGHUP, before)


@pytest.mark.skipif(sys.platform != "linux", reason="the kernel is asked for it")
def test_a_child_ends_with_its_parent():
    sleeper = [sys.executable, "-c", "import time; print('up', flush=True); time.sleep(60)"]
    code = (
        "import subprocess, time; from ffr_prep.common.children import ending_with_us\n"
        f"child = subprocess.Popen(ending_with_us({sleeper!r}), stdout=subprocess.PIPE)\n"
        "child.stdout.readline(); print(child.pid, flush=True); time.sleep(60)"
    )
    parent = subprocess.Popen([sys.executable, "-c", code], cwd=ROOT, stdout=subprocess.PIPE, text=True)
    child = int(parent.stdout.readline())
    parent.kill()
    parent.communicate()
    for _ in range(100):
        if not Path(f"/proc/{child}").exists() or "State:\tZ" in Path(f"/proc/{child}/status").read_text():
            return
        time.sleep(0.05)
    raise AssertionError("it runs on")


def test_a_child_does_what_it_is_told():
    done = subprocess.run(
        ending_with_us([sys.executable, "-c", "print(7)"]), capture_output=True, text=True, check=True
    )
    assert done.stdout == "7\n"


# ---- compiled code ---------------------------------------------------------------------------------------------------

COMPILED = """
import numba
from ffr_prep.common.compile_cache import check_compiled_code
check_compiled_code()
@numba.njit(cache=True)
def twice(x):
    return 2 * x
print(twice(21), sum(twice.stats.cache_hits.values()))
"""


@pytest.mark.slow
@pytest.mark.parametrize("suffix", ["nbi", "nbc"])
@pytest.mark.parametrize("damage", ["truncated", "empty", "zeros"])
def test_damaged_compiled_code_is_made_anew(tmp_path, suffix, damage):
    (tmp_path / "module.py").write_text(COMPILED)

    def run() -> str:
        command = [sys.executable, str(tmp_path / "module.py")]
        environment = os.environ | {"PYTHONPATH": str(ROOT), "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
        return subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout

    assert run() == "42 0\n"
    assert run() == "42 1\n"
    (path,) = (tmp_path / "cache").rglob(f"*.{suffix}")
    content = path.read_bytes()
    half = len(content) // 2
    path.write_bytes({"truncated": content[:half], "empty": b"", "zeros": content[:half] + bytes(half)}[damage])
    assert run() == "42 0\n"
    assert run() == "42 1\n"


def test_a_file_in_the_place_of_a_folder_is_named(tmp_path):
    (tmp_path / "pictures").write_text("")
    for path in (tmp_path / "pictures", tmp_path / "pictures" / "modes"):
        with pytest.raises(InputError, match=r"the folder of pictures .*: .*pictures is a file; name a folder"):
            made_folder("the folder of pictures", path)
    assert made_folder("the folder of pictures", tmp_path / "a" / "b").is_dir()
