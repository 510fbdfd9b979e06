"""Forces and outputs that have a kink, or jump, at the state that is linearised: on its two sides their slopes differ.

Such are a stop whose edge is just touched, a servo just at its limit, the corner of a tabulated spring at its free length, a
cable that is just taut. Small motions about the state are then not linear, however small they are, and the slope by central
differences, the mean of both sides, belongs to neither.

Slopes of forces are looked at along what a law is a function of: the coordinates of its place and their rates, and the
motions and velocities of all bodies where it looks at the state. Those of outputs that are sizes, as von Mises stress is, are
looked at along one way by which all coordinates move.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from ffr_dyn.equations.forces import At
from ffr_dyn.equations.forces_at_rest import FAR, Watched, law_on
from ffr_dyn.equations.jets import coordinates
from ffr_dyn.equations.layout import moved, to_global_axes
from ffr_dyn.equations.placed import Sums, all_placed, nothing_on, pair
from ffr_dyn.functions.differences import NOT_DEFINED
from ffr_dyn.scene.force_kinds import forces_of
from ffr_dyn.scene.forces.force import Force
from ffr_dyn.scene.forces.places import AtMarker, OnBody
from ffr_dyn.scene.scene import Scene
from ffr_dyn.scene.stress_sensors import MEASURES
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError

STEP = 1e-6  # m, rad, m/s, rad/s: how near a kink is at the state
SMALLER = 0.1  # by which the step becomes smaller: a smooth slope then changes by as much less
KEPT = 0.5  # of the change of a slope by a kink, in spite of that
BENT = 1e-3  # of a slope: a change by a kink that counts; and as good as none, as before a stop that begins softly
ROUNDING = 64 * np.finfo(float).eps  # of forces, over the step
POSITION, VELOCITY = "position", "velocity"
MISFIT = 0.01  # of the change of an output: from where on slopes do not give it
NEARER = (1e-3, 1e-4)  # of the steps by which slopes were found


def kinked_forces(now: At) -> list[str]:
    """Notes on the forces that have a kink at a state, a sentence each."""
    total = nothing_on(all_placed(now), now.place.v_size)
    return [_told(force, by) for force in forces_of(now.scene) if (by := _kinks(total, now, force))]


def held_by_nothing(now: At) -> list[str]:
    """Notes on the forces that hold at rest what they do not hold here, a sentence each."""
    total = nothing_on(all_placed(now), now.place.v_size)
    return [text for force in forces_of(now.scene) if (text := force.at_rest(_rate(total, now, force)))]


def _rate(total: Sums, now: At, force: Force) -> float:
    """The rate of a force's coordinate, where it has one."""
    if isinstance(force.place, AtMarker | OnBody):
        return 0.0
    ends = force.place.ends(now.scene)
    jets = coordinates(now.scene, pair(*(total.placed[number] for number in ends)), force.place)
    return float((total.gradient(ends, np.array([jet.first for jet in jets])) @ now.velocities)[0]) if jets else 0.0


def _told(force: Force, by: list[str]) -> str:
    return (
        f"force {force.name!r} has a kink just at this state: by {' and '.join(by)} it changes otherwise on one side than on "
        "the other. Small motions are not linear here: frequencies and damping, by the mean of both sides, hold for neither. "
        "Start farther from the kink than the scene moves, or look at the motion itself with `run`"
    )


def _kinks(total: Sums, now: At, force: Force) -> list[str]:
    """By what a force has a kink: "position", "velocity"."""
    laws = list(_laws(total, now, force))
    return [
        by for by in (POSITION, VELOCITY) if any(kind == by and has_kink(law, n, far) for kind, law, n, far in laws)
    ]


