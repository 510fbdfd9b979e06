"""Events: found at the right time and on the right side, as accurately as the motion; a run that ends at one."""

from __future__ import annotations

import sys
from functools import partial

import numpy as np
import pytest
from planar_beam import planar_beam
from scipy.integrate import solve_ivp
from synthetic import cloud

from ffr_dyn import cli
from ffr_dyn.analyses import integration, registry
from ffr_dyn.analyses.events import Event
from ffr_dyn.analyses.forward import forward
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.analyses.run import run
from ffr_dyn.functions.formula import formula
from ffr_dyn.functions.time_functions import polynomial
from ffr_dyn.integrators import HHT, RK4, ROS2, ROS3, DormandPrince, GeneralisedAlpha, Within
from ffr_dyn.integrators.stabilisation import Projection
from ffr_dyn.integrators.tolerances import tolerances
from ffr_dyn.results.file import load_result
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.forces import Load
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_dyn.scene.sensors import Measurement
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


@pytest.mark.parametrize("top", [0.325, 0.02])
@pytest.mark.parametrize("below", [1e-3, 1e-9])
def test_a_value_that_is_passed_twice_within_a_step_is_an_event_twice(below, top):
    """y = 10 top t - 5 t^2 is highest at `top`, within a step of 0.05, the first one, too, and less than a step over the
    value: both moments were missed, and so was the end of a run at one."""
    ball = Body("ball", BALL, velocity=(1, 10 * top, 0))
    value, half = 5 * top**2 - below, np.sqrt(below / 5)
    y = "ball.c.position.y"
    events = (
        Event("up", y, value, direction="rising"),
        Event("down", y, value, direction="falling"),
        Event("both", y, value),
        Event("never", y, 5 * top**2 + 1e-9),
        Event("function", lambda t, state: state.position("ball.c")[1], value),
    )
    run = partial(integrate, Scene((ball,), gravity=(0, -10, 0)), end=0.75, output_step=0.25, method=RK4(0.05))
    result, root = run(events=events), (top - half, top + half)
    for name, expected in (("up", root[:1]), ("down", root[1:]), ("both", root), ("never", ()), ("function", root)):
        np.testing.assert_allclose(times(result, name), expected, rtol=0, atol=1e-11, err_msg=name)
    assert [event["rising"] for event in result.attributes["events"] if event["event"] == "both"] == [True, False]
    ended = run(events=[Event("down", y, value, direction="falling", stop=True)])
    assert ended.time[-1] == pytest.approx(root[1], abs=1e-11)


@pytest.mark.parametrize("method", [RK4(0.01), ROS2(0.01), DormandPrince()], ids=lambda one: type(one).__name__)
def test_what_happens_in_a_pulse_within_a_step_is_an_event(method):
    """A force of F exp(-((t - t0) / s)^2) on a ball of 1 kg is its acceleration, which passes a limit at t0 -+ s sqrt(ln(F /
    limit)): within a twentieth of a step, at the ends of which it is zero. A run that was to end there went on."""
    t0, s = 0.0437, 2.5e-4
    force = formula(f"1000 * exp(-((t - {t0}) / {s})**2)")
    scene = Scene((Body("ball", BALL),), loads=(Load("shock", "ball.c", force=(force, 0.0, 0.0)),))
    x = "ball.c.acceleration.x"
    events = [Event("limit", x, 300.0), Event("end", x, 300.0, direction="falling", stop=True), Event("no", x, 1001.0)]
    result = forward(scene, end=0.2, output_step=0.02, method=method, events=events, check=False)
    half = s * np.sqrt(np.log(1000 / 300))
    np.testing.assert_allclose(times(result, "limit"), [t0 - half, t0 + half], rtol=0, atol=1e-14)
    assert times(result, "no") == []
    assert result.time[-1] == pytest.approx(t0 + half, abs=1e-14)


@pytest.mark.parametrize("rows", [1, 50])
def test_moments_of_work_are_of_the_order_of_the_method(monkeypatch, rows):
    """Of a ball of 1 kg under 10 N cos 3 t: its work is (10/3 sin 3 t)^2 / 2. Rows at which a run looks at once were counted
    twice: the moment was of order two, and changed with the rows that the machine had time for (7.6e-5 s, 1.4e-4 s)."""
    monkeypatch.setattr(integration, "MOST_ROWS", rows)
    scene = Scene((Body("ball", BALL),), loads=(Load("push", "ball.c", force=(formula("10 * cos(3 * t)"), 0.0, 0.0)),))
    works = np.array([1.0, 1.7, 2.3, 3.0, 3.3, 4.1])
    events = [Event(f"{work}", "push.work", work, direction="rising") for work in works]
    true = np.arcsin(np.sqrt(works * 9 / 50)) / 3
    coarse, fine = (
        np.abs(np.array(times(integrate(scene, end=0.5, output_step=0.1, method=RK4(h), events=events))) - true).max()
        for h in (0.01, 0.005)
    )
    assert coarse < 1e-7
    assert coarse > 12 * fine


