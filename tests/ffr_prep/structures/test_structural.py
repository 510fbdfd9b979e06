"""Frames of beams: laws of the elements, exact inertia and statics, published frequencies, motions, every guard."""

from __future__ import annotations

import json
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
from boxes import rotation
from places import REFERENCE
from test_dyn_references import slider_crank

import ffr_prep as fp
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.integrators import ROS2
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import load_body, save_body
from ffr_prep.common import process_memory
from ffr_prep.common.errors import InputError
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.material import Material
from ffr_prep.model.reference import FixedTo, MeanAxis, SimplySupported, Support, Supports
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.reduction.methods.eigenmodes import Eigenmodes
from ffr_prep.structures import model
from ffr_prep.structures.beams import axis_functions, beams, field, mass_points, stiffness, undeformed
from ffr_prep.structures.element_families import beam_elements, families
from ffr_prep.structures.frame import (
    Frame,
    Member,
    Shell,
    check_frame,
    group_nodes,
    joined,
    joint_doubts,
    named,
    overlap_doubts,
    polyline,
    thickness_doubts,
)
from ffr_prep.structures.interfaces import couple_frame, tie
from ffr_prep.structures.model import assemble_frame, from_frame
from ffr_prep.structures.sections import (
    box,
    circle,
    general,
    i_section,
    rectangle,
    shear_rigid,
    shifted,
    tube,
    with_mass_moments,
)

STEEL = Material("steel", 2.1e11, 0.3, 7850.0)
BAR = rectangle(0.02, 0.05)
G = STEEL.E / 2.6


def straight(section, length: float, elements: int, material: Material = STEEL, *, turned=None) -> Frame:
    """A beam along x (or turned) from "root" to "tip"."""
    R = np.eye(3) if turned is None else turned
    tip = tuple(R @ (length, 0, 0))
    frame = polyline([(0, 0, 0), tip], Member(section, material, tuple(R[:, 1])), elements=elements)
    return named(frame, root=(0, 0, 0), tip=tip)


def space_frame(turned=None, moved=(0, 0, 0)) -> Frame:
    """Three members of different sections, one off its nodes, in no particular direction."""
    R = np.eye(3) if turned is None else turned

    def at(*corners):
        return [tuple(R @ corner + moved) for corner in np.array(corners, float)]

    orientation = tuple(R @ (0.3, -0.4, 0.8))
    first = polyline(at((0.1, 0, 0), (1, 0.2, 0.3), (1.1, 0.9, -0.2)), Member(BAR, STEEL, orientation), elements=3)
    second = polyline(at((1, 0.2, 0.3), (0.2, 1, 1)), Member(tube(0.04, 0.004), STEEL), elements=2)
    profile = shifted(rectangle(0.03, 0.01), 0.02, -0.015)
    third = polyline(at((1.1, 0.9, -0.2), (0.2, 1, 1)), Member(profile, STEEL, orientation))
    names = dict(zip(("a", "b", "c"), at((0.1, 0, 0), (1.1, 0.9, -0.2), (0.2, 1, 1)), strict=True))
    return named(joined(first, second, third), **names)


def regions(*names: str) -> list[InterfaceRegion]:
    return [InterfaceRegion(name) for name in names]


def clamped_flexibility(frame: Frame, load: np.ndarray) -> np.ndarray:
    """(N, 6) static coordinates of all nodes under nodal loads (N, 6), the node "root" clamped."""
    K = assemble_frame(frame, families(frame)).K.toarray()
    free = np.delete(np.arange(len(K)), 6 * group_nodes(frame, "root")[0] + np.arange(6))
    q_n = np.zeros(len(K))
    q_n[free] = np.linalg.solve(K[np.ix_(free, free)], load.ravel()[free])
    return q_n.reshape(-1, 6)


def rigid_coordinates(points: np.ndarray) -> np.ndarray:
    """(6N, 6) coordinates of the nodes in six rigid motions about the origin."""
    T = np.zeros((len(points), 6, 6))
    T[:, :3, :3] = T[:, 3:, 3:] = np.eye(3)
    for k, axis in enumerate(np.eye(3)):
        T[:, :3, 3 + k] = np.cross(axis, points)
    return T.reshape(-1, 6)


# ---- elements ---------------------------------------------------------------------------------------------------------


def test_shape_functions_reproduce_the_straight_element_and_its_rigid_motions():
    """C S e_0 is exactly straight, and nodal rigid motions move every point of the section rigidly."""
    frame = space_frame(rotation(3))
    elements = beam_elements(frame)
    xi = np.array([0.0, 0.3, 1.0])
    across = np.random.default_rng(0).normal(size=(len(elements.length), 3, 2)) * 0.01
    at = undeformed(elements, xi, across)
    ends = frame.points[frame.elements]
    s = np.concatenate([np.zeros((*across.shape[:2], 1)), across], axis=-1) + elements.offset[:, None]
    line = (1 - xi)[:, None] * ends[:, None, 0] + xi[:, None] * ends[:, None, 1]
    np.testing.assert_allclose(at, line + np.einsum("ecd,eqd->eqc", elements.C, s), atol=1e-15)
    nodal = rigid_coordinates(frame.points).reshape(-1, 6, 6)[frame.elements].reshape(-1, 12, 6)
    moved = field(elements, xi, across) @ nodal[:, None]
    expected = np.stack([np.broadcast_to(axis, at.shape) for axis in np.eye(3)], axis=-1)
    np.testing.assert_allclose(moved[..., :3], expected, atol=1e-14)
    turned = np.stack([np.cross(axis, at) for axis in np.eye(3)], axis=-1)
    np.testing.assert_allclose(moved[..., 3:], turned, atol=1e-14)


