"""Files for other programs: what their own readers find in them."""

import json
import sys

import numpy as np
import pytest
from click.testing import CliRunner
from test_animate import pendulum_of_markers, rotating_box
from test_page import parted, second_order_box

import ffr_dyn as fd
from ffr_dyn.cli import cli
from ffr_dyn.pictures.film import displaced, drawn_points, film_at
from ffr_dyn.results.stress import values_at
from ffr_dyn.scene.stress_sensors import MEASURES
from ffr_prep.common.errors import InputError

RESULTS = {"linear": rotating_box, "second order": second_order_box, "parts": parted, "markers": pendulum_of_markers}


def places(result, row):
    """(P, 3) where all points of a result are drawn."""
    film = film_at(result, result.time)
    solids = [drawn_points(solid, row, 1.0) for solid in film.solids]
    return np.concatenate([*solids, *(link.points[row] for link in film.links)])


def array(grid, name):
    from vtkmodules.util.numpy_support import vtk_to_numpy

    return vtk_to_numpy(grid.GetPointData().GetArray(name))


def points_of(grid):
    from vtkmodules.util.numpy_support import vtk_to_numpy

    return vtk_to_numpy(grid.GetPoints().GetData())


@pytest.mark.parametrize("make", RESULTS.values(), ids=RESULTS.keys())
def test_the_reader_of_vtk_gives_the_displacements_back(make, tmp_path):
    from vtkmodules.vtkIOHDF import vtkHDFReader

    result, reader = make(), vtkHDFReader()
    reader.SetFileName(str(fd.export(result, tmp_path / "a.vtkhdf")))
    reader.UpdateInformation()
    assert reader.GetNumberOfSteps() == result.time.size
    still = None
    for row in (0, result.time.size // 2, result.time.size - 1):
        reader.SetStep(row)
        reader.Update()
        grid = reader.GetOutput()
        still = points_of(grid).copy() if still is None else still
        np.testing.assert_array_equal(points_of(grid), still)
        expected = places(result, row)
        size = np.ptp(expected, axis=0).max()
        np.testing.assert_allclose(still + array(grid, "displacement"), expected, rtol=0, atol=1e-6 * size)
        assert reader.GetTimeValue() == pytest.approx(result.time[row])


def test_stress_and_elastic_displacement_are_there(tmp_path):
    from vtkmodules.vtkIOHDF import vtkHDFReader

    result, reader = second_order_box(), vtkHDFReader()
    (solid,) = film_at(result, result.time).solids
    reader.SetFileName(str(fd.export(result, tmp_path / "a.vtkhdf")))
    reader.SetStep(5)
    reader.Update()
    elastic = displaced(solid, 5) @ solid.A[5].T
    np.testing.assert_allclose(array(reader.GetOutput(), "elastic"), elastic, rtol=0, atol=1e-6 * np.abs(elastic).max())
    stress = values_at(solid.surface, solid.q[5:6], MEASURES["von-mises"])[:, 0]
    np.testing.assert_allclose(array(reader.GetOutput(), "von_mises"), stress, rtol=1e-6)


@pytest.mark.parametrize("make", RESULTS.values(), ids=RESULTS.keys())
def test_a_collection_has_a_file_for_each_row_with_points_where_they_are(make, tmp_path):
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

    result = make()
    text = fd.export(result, tmp_path / "a.pvd").read_text()
    assert text.count("<DataSet") == result.time.size == len(list((tmp_path / "a").iterdir()))
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(sorted((tmp_path / "a").iterdir())[3]))
    reader.Update()
    np.testing.assert_allclose(points_of(reader.GetOutput()), places(result, 3), rtol=0, atol=1e-12)
    assert reader.GetOutput().GetNumberOfCells() > 0


