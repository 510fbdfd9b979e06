"""Checks of matrices from outside: symmetric, of a free body in one piece, with a mass that is one."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.matrices.model import MatrixModel, component_in_words, node_in_words, row_in_words
from ffr_prep.matrices.nodal_inertia import rigid_motions
from ffr_prep.model.coupled import CoupledModel, in_words
from ffr_prep.solvers.cholesky import cholesky, solve_cholesky

_SYMMETRIC = 1e-8
_FREE = 1e-6
_FEW_DIGITS = 1e-11
_ONE_MASS = 1e-6
_DEFINITE = 1e-10
_ZERO_ENERGY = 1e-13
_NO_STIFFNESS = 1e-14
_SHIFT = 1e-9
_BLOCK = 14


def check_matrices(model: MatrixModel) -> None:
    """Raises InputError for matrices that are not those of a free body.

    Guarded: nodes without all three translations, K or M not symmetric, a negative or indefinite mass, a mass that
    differs by direction, forces under a rigid motion.
    """
    _check_translations(model)
    check_symmetric(model)
    _check_mass(model)
    _check_one_mass(model)
    _check_free(model)


def _check_translations(model: MatrixModel) -> None:
    rows = model.dofs.translations()
    short = np.flatnonzero((rows < 0).any(axis=1))
    if short.size:
        missing = [component_in_words(int(k)) for k in np.flatnonzero(rows[short[0]] < 0)]
        raise InputError(
            f"{node_in_words(model, short[0])} has no row for {', '.join(missing)} ({short.size} such nodes): it is "
            "supported, or the model is planar; give the matrices of the free body in space, without boundary conditions"
        )


def check_symmetric(model: MatrixModel) -> None:
    """Raises InputError where K, M or C is not symmetric."""
    for name, A in model.matrices.items():
        _check_symmetric(model, name, A)


def _check_symmetric(model: MatrixModel, name: str, A: sp.csr_array) -> None:
    diagonal = np.sqrt(np.abs(A.diagonal()))
    scale = sp.diags_array(1 / np.where(diagonal > 0, diagonal, 1.0))
    skew = sp.coo_array(scale @ (A - A.T) @ scale)
    worst = int(np.argmax(np.abs(skew.data))) if skew.nnz else 0
    if skew.nnz and abs(skew.data[worst]) > _SYMMETRIC * max(1.0, abs(scale @ A @ scale).max()):
        i, j = sorted((int(skew.row[worst]), int(skew.col[worst])))
        raise InputError(
            f"{name} is not symmetric: its entries for {row_in_words(model, i)} and {row_in_words(model, j)} are "
            f"{A[i, j]:.6g} and {A[j, i]:.6g}; gyroscopic, follower-load or contact terms cannot be reduced, so give the "
            "matrices of the linear structure alone"
        )


# ---- mass ---------------------------------------------------------------------------------------------------------


def _check_mass(model: MatrixModel) -> None:
    diagonal = model.M.diagonal()
    worst = int(np.argmin(diagonal))
    if diagonal[worst] < 0:
        raise InputError(
            f"M has the negative mass {diagonal[worst]:.6g} for {row_in_words(model, worst)} "
            f"({np.sum(diagonal < 0)} such rows): take a consistent mass, or a lumping that keeps masses positive"
        )
    massless = diagonal == 0
    coupled = np.flatnonzero(massless & (np.asarray(abs(model.M).sum(axis=1)).ravel() > 0))
    if coupled.size:
        raise InputError(
            f"M is not positive: {row_in_words(model, coupled[0])} has no mass of its own, but is coupled to others: give it "
            "mass, or leave the coupling out"
        )
    if not massless.all() and not _is_positive(model, _DEFINITE):
        raise InputError(
            "M is not positive: some motions have a negative kinetic energy; look for negative masses in rigid elements or "
            "offsets of lumped masses"
        )


def mass_is_singular(model: MatrixModel) -> bool:
    """Whether some nodal motion has no mass, as rotations of lumped masses have none."""
    return bool((model.M.diagonal() == 0).any()) or not _is_positive(model, -_DEFINITE)


def _is_positive(model: MatrixModel, shift: float) -> bool:
    """Whether the rows with mass, scaled to a unit diagonal and shifted by a multiple of I, are positive definite."""
    massive = np.flatnonzero(model.M.diagonal() > 0)
    M = model.M[massive][:, massive]
    scale = sp.diags_array(1 / np.sqrt(M.diagonal()))
    try:
        cholesky(
            sp.csr_array(scale @ M @ scale + shift * sp.eye_array(massive.size)), model.points[model.nodes[massive]]
        )
    except np.linalg.LinAlgError:
        return False
    return True


def _check_one_mass(model: MatrixModel) -> None:
    """The mass of a body is the same number in every direction, and its first moment one vector."""
    T = rigid_motions(model.points, model.dofs)
    rigid = T.T @ (model.M @ T)
    mass = np.trace(rigid[:3, :3]) / 3
    if not mass > 0:
        raise InputError(f"the mass of the model is {mass:.6g} kg; M must hold the mass of the body")
    if np.abs(rigid[:3, :3] - mass * np.eye(3)).max() > _ONE_MASS * mass:
        raise InputError(
            f"the mass differs by direction: {in_words(np.diag(rigid[:3, :3]), mass)} kg along x, y, z; leave out added or "
            "directional masses, or supports whose rows are missing"
        )
    moment = rigid[:3, 3:]
    size = np.sqrt(mass * np.trace(rigid[3:, 3:]))
    if np.abs(moment + moment.T).max() > _ONE_MASS * size:
        raise InputError(
            "the first moment of the mass is not one vector: M couples a translation with the rotation about its own axis; "
            "check the order of the rows and the coordinate systems of the nodes (they must be the axes of the body)"
        )


# ---- stiffness ----------------------------------------------------------------------------------------------------


def stiffness_residual(model: MatrixModel) -> Array:
    """(D, 6) forces under the six rigid motions about the mean of the nodes, each scaled by the root of the row's
    stiffness and beside the largest sum of absolute terms: the precision of K where the body is free."""
    T = rigid_motions(model.points - model.points.mean(axis=0), model.dofs)
    diagonal = np.abs(model.K.diagonal())
    scale = 1 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0))[:, None]
    allowed = (scale * (abs(model.K) @ np.abs(T))).max(axis=0)
    return scale * np.abs(model.K @ T) / np.where(allowed > 0, allowed, 1.0)


def precision_warnings(model: MatrixModel) -> list[str]:
    """A warning where K is free of forces under rigid motion only to a few digits."""
    worst = float(stiffness_residual(model).max())
    if worst <= _FEW_DIGITS:
        return []
    return [
        f"the stiffness resists rigid motions with {worst:.1e} of its own size: written with few digits, or held by "
        "soft supports, which are ignored; low frequencies of slender bodies may suffer"
    ]


def _check_free(model: MatrixModel) -> None:
    residual = stiffness_residual(model)
    if residual.max() <= _FREE:
        return
    row, motion = np.unravel_index(np.argmax(residual), residual.shape)
    raise InputError(
        f"K resists the rigid {component_in_words(int(motion))} ({residual.max():.1e} of its own size, most at "
        f"{row_in_words(model, int(row))}): the model is supported, so give the free body without boundary conditions, and "
        "the reference conditions here; or the file has fewer than seven digits; or its nodes, their order, unit or axes are "
        "not those of the matrices"
    )


def check_connected(model: MatrixModel, coupled: CoupledModel, ties: sp.csr_array) -> None:
    """Raises InputError for a model in several parts, naming a node of the smallest.

    ties : (D, Z) the rows from the independent coordinates
    """
    shape = (len(model.points), len(model.nodes))
    of_nodes = sp.csr_array((np.ones(shape[1]), (model.nodes, np.arange(shape[1]))), shape=shape) @ abs(ties)
    parts, labels = connected_components(abs(coupled.K) + of_nodes.T @ of_nodes, directed=False)
    if parts > 1:
        smallest = int(np.argmin(np.bincount(labels)))
        raise InputError(
            f"the stiffness falls into {parts} parts that nothing connects; the smallest holds "
            f"{_in_words(model, ties, int(np.argmax(labels == smallest)))}: join the parts with a rigid interface, leave out "
            "what nothing holds, or give each part as a body of its own"
        )


def check_mechanisms(model: MatrixModel, coupled: CoupledModel, ties: sp.csr_array) -> None:
    """Raises InputError naming the node where K lets the body move without energy beside the rigid motions."""
    loose = np.flatnonzero(coupled.K.diagonal() <= _NO_STIFFNESS * (ties * ties).T @ _of_kind(model))
    if loose.size:
        raise InputError(
            f"K gives {_in_words(model, ties, int(loose[0]))} no stiffness ({loose.size} such coordinates): attach it, or "
            "leave its row out"
        )
    energies, shapes = _lowest(coupled)
    free = int(np.sum(energies < _ZERO_ENERGY))
    if free:
        row = int(np.argmax(np.abs(ties @ shapes[:, 0])))
        raise InputError(
            f"K has {free}{' or more' if free == len(energies) else ''} motions without energy beside the six rigid ones; "
            f"the first moves {row_in_words(model, row)} most: look there for parts, nodes or rotations that nothing holds"
        )


def _in_words(model: MatrixModel, ties: sp.csr_array, coordinate: int) -> str:
    """The row that an independent coordinate moves most."""
    return row_in_words(model, int(np.argmax(np.abs(ties[:, [coordinate]].toarray()))))


def _of_kind(model: MatrixModel) -> Array:
    """(D,) the largest stiffness of a translation for translations, of a rotation for rotations."""
    diagonal, turning = model.K.diagonal(), model.components >= 3
    return np.where(turning, diagonal[turning].max(initial=0.0), diagonal[~turning].max(initial=0.0))


def _lowest(coupled: CoupledModel) -> tuple[Array, Array]:
    """Energies (b,) beside unit scaled norm, ascending, and shapes (Z, b) of the softest motions apart from rigid ones.

    Inverse iteration on the stiffness scaled to a unit diagonal, shifted by a little to be definite.
    """
    scale = 1 / np.sqrt(coupled.K.diagonal())
    S = sp.diags_array(scale)
    K = sp.csr_array(S @ coupled.K @ S)
    rigid, _ = np.linalg.qr(coupled.T / scale[:, None])
    try:
        factor = cholesky(sp.csr_array(K + _SHIFT * sp.eye_array(K.shape[0])), coupled.places)
    except np.linalg.LinAlgError:
        raise InputError(
            "K is not positive: some motions have a negative energy, as with Lagrange multipliers, loads that soften the "
            "structure beyond buckling, or too few digits in the file; give the stiffness of the unloaded structure alone"
        ) from None
    block = np.random.default_rng(0).standard_normal((K.shape[0], min(_BLOCK, K.shape[0] - 6)))
    for _ in range(4):
        block = solve_cholesky(factor, block - rigid @ (rigid.T @ block))
        block, _ = np.linalg.qr(block - rigid @ (rigid.T @ block))
    energies, vectors = np.linalg.eigh(block.T @ (K @ block))
    return energies, scale[:, None] * (block @ vectors)
