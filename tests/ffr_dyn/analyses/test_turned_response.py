"""Frequency response of what turns, between inputs and outputs that do not: against equations in axes at rest."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from test_hill import ACROSS, ALONG, ENDS, MASS, rotor

import ffr_dyn as fd

SPEED, DAMPING = 200.0, 300.0
F = np.array([5.0, SPEED / (2 * np.pi), 40.0, 60.0, 90.0, 130.0])  # Hz, one of them that of the speed


def receptance(at: float, seen: tuple[float, ...], stiff: tuple[float, float] = (1e6, 1.5e6)) -> np.ndarray:
    """(F,) of seen . (x, y, turns about x and y) to a force along x at a distance from the centre."""
    M, C, K = np.diag([MASS, MASS, ACROSS, ACROSS]), np.zeros((4, 4)), np.zeros((4, 4))
    C[2, 3], C[3, 2] = ALONG * SPEED, -ALONG * SPEED
    for z in ENDS:
        B = np.array([[1, 0, 0, z], [0, 1, -z, 0]])
        K += B.T @ np.diag(stiff) @ B
        C += DAMPING * B.T @ B
    s = 2j * np.pi * F
    return np.array([np.linalg.solve(K + one**2 * M + one * C, (1, 0, 0, at)) @ np.array(seen) for one in s])


@pytest.mark.slow
def test_a_force_that_does_not_turn_with_the_rotor_excites_whirls_seen_from_the_ground():
    outputs = ["disc.right.position.x", "disc.left.acceleration.y"]
    how = {"input": "disc.right.force.x", "about": "steady", "frequencies": F}
    found = fd.response(rotor(SPEED, DAMPING), outputs=outputs, **how)
    H = found["transfer"] @ np.array([1, 1j])
    np.testing.assert_allclose(H[:, 0], receptance(ENDS[1], (1, 0, 0, ENDS[1])), rtol=1e-9)
    acceleration = (2j * np.pi * F) ** 2 * receptance(ENDS[1], (0, 1, -ENDS[0], 0))
    np.testing.assert_allclose(H[:, 1], acceleration, rtol=1e-7)
    assert not any("also answers" in note for note in found.attributes["notes"])
    np.testing.assert_allclose(found["parts"].sum(axis=2)[:, 0], found["transfer"][:, 0], rtol=1e-6)


@pytest.mark.slow
def test_the_ground_that_shakes_carries_along_what_turns():
    found = fd.response(
        rotor(SPEED, DAMPING),
        input="base.x.displacement",
        outputs=["disc.left.position.x"],
        about="steady",
        frequencies=[1e-3],
    )
    assert found["gain"][0, 0] == pytest.approx(1.0, abs=1e-6)


@pytest.mark.slow
def test_what_is_seen_in_turning_axes_has_other_frequencies_which_is_told():
    scene = rotor(SPEED, DAMPING)
    found = fd.response(scene, input="disc.right.force.x", outputs=["disc.omega_bar.x"], about="steady", frequencies=F)
    (note,) = (note for note in found.attributes["notes"] if "also answers" in note)
    assert note.startswith(
        "disc.omega_bar.x also answers at the frequency of the input plus and minus multiples of 31.831 Hz"
    )
    assert note.endswith("not at its own")


@pytest.mark.slow
def test_the_rms_of_what_turns_is_that_of_all_frequencies_at_which_it_answers():
    """A force along x at the middle of a rotor that does not tilt: of what is seen along an axis of the rotor the rms is
    that along x over the root of two, as it is along x half of the time and across it the other half."""
    disc = fd.rigid_body("disc", mass=1.0, inertia=(1e-3, 1e-3, 2e-3), points={"c": (0, 0, 0)})
    hub = fd.rigid_body("hub", mass=1.0, inertia=(1, 1, 1), points={"c": (0, 0, 0)})
    scene = fd.Scene(
        [fd.Body("hub", hub), fd.Body("disc", disc, omega_bar=(0, 0, 60.0))],
        [fd.Joint("axle", "revolute", "ground.O", "hub.c", axis=(0, 0, 1))],
        [fd.Driver("motor", "axle", fd.polynomial(0.0, 60.0))],
        forces=[
            fd.Bushing("shaft", "hub.c", "disc.c", (1e4, 1e4, 1e6, 1e3, 1e3, 1e3)),
            fd.Bushing("air", "ground.O", "disc.c", (0,) * 6, (4.0, 4.0, 0, 0, 0, 0)),
        ],
        ground={"O": (0, 0, 0)},
    )  # fmt: skip
    for input, psd in (("disc.c.force.x", ((1, 1e-2), (60, 1e-2))), ("base.x.displacement", ((1, 1e-6), (60, 1e-7)))):
        outputs = ["shaft.displacement.x", "disc.c.position.x", "hub.c.position.x"]
        rms = fd.response(scene, input=input, outputs=outputs, psd=psd, about="steady").attributes["rms"]
        f = np.linspace(1, 60, 200001)
        push = 1.0 if input.startswith("disc") else (2 * np.pi * f) ** 2
        H = push / (1e4 - (2 * np.pi * f) ** 2 + 4.0j * 2 * np.pi * f)
        along = np.sqrt(np.trapezoid(np.abs(H) ** 2 * np.interp(f, *np.transpose(psd)), f))
        assert rms["shaft.displacement.x"] == pytest.approx(along / np.sqrt(2), rel=1e-6)


def spun(speed: float) -> fd.Scene:
    """A disc on a motor's hub, soft about the axis, with a point on its rim."""
    disc = fd.rigid_body("disc", mass=1.0, inertia=(1e-3, 1e-3, 2e-3), points={"c": (0, 0, 0), "rim": (0.1, 0, 0)})
    hub = fd.rigid_body("hub", mass=1.0, inertia=(1, 1, 1), points={"c": (0, 0, 0)})
    return fd.Scene(
        [fd.Body("hub", hub), fd.Body("disc", disc, omega_bar=(0, 0, speed))],
        [fd.Joint("axle", "revolute", "ground.O", "hub.c", axis=(0, 0, 1))],
        [fd.Driver("motor", "axle", fd.polynomial(0.0, speed))],
        forces=[fd.Bushing("shaft", "hub.c", "disc.c", (1e4, 1e4, 1e6, 1e3, 1e3, 1e3), (4, 4, 0, 0.1, 0.1, 0.5))],
        ground={"O": (0, 0, 0)},
    )


