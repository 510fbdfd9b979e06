"""Anisotropic materials: the isotropic limit, frame invariance, closed forms, guards, and the text forms."""

from dataclasses import replace

import numpy as np
import pytest
from boxes import KINDS, STEEL, box_mesh, moved, rotation, shaken
from places import ROOT

from ffr_dyn.scene.stress_sensors import StressMeasurement, measured_modes
from ffr_prep.body import load_body, save_body
from ffr_prep.cli.options import material_of
from ffr_prep.common.errors import InputError
from ffr_prep.mesh.mesh import Block
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.material import AnisotropicMaterial, Material, orthotropic, parse_material
from ffr_prep.model.reference import FixedTo
from ffr_prep.pipelines.reduce import Request, reduce
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.solids.assembly import assemble
from ffr_prep.solids.model import from_mesh
from ffr_prep.structures.frame import Shell

# Carbon fibres in epoxy, AS4/3501-6: I. M. Daniel, O. Ishai, Engineering Mechanics of Composite Materials (2006), table A.4.
E, NU, G, RHO = (147e9, 10.3e9, 10.3e9), (0.27, 0.27, 0.54), (7.0e9, 7.0e9, 3.7e9), 1600.0
PLY = orthotropic("ply", E=E, nu=NU, G=G, rho=RHO)
LAME = (STEEL.E * STEEL.nu / ((1 + STEEL.nu) * (1 - 2 * STEEL.nu)), STEEL.E / (2 * (1 + STEEL.nu)))


def six_by_six(lam, mu):
    C = np.diag([2 * mu] * 3 + [mu] * 3)
    C[:3, :3] += lam
    return C


def plane_turned(degrees):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def reduced(mesh, material, **options):
    model = from_mesh(mesh, material, [InterfaceRegion("left"), InterfaceRegion("right")])
    settings = {"reference": FixedTo("left"), "reduction": CraigBampton(4), "stress": True}
    return reduce(model, Request(name="beam", **settings | options))


# ---- laws ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
def test_an_isotropic_matrix_in_any_axes_is_the_isotropic_material(kind):
    mesh = shaken(box_mesh(kind, (1.0, 0.2, 0.1), (2, 1, 1)), 0.01)
    general = AnisotropicMaterial("steel", six_by_six(*LAME), STEEL.rho, rotation(3))
    one, other = assemble(mesh, STEEL), assemble(mesh, general)
    assert abs(one.K - other.K).max() < 1e-14 * abs(one.K).max()
    np.testing.assert_array_equal(one.m.toarray(), other.m.toarray())


@pytest.mark.slow
def test_a_body_of_an_isotropic_matrix_is_the_isotropic_body():
    mesh = box_mesh("hex20", (1.0, 0.1, 0.05), (4, 1, 1))
    one, other = reduced(mesh, STEEL), reduced(mesh, AnisotropicMaterial("steel", six_by_six(*LAME), STEEL.rho))
    np.testing.assert_allclose(other.omega2, one.omega2, rtol=1e-9)
    size = np.abs(one.stiffening).max(axis=(1, 2))
    np.testing.assert_allclose(np.abs(other.stiffening), np.abs(one.stiffening), rtol=0, atol=1e-8 * size.max())
    np.testing.assert_allclose(
        np.abs(other.surface.stress), np.abs(one.surface.stress), rtol=0, atol=1e-8 * np.abs(one.surface.stress).max()
    )


@pytest.mark.parametrize("kind", ["tet10", "hex20"])
def test_turning_the_body_with_its_material_changes_nothing(kind):
    mesh = box_mesh(kind, (1.0, 0.1, 0.06), (4, 1, 1))
    R, axes = rotation(7), plane_turned(30)
    here = reduced(mesh, replace(PLY, axes=axes))
    there = reduced(moved(mesh, R, np.array([0.3, -2.0, 1.0])), replace(PLY, axes=R @ axes))
    np.testing.assert_allclose(there.omega2, here.omega2, rtol=1e-8)
    tension = (R @ [1.0, 0.0, 0.0]) @ np.moveaxis(there.stiffening[18:21], 0, 1)
    expected = here.stiffening[18]
    signs = np.sign(np.einsum("kn,kn->n", R @ here.interfaces[1].phi_t, there.interfaces[1].phi_t))
    scale = np.sqrt(np.outer(here.omega2, here.omega2))  # what the stiffness of a load is beside
    np.testing.assert_allclose(signs[:, None] * tension.T * signs / scale, expected / scale, rtol=0, atol=1e-12)


