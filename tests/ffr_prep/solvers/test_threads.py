"""Products of sparse matrices on all threads."""

import numpy as np
import pytest
import scipy.sparse as sp

from ffr_prep.solvers.threads import product, product_of_sizes


@pytest.mark.parametrize("columns", [1, 4, 37])
@pytest.mark.parametrize("rows", [1, 5, 300])
def test_products_are_those_of_scipy(rows, columns):
    """Of few rows as of many, of arrays in either order, of a matrix by rows or by columns."""
    rng = np.random.default_rng(0)
    A = sp.csr_array(sp.random_array((rows, 40), density=0.2, rng=rng, data_sampler=rng.standard_normal))
    for X in (rng.standard_normal((40, columns)), rng.standard_normal((columns, 40)).T):
        for same in (A, A.tocsc()):
            np.testing.assert_allclose(product(same, X), A @ X, rtol=1e-14, atol=1e-14)
            np.testing.assert_allclose(product_of_sizes(same, X), abs(A) @ abs(X), rtol=1e-14, atol=1e-14)
