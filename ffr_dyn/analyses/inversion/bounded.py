"""The bounded solution of unstable internal dynamics: stable inversion, as a two-point boundary value problem.

    y_ddot = a(t, y, y_dot) + A(t, y) u,    s(t, y) = 0    at all times, y, y_ddot and u unknown at each;
    at the start the parts of the internal dynamics along stable and neutral directions rest,
    at the end those along unstable ones

in the equilibria before and after the known motion. The times reach so far beyond it that the unstable part has died away
backwards, the stable one forwards. As u is found with y, the known motions may be any number of derivatives away from it.
Numerov's scheme, of order four, all times at once,

    y_{k+1} - 2 y_k + y_{k-1} = h^2 (a_{k+1} + 10 a_k + a_{k-1}) / 12
    y_dot_k = (y_{k+1} - y_{k-1}) / 2h - h (a_{k+1} - a_{k-1}) / 12

answers motions faster than the step by their statics. Newton's method with derivatives from a few places along the path, more
of them where that converges slowly. What the scheme has beside the internal dynamics, oscillations near the ends that a step
divides by ten, is kept smallest in the third differences of u. The same with half the step, begun from the solution, tells
the error, which is of order four where the known motion is smooth, and down to one in u where derivatives of it jump.
(Devasia, Chen & Paden, IEEE Transactions on Automatic Control 41 (1996) 930-942; Brüls, Bastos & Seifried, Multibody System
Dynamics 31 (2014) 189-211; Hairer, Nørsett & Wanner 1993, sec. III.10.)
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import KW_ONLY, dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.interpolate import CubicSpline
from scipy.linalg import schur
from scipy.sparse.linalg import splu

from ffr_dyn.analyses.inversion.internal_dynamics import internal, time_unit
from ffr_dyn.analyses.inversion.plant import Look, Plant, Slopes, look, slopes
from ffr_dyn.consistency.evaluation import evaluate
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError, InputError

ITERATIONS = 40
TOLERANCE = 1e-10  # of a correction, relative to the largest value
ROUNDING = 1e-7  # the same, below which corrections that do not shrink any more are rounding
FOLDS = 25.0  # e-folds of the slowest internal motion in the added times
ENDS = 16  # steps of the added times at least, by which what the scheme has beside the internal dynamics has died away
NEUTRAL = 1e-5  # of a real part, relative to the modulus, below which a direction is neutral
STILL = 1e-3  # e-folds over the known motion, below which it is so too
REST = 1e-6  # of a motion in the time that the known one lasts, at a speed or an acceleration
SLOW = 0.3  # contraction, beyond which the derivatives along the path are renewed
PLACES = 17  # along the path, at which derivatives are found first
LONGEST = 2.0  # of the added times over the known motion's, by default
ENOUGH = 1e-3  # of the first correction: what half the step changes is known then
FAINT = 1e-4  # weight of what only the scheme needs at the ends, beside what the internal dynamics do
_ROUGH = 3  # times at either end at which the third differences of u are kept small
Told = Callable[[float], None] | None


@dataclass(frozen=True)
class Bounded:
    """Settings of the bounded solution.

    before, after : times [s] added to the known motion; default: 25 e-folds of the slowest motion that grows (before it) or
                    decays (after it), at most twice as long as the motion, at least 16 steps
    parts         : of an output step, for collocation

    >>> result = fd.mixed(scene, unknown=(torque,), end=0.5, output_step=1e-3, solution=fd.Bounded(before=0.2, after=0.2))
    """

    _: KW_ONLY
    before: float | None = None
    after: float | None = None
    parts: int = 1


@dataclass(frozen=True)
class Path:
    """The unknowns at times (T,): y, h^2 y_ddot (T, D), u (T, U), and states x near to y."""

    y: Array
    a: Array
    u: Array
    near: list[Array]


@dataclass(frozen=True)
class _End:
    """An equilibrium (y, u) with a state x; derivatives there; left bases, in (y, y_dot), of growing and other motions and of
    what known motions fix; the slowest rates [1/s] of growth and decay."""

    y: Array
    u: Array
    x: Array
    slopes: Slopes
    growing: Array
    other: Array
    chain: Array
    growth: float
    decay: float


@dataclass(frozen=True)
class Found:
    """What holds at output times: u (T, U), states (x, v), what forces have measured at each, with its turns."""

    u: Array
    states: list[tuple[Array, Array]]
    measured: list[Array]


def bounded_solution(
    of: Plant, settings: Bounded, output_step: float, y: Array, x: Array, progress: Told = None
) -> tuple[Array, Found, Found | None, list[str]]:
    """Times (T,), what is found, the same with half the step unless that does not converge, and notes.

    y, x : near the equilibrium before the known motion

    Raises InputError when the known motion does not start and end at rest; ComputationError when nothing converges.
    """
    places = list(_equilibria(of, y, x))
    first, last = places[0], places[-1]
    _require_rest(of, first, last)
    if first.growing.shape != last.growing.shape or len(first.other) != len(last.other):
        raise ComputationError(
            f"the internal dynamics have {len(first.growing)} growing motions at the start and {len(last.growing)} at the "
            "end: there is no bounded solution that belongs to both"
        )
    span, h = of.own.lasts, output_step / settings.parts
    before, after = (
        _whole(max(min(FOLDS / rate, LONGEST * span), ENDS * h) if wanted is None else wanted, output_step)
        for wanted, rate in ((settings.before, first.growth), (settings.after, last.decay))
    )
    rows = round(span / output_step) * settings.parts
    times = of.own.span[0] + h * np.arange(-before * settings.parts, rows + after * settings.parts + 1)
    path = _collocated(of, times, places, progress, _resting(of, times, places))
    notes = [
        f"bounded solution over {times[0]:.4g} to {times[-1]:.4g} s with {len(first.growing)} growing internal motions"
    ]
    finer = _halved(of, times, path, places, settings.parts)
    if finer is None:
        notes.append(
            "the error of the bounded solution is not known: with half the step it did not converge; use a smaller output "
            "step"
        )
    return times[:: settings.parts], _found(of, times, path, settings.parts), finer, notes


def _found(of: Plant, times: Array, path: Path, parts: int) -> Found:
    """What holds at every so many times of a path."""
    keep, rates = slice(None, None, parts), _velocities(path.y, path.a, float(times[1] - times[0]))
    looks = [
        look(of, float(t), *w)
        for t, *w in zip(times[keep], path.y[keep], rates[keep], path.u[keep], path.near[keep], strict=True)
    ]
    return Found(
        path.u[keep] * of.own.units.efforts, [(now.x, now.v) for now in looks], [now.measured for now in looks]
    )


def _whole(span: float, output_step: float) -> int:
    return int(np.ceil(span / output_step - 1e-9))


# ---- equilibria along the known motion -------------------------------------------------------------------------------


def _equilibria(of: Plant, y: Array, x: Array) -> Iterator[_End]:
    """Where the plant would rest if the known motion stood still, at a few times from its start to its end."""
    u, still = np.zeros(len(of.own.unknown)), np.zeros(of.size)
    at = slopes(of, of.own.span[0], y, still, u, x)
    for time in np.linspace(*of.own.span, PLACES):
        y, u, x = _equilibrium(of, float(time), y, u, x, at)
        at = slopes(of, float(time), y, still, u, x)
        yield _end(at, y, u, x, STILL / of.own.lasts)


def _equilibrium(of: Plant, time: float, y: Array, u: Array, x: Array, at: Slopes) -> tuple[Array, Array, Array]:
    """(y, u, x) by Newton's method on a(y, 0) + A u = 0, s(y) = 0, with derivatives from nearby, renewed where it is slow."""
    still, before, fresh = np.zeros(of.size), np.inf, False
    for _ in range(ITERATIONS):
        now = look(of, time, y, still, u, x)
        x, scale = now.x, time_unit(at) ** 2
        effect = np.linalg.norm(at.by_u, axis=0)  # of efforts on all that they move: what is stiff hardly follows them
        efforts = 1 / np.where(effect > 0, effect, 1.0)
        matrix = np.block([[scale * at.by_y, at.by_u * efforts], [at.outputs, np.zeros((len(u), len(u)))]])
        step = np.linalg.lstsq(matrix, -np.concatenate([scale * now.y_ddot, now.s]), rcond=1e-12)[0]
        y, u = y + step[: y.size], u + step[y.size :] * efforts / scale
        size, largest = float(np.abs(step[: y.size]).max()), max(1.0, float(np.abs(y).max()))
        slow = size > SLOW * before
        if size < 1e-11 * largest or (
            fresh and slow and size < ROUNDING * largest
        ):  # of the positions that x meets y by
            left = np.abs(now.y_ddot).max(), np.abs(now.s).max(initial=0.0)
            if left[0] <= REST * max(of.own.lasts**-2, float(np.abs(at.by_y).max())) and left[1] < REST:
                return y, u, x
            break  # forces along a motion without stiffness
        if slow:
            at = slopes(of, time, y, still, u, x)
        before, fresh = size, slow
    if np.abs(now.s).max(initial=0.0) > REST:
        raise ComputationError(f"at t = {time:.6g} s no position belongs to the known motions: they are out of reach")
    raise ComputationError(
        f"at t = {time:.6g} s the internal dynamics have no equilibrium near the known motion: nothing holds "
        f"{', '.join(of.left_free)} against the forces there; add a spring, or let another motion be known"
    )


