"""Steady motions: closed forms, the equations of motion, and what is none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_analyses_kinematic import bar, slider_crank
from test_dyn_plane import rod
from test_quasi_static import rotor

import ffr_dyn as fd
from ffr_dyn.consistency.assemble import assemble, in_space
from ffr_dyn.consistency.evaluation import evaluate, evaluator
from ffr_dyn.consistency.tangent import chart, state_matrix
from ffr_dyn.equations.layout import to_body_axes
from ffr_dyn.functions.curves import curve_value
from ffr_dyn.linear.eigen import eigen
from ffr_dyn.linear.matrices import reduced
from ffr_dyn.linear.matrices import state_matrix as steady_matrix
from ffr_dyn.linear.steady_state import Screws, carried, screws_of, steady_here, steady_state


def governor(speed: float, length: float = 1.0) -> fd.Scene:
    """A bar on a hinge across a vertical spindle that turns: it swings out, cos(angle) = m g l / 2 dJ speed^2, dJ
    across less along."""
    spindle = fd.rigid_body("spindle", mass=1.0, inertia=(0.1, 0.1, 0.1), points={"o": (0, 0, 0), "pin": (0, 0, 0)})
    out = fd.Body("arm", bar("arm", length), rotation=(0, 0.5, 0))
    joints = (
        fd.Joint("bearing", "revolute", "ground.O", "spindle.o"),
        fd.Joint("pin", "revolute", "spindle.pin", "arm.a", axis=(0, 1, 0)),
    )
    motor = fd.Driver("motor", "bearing", fd.polynomial(0.0, speed))
    return fd.Scene(
        (fd.Body("spindle", spindle), out), joints, (motor,), ground={"O": (0, 0, 0)}, gravity=(0, 0, -9.81)
    )


def test_a_governor_stays_out_from_speed_to_speed():
    """From far out it falls not back to hanging, where Newton's method leads from the last speed at once: closed form."""
    speeds, (across, along) = np.array([4.0, 6.0, 12.0]), (1 / 3, 0.01 / 12)
    cosine = 0.5 * 9.81 / speeds**2 / (across - along)
    found = fd.steady(governor(4.0), speeds=tuple(speeds), turn="motor")
    np.testing.assert_allclose(-found["arm.b.position"][:, 2], cosine, rtol=1e-8)
    diagram = fd.campbell(governor(4.0), speeds=speeds, turn="motor")
    vibrations = speeds * np.sqrt((1 - cosine**2) * (across - along) / across) / (2 * np.pi)
    np.testing.assert_allclose(diagram["frequencies"][:, 0], vibrations, rtol=1e-8)
    assert diagram.attributes["limits"] == []


@pytest.mark.slow  # with the governor above
def test_a_steady_motion_that_ends_is_told():
    """A block on a spoke, whose spring gives way and then hardens: from 31.8 rad/s on only the far balance is left."""
    hub = fd.rigid_body("hub", mass=1.0, inertia=(1, 1, 1), points={"o": (0, 0, 0)})
    block = fd.rigid_body("block", mass=1.0, inertia=(0.01, 0.01, 0.01), points={"c": (0, 0, 0)})
    joints = (
        fd.Joint("axle", "revolute", "ground.O", "hub.o"),
        fd.Joint("spoke", "translational", "hub.o", "block.c", axis=(1, 0, 0)),
    )
    force = fd.Curve((-0.05, 0.0, 0.05, 0.1, 0.3), (-200.0, 0.0, 150.0, 155.0, 900.0))
    scene = fd.Scene(
        (fd.Body("hub", hub), fd.Body("block", block, position=(0.1, 0, 0))), joints,
        (fd.Driver("motor", "axle", fd.polynomial(0.0, 1.0)),), ground={"O": (0, 0, 0)},
        forces=(fd.JointSpring("spring", "spoke", stiffness=force, free=0.1, coordinate="stroke"),),
    )  # fmt: skip
    found = fd.steady(scene, speeds=(20.0, 31.0, 31.5, 35.0), turn="motor")
    for speed, stroke in zip(found["speed"], found["spoke.stroke"], strict=True):
        assert speed**2 * stroke == pytest.approx(curve_value(force, stroke - 0.1), rel=1e-8)
    assert [stroke > 0.2 for stroke in found["spoke.stroke"]] == [False, False, False, True]
    leap = [float(note.split()[1]) for note in found.attributes["notes"] if "leaps to another" in note]
    assert leap == pytest.approx([31.77], abs=0.02)
    assert not any("leaps" in note for note in fd.steady(scene, speeds=(5.0, 31.0), turn="motor").attributes["notes"])


