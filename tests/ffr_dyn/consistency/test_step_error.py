"""What the length of the steps costs: on histories made up, where the truth is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import ffr_dyn as fd
from ffr_dyn.analyses.forward import forward
from ffr_dyn.compile.scene_tables import compile_scene
from ffr_dyn.consistency.step_error import (
    A_FORMULA,
    COARSE,
    FLOOR,
    IN_PART,
    Beside,
    from_rounding,
    ranges,
    step_errors,
    too_coarse,
    untold_breaks,
)
from ffr_dyn.functions.formula import formula
from ffr_dyn.functions.time_functions import evaluate, harmonic, piecewise, user
from ffr_dyn.integrators import RK4, ROS2, ROS3, AdaptiveROS3
from ffr_dyn.integrators.tolerances import tolerances
from ffr_dyn.results.result import Quantity, Result
from ffr_dyn.scene.forces import Actuator, JointFriction, JointSpring, JointStop, Load
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import rigid_body

TIME = np.linspace(0.0, 1.0, 201)
BLOCK = rigid_body("block", mass=2.0, inertia=(1e-3, 1e-3, 1e-3), points={"c": (0, 0, 0)})
RAIL = Joint("rail", "translational", "ground.O", "block.c", axis=(1, 0, 0))


def result(time=TIME, **histories) -> Result:
    units = {"position": "m", "force": "N", "moment": "N m"}
    named = {name.replace("_", "."): np.asarray(values) for name, values in histories.items()}
    return Result(time, {n: Quantity(v, units.get(n.rpartition(".")[2], "1")) for n, v in named.items()}, {}, {})


@pytest.mark.parametrize("order", [2, 3])
@pytest.mark.parametrize("ratio", [2.0, 0.5, 5 / 3])
def test_an_error_of_the_order_of_the_method_is_told_exactly(order, ratio):
    true, shape = np.sin(3 * TIME), TIME**2
    h = 0.1
    run, other = (result(a_position=true + shape * step**order) for step in (h, ratio * h))
    found = step_errors(run, Beside(other, ratio), order)["a.position"]
    assert found.error == pytest.approx(h**order, rel=1e-9)
    assert found.of_range == pytest.approx(h**order / np.ptp(true + shape * h**order), rel=1e-9)
    assert not found.vibrates


def test_steps_that_jump_over_an_impact_have_no_order():
    """A bounce that comes at another time with each step."""

    def bounced(at):
        return np.where(at > TIME, 1.0 - TIME, 1.0 - at + 0.7 * (TIME - at))

    run, other, true = (result(a_position=bounced(at)) for at in (0.60, 0.75, 0.45))
    off = np.abs(run["a.position"] - true["a.position"]).max()
    assert step_errors(run, Beside(other, 2.0), 2)["a.position"].error >= 0.9 * off


def test_vibration_that_runs_damp_away_is_seen_beside_the_twin():
    smooth, vibration = np.sin(3 * TIME), 0.02 * np.cos(5000 * TIME)
    run, other, twin = result(a_force=smooth), result(a_force=smooth), result(a_force=smooth + vibration)
    assert step_errors(run, Beside(other, 2.0), 2)["a.force"].error == 0.0
    found = step_errors(run, Beside(other, 2.0), 2, [Beside(twin, 1.0)])["a.force"]
    assert found.error == pytest.approx(IN_PART * 0.02, rel=1e-3)
    assert found.vibrates


def test_the_phase_of_a_twin_of_lower_order_is_no_error_of_the_run():
    """Vibration with 20 rows to a period, which a method of order three resolves and its twin lets run late."""

    def late(phase):
        return np.sin(3 * TIME) + 0.1 * np.cos(2 * np.pi * 10 * TIME - phase * TIME)

    run, other = result(a_position=late(1e-3)), result(a_position=late(8e-3))
    fine, coarse = Beside(result(a_position=late(0.3)), 0.5), Beside(result(a_position=late(1.2)), 1.0)
    same = step_errors(run, None, 2, [Beside(fine.result, 1.0)])["a.position"].error / IN_PART
    alone, both = (step_errors(run, Beside(other, 2.0), 3, t)["a.position"].error for t in ([fine], [fine, coarse]))
    true = np.abs(late(1e-3) - late(0.0)).max()
    assert true <= both <= 0.3 * same
    assert both <= alone <= same


def test_what_vibration_does_to_slow_motion_is_not_left_out():
    """A drift of energy that no row is off its neighbours by."""
    run, twin = result(a_energy=-0.3 * TIME), result(a_energy=0 * TIME)
    assert step_errors(run, None, 2, [Beside(twin, 0.5)])["a.energy"].error >= 0.3 / FLOOR


@pytest.mark.parametrize("ratio", [2.0, 8.0])
def test_what_a_twin_errs_by_itself_goes_by_its_order(ratio):
    smooth, h = np.sin(3 * TIME), 0.02
    run = result(a_force=smooth)
    twins = [Beside(result(a_force=smooth + (r * h) ** 2 * TIME), r) for r in (0.5, 0.5 * ratio)]
    assert step_errors(run, None, 2, twins)["a.force"].error < 1e-12


def test_outputs_that_hardly_move_are_measured_by_their_kind():
    run = result(a_position=TIME, b_position=1e-9 * TIME, a_force=TIME, a_moment=1e-12 * TIME, c_q=1e-5 * TIME)
    scales = ranges(run)
    assert scales["b.position"] == pytest.approx(1e-3)
    assert scales["a.moment"] == pytest.approx(1e-6)
    assert scales["c.q"] == pytest.approx(1e-5)


@pytest.mark.parametrize("still", [0.0, 1e-10])
def test_rates_of_a_blade_that_keeps_its_shape_are_measured_as_in_axes_that_do_not_turn(still):
    """There v = W x u of its deformation u, of which a thousandth counts as at rest, as of all that hardly moves."""
    blade = {"q": 1e-5 + 0.0 * TIME, "q_dot": still * np.sin(40 * TIME), "omega_bar": 100.0 + 0.0 * TIME}
    turning = Result(TIME, {f"blade.{of}": Quantity(values, "1") for of, values in blade.items()}, {}, {})
    assert ranges(turning)["blade.q_dot"] == pytest.approx(1e-3 * 1e-5 * 100.0)
    vibrating = replace(turning, quantities=turning.quantities | {"blade.q_dot": Quantity(1e-5 * TIME, "1")})
    assert ranges(vibrating)["blade.q_dot"] == pytest.approx(1e-5)


def test_forces_beside_torques_are_measured_by_the_torque_over_the_size():
    """A shaft under torque pulls at its ends by next to nothing, which no step is to resolve."""
    shaft = result(a_position=2.0 * TIME, a_moment=100.0 * TIME, a_force=1e-6 * TIME)
    assert ranges(shaft)["a.force"] == pytest.approx(1e-3 * 100.0 / 2.0)
    geared = result(a_position=2.0 * TIME, a_moment=100.0 * TIME, a_force=50.0 * TIME)
    assert ranges(geared)["a.force"] == pytest.approx(50.0)


@pytest.mark.parametrize(
    ("kind", "velocity"), [("spherical", (1.0, 2.0, 0.5)), ("cylindrical", (0, 0, 2.0)), ("revolute", (0, 0, 0.3))]
)
def test_a_pivot_at_the_origin_is_at_rest_and_asks_for_no_step(kind, velocity):
    """Its places, rates and powers are rounding; the error of none of them is a part of what they do."""
    body = rigid_body("a", mass=2.0, inertia=[0.1, 0.2, 0.25], centre_of_mass=(0, -0.3, 0), points={"o": (0, 0, 0)})
    scene = Scene(
        (Body("a", body, omega_bar=velocity),),
        (Joint("j", kind, "ground.o", "a.o"),),
        ground={"o": (0, 0, 0)},
        gravity=(0, -9.81, 0),
        plane="none",
    )
    found = forward(scene, end=2.0, output_step=0.01, outputs=["*"])
    assert found.attributes["step"] > 5e-4
    assert max(share for _, share in found.attributes["errors"].values()) < 0.02
    finer = forward(scene, end=2.0, output_step=0.01, method=ROS3(5e-5), outputs=["*"], check=False)
    for name in ("a.p", "j.force", "j.angle" if kind != "spherical" else "a.omega_bar"):
        told, _ = found.attributes["errors"][name]
        assert np.abs(found[name] - finer[name]).max() < 3 * told + 1e-9


def test_violations_of_constraints_are_no_outputs_of_a_motion():
    assert "constraint.position" not in ranges(result(constraint_position=TIME))


def test_rows_beyond_the_end_of_another_run_are_not_compared():
    run, other = result(a_position=TIME), result(time=TIME[:-10], a_position=TIME[:-10])
    assert step_errors(run, Beside(other, 2.0), 2)["a.position"].error == 0.0


@pytest.mark.parametrize(("periods", "told"), [(2, False), (80, True)])
def test_rows_that_do_not_show_a_motion_are_told(periods, told):
    found = too_coarse(result(a_position=np.sin(2 * np.pi * periods * TIME)))
    assert (found.get("a.position", 0.0) > COARSE) == told


@pytest.mark.parametrize(("rows", "told"), [(25.0, False), (10 / 9, True), (1.0, True)])
def test_a_rate_finds_a_vibration_that_rows_catch_in_the_same_phase_again_and_again(rows, told):
    omega = 2 * np.pi * (TIME.size - 1) / rows
    found = too_coarse(result(a_position=TIME + np.sin(omega * TIME), a_velocity=1 + omega * np.cos(omega * TIME)))
    assert (found.get("a.position", 0.0) > COARSE) == told


def test_an_error_is_not_told_where_the_run_that_shows_vibration_fails():
    """The steps damp the vibration of a stiff spring at once, and the twin that keeps it does not bear its frequency."""
    block = rigid_body("b", mass=1.0, inertia=[0.1] * 3, points={"o": (0, 0, 0)})
    scene = Scene(
        (Body("b", block, position=(0.01, 0, 0)),),
        (Joint("g", "translational", "ground.o", "b.o", axis=(1, 0, 0)),),
        ground={"o": (0, 0, 0)},
        forces=(JointSpring("k", "g", stiffness=1e8, coordinate="stroke"),),
    )
    found = forward(scene, end=0.5, output_step=0.01, method=ROS2(1e-2))
    assert found.attributes["accuracy"].startswith("step: not known; ")
    assert any("leaves out vibration that the steps damp" in note for note in found.attributes["notes"])


SUDDEN = {
    "piecewise": piecewise([0.0, 0.5, 2.0], [[10.0], [0.0]]),
    "formula": formula("10 * (1 - step(t - 0.5))"),
}


@pytest.mark.parametrize("push", SUDDEN.values(), ids=SUDDEN)
@pytest.mark.parametrize("method", [None, ROS2(0.01), ROS3(0.01), RK4(0.01)])
def test_a_force_that_stops_at_the_end_of_a_step_acts_as_long_as_it_should(push, method):
    """Every method would be of first order there, the force acting for a part of a step too long or too short."""
    slider = rigid_body("m", mass=1.0, inertia=(1, 1, 1), points={"c": (0, 0, 0)})
    rail = Joint("rail", "translational", "ground.O", "m.c", axis=(1, 0, 0))
    scene = Scene((Body("m", slider),), (rail,), loads=(Load("push", "m.c", (push, 0, 0)),), ground={"O": (0, 0, 0)})
    result = forward(scene, end=1.0, output_step=0.05, method=method)
    off = np.abs(result["m.v"][:, 0] - 10.0 * np.minimum(result.time, 0.5)).max()
    assert off <= 1e-12
    assert result.attributes["errors"]["m.v"][0] <= 1e-12
    assert result.attributes["errors"]["m.R"][1] < 1e-3


def dropped() -> Scene:
    """A block that bounces on a hard stop."""
    stop = JointStop("stop", "rail", 1e6, 1e-5, lower=0.0, damping=500.0, coordinate="stroke")
    body = Body("block", BLOCK, position=(0, 0.1, 0))
    return Scene(
        (body,), (replace(RAIL, axis=(0, 1, 0)),), forces=(stop,), ground={"O": (0, 0, 0)}, gravity=(0, -9.81, 0)
    )


def rubbed() -> Scene:
    """A block that a force pushes to and fro against dry friction."""
    forces = (
        JointFriction("dry", "rail", coulomb=4.67, creep=1.2e-5, coordinate="stroke"),
        JointSpring("spring", "rail", stiffness=257.0, coordinate="stroke"),
    )
    push = Load("push", "block.c", force=(harmonic(amplitude=5.94, frequency=2.3), 0, 0))
    body = Body("block", BLOCK, velocity=(0.0572, 0, 0))
    return Scene((body,), (RAIL,), loads=(push,), forces=forces, ground={"O": (0, 0, 0)})


@pytest.mark.parametrize(
    ("scene", "method", "end", "row"), [(dropped(), None, 1.0, 0.01), (rubbed(), ROS3(2e-3), 1.5, 0.02)]
)
def test_stops_and_dry_friction_are_looked_at_beside_twice_the_step(scene, method, end, row):
    """Steps 16 times as long, of which an impact makes something else, told a tenth of the error."""
    tight = AdaptiveROS3(tolerances(1e-10))
    found = forward(scene, end=end, output_step=row, method=method, check=True)
    true = forward(scene, end=end, output_step=row, method=tight, check=False)
    scales = ranges(true)
    for name, (told, _) in found.attributes["errors"].items():
        off = np.abs(found[name] - true[name]).max()
        assert off <= 3.0 * told or off < 1e-5 * scales[name], name


def test_breaks_that_nobody_tells_are_those_of_python_functions_and_of_sharp_formulas():
    def found(function):
        load = Load("push", "m.c", (function, 0, 0))
        slider = rigid_body("m", mass=1.0, inertia=(1, 1, 1), points={"c": (0, 0, 0)})
        rail = Joint("rail", "translational", "ground.O", "m.c", axis=(1, 0, 0))
        scene = Scene((Body("m", slider),), (rail,), loads=(load,), ground={"O": (0, 0, 0)})
        return untold_breaks(compile_scene(scene), np.linspace(0.0, 1.0, 101))

    smooth = ("sqrt(t + 1)", "smooth(t / 0.3)", "(t - 0.3) ** 3", "(t - 0.3) ** 2 - t ** 4")
    ended = ("sign(t - 0.3)", "min(t, 0.3)", "min(t, 0.3) ** 2", "sqrt(1 + min(t, 0.3))", "sqrt(abs(t - 0.3))")
    for told in (*smooth, *ended):
        assert not found(formula(told))
    assert not found(piecewise([0.0, 0.5, 1.0], [[0.0, 1.0], [0.5, 0.0]]))
    assert not found(user(lambda t: float(t >= 0.3), breaks=[0.3]))
    assert found(user(lambda t: float(t >= 0.3)))["load 'push'"] == pytest.approx([0.3])
    assert found(formula("sqrt((t - 0.3) ** 2) + min(t, 0.6) ** 2"))[A_FORMULA] == pytest.approx([0.3], abs=1e-6)


def test_what_trembles_before_it_is_driven_does_not_grow_by_itself():
    """Rounding of a scene that rests until a cam lifts it, and of a stop that it then leaves."""
    rests = 0.5 * TIME[-1] > TIME
    tremble = np.where(TIME > 0, 1e-34 + 1e-16 * TIME, 0.0)
    lift = np.where(rests, tremble, (TIME - 0.5 * TIME[-1]) ** 3)
    force = np.where(rests, tremble, 10.0 ** np.minimum(2.0, -8 + 400 * (TIME - 0.5 * TIME[-1])))
    assert from_rounding(result(a_position=lift, b_position=TIME, s_force=force)) == {}


def test_exponential_growth_from_rounding_is_no_motion_that_sets_in():
    begun = np.maximum(TIME - 0.2, 0.0)
    grown = 1e-16 * np.cosh(np.clip(40 * TIME, 0.0, 35.0))
    run = result(
        a_position=TIME,
        b_position=grown,
        c_position=1.0 + grown,
        d_position=begun**2,
        e_position=begun**6,
        f_position=1e-17 + begun,
    )
    assert set(from_rounding(run)) == {"b.position", "c.position"}


@pytest.mark.parametrize("plane", ["z", "none"])
def test_a_pendulum_that_stands_on_its_head_falls_by_chance(plane):
    """Half a turn is known to 1e-16 only, which the motion multiplies by cosh(lambda t); from a given angle it is known."""
    body = rigid_body("a", mass=2.0, inertia=[0.1, 0.2, 0.25], centre_of_mass=(0, -0.3, 0), points={"o": (0, 0, 0)})

    def falling(angle, end):
        bodies, joints = (Body("a", body, rotation=(0, 0, angle)),), (Joint("j", "revolute", "ground.o", "a.o"),)
        scene = Scene(bodies, joints, ground={"o": (0, 0, 0)}, gravity=(0, -9.81, 0), plane=plane)
        return forward(scene, end=end, output_step=0.02).attributes

    by_chance, known = falling(np.pi, 12.0), falling(np.pi - 1e-3, 3.0)
    assert any("grows from rounding" in note for note in by_chance["notes"])
    assert by_chance["errors"]["j.angle"][1] >= 1.0
    assert not any("grows from rounding" in note for note in known["notes"])
    assert known["errors"]["j.angle"][1] < 1e-3


SOFT = ["100 * exp(-((t - 0.3) / 0.05)**2)", "100 / (1 + exp((0.5 - t) / 0.02))"]


@pytest.mark.parametrize(
    ("text", "of_motion"),
    [("1e-12 * exp(30 * t)", False), *(pytest.param(one, of, marks=pytest.mark.slow) for one in SOFT for of in (0, 1))],
)
def test_what_a_pulse_pushes_that_sets_in_softly_is_not_unstable(text, of_motion):
    """Its error was told as all of its range. m c'' = -k c + F(t) by Duhamel's integral."""
    push = formula(text)
    given = {"function": lambda t, state: evaluate(push, t)[0]} if of_motion else {"force": push}
    scene = sprung(Actuator("push", "rail", coordinate="stroke", **given))
    told = forward(scene, end=1.0, output_step=0.01)
    assert not any("grows from rounding" in note for note in told.attributes["notes"])
    w, s = np.sqrt(500.0), np.linspace(0.0, 1.0, 20001)
    force = np.array([evaluate(push, t)[0] for t in s])
    exact = np.trapezoid(np.sin(w * (1.0 - s)) * force, s) / (2.0 * w)
    off = abs(told["rail.stroke"][-1] - exact)
    assert off <= 3 * told.attributes["errors"]["rail.stroke"][0] < 1e-2 * np.abs(told["rail.stroke"]).max()


