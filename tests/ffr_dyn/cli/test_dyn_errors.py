"""What goes wrong in a scene, and what the user is told."""

from __future__ import annotations

import re
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from places import ROOT
from synthetic import cloud

from ffr_dyn import cli
from ffr_dyn.analyses.forward import forward
from ffr_dyn.analyses.linearise import linearise
from ffr_dyn.analyses.states import scene_at
from ffr_dyn.analyses.static import static
from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.consistency.mobility import mobility
from ffr_dyn.functions.time_functions import polynomial, table
from ffr_dyn.integrators import RK4, ROS2, GeneralisedAlpha, HalfExplicit
from ffr_dyn.integrators.stabilisation import Drifting, Projection
from ffr_dyn.results.file import load_result, save_result
from ffr_dyn.results.result import Quantity, Result
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.forces import Actuator, Load
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import BodyError, rigid_body, save_body, with_point
from ffr_prep.common.errors import ComputationError, InputError


def bar(name: str = "bar", length: float = 1.0):
    points = {"a": np.zeros(3), "b": np.array([length, 0, 0])}
    return rigid_body(name, mass=1.0, inertia=(0.01, 0.1, 0.1), centre_of_mass=(length / 2, 0, 0), points=points)


GROUND = {"O": (0, 0, 0), "P": (5, 0, 0)}
HINGED = Scene((Body("bar", bar()),), (Joint("hinge", "revolute", "ground.O", "bar.a"),), ground=GROUND)


# ---- declarations -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"joints": (Joint("h", "revolute", "ground.O", "rod.a"),)}, ["'rod'", "no body", "bar"]),
        ({"joints": (Joint("h", "revolute", "ground.O", "bar.c"),)}, ["'bar'", "no interface 'c'", "'a'", "'b'"]),
        ({"joints": (Joint("h", "revolute", "bar.a", "bar.b"),)}, ["'h'", "to itself"]),
        ({"joints": HINGED.joints * 2}, ["'hinge'", "more than once"]),
        ({"drivers": (Driver("hinge", "hinge", polynomial(0, 1)),)}, ["'hinge'", "more than once"]),
        ({"bodies": (Body("ground", bar()),), "joints": ()}, ["'ground'", "cannot be a name"]),
        ({"bodies": (Body("a.b", bar()),), "joints": ()}, ["'a.b'", "cannot be a name"]),
        ({"bodies": ()}, ["at least one body"]),
        ({"gravity": (0, 1)}, ["gravity", "3 numbers"]),
        ({"gravity": (0, np.nan, 0)}, ["gravity", "not finite"]),
        ({"loads": (Load("push", "bar.x"),)}, ["'bar.x'", "no interface"]),
        ({"drivers": (Driver("m", "hing", polynomial(0, 1)),)}, ["no joint 'hing'", "did you mean 'hinge'"]),
        (
            {"drivers": (Driver("m", "hinge", polynomial(0, 1), coordinate="stroke"),)},
            ["no coordinate 'stroke'", "angle"],
        ),
    ],
)
def test_a_scene_that_contradicts_itself_says_where(change, words):
    with pytest.raises(InputError) as caught:
        replace(HINGED, **change)
    for word in words:
        assert word in str(caught.value)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Joint("j", "hinge", "a.b", "c.d"), ["no kind 'hinge'", "revolute"]),
        (lambda: Joint("j", "revolute", "a.b", "c.d", axis=(0, 0, 0)), ["axis", "not zero"]),
        (lambda: Joint("j", "universal", "a.b", "c.d"), ["axis_j"]),
        (lambda: Body("b", bar(), damping=-0.1), []),
        (lambda: Body("b", cloud(2), damping=-0.1), ["damping", "negative"]),
        (lambda: Body("b", cloud(2), q=(0, 0, 0)), ["q", "2 numbers"]),
        (lambda: Body("b", bar(), rotation=(1, 1, 1, 1)), ["length 1"]),
        (lambda: Load("f", "b.a", axes="local"), ["'local'", "global"]),
        (lambda: table(np.array([0.0, 0.0]), np.array([1.0, 2.0])), ["must increase; after 0 s comes 0 s, in row 2"]),
        (lambda: table(np.array([0.0]), np.array([1.0])), ["two or more times and as many values, not 1 and 1"]),
        (lambda: with_point(bar(), "p", np.zeros(3)), ["no surface"]),
        (lambda: rigid_body("b", mass=0.0, inertia=(1, 1, 1)), ["mass", "positive"]),
        (lambda: rigid_body("b", mass=-1.0, inertia=(1, 1, 1)), ["mass", "positive"]),
        (lambda: rigid_body("b", mass=1.0, inertia=(0, 0, 1)), ["principal moments"]),
    ],
)
def test_declarations_guard_themselves(make, words):
    if not words:
        make()  # a rigid body has no modes to damp
        return
    with pytest.raises((InputError, BodyError)) as caught:
        make()
    for word in words:
        assert word in str(caught.value)