def _end(at: Slopes, y: Array, u: Array, x: Array, still: float) -> _End:
    """The internal dynamics at an equilibrium, split by the real Schur form; rates below `still` [1/s] are neutral."""
    found, D = internal(at), y.size
    A = found.matrix
    values = np.linalg.eigvals(A)

    def grows(re: float, im: float) -> bool:
        return bool(re > max(NEUTRAL * np.hypot(re, im), still))

    _, vectors, count = schur(A.T, output="real", sort=grows)
    _, others, rest = schur(A.T, output="real", sort=lambda re, im: not grows(re, im))
    to_z = np.diag(np.repeat([1.0, time_unit(at)], D))
    rates = [values.real[values.real > 0], -values.real[values.real < 0]]
    moving = [rate[rate > still] for rate in rates]
    return _End(
        y, u, x, at,
        growing=vectors[:, :count].T @ found.basis.T @ to_z,
        other=others[:, :rest].T @ found.basis.T @ to_z,
        chain=found.chain @ to_z,
        growth=float(moving[0].min(initial=np.inf)),
        decay=float(moving[1].min(initial=np.inf)),
    )  # fmt: skip


def _require_rest(of: Plant, *ends: _End) -> None:
    own = of.own
    for time, end in zip(own.span, ends, strict=True):
        still = np.zeros(own.at.system.layout.v_size)
        rows = evaluate(own.at, time, end.x, still)
        speed, change = (np.abs(row[own.known]) for row in (rows.nu, rows.gamma))
        if np.max(np.maximum(speed, change * own.lasts) * own.lasts / own.units.known, initial=0.0) > REST:
            raise InputError(
                f"at t = {time:.6g} s a known motion is not at rest (speed {speed.max():.3g}, acceleration "
                f"{change.max():.3g}): the bounded solution needs one that starts and ends at rest; give it ends where both "
                "are zero"
            )