@pytest.mark.parametrize("rows", [1, 50])
def test_the_work_up_to_the_event_that_ends_a_run_is_that_of_the_method(monkeypatch, rows):
    """The last step is shorter: by the rule of equal ones the last work was up to 1.1e-4 J off, a hundred times as far as
    those before it. Free of other forces the ball has it as its kinetic energy."""
    monkeypatch.setattr(integration, "MOST_ROWS", rows)
    scene = Scene((Body("ball", BALL),), loads=(Load("push", "ball.c", force=(formula("10 * cos(3 * t)"), 0.0, 0.0)),))
    for x in (0.3, 0.41, 0.55):
        event, kept = Event("there", "ball.R.x", x, stop=True), ("default", "*.work")
        result = integrate(scene, end=0.5, output_step=0.1, method=RK4(0.01), outputs=kept, events=[event])
        np.testing.assert_allclose(result["push.work"], result["energy.kinetic"], rtol=0, atol=2e-6)


def test_a_distance_that_is_least_within_a_step_passes_a_value_twice():
    """A ball flies past a point 1 mm off: its distance has nearly a kink, and is below 5 mm for 2 sqrt(24) mm of the way."""
    ball = Body("ball", BALL, position=(-0.325, 0.001, 0), velocity=(1, 0, 0))
    scene = Scene(
        (ball,), ground={"O": (0, 0, 0)}, measurements=(Measurement("gap", "ground.O", "ball.c", "distance"),)
    )
    near = Event("near", "measured.gap", 0.005)
    result = integrate(scene, end=0.75, output_step=0.25, method=RK4(0.05), events=[near])
    np.testing.assert_allclose(times(result), 0.325 + 1e-3 * np.sqrt(24) * np.array([-1, 1]), rtol=0, atol=1e-12)


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


@pytest.mark.parametrize("rows", [1, 7, 1000])
@pytest.mark.parametrize("after", ["3 * step(t - 0.6)", "100 * (t - 0.6)**2 * step(t - 0.6)"])
def test_a_run_that_an_event_ends_knows_nothing_of_what_comes_after_it(monkeypatch, after, rows):
    """A driver that jumps, or is followed badly, a tenth of a second later: the run was refused, or told so at 1 s, and its
    counts were those of up to 1000 rows beyond."""
    monkeypatch.setattr(integration, "MOST_ROWS", rows)
    bar = rigid_body("bar", mass=1.0, inertia=(0.1, 0.1, 0.1), points={"a": (0, 0, 0)})
    hinge = Joint("hinge", "revolute", "ground.O", "bar.a")
    half, never = Event("half", "hinge.angle", 0.5, stop=True), Event("never", "hinge.angle", 9.0)
    runs = [
        integrate(
            Scene((Body("bar", bar),), (hinge,), (Driver("motor", "hinge", formula(law)),), ground={"O": (0, 0, 0)}),
            end=end, output_step=0.01, method=ROS2(1e-3), events=[event],
        )
        for law, end, event in ((f"t + {after}", 1.0, half), ("t", 0.5, never))
    ]  # fmt: skip
    ended, short = (run.attributes for run in runs)
    assert runs[0].time[-1] == pytest.approx(0.5, abs=1e-9)
    assert ended["notes"] == short["notes"] == []
    assert 0 <= short["evaluations"] - ended["evaluations"] <= 10  # those of the step that the event cuts
    assert ended["largest_drift"] == pytest.approx(short["largest_drift"], rel=0.1)


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


def test_mistakes_are_named():
    with pytest.raises(InputError, match="direction is 'up'"):
        Event("e", "ball.c.position.y", direction="up")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="the value is nan"):
        Event("e", "ball.c.position.y", np.nan)
    for quantity in ("ball.c.positon.y", "ball.c.position", "ball.c.position.w"):
        with pytest.raises(InputError, match=r"no number of the scene; did you mean .*ball\.c\.position"):
            integrate(THROWN, end=0.1, output_step=0.1, method=RK4(0.1), events=(Event("e", quantity),))


# ---- how accurate they are --------------------------------------------------------------------------------------------

