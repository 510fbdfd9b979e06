"""Whether the steps of a run are short enough for the forces that its method takes explicitly.

With Z the free motions of a state, Z^T M Z = 1, a force alone makes them vibrate with the roots of the eigenvalues of
Z^T K Z and decay with those of Z^T D Z, K and D less its derivatives by position and velocity.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ffr_dyn.compile.scene_tables import System
from ffr_dyn.consistency.evaluation import Evaluator, evaluate, free_motions, total_mass_matrix
from ffr_dyn.equations.forces import At
from ffr_dyn.equations.forces_at_rest import add_force, damping_of, is_load
from ffr_dyn.equations.placed import all_placed, nothing_on
from ffr_dyn.integrators import Integrator
from ffr_dyn.kernels.tables import MEASURED, USER, Record
from ffr_dyn.scene.force_kinds import forces_of
from ffr_dyn.scene.forces.force import Force
from ffr_dyn.scene.forces.places import COORDINATE, RATE, OnJoint
from ffr_prep.common.arrays import Array

REACH = (
    2.0  # h omega and h times a rate of decay that an explicit term bears in a method whose own reach is not bounded
)
BEYOND = 1.0 + 1e-6  # a step at the limit itself may be above it by rounding
MOST = 200  # velocities of a scene that is looked at, which takes a decomposition of that size


def candidates(system: System, method: Integrator) -> dict[int, Force]:
    """The forces that a method of fixed steps takes explicitly and that the state may make, by number."""
    if method.controlled or system.layout.v_size > MOST:
        return {}
    by_user = system.model.loads.row[:, USER] >= 0
    found = {k: f for k, f in enumerate(forces_of(system.scene)) if by_user[k] or not is_load(f)}
    return {k: f for k, f in found.items() if not (method.takes_forces and f.stiff_coordinates)}


def fastest(at: Evaluator, rows: Record, forces: Mapping[int, Force]) -> Array:
    """(F,) [1/s] the fastest rate that each force alone gives the scene at the last row, and where its power is largest."""
    rates = np.zeros(len(forces_of(at.system.scene)))
    for k, force in forces.items():
        for row in {rows.time.size - 1, int(np.argmax(np.abs(rows.power[:, k])))}:
            rates[k] = max(rates[k], _rate(at, rows, row, k, force))
    return rates


def told(system: System, method: Integrator, rates: Array) -> list[str]:
    """Notes on forces of these rates (F,) [1/s] that are too stiff for the step."""
    reach = method.reach if np.isfinite(method.reach) else REACH
    notes, kind = [], type(method).__name__
    for force, rate in zip(forces_of(system.scene), rates, strict=True):
        if method.step * rate > BEYOND * reach:
            other = "" if method.takes_forces or not force.stiff_coordinates else ", or ROS2"
            notes.append(
                f"force {force.name!r} is too stiff for steps of {method.step:.3g} s, in which {kind} takes it explicitly: "
                f"it gives the scene a rate of {rate:.4g} 1/s, which needs one below {reach / rate:.2g} s; use that{other}"
            )
    return notes


def _rate(at: Evaluator, rows: Record, row: int, k: int, force: Force) -> float:
    system, time, x = at.system, float(rows.time[row]), rows.x[row]
    scene, place = system.scene, system.layout
    now = At(scene, place, time, x, np.zeros(place.v_size))
    total, start = nothing_on(all_placed(now), place.v_size), int(system.model.loads.row[k, MEASURED])
    near = {force.name: float(rows.forces[row, start + COORDINATE])} if isinstance(force.place, OnJoint) else {}
    add_force(total, now, force, near, {})
    decay = damping_of(total, now, force) * _share(now, force, rows.forces[:, start:], row)
    jacobian = evaluate(at, time, x, now.v).jacobian
    Z = free_motions(jacobian, total_mass_matrix(scene, place, x))
    stiff, slow = (_largest(Z.T @ part @ Z) for part in (-total.tangent, decay))
    return max(float(np.sqrt(stiff)), slow)


def _largest(A: Array) -> float:
    return max(float(np.linalg.eigvalsh(0.5 * (A + A.T)).max(initial=0.0)), 0.0)


def _share(now: At, force: Force, measured: Array, row: int) -> float:
    """The damping of a force on a joint coordinate at its rate, over that at rest: 1 where rows pass a rest."""
    if not isinstance(force.place, OnJoint) or not force.stiff_coordinates:
        return 1.0
    rates, c = measured[:, RATE], float(measured[row, COORDINATE])
    if rates.min() <= 0 <= rates.max():
        return 1.0
    here, at_rest = (float(np.max(force.slopes(now, c, rate)[1])) for rate in (float(rates[row]), 0.0))
    return min(here / at_rest, 1.0) if at_rest > 0 else 1.0
