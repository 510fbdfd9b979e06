"""How index-1 equations are kept on their constraints."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Projection:
    """Positions and velocities are projected, in the norm of the mass matrix, whenever Phi exceeds `tolerance`
    (or its rate a hundred times that). Costs nothing while the constraints hold. (Eich 1993.) Singular positions are stepped
    over (see `ffr_dyn.kernels.passing`).

    tolerance : of Phi [m, -]
    """

    tolerance: float = 1e-9


@dataclass(frozen=True)
class Baumgarte:
    """Phi_ddot + 2 alpha Phi_dot + beta^2 Phi = 0 in place of Phi_ddot = 0 (Baumgarte 1972).

    alpha, beta : [1/s]; beta = alpha is critical damping. Too large gains make explicit methods unstable.
    """

    alpha: float
    beta: float


@dataclass(frozen=True)
class Drifting:
    """No stabilisation: the drift is reported, not held."""


Stabilisation = Projection | Baumgarte | Drifting


def gains(stabilisation: Stabilisation) -> tuple[float, float, float]:
    """(alpha, beta, tolerance) as the kernels take them."""
    if isinstance(stabilisation, Projection):
        return 0.0, 0.0, stabilisation.tolerance
    if isinstance(stabilisation, Baumgarte):
        return stabilisation.alpha, stabilisation.beta, 0.0
    return 0.0, 0.0, 0.0
