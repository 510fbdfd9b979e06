"""Messages about a run that failed: time, body or joint, the likely cause and what to change."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ffr_dyn.compile.scene_tables import System
from ffr_dyn.consistency.dropped_terms import remedy
from ffr_dyn.consistency.following import row_named
from ffr_dyn.equations.constraint_rows import drive_of
from ffr_dyn.integrators import RK4, ROS2, ROS3, Integrator
from ffr_dyn.kernels.tables import (
    FAILED,
    IN_DAMPING,
    LAW,
    LEAST,
    NOT_CONVERGED,
    NOT_FINITE,
    SINGULAR_BODY,
    SINGULAR_CONSTRAINT,
    STEP_TOO_SMALL,
    USER,
    WHEN,
    Work,
)
from ffr_dyn.scene.force_kinds import forces_of
from ffr_dyn.scene.joints import DISTANCE
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError

NEAR = 1e-2  # independence of constraints, 1 where they are at right angles: what is left of it near a dead point
FAST = 1e5  # N/kg: a load beside the mass of the scene that moves it out of sight in a step
FEW = 2.0  # steps
HUGE = 1e12  # N, N m: no force of a machine; what made the state overflow


@dataclass(frozen=True)
class Settings:
    """Those of a run: its method, None of a single evaluation; whether a projection holds the constraints; why they lose
    any state, where that is known; and why a run that has hardly begun may have lost it, where nothing else tells."""

    method: Integrator | None = None
    projected: bool = False
    cause: str = ""
    start: str = ""


def failure(system: System, work: Work, status: int, time: float, settings: Settings = Settings()) -> BaseException:
    """The error for a status of the kernels."""
    cause = settings.cause
    at, where = f"at t = {time:.6g} s", int(work.info[FAILED])
    if system.user.cause is not None:
        if isinstance(system.user.cause, KeyboardInterrupt):
            return system.user.cause
        return ComputationError(f"the run stopped in a Python function of the scene: {system.user.failure}")
    lost = not _sound(work)
    if cause and (lost or status == NOT_FINITE):
        return ComputationError(f"{at} the state of {_worst(system, work)} is no longer finite: {cause}")
    if status == NOT_FINITE or (lost and not (status == SINGULAR_CONSTRAINT and _shrunk(system, where, time))):
        locks = status == SINGULAR_CONSTRAINT and _locks(system, work, settings)
        why = locks or _overflow(system, work, settings)
        return ComputationError(f"{at} the state of {_worst(system, work)} is no longer finite: {why}")
    if status == SINGULAR_BODY:
        body = system.scene.bodies[where]
        where_from = f" without {', '.join(body.dropped)}" if body.dropped else ""
        change = remedy(body) if body.dropped else _less_deformed(settings)
        return ComputationError(
            f"{at} the mass matrix of body {body.name!r} is not positive{where_from}: as it is deformed it has no inertia "
            f"left for rigid motion; {change}"
        )
    if status == SINGULAR_CONSTRAINT:
        block, word = row_named(system, where)
        return ComputationError(
            f"{at} the row '{word.text}' of {block.name!r} cannot be met by any motion: it ties bodies that cannot move "
            "there; end the run before it, or use a joint that ties less"
        )
    if status == NOT_CONVERGED:
        return ComputationError(
            f"{at} the iterations of the step do not converge: {_unconverged(system, work, where, time, settings)}"
        )
    assert status == STEP_TOO_SMALL
    return ComputationError(
        f"{at} the step has become too small: the motion is not smooth there (an impact, a jump of a force or of a driver), "
        f"the mechanism locks{_dead_point(system)}, or the tolerances are below what rounding allows; smooth the jump, end "
        f"the run before it, {_remedy(system, 'use larger tolerances')}"
    )


def _less_deformed(settings: Settings) -> str:
    """What to change where a body that can move as it was made is deformed until it has no inertia left."""
    parts = "several parts of it (`ffr-prep reduce --parts`)"
    if settings.method is None or settings.method.controlled:
        return f"if it is meant to bend so far, use {parts}"
    return f"use a smaller step, or, if it is meant to bend so far, {parts}"


def _shrunk(system: System, row: int, time: float) -> bool:
    """Whether a row is of a distance that is prescribed to vanish about now, and with it the direction of the line."""
    _, word = row_named(system, row)
    size = max(body.model.size for body in system.scene.bodies) or 1.0
    return word.kind == DISTANCE and word.function is not None and abs(drive_of(word, time)[0]) < NEAR * size


def _sound(work: Work) -> bool:
    """Whether the state that was evaluated last was one: finite, and of a size whose square is."""
    bodies = work.bodies
    with np.errstate(over="ignore"):
        return all(bool(np.isfinite(table * table).all()) for table in (bodies.A, bodies.omega, bodies.J, bodies.f))


def _worst(system: System, work: Work) -> str:
    """The first body whose inertia or right-hand side is not finite."""
    for b, body in enumerate(system.scene.bodies):
        at = slice(system.layout.iv[b], system.layout.iv[b] + 6 + system.layout.n[b])
        if not all(np.isfinite(part).all() for part in (work.bodies.f[at], work.bodies.A[b], work.bodies.J[b])):
            return f"body {body.name!r}"
    return "the scene"


def _locks(system: System, work: Work, settings: Settings) -> str:
    """That a driven mechanism has come to a dead point before, and what to change; empty where it has not."""
    least, when = work.independence[[LEAST, WHEN]]
    driven = any(word.function is not None for block in system.blocks for word in block.words)
    if not (driven and least < NEAR):
        return ""
    change = "use a smaller step" if settings.projected else "use projection"
    return (
        f"its constraints were nearest to dependence at t = {when:.6g} s: the mechanism locks there{_dead_point(system)}, or "
        f"passes a singular position; {_remedy(system, change)}"
    )


def _overflow(system: System, work: Work, settings: Settings) -> str:
    """Why a state is not finite, and what to change."""
    name, value = _largest(system, work)
    if np.isnan(value):
        return f"{name!r} has no value there; look at its formula, such as a root or a logarithm of what is negative"
    if value > HUGE:
        change = ", or use a smaller step" if _follows(system, name) else ""
        return f"{name!r} exerts {value:.3g} N or N m; look at its numbers and their units{change}"
    if settings.start:
        return settings.start
    if settings.method is None:
        return (
            "a force, an initial state or a driver is far too large there, or a solver has lost the motion before; look "
            "at their numbers and units, or use smaller tolerances"
        )
    if settings.method.controlled:
        return "the tolerances are too large, or a force is not finite; use smaller tolerances"
    if settings.method.implicit:
        return (
            "the step is too large for a stop, a Python function or a fast rotation; use a smaller step"
            f"{_beyond(system, work)}"
        )
    return (
        "the step is too large for a mode or a stiff spring (use ROS2, or a smaller step), or for a stop or a fast rotation "
        f"(use a smaller step){_beyond(system, work)}"
    )


def _follows(system: System, name: str) -> bool:
    """Whether the force of that name has a function of the state, and is lost with it."""
    rows = zip(forces_of(system.scene), system.model.loads.row, strict=True)
    return any(force.name == name and row[USER] >= 0 for force, row in rows)


def _beyond(system: System, work: Work) -> str:
    """The largest load, where it is one that no step may follow."""
    name, value = _largest(system, work)
    mass = sum(body.model.mass for body in system.scene.bodies)
    return f", or a smaller load than {name!r}, {value:.3g} N or N m" if value > FAST * mass else ""


def _dead_point(system: System) -> str:
    return " (a dead point that a driver goes beyond)" if system.scene.drivers else ""


def _remedy(system: System, change: str) -> str:
    return f"keep driven motions within reach, or {change}" if system.scene.drivers else change


def _largest(system: System, work: Work) -> tuple[str, float]:
    """The load or actuator with the largest component, and that; zero where there is none, NaN where it has no value."""
    return max(_given(system, work), key=lambda found: np.nan_to_num(found[1], nan=np.inf), default=("", 0.0))


def _given(system: System, work: Work) -> list[tuple[str, float]]:
    """The largest component of each load and actuator, by name. Other forces follow the state, and are lost with it."""
    scene, found = system.scene, []
    for force, row in zip(forces_of(scene), system.model.loads.row, strict=True):
        if force.given:
            timed, slot = _timed(force.given, row, system, work), row[USER]
            if np.isnan(timed).any() and not np.isinf(timed).any():  # of time alone: not lost with the state
                return [(force.name, np.nan)]
            user = work.user[slot : slot + timed.size] if slot >= 0 else 0.0
            found.append((force.name, timed + user))
    return [(name, float(np.nanmax(np.abs(value), initial=0.0))) for name, value in found]


def _timed(count: int, row: Array, system: System, work: Work) -> Array:
    """(count,) the components of a given force but for what the user's functions of the state add."""
    factors, functions = system.model.loads.data[row[LAW] :][: 2 * count].reshape(2, count)
    with np.errstate(invalid="ignore"):
        timed: Array = factors * np.append(work.functions[:, 0], 1.0)[functions.astype(int)]
    return timed


