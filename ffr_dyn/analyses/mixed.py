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
from pathlib import Path
from typing import Any, ClassVar, get_args

import numpy as np

from ffr_dyn.analyses.efforts import Effort, JointEffort, MarkerEffort, sized, unit, with_units
from ffr_dyn.analyses.forward import forward
from ffr_dyn.analyses.integration import with_reactions_of
from ffr_dyn.analyses.inversion.bounded import Bounded, Found, bounded_solution
from ffr_dyn.analyses.inversion.internal_dynamics import fitting, internal
from ffr_dyn.analyses.inversion.plant import Plant, plant, slopes, with_efforts
from ffr_dyn.analyses.inversion.servo import ServoMotion, at_moment, internal_values, servo, slope, slope_matrix
from ffr_dyn.analyses.inversion.turns import not_counted
from ffr_dyn.analyses.outcome import (
    beyond,
    efforts,
    efforts_told,
    needed,
    only,
    output_times,
    result_of,
    with_errors,
    with_quantities,
)
from ffr_dyn.analyses.registry import OverTime, option
from ffr_dyn.analyses.settings import Settings
from ffr_dyn.compile.divided_steps import Rows, breaks_of, parts_of, within
from ffr_dyn.compile.scene_tables import System
from ffr_dyn.consistency.assemble import Assembled, assemble, flattened
from ffr_dyn.consistency.doubts import SUDDEN, checked
from ffr_dyn.consistency.evaluation import joined, record_states
from ffr_dyn.consistency.following import sudden
from ffr_dyn.consistency.step_error import Beside
from ffr_dyn.integrators import Integrator, Within
from ffr_dyn.integrators.stabilisation import Projection
from ffr_dyn.kernels.tables import EVALUATIONS, Record
from ffr_dyn.results.quantities import measure, selected
from ffr_dyn.results.recorded_motion import View
from ffr_dyn.results.result import Quantity, Result
from ffr_dyn.scene.checks import several
from ffr_dyn.scene.described import described
from ffr_dyn.scene.drivers import Driver, PointDriver
from ffr_dyn.scene.scene import GROUND, Scene, require_scene
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError, InputError

# A step of the internal dynamics, of the time that they are to go through: shorter ones go nowhere, but for the first of so
# many, as behind a jump.
SHORTEST, BEGINS = 1e-8, 10
HALF, SURE = (
    0.5,
    2,
)  # of the step, which tells the error of a bounded solution; order 4 to 1 as the known motion is smooth
FINER, ORDER = 10.0, 8  # tolerances that tell the error of a causal one, and the order of its method
AT_ONCE = 2  # derivatives of known motions after which efforts that act on them directly appear


@dataclass(frozen=True)
class Causal:
    """Integrate the internal dynamics from the scene's own start (Dormand & Prince, order 8).

    tolerance : relative, of a step [1]
    growth    : refuse internal dynamics that would magnify an error by more than this over the run [1]

    >>> result = fd.mixed(scene, unknown=(torque,), end=0.5, output_step=1e-3, solution=fd.Causal(tolerance=1e-8))
    """

    tolerance: float = 1e-10
    growth: float = 1e4


@dataclass(frozen=True)
class Mixed(OverTime):
    """Forces away from the known motions are found by integration where that is stable, else as the bounded solution, which
    adds times before and after the run. Unknown forces are given by name; see `mixed`.

    solution : how forces away from the known motions are found: "causal" or "bounded"; default: as the scene allows

    Raises InputError without unknown forces.

    >>> analysis = fd.Mixed(unknown=(fd.JointEffort("torque", "hinge"),), known=("path",))
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
    method: Integrator | Within | None = None,
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

    >>> torque = fd.JointEffort("torque", "hinge")
    >>> result = fd.mixed(scene, unknown=(torque,), end=0.5, output_step=1e-3)
    """
    require_scene(scene)
    if not isinstance(solution, Causal | Bounded | None):
        raise InputError(f"solution is {solution!r}; give Causal() or Bounded(), or none")
    names, unknown = _known(scene, known), several("unknown", unknown, get_args(Effort))
    partners = _collocated(scene, names, unknown)
    if partners is not None and solution is None:
        result = forward(
            scene, end=end, output_step=output_step, method=method, start=start,
            stabilisation=Projection(1e-12), outputs=needed(scene, beyond(_kept(unknown), outputs)), path=path,
            progress=progress,
        )  # fmt: skip
        return _named(flattened(scene, start)[0], result, partners, outputs, path)
    return _not_collocated(scene, names, unknown, (start, end, output_step), solution, outputs, path, progress)


