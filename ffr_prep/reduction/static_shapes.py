"""Static shapes: the response to loads at the interfaces and to inertia, and shapes that the user has.

Joined to normal modes by `Union`, they let a reduced body deform exactly as the full model under steady loads: its sag
under gravity, its growth under spin. The body is free, so each load is balanced by the inertia of the rigid motion that
it causes (inertia relief); where the reference conditions restrict the deformation, they hold it instead.

Sources: R. M. Hintz, AIAA Journal 13 (1975) 1007-1016 (attachment modes, inertia relief); R. R. Craig, A. J. Kurdila,
Fundamentals of Structural Dynamics, 2nd ed. (2006), chapter 17.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from ffr_prep.common.errors import InputError
from ffr_prep.model.coupled import CoupledModel
from ffr_prep.reduction.basis import Basis, basis_of
from ffr_prep.reduction.krylov import mean_motion, static_solver
from ffr_prep.solvers.factor import FreeBody, factorise

Array = np.ndarray

_NOTHING = 1e-9


@dataclass(frozen=True)
class AttachmentModes:
    """Static response of the free body to a unit force along, and a unit moment about, each axis at each interface."""

    def basis(self, model: CoupledModel, body: FreeBody, L: Array) -> Basis:
        """Raises InputError without interfaces."""
        if not model.names:
            raise InputError("attachment modes need at least one interface")
        return basis_of(model, L, attachment_modes(model, body, L))


@dataclass(frozen=True)
class InertiaRelief:
    """Static response to unit accelerations of the body: three of translation, three of rotation, six of spin.

    The interfaces are held, so with the static shapes of the interfaces (`CraigBampton`, `Rubin`, `Guyan`) every steady
    deformation under gravity, acceleration and spin is exact, whichever interfaces carry the load. A body without
    interfaces is free.
    """

    def basis(self, model: CoupledModel, body: FreeBody, L: Array) -> Basis:
        """Raises InputError for a model that does not know its inertial loads."""
        return basis_of(model, L, inertia_relief_modes(model, body, L))


@dataclass(frozen=True)
class UserVectors:
    """Displacement fields of one's own, as columns of a basis: measured shapes, modes of another program.

    on_nodes : (N, 3, p) at the nodes, or a function of the positions (N, 3) [m] that returns it

    Nodes that a rigid interface ties follow it as closely as they can; rotations of nodes, where a model has them, take
    the values of least strain energy.
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


def attachment_modes(model: CoupledModel, body: FreeBody, L: Array) -> Array:
    """(Z, 6I) static response to unit interface loads."""
    return _response(model, body, L if len(L) > 6 else mean_motion(model), model.C.toarray().T)


def inertia_relief_modes(model: CoupledModel, body: FreeBody, L: Array) -> Array:
    """(Z, 12) or fewer static responses to unit accelerations; loads that nothing but the supports carry give none."""
    if len(L) > 6 or not model.names:
        return _response(model, body, L, inertial_loads(model))
    return _response(model, body, model.C.toarray(), inertial_loads(model))


def inertial_loads(model: CoupledModel) -> Array:
    """(Z, 12) loads of unit accelerations; InputError for a model that does not know them."""
    if model.inertial_loads is None:
        raise InputError("this model does not know its inertial loads: leave out inertia relief and the quality report")
    return model.inertial_loads


def _response(model: CoupledModel, body: FreeBody, supports: Array, loads: Array) -> Array:
    """(Z, r) static response; without the columns whose loads the supports carry without any deformation."""
    response = static_solver(model, body, supports)(loads)
    energy = np.einsum("zi,zi->i", response, loads)
    scale = np.einsum("zi,zi->i", np.abs(response), np.abs(loads))
    return response[:, np.abs(energy) > _NOTHING * scale]


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
    moves = np.diff(sp.csc_array(model.B).indptr) > 0
    B = sp.csr_array(model.B[:, moves])
    z = np.zeros((model.K.shape[0], u.shape[1]))
    z[moves] = factorise(sp.csr_array(B.T @ B), model.places[moves])(B.T @ u)
    if not moves.all():
        turns = ~moves
        solve = factorise(sp.csr_array(model.K[turns][:, turns]), model.places[turns])
        z[turns] = -solve(model.K[turns][:, moves] @ z[moves])
    return z
