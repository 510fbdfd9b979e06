"""The equilibrium of a scene by Newton's method on forces and constraints, the multipliers among the unknowns.

With the exact tangent of `ffr_dyn.equations.statics`, a step y (V,) and new multipliers solve

    | K + s M   J^T | | y       |   | forces |
    |   J        0  | | lam new | = |  -Phi  |

s = 0 where K is positive on the motions that the rows leave free, and the step no longer than a radius. As rows need not be
met on the way, stiff bodies bend and turn without being stretched, and few steps do for any load. Where Newton's step fails,
s is about the smallest that makes it so: a step downhill, as of a motion under great damping, so that what begins far away
comes to a stable equilibrium; where the rows are far from met by then, a step meets them alone. A step is taken again with
half the radius where the one that would follow, with the same tangent, is longer or goes back. A mechanism that comes
nowhere soon is let go from the start, and steps go on from where it rests (`ffr_dyn.analyses.equilibria.relaxation`). What
comes nowhere at all bears its loads bit by bit. (Nocedal & Wright 2006, ch. 16; Deuflhard 2004, ch. 3.)
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import LinAlgWarning, eigvalsh_tridiagonal, ldl, lu_factor, lu_solve

from ffr_dyn.analyses.equilibria.relaxation import Rest, relaxed
from ffr_dyn.compile.scene_tables import System
from ffr_dyn.consistency.evaluation import locked, total_mass_matrix, unit_rows
from ffr_dyn.equations.forces import At, applied_by
from ffr_dyn.equations.forces_at_rest import is_load
from ffr_dyn.equations.layout import moved
from ffr_dyn.equations.statics import Balance, balance
from ffr_dyn.scene.force_kinds import forces_of
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError, InputError

ITERATIONS, SOON = 100, 30
LARGEST_STEP = 1.0  # rad, or part of the scene's size
TOLERANCE = 1e-9  # of the last step, the same: the next would be its square
LEAST_SHIFT = 1e-3  # of what takes a step of the radius where nothing is stiff
FIRST_SHARE, LEAST_SHARE, ITERATIONS_OF_A_SHARE = 0.25, 1e-3, 12  # of all loads
BACK = -0.5  # part of a step that the following one may go back
OPEN = (
    0.25  # rad, or part of the size: motion to the rows beyond which a step is that alone; its shift counts as infinite
)
UNLOADED = 0.01  # of the loads: a scene that bears little
TRACE = 1e-6  # and one that bears next to nothing
# Of `jumped`: the logarithm by which loads change at once, at most and least; a Newton step over the one before.
LARGEST_CHANGE, LEAST_CHANGE, CONTRACTS = 1.2, 1e-3, 0.5
LINEAR = 0.1  # the last of what hardly bends the scene's response
SAME = 1e-3  # of how far an equilibrium is from the start: two that are one
ATTEMPTS, HALVINGS = 40, 3  # shifts four times as large each; and between the last of them and the one before


@dataclass(frozen=True)
class Equilibrium:
    """Positions (N, X) on the way, multipliers and balance at the last, and lengths of all steps tried, relative to sizes.

    found      : whether the last step was below the tolerance
    load_steps : parts in which weight and loads were applied
    borne      : the share of them for which an equilibrium was found by load steps, where not all are
    relaxed    : whether it was let go, and steps began where it came to rest
    """

    path: Array
    lam: Array | None
    balance: Balance
    steps: tuple[float, ...]
    found: bool
    load_steps: int = 1
    borne: float = 0.0
    relaxed: bool = False


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


def equilibrium(
    system: System, time: float, x: Array, sizes: Array, mechanism: Callable[[], bool] = lambda: False
) -> Equilibrium:
    """From the positions x at the time [s]; sizes (V,) of what counts as a step of one.

    What comes to no equilibrium soon is let go if it can move without being deformed, which `mechanism` tells; what comes to
    none under all loads at once bears them bit by bit.

    Raises ComputationError where the forces are not finite.
    """
    problem = _Problem(system, time, total_mass_matrix(system.scene, system.layout, x), sizes)
    start = Equilibrium(x[None], None, problem.balance(x, None, {}, 1.0), (), False)
    found = _newton(problem, start, 1.0, SOON)
    if found.found:
        return found
    if mechanism() and (rest := relaxed(system, time, x, sizes)) is not None:
        return _from_rest_on(problem, rest, found)
    found = _newton(problem, start, 1.0, ITERATIONS)
    return found if found.found else _by_load_steps(problem, start, found)


def _from_rest_on(problem: _Problem, rest: Rest, before: Equilibrium) -> Equilibrium:
    """By steps from where a scene rests that was let go."""
    now = problem.balance(rest.way[-1], None, rest.angles, 1.0)
    there = _newton(problem, Equilibrium(rest.way, None, now, (), False), 1.0, SOON)
    path = np.concatenate([rest.way, there.path])
    return replace(there, path=path, steps=(*before.steps, *there.steps), relaxed=True)


def _by_load_steps(problem: _Problem, start: Equilibrium, failed: Equilibrium) -> Equilibrium:
    """With shares of the loads that grow as they are borne; what failed if there is none that is."""
    share, size, now, path, steps, count = 0.0, FIRST_SHARE, start, [start.path], list(failed.steps), 0
    while share < 1 and size > LEAST_SHARE:
        goal = min(share + size, 1.0)
        there = _newton(problem, now, goal, ITERATIONS_OF_A_SHARE)
        steps += there.steps
        if not there.found:
            size /= 2
            continue
        share, size, now, count = goal, 2 * size, there, count + 1
        path.append(there.path)
    if share < 1:
        return replace(failed, borne=share)
    return Equilibrium(np.concatenate(path), now.lam, now.balance, tuple(steps), True, count)


def _newton(problem: _Problem, start: Equilibrium, share: float, iterations: int) -> Equilibrium:
    x, path, steps, radius, M = start.path[-1], list[Array](), list[float](), LARGEST_STEP, problem.M
    now = problem.balance(x, start.lam, start.balance.angles, share)
    lam = start.lam
    if lam is None:
        _, lam, _ = _from_rest(now, M)
        now = problem.balance(x, lam, start.balance.angles, share)
    while len(steps) < iterations and (step := _step(now, M, problem.sizes, radius)) is not None:
        there = moved(problem.system.layout, x, step.y)
        beyond = problem.balance(there, step.lam, now.angles, share)
        steps.append(step.length)
        # of a motion that nothing holds there is no Newton step, and no force
        if step.length < (TOLERANCE if step.shift == 0 else TOLERANCE * radius):
            return Equilibrium(np.array([*path, there]), step.lam, beyond, tuple(steps), True)
        ahead = _ahead(step, beyond, M)
        if not ahead > BACK:
            radius = 0.5 * min(step.length, radius)
            continue
        path.append(there)
        x, lam, now, radius = there, step.lam, beyond, min(2 * radius if ahead > 0.5 * BACK else radius, LARGEST_STEP)
    return Equilibrium(np.array([start.path[-1], *path]), lam, now, tuple(steps), False)


def jumped(system: System, time: float, x: Array, sizes: Array, found: Equilibrium) -> str:
    """Whether an equilibrium from x is on another branch than that of small loads, in words; empty where it is not.

    Newton's steps may lead over a fold, behind which small loads have no equilibrium nearby, or over a pole of a force. As
    the loads are taken off bit by bit, the scene then does not come to where small ones bring it from the start. That is
    looked at, as loads that grow are: both by changes small enough to stay on their branch. Where nothing but loads acts,
    small ones lead where large ones do.
    """
    if not any(system.layout.n) and all(is_load(force) for force in forces_of(system.scene)):
        return ""
    problem = _Problem(system, time, total_mass_matrix(system.scene, system.layout, x), sizes)
    start = Equilibrium(x[None], None, problem.balance(x, None, {}, 1.0), (), False)
    small, reached = _lightly_loaded(problem, start, SOON if found.relaxed else ITERATIONS)
    if not small.found or _apart(problem, x, small.path[-1]) > _apart(problem, x, found.path[-1]):
        return ""  # small loads do not know of where the scene is drawn
    far = _apart(problem, x, found.path[-1])
    grown = small
    if reached == UNLOADED:
        off, share = _followed(problem, found, 1.0, UNLOADED)
        if share == UNLOADED and _apart(problem, off.path[-1], small.path[-1]) <= SAME * max(far, SAME):
            return ""
        grown, reached = _followed(problem, small, UNLOADED, 1.0)
    if reached < 1.0:
        return (
            f"loads that grow find no equilibrium near the last one beyond {reached:.3g} of their size: there the scene "
            "jumps, or a force has a pole, and the equilibrium found is on another branch; look at smaller loads, or run "
            "forward with damping"
        )
    if _apart(problem, grown.path[-1], found.path[-1]) <= SAME * max(far, SAME):
        return ""
    return (
        "loads that grow from nothing come to another equilibrium than all loads at once, which is the one found; start "
        "nearer to the one wanted"
    )


def _lightly_loaded(problem: _Problem, start: Equilibrium, most: int) -> tuple[Equilibrium, float]:
    """The equilibrium near the start under a small share of the loads, and this share.

    Newton's steps may lead over a fold even there: what a trace of the loads brings is followed to that share, at once
    where the response is nearly linear. most : steps to each
    """
    trace = _newton(problem, start, TRACE, most)
    at_once = _newton(problem, trace if trace.found else start, UNLOADED, most)
    linear = at_once.found and _contracts(at_once, LINEAR)
    if not trace.found or (linear and _returns(problem, at_once, trace, TRACE)):
        return at_once, UNLOADED
    return _followed(problem, trace, TRACE, UNLOADED)


def _contracts(found: Equilibrium, ratio: float) -> bool:
    """Whether each step but the last, which is rounding, was no longer than this part of the one before."""
    lengths = np.array(found.steps[:-1])
    return not (lengths[1:] > ratio * lengths[:-1]).any()


def _followed(problem: _Problem, now: Equilibrium, share: float, goal: float) -> tuple[Equilibrium, float]:
    """The equilibrium as the share of the loads goes to a goal, and the share that is reached on its branch."""
    size, way = LARGEST_CHANGE, np.sign(goal - share)
    while share != goal and size > LEAST_CHANGE:
        wanted = goal if abs(np.log(goal / share)) <= size else share * np.exp(way * size)
        there = _newton(problem, now, wanted, ITERATIONS_OF_A_SHARE)
        near = there.found and _contracts(there, CONTRACTS)
        if not near or (way > 0 and not _returns(problem, there, now, share)):
            size /= 2
            continue
        share, now, size = wanted, there, min(2 * size, LARGEST_CHANGE)
    return now, share


def _returns(problem: _Problem, there: Equilibrium, now: Equilibrium, share: float) -> bool:
    """Whether an equilibrium leads back to the one before as its loads are taken back to that one's share."""
    back = _newton(problem, there, share, ITERATIONS_OF_A_SHARE)
    moved_by = _apart(problem, now.path[-1], there.path[-1])
    return back.found and _apart(problem, back.path[-1], now.path[-1]) <= SAME * max(moved_by, SAME)


