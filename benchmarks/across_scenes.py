"""What vectors across scenes would bring: the factor and solution of a body's 6 x 6 matrix, scene by scene and eight at once.

    python -m benchmarks.across_scenes

The engine's own kernels, on matrices one after another, and on matrices of eight scenes whose equal entries lie side by side,
which leaves it to the compiler to serve eight scenes by one instruction. Printed are nanoseconds of processor time a scene
and the share of solutions that are equal to the bit.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from numba import njit

from ffr_dyn.kernels.options import OPTIONS
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
    eight, beside = measured(eight_at_once, [side_by_side(a) for a in given])
    same = np.moveaxis(beside, -1, 1).reshape(alone.shape) == alone
    print(f"one by one {single:.1f} ns, eight at once {eight:.1f} ns: {single / eight:.2f} times as many a second")
    print(f"{same.mean():.0%} of the numbers of the solutions are equal to the bit")


if __name__ == "__main__":
    main()
