"""Pictures of responses tell the units of their gains, by those of the input and of each output."""

from __future__ import annotations

from dataclasses import replace

import pytest

import ffr_dyn as fd
from ffr_dyn.analyses.rotating.forced import forced_lines
from ffr_dyn.analyses.rotating.response import response_lines
from ffr_dyn.pictures.bode import labelled
from ffr_prep.common.units import pretty

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
        (DRIVEN, "motor.angle", ["motor.effort", "rod.b.position.y"], "rad", ["N m", "m"]),
    ],
)
def test_a_response_knows_the_units_of_its_gains(scene, given, outputs, per, units):
    found = fd.response(scene, input=given, outputs=outputs, band_of=(0.5, 10.0))
    assert found.attributes["input_unit"] == per
    assert found.attributes["output_units"] == units


@pytest.mark.parametrize(
    ("outputs", "unit", "first", "squared"),
    [
        (["hinge.angle"], "rad/(N m)", "rad/(N m)", "rad^2/Hz"),
        ([Y, "hinge.angle"], "m/s^2/(N m), rad/(N m)", "m/s^2/(N m)", "(m/s^2)^2/Hz"),
    ],
)
def test_gains_have_the_units_of_output_over_input(tmp_path, outputs, unit, first, squared):
    """In the quantity, in the file, and in the headings of tables: all of them said 1."""
    found = fd.response(
        SPRUNG, input="hinge.moment", outputs=outputs, band_of=(0.5, 10.0), psd=[(0.5, 1.0), (9.0, 1.0)]
    )
    name = outputs[0].replace(".", " ")
    assert {found.quantity(one).unit for one in ("gain", "transfer", "parts")} == {unit}
    assert found.quantity(f"density.{name}").unit == squared
    again = fd.load_result(fd.save_result(found, tmp_path / "found.nc"))
    assert again.quantity(f"transfer.{name}.re").unit == first
    heading = fd.write_csv(again, tmp_path / "found.csv", ["gain"]).read_text().splitlines()[0]
    assert heading.startswith(f"time [s],gain.{name} [{first}]")
    assert any(f"gain {found['gain'][0, 0]:.5g} {pretty(first)} at" in line for line in response_lines(found))


def test_amplitudes_have_the_units_of_their_outputs():
    """Of forced vibrations they said 1."""
    given = {"input": "hinge.moment", "amplitude": 1e-3, "band_of": (1.0, 3.0)}
    found = fd.forced(SPRUNG, outputs=["rod.b.position.y", "hinge.angle"], **given)
    assert [found.quantity(name).unit for name in ("amplitude", "mean", "harmonics")] == ["m, rad"] * 3
    assert found.quantity("harmonics.hinge angle.2").unit == "rad"
    assert any(" m at " in line for line in forced_lines(found))


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
