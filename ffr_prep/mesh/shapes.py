"""Elements as scikit-fem reads them: its shape functions, mappings and bases on the nodes of a mesh.

scikit-fem numbers the degrees of freedom of a second-order element by corner, edge and face, and sorts corners. A basis
here has the elements as they are: the number of a degree of freedom is that of its node, and the geometry is
isoparametric, so curved and distorted elements are integrated as they are and one turned inside out is noticed.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import skfem
from scipy.special import roots_jacobi
from skfem.quadrature import get_quadrature

from ffr_prep.common.arrays import Array
from ffr_prep.mesh import own_elements
from ffr_prep.mesh.cells import KINDS, node_order

# Faces by their number of nodes: shape functions, whose order of nodes is VTK's, and order of the mass rule.
_FACES = {
    3: (skfem.ElementTriP1(), 2),
    6: (skfem.ElementTriP2(), 7),
    4: (skfem.ElementQuad1(), 5),
    8: (skfem.ElementQuadS2(), 9),
    9: (skfem.ElementQuad2(), 9),
}


@dataclass(frozen=True)
class _Elements:
    """The mesh and degrees of freedom of elements (or faces) of one kind, in the form that scikit-fem asks for.

    doflocs : (3, N) nodes [m]; element_dofs : (k, E) nodes of the elements in scikit-fem's local order
    """

    doflocs: Array
    element_dofs: Array
    elem: skfem.Element
    edge_dofs: tuple[()] = ()  # those of the faces are all in `facets`
    facet_dofs: tuple[()] = ()

    dofs = property(lambda self: self)
    facets = property(lambda self: self.element_dofs)
    refdom = property(lambda self: self.elem.refdom)
    N = property(lambda self: self.doflocs.shape[1])
    nelements = property(lambda self: self.element_dofs.shape[1])

    def dim(self) -> int:
        """Of the space."""
        return 3


class _Mapping(skfem.MappingIsoparametric):  # type: ignore[misc]  # scikit-fem has no types
    """scikit-fem asks for the inverse Jacobian at the same points once for each shape function: one is kept."""

    def __init__(self, elements: _Elements) -> None:
        super().__init__(elements, elements.elem)
        self._last: tuple[Array, Array] | None = None

    def invDF(self, X: Array, tind: Array | None = None) -> Array:
        """(3, 3, E, Q) at the points X (3, Q) of the reference element, of all elements."""
        if self._last is None or self._last[0] is not X:
            self._last = X, super().invDF(X)
        return self._last[1]


@cache
def shape_functions(kind: str) -> skfem.Element:
    """scikit-fem's element of that kind, or one like it."""
    name = KINDS[kind].shapes
    return getattr(skfem if hasattr(skfem, name) else own_elements, name)()


@cache
def quadrature(kind: str, order: int) -> tuple[Array, Array]:
    """Points (3, Q) and weights (Q,) that integrate polynomials of that order over the reference element.

    Of wedges the rule of the triangle times that of Gauss; scikit-fem's has three times as many points. Of pyramids a conical
    product of rules of Gauss and Jacobi: the square shrinks by 1 - z. (A. H. Stroud, Approximate Calculation of Multiple
    Integrals, 1971, sections 2.4 and 2.5.)
    """
    X, W = get_quadrature(skfem.ElementLineP1().refdom, order)
    if KINDS[kind].corners == 6:
        plane, of_plane = get_quadrature(skfem.ElementTriP1().refdom, order)
        return np.vstack([np.repeat(plane, W.size, axis=1), np.tile(X, of_plane.size)]), np.outer(of_plane, W).ravel()
    if KINDS[kind].corners == 5:
        z, of_z = roots_jacobi(order // 2 + 1, 2, 0)
        x, y, z = (of.ravel() for of in np.meshgrid(X[0], X[0], (1 + z) / 2, indexing="ij"))
        weights = np.einsum("i,j,k->ijk", W, W, of_z / 8).ravel()
        return np.stack([0.5 + (x - 0.5) * (1 - z), 0.5 + (y - 0.5) * (1 - z), z]), weights
    return get_quadrature(shape_functions(kind).refdom, order)


@cache
def local_order(kind: str) -> Array:
    """(k,) for each node in the order of `KINDS`, its number in scikit-fem's element."""
    return node_order(kind, shape_functions(kind).doflocs)


def mapping(kind: str, points: Array, nodes: Array) -> skfem.MappingIsoparametric:
    """From the reference element to the elements with these nodes (E, k) of the points (N, 3) [m]."""
    theirs = np.ascontiguousarray(nodes.T[np.argsort(local_order(kind))])
    return _Mapping(_Elements(points.T, theirs, shape_functions(kind)))


def determinants(geometry: skfem.MappingIsoparametric, X: Array) -> Array:
    """(E, Q) determinants of dx/dX [m^3] at X (3, Q) of the reference element, which scikit-fem refuses to give if 0."""
    first, second, third = geometry.DF(X)
    return np.asarray(np.sum(first * np.cross(second, third, axis=0), axis=0))


def scalar_basis(geometry: skfem.MappingIsoparametric, quadrature: tuple[Array, Array]) -> skfem.CellBasis:
    """The shape functions of the elements at points and weights of the reference element; degree of freedom = node."""
    mesh = geometry.mesh
    return skfem.CellBasis(mesh, mesh.elem, geometry, quadrature=quadrature, dofs=mesh.dofs, disable_doflocs=True)


def jacobian_determinants(kind: str, points: Array) -> Array:
    """(E, Q) volume ratio [m^3] of elements with nodes at `points` (E, k, 3), at the nodes and inside."""
    inside, _ = quadrature(kind, 5)
    nodes = np.arange(points.shape[0] * points.shape[1]).reshape(points.shape[:2])
    return determinants(mapping(kind, points.reshape(-1, 3), nodes), np.hstack([KINDS[kind].nodes.T, inside]))


def face_mass(points: Array, faces: Array) -> Array:
    """(F, k, k) integral of N_a N_b dA [m^2] over faces (F, k) of 3, 6, 4, 8 or 9 nodes.

    scikit-fem's basis on facets would look for the elements behind them and, by Newton's method, for the points in these;
    a face knows its own shape.
    """
    element, order = _FACES[faces.shape[1]]
    X, weights = get_quadrature(element.refdom, order)
    area = skfem.MappingIsoparametric(_Elements(points.T, faces.T, element), element, element).detDG(X) * weights
    N = np.stack([np.broadcast_to(element.lbasis(X, i)[0], weights.shape) for i in range(faces.shape[1])])
    return np.asarray(np.einsum("fq,aq,bq->fab", area, N, N, optimize=True))
