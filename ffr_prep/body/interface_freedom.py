"""How freely the interfaces of a body move against each other, beside its six rigid motions."""

from __future__ import annotations

import numpy as np

from ffr_prep.body import FlexibleBody, Interface
from ffr_prep.common.arrays import Array

_INDEPENDENT = 1e-8


def interface_freedom(body: FlexibleBody) -> tuple[int, int]:
    """How many independent motions of all interface coordinates the body has, rigid ones included, and their number."""
    arms = [np.linalg.norm(i.position - body.centre_of_mass) for i in body.interfaces]
    length = float(max(arms)) or 1.0
    motions = np.vstack([_motions(i, length) for i in body.interfaces])
    norms = np.linalg.norm(motions, axis=0)
    moves = norms > _INDEPENDENT * np.concatenate([np.ones(6), np.full(body.n, 1 / np.sqrt(body.mass))])
    unit = motions[:, moves] / norms[moves]
    return int(np.linalg.matrix_rank(unit, tol=_INDEPENDENT)), len(motions)


def _motions(interface: Interface, length: float) -> Array:
    """(6, 6 + n) translation and rotation (times a length) of an interface in rigid and elastic motions."""
    turning = np.cross(np.eye(3), interface.position).T
    translation = np.hstack([np.eye(3), turning, interface.phi_t])
    rotation = np.hstack([np.zeros((3, 3)), np.eye(3), interface.phi_r])
    return np.vstack([translation, length * rotation])