def _kept(unknown: tuple[Effort, ...]) -> list[str]:
    """What every result has of unknown forces."""
    return [f"{effort.name}.{what}" for effort in unknown for what in ("effort", "power")]


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
    found, same = efforts(scene, result), dict[str, str]()
    for force, (driver, sign) in partners.items():
        same[f"{force}.power"] = f"{driver}.power"
        row = next(d for d in scene.drivers if d.name == driver)
        if isinstance(row, PointDriver):
            axis = next(k for k, c in enumerate("xyz") if getattr(row, c) is not None)
            same[f"{force}.effort"] = f"{driver}.force"
            effort = Quantity(sign * result[f"{driver}.force"][:, axis], "N", (), f"force that realises {driver}")
        else:
            same[f"{force}.effort"] = f"{driver}.effort"
            effort = replace(found[f"{driver}.effort"], description=f"effort that realises {driver}")
        found[f"{force}.effort"] = effort
        found[f"{force}.power"] = result.quantity(f"{driver}.power")
    attributes = {**efforts_told(scene, result, same), "analysis": "mixed dynamics, collocated"}
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
    assembled = assemble(with_units(scene, unknown), time=start)
    whole, degree = _fitted(assembled, names, unknown, (start, end))
    outputs = beyond(_kept(unknown), outputs)
    selected(whole.free.system, needed(whole.free.system.scene, outputs))
    own = servo(assembled, names, whole.own.unknown, (start, end)) if degree == AT_ONCE else whole.own
    w = internal_values(own, assembled.x, assembled.v)
    chosen = _solution(own, degree, w, assembled.x, solution)
    other: Found | None
    if isinstance(chosen, Bounded):
        y = internal_values(whole.own, assembled.x, assembled.v)[: whole.size]
        times, found, other, notes = bounded_solution(whole, chosen, output_step, y, assembled.x, progress)
        fast = within(assembled.system, start, end, output_step / chosen.parts)
        notes = [*notes, *(f"{text}; take more `parts` of an output step" for text in (fast.faster if fast else ()))]
        differ = HALF, SURE
    else:
        times, notes = output_times(start, end, output_step), []
        rows = times, parts_of(assembled.system, times, within(assembled.system, start, end, output_step))
        found = _integrated(own, chosen, rows, w, assembled.x, progress)
        finer = replace(chosen, tolerance=chosen.tolerance / FINER)
        other = _integrated(own, finer, rows, w, assembled.x, None) if own.size else None
        differ = FINER ** (-1 / ORDER), ORDER
    record, system = _recorded(whole, times, found), whole.free.system
    at_once = sudden(assembled.system, breaks_of(assembled.system, start, end, output_step), start, end)
    doubted = checked("mixed", replace(assembled, system=system, all_rows=None), record, {SUDDEN: at_once})
    attributes: dict[str, Any] = {
        **described(scene),
        "analysis": f"mixed dynamics, {'bounded' if isinstance(chosen, Bounded) else 'causal'}",
        "method": f"{chosen!r}",
        "evaluations": int(own.at.work.info[EVALUATIONS] + whole.free.work.info[EVALUATIONS]),
        "degrees_of_freedom": own.size,
        "computed": assembled.computed,
        "internal_coordinates": list(own.names),
        "notes": [*assembled.notes, *notes, *doubted, *not_counted(own.angles, record)],
        "status": "complete",
    }
    result = _measured(whole, record, found, attributes, outputs)
    if other is not None:
        finer_result = _measured(whole, _recorded(whole, times, other), other, attributes, outputs)
        result = with_errors(result, Beside(finer_result, differ[0]), differ[1])
    return with_quantities(result, {}, path)


def _measured(of: Plant, record: Record, found: Found, attributes: dict[str, Any], outputs: Sequence[str]) -> Result:
    """The outputs of states, with the efforts found."""
    efforts_found = _efforts_found(of.free.system, record, of.own.unknown, found.u)
    return with_quantities(result_of(of.free.system, record, attributes, outputs=outputs), efforts_found)


