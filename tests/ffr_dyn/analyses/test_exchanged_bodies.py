"""Second-order bodies by way of the files of other programs: the load matrices that come back, and the motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ffr_dyn.analyses.integration import integrate
from ffr_dyn.integrators import ROS3
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import load_body, save_body
from ffr_prep.interchange.mbdyn import left_out, read_fem, write_fem
from ffr_prep.interchange.sid import read_sid, write_sid
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.material import Material
from ffr_prep.model.reference import FixedTo, MeanAxis, SimplySupported
from ffr_prep.pipelines.reduce import Request, reduce
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.structures.frame import Member, named, polyline
from ffr_prep.structures.model import from_frame
from ffr_prep.structures.sections import rectangle

RATES, PRODUCTS, INTERFACES = slice(0, 6), slice(6, 12), slice(12, None)
WAYS = {
    "body file": lambda body, path: load_body(save_body(body, path)),
    "fem": lambda body, path: read_fem(write_fem(body, path, kind="full")),
    "sid": lambda body, path: read_sid(write_sid(body, path)),
}


@pytest.fixture(scope="module", params=[FixedTo("root"), SimplySupported("root", "tip"), MeanAxis()], ids=repr)
def strip(request):
    """One metre of a soft strip, and its swing from rest under gravity across both of its planes."""
    soft = Member(rectangle(0.02, 0.01), Material("soft", 1e9, 0.3, 1000.0), (0, 1.0, 0))
    line = named(polyline([(0, 0, 0), (1, 0, 0)], soft, elements=10), root=(0, 0, 0), tip=(1, 0, 0))
    model = from_frame(line, [InterfaceRegion("root"), InterfaceRegion("tip")])
    body = reduce(model, Request(name="strip", reference=request.param, reduction=CraigBampton(2)))
    return body, swing(body)


def swing(body, **treated):
    scene = Scene(
        (Body("strip", body, **treated),),
        (Joint("hinge", "revolute", "ground.O", "strip.root"),),
        ground={"O": (0, 0, 0)},
        gravity=(0, -9.81, 1.0),
    )
    return integrate(scene, end=0.3, output_step=0.1, method=ROS3(1e-3))


@pytest.mark.parametrize("way", WAYS)
def test_a_body_that_went_round_moves_alike(strip, way, tmp_path):
    body, expected = strip
    found = swing(WAYS[way](body, tmp_path / "strip"))
    assert found.attributes["notes"] == expected.attributes["notes"]
    for name, size in (("tip.position", 1.0), ("R", 1.0), ("p", 1.0), ("q", np.abs(expected["strip.q"]).max())):
        np.testing.assert_allclose(found[f"strip.{name}"], expected[f"strip.{name}"], rtol=0, atol=1e-9 * size)
    linear = swing(body, stiffening=False)
    assert np.abs(linear["strip.tip.position"] - expected["strip.tip.position"]).max() > 1e-4


def test_files_of_mbdyn_hold_all_load_matrices_or_tell_that_they_do_not(strip, tmp_path):
    body, _ = strip
    np.testing.assert_array_equal(WAYS["fem"](body, tmp_path / "b.fem").stiffening, body.stiffening)
    assert left_out(body, kind="full") == ()
    assert left_out(body, kind="legacy") == ("the geometric stiffness of the body was left out",)
    assert left_out(replace(body, stiffening=None), kind="legacy") == ()


def test_standard_input_data_hold_the_sum_with_the_mass(strip, tmp_path):
    """All load matrices but those of the products of the angular velocity, which stand in Oe.m1 with the mass: how it is
    divided is guessed and told, and second-order bodies know the sum alone."""
    body, _ = strip
    back = WAYS["sid"](body, tmp_path / "b.SID_FEM")
    scale = np.abs(body.stiffening).max()
    for loads in (RATES, INTERFACES):
        np.testing.assert_allclose(back.stiffening[loads], body.stiffening[loads], rtol=0, atol=1e-12 * scale)
    K, PP = (np.subtract(getattr(back, of), getattr(body, of)) for of in ("stiffening", "PP_dm"))
    moved = PP + PP.transpose(1, 0, 2, 3)
    for k, (a, b) in enumerate([(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]):
        of_mass = PP[a, a] - np.einsum("kkij->ij", PP) if a == b else moved[a, b]
        np.testing.assert_allclose(K[PRODUCTS][k], -of_mass, rtol=0, atol=1e-12 * scale)
    (warning,) = back.provenance["warnings"]
    assert "Oe.m1 holds geometric stiffness beside inertia" in warning
    assert "their sum is kept" in warning
