"""The result type, its file, and what is left of it after a kill."""

import csv
import multiprocessing
import os
import shutil
import subprocess
import sys
import time
from itertools import pairwise
from pathlib import Path

import h5netcdf
import h5py
import numpy as np
import pytest
from places import ROOT, TESTS

from ffr_dyn.results import file as result_file
from ffr_dyn.results.file import ResultWriter, load_result, save_result
from ffr_dyn.results.quantities import like
from ffr_dyn.results.result import EULER_PARAMETERS, XYZ, Axis, Quantity, Result, mode_axis, table, write_csv
from ffr_prep.body import Surface
from ffr_prep.common.errors import ComputationError, InputError


def history(name, times):
    """A value for every quantity, so that a file can be checked from its times alone."""
    return np.stack([np.sin((k + 1) * times + len(name)) for k in range(3)], axis=-1)


def sample(rows=7, **attributes):
    t = np.linspace(0.0, 0.6, rows)
    rng = np.random.default_rng(3)
    quantities = {
        "rod.R": Quantity(history("rod.R", t), "m", (XYZ,), "origin of the body frame"),
        "rod.p": Quantity(rng.normal(size=(rows, 4)), "1", (EULER_PARAMETERS,), "Euler parameters"),
        "rod.q": Quantity(rng.normal(size=(rows, 2)), "m sqrt(kg)", (mode_axis("rod", 2),), "elastic coordinates"),
        "rod.small_eye.position": Quantity(history("eye", t), "m", (XYZ,)),
        "rod.tip stress Ω": Quantity(rng.normal(size=(rows, 3, 2)), "Pa", (XYZ, Axis("place", ("root", "tip")))),
        "energy.total": Quantity(np.cos(t), "J", (), "total energy"),
    }
    surface = Surface(rng.normal(size=(4, 3)), [[0, 1, 2], [0, 2, 3]], rng.normal(size=(4, 3, 2)))
    rigid = Surface(rng.normal(size=(3, 3)), [[0, 1, 2]], np.zeros((3, 3, 0)))
    return Result(t, quantities, {"rod": surface, "slider 1": rigid}, {"title": "test", **attributes})


def assert_same(a, b):
    np.testing.assert_array_equal(a.time, b.time)
    assert list(a.quantities) == list(b.quantities)
    for name, quantity in a.quantities.items():
        other = b.quantities[name]
        np.testing.assert_array_equal(quantity.values, other.values)
        assert (quantity.unit, quantity.axes, quantity.description) == (other.unit, other.axes, other.description)
    assert list(a.geometry) == list(b.geometry)
    for name, surface in a.geometry.items():
        for key in ("points", "triangles", "Phi"):
            np.testing.assert_array_equal(getattr(surface, key), getattr(b.geometry[name], key))


# ---- names --------------------------------------------------------------------------------------------------------


def test_a_component_is_a_column_of_its_quantity():
    result = sample()
    assert result["rod.small_eye.position"].shape == (7, 3)
    for k, label in enumerate("xyz"):
        np.testing.assert_array_equal(result[f"rod.small_eye.position.{label}"], result["rod.small_eye.position"][:, k])
    np.testing.assert_array_equal(result["rod.q.2"], result["rod.q"][:, 1])
    stress = result["rod.tip stress Ω"]
    np.testing.assert_array_equal(result["rod.tip stress Ω.y.tip"], stress[:, 1, 1])
    np.testing.assert_array_equal(result["rod.tip stress Ω.y"], stress[:, 1])
    assert result.quantity("rod.tip stress Ω.y.tip").unit == "Pa"


def test_a_result_is_asked_for_names():
    result = sample()
    assert list(result) == list(result.quantities)
    assert "rod.q" in result
    assert "rod.q.2" in result
    assert "rod.q.x" not in result
    assert 1 not in result


def test_an_unknown_name_suggests_close_ones():
    with pytest.raises(InputError, match=r"rod\.smal_eye\.position.*did you mean rod\.small_eye\.position"):
        sample()["rod.smal_eye.position"]
    with pytest.raises(InputError, match=r"did you mean .*rod\.R\.x"):
        sample()["rod.R.w"]
    with pytest.raises(InputError, match=r"there are: rod\.R, rod\.p"):
        sample()["?"]
    with pytest.raises(InputError, match=r"did you mean spring\.tension\?"):
        Result(np.zeros(1), {"spring.tension": Quantity(np.zeros(1), "N")})["spring.tensoin"]


