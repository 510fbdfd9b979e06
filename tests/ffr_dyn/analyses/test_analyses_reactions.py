"""Reactions of every kind of joint and coupling against balances of free bodies, rigid and flexible.

The bodies are mass points, so that their momenta are short sums over recorded positions and velocities; differentiated
numerically they give the force and the moment that a body's motion and weight ask for.
"""

from __future__ import annotations

import numpy as np
import pytest
from synthetic import cloud

from ffr_dyn.analyses.integration import integrate
from ffr_dyn.functions.rotation import rotation_matrix
from ffr_dyn.integrators import RK4
from ffr_dyn.integrators.stabilisation import Projection
from ffr_dyn.scene.couplings import Coupling
from ffr_dyn.scene.joints import KINDS, Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import truncated

H = 1e-4  # between rows
TOLERANCE = {0: 1e-10, 2: 2e-7}  # of the largest component: rounding, and differencing at 64 Hz
G = np.array([0.3, -9.81, 0.5])
BALANCE = np.array([1, -8, 0, 8, -1]) / (12 * H)
FORMS = pytest.mark.parametrize("n", [0, 2], ids=["rigid", "flexible"])


def points(n: int, seed: int):
    """A body with n of its two modes."""
    return truncated(cloud(2, seed=seed, stiffness=200.0), n)


def momenta(body: Body, result, row: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Momentum, angular momentum about the global origin, and moment of the mass (3,) each, from the mass points."""
    name, surface = body.name, body.model.surface
    q, q_dot = (result[f"{name}.q"][row], result[f"{name}.q_dot"][row]) if body.model.n else (np.zeros(0), np.zeros(0))
    A, omega = rotation_matrix(result[f"{name}.p"][row]), result[f"{name}.omega_bar"][row]
    m = np.array(body.model.provenance["masses"])[:, None]
    at = surface.points + surface.Phi @ q
    r = result[f"{name}.R"][row] + at @ A.T
    v = result[f"{name}.v"][row] + (np.cross(omega, at) + surface.Phi @ q_dot) @ A.T
    return (m * v).sum(0), np.cross(r, m * v).sum(0), (m * r).sum(0)


def asked_for(scene: Scene, number: int, result, row: int = 2) -> np.ndarray:
    """(6,) force and moment about the global origin that joints have to give a body."""
    body = scene.bodies[number]
    P, L, mr = (np.array(part) for part in zip(*(momenta(body, result, k) for k in range(5)), strict=True))
    return np.concatenate([BALANCE @ P - body.model.mass * G, BALANCE @ L - np.cross(mr[row], G)])


def given(result, name: str, at: np.ndarray, row: int = 2) -> np.ndarray:
    """(6,) what a joint gives its second body at the place `at`, about the global origin."""
    force = result[f"{name}.force"][row]
    return np.concatenate([force, result[f"{name}.moment"][row] + np.cross(at, force)])


def run(scene: Scene):
    return integrate(scene, end=4 * H, output_step=H, method=RK4(H / 4), stabilisation=Projection(1e-13))


MORE = {
    "universal": {"axis": (1, 0, 0), "axis_j": (0, 1, 0)},
    "perpendicular": {"axis": (1, 0, 0), "axis_j": (0, 1, 0)},
    "distance": {"length": 0.5},
    "screw": {"pitch": 0.3},
}


def pair(kind: str, n: int) -> Scene:
    """A moving body on the ground, and a second one on it by a joint of the kind."""
    one, two = points(n, 1), points(n, 2)
    shift = one.interface("b").position - two.interface("a").position
    if kind == "distance":
        shift = shift + np.array([0, 0.5, 0])
    return Scene(
        (Body("one", one, omega_bar=(0.2, -0.1, 0.9)), Body("two", two, position=shift, omega_bar=(0.5, 0.2, -0.3))),
        (
            Joint("ball", "spherical", "ground.O", "one.a"),
            Joint("joint", kind, "one.b", "two.a", **MORE.get(kind, {"axis": (0.2, 0.5, 1.0)})),
        ),
        ground={"O": tuple(one.interface("a").position)},
        gravity=tuple(G),
    )


@FORMS
@pytest.mark.parametrize("kind", KINDS)
def test_a_joint_gives_both_bodies_what_their_motion_asks_for(kind, n):
    scene = pair(kind, n)
    result = run(scene)
    at = {name: result[f"{name}.position"][2] for name in ("one.a", "two.a")}
    wrench = given(result, "joint", at["two.a"])
    second, first = asked_for(scene, 1, result), asked_for(scene, 0, result)
    np.testing.assert_allclose(wrench, second, atol=TOLERANCE[n] * np.abs(second).max())
    np.testing.assert_allclose(
        given(result, "ball", at["one.a"]) - wrench, first, atol=TOLERANCE[n] * np.abs(first).max()
    )
    assert np.abs(wrench).max() > 0.01


# ---- couplings ---------------------------------------------------------------------------------------------------------


def coupled(first: str, second: str, n: int) -> Scene:
    """Two bodies on cylindrical joints of their own to the ground, with a relation between their coordinates."""
    one, two = points(n, 1), points(n, 2)
    axes = {"axis": (0.2, 0.5, 1.0)}
    return Scene(
        (Body("one", one), Body("two", two, position=(0, 2, 0))),
        (
            Joint("left", "cylindrical", "ground.O", "one.a", **axes),
            Joint("right", "cylindrical", "ground.P", "two.a", axis=(1.0, 0.3, -0.2)),
        ),
        couplings=(Coupling("gear", f"left.{first}", f"right.{second}", -0.7),),
        ground={"O": tuple(one.interface("a").position), "P": tuple(two.interface("a").position + np.array([0, 2, 0]))},
        gravity=tuple(G),
    )


@FORMS
@pytest.mark.parametrize(("first", "second"), [("angle", "angle"), ("angle", "stroke"), ("stroke", "stroke")])
def test_a_coupling_adds_its_multiplier_along_both_coordinates(first, second, n):
    """What joints leave open of a balance is the coupling's multiplier along the coordinates, -ratio times on the first."""
    scene = coupled(first, second, n)
    result = run(scene)
    multiplier = result["gear.effort"][2]
    bodies = ((0, "left", "one.a", first, 0.7 * multiplier), (1, "right", "two.a", second, multiplier))
    for number, joint, marker, coordinate, effort in bodies:
        at, axis = result[f"{marker}.position"][2], np.array(scene.joints[number].axis)
        along = effort * axis / np.linalg.norm(axis)
        moment = along if coordinate == "angle" else np.cross(at, along)
        own = np.concatenate([np.zeros(3) if coordinate == "angle" else along, moment])
        asked = asked_for(scene, number, result)
        np.testing.assert_allclose(given(result, joint, at) + own, asked, atol=TOLERANCE[n] * np.abs(asked).max())
        assert np.abs(own).max() > 0.01
