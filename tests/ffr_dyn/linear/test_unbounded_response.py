"""Responses at poles: infinite where they are, their limits where an output has none; noise, stability, a driver's effort."""

from __future__ import annotations

import numpy as np
import pytest

import ffr_dyn as fd
from ffr_dyn.analyses.rotating.response import response_lines

GROUND = {"O": (0, 0, 0)}
MOTIONS = ("m.c.position.x", "m.c.velocity.x", "m.c.acceleration.x")
MASS = 2.0


def point(mass: float = MASS, inertia: float = 1.0) -> object:
    return fd.rigid_body("m", mass=mass, inertia=[inertia] * 3, points={"c": (0, 0, 0)})


def sliding(*forces: object, **more: object) -> fd.Scene:
    rail = fd.Joint("rail", "translational", "ground.O", "m.c", axis=(1, 0, 0))
    return fd.Scene([fd.Body("m", point())], [rail], forces=forces, ground=GROUND, **more)


def spring(k: float, c: float) -> fd.JointSpring:
    return fd.JointSpring("spring", "rail", stiffness=k, damping=c, coordinate="stroke")


def response(scene: fd.Scene, outputs: tuple[str, ...] = MOTIONS, **more: object) -> fd.Result:
    return fd.response(scene, input="rail.force", outputs=outputs, **more)


def pushing_along(rate: float) -> fd.Load:
    return fd.Load("wind", "m.c", function=lambda t, state: rate * state.velocity("m.c"))


def test_at_rest_what_nothing_holds_has_its_limits():
    """A force on a mass with a damper c: velocity 1 / c, no acceleration; on a free one: acceleration 1 / m."""
    damped = response(sliding(spring(0.0, 5.0)), frequencies=[0.0, 1.0])
    np.testing.assert_allclose(damped["gain"][0], [np.inf, 0.2, 0.0], rtol=1e-9, atol=1e-8)
    free = response(sliding(), frequencies=[0.0, 1.0])
    np.testing.assert_allclose(free["gain"][0], [np.inf, np.inf, 1 / MASS], rtol=1e-9)
    assert any("at 0 Hz there is no bound for m.c.position.x, m.c.velocity.x:" in n for n in free.attributes["notes"])


def test_an_undamped_resonance_is_infinite():
    found = response(sliding(spring(32.0, 0.0)))
    peak = int(np.argmax(found["gain"][:, 0]))
    assert found["frequency"][peak] == pytest.approx(4 / (2 * np.pi), rel=1e-12)
    assert found["gain"][peak, 0] == np.inf
    others = np.abs(found["frequency"] / found["frequency"][peak] - 1) > 1e-6
    w = 2 * np.pi * found["frequency"][others]
    np.testing.assert_allclose(found["transfer"][others, 0, 0], 1 / (32.0 - MASS * w**2), rtol=1e-6)
    assert "there is no bound" in found.attributes["notes"][0]
    assert any("at most inf" in line for line in response_lines(found))


def test_an_output_that_does_not_see_an_undamped_vibration_is_finite_there():
    """Two masses with a spring each, of one frequency: a force on the first, across which the second does not move."""
    rails = [
        fd.Joint(f"r{n}", "translational", "ground.O", f"{n}.c", axis=a)
        for n, a in (("a", (1, 0, 0)), ("b", (0, 1, 0)))
    ]
    springs = [
        fd.JointSpring(f"s{n}", f"r{n}", stiffness=32.0, damping=c, coordinate="stroke")
        for n, c in (("a", 1.0), ("b", 0.0))
    ]
    scene = fd.Scene([fd.Body(n, point()) for n in "ab"], rails, forces=springs, ground=GROUND)
    at = 4 / (2 * np.pi)
    found = fd.response(scene, input="ra.force", outputs=("ra.stroke", "rb.stroke"), frequencies=[at])
    np.testing.assert_allclose(found["gain"][0], [1 / 4.0, 0.0], rtol=1e-9, atol=1e-12)
    assert found.attributes["notes"] == []


@pytest.mark.parametrize("ratio", [1e-2, 1e-4, 1e-6, 1e-8])
def test_the_rms_of_what_is_hardly_damped(ratio):
    """White noise on a mass and a spring: S / (4 c k). Before, 2 % were missing of what is damped less than 1e-5."""
    k, S = 800.0, 1e-3
    c = 2 * ratio * np.sqrt(k * MASS)
    found = response(sliding(spring(k, c)), psd=((0.0, S), (5000.0, S)))
    assert found.attributes["rms"]["m.c.position.x"] == pytest.approx(np.sqrt(S / (4 * c * k)), rel=1e-5)


