"""Steps end where a stop is met, entered and left, so that methods keep their order and two runs tell an error."""

from __future__ import annotations

import re
from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import PchipInterpolator
from scipy.optimize import brentq
from test_dyn_plane import rod

from ffr_dyn.analyses.forward import forward
from ffr_dyn.functions.curves import Curve, corners
from ffr_dyn.integrators import RK4, ROS2, ROS3, GeneralisedAlpha, HalfExplicit
from ffr_dyn.scene.forces import Bushing, JointSpring, JointStop, SpringDamper
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import rigid_body

END, ROW = 0.1, 0.01
BLOCK = rigid_body("block", mass=1.0, inertia=(1.0, 1.0, 1.0), points={"c": (0, 0, 0)})
# Stiffness, entry, damping, speed: the first entry is crossed in 1e-5 s.
STOPS = {
    "short entry": (1e6, 1e-5, 20.0, 1.0),
    "undamped": (4e5, 4e-6, 0.0, 1.0),
    "damped": (1e5, 2e-5, 120.0, 3.0),
    "long entry": (2e4, 8e-4, 60.0, 1.0),
}


def stop(stiffness, entry, damping):
    ends = {"lower": -0.01, "upper": 0.01}
    return JointStop("stop", "guide", stiffness=stiffness, entry=entry, damping=damping, coordinate="stroke", **ends)


def backlash(stiffness, corner, end=0.01):
    """A curve of a spring that is slack up to its ends, and stiff from a short corner on."""
    steep, beyond = stiffness * corner / 2, stiffness * 0.1
    at = np.array([end, end + corner, end + corner + 0.1])
    return Curve([*-at[::-1], *at], [-steep - beyond, -steep, 0, 0, steep, steep + beyond])


def spring(curve):
    return JointSpring("stop", "guide", stiffness=curve, coordinate="stroke")


def bushing(curve):
    return Bushing("stop", "ground.o", "block.c", stiffness=[curve, 0, 0, 0, 0, 0])


def catch(curve):
    """Along a line that begins 1 m away, where a curve ends before."""
    return SpringDamper("stop", "ground.far", "block.c", stiffness=curve, free_length=1.0)


def between_stops(stiffness, entry, damping, speed):
    """A mass of 1 kg that slides without friction."""
    return held_by(stop(stiffness, entry, damping), speed)


def held_by(force, speed):
    guide = Joint("guide", "translational", "ground.o", "block.c", axis=(1, 0, 0))
    body, kind = Body("block", BLOCK, velocity=(speed, 0, 0)), {force.table: (force,)}
    return Scene((body,), (guide,), ground={"o": (0, 0, 0), "far": (-1.0, 0, 0)}, **kind)


@cache
def true(name):
    """(T,) strokes, by another solver, whose steps no kink misleads: they are as fine as they must be."""
    *numbers, speed = STOPS[name]
    law = stop(*numbers).law
    return solved(lambda x, v: law(None, x, v), speed)


def solved(force, speed):
    times = np.linspace(0, END, 1 + round(END / ROW))
    how = {"t_eval": times, "rtol": 1e-11, "atol": 1e-14, "max_step": 1e-4}
    return solve_ivp(lambda t, y: [y[1], force(*y)], (0, END), [0, speed], **how).y[0]


def kink_of(kink, rate):
    """The coordinate of a kink at a rate; none of a kink that no coordinate comes to."""
    a, b, c, d = kink[:4]
    return -(a + c * rate) / (b + d * rate) if b + d * rate else np.nan


@pytest.mark.parametrize("rate", [-1.0, -0.05, 0.0, 0.05, 1.0])
@pytest.mark.parametrize("numbers", [(1e5, 1e-4, 0.0), (1e5, 1e-4, 20.0), (1e5, 1e-2, 400.0)])
def test_the_kinks_of_a_stop_are_those_of_its_law(numbers, rate):
    """Where it is met, where it is entered, and from where on damping would pull."""
    force = stop(*numbers)
    told = np.array([kink_of(kink, rate) for kink in force.kinks])
    told = told[np.isfinite(told)]
    for end, out in ((-0.01, -1.0), (0.01, 1.0)):
        places = [end, end + out * force.entry]
        if force.damping and rate * out < 0:  # on its way out, where it would pull from a depth on

            def raw(depth, rate=rate, out=out):
                share = min(depth / force.entry, 1.0)
                elastic = depth - force.entry * share * (1 - share / 2)
                return force.stiffness * elastic + force.damping * rate * out * share**2 * (3 - 2 * share)

            deepest = force.entry + abs(rate) * force.damping / force.stiffness
            if raw(1e-6 * force.entry) < 0:
                places.append(end + out * brentq(raw, 1e-6 * force.entry, deepest))
        for place in places:
            assert np.abs(told - place).min() < 1e-9


@pytest.mark.parametrize("name", STOPS)
def test_errors_of_impacts_are_told(name):
    """Of an entry that is crossed within a step, two runs agreed or not by chance: the first was off by 15 times what was
    told."""
    for how in ({}, {"method": ROS2(5e-5), "check": True}, {"method": RK4(1e-4), "check": True}):
        result = forward(between_stops(*STOPS[name]), end=END, output_step=ROW, **how)
        error = np.abs(result["block.c.position"][:, 0] - true(name)).max()
        assert 0.3 < result.attributes["errors"]["block.c.position"][0] / error < 8


