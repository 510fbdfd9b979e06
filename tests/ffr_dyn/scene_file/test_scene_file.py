"""Scene files: what they mean, what they may hold, the mistakes they name, and the way back to text."""

from __future__ import annotations

import json
import re
import sys
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from places import ROOT
from synthetic import cloud

from ffr_dyn import cli
from ffr_dyn.analyses.assemble import Assemble
from ffr_dyn.analyses.checkpoint import fingerprint
from ffr_dyn.analyses.efforts import JointEffort, MarkerEffort
from ffr_dyn.analyses.forward import Forward, forward
from ffr_dyn.analyses.inverse import Inverse
from ffr_dyn.analyses.inversion.bounded import Bounded
from ffr_dyn.analyses.kinematic import Kinematic
from ffr_dyn.analyses.linearise import Linearise
from ffr_dyn.analyses.mixed import Causal, Mixed
from ffr_dyn.analyses.settings import Charted, MomentSettings, Settings
from ffr_dyn.analyses.static import Static
from ffr_dyn.compile.scene_tables import compile_scene
from ffr_dyn.functions.curves import Curve
from ffr_dyn.functions.formula import formula
from ffr_dyn.functions.time_functions import evaluate, harmonic, polynomial, table
from ffr_dyn.integrators import RK4, Within
from ffr_dyn.integrators.stabilisation import Baumgarte, Drifting, Projection
from ffr_dyn.results.file import load_result
from ffr_dyn.scene.couplings import Coupling
from ffr_dyn.scene.drivers import Driver, PointDriver
from ffr_dyn.scene.forces import (
    Actuator,
    Bushing,
    JointFriction,
    JointSpring,
    JointStop,
    Load,
    ModalForce,
    NodalForces,
    Pressure,
    Servo,
    SpringDamper,
)
from ffr_dyn.scene.joints import KINDS, Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_dyn.scene.sensors import Measurement
from ffr_dyn.scene_file.read import load_scene
from ffr_dyn.scene_file.schema import EFFORTS as EFFORT_KINDS
from ffr_dyn.scene_file.schema import SOLUTIONS, schema, tables
from ffr_dyn.scene_file.toml_lines import lines_of
from ffr_dyn.scene_file.write import save_scene, to_toml
from ffr_prep.body import FlexibleBody, load_body, rigid_body, save_body
from ffr_prep.common.errors import InputError

SCENE = """
name = "pendulum"
gravity = [0, -9.81, 0]
outputs = ["default", "*.power"]
[parameters]
bar.length = 1.0
bar.mass = "2 * bar.length"
speed = "30 rpm"
moment = 0.2
[analysis]
end = 0.1
output_step = "10 ms"
[ground]
O = [0, 0, 0]
[bodies.bar]
mass = "bar.mass"
inertia = ["bar.mass * bar.length ** 2 / 12", 0.2, "${moment}"]
points = {a = [0, 0, 0], b = ["bar.length", 0, 0]}
[joints.hinge]
kind = "revolute"
i = "ground.O"
j = "bar.a"
[loads.push]
marker = "bar.b"
force = ["10 * smooth(t / 0.05) * bar.length", 0, 0]
[drivers]
[couplings]
[springs.rope]
i = "ground.O"
j = "bar.b"
stiffness = "5 N/mm"
"""


def written(folder: Path, text: str = SCENE, name: str = "scene.toml", **changes: str) -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def changed(old: str, new: str) -> str:
    assert old in SCENE
    return SCENE.replace(old, new)


def test_a_list_of_tables_is_told_to_be_tables_with_names(tmp_path):
    with pytest.raises(InputError, match=r"joints: must be tables with names; write \[joints\.NAME\] for each"):
        load_scene(written(tmp_path, '[[joints]]\nkind = "revolute"\n'))


def test_a_list_of_events_is_told_where_tables_of_events_are(tmp_path):
    """The keys are those of the file, whatever kind of analysis it is read as."""
    text = changed("[analysis]\n", '[analysis]\nevents = [{quantity = "rod.q", value = 0}]\n')
    with pytest.raises(InputError, match=r"must be tables with names; write \[analysis\.events\.NAME\] for each"):
        load_scene(written(tmp_path, text))


def test_what_is_missing_is_said_with_what_to_write(tmp_path):
    with pytest.raises(
        InputError, match=r'analysis: is required, and missing; write a table \[analysis\] with kind = "steady"'
    ):
        load_scene(written(tmp_path, changed('[analysis]\nend = 0.1\noutput_step = "10 ms"\n', "")))
    with pytest.raises(InputError, match=r"analysis\.\S*end: is required, and missing$"):
        load_scene(written(tmp_path, changed("end = 0.1\n", "")))


def test_numbers_may_be_formulas_of_parameters_and_have_units(tmp_path):
    scene, settings = load_scene(written(tmp_path))
    bar = scene.bodies[0].model
    assert bar.mass == 2.0
    assert bar.interface("b").position[0] == 1.0
    assert scene.springs[0].stiffness == 5000.0
    assert settings.output_step == 0.01
    assert settings.method == Within()
    assert settings.outputs == ("default", "*.power")
    assert evaluate(scene.loads[0].force[0], 1.0)[0] == 10.0
    assert scene.loads[0].force[1:] == [0.0, 0.0]