# ---- assembly ---------------------------------------------------------------------------------------------------------


def test_a_mechanism_that_cannot_be_assembled_names_the_open_joint():
    scene = replace(HINGED, joints=(*HINGED.joints, Joint("far", "spherical", "bar.b", "ground.P")))
    with pytest.raises(InputError, match=r"cannot be assembled: joint '(far|hinge)' stays open by"):
        assemble(scene)


def test_assembly_closes_a_rough_guess_and_says_so():
    scene = replace(HINGED, bodies=(Body("bar", bar(), position=(0.2, 0.1, -0.1), rotation=(0.1, 0.2, 0.3)),))
    assembled = assemble(scene)
    np.testing.assert_allclose(assembled.x[:3], 0, atol=1e-10)
    assert "assembly moved body 'bar' by 0.245 m and turned body 'bar' by 0.226 rad" in assembled.notes[0]
    assert assembled.degrees_of_freedom == 1


def test_redundant_rows_are_named_and_the_motion_is_right():
    """A bar held by two collinear hinges: five rows of ten are redundant."""
    twice = rigid_body(
        "door", mass=2.0, inertia=(0.1, 0.1, 0.1), centre_of_mass=(0.5, 0, 0), points={"a": (0, 0, 0), "b": (0, 0, 1)}
    )
    hinges = (Joint("low", "revolute", "ground.O", "door.a"), Joint("high", "revolute", "ground.Q", "door.b"))
    scene = Scene((Body("door", twice),), hinges, ground={"O": (0, 0, 0), "Q": (0, 0, 1)}, gravity=(0, -9.81, 0))
    assembled = assemble(scene)
    assert assembled.degrees_of_freedom == 1
    assert sum("is redundant" in note for note in assembled.notes) == 5
    one = forward(scene, end=0.5, output_step=0.1, method=RK4(2e-3))
    other = forward(replace(scene, joints=hinges[:1]), end=0.5, output_step=0.1, method=RK4(2e-3))
    np.testing.assert_allclose(one["door.R"], other["door.R"], atol=1e-9)
    np.testing.assert_allclose(one["door.omega_bar"], other["door.omega_bar"], atol=1e-9)


def test_two_drivers_of_one_joint_contradict_each_other():
    motors = (Driver("one", "hinge", polynomial(0, 1)), Driver("two", "hinge", polynomial(0, 2)))
    with pytest.raises(InputError, match="prescribes a motion that the joints and other drivers already fix"):
        assemble(replace(HINGED, drivers=motors))


# ---- runs -------------------------------------------------------------------------------------------------------------


def test_nan_from_a_user_force_names_the_load_and_the_time_and_keeps_the_file(tmp_path):
    def push(t, state):
        return (np.nan, 0, 0) if t > 0.05 else (1.0, 0, 0)

    scene = replace(HINGED, loads=(Load("gust", "bar.b", function=push),))
    path = tmp_path / "result.nc"
    with pytest.raises(ComputationError, match=r"'gust' at t = 0\.05.*finite"):
        forward(scene, end=1.0, output_step=0.01, method=RK4(1e-3), path=path)
    kept = load_result(path)
    assert kept.time[-1] == pytest.approx(0.05)
    assert kept.attributes["status"].startswith("stopped")


