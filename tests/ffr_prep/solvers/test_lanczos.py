"""The block Lanczos iteration on matrices whose modes are known."""

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp

from ffr_prep.common.errors import ComputationError
from ffr_prep.solvers.lanczos import lowest_modes


def problem(omega2, seed=0):
    """Flexibility and mass with the given omega2; infinite values are directions that the supports hold."""
    rng = np.random.default_rng(seed)
    size = len(omega2)
    M = sp.csr_array(sp.diags_array(rng.uniform(0.5, 2.0, size)))
    modes = scipy.linalg.qr(rng.normal(size=(size, size)))[0] / np.sqrt(M.diagonal())[:, None]
    G = modes @ np.diag(1 / omega2) @ modes.T
    return (lambda load: G @ load), M, rng.normal(size=(size, 4)), modes


def test_modes_are_the_known_ones():
    omega2 = np.arange(1.0, 301.0) ** 2
    flexibility, M, start, modes = problem(omega2)
    found, vectors = lowest_modes(flexibility, M, start, 12, most=200)
    np.testing.assert_allclose(found, omega2[:12], rtol=1e-12)
    np.testing.assert_allclose(np.abs(vectors.T @ (M @ modes[:, :12])), np.eye(12), atol=1e-7)
    np.testing.assert_allclose(vectors.T @ (M @ vectors), np.eye(12), atol=1e-12)


def test_it_tells_how_many_modes_have_converged():
    flexibility, M, start, _ = problem(np.arange(1.0, 301.0) ** 2)
    told = []
    lowest_modes(flexibility, M, start, 12, most=200, advance=lambda share, words: told.append((share, words)))
    shares = [share for share, _ in told]
    assert told[0] == (0.0, "0 of 12 modes")
    assert told[-1] == (1.0, "12 of 12 modes")
    assert any(0 < share < 1 for share in shares)


def test_equal_frequencies_are_all_found():
    omega2 = np.repeat(np.arange(1.0, 101.0), 3) ** 2
    flexibility, M, start, modes = problem(omega2)
    found, vectors = lowest_modes(flexibility, M, start, 9, most=250)
    np.testing.assert_allclose(found, omega2[:9], rtol=1e-12)
    assert scipy.linalg.subspace_angles(vectors, modes[:, :9]).max() < 1e-7


@pytest.mark.parametrize("copies", [6, 9])
def test_more_equal_frequencies_than_a_block_has_vectors_are_all_found(copies):
    omega2 = np.repeat(np.arange(1.0, 51.0), copies) ** 2
    flexibility, M, start, modes = problem(omega2)
    found, vectors = lowest_modes(flexibility, M, start, 3 * copies, most=len(omega2))
    np.testing.assert_allclose(found, omega2[: 3 * copies], rtol=1e-12)
    assert scipy.linalg.subspace_angles(vectors, modes[:, : 3 * copies]).max() < 1e-7


def test_more_modes_than_a_panel_has_rows():
    omega2 = np.arange(1.0, 401.0) ** 2
    flexibility, M, start, modes = problem(omega2)
    found, vectors = lowest_modes(flexibility, M, start, 70, most=400)
    np.testing.assert_allclose(found, omega2[:70], rtol=1e-11)
    np.testing.assert_allclose(np.abs(vectors.T @ (M @ modes[:, :70])), np.eye(70), atol=1e-6)


def test_directions_without_flexibility_do_not_disturb():
    omega2 = np.concatenate([np.arange(1.0, 61.0), np.full(240, np.inf)])
    flexibility, M, start, _ = problem(omega2)
    found, _ = lowest_modes(flexibility, M, start, 50, most=290)
    np.testing.assert_allclose(found, omega2[:50], rtol=1e-11)


def test_a_search_that_does_not_converge_or_runs_dry_is_reported():
    flexibility, M, start, _ = problem(np.arange(1.0, 301.0))
    with pytest.raises(ComputationError, match="of 40 normal modes converged with 48 vectors: ask for fewer modes"):
        lowest_modes(flexibility, M, start, 40, most=50)
    flexibility, M, start, _ = problem(np.concatenate([np.arange(1.0, 6.0), np.full(95, np.inf)]))
    with pytest.raises(ComputationError, match="only 5 of 8 normal modes converged"):
        lowest_modes(flexibility, M, start, 8, most=90)
