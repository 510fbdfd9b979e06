"""Geometric stiffening of frames of beams, by load.

The section forces that a load causes in a beam do work on its strains of second order. With the displacement u of the axis
and the rotation vector phi of the section, the strains of a beam that turns by R = exp(phi~) are R^T (e_x + u') - e_x and
the axial vector of R^T R', which to second order gives the work

    integral of  N (v'^2 + w'^2) / 2 + N (Iy + Iz) / A phi_x'^2 / 2
                 + Qy (phi_x w' - phi_z u' + phi_x phi_y / 2) - Qz (phi_x v' - phi_y u' - phi_x phi_z / 2)
                 - M . (phi x phi') / 2  dx,

linear in the load: tension stiffens against bending and twisting, bending moments and shear forces couple deflection and
twist (lateral buckling), torque the two planes of bending. The tension acts along the deflected axis, not across the
turned section: Engesser's theory of columns soft in shear. One reduced matrix is stored for each unit load, as for solids
(`ffr_prep.solids.stiffening`). Loads at nodes are forces of fixed direction and semitangential moments, which do the work
M . phi; arms, from a node to an offset section or within it, turn to second order (`ffr_prep.model.region_rotations`).

Sources: J. C. Simo, L. Vu-Quoc, Computer Methods in Applied Mechanics and Engineering 58 (1986) 79-116 (strains); J. H.
Argyris et al., ibid. 20 (1979) 105-155 (moments); J. S. Przemieniecki, Theory of Matrix Structural Analysis (1968), section
15.2; S. P. Timoshenko, J. M. Gere, Theory of Elastic Stability (1961), chapter 6 (lateral buckling).
"""

from __future__ import annotations

import numpy as np

from ffr_prep.body.accelerations import INERTIAL, gradients, turned, turns, unit_accelerations
from ffr_prep.common.arrays import Array
from ffr_prep.model.region_rotations import second_order_turn
from ffr_prep.structures.beam_stress import end_forces, stiffness_of_ends
from ffr_prep.structures.beams import (
    Beams,
    axis_functions,
    axis_gradients,
    element_coordinates,
    mass_points,
    rotation_gradients,
    shape_functions,
    undeformed,
)

_GAUSS = 4  # points; products of the quadratic slopes with the quadratic tension are of degree six


def beam_stiffening(elements: Beams, static: Array, accelerations: Array, basis: Array) -> Array:
    """(r, n, n) geometric stiffness of the shapes `basis` (E, 12, n) under r loads with displacements `static` (E, 12, r).

    Both are nodal coordinates in body axes. `accelerations` (12, r) of the unit accelerations act inside the elements, all
    other loads at nodes.
    """
    xi, weight = _gauss_points(elements)
    to_element = element_coordinates(elements)
    ends = end_forces(elements, static) - element_loads(elements) @ accelerations
    spread = section_loads(elements) @ accelerations
    forces = section_forces(elements, ends, to_element @ static, spread, xi)
    strains = strain_functions(elements, xi) @ (to_element @ basis)[:, None]
    turning = elements.C.transpose(0, 2, 1)[:, None] @ basis.reshape(len(basis), 2, 6, -1)[:, :, 3:]
    return np.array(
        [
            _summed(strains, weight * _work(elements, forces[..., k], spread[..., k]))
            + _of_offsets(elements, ends[..., k], turning)
            for k in range(static.shape[2])
        ]
    )


def end_forces_of_products(elements: Beams, one: Array, others: Array) -> Array:
    """(E, 12, m) forces on the ends of the centroid line, in element axes, that the products of shapes make.

    one (E, 12, 1), others (E, 12, m): nodal coordinates in body axes
    """
    xi, weight = _gauss_points(elements)
    to_element = element_coordinates(elements)
    ends, e = stiffness_of_ends(elements), np.broadcast_to(np.eye(12), to_element.shape)
    forces = section_forces(elements, ends, e, np.zeros((len(e), 3, 3, 12)), xi)
    functions = strain_functions(elements, xi) @ to_element[:, None]
    first, second = (functions @ of[:, None] for of in (one, others))
    unit = np.broadcast_to(np.eye(6), (*weight.shape[:2], 6, 6))
    products = [(weight * _work(elements, unit[..., k], np.zeros((len(e), 3, 3)))) @ second for k in range(6)]
    works = np.stack([np.einsum("eqs,eqsm->eqm", first[..., 0], of) for of in products], axis=2)
    return np.einsum("eqfi,eqfm->eim", forces, works, optimize=True)


