"""Plots: the curves are the numbers of the result, in units that people read, and the files are whole."""

import subprocess
import sys

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from PIL import Image

from ffr_dyn.pictures.histories import PALETTE, plot, plot_path
from ffr_dyn.results.result import XYZ, Quantity, Result
from ffr_prep.common.errors import InputError
from ffr_prep.common.units import bracketed, readable

T = np.linspace(0.0, 0.02, 41)


@pytest.fixture
def result():
    circle = 0.003 * np.stack([np.cos(300 * T), np.sin(300 * T), 0 * T], axis=1)
    quantities = {
        "rod.eye.position": Quantity(circle, "m", (XYZ,)),
        "rod.eye.velocity": Quantity(300 * circle, "m/s", (XYZ,)),
        "bearing.force": Quantity(4e7 * circle, "N", (XYZ,)),
        "bearing.angle": Quantity(300 * T, "rad"),
        "energy.kinetic": Quantity(3 + np.cos(300 * T), "J"),
        "energy.strain": Quantity(1 - np.cos(300 * T), "J"),
    }
    return Result(T, quantities)


@pytest.fixture
def figures(monkeypatch):
    """The figures as they are when they are written."""
    written = []
    save = Figure.savefig

    def remember(figure, *args, **kwargs):
        written.append(figure)
        save(figure, *args, **kwargs)

    monkeypatch.setattr(Figure, "savefig", remember)
    return written


# ---- units --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("unit", "largest", "factor", "shown"),
    [
        ("m", 0.0032, 1e3, "mm"),
        ("m", 3.2e-7, 1e9, "nm"),
        ("m", 0.32, 1, "m"),
        ("m", 9999.0, 1, "m"),
        ("N", -4.5e4, 1e-3, "kN"),
        ("N m", 4.5e7, 1e-6, "MN m"),
        ("Pa", 2.1e11, 1e-9, "GPa"),
        ("s", 0.02, 1e3, "ms"),
        ("m/s", 0.02, 1e3, "mm/s"),
        ("m/s^2", 2e4, 1e-3, "km/s²"),
        ("m sqrt(kg)", 0.02, 1e3, "mm √kg"),
        ("m^2", 0.02, 1, "m²"),
        ("rad", 0.02, 1, "rad"),
        ("kg", 1e6, 1, "kg"),
        ("1", 1e-9, 1, ""),
        ("m", 0.0, 1, "m"),
        ("m", np.inf, 1, "m"),
        ("m", np.nan, 1, "m"),
        ("m", 1e-30, 1e9, "nm"),
    ],
)
def test_units_are_chosen_for_reading(unit, largest, factor, shown):
    assert readable(unit, largest) == (pytest.approx(factor, rel=1e-12), shown)


def test_a_number_has_no_brackets():
    assert bracketed("ratio", "") == "ratio"
    assert bracketed("", "mm") == "[mm]"


# ---- histories ----------------------------------------------------------------------------------------------------


def test_curves_are_the_numbers_in_one_panel_for_each_unit(result, figures, tmp_path):
    plot(result, ["rod.eye.position", "bearing.force.y", "energy.kinetic", "energy.strain"], tmp_path / "a.png")
    panels = figures[0].get_axes()
    assert [axes.get_ylabel() for axes in panels] == ["position [mm]", "force [kN]", "energy [J]"]
    assert panels[-1].get_xlabel() == "time [ms]"
    position, force, energy = (axes.get_lines() for axes in panels)
    assert [line.get_label() for line in position] == [f"rod.eye.position.{letter}" for letter in "xyz"]
    for k, line in enumerate(position):
        np.testing.assert_allclose(line.get_xdata(), 1e3 * T, rtol=1e-12)
        np.testing.assert_allclose(line.get_ydata(), 1e3 * result["rod.eye.position"][:, k], rtol=1e-12)
    np.testing.assert_allclose(force[0].get_ydata(), 1e-3 * result["bearing.force.y"], rtol=1e-12)
    np.testing.assert_array_equal(energy[1].get_ydata(), result["energy.strain"])


def test_one_name_needs_no_list_and_another_abscissa_may_be_given(result, figures, tmp_path):
    plot(result, "bearing.force.x", tmp_path / "a.svg", against="bearing.angle", title="Bearing")
    (axes,) = figures[0].get_axes()
    assert axes.get_xlabel() == "bearing.angle [rad]"
    np.testing.assert_array_equal(axes.get_lines()[0].get_xdata(), result["bearing.angle"])
    assert figures[0].get_suptitle() == "Bearing"


def test_the_legend_lies_beside_the_curves(result, figures, tmp_path):
    plot(result, ["rod.eye.position", "bearing.force"], tmp_path / "a.png")
    for axes in figures[0].get_axes():
        assert axes.get_legend().get_window_extent().x0 >= axes.get_window_extent().x1
        assert axes.get_legend().get_window_extent().x1 <= figures[0].bbox.x1


