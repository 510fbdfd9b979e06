"""Rows of eight, arrays at addresses: the forms by hand equal the plain ones, which run where numba is another."""

import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
import pytest
from numba import njit
from places import ROOT
from synthetic import cloud, mirrored

from ffr_dyn.compile.engine import Engine, evaluate_at, new_engine
from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.kernels.entry_points import evaluate_exact
from ffr_dyn.kernels.multiplier_solver import (
    couple_sides,
    eliminate_rows,
    eliminate_side,
    factorise_rows,
    solve_lower,
    solve_upper,
)
from ffr_dyn.kernels.options import OPTIONS
from ffr_dyn.kernels.products import multiply, multiply_both
from ffr_dyn.kernels.simd import lanes, plain
from ffr_dyn.kernels.simd.intrinsics import PLAIN, compiled_forms
from ffr_dyn.kernels.simd.slices import part, peek, three_parts, vector_at
from ffr_dyn.kernels.simd.table_address import _view, pack
from ffr_dyn.kernels.tables import F1, F2, I1, LANES, OK
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene


class Inner(NamedTuple):
    """A table in a table."""

    u: F2
    user_count: int


class System(NamedTuple):
    """Numbers and arrays that compiled code finds at an address; its fields have names of some in `tables`."""

    mass: float
    bodies: Inner
    x: F1
    kind: I1


NAMES = ("load", "store", "zeros", "plus", "less", "scaled", "times", "total", "before", "after")


def compiled(function):
    return njit(**OPTIONS)(function)


def results_of(forms, numbers, at, k):
    """What all functions of rows make of random numbers, one row after the other."""
    f = SimpleNamespace(**{name: getattr(forms, name) for name in NAMES})
    load, store, zeros, plus, less = f.load, f.store, f.zeros, f.plus, f.less
    scaled, times, total, before, after = f.scaled, f.times, f.total, f.before, f.after

    @compiled
    def run(a, at, k, out):
        row, other = load(a, at), load(a, at + 8)
        store(out, 0, row)
        store(out, 8, zeros())
        store(out, 16, plus(row, a[k], other))
        store(out, 24, less(row, a[k], other))
        store(out, 32, scaled(a[k], row))
        store(out, 40, times(row, other))
        store(out, 48, before(row, k))
        store(out, 56, after(row, k))
        out[64] = total(row)

    out = np.full(65, np.nan)
    run(numbers, at, k, out)
    return out


@pytest.mark.skipif(PLAIN, reason="numba's inner parts are not as expected: nothing is by hand")
@pytest.mark.parametrize("k", range(LANES))
def test_rows_of_eight_equal_their_plain_form(k):
    numbers = np.random.default_rng(k).normal(size=40)
    by_hand, plainly = (results_of(forms, numbers, 3 + k, k) for forms in (lanes, plain))
    np.testing.assert_allclose(by_hand, plainly, rtol=1e-14, atol=1e-14)
    row = numbers[3 + k : 3 + k + LANES]
    np.testing.assert_allclose(by_hand[48:56], np.where(np.arange(LANES) < k, row, 0.0), rtol=0)
    np.testing.assert_allclose(by_hand[56:64], np.where(np.arange(LANES) > k, row, 0.0), rtol=0)


