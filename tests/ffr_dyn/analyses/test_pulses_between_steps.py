"""Forces and motions that are shorter than a step and fall between steps: what they do is right, and its error is told.

The scene is a linear oscillator; the truth is that of an independent solver which is led to the pulse.
"""

from __future__ import annotations

from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from test_steps_at_breaks import C, K, off, shaken

from ffr_dyn.analyses.forward import forward
from ffr_dyn.economy.model_choice import full
from ffr_dyn.economy.run import Span, make, simulated
from ffr_dyn.functions.formula import formula
from ffr_dyn.functions.time_functions import evaluate, harmonic, table, user
from ffr_dyn.integrators import RK4, ROS2, ROS3, AdaptiveROS3, GeneralisedAlpha, tolerances

AT, END, ROW = 0.5013, 1.0, 0.01
METHODS = [None, ROS2(1e-2), ROS3(5e-3), RK4(2e-3), GeneralisedAlpha(2e-3), AdaptiveROS3(tolerances(1e-6))]
SHARP = np.exp(-(((np.linspace(0, 1, 10001) - AT) / 3e-4) ** 2))
PULSES = {
    "gauss": (formula(f"1e4 * exp(-((t - {AT}) / 1e-4)**2)"), 1e-4),
    "lorentz": (formula(f"1e4 / (1 + ((t - {AT}) / 1e-5)**2)"), 1e-5),
    "two steep rises": (formula(f"1e4 * (tanh((t - {AT}) / 1e-5) - tanh((t - {AT} - 1e-4) / 1e-5))"), 1e-4),
    "table": (table(np.linspace(0, 1, 10001), 1e4 * SHARP), 3e-4),
    "shortest": (formula(f"1e9 * exp(-((t - {AT}) / 1e-9)**2)"), 1e-9),
}


@cache
def true(name):
    """(T,) the stroke at the rows, of an oscillator that the pulse pushes."""
    function, width = PULSES[name]
    around = AT + width * np.array([-3e3, -300, -30, -3, 0, 3, 30, 300, 3e3])
    times, y, found = np.linspace(0, END, 101), np.zeros(2), np.zeros(101)
    for start, end in pairwise([0.0, *around[(around > 0) & (around < END)], END]):
        piece = solve_ivp(
            lambda t, y: [y[1], evaluate(function, t)[0] - K * y[0] - C * y[1]],
            (start, end), y, method="DOP853", rtol=1e-10, atol=1e-13, dense_output=True, max_step=(end - start) / 30,
        )  # fmt: skip
        here = (times >= start) & (times <= end)
        found[here] = piece.sol(times[here])[0] if here.any() else ()
        y = piece.y[:, -1]
    return found


def _seldom(name, method):
    """All pulses by the default, all methods for one of them; the others are for the slow tests."""
    return () if name == "gauss" or method is None else pytest.mark.slow


@pytest.mark.parametrize(
    ("name", "method"),
    [
        pytest.param(name, method, id=f"{name}-{type(method).__name__}", marks=_seldom(name, method))
        for name in PULSES
        for method in METHODS
    ],
)
def test_a_pulse_between_steps_is_seen_and_its_error_told(name, method):
    error, told, result = off(shaken("load", PULSES[name][0]), method, true(name), check=True)
    assert error <= (2e-3 if method is None else 2e-2)
    assert 0.3 * error <= told <= 5 * error
    assert any("steps are divided there" in note for note in result.attributes["notes"])
    assert not any("energy" in note and "no force" in note for note in result.attributes["notes"])


@pytest.mark.parametrize("wave", [harmonic(amplitude=1.0, frequency=100.0), formula("sin(2 * pi * 100 * t)")])
def test_a_wave_that_every_step_meets_at_zero_is_seen(wave):
    w, n, d = 2 * np.pi * 100, K**0.5, C / 2
    t = np.linspace(0, END, 101)
    steady = 1 / (K - w**2 + 1j * C * w)
    free = (n**2 - d**2) ** 0.5
    a, b = -steady.imag, -(w * steady.real + d * steady.imag) / free
    exact = (steady * np.exp(1j * w * t)).imag + np.exp(-d * t) * (a * np.cos(free * t) + b * np.sin(free * t))
    error, told, _ = off(shaken("load", wave), ROS2(ROW), exact, check=True)
    assert error <= 1e-2
    assert 0.3 * error <= told <= 5 * error


@pytest.mark.parametrize("method", [ROS2(1e-2), RK4(2e-3)], ids=lambda one: type(one).__name__)
def test_a_python_function_is_looked_into(method):
    pulse = user(lambda t: 1e4 * np.exp(-(((t - AT) / 3e-4) ** 2)))
    error, told, _ = off(shaken("load", pulse), method, true("table"), check=True)
    assert error <= 1e-2
    assert 0.3 * error <= told <= 5 * error


@pytest.mark.slow
def test_a_motion_that_jerks_between_rows_is_followed():
    jerk = formula(f"0.1 * exp(-((t - {AT}) / 1e-3)**2)")
    scene = shaken("driver", jerk).scene
    coarse = forward(scene, end=END, output_step=ROW, method=ROS2(1e-2), check=True)
    fine = forward(scene, end=END, output_step=ROW, method=RK4(1e-5), check=False)
    off_by = np.abs(coarse["between.stroke"] - fine["between.stroke"]).max()
    assert off_by <= 5e-3 * np.ptp(fine["between.stroke"])
    assert 0.3 * off_by <= coarse.attributes["errors"]["between.stroke"][0] <= 5 * off_by


def test_economise_sees_what_forward_sees():
    scene = shaken("load", PULSES["gauss"][0]).scene
    choice, span = full(scene, "ros2", 2), Span(0.0, END, ROW)
    result = simulated(make(scene, choice, span), choice, span, ("rail.stroke",))
    assert np.abs(result["rail.stroke"] - true("gauss")).max() <= 5e-3 * np.ptp(true("gauss"))
