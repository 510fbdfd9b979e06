"""How long the steps of a scene take, against the deadline of real time."""

from __future__ import annotations

import gc
import os
import time as clock
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ffr_dyn.integrators import Integrator
from ffr_dyn.integrators.stabilisation import Projection, Stabilisation
from ffr_dyn.realtime.stepper import Stepper
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.arrays import Array
from ffr_prep.common.brief import Brief
from ffr_prep.common.errors import InputError

SOFT = 0.999  # of the steps must be in time
WARMING = 100  # steps before the measurement: caches, branch prediction, first touch of memory
REPORTS = 50  # calls of `progress` in all


@dataclass(frozen=True, eq=False, repr=False)
class Timing(Brief):
    """Times of steps.

    seconds  : (N,) [s] of each: set inputs, step, outputs
    deadline : [s] that a step may take;  step : [s] of simulated time;  title, method : what was stepped

    >>> timing = fd.measure_steps(scene, fd.ROS2(1e-3), duration=10.0)
    """

    seconds: Array
    deadline: float
    step: float
    title: str
    method: str

    @property
    def mean(self) -> float:
        return float(self.seconds.mean())

    @property
    def worst(self) -> float:
        return float(self.seconds.max())

    def quantile(self, share: float) -> float:
        """[s] within which this share of the steps was done (the smallest such time that was measured)."""
        return float(np.quantile(self.seconds, share, method="inverted_cdf"))

    @property
    def late(self) -> int:
        """Steps that took longer than the deadline."""
        return int((self.seconds > self.deadline).sum())

    @property
    def holds_soft(self) -> bool:
        """Whether 99.9 % of the steps were in time."""
        return self.quantile(SOFT) <= self.deadline

    @property
    def holds_hard(self) -> bool:
        """Whether all steps that were measured were in time. It is no proof: an operating system promises nothing."""
        return self.late == 0


def measure_steps(
    scene: Scene,
    method: Integrator,
    *,
    duration: float = 60.0,
    deadline: float | None = None,
    outputs: tuple[str, ...] = ("*.position",),
    stabilisation: Stabilisation = Projection(),  # noqa: B008 - frozen
    paced: bool = False,
    progress: Callable[[float], None] | None = None,
) -> Timing:
    """Step a scene over `duration` [s] of simulated time, timing each step with its inputs and outputs.

    deadline : [s] by default the step
    paced    : start each step when the clock says so, as a controller would, with caches emptied by others. Otherwise steps
               follow each other at once

    Python's garbage collector stands still meanwhile. Raises InputError for times that are not positive, ComputationError
    where a step fails.

    >>> print(fd.measure_steps(scene, fd.ROS2(1e-3), duration=10.0, deadline=1e-3))
    """
    deadline = method.step if deadline is None else deadline
    count = _steps(duration, deadline, method)
    stepper = Stepper(scene, method, outputs=outputs, stabilisation=stabilisation)
    for _ in range(WARMING):
        _once(stepper, stepper.inputs)
    taken = np.zeros(count, dtype=np.int64)
    gc.collect()
    gc.freeze()
    gc.disable()
    try:
        _time(stepper, taken, round(1e9 * deadline) if paced else 0, progress)
    finally:
        gc.enable()
        gc.unfreeze()
    return Timing(1e-9 * taken, deadline, method.step, scene.name, f"{method!r}")


def _steps(duration: float, deadline: float, method: Integrator) -> int:
    if not (np.isfinite([duration, deadline]).all() and deadline > 0 and duration >= method.step):
        raise InputError(f"a duration of {duration} s and a deadline of {deadline} s: give a step's length at least")
    return round(duration / method.step)


def _once(stepper: Stepper, values: dict[str, float]) -> None:
    stepper.set_inputs(**values)
    stepper.step()
    stepper.outputs()


def _time(stepper: Stepper, taken: Array, period: int, progress: Callable[[float], None] | None) -> None:
    """Fill `taken` [ns]; each step begins `period` [ns] after the one before, or at once. Sleeping would wake up late."""
    values, now = stepper.inputs, clock.perf_counter_ns
    every = max(1, taken.size // REPORTS)
    due = now()
    for k in range(taken.size):
        if progress is not None and k % every == 0:
            progress(k * stepper.length)
            due = now()
        while now() < due:
            pass
        began = now()
        _once(stepper, values)
        taken[k] = now() - began
        due += period


# ---- reports ------------------------------------------------------------------------------------------------------


def lines(timing: Timing) -> list[str]:
    """The measured times, in words."""
    t = timing
    verdict = {True: "holds", False: "does not hold"}
    return [
        f"scene        {t.title}: {t.seconds.size} steps of {t.step:g} s, {t.method}",
        f"time a step  mean {_us(t.mean)}, 99.9 % {_us(t.quantile(SOFT))}, worst {_us(t.worst)}; deadline {_us(t.deadline)}",
        f"faster       than real time by {t.step / t.mean:.1f} on average",
        f"soft         real time {verdict[t.holds_soft]} (99.9 % of the steps in time)",
        f"hard         real time {verdict[t.holds_hard]} in this measurement ({t.late} of {t.seconds.size} steps late)",
    ]


def _us(seconds: float) -> str:
    return f"{1e6 * seconds:.1f} us"


def as_json(timing: Timing) -> dict[str, Any]:
    """The same for programs; times in seconds."""
    shares = (0.5, 0.9, 0.99, SOFT, 0.9999)
    return {
        "title": timing.title,
        "method": timing.method,
        "step": timing.step,
        "steps": timing.seconds.size,
        "deadline": timing.deadline,
        "mean": timing.mean,
        "quantiles": {f"{share:g}": timing.quantile(share) for share in shares},
        "worst": timing.worst,
        "late": timing.late,
        "soft": timing.holds_soft,
        "hard": timing.holds_hard,
        "processors": os.cpu_count(),
    }


def plot_times(timing: Timing, path: str | Path) -> Path:
    """A histogram of the times on logarithmic axes, with mean, 99.9 % and deadline, as .png, .svg or .pdf."""
    from ffr_dyn.pictures.histories import PALETTE, drawing, plain

    marks = {"mean": timing.mean, "99.9 %": timing.quantile(SOFT), "worst": timing.worst, "deadline": timing.deadline}
    first, last = float(np.log10(0.9 * timing.seconds.min())), float(np.log10(1.1 * max(marks.values())))
    with drawing(path, (10.0, 4.5)) as figure:
        axes = figure.subplots()
        axes.hist(1e6 * timing.seconds, bins=list(1e6 * np.logspace(first, last, 120)), color=PALETTE[5], log=True)
        for k, (name, at) in enumerate(marks.items()):
            axes.axvline(1e6 * at, color=PALETTE[(6, 2, 3, 1)[k]], label=f"{name}: {1e6 * at:.1f} µs", lw=1.8)
        axes.set_xscale("log")
        axes.set_xlabel("time of a step [µs]")
        axes.set_ylabel("steps")
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.03))
        axes.set_title(plain(f"{timing.title}: {timing.seconds.size} steps of {timing.step:g} s, {timing.method}"))
    return Path(path)
