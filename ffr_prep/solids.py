"""Stiffness and consistent mass of isotropic, linear elastic solids.

scikit-fem supplies the shape functions and the quadrature rules of the reference elements; the isoparametric
integrals are formed here over chunks of elements. The three displacement components of a solid share one scalar mass
matrix m, so that M = m (x) I_3 and only m is stored. Degree of freedom 3*node + component; SI units.

Source: K. J. Bathe, Finite Element Procedures (1996), sections 4.2 and 5.3.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
import scipy.sparse as sp
import skfem
from skfem.quadrature import get_quadrature

from ffr_prep.errors import InputError
from ffr_prep.material import Material
from ffr_prep.mesh import Block, Mesh

Array = np.ndarray
Materials = Material | Mapping[str, Material]

_CHUNK = 2048


@dataclass(frozen=True)
class SolidMatrices:
    """K : (3N, 3N) stiffness [N/m], m : (N, N) scalar consistent mass [kg]; both sparse and symmetric."""

    K: sp.csr_array
    m: sp.csr_array


def assemble(mesh: Mesh, material: Materials) -> SolidMatrices:
    """K and m of the mesh, of one material or of materials by volume group.

    Raises InputError for an element without a material or with two, and for an element turned inside out.
    """
    constants = _element_constants(mesh, material)
    pattern = _pattern(mesh)
    keys = _keys(pattern)
    K = np.zeros((3, 3, pattern.indices.size))
    m = np.zeros(pattern.indices.size)
    for chunk in _chunks(mesh):
        lam, mu, rho = constants[chunk.elements].T
        slots = _slots(keys, len(mesh.points), chunk.nodes)
        np.add.at(m, slots, (_mass(mesh.points, chunk) * rho[:, None, None]).ravel())
        stiffness = _stiffness(mesh.points, chunk, lam, mu)
        for i, j in np.ndindex(3, 3):
            np.add.at(K[i, j], slots, stiffness[:, :, i, :, j].ravel())
    return SolidMatrices(
        _from_blocks(pattern, K), sp.csr_array((m, pattern.indices, pattern.indptr), shape=pattern.shape)
    )


def vector_mass(m: sp.sparray) -> sp.csr_array:
    """M = m (x) I_3, (3N, 3N) [kg]: the mass of the three displacement components."""
    return sp.csr_array(sp.kron(m, sp.eye_array(3), format="csr"))


# ---- reference elements -------------------------------------------------------------------------------------------

_EDGES_HEX = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
_EDGES_TET = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
_FACES_HEX = [(0, 3, 7, 4), (1, 2, 6, 5), (0, 1, 5, 4), (3, 2, 6, 7), (0, 1, 2, 3), (4, 5, 6, 7)]
_CORNERS_TET = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
_CORNERS_HEX = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
_CORNERS_TRI = [(0, 0), (1, 0), (0, 1)]
_CORNERS_QUAD = [(0, 0), (1, 0), (1, 1), (0, 1)]
_EDGES_TRI = [(0, 1), (1, 2), (2, 0)]
_EDGES_QUAD = [(0, 1), (1, 2), (2, 3), (3, 0)]
_ALL_HEX = [tuple(range(8))]
_ALL_QUAD = [tuple(range(4))]


@dataclass(frozen=True)
class ElementKind:
    """A reference element: scikit-fem's shape functions, the corners, and the corners whose mean each further node is.

    The nodes are in meshio's (VTK's) order. The order of the stiffness rule is that of full integration; the mass
    rule is exact for every shape the element can take (integrand N_a N_b det J).
    """

    shapes: Callable[[], skfem.Element]
    corners: Sequence[tuple[int, ...]]
    means: Sequence[tuple[int, ...]]
    stiffness_order: int
    mass_order: int


VOLUMES = {
    "tet4": ElementKind(skfem.ElementTetP1, _CORNERS_TET, [], 1, 2),
    "tet10": ElementKind(skfem.ElementTetP2, _CORNERS_TET, _EDGES_TET, 2, 7),
    "hex8": ElementKind(skfem.ElementHex1, _CORNERS_HEX, [], 3, 5),
    "hex20": ElementKind(skfem.ElementHexS2, _CORNERS_HEX, _EDGES_HEX, 5, 9),
    "hex27": ElementKind(skfem.ElementHex2, _CORNERS_HEX, [*_EDGES_HEX, *_FACES_HEX, *_ALL_HEX], 5, 9),
}
FACES = {
    3: ElementKind(skfem.ElementTriP1, _CORNERS_TRI, [], 1, 2),
    6: ElementKind(skfem.ElementTriP2, _CORNERS_TRI, _EDGES_TRI, 2, 7),
    4: ElementKind(skfem.ElementQuad1, _CORNERS_QUAD, [], 3, 5),
    8: ElementKind(skfem.ElementQuadS2, _CORNERS_QUAD, _EDGES_QUAD, 5, 9),
    9: ElementKind(skfem.ElementQuad2, _CORNERS_QUAD, [*_EDGES_QUAD, *_ALL_QUAD], 5, 9),
}


@dataclass(frozen=True)
class Rule:
    """Shape functions at quadrature points: weights (Q,), N (Q, k), dN (Q, k, d), nodes in meshio's order."""

    weights: Array
    N: Array
    dN: Array


