"""Rigid bodies of parts: the laws of mass, exact numbers, the places of interfaces, scenes that take them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from parts import plate, stack, written
from places import MESHES

import ffr_dyn as fd
import ffr_prep as fp
from ffr_prep.common.errors import InputError

RHO = 7850.0


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rigid")

    def turned(occ):
        plate(occ)
        occ.rotate(occ.getEntities(3), 0, 0, 0, 1, 2, 3, 0.7)
        occ.translate(occ.getEntities(3), 40, -10, 5)

    return {
        "plate": written(plate, folder / "plate.step"),
        "turned": written(turned, folder / "turned.step"),
        "mesh": written(plate, folder / "plate.msh", mesh=6.0),
        "stack": written(stack, folder / "stack.step"),
    }


@pytest.mark.slow
def test_a_plate_with_bores_has_the_mass_properties_of_its_formula(files):
    body = fp.rigid_part(files["plate"], RHO)
    a, b, t, r = 0.12, 0.08, 0.01, 0.006
    block, hole = a * b * t, math.pi * r**2 * t
    assert body.mass == pytest.approx(RHO * (block - 4 * hole), rel=1e-12)
    about_z = block * (a**2 + b**2) / 12 - 4 * hole * (r**2 / 2 + 0.045**2 + 0.025**2)
    about_x = block * (b**2 + t**2) / 12 - 4 * hole * (r**2 / 4 + t**2 / 12 + 0.025**2)
    np.testing.assert_allclose(body.central_inertia[[0, 2], [0, 2]], [RHO * about_x, RHO * about_z], rtol=1e-9)
    np.testing.assert_allclose(body.centre_of_mass, 0.0, atol=1e-12)


def test_a_turned_part_has_turned_properties(files):
    """Invariants of the inertia stay, its centre moves along."""
    here, there = fp.rigid_part(files["plate"], RHO), fp.rigid_part(files["turned"], RHO)
    assert there.mass == pytest.approx(here.mass, rel=1e-12)
    np.testing.assert_allclose(
        np.linalg.eigvalsh(there.central_inertia), np.linalg.eigvalsh(here.central_inertia), rtol=1e-9
    )
    np.testing.assert_allclose(there.centre_of_mass, [0.04, -0.01, 0.005], atol=1e-12)


@pytest.mark.slow
def test_elements_and_geometry_agree(files):
    exact, meshed = fp.rigid_part(files["plate"], RHO), fp.rigid_part(files["mesh"], RHO, unit="mm")
    assert meshed.mass == pytest.approx(exact.mass, rel=2e-3)
    np.testing.assert_allclose(meshed.central_inertia, exact.central_inertia, rtol=5e-3, atol=1e-9)
    box = fp.rigid_part(MESHES / "box.geo", 1000.0)
    lengths = np.ptp(box.surface.points, axis=0)
    assert box.mass == pytest.approx(1000.0 * lengths.prod(), rel=1e-12)


def test_solids_move_as_one(files):
    both = fp.rigid_part(files["stack"], RHO)
    one, other = (fp.rigid_part(files["stack"], RHO, solids=[f"volume_{k}"]) for k in (1, 2))
    assert both.mass == pytest.approx(one.mass + other.mass, rel=1e-12)
    np.testing.assert_allclose(both.inertia, one.inertia + other.inertia, rtol=1e-9, atol=1e-12)


def test_interfaces_are_where_their_faces_are(files, tmp_path):
    asked = [
        fp.InterfaceRegion("pin", "cylinder r=6mm at 45,25,0"),
        fp.InterfaceRegion("top", "plane z=5"),
        fp.InterfaceRegion("hook", point=(0.0, 0.01, 0.02)),
    ]
    body = fp.rigid_part(files["plate"], RHO, asked)
    places = {interface.name: interface.position for interface in body.interfaces}
    np.testing.assert_allclose(places["pin"], [0.045, 0.025, 0.0], atol=1e-9)
    np.testing.assert_allclose(places["top"], [0.0, 0.0, 0.005], atol=1e-9)
    assert places["hook"].tolist() == [0.0, 0.01, 0.02]
    fp.save_body(body, tmp_path / "plate.ffr")
    loaded = fp.load_body(tmp_path / "plate.ffr")
    assert loaded.provenance["interfaces"][0]["region"] == "cylinder r=6mm at 45,25,0"
    assert len(loaded.surface.triangles) > 100


def test_an_interface_at_a_set_of_nodes_is_in_their_middle(tmp_path):
    """As a mesh of Abaqus names them; `reduce` takes the same."""
    nodes = [(0, 0, 0), (1, 0, 0), (1, 2, 0), (0, 2, 0), (0, 0, 3), (1, 0, 3), (1, 2, 3), (0, 2, 3)]
    lines = [f"{k}, {x}, {y}, {z}" for k, (x, y, z) in enumerate(nodes, 1)]
    text = [
        "*NODE",
        *lines,
        "*ELEMENT, TYPE=C3D8, ELSET=ALL",
        "1, 1, 2, 3, 4, 5, 6, 7, 8",
        "*NSET, NSET=L",
        "1, 4, 5, 8",
    ]
    (tmp_path / "block.inp").write_text("\n".join(text) + "\n")
    body = fp.rigid_part(tmp_path / "block.inp", 1000.0, [fp.InterfaceRegion("L")], unit="m")
    np.testing.assert_allclose(body.interfaces[0].position, (0, 1.0, 1.5), atol=1e-12)
    assert body.mass == pytest.approx(6000.0)


def test_a_rigid_part_swings_in_a_scene(files):
    """The period of small swings is 2 pi sqrt(J / (m g l))."""
    body = fp.rigid_part(files["plate"], RHO, [fp.InterfaceRegion("pin", "cylinder r=6mm at 45,25,0")])
    hinge = fd.Joint("hinge", "revolute", "ground.wall", "plate.pin")
    at = -body.interfaces[0].position
    scene = fd.Scene([fd.Body("plate", body, position=at)], [hinge], ground={"wall": (0, 0, 0)}, gravity=(0, -9.81, 0))
    found = fd.linearise(fd.scene_at(scene, fd.static(scene))).frequencies
    arm = float(np.hypot(0.045, 0.025))
    J = body.central_inertia[2, 2] + body.mass * arm**2
    frequency = math.sqrt(body.mass * 9.81 * arm / J) / (2 * math.pi)
    assert found[0] == pytest.approx(frequency, rel=1e-6)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"density": 0.0}, "density is 0"),
        ({"density": float("nan")}, "density is nan"),
        ({"interfaces": [fp.InterfaceRegion("pin", "bore r=6")]}, "interface 'pin': 'bore r=6' finds 4 bores"),
        ({"interfaces": [fp.InterfaceRegion("a", point=(0, 0, 0))] * 2}, "two interfaces have the same name"),
        ({"unit": "m"}, "declares that its numbers are mm"),
        ({"solids": ["nut"]}, "there is no solid 'nut'"),
    ],
)
def test_what_cannot_be_used(arguments, message, files):
    with pytest.raises(InputError, match=message):
        fp.rigid_part(files["plate"], **{"density": RHO, **arguments})


def boxes(occ, second):
    """Cubes of 10 mm, the second from a place along x."""
    occ.addBox(0, 0, 0, 10, 10, 10)
    occ.addBox(second, 0, 0, 10, 10, 10)


@pytest.mark.parametrize(("second", "volume"), [(8.0, "200 mm^3"), (10.0, None), (30.0, None)])
def test_solids_that_overlap_are_told(second, volume, tmp_path):
    """What touches, or has only boxes in common, is not."""
    body = fp.rigid_part(written(lambda occ: boxes(occ, second), tmp_path / "two.step"), RHO)
    assert body.mass == pytest.approx(2 * RHO * 1e-6, rel=1e-9)
    notes = [note for note in body.provenance["notes"] if "overlap" in note]
    assert notes == [] if volume is None else f"'volume_1' and 'volume_2' overlap: {volume} count twice" in notes[0]


def test_volumes_in_no_group_are_left_out_as_in_a_mesh(tmp_path):
    script = 'SetFactory("OpenCASCADE");\nBox(1) = {0, 0, 0, 1, 1, 1};\nBox(2) = {2, 0, 0, 1, 1, 1};\n'
    (tmp_path / "two.geo").write_text(script + 'Physical Volume("part") = {1};\n')
    body = fp.rigid_part(tmp_path / "two.geo", 1000.0)
    assert body.mass == pytest.approx(1000.0 * 1.0)
    assert any("in no physical group" in note for note in body.provenance["notes"])
    assert np.ptp(body.surface.points[:, 0]) == pytest.approx(1.0)
