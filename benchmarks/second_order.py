"""What bodies with second-order displacement reach: against geometrically exact beams, and the laws that they must hold.

    python -m benchmarks.second_order [case ...]

prints a line for every figure with its goal, and ends with code 1 if one is missed. Without arguments all cases but those of
`LONG` are run. References are exact beams (`benchmarks.exact_beam`, checked and computed again by its own `main`), published
tables and closed forms; each stands with its case. Bodies are reduced under three reference conditions: fixed at an end,
simply supported at both, mean axis. A case that stops with an error is a line too.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from benchmarks import second_order_laws as laws
from benchmarks import second_order_statics as statics
from benchmarks.exact_beam import spinning
from benchmarks.preparation import Figure
from benchmarks.second_order_scenes import REFERENCES, beam, pendulum, places, rotor, slider_crank
from ffr_dyn.analyses.forward import forward
from ffr_dyn.functions.time_functions import user
from ffr_dyn.integrators import ROS3
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.model.material import Material
from ffr_prep.structures.sections import Section

Array = np.ndarray

TABLES = Path(__file__).resolve().parent.parent / "tests" / "reference"
# Largest offset of the tip from the root's tangent [m]; first row of the table of the motion
LARGEST = {7e10: 5.834e-3, 7e9: 5.842e-2}
COLUMNS = {7e10: ("pendulum_exact.csv", 1), 7e9: ("pendulum_soft_exact.csv", 1), 7e8: ("pendulum_soft_exact.csv", 4)}
SPIN_UP = Section("beam", A=1.0, Iy=5e-4, Iz=5e-4, J=1e-3, ky=1e7 * 2.6 / 2.8e7, kz=1e7 * 2.6 / 2.8e7)


def offsets(first: Array, last: Array, between: Array) -> Array:
    """(T,) how far a marker lies to the left of the way from the first to the last one, in the plane [m]."""
    chord, offset = last - first, between - (first + last) / 2
    left: Array = (chord[:, 0] * offset[:, 1] - chord[:, 1] * offset[:, 0]) / np.linalg.norm(chord, axis=1)
    return left


def tracked(scene: Scene, parts: int, end: float, output_step: float, step: float) -> tuple[Array, Array, Array]:
    """(T, 3) root, tip and middle [m] of a beam in parts."""
    names = [f"{name}.position" for name in places(parts)]
    found = forward(scene, end=end, output_step=output_step, method=ROS3(step), outputs=names)
    root, tip, *between = (found[name] for name in names)
    return root, tip, np.mean(between, axis=0)


def swing(E: float, modes: int, words: str, parts: int, step: float) -> tuple[Array, Array]:
    """Distances of the tip from the exact one and of the middle's offset from the exact one [m], over 2 s."""
    scene = pendulum(E, modes, REFERENCES[words], parts)
    root, tip, between = tracked(scene, parts, 2.0, 0.01, step)
    name, column = COLUMNS[E]
    exact = np.loadtxt(TABLES / name, delimiter=",")[:, column : column + 3]
    return np.linalg.norm(tip[:, :2] - exact[:, :2], axis=1), np.abs(offsets(root, tip, between) - exact[:, 2])


def pendulums() -> Iterator[Figure]:
    """Relative to the largest deflection of the tip from the root's tangent, and of the middle from the chord."""
    for E, modes, step, goals in ((7e9, 8, 5e-5, (3e-3, 6e-3)), (7e10, 16, 2.5e-5, (1e-3, 1.5e-3))):
        name, column = COLUMNS[E]
        sag = np.abs(np.loadtxt(TABLES / name, delimiter=",")[:, column + 2]).max()
        for words in REFERENCES:
            who = f"pendulum E = {E:g}, {modes} modes, {words}"
            for what, goal, found in caught(
                lambda E=E, modes=modes, words=words, step=step: swing(E, modes, words, 1, step), goals, ("tip", "middle")
            ):
                yield Figure(f"{who}: {what}", found / {"tip": LARGEST[E], "middle": sag}[what], goal)


def soft_pendulums() -> Iterator[Figure]:
    """E = 7e8: a tip that lags by 0.47 m of 1.2 m, by the number of parts."""
    for words in REFERENCES:
        for parts, goal in ((1, 2.5e-2), (2, 2e-3), (4, 5e-4), (8, 1e-4)):
            for _, _, found in caught(
                lambda words=words, parts=parts: swing(7e8, 8, words, parts, 2.5e-4)[:1], (goal,), ("tip",)
            ):
                yield Figure(f"pendulum E = 7e8, parts: {parts}, {words}: tip [m]", found, goal)