@cache
def _rule(kind: str | int, order: int) -> Rule:
    element_kind = VOLUMES[kind] if isinstance(kind, str) else FACES[kind]
    element = element_kind.shapes()
    X, weights = get_quadrature(element.refdom, order)
    evaluated = [element.lbasis(X, i) for i in _scikit_fem_order(element_kind, element.doflocs)]
    N = np.stack([np.broadcast_to(value, X.shape[1]) for value, _ in evaluated], axis=-1)
    dN = np.stack([np.broadcast_to(gradient, X.shape) for _, gradient in evaluated], axis=-1)
    return Rule(weights, N, np.ascontiguousarray(dN.transpose(1, 2, 0)))


def _scikit_fem_order(kind: ElementKind, doflocs: Array) -> Array:
    """For each node in meshio's order, the index of scikit-fem's shape function at the same reference point."""
    corners = np.array(kind.corners, float)
    nodes = np.vstack([corners] + [corners[list(of)].mean(axis=0)[None] for of in kind.means])
    distance = np.linalg.norm(nodes[:, None] - doflocs[None], axis=-1)
    return np.argmin(distance, axis=1)


# ---- element integrals --------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Chunk:
    """Some elements of one kind: their numbers (e,) in the mesh and their nodes (e, k)."""

    kind: str
    elements: Array
    nodes: Array


def _chunks(mesh: Mesh) -> Iterator[_Chunk]:
    first = 0
    for block in mesh.blocks:
        for start in range(0, len(block.nodes), _CHUNK):
            nodes = block.nodes[start : start + _CHUNK]
            yield _Chunk(block.kind, first + start + np.arange(len(nodes)), nodes)
        first += len(block.nodes)


def _jacobian(points: Array, chunk: _Chunk, rule: Rule) -> tuple[Array, Array]:
    """dx/dX (e, Q, 3, 3) at [.., component, reference direction], and the volume per quadrature point (e, Q) [m^3]."""
    J = np.einsum("ekc,qkd->eqcd", points[chunk.nodes], rule.dN, optimize=True)
    determinant = np.linalg.det(J)
    worst = np.unravel_index(np.argmin(determinant), determinant.shape)[0]
    if not determinant[worst].min() > 0:
        centre = points[chunk.nodes[worst]].mean(axis=0)
        raise InputError(
            f"element {chunk.elements[worst]} ({chunk.kind}, near {centre} m) is degenerate or turned inside out "
            f"(Jacobian {determinant[worst].min():.3g}): repair the mesh there, or check its node order"
        )
    return J, determinant * rule.weights


def _mass(points: Array, chunk: _Chunk) -> Array:
    """(e, k, k) integral of N_a N_b dV [m^3]."""
    rule = _rule(chunk.kind, VOLUMES[chunk.kind].mass_order)
    _, volume = _jacobian(points, chunk, rule)
    products = np.einsum("qa,qb->qab", rule.N, rule.N)
    return np.tensordot(volume, products, axes=1)


