"""Lists of speeds as text, and scenes at a speed."""

from __future__ import annotations

import numpy as np
import pytest
from test_analyses_kinematic import bar

import ffr_dyn as fd
from ffr_dyn.functions.time_functions import evaluate
from ffr_dyn.linear.speeds import at_speed, speed_list

HINGED = fd.Scene(
    (fd.Body("rod", bar("rod", 2.0)),), (fd.Joint("hinge", "revolute", "ground.O", "rod.a"),), ground={"O": (0, 0, 0)}
)


def test_speeds_are_numbers_units_and_ranges():
    assert speed_list((3.0, "4")) == (3.0, 4.0)
    np.testing.assert_allclose(speed_list(("3000 rpm",)), 100 * np.pi)
    assert len(speed_list(("0..500",))) == 21
    np.testing.assert_allclose(speed_list(("0..60 rpm:3",)), [0.0, np.pi, 2 * np.pi])


@pytest.mark.parametrize("text", ["fast", "0..", "3 Hz", "1:2", "0..5:x", "..4"])
def test_another_text_is_an_error_that_shows_how(text):
    with pytest.raises(fd.InputError, match=r"write 314 \[rad/s\]"):
        speed_list((text,))


def test_a_joint_coordinate_or_the_only_driver_has_the_speed():
    driven = at_speed(HINGED, 7.0, "hinge.angle")
    assert evaluate(driven.drivers[-1].function, 0.0)[:2] == (0.0, 7.0)
    motor = fd.Driver("motor", "hinge", fd.polynomial(0.25))
    again = at_speed(fd.Scene(**vars_of(HINGED) | {"drivers": (motor,)}), 5.0, time=2.0)
    assert evaluate(again.drivers[0].function, 2.0)[:2] == (0.25, 5.0)


def test_velocities_of_the_scene_are_scaled():
    moving = fd.Scene(**vars_of(HINGED) | {"bodies": (fd.Body("rod", bar("rod", 2.0), omega_bar=(0, 0, 2.0)),)})
    np.testing.assert_allclose(at_speed(moving, 6.0).bodies[0].omega_bar, [0, 0, 6.0])


def test_nothing_that_turns_is_an_error():
    with pytest.raises(fd.InputError, match="nothing turns"):
        at_speed(HINGED, 1.0)
    with pytest.raises(fd.InputError, match=r"hinge\.angle"):
        at_speed(HINGED, 1.0, "hing")


def vars_of(scene):
    return {key: getattr(scene, key) for key in ("bodies", "joints", "drivers", "ground")}
