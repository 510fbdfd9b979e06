"""Stiffness and consistent mass of isotropic, linear elastic solids.

scikit-fem supplies the shape functions and the quadrature rules of the reference elements; the isoparametric
integrals are formed here over chunks of elements. The three displacement components of a solid share one scalar mass
matrix m, so that M = m (x) I_3 and only m is stored. Degree of freedom 3*node + component; SI units.

Source: K. J. Bathe, Finite Element Procedures (1996), sections 4.2 and 5.3.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np
import scipy.sparse as sp
import skfem
from skfem.quadrature import get_quadrature

from ffr_prep.common.errors import InputError
from ffr_prep.mesh.cells import KINDS
from ffr_prep.mesh.mesh import Block, Mesh
from ffr_prep.model.material import Material

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

# Orders of the quadrature rules. The stiffness is integrated in full (exactly on straight tetrahedra); the mass exactly
# for every shape the element can take: its integrand is N_a N_b det J.
STIFFNESS_ORDER = {"tet4": 1, "tet10": 2, "hex8": 3, "hex20": 5, "hex27": 5}
MASS_ORDER = {"tet4": 2, "tet10": 7, "hex8": 5, "hex20": 9, "hex27": 9}

_TRIANGLE = np.array([(0, 0), (1, 0), (0, 1), (0.5, 0), (0.5, 0.5), (0, 0.5)])
_SQUARE = np.array([(0, 0), (1, 0), (1, 1), (0, 1), (0.5, 0), (1, 0.5), (0.5, 1), (0, 0.5), (0.5, 0.5)])
# Faces by their number of nodes: shape functions, nodes of the reference face in VTK's order, order of the mass rule.
_FACES = {
    3: (skfem.ElementTriP1, _TRIANGLE[:3], 2),
    6: (skfem.ElementTriP2, _TRIANGLE, 7),
    4: (skfem.ElementQuad1, _SQUARE[:4], 5),
    8: (skfem.ElementQuadS2, _SQUARE[:8], 9),
    9: (skfem.ElementQuad2, _SQUARE, 9),
}


@dataclass(frozen=True)
class Rule:
    """Shape functions at quadrature points: weights (Q,), N (Q, k), dN (Q, k, d), nodes in VTK's order."""

    weights: Array
    N: Array
    dN: Array


@cache
def _volume_rule(kind: str, order: int) -> Rule:
    return _rule(getattr(skfem, KINDS[kind].shapes)(), KINDS[kind].nodes, order)


@cache
def _face_rule(k: int) -> Rule:
    element, nodes, order = _FACES[k]
    return _rule(element(), nodes, order)


def _rule(element: skfem.Element, nodes: Array, order: int) -> Rule:
    """The rule of that order, with scikit-fem's shape functions sorted to the nodes (k, d) of the reference element."""
    X, weights = get_quadrature(element.refdom, order)
    theirs = np.linalg.norm(nodes[:, None] - element.doflocs[None], axis=-1).argmin(axis=1)
    evaluated = [element.lbasis(X, i) for i in theirs]
    N = np.stack([np.broadcast_to(value, X.shape[1]) for value, _ in evaluated], axis=-1)
    dN = np.stack([np.broadcast_to(gradient, X.shape) for _, gradient in evaluated], axis=-1)
    return Rule(weights, N, np.ascontiguousarray(dN.transpose(1, 2, 0)))


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
    rule = _volume_rule(chunk.kind, MASS_ORDER[chunk.kind])
    _, volume = _jacobian(points, chunk, rule)
    products = np.einsum("qa,qb->qab", rule.N, rule.N)
    return np.tensordot(volume, products, axes=1)


def _stiffness(points: Array, chunk: _Chunk, lam: Array, mu: Array) -> Array:
    """(e, k, 3, k, 3) element stiffness at [e, a, i, b, j] [N/m].

    K_aibj = integral of lam N_a,i N_b,j + mu N_a,j N_b,i + mu delta_ij N_a,k N_b,k dV
    """
    rule = _volume_rule(chunk.kind, STIFFNESS_ORDER[chunk.kind])
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


@dataclass(frozen=True)
class GradientChunk:
    """Some elements at their stiffness quadrature points (q in all): volume (q,) [m^3], shape gradients, constants."""

    volume: Array
    nodes: Array
    shapes: Array
    lam: Array
    mu: Array

    def gradient(self, field: Array) -> Array:
        """(q, 3, 3, r) d u_m / dx_k at [q, m, k] of nodal fields (N, 3, r)."""
        at_points = np.einsum("eqak,eamr->eqmkr", self.shapes, field[self.nodes], optimize=True)
        return at_points.reshape(-1, 3, 3, field.shape[2])

    def stress(self, field: Array) -> Array:
        """(q, 3, 3, r) Cauchy stress [Pa] of nodal displacements (N, 3, r) [m]."""
        gradient = self.gradient(field)
        strain = 0.5 * (gradient + gradient.transpose(0, 2, 1, 3))
        trace = np.einsum("qkkr->qr", strain)
        return self.lam[:, None, None, None] * trace[:, None, None] * np.eye(3)[:, :, None] + (
            2 * self.mu[:, None, None, None] * strain
        )


def displacement_gradients(mesh: Mesh, material: Materials) -> Iterator[GradientChunk]:
    """The mesh in pieces, ready to differentiate displacement fields."""
    constants = _element_constants(mesh, material)
    for chunk in _chunks(mesh):
        rule = _volume_rule(chunk.kind, STIFFNESS_ORDER[chunk.kind])
        J, volume = _jacobian(mesh.points, chunk, rule)
        shapes = np.matmul(rule.dN, np.linalg.inv(J))
        lam, mu, _ = np.repeat(constants[chunk.elements], volume.shape[1], axis=0).T
        yield GradientChunk(volume.ravel(), chunk.nodes, shapes, lam, mu)


def face_mass(points: Array, faces: Array) -> Array:
    """(F, k, k) integral of N_a N_b dA [m^2] over faces (F, k) of 3, 6, 4, 8 or 9 nodes."""
    rule = _face_rule(faces.shape[1])
    J = np.einsum("fkc,qkd->fqcd", points[faces], rule.dN, optimize=True)
    area = np.linalg.norm(np.cross(J[..., 0], J[..., 1]), axis=-1) * rule.weights
    return np.einsum("fq,qa,qb->fab", area, rule.N, rule.N, optimize=True)


# ---- materials ----------------------------------------------------------------------------------------------------


def _element_constants(mesh: Mesh, material: Materials) -> Array:
    """(E, 3) Lame constants lam, mu [Pa] and density [kg/m^3] of every element."""
    count = sum(len(block.nodes) for block in mesh.blocks)
    if isinstance(material, str):
        raise InputError(f"material is the text {material!r}; write material({material!r}), of ffr_prep.model.material")
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
