"""Eigenvalues of second-order systems with motions that nothing holds."""

from __future__ import annotations

import numpy as np

from ffr_dyn.linear.eigen import eigen

RNG = np.random.default_rng(3)
Q = np.linalg.qr(RNG.normal(size=(5, 5)))[0]
STIFF = Q @ np.diag([0.0, 1.0, 4.0, 1e4, 1e12]) @ Q.T
SKEW = RNG.normal(size=(5, 5)) - 0.5
GYROSCOPIC = SKEW - SKEW.T


def test_a_free_motion_is_zero_twice_and_the_rest_is_a_vibration():
    """Also where gyroscopic terms couple it: rounding of the stiffness, 1e-4, would make growth of it."""
    found = eigen(STIFF, GYROSCOPIC)
    assert found.free == 2
    np.testing.assert_array_equal(found.values[:2], 0.0)
    assert np.abs(found.values[2:].real).max() < 1e-9
    still = Q[:, 0]
    np.testing.assert_allclose(np.abs(still @ found.vectors[:, :2]), 1.0, atol=1e-8)


def test_vectors_solve_the_equation():
    K, C = np.diag([1.0, 4.0, 9.0]), np.diag([0.1, 0.2, 0.3]) + 0.2 * GYROSCOPIC[:3, :3]
    found = eigen(K, C)
    for value, y in zip(found.values, found.vectors.T, strict=True):
        np.testing.assert_allclose((value**2 * np.eye(3) + value * C + K) @ y, 0.0, atol=1e-12)


def test_a_damped_free_motion_has_one_zero():
    found = eigen(np.zeros((1, 1)), np.array([[3.0]]))
    assert found.free == 1
    np.testing.assert_allclose(found.values, [0.0, -3.0], atol=1e-14)


def test_nothing_at_all_is_free():
    assert eigen(np.zeros((2, 2)), np.zeros((2, 2))).free == 4