@pytest.mark.parametrize(
    ("function", "words"),
    [
        (lambda t, state: (1.0, 2.0), "right count"),
        (lambda t, state: 1 / 0, "division by zero"),
        (lambda t, state: state.position("bar.zzz"), "no interface 'zzz'"),
    ],
)
def test_other_failures_of_user_functions_are_reported(function, words):
    scene = replace(HINGED, loads=(Load("gust", "bar.b", function=function),))
    with pytest.raises(ComputationError, match=words):
        forward(scene, end=0.1, output_step=0.01)


def grown(t, state):
    return (0, 1e280 * t, 0)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (
            {"loads": (Load("twist", "bar.b", moment=(0, 0, 1e300)),)},
            r"'bar' is no longer finite: 'twist' exerts 1e\+300",
        ),
        ({"loads": (Load("gust", "bar.b", function=grown),)}, r"no longer finite: 'gust' exerts 1e\+2\d\d N"),
        ({"forces": (Actuator("motor", "hinge", force=-1e200),)}, r"no longer finite: 'motor' exerts 1e\+200 N or N m"),
    ],
)
@pytest.mark.parametrize("method", [RK4(1e-3), ROS2(1e-3), GeneralisedAlpha(1e-3)])
def test_a_force_that_makes_the_state_overflow_is_named_with_its_value(more, words, method):
    with pytest.raises(ComputationError, match=words):
        forward(replace(HINGED, **more), end=0.1, output_step=0.01, method=method)


@pytest.mark.parametrize(("kind", "reach"), [(RK4, 2.8284), (HalfExplicit, 3.2757)])
def test_the_step_that_is_refused_is_that_of_the_method(kind, reach):
    """Where |R(i y)| of the method exceeds one."""
    scene = Scene((Body("b", cloud(3, stiffness=1e4)),))
    omega = np.sqrt(scene.bodies[0].model.omega2.max())
    assert kind.reach == pytest.approx(reach, rel=1e-4)
    h = 1.001 * reach / omega
    with pytest.raises(InputError, match=r"unstable: body 'b'"):
        forward(scene, end=h, output_step=h, method=kind(h))
    h = 0.999 * reach / omega
    forward(scene, end=h, output_step=h, method=kind(h))


def test_an_explicit_step_that_cannot_be_stable_is_refused():
    scene = Scene((Body("b", cloud(3, stiffness=1e4)),))
    with pytest.raises(InputError, match=r"unstable: body 'b'.*ROS2"):
        forward(scene, end=1.0, output_step=0.01, method=RK4(1e-3))


def test_a_run_that_grows_without_bound_stops():
    """A fixed joint raises the frequency of the assembled system above that of the free body: RK4 blows up."""
    model = cloud(12, points=6, stiffness=150.0)
    scene = Scene((Body("b", model, q_dot=np.ones(12)),), (Joint("clamp", "fixed", "ground.O", "b.a"),), ground=GROUND)
    h = 0.97 * 2.83 / np.sqrt(model.omega2.max())
    with pytest.raises((ComputationError, InputError), match=r"energy has grown|no longer finite"):
        forward(scene, end=2000 * h, output_step=h, method=RK4(h))


@pytest.mark.parametrize(
    "settings",
    [
        {"end": 1.0, "output_step": 0.1, "method": ROS2(0.03)},
        {"end": 1.05, "output_step": 0.1},
        {"end": -1.0, "output_step": 0.1},
        {"end": 1.0, "output_step": 0.0},
        {"end": np.nan, "output_step": 0.1},
    ],
)
def test_steps_that_do_not_fit_are_refused(settings):
    with pytest.raises(InputError, match=r"step|duration"):
        forward(HINGED, **settings)