def test_markers_are_points_of_their_bodies(tmp_path):
    middle, place = 'body = "bar"\npoint = ["bar.length / 2", 0, 0]', 'body = "ground"\npoint = [1, 2, 3]'
    markers = f"[markers.middle]\n{middle}\n[markers.P]\n{place}\n"
    text = changed("[drivers]", markers + "[drivers]").replace('marker = "bar.b"', 'marker = "bar.middle"')
    scene, settings = load_scene(written(tmp_path, text))
    assert scene.bodies[0].model.interface("middle").position.tolist() == [0.5, 0, 0]
    assert scene.ground["P"] == pytest.approx([1, 2, 3])
    again, _ = load_scene(written(tmp_path, to_toml(scene, settings)))
    assert again.bodies[0].model.interface("middle").position.tolist() == [0.5, 0, 0]
    with pytest.raises(InputError, match=r"line \d+: markers\.middle: there is no body 'barr'; did you mean 'bar'"):
        load_scene(written(tmp_path, text.replace('body = "bar"', 'body = "barr"')))
    with pytest.raises(InputError, match=r"line \d+: markers\.b: 'bar' has a point 'b' already"):
        load_scene(written(tmp_path, text.replace("markers.middle", "markers.b")))


def test_parameters_can_be_given_from_outside(tmp_path):
    path = written(tmp_path)
    assert load_scene(path, {"bar.length": "0.5"})[0].bodies[0].model.mass == 1.0
    assert load_scene(path, {"bar.length": "250 mm * 1"} | {"bar.length": "250 mm"})[0].bodies[0].model.mass == 0.5
    with pytest.raises(InputError, match=r"no parameter 'bar\.lenght'; did you mean 'bar\.length'"):
        load_scene(path, {"bar.lenght": "0.5"})


def test_any_entry_can_be_given_from_outside(tmp_path):
    path = written(tmp_path)
    scene, settings = load_scene(
        path, {"gravity.2": "-1.62", "bodies.bar.mass": "250 g", "analysis.end": "3", "bodies.bar.inertia": "[1, 2, 3]"}
    )
    assert scene.gravity.tolist() == [0.0, -1.62, 0.0]
    assert scene.bodies[0].model.mass == 0.25
    assert np.allclose(np.diag(scene.bodies[0].model.central_inertia), [1, 2, 3])
    assert settings.end == 3.0
    with pytest.raises(InputError, match=r"no parameter 'gravity\.4'; did you mean 'gravity\.\d'"):
        load_scene(path, {"gravity.4": "1"})
    with pytest.raises(InputError, match=r"no parameter 'xyz'; there are: .*, and the entries of the file"):
        load_scene(path, {"xyz": "1"})
    with pytest.raises(InputError, match="'s' does not fit"):
        load_scene(path, {"bodies.bar.mass": "250 s"})


def test_a_parameter_may_be_a_text_anywhere(tmp_path):
    text = changed('name = "pendulum"', 'name = "${what} of ${bar.length} m"').replace(
        "[parameters]", '[parameters]\nwhat = "a bar"'
    )
    assert load_scene(written(tmp_path, text))[0].name == "a bar of 1.0 m"


@pytest.mark.parametrize(
    ("given", "function"),
    [
        ('"3 * t ** 2"', formula("3 * t ** 2")),
        ("1.5", 1.5),
        ('"90 deg"', np.pi / 2),
        ('"speed * t"', formula("speed * t", {"speed": np.pi})),
        ('{formula = "sin(t)"}', formula("sin(t)")),
        ("{polynomial = [0, 150]}", polynomial(0, 150)),
        ("{harmonic = {amplitude = 2, frequency = 3, phase = 0.1}}", harmonic(amplitude=2, frequency=3, phase=0.1)),
        ('{harmonic = {amplitude = 2, speed = "30 rpm"}}', harmonic(amplitude=2, frequency=0.5)),
        ("{table = [[0, 1, 2], [0, 1, 0]]}", table([0, 1, 2], [0, 1, 0])),
        ('{table_file = "motion.csv"}', table([0, 1, 2], [0, 1, 0])),
    ],
)
def test_a_driver_follows_a_formula_or_a_table(tmp_path, given, function):
    (tmp_path / "motion.csv").write_text("0,0\n1,1\n2,0\n")
    text = changed("[drivers]", f'[drivers.motor]\njoint = "hinge"\nfunction = {given}')
    driver = load_scene(written(tmp_path, text))[0].drivers[0]
    assert driver == Driver("motor", "hinge", function)


def test_points_may_be_driven_and_joints_coupled(tmp_path):
    text = changed("[drivers]", '[drivers.path]\nkind = "point"\ni = "ground.O"\nj = "bar.b"\nx = "cos(t)"')
    text = text.replace("[couplings]", '[measurements.gap]\ni = "ground.O"\nj = "bar.b"\nwhat = "distance"')
    scene, _ = load_scene(written(tmp_path, text))
    assert scene.drivers == (PointDriver("path", "ground.O", "bar.b", x=formula("cos(t)")),)
    assert scene.measurements == (Measurement("gap", "ground.O", "bar.b", "distance"),)