def test_a_governor_swings_out_and_vibrates_as_it_should():
    """At the angle a from the vertical, J_across theta'' = -speed^2 sin^2 a (J_across - J_along) theta."""
    speed = 6.0
    found = steady_state(assemble(in_space(governor(speed))), 0.0)
    tip = fd.steady(governor(speed))["arm.b.position"][0]
    across, along = 1 / 3, 0.01 / 12  # moments of inertia
    cosine = 0.5 * 9.81 / speed**2 / (across - along)
    assert -tip[2] == pytest.approx(cosine, rel=1e-8)
    values = eigen(*(lambda of: (of.K, of.C))(reduced(found))).values
    assert np.abs(values.imag).max() == pytest.approx(
        speed * np.sqrt((1 - cosine**2) * (across - along) / across), rel=1e-8
    )
    assert found.notes == ()
    hanging = fd.steady(
        replace(
            governor(speed), bodies=(governor(speed).bodies[0], fd.Body("arm", bar("arm", 1.0), rotation=(0, 1.5, 0)))
        )
    )
    assert not hanging.attributes["stable"]
    assert "pin.angle grows" in hanging.attributes["notes"][-1]


@pytest.mark.parametrize("stiffening", [False, True], ids=["linear", "second order"])
def test_accelerations_in_moving_axes_vanish(stiffening):
    """By the compiled equations, beyond the first frequency."""
    assembled = assemble(in_space(rotor(150.0, stiffening=stiffening)))
    found, place = steady_state(assembled, 0.0), assembled.system.layout
    now = evaluate(evaluator(assembled.system), 0.0, found.x, found.v)
    left, V = now.acceleration.copy(), to_body_axes(place, found.x, found.v)
    left[:3] -= np.cross(V[3:6], V[:3])
    assert np.abs(left).max() < 1e-8 * max(150.0**2, np.abs(now.acceleration).max())
    np.testing.assert_allclose(found.about.lam, now.lam, atol=1e-7 * np.abs(now.lam).max())


def test_the_exact_state_matrix_is_that_of_differences():
    assembled = assemble(in_space(rotor(150.0, stiffening=True)))
    found = steady_state(assembled, 0.0)
    near = chart(evaluator(assembled.system), 0.0, found.x, found.v)
    same = replace(found, Z=near.Z)
    A, _ = state_matrix(near)
    exact = steady_matrix(same, reduced(same))
    assert np.abs(A - exact).max() < 1e-5 * np.abs(exact).max()


def drag(name: str, marker: str) -> fd.Load:
    """A Python force and moment against the velocity of a point."""

    def against(t, state):
        velocity = np.asarray(state.velocity(marker))
        return np.concatenate([-3.0 * velocity, -0.2 * velocity])

    return fd.Load(name, marker, function=against)


def test_python_forces_against_a_velocity_have_the_exact_state_matrix_too():
    """Of a rod that a motor turns through what drags at its end, and so in a steady motion under a large force."""
    assembled = assemble(in_space(rotor(50.0, stiffening=True, loads=(drag("air", "rod.b"),))))
    found = steady_state(assembled, 0.0)
    near = chart(evaluator(assembled.system), 0.0, found.x, found.v)
    A, _ = state_matrix(near)
    exact = replace(found, Z=near.Z)
    np.testing.assert_allclose(steady_matrix(exact, reduced(exact)), A, atol=1e-8 * np.abs(A).max())


def test_dampers_to_the_ground_push_what_turns():
    """A whirling mass of internal and external damping c_i, c_e: K of the turning axes has the skew part c_e Omega."""
    c, speed = 4.0, 30.0
    disc = fd.rigid_body("disc", mass=2.0, inertia=(0.1, 0.1, 0.2), points={"c": (0, 0, 0)})
    K, C = np.diag([800.0, 800, 800, 50, 50, 0]), np.diag([c, c, c, 0.5, 0.5, 0])
    scene = fd.Scene(
        (fd.Body("disc", disc, omega_bar=(0, 0, speed)),),
        forces=(fd.Bushing("bearing", "ground.O", "disc.c", K, C),),
        ground={"O": (0, 0, 0)},
    )
    assembled = assemble(in_space(scene))
    found = steady_here(assembled.system, 0.0, assembled.x, assembled.v)
    assert found is not None
    across = found.about.K[:2, :2]
    np.testing.assert_allclose(across, [[800 - 2 * speed**2, -c * speed], [c * speed, 800 - 2 * speed**2]], atol=1e-5)
    values = eigen(*(lambda of: (of.K, of.C))(reduced(found))).values
    expected = np.roots([2.0, c, 800.0])[0]  # of the ground, where it turns or not
    seen = values + 1j * speed * np.array([[1], [-1]])
    assert np.abs(seen - expected).min() < 1e-6 * abs(expected)


