"""Motions that rows leave free, and what pushes them: against their definitions."""

from __future__ import annotations

import numpy as np
import pytest
from test_analyses_kinematic import bar

import ffr_dyn as fd
from ffr_dyn.consistency.evaluation import evaluate, evaluator, free_motions, locked, smallest_motion, total_mass_matrix

RANDOM = np.random.default_rng(5)
MASS = (lambda A: A @ A.T + np.eye(7))(RANDOM.normal(size=(7, 7)))


@pytest.mark.parametrize(("rows", "rank"), [(0, 0), (3, 3), (5, 3), (7, 7), (9, 7), (9, 4)])
def test_free_motions_are_all_that_meet_the_rows(rows, rank):
    """Of unit mass each; dependent rows, and more rows than motions."""
    J = RANDOM.normal(size=(rows, rank)) @ RANDOM.normal(size=(rank, 7)) * 10.0 ** RANDOM.uniform(-3, 3, (rows, 1))
    Z = free_motions(J, MASS)
    assert Z.shape == (7, 7 - rank)
    np.testing.assert_allclose(J @ Z, 0.0, atol=1e-12 * np.abs(J).max(initial=1.0))
    np.testing.assert_allclose(Z.T @ MASS @ Z, np.eye(7 - rank), atol=1e-12)


@pytest.mark.parametrize("plane", ["none", "auto"])
def test_the_smallest_motion_is_at_right_angles_to_the_free_ones(plane):
    """In space, and in the plane, whose motions across it are held."""
    model = bar("link", 0.4)
    bodies = [fd.Body(f"l{k}", model, position=(0.4 * k, 0, 0)) for k in range(3)]
    ends = ["ground.o", "l0.b", "l1.b"]
    joints = [fd.Joint(f"j{k}", "revolute", ends[k], f"l{k}.a") for k in range(3)]
    scene = fd.Scene(bodies, joints, ground={"o": model.interface("a").position}, gravity=(0, -9.81, 0), plane=plane)
    assembled = fd.assemble(scene)
    system, at = assembled.system, evaluator(assembled.system)
    now = evaluate(at, 0.0, assembled.x, assembled.v)
    held = np.zeros(locked(system.layout).size)
    rates = np.append(RANDOM.normal(size=system.model.rows.kind.size), held)
    M = total_mass_matrix(system.scene, system.layout, assembled.x)
    step, Z = smallest_motion(at, now, rates), free_motions(now.jacobian, M)
    np.testing.assert_allclose(now.jacobian @ step, rates, atol=1e-12 * np.abs(rates).max())
    np.testing.assert_allclose(Z.T @ M @ step, 0.0, atol=1e-12 * np.abs(M @ step).max())
