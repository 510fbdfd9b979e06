"""Plates and flat shells: laws of the elements, exact inertia, patch tests, published frequencies, every guard."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse.linalg
from boxes import rotation

import ffr_prep as fp
from ffr_prep.body import Surface
from ffr_prep.common.errors import InputError
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.material import Material
from ffr_prep.model.reference import FixedTo, MeanAxis
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.reduction.methods.eigenmodes import Eigenmodes
from ffr_prep.structures.element_families import families
from ffr_prep.structures.frame import Frame, Member, Shell, check_frame, joined, named, panel, polyline, triangulated
from ffr_prep.structures.model import assemble_frame
from ffr_prep.structures.plate_functions import reference, rule
from ffr_prep.structures.plates import (
    bending_strain,
    element_coordinates,
    field,
    jacobian,
    mass_points,
    membrane_strain,
    plates,
    shape_functions,
    stiffness,
    undeformed,
    undeformed_coordinates,
)
from ffr_prep.structures.sections import rectangle

STEEL = Material("steel", 2.1e11, 0.3, 7850.0)
SHEET = Shell(0.01, STEEL)
TRIANGLE = np.array([(0.1, 0, 0), (1, 0.1, 0), (0.3, 0.8, 0)])
QUADRILATERAL = np.array([(0, 0, 0), (1, 0.1, 0), (1.2, 0.9, 0), (-0.1, 0.7, 0)])
KINDS = pytest.mark.parametrize("corners", [TRIANGLE, QUADRILATERAL], ids=["triangle", "quadrilateral"])
CUT = pytest.mark.parametrize("cut", [triangulated, lambda frame: frame], ids=["triangles", "quadrilaterals"])


def element(corners: np.ndarray, seed: int = 3, shell: Shell = SHEET):
    R = rotation(seed)
    return plates((corners @ R.T + (1.0, -2.0, 3.0))[None], [shell]), R


def rigid_coordinates(points: np.ndarray) -> np.ndarray:
    """(N, 6, 6) coordinates of the nodes in six rigid motions about the origin."""
    T = np.zeros((len(points), 6, 6))
    T[:, :3, :3] = T[:, 3:, 3:] = np.eye(3)
    for k, axis in enumerate(np.eye(3)):
        T[:, :3, 3 + k] = np.cross(axis, points)
    return T


def patch(R=None, by=(0, 0, 0)) -> Frame:
    """A square of five distorted quadrilaterals, in the proportions of MacNeal and Harder's patch."""
    R = np.eye(3) if R is None else R
    inner = [(0.04, 0.02), (0.18, 0.03), (0.16, 0.08), (0.08, 0.08)]
    outer = [(0, 0), (0.24, 0), (0.24, 0.12), (0, 0.12)]
    points = np.hstack([np.array(outer + inner), np.zeros((8, 1))]) @ R.T + by
    quadrilaterals = [(0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7), (4, 5, 6, 7)]
    nothing = np.zeros((0, 2), int)
    shell = Shell(0.001, STEEL)
    return Frame(points, nothing, (), [], quadrilaterals=quadrilaterals, shells=(shell,), shell_of=np.zeros(5, int))


# ---- elements ---------------------------------------------------------------------------------------------------------


@KINDS
def test_shape_functions_reproduce_the_flat_element_and_its_rigid_motions(corners):
    elements, R = element(corners)
    at, _ = rule(len(corners), 5)
    z = np.full((1, len(at)), 0.004)
    places = undeformed(elements, at, z)[0]
    expected = (reference(len(corners), at).N @ corners + (0, 0, 0.004)) @ R.T + (1.0, -2.0, 3.0)
    np.testing.assert_allclose(places, expected, atol=1e-14)
    nodal = rigid_coordinates(corners @ R.T + (1.0, -2.0, 3.0)).reshape(-1, 6)
    moved = field(elements, at, z)[0] @ nodal
    np.testing.assert_allclose(moved[..., :3], np.broadcast_to(np.eye(3), (len(at), 3, 3)), atol=1e-13)
    turned = np.stack([np.cross(axis, places) for axis in np.eye(3)], axis=-1)
    np.testing.assert_allclose(moved[..., 3:], turned, atol=1e-13)
    flat = shape_functions(elements, at, 0 * z) @ undeformed_coordinates(elements)[0]
    assert np.ptp(flat[..., 2]) < 1e-14