@pytest.mark.slow
def test_a_force_may_be_a_formula_of_the_motion(tmp_path):
    """A spring to the ground by formula moves the bar as the spring does."""
    spring, _ = load_scene(written(tmp_path, changed("10 * smooth(t / 0.05) * bar.length", "0")))
    rope = 'force = ["-5000 * bar.b.position.x", "-5000 * bar.b.position.y", 0]'
    text = changed('force = ["10 * smooth(t / 0.05) * bar.length", 0, 0]', rope)
    by_formula, _ = load_scene(written(tmp_path, text[: text.index("[springs")]))
    runs = [forward(scene, end=0.1, output_step=0.01, method=RK4(1e-3)) for scene in (spring, by_formula)]
    np.testing.assert_allclose(runs[0]["bar.b.position"], runs[1]["bar.b.position"], atol=1e-12)
    text = changed(
        "10 * smooth(t / 0.05) * bar.length", "-2 * hinge.angle_rate - hinge.angle + bar.omega_bar.z + bar.b.velocity.y"
    )
    forward(load_scene(written(tmp_path, text))[0], end=0.01, output_step=0.01)
    text = changed("10 * smooth(t / 0.05) * bar.length", "bar.b.positon.x")
    with pytest.raises(InputError, match=r"force 'push': there is no quantity .* did you mean 'bar\.b\.position\.x'"):
        load_scene(written(tmp_path, text))


PUSH = "10 * smooth(t / 0.05) * bar.length"


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"speed =": "hinge.angle = 3\nspeed =", PUSH: "-2 * hinge.angle"}, "'hinge.angle' is a parameter, and what moves"),
        ({"speed =": "bar.q = 3\nspeed =", PUSH: "-2 * bar.q"}, None),
        ({"speed =": "hinge.angle = 3\nspeed =", PUSH: "-2 * hinge.angle_rate"}, None),
        ({"hinge]": "hinge-1]", PUSH: "-2 * hinge-1.angle"}, "formulas cannot hold the name 'hinge-1': .* call it 'hinge_1'"),
        ({"hinge]": "hinge-a]", "[ground]": "[ground]\n", PUSH: "bar.length - hinge-a.angle"}, "the name 'hinge-a'"),
        ({"b = [": "b-1 = [", '"bar.b"': '"bar.b-1"', PUSH: "-2 * bar.b-1.position.x"}, "cannot hold the name 'b-1'"),
        ({"hinge]": "2]", PUSH: "-3 * 2.angle"}, "cannot hold the name '2': .* call it '_2'"),
    ],
)  # fmt: skip
def test_names_in_formulas_of_the_motion_mean_one_thing(tmp_path, changes, words):
    """A parameter `hinge.angle` was taken for the angle without a word, and of `rod-1.a` the unit 'a' was not known."""
    text = SCENE
    for old, new in changes.items():
        text = text.replace(old, new)
    said = pytest.raises(InputError, match=rf"scene\.toml, line \d+: loads\.push\.force\.1: .*{words}")
    with said if words else nullcontext():
        load_scene(written(tmp_path, text))


@pytest.mark.parametrize(
    ("given", "hint"),
    [('creep = "1 mm/s"', True), ('coordinate = "angle"\ncreep = "1 mm/s"', False), ('creep = "1 kg"', True)],
)
def test_a_unit_of_a_stroke_asks_for_the_coordinate(tmp_path, given, hint):
    force = f'[forces.dry]\nkind = "joint-friction"\njoint = "hinge"\ncoulomb = 3\n{given}\n'
    with pytest.raises(InputError, match=r"forces\.dry\.creep: .* does not fit: this is given in rad/s") as caught:
        load_scene(written(tmp_path, SCENE + force))
    assert ('write coordinate = "stroke"' in str(caught.value)) == hint


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ("0, 5\n2, 3\n1, 2\n", r"rows\.csv: the times of a table must increase; after 2 s comes 1 s, in row 3"),
        ("0, 5\n", r"rows\.csv: a table needs two or more times and as many values, not 1 and 1"),
    ],
)
def test_a_file_of_rows_that_are_no_table_is_named(tmp_path, rows, words):
    (tmp_path / "rows.csv").write_text(rows)
    with pytest.raises(InputError, match=words):
        load_scene(written(tmp_path, changed('"10 * smooth(t / 0.05) * bar.length"', '{table_file = "rows.csv"}')))


def test_an_actuator_may_be_a_formula_of_the_motion(tmp_path):
    """A damper at the hinge by formula, and the same as a joint spring without stiffness."""
    kinds = (
        'kind = "actuator"\njoint = "hinge"\nforce = "-2 * hinge.angle_rate"',
        'kind = "joint-spring"\njoint = "hinge"\ndamping = 2',
    )
    runs = []
    for kind in kinds:
        scene, settings = load_scene(written(tmp_path, changed("[drivers]", f"[forces.damper]\n{kind}")))
        assert load_scene(save_scene(scene, settings, tmp_path / "again.toml"))[0].forces == scene.forces
        runs.append(forward(scene, end=0.05, output_step=0.01, method=RK4(1e-3)))
    np.testing.assert_allclose(runs[0]["bar.b.position"], runs[1]["bar.b.position"], atol=1e-12)


# ---- includes -------------------------------------------------------------------------------------------------------