@pytest.mark.parametrize("kind", [spring, bushing, catch])
@pytest.mark.parametrize(("stiffness", "corner", "speed"), [(1e6, 7e-6, 1.0), (2e6, 1.5e-6, 3.0), (5e5, 6e-4, 3.0)])
def test_errors_at_corners_of_curves_are_told(kind, stiffness, corner, speed):
    """As of stops; the second was off by 7 times what was told."""
    curve = backlash(stiffness, corner)
    through = PchipInterpolator(curve.at, curve.values)
    true = solved(lambda x, v: -float(through(x)), speed)
    for how in ({}, {"method": ROS2(ROW / np.ceil(20 * ROW * np.sqrt(stiffness))), "check": True}):
        result = forward(held_by(kind(curve), speed), end=END, output_step=ROW, **how)
        error = np.abs(result["block.c.position"][:, 0] - true).max()
        assert 0.3 < result.attributes["errors"]["block.c.position"][0] / error < 8


@pytest.mark.parametrize(("force", "of"), [(spring, "force"), (catch, "tension")])
def test_a_push_between_rows_is_told(force, of):
    """As of a stop; all rows show zero."""
    result = forward(held_by(force(backlash(1e6, 7e-6)), 1.0), end=0.05, output_step=0.01)
    assert np.abs(result[f"stop.{of}"]).max() < 1e-6
    assert any(
        re.search(rf"stop\.{of} is 778 N between rows and \S+ N at most in them", n) for n in result.attributes["notes"]
    )


def test_smooth_curves_have_no_corners():
    """Whatever they are given by, but for a few places where their slope has changed by much."""
    for points, most in ((3, 0), (12, 0), (200, 16), (2000, 16)):
        at = np.linspace(-np.pi, np.pi, points)
        assert len(corners(Curve(at, np.sin(at)))) <= most
        assert corners(Curve(at, 3 * at)) == []


@pytest.mark.parametrize("count", [2, 20])
def test_a_corner_is_found_however_it_is_given(count):
    """By one piece, within which there are more places, or by many."""
    at = np.linspace(0, 1e-4, count)
    curve = Curve([-1.0, *at, 1.0], [0.0, *(at**2 / 2e-4), 1.0])
    found = np.array(corners(curve))
    assert ((found >= 0) & (found <= 1e-4)).all()
    assert np.diff([0, *found, 1e-4]).max() < 0.5e-4


@pytest.mark.parametrize(("method", "order"), [(ROS2, 2), (ROS3, 3), (HalfExplicit, 4), (GeneralisedAlpha, 2)])
def test_a_method_keeps_its_order_over_an_impact(method, order):
    """Wherever within a step the stop is met and left; with steps over both the error came and went by chance."""
    scene = between_stops(1e5, 1e-6, 0.0, 1.0)

    def ends(method):
        return forward(scene, end=0.024, output_step=0.024, method=method, check=False)["block.c.position"][-1, 0]

    counts = np.array([100, 127, 160, 200, 252])
    errors = np.abs([ends(method(0.024 / count)) for count in counts] - ends(RK4(1e-6)))
    assert -np.polyfit(np.log(counts), np.log(errors), 1)[0] == pytest.approx(order, abs=0.1)
    np.testing.assert_allclose(errors * counts**order, errors[0] * counts[0] ** order, rtol=0.1)


def test_errors_of_a_damped_stop_on_a_rod_that_bends_are_told():
    """It holds the hinged end back within microseconds while it pushes, and not at all where it would pull: methods come down
    to order one, and what was told by their own was 8 times too small."""
    hinge = Joint("hinge", "revolute", "ground.o", "rod.a")
    scene = Scene(
        (Body("rod", rod("rod", 0.8, stiffening=True), damping=0.02),),
        (hinge,),
        forces=(JointStop("stop", "hinge", stiffness=1.1e4, entry=2.3e-3, lower=-0.3, damping=20.0),),
        ground={"o": (0, 0, 0)},
        gravity=(0, -9.81, 0),
    )
    times = {"end": 0.4, "output_step": ROW}
    true = forward(scene, **times, method=ROS3(ROW / 1024), check=False)["hinge.angle"]
    result = forward(scene, **times, method=ROS3(ROW / 64), check=True)
    assert 0.3 < result.attributes["errors"]["hinge.angle"][0] / np.abs(result["hinge.angle"] - true).max() < 5


def test_steps_are_no_shorter_where_nothing_is_met():
    scene = between_stops(1e6, 1e-5, 20.0, 1.0)
    before = forward(scene, end=0.009, output_step=0.001, method=ROS2(1e-4), check=False)
    beyond = forward(scene, end=0.012, output_step=0.001, method=ROS2(1e-4), check=False)
    assert before.attributes["evaluations"] < 2.3 * 90 + 10
    assert beyond.attributes["evaluations"] > before.attributes["evaluations"] + 2 * 30
