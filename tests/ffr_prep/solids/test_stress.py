"""Recovered stress: exact for linear fields, equal to the full model's, converging; kept in the body file."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse.linalg
import skfem
from boxes import KINDS, STEEL, box_mesh, moved, rotation, shaken
from skfem.quadrature import get_quadrature

import ffr_prep as fp
from ffr_prep.body import TENSOR, BodyError, load_body, save_body, truncated, with_point
from ffr_prep.mesh.cells import KINDS as ELEMENTS
from ffr_prep.mesh.mesh import surface_triangles
from ffr_prep.mesh.shapes import quadrature
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.material import Material
from ffr_prep.model.reference import FixedTo, functionals
from ffr_prep.reduction.basis import factorised
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.solids.assembly import STIFFNESS_ORDER, assemble
from ffr_prep.solids.interfaces import couple
from ffr_prep.solids.model import boundary
from ffr_prep.solids.stress_modes import extrapolation, stressed_boundary
from ffr_prep.solvers.factor import solve_refined, supported

SOFT = Material("soft", E=3.0e9, nu=0.4, rho=1200.0)
BAR = (1.0, 0.1, 0.1)


def hooke(material, gradient):
    """(3, 3) stress of a displacement gradient."""
    strain = (gradient + gradient.T) / 2
    lam = material.E * material.nu / ((1 + material.nu) * (1 - 2 * material.nu))
    return lam * np.trace(strain) * np.eye(3) + material.E / (1 + material.nu) * strain


def six(tensor):
    return np.array([tensor[pair] for pair in TENSOR])


def cantilever(kind="tet10", modes=2, stress=True, cells=(6, 1, 1)):
    return fp.reduce(
        fp.from_mesh(box_mesh(kind, BAR, cells), STEEL, [InterfaceRegion("left"), InterfaceRegion("right")]),
        fp.Request(name="bar", reference=FixedTo("left"), reduction=CraigBampton(modes), stress=stress),
    )


# ---- laws ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
def test_a_linear_field_has_its_stress_at_every_node(kind):
    mesh = moved(shaken(box_mesh(kind, (1.0, 0.5, 0.7), (2, 2, 2)), 0.02), rotation(1), np.ones(3))
    rng = np.random.default_rng(0)
    gradients = rng.normal(size=(2, 3, 3))
    field = np.stack([mesh.points @ g.T + rng.normal(size=3) for g in gradients], axis=-1)
    surface = stressed_boundary(mesh, STEEL, field)
    for k, gradient in enumerate(gradients):
        exact = six(hooke(STEEL, gradient))
        np.testing.assert_allclose(surface.stress[:, :, k], np.tile(exact, (len(surface.points), 1)), rtol=1e-9)
    np.testing.assert_allclose(surface.moduli, np.tile([STEEL.E, STEEL.nu], (len(surface.points), 1)), rtol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_rigid_motions_and_turned_axes(kind):
    """Rigid motions cause no stress; the stress of a turned body is the turned stress."""
    mesh, R = box_mesh(kind, (1.0, 0.5, 0.7), (1, 2, 1)), rotation(3)
    field = np.random.default_rng(2).normal(size=(*mesh.points.shape, 1))
    here = stressed_boundary(mesh, STEEL, field).stress[..., 0]
    there = stressed_boundary(moved(mesh, R, np.zeros(3)), STEEL, np.einsum("kl,plj->pkj", R, field)).stress[..., 0]
    for one, other in zip(here, there, strict=True):
        tensor = np.zeros((3, 3))
        for value, pair in zip(one, TENSOR, strict=True):
            tensor[pair] = tensor[pair[::-1]] = value
        np.testing.assert_allclose(six(R @ tensor @ R.T), other, atol=1e-9 * np.abs(here).max())
    spin = np.cross([0.3, -0.2, 0.5], mesh.points) + np.array([1.0, 2.0, 3.0])
    assert np.abs(stressed_boundary(mesh, STEEL, spin[..., None]).stress).max() < 1e-12 * STEEL.E


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "tet4"])
def test_the_extension_to_the_nodes_keeps_what_the_fit_contains(kind):
    X, _ = quadrature(kind, STIFFNESS_ORDER[kind])
    fields = [lambda x: 1 + x[0] - 2 * x[1] + 3 * x[2]]
    fields += [lambda x: x[0] * x[1], lambda x: x[0] * x[1] * x[2]] if kind.startswith("hex") else []
    for f in fields:
        np.testing.assert_allclose(extrapolation(kind) @ f(X), f(ELEMENTS[kind].nodes.T), atol=1e-12)


def test_hexahedra_of_second_order_sample_at_the_superconvergent_points():
    """A quadratic stress is seen as the field through its values at the 2 x 2 x 2 Gauss points."""
    X, _ = get_quadrature(skfem.refdom.RefHex, STIFFNESS_ORDER["hex27"])
    low, high = 0.5 - 1 / np.sqrt(12), 0.5 + 1 / np.sqrt(12)
    through = low**2 + (high + low) * (ELEMENTS["hex27"].nodes[:, 0] - low)
    np.testing.assert_allclose(extrapolation("hex27") @ X[0] ** 2, through, atol=1e-12)


@pytest.mark.parametrize("kind", ["tet10", "hex20"])
def test_stress_is_not_averaged_across_materials(kind):
    """Two materials in series under one tension: each keeps its own lateral stress up to the boundary."""
    mesh = box_mesh(kind, (2.0, 1.0, 1.0), (2, 1, 1))
    count = len(mesh.blocks[0].nodes)
    right = np.flatnonzero(mesh.points[mesh.blocks[0].nodes].mean(axis=1)[:, 0] > 1.0)
    groups = {"left": np.setdiff1d(np.arange(count), right), "right": right}
    mesh = replace(mesh, volume_groups=groups)
    gradient = np.random.default_rng(4).normal(size=(3, 3))
    materials = {"left": STEEL, "right": SOFT}
    surface = stressed_boundary(mesh, materials, (mesh.points @ gradient.T)[..., None])
    for material, side in ((STEEL, -1), (SOFT, 1)):
        own = np.isclose(surface.moduli[:, 0], material.E)
        assert (side * (surface.points[own, 0] - 1.0) >= 0).all()
        expected = np.tile(six(hooke(material, gradient)), (own.sum(), 1))
        np.testing.assert_allclose(surface.stress[own, :, 0], expected, rtol=1e-9)
    nodes, triangles = surface_triangles(mesh)
    seam = np.isclose(mesh.points[nodes, 0], 1.0).sum()
    assert len(surface.points) == len(nodes) + seam
    corners = np.sort(mesh.points[nodes[triangles]].reshape(len(triangles), -1), axis=0)
    np.testing.assert_array_equal(
        np.sort(surface.points[surface.triangles].reshape(len(triangles), -1), axis=0), corners
    )


def test_one_material_leaves_the_surface_as_it_was():
    mesh = box_mesh("tet10", (1.0, 0.5, 0.7), (2, 1, 1))
    field = np.random.default_rng(5).normal(size=(*mesh.points.shape, 2))
    with_stress, without = stressed_boundary(mesh, {"body": STEEL}, field), boundary(mesh, field)
    for key in ("points", "triangles", "Phi"):
        assert getattr(with_stress, key).tobytes() == getattr(without, key).tobytes()


# ---- against the full model and closed forms ------------------------------------------------------------------------


def test_static_load_at_an_interface_stresses_the_reduced_body_as_the_full_model():
    """The constraint modes hold the static solution, so without normal modes the stress is the full model's."""
    body, mesh = cantilever(modes=0), box_mesh("tet10", BAR, (6, 1, 1))
    matrices = assemble(mesh, STEEL)
    model = couple(mesh, matrices, [InterfaceRegion("left"), InterfaceRegion("right")])
    load = np.array([3e5, -2e3, 5e2, 40.0, -70.0, 90.0])
    held = supported(factorised(model), functionals(FixedTo("left"), model))
    z, _ = solve_refined(held, model.C.toarray()[6:].T @ load[:, None], np.zeros((6, 1)))
    field = (model.B @ z).reshape(*mesh.points.shape, 1)
    full = stressed_boundary(mesh, STEEL, field).stress[..., 0]
    tip = body.interface("right")
    q = np.vstack([tip.phi_t, tip.phi_r]).T @ load / body.omega2
    np.testing.assert_allclose(body.surface.stress @ q, full, atol=1e-9 * np.abs(full).max())