def split(folder: Path) -> Path:
    """The scene in three files, two of them in a folder of their own with a body file."""
    (folder / "parts").mkdir()
    save_body(cloud(2), folder / "parts" / "cloud.ffr")
    written(folder / "parts", 'include = ["numbers.toml"]\n[bodies.bar]\nfile = "cloud.ffr"\n', "bar.toml")
    written(folder / "parts", "[parameters]\nbar.length = 3.0\nk = 7\n", "numbers.toml")
    start, end = SCENE.index("[bodies.bar]"), SCENE.index("[joints.hinge]")
    text = 'include = ["parts/bar.toml"]\n' + SCENE[:start] + SCENE[end:].replace('"5 N/mm"', '"k * bar.length"')
    return written(folder, text)


def test_included_files_are_merged_and_keep_their_own_folder(tmp_path):
    scene, _ = load_scene(split(tmp_path))
    assert scene.bodies[0].model.n == 2
    assert scene.springs[0].stiffness == 7.0  # the including file's bar.length is 1


@pytest.mark.parametrize(
    ("included", "words"),
    [
        ('include = ["bar.toml"]\n', ["bar.toml includes itself: bar.toml -> bar.toml"]),
        ('include = ["../scene.toml"]\n', ["includes itself: scene.toml -> bar.toml -> scene.toml"]),
        ('include = ["none.toml"]\n', ["none.toml does not exist"]),
        ('include = "numbers.toml"\n', ["must be a list of file names"]),
        ('include = ["/numbers.toml"]\n', ["must be relative"]),
        ("gravity = [0, 0, -9.81]\n", ["scene.toml, line 4: gravity is given in", "bar.toml, line 1 too"]),
        ("[springs.rope]\nstiffness = 1\n", ["springs.rope.stiffness is given in", "bar.toml, line 2 too"]),
        ("[springs\n", ["bar.toml is not a readable TOML file", "line 1"]),
        (
            "[bodies.bar]\nfile = 'cloud.ffr'\ncolour = 'red'\n",
            ["bar.toml, line 3: bodies.bar: 'colour' is not"],
        ),
    ],
)
def test_mistakes_in_included_files_are_named_with_the_file(tmp_path, included, words):
    path = split(tmp_path)
    written(tmp_path / "parts", included, "bar.toml")
    with pytest.raises(InputError) as caught:
        load_scene(path)
    for word in words:
        assert word in str(caught.value)


# ---- mistakes -------------------------------------------------------------------------------------------------------


MOTOR = '[drivers.m]\njoint = "hinge"\nfunction = '


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("gravity =", "gravty =", ["'gravty' is not a known entry", "did you mean 'gravity'"]),
        ("end = 0.1", 'end = 0.1\noutputs = ["*"]', ["analysis", "'outputs' is", "at the top of the file, before the first"]),
        ("end = 0.1", "end = 0.1\nparameters = {a = 1}", ["'parameters' is", "a table of its own, [parameters]"]),
        ("gravity =", "output_step = 1\ngravity =", ["'output_step' is", "belongs in the table [analysis]"]),
        ("stiffness =", "stifness =", ["springs.rope", "'stifness' is not a known entry", "did you mean 'stiffness'"]),
        ("end = 0.1", "ende = 0.1", ["analysis", "'ende'", "did you mean 'end'"]),
        ('"5 N/mm"', '"5 N/mmm"', ["springs.rope.stiffness", "unknown unit 'mmm'", "did you mean 'mm'"]),
        ('"5 N/mm"', '"5 mm"', ["springs.rope.stiffness", "'mm' does not fit", "N/m"]),
        ('"5 N/mm"', '"5 !"', ["springs.rope.stiffness", "is not a formula"]),
        ('"5 N/mm"', '"5 N//mm"', ["springs.rope.stiffness", "is not a unit"]),
        ('"5 N/mm"', '"5 * t"', ["springs.rope.stiffness", "depends on t"]),
        ('"5 N/mm"', "[5]", ["springs.rope.stiffness", "number", "[5]"]),
        ('"5 N/mm"', "nan", ["springs.rope.stiffness", "finite"]),
        ('"5 N/mm"', '"${stif}"', ["springs.rope.stiffness", "no parameter 'stif'"]),
        ('"bar.mass"', '"bar.mas"', ["bodies.bar.mass", "'bar.mas'", "did you mean 'bar.mass'"]),
        ('"2 * bar.length"', '"2 * speed + bar.mass"', ["parameters.bar.mass", "depends on itself", "bar.mass -> bar.mass"]),
        ('"30 rpm"', '"30 * lenght"', []),
        ("speed =", "sin =", ["parameters.sin", "taken"]),
        ("speed =", '"a b" =', ["parameters.a b", "cannot be a parameter's name"]),
        ("[drivers]", MOTOR + '{table = [[0, 2, 1], [0, 1, 2]]}', ["drivers.m.function", "after 2 s comes 1 s"]),
        ("[drivers]", MOTOR + '{table = [[0, 1]]}', ["drivers.m", "table"]),
        ("[drivers]", MOTOR + '{polynomial = [1], formula = "t"}', ["exactly one of"]),
        ("[drivers]", MOTOR + '{table_file = "none.csv"}', ["none.csv does not exist"]),
        ("[drivers]", MOTOR + '{table_file = "named.csv"}', ["named.csv, line 2: 'time, angle' is no", "write '#'"]),
        ("[drivers]", MOTOR + '{harmonic = {amplitude = 1}}', ["frequency [Hz] or speed"]),
        ("[drivers]", MOTOR + 'true', ["drivers.m"]),
        ("[drivers]", MOTOR + '[1]', ["give a number, a formula or a table"]),
        ("[drivers]", MOTOR + '"bar.b.position.x"', ["drivers.m", "depends on the motion"]),
        ("[drivers]", '[drivers.m]\nkind = "pont"\njoint = "hinge"', ["drivers.m", "no kind 'pont'", "mean 'point'?"]),
        ("[drivers]", '[drivers.m]\nkind = "point"\ni = "ground.O"\nj = "bar.b"', ["driver 'm' prescribes nothing"]),
        ("[drivers]", MOTOR + '{piecewise = {breaks = [0, 1], coefficients = []}}', ["coefficients"]),
        ("[drivers]", MOTOR + '{piecewise = {breaks = [1, 0], coefficients = [[1]]}}', ["breaks that increase"]),
        ("[drivers]", '[drivers.hinge]\njoint = "hinge"\nfunction = 1', ["'hinge' is used more than once"]),
        ("[drivers]", "[joints.hinge]", ["not a readable TOML file", "line"]),
        ("[drivers]", '[drivers.m]\njoint = "hing"\nfunction = 1', ["no joint 'hing'", "did you mean 'hinge'"]),
        ('"10 * smooth(t / 0.05) * bar.length"', '"10 * smoth(t)"', ["loads.push.force.1", "did you mean 'smooth'"]),
        ('"10 * smooth(t / 0.05) * bar.length"', '"__import__(1)"', ["loads.push.force.1", "not a known function"]),
        ('kind = "revolute"', 'kind = "revolut"', ["no kind 'revolut'"]),
        ('mass = "bar.mass"', 'mass = "bar.mass"\nfile = "x.ffr"', ["bodies.bar", "either file"]),
        ('outputs = ["default", "*.power"]', 'outputs = "all"', ["outputs", "list"]),
        ("[0, -9.81, 0]", "[0, -9.81]", ["gravity: must have at least 3 items, and has 2"]),
        ("[0, -9.81, 0]", "-9.81", ["gravity: must be a list in square brackets (it is -9.81)"]),
        ("end = 0.1", "end = 0.1\nmethod = 'ros22'", ["analysis.method: must be 'rk4', ", "did you mean 'ros2'?"]),
    ],
)  # fmt: skip
def test_mistakes_are_named_with_their_place(tmp_path, old, new, words):
    path = written(tmp_path, changed(old, new))
    (tmp_path / "named.csv").write_text("# a motor\ntime, angle\n0, 0\n1, 1\n", encoding="utf-8")
    if not words:
        load_scene(path)  # a text that nothing uses as a number may stand
        return
    with pytest.raises(InputError) as caught:
        load_scene(path)
    for word in ["scene.toml", *words]:
        assert word in str(caught.value)
    assert not re.search("[Ii]nput|validation|parse", str(caught.value))