def test_a_result_cannot_be_changed():
    result = sample()
    for values in (result.time, result["rod.R"], result["rod.R.x"]):
        with pytest.raises(ValueError, match="read-only"):
            values[0] = 1.0


def test_later_changes_of_the_source_do_not_reach_a_quantity():
    source = np.zeros((2, 3))
    view = source.view()
    view.setflags(write=False)
    quantity = Quantity(view, "m", (XYZ,))
    source[:] = 1.0
    assert not quantity.values.any()


def test_table_and_csv_hold_every_component(tmp_path):
    result = sample()
    headings, rows = table(result, ["energy.total", "rod.R", "rod.q.1"])
    assert headings == (
        "time [s]",
        "energy.total [J]",
        "rod.R.x [m]",
        "rod.R.y [m]",
        "rod.R.z [m]",
        "rod.q.1 [m sqrt(kg)]",
    )
    np.testing.assert_array_equal(rows[:, 3], result["rod.R.y"])
    path = write_csv(result, tmp_path / "out" / "table.csv")
    with open(path, newline="", encoding="utf-8") as stream:
        lines = list(csv.reader(stream))
    assert lines[0] == list(table(result)[0])
    np.testing.assert_array_equal(np.array(lines[1:], dtype=float), table(result)[1])


T3 = np.arange(3.0)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Quantity(np.zeros((3, 2)), "m", (XYZ,)), r"shape \(3, 2\)"),
        (lambda: Quantity(np.zeros(()), "m"), r"shape \(\)"),
        (lambda: Axis("xyz", ("x", "x")), "unique"),
        (lambda: Axis("xyz", ()), "at least one"),
        (lambda: Axis("xyz", ("a.b",)), "dot"),
        (lambda: Axis("a/b", ("x",)), "cannot be used"),
        (lambda: Result(T3, {"a": Quantity(np.zeros(2), "m")}), "has 2 rows, time has 3"),
        (lambda: Result(T3[::-1], {}), "decreases from 2 s to 1 s at row 1"),
        (lambda: Result([0.0, np.nan], {}), "not finite"),
        (lambda: Result(np.zeros((2, 1)), {}), "shape"),
        (lambda: Result(T3, {"a/b": Quantity(T3, "m")}), "'a/b' cannot be used"),
        (lambda: Result(T3, {"time": Quantity(T3, "m")}), "'time' cannot be used"),
        (lambda: Result(T3, {"xyz": Quantity(np.zeros((3, 3)), "m", (XYZ,))}), "both a quantity and an axis"),
        (lambda: Result(T3, {}, {"a/b": Surface(np.eye(3), [[0, 1, 2]], np.zeros((3, 3, 0)))}), "'a/b'"),
        (lambda: Result(T3, {}, {}, {"f": np.sin}), "'f' is not a plain JSON value"),
        (
            lambda: Result(
                T3,
                {
                    "a": Quantity(np.zeros((3, 1)), "m", (Axis("k", ("1",)),)),
                    "b": Quantity(np.zeros((3, 2)), "m", (Axis("k", ("1", "2")),)),
                },
            ),
            "other labels",
        ),
    ],
)
def test_contradictions_are_refused(make, message):
    with pytest.raises(InputError, match=message):
        make()


# ---- the file -----------------------------------------------------------------------------------------------------

STRANGE = {"nested": {"a": [1, 2.5, None, True]}, "flag": False, "nul": "a\0b", "big": 1 << 70, "empty": "", "ü": "é\n"}


def test_a_result_survives_its_file(tmp_path):
    result = sample(step=1e-3, count=12, scene="x" * 100_000, **STRANGE)
    loaded = load_result(save_result(result, tmp_path / "new" / "run.nc"))
    assert_same(result, loaded)
    assert loaded.attributes.items() >= result.attributes.items()
    assert all(type(loaded.attributes[key]) is type(value) for key, value in result.attributes.items())
    assert loaded.attributes["status"] == "complete"
    assert os.listdir(tmp_path / "new") == ["run.nc"]
    again = load_result(save_result(loaded, tmp_path / "again.nc"))
    assert again.attributes == loaded.attributes


def test_a_result_without_rows_or_geometry_survives_its_file(tmp_path):
    empty = Result(np.zeros(0), {"a": Quantity(np.zeros(0), "m")})
    assert_same(empty, load_result(save_result(empty, tmp_path / "empty.nc")))


