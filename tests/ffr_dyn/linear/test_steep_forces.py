"""Forces that bend within a micrometre or a millionth of a metre per second: stiffness, damping, outputs."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

import ffr_dyn as fd

GROUND = {"O": (0, 0, 0)}


def slider(mass: float, size: float, *forces: object, loads: tuple[object, ...] = ()) -> fd.Scene:
    body = fd.rigid_body("m", mass=mass, inertia=[mass * size**2] * 3, points={"c": (0, 0, 0), "e": (size, 0, 0)})
    rail = fd.Joint("rail", "translational", "ground.O", "m.c", axis=(1, 0, 0))
    return fd.Scene([fd.Body("m", body)], [rail], forces=forces, loads=loads, ground=GROUND)


@pytest.mark.parametrize("kind", ["load", "actuator"])
def test_plates_of_a_gap_of_two_micrometres(kind):
    """An electrostatic force on a plate, at 0.98 of the voltage at which it is pulled in: k - 2 a / (gap - x)^3. Before, it
    was told not to be stable, its stiffness being off by 5.6 times its size."""
    mass, k, gap = 1e-9, 1.0, 2e-6
    a = 0.98**2 * 4 * k * gap**3 / 27

    def pull(t, state):
        return a / (gap - state.position("m.c")[0]) ** 2

    spring = fd.JointSpring("spring", "rail", stiffness=k, coordinate="stroke")
    if kind == "load":
        scene = slider(mass, 1e-4, spring, loads=(fd.Load("pull", "m.c", function=lambda t, s: (pull(t, s), 0, 0)),))
    else:
        scene = slider(mass, 1e-4, spring, fd.Actuator("pull", "rail", function=pull, coordinate="stroke"))
    rest = fd.static(scene)
    x = brentq(lambda x: k * x - a / (gap - x) ** 2, 0, gap / 3, xtol=1e-20, rtol=1e-14)
    assert rest["rail.stroke"][0] == pytest.approx(x, rel=1e-10)
    assert rest.attributes["stable"]
    found = fd.linearise(fd.scene_at(scene, rest))
    np.testing.assert_allclose(np.abs(found.eigenvalues) ** 2, (k - 2 * a / (gap - x) ** 3) / mass, rtol=1e-7)
    assert found.notes == ()


@pytest.mark.parametrize("creep", [1e-3, 1e-5, 1e-7])
def test_friction_of_any_creep(creep):
    """At rest it is a damper of coulomb / creep, in A and in what is measured: m s^2 x + d s x + k x = F."""
    k, d = 50.0, 3.0 / creep
    spring = fd.JointSpring("spring", "rail", stiffness=k, coordinate="stroke")
    friction = fd.JointFriction("friction", "rail", coulomb=3.0, creep=creep, coordinate="stroke")
    outputs = ("rail.stroke", "m.c.acceleration.x", "friction.force")
    f = np.array([1.0, 10.0])
    found = fd.response(slider(2.0, 1.0, spring, friction), input="rail.force", outputs=outputs, frequencies=f)
    s = 2j * np.pi * f
    expected = np.array([np.ones(2), s**2, -d * s]) / (2.0 * s**2 + d * s + k)
    np.testing.assert_allclose(found["transfer"] @ [1, 1j], expected.T, rtol=1e-6)


def test_a_rotor_in_films_of_fifty_micrometres():
    """Forces of films as Python functions, not defined beyond their gap: m z'' + 2 c z' + (2 k - i c w) z = 0 of a rotor that
    does not tilt, and the same with moments of inertia."""
    m, c, w, gap, k, far = 4.0, 2e4, 300.0, 5e-5, 1e6, 0.2

    def film(end):
        def push(t, state):
            r, v = state.position(f"rotor.{end}")[:2], state.velocity(f"rotor.{end}")[:2]
            growth = (1 - float(r @ r) / gap**2) ** -2.5  # a complex number beyond the gap
            return (*(-c * growth * (v - 0.5 * w * np.array([-r[1], r[0]]))), 0.0)

        return fd.Load(f"film_{end}", f"rotor.{end}", function=push)

    ends = {"a": (0, 0, -far), "b": (0, 0, far)}
    rotor = fd.rigid_body("rotor", mass=m, inertia=[0.05, 0.05, 0.01], points={"c": (0, 0, 0), **ends})
    scene = fd.Scene(
        [fd.Body("rotor", rotor, omega_bar=(0, 0, w))],
        [fd.Joint("thrust", "point-on-plane", "ground.O", "rotor.c", axis=(0, 0, 1))],
        loads=[film("a"), film("b")],
        forces=[fd.Bushing(f"bearing_{n}", f"ground.{n}", f"rotor.{n}", [k, k, 0, 0, 0, 0]) for n in ends],
        ground={**GROUND, **ends},
    )
    found = fd.linearise(fd.scene_at(scene, fd.steady(scene)))
    straight = np.roots([m, 2 * c, 2 * k - 1j * c * w])
    tilted = np.roots([0.05, 2 * far**2 * c - 0.01j * w, 2 * far**2 * (k - 0.5j * c * w)])
    expected = np.concatenate([straight, tilted]) - 1j * w
    mine = found.eigenvalues[found.free :]
    mine = np.array([mine[np.argmin(np.abs(mine - one))] for one in expected])
    np.testing.assert_allclose(mine, expected, rtol=1e-8)


def test_gravity_changes_over_an_orbit():
    """At 6.8e6 m from the centre: 2 GM / r^3 upwards, -GM / r^3 across, where rounding of the position is a thousandth of a
    micrometre."""
    GM, r = 3.986e14, 6.8e6

    def pull(t, state):
        position = state.position("m.c")
        return -GM * position / np.linalg.norm(position) ** 3

    body = fd.rigid_body("m", mass=1.0, inertia=[1, 1, 1], points={"c": (0, 0, 0)})
    scene = fd.Scene([fd.Body("m", body, position=(r, 0, 0))], loads=[fd.Load("pull", "m.c", function=pull)])
    found = fd.linearise(scene)
    stiffness = np.sort(np.linalg.eigvals(-found.A[6:, :6]).real) / (GM / r**3)
    np.testing.assert_allclose(stiffness, [-2, 0, 0, 0, 1, 1], atol=1e-5)
