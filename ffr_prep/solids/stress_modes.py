"""Stress of solids at the nodes of their surface, per elastic coordinate.

The stress of an element is taken where it is most accurate, at the points of the reduced Gauss rule, extended from there
to the nodes and averaged over the elements that meet in a node:

* In each element the stress at the points of the stiffness rule is fitted, by least squares with the weights of the
  rule, by the shape functions of the corners: linear in tetrahedra, trilinear in hexahedra. In hexahedra of second order
  this is the field through the stresses at the 2 x 2 x 2 points, in which they are superconvergent.
* The value at a node is the plain mean of the values of all elements of one material around it, those inside the body
  included. Where materials meet, the surface has the node once for each of them: the stress along their boundary jumps.

A field that is linear in straight elements is recovered exactly; other stresses with an error of second order in the
size of second-order elements, of first order for tet4, whose stress is constant. At re-entrant edges and at the rims of
rigid interfaces the exact stress is infinite and the recovered one grows as the mesh is refined.

Sources: J. Barlow, Int. J. Numer. Meth. Eng. 10 (1976) 243-251 (optimal points); E. Hinton, J. S. Campbell, ibid. 8
(1974) 461-480 (local least squares, then the mean at the nodes).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial

import numpy as np
import scipy.sparse as sp

from ffr_prep.body import TENSOR, Surface
from ffr_prep.common.arrays import Array
from ffr_prep.mesh.boundary import outer_faces
from ffr_prep.mesh.cells import FACE_TRIANGLES, KINDS
from ffr_prep.mesh.mesh import Block, Mesh, surface_triangles
from ffr_prep.mesh.shapes import local_order, quadrature, shape_functions
from ffr_prep.solids.assembly import (
    STIFFNESS_ORDER,
    Chunk,
    Gradients,
    Materials,
    chunks,
    displacement_gradients,
    element_materials,
)
from ffr_prep.solvers.threads import ahead

AVERAGING = (
    "per element a least-squares fit through the integration points, extended to the nodes; there the plain mean over "
    "the elements of one material"
)
_ROWS, _COLUMNS = np.array(TENSOR).T
_LINEAR = {4: "tet4", 5: "pyramid5", 6: "wedge6", 8: "hex8"}  # by corners


def boundary(mesh: Mesh, Phi: Array) -> Surface:
    """The triangulated boundary of the mesh with the basis at its points."""
    points, triangles = surface_triangles(mesh)
    return Surface(mesh.points[points], triangles, Phi[points])


def stressed_boundary(mesh: Mesh, material: Materials, Phi: Array, pairs: tuple[Array, int] | None = None) -> Surface:
    """The triangulated boundary with basis and stress modes at its points; Phi (N, 3, n) at the nodes.

    pairs : first-order displacements and the number of one, of whose pairs with those from it on Phi is the second-order
            displacement: the stress is then theirs, that of the strain of second order included

    Nodes where several materials meet are there once for each. Raises InputError for elements without a material or with
    two.
    """
    outside = surface_triangles(mesh)
    near = _near_surface(mesh, outside[0])
    moduli, of_element = elastic_materials(near, material)
    parts = [_material_boundary(near, outside, of_element == k) for k in range(len(moduli))]
    points = np.concatenate([nodes for nodes, _ in parts])
    owner = np.repeat(np.arange(len(parts)), [len(nodes) for nodes, _ in parts])
    first = np.cumsum([0, *(len(nodes) for nodes, _ in parts)])
    triangles = [corners + start for (_, corners), start in zip(parts, first, strict=False)]
    return Surface(
        points=mesh.points[points],
        triangles=np.concatenate(triangles),
        Phi=Phi[points],
        stress=nodal_stress(near, material, partial(_stress, Phi, pairs), Phi.shape[2], of_element, points, owner),
        moduli=moduli[owner],
    )


def _stress(Phi: Array, pairs: tuple[Array, int] | None, elements: Gradients) -> Array:
    """(q, 3, 3, n)."""
    linear = elements.stress(Phi)
    return linear if pairs is None else linear + elements.stress_of_products(elements.gradient(pairs[0]), pairs[1])


def nodal_stress(
    mesh: Mesh,
    material: Materials,
    stress: Callable[[Gradients], Array],
    fields: int,
    of_element: Array,
    nodes: Array,
    owner: Array,
) -> Array:
    """(P, 6, r) stress [Pa] at nodes (P,), each of one material.

    stress     : (q, 3, 3, r) of some elements at their points; fields : r
    of_element : (E,) number of each element's material; owner (P,) that of each point
    """
    total, count = np.zeros((len(nodes), 6 * fields)), np.zeros(len(nodes))
    place = np.full((owner.max(initial=0) + 1, len(mesh.points)), -1)
    place[owner, nodes] = np.arange(len(nodes))

    def of_chunk(chunk: Chunk) -> tuple[Array, Array, Array]:
        """The points that some elements have, the sum of what they say there, and how many say it."""
        target = place[of_element[chunk.elements, None], chunk.nodes].ravel()
        wanted = np.flatnonzero(target >= 0)
        points, row = np.unique(target[wanted], return_inverse=True)
        gather = sp.csr_array((np.ones(len(wanted)), (row, wanted)), shape=(len(points), len(target)))
        said = _at_element_nodes(chunk, stress(displacement_gradients(mesh.points, chunk)))
        return points, gather @ said, gather.sum(axis=1)

    for points, said, times in ahead(of_chunk, chunks(mesh, material)):
        total[points] += said
        count[points] += times
    return total.reshape(len(nodes), 6, -1) / count[:, None, None]


def _at_element_nodes(chunk: Chunk, stress: Array) -> Array:
    """(e k, 6 r) stress (q, 3, 3, r) of each element extended to its own nodes."""
    elements, k = chunk.nodes.shape
    at_points = stress[:, _ROWS, _COLUMNS].reshape(elements, -1, 6 * stress.shape[3])
    return np.asarray(np.matmul(extrapolation(chunk.kind), at_points).reshape(elements * k, -1))


@cache
def extrapolation(kind: str) -> Array:
    """(k, Q) values at the nodes of an element from those at the Q points of its stiffness rule.

    Hinton & Campbell (1974): least squares of the corners' shape functions, with the weights of the rule.
    """
    X, weights = quadrature(kind, STIFFNESS_ORDER[kind])
    if weights.size == 1:
        return np.ones((KINDS[kind].size, 1))
    at_points, at_nodes = _corner_functions(kind, X), _corner_functions(kind, KINDS[kind].nodes.T)
    weighted = at_points * weights[:, None]
    return at_nodes @ np.linalg.solve(at_points.T @ weighted, weighted.T)


def _corner_functions(kind: str, X: Array) -> Array:
    """(p, c) shape functions of the corners at X (3, p) of the reference element."""
    linear = _LINEAR[KINDS[kind].corners]
    element = shape_functions(linear)
    return np.stack([np.broadcast_to(element.lbasis(X, i)[0], X.shape[1]) for i in local_order(linear)], axis=-1)


# ---- which elements, which materials ------------------------------------------------------------------------------


def _near_surface(mesh: Mesh, nodes: Array) -> Mesh:
    """The elements that have one of the nodes; the nodes keep their numbers."""
    outside = np.zeros(len(mesh.points), bool)
    outside[nodes] = True
    return picked(mesh, np.concatenate([outside[block.nodes].any(axis=1) for block in mesh.blocks]))


def picked(mesh: Mesh, keep: Array) -> Mesh:
    """Some elements of the mesh with their volume groups."""
    new = np.cumsum(keep) - 1
    of_blocks = np.split(keep, np.cumsum([len(block.nodes) for block in mesh.blocks])[:-1])
    blocks = [Block(block.kind, block.nodes[here]) for block, here in zip(mesh.blocks, of_blocks, strict=True)]
    groups = {name: new[of[keep[of]]] for name, of in mesh.volume_groups.items()}
    return replace(mesh, blocks=tuple(blocks), volume_groups=groups, face_groups={}, node_groups={})


def elastic_materials(mesh: Mesh, material: Materials) -> tuple[Array, Array]:
    """(m, 2) engineering constants of the materials that differ elastically, and their number for each element.

    The constants are Young's modulus [Pa] and Poisson's ratio, zeros where the material is anisotropic.
    """
    materials, of_element = element_materials(mesh, material)
    used, of_element = np.unique(of_element, return_inverse=True)
    tensors = [materials[k].elasticity_tensor().ravel() for k in used]
    _, first, same = np.unique(tensors, axis=0, return_index=True, return_inverse=True)
    return np.array([materials[used[k]].engineering_constants() for k in first]), same.ravel()[of_element]


def _material_boundary(near: Mesh, outside: tuple[Array, Array], own: Array) -> tuple[Array, Array]:
    """(P,) nodes and (T, 3) triangles, those of the boundary `outside` that belong to some of the elements."""
    if own.all():
        return outside
    pairs = [(block.kind, block.nodes) for block in picked(near, own).blocks if len(block.nodes)]
    theirs = np.concatenate([faces[:, FACE_TRIANGLES[faces.shape[1]]].reshape(-1, 3) for faces in outer_faces(pairs)])
    nodes, triangles = outside
    shared = _in(np.sort(theirs, axis=1), np.sort(nodes[triangles], axis=1))
    points, corners = np.unique(theirs[shared], return_inverse=True)
    return points, corners.reshape(-1, 3)


def _in(rows: Array, known: Array) -> Array:
    """(R,) whether each row is one of the known rows."""
    _, number = np.unique(np.concatenate([known, rows]), axis=0, return_inverse=True)
    return np.isin(number.ravel()[len(known) :], number.ravel()[: len(known)])
