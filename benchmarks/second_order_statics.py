"""The static and linearised cases of `benchmarks.second_order`: Princeton beam, rotating cantilever."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from functools import cache

import numpy as np

from benchmarks.exact_beam import bent
from benchmarks.preparation import Figure
from benchmarks.second_order_scenes import (
    PRINCETON,
    PRINCETON_FORCE,
    PRINCETON_LENGTH,
    PRINCETON_SECTION,
    REFERENCES,
    beam,
    measured,
    princeton,
    rotor,
)
from ffr_dyn.analyses.linearise import linearise
from ffr_dyn.analyses.states import scene_at
from ffr_dyn.analyses.static import static
from ffr_dyn.consistency.validity import parts_needed
from ffr_dyn.functions.time_functions import polynomial
from ffr_dyn.results.result import Result
from ffr_dyn.scene.scene import Scene
from ffr_prep.model.material import Material
from ffr_prep.model.reference import ReferenceConditions
from ffr_prep.structures.sections import general, with_mass_moments

Array = np.ndarray

# Tip of the Princeton beam along the height and across it [mm] by the angle of the force: an ANSYS beam in Obrezkov et al.,
# Nonlinear Dyn. 109 (2022); experiment: Dowell & Traybar; Bauchau et al., Multibody Syst. Dyn. 37 (2016) 29-48.
PUBLISHED = {
    0: (10.71417630, 0.0),
    15: (10.61328706, 42.08232124),
    30: (10.11169630, 79.39482948),
    45: (8.837226265, 108.987937),
    60: (6.604665004, 129.887616),
    75: (3.538889001, 142.194370),
    90: (0.0, 146.245978),
}
MODES = 12
LATERAL = {1: 1.5e-2, 2: 6e-3, 4: 1.5e-3}
# First flap frequency by the speed, in sqrt(EI/rho A L^4): series in twelve digits, agrees with Wright, Smith, Thresher &
# Wang, J. Appl. Mech. 49 (1982) 197-202; lag: mu^2 = flap^2 - eta^2
FLAP = {3: (4.7972785324, 1e-4), 6: (7.3603730193, 1e-4), 12: (13.170150488, 2e-3)}


@cache
def exact_tip(degrees: int) -> tuple[float, float, float]:
    """Tip of the Princeton beam [m] by `benchmarks.exact_beam.bent`."""
    s, E, G = PRINCETON_SECTION, PRINCETON.E, PRINCETON.E / (2 * (1 + PRINCETON.nu))
    angle = np.radians(degrees)
    force = PRINCETON_FORCE * np.array([0.0, np.cos(angle), np.sin(angle)])
    axial, turning = (E * s.A, G * s.A * s.ky, G * s.A * s.kz), (G * s.J, E * s.Iy, E * s.Iz)
    x, y, z = bent(PRINCETON_LENGTH, axial, turning, force)
    return float(x), float(y), float(z)


def princeton_table() -> Iterator[Figure]:
    """The spatial exact beam itself, against the published beam."""
    for degrees, (y, z) in PUBLISHED.items():
        tip = 1e3 * np.array(exact_tip(degrees)[1:])
        off = np.linalg.norm(tip - (y, z)) / np.linalg.norm((y, z))
        yield Figure(f"exact beam against the published one, {degrees} degrees", float(off), 3e-3)


def princetons() -> Iterator[Figure]:
    """The worst of the seven angles, by reference conditions and number of parts: lateral, axial, Newton's steps."""
    for words, reference in REFERENCES.items():
        for parts, goal in LATERAL.items():
            goals = {"lateral": goal, "steps of Newton's method": 6}
            if parts > 1:
                goals["axial"] = 1.5e-2
            yield from measured(f"Princeton beam, parts: {parts}, {words}", goals, _worst, reference, parts, len(goals))


