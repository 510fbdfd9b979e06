"""Rotations of interfaces to second order: laws by finite differences, buckling against closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
import scipy.optimize
import scipy.sparse as sp
from boxes import STEEL, box_mesh, moved, rotation

import ffr_prep as fp
from ffr_dyn.analyses.linearise import linearise
from ffr_dyn.analyses.states import scene_at
from ffr_dyn.analyses.static import static
from ffr_dyn.scene.forces import Load
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import FlexibleBody
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.material import Material
from ffr_prep.model.reference import FixedTo, SimplySupported
from ffr_prep.model.region_rotations import region_stiffening, second_order_turn
from ffr_prep.reduction.conversion import with_reference
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.solids.assembly import assemble
from ffr_prep.solids.interfaces import couple, turning_regions
from ffr_prep.structures.beam_stiffening import beam_stiffening, section_forces, strain_functions
from ffr_prep.structures.beam_stress import end_forces
from ffr_prep.structures.beams import beams, element_coordinates
from ffr_prep.structures.frame import Member, Shell, named, panel, polyline
from ffr_prep.structures.interfaces import turning_regions as turning_nodes
from ffr_prep.structures.sections import circle, general, rectangle, shear_rigid

FORCE, MOMENT = 12 + 6, 12 + 9  # at the second interface
ENDS = (InterfaceRegion("left"), InterfaceRegion("right"))
METAL = Material("metal", 2e11, 0.0, 7800.0)  # does not contract across, which a clamp would hinder


def skew(v) -> np.ndarray:
    return np.cross(np.eye(3), v)


def second_derivative(function, count: int, step: float) -> np.ndarray:
    """(count, count) by central differences about zero."""
    H = np.empty((count, count))
    for i in range(count):
        for j in range(i, count):
            a, b = step * np.eye(count)[i], step * np.eye(count)[j]
            H[i, j] = H[j, i] = (function(a + b) - function(a - b) - function(b - a) + function(-a - b)) / (4 * step**2)
    return H


# ---- laws -------------------------------------------------------------------------------------------------------------


def test_forces_at_arms_that_turn():
    """The work of sum f . exp(phi~) r, by finite differences."""
    rng = np.random.default_rng(1)
    f, r = rng.normal(size=(2, 5, 3))
    expected = second_derivative(lambda phi: np.sum(f * (r @ scipy.linalg.expm(skew(phi)).T)), 3, 1e-3)
    np.testing.assert_allclose(second_order_turn(f.T @ r), expected, atol=1e-5)


def test_the_work_of_a_mean_interface_is_that_of_the_best_fit():
    """Minus the work of force and moment on the point and the rotation vector of the polar decomposition."""
    mesh = moved(box_mesh("hex8", (0.4, 0.3, 0.2), (1, 1, 2)), rotation(3), np.array([0.3, -0.2, 0.1]))
    nodes = np.unique(mesh.face_groups["right"][0])
    mesh = replace(mesh, node_groups={"nodes": nodes})
    interface = InterfaceRegion("mean", "nodes", "mean", point=(0.5, 0.1, 0.2))
    matrices = assemble(mesh, STEEL)
    model = couple(mesh, matrices, [interface])
    regions = turning_regions(mesh, matrices, [interface], model, np.zeros((mesh.points.size, 12)))
    rng = np.random.default_rng(2)
    shapes, wrench = rng.normal(size=(mesh.points.size, 4)), rng.normal(size=6)
    loads = np.concatenate([np.zeros(12), wrench])[:, None]
    found = region_stiffening(regions, np.zeros((mesh.points.size, 1)), loads, shapes)[0]
    at = mesh.points[nodes] - mesh.points[nodes].mean(axis=0)
    arm = np.array(interface.point) - mesh.points[nodes].mean(axis=0)

    def work(a):
        u = (shapes @ a).reshape(-1, 3)[nodes]
        left, _, right = np.linalg.svd((at + u - u.mean(axis=0)).T @ at)
        R = left @ np.diag([1, 1, np.linalg.det(left @ right)]) @ right
        phi = scipy.linalg.logm(R).real[[2, 0, 1], [1, 2, 0]]
        return -wrench[:3] @ (u.mean(axis=0) + R @ arm - arm) - wrench[3:] @ phi

    np.testing.assert_allclose(found, second_derivative(work, 4, 2e-4), atol=2e-5 * np.abs(found).max())


def test_the_work_of_a_mean_interface_of_nodes_that_turn():
    """As above, with exp(theta_i~) Q of every node in the polar decomposition: nodes nearly on a line."""
    corners = [(0, 0, 0), (0.5, 0.05, 0.02), (1.0, 0, 0.01)]
    frame = polyline(corners, Member(circle(0.02), STEEL), elements=1)
    frame = replace(frame, node_groups={"all": np.arange(3)})
    interface = InterfaceRegion("all", kind="mean", point=(0.6, 0.1, -0.1))
    model = fp.from_frame(frame, [interface]).coupled
    rng = np.random.default_rng(5)
    shapes, wrench = 0.3 * rng.normal(size=(18, 4)), rng.normal(size=6)
    loads = np.concatenate([np.zeros(12), wrench])[:, None]
    regions = turning_nodes(
        frame, sp.csr_array((18, 18)), [interface], sp.eye_array(18, format="csr"), model, np.zeros((18, 12))
    )
    found = region_stiffening(regions, np.zeros((18, 1)), loads, shapes)[0]
    at = frame.points - frame.points.mean(axis=0)
    arm, Q = np.array(interface.point) - frame.points.mean(axis=0), regions[0].of_each
    assert (
        np.linalg.eigvalsh(np.trace(Q) * np.eye(3) - Q)[-1] > 0.9 * (at**2).sum() / 3
    )  # the rotation about the line counts

    def work(a):
        u, turns = np.split((shapes @ a).reshape(3, 6), 2, axis=1)
        A = (at + u - u.mean(axis=0)).T @ at + sum(scipy.linalg.expm(skew(turn)) @ Q for turn in turns)
        R = _stationary(A)
        phi = scipy.linalg.logm(R).real[[2, 0, 1], [1, 2, 0]]
        return -wrench[:3] @ (u.mean(axis=0) + R @ arm - arm) - wrench[3:] @ phi

    np.testing.assert_allclose(found, second_derivative(work, 4, 2e-3), atol=2e-5 * np.abs(found).max())


def _stationary(A) -> np.ndarray:
    """The rotation R near none with R^T A symmetric, by Newton's method; also where that is no largest fit."""
    R = np.eye(3)
    for _ in range(8):
        B = R.T @ A
        axis = (B - B.T)[[2, 0, 1], [1, 2, 0]]
        R = R @ scipy.linalg.expm(skew(np.linalg.solve(np.trace(B) * np.eye(3) - (B + B.T) / 2, axis)))
    return R


