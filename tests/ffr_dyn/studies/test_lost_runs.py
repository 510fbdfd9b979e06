"""What goes wrong around the runs of a study costs no run that is done, and makes no run fail that could be done."""

from __future__ import annotations

import errno
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from test_sweep import SCENE, STRIP

import ffr_dyn as fd
from ffr_dyn.chart.runner import Failure, Lost
from ffr_dyn.studies import runs, sweep, table
from ffr_dyn.studies.runs import Recipe, Row, make
from ffr_dyn.studies.table import Journal, journal_of, noted, save_table
from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.common.outputs import reserved

COUNT = 40
ANGLE = {"angle": "hinge.angle: last"}


@pytest.fixture
def study(tmp_path) -> fd.Study:
    (tmp_path / "bar.toml").write_text(SCENE)
    return fd.study(tmp_path / "bar.toml", {"g": {"from": 1, "to": 9, "count": COUNT}}, ANGLE)


@pytest.fixture
def out(tmp_path) -> Path:
    return tmp_path / "t.nc"


def pooled(monkeypatch, answer: Any) -> None:
    """Runs are done by a pool that answers so, task by task."""

    class Answering:
        def results(self, function: Any, items: Any) -> Iterator[tuple[int, Any]]:
            yield from ((k, answer(item)) for k, item in enumerate(items))

    @contextmanager
    def where(*_: Any) -> Iterator[Any]:
        yield Answering()

    monkeypatch.setattr(sweep, "_where", where)


def ended(task: Any) -> list[Row]:
    return [Row(point.number, {"angle": float(point.number)}) for point in task.points]


def test_a_run_that_brings_its_worker_down_takes_no_other_along(study, out, monkeypatch):
    pooled(monkeypatch, lambda task: Failure("died") if 7 in [p.number for p in task.points] else ended(task))
    found = fd.sweep(study, out)
    assert list(found.failed) == [7]
    assert found.messages[7] == "died"


def test_a_cluster_that_has_gone_leaves_the_rows_that_it_has_done(study, out, monkeypatch):
    pooled(monkeypatch, lambda task: Lost("the cluster has gone") if task.points[0].number > 9 else ended(task))
    with pytest.raises(ComputationError, match=r"the cluster has gone.*what is done is kept"):
        fd.sweep(study, out)
    pooled(monkeypatch, lambda task: ended(task) if task.points[0].number > 9 else Failure("computed twice"))
    assert not fd.sweep(study, out).failed.size


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EDQUOT, errno.EFBIG])
def test_a_full_disk_in_a_run_stops_the_study_and_fails_no_run(study, out, monkeypatch, code):
    done, real = [], runs.run

    def full(*given: Any, **more: Any) -> Any:
        if len(done) == 3:
            try:
                raise OSError(code, "no room")
            except OSError:
                raise ComputationError("writing failed") from None
        done.append(1)
        return real(*given, **more)

    monkeypatch.setattr(runs, "run", full)
    with pytest.raises(InputError, match=r"writing failed; make room, .* what is done is kept"):
        fd.sweep(study, out, workers=0)
    assert journal_of(out).read_bytes().count(b"\n") == 1 + 3
    monkeypatch.setattr(runs, "run", real)
    assert not fd.sweep(study, out, workers=0).failed.size


def test_a_full_disk_is_told_though_the_journal_cannot_be_closed_either(study, out, monkeypatch):
    """Python writes what is left when it closes a file, and fails again."""

    class Full:
        def write(self, text: bytes) -> None:
            pass

        def flush(self) -> None:
            raise OSError(errno.ENOSPC, "No space left on device")

        close = flush

    real = Journal.__enter__

    def entered(journal: Journal) -> Journal:
        journal._file.close()
        journal._file = Full()
        return real(journal)

    monkeypatch.setattr(Journal, "__enter__", entered)
    with pytest.raises(InputError, match="journal: No space left on device; make room"):
        fd.sweep(study, out, workers=0)


def test_a_body_that_another_study_makes_is_waited_for(tmp_path, monkeypatch):
    (tmp_path / "strip.toml").write_text(STRIP)
    target, found = tmp_path / "key.ffr", list[Any]()
    monkeypatch.setattr(runs, "WAIT", 0.01)
    recipe = Recipe("reduce-structure strip.toml", str(tmp_path), str(target))
    with reserved(target):
        waiting = threading.Thread(target=lambda: found.append(make(recipe)))
        waiting.start()
        waiting.join(0.5)
        assert not found
        target.write_text("made")
        waiting.join()
    assert found == [""]
    assert target.read_text() == "made"


def test_what_runs_note_is_in_the_table(study, out):
    rows = {k: Row(k, {"angle": 1.0}, notes=f"off by {k} %\nplanar" if k else "") for k in range(COUNT)}
    made = table.table(study, rows)
    save_table(made, out)
    assert fd.load_table(out).notes == made.notes == tuple(rows[k].notes for k in range(COUNT))
    assert noted(made) == [(COUNT - 1, "off by 1 %"), (COUNT - 1, "planar")]


def test_a_run_notes_what_it_notes_alone(tmp_path, out):
    (tmp_path / "bar.toml").write_text(SCENE.replace("end = 0.2\noutput_step = 0.01", "end = 2.0\noutput_step = 0.2"))
    study = fd.study(tmp_path / "bar.toml", {"g": [9.0]}, {"force": "hinge.force: largest"})
    assert "too coarse for what hinge.force does" in fd.sweep(study, out, workers=0).notes[0]
