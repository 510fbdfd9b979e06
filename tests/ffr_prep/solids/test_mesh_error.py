"""The error that a mesh leaves in frequencies: exact fields, independence of the frame, and the truth by finer meshes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from boxes import KINDS, STEEL, box_mesh, moved, rotation
from matrix_models import of_frame
from test_structural import straight

import ffr_prep as fp
from ffr_prep.body import mesh_doubt, mesh_errors_of
from ffr_prep.mesh.mesh import Mesh
from ffr_prep.report.text import body_lines, short_lines
from ffr_prep.solids.assembly import assemble
from ffr_prep.solids.mesh_error import added_energy
from ffr_prep.structures.sections import rectangle

ROD = (0.2, 0.01, 0.012)
ROOT = (fp.InterfaceRegion("left"),)
COARSE, FINE = (10, 1, 1), (16, 2, 2)


def reduced(mesh: Mesh, modes: int = 8) -> fp.FlexibleBody:
    request = fp.Request(name="rod", reference=fp.FixedTo("left"), reduction=fp.Eigenmodes(modes))
    return fp.reduce(fp.from_mesh(mesh, STEEL, ROOT), request)


def told(body: fp.FlexibleBody) -> np.ndarray:
    return np.array(list(mesh_errors_of(body.provenance).values()))


@pytest.fixture(scope="module")
def exact() -> np.ndarray:
    """Frequencies [Hz] of the rod with many elements of second order."""
    return reduced(box_mesh("hex27", ROD, (36, 3, 3))).frequencies


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "wedge6"])  # whose planes of bending change places
@pytest.mark.parametrize("cells", [COARSE, FINE])
def test_told_is_the_truth_within_a_small_factor(kind, cells, exact):
    body = reduced(box_mesh(kind, ROD, cells))
    true = body.frequencies[[0, 1, 3]] / exact[[0, 1, 3]] - 1  # bending, first of each plane and a second one
    assert (told(body)[:3] > 0.3 * true).all()
    assert (told(body)[:3] < 1.5 * true).all()


@pytest.mark.parametrize("kind", ["hex8", "hex20", "hex27"])
def test_a_prism_of_one_element_across_is_known_to_be_too_stiff_in_torsion(kind):
    mesh = box_mesh(kind, (0.2, 0.01, 0.01), COARSE)
    arm = mesh.points - [0.0, 0.005, 0.005]
    twist = np.cross([1.0, 0.0, 0.0], arm) * arm[:, :1]  # the section stays plane, which a square one does not
    found = np.einsum("i,i->", twist.ravel(), assemble(mesh, STEEL).K @ twist.ravel())
    share = added_energy(mesh, STEEL, ["left", "right"], twist[:, :, None])[0] / found
    true = 1 - 0.1406 / (1 / 6)  # torsion constant over second polar moment, in b^4: Saint-Venant
    assert 0.3 * true < share < 6 * true


@pytest.mark.parametrize("kind", KINDS)
def test_a_stress_that_the_elements_hold_exactly_has_no_error(kind):
    mesh = box_mesh(kind, ROD, (4, 2, 2))
    tension = mesh.points * [1.0, -STEEL.nu, -STEEL.nu] * 1e-3
    free, held = (added_energy(mesh, STEEL, loaded, tension[:, :, None])[0] for loaded in (["left", "right"], []))
    volume = np.prod(ROD)
    assert free < 1e-20 * STEEL.E * volume  # twice the strain energy is 1e-6 E V
    assert held > 1e-8 * STEEL.E * volume  # nothing pulls at its ends


@pytest.mark.parametrize("kind", KINDS)
def test_shear_of_free_sides_is_an_error(kind):
    mesh = box_mesh(kind, ROD, (4, 2, 2))
    shear = np.zeros_like(mesh.points)
    shear[:, 0] = 1e-3 * mesh.points[:, 1]
    every = ["left", "right", "front", "back", "bottom", "top"]
    G = STEEL.E / (2 * (1 + STEEL.nu))
    assert added_energy(mesh, STEEL, every, shear[:, :, None])[0] < 1e-20 * G
    assert added_energy(mesh, STEEL, [], shear[:, :, None])[0] > 0.1 * 1e-6 * G * np.prod(ROD)


def test_bending_is_exact_where_elements_of_second_order_are_of_the_whole_thickness():
    mesh = box_mesh("hex27", ROD, (4, 1, 1))
    x, y, z = (mesh.points - [0.0, 0.005, 0.006]).T
    nu = STEEL.nu
    u = 1e-3 * np.stack([-x * z, nu * y * z, (x**2 + nu * (z**2 - y**2)) / 2], axis=1)
    assert added_energy(mesh, STEEL, ["left", "right"], u[:, :, None])[0] < 1e-18 * STEEL.E * np.prod(ROD)


@pytest.mark.parametrize("kind", ["tet10", "hex8"])
def test_no_frame_is_preferred(kind):
    mesh = box_mesh(kind, ROD, COARSE)
    turned = moved(mesh, rotation(3), np.array([1.0, -2.0, 0.5]))
    assert told(reduced(turned)) == pytest.approx(told(reduced(mesh)), rel=1e-6)


def test_halves_of_one_material_under_two_names_are_one_body():
    mesh = box_mesh("tet10", ROD, COARSE)
    middle = mesh.points[mesh.blocks[0].nodes].mean(axis=1)[:, 0] < ROD[0] / 2
    halves = replace(mesh, volume_groups={"one": np.flatnonzero(middle), "other": np.flatnonzero(~middle)})
    field = mesh.points[:, :, None] ** 2
    whole, parts = (
        added_energy(mesh, STEEL, ["left"], field),
        added_energy(halves, {"one": STEEL, "other": replace(STEEL, name="again")}, ["left"], field),
    )
    assert parts == pytest.approx(whole, rel=1e-12)


def test_a_soft_half_does_not_hide_in_the_stress_of_a_stiff_one():
    mesh = box_mesh("tet10", ROD, FINE)
    middle = mesh.points[mesh.blocks[0].nodes].mean(axis=1)[:, 1] < ROD[1] / 2
    halves = replace(mesh, volume_groups={"one": np.flatnonzero(middle), "other": np.flatnonzero(~middle)})
    x, y, z = mesh.points.T
    stretch = 1e-3 * np.stack([x, 0 * y, 0 * z], axis=1)  # without Poisson's ratio: exact in both, whatever they are
    materials = {name: fp.Material(name=name, E=E, nu=0.0, rho=1e3) for name, E in (("one", 1e9), ("other", 1e11))}
    assert added_energy(halves, materials, ["left", "right"], stretch[:, :, None])[0] < 1e-14


def test_a_body_tells_it_and_a_coarse_one_warns():
    coarse, fine = reduced(box_mesh("hex8", ROD, COARSE)), reduced(box_mesh("hex27", ROD, FINE))
    assert "% too high" in mesh_doubt(coarse.provenance)
    assert "--order 2" in mesh_doubt(coarse.provenance)
    assert "triangles" not in mesh_doubt(coarse.provenance)
    assert mesh_doubt(coarse.provenance) in coarse.provenance["warnings"]
    assert mesh_doubt(fine.provenance) is None
    assert not fine.provenance["warnings"]
    for body in (coarse, fine):
        for lines in (body_lines, short_lines):
            assert any(line.startswith("mesh error  frequencies too high by about ") for line in lines(body))


def test_tied_solids_add_their_energies():
    first, second = (box_mesh("hex8", ROD, COARSE, origin=(x, 0.0, 0.0)) for x in (0.0, 0.2))
    ends = (fp.InterfaceRegion("left"), fp.InterfaceRegion("right"))
    tied = fp.tied(
        {"a": fp.from_mesh(first, STEEL, ends), "b": fp.from_mesh(second, STEEL, ends)}, [("a.right", "b.left")]
    )
    request = fp.Request(name="rod", reference=fp.FixedTo("left"), reduction=fp.Eigenmodes(4))
    body = fp.reduce(tied, replace(request, reference=fp.MeanAxis()))
    assert told(body)[0] == pytest.approx(0.6, rel=0.3)


def test_matrices_know_nothing_of_elements():
    request = fp.Request(name="b", reference=fp.MeanAxis(), reduction=fp.Eigenmodes(2))
    body = fp.reduce(fp.from_matrices(of_frame(straight(rectangle(0.01, 0.02), 1.0, 4))), request)
    assert mesh_errors_of(body.provenance) == {}
    assert not any(line.startswith("mesh error") for line in body_lines(body))


def test_a_converted_body_says_of_which_modes_it_tells():
    """In its mean-axis frame the modes are others: of a free rod the first is as wrong as the third of a clamped one."""
    body = reduced(box_mesh("hex8", ROD, COARSE), 6)
    free = fp.with_reference(body, fp.MeanAxis())
    kept = fp.truncated(free, 3)
    for converted in (free, kept):
        assert converted.frequencies[0] > 2 * body.frequencies[0]
        assert mesh_errors_of(converted.provenance) == mesh_errors_of(body.provenance)
        (line,) = [line for line in body_lines(converted) if line.startswith("mesh error")]
        assert line.endswith("in brackets the mode under the reference conditions of its reduction")
        (warning,) = [one for one in converted.provenance["warnings"] if "its mesh is too coarse" in one]
        assert warning == mesh_doubt(converted.provenance)
        assert "the lowest frequency, under the reference conditions of its reduction, is about" in warning