@pytest.mark.parametrize("section", [BAR, shear_rigid(BAR)], ids=["timoshenko", "euler-bernoulli"])
def test_stiffness_is_the_strain_energy_of_the_shape_functions(section):
    """Strains from the polynomials of the shape functions, integrated with the rigidities E A, G J, E I, k G A."""
    elements = beams(np.array([[(0, 0, 0), (0.4, 0, 0)]], float), [section], [STEEL], np.array([[0, 1.0, 0]]))
    t = np.linspace(0, 1, 5)
    u, theta = (np.polynomial.polynomial.polyfit(t, f[0].reshape(5, -1), 4) for f in axis_functions(elements, t))
    at, weight = np.polynomial.legendre.leggauss(5)
    at = (1 + at) / 2

    def sampled(coefficients):
        return np.moveaxis(np.polynomial.polynomial.polyval(at, coefficients).reshape(3, 12, 5), 2, 0)

    du, dtheta, turn = (
        sampled(np.polynomial.polynomial.polyder(u)) / 0.4,
        sampled(np.polynomial.polynomial.polyder(theta)) / 0.4,
        sampled(theta),
    )
    shear = np.stack([du[:, 1] - turn[:, 2], du[:, 2] + turn[:, 1]], axis=1)
    strains = np.concatenate([du[:, :1], dtheta, shear], axis=1)
    kGA = 5 / 6 * G * BAR.A
    rigidity = np.array([STEEL.E * BAR.A, G * BAR.J, STEEL.E * BAR.Iy, STEEL.E * BAR.Iz, kGA, kGA])
    if section is not BAR:
        np.testing.assert_allclose(shear, 0, atol=1e-12)
    energy = np.einsum("q,qsi,s,qsj->ij", 0.2 * weight, strains, rigidity, strains)
    np.testing.assert_allclose(stiffness(elements)[0], energy, atol=1e-10 * np.abs(energy).max())


def test_rigid_motions_have_no_energy():
    frame = space_frame(rotation(1), moved=(3, -2, 1))
    K = assemble_frame(frame, families(frame)).K
    strained = K @ rigid_coordinates(frame.points)
    assert np.abs(strained).max() < 1e-13 * abs(K).max() * np.abs(frame.points).max()
    assert np.sum(np.linalg.eigvalsh(K.toarray()) < 1e-9 * STEEL.E * BAR.Iy) == 6


def test_mass_points_integrate_the_shape_functions_exactly():
    """The mass of a beam element, doubled in points along and across, does not change."""
    elements = beam_elements(space_frame(rotation(2)))
    xi, across, mass = mass_points(elements)
    N = field(elements, xi, across)
    M = np.einsum("eq,eqki,eqkj->eij", mass, N, N)
    at, weight = np.polynomial.legendre.leggauss(9)
    fine = np.repeat((1 + at) / 2, 9)
    spread = np.sqrt(3.0) * at * 1.0
    y, z = (v.ravel() for v in np.meshgrid(spread, spread, indexing="ij"))
    grid = np.stack([y, z], axis=-1)
    over = np.outer(weight, weight).ravel() / 4  # uniform over a square with unit second moments
    M_fine = np.zeros_like(M)
    for w, x in zip(weight / 2, np.unique(fine), strict=True):
        section_points = grid * elements.gyration[:, None]
        N = field(elements, np.full(81, x), section_points)
        total = w * (elements.line_mass * elements.length)
        M_fine += np.einsum("e,q,eqki,eqkj->eij", total, over, N, N)
    np.testing.assert_allclose(M, M_fine, atol=1e-13 * np.abs(M).max())


# ---- rigid inertia ----------------------------------------------------------------------------------------------------


def box_inertia(ends: np.ndarray, section, rho: float, orientation) -> tuple[float, np.ndarray, np.ndarray]:
    """Mass, first and second moments (integral of r r^T dm) of a prism, in closed form."""
    along = ends[1] - ends[0]
    length = np.linalg.norm(along)
    x = along / length
    y = np.asarray(orientation) - np.dot(orientation, x) * x
    y /= np.linalg.norm(y)
    z = np.cross(x, y)
    m = rho * section.A * length
    centre = ends.mean(axis=0) + section.offset[0] * y + section.offset[1] * z
    second = np.outer(x, x) * length**2 / 12 + (np.outer(y, y) * section.Iz + np.outer(z, z) * section.Iy) / section.A
    return m, m * centre, m * (second + np.outer(centre, centre))


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_rigid_inertia_of_a_turned_frame_is_exact(seed):
    R = rotation(seed)
    frame = space_frame(R, moved=(0.5, -0.7, 0.2))
    body = fp.reduce(
        fp.from_frame(frame, regions("a")), fp.Request(name="f", reference=FixedTo("a"), reduction=CraigBampton(2))
    )
    parts = [
        box_inertia(frame.points[pair], frame.members[k].section, STEEL.rho, R @ (0.3, -0.4, 0.8))
        for pair, k in zip(frame.elements, frame.member_of, strict=True)
    ]
    mass, first, second = (sum(part[i] for part in parts) for i in range(3))
    np.testing.assert_allclose(body.mass, mass, rtol=1e-13)
    np.testing.assert_allclose(body.r_dm, first, rtol=1e-12, atol=1e-13 * mass)
    np.testing.assert_allclose(body.rr_dm, second, rtol=1e-12, atol=1e-12 * mass)


