"""What a run says of a motion that strains its theory."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from synthetic import cloud

from ffr_dyn.analyses.integration import integrate
from ffr_dyn.integrators import ROS2
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene


def spinning(spin: float, **changes) -> Scene:
    """A body of two modes, the first at 40 rad/s, that spins freely about its principal axis of most inertia."""
    body = Body("disc", replace(cloud(2), **changes.pop("model", {})), omega_bar=(0, 0, spin))
    return Scene((replace(body, **changes),), plane="none")


def notes(scene: Scene) -> list[str]:
    return integrate(scene, end=1e-3, output_step=1e-3, method=ROS2(1e-4)).attributes["notes"]


STIFFENED = {"model": {"stiffening": np.zeros((12 + 18, 2, 2))}}


def test_a_body_that_spins_near_its_first_frequency_without_stiffening_is_named():
    (note,) = notes(spinning(8.0))
    assert "body 'disc' spins at up to 8" in note
    assert "0.2 of its first frequency" in note
    assert "off by up to 2 %" in note
    assert "diverge" not in note
    (note,) = notes(spinning(60.0))
    assert "may diverge" in note


@pytest.mark.parametrize("scene", [spinning(1.0), spinning(8.0, **STIFFENED)], ids=["slow", "stiffened"])
def test_slow_and_stiffened_bodies_are_not(scene):
    assert notes(scene) == []


def test_stiffening_that_is_switched_off_does_not_count():
    assert len(notes(spinning(8.0, stiffening=False, **STIFFENED))) == 1


def test_a_body_that_bends_far_is_named():
    model = cloud(2)
    q = 0.5 / np.abs(model.interfaces[0].phi_r).max()
    scene = Scene((Body("bent", model, q=(q, q)),), ground={"O": (0, 0, 0)})
    assert any("turns within itself" in note for note in notes(scene))


def test_a_hinged_rod_says_so_too():
    scene = Scene(
        (Body("rod", cloud(2), omega_bar=(0, 0, 8.0)),),
        (Joint("hinge", "revolute", "ground.O", "rod.a"),),
        ground={"O": (0, 0, 0)},
    )
    assert any("without geometric stiffening" in note for note in notes(scene))