def _laws(total: Sums, now: At, force: Force) -> Iterator[tuple[str, Callable[[Array], Array], int, float]]:
    """Functions of changes of position, or velocity, that give the force, of how many, and how large these are already."""
    place, size, inside = now.place, now.place.v_size, now.velocities
    ends, c, rate = force.place.ends(now.scene), np.zeros(0), np.zeros(0)
    if not isinstance(force.place, AtMarker | OnBody):
        jets = coordinates(now.scene, pair(*(total.placed[number] for number in ends)), force.place)
        if not jets:
            return
        c = np.array([float(jet.value) for jet in jets])
        rate = total.gradient(ends, np.array([jet.first for jet in jets])) @ inside
        yield POSITION, lambda step: law_on(force, now, c + step, rate), c.size, float(np.abs(c).max())
        yield VELOCITY, lambda step: law_on(force, now, c, rate + step), c.size, float(np.abs(rate).max())
    law, watched = partial(_in_state, force, c, rate), Watched(now.scene, place, now.t, now.x, now.v, [])
    law(watched)
    if watched.looks or isinstance(force.place, OnBody):
        yield POSITION, lambda step: law(replace(now, x=moved(place, now.x, step))), size, 1.0
        yield VELOCITY, lambda step: law(replace(now, v=to_global_axes(place, now.x, inside + step))), size, 1.0


def _in_state(force: Force, c: Array, rate: Array, now: At) -> Array:
    """(K,) the force as a function of the state, at coordinates that stay what they are."""
    if isinstance(force.place, OnBody):
        b = force.place.ends(now.scene)[0]
        return np.ravel(force.law(now, now.x[now.place.q(b)], now.v[now.place.q_dot(b)]))
    return law_on(force, now, c, rate) if c.size else np.ravel(force.law(now, None, None))


def has_kink(function: Callable[[Array], Any], size: int, far: float) -> bool:
    """Whether a function of `size` changes, of what is as large as `far`, has slopes that differ on the two sides of zero, or
    hardly any on one side of it."""
    h, here = STEP * max(1.0, FAR * far), np.ravel(function(np.zeros(size)))
    for direction in np.eye(size):
        try:
            bends = [_bend(function, here, step * direction) for step in (h, SMALLER * h)]
        except NOT_DEFINED:
            continue
        (wide, slope, other, _), (narrow, _, _, rounding) = bends
        kink = narrow > np.maximum(KEPT * wide, BENT * slope)
        if ((kink | (other < BENT * slope)) & (narrow > rounding)).any():
            return True
    return False


def _bend(function: Callable[[Array], Any], here: Array, step: Array) -> tuple[Array, Array, Array, Array]:
    """(K,) each: by how much slopes on both sides differ, the larger and the smaller one, and the rounding of both."""
    h = float(np.abs(step).max())
    ahead, behind = np.ravel(function(step)), np.ravel(function(-step))
    sides = np.abs(ahead - here) / h, np.abs(here - behind) / h
    size = np.maximum(np.maximum(np.abs(ahead), np.abs(behind)), np.abs(here))
    return np.abs(ahead + behind - 2.0 * here) / h, np.maximum(*sides), np.minimum(*sides), ROUNDING * size / h


def check_sizes(
    scene: Scene, outputs: Sequence[str], measured: Callable[[Array], Array], C: Array, steps: Array
) -> None:
    """InputError for an output that is a size and does not change by its slopes; outputs (O,) are measured at a deviation
    (S,) and have the slopes C (O, S)."""
    sizes = {f"measured.{one.name}": one.what for one in scene.measurements if one.what in ("distance", *MEASURES)}
    if sizes.keys().isdisjoint(outputs):
        return
    here, way = measured(np.zeros(steps.size)), steps * np.cos(1.0 + np.arange(steps.size))
    kinked = np.ones(len(outputs), bool)
    for share in NEARER:
        change, told = measured(share * way) - here, share * (C @ way)
        size = np.abs(change) + share * (np.abs(C) @ np.abs(way))
        kinked &= np.abs(change - told) > MISFIT * size + 64 * np.finfo(float).eps * np.abs(here)
    for name, value, kink in zip(outputs, here, kinked, strict=True):
        if kink and name in sizes:
            raise InputError(
                f"output {name!r} is {value:.3g} here and has no slope: small motions in opposite ways do not change "
                f'{sizes[name]} by opposite amounts. Take components, which have slopes (what = "stress", "xx", "position"), '
                "or the motion itself with `run`"
            )