def test_the_body_turns_with_its_frame():
    R, by = rotation(5), np.array([0.3, 1.0, -2.0])
    interfaces, reference, reduction = regions("a", "b"), SimplySupported("a", "b"), CraigBampton(3)
    request = fp.Request(name="f", reference=reference, reduction=reduction)
    body, turned = (
        fp.reduce(fp.from_frame(frame, interfaces), request) for frame in (space_frame(), space_frame(R, by))
    )
    np.testing.assert_allclose(turned.omega2, body.omega2, rtol=1e-8)
    sign = np.sign(np.einsum("kj,kj->j", R @ body.P_dm, turned.P_dm))
    np.testing.assert_allclose(turned.P_dm * sign, R @ body.P_dm, atol=1e-8 * np.sqrt(body.mass))
    about_a = turned.rP_dm - np.einsum("k,lj->klj", by, turned.P_dm)
    expected = np.einsum("km,mnj,ln->klj", R, body.rP_dm, R)
    np.testing.assert_allclose(about_a * sign, expected, atol=1e-8 * np.sqrt(body.mass))


def test_mean_axis_leaves_no_momentum_in_the_elastic_field():
    """Translation and rotation of the sections take part in the inertia alike, or this could not hold."""
    body = fp.reduce(
        fp.from_frame(space_frame(), []), fp.Request(name="f", reference=MeanAxis(), reduction=Eigenmodes(8))
    )
    about_centre = body.rP_dm - np.einsum("k,lj->klj", body.centre_of_mass, body.P_dm)
    np.testing.assert_allclose(body.P_dm, 0, atol=1e-9 * np.sqrt(body.mass))
    np.testing.assert_allclose(about_centre - about_centre.transpose(1, 0, 2), 0, atol=1e-9 * np.sqrt(body.mass))
    assert np.abs(body.rP_dm).max() > 1e-3


# ---- statics ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", [0, 4])
def test_patch_of_constant_strain_curvature_and_twist(seed):
    """A chain of unequal elements under end loads: no forces at inner nodes, end forces of the closed form."""
    R = rotation(seed)
    x = np.array([0.0, 0.1, 0.35, 0.4, 1.0])
    frame = Frame(
        x[:, None] * R[:, 0],
        np.stack([np.arange(4), np.arange(1, 5)], 1),
        (Member(BAR, STEEL, tuple(R[:, 1])),),
        np.zeros(4, int),
    )
    K = assemble_frame(frame, families(frame)).K
    eps, twist, ky, kz = 1e-4, 2e-3, 3e-3, 5e-3
    u = np.stack([eps * x, kz * x**2 / 2, -ky * x**2 / 2], axis=1)
    theta = np.stack([twist * x, ky * x, kz * x], axis=1)
    forces = (K @ np.hstack([u @ R.T, theta @ R.T]).ravel()).reshape(5, 6)
    local = np.hstack([forces[:, :3] @ R, forces[:, 3:] @ R])
    E = STEEL.E
    end = np.array([E * BAR.A * eps, 0, 0, G * BAR.J * twist, E * BAR.Iy * ky, E * BAR.Iz * kz])
    np.testing.assert_allclose(local, np.array([-end, *np.zeros((3, 6)), end]), atol=1e-12 * abs(K).max())


@pytest.mark.parametrize("elements", [1, 3])
@pytest.mark.parametrize("turned", [None, rotation(7)], ids=["along-x", "turned"])
def test_cantilever_under_tip_loads(elements, turned):
    """Nodal deflections and rotations of a Timoshenko cantilever under six tip loads are exact with any mesh."""
    L, E = 0.7, STEEL.E
    R = np.eye(3) if turned is None else turned
    frame = straight(BAR, L, elements, turned=turned)
    shear = L / (5 / 6 * G * BAR.A)
    flexibility = np.zeros((6, 6))
    flexibility[0, 0], flexibility[3, 3] = L / (E * BAR.A), L / (G * BAR.J)
    flexibility[1, 1], flexibility[2, 2] = L**3 / (3 * E * BAR.Iz) + shear, L**3 / (3 * E * BAR.Iy) + shear
    flexibility[5, 5], flexibility[4, 4] = L / (E * BAR.Iz), L / (E * BAR.Iy)
    flexibility[1, 5] = flexibility[5, 1] = L**2 / (2 * E * BAR.Iz)
    flexibility[2, 4] = flexibility[4, 2] = -(L**2) / (2 * E * BAR.Iy)
    turn = scipy.linalg.block_diag(R, R)
    for k in range(6):
        load = np.zeros((elements + 1, 6))
        load[group_nodes(frame, "tip")[0]] = turn[:, k]
        tip = turn.T @ clamped_flexibility(frame, load)[group_nodes(frame, "tip")[0]]
        np.testing.assert_allclose(tip, flexibility[:, k], rtol=1e-8, atol=1e-10 * flexibility[k, k])


def test_offset_load_bends_the_beam():
    """A pull at the node of a beam whose centroid is e away: moment P e, curvature P e / (E I) besides the stretch."""
    e, L, P = 0.03, 0.5, 1e3
    frame = straight(shifted(BAR, e, 0.0), L, 2)
    load = np.zeros((3, 6))
    load[2, 0] = P
    tip = clamped_flexibility(frame, load)[2]
    curvature = P * e / (STEEL.E * BAR.Iz)
    np.testing.assert_allclose(tip[[1, 5]], [curvature * L**2 / 2, curvature * L], rtol=1e-9)
    np.testing.assert_allclose(tip[0], P * L / (STEEL.E * BAR.A) + curvature * L * e, rtol=1e-9)