@KINDS
def test_shape_functions_hold_the_coordinates_of_the_corners(corners):
    """At its corners the displacement is that of the nodes, and the fibres have turned with them."""
    elements, _ = element(corners)
    k = len(corners)
    at = np.array([(0, 0), (1, 0), (1, 1), (0, 1)] if k == 4 else [(0, 0), (1, 0), (0, 1)], float)
    e = np.random.default_rng(0).normal(size=6 * k)
    middle = shape_functions(elements, at, np.zeros((1, k)))[0] @ e
    above = shape_functions(elements, at, np.ones((1, k)))[0] @ e
    nodal = e.reshape(k, 6)
    np.testing.assert_allclose(middle, nodal[:, :3], atol=1e-13)
    turned = np.stack([nodal[:, 4], -nodal[:, 3], 0 * nodal[:, 3]], axis=1)
    np.testing.assert_allclose(above - middle, turned, atol=1e-13)


@KINDS
def test_strains_are_the_derivatives_of_the_shape_functions(corners):
    """Membrane strain of S at z = 0 and curvature of S across z, by central differences."""
    elements, _ = element(corners)
    at, step = np.array([(0.3, 0.2)]), 1e-5
    J = jacobian(elements, reference(len(corners), at))[0][0, 0]
    moves = np.linalg.inv(J).T * step  # rows: reference steps of x and y

    def S(place, z):
        return shape_functions(elements, place, np.full((1, 1), z))[0, 0]

    d = [[(S(at + m, z) - S(at - m, z)) / (2 * step) for m in moves] for z in (0.0, 1.0)]
    strain = [np.stack([x[0], y[1], x[1] + y[0]]) for x, y in d]
    e_m, e_b = membrane_strain(elements, at)[0, 0], bending_strain(elements, at)[0, 0]
    np.testing.assert_allclose(e_m, strain[0], atol=1e-8 * np.abs(e_m).max())
    np.testing.assert_allclose(e_b, strain[1] - strain[0], atol=1e-8 * np.abs(e_b).max())


@KINDS
@pytest.mark.parametrize("seed", [0, 5])
def test_only_rigid_motions_have_no_energy(corners, seed):
    elements, R = element(corners, seed)
    K = stiffness(elements)[0]
    values = np.linalg.eigvalsh(K)
    assert np.abs(values[:6]).max() < 1e-12 * values[-1] < 1e-5 * values[6]
    T = rigid_coordinates(corners @ R.T + (1.0, -2.0, 3.0)).reshape(-1, 6)
    assert np.abs(K @ T).max() < 1e-13 * np.abs(K).max() * 5


@KINDS
def test_no_motion_is_without_mass(corners):
    at, z, mass = mass_points(element(corners)[0])
    N = field(element(corners)[0], at, z)[0]
    M = np.einsum("q,qci,qcj->ij", mass[0], N, N)
    assert np.linalg.eigvalsh(M)[0] > 1e-8 * np.linalg.eigvalsh(M)[-1]


def test_mass_points_integrate_the_shape_functions_exactly():
    """On a triangle and a parallelogram more points change nothing."""
    for corners, order in ((TRIANGLE, 12), (np.array([(0, 0, 0), (1, 0.1, 0), (1.3, 0.9, 0), (0.3, 0.8, 0)]), 11)):
        elements, _ = element(corners)
        at, z, mass = mass_points(elements)
        N = field(elements, at, z)[0]
        M = np.einsum("q,qci,qcj->ij", mass[0], N, N)
        at, weights = rule(len(corners), order)
        area = jacobian(elements, reference(len(corners), at))[1][0] * weights
        fine = np.zeros_like(M)
        for side in (-1, 0, 1):  # Simpson's rule across the thickness
            N = field(elements, at, np.full((1, len(at)), side * 0.005))[0]
            fine += (4 if side == 0 else 1) / 6 * np.einsum("q,qci,qcj->ij", area * 78.5, N, N)
        np.testing.assert_allclose(M, fine, atol=1e-12 * np.abs(M).max())