@pytest.mark.slow
@pytest.mark.parametrize("speed", [60.0, -60.0])
def test_what_a_motor_shakes_is_seen_from_the_ground_at_other_frequencies(speed):
    """The disc follows the angle of the motor by T; a point of its rim moves along y by r cos(W t) T, half of the time."""
    f, noise = np.array([2.0, 80.0, 112.0]), ((1, 1e-4), (200, 1e-4))
    outputs = ["disc.omega_bar.z", "axle.angle", "disc.rim.position.y"]
    how = {"outputs": outputs, "frequencies": f, "about": "steady", "psd": noise}
    found = fd.response(spun(speed), input="motor.angle", **how)

    def follows(f):
        s = 2j * np.pi * f
        return (0.5 * s + 1e3) / (2e-3 * s**2 + 0.5 * s + 1e3)

    H = found["transfer"] @ np.array([1, 1j])
    np.testing.assert_allclose(H[:, 0], 2j * np.pi * f * follows(f), rtol=1e-8)
    np.testing.assert_allclose(H[:, 1], 1.0, rtol=1e-9)
    assert found["gain"][:, 2].max() < 1e-9
    (note,) = (note for note in found.attributes["notes"] if "also answers" in note)
    assert note.startswith("disc.rim.position.y")
    many = np.linspace(1, 200, 100001)
    rms = 0.1 * np.sqrt(0.5 * np.trapezoid(np.abs(follows(many)) ** 2 * 1e-4, many))
    assert found.attributes["rms"]["disc.rim.position.y"] == pytest.approx(rms, rel=1e-6)


def test_matrices_of_one_moment_of_a_turn_say_so():
    scene = fd.scene_at(spun(60.0), fd.steady(spun(60.0)))
    push = fd.MarkerEffort("push", "disc.c", (1, 0, 0))
    found = fd.linearise(scene, inputs=(push,), outputs=("disc.c.position.x",))
    assert any("B, C and D are those of this moment" in note for note in found.notes)
    assert not fd.linearise(scene, outputs=("disc.omega_bar.z",)).notes
    still = fd.linearise(spun(0.0), inputs=(push,), outputs=("disc.c.position.x",))
    assert not any("of this moment" in note for note in still.notes)


@pytest.mark.slow
@pytest.mark.parametrize(("flat", "support", "speed"), [((1.2e4, 0.8e4), (0, 0), 40), ((1.6e4, 0.4e4), (0, 2e4), 60)])
def test_a_flat_shaft_in_supports_that_are_not_alike_answers_by_all_harmonics(flat, support, speed):
    """Against the equations in axes at rest, whose stiffness has a second harmonic, with twenty-five of the motion."""
    damping, f = 8.0, np.linspace(3, 30, 10)
    disc = fd.rigid_body("disc", mass=1.0, inertia=(1e-3, 1e-3, 2e-3), points={"c": (0, 0, 0)})
    hub = fd.rigid_body("hub", mass=1.0, inertia=(1, 1, 1), points={"c": (0, 0, 0)})
    scene = fd.Scene(
        [fd.Body("hub", hub), fd.Body("disc", disc, omega_bar=(0, 0, speed))],
        [fd.Joint("axle", "revolute", "ground.O", "hub.c", axis=(0, 0, 1))],
        [fd.Driver("motor", "axle", fd.polynomial(0.0, speed))],
        forces=[
            fd.Bushing("shaft", "hub.c", "disc.c", (*flat, 1e6, 1e3, 1e3, 1e3), (0, 0, 0, 0.1, 0.1, 0.1)),
            fd.Bushing("support", "ground.O", "disc.c", (*support, 0, 0, 0, 0), (damping, damping, 0, 0, 0, 0)),
        ],
        ground={"O": (0, 0, 0)},
    )  # fmt: skip
    outputs = ["disc.c.position.x", "disc.c.position.y"]
    found = fd.response(scene, input="disc.c.force.x", outputs=outputs, frequencies=f, about="steady")
    mean = np.diag(sum(flat) / 2 + np.array(support))
    twice = (flat[0] - flat[1]) / 4 * np.array([[1, -1j], [-1j, -1]])  # beside exp(2 i w t)
    numbers, expected = np.arange(-12, 13), []
    for s in 2j * np.pi * f:
        rates = s + 2j * numbers * speed
        A = np.kron(np.diag(rates**2 + damping * rates), np.eye(2)) + np.kron(np.eye(25), mean)
        A += np.kron(np.eye(25, k=-1), twice) + np.kron(np.eye(25, k=1), twice.conj())
        expected.append(np.linalg.solve(A, np.eye(50)[24])[24:26])
    np.testing.assert_allclose(found["transfer"] @ [1, 1j], expected, atol=1e-9 * np.abs(expected).max())
    assert not any("harmonics" in note for note in found.attributes["notes"])


