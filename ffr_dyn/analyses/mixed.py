"""Mixed dynamics: some motions known, equally many forces unknown; both the rest of the motion and the forces are wanted.

*Collocated*: each unknown force acts along a known motion. It is the multiplier of that motion's row, and the run is a
forward run with drivers (Antonya's partitioning, in multiplier form).
*Not collocated*: servo constraints (`servo`). Their internal dynamics may be unstable - a flexible arm whose tip is known and
whose hub is driven - and then no integration from the start can be trusted. The bounded solution is found instead, over all
times at once: it starts at rest before the known motion does, and ends at rest after it (`bounded`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Any, ClassVar, get_args

import numpy as np

from ffr_dyn.analyses.bounded import Bounded, bounded_solution
from ffr_dyn.analyses.efforts import Effort, JointEffort, MarkerEffort, sized, unit, with_units
from ffr_dyn.analyses.forward import forward
from ffr_dyn.analyses.outcome import efforts, needed, only, output_times, result_of, with_quantities
from ffr_dyn.analyses.registry import OverTime, option
from ffr_dyn.analyses.servo import Moment, ServoMotion, at_moment, internal_values, servo, slope, slope_matrix
from ffr_dyn.analyses.settings import Settings
from ffr_dyn.compile.scene_tables import System, compile_scene
from ffr_dyn.consistency.assemble import assemble, flattened
from ffr_dyn.consistency.evaluation import Evaluator, evaluator, joined, record_states
from ffr_dyn.equations.constraint_rows import blocks_of
from ffr_dyn.integrators import Integrator
from ffr_dyn.integrators.stabilisation import Projection
from ffr_dyn.kernels.tables import EVALUATIONS, Record
from ffr_dyn.results.quantities import measure, selected
from ffr_dyn.results.result import Quantity, Result
from ffr_dyn.scene.checks import several
from ffr_dyn.scene.drivers import Driver, PointDriver
from ffr_dyn.scene.parts import described
from ffr_dyn.scene.scene import GROUND, Scene, require_scene
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError, InputError


@dataclass(frozen=True)
class Causal:
    """Integrate the internal dynamics from the scene's own start (Dormand & Prince, order 8).

    tolerance : relative, of a step
    growth    : refuse internal dynamics that would magnify an error by more than this over the run
    """

    tolerance: float = 1e-10
    growth: float = 1e4


@dataclass(frozen=True)
class Mixed(OverTime):
    """Forces away from the known motions are found by integration where that is stable, else as the bounded solution, which
    adds times before and after the run. Unknown forces are given by name; see `mixed`.
    """

    integrates: ClassVar[bool] = True
    example: ClassVar[str] = "ffr-dyn mixed arm.toml --unknown torque=hinge.angle --known path -o out/arm.nc"
    unknown: tuple[Effort, ...] = field(
        default=(),
        metadata=option("--unknown", "Force to find, instead of the scene's; repeat.", metavar="FORCE", required=True),
    )
    known: tuple[str, ...] | None = field(
        default=None, metadata=option("--known", "Driver that is a known motion, not a true driver; default: all.")
    )
    solution: Causal | Bounded | None = None

    def __post_init__(self) -> None:
        if not self.unknown:
            raise InputError(
                'mixed dynamics needs forces to find: --unknown, or kind = "mixed" with [analysis.unknown.NAME]'
            )

    def perform(self, scene: Scene, settings: Settings, **how: Any) -> Result:
        own: dict[str, Any] = {"unknown": self.unknown, "known": self.known, "solution": self.solution}
        return mixed(scene, method=settings.method, **own, **settings.span, **how)


def mixed(
    scene: Scene,
    *,
    unknown: tuple[Effort, ...],
    end: float,
    output_step: float,
    start: float = 0.0,
    known: tuple[str, ...] | None = None,
    solution: Causal | Bounded | None = None,
    method: Integrator | None = None,
    outputs: Sequence[str] = ("default",),
    path: str | Path | None = None,
    progress: Callable[[float], None] | None = None,
) -> Result:
    """The motion of a scene of which some motions are known, and the unknown forces that cause them.

    known   : drivers of the scene that are known motions, realised by the unknown forces; default all. Other drivers are true
              ones, with forces of their own
    unknown : joint or marker forces; of more than are needed those are chosen that the known motions determine best
    solution: of forces away from the known motions: `Causal`, or `Bounded` (which adds times before the start and after the
              end); by default Causal where the internal dynamics allow it
    method  : integrator of a collocated run
    outputs : names or patterns of the quantities to keep beside the efforts, as in `forward`

    The result has "name.effort" [N or N m] of every unknown force and its power.

    Raises InputError when motions and forces do not fit (the combination that is undetermined is told), ComputationError when
    the run fails or a causal one is asked for and cannot be trusted.
    """
    require_scene(scene)
    names, unknown = _known(scene, known), several("unknown", unknown, get_args(Effort))
    partners = _collocated(scene, names, unknown)
    if partners is not None and solution is None:
        result = forward(
            scene, end=end, output_step=output_step, method=method, start=start,
            stabilisation=Projection(1e-12), outputs=needed(scene, outputs), path=path, progress=progress,
        )  # fmt: skip
        return _named(flattened(scene, start)[0], result, partners, outputs, path)
    return _not_collocated(scene, names, unknown, (start, end, output_step), solution, outputs, path, progress)


def _known(scene: Scene, known: tuple[str, ...] | None) -> tuple[str, ...]:
    drivers = [driver.name for driver in scene.drivers]
    names = several("known", drivers if known is None else known, (str,))
    missing = [name for name in names if name not in drivers]
    if not names:
        raise InputError("mixed dynamics needs known motions, drivers of the scene; it has none")
    if missing:
        there = ", ".join(drivers) or "none"
        raise InputError(f"known motion {missing[0]!r} is no driver of the scene; there are: {there}")
    return names


# ---- collocated ------------------------------------------------------------------------------------------------------


def _collocated(
    scene: Scene, names: tuple[str, ...], unknown: tuple[Effort, ...]
) -> dict[str, tuple[str, float]] | None:
    """For each unknown force the driver along which it acts and its sign; None unless every known motion has its force."""
    drivers = {driver.name: driver for driver in scene.drivers if driver.name in names}
    pairs: dict[str, tuple[str, float]] = {}
    for effort in unknown:
        for name, driver in drivers.items():
            sign = _along(driver, effort)
            if sign and name not in [taken for taken, _ in pairs.values()]:
                pairs[effort.name] = (name, sign)
                break
    return pairs if len(pairs) == len(names) == len(unknown) else None


def _along(driver: Driver | PointDriver, effort: Effort) -> float:
    """1 or -1 where the force acts along the driven coordinate, else 0."""
    if isinstance(driver, Driver):
        same = isinstance(effort, JointEffort) and (effort.joint, effort.coordinate) == (
            driver.joint,
            driver.coordinate,
        )
        return float(same)
    components = [c for c in "xyz" if getattr(driver, c) is not None]
    alone = len(components) == 1 and driver.i.partition(".")[0] == GROUND
    if not (alone and isinstance(effort, MarkerEffort) and effort.marker == driver.j) or effort.moment:
        return 0.0
    along = np.array(effort.direction)["xyz".index(components[0])]
    return float(along) if effort.axes == "global" and abs(abs(along) - 1) < 1e-15 else 0.0


def _named(
    scene: Scene,
    result: Result,
    partners: dict[str, tuple[str, float]],
    outputs: Sequence[str],
    path: str | Path | None,
) -> Result:
    """The drivers' efforts under the names of the unknown forces."""
    found = efforts(scene, result)
    for force, (driver, sign) in partners.items():
        row = next(d for d in scene.drivers if d.name == driver)
        if isinstance(row, PointDriver):
            axis = next(k for k, c in enumerate("xyz") if getattr(row, c) is not None)
            effort = Quantity(sign * result[f"{driver}.force"][:, axis], "N", (), f"force that realises {driver}")
        else:
            effort = replace(found[f"{driver}.effort"], description=f"effort that realises {driver}")
        found[f"{force}.effort"] = effort
        found[f"{force}.power"] = result.quantity(f"{driver}.power")
    attributes = {**result.attributes, "analysis": "mixed dynamics, collocated"}
    return with_quantities(only(replace(result, attributes=attributes), scene, outputs), found, path)


