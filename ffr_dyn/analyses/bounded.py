"""The bounded solution of unstable internal dynamics: stable inversion, as a two-point boundary value problem.

    dw/dt = F(t, w),   at the start: the parts of w - w_e along stable and neutral directions vanish,
                       at the end: those along unstable ones

with w_e the equilibria of the internal dynamics before and after the known motion. The times reach so far beyond the known
motion that the unstable part has died away backwards, the stable one forwards. Collocation by Hermite and Simpson (Lobatto
IIIA, order four), all times at once; Newton's method with the matrices of the end states, renewed along the path when that
converges slowly. (Devasia, Chen & Paden, IEEE Transactions on Automatic Control 41 (1996) 930-942; Ascher, Mattheij & Russell
1995, ch. 5.)
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass

import numpy as np
from scipy.linalg import schur
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu

from ffr_dyn.analyses.servo import ServoMotion, at_moment, at_rest, slope, slope_matrix
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError, InputError

ITERATIONS = 40
TOLERANCE = 1e-10  # of a correction, relative to the largest value
FOLDS = 25.0  # e-folds of the slowest internal motion in the added times
NEUTRAL = 1e-5  # of a real part, relative to the largest modulus, below which a direction is neutral
REST = 1e-6  # of a speed or an acceleration
SLOW = 0.3  # contraction, beyond which the matrices along the path are renewed


@dataclass(frozen=True)
class Bounded:
    """Settings of the bounded solution.

    before, after : times [s] added to the known motion; default: 25 e-folds of the slowest motion that grows or decays
    parts         : of an output step, for collocation
    """

    _: KW_ONLY
    before: float | None = None
    after: float | None = None
    parts: int = 1


@dataclass(frozen=True)
class _End:
    """An equilibrium w of the internal dynamics with its state x, matrix A, left bases of growing and other directions."""

    w: Array
    x: Array
    A: Array
    growing: Array
    other: Array
    slowest: float


def bounded_solution(
    own: ServoMotion, settings: Bounded, output_step: float, w: Array, x: Array
) -> tuple[Array, Array, list[Array], list[str]]:
    """Times (T,), w (T, 2 d), states x, and notes.

    Raises InputError when the known motion does not start and end at rest; ComputationError when nothing converges.
    """
    route = _equilibria(own, output_step, w, x)
    first, last = (_end(own, *route[k]) for k in (0, -1))
    if first.growing.shape[0] + last.other.shape[0] != w.size or first.growing.shape != last.growing.shape:
        raise ComputationError(
            f"the internal dynamics have {first.growing.shape[0]} growing motions at the start and "
            f"{last.growing.shape[0]} at the end: there is no bounded solution that belongs to both"
        )
    before = _whole(FOLDS / first.slowest if settings.before is None else settings.before, output_step)
    after = _whole(FOLDS / last.slowest if settings.after is None else settings.after, output_step)
    h = output_step / settings.parts
    rows = round((own.span[1] - own.span[0]) / output_step) * settings.parts
    times = own.span[0] + h * np.arange(-before * settings.parts, rows + after * settings.parts + 1)
    ws, xs = _collocated(own, times, first, last, route)
    keep = slice(None, None, settings.parts)
    note = f"bounded solution over {times[0]:.4g} to {times[-1]:.4g} s with {first.growing.shape[0]} growing internal motions"
    return times[keep], ws[keep], xs[keep], [note]


def _whole(span: float, output_step: float) -> int:
    return int(np.ceil(span / output_step - 1e-9))


# ---- ends ------------------------------------------------------------------------------------------------------------


def _equilibria(own: ServoMotion, output_step: float, w: Array, x: Array) -> list[tuple[float, Array, Array]]:
    """(time, y, x) of the equilibria along the known motion, as if it stood still at every output time."""
    y, route = w[: own.size], []
    for time in np.linspace(*own.span, round((own.span[1] - own.span[0]) / output_step) + 1):
        y, x = _equilibrium(own, float(time), y, x)
        route.append((float(time), y, x))
    return route


def _equilibrium(own: ServoMotion, time: float, y: Array, x: Array) -> tuple[Array, Array]:
    """Where the internal dynamics rest (Newton's method on y_ddot)."""
    for _ in range(ITERATIONS):
        now = at_rest(own, time, y, x)
        x = now.x
        h = 1e-6 * max(1.0, float(np.abs(y).max()))
        sides = [[at_rest(own, time, y + sign * h * one, x).y_ddot for sign in (1, -1)] for one in np.eye(y.size)]
        stiffness = np.array([(plus - minus) / (2 * h) for plus, minus in sides]).T
        step = np.linalg.lstsq(stiffness, -now.y_ddot, rcond=1e-12)[0]
        y = y + step
        if np.abs(step).max() < 1e-11 * max(1.0, float(np.abs(y).max())):
            if np.abs(now.y_ddot).max() <= REST * max(1.0, float(np.abs(stiffness).max())):
                return y, x
            break  # forces along a motion without stiffness
    raise ComputationError(
        f"at t = {time:.6g} s the internal dynamics have no equilibrium near the known motion: nothing holds "
        f"{', '.join(own.names)} against the forces there; add a spring, or let another motion be known"
    )


def _end(own: ServoMotion, time: float, y: Array, x: Array) -> _End:
    w = np.concatenate([y, np.zeros_like(y)])
    _require_rest(own, time, w, x)
    return _split(w, x, slope_matrix(own, time, w, x))


def _require_rest(own: ServoMotion, time: float, w: Array, x: Array) -> None:
    moment = at_moment(own, time, w, x)
    speed, change = float(np.abs(moment.v).max()), float(np.abs(moment.sigma).max())
    if max(speed, change) > REST:
        raise InputError(
            f"at t = {time:.6g} s a known motion is not at rest (speed {speed:.3g}, acceleration {change:.3g}): the bounded "
            "solution needs one that starts and ends at rest; give it ends where both are zero"
        )


def _split(w: Array, x: Array, A: Array) -> _End:
    """Left invariant subspaces of A by its real Schur form."""
    values = np.linalg.eigvals(A)
    limit = NEUTRAL * np.abs(values).max()
    _, vectors, count = schur(A.T, output="real", sort=lambda re, im: re > limit)
    _, others, rest = schur(A.T, output="real", sort=lambda re, im: re <= limit)
    moving = np.abs(values.real)[np.abs(values.real) > limit]
    slowest = float(moving.min()) if moving.size else 1.0
    return _End(w, x, A, vectors[:, :count].T, others[:, :rest].T, slowest)


# ---- all times at once -----------------------------------------------------------------------------------------------


def _collocated(
    own: ServoMotion, times: Array, first: _End, last: _End, route: list[tuple[float, Array, Array]]
) -> tuple[Array, list[Array]]:
    """Newton's method from the equilibria along the known motion."""
    clock, values = np.array([t for t, _, _ in route]), np.array([y for _, y, _ in route])
    rest = np.array([np.interp(times, clock, column) for column in values.T]).T
    ws = np.concatenate([rest, np.zeros_like(rest)], axis=1)
    xs = [route[int(np.argmin(np.abs(clock - time)))][2] for time in times]
    share = np.clip((times - own.span[0]) / (own.span[1] - own.span[0]), 0.0, 1.0)[:, None, None]
    matrices = (1 - share) * first.A + share * last.A
    solve, before, renewed = _linear(times, matrices, first, last), np.inf, False
    for _ in range(ITERATIONS):
        residual, xs = _residual(own, times, ws, xs, first, last)
        step = solve(residual).reshape(ws.shape)
        ws = ws - step
        size = float(np.abs(step).max())
        if size < TOLERANCE * max(float(np.abs(ws).max()), 1e-6):
            return ws, xs
        if size > SLOW * before and not (renewed and size < before):
            matrices = np.array([slope_matrix(own, t, w, x) for t, w, x in zip(times, ws, xs, strict=True)])
            solve, renewed = _linear(times, matrices, first, last), True
        before = size
    raise ComputationError(
        f"the bounded solution did not converge: the last correction was {size:.3g}; use a smaller output step or more parts"
    )


def _residual(
    own: ServoMotion, times: Array, ws: Array, xs: list[Array], first: _End, last: _End
) -> tuple[Array, list[Array]]:
    """Boundary conditions and the defects of Simpson's rule, and the states."""
    found = [slope(own, float(t), w, x) for t, w, x in zip(times, ws, xs, strict=True)]
    F, xs = np.array([f for f, _ in found]), [x for _, x in found]
    h = np.diff(times)[:, None]
    middle = 0.5 * (ws[:-1] + ws[1:]) + h / 8 * (F[:-1] - F[1:])
    between = 0.5 * (times[:-1] + times[1:])
    G = np.array([slope(own, float(t), w, x)[0] for t, w, x in zip(between, middle, xs[:-1], strict=True)])
    defects = ws[1:] - ws[:-1] - h / 6 * (F[:-1] + 4 * G + F[1:])
    ends = np.concatenate([first.other @ (ws[0] - first.w), last.growing @ (ws[-1] - last.w)])
    return np.concatenate([ends, defects.ravel()]), xs


def _linear(times: Array, A: Array, first: _End, last: _End) -> Callable[[Array], Array]:
    """Solver for the linearised residual with matrices A (T, 2 d, 2 d) at the times."""
    size, count, one = A.shape[1], times.size, np.eye(A.shape[1])
    rows, columns, values = [], [], []

    def put(row: int, column: int, block: Array) -> None:
        r, c = np.indices(block.shape)
        rows.append((row + r).ravel())
        columns.append((column + c).ravel())
        values.append(block.ravel())

    put(0, 0, first.other)
    put(first.other.shape[0], (count - 1) * size, last.growing)
    for k, h in enumerate(np.diff(times)):
        left, right, middle = A[k], A[k + 1], 0.5 * (A[k] + A[k + 1])
        put((k + 1) * size, k * size, -one - h / 6 * (left + 4 * middle @ (0.5 * one + h / 8 * left)))
        put((k + 1) * size, (k + 1) * size, one - h / 6 * (right + 4 * middle @ (0.5 * one - h / 8 * right)))
    entries = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
    found: Callable[[Array], Array] = splu(csc_matrix(entries, shape=(count * size, count * size))).solve
    return found