@CUT
def test_fields_are_continuous_between_elements(cut):
    """Deflection and displacement in the plane agree on common sides whatever the nodes do, so the mass is consistent."""
    frame = cut(patch())
    q = np.random.default_rng(1).normal(size=(8, 6))
    values: dict[tuple[int, int], list[np.ndarray]] = {}
    part = families(frame)[0]
    elements = plates(frame.points[part.nodes], [frame.shells[0]] * len(part.nodes))
    ends = np.array([(0, 0), (1, 0), (1, 1), (0, 1)] if part.nodes.shape[1] == 4 else [(0, 0), (1, 0), (0, 1)], float)
    for i in range(len(ends)):
        at = (0.3 * ends[i] + 0.7 * ends[i - 1])[None], (0.7 * ends[i] + 0.3 * ends[i - 1])[None]
        fields = [field(elements, place, np.zeros((len(part.nodes), 1)))[:, 0] for place in at]
        for e, nodes in enumerate(part.nodes):
            pair = (nodes[i], nodes[i - 1])
            ordered = fields if pair[0] < pair[1] else fields[::-1]
            values.setdefault(tuple(sorted(pair)), []).append(np.stack([f[e] @ q[nodes].ravel() for f in ordered]))
    shared = [of for of in values.values() if len(of) == 2]
    assert len(shared) >= 8
    for one, other in shared:
        np.testing.assert_allclose(one, other, atol=1e-13)


# ---- patch tests ------------------------------------------------------------------------------------------------------


@CUT
@pytest.mark.parametrize("seed", [None, 4])
def test_patch_of_constant_strain_and_curvature(cut, seed):
    """Nodes of a quadratic deflection and a linear displacement: no force at the inner nodes, exact energy."""
    R = np.eye(3) if seed is None else rotation(seed)
    flat = patch()
    frame = cut(patch(R, (0.3, -0.1, 0.7)))
    x, y, _ = flat.points.T
    eps, kappa = np.array([1e-3, -4e-4, 6e-4]), np.array([2.0, -0.5, 0.8])
    w = -(kappa[0] * x**2 + kappa[1] * y**2 + kappa[2] * x * y) / 2
    w_x, w_y = -(kappa[0] * x + kappa[2] * y / 2), -(kappa[1] * y + kappa[2] * x / 2)
    spin = 3e-4
    u, v = eps[0] * x + (eps[2] / 2 - spin) * y, eps[1] * y + (eps[2] / 2 + spin) * x
    local = np.stack([u, v, w, w_y, -w_x, np.full(8, spin)], axis=1)
    q = np.hstack([local[:, :3] @ R.T, local[:, 3:] @ R.T]).ravel()
    K = assemble_frame(frame, families(frame)).K
    forces = (K @ q).reshape(8, 6)
    assert np.abs(forces[4:]).max() < 1e-10 * np.abs(forces[:4]).max()
    E, nu, t, area = STEEL.E, STEEL.nu, 0.001, 0.24 * 0.12
    D = E / (1 - nu**2) * np.array([(1, nu, 0), (nu, 1, 0), (0, 0, (1 - nu) / 2)])
    energy = area * (t * eps @ D @ eps + t**3 / 12 * kappa @ D @ kappa)
    assert q @ (K @ q) == pytest.approx(energy, rel=1e-9)


def test_a_slightly_warped_quadrilateral_keeps_its_rigid_motions():
    corners = QUADRILATERAL + np.array([0.003, -0.003, 0.003, -0.003])[:, None] * (0, 0, 1)
    elements, R = element(corners)
    assert np.abs(elements.lift).max() > 0.002
    T = rigid_coordinates(corners @ R.T + (1.0, -2.0, 3.0)).reshape(-1, 6)
    K = stiffness(elements)[0]
    assert np.abs(K @ T).max() < 1e-13 * np.abs(K).max() * 5
    np.testing.assert_allclose(element_coordinates(elements)[0] @ T, _flat_motions(elements), atol=1e-13)


def _flat_motions(elements) -> np.ndarray:
    """Rigid motions of the corners of the middle plane, in element axes, about the common origin."""
    corners = np.hstack([elements.corners[0], np.full((4, 1), elements.level[0])])
    return rigid_coordinates(corners).reshape(-1, 6) @ scipy.linalg.block_diag(elements.C[0].T, elements.C[0].T)


