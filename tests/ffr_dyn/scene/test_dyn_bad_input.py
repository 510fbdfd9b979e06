"""Bad input at the command line of ffr-dyn: exit code 2, the thing, its value and the remedy, and no traceback."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from synthetic import cloud
from test_dyn_errors import GROUND, SCENE, run_cli

from ffr_dyn.analyses.forward import forward
from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.functions.operations import SQRT
from ffr_dyn.functions.time_functions import OPERATION, constant, operation, polynomial
from ffr_dyn.integrators import HHT, RK4, ROS2, ROS3, GeneralisedAlpha, HalfExplicit, Variational
from ffr_dyn.integrators.stabilisation import Baumgarte, Projection
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.forces import Load, SpringDamper
from ffr_dyn.scene.joints import Joint, frames
from ffr_dyn.scene.scene import Body, Scene
from ffr_dyn.scene_file.read import load_scene
from ffr_prep.body import BodyError, rigid_body, truncated, with_point
from ffr_prep.common.errors import ComputationError, InputError


def loaded(force: str) -> str:
    return SCENE + f'[loads.push]\nmarker = "bar.b"\nforce = [0, "{force}", 0]\n'


def driven(angle: str) -> str:
    return SCENE + f'[drivers.motor]\njoint = "hinge"\nfunction = "{angle}"\n'


@pytest.fixture
def scene(tmp_path):
    (tmp_path / "scene.toml").write_text(SCENE)
    return tmp_path / "scene.toml"


# ---- scene files --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            SCENE.replace("output_step = 0.01", "output_step = 0.01\nstep = 0"),
            ["line 7: analysis.step", "greater than 0"],
        ),
        (SCENE.replace("output_step = 0.01", "output_step = -1"), ["analysis.output_step", "greater than 0"]),
        (SCENE.replace('i = "ground.O"', 'i = "ground"'), ["marker 'ground'", "write BODY.POINT"]),
        (loaded("1 m"), ["loads.push.force.2", "'m' does not fit", "given in N"]),
        (SCENE.replace("end = 0.1", 'kind = "forwrd"\nend = 0.1'), ["no kind 'forwrd'", "did you mean 'forward'?"]),
        (SCENE.replace("end = 0.1", 'method = "ros5"\nend = 0.1'), ["analysis.method", "did you mean 'ros3'?"]),
        (
            SCENE + '[forces.f]\nkind = "joint-frictoin"\n',
            ["no kind 'joint-frictoin'", "did you mean 'joint-friction'?"],
        ),
        (driven("1 / t"), ["driver 'motor'", "no value at t = 0 s"]),
        (driven("sqrt(t - 1)"), ["driver 'motor'", "no value at t = 0 s"]),
    ],
)
def test_a_scene_file_that_says_nothing_sensible(monkeypatch, capsys, scene, text, words):
    scene.write_text(text)
    code, said = run_cli(monkeypatch, capsys, "run", scene)
    assert code == 2
    for word in words:
        assert word in said


@pytest.mark.parametrize(
    ("axis", "words"),
    [("[0, 1]", "at least 3 items"), ("[0, nan, 1]", "finite"), ("[[1, 0, 0], [0, 1, 0]]", "axis")],
)
def test_what_may_be_a_vector_or_a_frame_is_complained_about_once(scene, axis, words):
    scene.write_text(f"{SCENE}axis = {axis}\n")
    with pytest.raises(InputError, match=words) as caught:
        load_scene(scene)
    assert str(caught.value).count("joints.hinge") <= 1


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ('{kind = "baumgarte"}', "alpha and beta"),
        ('{kind = "baumgarte", alpha = 20}', "alpha and beta"),
        ('{kind = "baumgarte", alpha = -20, beta = 20}', "greater than 0"),
        ('{kind = "projection", alpha = 20, beta = 20}', "the other kinds take none"),
        ('{kind = "projection", tolerance = 0}', "greater than 0"),
    ],
)
def test_a_stabilisation_that_holds_nothing(scene, entry, words):
    scene.write_text(SCENE.replace("output_step = 0.01", f"output_step = 0.01\nstabilisation = {entry}"))
    with pytest.raises(InputError, match=words):
        load_scene(scene)


def test_a_number_with_an_exponent_may_begin_a_formula(scene):
    scene.write_text(loaded("1e3*exp(-t)"))
    read, _ = load_scene(scene)
    assert read.loads[0].force[1].kind == OPERATION


# ---- options ------------------------------------------------------------------------------------------------------------

DECLINED = [
    ("run --step 0", "positive"),
    ("forward --step nan", "positive"),
    ("check --time nan", "--time nan"),
    ("static --time inf", "--time inf"),
    ("mixed --unknown m=hinge.angle", "needs known motions"),
    ("mixed --unknown m=hinge.angle --known motor", "known motion 'motor' is no driver"),
    ("economise --output bar.b.position.y --end nan", "--end nan: give a time after the start"),
    ("economise --output bar.b.position.y --end -1", "--end -1: give a time after the start"),
    ("economise --output bar.b.position.y -o FOLDER", "is a folder"),
    ("economise --output bar.b.position.y --report a.pdf", ".html or .md or .txt, not .pdf"),
    ("economise --output bar.b.position.y --chart a.pdf", ".png or .svg, not .pdf"),
    ("economise --output bar.b.position.y -o FILE/a.toml", "File exists; choose another place"),
    ("chart --end -1", "--end -1: give a time after the start"),
    ("chart -o FILE/a", "File exists; choose another place"),
    ("realtime --plot a.xyz", ".png or .svg or .pdf, not .xyz"),
    ("realtime --plot FILE/a.png", "File exists; choose another place"),
    ("run --resume -o FOLDER", "is a folder"),
]


@pytest.mark.parametrize(("words", "message"), DECLINED)
def test_options_are_looked_at_before_the_work(monkeypatch, capsys, scene, words, message):
    command, *options = [
        word.replace("FILE", str(scene)).replace("FOLDER", str(scene.parent)) for word in words.split()
    ]
    code, said = run_cli(monkeypatch, capsys, command, scene, *options)
    assert code == 2
    assert message in said
    assert [path.name for path in scene.parent.iterdir()] == ["scene.toml"]


def test_pictures_that_cannot_be_written(monkeypatch, capsys, scene):
    assert run_cli(monkeypatch, capsys, "run", scene)[0] == 0
    result = scene.with_suffix(".nc")
    for command in (
        ["plot", result, "bar.b.position", "-o", scene / "a.png"],
        ["animate", result, "-o", scene / "a.gif"],
    ):
        code, said = run_cli(monkeypatch, capsys, *command)
        assert code == 2
        assert "File exists; choose another place" in said
    code, said = run_cli(monkeypatch, capsys, "stability", "drift", "-o", scene)
    assert code == 2
    assert "File exists" in said


# ---- in Python ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Baumgarte(-3.0, 20.0), "alpha is -3 1/s; it must be positive"),
        (lambda: Baumgarte(3.0, np.nan), "beta is nan 1/s"),
        (lambda: Driver("d", "hinge", "3 * t"), "driver 'd': its function must be a number, a time function"),
        (lambda: frames(Joint("j", "revolute", "a.b", "c.d", axis="z")), "'j': axis must be a vector .* it is 'z'"),
        (lambda: Body("b", "rod.ffr"), "body 'b': its model is 'rod.ffr'; give one of load_body"),
        (lambda: forward(TWO, end=0.1, output_step=0.1, method="ros2"), "method is 'ros2'; give one with its step"),
        (lambda: forward(TWO, end=0.1, output_step=0.1, outputs="cloud.q"), r"write \['cloud.q'\]"),
        (lambda: rigid_body("b", mass=np.nan, inertia=(1, 1, 1)), "mass is nan kg; it must be positive"),
        (lambda: Projection(0.0), "tolerance of the projection is 0"),
        (lambda: Body("b", cloud(3), damping=(0.1, 0.1)), "damping must be 3 numbers"),
        (lambda: with_point(cloud(3), "p", np.array([300.0, 0, 0])), r"point 'p' at \(300, 0, 0\) m is .* in metres"),
        (lambda: truncated(cloud(3), 99), "has 3 modes; asked to keep the first 99$"),
        (lambda: ROS2("1e-3"), r"ROS2 needs a positive step in seconds, such as ROS2\(1e-3\); it is '1e-3'"),
        (lambda: RK4(-1e-3), "RK4 needs a positive step .* it is -0.001"),
        (lambda: ROS3(np.nan), "ROS3 needs a positive step .* it is nan"),
        (lambda: HalfExplicit(None), "HalfExplicit needs a positive step .* it is None"),
        (lambda: GeneralisedAlpha(0), "GeneralisedAlpha needs a positive step .* it is 0"),
        (lambda: HHT(np.inf), "HHT needs a positive step .* it is inf"),
        (lambda: Variational([1e-3]), r"Variational needs a positive step .* it is \[0.001\]"),
        (lambda: forward(TWO, end=0.1, output_step=-0.1), "output step is -0.1 s; it must be positive"),
        (
            lambda: forward(TWO, start=0.1, end=0.0, output_step=0.1),
            "duration, from start to end, is -0.1 s; it must be positive",
        ),
        (lambda: Scene(TWO.bodies[0]), r"bodies of a scene is Body 'cloud' alone; give a tuple, such as \(it,\)"),
        (lambda: Scene(cloud(3)), "bodies of a scene is of the type FlexibleBody; give a tuple"),
        (lambda: Scene((cloud(3),)), "entry 1 is of the type FlexibleBody; it takes: Body"),
        (lambda: replace(TWO, joints=None), "joints of a scene is of the type NoneType; give a tuple"),
        (
            lambda: Load("push", "cloud.b", force=lambda t: (t, 0.0, 0.0)),
            "load 'push': force needs three components, not .*; a function .* goes to `function`",
        ),
        (
            lambda: replace(TWO, forces=(Load("push", "cloud.b"),)),
            "entry 1 is of the type Load; it takes: Bushing, Joint",
        ),
        (lambda: with_point(with_point(cloud(3), "p", np.zeros(3)), "p", np.zeros(3)), "'p' is there more than once"),
    ],
)
def test_declarations_name_the_value_and_the_remedy(make, words):
    with pytest.raises((InputError, BodyError), match=words):
        make()


def test_a_driver_takes_a_number():
    assert Driver("d", "hinge", 0.5).function == constant(0.5)


def pinned(far: tuple[float, float, float], **settings: object) -> Scene:
    """A cloud on two spherical joints, one of them at `far`."""
    model = cloud(3, stiffness=50.0)
    joints = (Joint("near", "spherical", "ground.O", "cloud.a"), Joint("far", "spherical", "ground.F", "cloud.b"))
    return Scene((Body("cloud", model, **settings),), joints, ground={**GROUND, "F": far})


def test_joints_that_only_a_torn_body_could_meet():
    with pytest.raises(InputError, match=r"cannot be assembled without deforming body 'cloud' by .* times its size"):
        assemble(pinned((50.0, 0.0, 0.0)))


@pytest.mark.parametrize(("method", "gain"), [(ROS2, 1e5), (ROS3, 1e4)])
def test_gains_that_lose_the_state_are_named(method, gain):
    scene = replace(TWO, gravity=(0, -9.81, 0))
    with pytest.raises(
        ComputationError, match=rf"Baumgarte's gains of 1e\+0{int(np.log10(gain))} 1/s are too large.*below 1e\+03"
    ):
        forward(scene, end=0.1, output_step=0.05, method=method(1e-3), stabilisation=Baumgarte(gain, gain))


def test_a_load_without_a_value_is_named():
    push = Load("push", "cloud.b", force=(0, operation(SQRT, polynomial(0.01, -1.0)), 0))
    with pytest.raises(ComputationError, match=r"'push' has no value there; look at its formula"):
        forward(replace(TWO, loads=(push,)), end=0.1, output_step=0.01)


def test_a_spring_that_loses_the_state_is_no_mechanism_that_locks():
    spring = SpringDamper("spring", "ground.P", "cloud.b", stiffness=1e14, free_length=2.0)
    with pytest.raises(
        ComputationError, match=r"force 'spring' is too stiff for steps of 0.001 s, in which RK4 takes it explicitly"
    ):
        forward(replace(TWO, springs=(spring,)), end=0.1, output_step=0.01, method=RK4(1e-3))
    with pytest.raises(ComputationError, match=r"'hinge'.* or a stiff spring far from its free length"):
        forward(replace(TWO, springs=(spring,)), end=0.1, output_step=0.01)


def test_a_body_stretched_beyond_theory_is_noted():
    """Without rotation of an interface: modes that move the interfaces alone."""
    model = cloud(2, stiffness=50.0)
    still = tuple(replace(i, phi_r=0 * i.phi_r) for i in model.interfaces)
    scene = Scene((Body("cloud", replace(model, interfaces=still), q=(0.5, 0.0)),))
    result = forward(scene, end=0.02, output_step=0.01)
    assert any("'cloud' deforms by up to" in note and "of its size" in note for note in result.attributes["notes"])


TWO = Scene(
    (Body("cloud", cloud(2, stiffness=50.0)),), (Joint("hinge", "revolute", "ground.O", "cloud.a"),), ground=GROUND
)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("run", "--step", "abc", "scene.toml"), r"'--step': 'abc' is not .* \(ffr-dyn run --help tells more\)$"),
        (("run",), r"Missing argument 'SCENE'. \(ffr-dyn run --help tells more\)$"),
        (("walk",), r"No such command 'walk'. \(ffr-dyn --help tells more\)$"),
    ],
)
def test_a_wrong_call_is_answered_in_a_line_that_names_the_help(capsys, monkeypatch, arguments, said):
    code, told = run_cli(monkeypatch, capsys, *arguments)
    assert code == 2
    assert len(told.splitlines()) == 1
    assert re.search(said, told.strip())


def test_no_command_at_all_gets_the_help(capsys, monkeypatch):
    code, told = run_cli(monkeypatch, capsys)
    assert code == 0
    assert told.startswith("Usage: ffr-dyn [OPTIONS] [COMMAND]")
    assert "economise" in told
