"""The second-order displacement of beams at the outlines of their sections, and their section forces to second order.

The nodes move by their second-order coordinates, the ends of an offset centroid line turn about them, and a point of a
section at r from the centroid turns with it: phi x (phi x r) / 2 beside the first order. Between its ends the axis of an
element is where a constant tension holds it: it shortens by what its slopes take of the length,

    d u_ij / dx = const - (v_i' v_j' + w_i' w_j').

The section forces of pairs are those of the ends, K e_ij + F_ij, in axes that turn with the section: a force f that keeps its
direction is f - phi x f there; and as the moment whose work is M . phi with the rotation vector phi is the moment m less
phi x m / 2, that is M - phi x m / 2.

Source: as `ffr_prep.structures.beam_stiffening`.
"""

from __future__ import annotations

import numpy as np

from ffr_prep.body import Surface
from ffr_prep.common.arrays import Array
from ffr_prep.model.second_order import turned
from ffr_prep.structures.beam_stiffening import end_forces_of_products, turned_offsets
from ffr_prep.structures.beam_stress import at_places, end_forces, stiffness_of_ends, stressed_sweep
from ffr_prep.structures.beam_surface import swept_surface
from ffr_prep.structures.beams import (
    Beams,
    axis_functions,
    axis_gradients,
    element_coordinates,
    picked,
    shape_functions,
)
from ffr_prep.structures.frame import Frame

_GAUSS = 4  # points; products of quadratic slopes are of degree four


def second_sweep(frame: Frame, elements: Beams, nodal: Array, one: Array, others: Array) -> Surface:
    """The swept surface with the displacements of pairs, of one (E, 12, 1) and others (E, 12, m).

    nodal : (E, 12, m) second-order coordinates of the pairs; all in body axes
    """
    return swept_surface(
        frame,
        elements,
        lambda own, xi, across: _moved(picked(elements, own), xi, across, nodal[own], one[own], others[own]),
    )


def second_stressed_sweep(frame: Frame, elements: Beams, nodal: Array, one: Array, others: Array) -> Surface:
    """As `second_sweep`, with the stress and the section forces of the pairs."""
    return stressed_sweep(
        frame,
        elements,
        lambda own, xi, across: _moved(picked(elements, own), xi, across, nodal[own], one[own], others[own]),
        at_places(_end_forces(elements, nodal, one, others)),
    )


def _moved(elements: Beams, xi: Array, across: Array, nodal: Array, one: Array, others: Array) -> Array:
    """(E, Q, 3, m) displacements of pairs in body axes, at xi (Q,) and across (E, Q, 2)."""
    to_element = element_coordinates(elements)
    e, f = to_element @ one, to_element @ others
    rotation = axis_functions(elements, xi)[1]
    turn = turned((rotation @ e[:, None])[..., 0], rotation @ f[:, None])
    moved = shape_functions(elements, xi, across) @ _of_line(elements, nodal, one, others)[:, None]
    moved += np.einsum("eqkcm,eqc->eqkm", turn[:, :, :, 1:], across)
    stations, at = np.unique(xi, return_inverse=True)
    moved[:, :, 0] += _shortening(elements, stations, e, f)[:, at]
    return np.einsum("ecd,eqdm->eqcm", elements.C, moved, optimize=True)


def _of_line(elements: Beams, nodal: Array, one: Array, others: Array) -> Array:
    """(E, 12, m) second-order coordinates of the centroid line in element axes."""
    line = element_coordinates(elements) @ nodal
    line.reshape(len(line), 2, 6, -1)[:, :, :3] += turned_offsets(elements, one, others)
    return line


def _shortening(elements: Beams, xi: Array, e: Array, f: Array) -> Array:
    """(E, Q, m) axial displacement at xi (Q,) beside the straight line between the ends; e, f of the centroid line."""
    at, weights = np.polynomial.legendre.leggauss(_GAUSS)
    ends = np.append(xi, 1.0)
    points = (ends[:, None] * (1 + at) / 2).ravel()
    slopes = axis_gradients(elements, points)[0]
    g, h = (slopes @ of[:, None] for of in (e, f))
    product = np.einsum("eqs,eqsm->eqm", g[..., 0], h).reshape(len(e), len(ends), len(at), -1)
    taken = np.einsum("eqgm,g,q,e->eqm", product, weights / 2, ends, elements.length, optimize=True)
    return np.asarray(xi[:, None] * taken[:, -1:] - taken[:, :-1])


def _end_forces(elements: Beams, nodal: Array, one: Array, others: Array) -> Array:
    """(E, 12, m) forces of pairs on the ends of the centroid line, in axes that turn with the sections."""
    fixed = stiffness_of_ends(elements) @ _of_line(elements, nodal, one, others)
    fixed += end_forces_of_products(elements, one, others)
    to_element = element_coordinates(elements)
    phi, psi = (_ends(to_element @ of)[:, :, 1] for of in (one, others))
    f, g = (_ends(end_forces(elements, of)) for of in (one, others))
    turn = _cross(phi[:, :, None], g) + _cross(psi[:, :, None], f)
    half = np.array([1.0, 0.5])[:, None, None]
    return fixed - (half * turn).reshape(fixed.shape)


def _ends(e: Array) -> Array:
    """(E, 2, 2, 3, m) by ends, translation or force and rotation or moment."""
    return e.reshape(len(e), 2, 2, 3, -1)


def _cross(a: Array, b: Array) -> Array:
    """(..., 3, m) a x b."""
    return np.cross(a, b, axis=-2)
