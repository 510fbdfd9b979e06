"""Which constraint rows follow from the others, not at one position but along the motion.

In a singular position rows depend on one another that are needed everywhere else. So where they do, neighbouring
positions are made by free motions in several directions, and the rows are as dependent as where they are least so. Drivers
may be anywhere there: their rows count, their values do not. (Nikravesh 1988, ch. 5, factorises at one position.)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import qr
from scipy.sparse import csr_array, vstack

from ffr_dyn.closing.constraints import Constraints, RowsAt, of_blocks, rows_at, without
from ffr_dyn.closing.dependent_rows import dependence_at
from ffr_dyn.closing.going_on import going_on
from ffr_dyn.closing.positions import TOLERANCE, close_positions, largest_turn, weights
from ffr_dyn.closing.row_space import Dependence, Matrix, smallest_solution
from ffr_dyn.compile.row_tables import moving_bodies
from ffr_dyn.equations.constraint_rows import Block
from ffr_dyn.equations.layout import Layout, meets, moved, to_body_axes, to_global_axes
from ffr_dyn.scene.scene import Scene, markers
from ffr_prep.common.arrays import Array
from ffr_prep.common.brief import Brief
from ffr_prep.common.errors import InputError

AWAY = (0.1, 0.05, 0.2, 0.1, 0.05, 0.2, 0.4, 0.1)  # rad, or of the size of the largest body: to a neighbouring position
AGREED = 2  # neighbours that end the search
NOTHING = 1e-6  # of a motion, what counts as none
ITERATIONS = 40
CLEAR = 1e-5  # length of the shortest combination of rows that does not vanish, where it is plain which do
TAKES_PART = 1e-6  # of a row in a combination that vanishes


@dataclass(frozen=True, repr=False)
class Independent(Brief):
    """Blocks without their redundant words, the (block, word) pairs that were dropped, and whether rows depend on one another
    at the position alone, which then is singular."""

    blocks: list[Block]
    redundant: list[tuple[str, str]]
    singular: bool


def independent_blocks(constraints: Constraints, x: Array, v: Array, rows: RowsAt) -> Independent:
    """The rows that the motion needs, of those given at (x, v). Raises InputError when a driver's row is redundant."""
    here = dependence_at(constraints, x, rows.J)
    in_motion = _in_motion(constraints, x, v, here)
    blocks, N, singular = list(constraints.blocks), in_motion.combinations, here.count > in_motion.count
    if drivers := _drivers_in(N, blocks):
        raise InputError(
            f"driver {drivers[0]!r} prescribes a motion that the joints and other drivers already fix; leave out "
            f"{' or '.join(map(repr, drivers))}"
        )
    if not N.size:
        return Independent(blocks, [], singular)
    said = [(block, word) for block in blocks for word in block.words]
    # what is left of the combinations in these rows is as regular as can be, and so are the rows that are kept
    out = np.sort(qr(N.T, mode="r", pivoting=True)[1][: N.shape[1]])
    dropped = [(said[k][0].name, said[k][1].text) for k in out]
    return Independent(without(blocks, np.isin(np.arange(len(said)), out)), dropped, singular)


def redundant_drivers(constraints: Constraints, x: Array, v: Array) -> tuple[str, ...]:
    """Drivers with a row that follows from the joints and the other drivers."""
    return _drivers_in(dependence_in_motion(constraints, x, v).combinations, list(constraints.blocks))


def _drivers_in(N: Array, blocks: list[Block]) -> tuple[str, ...]:
    if not N.size:
        return ()
    owners = [block for block in blocks for _ in block.words]
    parts = np.abs(N).max(axis=1, initial=0.0)
    found = (block.name for block, part in zip(owners, parts, strict=True) if block.driver and part > TAKES_PART)
    return tuple(dict.fromkeys(found))


def dependence_in_motion(constraints: Constraints, x: Array, v: Array) -> Dependence:
    """How the rows depend on one another at x or, if they do so less, at its neighbours."""
    return _in_motion(constraints, x, v, _dependence(constraints, x, v))


def _in_motion(constraints: Constraints, x: Array, v: Array, here: Dependence) -> Dependence:
    if not here.count:
        return here
    blocks = list(constraints.blocks)
    owners = np.repeat(np.arange(len(blocks)), [len(block.words) for block in blocks])
    dependent = set(owners[np.abs(here.combinations).max(axis=1) > TAKES_PART].tolist())
    chosen = _involved(constraints.scene, blocks, dependent)
    best = _at_neighbours(of_blocks(constraints, chosen), x, v)
    if best is None or best.count > here.count:
        return here
    whole = np.zeros((owners.size, best.count))
    whole[np.isin(owners, chosen)] = best.combinations
    return Dependence(whole, best.least)


