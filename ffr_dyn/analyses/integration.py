"""The equations of motion integrated from a start to an end: what `forward` does once or several times."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from functools import partial
from numbers import Real
from pathlib import Path
from typing import Any, get_args

import numpy as np

from ffr_dyn.analyses.checkpoint import Checkpoint, decode, encode, fingerprint, leaves
from ffr_dyn.analyses.energy import EnergyWatch
from ffr_dyn.analyses.events import MEMORY, Event, Watcher
from ffr_dyn.closing.limits import with_limits
from ffr_dyn.closing.passed_positions import passed_in_words
from ffr_dyn.compile.divided_steps import Fast, divided, division_times, fast_of
from ffr_dyn.compile.engine import Engine, fill_rows, new_engine, record_row
from ffr_dyn.compile.scene_tables import System
from ffr_dyn.compile.workspace import new_record
from ffr_dyn.consistency import failure as failing
from ffr_dyn.consistency.assemble import BRANCHES, Assembled, assemble
from ffr_dyn.consistency.doubts import BALANCE, SINGULAR, SUDDEN, Seen, between_rows, ended, held, look, nothing_seen
from ffr_dyn.consistency.evaluation import joined
from ffr_dyn.consistency.explicit_forces import told
from ffr_dyn.consistency.following import LOST, STALLED, Lost, jumped, lost_driver, sudden, unfollowed
from ffr_dyn.consistency.step_error import ENDED_BY
from ffr_dyn.consistency.validity import meaningless
from ffr_dyn.functions.stopwatch import Stopwatch
from ffr_dyn.integrators import Integrator, Within, methods
from ffr_dyn.integrators.stabilisation import Baumgarte, Projection, Stabilisation, excess_of_gains, gains
from ffr_dyn.kernels.tables import (
    AT,
    EVALUATIONS,
    FILLED,
    HERE,
    LEAST,
    NEXT,
    NOW,
    OK,
    PHI,
    PHI_DOT,
    PROJECTIONS,
    SPACING,
    STEP_TOO_SMALL,
    USER_FAILED,
    Record,
)
from ffr_dyn.results.file import ResultWriter, load_checkpoint, load_result
from ffr_dyn.results.kept_rows import SMALL, Kept, Measured, Recorded, row_size
from ffr_dyn.results.quantities import Entry, needs_every_step, selected
from ffr_dyn.results.recorded_motion import View
from ffr_dyn.results.result import Quantity, Result
from ffr_dyn.scene.checks import several
from ffr_dyn.scene.described import described
from ffr_dyn.scene.scene import Scene
from ffr_dyn.scene.surfaces import surface_of
from ffr_prep.body import Surface
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError, InputError, require_kind

LOOKS = 10  # of a quantity that adds up, from row to row, where the method chooses its steps
SURE = 10.0  # times, by which an evaluation may take longer than is guessed before the first one
MOST_ROWS = 1000  # of the first call
SECONDS_PER_CALL = 0.25  # of the compiled loop, between two looks at progress, file and keyboard

_MOST_STEPS = 1e15  # of a run: decades of a processor
_MOST_ROWS = 1e9  # each of hundreds of bytes at least


@dataclass
class _Run:
    """The part of a run that changes while it goes on; `done` counts the steps. The first row is `unseen` until others can
    be looked at with it; `watcher` looks for events, if there are any."""

    engine: Engine
    energy: EnergyWatch
    kept: Kept
    seen: Seen
    done: int
    watcher: Watcher | None
    unseen: Record | None = None


def integrate(
    scene: Scene,
    *,
    end: float,
    output_step: float,
    method: Integrator,
    start: float = 0.0,
    stabilisation: Stabilisation = Projection(),  # noqa: B008 - frozen
    outputs: Sequence[str] = ("default",),
    events: Sequence[Event] = (),
    path: str | Path | None = None,
    resume: str | Path | None = None,
    progress: Callable[[float], None] | None = None,
    stopwatch: Stopwatch | None = None,
    assembled: Assembled | None = None,
    looks: int = LOOKS,
    fast: Fast | None = None,
) -> Result:
    """Integrate the equations of motion of a scene from `start` to `end` [s], keeping a row every `output_step` [s].

    method      : RK4(step), ROS2(step), ...
    outputs     : names or patterns of the quantities to keep (`ffr_dyn.results.quantities.selected`), such as "*.power"
    events      : moments to find (`ffr_dyn.analyses.events`), listed in the result's attribute "events"; one may end the run
    path        : a result file written as the run goes on; a run that is stopped or killed leaves it readable
    resume      : a result file whose run goes on to the same bits; `end` may be later. A new file: a run from the start
    progress    : called with the time reached, a few times a second;  stopwatch : takes the time of the compiled loop
    assembled   : what `assemble` made of the scene at `start`, for programs that run it more than once
    looks       : states from row to row of which work is added up, where the method chooses its steps
    fast        : what functions of time do within steps, which are divided there

    Raises InputError for a scene or settings that cannot be used, ComputationError when the run fails: with the time,
    the body or joint, the likely cause and what to change. Energy that no force or driver has put in is a failure.
    """
    check_output_step(output_step)
    check_method(method)
    spacing = output_step / looks if method.controlled else method.step
    substeps, rows = _counts(end - start, output_step, spacing)
    _check_step(scene, method)
    _check_stabilisation(method, stabilisation)
    events = several("events", events, (Event,))
    assembled = assemble(scene, time=start) if assembled is None else assembled
    wanted = selected(assembled.system, outputs)
    path = resume if path is None else path
    mark = "" if path is None else _fingerprint(assembled, method, stabilisation, start, output_step, wanted, events)
    assembled = _with_divided_steps(assembled, fast, spacing)
    header = _header(scene, assembled, method, stabilisation, (start, end, output_step))
    kept = _kept(assembled.system, wanted, rows) if path is None and not events else Measured(assembled.system, wanted)
    watcher = _watcher(assembled, method, stabilisation, spacing, events, fast)
    run = _begun(assembled, method, stabilisation, start, spacing, kept, resume, mark, fast, watcher)
    _check_resumed(run.done, substeps * rows, output_step / substeps)
    with nullcontext() if path is None else _writer(path, scene, run, header, mark) as writer:
        for times, part in _advance(assembled, run, method, start, substeps, rows, wanted, stopwatch):
            if writer is not None:
                writer.append(times, {name: quantity.values for name, quantity in part.items()}, _checkpoint(run, mark))
            if progress is not None:
                progress(float(times[-1]))
        account = _account(run, header["notes"], fast) | ({} if watcher is None else _passed(watcher))
        if writer is not None:
            writer.close("complete", header | account)
    return _result(scene, run, header | account | {"status": "complete"})


def fast_within(system: System, method: Integrator, start: float, end: float, output_step: float) -> Fast | None:
    """What functions of time do within the steps of a method, or within a LOOKS of a row where it chooses them."""
    check_output_step(output_step)
    check_method(method)
    return fast_of(system, start, end, output_step, output_step / LOOKS if method.controlled else method.step)


def _with_divided_steps(assembled: Assembled, fast: Fast | None, step: float) -> Assembled:
    """The scene, of which steps are divided where functions of time change faster."""
    if fast is None:
        return assembled
    every = assembled.all_rows
    return replace(
        assembled,
        system=divided(assembled.system, fast, step),
        all_rows=None if every is None else divided(every, fast, step),
        notes=(*assembled.notes, *fast.words),
    )


def _kept(system: System, wanted: Mapping[str, Entry], rows: int) -> Kept:
    """Memory for the quantities of a run of so many output rows that writes no file and looks for no event."""
    if needs_every_step(wanted) or rows * row_size(system) > SMALL:
        return Measured(system, wanted)
    return Recorded(system, wanted)


def _writer(path: str | Path, scene: Scene, run: _Run, header: dict[str, Any], mark: str) -> ResultWriter:
    """Of a file that has the first row."""
    first = Result(run.kept.times[0], run.kept.quantities(), geometry(scene), header | {"status": "running"})
    return ResultWriter(path, first, checkpoint=_checkpoint(run, mark))


def check_output_step(output_step: float) -> None:
    """Raises InputError for one that is none."""
    require_kind(output_step, Real, "the output step", "seconds, such as 0.01")
    if not 0 < output_step < np.inf:
        raise InputError(f"the output step is {output_step} s; it must be positive and finite")


def check_method(method: object) -> None:
    """Raises InputError for what is no method with its settings, such as a name, a class or another program's solver."""
    if isinstance(method, type) or not (isinstance(method, Within | None) or hasattr(method, "do_step")):
        raise InputError(f"method is {method!r}; give one with its step, such as ROS2(1e-3)")