@pytest.mark.parametrize(("speed", "tilting", "told"), [(30.0, 50.0, 1), (0.0, 50.0, 0), (30.0, 0.0, 0)])
def test_a_bushing_that_is_no_bearing_is_told(speed, tilting, told):
    """Its moments are those of a rotation vector, whose tilting goes to zero at half a turn."""
    disc = fd.rigid_body("disc", mass=2.0, inertia=(0.1, 0.1, 0.2), points={"c": (0, 0, 0)})
    support = fd.Bushing("support", "ground.O", "disc.c", (800, 800, 800, tilting, tilting, 0))
    scene = fd.Scene((fd.Body("disc", disc, omega_bar=(0, 0, speed)),), forces=(support,), ground={"O": (0, 0, 0)})
    said = "bushing 'support' is turned on and on"
    assert sum(said in note for note in fd.linearise(scene).notes) == told
    assert sum(said in note for note in fd.steady(scene).attributes["notes"]) == told


@pytest.mark.parametrize("own", [0.0, 100.0])
def test_a_bushing_that_turns_with_both_its_ends_is_no_bearing(own):
    """A disc on the hub of a driver, whose scene gives it the speed or leaves that to be found."""
    hub = fd.rigid_body("hub", mass=1e-3, inertia=(1e-6, 1e-6, 1e-6), points={"c": (0, 0, 0)})
    disc = fd.rigid_body("disc", mass=10.0, inertia=(0.06, 0.06, 0.1), points={"c": (0, 0, 0)})
    scene = fd.Scene(
        (fd.Body("hub", hub), fd.Body("disc", disc, omega_bar=(0, 0, own))),
        (fd.Joint("bearing", "revolute", "ground.O", "hub.c"),),
        drivers=(fd.Driver("motor", "bearing", fd.polynomial(0, 100.0)),),
        forces=(fd.Bushing("mount", "hub.c", "disc.c", (4e5, 4e5, 1e8, 3e3, 3e3, 1e6)),),
        ground={"O": (0, 0, 0)},
    )
    notes = fd.steady(scene, speeds=(100.0,), turn="motor").attributes["notes"]
    assert not any("turned on and on" in note for note in notes)
    assert any("give them omega_bar" in note for note in notes) == (own == 0.0)


def test_screws_carry_bodies():
    place = (assembled := assemble(in_space(governor(6.0)))).system.layout
    screws = screws_of(place, assembled.x, assembled.v)
    turned = carried(place, screws, assembled.x, 2 * np.pi / 6.0)
    np.testing.assert_allclose(np.abs(turned), np.abs(assembled.x), atol=1e-12)


def test_weight_across_the_axis_is_taken_as_its_mean():
    scene = rotor(200.0, stiffening=True)
    plain = fd.steady(scene)["rod.q"]
    heavy = fd.steady(replace(scene, gravity=(0, -9.81, 0)))
    assert "mean over a turn" in heavy.attributes["notes"][-1]
    np.testing.assert_allclose(heavy["rod.q"], plain, atol=1e-9 * np.abs(plain).max())


SLOWLY = [pytest.param(share, marks=pytest.mark.slow) for share in (0.5, 0.3, np.sqrt(0.1), 1e-3)]


@pytest.mark.parametrize("slower", [-0.5, *SLOWLY])
def test_weight_across_rotors_of_several_speeds_bends_none_of_them(slower):
    """Its mean in the axes of each is zero, whatever the other does."""
    rods = [rod(name, 0.8, stiffening=True) for name in "ab"]
    speeds, places = (200.0, 200.0 * slower), {"O": (0, 0, 0), "P": (0, 0, 1.0)}
    scene = fd.Scene(
        tuple(fd.Body(one.name, one, position=at) for one, at in zip(rods, places.values(), strict=True)),
        tuple(fd.Joint(f"hinge_{n}", "revolute", f"ground.{at}", f"{n}.a") for n, at in zip("ab", places, strict=True)),
        tuple(fd.Driver(f"motor_{n}", f"hinge_{n}", fd.polynomial(0, w)) for n, w in zip("ab", speeds, strict=True)),
        ground=places,
    )
    plain, heavy = fd.steady(scene), fd.steady(replace(scene, gravity=(0, -9.81, 0)))
    for name in ("a.q", "b.q"):
        np.testing.assert_allclose(heavy[name], plain[name], atol=1e-9 * np.abs(plain["a.q"]).max())


