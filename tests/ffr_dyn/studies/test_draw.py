"""Pictures of studies whose numbers are unusual: equal ones, words, parameters that vary together, rows of no time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.tri import LinearTriInterpolator

from ffr_dyn.pictures import histories
from ffr_dyn.studies.draw import likely_errors, plot_study, running_mean, tornado, triangulated
from ffr_dyn.studies.table import Table

X = np.linspace(0.0, 1.0, 6)


@pytest.fixture
def drawn(monkeypatch, tmp_path):
    """What is drawn of a table: the axes of each picture, by its name."""
    found: dict[str, Any] = {}
    monkeypatch.setattr(histories, "_write", lambda figure, path: found.update({Path(path).name: figure.axes}))

    def of(parameters: dict[str, Any], outputs: dict[str, Any]) -> dict[str, Any]:
        plot_study(Table(parameters, outputs, ("",) * X.size), tmp_path)
        return found

    return of


def test_an_output_that_is_equal_in_all_runs_changes_with_nothing(drawn):
    y = np.full(6, 0.1)
    assert y.mean() != 0.1  # by rounding
    changes, _ = tornado({"a": X, "b": X[::-1] ** 2}, y)
    assert changes == {"a": 0.0, "b": 0.0}
    found = drawn({"a": X, "b": X[::-1] ** 2}, {"y": y})
    assert "y-surface.png" not in found
    assert found["y-tornado.png"][0].get_title() == "y is equal in all 6 runs"
    low, high = found["y-mean.png"][1].get_xlim()
    assert 0.09 < low < 0.1 < high < 0.11


def test_words_have_boxes_and_no_slopes(drawn):
    found = drawn({"material": ["steel", "brass", "steel"] * 2, "a": X}, {"y": X**2})
    assert [axes.get_xlabel() for axes in found["y.png"]] == ["a", "material"]
    assert [text.get_text() for text in found["y.png"][1].get_xticklabels()] == ["brass", "steel"]
    assert [text.get_text() for text in found["y-tornado.png"][0].get_yticklabels()] == ["a"]


def test_words_alone_are_drawn(drawn):
    rows = np.outer(X, np.ones(3))
    found = drawn({"material": list("abcdef")}, {"y": X, "h": rows, "time": np.tile(np.arange(3.0), (6, 1))})
    assert set(found) == {"y.png", "y-mean.png", "h.png"}
    assert found["h.png"][0].get_xlabel() == "time [s]"


def test_parameters_that_vary_together_are_told(drawn):
    assert "cannot tell them apart" in drawn({"a": X, "b": 2 * X}, {"y": X})["y-tornado.png"][0].get_title()
    assert "apart" not in drawn({"a": X, "b": X**2}, {"y": X})["y-tornado.png"][0].get_title()


def test_rows_without_a_time_are_drawn_over_their_numbers(drawn):
    rows = np.outer(1 + X, np.arange(4.0))
    rows[:, 0] = np.nan
    axes = drawn({"a": X}, {"h": rows, "time": np.zeros((6, 4))})["h.png"][0]
    assert axes.get_xlabel() == "row"
    assert len(axes.collections[0].get_segments()) == 6
    assert axes.get_xlim()[1] > 3.9


@pytest.mark.parametrize("scale", [1.0, 1e11, 1e-9])
def test_a_surface_is_as_near_whatever_the_units_of_its_parameters(scale):
    """Between points it is linear: of 2 a + b its values are those of the function, in any units. Of 1 / (E d^4) with E in Pa
    and d in m the error was five times as large, as neighbours were those in E alone."""
    random = np.random.default_rng(0)
    a, b = random.uniform(1.9, 2.1, 60), random.uniform(5e-3, 7e-3, 60)
    inner = np.column_stack([random.uniform(1.93, 2.07, 400), random.uniform(5.3e-3, 6.7e-3, 400)])
    law = lambda a, b: (6e-3 / b) ** 4 * 2.0 / a  # noqa: E731
    surface = LinearTriInterpolator(triangulated(np.column_stack([scale * a, b])), law(a, b))
    off = surface(scale * inner[:, 0], inner[:, 1]) - law(*inner.T)
    assert np.abs(off).mean() < 0.012


@pytest.mark.parametrize(
    ("a", "y"),
    [
        (1e17 * (1 + X), 1e17 + X),
        (1e17 + 16 * np.arange(6), 1e17 + 16 * np.arange(6)),
        (5 + 1e-9 * X, 1e-9 * X),
        (X, 1e-6 * X + 1e12 * (X == 1)),
    ],
)
def test_values_of_any_size_are_drawn(drawn, a, y):
    """Qhull and the bins of histograms fail where ranges are rounding beside values, or one value is far from the others."""
    found = drawn({"a": a, "b": X**2}, {"y": y})
    assert {"y.png", "y-mean.png", "y-tornado.png", "pairs.png"} <= found.keys()


def test_names_are_no_formulas_of_matplotlib(drawn):
    axes = drawn({"a$^{": X}, {"$ _{ $": X})["$ _{ $.png"][0]
    assert not is_math_text(axes.get_xlabel())
    assert not is_math_text(axes.figure.get_supylabel())


def is_math_text(text):
    """Whether matplotlib may take a text for a formula (`matplotlib.cbook`): it has a "$" without a backslash."""
    return text.count("$") > text.count(r"\$")


@pytest.mark.parametrize("count", [2, 3, 5, 20])
def test_the_mean_lies_in_its_band_nineteen_times_of_twenty(count):
    """However few runs there are: of two, the normal quantile would hold seven of ten."""
    samples = np.random.default_rng(1).normal(3.0, 2.0, (4000, count))
    ends = [running_mean(y) for y in samples]
    inside = [abs(mean[-1] - 3.0) < error[-1] * likely_errors(number)[-1] for number, mean, error in ends]
    assert np.mean(inside) == pytest.approx(0.95, abs=0.012)