@pytest.mark.slow
def test_a_mean_interface_holds_a_sheet_whatever_its_mesh():
    """A strip bent in its plane by a moment on its edge: as a beam, without the turning of single nodes that grows without
    bound as the mesh is refined."""
    L, h, t = 0.3, 0.06, 0.005
    turned = []
    for elements in ((10, 2), (40, 8)):
        sheet = panel([(0, 0, 0), (L, 0, 0), (L, h, 0), (0, h, 0)], Shell(t, METAL), elements=elements)
        x = sheet.points[:, 0]
        sheet = replace(sheet, node_groups={"left": np.flatnonzero(x < 1e-9), "right": np.flatnonzero(x > L - 1e-9)})
        body = fp.reduce(
            fp.from_frame(sheet, [ENDS[0], InterfaceRegion("right", kind="mean")]),
            fp.Request(name="s", reference=FixedTo("left"), reduction=CraigBampton(1)),
        )
        turned.append(body.interface("right").phi_r[2] ** 2 @ (1 / body.omega2))
    np.testing.assert_allclose(turned, L / (METAL.E * t * h**3 / 12), rtol=0.05)


def test_the_work_of_section_forces_is_that_of_the_exact_strains():
    """R^T (e_x + u') - e_x and the axial vector of R^T R' of a beam that turns by exp(phi~), by finite differences.

    Engesser's tension, along the deflected axis, differs by N (shear strain)^2 / 2, and the twist of fibres in tension is no
    part of the line: N (Iy + Iz) / A phi_x'^2 / 2.
    """
    ends = np.array([[(0.1, 0.2, 0.3), (0.5, 0.4, 0.1)]])
    element = beams(ends, [rectangle(0.05, 0.08)], [STEEL], np.array([(0, 0, 1.0)]))
    rng = np.random.default_rng(4)
    static, shapes = rng.normal(size=(1, 12, 1)) * 1e-6, rng.normal(size=(1, 12, 3)) * 0.01
    at, weight = np.polynomial.legendre.leggauss(6)
    xi = (1 + at) / 2
    to_element = element_coordinates(element)
    nothing = np.zeros((1, 3, 3, 1))
    forces = section_forces(element, end_forces(element, static), to_element @ static, nothing, xi)[0, :, :, 0]
    g = (strain_functions(element, xi) @ (to_element @ shapes)[:, None])[0]

    def work(a):
        total = 0.0
        for w, s, force in zip(weight / 2 * element.length[0], g @ a, forces, strict=True):
            d, phi, turn = s[:3], s[3:6], s[6:]
            stretch = scipy.linalg.expm(skew(phi)).T @ (np.array([1.0, 0, 0]) + d) - (1, 0, 0)
            curvature = turn - np.sinc(np.linalg.norm(phi) / (2 * np.pi)) ** 2 / 2 * np.cross(
                phi, turn
            )  # and odd terms
            shear = d[1] - phi[2], d[2] + phi[1]
            radius = (element.EIy + element.EIz)[0] / element.EA[0]
            engesser = force[0] * (shear[0] ** 2 + shear[1] ** 2 + radius * turn[0] ** 2) / 2
            total += w * (force[:3] @ stretch + force[3:] @ curvature + engesser)
        return total

    found = beam_stiffening(element, static, np.zeros((12, 1)), shapes)[0]
    np.testing.assert_allclose(found, second_derivative(work, 3, 0.05), atol=1e-4 * np.abs(found).max())


