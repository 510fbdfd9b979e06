"""The second-order displacement of solids and the stress that comes with it (`ffr_prep.model.second_order`).

With the gradients g_i = du/dx of two first-order displacements the stress of their products is C (g_i^T g_j + g_j^T g_i)/2;
its nodal forces are F_ij, and with the linear stress of u_ij it is the second derivative of the (second
Piola-Kirchhoff) stress by q_i and q_j, which no rigid motion changes.

Source: Bathe, Finite Element Procedures (1996), section 6.2.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ffr_prep.body import Surface
from ffr_prep.common.arrays import Array
from ffr_prep.mesh.mesh import Mesh, surface_triangles
from ffr_prep.model.coupled import CoupledModel
from ffr_prep.model.region_rotations import (
    MeanRegion,
    RigidRegion,
    known_second_order,
    second_order_forces,
    turned_nodes,
)
from ffr_prep.model.second_order import SecondOrder
from ffr_prep.solids.assembly import Materials
from ffr_prep.solids.stiffening import forces_of_products
from ffr_prep.solids.stress_modes import stressed_boundary


def second_order(
    mesh: Mesh, material: Materials, model: CoupledModel, regions: Sequence[RigidRegion | MeanRegion], basis: Array
) -> SecondOrder:
    """That of the basis (Z, n) of a coupled mesh."""

    def field(z: Array) -> Array:
        return np.asarray((model.B @ z).reshape(*mesh.points.shape, z.shape[1]))

    Phi = field(basis)
    points, triangles = surface_triangles(mesh)

    def forces(some: range) -> Array:
        turning = [second_order_forces(regions, basis[:, i], basis[:, i:]) for i in some]
        return np.asarray(model.B.T @ forces_of_products(mesh, material, Phi, some) + np.hstack(turning))

    def whole(i: int, z: Array) -> Array:
        return field(z) + turned_nodes(regions, len(mesh.points), basis[:, i], basis[:, i:])

    return SecondOrder(
        known=known_second_order(regions, model, basis),
        forces=forces,
        surface=lambda i, z: Surface(mesh.points[points], triangles, whole(i, z)[points]),
        stressed=lambda i, z: stressed_boundary(mesh, material, whole(i, z), (Phi, i)),
    )
