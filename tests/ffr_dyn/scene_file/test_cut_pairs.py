"""A number of modes of a scene that cuts a pair of equal frequency is told, where the other plane counts."""

from __future__ import annotations

import pytest

import ffr_dyn as fd
import ffr_prep as fp

STEEL = fp.material("steel")


def rod(section: fp.Section) -> fp.FlexibleBody:
    line = fp.polyline([(0, 0, 0), (1, 0, 0)], fp.Member(section, STEEL, (0, 1, 0)), elements=8)
    model = fp.from_frame(fp.named(line, a=(0, 0, 0)), [fp.InterfaceRegion("a")])
    return fp.reduce(model, fp.Request(name="rod", reference=fp.FixedTo("a"), reduction=fp.Eigenmodes(6)))


ROUND, FLAT = rod(fp.circle(0.02)), rod(fp.rectangle(0.02, 0.03))


def told(body: fp.FlexibleBody, kind: str = "spherical", **more: object) -> list[str]:
    axis = {} if kind == "spherical" else {"axis": (0, 0, 1)}
    hinge = fd.Joint("hinge", kind, "ground.wall", "rod.a", **axis)
    scene = fd.Scene(bodies=[fd.Body("rod", body)], joints=[hinge], ground={"wall": (0, 0, 0)}, **more)
    return [note for note in fd.assemble(scene).notes if "cuts a pair" in note]


@pytest.mark.parametrize(("modes", "remedy"), [(1, "ask for 2"), (3, "ask for 4, or for 2"), (2, ""), (6, "")])
def test_a_number_of_modes_that_cuts_a_pair_is_told(modes, remedy):
    notes = told(fp.truncated(ROUND, modes))
    assert len(notes) == bool(remedy)
    assert all(
        note.startswith(f"body 'rod': the number of modes that are kept, {modes}, cuts a pair") for note in notes
    )
    assert all(note.endswith(remedy) for note in notes)
    assert told(fp.truncated(FLAT, modes)) == []


def test_what_is_cut_again_or_moves_in_a_plane_is_not_told():
    assert told(fp.truncated(fp.truncated(ROUND, 3), 2)) == []
    assert told(fp.truncated(ROUND, 3), "revolute", plane="z") == []


def test_a_scene_file_tells(tmp_path):
    fp.save_body(ROUND, tmp_path / "rod.ffr")
    text = """
        gravity = [0, 0, -9.81]
        [ground]
        wall = [0, 0, 0]
        [bodies.rod]
        file = "rod.ffr"
        modes = 3
        [joints.hinge]
        kind = "spherical"
        i = "ground.wall"
        j = "rod.a"
        [analysis]
        kind = "static"
        """
    (tmp_path / "scene.toml").write_text(text)
    scene, _ = fd.load_scene(tmp_path / "scene.toml")
    assert any("modes that are kept, 3, cuts a pair" in note for note in fd.assemble(scene).notes)
