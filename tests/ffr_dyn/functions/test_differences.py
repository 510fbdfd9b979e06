"""Derivatives by differences: of what bends within the first step, is not defined there, or is all rounding."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ffr_dyn.functions.differences import LEVELS, differences

STEPS = np.full(2, 1e-6)


@pytest.mark.parametrize("width", [1.0, 1e-5, 1e-7, 1e-9])
def test_what_is_level_beyond_a_width(width):
    """tanh, by a step that is far out where it no longer changes; beside a number with which it does not."""
    found, errors = differences(lambda y: np.array([3 * np.tanh(y[0] / width), 5 * y[1]]), STEPS, range(2))
    np.testing.assert_allclose(found, [[3 / width, 0.0], [0.0, 5.0]], rtol=1e-7)
    assert errors[0, 0] < 1e-4 * 3 / width


@pytest.mark.parametrize("gap", [1e-3, 2e-6, 2.5e-8])
def test_a_pole_within_the_first_step(gap):
    found, _ = differences(lambda y: np.array([1 / (gap - y[0]) ** 2]), STEPS, [0])
    assert found[0, 0] == pytest.approx(2 / gap**3, rel=1e-6)
    assert found[0, 1] == 0.0


def test_a_jump_is_what_the_first_step_tells():
    found, errors = differences(lambda y: np.array([3 * np.sign(y[0])]), STEPS, [0])
    assert 3e6 <= found[0, 0] <= 8e6
    assert errors[0, 0] > 0.3 * found[0, 0]


@pytest.mark.parametrize("width", [1e-3, 1e-5, 1e-6])
def test_what_grows_from_zero_on_one_side_has_no_slope_yet(width):
    """A parabola that ends in its tangent, as a stop is entered: it is no jump, whose derivative grows with smaller steps."""
    found, _ = differences(
        lambda y: np.array([np.where(y[0] < width, max(y[0], 0.0) ** 2 / (2 * width), y[0] - width / 2)]), STEPS, [0]
    )
    assert abs(found[0, 0]) < 1e-3


def test_a_function_that_is_not_defined_a_first_step_away():
    found, _ = differences(lambda y: np.array([math.log(1e-7 - y[0]), math.sqrt(1e-8 + y[0])]), STEPS, [0])
    np.testing.assert_allclose(found[:, 0], [-1e7, 0.5e4], rtol=1e-6)


def test_nothing_is_told_of_what_is_defined_nowhere_else():
    found, _ = differences(lambda y: np.array([1.0 if not y.any() else math.log(-1.0)]), STEPS, [0])
    assert np.isnan(found[0, 0])


def test_errors_of_python_functions_at_the_point_itself_are_theirs():
    with pytest.raises(ValueError, match="math domain"):
        differences(lambda y: np.array([math.log(-1.0 + y[0])]), STEPS, [0])


def test_rounding_asks_for_no_smaller_steps():
    """A force that is large beside what it changes by: as many values as one column takes, and one."""
    asked = []

    def force(y):
        asked.append(y)
        return np.array([1e6 + 1e-3 * y[0]])

    differences(force, STEPS, [0])
    assert len(asked) == 5
    asked.clear()
    differences(lambda y: force(y) + 1e3 * np.sign(y[0]) * y[0] ** 2, STEPS, [0])
    assert len(asked) <= 5 + 4 * LEVELS
