"""The gain of vectors across scenes: the factor and solution of a body's 6 x 6 matrix, scene by scene and eight at once.

    python -m benchmarks.across_scenes

The engine's own kernels, on matrices one after another; the same on matrices of eight scenes whose equal entries lie side by
side, which leaves it to the compiler to serve eight scenes by one instruction, and it does not; and the same written for rows
of eight. Printed are nanoseconds of processor time a scene and the share of solutions that are equal to the bit.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from llvmlite import ir
from numba import njit

from ffr_dyn.kernels.options import OPTIONS
from ffr_dyn.kernels.simd.intrinsics import cgutils, intrinsic
from ffr_dyn.kernels.simd.lanes import ROW, VECTOR, load, store, times
from ffr_dyn.kernels.tables import LANES
from ffr_dyn.kernels.vectors import cholesky_six, cholesky_three, lower_six, upper_six
from ffr_prep.common.arrays import Array

SCENES, REPEATS = 64, 1000


@njit(**OPTIONS)
def one_by_one(T, L, b):
    for s in range(T.shape[0]):
        cholesky_three(T[s])
        cholesky_six(T[s], L[s])
        lower_six(L[s], b[s])
        upper_six(L[s], b[s])


@njit(**OPTIONS)
def eight_at_once(T, L, b):
    for g in range(T.shape[0]):
        for s in range(LANES):
            cholesky_three(T[g, :, :, s])
            cholesky_six(T[g, :, :, s], L[g, :, :, s])
            lower_six(L[g, :, :, s], b[g, :, s])
            upper_six(L[g, :, :, s], b[g, :, s])


@intrinsic
def less_product(typing, row, one, other):  # type: ignore[no-untyped-def]
    """row - one other, lane by lane."""

    def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
        return builder.fsub(args[0], builder.fmul(*args[1:], flags=("contract",)), flags=("contract",))

    return ROW(ROW, ROW, ROW), generate


@intrinsic
def one_over_root(typing, row):  # type: ignore[no-untyped-def]
    """1 / sqrt(row), lane by lane."""

    def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
        kind = ir.FunctionType(VECTOR, [VECTOR])
        root = cgutils.get_or_insert_function(builder.module, kind, f"llvm.sqrt.v{LANES}f64")
        return builder.fdiv(ir.Constant(VECTOR, [1.0] * LANES), builder.call(root, args))

    return ROW(ROW), generate


@njit(**OPTIONS)
def factor_rows(L, first):
    """Rows `first` to first + 2 of the factors of eight 6 x 6 matrices."""
    for i in range(first, first + 3):
        for j in range(i + 1):
            row = load(L, LANES * (6 * i + j))
            for k in range(j):
                row = less_product(row, load(L, LANES * (6 * i + k)), load(L, LANES * (6 * j + k)))
            store(L, LANES * (6 * i + j), one_over_root(row) if i == j else times(row, load(L, LANES * 7 * j)))


@njit(**OPTIONS)
def rows_of_eight(T, L, b):
    for g in range(T.shape[0]):
        for i in range(3):
            for j in range(i + 1):
                store(L[g], LANES * (6 * i + j), load(T[g], LANES * (3 * i + j)))
        factor_rows(L[g], 0)
        factor_rows(L[g], 3)
        for i in range(6):
            row = load(b[g], LANES * i)
            for k in range(i):
                row = less_product(row, load(L[g], LANES * (6 * i + k)), load(b[g], LANES * k))
            store(b[g], LANES * i, times(row, load(L[g], LANES * 7 * i)))
        for i in range(5, -1, -1):
            row = load(b[g], LANES * i)
            for k in range(5, i, -1):
                row = less_product(row, load(L[g], LANES * (6 * k + i)), load(b[g], LANES * k))
            store(b[g], LANES * i, times(row, load(L[g], LANES * 7 * i)))


def side_by_side(a: Array) -> Array:
    """(scenes, ...) -> (scenes / 8, ..., 8)."""
    return np.ascontiguousarray(np.moveaxis(a.reshape(-1, LANES, *a.shape[1:]), 1, -1))


def measured(function: Callable[..., None], given: list[Array]) -> tuple[float, Array]:
    """Nanoseconds a scene, and the solutions."""
    least, work = np.inf, [a.copy() for a in given]
    for _ in range(REPEATS):
        for own, a in zip(work, given, strict=True):
            own[:] = a
        began = time.thread_time_ns()
        function(*work)
        least = min(least, time.thread_time_ns() - began)
    return least / SCENES, work[-1]


def main() -> None:
    """Print the figures."""
    rng = np.random.default_rng(0)
    B = rng.normal(size=(SCENES, 6, 12))
    M = B @ B.transpose(0, 2, 1)
    given = [M[:, :3, :3].copy(), M, rng.normal(size=(SCENES, 6))]
    single, alone = measured(one_by_one, given)
    print(f"one by one         {single:6.1f} ns")
    for what, function in (("left to compiler", eight_at_once), ("in rows of eight", rows_of_eight)):
        eight, beside = measured(function, [side_by_side(a) for a in given])
        same = np.moveaxis(beside, -1, 1).reshape(alone.shape) == alone
        print(f"{what}   {eight:6.1f} ns, {single / eight:.2f} times as many; {same.mean():.0%} equal to the bit")


if __name__ == "__main__":
    main()
