"""Structural bodies against closed forms and against one another: planar rods, rings, roofs, mean interfaces."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import scipy.linalg
from boxes import box_mesh, rotation
from numpy.polynomial import Polynomial
from places import REFERENCE
from test_plates import rigid_coordinates, solved

import ffr_prep as fp
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.integrators import ROS2
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import FlexibleBody, with_point
from ffr_prep.body.planar import in_plane
from ffr_prep.common.errors import InputError
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.material import Material
from ffr_prep.model.reference import FixedTo, MeanAxis, SimplySupported
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.reduction.methods.eigenmodes import Eigenmodes
from ffr_prep.structures.element_families import families
from ffr_prep.structures.frame import Frame, Member, Shell, named, panel, polyline, triangulated
from ffr_prep.structures.model import assemble_frame
from ffr_prep.structures.sections import circle, rectangle, shear_rigid, with_mass_moments

STEEL = Material("steel", 2.1e11, 0.3, 7850.0)
STIFF_ACROSS = Material("no contraction", 2.1e11, 0.0, 7850.0)


# ---- planar beams -----------------------------------------------------------------------------------------------------


def planar_element(E: float, A: float, I: float, rho: float, l: float):  # noqa: E741
    """Stiffness and mass (6, 6) of Shabana's planar beam (section 6.2) from its shape functions S, by integration."""
    xi = Polynomial([0, 1])
    zero = Polynomial([0])
    S = [
        [1 - xi, zero, zero, xi, zero, zero],
        [
            zero,
            1 - 3 * xi**2 + 2 * xi**3,
            l * (xi - 2 * xi**2 + xi**3),
            zero,
            3 * xi**2 - 2 * xi**3,
            l * (xi**3 - xi**2),
        ],
    ]

    def product(f, g):
        whole = (f * g).integ()
        return whole(1) - whole(0)

    M = [[rho * A * l * sum(product(row[i], row[j]) for row in S) for j in range(6)] for i in range(6)]
    K = [
        [
            E * A / l * product(S[0][i].deriv(), S[0][j].deriv())
            + E * I / l**3 * product(S[1][i].deriv(2), S[1][j].deriv(2))
            for j in range(6)
        ]
        for i in range(6)
    ]
    return np.array(K), np.array(M)


@pytest.mark.parametrize("section", [rectangle(0.03, 0.008), circle(0.01)], ids=["rectangle", "circle"])
def test_planar_connecting_rod_of_two_elements(section):
    """The rod of a slider-crank: two planar elements, nine coordinates less three of the reference conditions."""
    l = 0.15  # noqa: E741
    thin = with_mass_moments(shear_rigid(section), section.Iy, 0.0)
    K_e, M_e = planar_element(STEEL.E, thin.A, thin.Iz, STEEL.rho, l)
    K, M = np.zeros((2, 9, 9))
    for start in (0, 3):
        own = slice(start, start + 6)
        K[own, own] += K_e
        M[own, own] += M_e
    B_2 = np.delete(np.eye(9), [0, 1, 7], axis=1)  # axial and transverse at A, transverse at B
    expected = scipy.linalg.eigvalsh(B_2.T @ K @ B_2, B_2.T @ M @ B_2)
    frame = polyline([(0, 0, 0), (2 * l, 0, 0)], Member(thin, STEEL, (0, 1.0, 0)), elements=2)
    rod = fp.reduce(
        fp.from_frame(named(frame, A=(0, 0, 0), B=(2 * l, 0, 0)), [InterfaceRegion("A"), InterfaceRegion("B")]),
        fp.Request(name="rod", reference=SimplySupported("A", "B"), reduction=CraigBampton(6), stress=True),
    )
    planar = in_plane(rod)
    assert planar.n == 6
    np.testing.assert_allclose(planar.omega2, expected, rtol=1e-8)
    assert np.abs(planar.surface.Phi[:, 2]).max() < 1e-6 * np.abs(planar.surface.Phi).max()
    assert planar.stiffening.shape == (24, 6, 6)
    assert planar.surface.beams.modes.shape[-1] == planar.surface.stress.shape[-1] == 6
    reaches = np.linalg.norm(planar.interface("B").phi_t, axis=1)
    assert reaches[0] > 0.1 > 1e-6 > reaches[1] + reaches[2]


