"""The equilibrium of a scene by Newton's method on forces and constraints, the multipliers among the unknowns.

With the exact tangent of `ffr_dyn.equations.statics`, a step y (V,) and new multipliers solve

    | K + s M   J^T | | y       |   | forces |
    |   J        0  | | lam new | = |  -Phi  |

s = 0 where K is positive on the motions that the rows leave free, and the step no longer than a radius. As rows need not be
met on the way, stiff bodies bend and turn without being stretched, and few steps do for any load. Where Newton's step fails,
s is about the smallest that makes it so: a step of the motion downhill from there under great damping, so that what begins
far away comes to a stable equilibrium, bit by bit of its loads. A step is taken again with half the radius where the one that
would follow, with the same tangent, is longer or goes back. (Nocedal & Wright 2006, ch. 16; Deuflhard 2004, ch. 3.)
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import LinAlgWarning, eigvalsh_tridiagonal, ldl, lu_factor, lu_solve

from ffr_dyn.compile.scene_tables import System
from ffr_dyn.consistency.evaluation import locked, total_mass_matrix, unit_rows
from ffr_dyn.equations.layout import moved
from ffr_dyn.equations.statics import Balance, balance
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError

ITERATIONS = 100
LARGEST_STEP = 1.0  # rad, or part of the scene's size
TOLERANCE = 1e-9  # of the last step, the same: the next would be its square
LEAST_SHIFT = 1e-3  # of what takes a step of the radius where nothing is stiff
ATTEMPTS, HALVINGS = 40, 3  # shifts four times as large each; and between the last of them and the one before


@dataclass(frozen=True)
class Equilibrium:
    """Positions (N, X) on the way, the balance at the last, and the lengths of all steps tried [rad, or of the scene's size].

    found : whether the last step was Newton's, and below the tolerance
    """

    path: Array
    balance: Balance
    steps: tuple[float, ...]
    found: bool


@dataclass(frozen=True)
class _Step:
    """A step (V,) with the multipliers after it, its shift, its length, and the factors of its matrix."""

    y: Array
    lam: Array
    shift: float
    length: float
    factors: tuple[Array, Array]

    def next(self, there: Balance) -> Array:
        """(V,) the step that would follow from where this one leads, with the same matrix."""
        left = np.concatenate([there.forces - self.lam @ there.jacobian, -there.Phi])
        return lu_solve(self.factors, left, check_finite=False)[: self.y.size]


def equilibrium(system: System, time: float, x: Array, sizes: Array) -> Equilibrium:
    """From the positions x at the time [s]; sizes (V,) of what counts as a step of one.

    Raises ComputationError where the forces are not finite.
    """
    at, path, steps, radius = _balances(system, time), [x], list[float](), LARGEST_STEP
    now = at(x, None, {})
    now = at(x, _multipliers(now, _mass(system, x)), {})
    while len(steps) < ITERATIONS:
        x, M = path[-1], _mass(system, path[-1])
        step = _step(now, M, sizes, radius)
        there = moved(system.layout, x, step.y)
        beyond = at(there, step.lam, now.angles)
        steps.append(step.length)
        if step.shift == 0 and step.length < TOLERANCE:
            return Equilibrium(np.array([*path, there]), beyond, tuple(steps), True)
        if _fails(step, step.next(beyond), M):
            radius = 0.5 * step.length
        else:
            path.append(there)
            now, radius = beyond, min(2 * radius, LARGEST_STEP)
    return Equilibrium(np.array(path), now, tuple(steps), False)


def _balances(system: System, time: float) -> Callable[[Array, Array | None, Mapping[str, float]], Balance]:
    """The balance at positions x with multipliers lam, None for zeros; with rows for what a plane locks."""
    scene, place = system.scene, system.layout
    across = locked(place)
    none = np.zeros(sum(len(block.words) for block in system.blocks))

    def at(x: Array, lam: Array | None, near: Mapping[str, float]) -> Balance:
        try:
            now = balance(scene, place, system.blocks, time, x, none if lam is None else lam, near)
            finite = np.isfinite(now.forces).all() and np.isfinite(now.stiffness).all()
        except (ZeroDivisionError, OverflowError, ValueError):  # of a function of time
            finite = False
        if not finite:
            raise ComputationError("the forces are not finite near the equilibrium; check loads and springs")
        if not across.size:
            return now
        jacobian = np.concatenate([now.jacobian, unit_rows(across, place.v_size)])
        return replace(now, Phi=np.append(now.Phi, np.zeros(across.size)), jacobian=jacobian)

    return at


def _mass(system: System, x: Array) -> Array:
    return total_mass_matrix(system.scene, system.layout, x)


def _multipliers(now: Balance, M: Array) -> Array:
    """Those with which the scene would start to move from rest."""
    right = np.concatenate([now.forces, np.zeros(now.Phi.size)])
    solution = np.linalg.lstsq(_bordered(M, now.jacobian), right, rcond=None)[0]
    return solution[now.forces.size :]


def _step(now: Balance, M: Array, sizes: Array, radius: float) -> _Step:
    """Newton's step, or else one with a shift."""
    newton, fits = _shifted(now, M, sizes, radius, 0.0)
    if fits:
        return newton
    last, shift = 0.0, _first_shift(now, M, sizes, radius)
    for _ in range(ATTEMPTS):
        step, fits = _shifted(now, M, sizes, radius, shift)
        if fits:
            break
        last, shift = shift, 4 * shift
    for _ in range(HALVINGS if last else 0):
        middle = np.sqrt(last * step.shift)
        longer, fits = _shifted(now, M, sizes, radius, middle)
        last, step = (last, longer) if fits else (middle, step)
    return step


def _first_shift(now: Balance, M: Array, sizes: Array, radius: float) -> float:
    """[1/s^2]"""
    free = np.concatenate([now.forces, -now.Phi])
    y = np.linalg.lstsq(_bordered(M, now.jacobian), free, rcond=None)[0][: sizes.size]
    return max(LEAST_SHIFT * float(np.abs(y / sizes).max()) / radius, 1e-12)


def _shifted(now: Balance, M: Array, sizes: Array, radius: float, shift: float) -> tuple[_Step, bool]:
    """The step with a shift, and whether it will do; Newton's last one does wherever it leads."""
    matrix, right = _bordered(now.stiffness + shift * M, now.jacobian), np.concatenate([now.forces, -now.Phi])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LinAlgWarning)  # of a singular matrix, whose step is not finite or too long
        factors = lu_factor(matrix, check_finite=False)
    with np.errstate(all="ignore"):
        solution = lu_solve(factors, right, check_finite=False)
    length = float(np.abs(solution[: sizes.size] / sizes).max())
    step = _Step(solution[: sizes.size], solution[sizes.size :], shift, length, factors)
    short = bool(length <= radius)
    return step, short and ((shift == 0 and length < TOLERANCE) or _positive(matrix, now.Phi.size))


def _fails(step: _Step, following: Array, M: Array) -> bool:
    along, size = following @ M @ step.y, step.y @ M @ step.y
    grows = step.shift == 0 and following @ M @ following > size
    return bool(grows or along < -0.5 * size)


def _bordered(K: Array, J: Array) -> Array:
    return np.block([[K, J.T], [J, np.zeros((len(J), len(J)))]])


def _positive(matrix: Array, rows: int) -> bool:
    """Whether K is positive on the free motions: the bordered matrix has one negative eigenvalue for each row then."""
    _, D, _ = ldl(0.5 * (matrix + matrix.T), check_finite=False)
    values = eigvalsh_tridiagonal(np.diag(D).copy(), np.diag(D, -1).copy())
    return int((values < 0).sum()) == rows