def beam_forces_of_products(elements: Beams, one: Array, others: Array) -> Array:
    """(E, 12, m) geometric stiffness of one (E, 12, 1) and others (E, 12, m) as linear form of static coordinates."""
    of_sections = end_forces_of_products(elements, one, others)
    to_element = element_coordinates(elements)
    arms = np.zeros_like(of_sections)
    arms.reshape(len(arms), 2, 6, -1)[:, :, :3] = turned_offsets(elements, one, others)
    inside = of_sections + stiffness_of_ends(elements).transpose(0, 2, 1) @ arms
    return to_element.transpose(0, 2, 1) @ inside


def turned_offsets(elements: Beams, one: Array, others: Array) -> Array:
    """(E, 2, 3, m) second derivatives of the displacement of the ends of the centroid line, which turn about the nodes."""
    turning = elements.C.transpose(0, 2, 1)[:, None]
    phi, psi = (turning @ of.reshape(len(of), 2, 6, -1)[:, :, 3:] for of in (one, others))
    return np.einsum("enklm,el->enkm", turned(phi[..., 0], psi), elements.offset)


def _gauss_points(elements: Beams) -> tuple[Array, Array]:
    """xi (Q,) along the elements and the length (E, Q, 1, 1) of each point."""
    at, weights = np.polynomial.legendre.leggauss(_GAUSS)
    return (1 + at) / 2, (elements.length[:, None] * weights / 2)[..., None, None]


# ---- loads and section forces -------------------------------------------------------------------------------------


def element_loads(elements: Beams) -> Array:
    """(E, 12, 12) loads on the ends of the centroid line, in element axes, that unit accelerations are."""
    xi, across, mass = mass_points(elements)
    accelerations = unit_accelerations(undeformed(elements, xi, across).reshape(-1, 3)).reshape(
        INERTIAL, *mass.shape, 3
    )
    in_element_axes = (accelerations @ elements.C) * mass[..., None]
    return -np.einsum("eqci,aeqc->eia", shape_functions(elements, xi, across), in_element_axes, optimize=True)


def section_loads(elements: Beams) -> Array:
    """(E, 3, 3, 12) of unit accelerations ... + G x, the integral of rho G x x^T over the section, in element axes [N]."""
    G = np.einsum("eck,acd,edl->aekl", elements.C, gradients(), elements.C)
    J = np.zeros((len(elements.length), 3))
    J[:, 1:] = elements.line_mass[:, None] * elements.gyration**2
    loads = np.zeros((len(J), 3, 3, INERTIAL))
    loads[..., INERTIAL - len(G) :] = (G * J[:, None]).transpose(1, 2, 3, 0)
    return loads


def section_forces(elements: Beams, ends: Array, e: Array, spread: Array, xi: Array) -> Array:
    """(E, Q, 6, r) N, Qy, Qz, Mx, My, Mz at xi (Q,), exact where loads vary linearly along the elements.

    ends : (E, 12, r) forces on the ends; e : (E, 12, r) coordinates, both of the centroid line in element axes;
    spread : (E, 3, 3, r) as `section_loads`, whose antisymmetric part is a moment per length
    """
    first, last = -ends[:, :6], ends[:, 6:]
    moment = np.einsum("abc,ecbr->ear", turns(), spread)
    length, xi = elements.length[:, None, None], xi[:, None]
    tension = (elements.EA / elements.length)[:, None] * (e[:, 6] - e[:, 0])
    forces = np.empty((len(length), len(xi), 6, e.shape[2]))
    bubble = 6 * xi * (1 - xi) * (tension - (first[:, 0] + last[:, 0]) / 2)[:, None]
    forces[:, :, 0] = _between(first, last, 0, xi) + bubble
    forces[:, :, 3] = _between(first, last, 3, xi)
    My, slope = _cubic(length, xi, first[:, 4], last[:, 4], first[:, 2] - moment[:, 1], last[:, 2] - moment[:, 1])
    forces[:, :, 4], forces[:, :, 2] = My, slope + moment[:, None, 1]
    Mz, slope = _cubic(length, xi, first[:, 5], last[:, 5], -first[:, 1] - moment[:, 2], -last[:, 1] - moment[:, 2])
    forces[:, :, 5], forces[:, :, 1] = Mz, -slope - moment[:, None, 2]
    return forces