def test_in_plane_needs_a_plane():
    out = polyline(
        [(0, 0, 0), (1, 0, 0), (1, 0.3, 0.4)], Member(rectangle(0.02, 0.03), STEEL, (0.2, 1, 1.0)), elements=2
    )
    request = fp.Request(name="b", reference=MeanAxis(), reduction=Eigenmodes(6))
    with pytest.raises(InputError, match=r"in the plane and along its normal .* are coupled|no elastic coordinate"):
        in_plane(fp.reduce(fp.from_frame(out), request))
    straight = polyline([(0, 0, 0), (1, 0, 0)], Member(rectangle(0.01, 0.03), STEEL, (0, 1.0, 0)), elements=4)
    one = fp.reduce(fp.from_frame(straight), replace(request, reduction=Eigenmodes(1)))
    with pytest.raises(InputError, match="no elastic coordinate in the plane: keep more modes"):
        in_plane(one)
    with pytest.raises(InputError, match="is not a direction"):
        in_plane(one, (0, 0, 0))
    assert in_plane(one, (0, 1, 0)).n == 1


# ---- rings and curved shells ------------------------------------------------------------------------------------------


def ring(elements: int, seed: int = 0) -> Frame:
    turn = 2 * np.pi * np.arange(elements + 1) / elements
    R = rotation(seed)
    corners = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1) @ R.T
    corners[-1] = corners[0]
    section = with_mass_moments(shear_rigid(rectangle(0.02, 0.002)), 0.02**3 * 0.002 / 12, 0.0)
    members = [Member(section, STEEL, tuple((a + b) / 2)) for a, b in pairwise(corners)]
    closing = np.roll(np.arange(elements), -1)
    pairs = np.stack([np.arange(elements), closing], axis=1)
    return Frame(corners[:-1], pairs, tuple(members), np.arange(elements))


@pytest.mark.slow
def test_ring_of_straight_beams():
    """Free ring in its plane: omega_k^2 = E I/(rho A R^4) k^2 (k^2 - 1)^2/(k^2 + 1), each twice.

    A. E. H. Love, Mathematical Theory of Elasticity (1927), section 293. Chords instead of arcs: second order.
    """
    k = np.array([2, 3])
    exact = k * (k**2 - 1) / np.sqrt(k**2 + 1) * np.sqrt(STEEL.E * 0.002**2 / 12 / STEEL.rho)

    def first(elements):
        body = fp.reduce(
            fp.from_frame(ring(elements), []), fp.Request(name="r", reference=MeanAxis(), reduction=Eigenmodes(6))
        )
        flat = in_plane(body, rotation(0)[:, 2])
        return np.sqrt(flat.omega2[[0, 1, 2, 3]])

    coarse, fine = first(24), first(48)
    np.testing.assert_allclose(fine[[0, 2]], fine[[1, 3]], rtol=1e-8)
    np.testing.assert_allclose((coarse / exact[[0, 0, 1, 1]] - 1) / (fine / exact[[0, 0, 1, 1]] - 1), 4, rtol=0.1)
    np.testing.assert_allclose((4 * fine - coarse)[[0, 2]] / 3, exact, rtol=2e-4)


@pytest.mark.parametrize(("cut", "off"), [(triangulated, 0.015), (lambda f: f, 0.004)], ids=["triangles", "quads"])
def test_scordelis_lo_roof(cut, off):
    """A quarter of the cylindrical roof under its weight: sag in the middle of the free edge. Consistent units.

    0.3024 in R. H. MacNeal, R. L. Harder, Finite Elements in Analysis and Design 1 (1985) 3-20; refined 0.3006 in T.
    Belytschko et al., Comput. Meth. Appl. Mech. Engng 51 (1985) 221-258.
    """

    def sag(count):
        flat = panel(
            [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)],
            Shell(0.25, Material("r", 4.32e8, 0, 1)),
            elements=(count, count),
        )
        along, turn = 25 * flat.points[:, 0], np.radians(40) * flat.points[:, 1]
        frame = cut(replace(flat, points=np.stack([along, 25 * np.sin(turn), 25 * np.cos(turn)], axis=1)))
        held = np.zeros((len(along), 6), bool)
        held[along < 1e-9, 1:3] = True  # diaphragm
        held[along < 1e-9, 3] = True
        held[np.ix_(along > 25 - 1e-9, [0, 4, 5])] = True
        held[np.ix_(turn < 1e-9, [1, 3, 5])] = True
        load = assemble_frame(frame, families(frame)).loads[:, 2].reshape(-1, 6) * 360  # mass per area 0.25, load 90
        corner = np.argmin(np.linalg.norm(np.stack([along - 25, turn - np.radians(40)]), axis=0))
        return -solved(frame, held, load)[corner, 2]

    coarse, fine = sag(6), sag(12)
    assert fine == pytest.approx(0.3006, rel=off)
    assert coarse == pytest.approx(0.3006, rel=4 * off)


