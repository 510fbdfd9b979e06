"""The power that forces and drivers put into a scene, row by row, and the work it adds up to.

With all of them, kinetic, strain and gravity energy change by  d(energy)/dt = sum of powers + damping power  (geometric
stiffening, where a body has it, is not conservative and adds to neither side).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ffr_dyn.equations.inertia import damping_matrix
from ffr_dyn.kernels.tables import MEASURED
from ffr_dyn.results.recorded_motion import View, cross, dot
from ffr_dyn.scene.drivers import Driver, PointDriver
from ffr_dyn.scene.force_kinds import forces_of
from ffr_dyn.scene.forces.force import Force
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import joint_of
from ffr_prep.common.arrays import Array


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
    of = next((of for kind, of in POWERS.items() if isinstance(thing, kind)), _of_force)
    return of(view, thing)


def damping_power(view: View, b: int) -> Array:
    """(T,) power of the damping of body b, never positive."""
    body = view.system.scene.bodies[b]
    rates = view.q_dot(b)
    return -np.einsum("ti,ij,tj->t", rates, damping_matrix(body.model, body.damping), rates)


def transmitted(view: View, joint: Joint) -> Array:
    """(T,) power that the first body gives to the second through a joint."""
    force, moment = reaction(view, joint.name)
    j = view.number(joint.j)
    given: Array = dot(force, view.record.rd[:, j]) + dot(moment, view.spin(j))
    return given


def reaction(view: View, name: str) -> tuple[Array, Array]:
    """Force and moment (T, 3) of a joint or driver, global axes."""
    k = _block(view, name)
    return view.record.reaction[:, k, :3], view.record.reaction[:, k, 3:]


def _block(view: View, name: str) -> int:
    return [block.name for block in view.system.blocks].index(name)


def measured_values(view: View, force: int, columns: int | slice) -> Array:
    """(T,) or (T, size) some of what is recorded of force number `force`."""
    start = view.system.model.loads.row[force, MEASURED]
    at = columns + start if isinstance(columns, int) else slice(columns.start + start, columns.stop + start)
    values: Array = view.record.forces[:, at]
    return values


def spring_energy(view: View) -> Array:
    """(T,) [J] stored in forces, preload included; zero where they are neither stretched nor turned."""
    total = np.zeros(view.rows)
    for k, force in enumerate(forces_of(view.system.scene)):
        if force.stores_energy:
            count = len(force.place.initial) // 3
            total += force.energy(measured_values(view, k, 0 if count == 1 else slice(0, count)))
    return total


# ---- of each kind -------------------------------------------------------------------------------------------------


def _of_force(view: View, load: Force) -> Array:
    names = [one.name for one in forces_of(view.system.scene)]
    return view.record.power[:, names.index(load.name)]


def driven(view: View, driver: Driver) -> Array:
    """(T, 3) what a driver prescribes, and two derivatives."""
    rows, k = view.system.model.rows, _block(view, driver.name)
    return view.record.functions[:, rows.function[rows.start[k]]]


def between_points(view: View, block: PointDriver | Joint) -> Array:
    """(T,) power of a driven point, or of a distance joint whose length changes."""
    force, _ = reaction(view, block.name)
    return dot(force, view.record.rd[:, view.number(block.j)] - view.record.rd[:, view.number(block.i)])


def _of_driver(view: View, driver: Driver) -> Array:
    """lam Phi_t, with lam from the reaction."""
    joint = joint_of(view.system.scene, driver)
    force, moment = reaction(view, driver.name)
    frame_i, frame_j = view.joint_frames(joint)
    drive = driven(view, driver)
    if driver.coordinate == "stroke":
        h = frame_i[:, :, 2]
        along_stroke: Array = dot(force, h) / dot(h, h) * drive[:, 1]
        return along_stroke
    sine, cosine = np.sin(drive[:, 0])[:, None], np.cos(drive[:, 0])[:, None]
    f, g, f_j = frame_i[:, :, 0], frame_i[:, :, 1], frame_j[:, :, 0]
    along, across = cosine * f + sine * g, cosine * g - sine * f
    about = cross(f_j, across)
    turning: Array = dot(moment, about) / dot(about, about) * dot(along, f_j) * drive[:, 1]
    return turning


# Of what is no applied load: the power of those is recorded.
POWERS: dict[type, Callable[[View, Any], Array]] = {
    PointDriver: between_points,
    Driver: _of_driver,
    Joint: between_points,
}