KEYS = [
    k
    for k, line in enumerate(SCENE.splitlines())
    if " = " in line and not line.startswith(("bar.", "speed", "mom", "O "))
]


@pytest.mark.parametrize("k", KEYS, ids=[SCENE.splitlines()[k].partition(" ")[0] for k in KEYS])
def test_every_misspelt_key_is_named_with_its_line(tmp_path, k):
    lines = SCENE.splitlines()
    key, _, rest = lines[k].partition(" ")
    lines[k] = f"{key}x {rest}"
    with pytest.raises(InputError, match=rf"scene\.toml, line {k + 1}: .*'{key}x' is not a known entry"):
        load_scene(written(tmp_path, "\n".join(lines)))


@pytest.mark.parametrize(
    ("old", "new", "begins"),
    [
        ("[0, -9.81, 0]", '[0, "9.81 kg", 0]', "gravity ="),
        ('"5 N/mm"', '"5 !"', "stiffness ="),
        ('"2 * bar.length"', '"2 * speed + bar.mass"', "bar.mass ="),
        ('kind = "revolute"', 'kind = "revolut"', "[joints.hinge]"),
        ('j = "bar.a"', 'j = "bar.c"', 'j = "bar.c"'),
        ('marker = "bar.b"', "", "[loads.push]"),
        ("[drivers]", '[drivers.m]\njoint = "hing"\nfunction = 1', "[drivers.m]"),
        ('inertia = ["bar.mass', 'inertia = [-1.0, "bar.mass', "inertia ="),
        ('outputs = ["default", "*.power"]', 'outputs = [\n  "default",\n  3,\n]', "outputs ="),
    ],
)  # fmt: skip
def test_complaints_tell_the_line(tmp_path, old, new, begins):
    text = changed(old, new)
    line = next(k for k, line in enumerate(text.splitlines(), start=1) if line.startswith(begins))
    with pytest.raises(InputError, match=rf"scene\.toml, line {line}: "):
        load_scene(written(tmp_path, text))


def test_lines_of_a_text():
    text = '''# a comment
a.b = 1
["c d"]          # a table
e = [
  1,             # continued
  {f = 2},
]
g = """
[no.table]
h = 1
"""
[[i]]
j = 1
[[i]]
j = {k = 2}
'''
    found = lines_of(text)
    assert found[("a", "b")] == 2
    assert found[("c d",)] == 3
    assert found[("c d", "e", "1", "f")] == 4
    assert found[("c d", "g")] == 8
    assert found[("i", "0", "j")] == 13
    assert found[("i", "1", "j", "k")] == 15
    assert ("no", "table") not in found


