"""Undamped stops give back what they take: where steps are too long for that, the error told is not known, and no model is
chosen by it."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ffr_dyn.analyses import integration
from ffr_dyn.analyses.forward import forward
from ffr_dyn.analyses.run import run
from ffr_dyn.economy.outputs import Output
from ffr_dyn.economy.search import economise
from ffr_dyn.integrators import ROS2, ROS3, Within
from ffr_dyn.scene.forces import JointStop
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import rigid_body

END, ROW, ENTRY = 2.0, 0.01, 1e-4
LOWEST = -np.pi / 3
ARM = rigid_body(
    "arm", mass=1.0, inertia=(1e-3, 0.0838, 0.0838), centre_of_mass=(0.5, 0, 0), points={"a": (0, 0, 0), "b": (1, 0, 0)}
)


def bouncing(stiffness, damping=0.0, lower=LOWEST):
    """An arm that falls on a stop and rebounds."""
    stop = JointStop("stop", "hinge", stiffness=stiffness, damping=damping, entry=ENTRY, lower=lower)
    hinge = Joint("hinge", "revolute", "ground.O", "arm.a")
    return Scene((Body("arm", ARM),), (hinge,), forces=(stop,), ground={"O": (0, 0, 0)}, gravity=(0, -9.81, 0))


@cache
def true(stiffness, row=ROW):
    """(T,) angles, by another solver."""

    def rates(t, y):
        depth = max(LOWEST - y[0], 0.0)
        push = stiffness * (depth**2 / (2 * ENTRY) if depth < ENTRY else depth - ENTRY / 2)
        return [y[1], (push - 9.81 * 0.5 * np.cos(y[0])) / (0.0838 + 0.25)]

    times = np.linspace(0, END, 1 + round(END / row))
    return solve_ivp(rates, (0, END), [0, 0], t_eval=times, rtol=1e-9, atol=1e-12, max_step=2e-3).y[0]


@pytest.mark.parametrize("method", [ROS3(1e-3), ROS2(1e-3)], ids=lambda one: type(one).__name__)
def test_a_rebound_that_is_lost_is_told(method):
    result = forward(bouncing(1e7), end=END, output_step=ROW, method=method, check=True)
    assert np.abs(result["hinge.angle"] - true(1e7)).max() > 0.5
    assert result.attributes["accuracy"].startswith("step: not known")
    assert any("leaves out rebounds from stops" in note for note in result.attributes["notes"])
    assert any("energy of 4.25 J has gone" in note for note in result.attributes["notes"])


@pytest.mark.parametrize(("stiffness", "ratio", "step"), [(1e7, 0.03, 1e-3), (1e6, 0.3, 1e-3), (1e4, 0.1, 5e-3)])
def test_damped_stops_that_are_met_within_few_steps_are_told(stiffness, ratio, step):
    """They take energy that rows do not tell; half a vibration against them lasts pi sqrt(J / k)."""
    scene = bouncing(stiffness, damping=2 * ratio * np.sqrt(stiffness * (0.0838 + 0.25)))
    result = forward(scene, end=1.0, output_step=ROW, method=ROS3(step), check=True)
    lasts = np.pi * np.sqrt((0.0838 + 0.25) / stiffness)
    assert lasts < 4 * step
    assert result.attributes["accuracy"].startswith("step: not known")
    [note] = [note for note in result.attributes["notes"] if "leaves out rebounds" in note]
    told = float(note.split("'stop' is met for about ")[1].split(" s")[0])
    assert told == pytest.approx(lasts, rel=0.25)  # more where it is soft


@pytest.mark.parametrize("stiffness", [1e5, 1e6])
def test_the_force_of_a_stop_that_rows_miss_is_told(stiffness):
    """It is the rate of the approach times sqrt(J k)."""
    method, inertia = ROS2(2e-5), 0.0838 + 0.25
    coarse = forward(bouncing(stiffness), end=1.0, output_step=0.05, method=method, check=False)
    assert not coarse["stop.torque"].any()
    [note] = [note for note in coarse.attributes["notes"] if note.startswith("stop.torque is ")]
    peak = np.sqrt(2 * 9.81 * 0.5 * np.sin(-LOWEST) / inertia) * np.sqrt(inertia * stiffness)
    assert float(note.split()[2]) == pytest.approx(peak, rel=0.01)
    output_step = float(note.split("an output_step of ")[1].split()[0])
    output_step = 1.0 / np.ceil(1.0 / output_step)  # which the end is a multiple of
    method = ROS2(output_step / np.ceil(output_step / 2e-5))
    fine = forward(bouncing(stiffness), end=1.0, output_step=output_step, method=method, check=False)
    assert np.abs(fine["stop.torque"]).max() == pytest.approx(peak, rel=0.03)
    assert not any(note.startswith("stop.torque") for note in fine.attributes["notes"])


def test_how_many_rows_are_computed_at_once_changes_no_note(monkeypatch):
    """It depends on how fast the machine is."""
    how = {"end": 1.0, "output_step": 0.05, "method": ROS2(2e-5), "check": False}
    at_once = forward(bouncing(1e6), **how).attributes["notes"]
    monkeypatch.setattr(integration, "SECONDS_PER_CALL", 1e-9)
    assert forward(bouncing(1e6), **how).attributes["notes"] == at_once
    assert any(note.startswith("stop.torque is ") for note in at_once)


def test_a_stop_that_is_not_met_between_coarse_rows_is_not_told():
    """An arm that swings back before the stop, which it would reach as fast as it is at rows."""
    swinging = forward(bouncing(1e5, lower=-np.pi - 0.05), end=4.0, output_step=0.4, method=ROS2(1e-3), check=False)
    assert not any(note.startswith("stop.torque") for note in swinging.attributes["notes"])


def test_a_run_that_goes_on_after_an_impact_tells_what_the_whole_run_does(tmp_path):
    scene, path = bouncing(1e7, damping=100.0), tmp_path / "run.nc"
    how = {"output_step": 0.05, "method": ROS2(2e-4), "check": False}
    whole = forward(scene, end=1.5, **how)
    forward(scene, end=1.0, path=path, **how)
    going_on = forward(scene, end=1.5, resume=path, **how)
    for key in ("rebounds", "missed", "notes"):
        assert going_on.attributes[key] == whole.attributes[key]


def test_a_search_takes_no_step_that_loses_rebounds():
    """However coarse the accuracy: with this stop it came to a step that throws nothing back, off by 60 %."""
    scene = bouncing(1e7, damping=2 * 0.1 * np.sqrt(1e7 * (0.0838 + 0.25)))
    result = forward(scene, end=1.0, output_step=ROW, method=Within(0.3))
    assert "rebounds" not in result.attributes
    assert result["hinge.angle"][-1] > LOWEST + 0.05  # on its way back, where the other rests at the stop


@pytest.mark.parametrize(
    "scene",
    [bouncing(1e3), bouncing(1e7, lower=-2.0), bouncing(1e7, damping=5e3), bouncing(1e5, damping=30.0)],
    ids=["resolved", "not met", "damped", "damped a little"],
)
def test_what_is_resolved_or_takes_energy_is_not(scene):
    result = forward(scene, end=END if scene.forces[0].lower == LOWEST else 0.4, output_step=ROW, method=ROS3(1e-3))
    assert not any("rebounds" in note or "has gone" in note for note in result.attributes["notes"])
    assert "rebounds" not in result.attributes


def test_a_stop_stores_what_it_takes():
    stop = bouncing(2e3).forces[0]
    depths = np.linspace(-0.5 * ENTRY, 3 * ENTRY, 701)
    forces = np.array([stop.law(None, LOWEST - depth, 0.0) for depth in depths])
    work = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(depths) * (forces[1:] + forces[:-1]))])
    np.testing.assert_allclose(stop.energy(LOWEST - depths), work, atol=1e-5 * work[-1])


SLOW = pytest.mark.slow


@pytest.mark.parametrize(
    ("stiffness", "row"), [pytest.param(1e6, 1e-3, marks=SLOW), pytest.param(1e7, 5e-3, marks=SLOW), (1e4, 1e-2)]
)
def test_an_economic_model_rebounds(stiffness, row):
    scene = bouncing(stiffness)
    found = economise(scene, [Output("hinge.angle", tolerance=0.05)], end=END, output_step=row, verify=False)
    off = np.abs(run(found.scene, found.settings)["hinge.angle"] - true(stiffness, row)).max()
    assert off <= 1.5 * found.error[0]
    assert found.error[0] <= found.limits[0]
