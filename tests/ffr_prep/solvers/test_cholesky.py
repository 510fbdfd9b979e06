"""The sparse factorisation against dense ones, whatever the shape of the graph."""

from itertools import combinations

import numpy as np
import pytest
import scipy.sparse as sp
from boxes import STEEL, box_mesh, shaken
from scipy.sparse.csgraph import maximum_flow

from ffr_prep.solids.assembly import assemble
from ffr_prep.solvers.cholesky import cholesky, solve_cholesky
from ffr_prep.solvers.nested_dissection import _cut, elimination_tree
from ffr_prep.solvers.separators import narrowest, separated


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


def test_it_tells_how_far_it_is():
    A, positions = clamped("tet10", (8, 4, 3))
    told = []
    factor = cholesky(A, positions, lambda share, words: told.append((share, words)))
    shares, count = [share for share, _ in told], len(factor.fronts.children)
    assert len(told) > 10
    assert told[0][1].startswith("the factor takes ")
    assert shares[0] == 0 < shares[1] < 0.2
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1)
    assert told[-1][1] == f"{count} of {count} fronts"


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


@pytest.mark.parametrize("held", [[0], [3, 70, 71, 200], list(range(40, 60))])
def test_unknowns_that_are_held_are_zero(held):
    """And the others are those of the matrix without their rows and columns, which may be singular with them."""
    A, positions = clamped("tet10", (5, 2, 2))
    free = np.delete(np.arange(A.shape[0]), held)
    whole = A.tolil()
    whole[held, held] = -1.0
    b = np.random.default_rng(0).normal(size=(A.shape[0], 2))
    x = solve_cholesky(cholesky(sp.csr_array(whole), positions, held=np.array(held)), b)
    assert not x[held].any()
    np.testing.assert_allclose(
        x[free], np.linalg.solve(A.toarray()[np.ix_(free, free)], b[free]), rtol=0, atol=1e-9 * np.abs(x).max()
    )


def test_a_factor_takes_little_more_than_its_lower_triangle():
    """And of leaves little more than the triangle of their own: their other rows are those of the matrix."""
    A, positions = clamped("tet10", (12, 5, 4))
    fronts = cholesky(A, positions).fronts
    own, rest, leaf = np.diff(fronts.starts), np.diff(fronts.ends), fronts.children == 0
    lower = own * (own + 1) // 2 + np.where(leaf, 0, own * rest)
    assert lower.sum() < fronts.panels.size < 1.12 * lower.sum()
    assert leaf.sum() > 20
    assert fronts.panels.size < 0.8 * (lower + np.where(leaf, own * rest, 0)).sum()


@pytest.mark.parametrize("columns", [1, 4, 7, 17])
def test_a_matrix_that_is_one_leaf_or_all_leaves(columns):
    """Points that nothing connects but a last one, which follows them all."""
    A, positions = clamped("tet4", (1, 1, 1))
    assert_solves(A, positions, columns)
    count = 90
    star = sp.lil_array((count, count))
    star[-1, :-1] = star[:-1, -1] = -1.0
    star.setdiag([*np.arange(2.0, count + 1), 2.0 * count])
    positions = np.random.default_rng(3).normal(size=(count, 3))
    positions[-1] = np.nan
    assert_solves(star, positions, columns)


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


def test_the_same_matrix_gives_the_same_bits_with_any_number_of_threads(monkeypatch):
    A, positions = clamped("tet10", (12, 5, 4))
    b = np.random.default_rng(0).normal(size=(A.shape[0], 5))
    factor = cholesky(A, positions)
    assert len(factor.division.branches) > 8
    x = solve_cholesky(factor, b)
    for threads in (1, 3):
        monkeypatch.setattr("os.cpu_count", lambda threads=threads: threads)
        again = cholesky(A, positions)
        assert again.fronts.panels.tobytes() == factor.fronts.panels.tobytes()
        assert solve_cholesky(again, b).tobytes() == x.tobytes()


@pytest.mark.slow
def test_large_fronts_are_eliminated_by_tiles(monkeypatch):
    """The same numbers as in one piece, up to rounding."""
    A, positions = clamped("tet10", (8, 4, 4))
    monkeypatch.setattr("ffr_prep.solvers.cholesky._TILE", 50)
    monkeypatch.setattr("ffr_prep.solvers.cholesky._BRANCHES", 200)
    factor = cholesky(A, positions)
    own = np.diff(factor.fronts.starts)[factor.division.trunk]
    assert own.max() > 100
    assert_solves(A, positions)
    assert_solves(A, positions, columns=17)


def test_pieces_below_a_piece_precede_it_and_separate_its_halves():
    A, positions = clamped("tet10", (8, 4, 3))
    pieces, children = elimination_tree(A, positions)
    np.testing.assert_array_equal(np.sort(np.concatenate(pieces)), np.arange(A.shape[0]))
    first = list(range(len(pieces)))
    for k, below in enumerate(children):
        ends = [first[child] for child in below] + [k]
        assert all(child + 1 == end for child, end in zip(below, ends[1:], strict=True))
        first[k] = ends[0]
        for one, other in combinations(below, 2):
            rows, columns = (np.concatenate(pieces[first[side] : side + 1]) for side in (one, other))
            assert A[rows][:, columns].nnz == 0