# ---- one cantilever as beam, plate and solid --------------------------------------------------------------------------

L, B, H = 1.0, 0.06, 0.02


def cantilever(kind: str) -> FlexibleBody:
    request = fp.Request(name=kind, reference=FixedTo("root"), reduction=Eigenmodes(6))
    if kind == "solid":
        mesh = box_mesh("hex20", (L, B, H), (20, 1, 1), (0, -B / 2, -H / 2))
        return fp.reduce(fp.from_mesh(mesh, STIFF_ACROSS, [InterfaceRegion("root", "left")]), request)
    if kind == "beam":
        frame = polyline([(0, 0, 0), (L, 0, 0)], Member(rectangle(H, B), STIFF_ACROSS, (0, 1.0, 0)), elements=30)
        return fp.reduce(fp.from_frame(named(frame, root=(0, 0, 0)), [InterfaceRegion("root")]), request)
    corners = [(0, -B / 2, 0), (L, -B / 2, 0), (L, B / 2, 0), (0, B / 2, 0)]
    frame = panel(corners, Shell(H, STIFF_ACROSS), elements=(30, 2))
    frame = replace(frame, node_groups={"root": np.flatnonzero(frame.points[:, 0] < 1e-9)})
    frame = frame if kind == "quadrilaterals" else triangulated(frame)
    return fp.reduce(fp.from_frame(frame, [InterfaceRegion("root")]), request)


@pytest.mark.parametrize("kind", ["quadrilaterals", "triangles", "solid"])
def test_a_cantilever_is_one_body_in_three_theories(kind):
    """Bending modes across the plate: frequencies and every inertia integral of beam, plate and solid."""
    one, other = cantilever("beam"), cantilever(kind)
    a, b = (np.flatnonzero(body.PP_dm[2, 2].diagonal() > 0.9)[:2] for body in (one, other))
    np.testing.assert_allclose(np.sqrt(other.omega2[b]), np.sqrt(one.omega2[a]), rtol=5e-3)
    np.testing.assert_allclose(other.rr_dm, one.rr_dm, atol=1e-12 * one.mass)
    np.testing.assert_allclose(other.r_dm, one.r_dm, atol=1e-12 * one.mass)
    sign = np.sign(one.P_dm[2, a] * other.P_dm[2, b])
    np.testing.assert_allclose(other.P_dm[:, b] * sign, one.P_dm[:, a], atol=2e-3 * np.sqrt(one.mass))
    np.testing.assert_allclose(other.rP_dm[:, :, b] * sign, one.rP_dm[:, :, a], atol=2e-3 * np.sqrt(one.mass))
    PP = other.PP_dm[:, :, b][..., b] * np.outer(sign, sign)
    np.testing.assert_allclose(PP, one.PP_dm[:, :, a][..., a], atol=2e-3)
    spun = other.stiffening[8][np.ix_(b, b)] * np.outer(sign, sign)  # the product of the angular velocity about z
    expected = one.stiffening[8][np.ix_(a, a)]
    np.testing.assert_allclose(spun, expected, atol=0.01 * np.abs(expected).max())


