"""Pictures of responses tell the units of their gains, by those of the input and of each output."""

from __future__ import annotations

from dataclasses import replace

import pytest

import ffr_dyn as fd
from ffr_dyn.pictures.bode import labelled

ROD = fd.rigid_body("rod", mass=1.0, inertia=(1e-3, 0.1, 0.1), points={"a": (-0.5, 0, 0), "b": (0.5, 0, 0)})
SPRUNG = fd.Scene(
    bodies=[fd.Body("rod", ROD, position=(0.5, 0, 0))],
    joints=[fd.Joint("hinge", "revolute", "ground.wall", "rod.a", axis=(0, 0, 1))],
    ground={"wall": (0, 0, 0)},
    forces=[fd.JointSpring("spring", "hinge", stiffness=100.0, damping=0.5)],
    loads=[fd.Load("push", "rod.b", force=(0, 1.0, 0))],
)
DRIVEN = replace(SPRUNG, forces=(), loads=(), drivers=(fd.Driver("motor", "hinge", 0.0),))
Y = "rod.b.acceleration.y"


@pytest.mark.parametrize(
    ("scene", "given", "outputs", "per", "units"),
    [
        (SPRUNG, "hinge.moment", [Y, "hinge.angle"], "N m", ["m/s^2", "rad"]),
        (SPRUNG, "rod.b.force.y", ["rod.b.position"], "N", ["m", "m", "m"]),
        (SPRUNG, "base.y", [Y], "m/s^2", ["m/s^2"]),
        (SPRUNG, "base.y.displacement", ["rod.b.position.y"], "m", ["m"]),
        (SPRUNG, "push", ["hinge.angle"], "1", ["rad"]),
        (DRIVEN, "motor.angle_rate", ["rod.b.velocity.y"], "rad/s", ["m/s"]),
        (DRIVEN, "motor.moment", ["motor.effort"], "N m", ["N m"]),
    ],
)
def test_a_response_knows_the_units_of_its_gains(scene, given, outputs, per, units):
    found = fd.response(scene, input=given, outputs=outputs, band_of=(0.5, 10.0))
    assert found.attributes["input_unit"] == per
    assert found.attributes["output_units"] == units


def test_curves_are_named_with_their_units(tmp_path):
    found = fd.response(SPRUNG, input="hinge.moment", outputs=[Y], band_of=(0.5, 10.0))
    assert labelled(found) == [f"{Y} [m/s^2]"]
    fd.save_result(found, tmp_path / "found.nc")
    again = fd.load_result(tmp_path / "found.nc")
    assert labelled(again) == labelled(found)
    text = fd.draw_bode(again, tmp_path / "bode.svg").read_text(encoding="utf-8")
    assert "per N m" in text
    older = replace(found, attributes={k: v for k, v in found.attributes.items() if "unit" not in k})
    assert labelled(older) == [Y]
    fd.draw_bode(older, tmp_path / "older.svg")
