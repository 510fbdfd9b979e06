"""As many parts as a scene needs: `ffr-dyn parts`, and the commands that bodies keep."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from ffr_dyn.analyses.static import static
from ffr_dyn.cli import cli as ffr_dyn
from ffr_dyn.consistency import validity
from ffr_dyn.consistency.validity import in_enough_parts, parts_needed
from ffr_dyn.scene.forces import Load
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_dyn.scene_file.read import body_files, load_scene
from ffr_prep.body import load_body, rigid_body
from ffr_prep.cli import cli as ffr_prep
from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.model.reference import MeanAxis
from ffr_prep.pipelines.reduce import reduce
from ffr_prep.pipelines.structure_file import read_structure
from ffr_prep.reduction.conversion import with_reference

STRIP = """
reference = {kind = "fixed", interface = "root"}
reduction = {method = "craig-bampton", modes = 1}
[[polylines]]
member = "strip"
corners = [[0, 0, 0], [1, 0, 0]]
elements = 16
[members.strip]
section = {shape = "rectangle", b = 0.02, h = 0.01}
material = "steel"
orientation = [0, 1, 0]
[nodes]
root = [0, 0, 0]
tip = [1, 0, 0]
[interfaces.root]
[interfaces.tip]
"""
CLAMPED = """
[ground]
wall = [0, 0, 0]
[bodies.strip]
file = "strip.ffr"
[joints.clamp]
kind = "fixed"
i = "ground.wall"
j = "strip.root"
[loads.push]
marker = "strip.tip"
force = [0, 300, 0]
[analysis]
kind = "static"
"""


def run(command, *arguments):
    command.main([str(word) for word in arguments], standalone_mode=False)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "strip.toml").write_text(STRIP)
    (tmp_path / "scene.toml").write_text(CLAMPED)
    run(ffr_prep, "reduce-structure", "strip.toml", "--parts", 2, "-o", "two.ffr")
    run(ffr_prep, "reduce-structure", "strip.toml", "-o", "strip.ffr")
    return tmp_path


def test_a_body_keeps_its_command_but_for_file_and_parts(folder):
    for name in ("strip.ffr", "two.ffr"):
        assert load_body(name).provenance["command"] == ["reduce-structure", "strip.toml"]
    assert "command" not in with_reference(load_body("strip.ffr"), MeanAxis()).provenance
    assert body_files("scene.toml") == {"strip": Path("strip.ffr")}


def test_the_command_is_told(folder, capsys):
    run(ffr_dyn, "parts", "scene.toml", "--angle", "5deg")
    said = capsys.readouterr().out
    assert "body         strip: 10 parts do" in said
    assert "command      ffr-prep reduce-structure strip.toml --parts 10 -o strip.ffr" in said
    assert load_body("strip.ffr").parts == ()


@pytest.mark.slow
def test_bodies_are_reduced_again_until_it_is_enough(folder, capsys):
    run(ffr_dyn, "parts", "scene.toml", "--static", "--reduce")
    assert "body         strip: 5 parts do" in capsys.readouterr().out
    scene, _ = load_scene("scene.toml")
    assert [body.name for body in scene.bodies] == [f"strip_{k}" for k in range(1, 6)]
    result = static(scene)
    assert result.attributes["notes"] == []
    assert parts_needed(scene, result)["strip"] <= 5


def test_bodies_that_do_not_know_their_command_are_told(folder, capsys):
    path = folder / "strip.ffr"
    run(ffr_prep, "convert", path, "--reference", "mean-axis", "-o", path)
    run(ffr_dyn, "parts", "scene.toml")
    assert "strip.ffr does not know the one that made it" in capsys.readouterr().out
    with pytest.raises(InputError, match="make it again with as many parts"):
        run(ffr_dyn, "parts", "scene.toml", "--reduce")


@pytest.mark.slow
@pytest.mark.parametrize(("share", "expected"), [(1.0, 5), (3.0, 11)], ids=["a third", "six tenths"])
def test_enough_at_once(tmp_path, share, expected):
    """A cantilever bent to 0.30 and to 0.60 of its length: the parts that one body asks for ask for no more."""
    (tmp_path / "strip.toml").write_text(STRIP.replace("elements = 16", "elements = 44"))
    structure = read_structure(tmp_path / "strip.toml")
    asked = []

    def make(counts):
        asked.append(dict(counts))
        body = reduce(structure.model(), replace(structure.request, parts=counts.get("strip")))
        force = share * 2.1e11 * 0.02 * 0.01**3 / 12
        return Scene(
            (Body("strip", body),),
            (Joint("clamp", "fixed", "ground.wall", "strip.root"),),
            ground={"wall": (0, 0, 0)},
            loads=(Load("push", "strip.tip", force=(0.0, force, 0.0)),),
        )

    _, result = in_enough_parts(make, static)
    assert asked == [{}, {"strip": expected}]
    assert result.attributes["notes"] == []
    assert result["strip.tip.position"][-1, 1] == pytest.approx({1.0: 0.3017, 3.0: 0.6033}[share], rel=1e-3)


def test_parts_that_never_are_enough_end(monkeypatch):
    monkeypatch.setattr(validity, "parts_needed", lambda *_: {"stone": 2})
    stone = Scene((Body("stone", rigid_body("stone", mass=1.0, inertia=(1.0, 1.0, 1.0))),))
    with pytest.raises(ComputationError, match="after 4 analyses still more parts are needed"):
        in_enough_parts(lambda _: stone, lambda _: None)
