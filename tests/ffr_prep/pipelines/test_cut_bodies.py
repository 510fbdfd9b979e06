"""Bodies cut into parts: what the parts have, where they are cut, and what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from boxes import STEEL, box_mesh

from ffr_prep.body import BodyError, FlexibleBody, load_body, save_body, truncated, with_point
from ffr_prep.cli import main
from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.mesh.mesh import Mesh
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.cuts import CutPlane, long_axis
from ffr_prep.model.model import Model
from ffr_prep.model.reference import FixedTo, MeanAxis, SimplySupported
from ffr_prep.pipelines.reduce import Request, reduce
from ffr_prep.pipelines.structure_file import read_structure
from ffr_prep.reduction.conversion import with_reference
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.reduction.methods.rubin import Rubin
from ffr_prep.reduction.selection import Accuracy, Band
from ffr_prep.report.text import body_lines
from ffr_prep.solids.model import from_mesh
from ffr_prep.structures.frame import Member, Shell, named, panel, polyline
from ffr_prep.structures.model import from_frame
from ffr_prep.structures.sections import rectangle

ENDS = [InterfaceRegion("left"), InterfaceRegion("right")]
HALVES = replace(STEEL, name="light", rho=STEEL.rho / 2)


def bar(kind: str = "hex8", cells: int = 12) -> Mesh:
    """One metre along x."""
    return box_mesh(kind, (1.0, 0.06, 0.04), (cells, 2, 1))


def beam(elements: int = 16) -> Model:
    member = Member(rectangle(0.02, 0.01), STEEL, (0.0, 1.0, 0.0))
    frame = named(
        polyline([(0, 0, 0), (0.6, 0.8, 0.0)], member, elements=elements), left=(0, 0, 0), right=(0.6, 0.8, 0.0)
    )
    return from_frame(frame, ENDS)


def plate() -> Model:
    corners = [(0, 0, 0), (1, 0, 0), (1, 0.1, 0), (0, 0.1, 0)]
    frame = panel(corners, Shell(0.003, STEEL), elements=(12, 2))
    groups = {"left": np.flatnonzero(frame.points[:, 0] == 0), "right": np.flatnonzero(frame.points[:, 0] == 1)}
    return from_frame(replace(frame, node_groups=groups), ENDS)


def cut(model: Model, parts: object, **settings: object) -> FlexibleBody:
    given = {"reference": FixedTo("left"), "reduction": CraigBampton(2), **settings}
    return reduce(model, Request(name="bar", parts=parts, **given))


MODELS = {
    "hex8": lambda: from_mesh(bar(), STEEL, ENDS),
    "hex20": lambda: from_mesh(bar("hex20"), STEEL, ENDS),
    "tet10": lambda: from_mesh(bar("tet10", 9), STEEL, ENDS),
    "beam": beam,
    "plate": plate,
}


@pytest.mark.parametrize("make", MODELS.values(), ids=MODELS)
@pytest.mark.parametrize("parts", [2, 3, [0.3, 0.55]], ids=str)
def test_mass_and_moments_of_the_parts_are_those_of_the_whole(make, parts):
    body = cut(make(), parts)
    assert len(body.parts) == (parts if isinstance(parts, int) else 3)
    for key in ("mass", "r_dm", "rr_dm"):
        total = sum(getattr(part, key) for part in body.parts)
        np.testing.assert_allclose(total, getattr(body, key), rtol=0, atol=1e-13 * body.mass)


def test_parts_have_the_interfaces_of_the_whole_and_meet_at_their_cuts():
    first, middle, last = cut(MODELS["hex8"](), 3).parts
    assert [i.name for i in first.interfaces] == ["left", "cut_1_a"]
    assert [i.name for i in middle.interfaces] == ["cut_1_b", "cut_2_a"]
    assert [i.name for i in last.interfaces] == ["right", "cut_2_b"]
    np.testing.assert_array_equal(first.interface("cut_1_a").position, middle.interface("cut_1_b").position)
    assert first.interface("cut_1_a").kind == "rigid"
    assert first.interface("cut_1_a").position[0] == pytest.approx(1 / 3)


@pytest.mark.slow
def test_a_part_has_the_reference_conditions_if_it_has_their_interfaces():
    fixed = cut(MODELS["beam"](), 2)
    assert [part.provenance["reference"]["type"] for part in fixed.parts] == ["FixedTo", "MeanAxis"]
    supported = cut(MODELS["beam"](), 2, reference=SimplySupported("left", "right"))
    assert [part.provenance["reference"]["type"] for part in supported.parts] == ["MeanAxis", "MeanAxis"]
    turned = with_reference(supported, FixedTo("right"))
    assert [part.provenance["reference"]["type"] for part in turned.parts] == ["MeanAxis", "FixedTo"]


def test_stations_are_distances_from_the_end_along_the_long_axis():
    """Of a beam of one metre that leans: the next node is where it is cut."""
    body = cut(beam(elements=10), [0.2, 0.6])
    for k, station in ((0, 0.2), (1, 0.6)):
        at = body.parts[k].interface(f"cut_{k + 1}_a").position
        np.testing.assert_allclose(at, station * np.array([0.6, 0.8, 0.0]), atol=1e-12)


def test_the_long_axis_is_not_that_of_the_finest_mesh():
    """A hammer whose head has a hundred times as many nodes for its length as its shaft of one metre."""
    shaft, head = np.linspace([0, 0, 0], [1, 0, 0], 11), np.linspace([1, -0.15, 0], [1, 0.15, 0], 1001)
    np.testing.assert_array_equal(long_axis(np.concatenate([shaft, head])), [1, 0, 0])


def test_cuts_that_cannot_be_made_are_refused_before_the_whole_is_reduced():
    stages: list[str] = []
    model = beam()
    with pytest.raises(InputError, match="into two or more parts"):
        reduce(
            model, Request(name="bar", reference=MeanAxis(), reduction=CraigBampton(2), parts=1), progress=stages.append
        )
    assert not stages


def test_planes_of_ones_own():
    body = cut(MODELS["hex8"](), [CutPlane((0.25, 0, 0), (1, 0, 0)), 0.5])
    assert [part.mass / body.mass for part in body.parts] == pytest.approx([0.25, 0.25, 0.5])


def test_a_part_has_the_materials_of_its_volumes():
    mesh = bar()
    centres = mesh.points[mesh.blocks[0].nodes].mean(axis=1)[:, 0]
    groups = {"near": np.flatnonzero(centres < 0.5), "far": np.flatnonzero(centres > 0.5)}
    model = from_mesh(replace(mesh, volume_groups=groups), {"near": STEEL, "far": HALVES}, ENDS)
    near, far = cut(model, 2).parts
    assert far.mass == pytest.approx(near.mass / 2, rel=1e-12)


def test_every_part_has_what_was_asked_of_the_whole():
    body = cut(MODELS["beam"](), 2, stress=True)
    for part in body.parts:
        assert part.stiffening is not None
        assert part.surface.beams is not None
    assert body.parts[1].name == "bar_2"


@pytest.mark.slow
def test_a_file_holds_body_and_parts(tmp_path):
    body = cut(MODELS["beam"](), 3, stress=True)
    again = load_body(save_body(body, tmp_path / "bar.ffr"))
    assert [part.name for part in again.parts] == ["bar_1", "bar_2", "bar_3"]
    for part, read in zip(body.parts, again.parts, strict=True):
        np.testing.assert_array_equal(read.PP_dm, part.PP_dm)
        np.testing.assert_array_equal(read.surface.beams.modes, part.surface.beams.modes)
    assert "bar_3" in "\n".join(body_lines(again))


@pytest.mark.slow
def test_fewer_modes_and_one_more_point_reach_the_parts():
    body = truncated(cut(MODELS["hex20"](), 2), 5)
    assert [part.n for part in body.parts] == [5, 5]
    pointed = with_point(body, "hook", (0.8, 0.0, 0.0))
    assert [i.name for i in pointed.parts[1].interfaces] == ["right", "cut_1_b", "hook"]
    assert "hook" not in [i.name for i in pointed.parts[0].interfaces]


@pytest.mark.parametrize(
    ("parts", "words"),
    [
        (1, "into two or more parts"),
        ("4", "give a number of parts"),
        ([], "give a number of parts"),
        ([0.5, 0.2], "must rise from 0 to its length, 1 m"),
        ([1.5], "must rise"),
        ([0.01], "part 1 of 2 has no elements"),
    ],
)
def test_cuts_that_cannot_be_made(parts, words):
    with pytest.raises(InputError, match=words):
        cut(MODELS["hex8"](), parts)


def test_an_interface_in_two_parts_is_named_with_what_to_do():
    mesh = bar()
    groups = {
        "waist": np.flatnonzero(abs(mesh.points[:, 0] - 0.5) < 0.1),
        "ring": np.flatnonzero(mesh.points[:, 0] == 0.5),
    }
    for name in groups:
        model = from_mesh(replace(mesh, node_groups=groups), STEEL, [InterfaceRegion("left"), InterfaceRegion(name)])
        with pytest.raises(InputError, match=f"'{name}' lies in parts 1 and 2: move the cut.*0.5, .* off its region"):
            cut(model, 2)


def test_a_name_that_a_cut_has():
    mesh = bar()
    model = from_mesh(
        replace(mesh, face_groups={"cut_1_a": mesh.face_groups["left"]}), STEEL, [InterfaceRegion("cut_1_a")]
    )
    with pytest.raises(InputError, match=r"'cut_1_a'.*another name"):
        cut(model, 2, reference=MeanAxis())


def test_a_fork_is_cut_where_it_is_one_piece():
    member = Member(rectangle(0.02, 0.01), STEEL, (0.0, 0.0, 1.0))
    corners = [(1.0, 0.1, 0.0), (0.0, 0.1, 0.0), (0.0, -0.1, 0.0), (1.0, -0.1, 0.0)]
    frame = named(polyline(corners, member, elements=8), left=(1.0, 0.1, 0.0), right=(1.0, -0.1, 0.0))
    with pytest.raises(InputError, match="part 2 of 2 falls into 2 pieces"):
        cut(from_frame(frame, ENDS), 2)


def test_models_of_matrices_cannot_be_cut():
    with pytest.raises(InputError, match="cannot be cut into parts"):
        cut(replace(beam(), cut=None), 2)


def test_parts_that_do_not_make_up_the_body():
    body = cut(MODELS["beam"](), 2)
    with pytest.raises(BodyError, match="must be those of the whole, each once"):
        replace(body, parts=body.parts[:1])
    with pytest.raises(BodyError, match="kg together"):
        replace(body, parts=(replace(body.parts[0], mass=1.0), body.parts[1]))


def test_a_short_part_is_named_where_its_modes_do_not_suffice():
    with pytest.raises(InputError, match="part 1 of 8: asked for 12 normal modes"):
        cut(beam(), 8, reduction=CraigBampton(12))


def test_a_short_part_whose_receptances_need_more_than_its_slow_modes_is_named_with_the_way_out():
    """Along its axis a part is so stiff that no mode near the band has its flexibility; Rubin's static shapes do."""
    slow = Accuracy(Band(1.0, 200.0), 0.01)
    with pytest.raises(ComputationError, match=r"part 1 of 4: with all .* use rubin"):
        cut(beam(), 4, reduction=CraigBampton(slow))
    assert len(cut(beam(), 4, reduction=Rubin(slow)).parts) == 4


