"""Forward dynamics: all forces known, the motion wanted, with what the length of the steps costs every output.

A run is followed by others that tell its error (`ffr_dyn.consistency.step_error`), and where no step is given the one is
looked for that is short enough.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence, Set
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, Literal, get_args

import numpy as np

from ffr_dyn.analyses.events import Event, doubts, with_errors
from ffr_dyn.analyses.integration import LOOKS, check_method, check_output_step, evaluation_cost, fast_within, integrate
from ffr_dyn.analyses.registry import OverTime, option
from ffr_dyn.analyses.rotating.periodic import periodically
from ffr_dyn.analyses.settings import Settings
from ffr_dyn.compile.divided_steps import Fast, fast_of
from ffr_dyn.compile.scene_tables import System
from ffr_dyn.consistency.assemble import Assembled, assemble
from ffr_dyn.consistency.quasi_static import quasi_static
from ffr_dyn.consistency.step_error import (
    A_FORMULA,
    BEYOND,
    OVER_BREAKS,
    PARTLY_STIFF,
    PLACES,
    Beside,
    StepError,
    begins_alone,
    from_rounding,
    larger,
    of_the_range,
    on_shared_rows,
    order_shown,
    percent,
    step_errors,
    too_coarse,
    untold_breaks,
    with_start,
    worst,
)
from ffr_dyn.consistency.unresolved import Vibrations, lasting, leading, vibrations
from ffr_dyn.functions.stopwatch import Stopwatch
from ffr_dyn.functions.together import Say, together
from ffr_dyn.integrators import Integrator, Within, stepped
from ffr_dyn.integrators.ros2 import Twin
from ffr_dyn.integrators.stabilisation import Projection, Stabilisation
from ffr_dyn.integrators.tolerances import tightened
from ffr_dyn.linear.departure import at_rest_in_part, departures, free_to_leave, places, pushed
from ffr_dyn.linear.steady_state import steadily
from ffr_dyn.results.file import load_result, with_attributes
from ffr_dyn.results.result import Result
from ffr_dyn.scene.checks import several
from ffr_dyn.scene.force_kinds import forces_of
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.errors import ComputationError, InputError

FIRST, FINEST = 4, 1024  # steps to an output row: of the first trial, and at most
LEAP = {2: 16}  # times more in the next one at most, by order (others: 8): an earlier trial tells the error of the next
MARGIN = 2.0  # by which a trial aims below the accuracy
PROJECTED = (
    1e-8  # of the accuracy [m, -], that constraints are closed to: 1e-9 m moved forces by up to 1e-3 of their range
)
SURE = 2  # order that linearly implicit methods keep where elastic forces are stiff
SLOW = 0.7  # a ringing output's error falls slower than the step to this power,
IN_COMPANY = 1.4  # or to this one, if it is of vibration, where others ring
SHOWN = 3  # times in a note
WATCHED, FEW = 50, 1  # rows at least by which a disturbed run is held against the other, and steps to a row
SHORTEST, LONGEST = 8, 64  # steps to a row, by which what it seems to show is looked at again
QUICK = 1e7  # microseconds of the further runs, by `_cost`, up to which they are made unasked

Beginning = Literal["as-given", "quasi-static", "steady", "periodic"]  # the default and the others

# What a step is to keep within the accuracy always, and what where it does not ring.
DRIVING = re.compile(r"\.(displacement|rotation|force|moment|effort|torque|tension)$|^measured\.")


@dataclass(frozen=True)
class Forward(OverTime):
    """From start to end; without a step the one is found that keeps the accuracy.

    events : moments to find, by name

    >>> analysis = fd.Forward(check=True)
    >>> result = fd.run(scene, fd.Settings(start=0, end=1, output_step=0.01, method=fd.Within(), analysis=analysis))
    """

    resumable: ClassVar[bool] = True
    integrates: ClassVar[bool] = True
    stabilised: ClassVar[bool] = True
    events: tuple[Event, ...] = ()
    check: bool | None = field(
        default=None,
        metadata=option("--check/--no-check", "Tell the error of every output by further runs; default: if short."),
    )
    begin: Beginning = field(
        default="as-given",
        metadata=option(
            "--as-given/--quasi-static/--steady/--periodic",
            "Start with the deflections of the scene (default). | Start with the quasi-static deflections of the motion: "
            "no shock. | Start in the steady motion. | Start in the periodic motion.",
        ),
    )

    def perform(self, scene: Scene, settings: Settings, **how: Any) -> Result:
        own: dict[str, Any] = {
            "events": self.events,
            "check": self.check,
            "begin": self.begin,
            "method": settings.method,
            "stabilisation": settings.stabilisation,
        }
        return forward(scene, **own, **settings.span, **how)


@dataclass(frozen=True)
class _Runs:
    """A scene and what all its runs have in common."""

    scene: Scene
    assembled: Assembled
    start: float
    output_step: float
    how: dict[str, Any]
    begin: Beginning
    work: list[int] = field(default_factory=list)  # evaluations of each

    @cached_property
    def vibrations(self) -> Vibrations:
        """Of the scene at its start."""
        return vibrations(self.assembled, self.start)

    @cached_property
    def free_to_leave(self) -> Assembled:
        """The start in space where a plane was found for it, but for periodic motions, which take long to find."""
        if self.begin == "periodic":
            return self.assembled
        return free_to_leave(self.scene, self.assembled, self.start, lambda one: begun(one, self.start, self.begin))

    @cached_property
    def feels(self) -> bool:
        """Whether Python functions of the state act, of which nobody tells where on the way they jump or have a kink."""
        return any(callback.with_state for callback in self.assembled.system.user.callbacks)

    @cached_property
    def untold(self) -> dict[str, list[float]]:
        """When [s] functions of time break without steps that end there, by what they are for."""
        count = round((self.how["end"] - self.start) / self.output_step)
        times, fast = np.linspace(self.start, self.how["end"], count + 1), self.how["fast"]
        return untold_breaks(self.assembled.system, times, () if fast is None else fast.jumps[:, 1].tolist())

    @cached_property
    def sudden(self) -> bool:
        """Whether forces may change within a step, however short: a run has an order beside about twice the step at most."""
        return bool(self.untold) or self.feels or any(force.sudden for force in forces_of(self.scene))

    def run(self, method: Integrator, **more: Any) -> Result:
        """One run."""
        found = integrate(self.scene, method=method, assembled=self.assembled, **{**self.how, **more})
        self.work.append(found.attributes["evaluations"])
        return found

    def together(self, calls: Sequence[Callable[[Say], Any]], leader: bool) -> list[Any]:
        """The results of the calls, or their exceptions; that of a leader, the first, ends the others and is raised.

        They go on at the same time, and progress is their mean; one after another beside a stopwatch, and with the user's
        Python functions, which would be called out of order.
        """
        python = self.assembled.system.user.count or any(callable(event.quantity) for event in self.how["events"])
        lonely = self.how["stopwatch"] is not None or python
        progress, found, times = self.how["progress"], dict[int, Any](), [self.start] * len(calls)

        def heard(number: int, time: float) -> None:
            times[number] = time
            if progress is not None:
                progress(sum(times) / len(times))

        for number, outcome in together(calls, 1 if lonely else None, heard):
            found[number] = _granted(outcome) if leader and number == 0 else outcome
        return [found[number] for number in range(len(calls))]


def forward(
    scene: Scene,
    *,
    end: float,
    output_step: float,
    method: Integrator | Within | None = None,
    start: float = 0.0,
    stabilisation: Stabilisation = Projection(),  # noqa: B008 - frozen
    outputs: Sequence[str] = ("default",),
    events: Sequence[Event] = (),
    check: bool | None = None,
    begin: Beginning = "as-given",
    path: str | Path | None = None,
    resume: str | Path | None = None,
    progress: Callable[[float], None] | None = None,
    stopwatch: Stopwatch | None = None,
    assembled: Assembled | None = None,
) -> Result:
    """Integrate the equations of motion of a scene from `start` to `end` [s], keeping a row every `output_step` [s].

    method      : RK4(step), ROS2(step), ...; or `Within(accuracy)`, the default with 1e-3: the step is found that keeps
                  positions and angles within the accuracy of their ranges, forces where they do not ring, joints 1e-8 of it
    outputs     : names or patterns of the quantities to keep (`ffr_dyn.results.quantities.selected`), such as "*.power"
    events      : moments to find (`ffr_dyn.analyses.events`), listed in the result's attribute "events"; one may end the run
    check       : whether further runs tell the error of every output; default: where that takes seconds, or finds the step
    begin       : "quasi-static": with the deflections that the motion asks for, which do not ring; "steady", "periodic": in
                  the motion of these analyses, of machines driven evenly; "as-given": with the scene's q and q_dot
    path        : a result file written as the run goes on; a run that is stopped or killed leaves it readable
    resume      : a result file whose run goes on to the same bits; `end` may be later. A new file: a run from the start
    progress    : called with the time reached, or the mean of runs that go on at the same time, a few times a second
    stopwatch   : takes the time of the integrator's compiled loop, in all runs, which go on one after another then
    assembled   : what `assemble` made of the scene at `start`, for programs that run it more than once

    The result's attribute "errors" has [error in its unit, error over range] of every output, "accuracy" the worst in words,
    "effort" the evaluations of all runs over those of the one kept. Notes tell what rings and which rows are too coarse.

    Raises InputError for a scene or settings that cannot be used, ComputationError when the run fails: with the time,
    the body or joint, the likely cause and what to change. Energy that no force or driver has put in is a failure.

    >>> result = fd.forward(scene, end=2.0, output_step=0.01)
    """
    check_output_step(output_step)
    check_method(method)
    assembled = begun(assemble(scene, time=start) if assembled is None else assembled, start, begin, method)
    common: dict[str, Any] = {"start": start, "end": end, "output_step": output_step, "outputs": outputs}
    common |= {"stabilisation": stabilisation, "progress": progress, "stopwatch": stopwatch}
    common["events"] = several("events", events, (Event,))
    wanted = method or Within()
    if isinstance(wanted, Within) or stabilisation == Projection():
        common["stabilisation"] = _tight(stabilisation, getattr(wanted, "accuracy", Within().accuracy))
    common["fast"] = _fast(assembled.system, wanted, start, end, output_step)
    runs, kept = _Runs(scene, assembled, start, output_step, common, begin), {"path": path, "resume": resume}
    method, count = _resumed(resume, wanted, output_step)
    if isinstance(method, Within):
        return _searched(runs, method, kept, count)
    count = 0 if method.controlled else round(output_step / method.step)
    told = _checked(runs, method, count, kept) if check else _Trial(method, count, runs.run(method, **kept))
    if check is None and _cost(assembled, told.result) < QUICK:
        told = _checked(runs, method, count, kept, told.result)
    return _finished(runs, told, resume if path is None else path)


def _fast(system: System, wanted: Integrator | Within, start: float, end: float, output_step: float) -> Fast | None:
    """What functions of time do within the steps of a method, or within those of the first trial."""
    if isinstance(wanted, Within):
        return fast_of(system, start, end, output_step, output_step / FIRST)
    return fast_within(system, wanted, start, end, output_step)


def _tight(stabilisation: Stabilisation, accuracy: float) -> Stabilisation:
    """A projection that is no floor of what is to be kept within the accuracy."""
    if not isinstance(stabilisation, Projection):
        return stabilisation
    return Projection(min(stabilisation.tolerance, PROJECTED * accuracy))


def begun(assembled: Assembled, start: float, begin: Beginning, method: Integrator | Within | None = None) -> Assembled:
    """The state that a run begins in; a method without steps of its own is no method of a periodic motion."""
    if begin not in get_args(Beginning):
        raise InputError(f"begin is {begin!r}; it must be one of {', '.join(map(repr, get_args(Beginning)))}")
    if begin == "quasi-static":
        return quasi_static(assembled, start)
    if begin == "periodic":
        return periodically(assembled, start, None if isinstance(method, Within) else method)
    return steadily(assembled, start) if begin == "steady" else assembled


def _resumed(
    resume: str | Path | None, method: Integrator | Within, output_step: float
) -> tuple[Integrator | Within, int]:
    """The method of a run that goes on, and how many steps to a row the first trial has where one is still looked for: a
    finished run has found its step, one that was stopped was a trial."""
    if isinstance(method, Within) and resume is not None and Path(resume).exists():
        attributes = load_result(resume).attributes
        if step := attributes.get("step"):
            return (stepped(method, step) if "errors" in attributes else method), round(output_step / step)
    return method, FIRST


# ---- the error of a run ---------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Trial:
    """A run and what tells its error; no errors where the runs that would tell them failed."""

    method: Integrator
    count: int  # steps to an output row
    result: Result
    twins: tuple[Beside, ...] = ()
    errors: Mapping[str, StepError] = field(default_factory=dict)
    events: Sequence[Mapping[str, Any]] = ()  # with their errors, and notes on them
    doubts: Sequence[str] = ()


def _checked(
    runs: _Runs, method: Integrator, count: int, kept: Mapping[str, Any], result: Result | None = None
) -> _Trial:
    """A run, unless it is there already, with all that tells its errors."""
    trial, more = _with_twin(runs, method, count, kept, result, _further(runs, method, count))
    return _told(runs, trial, *more)


def _with_twin(
    runs: _Runs,
    method: Integrator,
    count: int,
    kept: Mapping[str, Any],
    result: Result | None = None,
    more: Sequence[Callable[[Say], Any]] = (),
) -> tuple[_Trial, list[Any]]:
    """A run, unless it is there already, beside its twin, with what that tells of its errors; and what `more` returned.

    Raises what the run itself raises; where the twin fails there are no errors.
    """
    twin = [] if (share := _share(method)) is None else [lambda say: _twin(runs, method, share, say)]
    own = [] if result is not None else [lambda say: runs.run(method, **kept, progress=say)]
    outcomes = runs.together([*own, *twin, *more], leader=result is None)
    result = outcomes.pop(0) if result is None else result
    found, others = outcomes[: len(twin)], outcomes[len(twin) :]
    if not found or _failed(found[0]):
        return _Trial(method, count, result), others
    return _Trial(method, count, result, tuple(found), _errors(result, None, SURE, found)), others


def _errors(result: Result, other: Beside | None, order: float, twins: Sequence[Beside]) -> dict[str, StepError]:
    """`step_errors` by the rows that all runs share; none where these are too few."""
    beside = [*([] if other is None else [other]), *twins]
    run, *others = on_shared_rows([result, *(one.result for one in beside)])
    if run.time.size < 2:
        return {}
    told = [Beside(rows, one.ratio) for rows, one in zip(others, beside, strict=True)]
    return step_errors(run, None, order, told) if other is None else step_errors(run, told[0], order, told[1:])


def _granted(outcome: Any) -> Any:
    """The result of a call. Raises the exception that it raised."""
    if isinstance(outcome, BaseException):
        raise outcome
    return outcome


def _failed(outcome: Any) -> bool:
    """Whether a run came to no end; another exception is raised."""
    return isinstance(outcome, ComputationError) or _granted(outcome) is None


def _told(runs: _Runs, trial: _Trial, other: Any, *longer: Any) -> _Trial:
    """The run with its errors, also by what `_further` returned."""
    if _failed(other):
        return replace(trial, errors={})
    share, failed = _share(trial.method), any(isinstance(twin, ComputationError) for twin in longer)
    too_long = failed or (share is not None and not trial.twins)  # steps for an order, where twins fail
    order = 1 if too_long else PARTLY_STIFF if share == 0.5 else trial.method.order
    if runs.untold:
        order = OVER_BREAKS if trial.method.order == 3 else 1
    twins = (*trial.twins, *(twin for twin in longer if not _failed(twin)))
    errors, order = (
        _felt(runs, trial, other, order, twins) if runs.feels else (_errors(trial.result, other, order, twins), order)
    )
    start = _start(runs, trial.method, trial.result, trial.twins[0]) if trial.twins else ()
    errors = with_start(errors, trial.result, *start) if start else errors
    return replace(trial, twins=twins, errors=errors, **_moments(trial.result, errors, other, order, twins))


def _felt(
    runs: _Runs, trial: _Trial, other: Beside, order: float, twins: Sequence[Beside]
) -> tuple[dict[str, StepError], float]:
    """Errors, and the order that is shown by a third run, where Python functions of the state act."""
    farther = _farther(runs, trial.method, trial.count)
    shown = min(order, order_shown(trial.result, other, farther, order))
    errors = _errors(trial.result, other, shown, twins)
    return errors if farther is None else larger(errors, _errors(trial.result, farther, shown, ())), shown


def _moments(
    result: Result, errors: Mapping[str, StepError], other: Beside, order: float, twins: Sequence[Beside]
) -> dict[str, Any]:
    """The events of a run with their errors, if it has looked for any, and doubts about them."""
    if "events" not in result.attributes or not errors:
        return {}
    events = with_errors(result, errors, other, order, twins)
    further = [one.result for one in (other, *twins)]
    return {"events": events, "doubts": doubts(events, float(result.time[-1]), further)}


def _further(
    runs: _Runs, method: Any, count: int, earlier: Sequence[_Trial] = ()
) -> list[Callable[[Say], Beside | None]]:
    """The further runs that tell the error of a run beside its twin: one with another step, and, beside a twin of half the
    step, one with a longer step; those of the last trial if its step is not too far."""
    far = 2 if runs.sudden else _leap(method)
    near = next((one for one in reversed(earlier) if one.twins and count <= far * one.count), None)
    if near is not None:
        ratio = count / near.count
        known = [Beside(near.result, ratio), *(Beside(one.result, ratio * one.ratio) for one in near.twins[:1])]
        return [lambda say, one=one: one for one in known[: 1 if _share(method) == 1.0 else 2]]  # type: ignore[misc]
    others: list[Callable[[Say], Beside | None]] = [lambda say: _other(runs, method, count, say)]
    return [*others, lambda say: _longer_twin(runs, method, count, say)] if _share(method) == 0.5 else others


def _other(runs: _Runs, method: Any, count: int, say: Say) -> Beside:
    """The run with another step: about twice the step, or four times of a method of higher order unless forces change within
    steps, where elastic forces are implicit and that is part of a row, else half of it; with a tenth of the tolerances of a
    method that chooses its steps, and work added up twice as often."""
    if method.controlled:
        finer = replace(method, tolerances=tightened(method.tolerances, 10))
        return Beside(runs.run(finer, progress=say, looks=2 * LOOKS), 10.0 ** (-1.0 / method.order))
    if method.implicit and count > 1:
        fewer = -(-count // (4 if method.order > SURE and not runs.sudden else 2))
        try:
            return Beside(runs.run(replace(method, step=runs.output_step / fewer), progress=say), count / fewer)
        except ComputationError:
            pass  # half the step is sure to run
    return Beside(runs.run(replace(method, step=runs.output_step / (2 * count)), progress=say), 0.5)


def _farther(runs: _Runs, method: Any, count: int) -> Beside | None:
    """The run with about four times the step, of explicit methods twice, that tells with `_other` what order it keeps; None
    where a row is not so long, such steps fail, or the method chooses its own."""
    fewer = -(-count // (4 if method.implicit else 2))
    if not 1 <= fewer <= count // 2:
        return None
    try:
        return Beside(runs.run(replace(method, step=runs.output_step / fewer)), count / fewer)
    except (ComputationError, InputError):  # of an explicit step that is too long
        return None


def _share(method: Integrator) -> float | None:
    """Of the step, which the twin of a run has; None of methods that damp nothing the step allows."""
    if not method.implicit or method.controlled:
        return None
    return 1.0 if method.order <= SURE else 0.5


def _twin(runs: _Runs, method: Integrator, share: float, say: Say) -> Beside:
    """With a share of the step, and the damping of the scene over that."""
    step = share * method.step
    return Beside(runs.run(Twin(step, lasting(runs.vibrations, step)), progress=say), share)


def _start(runs: _Runs, method: Integrator, result: Result, twin: Beside) -> tuple[Result, ...]:
    """The steps to the first row and a little beyond as rows, and those of a twin with half the twin's step, where what
    vibrates then is gone soon; () elsewhere, and where they fail."""
    if not begins_alone(*on_shared_rows([result, twin.result])):
        return ()
    count = round(runs.output_step / method.step)
    steps = min(count + math.ceil(BEYOND * count), round((runs.how["end"] - runs.start) / method.step))
    share = 0.5 * twin.ratio * method.step
    fine = Twin(share, lasting(runs.vibrations, share))
    span = {"output_step": method.step, "end": runs.start + steps * method.step, "progress": None, "events": ()}
    try:
        return runs.run(method, **span), runs.run(fine, **span)
    except (ComputationError, InputError):  # the latter where steps are rounding beside the time of the start
        return ()


def _longer_twin(runs: _Runs, method: Integrator, count: int, say: Say) -> Beside | None:
    """With about twice the step, so many of which are a row; None where a row is one step already."""
    return _twin(runs, method, count / -(-count // 2), say) if count > 1 else None


def _cost(assembled: Assembled, result: Result) -> float:
    """[us], about, of the runs that tell the error of a run; the same on every machine."""
    return 2.0 * result.attributes["evaluations"] * evaluation_cost(assembled.system.scene)


def _finished(runs: _Runs, trial: _Trial, path: str | Path | None, ringing: Set[str] = frozenset()) -> Result:
    """The result of a run with its errors, here and in its file; `ringing` outputs are told to be so."""
    result, grown = trial.result, from_rounding(trial.result)
    unseen = _unseen(trial)
    notes = [
        *result.attributes["notes"],
        *unseen,
        *(_untold(runs) if trial.errors else ()),
        *_unresolved(runs, trial, ringing),
        *_coarse(result),
        *_unstable(result, grown),
        *(_left(runs, trial) if trial.errors and not grown else ()),
        *trial.doubts,
    ]
    trial = replace(trial, errors={name: _by_chance(e, grown.get(name, 0.0)) for name, e in trial.errors.items()})
    told = {name: [e.error, e.of_range] for name, e in trial.errors.items()}
    more: dict[str, Any] = {"notes": notes, "errors": told} | ({"events": trial.events} if trial.events else {})
    if trial.errors:
        more["accuracy"] = _at_least(trial.errors) if unseen else worst(trial.errors)
        more["effort"] = sum(runs.work) / max(1, result.attributes["evaluations"])
    attributes = {**result.attributes, **more}
    if path is not None:
        with_attributes(path, attributes)
    return replace(result, attributes=attributes)


def _at_least(errors: Mapping[str, StepError]) -> str:
    """Of errors that leave out what the steps damp."""
    name = max(errors, key=lambda one: errors[one].of_range)
    return f"step: not known; {name} is off by {of_the_range(errors[name].of_range)} or more"


def _unseen(trial: _Trial) -> list[str]:
    """A note where what the steps damp, or what stops give back, is not in the errors."""
    if not trial.errors:
        return []
    if "rebounds" in trial.result.attributes:
        return ["the error told leaves out rebounds from stops, for which the steps are too long; take a smaller step"]
    if trial.twins or _share(trial.method) is None:
        return []
    return [
        "the error told leaves out vibration that the steps damp: the run that shows it has failed; take a smaller step"
    ]


def _untold(runs: _Runs) -> list[str]:
    """Notes on breaks at which no steps end."""
    return [
        f"{what} jumps or has a kink at t = {', '.join(f'{t:.6g}' for t in times[:SHOWN])}"
        f"{', ...' * (len(times) > SHOWN)} s, where no step ends, and steps are of first order there; {_way_to_tell(what)}"
        for what, times in runs.untold.items()
    ]


def _way_to_tell(what: str) -> str:
    if what == A_FORMULA:
        return "write it with abs, min, max or step, at whose kinks they end"
    return "give its times, as in fd.user(function, breaks=[0.5])"


def _unresolved(runs: _Runs, trial: _Trial, ringing: Set[str]) -> list[str]:
    """A note on the vibration that the step does not resolve: its share, its frequency, and the price of resolving it."""
    large = {name: e for name, e in trial.errors.items() if e.of_range > Within().accuracy}
    told = {name: e for name, e in large.items() if e.vibrates or name in ringing}
    if not told or not runs.vibrations.omega.size:
        return []
    of, method = runs.vibrations, trial.method
    name = max(told, key=lambda one: told[one].of_range)
    found = leading(of, trial.result, trial.twins[0].result)
    words = f" of {found / 2 / np.pi:.4g} Hz" if found else ""
    step = (1.2 if of.ratio[-1] > 0 else 0.25) / of.omega[-1]
    times = (4 / step) / ((4 if method.order > 2 else 2) / method.step)
    return [
        f"vibration{words} that a step of {method.step:.3g} s does not resolve carries "
        f"{of_the_range(told[name].of_range)} of {name}{_others(len(told) - 1)}; rk4 with a step of {step:.2g} s resolves "
        f"it, for about {max(times, 1):.2g} times the time of this run{_without_shock(runs.begin)}"
    ]


def _without_shock(begin: Beginning) -> str:
    return '; if it is the start that excites it, begin = "quasi-static" leaves it out' if begin == "as-given" else ""


def _coarse(result: Result) -> list[str]:
    found = too_coarse(result)
    if not found:
        return []
    name = max(found, key=lambda one: found[one])
    return [
        f"rows every {float(result.attributes['output_step']):g} s are too coarse for what {name} does"
        f"{_others(len(found) - 1)}: between them it is up to {percent(found[name])} of its range off the curve through "
        "them, or more; take a smaller output_step to see it"
    ]


def _unstable(result: Result, grown: Mapping[str, float]) -> list[str]:
    """A note on what has grown from rounding."""
    if not grown:
        return []
    name = next((one for one in grown if PLACES.search(one)), next(iter(grown)))
    also = "" if len(grown) == 1 else f", {len(grown) - 1} other output{'s' if len(grown) > 2 else ''} with it"
    far = f"{grown[name]:.2g} {result.quantities[name].unit}".removesuffix(" 1")
    return [
        f"{name} grows from rounding to {far}{also}: the motion is unstable, and how far it has gone by then is chance; give "
        "it the imperfection that is meant, such as a small load or deflection"
    ]


def _left(runs: _Runs, trial: _Trial) -> list[str]:
    """A note where a disturbed motion leaves that of the run, by more steps of its own if it seems to by few."""
    if not at_rest_in_part(trial.result, runs.assembled.system):
        return []
    fine = max(1, math.ceil(WATCHED * runs.output_step / (runs.how["end"] - runs.start) - 1e-9))
    again = int(np.clip(math.ceil(trial.count / fine), SHORTEST, LONGEST))
    for steps in (FEW, again, LONGEST):
        found = _departures(runs, trial.result, fine, steps)
        if found is not None and (not found or steps > FEW):
            break
    if not found:
        return []
    name = max(found, key=lambda one: (one in trial.result.quantities, found[one]))
    return [
        f"the motion is unstable: a disturbance at the start grows to {found[name]:.1g} times its size by {name}, and the "
        "run shows the motion without one; give it the imperfection that is meant, such as a small load or deflection"
    ]


def _departures(runs: _Runs, result: Result, fine: int, steps: int) -> dict[str, float] | None:
    """What leaves the motion by a disturbance, seen by so many steps to rows that are so many times finer; None where such
    runs fail."""
    row, lasts = runs.output_step / fine, runs.how["end"] - runs.start
    try:
        still = runs.free_to_leave
        states = still, pushed(still, runs.start, lasts)
    except ComputationError:
        return None
    more = {"output_step": row, "outputs": places(still.system), "stopwatch": None, "events": ()}
    calls = [
        lambda say, one=one: replace(runs, assembled=one).run(Twin(row / steps), **more, progress=say) for one in states
    ]
    run, disturbed = runs.together(calls, leader=False)
    if any(isinstance(one, InputError) or _failed(one) for one in (run, disturbed)):  # of steps that are rounding, too
        return None
    size = max(body.model.size for body in runs.scene.bodies) or 1.0
    return departures(run, disturbed, size, float(result.time[-1]))


def _by_chance(told: StepError, size: float) -> StepError:
    """The error of an output that has grown from rounding to a size, zero for others."""
    return replace(told, error=max(told.error, size), of_range=max(told.of_range, 1.0)) if size > 0 else told


def _others(count: int) -> str:
    return "" if count < 1 else f" and of {count} other output{'s' if count > 1 else ''}"


# ---- the step for an accuracy ---------------------------------------------------------------------------------------


def _searched(runs: _Runs, within: Within, kept: dict[str, Any], count: int) -> Result:
    """The run with the longest step found that keeps the accuracy; where forces ring, of those that keep the positions."""
    trials, ringing, path = list[_Trial](), set[str](), kept["path"] or kept["resume"]
    while True:
        method = stepped(within, runs.output_step / count)
        try:
            trial, _ = _with_twin(runs, method, count, kept)
        except (ComputationError, InputError):
            if count >= FINEST:
                raise
            count *= FIRST
            continue
        if not trial.errors or count >= FINEST or _excess(trial, ringing, trials) <= within.accuracy:
            trial = _told(runs, trial, *runs.together(_further(runs, method, count, trials), leader=False))
        excess = _excess(trial, ringing, trials) / within.accuracy
        trials.append(trial)
        if excess <= 1.0 or count >= FINEST:
            return _finished(runs, trial, path, ringing)
        count, kept = _next(count, excess, _leap(method)), {**kept, "path": path, "resume": None}


def _leap(method: Integrator) -> int:
    return LEAP.get(method.order, 8)


def _next(count: int, excess: float, leap: int) -> int:
    """Steps to a row, an even number, at least twice as many."""
    wanted = count * float(np.clip((MARGIN * excess) ** 0.5, 2.0, leap))
    return min(FINEST, 2 * int(np.ceil(wanted / 2)))


def _excess(trial: _Trial, ringing: set[str], earlier: Sequence[_Trial]) -> float:
    """The largest error over range of what a trial is to keep; infinite where no error could be told. Outputs that ring, for
    which shorter steps have ceased to help, are added to those that do."""
    if not trial.errors:
        return np.inf
    for before in (one for one in earlier[-1:] if one.errors):
        driving = [name for name in trial.errors if DRIVING.search(name)]
        left = {name: trial.errors[name].error / max(before.errors[name].error, 1e-300) for name in driving}
        ringing |= {name for name in driving if left[name] > (trial.count / before.count) ** -SLOW}
        if ringing:
            vibrating = (name for name in driving if trial.errors[name].vibrates)
            ringing |= {name for name in vibrating if left[name] > (trial.count / before.count) ** -IN_COMPANY}
    wanted = (name for name in trial.errors if PLACES.search(name) or DRIVING.search(name))
    return max((trial.errors[name].of_range for name in wanted if name not in ringing), default=0.0)
