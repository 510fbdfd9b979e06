"""Scenes that are stepped from outside: the same motion as a run, inputs, outputs, states kept and taken back."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pytest
from synthetic import cloud

from ffr_dyn.analyses.integration import integrate
from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.functions.formula import formula
from ffr_dyn.functions.time_functions import harmonic, polynomial, signal
from ffr_dyn.integrators import RK4, ROS2, DormandPrince
from ffr_dyn.realtime.stepper import Stepper
from ffr_dyn.results.quantities import catalogue
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.forces import Actuator, Load, Servo, SpringDamper
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_dyn.scene_file.read import load_scene
from ffr_dyn.scene_file.write import to_toml
from ffr_prep.body import rigid_body
from ffr_prep.common.errors import ComputationError, InputError

METHOD = ROS2(1e-3)
COORDINATES = ("hinge.angle", "rail.angle", "rail.stroke")


def arm(**forces) -> Scene:
    """A flexible arm on a hinge with a slider behind it."""
    arm, bob = cloud(3), rigid_body("bob", mass=0.5, inertia=(0.01, 0.01, 0.01), points={"c": (0, 0, 0)})
    at = arm.interfaces[1].position - arm.interfaces[0].position
    return Scene(
        bodies=(Body("arm", arm, omega_bar=(0, 0, 2), damping=0.02), Body("bob", bob, position=at)),
        joints=(Joint("hinge", "revolute", "ground.O", "arm.a"), Joint("rail", "cylindrical", "arm.b", "bob.c")),
        springs=(SpringDamper("spring", "arm.c", "bob.c", 20.0, 0.5, 1.0),),
        ground={"O": arm.interfaces[0].position},
        gravity=(0, -9.81, 0),
        **forces,
    )


TWISTED = arm(forces=(Actuator("motor", "hinge", force=signal("torque")),))


def stepped(stepper: Stepper, count: int) -> dict[str, np.ndarray]:
    stepper.step(count)
    return {name: values.copy() for name, values in stepper.outputs().items()}


# ---- the same motion as a run -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", [ROS2(1e-3), RK4(1e-3)], ids=repr)
def test_steps_are_those_of_a_run_to_the_bit(method):
    run = integrate(arm(), end=0.2, output_step=0.01, method=method, outputs=("default", "*.acceleration"))
    stepper = Stepper(arm(), method, outputs=("default", "*.acceleration"))
    for row in range(1, 21):
        outputs = stepped(stepper, 10)
        assert stepper.time == run.time[row]
        assert set(outputs) == set(run.quantities)
        for name, values in outputs.items():
            apart = 1e-14 if name in COORDINATES else 0.0  # measured in the time loop, which sums in another order
            np.testing.assert_allclose(values, run[name][row], rtol=apart, atol=apart, err_msg=name)


def test_one_call_of_many_steps_is_many_calls_of_one():
    once, often = Stepper(TWISTED, METHOD), Stepper(TWISTED, METHOD)
    once.step(30)
    for _ in range(30):
        often.step()
    np.testing.assert_array_equal(once.outputs()["bob.c.position"], often.outputs()["bob.c.position"])


def test_angles_count_turns():
    """A rotor at 100 rad/s: more than six turns in 0.4 s."""
    rotor = rigid_body("rotor", mass=1.0, inertia=(0.1, 0.1, 0.1), points={"c": (0, 0, 0)})
    scene = Scene(
        (Body("rotor", rotor, omega_bar=(0, 0, 100)),),
        (Joint("hinge", "revolute", "ground.O", "rotor.c"),),
        ground={"O": (0, 0, 0)},
    )
    stepper = Stepper(scene, METHOD, outputs=("*.angle", "hinge.angle_rate"))
    for _ in range(400):
        stepper.step()
    assert stepper.outputs()["hinge.angle"] == pytest.approx(40.0, rel=1e-3)
    assert stepper.outputs()["hinge.angle_rate"] == pytest.approx(100.0)


def test_reactions_of_redundant_rows_are_those_of_a_run():
    """A door on two hinges."""
    door = rigid_body("door", mass=3.0, inertia=(1, 1, 1), centre_of_mass=(0.5, 0, 0.5),
                      points={"low": (0, 0, 0), "high": (0, 0, 1)})  # fmt: skip
    scene = Scene(
        (Body("door", door),),
        (Joint("low", "revolute", "ground.low", "door.low"), Joint("high", "revolute", "ground.high", "door.high")),
        loads=(Load("push", "door.high", force=(0, signal("push", 2.0), 0)),),
        ground={"low": (0, 0, 0), "high": (0, 0, 1)},
        gravity=(0, 0, -9.81),
        plane="none",
    )
    assert assemble(scene).all_rows is not None
    run = integrate(scene, end=0.05, output_step=0.05, method=METHOD)
    stepper = Stepper(scene, METHOD, outputs=("low.force", "high.moment", "low.force.z"))
    stepper.step(50)
    for name, values in stepper.outputs().items():
        np.testing.assert_array_equal(values, run[name][-1], err_msg=name)
    stepper.set_inputs(push=-50.0)
    stepper.step()
    assert abs(stepper.outputs()["low.force"] - run["low.force"][-1]).max() > 1


# ---- inputs -----------------------------------------------------------------------------------------------------------


def test_a_parabola_given_step_by_step_is_the_parabola():
    """Bit for bit it cannot be: the coefficients are shifted at each step."""
    wanted = arm(forces=(Actuator("motor", "hinge", force=polynomial(0.3, -20, 150)),))
    run = integrate(wanted, end=0.1, output_step=0.1, method=METHOD)
    stepper = Stepper(TWISTED, METHOD, outputs=("default",))
    for _ in range(100):
        t = stepper.time
        stepper.set_inputs(torque=(0.3 - 20 * t + 150 * t**2, -20 + 300 * t, 300.0))
        stepper.step()
    for name, values in stepper.outputs().items():
        scale = max(1.0, np.abs(run[name]).max())
        np.testing.assert_allclose(values, run[name][-1], rtol=0, atol=1e-10 * scale, err_msg=name)


def test_a_driver_follows_an_input():
    """Value, rate and second derivative of a motion, given at each step, drive as the motion itself."""
    crank = rigid_body(
        "crank", mass=1.0, inertia=(0.1, 0.1, 0.1), centre_of_mass=(0.3, 0, 0), points={"hub": (0, 0, 0)}
    )
    scene = Scene(
        (Body("crank", crank, omega_bar=(0, 0, 2)),),
        (Joint("hub", "revolute", "ground.O", "crank.hub"),),
        (Driver("motor", "hub", signal("angle")),),
        ground={"O": (0, 0, 0)},
    )
    stepper = Stepper(scene, METHOD, outputs=("hub.angle", "hub.angle_rate", "motor.moment"))
    for _ in range(200):
        t = stepper.time
        stepper.set_inputs(angle=(0.2 * np.sin(10 * t), 2 * np.cos(10 * t), -20 * np.sin(10 * t)))
        stepper.step()
    t, seen = stepper.time, stepper.outputs()
    np.testing.assert_allclose(seen["hub.angle"], 0.2 * np.sin(10 * t), atol=1e-5)
    np.testing.assert_allclose(seen["hub.angle_rate"], 2 * np.cos(10 * t), atol=1e-2)


def test_an_input_stands_in_formulas_and_in_several_places():
    both = arm(
        forces=(Actuator("motor", "hinge", force=signal("torque")),),
        loads=(Load("pull", "bob.c", force=(formula("2 * u", {"u": signal("torque")}), 0, 0)),),
    )
    plain = arm(forces=(Actuator("motor", "hinge", force=0.5),), loads=(Load("pull", "bob.c", force=(1.0, 0, 0)),))
    stepper, other = Stepper(both, METHOD), Stepper(plain, METHOD)
    assert stepper.inputs == {"torque": 0.0}
    stepper.set_inputs(torque=0.5)
    for s in (stepper, other):
        s.step(50)
    assert stepper.inputs == {"torque": 0.5}
    np.testing.assert_allclose(stepper.outputs()["bob.c.position"], other.outputs()["bob.c.position"], atol=1e-14)


def test_a_servo_follows_an_input():
    scene = arm(forces=(Servo("servo", "hinge", target=signal("set"), kp=4000.0, kd=200.0),))
    stepper = Stepper(scene, METHOD, outputs=("hinge.angle",))
    stepper.set_inputs(set=0.3)
    stepper.step(3000)
    assert stepper.outputs()["hinge.angle"] == pytest.approx(0.3, abs=0.02)


def test_a_run_keeps_the_initial_value():
    given = arm(forces=(Actuator("motor", "hinge", force=signal("torque", 0.7)),))
    constant = arm(forces=(Actuator("motor", "hinge", force=0.7),))
    first, second = (integrate(s, end=0.05, output_step=0.05, method=METHOD) for s in (given, constant))
    np.testing.assert_array_equal(first["bob.c.position"], second["bob.c.position"])


# ---- states -----------------------------------------------------------------------------------------------------------


def test_a_restored_state_goes_on_to_the_same_bits():
    stepper = Stepper(TWISTED, METHOD, outputs=("default", "*.acceleration", "*.angle"))
    stepper.set_inputs(torque=(0.2, 1.0, 0.0))
    stepper.step(20)
    kept, at_once = stepper.save(), {name: values.copy() for name, values in stepper.outputs().items()}
    first = stepped(stepper, 30)
    stepper.set_inputs(torque=-7.0)
    stepper.step(11)
    stepper.restore(kept)
    assert stepper.time == 0.02
    assert stepper.inputs == {"torque": pytest.approx(0.22)}
    for name, values in stepper.outputs().items():
        np.testing.assert_array_equal(values, at_once[name], err_msg=name)
    again = stepped(stepper, 30)
    for name, values in again.items():
        np.testing.assert_array_equal(values, first[name], err_msg=name)


def test_a_state_moves_to_another_stepper_of_the_same_scene():
    first, second = Stepper(TWISTED, METHOD), Stepper(TWISTED, METHOD)
    first.step(7)
    second.restore(first.save())
    for stepper in (first, second):
        stepper.step(5)
    np.testing.assert_array_equal(first.outputs()["bob.c.position"], second.outputs()["bob.c.position"])


def test_after_a_failure_a_state_can_be_restored():
    stepper = Stepper(TWISTED, METHOD)
    stepper.step(5)
    kept = stepper.save()
    expected = stepped(stepper, 5)["bob.c.position"]
    stepper.set_inputs(torque=1e300)
    with pytest.raises(ComputationError, match=r"at t = 0\.01 s"):
        stepper.step(100)
    stepper.restore(kept)
    np.testing.assert_array_equal(stepped(stepper, 5)["bob.c.position"], expected)


def test_inputs_are_set_all_or_none_and_by_any_three_numbers():
    stepper = Stepper(TWISTED, METHOD)
    (before,) = stepper.inputs.values()
    with pytest.raises(InputError, match="no input 'other'"):
        stepper.set_inputs(torque=before + 1.0, other=1.0)
    assert stepper.inputs == {"torque": before}
    for three in ([1.0, 2.0, 3.0], np.array([1.0, 2.0, 3.0]), (1, 2, 3)):
        stepper.set_inputs(torque=three)
        ahead = stepper.save()
        stepper.step(10)
        assert stepper.inputs["torque"] == pytest.approx(1 + 2 * stepper.time + 1.5 * stepper.time**2)
        stepper.restore(ahead)


def test_a_step_that_failed_on_its_way_is_no_state_to_go_on_from():
    """Of 100 steps the 26th fails: time and outputs are those before, the state inside is not."""
    push = Load("push", "bob.c", function=lambda t, state: (np.nan if t > 0.05 else 0.0, 0, 0))
    stepper = Stepper(replace(TWISTED, loads=(push,)), METHOD)
    kept = stepper.save()
    with pytest.raises(ComputationError, match=r"'push' at t = 0\.05"):
        stepper.step(100)
    assert stepper.time == 0.0
    for going_on in (stepper.step, stepper.save):
        with pytest.raises(InputError, match="failed on its way: restore a state"):
            going_on()
    stepper.restore(kept)
    other = Stepper(replace(TWISTED, loads=(push,)), METHOD)
    np.testing.assert_array_equal(stepped(stepper, 5)["bob.c.position"], stepped(other, 5)["bob.c.position"])


@pytest.mark.parametrize(
    ("force", "told"),
    [
        ("10 * abs(sin(2000 * t))", "force 'motor': changes within"),
        ("exp(-((t - 0.0253) / 1e-4) ** 2)", "faster than a step of 0.001 s, from t = 0.025"),
        ("sin(2 * t)", None),
    ],
)
def test_functions_that_change_faster_than_steps_are_told(force, told):
    """Once they have: a run divides its steps there, which a stepper does not."""
    stepper = Stepper(arm(forces=(Actuator("motor", "hinge", force=formula(force)),)), METHOD)
    stepper.step(10)
    before = stepper.doubts()
    stepper.step(20)
    found = [text for text in stepper.doubts() if "motor" in text]
    assert [told in text for text in found] == ([True] if told else [])
    assert ("abs" in force) == any("motor" in text for text in before)


def test_steps_leave_no_memory_behind():
    stepper = Stepper(TWISTED, METHOD, outputs=("bob.c.position", "hinge.angle"))
    for _ in range(50):
        stepper.step()
    before = sys.getallocatedblocks()
    for _ in range(200):
        stepper.set_inputs(torque=0.1)
        stepper.step()
        stepper.outputs()
    assert sys.getallocatedblocks() - before < 20


# ---- outputs ----------------------------------------------------------------------------------------------------------


def test_every_quantity_but_work_can_be_an_output():
    names = [name for name in catalogue(assemble(arm()).system) if not name.endswith(".work")]
    run = integrate(arm(), end=0.01, output_step=0.01, method=METHOD, outputs=names)
    stepper = Stepper(arm(), METHOD, outputs=names)
    stepper.step(10)
    assert set(stepper.outputs()) == set(names)
    for name, values in stepper.outputs().items():
        np.testing.assert_allclose(values, run[name][-1], rtol=1e-13, atol=1e-13, err_msg=name)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(("kind", "coordinate"), [("translational", "stroke"), ("revolute", "angle")])
def test_the_power_of_a_driver_is_force_times_rate_and_begins_without_warning(kind, coordinate):
    """Of a kilogram, or a kg m^2, under an acceleration of 2 from a rate of 1: 2 (1 + 2 t)."""
    body = rigid_body("m", mass=1.0, inertia=(1, 1, 1), points={"c": (0, 0, 0)})
    scene = Scene(
        (Body("m", body),),
        (Joint("j", kind, "ground.O", "m.c", axis=(0, 0, 1)),),
        (Driver("d", "j", polynomial(0.0, 1.0, 1.0), coordinate=coordinate),),
        ground={"O": (0, 0, 0)},
    )
    stepper = Stepper(scene, METHOD, outputs=("d.power",))
    assert stepper.outputs()["d.power"] == pytest.approx(2.0, rel=1e-9)
    stepper.step(100)
    assert stepper.outputs()["d.power"] == pytest.approx(2 * (1 + 2 * stepper.time), rel=1e-9)


def test_components_and_memory_that_is_shared():
    stepper = Stepper(arm(), METHOD, outputs=("bob.c.position", "bob.c.position.y", "arm.q", "arm.q.2", "hinge.angle"))
    outputs = stepper.outputs()
    before = float(outputs["bob.c.position.y"])
    assert before == outputs["bob.c.position"][1]
    stepper.step(10)
    assert float(outputs["bob.c.position.y"]) == outputs["bob.c.position"][1] != before
    assert stepper.outputs()["arm.q.2"] == stepper.outputs()["arm.q"][1] != 0
    with pytest.raises(ValueError, match="read-only"):
        outputs["bob.c.position"][0] = 1.0


# ---- mistakes ---------------------------------------------------------------------------------------------------------


def test_mistakes_are_named():
    with pytest.raises(InputError, match=r"'bob\.c\.positon' is none .* did you mean bob\.c\.position"):
        Stepper(arm(), METHOD, outputs=("bob.c.positon",))
    with pytest.raises(InputError, match="work adds up over all steps"):
        Stepper(arm(), METHOD, outputs=("spring.work",))
    with pytest.raises(InputError, match="DormandPrince chooses its steps"):
        Stepper(arm(), DormandPrince())
    with pytest.raises(InputError, match="positive step"):
        Stepper(arm(), ROS2(0.0))
    with pytest.raises(InputError, match="letters, digits"):
        signal("a b")
    with pytest.raises(InputError, match="must be finite"):
        signal("a", np.inf)
    twice = replace(TWISTED, loads=(Load("pull", "bob.c", force=(signal("torque", 1.0), 0, 0)),))
    with pytest.raises(InputError, match=r"'torque' starts with . in one place and . in another"):
        Stepper(twice, METHOD)
    stepper = Stepper(TWISTED, METHOD)
    with pytest.raises(InputError, match=r"no input 'torqe'; did you mean 'torque'\?"):
        stepper.set_inputs(torqe=1.0)
    with pytest.raises(InputError, match=r"no input 'torque'; there are: none"):
        Stepper(arm(), METHOD).set_inputs(torque=1.0)
    for bad in (np.nan, np.inf, (0.0, np.nan, 0.0)):
        with pytest.raises(InputError, match=r"'torque'.* not finite"):
            stepper.set_inputs(torque=bad)
    for bad in ("much", None, (1.0, 2.0), [], [[1.0, 2.0, 3.0]], 1j):
        with pytest.raises(InputError, match=r"'torque' is .*; give a number, or three"):
            stepper.set_inputs(torque=bad)
    for bad in (0, -1, 0.5, 1.5, np.nan, np.inf, "2"):
        with pytest.raises(InputError, match=f"by one whole step or more, not by {bad!r}"):
            stepper.step(bad)
    assert stepper.time == 0.0
    with pytest.raises(InputError, match="another scene, method"):
        stepper.restore(Stepper(TWISTED, ROS2(2e-3)).save())


# ---- scene files ------------------------------------------------------------------------------------------------------

FILE = """
[parameters]
factor = 2.0
[inputs]
torque = "0.5 * factor"
[analysis]
end = 0.1
output_step = 0.01
[ground]
O = [0, 0, 0]
[bodies.bar]
mass = 1.0
inertia = [0.1, 0.1, 0.1]
points = {a = [0, 0, 0]}
[joints.hinge]
kind = "revolute"
i = "ground.O"
j = "bar.a"
[forces.motor]
kind = "actuator"
joint = "hinge"
force = "factor * torque + sin(t)"
[loads.twist]
marker = "bar.a"
moment = [0, 0, "torque"]
"""


def written(tmp_path, text: str):
    path = tmp_path / "scene.toml"
    path.write_text(text, encoding="utf-8")
    return load_scene(path)


def test_inputs_of_a_file(tmp_path):
    scene, settings = written(tmp_path, FILE)
    stepper = Stepper(scene, METHOD, outputs=("hinge.angle_rate",))
    assert stepper.inputs == {"torque": 1.0}
    stepper.step(100)
    expected = (3 * 0.1 + 1 - np.cos(0.1)) / 0.1
    assert stepper.outputs()["hinge.angle_rate"] == pytest.approx(expected, rel=1e-5)
    again, _ = written(tmp_path, to_toml(scene, settings))
    assert again.forces == scene.forces
    assert again.loads == scene.loads


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("torque =", "factor =", "inputs.factor: formulas know that name"),
        ("torque =", "t =", "inputs.t: formulas know that name"),
        ("torque =", "torqe =", "'torque' is not known; did you mean 'torqe'"),
        ('"0.5 * factor"', '"0.5 * x"', "inputs.torque"),
        ('"0.5 * factor"', "[1, 2]", "inputs.torque"),
        ("+ sin(t)", "* hinge.angle", "a formula of the motion cannot use an input"),
        ("mass = 1.0", 'mass = "torque"', "a number is needed here"),
    ],
)
def test_mistakes_in_the_inputs_of_a_file(tmp_path, old, new, words):
    assert old in FILE
    with pytest.raises(InputError) as caught:
        written(tmp_path, FILE.replace(old, new))
    assert words in str(caught.value)


def test_a_harmonic_is_no_input():
    assert (
        Stepper(arm(forces=(Actuator("motor", "hinge", force=harmonic(amplitude=1, frequency=2)),)), METHOD).inputs
        == {}
    )