def _apart(problem: _Problem, x: Array, other: Array) -> float:
    """How far two positions are from each other: rad, or part of the scene's size."""
    place = problem.system.layout
    found = [0.0]
    for b in range(len(place.n)):
        for at, width in ((place.R(b), problem.sizes[place.R_dot(b)]), (place.q(b), problem.sizes[place.q_dot(b)])):
            found += (np.abs(x[at] - other[at]) / width).tolist()
        found.append(2.0 * float(np.arccos(min(1.0, abs(x[place.p(b)] @ other[place.p(b)])))))
    return max(found)


@dataclass(frozen=True)
class _Problem:
    """A compiled scene at a time; a mass matrix (V, V) and sizes (V,) to measure steps with."""

    system: System
    time: float
    M: Array
    sizes: Array

    def balance(self, x: Array, lam: Array | None, near: Mapping[str, float], share: float) -> Balance:
        """At positions x with multipliers lam, None for zeros, and a share of the loads; with rows for what a plane locks."""
        scene, place, blocks = self.system.scene, self.system.layout, self.system.blocks
        across = locked(place)
        lam = np.zeros(sum(len(block.words) for block in blocks)) if lam is None else lam
        try:
            now = balance(scene, place, blocks, self.time, x, lam, near, share)
        except (InputError, ComputationError):
            raise
        except Exception as error:  # of a formula, or of a function of the user's
            raise ComputationError(
                f"the forces are not finite near the equilibrium{self._of_a_force(x)}: {type(error).__name__}: {error}; look "
                "at its formulas and functions: one of time takes t alone, one of the motion (t, state) as `function`"
            ) from error
        if not (np.isfinite(now.forces).all() and np.isfinite(now.stiffness).all()):
            raise ComputationError(
                f"the forces are not finite near the equilibrium{self._of_a_force(x)}; check its numbers, formulas and "
                "functions"
            )
        if not across.size:
            return now
        jacobian = np.concatenate([now.jacobian, unit_rows(across, place.v_size)])
        return replace(now, Phi=np.append(now.Phi, np.zeros(across.size)), jacobian=jacobian)

    def _of_a_force(self, x: Array) -> str:
        """The first force that has no finite value at positions x, in words; empty where there is none."""
        still = np.zeros(self.system.layout.v_size)
        for force in forces_of(self.system.scene):
            try:
                found = applied_by(At(self.system.scene, self.system.layout, self.time, x, still), force).generalised
            except Exception:  # whatever a function of the user raises
                found = np.full(1, np.nan)
            if not np.isfinite(found).all():
                return f", of {force.table[:-1]} {force.name!r}"
        return ""


