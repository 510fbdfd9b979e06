"""Inertia integrals: exact polynomial fields, identities of the deformed body, tensor laws."""

from itertools import product

import numpy as np
import pytest
from boxes import STEEL, box_mesh, moved, rotation, shaken
from synthetic import cloud

import ffr_prep as fp
from ffr_prep.body import axial
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.invariants import inertia_integrals
from ffr_prep.model.material import Material
from ffr_prep.model.reference import FixedTo, MeanAxis, functionals
from ffr_prep.reduction.basis import factorised
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.solids.assembly import assemble
from ffr_prep.solids.interfaces import couple

# ---- exact: a brick with polynomial displacement fields -----------------------------------------------------------
# x in [0, a], |y| < b/2, |z| < c/2; a field is one polynomial per component, {(powers of x, y, z): coefficient}.

A, B, C, RHO = 2.0, 0.3, 0.2, 7800.0
POSITION = ({(1, 0, 0): 1.0}, {(0, 1, 0): 1.0}, {(0, 0, 1): 1.0})
FIELDS = (
    ({(1, 0, 0): 1.0}, {}, {}),
    ({(0, 1, 0): 1.0}, {}, {}),
    ({}, {(1, 0, 0): 1.0}, {}),
    ({}, {}, {(0, 0, 1): 1.0}),
    ({(1, 1, 0): -1.0}, {(2, 0, 0): 0.5}, {}),
    ({(1, 0, 1): -1.0}, {}, {(2, 0, 0): 0.5}),
)
# Quadratic fields lie in the element spaces of these; a distorted hex20 does not contain them.
HOLDING = [("tet10", True), ("hex27", True), ("hex20", False)]


def integral(*factors):
    """Integral of rho times the product of polynomials over the brick, by powers."""
    total = 0.0
    for terms in product(*(factor.items() for factor in factors)):
        i, j, k = np.sum([powers for powers, _ in terms], axis=0) if terms else (0, 0, 0)
        along = A ** (i + 1) / (i + 1)
        across = [2 * (h / 2) ** (p + 1) / (p + 1) * (p % 2 == 0) for h, p in ((B, j), (C, k))]
        total += RHO * along * np.prod(across) * np.prod([coefficient for _, coefficient in terms])
    return total


def values(field, points):
    return np.stack(
        [sum(c * np.prod(points**powers, axis=1) for powers, c in part.items()) + 0 * points[:, 0] for part in field], 1
    )


def brick_integrals(kind, distorted):
    mesh = box_mesh(kind, (A, B, C), (3, 2, 2), origin=(0.0, -B / 2, -C / 2))
    mesh = shaken(mesh, 0.03) if distorted else mesh
    m = assemble(mesh, Material(name="brick", E=2e11, nu=0.3, rho=RHO)).m
    return inertia_integrals(mesh.points, m, np.stack([values(field, mesh.points) for field in FIELDS], axis=-1))


@pytest.mark.parametrize(("kind", "distorted"), HOLDING)
def test_every_integral_of_the_polynomial_fields(kind, distorted):
    found = brick_integrals(kind, distorted)
    count = len(FIELDS)
    expected = {
        "mass": integral(),
        "r_dm": [integral(POSITION[k]) for k in range(3)],
        "rr_dm": [[integral(POSITION[k], POSITION[m]) for m in range(3)] for k in range(3)],
        "P_dm": [[integral(FIELDS[j][k]) for j in range(count)] for k in range(3)],
        "rP_dm": [[[integral(POSITION[k], FIELDS[j][m]) for j in range(count)] for m in range(3)] for k in range(3)],
        "PP_dm": [
            [[[integral(FIELDS[i][k], FIELDS[j][m]) for j in range(count)] for i in range(count)] for m in range(3)]
            for k in range(3)
        ],
    }
    for key, exact in expected.items():
        scale = np.abs(exact).max()
        np.testing.assert_allclose(getattr(found, key), exact, rtol=0, atol=1e-12 * scale, err_msg=key)


