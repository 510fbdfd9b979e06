"""Whether a body can move: what its modes leave of the inertia against rigid motion.

With the modes free to move, rigid motions have the inertia M_rr - M_rf M_fr (Phi is mass-orthonormal). No motion of a real
mass makes that zero or negative; integrals of files that lump masses, or leave parts of them out, can.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ffr_prep.body.frame_change import mass_of_motions, mass_of_rigid_motions
from ffr_prep.body.reduced import FlexibleBody
from ffr_prep.common.arrays import Array

_NOTHING = 1e-12
_MOTIONS = (
    "moving along x",
    "moving along y",
    "moving along z",
    "turning about x",
    "turning about y",
    "turning about z",
)


def immovable(body: FlexibleBody, active: Sequence[int] = range(6)) -> str:
    """The rigid motion that a body has no inertia left for, and why, in words; "" where it can move.

    active : the rigid motions that are free: 0 to 2 translations, 3 to 5 rotations, in body axes

    >>> immovable(rod)
    'turning about x: it has none'
    """
    rigid, heavy = list(active), math.sqrt(body.mass)
    reach = math.sqrt(max(sum(body.rr_dm.diagonal().tolist()), 0.0)) or heavy
    sizes = [heavy if c < 3 else reach for c in rigid]
    if not body.n and least_inertia(body, rigid, sizes) > _NOTHING:
        return ""
    M, scale = mass_of_motions(body), np.array(sizes)
    own, coupled = M[rigid][:, rigid], M[rigid, 6:]
    scaled = own / np.outer(scale, scale)
    values, vectors = np.linalg.eigh(scaled)
    if values[0] <= _NOTHING:
        turning = np.array(rigid) >= 3  # what has a mass, and no inertia, turns about a line
        return f"{_MOTIONS[rigid[int((turning * np.abs(vectors[:, 0])).argmax())]]}: it has none"
    if not body.n:
        return ""
    root = np.linalg.cholesky(scaled)
    taken, ways = np.linalg.eigh(_squared(np.linalg.solve(root, coupled / scale[:, None])))
    if taken[-1] < 1 - _NOTHING:
        return ""
    worst = np.linalg.solve(root.T, ways[:, -1])
    motion = _MOTIONS[rigid[int(np.abs(worst).argmax())]]
    return f"{motion}: its modes take up {taken[-1]:.3g} times what the mass gives"


def least_inertia(body: FlexibleBody, motions: Sequence[int], sizes: Sequence[float] = ()) -> float:
    """A number below all eigenvalues of the mass matrix of some rigid motions, each over its size (Gershgorin).

    sizes : by default those that make ones on the diagonal; where there are none the bound is zero
    """
    M = mass_of_rigid_motions(body)
    if not sizes and min(M[a][a] for a in motions) <= 0:
        return 0.0
    size = dict(zip(motions, sizes or [math.sqrt(M[a][a]) for a in motions], strict=True))
    rows = ([M[a][b] / (size[a] * size[b]) for b in motions] for a in motions)
    return min(2 * row[k] - sum(map(abs, row)) for k, row in enumerate(rows))


def _squared(A: Array) -> Array:
    return A @ A.T
