"""The second-order displacement of beams at the outlines of their sections, and their section forces to second order.

The nodes move by their second-order coordinates, the ends of an offset centroid line turn about them, and a point of a
section at r from the centroid turns with it: phi x (phi x r) / 2 beside the first order. Between its ends the axis of an
element goes on along

    dr/dx = R (e_x + Gamma),    dR/dx = R kappa~,    R = exp(phi~)

to second order: it shortens by what its slopes take of the length, its slopes are not quite the rotation vector, and this
twists where the section does not.

The section forces of pairs are those of the ends, K e_ij + F_ij: of the strains of second order, which are those of
axes that turn with the sections. In these axes moments are in equilibrium by

    dM/dx + kappa x M + e_x x F = 0,

so a beam that is bent and twisted has kappa x M in its shear forces, beside the slope of its moments that the ends know.
It is taken in the middle of each element, as the slope is the mean over it.

Source: as `ffr_prep.structures.beam_stiffening`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ffr_prep.body import Surface
from ffr_prep.body.accelerations import turned
from ffr_prep.common.arrays import Array
from ffr_prep.structures.beam_stiffening import end_forces_of_products, strain_functions, turned_offsets
from ffr_prep.structures.beam_stress import at_places, section_forces, stiffness_of_ends, stressed_sweep
from ffr_prep.structures.beam_surface import swept_surface
from ffr_prep.structures.beams import Beams, axis_functions, element_coordinates, picked
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
        _section_forces(elements, nodal, one, others),
    )


def _moved(elements: Beams, xi: Array, across: Array, nodal: Array, one: Array, others: Array) -> Array:
    """(E, Q, 3, m) displacements of pairs in body axes, at xi (Q,) and across (E, Q, 2)."""
    to_element = element_coordinates(elements)
    products = _Products(elements, to_element @ one, to_element @ others)
    stations, at = np.unique(xi, return_inverse=True)
    axis, rotation = _axis(elements, stations, _of_line(elements, nodal, one, others), products)
    arms = np.concatenate([np.zeros((*across.shape[:2], 1)), across], axis=2)
    moved = axis[:, at] + np.cross(rotation[:, at], arms[..., None], axis=2)
    moved += np.einsum("eqklm,eql->eqkm", products.turn(stations)[:, at], arms)
    return np.einsum("ecd,eqdm->eqcm", elements.C, moved, optimize=True)


def _of_line(elements: Beams, nodal: Array, one: Array, others: Array) -> Array:
    """(E, 12, m) second-order coordinates of the centroid line in element axes."""
    line = element_coordinates(elements) @ nodal
    line.reshape(len(line), 2, 6, -1)[:, :, :3] += turned_offsets(elements, one, others)
    return line


def _axis(elements: Beams, xi: Array, line: Array, products: _Products) -> tuple[Array, Array]:
    """(E, Q, 3, m) displacement of the axis and rotation vector of the section, with the ends `line` (E, 12, m).

    The shape functions take slopes of the axis at the ends, where the rotation vector is given.
    """
    slopes = line.copy()
    at_ends = products.direction(np.array([0.0, 1.0]))
    for k in (0, 1):
        slopes[:, 6 * k + 4] -= at_ends[:, k, 2]
        slopes[:, 6 * k + 5] += at_ends[:, k, 1]
    axis, rotation = (functions @ slopes[:, None] for functions in axis_functions(elements, xi))
    between = _between_ends(elements, xi, products)
    axis[:, :, 0] += between[:, :, 0]
    rotation[:, :, 0] += between[:, :, 1]
    here = products.direction(xi)
    rotation[:, :, 1] += here[:, :, 2]
    rotation[:, :, 2] -= here[:, :, 1]
    return axis, rotation


def _between_ends(elements: Beams, xi: Array, products: _Products) -> Array:
    """(E, Q, 2, m) axial displacement and twist at xi (Q,) beside the straight lines between the ends."""
    at, weights = np.polynomial.legendre.leggauss(_GAUSS)
    ends = np.append(xi, 1.0)
    points = (ends[:, None] * (1 + at) / 2).ravel()
    rates = np.stack([products.direction(points)[:, :, 0], products.twist(points)], axis=2)
    rates = rates.reshape(len(rates), len(ends), len(at), *rates.shape[2:])
    grown = np.einsum("eqgkm,g,q,e->eqkm", rates, weights / 2, ends, elements.length, optimize=True)
    return np.asarray(grown[:, :-1] - xi[:, None, None] * grown[:, -1:])


@dataclass(frozen=True)
class _Products:
    """Products of the strains of coordinates e (E, 12, 1) and f (E, 12, m) of the centroid line in element axes."""

    elements: Beams
    e: Array
    f: Array

    def turn(self, xi: Array) -> Array:
        """(E, Q, 3, 3, m) by which arms in the section move."""
        first, second = self._strains(xi)
        return turned(first[..., 3:6, 0], second[..., 3:6, :])

    def direction(self, xi: Array) -> Array:
        """(E, Q, 3, m) of R (e_x + Gamma), the gradient of the axis, with its strains Gamma of first order; without what
        the turn of the section about the axis makes of shear, which is shear again."""
        first, second = self._strains(xi)
        (phi, Gamma), (psi, Delta) = ((of[..., 3:6, :], _axis_strains(of)) for of in (first, second))
        tilt, tip = (of * np.array([0.0, 1.0, 1.0])[:, None] for of in (phi, psi))
        return turned(phi[..., 0], psi)[..., :, 0, :] + _cross(tilt, Delta) + _cross(tip, Gamma)

    def twist(self, xi: Array) -> Array:
        """(E, Q, m) of the rate of the rotation vector along the axis where the section's curvature has none."""
        first, second = self._strains(xi)
        rate = _cross(first[..., 3:6, :], second[..., 6:, :]) + _cross(second[..., 3:6, :], first[..., 6:, :])
        return np.asarray(rate[..., 0, :] / 2)

    def _strains(self, xi: Array) -> tuple[Array, Array]:
        functions = strain_functions(self.elements, xi)
        return functions @ self.e[:, None], functions @ self.f[:, None]


