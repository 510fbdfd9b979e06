"""Periodic motions: the turn of a driven machine that repeats itself, and Floquet's multipliers about it.

How it is found, `ffr_dyn.linear.turn_map` says.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from ffr_dyn.analyses.integration import with_all_reactions
from ffr_dyn.analyses.outcome import needed, result_of, with_quantities
from ffr_dyn.analyses.registry import OfMoment, option
from ffr_dyn.analyses.settings import MomentSettings
from ffr_dyn.compile.scene_tables import System
from ffr_dyn.consistency.assemble import Assembled, assemble
from ffr_dyn.consistency.doubts import checked
from ffr_dyn.consistency.evaluation import evaluate, evaluator, joined, record_states
from ffr_dyn.consistency.following import sudden
from ffr_dyn.consistency.step_error import OVER_BREAKS, PARTLY_STIFF, Beside, step_errors, untold_breaks, worst
from ffr_dyn.consistency.tangent import sizes_of
from ffr_dyn.equations.constraint_rows import drive_of
from ffr_dyn.equations.layout import moved, to_global_axes
from ffr_dyn.integrators import ROS3, Integrator
from ffr_dyn.kernels.tables import Record
from ffr_dyn.linear.returning import Returned, at_other_steps, returned
from ffr_dyn.linear.turn_map import Turns, floquet_modes, floquet_shape, period_of, turns, turns_about
from ffr_dyn.linear.turning_on import turning_on
from ffr_dyn.linear.words import in_words
from ffr_dyn.results.quantities import selected
from ffr_dyn.results.result import Result
from ffr_dyn.scene.described import described
from ffr_dyn.scene.joints import DRIVEN_ANGLE
from ffr_dyn.scene.scene import Scene, require_scene
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError, InputError

STEPS = 4000  # to a period, where no method is given
FAR = 0.5  # of a multiplier, that other steps change it by: beyond it the change is told
GONE = 1e-4  # of a multiplier: below it differences of a period tell nothing of the shape
SHOWN = 12  # modes that a command prints
UNKNOWN = "the error of the steps is not known: others bring nothing back; give smaller ones (step, --step)"
LOOKS, REPEATS = 257, 1e-4  # at a driven motion over a period, and of its range: what it may be off a period later
CYCLES = 10  # periods that a film of one shows, at most


@dataclass(frozen=True)
class Periodic(OfMoment):
    """A period of the motion that repeats itself, as of a machine driven evenly, and whether it is stable.

    >>> result = fd.run(scene, fd.MomentSettings(analysis=fd.Periodic(period=0.02)))
    """

    example: ClassVar[str] = "ffr-dyn periodic engine.toml --floquet -o out/turn.nc"
    period: float = field(default=0.0, metadata=option("--period", "[s]; default: a turn of the driver."))
    step: float = field(
        default=0.0, metadata=option("--step", "[s] of ros3; default: a four-thousandth of the period.")
    )
    floquet: bool = field(
        default=False, metadata=option("--floquet/--no-floquet", "Also Floquet's multipliers: takes many periods.")
    )
    check: bool = field(
        default=True, metadata=option("--check/--no-check", "Tell the error that the length of the steps makes.")
    )
    film: str = field(
        default="", metadata=option("--film", "Film of a Floquet mode, .html, .gif or .mp4.", metavar="FILE")
    )
    mode: int = field(
        default=1, metadata=option("--mode", "Which mode the film shows, by its line in what --floquet prints.")
    )

    def perform(self, scene: Scene, settings: MomentSettings, **how: Any) -> Result:
        method = ROS3(self.step) if self.step else None
        period = self.period or None
        if self.film:
            from ffr_dyn.pictures.animate import animate

            motion = floquet_motion(scene, self.mode - 1, period=period, method=method, time=settings.time)
            animate(motion, self.film)
        return periodic(
            scene, period=period, method=method, floquet=self.floquet, check=self.check, **settings.span, **how
        )

    def report(self, result: Result) -> list[str]:
        a = result.attributes
        lines = [*super().report(result), f"period       {a['period']:.9g} s"]
        return lines + (floquet_lines(a) if "multipliers" in a else [])


def periodic(
    scene: Scene,
    *,
    period: float | None = None,
    method: Integrator | None = None,
    floquet: bool = False,
    check: bool = True,
    time: float = 0.0,
    outputs: Sequence[str] = ("default",),
    path: str | Path | None = None,
) -> Result:
    """A period of the motion that repeats itself, from `time` [s] on, in a hundred rows and one.

    period  : [s]; by default a turn of the driver that turns evenly
    method  : with its step, which is shortened to a part of the period; by default ROS3 with a four-thousandth of it
    floquet : also Floquet's multipliers, at the cost of four periods for every state variable
    check   : also find it with steps twice as long, which tells the error of every output, for about one period more
    outputs : names or patterns of the quantities to keep, as in `forward`

    The attributes have the `period`, the `step`, `periods` (how many were computed, with fewer steps as parts of one) and
    `returns` (by how much the end is off the beginning, relative). With floquet there are also `multipliers` (pairs of real
    and imaginary parts, the largest first) and `exponents` (growth [1/s] and circular frequency [rad/s] of each). Then
    `leading` has what moves in each, as of `linearise`, and `stable` whether none grows. With check, "errors" has [error in
    its unit, error over range] of every output, "accuracy" the worst in words, and "multiplier_errors" those of multipliers.

        turn = fd.periodic(engine)
        turn["main_bearing.force"]

    Raises InputError where the period is not known; ComputationError where no such motion is found.

    >>> result = fd.periodic(scene, period=0.02)
    """
    require_scene(scene)
    assembled = assemble(scene, time=time)
    selected(assembled.system, needed(scene, outputs))
    of, found = _found(assembled, time, method, period)
    record = _record(assembled, of, found)
    says = described(scene)  # mass and length, too, by which errors tell what is small
    result = result_of(assembled.system, record, says, None, outputs)
    told = _errors(assembled, (of, found), result, outputs, floquet) if check else {}
    attributes = {
        **says,
        "analysis": "periodic motion",
        "method": f"{'Newton' if found.newton else 'Anderson'}'s method on turns of {type(of.method).__name__}, step "
        f"{of.method.step:.6g} s, {found.periods:.3g} periods",
        "period": of.period,
        "step": of.method.step,
        "periods": found.periods,
        "returns": found.error,
        "degrees_of_freedom": assembled.degrees_of_freedom,
        "computed": assembled.computed,
        **(_multipliers(of, found) if floquet else {}),
        **told,
        "notes": [*assembled.notes, *_doubts(assembled, of, record), *([UNKNOWN] if check and not told else [])],
        "status": "complete",
    }
    return with_quantities(replace(result, attributes=attributes), {}, path)


def _errors(
    assembled: Assembled, turn: tuple[Turns, Returned], result: Result, outputs: Sequence[str], floquet: bool
) -> dict[str, Any]:
    """The attributes that tell the error of the steps; none where other steps bring nothing back."""
    (of, found), system = turn, assembled.system
    try:
        other, again = at_other_steps(of, found)
    except ComputationError:
        return {}
    ratio, order = of.steps / other.steps, PARTLY_STIFF if isinstance(of.method, ROS3) else of.method.order
    found_before = of.fast.jumps[:, 1].tolist() if of.fast else ()
    if untold_breaks(system, result.time, found_before):
        order = OVER_BREAKS if isinstance(of.method, ROS3) else 1
    beside = Beside(result_of(system, _record(assembled, of, again), {}, None, outputs), ratio)
    errors = step_errors(result, beside, order)
    attributes: dict[str, Any] = {
        "errors": {name: [e.error, e.of_range] for name, e in errors.items()},
        "accuracy": worst(errors),
        "periods": found.periods + again.periods / ratio,
    }
    if floquet:
        one, two = (floquet_modes(turns_about(of, t.x, t.v)).multipliers for of, t in (turn, (other, again)))
        apart = np.abs(one[:, None] - two).min(axis=1, initial=np.inf)
        far = apart > FAR * np.abs(one)  # steps that damp a mode to nothing have no order yet
        attributes["multiplier_errors"] = np.where(far, apart, apart / abs(ratio**order - 1)).tolist()
    return attributes


def _doubts(assembled: Assembled, of: Turns, record: Record) -> list[str]:
    """Notes on functions of time within steps, and on the rows of a period."""
    words, breaks = (of.fast.words, of.fast.breaks) if of.fast else ((), np.zeros(0))
    at_once = sudden(of.system, breaks, of.near.time, of.near.time + of.period)
    return [*words, *checked("static", assembled, record), *at_once]


def _record(assembled: Assembled, of: Turns, found: Returned) -> Record:
    """The rows of the period, with that at its beginning."""
    first = record_states(of.near.at, np.array([of.near.time]), found.x[None], found.v[None])
    return with_all_reactions(assembled, joined([first, found.record]))


def floquet_motion(
    scene: Scene,
    number: int = 0,
    *,
    period: float | None = None,
    method: Integrator | None = None,
    time: float = 0.0,
    size: float = 0.05,
) -> Result:
    """A Floquet mode about the periodic motion of a scene, as a result that can be animated: the motion with the mode on
    top, y = exp(i w t) p(t) without its growth or decay, over as many periods as a vibration takes, ten at most.

    number : of the mode, from 0, one of each conjugate pair, as `ffr-dyn periodic --floquet` prints them;  period, method,
             time : as of `periodic`;  size : of the largest movement [rad, or of the scene's size]

    Raises InputError for a number that there is not, and as `periodic` does.

    >>> fd.animate(fd.floquet_motion(scene, 0), "mode.html")
    """
    assembled = assemble(scene, time=time)
    of, found = _found(assembled, time, method, period)
    of = turns_about(of, found.x, found.v)
    modes = floquet_modes(of)
    numbers = np.flatnonzero(modes.exponents.imag >= 0)
    if not 0 <= number < numbers.size:
        raise InputError(f"mode {number + 1}: the Floquet modes that are told are 1 to {numbers.size}")
    m, rows = int(numbers[number]), len(found.record.x)
    shape, rate = floquet_shape(of, modes, m, rows), float(modes.exponents[m].imag)
    shape = shape * (size / np.abs(shape / sizes_of(of.system)).max())
    count = int(np.clip(np.ceil(2 * np.pi / (rate * of.period)), 1, CYCLES)) if rate else 1
    times = of.period / rows * np.arange(1, count * rows + 1)
    place, again = of.system.layout, np.arange(count * rows) % rows
    turning = (shape[again] * np.exp(1j * rate * times)[:, None]).real
    x = np.array([moved(place, found.record.x[k], y) for k, y in zip(again, turning, strict=True)])
    record = record_states(evaluator(of.system), time + times, x, found.record.v[again])
    growth, frequency = modes.exponents[m].real, rate / (2 * np.pi)
    attributes = {
        "title": f"{frequency:.5g} Hz, growth {growth:.3g} 1/s", "analysis": "Floquet mode", "notes": [], "status": "complete"
    }  # fmt: skip
    return result_of(of.system, record, attributes)


def periodically(assembled: Assembled, time: float, method: Integrator | None) -> Assembled:
    """The scene in its periodic motion at `time` [s], for a run that begins in it. Raises as `periodic`."""
    _, found = _found(assembled, time, method, None)
    said = (*assembled.notes, f"starts in its periodic motion, found in {found.periods:.3g} periods")
    return replace(assembled, x=found.x, v=found.v, notes=said)


def _found(
    assembled: Assembled, time: float, method: Integrator | None, period: float | None
) -> tuple[Turns, Returned]:
    """The map over a period, and the periodic state."""
    if period is not None and not 0 < period < np.inf:
        raise InputError(f"the period is {period} s; it must be positive and finite")
    length = period_of(assembled.system.scene, time) if period is None else period
    chosen = method if method is not None and not method.controlled else ROS3(length / STEPS)
    _check_drivers(assembled.system, time, length)
    of = turns(assembled.system, time, assembled.x, assembled.v, chosen, length)
    try:
        return of, returned(of)
    except ComputationError:
        _check_driven(of)
        raise


def _check_driven(of: Turns) -> None:
    """ComputationError for a body that begins to turn by more than half a turn in a period and that no driver holds."""
    place, V = of.system.layout, of.near.V
    jacobian = evaluate(of.near.at, of.near.time, of.near.x, to_global_axes(place, of.near.x, V)).jacobian
    motions = turning_on(of.system, jacobian, V, of.sizes, together=False)
    for b, body in enumerate(of.system.scene.bodies):
        turning = place.omega(b)
        if motions[turning].any() and np.linalg.norm(V[turning]) * of.period > np.pi:
            raise ComputationError(
                f"no motion of period {of.period:.6g} s was found: body {body.name!r} turns freely, and what brakes or "
                "drives it changes its speed, which no driver sets; drive it evenly, as by a body on its axis that a driver "
                "turns, and a bushing between both that is stiff about the axis alone; `steady` and `campbell` take it as "
                "it is"
            )


def _check_drivers(system: System, time: float, period: float) -> None:
    """ComputationError for a driven motion that is another one in the second period [s], but for whole turns.

    Where nothing is free besides, there is no state to tell it.
    """
    times = time + period * np.linspace(0.0, 1.0, LOOKS)
    said = [(block, word) for block in system.blocks for word in block.words if word.function is not None]
    for block, word in said:
        try:
            first, second = (np.array([drive_of(word, float(t))[0] for t in times + later]) for later in (0.0, period))
        except Exception:  # of a Python function, which the first period tells
            continue
        turn = 2 * np.pi if word.kind == DRIVEN_ANGLE else np.inf
        apart = np.abs(second - first - (turn * round((second[0] - first[0]) / turn) if turn < np.inf else 0.0))
        if apart.max() > REPEATS * max(np.ptp(first), np.ptp(second)):
            raise ComputationError(
                f"{'driver' if block.driver else 'joint'} {block.name!r} does not come back after {period:.6g} s: what it "
                f"prescribes in the second period is up to {apart.max():.3g} off; give a period in which drivers and loads "
                "all come back"
            )


def _multipliers(of: Turns, turn: Returned) -> dict[str, Any]:
    """Floquet's multipliers about a periodic state, the largest first, with their exponents and what moves."""
    again = turns_about(of, turn.x, turn.v)
    found = floquet_modes(again)
    scene, place = of.system.scene, of.system.layout
    names = in_words(scene, place, turn.x, again.near.M, found.shapes, found.rates, [""] * found.multipliers.size)
    told = zip(names, np.abs(found.multipliers) > GONE, strict=True)
    return {
        "multipliers": _pairs(found.multipliers),
        "exponents": _pairs(found.exponents),
        "leading": [name if lasts else "gone after a period" for name, lasts in told],
        "stable": int(np.abs(found.multipliers).max(initial=0.0) <= 1 + 1e-6),
    }


def _pairs(values: Array) -> list[list[float]]:
    return [[float(value.real), float(value.imag)] for value in values]


def floquet_lines(attributes: Mapping[str, Any]) -> list[str]:
    """A line for each of the first dozen Floquet modes, one of each conjugate pair."""
    lines = []
    errors = attributes.get("multiplier_errors")
    offs = [f", within {error:.2g}" for error in errors] if errors else [""] * len(attributes["multipliers"])
    both = zip(attributes["multipliers"], attributes["exponents"], offs, attributes["leading"], strict=True)
    for (re, im), (growth, rate), off, name in both:
        if rate >= 0:
            frequency = f"{rate / (2 * np.pi):12.6g} Hz   growth {growth:11.4g} 1/s   "
            lines.append(f"{frequency}multiplier {re:.6g} {im:+.6g}i{off}   {name}")
    more = [f"... and {len(lines) - SHOWN} more in the file"] if len(lines) > SHOWN else []
    return lines[:SHOWN] + more
