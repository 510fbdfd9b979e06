"""Shape functions that scikit-fem lacks: wedges of second order and pyramids, as elements of scikit-fem.

All are products of affine functions of the point (x, y, z) of the reference element, those of pyramids over 1 - z as well.
With the area coordinates L of a wedge's triangle and t = 2 z - 1, a corner of the serendipity wedge has
L_i (1 + s t)(2 L_i - 2 + s t) / 2, s = -1 below and 1 above. With u = 2 x - 1, v = 2 y - 1, w = 1 - z, a corner of the linear
pyramid has (w + u_i u)(w + v_i v) / 4 w and its apex z, so that its four sloping sides are linear triangles.

Sources: O. C. Zienkiewicz, R. L. Taylor, J. Z. Zhu, The Finite Element Method (7th ed. 2013), section 6.2 (wedges);
G. Bedrosian, Int. J. Numer. Meth. Eng. 35 (1992) 95-108 (pyramids).
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from skfem.element import ElementH1
from skfem.refdom import Refdom, RefWedge

from ffr_prep.common.arrays import Array
from ffr_prep.mesh.cells import KINDS

_ONE = np.array([1.0, 0.0, 0.0, 0.0])
_X, _Y, _Z = np.eye(4)[1:]
_NEAR = 1e-8  # 1 - z, for derivatives at the apex

_L = (_ONE - _X - _Y, _X, _Y)
_T = 2 * _Z - _ONE
_U, _V, _W = 2 * _X - _ONE, 2 * _Y - _ONE, _ONE - _Z

_EDGES = ((0, 1), (1, 2), (2, 0))
_SIGNS = ((-1, -1), (1, -1), (1, 1), (-1, 1))  # of u and v at the corners of the base


class _Products(ElementH1):  # type: ignore[misc]  # scikit-fem has no types
    """Shape functions that are products.

    products : for each node the affine functions (k, 4), a + b x + c y + d z
    over     : which of them are over 1 - z
    """

    nodal_dofs = 1
    products: ClassVar[tuple[Array, ...]]
    over: ClassVar[tuple[bool, ...]]

    def lbasis(self, X: Array, i: int) -> tuple[Array, Array]:
        """(Q,) value and (3, Q) gradient of function i at X (3, Q); at an apex the gradient is that on the axis."""
        if not self.over[i]:
            return self._product(X, i)
        value, w = self._product(X, i)[0], np.maximum(1 - X[2], _NEAR)
        beside, gradient = self._product(np.stack([X[0], X[1], 1 - w]), i)
        gradient[2] += beside / w
        return value / w, gradient / w

    def _product(self, X: Array, i: int) -> tuple[Array, Array]:
        forms = self.products[i]
        values = forms[:, :1] + forms[:, 1:] @ X
        slopes = [np.prod(np.delete(values, k, axis=0), axis=0) * forms[k, 1:, None] for k in range(len(forms))]
        return np.prod(values, axis=0), np.sum(slopes, axis=0)


def _product(scale: float, *forms: Array) -> Array:
    """(k, 4) with the scale in the first of the affine functions."""
    return np.array([scale * forms[0], *forms[1:]])


# ---- wedges -------------------------------------------------------------------------------------------------------------


def _side(s: int) -> Array:
    """1 + s t, which vanishes on the other side."""
    return np.asarray(_ONE + s * _T)


class ElementWedgeS2(_Products):
    """The serendipity wedge of 15 nodes: corners, the edges below, those above, those between."""

    maxdeg = 4
    refdom = RefWedge
    doflocs = KINDS["wedge15"].nodes
    products = (
        *(_product(0.5, L, _side(s), 2 * L - 2 * _ONE + s * _T) for s in (-1, 1) for L in _L),
        *(_product(2.0, _L[a], _L[b], _side(s)) for s in (-1, 1) for a, b in _EDGES),
        *(_product(1.0, L, _side(1), _side(-1)) for L in _L),
    )
    over = (False,) * 15


class ElementWedge2(_Products):
    """The wedge of 18 nodes: those of the serendipity wedge, and the centres of its three quadrilaterals."""

    maxdeg = 4
    refdom = RefWedge
    doflocs = KINDS["wedge18"].nodes
    products = (
        *(_product(0.5 * s, L, 2 * L - _ONE, _T, _side(s)) for s in (-1, 1) for L in _L),
        *(_product(2.0 * s, _L[a], _L[b], _T, _side(s)) for s in (-1, 1) for a, b in _EDGES),
        *(_product(1.0, L, 2 * L - _ONE, _side(1), _side(-1)) for L in _L),
        *(_product(4.0, _L[a], _L[b], _side(1), _side(-1)) for a, b in _EDGES),
    )
    over = (False,) * 18


# ---- pyramids -----------------------------------------------------------------------------------------------------------


class RefPyramid(Refdom):  # type: ignore[misc]  # scikit-fem has no types
    """The pyramid over the unit square with its apex at (1/2, 1/2, 1)."""

    p = KINDS["pyramid5"].nodes.T
    t = np.arange(5, dtype=np.int32)[:, None]
    nnodes, nfacets, nedges = 5, 5, 8
    name = "Pyramid"


_OVER = tuple((_W + u * _U, _W + v * _V) for u, v in _SIGNS)  # of the corners


class ElementPyramid1(_Products):
    """The linear pyramid of five nodes, the apex last."""

    maxdeg = 2
    refdom = RefPyramid
    doflocs = KINDS["pyramid5"].nodes
    products = (*(_product(0.25, *of) for of in _OVER), _product(1.0, _Z))
    over = (True,) * 4 + (False,)


def _base_edge(k: int) -> Array:
    """The function of the edge from corner k of the base to the next one."""
    u, v = _SIGNS[k]
    if u == _SIGNS[(k + 1) % 4][0]:
        return _product(0.5, _W + _V, _W - _V, _W + u * _U)
    return _product(0.5, _W + _U, _W - _U, _W + v * _V)


class ElementPyramidS2(_Products):
    """The serendipity pyramid of 13 nodes: corners, apex, the edges of the base, those to the apex."""

    maxdeg = 4
    refdom = RefPyramid
    doflocs = KINDS["pyramid13"].nodes
    products = (
        *(_product(0.25, u * _U + v * _V - _ONE, *of) for (u, v), of in zip(_SIGNS, _OVER, strict=True)),
        _product(1.0, _Z, 2 * _Z - _ONE),
        *(_base_edge(k) for k in range(4)),
        *(_product(1.0, _Z, *of) for of in _OVER),
    )
    over = (True,) * 4 + (False,) + (True,) * 8
