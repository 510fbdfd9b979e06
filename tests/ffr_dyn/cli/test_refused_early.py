"""What is refused before any work is done, and touches no file."""

import shlex

import pytest

from ffr_dyn.cli import cli
from ffr_prep.cli import cli as prep_cli
from ffr_prep.common.command import run_command

SCENE = """
[analysis]
end = 0.1
output_step = 0.05
step = 0.005
[ground]
O = [0, 0, 0]
[bodies.rod]
mass = 1.0
inertia = [0.01, 0.3333, 0.3333]
centre_of_mass = [1, 0, 0]
points = {a = [0, 0, 0], tip = [2, 0, 0]}
[joints.hinge]
kind = "revolute"
i = "ground.O"
j = "rod.a"
[forces.s]
kind = "joint-spring"
joint = "hinge"
stiffness = 100
damping = 5
"""
FORCED = "forced rod.toml --input hinge.moment --amplitude 0.1 --output hinge.angle --band 1..1.02 -o out.nc"
RESPONSE = "response rod.toml --input hinge.moment --output hinge.angle --band 1..2 -o out.nc"


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("run rod.toml -o other.toml", "by its ending this is a text such as a scene"),
        ("run rod.toml -o other.ffr", "by its ending this is a body file"),
        ("economise rod.toml --output rod.tip.position -o other.ffr", "what is written here ends in .toml"),
        ("run rod.toml --step 1e-300", "give a longer step"),
        (f"{FORCED} --picture a.xyz", "pictures are written as"),
        (f"{FORCED} --picture rod.toml", "pictures are written as"),
        (f"{RESPONSE} --bode a.xyz", "pictures are written as"),
        (f"{RESPONSE} --nyquist a.xyz", "pictures are written as"),
        ("campbell rod.toml --turn hinge --speed 0..10 --picture a.xyz -o out.nc", "pictures are written as"),
        ("campbell rod.toml --turn hinge --speed 0..10:1000000000 -o out.nc", "1000000000 speeds are too many"),
        ("parts rod.toml", "no body is flexible"),
        ("parts rod.toml --angle 0", "it must be positive"),
        ("chart rod.toml -m position:rod.tip --wanted nan", "nan is not a finite number"),
        ("chart rod.toml -m position:rod.tip --limit inf", "inf is not a finite number"),
    ],
)
def test_refused_in_a_sentence(tmp_path, monkeypatch, capsys, line, words):
    monkeypatch.chdir(tmp_path)
    for name in ("rod.toml", "other.toml", "other.ffr"):
        (tmp_path / name).write_text(SCENE)
    with pytest.raises(SystemExit) as end:
        run_command(cli, "ffr-dyn", shlex.split(line))
    assert end.value.code == 2
    assert words in capsys.readouterr().err
    assert {path.name for path in tmp_path.iterdir()} == {"rod.toml", "other.toml", "other.ffr"}
    assert all(path.read_text() == SCENE for path in tmp_path.iterdir())


@pytest.mark.parametrize("line", ["import a.sid -o b.toml", "convert a.ffr --reference mean-axis -o b.toml"])
def test_a_body_is_not_written_over_a_scene(tmp_path, monkeypatch, capsys, line):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "b.toml").write_text(SCENE)
    with pytest.raises(SystemExit) as end:
        run_command(prep_cli, "ffr-prep", shlex.split(line))
    assert end.value.code == 2
    assert "by its ending this is a text" in capsys.readouterr().err
    assert (tmp_path / "b.toml").read_text() == SCENE
