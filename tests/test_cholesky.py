"""The sparse factorisation against dense ones, whatever the shape of the graph."""

import numpy as np
import pytest
import scipy.sparse as sp
from boxes import STEEL, box_mesh, shaken

from ffr_prep.cholesky import cholesky, solve_cholesky
from ffr_prep.solids import assemble


def assert_solves(A, positions, columns=3, rel=1e-9):
    b = np.random.default_rng(0).normal(size=(A.shape[0], columns))
    x = solve_cholesky(cholesky(sp.csr_array(A), positions), b)
    np.testing.assert_allclose(x, np.linalg.solve(A.toarray(), b), rtol=0, atol=rel * np.abs(x).max())


def clamped(kind, cells):
    mesh = shaken(box_mesh(kind, (1.0, 0.4, 0.3), cells), 0.01)
    free = np.flatnonzero(np.repeat(mesh.points[:, 0] > 0, 3))
    return sp.csr_array(assemble(mesh, STEEL).K[free][:, free]), np.repeat(mesh.points, 3, axis=0)[free]


@pytest.mark.parametrize(
    ("kind", "cells"), [("tet10", (6, 3, 2)), ("hex8", (8, 4, 3)), ("hex20", (4, 2, 2)), ("tet4", (1, 1, 1))]
)
def test_stiffness_matrices(kind, cells):
    A, positions = clamped(kind, cells)
    assert_solves(A, positions)


def test_unknowns_without_a_place_come_last():
    """Six unknowns that touch everything, like those of a rigid interface."""
    A, positions = clamped("tet10", (5, 2, 2))
    rng = np.random.default_rng(1)
    T = sp.hstack([sp.eye_array(A.shape[0]), sp.csr_array(rng.normal(size=(A.shape[0], 6)))], format="csr")
    bordered = sp.csr_array(T.T @ A @ T + 1e9 * sp.eye_array(A.shape[0] + 6))
    positions = np.vstack([positions, np.full((6, 3), np.nan)])
    factor = cholesky(bordered, positions)
    assert set(factor.order[-6:]) == set(range(A.shape[0], A.shape[0] + 6))
    assert_solves(bordered, positions)


def test_graphs_that_fall_apart_when_cut():
    """A star of chains: cutting it leaves parts that do not touch, and cuts without points."""
    rng = np.random.default_rng(2)
    count = 400
    parent = np.maximum(np.arange(count) - 8, 0)
    edges = sp.coo_array((np.ones(count - 1), (np.arange(1, count), parent[1:])), shape=(count, count))
    A = sp.csr_array(3 * sp.eye_array(count) + sp.diags_array(np.full(count, 9.0)) - edges - edges.T)
    assert_solves(A, rng.normal(size=(count, 3)))
    assert_solves(sp.csr_array(sp.diags_array(rng.uniform(1, 2, count))), rng.normal(size=(count, 3)))


def test_points_that_coincide_or_lie_on_a_line():
    A, positions = clamped("hex8", (5, 3, 3))
    assert_solves(A, np.zeros_like(positions))
    assert_solves(A, np.outer(np.arange(len(positions)), [1.0, 0.0, 0.0]))
    assert_solves(A, np.full_like(positions, np.nan))


def test_the_same_matrix_gives_the_same_bits():
    A, positions = clamped("tet10", (6, 3, 2))
    one, two = cholesky(A, positions), cholesky(A, positions)
    assert all(a.below.tobytes() == b.below.tobytes() for a, b in zip(one.fronts, two.fronts, strict=True))


def test_a_matrix_that_is_not_positive_definite_is_refused():
    A, positions = clamped("hex8", (5, 3, 3))
    with pytest.raises(np.linalg.LinAlgError, match="not positive"):
        cholesky(sp.csr_array(A - 1e12 * sp.eye_array(A.shape[0])), positions)
