"""Arguments of another type are answered at the front doors with name, value and what to give."""

from __future__ import annotations

import pickle
import re
from contextlib import suppress
from inspect import Parameter, isabstract, isclass, isfunction, signature

import numpy as np
import pytest

import ffr_dyn as fd
import ffr_prep as fp

ROD = fd.rigid_body("rod", mass=1.0, inertia=(1e-3, 0.1, 0.1), points={"a": (0, 0, 0), "b": (1, 0, 0)})
HINGE = fd.Joint("hinge", "revolute", "ground.wall", "rod.a", axis=(0, 0, 1))
SCENE = fd.Scene(bodies=[fd.Body("rod", ROD)], joints=[HINGE], ground={"wall": (0, 0, 0)})
LINE = fp.polyline([(0, 0, 0), (1, 0, 0)], fp.Member(fp.circle(0.02), fp.material("steel")))
ODD = object()

ANSWERS = {
    "a text for a number": (lambda: fd.forward(SCENE, end="1", output_step=0.1), "end is '1', of the type str; give a num"),
    "of a moment": (lambda: fd.linearise(SCENE, time="0"), "the time to assemble a scene for is of the type str"),
    "a whole number": (lambda: fp.polyline(LINE.points, LINE.members[0], elements="4"), "elements is '4'.*a whole number"),
    "no path": (lambda: fp.read_frame(3, {}), "read_frame: path is 3, of the type int; give a text or a path"),
    "no scene": (lambda: fd.scene_at(3, 4), "scene_at: scene is 3, of the type int; give a Scene"),
    "no result": (lambda: fd.scene_at(SCENE, 3), "scene_at: result is 3, of the type int; give a Result"),
    "a file for a result": (lambda: fd.plot("run.nc", ["a"], "a.png"), "plot: result is 'run.nc'.*give a Result"),
    "of a class": (lambda: fd.Tolerances("small"), "Tolerances: relative is 'small', of the type str; give a number"),
    "no function": (lambda: fd.static(SCENE, outputs=3), "static: outputs is 3.*give a tuple, each of it a text"),
    "of keywords": (lambda: fp.named(LINE, tip="end"), r"named: tip is 'end'.*give \(a number, a number, a number\)"),
    "of several": (lambda: fp.joined(LINE, "line"), r"joined: frames\[1\] is 'line', of the type str; give a Frame"),
    "an item": (lambda: fd.harmonic(amplitude=1.0, frequency=[1]), r"harmonic: frequency is \[1\].*give a number"),
    "an array": (lambda: fp.BeamForces(3, 4, 5), "BeamForces: positions is 3, of the type int; give an array of numbers"),
    "a flag": (lambda: fd.forward(SCENE, end=1, output_step=0.1, check="no"), "forward: check is 'no', of the type str; g"),
    "a flag of a class": (lambda: fd.Forward(check=[]), r"Forward: check is \[\], of the type list; give True or False"),
    "one frequency": (lambda: fd.response(SCENE, input="hinge.moment", outputs=["hinge.angle"], frequencies=3),
                      r"frequencies is 3; give a list of them \[Hz\]"),
    "a protocol": (lambda: fd.measure_steps(SCENE, 3), "measure_steps: method is 3, of the type int; give an Integrator"),
    "a class": (lambda: fd.register_force(3), "register_force: kind is 3, of the type int; give a class"),
    "long": (lambda: fp.triangulated("x" * 99), r"triangulated: frame is 'x{59}\.\.\., of the type str; give a Frame"),
    "an output step": (lambda: fd.forward(SCENE, end=1, output_step="0.1"), "the output step is of the type str"),
    "a time": (lambda: fd.static(SCENE, time="1"), "the time to assemble a scene for is of the type str; give seconds"),
    "settings": (lambda: fd.Settings(start=0, end="1", output_step=0.1, method=fd.ROS2(1e-3)), "end is of the type str"),
    "a moment": (lambda: fd.MomentSettings(time="1"), "time is of the type str; give seconds"),
    "a mass": (lambda: fd.rigid_body("rod", mass="1", inertia=(1, 1, 1)), "'rod': mass is of the type str; give kilograms"),
    "a number for a name": (lambda: fd.assembly(SCENE)[3], "the name of a quantity is of the type int; give one such as"),
    "a stiffness": (lambda: fd.Bushing("m", "ground.wall", "rod.a", stiffness=3), r"stiffness must have the shape \(6,\)"),
    "no transfer": (lambda: fd.draw_nyquist(fd.assembly(SCENE), "a.png"), "transfer"),
    "no such row": (lambda: fd.scene_at(SCENE, fd.assembly(SCENE), 7), "no row 7; give one of 0 to 0"),
    "scale": (lambda: fp.mode_pictures(ROD, "modes", scale="big"), "no surface|scale"),
}  # fmt: skip


