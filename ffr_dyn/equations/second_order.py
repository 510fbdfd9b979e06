"""Second-order bodies: u = Phi q + u_2(q) with u_2 quadratic in q, which foreshortens what bends.

With u_2 = -K^-1 f_N(q, q) the strain energy has no cubic part, f_N the forces of the quadratic strain. For a unit load F with
the linear response w = K^-1 F and its stress sigma that gives, by reciprocity,

    F . u_2 = -w . f_N = -int sigma : eps_N(q, q) dV = -1/2 q^T K_F q,

so the matrices that a body stores by load (`FlexibleBody.stiffening`) are second derivatives: those of forces and moments at
an interface of its place and rotation vector (moments are semitangential), those of accelerations, which act as forces
-a dm, of the moments of mass. Geometric stiffening is no force then: it follows from the kinetic energy, gravity and the
work of joints and loads.

A second-order body is in its mean-axis form here, where int u_2 dm and int u_0 x u_2 dm vanish as int Phi dm and
int u_0 x Phi dm do: K_0 to K_5 are zero.

Source: O. Wallrapp, R. Schwertassek, Int. J. Numer. Methods Eng. 32 (1991) 1833-1850 (second-order displacements).
"""

from __future__ import annotations

import numpy as np

from ffr_dyn.scene.scene import Body
from ffr_prep.common.arrays import Array

PRODUCTS, INTERFACES = 6, 12  # the first load of the products of angular velocities, and of the first interface
_PLACES = np.array([[0, 3, 4], [3, 1, 5], [4, 5, 2]])  # of xx, yy, zz, xy, xz, yz in a symmetric tensor


def load_matrices(body: Body) -> Array:
    """(12 + 6 I, n, n) K_L of a body, none, (0, n, n), of a linear one: without load matrices, or in a scene without them."""
    n = body.model.n
    if body.model.stiffening is None or not body.stiffening:
        return np.zeros((0, n, n))
    return body.model.stiffening


def is_second_order(body: Body) -> bool:
    """Whether a body of a scene has a second-order part."""
    return load_matrices(body).size > 0


def marker_matrices(body: Body, point: str) -> Array:
    """(6, n, n) K of the place (3) and the rotation vector (3) of an interface, zeros of a linear body.

    Place and rotation vector have the second-order part -1/2 q^T K_e q, e = 0..5.
    """
    K, n = load_matrices(body), body.model.n
    if not len(K):
        return np.broadcast_to(0.0, (6, n, n))
    first = INTERFACES + 6 * [interface.name for interface in body.model.interfaces].index(point)
    return K[first : first + 6]


def second_moments(body: Body) -> Array:
    """(3, 3, n, n) X, symmetric in both pairs: int u_0k u_2l dm = 1/2 q^T X_kl q; zeros of a linear body.

    Equation (24) of docs/notation.md.
    """
    K, n = load_matrices(body), body.model.n
    if not len(K):
        return np.zeros((3, 3, n, n))
    half = 0.5 * K[PRODUCTS:INTERFACES]
    X = half[_PLACES]
    for k in range(3):
        X[k, k] = 2 * half[k] - half[:3].sum(axis=0)
    return X