@pytest.mark.slow
def test_many_curves_differ_in_colour_or_style(figures, tmp_path):
    many = Result(T, {f"body_{k}.x": Quantity(k + T, "m") for k in range(3 * len(PALETTE))})
    plot(many, list(many.quantities), tmp_path / "a.png")
    looks = {(line.get_color(), line.get_linestyle()) for line in figures[0].get_axes()[0].get_lines()}
    assert len(looks) == 3 * len(PALETTE)


def test_a_single_time_and_gaps_are_drawn(figures, tmp_path):
    plot(Result([1.0], {"a": Quantity([2.0], "m")}), "a", tmp_path / "a.png")
    assert figures[0].get_axes()[0].get_lines()[0].get_marker() == "o"
    values = np.where(T > 0.01, np.nan, 0.004)
    plot(Result(T, {"a": Quantity(values, "m")}), "a", tmp_path / "a.png")
    assert figures[1].get_axes()[0].get_ylabel() == "a [mm]"


# ---- paths --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("plane", "columns"), [("xy", [0, 1]), ("zx", [2, 0])])
def test_a_path_shows_two_coordinates_to_one_scale(result, figures, tmp_path, plane, columns):
    plot_path(result, "rod.eye", tmp_path / "a.png", plane=plane)
    axes = figures[0].get_axes()[0]
    (line,) = (part for part in axes.collections if isinstance(part, LineCollection))
    starts = np.array([segment[0] for segment in line.get_segments()])
    np.testing.assert_allclose(starts, 1e3 * result["rod.eye.position"][:-1, columns], atol=1e-12)
    assert (axes.get_xlabel(), axes.get_ylabel()) == (f"{plane[0]} [mm]", f"{plane[1]} [mm]")
    assert axes.get_aspect() == 1.0


def test_a_marker_at_rest_has_a_path(tmp_path):
    still = Result(T, {"a.position": Quantity(np.ones((41, 3)), "m", (XYZ,))})
    plot_path(still, "a", tmp_path / "a.png")
    assert (tmp_path / "a.png").exists()


def test_without_a_path_a_figure_is_returned_that_notebooks_show(result):
    for figure in (plot(result, "rod.eye.position"), plot_path(result, "rod.eye")):
        assert figure.axes
        assert figure._repr_png_().startswith(b"\x89PNG")


# ---- files --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf"])
def test_the_same_result_makes_the_same_bytes(result, tmp_path, suffix):
    paths = tmp_path / "new" / f"a{suffix}", tmp_path / f"b{suffix}"
    for path in paths:
        plot(result, "rod.eye.position", path)
    first = paths[0].read_bytes()
    assert first == paths[1].read_bytes()
    assert first.startswith({".png": b"\x89PNG", ".svg": b"<?xml", ".pdf": b"%PDF"}[suffix])


def test_pictures_are_large_and_not_empty(result, tmp_path):
    plot_path(result, "rod.eye", tmp_path / "a.png")
    image = Image.open(tmp_path / "a.png").convert("RGB")
    assert min(image.size) >= 800
    assert len(image.getcolors(1 << 20)) > 100


def test_a_failed_plot_leaves_the_old_picture(result, tmp_path, monkeypatch):
    path = tmp_path / "a.png"
    plot(result, "energy.kinetic", path)
    before = path.read_bytes()

    def fail(*_, **__):
        raise MemoryError

    monkeypatch.setattr(Axes, "draw", fail)
    with pytest.raises(MemoryError):
        plot(result, "energy.strain", path)
    assert path.read_bytes() == before


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda r, d: plot(r, "rod.eye.positon", d / "a.png"), "did you mean rod.eye.position"),
        (lambda r, d: plot(r, [], d / "a.png"), "nothing to plot: 0 quantities"),
        (lambda r, d: plot(Result([], {"a": Quantity([], "m")}), "a", d / "a.png"), "at 0 times"),
        (lambda r, d: plot(r, "rod.eye.position", d / "a.bmp"), r"a\.bmp: pictures are written as \.png"),
        (lambda r, d: plot(r, "bearing.angle", d / "a.png", against="rod.eye.position"), "one component, not"),
        (lambda r, d: plot_path(r, "rod.eye", d / "a.png", plane="xx"), "plane 'xx'"),
        (lambda r, d: plot_path(r, "rod.eye", d / "a.png", plane="xyz"), "plane 'xyz'"),
        (lambda r, d: plot_path(r, "rod.ear", d / "a.png"), r"did you mean .*rod\.eye\.position"),
        (
            lambda r, d: plot_path(
                Result([], {"a.position": Quantity(np.zeros((0, 3)), "m", (XYZ,))}), "a", d / "a.png"
            ),
            "0 times",
        ),
    ],
)
def test_what_cannot_be_plotted_is_named(result, tmp_path, call, message):
    with pytest.raises(InputError, match=message):
        call(result, tmp_path)
    assert not list(tmp_path.iterdir())


def test_plots_leave_pyplot_alone():
    code = "import sys, ffr_dyn.pictures.histories; sys.exit('matplotlib.pyplot' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
