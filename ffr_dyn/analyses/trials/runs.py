"""What the runs of a forward analysis have in common, and how they go on side by side."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from ffr_dyn.analyses.integration import integrate
from ffr_dyn.analyses.trials.begin import Beginning, begun
from ffr_dyn.consistency.assemble import Assembled
from ffr_dyn.consistency.step_error import (
    untold_breaks,
)
from ffr_dyn.consistency.unresolved import Vibrations, vibrations
from ffr_dyn.functions.together import Say, together
from ffr_dyn.integrators import Integrator
from ffr_dyn.linear.departure import free_to_leave
from ffr_dyn.results.result import Result
from ffr_dyn.scene.force_kinds import forces_of
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.errors import ComputationError


@dataclass(frozen=True)
class Runs:
    """A scene and what all its runs have in common."""

    scene: Scene
    assembled: Assembled
    start: float
    output_step: float
    how: dict[str, Any]
    begin: Beginning
    work: list[int] = field(default_factory=list)  # evaluations of each
    whole: list[str | Path] = field(default_factory=list)  # files of those that have come to their end

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
    def order_unsure(self) -> bool:
        """Whether steps may lose the order of the method: with Python functions of the state; and where what damps bodies
        that bend holds light ends back faster than steps are, and soon after does not, as damped stops, dry friction and
        curves do."""
        uneven = any(force.damps_unevenly for force in forces_of(self.scene))
        return self.feels or (uneven and any(body.model.n for body in self.scene.bodies))

    @cached_property
    def untold(self) -> dict[str, list[float]]:
        """When [s] functions of time break without steps that end there, by what they are for."""
        count = round((self.how["end"] - self.start) / self.output_step)
        times, fast = np.linspace(self.start, self.how["end"], count + 1), self.how["fast"]
        return untold_breaks(self.assembled.system, times, () if fast is None else fast.jumps[:, 1].tolist())

    @cached_property
    def sudden(self) -> bool:
        """Whether forces may change within a step, however short: a run has an order beside about twice the step at most."""
        return bool(self.untold) or self.order_unsure or any(force.sudden for force in forces_of(self.scene))

    def run(self, method: Integrator, **more: Any) -> Result:
        """One run."""
        found = integrate(self.scene, method=method, assembled=self.assembled, **{**self.how, **more})
        self.work.append(found.attributes["evaluations"])
        if more.get("path") is not None:
            self.whole.append(more["path"])
        return found

    @contextmanager
    def saying_what_is_kept(self) -> Iterator[None]:
        """A note for who stops the runs that tell errors: the file holds the run itself."""
        try:
            yield
        except KeyboardInterrupt as end:
            if self.whole and not hasattr(end, "__notes__"):
                end.add_note(f"{self.whole[-1]} holds the run, without its errors, which were being found")
            raise

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
            found[number] = granted(outcome) if leader and number == 0 else outcome
        return [found[number] for number in range(len(calls))]


def granted(outcome: Any) -> Any:
    """The result of a call. Raises the exception that it raised."""
    if isinstance(outcome, BaseException):
        raise outcome
    return outcome


def has_failed(outcome: Any) -> bool:
    """Whether a run came to no end; another exception is raised."""
    return isinstance(outcome, ComputationError) or granted(outcome) is None