def _counts(span: float, output_step: float, step: float) -> tuple[int, int]:
    """(steps per output row, output rows)."""
    if not 0 < span < np.inf:
        raise InputError(f"the duration, from start to end, is {span:.6g} s; it must be positive and finite")
    substeps, rows = round(output_step / step), round(span / output_step)
    if substeps < 1 or abs(substeps * step - output_step) > 1e-9 * output_step:
        better = output_step / max(1, round(output_step / step))
        raise InputError(
            f"the output step {output_step} s is not a multiple of the step {step} s; try a step of {better:.12g}"
        )
    if rows < 1 or abs(rows * output_step - span) > 1e-9 * span:
        whole = max(1, rows)
        raise InputError(
            f"the duration {span:.6g} s is not a multiple of the output step {output_step:.6g} s; try an output step of "
            f"{span / whole:.12g}, or let it last {whole * output_step:.12g} s"
        )
    if rows > _MOST_ROWS:
        raise InputError(
            f"an output step of {output_step:g} s makes {float(rows):.2g} rows of {span:g} s, which no disk holds; give a "
            "longer output step"
        )
    if substeps * rows > _MOST_STEPS:
        raise InputError(
            f"steps of {step:g} s make {float(substeps) * rows:.2g} steps of {span:g} s, which no computer takes; give a "
            "longer step"
        )
    return substeps, rows