@pytest.mark.parametrize("section", [BAR, shear_rigid(BAR)], ids=["timoshenko", "euler-bernoulli"])
def test_sag_under_gravity_comes_from_the_integral_of_the_modes(section):
    """Tip of a cantilever under its weight w: w L^4/(8 E I) + w L^2/(2 k G A), exact with one element and no modes."""
    L = 0.8
    body = fp.reduce(
        fp.from_frame(straight(section, L, 1), regions("root", "tip")),
        fp.Request(name="b", reference=FixedTo("root"), reduction=CraigBampton(0)),
    )
    q = body.P_dm.T @ (0, -9.81, 0) / body.omega2
    w = STEEL.rho * BAR.A * 9.81
    sag = w * L**4 / (8 * STEEL.E * BAR.Iz) + w * L**2 / (2 * section.ky * G * BAR.A)
    np.testing.assert_allclose(body.interface("tip").phi_t @ q, (0, -sag, 0), atol=1e-8 * sag)


# ---- vibration --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("h", "published"), [(0.02, [16.7050018666, 104.489578399]), (0.1, [82.8943626933, 496.814531609])]
)
def test_timoshenko_cantilever(h, published):
    """L = 1 m, square section h, E = 2.1e11, nu = 0.3, rho = 7850, k = 5/6, with rotary inertia: roots of the closed form."""
    interfaces, reference = regions("root"), FixedTo("root")

    def first_two(elements):
        frame = straight(rectangle(h, h), 1.0, elements)
        body = fp.reduce(
            fp.from_frame(frame, interfaces), fp.Request(name="b", reference=reference, reduction=CraigBampton(4))
        )
        return body.frequencies[[0, 2]]

    coarse, fine = first_two(40), first_two(80)
    assert (fine > published).all()
    np.testing.assert_allclose(fine, published, rtol=1e-6 + 1e-3 * h**2)  # the shear strain is constant in an element
    np.testing.assert_allclose((4 * fine - coarse) / 3, published, rtol=1e-7)  # second order


def test_euler_bernoulli_elements_are_of_fourth_order():
    """First two frequencies of the cantilever, lambda^2 sqrt(E I/(rho A L^4))."""
    section = thin(rectangle(0.2, 0.004))
    exact = np.array([1.875104068711961, 4.694091132974175]) ** 2
    exact = exact * np.sqrt(STEEL.E * section.Iz / (STEEL.rho * section.A))

    def errors(elements):
        frame = straight(section, 1.0, elements)
        body = fp.reduce(
            fp.from_frame(frame, regions("root")),
            fp.Request(name="b", reference=FixedTo("root"), reduction=CraigBampton(2)),
        )
        return np.sqrt(body.omega2) / exact - 1

    np.testing.assert_allclose(errors(6) / errors(12), 16, rtol=0.05)


def thin(section):
    """Without shear deformation and without rotary inertia of bending in the x'y' plane."""
    return with_mass_moments(shear_rigid(section), section.Iy, 0.0)


PINNED = Supports(
    (
        *(Support("root", "translation", axis) for axis in ((1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0))),
        Support("root", "rotation", (1.0, 0, 0)),
        *(Support("tip", "translation", axis) for axis in ((0, 1.0, 0), (0, 0, 1.0))),
    )
)


def test_simply_supported_beam():
    """omega_k = (k pi/L)^2 sqrt(E I/(rho A)), modes sqrt(2/m) sin(k pi x/L) with integral sqrt(2 m) (1 - cos k pi)/(k pi)."""
    section, L = thin(rectangle(0.05, 0.004)), 1.3
    body = fp.reduce(
        fp.from_frame(straight(section, L, 40), regions("root", "tip")),
        fp.Request(name="b", reference=PINNED, reduction=Eigenmodes(3)),
    )
    k = np.arange(1, 4)
    omega = (k * np.pi / L) ** 2 * np.sqrt(STEEL.E * section.Iz / (STEEL.rho * section.A))
    np.testing.assert_allclose(np.sqrt(body.omega2), omega, rtol=3e-6)
    integral = np.sqrt(2 * body.mass) * (1 - np.cos(k * np.pi)) / (k * np.pi)
    np.testing.assert_allclose(np.abs(body.P_dm[1]), integral, atol=1e-6 * np.sqrt(body.mass))


def test_inertia_integrals_of_cantilever_modes():
    """Mass-normalised Euler-Bernoulli cantilever: integrals of phi are 2 sigma/lambda, of x phi 2/lambda^2."""
    body = fp.reduce(
        fp.from_frame(straight(thin(rectangle(0.1, 0.004)), 1.0, 60), regions("root")),
        fp.Request(name="b", reference=FixedTo("root"), reduction=CraigBampton(3)),
    )
    scale = np.sqrt(body.mass)
    expected = [0.7829917560396257, 0.4339358951107193, 0.2544252968661057]
    np.testing.assert_allclose(np.abs(body.P_dm[1]) / scale, expected, rtol=1e-5)
    np.testing.assert_allclose(
        np.abs(body.rP_dm[0, 1, :2]) / scale, [0.5688257437099107, 0.0907667868863870], rtol=1e-5
    )


