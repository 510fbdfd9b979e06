"""Frames read from the curves of a geometry, and every guard on the way."""

from __future__ import annotations

import numpy as np
import pytest
from places import MESHES

import ffr_prep as fp
from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.material import material
from ffr_prep.model.reference import FixedTo
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.structures.frame import Member, Shell, check_frame, joined, polyline
from ffr_prep.structures.frame_geometry import read_frame
from ffr_prep.structures.sections import i_section, rectangle, tube

PORTAL = MESHES / "portal.geo"
STEEL = material("steel")
PROFILE = i_section(0.2, 0.1, 0.006, 0.009)
MEMBERS = {
    "columns": Member(PROFILE, STEEL, (1.0, 0, 0)),
    "beam": Member(PROFILE, STEEL, (0, 1.0, 0)),
    "brace": Member(tube(0.05, 0.004), STEEL),
}
FEET = [InterfaceRegion("left_foot"), InterfaceRegion("right_foot")]


def reduced(frame):
    return fp.reduce(
        fp.from_frame(frame, FEET), fp.Request(name="p", reference=FixedTo("left_foot"), reduction=CraigBampton(4))
    )


@pytest.mark.slow
def test_portal_from_a_file_is_the_portal_of_a_few_lines():
    columns = [polyline([(x, 0, 0), (x, 2, 0)], MEMBERS["columns"], elements=4) for x in (0, 3)]
    beam = polyline([(0, 2, 0), (1.5, 2, 0), (3, 2, 0)], MEMBERS["beam"], elements=3)
    brace = polyline([(0, 0, 0), (1.5, 2, 0)], MEMBERS["brace"], elements=5)
    built = joined(*columns, beam, brace)
    read = read_frame(PORTAL, MEMBERS)
    check_frame(read)
    np.testing.assert_array_equal(np.sort(read.points @ (1, 10, 100)), np.sort(built.points @ (1, 10, 100)).round(11))
    built = type(built)(**{**vars(built), "node_groups": {"left_foot": [0], "right_foot": [5]}})
    one, other = reduced(read), reduced(built)
    np.testing.assert_allclose(one.omega2, other.omega2, rtol=1e-8)
    np.testing.assert_allclose(one.rr_dm, other.rr_dm, rtol=1e-11, atol=1e-10)


def test_groups_of_curves_are_groups_of_nodes():
    frame = read_frame(PORTAL, MEMBERS)
    np.testing.assert_array_equal(frame.points[frame.node_groups["load"]], [(1.5, 2, 0)])
    assert np.ptp(frame.points[frame.node_groups["beam"], 1]) == 0
    assert len(frame.node_groups["brace"]) == 6


def test_size_numbers_and_unit():
    fine = read_frame(PORTAL, MEMBERS, size=0.1)
    assert len(fine.elements) == 20 + 20 + 15 + 15 + 25
    high = read_frame(PORTAL, MEMBERS, numbers={"height": 4.0}, unit="mm")
    assert high.points[:, 1].max() == pytest.approx(4e-3)


def test_curves_without_groups_have_the_names_of_their_numbers(tmp_path):
    path = tmp_path / "bare.geo"
    path.write_text("Point(1) = {0, 0, 0, 1};\nPoint(2) = {1, 0, 0, 1};\nLine(7) = {1, 2};\n")
    stages: list[str] = []
    frame = read_frame(path, {"curve_7": MEMBERS["beam"]}, progress=stages.append)
    assert len(frame.elements) == 1
    assert stages == ["read the frame"]


def test_a_meshed_file_of_second_order_lines_keeps_their_ends(tmp_path):
    path = tmp_path / "line.msh"
    path.write_text(
        '$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n1 1 "rod"\n$EndPhysicalNames\n$Nodes\n3\n'
        "1 0 0 0\n2 2 0 0\n3 1 0 0\n$EndNodes\n$Elements\n1\n1 8 2 1 1 1 2 3\n$EndElements\n"
    )
    frame = read_frame(path, {"rod": MEMBERS["brace"]})
    np.testing.assert_array_equal(frame.points[frame.elements[0]], [(0, 0, 0), (2, 0, 0)])
    assert len(frame.points) == 2


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({**MEMBERS, "bracket": MEMBERS["brace"]}, "no group of curves 'bracket'; did you mean 'brace'"),
        ({"columns": MEMBERS["columns"], "beam": MEMBERS["beam"]}, "group of curves 'brace' has no member"),
    ],
)
def test_members_that_do_not_fit(given, says):
    with pytest.raises(InputError, match=says):
        read_frame(PORTAL, given)


def test_files_that_hold_no_frame(tmp_path):
    with pytest.raises(InputError, match="does not exist"):
        read_frame(tmp_path / "none.geo", MEMBERS)
    text = tmp_path / "frame.inp"
    text.write_text("*HEADING\n")
    with pytest.raises(InputError, match="frames are read from"):
        read_frame(text, MEMBERS)
    empty = tmp_path / "empty.geo"
    empty.write_text("Point(1) = {0, 0, 0, 1};\n")
    with pytest.raises(ComputationError, match="no curves: draw the axes"):
        read_frame(empty, MEMBERS)
    meshed = tmp_path / "point.msh"
    meshed.write_text(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n1\n1 0 0 0\n$EndNodes\n$Elements\n1\n1 15 2 1 1 1\n$EndElements\n"
    )
    with pytest.raises(InputError, match="no curves with line elements"):
        read_frame(meshed, MEMBERS)


