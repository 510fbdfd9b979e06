"""The error of outputs whose vibration, of a shock at the start, is gone after a row or two."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from synthetic import cloud

from ffr_dyn.analyses.forward import forward
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.analyses.trials import errors, search
from ffr_dyn.consistency.step_error import StepError, begins_alone, largest_difference, ranges, with_start
from ffr_dyn.integrators import RK4, ROS2, ROS3, Within
from ffr_dyn.integrators.stabilisation import Projection
from ffr_dyn.results.result import Quantity, Result
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.common.errors import ComputationError

ROW = 0.02
SPAN = {"end": 0.4, "output_step": ROW}


def struck(seed: int, damping: float, stiffer: float) -> Scene:
    """A body on a hinge whose modes all vibrate at the start."""
    soft = cloud(6, seed=seed)
    rates = 0.05 * stiffer * np.random.default_rng(seed).normal(size=6)
    model = replace(soft, omega2=stiffer**2 * soft.omega2)
    hinge = Joint("hinge", "revolute", "ground.O", "rod.a", axis=(0, 0, 1))
    body = Body("rod", model, q_dot=tuple(rates), damping=damping)
    return Scene((body,), (hinge,), ground={"O": (0, 0, 0)}, gravity=(0.0, -9.81, 0.0))


@cache
def true(seed: int, damping: float, stiffer: float) -> Result:
    steps = 2048 if stiffer > 10 else 512  # h omega < 0.1
    return integrate(struck(seed, damping, stiffer), **SPAN, method=RK4(ROW / steps), stabilisation=Projection(1e-12))


@pytest.mark.parametrize(
    ("method", "stiffer"),
    [
        (ROS3(ROW / 4), 5.0),
        (ROS3(ROW / 16), 5.0),
        (ROS3(ROW / 16), 20.0),
        (ROS3(ROW / 64), 20.0),
        (ROS2(ROW / 16), 5.0),
        (ROS2(ROW / 64), 20.0),
    ],
)
@pytest.mark.parametrize("damping", [0.05, 0.1])
@pytest.mark.parametrize("seed", range(6))
def test_after_a_shock_no_error_is_less_than_a_third_of_the_true_one(seed, damping, method, stiffer):
    found, exact = forward(struck(seed, damping, stiffer), **SPAN, method=method), true(seed, damping, stiffer)
    scales = ranges(exact)
    off = {name: largest_difference(found[name], exact[name]) for name in found.attributes["errors"]}
    pairs = {
        name: told / off[name]
        for name, (told, _) in found.attributes["errors"].items()
        if off[name] > 1e-5 * scales[name]
    }
    assert pairs
    assert min(pairs.values()) >= 1 / 3, min(pairs, key=pairs.__getitem__)
    assert np.median(list(pairs.values())) <= 5


def test_a_search_that_ends_at_the_finest_step_tells_all_of_its_error(monkeypatch):
    scene = struck(0, 0.05, 5.0)
    monkeypatch.setattr(search, "FINEST", search.FIRST)
    found = forward(scene, **SPAN, method=Within(1e-8))
    given = forward(scene, **SPAN, method=ROS2(ROW / search.FIRST), stabilisation=Projection(1e-16))
    assert found.attributes["step"] == given.attributes["step"]
    for name, (told, _) in found.attributes["errors"].items():
        assert told == pytest.approx(given.attributes["errors"][name][0], rel=1e-6, abs=1e-12), name


def test_steps_whose_double_a_twin_does_not_bear_have_no_order(monkeypatch):
    def fails(*_: object) -> None:
        raise ComputationError("the energy has grown")

    scene, method = struck(0, 0.05, 5.0), ROS3(ROW / 8)
    sure = forward(scene, **SPAN, method=method)
    monkeypatch.setattr(errors, "_longer_twin", fails)
    found = forward(scene, **SPAN, method=method)
    other = integrate(scene, **SPAN, method=ROS3(ROW / 2), stabilisation=Projection(1e-11))
    first_order = {name: largest_difference(found[name], other[name]) / 3 for name in sure.attributes["errors"]}
    assert all(found.attributes["errors"][name][0] >= 0.99 * size for name, size in first_order.items())
    assert any(sure.attributes["errors"][name][0] < 0.9 * size for name, size in first_order.items())


# ---- histories made up ----------------------------------------------------------------------------------------------

TIME = np.linspace(0.0, 1.0, 51)


def result(force: np.ndarray, time: np.ndarray = TIME) -> Result:
    return Result(time, {"a.force": Quantity(np.asarray(force), "N")}, {}, {})


def vibrating(decay: float, amount: float = 0.3, time: np.ndarray = TIME) -> np.ndarray:
    return np.sin(3 * time) + amount * np.exp(-decay * time) * np.sin(9876.0 * time)


@pytest.mark.parametrize(
    ("decay", "amount", "alone"), [(100.0, 0.3, True), (0.0, 0.3, False), (100.0, 1e-9, False), (100.0, 0.0, False)]
)
def test_vibration_that_is_gone_soon_is_found(decay, amount, alone):
    assert begins_alone(result(vibrating(0.0, 0.0)), result(vibrating(decay, amount))) == alone


def test_what_a_finer_twin_shows_after_the_first_row_is_told_at_least():
    steps = np.linspace(0.0, 0.025, 51)  # the rows are every 0.02 s
    run, own = result(vibrating(0.0, 0.0)), result(vibrating(0.0, 0.0, steps), steps)
    fine = result(vibrating(100.0, 0.3, steps), steps)
    after = np.abs(own["a.force"] - fine["a.force"])[40:].max()
    before = {"a.force": StepError(1e-3, 1e-3, vibrates=False)}
    found = with_start(before, run, own, fine)["a.force"]
    assert found.error == after < 0.2 * np.abs(own["a.force"] - fine["a.force"]).max()
    assert found.of_range == pytest.approx(after / np.ptp(run["a.force"]))
    assert found.vibrates
    assert with_start({"a.force": StepError(1.0, 1.0, vibrates=False)}, run, own, fine)["a.force"].error == 1.0
