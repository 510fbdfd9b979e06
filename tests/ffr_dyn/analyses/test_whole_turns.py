"""Angles of many turns: springs on them pull by all turns, in every analysis, however far rows are apart; closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ffr_dyn.analyses.efforts import JointEffort
from ffr_dyn.analyses.forward import forward
from ffr_dyn.analyses.inverse import QuasiStatic, inverse
from ffr_dyn.analyses.inversion.bounded import Bounded
from ffr_dyn.analyses.kinematic import kinematic
from ffr_dyn.analyses.linearise import linearise
from ffr_dyn.analyses.mixed import Causal, mixed
from ffr_dyn.analyses.states import scene_at
from ffr_dyn.analyses.static import static
from ffr_dyn.functions.time_functions import harmonic, piecewise, polynomial
from ffr_dyn.integrators import RK4, ROS2
from ffr_dyn.scene.couplings import Coupling
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.forces import JointSpring, JointStop, Load
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import rigid_body

GROUND = {"O": (0, 0, 0), "P": (1, 0, 0)}


def wheel(name: str, inertia: float):
    return rigid_body(name, mass=1.0, inertia=(inertia,) * 3, points={"c": (0, 0, 0)})


def geared(*, drivers=(), loads=()) -> Scene:
    """Two wheels, the second turns -2.5 times as far as the first, each on a spring."""
    return Scene(
        (Body("one", wheel("one", 0.3)), Body("two", wheel("two", 0.8), position=(1, 0, 0))),
        (Joint("a", "revolute", "ground.O", "one.c"), Joint("b", "revolute", "ground.P", "two.c")),
        drivers,
        couplings=(Coupling("gear", "a.angle", "b.angle", ratio=-2.5),),
        forces=(JointSpring("s1", "a", stiffness=40.0, free=0.1), JointSpring("s2", "b", stiffness=15.0, preload=2.0)),
        loads=loads,
        ground=GROUND,
    )


STIFFNESS = 40.0 + 2.5**2 * 15.0


@pytest.mark.parametrize("moment", [5.0, 400.0, 2000.0, -5000.0])
def test_equilibria_of_many_turns(moment):
    """40 (a - 0.1) - 2.5 (15 (-2.5 a) + 2) = moment; joint angles obey the gear, turns and all."""
    found = static(geared(loads=(Load("twist", "one.c", moment=(0, 0, moment)),)))
    angle = (moment + 40.0 * 0.1 + 2.5 * 2.0) / STIFFNESS
    for name in ("a.angle", "s1.angle"):
        assert found[name][0] == pytest.approx(angle, rel=1e-12), name
    for name in ("b.angle", "s2.angle"):
        assert found[name][0] == pytest.approx(-2.5 * angle, rel=1e-12), name


def wound(moment: float) -> Scene:
    return Scene(
        (Body("one", wheel("one", 0.1)),),
        (Joint("a", "revolute", "ground.O", "one.c"),),
        forces=(JointSpring("s", "a", stiffness=1.0), JointStop("stop", "a", upper=100.0, stiffness=1e3, entry=0.1)),
        loads=(Load("twist", "one.c", moment=(0, 0, moment)),),
        ground=GROUND,
    )


def test_a_scene_where_a_result_is_keeps_the_turns_of_its_springs():
    """A spring wound by three turns holds its load in a run from there, and in another equilibrium."""
    scene = wound(20.0)
    there = scene_at(scene, static(scene))
    assert [force.turns for force in there.forces] == [3, 3]
    run = forward(there, end=0.5, output_step=0.1, method=ROS2(0.01))
    np.testing.assert_allclose(run["s.torque"], -20.0, rtol=1e-9)
    np.testing.assert_allclose(np.ptp(run["a.angle"]), 0.0, atol=1e-9)
    assert static(there)["s.angle"][0] == pytest.approx(20.0)


@pytest.mark.parametrize("moment", np.linspace(0.5, 30.0, 8))
def test_equilibria_are_known_as_such(moment):
    """What rounding leaves of the balance of a spring and its load is no motion."""
    scene = wound(moment)
    assert not [note for note in linearise(scene_at(scene, static(scene))).notes if "no equilibrium" in note]


def test_what_falls_is_no_equilibrium():
    assert [note for note in linearise(wound(1.0)).notes if "no equilibrium" in note]


@pytest.mark.parametrize("output_step", [0.2, 0.05])
@pytest.mark.parametrize("run", [kinematic, lambda s, **how: inverse(s, elastic=QuasiStatic(), **how)])
def test_driven_turns_are_counted_between_rows(run, output_step):
    """20 rad to and fro: rows are up to seven turns of the second wheel apart."""
    scene = geared(drivers=(Driver("motor", "a", harmonic(amplitude=20.0, frequency=1.0)),))
    found = run(scene, end=1.0, output_step=output_step)
    angle = 20.0 * np.sin(2 * np.pi * found.time)
    for name, expected in (
        ("a.angle", angle),
        ("s1.angle", angle),
        ("b.angle", -2.5 * angle),
        ("s2.angle", -2.5 * angle),
    ):
        np.testing.assert_allclose(found[name], expected, atol=1e-9, err_msg=name)
    spring = STIFFNESS * angle - 40.0 * 0.1 - 2.5 * 2.0
    inertia = -(0.3 + 2.5**2 * 0.8) * (2 * np.pi) ** 2 * angle
    np.testing.assert_allclose(found["motor.effort"], spring + inertia, rtol=1e-9, atol=1e-6)


# ---- inversion ----------------------------------------------------------------------------------------------------------

STEP = 12.0 * np.array([0, 0, 0, 0, 0, 0, 462, -1980, 3465, -3080, 1386, -252.0]) / 0.6 ** np.arange(12)
PATH = np.polynomial.Polynomial(STEP)  # 12 rad from rest to rest in 0.6 s


def two_in_line(driven: str) -> Scene:
    """A wheel on a spring from the ground, another behind it on a spring, which has a joint to the ground as well."""
    behind = (Joint("c", "revolute", "ground.O", "two.c"),) if driven == "c" else ()
    return Scene(
        (Body("one", wheel("one", 0.1)), Body("two", wheel("two", 0.2))),
        (Joint("a", "revolute", "ground.O", "one.c"), Joint("b", "revolute", "one.c", "two.c"), *behind),
        (Driver("go", driven, piecewise([0.0, 0.6], STEP[None])),),
        forces=(JointSpring("s", "a", stiffness=30.0), JointSpring("k", "b", stiffness=200.0, damping=3.0)),
        ground=GROUND,
    )


def given(time: np.ndarray, order: int) -> np.ndarray:
    """Derivatives of the known motion, which rests before and after."""
    rest = np.where(time <= 0, 0.0, 12.0) if order == 0 else 0.0
    return np.where((time > 0) & (time < 0.6), PATH.deriv(order)(time) if order else PATH(time), rest)


@pytest.mark.slow
def test_springs_of_many_turns_in_a_causal_inversion():
    """The angle of the first wheel known, the moment between both unknown: what acts on the second turns it without end."""
    found = mixed(
        two_in_line("a"), unknown=(JointEffort("push", "b"),), end=0.6, output_step=0.02, solution=Causal(growth=1e9)
    )
    on_second = -(0.1 * given(found.time, 2) + 30.0 * given(found.time, 0))
    assert np.ptp(found["b.angle"]) > 2 * np.pi
    np.testing.assert_allclose(found["k.angle"], found["b.angle"], atol=1e-9)
    effort = on_second + 200.0 * found["k.angle"] + 3.0 * found["b.angle_rate"]
    np.testing.assert_allclose(found["push.effort"], effort, rtol=1e-9, atol=1e-6)


def test_springs_of_many_turns_in_a_bounded_inversion():
    """The angle of the second wheel known, the moment on the first unknown, by way of the spring between them."""
    scene = replace(
        two_in_line("c"), forces=(JointSpring("s", "a", stiffness=30.0), JointSpring("k", "b", stiffness=200.0))
    )
    found = mixed(
        scene, unknown=(JointEffort("push", "a"),), end=0.6, output_step=0.01, solution=Bounded(before=0.1, after=0.1)
    )
    first = given(found.time, 0) + 0.2 * given(found.time, 2) / 200.0
    np.testing.assert_allclose(found["s.angle"], first, atol=1e-3)
    turning = 0.1 * (given(found.time, 2) + 0.2 * given(found.time, 4) / 200.0) + 0.2 * given(found.time, 2)
    off = np.abs(found["push.effort"] - turning - 30.0 * first).max()
    assert 0.3 <= found.attributes["errors"]["push.effort"][0] / off <= 5.0
    assert off < 1.0


# ---- follower forces ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("load", "stable"), [(1.9, 1), (2.0, 1), (2.2, 0)])
def test_ziegler_column(load, stable):
    """Masses 2 m and m, equal springs: it flutters from (7/2 - sqrt 2) k / l = 2.086 k / l on (Ziegler 1952). At 2 k / l the
    symmetric part of its stiffness is singular, and all motions are held."""
    ends = {"o": (0, 0, 0), "e": (1, 0, 0)}
    bodies = [
        rigid_body(name, mass=mass, inertia=(1e-6,) * 3, centre_of_mass=(1, 0, 0), points=ends)
        for name, mass in (("a", 2.0), ("b", 1.0))
    ]
    scene = Scene(
        (Body("a", bodies[0]), Body("b", bodies[1], position=(1, 0, 0))),
        (Joint("h1", "revolute", "ground.O", "a.o"), Joint("h2", "revolute", "a.e", "b.o")),
        forces=(JointSpring("k1", "h1", stiffness=10.0), JointSpring("k2", "h2", stiffness=10.0)),
        loads=(Load("P", "b.e", force=(-10.0 * load, 0, 0), axes="body"),),
        ground=GROUND,
    )
    assert static(scene).attributes["stable"] == stable


def test_a_driver_that_begins_turns_on_is_told():
    scene = geared(drivers=(Driver("motor", "a", polynomial(0.0, 100.0)),))
    notes = static(scene, time=0.3).attributes["notes"]
    assert any("a driver begins 5 whole turns on" in note for note in notes)


@pytest.mark.parametrize("turns", [0, 3])
def test_the_angle_of_a_joint_has_the_turns_that_a_force_on_it_has_counted(turns):
    """Rows a second apart of a wheel on a soft spring, which swings by sixteen turns and back. Before, the joint lost turns
    between rows, whose rates are not those between them; the spring did not."""
    rate, k, spin = 1.3, 1.3**2 * 0.3, 130.0
    free = 2 * np.pi * turns
    spring = JointSpring("s", "a", stiffness=k, free=free, turns=turns)
    scene = Scene(
        (Body("one", wheel("one", 0.3), omega_bar=(0, 0, spin)),), (Joint("a", "revolute", "ground.O", "one.c"),),
        forces=(spring,), ground=GROUND,
    )  # fmt: skip
    found = forward(scene, end=8.0, output_step=1.0, method=RK4(1e-3), check=False)
    expected = spin / rate * np.sin(rate * found.time)
    np.testing.assert_allclose(found["a.angle"], expected, atol=0.01)
    np.testing.assert_allclose(found["s.angle"], found["a.angle"] + free, atol=1e-9)