ARM = rigid_body("arm", mass=1.0, inertia=(0.1, 0.1, 0.1), points={"a": (-0.5, 0, 0), "b": (0.5, 0, 0)})
FALLING = Scene(
    (Body("arm", ARM, position=(0.5, 0, 0)),),
    (Joint("hinge", "revolute", "ground.O", "arm.a"),),
    ground={"O": (0, 0, 0)},
    gravity=(0, -9.81, 0),
)


def true_moments(value: float, end: float) -> np.ndarray:
    """When the end of the arm is at a height: its one equation, by another solver."""

    def passes(t, y):
        return np.sin(y[0]) - value

    rates = partial(_rates, 0.5 * 9.81 / 0.35)
    return solve_ivp(rates, (0, end), (0, 0), method="DOP853", rtol=1e-13, atol=1e-13, events=passes).t_events[0]


def _rates(weight: float, t: float, y: np.ndarray) -> tuple[float, float]:
    return y[1], -weight * np.cos(y[0])


@pytest.mark.parametrize(
    "method", [ROS2(5e-3), ROS3(2.5e-2), RK4(2.5e-2), GeneralisedAlpha(5e-3), HHT(5e-3), Within(1e-4)], ids=repr
)
def test_moments_tell_their_error(method):
    """0.3 to 5 times the true one, from the first to the last, though it grows a hundredfold."""
    height = Event("height", "arm.b.position.y", -0.7)
    found = forward(FALLING, end=3.0, output_step=0.05, method=method, events=(height,)).attributes["events"]
    true = true_moments(-0.7, 3.0)
    assert len(found) == len(true)
    for event, moment in zip(found, true, strict=True):
        assert 0.3 <= event["error"] / abs(event["time"] - moment) <= 5.0


def test_moments_of_vibration_tell_their_error():
    """A bending arm without damping: what steps do not resolve moves the moments by its amplitude over the rate."""
    arm = planar_beam("arm", 1.0, 0.5, 3.0, 3)
    scene = Scene(
        (Body("arm", arm),), (Joint("hinge", "revolute", "ground.O", "arm.root"),),
        ground={"O": (0, 0, 0)}, gravity=(0, -9.81, 0),
    )  # fmt: skip
    event = Event("low", "arm.tip.position.y", -0.7), Event("bent", "arm.tip.displacement.y", 0.004, direction="rising")
    span = {"end": 1.0, "output_step": 0.02, "events": event}
    found, true = (
        forward(scene, method=method, check=check, **span).attributes["events"]
        for method, check in ((ROS2(2e-3), True), (RK4(2e-5), False))
    )
    assert [e["event"] for e in found] == [e["event"] for e in true]
    for one, other in zip(found, true, strict=True):
        assert one["error"] >= 0.3 * abs(one["time"] - other["time"])
        assert one["error"] < 0.02


def test_a_run_that_an_event_ends_tells_the_error_of_its_rows():
    """The last row is of the event, not of the grid of the other runs: the place then is as accurate as the one before."""
    ground = Event("ground", "arm.b.position.y", -0.7, stop=True)
    result = forward(FALLING, end=3.0, output_step=0.05, method=ROS2(2.5e-2), events=(ground,))
    assert result.attributes["ended_by"] == "ground"
    true = solve_ivp(
        partial(_rates, 0.5 * 9.81 / 0.35), (0, 1), (0, 0), method="DOP853", rtol=1e-13, atol=1e-13, dense_output=True
    ).sol
    angles = [*(true(t)[0] for t in result.time[:-1]), np.arcsin(-0.7)]
    off = np.abs(result["arm.b.position"][:, :2] - np.column_stack([np.cos(angles), np.sin(angles)])).max()
    assert 0.3 <= result.attributes["errors"]["arm.b.position"][0] / off <= 5.0


def test_a_run_that_ends_within_its_first_row_tells_no_errors():
    """Where runs with other steps do not end as it does, too few rows are shared."""
    graze = Event("graze", "ball.c.position.y", 0.4499, stop=True)
    result = forward(THROWN, end=1.5, output_step=0.5, method=ROS2(0.5), events=(graze,), check=True)
    if result.attributes["errors"]:
        assert all(np.isfinite(error).all() for error in result.attributes["errors"].values())


def test_events_that_not_every_run_passes_are_in_doubt():
    """The arm comes back to its height, but for what its steps lose: runs with other steps come less near, or nearer."""
    back = Event("back", "arm.b.position.y", -1e-3, direction="rising")

    def told(step: float) -> tuple[list, list[str]]:
        of = forward(FALLING, end=2.5, output_step=0.05, method=ROS2(step), events=(back,)).attributes
        return [event["error"] for event in of["events"]], [note for note in of["notes"] if note.startswith("event ")]

    errors, notes = told(0.05)
    assert errors == [None]
    assert "'back' at t = 0.985063 s is in doubt: a run with other steps does not pass it" in notes[0]
    assert "'back' may happen at t = 1.97114 s, too, as in a run with other steps; take a smaller step" in notes[1]
    errors, notes = told(0.0125)
    assert len(errors) == 2
    assert None not in errors
    assert not notes