@pytest.mark.parametrize("name", ANSWERS)
def test_another_type_is_answered(name):
    call, words = ANSWERS[name]
    with pytest.raises(fd.InputError, match=words):
        call()


CALLS = {
    "missing": (lambda: fd.forward(end=1), "forward: scene and output_step are missing; give scene=..."),
    "one is missing": (lambda: fp.polyline([(0, 0, 0), (1, 0, 0)]), "polyline: member is missing; give member=..."),
    "unknown": (lambda: fd.rigid_body("a", mas=1), "rigid_body: there is no argument 'mas'; did you mean 'mass'?"),
    "of settings": (
        lambda: fd.inverse(SCENE, end=1, output_step=0.1, begin="steady"),
        "inverse: there is no argument 'begin'; Dynamic has it: elastic=Dynamic(begin=...)",
    ),
    "none alike": (
        lambda: fd.Tolerances(1e-6, noise=2),
        "Tolerances: there is no argument 'noise'; there are relative, position, velocity and elastic",
    ),
    "without its name": (
        lambda: fd.Body("rod", ROD, (0, 0, 1)),
        "Body: (0, 0, 1) is given without its name, as only name and model may be; write position=(0, 0, 1) if that is meant",
    ),
    "without any name": (lambda: fd.Settings(0.0), "Settings: 0.0 is given without its name; write start=0.0 if"),
    "one too many": (lambda: fp.circle(1, 2), "circle: 2 is given without its name, as only d may be"),
    "given twice": (
        lambda: fd.static(SCENE, scene=SCENE),
        "static: scene is given twice, by its place and by its name",
    ),
}


@pytest.mark.parametrize("name", CALLS)
def test_arguments_that_are_missing_or_unknown_are_answered(name):
    call, words = CALLS[name]
    with pytest.raises(fd.InputError, match=f"^{re.escape(words)}"):
        call()


def required(thing: object) -> list[Parameter]:
    return [
        of
        for of in signature(thing).parameters.values()
        if of.default is of.empty and of.kind not in (of.VAR_POSITIONAL, of.VAR_KEYWORD)
    ]


DOORS = [(door, name) for door in (fd, fp) for name in door.__all__[1:]]
CALLED = [  # but for what keeps what it is given
    (door, name)
    for door, name in DOORS
    if not name.startswith("register_") and (isfunction(getattr(door, name)) or isclass(getattr(door, name)))
]


@pytest.mark.parametrize(("door", "name"), CALLED, ids=[name for _, name in CALLED])
def test_nothing_that_fails_for_an_object_fails_otherwise(door, name):
    thing = getattr(door, name)
    if isclass(thing) and (issubclass(thing, Exception) or getattr(thing, "_is_protocol", False) or isabstract(thing)):
        return
    given = required(thing)
    places = [ODD for of in given if of.kind is not of.KEYWORD_ONLY]
    with suppress(fd.InputError):
        thing(*places, **{of.name: ODD for of in given if of.kind is of.KEYWORD_ONLY})


def test_failures_of_right_arguments_stay_what_they_are():
    with pytest.raises(ZeroDivisionError):
        fp.from_frame(LINE, [fp.InterfaceRegion("nearest 0,0,0")], progress=lambda text: 1 / 0)


def test_what_the_door_hands_out_is_pickled_and_knows_its_signature():
    assert pickle.loads(pickle.dumps(fd.forward)) is fd.forward
    assert list(signature(fp.tube).parameters) == ["d", "t"]
    assert fp.Frame is type(LINE)
    assert np.array_equal(pickle.loads(pickle.dumps(LINE)).points, LINE.points)
