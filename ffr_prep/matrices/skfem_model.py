"""A model of a scikit-fem user: a vector basis with the stiffness and mass assembled on it.

The degrees of freedom of `skfem.ElementVector` come in threes, the components x, y, z at one place; each place becomes a
node. Boundaries and subdomains that the mesh names become groups of nodes, where interfaces attach.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib.metadata import version
from typing import Any

import numpy as np
import scipy.sparse as sp
import skfem

from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.matrices.checks import check_symmetric
from ffr_prep.matrices.model import MatrixModel
from ffr_prep.mesh.cells import KINDS, node_order
from ffr_prep.mesh.mesh import Block, Mesh, surface_triangles
from ffr_prep.mesh.shapes import jacobian_determinants, local_order

_NODAL = 1e-12
_LINEAR = {skfem.ElementTetP1.refdom: "tet4", skfem.ElementHex1.refdom: "hex8", skfem.ElementWedge1.refdom: "wedge6"}


def from_skfem(
    basis: skfem.CellBasis, K: sp.sparray, M: sp.sparray, *, regions: Mapping[str, Any] | None = None
) -> MatrixModel:
    """The model of K and M (D, D) [N/m, kg], assembled on the whole basis without boundary conditions; SI units.

    basis   : of `ElementVector` of an element whose degrees of freedom are values at places, in space: tetrahedra and
              hexahedra of first and second order (P1, P2, Q1, Q2, serendipity), straight or curved, and others like them
    regions : further groups: name -> degrees of freedom, as `basis.get_dofs(...)` gives them or numbers

    The boundary is drawn by the nodes of the elements, or by their corners where they are of a kind unknown here. Mean
    interfaces weigh all nodes alike, as those of all matrices.

    Raises InputError for another basis, matrices of another size or not symmetric, and a name used twice.

    >>> given = fp.from_skfem(basis, K, M)
    """
    element = _check_basis(basis)
    for name, A in (("K", K), ("M", M)):
        if A.shape != (basis.N, basis.N):
            raise InputError(
                f"{name} has the shape {A.shape}, but the basis has {basis.N} degrees of freedom: give the matrices of the "
                "free body, assembled on this basis, neither condensed nor enforced"
            )
    nodes, components = _nodes_and_components(basis)
    first = np.flatnonzero(components == 0)
    places = np.empty((first.size, 3))
    places[nodes[first]] = basis.doflocs[:, first].T
    model = MatrixModel(
        points=places,
        K=sp.csr_array(K),
        M=sp.csr_array(M),
        nodes=nodes,
        components=components,
        groups={name: np.unique(nodes[dofs]) for name, dofs in _regions(basis, dict(regions or {})).items()},
        triangles=_triangles(basis, type(element).__name__, places, nodes),
        source={"format": "scikit-fem", "version": version("scikit-fem"), "element": type(element).__name__},
    )
    check_symmetric(model)
    return model


def _nodes_and_components(basis: skfem.CellBasis) -> tuple[Array, Array]:
    """(D,) node and component of each degree of freedom: rows of threes at corners, edges, faces and in elements."""
    nodes, components = np.empty(basis.N, np.int64), np.empty(basis.N, np.int64)
    count = 0
    for dofs in (basis.nodal_dofs, basis.edge_dofs, basis.facet_dofs, basis.interior_dofs):
        if np.size(dofs):
            threes = np.reshape(dofs, (-1, 3, np.shape(dofs)[1]))
            numbers = count + np.arange(threes[:, 0].size).reshape(threes[:, :1].shape)
            nodes[threes], components[threes] = numbers, np.arange(3)[:, None]
            count += numbers.size
    return nodes, components


def _regions(basis: skfem.CellBasis, given: Mapping[str, Any]) -> dict[str, Array]:
    """Degrees of freedom by name: of boundaries, subdomains and what else is given."""
    boundaries, subdomains = basis.mesh.boundaries or {}, basis.mesh.subdomains or {}
    names = [*boundaries, *subdomains, *given]
    repeated = next((name for name in names if names.count(name) > 1), None)
    if repeated:
        raise InputError(
            f"region {repeated!r} is there twice (boundaries, subdomains, regions): give each its own name"
        )
    found = {name: basis.get_dofs(facets).flatten() for name, facets in boundaries.items()}
    found |= {name: basis.get_dofs(elements=of).flatten() for name, of in subdomains.items()}
    for name, dofs in given.items():
        found[name] = np.asarray(dofs).ravel()
        wrong = found[name].dtype.kind not in "iu" or not np.isin(found[name], np.arange(basis.N)).all()
        if wrong or not found[name].size:
            raise InputError(
                f"region {name!r} must be degrees of freedom 0 ... {basis.N - 1}, such as basis.get_dofs(...)"
            )
    return found


def _triangles(basis: skfem.CellBasis, name: str, points: Array, nodes: Array) -> Array | None:
    """(T, 3) nodes of the triangles of the boundary, seen from outside; None where corners are no nodes."""
    kind = next((kind for kind, of in KINDS.items() if of.shapes == name), _LINEAR[basis.mesh.refdom])
    if not np.size(basis.nodal_dofs):
        return None
    cells = nodes[basis.element_dofs[::3]][local_order(kind)].T
    mirrored = (jacobian_determinants(kind, points[cells]) < 0).all(
        axis=1
    )  # scikit-fem sorts the corners of tetrahedra
    cells[mirrored] = cells[mirrored][:, node_order(kind, KINDS[kind].nodes[:, [1, 0, 2]])]
    outside, triangles = surface_triangles(Mesh(points, (Block(kind, cells),), {}, {}, {}))
    return np.asarray(outside[triangles])


# ---- guards -------------------------------------------------------------------------------------------------------


def _check_basis(basis: skfem.CellBasis) -> skfem.Element:
    """The scalar element of the basis; InputError where it is not displacements of nodes in space."""
    element = getattr(basis.elem, "elem", None)
    if not isinstance(basis.elem, skfem.ElementVector) or element is None:
        raise InputError(
            f"the basis is of {type(basis.elem).__name__}; displacements need a vector, such as "
            "Basis(mesh, ElementVector(ElementTetP2()))"
        )
    if basis.mesh.dim() != 3 or basis.elem.dim != 3:
        raise InputError(
            f"the basis has {basis.elem.dim} components on a mesh of {basis.mesh.dim()} dimensions; a body has three of both"
        )
    if not isinstance(basis, skfem.CellBasis) or basis.tind is not None or not hasattr(basis, "doflocs"):
        raise InputError(
            "the basis must be of all elements of the mesh and know its places: Basis(mesh, element), without `elements` and "
            "`disable_doflocs`"
        )
    if not _is_nodal(element):
        raise InputError(
            f"the degrees of freedom of {type(element).__name__} are not displacements at places, so no node carries them: "
            "take a Lagrange element, such as ElementTetP2 or ElementHex2"
        )
    return element


def _is_nodal(element: skfem.Element) -> bool:
    """Whether each shape function is one at its own place and zero at the others."""
    if not isinstance(element, skfem.ElementH1):
        return False
    at, count = element.doflocs.T, len(element.doflocs)
    values = np.stack([np.broadcast_to(element.lbasis(at, i)[0], (count,)) for i in range(count)])
    return bool(np.abs(values - np.eye(count)).max() < _NODAL)
