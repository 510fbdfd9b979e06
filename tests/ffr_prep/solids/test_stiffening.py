"""Geometric stiffening of solids: symmetry, buckling, and the cases that linear theory gets wrong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from boxes import STEEL, box_mesh
from places import REFERENCE
from test_dyn_references import MESHES, slider_crank

import ffr_prep as fp
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.consistency.assemble import flattened
from ffr_dyn.functions.time_functions import user
from ffr_dyn.integrators import RK4, ROS2, ROS3
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import load_body, save_body, truncated, with_point
from ffr_prep.mesh.mesh import read_mesh
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.material import Material
from ffr_prep.model.reference import FixedTo, MeanAxis, SimplySupported
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.reduction.methods.eigenmodes import Eigenmodes

INERTIAL = 12


@pytest.fixture(scope="module")
def rod():
    """The rod of the flexible slider-crank, pinned at both ends."""
    return fp.reduce(
        fp.from_mesh(
            read_mesh(MESHES / "slidercrank_rod.geo"),
            Material("steel", 2e11, 0.3, 7870.0),
            [InterfaceRegion("crankpin", kind="mean"), InterfaceRegion("slider", kind="mean")],
        ),
        fp.Request(name="rod", reference=SimplySupported("crankpin", "slider"), reduction=CraigBampton(8)),
    )


@pytest.mark.slow
def test_matrices_are_symmetric_and_one_for_each_load(rod):
    assert rod.stiffening.shape == (INERTIAL + 12, rod.n, rod.n)
    np.testing.assert_array_equal(rod.stiffening, rod.stiffening.transpose(0, 2, 1))
    assert not rod.stiffening.flags.writeable


@pytest.mark.slow
def test_a_pinned_column_buckles_at_eulers_load(rod):
    """Compression at the roller, Omega^2 + P K_sigma singular at P = pi^2 E I / L^2."""
    push = -rod.stiffening[INERTIAL + 6]  # unit force along -x at the second interface
    scaled = push / np.sqrt(np.outer(rod.omega2, rod.omega2))
    critical = -1.0 / np.linalg.eigvalsh(scaled).min()
    euler = np.pi**2 * 2e11 * np.pi * 0.006**4 / 64 / 0.3**2
    assert critical == pytest.approx(euler, rel=5e-3)


def test_loads_on_the_support_stress_nothing(rod):
    """The pin's forces go straight into the support."""
    assert np.abs(rod.stiffening[INERTIAL : INERTIAL + 3]).max() < 1e-9 * np.abs(rod.stiffening).max()


def test_in_the_mean_axis_frame_a_uniform_acceleration_stresses_nothing():
    body = fp.reduce(
        fp.from_mesh(box_mesh("hex20", (1.0, 0.1, 0.1), (4, 1, 1)), STEEL, [InterfaceRegion("left")]),
        fp.Request(name="beam", reference=MeanAxis(), reduction=Eigenmodes(4)),
    )
    largest = np.abs(body.stiffening[6:12]).max()
    assert np.abs(body.stiffening[:6]).max() < 1e-8 * largest


def test_the_body_keeps_its_stiffening(rod, tmp_path):
    again = load_body(save_body(rod, tmp_path / "rod.ffr"))
    np.testing.assert_array_equal(again.stiffening, rod.stiffening)
    np.testing.assert_array_equal(truncated(rod, 3).stiffening, rod.stiffening[:, :3, :3])
    extended = with_point(rod, "middle", np.array([0.15, 0, 0]))
    assert extended.stiffening.shape[0] == INERTIAL + 18
    assert extended.stiffening[-6:].any()


def deflection(rod, result) -> np.ndarray:
    middle = np.abs(rod.surface.points[:, 0] - 0.15) < 1e-6
    return result["rod.q"] @ rod.surface.Phi[middle].mean(axis=0)[1]


def test_flexible_slider_crank_with_stiffening(rod):
    """The geometrically exact beam, computed independently (see the data file): one per cent of the largest deflection."""
    result = integrate(slider_crank(rod), end=0.084, output_step=4e-4, method=ROS2(1e-5))
    w = deflection(rod, result)
    exact = np.loadtxt(REFERENCE / "slider_crank_exact.csv", delimiter=",")
    peak = np.abs(exact[:, 1]).max()
    np.testing.assert_allclose(w, np.interp(result.time, *exact.T), atol=0.01 * peak)
    assert w.max() == pytest.approx(peak, rel=0.01)


