"""Steps that do not follow the motion are told; singular positions are listed; rows that are left out are looked at."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from test_driven_angles import arm
from test_dyn_plane import slider_crank
from test_independence import locomotive

from ffr_dyn.analyses.forward import forward
from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.functions.formula import formula
from ffr_dyn.functions.time_functions import polynomial
from ffr_dyn.integrators import (
    RK4,
    ROS2,
    ROS3,
    DormandPrince,
    GeneralisedAlpha,
    HalfExplicit,
    Variational,
    tolerances,
)
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.joints import Joint
from ffr_prep.common.errors import ComputationError

FIXED = [ROS2, RK4, ROS3, HalfExplicit, GeneralisedAlpha, Variational]


def run(scene, method, end=0.2, **more):
    return forward(scene, end=end, output_step=1e-2, method=method, check=False, outputs=("*",), **more)


@pytest.mark.parametrize("kind", FIXED)
@pytest.mark.parametrize("driven", ["sin(1e4*t)", "2*sin(100*t)", "5*sin(600*t)", "sin(2*pi*100*t)"])
def test_a_driver_that_is_faster_than_the_steps_is_named(kind, driven):
    with pytest.raises(
        ComputationError, match=r"driver 'motor' moves by [\d.]+ rad within the step .* use steps below"
    ):
        run(arm(driven), kind(1e-2))


@pytest.mark.parametrize("method", [*(kind(1e-2) for kind in FIXED), DormandPrince(tolerances(1e-4))])
@pytest.mark.parametrize("jump", [1.0, np.pi, 4.0])
def test_a_jump_of_a_driver_is_named_with_its_time_and_size(method, jump):
    told = rf"driver 'motor' jumps by {re.escape(f'{jump:.4g}')} rad at t = 0\.0[45]\d* s, which no motion follows"
    with pytest.raises(ComputationError, match=told):
        run(arm(f"{jump}*step(t - 0.045)"), method)


@pytest.mark.parametrize("kind", FIXED)
def test_steps_that_follow_pass_and_rows_are_closed(kind):
    """Rows of results are on the constraints even where the step before has left them."""
    result = run(arm("3*t + 0.5*sin(20*t)"), kind(1e-2), end=3.0)
    np.testing.assert_allclose(
        result["hinge.angle"], 3 * result.time + 0.5 * np.sin(20 * result.time), rtol=0, atol=1e-7
    )
    apart = result["a.b.position"] - result["b.a.position"]
    assert np.abs(apart).max() < 1e-8


@pytest.mark.parametrize("kind", [ROS2, RK4, ROS3, GeneralisedAlpha, Variational])
@pytest.mark.parametrize("angle", [0.0, 0.7, np.pi / 2, np.pi])
def test_locomotives_stay_together_and_keep_their_energy(kind, angle):
    result = run(locomotive(4, angle, 3.0, gravity=(9.81, 0, 0)), kind(1e-3), end=1.5)
    tops = [result[f"s{k}.b.position"] - result[f"rod.p{k}.position"] for k in range(4)]
    assert np.abs(tops).max() < 1e-6
    assert np.ptp(result["energy.total"]) < 5e-3


def test_all_singular_positions_of_a_run_are_listed():
    """The cranks turn at 3 rad/s, and are aligned at every half turn."""
    (note,) = [
        note for note in run(locomotive(3, 0.7, 3.0), RK4(1e-3), end=4.0).attributes["notes"] if "singular" in note
    ]
    times = [float(time) for time in re.findall(r"\d+\.\d+", note.split("near t =")[1].split(" s")[0])]
    aligned = [(k * np.pi - 0.7) / 3 for k in range(1, 5)]
    assert all(np.abs(np.array(times) - time).min() < 5e-3 for time in aligned if time < 4)


@pytest.mark.parametrize(("step", "stiffer"), [(0.1, 1.0), (0.01, 100.0)])
def test_bodies_that_a_long_step_makes_stiff_make_no_position_singular(step, stiffer):
    """A slider-crank in space, which its rod closes by deforming across the plane; its positions are all the same there."""
    motor = Driver("motor", "main", polynomial(0.3, 1.0))
    crank, rod, block = slider_crank().bodies
    rod = replace(rod, model=replace(rod.model, omega2=rod.model.omega2 * stiffer))
    scene = slider_crank(plane="none", springs=(), loads=(), drivers=(motor,), bodies=(crank, rod, block))
    result = forward(scene, end=1.0, output_step=0.1, method=ROS2(step), begin="quasi-static")
    assert [note for note in result.attributes["notes"] if "singular" in note] == []


def test_a_redundant_row_that_opens_stops_the_run_by_name():
    """Two equal bars in line between walls, pinned at both ends, which the missing row lets buckle."""
    scene = arm("0*t")
    joints = (*scene.joints, Joint("wall", "revolute", "ground.Q", "b.b"))
    ground = {"O": (0, 0, 0), "Q": (2, 0, 0)}
    scene = replace(scene, drivers=(), joints=joints, ground=ground, gravity=(0, -9.81, 0), plane="z")
    assert assemble(scene).redundant
    told = r"at t = [\d.]+ s the row '.*' of '(wall|hinge|elbow)' is open by .*: the mechanism has come apart"
    with pytest.raises(ComputationError, match=told):
        run(scene, RK4(1e-3))


def test_a_driver_with_its_own_turns_counts_them():
    scene = replace(arm("0*t"), drivers=(Driver("motor", "hinge", formula("20 + 40*t")),))
    result = run(scene, RK4(1e-3))
    np.testing.assert_allclose(result["hinge.angle"], 20 + 40 * result.time, rtol=0, atol=1e-8)