def _check_stabilisation(method: Integrator, stabilisation: Stabilisation) -> None:
    """Refuse what is none, and gains of accelerations for a method that keeps constraints in another way."""
    if not isinstance(stabilisation, get_args(Stabilisation)):
        raise InputError(f"stabilisation is {stabilisation!r}; give Projection(), Baumgarte(alpha, beta) or Drifting()")
    if isinstance(stabilisation, Baumgarte) and method.row_stages:
        others = [kind.__name__ for kind in methods().values() if not kind.row_stages]
        raise InputError(
            f"Baumgarte's gains act on the accelerations of the constraints, and {type(method).__name__} holds positions or "
            f"rates themselves; leave them out, or use one of {', '.join(others)}"
        )


def _check_step(scene: Scene, method: Integrator) -> None:
    """Refuse an explicit step that cannot be stable for any state."""
    flexible = [(float(body.model.omega2.max(initial=0.0)), body) for body in scene.bodies if body.model.n]
    if not flexible:
        return
    omega2, fastest = max(flexible, key=lambda one: one[0])
    omega = math.sqrt(omega2)
    if method.step * omega > method.reach:
        raise InputError(
            f"{type(method).__name__} with a step of {method.step:g} s is unstable: body {fastest.name!r} has a mode of "
            f"{omega / 2 / np.pi:.4g} Hz, which needs a step below {method.reach / omega:.2g} s (joints lower this further); "
            "use ROS2, fewer modes or a smaller step"
        )


def _begun(
    assembled: Assembled,
    method: Integrator,
    stabilisation: Stabilisation,
    start: float,
    spacing: float,
    kept: Kept,
    resume: str | Path | None,
    mark: str,
    fast: Fast | None,
    watcher: Watcher | None,
) -> _Run:
    """The run at its start, or where the file to resume left it."""
    system, gained = assembled.system, gains(stabilisation)
    seen = nothing_seen(assembled, method, *held(system.scene, stabilisation))
    engine = new_engine(system, assembled.x, assembled.v, method, gained, start=start, spacing=spacing)
    moments = np.zeros(0) if fast is None else fast.moments
    energy = EnergyWatch(system, method, gained, spacing, lambda rows: with_all_reactions(assembled, rows), moments)
    if resume is not None and Path(resume).exists():
        return _resumed(Path(resume), mark, engine, energy, seen, kept, watcher)
    return _started(assembled, engine, energy, seen, start, kept, watcher)


