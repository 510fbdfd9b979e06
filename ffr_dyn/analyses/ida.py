"""SUNDIALS' IDA on the stabilised index-2 equations (Gear, Leimkuhler & Gupta 1985), with y = [x, v, lam, mu, eta]:

    x_dot = T(x) (v + Phi_q^T mu) - p eta      eta holds the Euler parameters p of each body at length one
    M v_dot = f - Phi_q^T lam                  in body axes
    0 = Phi_q v + Phi_t,   0 = Phi(x, t),   0 = (p . p - 1) / 2

The solution has mu = 0 and eta = 0. Multipliers are left out of the error test, as the theory of index 2 wants it
(Brenan, Campbell & Petzold 1996, 5.4.3); the Jacobian is IDA's own, by differences.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ffr_dyn.compile.divided_steps import Rows
from ffr_dyn.consistency.assemble import Assembled
from ffr_dyn.consistency.evaluation import Evaluator, accelerations, closed, evaluate, evaluated_mass_matrix, locked
from ffr_dyn.equations.layout import Layout, to_body_axes, to_global_axes
from ffr_dyn.equations.motion import position_rates
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError, InputError

UNCONTROLLED = 1e20  # absolute tolerance of multipliers
MOST_STEPS = 100_000  # between two rows


@dataclass(frozen=True)
class _Parts:
    """Where x, v, lam, mu and eta stand in y."""

    x: slice
    v: slice
    lam: slice
    mu: slice
    eta: slice
    size: int


def by_ida(
    assembled: Assembled, at: Evaluator, rows: Rows, rtol: float, atol: float
) -> Iterator[tuple[float, Array, Array]]:
    """(time, x, v) at the output times.

    Raises InputError without the package, ComputationError when IDA gives up.
    """
    try:
        from sksundae.ida import IDA
    except ImportError:
        raise InputError("IDA needs the package scikit-sundae: pip install ffr[ida]") from None
    part = _parts(assembled)
    tolerances = np.full(part.size, UNCONTROLLED)
    tolerances[: part.v.stop] = atol

    def residual(t: float, y: Array, y_dot: Array, out: Array) -> int:
        out[:] = _residual(at, part, t, y, y_dot)
        return 0

    algebraic = list(range(part.lam.start, part.size))
    options: dict[str, Any] = {
        "rtol": rtol,
        "atol": tolerances,
        "algebraic_idx": algebraic,
        "max_num_steps": MOST_STEPS,
    }
    solver = IDA(residual, **options)
    (first, *later), (x, v), ended = rows[0].tolist(), (assembled.x, assembled.v), None
    yield first, x, v
    for time, parts in zip(later, rows[1], strict=True):
        for begin, end in parts:
            if begin != ended:
                x, v = closed(at, begin, x, v)
                solver.init_step(begin, *_start(at, part, begin, x, v))
            done, ended = solver.step(end, tstop=end), end
            if not done.success or not np.isfinite(done.y).all():
                raise ComputationError(
                    f"IDA stopped before t = {end:.6g} s: {done.message}; use other tolerances or another method, or "
                    "end before a position in which the mechanism locks"
                )
            x, v = done.y[part.x].copy(), done.y[part.v].copy()
        x, v = closed(at, time, x, v)
        yield time, x, v


def _parts(assembled: Assembled) -> _Parts:
    place, rows = assembled.system.layout, assembled.system.model.rows.kind.size
    ends = np.cumsum([place.x_size, place.v_size, rows, rows, len(place.n)]).tolist()
    x, v, lam, mu, eta = (slice(first, last) for first, last in zip([0, *ends[:-1]], ends, strict=True))
    return _Parts(x, v, lam, mu, eta, ends[-1])


def _start(at: Evaluator, part: _Parts, time: float, x: Array, v: Array) -> tuple[Array, Array]:
    """Consistent y and y_dot."""
    y, y_dot = np.zeros(part.size), np.zeros(part.size)
    y[part.x], y[part.v] = x, v
    y_dot[part.x] = position_rates(at.system.layout, x, v)
    y_dot[part.v] = accelerations(at, time, x, v)
    y[part.lam] = evaluate(at, time, x, v).lam
    return y, y_dot


def _residual(at: Evaluator, part: _Parts, time: float, y: Array, y_dot: Array) -> Array:
    place, x, v = at.system.layout, y[part.x], y[part.v]
    now = evaluate(at, float(time), x, v)
    rows = part.lam.stop - part.lam.start
    jacobian, across = now.jacobian[:rows], locked(place)
    stabilised = v + to_global_axes(place, x, jacobian.T @ y[part.mu])
    out = np.empty(part.size)
    out[part.x] = y_dot[part.x] - position_rates(place, x, stabilised)
    acceleration = to_body_axes(place, x, y_dot[part.v])
    motion = evaluated_mass_matrix(at) @ acceleration - now.force + jacobian.T @ y[part.lam]
    motion[across] = acceleration[across]
    out[part.v] = motion
    out[part.lam], out[part.mu] = now.nu[:rows], now.Phi[:rows]
    _hold_lengths(place, part, y, out)
    return out


def _hold_lengths(place: Layout, part: _Parts, y: Array, out: Array) -> None:
    """Add p eta to the rates of the Euler parameters p, and the rows of their lengths."""
    x, eta, rates, rows = y[part.x], y[part.eta], out[part.x], out[part.eta]
    for b in range(len(place.n)):
        p = x[place.p(b)]
        rates[place.p(b)] += eta[b] * p
        rows[b] = 0.5 * (p @ p - 1.0)
