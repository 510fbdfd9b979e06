"""The derivative of a period from those of few of its steps: beside differences of whole periods, and where it is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from synthetic import cloud
from test_dyn_plane import slider_crank

import ffr_dyn as fd
from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.linear import returning
from ffr_dyn.linear.returning import returned
from ffr_dyn.linear.step_tangents import _trigonometric, product_of_steps
from ffr_dyn.linear.turn_map import Turns, after, monodromy, period_of, placed, turns, turns_about


def engine(damping: float) -> fd.Scene:
    scene = slider_crank(loads=())
    return replace(scene, bodies=tuple(replace(b, damping=damping) if b.model.n else b for b in scene.bodies))


def at_its_motion(scene: fd.Scene, steps: int) -> Turns:
    assembled = assemble(scene)
    period = period_of(scene, 0.0)
    of = turns(assembled.system, 0.0, assembled.x, assembled.v, fd.ROS3(period / steps), period)
    found = returned(of)
    return turns_about(of, found.x, found.v)


@pytest.mark.parametrize("damping", [0.01, 0.002])
def test_it_is_that_of_whole_periods(damping):
    of = at_its_motion(engine(damping), 1000)
    M = product_of_steps(of, after(of, *placed(of, np.zeros(of.scale.size)), rows=of.rows))
    expected = monodromy(of, np.zeros(of.scale.size))
    assert M is not None
    assert np.abs(M - expected).max() < 3e-3 * np.abs(expected).max()
    largest = [np.sort(np.abs(np.linalg.eigvals(each)))[-4:] for each in (M, expected)]
    np.testing.assert_allclose(*largest, rtol=3e-3, atol=1e-6)


def test_the_interpolation_has_twelve_harmonics_exactly():
    at, phases = np.linspace(0, 1, 77, endpoint=False), 0.13 + np.arange(25) / 25
    for k in range(13):
        wave = np.exp(2j * np.pi * k * phases)
        np.testing.assert_allclose(_trigonometric(at, phases) @ wave, np.exp(2j * np.pi * k * at), atol=1e-12)


def test_steps_that_change_abruptly_are_no_smooth_function_of_time():
    """A stop that closes for a part of the period; the motion is found all the same."""
    rail = fd.rigid_body("m", mass=2.0, inertia=(1, 1, 1), points={"c": (0, 0, 0)})
    push = fd.Load("push", "m.c", force=(fd.harmonic(amplitude=20.0, frequency=2.0), 0, 0))
    scene = fd.Scene(
        (fd.Body("m", rail),),
        (fd.Joint("rail", "translational", "ground.O", "m.c", axis=(1, 0, 0)),),
        forces=(
            fd.JointSpring("spring", "rail", stiffness=50.0, damping=20.0, coordinate="stroke"),
            fd.JointStop("stop", "rail", upper=0.02, stiffness=2e4, entry=1e-3, damping=50.0, coordinate="stroke"),
        ),
        loads=(push,),
        ground={"O": (0, 0, 0)},
    )
    assembled = assemble(scene)
    of = turns(assembled.system, 0.0, assembled.x, assembled.v, fd.ROS3(0.5 / 2000), 0.5)
    found = returned(of)
    of = turns_about(of, found.x, found.v)
    assert product_of_steps(of, after(of, found.x, found.v, rows=of.rows)) is None
    assert found.record.x[:, 0].max() > 0.02
    np.testing.assert_allclose(found.record.x[-1], found.x, atol=1e-9)


def test_newtons_method_takes_it_where_mixing_stalls_by_rounding(monkeypatch):
    """Hundreds of undamped vibrations in a period, whose rates are known no better; by whole periods it took a minute."""
    monkeypatch.setattr(returning, "monodromy", lambda *_: pytest.fail("periods by differences"))
    body = cloud(6, stiffness=3000.0)
    scene = fd.Scene(
        (fd.Body("arm", body),),
        (fd.Joint("hinge", "revolute", "ground.O", "arm.a", axis=(0.3, 0.2, 1.0)),),
        drivers=(fd.Driver("motor", "hinge", fd.harmonic(amplitude=0.3, frequency=2.0)),),
        loads=(fd.Load("side", "arm.c", force=(0, 1.0, 0.5)),),
        ground={"O": (0, 0, 0)},
        gravity=(0, -9.81, 0),
    )
    assembled = assemble(scene)
    of = turns(assembled.system, 0.0, assembled.x, assembled.v, fd.ROS3(0.5 / 8000), 0.5)
    found = returned(of)
    assert found.newton
    again = after(of, found.x, found.v)
    np.testing.assert_allclose(again.x[-1], found.x, atol=1e-9)