def sprung(*forces):
    block = rigid_body("block", mass=2.0, inertia=[1, 1, 1], points={"o": (0, 0, 0)})
    rail = Joint("rail", "translational", "ground.O", "block.o")
    spring = JointSpring("spring", "rail", 1000.0, coordinate="stroke")
    return Scene((Body("block", block),), (rail,), forces=(spring, *forces), ground={"O": (0, 0, 0)})


def test_what_falls_by_chance_is_told_beside_a_pulse():
    """A pendulum that stands on its head, and a block that a pulse pushes, which does not act on it."""
    body = rigid_body("a", mass=2.0, inertia=[0.1, 0.2, 0.25], centre_of_mass=(0, -0.3, 0), points={"o": (0, 0, 0)})
    pulsed = sprung(Actuator("push", "rail", formula("100 * exp(-((t - 3) / 0.5)**2)"), coordinate="stroke"))
    scene = replace(
        pulsed,
        bodies=(*pulsed.bodies, Body("a", body, rotation=(0, 0, np.pi))),
        joints=(*pulsed.joints, Joint("j", "revolute", "ground.O", "a.o")),
        gravity=(0, -9.81, 0),
    )
    told = forward(scene, end=12.0, output_step=0.02).attributes
    assert any("grows from rounding" in note for note in told["notes"])
    assert told["errors"]["j.angle"][1] >= 1.0
    assert told["errors"]["rail.stroke"][1] < 1e-2


def test_work_that_is_added_up_too_seldom_is_told():
    """Of a stop that is struck between the states that work is added up from, whatever the tolerance: the work is the change
    of the energy."""
    ball = rigid_body("ball", mass=1.0, inertia=(1, 1, 1), points={"o": np.zeros(3)})
    dropped = Scene(
        (Body("ball", ball, position=(0, 0, 0.5)),),
        (Joint("rail", "translational", "ground.O", "ball.o"),),
        forces=(
            fd.JointStop("floor", "rail", stiffness=2e4, entry=2e-3, lower=0.0, damping=30.0, coordinate="stroke"),
        ),
        ground={"O": (0, 0, 0)},
        gravity=(0, 0, -9.81),
    )
    method = fd.DormandPrince(fd.Tolerances(1e-9, position=1e-10, velocity=1e-8))
    found = fd.forward(dropped, end=1.5, output_step=0.01, method=method, outputs=("default", "*.work"))
    energy = found["energy.total"]
    true = np.abs(found["floor.work"] - (energy - energy[0])).max()
    told = found.attributes["errors"]
    assert true > 100 * told["energy.total"][0]
    assert 0.3 < told["floor.work"][0] / true < 5