def test_connecting_rod_of_two_elements():
    """The flexible connecting rod of two elements, simply supported, against its matrices written out by symmetry.

    Half of the rod is one element l: symmetric with (slope at the end, deflection in the middle), antisymmetric with
    (slope at the end, slope in the middle); consistent mass, Euler-Bernoulli.
    """
    section, l = thin(rectangle(0.03, 0.008)), 0.15  # noqa: E741
    EI, m = STEEL.E * section.Iz, STEEL.rho * section.A
    rod = fp.reduce(
        fp.from_frame(straight(section, 2 * l, 2), regions("root", "tip")),
        fp.Request(name="rod", reference=SimplySupported("root", "tip"), reduction=CraigBampton(6)),
    )
    symmetric = scipy.linalg.eigvalsh(
        EI / l**3 * np.array([[4 * l**2, -6 * l], [-6 * l, 12]]),
        m * l / 420 * np.array([[4 * l**2, 13 * l], [13 * l, 156]]),
    )
    antisymmetric = scipy.linalg.eigvalsh(
        EI / l * np.array([[4, 2], [2, 4]]), m * l**3 / 420 * np.array([[4, -3], [-3, 4]])
    )
    twist = np.abs(rod.interface("tip").phi_r[0])
    in_plane = (rod.PP_dm[1, 1].diagonal() > 0.99) & (twist < 1e-6 * twist.max())
    np.testing.assert_allclose(rod.omega2[in_plane], np.sort([*symmetric, *antisymmetric]), rtol=1e-9)
    assert rod.n == 12


@pytest.mark.parametrize(("modes", "error"), [(0, 0.10265779), (1, 4.4653833e-3), (2, 1.0297938e-3), (4, 1.8232966e-4)])
def test_craig_bampton_of_a_bar(modes, error):
    """Clamped-free bar, interface at the tip: first frequency against (pi/2) c/L, exact continuous component."""
    bar = with_mass_moments(general("bar", A=1e-4, Iy=1e-3, Iz=1e-3, J=1e-3), 1e-12, 1e-12)  # axial modes first
    frame = straight(bar, 1.0, 300)
    body = fp.reduce(
        fp.from_frame(frame, regions("root", "tip")),
        fp.Request(name="b", reference=FixedTo("root"), reduction=CraigBampton(modes)),
    )
    exact = np.pi / 2 * np.sqrt(STEEL.E / STEEL.rho)
    assert np.sqrt(body.omega2[0]) / exact - 1 == pytest.approx(error, abs=4e-6)


@pytest.mark.parametrize(
    ("modes", "error"), [(0, 4.7543236e-3), (1, 3.4702439e-4), (2, 5.8375818e-5), (4, 5.4086114e-6)]
)
def test_craig_bampton_of_a_beam(modes, error):
    """Clamped-free beam, interface (w, w') at the tip: first frequency against 1.8751^2 sqrt(E I/(rho A L^4))."""
    section = with_mass_moments(general("beam", A=1e-4, Iy=1e-6, Iz=1e-9, J=1e-8), 1e-12, 0.0)  # its modes first
    body = fp.reduce(
        fp.from_frame(straight(section, 1.0, 60), regions("root", "tip")),
        fp.Request(name="b", reference=FixedTo("root"), reduction=CraigBampton(modes)),
    )
    exact = 1.8751040687119611**2 * np.sqrt(STEEL.E * section.Iz / (STEEL.rho * section.A))
    assert np.sqrt(body.omega2[0]) / exact - 1 == pytest.approx(error, abs=1e-7, rel=1e-3)


# ---- motion -----------------------------------------------------------------------------------------------------------


def test_flexible_pendulum_of_beams():
    """Against the linear floating-frame beam in the chord frame (see the data file), which is right to 4e-6 m."""
    section = thin(rectangle(0.2, 0.009))
    frame = straight(section, 1.2, 40, Material("metal", 7e10, 0.3, 5540.0))
    rod = fp.reduce(
        fp.from_frame(frame, regions("root", "tip")),
        fp.Request(name="rod", reference=SimplySupported("root", "tip"), reduction=CraigBampton(20), linear=True),
    )
    scene = Scene(
        (Body("rod", rod),),
        (Joint("hinge", "revolute", "ground.O", "rod.root"),),
        ground={"O": (0, 0, 0)},
        gravity=(0.0, -9.81, 0.0),
    )
    result = integrate(scene, end=0.5, output_step=0.01, method=ROS2(2.5e-5))
    expected = np.loadtxt(REFERENCE / "pendulum_linear.csv", delimiter=",")
    np.testing.assert_allclose(result.time, expected[:, 0], atol=1e-12)
    assert np.abs(result["rod.tip.position"][:, :2] - expected[:, 1:3]).max() < 4e-6
    assert np.abs(middle(rod, result, 0.6) - expected[:, 3]).max() < 4e-6


def test_flexible_slider_crank_of_beams():
    """Against the linear floating-frame beam in the chord frame (see the data file), which is right to 3e-6 m."""
    section = thin(circle(0.006))
    frame = straight(section, 0.3, 24, Material("steel", 2e11, 0.3, 7870.0))
    ends = [InterfaceRegion("crankpin", "root"), InterfaceRegion("slider", "tip")]
    reference = SimplySupported("crankpin", "slider")
    rod = fp.reduce(
        fp.from_frame(frame, ends), fp.Request(name="rod", reference=reference, reduction=CraigBampton(10), linear=True)
    )
    result = integrate(slider_crank(rod), end=0.084, output_step=4e-4, method=ROS2(5e-6))
    expected = np.loadtxt(REFERENCE / "slider_crank_linear.csv", delimiter=",")
    assert np.abs(middle(rod, result, 0.15) - expected[:, 1]).max() < 3e-6