def _between(first: Array, last: Array, k: int, xi: Array) -> Array:
    return first[:, None, k] * (1 - xi) + last[:, None, k] * xi


def _cubic(length: Array, xi: Array, first: Array, last: Array, start: Array, end: Array) -> tuple[Array, Array]:
    """(E, Q, r) the cubic with these values (E, r) and slopes at the ends, and its slope."""
    first, last, start, end = first[:, None], last[:, None], start[:, None], end[:, None]
    rise = last - first
    value = first + rise * xi**2 * (3 - 2 * xi) + length * xi * (1 - xi) * (start * (1 - xi) - end * xi)
    slope = 6 * rise / length * xi * (1 - xi) + start * (1 - 4 * xi + 3 * xi**2) + end * (3 * xi**2 - 2 * xi)
    return value, slope


# ---- work ---------------------------------------------------------------------------------------------------------


def strain_functions(elements: Beams, xi: Array) -> Array:
    """(E, Q, 9, 12) u', v', w', phi, phi' of the coordinates of the centroid line in element axes."""
    slopes, twist = axis_gradients(elements, xi)
    stretch = np.zeros_like(twist)
    stretch[..., 0], stretch[..., 6] = twist[..., 3], twist[..., 9]
    curvatures = rotation_gradients(elements, xi)
    return np.concatenate([stretch, slopes, axis_functions(elements, xi)[1], curvatures], axis=2)


def _work(elements: Beams, forces: Array, spread: Array) -> Array:
    """(E, Q, 9, 9) second derivatives by the strains of the work of section forces (E, Q, 6) and loads in the section."""
    N, Qy, Qz, Mx, My, Mz = np.moveaxis(forces, -1, 0)
    half = np.zeros((*N.shape, 9, 9))
    square = ((elements.EIy + elements.EIz) / elements.EA)[:, None]
    for k, factor in ((1, 1.0), (2, 1.0), (6, square)):
        half[..., k, k] = N * factor / 2
    terms = (
        ((3, 2), Qy), ((5, 0), -Qy), ((3, 4), Qy / 2),
        ((3, 1), -Qz), ((4, 0), Qz), ((3, 5), Qz / 2),
        ((4, 8), -Mx / 2), ((5, 7), Mx / 2),
        ((5, 6), -My / 2), ((3, 8), My / 2),
        ((3, 7), -Mz / 2), ((4, 6), Mz / 2),
    )  # fmt: skip
    for (i, j), value in terms:
        half[..., i, j] += value
    half[..., 3:6, 3:6] += (spread - np.trace(spread, axis1=1, axis2=2)[:, None, None] * np.eye(3))[:, None] / 2
    return half + np.swapaxes(half, -1, -2)


def _summed(strains: Array, work: Array) -> Array:
    n = strains.shape[-1]
    K = strains.reshape(-1, n).T @ (work @ strains).reshape(-1, n)
    return (K + K.T) / 2


def _of_offsets(elements: Beams, ends: Array, turning: Array) -> Array:
    """(n, n) of the forces on the ends (E, 12) at arms from the nodes, which turn by `turning` (E, 2, 3, n)."""
    forces = ends.reshape(-1, 2, 6)[:, :, :3]
    S = forces[..., None] * elements.offset[:, None, None]
    return np.einsum("enki,enkl,enlj->ij", turning, second_order_turn(S), turning, optimize=True)