def _stiffness(points: Array, chunk: _Chunk, lam: Array, mu: Array) -> Array:
    """(e, k, 3, k, 3) element stiffness at [e, a, i, b, j] [N/m].

    K_aibj = integral of lam N_a,i N_b,j + mu N_a,j N_b,i + mu delta_ij N_a,k N_b,k dV
    """
    rule = _rule(chunk.kind, VOLUMES[chunk.kind].stiffness_order)
    J, volume = _jacobian(points, chunk, rule)
    gradient = np.matmul(rule.dN, np.linalg.inv(J)) * np.sqrt(volume)[..., None, None]
    count, points_per_element, k, _ = gradient.shape
    G = gradient.reshape(count, points_per_element, 3 * k)
    S = np.matmul(G.transpose(0, 2, 1), G).reshape(count, k, 3, k, 3)
    trace = np.einsum("eaibi->eab", S)
    K = lam[:, None, None, None, None] * S + mu[:, None, None, None, None] * S.transpose(0, 1, 4, 3, 2)
    for i in range(3):
        K[:, :, i, :, i] += mu[:, None, None] * trace
    return K


def face_mass(points: Array, faces: Array) -> Array:
    """(F, k, k) integral of N_a N_b dA [m^2] over faces (F, k) of 3, 6, 4, 8 or 9 nodes."""
    k = faces.shape[1]
    rule = _rule(k, FACES[k].mass_order)
    J = np.einsum("fkc,qkd->fqcd", points[faces], rule.dN, optimize=True)
    area = np.linalg.norm(np.cross(J[..., 0], J[..., 1]), axis=-1) * rule.weights
    return np.einsum("fq,qa,qb->fab", area, rule.N, rule.N, optimize=True)


# ---- materials ----------------------------------------------------------------------------------------------------


def _element_constants(mesh: Mesh, material: Materials) -> Array:
    """(E, 3) Lame constants lam, mu [Pa] and density [kg/m^3] of every element."""
    count = sum(len(block.nodes) for block in mesh.blocks)
    if isinstance(material, Material):
        return np.tile(_constants(material), (count, 1))
    constants, uses = np.zeros((count, 3)), np.zeros(count, int)
    for group, of_group in material.items():
        if group not in mesh.volume_groups:
            raise InputError(f"material {of_group.name!r} is for volume group {group!r}; the mesh has {_known(mesh)}")
        constants[mesh.volume_groups[group]] = _constants(of_group)
        uses[mesh.volume_groups[group]] += 1
    if (uses != 1).any():
        wrong = int(np.argmax(uses != 1))
        raise InputError(
            f"element {wrong} has {uses[wrong]} materials ({np.sum(uses != 1)} of {count} elements have none or "
            f"several): give every element one material through the volume groups {_known(mesh)}"
        )
    return constants


def _constants(material: Material) -> tuple[float, float, float]:
    E, nu = material.E, material.nu
    return E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu)), material.rho


def _known(mesh: Mesh) -> str:
    return ", ".join(repr(name) for name in mesh.volume_groups) or "none"


# ---- sparse assembly ----------------------------------------------------------------------------------------------


def _pattern(mesh: Mesh) -> sp.csr_array:
    """(N, N) pattern of nodes that share an element; row indices sorted."""
    count = len(mesh.points)
    pattern = sp.csr_array((count, count), dtype=bool)
    for block in mesh.blocks:
        incidence = _incidence(block, count)
        pattern = pattern + (incidence.T @ incidence).astype(bool)
    pattern.sort_indices()
    return pattern


def _incidence(block: Block, count: int) -> sp.csr_array:
    elements, k = block.nodes.shape
    ends = np.arange(0, elements * k + 1, k)
    return sp.csr_array((np.ones(elements * k), block.nodes.ravel(), ends), shape=(elements, count))


def _keys(pattern: sp.csr_array) -> Array:
    """One ascending number per entry of the pattern: row * N + column."""
    count = pattern.shape[0]
    return np.repeat(np.arange(count), np.diff(pattern.indptr)) * count + pattern.indices


def _slots(keys: Array, count: int, nodes: Array) -> Array:
    """(e*k*k,) position in the pattern's data of every pair of nodes of every element."""
    pairs = nodes[:, :, None].astype(np.int64) * count + nodes[:, None, :]
    return np.searchsorted(keys, pairs.ravel())


def _from_blocks(pattern: sp.csr_array, K: Array) -> sp.csr_array:
    blocks = np.ascontiguousarray(K.transpose(2, 0, 1))
    shape = (3 * pattern.shape[0], 3 * pattern.shape[1])
    return sp.csr_array(sp.bsr_array((blocks, pattern.indices, pattern.indptr), shape=shape).tocsr())
