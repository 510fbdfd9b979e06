"""Outputs that are nothing but the error of the steps ask for no step; small ones that loads make do."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import ffr_dyn as fd
import ffr_prep as fp
from ffr_dyn.analyses.trials.errors import Trial, _errors
from ffr_dyn.analyses.trials.faded import without_faded
from ffr_dyn.analyses.trials.notes import _slightly
from ffr_dyn.analyses.trials.runs import Runs
from ffr_dyn.analyses.trials.search import _excess
from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.consistency.step_error import SLIGHT, Beside, StepError, natural_units
from ffr_dyn.results.result import Quantity, Result
from ffr_prep.body import FlexibleBody

SPEED, END, ROW = 1000.0, 0.02, 1e-3


@cache
def shaft(length: float = 0.3, diameter: float = 0.03) -> FlexibleBody:
    member = fp.Member(fp.circle(diameter), fp.material("steel"))
    line = fp.polyline([(0, 0, 0), (length, 0, 0)], member, elements=8)
    ends = fp.named(line, root=(0, 0, 0), tip=(length, 0, 0))
    model = fp.from_frame(ends, [fp.InterfaceRegion("root"), fp.InterfaceRegion("tip")])
    return fp.reduce(model, fp.Request(name="shaft", reference=fp.FixedTo("root"), reduction=fp.CraigBampton(3)))


def turning(**changes) -> fd.Scene:
    """A shaft that a motor turns evenly in one bearing."""
    body = fd.Body("shaft", shaft(), damping=0.02, omega_bar=(SPEED, 0, 0))
    bearing = fd.Joint("bearing", "revolute", "ground.O", "shaft.root", axis=(1, 0, 0))
    motor = fd.Driver("motor", "bearing", fd.polynomial(0, SPEED))
    return fd.Scene((body,), (bearing,), (motor,), ground={"O": (0, 0, 0)}, **changes)


def test_the_torque_of_a_rotor_that_nothing_loads_asks_for_no_step():
    """Its torque is zero, and what a run shows of it falls with the square of the step."""
    found = fd.forward(turning(), end=END, output_step=ROW)
    error, share = found.attributes["errors"]["motor.moment"]
    assert found.attributes["output_step"] / 70 < float(str(found.attributes["method"]).split("=")[1][:-1])
    assert np.abs(found["motor.moment"]).max() < 10 * error < 1.0
    assert share < 1e-3
    assert not any("motor.moment" in note for note in found.attributes["notes"])


def test_a_small_deflection_that_a_load_makes_keeps_its_relative_error():
    """Nanometres of a shaft that centrifugal forces of 5e4 N stretch nowhere: the finer run is within the error told."""
    pushed = fd.Load("push", "shaft.tip", force=(0, 0, fd.formula("1e-3*sin(200*t)")))
    scene = turning(loads=(pushed,))
    found = fd.forward(scene, end=END, output_step=ROW)
    fine = fd.forward(scene, end=END, output_step=ROW, method=fd.ROS2(ROW / 1000), check=False)
    for name in ("shaft.tip.displacement", "shaft.tip.position", "bearing.force"):
        error, share = found.attributes["errors"][name]
        span = np.ptp(fine[name], axis=0).max()
        assert np.abs(found[name] - fine[name]).max() <= error
        assert error <= 1e-3 * span
        assert share == pytest.approx(error / span, rel=1e-2) or name.endswith("position")


def test_a_stiff_part_under_real_loads_counts_by_its_own_deflection():
    """A stub that is 1.6 times as long as thick, which 100 N bend by a ten-thousandth of a millimetre."""
    body = fd.Body("stub", shaft(0.05, 0.04), damping=0.02)
    load = fd.Load("push", "stub.tip", force=(0, fd.formula("100*sin(300*t)**2"), 0))
    wall = fd.Joint("wall", "fixed", "ground.O", "stub.root")
    found = fd.forward(fd.Scene((body,), (wall,), loads=(load,), ground={"O": (0, 0, 0)}), end=END, output_step=ROW)
    span = np.ptp(found["stub.tip.displacement"], axis=0).max()
    assert span < 10 * SLIGHT * natural_units(found)("m")
    error, share = found.attributes["errors"]["stub.tip.displacement"]
    assert share == pytest.approx(error / span)
    assert share < 1e-3


def test_only_what_falls_with_the_step_is_held_against_the_scene():
    """Of two runs, made up: a torque that falls as the square of the step, one that stays, one that is large."""
    scene = turning()
    how = {"end": END, "output_step": ROW, "check": False}
    run = fd.forward(scene, method=fd.ROS2(ROW / 10), **how)
    runs = Runs(scene, assemble(scene), 0.0, ROW, {}, "as-given")
    shape = np.sin(np.arange(run.time.size) ** 2.0)

    def torque(size: float) -> Result:
        return replace(run, quantities={**run.quantities, "motor.moment": Quantity(size * shape, "N m")})

    def errors(here: float, there: float):
        one, other = (torque(size) for size in (here, there))
        beside = Beside(other, 2.0)
        told = _errors(one, beside, 2.0, ())
        return told["motor.moment"], without_faded(told, one, beside, runs)["motor.moment"]

    told, kept = errors(1e-3, 4e-3)
    assert kept.faded
    assert kept.error == told.error
    assert kept.of_range < 1e-3 < told.of_range
    for here, there in ((1e-3, -1e-3), (1e-3, 1.1e-3), (1e4, 4e4)):
        told, kept = errors(here, there)
        assert kept == told


@pytest.mark.parametrize(("moved", "wanted"), [(1e-8, 0.0), (1e-4, 0.5)], ids=["deflected", "moving"])
def test_positions_that_only_ring_with_deflections_ask_for_no_step(moved, wanted):
    """Of a scene of a metre, whose deflections ring: a point that moves by no more than these, and one that travels."""
    time = np.linspace(0.0, 1.0, 11)
    wave = np.sin(time**2)
    histories = {"b.tip.position": moved * wave, "b.tip.displacement": 1e-9 * wave}
    quantities = {name: Quantity(values, "m") for name, values in histories.items()}
    errors = {name: StepError(0.5 * np.ptp(values), 0.5, True) for name, values in histories.items()}
    trial = Trial(fd.ROS2(1e-3), 1, Result(time, quantities, {}, {"length": 1.0, "mass": 1.0}), errors=errors)
    assert _excess(trial, {"b.tip.displacement"}, []) == wanted
    assert _excess(trial, set(), []) == 0.5
    assert ("no point is off more than" in _slightly(trial, errors)) == (moved < 1e-6)