# ---- there and back -------------------------------------------------------------------------------------------------


def rich(one: FlexibleBody) -> Scene:
    """A scene with something in every table."""
    two = rigid_body(
        "two", mass=1 / 3, inertia=(0.1, 0.2, 0.25), centre_of_mass=(0.1, 1 / 7, 0), points={"a": (0, 0, 1e-17)}
    )
    three = rigid_body("three", mass=1.0, inertia=np.diag((1, 1, 1)) + 0.1, points={"a": (0, 0, 0), "b": (1, 0, 0)})
    bodies = (
        Body("one", one, rotation=(0.3, -0.2, 0.1), q=(1e-3, 0, 1 / 3), damping=(0.01, 0.0, 0.1)),
        Body("two", two),
        Body("three", three),
    )
    axes = {
        "universal": {"axis": (1, 0, 0), "axis_j": (0, 1, 0)},
        "distance": {"length": formula("1 + t")},
        "screw": {"pitch": 0.01},
    }
    joints = tuple(
        Joint(f"j{k}", kind, "one.a", "three.b", **axes.get(kind, {"axis": np.eye(3)})) for k, kind in enumerate(KINDS)
    )
    return Scene(
        bodies,
        joints,
        drivers=(
            Driver("d1", "j1", harmonic(amplitude=0.1, frequency=1 / 3, phase=2.0, mean=-0.0)),
            Driver("d2", "j3", table(np.array([0.0, 0.1, 0.7]), np.array([1.0, 1 / 3, 0.0])), coordinate="stroke"),
            Driver("d3", "j2", polynomial(1.0, 2.0), coordinate="stroke"),
            PointDriver("d4", "ground.O", "two.a", y=2.0, z=formula("-3 * exp(-t / a) ** 2", {"a": 0.3})),
        ),
        couplings=(Coupling("gear", "j1.angle", "j2.angle", -1 / 3, offset=1e-300),),
        loads=(
            Load("push", "two.a", force=(1.0, formula("smooth(t)"), 0.0), moment=(0, 0, 3.0), axes="body"),
            Load("pull", "one.a"),
        ),
        springs=(SpringDamper("rope", "ground.O", "two.a", 1 / 3, preload=2.0),),
        forces=(
            Bushing(
                "mount", "ground.O", "two.a", stiffness=(1.0, Curve((0, 1), (0, 1 / 3)), 1, 1, 1, 1), axes=(1, 0, 0)
            ),
            Bushing("full", "ground.O", "two.a", stiffness=np.eye(6) + 1 / 3, damping=(0.1,) * 6),
            JointSpring("coil", "j1", stiffness=Curve((-1, 0, 1), (-2, 0, 3)), damping=0.1, turns=2),
            JointFriction("rub", "j1", 0.1, 1e-3, normal=formula("3 + t"), static=0.2, stribeck=0.1),
            JointStop("end", "j2", 1e4, 1e-3, upper=0.2, coordinate="stroke"),
            Actuator("motor", "j1", force=formula("sin(t)")),
            Servo("servo", "j1", target=formula("0.1 * t"), kp=10.0),
            ModalForce("modal", "one", (1.0, 2.0, 3.0), function=formula("cos(t)")),
            NodalForces("nodal", "one", (0, 2), ((1, 0, 0), (0, 1 / 3, 0)), axes="body"),
            Pressure("gas", "one", 1e5, triangles=(1,), follower=True),
        ),
        base_acceleration=(0.0, formula("t"), 1 / 3),
        measurements=(Measurement("gap", "ground.O", "two.a", "velocity", axes="one"),),
        ground={"O": (0, 0, 1 / 3)},
        gravity=(0, -9.81, 0),
        name='a "quoted"\n\ttäble \\ \x7f',
    )


SETTINGS = Settings(
    start=0.1,
    end=1.1,
    output_step=0.1,
    method=RK4(1e-3),
    stabilisation=Baumgarte(1 / 3, 2.0),
    outputs=("default", "*.work"),
)


def same(a: Scene, b: Scene) -> bool:
    tables = [fingerprint(compile_scene(s).model, [body.q.tolist() for body in s.bodies]) for s in (a, b)]
    poses = [
        [(x.name, *map(np.ndarray.tolist, (x.position, x.rotation, x.velocity, x.omega_bar))) for x in s.bodies]
        for s in (a, b)
    ]
    return (
        tables[0] == tables[1]
        and poses[0] == poses[1]
        and a.name == b.name
        and repr(a.measurements) == repr(b.measurements)
    )


@pytest.mark.parametrize("stabilisation", [Projection(1 / 3), Baumgarte(1 / 3, 2.0), Drifting()])
def test_a_scene_survives_its_file_to_the_bit(tmp_path, stabilisation):
    settings = replace(SETTINGS, stabilisation=stabilisation)
    given = rich(load_body(save_body(cloud(3, seed=1), tmp_path / "one.ffr")))
    scene, back = load_scene(save_scene(given, settings, tmp_path / "new" / "a.toml"))
    assert same(scene, given)
    assert back == settings
    save_scene(scene, back, tmp_path / "a.toml")
    assert (tmp_path / "a.toml").read_text() == (tmp_path / "new" / "a.toml").read_text()