def middle(rod, result, x: float) -> np.ndarray:
    """Deflection of the axis at x from the chord, which is the x' axis of the simply supported body frame [m]."""
    around = np.abs(rod.surface.points[:, 0] - x) < 1e-9
    return result["rod.q"] @ rod.surface.Phi[around].mean(axis=0)[1]


# ---- frames and interfaces --------------------------------------------------------------------------------------------


def test_a_group_of_nodes_moves_as_one():
    """A tied group follows the rigid motion of its interface, and the whole frame keeps its rigid motions."""
    frame = space_frame()
    nodes = np.array([0, 1, 2])
    frame = replace(frame, node_groups={**frame.node_groups, "foot": nodes})
    interfaces = [InterfaceRegion("foot", point=(0.0, 0.0, 0.5)), InterfaceRegion("c")]
    ties = tie(frame, interfaces)
    matrices = assemble_frame(frame, families(frame))
    model = couple_frame(frame, matrices.K, matrices.M, interfaces, ties)
    q_n = (ties @ model.T).reshape(-1, 6, 6)
    shifted_motions = rigid_coordinates(frame.points - model.centre).reshape(-1, 6, 6)
    np.testing.assert_allclose(q_n, shifted_motions, atol=1e-14)
    z = np.zeros(ties.shape[1])
    z[-12:-6] = (0.1, 0.2, 0.3, 0.01, -0.02, 0.03)
    expected = z[-12:-9] + np.cross(z[-9:-6], frame.points[nodes] - (0, 0, 0.5))
    np.testing.assert_allclose((ties @ z).reshape(-1, 6)[nodes], np.hstack([expected, np.tile(z[-9:-6], (3, 1))]))
    assert model.kinds == ("rigid", "node")


@pytest.mark.slow
def test_complete_reduction_does_not_depend_on_its_interfaces():
    """All fixed-interface modes and static shapes span the model: the modes of the free body, however it is reduced."""
    frame = space_frame()
    free = fp.reduce(fp.from_frame(frame, []), fp.Request(name="f", reference=MeanAxis(), reduction=Eigenmodes(20)))
    size = 6 * len(frame.points)
    make = {"name": "f", "reference": MeanAxis()}
    complete = fp.reduce(fp.from_frame(frame, regions("a", "b")), fp.Request(reduction=CraigBampton(size - 12), **make))
    assert complete.n == size - 6
    np.testing.assert_allclose(complete.omega2[:20], free.omega2, rtol=1e-7)


def test_joined_frames_share_their_nodes():
    frame = space_frame()
    assert len(frame.points) == 7 + 1 + 1
    assert len(frame.elements) == 9
    assert len(frame.members) == 3
    check_frame(frame)
    again = joined(frame, frame)
    np.testing.assert_array_equal(again.points, frame.points)
    np.testing.assert_array_equal(again.node_groups["c"], frame.node_groups["c"])
    with pytest.raises(InputError, match="9 elements are there more than once"):
        check_frame(again)


def test_members_that_lie_on_one_another_are_told():
    """With other nodes between: a finer line on a coarse one, triangles on quadrilaterals. What is beside is not."""
    member, corners = Member(circle(0.01), STEEL), [(0, 0, 0), (1, 0, 0), (1, 0.5, 0), (0, 0.5, 0)]
    line, coarse = polyline(corners[:2], member, elements=4), polyline(corners[:2], member, elements=2)
    beside = polyline(corners[:2], Member(shifted(circle(0.01), 0.02, 0.0), STEEL, (0, 1, 0)), elements=2)
    sheet, on = (fp.panel(corners, fp.Shell(0.002, STEEL), elements=(2, 1)) for _ in range(2))
    on = fp.triangulated(on)
    assert overlap_doubts(joined(line, polyline([corners[1], (2, 0, 0)], member))) == []
    assert overlap_doubts(joined(line, beside)) == []
    assert overlap_doubts(joined(sheet, line)) == []
    (beams,) = overlap_doubts(joined(line, coarse))
    assert beams.startswith("4 pairs of beams lie on one another, the first at (0.125, 0, 0) m: each counts")
    (plates,) = overlap_doubts(joined(sheet, on))
    assert plates.startswith("4 pairs of plates lie on one another")
    frame = named(joined(line, coarse), a=(0, 0, 0))
    assert fp.from_frame(frame, [InterfaceRegion("a")]).record["warnings"] == [beams, *joint_doubts(frame)]


