"""Points of studies: grids, lists, samples."""

from __future__ import annotations

import numpy as np
import pytest

from ffr_dyn.studies.sampling import Axis, Spread, points, spaced
from ffr_prep.common.errors import InputError


def test_a_grid_has_every_combination_and_the_last_axis_is_fastest():
    found = points({"a": Axis((1, 2)), "b": Axis((3.0, 4.0))})
    assert [(p["a"], p["b"]) for p in found] == [(1, 3), (1, 4), (2, 3), (2, 4)]


def test_a_list_takes_values_side_by_side():
    found = points({"a": Axis((1, 2)), "b": Axis((3.0, 4.0))}, paired=True)
    assert [(p["a"], p["b"]) for p in found] == [(1, 3), (2, 4)]
    with pytest.raises(InputError, match="a has 2, b has 1"):
        points({"a": Axis((1, 2)), "b": Axis((3.0,))}, paired=True)


def test_axes_are_spaced_evenly_or_by_logarithms():
    np.testing.assert_allclose(spaced(1, 3, 5).values, (1, 1.5, 2, 2.5, 3))
    np.testing.assert_allclose(spaced(1, 100, 3, logarithmic=True).values, (1, 10, 100))
    assert spaced(0.2, 0.4, 3).values == (0.2, 0.3, 0.4)  # a body of 0.30000000000000004 m would be another one
    assert spaced(1 / 3, np.pi, 2).values == (1 / 3, np.pi)
    assert spaced(1 / 3, 2, 1).values == (1 / 3,)
    with pytest.raises(InputError, match="above zero"):
        spaced(0, 1, 3, logarithmic=True)


@pytest.mark.parametrize("sampling", ["monte-carlo", "latin-hypercube", "sobol"])
def test_samples_have_the_moments_of_their_distributions(sampling):
    """Mean and deviation of 4096 samples, each beside every point of the grid; the same again with the same seed."""
    given = {
        "n": Spread("normal", (10.0, 2.0)), "u": Spread("uniform", (1.0, 3.0)), "t": Spread("triangular", (0.0, 1.0, 2.0)),
        "l": Spread("lognormal", (1.0, 0.5)), "g": Spread("gamma", (2.0, 0.0, 1.0)),
    }  # fmt: skip
    found = points(given, samples=4096, sampling=sampling, seed=3)
    assert found == points(given, samples=4096, sampling=sampling, seed=3)
    moments = {"n": (10, 2), "u": (2, 1 / 3**0.5), "t": (1, 1 / 6**0.5), "g": (2, 2**0.5)}
    for name, (mean, deviation) in moments.items():
        column = np.array([p[name] for p in found])
        assert column.mean() == pytest.approx(mean, abs=4 * deviation / 64)
        assert column.std() == pytest.approx(deviation, rel=0.06)
    assert np.log([p["l"] for p in found]).mean() == pytest.approx(0.0, abs=4 * 0.5 / 64)
    assert len(points({**given, "a": Axis((1, 2))}, samples=8, sampling=sampling)) == 16


@pytest.mark.parametrize(("spread", "says"), [
    (Spread("normal", (1.0,)), "normal takes .mean, deviation., and 1 numbers"),
    (Spread("gauss", (1.0, 2.0)), "no distribution 'gauss'"),
    (Spread("uniform", (1.0, np.nan)), "no finite quantiles"),
    (Spread("weibull_min", ()), "weibull_min takes .c, loc, scale., and 0 numbers"),
    (Spread("weibull_min", (1.0, 2.0, 3.0, 4.0)), "weibull_min takes .c, loc, scale., and 4 numbers"),
    (Spread("expon", (1.0, 2.0, 3.0)), "expon takes .loc, scale., and 3 numbers"),
    (Spread("triangular", (1.0, 2.0, 0.0)), "no finite quantiles|c"),
])  # fmt: skip
def test_distributions_that_are_none_are_refused_by_name(spread, says):
    with pytest.raises(InputError, match=f"parameters.x: .*({says})"):
        points({"x": spread}, samples=4)


def test_a_study_that_is_too_large_is_refused_before_it_is_made():
    with pytest.raises(InputError, match=r"a study of 1e\+12 runs"):
        points({name: spaced(0, 1, 1000) for name in "abcd"})
    with pytest.raises(InputError, match="x: give samples = N"):
        points({"x": Spread("normal", (0.0, 1.0))})