@pytest.mark.parametrize(
    ("method", "keep", "words"),
    [
        (ROS2(1e-3), Projection(), "worst in '(A|B|C|D|motor)'.*the mechanism locks"),
        (RK4(1e-3), Projection(), "worst in '(A|B|C|D|motor)'.*the mechanism locks"),
        (GeneralisedAlpha(1e-3), Projection(), "do not converge: "),
        (ROS2(1e-3), Drifting(), "no longer finite: .*nearest to dependence at t = 0.09 s: the mechanism locks there"),
    ],
)
def test_a_driver_that_goes_beyond_a_dead_point_stops_the_run(method, keep, words):
    """A crank of 0.6 m, which cannot turn around under a coupler of 0.9 m and a rocker of 0.5 m on a base of 1 m."""
    lengths = {"crank": 0.6, "coupler": 0.9, "rocker": 0.5}
    crank, coupler, rocker = (Body(name, bar(name, length)) for name, length in lengths.items())
    bodies = (
        replace(crank, rotation=(0, 0, 1.2)),
        replace(coupler, position=(0.2, 0.56, 0), rotation=(0, 0, -0.2)),
        replace(rocker, position=(1, 0, 0), rotation=(0, 0, 1.5)),
    )
    pairs = {"A": ("ground.O", "crank.a"), "B": ("crank.b", "coupler.a"), "C": ("coupler.b", "rocker.b")}
    joints = [Joint(name, "revolute", *pair) for name, pair in pairs.items()]
    joints.append(Joint("D", "revolute", "ground.D", "rocker.a"))
    motor = Driver("motor", "A", polynomial(1.2, 10.0))
    scene = Scene(bodies, tuple(joints), drivers=(motor,), ground={"O": (0, 0, 0), "D": (1, 0, 0)})
    with pytest.raises(ComputationError, match=rf"at t = 0\.\d+ s .*{words}"):
        forward(scene, end=0.5, output_step=0.01, method=method, stabilisation=keep)


def test_a_body_without_inertia_about_an_axis_is_named():
    needle = rigid_body("needle", mass=1.0, inertia=(0, 1, 1))
    with pytest.raises(InputError, match="body 'needle' cannot move: it has no inertia left for turning about x"):
        forward(Scene((Body("needle", needle),)), end=0.1, output_step=0.1)


@pytest.mark.filterwarnings("error")
def test_a_body_without_any_inertia_is_named_alone():
    """No warning of a division by zero goes before it."""
    dot = rigid_body("dot", mass=1.0, inertia=(0, 0, 0), points={"a": (0, 0, 0)})
    scene = Scene((Body("dot", dot),), (Joint("hinge", "revolute", "ground.O", "dot.a"),), ground={"O": (0, 0, 0)})
    with pytest.raises(InputError, match="body 'dot' cannot move: it has no inertia left for turning about z"):
        forward(scene, end=0.1, output_step=0.1)


def test_a_needle_that_swings_in_a_plane_is_looked_at_in_space_without_inertia_about_its_axis():
    """What a run in the plane computes is also counted, balanced and linearised, as what the closed form says."""
    needle = rigid_body(
        "needle", mass=1.0, inertia=(0, 1 / 12, 1 / 12), centre_of_mass=(0.5, 0, 0), points={"a": (0, 0, 0)}
    )
    hung = Body("needle", needle, rotation=(0, 0, -1.2))
    hinge = Joint("hinge", "revolute", "ground.O", "needle.a")
    scene = Scene((hung,), (hinge,), ground={"O": (0, 0, 0)}, gravity=(0, -9.81, 0))
    found = mobility(scene)
    assert (found.degrees_of_freedom, found.redundant, found.free[0].name) == (1, (), "hinge.angle")
    swing = linearise(scene_at(scene, static(scene))).eigenvalues
    assert np.abs(swing.imag).max() == pytest.approx(np.sqrt(1.5 * 9.81), rel=1e-6)


# ---- the command line ---------------------------------------------------------------------------------------------------

SCENE = """
name = "bar"
gravity = [0, -9.81, 0]
[analysis]
end = 0.1
output_step = 0.01
[ground]
O = [0, 0, 0]
[bodies.bar]
mass = 1.0
inertia = [0.1, 0.1, 0.1]
points = {a = [0, 0, 0], b = [1, 0, 0]}
[joints.hinge]
kind = "revolute"
i = "ground.O"
j = "bar.a"
"""


