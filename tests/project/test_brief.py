"""What one can print says what one wants to know, in at most ten lines and a thousand characters."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from synthetic import cloud

import ffr_dyn as fd
from ffr_dyn.consistency.evaluation import evaluate, evaluator
from ffr_prep.common.brief import ROWS, WIDTH, as_text, cut, in_short, listed

LINKS = 40


def chain() -> fd.Scene:
    """Many bodies, with long names, one of them flexible with many coordinates."""
    link = fd.rigid_body("link", mass=1.0, inertia=[1, 1, 1], points={"a": (0, 0, 0), "b": (1, 0, 0)})
    names = [f"a_link_with_a_long_name_{k}" for k in range(LINKS)]
    bodies = [fd.Body(name, link, position=(k, 0.0, 0.0)) for k, name in enumerate(names)]
    ends = ["ground.wall", *(f"{name}.b" for name in names[:-1])]
    joints = [fd.Joint(f"hinge_{k}", "revolute", i, f"{n}.a") for k, (i, n) in enumerate(zip(ends, names, strict=True))]
    bodies.append(fd.Body("flexible", cloud(7)))
    free = fd.Joint("held", "fixed", "ground.wall", "flexible.a")
    return fd.Scene(bodies, [*joints, free], ground={"wall": (0, 0, 0)}, gravity=(0, -9.81, 0), name="chain")


SCENE = chain()


def is_brief(thing: object) -> bool:
    text = repr(thing)
    return len(text) <= 1000 and len(text.splitlines()) <= 10


@pytest.fixture(scope="module")
def things() -> dict[str, object]:
    assembled = fd.assemble(SCENE)
    at = evaluator(assembled.system)
    times = np.linspace(0, 1, 500)
    result = fd.kinematic(driven(), end=0.1, output_step=1e-3)
    return {
        "scene": SCENE,
        "rigid body": SCENE.bodies[0],
        "flexible body": SCENE.bodies[-1],
        "table": fd.table(times, times**2),
        "curve": fd.Curve(times, times),
        "assembled": assembled,
        "system": assembled.system,
        "block": assembled.system.blocks[0],
        "word": assembled.system.blocks[0].words[0],
        "layout": assembled.system.layout,
        "elimination": assembled.system.elimination,
        "evaluator": at,
        "engine": at.engine,
        "work": at.work,
        "model": at.system.model,
        "tables": at.engine.tables,
        "row": at.record,
        "evaluation": evaluate(at, 0.0, assembled.x, assembled.v),
        "mobility": fd.mobility(SCENE),
        "result": result,
        "quantity": result.quantity("disc.rim.position"),
    }


def driven() -> fd.Scene:
    disc = fd.rigid_body("disc", mass=1.0, inertia=[1, 1, 1], points={"hub": (0, 0, 0), "rim": (1, 0, 0)})
    hinge = fd.Joint("hinge", "revolute", "ground.wall", "disc.hub")
    motor = fd.Driver("motor", "hinge", fd.polynomial(0, 3.0))
    return fd.Scene([fd.Body("disc", disc)], [hinge], [motor], ground={"wall": (0, 0, 0)}, name="turntable")


def test_everything_prints_in_ten_lines(things):
    long = {name: repr(thing) for name, thing in things.items() if not is_brief(thing)}
    assert long == {}


def test_a_scene_tells_its_parts():
    text = repr(driven())
    for words in ("turntable", "disc", "hinge (revolute)", "motor", "wall", "(0, 0, 0)"):
        assert words in text
    assert f"{LINKS + 1} in all" in repr(SCENE)


def test_a_body_tells_its_mass_its_points_and_its_frequencies():
    text = repr(replace(SCENE.bodies[-1], damping=0.02, dropped=("I9",)))
    for words in ("flexible", "kg", "Hz", "0.02", "I9", "points", "position [m]"):
        assert words in text


def test_a_result_tells_what_is_in_it(things):
    text = repr(things["result"])
    for words in ("turntable", "kinematic", "complete", "101 rows", "0 to 0.1 s", "disc"):
        assert words in text


def test_notebooks_get_a_table(things):
    for name in ("scene", "flexible body", "result"):
        html = things[name]._repr_html_()
        assert html.startswith("<table>")
        assert html.count("<tr>") <= ROWS
    named = replace(driven(), name="a<b")
    assert "a&lt;b" in named._repr_html_()


def test_a_stepper_tells_where_it_is():
    motor = fd.Actuator("push", "hinge", force=fd.signal("torque", 2.0))
    stepper = fd.Stepper(replace(driven(), drivers=(), forces=(motor,)), fd.ROS2(1e-3), outputs=("hinge.angle",))
    assert is_brief(stepper)
    assert "torque = 2" in repr(stepper)
    assert "hinge.angle" in repr(stepper)
    assert is_brief(stepper.save())


# ---- the pieces -----------------------------------------------------------------------------------------------------


def test_what_fits_stays_on_a_line():
    assert as_text("Point", [("x", "1"), ("y", "2")]) == "Point(x=1, y=2)"
    assert as_text("Scene 'a'", [("x", "1")]).splitlines() == ["Scene 'a'", "  x  1"]


def test_too_many_rows_are_named_in_the_last():
    lines = as_text("Thing", [(f"row{k}", 60 * "x") for k in range(20)]).splitlines()
    assert len(lines) == 1 + ROWS
    assert "row19" in lines[-1]


def test_lines_are_cut():
    assert cut("a\nb") == "a ..."
    assert len(cut(200 * "x")) <= WIDTH


def test_values_in_short():
    assert in_short(np.zeros((3, 4))) == "float64 (3, 4)"
    assert in_short(np.array([0.5, 1.0])) == "(0.5, 1)"
    assert in_short(()) == "()"
    assert in_short({"a": 1}) == "1: a"
    assert in_short(driven().joints) == "(Joint 'hinge')"
    assert listed([]) == "none"
