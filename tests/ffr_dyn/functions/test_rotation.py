"""Rotation vectors: the exponential map, its tangent and the rate of that."""

from __future__ import annotations

import numpy as np
import pytest
from differences import difference

from ffr_dyn.functions.rotation import from_vector, rotation_matrix, skew, tangent, tangent_rate

ANGLES = [0.0, 1e-12, 1e-6, 1e-3, 0.1, 0.999999, 1.000001, 2.0, 3.0, 6.0]
AXIS, RATE = np.array([0.36, -0.48, 0.8]), np.array([0.7, 0.2, -0.5])


def exponential(theta: np.ndarray) -> np.ndarray:
    return rotation_matrix(from_vector(theta))


@pytest.mark.parametrize("angle", ANGLES)
def test_the_exponential_is_the_series_and_orthonormal(angle):
    R, term, total = exponential(angle * AXIS), np.eye(3), np.eye(3)
    for k in range(1, 60):
        term = term @ skew(angle * AXIS) / k
        total = total + term
    np.testing.assert_allclose(R, total, rtol=0, atol=1e-13)
    np.testing.assert_allclose(R @ R.T, np.eye(3), rtol=0, atol=1e-15)


@pytest.mark.parametrize("angle", ANGLES)
def test_the_tangent_gives_the_rate_of_the_rotation(angle):
    theta = angle * AXIS
    found = skew(tangent(theta) @ RATE) @ exponential(theta)
    np.testing.assert_allclose(found, difference(lambda s: exponential(theta + s * RATE)), rtol=0, atol=1e-12)


@pytest.mark.parametrize("angle", ANGLES)
def test_the_rate_of_the_tangent(angle):
    theta = angle * AXIS
    expected = difference(lambda s: tangent(theta + s * RATE)) @ RATE
    np.testing.assert_allclose(tangent_rate(theta, RATE), expected, rtol=0, atol=1e-12)


def test_the_tangent_leaves_the_vector_alone_and_turns_as_the_rotation_does():
    """T theta = theta; R^T T is T of -theta."""
    theta = 1.3 * AXIS
    np.testing.assert_allclose(tangent(theta) @ theta, theta, rtol=1e-15)
    np.testing.assert_allclose(exponential(theta).T @ tangent(theta), tangent(-theta), rtol=0, atol=1e-15)
