"""Body and result files that earlier versions wrote are read: a steel beam 0.5 m long, and 0.05 s of its swing on a spring.

Both were written by the version before the packages were split into rooms; the figures are those that it printed.
"""

from dataclasses import replace

import numpy as np
import pytest
from places import REFERENCE

from ffr_dyn.analyses.integration import integrate
from ffr_dyn.integrators import ROS3
from ffr_dyn.results.file import load_result
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import load_body
from ffr_prep.model.reference import MeanAxis
from ffr_prep.reduction.conversion import with_reference

OMEGA2 = [3.47221170e5, 1.38349106e6, 5.58162938e6, 3.59323768e7, 5.36455058e7, 6.77641736e7]


def test_a_body_file_is_read():
    body = load_body(REFERENCE / "rod_first_plan.ffr")
    assert body.name == "rod"
    assert body.mass == pytest.approx(0.785, rel=1e-12)
    np.testing.assert_allclose(body.omega2[:6], OMEGA2, rtol=1e-8)
    assert [interface.name for interface in body.interfaces] == ["a", "b"]
    assert body.stiffening.shape == (24, 9, 9)
    assert body.surface.beams is not None
    assert body.provenance["reference"]["type"] == "SimplySupported"


def test_a_result_file_is_read():
    result = load_result(REFERENCE / "run_first_plan.nc")
    assert result.time.size == 11
    assert len(result.quantities) == 23
    np.testing.assert_allclose(result["rod.b.position"][-1], [0.49975594, -0.01562072, 0.0], atol=1e-8)
    np.testing.assert_allclose(result["hinge.force"][-1], [-0.25088427, 3.56890012, 0.0], atol=1e-8)
    assert result.quantities["spring.tension"].unit == "N"
    assert result.attributes["title"] == "old result"


def test_a_body_of_before_moves_to_second_order():
    """Its load matrices are the second derivatives of its displacement: its frame does not matter."""
    body = load_body(REFERENCE / "rod_first_plan.ffr")
    converted, linear = with_reference(body, MeanAxis()), replace(body, stiffening=None)
    own, other, linear = map(tip_of, (body, converted, linear))
    np.testing.assert_allclose(own, other, rtol=0, atol=1e-10)
    assert np.abs(own - linear).max() > 1e-9


def tip_of(body):
    scene = Scene(
        (Body("rod", body, omega_bar=(0, 0, 60.0)),),
        (Joint("hinge", "revolute", "ground.O", "rod.a"),),
        ground={"O": (0, 0, 0)},
        gravity=(0, -9.81, 0),
    )
    return integrate(scene, end=0.02, output_step=0.01, method=ROS3(1e-4))["rod.b.position"]
