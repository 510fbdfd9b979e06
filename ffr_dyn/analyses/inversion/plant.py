"""A scene as a system with inputs and outputs: efforts u move its coordinates y, known motions say what it shall do.

    y_ddot = a(t, y, y_dot) + A(t, y) u,    s(t, y) = 0

The known motions are outputs here and hold nothing, so that u may act on them over any number of derivatives: at once
(relative degree two), or by way of springs and bodies between (four and more). Here y, u and s are in units of the machine.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ffr_dyn.analyses.efforts import Effort, effort_slots
from ffr_dyn.analyses.inversion.servo import ServoMotion, guided, left_free, placed, rates_of, square, unguided
from ffr_dyn.analyses.inversion.turns import count_turns
from ffr_dyn.compile.engine import with_model
from ffr_dyn.compile.scene_tables import compile_scene
from ffr_dyn.consistency.assemble import RELAXATION, Assembled
from ffr_dyn.consistency.evaluation import Evaluator, evaluate, evaluator
from ffr_dyn.equations.constraint_rows import blocks_of
from ffr_dyn.equations.layout import to_global_axes
from ffr_prep.common.arrays import Array


@dataclass(frozen=True)
class Plant:
    """The scene in coordinates y (`own`), and without its known motions (`free`), whose efforts stand in `slots`.

    left_free : names of coordinates that describe what the known motions leave free
    all_rows  : as `free`, with redundant rows, for reactions; None where there are none
    """

    own: ServoMotion
    free: Evaluator
    slots: Array
    shares: Array
    left_free: tuple[str, ...]
    all_rows: Evaluator | None

    @property
    def size(self) -> int:
        """Number of coordinates y."""
        return self.own.size


@dataclass(frozen=True)
class Look:
    """The plant at one time: state x, v, accelerations y_ddot (D,), outputs s (U,), what forces have measured (O,)."""

    x: Array
    v: Array
    y_ddot: Array
    s: Array
    measured: Array


@dataclass(frozen=True)
class Slopes:
    """Derivatives at one time: of y_ddot by y, y_dot (D, D) and u (D, U); of s by y (U, D)."""

    by_y: Array
    by_rate: Array
    by_u: Array
    outputs: Array


def plant(
    assembled: Assembled, known: tuple[str, ...], efforts: tuple[Effort, ...], span: tuple[float, float]
) -> Plant:
    """The scene between its efforts and its known motions. Raises InputError where joint and elastic coordinates do not
    describe its motion."""
    own = unguided(assembled, known, efforts, span)
    free = freed(own, known)
    model = free.system.model
    slots, shares = effort_slots(free, efforts)
    loads = model.loads._replace(data=model.loads.data.copy())
    loads.data[slots] = 0.0
    free = replace(free, engine=with_model(free.engine, model._replace(loads=loads)))
    whole = None if assembled.all_rows is None else evaluator(compile_scene(free.system.scene, None, RELAXATION))
    return Plant(own, free, slots, shares, left_free(assembled, span[0]), whole)


def with_efforts(of: Plant, efforts: tuple[Effort, ...]) -> Plant:
    """The plant with some of its efforts; the others are zero."""
    of.free.system.model.loads.data[of.slots] = 0.0
    slots, shares = effort_slots(of.free, efforts)
    units = replace(of.own.units, efforts=of.own.units.efforts[[of.own.unknown.index(effort) for effort in efforts]])
    return replace(of, own=replace(of.own, unknown=efforts, units=units), slots=slots, shares=shares)


def freed(own: ServoMotion, names: tuple[str, ...]) -> Evaluator:
    """The scene without its known drivers, in which the efforts act."""
    scene = own.at.system.scene
    free = replace(scene, drivers=tuple(driver for driver in scene.drivers if driver.name not in names))
    rows_of = {block.name: block for block in own.at.system.blocks}
    return evaluator(compile_scene(free, [rows_of[block.name] for block in blocks_of(free)]))


def look(of: Plant, time: float, y: Array, rate: Array, u: Array, near: Array) -> Look:
    """The plant at y (D,), y_dot (D,) under efforts u (U,); x is near to its state.

    Raises ComputationError where no position belongs to y.
    """
    own = of.own
    clock, w = float(np.clip(time, *own.span)), np.concatenate([y, rate])
    at = guided(own, clock, w)
    x, now = placed(own, at, clock, w, near)
    v = to_global_axes(at.system.layout, x, rates_of(own, now, rate))
    now = evaluate(at, clock, x, v)
    of.free.system.model.loads.data[of.slots] = of.shares @ (u * own.units.efforts)
    count_turns(own.angles, of.free, clock, y)
    acceleration = evaluate(of.free, clock, x, v).acceleration
    joints = now.jacobian[own.inner] @ acceleration - now.gamma[own.inner]
    y_ddot = np.concatenate([joints, acceleration[own.elastic]]) / own.units.y
    return Look(x, v, y_ddot, now.Phi[own.known] / own.units.known, of.free.work.loads.measured.copy())


def slopes(of: Plant, time: float, y: Array, rate: Array, u: Array, near: Array) -> Slopes:
    """Central differences around a state; exact by u."""
    D, U = of.size, u.size
    now = look(of, time, y, rate, u, near)
    one, by_y, outputs = np.eye(D), np.zeros((D, D)), np.zeros((len(now.s), D))
    steps_of_y, steps = of.own.steps(y, rate)
    for k, h in enumerate(steps_of_y):
        ahead, behind = (look(of, time, y + sign * h * one[k], rate, u, now.x) for sign in (1, -1))
        by_y[:, k], outputs[:, k] = (ahead.y_ddot - behind.y_ddot) / (2 * h), (ahead.s - behind.s) / (2 * h)
    by_rate = _difference(lambda z: look(of, time, y, z, u, now.x).y_ddot, rate, steps)
    by_u = _difference(lambda z: look(of, time, y, rate, z, now.x).y_ddot, u, np.ones(U))
    return Slopes(by_y, by_rate, by_u, outputs)


def motions(of: Plant, time: float, x: Array) -> Array:
    """(V, D) velocities in body axes per rate of each coordinate y, at a position."""
    own = of.own
    now = evaluate(own.at, time, x, np.zeros(own.at.system.layout.v_size))
    rates = np.zeros((own.held.size + own.elastic.size, own.size))
    rates[np.searchsorted(own.held, own.inner), np.arange(own.inner.size)] = 1.0
    rates[own.held.size :, own.inner.size :] = np.eye(own.elastic.size)
    return np.linalg.solve(square(own, now), rates * own.units.y)


def _difference(function: Callable[[Array], Array], at: Array, steps: Array) -> Array:
    sides = [(function(at + h * one), function(at - h * one), h) for h, one in zip(steps, np.eye(at.size), strict=True)]
    return np.array([(ahead - behind) / (2 * h) for ahead, behind, h in sides]).reshape(at.size, -1).T