def _unconverged(system: System, work: Work, where: int, time: float, settings: Settings) -> str:
    """Of a body, or after the bodies a constraint row: where, the likely cause and what to change."""
    bodies, other = system.scene.bodies, not isinstance(settings.method, ROS2)
    if where < len(bodies):
        name = bodies[where].name
    else:
        at = int(np.searchsorted(system.model.rows.start, where - len(bodies), side="right")) - 1
        name = system.blocks[at].name
    if _stuck(work, time, settings.method):
        return (
            f"worst in {name!r}: constraints depend on one another: the mechanism locks{_dead_point(system)} or is in "
            f"a singular position, which this method does not pass; {_remedy(system, 'use RK4, ROS2 or ROS3')}"
        )
    if where < len(bodies) and system.model.bodies.where[where, IN_DAMPING] >= 0:
        return (
            f"worst in body {name!r}: the step is too large for its damping matrix, which couples its coordinates; use ROS2 "
            "or ROS3, or a smaller step"
        )
    if where < len(bodies):
        return (
            f"worst in body {name!r}: the step is too large for its rotation or for a spring, damper, stop or friction that "
            f"acts on it; use a smaller step{', ROS2' if other else ''}, or a softer force{_beyond(system, work)}"
        )
    change = f"use a smaller step{', or ROS2 to pass a singular position' if other else ''}"
    return (
        f"worst in {name!r}: its constraint cannot be met, because the mechanism locks there{_dead_point(system)} or "
        "is singular, or because the step is too large or a stiff spring far from its free length; "
        f"{_remedy(system, change)}{_beyond(system, work)}"
    )


def _stuck(work: Work, time: float, method: Integrator | None) -> bool:
    """Whether constraints have just come to depend on one another, under a method that does not pass such positions."""
    least, when = work.independence[[LEAST, WHEN]]
    if method is None or isinstance(method, (RK4, ROS2, ROS3)):
        return False
    return bool(least < NEAR**2 and abs(time - when) <= FEW * method.step)
