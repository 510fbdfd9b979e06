"""Faces of geometries and meshes: what they are, and how they are found by what they are."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from parts import BORES, every_surface, fork, plate, stack, written
from places import MESHES, REFERENCE

import ffr_prep as fp
from ffr_prep.common.errors import InputError
from ffr_prep.mesh.geometry.face import Face
from ffr_prep.mesh.geometry.faces import feature_centre
from ffr_prep.mesh.geometry.fits import recognised
from ffr_prep.mesh.geometry.region_words import Names, Query, is_query, parsed
from ffr_prep.mesh.geometry.regions import found, query_for
from ffr_prep.mesh.geometry.skin import mesh_faces, with_regions
from ffr_prep.mesh.geometry.step_text import face_labels
from ffr_prep.mesh.mesh import check_mesh, read_mesh, region_nodes
from ffr_prep.report.faces import face_lines
from ffr_prep.structures.frame import group_nodes

PLATE = REFERENCE / "plate.step"  # four bores, by CadQuery
PINNED = REFERENCE / "pinned_plate.step"  # by OpenCASCADE: a plate with two bores, and in them the same pin twice


@pytest.fixture(scope="module")
def parts(tmp_path_factory):
    folder = tmp_path_factory.mktemp("parts")
    return {
        "plate": written(plate, folder / "plate.step"),
        "plate in IGES": written(plate, folder / "plate.igs"),
        "every surface": written(every_surface, folder / "every.step"),
        "fork": written(fork, folder / "fork.step"),
        "stack": written(stack, folder / "stack.step"),
        "mesh": written(plate, folder / "plate.msh", mesh=8.0),
        "bulk data": written(plate, folder / "plate.bdf", mesh=8.0),
    }


@cache
def faces_of(path):
    """The faces of a part of the fixture; meshes are in millimetres."""
    return fp.faces(path, unit="mm" if path.suffix in (".msh", ".bdf", ".geo") else None)


def of_kind(faces, kind):
    return [face for face in faces.faces if face.kind == kind]


# ---- what faces are -------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_surfaces_are_those_that_were_drawn(parts):
    faces = faces_of(parts["every surface"])
    (ball,), (cone,), (ring,), (bore,) = (of_kind(faces, kind) for kind in ("sphere", "cone", "torus", "cylinder"))
    np.testing.assert_allclose([ball.radius, *ball.point], [0.008, 0.06, 0.02, 0.015], atol=1e-12)
    assert cone.radius == pytest.approx(math.atan2(5, 10))
    np.testing.assert_allclose(cone.point, [0.045, 0.02, 0.046], atol=1e-12)
    np.testing.assert_allclose([ring.radius, ring.minor], [0.008, 0.002], atol=1e-12)
    assert bore.radius == pytest.approx(0.004)
    assert bore.area == pytest.approx(2 * math.pi * 0.004 * 0.030)
    np.testing.assert_allclose(bore.centre, [0.03, 0.01, 0.015], atol=1e-9)
    assert [face.hollow for face in (ball, cone, ring, bore)] == [False, False, True, True]
    np.testing.assert_array_equal(bore.axis, [0, 0, 1])


@pytest.mark.parametrize("part", ["plate", "every surface", "fork", "mesh"])
def test_triangles_point_outside(part, parts):
    """The volume that the triangles enclose is positive, and the normals of planes point away from the middle."""
    faces = faces_of(parts[part])
    corners = faces.points[np.concatenate(faces.triangles)]
    assert np.linalg.det(corners - faces.points.mean(axis=0)).sum() > 0
    if part == "plate":
        assert all(face.axis @ face.centre > 0 for face in of_kind(faces, "plane"))


@pytest.mark.parametrize("part", ["plate", "plate in IGES", "mesh", "bulk data"])
def test_a_bore_of_four_faces_is_one_feature(part, parts):
    faces = faces_of(parts[part])
    bores = [of for of in faces.features if faces.faces[of[0]].kind == "cylinder"]
    assert [len(of) for of in bores] == [4] * 4
    assert len(faces.features) == 10
    centres = sorted(tuple(np.round(feature_centre(faces, of)[0] * 1e3, 1)) for of in bores)
    assert [c[:2] for c in centres] == sorted(BORES)


def test_parts_of_other_programs_are_read():
    faces = fp.faces(PLATE)
    assert faces.unit == "mm"
    assert {face.colour for face in faces.faces} == {"#3366cc"}
    assert {face.solids for face in faces.faces} == {("plate",)}
    assert len(of_kind(faces, "cylinder")) == 8  # four bores, four rounded edges


def test_a_part_that_cannot_be_meshed_at_once_is_meshed_in_another_way():
    """The first algorithm leaves an element without volume in this plate."""
    mesh = read_mesh(PLATE)
    check_mesh(mesh)
    assert len(mesh.face_groups) == 14


@pytest.mark.parametrize(("size", "order"), [(8.0, 1), (8.0, 2), (4.0, 1)])
def test_what_is_recognised_on_a_skin_is_what_was_drawn(size, order, parts):
    mesh = read_mesh(parts["plate"], size=size, order=order)
    drawn, seen = mesh_faces(mesh), mesh_faces(replace(mesh, drawn=(), face_groups={}))
    assert len(seen.features) == len(drawn.features)
    for text in ("cylinder r=6mm at 45,25,0", "plane z=5", "plane x=-60", "nearest -45,25,0"):
        areas = [sum(faces.faces[k].area for k in found(faces, text)) for faces in (drawn, seen)]
        assert areas[1] == pytest.approx(areas[0], rel=0.05)


@pytest.mark.slow
def test_interfaces_in_bores_are_on_their_axes_and_half_way_through_whatever_the_mesh(parts):
    mesh = read_mesh(parts["plate"], size=8.0, order=2)
    for x in (0.045, -0.045):
        bore = fp.InterfaceRegion("bore", f"cylinder r=6mm at {1e3 * x:g},25,0")
        model = fp.from_mesh(mesh, fp.material("steel"), [bore])
        np.testing.assert_allclose(model.coupled.positions[0], (x, 0.025, 0.0), rtol=0, atol=1e-15)


def test_flat_parts_are_taken_out_of_what_is_smooth(tmp_path):
    """A box with rounded edges has no sharp one."""
    path = written(lambda occ: rounded_box(occ), tmp_path / "rounded.step")
    mesh = replace(read_mesh(path, size=4.0), drawn=(), face_groups={})
    faces = mesh_faces(mesh)
    for text in ("plane z=0", "plane z=20", "plane x=0", "plane y=30"):
        assert sum(faces.faces[k].area for k in found(faces, text)) > 0


def rounded_box(occ):
    occ.addBox(0, 0, 0, 40, 30, 20)
    occ.synchronize()
    edges = [tag for _, tag in occ.getEntities(1)]
    occ.fillet([1], edges[:4], [3.0])


# ---- what is found --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "part", ["plate", "plate in IGES", "every surface", "fork", "stack", "mesh", "bulk data", "rod"]
)
def test_what_to_type_for_a_feature_finds_it_and_nothing_else(part, parts):
    path = MESHES / "connecting_rod.geo" if part == "rod" else parts[part]
    faces = faces_of(path)
    for feature in faces.features:
        assert set(found(faces, query_for(faces, feature))) == set(feature)


FOUND = {
    "cylinder r=6mm at 45,25,0": 4,
    "cylinder r=0.6cm at 4.5cm,2.5cm,7": 4,
    "bore d=12 at 45,25,0 mm": 4,
    "all bore r=6": 16,
    "all cylinder axis=z": 16,
    "all cylinder axis=-z r=6": 16,
    "bore r=6 near 50,20,0": 4,
    "plane z=5": 1,
    "plane at 0,0,5 normal=z": 1,
    "plane normal=0,0,-2": 1,
    "all plane": 6,
    "nearest 45,25,0": 4,
    "nearest (10, 0, 5)": 1,
    "face near 0,100,0": 1,
    "surface_1+surface_2": 2,
    "surface_1 + plane z=5 + surface_1": 2,
    "surface_1..4": 4,
    "surface_?": 9,
    "surf*": 22,
    "plane z=5e+0": 1,
}


@pytest.mark.parametrize("region", FOUND)
def test_regions(region, parts):
    assert len(fp.found_faces(faces_of(parts["plate"]), region)) == FOUND[region]


@pytest.mark.parametrize("region", ["plane z=5", "cylinder r=6 at 45,25,0", "nearest 45,25,0", "all bore r=6mm"])
def test_a_query_means_the_same_when_the_body_is_elsewhere(region, parts, tmp_path):
    """Moved by (7, -3, 11) and asked for there."""

    def moved(occ):
        plate(occ)
        occ.translate(occ.getEntities(3), 7, -3, 11)

    there = region.replace("z=5", "z=16").replace("45,25,0", "52,22,11")
    faces = fp.faces(written(moved, tmp_path / "moved.step"))
    assert fp.found_faces(faces, there) == fp.found_faces(faces_of(parts["plate"]), region)


def test_pieces_of_one_cylinder_are_one_surface_and_near_takes_a_piece(parts):
    faces = faces_of(parts["fork"])
    both = found(faces, "bore r=5")
    assert len(both) == 2
    assert [len(found(faces, f"bore r=5 near 10,{y},10")) for y in (5, 25)] == [1, 1]
    assert {*found(faces, "bore r=5 near 10,5,10"), *found(faces, "bore r=5 near 10,25,10")} == set(both)


@pytest.mark.parametrize(
    ("region", "message"),
    [
        ("bore r=6", r"finds 4 bores; write 'all bore r=6'.*: cylinder r=6mm at -45,-25,0mm"),
        ("cylinder r=6 at 0,0,0", r"finds no face. Near are: cylinder r=6mm at"),
        ("cylinder r=0.006", r"a factor of a thousand would make it fit, so write m behind the numbers"),
        ("plane z=5000", r"a factor of a thousand would make it fit"),
        ("plane z=4", r"finds no face. Near are: plane z=5mm"),
        ("sphere r=3", "There is no sphere at all; there are: plane, cylinder"),
        ("nearest 0.01,0,1e5", "away from the body, whose size is 144.6 mm; numbers without a unit are mm"),
        ("nearest 0,0,0", "equally near"),
        ("nearest 1e300,0,0", "'1e300' is no length in a part"),
        ("nearest 1,2", "write nearest x,y,z"),
        ("plane z=5 z=6", "says a second time"),
        ("plane here", "'here' is not understood; regions are such as"),
        ("plane normal=0,0,0", "has no length"),
        ("surface_9..2", "from the lower number"),
        ("surface_1..99999", "from the lower number"),
        ("surfac_1", "there is no face 'surfac_1'; did you mean 'surface_1'.*Faces are also found by what they are"),
        ("hole*", "no face has a name like 'hole\\*'"),
        ("surface_1+", "missing beside the +"),
        ("", "missing beside"),
    ],
)
def test_what_finds_nothing_or_too_much_says_what_to_type(region, message, parts):
    with pytest.raises(InputError, match=message) as refused:
        fp.found_faces(faces_of(parts["plate"]), region)
    assert "\n" not in str(refused.value)


def test_a_name_that_looks_like_a_query_is_a_name(parts):
    faces = faces_of(parts["plate"])
    named = replace(faces, faces=(replace(faces.faces[0], label="plane z=5"), *faces.faces[1:]))
    assert fp.found_faces(named, "plane z=5") == (faces.faces[0].name,)


def test_terms_are_read():
    assert parsed("a..b") == (Names("a..b", ("a..b",)),)
    (query,) = parsed("cylinder r=1in at 1,2,3 in", "mm")
    assert isinstance(query, Query)
    assert query.radius == pytest.approx(0.0254)
    assert query.at == pytest.approx((0.0254, 0.0508, 0.0762))
    (colour,) = parsed("all face colour=#3366CC")
    assert isinstance(colour, Query)
    assert (colour.colour, colour.every) == ("#3366cc", True)


# ---- regions of a mesh ----------------------------------------------------------------------------------------------


def test_regions_become_groups_of_the_mesh(parts):
    mesh = read_mesh(parts["plate"], size=10.0, order=1)
    text = "cylinder r=6mm at 45,25,0"
    grouped = with_regions(mesh, [text, "surface_1", "surface_2+surface_3"])
    nodes = grouped.points[region_nodes(grouped, text)]
    np.testing.assert_allclose(np.hypot(*(nodes[:, :2] - [0.045, 0.025]).T), 0.006, rtol=1e-9)
    sides = [set(region_nodes(mesh, name)) for name in ("surface_2", "surface_3")]
    assert set(region_nodes(grouped, "surface_2+surface_3")) == set.union(*sides)
    assert with_regions(mesh, ["surface_1"]) is mesh


def test_sums_of_groups_and_node_sets(parts):
    mesh = read_mesh(parts["mesh"], unit="mm")
    mesh = replace(mesh, node_groups={"pin_1": np.array([1, 2]), "pin_2": np.array([2, 5])})
    assert with_regions(mesh, ["pin_1+pin_2"]).node_groups["pin_1+pin_2"].tolist() == [1, 2, 5]
    assert with_regions(mesh, ["pin_*"]).node_groups["pin_*"].tolist() == [1, 2, 5]
    both = with_regions(mesh, ["surface_1+surface_2"])
    assert sum(map(len, both.face_groups["surface_1+surface_2"])) == sum(
        len(part) for name in ("surface_1", "surface_2") for part in mesh.face_groups[name]
    )
    with pytest.raises(InputError, match="no group of faces or nodes 'pin'"):
        with_regions(mesh, ["pin"])


@pytest.mark.slow
def test_a_body_keeps_what_was_asked_for(parts, tmp_path):
    """The bore of four faces is one interface, of the same place and shapes as the sum of its faces by name."""
    mesh = read_mesh(parts["plate"], size=12.0)
    faces = faces_of(parts["plate"])
    query = "cylinder r=6mm at 45,25,0"
    names = "+".join(fp.found_faces(faces, query))
    bodies = [reduced(mesh, region) for region in (query, names)]
    np.testing.assert_array_equal(bodies[0].interfaces[0].phi_t, bodies[1].interfaces[0].phi_t)
    np.testing.assert_allclose(bodies[0].interfaces[0].position, [0.045, 0.025, 0.0], atol=1e-5)
    fp.save_body(bodies[0], tmp_path / "plate.ffr")
    (entry,) = fp.load_body(tmp_path / "plate.ffr").provenance["interfaces"]
    assert (entry["region"], "+".join(entry["faces"])) == (query, names)


def reduced(mesh, region):
    model = fp.from_mesh(mesh, fp.material("steel"), [fp.InterfaceRegion("bore", region)])
    return fp.reduce(
        model, fp.Request(name="plate", reference=fp.MeanAxis(), reduction=fp.CraigBampton(2), linear=True)
    )


# ---- solids, units, sizes -------------------------------------------------------------------------------------------


def test_solids_that_touch_are_glued_when_asked(parts):
    with pytest.raises(
        InputError, match=r"2 solids that do not hang together: 'volume_1', 'volume_2'.*--glue.*--solid"
    ):
        check_mesh(read_mesh(parts["stack"], size=10.0))
    glued = read_mesh(parts["stack"], size=10.0, glue=True)
    check_mesh(glued)
    faces = mesh_faces(glued)
    (inner,) = [face for face in faces.faces if face.inner]
    assert inner.area == pytest.approx(0.02 * 0.02)
    assert found(faces, "plane z=10") == tuple(k for k, f in enumerate(faces.faces) if f.kind == "plane" and on_top(f))


def on_top(face):
    return not face.inner and abs(face.centre[2] - 0.01) < 1e-9 and abs(face.axis[2]) == 1


def test_one_solid_of_several(parts):
    mesh = read_mesh(parts["stack"], size=10.0, solids=["volume_2"])
    check_mesh(mesh)
    np.testing.assert_allclose(np.ptp(mesh.points, axis=0), [0.02, 0.02, 0.01], rtol=1e-9)
    with pytest.raises(InputError, match="there is no solid 'nut'; there are: 'volume_1', 'volume_2'"):
        read_mesh(parts["stack"], solids=["nut"])


def test_what_is_meshed_already_is_neither_glued_nor_chosen(parts):
    for wanted in ({"glue": True}, {"solids": ["volume_1"]}):
        with pytest.raises(InputError, match="meshed already"):
            read_mesh(parts["mesh"], **wanted)
    with pytest.raises(InputError, match="write BooleanFragments"):
        read_mesh(MESHES / "box.geo", glue=True)


@pytest.mark.slow
def test_too_many_elements_are_refused_with_a_size_that_would_do(parts):
    with pytest.raises(InputError, match=r"far too many.*A size of 0\.") as refused:
        read_mesh(parts["plate"], size=0.01)
    assert "is the size in metres" in str(refused.value)
    with pytest.raises(InputError, match=r"A size of ([\d.]+)") as small:
        read_mesh(parts["plate"], size=2.0, most_elements=5000)
    enough = float(str(small.value).partition("A size of ")[2].split()[0])
    mesh = read_mesh(parts["plate"], size=enough, most_elements=5000, order=1)
    assert sum(len(block.nodes) for block in mesh.blocks) > 500
    with pytest.raises(InputError, match="most_elements is 0"):
        read_mesh(parts["plate"], most_elements=0)


@pytest.mark.slow
def test_sizes_and_lengths_that_cannot_be_meant_are_told(parts, tmp_path):
    (note,) = read_mesh(parts["plate"], size=500.0, order=1).notes
    assert "so size says nothing" in note
    tiny = written(lambda occ: occ.addBox(0, 0, 0, 0.1, 0.1, 0.2), tmp_path / "tiny.step")
    assert "0.0002 m long" in read_mesh(tiny, order=1).notes[0]
    assert "0.0002 m long" in fp.faces(tiny).notes[0]


# ---- names in STEP files --------------------------------------------------------------------------------------------


def test_names_of_faces_come_from_the_text_of_the_file(parts, tmp_path):
    text = parts["every surface"].read_text()
    first, _, rest = text.partition("ADVANCED_FACE(''")
    path = tmp_path / "named.step"
    path.write_text(first + "ADVANCED_FACE('lid''s side'" + rest)
    faces = fp.faces(path)
    (named,) = [face for face in faces.faces if face.label]
    assert named.label == "lid's side"
    assert fp.found_faces(faces, named.label) == (named.name,)


@pytest.mark.parametrize("code", ["utf-8", "latin-1"])
@pytest.mark.parametrize("text", ["Größe Ø5", r"Gr\X\F6\X\DFe \X2\00D8\X0\5", r"Gr\S\v\S\_e \X4\000000D8\X0\5"])
def test_letters_of_names_are_read_however_the_file_spells_them(parts, tmp_path, text, code):
    """ISO 10303-21, 6.4.3; and as they are, which most programs write."""
    named = parts["plate"].read_text().replace("ADVANCED_FACE(''", f"ADVANCED_FACE('{text}'", 1)
    (tmp_path / "plate.step").write_text(named, encoding=code)
    faces = fp.faces(tmp_path / "plate.step")
    assert [face.label for face in faces.faces if face.label] == ["Größe Ø5"]
    assert fp.found_faces(faces, "Größe*") == ("surface_1",)


@pytest.mark.parametrize("letters", ["Größe", "Größe".encode().decode("latin-1")])
def test_letters_of_solids_are_read(parts, tmp_path, letters):
    """Programs built on the CAD library write the bytes of UTF-8 as letters."""
    named = re.sub(r"PRODUCT\('[^']*',\s*'[^']*'", f"PRODUCT('{letters}','{letters}'", parts["plate"].read_text())
    (tmp_path / "plate.step").write_text(named, encoding="utf-8")
    assert {face.solids for face in fp.faces(tmp_path / "plate.step").faces} == {("Größe",)}


def test_cones_with_a_tip_are_meshed(tmp_path):
    """A drilled hole ends in one; the curvature of a cone grows without bound there, and with it the number of elements."""

    def drilled(occ):
        block, hole = occ.addBox(0, 0, 0, 20, 20, 20), occ.addCylinder(10, 10, 20, 0, 0, -8, 3)
        occ.cut([(3, block)], [(3, hole), (3, occ.addCone(10, 10, 12, 0, 0, -2, 3, 0))])

    path = written(drilled, tmp_path / "drilled.step")
    (cone,) = of_kind(fp.faces(path), "cone")
    assert cone.radius == pytest.approx(math.atan2(3, 2))
    assert cone.area == pytest.approx(math.pi * 3 * math.hypot(3, 2) * 1e-6)
    assert 500 < sum(len(block.nodes) for block in read_mesh(path, size=4.0).blocks) < 20_000


def test_names_are_not_told_where_they_may_be_of_other_faces(parts):
    text = parts["every surface"].read_text().replace("ADVANCED_FACE(''", "ADVANCED_FACE('lid'", 1)
    kinds = [face.kind for face in faces_of(parts["every surface"]).faces]
    assert face_labels(text, [kinds]).count("lid") == 1
    assert set(face_labels(text, [kinds[:-1]])) == {""}
    assert set(face_labels(text, [["sphere"] * len(kinds)])) == {""}
    assert face_labels("#1 = ADVANCED_FACE(" + "'" * 200_001, []) == []


def test_instances_of_a_part_have_names_of_their_own():
    """Solids, and the names of faces, which the file has once for both instances; that of the bore, not that of its solid."""
    faces = fp.faces(PINNED)
    assert [face.solids for face in faces.faces] == [("pin#1",)] * 3 + [("pin#2",)] * 3 + [("base",)] * 8
    assert [face.label for face in faces.faces if face.label] == ["end A", "end A", "left bore"]
    assert "base   bore r 5" in "\n".join(face_lines(faces))
    ends = {face.name for face in faces.faces if face.label == "end A"}
    assert set(fp.found_faces(faces, "end A")) == ends
    (pin,) = fp.found_faces(faces, "cylinder r=5mm solid=pin#2")
    (known,) = [face for face in faces.faces if face.name == pin]
    assert known.hollow is False
    np.testing.assert_allclose(known.centre, [0.02, 0, 0], atol=1e-12)
    assert len(fp.found_faces(faces, "all plane solid=pin")) == 4  # of all instances
    assert len(fp.found_faces(faces, "all plane solid='pi*'")) == 4
    for (
        feature
    ) in faces.features:  # what is typed finds the feature and no other, in spite of a pin as large as its bore
        assert set(found(faces, query_for(faces, feature))) == set(feature)
    assert is_query(query_for(faces, [0]))


def test_one_instance_is_a_body_and_all_have_a_material():
    assert set(fp.read_mesh(PINNED, size=5, solids=["pin#2"]).volume_groups) == {"volume_2", "pin"}
    glued = fp.read_mesh(PINNED, size=5, glue=True)
    assert {"pin", "pin#1", "pin#2", "base"} <= set(glued.volume_groups)
    both = np.union1d(glued.volume_groups["pin#1"], glued.volume_groups["pin#2"])
    np.testing.assert_array_equal(np.sort(glued.volume_groups["pin"]), both)
    with pytest.raises(InputError, match="there are: 'pin#1', 'pin#2', 'base'"):
        fp.faces(PINNED, solids=["bolt"])


def test_names_of_faces_are_not_told_of_glued_solids():
    """Their faces are no longer those of the file."""
    assert {face.label for face in fp.faces(PINNED, glue=True).faces} == {""}


def rounded_in_a_corner(occ):
    """An angle with a fillet of 6 mm in its corner, a bore of 6 mm and a slot whose ends are half bores of 4 mm."""
    flat, wall, bead = occ.addBox(0, 0, 0, 80, 30, 8), occ.addBox(0, 0, 0, 8, 30, 40), occ.addBox(8, 0, 8, 6, 30, 6)
    filled, _ = occ.cut([(3, bead)], [(3, occ.addCylinder(14, 0, 14, 0, 30, 0, 6))])
    body, _ = occ.fuse([(3, flat)], [(3, wall), *filled])
    ends = [(3, occ.addCylinder(x, 15, 0, 0, 0, 8, 4)) for x in (50, 66)]
    occ.cut(body, [(3, occ.addCylinder(30, 15, 0, 0, 0, 8, 6)), *ends, (3, occ.addBox(50, 11, 0, 16, 8, 8))])


@pytest.mark.slow
def test_a_fillet_is_no_bore(tmp_path):
    """A cylinder from inside is a bore from half a turn on, in geometries and on meshes; `cylinder` means all."""
    path = written(rounded_in_a_corner, tmp_path / "angle.step")
    mesh = replace(read_mesh(path, size=3.0), drawn=(), face_groups={})
    for faces in (fp.faces(path), mesh_faces(mesh)):
        arcs = {
            (round(faces.faces[k].radius * 1e3), round(math.degrees(faces.arcs[k])))
            for k in np.flatnonzero(faces.arcs > 0)
        }
        assert {arc for arc in arcs if arc[0] in (4, 6)} == {(6, 90), (6, 360), (4, 180)}
        (bore,) = {tuple(of) for of in faces.features if set(of) & set(found(faces, "bore r=6mm"))}
        assert np.degrees(faces.arcs[bore[0]]) == 360
        assert len(found(faces, "all bore r=4mm")) >= 2
        with pytest.raises(InputError, match="finds 2 cylinders"):
            found(faces, "cylinder r=6mm")
        assert any("concave cylinder r 6 over 90°" in line for line in face_lines(faces))


@pytest.mark.parametrize("turned", [0.0, 0.3])
@pytest.mark.parametrize(("around", "height"), [(5, 3.0), (6, 3.0), (6, 20.0), (12, 1.0)])
def test_a_coarse_bore_is_one(around, height, turned):
    """Its triangles lean far towards the axis where it is short, and their normals add up to nothing."""
    angles = 2 * np.pi * np.arange(around) / around
    low = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    top = np.stack([np.cos(angles + turned), np.sin(angles + turned), 0 * angles + height / 6], axis=1)
    k, following = np.arange(around), np.roll(np.arange(around), -1)
    sides = np.concatenate(
        [np.stack([k, k + around, following], 1), np.stack([following, k + around, following + around], 1)]
    )
    points = 6e-3 * np.concatenate([low, top])
    face = recognised(Face("f", "other", np.zeros(3), 1.0), points, sides, 2e-4)
    assert (face.kind, face.hollow) == ("cylinder", True)
    assert face.radius == pytest.approx(6e-3)
    np.testing.assert_allclose(np.abs(face.axis), [0, 0, 1], atol=1e-6)


def test_few_nodes_make_no_cylinder_and_no_sphere_of_a_patch():
    """Five numbers make a cylinder, so five nodes lie on some cylinder whatever they are."""
    points = np.array([[0, 0, 0], [1, 0, 0.1], [1, 1, 0], [0, 1, 0.13], [2, 0.4, 0.5]])
    triangles = np.array([[0, 1, 2], [0, 2, 3], [1, 4, 2]])
    assert recognised(Face("f", "other", np.zeros(3), 1.0), points, triangles, 2e-4).kind == "other"


# ---- models without faces -------------------------------------------------------------------------------------------


def frame():
    member = fp.Member(fp.circle(d=0.01), fp.material("steel"))
    made = fp.polyline([(0, 0, 0), (1, 0, 0), (1, 1, 0)], member, elements=4)
    return fp.named(made, root=(0, 0, 0), tip=(1, 1, 0))


@pytest.mark.parametrize(
    ("region", "places"),
    [
        ("nearest 0.875,0,0", None),
        ("nearest 1,1.1,0", [(1, 1, 0)]),
        ("root+tip", [(0, 0, 0), (1, 1, 0)]),
        ("*", [(0, 0, 0), (1, 1, 0)]),
        ("plane y=1", [(1, 1, 0)]),
        ("plane normal=x at 0,5,5", [(0, 0, 0)]),
        ("cylinder r=1000mm axis=z at 0,0,0", [(1, 0, 0)]),
    ],
)
def test_regions_of_frames_are_nodes(region, places):
    if places is None:
        with pytest.raises(InputError, match="2 nodes are equally near"):
            group_nodes(frame(), region)
    else:
        assert sorted(map(tuple, frame().points[group_nodes(frame(), region)])) == sorted(places)


@pytest.mark.parametrize(
    ("region", "message"),
    [
        ("cylinder r=6mm", "nodes and no faces"),
        ("plane z=3", "finds no node"),
        ("nearest 900,0,0", "far from all nodes"),
        ("rot", "no group of nodes 'rot'; did you mean 'root'"),
        ("x*", r"no group of nodes 'x\*'"),
    ],
)
def test_regions_that_frames_do_not_have(region, message):
    with pytest.raises(InputError, match=message):
        group_nodes(frame(), region)
