"""Receptances at the interfaces: what a force or moment at one moves at another, by frequency.

The body is free, as in a multibody system, so that the answer does not depend on its reference conditions. Its rigid part
is exact in every reduction and is left out; what remains is, with the loss factor eta of a structural damping,

    H(omega) = sum_k (C phi_k)(C phi_k)^T / ((1 + i eta) omega_k^2 - omega^2),

over the elastic modes phi_k of the free body. A reduced basis is compared with a richer one of the same model: all
modes up to twice the band, and the first Krylov blocks of the interface loads, which make up for the modes above.

Sources: R. R. Craig, A. J. Kurdila, Fundamentals of Structural Dynamics, 2nd ed. (2006), section 17.5 (residual
flexibility); T.-J. Su, R. R. Craig, J. Guidance 14 (1991) 260-267 (Krylov vectors of undamped structures).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.model.coupled import CoupledModel
from ffr_prep.reduction.basis import Basis, basis_of
from ffr_prep.reduction.modes import modes_up_to
from ffr_prep.reduction.responses import krylov_blocks, mean_motion, static_solver
from ffr_prep.reduction.selection import Band
from ffr_prep.solvers.factor import FreeBody, supported

LOSS_FACTOR = 0.02
_RICHER = 2.0
_BLOCKS = 3
_ACCURATE = 1e-3


@dataclass(frozen=True)
class FreeModes:
    """Elastic modes of the free body: omega2 (n,) [rad^2/s^2] and interface coordinates (6I, n) per modal coordinate."""

    omega2: Array
    shapes: Array


def free_modes(model: CoupledModel, basis: Basis) -> FreeModes:
    """The elastic modes of the free body that the basis has together with the rigid motions."""
    momenta = model.M @ model.T
    rigid = np.linalg.solve(model.T.T @ momenta, momenta.T @ basis.Z)
    M = np.eye(basis.omega2.size) - (momenta.T @ basis.Z).T @ rigid
    shapes = model.C @ basis.Z - (model.C @ model.T) @ rigid
    scale = 1 / np.sqrt(np.diag(M))
    omega2, V = scipy.linalg.eigh(np.diag(basis.omega2 * scale**2), M * np.outer(scale, scale))
    return FreeModes(omega2, shapes @ (scale[:, None] * V))


def receptances(modes: FreeModes, frequencies: Array) -> Array:
    """(F, 6I, 6I) elastic receptances at frequencies (F,) [Hz]; m/N, rad/N, m/(N m), rad/(N m)."""
    amplitude = 1 / _denominators(modes, frequencies)
    return np.einsum("ak,fk,bk->fab", modes.shapes, amplitude, modes.shapes, optimize=True)


def receptance_size(modes: FreeModes, frequencies: Array) -> Array:
    """(F, 6I) size of the driving-point receptances: the sum of all modal parts without regard to their phase."""
    return (1 / np.abs(_denominators(modes, frequencies))) @ (modes.shapes**2).T


def _denominators(modes: FreeModes, frequencies: Array) -> Array:
    omega = 2 * np.pi * np.asarray(frequencies)
    return (1 + 1j * LOSS_FACTOR) * modes.omega2 - omega[:, None] ** 2


def receptance_error(modes: FreeModes, reference: FreeModes, frequencies: Array) -> Array:
    """(F,) the largest error |H_ab - H_ref,ab| / sqrt(S_a S_b) of any receptance, S being the size of the reference.

    It has no unit, does not depend on those of translations and rotations, and antiresonances do not inflate it.
    """
    difference = np.abs(receptances(modes, frequencies) - receptances(reference, frequencies))
    size = np.sqrt(receptance_size(reference, frequencies))
    return (difference / (size[:, :, None] * size[:, None, :])).max(axis=(1, 2))


def static_flexibility(modes: FreeModes) -> Array:
    """(6I, 6I) flexibility of the free body under interface loads that its inertia balances."""
    return (modes.shapes / modes.omega2) @ modes.shapes.T


# ---- the reference ------------------------------------------------------------------------------------------------


def reference_modes(model: CoupledModel, body: FreeBody, band: Band) -> tuple[FreeModes, float]:
    """Modes of a basis far richer than the band needs, and the error of the next poorer one, which bounds its own.

    Raises InputError without interfaces, ComputationError when that error is not small.
    """
    if not model.names:
        raise InputError("receptances need interfaces: give the body at least one, or choose a number of modes")
    L = mean_motion(model)
    _, modes = modes_up_to(model, supported(body, L), _RICHER * band.high)
    blocks = krylov_blocks(model, static_solver(model, body, L), _BLOCKS)
    rich = free_modes(model, basis_of(model, L, modes, *blocks))
    poorer = free_modes(model, basis_of(model, L, modes, *blocks[:-1]))
    error = float(receptance_error(poorer, rich, band.frequencies()).max())
    if not error < _ACCURATE:
        raise ComputationError(
            f"the receptances up to {band.high:g} Hz are known to {error:.1e} only: lower the upper end of the band"
        )
    return rich, error