def test_parts_that_share_only_some_of_their_nodes_are_told():
    """A spar of other elements than the edge of its sheet, a beam that ends on a sheet, one that ends on a beam."""
    corners = [(0, 0, 0), (1, 0, 0), (1, 0.3, 0), (0, 0.3, 0)]
    sheet = fp.panel(corners, fp.Shell(0.003, STEEL), elements=(6, 2))
    spar, member = {}, Member(circle(0.01), STEEL)
    for count in (6, 4):
        spar[count] = polyline(corners[:2], member, elements=count)
    assert joint_doubts(joined(sheet, spar[6])) == []
    (told,) = joint_doubts(joined(sheet, spar[4]))
    assert told.startswith("at 6 nodes nothing joins what looks joined, the first at (0.1667, 0, 0) m")
    leg = polyline([(1, 0, 0), (1, 0, 0.5), (0.3, 0.1, 0)], member)
    assert (
        "at 1 nodes nothing joins what looks joined, the first at (0.3, 0.1, 0) m"
        in joint_doubts(joined(sheet, leg))[0]
    )
    brace = polyline([(0, 0, 0), (0, 1, 0), (0.375, 0, 0)], member)
    assert "the first at (0.375, 0, 0) m" in joint_doubts(joined(spar[4], brace))[0]
    beside = replace(spar[4], points=spar[4].points + np.array([0, 0, 1e-6]) * (np.arange(5) > 0)[:, None])
    assert joint_doubts(joined(spar[4], beside))[0].startswith("at 8 nodes")
    assert fp.from_frame(joined(sheet, spar[4])).record["warnings"] == [told]


def test_sizes_in_millimetres_are_told():
    """A section deeper than the frame is long and a sheet too thick for a plate are doubted; those that are meant are not."""
    sheet = [(0, 0, 0), (0.4, 0, 0), (0.4, 0.3, 0), (0, 0.3, 0)]

    def frame(thickness: float, d: float, t: float) -> Frame:
        line = polyline([(0, 0, 0), (0.4, 0, 0)], Member(tube(d, t), STEEL), elements=2)
        return joined(line, fp.panel(sheet, Shell(thickness, STEEL), elements=(2, 2)))

    assert thickness_doubts(frame(0.003, 0.04, 0.002)) == []
    assert from_frame(frame(0.003, 0.04, 0.002)).record["warnings"] == []
    deep, thick = from_frame(frame(3.0, 40.0, 2.0)).record["warnings"]
    assert "tube 40 x 2 m is" in deep
    assert "the beams of the frame reach 0.4 m: are the sizes of the section in millimetres?" in deep
    assert thick.startswith("a sheet of steel is 3 m thick and 0.5 m across, too thick for a plate")


def test_closed_polyline():
    ring = polyline([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 0)], Member(circle(0.01), STEEL), elements=2)
    assert len(ring.points) == len(ring.elements) == 6
    check_frame(ring)


@pytest.mark.parametrize(
    "section",
    [rectangle(0.02, 0.05), i_section(0.05, 0.04, 0.004, 0.006), box(0.03, 0.05, 0.004)],
    ids=["rectangle", "I", "box"],
)
def test_drawn_surface_encloses_the_beam(section):
    """The triangles look outward and enclose A L; a rigid shift in the basis would show in every point alike."""
    body = fp.reduce(
        fp.from_frame(straight(section, 0.5, 3, turned=rotation(9)), regions("root", "tip")),
        fp.Request(name="b", reference=FixedTo("root"), reduction=CraigBampton(2)),
    )
    a, b, c = np.moveaxis(body.surface.points[body.surface.triangles], 1, 0)
    assert np.einsum("tk,tk->", a, np.cross(b, c)) / 6 == pytest.approx(section.A * 0.5, rel=1e-12)
    at_tip = np.abs((body.surface.points - body.interface("tip").position) @ body.interface("tip").position) < 1e-12
    tip = body.interface("tip")
    arms = body.surface.points[at_tip] - tip.position
    expected = tip.phi_t + np.cross(tip.phi_r.T[:, None], arms).transpose(1, 2, 0)
    np.testing.assert_allclose(body.surface.Phi[at_tip], expected, atol=1e-10 * np.abs(expected).max())


def test_a_frame_is_reduced_to_the_same_bits_twice():
    request = fp.Request(name="f", reference=FixedTo("a"), reduction=CraigBampton(4))
    one, two = (fp.reduce(fp.from_frame(space_frame(), regions("a")), request) for _ in range(2))
    assert np.array_equal(one.PP_dm, two.PP_dm)
    assert np.array_equal(one.surface.Phi, two.surface.Phi)
    assert one.provenance == two.provenance
    assert one.provenance["frame"]["elements"] == {"beam": 9}
    assert one.provenance["members"][0]["section"]["name"] == "rectangle 0.02 x 0.05 m"


def test_the_body_file_holds_a_frame(tmp_path):
    frame = straight(thin(circle(0.01)), 0.3, 2)
    make = {"reference": FixedTo("root"), "reduction": CraigBampton(2)}
    body = fp.reduce(
        fp.from_frame(frame, regions("root")),
        fp.Request(name="rod", provenance={"drawing": 7}, **make),
    )
    again = load_body(save_body(body, tmp_path / "rod.ffr"))
    assert again.provenance == body.provenance
    assert json.loads(json.dumps(again.provenance, allow_nan=False))["members"][0]["section"]["ky"] == "inf"
    assert again.provenance["drawing"] == 7
    np.testing.assert_array_equal(again.stiffening, body.stiffening)


def test_stages_are_told():
    stages: list[str] = []
    fp.reduce(
        fp.from_frame(straight(BAR, 1.0, 2), regions("root"), progress=stages.append),
        fp.Request(name="b", reference=FixedTo("root"), reduction=CraigBampton(2)),
        progress=stages.append,
    )
    assert stages[0] == "check the frame"
    assert stages[-1] == "compute the second order of the surface"


# ---- guards -----------------------------------------------------------------------------------------------------------

ROD = Member(circle(0.01), STEEL)


