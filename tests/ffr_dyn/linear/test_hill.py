"""Rotors in bearings that are not the same all around: against equations in axes at rest, and against Floquet's theory."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import ffr_dyn as fd
from ffr_dyn.analyses.rotating.steady import steady_states
from ffr_dyn.linear.hill import Varying, hill, one_of_each
from ffr_dyn.linear.matrices import CUT

MASS, ACROSS, ALONG, ENDS = 10.0, 0.5, 0.9, (-0.2, 0.3)  # kg, kg m^2, m
STIFF, AXIAL = (1e6, 1.5e6), 1e6  # N/m


def rotor(speed: float, damping: float = 0.0, across: tuple[float, float] = (ACROSS, ACROSS)) -> fd.Scene:
    """Rigid, in two bearings of different stiffness along x and y, a third spring along its axis."""
    points = dict(zip(("left", "right"), ((0.0, 0.0, z) for z in ENDS), strict=True))
    disc = fd.rigid_body("disc", mass=MASS, inertia=(*across, ALONG), points=points)
    bearings = [
        fd.Bushing(
            side, f"ground.{side}", f"disc.{side}", np.diag([*STIFF, axial, 0, 0, 0]), np.diag([damping] * 2 + 4 * [0])
        )
        for side, axial in (("left", AXIAL), ("right", 0.0))
    ]
    return fd.Scene((fd.Body("disc", disc, omega_bar=(0, 0, speed)),), forces=tuple(bearings), ground=points)


def at_rest(speed: float, damping: float) -> np.ndarray:
    """Eigenvalues (4,) of x, y of the centre and small turnings about x and y, in axes that do not turn."""
    M, C, K = np.diag([MASS, MASS, ACROSS, ACROSS]), np.zeros((4, 4)), np.zeros((4, 4))
    C[2, 3], C[3, 2] = ALONG * speed, -ALONG * speed
    for z in ENDS:
        B = np.array([[1, 0, 0, z], [0, 1, -z, 0]])
        K += B.T @ np.diag(STIFF) @ B
        C += damping * B.T @ B
    A = np.block([[np.zeros((4, 4)), np.eye(4)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    values = np.linalg.eigvals(A)
    values = values[values.imag > 0]
    return values[np.argsort(values.imag)]


@pytest.mark.parametrize("speed", [200.0, 600.0])
def test_a_rotor_in_unlike_bearings_whirls_as_in_axes_at_rest(speed):
    found = fd.linearise(rotor(speed, damping=300.0))
    moving = (found.eigenvalues.imag > 0) & ~np.isnan(found.whirl)
    order = np.argsort(np.abs(found.seen[moving]))
    exact = at_rest(speed, 300.0)
    np.testing.assert_allclose(2 * np.pi * np.abs(found.seen[moving][order]), exact.imag, rtol=1e-9)
    np.testing.assert_allclose(found.eigenvalues.real[moving][order], exact.real, rtol=1e-7)
    np.testing.assert_allclose(found.whirl[moving], 1.0, atol=1e-6)  # one frequency each, from the ground
    assert "The modes take account of the change" in found.notes[-1]


def test_along_the_axis_nothing_is_added_to_a_frequency():
    found = fd.linearise(rotor(200.0))
    (axial,) = found.seen[(found.eigenvalues.imag > 0) & np.isnan(found.whirl)]
    assert axial == pytest.approx(np.sqrt(AXIAL / MASS) / (2 * np.pi), rel=1e-9)


@pytest.mark.parametrize(("off", "told"), [(1e-8, 0), (1e-5, 1)])
def test_the_weight_of_a_rotor_with_a_little_unbalance_does_not_keep_it_from_resting(off, told):
    """Each bearing carries its share of the weight by the lever, and gives by that over its stiffness."""
    points = dict(zip(("left", "right"), ((0.0, 0.0, z) for z in ENDS), strict=True))
    of = {"mass": MASS, "inertia": (ACROSS, ACROSS, ALONG), "centre_of_mass": (off, 0, 0), "points": points}
    disc = fd.rigid_body("disc", **of)
    scene = rotor(1.0)
    scene = replace(scene, bodies=(replace(scene.bodies[0], model=disc),), gravity=(0, -9.81, 0))
    found = fd.steady(scene, speeds=(0.0, 100.0), outputs=("disc.left.position",))
    share = ENDS[1] / (ENDS[1] - ENDS[0])
    assert found["disc.left.position"][0, 1] == pytest.approx(-MASS * 9.81 * share / STIFF[1], rel=1e-3)
    assert sum("it is held there" in note for note in found.attributes["notes"]) == told
    assert found["disc.left.position"][1, 1] == pytest.approx(0.0, abs=10 * off)


@pytest.mark.slow
def test_critical_speeds_in_unlike_bearings():
    """Where the speed is one of the eigenvalues in axes at rest; followed through rest, where the axes coincide."""
    found = fd.campbell(rotor(1.0), speeds=np.linspace(0.0, 700.0, 15))
    critical = [one["speed"] for one in found.attributes["critical"] if one["axes"] == "ground"]
    assert len(critical) == 3  # what turns faster than its inertia lets it whirl has none
    for speed in critical:
        assert np.abs(at_rest(speed, 0.0).imag - speed).min() < 1e-5 * speed
    assert (np.abs(np.diff(np.abs(found["seen"]), axis=0)) < 20).all()


def test_a_vibration_half_as_fast_as_the_bearings_change_is_not_lost_beside_real_eigenvalues():
    """One of each pair is told, at whichever numbering its halves are."""
    slow = [2e-4, -2e-4]
    for turns, other in ((1, 1), (2, 2), (2, -2)):
        values = np.array([-4.5 + 1j * turns, -4.5 + 1j * other, *slow, -3 + 0.7j, -3 - 0.7j])
        assert sorted(values[one_of_each(values, 2.0)].real) == [-4.5, -3, 2e-4]
    apart = np.array([1e-3 + 1j, -1e-3 + 3j, *slow])  # a real multiplier and its inverse, in two numberings
    assert sorted(apart[one_of_each(apart, 2.0)].real) == [2e-4, 1e-3]


@pytest.mark.slow
def test_a_rotor_unlike_itself_in_unlike_bearings_has_floquets_exponents():
    """Of the compiled loop, over a turn."""
    speed = 300.0
    scene = rotor(speed, damping=200.0, across=(0.4, 0.6))
    values = fd.linearise(scene).eigenvalues
    period = 2 * np.pi / speed
    turn = fd.periodic(scene, period=period, method=fd.RK4(period / 2000), floquet=True)
    exponents = np.array(turn.attributes["exponents"]) @ np.array([1, 1j])
    apart = (values[:, None] - exponents) / (1j * speed)
    assert np.abs(speed * (apart - np.round(apart.real))).min(axis=1).max() < 1e-6


def test_where_hills_determinant_is_unstable_mathieus_equation_is():
    """y'' + (a + 2 b cos t) y = 0 at a = 1/4 grows by b, nearly."""
    b = 1e-3
    found = hill(Varying(np.array([[[0.25]], [[b]]], complex), np.zeros((2, 1, 1), complex), 1.0))
    assert found.values.size == 2
    assert found.values.real.max() == pytest.approx(b, rel=1e-4)
    assert np.abs(found.values.imag) == pytest.approx([0.5, 0.5])


def test_what_grows_and_stands_still_in_the_turning_axes_has_real_eigenvalues():
    """Of a disc on a flat shaft, with a little that varies: by that `campbell` knows the range in which it is unstable."""
    k, other = np.array([1e4, 1.21e4]), np.array([[3.0, 1.0], [1.0, 2.0]])
    for speed in (102.0, 105.0, 108.0):
        C = np.array([[[0, -2 * speed], [2 * speed, 0]], np.zeros((2, 2))], complex)
        found = hill(Varying(np.array([np.diag(k - speed**2), (1 + 0.3j) * other]), C, speed))
        (grown,) = np.flatnonzero(found.values.real > 1)
        square = speed**2 + k.mean() - np.sqrt(4 * speed**2 * k.mean() + (np.diff(k)[0] / 2) ** 2)
        assert found.values[grown].real == pytest.approx(np.sqrt(-square), rel=1e-3)
        assert found.values[grown].imag == 0


@pytest.mark.parametrize("slow", [0.3, 0.05, 0.02])
def test_what_changes_slowly_takes_many_harmonics(slow):
    """y'' + (1 + 0.4 cos(w t)) y = 0, by its map over a turn."""

    def rates(t, y):
        return [y[1], -(1 + 0.4 * np.cos(slow * t)) * y[0]]

    turn = 2 * np.pi / slow
    ends = [solve_ivp(rates, (0, turn), y, method="DOP853", rtol=1e-9, atol=1e-11).y[:, -1] for y in np.eye(2)]
    exponents = np.log(np.linalg.eigvals(np.array(ends)).astype(complex)) / turn
    found = hill(Varying(np.array([[[1.0]], [[0.2]]], complex), np.zeros((2, 1, 1), complex), slow))
    apart = (found.values[:, None] - exponents) / (1j * slow)
    assert np.abs(slow * (apart - np.round(apart.real))).min(axis=1).max() < 1e-6
    assert found.left < 1e-6


def test_modes_that_take_more_harmonics_than_there_is_room_for_are_told(monkeypatch):
    monkeypatch.setattr("ffr_dyn.linear.hill.HARMONICS", (1, 2, 3))
    for speed, told in ((20.0, 1), (300.0, 0)):
        notes = fd.linearise(rotor(speed, across=(0.4, 0.6))).notes
        assert sum(CUT.partition(":")[0] in note for note in notes) == told


@pytest.mark.slow
def test_a_campbell_diagram_tells_them_once(monkeypatch):
    monkeypatch.setattr("ffr_dyn.linear.hill.HARMONICS", (1, 2, 3))
    found = fd.campbell(rotor(20.0, across=(0.3, 0.7)), speeds=(20.0, 25.0))
    assert sum(CUT.partition(":")[0] in note for note in found.attributes["notes"]) == 1


def test_the_damping_of_a_whirl_is_that_at_the_frequency_seen_from_the_ground():
    """As in axes at rest; what varies is told once for all speeds."""
    found = fd.campbell(rotor(1.0, damping=300.0), speeds=(200.0, 250.0))
    ratios = [-value.real / abs(value) for value in at_rest(200.0, 300.0)]
    whirling = np.array(found.attributes["whirling"], bool)
    np.testing.assert_allclose(np.sort(found["damping_ratios"][0, whirling]), np.sort(ratios), rtol=1e-6)
    assert sum("mean over a turn" in note for note in found.attributes["notes"]) == 1


@pytest.mark.parametrize("speed", [100.2, 110.2, 119.9])
def test_a_free_rotor_under_weight_is_as_one_that_is_driven_evenly_beside_a_vibration_that_stands_still(speed):
    """Frequencies sqrt(k / m) either way of a disc drawn where its weight has not bent its bearings yet. About the mean of a
    turn the weight turned it by the way that the unbalance bends it: beside 100 and 120 rad/s, and between them, where that
    mean has its own critical speed, the disc was told to grow by 0.16 1/s, and its frequencies were up to 2e-3 off."""
    disc = fd.rigid_body(
        "disc",
        mass=1.0,
        inertia=[1e-3, 8e-4, 8e-4],
        centre_of_mass=(0, 1e-5, 0),
        points={"l": (-0.1, 0, 0), "r": (0.1, 0, 0)},
    )
    bearings = tuple(
        fd.Bushing(end, f"ground.{end}", f"disc.{end}", stiffness=(1e5, 0.5e4, 0.72e4, 0, 0, 0)) for end in "lr"
    )
    scene = fd.Scene(
        (fd.Body("disc", disc, omega_bar=(speed, 0, 0)),),
        forces=bearings,
        ground={"l": (-0.1, 0, 0), "r": (0.1, 0, 0)},
        gravity=(0, -9.81, 0),
    )
    found = fd.linearise(fd.scene_at(scene, fd.steady(scene)))
    assert np.abs(found.eigenvalues.real).max() < 1e-9
    seen = np.abs(found.seen) * 2 * np.pi
    for exact in (100.0, 120.0):
        assert np.abs(seen - exact).min() < 1e-6 * exact


def coupled(A: np.ndarray) -> fd.Scene:
    """A rotor in unlike bearings that a damped coupling turns, under its weight, with its axis along A z."""
    points, spin = {"l": A @ [0, 0, -0.2], "r": A @ [0, 0, 0.3]}, tuple(A @ [0, 0, 250.0])

    def block(shifts, turns=(0, 0, 0)):
        return np.block([[A @ np.diag(shifts) @ A.T, np.zeros((3, 3))], [np.zeros((3, 3)), A @ np.diag(turns) @ A.T]])

    inertia = A @ np.diag([0.5, 0.6, ALONG]) @ A.T
    disc = fd.rigid_body("disc", mass=MASS, inertia=inertia, centre_of_mass=A @ [1e-4, 0, 0], points=points)
    motor = fd.rigid_body("motor", mass=1.0, inertia=(1e-3,) * 3, points={"c": (0, 0, 0)})
    forces = [
        fd.Bushing(end, f"ground.{end}", f"disc.{end}", block((1e6, 1.6e6, 5e5)), block((300.0, 400.0, 300.0)))
        for end in points
    ]
    forces.append(
        fd.Bushing("coupling", "motor.c", "disc.l", block((0, 0, 0), (0, 0, 2e4)), block((0, 0, 0), (0, 0, 1.0)))
    )
    return fd.Scene(
        (fd.Body("disc", disc, omega_bar=spin), fd.Body("motor", motor, position=points["l"], omega_bar=spin)),
        (fd.Joint("shaft", "revolute", "ground.l", "motor.c", axis=A @ [0, 0, 1.0]),),
        (fd.Driver("drive", "shaft", fd.polynomial(0.0, 250.0)),),
        forces=tuple(forces),
        ground=points,
        gravity=A @ [0, -9.81, 0],
    )


def test_the_damping_of_ends_that_turn_alike_does_not_vary():
    """Their rate is rounding, by steps of which it was differentiated."""
    ((_, found),) = steady_states(coupled(Rotation.from_rotvec((0.5, -0.9, 0.3)).as_matrix()), ())
    first, third = np.abs(found.about.over_turn[1, [1, 3]]).max(axis=(1, 2))
    assert max(first, third) < 1e-6  # bearings vary by the second harmonic alone


@pytest.mark.slow
@pytest.mark.parametrize("turn", [(0.1, 0.0, 0.0), (0.5, -0.9, 0.3)])
def test_modes_are_those_of_a_machine_however_it_is_placed(turn):
    values = []
    for A in (np.eye(3), Rotation.from_rotvec(turn).as_matrix()):
        scene = coupled(A)
        found = fd.linearise(fd.scene_at(scene, fd.steady(scene)))
        vibrating = found.eigenvalues[found.eigenvalues.imag > 0]
        values.append(vibrating[np.argsort(np.abs(vibrating))])
    np.testing.assert_allclose(values[1], values[0], rtol=1e-7)
    assert values[1][0] == pytest.approx(complex(-0.5 / ALONG, np.sqrt(2e4 / ALONG)), rel=1e-5)


SPEEDS, INNER, OUTER = (200.0, -300.0), (10.0, 0.5, 0.9), (6.0, 0.3, 0.4)  # rad/s; kg, kg m^2 across and along
STIFFNESS, BETWEEN, DAMPING = 1e6, 5e5, 50.0
AT = {"a": (-0.3, None), "b": (0.2, None), "between": (0.1, -0.1), "d": (None, 0.25)}  # of bearings on inner and outer


def coaxial() -> fd.Scene:
    """Two rotors that turn against each other, with a bearing between them, the centre of the outer at z = 0.2."""
    parts = [
        fd.rigid_body(name, mass=m, inertia=(A, A, C), points={n: (0, 0, at[k]) for n, at in AT.items() if at[k]})
        for k, (name, (m, A, C)) in enumerate((("inner", INNER), ("outer", OUTER)))
    ]
    ends = {"a": "inner.a", "b": "inner.b", "between": "outer.between", "d": "outer.d"}
    forces = [
        fd.Bushing(
            name,
            "inner.between" if name == "between" else f"ground.{name}",
            end,
            np.diag(
                [BETWEEN if name == "between" else STIFFNESS] * 2
                + [1e6 if name in ("a", "between") else 0.0]
                + [0.0] * 3
            ),
            np.diag([DAMPING] * 2 + [0.0] * 4),
        )
        for name, end in ends.items()
    ]
    bodies = [
        fd.Body(part.name, part, position=(0, 0, z), omega_bar=(0, 0, speed))
        for part, z, speed in zip(parts, (0.0, 0.2), SPEEDS, strict=True)
    ]
    return fd.Scene(
        tuple(bodies), forces=tuple(forces), ground={"a": (0, 0, -0.3), "b": (0, 0, 0.2), "d": (0, 0, 0.45)}
    )


def coaxial_at_rest() -> np.ndarray:
    """Eigenvalues (16,) in axes that do not turn; the damper between the rotors turns with the inner one."""
    M = np.diag([m for mass, across, _ in (INNER, OUTER) for m in (mass, mass, across, across)])
    C, K, around = np.zeros((8, 8)), np.zeros((8, 8)), np.array([[0.0, -1.0], [1.0, 0.0]])
    for first, along, speed in ((2, INNER[2], SPEEDS[0]), (6, OUTER[2], SPEEDS[1])):
        C[first : first + 2, first : first + 2] = -along * speed * around
    for name, (inner, outer) in AT.items():
        on = [np.zeros((2, 4)) if z is None else np.array([[1, 0, 0, z], [0, 1, -z, 0]]) for z in (inner, outer)]
        B = np.hstack([-on[0] if name == "between" else on[0], on[1]])
        k, turning = (BETWEEN, SPEEDS[0]) if name == "between" else (STIFFNESS, 0.0)
        C += DAMPING * B.T @ B
        K += B.T @ (k * np.eye(2) - DAMPING * turning * around) @ B
    return np.linalg.eigvals(
        np.block([[np.zeros((8, 8)), np.eye(8)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    )


@pytest.mark.slow
def test_rotors_that_turn_against_each_other_have_the_multipliers_of_axes_at_rest():
    period = 2 * np.pi / 100.0
    found = fd.periodic(coaxial(), period=period, floquet=True, check=False)
    values = np.array([complex(*one) for one in found.attributes["multipliers"]])
    for exact in np.exp(coaxial_at_rest() * period):
        assert np.abs(values - exact).min() < 1e-6


def test_modes_of_rotors_at_several_speeds_are_told_to_be_those_of_the_mean():
    ((_, found),) = steady_states(coaxial(), ())
    assert "`periodic` with floquet finds the motion itself and its modes" in found.notes[-1]