# ---- buckling ---------------------------------------------------------------------------------------------------------


def critical_load(body: FlexibleBody, of_unit_load: np.ndarray) -> float:
    return -1 / scipy.linalg.eigvalsh(of_unit_load / np.sqrt(np.outer(body.omega2, body.omega2))).min()


def strip_of_beams() -> FlexibleBody:
    section = shear_rigid(general("strip", A=1e-3, Iy=1e-9, Iz=1e-4, J=4e-9))
    frame = named(polyline([(0, 0, 0), (1, 0, 0)], Member(section, STEEL, (0, 1, 0)), elements=40), left=(0, 0, 0))
    return fp.reduce(
        fp.from_frame(named(frame, right=(1, 0, 0)), ENDS),
        fp.Request(name="b", reference=FixedTo("left"), reduction=CraigBampton(24)),
    )


def strip_of_solids(kind: str = "rigid") -> FlexibleBody:
    return fp.reduce(
        fp.from_mesh(
            box_mesh("hex20", (1.0, 0.06, 0.005), (20, 2, 1), (0, -0.03, -0.0025)),
            METAL,
            [ENDS[0], InterfaceRegion("right", kind=kind)],
        ),
        fp.Request(name="b", reference=FixedTo("left"), reduction=CraigBampton(16)),
    )


def strip_of_plates() -> FlexibleBody:
    frame = panel([(0, 0, 0), (1, 0, 0), (1, 0.06, 0), (0, 0.06, 0)], Shell(0.005, METAL), elements=(16, 2))
    x = frame.points[:, 0]
    frame = replace(frame, node_groups={"left": np.flatnonzero(x < 1e-9), "right": np.flatnonzero(x > 1 - 1e-9)})
    return fp.reduce(
        fp.from_frame(frame, ENDS),
        fp.Request(name="b", reference=FixedTo("left"), reduction=CraigBampton(16)),
    )


@pytest.mark.parametrize(
    ("make", "off"),
    [
        (strip_of_beams, 1e-3),
        (strip_of_plates, 0.015),
        (strip_of_solids, 0.03),
        (lambda: strip_of_solids("mean"), 0.03),
    ],
    ids=["beams", "plates", "solid", "solid-mean"],
)
def test_lateral_buckling_of_a_cantilever(make, off):
    """M = pi sqrt(EI GJ)/L under a semitangential end moment (J. H. Argyris et al., Comput. Meth. Appl. Mech. Engng 20 (1979)
    105-155), P = 4.0126 sqrt(EI GJ)/L^2 under an end force (Timoshenko & Gere, Theory of Elastic Stability, 6.3); EI and
    GJ of the free end's flexibility, which knows what the clamp and the mesh add to them."""
    body = make()
    turned = body.interface("right").phi_r ** 2 @ (1 / body.omega2)
    unit = 1 / np.sqrt(turned[0] * turned[1])  # L / GJ, L / EI
    assert critical_load(body, body.stiffening[MOMENT + 2]) == pytest.approx(np.pi * unit, rel=off)
    assert critical_load(body, body.stiffening[FORCE + 1]) == pytest.approx(4.0126 * unit, rel=off)


