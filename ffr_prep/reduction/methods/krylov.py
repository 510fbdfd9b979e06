"""Krylov vectors: bases that match the response to interface loads at chosen frequencies.

With  H(omega) = C (K - omega^2 M)^-1 C^T  the vectors

    V_1 = (K - omega^2 M)^-1 C^T,    V_2 = (K - omega^2 M)^-1 M V_1,  ...

span a space whose receptances agree with those of the model in the first 2 m derivatives by omega^2, m being the number
of blocks. At frequency zero the body is free, and the inertia of its rigid motion balances the loads.

Sources: T.-J. Su, R. R. Craig, J. Guidance 14 (1991) 260-267; B. Salimbahrami, B. Lohmann, Linear Algebra and its
Applications 415 (2006) 385-405 (order reduction of second-order systems, several expansion points).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg

from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.model.coupled import CoupledModel
from ffr_prep.reduction.basis import Basis, basis_of, check_interfaces
from ffr_prep.reduction.responses import free_supports, krylov_blocks, static_solver
from ffr_prep.solvers.factor import FreeBody

_ACCURATE = 1e-6


@dataclass(frozen=True)
class Krylov:
    """Response to the interface loads and its derivatives by the squared frequency, at one or several frequencies.

    moments     : blocks of six vectors per interface at each frequency
    frequencies : (f,) where the receptances are matched [Hz]; each other than zero costs a factorisation of K - omega^2 M

    Raises InputError for less than one block, for no frequency and for a negative one.

    >>> request = fp.Request(name="rod", reference=fp.MeanAxis(), reduction=fp.Krylov(2))
    """

    moments: int
    frequencies: tuple[float, ...] = (0.0,)

    def __post_init__(self) -> None:
        if self.moments < 1:
            raise InputError(f"Krylov vectors of {self.moments} moments: ask for at least one")
        if not self.frequencies or not all(0 <= f < np.inf for f in self.frequencies):
            raise InputError(f"Krylov vectors at {self.frequencies} Hz: give one or more frequencies, none negative")

    def basis(self, model: CoupledModel, body: FreeBody, L: Array) -> Basis:
        """Raises InputError without interfaces, ComputationError where a frequency is a natural frequency of the body."""
        check_interfaces(model, "a basis of Krylov vectors")
        asked, most = self.moments * len(self.frequencies) * model.C.shape[0], model.K.shape[0] - len(L)
        if asked > most:
            raise InputError(
                f"Krylov vectors of {self.moments} moments at {len(self.frequencies)} frequencies: these are {asked} vectors "
                f"for a model with {most} free degrees of freedom; ask for fewer"
            )
        solvers = [_solver(model, body, L, frequency) for frequency in self.frequencies]
        return basis_of(model, L, *(block for solve in solvers for block in krylov_blocks(model, solve, self.moments)))


def _solver(model: CoupledModel, body: FreeBody, L: Array, frequency: float) -> Callable[[Array], Array]:
    if frequency == 0:
        return static_solver(model, body, free_supports(model, L))
    return dynamic_solver(model, frequency)


def dynamic_solver(model: CoupledModel, frequency: float) -> Callable[[Array], Array]:
    """Loads (Z, r) -> amplitudes (Z, r) of the free, undamped vibration at a frequency [Hz].

    Raises ComputationError where the frequency is a natural one.
    """
    A = sp.csc_array(model.K - (2 * np.pi * frequency) ** 2 * model.M)
    try:
        factor: Any = scipy.sparse.linalg.splu(A)  # indefinite, so with pivoting
    except RuntimeError as error:
        raise ComputationError(
            f"at {frequency:g} Hz the vibration has no finite amplitude ({error}): it is a natural frequency of the body; "
            "choose another"
        ) from None

    def solve(loads: Array) -> Array:
        response = factor.solve(loads)
        response = response + factor.solve(loads - A @ response)
        left = np.linalg.norm(loads - A @ response)
        if not left <= _ACCURATE * np.linalg.norm(loads):
            raise ComputationError(
                f"at {frequency:g} Hz the response misses equilibrium by {left:.1e} N: it is a natural frequency of the "
                "body; choose another"
            )
        return response

    return solve