# ---- inertia ----------------------------------------------------------------------------------------------------------


@CUT
@pytest.mark.parametrize("seed", [0, 1])
def test_rigid_inertia_of_a_turned_plate_is_exact(cut, seed):
    R, by = rotation(seed), np.array([0.5, -0.7, 0.2])
    frame = named(cut(patch(R, by)), corner=tuple(by))
    body = fp.reduce(
        fp.from_frame(frame, [InterfaceRegion("corner")]),
        fp.Request(name="p", reference=FixedTo("corner"), reduction=CraigBampton(2)),
    )
    mass = STEEL.rho * 0.24 * 0.12 * 0.001
    centre = R @ (0.12, 0.06, 0) + by
    second = R @ np.diag([0.24**2, 0.12**2, 0.001**2]) @ R.T / 12 + np.outer(centre, centre)
    np.testing.assert_allclose(body.mass, mass, rtol=1e-12)
    np.testing.assert_allclose(body.r_dm, mass * centre, rtol=1e-12)
    np.testing.assert_allclose(body.rr_dm, mass * second, atol=1e-12 * mass)


def test_mean_axis_leaves_no_momentum_in_the_elastic_field():
    frame = folded()
    body = fp.reduce(fp.from_frame(frame, []), fp.Request(name="f", reference=MeanAxis(), reduction=Eigenmodes(8)))
    about_centre = body.rP_dm - np.einsum("k,lj->klj", body.centre_of_mass, body.P_dm)
    np.testing.assert_allclose(body.P_dm, 0, atol=1e-9 * np.sqrt(body.mass))
    np.testing.assert_allclose(about_centre - about_centre.transpose(1, 0, 2), 0, atol=1e-9 * np.sqrt(body.mass))
    assert np.abs(body.rP_dm).max() > 1e-3


def folded(R=None) -> Frame:
    """Two panels at an angle, one of triangles, with a beam along the fold."""
    R = np.eye(3) if R is None else R

    def at(*corners):
        return [tuple(R @ corner) for corner in np.array(corners, float)]

    first = panel(at((0, 0, 0), (0.6, 0, 0), (0.6, 0.4, 0), (0, 0.4, 0)), Shell(0.004, STEEL), elements=(3, 2))
    second = panel(at((0, 0, 0), (0.6, 0, 0), (0.6, 0.1, 0.3), (0, 0.1, 0.3)), SHEET, elements=(3, 2))
    up = tuple(R @ (0, 0, 1.0))
    fold = polyline(at((0, 0, 0), (0.6, 0, 0)), Member(rectangle(0.01, 0.03), STEEL, up), elements=3)
    a, b = at((0, 0.4, 0), (0.6, 0.1, 0.3))
    return named(joined(first, triangulated(second), fold), a=a, b=b)


@pytest.mark.slow
def test_beams_and_plates_turn_together():
    R = rotation(5)
    ends = [InterfaceRegion("a"), InterfaceRegion("b")]
    request = fp.Request(name="f", reference=FixedTo("a"), reduction=CraigBampton(3), stress=True)
    body, turned = (fp.reduce(fp.from_frame(frame, ends), request) for frame in (folded(), folded(R)))
    np.testing.assert_allclose(turned.omega2, body.omega2, rtol=1e-7)
    np.testing.assert_allclose(turned.inertia, R @ body.inertia @ R.T, atol=1e-12 * np.trace(body.inertia))
    sign = np.sign(np.einsum("kj,kj->j", R @ body.P_dm, turned.P_dm))
    np.testing.assert_allclose(turned.P_dm * sign, R @ body.P_dm, atol=1e-7 * np.sqrt(body.mass))
    pull, turned_pull = body.stiffening[18:21], turned.stiffening[18:21] * np.outer(sign, sign)
    expected = np.einsum("kl,lij->kij", R, pull)
    np.testing.assert_allclose(turned_pull, expected, atol=1e-6 * np.abs(pull).max())
    assert body.provenance["frame"]["elements"] == {"beam": 3, "triangle": 12, "quadrilateral": 6}
    assert body.provenance["shells"][0]["thickness"] == 0.004


