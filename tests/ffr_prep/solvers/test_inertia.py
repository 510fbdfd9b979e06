"""Counting eigenvalues: against dense ones, at any shift, under any supports."""

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp

from ffr_prep.solvers.inertia import modes_below, negative_eigenvalues


def grid(n):
    """A grid of springs with three coordinates a node, and where they are."""
    places = np.array([(x, y, z) for x in range(n) for y in range(n) for z in range(3)], float)
    near = sp.coo_array(np.abs(places[:, None] - places).sum(axis=2) == 1).tocsr().astype(float)
    graph = sp.diags_array(near.sum(axis=1)) - near
    rng = np.random.default_rng(3)
    block = rng.standard_normal((3, 3))
    K = sp.csr_array(sp.kron(graph, block @ block.T + np.eye(3)))
    m = sp.csr_array(sp.kron(sp.diags_array(1 + rng.random(len(places))), sp.eye_array(3)))
    return K, m, np.repeat(places, 3, axis=0)


@pytest.mark.parametrize("n", [4, 14])
def test_negative_eigenvalues_are_those_of_a_dense_solution(n):
    K, M, places = grid(n)
    values = scipy.linalg.eigh(K.toarray(), M.toarray(), eigvals_only=True)
    for k in (3, 4, 10, 60, len(values) // 2, len(values) - 2):
        middle = (values[k - 1] + values[k]) / 2
        if values[k] - values[k - 1] > 1e-9 * values[-1]:
            assert negative_eigenvalues(sp.csr_array(K - middle * M), places) == k


@pytest.mark.parametrize("dense", [False, True])
def test_modes_under_supports_are_counted(dense):
    K, M, places = grid(9)
    rng = np.random.default_rng(0)
    C = rng.standard_normal((7, K.shape[0])) if dense else np.eye(K.shape[0])[:7] * 1e-3
    null = scipy.linalg.null_space(C)
    values = scipy.linalg.eigh(null.T @ (K @ null), null.T @ (M @ null), eigvals_only=True)
    for k in (0, 1, 5, 17, 90):
        sigma = values[0] / 2 if k == 0 else (values[k - 1] + values[k]) / 2
        assert modes_below(K, M, C, places, sigma) == k


def test_pivots_of_two_by_two():
    A = sp.csr_array(np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 2.0], [0.0, 2.0, -1.0]]))
    expected = int(np.sum(np.linalg.eigvalsh(A.toarray()) < 0))
    assert negative_eigenvalues(A, np.arange(9.0).reshape(3, 3)) == expected


def test_a_singular_matrix_is_noticed():
    A = sp.csr_array((np.zeros(2), ([0, 1], [0, 1])), shape=(2, 2))
    with pytest.raises(np.linalg.LinAlgError):
        negative_eigenvalues(A, np.zeros((2, 3)))


def test_progress_of_a_count_is_told():
    K, M, places = grid(9)
    told = []
    negative_eigenvalues(sp.csr_array(K - 0.1 * M), places, lambda share, words: told.append(share))
    assert told == sorted(told)
    assert told[-1] == pytest.approx(1)
