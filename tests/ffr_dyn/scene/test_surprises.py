"""What is given by position, or of another kind than is meant, is answered when it is written: by name, with a remedy."""

from __future__ import annotations

from dataclasses import replace

import pytest

import ffr_dyn as fd

DISC = fd.rigid_body("disc", mass=1.0, inertia=[1, 1, 1], points={"hub": (0, 0, 0), "rim": (1, 0, 0)})
BODY = fd.Body("disc", DISC)
HINGE = fd.Joint("hinge", "revolute", "ground.wall", "disc.hub")
SCENE = fd.Scene([BODY], [HINGE], ground={"wall": (0, 0, 0)})

WRITTEN = {
    "gravity as a number": (lambda: fd.Scene([BODY], gravity=9.81), r"gravity needs three .*\(0, -9.81, 0\), not 9.81"),
    "base acceleration as text": (lambda: fd.Scene([BODY], base_acceleration="xyz"), "base_acceleration needs three"),
    "numbers of a harmonic": (lambda: fd.harmonic(0.5, 1.0), r"harmonic\(0.5, 1.0\): .*amplitude=..., frequency=..."),
    "a harmonic without frequency": (lambda: fd.harmonic(amplitude=0.5), "'frequency'.*its numbers have names"),
    "a constant of text": (lambda: fd.constant("5"), "must be finite numbers"),
    "an input without a name": (lambda: fd.signal(5.0), "5.0 cannot be the name of an input"),
    "a body before its name": (lambda: fd.Body(DISC, "disc"), "the name of a body is a text and comes first"),
    "a file in the place of a body": (lambda: fd.Body("disc", "disc.ffr"), "'disc.ffr'; give one of load_body"),
    "a body in the place of a marker": (
        lambda: fd.Joint("h", "revolute", "ground.wall", BODY),
        "joint 'h': j is 'Body', not a name; give its name, 'disc'",
    ),
    "a marker without a point": (
        lambda: fd.Joint("h", "revolute", "ground.wall", "disc"),
        "joint 'h': j, marker 'disc': write BODY.POINT",
    ),
    "a marker that is missing": (lambda: fd.Joint("h", "revolute", "", "disc.hub"), "joint 'h': i is '', not a name"),
    "a joint of one point": (
        lambda: fd.Joint("h", "revolute", "disc.hub", "disc.hub"),
        "joint 'h' ties 'disc.hub' to itself: i and j are the same",
    ),
    "a joint of one body": (
        lambda: fd.Scene([BODY], [fd.Joint("h", "revolute", "disc.hub", "disc.rim")]),
        "joint 'h' ties 'disc' to itself; a joint needs two different bodies",
    ),
    "a joint in the place of its name": (lambda: fd.Driver("turn", HINGE, 1.0), "joint is 'Joint'.*name, 'hinge'"),
    "a driven point against itself": (
        lambda: fd.PointDriver("lift", "disc.hub", "disc.hub", x=0.0),
        "driver 'lift' ties 'disc.hub' to itself",
    ),
    "a joint in a coupling": (lambda: fd.Coupling("gear", HINGE, "b.angle", 2.0), "coupling 'gear': first is 'Joint'"),
    "a measured body": (lambda: fd.StressMeasurement("s", BODY, (0, 0, 0)), "body is 'Body', not a name.*'disc'"),
    "a place of text": (lambda: fd.StressMeasurement("s", "disc", "tip"), "a point is three coordinates.*'tip'"),
    "a measured marker": (lambda: fd.Measurement("m", "disc", "ground.wall"), "measurement 'm': i, marker 'disc'"),
    "ground without names": (lambda: fd.Scene([BODY], ground=(0, 0, 0)), "ground is .*give points by name"),
    "bodies as text": (lambda: fd.Scene("disc"), "bodies of a scene is str 'disc' alone; give a tuple"),
    "a name that is none": (lambda: fd.Scene([BODY], [replace_name(HINGE, 5)]), "the name of a joint is a text"),
    "a known motion alone": (lambda: mixed(known="turn"), "known is str 'turn' alone; give a tuple"),
    "an unknown force alone": (lambda: mixed(unknown=fd.JointEffort("m", "hinge")), "unknown is JointEffort 'm' alone"),
    "a force at a body": (lambda: fd.MarkerEffort("f", "disc", (1, 0, 0)), "marker 'disc': write BODY.POINT"),
    "a method as text": (lambda: run(method="ros2"), r"method is 'ros2'; give one with its step, such as ROS2\(1e-3\)"),
    "a method without its step": (lambda: fd.Stepper(SCENE, fd.ROS2), r"give one with its step, such as ROS2\(1e-3\)"),
    "stabilisation as text": (lambda: run(stabilisation="projection"), r"'projection'; give Projection\(\), Baum"),
    "an event as text": (lambda: run(events="stop"), "events is str 'stop' alone"),
    "outputs as text": (lambda: run(outputs="*.position"), "outputs must be a list of names"),
    "a file in the place of a scene": (lambda: fd.static("scene.toml"), "'scene.toml', not a Scene; load_scene"),
    "an input alone": (lambda: fd.linearise(SCENE, inputs="push"), "inputs is str 'push' alone"),
}  # fmt: skip


def replace_name(thing: object, name: object) -> object:
    return replace(thing, name=name)


def mixed(**changes: object) -> fd.Result:
    wanted = {"unknown": (fd.JointEffort("m", "hinge"),), "end": 1.0, "output_step": 0.1}
    return fd.mixed(replace(SCENE, drivers=(fd.Driver("turn", "hinge", 0.0),)), **(wanted | changes))


def run(**changes: object) -> fd.Result:
    return fd.forward(SCENE, end=1.0, output_step=0.1, **changes)


@pytest.mark.parametrize("case", WRITTEN)
def test_surprises_are_answered_when_written(case):
    write, answer = WRITTEN[case]
    with pytest.raises(fd.InputError, match=answer):
        write()


@pytest.mark.parametrize(
    "write",
    [
        lambda: fd.Body("disc", DISC, (0, 0, 1)),
        lambda: fd.Joint("h", "revolute", "ground.wall", "disc.hub", (0, 0, 1)),
        lambda: fd.Coupling("gear", "a.angle", "b.angle", 2.0, 0.1),
        lambda: fd.PointDriver("lift", "ground.wall", "disc.hub", 0.0),
        lambda: fd.Tolerances(1e-6, 1e-7),
        lambda: fd.Settings(0.0, 1.0, 0.1, fd.ROS2(1e-3), fd.Projection()),
    ],
)
def test_what_cannot_be_guessed_is_given_by_name_only(write):
    with pytest.raises(fd.InputError, match="is given without its name"):
        write()