def _from_rest(now: Balance, M: Array) -> tuple[Array, Array, Array]:
    """How the scene starts to move from rest (V,), its multipliers then (C,), and the smallest motion (V,) to the rows."""
    size = now.forces.size
    sides = np.zeros((size + now.Phi.size, 2))
    sides[:size, 0], sides[size:, 1] = now.forces, -now.Phi
    both = np.linalg.lstsq(_bordered(M, now.jacobian), sides, rcond=None)[0]
    return both[:size, 0], both[size:, 0], both[:size, 1]


def _step(now: Balance, M: Array, sizes: Array, radius: float) -> _Step | None:
    """Newton's step, or else one that meets the rows, or one with a shift, or None."""
    newton, fits = _shifted(now, M, sizes, 0.0, np.zeros(sizes.size), radius)
    if fits:
        return newton
    free, lam, closing = _from_rest(now, M)
    gap = float(np.abs(closing / sizes).max())
    if gap > OPEN:
        part = min(1.0, LARGEST_STEP / gap)
        return _Step(part * closing, lam, np.inf, part * gap, newton.factors)
    first = max(LEAST_SHIFT * float(np.abs(free / sizes).max()) / radius, 1e-12)
    return _least_shifted(now, M, sizes, first, closing, radius)


def _least_shifted(now: Balance, M: Array, sizes: Array, first: float, closing: Array, radius: float) -> _Step | None:
    """The step with about the smallest shift that will do, None where there is none."""
    last, shift = 0.0, first
    for _ in range(ATTEMPTS):
        step, fits = _shifted(now, M, sizes, shift, closing, radius)
        if fits:
            break
        last, shift = shift, 4 * shift
    else:
        return None
    for _ in range(HALVINGS if last else 0):
        middle = np.sqrt(last * step.shift)
        longer, fits = _shifted(now, M, sizes, middle, closing, radius)
        last, step = (last, longer) if fits else (middle, step)
    return step


