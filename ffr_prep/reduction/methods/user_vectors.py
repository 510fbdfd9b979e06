"""Displacement fields of one's own as a reduction: measured shapes, modes of another program."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.common.reading import reading
from ffr_prep.model.coupled import CoupledModel
from ffr_prep.reduction.basis import Basis, basis_of
from ffr_prep.solvers.factor import FreeBody, factorise

_NOTHING = 1e-9


@dataclass(frozen=True)
class UserVectors:
    """Displacement fields of one's own, as columns of a basis: measured shapes, modes of another program.

    on_nodes : (N, 3, p) at the nodes, or a function of the positions (N, 3) [m] that returns it

    Nodes that a rigid interface ties follow it as closely as they can; rotations of nodes, where a model has them, take
    the values of least strain energy.

    >>> reduction = fp.Union((fp.CraigBampton(4), fp.UserVectors(shapes)))
    """

    on_nodes: Array | Callable[[Array], Array]

    def basis(self, model: CoupledModel, body: FreeBody, L: Array) -> Basis:
        """Raises InputError when the fields do not fit the nodes, are not finite, or are rigid motions only."""
        given = np.asarray(self.on_nodes(model.points) if callable(self.on_nodes) else self.on_nodes, float)
        if given.ndim != 3 or given.shape[:2] != model.points.shape:
            raise InputError(f"user vectors have shape {given.shape}; they must be ({len(model.points)}, 3, p)")
        if not np.isfinite(given).all():
            raise InputError("user vectors hold values that are not finite")
        basis = basis_of(model, L, elastic_part(model, coordinates_of(model, given.reshape(-1, given.shape[2]))))
        if given.shape[2] and not basis.omega2.size:
            raise InputError(
                "the user vectors do not deform the body: they are rigid motions, or the reference conditions prevent them"
            )
        return basis


def read_user_vectors(path: Path) -> UserVectors:
    """The fields (N, 3, p) that a file of numpy (.npy) holds; InputError for a file that is none."""
    with reading(path, "an array of numpy (.npy)", Exception):
        return UserVectors(np.load(path, allow_pickle=False))


def elastic_part(model: CoupledModel, vectors: Array) -> Array:
    """The vectors (Z, p) without their mean rigid motion; those that are nothing else are left out."""
    momenta = model.M @ model.T
    elastic = vectors
    for _ in range(2):
        elastic = elastic - model.T @ np.linalg.solve(model.T.T @ momenta, momenta.T @ elastic)
    size = np.linalg.norm(vectors, axis=0)
    return elastic[:, np.linalg.norm(elastic, axis=0) > _NOTHING * size]


# ---- from fields on the nodes to independent coordinates ----------------------------------------------------------


def coordinates_of(model: CoupledModel, u: Array) -> Array:
    """(Z, p) independent coordinates closest to the nodal displacements u (3N, p)."""
    moves = abs(model.B).sum(axis=0) > 0
    B = sp.csr_array(model.B[:, moves])
    z = np.zeros((model.K.shape[0], u.shape[1]))
    z[moves] = factorise(sp.csr_array(B.T @ B), model.places[moves])(B.T @ u)
    if not moves.all():
        turns = ~moves
        solve = factorise(sp.csr_array(model.K[turns][:, turns]), model.places[turns])
        z[turns] = -solve(model.K[turns][:, moves] @ z[moves])
    return z
