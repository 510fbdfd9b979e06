"""Runs that stay where the machine would not: exactly straight, upright or aligned, where no rounding disturbs them."""

from __future__ import annotations

import numpy as np
import pytest
from ffr_gallery.scene_set import CASES, STEEL, cantilever, rectangle

import ffr_dyn as fd
from ffr_dyn.analyses.forward import forward
from ffr_dyn.functions.formula import formula
from ffr_dyn.integrators import RK4, ROS2, ROS3, AdaptiveROS3, tolerances
from ffr_dyn.linear.departure import PUSH, departures
from ffr_dyn.results.result import Quantity, Result
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.forces import JointSpring, Load
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_dyn.variants.mean_axis import with_mean_axis_bodies
from ffr_prep.body import rigid_body

GROUND = {"ground": {"O": (0, 0, 0)}}
UNSTABLE = "the motion is unstable"


def column(share: object, damping: float = 0.02, plane: str = "auto") -> Scene:
    """A straight strut, clamped at its foot, under a part of its buckling load."""
    strut = cantilever("col", 1.0, rectangle(0.02, 0.01), STEEL)
    critical = np.pi**2 * 2e11 * (0.02 * 0.01**3 / 12) / 4
    push = formula(f"{-critical} * ({share})")
    clamp, load = Joint("clamp", "fixed", "ground.O", "col.a"), Load("P", "col.b", (push, 0, 0))
    return Scene((Body("col", strut, damping=damping),), (clamp,), loads=(load,), **GROUND, plane=plane)


def rod(height: float):
    return rigid_body("a", mass=2.0, inertia=[0.1, 0.2, 0.25], centre_of_mass=(0, height, 0), points={"o": (0, 0, 0)})


def pendulum(height: float, joint: str = "revolute", **more) -> Scene:
    """Exactly upright, or hanging."""
    return Scene(
        (Body("a", rod(height)),), (Joint("j", joint, "ground.O", "a.o"),), **GROUND, gravity=(0, -9.81, 0), **more
    )


def stack(load: float) -> Scene:
    """Links in a row, exactly aligned."""
    link = rigid_body(
        "l", mass=1.0, inertia=[0.1, 0.01, 0.1], centre_of_mass=(0, 0.5, 0), points={"a": (0, 0, 0), "b": (0, 1, 0)}
    )
    bodies = tuple(Body(f"l{k}", link, position=(0, k, 0)) for k in range(3))
    places = ["ground.O", "l0.b", "l1.b"]
    joints = tuple(Joint(f"j{k}", "revolute", place, f"l{k}.a") for k, place in enumerate(places))
    return Scene(bodies, joints, loads=(Load("P", "l2.b", (0, load, 0)),), **GROUND)


def spinning(axis: int) -> Scene:
    """A box that spins freely, exactly about an axis of inertia."""
    box = rigid_body("x", mass=1.0, inertia=[1, 2, 3.0], points={"c": (0, 0, 0)})
    return Scene((Body("x", box, omega_bar=tuple(5.0 * np.eye(3)[axis])),))


def told(scene: Scene, end: float, row: float, **more) -> list[str]:
    return [note for note in forward(scene, end=end, output_step=row, **more).attributes["notes"] if UNSTABLE in note]


SHAKEN = pendulum(0.3, base_acceleration=(0, formula("3*sin(20*t)"), 0))
LEAVING = {
    "strut": (column(1.5), 0.5, 0.01),
    "undamped strut": (column(1.5, 0.0), 0.5, 0.01),
    "strut under a load that grows": (column("3*t"), 1.0, 0.01),
    "strut whose frame moves as it vibrates": (with_mean_axis_bodies(column(1.5)), 0.5, 0.01),
    "strut with few rows": (column(1.5), 3.0, 0.5),
    "pendulum": (pendulum(0.3), 4.0, 0.02),
    "pendulum on a ball": (pendulum(0.3, "spherical"), 4.0, 0.02),
    "pendulum on a moving base": (SHAKEN, 4.0, 0.02),
    "stack": (stack(-50.0), 5.0, 0.05),
    "spin about the middle axis": (spinning(1), 20.0, 0.1),
}


