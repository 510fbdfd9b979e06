"""Geometric stiffening of frames of beams, by load.

The axial force N that a load causes in a beam changes its stiffness against bending and twisting by

    K_sigma,ij = integral of N (v_i' v_j' + w_i' w_j' + (Iy + Iz)/A theta_x,i' theta_x,j') dx,

which is linear in the load. One reduced matrix is stored for each unit load, as for solids (`ffr_prep.stiffening`).
What bending moments and torques add, which matters for lateral buckling of deep beams, is left out.

Sources: J. S. Przemieniecki, Theory of Matrix Structural Analysis (1968), section 15.2; Wallrapp & Schwertassek,
Representation of geometric stiffening in multibody system simulation (1991).
"""

from __future__ import annotations

import numpy as np

from ffr_prep.accelerations import unit_accelerations
from ffr_prep.beams import Beams, axis_gradients, element_coordinates, mass_points, undeformed

Array = np.ndarray

_GAUSS = 4  # points; products of the quadratic slopes with the quadratic tension are of degree six


def beam_stiffening(elements: Beams, static: Array, basis: Array) -> Array:
    """(r, n, n) geometric stiffness of the shapes `basis` (E, 12, n) under r loads with displacements `static` (E, 12, r).

    Both are nodal coordinates in body axes; the first twelve loads are those of unit accelerations, which act inside the
    elements, the others act at nodes.
    """
    to_element = element_coordinates(elements)
    of_elements = np.zeros((len(elements.length), 2, static.shape[2]))
    of_elements[:, :, :12] = axial_loads(elements)
    forces, shapes = tensions(elements, to_element @ static, of_elements), to_element @ basis
    return np.array([stiffness_of_tension(elements, forces[:, :, k], shapes) for k in range(static.shape[2])])


def axial_loads(elements: Beams) -> Array:
    """(E, 2, 12) nodal forces along x' of the elements under unit accelerations [N]."""
    xi, across, mass = mass_points(elements)
    accelerations = unit_accelerations(undeformed(elements, xi, across).reshape(-1, 3)).reshape(12, *mass.shape, 3)
    along = np.einsum("aeqc,ec,eq->aeq", accelerations, elements.C[:, :, 0], mass)
    return -np.stack([along @ (1 - xi), along @ xi], axis=-1).transpose(1, 2, 0)


def tensions(elements: Beams, e: Array, loads: Array) -> Array:
    """(E, 3, r) tension [N] at both ends and its mean, of coordinates e (E, 12, r) and loads along x' (E, 2, r).

    The ends follow from the equilibrium of the element; all three are exact where the loads vary linearly along it.
    """
    mean = (elements.EA / elements.length)[:, None] * (e[:, 6] - e[:, 0])
    return np.stack([mean + loads[:, 0], mean - loads[:, 1], mean], axis=1)


def stiffness_of_tension(elements: Beams, tension: Array, e: Array) -> Array:
    """(n, n) geometric stiffness of the shapes e (E, 12, n), in element axes.

    tension : (E, 3) [N], quadratic along the element with these values at its ends and this mean
    """
    at, weight = np.polynomial.legendre.leggauss(_GAUSS)
    xi = (1 + at) / 2
    deflection, twist = axis_gradients(elements, xi)
    radius = np.sqrt((elements.EIy + elements.EIz) / elements.EA)
    slopes = np.concatenate([deflection, radius[:, None, None, None] * twist], axis=2) @ e[:, None]
    first, last, mean = tension.T[..., None]
    force = first * (1 - xi) + last * xi + 6 * xi * (1 - xi) * (mean - (first + last) / 2)
    weighted = (force * weight / 2 * elements.length[:, None])[..., None, None] * slopes
    n = e.shape[2]
    K = slopes.reshape(-1, n).T @ weighted.reshape(-1, n)
    return (K + K.T) / 2
