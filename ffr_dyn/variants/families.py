"""Families of elastic coordinates that the symmetry of a body keeps apart."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from ffr_prep.body import FlexibleBody
from ffr_prep.common.arrays import Array

ROUNDING = 1e-8  # of the second moments (I5, I9) of unit modes: what symmetry leaves of zeros
SECOND_ORDER_ROUNDING = 1e-8  # of second-order terms of modes of one energy, relative to the largest of their kind


def families(coupled: Array) -> Array:
    """(n,) the family of each coordinate; those of different families have no part in the same product.

    coupled : (n, C, n) which coordinates have a part in which products
    """
    has = np.asarray(coupled.reshape(len(coupled), -1), dtype=float)
    family: Array = connected_components(csr_array(has @ has.T), directed=False)[1]
    return family


def rounding_of(K: Array, omega2: Array) -> Array:
    """(L, n, n) what symmetry leaves of zeros in second-order matrices (L, n, n), of which threes are of one kind.

    Entries grow with the frequencies of both modes, so they are compared for modes of one strain energy: what is small
    beside the entries of fast modes may be all that slow ones have. There is a gap: of beams, plates and solids with planes
    of symmetry, zeros are below 1e-9 and what couples above 1e-6, but for a few entries of no weight.
    """
    stiffness = np.sqrt(np.outer(omega2, omega2))
    sizes = np.divide(np.abs(K), stiffness, out=np.zeros_like(K), where=stiffness > 0)
    largest = np.repeat(sizes.max(axis=(1, 2), initial=0.0).reshape(-1, 3).max(axis=1), 3)
    return np.asarray(SECOND_ORDER_ROUNDING * largest[:, None, None] * stiffness)


def by_family(body: FlexibleBody) -> Array:
    """(n,) the coordinates of a second-order body in mean-axis form, family by family.

    Ends break a symmetry along the body that its mass may have: families of the second moments within those of markers.
    """
    assert body.stiffening is not None
    K, PP = body.stiffening, body.PP_dm.reshape(9, body.n, body.n)
    fine = [_coupled(PP, ROUNDING), _coupled(K[6:12], rounding_of(K[6:12], body.omega2))]
    markers = _coupled(K[12:], rounding_of(K[12:], body.omega2))
    return np.lexsort([families(np.concatenate(fine, axis=1)), families(markers)])


def _coupled(matrices: Array, noise: Array | float) -> Array:
    return np.moveaxis(np.abs(matrices) > noise, 0, 1)
