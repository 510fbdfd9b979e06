"""Gears, racks and screws: rows against differences, the readable twin and closed forms; many turns; errors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from synthetic import cloud

import ffr_dyn as fd
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.compile.engine import evaluate_at, new_engine
from ffr_dyn.compile.scene_tables import compile_scene
from ffr_dyn.equations.constraint_rows import rows_at
from ffr_dyn.equations.layout import layout
from ffr_dyn.functions.rotation import G_bar, rotation_matrix
from ffr_dyn.functions.time_functions import polynomial
from ffr_dyn.integrators import RK4
from ffr_dyn.kernels.tables import OK
from ffr_dyn.scene.couplings import Coupling
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import rigid_body
from ffr_prep.common.errors import InputError

GROUND = {"O": (0.0, 0, 0), "P": (0.3, 0.1, 0)}


def arm(n: int = 3) -> Scene:
    """Two flexible links on cylindrical joints, the second on the first."""
    axes = {"axis": (0.2, 1.0, 0.3), "axis_j": (1.0, -0.5, 0.4)}
    return Scene(
        (Body("one", cloud(n, seed=1)), Body("two", cloud(2, seed=2))),
        (
            Joint("root", "cylindrical", "ground.O", "one.a", **axes),
            Joint("tie", "cylindrical", "one.b", "two.c", **axes),
        ),
        ground=GROUND,
    )


def state(scene: Scene, seed: int = 3):
    rng, place = np.random.default_rng(seed), layout(scene)
    x, v = rng.normal(size=place.x_size), rng.normal(size=place.v_size)
    for b in range(len(scene.bodies)):
        x[place.p(b)] /= np.linalg.norm(x[place.p(b)])
        x[place.q(b)] *= 0.05
    return place, x, v


def moved(scene, place, x, v, h):
    y = x.copy()
    for b in range(len(scene.bodies)):
        y[place.R(b)] += h * v[place.R_dot(b)]
        y[place.q(b)] += h * v[place.q_dot(b)]
        half = 0.5 * h * v[place.omega(b)]
        angle, p = np.linalg.norm(half), x[place.p(b)]
        y[place.p(b)] = np.cos(angle) * p + np.sinc(angle / np.pi) * (G_bar(p).T @ half)
    return y


PAIRS = [(a, b) for a in ("root.angle", "root.stroke") for b in ("tie.angle", "tie.stroke")]


@pytest.mark.parametrize(("first", "second"), PAIRS)
def test_jacobian_and_right_hand_side_of_a_coupling_equal_differences(first, second):
    scene = replace(arm(), couplings=(Coupling("gear", first, second, -1.5, offset=0.2),))
    place, x, v = state(scene)
    block = [b for b in compile_scene(scene).blocks if b.name == "gear"]
    acc, h = np.random.default_rng(5).normal(size=place.v_size), 1e-5
    rates = acc.copy()
    for b in range(2):
        rates[place.R_dot(b)] = rotation_matrix(x[place.p(b)]) @ acc[place.R_dot(b)]

    def row(s):
        return rows_at(scene, place, block, moved(scene, place, x, v + 0.5 * s * rates, s), v + s * rates, 0.0)[0]

    here, ahead, behind = row(0.0), row(h), row(-h)
    assert here.nu == pytest.approx((ahead.Phi - behind.Phi) / (2 * h), abs=2e-8)
    assert here.jacobian @ acc - here.gamma == pytest.approx((ahead.nu - behind.nu) / (2 * h), abs=2e-6)


@pytest.mark.parametrize(("first", "second"), PAIRS)
def test_compiled_couplings_equal_the_readable_ones_and_the_dense_solution(first, second):
    scene = replace(arm(), couplings=(Coupling("gear", first, second, -1.5, offset=0.2),))
    system = compile_scene(scene)
    place, x, v = state(scene)
    engine = new_engine(system, x, v)
    assert evaluate_at(engine, 0.0, x, v) == OK
    work = engine.work
    rows = rows_at(scene, place, list(system.blocks), x, v, 0.0)
    for name in ("Phi", "nu", "gamma"):
        np.testing.assert_allclose(getattr(work.rows, name), [getattr(r, name) for r in rows], rtol=0, atol=1e-11)
    J = np.array([r.jacobian for r in rows])
    np.testing.assert_allclose(J @ work.bodies.acc, work.rows.gamma, rtol=0, atol=1e-9)


def wheel(name: str, inertia: float):
    points = {"o": np.zeros(3)}
    return rigid_body(name, mass=1.0, inertia=(inertia, inertia, inertia), points=points)


def train(ratio: float) -> Scene:
    return Scene(
        (Body("a", wheel("a", 0.02)), Body("b", wheel("b", 0.05), position=(0.3, 0.1, 0))),
        (Joint("ja", "revolute", "ground.O", "a.o"), Joint("jb", "revolute", "ground.P", "b.o")),
        couplings=(Coupling("gear", "ja.angle", "jb.angle", ratio),),
        ground=GROUND,
    )


def test_a_gear_train_runs_up_over_many_turns_as_its_reduced_inertia_says():
    """Torque T on the first wheel: angular acceleration T / (J_a + ratio^2 J_b), for a hundred radians."""
    from ffr_dyn.scene.forces import Load

    ratio = -17 / 41
    scene = replace(train(ratio), loads=(Load("motor", "a.o", moment=(0, 0, 0.8)),))
    result = integrate(scene, end=3.0, output_step=0.01, method=RK4(2.5e-4))
    expected = 0.8 / (0.02 + ratio**2 * 0.05) * result.time**2 / 2
    assert expected[-1] > 100
    np.testing.assert_allclose(result["ja.angle"], expected, rtol=0, atol=1e-7)
    np.testing.assert_allclose(result["jb.angle"], ratio * expected, rtol=0, atol=1e-7)
    assert result["constraint.position"].max() < 1e-9


def test_a_rack_moves_by_the_pitch_radius_times_the_angle():
    slide = rigid_body("rack", mass=2.0, inertia=(1, 1, 1), points={"o": np.zeros(3)})
    scene = Scene(
        (Body("pinion", wheel("pinion", 0.02)), Body("rack", slide, position=(0.3, 0.1, 0))),
        (
            Joint("turn", "revolute", "ground.O", "pinion.o"),
            Joint("slide", "translational", "ground.P", "rack.o", axis=(1.0, 0, 0)),
        ),
        drivers=(Driver("motor", "turn", polynomial(0, 0, 5.0)),),
        couplings=(Coupling("rack_and_pinion", "turn.angle", "slide.stroke", 0.04),),
        ground=GROUND,
    )
    result = integrate(scene, end=2.0, output_step=0.1, method=RK4(1e-3))
    np.testing.assert_allclose(result["slide.stroke"], 0.04 * 5.0 * result.time**2, rtol=0, atol=1e-9)
    torque = result["motor.moment"][-1, 2]
    assert torque == pytest.approx((0.02 + 2.0 * 0.04**2) * 10.0, rel=1e-9)


def test_a_screw_under_its_weight_turns_as_pitch_and_inertia_say():
    """m g along the axis, J the inertia about it: stroke acceleration m g / (m + J (2 pi / pitch)^2)."""
    nut = rigid_body("nut", mass=3.0, inertia=(0.1, 0.1, 0.004), points={"o": np.zeros(3)})
    scene = Scene(
        (Body("nut", nut),),
        (Joint("thread", "screw", "ground.O", "nut.o", pitch=0.2),),
        ground=GROUND,
        gravity=(0, 0, -9.81),
    )
    result = integrate(scene, end=1.5, output_step=0.1, method=RK4(1e-4))
    lead = 0.2 / (2 * np.pi)
    expected = -3.0 * 9.81 / (3.0 + 0.004 / lead**2) * result.time**2 / 2
    np.testing.assert_allclose(result["thread.stroke"], expected, rtol=0, atol=1e-9)
    np.testing.assert_allclose(result["thread.angle"], expected / lead, rtol=0, atol=1e-7)
    axial = result["thread.force"][-1, 2]
    assert axial == pytest.approx(3.0 * (9.81 + 2 * expected[-1] / 1.5**2), rel=1e-8)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"first": "ja"}, ["joint.angle"]),
        ({"first": "ja.stroke"}, ["revolute", "'ja'", "no coordinate 'stroke'"]),
        ({"first": "jx.angle"}, ["no joint 'jx'", "'ja'"]),
        ({"ratio": np.sqrt(2)}, ["numbers of teeth"]),
        ({"ratio": 0.0}, ["not zero"]),
        ({"ratio": np.nan}, ["finite"]),
    ],
)
def test_couplings_that_cannot_be_are_refused(change, words):
    scene = train(2.0)
    with pytest.raises(InputError) as caught:
        replace(scene, couplings=(replace(scene.couplings[0], **change),))
    for word in ["'gear'", *words]:
        assert word in str(caught.value)


@pytest.mark.parametrize("analysis", [fd.kinematic, fd.inverse, fd.forward])
@pytest.mark.parametrize("driven", ["3 + t", "7 + t", "25 + 3 * t", "-40 - 2 * t", "0.2 * t"])
def test_couplings_hold_in_the_turns_that_a_driver_tells(driven, analysis):
    """A pinion drives a rack; its wheel drives another half as fast, on a screw."""
    slide = rigid_body("rack", mass=2.0, inertia=(1, 1, 1), points={"o": np.zeros(3)})
    train = Scene(
        (
            Body("pinion", wheel("pinion", 0.02)),
            Body("rack", slide, position=(0.3, 0.1, 0)),
            Body("wheel", wheel("wheel", 0.05), position=(0.3, 0.1, 0)),
            Body("nut", wheel("nut", 0.01)),
        ),
        (
            Joint("turn", "revolute", "ground.O", "pinion.o"),
            Joint("slide", "translational", "ground.P", "rack.o", axis=(1.0, 0, 0)),
            Joint("axle", "revolute", "ground.P", "wheel.o"),
            Joint("thread", "screw", "ground.O", "nut.o", pitch=0.05),
        ),
        drivers=(Driver("motor", "turn", fd.formula(driven)),),
        couplings=(
            Coupling("teeth", "turn.angle", "slide.stroke", 0.04, offset=0.2),
            Coupling("gear", "turn.angle", "axle.angle", -17 / 41, offset=0.1),
            Coupling("belt", "axle.angle", "thread.angle", 0.5),
        ),
        ground=GROUND,
    )
    result = analysis(train, end=1.0, output_step=0.1)
    angle = eval(driven, {"t": result.time})
    geared = 0.1 - 17 / 41 * angle
    for name, expected in (("slide.stroke", 0.2 + 0.04 * angle), ("thread.stroke", 0.025 * geared / (2 * np.pi))):
        np.testing.assert_allclose(result[name], expected, rtol=0, atol=1e-9)
    np.testing.assert_allclose(np.exp(1j * result["axle.angle"]), np.exp(1j * geared), rtol=0, atol=1e-9)


def test_the_rack_is_drawn_where_it_is_meant():
    """Drawn four turns on, it is not moved to where it would be without them."""
    from ffr_dyn.consistency.assemble import assemble

    slide = rigid_body("rack", mass=2.0, inertia=(1, 1, 1), points={"o": np.zeros(3)})
    rack = Scene(
        (Body("pinion", wheel("pinion", 0.02), rotation=(0, 0, 25.0)), Body("rack", slide, position=(1.0, 0, 0))),
        (
            Joint("turn", "revolute", "ground.O", "pinion.o"),
            Joint("slide", "translational", "ground.O", "rack.o", axis=(1.0, 0, 0)),
        ),
        couplings=(Coupling("teeth", "turn.angle", "slide.stroke", 0.04),),
        ground=GROUND,
    )
    for drivers in ((), (Driver("motor", "turn", polynomial(25.0)),)):
        found = assemble(replace(rack, drivers=drivers))
        assert not any("assembly" in note for note in found.notes)


def test_turns_of_a_driver_that_a_spring_does_not_count_are_told():
    spun = Scene(
        (Body("a", wheel("a", 0.02)),),
        (Joint("turn", "revolute", "ground.O", "a.o"),),
        drivers=(Driver("motor", "turn", fd.formula("10 * t")),),
        forces=(fd.JointSpring("coil", "turn", stiffness=2.0),),
        ground=GROUND,
    )
    wound = fd.forward(spun, end=0.5, output_step=0.1, start=0.0)
    assert not any("whole turns" in note for note in wound.attributes["notes"])
    torque = wound["coil.torque"][-1]
    assert torque == pytest.approx(-10.0, rel=1e-9)
    later = fd.static(spun, time=0.5)
    assert any("begins 1 whole turns on, and 'coil'" in note for note in later.attributes["notes"])
    counted = replace(spun, forces=(replace(spun.forces[0], turns=1),))
    found = fd.static(counted, time=0.5)
    assert found["coil.torque"][0] == pytest.approx(torque, rel=1e-9)
    assert not any("whole turns" in note for note in found.attributes["notes"])


def pair(ratio: float, driver: str, screw: float | None = None, forces=()) -> Scene:
    """Two wheels, the second `ratio` times as far as the first; with a pitch the second on a screw."""
    second = {"kind": "revolute"} if screw is None else {"kind": "screw", "pitch": screw}
    return Scene(
        (Body("a", wheel("a", 0.02)), Body("b", wheel("b", 0.02))),
        (Joint("one", "revolute", "ground.O", "a.o"), Joint("two", i="ground.O", j="b.o", **second)),
        drivers=(Driver("motor", "one", fd.formula(driver)),),
        couplings=(Coupling("gear", "one.angle", "two.angle", ratio, offset=0.2),),
        forces=forces,
        ground=GROUND,
    )


@pytest.mark.parametrize("ratio", [1.0, -0.5, 7 / 3, -20 / 40, 3.0])
@pytest.mark.parametrize("begun", ["4*pi + 0.3", "-2*pi", "0.4*2*pi"])
def test_the_angle_of_a_coupled_joint_has_the_turns_of_its_driver(ratio, begun):
    """Not within half a turn: the coupling holds between the angles of the result."""
    scene = pair(ratio, f"{begun} + 5*t")
    forward = fd.forward(scene, end=1.0, output_step=0.1, method=fd.RK4(1e-2), check=False)
    for found in (forward, fd.kinematic(scene, end=1.0, output_step=0.5), fd.assembly(scene)):
        np.testing.assert_allclose(found["two.angle"], ratio * found["one.angle"] + 0.2, atol=1e-8)


def test_the_angle_of_a_screw_and_of_a_pinion_have_the_turns_of_their_strokes():
    """Drawn some turns along: a stroke tells them, whether something is driven or not."""
    body = fd.rigid_body("nut", mass=1.0, inertia=(0.01,) * 3, points={"o": (0, 0, 0)})
    screw = Joint("screw", "screw", "ground.O", "nut.o", pitch=0.01)
    drawn = Scene((Body("nut", body, position=(0, 0, 0.0423)),), (screw,), ground=GROUND, gravity=(0, 0, 1.0))
    found = fd.forward(drawn, end=0.5, output_step=0.1, method=fd.RK4(1e-2), check=False)
    np.testing.assert_allclose(found["screw.angle"], 2 * np.pi * found["screw.stroke"] / 0.01, atol=1e-6)
    assert found["screw.angle"][0] == pytest.approx(4.23 * 2 * np.pi, abs=2.0)


def test_turns_of_a_coupling_that_a_spring_does_not_count_are_told():
    """The motor begins within half a turn, what it drives three times as fast does not."""
    coil = fd.JointSpring("coil", "two", stiffness=2.0)
    notes = fd.static(pair(3.0, "2.5", forces=(coil,))).attributes["notes"]
    assert any("a coupling of what is driven begins 1 whole turns on, and 'coil'" in note for note in notes)
    counted = fd.static(pair(3.0, "2.5", forces=(replace(coil, turns=1),)))
    assert not any("whole turns" in note for note in counted.attributes["notes"])
    assert counted["coil.torque"][0] == pytest.approx(-2.0 * counted["two.angle"][0]) == pytest.approx(-15.4)