def bent_cantilever(n):
    """RMS error over the surface of the recovered stress, against the exact solution, relative to the largest one.

    Timoshenko & Goodier, Theory of Elasticity (1970), art. 21, for nu = 0; both ends move as the exact solution does.
    """
    material = Material("m", E=1e9, nu=0.0, rho=1000.0)
    L, h, P = 2.0, 1.0, 1e6
    mesh = box_mesh("tet10", (L, h, h), (2 * n, n, n), origin=(0.0, -h / 2, -h / 2))
    x, y, _ = mesh.points.T
    EI = material.E * h**4 / 12
    u_x = -P * y / (6 * EI) * ((6 * L - 3 * x) * x + 2 * (y**2 - h**2 / 4))
    u_y = P / (6 * EI) * (h**2 * x + (3 * L - x) * x**2)
    exact_u = np.stack([u_x, u_y, 0 * x], axis=1).ravel()
    K = assemble(mesh, material).K.tocsc()
    held = np.flatnonzero(np.repeat((x < 1e-9) | (x > L - 1e-9), 3))
    free = np.setdiff1d(np.arange(3 * len(x)), held)
    u = exact_u.copy()
    # The parabolic shear at both ends is prescribed by the displacement; the other sides are free of load.
    u[free] = scipy.sparse.linalg.spsolve(K[free][:, free], -K[free][:, held] @ exact_u[held])
    surface = stressed_boundary(mesh, material, u.reshape(-1, 3, 1))
    x, y, _ = surface.points.T
    exact = np.zeros((len(x), 6))
    exact[:, 0] = -P * (L - x) * y / (h**4 / 12)
    exact[:, 3] = P / (2 * h**4 / 12) * (h**2 / 4 - y**2)
    return np.sqrt(((surface.stress[..., 0] - exact) ** 2).sum(axis=1).mean()) / np.abs(exact).max()


