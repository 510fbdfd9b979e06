"""The commands of the analyses, from a scene file to a result file; and what they say about a wrong one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from ffr_dyn.cli import cli
from ffr_dyn.cli.analyses import force_of
from ffr_dyn.results.file import load_result
from ffr_prep.common.errors import InputError

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


def written(said: str) -> Path | None:
    """The result file that a command tells of."""
    names = [line.removeprefix("result       ") for line in said.splitlines() if line.startswith("result       ")]
    return Path(names[-1]) if names else None


@pytest.fixture
def run(tmp_path):
    """Run a command on the scene with or without its driver; gives what it printed, and the result file."""

    def go(command: str, *options: str, driven: bool = True):
        file = tmp_path / "rod.toml"
        file.write_text(SCENE + (DRIVER if driven else ""))
        said = CliRunner().invoke(cli, [command, str(file), *options], catch_exceptions=False).output
        return said, written(said)

    return go


def test_another_analysis_does_not_replace_the_result_of_the_files_own(run, tmp_path):
    assert run("run", driven=False)[1] == tmp_path / "rod.nc"
    assert run("linearise", driven=False)[1] == tmp_path / "rod.linearise.nc"
    assert load_result(tmp_path / "rod.nc").attributes["analysis"].startswith("forward")


def test_check(run):
    assert "free         hinge.angle: moves rod" in run("check", driven=False)[0]
    assert "0 rigid degrees of freedom" in run("check")[0]


def test_forward_says_the_plane_and_takes_a_quasi_static_start(run):
    said, file = run("forward", "--quasi-static")
    assert "computed     in the plane, normal z" in said
    assert "computed     in the plane, normal z" in run("check")[0]
    np.testing.assert_allclose(load_result(file)["rod.omega_bar"][:, 2], 2.0, atol=1e-9)


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


def test_assemble_writes_the_start_and_tells_what_was_changed(run):
    said, file = run("assemble", "--time", "0.1")
    assert "body 'rod' was changed: position by 0" not in said
    assert "body 'rod' was changed: attitude by 0.5 rad, angular velocity by 2 rad/s" in said
    result = load_result(file)
    assert result.time.tolist() == [0.1]
    np.testing.assert_allclose(result["rod.tip.position"][0], (2 * np.cos(0.5), 2 * np.sin(0.5), 0), atol=1e-12)
    np.testing.assert_allclose(result["rod.omega_bar"][0], (0, 0, 2), atol=1e-12)
    said, _ = run("assemble", driven=False)
    assert "nothing was changed" in said


# ---- what the file says -----------------------------------------------------------------------------------------------

KINDS = {
    "kinematic": 'kind = "kinematic"',
    "inverse": 'kind = "inverse"',
    "quasi-static": 'kind = "inverse"\nelastic = "quasi-static"',
    "mixed": 'kind = "mixed"\nunknown.m = {joint = "hinge"}',
}
TIMES = 'end = 0.5\noutput_step = 0.05\nstep = 0.005\nmethod = "rk4"\n'
AT_A_TIME = {
    "assemble": 'kind = "assemble"\n',
    "static": 'kind = "static"\n',
    "linearise": 'kind = "linearise"\nat_equilibrium = true\nquantities = ["rod.tip.position.x"]\n'
    'inputs.m = {joint = "hinge"}\n',
}


@pytest.fixture
def run_file(tmp_path):
    """Run a command on a scene file with an analysis; gives the exit, what it printed, and the result file."""

    def go(analysis: str, command: str, *options: str, driven: bool = True):
        file = tmp_path / "rod.toml"
        text = SCENE.replace(TIMES, analysis) + (DRIVER if driven else "")
        file.write_text(text.replace("mass = 1.0", 'mass = "m"') + "[parameters]\nm = 1.0\n")
        done = CliRunner().invoke(cli, [command, str(file), *options])
        return done.exception, done.output, written(done.output)

    return go


@pytest.mark.parametrize("kind", KINDS)
def test_run_does_what_the_file_says(run_file, kind):
    times = "end = 0.5\noutput_step = 0.05\n" if kind == "kinematic" else TIMES
    failed, _, file = run_file(f"{KINDS[kind]}\n{times}", "run", "-p", "m=2.0", "--keep", "rod.tip.acceleration")
    assert failed is None
    result = load_result(file)
    assert result.attributes["analysis"].split()[0] == kind.replace("quasi-static", "inverse")
    accompanying = {"rod.tip.acceleration", "motor.effort", "motor.power", "hinge.angle_rate", "m.effort", "m.power"}
    assert "rod.tip.acceleration" in result.quantities
    assert set(result.quantities) <= accompanying
    np.testing.assert_allclose(result["motor.effort"], 2 * 9.81 * np.cos(0.3 + 2 * result.time), atol=1e-6)
    if kind == "mixed":
        np.testing.assert_array_equal(result["m.effort"], result["motor.effort"])


@pytest.mark.parametrize("kind", AT_A_TIME)
def test_run_of_a_file_without_times(run_file, kind):
    failed, said, file = run_file(AT_A_TIME[kind], "run", driven=False)
    assert failed is None
    if kind == "assemble":
        assert "nothing was changed" in said
        assert load_result(file)["rod.tip.position.x"][0] == pytest.approx(2)
    elif kind == "static":
        assert "equilibrium  stable" in said
        assert load_result(file)["rod.tip.position.y"][0] == pytest.approx(-2, abs=1e-9)
    else:
        assert load_result(file)["B"].shape == (1, 2, 1)
        assert load_result(file)["C"].shape == (1, 1, 2)


def test_a_command_goes_before_the_file(run_file):
    mixed = f"{KINDS['mixed']}\n{TIMES}"
    for command, name in (
        ("forward", "forward"),
        ("inverse", "inverse"),
        ("kinematic", "kinematic"),
        ("mixed", "mixed"),
    ):
        failed, _, file = run_file(mixed, command)
        assert failed is None
        assert load_result(file).attributes["analysis"].startswith(name)
    failed, _, file = run_file(mixed, "static", "--time", "0.1", "--keep", "rod.tip.position")
    assert failed is None
    assert set(load_result(file).quantities) == {"rod.tip.position", "motor.effort", "motor.power", "hinge.angle_rate"}
    assert load_result(file)["rod.tip.position.x"][0] == pytest.approx(2 * np.cos(0.5), abs=1e-9)
    failed, _, file = run_file(AT_A_TIME["static"], "kinematic", "--end", "0.1", "--output-step", "0.05")
    assert failed is None
    np.testing.assert_allclose(load_result(file).time, (0, 0.05, 0.1))
    failed, said, _ = run_file(AT_A_TIME["static"], "check", "-p", "m=3", "--time", "0.2")
    assert failed is None
    assert "0 rigid degrees of freedom" in said


@pytest.mark.parametrize(
    ("analysis", "command", "words"),
    [
        (AT_A_TIME["static"], ["inverse"], "no times"),
        (AT_A_TIME["static"], ["run", "--end", "1"], "static analysis has no end"),
        (AT_A_TIME["static"], ["inverse", "--end", "1"], "or --end and --output-step"),
        (AT_A_TIME["static"], ["run", "--output-step", "1"], "static analysis has no output-step"),
        (KINDS["kinematic"] + "\nend = 0.5\noutput_step = 0.05\n", ["run", "--step", "0.1"], "kinematic analysis has no"),
        (AT_A_TIME["linearise"], ["run", "--resume"], "only a forward run"),
        (KINDS["inverse"] + "\n" + TIMES, ["run", "--resume"], "only a forward run"),
        (TIMES, ["mixed"], "--unknown"),
        (TIMES, ["static", "-p", "m"], "NAME=VALUE"),
        (TIMES, ["kinematic", "--keep", "rod.tip.positoin"], "did you mean rod.tip.position"),
        (TIMES, ["static", "--keep", "rod.tip.positoin"], "did you mean rod.tip.position"),
        (TIMES, ["inverse", "--quasi-static", "--keep", "rod.tip.positoin"], "did you mean rod.tip.position"),
    ],
)  # fmt: skip
def test_what_does_not_fit_the_file_is_refused(run_file, analysis, command, words):
    failed, _, file = run_file(analysis, *command)
    assert isinstance(failed, InputError)
    assert words in str(failed)
    assert not file.exists()


def test_forces_away_from_the_motion_refuse_unknown_quantities_first(run_file):
    unknown = "f=rod.tip:0,1,0"
    failed, _, file = run_file(TIMES, "mixed", "--unknown", unknown, "--keep", "rod.nothing")
    assert isinstance(failed, InputError)
    assert "rod.nothing" in str(failed)
    failed, _, file = run_file(TIMES, "mixed", "--unknown", unknown, "--keep", "rod.tip.acceleration")
    assert failed is None
    np.testing.assert_allclose(load_result(file)["f.effort"], 9.81 / 2, atol=1e-7)
