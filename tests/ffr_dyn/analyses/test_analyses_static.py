"""Static equilibrium: closed forms of rigid and flexible bodies, stability, and motions that nothing holds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from synthetic import cloud
from test_analyses_kinematic import bar, slider_crank

import ffr_prep as fp
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.analyses.states import scene_at
from ffr_dyn.analyses.static import static
from ffr_dyn.functions.formula import formula
from ffr_dyn.functions.time_functions import polynomial
from ffr_dyn.integrators import RK4
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.forces import Load, ModalForce, SpringDamper
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import rigid_body
from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.model.material import Material
from ffr_prep.structures.frame import Member, named, polyline
from ffr_prep.structures.sections import rectangle

G = (0.0, -9.81, 0.0)


def hanging(angle: float, *loads: Load) -> Scene:
    return Scene(
        (Body("rod", bar("rod", 2.0), rotation=(0, 0, angle)),),
        (Joint("A", "revolute", "ground.O", "rod.a"),),
        loads=loads,
        ground={"O": (0, 0, 0)},
        gravity=G,
    )


@pytest.mark.parametrize("angle", [0.0, 1.4, -3.0])
def test_a_pendulum_falls_to_its_stable_equilibrium(angle):
    """Under a horizontal force F at the tip: tan(angle from the vertical) = 2 F / m g."""
    result = static(hanging(angle, Load("wind", "rod.b", (3.0, 0, 0))))
    tip = result["rod.b.position"][0]
    assert np.arctan2(tip[0], -tip[1]) == pytest.approx(np.arctan(2 * 3.0 / 9.81), abs=1e-9)
    np.testing.assert_allclose(result["A.force"][0], (-3.0, 9.81, 0), atol=1e-8)
    assert result.attributes["stable"]
    moment_per_inertia = np.hypot(9.81, 2 * 3.0) * 1.0 / (4 / 3)
    assert result.attributes["lowest_stiffness"] == pytest.approx(moment_per_inertia, rel=1e-7)


def test_an_upright_pendulum_is_in_unstable_equilibrium():
    result = static(hanging(np.pi / 2))
    assert not result.attributes["stable"]
    assert result.attributes["lowest_stiffness"] == pytest.approx(-9.81 / (4 / 3), rel=1e-7)
    assert "unstable" in result.attributes["notes"][-1]


def flexible() -> Scene:
    """A flexible pendulum of two bodies held by a spring."""
    return Scene(
        (
            Body("one", cloud(5, stiffness=60.0), damping=0.5),
            Body("two", cloud(4, seed=4, stiffness=80.0), position=(1, 0.5, 0), damping=0.5),
        ),
        (
            Joint("A", "revolute", "ground.O", "one.a", axis=(0.3, 0.1, 1.0), axis_j=(0.3, 0.1, 1.0)),
            Joint("B", "universal", "one.b", "two.c", axis=(1, 0, 0), axis_j=(0, 1, 0)),
        ),
        springs=(SpringDamper("spring", "ground.P", "two.a", 300.0, 50.0, 0.2),),
        ground={"O": (0, 0, 0), "P": (1, 1, 0.3)},
        gravity=G,
    )


def test_a_flexible_scene_stays_where_static_leaves_it():
    scene = flexible()
    result = static(scene)
    assert result.attributes["stable"]
    run = integrate(scene_at(scene, result), end=0.5, output_step=0.5, method=RK4(1e-3))
    for name in ("two.a.position", "one.q", "A.force", "spring.tension"):
        np.testing.assert_allclose(run[name][-1], result[name][0], atol=1e-7)


def test_forces_on_modes_deflect_them_by_force_over_frequency_squared():
    """They do no work on rigid motions, so that the clamp carries nothing."""
    body = cloud(3)
    scene = Scene(
        (Body("cloud", body),),
        (Joint("clamp", "fixed", "ground.O", "cloud.a"),),
        forces=(ModalForce("push", "cloud", [3.0, -2.0, 1.0]),),
        ground={"O": body.interfaces[0].position},
    )
    result = static(scene)
    np.testing.assert_allclose(result["cloud.q"][0], np.array([3.0, -2.0, 1.0]) / body.omega2, rtol=1e-9)
    np.testing.assert_allclose([*result["clamp.force"][0], *result["clamp.moment"][0]], 0.0, atol=1e-9)


def test_reactions_balance_weight_and_spring():
    scene = flexible()
    result = static(scene)
    line = np.array(scene.ground["P"]) - result["two.a.position"][0]
    pull = result["spring.tension"][0] * line / np.linalg.norm(line)
    weight = sum(b.model.mass for b in scene.bodies) * np.array(G)
    np.testing.assert_allclose(result["A.force"][0] + pull + weight, 0, atol=1e-8)


def test_a_driven_scene_is_held_by_its_driver():
    """The crank held at an angle: the motor's moment is what the weights give by virtual work."""
    scene = slider_crank(0.2, 0.7, Driver("motor", "main", polynomial(0.7, 3.0)))
    result = static(scene, time=0.0)
    energy = [
        static(replace(scene, drivers=(Driver("motor", "main", polynomial(a)),)))["energy.total"][0]
        for a in (0.6999, 0.7001)
    ]
    assert result["motor.effort"][0] == pytest.approx((energy[1] - energy[0]) / 2e-4, rel=1e-6)