def test_a_missing_orientation_is_found():
    with pytest.raises(InputError, match="not round, and no orientation"):
        reduced(read_frame(PORTAL, {**MEMBERS, "brace": Member(rectangle(0.01, 0.02), STEEL)}))


# ---- surfaces -----------------------------------------------------------------------------------------------------------

TRAY = PORTAL.with_name("tray.geo")
SHELLS = {"floor": Shell(0.002, STEEL), "walls": Shell(0.003, STEEL)}
RIMS = {"rims": Member(tube(0.02, 0.002), STEEL)}


@pytest.mark.slow
def test_tray_of_sheet_with_beams_along_its_rims():
    """Triangles, quadrilaterals and lines of one mesh share their nodes; mass and centre in closed form."""
    frame = read_frame(TRAY, RIMS, shells=SHELLS)
    check_frame(frame)
    assert len(frame.triangles) > 100
    assert len(frame.quadrilaterals) == 2 * 12 * 2
    assert len(frame.elements) == 2 * 12
    body = fp.reduce(
        fp.from_frame(frame, [InterfaceRegion("front"), InterfaceRegion("rear", kind="mean")]),
        fp.Request(name="tray", reference=FixedTo("front"), reduction=CraigBampton(4)),
    )
    floor, walls = 7850 * 0.6 * 0.3 * 0.002, 7850 * 2 * 0.6 * 0.1 * 0.003
    rims = 7850 * 2 * 0.6 * RIMS["rims"].section.A
    assert body.mass == pytest.approx(floor + walls + rims, rel=1e-12)
    height = (0.05 * walls + 0.1 * rims) / body.mass
    np.testing.assert_allclose(body.centre_of_mass, (0.3, 0.15, height), rtol=1e-12)
    assert [i.kind for i in body.interfaces] == ["rigid", "mean"]
    assert np.ptp(frame.points[frame.node_groups["floor"], 2]) == 0


def test_surfaces_alone_and_their_parameters():
    frame = read_frame(TRAY, shells=SHELLS, size=0.1, numbers={"h": 1.0}, unit="cm")
    assert not len(frame.elements)
    assert np.ptp(frame.points[:, 0]) == pytest.approx(0.006)


@pytest.mark.parametrize(
    ("members", "shells", "says"),
    [
        ({}, {"floor": SHELLS["floor"]}, "group of surfaces 'walls' has no shell"),
        ({}, {**SHELLS, "wall": SHELLS["walls"]}, "no group of surfaces 'wall'; did you mean 'walls'"),
        ({"rim": RIMS["rims"]}, SHELLS, "no group of curves 'rim'; did you mean 'rims'"),
    ],
)
def test_shells_that_do_not_fit(members, shells, says):
    with pytest.raises(InputError, match=says):
        read_frame(TRAY, members, shells=shells)


def test_a_group_of_a_part_needs_no_shell_or_member_of_its_own(tmp_path):
    """Groups for interfaces: half of a sheet, and half of the rib along it."""
    (tmp_path / "sheet.geo").write_text(
        "Point(1)={0,0,0};Point(2)={1,0,0};Point(3)={2,0,0};Point(4)={2,1,0};Point(5)={1,1,0};Point(6)={0,1,0};\n"
        "Line(1)={1,2};Line(2)={2,3};Line(3)={3,4};Line(4)={4,5};Line(5)={5,6};Line(6)={6,1};Line(7)={2,5};\n"
        "Curve Loop(1)={1,7,5,6};Curve Loop(2)={2,3,4,-7};Plane Surface(1)={1};Plane Surface(2)={2};\n"
        'Physical Surface("sheet")={1,2};Physical Surface("pad")={2};\n'
        'Physical Curve("rib")={1,2};Physical Curve("end")={2};\n'
    )
    frame = read_frame(tmp_path / "sheet.geo", {"rib": RIMS["rims"]}, shells={"sheet": SHELLS["floor"]}, size=0.5)
    check_frame(frame)
    for name in ("pad", "end"):
        assert frame.points[frame.node_groups[name], 0].min() == 1
    assert len(frame.elements) == len(np.unique(np.sort(frame.elements), axis=0))
    with pytest.raises(InputError, match="group of surfaces 'sheet' has no shell"):
        read_frame(tmp_path / "sheet.geo", shells={"pad": SHELLS["floor"]}, size=0.5)


def test_curves_alone_hold_no_shells(tmp_path):
    with pytest.raises(ComputationError, match="no surfaces: draw the plates"):
        read_frame(PORTAL, shells=SHELLS)
    meshed = tmp_path / "line.msh"
    meshed.write_text(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n2\n1 0 0 0\n2 1 0 0\n$EndNodes\n"
        "$Elements\n1\n1 1 2 1 1 1 2\n$EndElements\n"
    )
    with pytest.raises(InputError, match="no surfaces with elements"):
        read_frame(meshed, shells=SHELLS)
