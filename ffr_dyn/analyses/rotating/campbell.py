"""Campbell diagrams: frequencies and damping of a turning scene over its speed, critical speeds, limits of stability.

The steady motion at each speed begins where the last one ended; its vibrations are followed by their shapes
(`ffr_dyn.linear.spectrum`). Where a frequency crosses a multiple of the speed, or a vibration begins to grow, is found by
Brent's method on steady motions in between.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import accumulate, pairwise
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from scipy.optimize import brentq

from ffr_dyn.analyses.registry import OfMoment, option
from ffr_dyn.analyses.rotating.steady import SPEEDS, TURN, distinct, followed_to, growing, held_near, near_to, rounding
from ffr_dyn.analyses.settings import MomentSettings
from ffr_dyn.consistency.assemble import assemble, seen_in_space
from ffr_dyn.consistency.doubts import checked
from ffr_dyn.consistency.evaluation import evaluator, record_states
from ffr_dyn.consistency.held_frequencies import beyond_modes
from ffr_dyn.linear.prestrained import told
from ffr_dyn.linear.spectrum import Spectrum, followed, spectrum
from ffr_dyn.linear.speeds import at_speed, speed_list
from ffr_dyn.linear.steady_state import NEARLY
from ffr_dyn.linear.whirl import ONE_WAY, damping_ratios
from ffr_dyn.results.file import save_result
from ffr_dyn.results.result import Axis, Quantity, Result
from ffr_dyn.scene.described import described
from ffr_dyn.scene.scene import Scene, require_scene
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.common.progress import no_count

MODES = 10
MET = 1e-8  # of the speed of a crossing, relative to the range
STILL = 1e-6  # of the fastest turning: a vibration that is nowhere faster is a free motion, but for rounding
LEAPS = 2e-3  # of the speed: what a frequency is off its order at a crossing that is none

Row = tuple[float, Spectrum]
AtSpeed = Callable[[float, Row | None], Spectrum]
Measure = Callable[[float, Spectrum, int], float]


@dataclass(frozen=True)
class Campbell(OfMoment):
    """Vibrations at every speed, followed by their shapes; where they cross multiples of the speed; where they grow.

    >>> result = fd.run(scene, fd.MomentSettings(analysis=fd.Campbell(speeds=("0..500",), turn="motor")))
    """

    keeps: ClassVar[bool] = False
    counts: ClassVar[bool] = True
    example: ClassVar[str] = (
        "ffr-dyn campbell rotor.toml --speed 0..500 --order 1 --picture out/campbell.png -o out/rotor.nc"
    )
    speeds: tuple[str, ...] = field(default=(), metadata={**SPEEDS, "required": True})
    turn: str = field(default="", metadata=TURN)
    orders: tuple[str, ...] = field(
        default=("1",),
        metadata=option("--order", "Multiple of the speed that excites; default: 1; repeat.", metavar="K"),
    )
    modes: int = field(default=MODES, metadata=option("--modes", "How many vibrations, from the slowest."))
    picture: str = field(default="", metadata=option("--picture", "Draw the diagram, .png or .svg.", metavar="FILE"))

    def perform(self, scene: Scene, settings: MomentSettings, **how: Any) -> Result:
        if self.picture:
            from ffr_dyn.pictures.histories import check_picture

            check_picture(self.picture)
        orders = tuple(_order(text) for text in self.orders)
        found = campbell(
            scene, speeds=speed_list(self.speeds), turn=self.turn, orders=orders, modes=self.modes, time=settings.time, **how
        )  # fmt: skip
        if self.picture:
            from ffr_dyn.pictures.campbell import draw_campbell

            draw_campbell(found, self.picture)
        return found

    def report(self, result: Result) -> list[str]:
        return campbell_lines(result)


def _order(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InputError(f"order {text!r} is no number: write a multiple of the speed, such as 1 or 2") from None


def campbell(
    scene: Scene,
    *,
    speeds: Sequence[float],
    turn: str = "",
    orders: Sequence[float] = (1.0,),
    modes: int = MODES,
    time: float = 0.0,
    path: str | Path | None = None,
    progress: Callable[[int, int], None] = no_count,
) -> Result:
    """Frequencies and damping of a scene over a list of rising speeds [rad/s]: a row for each.

    turn   : what has the speed, as of `steady`;  orders : multiples of the speed that excite;  modes : how many, from the
             slowest at the first speed; limits of stability are those of all
    progress : called with how much of how much is done, speeds and then vibrations

    The result has `speed` [rad/s], and of each vibration `frequencies` [Hz] in the turning axes and `seen` [Hz] from the
    ground, positive where the whirl is forward, both of the damped vibration; `damping_ratios` and `growth` [1/s]. Its
    attributes have the `names` of the vibrations; the `orders`; `critical`, a list of {speed, order, mode, axes}, where a
    frequency crosses an order: from the ground of what whirls, in the turning axes of what does not; and `limits`, a list of
    {speed, mode}, where one begins to grow, with `until`, up to where it does, if it ends. A crossing is a resonance only
    if a force of that order excites the mode.

        found = fd.campbell(scene, speeds=np.linspace(0, 500, 21))
        fd.draw_campbell(found, "campbell.png")

    Raises InputError for fewer than two speeds, or speeds that do not rise; and as `steady` does.

    >>> result = fd.campbell(scene, speeds=np.linspace(0, 500, 26), turn="motor")
    """
    require_scene(scene)
    values = list(speed_list(speeds))
    if len(values) < 2 or not (np.diff(values) > 0).all():
        raise InputError(f"the speeds are {values}; give two or more that rise, such as 0..500")
    at = _at_speeds(scene, turn, time)
    spectra = _spectra(at, values, modes, progress)
    middle = _told_by(spectra)
    whirling = _whirling(spectra)
    everything, called = _slowest(spectra, whirling), middle.names
    at = _between_speeds(scene, turn, time)
    order, critical, limits = everything[:modes], list[dict[str, Any]](), list[dict[str, Any]]()
    for count, m in enumerate(everything.tolist(), 1):
        shown = count <= order.size
        found, rows = _criticals(
            at, list(zip(values, spectra, strict=True)), m, bool(whirling[m]), orders if shown else ()
        )
        critical += [{**one, "mode": called[m]} for one in found]
        limits += [{**one, "mode": called[m]} for one in _limits(at, rows, m)]
        if shown:
            progress(len(values) + count, len(values) + order.size)
    kept = [one.only(order) for one in spectra]
    crossed = {"orders": [float(k) for k in orders], "critical": critical, "limits": limits}
    doubts = _doubts(scene, turn, time, *max(zip(values, spectra, strict=True), key=lambda row: abs(row[0])))
    result = _as_result(
        scene, time, values, kept, [called[m] for m in order.tolist()], whirling[order], crossed, doubts
    )
    if path is not None:
        save_result(result, path)
    return result


def _spectra(at: AtSpeed, values: Sequence[float], modes: int, progress: Callable[[int, int], None]) -> list[Spectrum]:
    """The vibrations at every speed, each in its place, followed from a speed that has the most: blades on hinges vibrate in
    rotation alone, and are free at rest. InputError where there are none."""
    found = list[Spectrum]()
    for k, speed in enumerate(values):
        found.append(at(speed, (values[k - 1], found[-1]) if found else None))
        progress(len(found), len(values) + min(modes, found[0].values.size))
    start = int(np.argmax([one.values.size for one in found]))
    after = list(accumulate(found[start:], followed))
    before = list(accumulate(found[start::-1], followed))[:0:-1]
    spectra = [*before, *after]
    moving = np.any([np.abs(one.values) > STILL * one.found.machine.screws.fastest for one in spectra], axis=0)
    if not moving.any():
        raise InputError("nothing vibrates: joints and the driver fix every motion, or what they leave is free")
    return [one.only(np.flatnonzero(moving)) for one in spectra]


def _doubts(scene: Scene, turn: str, time: float, speed: float, one: Spectrum) -> list[str]:
    """Notes on the bodies and the joints of the scene, and on what its motion at the fastest speed strains."""
    assembled, found = assemble(seen_in_space(at_speed(scene, speed, turn, time)), time=time), one.found
    rows = record_states(evaluator(assembled.system), np.array([time]), found.x[None], found.v[None])
    return [*assembled.notes, *checked("linearise", assembled, rows)]


def _told_by(spectra: Sequence[Spectrum]) -> Spectrum:
    """That nearest to the middle where most vibrate and most ways of whirling are known: at rest there are none."""
    order = sorted(range(len(spectra)), key=lambda k: abs(k - len(spectra) // 2))
    return max(
        (spectra[k] for k in order),
        key=lambda one: (np.count_nonzero(one.values), np.count_nonzero(~np.isnan(one.whirl))),
    )


def _whirling(spectra: Sequence[Spectrum]) -> Array:
    """(m,) whether a vibration whirls one way, or is any ellipse from the ground, or is that of a body that does not turn, at
    most speeds at which that is known."""
    known = np.array([(one.seen != 0) & (one.found.machine.screws.fastest > 0) for one in spectra])
    of_the_ground = np.array([(np.nan_to_num(one.whirl) > ONE_WAY) | (one.speed == 0) for one in spectra]) & known
    found: Array = (2 * of_the_ground.sum(axis=0) >= known.sum(axis=0)) & of_the_ground.any(axis=0)
    return found


def _slowest(spectra: Sequence[Spectrum], whirling: Array) -> Array:
    """Numbers of the vibrations by the moduli of their eigenvalues from the ground; last what only decays at all speeds."""
    first = spectra[0]
    modulus = np.hypot(first.values.real, np.where(whirling, first.seen, first.values.imag))
    decays = np.all([np.abs(one.values.real) >= np.abs(one.values.imag) for one in spectra], axis=0)
    return np.lexsort((modulus, decays))


def _at_speeds(scene: Scene, turn: str, time: float) -> AtSpeed:
    """Vibrations about the steady motion that that at a row becomes; or, at a critical speed, about its positions."""

    def at(speed: float, near: Row | None) -> Spectrum:
        last = near and (near[0], near[1].found)
        try:
            return spectrum(followed_to(scene, speed, turn, time, last, NEARLY)[1])
        except (ComputationError, InputError):  # no balance at all, or none along what has no stiffness
            if held := last and held_near(scene, speed, turn, time, last):
                return spectrum(held[1])
            raise

    return at


def _between_speeds(scene: Scene, turn: str, time: float) -> AtSpeed:
    """The same near a row, which is not left for another motion: what grows without bound here is looked at from there."""
    known, followed_there = dict[float, Spectrum](), _at_speeds(scene, turn, time)

    def at(speed: float, near: Row | None) -> Spectrum:
        if speed not in known:  # of two vibrations crossings are often the same
            last = near and (near[0], near[1].found)
            found = last and (
                near_to(scene, speed, turn, time, last, NEARLY) or held_near(scene, speed, turn, time, last)
            )
            known[speed] = spectrum(found[1]) if found else followed_there(speed, near)
        return known[speed]

    return at


# ---- crossings ------------------------------------------------------------------------------------------------------


def _off_order(ground: bool, order: float) -> Measure:
    """How far a frequency is from a multiple of the speed [rad/s]; zero where it is none but by rounding.

    A whirl that is just as fast as its body stands still in the turning axes. Near there its eigenvalue is real, or that of a
    part which is no largest one, and says nothing of how fast it is seen.
    """

    def off(speed: float, one: Spectrum, m: int) -> float:
        value = one.values[m].imag
        still = value == 0 or one.seen[m] == 0
        seen = one.speed[m] if ground and still else one.seen[m] if ground else value
        found = float(abs(seen) - order * abs(speed))
        return found if abs(found) > MET * abs(speed) else 0.0

    return off


def _criticals(
    at: AtSpeed, rows: list[Row], m: int, ground: bool, orders: Sequence[float]
) -> tuple[list[dict[str, Any]], list[Row]]:
    """Where a vibration crosses orders, as in the attributes; and the rows, with those between at which it grows.

    A shaft that is not round stands still in the turning axes and grows over a range of speeds, whose ends are critical.
    """
    found, all_rows = list[dict[str, Any]](), rows
    for order in map(float, orders):
        for crossing in _crossings(at, rows, m, _off_order(ground, order)):
            row, speeds = _row_at(at, rows, crossing), [crossing]
            if ground and row[1].values[m].imag == 0 and _grown(*row, m) > 0:
                below = [one for one in rows if one[0] < crossing and _grown(*one, m) < 0][-1:]
                above = [one for one in rows if one[0] > crossing and _grown(*one, m) < 0][:1]
                speeds = [_between(at, one, row, m, _grown) for one in (*below, *above)]
                all_rows = sorted([*all_rows, row], key=lambda row: row[0])
            found += [{"speed": speed, "order": order, "axes": "ground" if ground else "turning"} for speed in speeds]
    return found, all_rows


def _row_at(at: AtSpeed, rows: Sequence[Row], speed: float) -> Row:
    near = min(rows, key=lambda row: abs(row[0] - speed))
    return near if near[0] == speed else (speed, followed(near[1], at(speed, near)))


def _growth(speed: float, one: Spectrum, m: int) -> float:
    """[1/s]"""
    return float(one.values[m].real)


def _grown(speed: float, one: Spectrum, m: int) -> float:
    """[1/s] beyond rounding."""
    return _growth(speed, one, m) - float(rounding(one)[m])


def _limits(at: AtSpeed, rows: Sequence[Row], m: int) -> list[dict[str, float]]:
    """From which speed and until which a vibration grows, away from rest, each between two rows: where it is damped on the
    other side, where it is damped no more; where it is not, where its growth is no rounding. An end is sought beyond a
    beginning alone."""
    pairs = [(inner, outer) for inner, outer in (sorted(pair, key=_from_rest) for pair in pairwise(rows))]
    begins = [_limit(at, inner, outer, m) for inner, outer in pairs if _grown(*inner, m) < 0 < _grown(*outer, m)]
    ending = [pair for pair in pairs if _grown(*pair[1], m) < 0 < _grown(*pair[0], m)]
    ending.sort(key=lambda pair: _from_rest(pair[1]))
    found = list[dict[str, float]]()
    for speed in begins:
        beyond = (pair for pair in ending if pair[1][0] * speed > 0 and _from_rest(pair[1]) > abs(speed))
        ends = [_limit(at, outer, inner, m) for inner, outer in list(beyond)[:1]]
        found.append({"speed": speed} | ({"until": ends[0]} if ends else {}))
    return found


def _from_rest(row: Row) -> float:
    return abs(row[0])


def _limit(at: AtSpeed, calm: Row, grown: Row, m: int) -> float:
    """Between a row at which a vibration does not grow and one at which it does."""
    damped = _growth(*calm, m) < -rounding(calm[1])[m]
    return _between(at, calm, grown, m, _growth if damped else _grown)


def _crossings(at: AtSpeed, rows: Sequence[Row], m: int, measure: Measure) -> list[float]:
    """Speeds where a measure of a vibration is zero: between two rows, or at one but rest, if its neighbours are not zero."""
    measured = [measure(*row, m) for row in rows]
    there = [k for k, value in enumerate(measured) if value]
    found = [
        rows[k][0] for k in (0, len(rows) - 1) if not measured[k] and rows[k][0] and measured[1 if k == 0 else k - 1]
    ]
    for k, next_ in pairwise(there):
        if measured[k] * measured[next_] < 0:
            found += _met(at, rows[k], rows[k + 1], m, measure) if next_ == k + 1 else [rows[k + 1][0]]
    return sorted(found)


def _met(at: AtSpeed, one: Row, other: Row, m: int, measure: Measure) -> list[float]:
    """Speeds between two rows where a measure passes zero; not where it leaps across, as where one vibration takes the shape
    of another in the turning axes, and from forward to backward from the ground."""
    speed, known = _sought(at, one, other, m, measure)
    near = sorted(known, key=lambda row: abs(row[0] - speed))[:2]
    if min(abs(measure(*row, m)) for row in near) <= LEAPS * abs(speed):
        return [speed]
    pairs = pairwise(sorted(known, key=lambda row: row[0]))
    left = [pair for pair in pairs if not pair[0][0] <= speed <= pair[1][0] and _differ(*pair, m, measure)]
    return [met for pair in left for met in _met(at, *pair, m, measure)]


def _differ(one: Row, other: Row, m: int, measure: Measure) -> bool:
    return measure(*one, m) * measure(*other, m) < 0


def _between(at: AtSpeed, one: Row, other: Row, m: int, measure: Measure) -> float:
    return _sought(at, one, other, m, measure)[0]


def _sought(at: AtSpeed, one: Row, other: Row, m: int, measure: Measure) -> tuple[float, list[Row]]:
    """By Brent's method, following the vibration from the nearest speed that is known; and the rows that are known then."""
    known = [one, other]

    def measured(speed: float) -> float:
        row = _row_at(at, known, speed)
        if all(speed != one[0] for one in known):
            known.append(row)
        return measure(*row, m)

    return float(brentq(measured, one[0], other[0], xtol=MET * abs(other[0] - one[0]))), known


