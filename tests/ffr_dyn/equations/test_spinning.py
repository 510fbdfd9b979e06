"""Bodies in steady motion: derivatives of their kinetic energy against differences, and the equations of motion."""

from __future__ import annotations

import numpy as np
from synthetic import cloud

from ffr_dyn.equations.inertia import kept_integrals, mass_matrix, quadratic_velocity
from ffr_dyn.equations.spinning import spinning
from ffr_dyn.functions.rotation import from_vector, rotation_matrix, skew
from ffr_dyn.scene.scene import Body

RNG = np.random.default_rng(5)
INTEGRALS = kept_integrals(Body("cloud", cloud(4)))
Q, V, OMEGA = 0.1 * RNG.normal(size=4), RNG.normal(size=3), RNG.normal(size=3)


def velocities(y, y_dot):
    """[V, omega, q_dot] at the small motion y, first-order in phi of y_dot's own part."""
    back = rotation_matrix(from_vector(y[3:6])).T
    spin = (np.eye(3) - 0.5 * skew(y[3:6])) @ y_dot[3:6]
    return np.concatenate([back @ (V + np.cross(OMEGA, y[:3]) + y_dot[:3]), back @ OMEGA + spin, y_dot[6:]])


def energy(y, y_dot):
    v = velocities(y, y_dot)
    return 0.5 * v @ mass_matrix(INTEGRALS, Q + y[6:]) @ v


def differences(function, size, h=1e-4):
    return np.array([(function(h * e) - function(-h * e)) / (2 * h) for e in np.eye(size)])


def test_force_and_hessian_are_derivatives_of_the_energy():
    found, none = spinning(INTEGRALS, Q, V, OMEGA), np.zeros(10)
    np.testing.assert_allclose(found.force, differences(lambda y: energy(y, none), 10), atol=1e-7)
    second = differences(lambda s: differences(lambda y: energy(y + s, none), 10, 1e-3), 10, 1e-3)
    np.testing.assert_allclose(found.hessian, second, atol=1e-5)
    np.testing.assert_allclose(found.hessian, found.hessian.T, atol=1e-13)


def test_the_gyroscopic_matrix_is_the_curl_of_the_momenta():
    found = spinning(INTEGRALS, Q, V, OMEGA)
    momenta = lambda y: differences(lambda rate: energy(y, rate), 10)  # noqa: E731
    by_y = differences(momenta, 10).T
    np.testing.assert_allclose(found.gyroscopic, by_y - by_y.T, atol=1e-6)


def test_the_force_is_that_of_the_equations_of_motion():
    """Q_v - M [omega x V, 0, 0]: body axes that keep [V, omega]."""
    acceleration = np.concatenate([np.cross(OMEGA, V), np.zeros(7)])
    left = quadratic_velocity(INTEGRALS, Q, OMEGA, np.zeros(4)) - mass_matrix(INTEGRALS, Q) @ acceleration
    np.testing.assert_allclose(spinning(INTEGRALS, Q, V, OMEGA).force, left, atol=1e-12)
