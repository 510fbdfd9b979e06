"""Driven angles are met on their own branch, from any drawn position, with their whole turns."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_analyses_kinematic import bar
from test_independence import locomotive

from ffr_dyn.analyses.assemble import assembly
from ffr_dyn.analyses.forward import forward
from ffr_dyn.analyses.kinematic import kinematic
from ffr_dyn.functions.formula import formula
from ffr_dyn.integrators import RK4
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
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
    """Cranks that were parallel end up so, at the angle of the driver; or it is refused, and never half a turn off."""
    scene = locomotive(3, drawn)
    scene = replace(scene, drivers=(Driver("motor", "foot0", formula(f"{value} + t")),))
    try:
        found = assembly(scene)
    except InputError as error:
        assert "cannot be assembled" in str(error)  # noqa: PT017 - either is right
        return
    for k in range(3):
        np.testing.assert_allclose(
            found[f"s{k}.b.position"][0], (0.7 * k + np.cos(value), np.sin(value), 0), rtol=0, atol=1e-7
        )


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
