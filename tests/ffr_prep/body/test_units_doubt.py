"""Numbers that are off by a factor of a thousand are noticed, from commands and from Python, and sound ones are not."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest
from boxes import STEEL, box_mesh
from places import REFERENCE

import ffr_dyn as fd
import ffr_prep as fp
from ffr_prep.common.errors import InputError
from ffr_prep.model.material import Material, material_doubts

PLATE = REFERENCE / "plate.step"


def body(material=STEEL, size=(0.3, 0.02, 0.02)):
    model = fp.from_mesh(box_mesh("hex8", size, (6, 1, 1)), material, [fp.InterfaceRegion("left")])
    return fp.reduce(model, fp.Request(name="bar", reference=fp.FixedTo("left"), reduction=fp.Eigenmodes(1)))


@pytest.mark.parametrize(
    ("E", "rho"),
    [(2.1e11, 7850.0), (7e10, 2700.0), (1.05e12, 3500.0), (1.6e10, 11340.0), (1e6, 1100.0), (1e4, 1000.0), (6e6, 12.0)],
    ids=["steel", "aluminium", "diamond", "lead", "rubber", "gel", "foam"],
)
def test_materials_that_there_are_raise_no_doubt(E, rho):
    assert material_doubts(Material("m", E, 0.3, rho)) == []


@pytest.mark.parametrize(
    ("E", "rho", "doubt"),
    [
        (2.1e11, 7.85, r"in g/cm\^3"),
        (2.1e5, 7850.0, r"sqrt\(E/rho\) is 5.2 m/s"),
        (210.0, 7850.0, r"sqrt\(E/rho\)"),
        (2.1e14, 7850.0, r"sqrt\(E/rho\)"),
        (2.1e11, 7.85e6, "more than that of any solid"),
    ],
)
def test_a_material_in_other_units_is_a_warning_of_its_body(E, rho, doubt):
    assert re.search(doubt, " ".join(body(Material("m", E, 0.3, rho)).provenance["warnings"]))


def test_a_sound_body_raises_no_doubt():
    assert fp.units_doubts(body()) == []
    assert fp.units_doubts(fp.rigid_part(PLATE, 2700.0, [fp.InterfaceRegion("pin", "nearest 45,25,5")])) == []
    thin = fp.rigid_body("pin", mass=0.1, inertia=(1e-5, 1e-5, 1e-5), points={"a": (0, 0, 0), "b": (0.01, 0, 0)})
    assert fp.units_doubts(thin) == []


@pytest.mark.parametrize(("length", "heavy"), [(1.0, False), (1e-2, True), (1e-3, True)])
def test_a_flexible_body_without_a_shape_is_no_heavier_than_a_solid(length, heavy):
    """As one of another program in units that are not its own. No solid has more volume for its radius of gyration than a
    ball, whose second moment is 3/5 of m R^2; rigid bodies are often points of mass."""
    bar = body()
    small = replace(bar, surface=None, r_dm=length * bar.r_dm, rr_dm=length**2 * bar.rr_dm)
    assert ["heavier than any solid" in doubt for doubt in fp.units_doubts(small)] == [True] * heavy
    rigid = fp.truncated(small, 0)
    assert fp.units_doubts(rigid) == []


def test_a_point_far_from_its_place_is_told():
    """On the surface between its nodes is near enough; beside the body and inside is not, in whole and in parts."""
    ends = [fp.InterfaceRegion("left"), fp.InterfaceRegion("right")]
    model = fp.from_mesh(box_mesh("hex8", (0.3, 0.02, 0.02), (6, 1, 1)), STEEL, ends)
    bar = fp.reduce(model, fp.Request(name="bar", reference=fp.MeanAxis(), reduction=fp.Guyan(), parts=2))
    for near in ((0.17, 0.02, 0.0), (0.15, 0.01, 0.0), (0.15, 0.019, 0.02)):
        assert fp.units_doubts(fp.with_point(bar, "p", near)) == []
    assert "0.0141 m away: is that meant?" in fp.units_doubts(fp.with_point(bar, "p", (0.15, 0.01, 0.01)))[0]
    far = fp.with_point(fp.with_point(bar, "p", (0.2, 0.1, 0.0)), "q", (0.2, 0.0, 0.0))
    assert fp.units_doubts(far) == [
        "its point 'p' was asked for at (0.2, 0.1, 0) m and is where the surface is nearest, at (0.2, 0.02, 0) m, 0.08 m "
        "away: is that meant? Within a body, as on the axis of a beam, interfaces of its reduction can be"
    ]
    assert [len(fp.units_doubts(part)) for part in far.parts] == [0, 1]
    assert fp.units_doubts(fp.with_reference(far, fp.FixedTo("left"))) == fp.units_doubts(far)


def test_a_body_of_millimetres_read_in_metres_is_told():
    assert "are its lengths millimetres" in fp.units_doubts(body(size=(300.0, 20.0, 20.0)))[0]


@pytest.mark.parametrize(("factor", "doubt"), [(1e6, "heavier than any solid"), (1e-9, "lighter than any solid")])
def test_a_mass_that_its_size_cannot_have_is_told(factor, doubt):
    sound = fp.rigid_part(PLATE, 2700.0)
    off = replace(sound, mass=factor * sound.mass, r_dm=factor * sound.r_dm, rr_dm=factor * sound.rr_dm)
    assert doubt in fp.units_doubts(off)[0]


def test_a_rigid_part_tells_of_its_density_and_of_points_in_millimetres():
    far = fp.rigid_part(PLATE, 7.85, [fp.InterfaceRegion("pin", point=(45.0, 25.0, 5.0))])
    assert ["in g/cm^3" in far.provenance["notes"][0], "'pin' is" in far.provenance["notes"][1]] == [True, True]
    with pytest.raises(InputError, match="less than any solid's, as in tonnes and millimetres"):
        fp.rigid_part(PLATE, 7.85e-9)


def test_a_scene_tells_of_inertia_in_kg_mm2_and_of_gravity_in_mm_s2():
    arm = fd.rigid_body("arm", mass=1.0, inertia=(3300.0, 3300.0, 3300.0), points={"a": (0, 0, 0), "b": (0.2, 0, 0)})
    hinge = fd.Joint("hinge", "revolute", "ground.O", "arm.a")
    scene = fd.Scene([fd.Body("arm", arm)], [hinge], ground={"O": (0, 0, 0)}, gravity=(0, -9810.0, 0))
    notes = " ".join(fd.mobility(scene).doubts)
    assert "is the inertia in kg mm^2" in notes
    assert "gravity is 9810 m/s^2: is it in mm/s^2?" in notes
    assert "inertia in kg mm^2" in " ".join(fd.forward(scene, end=0.01, output_step=0.01).attributes["notes"])


@pytest.mark.parametrize("eccentricity", [2e-5, 2e-4])
def test_a_rotor_whose_points_are_all_at_its_axis_is_not_doubted(eccentricity):
    """Between its unbalance and its radius lie more than three powers of ten."""
    at = {"centre_of_mass": (eccentricity, 0, 0), "points": {"c": (0, 0, 0)}}
    assert not fp.units_doubts(fd.rigid_body("disc", mass=2.0, inertia=(0.01, 0.01, 0.02), **at))
    assert fp.units_doubts(fd.rigid_body("disc", mass=2.0, inertia=(1e4, 1e4, 2e4), **at))


@pytest.mark.parametrize("section", [fp.circle(0.04), fp.rectangle(0.04, 0.04), fp.box(0.04, 0.06, 0.003)])
def test_a_point_on_the_axis_of_a_beam_is_told(section):
    """Its nodes are those of the outline, 20 mm and more from the axis, where a load would twist the beam: at the end as
    elsewhere. At a node of the outline nothing is told."""
    line = fp.polyline([(0, 0, 0), (2, 0, 0)], fp.Member(section, STEEL, (0, 1, 0)), elements=8)
    model = fp.from_frame(fp.named(line, a=(0, 0, 0)), [fp.InterfaceRegion("a")])
    rod = fp.reduce(model, fp.Request(name="rod", reference=fp.FixedTo("a"), reduction=fp.Eigenmodes(4)))
    assert fp.units_doubts(fp.with_point(rod, "p", rod.surface.points[30])) == []
    for x in (0.9, 1.0, 2.0):
        assert f"'p' was asked for at ({x:g}, 0, 0) m" in fp.units_doubts(fp.with_point(rod, "p", (x, 0.0, 0.0)))[0]


@pytest.mark.parametrize(
    ("damping", "told"),
    [
        (fp.Damping(ratios=[2.0]), ", so that none vibrates"),  # of 2 per cent
        (fp.Damping(ratios=[0.5]), "of its critical damping or more: are ratios in per cent"),
        (fp.Damping(loss_factor=2.0), "its damping damps every mode by 1 of its critical damping"),
        (fp.Damping(ratios=[0.05, 2.0]), None),
        (fp.Damping(alpha=2.0, beta=1e-6), None),
    ],
)
def test_damping_in_per_cent_is_told(damping, told):
    request = fp.Request(name="bar", reference=fp.FixedTo("left"), reduction=fp.Eigenmodes(3), damping=damping)
    model = fp.from_mesh(box_mesh("hex8", (0.3, 0.02, 0.02), (6, 1, 1)), STEEL, [fp.InterfaceRegion("left")])
    said = [warning for warning in fp.reduce(model, request).provenance["warnings"] if "critical damping" in warning]
    assert [told in one for one in said] == ([] if told is None else [True])


@pytest.mark.parametrize(("ratio", "told"), [(1.0, True), (0.01, False)])
def test_a_scene_tells_of_damping_in_per_cent(ratio, told):
    bar = body()
    clamp = fd.Joint("clamp", "fixed", "ground.wall", "bar.left")
    scene = fd.Scene([fd.Body("bar", bar, damping=ratio)], [clamp], ground={"wall": bar.interfaces[0].position})
    notes = fd.assembly(scene).attributes["notes"]
    assert any("body 'bar': its damping damps every mode by 1 of" in note for note in notes) is told
