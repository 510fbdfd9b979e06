"""The error of the stress of a result by the shapes of its bodies: what they leave out of the stress of their own inertia.

A reduction with stress keeps for each of the twelve unit accelerations of a body that moves as a rigid one the largest stress
that its shapes do not show (`ffr_prep.body.left_out_stress`). Their sum with the accelerations of the run, weight included,
bounds what is missing anywhere on the surface, as far as the missing deformation follows its load without vibrating.
"""

from __future__ import annotations

import numpy as np

from ffr_dyn.functions.rotation import rotation_matrix
from ffr_dyn.results.result import Result
from ffr_prep.body import PRODUCTS
from ffr_prep.common.arrays import Array


def stress_error(result: Result, body: str) -> float | None:
    """The largest von Mises stress [Pa] that is missing on a body at any time of a result; None where that is not known, as
    on a base that is accelerated.

    body : by its name, of a body in parts by that of the whole: then that of the part with the largest

    >>> fd.stress_error(result, "rod")
    """
    names = result.attributes.get("parts", {}).get(body, [body])
    known = result.attributes.get("left_out_stress", {})
    gravity = np.array(result.attributes.get("gravity", np.zeros(3)), float)
    found = [missing_stress(result, name, np.array(known[name]), gravity) for name in names if name in known]
    return max((error for error in found if error is not None), default=None)


def missing_stress(result: Result, body: str, left_out: Array, gravity: Array) -> float | None:
    """The largest von Mises stress [Pa] that is missing on a body at any time of a result; None without its motion.

    left_out : (12,) under unit accelerations (`ffr_prep.body.left_out_stress`)
    gravity  : (3,) or (T, 3) [m/s^2], less the acceleration of the base
    """
    needed = [f"{body}.{key}" for key in ("p", "v", "omega_bar")]
    if not result.time.size or needed[0] not in result.quantities:
        return None
    still = np.zeros((result.time.size, 3))
    v, omega = (result[name] if name in result.quantities else still for name in needed[1:])
    p = result[needed[0]]
    axes = rotation_matrix(p / np.linalg.norm(p, axis=1, keepdims=True))
    origin = np.einsum("tji,tj->ti", axes, _rate(result.time, v) - gravity)
    products = np.stack([omega[:, a] * omega[:, b] for a, b in PRODUCTS], axis=1)
    accelerations = np.hstack([origin, _rate(result.time, omega), products])
    return float((np.abs(accelerations) @ left_out).max())


def _rate(time: Array, values: Array) -> Array:
    """(T, 3) by differences of rows; rows at one time have that of the first."""
    times, first, row = np.unique(time, return_index=True, return_inverse=True)
    if times.size < 2:
        return np.zeros_like(values)
    return np.asarray(np.gradient(values[first], times, axis=0)[row])
