"""Steady motions: the shape in which a scene turns evenly, at one speed or over a list of speeds.

What a steady motion is and how it is found, `ffr_dyn.linear.steady_state` says. Each speed begins where the last one ended.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from ffr_dyn.analyses.integration import with_all_reactions
from ffr_dyn.analyses.outcome import needed, result_of, with_quantities
from ffr_dyn.analyses.registry import OfMoment, option
from ffr_dyn.analyses.settings import MomentSettings
from ffr_dyn.consistency.assemble import Assembled, assemble, seen_in_space
from ffr_dyn.consistency.doubts import checked
from ffr_dyn.consistency.evaluation import evaluator, joined, record_states
from ffr_dyn.linear.spectrum import Spectrum, spectrum
from ffr_dyn.linear.speeds import at_speed, speed_list
from ffr_dyn.linear.steady_state import (
    ALL_TURN,
    UNBALANCED,
    LeapError,
    from_rest,
    held_at_rest,
    nearby,
    nearly_balanced,
    screws_of,
    steady_state,
)
from ffr_dyn.linear.steady_state import Steady as Found
from ffr_dyn.results.quantities import selected
from ffr_dyn.results.result import Quantity, Result
from ffr_dyn.scene.described import described
from ffr_dyn.scene.scene import Scene, require_scene
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.common.progress import no_count

CLOSEST = 256  # parts of the way between two speeds, at most, by which a motion is followed
HELD_AT_REST = (
    "at rest, forces such as the weight of what is not quite balanced turn what nothing drives: it is held there, as at "
    "speeds, over whose turns they are a mean"
)
GROWS = 1e-7  # of a real part relative to the eigenvalue, or the speed: what is no rounding
TURN = option("--turn", "What has the speed: a driver, or a joint coordinate such as hinge.angle.", metavar="NAME")
SPEEDS = option("--speed", "Speed: 314 [rad/s], '3000 rpm', 0..500, '0..6000 rpm:13'; repeat.", metavar="SPEED")


@dataclass(frozen=True)
class Steady(OfMoment):
    """Bodies deformed as turning asks for, joints closed: a row for each speed, or one as drivers and velocities are.

    >>> result = fd.run(scene, fd.MomentSettings(analysis=fd.Steady(speeds=("0..500",), turn="motor")))
    """

    counts: ClassVar[bool] = True
    example: ClassVar[str] = "ffr-dyn steady blades.toml --turn motor --speed '0..750 rpm:4' -o out/steady.nc"
    speeds: tuple[str, ...] = field(default=(), metadata=SPEEDS)
    turn: str = field(default="", metadata=TURN)

    def perform(self, scene: Scene, settings: MomentSettings, **how: Any) -> Result:
        return steady(scene, speeds=speed_list(self.speeds), turn=self.turn, **settings.span, **how)

    def report(self, result: Result) -> list[str]:
        speeds = ", ".join(f"{speed:.6g}" for speed in result["speed"])
        return [*super().report(result), f"speeds       {speeds} rad/s"]


def steady(
    scene: Scene,
    *,
    speeds: Sequence[float | str] = (),
    turn: str = "",
    time: float = 0.0,
    outputs: Sequence[str] = ("default",),
    path: str | Path | None = None,
    progress: Callable[[int, int], None] = no_count,
) -> Result:
    """The steady motion of a scene at `time` [s], a row for every speed [rad/s], with all reactions and the efforts
    of drivers.

    speeds  : of what `turn` names; without any, one row with the velocities that drivers and scene have
    turn    : a driver, or the coordinate of a joint ("hinge.angle") that is to turn evenly; by default the only driver, or
              else the scene's own velocities, scaled until the largest spin is the speed
    outputs : names or patterns of the quantities to keep beside the efforts, as in `forward`
    progress : called with how many speeds of how many are done

    Every body turns about an axis that stays, and keeps its shape: a rotor in bearings, a blade on a hub; not a crank drive.
    What changes with the angle (weight across the axis, for one) is taken as its mean of a turn, which a note tells.

        found = fd.steady(scene, speeds=(0.0, 50.0, 100.0))
        found["speed"], found["blade.tip.displacement"]

    Raises InputError for a scene that cannot turn so, or that something speeds up or brakes; ComputationError where
    no balance is found.

    >>> result = fd.steady(scene, speeds=[100.0, 200.0], turn="motor")
    """
    require_scene(scene)
    found, values = list[tuple[Assembled, Found]](), speed_list(speeds)
    for pair in steady_states(scene, values, turn, time):
        found.append(pair)
        progress(len(found), max(1, len(values)))
    assembled = found[0][0]
    selected(assembled.system, needed(scene, outputs))
    rows, notes, stable = [], list[str](), True
    for at, state in found:
        one = record_states(evaluator(at.system), np.array([time]), state.x[None], state.v[None])
        rows.append(with_all_reactions(at, one))
        notes += [*at.notes, *state.notes, *checked("linearise", at, rows[-1])]
        grown = growing(state)
        stable &= not grown
        notes += [grown] if grown else []
    attributes = {
        **described(scene),
        "analysis": "steady motion",
        "method": f"Newton's method, {sum(state.steps for _, state in found)} steps",
        "degrees_of_freedom": assembled.degrees_of_freedom,
        "stable": int(stable),
        "notes": distinct(notes),
        "status": "complete",
    }
    plain = result_of(assembled.system, joined(rows), attributes, None, outputs)
    turned = np.array(values or [found[0][1].machine.screws.fastest])
    return with_quantities(plain, {"speed": Quantity(turned, "rad/s", (), "of what turns")}, path)


def distinct(notes: Iterable[str]) -> list[str]:
    """Notes that differ by more than how much, of those the one with the most."""
    found = dict[str, str]()
    for note in notes:
        what, _, much = note.partition(" by up to ")
        if what not in found or _number(much) > _number(found[what].partition(" by up to ")[2]):
            found[what] = note
    return list(found.values())


def _number(text: str) -> float:
    return float(text.split()[0]) if text else 0.0


def rounding(one: Spectrum) -> Array:
    """(m,) [1/s] of real parts: of a whirl that stands still in the turning axes beside the speed of its body."""
    found: Array = GROWS * np.maximum(np.maximum(np.abs(one.values), one.speed), 1e-300)
    return found


def growing(found: Found) -> str:
    """The unstable modes about a steady motion, in words; "" where there are none."""
    one = spectrum(found)
    faster = one.values.real > rounding(one)
    if not faster.any():
        return ""
    k = int(np.argmax(np.where(faster, one.values.real, -np.inf)))
    speed = found.machine.screws.fastest
    return (
        f"at {speed:.6g} rad/s the steady motion is unstable: {one.names[k]} grows by {one.values[k].real:.4g} 1/s; where "
        "another is stable, let the scene start nearer to it"
    )


def steady_states(
    scene: Scene, speeds: Sequence[float | str], turn: str = "", time: float = 0.0
) -> Iterator[tuple[Assembled, Found]]:
    """The scene in space and its steady state, at every speed, each beginning where the last one ended."""
    values = speed_list(speeds)
    if not values:
        assembled = assemble(seen_in_space(scene), time=time)
        yield assembled, steady_state(assembled, time)
    last: tuple[float, Found] | None = None
    for speed in values:
        assembled, found = followed_to(scene, speed, turn, time, last)
        last = speed, found
        yield assembled, found


def followed_to(
    scene: Scene, speed: float, turn: str, time: float, last: tuple[float, Found] | None, drag: float = UNBALANCED
) -> tuple[Assembled, Found]:
    """The scene in space and its steady state at a speed [rad/s]: that which the one at the `last` speed becomes; with no
    more `drag` than that of the forces, where something beside the scene keeps its speed.

    Newton's method from there may leap to another, as from an arm that swings out to one that hangs, where stiffness is low.
    Speeds between are taken then, and a note tells where it leaps all the same.
    """
    if last is None or last[0] == speed:
        return _first(scene, speed, turn, time, last and last[1].x, drag)
    here, found = last
    step, least = speed - here, abs(speed - here) / CLOSEST
    while True:
        goal = speed if abs(speed - here) <= abs(step) * (1 + 1e-9) else here + step
        near = near_to(scene, goal, turn, time, (here, found), drag)
        if near is None and abs(step) > least:
            step /= 4
        elif near is None:
            assembled, other = _at(scene, speed, turn, time, found.x, partial(from_rest, drag=drag))
            leap = f"from {here:.6g} rad/s on the steady motion ends, or leaps to another"
            return assembled, replace(other, notes=(leap, *other.notes))
        elif goal == speed:
            return near
        else:
            here, found, step = goal, near[1], 2 * step


def _first(
    scene: Scene, speed: float, turn: str, time: float, start: Array | None, drag: float
) -> tuple[Assembled, Found]:
    """At the first speed [rad/s]; at rest held where its weight would turn it a little, which is no more once it turns."""
    try:
        return _at(scene, speed, turn, time, start, partial(from_rest, drag=drag))
    except InputError as error:
        with suppress(InputError, LeapError):
            assembled, found = _at(scene, speed, turn, time, start, held_at_rest)
            return assembled, replace(found, notes=(HELD_AT_REST, *found.notes))
        raise error


def held_near(
    scene: Scene, speed: float, turn: str, time: float, last: tuple[float, Found]
) -> tuple[Assembled, Found] | None:
    """The scene at a speed [rad/s] with the positions that the steady motion has at the `last` one, where these all but
    balance; None where they do not."""
    try:
        assembled, found = _at(scene, speed, turn, time, last[1].x, nearly_balanced)
    except LeapError:
        return None
    note = (
        f"at {speed:.6g} rad/s no steady motion was found, as at a critical speed, where an unbalance or the weight bends a "
        f"shaft without bound: its vibrations are those about the positions at {last[0]:.6g} rad/s"
    )
    return assembled, replace(found, notes=(note, *found.notes))


def near_to(
    scene: Scene, speed: float, turn: str, time: float, last: tuple[float, Found], drag: float = UNBALANCED
) -> tuple[Assembled, Found] | None:
    """The scene at a speed [rad/s] and its steady state that is near to that at the `last` one; None where none is found."""
    try:
        return _at(scene, speed, turn, time, last[1].x, partial(nearby, drag=drag), last[1])
    except (ComputationError, InputError, LeapError):
        return None


def _at(
    scene: Scene,
    speed: float,
    turn: str,
    time: float,
    start: Array | None,
    reached: Callable[..., Found],
    other: Found | None = None,
) -> tuple[Assembled, Found]:
    """`other` is the steady motion at another speed, whose forces may be known to change with the angle."""
    assembled = assemble(seen_in_space(at_speed(scene, speed, turn, time)), time=time)
    if not turn and not scene.drivers:
        assembled = _as_fast(assembled, speed)
    varies = other is not None and len(other.machine.phases) > 1 and ALL_TURN not in other.notes
    return assembled, steady_state(assembled, time, start, reached, varies=varies)


def _as_fast(assembled: Assembled, speed: float) -> Assembled:
    """With velocities by which the fastest body has a speed [rad/s], also where joints have changed those of the scene."""
    fastest = screws_of(assembled.system.layout, assembled.x, assembled.v).fastest
    return replace(assembled, v=assembled.v * (abs(speed) / fastest)) if fastest else assembled