def _involved(scene: Scene, blocks: list[Block], dependent: set[int]) -> list[int]:
    """Numbers of the blocks that may be in a combination of rows that vanishes, from those that are in one at a position.

    Forces in a mechanism that balance one another do not reach a body that hangs on by one pair of bodies alone; and what is
    connected by the ground only has its own.
    """
    table = markers(scene)
    pairs = [frozenset(moving_bodies(block, table, len(scene.bodies))) for block in blocks]
    left, tied = set(range(len(blocks))), {pairs[k] for k in dependent}
    while True:
        touching: dict[int, set[frozenset[int]]] = {}
        for k in left:
            for body in pairs[k]:
                touching.setdefault(body, set()).add(pairs[k])
        ends = set[frozenset[int]]().union(*(those for those in touching.values() if len(those) == 1))
        hanging = {k for k in left if pairs[k] in ends - tied}
        if not hanging:
            break
        left -= hanging
    found, bodies = set(dependent), frozenset().union(*(pairs[k] for k in dependent))
    while more := {k for k in left - found if pairs[k] & bodies}:
        found |= more
        bodies = bodies.union(*(pairs[k] for k in more))
    return sorted(found)


def _at_neighbours(constraints: Constraints, x: Array, v: Array) -> Dependence | None:
    """How the rows depend on one another at the neighbour of x where they plainly do so least; None where nothing moves."""
    found = list[Dependence]()
    joints = of_blocks(constraints, [k for k, block in enumerate(constraints.blocks) if not block.driver])
    for number, away in enumerate(AWAY):
        near = _neighbour(joints, x, v, number, away)
        if near is not None:
            found.append(_dependence(constraints, near, v))
        counts = [one.count for one in found if one.least > CLEAR]
        if counts.count(min(counts, default=0)) >= AGREED:
            break
    return max(found, key=lambda one: (one.least > CLEAR, -one.count, one.least), default=None)


def _dependence(constraints: Constraints, x: Array, v: Array) -> Dependence:
    return dependence_at(constraints, x, rows_at(constraints, x, v).J)


def _neighbour(constraints: Constraints, x: Array, v: Array, number: int, away: float) -> Array | None:
    """A position that meets the rows, a free motion away from x: the one that is under way, or one at random; None where
    there is none.
    """
    scene, place = constraints.scene, constraints.place
    W, J = _rigid(constraints, x, v)[1:]
    tied = _tied(place, J)
    wanted = W @ (tied * np.random.default_rng(number).normal(size=place.v_size))
    if number == 0 and (own := tied * _rigid_part(place, to_body_axes(place, x, v))).any():
        wanted = own
    way = wanted - W @ smallest_solution(J @ W, J @ wanted)
    if not _extent(scene, place, way) > NOTHING * _extent(scene, place, wanted):
        return None
    found = _along(constraints, x, v, way, away)
    if found is None:
        way = to_body_axes(place, x, going_on(constraints, x, to_global_axes(place, x, way)))
        found = _along(constraints, x, v, way, away)
    return found


def _along(constraints: Constraints, x: Array, v: Array, way: Array, away: float) -> Array | None:
    """A position that meets the rows so far along a way (V,) from x; None where none is found.

    In a singular position Newton's method would lead back to x, so its steps are at right angles to the way from there: they
    turn most ways that do not go on into one that does.
    """
    scene, place = constraints.scene, constraints.place
    way = way * (away / _extent(scene, place, way))
    found = moved(place, x, way)
    for _ in range(ITERATIONS):
        Phi, W, J = _rigid(constraints, found, v)
        if meets(scene, found, Phi, TOLERANCE):
            return close_positions(constraints, found, v)
        A = _with_row(J, way / np.linalg.norm(way)) @ W
        step = W @ smallest_solution(A, np.append(-Phi, 0.0))
        step *= min(1.0, away / max(_extent(scene, place, step), 1e-300))
        way, found = way + step, moved(place, found, step)
    return None


def _with_row(J: Matrix, row: Array) -> Matrix:
    return np.vstack([J, row]) if isinstance(J, np.ndarray) else csr_array(vstack([J, csr_array(row[None])]))


def _rigid(constraints: Constraints, x: Array, v: Array) -> tuple[Array, Matrix, Matrix]:
    """Phi (C,), W^(1/2) of rigid motions, Jacobian."""
    rows = rows_at(constraints, x, v)
    dense = isinstance(rows.J, np.ndarray)
    return rows.Phi, weights(constraints.scene, constraints.place, x, False, dense), rows.J


def _tied(place: Layout, J: Matrix) -> Array:
    """(V,) ones for the velocities of bodies that rows act on."""
    acts, out = np.asarray(abs(J).sum(axis=0)).ravel() > 0, np.zeros(place.v_size)
    for b, n in enumerate(place.n):
        whole = slice(place.iv[b], place.iv[b] + 6 + n)
        out[whole] = acts[whole].any()
    return out


def _rigid_part(place: Layout, step: Array) -> Array:
    """A motion (V,) without its elastic coordinates."""
    out = step.copy()
    for b in range(len(place.n)):
        out[place.q_dot(b)] = 0.0
    return out


def _extent(scene: Scene, place: Layout, step: Array) -> float:
    """Of a motion (V,): the largest turn [rad] of a body, or shift over the size of the largest body."""
    shift = max(float(np.abs(step[place.R_dot(b)]).max()) for b in range(len(place.n)))
    return max(largest_turn(place, step), shift / (max(body.model.size for body in scene.bodies) or 1.0))
