"""Where functions of time break: declared times, operations that switch, and what nobody has told."""

from __future__ import annotations

import numpy as np
import pytest

from ffr_dyn.functions.breaks import declared_breaks, hidden_breaks
from ffr_dyn.functions.time_functions import harmonic, piecewise, signal, table, user
from ffr_prep.common.errors import InputError

TIMES = np.linspace(0.0, 1.0, 101)
SINCE, SEEN = 1, 2


def test_pieces_break_where_value_rate_or_second_derivative_jumps():
    jump = piecewise([0.0, 0.5, 1.0], [[1.0], [2.0]])
    kink = piecewise([0.0, 0.25, 1.0], [[0.0, 0.0], [0.0, 1.0]])
    bend = piecewise([0.0, 0.75, 1.0], [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    found = declared_breaks([jump, kink, bend])
    np.testing.assert_array_equal(found[:, SEEN], [0.25, 0.5, 0.75, 1.0])
    assert (found[:, 0] < found[:, SINCE]).all()


def test_a_smooth_table_breaks_where_it_begins_and_where_it_ends():
    times = np.linspace(0.25, 0.75, 9)
    found = declared_breaks([table(times, np.sin(times))])
    np.testing.assert_array_equal(found[:, SEEN], [0.25, 0.75])
    assert found[0, SINCE] == 0.25  # a row there shows what begins
    assert found[1, 0] == 0.75 < found[1, SINCE]  # and what ends
    assert not declared_breaks([table(times, np.ones(9)), harmonic(amplitude=1.0, frequency=2.0), signal("s")]).size


def test_a_python_function_tells_its_breaks():
    found = declared_breaks([user(lambda t: float(t > 0.3), breaks=[0.3, 0.1])])
    np.testing.assert_array_equal(found[:, SEEN], [0.1, 0.3])
    with pytest.raises(InputError, match="finite"):
        user(np.sin, breaks=[np.nan])


@pytest.mark.parametrize("at", [0.5, 0.5037, 0.50999])
@pytest.mark.parametrize(
    "broken", [lambda u: (float(u > 0), 0, 0), lambda u: (max(0.0, u), 0, 0), lambda u: (0.5 * u * abs(u), abs(u), 0)]
)
def test_hidden_jumps_and_kinks_are_found(broken, at):
    found = hidden_breaks(lambda t: np.add(broken(t - at), [np.sin(9 * t), 0, 0]), TIMES)
    sharp = broken(0.01)[0] > 1e-3  # value or rate
    assert (len(found) == 1 and abs(found[0] - at) < 1e-6) or not sharp


@pytest.mark.parametrize(
    "smooth",
    [
        np.sin,
        lambda t: np.sin(60 * t) * np.exp(-3 * t),
        lambda t: np.tanh((t - 0.5) / 0.02),
        lambda t: np.tanh((t - 0.503) / 1e-4),  # steep, but no jump
        lambda t: np.exp(-(((t - 0.5) / 0.01) ** 2)),
        lambda t: 3.0,
        lambda t: t**4,
        lambda t: 5 + 5 * np.sin(200 * np.pi * t) ** 2,  # the same at all rows, but for rounding
        lambda t: 5 + 5 * np.sin(200.001 * np.pi * t) ** 2,
    ],
)
def test_what_is_smooth_has_no_hidden_breaks(smooth):
    assert hidden_breaks(lambda t: np.array([smooth(t), 0.0, 0.0]), TIMES) == []
