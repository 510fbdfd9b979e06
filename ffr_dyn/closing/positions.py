"""Positions and velocities that meet constraint rows, nearest to given ones in the norm of the mass matrix.

Heavy bodies move least. Elastic coordinates are left alone wherever rigid motion suffices. (Haug 1989, ch. 4.)
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import block_diag, csr_array

from ffr_dyn.closing.row_space import smallest_solution
from ffr_dyn.equations.constraint_rows import Block, rows_at
from ffr_dyn.equations.constraints import Row
from ffr_dyn.equations.inertia import kept_integrals, mass_matrix
from ffr_dyn.equations.layout import Layout, moved, to_global_axes
from ffr_dyn.scene.joints import DISTANCE
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError

TOLERANCE = 1e-11  # of Phi [m, -] and of its rate
ITERATIONS = 100
LARGEST_TURN = 0.5  # rad per iteration


def close_positions(scene: Scene, place: Layout, blocks: list[Block], x: Array, v: Array, time: float) -> Array:
    """Newton's method on Phi(x) = 0 with least-mass-norm steps; rigid motion first, elastic coordinates if they must.

    Raises InputError for rows that stay open.
    """
    rows: list[Row] = []
    for elastic in (False, True):
        found = x
        for iteration in range(ITERATIONS):
            rows = rows_at(scene, place, blocks, found, v, time)
            Phi = np.array([row.Phi for row in rows])
            closed = np.abs(Phi).max(initial=0.0) < TOLERANCE
            if closed and iteration == 0:
                return found
            found = moved(place, found, _limited(place, _step(scene, place, found, rows, -Phi, elastic)))
            if closed:  # and now to rounding, which tells rows that depend on others from those that nearly do
                return found
    raise _open(blocks, rows)


def _open(blocks: list[Block], rows: list[Row]) -> InputError:
    """Of the row that stays open furthest."""
    said = [(block.name, word) for block in blocks for word in block.words]
    at = int(np.argmax([abs(row.Phi) for row in rows]))
    name, word = said[at]
    if word.kind == DISTANCE and not rows[at].jacobian.any():
        return InputError(
            f"the mechanism cannot be assembled: the points of joint {name!r} coincide, and the line between them, of no "
            "length, has no direction; place its bodies apart"
        )
    return InputError(
        f"the mechanism cannot be assembled: joint {name!r} stays open by {abs(rows[at].Phi):.3g} after {ITERATIONS} "
        "iterations; check the positions of the interfaces, the lengths of the bodies and the axes of the joints, or start "
        "closer"
    )


def close_velocities(scene: Scene, place: Layout, blocks: list[Block], x: Array, v: Array, time: float) -> Array:
    """Velocities with Phi_q v + Phi_t = 0, nearest to v; rigid motion first. Raises InputError where there are none."""
    for elastic in (False, True):
        rows = rows_at(scene, place, blocks, x, v, time)
        nu = np.array([row.nu for row in rows])
        step = _step(scene, place, x, rows, -nu, elastic)
        faster = v + to_global_axes(place, x, step)
        left = np.abs([row.nu for row in rows_at(scene, place, blocks, x, faster, time)])
        if left.size == 0 or left.max() < 1e-9 * max(1.0, float(np.abs(nu).max())):
            return faster
    names = [block.name for block in blocks for _ in block.words]
    raise InputError(
        f"no velocities meet the joints and drivers: {names[int(np.argmax(left))]!r} is left at a rate of "
        f"{left.max():.3g}; the mechanism may be locked or in a singular position at the start"
    )


def stacked(rows: list[Row], place: Layout) -> csr_array:
    """(C, V) the Jacobian of the rows."""
    starts = np.cumsum([0, *(sum(part.size for part in row.parts.values()) for row in rows)])
    columns = [np.arange(k, k + part.size) for row in rows for k, part in row.parts.items()]
    values = [part for row in rows for part in row.parts.values()]
    nothing = np.zeros(0)
    return csr_array(
        (np.concatenate([nothing, *values]), np.concatenate([nothing.astype(int), *columns]), starts),
        shape=(len(rows), place.v_size),
    )


def weights(scene: Scene, place: Layout, x: Array, elastic: bool) -> csr_array:
    """W^(1/2) (V, V) with W the inverse mass matrix; zero for coordinates that may not move."""
    blocks, known = [], dict[tuple[int, bytes, tuple[int, ...]], Array]()
    for b, body in enumerate(scene.bodies):
        q, n = x[place.q(b)], place.n[b]
        active = (*place.active(b), *range(6, 6 + n if elastic else 6))
        key = id(body.model), q.tobytes(), active
        if key not in known:
            at = np.ix_(active, active)
            values, vectors = np.linalg.eigh(mass_matrix(kept_integrals(body), q)[at])
            known[key] = np.zeros((6 + n, 6 + n))
            known[key][at] = vectors / np.sqrt(np.maximum(values, 1e-12 * values.max()))
        blocks.append(known[key])
    return csr_array(block_diag(blocks, format="csr"))


def _step(scene: Scene, place: Layout, x: Array, rows: list[Row], target: Array, elastic: bool) -> Array:
    """Smallest step (body axes) with J step = target, in the norm of the mass matrix."""
    if not rows:
        return np.zeros(place.v_size)
    W = weights(scene, place, x, elastic)
    return W @ smallest_solution(csr_array(stacked(rows, place) @ W), target)


def largest_turn(place: Layout, step: Array) -> float:
    """[rad] of a body in a step (V,)."""
    return max(float(np.linalg.norm(step[place.omega(b)])) for b in range(len(place.n)))


def _limited(place: Layout, step: Array) -> Array:
    turn = largest_turn(place, step)
    return step * min(1.0, LARGEST_TURN / turn) if turn > 0 else step
