"""Geometric stiffening of plates and flat shells, by load.

The forces per length N_ab that a load causes in the middle plane change its stiffness by

    K_sigma,ij = integral of N_ab (d u_m,i / dx_a) (d u_m,j / dx_b) dA,      m = x, y, z,

which is linear in the load: slopes of the deflection for buckling and stiffening of plates, gradients in the plane for
strips that bend in it. One reduced matrix is stored for each unit load, as for solids (`ffr_prep.stiffening`). What
bending moments add, of the order of (thickness / wavelength)^2 beside it, is left out.

Source: O. C. Zienkiewicz, R. L. Taylor, The Finite Element Method, vol. 2, 5th ed. (2000), section 11.2 (initial stress
in plates).
"""

from __future__ import annotations

from dataclasses import fields

import numpy as np

from ffr_prep.plates import (
    Plates,
    displacement_gradient,
    element_coordinates,
    jacobian,
    membrane_strain,
    reference,
    rule,
)

Array = np.ndarray

_ORDER = {3: 6, 4: 7}
_CHUNK = 512


def plate_stiffening(elements: Plates, static: Array, basis: Array) -> Array:
    """(r, n, n) geometric stiffness of the shapes `basis` (E, 6k, n) under the loads with displacements (E, 6k, r).

    Both are nodal coordinates in body axes.
    """
    K = np.zeros((static.shape[2], basis.shape[2], basis.shape[2]))
    at, _ = rule(elements.lift.shape[1], _ORDER[elements.lift.shape[1]])
    for first in range(0, len(elements.lift), _CHUNK):
        own = slice(first, first + _CHUNK)
        part = _part(elements, own)
        to_element = element_coordinates(part)
        strain = membrane_strain(part, at) @ (to_element @ static[own])[:, None]
        forces = part.membrane[:, None] @ strain
        for load, stiffness in enumerate(K):
            stiffness += stiffness_of_forces(part, forces[..., load], to_element @ basis[own])
    return K


def stiffness_of_forces(elements: Plates, forces: Array, e: Array) -> Array:
    """(n, n) geometric stiffness of the shapes e (E, 6k, n), in element axes.

    forces : (E, Q, 3) xx, yy, xy per length [N/m] at the Q points of the stiffness rule, or (E, 1, 3) where constant
    """
    k = elements.lift.shape[1]
    at, weights = rule(k, _ORDER[k])
    area = jacobian(elements, reference(k, at))[1] * weights
    gradient = displacement_gradient(elements, at) @ e[:, None, None]
    tensor = forces[..., [[0, 2], [2, 1]]] * area[..., None, None]
    weighted = np.einsum("eqab,eqbmj->eqamj", tensor, gradient, optimize=True)
    n = e.shape[2]
    K = gradient.reshape(-1, n).T @ weighted.reshape(-1, n)
    return (K + K.T) / 2


def _part(elements: Plates, own: slice) -> Plates:
    return Plates(**{field.name: getattr(elements, field.name)[own] for field in fields(elements)})
