"""Studies: every row is the run of its parameters, whatever stops a study; what is wrong is said before or in its row."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
from places import ROOT

import ffr_dyn as fd
import ffr_dyn.studies.runs
import ffr_prep.cli
from ffr_dyn.results.result import Quantity, Result
from ffr_dyn.studies import draw
from ffr_dyn.studies.draw import changing_most, running_mean, tornado
from ffr_dyn.studies.measures import attribute, measured, values
from ffr_dyn.studies.runs import Row
from ffr_dyn.studies.table import Journal, journal_of, table
from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.common.outputs import reserved

SCENE = """
gravity = [0, "-g", 0]
[parameters]
g = 9.81
length = 1.0
idle = 3.0
[analysis]
end = 0.2
output_step = 0.01
step = 1e-3
[ground]
O = [0, 0, 0]
[bodies.bar]
mass = 1.0
inertia = [0.01, 0.1, 0.1]
centre_of_mass = ["length", 0, 0]
points = {a = [0, 0, 0]}
[joints.hinge]
kind = "revolute"
i = "ground.O"
j = "bar.a"
"""
STUDY = """
scene = "bar.toml"
[parameters]
g = [1, 5, 9.81]
length = {from = 0.5, to = 2.0, count = 4}
[outputs]
angle = "hinge.angle: last"
force = "hinge.force: largest"
weight = "= force / g"
work = "evaluations"
"""


@pytest.fixture
def folder(tmp_path) -> Path:
    (tmp_path / "bar.toml").write_text(SCENE)
    (tmp_path / "study.toml").write_text(STUDY)
    return tmp_path


def test_every_row_is_the_run_of_its_parameters(folder):
    table = fd.sweep(folder / "study.toml", folder / "t.nc", workers=0)
    assert len(table) == 12
    for k in (0, 5, 11):
        g, length = table["g"][k], table["length"][k]
        scene, settings = fd.load_scene(folder / "bar.toml", {"g": str(g), "length": str(length)})
        result = fd.forward(scene, **settings.span, method=settings.method, check=False)
        force = np.linalg.norm(result["hinge.force"], axis=1).max()
        assert table["angle"][k] == result["hinge.angle"][-1]
        assert table["force"][k] == force
        assert table["weight"][k] == pytest.approx(force / g, rel=1e-15)
    read = fd.load_table(folder / "t.nc")
    assert all(np.array_equal(read[name], table[name]) for name in ("g", "length", "angle", "force", "weight", "work"))
    assert (list(read.parameters), list(read.outputs)) == (list(table.parameters), list(table.outputs))
    assert not journal_of(folder / "t.nc").exists()
    assert "12 runs" in repr(table)


def test_the_file_has_dimensions_and_coordinates(folder):
    fd.sweep(folder / "study.toml", folder / "t.nc", workers=0)
    with h5py.File(folder / "t.nc") as file:
        assert file["force"].dims[0][0] == file["run"]
        assert file["force"].attrs["coordinates"] == "g length"


def test_a_table_that_xarray_has_open_is_read(folder):
    xarray = pytest.importorskip("xarray")
    fd.sweep(fd.study(folder / "bar.toml", {"g": [1.0]}, {"angle": "hinge.angle: last"}), folder / "t.nc", workers=0)
    with xarray.open_dataset(folder / "t.nc") as opened:
        assert opened["angle"][0] == fd.load_table(folder / "t.nc")["angle"][0]


@pytest.mark.slow
def test_whole_histories_are_rows_of_a_dimension_of_their_own(folder, monkeypatch):
    """Of runs of unequal length, too; the table is the same when it is made by workers."""
    parameters = {"g": [1.0, 9.81], "analysis.end": [0.1, 0.2], "bodies.bar.mass": [1.0]}
    outputs = {"h": "hinge.angle: history", "last": "hinge.angle: last", "free": "degrees_of_freedom: attribute"}
    study = fd.study(folder / "bar.toml", parameters, outputs)
    table = fd.sweep(study, folder / "t.nc", workers=0)
    assert table["h"].shape == table["time"].shape == (4, 21)
    assert np.isnan(table["h"][0, 11:]).all()
    assert np.isnan(table["time"][0, 11:]).all()
    for k, rows in enumerate((11, 21, 11, 21)):
        settings = {"g": str(table["g"][k]), "analysis.end": str(table["analysis.end"][k])}
        scene, given = fd.load_scene(folder / "bar.toml", settings)
        alone = fd.forward(scene, **given.span, method=given.method, check=False)
        assert table["h"][k, :rows].tobytes() == alone["hinge.angle"].tobytes()
        assert table["time"][k, :rows].tobytes() == alone.time.tobytes()
        assert table["last"][k] == alone["hinge.angle"][-1]
    assert table["free"].tolist() == [1.0] * 4
    fd.sweep(study, folder / "w.nc", workers=2)
    assert (folder / "w.nc").read_bytes() == (folder / "t.nc").read_bytes()
    with h5py.File(folder / "t.nc") as file:
        assert [scale[0] for scale in file["h"].dims] == [file["run"], file["row"]]
    assert fd.load_table(folder / "t.nc")["h"].shape == (4, 21)
    coloured = []
    monkeypatch.setattr(draw, "changing_most", lambda x, y: coloured.append(changing_most(x, y)) or coloured[-1])
    assert {path.name for path in fd.plot_study(table, folder / "p", ["h"])} == {"h.png", "pairs.png"}
    assert coloured == [["g", "analysis.end"]]  # by 0.034 and 0.025 rad of the mean


def test_attributes_are_found_by_the_path_of_their_keys():
    found = {"jumps": [3.0, 5.0], "critical": [{"speed": 7.0, "mode": "x"}], "rms": {"a.b.x": 2.0}, "stable": 1}
    names = ("jumps.2", "jumps", "jumps.3", "critical.1.speed", "rms.a.b.x", "stable")
    assert [attribute(found, name) for name in names[:2]] == [5.0, 2.0]
    assert np.isnan(attribute(found, "jumps.3"))
    assert [attribute(found, name) for name in names[3:]] == [7.0, 2.0, 1.0]
    with pytest.raises(InputError, match="no attribute 'stabel'; did you mean 'stable'"):
        attribute(found, "stabel")
    with pytest.raises(InputError, match="is no number but 'x'"):
        attribute(found, "critical.1.mode")


def test_a_study_that_was_stopped_goes_on_to_the_same_bits(folder):
    """Stopped after some rows, with the last line of its journal cut off; and by workers."""
    fd.sweep(folder / "study.toml", folder / "whole.nc", workers=0)

    def stop(done: int, total: int) -> None:
        if done >= 5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as caught:
        fd.sweep(folder / "study.toml", folder / "t.nc", workers=0, progress=stop)
    journal = journal_of(folder / "t.nc")
    assert caught.value.__notes__ == [f"{journal} holds 5 of 12 runs, and the same command goes on with them"]
    journal.write_bytes(journal.read_bytes()[:-7])
    with Journal(folder / "t.nc", fd.load_study(folder / "study.toml")) as opened:
        assert len(opened.rows) == 4
    done: list[int] = []
    fd.sweep(folder / "study.toml", folder / "t.nc", workers=0, progress=lambda k, total: done.append(k))
    assert done[0] == 5
    assert done[-1] == 12
    assert (folder / "t.nc").read_bytes() == (folder / "whole.nc").read_bytes()


@pytest.mark.parametrize(
    "line", [b"[]", b"{}", b"3", b'{"run": 99, "values": {}, "message": ""}', b"{" * 9000, b"\xff"]
)
def test_runs_behind_a_damaged_line_are_done_again(folder, line):
    study = fd.load_study(folder / "study.toml")
    whole = fd.sweep(study, folder / "whole.nc", workers=0)
    rows = [Row(k, {name: float(y[k]) for name, y in whole.outputs.items()}) for k in range(len(whole))]
    with Journal(folder / "t.nc", study) as journal:
        journal.add(rows)
    lines = journal_of(folder / "t.nc").read_bytes().split(b"\n")
    journal_of(folder / "t.nc").write_bytes(b"\n".join([*lines[:3], line, *lines[4:]]))
    with Journal(folder / "t.nc", study) as journal:
        assert sorted(journal.rows) == [0, 1]
    fd.sweep(study, folder / "t.nc", workers=0)
    assert (folder / "t.nc").read_bytes() == (folder / "whole.nc").read_bytes()


def test_a_second_study_to_one_output_is_refused(folder):
    with reserved(folder / "t.nc"), pytest.raises(fd.InputError, match="being written by another run"):
        fd.sweep(folder / "study.toml", folder / "t.nc", workers=0)
    assert not journal_of(folder / "t.nc").exists()


@pytest.mark.slow
def test_workers_make_the_same_file(folder):
    fd.sweep(folder / "study.toml", folder / "whole.nc", workers=0)
    fd.sweep(folder / "study.toml", folder / "t.nc", workers=2)
    assert (folder / "t.nc").read_bytes() == (folder / "whole.nc").read_bytes()


@pytest.mark.slow
def test_a_dask_cluster_makes_the_same_file(folder):
    distributed = pytest.importorskip("dask.distributed")
    fd.sweep(folder / "study.toml", folder / "whole.nc", workers=0)
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=":0") as cluster:
        fd.sweep(folder / "study.toml", folder / "t.nc", cluster=cluster.scheduler_address)
    assert (folder / "t.nc").read_bytes() == (folder / "whole.nc").read_bytes()


@pytest.mark.slow
def test_a_killed_command_goes_on(folder):
    study = (folder / "study.toml").read_text().replace("count = 4", "count = 40")
    (folder / "study.toml").write_text(study)
    command = [sys.executable, "-m", "ffr_dyn.cli", "sweep", str(folder / "study.toml"), "-o", str(folder / "t.nc")]
    command += ["--workers", "0"]
    first = subprocess.Popen(command, cwd=ROOT)
    while not journal_of(folder / "t.nc").exists() or len(journal_of(folder / "t.nc").read_bytes()) < 2000:
        time.sleep(0.05)
    first.send_signal(signal.SIGKILL)
    first.wait()
    subprocess.run(command, cwd=ROOT, check=True)
    fd.sweep(folder / "study.toml", folder / "whole.nc", workers=0)
    assert (folder / "t.nc").read_bytes() == (folder / "whole.nc").read_bytes()


def test_a_run_that_fails_is_a_row_with_its_message(folder):
    study = fd.study(folder / "bar.toml", {"bodies.bar.mass": [1.0, -1.0, 2.0]}, {"angle": "hinge.angle: last"})
    table = fd.sweep(study, folder / "t.nc", workers=0)
    assert table.failed.tolist() == [1]
    assert "bar" in table.messages[1]
    assert np.isnan(table["angle"][1])
    assert np.isfinite(table["angle"][[0, 2]]).all()
    with pytest.raises(ComputationError, match="no run has succeeded; the first says"):
        fd.sweep(fd.study(folder / "bar.toml", {"g": [1, 2]}, {"x": "hinge.torque: last"}), folder / "u.nc", workers=0)
    none = fd.load_table(folder / "u.nc")
    assert none.failed.tolist() == [0, 1]
    assert all("hinge.torque" in message for message in none.messages)
    assert none["g"].tolist() == [1, 2]
    assert not (folder / "u.nc.journal").exists()


def test_an_output_that_a_run_has_not_leaves_the_others(folder):
    """A formula without a value for one point, and an attribute that no run has."""
    outputs = {
        "angle": "hinge.angle: last",
        "part": "= angle / (g - 2)",
        "twice": "= 2 * part",
        "x": "jumps: attribute",
    }
    table = fd.sweep(fd.study(folder / "bar.toml", {"g": [1.0, 2.0]}, outputs), folder / "t.nc", workers=0)
    assert np.isfinite(table["angle"]).all()
    assert np.isfinite(table["part"]).tolist() == np.isfinite(table["twice"]).tolist() == [True, False]
    assert table["twice"][0] == -2 * table["angle"][0]
    assert np.isnan(table["x"]).all()
    assert table.messages[0].startswith("the result has no attribute 'jumps'")
    assert "outputs.part: in the formula 'angle / (g - 2)'" in table.messages[1]
    assert "outputs.twice" not in table.messages[1]
    assert table.units["angle"] == "rad"


def test_a_formula_of_an_item_that_a_run_has_not_is_nan(folder):
    """As of a critical speed, which some runs have."""
    outputs = {"rpm": "= 60 * speed", "speed": "projections.2: attribute", "angle": "hinge.angle: last"}
    for attributes, expected in (([1.0, 2.0], 120.0), ([1.0], np.nan)):
        result = Result(
            np.zeros(1), {"hinge.angle": Quantity(np.ones(1), "rad")}, attributes={"projections": attributes}
        )
        found, why = values(tuple(measured(*one) for one in outputs.items()), result, {})
        np.testing.assert_array_equal(found["rpm"], expected)
        assert not why
        assert found["angle"] == 1.0


@pytest.mark.parametrize(("changed", "says"), [
    (("g = [1", "gg = [1"), "no parameter 'gg'.*did you mean 'g'"),
    (("g = [1", "idle = [1"), "'idle' changes nothing"),
    (("g = [1, 5, 9.81]", "g = []"), r"parameters.g = \[\]: give"),
    (("count = 4", "count = 1000000000000"), "there cannot be 1000000000000 values"),
    (("count = 4", "count = 2.5"), "count a whole one"),
    (("g = [1, 5, 9.81]", "g = {normal = ['a', 1]}"), r"parameters.g: \['a', 1\]: give numbers, all with units"),
    (("from = 0.5", "from = '0.5 m'"), r"parameters.length: \['0.5 m', 2.0\]: give numbers, all with units of one dimension"),
    (("from = 0.5, to = 2.0", "from = '1 m', to = '2 s'"), "parameters.length: .*all with units of one dimension"),
    (("from = 0.5, to = 2.0", "from = '1 mn', to = '2 mn'"), "parameters.length: .*unknown unit 'mn'"),
    (("g = [1, 5, 9.81]", "g = {lognormal = ['1 m', '2 m']}"), "the deviation of the logarithm is a number without a unit"),
    (("scene =", "sampling = 'sobl'\nscene ="), r"sampling: .*'sobol' \(it is 'sobl'\)$"),
    (("hinge.angle: last", "hinge.angle: lats"), "did you mean 'last'"),
    (("hinge.angle: last", "hinge.angle"), "write it as QUANTITY"),
    (("angle =", "time ="), "'time' cannot be a column"),
    (("angle =", "g ="), "'g' cannot be a column"),
    (("scene =", "scenes ="), "did you mean 'scene'"),
    (('"bar.toml"', '"rab.toml"'), "rab.toml.* does not exist"),
    (("g = [1", "g = [nan"), r"parameters.g = \[nan, .*finite numbers"),
    (("g = [1", "g = [true"), r"parameters.g = \[True, .*finite numbers"),
    (("to = 2.0", "to = inf"), "parameters.length: from and to are numbers, both with a unit or both in SI"),
    (("scene =", "seed = -1\nscene ="), "seed is -1; give a whole number, 0 or more"),
    (("scene =", "seed = 3\nscene ="), "seed = 3 changes nothing: no parameter has a distribution"),
    (("scene =", "sampling = 'sobol'\nscene ="), "sampling = sobol changes nothing: no parameter has a distribution"),
    (("scene =", "samples = 10\nscene ="), "samples = 10 changes nothing: no parameter has a distribution"),
    (("= force / g", "= forc / g"), "outputs.weight: in the formula 'forc / g', 'forc' is not known; did you mean 'force'"),
    (("= force / g", "= force / hinge.g"), "'hinge.g' is no output and no parameter"),
    (("= force / g", "= force * t"), "'t' is no output and no parameter"),
    (("= force / g", "= force /"), "outputs.weight: 'force /' is not a formula"),
    (("= force / g", "= weight / g"), "the formulas of weight depend on themselves"),
    (("angle =", "'' ="), "'' cannot be a column"),
    (("angle =", "'..' ="), "'..' cannot be a column"),
    (("angle =", '"a\\u0000" ='), "cannot be a column"),
])  # fmt: skip
def test_what_a_study_file_says_wrongly_is_named(folder, changed, says):
    (folder / "study.toml").write_text(STUDY.replace(*changed))
    with pytest.raises(InputError, match=says):
        fd.load_study(folder / "study.toml")


@pytest.mark.parametrize(("settings", "says"), [
    ({"points_are": "lsit"}, "points is 'lsit'; did you mean 'list'"),
    ({"sampling": "sobl"}, "sampling is 'sobl'; did you mean 'sobol'"),
    ({"samples": 2.5}, "samples is 2.5; give a whole number"),
    ({"seed": True}, "seed is True; give a whole number"),
])  # fmt: skip
def test_settings_of_a_program_are_looked_at_as_those_of_a_file(folder, settings, says):
    with pytest.raises(InputError, match=says):
        fd.study(folder / "bar.toml", {"g": [1.0, 2.0]}, {"angle": "hinge.angle: last"}, **settings)


def test_values_may_be_those_of_arrays(folder):
    outputs = {"angle": "hinge.angle: last", "history": "hinge.angle: history", "twice": "= 2 * angle"}
    lists = [np.array([1.0, 2.5]), list(np.array([1.0, 2.5])), (1.0, 2.5)]
    points = [fd.study(folder / "bar.toml", {"g": given}, outputs).points for given in lists]
    assert points[0] == points[1] == points[2]
    assert all(type(point["g"]) is float for of in points for point in of)


def test_histories_are_not_computed_again(folder):
    """A study of histories that was stopped goes on where it was, to the same bits."""
    outputs = {"angle": "hinge.angle: history", "force": "hinge.force: largest"}
    study = fd.study(folder / "bar.toml", {"g": [1.0, 2.0, 3.0, 4.0]}, outputs)
    fd.sweep(study, folder / "whole.nc", workers=0)

    def stop(done: int, total: int) -> None:
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fd.sweep(study, folder / "t.nc", workers=0, progress=stop)
    done: list[int] = []
    fd.sweep(study, folder / "t.nc", workers=0, progress=lambda k, total: done.append(k))
    assert done == [3, 4]
    assert (folder / "t.nc").read_bytes() == (folder / "whole.nc").read_bytes()


def test_formulas_of_formulas_are_worked_out(folder):
    outputs = {
        "twice": "= 2 * weight",
        "force": "hinge.force: largest",
        "weight": "= force / g",
        "same": "= weight + 0",
    }
    table = fd.sweep(fd.study(folder / "bar.toml", {"g": [5.0]}, outputs), folder / "t.nc", workers=0)
    assert table["twice"] / 2 == table["weight"] == table["same"] == table["force"] / 5.0


@pytest.mark.parametrize(
    "parameters",
    [
        {"bodies": {"bar": {"mass": [1.0, 2.0]}}, "gravity": {"2": [-9.81]}},
        {"bodies": {"bar.mass": [1.0, 2.0]}, "gravity.2": [-9.81]},
        {"bodies.bar.mass": [1.0, 2.0], "gravity": {"2": -9.81}},
    ],
)
def test_names_with_dots_may_be_tables(folder, parameters):
    """As TOML reads `bodies.bar.mass = [1, 2]`, which is no distribution of the parameter `bodies.bar`."""
    made = fd.study(folder / "bar.toml", parameters, {"angle": "hinge.angle: last"})
    assert made.points == ({"bodies.bar.mass": 1.0, "gravity.2": -9.81}, {"bodies.bar.mass": 2.0, "gravity.2": -9.81})


def test_a_parameter_that_only_another_one_without_use_has_changes_nothing(folder):
    text = SCENE.replace("idle = 3.0", 'idle = 3.0\nlazy = "2 * idle"\nhalf = 0.5').replace(
        "length = 1.0", 'length = "2 * half"'
    )
    (folder / "bar.toml").write_text(text)
    with pytest.raises(InputError, match="'idle' changes nothing"):
        fd.study(folder / "bar.toml", {"idle": [1, 2]}, {"angle": "hinge.angle: last"})
    assert len(fd.study(folder / "bar.toml", {"half": [1, 2]}, {"angle": "hinge.angle: last"}).points) == 2


def test_switches_are_what_a_scene_file_has(folder):
    scene = (folder / "bar.toml").read_text().replace("step = 1e-3", "step = 1e-3\ncheck = true")
    (folder / "bar.toml").write_text(scene)
    made = fd.study(folder / "bar.toml", {"analysis.check": ["true", "false"]}, {"angle": "hinge.angle: last"})
    table = fd.sweep(made, folder / "t.nc", workers=0)
    assert list(table["analysis.check"]) == ["true", "false"]
    assert not table.failed.size


def test_a_linear_output_has_the_statistics_of_its_parameter(folder):
    """The load of a bar at rest is its weight: mean, deviation and quantiles are g times those of the mass; strata, too."""
    scene = SCENE.replace("revolute", "fixed").replace("step = 1e-3", "step = 0.01").replace("end = 0.2", "end = 0.01")
    (folder / "bar.toml").write_text(scene)
    parameters = {"bodies.bar.mass": {"uniform": [1.0, 3.0]}}
    study = fd.study(
        folder / "bar.toml", parameters, {"load": "hinge.force: largest"}, samples=64, sampling="latin-hypercube"
    )
    table = fd.sweep(study, folder / "t.nc", workers=0)
    mass = table["bodies.bar.mass"]
    np.testing.assert_allclose(table["load"], 9.81 * mass, rtol=1e-9)
    np.testing.assert_array_equal(np.sort(np.floor((mass - 1) * 32)), np.arange(64))  # one in each of 64 strata
    assert table["load"].mean() == pytest.approx(9.81 * 2, rel=1 / 128)
    assert table["load"].std() == pytest.approx(9.81 / 3**0.5, rel=0.02)
    np.testing.assert_allclose(np.quantile(table["load"], [0.1, 0.9]), 9.81 * np.array([1.2, 2.8]), rtol=0.03)


@pytest.mark.parametrize(("line", "says"), [
    ("reduce rod.geo --set d=${diameter}", "no body 'bar' from a file"),
])  # fmt: skip
def test_lines_that_make_bodies_are_looked_at(folder, line, says):
    with pytest.raises(InputError, match=says):
        fd.study(folder / "bar.toml", {"diameter": [1, 2]}, {"angle": "hinge.angle: last"}, bodies={"bar": line})


def test_a_table_of_another_format_is_refused(folder):
    fd.sweep(folder / "study.toml", folder / "t.nc", workers=0)
    with h5py.File(folder / "t.nc", "r+") as file:
        file.attrs["ffr_study"] = 2
    with pytest.raises(InputError, match=r"t\.nc is a table of format 2, and this version reads format 1"):
        fd.load_table(folder / "t.nc")


def test_the_journal_of_another_study_is_refused(folder):
    with Journal(folder / "t.nc", fd.load_study(folder / "study.toml")):
        pass
    other = fd.study(folder / "bar.toml", {"g": [1, 2]}, {"angle": "hinge.angle: last"})
    with pytest.raises(InputError, match="is of another study"):
        fd.sweep(other, folder / "t.nc", workers=0)


@pytest.mark.parametrize(
    ("given", "column", "unit"),
    [
        (["100 cm", "50 in", 2.0], [1.0, 1.27, 2.0], "m"),
        (["1 m", "2 s"], ["1 m", "2 s"], None),
        (["1 m", "2 * 3"], ["1 m", "2 * 3"], None),
        ([1.0, 2.0], [1.0, 2.0], None),
    ],
)
def test_parameters_with_units_are_numbers_in_si(folder, given, column, unit):
    """Where all of them are quantities of one kind; their pictures have an axis then."""
    study = fd.study(folder / "bar.toml", {"length": given}, {"angle": "hinge.angle: last"})
    made = table(study, {k: Row(k, {"angle": 1.0 + k}) for k in range(len(given))})
    assert list(made["length"]) == pytest.approx(column) if unit else list(made["length"]) == column
    assert made.units.get("length") == unit
    if unit:
        assert {path.name for path in fd.plot_study(made, folder / "p")} >= {"angle.png", "angle-tornado.png"}


@pytest.mark.parametrize(("given", "expected", "unit"), [
    ({"from": "50 cm", "to": "2 m", "count": 4}, [0.5, 1.0, 1.5, 2.0], "m"),
    ({"from": "10 mm", "to": "1000 mm", "count": 3, "spacing": "log"}, [0.01, 0.1, 1.0], "m"),
    ({"uniform": ["10 in", "20 in"]}, None, "m"),
    ({"lognormal": ["10 in", 0.1]}, None, "m"),
    ({"truncnorm": [-2, 2, "50 cm", "10 mm"]}, None, "m"),
])  # fmt: skip
def test_ranges_and_distributions_take_units(folder, given, expected, unit):
    """They run as numbers in SI do, and the unit is looked at as that of any text."""
    how = {"samples": 3} if "count" not in given else {}
    study = fd.study(
        folder / "bar.toml", {"length": given}, {"force": "hinge.force: last", "k": "= force * length"}, **how
    )
    found = fd.sweep(study, folder / "t.nc", workers=0)
    assert not any(found.messages)
    assert found.units.get("length") == unit
    np.testing.assert_allclose(found["k"], found["force"] * found["length"])
    if expected:
        np.testing.assert_allclose(found["length"], expected, rtol=1e-15)
    assert (np.abs(found["length"] - 1.0) < 1.5).all()
    wrong = fd.study(
        folder / "bar.toml", {"bodies.bar.mass": {"from": "1 m", "to": "2 m", "count": 2}}, {"a": "energy.total: last"}
    )
    with pytest.raises(ComputationError, match="the unit 'm' does not fit: this is given in kg"):
        fd.sweep(wrong, folder / "w.nc", workers=0)


def test_errors_are_found_where_a_study_asks_for_them_whatever_the_scene_says(folder):
    (folder / "bar.toml").write_text(SCENE.replace("step = 1e-3", "step = 1e-3\ncheck = false"))
    found = fd.sweep(fd.study(folder / "bar.toml", {"g": [5]}, {"e": "hinge.angle: error"}), folder / "t.nc", workers=0)
    assert 0.0 < found["e"][0] < 1e-4


@pytest.mark.slow
def test_units_are_those_of_the_runs_and_of_the_scene(folder, monkeypatch):
    """In the table, in its file, and on the axes of its pictures; a formula of outputs has none."""
    (folder / "bar.toml").write_text(SCENE.replace("length = 1.0", 'length = "100 cm"'))
    outputs = {
        "h": "hinge.angle: history",
        "force": "hinge.force: largest",
        "e": "hinge.force: error",
        "w": "= force / g",
    }
    study = fd.study(folder / "bar.toml", {"g": [1, 5, 9.81], "length": [0.5, 1.0]}, outputs)
    table = fd.sweep(study, folder / "t.nc", workers=0)
    assert table.units == {"length": "m", "time": "s", "h": "rad", "force": "N", "e": "N"}
    assert fd.load_table(folder / "t.nc").units == table.units
    with h5py.File(folder / "t.nc") as file:
        assert file["force"].attrs["units"] == "N"
    surfaces = []
    monkeypatch.setattr(
        draw, "_surface", lambda path, name, first, second, y: surfaces.append((name, first[0], second[0]))
    )
    fd.plot_study(table, folder / "p", ["force", "w"])
    assert [(name, set(axes)) for name, *axes in surfaces] == [
        ("force [N]", {"g", "length [m]"}),
        ("w", {"g", "length [m]"}),
    ]


@pytest.mark.slow
def test_pictures_are_drawn(folder):
    table = fd.sweep(folder / "study.toml", folder / "t.nc", workers=0)
    names = {path.name for path in fd.plot_study(table, folder / "p", ["force"])}
    assert names == {"force.png", "force-tornado.png", "force-mean.png", "force-surface.png", "pairs.png"}
    with pytest.raises(InputError, match="no output 'fource'"):
        fd.plot_study(table, folder / "p", ["fource"])


def test_a_tornado_of_a_linear_output_has_its_slopes():
    random = np.random.default_rng(0)
    x = {"a": random.uniform(0, 2, 50), "b": random.uniform(1, 4, 50)}
    changes, share = tornado(x, 3 * x["a"] - x["b"] + 7)
    assert changes["a"] == pytest.approx(3 * np.ptp(x["a"]))
    assert changes["b"] == pytest.approx(-np.ptp(x["b"]))
    assert share == pytest.approx(1.0)


def test_a_running_mean_has_the_standard_errors_of_its_runs():
    y = np.array([1.0, np.nan, 4.0, 2.0, 7.0])
    number, mean, error = running_mean(y)
    kept = y[np.isfinite(y)]
    assert number.tolist() == [2, 3, 4]
    np.testing.assert_allclose(mean, [kept[:n].mean() for n in number])
    np.testing.assert_allclose(error, [kept[:n].std(ddof=1) / n**0.5 for n in number])


def test_measures_are_what_they_are_called(folder):
    scene, settings = fd.load_scene(folder / "bar.toml")
    result = fd.forward(scene, **settings.span, method=settings.method, check=True)
    force = result["hinge.force"]
    expected = {
        "hinge.force.y: least": force[:, 1].min(), "hinge.force: greatest": force.max(),
        "hinge.force.y: mean": np.trapezoid(force[:, 1], result.time) / np.ptp(result.time),
        "hinge.force: rms": np.sqrt(np.trapezoid((force**2).sum(axis=1), result.time) / np.ptp(result.time)),
        "hinge.force: range": np.ptp(force, axis=0).max(),
        "hinge.angle: first": result["hinge.angle"][0], "hinge.force: error": result.attributes["errors"]["hinge.force"][0],
    }  # fmt: skip
    outputs = tuple(measured(f"o{k}", text) for k, text in enumerate(expected))
    found, _ = values(outputs, result, {})
    np.testing.assert_allclose(list(found.values()), list(expected.values()), rtol=1e-14)


def test_means_are_over_the_time_however_rows_stand():
    """Of sin over a period and of t, with a last row soon after the one before, as where an event ends a run."""
    time = np.append(np.linspace(0.0, 1.0, 41), 1.0 + 1e-9)
    wave, ramp = (Quantity(y, "m") for y in (np.sin(2 * np.pi * time), time))
    outputs = tuple(measured(text, text) for text in ("wave: mean", "wave: rms", "ramp: mean"))
    found, _ = values(outputs, Result(time, {"wave": wave, "ramp": ramp}), {})
    np.testing.assert_allclose(list(found.values()), [0.0, 0.5**0.5, 0.5], atol=1e-8)
    at_speeds = Result(np.zeros(3), {"wave": Quantity(np.array([1.0, 2.0, 6.0]), "m")})
    assert values(outputs[:1], at_speeds, {}) == ({"wave: mean": 3.0}, [])


STRIP = """
reduction = {method = "eigenmodes", modes = 2}
reference = {kind = "fixed", interface = "a"}
linear = true
[[polylines]]
member = "bar"
corners = [[0, 0, 0], [1, 0, 0]]
elements = 2
[members.bar]
section = {shape = "circle", d = 0.01}
material = "steel"
[nodes]
a = [0, 0, 0]
b = [1, 0, 0]
[interfaces.a]
[interfaces.b]
"""
HANGING = """
gravity = [0, -9.81, 0]
[analysis]
kind = "static"
[ground]
O = [0, 0, 0]
[bodies.strip]
file = "strip.ffr"
[joints.clamp]
kind = "fixed"
i = "ground.O"
j = "strip.a"
"""


def test_entries_of_structure_files_and_of_scenes_are_varied(tmp_path):
    """A strip under its own weight, w = q l^4 / (8 E I), at rest: any analysis does."""
    (tmp_path / "strip.toml").write_text(STRIP)
    (tmp_path / "hanging.toml").write_text(HANGING)
    ffr_prep.cli.main(["reduce-structure", str(tmp_path / "strip.toml"), "-o", str(tmp_path / "strip.ffr")])
    study = fd.study(
        tmp_path / "hanging.toml",
        {"d": ["10 mm", "20 mm"], "gravity.2": [-9.81, -1.62]},
        {"sag": "strip.b.displacement.y: last", "stable": "stable: attribute"},
        bodies={"strip": "reduce-structure strip.toml -p members.bar.section.d=${d}"},
        folder=tmp_path,
    )
    table = fd.sweep(study, tmp_path / "t.nc", workers=0)
    sag, d = np.abs(table["sag"]), table["d"]
    assert (table["stable"] == 1).all()
    assert np.allclose(sag[d == 0.01] / sag[d == 0.02], 4.0, rtol=1e-3)
    assert np.allclose(sag / np.abs(table["gravity.2"]) * d**2, sag[0] / 9.81 * 1e-4, rtol=1e-3)
    damaged = next((tmp_path / "t.nc.bodies").glob("*.ffr"))
    damaged.write_bytes(damaged.read_bytes()[:500])
    ffr_dyn.studies.runs._body.cache_clear()
    said = fd.sweep(study, tmp_path / "again.nc", workers=0, cache=tmp_path / "t.nc.bodies").messages
    assert sum(bool(message) for message in said) == 2
    assert all("delete it, and the study makes it anew" in message for message in said if message)
    assert not any("ffr-prep reduce" in message for message in said)
