"""Forward dynamics: all forces known, the motion wanted, with what the length of the steps costs every output.

A run is followed by others that tell its error (`ffr_dyn.consistency.step_error`), and where no step is given the one is
looked for that is short enough.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

from ffr_dyn.analyses.events import Event
from ffr_dyn.analyses.integration import check_method, check_output_step, fast_within
from ffr_dyn.analyses.registry import OverTime, option
from ffr_dyn.analyses.settings import Settings
from ffr_dyn.analyses.trials.begin import Beginning, begun
from ffr_dyn.analyses.trials.errors import Trial, checked, cost_of_errors
from ffr_dyn.analyses.trials.notes import finished
from ffr_dyn.analyses.trials.runs import Runs
from ffr_dyn.analyses.trials.search import FIRST, searched
from ffr_dyn.compile.divided_steps import Fast, fast_of
from ffr_dyn.compile.scene_tables import System
from ffr_dyn.consistency.assemble import Assembled, assemble
from ffr_dyn.functions.stopwatch import Stopwatch
from ffr_dyn.integrators import Integrator, Within
from ffr_dyn.integrators.stabilisation import Projection, Stabilisation
from ffr_dyn.results.result import Result
from ffr_dyn.scene.checks import several
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.errors import InputError

# Of the accuracy [m, -], that constraints are closed to: 1e-9 m moved forces by up to 1e-3 of their range.
PROJECTED = 1e-8
QUICK = 1e7  # microseconds of the further runs, by `cost_of_errors`, up to which they are made unasked


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
    runs, kept = Runs(scene, assembled, start, output_step, common, begin), {"path": path, "resume": resume}
    with runs.saying_what_is_kept():
        return _with_errors(runs, wanted, kept, check)


def end_by_events(scene: Scene, events: Sequence[Event], *, end: float, output_step: float, **how: Any) -> float:
    """Time [s] of the last row that a run has before an event ends it, up to which runs can be compared; `end` where none
    ends it. how : as of `forward`.

    Raises InputError where that leaves fewer than two output steps.
    """
    if not any(event.stop for event in events):
        return end
    last, start = forward(scene, events=events, end=end, output_step=output_step, **how).time[-1], how.get("start", 0.0)
    rows = int((last - start) / output_step * (1.0 + 1e-12))
    if rows < 2:
        raise InputError(f"an event ends the run at {last:g} s, within two output rows; take a shorter output_step")
    return float(start + rows * output_step)


def _with_errors(runs: Runs, method: Integrator | Within, kept: dict[str, Any], check: bool | None) -> Result:
    """The run, and what tells its errors where that is wanted."""
    if isinstance(method, Within):
        return searched(runs, method, kept)
    count = 0 if method.controlled else round(runs.output_step / method.step)
    told = checked(runs, method, count, kept) if check else Trial(method, count, runs.run(method, **kept))
    if check is None and cost_of_errors(runs.assembled, told.result) < QUICK:
        told = checked(runs, method, count, kept, told.result)
    return finished(runs, told, kept["resume"] if kept["path"] is None else kept["path"])


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