# ---- what is written over them -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("size", range(1, 7))
def test_blocks_of_joints_are_factorised_and_solved(size):
    rng = np.random.default_rng(size)
    root = rng.normal(size=(size, size))
    A, B, b = root @ root.T + np.eye(size), rng.normal(size=(size, LANES)), np.zeros(LANES)
    b[:size] = rng.normal(size=size)

    @compiled
    def run(size, S, least, pivots, Y, raw, b):
        factorise_rows(size, S, 0, least, 0, pivots, 0, raw)
        eliminate_rows(size, S, 0, 8 * size, pivots, 0, Y)
        solve_lower(size, S, 0, b, 0)
        for k in range(8):
            b[k] *= pivots[k]
        solve_upper(size, S, 0, b, 0)

    S = np.zeros((2 * size, LANES))
    S[:size, :size], S[size:] = A, B
    pivots, Y, raw, x = np.zeros(LANES), np.zeros((12, LANES)), np.zeros(LANES), b.copy()
    run(size, S.ravel(), np.zeros(LANES), pivots, Y.ravel(), raw, x)
    np.testing.assert_allclose(x[:size], np.linalg.solve(A, b[:size]), rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(1.0 / pivots[:size], raw[:size], rtol=1e-14)
    np.testing.assert_allclose(Y[:size].T @ S[size:], B.T @ np.linalg.solve(A, B), rtol=1e-10, atol=1e-11)


@pytest.mark.parametrize("flexible", [False, True])
@pytest.mark.parametrize("plane", [False, True])
def test_sides_are_eliminated_and_coupled(flexible, plane):
    rng, n = np.random.default_rng(5), 3 if plane else 6
    rigid, elastic = ((0, 2, 4), (0, 2, 7)) if plane else ((0, 1, 2, 3, 4, 5), (0, 1, 2, 6, 7, 8))
    jac, P, phiphi = rng.normal(size=(9, LANES)), rng.normal(size=(n, n)), rng.normal(size=(n, n))
    factor = np.tril(rng.normal(size=(6, 6))) + 4 * np.eye(6)
    L = factor.copy()
    np.fill_diagonal(L, 1 / factor.diagonal())

    @compiled
    def run(jac, rigid, elastic, flexible, P, L, X, size, phiphi, scratch, S):
        eliminate_side(jac, rigid, elastic, flexible, P, L, X, 0)
        couple_sides(X, 0, 0, 5, size, flexible, phiphi, scratch, S, 0)

    X, S = np.zeros((12, LANES)), np.zeros((5, LANES))
    run(
        jac.ravel(), rigid, elastic, flexible, P.ravel(), L.ravel(), X.ravel(), n,
        phiphi.ravel(), np.zeros(12 * LANES), S.ravel(),
    )  # fmt: skip
    moved, bent = jac[list(rigid)], jac[list(elastic)]
    left = np.linalg.solve(factor[np.ix_(rigid, rigid)], moved - P @ bent if flexible else moved)
    np.testing.assert_allclose(X[:n], left, rtol=1e-12, atol=1e-13)
    coupled = left.T @ left + (bent.T @ phiphi.T @ bent if flexible else 0.0)
    np.testing.assert_allclose(S, coupled[:5], rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("count", [1, 2, 7, 32])
@pytest.mark.parametrize("width", [1, 8, 24, 33, 72, 100])
def test_products_of_a_table(count, width):
    rng = np.random.default_rng(count * width)
    table, x, xd = rng.normal(size=(count, width)), *rng.normal(size=(2, count + 1))

    @compiled
    def run(count, width, table, x, xd, alone, y, yd):
        multiply(count, width, table, 2, x, 1, alone, 3)
        multiply_both(count, width, table, 2, x, xd, 1, y, yd, 1, 2)

    alone, y, yd = np.zeros((3, width + 2 * LANES))
    run(count, width, np.concatenate([[0.0, 0.0], table.ravel(), np.zeros(LANES)]), x, xd, alone, y, yd)
    np.testing.assert_allclose(alone[3 : 3 + width], x[1:] @ table, rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(y[1 : 1 + width], x[1:] @ table, rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(yd[2 : 2 + width], xd[1:] @ table, rtol=1e-12, atol=1e-13)


# ---- another numba -----------------------------------------------------------------------------------------------------

# In every process, those that compile included: numba's inner parts cannot be imported by the package.
WITHOUT = """
import builtins

real = builtins.__import__

def guarded(name, names=None, *rest, **more):
    if name.startswith(("numba.core", "numba.np")) and str((names or {}).get("__name__")).startswith("ffr_dyn"):
        raise ImportError(f"{name} is not there")
    return real(name, names, *rest, **more)

builtins.__import__ = guarded
"""
# Small parts of numbers that a kernel finds at an address; a whole scene.
SMALL = """
import sys
import numpy as np
from test_simd import PLAIN, numbers_at_an_address
np.savez(sys.argv[1], plain=PLAIN, found=numbers_at_an_address())
"""
WHOLE = """
import sys
import numpy as np
from test_simd import PLAIN, small_motion
np.savez(sys.argv[1], plain=PLAIN, found=small_motion())
"""


def numbers_at_an_address():
    """What a kernel finds in packed tables: rows, parts, numbers, shapes, inner tables."""
    view, rng = _view(System), np.random.default_rng(3)
    tables = System(0.25, Inner(rng.normal(size=(4, 8)), 7), rng.normal(size=24), np.arange(5))

    @compiled
    def run(address, out):
        r = view(address)
        lanes.store(out, 0, lanes.plus(lanes.load(r.x, 3), r.mass, lanes.load(part(r.bodies.u, 8, 16), 8)))
        first, second, third = three_parts(r.x, 8)
        out[8], out[9], out[10] = first[1], second[2], third[3]
        out[11], out[12], out[13] = r.bodies.u.shape[0], r.bodies.u.shape[1], r.bodies.user_count
        out[14], out[15], out[16] = (
            peek(r.kind, 3),
            r.bodies.u[3, 2],
            vector_at(plain.reals_at(r.x.ctypes.data + 8), 5)[4],
        )

    out, words = np.zeros(17), pack(tables)
    run(words.ctypes.data, out)
    pool, rows = tables.x, tables.bodies.u
    np.testing.assert_allclose(out[:8], pool[3:11] + 0.25 * rows[2], rtol=1e-14)
    np.testing.assert_allclose(out[8:], [pool[1], pool[10], pool[19], 4, 8, 7, 3, rows[3, 2], pool[5]], rtol=0)
    return out


def small_motion():
    """Accelerations and multipliers of `small_engine`."""
    engine = small_engine()
    assert evaluate_at(engine, 0.0, engine.x, engine.v) == OK
    return np.concatenate([engine.work.vd, engine.work.rows.lam])


def small_engine() -> Engine:
    """Two flexible bodies, one of them in blocks by its symmetry, and where they are at the start."""
    scene = Scene(
        bodies=(Body("one", mirrored(24, 2), damping=0.02), Body("two", cloud(3), omega_bar=(0.1, -0.2, 0.3))),
        joints=(Joint("root", "spherical", "ground.O", "one.a"),),
        ground={"O": (0.1, 0.2, 0.3)},
        gravity=(0.5, -9.81, 0.2),
    )
    start = assemble(scene)
    return new_engine(start.system, start.x, start.v)


def run_python(code, *arguments, **environment):
    places = ROOT, ROOT / "tests", Path(__file__).parent
    paths = os.pathsep.join([environment.pop("first", ""), *map(str, places)]).strip(os.pathsep)
    return subprocess.run(
        [sys.executable, "-c", code, *arguments], capture_output=True, text=True, cwd=ROOT, check=True,
        env={**os.environ, **environment, "PYTHONPATH": paths},
    )  # fmt: skip


def test_another_numba_is_noticed():
    code = "import numba; numba.__version__ = '9.0.1'; import ffr_dyn.kernels.simd.intrinsics as i; print(i.PLAIN)"
    found = run_python(code, NUMBA_CACHE_DIR="unused")
    assert found.stdout.split() == ["True"]
    assert found.stderr.count("plain kernels run") == 1
    assert "9.0.1" in found.stderr


@pytest.mark.parametrize(
    ("code", "here"),
    [(SMALL, numbers_at_an_address), pytest.param(WHOLE, small_motion, marks=pytest.mark.slow)],
    ids=["numbers", "scene"],
)
def test_plain_kernels_run_where_the_inner_parts_of_numba_are_missing(tmp_path, code, here):
    (tmp_path / "sitecustomize.py").write_text(WITHOUT)
    found = run_python(code, str(tmp_path / "out.npz"), first=str(tmp_path), NUMBA_CACHE_DIR=str(tmp_path / "compiled"))
    assert found.stderr.count("plain kernels run") == 1
    there, expected = np.load(tmp_path / "out.npz"), here()
    assert there["plain"]
    np.testing.assert_allclose(there["found"], expected, rtol=0, atol=1e-11 * np.abs(expected).max())


def test_compiled_forms_are_found_by_their_function():
    small_engine()
    assert compiled_forms(evaluate_exact.general.function)
    assert not compiled_forms(small_engine)
