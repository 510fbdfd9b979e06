"""Positions and velocities that meet constraint rows, nearest to given ones in the norm of the mass matrix.

Heavy bodies move least. Elastic coordinates are left alone wherever rigid motion suffices. (Haug 1989, ch. 4.)
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import block_diag, coo_array, csr_array

from ffr_dyn.closing.constraints import Constraints, RowsAt, open_at, rows_at
from ffr_dyn.closing.row_space import Matrix, smallest_solution
from ffr_dyn.equations.inertia import kept_integrals, mass_matrix
from ffr_dyn.equations.layout import Layout, meets, moved, to_global_axes
from ffr_dyn.scene.joints import DISTANCE
from ffr_dyn.scene.scene import Body, Scene, length_of
from ffr_prep.body import remembered
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError

TOLERANCE = 1e-11  # of Phi [m, -] and of its rate
ITERATIONS = 100
LARGEST_TURN = 0.5  # rad per iteration
ROUNDED = 1e-3  # of the size of the scene, what stays open where numbers have few digits
FARTHEST = 1e4  # times what is open: how far a body is turned to close it while bodies can deform instead


def close_positions(constraints: Constraints, x: Array, v: Array) -> Array:
    """Newton's method on Phi(x) = 0 with least-mass-norm steps; rigid motion first, elastic coordinates if they must.

    A shaft whose bores are a hair off their line is not turned about it to make the best of the hair, but deformed by it.

    Raises InputError for rows that stay open.
    """
    place = constraints.place
    if meets(constraints.scene, x, open_at(constraints, x, v)[0], TOLERANCE):
        return x
    start, length = x, length_of(constraints.scene)
    for elastic in (False, True):
        found, nearest = start, np.inf
        for _ in range(ITERATIONS):
            rows = rows_at(constraints, found, v)
            left, met = np.abs(rows.Phi).max(initial=0.0), meets(constraints.scene, found, rows.Phi, TOLERANCE)
            if not elastic and left < nearest:  # from where bodies deform, if they must, by as little as they can
                start, nearest = found, left
            step = _step(constraints, found, rows, -rows.Phi, elastic)
            if not elastic and not met and any(place.n) and length * largest_turn(place, step) > FARTHEST * left:
                break
            found = moved(place, found, _limited(place, step))
            if met:  # and now to rounding, which tells rows that depend on others from those that nearly do
                return found
    raise _open(constraints, rows)


def _open(constraints: Constraints, rows: RowsAt) -> InputError:
    """Of the row that stays open furthest."""
    said = [(block.name, word) for block in constraints.blocks for word in block.words]
    at = int(np.argmax(np.abs(rows.Phi)))
    name, word = said[at]
    if word.kind == DISTANCE and not abs(rows.J[[at]]).max() > 0:
        return InputError(
            f"the mechanism cannot be assembled: the points of joint {name!r} coincide, and the line between them, of no "
            "length, has no direction; place its bodies apart"
        )
    left = f"the mechanism cannot be assembled: joint {name!r} stays open by {abs(rows.Phi[at]):.3g}"
    if abs(rows.Phi[at]) < ROUNDED * length_of(constraints.scene):
        return InputError(
            f"{left}, as where joints fix the same twice and their numbers are rounded: give positions and axes with all "
            "their digits, or fix each thing once, such as by a spherical joint and a point-on-line for two revolute joints"
        )
    return InputError(
        f"{left} after {ITERATIONS} iterations; check the positions of the interfaces, the lengths of the bodies and the "
        "axes of the joints, or start closer"
    )


def close_velocities(constraints: Constraints, x: Array, v: Array, rows: RowsAt | None = None) -> Array:
    """Velocities with Phi_q v + Phi_t = 0, nearest to v; rigid motion first. Raises InputError where there are none.

    rows : those at (x, v), where they are known
    """
    place, rows = constraints.place, rows or rows_at(constraints, x, v)
    left = np.zeros(0)
    for elastic in (False, True):
        step = _step(constraints, x, rows, -rows.nu, elastic)
        faster = v + to_global_axes(place, x, step)
        left = np.abs(open_at(constraints, x, faster)[1])
        if left.size == 0 or left.max() < 1e-9 * max(1.0, float(np.abs(rows.nu).max())):
            return faster
    names = [block.name for block in constraints.blocks for _ in block.words]
    raise InputError(
        f"no velocities meet the joints and drivers: {names[int(np.argmax(left))]!r} is left at a rate of "
        f"{left.max():.3g}; the mechanism may be locked or in a singular position at the start: start from another"
    )


def rigid_jacobian(constraints: Constraints, x: Array) -> tuple[Array, Array]:
    """W^(1/2) (V, r) of the r rigid motions that there are, and J W^(1/2) (C, r) at x, dense."""
    J = rows_at(constraints, x, np.zeros(constraints.place.v_size)).J
    W = np.asarray(weights(constraints.scene, constraints.place, x, False, True))
    W = W[:, W.any(axis=0)]
    return W, (J if isinstance(J, np.ndarray) else J.toarray()) @ W


def weights(scene: Scene, place: Layout, x: Array, elastic: bool, dense: bool) -> Matrix:
    """W^(1/2) (V, V) with W the inverse mass matrix; zero for coordinates that may not move."""
    roots = [_root(body, x[place.q(b)], tuple(place.active(b)), elastic) for b, body in enumerate(scene.bodies)]
    if not dense:
        return csr_array(block_diag([coo_array(root) for root in roots], format="csr"))
    W = np.zeros((place.v_size, place.v_size))
    for first, root in zip(place.iv, roots, strict=True):
        W[first : first + len(root), first : first + len(root)] = root
    return W


def _root(body: Body, q: Array, rigid: tuple[int, ...], elastic: bool) -> Array:
    """(6 + n, 6 + n) of one body, which bodies of one model and state share."""
    n = body.model.n
    active = (*rigid, *range(6, 6 + n if elastic else 6))

    def make() -> Array:
        columns = np.array(active)
        rows = columns[:, None]
        values, vectors = np.linalg.eigh(mass_matrix(kept_integrals(body), q)[rows, columns])
        root = np.zeros((6 + n, 6 + n))
        root[rows, columns] = vectors / np.sqrt(np.maximum(values, 1e-12 * values.max()))
        return root

    if q.any():
        return make()
    return remembered(body.model, ("root of mass", body.dropped, body.stiffening, active), make)


def _step(constraints: Constraints, x: Array, rows: RowsAt, target: Array, elastic: bool) -> Array:
    """Smallest step (body axes) with J step = target, in the norm of the mass matrix."""
    if not target.size:
        return np.zeros(constraints.place.v_size)
    W = weights(constraints.scene, constraints.place, x, elastic, isinstance(rows.J, np.ndarray))
    step: Array = W @ smallest_solution(rows.J @ W, target)
    return step


def largest_turn(place: Layout, step: Array) -> float:
    """[rad] of a body in a step (V,)."""
    return max(float(np.linalg.norm(step[place.omega(b)])) for b in range(len(place.n)))


def _limited(place: Layout, step: Array) -> Array:
    turn = largest_turn(place, step)
    return step * min(1.0, LARGEST_TURN / turn) if turn > 0 else step
