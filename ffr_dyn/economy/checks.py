"""Looks at a finished model from other sides: its linearised frequencies beside those of everything, and what stiffens it.

A mode driven one-way tells what is missing from a motion, not that the motion itself has a wrong frequency: a body with one
stretching mode of several vibrates too fast against what it carries. The frequencies of the linearised system show that.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ffr_dyn.analyses.evaluation import Evaluator, evaluate, evaluator
from ffr_dyn.analyses.linearise import linearise
from ffr_dyn.economy.trial import Trial, states
from ffr_dyn.errors import InputError, SimulationError
from ffr_dyn.scene import Body, Scene, markers

Array = np.ndarray

LOWEST = 6  # frequencies that are compared
LOOKED = 24  # states at which loads are looked at
INERTIAL = (
    *(f"acceleration along {c}" for c in "xyz"),
    *(f"angular acceleration about {c}" for c in "xyz"),
    *(f"spin {c}" for c in ("xx", "yy", "zz", "xy", "xz", "yz")),
)


@dataclass(frozen=True)
class Frequency:
    """A frequency [Hz] of the linearised model, and the nearest one of everything."""

    model: float
    everything: float

    @property
    def shift(self) -> float:
        """Relative difference."""
        return self.model / self.everything - 1.0


def frequencies(final: Trial, pilot: Trial) -> tuple[Frequency, ...]:
    """The lowest vibrations of the model half-way through its run, beside everything in the same position; none for a model
    without vibration."""
    middle = len(pilot.result.time) // 2
    found = [_vibrations(_scene_at(trial, middle), float(pilot.result.time[middle])) for trial in (final, pilot)]
    if not found[0].size or not found[1].size:
        return ()
    nearest = found[1][np.abs(np.log(found[1][None] / found[0][:, None])).argmin(axis=1)]
    pairs = zip(found[0], nearest, strict=True)
    return tuple(Frequency(float(own), float(other)) for own, other in pairs)[:LOWEST]


def _scene_at(trial: Trial, row: int) -> Scene:
    """The scene of a run in its state at a row."""
    bodies = [replace(body, **_state(trial, body, row)) for body in trial.scene.bodies]
    return replace(trial.scene, bodies=tuple(bodies))


def _state(trial: Trial, body: Body, row: int) -> dict[str, Any]:
    names = {"position": "R", "rotation": "p", "velocity": "v", "omega_bar": "omega_bar"}
    names |= {"q": "q", "q_dot": "q_dot"} if body.model.n else {}
    return {key: trial.result[f"{body.name}.{name}"][row] for key, name in names.items()}


def _vibrations(scene: Scene, time: float) -> Array:
    """Ascending frequencies [Hz] of what vibrates; none where nothing is free to move."""
    if not any(body.model.n for body in scene.bodies):
        return np.zeros(0)
    try:
        hertz = linearise(scene, time=time).frequencies
    except (InputError, SimulationError):
        return np.zeros(0)
    lowest = 1e-3 * min(float(body.model.frequencies.min()) for body in scene.bodies if body.model.n)
    return np.unique(np.round(hertz[hertz > lowest], 9))


@dataclass(frozen=True)
class StiffeningLoad:
    """A load and how much it changes the stiffness of a body at most: a share of that of the mode it changes most."""

    body: str
    load: str
    share: float


def stiffening_loads(trial: Trial) -> tuple[StiffeningLoad, ...]:
    """The loads on bodies whose stiffening is in the model, the largest first: accelerations, spin, forces at interfaces."""
    assembled, x, v = states(trial)
    at, time = evaluator(assembled.system), trial.result.time
    rows = np.unique(np.linspace(0, len(time) - 1, LOOKED).round().astype(int))
    loads = []
    for row in rows:
        now = evaluate(at, float(time[row]), x[row], v[row])
        loads.append([_loads(at, b, now.acceleration) for b in range(len(trial.scene.bodies))])
    found = []
    for b, body in enumerate(assembled.system.scene.bodies):
        if body.model.n and body.model.stiffening is not None and body.stiffening:
            largest = np.abs([row[b] for row in loads]).max(axis=0)
            scaled = body.model.stiffening / np.sqrt(np.outer(body.model.omega2, body.model.omega2))
            shares = largest * np.abs(np.linalg.eigvalsh(0.5 * (scaled + scaled.transpose(0, 2, 1)))).max(axis=1)
            names = (*INERTIAL, *(f"{w} {i.name} {c}" for i in body.model.interfaces for w in WHAT for c in "xyz"))
            found += [StiffeningLoad(body.name, name, float(s)) for name, s in zip(names, shares, strict=True)]
    return tuple(sorted(found, key=lambda one: -one.share))


WHAT = ("force at", "moment at")


def _loads(at: Evaluator, b: int, acceleration: Array) -> Array:
    """(12 + 6 I,) of one body at the state evaluated last, as the geometric stiffness counts them; body axes."""
    place, scene, work = at.system.layout, at.system.scene, at.work
    x, y, z = work.bodies.omega[b]
    gravity = work.bodies.A[b].T @ work.field
    inertial = [acceleration[place.R_dot(b)] - gravity, acceleration[place.omega(b)]]
    inertial.append(np.array([x * x, y * y, z * z, x * y, x * z, y * z]))
    numbers = [k for k, (owner, _, _) in enumerate(markers(scene)) if owner == b]
    at_interfaces = {k: work.markers.load[k].copy() for k in numbers}
    rows = at.system.model.rows
    for block, ends in enumerate(rows.marker):
        lines = slice(rows.start[block], rows.start[block + 1])
        for side, marker in enumerate(ends):
            if marker in at_interfaces:
                jac, lam = work.rows.jac[lines, side], work.rows.lam[lines]
                force = -lam @ jac[:, :3]
                moment = -lam @ jac[:, 3:6] - np.cross(work.markers.u[marker], force)
                at_interfaces[marker] += np.concatenate([force, moment])
    return np.concatenate([*inertial, *(at_interfaces[k] for k in numbers)])
