"""Driven angles are met on their own branch, from any drawn position, with their whole turns."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_analyses_kinematic import bar
from test_independence import locomotive

from ffr_dyn.analyses.assemble import assembly
from ffr_dyn.analyses.forward import forward
from ffr_dyn.analyses.inverse import inverse
from ffr_dyn.analyses.kinematic import kinematic
from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.functions.formula import formula
from ffr_dyn.integrators import RK4, ROS2, ROS3, DormandPrince, GeneralisedAlpha
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import rigid_body
from ffr_prep.common.errors import InputError


def arm(driven: str, drawn: float = 0.0) -> Scene:
    """A bar on a driven hinge, drawn at an angle, with another in a free hinge at its end."""
    c, s = np.cos(drawn), np.sin(drawn)
    return Scene(
        (
            Body("a", bar("a", 1.0), rotation=(0, 0, drawn)),
            Body("b", bar("b", 1.0), position=(c, s, 0), rotation=(0, 0, drawn)),
        ),
        (Joint("hinge", "revolute", "ground.O", "a.a"), Joint("elbow", "revolute", "a.b", "b.a")),
        drivers=(Driver("motor", "hinge", formula(driven)),),
        ground={"O": (0, 0, 0)},
    )


def slider_crank(driven: str) -> Scene:
    """A crank of 0.15 m and a rod of 0.45 m, drawn stretched."""
    return Scene(
        (
            Body("crank", bar("crank", 0.15)),
            Body("rod", bar("rod", 0.45), position=(0.15, 0, 0)),
            Body("slider", bar("slider", 0.1), position=(0.6, 0, 0)),
        ),
        (
            Joint("main", "revolute", "ground.O", "crank.a"),
            Joint("pin", "revolute", "crank.b", "rod.a"),
            Joint("wrist", "revolute", "rod.b", "slider.a"),
            Joint("guide", "translational", "ground.O", "slider.a", axis=(1, 0, 0)),
        ),
        drivers=(Driver("motor", "main", formula(driven)),),
        ground={"O": (0, 0, 0)},
    )


@pytest.mark.parametrize("drawn", [0.0, 2.0, -3.0])
@pytest.mark.parametrize("value", [2 * np.pi / 3, -2.5, np.pi, 3.5, 7.0, -20.0])
def test_a_driven_bar_stands_where_its_driver_says(drawn, value):
    found = assembly(arm(f"{value} + 0*t", drawn))
    np.testing.assert_allclose(found["a.b.position"][0], (np.cos(value), np.sin(value), 0), rtol=0, atol=1e-10)
    np.testing.assert_allclose(found["hinge.angle"][0], value, rtol=0, atol=1e-10)


@pytest.mark.parametrize("analysis", [kinematic, lambda scene, **span: forward(scene, method=RK4(1e-5), **span)])
@pytest.mark.parametrize("start", [2 * np.pi / 3, -2.0, 2.9, 9.0])
def test_a_slider_crank_starts_and_goes_on_at_the_angle_of_its_driver(analysis, start):
    result = analysis(slider_crank(f"{start} + 100*t"), end=2e-3, output_step=1e-3)
    angle = start + 100 * result.time
    across = 0.15 * np.sin(angle)
    expected = 0.15 * np.cos(angle) + np.sqrt(0.45**2 - across**2)
    np.testing.assert_allclose(result["slider.a.position"][:, 0], expected, rtol=0, atol=1e-8)
    np.testing.assert_allclose(result["main.angle"], angle, rtol=0, atol=1e-8)


@pytest.mark.parametrize("drawn", [0.0, 0.7, np.pi / 2])
@pytest.mark.parametrize("value", [0.3, 2.0, -2.0, 3.0])
def test_a_driven_locomotive_with_redundant_rows_is_led_through_its_singular_positions(drawn, value):
    """Cranks that were parallel end up so, at the angle of the driver."""
    scene = locomotive(3, drawn)
    found = assembly(replace(scene, drivers=(Driver("motor", "foot0", formula(f"{value} + t")),)))
    for k in range(3):
        np.testing.assert_allclose(
            found[f"s{k}.b.position"][0], (0.7 * k + np.cos(value), np.sin(value), 0), rtol=0, atol=1e-7
        )


def uneven(driven: str) -> Scene:
    """Three equal cranks that are not equally far apart, drawn in a row, and a coupler whose mass is off its middle."""
    feet = {0: 0.0, 1: 1.0, 2: 2.2}
    holes = {f"p{k}": (x, 0, 0) for k, x in feet.items()}
    crank = rigid_body("crank", mass=1.0, inertia=[0.01] * 3, points={"o": (0, 0, 0), "e": (0.3, 0, 0)})
    coupler = rigid_body("rod", mass=2.0, inertia=[0.1] * 3, centre_of_mass=(0.9, 0, 0), points=holes)
    bodies = [Body(f"c{k}", crank, position=(x, 0, 0)) for k, x in feet.items()]
    joints = [Joint(f"b{k}", "revolute", f"ground.g{k}", f"c{k}.o") for k in feet]
    joints += [Joint(f"r{k}", "revolute", f"c{k}.e", f"rod.p{k}") for k in feet]
    return Scene(
        (*bodies, Body("rod", coupler, position=(0.3, 0, 0))),
        tuple(joints),
        drivers=(Driver("motor", "b0", formula(driven)),),
        ground={f"g{k}": (x, 0, 0) for k, x in feet.items()},
        gravity=(0, -9.81, 0),
    )


@pytest.mark.parametrize("value", [1e-4, 0.3, -0.5, 2.0, 3.1, -2.5, 7.0])
def test_cranks_drawn_in_a_row_are_led_from_there(value):
    found = assembly(uneven(f"{value} + t"))
    for k in range(3):
        np.testing.assert_allclose(np.sin(found[f"b{k}.angle"][0] - value), 0, atol=1e-8)
        np.testing.assert_allclose(np.cos(found[f"b{k}.angle"][0] - value), 1, atol=1e-8)


@pytest.mark.parametrize("method", [ROS2(1e-2), ROS3(1e-3), RK4(1e-3), GeneralisedAlpha(1e-3), DormandPrince()])
def test_a_motion_that_starts_with_cranks_in_a_row_keeps_them_parallel(method):
    """First-order velocities leave two motions free there; the rows agree about accelerations for one of them alone."""
    result = forward(uneven("6 * t"), end=2.0, output_step=0.01, method=method, check=False)
    for k in range(3):
        np.testing.assert_allclose(result[f"b{k}.angle"], 6 * result.time, rtol=0, atol=1e-8)
    assert result.attributes["degrees_of_freedom"] == 0
    assert any("starts in a singular position" in note for note in result.attributes["notes"])


@pytest.mark.parametrize("analysis", [inverse, kinematic])
def test_inverse_dynamics_and_kinematics_start_there(analysis):
    result = analysis(uneven("6 * t"), end=1.0, output_step=0.01)
    effort = 2.0 * 9.81 * 0.3 * np.cos(6 * result.time)  # what lifts the coupler, which does not turn
    np.testing.assert_allclose(result["motor.effort"], effort, rtol=0, atol=1e-6)


def test_speeds_given_to_free_cranks_in_a_row_become_those_of_a_motion():
    """As fast as given; parallel, which these are not."""
    scene = replace(uneven("t"), drivers=())
    bodies = tuple(
        replace(body, omega_bar=(0, 0, 1.0 + 0.2 * k)) if body.name != "rod" else replace(body, velocity=(0, 0.3, 0))
        for k, body in enumerate(scene.bodies)
    )
    assembled = assemble(replace(scene, bodies=bodies))
    speeds = [assembled.v[assembled.system.layout.omega(b)][2] for b in range(4)]
    np.testing.assert_allclose(speeds, [speeds[0]] * 3 + [0.0], atol=1e-7)
    assert speeds[0] > 0.8


def test_an_angle_that_is_out_of_reach_is_refused():
    """The rocker of a four-bar with links 1, 0.3, 1, 0.9 m swings; half a turn is not for it."""
    scene = Scene(
        (Body("a", bar("a", 0.9)), Body("b", bar("b", 1.0), position=(0.9, 0, 0), rotation=(0, 0, 1.0))),
        (
            Joint("hinge", "revolute", "ground.O", "a.a"),
            Joint("knee", "revolute", "a.b", "b.a"),
            Joint("end", "spherical", "ground.Q", "b.b"),
        ),
        drivers=(Driver("motor", "hinge", formula("pi + t")),),
        ground={"O": (0, 0, 0), "Q": (1.5, 0, 0)},
    )
    with pytest.raises(InputError, match="the mechanism cannot be assembled"):
        assembly(scene)


def test_what_assembly_moves_and_turns_far_is_named():
    notes = assembly(arm("2 + 0*t")).attributes["notes"]
    assert any(
        "body 'a' was changed: position by" in note or "body 'a' was changed: attitude by 2 rad" in note
        for note in notes
    )
    notes = forward(arm("2 + 0*t"), end=0.01, output_step=0.01, method=RK4(1e-3)).attributes["notes"]
    assert any(
        "moved body 'b' by" in note and "turned body 'a' by 2 rad, the most of 2 bodies," in note for note in notes
    )
