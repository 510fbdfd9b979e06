"""Independence of rows and smallest solutions, of sparse and dense matrices; chains of many bodies."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
from test_analyses_kinematic import bar

from ffr_dyn.closing.row_space import dependence, independent, smallest_solution
from ffr_dyn.compile.elimination import eliminate
from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene

LINKS = 400


def banded(rows: int, width: int = 9, shift: int = 4) -> np.ndarray:
    """(rows, V) full numbers in overlapping bands, of very different sizes."""
    rng = np.random.default_rng(3)
    A = np.zeros((rows, shift * (rows - 1) + width))
    for k in range(rows):
        A[k, shift * k : shift * k + width] = rng.normal(size=width) * 10.0 ** rng.uniform(-4, 4)
    return A


FORMS = pytest.mark.parametrize("form", [sp.csr_array, np.array])  # many rows, and few


@FORMS
def test_independent_rows_and_their_smallest_solution(form):
    A = banded(30)
    assert independent(form(A))
    target = A @ np.random.default_rng(4).normal(size=A.shape[1])
    found = smallest_solution(form(A), target)
    np.testing.assert_allclose(found, np.linalg.lstsq(A, target, rcond=1e-14)[0], rtol=0, atol=1e-9)


@pytest.mark.parametrize("own", [0.0, 1e-12, 1e-9])
@FORMS
def test_rows_that_depend_on_others_are_found_and_met_where_they_can_be(form, own):
    A = banded(12)
    extra = A[2] / np.linalg.norm(A[2]) + A[7] / np.linalg.norm(A[7])
    A = np.vstack([A, extra + own * np.random.default_rng(5).normal(size=A.shape[1])])
    found = dependence(form(A))
    assert found.count == 1
    size = np.linalg.norm(extra)
    np.testing.assert_allclose(found.combinations[[2, 7], 0] / found.combinations[12, 0], -1 / size, rtol=1e-6)
    unit = A[:12] / np.linalg.norm(A[:12], axis=1)[:, None]
    np.testing.assert_allclose(found.least, np.linalg.svd(unit)[1].min(), rtol=0.5)
    z = np.linalg.lstsq(A[:12], A[:12] @ np.random.default_rng(4).normal(size=A.shape[1]), rcond=1e-14)[0]
    np.testing.assert_allclose(smallest_solution(form(A), A @ z), z, rtol=0, atol=1e-6)


@FORMS
def test_many_dependent_rows_are_all_found(form):
    A = np.random.default_rng(8).normal(size=(40, 12))
    assert dependence(form(A)).count == 28
    assert dependence(form(np.vstack([A, A])[:, :5])).count == 75


@FORMS
def test_rounding_that_couples_a_dependent_row_with_others_makes_nothing_independent(form):
    """The pivot of the second row is zero to the last bit, and the third row offers 1e-11 in its place."""
    A = np.zeros((6, 7))
    A[0, 0] = A[1, 0] = 1.0
    A[1, 1] = 1e-11
    A[2:, 1:6] = np.random.default_rng(6).normal(size=(4, 5))
    assert np.linalg.svd(A)[1].min() < 1e-10
    assert not independent(form(A))


@FORMS
def test_rows_that_vanish_or_are_too_many_are_dependent(form):
    A = banded(5)
    A[3] = 0.0
    assert not independent(form(A))
    assert not independent(form(np.eye(4)[:, :3]))
    assert independent(form(np.zeros((0, 3))))


def hanging(links: int, off: float = 0.0) -> Scene:
    """A chain of bars in spherical joints, every other one out of place by `off` [m]."""
    bodies = tuple(Body(f"b{k}", bar(f"b{k}", 0.1), position=(0.1 * k, off * (k % 2), 0)) for k in range(links))
    joints = tuple(
        Joint(f"j{k}", "spherical", "ground.O" if k == 0 else f"b{k - 1}.b", f"b{k}.a") for k in range(links)
    )
    return Scene(bodies, joints, ground={"O": (0, 0, 0)}, gravity=(0, -9.81, 0), plane="none")


@pytest.mark.parametrize("off", [0.0, 1e-4])
def test_long_chains_are_assembled_without_dense_decompositions(monkeypatch, off):
    def dense(*given, **more):
        raise AssertionError("a decomposition that takes the cube of the number of rows")

    for name in ("lstsq", "svd", "matrix_rank"):
        monkeypatch.setattr(np.linalg, name, dense)
    assembled = assemble(hanging(LINKS, off))
    assert assembled.degrees_of_freedom == 3 * LINKS
    assert assembled.redundant == ()


def test_elimination_takes_the_least_degree_first_and_the_first_of_equals():
    """A star of four chains, by the definition: at each step the block whose neighbours have the fewest rows."""
    bodies = [(0, 1), (1, 2), (0, 3), (3, 4), (0, 5), (5, 6), (0,)]
    sizes = [5, 5, 5, 5, 5, 3, 2]
    neighbours = [{j for j in range(7) if j != i and set(bodies[i]) & set(bodies[j])} for i in range(7)]
    order = []
    while len(order) < 7:
        left = [k for k in range(7) if k not in order]
        best = min(left, key=lambda k: (sum(sizes[g] for g in neighbours[k]), k))
        clique = neighbours[best]
        for k in clique:
            neighbours[k] = (neighbours[k] | clique) - {k, best}
        order.append(best)
    assert eliminate(sizes, bodies).order == tuple(order)
