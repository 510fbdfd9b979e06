"""Looks at a finished model from other sides: linearised frequencies beside those of the full model, and what stiffens it.

A mode driven one-way tells what is missing from a motion, not that the motion itself has a wrong frequency: a body with one
stretching mode of several vibrates too fast against what it carries. The frequencies of the linearised system show that.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, eigvalsh, null_space

from ffr_dyn.compile.body_tables import of_coordinates
from ffr_dyn.compile.scene_tables import System
from ffr_dyn.consistency.evaluation import evaluate, evaluated_mass_matrix, evaluator
from ffr_dyn.consistency.second_order_loads import loads_at
from ffr_dyn.economy.model_choice import Choice, bases_between
from ffr_dyn.economy.outputs import STRESS, Probe
from ffr_dyn.economy.policy import DEFAULT, Policy
from ffr_dyn.economy.residual_estimate import elastic_columns, lift
from ffr_dyn.economy.run import Made, Trial, states
from ffr_dyn.functions.time_functions import evaluate as evaluate_function
from ffr_dyn.results.result import Result
from ffr_dyn.results.stress_error import missing_stress
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import left_out_stress
from ffr_prep.common.arrays import Array

INERTIAL = (
    *(f"acceleration along {c}" for c in "xyz"),
    *(f"angular acceleration about {c}" for c in "xyz"),
    *(f"spin {c}" for c in ("xx", "yy", "zz", "xy", "xz", "yz")),
)


@dataclass(frozen=True)
class Frequency:
    """A frequency [Hz] of the linearised model, and the nearest one of the full model."""

    model: float
    everything: float

    @property
    def shift(self) -> float:
        """Relative difference."""
        return self.model / self.everything - 1.0


def stress_doubts(final: Trial, original: Scene, of: Probe, limits: Array) -> tuple[str, ...]:
    """Notes on outputs of stress that lack more than their tolerance in the full model already: what its shapes leave out."""
    bodies = {f"{body.name}.{STRESS}": body for body in original.bodies}
    asked = [(output.name, limit) for output, limit in zip(of.outputs, limits, strict=True) if output.name in bodies]
    missing = [(name, limit, _missing(final.result, original, bodies[name])) for name, limit in asked]
    return tuple(
        f"output {name!r}: the shapes of the full model leave out up to {lacks:.2g} Pa of the stress of its own inertia, "
        f"{lacks / limit:.2g} tolerances, which no error here counts; add the shapes of such loads "
        "(`--method craig-bampton --method inertia-relief`; InertiaRelief() in a Union)"
        for name, limit, lacks in missing
        if lacks > limit
    )


def _missing(result: Result, original: Scene, body: Body) -> float:
    left_out = left_out_stress(body.model.provenance)
    if not left_out:
        return 0.0
    base = [[evaluate_function(f, t)[0] for f in original.base_acceleration] for t in result.time]
    return missing_stress(result, body.name, np.array(left_out), original.gravity - np.array(base)) or 0.0


def frequencies(final: Trial, made: Made, everything: Choice, original: Scene, policy: Policy) -> tuple[Frequency, ...]:
    """The lowest vibrations of the model half-way through its run, beside the full model in the same position; none for one
    without vibration. Of small motions about that position, with the stiffness and the inertia there, without rates."""
    if not final.choice.count:
        return ()
    x, v = states(final)
    middle = len(x) // 2
    time, small, large = float(final.result.time[middle]), final.made.assembled.system, made.assembled.system
    bases = bases_between(original, final.choice, everything)
    lifted = lift(small.layout, large.layout, bases, x[middle : middle + 1], v[middle : middle + 1])
    own, whole = (
        _vibrations(system, time, *at, policy.rigid_frequency)
        for system, at in ((small, (x[middle], v[middle])), (large, (lifted[0][0], lifted[1][0])))
    )
    if not own.size or not whole.size:
        return ()
    nearest = whole[np.abs(np.log(whole[None] / own[:, None])).argmin(axis=1)]
    shown = list(zip(own, nearest, strict=True))[: policy.shown_frequencies]
    return tuple(Frequency(float(one), float(other)) for one, other in shown)


def _vibrations(system: System, time: float, x: Array, v: Array, slow: float) -> Array:
    """Ascending frequencies [Hz] of small motions that keep the joints closed."""
    at, place = evaluator(system), system.layout
    now = evaluate(at, time, x, v)
    elastic, Z = elastic_columns(place), null_space(now.jacobian)
    omega2 = of_coordinates(system.model.bodies, system.model.bodies.omega2)
    stiffness = Z[elastic].T @ (omega2[:, None] * Z[elastic])
    try:
        squares = eigvalsh(stiffness, Z.T @ evaluated_mass_matrix(at) @ Z)
    except LinAlgError:  # an inertia that is not positive, with terms left out
        return np.zeros(0)
    lowest = slow * float(np.sqrt(omega2.min(initial=np.inf)))
    found: Array = np.sqrt(squares[squares > lowest**2]) / (2 * np.pi)
    return found


@dataclass(frozen=True)
class StiffeningLoad:
    """A load and how much it changes the stiffness of a body at most: a share of that of the mode it changes most."""

    body: str
    load: str
    share: float


def stiffening_loads(trial: Trial, policy: Policy = DEFAULT) -> tuple[StiffeningLoad, ...]:
    """The loads on bodies whose stiffening is in the model, the largest first: spin, forces at interfaces."""
    (x, v), assembled = states(trial), trial.made.assembled
    bodies = [b for b, body in enumerate(assembled.system.scene.bodies) if _stiffened(body)]
    if not bodies:
        return ()
    at, time = evaluator(assembled.system), trial.result.time
    rows = np.unique(np.linspace(0, len(time) - 1, policy.load_samples).round().astype(int))
    loads = []
    for row in rows:
        evaluate(at, float(time[row]), x[row], v[row])
        here = loads_at(at, float(time[row]), x[row], v[row])
        loads.append([here[b] for b in bodies])
    found = []
    for k, b in enumerate(bodies):
        body = assembled.system.scene.bodies[b]
        if body.model.stiffening is not None:
            largest = np.abs([row[k] for row in loads]).max(axis=0)[: len(body.model.stiffening)]
            scaled = body.model.stiffening / np.sqrt(np.outer(body.model.omega2, body.model.omega2))
            shares = largest * np.abs(np.linalg.eigvalsh(0.5 * (scaled + scaled.transpose(0, 2, 1)))).max(axis=1)
            names = load_names(body)
            found += [StiffeningLoad(body.name, name, float(s)) for name, s in zip(names, shares, strict=True)]
    return tuple(sorted(found, key=lambda one: -one.share))


def load_names(body: Body) -> tuple[str, ...]:
    """The names of the loads that stiffen a body, by number."""
    return (
        *INERTIAL,
        *(f"{what} {i.name} {c}" for i in body.model.interfaces for what in ("force at", "moment at") for c in "xyz"),
    )


def _stiffened(body: Body) -> bool:
    return bool(body.model.n) and body.model.stiffening is not None and body.stiffening