def tilted(speed: float) -> fd.Scene:
    """A rotor that nothing drives, about an axis that is none of the scene's: its free turning is one but for rounding."""
    A = Rotation.from_rotvec((0.9, -0.4, 0.7)).as_matrix()
    places = {"left": (0, 0, -0.3), "right": (0, 0, 0.1), "rim": (0.1, 0, 0.05)}
    disc = fd.rigid_body("disc", mass=8.0, inertia=(0.3, 0.3, 0.4), points=places)
    law = {"stiffness": (5e5, 5e5, 1e5, 0, 0, 0), "damping": (200, 200, 50, 0, 0, 0), "axes": A, "axes_j": np.eye(3)}
    bearings = [fd.Bushing(side, f"ground.{side}", f"disc.{side}", **law) for side in ("left", "right")]
    body = fd.Body("disc", disc, rotation=Rotation.from_matrix(A).as_rotvec(), omega_bar=(0, 0, speed))
    return fd.Scene([body], forces=bearings, ground={name: tuple(A @ place) for name, place in places.items()})


@pytest.mark.parametrize("speed", [188.0, -579.0])
def test_at_the_speed_of_a_free_turning_that_nothing_excites_there_is_no_resonance(speed):
    """Of its eigenvalues, multiples of the speed, rounding made a gain and an rms."""
    own, band = abs(speed) / (2 * np.pi), np.linspace(5.0, 120.0, 2001)
    how = {"input": "base.y", "outputs": ["left.force.x", "disc.right.acceleration.y"], "about": "steady"}
    near = fd.response(tilted(speed), frequencies=[own * (1 - 1e-5), own, own * (1 + 1e-5)], **how)["gain"]
    np.testing.assert_allclose(near[1], 0.5 * (near[0] + near[2]), rtol=1e-6)
    found = fd.response(tilted(speed), frequencies=band, psd=[(5.0, 1.0), (120.0, 1.0)], **how)
    rms = np.array(list(found.attributes["rms"].values()))
    np.testing.assert_allclose(rms**2, np.trapezoid(found["density"], band, axis=0), rtol=1e-5)
    assert not found.attributes["notes"]


def test_noise_that_turns_what_nothing_holds_ever_farther_is_told():
    """A force along the ground at the rim has a mean moment where it keeps step with the turning."""
    outputs, noise = ["disc.omega_bar.z", "left.force.x"], [(5.0, 1.0), (60.0, 1.0)]
    found = fd.response(tilted(188.0), input="disc.rim.force.y", outputs=outputs, psd=noise, about="steady").attributes
    assert np.isfinite(list(found["rms"].values())).tolist() == [False, True]
    (note,) = (note for note in found["notes"] if "ever farther" in note)
    assert note.startswith("noise at 29.921 Hz, in step with the turning")


@pytest.mark.parametrize(
    ("speed", "about"), [(300.0, "steady motion (`--at-steady`, `response --steady`"), (0.0, "equilibrium (`--at-equi")]
)
def test_a_state_that_does_not_last_is_told_with_what_does(speed, about):
    """An unbalance that is not bent yet, and a weight that is not held yet. It was told without a way on."""
    disc = fd.rigid_body("disc", mass=2.0, inertia=[0.1] * 3, centre_of_mass=(0, 1e-3, 0), points={"c": (0, 0, 0)})
    bearing = fd.Bushing("bearing", "ground.c", "disc.c", stiffness=(1e6, 1e6, 1e6, 0, 1e3, 1e3))
    scene = fd.Scene(
        (fd.Body("disc", disc, omega_bar=(speed, 0, 0)),),
        forces=(bearing,),
        ground={"c": (0, 0, 0)},
        gravity=(-9.81, 0, 0),
    )
    notes = [note for note in fd.linearise(scene).notes if "next moment only" in note]
    assert len(notes) == 1
    assert about in notes[0]
