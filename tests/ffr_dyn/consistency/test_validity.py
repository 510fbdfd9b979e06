"""What a run says of a motion that strains its theory."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from synthetic import cloud

import ffr_dyn as fd
import ffr_prep as fp
from ffr_dyn.analyses.assemble import assembly
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.integrators import ROS2
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.material import Material
from ffr_prep.structures.frame import Member, named, polyline
from ffr_prep.structures.sections import rectangle


def spinning(spin: float, **changes) -> Scene:
    """A body of two modes, the first at 40 rad/s, that spins freely about its principal axis of most inertia."""
    body = Body("disc", replace(cloud(2), **changes.pop("model", {})), omega_bar=(0, 0, spin))
    return Scene((replace(body, **changes),), plane="none")


def notes(scene: Scene) -> list[str]:
    return integrate(scene, end=1e-3, output_step=1e-3, method=ROS2(1e-4)).attributes["notes"]


STIFFENED = {"model": {"stiffening": np.zeros((12 + 18, 2, 2))}}


def test_a_body_that_spins_near_its_first_frequency_without_stiffening_is_named():
    (note,) = notes(spinning(8.0))
    assert "body 'disc' spins without geometric stiffening" in note
    assert "at 8 rad/s, 0.2 of the first of them" in note
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


# ---- whatever the analysis ------------------------------------------------------------------------------------------

SOFT = Material("soft", 1e9, 0.3, 1000.0)
MOTOR = fd.JointEffort("motor", "hinge")


@pytest.fixture(scope="module")
def arm():
    """A strip of 1 m on a driven hinge, bent to a third of its length by a force at its end; and where it rests."""
    line = polyline([(0, 0, 0), (1, 0, 0)], Member(rectangle(0.02, 0.01), SOFT, (0, 1.0, 0)), elements=10)
    model = fp.from_frame(named(line, root=(0, 0, 0), tip=(1, 0, 0)), [InterfaceRegion("root"), InterfaceRegion("tip")])
    body = fp.reduce(model, fp.Request(name="arm", reference=fp.FixedTo("root"), reduction=fp.CraigBampton(1)))
    force = 1.2 * SOFT.E * 0.02 * 0.01**3 / 12
    scene = Scene(
        (Body("arm", body),),
        (Joint("hinge", "revolute", "ground.O", "arm.root"),),
        (fd.Driver("turn", "hinge", 0.0),),
        ground={"O": (0, 0, 0)},
        loads=(fd.Load("pull", "arm.tip", force=(0.0, force, 0.0)),),
    )
    return scene, fd.scene_at(scene, fd.static(scene))


SHORT = {"end": 0.01, "output_step": 0.01}
ANALYSES = {
    "static": fd.static,
    "assemble": assembly,
    "forward": lambda scene: integrate(scene, method=ROS2(1e-3), **SHORT),
    "reference": lambda scene: fd.reference(scene, method=fd.SciPy("DOP853", rtol=1e-6), end=1e-4, output_step=1e-4),
    "inverse": lambda scene: fd.inverse(scene, elastic=fd.Dynamic(ROS2(1e-3)), **SHORT),
    "quasi-static": lambda scene: fd.inverse(scene, elastic=fd.QuasiStatic(), **SHORT),
    "mixed": lambda scene: fd.mixed(scene, unknown=(MOTOR,), method=ROS2(1e-3), **SHORT),
}


@pytest.mark.parametrize("name", ANALYSES)
def test_every_analysis_tells_of_a_body_that_bends_too_far(arm, name):
    told = [note for note in ANALYSES[name](arm[1]).attributes["notes"] if "turns within itself" in note]
    assert len(told) == 1
    assert "body 'arm' deforms by up to 0.36 of its size" in told[0]
    assert "6 parts would do" in told[0]


def test_a_body_that_is_stretched_is_not_told_to_be_cut_into_parts(arm):
    """Under 0.3 EA along it a bar is 0.3 longer, in however many parts."""
    pulled = fd.Load("pull", "arm.tip", force=(0.3 * SOFT.E * 0.02 * 0.01, 0, 0))
    (told,) = [note for note in fd.static(replace(arm[0], loads=(pulled,))).attributes["notes"] if "deforms by" in note]
    assert "deforms by up to 0.3 of its size" in told
    assert "two of its interfaces are 0.3 of their distance farther apart" in told
    assert "parts would do" not in told


def test_a_linearisation_tells_it_too(arm):
    assert sum("turns within itself" in note for note in fd.linearise(arm[1]).notes) == 1


def test_a_kinematic_analysis_has_nothing_to_tell_as_bodies_do_not_deform(arm):
    assert not any("turns within itself" in note for note in fd.kinematic(arm[1], **SHORT).attributes["notes"])