# ---- statics and vibration --------------------------------------------------------------------------------------------


def solved(frame: Frame, held: np.ndarray, load: np.ndarray) -> np.ndarray:
    """(N, 6) static coordinates with the held ones (N, 6) fixed under nodal loads (N, 6)."""
    K, free = assemble_frame(frame, families(frame)).K, np.flatnonzero(~held.ravel())
    q = np.zeros(held.size)
    q[free] = scipy.sparse.linalg.spsolve(K[free][:, free].tocsc(), load.ravel()[free])
    return q.reshape(-1, 6)


@pytest.mark.parametrize(("cut", "least"), [(triangulated, 23.43), (lambda f: f, 23.64)], ids=["triangles", "quads"])
def test_cooks_skew_panel(cut, least):
    """Cook's membrane: mid-edge deflection 23.96 (R. D. Cook, J. Struct. Div. 100 (1974) 1851-1863, refined)."""
    corners = [(0, 0, 0), (48, 44, 0), (48, 60, 0), (0, 44, 0)]
    frame = cut(panel(corners, Shell(1.0, Material("unit", 1.0, 1 / 3, 1.0)), elements=(8, 8)))
    P = frame.points
    held = np.zeros((len(P), 6), bool)
    held[:, 2:5] = True
    held[P[:, 0] == 0] = True
    edge = np.flatnonzero(P[:, 0] == 48)
    load = np.zeros((len(P), 6))
    load[edge, 1] = 1 / 8
    load[edge[[0, -1]], 1] = 1 / 16
    tip = solved(frame, held, load)[np.linalg.norm(P - (48, 52, 0), axis=1).argmin(), 1]
    assert least < tip < 23.97


def square_frequencies(edges: str, elements: int, cut) -> np.ndarray:
    """omega a^2 sqrt(rho h/D) of a thin square plate, supported on all edges, clamped, free or clamped on one."""
    h, D = 0.002, STEEL.E * 0.002**3 / 12 / (1 - 0.3**2)
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    frame = cut(panel(corners, Shell(h, STEEL, gyration=0.0), elements=(elements, elements)))
    x, y, _ = frame.points.T
    on_x, on_y = (x < 1e-9) | (x > 1 - 1e-9), (y < 1e-9) | (y > 1 - 1e-9)
    held = np.zeros((len(x), 6), bool)
    held[:, [0, 1, 5]] = True
    if edges == "supported":
        held[on_x, 3], held[on_y, 4], held[on_x | on_y, 2] = True, True, True
    held[{"clamped": on_x | on_y, "cantilever": x < 1e-9}.get(edges, np.zeros(len(x), bool))] = True
    matrices = assemble_frame(frame, families(frame))
    free = np.flatnonzero(~held.ravel())
    K, M = (A[free][:, free].toarray() for A in (matrices.K, matrices.M))
    values = scipy.linalg.eigh(K, M, eigvals_only=True, subset_by_index=(0, 8))
    return np.sqrt(np.abs(values[values > 1e-4 * values[-1]]) * STEEL.rho * h / D)


@CUT
@pytest.mark.parametrize(
    ("edges", "published", "off"),
    [
        ("supported", [19.7392, 49.3480, 49.3480, 78.9568], 0.021),
        ("clamped", [35.992, 73.413, 73.413, 108.27], 0.032),
        ("free", [13.468, 19.596, 24.270], 0.003),
        ("cantilever", [3.4710, 8.5066, 21.285, 27.199], 0.006),
    ],
)
def test_square_plates(edges, published, off, cut):
    """A. W. Leissa, J. Sound Vib. 31 (1973) 257-293, nu = 0.3; free and cantilever with the digits of later series
    solutions (D. J. Gorman, ibid. 49 (1976) 453-467 and 57 (1978) 437-447), where Leissa's Ritz bounds are 1 % high.
    """
    count = len(published)
    coarse, fine = (square_frequencies(edges, elements, cut)[:count] for elements in (6, 12))
    np.testing.assert_allclose(fine, published, rtol=off)
    np.testing.assert_allclose((4 * fine - coarse) / 3, published, rtol=off / 3)  # second order


