"""The accelerations of a body that moves as a rigid one, and the loads that they are.

A point at u in the body frame, whose origin accelerates by a, has the acceleration a + alpha x u + omega x (omega x u) in
body axes: twelve fields, linear in the point, times the three components of a, the three of the angular acceleration alpha
and the six products xx, yy, zz, xy, xz, yz of the angular velocity omega.

Source: A. A. Shabana, Dynamics of Multibody Systems (2013), section 3.1.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from ffr_prep.common.arrays import Array

INERTIAL = 12  # loads of unit accelerations
PRODUCTS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


@cache
def turns() -> Array:
    """(3, 3, 3): e_a x u = turns()[a] @ u."""
    found = np.cross(np.eye(3)[:, None], np.eye(3)[None]).transpose(0, 2, 1)
    found.setflags(write=False)
    return found


def gradients() -> Array:
    """(9, 3, 3) of the fields after the three translations: three angular accelerations, six products."""
    turn = turns()
    twice = [turn[k] @ turn[l] + (turn[l] @ turn[k] if k != l else 0) for k, l in PRODUCTS]  # noqa: E741
    return np.concatenate([turn, twice])


def unit_accelerations(points: Array) -> Array:
    """(12, P, 3) acceleration at the points (P, 3): translations, angular accelerations, products."""
    along = np.broadcast_to(np.eye(3)[:, None], (3, *points.shape))
    return np.concatenate([along, points @ gradients().transpose(0, 2, 1)])


def turned(one: Array, others: Array) -> Array:
    """(..., 3, 3, m) G with the second derivative G r of the displacement of an arm r that turns by one (..., 3) and
    others (..., 3, m)."""
    product = one[..., :, None, None] * others[..., None, :, :]
    trace = np.einsum("...kkm->...m", product)
    return (product + np.swapaxes(product, -3, -2)) / 2 - trace[..., None, None, :] * np.eye(3)[..., None]