def line(*corners) -> Frame:
    return polyline(corners, ROD)


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: polyline([(0, 0, 0)], ROD), "two or more corners"),
        (lambda: polyline([(0, 0, 0), (1, 0, 0)], ROD, elements=0), "0 elements a leg"),
        (lambda: Member(circle(0.01), STEEL, (0.0, 0.0, 0.0)), "is not a direction"),
        (lambda: named(line((0, 0, 0), (1, 0, 0)), tip=(1, 0, 0.1)), "no node at .* the nearest is node 1"),
        (lambda: group_nodes(named(line((0, 0, 0), (1, 0, 0)), tip=(1, 0, 0)), "tp"), "did you mean 'tip'"),
        (lambda: beam_elements(line((0, 0, 0), (0, 0, 0), (1, 0, 0))), "element 0 .* has no length"),
        (lambda: beam_elements(polyline([(0, 0, 0), (1, 0, 0)], Member(BAR, STEEL))), "not round, and no orientation"),
        (
            lambda: beam_elements(polyline([(0, 0, 0), (1, 0, 0)], Member(BAR, STEEL, (2.0, 0, 0)))),
            "its orientation .* points the same way",
        ),
        (lambda: check_frame(Frame([(0, 0, 0)], np.zeros((0, 2)), (ROD,), [])), "has no elements"),
        (lambda: line((0, 0, 0), (np.nan, 0, 0)), "has the corner .* three finite numbers"),
        (
            lambda: Frame([(0, 0, 0), (np.inf, 0, 0)], [(0, 1)], (ROD,), [0]),
            "node 1 has the coordinates .* must be finite",
        ),
        (lambda: Frame([(0, 0), (1, 0)], [(0, 1)], (ROD,), [0]), r"points has the shape \(2, 2\)"),
        (lambda: Frame([(0, 0, 0), (1, 0, 0)], [0, 1], (ROD,), [0]), r"elements has the shape \(2,\)"),
        (lambda: Frame([(0, 0, 0), (1, 0, 0)], [(0, 1)], (ROD,), [0, 0]), r"member_of has the shape \(2,\)"),
        (
            lambda: check_frame(replace(line((0, 0, 0), (1, 0, 0)), elements=np.array([[0, 2]]))),
            "but there are 2 nodes",
        ),
        (lambda: check_frame(replace(line((0, 0, 0), (1, 0, 0)), member_of=np.array([1]))), "one of the 1 members"),
        (
            lambda: check_frame(replace(line((0, 0, 0), (1, 0, 0)), points=np.eye(3))),
            "1 nodes belong to no element, the first being node 2",
        ),
        (
            lambda: check_frame(replace(line((0, 0, 0), (1, 0, 0)), node_groups={"g": np.zeros(0, int)})),
            "node group 'g' is empty",
        ),
        (lambda: check_frame(line((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 0, 0.0), (0, 0, 1))), "at the same place"),
        (lambda: check_frame(joined(line((0, 0, 0), (1, 0, 0)), line((0, 1, 0), (1, 1, 0)))), "2 parts that nothing"),
    ],
)
def test_frames_that_cannot_be_used(make, says):
    with pytest.raises(InputError, match=says):
        make()


@pytest.mark.parametrize(
    ("interfaces", "says"),
    [
        (regions("a", "a"), "'a' is given more than once"),
        (regions("a", "wheel"), "no group of nodes 'wheel'"),
        ([InterfaceRegion("a"), InterfaceRegion("other", "a")], "'a' and 'other' share node"),
    ],
)
def test_interfaces_that_cannot_be_used(interfaces, says):
    with pytest.raises(InputError, match=says):
        fp.reduce(
            fp.from_frame(space_frame(), interfaces),
            fp.Request(name="f", reference=FixedTo("a"), reduction=CraigBampton(1)),
        )


@pytest.mark.parametrize("kind", ["beams", "triangles", "quadrilaterals"])
def test_a_structure_beyond_the_memory_of_the_machine_is_refused_before_its_elements_are_made(kind, monkeypatch):
    steel = fp.material("steel")
    beams = fp.polyline([(0, 0, 0), (1, 0, 0)], fp.Member(fp.circle(0.02), steel), elements=400)
    plate = fp.panel([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], fp.Shell(2e-3, steel), elements=(20, 20))
    frame = {"beams": beams, "triangles": fp.triangulated(plate), "quadrilaterals": plate}[kind]
    monkeypatch.setattr(process_memory, "left", lambda: 5_000_000)
    monkeypatch.setattr(model, "families", lambda frame: pytest.fail("the elements were made"))
    with pytest.raises(InputError, match=r"the assembly of (400|800) elements takes .* ask for fewer elements"):
        fp.from_frame(frame)


def test_the_memory_that_a_structure_is_refused_for_is_taken_by_its_assembly(monkeypatch):
    """No model is refused that would have fitted: what is asked for is less than what was taken."""
    steel = fp.material("steel")
    plate = fp.panel([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], fp.Shell(2e-3, steel), elements=(20, 20))
    beams = fp.polyline([(0, 0, 0), (1, 0, 0)], fp.Member(fp.circle(0.02), steel), elements=400)
    asked = list[float]()
    monkeypatch.setattr(model, "check_memory", lambda size, *_: asked.append(size))
    for frame in (plate, fp.triangulated(plate), beams):
        tracemalloc.start()
        fp.from_frame(frame)
        taken = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert 0.4 * taken < asked[-1] < taken
