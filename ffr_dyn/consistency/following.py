"""Whether the steps of a run follow its motion: joints that open between them, drivers that are lost.

A projection puts right what a step leaves open. Where that is much, what lies between the steps is not the motion that was
asked for, however well the joints are closed at their ends.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from ffr_dyn.compile.scene_tables import System
from ffr_dyn.equations.constraint_rows import Block, drive_of
from ffr_dyn.equations.layout import angular_speeds
from ffr_dyn.kernels.tables import MOMENT, OPENED, PHI, UNTIL, Record, Work
from ffr_dyn.scene.joints import COINCIDENCE, DISTANCE, DOT_2, RELATION, Word
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.arrays import Array

LOST = 0.1  # rad, or of the size of the largest body, that a row may open by within a step
SPUN = 2.0  # rad that a body of a driven scene may turn by within one: rates that rows of results happen to see
FAST = 0.3  # rad, or of that size, that a driver may move by within a step that is not followed
STALLED = 1.0  # the same within two steps, of which one has failed
SAMPLES = 65  # of a driver within a step
HALVINGS = 30
LOOKS = 257  # of a driven motion over a run, for its size
BESIDE = 1e-9  # of a run, at which a driven motion is looked at on both sides of a moment
AT_ONCE, STEADY = 1e-2, 1e-6  # of its largest rate, of its range: what a rate, and a value, may change by there
SUDDEN = 0.5  # of a change, which takes the smallest part of a step: a jump


@dataclass(frozen=True)
class Lost:
    """When [s] the steps have lost the motion, and how, in words."""

    time: float
    text: str


def unfollowed(system: System, work: Work, step: float, rows: Record) -> Lost | None:
    """Where steps of a length [s] do not follow the motion up to these rows."""
    return torn_open(system, work, step) or (_spun(system, step, rows) if system.scene.drivers else None)


def torn_open(system: System, work: Work, step: float) -> Lost | None:
    """Time and text of a joint that was open by too much at the end of a step."""
    opened, time = float(work.drift[PHI]), float(work.drift[MOMENT])
    if not opened > LOST * min(1.0, _length(system.scene)):
        return None  # whichever row it is
    block, word = row_named(system, int(work.drift[OPENED]))
    if opened <= LOST * _whole(system.scene, word):
        return None
    how = f"{'not followed, ' * block.driver}open by {opened:.3g} {_unit(word)} at the end of a step"
    text = (
        f"at t = {time:.6g} s {_called(block)} is {how}: the motion "
        f"between the steps is more than the method follows; use steps far shorter than {step:.3g} s"
    )
    return Lost(time, text)


def _spun(system: System, step: float, rows: Record) -> Lost | None:
    """Time and text of a body that turns by too much within a step."""
    if step * 3**0.5 * np.abs(rows.v).max(initial=0.0) <= SPUN:
        return None  # the three components of no angular velocity make so much
    speeds = angular_speeds(system.layout, rows.v)
    for b in np.flatnonzero(step * speeds.max(axis=0, initial=0.0) > SPUN)[:1].tolist():
        row = int(np.argmax(speeds[:, b]))
        time, spin, name = float(rows.time[row]), float(speeds[row, b]), system.scene.bodies[b].name
        text = (
            f"at t = {time:.6g} s body {name!r} turns by {step * spin:.3g} rad within a step of {step:.3g} s: the "
            f"motion between the steps is more than the method follows; use a step below {0.1 / spin:.2g} s"
        )
        return Lost(time, text)
    return None


def jumped(system: System, times: Array) -> str:
    """Which driver jumps between two of the times [s] of rows; empty where none does."""
    said = [(block, word) for block in system.blocks for word in block.words if word.function is not None]
    for block, word in said:
        value, rate, _ = np.array([drive_of(word, float(t)) for t in times]).T
        off = np.abs(np.diff(value) - 0.5 * (rate[1:] + rate[:-1]) * np.diff(times))
        for k in np.flatnonzero(off > LOST * _whole(system.scene, word)):
            time, jump = _jump(word, float(times[k]), float(times[k + 1]))
            if abs(jump) > SUDDEN * off[k]:
                return _told_jump(block, word, time, jump)
    return ""


def sudden(system: System, breaks: Array, start: float, end: float) -> list[str]:
    """Which drivers and lengths jump between two times [s], or change their rates at once, in words.

    breaks : (K,) [s] at which functions of time jump or switch, beside those that they tell
    """
    aside = BESIDE * (end - start)
    times = np.concatenate([system.model.functions.breaks[:, UNTIL], breaks])
    times = np.unique(times[(times > start + aside) & (times < end - aside)])
    if not times.size:
        return []
    said = [(block, word) for block in system.blocks for word in block.words if word.function is not None]
    return [text for block, word in said for text in _broken(block, word, times, np.linspace(start, end, LOOKS))]


def _broken(block: Block, word: Word, times: Array, looks: Array) -> Iterator[str]:
    """What a driven motion does at once at any of the times [s]; looks : (L,) from the first time to the last."""
    aside = BESIDE * float(looks[-1] - looks[0])
    before, behind = (_prescribed(word, times + side) for side in (-aside, aside))
    value, rate = np.concatenate([before, behind, _prescribed(word, looks)]).T
    fastest = float(np.nanmax(np.abs(rate), initial=0.0))
    jumps = behind[:, 0] - before[:, 0] - aside * (behind[:, 1] + before[:, 1])
    least = STEADY * (np.nanmax(value) - np.nanmin(value) + aside * fastest)
    for k in np.flatnonzero(np.abs(jumps) > least)[:1].tolist():
        yield _told_jump(block, word, float(times[k]), float(jumps[k]))
    changes = behind[:, 1] - before[:, 1]
    at_once = np.flatnonzero(np.abs(changes) > AT_ONCE * fastest)
    if at_once.size:
        yield _told_rate(block, word, times[at_once], changes[at_once])


def _told_rate(block: Block, word: Word, times: Array, changes: Array) -> str:
    """Of all times [s] at which a rate changes at once the largest change, in words."""
    k = int(np.argmax(np.abs(changes)))
    more = f", and at {times.size - 1} more such times" if times.size > 1 else ""
    return (
        f"{_called(block)} changes its rate by {changes[k]:.4g} {_unit(word)}/s at once at t = {times[k]:.6g} s{more}: "
        "that takes an impulse, which no force, effort, power or work of the result holds; round the corner, as `smooth` "
        "and `ramp` do, or let a table go on"
    )


def _prescribed(word: Word, times: Array) -> Array:
    """(T, 2) value and rate of a driven motion, NaN where it has none: no step needs to have been there."""
    found = np.full((times.size, 2), np.nan)
    for k, t in enumerate(times.tolist()):
        with suppress(Exception):
            found[k] = drive_of(word, t)[:2]
    return np.where(np.isfinite(found), found, np.nan)


def lost_driver(system: System, start: float, end: float, far: float = FAST) -> str:
    """Which driver jumps within a step [s], or moves farther than it follows (rad, or of the size of the largest body); empty
    where none does."""
    times = np.linspace(max(start, 0.0), end, SAMPLES)
    for block in system.blocks:
        for word in block.words:
            if word.function is None:
                continue
            moved = float(np.abs(np.diff([drive_of(word, t)[0] for t in times])).sum())
            if not moved > far * _whole(system.scene, word):
                continue
            if jump := jump_of(block, word, start, end):
                return jump
            short = 0.1 * (end - start) / moved * _whole(system.scene, word)
            return (
                f"{_called(block)} moves by {moved:.3g} {_unit(word)} within the step that ends at t = {end:.6g} s: "
                "the motion between the steps is more than the method follows; let it move more slowly, or use steps below "
                f"{short:.2g} s"
            )
    return ""


def jump_of(block: Block, word: Word, start: float, end: float) -> str:
    """That a driver jumps within a step [s], however little; empty where it does not."""
    times = np.linspace(max(start, 0.0), end, SAMPLES)
    changes = np.abs(np.diff([drive_of(word, float(t))[0] for t in times]))
    k = int(np.argmax(changes))
    time, jump = _jump(word, float(times[k]), float(times[k + 1]))
    return _told_jump(block, word, time, jump) if abs(jump) > SUDDEN * changes.sum() > 0 else ""


def _told_jump(block: Block, word: Word, time: float, jump: float) -> str:
    return (
        f"{_called(block)} jumps by {jump:.4g} {_unit(word)} at t = {time:.6g} s, which no motion follows; give it a "
        "ramp that lasts some steps"
    )


def _jump(word: Word, early: float, late: float) -> tuple[float, float]:
    """When [s] and by how much a prescribed motion changes most between two times, in the smallest part of them."""
    for _ in range(HALVINGS):
        middle = 0.5 * (early + late)
        low, mid, high = (drive_of(word, t)[0] for t in (early, middle, late))
        early, late = (early, middle) if abs(mid - low) > abs(high - mid) else (middle, late)
    return late, drive_of(word, late)[0] - drive_of(word, early)[0]


def row_named(system: System, row: int) -> tuple[Block, Word]:
    """The block and word of a row of the tables."""
    starts = system.model.rows.start
    number = int(np.searchsorted(starts, row, side="right")) - 1
    return system.blocks[number], system.blocks[number].words[row - int(starts[number])]


def _whole(scene: Scene, word: Word) -> float:
    """[m] or [rad], what a share of is meant."""
    return _length(scene) if _unit(word) == "m" else 1.0


def beyond_one(scene: Scene, word: Word) -> float:
    """How many times what a row of a scene of one metre may be open by one of this scene may: lengths of larger ones more."""
    return max(1.0, _whole(scene, word))


def _length(scene: Scene) -> float:
    """[m] of the largest body, which may be a point."""
    return max(body.model.size for body in scene.bodies) or 1.0


def _unit(word: Word) -> str:
    strokes = word.kind == RELATION and all(kind == "stroke" for _, kind in word.relation)
    return "m" if strokes or word.kind in (COINCIDENCE, DOT_2, DISTANCE) else "rad"


def _called(block: Block) -> str:
    return f"{'driver' if block.driver else 'joint'} {block.name!r}"