# ---- not collocated --------------------------------------------------------------------------------------------------


def _not_collocated(
    scene: Scene,
    names: tuple[str, ...],
    unknown: tuple[Effort, ...],
    span: tuple[float, float, float],
    solution: Causal | Bounded | None,
    outputs: Sequence[str],
    path: str | Path | None,
    progress: Callable[[float], None] | None,
) -> Result:
    start, end, output_step = span
    stiffened = [b.name for b in scene.bodies if b.stiffening and b.model.stiffening is not None]
    if stiffened:
        raise InputError(
            f"servo constraints need bodies without geometric stiffening: set stiffening=False of {stiffened}"
        )
    assembled = assemble(with_units(scene, unknown), time=start)
    own = servo(assembled, names, unknown, (start, end))
    at = _freed(own, names)
    selected(at.system, outputs)
    w = internal_values(own, assembled.x, assembled.v)
    chosen = _solution(own, start, end, w, assembled.x, solution)
    if isinstance(chosen, Bounded):
        times, ws, xs, notes = bounded_solution(own, chosen, output_step, w, assembled.x)
    else:
        times = output_times(start, end, output_step)
        ws, xs = _integrated(own, chosen, times, w, assembled.x, progress)
        notes = []
    moments = [at_moment(own, float(t), w, x) for t, w, x in zip(times, ws, xs, strict=True)]
    attributes: dict[str, Any] = {
        **described(scene),
        "analysis": f"mixed dynamics, {'bounded' if isinstance(chosen, Bounded) else 'causal'}",
        "method": f"{chosen!r}",
        "evaluations": int(own.at.work.info[EVALUATIONS]),
        "degrees_of_freedom": own.size,
        "internal_coordinates": list(own.names),
        "notes": [*assembled.notes, *notes],
        "status": "complete",
    }
    record = _recorded(at, unknown, own, times, moments)
    found = _efforts_found(at.system, record, own.unknown, np.array([moment.u for moment in moments]))
    return with_quantities(result_of(at.system, record, attributes, outputs=outputs), found, path)