def _shifted(now: Balance, M: Array, sizes: Array, shift: float, closing: Array, radius: float) -> tuple[_Step, bool]:
    """The step with a shift, and whether it will do; Newton's last one does wherever it leads.

    The radius bounds what goes beyond the smallest step to the rows, `closing` (V,).
    """
    matrix, right = _bordered(now.stiffness + shift * M, now.jacobian), np.concatenate([now.forces, -now.Phi])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LinAlgWarning)  # of a singular matrix, whose step is not finite or too long
        factors = lu_factor(matrix, check_finite=False)
    with np.errstate(all="ignore"):
        solution = lu_solve(factors, right, check_finite=False)
    y, lam = solution[: sizes.size], solution[sizes.size :]
    step = _Step(y, lam, shift, float(np.abs(y / sizes).max()), factors)
    short = bool(np.abs((y - closing) / sizes).max() <= radius)
    return step, short and ((shift == 0 and step.length < TOLERANCE) or _positive(matrix, now.Phi.size))


def _ahead(step: _Step, there: Balance, M: Array) -> float:
    """How far the following step goes on along this one, relative to it; after Newton's it must not be longer."""
    if step.shift == np.inf:
        return 0.0
    following, size = step.next(there), step.y @ M @ step.y
    if step.shift == 0 and following @ M @ following > size:
        return -np.inf
    return float(following @ M @ step.y / size) if size > 0 else 0.0


def _bordered(K: Array, J: Array) -> Array:
    return np.block([[K, J.T], [J, np.zeros((len(J), len(J)))]])


def _positive(matrix: Array, rows: int) -> bool:
    """Whether K is positive on the free motions: the bordered matrix has one negative eigenvalue for each row then."""
    _, D, _ = ldl(0.5 * (matrix + matrix.T), check_finite=False)
    values = eigvalsh_tridiagonal(np.diag(D).copy(), np.diag(D, -1).copy())
    return int((values < 0).sum()) == rows
