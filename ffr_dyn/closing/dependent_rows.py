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
from ffr_prep.common.arrays import Array

YIELDS = 1e-3  # of a row of length one, what deformation has to move it by
EXACT = 1e-8  # the same, what is rounding
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
    found, moved, _ = _of_rigid_bodies(constraints, x, J)
    weak = (moved < YIELDS) & (moved > EXACT)
    owners = [block.name for block in constraints.blocks for _ in block.words]
    part = np.abs(found[:, weak]).max(axis=1, initial=0.0)
    names = dict.fromkeys(name for name, size in zip(owners, part, strict=True) if size > TAKES_PART)
    return float(moved[weak].max(initial=0.0)), list(names)


def _of_rigid_bodies(constraints: Constraints, x: Array, J: Matrix) -> tuple[Array, Array, float]:
    """(C, d) orthonormal combinations of rows that vanish for rigid bodies, (d,) by how much all that moves them does, and
    the length of the shortest that does not vanish."""
    scene, place, dense = constraints.scene, constraints.place, isinstance(J, np.ndarray)
    stiff = J @ weights(scene, place, x, False, dense)
    rigid = dependence(stiff)
    if not rigid.count or not any(place.n):
        return rigid.combinations, np.zeros(rigid.count), rigid.least
    whole = J @ weights(scene, place, x, True, dense)
    lengths = row_lengths(whole)
    Z = np.linalg.qr(rigid.combinations * (lengths / row_lengths(stiff))[:, None])[0]
    turn, moved, _ = np.linalg.svd(np.asarray((whole.T @ (Z / lengths[:, None])).T))
    return Z @ turn, np.append(moved, np.zeros(len(turn) - moved.size)), rigid.least