def test_special_values_survive(tmp_path):
    values = [np.nan, np.inf, -np.inf, -0.0, 5e-324]
    result = Result(np.arange(5.0), {"a": Quantity(values, "m")})
    loaded = load_result(save_result(result, tmp_path / "a.nc"))
    assert loaded["a"].tobytes() == np.array(values).tobytes()


def test_another_netcdf_reader_sees_names_units_and_dimensions(tmp_path):
    result = sample()
    with h5netcdf.File(save_result(result, tmp_path / "run.nc"), "r", decode_vlen_strings=True) as file:
        assert file.dimensions["time"].isunlimited()
        assert file.dimensions["time"].size == 7
        assert file["time"].attrs["units"] == "s"
        eye = file["rod.small_eye.position"]
        assert eye.dimensions == ("time", "xyz")
        assert eye.attrs["units"] == "m"
        np.testing.assert_array_equal(eye[...], result["rod.small_eye.position"])
        assert list(file["xyz"][...]) == ["x", "y", "z"]
        assert file["rod.q"].dimensions == ("time", "rod.mode")
        assert list(file["rod.mode"][...]) == ["1", "2"]
        assert file["rod.R"].attrs["long_name"] == "origin of the body frame"
        assert file.attrs["Conventions"] == "CF-1.11"
        assert file.attrs["source"].startswith("ffr_dyn")
        assert file["geometry/rod/Phi"].dimensions == ("point", "xyz", "mode")


def test_missing_foreign_and_newer_files_are_named(tmp_path):
    with pytest.raises(InputError, match=r"none\.nc does not exist"):
        load_result(tmp_path / "none.nc")
    text = tmp_path / "text.nc"
    text.write_text("hello")
    with pytest.raises(InputError, match=r"text\.nc is damaged, truncated or not a result file"):
        load_result(text)
    with h5py.File(tmp_path / "foreign.nc", "w") as file:
        file["a"] = 1.0
    with pytest.raises(InputError, match=r"foreign\.nc is not a result file"):
        load_result(tmp_path / "foreign.nc")
    newer = save_result(sample(), tmp_path / "newer.nc")
    with h5py.File(newer, "r+") as file:
        file.attrs["ffr_format_version"] = 2
    with pytest.raises(InputError, match="format 2, this program reads up to 1"):
        load_result(newer)
    with h5py.File(newer, "r+") as file:
        file.attrs["ffr_format_version"] = 1
        del file["time"]
    with pytest.raises(InputError, match="damaged"):
        load_result(newer)


def test_truncated_files_are_refused(tmp_path):
    whole = save_result(sample(), tmp_path / "whole.nc").read_bytes()
    cut = tmp_path / "cut.nc"
    for length in np.linspace(0, len(whole) - 1, 40).astype(int):
        cut.write_bytes(whole[:length])
        with pytest.raises(InputError, match=r"cut\.nc is damaged"):
            load_result(cut)


def test_a_damaged_history_is_never_a_wrong_number(tmp_path):
    result = sample()
    whole = save_result(result, tmp_path / "whole.nc").read_bytes()
    damaged = tmp_path / "damaged.nc"
    for name in ("rod.R", "energy.total", "rod.tip stress Ω"):
        at = whole.index(result[name].tobytes())
        for offset in (0, 5, result[name].nbytes - 1):
            content = bytearray(whole)
            content[at + offset] ^= 0x10
            damaged.write_bytes(content)
            with pytest.raises(InputError, match=r"damaged\.nc is damaged"):
                load_result(damaged)


# ---- long runs ----------------------------------------------------------------------------------------------------

STREAMED = ("a.position", "b.velocity")


def header(times=np.zeros(0)):  # noqa: B008 - not changed
    return Result(times, {name: Quantity(history(name, times), "m", (XYZ,)) for name in STREAMED})


def rows(times):
    return {name: history(name, times) for name in STREAMED}


def assert_streamed(result):
    """Every row is the one its time asks for, and no row is missing."""
    np.testing.assert_array_equal(result.time, 1e-3 * np.arange(result.time.size))
    for name in STREAMED:
        np.testing.assert_array_equal(result[name], history(name, result.time))


def chunks(sizes):
    ends = np.cumsum([0, *sizes])
    return [1e-3 * np.arange(a, b) for a, b in pairwise(ends)]


