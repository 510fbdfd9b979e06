"""The power that forces and drivers put into a scene, row by row, and the work it adds up to.

With all of them, kinetic, strain and gravity energy change by  d(energy)/dt = sum of powers + damping power  (geometric
stiffening, where a body has it, is not conservative and adds to neither side).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ffr_dyn.drivers import Driver, PointDriver
from ffr_dyn.forces import Load, SpringDamper
from ffr_dyn.joints import Joint
from ffr_dyn.scene import joint_of, markers
from ffr_dyn.state import StateView
from ffr_dyn.timefunction import as_time_function, evaluate
from ffr_dyn.view import View, cross, dot, to_global

Array = np.ndarray


@dataclass(frozen=True)
class Worked:
    """Work [J] so far, the last time [s] and the last powers [W], oldest first: from these the work goes on."""

    work: float
    time: float
    powers: tuple[float, ...]


def work(time: Array, power: Array, last: Worked | None) -> tuple[Array, Worked]:
    """Work (T,) of a power (T,) at equally spaced times: Adams-Moulton, of order four but for the first row after the start.

    last : what the rows before these left; without, the first row is the start, where the work is zero
    """
    before = last or Worked(0.0, float(time[0]), ())
    values = np.concatenate([before.powers, power])
    step = np.diff(np.concatenate([[before.time], time]))
    growth = step * _means(values)[len(before.powers) :]
    done = np.cumsum(np.concatenate([[before.work], growth]))[1:]
    return done, Worked(float(done[-1]), float(time[-1]), tuple(float(p) for p in values[-3:]))


def _means(values: Array) -> Array:
    """(K,) mean over the step that ends at each of the values (K,), from it and up to three before; 0 at the first."""
    means = np.zeros(values.size)
    if values.size > 1:
        means[1] = (values[1] + values[0]) / 2
    if values.size > 2:
        means[2] = (2 * values[2] + 5 * values[1] - values[0]) / 6  # Simpson's rule less the first step
    means[3:] = (9 * values[3:] + 19 * values[2:-1] - 5 * values[1:-2] + values[:-3]) / 24
    return means


def power(view: View, thing: Any) -> Array:
    """(T,) [W] that a force, a driver or a distance joint puts into the scene."""
    return next(of for kind, of in POWERS.items() if isinstance(thing, kind))(view, thing)


def damping_power(view: View, b: int) -> Array:
    """(T,) power of the modal damping of body b, never positive."""
    body = view.system.scene.bodies[b]
    rates, total = view.q_dot(b), np.zeros(view.rows)
    for j, factor in enumerate(2 * body.damping * np.sqrt(body.model.omega2)):
        total -= factor * rates[:, j] ** 2
    return total


def transmitted(view: View, joint: Joint) -> Array:
    """(T,) power that the first body gives to the second through a joint."""
    force, moment = reaction(view, joint.name)
    j = view.number(joint.j)
    return dot(force, view.record.rd[:, j]) + dot(moment, view.spin(j))


def reaction(view: View, name: str) -> tuple[Array, Array]:
    """Force and moment (T, 3) of a joint or driver, global axes."""
    k = [block.name for block in view.system.blocks].index(name)
    return view.record.reaction[:, k, :3], view.record.reaction[:, k, 3:]


# ---- of each kind -------------------------------------------------------------------------------------------------


def _of_load(view: View, load: Load) -> Array:
    force, moment = _wrench(view, load)
    marker = view.number(load.marker)
    if load.axes == "body":
        A = view.axes(markers(view.system.scene)[marker][0])
        force, moment = to_global(A, force), to_global(A, moment)
    return dot(force, view.record.rd[:, marker]) + dot(moment, view.spin(marker))


def _wrench(view: View, load: Load) -> tuple[Array, Array]:
    """Force and moment (T, 3) of a load in its axes."""
    what = f"load {load.name!r}"
    functions = [as_time_function(component, what) for component in (*load.force, *load.moment)]
    given = np.array([[evaluate(function, t)[0] for function in functions] for t in view.record.time])
    if load.function is not None:
        for row, t in enumerate(view.record.time):
            state = StateView(view.system.scene, view.system.layout, view.record.x[row], view.record.v[row])
            values = np.asarray(load.function(t, state), float)
            given[row, : values.size] += values
    return given[:, :3], given[:, 3:]


def _of_spring(view: View, spring: SpringDamper) -> Array:
    k = [s.name for s in view.system.scene.springs].index(spring.name)
    i, j = view.number(spring.i), view.number(spring.j)
    apart = view.record.r[:, j] - view.record.r[:, i]
    rate = dot(apart, view.record.rd[:, j] - view.record.rd[:, i]) / np.sqrt(dot(apart, apart))
    return -view.record.spring[:, k] * rate


def between_points(view: View, block: PointDriver | Joint) -> Array:
    """(T,) power of a driven point, or of a distance joint whose length changes."""
    force, _ = reaction(view, block.name)
    return dot(force, view.record.rd[:, view.number(block.j)] - view.record.rd[:, view.number(block.i)])


def _of_driver(view: View, driver: Driver) -> Array:
    """lam Phi_t, with lam from the reaction."""
    joint = joint_of(view.system.scene, driver)
    force, moment = reaction(view, driver.name)
    frame_i, frame_j = view.joint_frames(joint)
    drive = np.array([evaluate(driver.function, t) for t in view.record.time])
    if driver.coordinate == "stroke":
        h = frame_i[:, :, 2]
        return dot(force, h) / dot(h, h) * drive[:, 1]
    sine, cosine = np.sin(drive[:, 0])[:, None], np.cos(drive[:, 0])[:, None]
    f, g, f_j = frame_i[:, :, 0], frame_i[:, :, 1], frame_j[:, :, 0]
    along, across = cosine * f + sine * g, cosine * g - sine * f
    about = cross(f_j, across)
    return dot(moment, about) / dot(about, about) * dot(along, f_j) * drive[:, 1]


# A new kind of force: one entry.
POWERS: dict[type, Callable[[View, Any], Array]] = {
    Load: _of_load,
    SpringDamper: _of_spring,
    PointDriver: between_points,
    Driver: _of_driver,
    Joint: between_points,
}
