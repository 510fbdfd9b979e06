"""Motions that stay where they are not stable: a strut that is exactly straight, a pendulum exactly upright, a body that
spins exactly about its middle axis. Rounding need not disturb them; what is disturbed a little leaves them.

So the motion is run beside one that has got a push at its start, in all directions that its constraints leave free, by
which free bodies would go PUSH of their size over the run. What the two differ by is told in that measure: one for what is
free, less for what is held. A phase that runs away goes with a power of time, an unstable motion exponentially: half of the
decades take it half of the time.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ffr_dyn.compile.scene_tables import System
from ffr_dyn.consistency.assemble import Assembled, assemble, in_space
from ffr_dyn.consistency.evaluation import evaluate, evaluator, locked, smallest_motion
from ffr_dyn.equations.layout import to_global_axes, velocity_sizes
from ffr_dyn.results.quantities import catalogue
from ffr_dyn.results.result import Result
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError

PUSH = 1e-8  # of sizes and radians: far above the rounding of a run, and of what a plane leaves out of one
LEAVES = (
    1e3  # times the push: what a machine is off its drawing by, 1e-6 of its size, is then as large as errors of a run
)
FULL, ROWS = 0.3, 3  # of the largest difference; rows in which the first half of its decades is seen
STAYS = 1e-2  # of its size, of a turn, by which a body that stays moves as it vibrates
STILL = 1e-10  # of a rate, by which one that is even changes by rounding
LATE = 0.45  # of the time in which a difference grows LEAVES times, that half of its decades take at least
POSES, MOVES = re.compile(r"\.(position|R|p)$"), re.compile(r"\.(position|R|p|angle|stroke|displacement|rotation)$")


def free_to_leave(
    scene: Scene, assembled: Assembled, time: float, begun: Callable[[Assembled], Assembled]
) -> Assembled:
    """The state in space where a plane was found for it, which it may leave; as it is where bodies have no inertia across."""
    if assembled.system.scene.plane == "none" or scene.plane != "auto":
        return assembled
    try:
        return begun(assemble(in_space(scene), time=time))
    except InputError:
        return assembled


def pushed(assembled: Assembled, time: float, lasts: float) -> Assembled:
    """The state with the push of a run that lasts so long [s]. Raises ComputationError as an evaluation does."""
    scene, place = assembled.system.scene, assembled.system.layout
    at = evaluator(assembled.system)
    now = evaluate(at, time, assembled.x, assembled.v)
    push = PUSH / lasts * velocity_sizes(scene, place) * np.random.default_rng(0).normal(size=place.v_size)
    push[locked(place)] = 0.0
    faster = push + smallest_motion(at, now, -(now.jacobian @ push))
    return replace(assembled, v=assembled.v + to_global_axes(place, assembled.x, faster))


def at_rest_in_part(run: Result, system: System) -> bool:
    """Whether a body stays where it is in a run, or in space spins evenly about an axis, as others might disturb. Where all
    moves, the steps are a disturbance, and their error tells."""
    spatial = not any(normal >= 0 for normal in system.layout.normals)
    for body in system.scene.bodies:
        if f"{body.name}.R" not in run.quantities or f"{body.name}.p" not in run.quantities:
            return True
        size = body.model.size or 1.0
        if _moved(run, f"{body.name}.R").max() <= STAYS * size and _moved(run, f"{body.name}.p").max() <= STAYS:
            return True
        if spatial and f"{body.name}.omega_bar" in run.quantities:
            rates = _moved(run, f"{body.name}.omega_bar")
            if rates.min() <= STILL * np.abs(run[f"{body.name}.omega_bar"]).max():
                return True
    return False


def _moved(run: Result, name: str) -> Array:
    """(K,) the range of each component."""
    return np.ptp(run[name].reshape(run.time.size, -1), axis=0)


def places(system: System) -> list[str]:
    """Names of the quantities that tell where a scene is."""
    return [name for name in catalogue(system) if MOVES.search(name)]


def departures(run: Result, disturbed: Result, size: float, until: float) -> dict[str, float]:
    """Of the quantities in which a disturbed run leaves the other before a time [s], how many times the push they differ by;
    others than poses are looked at where these do.

    size : [m] of the largest body
    """
    rows = np.count_nonzero(disturbed.time <= until)
    lasting, found = run.time[:rows] - run.time[0], dict[str, float]()
    for name in sorted(run.quantities, key=lambda one: POSES.search(one) is None):
        if not found and not POSES.search(name):
            break
        off = np.abs(run[name][:rows] - disturbed[name][:rows]).reshape(rows, -1).max(axis=1, initial=0.0)
        grown = np.maximum.accumulate(off) / (PUSH * (size if run.quantities[name].unit == "m" else 1.0))
        if grown[-1] > LEAVES and _exponential(grown, lasting):
            found[name] = float(grown[-1])
    return found


def _exponential(grown: Array, lasting: Array) -> bool:
    """Whether a difference (T,) grows LEAVES times, or, where that takes next to no rows, to the most of what it does, as
    fast as it is large."""
    half = whole = 0
    for most in (LEAVES, FULL * grown[-1]):
        half, whole = (int(np.argmax(grown > least)) for least in (most**0.5, most))
        if half >= ROWS:
            break
    return bool(lasting[half] >= LATE * lasting[whole])
