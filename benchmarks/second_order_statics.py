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
    princeton,
    rotor,
)
from ffr_dyn.analyses.linearise import linearise
from ffr_dyn.analyses.static import static
from ffr_dyn.analyses.states import scene_at
from ffr_dyn.consistency.assemble import assemble, in_space
from ffr_dyn.consistency.evaluation import evaluator
from ffr_dyn.consistency.tangent import chart, stiffness
from ffr_dyn.functions.time_functions import polynomial
from ffr_dyn.results.result import Result
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.model.material import Material
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
    """The worst of the seven angles, by reference conditions and number of parts: lateral, axial, Newton's steps, tangent."""
    for words, reference in REFERENCES.items():
        for parts, goal in LATERAL.items():
            found = np.array([_bent(degrees, reference, parts) for degrees in PUBLISHED])
            lateral, axial, steps = found.max(axis=0)
            who = f"Princeton beam, parts: {parts}, {words}"
            yield Figure(f"{who}: lateral", lateral, goal)
            if parts > 1:
                yield Figure(f"{who}: axial", axial, 1.5e-2)
            yield Figure(f"{who}: steps of Newton's method", steps, 6)


def _bent(degrees: int, reference: object, parts: int) -> tuple[float, float, float]:
    """Errors of the tip, lateral and axial, relative to its way, and the number of Newton's steps."""
    try:
        found = static(princeton(degrees, 8, reference, parts))  # type: ignore[arg-type]
    except (ComputationError, InputError) as error:
        print(f"    {degrees} degrees, parts: {parts}: {type(error).__name__}: {error}"[:200], flush=True)
        return np.inf, np.inf, np.inf
    tip, exact = found[f"p{parts - 1}.tip.position"][0], np.array(exact_tip(degrees))
    lateral = np.linalg.norm(tip[1:] - exact[1:]) / np.linalg.norm(exact[1:])
    axial = abs(tip[0] - exact[0]) / (PRINCETON_LENGTH - exact[0])
    return float(lateral), float(axial), _steps(found)


def _steps(found: Result) -> float:
    return float(str(found.attributes["method"]).split(",")[-1].split()[0])


def tangents() -> Iterator[Figure]:
    """At 45 degrees: steps up to 16 parts, skew part of the tangent stiffness by its size, and the time for ten parts."""
    for parts in (1, 2, 4, 8, 16):
        scene = princeton(45, 8, REFERENCES["fixed"], parts)
        try:
            found = static(scene)
        except (ComputationError, InputError) as error:
            print(f"    parts: {parts}: {type(error).__name__}: {error}"[:200], flush=True)
            continue
        yield Figure(f"Princeton beam, 45 degrees, parts: {parts}: steps of Newton's method", _steps(found), 6)
        if parts <= 4:
            yield Figure(f"Princeton beam, 45 degrees, parts: {parts}: skew part of the tangent", _skew(scene, found), 1e-9)
    scene = princeton(45, 8, REFERENCES["fixed"], 10)
    began = time.perf_counter()
    try:
        static(scene)
    except (ComputationError, InputError) as error:
        print(f"    {type(error).__name__}: {error}"[:200], flush=True)
    yield Figure("Princeton beam, 45 degrees, ten parts [s]", time.perf_counter() - began, 1.0)


def _skew(scene: Scene, found: Result) -> float:
    assembled = assemble(in_space(scene_at(scene, found)))
    K, _ = stiffness(chart(evaluator(assembled.system), 0.0, assembled.x, np.zeros(assembled.system.layout.v_size)))
    return float(np.abs(K - K.T).max() / np.abs(K).max())


def cantilevers() -> Iterator[Figure]:
    """Lag and flap of a cantilever in steady rotation about its root, in the plane of rotation and across it."""
    section = with_mass_moments(general("rod", A=1.0, Iy=1.00002e-6, Iz=1e-6, J=1e-6), 1e-9, 0.0)
    material = Material("steel", 2e11, 0.3, 7870.0)
    unit = float(np.sqrt(material.E * 1e-6 / material.rho))
    for words, reference in REFERENCES.items():
        body = beam(section, material, 1.0, 14, reference)
        for eta, (flap, goal) in FLAP.items():
            found = linearise(rotor(body, polynomial(0.0, eta * unit), eta * unit))
            lag, other = _two_lowest(found.eigenvalues) / unit
            yield Figure(f"rotating cantilever, {words}, speed {eta}: lag", abs(lag / np.sqrt(flap**2 - eta**2) - 1), goal)
            yield Figure(f"rotating cantilever, {words}, speed {eta}: flap", abs(other / flap - 1), goal)


def _two_lowest(eigenvalues: Array) -> Array:
    vibrating = np.sort(eigenvalues.imag[eigenvalues.imag > 0])
    return vibrating[:2] if vibrating.size > 1 else np.full(2, np.nan)


CASES: dict[str, Callable[[], Iterator[Figure]]] = {
    "princeton-table": princeton_table,
    "princeton": princetons,
    "tangent": tangents,
    "cantilever": cantilevers,
}
