"""Rows in singular positions, by mechanisms whose motion and efforts are known in closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_independence import locomotive

from ffr_dyn.analyses.forward import forward
from ffr_dyn.analyses.inverse import Dynamic, inverse
from ffr_dyn.analyses.kinematic import kinematic
from ffr_dyn.functions.time_functions import polynomial
from ffr_dyn.integrators import ROS2
from ffr_dyn.scene.drivers import Driver

GRAVITY, SPEED = 9.81, 2 * np.pi


@pytest.mark.parametrize(
    ("count", "plane", "start"), [(2, "auto", 0.0), (2, "none", 0.2), (3, "auto", 0.2), (4, "none", 0.0)]
)
def test_efforts_of_a_driven_locomotive_with_its_cranks_in_a_row(count, plane, start):
    """The motor lifts all cranks by half of what it lifts the rod, and nothing gathers speed; cranks in a row are held
    up by forces along them that grow without bound."""
    drawn = locomotive(count, 0.0, SPEED, plane, gravity=(0.0, -GRAVITY, 0.0))
    scene = replace(drawn, drivers=(Driver("motor", "foot0", polynomial(0.0, SPEED)),))
    span = {"start": start, "end": 1.0, "output_step": 0.05, "outputs": ("*",)}
    method = ROS2(0.0125)
    for result in (
        kinematic(scene, **span),
        inverse(scene, elastic=Dynamic(method), **span),
        forward(scene, method=method, **span),
    ):
        weight = (0.5 * count + 2.0) * GRAVITY * np.cos(SPEED * result.time)
        effort = result["motor.effort"] if "motor.effort" in result else result["motor.moment"][:, 2]
        np.testing.assert_allclose(effort, weight, rtol=0, atol=1e-5)
        np.testing.assert_allclose(result["top1.angle_rate"], -SPEED, rtol=0, atol=1e-8)
        np.testing.assert_allclose(result["s1.alpha_bar"], 0.0, rtol=0, atol=1e-4)
        aligned = np.isclose(np.sin(SPEED * result.time), 0.0, atol=1e-9)
        unknown = np.isnan(result["foot0.force"])
        assert unknown[aligned, 0].all()
        assert not unknown[~aligned].any()
        assert not unknown[:, 1:].any()


@pytest.mark.parametrize("plane", ["auto", "none"])
def test_the_reactions_of_a_free_locomotive_are_those_of_the_row_before_and_after(plane):
    """Its cranks are in a row at the start, in the middle of a series of rows."""
    scene = locomotive(2, 0.0, SPEED, plane, gravity=(0.0, -GRAVITY, 0.0))
    result = forward(scene, end=0.02, output_step=0.01, method=ROS2(1e-4), outputs=("*",))
    back = forward(
        locomotive(2, 0.0, -SPEED, plane, gravity=(0.0, -GRAVITY, 0.0)), end=0.02, output_step=0.01, method=ROS2(1e-4),
        outputs=("*",),
    )  # fmt: skip
    for name in (name for name in result if name.endswith((".force", ".a"))):
        rows = np.concatenate([back[name][:0:-1], result[name]])
        between = (-rows[0] + 4 * rows[1] + 4 * rows[3] - rows[4]) / 6
        np.testing.assert_allclose(rows[2], between, rtol=0, atol=1e-3 * np.abs(rows).max() + 1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("plane", ["auto", "none"])
def test_a_motion_that_begins_at_rest_in_a_singular_position_has_limits(plane):
    """Gravity sets free cranks in a row in motion; a driver does so, against forces along them that grow without bound."""
    free = locomotive(2, 0.0, 0.0, plane, gravity=(0.0, -GRAVITY, 0.0))
    result = forward(free, end=0.02, output_step=0.01, method=ROS2(2e-4))
    for name in ("foot0.force", "foot1.force", "top0.force", "top1.force"):
        begun = (4.0 * result[name][1] - result[name][2]) / 3.0  # the angle goes with the square of time
        np.testing.assert_allclose(result[name][0], begun, rtol=0, atol=1e-3)
    driven = replace(free, drivers=(Driver("motor", "foot0", polynomial(0.0, 0.0, 5.0)),))
    result = forward(driven, end=0.02, output_step=0.01, method=ROS2(2e-5))
    for name in ("foot0.force", "foot1.force", "top0.force", "top1.force"):
        assert np.isnan(result[name][0, 0])
        across = result[name][0, 1]  # in space not known beside forces that are 1e5 times as large
        assert across == pytest.approx(result[name][-1, 1], abs=1e-3) or (plane == "none" and np.isnan(across))


def test_forces_that_balance_one_another_are_not_known_of_what_rests_in_a_singular_position():
    result = forward(
        locomotive(2, 0.0, 0.0, "auto", gravity=(0.0, 0.0, 0.0)), end=0.02, output_step=0.01, method=ROS2(1e-3)
    )
    for name in ("foot0.force", "top1.force"):
        np.testing.assert_array_equal(np.isnan(result[name]), [[True, False, False]] * 3)
        np.testing.assert_array_equal(result[name][:, 1:], 0.0)