def test_bodies_at_several_speeds_come_round_together():
    """The speeds themselves where they do within sixteen turns, else others, as many and in the same order."""
    for speeds, turns in (([9, 9], 1), ([9, -9, 0], 1), ([9, 4.5], 2), ([10, 3], 10), ([9, 8.9, 5, 1e-3, 0], 16)):
        w = np.outer(speeds, [0, 0, 1.0])
        paced, count = Screws(np.zeros_like(w), w).in_whole_turns()
        whole = paced.w[:, 2] / speeds[0] * count
        np.testing.assert_allclose(whole, np.round(whole), atol=1e-12)
        assert len(set(np.abs(np.round(whole)))) == len(set(np.abs(speeds)))
        assert (np.diff(np.abs(whole)) <= 0).all()
        assert count == turns
        assert turns == 16 or paced.w is w


def test_a_crank_drive_has_no_steady_motion():
    with pytest.raises(fd.InputError, match="does not hold"):
        fd.steady(slider_crank(0.1, 0.3, fd.Driver("motor", "main", fd.polynomial(0.3, 5.0))))


def test_a_friction_that_brakes_has_none_either():
    wheel = fd.rigid_body("wheel", mass=1.0, inertia=(1, 1, 1), points={"c": (0, 0, 0)})
    scene = fd.Scene(
        (fd.Body("wheel", wheel, omega_bar=(0, 0, 5.0)),),
        (fd.Joint("hinge", "revolute", "ground.O", "wheel.c"),),
        forces=(fd.JointSpring("drag", "hinge", damping=0.3),),
        ground={"O": (0, 0, 0)},
    )
    with pytest.raises(fd.InputError, match=r"what acts along hinge\.angle speeds it up or slows it down"):
        fd.steady(scene)


def test_a_run_begins_in_it_and_stays():
    how = {"end": 0.02, "output_step": 1e-3, "method": fd.RK4(5e-6), "check": False}
    q = fd.forward(rotor(200.0, stiffening=True), begin="steady", **how)["rod.q"]
    assert np.ptp(q, axis=0).max() < 1e-7 * np.abs(q).max()


def test_an_unbalanced_disc_whirls_about_the_axis_of_what_drives_it():
    """Not about its centre of mass, where it was at rest: |r| = m e W^2 / |k - m W^2 + i c W|, with the torque c W |r|^2."""
    m, k, c, e, speed = 5.0, 5e4, 60.0, 1e-4, 140.0
    hub = fd.rigid_body("hub", mass=1.0, inertia=(0.01,) * 3, points={"c": (0, 0, 0)})
    disc = fd.rigid_body("disc", mass=m, inertia=(0.02, 0.02, 0.04), centre_of_mass=(e, 0, 0), points={"c": (0, 0, 0)})
    scene = fd.Scene(
        (fd.Body("hub", hub), fd.Body("disc", disc)),
        (
            fd.Joint("bearing", "revolute", "ground.O", "hub.c"),
            fd.Joint("turned", "orientation", "hub.c", "disc.c"),
            fd.Joint("plane", "point-on-plane", "hub.c", "disc.c", axis=(0, 0, 1)),
        ),
        (fd.Driver("motor", "bearing", fd.polynomial(0.0, speed)),),
        forces=(
            fd.Bushing("shaft", "hub.c", "disc.c", np.diag([k, k, 0, 0, 0, 0])),
            fd.Bushing("air", "ground.O", "disc.c", np.zeros((6, 6)), np.diag([c, c, 0, 0, 0, 0])),
        ),
        ground={"O": (0, 0, 0)},
    )
    found = fd.steady(scene)
    r = m * e * speed**2 / (k - m * speed**2 + 1j * c * speed)
    assert found["disc.c.position"][-1] == pytest.approx([r.real, r.imag, 0.0], abs=1e-12)
    assert found["motor.effort"][-1] == pytest.approx(c * speed * abs(r) ** 2, rel=1e-6)


