"""Bodies in steady motion, each as in one screw: what their inertia does to small motions relative to it.

In a steady motion every body keeps its shape and moves as a rigid one, R_dot = u + w x R with constant u, w of its
own, so that its velocities [A^T R_dot, omega_bar] = [V, omega] are constant in its axes. With small motions y = [a,
phi, eta] from there (R moves by A a, A turns to A exp(phi~), q by eta) and their rates the body has the velocities

    w(y) + y_dot + ...,     w(y) = [exp(-phi~) (V + omega x a), exp(-phi~) omega, 0],

and the kinetic energy 1/2 (w + y_dot)^T M(q) (w + y_dot), in which time does not appear. Its part T_0 = 1/2 w^T M w acts as a
potential with the opposite sign (of the centrifugal forces), its part linear in y_dot gives the gyroscopic matrix, and

    M y_ddot + G y_dot - (dd T_0) y - d T_0 = other forces.

G is skew and dd T_0 symmetric. (Meirovitch 1980, ch. 3; Geradin & Rixen 2015, ch. 2.)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ffr_dyn.equations.inertia import Integrals, mass_matrix
from ffr_dyn.functions.rotation import skew
from ffr_prep.common.arrays import Array


@dataclass(frozen=True)
class Spinning:
    """Of one body: d T_0 (6 + n,), dd T_0 and G (6 + n, 6 + n)."""

    force: Array
    hessian: Array
    gyroscopic: Array


def spinning(integrals: Integrals, q: Array, V: Array, omega: Array) -> Spinning:
    """A body of the deflections q (n,) in steady motion with V, omega (3,) in body axes.

    Equation (29) of docs/notation.md.
    """
    size = 6 + q.size
    w = np.concatenate([V, omega, np.zeros(q.size)])
    M, by_shape = mass_matrix(integrals, q), by_deflections(integrals, q, w)
    C = np.zeros((size, size))  # dw by y
    C[:3, :3] = C[3:6, 3:6] = skew(omega)
    C[:3, 3:6] = skew(V)
    momentum = M @ w
    P, L = momentum[:3], momentum[3:6]
    force = momentum @ C
    force[6:] += 0.5 * w @ by_shape
    Dp = M @ C  # of the momenta of y_dot, dT_1 by y
    Dp[:, 6:] += by_shape
    Dp[:3, 3:6] -= skew(P)
    Dp[3:6, 3:6] -= 0.5 * skew(L)
    mixed = np.zeros((size, size))
    mixed[:, 6:] = C.T @ by_shape
    return Spinning(force, C.T @ M @ C + mixed + mixed.T + _curvature(integrals, P, L, V, omega, q.size), Dp - Dp.T)


def by_deflections(integrals: Integrals, q: Array, w: Array) -> Array:
    """(6 + n, n) derivative of M(q) w by q; the steps may be large, as M is quadratic."""
    columns = [mass_matrix(integrals, q + step) - mass_matrix(integrals, q - step) for step in np.eye(q.size)]
    return 0.5 * np.array([M @ w for M in columns]).reshape(q.size, w.size).T


def _curvature(integrals: Integrals, P: Array, L: Array, V: Array, omega: Array, n: int) -> Array:
    """(6 + n, 6 + n) what the second derivatives of w and M add to dd T_0."""
    S, one = np.zeros((6 + n, 6 + n)), np.eye(3)
    for momentum, rate in ((P, V), (L, omega)):
        S[3:6, 3:6] += 0.5 * (np.outer(momentum, rate) + np.outer(rate, momentum)) - (momentum @ rate) * one
    S[3:6, :3] = skew(P) @ skew(omega)
    S[:3, 3:6] = S[3:6, :3].T
    products = omega @ omega * np.einsum("kkij->ij", integrals.PP_dm)
    products -= np.einsum("k,klij,l->ij", omega, integrals.PP_dm, omega)
    S[6:, 6:] = 0.5 * (products + products.T)
    return S
