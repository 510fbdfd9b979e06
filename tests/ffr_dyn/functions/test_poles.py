"""Functions of time that grow without bound are refused; what is sharp and bounded, or grows as a logarithm, is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ffr_dyn.analyses.forward import forward
from ffr_dyn.analyses.kinematic import kinematic
from ffr_dyn.functions.formula import formula
from ffr_dyn.functions.poles import pole
from ffr_dyn.functions.time_functions import evaluate
from ffr_dyn.integrators import ROS2
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.forces import Load
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import rigid_body
from ffr_prep.common.errors import InputError

AT, STEP = 0.50013, 2e-3
CART = rigid_body("cart", mass=1.0, inertia=(0.1, 0.1, 0.1), points={"a": (0, 0, 0)})


def sampled(text):
    function = formula(text)
    return lambda times: np.array([[evaluate(function, t)] for t in times.tolist()])


@pytest.mark.parametrize(
    "text",
    [f"3 / (t - {AT})", f"1 / (t - {AT})**2 + 1e6", f"1 / sqrt(abs(t - {AT}))", f"step(t - {AT}) / abs(t - {AT})**0.3"],
)
def test_a_pole_is_found(text):
    assert pole(sampled(text), np.array([True]), np.array([0.1, AT, 0.7]), STEP) == (AT, 0)
    assert pole(sampled(text), np.array([False]), np.array([0.1, AT, 0.7]), STEP) is None


@pytest.mark.parametrize(
    "text",
    [
        f"1e9 * exp(-((t - {AT}) / 1e-9)**2)",
        f"1e4 / (1 + ((t - {AT}) / 1e-5)**2)",
        f"1e3 * step(t - {AT})",
        f"sign(t - {AT}) * abs(t - {AT})**0.2",
        f"log(abs(t - {AT}))",
        f"atan(1 / (t - {AT}))",
        f"abs(t - {AT})",
        "sin(1e3 * t) + t**3",
    ],
)
def test_what_is_bounded_or_mild_has_no_pole(text):
    assert pole(sampled(text), np.array([True]), np.array([0.1, AT, 0.7]), STEP) is None


def pushed(text):
    rail = Joint("rail", "translational", "ground.O", "cart.a", axis=(1, 0, 0))
    push = Load("push", "cart.a", force=(formula(text), 0.0, 0.0))
    return Scene((Body("cart", CART),), (rail,), loads=(push,), ground={"O": (0, 0, 0)})


@pytest.mark.parametrize(
    "text", ["1 / (t - 0.05)", "1 / (t - 0.0513)**2", "1 / sqrt(abs(t - 0.05))", "1 / sin(62 * t + 0.1)"]
)
def test_a_run_over_a_pole_is_refused(text):
    with pytest.raises(InputError, match=r"load 'push': the function of time grows without bound at t = 0\.0"):
        forward(pushed(text), end=0.1, output_step=0.01, method=ROS2(1e-3), check=False)


@pytest.mark.parametrize(("text", "at"), [("1 / t", "0"), ("2 / t**2", "0"), ("3 / (t - 0.1)", "0.1")])
def test_a_run_that_begins_or_ends_at_a_pole_is_refused(text, at):
    """1 / t took a cart of 1 kg to 1e23 m/s, and no error was told."""
    with pytest.raises(InputError, match=rf"load 'push': the function of time grows without bound at t = {at} s"):
        forward(pushed(text), end=0.1, output_step=0.01, method=ROS2(1e-3), check=False)


@pytest.mark.parametrize(("text", "speed"), [("sin(t) / t", 0.0999444610), ("1.5 * sqrt(t)", 0.1**1.5)])
def test_a_run_that_begins_where_a_function_is_only_steep_is_not(text, speed):
    result = forward(pushed(text), end=0.1, output_step=0.01, method=ROS2(1e-4), check=False)
    assert result["cart.a.velocity"][-1, 0] == pytest.approx(speed, rel=1e-4)


def test_a_run_that_ends_before_a_pole_is_not():
    result = forward(pushed("1 / (0.2 - t)"), end=0.1, output_step=0.01, method=ROS2(1e-4), check=False)
    assert result["cart.a.velocity"][-1, 0] == pytest.approx(np.log(2.0), rel=1e-5)


@pytest.mark.parametrize("at", [0.0505, 0.1])
@pytest.mark.parametrize(("word", "coordinate"), [("translational", "stroke"), ("revolute", "angle")])
def test_a_mechanism_that_is_driven_to_a_pole_is_refused_and_at_no_dead_point(word, coordinate, at):
    """It was at 2e14 m, or was told to lock."""
    joint = Joint("rail", word, "ground.O", "cart.a", axis=(1, 0, 0))
    motor = Driver("motor", "rail", formula(f"0.1 / (t - {at})"), coordinate=coordinate)
    scene = replace(pushed("0"), loads=(), joints=(joint,), drivers=(motor,))
    with pytest.raises(InputError, match=f"'motor': the function of time grows without bound at t = {at} s"):
        kinematic(scene, end=0.1, output_step=0.01)


def test_a_driver_without_a_value_is_no_dead_point():
    motor = Driver("motor", "rail", formula("0.1 * log(abs(t - 0.5))"))
    hinge = Joint("rail", "revolute", "ground.O", "cart.a")
    scene = replace(pushed("0"), loads=(), joints=(hinge,), drivers=(motor,))
    with pytest.raises(InputError, match=r"driver 'motor': the function of time has no value at t = 0\.5 s"):
        kinematic(scene, end=1.0, output_step=0.01)
