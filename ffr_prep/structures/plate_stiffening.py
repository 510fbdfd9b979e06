"""Geometric stiffening of plates and flat shells, by load.

The forces per length N_ab that a load causes in the middle plane change its stiffness by

    K_sigma,ij = integral of N_ab (d u_m,i / dx_a) (d u_m,j / dx_b) dA,      m = x, y, z,

which is linear in the load: slopes of the deflection for buckling and stiffening of plates, gradients in the plane for
strips that bend in it. One reduced matrix is stored for each unit load, as for solids (`ffr_prep.solids.stiffening`). What
bending moments add, of the order of (thickness / wavelength)^2 beside it, is left out.

Source: O. C. Zienkiewicz, R. L. Taylor, The Finite Element Method, vol. 2, 5th ed. (2000), section 11.2 (initial stress
in plates).
"""

from __future__ import annotations

from dataclasses import fields

import numpy as np

from ffr_prep.common.arrays import Array
from ffr_prep.structures.plate_functions import reference, rule
from ffr_prep.structures.plates import Plates, displacement_gradient, element_coordinates, jacobian, membrane_strain

_ORDER = {3: 6, 4: 7}
_CHUNK = 512


def plate_stiffening(elements: Plates, static: Array, accelerations: Array, basis: Array) -> Array:
    """(r, n, n) geometric stiffness of the shapes `basis` (E, 6k, n) under the loads with displacements (E, 6k, r).

    Both are nodal coordinates in body axes. The forces in the plane follow from the displacements alone, whatever
    `accelerations` (12, r) act inside the elements.
    """
    K = np.zeros((static.shape[2], basis.shape[2], basis.shape[2]))
    at, _ = rule(elements.lift.shape[1], _ORDER[elements.lift.shape[1]])
    for first in range(0, len(elements.lift), _CHUNK):
        own = slice(first, first + _CHUNK)
        part = _part(elements, own)
        to_element = element_coordinates(part)
        strain = membrane_strain(part, at) @ (to_element @ static[own])[:, None]
        forces = part.membrane[:, None] @ strain
        gradient, area = shape_gradient(part, to_element @ basis[own])
        for load, stiffness in enumerate(K):
            stiffness += of_membrane_forces(gradient, area, forces[..., load])
    return K


def shape_gradient(elements: Plates, e: Array) -> tuple[Array, Array]:
    """(2, 3, E, Q, n) d u_m / d x_a at [a, m] of the shapes e (E, 6k, n), and the area (E, Q) of the points."""
    k = elements.lift.shape[1]
    at, weights = rule(k, _ORDER[k])
    area = jacobian(elements, reference(k, at))[1] * weights
    gradient = displacement_gradient(elements, at)
    count, points, _, _, size = gradient.shape
    fields = gradient.reshape(count, 6 * points, size) @ e
    return np.ascontiguousarray(fields.reshape(count, points, 2, 3, -1).transpose(2, 3, 0, 1, 4)), area


def strain_of_products(elements: Plates, at: Array, one: Array, others: Array) -> Array:
    """(E, Q, 3, m) second derivatives of the strains xx, yy, 2 xy of the middle plane by the amplitudes of shapes.

    one (E, 6k, 1), others (E, 6k, m), in element axes
    """
    gradient = displacement_gradient(elements, at)
    g, h = (np.einsum("eqami,eir->eqamr", gradient, e, optimize=True) for e in (one, others))
    product = np.einsum("eqam,eqbmr->eqabr", g[..., 0], h)
    shear = product[:, :, 0, 1] + product[:, :, 1, 0]
    return np.stack([product[:, :, 0, 0], product[:, :, 1, 1], shear], axis=2)


def plate_forces_of_products(elements: Plates, one: Array, others: Array) -> Array:
    """(E, 6k, m) geometric stiffness of one (E, 6k, 1) and others (E, 6k, m) as linear form of static coordinates."""
    parts = [slice(first, first + _CHUNK) for first in range(0, len(elements.lift), _CHUNK)]
    return np.concatenate([_forces_of_products(_part(elements, own), one[own], others[own]) for own in parts])


def _forces_of_products(elements: Plates, one: Array, others: Array) -> Array:
    k = elements.lift.shape[1]
    at, weights = rule(k, _ORDER[k])
    area = jacobian(elements, reference(k, at))[1] * weights
    to_element = element_coordinates(elements)
    strain = strain_of_products(elements, at, to_element @ one, to_element @ others)
    forces = (elements.membrane[:, None] @ strain) * area[..., None, None]
    of_coordinates = np.einsum("eqsi,eqsr->eir", membrane_strain(elements, at), forces, optimize=True)
    return to_element.transpose(0, 2, 1) @ of_coordinates


def of_membrane_forces(gradient: Array, area: Array, forces: Array) -> Array:
    n = gradient.shape[-1]
    xx, yy, xy = np.moveaxis(forces * area[..., None], -1, 0)[..., None]
    weighted = np.stack([xx * gradient[0] + xy * gradient[1], xy * gradient[0] + yy * gradient[1]])
    K = gradient.reshape(-1, n).T @ weighted.reshape(-1, n)
    return (K + K.T) / 2


def _part(elements: Plates, own: slice) -> Plates:
    return Plates(**{field.name: getattr(elements, field.name)[own] for field in fields(elements)})
