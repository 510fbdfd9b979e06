"""Forces and constraints at rest, and their tangent, against differences of the compiled residual."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_dyn_forces import PAIRS, loaded
from test_dyn_kernels import chain, random_state
from test_motion import FRAMES, LOADS, T, cases, stiffened

from ffr_dyn.compile.scene_tables import compile_scene
from ffr_dyn.consistency.evaluation import Evaluator, evaluate, evaluator
from ffr_dyn.equations.layout import moved
from ffr_dyn.equations.statics import Balance, balance, damping
from ffr_dyn.functions.rotation import rotation_matrix, tangent
from ffr_dyn.scene.forces import Load
from ffr_dyn.scene.scene import Scene

STEP = 1e-5
SCENES = cases()
RIGID = {f"rigid {kind}": chain(0, 0, kind=kind, **FRAMES) for kind in ("revolute", "screw", "distance")}
RIGID |= {f"rigid {name}": loaded(PAIRS[name], (0, 0)) for name in ("spring", "bushing", "guided spring")}
# What has no potential: forces of a user's function, moments of fixed axes, forces that turn with a body.
POTENTIAL = [name for name in SCENES if name not in ("python actuator", "loads") and "pressure" not in name]
POTENTIAL = [name for name in POTENTIAL if name != "nodal follower"]


def second_order(scene: Scene) -> Scene:
    return replace(scene, bodies=tuple(replace(body, model=stiffened(body.model)) for body in scene.bodies))


def at_random(scene: Scene, seed: int = 3) -> tuple[Evaluator, np.ndarray, np.ndarray, Balance]:
    """A compiled scene, positions off its joints, multipliers, and the balance there."""
    at = evaluator(compile_scene(scene))
    place, (x, _) = at.system.layout, random_state(scene, seed)
    lam = 5 * np.random.default_rng(seed).normal(size=at.system.model.rows.kind.size)
    return at, x, lam, balance(scene, place, at.system.blocks, T, x, lam, {})


def residual(at: Evaluator, x: np.ndarray, lam: np.ndarray, y: np.ndarray) -> np.ndarray:
    """(V,) compiled forces at x moved by y, as work by changes of y: turns and their changes add up by the tangent."""
    place, there = at.system.layout, moved(at.system.layout, x, y)
    now = evaluate(at, T, there, np.zeros(place.v_size))
    found = now.force - now.jacobian.T @ lam
    for b in range(len(place.n)):
        shift, turn = place.R_dot(b), place.omega(b)
        found[shift] = rotation_matrix(x[place.p(b)]).T @ rotation_matrix(there[place.p(b)]) @ found[shift]
        found[turn] = tangent(-y[turn]).T @ found[turn]
    return found


def assert_exact(scene: Scene) -> None:
    at, x, lam, found = at_random(scene)
    place = at.system.layout
    now = evaluate(at, T, x, np.zeros(place.v_size))
    for given, exact in ((found.forces, now.force), (found.Phi, now.Phi), (found.jacobian, now.jacobian)):
        np.testing.assert_allclose(given, exact, rtol=0, atol=1e-11 * np.abs(exact).max(initial=1.0))
    sides = [[residual(at, x, lam, sign * STEP * one) for sign in (1, -1)] for one in np.eye(place.v_size)]
    K = -np.array([(ahead - behind) / (2 * STEP) for ahead, behind in sides]).T
    elastic = np.zeros_like(K)
    for b, body in enumerate(scene.bodies):
        elastic[place.q_dot(b), place.q_dot(b)] = np.diag(body.model.omega2)
    rest = K - elastic
    np.testing.assert_allclose(found.stiffness - elastic, rest, rtol=0, atol=1e-6 * np.abs(rest).max(initial=1e-3))


@pytest.mark.parametrize("scene", [*SCENES.values(), *RIGID.values()], ids=[*SCENES, *RIGID])
def test_the_tangent_is_that_of_the_compiled_forces(scene):
    assert_exact(scene)


@pytest.mark.parametrize("name", SCENES)
def test_the_tangent_of_second_order_bodies_is_too(name):
    if not name.startswith("without"):
        assert_exact(second_order(SCENES[name]))


@pytest.mark.parametrize("name", POTENTIAL)
def test_what_has_a_potential_has_a_symmetric_tangent(name):
    """Off the joints and out of balance."""
    for scene in (SCENES[name], second_order(SCENES[name])):
        K = at_random(scene)[-1].stiffness
        np.testing.assert_allclose(K, K.T, rtol=0, atol=1e-9 * np.abs(K).max())


def test_a_force_of_fixed_direction_has_a_potential_and_a_moment_has_none():
    push, turn = (
        replace(chain(), loads=(Load("l", "one.b", *load),)) for load in (((1, 2, 3),), ((0, 0, 0), (1, 2, 3)))
    )
    K, other = (at_random(second_order(scene))[-1].stiffness for scene in (push, turn))
    np.testing.assert_allclose(K, K.T, rtol=0, atol=1e-12 * np.abs(K).max())
    assert np.abs(other - other.T).max() > 0.1


@pytest.mark.parametrize("name", [*PAIRS, "loads"])
def test_damping_is_that_of_the_compiled_forces(name):
    loads = (*LOADS, Load("dashpot", "one.b", function=lambda t, state: -3.0 * state.velocity("two.a")))
    scene = replace(chain(), loads=loads) if name == "loads" else loaded(PAIRS[name])
    scene = replace(scene, bodies=tuple(replace(body, damping=0.03) for body in scene.bodies))
    at, x, _, _ = at_random(scene)
    place = at.system.layout

    def force(y: np.ndarray) -> np.ndarray:
        v = y.copy()
        for b in range(len(place.n)):
            v[place.R_dot(b)] = rotation_matrix(x[place.p(b)]) @ y[place.R_dot(b)]
        return evaluate(at, T, x, v).force

    D = -np.array([(force(STEP * one) - force(-STEP * one)) / (2 * STEP) for one in np.eye(place.v_size)]).T
    found = damping(scene, place, T, x)
    np.testing.assert_allclose(found, D, rtol=0, atol=1e-6 * np.abs(D).max())