def test_rows_in_chunks_make_the_same_file_as_all_at_once(tmp_path):
    with ResultWriter(tmp_path / "run.nc", header()) as writer:
        for k, times in enumerate(chunks([1, 1, 700, 3, 0, 1200])):
            writer.append(times, rows(times))
            if k % 2:
                writer.flush()
                assert load_result(tmp_path / "run.nc").attributes["status"] == "running"
    streamed = load_result(tmp_path / "run.nc")
    assert streamed.time.size == 1905
    assert_streamed(streamed)
    assert streamed.attributes["status"] == "complete"
    assert_same(streamed, load_result(save_result(header(streamed.time), tmp_path / "once.nc")))
    assert sorted(os.listdir(tmp_path)) == ["once.nc", "run.nc"]


def test_a_full_buffer_reaches_the_working_file_not_the_result(tmp_path, monkeypatch):
    monkeypatch.setattr(result_file, "_BUFFER_BYTES", 1000)
    writer = ResultWriter(tmp_path / "run.nc", header(), interval=1e9)
    for times in chunks([40] * 5):
        writer.append(times, rows(times))
    assert writer._rows == 200
    assert os.listdir(tmp_path) == ["run.nc.part"]
    writer.close()
    assert_streamed(load_result(tmp_path / "run.nc"))


def test_flushes_are_spaced_by_the_clock_and_by_their_cost(tmp_path, monkeypatch):
    clock = iter(np.arange(0.0, 1e4, 1.0))
    now = [0.0]

    def tick():
        now[0] = next(clock)
        return now[0]

    monkeypatch.setattr(result_file.time, "monotonic", tick)
    published = []
    monkeypatch.setattr(result_file.os, "replace", lambda a, b: published.append((now[0], shutil.move(a, b))[0]))
    writer = ResultWriter(tmp_path / "run.nc", header(), interval=10.0, share=0.02)
    for times in chunks([1] * 300):
        writer.append(times, rows(times))
    # A flush takes one tick here, so 1 / 0.02 = 50 ticks must pass after it; the first may come after the interval.
    assert published[0] < 15
    assert set(np.diff(published)) == {52.0}
    writer.close()


def test_a_run_is_continued_from_its_file(tmp_path):
    path = tmp_path / "run.nc"
    first, second = chunks([10, 20])
    with ResultWriter(path, header()) as writer:
        writer.append(first, rows(first))
    with ResultWriter(path, load_result(path)) as writer:
        writer.append(second, rows(second))
    assert load_result(path).time.size == 30
    assert_streamed(load_result(path))


def fail_after(path, times):
    with ResultWriter(path, header()) as writer:
        writer.append(times, rows(times))
        raise ComputationError("the sky fell at t = 1 s")


def test_a_stopped_run_keeps_its_rows_and_its_reason(tmp_path):
    with pytest.raises(ComputationError):
        fail_after(tmp_path / "run.nc", *chunks([4]))
    loaded = load_result(tmp_path / "run.nc")
    assert loaded.attributes["status"] == "stopped: the sky fell at t = 1 s"
    assert loaded.time.size == 4


def fail_at_once(path):
    with ResultWriter(path, header()):
        raise KeyboardInterrupt


def test_a_run_that_stops_before_its_first_row_leaves_the_old_file(tmp_path):
    path = save_result(sample(), tmp_path / "run.nc")
    with pytest.raises(KeyboardInterrupt):
        fail_at_once(path)
    assert_same(sample(), load_result(path))
    assert os.listdir(tmp_path) == ["run.nc"]


def test_rows_that_do_not_fit_the_header_are_refused(tmp_path):
    (times,) = chunks([3])
    with ResultWriter(tmp_path / "run.nc", header()) as writer:
        writer.append(times, rows(times))
        with pytest.raises(InputError, match="decreases"):
            writer.append(times[:1], rows(times[:1]))
        with pytest.raises(InputError, match=r"b\.velocity"):
            writer.append(times + 1, {"a.position": history("a.position", times)})
        with pytest.raises(InputError, match=r"shape \(2, 3\), not \(3, 3\)"):
            writer.append(times + 1, {name: values[:2] for name, values in rows(times).items()})
    assert_streamed(load_result(tmp_path / "run.nc"))


def test_places_that_cannot_be_written_are_named(tmp_path):
    (tmp_path / "dir.nc").mkdir()
    with pytest.raises(InputError, match=r"dir\.nc is a folder"):
        save_result(sample(), tmp_path / "dir.nc")
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written"):
        save_result(sample(), tmp_path / "file" / "run.nc")
    with ResultWriter(tmp_path / "run.nc", header()), pytest.raises(InputError, match="end the other run"):
        ResultWriter(tmp_path / "run.nc", header())


