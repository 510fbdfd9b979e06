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
import scipy.sparse as sp

from ffr_prep.beams import Beams, axis_gradients, element_coordinates
from ffr_prep.factor import free_body, solve_refined, supported
from ffr_prep.interface import CoupledModel
from ffr_prep.stiffening import PRODUCTS

Array = np.ndarray

_GAUSS = 3  # points; products of the quadratic slopes are of degree four


def beam_stiffening(
    elements: Beams, B_1: sp.csr_array, ties: sp.csr_array, model: CoupledModel, L: Array, inertial: Array, Z: Array
) -> Array:
    """(12 + 6 I, n, n) reduced geometric stiffness per unit load, in the order of `FlexibleBody.stiffening`.

    B_1 connectivity; ties (6N, Z) nodal coordinates of the independent ones; L (r, Z) reference conditions; inertial
    (Z, 12) loads of unit accelerations; Z (Z, n) basis. Raises ComputationError when a static problem fails.
    """
    loads = np.hstack([inertial, model.C.toarray().T])
    held = supported(free_body(model.K, model.T, model.places), L)
    displacement, _ = solve_refined(held, loads, np.zeros((len(L), loads.shape[1])))
    to_element = element_coordinates(elements)

    def nodal(z: Array) -> Array:
        return to_element @ (B_1 @ (ties @ z)).reshape(-1, 12, z.shape[1])

    forces = axial_forces(elements, nodal(displacement))
    stiffness = [stiffness_of_tension(elements, force, nodal(Z)) for force in forces.T]
    return np.array(stiffness).reshape(-1, Z.shape[1], Z.shape[1])


def axial_forces(elements: Beams, e: Array) -> Array:
    """(E, r) tension [N] of the elements with coordinates e (E, 12, r) in element axes; constant in each element."""
    return (elements.EA / elements.length)[:, None] * (e[:, 6] - e[:, 0])


def stiffness_of_tension(elements: Beams, force: Array, e: Array) -> Array:
    """(n, n) geometric stiffness of the shapes e (E, 12, n), in element axes, under the tensions `force` (E,) [N]."""
    at, weight = np.polynomial.legendre.leggauss(_GAUSS)
    deflection, twist = axis_gradients(elements, (1 + at) / 2)
    radius = np.sqrt((elements.EIy + elements.EIz) / elements.EA)
    slopes = np.concatenate([deflection, radius[:, None, None, None] * twist], axis=2) @ e[:, None]
    weights = np.sqrt(np.outer(np.abs(force) * elements.length, weight / 2))[..., None, None]
    weighted = weights * slopes
    n = e.shape[2]
    signed = np.sign(force)[:, None, None, None] * weighted
    return weighted.reshape(-1, n).T @ signed.reshape(-1, n)


def unit_accelerations(points: Array) -> Array:
    """(12, P, 3) acceleration fields: translations, angular accelerations, products of the angular velocity."""
    turn = [np.cross(axis, np.eye(3)).T for axis in np.eye(3)]  # u -> axis x u
    twice = [(turn[k] @ turn[l] + (turn[l] @ turn[k] if k != l else 0)) for k, l in PRODUCTS]  # noqa: E741
    along = np.broadcast_to(np.eye(3)[:, None], (3, *points.shape))
    return np.concatenate([along, [points @ A.T for A in turn], [points @ A.T for A in twice]])
