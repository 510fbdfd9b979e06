"""Harmonic response with all that is nonlinear: periodic motions under a harmonic input, followed over its frequency."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np

from ffr_dyn.analyses.efforts import Effort
from ffr_dyn.analyses.integration import with_reactions_of
from ffr_dyn.analyses.linearise import of_outputs, quantities_of
from ffr_dyn.analyses.registry import OfMoment, option
from ffr_dyn.analyses.rotating.inputs import Acting, absolute_order, acting, components, excited, told
from ffr_dyn.analyses.rotating.response import about_state, band_in_words
from ffr_dyn.analyses.settings import MomentSettings
from ffr_dyn.compile.scene_tables import given_at
from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.consistency.evaluation import evaluator
from ffr_dyn.consistency.held_frequencies import in_a_band
from ffr_dyn.functions.time_functions import harmonic
from ffr_dyn.integrators import ROS3
from ffr_dyn.linear.continuation import Solution, branch, folds
from ffr_dyn.linear.forced_turns import MARK, Wave, begun, over_amplitude, over_frequency, period, wave
from ffr_dyn.linear.returning import returned
from ffr_dyn.linear.turn_map import turns
from ffr_dyn.results.file import save_result
from ffr_dyn.results.result import Axis, Quantity, Result
from ffr_dyn.scene.described import described
from ffr_dyn.scene.scene import Scene, require_scene
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.common.units import listed_units, pretty, unit_of_label

About = Literal["start", "equilibrium"]
STEPS, ROWS = 400, 80  # of a period
HARMONICS = 5
GROWS = 1e-4  # of a multiplier beyond one: what differences leave
LOOKS, STEADY = 257, 1e-9  # at functions of time, over two periods; of their size: what is no change


@dataclass(frozen=True)
class Forced(OfMoment):
    """Amplitudes under a harmonic input of a given size, stable and unstable, where they jump, and their harmonics.

    >>> analysis = fd.Forced(input="hinge.moment", amplitude=3.0, quantities=("arm.tip.position.y",), band="1..50")
    """

    keeps: ClassVar[bool] = False
    example: ClassVar[str] = (
        "ffr-dyn forced arm.toml --input hinge.moment --amplitude 3 --output arm.tip.position.y --band 1..50 "
        "--picture out/arm.png"
    )
    input: str = field(
        default="",
        metadata=option(
            "--input", "joint.moment, body.point.force.x, driver.angle, base.x, base.x.displacement, or a load.",
            metavar="NAME", required=True,
        ),
    )  # fmt: skip
    amplitude: float = field(
        default=0.0, metadata=option("--amplitude", "Of the input, in its unit [N, N m, m or rad].", required=True)
    )
    quantities: tuple[str, ...] = field(
        default=(), metadata=option("--output", "Quantity, such as rod.tip.position; repeat.", required=True)
    )
    band: str = field(
        default="", metadata=option("--band", "Frequencies [Hz], such as 1..50.", metavar="LOW..HIGH", required=True)
    )
    down: bool = field(
        default=False, metadata=option("--down/--up", "Follow from the highest frequency, or the lowest.")
    )
    steps: int = field(default=STEPS, metadata=option("--steps", "Time steps of a period."))
    about: About = field(
        default="start",
        metadata=option("--start/--equilibrium", "Vibrates about the start. | Vibrates about the equilibrium."),
    )
    picture: str = field(default="", metadata=option("--picture", "Draw amplitudes.", metavar="FILE"))

    def perform(self, scene: Scene, settings: MomentSettings, **how: Any) -> Result:
        if self.picture:
            from ffr_dyn.pictures.histories import check_picture

            check_picture(self.picture)
        found = forced(
            scene, input=self.input, amplitude=self.amplitude, outputs=self.quantities, band_of=_band(self.band, self.down),
            steps=self.steps, about=self.about, path=how["path"],
        )  # fmt: skip
        if self.picture:
            from ffr_dyn.pictures.forced import draw_forced

            draw_forced(found, self.picture)
        return found

    def report(self, result: Result) -> list[str]:
        return forced_lines(result)


def _band(text: str, down: bool) -> tuple[float, float]:
    band = band_in_words(text)
    if band is None:
        raise InputError("forced needs the frequencies to follow: add --band LOW..HIGH in Hz, such as --band 1..50")
    return (band[1], band[0]) if down else band


def forced(
    scene: Scene,
    *,
    input: str | Effort,
    amplitude: float,
    outputs: Sequence[str],
    band_of: tuple[float, float],
    steps: int = STEPS,
    harmonics: int = HARMONICS,
    about: About = "start",
    path: str | Path | None = None,
) -> Result:
    """The vibration of a scene under a harmonic input of a given amplitude, over its frequency, with all that is nonlinear.

    input     : as of `response`: an effort or, in words, "joint.moment", "body.point.force.x", "driver.angle", "base.x" and
                "base.x.displacement"; of a load its share
    amplitude : of the input, in its unit;  outputs : quantities or components
    band_of   : [Hz] where to begin and where to end, upwards or downwards
    steps     : of a period, by ROS3;  harmonics : that are told;  about : the scene's "start" or its "equilibrium"

    A row is a periodic motion; where the branch turns back, rows of one frequency are several. The result has `frequency`
    [Hz] and of each output `amplitude` (half of what it covers), `mean`, `harmonics` (of each multiple of the frequency) and
    `phase` [deg] of the first against the input; `growth`, the largest of Floquet's multipliers, and `stable`. Attributes:
    `jumps`, frequencies [Hz] where the branch turns back and a machine jumps to another, and `losses`, where it becomes
    unstable or stable otherwise.

    Raises InputError for inputs, outputs and bands that cannot be; ComputationError where no such motion is found.

    >>> found = fd.forced(scene, input="hinge.moment", amplitude=3.0, outputs=["arm.tip.position.y"], band_of=(1, 50))
    """
    require_scene(scene)
    _check(amplitude, band_of, steps, harmonics, about)
    at = about_state(scene, about, 0.0)
    acts = acting(at, input, 0.0)
    units = components(at, outputs, 0.0, "forced")
    names = tuple(units)
    _check_constant(at, 2 / min(band_of))
    of, notes = _wave(at, acts, amplitude, steps, band_of)
    still = returned(of.at(band_of[0], 0.0))
    *_, first = branch(over_amplitude(of, band_of[0]), begun(of, still.x, still.v))
    found = list(branch(over_frequency(of, *band_of), first.u))
    motions = [_motion(of, acts, one, names) for one in found]
    said = {**told(acts, input, units, names), "input_amplitude": amplitude}
    notes = (*notes, *in_a_band(scene, max(band_of)))
    result = _as_result(scene, found, np.array(motions), names, harmonics, said, notes)
    if path is not None:
        save_result(result, path)
    return result


def _check(amplitude: float, band: tuple[float, float], steps: int, harmonics: int, about: str) -> None:
    if not 0 < amplitude < np.inf:
        raise InputError(f"the amplitude is {amplitude}; it must be positive, in the unit of the input")
    if len(band) != 2 or not (0 < min(band) < max(band) < np.inf):
        raise InputError(f"the band is {band}; give the frequencies [Hz] where to begin and to end, such as (1, 50)")
    if steps < ROWS or not 1 <= harmonics <= ROWS // 4:
        raise InputError(
            f"{steps} steps and {harmonics} harmonics; give {ROWS} steps or more, and 1 to {ROWS // 4} harmonics"
        )
    if about not in ("start", "equilibrium"):
        raise InputError(f"about is {about!r}; forced vibrates about the 'start' or the 'equilibrium'")


def _check_constant(scene: Scene, lasts: float) -> None:
    """InputError for a function of time that changes within some seconds, and so does not come back at every frequency."""
    assembled, times = assemble(scene), np.linspace(0.0, lasts, LOOKS)
    try:
        first, *later = (given_at(assembled.system, t, assembled.x, assembled.v) for t in times)
    except Exception:  # of a Python function, which the first period tells
        return
    for what, given in first.items():
        of = np.array([given, *(one[what] for one in later)])
        if (np.ptp(of, axis=0) > STEADY * np.abs(of).max(axis=0)).any():
            raise InputError(
                f"{what} changes with time by itself, which does not come back at every frequency of the input; make it "
                "constant for forced, or take `periodic` at one frequency, or `forward`; of a machine that turns evenly, "
                "under an input that is small, `response` about its steady motion"
            )


def _wave(
    scene: Scene, acts: Acting, amplitude: float, steps: int, band: tuple[float, float]
) -> tuple[Wave, tuple[str, ...]]:
    """The input in the compiled scene; notes of its assembly. A velocity or displacement of the base, a sine, acts by its
    rate or second derivative."""
    power = 0 if acts.order is None or acts.driver else 2 - acts.order
    if acts.driver and acts.order:
        raise InputError("a rate of a driver is no input of forced; give its motion, such as motor.angle")
    phase = power * np.pi / 2
    assembled = assemble(excited(scene, acts, harmonic(amplitude=amplitude, frequency=MARK, phase=phase)))
    period = 1 / MARK
    of = turns(assembled.system, 0.0, assembled.x, assembled.v, ROS3(period / steps), period)
    whole = None if assembled.all_rows is None else evaluator(assembled.all_rows)
    of = replace(of, near=replace(of.near, all_rows=whole), steps=-(-steps // ROWS) * ROWS, rows=ROWS)
    return wave(of, amplitude, power, float(np.sqrt(band[0] * band[1]))), assembled.notes


def _motion(of: Wave, acts: Acting, at: Solution, names: Sequence[str]) -> Array:
    """(T, O) the outputs after every step of a period, among which those they cover are found, with what the base adds to
    those that are absolute."""
    turning, record = period(of, at.u, float(np.exp(at.p)), of.of.steps)
    if turning.near.all_rows is not None:
        record = with_reactions_of(turning.near.all_rows.engine, turning.system, record)
    wanted = quantities_of(turning.near, tuple(names))
    result = of_outputs(turning.system, record, wanted, names)
    values = np.stack([result[name] for name in names], axis=1)
    phase = 2j * np.pi * np.arange(1, of.of.steps + 1) / of.of.steps
    for k, name in enumerate(names):
        if (order := absolute_order(acts.effort, name)) is not None and (acts.order is not None or order == 2):
            rate = (2j * np.pi / turning.period) ** (order - (2 if acts.order is None else acts.order))
            values[:, k] += of.amplitude * (rate * np.exp(phase)).imag
    return values


def _as_result(
    scene: Scene, found: list[Solution], motions: Array, names: Sequence[str], harmonics: int, said: dict[str, Any],
    notes: Sequence[str],
) -> Result:  # fmt: skip
    frequency = np.exp(np.array([one.p for one in found]))
    growth = np.array([_growth(one) for one in found])
    rows = motions.shape[1]  # which begin a step after the period
    spectrum = np.fft.fft(motions, axis=1)[:, 1 : harmonics + 1] * 2 / rows
    spectrum = spectrum * np.exp(-2j * np.pi * np.arange(1, harmonics + 1) / rows)[:, None]
    of, orders = Axis("of", tuple(name.replace(".", " ") for name in names)), Axis("order", _numbers(harmonics))
    first, unit = np.degrees(np.unwrap(np.angle(1j * spectrum[:, 0]), axis=0)), listed_units(said["output_units"])
    quantities = {
        "frequency": Quantity(frequency, "Hz", (), "of the input"),
        "amplitude": Quantity(0.5 * np.ptp(motions, axis=1), unit, (of,), "half of what the output covers"),
        "mean": Quantity(motions.mean(axis=1), unit, (of,), "of the output over a period"),
        "harmonics": Quantity(np.abs(spectrum).transpose(0, 2, 1), unit, (of, orders), "amplitudes of multiples"),
        "phase": Quantity(first, "deg", (of,), "of the first harmonic, against the input"),
        "growth": Quantity(growth, "1", (), "largest of Floquet's multipliers"),
        "stable": Quantity((growth <= 1 + GROWS).astype(float), "1", (), "1 where small deviations do not grow"),
    }
    arc = np.concatenate([[0.0], np.cumsum([_apart(a, b, found) for a, b in pairwise(found)])])
    jumps = [float(np.exp(p)) for _, p in folds(np.log(frequency), arc)]
    attributes = {
        **described(scene),
        "analysis": "forced vibration",
        "method": "periodic motions, followed by pseudo-arclength",
        **said,
        "outputs": list(names),
        "jumps": jumps,
        "losses": _losses(frequency, growth, folds(np.log(frequency), arc)),
        "notes": list(notes),
        "status": "complete",
    }
    return Result(np.zeros(frequency.size), quantities, {}, attributes)


def _numbers(count: int) -> tuple[str, ...]:
    return tuple(str(k + 1) for k in range(count))


def _growth(at: Solution) -> float:
    n = at.u.size
    return float(np.abs(np.linalg.eigvals(at.J[:, :n] + np.eye(n))).max(initial=0.0))


def _apart(one: Solution, other: Solution, of: Sequence[Solution]) -> float:
    """How far a solution is from the next, in the largest of all and the range of the frequencies."""
    largest = max(float(np.abs(at.u).max(initial=0.0)) for at in of) or 1.0
    return float(np.hypot(np.linalg.norm(one.u - other.u) / largest, (one.p - other.p) / (of[-1].p - of[0].p)))


def _losses(frequency: Array, growth: Array, turns: Sequence[tuple[int, float]]) -> list[float]:
    """[Hz] where a branch becomes unstable or stable, but not where it turns back."""
    changes = np.flatnonzero(np.diff((growth > 1 + GROWS).astype(int)))
    return [
        float(0.5 * (frequency[k] + frequency[k + 1]))
        for k in changes
        if all(min(abs(k - at), abs(k + 1 - at)) > 1 for at, _ in turns)
    ]


def forced_lines(result: Result) -> list[str]:
    """The report of the command: the branch, the maximum of every output, jumps, losses of stability."""
    a, f = result.attributes, result["frequency"]
    lines = [
        f"input        {a['input']}, amplitude {a['input_amplitude']:g}; {f.size} motions from {f[0]:.5g} to {f[-1]:.5g} Hz"
    ]
    for k, name in enumerate(a["outputs"]):
        amplitude = result["amplitude"][:, k]
        top = int(np.argmax(amplitude))
        shares = result["harmonics"][top, k] / max(float(amplitude[top]), 1e-300)
        higher = ", ".join(f"{100 * share:.3g} %" for share in shares[1:])
        most = f"{amplitude[top]:.6g} {pretty(unit_of_label(result.quantity('amplitude').unit, k))}".rstrip()
        lines.append(f"output       {name}: at most {most} at {f[top]:.6g} Hz; higher harmonics {higher}")
    lines += [f"jump         at {one:.6g} Hz" for one in a["jumps"]]
    lines += [f"stability    changes at {one:.6g} Hz" for one in a["losses"]]
    return lines + [f"note         {note}" for note in a["notes"]]
