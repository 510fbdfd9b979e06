"""The commands of the analyses, from a scene file to a result file; and what they say about a wrong one."""

from __future__ import annotations

import numpy as np
import pytest
from click.testing import CliRunner

from ffr_dyn.cli import cli
from ffr_dyn.cli_analyses import force_of
from ffr_dyn.errors import InputError
from ffr_dyn.result_file import load_result

SCENE = """
name = "rod"
gravity = [0, -9.81, 0]
[analysis]
end = 0.5
output_step = 0.05
step = 0.005
method = "rk4"
[ground]
hinge = [0, 0, 0]
[bodies.rod]
mass = 1.0
inertia = [0.01, 0.333333333333, 0.333333333333]
centre_of_mass = [1, 0, 0]
points.hinge = [0, 0, 0]
points.tip = [2, 0, 0]
[joints.hinge]
kind = "revolute"
i = "ground.hinge"
j = "rod.hinge"
"""
DRIVER = """
[drivers.motor]
joint = "hinge"
function = "0.3 + 2 * t"
"""


@pytest.fixture
def run(tmp_path):
    """Run a command on the scene with or without its driver; gives what it printed, and the result file."""

    def go(command: str, *options: str, driven: bool = True):
        file = tmp_path / "rod.toml"
        file.write_text(SCENE + (DRIVER if driven else ""))
        return CliRunner().invoke(
            cli, [command, str(file), *options], catch_exceptions=False
        ).output, tmp_path / "rod.nc"

    return go


def test_check(run):
    assert "free         hinge.angle: moves rod" in run("check", driven=False)[0]
    assert "0 degrees of freedom" in run("check")[0]


def test_kinematic_inverse_and_mixed_agree(run):
    moments = []
    for command in (
        ("kinematic",),
        ("inverse",),
        ("inverse", "--quasi-static"),
        ("mixed", "--unknown", "m=hinge.angle"),
    ):
        said, file = run(*command)
        assert f"result       {file}" in said
        moments.append(load_result(file)["motor.effort"])
    angle = 0.3 + 2 * load_result(file).time
    for moment in moments:
        np.testing.assert_allclose(moment, 9.81 * np.cos(angle), atol=1e-6)
    np.testing.assert_array_equal(load_result(file)["m.effort"], moments[-1])


def test_static_and_linearise(run):
    said, file = run("static", driven=False)
    assert "equilibrium  stable" in said
    assert load_result(file)["rod.tip.position"][0, 1] == pytest.approx(-2, abs=1e-9)
    said, file = run(
        "linearise", "--at-equilibrium", "--input", "m=hinge.angle", "--quantity", "rod.tip.position.x", driven=False
    )
    frequency = np.sqrt(9.81 / (4 / 3)) / 2 / np.pi
    assert f"{frequency:.5g}"[:5] in said
    assert load_result(file)["B"].shape == (1, 2, 1)


@pytest.mark.parametrize("text", ["hinge.angle", "m=rod.tip:1,a,0", "m=hinge.turn", "=x.angle"])
def test_a_force_that_is_none(text):
    with pytest.raises(InputError):
        force_of(text)
