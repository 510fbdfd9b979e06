"""The motions in `benchmarks.second_order`: pendulum, slider-crank, spin-up against geometrically exact beams."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from benchmarks.exact_beam import spinning
from benchmarks.preparation import Figure
from benchmarks.second_order_scenes import IN_PLANE, REFERENCES, STRIP, beam, measured, pendulum, rotor, slider_crank
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.functions.time_functions import user
from ffr_dyn.integrators import ROS3
from ffr_dyn.scene.scene import Scene
from ffr_prep.model.material import Material
from ffr_prep.model.reference import ReferenceConditions
from ffr_prep.structures.sections import Section

Array = np.ndarray

TABLES = Path(__file__).resolve().parent.parent / "tests" / "reference"
# Tables of the pendulum and their columns of the tip; the largest offset of the tip from the root's tangent [m]
EXACT = {7e10: ("pendulum_exact.csv", 1), 7e9: ("pendulum_soft_exact.csv", 1), 7e8: ("pendulum_soft_exact.csv", 4)}
LARGEST = {7e10: 5.834e-3, 7e9: 5.842e-2}
SPIN_UP = Section("beam", A=1.0, Iy=5e-4, Iz=5e-4, J=1e-3, ky=1e7 * 2.6 / 2.8e7, kz=1e7 * 2.6 / 2.8e7)


def tracked(scene: Scene, end: float, output_step: float, step: float) -> tuple[Array, Array]:
    """(T, 3) tip of the beam [m], (T,) how far its middle lies to the left of the way from root to tip, in the plane [m]."""
    names = [f"beam.{name}.position" for name in ("root", "tip", "above", "below")]
    found = integrate(scene, end=end, output_step=output_step, method=ROS3(step), outputs=names)
    root, tip, above, below = (found[name] for name in names)
    chord, offset = tip - root, (above + below - root - tip) / 2
    left: Array = (chord[:, 0] * offset[:, 1] - chord[:, 1] * offset[:, 0]) / np.linalg.norm(chord, axis=1)
    return tip, left


def swing(E: float, step: float, scene: Scene) -> tuple[float, float, float]:
    """Largest over 2 s: distance of the tip from the exact one, error of the middle's offset, the exact offset [m]."""
    tip, middle = tracked(scene, 2.0, 0.01, step)
    name, column = EXACT[E]
    x, y, exact = np.loadtxt(TABLES / name, delimiter=",").T[column : column + 3]
    return np.hypot(tip[:, 0] - x, tip[:, 1] - y).max(), np.abs(middle - exact).max(), np.abs(exact).max()


def pendulums() -> Iterator[Figure]:
    """Tip relative to its largest deflection from the root's tangent, middle to its largest from the chord."""

    def errors(
        E: float, modes: int, section: Section, step: float, reference: ReferenceConditions
    ) -> tuple[float, float]:
        tip, middle, sag = swing(E, step, pendulum(E, modes, reference, section=section))
        return tip / LARGEST[E], middle / sag

    cases = ((7e9, 8, STRIP, 5e-5, (3e-3, 6e-3)), (7e10, 16, IN_PLANE, 2.5e-5, (1e-3, 1.5e-3)))
    for E, modes, section, step, goals in cases:
        for words, reference in REFERENCES.items():
            who = f"pendulum E = {E:g}, {modes} modes, {words}"
            yield from measured(
                who, dict(zip(("tip", "middle"), goals, strict=True)), errors, E, modes, section, step, reference
            )


def soft_pendulums() -> Iterator[Figure]:
    """E = 7e8: a tip that lags by 0.47 m of 1.2 m, by the number of parts."""

    def error(reference: ReferenceConditions, parts: int) -> tuple[float]:
        return swing(7e8, 2.5e-4, pendulum(7e8, 8, reference, parts))[:1]

    for words, reference in REFERENCES.items():
        for parts, goal in ((1, 2.5e-2), (2, 2e-3), (4, 5e-4), (8, 1e-4)):
            who = f"pendulum E = 7e8, parts: {parts}, {words}"
            yield from measured(who, {"tip [m]": goal}, error, reference, parts)


def slider_cranks() -> Iterator[Figure]:
    """Middle of the rod over 0.084 s, relative to its peak; rigid crank at 150 rad/s."""
    exact = np.loadtxt(TABLES / "slider_crank_exact.csv", delimiter=",")[:, 1]

    def error(reference: ReferenceConditions, parts: int) -> tuple[float]:
        _, middle = tracked(slider_crank(8, reference, parts), 0.084, 4e-4, 2.5e-6)
        return (np.abs(middle[: exact.size] - exact).max() / exact.max(),)

    for words, reference in REFERENCES.items():
        for parts, goal in ((1, 4e-3), (2, 1e-3), (4, 1e-3)):
            goals = {"middle of the rod": goal}
            yield from measured(f"slider-crank, parts: {parts}, {words}", goals, error, reference, parts)


def spin_up() -> Iterator[Figure]:
    """Tip in turning axes up to 10 s; Simo & Vu-Quoc; Wu & Haug, Int. J. Numer. Meth. Engng 26 (1988) 2211-2226: L = 10 m,
    spun up to 6 rad/s in 15 s."""
    _, axial, lateral = np.loadtxt(TABLES / "spin_up_exact.csv", delimiter=",")[:101].T
    outputs = ["beam.tip.position"]

    def errors(reference: ReferenceConditions) -> tuple[float, float]:
        body = beam(SPIN_UP, Material("beam", 2.8e7, 0.3, 1.2), 10.0, 6, reference)
        found = integrate(rotor(body, user(spinning)), end=10.0, output_step=0.1, method=ROS3(1e-3), outputs=outputs)
        angle = np.array([spinning(t)[0] for t in found.time])
        (x, y, _), c, s = found[outputs[0]].T, np.cos(angle), np.sin(angle)
        off = np.abs(c * x + s * y - 10.0 - axial)
        return np.abs(c * y - s * x - lateral).max() / np.abs(lateral).max(), off[68]

    for words, reference in REFERENCES.items():
        yield from measured(f"spin-up, {words}", {"lateral": 5e-4, "axial at 6.8 s [m]": 1e-4}, errors, reference)


CASES: dict[str, Callable[[], Iterator[Figure]]] = {
    "pendulum": pendulums,
    "parts": soft_pendulums,
    "slider-crank": slider_cranks,
    "spin-up": spin_up,
}
