"""Stiffness and consistent mass of linear elastic solids, assembled by scikit-fem.

The bilinear forms are scalar, one for each block K_ij of the displacement components i >= j and one for the mass: the
three components of a solid share one scalar mass matrix m, so that M = m (x) I_3 and only m is stored. Elements are taken
some at a time, each time of one kind and one material. Degree of freedom 3*node + component; SI units.

Source: K. J. Bathe, Finite Element Procedures (1996), sections 4.2 and 5.3.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial

import numba
import numpy as np
import scipy.sparse as sp
import skfem

from ffr_prep.common.arrays import Array
from ffr_prep.common.compile_cache import check_compiled_code
from ffr_prep.common.errors import InputError
from ffr_prep.mesh.mesh import Mesh
from ffr_prep.mesh.shapes import determinants, local_order, mapping, quadrature, scalar_basis
from ffr_prep.model.material import AnisotropicMaterial, Material, Solid
from ffr_prep.solvers.threads import ahead, finish, pieces, threads

check_compiled_code()

Materials = Solid | Mapping[str, Solid]

_CHUNK = 4096

# Orders of the quadrature rules. The stiffness is integrated in full (exactly on straight tetrahedra); the mass exactly
# for every shape the element can take: its integrand is N_a N_b det J.
STIFFNESS_ORDER = {"tet4": 1, "tet10": 2, "hex8": 3, "hex20": 5, "hex27": 5}
STIFFNESS_ORDER |= {"wedge6": 3, "wedge15": 5, "wedge18": 5, "pyramid5": 3, "pyramid13": 5}
MASS_ORDER = {"tet4": 2, "tet10": 7, "hex8": 5, "hex20": 9, "hex27": 9}
MASS_ORDER |= {"wedge6": 5, "wedge15": 9, "wedge18": 9, "pyramid5": 5, "pyramid13": 9}


@dataclass(frozen=True)
class SolidMatrices:
    """K : (3N, 3N) stiffness [N/m], m : (N, N) scalar consistent mass [kg]; both sparse and symmetric."""

    K: sp.csr_array
    m: sp.csr_array


def assemble(mesh: Mesh, material: Materials) -> SolidMatrices:
    """K and m of the mesh, of one material or of materials by volume group.

    Raises InputError for an element without a material or with two, and for an element turned inside out.
    """
    pattern = _pattern(mesh)
    K, m = np.zeros((6, pattern.nnz)), np.zeros(pattern.nnz)
    for places, mass, stiffness in ahead(partial(_of_chunk, mesh.points, pattern), chunks(mesh, material)):
        _add(m, places, mass)
        for block, of_block in zip(K, stiffness, strict=True):
            _add(block, places, of_block)
    return SolidMatrices(
        _from_blocks(pattern, K), sp.csr_array((m, pattern.indices, pattern.indptr), shape=pattern.shape)
    )


def _of_chunk(points: Array, pattern: sp.csr_array, chunk: Chunk) -> tuple[Array, Array, list[Array]]:
    """The numbers of pairs of nodes (e k k,), and for each its mass and the six blocks K_ij, i >= j, of its stiffness."""
    mass = mass_form(chunk.material.rho).elemental(_basis(points, chunk, MASS_ORDER))
    basis, C = _basis(points, chunk, STIFFNESS_ORDER), chunk.material.elasticity_tensor()
    blocks = zip(*np.tril_indices(3), strict=True)
    places = numbers_of_pairs(pattern.indptr, pattern.indices, *mass.indices)
    return places, mass.data, [stiffness_form(C[i, :, j]).elemental(basis).data for i, j in blocks]


@numba.njit(cache=True, nogil=True)
def numbers_of_pairs(indptr, indices, rows, columns):  # type: ignore[no-untyped-def]
    """(p,) where the entries (rows, columns) of a sparse matrix are, whose columns ascend in every row."""
    found = np.empty(rows.size, np.int64)
    for i in range(rows.size):
        first, last = indptr[rows[i]], indptr[rows[i] + 1]
        while first < last:
            middle = (first + last) // 2
            if indices[middle] < columns[i]:
                first = middle + 1
            else:
                last = middle
        found[i] = first
    return found


def stiffness_form(C: Array) -> skfem.BilinearForm:
    """The block K_ij of scalar shape functions: integral of C_kl d_k psi d_l phi dV with C_kl = C_ikjl (3, 3) [Pa]."""
    terms = [(C[a, b], a, b) for a, b in zip(*np.nonzero(C), strict=True)]
    return skfem.BilinearForm(lambda phi, psi, _: sum(c * (psi.grad[a] * phi.grad[b]) for c, a, b in terms))


def mass_form(rho: float) -> skfem.BilinearForm:
    """The scalar mass: integral of rho phi psi dV."""
    return skfem.BilinearForm(lambda phi, psi, _: rho * (phi * psi))


def vector_mass(m: sp.sparray) -> sp.csr_array:
    """M = m (x) I_3, (3N, 3N) [kg]: the mass of the three displacement components."""
    m = sp.csr_array(m)
    counts = np.repeat(np.diff(m.indptr), 3)
    ends = np.concatenate([[0], np.cumsum(counts)])
    entry = np.arange(ends[-1]) - np.repeat(ends[:-1] - np.repeat(m.indptr[:-1], 3), counts)
    component = np.repeat(np.tile(np.arange(3, dtype=m.indices.dtype), m.shape[0]), counts)
    arrays = (m.data[entry], 3 * m.indices[entry] + component, ends.astype(m.indptr.dtype))
    return sp.csr_array(arrays, shape=(3 * m.shape[0], 3 * m.shape[1]))


def _pattern(mesh: Mesh) -> sp.csr_array:
    """(N, N) nodes that share an element: the number of each pair, row by row."""
    sizes = np.concatenate([np.full(len(block.nodes), block.nodes.shape[1]) for block in mesh.blocks])
    nodes = np.concatenate([block.nodes.ravel() for block in mesh.blocks]).astype(np.int32)  # half of what numpy takes
    ends = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int32)
    incidence = sp.csr_array((np.ones(nodes.size), nodes, ends), shape=(sizes.size, len(mesh.points)))
    pattern = sp.csr_array(incidence.T @ incidence)
    pattern.sort_indices()
    return sp.csr_array((np.arange(pattern.nnz), pattern.indices, pattern.indptr), shape=pattern.shape)


def _from_blocks(pattern: sp.csr_array, K: Array) -> sp.csr_array:
    """(3N, 3N) symmetric matrix of the blocks K_ij, i >= j, of pairs of nodes (6, p), which the pattern (N, N) has."""
    width, count, mirrored = 3 * pattern.shape[0], 9 * pattern.nnz, pattern.T.tocsr().data
    of_node = np.diff(pattern.indptr).astype(np.int64)
    ends = np.concatenate([[0], np.cumsum(np.repeat(3 * of_node, 3))]).astype(
        sp.get_index_dtype(maxval=max(count, width))
    )
    columns, values = np.empty(count, ends.dtype), np.empty(count)

    def fill(nodes: slice) -> None:
        _fill(pattern.indptr, pattern.indices, K, mirrored, ends, columns, values, nodes.start, nodes.stop)

    with threads() as each:
        finish(each(fill, pieces(pattern.shape[0])))
    return sp.csr_array((values, columns, ends), shape=(width, width))


@numba.njit(cache=True, nogil=True)
def _fill(indptr, indices, K, mirrored, ends, columns, values, first, last):  # type: ignore[no-untyped-def]
    """The rows of the nodes first...last; mirrored (p,) : the number of each pair the other way round."""
    for node in range(first, last):
        for i in range(3):
            at = ends[3 * node + i]
            for p in range(indptr[node], indptr[node + 1]):
                for j in range(3):
                    columns[at] = 3 * indices[p] + j
                    values[at] = K[i * (i + 1) // 2 + j, p] if i >= j else K[j * (j + 1) // 2 + i, mirrored[p]]
                    at += 1


@numba.njit(cache=True, nogil=True)
def _add(into, places, values):  # type: ignore[no-untyped-def]
    """into[places] += values, one after the other."""
    for k in range(places.size):
        into[places[k]] += values[k]


# ---- elements -----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Chunk:
    """Some elements of one kind and one material: their numbers (e,) in the mesh and their nodes (e, k)."""

    kind: str
    elements: Array
    nodes: Array
    material: Solid


def chunks(mesh: Mesh, material: Materials) -> Iterator[Chunk]:
    """The mesh in pieces.

    Raises InputError for an element without a material or with two.
    """
    materials, of_element = element_materials(mesh, material)
    first = 0
    for block in mesh.blocks:
        own = of_element[first : first + len(block.nodes)]
        for number, of in enumerate(materials):
            alike = np.flatnonzero(own == number)
            for some in np.split(alike, range(_CHUNK, alike.size, _CHUNK)) if alike.size else []:
                yield Chunk(block.kind, first + some, block.nodes[some], of)
        first += len(block.nodes)


def _basis(points: Array, chunk: Chunk, order: Mapping[str, int]) -> skfem.CellBasis:
    """The scalar basis of the elements at the quadrature points of that order; InputError for one turned inside out."""
    geometry = mapping(chunk.kind, points, chunk.nodes)
    X, weights = quadrature(chunk.kind, order[chunk.kind])
    least = determinants(geometry, X).min(axis=1)
    worst = int(np.argmin(least))
    if not least[worst] > 0:
        raise InputError(
            f"element {chunk.elements[worst]} ({chunk.kind}, near {points[chunk.nodes[worst]].mean(axis=0)} m) is degenerate "
            f"or turned inside out (Jacobian {least[worst]:.3g}): repair the mesh there, or check its node order"
        )
    return scalar_basis(geometry, (X, weights))


@dataclass(frozen=True)
class Gradients:
    """Some elements at their stiffness quadrature points, q in all.

    volume : (q,) of each point [m^3]; nodes : (e, k); shapes : (e, Q, k, 3) d N_a / dx [1/m]; C : (9, 9) stress from
    displacement gradient [Pa]
    """

    volume: Array
    nodes: Array
    shapes: Array
    C: Array

    def gradient(self, field: Array) -> Array:
        """(q, 3, 3, r) d u_m / dx_k at [q, m, k] of nodal fields (N, 3, r): all at once, for which scikit-fem's
        `interpolate` takes one field after the other.
        """
        at_points = np.einsum("eqak,eamr->eqmkr", self.shapes, field[self.nodes], optimize=True)
        return np.asarray(at_points.reshape(-1, 3, 3, field.shape[2]))

    def stress(self, field: Array) -> Array:
        """(q, 3, 3, r) Cauchy stress [Pa] of nodal displacements (N, 3, r) [m]."""
        return self._elastic(self.gradient(field))

    def stress_of_products(self, gradient: Array, i: int) -> Array:
        """(q, 3, 3, n - i) second derivatives of the stress by the amplitudes of the field i and those from it on, of n
        with the gradient (q, 3, 3, n)."""
        others = gradient[..., i:]
        product = np.matmul(gradient[..., i].transpose(0, 2, 1), others.reshape(len(others), 3, -1))
        return self._elastic(product.reshape(others.shape))

    def forces(self, stress: Array) -> Array:
        """(e, k, 3, r) forces at the nodes of the elements that hold the stress (q, 3, 3, r) in equilibrium [N]."""
        elements, points = self.shapes.shape[:2]
        acting = (stress * self.volume[:, None, None, None]).reshape(elements, points, *stress.shape[1:])
        return np.asarray(np.einsum("eqak,eqmkr->eamr", self.shapes, acting, optimize=True))

    def _elastic(self, gradient: Array) -> Array:
        return np.asarray(np.matmul(self.C, gradient.reshape(len(gradient), 9, -1)).reshape(gradient.shape))


def displacement_gradients(points: Array, chunk: Chunk) -> Gradients:
    """The elements of a chunk, ready to differentiate displacement fields."""
    basis = _basis(points, chunk, STIFFNESS_ORDER)
    shapes = np.stack([basis.basis[a][0].grad for a in local_order(chunk.kind)])
    C = chunk.material.elasticity_tensor().reshape(9, 9)
    return Gradients(basis.dx.ravel(), chunk.nodes, shapes.transpose(2, 3, 0, 1), C)


# ---- materials ----------------------------------------------------------------------------------------------------


def element_materials(mesh: Mesh, material: Materials) -> tuple[list[Solid], Array]:
    """The materials, and the number of each element's (E,) among them.

    Raises InputError for an element without a material or with two.
    """
    count = sum(len(block.nodes) for block in mesh.blocks)
    if isinstance(material, str):
        raise InputError(f"material is the text {material!r}; write material({material!r}), of ffr_prep.model.material")
    if isinstance(material, Material | AnisotropicMaterial):
        return [material], np.zeros(count, int)
    number, uses = np.zeros(count, int), np.zeros(count, int)
    for k, (group, of_group) in enumerate(material.items()):
        if group not in mesh.volume_groups:
            raise InputError(f"material {of_group.name!r} is for volume group {group!r}; the mesh has {_known(mesh)}")
        number[mesh.volume_groups[group]] = k
        uses[mesh.volume_groups[group]] += 1
    if (uses != 1).any():
        wrong = int(np.argmax(uses != 1))
        raise InputError(
            f"element {wrong} has {uses[wrong]} materials ({np.sum(uses != 1)} of {count} elements have none or "
            f"several): give every element one material through the volume groups {_known(mesh)}"
        )
    return list(material.values()), number


def _known(mesh: Mesh) -> str:
    return ", ".join(repr(name) for name in mesh.volume_groups) or "none"