@pytest.mark.parametrize("stage", ["copyfile", "_sync", "replace"])
def test_a_failing_disk_leaves_the_last_flush_at_least(tmp_path, monkeypatch, stage):
    def fail(*_):
        raise OSError(28, "No space left on device")

    path = tmp_path / "run.nc"
    first, second = chunks([5, 5])
    writer = ResultWriter(path, header())
    writer.append(first, rows(first))
    writer.flush()
    writer.append(second, rows(second))
    owner = {"copyfile": result_file.shutil, "_sync": result_file, "replace": result_file.os}[stage]
    monkeypatch.setattr(owner, stage, fail)
    with pytest.raises(ComputationError, match=r"run\.nc failed .*No space left.*free space"):
        writer.flush()
    if stage == "copyfile":
        writer.close()
    else:
        with pytest.raises(ComputationError, match="No space left"):
            writer.close()
    assert load_result(path).time.size == (10 if stage == "copyfile" else 5)
    assert_streamed(load_result(path))


def write_for_ever(path, acknowledged):
    """Rows in chunks of changing length, a flush after each; the number of flushed rows goes to the parent."""
    writer = ResultWriter(path, header(), interval=0.0, share=1e9)
    size = np.random.default_rng(1).integers(1, 400, size=100_000)
    end = 0
    for k in size:
        times = 1e-3 * np.arange(end, end + k)
        end += k
        writer.append(times, rows(times))
        acknowledged.send(int(end))


def kill_one_run(context, path, delay):
    receiving, sending = context.Pipe(duplex=False)
    process = context.Process(target=write_for_ever, args=(path, sending), daemon=True)
    process.start()
    sending.close()
    receiving.poll(10)  # the run has begun: its first flush is acknowledged
    time.sleep(delay)
    process.kill()
    process.join()
    flushed = 0
    try:
        while receiving.poll():
            flushed = receiving.recv()
    except EOFError:
        pass
    assert process.exitcode == -9
    return flushed


@pytest.mark.parametrize("kills", [8, pytest.param(150, marks=pytest.mark.slow)])
def test_a_killed_run_leaves_every_flushed_row(tmp_path, kills):
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([__name__])
    path = tmp_path / "run.nc"
    lengths = set()
    for number, delay in enumerate(np.random.default_rng(7).uniform(0.0, 0.15, size=10 * kills)):
        if number >= kills and len(lengths) > 4:
            break
        flushed = kill_one_run(context, path, delay)
        loaded = load_result(path)
        assert_streamed(loaded)
        assert loaded.time.size >= flushed > 0
        lengths.add(loaded.time.size)
    assert len(lengths) > 4  # the kills fell at different moments


def test_a_kill_before_the_first_flush_leaves_the_old_file(tmp_path):
    path = save_result(sample(), tmp_path / "run.nc")
    code = (
        "import os, signal, sys, test_result as t\n"
        "writer = t.ResultWriter(sys.argv[1], t.header(), interval=1e9)\n"
        "for times in t.chunks([5000] * 40): writer.append(times, t.rows(times))\n"
        "os.kill(os.getpid(), signal.SIGKILL)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, path],
        cwd=Path(__file__).parent,
        env=os.environ | {"PYTHONPATH": os.pathsep.join((str(ROOT), str(TESTS)))},
        check=False,
    )
    assert done.returncode == -9
    assert_same(sample(), load_result(path))
    with ResultWriter(path, header()) as writer:
        writer.append(*next((times, rows(times)) for times in chunks([3])))
    assert_streamed(load_result(path))
    assert os.listdir(tmp_path) == ["run.nc"]


def test_results_need_no_plotting_library():
    code = (
        "import sys, ffr_dyn, ffr_dyn.results.result, ffr_dyn.results.file\n"
        "heavy = {'matplotlib', 'pyvista', 'vtk', 'vtkmodules', 'plotly', 'pandas', 'scipy', 'PIL'}\n"
        "sys.exit(str(heavy & sys.modules.keys()) if heavy & sys.modules.keys() else 0)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_a_name_that_nothing_has_is_answered_by_what_is_near_and_not_by_everything():
    names = [f"{body}.{what}" for body in ("rod", "crank") for what in ("R", "p", "q")]
    assert like("rod.Q", names, 0.6) == "did you mean rod.q, rod.p, rod.R?"
    assert like("rod.displacement", names, 0.6) == "of 'rod' there are: rod.R, rod.p, rod.q"
    assert like("measured.*", names, 0.6) == "there are: rod.*, crank.*; `ffr-dyn info` lists those of a result"
