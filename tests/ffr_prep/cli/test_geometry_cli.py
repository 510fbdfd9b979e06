"""The commands that look at a part, and the way of a new user from a STEP file of another program to a body."""

from __future__ import annotations

import json
import re
import shutil

import numpy as np
import pytest
from parts import plate, stack, written
from places import REFERENCE

from ffr_prep import cli
from ffr_prep.body import load_body


def run(*arguments, code=0):
    """The exit code of a command, in this process."""
    try:
        cli.main([str(word) for word in arguments])
        ended = 0
    except SystemExit as error:
        ended = error.code or 0
    assert ended == code


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("parts")
    written(plate, folder / "plate4.step")
    written(stack, folder / "stack.step")
    written(plate, folder / "plate4.msh", mesh=8.0)
    shutil.copy(REFERENCE / "plate.step", folder / "plate.step")
    return folder


@pytest.mark.slow
def test_from_a_step_file_of_another_program_to_a_body(folder, tmp_path, monkeypatch, capsys):
    """What a new user types, in a folder with the file alone: what is in it, two bores as interfaces, a body, a look."""
    monkeypatch.chdir(tmp_path)
    shutil.copy(folder / "plate.step", "plate.step")
    run("faces", "plate.step", "--page", "plate.html", "--picture", "plate.png")
    told = capsys.readouterr().out
    typed = [line.partition("cylinder r=6mm at ")[2].strip() for line in told.splitlines() if "bore r 6" in line]
    assert typed == ["-45,-25,5mm", "45,-25,5mm", "-45,25,5mm", "45,25,5mm"]
    left, right = (f"cylinder r=6mm at {at}" for at in (typed[0], typed[3]))
    run(
        *("reduce", "plate.step", "--size", 12, "--material", "aluminium", "--linear", "--modes", 4, "-o", "plate.ffr"),
        *("--interface", f"pivot={left}", "--interface", f"load={right}:mean", "--reference", "fixed:pivot"),
    )
    run("info", "plate.ffr")
    told = capsys.readouterr().out
    assert f"pivot  rigid  at (-0.045, -0.025, 0.005) m: {left} (surface_11)" in told
    assert f"load   mean   at (0.045, 0.025, 0.005) m: {right} (surface_14)" in told
    run("modes", "plate.ffr", "-o", "shapes", "--modes", "1-2")
    body = load_body("plate.ffr")
    assert 0.2 < body.mass < 0.3
    assert [interface.name for interface in body.interfaces] == ["pivot", "load"]


def test_a_rigid_body_of_the_same_file(folder, tmp_path, capsys):
    path = tmp_path / "plate.ffr"
    pin = "pin=cylinder r=6mm at 45,25,0"
    run("rigid", folder / "plate.step", "--material", "steel", "--interface", pin, "-o", path)
    told = capsys.readouterr().out
    assert "pin  node   at (0.045, 0.025, 0.005) m: cylinder r=6mm at 45,25,0" in told
    body = load_body(path)
    assert (body.n, body.name) == (0, "plate")
    np.testing.assert_allclose(body.interfaces[0].position, [0.045, 0.025, 0.005], atol=1e-9)
    run("info", path)
    assert "a rigid body: it does not deform" in capsys.readouterr().out
    run("rigid", folder / "plate.step", "--material", "steel", "--material", "aluminium", "-o", path, code=2)
    assert "a rigid body has one density: make one of each volume" in capsys.readouterr().err


