"""How the constraint rows of a scene depend on one another at a position.

Rows that follow from others as long as bodies are rigid may have something of their own where bodies deform, as those that
hold a bent shaft in three bearings. Modes that move next to nothing that way, as those in the plane of a rod do across it by
what its mesh lacks of symmetry, are no such deformation: bodies without others are as good as rigid there. Taken as one, it
would be all that gives way, and reactions as large as it is small.
"""

from __future__ import annotations

import numpy as np

from ffr_dyn.closing.constraints import Constraints
from ffr_dyn.closing.positions import weights
from ffr_dyn.closing.row_space import Dependence, Matrix, dependence, row_lengths
from ffr_dyn.equations.layout import Layout
from ffr_prep.common.arrays import Array

YIELDS = 1e-2  # of what moves the rows of flexible bodies, what deformation has to do against a combination of them
EXACT = 1e-8  # the same, what is rounding
ALONE = 1e-10  # of combinations of rows, the part on flexible bodies of those that have none
TAKES_PART = 1e-3  # of a row in a combination


def dependence_at(constraints: Constraints, x: Array, J: Matrix) -> Dependence:
    """How rows with the Jacobian J (C, V) at x depend on one another, those of rigid bodies that no deformation moves among
    them; combinations of the rows in units of their lengths with all that moves them."""
    found, moved, least = _of_rigid_bodies(constraints, x, J)
    vanish = moved < YIELDS
    return Dependence(found[:, vanish], min(least, float(moved[~vanish].min(initial=np.inf))))


def held_by_next_to_nothing(constraints: Constraints, x: Array, J: Matrix) -> tuple[float, list[str]]:
    """By how much deformation moves rows that `dependence_at` calls dependent, and the joints whose rows these are; none
    where that is rounding."""
    if not any(constraints.place.n):
        return 0.0, []
    found, moved, _ = _of_rigid_bodies(constraints, x, J)
    weak = (moved < YIELDS) & (moved > EXACT)
    owners = [block.name for block in constraints.blocks for _ in block.words]
    part = np.abs(found[:, weak]).max(axis=1, initial=0.0)
    names = dict.fromkeys(name for name, size in zip(owners, part, strict=True) if size > TAKES_PART)
    return float(moved[weak].max(initial=0.0)), list(names)


def _of_rigid_bodies(constraints: Constraints, x: Array, J: Matrix) -> tuple[Array, Array, float]:
    """(C, d) orthonormal combinations of rows of length one that vanish for rigid bodies, (d,) by how much deformation moves
    each, rising, and the length of the shortest that does not vanish.

    What deformation does is measured by what moves the rows of flexible bodies, row by row, so that it does not depend on how
    light the bodies beside them are.
    """
    scene, place, dense = constraints.scene, constraints.place, isinstance(J, np.ndarray)
    stiff = J @ weights(scene, place, x, False, dense)
    rigid = dependence(stiff)
    if not rigid.count or not any(place.n):
        return rigid.combinations, np.zeros(rigid.count), rigid.least
    whole = J @ weights(scene, place, x, True, dense)
    pulls = rigid.combinations / row_lengths(stiff)[:, None]
    turn, moved = _by_deformation((whole.T @ pulls).T, pulls * _on_flexible_bodies(place, whole)[:, None])
    return np.linalg.qr((pulls @ turn) * row_lengths(whole)[:, None])[0], moved, rigid.least


def _by_deformation(E: Array, F: Array) -> tuple[Array, Array]:
    """(d, d) combinations of d columns, and how long each is in E (d, V) where it has length one in F (C, d), rising; zero
    where it has none in F."""
    _, size, rows = np.linalg.svd(F, full_matrices=False)
    alone = size <= ALONE * max(float(size[0]), 1e-300)
    whitened = rows[~alone].T / size[~alone]
    turn, moved, _ = np.linalg.svd(whitened.T @ E)
    moved = np.append(moved, np.zeros(len(turn) - moved.size))[::-1]
    return np.hstack([rows[alone].T, whitened @ turn[:, ::-1]]), np.append(np.zeros(int(alone.sum())), moved)


def _on_flexible_bodies(place: Layout, whole: Matrix) -> Array:
    """(C,) the lengths of the rows with what moves flexible bodies alone."""
    columns = [k for b, n in enumerate(place.n) if n for k in range(place.iv[b], place.iv[b] + 6 + n)]
    part = whole[:, columns]
    found: Array = np.sqrt(np.asarray((part * part).sum(axis=1)).ravel())
    return found