def run_cli(monkeypatch, capsys, *arguments: object) -> tuple[int, str]:
    monkeypatch.setattr(sys, "argv", ["ffr-dyn", *map(str, arguments)])
    code = 0
    try:
        cli.main()
    except SystemExit as end:
        code = int(end.code or 0)
    captured = capsys.readouterr()
    assert "Traceback" not in captured.err
    return code, captured.out + captured.err


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('j = "bar.a"', 'j = "baar.a"', ["no body 'baar'", "did you mean 'bar'"]),
        ('j = "bar.a"', 'j = "ground.O"', ["to itself"]),
        ('kind = "revolute"', 'kind = "hinge"', ["no kind 'hinge'"]),
        ("mass = 1.0", "mass = 0.0", ["mass", "positive"]),
        ("mass = 1.0", "", ["bodies.bar", "give either file"]),
        ("mass = 1.0", "mas = 1.0", ["bodies.bar", "'mas' is not a known entry", "did you mean 'mass'"]),
        ("end = 0.1", "end = inf", ["analysis.end", "finite"]),
        ("end = 0.1", "", ["analysis.end", "required"]),
        ("mass = 1.0", 'file = "missing.ffr"', ["missing.ffr", "does not exist"]),
        ("[ground]", "[ground", ["not a readable TOML file"]),
    ],
)
def test_mistakes_in_a_scene_file_exit_with_two_and_overwrite_nothing(monkeypatch, capsys, tmp_path, old, new, words):
    scene, result = tmp_path / "scene.toml", tmp_path / "result.nc"
    scene.write_text(SCENE.replace(old, new))
    result.write_text("precious")
    code, said = run_cli(monkeypatch, capsys, "run", scene, "-o", result)
    assert code == 2
    assert said.startswith("ffr-dyn: ")
    for word in words:
        assert word in said
    assert result.read_text() == "precious"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["result.nc", "scene.toml"]


def test_missing_files_and_unknown_quantities_exit_with_two(monkeypatch, capsys, tmp_path):
    assert run_cli(monkeypatch, capsys, "run", tmp_path / "none.toml")[0] == 2
    assert run_cli(monkeypatch, capsys, "info", tmp_path / "none.nc")[0] == 2
    assert run_cli(monkeypatch, capsys, "fly")[0] == 2
    (tmp_path / "scene.toml").write_text(SCENE)
    code, said = run_cli(monkeypatch, capsys, "run", tmp_path / "scene.toml")
    assert code == 0
    assert "scene.nc" in said
    code, said = run_cli(monkeypatch, capsys, "plot", tmp_path / "scene.nc", "bar.b.positon", "-o", tmp_path / "p.png")
    assert code == 2
    assert "bar.b.position" in said
    assert not (tmp_path / "p.png").exists()


def test_a_failing_run_exits_with_one(monkeypatch, capsys, tmp_path):
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE + '[loads.push]\nmarker = "bar.b"\nforce = [0, 1e300, 0]\n')
    code, said = run_cli(monkeypatch, capsys, "run", scene)
    assert code == 1
    assert "no longer finite" in said


def test_a_body_that_cannot_move_exits_with_two(monkeypatch, capsys, tmp_path):
    scene = tmp_path / "scene.toml"
    needle = SCENE.replace("[0.1, 0.1, 0.1]", "[0, 0.1, 0.1]").replace('kind = "revolute"', 'kind = "spherical"')
    scene.write_text(needle)
    for command in ("run", "check", "static", "assemble"):
        code, said = run_cli(monkeypatch, capsys, command, scene)
        assert code == 2
        assert "body 'bar' cannot move: it has no inertia left for turning about x" in said


