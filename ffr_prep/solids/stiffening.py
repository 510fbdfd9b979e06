"""Geometric stiffening of solids, by load.

A load stresses the body; the stress sigma_0 changes its stiffness by

    K_sigma,ij = integral of sigma_0,kl (d phi_m,i / dx_k) (d phi_m,j / dx_l) dV,

which is linear in the load. One reduced matrix is stored for each unit load: the translational acceleration of the body
frame (less gravity), its angular acceleration, the six products of its angular velocity, and the force and moment at
each interface. They are second derivatives of what these loads work on, the second-order displacement
(`ffr_prep.model.second_order`), which is what a simulation takes them for. Each static problem
is solved under the body's reference conditions, so the reactions of the supports belong to the load; in the sum of all
loads, which is in equilibrium, they cancel.

Source: Wallrapp & Schwertassek, Representation of geometric stiffening in multibody system simulation (1991);
Bathe, Finite Element Procedures (1996), section 6.2 (the linearised stress term).
"""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import scipy.sparse as sp

from ffr_prep.body.accelerations import unit_accelerations
from ffr_prep.common.arrays import Array
from ffr_prep.mesh.mesh import Mesh
from ffr_prep.solids.assembly import (
    Chunk,
    Materials,
    SolidMatrices,
    chunks,
    displacement_gradients,
)
from ffr_prep.solvers.threads import product


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


def forces_of_products(mesh: Mesh, material: Materials, Phi: Array, some: range) -> Array:
    """(3N, ...) the geometric stiffness of pairs of Phi (N, 3, n) as a linear form of the static displacement: nodal forces
    that the stress of their products makes; of each of some with those from it on."""
    total = np.zeros((len(mesh.points), 3 * sum(Phi.shape[2] - i for i in some)))
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        parts = pool.map(lambda chunk: _forces_of_chunk(mesh.points, chunk, Phi, some), chunks(mesh, material))
        for nodes, forces in parts:
            total[nodes] += forces
    return total.reshape(3 * len(total), -1)


def _forces_of_chunk(points: Array, chunk: Chunk, Phi: Array, some: range) -> tuple[Array, Array]:
    """The nodes (p,) of some elements and the forces (p, 3 ...) on them."""
    elements = displacement_gradients(points, chunk)
    gradient = elements.gradient(Phi)
    of_each = [elements.forces(elements.stress_of_products(gradient, i)) for i in some]
    forces = np.concatenate(of_each, axis=3).reshape(chunk.nodes.size, -1)
    nodes, place = np.unique(chunk.nodes, return_inverse=True)
    columns = np.arange(chunk.nodes.size)
    gather = sp.csr_array((np.ones(columns.size), (place.ravel(), columns)), shape=(nodes.size, columns.size))
    return nodes, gather @ forces


def inertial_loads(points: Array, matrices: SolidMatrices) -> Array:
    """(3N, 12) nodal forces of unit accelerations: translation, rotation, products of the angular velocity."""
    fields = unit_accelerations(points).transpose(1, 0, 2).reshape(len(points), -1)
    momenta = product(matrices.m, fields).reshape(len(points), 12, 3)
    return np.asarray(-momenta.transpose(0, 2, 1).reshape(-1, 12))