EFFORTS = (JointEffort("m", "j1"), MarkerEffort("pull", "two.a", (0, 1, 0), axes="body", moment=True))
METHOD = {"start": 0.1, "end": 1.1, "output_step": 0.1, "method": RK4(1e-3)}


@pytest.mark.parametrize(
    "settings",
    [
        Settings(
            start=0.1,
            end=1.1,
            output_step=0.1,
            method=Within(),
            stabilisation=Projection(),
            outputs=("two.R",),
            analysis=Kinematic(),
        ),
        Settings(
            **METHOD,
            stabilisation=Projection(),
            chart=Charted(
                measures=("energy",), methods=(("ros2", (0.1, 1 / 3)), ("hht", ())), modes=(2, None), drops=(("I5",),)
            ),
        ),
        Settings(**METHOD, stabilisation=Projection(), analysis=Forward(begin="quasi-static")),
        Settings(**METHOD, stabilisation=Projection(1e-7), analysis=Inverse()),
        Settings(**METHOD, stabilisation=Drifting(), analysis=Inverse(elastic="quasi-static")),
        Settings(**METHOD, stabilisation=Projection(), analysis=Mixed(EFFORTS)),
        Settings(**METHOD, stabilisation=Projection(), analysis=Mixed(EFFORTS[:1], ("d1",), Causal(1e-8, 10.0))),
        Settings(
            **METHOD, stabilisation=Projection(), analysis=Mixed(EFFORTS[1:], ("d1", "d2"), Bounded(after=0.3, parts=2))
        ),
        MomentSettings(time=0.2, outputs=("default", "*.power"), analysis=Static()),
        MomentSettings(time=0.1, outputs=("default",), analysis=Assemble()),
        MomentSettings(time=0.0, outputs=("default",), analysis=Linearise()),
        MomentSettings(
            time=0.1, outputs=("default",), analysis=Linearise((*EFFORTS, "push"), ("two.a.position.y",), True)
        ),
    ],
    ids=lambda settings: type(settings.analysis).__name__,
)
def test_every_analysis_survives_its_file(tmp_path, settings):
    given = rich(load_body(save_body(cloud(3, seed=1), tmp_path / "one.ffr")))
    scene, back = load_scene(save_scene(given, settings, tmp_path / "a.toml"))
    assert same(scene, given)
    assert back == settings


def test_inputs_of_another_order_than_the_file_has_are_refused():
    settings = MomentSettings(analysis=Linearise(("push", EFFORTS[0])))
    with pytest.raises(InputError, match="put them last"):
        to_toml(rich(cloud(3, seed=1)), settings, {"one": "one.ffr"})


ANALYSIS = "[analysis]\nend = 0.1"


@pytest.mark.parametrize(
    ("new", "words"),
    [
        ('kind = "kinetic"', ["analysis", "no kind 'kinetic'; there are forward, kinematic, assemble"]),
        ('kind = "kinematic"\nstabilisation = {kind = "none"}', ["analysis", "'stabilisation' is not a known entry"]),
        ('kind = "static"', ["analysis", "'end' is not a known entry"]),
        ('kind = "mixed"', ["analysis.unknown", "required"]),
        ('kind = "mixed"\nunknown = {}', ["analysis.unknown", "at least 1"]),
        ('kind = "mixed"\nunknown.m = {joint = "hinge", coordinate = "turn"}', ["'m'", "'turn'"]),
        ('kind = "mixed"\nunknown.m = {marker = "bar.b", direction = [0, 1, 0]}', ["analysis.unknown.m", "'marker'"]),
        ('kind = "mixed"\nunknown.m = {kind = "marker", marker = "bar.b", direction = [0, 0, 0]}', ["'m'", "not all zero"]),
        ('kind = "mixed"\nunknown.m = {joint = "hinge"}\nsolution = {kind = "bound"}', ["mean 'bounded'?"]),
        ('kind = "inverse"\nelastic = "stiff"', ["analysis.elastic", "'dynamic' or 'quasi-static'", "'stiff'"]),
    ],
)  # fmt: skip
def test_mistakes_in_an_analysis_are_named(tmp_path, new, words):
    with pytest.raises(InputError) as caught:
        load_scene(written(tmp_path, changed(ANALYSIS, f"[analysis]\n{new}\nend = 0.1")))
    for word in ["scene.toml", *words]:
        assert word in str(caught.value)


def test_formulas_of_the_motion_survive(tmp_path):
    text = changed(
        "10 * smooth(t / 0.05) * bar.length", "-2 * hinge.angle - max(t, bar.q[1] * bar.b.velocity.x)"
    ).replace('mass = "bar.mass"', 'file = "cloud.ffr"')
    text = text.replace('inertia = ["bar.mass * bar.length ** 2 / 12", 0.2, "${moment}"]\n', "").replace(
        'points = {a = [0, 0, 0], b = ["bar.length", 0, 0]}\n', ""
    )
    save_body(cloud(2), tmp_path / "cloud.ffr")
    scene, settings = load_scene(written(tmp_path, text))
    again, _ = load_scene(save_scene(scene, settings, tmp_path / "b.toml"))
    assert again.loads == scene.loads


