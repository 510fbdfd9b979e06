"""The classical explicit Runge-Kutta method of order four on the index-1 equations.

Twin: the statement above, held by
`tests/ffr_dyn/kernels/test_dyn_laws.py::test_motion_converges_at_the_order_of_the_method`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from ffr_dyn.integrators.step import check_step
from ffr_dyn.kernels.integrator_api import (
    OK,
    CompiledFunction,
    H,
    Tables,
    acceleration_target,
    add_four,
    add_scaled,
    copy,
    evaluate,
    finite,
    method_step,
    normalise,
    position_rates,
    set_diagonal,
    solve,
    stabilise,
    velocity_rates,
)

AT = (0.0, 0.5, 0.5, 1.0)


@method_step
def rk4_step(r: Tables, t: float, again: int) -> int:
    """One step of the engine's state from time t. Returns a status."""
    h = r.clock.time[H]
    stages, xs, vs = r.stages, r.stages.x[4], r.stages.v[4]
    set_diagonal(r, 0.0)
    for k in range(4):
        a = AT[k] * h
        if k == 0:
            status = stabilise(r, t, r.x, r.v)
            copy(xs, r.x)
            copy(vs, r.v)
        else:
            add_scaled(xs, r.x, a, stages.x[k - 1])
            add_scaled(vs, r.v, a, stages.v[k - 1])
            status = evaluate(r, t + a, xs, vs)
        if status != OK:
            return status
        acceleration_target(r.work.rows, r.clock.gains, stages.target)
        solve(r, stages.target)
        position_rates(r.model.bodies, xs, vs, stages.x[k])
        velocity_rates(r, stages.v[k])
    outer, inner = h / 6.0, h / 3.0
    add_four(r.x, outer, stages.x[0], inner, stages.x[1], inner, stages.x[2], outer, stages.x[3])
    add_four(r.v, outer, stages.v[0], inner, stages.v[1], inner, stages.v[2], outer, stages.v[3])
    normalise(r.model.bodies, r.x)
    return finite(r.x, r.v)


@dataclass(frozen=True)
class RK4:
    """Classical Runge-Kutta (Kutta 1901), as in Rantalainen 2007. Explicit: stable for h below about 2.8/omega_max of the
    *assembled* system, which exceeds the largest frequency of a free body; see `ROS2` where that is too small.

    step : time step [s]

    Raises InputError for a step that is not positive.

    >>> result = fd.forward(scene, end=1.0, output_step=0.01, method=fd.RK4(1e-4))
    """

    step: float
    order: ClassVar[int] = 4
    implicit: ClassVar[bool] = False
    takes_forces: ClassVar[bool] = False
    reach: ClassVar[float] = 8**0.5  # Hairer & Wanner 1996, IV.2
    controlled: ClassVar[bool] = False
    repeatable: ClassVar[bool] = True
    stage_count: ClassVar[int] = 5
    row_stages: ClassVar[int] = 0
    keeps_terms: ClassVar[bool] = False
    numbers: ClassVar[tuple[float, ...]] = ()
    do_step: ClassVar[CompiledFunction] = rk4_step

    def __post_init__(self) -> None:
        check_step(self, self.step)