def test_time_dependent_loads_are_those_of_the_time():
    scene = hanging(-1.5, Load("wind", "rod.b", (polynomial(0.0, 1.0), 0, 0)))
    tip = static(scene, time=3.0)["rod.b.position"][0]
    assert np.arctan2(tip[0], -tip[1]) == pytest.approx(np.arctan(6 / 9.81), abs=1e-9)


def test_a_free_mechanism_is_refused_by_name():
    free = Scene((Body("stone", rigid_body("stone", mass=1.0, inertia=(1, 1, 1), points={"c": (0, 0, 0)})),), gravity=G)
    with pytest.raises(
        InputError, match=r"nothing holds the motion stone .* where they ended; .* run forward with damping"
    ):
        static(free)
    with pytest.raises(InputError, match=r"nothing holds the motion A\.angle"):
        static(replace(hanging(0.3), gravity=(0, 0, -9.81)))


def test_forces_that_are_not_finite_are_named():
    """A formula that has no value at the time of the equilibrium."""
    scene = hanging(0.0, Load("wind", "rod.b", (formula("1 / t"), 0, 0)))
    assert static(scene, time=1.0).attributes["stable"]
    with pytest.raises(ComputationError, match="forces are not finite near the equilibrium, of load 'wind'"):
        static(scene, time=0.0)
    for push in (lambda t: np.nan, lambda t, state: 1.0):
        with pytest.raises(ComputationError, match="not finite near the equilibrium, of load 'wind'"):
            static(hanging(0.0, Load("wind", "rod.b", (push, 0, 0))))


@pytest.fixture(scope="module")
def column():
    """A cantilever strip of 1 m in four parts, and its bending stiffness."""
    ends = {"a": (0.0, 0.0, 0.0), "b": (1.0, 0.0, 0.0)}
    member = Member(rectangle(0.02, 0.002), Material("steel", 2.1e11, 0.3, 7850.0), (0, 1, 0))
    frame = named(polyline(list(ends.values()), member, elements=16), **ends)
    model = fp.from_frame(frame, [fp.InterfaceRegion(end) for end in ends])
    request = fp.Request(name="strip", reference=fp.MeanAxis(), reduction=fp.CraigBampton(2), parts=4)
    return fp.reduce(model, request), 2.1e11 * 0.02 * 0.002**3 / 12


@pytest.mark.parametrize(
    ("load", "axes", "said"),
    [
        (2.4, "global", ""),
        (2.55, "global", "lowest stiffness"),
        (15.0, "body", ""),
        (19.0, "body", ""),
        (20.5, "body", "flutters"),
    ],
)
def test_a_column_buckles_under_a_dead_load_and_flutters_under_one_that_follows(column, load, axes, said):
    """By Euler at pi^2 / 4 = 2.467, by Beck (1952) at 20.05 EI / L^2, whose column has no other equilibrium than the straight
    one, and no negative stiffness in the sense of statics before."""
    body, stiffness = column
    push = Load("push", "strip.b", force=(-load * stiffness, 0, 0), axes=axes)
    root = Joint("root", "fixed", "ground.O", "strip.a")
    result = static(Scene((Body("strip", body),), (root,), loads=(push,), ground={"O": (0, 0, 0)}))
    unstable = [note for note in result.attributes["notes"] if "unstable" in note]
    assert len(unstable) == bool(said) == 1 - result.attributes["stable"]
    assert said in "".join(unstable)
