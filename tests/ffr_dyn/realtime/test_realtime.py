"""Times of steps against a deadline: what the numbers mean, the report, the picture, the command."""

from __future__ import annotations

import gc
import json
import sys

import numpy as np
import pytest

from ffr_dyn import cli
from ffr_dyn.integrators import ROS2
from ffr_dyn.realtime.deadline import Timing, as_json, lines, measure_steps, plot_times
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import rigid_body
from ffr_prep.common.errors import InputError

BAR = rigid_body("bar", mass=1.0, inertia=(0.1, 0.1, 0.1), centre_of_mass=(0.5, 0, 0), points={"a": (0, 0, 0)})
PENDULUM = Scene(
    (Body("bar", BAR),), (Joint("hinge", "revolute", "ground.O", "bar.a"),), ground={"O": (0, 0, 0)},
    gravity=(0, -9.81, 0), name="pendulum",
)  # fmt: skip


def timing(microseconds: np.ndarray) -> Timing:
    return Timing(1e-6 * microseconds, 100e-6, 1e-3, "scene", "ROS2(step=0.001)")


@pytest.mark.parametrize(
    ("late", "soft", "hard"), [(0, True, True), (1, True, False), (10, True, False), (11, False, False)]
)
def test_soft_and_hard_real_time(late, soft, hard):
    """10 000 steps, so ten of them are the last 0.1 %."""
    found = timing(np.concatenate([np.full(10_000 - late, 20.0), np.full(late, 101.0)]))
    assert (found.late, found.holds_soft, found.holds_hard) == (late, soft, hard)
    assert found.mean == pytest.approx(1e-6 * (20 * (10_000 - late) + 101 * late) / 10_000)
    assert found.worst == pytest.approx(101e-6 if late else 20e-6)


def test_the_report_says_what_holds():
    text = "\n".join(lines(timing(np.array([50.0, 60.0, 150.0]))))
    for words in (
        "3 steps of 0.001 s",
        "worst 150.0 us",
        "deadline 100.0 us",
        "soft         real time does not",
        "1 of 3",
    ):
        assert words in text
    data = json.loads(json.dumps(as_json(timing(np.arange(1.0, 101.0)))))
    assert data["quantiles"]["0.9"] == pytest.approx(90e-6)
    assert (data["steps"], data["soft"], data["hard"]) == (100, True, True)


@pytest.mark.parametrize("paced", [False, True])
def test_every_step_is_measured(paced):
    found = measure_steps(PENDULUM, ROS2(1e-3), duration=0.05, paced=paced, outputs=("hinge.angle",))
    assert found.seconds.shape == (50,)
    assert (found.seconds > 0).all()
    assert found.deadline == 1e-3
    assert gc.isenabled()
    assert gc.get_freeze_count() == 0


@pytest.mark.parametrize(("duration", "deadline"), [(0.0, None), (1e-4, None), (np.nan, None), (1.0, 0.0), (1.0, -1.0)])
def test_times_that_are_none_are_refused(duration, deadline):
    with pytest.raises(InputError, match="step's length at least"):
        measure_steps(PENDULUM, ROS2(1e-3), duration=duration, deadline=deadline)


def test_the_picture(tmp_path):
    path = plot_times(timing(np.random.default_rng(0).gamma(20, 2, 10_000)), tmp_path / "steps.png")
    assert path.stat().st_size > 10_000


SCENE = """
name = "pendulum"
gravity = [0, -9.81, 0]
[inputs]
torque = 0.0
[analysis]
end = 1.0
output_step = 0.01
[ground]
O = [0, 0, 0]
[bodies.bar]
mass = 1.0
inertia = [0.1, 0.1, 0.1]
centre_of_mass = [0.5, 0, 0]
points = {a = [0, 0, 0]}
[joints.hinge]
kind = "revolute"
i = "ground.O"
j = "bar.a"
[forces.motor]
kind = "actuator"
joint = "hinge"
force = "torque"
"""


def run(monkeypatch, *arguments: str) -> int:
    monkeypatch.setattr(sys, "argv", ["ffr-dyn", *map(str, arguments)])
    try:
        cli.main()
    except SystemExit as left:
        return int(left.code or 0)
    return 0


@pytest.mark.slow
def test_the_command(tmp_path, monkeypatch, capsys):
    scene, picture = tmp_path / "scene.toml", tmp_path / "steps.png"
    scene.write_text(SCENE, encoding="utf-8")
    assert run(monkeypatch, "realtime", scene, "--duration", "0.02", "--plot", picture) == 0
    out = capsys.readouterr().out
    assert "20 steps of 0.001 s, ROS2(step=0.001)" in out
    assert picture.exists()
    assert run(monkeypatch, "realtime", scene, "--step", "1e-4", "--duration", "0.01", "--method", "rk4", "--json") == 0
    assert json.loads(capsys.readouterr().out)["method"] == "RK4(step=0.0001)"
    for wrong, words in ((("--method", "euler"), "no such method"), (("--output", "bar.x"), "none of the scene's")):
        assert run(monkeypatch, "realtime", scene, *wrong) == 2
        assert words in capsys.readouterr().err
