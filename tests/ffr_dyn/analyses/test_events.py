"""Events: found at the right time and on the right side, as accurately as the motion; a run that ends at one."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from synthetic import cloud

from ffr_dyn import cli
from ffr_dyn.analyses.events import Event
from ffr_dyn.analyses.forward import forward
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.analyses.run import run
from ffr_dyn.functions.time_functions import polynomial
from ffr_dyn.integrators import RK4, ROS2, DormandPrince
from ffr_dyn.integrators.stabilisation import Projection
from ffr_dyn.integrators.tolerances import tolerances
from ffr_dyn.results.file import load_result
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_dyn.scene_file.read import load_scene
from ffr_dyn.scene_file.write import to_toml
from ffr_prep.body import rigid_body
from ffr_prep.common.errors import InputError

BALL = rigid_body("ball", mass=1.0, inertia=(1, 1, 1), points={"c": (0, 0, 0)})
THROWN = Scene((Body("ball", BALL, velocity=(1, 3, 0)),), gravity=(0, -10, 0))
SPUN = Scene(
    (Body("ball", BALL, omega_bar=(0, 0, 50)),),
    (Joint("axle", "revolute", "ground.O", "ball.c"),),
    ground={"O": (0, 0, 0)},
)


def swinging() -> Scene:
    arm = cloud(3)
    return Scene(
        (Body("arm", arm),), (Joint("hinge", "revolute", "ground.O", "arm.a"),),
        ground={"O": arm.interfaces[0].position}, gravity=(0, -9.81, 0),
    )  # fmt: skip


def times(result, name: str | None = None) -> list[float]:
    return [event["time"] for event in result.attributes["events"] if name in (None, event["event"])]


@pytest.mark.parametrize("method", [RK4(0.03), ROS2(0.03)], ids=repr)
def test_free_fall_to_the_last_digits(method):
    """y = 3 t - 5 t^2, which both methods integrate exactly, passes 0.35 at 0.2 -+ sqrt(0.02): up, and down again."""
    root = 0.3 - np.sqrt(0.09 - 0.07), 0.3 + np.sqrt(0.09 - 0.07)
    events = (
        Event("up", "ball.c.position.y", 0.35, direction="rising"),
        Event("down", "ball.c.position.y", 0.35, direction="falling"),
        Event("both", "ball.c.position.y", 0.35),
        Event("top", "ball.v.y"),
        Event("never", "ball.c.position.y", 0.46),
    )
    result = integrate(THROWN, end=0.6, output_step=0.3, method=method, events=events)
    for name, expected in (("up", root[:1]), ("down", root[1:]), ("both", root), ("top", (0.3,)), ("never", ())):
        np.testing.assert_allclose(times(result, name), expected, rtol=0, atol=4e-16, err_msg=name)
    first = result.attributes["events"][0]
    assert first["rising"] is True
    np.testing.assert_allclose(first["x"][:2], (root[0], 0.35), rtol=0, atol=1e-15)
    assert times(result) == sorted(times(result))
    plain = integrate(THROWN, end=0.6, output_step=0.3, method=method)
    np.testing.assert_array_equal(result["ball.R"], plain["ball.R"])
    assert "events" not in plain.attributes


def test_a_run_ends_at_an_event(tmp_path):
    ground = Event("ground", "ball.c.position.y", -1.0, direction="falling", stop=True)
    after = Event("after", "ball.c.position.y", -1.001, direction="falling")
    before = Event("before", "ball.c.position.x", 0.2)
    path = tmp_path / "fall.nc"
    result = integrate(THROWN, end=3, output_step=0.1, method=RK4(0.05), events=(after, ground, before), path=path)
    end = 0.3 + np.sqrt(0.09 + 0.2)
    np.testing.assert_allclose(result.time, [*np.arange(9) / 10, end], atol=1e-15)
    np.testing.assert_allclose(result["ball.c.position"][-1], (end, -1, 0), atol=1e-14)
    assert [event["event"] for event in result.attributes["events"]] == ["before", "ground"]
    read = load_result(path)
    np.testing.assert_array_equal(read["ball.c.position"], result["ball.c.position"])
    assert read.attributes["events"] == result.attributes["events"]


def test_the_error_of_a_run_that_ends_at_an_event_is_that_up_to_it():
    """No row of the event lies beside one of a run that went on: the error told was a third of the range."""
    event = Event("far", "hinge.angle", 1.1, stop=True)
    short, fine = (
        forward(swinging(), end=1.0, output_step=0.05, method=RK4(step), events=[event]) for step in (0.0125, 0.00125)
    )
    assert short.time.size == fine.time.size < 21
    for name, (told, _) in short.attributes["errors"].items():
        true = np.abs(short[name] - fine[name]).max()
        assert true <= 3.0 * told + 1e-10, name
    assert short.attributes["errors"]["arm.R"][1] < 1e-3


def test_what_would_fail_after_the_event_that_ends_a_run_is_not_run():
    rope = Joint("rope", "distance", "ground.O", "ball.c", length=polynomial(1.0, -1.0))
    scene = Scene((Body("ball", BALL, position=(1, 0, 0)),), (rope,), ground={"O": (0, 0, 0)})
    wound = Event("wound", "ball.R.x", 0.5, stop=True)
    result = forward(scene, end=2.0, output_step=0.1, events=[wound])
    assert times(result) == pytest.approx([0.5], abs=1e-9)
    assert result.attributes["errors"]["ball.R"][0] < 1e-6


def test_a_python_function_and_a_quantity_give_the_same_moment():
    events = (
        Event("quantity", "arm.b.position.y", -0.3, direction="falling"),
        Event("function", lambda t, state: state.position("arm.b")[1] + 0.3, 0.0, direction="falling"),
    )
    result = integrate(swinging(), end=0.6, output_step=0.1, method=ROS2(2e-3), events=events)
    one, two = times(result, "quantity"), times(result, "function")
    assert len(one) >= 1
    np.testing.assert_allclose(one, two, rtol=0, atol=1e-14)


def test_events_converge_with_the_order_of_the_method():
    fine = integrate(swinging(), end=0.5, output_step=0.5, method=RK4(1e-4), stabilisation=Projection(1e-13),
                   events=(EVENT,))  # fmt: skip
    errors = [
        abs(times(integrate(swinging(), end=0.5, output_step=0.5, method=RK4(h), stabilisation=Projection(1e-13),
                          events=(EVENT,)))[0] - times(fine)[0])
        for h in (1e-3, 5e-4)
    ]  # fmt: skip
    assert errors[0] > 5e-11  # far above rounding
    assert 12 < errors[0] / errors[1] < 24


EVENT = Event("low", "arm.b.position.y", -0.3, direction="falling")


def test_events_of_a_method_that_chooses_its_steps():
    fine = integrate(swinging(), end=0.5, output_step=0.5, method=RK4(1e-4), events=(EVENT,))
    result = integrate(swinging(), end=0.5, output_step=0.1, method=DormandPrince(tolerances(1e-9)), events=(EVENT,))
    np.testing.assert_allclose(times(result), times(fine), atol=1e-8)


def test_angles_are_unwound():
    """50 rad/s pass 10 rad once, at 0.2 s, and -1 rad never."""
    events = (Event("ten", "axle.angle", 10.0), Event("less", "axle.angle", -1.0), Event("c", "axle.angle", np.pi))
    result = integrate(SPUN, end=0.4, output_step=0.1, method=RK4(1e-3), events=events)
    np.testing.assert_allclose(times(result, "ten"), [0.2], atol=1e-9)
    np.testing.assert_allclose(times(result, "c"), [np.pi / 50], atol=1e-9)
    assert times(result, "less") == []


def test_mistakes_are_named(tmp_path):
    with pytest.raises(InputError, match="direction is 'up'"):
        Event("e", "ball.c.position.y", direction="up")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="the value is nan"):
        Event("e", "ball.c.position.y", np.nan)
    for quantity in ("ball.c.positon.y", "ball.c.position", "ball.c.position.w"):
        with pytest.raises(InputError, match=r"no number of the scene; did you mean .*ball\.c\.position"):
            integrate(THROWN, end=0.1, output_step=0.1, method=RK4(0.1), events=(Event("e", quantity),))
    with pytest.raises(InputError, match="cannot be resumed"):
        integrate(THROWN, end=0.1, output_step=0.1, method=RK4(0.1), events=(EVENT_UP,), resume=tmp_path / "r.nc")


EVENT_UP = Event("up", "ball.v.y")


# ---- scene files ------------------------------------------------------------------------------------------------------

FILE = """
gravity = [0, -10, 0]
[analysis]
end = 1.0
output_step = 0.1
step = 0.05
method = "rk4"
[analysis.events]
low = {quantity = "ball.c.position.y", value = "-100 mm", direction = "falling", stop = true}
top = {quantity = "ball.v.y"}
[bodies.ball]
mass = 1.0
inertia = [1, 1, 1]
velocity = [0, 3, 0]
points = {c = [0, 0, 0]}
"""


def test_events_of_a_file(tmp_path, monkeypatch, capsys):
    path = tmp_path / "scene.toml"
    path.write_text(FILE, encoding="utf-8")
    scene, settings = load_scene(path)
    result = run(scene, settings)
    np.testing.assert_allclose(times(result), (0.3, 0.3 + np.sqrt(0.09 + 0.02)), atol=1e-15)
    assert result.time[-1] == times(result)[-1]
    path.write_text(to_toml(scene, settings), encoding="utf-8")
    assert load_scene(path)[1].analysis == settings.analysis
    monkeypatch.setattr(sys, "argv", ["ffr-dyn", "run", str(path)])
    cli.main()
    assert "event        top at t = 0.3 s\nevent        low at t = 0.631662" in capsys.readouterr().out


def test_mistakes_in_the_events_of_a_file(tmp_path):
    path = tmp_path / "scene.toml"
    for old, new, words in (("falling", "down", "'rising'"), ("quantity", "quantiy", "did you mean 'quantity'")):
        path.write_text(FILE.replace(old, new), encoding="utf-8")
        with pytest.raises(InputError, match=r"analysis\.events\.(low|top)") as caught:
            load_scene(path)
        assert words in str(caught.value)
