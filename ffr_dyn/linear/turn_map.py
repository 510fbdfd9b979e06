"""Periodic motions of driven scenes: the state that a period brings back, and what becomes of small deviations from it.

P maps a state to that a period later by the compiled loop, in minimal coordinates of deviations from a state
(`ffr_dyn.consistency.tangent`); a periodic motion is a fixed point s = P(s), which `ffr_dyn.linear.returning` finds. The
eigenvalues of the monodromy matrix, the derivative of P there by differences, are Floquet's multipliers: small motions grow
where one is larger than one. (Seydel, Practical Bifurcation and Stability Analysis 2010, ch. 7.)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ffr_dyn.compile.divided_steps import Fast, divided, fast_of
from ffr_dyn.compile.engine import Engine, fill_rows, new_engine
from ffr_dyn.compile.scene_tables import System
from ffr_dyn.compile.workspace import new_record
from ffr_dyn.consistency.evaluation import Evaluator, evaluate, evaluator, rows_close
from ffr_dyn.consistency.failure import failure
from ffr_dyn.consistency.tangent import STEP, Chart, chart, sizes_of
from ffr_dyn.equations.layout import ROUNDING, Layout, moved, to_body_axes, to_global_axes
from ffr_dyn.functions.rotation import rotation_matrix, tangent
from ffr_dyn.functions.time_functions import evaluate as value_of
from ffr_dyn.functions.together import together
from ffr_dyn.integrators import Integrator
from ffr_dyn.integrators.stabilisation import Projection, gains
from ffr_dyn.kernels.tables import OK, Record
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.scene import Scene, length_of
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError, InputError

ROWS = 100  # of a period: its steps are as many, a multiple, or fewer and the rows with them
CLOSED = 1e-13  # of constraints, relative to the scene: what is left open kicks stiff bodies at every return
DIFFERENCE = 1e-5  # rad, or relative to the scene; of derivatives of a period, which are extrapolated
LATER = 0.37  # s: when a driver is asked again whether it turns evenly
CORRECTIONS, MET = 12, 1e-13  # of a deviation onto the constraints, and of rows, relative to their sizes
OWN_PERIOD = (
    "a vibration that excites itself makes its own period: run `forward` until it has settled, and measure it there"
)
AGAIN = 0.5  # rad: of turns over a period beyond which a body does not count as come back
QUARTER = 0.5 * np.pi  # rad: of turns from the chart's state; farther off, minimal coordinates may fit two states


@dataclass(frozen=True)
class Turns:
    """A compiled scene, its chart at a state, and one period [s] of `steps` steps of a method from the chart's time.

    across : (V, C) motions across the free ones, M^-1 jacobian^T
    sizes : (V,) what counts as a movement of one
    rows : of the record of a period, a part of the steps
    fast : what functions of time do within steps, over two periods
    """

    near: Chart
    across: Array
    sizes: Array
    method: Integrator
    period: float
    steps: int
    rows: int
    fast: Fast | None = None

    @property
    def system(self) -> System:
        return self.near.at.system

    @cached_property
    def divided(self) -> System:
        """The system whose steps are divided where functions of time change faster."""
        return self.system if self.fast is None else divided(self.system, self.fast, self.method.step)

    @property
    def scale(self) -> Array:
        """(2 d,) of deviations that count as one: those that move something by its size, and by its size in a period."""
        steps = self.near.steps / STEP
        return np.concatenate([steps, steps / self.period])


def turns(system: System, time: float, x: Array, v: Array, method: Integrator, period: float) -> Turns:
    """The map over a period; the state (x, v) meets the constraints. Raises as `fast_of` for its functions of time."""
    steps = max(1, round(period / method.step))
    steps = steps if steps < ROWS else -(-steps // ROWS) * ROWS
    shortened: Any = method
    step = period / steps
    of = _about(evaluator(system), time, x, v, replace(shortened, step=step), period, steps)
    return replace(of, fast=fast_of(system, time, time + 2 * period, period / of.rows, step))


def turns_about(of: Turns, x: Array, v: Array) -> Turns:
    """The same map about another state near the chart's."""
    return replace(_about(of.near.at, of.near.time, x, v, of.method, of.period, of.steps), fast=of.fast)


def _about(at: Evaluator, time: float, x: Array, v: Array, method: Integrator, period: float, steps: int) -> Turns:
    near = chart(at, time, x, v)
    jacobian = evaluate(near.at, time, x, v).jacobian
    return Turns(
        near, np.linalg.solve(near.M, jacobian.T), sizes_of(at.system), method, period, steps, min(ROWS, steps)
    )


