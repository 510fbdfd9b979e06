"""Accuracy against an independent code: the same reduced bodies in Exudyn agree as the steps go to zero.

    python -m benchmarks.against_exudyn [--quick]

Both codes are given the same bodies (nodes, K, consistent M and the modes of `ffr_prep`; Exudyn computes its own mass
terms from them), the same joints and the same initial state. Printed are

  1. the largest relative difference of every mass term that Exudyn computes from M and the modes,
  2. the largest distance over all output times between our motion and Exudyn's for falling steps of both codes, and after
     extrapolation of Exudyn's to step zero (its methods are of order two). Goal: 1e-6 m.
  3. what does not vanish with the step, and why: Exudyn's own load for gravity.

Scenes: the pendulum (0.5 s) and the slider-crank (0.084 s and 0.5 s) with rigid (RBE2) and mean (RBE3) interfaces and 8
fixed-interface modes. Ours is RK4, theirs the generalised-alpha method (spectral radius 0.9, index 3) and the trapezoidal
rule (index 2). The steps are those of the fastest mode, which neither code damps.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from benchmarks.exudyn_twin import CENTRE_OF_MASS, UNDEFORMED_BODY, exu, fem_interface, mass_terms, motion, twin
from benchmarks.exudyn_twin import ObjectFFRFreducedOrderInterface as ReducedOrder
from benchmarks.scenes import MeshedBody, connecting_rod, pendulum, pendulum_rod, slider_crank
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.consistency.assemble import assemble, in_space
from ffr_dyn.functions.rotation import rotation_matrix
from ffr_dyn.integrators import RK4, Integrator
from ffr_dyn.scene.scene import Scene

Array = np.ndarray

ALPHA, TRAPEZOIDAL = exu.DynamicSolverType.GeneralizedAlpha, exu.DynamicSolverType.TrapezoidalIndex2
BOTH = {"Exudyn gen. alpha": ALPHA, "Exudyn trapezoidal": TRAPEZOIDAL}


@dataclass(frozen=True)
class Case:
    """A scene with one meshed body: what is compared, over which time, with which steps.

    point : marker that is compared, beside the mesh node nearest to `middle` (3,) [m] of the body "rod"
    steps : of Exudyn, each half the one before;  our_step : of RK4
    """

    name: str
    rod: MeshedBody
    scene: Scene
    point: str
    middle: tuple[float, float, float]
    end: float
    rows: int
    our_step: float
    steps: tuple[float, ...]


def of_linear_theory(scene: Scene) -> Scene:
    """The scene in space, its bodies without terms of second order, which Exudyn does not have."""
    return in_space(replace(scene, bodies=tuple(replace(body, stiffening=False) for body in scene.bodies)))


def pendulum_case(kind: str, steps: tuple[float, ...]) -> Case:
    rod = pendulum_rod(kind, 8)
    scene = of_linear_theory(pendulum(rod.body))
    return Case(f"pendulum, {kind}", rod, scene, "rod.tip", (0.6, 0.0, 0.0), 0.5, 50, 1e-5, steps)


def slider_crank_case(kind: str, end: float, steps: tuple[float, ...]) -> Case:
    rod = connecting_rod(kind, 8)
    scene, rows = of_linear_theory(slider_crank(rod.body)), round(end / 1e-3)
    return Case(f"slider-crank, {kind}", rod, scene, "slider.pin", (0.15, 0.0, 0.0), end, rows, 2.5e-6, steps)


# ---- both codes ---------------------------------------------------------------------------------------------------


def middle_node(case: Case) -> int:
    return int(np.argmin(((case.rod.points - np.array(case.middle)) ** 2).sum(1)))


def ours(case: Case, method: Integrator) -> Array:
    """(rows + 1, 2, 3) positions of the point and of the node in the middle, by `ffr_dyn`."""
    result = integrate(case.scene, end=case.end, output_step=case.end / case.rows, method=method)
    node = middle_node(case)
    A = np.array([rotation_matrix(p) for p in result["rod.p"]])
    u = case.rod.points[node] + result["rod.q"] @ case.rod.Phi[node].T
    return np.stack([result[f"{case.point}.position"], result["rod.R"] + np.einsum("tij,tj->ti", A, u)], axis=1)


def theirs(case: Case, step: float, solver: object = ALPHA, gravity_on: str = CENTRE_OF_MASS) -> Array:
    """(rows + 1, 2, 3) the same positions by Exudyn, started from the same assembled state."""
    start = assemble(case.scene)
    made = twin(case.scene, start.x, start.v, {"rod": case.rod}, gravity_on=gravity_on)
    nodes = {"rod": middle_node(case)}
    found = motion(made, case.end, round(case.end / step), case.rows, solver, [case.point], nodes)
    return np.stack([found[case.point], found["rod.node"]], axis=1)


def distance(one: Array, other: Array) -> Array:
    """(2,) largest distance [m] of the point and of the node."""
    return np.linalg.norm(one - other, axis=2).max(axis=0)


def extrapolated(coarse: Array, fine: Array) -> Array:
    """Step zero of a method of order two, from steps h and h/2."""
    return fine + (fine - coarse) / 3.0


def mass_term_differences(meshed: MeshedBody) -> dict[str, float]:
    """Largest difference of each mass term of Exudyn from ours, relative to the largest entry."""
    cms = ReducedOrder(fem_interface(meshed))
    return {
        name: float(np.abs(getattr(cms, name) - value).max() / np.abs(value).max())
        for name, value in mass_terms(meshed.body).items()
    }


# ---- tables -------------------------------------------------------------------------------------------------------


def print_mass_terms(bodies: Sequence[tuple[str, MeshedBody]]) -> None:
    columns = {name: mass_term_differences(meshed) for name, meshed in bodies}
    print("Mass terms: largest relative difference between Exudyn's, from M and the modes, and ours")
    print(f"  {'term':22}" + "".join(f"{name:>24}" for name in columns))
    for term in next(iter(columns.values())):
        print(f"  {term:22}" + "".join(f"{column[term]:24.1e}" for column in columns.values()))


def print_case(case: Case, solvers: Mapping[str, object]) -> None:
    n = case.rod.body.n
    print(f"\n{case.name} interfaces, {n} elastic coordinates, {case.end} s: largest distance [m] from our RK4")
    print(f"  {'':24}{'step [s]':>12}{case.point:>14}{'middle':>14}{'wall [s]':>12}")
    best, took = timed(partial(ours, case, RK4(case.our_step)))
    other, took_too = timed(partial(ours, case, RK4(2 * case.our_step)))
    row("ours, twice the step", 2 * case.our_step, distance(other, best), took_too)
    row("ours", case.our_step, distance(best, best), took)
    for name, solver in solvers.items():
        found = []
        for step in case.steps:
            theirs_found, took = timed(partial(theirs, case, step, solver))
            found.append(theirs_found)
            row(name, step, distance(theirs_found, best), took)
        row("  extrapolated", 0.0, distance(extrapolated(*found[-2:]), best), 0.0)


def row(name: str, step: float, difference: Array, took: float) -> None:
    print(f"  {name:24}{step:12.3g}{difference[0]:14.2e}{difference[1]:14.2e}{took:12.1f}", flush=True)


def timed(run: Callable[[], Array]) -> tuple[Array, float]:
    began = time.perf_counter()
    return run(), time.perf_counter() - began


def print_gravity(case: Case) -> None:
    """Exudyn's LoadMassProportional on an ObjectFFRFreducedOrder takes its moment from the undeformed body."""
    best = ours(case, RK4(case.our_step))
    print(f"\n{case.name} interfaces with Exudyn's own gravity load, whose moment leaves out (I3 q) x g [m]")
    for step in case.steps:
        row("Exudyn gen. alpha", step, distance(theirs(case, step, gravity_on=UNDEFORMED_BODY), best), 0.0)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="rigid interfaces only, larger steps")
    quick = parser.parse_args().quick
    kinds = ("rigid",) if quick else ("rigid", "mean")
    made = (("pendulum", pendulum_rod), ("rod", connecting_rod))
    print(f"Exudyn {exu.config.Version()}")
    print_mass_terms([(f"{name}, {kind}", make(kind, 8)) for kind in kinds for name, make in made])
    for kind in kinds:
        print_case(pendulum_case(kind, (8e-5, 4e-5) if quick else (8e-5, 4e-5, 2e-5, 1e-5)), BOTH)
    for kind in kinds:
        end, steps = (0.02, (5e-6, 2.5e-6)) if quick else (0.084, (1e-5, 5e-6, 2.5e-6, 1.25e-6))
        print_case(slider_crank_case(kind, end, steps), BOTH)
    if not quick:
        print_case(slider_crank_case("rigid", 0.5, (2.5e-6, 1.25e-6, 6.25e-7)), {"Exudyn gen. alpha": ALPHA})
    print_gravity(pendulum_case("rigid", (4e-5, 2e-5)))


if __name__ == "__main__":
    main()
