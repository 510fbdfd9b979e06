"""Where a scene comes to rest that is let go: dynamic relaxation with kinetic damping.

A scene at rest falls until its kinetic energy is largest. There it is stopped, and falls again. As energy is taken away, it
comes down to a stable equilibrium, however far the way and whatever it takes to stay together: the joints hold it as in any
motion, and steps are those of the compiled loop.
(Barnes 1999, International Journal of Space Structures 14, 89-104.)
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ffr_dyn.compile.engine import fill_rows, new_engine
from ffr_dyn.compile.scene_tables import System
from ffr_dyn.compile.workspace import new_record
from ffr_dyn.consistency.evaluation import accelerations, evaluator
from ffr_dyn.integrators import ROS2
from ffr_dyn.integrators.stabilisation import Projection, gains
from ffr_dyn.kernels.tables import FILLED, OK, Record
from ffr_dyn.results.power import measured_values
from ffr_dyn.results.recorded_motion import View
from ffr_dyn.scene.force_kinds import forces_of
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError

FALLS, ROWS = 200, 60  # at most; steps of each
FIRST_STEP = 0.04  # of the time in which the fastest part moves by its size
TOO_SHORT = 1e-3  # of the first step
EARLY, LATE = 15, 40  # rows in which a fall ends whose steps were long, and short
SHORTER, LONGER, DOUBTED = 0.7, 1.5, 0.5  # the next steps then, and where a step fails
AT_REST = 1e-8  # of the largest kinetic energy
ENDLESS = 12  # falls without an end
LATER = (0.1, 1.0, 10.0)  # times that time, when forces are asked whether they change


@dataclass(frozen=True)
class Rest:
    """Positions (N, X) on the way to rest, and at its end the angles that forces count whole turns of, by their names."""

    way: Array
    angles: Mapping[str, float]


@dataclass(frozen=True)
class _Fall:
    """Rows of a fall to its end, whether that is where it is fastest, and whether all steps succeeded."""

    rows: Record
    ended: bool
    sound: bool


def relaxed(system: System, time: float, x: Array, sizes: Array) -> Rest | None:
    """The way to rest from positions x at a time [s]; None where nothing moves, where what moves it changes with time, and
    where there is no rest, as of a stone that falls for ever.

    sizes : (V,) of what counts as a motion of one
    """
    scale, at_rest = _time_scale(system, time, x, sizes), np.zeros(sizes.size)
    if not np.isfinite(scale):
        return None
    first = step = FIRST_STEP * scale
    highest, endless, way, v, reference = 0.0, 0, [x[None]], at_rest, system.model.loads.initial
    for _ in range(FALLS):
        fall = _fall(system, time, way[-1][-1], v, reference, step)
        endless = endless + 1 if fall.sound and not fall.ended else 0
        if step < TOO_SHORT * first or endless > ENDLESS:
            return None
        if fall.rows.time.size:
            way.append(fall.rows.x)
            reference, energy = fall.rows.forces[-1], float(fall.rows.energy[-1, 0])
            highest = max(highest, energy)
            if fall.ended and energy <= AT_REST * highest:
                break
        v = fall.rows.v[-1] if endless else at_rest
        step *= _change(fall)
    return Rest(np.concatenate(way), _angles(system, fall.rows) if fall.rows.time.size else {})


def _time_scale(system: System, time: float, x: Array, sizes: Array) -> float:
    """[s] in which the fastest part moves by its size from rest; infinite where nothing moves, where accelerations are not
    determined, and where they change with time."""
    at, still = evaluator(system), np.zeros(sizes.size)
    try:
        now = accelerations(at, time, x, still)
        fastest = float(np.abs(now / sizes).max())
        if not fastest > 0:
            return float("inf")
        scale = fastest**-0.5
        later = [accelerations(at, time + share * scale, x, still) for share in LATER]
    except ComputationError:
        return float("inf")
    return scale if all(np.array_equal(now, other) for other in later) else float("inf")


def _fall(system: System, time: float, x: Array, v: Array, reference: Array, step: float) -> _Fall:
    """From a state to where the kinetic energy is largest, or as far as steps go."""
    engine = new_engine(system, x, v, ROS2(step), gains(Projection()), start=time, spacing=step)
    engine.work.loads.reference[:] = reference
    rows = new_record(system, ROWS)
    sound = fill_rows(engine, rows, time, 1) == OK
    filled = int(engine.tables.clock.steps[FILLED])
    kinetic = rows.energy[:filled, 0]
    falls_off = np.flatnonzero(kinetic[1:] < kinetic[:-1])
    # where a step fails the last ones before it may have gone astray
    end = int(falls_off[0]) + 1 if falls_off.size else filled if sound else filled // 2
    return _Fall(Record(*(column[:end].copy() for column in rows)), bool(falls_off.size), sound)


def _change(fall: _Fall) -> float:
    """Of the step for the next fall, so that it takes a fair number of them."""
    count = fall.rows.time.size
    if not fall.sound:
        return DOUBTED
    if not fall.ended:
        return LONGER
    return SHORTER if count < EARLY else LONGER if count > LATE else 1.0


def _angles(system: System, rows: Record) -> dict[str, float]:
    """[rad] at the last row, with whole turns, of the forces that act on the angle of a joint."""
    view = View(system, rows)
    return {
        force.name: float(measured_values(view, k, 0)[-1])
        for k, force in enumerate(forces_of(system.scene))
        if force.place.way == "angle"
    }
