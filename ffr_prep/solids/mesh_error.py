"""The error that the size of the elements leaves in a deformation shape of a solid.

The stress of a finite-element solution jumps from element to element, and at free surfaces it does not vanish. One that is
extended to the nodes and averaged there (`ffr_prep.solids.stress_modes`), without traction where the surface is free, is
nearer to the truth. The strain energy of the difference is the one that the mesh adds to the shape: of a shape under given
loads a(u_h, u_h) - a(u, u) = a(u_h - u, u_h - u) in the energy product a, and the square of a natural frequency is too high
by that share of its strain energy.

Without the free surfaces, a prism of one element across would twist without any jump of stress, and be 13 to 76 % too stiff.

Sources: O. C. Zienkiewicz, J. Z. Zhu, Int. J. Numer. Meth. Eng. 24 (1987) 337-357 (the estimator); G. Strang, G. J. Fix, An
Analysis of the Finite Element Method (1973), sections 1.6 and 6.3 (energy and eigenvalues).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache, partial

import numpy as np

from ffr_prep.body import TENSOR
from ffr_prep.common.arrays import Array
from ffr_prep.mesh.mesh import Mesh, boundary_faces, region_nodes
from ffr_prep.mesh.shapes import local_order, quadrature, shape_functions
from ffr_prep.solids.assembly import STIFFNESS_ORDER, Chunk, Materials, chunks, displacement_gradients
from ffr_prep.solids.stress_modes import elastic_materials, nodal_stress, picked
from ffr_prep.solvers.threads import ahead

_ROWS, _COLUMNS = np.array(TENSOR).T
_TWICE = np.where(_ROWS == _COLUMNS, 1.0, 2.0)  # how often a component is in the tensor
_SMOOTH = 0.1  # of the mean square of the normals at a node: where more points aside, there is an edge


def added_energy(mesh: Mesh, material: Materials, loaded: Sequence[str], fields: Array) -> Array:
    """(r,) twice the strain energy [J] that the mesh adds to the displacement fields (N, 3, r) [m].

    loaded : groups of faces or nodes that carry forces; the rest of the surface is free
    """
    of_element = elastic_materials(mesh, material)[1]
    free, along = _free_surface(mesh, loaded)
    each = (picked(mesh, of_element == number) for number in np.unique(of_element))
    return np.sum([_of_material(part, material, free, along, fields) for part in each], axis=0)


def _of_material(mesh: Mesh, material: Materials, free: Array, along: Array, fields: Array) -> Array:
    """The same of elements of one material; the surface at the nodes `free` has the directions `along` it."""
    nodes = np.unique(np.concatenate([block.nodes.ravel() for block in mesh.blocks]))
    one, of_nodes = np.zeros(sum(len(block.nodes) for block in mesh.blocks), int), np.zeros(len(nodes), int)
    smooth = np.zeros((len(mesh.points), 6, fields.shape[2]))
    smooth[nodes] = nodal_stress(
        mesh, material, lambda some: some.stress(fields), fields.shape[2], one, nodes, of_nodes
    )
    smooth[free] = _without_traction(smooth[free], along)
    return np.sum(list(ahead(partial(_of_chunk, mesh.points, smooth, fields), chunks(mesh, material))), axis=0)


def _of_chunk(points: Array, smooth: Array, fields: Array, chunk: Chunk) -> Array:
    """(r,) of some elements, with the smoothed stress (N, 6, r) at the nodes."""
    elements = displacement_gradients(points, chunk)
    stress = elements.stress(fields)[:, _ROWS, _COLUMNS]
    better = np.einsum("qa,eacr->eqcr", _at_points(chunk.kind), smooth[chunk.nodes], optimize=True)
    difference = better.reshape(stress.shape) - stress
    strain = np.einsum("ij,qjr->qir", _flexibility(chunk), difference, optimize=True)
    return np.asarray(np.einsum("q,i,qir,qir->r", elements.volume, _TWICE, difference, strain, optimize=True))


@cache
def _at_points(kind: str) -> Array:
    """(Q, k) shape functions at the points of the stiffness rule."""
    element = shape_functions(kind)
    X, _ = quadrature(kind, STIFFNESS_ORDER[kind])
    return np.stack([np.broadcast_to(element.lbasis(X, i)[0], X.shape[1]) for i in local_order(kind)], axis=-1)


def _flexibility(chunk: Chunk) -> Array:
    """(6, 6) strain from stress, components of the tensors in the order of `TENSOR` [1/Pa]."""
    C = chunk.material.elasticity_tensor()
    return np.linalg.inv(C[_ROWS, _COLUMNS][:, _ROWS, _COLUMNS] * _TWICE)


# ---- free surfaces ------------------------------------------------------------------------------------------------


def _free_surface(mesh: Mesh, loaded: Sequence[str]) -> tuple[Array, Array]:
    """(F,) nodes of the surface that carry no force, and (F, 3, 3) the projection on the directions along it there.

    Two directions where the surface is smooth, one along an edge, none at a corner.
    """
    squares = np.zeros((len(mesh.points), 3, 3))
    for faces in boundary_faces(mesh):
        first, second, third = mesh.points[faces[:, :3]].transpose(1, 0, 2)
        normal = np.cross(second - first, third - first)
        of_face = normal[:, :, None] * normal[:, None] / np.linalg.norm(normal, axis=1)[:, None, None]
        np.add.at(squares, faces, of_face[:, None])
    outside = np.asarray(squares.any(axis=(1, 2)))
    for name in loaded:
        outside[region_nodes(mesh, name)] = False
    sizes, axes = np.linalg.eigh(squares[outside])
    kept = sizes <= _SMOOTH * sizes[:, -1:]
    return np.flatnonzero(outside), np.einsum("nia,na,nja->nij", axes, kept, axes)


def _without_traction(stress: Array, along: Array) -> Array:
    """(F, 6, r) the part of a stress (F, 6, r) that acts along the directions (F, 3, 3) alone."""
    whole = np.empty((len(stress), 3, 3, stress.shape[2]))
    whole[:, _ROWS, _COLUMNS] = whole[:, _COLUMNS, _ROWS] = stress
    return np.asarray(np.einsum("nij,njkr,nkl->nilr", along, whole, along, optimize=True)[:, _ROWS, _COLUMNS])
