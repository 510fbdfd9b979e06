"""Static equilibrium: where a scene stays at rest under gravity, loads and springs, its drivers held still.

How it is found, `ffr_dyn.analyses.equilibria.equilibrium` says. In minimal coordinates of unit mass the tangent stiffness
tells what holds the scene there: a motion without stiffness is held by nothing, one of negative stiffness is unstable.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ffr_dyn.analyses.equilibria.equilibrium import Equilibrium, equilibrium, jumped
from ffr_dyn.analyses.integration import with_all_reactions
from ffr_dyn.analyses.outcome import needed, result_of, turned_along
from ffr_dyn.analyses.registry import OfMoment
from ffr_dyn.analyses.settings import MomentSettings
from ffr_dyn.analyses.states import held
from ffr_dyn.consistency.assemble import Assembled, assemble, seen_in_space
from ffr_dyn.consistency.doubts import checked
from ffr_dyn.consistency.evaluation import (
    Evaluator,
    copied,
    evaluate,
    evaluator,
    free_motions,
    joined,
    record_states,
    total_mass_matrix,
)
from ffr_dyn.consistency.mobility import counted, named_motion, rigid_freedom
from ffr_dyn.consistency.tangent import sizes
from ffr_dyn.kernels.tables import EVALUATIONS
from ffr_dyn.results.quantities import selected
from ffr_dyn.results.result import Result
from ffr_dyn.scene.described import described
from ffr_dyn.scene.force_kinds import forces_of
from ffr_dyn.scene.scene import Scene, length_of
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError, InputError

NEUTRAL = 1e-7  # of a stiffness, relative to that of the applied forces
ROUNDING = 1e-13  # of a stiffness, relative to the largest
SYMMETRIC = 1e-12  # of what a stiffness matrix is off symmetry, relative to its largest entry
MET = 1e-6  # of the imaginary part of an eigenvalue, beyond which two have met


@dataclass(frozen=True)
class Static(OfMoment):
    """The drivers are held still, and so is what depends on the time.

    >>> result = fd.run(scene, fd.MomentSettings(analysis=fd.Static()))
    """

    def perform(self, scene: Scene, settings: MomentSettings, **how: Any) -> Result:
        return static(scene, **settings.span, **how)


def static(
    scene: Scene, *, time: float = 0.0, outputs: Sequence[str] = ("default",), path: str | Path | None = None
) -> Result:
    """The equilibrium of a scene at `time` [s] that is downhill from its start: one row, with all reactions.

    outputs : names or patterns of the quantities to keep beside the efforts, as in `forward`

    The attributes tell whether it is stable (the tangent stiffness of the free motions is positive definite) and its lowest
    stiffness per mass [1/s^2].

    Raises InputError for a motion that nothing holds, with its name; ComputationError when no equilibrium is found.

    >>> result = fd.static(scene)
    """
    assembled = assemble(seen_in_space(held(scene, time)), time=time)
    selected(assembled.system, needed(scene, outputs))
    at = evaluator(assembled.system)
    widths = _widths(at, assembled.x)
    found = equilibrium(assembled.system, time, assembled.x, widths, partial(_is_mechanism, assembled, time))
    lowest, flutter = _lowest_stiffness(at, assembled, found, time)
    branch = jumped(assembled.system, time, assembled.x, widths, found)
    return _result(scene, assembled, at, found, time, (lowest, flutter, branch), outputs, path)


def _is_mechanism(assembled: Assembled, time: float) -> bool:
    """Whether its bodies can move without being deformed."""
    return rigid_freedom(assembled.system.scene, assembled, time) > 0


def _widths(at: Evaluator, x: Array) -> Array:
    """(V,) what counts as a step of one: as `sizes`, but the places of bodies, which move by as much as all of them together
    reach, or as they are apart."""
    scene, place, widths = at.system.scene, at.system.layout, sizes(at)
    places = np.array([x[place.R(b)] for b in range(len(place.n))])
    apart = float(np.linalg.norm(np.ptp(places, axis=0))) + length_of(scene)
    together = sum(body.model.size for body in scene.bodies)
    for b in range(len(place.n)):
        widths[place.R_dot(b)] = max(length_of(scene), min(apart, together))
    return widths


def _lowest_stiffness(at: Evaluator, assembled: Assembled, found: Equilibrium, time: float) -> tuple[float, float]:
    """[1/s^2] per mass, of the free motions; infinite where there is none; and the frequency [Hz] of flutter, or zero.

    InputError for a motion that nothing holds.
    """
    x = found.path[-1]
    M = total_mass_matrix(at.system.scene, at.system.layout, x if found.found else found.path[0])
    Z = free_motions(found.balance.jacobian, M)
    if not Z.shape[1]:
        return float("inf"), 0.0
    K = Z.T @ found.balance.stiffness @ Z
    values, vectors = np.linalg.eigh(0.5 * (K + K.T))
    applied = np.linalg.solve(M, found.balance.forces) / sizes(at)
    limit = NEUTRAL * np.abs(applied).max() + ROUNDING * np.abs(values).max()
    if not found.found and values[0] > limit:
        motion = named_motion(at.system.scene, at.system.layout, x, Z @ np.linalg.solve(K, Z.T @ found.balance.forces))
        raise ComputationError(
            f"no equilibrium was found in {len(found.steps)} steps, though what moves is held: the start is too far from "
            f"one, or a force jumps, has a kink or a pole near there, along {motion}; start nearer to an equilibrium, or "
            "look at the forces and formulas that act on it"
        )
    if not found.found and _is_mechanism(assembled, time):
        tried = f"no equilibrium was found in {len(found.steps)} steps"
        raise _not_held(
            assembled, time, x, Z @ vectors[:, 0], tried, " where they ended", " (or run forward with damping)"
        )
    if not found.found:
        motion = named_motion(at.system.scene, at.system.layout, x, Z @ vectors[:, 0])
        raise ComputationError(
            f"no equilibrium was found in {len(found.steps)} steps: bodies or springs buckle along {motion}; of loads "
            f"that grow, {found.borne:.2g} of their size have one; use smaller loads, or run forward with damping"
        )
    if not (symmetric := bool(np.abs(K - K.T).max() <= SYMMETRIC * np.abs(K).max())):
        values, vectors = np.linalg.eig(K)  # the symmetric part says nothing then, of what holds and of stability
    loose = int(np.argmin(np.abs(values)))
    if abs(values[loose]) <= limit:
        raise _not_held(assembled, time, x, Z @ vectors[:, loose].real, "the equilibrium is not determined")
    return (float(values[0]), 0.0) if symmetric else _with_flutter(values)


def _with_flutter(values: Array) -> tuple[float, float]:
    """The lowest eigenvalue of a stiffness matrix, and the frequency [Hz] at which it flutters, or zero.

    Forces without a potential leave the matrix unsymmetric; a vibration grows where two eigenvalues have met and are complex.
    """
    largest = np.abs(values).max()
    met = values[np.abs(values.imag) > MET * np.abs(values) + SYMMETRIC * largest].astype(complex)
    frequencies = np.abs(np.sqrt(-met).imag) / (2 * np.pi)
    return float(values.real.min()), float(frequencies.min()) if met.size else 0.0


def _not_held(
    assembled: Assembled, time: float, x: Array, direction: Array, what: str, there: str = "", otherwise: str = ""
) -> InputError:
    system = assembled.system
    motion = named_motion(system.scene, system.layout, x, direction)
    rigid = rigid_freedom(system.scene, assembled, time)
    counts = counted(assembled.degrees_of_freedom, rigid, sum(system.layout.n), len(assembled.redundant))
    slides = [text for force in forces_of(system.scene) if (text := force.at_rest(0.0))]
    return InputError(
        f"{what}: nothing holds the motion {motion}{there}; add a joint, a driver or a spring that does, or start nearer to "
        f"an equilibrium{otherwise} ({'; '.join([counts, *slides])})"
    )


def _result(
    scene: Scene,
    assembled: Assembled,
    at: Evaluator,
    found: Equilibrium,
    time: float,
    seen: tuple[float, float, str],
    outputs: Sequence[str],
    path: str | Path | None,
) -> Result:
    still = np.zeros(assembled.system.layout.v_size)
    way = []
    for x in found.path[:-1]:  # angles count their turns on it, those of forces and of joints
        evaluate(at, time, x, still)
        way.append(copied(at.record))
    evaluate(at, time, found.path[-1], still)
    near = turned_along(at.system, joined([*way, copied(at.record)]), [-1])
    record = with_all_reactions(assembled, record_states(at, np.array([time]), found.path[-1:], still[None]))
    lowest, flutter, branch = seen
    stable = lowest > 0 and not flutter
    notes = [*assembled.notes, *checked("static", assembled, record), *([branch] if branch else [])]
    notes += [text for force in forces_of(assembled.system.scene) if (text := force.at_rest(0.0))]
    if flutter:
        notes.append(f"the equilibrium is unstable: without damping it flutters, at {flutter:.4g} Hz")
    elif not stable:
        notes.append(f"the equilibrium is unstable: its lowest stiffness per mass is {lowest:.4g} 1/s^2")
    attributes = {
        **described(scene),
        "analysis": "static equilibrium",
        "method": f"Newton's method, {len(found.steps)} steps"
        + f" in {found.load_steps} load steps" * (found.load_steps > 1)
        + ", at the end from where the scene rests that is let go" * found.relaxed,
        "evaluations": int(at.work.info[EVALUATIONS]),
        "degrees_of_freedom": assembled.degrees_of_freedom,
        "stable": int(stable),
        "lowest_stiffness": lowest if np.isfinite(lowest) else None,
        "notes": notes,
        "status": "complete",
    }
    attributes = {key: value for key, value in attributes.items() if value is not None}
    return result_of(assembled.system, record, attributes, path, outputs, near)