# ---- as a result ----------------------------------------------------------------------------------------------------


def _as_result(
    scene: Scene,
    time: float,
    speeds: Sequence[float],
    spectra: Sequence[Spectrum],
    names: Sequence[str],
    whirling: Array,
    crossed: dict[str, Any],
    doubts: Sequence[str],
) -> Result:
    values, seen = np.array([one.values for one in spectra]), np.array([one.seen for one in spectra])
    modes = Axis("vibration", tuple(str(k + 1) for k in range(len(names))))
    ratios = np.array([damping_ratios(one.values, one.seen, one.whirl) for one in spectra])
    worst = max((one.prestrained for one in spectra), key=lambda one: one.share)
    unstable = [note for note in [growing(spectra[0].found)] if note]
    notes = [
        *doubts,
        *distinct(note for one in spectra for note in one.notes),
        *unstable,
        *told(worst, names[worst.mode]),
        *beyond_modes(scene, float(np.abs(values.imag).max(initial=0.0)) / (2 * np.pi)),
    ]
    quantities = {
        "speed": Quantity(np.array(speeds), "rad/s", (), "of what turns"),
        "frequencies": Quantity(np.abs(values.imag) / (2 * np.pi), "Hz", (modes,), "in the turning axes"),
        "seen": Quantity(seen / (2 * np.pi), "Hz", (modes,), "from the ground, positive of forward whirls"),
        "damping_ratios": Quantity(
            ratios, "1", (modes,), "of the vibrations, of whirls as seen from the ground; negative where they grow"
        ),
        "growth": Quantity(values.real, "1/s", (modes,), "real parts of the eigenvalues"),
    }
    attributes = {
        **described(scene),
        "analysis": "Campbell diagram",
        "method": "exact tangents, vibrations followed by their shapes",
        "names": list(names),
        "whirling": [int(one) for one in whirling],
        **crossed,
        "notes": notes,
        "status": "complete",
    }
    return Result(np.full(len(speeds), time), quantities, {}, attributes)


