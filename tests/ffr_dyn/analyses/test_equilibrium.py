"""Newton's method for equilibria: few steps for any load and any number of parts, and downhill from far away."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from boxes import STEEL
from test_motion import cases
from test_parts import beam, clamped

from ffr_dyn.analyses.equilibria.equilibrium import Equilibrium, equilibrium
from ffr_dyn.analyses.linearise import linearise
from ffr_dyn.analyses.states import held
from ffr_dyn.analyses.static import static
from ffr_dyn.consistency.assemble import assemble, in_space
from ffr_dyn.consistency.evaluation import evaluator
from ffr_dyn.consistency.mobility import counted
from ffr_dyn.consistency.tangent import chart, derivative, rates, sizes, state, state_matrix
from ffr_dyn.scene.forces import Load
from ffr_dyn.scene.scene import Scene

TIME = 0.37


def load_of(load: float) -> np.ndarray:
    """(3,) [N] across a beam, askew to its section and a little along it; one is EI over the square of the length."""
    return load * STEEL.E * 0.02 * 0.01**3 / 12 * np.array([0.1, 1.0, 0.5])


def bent(count: int | None, load: float) -> Scene:
    """A cantilever of length one with a force at its tip."""
    return clamped(beam(count, 6, stiffening=True), loads=(Load("push", "beam.tip", force=load_of(load)),))


def found(scene: Scene) -> Equilibrium:
    assembled = assemble(in_space(scene))
    return equilibrium(assembled.system, 0.0, assembled.x, sizes(evaluator(assembled.system)))


@pytest.mark.parametrize("count", [None, 2, 4, 8])
def test_newton_is_quadratic_in_one_load_step(count):
    """A tip deflected by a third of the length."""
    there = found(bent(count, 1.2))
    assert there.found
    assert len(there.steps) <= 6
    for before, after in zip(there.steps[1:], there.steps[2:], strict=False):
        assert after < max(2 * before**2, 1e-12)
    K = there.balance.stiffness
    np.testing.assert_allclose(K, K.T, rtol=0, atol=1e-9 * np.abs(K).max())


@pytest.mark.slow
def test_forces_and_rows_are_met_to_rounding():
    there = found(bent(4, 1.2))
    reactions = np.linalg.lstsq(there.balance.jacobian.T, there.balance.forces, rcond=None)[0]
    left = there.balance.forces - reactions @ there.balance.jacobian
    assert np.abs(left).max() < 1e-9 * np.abs(there.balance.forces).max()
    assert np.abs(there.balance.Phi).max() < 1e-13


@pytest.mark.parametrize(("count", "load"), [(None, 60.0), (2, -60.0), (2, 200.0), (4, 20.0)])
def test_far_too_much_is_borne_bit_by_bit(count, load):
    """A tip that stands almost along the force, whatever its sign, and balances to rounding."""
    result = static(bent(count, load))
    tip = result["beam.tip.position"][0]
    assert result.attributes["stable"]
    assert tip[1] * np.sign(load) > 0.6
    force = np.linalg.norm(result["clamp.force"][0])
    np.testing.assert_allclose(result["clamp.force"][0] + load_of(load), 0, atol=1e-7 * force)


@pytest.mark.parametrize("name", ["revolute", "screw", "driven angle", "bushing", "friction", "python actuator",
                                  "pressure", "loads", "shaken base", "without I5"])  # fmt: skip
def test_a_scene_at_rest_is_linearised_exactly(name):
    """Out of balance: it begins to move with any acceleration. In the coordinates of the differences."""
    assembled = assemble(held(in_space(cases()[name]), TIME), time=TIME)
    near = chart(evaluator(assembled.system), TIME, assembled.x, 0 * assembled.v)
    exact, error = state_matrix(near)
    d = near.steps.size
    differences, _ = derivative(lambda y: rates(near, *state(near, y[:d], y[d:])), np.tile(near.steps, 2))
    assert error == 0.0
    for block in (slice(0, d), slice(d, None)):
        given = differences[d:, block]
        np.testing.assert_allclose(exact[d:, block], given, rtol=0, atol=1e-6 * np.abs(given).max())
    np.testing.assert_allclose(exact[:d], differences[:d], rtol=0, atol=1e-10)


def test_a_moving_scene_is_linearised_by_differences():
    scene = cases()["no joint"]
    still, turning = (
        replace(scene, bodies=tuple(replace(body, omega_bar=(0.0, 0.0, speed)) for body in scene.bodies))
        for speed in (0.0, 1.0)
    )
    assert linearise(still).error == 0.0
    assert 0.0 < linearise(turning).error < 1e-6


@pytest.mark.parametrize(
    ("counts", "words"),
    [
        ((104, 3, 101, 2), "3 rigid degrees of freedom, 2 redundant rows; 101 elastic coordinates"),
        ((1, 1, 0, 1), "1 rigid degree of freedom, 1 redundant row"),
        ((0, 0, 0, 0), "0 rigid degrees of freedom"),
        (
            (10, 1, 12, 0),
            "1 rigid degree of freedom; 12 elastic coordinates, which joints and drivers deform in 3 ways",
        ),
        ((6, 0, 8, 0), "0 rigid degrees of freedom; 8 elastic coordinates, which joints and drivers deform in 2 ways"),
    ],
)
def test_mobility_in_words(counts, words):
    assert counted(*counts) == words