# ---- what is drawn ----------------------------------------------------------------------------------------------------


@CUT
def test_faces_enclose_the_plate(cut):
    body = fp.reduce(
        fp.from_frame(cut(patch(rotation(2))), []), fp.Request(name="p", reference=MeanAxis(), reduction=Eigenmodes(2))
    )
    assert volume(body.surface) == pytest.approx(0.24 * 0.12 * 0.001, rel=1e-12)
    assert len(body.surface.points) == 16


def volume(surface: Surface) -> float:
    a, b, c = np.moveaxis(surface.points[surface.triangles], 1, 0)
    return float(np.einsum("tk,tk->", a, np.cross(b, c)) / 6)


@CUT
def test_stress_of_a_strip(cut):
    """A cantilever strip, nu = 0, under a moment and a pull at its end: M h/(2 I) and F/A on its faces, with its axes."""
    R, material, b, t, L = rotation(3), Material("m", 7e10, 0.0, 2700.0), 0.05, 0.004, 0.3
    corners = [tuple(R @ c) for c in ((0, 0, 0), (L, 0, 0), (L, b, 0), (0, b, 0))]
    frame = cut(panel(corners, Shell(t, material), elements=(6, 2)))
    along = frame.points @ R[:, 0]
    groups = {"root": np.flatnonzero(along < 1e-9), "tip": np.flatnonzero(along > L - 1e-9)}
    body = fp.reduce(
        fp.from_frame(replace(frame, node_groups=groups), [InterfaceRegion("root"), InterfaceRegion("tip")]),
        fp.Request(name="strip", reference=FixedTo("root"), reduction=CraigBampton(0), stress=True),
    )
    tip, F, M = body.interface("tip"), 800.0, 3.0
    q = (tip.phi_t.T @ (F * R[:, 0]) + tip.phi_r.T @ (M * R[:, 1])) / body.omega2
    stress = body.surface.stress @ q
    tensor = R.T @ stress[:, [[0, 3, 4], [3, 1, 5], [4, 5, 2]]] @ R
    above = (body.surface.points @ R)[:, 2] / (t / 2)
    expected = F / (b * t) + above * M * 6 / (b * t**2)
    np.testing.assert_allclose(tensor[:, 0, 0], expected, rtol=1e-6)
    tensor[:, 0, 0] = 0
    assert np.abs(tensor).max() < 1e-6 * expected.max()


# ---- guards -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: Shell(0.0, STEEL), "thickness is 0.0 m; it must be positive"),
        (lambda: Shell(np.nan, STEEL), "thickness is nan"),
        (lambda: Shell(0.01, STEEL, gyration=-1.0), "gyration is -1.0 m"),
        (lambda: element(np.array([(0, 0, 0), (1, 0, 0), (2, 0, 0)], float)), "plate element 0 .* has no area"),
        (lambda: element(QUADRILATERAL[[0, 0, 2, 3]]), "has no area"),
        (
            lambda: element(QUADRILATERAL + np.outer((1, 0, 0, 0), (0, 0, 0.1))),
            "quadrilateral 0 .* is warped",
        ),
        (
            lambda: element(np.array([(0, 0, 0), (1, 0, 0), (0.2, 0.2, 0), (0, 1, 0)], float)),
            "is concave or turned inside out",
        ),
        (lambda: element(QUADRILATERAL[[0, 2, 1, 3]]), "concave or turned inside out|has no area"),
        (lambda: panel([(0, 0, 0)] * 3, SHEET, elements=(1, 1)), "four finite corners"),
        (lambda: panel(QUADRILATERAL, SHEET, elements=(0, 1)), r"panel of \(0, 1\) elements"),
        (lambda: check_frame(replace(patch(), shell_of=np.ones(5, int))), "one of the 1 shells"),
        (lambda: replace(patch(), shell_of=np.zeros(4, int)), r"shell_of has the shape \(4,\)"),
        (
            lambda: check_frame(replace(patch(), quadrilaterals=patch().quadrilaterals[[0, 0, 1, 2, 3]])),
            "more than once",
        ),
    ],
)
def test_plates_that_cannot_be_used(make, says):
    with pytest.raises(InputError, match=says):
        make()