def test_noise_without_bound_is_told():
    noise = {"psd": ((0.0, 1e-3), (10.0, 1e-3))}
    free = response(sliding(), **noise).attributes
    rms = [free["rms"][name] for name in MOTIONS]
    np.testing.assert_allclose(rms, [np.inf, np.inf, np.sqrt(1e-2) / MASS], rtol=1e-9)
    assert "noise down to 0 Hz" in free["notes"][-1]
    undamped = response(sliding(spring(800.0, 0.0)), **noise).attributes
    assert set(undamped["rms"].values()) == {np.inf}
    assert "has no damping" in undamped["notes"][-1]
    above = response(sliding(), psd=((1.0, 1e-3), (10.0, 1e-3))).attributes
    expected = np.sqrt(1e-3 / (3 * (2 * np.pi) ** 4) * (1 - 1e-3)) / MASS
    assert above["rms"]["m.c.position.x"] == pytest.approx(expected, rel=1e-6)
    assert above["notes"] == []


def test_what_grows_is_told():
    found = response(sliding(spring(800.0, 0.0), loads=[pushing_along(0.5)]), psd=((0.0, 1e-3), (10.0, 1e-3)))
    assert "'rail.stroke' grows by 0.125 1/s" in found.attributes["notes"][0]
    assert set(found.attributes["rms"].values()) == {np.inf}


def test_slow_vibrations_beside_fast_ones_have_their_part():
    """A mount of 2e6 rad/s beside a mass on a spring of 1 rad/s, which the answer is all of."""
    stiff = fd.Bushing("mount", "ground.O", "pin.c", [4e11] * 6, [1e3] * 6)
    rail = fd.Joint("rail", "translational", "ground.O", "m.c", axis=(1, 0, 0))
    pin = fd.rigid_body("pin", mass=0.1, inertia=[0.1] * 3, points={"c": (0, 0, 0)})
    scene = fd.Scene(
        [fd.Body("m", point()), fd.Body("pin", pin)], [rail], forces=[stiff, spring(2.0, 0.1)], ground=GROUND
    )
    found = response(scene, ("rail.stroke",), band_of=(0.01, 10.0))
    assert found.attributes["modes"][0] == "rail.stroke"
    np.testing.assert_allclose(found["parts"][:, 0, 0], found["transfer"][:, 0], rtol=1e-6)


def test_the_effort_of_a_driver_that_shakes():
    """A driven mass with another behind a spring: its dynamic stiffness; by its own effort as input, one."""
    k, c = 400.0, 3.0
    joints = [
        fd.Joint("rail", "translational", "ground.O", "m.c", axis=(1, 0, 0)),
        fd.Joint("second", "translational", "m.c", "n.c", axis=(1, 0, 0)),
    ]
    scene = fd.Scene(
        [fd.Body("m", point(3.0)), fd.Body("n", point(2.0))], joints, [fd.Driver("motor", "rail", 0.0, coordinate="stroke")],
        forces=[fd.JointSpring("s", "second", stiffness=k, damping=c, coordinate="stroke")], ground=GROUND,
    )  # fmt: skip
    f = np.array([0.5, 1.0, 2.3, 5.0])
    s = 2j * np.pi * f
    follows = (c * s + k) / (2.0 * s**2 + c * s + k)
    for motion, order in (("stroke", 0), ("stroke_rate", 1), ("stroke_acceleration", 2)):
        found = fd.response(scene, input=f"motor.{motion}", outputs=("second.stroke", "motor.effort"), frequencies=f)
        H = found["transfer"] @ [1, 1j] * s[:, None] ** order
        np.testing.assert_allclose(H, np.array([follows - 1, (3.0 + 2.0 * follows) * s**2]).T, rtol=1e-6)
    own = fd.response(scene, input="motor.force", outputs=("motor.effort",), frequencies=f)
    np.testing.assert_allclose(own["gain"], 1.0)


def test_the_torque_of_a_driver_that_turns_a_rotor_unevenly():
    """About a steady motion, beside an output of the ground's axes: J s^2, and nothing beside its own frequency."""
    disc = fd.rigid_body("disc", mass=1.0, inertia=[1.0, 1.0, 2.0], points={"c": (0, 0, 0), "rim": (0.1, 0, 0)})
    scene = fd.Scene(
        [fd.Body("disc", disc)], [fd.Joint("axle", "revolute", "ground.O", "disc.c")],
        [fd.Driver("motor", "axle", fd.polynomial(0.0, 30.0))], ground=GROUND,
    )  # fmt: skip
    f = np.array([1.0, 2.0])
    found = fd.response(
        scene, input="motor.angle", outputs=("disc.rim.position.x", "motor.effort"), frequencies=f, about="steady"
    )
    np.testing.assert_allclose(found["transfer"][:, 1] @ [1, 1j], 2.0 * (2j * np.pi * f) ** 2, rtol=1e-7)
    assert not any("motor.effort also answers" in note for note in found.attributes["notes"])


@pytest.mark.parametrize("name", ["rail.force_joint", "m.c.orientation", "m.alpha_bar"])
def test_every_quantity_is_an_output_by_its_components(name):
    found = response(sliding(spring(40.0, 5.0)), (name,), frequencies=[1.0])
    assert len(found.attributes["outputs"]) == (4 if name == "m.c.orientation" else 3)
    assert all(output.startswith(f"{name}.") for output in found.attributes["outputs"])