STRUCTURE = """
reference = {kind = "fixed", interface = "left"}
reduction = {method = "craig-bampton", modes = 2}
parts = PARTS
[[polylines]]
member = "bar"
corners = [[0, 0, 0], [1, 0, 0]]
elements = 8
[members.bar]
section = {shape = "rectangle", b = 0.01, h = 0.02}
material = "steel"
orientation = [0, 1, 0]
[nodes]
left = [0, 0, 0]
[interfaces.left]
"""


@pytest.mark.parametrize("parts", ["2", "[0.5]", "[{point = [0.5, 0, 0], normal = [1, 0, 0]}]"])
def test_a_structure_file_says_its_parts(tmp_path, parts):
    path = tmp_path / "bar.toml"
    path.write_text(STRUCTURE.replace("PARTS", parts))
    structure = read_structure(path)
    body = reduce(structure.model(), structure.request)
    assert [part.mass / body.mass for part in body.parts] == pytest.approx([0.5, 0.5])


@pytest.mark.slow
def test_the_command_takes_parts(tmp_path, capsys):
    geometry = tmp_path / "bar.geo"
    geometry.write_text(
        'SetFactory("OpenCASCADE"); Box(1) = {0, 0, 0, 1, 0.1, 0.1}; Physical Volume("bar") = {1};\n'
        'Physical Surface("left") = {1};\n'
    )
    common = ["reduce", str(geometry), "--size", "0.1", "--material", "steel", "--interface", "left", "--modes", "1"]
    main([*common, "--parts", "2", "-o", str(tmp_path / "bar.ffr")])
    assert "bar_2" in capsys.readouterr().out
    with pytest.raises(SystemExit):
        main([*common, "--parts", "two", "-o", str(tmp_path / "bar.ffr")])
    assert "--parts two: write a number of parts" in capsys.readouterr().err