@pytest.mark.slow
def test_buckling_of_a_shaft_by_torque():
    """M = pi EI/L for a cantilever under a semitangential torque (H. Ziegler, Principles of Structural Stability, 1968)."""
    section = circle(0.02)
    frame = named(
        polyline([(0, 0, 0), (1, 0, 0)], Member(section, STEEL), elements=40), left=(0, 0, 0), right=(1, 0, 0)
    )
    body = fp.reduce(
        fp.from_frame(frame, ENDS),
        fp.Request(name="b", reference=FixedTo("left"), reduction=CraigBampton(16)),
    )
    critical = critical_load(body, body.stiffening[MOMENT])
    assert critical == pytest.approx(np.pi * STEEL.E * section.Iz, rel=2e-3)


@pytest.mark.parametrize("arm", [0.25, -0.2])
@pytest.mark.parametrize("kind", ["beams", "offset-section", "solid", "solid-mean"])
def test_buckling_of_a_column_with_a_rigid_end(kind, arm):
    """A force along the column at an arm a beyond its end (or before it): tan(k L) = 1/(k a), P = k^2 EI."""
    if kind in ("solid", "solid-mean"):
        right = InterfaceRegion("right", kind="mean" if "mean" in kind else "rigid", point=(1.0 + arm, 0, 0))
        body = fp.reduce(
            fp.from_mesh(box_mesh("hex20", (1.0, 0.02, 0.03), (20, 1, 1), (0, -0.01, -0.015)), METAL, [ENDS[0], right]),
            fp.Request(name="c", reference=FixedTo("left"), reduction=CraigBampton(8)),
        )
        EI = METAL.E * 0.03 * 0.02**3 / 12
    else:
        section = shear_rigid(circle(0.02))
        across = replace(section, offset=(0.3, 0.1)) if kind == "offset-section" else section
        frame = polyline([(0, 0, 0), (1, 0, 0)], Member(across, STEEL, (0, 1, 0)), elements=20)
        frame = named(frame, left=(0, 0, 0), right=(1, 0, 0))
        offset = (0, 0.3, 0.1) if kind == "offset-section" else (0, 0, 0)
        ends = [InterfaceRegion(n, point=(x, *offset[1:])) for n, x in (("left", 0.0), ("right", 1.0 + arm))]
        body = fp.reduce(
            fp.from_frame(frame, ends),
            fp.Request(name="c", reference=FixedTo("left"), reduction=CraigBampton(8)),
        )
        EI = STEEL.E * section.Iz
    interval = (1e-3, np.pi / 2) if arm > 0 else (np.pi / 2, np.pi - 1e-3)
    k = scipy.optimize.brentq(lambda k: np.cos(k) - k * arm * np.sin(k), *interval)
    assert critical_load(body, -body.stiffening[FORCE]) == pytest.approx(k**2 * EI, rel=2e-3)


# ---- motion -----------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(
    ("share", "what", "frame"),
    [
        (0.5, "force", FixedTo("left")),  # moments of fixed axis in space are not semitangential
        (0.5, "force", SimplySupported("left", "right")),
    ],
    ids=str,
)
def test_a_loaded_cantilever_vibrates_the_slower_the_nearer_it_is_to_buckling(share, what, frame):
    """Lowest frequency about the equilibrium of a scene, against Omega^2 + load * K_sigma in the frame of the clamp."""
    body = strip_of_beams()
    number = MOMENT + 2 if what == "moment" else FORCE + 1
    load = share * critical_load(body, body.stiffening[number])
    expected = np.sqrt(scipy.linalg.eigvalsh(np.diag(body.omega2) + load * body.stiffening[number])[0]) / (2 * np.pi)
    wrench = {"moment": (0, 0, load)} if what == "moment" else {"force": (0, load, 0)}
    scene = Scene(
        (Body("strip", body if frame == FixedTo("left") else with_reference(body, frame)),),
        (Joint("clamp", "fixed", "ground.O", "strip.left"),),
        loads=(Load("end", "strip.right", **wrench),),
        ground={"O": (0, 0, 0)},
    )
    found = linearise(scene_at(scene, static(scene))).frequencies.min()
    assert found == pytest.approx(expected, rel=2e-5)