def _axis_strains(strains: Array) -> Array:
    """(E, Q, 3, m) u', v' - phi_z, w' + phi_y."""
    return np.stack(
        [strains[..., 0, :], strains[..., 1, :] - strains[..., 5, :], strains[..., 2, :] + strains[..., 4, :]], axis=-2
    )


def _end_forces(elements: Beams, nodal: Array, one: Array, others: Array) -> Array:
    """(E, 12, m) forces of pairs on the ends of the centroid line, in axes that turn with the sections."""
    linear = stiffness_of_ends(elements) @ _of_line(elements, nodal, one, others)
    return np.asarray(linear + end_forces_of_products(elements, one, others))


def _section_forces(elements: Beams, nodal: Array, one: Array, others: Array) -> Array:
    """(E, 3, 6, m) section forces of pairs, in axes that turn with the sections."""
    forces = at_places(_end_forces(elements, nodal, one, others))
    (M, kappa), (of_others, kappa_others) = (_moments(elements, of) for of in (one, others))
    turning = _cross(kappa, of_others) + _cross(kappa_others, M)
    forces[:, :, 1] -= turning[:, None, 2]
    forces[:, :, 2] += turning[:, None, 1]
    return forces


def _moments(elements: Beams, nodal: Array) -> tuple[Array, Array]:
    """(E, 3, m) moments of first order in the middle of the elements, and the curvatures of the axis that they make."""
    M = section_forces(elements, nodal)[:, 1, 3:]
    return M, M / np.stack([elements.GJ, elements.EIy, elements.EIz], axis=1)[..., None]


def _cross(a: Array, b: Array) -> Array:
    """(..., 3, m) a x b."""
    return np.cross(a, b, axis=-2)