@pytest.mark.parametrize(("kind", "distorted"), HOLDING)
def test_closed_form_numbers_of_the_brick(kind, distorted):
    """The same, as numbers worked out by hand: mass, inertia, I3, I4, I5, I6."""
    found = brick_integrals(kind, distorted)
    close = {"rtol": 0, "atol": 1e-9}
    assert found.mass == pytest.approx(936, rel=1e-12)
    np.testing.assert_allclose(found.r_dm, [936, 0, 0], **close)
    inertia = np.trace(found.rr_dm) * np.eye(3) - found.rr_dm
    np.testing.assert_allclose(inertia, np.diag([10.14, 1251.12, 1255.02]), **close)
    np.testing.assert_allclose(
        found.P_dm.T, [[936, 0, 0], [0, 0, 0], [0, 936, 0], [0, 0, 0], [0, 624, 0], [0, 0, 624]], **close
    )
    turning = axial(found.rP_dm).T
    np.testing.assert_allclose(turning[[0, 1, 2]], [[0, 0, 0], [0, 0, -7.02], [0, 0, 1248]], **close)
    np.testing.assert_allclose(turning[[4, 5]], [[0, 0, 943.02], [0, -939.12, 0]], **close)
    I5, I6 = axial(found.PP_dm), np.einsum("kkij->ij", found.PP_dm)
    np.testing.assert_allclose(I5[:, 4, 5], [748.8, 0, 0], **close)
    np.testing.assert_allclose(I5[:, 0, 2], [0, 0, 1248], **close)
    np.testing.assert_allclose([I6[4, 4], I6[5, 5], I6[2, 4], I6[1, 4]], [758.16, 752.96, 936, -7.02], **close)


# ---- identities of a reduced body ---------------------------------------------------------------------------------

INTERFACES = (InterfaceRegion("left"), InterfaceRegion("right", kind="mean"))
MESH = shaken(box_mesh("tet10", (0.8, 0.2, 0.1), (4, 2, 1), origin=(0.1, -0.3, 0.2)), 0.01)


def reduced(mesh, reference):
    return fp.reduce(
        fp.from_mesh(mesh, STEEL, INTERFACES), fp.Request(name="b", reference=reference, reduction=CraigBampton(4))
    )


@pytest.fixture(scope="module")
def body():
    return reduced(MESH, FixedTo("left"))


@pytest.fixture(scope="module")
def deformed(body):
    """Arbitrary elastic coordinates of visible size, with the deformed and the velocity field from quadrature."""
    matrices = assemble(MESH, STEEL)
    model = couple(MESH, matrices, INTERFACES)
    Z = CraigBampton(4).basis(model, factorised(model), functionals(FixedTo("left"), model)).Z
    rng = np.random.default_rng(0)
    q, qd = rng.normal(size=(2, body.n))
    Phi = (model.B @ Z).reshape(-1, 3, body.n)
    return matrices.m, q, qd, MESH.points + Phi @ q, Phi @ qd


def test_inertia_of_the_deformed_body_from_I7_I8_I9(body, deformed):
    m, q, _, x, _ = deformed
    second = x.T @ (m @ x)
    direct = np.trace(second) * np.eye(3) - second
    I8 = np.einsum("jkl,j->kl", body.I8, q)
    from_views = body.I7 - (I8 + I8.T) - np.einsum("ijkl,i,j->kl", body.I9, q, q)
    np.testing.assert_allclose(from_views, direct, rtol=0, atol=1e-11 * np.abs(direct).max())
    assert np.abs(direct - body.I7).max() > 0.1 * np.abs(body.I7).max()


def test_momenta_and_energy_of_the_deformed_body(body, deformed):
    m, q, qd, x, v = deformed
    np.testing.assert_allclose(body.I2 + body.I3 @ q, (m @ x).sum(axis=0), rtol=0, atol=1e-11 * body.mass)
    angular = np.cross(x, m @ v).sum(axis=0)
    from_views = body.I4 @ qd + np.einsum("kij,i,j->k", body.I5, q, qd)
    np.testing.assert_allclose(from_views, angular, rtol=0, atol=1e-11 * np.abs(angular).max())
    assert qd @ body.I6 @ qd == pytest.approx(np.sum(v * (m @ v)), rel=1e-11)