def _worst(reference: ReferenceConditions, parts: int, count: int) -> tuple[float, ...]:
    """Errors of the tip relative to its way, lateral, and axial at last, between them the number of Newton's steps."""
    found = []
    for degrees in PUBLISHED:
        at_rest = static(princeton(degrees, MODES, reference, parts))
        off = at_rest["beam.tip.position"][0] - (exact := np.array(exact_tip(degrees)))
        lateral = np.linalg.norm(off[1:]) / np.linalg.norm(exact[1:])
        found.append((lateral, _steps(at_rest), abs(off[0]) / (PRINCETON_LENGTH - exact[0])))
    return tuple(np.max(found, axis=0)[:count])


def _steps(found: Result) -> float:
    return float(str(found.attributes["method"]).split(",")[-1].split()[0])


def tangents() -> Iterator[Figure]:
    """At 45 degrees: steps up to 16 parts, skew part of the tangent stiffness by its size, and the time for ten parts."""

    def steps_and_skew(parts: int, count: int) -> tuple[float, ...]:
        scene = princeton(45, MODES, REFERENCES["fixed"], parts)
        found = static(scene)
        return (_steps(found), _skew(scene_at(scene, found)) if count > 1 else 0.0)[:count]

    def seconds() -> tuple[float]:
        scene = princeton(45, MODES, REFERENCES["fixed"], 10)
        began = time.perf_counter()
        static(scene)
        return (time.perf_counter() - began,)

    for parts in (1, 2, 4, 8, 16):
        goals = {"steps of Newton's method": 6.0} | ({"skew part of the tangent": 1e-9} if parts <= 4 else {})
        yield from measured(f"Princeton beam, 45 degrees, parts: {parts}", goals, steps_and_skew, parts, len(goals))
    yield from measured("Princeton beam, 45 degrees, ten parts", {"time of statics [s]": 1.0}, seconds)


def _skew(at_rest: Scene) -> float:
    """Of the stiffness in coordinates of unit mass."""
    A = linearise(at_rest).A
    K = A[len(A) // 2 :, : len(A) // 2]
    return float(np.abs(K - K.T).max() / np.abs(K).max())


def cantilevers() -> Iterator[Figure]:
    """Lag and flap of a cantilever in steady rotation about its root, in the plane of rotation and across it."""
    section = with_mass_moments(general("rod", A=1.0, Iy=1.00002e-6, Iz=1e-6, J=1e-6), 1e-7, 0.0)
    material = Material("steel", 2e11, 0.3, 7870.0)
    unit = float(np.sqrt(material.E * 1e-6 / material.rho))

    def errors(reference: ReferenceConditions, eta: float, flap: float) -> tuple[float, float]:
        body = beam(section, material, 1.0, 20, reference)
        found = linearise(rotor(body, polynomial(0.0, eta * unit), eta * unit)).eigenvalues.imag / unit
        lag, other = np.sort(found[found > 0])[:2]
        return abs(lag / np.sqrt(flap**2 - eta**2) - 1), abs(other / flap - 1)

    for words, reference in REFERENCES.items():
        for eta, (flap, goal) in FLAP.items():
            who = f"rotating cantilever, {words}, speed {eta}"
            yield from measured(who, {"lag": goal, "flap": goal}, errors, reference, eta, flap)


def told() -> Iterator[Figure]:
    """The number of parts that the note of a first run in one piece names, and what the beam reaches with so many."""

    def advised() -> tuple[float, ...]:
        scene = princeton(90, MODES, REFERENCES["mean"], 1)
        in_one_piece = static(scene)
        parts = parts_needed(scene, in_one_piece)["beam"]
        notes = [note for note in in_one_piece.attributes["notes"] if f"{parts} parts would do" in note]
        off = static(princeton(90, MODES, REFERENCES["mean"], parts))["beam.tip.position"][0] - exact_tip(90)
        return 1 - len(notes), parts, np.linalg.norm(off) / exact_tip(90)[2]

    goals = {"deflections not told": 0.0, "parts that would do": 4.0, "error of the tip with these": 1e-3}
    yield from measured("Princeton beam, 90 degrees, one body", goals, advised)


CASES: dict[str, Callable[[], Iterator[Figure]]] = {
    "princeton-table": princeton_table,
    "princeton": princetons,
    "tangent": tangents,
    "told": told,
    "cantilever": cantilevers,
}