def test_two_axes_are_a_rotation():
    turned = replace(PLY, axes=((2.0, 2.0, 0.0), (0.0, 5.0, 0.0)))
    np.testing.assert_allclose(turned.axes, plane_turned(45), atol=1e-15)
    np.testing.assert_allclose(turned.elasticity_tensor(), replace(PLY, axes=plane_turned(45)).elasticity_tensor())


def test_materials_of_different_kinds_by_volume_group():
    mesh = box_mesh("hex8", (2.0, 1.0, 1.0), (2, 1, 1))
    mesh = replace(mesh, volume_groups={"one": np.array([0]), "two": np.array([1])})
    parts = [replace(mesh, blocks=(Block("hex8", mesh.blocks[0].nodes[[k]]),), volume_groups={}) for k in range(2)]
    expected = assemble(parts[0], STEEL).K + assemble(parts[1], PLY).K
    found = assemble(mesh, {"one": STEEL, "two": PLY}).K
    np.testing.assert_allclose(found.toarray(), expected.toarray(), rtol=0, atol=1e-4)


# ---- closed forms -------------------------------------------------------------------------------------------------


def directional_modulus(degrees):
    """Young's modulus along the length of fibres turned in their plane (Daniel & Ishai 2006, eq. 4.61)."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return 1 / (c**4 / E[0] + s**4 / E[1] + (1 / G[0] - 2 * NU[0] / E[0]) * (c * s) ** 2)


@pytest.mark.parametrize("degrees", [0, 30, 90])
def test_a_bar_under_tension_has_the_modulus_along_its_length(degrees):
    """Uniform stress, which linear displacements of the closed form hold exactly."""
    a, b, c = size = (2.0, 0.3, 0.2)
    mesh = shaken(box_mesh("tet10", size, (2, 2, 2)), 0.02)
    K = assemble(mesh, replace(PLY, axes=plane_turned(degrees))).K
    ends = [mesh.points[:, 0] > a - 1e-9, mesh.points[:, 0] < 1e-9]
    C = replace(PLY, axes=plane_turned(degrees)).elasticity_tensor().reshape(9, 9)
    strain = (np.linalg.pinv(C) @ np.eye(9)[0]).reshape(3, 3)
    f = (K @ (mesh.points @ strain).ravel()).reshape(-1, 3)
    assert f[ends[0]].sum(axis=0) == pytest.approx([b * c, 0, 0], rel=1e-9, abs=1e-12)
    inside = ~(ends[0] | ends[1])
    assert np.abs(f[inside]).max() < 1e-10 * np.abs(f).max()  # no traction on the sides
    assert strain[0, 0] == pytest.approx(1 / directional_modulus(degrees), rel=1e-12)


@pytest.mark.parametrize(("fibres", "modulus"), [(0, E[0]), (90, E[1])])
def test_a_slender_cantilever_bends_and_stretches_by_the_modulus_along_it(fibres, modulus):
    """Euler-Bernoulli with the shear of Timoshenko; the constraint modes at the tip are the static stiffness."""
    L, h, w = 2.0, 0.05, 0.04
    body = reduced(box_mesh("hex20", (L, h, w), (24, 1, 1)), replace(PLY, axes=plane_turned(fibres)))
    tip = body.interfaces[1]
    flexibility = (tip.phi_t / body.omega2) @ tip.phi_t.T
    assert flexibility[0, 0] == pytest.approx(L / (modulus * h * w), rel=5e-3)
    shear = L / (5 / 6 * G[0] * h * w)
    assert flexibility[1, 1] == pytest.approx(L**3 / (3 * modulus * w * h**3 / 12) + shear, rel=1e-2)  # rigid ends


def test_stress_of_a_stretched_bar_is_force_over_area(tmp_path):
    L, h, w = 1.0, 0.1, 0.1
    body = reduced(box_mesh("hex20", (L, h, w), (8, 2, 2)), replace(PLY, axes=plane_turned(0)))
    q = body.interfaces[1].phi_t[0] / body.omega2  # of a unit force along x
    middle = np.abs(body.surface.points[:, 0] - L / 2) < 1e-9
    np.testing.assert_allclose((body.surface.stress @ q)[middle, 0], 1 / (h * w), rtol=5e-3)
    again = load_body(save_body(body, tmp_path / "ply.ffr"))
    np.testing.assert_array_equal(again.surface.moduli, 0.0)


# ---- guards -------------------------------------------------------------------------------------------------------


def test_strain_of_an_anisotropic_body_is_refused_and_stress_is_not():
    surface = reduced(box_mesh("hex8", (1.0, 0.1, 0.1), (3, 1, 1)), PLY).surface
    assert measured_modes(StressMeasurement("s", "beam", (0.5, 0.0, 0.0), what="von-mises"), surface).unit == "Pa"
    with pytest.raises(InputError, match=r"isotropic materials only.*take the stress"):
        measured_modes(StressMeasurement("s", "beam", (0.5, 0.0, 0.0), what="strain-xx"), surface)


def test_a_plate_of_an_anisotropic_material_is_refused():
    with pytest.raises(InputError, match=r"material 'ply' is not isotropic.*mesh the part as a solid"):
        Shell(0.01, PLY)


def skewed():
    C = six_by_six(1.0, 1.0)
    C[0, 1] = 2.0
    return C


@pytest.mark.parametrize(
    ("elasticity", "axes", "words"),
    [
        (np.eye(3), np.eye(3), r"shape \(3, 3\); it must be 6 x 6"),
        ([[1.0], [1.0, 2.0]], np.eye(3), "rows of numbers of equal length"),
        (skewed(), np.eye(3), r"not symmetric: \[0, 1\] is 2"),
        (six_by_six(-1.0, 1.0), np.eye(3), "not positive definite"),
        (six_by_six(1.0, 1.0), np.diag([1, 1, -1]), "neither a 3 x 3 rotation"),
        (six_by_six(1.0, 1.0), ((1, 0, 0), (2, 0, 0)), "nor two directions that differ"),
    ],
)
def test_an_elasticity_that_no_solid_has_is_refused(elasticity, axes, words):
    with pytest.raises(InputError, match=words):
        AnisotropicMaterial("odd", elasticity, 1000.0, axes)


def test_poisson_ratios_that_cost_negative_energy_are_refused():
    with pytest.raises(InputError, match="nu12 = nu21 E1 / E2"):
        orthotropic("odd", E=E, nu=(0.27, 0.27, 1.2), G=G, rho=RHO)


# ---- text forms ---------------------------------------------------------------------------------------------------

TEXT = "E1=147e9,E2=10.3e9,E3=10.3e9,nu12=0.27,nu13=0.27,nu23=0.54,G12=7e9,G13=7e9,G23=3.7e9,rho=1600,name=ply"


def test_orthotropic_constants_as_text_and_as_a_file(tmp_path):
    assert parse_material(TEXT) == PLY
    file = tmp_path / "ply.toml"
    entries = TEXT.replace("name=ply", 'name="ply"').replace(",", "\n")
    file.write_text(f"{entries}\naxes = [[0, 1, 0], [1, 0, 0]]\n", encoding="utf-8")
    assert parse_material(str(file)) == replace(PLY, axes=((0, 1, 0), (1, 0, 0)))


def test_a_matrix_from_a_file(tmp_path):
    file = tmp_path / "iso.toml"
    rows = six_by_six(*LAME).tolist()
    file.write_text(f'name = "iso"\nrho = 7850\nelasticity = {rows}\n', encoding="utf-8")
    assert parse_material(str(file)) == AnisotropicMaterial("iso", rows, 7850.0)
    file.write_text('E = 2e11\nnu = 0.3\nrho = 7850\nname = "s"', encoding="utf-8")
    assert parse_material(str(file)) == Material("s", 2e11, 0.3, 7850.0)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (None, "does not exist"),
        ("E1 = 1e9\nrho = 1000", "'E2' missing"),
        ("elasticity = [[1]]\nrho = 1000\nE = 1", "unknown 'E'"),
        ("E = [1]\nnu = 0.3\nrho = 1000", "cannot be read"),
    ],
)
def test_a_material_file_that_cannot_be_used_is_named(tmp_path, content, words):
    file = tmp_path / "bad.toml"
    if content is not None:
        file.write_text(content, encoding="utf-8")
    with pytest.raises(InputError, match=rf"bad\.toml.*{words}"):
        parse_material(str(file))


def test_the_command_line_takes_constants_alone_and_by_volume():
    assert material_of([TEXT]) == PLY
    assert material_of(["core=steel", f"skin={TEXT}"]) == {"core": parse_material("steel"), "skin": PLY}


def test_the_examples_of_the_documentation(tmp_path):
    page = (ROOT / "docs" / "materials.md").read_text(encoding="utf-8")
    space: dict = {}
    exec(compile(page.split("```python\n")[1].split("```")[0], "materials.md", "exec"), space)
    (tmp_path / "ply.toml").write_text(page.split("```toml\n")[1].split("```")[0], encoding="utf-8")
    assert space["same"] == space["ply"] == parse_material(str(tmp_path / "ply.toml"))