def _fitted(
    assembled: Assembled, names: tuple[str, ...], unknown: tuple[Effort, ...], span: tuple[float, float]
) -> tuple[Plant, int]:
    """The scene with as many of the unknown efforts as motions are known, and how often these are differentiated until the
    efforts appear. InputError where they do not fit."""
    texts = {b.name: [w.text for w in b.words] for b in assembled.system.blocks}
    labels = [f"{name}: {text}" for name in names for text in texts[name]]
    if len(unknown) < len(labels):
        raise InputError(
            f"{len(labels)} motions are known ({'; '.join(labels)}) but only {len(unknown)} forces are unknown; name as many"
        )
    whole = plant(assembled, names, unknown, span)
    y = internal_values(whole.own, assembled.x, assembled.v)[: whole.size]
    at = slopes(whole, span[0], y, np.zeros(whole.size), np.zeros(len(unknown)), assembled.x)
    chosen = fitting(whole, at, assembled.x, labels)
    kept = np.array([unknown.index(effort) for effort in chosen], int)
    return with_efforts(whole, chosen), internal(replace(at, by_u=at.by_u[:, kept])).degree


def _solution(own: ServoMotion, degree: int, w: Array, x: Array, wanted: Causal | Bounded | None) -> Causal | Bounded:
    """The solution that was asked for, or that the internal dynamics allow; an error for a causal run they do not."""
    if degree != AT_ONCE:
        if isinstance(wanted, Causal):
            raise InputError(
                f"the unknown forces reach a known motion by its derivative of order {degree} only, by way of what gives "
                "between them: use solution=Bounded(), for a known motion that starts and ends at rest"
            )
        return wanted or Bounded()
    if isinstance(wanted, Bounded) or own.size == 0:
        return wanted or Causal()
    causal, (start, end) = wanted or Causal(), own.span
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
    own: ServoMotion, causal: Causal, rows: Rows, w: Array, x: Array, progress: Callable[[float], None] | None
) -> Found:
    """Efforts and states at the output times."""
    from scipy.integrate import DOP853

    times = rows[0]
    moments = [at_moment(own, float(times[0]), w, x)]

    def right(t: float, w: Array) -> Array:
        return slope(own, t, w, moments[-1].x)[0]

    least = 1e-2 * causal.tolerance * np.repeat([1.0, 1.0 / own.lasts], own.size)
    for time, parts in zip(times[1:], rows[1], strict=True):
        for begin, end in parts if own.size else ():
            solver, steps = DOP853(right, begin, w, end, rtol=causal.tolerance, atol=least), 0
            while solver.status == "running":
                solver.step()
                steps += 1
                creeps = solver.status == "running" and solver.step_size < SHORTEST * (end - begin) and steps > BEGINS
                if creeps or solver.status == "failed":
                    raise ComputationError(
                        f"at t = {solver.t:.6g} s the internal dynamics end: their rates grow without bound, as where the "
                        "mechanism passes a position in which the unknown forces do not move what is known, or where a force "
                        "jumps; let another force be unknown, or end the run before it"
                    )
            w = solver.y
        moments.append(at_moment(own, float(time), w, moments[-1].x))
        if progress is not None:
            progress(float(time))
    states, measured = [(moment.x, moment.v) for moment in moments], [moment.measured for moment in moments]
    return Found(np.array([moment.u for moment in moments]), states, measured)


def _recorded(of: Plant, times: Array, found: Found) -> Record:
    """The states, with the efforts."""
    rows = []
    for time, u, (x, v), measured in zip(times, found.u, found.states, found.measured, strict=True):
        here = sized(of.free, of.own.unknown, u)
        here.work.loads.reference[:] = measured
        row = record_states(here, np.clip([time], *of.own.span), x[None], v[None])
        if of.all_rows is not None:
            row = with_reactions_of(sized(of.all_rows, of.own.unknown, u).engine, here.system, row)
        rows.append(row._replace(time=np.array([time])))
    return joined(rows)


def _efforts_found(system: System, record: Record, efforts: tuple[Effort, ...], u: Array) -> dict[str, Quantity]:
    """Efforts (T, U) and their powers."""
    powers, _ = measure(View(system, record), {}, selected(system, [f"{effort.name}.power" for effort in efforts]))
    found = {}
    for effort, values in zip(efforts, u.T, strict=True):
        text = "effort that realises the known motions"
        found[f"{effort.name}.effort"] = Quantity(values, unit(effort), (), text)
    return found | powers