def _started(
    assembled: Assembled,
    engine: Engine,
    energy: EnergyWatch,
    seen: Seen,
    start: float,
    kept: Kept,
    watcher: Watcher | None,
) -> _Run:
    """The run with its first row."""
    first = new_record(assembled.system, 1)
    status = record_row(engine, start, first, 0)
    if status != OK:
        raise failing.failure(engine.system, engine.work, status, start)
    first = with_all_reactions(assembled, first)
    singular = engine.work.independence[HERE] < AT
    shown = with_limits(assembled.system, assembled.all_rows, first) if singular else first
    kept.add(View(assembled.system, shown), np.zeros(1, dtype=np.int64))
    run = _Run(engine, energy, kept, seen, 0, watcher)
    if isinstance(kept, Measured):
        _look(run, first)  # a file holds what has been seen of its rows
    else:
        run.unseen = first
    if watcher is not None:
        watcher.begin(engine, start)
    return run


def _look(run: _Run, rows: Record) -> None:
    """Take note of the rows that follow, and of the first where it is unseen."""
    view = View(run.seen.assembled.system, rows if run.unseen is None else joined([run.unseen, rows]))
    run.unseen = None
    run.energy.look(view)
    look(run.seen, view)


def _advance(
    assembled: Assembled,
    run: _Run,
    method: Integrator,
    start: float,
    substeps: int,
    rows: int,
    wanted: Mapping[str, Entry],
    stopwatch: Stopwatch | None,
) -> Iterator[tuple[Array, dict[str, Quantity]]]:
    """Yields (times, quantities) of output rows chunk after chunk, each about SECONDS_PER_CALL long.

    Where a quantity adds up over the steps, or events are looked for, every step is looked at and only the output rows are
    kept.
    """
    system, steps, watch = assembled.system, run.engine.tables.clock.steps, stopwatch or Stopwatch()
    looks, watcher = substeps if needs_every_step(wanted) or run.watcher is not None else 1, run.watcher
    ends = watcher is not None and watcher.ended_by is not None
    count = _first_rows(system, method, substeps)
    while run.done < rows * substeps and not ends:
        chunk = new_record(system, looks * min(count, rows - run.done // substeps))
        before = _state(run.engine) if watcher is not None and watcher.may_end else {}
        with watch:
            status = fill_rows(run.engine, chunk, start, substeps // looks)
        ready = int(steps[FILLED])
        filled = ready - ready % looks
        reached_rows = _first(chunk, ready)
        cause, lost = _lost(run, method, start, reached_rows, status)
        if cause and not (before and filled):
            raise ComputationError(cause)
        if filled:
            kept = with_all_reactions(assembled, _first(reached_rows, filled))
            if watcher is not None:
                kept, ends = _looked(watcher, kept, cause)
            if ends:
                status, filled = OK, kept.time.size - 1
                cause, lost = _lost(run, method, start, _again(run.engine, before, filled, start), OK)
            if cause:
                raise ComputationError(cause)
            _look(run, kept)
            if run.engine.work.independence[LEAST] < AT:
                kept = with_limits(system, assembled.all_rows, kept)
            part = _added(run, View(system, kept), _shown(kept.time.size, looks, ends))
            times = run.kept.times[-1]
            if nonsense := meaningless(system.scene, run.seen.arrays["bodies"]):
                raise ComputationError(f"by t = {times[-1]:.6g} s {nonsense}")
            if lost is not None and status == OK and run.energy.gains[2] > 0:
                raise ComputationError(lost.text)
            run.done += filled // looks * substeps
            yield times, part
        if status != OK:
            _require_soft(run, method, status, reached(run.engine, start))
            gained = run.energy.gains
            branches = BRANCHES if run.done == 0 and BRANCHES in assembled.notes else ""
            settings = failing.Settings(method, gained[2] > 0, excess_of_gains(gained, run.energy.spacing), branches)
            raise failing.failure(run.engine.system, run.engine.work, status, reached(run.engine, start), settings)
        count = int(min(max(count * SECONDS_PER_CALL / max(watch.last, 1e-6), 1), 10 * count))


def _added(run: _Run, view: View, shown: Array) -> dict[str, Quantity]:
    """The quantities of rows that follow, of which the last may be that of an event."""
    if run.watcher is None or run.watcher.last_step is None:
        return run.kept.add(view, shown)
    assert isinstance(run.kept, Measured)
    return run.kept.add(view, shown, View(view.system, run.watcher.last_step))


def _looked(watcher: Watcher, rows: Record, cause: str) -> tuple[Record, bool]:
    """What a watcher finds in rows, of which a cause tells why they may be none; ComputationError with it where they are."""
    try:
        return watcher.look(rows)
    except (InputError, ComputationError):
        if cause:
            raise ComputationError(cause) from None
        raise


def _state(engine: Engine) -> dict[str, Array]:
    """A copy of all that an engine changes."""
    return {name: array.copy() for name, array in _changing(engine)}


def _again(engine: Engine, before: Mapping[str, Array], count: int, start: float) -> Record:
    """So many steps from a state before, so that an engine has gone no farther than the event that ends a run: what comes
    after it is neither counted nor told."""
    for name, array in _changing(engine):
        array[...] = before[name]
    rows = new_record(engine.system, count)
    if count:
        fill_rows(engine, rows, start, 1)
    return rows


def _lost(run: _Run, method: Integrator, start: float, rows: Record, status: int) -> tuple[str, Lost | None]:
    """Why the steps up to these rows follow no motion, if they do not, and where."""
    lost = None if method.controlled else unfollowed(run.engine.system, run.engine.work, method.step, rows)
    return _driver_lost(run, method, start, rows, status, lost), lost


def _first(rows: Record, count: int) -> Record:
    """The first rows of a record."""
    return rows if count == rows.time.size else Record(*(column[:count] for column in rows))


def _require_soft(run: _Run, method: Integrator, status: int, time: float) -> None:
    """ComputationError where steps that have failed are too long for a force that the method takes explicitly."""
    if status in (USER_FAILED, STEP_TOO_SMALL):
        return
    if run.unseen is not None:
        look(run.seen, View(run.engine.system, run.unseen))
    for text in told(run.engine.system, method, run.seen.arrays["rates"])[:1]:
        raise ComputationError(f"at t = {time:.6g} s the steps do not go on: {text}")


def _first_rows(system: System, method: Integrator, substeps: int) -> int:
    """How many rows the loop is asked for before it is known how long they take; one where Python functions are called."""
    if system.model.user_count:
        return 1
    evaluations = substeps * max(method.stage_count, 1)
    fitting = SECONDS_PER_CALL / SURE / (1e-6 * evaluations * evaluation_cost(system.scene))
    return int(min(max(fitting, 1), MOST_ROWS))


def evaluation_cost(scene: Scene) -> float:
    """[us], about, of one evaluation; the same on every machine."""
    return sum(1.0 + 0.02 * body.model.n + 7e-4 * body.model.n**2 for body in scene.bodies)


def _driver_lost(run: _Run, method: Integrator, start: float, rows: Record, status: int, lost: Lost | None) -> str:
    """Which driver is why the steps up to these rows do not follow the motion, or have failed; empty where none is."""
    system, now = run.engine.system, reached(run.engine, start)
    if method.controlled:  # its errors tell what it does not follow, but it may pass a jump over
        ahead = now if status == OK else now + run.energy.spacing
        return jumped(system, np.array([run.kept.times[-1][-1], *rows.time, ahead]))
    if status != OK:
        early, late = now - method.step, now + method.step
        return jumped(system, np.array([early, now, late])) or lost_driver(system, early, late, STALLED)
    if lost is None:
        return ""
    found = lost_driver(system, lost.time - method.step, lost.time, LOST)
    return found or jumped(system, np.concatenate([*run.kept.times, rows.time]))


def _shown(rows: int, looks: int, ends: bool) -> Array:
    """Numbers of the output rows among those that were looked at; the row of an event that ends the run is one."""
    shown = np.arange(looks - 1, rows, looks)
    return np.union1d(shown, [rows - 1]) if ends else shown


def _watcher(
    assembled: Assembled,
    method: Integrator,
    stabilisation: Stabilisation,
    spacing: float,
    events: Sequence[Event],
    fast: Fast | None,
) -> Watcher | None:
    """The search for events; None where there are none."""
    if not events:
        return None
    times = np.zeros(0) if fast is None else division_times(fast, spacing)
    complete = partial(with_all_reactions, assembled)
    return Watcher(assembled, method, gains(stabilisation), spacing, events, complete, times)


def _passed(watcher: Watcher) -> dict[str, Any]:
    """The attributes on events."""
    return {"events": watcher.found} | ({} if watcher.ended_by is None else {ENDED_BY: watcher.ended_by})


def reached(engine: Engine, start: float) -> float:
    """Time of the engine's state [s], for a run from `start`."""
    clock, control = engine.tables.clock, engine.tables.control
    if control.numbers.size:
        return float(control.numbers[NOW])
    return start + int(clock.steps[NEXT]) * float(clock.time[SPACING])


def with_all_reactions(assembled: Assembled, record: Record) -> Record:
    """The record with reactions and violations of the redundant rows too, and accelerations that all rows agree on: those
    that the motion keeps may depend on one another where the mechanism is not singular."""
    if assembled.all_rows is None:
        return record
    return with_reactions_of(new_engine(assembled.all_rows, record.x[0], record.v[0]), assembled.system, record)


def with_reactions_of(engine: Engine, kept: System, record: Record) -> Record:
    """The record of a system that keeps some rows of a scene, with what the engine of all of them finds at its states."""
    system = engine.system
    one = new_record(system, 1)
    names = [block.name for block in system.blocks]
    numbers = [names.index(block.name) for block in kept.blocks]
    reaction, violation, vd = np.empty_like(record.reaction), np.empty_like(record.violation), np.empty_like(record.vd)
    for row, moment in enumerate(record.time):
        engine.x[:], engine.v[:] = record.x[row], record.v[row]
        engine.work.loads.reference[:] = record.forces[row]
        record_row(engine, moment, one, 0)
        reaction[row], violation[row], vd[row] = one.reaction[0, numbers], one.violation[0], one.vd[0]
    return record._replace(reaction=reaction, violation=violation, vd=vd)


# ---- stopping and going on -------------------------------------------------------------------------------------------


def _fingerprint(
    assembled: Assembled,
    method: Integrator,
    stabilisation: Stabilisation,
    start: float,
    output_step: float,
    wanted: Mapping[str, Entry],
    events: Sequence[Event],
) -> str:
    state = (assembled.x.tobytes(), assembled.v.tobytes())
    looked_for = [replace(of, quantity="") if callable(of.quantity) else of for of in events]
    settings = (method, stabilisation, start, output_step, list(wanted), *looked_for)
    return fingerprint(assembled.system.model, *state, *settings)


KEY = "machine."  # before the names of an engine's tables in result files


def _checkpoint(run: _Run, mark: str) -> Array:
    assert isinstance(run.kept, Measured)
    arrays, memory = ({}, {}) if run.watcher is None else run.watcher.state()
    whole = _arrays(run.engine, run.energy, run.seen) | arrays
    return encode(Checkpoint(mark, run.done, whole, {**run.kept.memory, **memory}))


def _arrays(engine: Engine, energy: EnergyWatch, seen: Seen) -> dict[str, Array]:
    """All that a run changes, by name."""
    machine = {KEY + key: array for key, array in _changing(engine)}
    stops = {f"stops.{name}": array for name, array in energy.account.stops.items()}
    return {**seen.arrays, "account": energy.account.numbers, **stops, **machine}


def _changing(engine: Engine) -> Iterator[tuple[str, Array]]:
    """The tables of an engine that a run changes, by name."""
    for name in ("work", "stages", "clock", "control", "x", "v"):
        yield from leaves(getattr(engine.tables, name), name)


def check_continues(
    path: str | Path,
    assembled: Assembled,
    method: Integrator,
    *,
    start: float,
    end: float,
    output_step: float,
    stabilisation: Stabilisation,
    outputs: Sequence[str],
    events: Sequence[Event],
    **others: Any,
) -> None:
    """Raises InputError where the run that a result file holds does not go on with these settings; what `others` there are
    does not matter."""
    wanted = selected(assembled.system, outputs)
    saved = _saved(Path(path), _fingerprint(assembled, method, stabilisation, start, output_step, wanted, events))
    _check_resumed(saved.steps, round((end - start) / method.step), method.step)


def _saved(path: Path, mark: str) -> Checkpoint:
    """The checkpoint of a result file, which has to be of the run with this mark."""
    content = load_checkpoint(path)
    if content is None:
        raise InputError(f"{path} has no checkpoint: it is not the result of a forward run; run from the start")
    saved = decode(content)
    if saved.fingerprint != mark:
        raise InputError(
            f"{path} is the result of another scene or of other settings (step, method, start, output step, outputs): its "
            "run cannot be continued with these; run from the start, to another file if that one is still wanted"
        )
    return saved


def _resumed(
    path: Path, mark: str, engine: Engine, energy: EnergyWatch, seen: Seen, kept: Kept, watcher: Watcher | None
) -> _Run:
    """The run that a result file holds, ready to go on in the engine."""
    saved, earlier = _saved(path, mark), load_result(path)
    changing = _arrays(engine, energy, seen)
    if any(name not in saved.arrays or saved.arrays[name].shape != array.shape for name, array in changing.items()):
        raise InputError(
            f"{path} was written by another version of ffr_dyn, whose runs this one cannot continue; run from the start, to "
            "another file if that one is still wanted"
        )
    for name, array in changing.items():
        array[...] = saved.arrays[name]
    assert isinstance(kept, Measured)
    kept.memory = {name: of for name, of in saved.memory.items() if not name.startswith(MEMORY)}
    kept.parts.append(dict(earlier.quantities))
    kept.times.append(earlier.time)
    if watcher is not None:
        watcher.go_on(saved)
    return _Run(engine, energy, kept, seen, saved.steps, watcher)


def _check_resumed(done: int, steps: int, step: float) -> None:
    if done > steps:
        raise InputError(f"the run to be continued has gone {(done - steps) * step:g} s beyond this end already")


# ---- the result -----------------------------------------------------------------------------------------------------


def _header(
    scene: Scene,
    assembled: Assembled,
    method: Integrator,
    stabilisation: Stabilisation,
    span: tuple[float, float, float],
) -> dict[str, Any]:
    start, end, output_step = span
    return {
        **described(scene),
        "analysis": "forward dynamics",
        "method": f"{method!r}",
        "step": method.step,
        "stabilisation": f"{stabilisation!r}",
        "start": start,
        "end": end,
        "output_step": output_step,
        "degrees_of_freedom": assembled.degrees_of_freedom,
        "computed": assembled.computed,
        "notes": list(assembled.notes),
    }


def geometry(scene: Scene) -> dict[str, Surface]:
    """The surfaces of the bodies in their own frames."""
    surfaces = {body.name: surface_of(body) for body in scene.bodies}
    return {name: surface for name, surface in surfaces.items() if surface is not None}


def _result(scene: Scene, run: _Run, attributes: dict[str, Any]) -> Result:
    return Result(np.concatenate(run.kept.times), run.kept.quantities(), geometry(scene), attributes)


def _account(run: _Run, notes: list[str], fast: Fast | None) -> dict[str, Any]:
    """The attributes that only the end of a run can tell."""
    assembled = run.seen.assembled
    info, drift = run.engine.work.info, run.engine.work.drift
    ends, spacing = (assembled.x, run.engine.x), run.energy.spacing
    span = float(run.kept.times[0][0]), float(run.kept.times[-1][-1])
    return {
        "evaluations": int(info[EVALUATIONS]),
        "projections": int(info[PROJECTIONS]),
        **_steps(run.engine),
        "largest_drift": [float(drift[PHI]), float(drift[PHI_DOT])],
        **({"meeting": lasts} if (lasts := run.energy.shortest_meeting()) < np.inf else {}),
        **({"rebounds": "; ".join(lost)} if (lost := run.energy.lost_rebounds()) else {}),
        **({"missed": missed} if (missed := run.energy.stops_between_rows()) else {}),
        "notes": [
            *notes,
            *ended(
                "forward",
                run.seen,
                {
                    SINGULAR: passed_in_words(assembled.system, assembled.blocks, ends, run.engine.work, spacing),
                    SUDDEN: sudden(assembled.system, np.zeros(0) if fast is None else fast.breaks, *span),
                    BALANCE: run.energy.amiss(),
                    **between_rows(run.seen, run.engine.system, run.engine.work),
                },
            ),
        ],
    }


def _steps(engine: Engine) -> dict[str, Any]:
    """Steps that the method chose."""
    control = engine.tables.control
    return {"steps": int(control.counts[0]), "refused_steps": int(control.counts[1])} if control.numbers.size else {}