def cranked(modes: int, words: str, parts: int) -> tuple[Array]:
    """Distance of the rod's offset from the exact one, over 0.084 s, relative to its peak."""
    scene = slider_crank(modes, REFERENCES[words], parts)
    exact = np.loadtxt(TABLES / "slider_crank_exact.csv", delimiter=",")[:, 1]
    w = offsets(*tracked(scene, parts, 0.084, 4e-4, 2.5e-6))
    return (np.abs(w - exact)[: exact.size] / exact.max(),)


def slider_cranks() -> Iterator[Figure]:
    """Middle of the rod, relative to its peak; rigid crank at 150 rad/s."""
    for words in REFERENCES:
        for parts, goal in ((1, 4e-3), (2, 1e-3), (4, 1e-3)):
            for _, _, found in caught(
                lambda words=words, parts=parts: cranked(8, words, parts), (goal,), ("middle",)
            ):
                yield Figure(f"slider-crank, parts: {parts}, {words}: middle of the rod", found, goal)


def spun(words: str) -> tuple[Array, Array]:
    """Lateral deviation from the exact beam up to 10 s, relative to its largest, and the axial one at 6.8 s [m]."""
    body = beam(SPIN_UP, Material("beam", 2.8e7, 0.3, 1.2), 10.0, 6, REFERENCES[words])
    method, outputs = ROS3(1e-3), ["p0.tip.position"]
    found = forward(rotor(body, user(spinning)), end=10.0, output_step=0.1, method=method, outputs=outputs)
    exact = np.loadtxt(TABLES / "spin_up_exact.csv", delimiter=",")[: found.time.size]
    angle = np.array([spinning(t)[0] for t in found.time])
    x, y = found["p0.tip.position"][:, :2].T
    along, across = np.cos(angle) * x + np.sin(angle) * y - 10.0, np.cos(angle) * y - np.sin(angle) * x
    return np.abs(across - exact[:, 2]) / np.abs(exact[:, 2]).max(), np.abs(along - exact[:, 1])[68:69]


def spin_up() -> Iterator[Figure]:
    """Simo & Vu-Quoc; Wu & Haug, Int. J. Numer. Meth. Engng 26 (1988) 2211-2226: L = 10 m, spun up to 6 rad/s in 15 s."""
    for words in REFERENCES:
        for what, goal, found in caught(lambda words=words: spun(words), (5e-4, 1e-4), ("lateral", "axial at 6.8 s [m]")):
            yield Figure(f"spin-up, {words}: {what}", found, goal)


def caught(
    compute: Callable[[], tuple[Array, ...]], goals: tuple[float, ...], names: tuple[str, ...]
) -> Iterator[tuple[str, float, float]]:
    """Names, goals and the largest of what is computed; infinite where that stops with an error, which is printed."""
    try:
        found = [float(values.max()) for values in compute()]
    except (ComputationError, InputError) as error:
        print(f"    {type(error).__name__}: {error}"[:300], flush=True)
        found = [np.inf] * len(names)
    yield from zip(names, goals, found, strict=True)


CASES: dict[str, Callable[[], Iterator[Figure]]] = {
    "pendulum": pendulums,
    "parts": soft_pendulums,
    "slider-crank": slider_cranks,
    "spin-up": spin_up,
    **statics.CASES,
    **laws.CASES,
}


def main() -> None:
    """Print the figures of the cases that are named."""
    wanted = sys.argv[1:] or list(CASES)
    missed = 0
    for name in wanted:
        if name not in CASES:
            sys.exit(f"there is no case {name!r}; there are {', '.join(CASES)}")
        began = time.perf_counter()
        for figure in CASES[name]():
            missed += not figure.met
            bound = f"{'>=' if figure.above else '<='} {figure.goal:.3g}"
            print(f"{figure.what:72}{figure.found:12.4g}  {bound:12}{'ok' if figure.met else 'MISSED'}", flush=True)
        print(f"    {name}: {time.perf_counter() - began:.1f} s", flush=True)
    sys.exit(1 if missed else 0)


if __name__ == "__main__":
    main()
