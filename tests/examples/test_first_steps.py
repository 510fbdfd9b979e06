"""docs/first_steps.md as it is written there: a new user's way from a STEP file of another program to film and stress."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys

import numpy as np
import pytest
from places import REFERENCE, ROOT
from test_pages import MAIN

import ffr_dyn as fd
from ffr_dyn.results.file import load_result

PAGE = (ROOT / "docs" / "first_steps.md").read_text(encoding="utf-8")
COMMANDS = re.findall(r"```sh\n(.*?)```", PAGE, re.S)[0]
PROGRAM = re.findall(r"```python\n(.*?)```", PAGE, re.S)[0]
PAGES = ("faces.html", "scene.html", "film.html")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with the STEP file alone."""
    monkeypatch.chdir(tmp_path)
    shutil.copy(REFERENCE / "plate.step", tmp_path)
    return tmp_path


def assert_made(folder):
    """Pages that ask for nothing, of a size that can be sent, and the picture of the stress."""
    for name in PAGES:
        text = (folder / name).read_text(encoding="utf-8")
        assert not re.search(r"""(?:src|href)\s*=\s*["']?https?:""", text)
        assert len(text) < 2e6
    assert (folder / "stress" / "plate.png").stat().st_size > 10_000
    assert (folder / "stress" / "hot_spots.csv").stat().st_size > 100


def typed(commands):
    """The commands of a text for the shell, each without its comment and with the file that it writes."""
    found = re.findall(r"^.*<<END.*\n(?:.*\n)*?END\n|^.+$", commands.replace("\\\n", " "), flags=re.M)
    return [re.sub(r" +#.*", "", one, count=1).strip() for one in found]


@pytest.mark.slow
def test_the_commands(folder, monkeypatch, capsys):
    assert 8 < len(typed(COMMANDS)) <= 12
    for command in typed(COMMANDS):
        program = MAIN.get(command.partition(" ")[0])
        if program is None:
            subprocess.run(["bash", "-euc", command], check=True)
        else:
            monkeypatch.setattr(sys, "argv", shlex.split(command))
            program()  # which leaves this process where it fails
    said_by_all, errors = capsys.readouterr()
    assert "Traceback" not in errors
    assert_made(folder)
    assert "warning " not in said_by_all
    for said in ("bore r 6", "pin  rigid  at (-0.045, -0.025, 0.005) m", "accuracy", "hot spots", "plate.tip.position"):
        assert said in said_by_all
    offered = said_by_all.partition("\nmesh ")[0]  # by `faces`
    assert {region in offered for region in re.findall(r"cylinder r=6mm at [-\d,]+", COMMANDS)} == {True}
    result = load_result(folder / "plate.nc")
    assert_swings(result)


@pytest.mark.slow
def test_the_program(folder):
    assert len([line for line in PROGRAM.splitlines() if line.strip()]) <= 25
    space: dict = {}
    exec(compile(PROGRAM, "docs/first_steps.md", "exec"), space)
    assert_made(folder)
    assert_swings(space["result"])


def assert_hottest_at_the_pin(result):
    """Where the plate hangs, with the stress that thirty modes show too, 39 kPa; nothing of its inertia is left out."""
    (spot,) = fd.hot_spots(result, count=1)
    assert np.linalg.norm(np.subtract(spot.position[:2], (-0.045, -0.025))) < 0.0065
    assert spot.value == pytest.approx(39.0e3, rel=0.03)
    assert fd.stress_error(result, "plate") < 1.0


def assert_swings(result):
    """As a rigid plate of this shape does: its tip stays at its distance, and falls in the time that energy says."""
    tip = result["plate.tip.position"]
    np.testing.assert_allclose(np.linalg.norm(tip, axis=1), np.hypot(0.09, 0.05), rtol=1e-4)
    total, kinetic = result["energy.total"], result["energy.kinetic"]
    assert np.ptp(total) < 1e-3 * kinetic.max()
    errors = {name: of_range for name, (_, of_range) in result.attributes["errors"].items()}
    assert errors["plate.tip.position"] < 1e-3
    # A vibration of 8 kHz is a part of it, and told: 0.1 to 0.4 % for pins that are a micrometre apart, where RK4 with steps
    # of 0.6 us is 0.05 % away. The worst moment is one of 1e-9 N m, across the hinge.
    assert errors["hinge.force"] < 5e-3
    worst = re.search(r"forces and moments within ([\d.]+) %", result.attributes["accuracy"])
    assert worst is not None
    assert float(worst[1]) == pytest.approx(100 * max(errors["hinge.force"], errors["hinge.moment"]), rel=0.05)
    assert_hottest_at_the_pin(result)
    assert any("does not resolve carries" in note for note in result.attributes["notes"])