def test_flexible_scene_file_runs_from_the_command_line(monkeypatch, capsys, tmp_path):
    save_body(cloud(3, stiffness=50.0), tmp_path / "cloud.ffr")
    text = SCENE.replace("mass = 1.0\n", 'file = "cloud.ffr"\nmodes = 2\ndamping = 0.01\n')
    text = text.replace("inertia = [0.1, 0.1, 0.1]\n", "").replace("points = {a = [0, 0, 0], b = [1, 0, 0]}\n", "")
    text += '[loads.push]\nmarker = "bar.b"\nforce = [{harmonic = {amplitude = 2, frequency = 3}}, 1, 0]\n'
    text += '[drivers.motor]\njoint = "hinge"\nfunction = "2 * t"\n'
    (tmp_path / "scene.toml").write_text(text)
    code, said = run_cli(monkeypatch, capsys, "run", tmp_path / "scene.toml", "--method", "rk4", "--step", "1e-3")
    assert code == 0, said
    result = load_result(tmp_path / "scene.nc")
    assert result["bar.q"].shape == (11, 2)
    np.testing.assert_allclose(result["hinge.angle"], 2.0 * result.time, atol=1e-7)
    code, said = run_cli(monkeypatch, capsys, "info", tmp_path / "scene.nc")
    assert code == 0
    assert "motor.moment" in said
    assert re.search(r"end +0\.1 s\n", said)
    assert re.search(r"largest_drift +\S+ of positions, \S+ of rates\n", said)
    run_cli(monkeypatch, capsys, "plot", tmp_path / "scene.nc", "bar.b.position", "-o", tmp_path / "p.png")
    assert (tmp_path / "p.png").stat().st_size > 1000
    path = tmp_path / "path.png"
    assert run_cli(monkeypatch, capsys, "plot", tmp_path / "scene.nc", "bar.b", "--path", "xy", "-o", path)[0] == 0
    assert path.stat().st_size > 1000
    two = run_cli(monkeypatch, capsys, "plot", tmp_path / "scene.nc", "bar.a", "bar.b", "--path", "xy", "-o", path)
    assert two[0] == 2
    assert "give one marker, not 2 names" in two[1]


def test_what_info_says_of_events_and_of_no_rows(monkeypatch, capsys, tmp_path):
    """An event a line, without the hundreds of numbers of its state; a run that was stopped before its first row."""
    event = {
        "event": "up",
        "quantity": "a",
        "time": 0.25,
        "rising": True,
        "rate": 1.0,
        "x": [0.125] * 99,
        "v": [0.125],
        "error": 1e-9,
    }
    result = Result(
        np.zeros(0), {"a": Quantity(np.zeros(0), "m")}, {}, {"events": [event], "gravity": [0.0, -9.81, 0.0]}
    )
    save_result(result, tmp_path / "a.nc")
    code, said = run_cli(monkeypatch, capsys, "info", tmp_path / "a.nc")
    assert code == 0, said
    assert re.search(r"^events +up at t = 0\.25 s, within 1e-09 s, rising: a$", said, re.MULTILINE)
    assert re.search(r"^gravity +0, -9\.81, 0$", said, re.MULTILINE)
    assert re.search(r"^rows +0$", said, re.MULTILINE)
    assert "0.125" not in said


def test_module_runs_as_a_command():
    done = subprocess.run([sys.executable, "-m", "ffr_dyn", "--help"], capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0
    assert "animate" in done.stdout


@pytest.mark.parametrize(
    ("command", "name", "message"),
    [
        (["show"], "plate.ffr", "plate.ffr is not a scene file but, by its ending, a body file, which a scene names"),
        (["run"], "plate.step", "not a scene file but, by its ending, a CAD file, of which `ffr-prep reduce` makes"),
        (["run"], "plate.nc", "not a scene file but, by its ending, a result file"),
        (["info"], "plate.ffr", "plate.ffr is not a result file but, by its ending, a body file"),
        (["info"], "plate.toml", "not a result file but, by its ending, a text such as a scene, which `ffr-dyn run`"),
        (["info"], "plate.nc", "plate.nc is damaged, truncated or not a result file"),
        (["run"], "plate.toml", "plate.toml is not text in UTF-8; save it so"),
    ],
)
def test_a_file_of_another_kind_is_told_by_its_ending(command, name, message, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / name).write_bytes(b"ISO-10303-21;\n\xb4")
    code, said = run_cli(monkeypatch, capsys, *command, name)
    assert code == 2
    assert message in said