def period_of(scene: Scene, time: float) -> float:
    """[s] of a turn of the only angle that a driver turns evenly at a time [s]. InputError where there is none, or
    several."""
    rates = set[float]()
    for driver in scene.drivers:
        if isinstance(driver, Driver) and driver.coordinate == "angle":
            now, later = (value_of(driver.function, t) for t in (time, time + LATER))
            if now[1] and now[1:] == later[1:] and now[2] == 0:
                rates.add(abs(now[1]))
    if len(rates) == 1:
        return 2 * np.pi / rates.pop()
    what = "no driver turns a joint evenly" if not rates else "drivers turn at different speeds"
    raise InputError(f"the period is not known: {what}; give it in seconds (period, --period)")


def after(of: Turns, x: Array, v: Array, *, rows: int = 1, later: float = 0.0) -> Record:
    """`rows` states of the period that begins at (x, v), evenly, the last at its end; or of one that begins `later` [s].

    Raises ComputationError where a body has turned: how far it may move depends on what holds it, not on the scene's size.
    """
    start, engine = of.near.time + later, engine_of(of, x, v)
    record = new_record(of.system, rows)
    status = fill_rows(engine, record, start, of.steps // rows)
    if status != OK:
        raise failure(of.system, engine.work, status, start)
    place = of.system.layout
    if _turned_most(place, between(place, x, record.x[-1])) > AGAIN:
        raise ComputationError(
            f"after a period of {of.period:.6g} s the scene is not where it began: the period is not that of its drivers and "
            "loads, or a body goes on turning (give another period), or bodies swing up to the speed of what drives them "
            f"(give them its velocity); {OWN_PERIOD}"
        )
    return record


def _turned_most(place: Layout, y: Array) -> float:
    """[rad] of the body that a movement y (V,) turns most."""
    return max((float(np.linalg.norm(y[place.omega(b)])) for b in range(len(place.n))), default=0.0)


def engine_of(of: Turns, x: Array, v: Array) -> Engine:
    """Memory for steps of the map from a state (x, v)."""
    closed = gains(Projection(max(CLOSED * length_of(of.system.scene), ROUNDING)))
    engine = new_engine(of.divided, x, v, of.method, closed, start=of.near.time, spacing=of.method.step)
    engine.work.loads.reference[:] = of.near.at.work.loads.reference
    return engine


def placed(of: Turns, s: Array) -> tuple[Array, Array]:
    """(x, v) of the deviation s (2 d,): what `deviation` takes back to it, corrections being across the free motions.

    Raises ComputationError where constraints cannot be met so.
    """
    near, place, d = of.near, of.system.layout, of.near.steps.size
    y, V = near.Z @ s[:d], near.V + near.Z @ s[d:]
    met = False
    for _ in range(CORRECTIONS):
        x = moved(place, near.x, y)
        now = evaluate(near.at, near.time, x, to_global_axes(place, x, V))
        if met:  # and corrected once more: what is left open kicks stiff bodies
            return x, to_global_axes(place, x, V + of.across @ _least(now.jacobian @ of.across, -now.nu))
        met = rows_close(near.at, x, now, MET)
        y = y + of.across @ _least(now.jacobian @ _seen_there(of, x, y, of.across), -now.Phi)
    raise ComputationError(
        f"at t = {near.time:.6g} s the search for a periodic motion came to a state that the joints do not allow; "
        "begin nearer"
    )


def _seen_there(of: Turns, x: Array, y: Array, changes: Array) -> Array:
    """(V, C) in body axes at the state x (X,), to which y (V,) moves the chart's, what changes (V, C) of y do there."""
    place, out = of.system.layout, changes.copy()
    for b in range(len(place.n)):
        A0, A = rotation_matrix(of.near.x[place.p(b)]), rotation_matrix(x[place.p(b)])
        out[place.R_dot(b)] = A.T @ A0 @ changes[place.R_dot(b)]
        out[place.omega(b)] = tangent(y[place.omega(b)]).T @ changes[place.omega(b)]
    return out


def _least(matrix: Array, right: Array) -> Array:
    return np.linalg.lstsq(matrix, right, rcond=1e-12)[0]


def deviation(of: Turns, x: Array, v: Array) -> Array:
    """(2 d,) minimal coordinates of a state near the chart's. Raises ComputationError for one that is not near."""
    near, place = of.near, of.system.layout
    y, V = between(place, near.x, x), to_body_axes(place, x, v)
    if (turned := _turned_most(place, y)) > QUARTER:
        raise ComputationError(
            f"a body swings {turned:.3g} rad away from where the search for a motion of period {of.period:.6g} s began, "
            "which finds motions up to a quarter of a turn away; begin nearer to the motion"
        )
    return np.concatenate([near.W.T @ y, near.W.T @ (V - near.V)])


def between(place: Layout, x0: Array, x: Array) -> Array:
    """(V,) that moves positions x0 (X,) to x, in the body axes there."""
    y = np.zeros(place.v_size)
    for b in range(len(place.n)):
        A0, A = rotation_matrix(x0[place.p(b)]), rotation_matrix(x[place.p(b)])
        y[place.R_dot(b)] = A0.T @ (x[place.R(b)] - x0[place.R(b)])
        y[place.omega(b)] = _vector(A0.T @ A)
        y[place.q_dot(b)] = x[place.q(b)] - x0[place.q(b)]
    return y


def _vector(A: Array) -> Array:
    """Rotation vector (3,) of a rotation of less than half a turn."""
    axial = 0.5 * np.array([A[2, 1] - A[1, 2], A[0, 2] - A[2, 0], A[1, 0] - A[0, 1]])
    sine, cosine = float(np.linalg.norm(axial)), 0.5 * (float(np.trace(A)) - 1)
    return axial * (np.arctan2(sine, cosine) / sine) if sine > 0 else axial


def mapped(of: Turns, s: Array) -> Array:
    """(2 d,) the deviation a period later."""
    record = after(of, *placed(of, s))
    return deviation(of, record.x[-1], record.v[-1])


def monodromy(of: Turns, s: Array) -> Array:
    """(2 d, 2 d) derivative of the map at a deviation, in units of `scale`, by extrapolated central differences."""
    scale = of.scale
    factors = (1.0, -1.0, 0.5, -0.5)
    points = [s + factor * step for step in np.diag(DIFFERENCE * scale) for factor in factors]
    images = np.array(_all_mapped(of, points)).reshape(s.size, len(factors), s.size)
    far, close = ((images[:, k] - images[:, k + 1]) / (2 * factors[k] * DIFFERENCE * scale) for k in (0, 2))
    found: Array = ((4 * close - far) / 3).T
    return found


def _all_mapped(of: Turns, points: Sequence[Array]) -> list[Array]:
    """`mapped` of several deviations, the periods of which are computed at the same time."""
    states = [placed(of, s) for s in points]
    lonely = of.system.user.count  # Python's functions are called one after another anyway
    calls = [lambda say, x=x, v=v: after(of, x, v) for x, v in states]  # type: ignore[misc]
    records = dict(together(calls, 1 if lonely else None))
    for k in range(len(points)):
        if isinstance(records[k], BaseException):
            raise records[k]
    return [deviation(of, records[k].x[-1], records[k].v[-1]) for k in range(len(points))]


@dataclass(frozen=True)
class FloquetModes:
    """Small motions y = exp(exponent t) p(t), p periodic, about a periodic motion: multipliers and exponents [1/s] (2 d,),
    the largest multiplier first, and shapes (V, 2 d), p at the beginning of the period.

    rates : (2 d,) [rad/s] of the shapes there;  deviations : (2 d, 2 d) that begin the modes, in units of the scale

    A frequency is known but for multiples of that of the period; it is the one nearest to the rate at the beginning.
    """

    multipliers: Array
    exponents: Array
    shapes: Array
    rates: Array
    deviations: Array


def floquet_modes(of: Turns) -> FloquetModes:
    """About the state of the chart, which a period brings back."""
    d = of.near.steps.size
    values, vectors = np.linalg.eig(monodromy(of, np.zeros(2 * d)))
    order = np.argsort(-np.abs(values), kind="stable")
    values, begun = values[order], vectors[:, order]
    vectors = (begun.T * of.scale).T
    y, z = vectors[:d], vectors[d:]
    size = np.maximum((np.abs(y) ** 2).sum(axis=0), 1e-300)
    spin = (y.conj() * z).sum(axis=0).imag / size
    base = 2 * np.pi / of.period
    logarithm = np.log(np.where(values, values, 1e-300).astype(complex)) / of.period
    exponents = logarithm + 1j * base * np.round((spin - logarithm.imag) / base)
    exponents = np.where(
        values.imag == 0, exponents.real + 1j * np.abs(exponents.imag), exponents
    )  # half a turn: either
    rates = np.sqrt((np.abs(z) ** 2).sum(axis=0) / size)
    return FloquetModes(values, exponents, of.near.Z @ y, rates, begun)


def floquet_shape(of: Turns, modes: FloquetModes, number: int, rows: int) -> Array:
    """(rows, V) p(t) of a mode at `rows` moments of the period, evenly, the last at its end: by central differences."""
    at = placed(of, np.zeros(of.scale.size))
    rest, begun = after(of, *at, rows=rows), modes.deviations[:, number]
    shape = np.zeros((rows, of.system.layout.v_size), complex)
    for part, unit in ((begun.real, 1.0), (begun.imag, 1j)):
        if not part.any():
            continue
        ends = [after(of, *placed(of, sign * DIFFERENCE * part * of.scale), rows=rows) for sign in (1.0, -1.0)]
        for k in range(rows):
            forth, back = (between(of.system.layout, rest.x[k], end.x[k]) for end in ends)
            shape[k] += unit * (forth - back) / (2 * DIFFERENCE)
    times = of.period / rows * np.arange(1, rows + 1)
    return shape * np.exp(-modes.exponents[number] * times)[:, None]
