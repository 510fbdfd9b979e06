"""Scenes that are linearised where a force has a kink say so; others do not."""

from __future__ import annotations

import numpy as np
import pytest

import ffr_dyn as fd
import ffr_prep as fp

CART = fp.rigid_body("cart", mass=2.0, inertia=(1.0, 1.0, 1.0), points={"p": (0, 0, 0)})
SPRING = fd.JointSpring("spring", "guide", stiffness=800.0, coordinate="stroke")
ROPE = fd.Curve((-1.0, 0.0, 1.0), (0.0, 0.0, 3e3))


def scene(*forces, x=0.0, speed=0.0, loads=(), springs=()):
    return fd.Scene(
        (fd.Body("cart", CART, position=(x, 0, 0), velocity=(speed, 0, 0)),),
        (fd.Joint("guide", "translational", "ground.o", "cart.p", axis=(1, 0, 0)),),
        forces=(SPRING, *forces),
        springs=springs,
        loads=loads,
        ground={"o": (0, 0, 0), "far": (-1.0, 0, 0)},
    )


def stop(entry=1e-4):
    return fd.JointStop("it", "guide", stiffness=1e6, entry=entry, coordinate="stroke", upper=0.0)


def servo(target, kd=5.0):
    return fd.Servo("it", "guide", target=target, kp=500.0, kd=kd, limit=50.0, coordinate="stroke")


def rope(free_length):
    return fd.SpringDamper("it", "ground.far", "cart.p", stiffness=ROPE, free_length=free_length)


def push(function):
    return (fd.Load("it", "cart.p", function=function),)


def by_position(t, state):
    return (100.0 * max(0.0, state.position("cart.p")[0]), 0, 0)


def by_velocity(t, state):
    return (-9.0 * min(0.0, state.velocity("cart.p")[0]), 0, 0)


AT_KINK = {
    "edge of a stop": (scene(stop()), "position"),
    "edge of a stop with no entry to speak of": (scene(stop(1e-10)), "position"),
    "servo at its limit": (scene(servo(0.1)), "position and velocity"),
    "moving servo at its limit": (scene(servo(0.11), speed=1.0), "position and velocity"),
    "rope just taut": (scene(springs=(rope(1.0),)), "position"),
    "function of the position": (scene(loads=push(by_position)), "position"),
    "function of the velocity": (scene(loads=push(by_velocity)), "velocity"),
}
BESIDE = {
    "before a stop": scene(stop(), x=-1e-4),
    "within a stop": scene(stop(), x=5e-5),
    "servo within its limit": scene(servo(0.0999)),
    "moving servo within its limit": scene(servo(0.1), speed=1.0),
    "taut rope": scene(springs=(rope(0.999),)),
    "function of the position": scene(loads=push(by_position), x=1e-4),
    "drag": scene(loads=push(lambda t, state: -state.velocity("cart.p") * abs(state.velocity("cart.p")[0]))),
    "parabola": scene(loads=push(lambda t, state: (5.0 * state.position("cart.p")[0] ** 2, 0, 0))),
    "friction": scene(fd.JointFriction("it", "guide", coulomb=10.0, creep=1e-3, coordinate="stroke")),
    "bushing": scene(fd.Bushing("it", "ground.o", "cart.p", stiffness=(1e4, 1e4, 1e4, 10.0, 10.0, 10.0))),
}


@pytest.mark.parametrize("name", AT_KINK)
def test_a_kink_at_the_state_is_told(name):
    at, by = AT_KINK[name]
    notes = [note for note in fd.linearise(at).notes if "has a kink just at this state" in note]
    assert len(notes) == 1
    assert notes[0].startswith(f"force 'it' has a kink just at this state: by {by} it changes")


@pytest.mark.parametrize("name", BESIDE)
def test_beside_it_nothing_is_told(name):
    assert not [note for note in fd.linearise(BESIDE[name]).notes if "kink" in note]


DRY = {"coulomb": 4.0, "static": 5.0, "stribeck": 0.1, "creep": 1e-3, "coordinate": "stroke"}


@pytest.mark.parametrize(
    ("friction", "speed", "words"),
    [
        (DRY, 0.0, "does not hold 5 N, but damps by 5000 N s/m below 0.001 m/s"),
        (DRY | {"normal": lambda t: 2.0}, 0.0, "does not hold a load, but damps steeply below 0.001 m/s"),
        (DRY, 2e-3, None),
        (DRY | {"coulomb": 0.0, "static": 0.0}, 0.0, None),
    ],
)
def test_dry_friction_that_is_to_stick_is_told(friction, speed, words):
    """Smooth, it is a damper at rest: 0 Hz, and -2500 1/s, were told of a cart that rests on rough ground."""
    at = scene(fd.JointFriction("it", "guide", **friction), speed=speed)
    for notes in (fd.linearise(at).notes, *([] if speed else [fd.static(at).attributes["notes"]])):
        told = [note for note in notes if "force 'it' is dry friction" in note]
        assert len(told) == (words is not None)
        assert all(words in note for note in told)


def test_a_block_on_an_incline_that_friction_is_to_hold_is_told_why_nothing_does():
    slope = fd.Scene(
        (fd.Body("cart", CART),),
        (fd.Joint("guide", "translational", "ground.o", "cart.p", axis=(1, 0, 0)),),
        forces=(fd.JointFriction("it", "guide", coulomb=12.0, creep=1e-3, coordinate="stroke"),),
        gravity=(3.0, -9.0, 0.0),
        ground={"o": (0, 0, 0)},
    )
    with pytest.raises(
        fd.InputError, match=r"nothing holds the motion guide\.stroke.*'it' is dry friction made smooth"
    ):
        fd.static(slope)


def test_a_stop_that_is_just_touched_adds_no_stiffness_yet():
    """Its force begins with the square of the depth; beside no damping, the mean of slopes over a micrometre is 2500 N/m."""
    found = fd.linearise(scene(stop(1e-6)))
    np.testing.assert_allclose(2 * np.pi * found.frequencies, 20.0, rtol=1e-3)
