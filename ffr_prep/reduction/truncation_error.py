"""The error of the frequencies of a reduced body that comes from the shapes that it leaves out."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from ffr_prep.body import TRUNCATION_ERROR
from ffr_prep.common.arrays import Array
from ffr_prep.model.coupled import CoupledModel
from ffr_prep.reduction.basis import Basis
from ffr_prep.solvers.factor import SupportedBody, solve_supported
from ffr_prep.solvers.threads import product

_CONVERGED = 1e-3  # of a residual over its inertia: the frequency is right to its square
_NOTHING, _ONE = 1e-14, 0.5  # of the square of a unit vector: what is less is rounding
_PROBES = 3  # steps of inverse iteration from nowhere


def truncation_error(model: CoupledModel, held: SupportedBody, basis: Basis) -> dict[str, Any]:
    """How much too high the frequencies of modes 1, 2, 4, 8 and so on are by the shapes left out, as JSON values.

    A step of inverse iteration of each of these modes, y = omega^2 K^-1 M z under the reference conditions, joins the basis,
    and Rayleigh's quotients in both together are nearly those of the whole model (Bathe, Finite Element Procedures 1996,
    section 11.6). So do steps from a random vector beside the basis, which find modes that no shape takes part in, as the
    torsion of a bar of bending modes: the modes beyond are told to be the model's of the same number, and too high. Modes of
    the model itself have none, and so do all modes of a body that has no further ones.
    """
    modes = [2**k for k in range(basis.omega2.size.bit_length())]
    chosen = np.array(modes, int) - 1
    better = _better(model, held, basis, chosen) if modes else basis.omega2
    too_high = np.sqrt(basis.omega2[chosen] / better[chosen]) - 1.0
    return {TRUNCATION_ERROR: {"modes": modes, "too_high": np.round(np.maximum(too_high, 0.0), 12).tolist()}}


def _better(model: CoupledModel, held: SupportedBody, basis: Basis, chosen: Array) -> Array:
    """(n,) the lowest Rayleigh quotients, as many as there are modes."""
    Z, omega2 = basis.Z, basis.omega2
    inertia = product(model.M, Z[:, chosen]) * omega2[chosen]
    stiff = product(model.K, Z[:, chosen])
    reactions = held.C.T @ np.linalg.lstsq(held.C.toarray().T, stiff - inertia, rcond=None)[0]
    residuals = np.linalg.norm(stiff - inertia - reactions, axis=0)
    doubtful = residuals > _CONVERGED * np.linalg.norm(inertia, axis=0)
    loads, at = inertia[:, doubtful], chosen[doubtful]
    Y = solve_supported(held, loads, np.zeros((held.C.shape[0], at.size)))[0]
    Y = _beside(model, Z, np.hstack([Y, *_probes(model, held, Z)]))
    coupling, own = (of.T @ product(model.K, Y) for of in (Z, Y))
    squares = np.block([[np.diag(omega2), coupling], [coupling.T, 0.5 * (own + own.T)]])
    sizes = np.sqrt(np.diag(squares))
    inverse = np.linalg.inv(squares / np.outer(sizes, sizes)) / np.outer(sizes, sizes)  # has all digits of the lowest
    found: Array = 1.0 / np.linalg.eigvalsh(inverse)[::-1]
    return found[: omega2.size]


def _probes(model: CoupledModel, held: SupportedBody, Z: Array) -> Iterator[Array]:
    """(Z, 1) vectors of unit mass beside the basis: of a random one, in which what is slow outweighs the rest more and more.
    None beyond as many as the model has."""
    y, supports = np.random.default_rng(0).standard_normal((len(Z), 1)), held.C.shape[0]
    for _ in range(min(_PROBES, len(Z) - supports - Z.shape[1])):
        y = solve_supported(held, product(model.M, _rest(model, Z, y)), np.zeros((supports, 1)))[0]
        y = _rest(model, Z, _rest(model, Z, y))  # twice, as above
        y = y / np.sqrt((y * product(model.M, y)).sum())
        yield y


def _rest(model: CoupledModel, Z: Array, Y: Array) -> Array:
    """Y without its part in the basis."""
    rest: Array = Y - Z @ (Z.T @ product(model.M, Y))
    return rest


def _beside(model: CoupledModel, Z: Array, Y: Array) -> Array:
    """(Z, m) mass-orthonormal vectors of what Y have beside the basis."""
    for least in (_NOTHING, _ONE):  # once more, as what is small in the first place is known with few digits
        Y = _rest(model, Z, Y)
        squares, V = np.linalg.eigh(Y.T @ product(model.M, Y))
        Y = Y @ (V[:, squares > least] / np.sqrt(squares[squares > least]))
    return Y