@pytest.mark.parametrize("make", RESULTS.values(), ids=RESULTS.keys())
def test_glb_holds_the_motion(make, tmp_path):
    result = make()
    content = fd.export(result, tmp_path / "a.glb").read_bytes()
    assert content[:4] == b"glTF"
    assert np.frombuffer(content, "<u4", 2, 4).tolist() == [2, len(content)]
    length = int(np.frombuffer(content, "<u4", 1, 12)[0])
    tree, data = json.loads(content[20 : 20 + length]), content[28 + length :]

    def values(number):
        accessor = tree["accessors"][number]
        start, size = tree["bufferViews"][accessor["bufferView"]]["byteOffset"], {"SCALAR": 1, "VEC3": 3, "VEC4": 4}
        count = accessor["count"] * size[accessor["type"]]
        found = np.frombuffer(data, "<f4" if accessor["componentType"] == 5126 else "<u4", count, start)
        return found.reshape(accessor["count"], -1)

    row, animation = 4, tree["animations"][0]
    found = []
    for number, node in enumerate(tree["nodes"]):
        moving = {c["target"]["path"]: values(animation["samplers"][c["sampler"]]["output"])
                  for c in animation["channels"] if c["target"]["node"] == number}  # fmt: skip
        primitive = tree["meshes"][node["mesh"]]["primitives"][0]
        points = values(primitive["attributes"]["POSITION"]).astype(float)
        targets = [values(target["POSITION"]) for target in primitive.get("targets", [])]
        if targets:
            points += np.einsum("k,kpc->pc", moving["weights"].reshape(-1, len(targets))[row], targets)
        x, y, z, w = moving["rotation"][row]
        A = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                      [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                      [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])  # fmt: skip
        found.append(moving["translation"][row] + points @ A.T)
    if make is not pendulum_of_markers:
        expected = places(result, row)
        np.testing.assert_allclose(np.concatenate(found), expected, rtol=0, atol=1e-3 * np.ptp(expected, axis=0).max())
    assert values(animation["samplers"][0]["input"])[-1] == pytest.approx(result.time[-1] - result.time[0])


def test_matlab_and_tables_hold_the_histories(tmp_path):
    from scipy.io import loadmat

    result = rotating_box()
    mat = loadmat(fd.export(result, tmp_path / "a.mat"), simplify_cells=True)
    np.testing.assert_array_equal(mat["rod"]["tip"]["position"], result["rod.tip.position"])
    assert mat["units"]["rod"]["tip"]["position"] == "m"
    np.testing.assert_array_equal(mat["time"], result.time)
    fd.export(result, tmp_path / "a.csv", ["rod.tip.position.y"])
    read = np.loadtxt(tmp_path / "a.csv", delimiter=",", skiprows=1)
    np.testing.assert_array_equal(read, np.stack([result.time, result["rod.tip.position.y"]], axis=1))


def named(*names):
    """A result with a number of its own under each name."""
    return fd.Result(np.zeros(1), {name: fd.Quantity(np.full(1, 1.0 + k), "m") for k, name in enumerate(names)})


@pytest.mark.parametrize(
    ("names", "place"),
    [
        (("rod-1.R", "rod_1.q"), "'rod_1'"),
        (("rod-1.a.position", "rod_1"), "'rod_1'"),
        (("x" * 70, "x" * 71), f"'{'x' * 63}'"),
        (("2nd", "n2nd"), "'n2nd'"),
        (("units.R",), "'units'"),
    ],
)
def test_names_that_are_one_in_matlab_are_refused(tmp_path, names, place):
    """MATLAB's names are letters, digits and "_" (documentation of MATLAB, "Variable names"): one of two was lost."""
    with pytest.raises(InputError, match=f"would be {place} in MATLAB.*rename one in the scene"):
        fd.export(named(*names), tmp_path / "a.mat")
    assert not list(tmp_path.iterdir())