@pytest.mark.parametrize("name", LEAVING)
def test_a_run_that_stays_where_the_machine_would_leave_is_told(name):
    scene, end, row = LEAVING[name]
    notes = told(scene, end, row, method=ROS2(row / 8))
    assert len(notes) == 1
    assert "grows to " in notes[0]


@pytest.mark.parametrize(
    "method", [ROS2(0.01), ROS3(0.02), RK4(0.02), AdaptiveROS3(tolerances(1e-6)), fd.DormandPrince(tolerances(1e-6))]
)
def test_it_is_told_with_every_method(method):
    assert told(pendulum(0.3), 4.0, 0.02, method=method, check=True)


def test_it_is_told_whatever_outputs_are_kept_and_not_without_a_check():
    scene = pendulum(0.3)
    assert told(scene, 4.0, 0.02, outputs=["j.force"])
    assert not told(scene, 4.0, 0.02, method=ROS2(0.01), check=False)


def test_a_plane_that_was_found_may_be_left_and_one_that_is_declared_not():
    """The strut is computed in the plane in which it is stiff, and buckles across it."""
    found = forward(column(1.5), end=0.5, output_step=0.01, method=ROS2(1e-3))
    assert "in the plane, normal y" in found.attributes["computed"]
    assert any(UNSTABLE in note for note in found.attributes["notes"])
    assert not told(column(1.5, plane="y"), 0.5, 0.01, method=ROS2(1e-3))


def crank(**more) -> Scene:
    joint = Joint("j", "revolute", "ground.O", "a.o")
    return Scene((Body("a", rod(0.3)),), (joint,), (Driver("d", "j", formula("5*t")),), **GROUND, **more)


HELD = JointSpring("k", "j", stiffness=20.0)
STAYING = {
    "strut below its load": (column(0.9), 0.5, 0.01),
    "strut that is pulled": (column(-1.5), 0.5, 0.01),
    "hanging": (pendulum(-0.3), 4.0, 0.02),
    "hanging on a ball": (pendulum(-0.3, "spherical"), 4.0, 0.02),
    "upright for a short time": (pendulum(0.3), 0.3, 0.02),
    "upright, held by a spring": (pendulum(0.3, forces=(HELD,)), 4.0, 0.02),
    "stack that is pulled": (stack(50.0), 5.0, 0.05),
    "spin about the first axis": (spinning(0), 20.0, 0.1),
    "spin about the last axis": (spinning(2), 20.0, 0.1),
    "driven crank": (crank(gravity=(0, -9.81, 0)), 4.0, 0.02),
    "let go": (
        Scene(
            (Body("a", rod(0.3), rotation=(0, 0, 1.0)),),
            (Joint("j", "revolute", "ground.O", "a.o"),),
            **GROUND,
            gravity=(0, -9.81, 0),
        ),
        4.0,
        0.02,
    ),
    "free fall": (Scene((Body("a", rod(0.3)),), gravity=(0, -9.81, 0)), 100.0, 1.0),
    "free spin for long": (Scene((Body("a", rod(0.3), omega_bar=(0, 0, 9.0)),)), 1000.0, 10.0),
}


@pytest.mark.parametrize("name", STAYING)
def test_stable_motions_and_those_that_are_left_slowly_are_silent(name):
    scene, end, row = STAYING[name]
    assert not told(scene, end, row, method=ROS2(row / 8))


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_the_benchmark_set_is_silent(case):
    assert not told(case.scene(), case.end, case.output_step, method=ROS2(case.output_step / 8))


def test_a_phase_that_runs_away_is_not_unstable():
    time = np.linspace(0.0, 10.0, 201)

    def run(off):
        return Result(time, {"a.position": Quantity(PUSH * off, "m")}, {}, {})

    still = run(0 * time)
    for power in (1, 2, 3):
        for most in (1e4, 1e5, 1e7):
            assert not departures(still, run(most * (time / 10) ** power), 1.0, 10.0)
    grown = departures(still, run(0.1 * np.sinh(1.5 * time)), 1.0, 10.0)
    assert grown["a.position"] == pytest.approx(0.1 * np.sinh(15.0))
    assert not departures(still, run(0.1 * np.sinh(1.5 * time)), 1.0, 5.0)  # of a run that an event has ended