def test_the_separator_is_a_smallest_one():
    """A comb of 20 points on a line, each touching the ten beyond the middle: one point of the spine parts it."""
    points = np.column_stack([np.arange(20.0), np.zeros((20, 2))])
    edges = sp.lil_array((20, 20))
    for spine, tooth in [(9, k) for k in range(10, 20)] + [(10, k) for k in range(9)]:
        edges[spine, tooth] = edges[tooth, spine] = 1
    place = np.full(20, -1)
    one, two, separator = _cut(points, sp.csr_array(edges), np.arange(20), place)
    assert separator.tolist() in ([9], [10])
    assert (place == -1).all()
    np.testing.assert_array_equal(np.sort(np.concatenate([one, two, separator])), np.arange(20))


@pytest.mark.parametrize("near", [0.1, 0.16, 0.3, 2.0])
def test_no_separator_is_smaller(near):
    """Random points that touch those near them: as SciPy's largest flow through points of capacity one counts."""
    rng = np.random.default_rng(int(100 * near))
    points = rng.random((150, 3)) * [2.0, 1.0, 0.2]
    distances = np.linalg.norm(points[:, None] - points, axis=2)
    graph = sp.csr_array((distances < near) & ~np.eye(150, dtype=bool))
    ordered = np.argsort(points[:, 0])
    one, two, separator = separated(graph.indptr, graph.indices, ordered, 40, 110, np.full(150, -1))
    assert not graph[one][:, two].nnz
    assert set(ordered[110:]) <= set(two) | set(separator)
    touching = ordered[:40][graph[ordered[:40]][:, ordered[110:]].sum(axis=1) > 0]
    fixed = np.setdiff1d(ordered[:40], touching)
    assert len(separator) == _largest_flow(graph, fixed, touching, ordered[110:])


@pytest.mark.parametrize("near", [0.1, 0.3, 2.0])
def test_the_narrowest_place_is_where_fewest_points_touch_points_behind(near):
    rng = np.random.default_rng(int(10 * near))
    points = rng.random((150, 3)) * [2.0, 1.0, 0.2]
    distances = np.linalg.norm(points[:, None] - points, axis=2)
    ordered, place = np.argsort(points[:, 0]), np.full(150, -1)
    touches = (distances < near)[np.ix_(ordered, ordered)] & ~np.eye(150, dtype=bool)
    graph = sp.csr_array((distances < near) & ~np.eye(150, dtype=bool))
    counts = [int(touches[:cut, cut:].any(axis=1).sum()) for cut in range(151)]
    found = narrowest(graph.indptr, graph.indices, ordered, 30, 120, place)
    best = min(range(30, 121), key=lambda cut: (counts[cut], abs(2 * cut - 150)))
    assert (counts[found], abs(2 * found - 150)) == (counts[best], abs(2 * best - 150))
    assert (place == -1).all()


def test_large_parts_are_cut_at_their_necks_and_others_as_they_were(monkeypatch):
    """A bar of 4 x 4 points with a neck of 2 x 2 at three tenths of its length: the cut lies in the neck either way."""
    length, neck = 60, slice(16, 20)
    inside = np.ones((length, 4, 4), bool)
    inside[neck] = False
    inside[neck, :2, :2] = True
    points = np.argwhere(inside).astype(float)
    distances = np.abs(points[:, None] - points).max(axis=2)
    graph = sp.csr_array((distances < 1.5) & (distances > 0))
    for large in (20_000, 100):
        monkeypatch.setattr("ffr_prep.solvers.nested_dissection._LARGE", large)
        separator = _cut(points, graph, np.arange(len(points)), np.full(len(points), -1))[2]
        assert len(separator) == 4
        assert set(points[separator, 0]) <= {16.0, 17.0, 18.0, 19.0}


def _largest_flow(graph, below, touching, above):
    """From `below` and `touching` to `above`, with an entry and an exit of each point and one unit between them."""
    count, many = graph.shape[0], 10**6
    rows, columns = graph.nonzero()
    through = np.full(count, 1)
    through[below] = through[above] = many
    start, stop = np.concatenate([below, touching]), above
    ends = np.full(count, 2 * count), np.full(count, 2 * count + 1)
    i = np.concatenate([np.arange(count), rows + count, ends[0][: start.size], stop + count])
    j = np.concatenate([np.arange(count) + count, columns, start, ends[1][: stop.size]])
    units = np.concatenate([through, np.full(rows.size + start.size + stop.size, many)])
    arcs = sp.csr_array((units.astype(np.int32), (i, j)), shape=(2 * count + 2, 2 * count + 2))
    return maximum_flow(sp.csr_matrix(arcs), 2 * count, 2 * count + 1).flow_value


def test_a_matrix_that_is_not_positive_definite_is_refused():
    A, positions = clamped("hex8", (5, 3, 3))
    with pytest.raises(np.linalg.LinAlgError, match="not positive"):
        cholesky(sp.csr_array(A - 1e12 * sp.eye_array(A.shape[0])), positions)