@pytest.mark.parametrize("cut", [triangulated, lambda frame: frame], ids=["triangles", "quadrilaterals"])
def test_flexible_pendulum_of_plates(cut):
    """A plate 0.2 m wide and 9 mm thick on a hinge, against the linear floating-frame beam (see the data file)."""
    corners = [(0, 0, -0.1), (1.2, 0, -0.1), (1.2, 0, 0.1), (0, 0, 0.1)]
    frame = cut(panel(corners, Shell(0.009, Material("metal", 7e10, 0.0, 5540.0), gyration=0.0), elements=(30, 2)))
    x = frame.points[:, 0]
    frame = replace(frame, node_groups={"root": np.flatnonzero(x < 1e-9), "tip": np.flatnonzero(x > 1.2 - 1e-9)})
    rod = fp.reduce(
        fp.from_frame(frame, [InterfaceRegion("root"), InterfaceRegion("tip")]),
        fp.Request(name="rod", reference=SimplySupported("root", "tip"), reduction=CraigBampton(6), linear=True),
    )
    scene = Scene(
        (Body("rod", with_point(rod, "middle", np.array((0.6, 0.0045, 0)))),),
        (Joint("hinge", "revolute", "ground.O", "rod.root"),),
        ground={"O": (0, 0, 0)},
        gravity=(0.0, -9.81, 0.0),
    )
    result = integrate(scene, end=0.5, output_step=0.01, method=ROS2(1e-4))
    expected = np.loadtxt(REFERENCE / "pendulum_linear.csv", delimiter=",")
    root, middle, tip = (result[f"rod.{name}.position"][:, :2] for name in ("root", "middle", "tip"))
    along = (tip - root) / np.linalg.norm(tip - root, axis=1)[:, None]
    deflection = along[:, 0] * (middle - root)[:, 1] - along[:, 1] * (middle - root)[:, 0] - 0.0045
    assert np.abs(deflection).max() > 1e-3
    np.testing.assert_allclose(result["rod.tip.position"][:, :2], expected[:, 1:3], atol=2e-5)
    np.testing.assert_allclose(deflection, expected[:, 3], atol=2e-5)


# ---- mean interfaces --------------------------------------------------------------------------------------------------


def sheet(R=None) -> Frame:
    R = np.eye(3) if R is None else R
    corners = np.array([(0, 0, 0), (0.6, 0, 0), (0.6, 0.3, 0), (0, 0.3, 0)]) @ R.T
    frame = panel(corners, Shell(0.004, STEEL), elements=(6, 3))
    along = frame.points @ R[:, 0]
    groups = {"root": along < 1e-9, "edge": along > 0.6 - 1e-9, "rest": (along > 1e-9) & (along < 0.6 - 1e-9)}
    return replace(frame, node_groups={name: np.flatnonzero(of) for name, of in groups.items()})


@pytest.mark.parametrize("point", [None, (0.1, 0.2, 0.3)])
def test_mean_interfaces_follow_rigid_motions_exactly(point):
    """Nodes on one line determine all six coordinates, the turn about the line too."""
    interfaces = [InterfaceRegion("root"), InterfaceRegion("edge", kind="mean", point=point)]
    model = fp.from_frame(sheet(rotation(4)), interfaces).coupled
    at = model.positions[1] - model.centre
    np.testing.assert_allclose(model.C[6:] @ model.T, rigid_coordinates(at[None])[0], atol=1e-12)
    assert model.kinds == ("rigid", "mean")


def test_a_load_on_a_mean_interface_is_its_resultant_on_the_nodes():
    frame = sheet()
    model = fp.from_frame(frame, [InterfaceRegion("edge", kind="mean")]).coupled
    load = np.array([1.0, -2, 3, 0.4, 0.5, -0.6])
    on_nodes = model.C.T @ load
    np.testing.assert_allclose(model.T.T @ on_nodes, _about(model.positions[0] - model.centre, load), atol=1e-12)
    loaded = np.flatnonzero(np.abs(on_nodes.reshape(-1, 6)).max(axis=1) > 1e-12)
    np.testing.assert_array_equal(loaded, frame.node_groups["edge"])


def _about(arm: np.ndarray, load: np.ndarray) -> np.ndarray:
    return np.concatenate([load[:3], load[3:] + np.cross(arm, load[:3])])


def test_a_mean_interface_of_one_node_is_the_node():
    frame = named(sheet(), corner=(0.6, 0.3, 0))
    one, mean = (fp.from_frame(frame, [InterfaceRegion("corner", kind=kind)]).coupled for kind in ("rigid", "mean"))
    at_node = mean.C.toarray()[:, 6 * frame.node_groups["corner"][0] :][:, :6]
    np.testing.assert_allclose(at_node, np.eye(6), atol=1e-14)
    assert one.kinds == mean.kinds == ("node",)


def test_a_mean_interface_stiffens_nothing():
    make = {"name": "s", "reference": MeanAxis(), "reduction": Eigenmodes(5)}
    free = fp.reduce(fp.from_frame(sheet(), []), fp.Request(**make))
    soft = fp.reduce(fp.from_frame(sheet(), [InterfaceRegion("edge", kind="mean")]), fp.Request(**make))
    stiff = fp.reduce(fp.from_frame(sheet(), [InterfaceRegion("edge")]), fp.Request(**make))
    np.testing.assert_allclose(soft.omega2, free.omega2, rtol=1e-8)
    assert stiff.omega2[0] > 1.005 * free.omega2[0]
