"""The classical explicit Runge-Kutta method of order four on the index-1 equations."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from ffr_dyn.kernels.bodies import normalise, position_rates
from ffr_dyn.kernels.options import entry, inlined
from ffr_dyn.kernels.record import record
from ffr_dyn.kernels.stiffening import solve_stiffened
from ffr_dyn.kernels.system import (
    acceleration_target,
    evaluate,
    evaluate_on_constraints,
    finite,
    prepare,
    to_velocity_rates,
)
from ffr_dyn.kernels.tables import OK
from ffr_dyn.kernels.vectors import add_scaled, copy, fill


@inlined
def step(m, w, stages, t, h, x, v, alpha, beta, tolerance):
    """One step in place. Returns a status."""
    xs, vs = stages.x[4], stages.v[4]
    for k in range(4):
        a = 0.0 if k == 0 else (h if k == 3 else 0.5 * h)
        if k == 0:
            status = evaluate_on_constraints(m, w, t, x, v, tolerance)
            copy(xs, x)
            copy(vs, v)
        else:
            add_scaled(xs, x, a, stages.x[k - 1])
            add_scaled(vs, v, a, stages.v[k - 1])
            status = evaluate(m, w, t + a, xs, vs)
        if status != OK:
            return status
        acceleration_target(w.rows, alpha, beta, stages.target)
        solve_stiffened(m, w, xs, stages.target)
        position_rates(m.bodies, xs, vs, stages.x[k])
        to_velocity_rates(m.bodies.where, w.bodies.A, w.bodies.acc, stages.v[k])
    for k in range(4):
        weight = h / 3.0 if k in (1, 2) else h / 6.0
        add_scaled(x, x, weight, stages.x[k])
        add_scaled(v, v, weight, stages.v[k])
    normalise(m.bodies, x)
    return finite(x, v)


@entry
def rk4_run(m, w, stages, t0, h, first, substeps, x, v, alpha, beta, tolerance, out):
    """Fill the rows of `out`, `substeps` steps apart, from step number `first`. Returns (rows filled, status)."""
    number = first
    for row in range(out.time.size):
        fill(w.bodies.dinv, 1.0)
        prepare(m.bodies.where, m.markers, m.rows, m.pattern, w.bodies.dinv, w.rows.phiphi)
        for _ in range(substeps):
            w.info[3] = number
            status = step(m, w, stages, t0 + number * h, h, x, v, alpha, beta, tolerance)
            if status != OK:
                return row, status
            number += 1
        w.info[3] = number
        status = record(m, w, t0 + number * h, x, v, out, row)
        if status != OK:
            return row, status
    return out.time.size, OK


@dataclass(frozen=True)
class RK4:
    """Classical Runge-Kutta (Kutta 1901), as in Rantalainen 2007. Explicit: stable for h below about 2.8/omega_max of the
    *assembled* system, which exceeds the largest frequency of a free body; see `ROS2` where that is too small.

    step : time step [s]
    """

    step: float
    order: ClassVar[int] = 4
    implicit: ClassVar[bool] = False
    stage_count: ClassVar[int] = 5
    run: ClassVar[Any] = staticmethod(rk4_run)
