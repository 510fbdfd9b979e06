"""Eigenvalues of second-order systems with motions that nothing holds."""

from __future__ import annotations

import numpy as np
import pytest

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


def test_a_damper_hides_no_slow_vibration():
    """Of 1 rad/s beside a damper of 1e8 1/s, and a slow decay by one."""
    found = eigen(np.diag([1.0, 1e10, 4.0]), np.diag([0.0, 1e8, 1e8]))
    assert found.free == 0
    np.testing.assert_allclose(found.values[1:4], [-1j, 1j, -1e10 / 1e8], rtol=1e-5)
    assert -6e-8 < found.values[0].real < -2e-8


def test_small_entries_that_are_right_to_their_own_size_stay_so():
    K = np.diag([0.25, 9.0, 1e16]) + 1e-3 * (1 - np.eye(3)) * np.array([[0, 0, 1], [0, 0, 1], [1, 1, 0]])
    rounding = 1e-13 * np.diag(K)
    found = eigen(K, np.zeros((3, 3)), rounding)
    assert found.free == 0
    np.testing.assert_allclose(np.abs(found.values), [0.5, 0.5, 3, 3, 1e8, 1e8], rtol=1e-9)
    assert eigen(K, np.zeros((3, 3))).free == 4  # not known to be right, they may be rounding


def test_a_free_motion_beside_a_damper_has_its_second_zero():
    found = eigen(np.diag([0.0, 1e6]), np.diag([0.0, 1e9]))
    assert found.free == 2
    np.testing.assert_allclose(found.values[2:].real, [-1e-3, -1e9], rtol=1e-3)


def test_a_free_motion_that_is_known_stays_free_where_stiffness_is_not_symmetric():
    """As of a rotor in damped bearings with an unbalance, K y = 0 and y^T K = r: the symmetric part of K has no zero, and its
    rounding makes a slow vibration of it. Of the quotient, s + c = r^T k^-1 b, it decays."""
    k, r, b = np.array([2e4, 2.2e4, 1e10]), np.array([0.02, -0.03, 0.04]), np.array([1.0, 3.0, 2.0])
    K, C = np.diag([0.0, *k]), np.zeros((4, 4))
    K[0, 1:], C[1:, 0], C[0, 1:], C[0, 0] = r, b, -b, 1e-3
    turn = np.linalg.qr(RNG.normal(size=(4, 4)))[0]
    found = eigen(turn @ K @ turn.T, turn @ C @ turn.T, loose=turn[:, :1])
    assert found.free == 1
    np.testing.assert_allclose(found.values[0], 0.0)
    np.testing.assert_allclose(found.values[1], -(1e-3 - (r / k) @ b), rtol=1e-3)
    for shape in found.vectors[:, :2].T:
        assert abs(turn[:, 0] @ shape) == pytest.approx(np.linalg.norm(shape), rel=1e-3)
