"""Geometric stiffening of solids, by load.

A load stresses the body; the stress sigma_0 changes its stiffness by

    K_sigma,ij = integral of sigma_0,kl (d phi_m,i / dx_k) (d phi_m,j / dx_l) dV,

which is linear in the load. One reduced matrix is stored for each unit load: the translational acceleration of the body
frame (less gravity), its angular acceleration, the six products of its angular velocity, and the force and moment at
each interface. A simulation combines them with the accelerations, rates and reactions of the moment. Each static problem
is solved under the body's reference conditions, so the reactions of the supports belong to the load; in the sum of all
loads, which is in equilibrium, they cancel.

Source: Wallrapp & Schwertassek, Representation of geometric stiffening in multibody system simulation (1991);
Bathe, Finite Element Procedures (1996), section 6.2 (the linearised stress term).
"""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from ffr_prep.body.accelerations import unit_accelerations
from ffr_prep.common.arrays import Array
from ffr_prep.mesh.mesh import Mesh
from ffr_prep.solids.assembly import (
    Chunk,
    Materials,
    SolidMatrices,
    chunks,
    displacement_gradients,
    vector_mass,
)


def stiffening_of(mesh: Mesh, material: Materials, static: Array, Phi: Array) -> Array:
    """(r, n, n) geometric stiffness of the basis Phi (N, 3, n) under r loads with the displacements static (N, 3, r)."""
    with ThreadPoolExecutor(os.cpu_count()) as pool:  # summed in the order of the elements, whoever is first
        parts = pool.map(lambda chunk: _of_chunk(mesh.points, chunk, static, Phi), chunks(mesh, material))
        K = sum(parts, np.zeros((static.shape[2], Phi.shape[2], Phi.shape[2])))
    return (K + K.transpose(0, 2, 1)) / 2


def _of_chunk(points: Array, chunk: Chunk, static: Array, Phi: Array) -> Array:
    """The part of some elements: sums over their points q, over m and over k."""
    elements = displacement_gradients(points, chunk)
    n = Phi.shape[2]
    modes = np.ascontiguousarray(elements.gradient(Phi).transpose(0, 2, 1, 3)).reshape(-1, 3, 3 * n)  # [q, k, m n]
    stress = np.ascontiguousarray(np.moveaxis(elements.stress(static) * elements.volume[:, None, None, None], 3, 0))
    return np.stack([modes.reshape(-1, n).T @ np.matmul(of_load, modes).reshape(-1, n) for of_load in stress])


def inertial_loads(points: Array, matrices: SolidMatrices) -> Array:
    """(3N, 12) nodal forces of unit accelerations: translation, rotation, products of the angular velocity."""
    return np.asarray(-(vector_mass(matrices.m) @ unit_accelerations(points).reshape(12, -1).T))
