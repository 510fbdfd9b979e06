"""A spatial four-bar with a flexible rocker: forward under a known torque, then mixed with the torque unknown finds it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from planar_beam import planar_beam
from scipy.spatial.transform import Rotation
from test_analyses_kinematic import bar

from ffr_dyn.analyses.efforts import JointEffort, recorded
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.analyses.mixed import Causal, mixed
from ffr_dyn.consistency.mobility import mobility
from ffr_dyn.functions.formula import formula
from ffr_dyn.integrators import RK4
from ffr_dyn.integrators.stabilisation import Projection
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.forces import Actuator
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene

END, STEP = 0.2, 1e-4
MOTOR = JointEffort("torque", "bearing")


def along(direction: np.ndarray) -> Rotation:
    """Turns x to the direction."""
    return Rotation.align_vectors([direction / np.linalg.norm(direction)], [[1, 0, 0]])[0]


def four_bar() -> Scene:
    """A crank about z, a coupler between a ball and a universal joint, a rocker that bends both ways about a skew axis."""
    pin, pivot = np.array([0.2, 0, 0]), np.array([0.9, 0.4, -0.3])
    arm = 0.5 * np.array([-0.1, 0.3, 1.0]) / np.sqrt(1.1)
    rod = pivot + arm - pin
    axis = np.cross(arm, [0.2, 1.0, -0.3])
    cross = np.cross(rod, axis)
    coupler, rocker = along(rod), along(arm)
    beam = planar_beam("rocker", 0.5, 0.6, 5.0, 2, out_of_plane=True)
    return Scene(
        (
            Body("crank", bar("crank", 0.2)),
            Body("coupler", bar("coupler", np.linalg.norm(rod)), position=pin, rotation=coupler.as_rotvec()),
            Body("rocker", beam, position=pivot, rotation=rocker.as_rotvec(), damping=0.02),
        ),
        (
            Joint("bearing", "revolute", "ground.O", "crank.a"),
            Joint("ball", "spherical", "crank.b", "coupler.a"),
            Joint(
                "cross",
                "universal",
                "coupler.b",
                "rocker.tip",
                axis=coupler.inv().apply(cross),
                axis_j=rocker.inv().apply(axis),
            ),
            Joint("pivot", "revolute", "ground.P", "rocker.root", axis=axis, axis_j=rocker.inv().apply(axis)),
        ),
        ground={"O": (0, 0, 0), "P": tuple(pivot)},
        gravity=(0, 0, -9.81),
    )


def torque(t: np.ndarray) -> np.ndarray:
    return 0.2 + 0.6 * np.sin(12 * t)


@pytest.fixture(scope="module")
def run():
    pushed = replace(four_bar(), forces=(Actuator("motor", "bearing", force=formula("0.2 + 0.6 * sin(12 * t)")),))
    return integrate(pushed, end=END, output_step=2 * STEP, method=RK4(STEP), stabilisation=Projection(1e-13))


def known(run) -> Scene:
    return replace(four_bar(), drivers=(Driver("turn", "bearing", recorded(run.time, run["bearing.angle"], degree=7)),))


def test_it_moves_in_space_and_bends(run):
    assert mobility(four_bar()).degrees_of_freedom == 1 + 4
    assert np.abs(run["bearing.angle"]).max() > 0.2
    assert (np.ptp(run["coupler.b.position"], axis=0) > 1e-3).all()
    assert (np.abs(run["rocker.tip.displacement"]).max(axis=0)[1:] > 1e-3).all()


def test_the_torque_comes_back_as_the_multiplier_of_the_known_angle(run):
    """To 1e-7 of a torque of 0.8 N m, the motion to 1e-10 m."""
    back = mixed(known(run), unknown=(MOTOR,), end=END, output_step=2 * STEP, method=RK4(STEP))
    assert "collocated" in back.attributes["analysis"]
    np.testing.assert_allclose(back["torque.effort"], torque(run.time), rtol=0, atol=1e-7)
    np.testing.assert_allclose(back["rocker.tip.position"], run["rocker.tip.position"], rtol=0, atol=1e-10)
    np.testing.assert_allclose(back["pivot.force"], run["pivot.force"], rtol=0, atol=1e-5)


@pytest.mark.slow
def test_the_torque_comes_back_as_a_servo_force(run):
    """The same by integration of the internal dynamics, another method with another step: to 2e-8 N m."""
    back = mixed(known(run), unknown=(MOTOR,), end=END, output_step=0.02, solution=Causal())
    assert "causal" in back.attributes["analysis"]
    np.testing.assert_allclose(back["torque.effort"], torque(back.time), rtol=0, atol=2e-8)
    np.testing.assert_allclose(back["rocker.tip.position"], run["rocker.tip.position"][::100], rtol=0, atol=1e-9)