def test_bending_stress_converges_with_the_square_of_the_element_size():
    errors = [bent_cantilever(n) for n in (1, 2, 4)]
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert rates[-1] > 1.8, (errors, rates)
    assert errors[-1] < 0.01


@pytest.mark.parametrize(
    ("kind", "cells", "allowed"),
    [("tet10", (10, 2, 2), 0.03), ("tet10", (20, 3, 3), 0.01), ("hex20", (8, 1, 1), 1e-3)],
)
def test_a_tip_force_bends_the_reduced_cantilever_by_the_section_modulus(kind, cells, allowed):
    """sigma = F (L - x) c / I at every node of the upper edge in mid-length."""
    body = cantilever(kind, modes=0, cells=cells)
    q = body.interface("right").phi_t[1] * -1000.0 / body.omega2
    stress = (body.surface.stress @ q)[:, 0]
    x, y, _ = body.surface.points.T
    top = np.isclose(x, 0.5) & np.isclose(y, 0.1)
    assert top.sum() >= 3
    np.testing.assert_allclose(stress[top], 1000.0 * 0.5 * 0.05 / (0.1**4 / 12), rtol=allowed)


# ---- in the body and its file ---------------------------------------------------------------------------------------


def test_a_body_keeps_its_stress_modes(tmp_path):
    body = cantilever()
    again = load_body(save_body(body, tmp_path / "bar.ffr"))
    for key in ("points", "triangles", "Phi", "stress", "moduli"):
        assert getattr(again.surface, key).tobytes() == getattr(body.surface, key).tobytes()
    assert "mean over the elements of one material" in again.provenance["stress"]
    short = truncated(again, [3, 1])
    np.testing.assert_array_equal(short.surface.stress, body.surface.stress[..., [3, 1]])
    np.testing.assert_array_equal(short.surface.moduli, body.surface.moduli)
    middle = with_point(body, "middle", np.array([0.5, 0.1, 0.1]))
    np.testing.assert_array_equal(middle.surface.stress, body.surface.stress)


def test_without_being_asked_for_there_is_none(tmp_path):
    body = cantilever(stress=False)
    assert body.surface.stress is None
    assert body.surface.moduli is None
    assert "stress" not in body.provenance
    assert load_body(save_body(body, tmp_path / "bar.ffr")).surface.stress is None


def test_stress_modes_must_fit_the_surface():
    surface = cantilever().surface
    with pytest.raises(BodyError, match="moduli at the same points belong together"):
        replace(surface, moduli=None)
    with pytest.raises(BodyError, match="stress has shape"):
        replace(surface, stress=surface.stress[:, :5])
    with pytest.raises(BodyError, match="moduli has shape"):
        replace(surface, moduli=surface.moduli[:-1])
    with pytest.raises(BodyError, match="not finite"):
        replace(surface, stress=np.full_like(surface.stress, np.nan))


def test_a_point_where_materials_meet_turns_with_both_sides():
    """With the stress the node is there twice; the point on it is the same as without."""
    mesh = box_mesh("hex8", BAR, (4, 1, 1))
    mesh = replace(mesh, volume_groups={"left": np.array([0, 1]), "right": np.array([2, 3])})
    bodies = [
        fp.reduce(
            fp.from_mesh(mesh, {"left": STEEL, "right": SOFT}, [InterfaceRegion("left"), InterfaceRegion("right")]),
            fp.Request(name="bar", reference=FixedTo("left"), reduction=CraigBampton(1), stress=stress),
        )
        for stress in (False, True)
    ]
    without, doubled = (with_point(body, "seam", np.array([0.5, 0.1, 0.1])).interface("seam") for body in bodies)
    np.testing.assert_array_equal(doubled.phi_t, without.phi_t)
    np.testing.assert_allclose(doubled.phi_r, without.phi_r, atol=1e-12 * np.abs(without.phi_r).max())