def test_shabanas_integrals_are_views_of_the_same(body):
    for k, m in product(range(3), repeat=2):
        np.testing.assert_array_equal(body.S_bar_kl(k, m), body.PP_dm[k, m])
        np.testing.assert_array_equal(body.N_bar_kl(k, m), -body.N_bar_kl(k, m).T)
        np.testing.assert_array_equal(body.S_bar_kl(k, m), body.S_bar_kl(m, k).T)
    np.testing.assert_array_equal(body.S_bar, body.I3)
    np.testing.assert_array_equal(body.S_bar_ff, body.I6)
    np.testing.assert_array_equal(body.I5[0], body.N_bar_kl(1, 2))
    np.testing.assert_allclose(body.I6, np.eye(body.n), atol=1e-11)


def test_I8_and_I9_are_products_of_skew_matrices(body):
    """Integral of u~ v~ = v u^T - (u . v) 1, so that I9_ij^T = I9_ji and the trace of I8_j is -2 tr rP_dm_j."""
    np.testing.assert_allclose(body.I9, body.I9.transpose(1, 0, 3, 2), atol=1e-14)
    np.testing.assert_allclose(np.einsum("jkk->j", body.I8), -2 * np.einsum("kkj->j", body.rP_dm), rtol=1e-12)
    points = cloud(4)  # mass points, whose integrals are sums
    mass, u, Phi = np.array(points.provenance["masses"]), points.surface.points, points.surface.Phi
    u, Phi = (skew(vectors) for vectors in (u, np.moveaxis(Phi, 2, 0)))
    np.testing.assert_allclose(points.I8, np.einsum("p,pkm,jpml->jkl", mass, u, Phi), rtol=0, atol=1e-13)
    np.testing.assert_allclose(points.I9, np.einsum("p,ipkm,jpml->ijkl", mass, Phi, Phi), rtol=0, atol=1e-13)


def skew(vectors):
    """(..., 3, 3) matrices a~ of vectors (..., 3): a~ b = a x b."""
    return np.stack([np.cross(vectors, axis) for axis in np.eye(3)], axis=-1)


@pytest.mark.parametrize("reference", [FixedTo("left"), MeanAxis()], ids=lambda r: type(r).__name__)
def test_a_turned_and_shifted_mesh_transforms_the_integrals_as_tensors(reference):
    R, by = rotation(9), np.array([1.0, -2.0, 0.5])
    here, there = reduced(MESH, reference), reduced(moved(MESH, R, by), reference)
    np.testing.assert_allclose(there.omega2, here.omega2, rtol=1e-8)
    # The signs of the modes follow their largest component, which a rotation may exchange.
    sign = np.sign(np.einsum("kj,kl,lj->j", there.interface("right").phi_t, R, here.interface("right").phi_t))
    P = sign * (R @ here.P_dm)
    rP = sign * np.einsum("km,ln,mnj->klj", R, R, here.rP_dm) + np.einsum("k,lj->klj", by, P)
    PP = np.einsum("i,j,km,ln,mnij->klij", sign, sign, R, R, here.PP_dm)
    r = R @ here.r_dm
    rr = R @ here.rr_dm @ R.T + np.outer(by, r) + np.outer(r, by) + here.mass * np.outer(by, by)
    assert there.mass == pytest.approx(here.mass, rel=1e-12)
    # Natural sizes: lengths near 1 m, the mean axis has P_dm = 0.
    root = np.sqrt(here.mass)
    tip, turned = here.interface("right"), there.interface("right")
    for found, expected, scale in [
        (there.r_dm, r + here.mass * by, here.mass),
        (there.rr_dm, rr, here.mass),
        (there.P_dm, P, root),
        (there.rP_dm, rP, root),
        (there.PP_dm, PP, 1.0),
        (turned.phi_t, sign * (R @ tip.phi_t), np.abs(tip.phi_t).max()),
        (turned.phi_r, sign * (R @ tip.phi_r), np.abs(tip.phi_r).max()),
        (turned.position, R @ tip.position + by, 1.0),
    ]:
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * scale)
