"""Steps end where functions of time jump or have a kink, so that methods keep their order and the error told is the true one.

The scenes are linear oscillators, whose motion between two breaks is known.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from ffr_gallery import scene_set
from scipy.integrate import solve_ivp

from ffr_dyn.analyses.forward import forward
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.functions.formula import formula
from ffr_dyn.functions.time_functions import TimeFunction, evaluate, piecewise, table, user
from ffr_dyn.integrators import (
    HHT,
    RK4,
    ROS2,
    ROS3,
    AdaptiveROS3,
    DormandPrince,
    GeneralisedAlpha,
    HalfExplicit,
    Variational,
    Within,
    tolerances,
)
from ffr_dyn.integrators.ros2 import Twin
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.forces import JointSpring, Load, Servo
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import rigid_body

K, C, END, ROW = 400.0, 2.0, 1.0, 0.01
SIDE = 1e-11
BLOCK = rigid_body("m", mass=1.0, inertia=(0.1, 0.1, 0.1), points={"c": (0, 0, 0)})
METHODS = [
    *(ROS2(5e-3), ROS3(5e-3), RK4(5e-3), HalfExplicit(5e-3), GeneralisedAlpha(2.5e-3), HHT(2.5e-3), Variational(5e-3)),
    *(AdaptiveROS3(tolerances(1e-6)), DormandPrince(tolerances(1e-6))),
]
AT = [0.5, 0.505, 0.50337]  # at a row, at the end of a step, within one


@dataclass(frozen=True)
class Shaken:
    """A scene, what is known of it, and the output that is compared."""

    scene: Scene
    function: TimeFunction
    breaks: tuple[float, ...]
    kind: str

    @property
    def output(self) -> str:
        return "between.stroke" if self.kind == "driver" else "rail.stroke"

    def acceleration(self, f, x, u):
        value, rate, second = f
        if self.kind == "servo":
            return K * (value - x) + 20.0 * (rate - u)
        return {"load": value, "base": -value, "driver": -second}[self.kind] - K * x - C * u

    def true(self, times):
        """(T,) of the output, piece by piece; a driver whose rate jumps leaves the other body as it was."""
        y, found = np.zeros(2), np.zeros(times.size)
        marks = [0.0, *self.breaks, END]
        for start, end in pairwise(marks):

            def rates(t, y, first=start + SIDE, last=end - SIDE):
                now = evaluate(self.function, float(np.clip(t, first, last)))
                return [y[1], self.acceleration(now, *y)]

            exactly = {"method": "DOP853", "rtol": 1e-11, "atol": 1e-13, "max_step": 0.01}
            piece = solve_ivp(rates, (start, end), y, dense_output=True, **exactly)
            here = (times >= start - SIDE) & (times <= end + SIDE)
            found[here] = piece.sol(np.clip(times[here], start, end))[0] if here.any() else ()
            y = piece.y[:, -1]
            if self.kind == "driver" and end < END:
                y[1] -= evaluate(self.function, end + SIDE)[1] - evaluate(self.function, end - SIDE)[1]
        return found


def shaken(kind, function, *breaks):
    rail = Joint("rail", "translational", "ground.O", "a.c", axis=(1, 0, 0))
    known = {"ground": {"O": (0, 0, 0)}, "gravity": (0, 0, 0)}
    if kind == "driver":
        between = Joint("between", "translational", "a.c", "b.c", axis=(1, 0, 0))
        spring = JointSpring("spring", "between", stiffness=K, damping=C, coordinate="stroke")
        drive = Driver("drive", "rail", function, coordinate="stroke")
        bodies = (Body("a", BLOCK), Body("b", BLOCK))
        return Shaken(
            Scene(bodies, (rail, between), forces=(spring,), drivers=(drive,), **known), function, breaks, kind
        )
    spring = JointSpring("spring", "rail", stiffness=K, damping=C, coordinate="stroke")
    if kind == "servo":
        known["forces"] = (Servo("servo", "rail", target=function, kp=K, kd=20.0, coordinate="stroke"),)
    if kind == "load":
        known |= {"forces": (spring,), "loads": (Load("push", "a.c", (function, 0, 0)),)}
    if kind == "base":
        known |= {"forces": (spring,), "base_acceleration": (function, 0, 0)}
    return Shaken(Scene((Body("a", BLOCK),), (rail,), **known), function, breaks, kind)


def jump(at):
    return piecewise([0.0, at, 2.0], [[0.0], [1.0]])


def ramp(at):
    return piecewise([0.0, at, at + 0.2, 2.0], [[0.0, 0.0], [0.0, 2.0], [0.4, 0.0]])


def speeding_up(at):
    return piecewise([0.0, at, at + 0.1, 2.0], [[0, 0, 0], [0, 0, 2.0], [0.02, 0.4, 0]])


SCENES = {
    "load that jumps": lambda at: shaken("load", jump(at), at),
    "load that jumps by a formula": lambda at: shaken("load", formula(f"step(t - {at}) * cos(9 * t)"), at),
    "pulse": lambda at: shaken("load", piecewise([0.0, at, at + 3e-4, 2.0], [[0.0], [300.0], [0.0]]), at, at + 3e-4),
    "servo after a ramp": lambda at: shaken("servo", ramp(at), at, at + 0.2),
    "servo after a formula": lambda at: shaken("servo", formula(f"min(0.4, max(0, 2 * (t - {at})))"), at, at + 0.2),
    "base that jumps": lambda at: shaken("base", jump(at), at),
    "driver whose acceleration jumps": lambda at: shaken("driver", speeding_up(at), at, at + 0.1),
    "driver whose rate jumps": lambda at: shaken("driver", ramp(at), at, at + 0.2),
    "function that tells": lambda at: shaken("load", user(lambda t: (float(t >= at), 0, 0), breaks=[at]), at),
}


@cache
def case(kind, at):
    """The scene, and the output at the rows."""
    of = SCENES[kind](at)
    return of, of.true(np.linspace(0.0, END, round(END / ROW) + 1))


def off(of, method, true=None, **how):
    """(largest error of the output, what is told) over the range."""
    result = forward(of.scene, end=END, output_step=ROW, method=method, **how)
    true = of.true(result.time) if true is None else true
    error, span = float(np.abs(result[of.output] - true).max()), float(np.ptp(true))
    return error / span, result.attributes.get("errors", {}).get(of.output, [0, 0])[1], result


@pytest.mark.parametrize("at", AT)
@pytest.mark.parametrize("kind", SCENES)
@pytest.mark.parametrize("method", METHODS, ids=lambda one: type(one).__name__)
def test_the_error_told_is_the_true_one_wherever_a_function_breaks(method, kind, at):
    error, told, _ = off(case(kind, at)[0], method, case(kind, at)[1], check=True)
    assert error <= 3e-3
    assert 0.3 * error <= told <= 6 * error


@pytest.mark.parametrize("kind", SCENES)
@pytest.mark.parametrize("kind_of_method", [ROS2, ROS3, RK4, HalfExplicit, GeneralisedAlpha, HHT, Variational])
def test_methods_keep_their_order_over_a_break(kind_of_method, kind):
    of, true = case(kind, 0.50337)
    errors = [off(of, kind_of_method(step), true, check=False)[0] for step in (5e-3, 1.25e-3)]
    assert errors[1] <= errors[0] / 4 ** (kind_of_method.order - 0.3) or errors[1] < 1e-8


@pytest.mark.parametrize("method", [Within(), Within(1e-3, "ros3")], ids=["ros2", "ros3"])
@pytest.mark.parametrize("kind", SCENES)
def test_the_accuracy_is_kept_for_no_more_steps_than_without_a_break(kind, method):
    error, told, result = off(case(kind, 0.50337)[0], method, case(kind, 0.50337)[1])
    assert error <= 1e-3
    assert 0.3 * error <= told <= 1e-3
    assert result.attributes["step"] >= 1e-3


@pytest.mark.parametrize("at", AT)
@pytest.mark.parametrize("method", [ROS2(2.5e-3), ROS3(5e-3), RK4(5e-3), GeneralisedAlpha(2.5e-3)], ids=repr)
def test_a_kink_that_nobody_tells_is_found_and_its_error_told(method, at):
    target = user(lambda t: (max(0.0, t - at), float(t >= at), 0))
    error, told, result = off(shaken("servo", target, at), method, check=True)
    assert told >= 0.3 * error
    assert any(f"jumps or has a kink at t = {at:.6g}" in note for note in result.attributes["notes"])


@pytest.mark.parametrize("at", AT)
@pytest.mark.parametrize("method", [ROS2(2.5e-3), ROS3(5e-3), RK4(5e-3), GeneralisedAlpha(2.5e-3)], ids=repr)
def test_steps_end_at_a_jump_that_nobody_tells(method, at):
    of = shaken("load", user(lambda t: (float(t >= at), 0, 0)), at)
    error, told, _ = off(of, method, check=True)
    with_breaks = shaken("load", user(lambda t: (float(t >= at), 0, 0), breaks=[at]), at)
    assert error == pytest.approx(off(with_breaks, method, check=True)[0], rel=0.01, abs=1e-8)
    assert 0.3 * error <= told <= 5 * error


def test_a_formula_that_turns_back_at_the_end_of_a_range_is_told():
    saw = shaken("load", formula("asin(sin(12 * t))"), *(np.pi * np.arange(0.5, 4) / 12))
    saw = replace(saw, function=user(lambda t: (np.arcsin(np.sin(12 * t)), 0, 0)))
    error, told, result = off(saw, ROS2(2.5e-3), check=True)
    assert told >= 0.3 * error
    assert any("a formula jumps or has a kink" in note for note in result.attributes["notes"])


def test_a_smooth_function_in_python_is_told_as_a_formula_is():
    text = "sin(9 * t) * smooth(4 * t)"
    as_formula = formula(text)
    errors = [
        off(shaken("load", function), ROS2(2.5e-3), check=True)[1:]
        for function in (as_formula, user(lambda t: evaluate(as_formula, t)))
    ]
    assert errors[0][0] == pytest.approx(errors[1][0], rel=1e-12)
    assert not any("kink" in note for _, result in errors for note in result.attributes["notes"])


@pytest.mark.parametrize("method", [AdaptiveROS3(tolerances(1e-6)), DormandPrince(tolerances(1e-6))], ids=repr)
def test_steps_that_have_grown_at_rest_do_not_leave_out_what_begins_after_it(method):
    error, told, _ = off(shaken("driver", formula("0.1 * smooth((t - 0.5) / 0.1)"), 0.5, 0.6), method, check=True)
    assert error <= 1e-4
    assert told >= 0.3 * error


def test_a_row_at_the_end_of_a_table_shows_what_ends_there():
    """0.3 is no sum of three times 0.1 in floating point, and behind its end a table stands still."""
    times = np.linspace(0.0, 0.3, 13)
    of = shaken("driver", table(times, 0.5 * times**2))
    result = forward(of.scene, end=0.3, output_step=0.1, method=ROS2(1e-3), outputs=("*",))
    np.testing.assert_allclose(result["rail.stroke_rate"], result.time, atol=1e-6)
    np.testing.assert_allclose(result["a.c.acceleration"][:, 0], 1.0, atol=1e-6)


def test_a_function_that_stands_on_one_side_of_its_kink_changes_no_bit():
    plain = shaken("load", formula("9 * (t + 1)"))
    bent = shaken("load", formula("max(9 * (t + 1), t)"))
    one, other = (forward(of.scene, end=END, output_step=ROW, method=ROS2(2.5e-3)) for of in (plain, bent))
    for name in one:
        np.testing.assert_array_equal(one[name], other[name])


@pytest.mark.parametrize("at", [0.105, 0.1005])
def test_a_break_within_a_step_does_not_excite_stiff_modes(at):
    """What a long step has left the constraints by was closed by a short one, and by an impulse, which elastic forces had no
    part in: a crank that is brought to its speed rang hundreds of times as much then, where nothing damps it."""
    scene, row = scene_set.slider_crank(60.0), 0.002
    driver = replace(scene.drivers[0], function=scene_set.speeding_up(60.0, at))
    bodies = tuple(replace(body, damping=0.0) for body in scene.bodies)
    shaken = replace(scene, bodies=bodies, drivers=(driver,))
    run, fine = (integrate(shaken, end=0.2, output_step=row, method=Twin(row / k, 1.0)) for k in (4, 64))
    off = np.abs(run["crank.omega_bar"] - fine["crank.omega_bar"]).max(axis=1)
    before = run.time < at - row
    assert off[~before].max() < 5 * off[before].max()