def test_bodies_of_one_model_share_a_file_and_are_one_again(tmp_path):
    one, other = cloud(3, seed=1), cloud(3, seed=2)
    bodies = [Body(name, model) for name, model in (("a", one), ("b", other), ("c", one))]
    path = save_scene(Scene(tuple(bodies)), SETTINGS, tmp_path / "s.toml")
    assert sorted(file.name for file in tmp_path.glob("*.ffr")) == ["s.a.ffr", "s.b.ffr"]
    first, second, third = (body.model for body in load_scene(path)[0].bodies)
    assert first is third
    np.testing.assert_array_equal(second.omega2, other.omega2)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            {"loads": (Load("f", "two.a", function=lambda t, state: (0, 0, 0)),)},
            ["'f'", "function is a Python function"],
        ),
        ({"loads": (Load("f", "two.a", force=(np.sin, 0, 0)),)}, ["'f': force is a Python function"]),
        ({"drivers": (PointDriver("d", "ground.O", "two.a", x=np.sin),)}, ["'d': x is a Python function"]),
    ],
)
def test_what_a_file_cannot_hold_is_named(tmp_path, change, words):
    with pytest.raises(InputError) as caught:
        save_scene(replace(rich(cloud(3, seed=1)), **change), SETTINGS, tmp_path / "a.toml")
    for word in words:
        assert word in str(caught.value)
    assert list(tmp_path.iterdir()) == []


def test_a_flexible_body_needs_a_file():
    with pytest.raises(InputError, match="body 'one' is flexible"):
        to_toml(rich(cloud(3, seed=1)), SETTINGS)


# ---- the schema -----------------------------------------------------------------------------------------------------


GRAVITY = """
gravity = ["50 cm/s^2", "sin(2 * pi * t)", {table = [[0.0, 1.0], [0.0, -9.81]]}]
[analysis]
end = 0.1
output_step = 0.1
[bodies.stone]
mass = 1.0
inertia = [1, 1, 1]
"""


def test_gravity_of_a_file_may_vary_and_has_the_unit_of_an_acceleration(tmp_path):
    (tmp_path / "scene.toml").write_text(GRAVITY)
    scene, settings = load_scene(tmp_path / "scene.toml")
    np.testing.assert_allclose(scene.gravity, [0.5, 0, 0])
    acceleration = [evaluate(f, 0.25)[0] for f in scene.base_acceleration]
    np.testing.assert_allclose(acceleration, [0, -1.0, 9.81 / 4], atol=1e-12)
    (tmp_path / "again.toml").write_text(to_toml(scene, settings))
    again, _ = load_scene(tmp_path / "again.toml")
    assert again.base_acceleration == scene.base_acceleration
    (tmp_path / "scene.toml").write_text(GRAVITY.replace("50 cm/s^2", "50 kg"))
    with pytest.raises(InputError, match=r"gravity\.1.*kg"):
        load_scene(tmp_path / "scene.toml")


def test_the_published_schema_is_that_of_the_program():
    """Where it is not: ffr-dyn schema > docs/scene.schema.json."""
    assert json.loads((ROOT / "docs" / "scene.schema.json").read_text(encoding="utf-8")) == json.loads(
        json.dumps(schema())
    )


def test_every_kind_is_in_the_schema():
    definitions = schema()["$defs"]
    for kinds in (*tables().values(), EFFORT_KINDS, SOLUTIONS):
        for kind in kinds:
            assert definitions[f"{kind.made.__name__}Entry"]["additionalProperties"] is False
    assert definitions["SpringDamperEntry"]["properties"]["free_length"]["anyOf"][0]["unit"] == "m"  # beside null


def run_cli(monkeypatch, capsys, *arguments: object) -> tuple[int, str]:
    monkeypatch.setattr(sys, "argv", ["ffr-dyn", *map(str, arguments)])
    code = 0
    try:
        cli.main()
    except SystemExit as end:
        code = int(end.code or 0)
    said = capsys.readouterr()
    return code, said.out + said.err


def test_the_command_line_prints_the_schema_and_takes_parameters(monkeypatch, capsys, tmp_path):
    code, said = run_cli(monkeypatch, capsys, "schema")
    assert (code, json.loads(said)) == (0, json.loads(json.dumps(schema())))
    path = written(tmp_path)
    code, said = run_cli(monkeypatch, capsys, "run", path, "-p", "bar.length=0.5", "--keep", "bar.b.position")
    assert code == 0, said
    result = load_result(tmp_path / "scene.nc")
    assert list(result.quantities) == ["bar.b.position"]
    assert result["bar.b.position.x"][0] == pytest.approx(0.5)
    code, said = run_cli(monkeypatch, capsys, "run", path, "-p", "bar.length")
    assert (code, "NAME=VALUE" in said) == (2, True)


def test_the_command_line_resumes(monkeypatch, capsys, tmp_path):
    path = written(tmp_path)
    assert run_cli(monkeypatch, capsys, "run", path, "-o", tmp_path / "whole.nc")[0] == 0
    assert run_cli(monkeypatch, capsys, "run", path, "--end", "0.05")[0] == 0
    code, said = run_cli(monkeypatch, capsys, "run", path, "--resume")
    assert code == 0, said
    whole, resumed = load_result(tmp_path / "whole.nc"), load_result(tmp_path / "scene.nc")
    assert all(q.values.tobytes() == resumed[name].tobytes() for name, q in whole.quantities.items())
    code, said = run_cli(monkeypatch, capsys, "run", path, "--resume", "-p", "bar.length=0.6")
    assert (code, "another scene" in said) == (2, True)
