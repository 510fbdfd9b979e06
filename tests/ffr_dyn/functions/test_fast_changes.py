"""Where functions of time change faster than steps: what is found, what is left alone, and what jumps."""

from __future__ import annotations

import numpy as np
import pytest

from ffr_dyn.analyses.kinematic import assemble
from ffr_dyn.compile.divided_steps import PARTS, divided, fast_of
from ffr_dyn.functions.formula import formula
from ffr_dyn.functions.time_functions import harmonic, polynomial, table, user
from ffr_dyn.kernels.tables import SINCE
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.forces import Load
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import rigid_body
from ffr_prep.common.errors import InputError

ROW, STEP, AT = 0.01, 2.5e-3, 0.5013
BLOCK = rigid_body("m", mass=1.0, inertia=(0.1, 0.1, 0.1), points={"c": (0, 0, 0)})
RAIL = Joint("rail", "translational", "ground.O", "a.c", axis=(1, 0, 0))


def pushed(function):
    load = Load("push", "a.c", (function, 0, 0))
    return Scene((Body("a", BLOCK),), (RAIL,), loads=(load,), ground={"O": (0, 0, 0)}, gravity=(0, 0, 0))


def led(function):
    drive = Driver("drive", "rail", function, coordinate="stroke")
    return Scene((Body("a", BLOCK),), (RAIL,), drivers=(drive,), ground={"O": (0, 0, 0)}, gravity=(0, 0, 0))


def fast(function, scene=pushed, step=STEP):
    return fast_of(assemble(scene(function)).system, 0.0, 1.0, ROW, step)


PULSES = {
    "gauss": (formula(f"exp(-((t - {AT}) / 1e-4)^2)".replace("^", "**")), 1e-4),
    "gauss that few times can tell from nothing": (formula(f"exp(-((t - {AT}) / 1e-9)**2)"), 1e-9),
    "lorentz": (formula(f"1 / (1 + ((t - {AT}) / 1e-5)**2)"), 1e-5),
    "two steep rises": (formula(f"tanh((t - {AT}) / 1e-5) - tanh((t - {AT} - 1e-4) / 1e-5)"), 1e-5),
    "in a product": (formula(f"t * cos(t) * exp(-((t - {AT}) / 1e-5)**2)"), 1e-5),
    "table": (table(np.linspace(0, 1, 10001), np.exp(-(((np.linspace(0, 1, 10001) - AT) / 3e-4) ** 2))), 3e-4),
    "python": (user(lambda t: np.exp(-(((t - AT) / 4e-4) ** 2))), 4e-4),
}


@pytest.mark.parametrize(("function", "width"), PULSES.values(), ids=PULSES)
def test_a_pulse_between_steps_is_found_and_divided(function, width):
    found = fast(function)
    inside = found.spans[(found.spans[:, 0] < AT + width) & (found.spans[:, 1] > AT - width)]
    assert len(inside)
    assert np.diff(inside, axis=1).max() <= 1.5 * width
    assert found.spans[0, 0] > AT - 0.05
    assert found.spans[-1, 1] < AT + 0.05
    assert found.purposes == ("load 'push'",)
    assert "load 'push'" in found.words[0]


def test_every_period_of_what_is_periodic_is_found():
    beats = fast(formula("exp(-1e6 * (1 - cos(2 * pi * 5 * t)))"))
    for beat in (0.2, 0.4, 0.6, 0.8):
        assert (np.abs(beats.spans - beat).min(axis=1) < 3e-4).any()
    for wave in (harmonic(amplitude=2.0, frequency=400.0), formula("2 * sin(2 * pi * 400 * t)")):
        spans = fast(wave).spans
        assert np.diff(spans, axis=1).sum() == pytest.approx(1.0)
        assert np.diff(spans, axis=1).max() * 2 * np.pi * 400 < 1.5


SLOW = {
    "polynomial": polynomial(0, 1, 2),
    "harmonic": harmonic(amplitude=1.0, frequency=20.0),
    "formula": formula("10 * sin(20 * t) * exp(-t) + smooth(4 * t)"),
    "formula with kinks": formula("abs(sin(9 * t)) + max(0, t - 0.5013) + step(t - 0.7003)"),
    "table": table(np.linspace(0, 1, 21), np.sin(np.linspace(0, 1, 21))),
    "python": user(lambda t: np.sin(20 * t)),
    "python with rates": user(lambda t: (np.sin(20 * t), 20 * np.cos(20 * t), -400 * np.sin(20 * t))),
    "root": formula("sqrt(t)"),
}


@pytest.mark.parametrize("function", SLOW.values(), ids=SLOW)
def test_steps_are_left_alone_where_functions_are_slow(function):
    found = fast(function)
    assert found is None or not len(found.spans)


def test_a_ripple_on_a_motion_counts_by_its_acceleration():
    ripple = formula("100 * t + 1e-5 * sin(2 * pi * 1000 * t)")
    assert fast(ripple) is None
    assert len(fast(ripple, led).spans) > 1000


@pytest.mark.parametrize("width", [1e-3, 0.2])
def test_jumps_that_nobody_tells_are_found(width):
    found = fast(user(lambda t: float(AT <= t < AT + width)))
    np.testing.assert_allclose(found.jumps, [[AT, AT], [AT + width, AT + width]], rtol=1e-12)
    assert (found.jumps[:, 0] < found.jumps[:, 1]).all()
    assert not len(found.spans)


def test_jumps_that_are_told_are_left_to_those_who_tell():
    found = fast(user(lambda t: float(t >= AT), breaks=[AT]))
    assert found is None
    switch = fast(formula(f"step(t - {AT}) - step(t - {AT} - 1e-4)"))
    np.testing.assert_allclose(switch.switches, [AT, AT + 1e-4], rtol=1e-12)
    assert not len(switch.jumps) + len(switch.spans)


def test_what_python_raises_and_noise_are_left_to_the_run():
    def raises(t):
        raise ValueError

    assert fast(user(raises)) is None
    assert fast(user(lambda t: np.random.default_rng(round(abs(t) * 1e15)).normal())) is None


def test_parts_are_in_proportion_to_the_step():
    system, found = assemble(pushed(PULSES["gauss"][0])).system, fast(PULSES["gauss"][0])
    count = {
        step: len(divided(system, found, step).model.functions.breaks) for step in (2 * STEP, STEP, STEP / 2, STEP / 4)
    }
    spans = len(found.spans)
    assert count[STEP] == pytest.approx(PARTS * spans, abs=spans)
    assert count[2 * STEP] == pytest.approx(PARTS / 2 * spans, abs=spans)
    assert count[STEP / 4] == pytest.approx(4 * PARTS * spans, abs=spans)
    at = divided(system, found, STEP).model.functions.breaks[:, SINCE]
    assert (np.diff(at) > 0).all()


@pytest.mark.parametrize("text", ["log(abs(t - 0.5013))", "sqrt(t)", "exp(1e3 * sin(9 * t))", "1e300 * t * t"])
def test_what_has_no_bounds_is_looked_at_without_a_warning(text):
    fast(formula(text))


def test_a_pole_is_refused_without_a_warning():
    with pytest.raises(InputError, match=r"grows without bound at t = 0\.5013 s"):
        fast(formula("1 / (t - 0.5013)"))
