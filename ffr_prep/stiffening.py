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

import numpy as np

from ffr_prep.factor import SupportedBody, solve_refined
from ffr_prep.interface import CoupledModel
from ffr_prep.mesh import Mesh
from ffr_prep.solids import Materials, SolidMatrices, displacement_gradients, vector_mass

Array = np.ndarray

PRODUCTS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


def stiffening_matrices(
    mesh: Mesh, material: Materials, matrices: SolidMatrices, model: CoupledModel, held: SupportedBody, Phi: Array
) -> Array:
    """(12 + 6 I, n, n) reduced geometric stiffness per unit load, in the order of `FlexibleBody.stiffening`.

    held : the body under its reference conditions; Phi (N, 3, n) nodal basis

    Raises ComputationError when a static problem fails.
    """
    loads = np.hstack([model.B.T @ inertial_loads(mesh.points, matrices), model.C.toarray().T])
    displacement, _ = solve_refined(held, loads, np.zeros((len(held.C), loads.shape[1])))
    return stiffening_of(mesh, material, (model.B @ displacement).reshape(*mesh.points.shape, -1), Phi)


def stiffening_of(mesh: Mesh, material: Materials, static: Array, Phi: Array) -> Array:
    """(r, n, n) geometric stiffness of the basis Phi (N, 3, n) under r loads with the displacements static (N, 3, r)."""
    fields = np.moveaxis(static, -1, 0)
    n = Phi.shape[2]
    K = np.zeros((len(fields), n, n))
    for chunk in displacement_gradients(mesh, material):
        modes = chunk.gradient(Phi)  # (q, 3, 3, n) d phi_m / dx_k
        for load, field in enumerate(fields):
            stress = chunk.stress(field[..., None])[..., 0]
            weighted = np.einsum("q,qkl,qmlj->qmkj", chunk.volume, stress, modes, optimize=True)
            K[load] += modes.reshape(-1, n).T @ weighted.reshape(-1, n)
    return (K + K.transpose(0, 2, 1)) / 2


def inertial_loads(points: Array, matrices: SolidMatrices) -> Array:
    """(3N, 12) nodal forces of unit accelerations: translation, rotation, products of the angular velocity."""
    count = len(points)
    unit = np.eye(3)
    fields = [np.broadcast_to(unit[k], (count, 3)) for k in range(3)]
    fields += [np.cross(unit[k], points) for k in range(3)]
    fields += [_centripetal(points, k, l) for k, l in PRODUCTS]  # noqa: E741
    return -(vector_mass(matrices.m) @ np.column_stack([field.ravel() for field in fields]))


def _centripetal(points: Array, k: int, l: int) -> Array:  # noqa: E741
    """The coefficient of omega_k omega_l in omega x (omega x u) = omega (omega . u) - omega^2 u."""
    field = np.zeros_like(points)
    field[:, k] += points[:, l]
    if k == l:
        return field - points
    field[:, l] += points[:, k]
    return field