@pytest.mark.slow
def test_reference_conditions_say_which_interface_lies_at_their_region(folder, tmp_path, capsys):
    body, pin = tmp_path / "plate.ffr", "pin=cylinder r=6mm at -45,-25,5"
    coarse = (
        "reduce",
        folder / "plate.step",
        "--size",
        30,
        "--order",
        1,
        "--material",
        "steel",
        "--modes",
        2,
        "--linear",
    )
    for region, said in (
        ("bore r=6mm near -45,-25,5", "there lies 'pin'"),
        ("plane x=-60", "a mean interface is made there, 'support'"),
    ):
        named = ("--region", "top=plane z=10", "--region", "hole=bore r=6 near 45,25,0")
        run(*coarse, *named, "--interface", pin, "--reference", f"fixed:{region}", "-o", body)
        assert f"reference   {region}: {said}" in capsys.readouterr().out
    run("info", body)
    told = capsys.readouterr().out
    assert re.search(r"^regions     hole: \d+ triangles of the surface\n {12}top: \d+ triangles", told, re.M)
    assert "command     ffr-prep reduce " in told
    assert "--region 'hole=bore r=6 near 45,25,0'" in told  # as a shell takes it
    assert max(map(len, told.splitlines())) < 500
    assert [(one.name, one.kind) for one in load_body(body).interfaces] == [("pin", "rigid"), ("support", "mean")]
    assert sorted(load_body(body).provenance["regions"]) == ["hole", "top"]


def test_faces_as_json_and_by_query(folder, capsys):
    run("faces", folder / "plate4.step", "--json")
    values = json.loads(capsys.readouterr().out)
    assert [len(feature["faces"]) for feature in values["features"]].count(4) == 4
    run("faces", folder / "plate4.step", "--find", "bore r=6 near 45,25,0", "--find", "plane z=5")
    assert capsys.readouterr().out.splitlines() == [
        "bore r=6 near 45,25,0: surface_19, surface_20, surface_21, surface_22",
        "plane z=5: surface_3",
    ]


def test_solids_are_glued_or_chosen(folder, capsys):
    run("mesh", folder / "stack.step", "--size", 10, code=2)
    assert "--glue" in capsys.readouterr().err
    run("mesh", folder / "stack.step", "--size", 10, "--glue")
    run("mesh", folder / "stack.step", "--size", 10, "--solid", "volume_2")
    assert "(0.02, 0.02, 0.01) m" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("faces", "nowhere.step"), "does not exist"),
        (("info", "plate4.step"), "is not a body file but, by its ending, a CAD file"),
        (("faces", "plate4.step", "--unit", "m"), "declares that its numbers are mm"),
        (("faces", "plate4.step", "--find", "bore r=7"), "finds no face. Near are"),
        (("faces", "plate4.msh", "--glue"), "meshed already"),
        (("mesh", "plate4.msh", "--order", "2"), "so an order of the elements has no effect; leave it out"),
        (("faces", "plate4.step", "--page", "plate4.step"), "it is written as .html, not .step"),
        (("rigid", "plate4.step", "-o", "a.ffr"), "give the density, such as --density 7850, or a --material"),
        (("rigid", "plate4.step", "--density", "1", "--material", "steel", "-o", "a.ffr"), "give the density"),
        (("rigid", "plate4.step", "--density", "-1", "-o", "a.ffr"), "must be positive"),
        (("rigid", "plate4.step", "--density", "1", "--interface", "a=top", "-o", "a.ffr"), "there is no face 'top'"),
        (("mesh", "plate4.step", "--size", "0.01"), "A size of"),
        (("mesh", "plate4.step", "--most-elements", "0"), "most_elements is 0"),
        (
            ("reduce", "plate4.step", "--material", "steel", "--region", "bore r=6", "-o", "a.ffr"),
            'give it a name, such as --region "top=bore r=6"',
        ),
        (
            ("reduce", "plate4.step", "--material", "steel", "--region", "a=bore*", "--region", "a=b", "-o", "a.ffr"),
            "a name is given twice",
        ),
        (
            ("reduce", "plate4.step", "--material", "steel", "--interface", "bore r=6", "-o", "a.ffr"),
            'give it a name as well, such as --interface "bore=bore r=6"',
        ),
        (
            ("reduce", "plate4.step", "--material", "steel", "--interface", "a=bore r=6", "-o", "a.ffr"),
            "interface 'a': 'bore r=6' finds 4 bores",
        ),
    ],
)
def test_what_cannot_be_used_is_told(arguments, message, folder, monkeypatch, capsys):
    monkeypatch.chdir(folder)
    run(*arguments, code=2)
    said = capsys.readouterr().err
    assert said.startswith("ffr-prep: ")
    assert message in said
    assert not (folder / "a.ffr").exists()