def test_matlab_gets_every_value_under_a_name_that_it_takes(tmp_path):
    """Keywords are no names (MATLAB's `iskeyword`); what has parts and a value keeps both, in whatever order."""
    from scipy.io import loadmat

    mat = loadmat(fd.export(named("end.R", "bar.q.x", "bar.q", "8.R"), tmp_path / "a.mat"), simplify_cells=True)
    assert (mat["nend"]["R"], mat["bar"]["q"]["x"]) == (1.0, 2.0)
    assert (mat["bar"]["q"]["values"], mat["n8"]["R"]) == (3.0, 4.0)
    assert mat["units"]["bar"]["q"] == {"x": "m", "values": "m"}


def test_xarray_and_pandas_hold_the_histories():
    pytest.importorskip("xarray"), pytest.importorskip("pandas")
    result = rotating_box()
    data = result.to_xarray()
    np.testing.assert_array_equal(data["rod.tip.position"].sel(xyz="y").values, result["rod.tip.position.y"])
    np.testing.assert_array_equal(data["time"], result.time)
    assert data["rod.tip.position"].attrs["units"] == "m"
    assert data["rod.q"].dims == ("time", "rod.mode")
    frame = result.to_pandas(["rod.R", "rod.tip.position.x"])
    assert list(frame.columns) == ["rod.R.x", "rod.R.y", "rod.R.z", "rod.tip.position.x"]
    np.testing.assert_array_equal(frame["rod.R.z"], result["rod.R"][:, 2])
    assert frame.attrs["units"]["rod.R.x"] == "m"
    assert frame.index.name == "time"


def test_a_missing_library_is_named(monkeypatch):
    for name in ("xarray", "pandas"):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(InputError, match="needs the package xarray, which is not installed: pip install xarray"):
        rotating_box().to_xarray()
    with pytest.raises(InputError, match="needs the package pandas"):
        rotating_box().to_pandas()


@pytest.mark.parametrize(
    ("name", "names", "message"),
    [
        ("a.stl", None, r"exported as \.vtkhdf, \.pvd, \.glb, \.mat, \.csv, not \.stl"),
        ("a.glb", ["rod.R"], r"names of quantities are of \.mat and \.csv"),
        ("a.csv", ["rod.X"], r"no quantity 'rod\.X'"),
        ("a.mat", ["rod.X"], r"no quantity 'rod\.X'"),
    ],
)
def test_what_cannot_be_exported_is_named(tmp_path, name, names, message):
    with pytest.raises(InputError, match=message):
        fd.export(rotating_box(), tmp_path / name, names)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("suffix", ["vtkhdf", "pvd", "glb"])
def test_results_without_motion_are_answered_by_what_they_hold(tmp_path, suffix):
    """A response was told to run its scene with other outputs, which it does not have."""
    gain = fd.Quantity(np.ones(2), "m/N")
    result = fd.Result(np.zeros(2), {"frequency": gain, "gain": gain}, {}, {"analysis": "frequency response"})
    with pytest.raises(InputError, match=r"'frequency response' has no motion .*as \.csv or \.mat: frequency, gain"):
        fd.export(result, tmp_path / f"a.{suffix}")


def test_the_command_exports(tmp_path):
    path = fd.save_result(rotating_box(), tmp_path / "r.nc")
    for suffix in ("vtkhdf", "pvd", "glb", "mat", "csv"):
        done = CliRunner().invoke(cli, ["export", str(path), "-o", str(tmp_path / f"a.{suffix}")])
        assert done.exit_code == 0, done.output
        assert (tmp_path / f"a.{suffix}").exists()
    some = CliRunner().invoke(cli, ["export", str(path), "rod.*.position", "-o", str(tmp_path / "b.csv")])
    assert some.exit_code == 0
    assert (tmp_path / "b.csv").read_text().splitlines()[0].count(",") == 3
    with pytest.raises(InputError, match="it is written as"):
        CliRunner().invoke(cli, ["export", str(path), "-o", str(tmp_path / "a.stl")], catch_exceptions=False)