def _unstable(limit: Mapping[str, Any]) -> str:
    """From where a vibration grows, and to where if that is known."""
    return f"from {limit['speed']:.6g}" + (f" to {limit['until']:.6g}" if "until" in limit else "")


def campbell_lines(result: Result) -> list[str]:
    """The table of a Campbell diagram: every vibration at the first, a middle and the last speed, critical speeds, limits."""
    a, speeds = result.attributes, result["speed"]
    rows = sorted({0, len(speeds) // 2, len(speeds) - 1})
    shown = np.where(np.array(a["whirling"], bool), np.abs(result["seen"]), result["frequencies"])
    lines = ["speed        " + "".join(f"{speeds[row]:12.6g}" for row in rows) + " rad/s"]
    for m, name in enumerate(a["names"]):
        axes = "from the ground" if a["whirling"][m] else "in turning axes"
        lines.append("vibration    " + "".join(f"{shown[row, m]:12.6g}" for row in rows) + f" Hz {axes}   {name}")
    lines += [
        f"critical     {one['speed']:.6g} rad/s ({one['speed'] * 30 / np.pi:.6g} rpm), order {one['order']:g}: {one['mode']}"
        for one in sorted(a["critical"], key=lambda one: one["speed"])
    ]
    if not a["critical"]:
        lines.append(f"critical     none between {speeds[0]:.6g} and {speeds[-1]:.6g} rad/s")
    lines += [f"unstable     {_unstable(one)} rad/s: {one['mode']}" for one in a["limits"]]
    return lines + [f"note         {note}" for note in a["notes"]]
