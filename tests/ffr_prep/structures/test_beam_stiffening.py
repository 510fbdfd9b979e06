"""Geometric stiffening of beams: buckling loads, rotating beams, and motions against geometrically exact beams."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg
from boxes import box_mesh, rotation
from places import REFERENCE
from test_dyn_references import slider_crank

import ffr_prep as fp
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.functions.time_functions import user
from ffr_dyn.integrators import ROS2
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import FlexibleBody, truncated
from ffr_prep.body.accelerations import unit_accelerations
from ffr_prep.body.planar import in_plane
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.material import Material
from ffr_prep.model.reference import FixedTo, MeanAxis, SimplySupported
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.reduction.methods.eigenmodes import Eigenmodes
from ffr_prep.structures.frame import Member, named, polyline
from ffr_prep.structures.sections import Section, circle, general, rectangle, shear_rigid, with_mass_moments

STEEL = Material("steel", 2e11, 0.3, 7870.0)
TENSION = 12 + 6  # a force along x at the second interface
ACROSS = 3 + 3 + 1  # the product of the angular velocity about y with itself


def thin(section: Section) -> Section:
    return with_mass_moments(shear_rigid(section), section.Iy, 0.0)


def rod(section, length, elements, modes, reference, material=STEEL, turned=None) -> FlexibleBody:
    R = np.eye(3) if turned is None else turned
    tip = tuple(R @ (length, 0, 0))
    frame = polyline([(0, 0, 0), tip], Member(section, material, tuple(R[:, 1])), elements=elements)
    return fp.reduce(
        fp.from_frame(named(frame, root=(0, 0, 0), tip=tip), [InterfaceRegion("root"), InterfaceRegion("tip")]),
        fp.Request(name="rod", reference=reference, reduction=CraigBampton(modes)),
    )


def critical_load(body: FlexibleBody, stiffness: np.ndarray) -> float:
    """The least pressure at which diag(omega2) - P K loses its definiteness."""
    return 1 / scipy.linalg.eigvalsh(stiffness, np.diag(body.omega2)).max()


@pytest.mark.parametrize("turned", [None, rotation(2)], ids=["along-x", "turned"])
def test_buckling_of_a_pinned_rod(turned):
    """Euler: P = pi^2 E I/L^2; with shear P/(1 + P/(k G A)) (Timoshenko & Gere, Theory of Elastic Stability, 2.17)."""
    R = np.eye(3) if turned is None else turned
    section = circle(0.05)
    for of, kGA in ((shear_rigid(section), np.inf), (section, 6 / 7 * STEEL.E / 2.6 * section.A)):
        body = rod(of, 1.0, 20, 8, SimplySupported("root", "tip"), turned=turned)
        tension = np.tensordot(R[:, 0], body.stiffening[TENSION : TENSION + 3], 1)
        euler = np.pi**2 * STEEL.E * section.Iz
        assert critical_load(body, tension) == pytest.approx(euler / (1 + euler / kGA), rel=1e-4)


def test_buckling_of_a_cantilever():
    """P = pi^2 E I/(4 L^2) at the free end; 7.8373 E I/L^2 in all for its own weight along it (Timoshenko & Gere, 2.12)."""
    section = thin(circle(0.01))
    body = rod(section, 1.0, 40, 6, FixedTo("root"))
    assert critical_load(body, body.stiffening[TENSION]) == pytest.approx(np.pi**2 * STEEL.E * section.Iz / 4, rel=1e-5)
    weight = body.mass * critical_load(body, -body.stiffening[0])  # accelerated towards the tip, it is pressed
    assert weight == pytest.approx(7.8373 * STEEL.E * section.Iz, rel=2e-4)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("eta", "mu"), [(0, 3.5160152685), (1, 3.6816468140), (3, 4.7972785324), (6, 7.3603730193), (10, 11.202327762)]
)
def test_rotating_cantilever(eta, mu):
    """First flap and lag frequency in sqrt(E I/(rho A L^4)) at the speed eta; mu_lag^2 = mu_flap^2 - eta^2.

    Independent series solution in more than twelve digits, agrees with Wright, Smith, Thresher & Wang, J. Appl. Mech.
    49 (1982) 197-202.
    """
    section = with_mass_moments(general("rod", A=1.0, Iy=1.00002e-6, Iz=1e-6, J=1e-6), 1e-9, 0.0)
    body = rod(section, 1.0, 45, 36, FixedTo("root"))
    unit = STEEL.E * 1e-6 / STEEL.rho
    stiffened = np.diag(body.omega2) + eta**2 * unit * (body.stiffening[ACROSS] - body.PP_dm[0, 0] - body.PP_dm[2, 2])
    values, vectors = scipy.linalg.eigh(stiffened)
    flap = np.einsum("im,ij,jm->m", vectors, body.PP_dm[1, 1], vectors) > 0.5
    found = np.sqrt(values[flap][0] / unit), np.sqrt(values[~flap][0] / unit)
    assert found[0] == pytest.approx(mu, rel=2e-6)
    assert found[1] ** 2 == pytest.approx(mu**2 - eta**2, rel=4e-5)


def test_unit_accelerations_make_up_the_acceleration_of_a_point():
    """a + alpha x u + omega x (omega x u)."""
    rng = np.random.default_rng(0)
    u, a, alpha, omega = rng.normal(size=(5, 3)), *rng.normal(size=(3, 3))
    products = [omega[k] * omega[m] for k, m in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
    field = np.tensordot([*a, *alpha, *products], unit_accelerations(u), 1)
    np.testing.assert_allclose(field, a + np.cross(alpha, u) + np.cross(omega, np.cross(omega, u)), atol=1e-14)


# ---- motion -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("reference", [SimplySupported("root", "tip"), FixedTo("root"), MeanAxis()], ids=repr)
def test_pendulum_against_the_exact_beam(reference):
    """L = 1.2, A = 0.0018, E = 7e10, rho = 5540, released from the horizontal: tip at 0.5 and 1 s.

    Geometrically exact beam with shear (k = 5/6), independent, right to 3e-6 m. Once the stiffening is there, the choice
    of the body frame hardly matters (without it: 2e-4 m between them). What is left is the shortening by bending, half
    the integral of the squared slope, which linear modes do not have: 3e-5 m in the frame of the root's tangent.
    """
    body = rod(rectangle(0.2, 0.009), 1.2, 24, 10, reference, Material("metal", 7e10, 0.3, 5540.0))
    scene = Scene(
        (Body("rod", body),),
        (Joint("hinge", "revolute", "ground.O", "rod.root"),),
        ground={"O": (0, 0, 0)},
        gravity=(0.0, -9.81, 0.0),
    )
    result = integrate(scene, end=1.0, output_step=0.5, method=ROS2(5e-5))
    exact = [(0.1737356, -1.1873578), (-1.1997451, -0.0246135)]
    np.testing.assert_allclose(result["rod.tip.position"][1:, :2], exact, atol=3e-5)


@pytest.mark.slow
def test_slider_crank_with_a_rod_under_pressure():
    """Mid-rod deflection: the geometrically exact beam, computed independently (see the data file), to 0.4 % of its peak."""
    frame = polyline([(0, 0, 0), (0.3, 0, 0)], Member(thin(circle(0.006)), STEEL, (0, 1.0, 0)), elements=24)
    body = fp.reduce(
        fp.from_frame(
            named(frame, crankpin=(0, 0, 0), slider=(0.3, 0, 0)),
            [InterfaceRegion("crankpin"), InterfaceRegion("slider")],
        ),
        fp.Request(name="rod", reference=SimplySupported("crankpin", "slider"), reduction=CraigBampton(10)),
    )
    result = integrate(slider_crank(body), end=0.084, output_step=4e-4, method=ROS2(5e-6))
    middle = np.abs(body.surface.points[:, 0] - 0.15) < 1e-9
    deflection = result["rod.q"] @ body.surface.Phi[middle].mean(axis=0)[1]
    exact = np.loadtxt(REFERENCE / "slider_crank_exact.csv", delimiter=",")
    peak = np.abs(exact[:, 1]).max()
    np.testing.assert_allclose(deflection, np.interp(result.time, *exact.T), atol=4e-3 * peak)


@pytest.mark.slow
def test_spin_up_of_a_cantilever():
    """Spin-up to 6 rad/s in 15 s, above the first frequency of the beam: tip deflection in the rotating frame.

    L = 10, EA = 2.8e7, k G A = 1e7, EI = 1.4e4, rho A = 1.2, rho I = 6e-4 (Wu & Haug, Int. J. Numer. Meth. Engng 26 (1988)
    2211-2226; Simo & Vu-Quoc). Geometrically exact beam, independent, right to 3e-7 m.
    """
    section = Section("beam", A=1.0, Iy=5e-4, Iz=5e-4, J=1e-3, ky=1e7 * 2.6 / 2.8e7, kz=1e7 * 2.6 / 2.8e7)
    body = rod(section, 10.0, 30, 6, FixedTo("root"), Material("beam", 2.8e7, 0.3, 1.2))
    scene = Scene(
        (Body("beam", body),),
        (Joint("axis", "revolute", "ground.O", "beam.root"),),
        (Driver("motor", "axis", user(spin_up)),),
        ground={"O": (0, 0, 0)},
    )
    result = integrate(scene, end=10.0, output_step=0.1, method=ROS2(2e-3))
    deflection = result["beam.q"] @ body.interface("tip").phi_t[1]
    np.testing.assert_allclose(deflection[[50, 68, 100]], [-0.468476, -0.573761, -0.362815], atol=1e-3)


def spin_up(t: float) -> tuple[float, float, float]:
    """Angle, speed and acceleration."""
    T, speed = 15.0, 6.0
    if t >= T:
        return speed * (t - T / 2), speed, 0.0
    a = 2 * np.pi / T
    return (
        speed / T * (t**2 / 2 + (np.cos(a * t) - 1) / a**2),
        speed / T * (t - np.sin(a * t) / a),
        speed / T * (1 - np.cos(a * t)),
    )


# ---- three modes per plane ----------------------------------------------------------------------------------------------


FLAP = {
    0: 3.5160152685,
    1: 3.6816468140,
    2: 4.1373195730,
    3: 4.7972785324,
    4: 5.5850014209,
    5: 6.4495447486,
    6: 7.3603730193,
}


def slender_beam() -> tuple[FlexibleBody, float]:
    """A cantilever, and its unit of frequency squared for deflection across the plane of rotation."""
    section = with_mass_moments(general("rod", A=1.0, Iy=1e-6, Iz=1.1e-6, J=1e-6), 1e-9, 0.0)
    frame = named(polyline([(0, 0, 0), (1.0, 0, 0)], Member(section, STEEL, (0, 1, 0)), elements=45), root=(0, 0, 0))
    body = fp.reduce(
        fp.from_frame(frame, [InterfaceRegion("root")]),
        fp.Request(name="beam", reference=FixedTo("root"), reduction=Eigenmodes(10)),
    )
    return body, STEEL.E * 1e-6 / STEEL.rho


def slender_solid() -> tuple[FlexibleBody, float]:
    """A bar of 10 x 10.1 mm without lateral contraction."""
    material, height, width = Material("bar", 2.1e11, 0.0, 7850.0), 0.0101, 0.01
    mesh = box_mesh("hex27", (1.0, height, width), (24, 1, 1), origin=(0.0, -height / 2, -width / 2))
    body = fp.reduce(
        fp.from_mesh(mesh, material, [InterfaceRegion("left")]),
        fp.Request(name="bar", reference=FixedTo("left"), reduction=Eigenmodes(10)),
    )
    return body, material.E * width**2 / 12 / material.rho


@pytest.mark.parametrize("make", [slender_beam, slender_solid])
def test_rotating_cantilevers_of_three_modes_per_plane(make):
    """Flap and lag within 0.2 % up to the speed 6, of beams and solids alike (series solution, see above)."""
    body, unit = make()
    shares = [np.einsum("jj->j", body.PP_dm[c, c]) for c in range(3)]
    chosen = np.sort(np.concatenate([np.flatnonzero(shares[c] > 0.9)[:3] for c in (1, 2)]))
    assert chosen.size == 6
    few = truncated(body, chosen)
    for eta, mu in FLAP.items():
        about_z = few.stiffening[3 + 3 + 2] - few.PP_dm[0, 0] - few.PP_dm[1, 1]
        values, vectors = scipy.linalg.eigh(np.diag(few.omega2) + eta**2 * unit * about_z)
        flap = np.einsum("im,ij,jm->m", vectors, few.PP_dm[2, 2], vectors) > 0.5
        assert np.sqrt(values[flap][0] / unit) == pytest.approx(mu, rel=2e-3)
    # lag at the last speed: its own stiffness, 10 % or 2 % higher, is another speed in its own unit
    still = few.omega2[np.flatnonzero(shares[1][chosen] > 0.9)[0]]
    lag_unit = still / FLAP[0] ** 2
    eta_lag = 6 * np.sqrt(unit / lag_unit)
    mu_lag = np.sqrt(np.interp(eta_lag**2, [e**2 for e in FLAP], [m**2 for m in FLAP.values()]) - eta_lag**2)
    assert np.sqrt(values[~flap][0] / lag_unit) == pytest.approx(mu_lag, rel=2e-3)


def test_spin_up_with_three_bending_modes():
    """The case of `test_spin_up_of_a_cantilever` with three modes of bending in the plane and nothing else: 1e-3 m."""
    section = Section("beam", A=1.0, Iy=5e-4, Iz=5e-4, J=1e-3, ky=1e7 * 2.6 / 2.8e7, kz=1e7 * 2.6 / 2.8e7)
    member = Member(section, Material("beam", 2.8e7, 0.3, 1.2), (0, 1.0, 0))
    frame = named(polyline([(0, 0, 0), (10.0, 0, 0)], member, elements=30), root=(0, 0, 0), tip=(10.0, 0, 0))
    free = fp.reduce(
        fp.from_frame(frame, [InterfaceRegion("root"), InterfaceRegion("tip")]),
        fp.Request(name="beam", reference=FixedTo("root"), reduction=Eigenmodes(12)),
    )
    body = truncated(in_plane(free), 3)
    assert np.einsum("jj->j", body.PP_dm[1, 1]).min() > 0.9
    scene = Scene(
        (Body("beam", body),),
        (Joint("axis", "revolute", "ground.O", "beam.root"),),
        (Driver("motor", "axis", user(spin_up)),),
        ground={"O": (0, 0, 0)},
    )
    result = integrate(scene, end=10.0, output_step=0.1, method=ROS2(2e-3))
    deflection = result["beam.q"] @ body.interface("tip").phi_t[1]
    np.testing.assert_allclose(deflection[[50, 68, 100]], [-0.468476, -0.573761, -0.362815], atol=1e-3)