# ---- all times at once -----------------------------------------------------------------------------------------------


def _resting(of: Plant, times: Array, places: list[_End]) -> Path:
    """The equilibria along the known motion."""
    inside = np.linspace(*of.own.span, len(places))
    y = np.array([np.interp(times, inside, row) for row in np.array([end.y for end in places]).T]).T
    u = np.array([np.interp(times, inside, row) for row in np.array([end.u for end in places]).T]).T
    nearest = np.abs(times[:, None] - inside).argmin(axis=1)
    return Path(y, np.zeros_like(y), u.reshape(times.size, -1), [places[k].x for k in nearest])


def _halved(of: Plant, times: Array, path: Path, places: list[_End], parts: int) -> Found | None:
    """What is found with half the step, begun from a path at times; None where it does not converge."""
    fine = np.linspace(times[0], times[-1], 2 * times.size - 1)
    y, a, u = (CubicSpline(times, values)(fine) for values in (path.y, 0.25 * path.a, path.u))
    begun = Path(y, a, u, [path.near[k // 2] for k in range(fine.size)])
    try:
        return _found(of, fine, _collocated(of, fine, places, None, begun, ENOUGH), 2 * parts)
    except ComputationError:
        return None


def _collocated(of: Plant, times: Array, places: list[_End], progress: Told, path: Path, enough: float = 0.0) -> Path:
    """Newton's method from a path, until a correction is small, or that part of the first that is `enough`."""
    h, inside = float(times[1] - times[0]), np.linspace(*of.own.span, len(places))
    at = _between(inside, [end.slopes for end in places], times)
    count, size, before, done, first = PLACES, 0.0, np.inf, 0.0, 0.0
    stiff, settled = 1.0 + h**2 * max(float(np.linalg.norm(end.slopes.by_y, 2)) for end in places), np.inf
    solve = _linear(at, places[0], places[-1], h)
    for _ in range(ITERATIONS):
        try:
            found, residual = _residual(of, times, path, h)
        except ComputationError:  # where the corrections have led to
            break
        step = solve(residual, _boundary(path, places[0], places[-1], h))
        path = _moved(path, found, step)
        size = max(float(np.abs(step[k]).max(initial=0.0)) for k in (0, 1))
        if progress is not None:
            done = max(done, _done(size, TOLERANCE))
            progress(float(times[0] + (times[-1] - times[0]) * done))
        scale = max(float(np.abs(path.y).max()), 1e-6)
        first = first or size
        # what rounding is in y, the vibrations that the step does not resolve make larger in h^2 y_ddot
        moved = max(float(np.abs(step[0]).max(initial=0.0)), float(np.abs(step[1]).max(initial=0.0)) / stiff)
        if size < max(TOLERANCE * scale, enough * first) or ROUNDING * scale > moved > SLOW * settled:
            return path
        if size > SLOW * before and count < times.size:
            count = min(2 * count, times.size)
            with suppress(ComputationError):  # where the corrections have led to: the next look there tells it, too
                solve = _linear(_renewed(of, times, path, h, count), places[0], places[-1], h)
        before, settled = size, moved
    raise ComputationError(
        f"the bounded solution did not converge: the last correction was {size:.3g}; use a smaller output step, more parts, "
        "or fewer modes of flexible bodies"
    )


def _done(size: float, tolerance: float) -> float:
    """The share of the way that corrections have come, from a size of one to the tolerance."""
    return float(np.clip(np.log(max(size, 1e-300)) / np.log(tolerance), 0.0, 1.0))


def _velocities(y: Array, a: Array, h: float) -> Array:
    """(T, D) y_dot of y and h^2 y_ddot, to order four."""
    rate = np.empty_like(y)
    rate[1:-1] = (y[2:] - y[:-2]) / 2 - (a[2:] - a[:-2]) / 12
    rate[0] = y[1] - y[0] - (7 * a[0] + 6 * a[1] - a[2]) / 24
    rate[-1] = y[-1] - y[-2] + (7 * a[-1] + 6 * a[-2] - a[-3]) / 24
    return rate / h


def _residual(of: Plant, times: Array, path: Path, h: float) -> tuple[list[Look], tuple[Array, Array, Array]]:
    """The plant at all times, and how far a, s and Numerov's scheme are off."""
    rates = _velocities(path.y, path.a, h)
    found = [look(of, float(t), *w) for t, *w in zip(times, path.y, rates, path.u, path.near, strict=True)]
    dynamics = path.a - h**2 * np.array([now.y_ddot for now in found])
    scheme = path.y[2:] - 2 * path.y[1:-1] + path.y[:-2] - (path.a[2:] + 10 * path.a[1:-1] + path.a[:-2]) / 12
    return found, (dynamics, np.array([now.s for now in found]), scheme)


def _boundary(path: Path, first: _End, last: _End, h: float) -> Array:
    """The boundary conditions at both ends, whose residuals vanish in the mean square: see `_linear`."""
    rates = _velocities(path.y, path.a, h)
    start, end = (np.concatenate([path.y[k] - at.y, rates[k]]) for k, at in ((0, first), (-1, last)))
    smooth = np.diff(FAINT * h**2 * _effect(first) * path.u, n=3, axis=0)
    count = min(_ROUGH, len(smooth))
    return np.concatenate([
        first.other @ start, FAINT * (first.chain @ start), last.growing @ end, FAINT * (last.chain @ end),
        smooth[:count].ravel(), smooth[len(smooth) - count :].ravel(),
    ])  # fmt: skip


def _moved(path: Path, found: list[Look], step: tuple[Array, Array, Array]) -> Path:
    return Path(path.y + step[0], path.a + step[1], path.u + step[2], [now.x for now in found])


def _between(clock: Array, known: list[Slopes], times: Array) -> Slopes:
    """Derivatives (T, ., .) at the times, linear between those at a clock (K,), held outside."""
    place = np.interp(times, clock, np.arange(len(clock)))
    left = np.minimum(place.astype(int), max(len(clock) - 2, 0))
    share = (place - left)[:, None, None]
    stacked = {name: np.array([vars(at)[name] for at in known]) for name in vars(known[0])}
    return Slopes(**{
        name: (1 - share) * all_of[left] + share * all_of[np.minimum(left + 1, len(clock) - 1)]
        for name, all_of in stacked.items()
    })  # fmt: skip


def _renewed(of: Plant, times: Array, path: Path, h: float, count: int) -> Slopes:
    """Derivatives along the path, found at some of its times."""
    chosen = np.unique(np.linspace(0, times.size - 1, count).round().astype(int))
    rates = _velocities(path.y, path.a, h)
    found = [slopes(of, float(times[k]), path.y[k], rates[k], path.u[k], path.near[k]) for k in chosen]
    return _between(times[chosen], found, times)


_Step = Callable[[tuple[Array, Array, Array], Array], tuple[Array, Array, Array]]


def _linear(at: Slopes, first: _End, last: _End, h: float) -> _Step:
    """Solver for the change of (y, a, u) at all times that brings the equations to zero, and to the least in the mean square
    what shall vanish at the ends."""
    T, D, U = at.by_u.shape
    one = sp.eye_array(D)
    by_y, by_rate, by_u, outputs = (_diagonal(part) for part in (at.by_y, at.by_rate, at.by_u, at.outputs))
    rate_y, rate_a = (sp.csr_array(sp.kron(part, one)) / h for part in _rate_stencils(T))
    second, numerov = (
        sp.kron(sp.diags_array(values, offsets=[0, 1, 2], shape=(T - 2, T)), one)
        for values in ([1.0, -2.0, 1.0], [1 / 12, 10 / 12, 1 / 12])
    )
    equations = sp.block_array([
        [-(h**2) * (by_y + by_rate @ rate_y), sp.eye_array(T * D) - h**2 * by_rate @ rate_a, -(h**2) * by_u],
        [outputs, None, None],
        [second, -numerov, None],
    ])  # fmt: skip
    ends = _end_rows((T, D, U), rate_y, rate_a, first, last, FAINT * h**2 * _effect(first))
    count = ends.shape[0]
    system = splu(
        sp.csc_array(
            sp.block_array([[sp.eye_array(count), ends, None], [ends.T, None, equations.T], [None, equations, None]])
        )
    )

    def solve(residual: tuple[Array, Array, Array], boundary: Array) -> tuple[Array, Array, Array]:
        wanted = -np.concatenate([part.ravel() for part in residual])
        found = system.solve(np.concatenate([-boundary, np.zeros(ends.shape[1]), wanted]))
        y, a, u = np.split(found[count : count + ends.shape[1]], [T * D, 2 * T * D])
        return y.reshape(T, D), a.reshape(T, D), u.reshape(T, U)

    return solve


def _effect(end: _End) -> float:
    """How much a unit of effort accelerates [1/s^2]."""
    return float(np.linalg.norm(end.slopes.by_u)) or 1.0


def _end_rows(
    shape: tuple[int, int, int], rate_y: sp.csr_array, rate_a: sp.csr_array, first: _End, last: _End, faint: float
) -> Any:
    """The derivative of `_boundary`, sparse."""
    T, D, U = shape
    rows = []
    for at, parts in ((0, (first.other, FAINT * first.chain)), (T - 1, (last.growing, FAINT * last.chain))):
        own = slice(at * D, (at + 1) * D)
        place = sp.eye_array(T * D, format="csr")[own]
        for part in parts:
            of_y = part[:, :D] @ place + part[:, D:] @ rate_y[own]
            rows.append([sp.csr_array(of_y), sp.csr_array(part[:, D:] @ rate_a[own]), None])
    smooth = sp.diags_array([-1.0, 3.0, -3.0, 1.0], offsets=[0, 1, 2, 3], shape=(T - 3, T), format="csr")
    count = min(_ROUGH, T - 3)
    nothing = sp.csr_array((count * U, T * D))
    rows += [
        [nothing, None, faint * sp.kron(part, sp.eye_array(U))] for part in (smooth[:count], smooth[T - 3 - count :])
    ]
    return sp.block_array([row for row in rows if row[0].shape[0]], format="csr")


def _rate_stencils(T: int) -> tuple[sp.csr_array, sp.csr_array]:
    """(T, T) how h y_dot follows from y and h^2 y_ddot at all times: see `_velocities`."""
    one = np.eye(T)
    return tuple(sp.csr_array(h_rate) for h_rate in (_velocities(one, 0 * one, 1.0), _velocities(0 * one, one, 1.0)))


def _diagonal(blocks: Array) -> sp.csr_array:
    """The block-diagonal matrix of (T, r, c)."""
    count, r, c = blocks.shape
    whole = sp.bsr_array((blocks, np.arange(count), np.arange(count + 1)), shape=(count * r, count * c))
    return sp.csr_array(whole)