def unbalanced(damping: float, speed: float) -> fd.Scene:
    """A disc of 2 kg that spins freely in two bearings of 400 N/m, its mass a millimetre from their line."""
    points = {"l": (0, 0, -0.2), "r": (0, 0, 0.2), "c": (0, 0, 0)}
    disc = fd.rigid_body("disc", mass=2.0, inertia=(0.1, 0.1, 0.2), centre_of_mass=(1e-3, 0, 0), points=points)
    K, C = np.diag([400.0, 400, 4e4, 0, 0, 0]), np.diag([damping / 2, damping / 2, 0, 0, 0, 0])
    bearings = tuple(fd.Bushing(f"at_{side}", f"ground.{side}", f"disc.{side}", K, C) for side in "lr")
    return fd.Scene((fd.Body("disc", disc, omega_bar=(0, 0, speed)),), forces=bearings, ground=points)


@pytest.mark.parametrize("speed", [10.0, 25.0])
def test_a_free_rotor_lags_behind_its_unbalance(speed):
    """(k - m w^2 + i c w) z = m e w^2, with so little damping that it spins for months."""
    found = fd.steady(unbalanced(0.1, speed))
    z = 2e-3 * speed**2 / (800 - 2 * speed**2 + 0.1j * speed)
    at = complex(found["disc.c.position.x"][0], found["disc.c.position.y"][0])
    assert abs(at - z) < 1e-4 * abs(z.imag)


def test_a_free_rotor_that_its_bearings_brake_has_no_steady_motion():
    """And not because a body is too soft."""
    with pytest.raises(fd.InputError, match="what acts along disc turn z speeds it up or slows it down; add a driver"):
        fd.steady(unbalanced(5.0, 25.0))


def test_of_two_free_rotors_the_one_that_is_braked_is_told():
    quiet, braked = unbalanced(0.0, 10.0), unbalanced(5.0, 25.0)
    other = replace(braked.bodies[0], name="wheel")
    forces = tuple(
        fd.Bushing(f"w{b.name}", b.i, b.j.replace("disc", "wheel"), b.stiffness, b.damping) for b in braked.forces
    )
    both = replace(quiet, bodies=(*quiet.bodies, other), forces=(*quiet.forces, *forces))
    with pytest.raises(fd.InputError, match="what acts along wheel turn z"):
        fd.steady(both)


def test_a_torque_that_follows_another_body_holds_what_it_turns():
    """A coupling by a law that looks at both shafts: what it holds against a brake does not turn on by itself."""
    points = {"O": (0, 0, 0)}
    wheel = fd.rigid_body("wheel", mass=1.0, inertia=(0.1, 0.1, 0.1), points=points)
    bodies = tuple(fd.Body(name, wheel, omega_bar=(0, 0, 5.0)) for name in ("a", "b"))
    joints = tuple(fd.Joint(f"axis_{name}", "revolute", "ground.O", f"{name}.O") for name in "ab")

    def coupling(t, state):
        there = state.axes("a").T @ state.axes("b")
        return -50.0 * np.arctan2(there[1, 0], there[0, 0])

    scene = fd.Scene(
        bodies, joints, (fd.Driver("motor", "axis_a", fd.polynomial(0.0, 5.0)),), ground=points,
        forces=(fd.JointSpring("brake", "axis_b", damping=0.2), fd.Actuator("coupling", "axis_b", function=coupling)),
    )  # fmt: skip
    found = fd.steady(scene)
    assert found["axis_a.angle"][0] - found["axis_b.angle"][0] == pytest.approx(0.02, rel=1e-8)


@pytest.mark.parametrize("speeds", [(1.0, -1.5), (1.0, -1.0), (1.0, 0.4)])
def test_rotors_that_turn_against_each_other_go_on_doing_so(speeds):
    """Bodies that have velocities of their own are not turned with others, however much forces between them vary."""
    bodies = [
        fd.Body(
            name,
            fd.rigid_body(name, mass=2.0, inertia=(0.01, 0.01, 0.02), points={"c": (0, 0, 0)}),
            omega_bar=(0, 0, w),
        )
        for name, w in zip("ab", speeds, strict=True)
    ]
    k = (2e4, 2e4, 1e6, 1e4, 1e4, 0)
    ends = (("ground.O", "a.c"), ("ground.O", "b.c"), ("a.c", "b.c"))
    bearings = [fd.Bushing(f"bearing_{n}", *pair, k) for n, pair in enumerate(ends)]
    found = fd.steady(fd.Scene(bodies, forces=bearings, ground={"O": (0, 0, 0)}), speeds=(30.0,))
    share = 30 / max(map(abs, speeds))
    assert found["a.omega_bar"][0, 2] == pytest.approx(share * speeds[0])
    assert found["b.omega_bar"][0, 2] == pytest.approx(share * speeds[1])
    assert not any("turn with it" in note for note in found.attributes["notes"])