def _solution(
    own: ServoMotion, start: float, end: float, w: Array, x: Array, wanted: Causal | Bounded | None
) -> Causal | Bounded:
    """What was asked for, or what the internal dynamics allow at the start; ComputationError for a causal run they do not."""
    if isinstance(wanted, Bounded) or own.size == 0:
        return wanted or Causal()
    causal = wanted or Causal()
    rate = float(np.linalg.eigvals(slope_matrix(own, start, w, x)).real.max())
    if rate * (end - start) <= np.log(causal.growth):
        return causal
    if wanted is None:
        return Bounded()
    raise ComputationError(
        f"the internal dynamics are unstable: errors grow e-fold in {1 / rate:.3g} s, over a run of {end - start:g} s; use "
        "solution=Bounded(), for a known motion that starts and ends at rest"
    )


def _integrated(
    own: ServoMotion, causal: Causal, times: Array, w: Array, x: Array, progress: Callable[[float], None] | None
) -> tuple[Array, list[Array]]:
    """w (T, 2 d) and the states x at the output times."""
    from scipy.integrate import DOP853

    nearest = [x]

    def right(t: float, y: Array) -> Array:
        value, nearest[0] = slope(own, t, y, nearest[0])
        return value

    ws, xs = [w], [x]
    if own.size == 0:
        for time in times[1:]:
            xs.append(at_moment(own, float(time), w, xs[-1]).x)
        return np.zeros((times.size, 0)), xs
    for before, time in pairwise(times):
        solver = DOP853(right, float(before), ws[-1], float(time), rtol=causal.tolerance, atol=causal.tolerance * 1e-2)
        while solver.status == "running":
            message = solver.step()
        if solver.status == "failed":
            raise ComputationError(f"at t = {solver.t:.6g} s the internal dynamics could not be integrated: {message}")
        ws.append(solver.y)
        xs.append(at_moment(own, float(time), solver.y, nearest[0]).x)
        if progress is not None:
            progress(float(time))
    return np.array(ws), xs


def _freed(own: ServoMotion, names: tuple[str, ...]) -> Evaluator:
    """The scene without its known drivers, in which the efforts found act."""
    scene = own.at.system.scene
    free = replace(scene, drivers=tuple(driver for driver in scene.drivers if driver.name not in names))
    rows_of = {block.name: block for block in own.at.system.blocks}
    return evaluator(compile_scene(free, [rows_of[block.name] for block in blocks_of(free)]))


def _recorded(
    at: Evaluator, unknown: tuple[Effort, ...], own: ServoMotion, times: Array, moments: list[Moment]
) -> Record:
    """The states, with the efforts found."""
    silent = sized(at, unknown, np.zeros(len(unknown)))
    rows = []
    for time, moment in zip(times, moments, strict=True):
        here = sized(silent, own.unknown, moment.u)
        row = record_states(here, np.clip([time], *own.span), moment.x[None], moment.v[None])
        rows.append(row._replace(time=np.array([time])))
    return joined(rows)


def _efforts_found(system: System, record: Record, efforts: tuple[Effort, ...], u: Array) -> dict[str, Quantity]:
    """Efforts (T, U) and their powers."""
    powers, _ = measure(system, record, {}, selected(system, [f"{effort.name}.power" for effort in efforts]))
    found = {}
    for effort, values in zip(efforts, u.T, strict=True):
        text = "effort that realises the known motions"
        found[f"{effort.name}.effort"] = Quantity(values, unit(effort), (), text)
    return found | powers
