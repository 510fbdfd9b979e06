"""Frequency response of a linearised scene: from an input to outputs, mode by mode, and the response to noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np

from ffr_dyn.analyses.efforts import Effort
from ffr_dyn.analyses.linearise import Linearisation, linearised
from ffr_dyn.analyses.registry import OfMoment, option
from ffr_dyn.analyses.rotating.inputs import Acting, absolute_order, acting, allowed, components, told
from ffr_dyn.analyses.rotating.seen_from_ground import Sides, beside, outputs_over_turn, poles, seen_from_ground
from ffr_dyn.analyses.rotating.steady import steady
from ffr_dyn.analyses.rotating.without_bound import grows, notes_of_gains, notes_of_growth, under_noise
from ffr_dyn.analyses.settings import MomentSettings
from ffr_dyn.analyses.states import scene_at
from ffr_dyn.analyses.static import static
from ffr_dyn.consistency.held_frequencies import in_a_band
from ffr_dyn.linear.prescribed import prescribed
from ffr_dyn.linear.transfer import Transfer, band, mean_square, transfer
from ffr_dyn.results.file import save_result
from ffr_dyn.results.result import Axis, Quantity, Result
from ffr_dyn.scene.described import described
from ffr_dyn.scene.scene import Scene, require_scene
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.common.units import listed_units, pretty, quotient, square, unit_of_label

About = Literal["start", "equilibrium", "steady"]
PARTS = 12
SHARE = 0.01  # of a gain by one mode, from where it is told; outputs of rounding have more than its inverse


@dataclass(frozen=True)
class Response(OfMoment):
    """Gain and phase over the frequency, the modes that make them, and what noise does; Bode and Nyquist pictures.

    >>> result = fd.run(scene, fd.MomentSettings(analysis=fd.Response(input="hinge.moment", band="1..500")))
    """

    keeps: ClassVar[bool] = False
    example: ClassVar[str] = (
        "ffr-dyn response arm.toml --input hinge.moment --output arm.tip.acceleration --band 1..500 --bode out/arm.png"
    )
    input: str = field(
        default="",
        metadata=option(
            "--input", "joint.moment, joint.force, body.point.force.x, driver.moment, driver.angle, base.x, or a load.",
            metavar="NAME", required=True,
        ),
    )  # fmt: skip
    quantities: tuple[str, ...] = field(
        default=(),
        metadata=option("--output", "Quantity, such as rod.tip.acceleration or .y of it; repeat.", required=True),
    )
    band: str = field(default="", metadata=option("--band", "Frequencies [Hz], such as 1..500.", metavar="LOW..HIGH"))
    psd: tuple[str, ...] = field(
        default=(), metadata=option("--psd", "Noise at the input: Hz:density, linear between; repeat.", metavar="F:S")
    )
    about: About = field(
        default="start",
        metadata=option(
            "--start/--equilibrium/--steady",
            "Linearise about the start (default). | About the static equilibrium. | About the steady motion.",
        ),
    )
    bode: str = field(default="", metadata=option("--bode", "Draw gain and phase.", metavar="FILE"))
    nyquist: str = field(default="", metadata=option("--nyquist", "Draw the locus.", metavar="FILE"))

    def perform(self, scene: Scene, settings: MomentSettings, **how: Any) -> Result:
        from ffr_dyn.pictures.bode import draw_bode, draw_nyquist
        from ffr_dyn.pictures.histories import check_picture

        for file in filter(None, (self.bode, self.nyquist)):
            check_picture(file)
        found = response(
            scene, input=self.input, outputs=self.quantities, band_of=band_in_words(self.band), psd=_psd(self.psd),
            about=self.about, time=settings.time, path=how["path"],
        )  # fmt: skip
        for draw, file in ((draw_bode, self.bode), (draw_nyquist, self.nyquist)):
            if file:
                draw(found, file)
        return found

    def report(self, result: Result) -> list[str]:
        return response_lines(result)


def band_in_words(text: str) -> tuple[float, float] | None:
    """LOW..HIGH [Hz]; None of no text. InputError for another."""
    if not text:
        return None
    low, _, high = text.partition("..")
    try:
        found = float(low), float(high)
    except ValueError:
        found = (0.0, 0.0)
    if not 0 < found[0] < found[1] < np.inf:
        raise InputError(f"band {text!r}: write the lowest and the highest frequency [Hz], such as 1..500")
    return found


def _psd(texts: Sequence[str]) -> tuple[tuple[float, float], ...]:
    try:
        return tuple((float(f), float(s)) for f, _, s in (text.partition(":") for text in texts))
    except ValueError:
        raise InputError(f"psd {list(texts)}: write frequency [Hz] and density, such as 10:1e-3") from None


def response(
    scene: Scene,
    *,
    input: str | Effort,
    outputs: Sequence[str],
    band_of: tuple[float, float] | None = None,
    frequencies: Sequence[float] = (),
    psd: Sequence[tuple[float, float]] = (),
    about: About = "start",
    time: float = 0.0,
    path: str | Path | None = None,
) -> Result:
    """The response of outputs of a scene to a small harmonic input, a row for every frequency.

    input    : an effort, the name of a load (one doubles it), or in words. "joint.moment" or "joint.force" is along a joint
               coordinate; "driver.moment" in the place of a driver, which then holds what it held; "driver.angle" or
               "driver.stroke" a change of what a driver prescribes; "driver.angle_rate" and "driver.angle_acceleration" of
               its rates; "body.point.force.x" or ".moment.z" at a marker; "base.x" an acceleration of the base, beside
               "base.x.velocity" and "base.x.displacement"
    outputs  : quantities ("rod.tip.acceleration": its components) or components; with a base as input, accelerations of
               markers are absolute, as accelerometers have them, so that the gain is the transmissibility; of its
               displacement and velocity, positions and velocities of markers as well
    band_of  : (low, high) [Hz];  frequencies : [Hz], instead; by default the band of the first vibrations
    psd      : (frequency [Hz], one-sided density [input^2/Hz]) of a noise at the input, linear in between, zero outside
    about    : the scene's "start" at `time` [s], its "equilibrium" or "steady" motion; inputs and outputs in the
               ground's axes do not turn with the bodies

    The result has `frequency` [Hz], and of each output `gain`, `phase` [deg], `transfer` (real and imaginary), and `parts` of
    it by the modes that do most, named in the attribute "modes"; with a psd `density` and the attribute "rms",
    of all of the noise, whatever frequencies are told, and of all frequencies at which an output answers.

        found = fd.response(scene, input="hinge.moment", outputs=("arm.tip.acceleration.y",))
        fd.draw_bode(found, "bode.png")

    Raises InputError for inputs and outputs that do not exist, negative frequencies, and a psd of fewer than two.

    >>> result = fd.response(scene, input="hinge.moment", outputs=["rod.tip.acceleration.y"], band_of=(1.0, 500.0))
    """
    require_scene(scene)
    noise, asked = checked_noise(psd), _checked(frequencies, band_of)
    at = about_state(scene, about, time)
    acts = acting(at, input, time)
    units = components(acts.scene, outputs, time, "response")
    names = (*allowed(acts, units), *acts.moved)
    linear, sides = _linear(acts, at, names, time)
    low, high = band_of or ((noise[0, 0] or None, noise[-1, 0]) if noise.size else (None, None))
    f = asked if asked.size else band(linear.eigenvalues, low, high)
    if acts.order and not f.min() > 0:
        raise InputError(f"frequencies {list(frequencies)}: at 0 Hz a velocity has no displacement; give positive ones")
    found = transfer(linear.A, linear.B, linear.C, linear.D, f, PARTS, acts.order or 0, poles(linear, sides))
    if sides is not None:
        some = f[:: max(1, f.size // 50)]
        linear = replace(linear, notes=(*linear.notes, *beside(linear, sides, some, linear.outputs, acts.order or 0)))
    power, notes = _mean_square(linear, sides, noise, acts.order or 0)
    notes = [*notes_of_gains(linear, found), *notes, *in_a_band(scene, float(f.max()))]
    linear = replace(linear, notes=(*linear.notes, *notes))
    result = _as_result(scene, linear, found, told(acts, input, units, linear.outputs), noise, power, time)
    if path is not None:
        save_result(result, path)
    return result


def checked_noise(psd: Sequence[tuple[float, float]]) -> Array:
    """(K, 2) by rising frequency. InputError for what is no one-sided density over a range of frequencies."""
    found = np.array(psd, float).reshape(-1, 2)
    found = found[np.argsort(found[:, 0], kind="stable")]
    if found.size and (not np.isfinite(found).all() or found.min() < 0 or not found[-1, 0] > found[0, 0]):
        raise InputError(
            f"psd {[tuple(row) for row in found.tolist()]}: give two frequencies [Hz] or more, none of them negative, each "
            "with its one-sided density, such as (5, 1e-3) and (500, 1e-3); of a two-sided density twice as much"
        )
    return found


def _checked(frequencies: Sequence[float], band_of: tuple[float, float] | None) -> Array:
    """(F,) [Hz]. InputError for frequencies that are none, and for a band that does not rise from above zero."""
    if np.ndim(frequencies) != 1:
        raise InputError(f"frequencies is {frequencies!r}; give a list of them [Hz], such as [10.0, 20.0]")
    found = np.array(frequencies, float)
    if not np.isfinite(found).all() or found.min(initial=0.0) < 0:
        raise InputError(f"frequencies {list(frequencies)}: each must be finite and not negative [Hz]")
    if band_of is not None:
        band_in_words(f"{band_of[0]}..{band_of[1]}")
    return found


def _mean_square(linear: Linearisation, sides: Sides | None, noise: Array, order: int) -> tuple[Array, list[str]]:
    """(O,) of the outputs under a noise, a mean over a turn: with what they answer beside the frequency of the input; and
    notes on what is infinite."""
    growing = grows(linear)
    notes = notes_of_growth(linear, growing)
    if not noise.size:
        return np.zeros(0), notes
    found = mean_square(linear.A, linear.B, linear.C, linear.D, noise, order, linear.eigenvalues)
    if sides is not None:
        more = mean_square(linear.A, linear.B, sides.C, sides.D, noise, order, linear.eigenvalues)
        found = found + 2 * more.reshape(-1, found.size).sum(axis=0)
    infinite, why = under_noise(linear, sides, noise, order, growing)
    return np.where(infinite, np.inf, found), [*notes, *why]


def _linear(acts: Acting, at: Scene, names: tuple[str, ...], time: float) -> tuple[Linearisation, Sides | None]:
    """From the input to the outputs, over the turn of what turns; and what they answer beside."""
    others = tuple(name for name in names if name != acts.own)
    found = linearised(acts.scene, time, (acts.effort,), others)
    over_turn = outputs_over_turn if acts.driver else seen_from_ground
    linear, sides = over_turn(found, acts.scene, (acts.effort,), others)
    for k, name in enumerate(names):
        if name == acts.own:
            linear, sides = _with_input(linear, sides, k, name)
    return _by_motion(linear, sides, at, time) if acts.driver else _by_base(linear, sides, acts)


def _with_input(linear: Linearisation, sides: Sides | None, at: int, name: str) -> tuple[Linearisation, Sides | None]:
    """With the input itself as one more output, the `at`th."""
    count, names = len(linear.outputs), list(linear.outputs)
    names.insert(at, name)
    C, D = np.insert(linear.C, at, 0.0, axis=0), np.insert(linear.D, at, 1.0, axis=0)
    if sides is not None:
        rows = [at + k for k in range(0, len(sides.C), count)]
        sides = replace(sides, C=np.insert(sides.C, rows, 0.0, axis=0), D=np.insert(sides.D, rows, 0.0, axis=0))
    return replace(linear, C=C, D=D, outputs=tuple(names)), sides


def about_state(scene: Scene, about: About, time: float) -> Scene:
    """The scene at its start, its equilibrium or in its steady motion. InputError for another word."""
    if about not in ("start", "equilibrium", "steady"):
        raise InputError(f"about is {about!r}; it must be one of 'start', 'equilibrium', 'steady'")
    if about == "start":
        return scene
    return scene_at(scene, static(scene, time=time) if about == "equilibrium" else steady(scene, time=time))


def _by_base(linear: Linearisation, sides: Sides | None, acts: Acting) -> tuple[Linearisation, Sides | None]:
    """With what the base itself adds to outputs that are absolute: of its acceleration to accelerations alone; of its
    displacement and velocity B and D of the displacement and its two derivatives."""
    orders = [absolute_order(acts.effort, name) for name in linear.outputs]
    added = np.array([[float(order == k) for k in range(3)] for order in orders]).reshape(-1, 3)
    if acts.order is None:
        return replace(linear, D=linear.D + added[:, 2:]), sides
    B, D = _last_of_three(linear.B), added + _last_of_three(linear.D)
    return replace(linear, B=B, D=D), sides and replace(sides, D=_last_of_three(sides.D))


def _last_of_three(column: Array) -> Array:
    return np.hstack([np.zeros((len(column), 2)), column])


def _by_motion(
    free: Linearisation, sides: Sides | None, held: Scene, time: float
) -> tuple[Linearisation, Sides | None]:
    """The scene under the motion of a driver, from that without the driver, whose coordinate is its last output: B and D of
    the motion and its two derivatives."""
    seen, through = [free.C[:-1]], [free.D[:-1]]
    if sides is not None:
        own = np.arange(len(sides.C)) % len(free.C) < len(free.C) - 1
        seen, through = [*seen, sides.C[own]], [*through, sides.D[own]]
    A, B, C, D = prescribed(free.A, free.B, np.concatenate(seen), np.concatenate(through), free.C[-1])
    first = len(free.C) - 1
    sides = sides and Sides(C[first:], D[first:], sides.rate)
    values, words = np.zeros(0, complex), tuple[str, ...]()
    if len(A):
        of_held = linearised(held, time)
        values, words = of_held.eigenvalues, of_held.leading
    outputs = free.outputs[:-1]
    return replace(free, A=A, B=B, C=C[:first], D=D[:first], eigenvalues=values, leading=words, outputs=outputs), sides


def _as_result(
    scene: Scene, linear: Linearisation, found: Transfer, said: dict[str, Any], psd: Array, power: Array, time: float
) -> Result:
    outputs = Axis("of", tuple(name.replace(".", " ") for name in linear.outputs))
    names = _mode_names(linear, found)
    parts = Axis("part", ("re", "im"))
    H, own = found.H, said["output_units"]
    unit = listed_units([quotient(one, said["input_unit"]) for one in own])
    quantities = {
        "frequency": Quantity(found.frequencies, "Hz", (), "of the input"),
        "gain": Quantity(np.abs(H), unit, (outputs,), "output over input"),
        "phase": Quantity(np.degrees(np.unwrap(np.angle(H), axis=0)), "deg", (outputs,), "of the output"),
        "transfer": Quantity(np.stack([H.real, H.imag], axis=2), unit, (outputs, parts), "transfer function"),
    }
    if names:
        modes = Axis("part_of", tuple(f"{k + 1}" for k in range(len(names))))
        split = np.stack([found.parts.real, found.parts.imag], axis=3)
        quantities["parts"] = Quantity(split, unit, (outputs, modes, parts), "transfer functions of single modes")
    more: dict[str, Any] = {}
    if psd.size:
        f, s = psd.T
        level = np.interp(found.frequencies, f, s, left=0.0, right=0.0)[:, None]
        density = np.multiply(np.abs(H) ** 2, level, out=np.zeros(H.shape), where=level > 0)
        squared = listed_units([quotient(square(one), "Hz") for one in own])
        quantities["density"] = Quantity(density, squared, (outputs,), "one-sided, of the output squared")
        more["rms"] = dict(zip(linear.outputs, np.sqrt(power).tolist(), strict=True))
    attributes = {
        **described(scene),
        "analysis": "frequency response",
        "method": "linearised",
        **said,
        "outputs": list(linear.outputs),
        "modes": names,
        "notes": list(linear.notes),
        "status": "complete",
        **more,
    }
    return Result(np.full(found.frequencies.size, time), quantities, {}, attributes)


def _mode_names(linear: Linearisation, found: Transfer) -> list[str]:
    """The names of the modes whose parts there are, by their eigenvalues."""
    nearest = [int(np.argmin(np.abs(linear.eigenvalues - value))) for value in found.values]
    return [linear.leading[k] for k in nearest]


def response_lines(result: Result) -> list[str]:
    """The report of the command: every output at rest and at its maximum, the modes that do most there, the rms."""
    a, f, gain = result.attributes, result["frequency"], result["gain"]
    lines = [f"input        {a['input']}, {f.size} frequencies from {f[0]:.4g} to {f[-1]:.4g} Hz"]
    parts = result["parts"] @ np.array([1, 1j]) if len(a["modes"]) else np.zeros((f.size, gain.shape[1], 0))
    for k, name in enumerate(a["outputs"]):
        top = int(np.argmax(gain[:, k]))
        unit = f" {pretty(unit_of_label(result.quantity('gain').unit, k))}".rstrip()
        where = f"gain {gain[0, k]:.5g}{unit} at {f[0]:.4g} Hz, at most {gain[top, k]:.5g}{unit} at {f[top]:.5g} Hz"
        lines.append(f"output       {name}: {where}")
        size = np.abs(parts[top, k])
        shares = size / min(gain[top, k], size.max(initial=0.0)) if gain[top, k] else 0.0 * size
        most = [m for m in np.argsort(-shares, kind="stable")[:3] if SHARE < shares[m] < 1 / SHARE]
        lines += [f"             {100 * shares[m]:5.1f} % there by {a['modes'][m]}" for m in most]
    rms = zip(a.get("rms", {}).items(), a["output_units"], strict=False)
    lines += [f"rms          {name}: {value:.6g} {pretty(unit)}".rstrip() for (name, value), unit in rms]
    return lines + [f"note         {note}" for note in a["notes"]]
