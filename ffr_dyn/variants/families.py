"""Families of elastic coordinates that the symmetry of a body keeps apart."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from ffr_prep.body import FlexibleBody
from ffr_prep.common.arrays import Array

ROUNDING = 1e-8  # of the second moments (I5, I9) of unit modes: what symmetry leaves of zeros
SECOND_ORDER_ROUNDING = 3e-5  # of second-order terms, relative to the largest of their kind: slopes are rougher


def families(coupled: Array) -> Array:
    """(n,) the family of each coordinate; those of different families have no part in the same product.

    coupled : (n, C, n) which coordinates have a part in which products
    """
    has = np.asarray(coupled.reshape(len(coupled), -1), dtype=float)
    family: Array = connected_components(csr_array(has @ has.T), directed=False)[1]
    return family


def rounding_of(K: Array) -> Array:
    """(L,) what symmetry leaves of zeros in second-order matrices (L, n, n), of which threes are of one kind."""
    largest = np.abs(K).max(axis=(1, 2), initial=0.0).reshape(-1, 3).max(axis=1)
    return np.repeat(SECOND_ORDER_ROUNDING * largest, 3)


def by_family(body: FlexibleBody) -> Array:
    """(n,) the coordinates of a second-order body in mean-axis form, family by family.

    Ends break a symmetry along the body that its mass may have: families of the second moments within those of markers.
    """
    assert body.stiffening is not None
    K, PP = body.stiffening, body.PP_dm.reshape(9, body.n, body.n)
    fine = _coupled(np.concatenate([PP, K[6:12]]), np.append(np.full(9, ROUNDING), rounding_of(K[6:12])))
    return np.lexsort([families(fine), families(_coupled(K[12:], rounding_of(K[12:])))])


def _coupled(matrices: Array, noise: Array) -> Array:
    return np.moveaxis(np.abs(matrices) > noise[:, None, None], 0, 1)
