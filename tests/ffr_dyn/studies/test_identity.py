"""What a body and a study are known by: whatever changes their numbers makes them others."""

from __future__ import annotations

from pathlib import Path

import pytest
from test_sweep import SCENE

import ffr_dyn as fd
from ffr_dyn.studies.identity import body_file, mark

ANGLE = {"angle": "hinge.angle: last"}
WITH_BODIES = SCENE.replace(
    "[joints.hinge]",
    """
[bodies.other]
file = "other.ffr"
[bodies.thin]
file = "thin_${kind}.ffr"
[joints.hinge]""",
).replace("idle = 3.0", 'idle = 3.0\nkind = "of_${size}"\nsize = "small"')


@pytest.fixture
def folder(tmp_path, monkeypatch) -> Path:
    """A folder with a study in a folder of it, called by its name from outside, as people do."""
    (tmp_path / "here").mkdir()
    (tmp_path / "parts").mkdir()
    (tmp_path / "here/bar.toml").write_text('include = ["../parts/weight.toml"]\n' + WITH_BODIES)
    (tmp_path / "parts/weight.toml").write_text('[bodies.weight]\nfile = "weight.ffr"\n')
    for name in ("here/other.ffr", "here/rod_1.geo", "here/rod_2.geo", "parts/weight.ffr"):
        (tmp_path / name).write_text("before")
    for size in ("small", "large"):
        (tmp_path / f"here/thin_of_{size}.ffr").write_text("before")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def marked(histories: bool = False) -> str:
    """Of a study whose bodies and files depend on parameters."""
    parameters = {"d": [1, 2], "size": ["small", "large"]}
    recipe = {"other": "reduce rod_${d}.geo --set d=${d}"}
    return mark(fd.study("here/bar.toml", parameters, ANGLE, bodies=recipe, folder="here", histories=histories))


@pytest.mark.parametrize(
    "changed",
    ["here/other.ffr", "here/rod_1.geo", "here/rod_2.geo", "here/thin_of_large.ffr", "parts/weight.ffr", ""],
)
def test_a_study_whose_files_have_changed_is_another(folder, changed):
    """Rows of a body before and of one after its change are not put into one table; nor runs with and without histories."""
    before = marked()
    assert marked() == before
    if changed:
        (folder / changed).write_text("after")
    assert marked(histories=not changed) != before


def test_a_study_whose_body_is_a_parameter_knows_its_files(folder):
    def of_files() -> str:
        return mark(fd.study("here/bar.toml", {"bodies.other.file": ["a.ffr", "b.ffr"]}, ANGLE))

    before = of_files()
    (folder / "here/b.ffr").write_text("new")
    assert of_files() != before


@pytest.mark.parametrize(
    ("line", "files"),
    [
        (
            "reduce-structure frame.toml",
            {
                "frame.toml": '[geometry]\nfile = "frame.geo"\n',
                "frame.geo": 'Include "size.geo";',
                "size.geo": 'Merge "a.step";',
                "a.step": "1",
            },
        ),
        (
            "reduce part.inp",
            {"part.inp": "*INCLUDE, INPUT=nodes.inp\n", "nodes.inp": '*NODE, INPUT="n.txt"\n', "n.txt": "1"},
        ),
        ("reduce part.bdf", {"part.bdf": "  include 'grid.bdf'\n", "grid.bdf": "GRID,1"}),
        ("reduce a.msh --material web=web.toml", {"a.msh": "", "web.toml": "E = 1"}),
        ("reduce self.geo", {"self.geo": 'Include "self.geo"; Merge "a.step";', "a.step": "1"}),
    ],
)
def test_a_body_is_known_by_all_files_below_those_that_its_line_names(tmp_path, line, files):
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    before = body_file(line, tmp_path, tmp_path)
    assert body_file(line, tmp_path, tmp_path) == before
    (tmp_path / list(files)[-1]).write_text("2")
    assert body_file(line, tmp_path, tmp_path) != before
