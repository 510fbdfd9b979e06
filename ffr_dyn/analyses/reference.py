"""The same equations through solvers of other people: slow, and independent of the project's integrators.

SciPy's solvers integrate the index-1 equations, (x_dot, v_dot) = (T(x) v, M^-1 (f - Phi_q^T lam)), and the state is projected
onto the constraints at every output row. SUNDIALS' IDA solves the stabilised index-2 equations (`ffr_dyn.analyses.ida`).
All error control and step selection are theirs; ours is the evaluation of the equations. They begin anew where a function of
time breaks, and end a step where one changes faster than rows are apart: they never see what is between their steps.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ffr_dyn.analyses.ida import by_ida
from ffr_dyn.analyses.integration import geometry, with_all_reactions
from ffr_dyn.analyses.outcome import output_times
from ffr_dyn.analyses.trials.begin import Beginning, begun
from ffr_dyn.compile.divided_steps import Rows, fast_of, parts_of
from ffr_dyn.consistency.assemble import Assembled, assemble
from ffr_dyn.consistency.doubts import SUDDEN, checked
from ffr_dyn.consistency.evaluation import Evaluator, accelerations, closed, copied, evaluator, joined
from ffr_dyn.consistency.following import sudden
from ffr_dyn.equations.layout import Layout
from ffr_dyn.equations.motion import position_rates
from ffr_dyn.kernels.tables import EVALUATIONS, Record
from ffr_dyn.results.file import save_result
from ffr_dyn.results.quantities import measure, needs_every_step, selected
from ffr_dyn.results.recorded_motion import View
from ffr_dyn.results.result import Result
from ffr_dyn.scene.described import described
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError, InputError

SOLVERS = ("DOP853", "Radau", "LSODA", "BDF", "RK45")
LOOKS = 4  # steps from row to row, within which functions of time are looked at for what they do there
DIFFERENCE = 1e-7  # of a coordinate, for Jacobians


@dataclass(frozen=True)
class SciPy:
    """A solver of `scipy.integrate.solve_ivp`: "DOP853" (explicit, order 8; Hairer, Norsett & Wanner 1993), "Radau"
    (implicit, order 5; Hairer & Wanner 1996), "LSODA" (Petzold 1983), ...

    rtol : its relative tolerance [1];  atol : its absolute one, of positions [m], velocities [m/s], elastic coordinates alike

    Raises InputError for another solver.

    >>> result = fd.reference(scene, end=0.5, output_step=0.01, method=fd.SciPy("Radau"))
    """

    solver: str = "DOP853"
    rtol: float = 1e-10
    atol: float = 1e-12

    def __post_init__(self) -> None:
        if self.solver not in SOLVERS:
            raise InputError(f"SciPy has no solver {self.solver!r} that is used here; there are {', '.join(SOLVERS)}")
        check_tolerances(self.rtol, self.atol)


@dataclass(frozen=True)
class IDA:
    """SUNDIALS' IDA (Hindmarsh et al. 2005): backward differentiation of orders one to five, variable steps.

    rtol : its relative tolerance [1];  atol : its absolute one, of positions [m], velocities [m/s] and
           elastic coordinates; multipliers are not controlled

    It comes with the package scikit-sundae (`pip install ffr[ida]`).

    Raises InputError for tolerances that double precision cannot meet.

    >>> result = fd.reference(scene, end=0.5, output_step=0.01, method=fd.IDA(rtol=1e-10))
    """

    rtol: float = 1e-8
    atol: float = 1e-10

    def __post_init__(self) -> None:
        check_tolerances(self.rtol, self.atol)


Reference = SciPy | IDA


def check_tolerances(rtol: float, atol: float) -> None:
    """InputError unless both can be met in double precision."""
    if not (1e-13 <= rtol < 1 and 0 < atol < 1):
        raise InputError(f"rtol is {rtol:g} and atol {atol:g}; rtol must be from 1e-13 to 1, atol positive and below 1")


def reference(
    scene: Scene,
    *,
    end: float,
    output_step: float,
    method: Reference = SciPy(),
    start: float = 0.0,
    outputs: Sequence[str] = ("default",),
    begin: Beginning = "as-given",
    path: str | Path | None = None,
    progress: Callable[[float], None] | None = None,
) -> Result:
    """Forward dynamics by a solver of SciPy or SUNDIALS; the arguments and the result are those of `forward`.

    Raises InputError for a scene or settings that cannot be used, ComputationError when the solver gives up.

    >>> exact = fd.reference(scene, end=0.5, output_step=0.01)
    """
    if not isinstance(method, Reference):
        raise InputError(f"method is {method!r}; give SciPy() or IDA() here, and methods of steps to `forward`")
    times = output_times(start, end, output_step)
    assembled = begun(assemble(scene, time=start), start, begin)
    system = assembled.system
    at, wanted = evaluator(system), selected(system, outputs)
    if needs_every_step(wanted):
        raise InputError(
            "work adds up over the steps of a method, which the solvers do not tell; keep the power instead"
        )
    fast = fast_of(system, start, end, output_step, output_step / LOOKS)
    rows: list[Record] = []
    for time, x, v in _states(assembled, at, (times, parts_of(system, times, fast)), method):
        accelerations(at, time, x, v)
        rows.append(copied(at.record))
        if progress is not None:
            progress(time)
    record = with_all_reactions(assembled, joined(rows))
    quantities, _ = measure(View(system, record), {}, wanted)
    at_once = sudden(system, np.zeros(0) if fast is None else fast.breaks, start, end)
    attributes = {
        **described(scene),
        "analysis": "forward dynamics",
        "method": f"{method!r}",
        "stabilisation": "projection at the output rows" if isinstance(method, SciPy) else "index 2, stabilised",
        "start": start,
        "end": end,
        "output_step": output_step,
        "degrees_of_freedom": assembled.degrees_of_freedom,
        "computed": assembled.computed,
        "evaluations": int(at.work.info[EVALUATIONS]),
        "notes": [*assembled.notes, *checked("forward", assembled, record, {SUDDEN: at_once})],
        "status": "complete",
    }
    result = Result(record.time, quantities, geometry(scene), attributes)
    if path is not None:
        save_result(result, path)
    return result


def _states(assembled: Assembled, at: Evaluator, rows: Rows, method: Reference) -> Iterator[tuple[float, Array, Array]]:
    """(time, x, v) at the output times."""
    if isinstance(method, SciPy):
        return _by_scipy(assembled, at, rows, method)
    return by_ida(assembled, at, rows, method.rtol, method.atol)


def _by_scipy(assembled: Assembled, at: Evaluator, rows: Rows, method: SciPy) -> Iterator[tuple[float, Array, Array]]:
    """From part to part, each from where the state is projected to, first by the longest step of the one before."""
    (first, *later), (x, v), step = rows[0].tolist(), (assembled.x, assembled.v), np.inf
    yield first, x, v
    for time, parts in zip(later, rows[1], strict=True):
        for begin, end in parts:
            x, v, step = _over(assembled, at, method, (begin, end, x, v, step))
        x, v = closed(at, time, x, v)
        yield time, x, v


def _over(
    assembled: Assembled, at: Evaluator, method: SciPy, part: tuple[float, float, Array, Array, float]
) -> tuple[Array, Array, float]:
    """(x, v) at the end of a part, and the longest step; part : its begin and end, the state, and the step before [s]."""
    from scipy.integrate import solve_ivp

    place, (begin, end, x, v, step) = assembled.system.layout, part
    implicit = {"jac": lambda t, y: _jacobian(at, place, t, y)} if method.solver in ("Radau", "BDF") else {}
    x, v = closed(at, begin, x, v)
    done = solve_ivp(
        lambda t, y: _rates(at, place, t, y),
        (begin, end),
        np.concatenate([x, v]),
        method=method.solver,
        rtol=method.rtol,
        atol=method.atol,
        first_step=None if step == np.inf else min(step, end - begin),
        **implicit,
    )
    if not done.success:
        raise ComputationError(f"{method.solver} stopped at t = {done.t[-1]:.6g} s: {done.message}")
    x, v = np.split(done.y[:, -1], [place.x_size])
    return x, v, float(np.diff(done.t).max())


def _rates(at: Evaluator, place: Layout, time: float, y: Array) -> Array:
    """d/dt of [x, v]."""
    x, v = np.split(y, [place.x_size])
    return np.concatenate([position_rates(place, x, v), accelerations(at, float(time), x, v)])


def _jacobian(at: Evaluator, place: Layout, time: float, y: Array) -> Array:
    """d/dy of `_rates` by differences. SciPy's own enlarges the steps of what has no effect until they overflow."""
    base, out = _rates(at, place, time, y), np.empty((y.size, y.size))
    for k in range(y.size):
        step = DIFFERENCE * max(1.0, abs(y[k]))
        beside = y.copy()
        beside[k] += step
        out[:, k] = (_rates(at, place, time, beside) - base) / (beside[k] - y[k])
    return out