def test_stiffening_can_be_left_out_in_the_scene(rod):
    plain = replace(rod, stiffening=None)
    scene = slider_crank(rod)
    without = replace(scene, bodies=tuple(replace(b, stiffening=False) for b in scene.bodies))
    results = [
        integrate(s, end=0.008, output_step=4e-4, method=ROS2(1e-5)) for s in (without, slider_crank(plain), scene)
    ]
    np.testing.assert_array_equal(results[0]["rod.q"], results[1]["rod.q"])
    assert all(
        flattened(s, 0.0)[0].plane == "z" for s in (without, scene)
    )  # a round rod, bent in the planes of the axes
    assert np.abs(results[0]["rod.q"] - results[2]["rod.q"]).max() > 0


def test_a_stiffened_rod_bends_in_the_plane_as_in_space(rod):
    scene = slider_crank(rod)
    flat, spatial = (
        integrate(replace(scene, plane=plane), end=0.02, output_step=4e-4, method=ROS2(2e-5))
        for plane in ("auto", "none")
    )
    assert np.abs(deflection(rod, spatial)).max() > 5e-4
    np.testing.assert_allclose(deflection(rod, flat), deflection(rod, spatial), rtol=0, atol=1e-9 * 5e-4)


@pytest.mark.parametrize(("method", "step"), [(ROS2, 2e-5), (ROS3, 2e-5), (RK4, 8e-6)])
def test_order_is_kept_with_stiffening(rod, method, step):
    scene = slider_crank(truncated(rod, 8))

    def end(h: float) -> np.ndarray:
        return integrate(scene, end=0.002, output_step=0.002, method=method(h))["rod.q"][-1]

    truth = end(step / 8)
    errors = [np.abs(end(h) - truth).max() for h in (step, step / 2)]
    assert errors[1] < errors[0] / 2 ** (method.order - 0.5)
    assert errors[1] < 1e-5 * np.abs(truth).max()


# ---- spin-up of a rotating cantilever ---------------------------------------------------------------------------------

SPEED, RISE = 6.0, 15.0


def spin_up(t: float) -> tuple[float, float, float]:
    """Angle, rate and acceleration (Simo & Vu-Quoc 1986; Wu & Haug 1988)."""
    if t >= RISE:
        return SPEED * (t - RISE / 2), SPEED, 0.0
    turn = 2 * np.pi / RISE
    return (
        SPEED / RISE * (t**2 / 2 + (np.cos(turn * t) - 1) / turn**2),
        SPEED / RISE * (t - np.sin(turn * t) / turn),
        SPEED / RISE * (1 - np.cos(turn * t)),
    )


@pytest.fixture(scope="module")
def blade():
    """A solid with the constants of the case: EA = 2.8e7, EI = 1.4e4, GA_s = 1e7 N..., 1.2 kg/m, 10 m."""
    height = np.sqrt(12 * 1.4e4 / 2.8e7)
    width = 0.2
    E = 2.8e7 / (width * height)
    nu = 5 / 6 * 2.8e7 / 1e7 / 2 - 1
    body = fp.reduce(
        fp.from_mesh(
            box_mesh("hex27", (10.0, height, width), (20, 1, 1), origin=(0.0, -height / 2, -width / 2)),
            Material("blade", E, nu, 1.2 / (width * height)),
            [InterfaceRegion("left", kind="mean")],
        ),
        fp.Request(name="blade", reference=FixedTo("left"), reduction=Eigenmodes(7)),
    )
    return with_point(body, "tip", np.array([10.0, height / 2, 0.0]))


def spun(blade, *, stiffening: bool, end: float = 15.0):
    scene = Scene(
        (Body("blade", blade, stiffening=stiffening),),
        (Joint("axle", "revolute", "ground.O", "blade.left"),),
        (Driver("motor", "axle", user(spin_up)),),
        ground={"O": (0, 0, 0)},
    )
    return integrate(scene, end=end, output_step=0.1, method=ROS2(5e-3))


def test_spin_up_needs_stiffening_and_gets_it(blade):
    """Tip deflection of the geometrically exact beam (independent, 3e-7): -0.468476 at 5 s, -0.573761 at 6.8 s, ..."""
    result = spun(blade, stiffening=True)
    lateral = result["blade.tip.displacement.y"]
    found = np.interp([5.0, 6.8, 10.0, 15.0], result.time, lateral)
    np.testing.assert_allclose(found, [-0.468476, -0.573761, -0.362815, 0.001304], atol=4e-3)


def test_without_stiffening_the_spinning_blade_diverges(blade):
    lateral = spun(blade, stiffening=False, end=6.8)["blade.tip.displacement.y"]
    assert np.abs(lateral).max() > 1.0