def test_doubt_is_printed():
    attributes = {"title": "t", "analysis": "a", "degrees_of_freedom": 1, "method": "m", "notes": []}
    event = {"event": "back", "time": 0.25, "error": None}
    assert "event        back at t = 0.25 s, in doubt" in registry.summary(attributes | {"events": [event]})


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
    printed = [line for line in capsys.readouterr().out.splitlines() if line.startswith("event")]
    assert printed[0].startswith("event        top at t = 0.3 s, within ")
    assert printed[1].startswith("event        low at t = 0.631662")


def test_mistakes_in_the_events_of_a_file(tmp_path):
    path = tmp_path / "scene.toml"
    for old, new, words in (("falling", "down", "'rising'"), ("quantity", "quantiy", "did you mean 'quantity'")):
        path.write_text(FILE.replace(old, new), encoding="utf-8")
        with pytest.raises(InputError, match=r"analysis\.events\.(low|top)") as caught:
            load_scene(path)
        assert words in str(caught.value)


@pytest.mark.parametrize("value", [-1.963838631794485, -0.4, -1.1])
def test_moments_between_steps_of_any_length_are_not_told_too_well_by_chance(value):
    """Of a pendulum two runs may pass a value at nearly one moment, and both be off it by a hundred times that."""
    body = rigid_body("b", mass=2.0, inertia=(1, 1, 0.2), centre_of_mass=(0.5, 0, 0), points={"p": (0, 0, 0)})
    scene = Scene(
        (Body("b", body, omega_bar=(0, 0, 2.0)),), (Joint("g", "revolute", "ground.O", "b.p"),),
        ground={"O": (0, 0, 0)}, gravity=(0, -9.81, 0),
    )  # fmt: skip
    passed = forward(
        scene, end=3.0, output_step=0.1, method=DormandPrince(), events=(Event("at", "g.angle", value),), check=True
    )
    swing = solve_ivp(
        lambda t, y: (y[1], -9.81 * np.cos(y[0]) / 0.7), (0, 3), (0.0, 2.0), rtol=1e-12, atol=1e-13,
        events=lambda t, y: y[0] - value, dense_output=True,
    )  # fmt: skip
    told = [event["error"] for event in passed.attributes["events"]]
    off = np.abs(np.array(times(passed)) - swing.t_events[0])
    assert len(told) == 3
    assert (off < 5.0 * np.array(told)).all(), (off, told)
    assert (off < 1e-5).all()


def test_events_of_one_moment():
    """Of one that ends the run its others are told, too, whatever rounding puts first, as are their errors."""
    angle, height, sine = (
        Event("angle", "hinge.angle", 0.5, stop=True),
        Event("height", lambda t, state: state.position("bar.e")[1], 0.6 * np.sin(0.5), stop=True),
        Event("beside", "bar.e.position.x", 0.6 * np.cos(0.5)),
    )
    bar = rigid_body("bar", mass=2.0, inertia=(0.1, 0.1, 0.2), points={"o": (0, 0, 0), "e": (0.6, 0, 0)})
    scene = Scene(
        (Body("bar", bar, omega_bar=(0, 0, 2)),), (Joint("hinge", "revolute", "ground.O", "bar.o"),),
        ground={"O": (0, 0, 0)}, gravity=(1, 2, 0),
    )  # fmt: skip
    for events in ((angle, height, sine), (sine, height, angle)):
        result = forward(scene, end=1.0, output_step=0.05, method=ROS3(5e-3), events=events)
        found = result.attributes["events"]
        assert {event["event"] for event in found} == {"angle", "height", "beside"}
        assert result.attributes["ended_by"] == next(event.name for event in events if event.stop)
        assert np.ptp([event["time"] for event in found]) < 1e-8
        assert not [note for note in result.attributes["notes"] if "doubt" in note or "may happen" in note]
        assert all(event["error"] is not None for event in found)


@pytest.mark.parametrize(
    ("quantity", "better"),
    [
        ("hinge.angle.x", r"did you mean axle"),
        ("axle.angle.x", r"mean axle\.angle,"),
        ("ball.R", r"mean ball\.R\.[xyz]"),
    ],
)
def test_what_is_no_number_is_answered_by_what_is(quantity, better):
    with pytest.raises(InputError, match=better):
        integrate(SPUN, end=0.1, output_step=0.05, method=RK4(0.01), events=(Event("e", quantity),))
