"""The surface that is drawn for plates: both faces, and the edges that only one element has; and the stress there.

The stress of a face is that of the membrane strain and of the curvature at the height of half the thickness, without
stress across the plate. The elements' own values in a corner are averaged over the elements that share the point.

To second order the middle plane moves by the second-order coordinates of the nodes; a fibre of the height z turns by phi,
which adds phi x (phi x z e_z) / 2. The strain of products of gradients in the plane is that of
`ffr_prep.structures.plate_stiffening`.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ffr_prep.body import TENSOR, Surface
from ffr_prep.body.accelerations import turned
from ffr_prep.common.arrays import Array
from ffr_prep.structures.plate_functions import CORNERS
from ffr_prep.structures.plate_stiffening import strain_of_products
from ffr_prep.structures.plates import (
    Plates,
    bending_strain,
    element_coordinates,
    fibre_rotation,
    field,
    membrane_strain,
    undeformed,
)

_FACE = {3: np.array([(0, 1, 2)]), 4: np.array([(0, 1, 2), (0, 2, 3)])}
_DIGITS = 9
_ROWS, _COLUMNS = np.array(TENSOR).T

FACE_STRESS = "faces of plates: membrane and bending strain at the corners of the elements, averaged where they meet"


def plate_faces(elements: Plates, nodes: Array, nodal: Array) -> Surface:
    """The boundary of all elements with the basis at its points, which follow the middle plane and turn with the fibres.

    nodes : (E, k); nodal : (E, 6k, n) coordinates of every element, in body axes, per elastic coordinate. Elements that
    continue one another in the same plane share points.
    """
    count, k = nodes.shape
    at = np.tile(CORNERS[k], (2, 1))
    half = _heights(elements)
    points = undeformed(elements, at, half).reshape(-1, 3)
    shapes = (field(elements, at, half) @ nodal[:, None]).reshape(len(points), 3, nodal.shape[2])
    kept, place = _shared(nodes, elements, half)
    triangles = place[np.vstack([_faces(count, k), _edges(nodes)])]
    return Surface(points[kept], triangles, shapes[kept])


def turned_faces(elements: Plates, nodes: Array, one: Array, others: Array) -> Array:
    """(P, 3, m) second derivatives of the displacement of the points of `plate_faces` by the turn of the fibres.

    one (E, 6k, 1) and others (E, 6k, m): coordinates in body axes
    """
    at, half = np.tile(CORNERS[nodes.shape[1]], (2, 1)), _heights(elements)
    turn = fibre_rotation(elements, at) @ element_coordinates(elements)[:, None]
    of_fibre = turned((turn @ one[:, None])[..., 0], turn @ others[:, None])[:, :, :, 2] * half[..., None, None]
    in_body_axes = np.einsum("eck,eqkr->eqcr", elements.C, of_fibre)
    return in_body_axes.reshape(-1, 3, others.shape[2])[_shared(nodes, elements, half)[0]]


def stressed_faces(
    elements: Plates, nodes: Array, nodal: Array, products: tuple[Array, Array] | None = None
) -> Surface:
    """As `plate_faces`, with stress modes.

    products : one (E, 6k, 1) and others (E, 6k, n), of which `nodal` is the second order: the stress is then that of the
               pairs, the strain of second order included
    """
    kept, place = _shared(nodes, elements, _heights(elements))
    stress = _corner_stress(elements, nodal, products).reshape(len(place), 6, nodal.shape[2])
    total = np.zeros((len(kept), *stress.shape[1:]))
    np.add.at(total, place, stress)
    moduli = np.repeat(np.stack([elements.E, elements.nu], axis=1), 2 * nodes.shape[1], axis=0)
    mean = total / np.bincount(place)[:, None, None]
    return replace(plate_faces(elements, nodes, nodal), stress=mean, moduli=moduli[kept])


def second_faces(elements: Plates, nodes: Array, nodal: Array, one: Array, others: Array) -> Surface:
    """The faces with the displacements of pairs, of one (E, 6k, 1) and others (E, 6k, m).

    nodal : (E, 6k, m) second-order coordinates of the pairs; all in body axes
    """
    faces = plate_faces(elements, nodes, nodal)
    return replace(faces, Phi=faces.Phi + turned_faces(elements, nodes, one, others))


def second_stressed_faces(elements: Plates, nodes: Array, nodal: Array, one: Array, others: Array) -> Surface:
    """As `second_faces`, with the stress of the pairs."""
    faces = stressed_faces(elements, nodes, nodal, (one, others))
    return replace(faces, Phi=faces.Phi + turned_faces(elements, nodes, one, others))


def _corner_stress(elements: Plates, nodal: Array, products: tuple[Array, Array] | None) -> Array:
    """(E, 2k, 6, n) stress in body axes at the corners of the upper and then of the lower face."""
    at, to_element = CORNERS[nodal.shape[1] // 6], element_coordinates(elements)
    e = (to_element @ nodal)[:, None]
    half = elements.thickness[:, None, None, None] / 2
    membrane = membrane_strain(elements, at) @ e
    if products is not None:
        membrane = membrane + strain_of_products(elements, at, *(to_element @ of for of in products))
    bent = half * (bending_strain(elements, at) @ e)
    elastic = (elements.membrane / elements.thickness[:, None, None])[:, None]
    plane = elastic @ np.concatenate([membrane + bent, membrane - bent], axis=1)
    tensor = np.zeros((*plane.shape[:2], 3, 3, plane.shape[3]))
    tensor[:, :, :2, :2] = plane[:, :, [[0, 2], [2, 1]]]
    in_body_axes = np.einsum("eik,eqklj,eml->eqimj", elements.C, tensor, elements.C, optimize=True)
    return in_body_axes[:, :, _ROWS, _COLUMNS]


def _heights(elements: Plates) -> Array:
    """(E, 2k) of the points of both faces."""
    return np.repeat([0.5, -0.5], elements.lift.shape[1]) * elements.thickness[:, None]


def _shared(nodes: Array, elements: Plates, half: Array) -> tuple[Array, Array]:
    """The points to keep, and the place of every point among them.

    One for each node, material and offset from the node along the normal.
    """
    offset = np.round(half[..., None] * elements.C[:, None, :, 2] / np.abs(half).max(), _DIGITS) + 0.0
    _, material = np.unique(np.stack([elements.E, elements.nu]), axis=1, return_inverse=True)
    owner = np.broadcast_to(material.ravel()[:, None], half.shape)
    key = np.concatenate([np.tile(nodes, (1, 2))[..., None], owner[..., None], offset], axis=-1).reshape(-1, 5)
    _, kept, place = np.unique(key, axis=0, return_index=True, return_inverse=True)
    return kept, place.ravel()


def _faces(count: int, k: int) -> Array:
    """(T, 3) upper faces counter-clockwise about z', lower ones the other way round."""
    first = 2 * k * np.arange(count)[:, None, None]
    return np.vstack([(first + _FACE[k]).reshape(-1, 3), (first + k + _FACE[k][:, ::-1]).reshape(-1, 3)])


def _edges(nodes: Array) -> Array:
    """(T, 3) two triangles between upper and lower face along each side that only one element has."""
    count, k = nodes.shape
    following = np.roll(np.arange(k), -1)
    sides = np.sort(np.stack([nodes, nodes[:, following]], axis=-1).reshape(-1, 2), axis=1)
    _, number, uses = np.unique(sides, axis=0, return_inverse=True, return_counts=True)
    free = uses[number.ravel()] == 1
    first = 2 * k * np.arange(count)[:, None]
    i, j = (first + np.arange(k)).ravel()[free], (first + following).ravel()[free]
    return np.vstack([np.stack([i, i + k, j], axis=1), np.stack([j, i + k, j + k], axis=1)])
